//! Two lattices one above the other.

use super::{Case, FRAMES, bar, eye, floor, look, paving, sun};
use crate::light::Light;
use crate::scene::Scene;
use crate::scene::builtin::builder::{Builder, light};
use glam::{Vec3, vec3};

pub const CASE: Case = Case {
    id: "st-fence",
    title: "Fence: two lattices",
    doc: "Light falls through two lattices, one high and one low: shadow-map turns the bars into stairs, and pcf's \
          blur closes the gaps.",
    provokes: &["stairs", "blur-wide", "leak"],
    axis: "sun's azimuth from the view direction, °",
    value: azimuth,
    place: |setup, t| setup.light = light_at(t),
    telling: 0.5,
    frames: FRAMES,
    build,
};

fn azimuth(t: f32) -> f32 {
    -75.0 + 60.0 * t
}

fn light_at(t: f32) -> Light {
    sun(azimuth(t), 58.0)
}

/// A level square lattice around a point, `half` wide each way, of bars `pitch` apart.
fn lattice(b: &mut Builder, material: u32, at: Vec3, turn: f32, half: f32, pitch: f32, width: f32) {
    b.turned(at, turn, |b| {
        let count = (2.0 * half / pitch) as i32;
        for k in 0..=count {
            let s = -half + k as f32 * pitch;
            bar(b, material, vec3(-half, 0.0, s), vec3(half, 0.0, s), width);
            bar(b, material, vec3(s, width, -half), vec3(s, width, half), width);
        }
    });
}

fn build() -> Scene {
    let mut b = Builder::new(CASE.id);
    let ground = paving(&mut b);
    let wood = b.material("upper lattice", 0xa8764a);
    let iron = b.material("lower lattice", 0x5d6a72);
    floor(&mut b, ground, [-9.0, -9.0], [9.0, 9.0], 0.0);
    lattice(&mut b, wood, vec3(0.0, 2.6, 0.0), 0.2, 2.2, 0.22, 0.05);
    lattice(&mut b, iron, vec3(0.4, 0.55, 0.2), -0.35, 1.9, 0.19, 0.03);
    for (x, z) in [(-2.1, -2.1), (2.1, -2.1), (2.1, 2.1), (-2.1, 2.1)] {
        b.turned(Vec3::ZERO, 0.2, |b| bar(b, wood, vec3(x, 0.0, z), vec3(x, 2.58, z), 0.12));
    }
    for (x, z) in [(-1.8, -1.8), (1.8, -1.8), (1.8, 1.8), (-1.8, 1.8)] {
        b.turned(vec3(0.4, 0.0, 0.2), -0.35, |b| bar(b, iron, vec3(x, 0.0, z), vec3(x, 0.54, z), 0.06));
    }
    let camera = look(vec3(3.4, 4.6, 6.4), vec3(0.6, 0.5, 0.3), 44.0, 0.2, 40.0);
    b.finish(eye(camera), vec![light("sun", light_at(0.0))])
}
