//! Puts generated scenes together out of boxes, lathes, tubes and the like.
//!
//! Shapes are given in local space, placed by a stack of transforms, and collected in world space,
//! one mesh a material. Texture coordinates are metres times [`Builder::uv_scale`] unless said otherwise.

pub(crate) mod random;
mod shapes;

pub use random::{Rng, fbm, noise};

use crate::light::Light;
use crate::scene::{Camera, Local, Material, Mesh, NamedCamera, NamedLight, Node, Scene, Texture, Wrap};
use glam::{DMat4, Mat4, Quat, Vec2, Vec3, Vec4, vec2};
use rayon::prelude::*;

/// How a shape's normals come about.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shading {
    /// Each triangle has its own.
    Flat,
    /// Averaged over the triangles that meet at a point, except across edges sharper than this, degrees.
    Smooth(f32),
}

/// Smooth but for edges above 40 degrees: right for most turned and bent things.
pub const CREASED: Shading = Shading::Smooth(40.0);

/// Triangles in local space, before they are placed. Counter-clockwise seen from outside.
#[derive(Clone, Debug, Default)]
pub struct Patch {
    pub positions: Vec<Vec3>,
    pub uvs: Vec<Vec2>,
    pub indices: Vec<u32>,
}

impl Patch {
    /// Adds a vertex and returns its index.
    pub fn vertex(&mut self, position: Vec3, uv: Vec2) -> u32 {
        self.positions.push(position);
        self.uvs.push(uv);
        self.positions.len() as u32 - 1
    }

    /// Adds a convex polygon of existing vertices as a fan, leaving out triangles without area.
    pub fn face(&mut self, corners: &[u32]) {
        for i in 1..corners.len() - 1 {
            let [a, b, c] = [corners[0], corners[i], corners[i + 1]];
            let [p, q, r] = [a, b, c].map(|k| self.positions[k as usize]);
            if p != q && q != r && r != p {
                self.indices.extend([a, b, c]);
            }
        }
    }

    /// Adds a `columns` × `rows` lattice of points and the cells between them. Outside is where
    /// (step in column) × (step in row) points.
    pub fn lattice(&mut self, columns: usize, rows: usize, mut point: impl FnMut(usize, usize) -> (Vec3, Vec2)) {
        let first = self.positions.len() as u32;
        for j in 0..rows {
            for i in 0..columns {
                let (position, uv) = point(i, j);
                self.vertex(position, uv);
            }
        }
        for j in 0..rows as u32 - 1 {
            for i in 0..columns as u32 - 1 {
                let a = first + j * columns as u32 + i;
                let d = a + columns as u32;
                self.face(&[a, a + 1, d + 1, d]);
            }
        }
    }
}

/// Collects a scene's triangles.
pub struct Builder {
    scene: Scene,
    transform: Mat4,
    /// Texture repeats a metre for the shapes that follow.
    pub uv_scale: f32,
    /// Added to all texture coordinates of the shapes that follow.
    pub uv_offset: Vec2,
}

impl Builder {
    pub fn new(name: &str) -> Self {
        let scene = Scene { name: name.into(), ..Scene::default() };
        Self { scene, transform: Mat4::IDENTITY, uv_scale: 1.0, uv_offset: Vec2::ZERO }
    }

    /// Adds a plain material; `srgb` is 0xRRGGBB.
    pub fn material(&mut self, name: &str, srgb: u32) -> u32 {
        self.scene.materials.push(Material {
            name: name.into(),
            base_color: linear(srgb),
            texture: None,
            alpha_cutoff: None,
            double_sided: false,
        });
        self.scene.meshes.push(Mesh { material: self.scene.materials.len() as u32 - 1, ..Mesh::default() });
        self.scene.materials.len() as u32 - 1
    }

    /// Adds a material seen from both sides.
    pub fn double_sided(&mut self, name: &str, srgb: u32) -> u32 {
        let material = self.material(name, srgb);
        self.scene.materials[material as usize].double_sided = true;
        material
    }

    /// Adds a material whose colour is a texture times `srgb`.
    pub fn textured(&mut self, name: &str, srgb: u32, texture: u32) -> u32 {
        let material = self.material(name, srgb);
        self.scene.materials[material as usize].texture = Some(texture);
        material
    }

    /// Adds a double-sided textured material without surface where the texture's alpha is below a half.
    pub fn cutout(&mut self, name: &str, srgb: u32, texture: u32) -> u32 {
        let material = self.textured(name, srgb, texture);
        let added = &mut self.scene.materials[material as usize];
        added.alpha_cutoff = Some(0.5);
        added.double_sided = true;
        material
    }

    /// Adds a repeating texture; `texel` gives sRGB colour and alpha, 0 to 1, for a column and row.
    pub fn texture(&mut self, width: u32, height: u32, texel: impl Fn(u32, u32) -> [f32; 4] + Sync) -> u32 {
        let texel = &texel;
        let bytes = |y| (0..width).flat_map(move |x| texel(x, y).map(|c| (c.clamp(0.0, 1.0) * 255.0).round() as u8));
        let rgba = (0..height).into_par_iter().flat_map_iter(bytes).collect();
        self.scene.textures.push(Texture { width, height, rgba, wrap: [Wrap::Repeat; 2], ..Texture::default() });
        self.scene.textures.len() as u32 - 1
    }

    /// Runs `draw` with `local` applied before the transforms already in force.
    /// Mirroring keeps outsides outside.
    pub fn with(&mut self, local: Mat4, draw: impl FnOnce(&mut Self)) {
        let outer = self.transform;
        self.transform = outer * local;
        draw(self);
        self.transform = outer;
    }

