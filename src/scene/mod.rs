//! Scenes as they come from a glTF file or from our own generators.

pub mod builtin;
pub mod bvh;
pub mod camera;
pub mod edges;
pub mod geometry;
pub mod gltf;
pub mod shadow_tree;
mod textures;

use crate::light::Light;
pub use camera::Camera;
use glam::{DMat4, DQuat, DVec3, Mat4, Vec2, Vec3, Vec4};

/// Meshes placed by a node hierarchy. Right-handed, y up, metres.
///
/// Nodes stand in the file's coordinates. All that is made of them stands in *scene space*, which is the same but for
/// [`Scene::origin`]: geometry, cameras and lights, whose 32-bit numbers are fine only near zero.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    pub name: String,
    /// Scene space's zero in the file's coordinates; zero for scenes that no file holds.
    pub origin: DVec3,
    /// Diagonal of the box around a file's scene at the clock's start, metres; 0 of scenes that no file holds.
    pub diagonal: f32,
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
    /// Linear colours that multiply the material's; empty: white.
    pub colors: Vec<Vec4>,
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
    pub filter: Filter,
}

/// Where a texture's texels are taken as they are, not as a mean of neighbours.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Filter {
    /// Where they are larger than pixels, and wherever their alpha decides whether there is a surface.
    pub magnified_nearest: bool,
    /// Where they are smaller.
    pub minified: Minified,
}

/// What a pixel takes of a texture whose texels are smaller.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Minified {
    /// A mean of neighbours, of the smaller images too.
    #[default]
    Mean,
    /// The nearest texel of the image itself.
    Nearest,
    /// The nearest texel of that of the smaller images which suits best.
    NearestLevel,
    /// The nearest texels of the two that suit best, in shares.
    MixedLevels,
}

impl Filter {
    /// As `Material::nearest` of the shaders has it.
    pub fn bits(self) -> u32 {
        let minified = match self.minified {
            Minified::Mean => 0,
            Minified::Nearest => 2,
            Minified::NearestLevel => 2 | 4,
            Minified::MixedLevels => 2 | 8,
        };
        minified | self.magnified_nearest as u32
    }
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

impl Scene {
    /// What stands for a metre where a parameter is a length that was not chosen, as a bias: a metre in scenes from 2 m to 2 km
    /// across, and as much more or less as others are larger or smaller.
    pub fn unit(&self) -> f64 {
        let diagonal = f64::from(self.diagonal);
        match diagonal {
            0.0 => 1.0,
            d if d < 2.0 => d / 2.0,
            d => (d / 2000.0).max(1.0),
        }
    }

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
