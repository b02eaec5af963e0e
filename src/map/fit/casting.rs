//! How far what is there reaches in a part of space: found in the BVH, without looking at most of it.

use super::hull::halved;
use super::{LightImage, Scope};
use crate::light::Light;
use crate::scene::bvh::Child;
use crate::scene::geometry::Geometry;
use glam::{DVec2, DVec3, DVec4};
use rayon::prelude::*;
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// The depth, by this row over (X, 1), of the nearest thing between any place of the light and what the camera may see; infinite if there
/// is nothing.
pub fn nearest(scope: &Scope, geometry: &Geometry, depth: DVec4) -> f64 {
    least(geometry, &planes(scope), |p| depth.dot(p.extend(1.0)))
}

/// A polygon around the light's image of all that the camera may see and the light reach, hidden or not: as many sides as touch it in turn.
/// Empty if there is nothing.
pub fn outline(scope: &Scope, image: &LightImage, geometry: &Geometry) -> Vec<DVec2> {
    let planes: Vec<DVec4> = scope.eye().planes().into_iter().chain(scope.reach()).collect();
    let side = |k: usize| {
        let out = DVec2::from_angle(k as f64 * std::f64::consts::TAU / SIDES as f64);
        let along = |p: DVec3| {
            let before = image.rows[2].dot(p.extend(1.0)) > 0.0;
            if before { -out.dot(image.at(p)) } else { f64::NEG_INFINITY }
        };
        (out, -least(geometry, &planes, along))
    };
    let sides: Vec<(DVec2, f64)> = (0..SIDES).into_par_iter().map(side).collect();
    if sides.iter().any(|(_, far)| !far.is_finite()) {
        return Vec::new();
    }
    let [high, low] = [0, SIDES / 2].map(|from| DVec2::new(sides[from].1, sides[from + SIDES / 4].1));
    let [low, high] = [-low, high];
    let mut around = vec![low, DVec2::new(high.x, low.y), high, DVec2::new(low.x, high.y)];
    for (out, far) in sides {
        around = halved(&around, |p| far - out.dot(p));
    }
    around
}

/// Sides of such a polygon.
const SIDES: usize = 32;

/// The least of a function over all triangles' parts inside of planes. Over each convex body the function is least at a corner.
fn least(geometry: &Geometry, planes: &[DVec4], of: impl Fn(DVec3) -> f64) -> f64 {
    let mut open = BinaryHeap::new();
    open.push(Open(f64::NEG_INFINITY, Some(0)));
    while let Some(Open(least, node)) = open.pop() {
        let Some(node) = node else {
            return least;
        };
        for (ends, child) in geometry.bvh.nodes[node].children() {
            let corners = [0, 1, 2, 3, 4, 5, 6, 7]
                .map(|i: usize| DVec3::from_array([0, 1, 2].map(|a| ends[i >> a & 1][a] as f64)));
            if planes.iter().any(|plane| corners.iter().all(|p| plane.dot(p.extend(1.0)) < 0.0)) {
                continue;
            }
            match child {
                Child::Node(node) => open.push(Open(corners.map(&of).into_iter().fold(f64::MAX, f64::min), Some(node))),
                Child::Triangles(range) => {
                    for triangle in &geometry.bvh.order[range] {
                        let mut part = geometry.corners(*triangle as usize).map(|p| p.as_dvec3()).to_vec();
                        planes.iter().for_each(|plane| part = cut(&part, *plane));
                        if let Some(least) = part.into_iter().map(&of).min_by(f64::total_cmp) {
                            open.push(Open(least, None));
                        }
                    }
                }
            }
        }
    }
    f64::INFINITY
}

/// A node of the BVH, or something that casts (None), and how near it may be; the nearest comes first.
struct Open(f64, Option<usize>);

impl Ord for Open {
    fn cmp(&self, other: &Open) -> Ordering {
        other.0.total_cmp(&self.0)
    }
}

