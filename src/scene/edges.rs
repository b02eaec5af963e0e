//! Edges of the scene's triangles, welded by position: what silhouettes, shadow volumes and conservative maps are made of.

use super::geometry::Geometry;
use crate::frame::Frame;
use crate::gpu::{Buffer, Gpu};
use anyhow::{Result, ensure};
use bytemuck::{Pod, Zeroable};
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

/// A geometry's edges on the GPU, uploaded when they are first asked for and again when the geometry moves.
#[derive(Default)]
pub struct EdgeBuffers {
    held: Option<(u64, Uploaded)>,
}

/// The edges' buffers. Shaders find them as `edges`, `sides` and `triangle_edges` (`shaders/lib/edges.wgsl`).
pub struct Uploaded {
    pub count: u32,
    pub found: Found,
    edges: Buffer,
    sides: Buffer,
    of_triangles: Buffer,
}

impl EdgeBuffers {
    /// The edges of the frame's geometry, known to all passes that follow. The time that it takes to find them is the frame's.
    ///
    /// # Errors
    /// More edges than the adapter can bind at once.
    pub fn get(&mut self, f: &mut Frame) -> Result<&Uploaded> {
        let revision = f.revision;
        if self.held.as_ref().is_none_or(|(of, _)| *of != revision) {
            self.held = None;
            let start = Instant::now();
            let made = Uploaded::new(f.gpu, f.geometry.edges())?;
            f.note("edges (CPU)", start.elapsed().as_secs_f64() * 1e3);
            self.held = Some((revision, made));
        }
        let (_, held) = self.held.as_ref().expect("made above");
        f.set("edges", &held.edges);
        f.set("sides", &held.sides);
        f.set("triangle_edges", &held.of_triangles);
        Ok(held)
    }
}

impl Uploaded {
    fn new(gpu: &Gpu, edges: &Edges) -> Result<Uploaded> {
        let largest = size_of_val(&edges.all[..]).max(size_of_val(&edges.of_triangles[..])) as u64;
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
            of_triangles: buffer("edges of triangles", bytemuck::cast_slice(&edges.of_triangles)),
        })
    }
}
