//! A scene flattened to world-space triangles with a BVH: what raster and rays work on.

use super::{Interpolation, Local, Property, Scene, Wrap};
use crate::gpu::Gpu;
use anyhow::{Result, ensure};
use bytemuck::{Pod, Zeroable};
use glam::{Mat3, Mat4, Quat, Vec2, Vec3, Vec4};
use obvhs::bvh2::node::Bvh2Node;
use obvhs::triangle::Triangle;
use rayon::prelude::*;
use std::collections::HashMap;
use std::mem::offset_of;

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

impl Vertex {
    /// A caster's corner as `Corner` in `shaders/lib/depth.wgsl`: position, texture coordinates, material.
    pub const LAYOUT: wgpu::VertexBufferLayout<'static> = wgpu::VertexBufferLayout {
        array_stride: size_of::<Vertex>() as u64,
        step_mode: wgpu::VertexStepMode::Vertex,
        attributes: &[
            attribute(0, offset_of!(Vertex, position), wgpu::VertexFormat::Float32x3),
            attribute(1, offset_of!(Vertex, uv), wgpu::VertexFormat::Float32x2),
            attribute(2, offset_of!(Vertex, material), wgpu::VertexFormat::Uint32),
        ],
    };
}

const fn attribute(shader_location: u32, offset: usize, format: wgpu::VertexFormat) -> wgpu::VertexAttribute {
    wgpu::VertexAttribute { shader_location, offset: offset as u64, format }
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
    /// The BVH: the root first, children side by side.
    pub nodes: Vec<Bvh2Node>,
    /// The triangles in the order in which the BVH's leaves name them.
    pub order: Vec<u32>,
}

/// Levels that the shader's traversal stack can hold.
const MAX_DEPTH: usize = 64;

impl Geometry {
    /// Flattens the scene as it stands at `time` seconds of animation `clip`, and builds its BVH.
    ///
    /// # Errors
    /// No triangles.
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
        let (mut nodes, order) = hierarchy(&vertices, &triangles);
        // An ulp of room, so that rounding in the shader loses nothing.
        for node in &mut nodes {
            node.min = node.min.to_array().map(f32::next_down).into();
            node.max = node.max.to_array().map(f32::next_up).into();
        }
        Ok(Geometry { bounds: [nodes[0].min, nodes[0].max], vertices, triangles, opaque, nodes, order })
    }

    /// The three corners of a triangle.
    pub fn corners(&self, triangle: usize) -> [Vec3; 3] {
        let t = self.triangles[triangle];
        [0, 1, 2].map(|i| self.vertices[t[i] as usize].position)
    }

    /// The triangles in BVH order, as the rays read them.
    fn bvh_order(&self, scene: &Scene) -> Vec<Corners> {
        let corners = |p: &u32| {
            let t = self.triangles[*p as usize];
            let [a, b, c] = self.corners(*p as usize);
            let material = self.vertices[t[0] as usize].material;
            let masked = scene.materials[material as usize].alpha_cutoff.is_some();
            Corners { a, surface: t[3], b, masked: if masked { material + 1 } else { 0 }, c, triangle: *p }
        };
        self.order.par_iter().map(corners).collect()
    }

    /// The triangles' corners: of opaque ones the first vertex at the same place (`welded`), so that one is transformed once.
    fn flat_indices(&self, welded: &[u32]) -> Vec<u32> {
        let (opaque, masked) = self.triangles.split_at(self.opaque);
        let opaque = opaque.iter().flat_map(|t| [0, 1, 2].map(|i| welded[t[i] as usize]));
        opaque.chain(masked.iter().flat_map(|t| [t[0], t[1], t[2]])).collect()
    }
}

