//! Things that rest on the floor, under a growing bias.

use super::{Case, FRAMES, eye, floor, look, paving, sun};
use crate::params::Value;
use crate::scene::Scene;
use crate::scene::builtin::builder::{Builder, light};
use crate::setup::Setup;
use crate::techniques;
use glam::vec3;

pub const CASE: Case = Case {
    id: "st-contact",
    title: "Contact: peter-panning",
    doc: "Boxes rest on the floor, some of them twice in the same place, while the bias grows to 10 cm: shadows come \
          off their casters, and light leaks under plates, in every map with a bias (shadow-map, pcf and all the \
          others).",
    provokes: &["detachment"],
    axis: "bias, m",
    value: |t| bias(t) as f32,
    place,
    telling: 1.0,
    frames: FRAMES,
    build,
};

/// From none to the most that there is, slowly at first.
fn bias(t: f32) -> f64 {
    0.1 * f64::from(t * t)
}

/// In all techniques that have one, whichever is selected.
fn place(setup: &mut Setup, t: f32) {
    for info in techniques::ALL.iter() {
        if info.specs().any(|s| s.name == "bias") {
            setup.params.entry(info.id.into()).or_default().insert("bias".into(), Value::Float(bias(t)));
        }
    }
}

fn build() -> Scene {
    let mut b = Builder::new(CASE.id);
    let ground = paving(&mut b);
    let boxes = [b.material("boxes", 0xc8553d), b.material("plates", 0x3f7d8c), b.material("wall", 0xe0c48a)];
    b.uv_scale = 2.0;
    floor(&mut b, ground, [-2.2, -2.2], [2.2, 2.2], 0.0);
    // Closed boxes: their undersides lie in the floor's plane. The first is there twice.
    for _ in 0..2 {
        b.turned(vec3(-0.55, 0.0, 0.35), 0.5, |b| b.cuboid(boxes[0], vec3(-0.16, 0.0, -0.16), vec3(0.16, 0.32, 0.16)));
    }
    b.turned(vec3(-0.1, 0.0, 0.75), 0.2, |b| b.cuboid(boxes[0], vec3(-0.09, 0.0, -0.09), vec3(0.09, 0.09, 0.09)));
    b.turned(vec3(-0.95, 0.0, 0.9), 0.9, |b| b.cuboid(boxes[0], vec3(-0.2, 0.0, -0.06), vec3(0.2, 0.04, 0.06)));
    // Plates a little above the floor, each on one foot: 1, 2, 4 and 8 cm of air.
    for (k, gap) in [0.01, 0.02, 0.04, 0.08].into_iter().enumerate() {
        let x = -0.65 + 0.48 * k as f32;
        b.cuboid(boxes[1], vec3(x - 0.19, gap, -0.45), vec3(x + 0.19, gap + 0.015, -0.1));
        b.cuboid(boxes[1], vec3(x - 0.02, 0.0, -0.44), vec3(x + 0.02, gap, -0.4));
    }
    // A thin wall and a corner of it: its foot is where light would leak.
    b.cuboid(boxes[2], vec3(0.45, 0.0, 0.2), vec3(1.05, 0.3, 0.22));
    b.cuboid(boxes[2], vec3(0.45, 0.0, 0.22), vec3(0.47, 0.3, 0.75));
    let camera = look(vec3(0.25, 1.75, 2.25), vec3(0.06, 0.0, 0.16), 46.0, 0.05, 20.0);
    b.finish(eye(camera), vec![light("sun", sun(-50.0, 42.0))])
}
