//! Scenes as they come from files or from our own generators.

pub mod builtin;
pub mod bvh;
pub mod edges;
pub mod formats;
pub mod geometry;
pub mod gltf;
mod obj;
mod origin;
mod ply;
mod polygons;
mod presets;
pub mod shadow_tree;
mod stl;
mod textures;

use crate::light::Light;
use glam::{DMat4, DQuat, DVec3, Mat4, Vec2, Vec3, Vec4};
use serde::{Deserialize, Serialize};

/// Meshes placed by a node hierarchy. Right-handed, y up, metres.
///
/// Nodes stand in the file's coordinates. All that is made of them stands in *scene space*, which is the same but for
/// [`Scene::origin`]: geometry, cameras and lights, whose 32-bit numbers are fine only near zero.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    pub name: String,
    /// Scene space's zero in the file's coordinates; zero for scenes that no file holds.
    pub origin: DVec3,
    pub meshes: Vec<Mesh>,
    pub nodes: Vec<Node>,
    pub materials: Vec<Material>,
    pub textures: Vec<Texture>,
    pub animations: Vec<Animation>,
    /// In scene space; at least one, after loading.
    pub cameras: Vec<NamedCamera>,
    /// In scene space; at least one, after loading.
    pub lights: Vec<NamedLight>,
    /// What the loader left out or drew differently, a sentence each.
    pub notes: Vec<String>,
}

/// Triangles of one material. `normals` and `uvs` are as long as `positions`; three `indices` a
/// triangle, counter-clockwise seen from the front.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    pub positions: Vec<Vec3>,
    pub normals: Vec<Vec3>,
    /// With any texture transform already applied; (0, 0) is the image's upper left corner.
    pub uvs: Vec<Vec2>,
    pub indices: Vec<u32>,
    /// Index into [`Scene::materials`].
    pub material: u32,
}

/// A place in the hierarchy. Parents come before their children.
#[derive(Clone, Debug)]
pub struct Node {
    pub parent: Option<u32>,
    pub local: Local,
    /// Indices into [`Scene::meshes`].
    pub meshes: Vec<u32>,
    /// Extra transforms, in the node's space, one an instance (EXT_mesh_gpu_instancing); empty: drawn once.
    pub instances: Vec<Mat4>,
}

/// A node's transform relative to its parent, with the digits that the file gives it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Local {
    Matrix(DMat4),
    /// Can be animated.
    Trs {
        translation: DVec3,
        rotation: DQuat,
        scale: DVec3,
    },
}

impl Local {
    /// To the parent's space.
    pub fn matrix(&self) -> DMat4 {
        match *self {
            Local::Matrix(matrix) => matrix,
            Local::Trs { translation, rotation, scale } => {
                DMat4::from_scale_rotation_translation(scale, rotation, translation)
            }
        }
    }
}

/// A surface: base colour and how its alpha is read.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    pub name: String,
    /// Linear RGBA factor.
    pub base_color: Vec4,
    /// Index into [`Scene::textures`]; multiplies `base_color`.
    pub texture: Option<u32>,
    /// `Some(cutoff)`: where alpha (factor × texture) is below the cutoff there is no surface.
    pub alpha_cutoff: Option<f32>,
    /// Seen from both sides; else its back is culled for the camera. It casts from both sides either way.
    pub double_sided: bool,
}

/// An sRGB image, four bytes per texel, rows from the top.
#[derive(Clone, Debug, Default)]
pub struct Texture {
    pub width: u32,
    pub height: u32,
    pub rgba: Vec<u8>,
    pub wrap: [Wrap; 2],
}

/// What lies beyond a texture's edge, per axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wrap {
    #[default]
    Repeat,
    Mirror,
    Clamp,
}

/// Key frames for nodes, times in seconds.
#[derive(Clone, Debug, Default)]
pub struct Animation {
    pub name: String,
    pub channels: Vec<Channel>,
}

