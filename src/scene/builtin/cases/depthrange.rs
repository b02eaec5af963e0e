//! A terrace high above the sea, and a sail on the horizon.

use super::{Case, FRAMES, direction, eye, floor, look, paving, sun};
use crate::scene::builtin::builder::{Builder, light};
use crate::scene::{Camera, Scene};
use glam::{Vec3, vec2, vec3};

pub const CASE: Case = Case {
    id: "st-depthrange",
    title: "Depth range: near and far apart",
    doc: "Far over near is 100 000, and a sail a pixel in size, 900 m away, comes into view: what is fitted to the \
          receivers (shadow-map, pcf, sdsm) stretches over all of it, pssm's splits leave the terrace one cascade, \
          and depth runs out of bits.",
    provokes: &["stairs", "thin-caster", "precision"],
    axis: "camera's heading, °",
    value: heading,
    place: |setup, t| setup.camera = camera_at(t),
    telling: 1.0,
    frames: FRAMES,
    build,
};

/// The camera turns from left to right; the sail lies straight ahead.
fn heading(t: f32) -> f32 {
    -32.0 + 20.0 * t
}

fn camera_at(t: f32) -> Camera {
    let from = vec3(0.0, 1.7, 2.2);
    look(from, from + direction(heading(t), -14.0) * 4.0, 46.0, 0.01, 1000.0)
}

fn build() -> Scene {
    let mut b = Builder::new(CASE.id);
    let ground = paving(&mut b);
    let stone = b.material("balusters", 0xdccfb8);
    let clay = b.material("pots", 0xb5613f);
    let cloth = b.double_sided("sail", 0xf2efe6);
    floor(&mut b, ground, [-4.0, -3.0], [4.0, 4.0], 0.0);
    let profile: Vec<_> = [0.0, 0.0, 0.07, 0.0, 0.07, 0.06, 0.035, 0.14, 0.075, 0.3, 0.03, 0.56, 0.06, 0.62, 0.0, 0.62]
        .chunks_exact(2)
        .map(|p| vec2(p[0], p[1]))
        .collect();
    for k in 0..=26 {
        b.at(vec3(-3.9 + 0.3 * k as f32, 0.0, -2.9), |b| b.lathe(stone, &profile, 10));
    }
    b.cuboid(stone, vec3(-4.0, 0.62, -3.0), vec3(4.0, 0.72, -2.8));
    for (x, z) in [(-2.6, -0.6), (-1.4, -1.4), (-0.3, -0.4), (1.2, -1.7)] {
        b.frustum(clay, vec3(x, 0.0, z), vec3(x, 0.4, z), 0.14, 0.24, 18, [true; 2]);
        b.icosphere(clay, vec3(x, 0.55, z), 0.2, 1);
    }
    // Its back is turned to the sea, its face to the sun.
    let mast = Vec3::new(0.0, 0.0, -900.0);
    b.polygon(cloth, &[mast + vec3(-2.4, -1.0, 0.0), mast + vec3(2.4, -1.0, 0.0), mast + vec3(0.0, 6.0, 0.0)]);
    b.finish(eye(camera_at(0.0)), vec![light("sun", sun(-140.0, 38.0))])
}
