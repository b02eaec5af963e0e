//! The ternary tree of shadow planes (Gerhards, Mora, Aveneau, Ghazanfarpour 2015): for one light, all triangles with the planes
//! through the light and their edges.
//!
//! A triangle's four nodes (the planes of its three edges, then its own plane, the cap) are one record, as each but the first hangs
//! inside the one before it. A triangle that comes to a plane goes on outside it, inside it, or, where it crosses it, between; one
//! that lies within all three edges and behind the cap is in full shadow, and dropped. The tree that inserting one triangle after the
//! other would make is made from the top: all that come to a record are dealt out at once, so that its parts are made side by side.

use super::geometry::Geometry;
use crate::light::Light;
use anyhow::{Result, ensure};
use glam::DVec3;
use rayon::prelude::*;
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};

/// The order in which triangles are inserted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// By chance, from a seed.
    Random(u32),
    /// As the scene has them.
    AsIs,
    /// The largest first.
    Area,
}

/// A tree, as `shaders/techniques/psv.wgsl` walks it.
pub struct ShadowTree {
    /// Two texels a triangle, in the order of the BVH: see `records` in WGSL.
    pub records: Vec<[u32; 8]>,
    /// The first record, from 1 on; 0: none.
    pub root: u32,
    /// Triangles in it; those dropped because others shadow them whole; and those whose plane holds the light, which have no shadow.
    pub inserted: u32,
    pub covered: u32,
    pub edge_on: u32,
    /// The longest way down, records.
    pub depth: u32,
}

/// Comparisons of a triangle with another's planes after which a build is given up: some ten seconds of it.
const MOST_TESTS: u64 = 1 << 29;
/// Lists up to this length are worked off where they are.
const SHORT: usize = 2048;
/// Links of a record, and its last word's place, as WGSL has them.
const CAP: usize = 1;
const CROSSES: [usize; 3] = [2, 4, 6];
const OUTSIDE: [usize; 3] = [3, 5, 7];

struct Build {
    /// Relative to a lamp.
    corners: Vec<[DVec3; 3]>,
    /// The direction in which the sun's light travels; None: a lamp's leaves the origin.
    travels: Option<DVec3>,
    /// How near the light each comes, and how much nearer it is taken to be, metres.
    near: Vec<f64>,
    spare: f64,
    /// Of a masked material: what lies behind it may be lit.
    masked: Vec<bool>,
    records: Vec<[AtomicU32; 8]>,
    covered: AtomicU32,
    depth: AtomicU32,
    tests: AtomicU64,
}

/// Triangles that come to an empty link, in their order.
struct Task {
    triangles: Vec<u32>,
    /// The record and the link that the first of them hangs on; None: it is the root.
    link: Option<(u32, usize)>,
    depth: u32,
}

/// A plane through a point, that what is on its positive side lies within.
struct Plane {
    normal: DVec3,
    at: DVec3,
    /// Rounding, for each metre from `at`.
    rounding: f64,
}

impl Plane {
    /// The distance of a point, times a factor; 0 within rounding.
    fn side(&self, p: DVec3) -> f64 {
        let away = p - self.at;
        let side = self.normal.dot(away);
        if side.abs() <= self.rounding * away.length() { 0.0 } else { side }
    }
}

impl Build {
    /// The planes through the light and the edges opposite to each corner, and the cap, behind which is shadow. And whether the
    /// triangle turns clockwise around the light; None: its plane holds the light.
    fn planes(&self, triangle: u32) -> Option<([Plane; 4], bool)> {
        let c = self.corners[triangle as usize];
        let through = |a: DVec3, b: DVec3| {
            let ray = self.travels.unwrap_or(a);
            Plane { normal: ray.cross(b - a), at: a, rounding: 1e-14 * ray.length() * (b - a).length() }
        };
        let mut planes = [through(c[1], c[2]), through(c[2], c[0]), through(c[0], c[1])];
        let volume = planes[2].side(c[2]);
        if volume == 0.0 {
            return None;
        }
        let (u, v) = (c[1] - c[0], c[2] - c[0]);
        let mut cap = Plane { normal: u.cross(v), at: c[0], rounding: 1e-14 * u.length() * v.length() };
        if volume < 0.0 {
            planes.iter_mut().chain([&mut cap]).for_each(|p| p.normal = -p.normal);
        }
        let [a, b, c] = planes;
        Some(([a, b, c, cap], volume < 0.0))
    }

