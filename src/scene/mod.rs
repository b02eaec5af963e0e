//! Scenes as they come from files or from our own generators.

pub mod builtin;
pub mod bvh;
pub mod camera;
pub mod edges;
pub mod formats;
pub mod geometry;
pub mod gltf;
mod obj;
mod origin;
mod ply;
mod polygons;
pub mod pose;
mod presets;
pub mod shadow_tree;
mod stl;
mod textures;

use crate::light::Light;
use anyhow::{Context, Result};
pub use camera::Camera;
use glam::{DMat4, DQuat, DVec3, Mat4, Vec2, Vec3, Vec4};
use pose::world_matrix;

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
    pub skins: Vec<Skin>,
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
/// triangle, counter-clockwise seen from the front. All as it is before morph targets and a skin move it: the bind pose.
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
    /// Each three vertices are a triangle, whose normal is theirs in every pose.
    pub flat: bool,
    /// Morph targets, whose weights the node has: of each the vertices that it moves.
    pub targets: Vec<Vec<Offset>>,
    /// Which joints move the vertices where the node has a skin.
    pub skinning: Option<Skinning>,
}

/// What a morph target of weight 1 adds to a vertex.
#[derive(Clone, Copy, Debug)]
pub struct Offset {
    pub vertex: u32,
    pub position: Vec3,
    pub normal: Vec3,
}

/// Of each vertex the joints, as indices into [`Skin::joints`], with their weights; at least one.
#[derive(Clone, Debug, Default)]
pub struct Skinning {
    /// Where each vertex's joints end in `joints`.
    pub ends: Vec<u32>,
    pub joints: Vec<(u32, f32)>,
}

impl Skinning {
    /// A vertex's joints and weights, whose sum may be any but zero.
    pub fn of(&self, vertex: usize) -> &[(u32, f32)] {
        let start = vertex.checked_sub(1).map_or(0, |before| self.ends[before]);
        &self.joints[start as usize..self.ends[vertex] as usize]
    }
}

impl Mesh {
    /// Whether vertices can move against each other.
    pub fn deforms(&self) -> bool {
        self.skinning.is_some() || self.targets.iter().any(|target| !target.is_empty())
    }
}

/// Nodes that move the vertices of meshes.
#[derive(Clone, Debug, Default)]
pub struct Skin {
    /// Indices into [`Scene::nodes`].
    pub joints: Vec<u32>,
    /// Of each joint the matrix from the bind pose to its own space.
    pub inverse_bind: Vec<Mat4>,
}

/// A place in the hierarchy. Parents come before their children.
#[derive(Clone, Debug, Default)]
pub struct Node {
    pub parent: Option<u32>,
    pub local: Local,
    /// Indices into [`Scene::meshes`].
    pub meshes: Vec<u32>,
    /// Extra transforms, in the node's space, one an instance (EXT_mesh_gpu_instancing); empty: drawn once.
    pub instances: Vec<Mat4>,
    /// Of the meshes' morph targets, where no animation gives them.
    pub weights: Vec<f32>,
    /// Index into [`Scene::skins`]: its joints place the meshes then, not the node.
    pub skin: Option<u32>,
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

impl Default for Local {
    fn default() -> Self {
        Local::Trs { translation: DVec3::ZERO, rotation: DQuat::IDENTITY, scale: DVec3::ONE }
    }
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
    /// Index into [`Scene::nodes`]; its `local` is a `Trs`, unless a weight is animated.
    pub node: u32,
    pub property: Property,
    pub interpolation: Interpolation,
    /// Ascending, at least one.
    pub times: Vec<f32>,
    /// One a time (xyz, xyzw for a rotation, x for a weight); cubic splines: in-tangent, value, out-tangent a time.
    pub values: Vec<Vec4>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Property {
    Translation,
    Rotation,
    Scale,
    /// Of one of the morph targets of the node's meshes.
    Weight(u32),
}

/// A moment of a scene's animation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Clock {
    /// Index into [`Scene::animations`].
    pub animation: u32,
    /// Seconds.
    pub time: f32,
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
    /// As it stands at the clock's start.
    pub camera: Camera,
    /// The node that an animation moves it by; index into [`Scene::nodes`].
    pub node: Option<u32>,
}

#[derive(Clone, Debug)]
pub struct NamedLight {
    pub name: String,
    /// As it stands at the clock's start.
    pub light: Light,
    /// As a camera's.
    pub node: Option<u32>,
}

/// The place nearest to one in scene space that 64 bits hold in the scene's own coordinates, as [`crate::setup::place`] has
/// them: a moving preset is known by its place, which must not change on its way through a file.
pub fn settled(place: Vec3, origin: DVec3) -> Vec3 {
    (origin + place.as_dvec3() - origin).as_vec3()
}

impl NamedCamera {
    /// As it stands at a moment.
    pub fn at(&self, scene: &Scene, clock: Clock) -> Camera {
        match self.node {
            Some(node) if clock != Clock::default() => {
                self.camera.placed(world_matrix(scene, node, clock).as_mat4()).settled(scene.origin)
            }
            _ => self.camera,
        }
    }
}

impl NamedLight {
    /// As it stands at a moment.
    pub fn at(&self, scene: &Scene, clock: Clock) -> Light {
        match self.node {
            Some(node) if clock != Clock::default() => {
                self.light.placed(world_matrix(scene, node, clock).as_mat4()).settled(scene.origin)
            }
            _ => self.light,
        }
    }
}

impl Scene {
    /// How long an animation takes, seconds; 0 where there is none.
    pub fn duration(&self, animation: u32) -> f32 {
        let Some(animation) = self.animations.get(animation as usize) else { return 0.0 };
        animation.channels.iter().filter_map(|c| c.times.last()).fold(0.0, |a, t| a.max(*t))
    }

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

    /// The index of an animation, of which a name or that index is given.
    ///
    /// # Errors
    /// No such animation.
    pub fn animation(&self, name: &str) -> Result<u32> {
        let number = || name.parse().ok().filter(|i| *i < self.animations.len());
        let found = self.animations.iter().position(|a| a.name == name).or_else(number);
        found.map(|i| i as u32).with_context(|| {
            let names: Vec<&str> = self.animations.iter().map(|a| a.name.as_str()).collect();
            let there =
                if names.is_empty() { "there are none".into() } else { format!("there are {}", names.join(", ")) };
            format!("{} has no animation {name}; {there}", self.name)
        })
    }

    /// A camera at a moment that it had at another: one of the scene's that an animation moves follows the clock, any other stays.
    pub fn follow_camera(&self, camera: Camera, [from, to]: [Clock; 2]) -> Camera {
        let moving = self.cameras.iter().find(|c| c.node.is_some() && c.at(self, from) == camera);
        moving.map_or(camera, |c| c.at(self, to))
    }

    /// The same for a light.
    pub fn follow_light(&self, light: Light, [from, to]: [Clock; 2]) -> Light {
        let moving = self.lights.iter().find(|l| l.node.is_some() && l.at(self, from) == light);
        moving.map_or(light, |l| l.at(self, to))
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
        for note in &self.notes {
            out += &format!("  {note}\n");
        }
        out
    }
}
