//! What the tests share: devices, and scenes made by hand.

use glam::{DMat4, Vec2, Vec3};
use shadowscope::frame::{Ask, Renderer, Truth};
use shadowscope::gpu::Gpu;
use shadowscope::light::Light;
use shadowscope::measure;
use shadowscope::measure::metrics::{Errors, FACING};
use shadowscope::scene::{Camera, Local, Material, Mesh, NamedCamera, NamedLight, Node, Scene};
use shadowscope::setup::Setup;
use shadowscope::techniques::Info;
use std::path::Path;
use std::process::{Command, Output};
use std::sync::{Arc, Mutex};

/// Runs the program in a folder, without a display; it times as few frames as it may.
pub fn shadowscope(folder: &Path, args: &[&str]) -> Output {
    within(folder, args, "0")
}

/// As [`shadowscope`], where each configuration is timed so many seconds on an adapter that is a program.
pub fn within(folder: &Path, args: &[&str], seconds: &str) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_shadowscope"));
    command
        .args(args)
        .current_dir(folder)
        .env_remove("DISPLAY")
        .env_remove("WAYLAND_DISPLAY")
        .env("RUST_BACKTRACE", "0")
        .env("SHADOWSCOPE_TIMING", seconds);
    command.output().expect("the program runs")
}

/// As [`shadowscope`], where it must succeed.
pub fn ok(folder: &Path, args: &[&str]) -> Output {
    let out = shadowscope(folder, args);
    let said = String::from_utf8_lossy(&out.stderr);
    assert!(out.status.success(), "{args:?}: {said}");
    assert!(!said.contains("the graphics device reports"), "{args:?}: {said}");
    out
}

/// A device that no other test uses at the same time, and that later ones use again: a driver that is a program works off all
/// that one device is given in one thread, where tests would wait for each other.
pub fn gpu() -> Arc<Gpu> {
    static IDLE: Mutex<Vec<Arc<Gpu>>> = Mutex::new(Vec::new());
    struct Lease(Arc<Gpu>);
    impl Drop for Lease {
        fn drop(&mut self) {
            IDLE.lock().unwrap().push(self.0.clone());
        }
    }
    // A test has a thread of its own, and the device is free when that ends.
    thread_local! {
        static LEASE: Lease = {
            let idle = IDLE.lock().unwrap().pop();
            let new = || strict(Gpu::new(None).expect("these tests need a Vulkan driver; run ./setup.sh"));
            Lease(idle.unwrap_or_else(|| Arc::new(new())))
        };
    }
    LEASE.with(|lease| lease.0.clone())
}

/// A device whose errors fail the test that makes them, where they are made, whether anybody asks for them or not.
pub fn strict(gpu: Gpu) -> Gpu {
    gpu.device.on_uncaptured_error(Arc::new(|error: wgpu::Error| panic!("the graphics device reports: {error}")));
    gpu
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
        local: Local::Matrix(DMat4::IDENTITY),
        meshes: (0..meshes.len() as u32).collect(),
        ..Node::default()
    }];
    Scene {
        name: "test".into(),
        meshes,
        nodes,
        materials,
        cameras: vec![NamedCamera { name: "camera".into(), camera, node: None }],
        lights: vec![NamedLight { name: "light".into(), light, node: None }],
        ..Scene::default()
    }
}

pub fn sun(to_light: Vec3) -> Light {
    Light::Directional { to_light, angular_radius: 0.0, color: Vec3::ONE }
}

/// A spot that shines from `position` at `target`, its cone's edge `angle` degrees from the axis.
pub fn spot(position: Vec3, target: Vec3, angle: f32) -> Light {
    Light::Spot {
        position,
        direction: target - position,
        outer_angle: angle,
        range: 80.0,
        radius: 0.0,
        color: Vec3::splat(90.0),
    }
}

/// A lamp that shines in all directions.
pub fn lamp(position: Vec3) -> Light {
    Light::Omni { position, range: 60.0, radius: 0.0, color: Vec3::splat(20.0) }
}

/// A square of `half` a side to each of its middle that shines from `position` at `target`.
pub fn plate(position: Vec3, target: Vec3, half: f32) -> Light {
    let half_u = (target - position).normalize().any_orthonormal_vector() * half;
    let half_v = (target - position).normalize().cross(half_u);
    Light::RectArea { center: position, half_u, half_v, range: 60.0, color: Vec3::splat(20.0) }
}

/// Pixels of the last frame that face a spot and lie in its cone: those that surely do, and with those on its very edge.
pub fn in_cone(r: &mut Renderer, light: &Light) -> [u64; 2] {
    let Light::Spot { position, outer_angle, range, .. } = *light else { panic!("not a spot") };
    let (mask, at) = (r.read_mask().unwrap(), r.read_position().unwrap());
    let mut found = [0; 2];
    for p in mask.iter().zip(&at).filter(|(m, _)| **m == FACING).map(|(_, p)| Vec3::new(p[0], p[1], p[2])) {
        let ray = p - position;
        let spare = light.axis().dot(ray.normalize()) - outer_angle.to_radians().cos();
        let spare = spare.min((range - ray.length()) / range);
        found[0] += (spare > 1e-5) as u64;
        found[1] += (spare > -1e-5) as u64;
    }
    found
}