    /// The link that a triangle goes on to; None: it lies in shadow. `open`: what lies behind the cap may be lit all the same.
    fn goes(&self, planes: &[Plane; 4], open: bool, triangle: u32) -> Option<usize> {
        let corners = self.corners[triangle as usize];
        for (i, plane) in planes[..3].iter().enumerate() {
            let sides = corners.map(|p| plane.side(p));
            if sides.iter().all(|s| *s >= 0.0) {
                continue;
            }
            return Some(if sides.iter().all(|s| *s <= 0.0) { OUTSIDE[i] } else { CROSSES[i] });
        }
        let sides = corners.map(|p| planes[3].side(p));
        // One in the cap's own plane is not behind it.
        let behind = sides.iter().all(|s| *s >= 0.0) && sides.iter().any(|s| *s > 0.0);
        (open || !behind).then_some(CAP)
    }

    /// Makes a record of the first triangle of a task, and deals out the others.
    fn split(&self, task: Task) -> Vec<Task> {
        self.depth.fetch_max(task.depth, Ordering::Relaxed);
        let first = task.triangles[0];
        let Some((planes, clockwise)) = self.planes(first) else { return Vec::new() };
        let record = &self.records[first as usize];
        let least = task.triangles.iter().map(|t| self.near[*t as usize]).fold(f64::INFINITY, f64::min) - self.spare;
        let near = (least as f32).next_down().to_bits() & !1 | clockwise as u32;
        record[0].store(near, Ordering::Relaxed);
        if let Some((parent, link)) = task.link {
            self.records[parent as usize][link].store(first + 1, Ordering::Relaxed);
        }
        // One so near a lamp that the truth's rays end before it shadows nothing.
        let too_near = self.travels.is_none() && self.near[first as usize] < 4.0 * self.spare;
        let open = self.masked[first as usize] || too_near;
        let mut parts: [Vec<u32>; 8] = Default::default();
        let mut covered = 0;
        for triangle in &task.triangles[1..] {
            match self.goes(&planes, open, *triangle) {
                Some(link) => parts[link].push(*triangle),
                None => covered += 1,
            }
        }
        self.covered.fetch_add(covered, Ordering::Relaxed);
        self.tests.fetch_add(task.triangles.len() as u64, Ordering::Relaxed);
        let parts = parts.into_iter().enumerate().filter(|(_, part)| !part.is_empty());
        parts.map(|(link, triangles)| Task { triangles, link: Some((first, link)), depth: task.depth + 1 }).collect()
    }

    /// Works a task off, and all that come from it.
    fn work<'s>(&'s self, scope: &rayon::Scope<'s>, task: Task) {
        let mut own = vec![task];
        while let Some(task) = own.pop() {
            if self.tests.load(Ordering::Relaxed) > MOST_TESTS {
                return;
            }
            for part in self.split(task) {
                if part.triangles.len() > SHORT {
                    scope.spawn(move |scope| self.work(scope, part));
                } else {
                    own.push(part);
                }
            }
        }
    }
}

/// The distance of the origin from a triangle.
fn distance(t: &[DVec3; 3]) -> f64 {
    let normal = (t[1] - t[0]).cross(t[2] - t[0]);
    let inside = (0..3).all(|i| (t[(i + 1) % 3] - t[i]).cross(-t[i]).dot(normal) >= 0.0);
    if inside && normal.length_squared() > 0.0 {
        return (normal.dot(t[0]) / normal.length()).abs();
    }
    let edge = |i: usize| {
        let (a, ab) = (t[i], t[(i + 1) % 3] - t[i]);
        let along = (-a.dot(ab) / ab.length_squared().max(1e-300)).clamp(0.0, 1.0);
        (a + ab * along).length()
    };
    edge(0).min(edge(1)).min(edge(2))
}

