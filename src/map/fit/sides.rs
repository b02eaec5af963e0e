//! Split sides (Lloyd, Govindaraju, Quammen, Molnar, Manocha 2008): the light's image parted by the faces of the view's frustum, each
//! of which has a map along its own way from the eye.
//!
//! A ray of light enters the frustum through one face and leaves it through one. Either kind of faces covers the frustum's image
//! once, parted by the images of the edges between them. Of the two ends of a ray the one nearer to the eye needs the finer texels, so
//! that light which travels with the gaze is parted by the faces that it enters, other light by those that it leaves.

use super::lixel::{Plane, nearest_w, onto};
use super::{LightImage, Scope, hull};
use glam::{DMat3, DVec2, DVec3, DVec4};

/// A face's part of the light's image.
#[derive(Clone, Debug)]
pub struct Side {
    /// Which face, by its place in [`super::Eye::planes`]: 0 the near, 1 the far one.
    pub face: usize,
    /// A surface belongs to the side of whose row dot(row, (X, 1)) is the largest.
    pub row: DVec4,
    /// Of the light's image: y along the face away from the eye, w proportional to the depth of the face's point on a ray.
    pub warp: DMat3,
    /// The step along the face with a depth of 1 m; zero: the face lies at one depth, and texels are even.
    pub along: DVec3,
    /// The corners of its part of the light's image, in order around it.
    pub points: Vec<DVec2>,
}

impl Side {
    /// Of its part of the light's image, square metres.
    pub fn area(&self) -> f64 {
        area(&self.points)
    }
}

/// Share of the image below which a face is left to its neighbours, where they can take its part.
const LEAST: f64 = 0.05;

/// The sides of what the camera sees and the light reaches, whose corners are `body`; none if that has no image.
pub fn fit(scope: &Scope, image: &LightImage, body: &[DVec3]) -> Vec<Side> {
    let whole = hull::hull(&body.iter().map(|p| image.at(*p)).collect::<Vec<_>>());
    if whole.len() < 3 {
        return Vec::new();
    }
    let mut sides = candidates(scope, image, body);
    part(&whole, image, scope, &mut sides);
    let share = |s: &Side| area(&s.points) / area(&whole).max(f64::MIN_POSITIVE);
    let first = body.iter().map(|p| scope.eye().depth(*p)).fold(f64::INFINITY, f64::min);
    // What has no part goes, and then the smallest, one by one, while all that is left can be seen along the others.
    sides.retain(|s| share(s) > 1e-9);
    loop {
        let small = sides.iter().enumerate().filter(|(_, s)| share(s) < LEAST && sides.len() > 1);
        let mut order: Vec<usize> = small.map(|(i, _)| i).collect();
        order.sort_by(|a, b| share(&sides[*a]).total_cmp(&share(&sides[*b])));
        let fewer = order.into_iter().find_map(|i| {
            let mut fewer = sides.clone();
            fewer.remove(i);
            part(&whole, image, scope, &mut fewer);
            let seen = |s: &Side| s.points.iter().all(|p| depth(s, *p) > 0.5 * first);
            fewer.iter().all(seen).then_some(fewer)
        });
        match fewer {
            Some(fewer) => sides = fewer,
            None => return sides,
        }
    }
}

/// Depth along the view's axis of the point of a side's face on a ray, metres; infinite on a face at one depth.
fn depth(side: &Side, p: DVec2) -> f64 {
    // The second row is the homogeneous -1.
    let q = side.warp * p.extend(1.0);
    if side.along == DVec3::ZERO { f64::INFINITY } else { -q.z / q.y }
}

/// Parts the image's hull among sides by the rows of each, and scales their w to be positive, 1 at least.
fn part(whole: &[DVec2], image: &LightImage, scope: &Scope, sides: &mut [Side]) {
    let lamp = scope.light.view_tangent().is_some();
    let [right, up, axis] = [image.rows[0], image.rows[1], image.depth].map(|r| r.truncate());
    // Over (a, b, 1) in the light's image: of a point on the ray.
    let flat = |row: DVec4| {
        let v = row.truncate();
        DVec3::new(v.dot(right), v.dot(up), if lamp { v.dot(axis) } else { row.w })
    };
    let rows: Vec<DVec3> = sides.iter().map(|s| flat(s.row)).collect();
    for (i, side) in sides.iter_mut().enumerate() {
        let others = rows.iter().enumerate().filter(|(k, _)| *k != i);
        side.points = others.fold(whole.to_vec(), |points, (_, other)| {
            hull::halved(&points, |p| (rows[i] - *other).dot(p.extend(1.0)))
        });
        let least = nearest_w(&side.warp, &side.points);
        if least.is_finite() && least != 0.0 {
            side.warp *= 1.0 / least;
        }
    }
}

fn area(points: &[DVec2]) -> f64 {
    let next = |i: usize| points[(i + 1) % points.len()];
    points.iter().enumerate().map(|(i, p)| p.perp_dot(next(i))).sum::<f64>().abs() / 2.0
}

/// The faces that light enters or leaves by, without their parts.
fn candidates(scope: &Scope, image: &LightImage, body: &[DVec3]) -> Vec<Side> {
    let eye = scope.eye();
    let size = (scope.bounds[1] - scope.bounds[0]).as_dvec3().length();
    let lamp = scope.light.view_tangent().map(|_| scope.light.position().as_dvec3());
    let axis = image.depth.truncate();
    let middle = body.iter().sum::<DVec3>() / body.len() as f64;
    let travels = lamp.map_or(axis, |at| middle - at);
    // Heights of the light over each face, positive inside; a sun's by the way it travels.
    let planes = eye.planes().map(|p| p / p.truncate().length());
    let height = |p: &DVec4| lamp.map_or(-p.truncate().dot(axis), |at| p.dot(at.extend(1.0)) / size);
    let enters = travels.dot(eye.forward) >= 0.0 && planes.iter().any(|p| height(p) < -1e-6);
    let row = |v: DVec3| v.extend(-v.dot(eye.position));
    let mut sides = Vec::new();
    for (face, plane) in planes.into_iter().enumerate() {
        let height = height(&plane);
        if if enters { height > -1e-6 } else { height < 1e-6 } {
            continue;
        }
        let normal = plane.truncate();
        // How far along its ray a point has gone from the face it enters by, which is the last of all, or how far it is to the
        // one it leaves by, the first: the largest of these, less what they share.
        let row_of = match lamp {
            Some(at) => {
                let slope = normal / (height * size);
                let slope = if enters { slope } else { -slope };
                slope.extend(-slope.dot(at))
            }
            None => plane / height * if enters { 1.0 } else { -1.0 },
        };
        let (across, along) = match face {
            0 | 1 => (eye.right, DVec3::ZERO),
            2 => (eye.up, eye.forward - eye.right * eye.tangent.x),
            3 => (eye.up, eye.forward + eye.right * eye.tangent.x),
            4 => (eye.right, eye.forward - eye.up * eye.tangent.y),
            _ => (eye.right, eye.forward + eye.up * eye.tangent.y),
        };
        let face_plane = Plane { normal, distance: -plane.w };
        // On a face at one depth the second row is up; along the others -1, whose quotient with the depth rises.
        let second = if face < 2 { row(eye.up) } else { -DVec4::W };
        let warp = onto(scope, image, &face_plane, [row(across), second, row(eye.forward)]);
        sides.push(Side { face, row: row_of, warp, along, points: Vec::new() });
    }
    sides
}
