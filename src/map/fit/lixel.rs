//! A texel for every pixel of a plane (Chong, Gortler 2004).
//!
//! A point of the light's image is the ray of light through it; where that meets the plane of interest, the camera sees it. Both steps
//! are linear in homogeneous coordinates, so that together they are a homography from the light's image to the camera's.

use super::hull::halved;
use super::{LightImage, Scope, warped};
use crate::scene::geometry::Geometry;
use glam::{DMat3, DVec2, DVec3, DVec4};
use rayon::prelude::*;

/// The plane of the points X with n · X = distance, in scene space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Unit normal.
    pub normal: DVec3,
    /// Metres.
    pub distance: f64,
}

impl Plane {
    /// Height over the plane, metres.
    pub fn height(&self, p: DVec3) -> f64 {
        self.normal.dot(p) - self.distance
    }

    /// That of a triangle; None if that has no area.
    pub fn of([a, b, c]: [DVec3; 3]) -> Option<Plane> {
        let normal = (b - a).cross(c - a).try_normalize()?;
        Some(Plane { normal, distance: normal.dot((a + b + c) / 3.0) })
    }
}

/// A fit to what the camera sees of a plane.
#[derive(Clone, Debug)]
pub struct Lixel {
    /// From the light's image to the camera's: x and y from -1 to 1 over the picture, w positive on what is seen.
    pub warp: DMat3,
    /// The corners of what is seen of the plane within the scene's box, where the light can reach, in the light's image.
    pub seen: Vec<DVec2>,
    /// Depth of the deepest of them along the light's axis, metres.
    pub deepest: f64,
}

/// Fits the light's image to a plane, or says why that cannot be.
///
/// # Errors
/// The plane has no map: light or camera lie in it or on different sides, or none of it is seen.
pub fn fit(scope: &Scope, image: &LightImage, plane: &Plane) -> Result<Lixel, &'static str> {
    let (eye, axis) = (scope.eye(), image.depth.truncate());
    let size = (scope.bounds[1] - scope.bounds[0]).as_dvec3().length();
    let lamp = scope.light.view_tangent().map(|_| scope.light.position().as_dvec3());
    // The light's height over the plane: a sun's by the sine of its angle to it.
    let light = lamp.map_or(-plane.normal.dot(axis), |at| plane.height(at) / size);
    if light.abs() < 1e-4 {
        return Err(
            "The light lies in the plane of interest: a map of its own cannot see that, and all pixels look up the ordinary one.",
        );
    }
    // An orthographic camera stands as far off as it looks at the plane.
    let height = if eye.orthographic { -plane.normal.dot(eye.forward) * size } else { plane.height(eye.position) };
    let above = height * light.signum();
    if above.abs() < 1e-5 * size {
        return Err(
            "The camera lies in the plane of interest and sees it edge-on: all pixels look up the ordinary map.",
        );
    }
    if above < 0.0 {
        return Err(
            "The camera is behind the plane of interest, whose other side the light falls on: all pixels look up the ordinary map.",
        );
    }
    let corners = polygon(scope, plane);
    if corners.is_empty() {
        return Err(
            "The camera sees nothing of the plane of interest that the light reaches: all pixels look up the ordinary map.",
        );
    }
    let row = |v: DVec3| v.extend(-v.dot(eye.position));
    let depth = if eye.orthographic { DVec4::W } else { row(eye.forward) };
    let camera = [row(eye.right / eye.tangent.x), row(eye.up / eye.tangent.y), depth];
    let mut warp = onto(scope, image, plane, camera);
    let seen: Vec<DVec2> = corners.iter().map(|p| image.at(*p)).collect();
    // w is 1 at the nearest corner. What is seen lies before the camera, so that its sign is everywhere the same.
    warp *= 1.0 / nearest_w(&warp, &seen);
    // Where the plane is parallel to the picture and the light's image, but for rounding, no perspective is left.
    if warp.row(2).x.hypot(warp.row(2).y) * seen.iter().map(|p| p.length()).fold(0.0, f64::max) < 1e-12 {
        (warp.x_axis.z, warp.y_axis.z, warp.z_axis.z) = (0.0, 0.0, 1.0);
    }
    if !warp.is_finite() || !seen.iter().all(|p| warped(&warp, *p).1 > 0.0) {
        return Err("The plane of interest is seen too nearly edge-on: all pixels look up the ordinary map.");
    }
    Ok(Lixel { warp, seen, deepest: scope.deepest(image, &corners) })
}