/// A hash of 32 bits (Wellons 2018).
fn hash(x: u32) -> u32 {
    let x = (x ^ (x >> 16)).wrapping_mul(0x7feb_352d);
    let x = (x ^ (x >> 15)).wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

impl ShadowTree {
    /// Builds the tree of all triangles for a light.
    ///
    /// # Errors
    /// An order in which it degenerates.
    pub fn new(geometry: &Geometry, masked_from: usize, light: &Light, order: Order) -> Result<ShadowTree> {
        let travels = matches!(light, Light::Directional { .. }).then(|| light.axis().as_dvec3());
        let origin = if travels.is_some() { DVec3::ZERO } else { light.position().as_dvec3() };
        let all = &geometry.bvh.order;
        let corners: Vec<[DVec3; 3]> =
            all.par_iter().map(|t| geometry.corners(*t as usize).map(|p| p.as_dvec3() - origin)).collect();
        let near: Vec<f64> = (corners.par_iter())
            .map(|t| match travels {
                Some(along) => t.iter().map(|p| p.dot(along)).fold(f64::INFINITY, f64::min),
                None => distance(t),
            })
            .collect();
        let [low, high] = geometry.bounds.map(|b| b.abs().max_element());
        let size = low.max(high).max(origin.abs().max_element() as f32) as f64;
        let build = Build {
            travels,
            // The truth's rays end 64 units of the largest coordinate before a lamp.
            spare: 32.0 * f32::EPSILON as f64 * size,
            masked: all.iter().map(|t| *t as usize >= masked_from).collect(),
            records: (0..all.len()).map(|_| Default::default()).collect(),
            near,
            corners,
            covered: AtomicU32::new(0),
            depth: AtomicU32::new(0),
            tests: AtomicU64::new(0),
        };
        let mut first: Vec<u32> = (0..all.len() as u32).filter(|i| build.planes(*i).is_some()).collect();
        let edge_on = (all.len() - first.len()) as u32;
        match order {
            Order::Random(seed) => first.par_sort_by_key(|i| (hash(hash(all[*i as usize]) ^ seed), *i)),
            Order::AsIs => first.par_sort_by_key(|i| all[*i as usize]),
            Order::Area => {
                let area = |i: u32| {
                    let [a, b, c] = build.corners[i as usize];
                    (b - a).cross(c - a).length()
                };
                // Those of one size, up to a factor of four, by chance: areas that fall from place to place would make a chain.
                let class = |i: u32| (area(i).max(1e-300).log2() / 2.0).floor() as i32;
                first.par_sort_by_cached_key(|i| (-class(*i), hash(all[*i as usize]), *i));
            }
        }
        let root = first.first().map_or(0, |i| i + 1);
        let sent = first.len() as u32;
        if root > 0 {
            rayon::scope(|scope| build.work(scope, Task { triangles: first, link: None, depth: 1 }));
        }
        let tests = build.tests.load(Ordering::Relaxed);
        ensure!(
            tests <= MOST_TESTS,
            "the tree of shadow planes degenerates: {} triangles were compared {tests} times, and most are still to come; {}",
            all.len(),
            match order {
                Order::Random(_) =>
                    "choose another technique: many triangles with holes lie behind one another, or the light is among them",
                _ => "choose order = \"random\"",
            }
        );
        let covered = build.covered.load(Ordering::Relaxed);
        Ok(ShadowTree {
            records: build.records.into_iter().map(|r| r.map(AtomicU32::into_inner)).collect(),
            root,
            inserted: sent - covered,
            covered,
            edge_on,
            depth: build.depth.load(Ordering::Relaxed),
        })
    }
}
