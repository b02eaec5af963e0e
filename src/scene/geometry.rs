//! A scene flattened to world-space triangles with a BVH: what raster and rays work on.

use super::{Interpolation, Local, Property, Scene, Wrap};
use crate::gpu::Gpu;
use anyhow::{Result, ensure};
use bytemuck::{Pod, Zeroable};
use glam::{Mat3, Mat4, Quat, Vec2, Vec3, Vec4};
use obvhs::bvh2::Bvh2;
use rayon::prelude::*;
use std::collections::HashMap;

/// A vertex as `Vertex` in `shaders/lib/scene.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Vertex {
    pub position: Vec3,
    /// Octahedral, 2 × 16 bit signed.
    pub normal: u32,
    pub uv: Vec2,
    pub material: u32,
    pub padding: u32,
}

/// A triangle in BVH order, as `Corners` in `shaders/lib/trace.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Corners {
    pub a: Vec3,
    pub surface: u32,
    pub b: Vec3,
    /// Material + 1 if it is masked, else 0.
    pub masked: u32,
    pub c: Vec3,
    pub triangle: u32,
}

/// A material as in `shaders/lib/scene.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct GpuMaterial {
    pub base_color: Vec4,
    pub texture: u32,
    pub cutoff: f32,
    pub double_sided: u32,
    pub wrap: u32,
}

/// World-space triangles at one moment of the scene's clock.
pub struct Geometry {
    pub vertices: Vec<Vertex>,
    /// Three vertices and the surface id that exact duplicates share. Opaque triangles come first.
    pub triangles: Vec<[u32; 4]>,
    /// How many of the triangles are opaque.
    pub opaque: usize,
    pub bounds: [Vec3; 2],
    pub bvh: Bvh2,
}

/// Nodes that the shader's traversal stack can hold.
const MAX_DEPTH: usize = 64;

impl Geometry {
    /// Flattens the scene as it stands at `time` seconds of animation `clip`, and builds its BVH.
    ///
    /// # Errors
    /// No triangles, or a BVH deeper than the shader's stack.
    pub fn new(scene: &Scene, clip: usize, time: f32) -> Result<Geometry> {
        let worlds = world_matrices(scene, Some(clip), time);
        let placed = placements(scene, &worlds);
        let mut triangles = Vec::new();
        let mut opaque = 0;
        for masked in [false, true] {
            let mut first = 0;
            for (mesh, world) in &placed {
                let mesh = &scene.meshes[*mesh];
                if scene.materials[mesh.material as usize].alpha_cutoff.is_some() == masked {
                    let flip = world.determinant() < 0.0;
                    triangles.extend(mesh.indices.chunks_exact(3).map(|t| {
                        let (b, c) = if flip { (t[2], t[1]) } else { (t[1], t[2]) };
                        [first + t[0], first + b, first + c, 0]
                    }));
                }
                first += mesh.positions.len() as u32;
            }
            if !masked {
                opaque = triangles.len();
            }
        }
        ensure!(!triangles.is_empty(), "{} holds no triangles to draw", scene.name);
        let vertices = transformed(scene, &placed);
        number_surfaces(&vertices, &mut triangles);
        let tris: Vec<_> = triangles.iter().map(|t| obvh_triangle(&vertices, t)).collect();
        let config = obvhs::BvhBuildParams { pre_split: false, ..obvhs::BvhBuildParams::medium_build() };
        let bvh = obvhs::bvh2::builder::build_bvh2_from_tris(&tris, config, &mut Default::default());
        let depth = depth(&bvh);
        ensure!(
            depth <= MAX_DEPTH,
            "{} nests too deeply for the ray tracer ({depth} levels of {MAX_DEPTH})",
            scene.name
        );
        let mut geometry = Geometry { vertices, triangles, opaque, bounds: [Vec3::ZERO; 2], bvh };
        geometry.refit();
        Ok(geometry)
    }

    /// Moves everything to another moment of the clock; the BVH keeps its shape and is refitted.
    pub fn update(&mut self, scene: &Scene, clip: usize, time: f32) {
        let worlds = world_matrices(scene, Some(clip), time);
        self.vertices = transformed(scene, &placements(scene, &worlds));
        self.refit();
    }

