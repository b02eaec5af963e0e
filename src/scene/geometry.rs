//! A scene flattened to triangles in scene space with a BVH: what raster and rays work on.

use super::bvh::{Bvh, Child};
use super::edges::Edges;
use super::pose::{Placement, placements};
use super::textures::{Arrays, Limits};
use super::{Scene, Wrap};
use crate::gpu::{Buffer, Gpu, Table};
use crate::map::fit::hull::Polyhedron;
use crate::map::fit::quickhull::convex_hull;
use anyhow::{Result, ensure};
use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Mat3, Vec2, Vec3, Vec4};
use obvhs::triangle::Triangle;
use rayon::prelude::*;
use std::collections::HashMap;
use std::mem::offset_of;
use std::sync::OnceLock;

/// A vertex as `Vertex` in `shaders/lib/scene.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Vertex {
    pub position: Vec3,
    /// Octahedral, 2 × 16 bit signed.
    pub normal: u32,
    pub uv: Vec2,
    pub material: u32,
    /// What its colour takes off white: see [`taken_off`].
    pub color: u32,
}

impl Vertex {
    /// A caster's corner as `Corner` in `shaders/map/casters.wgsl`: position, texture coordinates, material, colour.
    pub const LAYOUT: wgpu::VertexBufferLayout<'static> = wgpu::VertexBufferLayout {
        array_stride: size_of::<Vertex>() as u64,
        step_mode: wgpu::VertexStepMode::Vertex,
        attributes: &[
            attribute(0, offset_of!(Vertex, position), wgpu::VertexFormat::Float32x3),
            attribute(1, offset_of!(Vertex, uv), wgpu::VertexFormat::Float32x2),
            attribute(2, offset_of!(Vertex, material), wgpu::VertexFormat::Uint32),
            attribute(3, offset_of!(Vertex, color), wgpu::VertexFormat::Unorm8x4),
        ],
    };
}

const fn attribute(shader_location: u32, offset: usize, format: wgpu::VertexFormat) -> wgpu::VertexAttribute {
    wgpu::VertexAttribute { shader_location, offset: offset as u64, format }
}

/// A triangle in BVH order, as three texels that `shaders/lib/trace.wgsl` reads.
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
    pub texels: Vec2,
    /// Bits as in the shaders.
    pub nearest: u32,
    pub padding: u32,
}

/// Triangles in scene space at one moment of the scene's clock.
pub struct Geometry {
    pub vertices: Vec<Vertex>,
    /// Three vertices and the surface id that exact duplicates share. Opaque triangles come first.
    pub triangles: Vec<[u32; 4]>,
    /// How many of the triangles are opaque.
    pub opaque: usize,
    pub bounds: [Vec3; 2],
    /// Of the triangles without those that would stop no ray beside their exact duplicates.
    pub bvh: Bvh,
    /// Of each material whether its triangles are seen from behind too.
    two_sided: Vec<bool>,
    hull: OnceLock<Polyhedron>,
    casters: OnceLock<Vec<u32>>,
    welded: OnceLock<Vec<u32>>,
    edges: OnceLock<Edges>,
}

