//! Saw blades whose teeth end in tips of ten degrees.

use super::{Case, FRAMES, eye, floor, look, paving, sun};
use crate::light::Light;
use crate::scene::Scene;
use crate::scene::builtin::builder::{Builder, light};
use glam::{Vec2, vec2, vec3};
use std::f32::consts::TAU;

pub const CASE: Case = Case {
    id: "st-corner",
    title: "Corner: thin tips",
    doc: "Teeth with tips of 10° turn under the sun: shadow-map and pcf cut the tips where they are thinner than a \
          texel.",
    provokes: &["thin-caster", "stairs"],
    axis: "sun's azimuth, °",
    value: azimuth,
    place: |setup, t| setup.light = light_at(t),
    telling: 0.3,
    frames: FRAMES,
    build,
};

fn azimuth(t: f32) -> f32 {
    -90.0 + 90.0 * t
}

fn light_at(t: f32) -> Light {
    sun(azimuth(t), 64.0)
}

/// Half a tooth's width over its length: 5° on either side of the tip.
const SLOPE: f32 = 0.087_488_66;

fn build() -> Scene {
    let mut b = Builder::new(CASE.id);
    let ground = paving(&mut b);
    let steel = b.material("saw", 0x9aa3a8);
    let red = b.material("star", 0xc8553d);
    floor(&mut b, ground, [-3.0, -3.0], [3.0, 3.0], 0.0);
    // A straight saw: teeth of 0.9 m side by side.
    let (length, teeth) = (0.9f32, 12);
    let pitch = 2.0 * SLOPE * length;
    let mut outline: Vec<Vec2> = vec![vec2(0.0, -0.15)];
    for k in 0..teeth {
        let x = k as f32 * pitch;
        outline.extend([vec2(x, 0.0), vec2(x + pitch / 2.0, length)]);
    }
    outline.extend([vec2(teeth as f32 * pitch, 0.0), vec2(teeth as f32 * pitch, -0.15)]);
    b.turned(vec3(-1.35, 0.7, -0.75), 0.15, |b| b.prism(steel, &outline, 0.0, 0.012, false));
    // A star of teeth in all directions.
    let (inner, points) = (0.2f32, 14);
    let half = (TAU / points as f32 / 2.0).sin() * inner;
    let reach = inner * (TAU / points as f32 / 2.0).cos() + half / SLOPE;
    let star: Vec<Vec2> = (0..2 * points)
        .map(|k| {
            let a = k as f32 / (2 * points) as f32 * TAU;
            let r = if k % 2 == 0 { inner } else { reach };
            vec2(r * a.cos(), r * a.sin())
        })
        .collect();
    b.at(vec3(0.75, 0.45, 0.55), |b| b.prism(red, &star, 0.0, 0.012, false));
    let camera = look(vec3(0.9, 3.3, 3.1), vec3(0.05, 0.0, 0.1), 42.0, 0.1, 20.0);
    b.finish(eye(camera), vec![light("sun", light_at(0.0))])
}