    fn refit(&mut self) {
        for i in 0..self.bvh.nodes.len() {
            let node = self.bvh.nodes[i];
            if node.is_leaf() {
                let first = node.first_index as usize;
                let mut low = Vec3::INFINITY;
                let mut high = Vec3::NEG_INFINITY;
                for p in &self.bvh.primitive_indices[first..first + node.prim_count as usize] {
                    for v in &self.triangles[*p as usize][..3] {
                        let p = self.vertices[*v as usize].position;
                        low = low.min(p);
                        high = high.max(p);
                    }
                }
                // An ulp of room, so that rounding in the shader loses nothing.
                let low = low.to_array().map(f32::next_down).into();
                let high = high.to_array().map(f32::next_up).into();
                self.bvh.nodes[i].min = low;
                self.bvh.nodes[i].max = high;
            }
        }
        self.bvh.refit_all();
        if let Some(root) = self.bvh.nodes.first() {
            self.bounds = [root.min, root.max];
        }
    }

    /// The three corners of a triangle.
    pub fn corners(&self, triangle: usize) -> [Vec3; 3] {
        let t = self.triangles[triangle];
        [0, 1, 2].map(|i| self.vertices[t[i] as usize].position)
    }

    /// The triangles in BVH order, as the rays read them.
    pub fn bvh_order(&self, scene: &Scene) -> Vec<Corners> {
        let corners = |p: &u32| {
            let t = self.triangles[*p as usize];
            let [a, b, c] = self.corners(*p as usize);
            let material = self.vertices[t[0] as usize].material;
            let masked = scene.materials[material as usize].alpha_cutoff.is_some();
            Corners { a, surface: t[3], b, masked: if masked { material + 1 } else { 0 }, c, triangle: *p }
        };
        self.bvh.primitive_indices.par_iter().map(corners).collect()
    }
}

fn obvh_triangle(vertices: &[Vertex], t: &[u32; 4]) -> obvhs::triangle::Triangle {
    let [v0, v1, v2] = [0, 1, 2].map(|i| vertices[t[i] as usize].position.into());
    obvhs::triangle::Triangle { v0, v1, v2 }
}

fn depth(bvh: &Bvh2) -> usize {
    let mut deepest = 0;
    let mut stack = vec![(0usize, 1usize)];
    while let Some((i, depth)) = stack.pop() {
        deepest = deepest.max(depth);
        let node = bvh.nodes[i];
        if !node.is_leaf() {
            stack.push((node.first_index as usize, depth + 1));
            stack.push((node.first_index as usize + 1, depth + 1));
        }
    }
    deepest
}

/// Gives exact duplicates (same corners in any order) one surface id, so that a ray that starts on one
/// does not hit the other.
fn number_surfaces(vertices: &[Vertex], triangles: &mut [[u32; 4]]) {
    let mut seen = HashMap::with_capacity(triangles.len());
    for (i, t) in triangles.iter_mut().enumerate() {
        let mut key = [0, 1, 2].map(|c| vertices[t[c] as usize].position.to_array().map(|x| (x + 0.0).to_bits()));
        key.sort_unstable();
        t[3] = *seen.entry(key).or_insert(i as u32);
    }
}

/// Every mesh with the matrix it is drawn with, in a fixed order.
pub fn placements(scene: &Scene, worlds: &[Mat4]) -> Vec<(usize, Mat4)> {
    let mut placed = Vec::new();
    for (node, world) in scene.nodes.iter().zip(worlds) {
        for mesh in &node.meshes {
            if node.instances.is_empty() {
                placed.push((*mesh as usize, *world));
            }
            placed.extend(node.instances.iter().map(|i| (*mesh as usize, *world * *i)));
        }
    }
    placed
}