    /// [`Self::with`] a translation.
    pub fn at(&mut self, offset: Vec3, draw: impl FnOnce(&mut Self)) {
        self.with(Mat4::from_translation(offset), draw);
    }

    /// [`Self::with`] a translation after a turn about y, in radians (from +x towards -z).
    pub fn turned(&mut self, offset: Vec3, angle: f32, draw: impl FnOnce(&mut Self)) {
        self.with(Mat4::from_rotation_translation(Quat::from_rotation_y(angle), offset), draw);
    }

    /// Places a patch.
    pub fn add(&mut self, material: u32, patch: &Patch, shading: Shading) {
        let positions: Vec<Vec3> = patch.positions.iter().map(|&p| self.transform.transform_point3(p)).collect();
        let flip = self.transform.determinant() < 0.0;
        let triangles: Vec<[u32; 3]> =
            patch.indices.chunks_exact(3).map(|t| if flip { [t[0], t[2], t[1]] } else { [t[0], t[1], t[2]] }).collect();
        let areas: Vec<Vec3> = triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|k| positions[k as usize]);
                (b - a).cross(c - a)
            })
            .collect();
        let normals = corner_normals(&positions, &triangles, &areas, shading);
        // A vertex is shared by the corners that agree on its normal.
        let mesh = &mut self.scene.meshes[material as usize];
        let start = mesh.positions.len();
        // Of each position the last vertex made of it, and of each vertex the one before.
        let mut last: Vec<Option<u32>> = vec![None; positions.len()];
        let mut before: Vec<Option<u32>> = Vec::with_capacity(positions.len());
        for (triangle, normals) in triangles.iter().zip(&normals) {
            for (&k, &normal) in triangle.iter().zip(normals) {
                let known = std::iter::successors(last[k as usize], |&i| before[i as usize - start]);
                let index = { known }.find(|&i| mesh.normals[i as usize] == normal).unwrap_or_else(|| {
                    mesh.positions.push(positions[k as usize]);
                    mesh.normals.push(normal);
                    mesh.uvs.push(patch.uvs[k as usize] + self.uv_offset);
                    let made = mesh.positions.len() as u32 - 1;
                    before.push(last[k as usize].replace(made));
                    made
                });
                mesh.indices.push(index);
            }
        }
    }

    /// The scene: what was drawn, at one node, seen and lit as given.
    pub fn finish(self, cameras: Vec<NamedCamera>, lights: Vec<NamedLight>) -> Scene {
        let mut scene = self.scene;
        scene.meshes.retain(|mesh| !mesh.indices.is_empty());
        scene.nodes = vec![Node {
            parent: None,
            local: Local::Matrix(DMat4::IDENTITY),
            meshes: (0..scene.meshes.len() as u32).collect(),
            ..Node::default()
        }];
        scene.cameras = cameras;
        scene.lights = lights;
        scene
    }
}

/// A camera with a name; metres and degrees.
pub fn camera(name: &str, position: Vec3, target: Vec3, fov: f32, near: f32, far: f32) -> NamedCamera {
    NamedCamera { name: name.into(), camera: Camera::new(position, target, fov, near, far), node: None }
}

/// A light with a name.
pub fn light(name: &str, light: Light) -> NamedLight {
    NamedLight { name: name.into(), light, node: None }
}

/// Points from a flat list of coordinate pairs.
pub fn pairs(list: &[f32]) -> Vec<Vec2> {
    list.chunks_exact(2).map(|p| vec2(p[0], p[1])).collect()
}

/// A linear colour, alpha one, from 0xRRGGBB.
pub fn linear(srgb: u32) -> Vec4 {
    let channel = |shift: u32| {
        let c = ((srgb >> shift) & 255) as f32 / 255.0;
        if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
    };
    Vec4::new(channel(16), channel(8), channel(0), 1.0)
}

/// The normal at each triangle's corners. `areas` are the triangles' cross products.
fn corner_normals(positions: &[Vec3], triangles: &[[u32; 3]], areas: &[Vec3], shading: Shading) -> Vec<[Vec3; 3]> {
    let unit: Vec<Vec3> = areas.iter().map(|n| n.normalize_or(Vec3::Y)).collect();
    let Shading::Smooth(crease) = shading else {
        return unit.iter().map(|&n| [n; 3]).collect();
    };
    let limit = crease.to_radians().cos() - 1e-4;
    // Corners ordered by where they are: those at one point lie together.
    let mut corners: Vec<([u32; 3], u32, usize)> = Vec::with_capacity(triangles.len() * 3);
    for (t, triangle) in triangles.iter().enumerate() {
        for (c, &k) in triangle.iter().enumerate() {
            let key = (positions[k as usize] + 0.0).to_array().map(f32::to_bits);
            corners.push((key, t as u32, c));
        }
    }
    corners.sort_unstable();
    let mut normals = vec![[Vec3::Y; 3]; triangles.len()];
    for group in corners.chunk_by(|a, b| a.0 == b.0) {
        for &(_, t, c) in group {
            let own = unit[t as usize];
            let sum: Vec3 = group
                .iter()
                .filter(|(_, other, _)| own.dot(unit[*other as usize]) >= limit)
                .map(|(_, other, _)| areas[*other as usize])
                .sum();
            normals[t as usize][c] = sum.normalize_or(own);
        }
    }
    normals
}
