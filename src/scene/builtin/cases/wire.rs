//! Wires a fifth of a texel thick.

use super::{Case, FRAMES, bar, eye, floor, look, paving, sun};
use crate::scene::builtin::builder::{Builder, light};
use crate::scene::{Camera, Scene};
use glam::vec3;

pub const CASE: Case = Case {
    id: "st-wire",
    title: "Wire: thinner than a texel",
    doc: "Wires a fifth of a texel thick (in a map of 1024²) hang over a court: shadow-map and pcf drop most of each \
          wire.",
    provokes: &["thin-caster"],
    axis: "camera's way, m",
    value: way,
    place: |setup, t| setup.camera = camera_at(t),
    telling: 0.0,
    frames: FRAMES,
    build,
};

/// Thickness of the wires, metres: a fifth of a texel of a 1024² map fitted to the view; tests hold it against the fit.
const WIRE: f32 = 0.009;

fn way(t: f32) -> f32 {
    0.8 * t
}

fn camera_at(t: f32) -> Camera {
    let aside = vec3(way(t), 0.0, 0.0);
    look(vec3(0.0, 0.8, 1.0) + aside, vec3(0.5, -0.04, -1.0) + aside, 50.0, 0.05, 120.0)
}

fn build() -> Scene {
    let mut b = Builder::new(CASE.id);
    let ground = paving(&mut b);
    let poles = b.material("poles", 0x7d6a55);
    let wire = b.material("wires", 0x44484c);
    floor(&mut b, ground, [-32.0, -58.0], [32.0, 2.0], 0.0);
    for row in 0..5 {
        let z = 1.2 - 8.0 * row as f32;
        bar(&mut b, poles, vec3(-2.4, 0.0, z), vec3(-2.4, 1.7, z), 0.09);
        bar(&mut b, poles, vec3(4.0, 0.0, z), vec3(4.0, 1.7, z), 0.09);
        bar(&mut b, poles, vec3(-2.6, 1.6, z), vec3(4.2, 1.6, z), 0.07);
    }
    for k in 0..22 {
        let x = -2.5 + 0.31 * k as f32;
        bar(&mut b, wire, vec3(x, 1.64, 1.6), vec3(x + 0.4, 1.64, -31.0), WIRE);
    }
    for k in 0..8 {
        let z = 0.9 - 0.6 * k as f32;
        bar(&mut b, wire, vec3(-2.6, 1.5, z), vec3(4.2, 1.5, z - 0.5), WIRE);
    }
    b.finish(eye(camera_at(0.0)), vec![light("sun", sun(-35.0, 58.0))])
}
