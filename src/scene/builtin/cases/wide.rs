//! A ceiling light that grows.

use super::{Case, FRAMES, bar, eye, floor, look, paving};
use crate::light::Light;
use crate::scene::Scene;
use crate::scene::builtin::builder::{Builder, light};
use glam::{Vec3, vec3};

pub const CASE: Case = Case {
    id: "st-wide",
    title: "Wide: a growing area light",
    doc: "A square light 3 m above the floor grows to 5 m: filters that search one map for blockers see but those of its middle.",
    provokes: &["blur-narrow", "blur-wide", "penumbra-off", "banding"],
    axis: "side of the light, m",
    value: side,
    place: |setup, t| setup.light = light_at(t),
    telling: 0.6,
    frames: FRAMES,
    build,
};

fn side(t: f32) -> f32 {
    0.25 * 20.0f32.powf(t)
}

fn light_at(t: f32) -> Light {
    let half = side(t) / 2.0;
    Light::RectArea {
        center: vec3(0.0, 3.0, 0.0),
        half_u: Vec3::X * half,
        half_v: Vec3::Z * half,
        range: 40.0,
        color: vec3(13.0, 12.4, 11.4),
    }
}

fn build() -> Scene {
    let mut b = Builder::new(CASE.id);
    let ground = paving(&mut b);
    let wood = b.material("table", 0xb98a5a);
    let blocks = b.material("blocks", 0x3f7d8c);
    let rods = b.material("rods", 0x9a5a46);
    floor(&mut b, ground, [-4.0, -4.0], [4.0, 4.0], 0.0);
    b.cuboid(wood, vec3(-1.3, 0.7, -0.9), vec3(0.1, 0.74, 0.1));
    for (x, z) in [(-1.25, -0.85), (0.05, -0.85), (0.05, 0.05), (-1.25, 0.05)] {
        bar(&mut b, wood, vec3(x, 0.0, z), vec3(x, 0.72, z), 0.06);
    }
    for k in 0..4 {
        let x = 0.55 + 0.3 * k as f32;
        b.turned(vec3(x, 0.0, 0.5 - 0.35 * k as f32), 0.4 * k as f32, |b| {
            let height = 0.15 + 0.25 * k as f32;
            b.cuboid(blocks, vec3(-0.1, 0.0, -0.1), vec3(0.1, height, 0.1));
        });
    }
    for k in 0..7 {
        let x = -1.2 + 0.2 * k as f32;
        bar(&mut b, rods, vec3(x, 0.0, 0.9), vec3(x, 0.12 * (k + 1) as f32, 0.9), 0.02);
    }
    bar(&mut b, rods, vec3(-1.25, 1.4, -1.3), vec3(1.6, 1.4, -1.3), 0.03);
    let camera = look(vec3(1.6, 2.2, 3.6), vec3(0.0, 0.25, -0.1), 46.0, 0.1, 30.0);
    b.finish(eye(camera), vec![light("ceiling light", light_at(0.0))])
}
