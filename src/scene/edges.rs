//! Edges of the scene's triangles, welded by position: what silhouettes, shadow volumes and conservative maps are made of.

use super::geometry::Geometry;
use crate::frame::Frame;
use crate::gpu::{Buffer, Gpu, hold};
use anyhow::{Result, ensure};
use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Vec3, Vec4};
use rayon::prelude::*;
use std::time::Instant;

/// An edge as `Edge` in `shaders/lib/edges.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
pub struct Edge {
    /// Its ends: vertices, of each place always the same one.
    pub ends: [u32; 2],
    /// Where its triangles stand in [`Edges::sides`].
    pub first: u32,
    pub count: u32,
}

/// In place of an edge of a degenerate triangle.
pub const NO_EDGE: u32 = u32::MAX;

/// All edges of a geometry.
#[derive(Debug, Default)]
pub struct Edges {
    pub all: Vec<Edge>,
    /// Triangles × 2, and 1 more of those that run along the edge from its second end to its first.
    pub sides: Vec<u32>,
    /// Of each triangle the edges behind its three corners, × 2, and 1 more as in `sides`; [`NO_EDGE`] of degenerate triangles.
    pub of_triangles: Vec<[u32; 3]>,
    pub found: Found,
}

/// What the edges tell of the triangles. In a closed oriented mesh all is 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Found {
    /// Edges of one triangle.
    pub open: usize,
    /// Edges of more than two triangles.
    pub crowded: usize,
    /// Edges along which as many triangles run one way as the other are fine; these are the others with two triangles or more.
    pub twisted: usize,
    /// Triangles of which two corners lie in one place. They have no edges.
    pub degenerate: usize,
}

impl Edges {
    /// The edges of all triangles. Corners at the same place are one, whatever their normals and texture coordinates.
    pub fn new(geometry: &Geometry) -> Edges {
        let first = geometry.welded();
        let ends = |t: &[u32; 4], k: usize| [first[t[k] as usize], first[t[(k + 1) % 3] as usize]];
        let degenerate = |t: &[u32; 4]| (0..3).any(|k| ends(t, k)[0] == ends(t, k)[1]);
        // Ends in order, triangle, corner, and whether the triangle runs the other way.
        let mut halves: Vec<([u32; 2], u32, u32)> = (geometry.triangles.par_iter().enumerate())
            .filter(|(_, t)| !degenerate(t))
            .flat_map_iter(|(i, t)| {
                (0..3).map(move |k| {
                    let [a, b] = ends(t, k);
                    ([a.min(b), a.max(b)], i as u32, k as u32 * 2 + (a > b) as u32)
                })
            })
            .collect();
        halves.par_sort_unstable();
        let mut edges = Edges { of_triangles: vec![[NO_EDGE; 3]; geometry.triangles.len()], ..Edges::default() };
        for same in halves.chunk_by(|a, b| a.0 == b.0) {
            let number = edges.all.len() as u32;
            edges.all.push(Edge { ends: same[0].0, first: edges.sides.len() as u32, count: same.len() as u32 });
            for (_, triangle, half) in same {
                edges.sides.push(triangle * 2 + half % 2);
                edges.of_triangles[*triangle as usize][*half as usize / 2] = number * 2 + half % 2;
            }
            let back = same.iter().filter(|(_, _, half)| half % 2 == 1).count();
            edges.found.open += (same.len() == 1) as usize;
            edges.found.crowded += (same.len() > 2) as usize;
            edges.found.twisted += (same.len() > 1 && back * 2 != same.len()) as usize;
        }
        edges.found.degenerate = geometry.triangles.len() - halves.len() / 3;
        edges
    }
}

/// In place of the corner of a neighbour that there is not.
pub const NO_VERTEX: u32 = u32::MAX;

/// What lies beside a triangle, as `neighbours` in `shaders/map/conservative.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
pub struct Beside {
    /// Across the edge from each corner to the next the opposite corner of the only neighbour there, if that runs the other way
    /// along the edge and is opaque; else [`NO_VERTEX`].
    pub opposite: [u32; 3],
    /// Bit 0: it belongs to a closed body; bit 1: it is opaque.
    pub bits: u32,
    /// Its corners, of each place always the same vertex.
    pub corners: [u32; 3],
    pub padding: u32,
}

/// The triangles around a place, as `fans` in `shaders/map/conservative.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
pub struct Fan {
    /// Where they stand in [`Fans::triangles`].
    pub first: u32,
    /// None where there is a gap around it, or some of them are not opaque.
    pub count: u32,
    /// The vertex that stands for all at this place.
    pub vertex: u32,
    pub padding: u32,
}

/// Bodies of triangles that hang together, as [`Geometry::casters`] numbers them.
#[derive(Debug)]
pub struct Bodies {
    /// Whether all edges have as many triangles on either side, none of them masked, and fronts are outside.
    pub closed: Vec<bool>,
    /// The box around each.
    boxes: Vec<[Vec3; 2]>,
}