/// A BVH over the triangles, and their order in it, no deeper than the shader's stack.
fn hierarchy(vertices: &[Vertex], triangles: &[[u32; 4]]) -> (Vec<Bvh2Node>, Vec<u32>) {
    let corner = |t: &[u32; 4], i: usize| vertices[t[i] as usize].position.into();
    let tris: Vec<_> =
        triangles.iter().map(|t| Triangle { v0: corner(t, 0), v1: corner(t, 1), v2: corner(t, 2) }).collect();
    let config = obvhs::BvhBuildParams { pre_split: false, ..obvhs::BvhBuildParams::fast_build() };
    let bvh = obvhs::bvh2::builder::build_bvh2_from_tris(&tris, config, &mut Default::default());
    if depth(&bvh.nodes) <= MAX_DEPTH {
        return (bvh.nodes, bvh.primitive_indices);
    }
    // Many triangles in one place can make that builder nest without end; halving the list cannot.
    let boxes: Vec<[Vec3; 2]> =
        tris.iter().map(|t| [t.v0.min(t.v1).min(t.v2).into(), t.v0.max(t.v1).max(t.v2).into()]).collect();
    let mut order: Vec<u32> = (0..triangles.len() as u32).collect();
    let mut nodes = vec![Bvh2Node::default()];
    halve(&boxes, &mut order, 0, 0, &mut nodes);
    (nodes, order)
}

/// Makes node `at` of the triangles `order`, which begin at `first` of the whole list, by halves along the longest axis.
fn halve(boxes: &[[Vec3; 2]], order: &mut [u32], first: usize, at: usize, nodes: &mut Vec<Bvh2Node>) {
    let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    for i in order.iter() {
        low = low.min(boxes[*i as usize][0]);
        high = high.max(boxes[*i as usize][1]);
    }
    nodes[at] = Bvh2Node { min: low, max: high, prim_count: order.len() as u32, first_index: first as u32 };
    if order.len() > 4 {
        let axis = (high - low).max_position();
        let middle = order.len() / 2;
        let place = |i: &u32| boxes[*i as usize][0][axis] + boxes[*i as usize][1][axis];
        order.select_nth_unstable_by(middle, |a, b| place(a).total_cmp(&place(b)));
        let children = nodes.len();
        nodes[at].prim_count = 0;
        nodes[at].first_index = children as u32;
        nodes.extend([Bvh2Node::default(); 2]);
        let (left, right) = order.split_at_mut(middle);
        halve(boxes, left, first, children, nodes);
        halve(boxes, right, first + middle, children + 1, nodes);
    }
}

fn depth(nodes: &[Bvh2Node]) -> usize {
    let mut deepest = 0;
    let mut stack = vec![(0usize, 1usize)];
    while let Some((i, depth)) = stack.pop() {
        deepest = deepest.max(depth);
        if !nodes[i].is_leaf() {
            stack.push((nodes[i].first_index as usize, depth + 1));
            stack.push((nodes[i].first_index as usize + 1, depth + 1));
        }
    }
    deepest
}