fn transformed(scene: &Scene, placed: &[(usize, Mat4)]) -> Vec<Vertex> {
    let parts: Vec<Vec<Vertex>> = placed
        .par_iter()
        .map(|(mesh, world)| {
            let mesh = &scene.meshes[*mesh];
            let normal = Mat3::from_mat4(*world).inverse().transpose();
            let flat = !normal.is_finite();
            (0..mesh.positions.len())
                .map(|i| {
                    let n = if flat { mesh.normals[i] } else { normal * mesh.normals[i] };
                    Vertex {
                        position: world.transform_point3(mesh.positions[i]),
                        normal: octahedral(n.normalize_or(Vec3::Y)),
                        uv: mesh.uvs[i],
                        material: mesh.material,
                        padding: 0,
                    }
                })
                .collect()
        })
        .collect();
    parts.concat()
}

/// Packs a unit vector as `octahedral_encode` of the shaders does.
pub fn octahedral(n: Vec3) -> u32 {
    let p = Vec2::new(n.x, n.y) / (n.x.abs() + n.y.abs() + n.z.abs());
    let sign = |x: f32| if x >= 0.0 { 1.0 } else { -1.0 };
    let p = if n.z >= 0.0 { p } else { Vec2::new((1.0 - p.y.abs()) * sign(p.x), (1.0 - p.x.abs()) * sign(p.y)) };
    let pack = |x: f32| ((x.clamp(-1.0, 1.0) * 32767.0).round() as i16 as u16) as u32;
    pack(p.x) | pack(p.y) << 16
}

/// The nodes' matrices at `time` seconds of animation `clip`; without one as the file has them.
pub fn world_matrices(scene: &Scene, clip: Option<usize>, time: f32) -> Vec<Mat4> {
    let mut locals: Vec<Local> = scene.nodes.iter().map(|n| n.local).collect();
    for channel in clip.and_then(|c| scene.animations.get(c)).map(|a| a.channels.as_slice()).unwrap_or_default() {
        if let Local::Trs { translation, rotation, scale } = &mut locals[channel.node as usize] {
            let v = sample(channel, time);
            match channel.property {
                Property::Translation => *translation = v.truncate(),
                Property::Rotation => *rotation = Quat::from_vec4(v).normalize(),
                Property::Scale => *scale = v.truncate(),
            }
        }
    }
    let mut worlds: Vec<Mat4> = Vec::with_capacity(locals.len());
    for (node, local) in scene.nodes.iter().zip(locals) {
        let parent = node.parent.map_or(Mat4::IDENTITY, |p| worlds[p as usize]);
        worlds.push(parent * local.matrix());
    }
    worlds
}

/// A channel's value at `time`, as the glTF 2.0 specification (appendix C) interpolates it.
fn sample(channel: &super::Channel, time: f32) -> Vec4 {
    let times = &channel.times;
    let cubic = channel.interpolation == Interpolation::CubicSpline;
    let value = |i: usize| channel.values[if cubic { 3 * i + 1 } else { i }];
    let next = times.partition_point(|t| *t <= time);
    if next == 0 || next == times.len() {
        return value(next.saturating_sub(1));
    }
    let (i, span) = (next - 1, times[next] - times[next - 1]);
    let t = (time - times[i]) / span;
    match channel.interpolation {
        Interpolation::Step => value(i),
        Interpolation::Linear if channel.property == Property::Rotation => {
            Quat::from_vec4(value(i)).normalize().slerp(Quat::from_vec4(value(next)).normalize(), t).into()
        }
        Interpolation::Linear => value(i).lerp(value(next), t),
        Interpolation::CubicSpline => {
            let (out, into) = (channel.values[3 * i + 2] * span, channel.values[3 * next] * span);
            let (t2, t3) = (t * t, t * t * t);
            value(i) * (2.0 * t3 - 3.0 * t2 + 1.0)
                + out * (t3 - 2.0 * t2 + t)
                + value(next) * (3.0 * t2 - 2.0 * t3)
                + into * (t3 - t2)
        }
    }
}

/// A scene's buffers on the GPU.
pub struct SceneGpu {
    pub vertices: wgpu::Buffer,
    pub indices: wgpu::Buffer,
    pub triangles: wgpu::Buffer,
    pub materials: wgpu::Buffer,
    pub nodes: wgpu::Buffer,
    pub corners: wgpu::Buffer,
    pub textures: wgpu::TextureView,
    pub sampler: wgpu::Sampler,
    pub triangle_count: u32,
    pub opaque_count: u32,
    pub bounds: [Vec3; 2],
}