/// Of the w that points have after a homography the one nearest to zero; infinite if there are none.
pub fn nearest_w(h: &DMat3, points: &[DVec2]) -> f64 {
    let ws = points.iter().map(|p| warped(h, *p).1);
    ws.fold(f64::INFINITY, |least, w| if w.abs() < f64::abs(least) { w } else { least })
}

/// The homography from the light's image by three rows over the points at which its rays meet a plane, homogeneous.
pub fn onto(scope: &Scope, image: &LightImage, plane: &Plane, rows: [DVec4; 3]) -> DMat3 {
    let lamp = scope.light.view_tangent().map(|_| scope.light.position().as_dvec3());
    let [right, up, axis] = [image.rows[0], image.rows[1], image.depth].map(|r| r.truncate());
    // Where the ray of (a, b, w) meets the plane: linear in these.
    let meets = |e: DVec3| -> DVec4 {
        match lamp {
            // L + s D, where D runs along the ray.
            Some(at) => {
                let along = right * e.x + up * e.y + axis * e.z;
                let slope = plane.normal.dot(along);
                (at * slope - along * plane.height(at)).extend(slope)
            }
            // From a point on the ray along the axis.
            None => {
                let (point, slope) = (right * e.x + up * e.y, plane.normal.dot(axis));
                (point * slope + axis * (plane.distance * e.z - plane.normal.dot(point))).extend(e.z * slope)
            }
        }
    };
    let column = |e: DVec3| DVec3::from_array(rows.map(|r| r.dot(meets(e))));
    DMat3::from_cols(column(DVec3::X), column(DVec3::Y), column(DVec3::Z))
}

/// How a picture lies in a map, so that a texel is a pixel of the plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    /// Side of a texel, pixels: 1 where the map is large enough.
    pub pixels: f64,
    /// Of the camera's image, to that of the map.
    pub placed: DMat3,
}

/// A picture of `size` pixels in the middle of a map of `side` texels, with `guard` texels around it.
pub fn grid(size: [u32; 2], side: u32, guard: f64) -> Grid {
    let (picture, side) = (DVec2::from_array(size.map(f64::from)), f64::from(side));
    let pixels = (picture.max_element() / (side - 2.0 * guard).max(0.5 * side)).max(1.0);
    let texels = picture / pixels;
    // Whole texels beside it: pixels lie on texels.
    let beside = ((DVec2::splat(side) - texels) / 2.0).floor();
    let scale = texels / side;
    let middle = (texels + 2.0 * beside) / side - 1.0;
    let placed = DMat3::from_cols(
        DVec3::new(scale.x, 0.0, 0.0),
        DVec3::new(0.0, scale.y, 0.0),
        DVec3::new(middle.x, -middle.y, 1.0),
    );
    Grid { pixels, placed }
}

