//! What the tests share: one device, and scenes made by hand.
#![allow(dead_code)]

use glam::{Mat4, Vec2, Vec3};
use shadowscope::frame::{Ask, Renderer, Truth};
use shadowscope::gpu::Gpu;
use shadowscope::light::Light;
use shadowscope::scene::{Camera, Local, Material, Mesh, NamedCamera, NamedLight, Node, Scene};
use shadowscope::setup::Setup;
use std::sync::{Arc, OnceLock};

/// The device that all tests of a file use.
pub fn gpu() -> Arc<Gpu> {
    static GPU: OnceLock<Arc<Gpu>> = OnceLock::new();
    GPU.get_or_init(|| Arc::new(Gpu::new(None).expect("these tests need a Vulkan driver; run ./setup.sh"))).clone()
}

pub fn material(color: Vec3) -> Material {
    Material {
        name: "plain".into(),
        base_color: color.extend(1.0),
        texture: None,
        alpha_cutoff: None,
        double_sided: true,
    }
}

/// Triangles of one material, flat shaded.
pub fn mesh(triangles: &[[Vec3; 3]], material: u32) -> Mesh {
    let mut m = Mesh { material, ..Mesh::default() };
    for t in triangles {
        let normal = (t[1] - t[0]).cross(t[2] - t[0]).normalize_or(Vec3::Y);
        for p in t {
            m.indices.push(m.positions.len() as u32);
            m.positions.push(*p);
            m.normals.push(normal);
            m.uvs.push(Vec2::ZERO);
        }
    }
    m
}

/// A rectangle in the plane y = `height`, seen from above, as two triangles.
pub fn floor(low: Vec2, high: Vec2, height: f32) -> Vec<[Vec3; 3]> {
    let p = |x: f32, z: f32| Vec3::new(x, height, z);
    let [a, b, c, d] = [p(low.x, low.y), p(low.x, high.y), p(high.x, high.y), p(high.x, low.y)];
    vec![[a, b, c], [a, c, d]]
}

pub fn scene(meshes: Vec<Mesh>, materials: Vec<Material>, camera: Camera, light: Light) -> Scene {
    let nodes = vec![Node {
        parent: None,
        local: Local::Matrix(Mat4::IDENTITY),
        meshes: (0..meshes.len() as u32).collect(),
        instances: vec![],
    }];
    Scene {
        name: "test".into(),
        meshes,
        nodes,
        materials,
        cameras: vec![NamedCamera { name: "camera".into(), camera }],
        lights: vec![NamedLight { name: "light".into(), light }],
        ..Scene::default()
    }
}

pub fn sun(to_light: Vec3) -> Light {
    Light::Directional { to_light, color: Vec3::ONE }
}

pub fn camera(position: Vec3, target: Vec3) -> Camera {
    Camera { position, target, fov: 50.0, near: 0.1, far: 200.0 }
}

/// A renderer of the scene and the set-up that it starts with, at a size.
pub fn start(scene: Scene, size: [u32; 2]) -> (Renderer, Setup) {
    let mut setup = Setup::new("test", &scene).expect("a set-up");
    setup.size = size;
    (Renderer::new(gpu(), Arc::new(scene)).expect("a renderer"), setup)
}

pub fn ask(setup: &Setup) -> Ask {
    Ask { size: setup.size, truth: Truth::All, analysis: false, timed: false, picture: true, fresh: false }
}

/// PCG (O'Neill 2014).
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> f32 {
        let old = self.0;
        self.0 = old.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        let x = ((old >> 18 ^ old) >> 27) as u32;
        x.rotate_right((old >> 59) as u32) as f32 / 4294967296.0
    }
    /// In [-1, 1]³.
    pub fn point(&mut self) -> Vec3 {
        Vec3::new(self.next(), self.next(), self.next()) * 2.0 - 1.0
    }
}