/// One animated property of one node.
#[derive(Clone, Debug)]
pub struct Channel {
    /// Index into [`Scene::nodes`]; its `local` is a `Trs`.
    pub node: u32,
    pub property: Property,
    pub interpolation: Interpolation,
    /// Ascending, at least one.
    pub times: Vec<f32>,
    /// One a time (xyz, or xyzw for a rotation); cubic splines: in-tangent, value, out-tangent a time.
    pub values: Vec<Vec4>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Property {
    Translation,
    Rotation,
    Scale,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interpolation {
    Step,
    Linear,
    CubicSpline,
}

/// A pinhole camera in scene space, up = +y. Metres and degrees.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Camera {
    pub position: Vec3,
    /// The point that is looked at; also what the orbit camera turns around.
    pub target: Vec3,
    /// Vertical field of view, degrees.
    pub fov: f32,
    pub near: f32,
    pub far: f32,
}

#[derive(Clone, Debug)]
pub struct NamedCamera {
    pub name: String,
    pub camera: Camera,
}

#[derive(Clone, Debug)]
pub struct NamedLight {
    pub name: String,
    pub light: Light,
}

impl Camera {
    /// Unit vector along which the camera looks.
    pub fn forward(&self) -> Vec3 {
        (self.target - self.position).normalize_or(Vec3::NEG_Z)
    }

    /// Scene to view space (x right, y up, looking along -z).
    pub fn view(&self) -> Mat4 {
        let forward = self.forward();
        let up = if forward.y.abs() > 0.9999 { Vec3::NEG_Z } else { Vec3::Y };
        glam::camera::rh::view::look_to_mat4(self.position, forward, up)
    }

    /// View space to clip space with reversed depth: 1 at `near`, 0 at `far`.
    pub fn projection(&self, aspect: f32) -> Mat4 {
        glam::camera::rh::proj::directx::perspective(self.fov.to_radians(), aspect, self.far, self.near)
    }

    /// The same without a far plane: depth is `near` over that along the camera's axis, and points at infinity (w = 0) have depth 0.
    /// Positions in the picture are the same bit for bit.
    pub fn unbounded_projection(&self, aspect: f32) -> Mat4 {
        let mut projection = self.projection(aspect);
        (projection.z_axis.z, projection.w_axis.z) = (0.0, self.near);
        projection
    }

    /// The rays of a picture of `size` pixels, each 1 long along the camera's axis: how they change from a pixel to the next
    /// on the right and to the next below, and the ray through the upper left corner.
    pub fn rays(&self, size: [u32; 2]) -> [DVec3; 3] {
        let forward = (self.target.as_dvec3() - self.position.as_dvec3()).normalize_or(DVec3::NEG_Z);
        let up = if self.forward().y.abs() > 0.9999 { DVec3::NEG_Z } else { DVec3::Y };
        let right = forward.cross(up).normalize();
        let pixel = 2.0 * ((self.fov as f64).to_radians() / 2.0).tan() / size[1] as f64;
        let (x, y) = (right * pixel, forward.cross(right) * pixel);
        [x, y, forward - x * (size[0] as f64 / 2.0) - y * (size[1] as f64 / 2.0)]
    }
}

impl Scene {
    /// Triangles, instances counted each time they are drawn.
    pub fn triangles(&self) -> usize {
        let drawn = |n: &Node| {
            let meshes = n.meshes.iter().map(|m| self.meshes[*m as usize].indices.len() / 3);
            meshes.sum::<usize>() * n.instances.len().max(1)
        };
        self.nodes.iter().map(drawn).sum()
    }

    /// What was loaded and what was left out, a line each.
    pub fn report(&self) -> String {
        let mut out = format!(
            "{}: {} triangles, {} materials, {} textures, {} nodes, {} animations, {} cameras, {} lights\n",
            self.name,
            self.triangles(),
            self.materials.len(),
            self.textures.len(),
            self.nodes.len(),
            self.animations.len(),
            self.cameras.len(),
            self.lights.len()
        );
        let large = self.textures.iter().filter(|t| t.width.max(t.height) > textures::MAX_SIDE).count();
        if large > 0 {
            out += &format!("  {large} textures are scaled down to {} texels per side.\n", textures::MAX_SIDE);
        }
        for note in &self.notes {
            out += &format!("  {note}\n");
        }
        out
    }
}
