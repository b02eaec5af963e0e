//! Boxes around runs of triangles: what lies beside a face as a whole is not asked triangle by triangle (`shaders/map/clusters.wgsl`).

use super::faces::FaceParams;
use crate::frame::Frame;
use crate::gpu::{Buffer, Gpu, Pass, Resource};
use crate::params::Params;
use crate::scene::geometry::Geometry;
use anyhow::Result;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use rayon::prelude::*;
use wgpu::BufferUsages as Use;

/// Triangles of a cluster, as in WGSL.
const TRIANGLES: usize = 64;
/// Bytes of a cluster's place in the list, and of what stands before it: the arguments of a dispatch, and how many are listed.
const LISTED: u64 = 8;
const HEAD: u64 = 16;

/// A box, as `Cluster` in WGSL: its middle, and half its sides.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
struct Cluster {
    middle: Vec3,
    padding: u32,
    half: Vec3,
    spare: u32,
}

/// A scene's clusters.
pub struct Clusters {
    list: Pass,
    /// Of the scene as it stood at a revision: the boxes, and the list.
    held: Option<(u64, [Buffer; 2])>,
}

/// Boxes around each 64 triangles, in the order in which casters are drawn.
fn boxes(geometry: &Geometry) -> Vec<Cluster> {
    let around = |triangles: &[[u32; 4]]| {
        let corners = triangles.iter().flat_map(|t| &t[..3]).map(|i| geometry.vertices[*i as usize].position);
        let [low, high] = corners.fold([Vec3::INFINITY, Vec3::NEG_INFINITY], |[l, h], p| [l.min(p), h.max(p)]);
        Cluster { middle: 0.5 * low + 0.5 * high, half: 0.5 * high - 0.5 * low, padding: 0, spare: 0 }
    };
    geometry.triangles.par_chunks(TRIANGLES).map(around).collect()
}

impl Clusters {
    pub fn new(gpu: &Gpu) -> Result<Clusters> {
        let list = Pass::compute(gpu, "caster culling", "map/faces.wgsl", "list_clusters", &[FaceParams::GROUP])?;
        Ok(Clusters { list, held: None })
    }

    /// The clusters that some face may draw, and first the arguments of a dispatch with a workgroup for each. `bound`: as `cull` has it.
    pub fn list(&mut self, f: &mut Frame, bound: &[(&'static str, Resource)]) -> Buffer {
        let (gpu, revision) = (f.gpu, f.revision);
        let [boxes, listing] = match self.held.take() {
            Some(held) if held.0 == revision => &self.held.insert(held).1,
            _ => {
                let made = boxes(f.geometry);
                let usage = Use::STORAGE | Use::INDIRECT | Use::COPY_DST | Use::COPY_SRC;
                let boxes = gpu.buffer("clusters' boxes", bytemuck::cast_slice(&made), Use::STORAGE);
                let list = gpu.room("clusters to draw", HEAD + made.len() as u64 * LISTED, usage);
                &self.held.insert((revision, [boxes, list])).1
            }
        };
        f.clear_range(listing, 0, HEAD);
        let groups = f.scene.triangle_count.div_ceil((64 * TRIANGLES) as u32);
        let run = f.run(&self.list).bind_all(bound).bind("clusters", boxes);
        run.bind("listing", listing).dispatch(groups, 1, 1);
        f.keep_table("listed_clusters", listing);
        listing.clone()
    }
}