impl PartialOrd for Open {
    fn partial_cmp(&self, other: &Open) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Open {
    fn eq(&self, other: &Open) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Open {}

/// Planes around all that lies between the light and what the camera may see, positive inside: along each side of the light's frame the
/// one that touches both.
fn planes(scope: &Scope) -> Vec<DVec4> {
    let (image, seen) = (scope.image(), scope.seen());
    let z = image.depth;
    let at = |row: DVec4, p: &DVec3| row.dot(p.extend(1.0));
    let deepest = scope.deepest(&image, &seen);
    let half = match scope.light {
        Light::RectArea { half_u, half_v, .. } => {
            let sides = [half_u, half_v].map(|h| h.as_dvec3());
            DVec2::from_array([0, 1].map(|k| sides.iter().map(|h| image.rows[k].truncate().dot(*h).abs()).sum()))
        }
        _ => DVec2::splat(scope.light.radius() as f64),
    };
    let mut all = vec![DVec4::W * deepest - z];
    for (k, row) in image.rows.iter().take(2).enumerate() {
        for x in [*row, -*row] {
            all.push(match scope.light {
                // Its radius is the tangent of its disc's.
                Light::Directional { .. } => {
                    let aside = x - z * half[k];
                    aside - DVec4::W * seen.iter().map(|p| at(aside, p)).fold(f64::INFINITY, f64::min)
                }
                _ => {
                    let slope = seen.iter().map(|p| (at(x, p) + half[k]) / at(z, p)).fold(f64::INFINITY, f64::min);
                    x + DVec4::W * half[k] - z * slope
                }
            });
        }
    }
    if !matches!(scope.light, Light::Directional { .. }) {
        all.push(z);
    }
    all
}

/// The part of a convex polygon on a plane's positive side.
fn cut(polygon: &[DVec3], plane: DVec4) -> Vec<DVec3> {
    halved(polygon, |p| plane.dot(p.extend(1.0)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Camera;
    use glam::Vec3;

    /// Whatever lies between a place of the light and something seen is on the inner side of all planes, and each plane touches
    /// something of it.
    #[test]
    fn planes_hold_what_lies_before_what_is_seen() {
        let camera = Camera {
            position: Vec3::new(1.0, 3.0, 8.0),
            target: Vec3::new(0.0, 0.5, -1.0),
            up: Vec3::Y,
            fov: 40.0,
            height: None,
            near: 0.1,
            far: 100.0,
        };
        let (color, range) = (Vec3::ONE, 100.0);
        let place = Vec3::new(2.0, 9.0, 1.0);
        let lights = [
            Light::Directional { to_light: Vec3::new(0.4, 1.0, 0.3), angular_radius: 5.0, color },
            Light::Spot { position: place, direction: -place, outer_angle: 35.0, range, radius: 0.5, color },
            Light::RectArea {
                center: place,
                half_u: Vec3::new(0.7, 0.0, 0.0),
                half_v: Vec3::new(0.0, 0.0, 0.4),
                range,
                color,
            },
        ];
        for light in lights {
            let bounds = [Vec3::new(-4.0, 0.0, -5.0), Vec3::new(4.0, 2.0, 5.0)];
            let scope = Scope { camera, light, bounds, aspect: 1.5, resolution: 512, margin: 2.0 };
            let (image, seen, planes) = (scope.image(), scope.seen(), planes(&scope));
            let mut random = {
                let mut seed = 9u32;
                move || {
                    seed = seed.wrapping_mul(747796405).wrapping_add(2891336453);
                    f64::from(seed >> 8) / f64::from(1 << 24)
                }
            };
            let mut nearest = vec![f64::INFINITY; planes.len()];
            let [right, up] = [0, 1].map(|k| image.rows[k].truncate().normalize());
            for n in 0..20_000 {
                // Every other one at a corner, from the light's border: there planes touch.
                let mut receiver = seen[n % seen.len()];
                if n % 2 == 0 {
                    let other = seen[(random() * seen.len() as f64) as usize % seen.len()];
                    receiver += (other - receiver) * random();
                }
                let (sin, cos) = (random() * std::f64::consts::TAU).sin_cos();
                let aside = right * cos + up * sin;
                let caster = match light {
                    // Directions within the disc in the sky; casters as far away as one likes.
                    Light::Directional { to_light, .. } => {
                        let to_light = to_light.as_dvec3().normalize() + aside * f64::from(light.radius());
                        receiver + to_light * 20.0 * (random() - 0.2).max(0.0)
                    }
                    Light::RectArea { center, half_u, half_v, .. } => {
                        let side = |x: f64| if n % 4 < 2 { x.signum() } else { x };
                        let from = center.as_dvec3() + half_u.as_dvec3() * side(cos) + half_v.as_dvec3() * side(sin);
                        from + (receiver - from) * (1.2 * random()).min(1.0)
                    }
                    _ => {
                        let from = place.as_dvec3() + aside * f64::from(light.radius());
                        from + (receiver - from) * (1.2 * random()).min(1.0)
                    }
                };
                for (plane, nearest) in planes.iter().zip(&mut nearest) {
                    let height = plane.dot(caster.extend(1.0)) / plane.truncate().length();
                    assert!(height > -1e-6, "{}: {height} at {caster}", light.kind());
                    *nearest = nearest.min(height);
                }
            }
            assert!(nearest.iter().all(|height| *height < 0.05), "{}: {nearest:?}", light.kind());
        }
    }
}
