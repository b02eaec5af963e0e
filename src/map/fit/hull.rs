//! Convex geometry in f64: polyhedra and how planes cut them, hulls in the plane, the rectangle of least area.

use glam::{DVec2, DVec3, DVec4};
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

/// A convex polyhedron: the corners of each face in order around it.
#[derive(Clone, Debug, Default)]
pub struct Polyhedron {
    faces: Vec<Vec<DVec3>>,
}

impl Polyhedron {
    /// From the corners of each face, in order around it.
    pub fn new(faces: Vec<Vec<DVec3>>) -> Polyhedron {
        Polyhedron { faces }
    }

    /// The corners of each face, in order around it.
    pub fn faces(&self) -> &[Vec<DVec3>] {
        &self.faces
    }

    /// The box between two corners.
    pub fn cuboid(low: DVec3, high: DVec3) -> Polyhedron {
        let p = |i: usize| DVec3::from_array([0, 1, 2].map(|a| if i >> a & 1 == 1 { high[a] } else { low[a] }));
        let faces = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        Polyhedron { faces: faces.iter().map(|f| f.iter().map(|i| p(*i)).collect()).collect() }
    }

    /// The frustum between two faces: four corners in order around the one, then those joined to them of the other.
    pub fn frustum(corners: &[DVec3; 8]) -> Polyhedron {
        let faces = [[0, 1, 2, 3], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]];
        Polyhedron { faces: faces.iter().map(|f| f.iter().map(|i| corners[*i]).collect()).collect() }
    }

    /// Keeps the part where `plane · (X, 1)` ≥ 0. `eps`: distances below it count as zero, metres.
    pub fn clip(&mut self, plane: DVec4, eps: f64) {
        let plane = plane / plane.truncate().length().max(f64::MIN_POSITIVE);
        let distance = |p: DVec3| plane.dot(p.extend(1.0));
        if self.faces.iter().flatten().all(|p| distance(*p) >= -eps) {
            return;
        }
        let mut rim: Vec<DVec3> = Vec::new();
        for face in &mut self.faces {
            if face.iter().all(|p| distance(*p) > eps) {
                continue;
            }
            let mut kept = Vec::with_capacity(face.len() + 1);
            for (i, &p) in face.iter().enumerate() {
                let q = face[(i + 1) % face.len()];
                let (dp, dq) = (distance(p), distance(q));
                if dp >= -eps {
                    kept.push(p);
                    if dp <= eps {
                        rim.push(p);
                    }
                }
                if (dp > eps && dq < -eps) || (dp < -eps && dq > eps) {
                    let cut = p + (q - p) * (dp / (dp - dq));
                    kept.push(cut);
                    rim.push(cut);
                }
            }
            *face = kept;
        }
        self.faces.retain(|f| f.len() >= 3);
        // The cut closes the polyhedron again: its corners in order around their middle.
        let middle = rim.iter().sum::<DVec3>() / rim.len().max(1) as f64;
        let u = plane.truncate().any_orthonormal_vector();
        let v = plane.truncate().cross(u);
        let angle = |p: &DVec3| (*p - middle).dot(v).atan2((*p - middle).dot(u));
        rim.sort_by(|p, q| angle(p).total_cmp(&angle(q)));
        rim.dedup_by(|p, q| p.distance(*q) <= eps);
        if rim.len() >= 3 && !self.faces.is_empty() {
            self.faces.push(rim);
        }
    }

    /// The corners, each as often as faces share it; none if nothing is left.
    pub fn corners(&self) -> Vec<DVec3> {
        self.faces.iter().flatten().copied().collect()
    }

    /// The edges at which faces meet at more than ten degrees: what a drawing of the body needs.
    pub fn edges(&self) -> Vec<[DVec3; 2]> {
        let sides = |f: &[DVec3]| (0..f.len()).map(|i| [f[i], f[(i + 1) % f.len()]]).collect::<Vec<_>>();
        // Newell's normal: any polygon has one.
        let normal = |f: &Vec<DVec3>| sides(f).iter().map(|[a, b]| a.cross(*b)).sum::<DVec3>().normalize_or_zero();
        // Cut faces agree on their corners but for rounding.
        let grid = |p: DVec3| (p * 1e5).round().as_i64vec3().to_array();
        let mut found = BTreeMap::new();
        for face in &self.faces {
            let n = normal(face);
            for [a, b] in sides(face) {
                let mut key = [grid(a), grid(b)];
                key.sort();
                match found.entry(key) {
                    Entry::Vacant(free) => _ = free.insert(([a, b], n, true)),
                    Entry::Occupied(mut held) => held.get_mut().2 = held.get().1.dot(n) < 0.985,
                }
            }
        }
        found.into_values().filter(|e| e.2).map(|e| e.0).collect()
    }

    /// Pyramids that fill it: six times the volume of each, and its middle times four.
    fn pyramids(&self) -> impl Iterator<Item = (f64, DVec3)> + '_ {
        let corners = self.faces.iter().map(Vec::len).sum::<usize>().max(1);
        // Within, since it is convex.
        let tip = self.faces.iter().flatten().sum::<DVec3>() / corners as f64;
        let fan = |f: &[DVec3]| f.windows(2).skip(1).map(|w| [f[0], w[0], w[1]]).collect::<Vec<_>>();
        let pyramid = move |[a, b, c]: [DVec3; 3]| ((a - tip).dot((b - tip).cross(c - tip)).abs(), a + b + c + tip);
        self.faces.iter().flat_map(move |f| fan(f)).map(pyramid)
    }

    /// Cubic metres.
    pub fn volume(&self) -> f64 {
        self.pyramids().map(|(volume, _)| volume).sum::<f64>() / 6.0
    }

    /// The centre of mass; of a body without volume the middle of its corners. None if nothing is left.
    pub fn center(&self) -> Option<DVec3> {
        let (six, sum) = self.pyramids().fold((0.0, DVec3::ZERO), |(v, m), (w, p)| (v + w, m + p * w));
        let corners = self.corners();
        let [low, high] =
            corners.iter().fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[l, h], p| [l.min(*p), h.max(*p)]);
        if six > 1e-9 * (high - low).max_element().powi(3) {
            return Some(sum / (4.0 * six));
        }
        (!corners.is_empty()).then(|| corners.iter().sum::<DVec3>() / corners.len() as f64)
    }
}

