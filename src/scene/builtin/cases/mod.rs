//! The stability cases: small scenes with a path on which some techniques fail. A file a case.

mod behind;
mod contact;
mod corner;
mod degenerate;
mod depthrange;
mod diagonal;
mod duel;
mod fence;
mod foliage;
mod grazing;
mod jitter;
mod lightinview;
mod longtri;
mod offscreen;
mod seam;
mod single_plane;
mod wide;
mod wire;

use super::builder::{Builder, Shading, camera};
use crate::light::Light;
use crate::scene::{Camera, NamedCamera, Scene};
use crate::setup::Setup;
use glam::{Mat4, Quat, Vec3, vec2, vec3};

/// A scene with a path on which some techniques fail.
pub struct Case {
    /// Also the name of its scene.
    pub id: &'static str,
    /// What it is about: `Contact: peter-panning`.
    pub title: &'static str,
    /// What it provokes and in which techniques, a sentence.
    pub doc: &'static str,
    /// The artefacts of its wrong pixels, by the ids of [`crate::measure::diagnosis::ARTEFACTS`].
    pub provokes: &'static [&'static str],
    /// What runs along the path, with its unit: `sun elevation, °`.
    pub axis: &'static str,
    /// The value of `axis` at t, 0 to 1.
    pub value: fn(f32) -> f32,
    /// Moves a set-up of the case's scene to t.
    pub place: fn(&mut Setup, f32),
    /// The t at which a picture tells most of what it is about.
    pub telling: f32,
    /// Frames that the path has by default.
    pub frames: usize,
    /// Makes the scene, which starts as it is placed at 0.
    pub build: fn() -> Scene,
}

/// All of them, in the order of the lists.
pub static CASES: &[Case] = &[
    grazing::CASE,
    duel::CASE,
    lightinview::CASE,
    behind::CASE,
    longtri::CASE,
    foliage::CASE,
    fence::CASE,
    depthrange::CASE,
    jitter::CASE,
    contact::CASE,
    wire::CASE,
    diagonal::CASE,
    offscreen::CASE,
    wide::CASE,
    seam::CASE,
    degenerate::CASE,
    corner::CASE,
    single_plane::CASE,
];

/// A case by id.
pub fn find(id: &str) -> Option<&'static Case> {
    CASES.iter().find(|c| c.id == id)
}

/// Frames of a path, unless a case needs more.
const FRAMES: usize = 32;

/// Unit vector in a direction of the compass: azimuth clockwise from -z as seen from above, elevation above the
/// horizon, degrees.
fn direction(azimuth: f32, elevation: f32) -> Vec3 {
    let (a, e) = (azimuth.to_radians(), elevation.to_radians());
    vec3(a.sin() * e.cos(), e.sin(), -a.cos() * e.cos())
}

/// The sun seen in a direction, degrees as in [`direction`].
fn sun(azimuth: f32, elevation: f32) -> Light {
    Light::Directional { to_light: direction(azimuth, elevation), angular_radius: 0.0, color: vec3(1.0, 0.96, 0.88) }
}

/// A case's only camera, as it stands at 0.
fn eye(camera: Camera) -> Vec<NamedCamera> {
    vec![NamedCamera { name: "default".into(), camera, node: None }]
}

/// A camera for [`eye`]; metres and degrees.
fn look(position: Vec3, target: Vec3, fov: f32, near: f32, far: f32) -> Camera {
    camera("", position, target, fov, near, far).camera
}

/// Paving whose slabs show how far away it is: half a metre each, for a `uv_scale` of 1.
fn paving(b: &mut Builder) -> u32 {
    let slabs = b.texture(128, 128, |x, y| {
        let joint = x % 64 < 2 || y % 64 < 2;
        let dark = (x / 64 + y / 64) % 2 == 1;
        let c = match (joint, dark) {
            (true, _) => 0.74,
            (_, true) => 0.83,
            _ => 0.88,
        };
        [c, c * 0.985, c * 0.945, 1.0]
    });
    b.textured("paving", 0xe8e2d4, slabs)
}

/// A level rectangle from (x0, z0) to (x1, z1) at a height: two triangles that face up.
fn floor(b: &mut Builder, material: u32, [x0, z0]: [f32; 2], [x1, z1]: [f32; 2], height: f32) {
    let p = |x: f32, z: f32| vec3(x, height, z);
    b.polygon(material, &[p(x0, z1), p(x1, z1), p(x1, z0), p(x0, z0)]);
}

/// A picket fence along x from 0 to `length`: posts, two rails, and pickets `pitch` apart.
fn fence(b: &mut Builder, wood: u32, length: f32, height: f32, pitch: f32) {
    for k in 0..=(length / 2.0).round() as usize {
        let x = (k as f32 * 2.0).min(length);
        b.block(wood, vec3(x - 0.05, 0.0, -0.11), vec3(x + 0.05, height * 1.05, -0.01));
    }
    for y in [0.3 * height, 0.8 * height] {
        b.cuboid(wood, vec3(0.0, y, -0.01), vec3(length, y + 0.08, 0.02));
    }
    let pickets = (length / pitch) as usize;
    for k in 0..pickets {
        let x = (k as f32 + 0.5) * pitch;
        let outline = [
            vec2(x - 0.22 * pitch, 0.08 * height),
            vec2(x + 0.22 * pitch, 0.08 * height),
            vec2(x + 0.22 * pitch, 0.93 * height),
            vec2(x, height),
            vec2(x - 0.22 * pitch, 0.93 * height),
        ];
        b.extrude(wood, &outline, 0.02, 0.045, Shading::Flat);
    }
}

/// A conifer on the ground: a trunk and three cones.
fn conifer(b: &mut Builder, wood: u32, green: u32, foot: Vec3, height: f32) {
    b.at(foot, |b| {
        b.cylinder(wood, Vec3::ZERO, 0.035 * height, 0.2 * height, 8);
        for (low, high, radius) in [(0.14, 0.55, 0.24), (0.38, 0.78, 0.18), (0.62, 1.0, 0.12)] {
            let (low, high) = (Vec3::Y * low * height, Vec3::Y * high * height);
            b.frustum(green, low, high, radius * height, 0.0, 12, [true, false]);
        }
    });
}

/// A straight bar of square section between two points.
fn bar(b: &mut Builder, material: u32, from: Vec3, to: Vec3, width: f32) {
    let turn = Mat4::from_rotation_translation(Quat::from_rotation_arc(Vec3::X, (to - from).normalize()), from);
    let w = width / 2.0;
    b.with(turn, |b| b.cuboid(material, vec3(0.0, -w, -w), vec3(from.distance(to), w, w)));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::setup::Setup;

    #[test]
    fn every_case_starts_as_its_scene_does() {
        for case in CASES {
            let scene = (case.build)();
            assert_eq!(scene.name, case.id);
            let start = Setup::new(case.id, &scene).unwrap();
            let mut placed = start.clone();
            (case.place)(&mut placed, 0.0);
            assert_eq!((placed.camera, placed.light), (start.camera, start.light), "{}", case.id);
            assert!(scene.triangles() < 60_000, "{}: {} triangles", case.id, scene.triangles());
        }
    }
}
