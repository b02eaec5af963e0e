//! A floor and nothing else.

use super::{Case, FRAMES, direction, eye, floor, look, paving, sun};
use crate::scene::builtin::builder::{Builder, light};
use crate::scene::{Camera, Scene};
use glam::vec3;

pub const CASE: Case = Case {
    id: "st-single-plane",
    title: "Single plane: nothing casts",
    doc: "One level plane, seen from above until the horizon rises into the picture: a test of the aliasing error, \
          whose value is known here; any shadow is acne.",
    provokes: &["acne"],
    axis: "camera's pitch, °",
    value: pitch,
    place: |setup, t| setup.camera = camera_at(t),
    telling: 0.8,
    frames: FRAMES,
    build,
};

fn pitch(t: f32) -> f32 {
    -75.0 + 67.0 * t
}

fn camera_at(t: f32) -> Camera {
    let from = vec3(0.0, 3.0, 0.0);
    look(from, from + direction(0.0, pitch(t)) * 6.0, 50.0, 0.2, 200.0)
}

fn build() -> Scene {
    let mut b = Builder::new(CASE.id);
    let ground = paving(&mut b);
    floor(&mut b, ground, [-60.0, -100.0], [60.0, 20.0], 0.0);
    b.finish(eye(camera_at(0.0)), vec![light("sun", sun(-50.0, 40.0))])
}
