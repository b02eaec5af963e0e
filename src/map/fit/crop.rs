//! Cropping a light's view to what receives and what casts in a part of the camera's view (Zhang, Sun, Lun 2007, GPU Gems 3,
//! chapter 10; Navratil 2015, figure 3.8, left).

use super::{Eye, LightImage, Scope, hull};
use crate::scene::bvh::Child;
use crate::scene::geometry::Geometry;
use glam::{DVec2, DVec3, DVec4};

/// A box in a light's image, with depths along its axis, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extent {
    pub low: DVec2,
    pub high: DVec2,
    pub nearest: f64,
    pub deepest: f64,
}

impl Extent {
    const NONE: Extent =
        Extent { low: DVec2::INFINITY, high: DVec2::NEG_INFINITY, nearest: f64::INFINITY, deepest: f64::NEG_INFINITY };

    /// Around points. Where some lie behind a spot light their convex hull may appear anywhere before its nearest place.
    pub fn of(image: &LightImage, points: &[DVec3], eps: f64) -> Extent {
        let depth = |p: &DVec3| image.depth.dot(p.extend(1.0));
        let [nearest, deepest] = hull::extent(points.iter().map(|p| DVec2::splat(depth(p)))).map(|d| d.x);
        let behind = |p: &DVec3| image.rows[2].dot(p.extend(1.0)) <= eps;
        if points.iter().any(behind) {
            return Extent { low: DVec2::NEG_INFINITY, high: DVec2::INFINITY, nearest, deepest };
        }
        let [low, high] = hull::extent(points.iter().map(|p| image.at(*p)));
        Extent { low, high, nearest, deepest }
    }

    /// What of it lies in another.
    fn within(&self, other: &Extent) -> Extent {
        Extent {
            low: self.low.max(other.low),
            high: self.high.min(other.high),
            nearest: self.nearest.max(other.nearest),
            deepest: self.deepest.min(other.deepest),
        }
    }

    fn is_empty(&self) -> bool {
        !(self.low.cmple(self.high).all() && self.nearest <= self.deepest)
    }

    fn with(&self, other: &Extent) -> Extent {
        Extent {
            low: self.low.min(other.low),
            high: self.high.max(other.high),
            nearest: self.nearest.min(other.nearest),
            deepest: self.deepest.max(other.deepest),
        }
    }
}

/// The part of the light's image in which something lies in the camera's view between these depths, and the depths from the
/// first thing that may cast there to the last receiver. `all`: around that part of the view. Objects are triangles, as far as
/// the BVH need be opened. None if nothing receives there.
pub fn crop(scope: &Scope, geometry: &Geometry, [near, far]: [f64; 2], all: &Extent) -> Option<Extent> {
    let (image, eps) = (scope.image(), scope.eps());
    let eye = Eye { near, far, ..scope.eye() };
    let planes: Vec<DVec4> = eye.planes().into_iter().chain(scope.reach()).collect();
    let received = gathered(geometry, |points| {
        let outside = |plane: &DVec4| points.iter().all(|p| plane.dot(p.extend(1.0)) < -eps);
        if planes.iter().any(outside) {
            return Extent::NONE;
        }
        Extent::of(&image, points, eps).within(all)
    });
    // All that the light crosses on its way there.
    let swept = Extent { nearest: f64::NEG_INFINITY, ..*all };
    let cast = gathered(geometry, |points| {
        // What lies behind a spot light casts on nothing before it.
        if points.iter().all(|p| image.rows[2].dot(p.extend(1.0)) <= eps) {
            return Extent::NONE;
        }
        Extent::of(&image, points, eps).within(&swept)
    });
    // What receives casts too, if only on itself.
    (!received.is_empty()).then_some(Extent { nearest: cast.nearest, ..received })
}

/// The union of what `measure` says of each triangle, which for more points may only say more. What would add nothing is
/// not opened.
fn gathered(geometry: &Geometry, measure: impl Fn(&[DVec3]) -> Extent) -> Extent {
    let mut sum = Extent::NONE;
    let mut open = vec![0];
    while let Some(at) = open.pop() {
        for (ends, child) in geometry.bvh.nodes[at].children() {
            let corner = |i: usize| DVec3::from_array([0, 1, 2].map(|a| ends[i >> a & 1][a] as f64));
            let found = measure(&[0, 1, 2, 3, 4, 5, 6, 7].map(corner));
            if found.is_empty() || sum.with(&found) == sum {
                continue;
            }
            match child {
                Child::Node(node) => open.push(node),
                Child::Triangles(range) => {
                    for triangle in &geometry.bvh.order[range] {
                        let found = measure(&geometry.corners(*triangle as usize).map(|p| p.as_dvec3()));
                        if !found.is_empty() {
                            sum = sum.with(&found);
                        }
                    }
                }
            }
        }
    }
    sum
}