fn cross(a: DVec2, b: DVec2) -> f64 {
    a.perp_dot(b)
}

/// The convex hull of points, counter-clockwise (Andrew 1979). Fewer than three corners where the points lie on a line.
pub fn hull(points: &[DVec2]) -> Vec<DVec2> {
    let mut sorted = points.to_vec();
    sorted.sort_by(|p, q| p.x.total_cmp(&q.x).then(p.y.total_cmp(&q.y)));
    sorted.dedup();
    if sorted.len() < 3 {
        return sorted;
    }
    let chain = |points: &mut dyn Iterator<Item = DVec2>| {
        let mut out: Vec<DVec2> = Vec::new();
        for p in points {
            while out.len() >= 2 && cross(out[out.len() - 1] - out[out.len() - 2], p - out[out.len() - 1]) <= 0.0 {
                out.pop();
            }
            out.push(p);
        }
        out.pop();
        out
    };
    let mut lower = chain(&mut sorted.iter().copied());
    lower.extend(chain(&mut sorted.iter().rev().copied()));
    // Corners that only rounding parts have edges of any direction.
    let [low, high] = extent(points.iter().copied());
    let same = |p: &DVec2, q: &DVec2| p.distance(*q) <= 1e-10 * (high - low).max_element();
    lower.dedup_by(|p, q| same(p, q));
    if lower.len() > 1 && same(&lower[0], &lower[lower.len() - 1]) {
        lower.pop();
    }
    lower
}

/// The rectangle of least area around a counter-clockwise hull by rotating calipers (Toussaint 1983): the unit direction
/// of one of its sides. One side always lies along an edge of the hull. None if the hull has no area.
pub fn least_rectangle(hull: &[DVec2]) -> Option<DVec2> {
    let n = hull.len();
    if n < 3 {
        return None;
    }
    let mut best: Option<(f64, DVec2)> = None;
    // The corners farthest along the edge, away from it and against it; they only ever move on.
    let (mut right, mut top, mut left) = (1, 1, 1);
    for i in 0..n {
        let Some(e) = (hull[(i + 1) % n] - hull[i]).try_normalize() else { continue };
        let up = e.perp();
        let advance = |mut at: usize, from: usize, d: DVec2| {
            at = at.max(from);
            while d.dot(hull[(at + 1) % n]) > d.dot(hull[at % n]) && at < from + n {
                at += 1;
            }
            at
        };
        right = advance(right, i + 1, e);
        top = advance(top, right, up);
        left = advance(left, top, -e);
        let area = e.dot(hull[right % n] - hull[left % n]) * up.dot(hull[top % n] - hull[i]);
        if best.is_none_or(|(least, _)| area < least) {
            best = Some((area, e));
        }
    }
    best.map(|(_, e)| e)
}

/// The part of a convex polygon where an affine function is not negative.
pub fn halved<P>(polygon: &[P], side: impl Fn(P) -> f64) -> Vec<P>
where
    P: Copy + std::ops::Add<Output = P> + std::ops::Sub<Output = P> + std::ops::Mul<f64, Output = P>,
{
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (i, p) in polygon.iter().enumerate() {
        let q = polygon[(i + 1) % polygon.len()];
        let (a, b) = (side(*p), side(q));
        if a >= 0.0 {
            kept.push(*p);
        }
        if (a < 0.0) != (b < 0.0) {
            kept.push(*p + (q - *p) * (a / (a - b)));
        }
    }
    kept
}

/// Smallest and largest coordinates of points.
pub fn extent(points: impl IntoIterator<Item = DVec2>) -> [DVec2; 2] {
    points.into_iter().fold([DVec2::INFINITY, DVec2::NEG_INFINITY], |[low, high], p| [low.min(p), high.max(p)])
}
