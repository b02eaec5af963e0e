//! A fence under a sinking sun.

use super::{Case, FRAMES, eye, fence, floor, look, paving, sun};
use crate::light::Light;
use crate::scene::Scene;
use crate::scene::builtin::builder::{Builder, light};
use glam::vec3;

pub const CASE: Case = Case {
    id: "st-grazing",
    title: "Grazing: projection aliasing",
    doc: "The sun sinks until it grazes the floor: projection aliasing and acne beyond the slope limit in every \
          shadow map (shadow-map, pcf, all warped ones).",
    provokes: &["stairs", "acne", "thin-caster"],
    axis: "sun elevation, °",
    value: elevation,
    place: |setup, t| setup.light = light_at(t),
    telling: 0.8,
    frames: FRAMES,
    build,
};

fn elevation(t: f32) -> f32 {
    60.0 - 59.0 * t
}

fn light_at(t: f32) -> Light {
    sun(-58.0, elevation(t))
}

fn build() -> Scene {
    let mut b = Builder::new(CASE.id);
    let ground = paving(&mut b);
    let wood = b.material("fence", 0xb98a5a);
    let wall = b.material("wall", 0xd9cdb8);
    floor(&mut b, ground, [-14.0, -12.0], [14.0, 12.0], 0.0);
    b.at(vec3(-7.0, 0.0, 0.0), |b| fence(b, wood, 10.0, 1.2, 0.16));
    // As long as something faces a low sun, a map fitted to it cannot shrink with the floor.
    b.block(wall, vec3(4.6, 0.0, -7.0), vec3(4.9, 3.6, 3.0));
    let camera = look(vec3(-0.6, 3.2, 7.6), vec3(0.9, 0.5, 0.0), 50.0, 0.2, 60.0);
    b.finish(eye(camera), vec![light("sun", light_at(0.0))])
}