impl SceneGpu {
    /// Uploads a scene.
    ///
    /// # Errors
    /// A buffer or texture larger than the adapter allows.
    pub fn new(gpu: &Gpu, scene: &Scene, geometry: &Geometry) -> Result<SceneGpu> {
        let limits = gpu.device.limits();
        let corners = geometry.bvh_order(scene);
        let largest = (geometry.vertices.len() * size_of::<Vertex>()).max(corners.len() * size_of::<Corners>()) as u64;
        ensure!(
            largest <= limits.max_storage_buffer_binding_size,
            "{} needs {} MiB in one buffer, and {} allows {}",
            scene.name,
            largest >> 20,
            gpu.info.name,
            limits.max_storage_buffer_binding_size >> 20
        );
        let storage = wgpu::BufferUsages::STORAGE;
        let flat: Vec<u32> = geometry.triangles.iter().flat_map(|t| [t[0], t[1], t[2]]).collect();
        let wrap = |w: Wrap| w as u32;
        let materials: Vec<GpuMaterial> = scene
            .materials
            .iter()
            .map(|m| GpuMaterial {
                base_color: m.base_color,
                texture: m.texture.map_or(0, |t| t + 1),
                cutoff: m.alpha_cutoff.unwrap_or(-1.0),
                double_sided: m.double_sided as u32,
                wrap: m.texture.map_or(0, |t| {
                    let w = scene.textures[t as usize].wrap;
                    wrap(w[0]) | wrap(w[1]) << 2
                }),
            })
            .collect();
        Ok(SceneGpu {
            vertices: gpu.buffer("vertices", bytemuck::cast_slice(&geometry.vertices), storage),
            indices: gpu.buffer("indices", bytemuck::cast_slice(&flat), wgpu::BufferUsages::INDEX),
            triangles: gpu.buffer("triangles", bytemuck::cast_slice(&geometry.triangles), storage),
            materials: gpu.buffer("materials", bytemuck::cast_slice(&materials), storage),
            nodes: gpu.buffer("BVH nodes", bytemuck::cast_slice(&geometry.bvh.nodes), storage),
            corners: gpu.buffer("BVH triangles", bytemuck::cast_slice(&corners), storage),
            textures: super::textures::upload(gpu, scene)?,
            sampler: gpu.device.create_sampler(&wgpu::SamplerDescriptor {
                label: Some("textures"),
                address_mode_u: wgpu::AddressMode::Repeat,
                address_mode_v: wgpu::AddressMode::Repeat,
                mag_filter: wgpu::FilterMode::Linear,
                min_filter: wgpu::FilterMode::Linear,
                mipmap_filter: wgpu::MipmapFilterMode::Linear,
                ..Default::default()
            }),
            triangle_count: geometry.triangles.len() as u32,
            opaque_count: geometry.opaque as u32,
            bounds: geometry.bounds,
        })
    }

    /// Draws the opaque triangles, indexed.
    pub fn draw_opaque(&self, pass: &mut wgpu::RenderPass) {
        pass.set_index_buffer(self.indices.slice(..), wgpu::IndexFormat::Uint32);
        pass.draw_indexed(0..self.opaque_count * 3, 0, 0..1);
    }

    /// Draws the alpha-masked triangles, indexed.
    pub fn draw_masked(&self, pass: &mut wgpu::RenderPass) {
        pass.set_index_buffer(self.indices.slice(..), wgpu::IndexFormat::Uint32);
        pass.draw_indexed(self.opaque_count * 3..self.triangle_count * 3, 0, 0..1);
    }

    /// Uploads what an animation moved.
    pub fn update(&mut self, gpu: &Gpu, scene: &Scene, geometry: &Geometry) {
        gpu.queue.write_buffer(&self.vertices, 0, bytemuck::cast_slice(&geometry.vertices));
        gpu.queue.write_buffer(&self.nodes, 0, bytemuck::cast_slice(&geometry.bvh.nodes));
        gpu.queue.write_buffer(&self.corners, 0, bytemuck::cast_slice(&geometry.bvh_order(scene)));
        self.bounds = geometry.bounds;
    }
}