impl Bodies {
    /// Which closed bodies none of these points lies in, and no plane cuts that is given.
    pub fn without(&self, geometry: &Geometry, points: &[Vec3], cut: Option<Vec4>) -> Vec<bool> {
        let mut closed = self.closed.clone();
        if let Some(plane) = cut {
            let mut sides = vec![[false; 2]; closed.len()];
            for (i, body) in geometry.casters().iter().enumerate() {
                for corner in geometry.corners(i) {
                    sides[*body as usize][usize::from(plane.dot(corner.extend(1.0)) > 0.0)] = true;
                }
            }
            closed.iter_mut().zip(sides).for_each(|(closed, sides)| *closed &= sides != [true; 2]);
        }
        for p in points {
            let around = |b: &[Vec3; 2]| p.cmpge(b[0]).all() && p.cmple(b[1]).all();
            let asked: Vec<bool> = (0..closed.len()).map(|i| self.closed[i] && around(&self.boxes[i])).collect();
            if !asked.contains(&true) {
                continue;
            }
            // Of all bodies in one go: there may be as many as triangles.
            let mut seen = vec![0.0; closed.len()];
            for (i, body) in geometry.casters().iter().enumerate().filter(|(_, body)| asked[**body as usize]) {
                seen[*body as usize] += solid_angle(geometry.corners(i).map(|c| (c - p).as_dvec3()));
            }
            // All of the sphere from inside; half of it from a face.
            closed.iter_mut().zip(seen).for_each(|(closed, seen)| *closed &= seen.abs() < std::f64::consts::PI);
        }
        closed
    }
}

/// The solid angle of a triangle seen from the origin, positive from behind (Van Oosterom, Strackee 1983, equation 8).
fn solid_angle([a, b, c]: [DVec3; 3]) -> f64 {
    let lengths = [a.length(), b.length(), c.length()];
    let below =
        lengths[0] * lengths[1] * lengths[2] + a.dot(b) * lengths[2] + b.dot(c) * lengths[0] + c.dot(a) * lengths[1];
    2.0 * a.dot(b.cross(c)).atan2(below)
}

/// The triangles around each vertex.
#[derive(Debug, Default)]
pub struct Fans {
    pub of_vertices: Vec<Fan>,
    /// Triangles × 4, and of each the corner that lies there.
    pub triangles: Vec<u32>,
}

impl Edges {
    /// The bodies that triangles make which hang together.
    pub fn bodies(&self, geometry: &Geometry) -> Bodies {
        let bodies = geometry.casters();
        let mut closed = vec![true; bodies.iter().map(|b| *b as usize + 1).max().unwrap_or(0)];
        let sides = |edge: &Edge| &self.sides[edge.first as usize..][..edge.count as usize];
        let balanced = |edge: &Edge| sides(edge).iter().filter(|s| *s % 2 == 1).count() * 2 == edge.count as usize;
        // Once an edge: any number of triangles may share one.
        let balanced: Vec<bool> = self.all.par_iter().map(balanced).collect();
        for (i, of) in self.of_triangles.iter().enumerate() {
            let balanced = |half: &u32| balanced[*half as usize / 2];
            // A degenerate triangle has no edges, and nothing is open along it.
            if i >= geometry.opaque || !(of[0] == NO_EDGE || of.iter().all(balanced)) {
                closed[bodies[i] as usize] = false;
            }
        }
        let mut boxes = vec![[Vec3::INFINITY, Vec3::NEG_INFINITY]; closed.len()];
        let mut volumes = vec![0.0; closed.len()];
        let mut origins = vec![None; closed.len()];
        for (i, body) in bodies.iter().enumerate() {
            let corners = geometry.corners(i);
            let [low, high] = &mut boxes[*body as usize];
            corners.iter().for_each(|p| (*low, *high) = (low.min(*p), high.max(*p)));
            // From one of the body's own corners, so that the digits of far ones are not lost.
            let origin = *origins[*body as usize].get_or_insert(corners[0].as_dvec3());
            let [a, b, c] = corners.map(|p| p.as_dvec3() - origin);
            volumes[*body as usize] += a.dot(b.cross(c));
        }
        closed.iter_mut().zip(volumes).for_each(|(closed, volume)| *closed &= volume > 0.0);
        Bodies { closed, boxes }
    }