/// Gives exact duplicates (same corners in any order) one surface id, so that a ray that starts on one
/// does not hit the other.
fn number_surfaces(vertices: &[Vertex], triangles: &mut [[u32; 4]]) {
    let key = |t: &[u32; 4]| {
        let mut key = [0, 1, 2].map(|c| vertices[t[c] as usize].position.to_array().map(|x| (x + 0.0).to_bits()));
        key.sort_unstable();
        key
    };
    let mut sorted: Vec<_> = triangles.par_iter().enumerate().map(|(i, t)| (key(t), i as u32)).collect();
    sorted.par_sort_unstable();
    for same in sorted.chunk_by(|a, b| a.0 == b.0) {
        for (_, i) in same {
            triangles[*i as usize][3] = same[0].1;
        }
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

/// For each vertex the first one of its mesh at the same place: what opaque casters need of it.
fn welded(scene: &Scene) -> Vec<u32> {
    let mut of_mesh: HashMap<usize, Vec<u32>> = HashMap::new();
    let mut all = Vec::new();
    for (mesh, _) in placements(scene, &world_matrices(scene, None, 0.0)) {
        let first = all.len() as u32;
        let own = of_mesh.entry(mesh).or_insert_with(|| {
            let mut places = HashMap::new();
            let positions = scene.meshes[mesh].positions.iter().zip(0..);
            positions.map(|(p, i)| *places.entry(p.to_array().map(f32::to_bits)).or_insert(i)).collect()
        });
        all.extend(own.iter().map(|i| first + i));
    }
    all
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
fn octahedral(n: Vec3) -> u32 {
    let p = Vec2::new(n.x, n.y) / (n.x.abs() + n.y.abs() + n.z.abs());
    let sign = |x: f32| if x >= 0.0 { 1.0 } else { -1.0 };
    let p = if n.z >= 0.0 { p } else { Vec2::new((1.0 - p.y.abs()) * sign(p.x), (1.0 - p.x.abs()) * sign(p.y)) };
    let pack = |x: f32| ((x.clamp(-1.0, 1.0) * 32767.0).round() as i16 as u16) as u32;
    pack(p.x) | pack(p.y) << 16
}

/// Unpacks a unit vector as `octahedral_decode` of the shaders does.
pub fn octahedral_decode(bits: u32) -> Vec3 {
    let unpack = |b: u32| (b as u16 as i16 as f32 / 32767.0).max(-1.0);
    let (x, y) = (unpack(bits), unpack(bits >> 16));
    let z = 1.0 - x.abs() - y.abs();
    let t = (-z).max(0.0);
    let x = x + if x >= 0.0 { -t } else { t };
    let y = y + if y >= 0.0 { -t } else { t };
    Vec3::new(x, y, z).normalize()
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
    /// Three corners a triangle, for casters.
    pub indices: wgpu::Buffer,
    welded: Vec<u32>,
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
        let mut nodes = geometry.nodes.clone();
        if !scene.animations.is_empty() {
            // An animation rebuilds the BVH: room for the largest one of as many triangles.
            nodes.resize(2 * corners.len(), Bvh2Node::default());
        }
        let sizes = [size_of_val(&geometry.vertices[..]), size_of_val(&nodes[..]), size_of_val(&corners[..])];
        let largest = sizes.into_iter().max().unwrap_or(0) as u64;
        ensure!(
            largest <= limits.max_storage_buffer_binding_size,
            "{} needs {} MiB in one buffer, and {} allows {}",
            scene.name,
            largest >> 20,
            gpu.info.name,
            limits.max_storage_buffer_binding_size >> 20
        );
        use wgpu::BufferUsages as Use;
        let storage = Use::STORAGE;
        let welded = welded(scene);
        let indices = geometry.flat_indices(&welded);
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
            vertices: gpu.buffer("vertices", bytemuck::cast_slice(&geometry.vertices), Use::VERTEX | Use::STORAGE),
            indices: gpu.buffer("indices", bytemuck::cast_slice(&indices), Use::INDEX | Use::STORAGE),
            welded,
            triangles: gpu.buffer("triangles", bytemuck::cast_slice(&geometry.triangles), storage),
            materials: gpu.buffer("materials", bytemuck::cast_slice(&materials), storage),
            nodes: gpu.buffer("BVH nodes", bytemuck::cast_slice(&nodes), storage),
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

    /// Sets the casters' vertices, and the indices to draw of them.
    pub fn set_casters(&self, pass: &mut wgpu::RenderPass, indices: &wgpu::Buffer) {
        pass.set_vertex_buffer(0, self.vertices.slice(..));
        pass.set_index_buffer(indices.slice(..), wgpu::IndexFormat::Uint32);
    }

    /// Draws the opaque triangles, indexed.
    pub fn draw_opaque(&self, pass: &mut wgpu::RenderPass) {
        self.set_casters(pass, &self.indices);
        pass.draw_indexed(0..self.opaque_count * 3, 0, 0..1);
    }

    /// Draws the alpha-masked triangles, indexed.
    pub fn draw_masked(&self, pass: &mut wgpu::RenderPass) {
        self.set_casters(pass, &self.indices);
        pass.draw_indexed(self.opaque_count * 3..self.triangle_count * 3, 0, 0..1);
    }

    /// Uploads the same scene's geometry at another moment.
    pub fn update(&mut self, gpu: &Gpu, scene: &Scene, geometry: &Geometry) {
        gpu.queue.write_buffer(&self.vertices, 0, bytemuck::cast_slice(&geometry.vertices));
        // Winding and surface ids can change too: a scale may pass through zero.
        gpu.queue.write_buffer(&self.indices, 0, bytemuck::cast_slice(&geometry.flat_indices(&self.welded)));
        gpu.queue.write_buffer(&self.triangles, 0, bytemuck::cast_slice(&geometry.triangles));
        gpu.queue.write_buffer(&self.nodes, 0, bytemuck::cast_slice(&geometry.nodes));
        gpu.queue.write_buffer(&self.corners, 0, bytemuck::cast_slice(&geometry.bvh_order(scene)));
        self.bounds = geometry.bounds;
    }
}