impl Geometry {
    /// Flattens the scene as it stands at `time` seconds of animation `clip`, and builds its BVH.
    ///
    /// # Errors
    /// No triangles, or positions that are not finite.
    pub fn new(scene: &Scene, clip: usize, time: f32) -> Result<Geometry> {
        let placed = placements(scene, clip, time);
        let mut triangles = Vec::new();
        let mut opaque = 0;
        for masked in [false, true] {
            let mut first = 0;
            for placed in &placed {
                let mesh = placed.mesh;
                if scene.materials[mesh.material as usize].alpha_cutoff.is_some() == masked {
                    triangles.extend(mesh.indices.chunks_exact(3).map(|t| {
                        let (b, c) = if placed.mirrors(t[0] as usize) { (t[2], t[1]) } else { (t[1], t[2]) };
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
        let vertices = transformed(&placed);
        ensure!(
            scene.animations.is_empty() || vertices.par_iter().all(|v| v.position.is_finite()),
            "at {time} s of its animation {} leaves the range of 32-bit floats; choose another moment or mend the file",
            scene.name
        );
        let distinct = number_surfaces(&vertices, &mut triangles, opaque);
        let corner = |i: u32, c: usize| vertices[triangles[i as usize][c] as usize].position.into();
        let tris: Vec<_> =
            distinct.iter().map(|i| Triangle { v0: corner(*i, 0), v1: corner(*i, 1), v2: corner(*i, 2) }).collect();
        let mut bvh = Bvh::new(&tris);
        bvh.order.iter_mut().for_each(|i| *i = distinct[*i as usize]);
        Ok(Geometry {
            bounds: bvh.bounds,
            vertices,
            triangles,
            opaque,
            bvh,
            two_sided: scene.materials.iter().map(|m| m.double_sided).collect(),
            hull: OnceLock::new(),
            casters: OnceLock::new(),
            welded: OnceLock::new(),
            edges: OnceLock::new(),
        })
    }

    /// The three corners of a triangle.
    pub fn corners(&self, triangle: usize) -> [Vec3; 3] {
        let t = self.triangles[triangle];
        [0, 1, 2].map(|i| self.vertices[t[i] as usize].position)
    }

    /// The triangle that a camera at `from` sees along `ray`, and how far off it is, in lengths of the ray; not before `near`.
    /// Masked materials count as whole.
    pub fn seen(&self, from: DVec3, ray: DVec3, near: f64) -> Option<(f64, usize)> {
        let mut first: Option<(f64, usize)> = None;
        let mut open = vec![0];
        // Nothing is divided by zero.
        let across = DVec3::from_array(ray.to_array().map(|x| if x == 0.0 { 1e-300 } else { x }));
        while let Some(at) = open.pop() {
            for (ends, child) in self.bvh.nodes[at].children() {
                let [a, b] = ends.map(|end| (end.as_dvec3() - from) / across);
                let (enter, leave) = (a.min(b).max_element(), a.max(b).min_element());
                if enter > leave || leave < near || first.is_some_and(|(t, _)| enter > t) {
                    continue;
                }
                match child {
                    Child::Node(node) => open.push(node),
                    Child::Triangles(range) => {
                        for triangle in &self.bvh.order[range] {
                            let t = self.met(*triangle as usize, from, ray).filter(|t| *t >= near);
                            first = match (t, first) {
                                (Some(t), Some((least, _))) if t >= least => first,
                                (Some(t), _) => Some((t, *triangle as usize)),
                                _ => first,
                            };
                        }
                    }
                }
            }
        }
        first
    }

    /// Where a ray meets a triangle that is seen from its side, in lengths of the ray.
    fn met(&self, triangle: usize, from: DVec3, ray: DVec3) -> Option<f64> {
        let [a, b, c] = self.corners(triangle).map(|p| p.as_dvec3() - from);
        let normal = (b - a).cross(c - a);
        let (towards, material) = (normal.dot(ray), self.vertices[self.triangles[triangle][0] as usize].material);
        if towards == 0.0 || towards > 0.0 && !self.two_sided[material as usize] {
            return None;
        }
        // On the same side of all three planes through the ray's start and an edge.
        let sides = [(a, b), (b, c), (c, a)].map(|(p, q)| p.cross(q).dot(ray));
        let inside = sides.iter().all(|s| *s >= 0.0) || sides.iter().all(|s| *s <= 0.0);
        inside.then(|| normal.dot(a) / towards)
    }

    /// The convex hull of all triangles at this moment, made when it is first asked for.
    pub fn hull(&self) -> &Polyhedron {
        self.hull.get_or_init(|| {
            let mut used = vec![false; self.vertices.len()];
            self.triangles.iter().flat_map(|t| &t[..3]).for_each(|i| used[*i as usize] = true);
            let corners = self.vertices.iter().zip(used).filter(|(_, used)| *used);
            convex_hull(corners.map(|(v, _)| v.position.as_dvec3()))
        })
    }

    /// For each vertex the first one at the same place, whatever mesh it belongs to; found when it is first asked for.
    pub fn welded(&self) -> &[u32] {
        self.welded.get_or_init(|| {
            let mut places = HashMap::new();
            (self.vertices.iter().zip(0..))
                .map(|(v, i)| *places.entry(v.position.to_array().map(|x| (x + 0.0).to_bits())).or_insert(i))
                .collect()
        })
    }

    /// The triangles' edges, found when they are first asked for.
    pub fn edges(&self) -> &Edges {
        self.edges.get_or_init(|| Edges::new(self))
    }

    /// For each triangle a number that those which hang together share, corner by corner; made when it is first asked for.
    pub fn casters(&self) -> &[u32] {
        self.casters.get_or_init(|| {
            let first = self.welded();
            // Of each vertex one that hangs together with it.
            let mut parent: Vec<u32> = (0..self.vertices.len() as u32).collect();
            let root = |parent: &mut [u32], mut i: u32| {
                while parent[i as usize] != i {
                    parent[i as usize] = parent[parent[i as usize] as usize];
                    i = parent[i as usize];
                }
                i
            };
            for t in &self.triangles {
                let [a, b, c] = [t[0], t[1], t[2]].map(|i| root(&mut parent, first[i as usize]));
                parent[b as usize] = a;
                let c = root(&mut parent, c);
                parent[c as usize] = a;
            }
            let mut numbers = HashMap::new();
            (self.triangles.iter())
                .map(|t| {
                    let (next, root) = (numbers.len() as u32, root(&mut parent, first[t[0] as usize]));
                    *numbers.entry(root).or_insert(next)
                })
                .collect()
        })
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
        self.bvh.order.par_iter().map(corners).collect()
    }

    /// The triangles' corners: of opaque ones the first vertex at the same place (`welded`), so that one is transformed once.
    fn flat_indices(&self, welded: &[u32]) -> Vec<u32> {
        let (opaque, masked) = self.triangles.split_at(self.opaque);
        let opaque = opaque.iter().flat_map(|t| [0, 1, 2].map(|i| welded[t[i] as usize]));
        opaque.chain(masked.iter().flat_map(|t| [t[0], t[1], t[2]])).collect()
    }
}

/// Gives exact duplicates (same corners in any order) one surface id, so that a ray that starts on one does not hit the
/// other. Returns the triangles without those that stop just the rays that a duplicate stops.
fn number_surfaces(vertices: &[Vertex], triangles: &mut [[u32; 4]], opaque: usize) -> Vec<u32> {
    let place = |v: u32| vertices[v as usize].position.to_array().map(|x| (x + 0.0).to_bits());
    let key = |t: &[u32; 4]| {
        let mut key = [t[0], t[1], t[2]].map(place);
        key.sort_unstable();
        key
    };
    let mut sorted: Vec<_> = triangles.par_iter().enumerate().map(|(i, t)| (key(t), i as u32)).collect();
    sorted.par_sort_unstable();
    // The way round, and of a masked triangle the material, where its corners lie in the texture, and their alpha.
    let manner = |t: &[u32; 4], i: u32| {
        let mut corners = [0, 1, 2];
        corners.sort_by_key(|c| place(t[*c]));
        let turned = (corners[1] + 3 - corners[0]) % 3 == 2;
        let masked = i as usize >= opaque;
        let texture = masked.then(|| {
            let places = corners.map(|c| {
                let v = &vertices[t[c] as usize];
                (v.uv.to_array().map(f32::to_bits), v.color >> 24)
            });
            (vertices[t[0] as usize].material, places)
        });
        (turned, texture)
    };
    let mut spare = vec![false; triangles.len()];
    for same in sorted.chunk_by(|a, b| a.0 == b.0) {
        for (_, i) in same {
            triangles[*i as usize][3] = same[0].1;
        }
        if same.len() > 1 {
            let mut manners: Vec<_> = same.iter().map(|(_, i)| (manner(&triangles[*i as usize], *i), *i)).collect();
            manners.sort_unstable();
            for two in manners.windows(2) {
                spare[two[1].1 as usize] = two[0].0 == two[1].0;
            }
        }
    }
    (0..triangles.len() as u32).filter(|i| !spare[*i as usize]).collect()
}

/// For each vertex the first one of its mesh at the same place: what opaque casters need of it. Where morph targets or a skin
/// may part what lies in one place, each stands for itself.
fn welded(scene: &Scene) -> Vec<u32> {
    let mut of_mesh: HashMap<usize, Vec<u32>> = HashMap::new();
    let mut all = Vec::new();
    for Placement { index, mesh, .. } in placements(scene, 0, 0.0) {
        let first = all.len() as u32;
        let own = of_mesh.entry(index).or_insert_with(|| {
            if mesh.deforms() {
                return (0..mesh.positions.len() as u32).collect();
            }
            let mut places = HashMap::new();
            let positions = mesh.positions.iter().zip(0..);
            positions.map(|(p, i)| *places.entry(p.to_array().map(f32::to_bits)).or_insert(i)).collect()
        });
        all.extend(own.iter().map(|i| first + i));
    }
    all
}

fn transformed(placed: &[Placement]) -> Vec<Vertex> {
    let parts: Vec<Vec<Vertex>> = placed
        .par_iter()
        .map(|placed| {
            let mesh = placed.mesh;
            let vertex = |i: usize, position: DVec3, normal: Vec3| Vertex {
                position: position.as_vec3(),
                normal: octahedral(normal.normalize_or(Vec3::Y)),
                uv: mesh.uvs[i],
                material: mesh.material,
                color: mesh.colors.get(i).map_or(0, |c| taken_off(*c)),
            };
            let Some(world) = placed.rigid() else {
                let (positions, normals) = placed.posed();
                let unit = |n: &DVec3| n.normalize_or(DVec3::Y).as_vec3();
                return (0..).zip(positions.iter().zip(&normals)).map(|(i, (p, n))| vertex(i, *p, unit(n))).collect();
            };
            let normal = Mat3::from_mat4(world.as_mat4()).inverse().transpose();
            let flat = !normal.is_finite();
            (0..mesh.positions.len())
                .map(|i| {
                    let n = if flat { mesh.normals[i] } else { normal * mesh.normals[i] };
                    vertex(i, world.transform_point3(mesh.positions[i].as_dvec3()), n)
                })
                .collect()
        })
        .collect();
    parts.concat()
}

/// Packs what a linear colour and its alpha take off opaque white for `taken_off` of the shaders: 8 bits of the roots of red,
/// green and blue, and of alpha.
fn taken_off(color: Vec4) -> u32 {
    let color = color.clamp(Vec4::ZERO, Vec4::ONE);
    let [r, g, b] = [color.x, color.y, color.z].map(f32::sqrt);
    u32::from_le_bytes([r, g, b, color.w].map(|x| 255 - (x * 255.0).round() as u8))
}

/// Packs a unit vector for `octahedral_decode` of the shaders.
fn octahedral(n: Vec3) -> u32 {
    let p = Vec2::new(n.x, n.y) / (n.x.abs() + n.y.abs() + n.z.abs());
    let sign = |x: f32| if x >= 0.0 { 1.0 } else { -1.0 };
    let p = if n.z >= 0.0 { p } else { Vec2::new((1.0 - p.y.abs()) * sign(p.x), (1.0 - p.x.abs()) * sign(p.y)) };
    let pack = |x: f32| ((x.clamp(-1.0, 1.0) * 32767.0).round() as i16 as u16) as u32;
    pack(p.x) | pack(p.y) << 16
}

/// The shading normal of the G-buffer's surface words, as `g_shading_normal` of the shaders unpacks it.
pub fn shading_normal(words: [u32; 4]) -> Vec3 {
    let unpack = |shift: u32| ((words[1] << shift) as i32 >> 20) as f32 / 2047.0;
    let (x, y) = (unpack(20), unpack(8));
    let z = 1.0 - x.abs() - y.abs();
    let t = (-z).max(0.0);
    let x = x + if x >= 0.0 { -t } else { t };
    let y = y + if y >= 0.0 { -t } else { t };
    Vec3::new(x, y, z).normalize()
}

/// How large a scene an adapter takes.
#[derive(Clone)]
pub struct Room {
    adapter: String,
    /// Bytes of a buffer, and of a table.
    buffer: u64,
    table: u64,
}

impl Room {
    pub fn of(gpu: &Gpu) -> Room {
        let buffer = gpu.device.limits().max_buffer_size;
        Room { adapter: gpu.info.name.clone(), buffer, table: Table::most(gpu) }
    }

    /// Refuses a scene that is larger, before its triangles are made.
    pub fn check(&self, scene: &Scene) -> Result<()> {
        let (mut vertices, mut triangles) = (0, 0);
        for node in &scene.nodes {
            for mesh in node.meshes.iter().map(|mesh| &scene.meshes[*mesh as usize]) {
                let times = node.instances.len().max(1) as u64;
                vertices += mesh.positions.len() as u64 * times;
                triangles += mesh.indices.len() as u64 / 3 * times;
            }
        }
        let Room { adapter, buffer, table } = self;
        // A BVH never has more nodes than triangles, and they are as large.
        for (bytes, room, what) in [
            (vertices * size_of::<Vertex>() as u64, *buffer.min(table), "vertices"),
            (triangles * 12, *buffer, "triangles' corners"),
            (triangles * size_of::<Corners>() as u64, *table, "triangles for shadow rays"),
        ] {
            ensure!(
                bytes <= room,
                "{} has {vertices} vertices in {triangles} triangles: its {what} take {} MiB, and {adapter} has room for {} MiB of \
                 them; open a scene with fewer",
                scene.name,
                bytes.div_ceil(1 << 20),
                room >> 20
            );
        }
        Ok(())
    }
}

/// A scene's buffers on the GPU.
pub struct SceneGpu {
    /// For the rasteriser; `records` holds the same for shaders that ask for a vertex by number.
    pub vertices: Buffer,
    pub records: Table,
    /// Three corners a triangle, for casters.
    pub indices: Buffer,
    welded: Vec<u32>,
    pub triangles: Table,
    pub materials: Buffer,
    /// The BVH's nodes and triangles.
    pub nodes: Table,
    pub corners: Table,
    /// Small and large ones.
    pub textures: [wgpu::TextureView; 2],
    pub sampler: wgpu::Sampler,
    /// What the adapter had no room for, a sentence.
    pub note: Option<String>,
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
        Room::of(gpu).check(scene)?;
        use wgpu::BufferUsages as Use;
        let storage = Use::STORAGE;
        let welded = welded(scene);
        let indices = geometry.flat_indices(&welded);
        let wrap = |w: Wrap| w as u32;
        let arrays = Arrays::of(&scene.textures, Limits::of(gpu));
        let materials: Vec<GpuMaterial> = scene
            .materials
            .iter()
            .map(|m| {
                let texture = m.texture.map(|t| &scene.textures[t as usize]);
                let texels = m.texture.map_or([1; 2], |t| arrays.kept(&scene.textures, t as usize));
                GpuMaterial {
                    base_color: m.base_color,
                    texture: m.texture.map_or(0, |t| arrays.number(t as usize)),
                    cutoff: m.alpha_cutoff.unwrap_or(-1.0),
                    double_sided: m.double_sided as u32,
                    wrap: texture.map_or(0, |t| wrap(t.wrap[0]) | wrap(t.wrap[1]) << 2),
                    texels: Vec2::from(texels.map(|n| n as f32)),
                    nearest: texture.map_or(0, |t| t.filter.bits()),
                    padding: 0,
                }
            })
            .collect();
        Ok(SceneGpu {
            vertices: gpu.buffer("vertices", bytemuck::cast_slice(&geometry.vertices), Use::VERTEX),
            records: Table::new(gpu, "vertices by number", bytemuck::cast_slice(&geometry.vertices)),
            indices: gpu.buffer("indices", bytemuck::cast_slice(&indices), Use::INDEX | Use::STORAGE),
            welded,
            triangles: Table::new(gpu, "triangles", bytemuck::cast_slice(&geometry.triangles)),
            materials: gpu.buffer("materials", bytemuck::cast_slice(&materials), storage),
            nodes: Table::new(gpu, "BVH nodes", bytemuck::cast_slice(&geometry.bvh.nodes)),
            corners: Table::new(gpu, "BVH triangles", bytemuck::cast_slice(&geometry.bvh_order(scene))),
            note: arrays.reduced(&scene.textures).map(|(count, side)| {
                format!(
                    "{count} of {} textures are scaled down, to {side} texels a side at most.",
                    scene.textures.len()
                )
            }),
            textures: arrays.upload(gpu, scene)?,
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
    pub fn set_casters(&self, pass: &mut wgpu::RenderPass, indices: &Buffer) {
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
        self.records.write(gpu, bytemuck::cast_slice(&geometry.vertices));
        self.triangles.write(gpu, bytemuck::cast_slice(&geometry.triangles));
        self.nodes.write(gpu, bytemuck::cast_slice(&geometry.bvh.nodes));
        self.corners.write(gpu, bytemuck::cast_slice(&geometry.bvh_order(scene)));
        self.bounds = geometry.bounds;
    }
}