    /// What lies beside each triangle. `closed`: which bodies are to count as closed.
    pub fn beside(&self, geometry: &Geometry, closed: &[bool]) -> Vec<Beside> {
        let first = geometry.welded();
        let bodies = geometry.casters();
        (self.of_triangles.par_iter().enumerate())
            .map(|(i, of)| {
                let corners = [0, 1, 2].map(|k| first[geometry.triangles[i][k] as usize]);
                let opposite = of.map(|half| self.across(half).filter(|t| *t < geometry.opaque));
                let opposite = [0, 1, 2].map(|k| {
                    let ends = [corners[k], corners[(k + 1) % 3]];
                    let others = opposite[k].map(|t| [0, 1, 2].map(|c| first[geometry.triangles[t][c] as usize]));
                    others.and_then(|o| o.into_iter().find(|v| !ends.contains(v))).unwrap_or(NO_VERTEX)
                });
                let bits = closed[bodies[i] as usize] as u32 | ((i < geometry.opaque) as u32) << 1;
                Beside { opposite, bits, corners, padding: 0 }
            })
            .collect()
    }

    /// The one triangle across an edge, given as in `of_triangles`, if it is the only one there and runs the other way.
    fn across(&self, half: u32) -> Option<usize> {
        let edge = self.all.get(half as usize / 2).filter(|e| half != NO_EDGE && e.count == 2)?;
        let sides = &self.sides[edge.first as usize..][..2];
        sides.iter().find(|s| **s % 2 != half % 2).filter(|_| sides[0] % 2 != sides[1] % 2).map(|s| *s as usize / 2)
    }

    /// The triangles around each vertex, one after the other.
    pub fn fans(&self, geometry: &Geometry) -> Fans {
        let first = geometry.welded();
        let of_vertices = first.iter().map(|v| Fan { vertex: *v, ..Fan::default() }).collect();
        let mut fans = Fans { of_vertices, triangles: Vec::new() };
        let mut gap = vec![false; first.len()];
        let used = || {
            let triangles = geometry.triangles.iter().zip(&self.of_triangles).enumerate();
            triangles.filter(|(_, (_, of))| of[0] != NO_EDGE)
        };
        for (i, (t, of)) in used() {
            for k in 0..3 {
                let v = first[t[k] as usize] as usize;
                fans.of_vertices[v].count += 1;
                let spokes = [of[k], of[(k + 2) % 3]].map(|half| self.across(half));
                gap[v] |= i >= geometry.opaque || spokes.iter().any(|s| s.is_none_or(|t| t >= geometry.opaque));
            }
        }
        let mut next = 0;
        for fan in &mut fans.of_vertices {
            fan.first = next;
            next += std::mem::take(&mut fan.count);
        }
        fans.triangles = vec![0; next as usize];
        for (i, (t, _)) in used() {
            for k in 0..3 {
                let fan = &mut fans.of_vertices[first[t[k] as usize] as usize];
                fans.triangles[(fan.first + fan.count) as usize] = i as u32 * 4 + k as u32;
                fan.count += 1;
            }
        }
        for (fan, gap) in fans.of_vertices.iter_mut().zip(gap) {
            fan.count *= !gap as u32;
        }
        fans
    }
}

/// A geometry's edges on the GPU, uploaded when they are first asked for and again when the geometry moves.
#[derive(Default)]
pub struct EdgeBuffers {
    held: Option<(u64, Uploaded)>,
}

/// The edges' buffers. Shaders find them as `edges` and `sides` (`shaders/lib/edges.wgsl`).
pub struct Uploaded {
    pub count: u32,
    pub found: Found,
    edges: Buffer,
    sides: Buffer,
}

impl EdgeBuffers {
    /// The edges of the frame's geometry, known to all passes that follow. The time that it takes to find them is the frame's.
    ///
    /// # Errors
    /// More edges than the adapter can bind at once.
    pub fn get(&mut self, f: &mut Frame) -> Result<&Uploaded> {
        let (gpu, geometry) = (f.gpu, f.geometry);
        let mut start = None;
        let held = hold(&mut self.held, f.revision, |_| {
            start = Some(Instant::now());
            Uploaded::new(gpu, geometry.edges())
        })?;
        if let Some(start) = start {
            f.note("edges (CPU)", start.elapsed().as_secs_f64() * 1e3);
        }
        f.set("edges", &held.edges);
        f.set("sides", &held.sides);
        Ok(held)
    }
}

impl Uploaded {
    fn new(gpu: &Gpu, edges: &Edges) -> Result<Uploaded> {
        let largest = size_of_val(&edges.all[..]).max(size_of_val(&edges.sides[..])) as u64;
        ensure!(
            largest <= gpu.most_bound(),
            "the scene has {} edges: that takes {} MiB in one buffer, and {} allows {}; open a scene with fewer triangles",
            edges.all.len(),
            largest.div_ceil(1 << 20),
            gpu.info.name,
            gpu.most_bound() >> 20
        );
        let buffer = |label, words: &[u8]| gpu.buffer(label, words, wgpu::BufferUsages::STORAGE);
        Ok(Uploaded {
            count: edges.all.len() as u32,
            found: edges.found,
            edges: buffer("edges", bytemuck::cast_slice(&edges.all)),
            sides: buffer("sides of edges", bytemuck::cast_slice(&edges.sides)),
        })
    }
}
