//! A mast that leaves the picture while its shadow stays.

use super::{Case, FRAMES, bar, direction, eye, floor, look, paving, sun};
use crate::scene::builtin::builder::{Builder, light};
use crate::scene::{Camera, Scene};
use glam::{Vec3, vec3};

pub const CASE: Case = Case {
    id: "st-offscreen",
    title: "Off screen: a caster out of view",
    doc: "The camera turns away from a lattice mast whose shadow stays in the picture: a fit or a cull that keeps \
          only casters in view loses it (pssm, sdsm, lispsm, tsm), and a depth range that reaches up to it costs \
          bits.",
    provokes: &["missing-caster", "stairs"],
    axis: "camera's heading, °",
    value: heading,
    place: |setup, t| setup.camera = camera_at(t),
    telling: 0.65,
    frames: FRAMES,
    build,
};

fn heading(t: f32) -> f32 {
    -38.0 + 66.0 * t
}

fn camera_at(t: f32) -> Camera {
    let from = vec3(0.0, 2.6, 0.0);
    look(from, from + direction(heading(t), -9.0) * 9.0, 52.0, 0.2, 120.0)
}

fn build() -> Scene {
    let mut b = Builder::new(CASE.id);
    let ground = paving(&mut b);
    let steel = b.material("mast", 0xa9543f);
    let kerb = b.material("kerbs", 0xb9b2a6);
    floor(&mut b, ground, [-36.0, -44.0], [36.0, 12.0], 0.0);
    let (foot, height, levels) = (vec3(-13.0, 0.0, -15.0), 26.0, 13);
    let corner = |level: usize, side: usize| {
        let share = level as f32 / levels as f32;
        let half = 1.7 - 1.3 * share;
        let (x, z) = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)][side % 4];
        foot + vec3(x * half, share * height, z * half)
    };
    for level in 0..levels {
        for side in 0..4 {
            bar(&mut b, steel, corner(level, side), corner(level + 1, side), 0.22);
            bar(&mut b, steel, corner(level, side), corner(level + 1, side + 1), 0.12);
            bar(&mut b, steel, corner(level + 1, side), corner(level + 1, side + 1), 0.12);
        }
    }
    let top = foot + Vec3::Y * height;
    bar(&mut b, steel, top - vec3(4.0, 0.0, 0.0), top + vec3(7.0, 0.0, 0.0), 0.5);
    for k in 0..12 {
        let x = -14.0 + 2.6 * k as f32;
        b.block(kerb, vec3(x, 0.0, -7.2), vec3(x + 1.4, 0.35, -6.8));
    }
    b.finish(eye(camera_at(0.0)), vec![light("sun", sun(-62.0, 30.0))])
}
