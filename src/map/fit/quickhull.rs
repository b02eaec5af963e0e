//! The convex hull of points in space (Barber, Dobkin, Huhdanpaa 1996, *The quickhull algorithm for convex hulls*).
//!
//! Every choice of a side is exact (Shewchuk 1997, *Adaptive precision floating-point arithmetic and fast robust geometric
//! predicates*), so that no facet is ever inside out, whatever lies in one plane, on one line or at one place.

use super::hull::Polyhedron;
use glam::DVec3;
use robust::{Coord, Coord3D, orient2d, orient3d};
use std::collections::HashMap;

/// A triangle of the hull, counter-clockwise from outside.
struct Facet {
    corners: [usize; 3],
    /// The facets beyond the edges from each corner to the next.
    beyond: [usize; 3],
    /// The points that it sees outside and that no other facet keeps.
    outside: Vec<usize>,
    gone: bool,
}

/// Above 0: `d` lies outside the plane through `a`, `b`, `c`, which run counter-clockwise from there. Its sign is exact.
fn above(a: DVec3, b: DVec3, c: DVec3, d: DVec3) -> f64 {
    let [a, b, c, d] = [a, b, c, d].map(|p| Coord3D { x: p.x, y: p.y, z: p.z });
    -orient3d(a, b, c, d)
}

/// Exactly whether three points lie on a line.
fn collinear(a: DVec3, b: DVec3, c: DVec3) -> bool {
    (0..3).all(|axis| turn(axis, a, b, c) == 0.0)
}

/// Above 0: a, b, c run counter-clockwise as seen along that axis, from its positive end. Its sign is exact.
fn turn(axis: usize, a: DVec3, b: DVec3, c: DVec3) -> f64 {
    let [a, b, c] = [a, b, c].map(|p| Coord { x: p[(axis + 1) % 3], y: p[(axis + 2) % 3] });
    orient2d(a, b, c)
}

/// The convex hull, in triangles. Points in one plane give their polygon twice, from both sides; on a line or at one place,
/// a face without area. Points that are not finite are left out.
pub fn convex_hull(points: impl IntoIterator<Item = DVec3>) -> Polyhedron {
    let points: Vec<DVec3> = points.into_iter().filter(|p| p.is_finite()).collect();
    let farthest =
        |measure: &dyn Fn(DVec3) -> f64| points.iter().copied().max_by(|p, q| measure(*p).total_cmp(&measure(*q)));
    let least = |p: &&DVec3, q: &&DVec3| p.x.total_cmp(&q.x).then(p.y.total_cmp(&q.y)).then(p.z.total_cmp(&q.z));
    let Some(&a) = points.iter().min_by(least) else { return Polyhedron::default() };
    // Neither distance nor area nor volume need be exact: they only say where to begin.
    let b = farthest(&|p| p.distance_squared(a)).unwrap_or(a);
    if a == b {
        return Polyhedron::new(vec![vec![a; 3]]);
    }
    let broad = farthest(&|p| (b - a).cross(p - a).length_squared()).filter(|c| !collinear(a, b, *c));
    let Some(c) = broad.or_else(|| points.iter().copied().find(|c| !collinear(a, b, *c))) else {
        let last = points.iter().max_by(least).copied().unwrap_or(b);
        return Polyhedron::new(vec![vec![a, last, last]]);
    };
    let normal = (b - a).cross(c - a);
    let deep = farthest(&|p| normal.dot(p - a).abs()).filter(|d| above(a, b, c, *d) != 0.0);
    let Some(d) = deep.or_else(|| points.iter().copied().find(|d| above(a, b, c, *d) != 0.0)) else {
        let polygon = polygon(&points, [a, b, c]);
        return Polyhedron::new(vec![polygon.iter().rev().copied().collect(), polygon]);
    };
    let facets = facets(&points, [a, b, c, d]);
    Polyhedron::new(facets.iter().map(|f| f.map(|i| points[i]).to_vec()).collect())
}