/// Cameras and spots that stand awkwardly to one another, over what lies around the origin.
pub fn awkward_spots() -> Vec<(&'static str, Camera, Light)> {
    let p = |x: f32, y: f32, z: f32| Vec3::new(x, y, z);
    let view = camera(p(0.0, 2.0, 9.0), p(0.0, 0.5, 0.0));
    vec![
        ("in view", view, spot(p(0.5, 3.0, 2.0), p(0.0, 0.0, 0.0), 50.0)),
        ("in view, wide", view, spot(p(0.5, 3.0, 2.0), p(0.0, 0.0, 1.0), 85.0)),
        ("towards the camera", view, spot(p(0.0, 3.0, -6.0), view.position - Vec3::Y, 40.0)),
        ("beside the camera", view, spot(view.position + p(1.5, 1.0, 0.0), p(0.0, 0.0, 0.0), 30.0)),
        ("in the camera", view, spot(view.position, view.target, 35.0)),
        ("level with the camera", view, spot(view.position + p(3.0, 0.0, 0.0), view.target + p(3.0, 0.0, 0.0), 40.0)),
        ("behind the camera", view, spot(p(0.0, 5.0, 16.0), p(0.0, 0.0, 0.0), 30.0)),
        (
            "away from the camera",
            camera(p(0.0, 6.0, 14.0), p(0.0, 0.0, 0.0)),
            spot(p(0.0, 3.0, 5.0), p(0.0, 0.0, -4.0), 45.0),
        ),
        ("along the axis", camera(p(0.0, 8.0, 0.0), Vec3::ZERO), spot(p(0.0, 8.0, 0.0), Vec3::ZERO, 40.0)),
        (
            "against the axis",
            camera(p(0.0, 1.0, 5.0), p(0.0, 0.8, -2.0)),
            spot(p(0.0, 4.0, -4.0), p(0.0, 0.0, 4.0), 60.0),
        ),
        ("near the floor", view, spot(p(-5.0, 0.8, 0.0), p(0.0, 0.3, 0.0), 40.0)),
    ]
}

/// A floor with two boxes and a pole, for spots.
pub fn yard() -> Vec<[Vec3; 3]> {
    let mut triangles = floor(Vec2::splat(-12.0), Vec2::splat(12.0), 0.0);
    for (low, high) in [
        (Vec3::new(-2.0, 0.0, -1.0), Vec3::new(-0.6, 1.2, 0.4)),
        (Vec3::new(0.8, 0.6, -3.0), Vec3::new(1.6, 1.8, -1.5)),
        (Vec3::new(2.9, 0.0, 3.0), Vec3::new(3.1, 2.5, 3.2)),
    ] {
        let p = |i: usize| Vec3::from_array([0, 1, 2].map(|a| if i >> a & 1 == 1 { high[a] } else { low[a] }));
        let faces = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        triangles.extend(faces.iter().flat_map(|f| [[p(f[0]), p(f[1]), p(f[2])], [p(f[0]), p(f[2]), p(f[3])]]));
    }
    triangles
}

pub fn camera(position: Vec3, target: Vec3) -> Camera {
    Camera::new(position, target, 50.0, 0.1, 200.0)
}

/// A renderer of the scene and the set-up that it starts with, at a size.
pub fn start(scene: Scene, size: [u32; 2]) -> (Renderer, Setup) {
    let mut setup = Setup::new("test", &scene).expect("a set-up");
    setup.size = size;
    (Renderer::new(gpu(), Arc::new(scene)).expect("a renderer"), setup)
}

/// A built-in scene as it opens, at a size.
pub fn built_in(name: &str, size: [u32; 2]) -> (Renderer, Setup) {
    let (mut setup, scene) = Setup::open(name).unwrap();
    setup.size = size;
    (Renderer::new(gpu(), Arc::new(scene)).unwrap(), setup)
}

/// Chooses a technique with these parameters and defaults for the rest.
pub fn select(s: &mut Setup, technique: &str, sets: &[&str]) {
    s.params.clear();
    s.select(technique).unwrap();
    for set in sets {
        s.set(set, &[technique.into()]).unwrap();
    }
}

/// Chooses a technique with these parameters, a small map, and few bounce lights.
pub fn choose(s: &mut Setup, info: &'static Info, resolution: u32, sets: &[String]) {
    let small = [format!("resolution={resolution}"), "vpls=32".into(), "points=1024".into()];
    let has = |set: &&String| info.specs().any(|spec| set.split('=').next() == Some(spec.name));
    select(s, info.id, &small.iter().filter(has).chain(sets).map(String::as_str).collect::<Vec<_>>());
}

/// Errors of a technique with these parameters.
pub fn errors(r: &mut Renderer, s: &mut Setup, technique: &str, sets: &[&str]) -> Errors {
    select(s, technique, sets);
    measure::errors(r, s).unwrap()
}

/// View samples counted in the maps' texels, all together.
pub fn counted(r: &mut Renderer, s: &Setup) -> u64 {
    r.render(s, Ask { analysis: true, truth: Truth::Off, ..ask(s) }).unwrap();
    let mut sum = 0;
    r.analysis().counts(&r.gpu, |_, part| sum += part.iter().map(|c| *c as u64).sum::<u64>()).unwrap();
    sum
}

/// Pixels of the last frame that face the light and are reached by it.
pub fn facing(r: &mut Renderer) -> u64 {
    r.read_mask().unwrap().iter().filter(|m| **m == FACING).count() as u64
}

pub fn ask(setup: &Setup) -> Ask {
    Ask::of(setup)
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

/// Watches progress: a share of the work, which never falls.
pub fn rising() -> impl FnMut(f32) -> bool {
    let mut last = 0.0;
    move |share| {
        assert!((last..=1.0).contains(&share), "{share} after {last}");
        last = share;
        true
    }
}