/// The corners of what the camera sees of a plane inside the scene's box and the light's reach, in order around it.
fn polygon(scope: &Scope, plane: &Plane) -> Vec<DVec3> {
    let [low, high] = scope.bounds.map(|p| p.as_dvec3());
    let (middle, size) = ((low + high) / 2.0, (high - low).length().max(1e-3));
    let center = middle - plane.normal * plane.height(middle);
    let u = plane.normal.any_orthonormal_vector() * size;
    let v = plane.normal.cross(u);
    let mut corners = vec![center - u - v, center + u - v, center + u + v, center - u + v];
    // A floor is a side of the box: a little more than that.
    let spare = DVec3::splat(1e-4 * size);
    let sides = [DVec3::X, DVec3::Y, DVec3::Z]
        .into_iter()
        .flat_map(|axis| [axis.extend(-axis.dot(low - spare)), (-axis).extend(axis.dot(high + spare))]);
    for side in scope.eye().planes().into_iter().chain(scope.reach()).chain(sides) {
        corners = halved(&corners, |p| side.dot(p.extend(1.0)));
    }
    if corners.len() < 3 { Vec::new() } else { corners }
}

/// Rays across the picture by which a plane is sought.
const COLUMNS: usize = 64;
/// Most planes that are tried.
const TRIED: usize = 256;

/// The plane that most of what the camera sees and the light falls on lies within `tolerance` of, metres: by a coarse grid of rays.
/// Masked triangles count as whole. None if there is no such thing.
pub fn largest(scope: &Scope, geometry: &Geometry, tolerance: f64) -> Option<Plane> {
    struct Sample {
        at: DVec3,
        plane: Plane,
        triangle: usize,
    }
    let (eye, image) = (scope.eye(), scope.image());
    let lamp = scope.light.view_tangent().map(|_| scope.light.position().as_dvec3());
    let (reach, axis) = (scope.reach(), image.depth.truncate());
    let rows = ((COLUMNS as f64 / scope.aspect as f64).round() as usize).clamp(1, 4 * COLUMNS);
    let look = |i: usize| -> Option<Sample> {
        let share = |k: usize, of: usize| 2.0 * (k as f64 + 0.5) / of as f64 - 1.0;
        let (x, y) = (share(i % COLUMNS, COLUMNS), share(i / COLUMNS, rows));
        let (from, ray) = eye.ray(DVec2::new(x, -y));
        let (depth, triangle) = geometry.seen(from, ray, eye.near).filter(|(depth, _)| *depth < eye.far)?;
        let (at, plane) = (from + ray * depth, Plane::of(geometry.corners(triangle).map(|p| p.as_dvec3()))?);
        let light = lamp.map_or(-plane.normal.dot(axis), |l| plane.height(l));
        let lit = light * -plane.normal.dot(ray) > 0.0 && reach.iter().all(|r| r.dot(at.extend(1.0)) >= 0.0);
        lit.then_some(Sample { at, plane, triangle })
    };
    let samples: Vec<Sample> = (0..COLUMNS * rows).into_par_iter().filter_map(look).collect();
    let near =
        |of: &Plane, s: &Sample| of.height(s.at).abs() <= tolerance && of.normal.dot(s.plane.normal).abs() > 0.999;
    // Triangles with the number of their own samples: the planes of those with most are tried first.
    let mut own: Vec<(usize, usize)> = Vec::new();
    let mut of: Vec<usize> = (0..samples.len()).collect();
    of.sort_by_key(|i| (samples[*i].triangle, *i));
    for group in of.chunk_by(|a, b| samples[*a].triangle == samples[*b].triangle) {
        own.push((group.len(), group[0]));
    }
    own.sort_by_key(|(count, first)| (std::cmp::Reverse(*count), *first));
    let mut taken = vec![false; samples.len()];
    let mut best: Option<(usize, Plane)> = None;
    for (_, first) in own.into_iter().take(TRIED) {
        // One that an earlier one holds is tried no more.
        if taken[first] {
            continue;
        }
        let plane = samples[first].plane;
        let held: Vec<usize> = (0..samples.len()).filter(|i| near(&plane, &samples[*i])).collect();
        held.iter().for_each(|i| taken[*i] = true);
        let count = held.len();
        if best.is_none_or(|(most, _)| count > most) {
            best = Some((count, plane));
        }
    }
    best.map(|(_, plane)| plane)
}