/// The hull of points in the plane of three of them, in order around it (Andrew 1979).
fn polygon(points: &[DVec3], [a, b, c]: [DVec3; 3]) -> Vec<DVec3> {
    // Seen along an axis from which the plane is no line.
    let normal = (b - a).cross(c - a).abs();
    let mut axes = [0, 1, 2];
    axes.sort_by(|i, k| normal[*k].total_cmp(&normal[*i]));
    let axis = axes.into_iter().find(|axis| turn(*axis, a, b, c) != 0.0).unwrap_or(0);
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let mut sorted = points.to_vec();
    sorted.sort_by(|p, q| p[u].total_cmp(&q[u]).then(p[v].total_cmp(&q[v])));
    sorted.dedup();
    let chain = |points: &mut dyn Iterator<Item = DVec3>| {
        let mut out: Vec<DVec3> = Vec::new();
        for p in points {
            while out.len() >= 2 && turn(axis, out[out.len() - 2], out[out.len() - 1], p) <= 0.0 {
                out.pop();
            }
            out.push(p);
        }
        out.pop();
        out
    };
    let mut around = chain(&mut sorted.iter().copied());
    around.extend(chain(&mut sorted.iter().rev().copied()));
    around
}

/// The hull's triangles, as indices of points. `first`: four points that do not lie in one plane.
fn facets(points: &[DVec3], first: [DVec3; 4]) -> Vec<[usize; 3]> {
    let mut start = first.map(|p| points.iter().position(|q| *q == p).unwrap_or(0));
    let side = |f: &Facet, i: usize| above(points[f.corners[0]], points[f.corners[1]], points[f.corners[2]], points[i]);
    if above(first[0], first[1], first[2], first[3]) > 0.0 {
        start.swap(0, 1);
    }
    let [a, b, c, d] = start;
    let facet = |corners, beyond| Facet { corners, beyond, outside: Vec::new(), gone: false };
    let mut all = vec![
        facet([a, b, c], [1, 2, 3]),
        facet([b, a, d], [0, 3, 2]),
        facet([c, b, d], [0, 1, 3]),
        facet([a, c, d], [0, 2, 1]),
    ];
    let give = |all: &mut [Facet], to: std::ops::Range<usize>, i: usize| {
        if let Some(f) = to.into_iter().find(|f| side(&all[*f], i) > 0.0) {
            all[f].outside.push(i);
        }
    };
    (0..points.len()).for_each(|i| give(&mut all, 0..4, i));
    let mut open: Vec<usize> = (0..4).collect();
    while let Some(at) = open.pop() {
        let f = &all[at];
        let [p, q, r] = f.corners.map(|i| points[i]);
        let normal = (q - p).cross(r - p);
        let height = |i: &usize| normal.dot(points[*i] - p);
        let Some(top) = f.outside.iter().copied().max_by(|i, k| height(i).total_cmp(&height(k))) else { continue };
        // The facets that see it, and the edges at which others begin.
        let (mut seeing, mut rim, mut k) = (vec![at], Vec::new(), 0);
        all[at].gone = true;
        while k < seeing.len() {
            let from = seeing[k];
            for edge in 0..3 {
                let next = all[from].beyond[edge];
                if all[next].gone {
                    continue;
                }
                if side(&all[next], top) > 0.0 {
                    all[next].gone = true;
                    seeing.push(next);
                } else {
                    let corners = all[from].corners;
                    rim.push((corners[edge], corners[(edge + 1) % 3], next));
                }
            }
            k += 1;
        }
        // They make way for a fan around it.
        let new = all.len()..all.len() + rim.len();
        let starts: HashMap<usize, usize> = rim.iter().zip(new.clone()).map(|((from, ..), f)| (*from, f)).collect();
        let ends: HashMap<usize, usize> = rim.iter().zip(new.clone()).map(|((_, to, _), f)| (*to, f)).collect();
        for ((from, to, next), f) in rim.into_iter().zip(new.clone()) {
            all.push(facet([from, to, top], [next, starts[&to], ends[&from]]));
            let other = &mut all[next];
            // Its edge there runs the other way.
            if let Some(edge) = other.corners.iter().position(|c| *c == to) {
                other.beyond[edge] = f;
            }
        }
        for gone in seeing {
            for i in std::mem::take(&mut all[gone].outside) {
                if i != top {
                    give(&mut all, new.clone(), i);
                }
            }
        }
        open.extend(new);
    }
    all.into_iter().filter(|f| !f.gone).map(|f| f.corners).collect()
}
