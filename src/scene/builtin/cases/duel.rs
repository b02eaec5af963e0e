//! A colonnade against the light.

use super::{Case, FRAMES, bar, eye, floor, look, paving, sun};
use crate::light::Light;
use crate::scene::Scene;
use crate::scene::builtin::builder::{Builder, light};
use glam::{Vec3, vec3};

pub const CASE: Case = Case {
    id: "st-duel",
    title: "Duel: sun and camera face to face",
    doc: "Sun and camera come to face each other: the warps of psm, lispsm and tsm degenerate, all cascades of pssm \
          overlap, and the texels of shadow-map and pcf stretch into strips on the floor.",
    provokes: &["stairs"],
    axis: "sun's azimuth from the view direction, °",
    value: azimuth,
    place: |setup, t| setup.light = light_at(t),
    telling: 0.9,
    frames: FRAMES,
    build,
};

/// The camera looks up as steeply as the sun stands, so that the two end exactly face to face.
const ELEVATION: f32 = 8.0;

fn azimuth(t: f32) -> f32 {
    80.0 * (1.0 - t)
}

fn light_at(t: f32) -> Light {
    sun(azimuth(t), ELEVATION)
}

fn build() -> Scene {
    let mut b = Builder::new(CASE.id);
    let ground = paving(&mut b);
    let stone = b.material("columns", 0xd8cbb2);
    let beam = b.material("beams", 0x9c7350);
    floor(&mut b, ground, [-16.0, -60.0], [16.0, 14.0], 0.0);
    for row in 0..10 {
        let z = 4.0 - 6.0 * row as f32;
        for x in [-6.0, -2.2, 2.2, 6.0] {
            let foot = vec3(x, 0.0, z);
            b.cylinder(stone, foot, 0.42, 0.25, 16);
            b.cylinder(stone, foot + Vec3::Y * 0.25, 0.28, 3.5, 16);
            b.cylinder(stone, foot + Vec3::Y * 3.75, 0.42, 0.25, 16);
        }
        for x in [-6.0, 2.2] {
            bar(&mut b, beam, vec3(x - 0.4, 4.15, z), vec3(x + 4.2, 4.15, z), 0.3);
        }
    }
    let from = vec3(0.0, 1.7, 11.0);
    let camera = look(from, from + super::direction(0.0, ELEVATION) * 12.0, 60.0, 0.2, 100.0);
    b.finish(eye(camera), vec![light("sun", light_at(0.0))])
}
