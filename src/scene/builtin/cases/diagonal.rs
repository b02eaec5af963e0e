//! Two islands of detail and nothing between them.

use super::{Case, FRAMES, eye, fence, look, paving, sun};
use crate::light::Light;
use crate::scene::Scene;
use crate::scene::builtin::builder::{Builder, Rng, light};
use glam::{vec2, vec3};
use std::f32::consts::TAU;

pub const CASE: Case = Case {
    id: "st-diagonal",
    title: "Diagonal: two islands",
    doc: "Two islands lie on a diagonal of the light's image, and in the middle of the path on one of its axes: rtw \
          spends half its map on the two empty corners, which notw can avoid, and shadow-map and pcf waste all that \
          lies between.",
    provokes: &["stairs"],
    axis: "sun's azimuth, °",
    value: azimuth,
    place: |setup, t| setup.light = light_at(t),
    telling: 0.0,
    frames: FRAMES,
    build,
};

/// The islands lie along an azimuth of 41°: on a diagonal at both ends, on the map's height in the middle.
fn azimuth(t: f32) -> f32 {
    -4.0 + 90.0 * t
}

fn light_at(t: f32) -> Light {
    sun(azimuth(t), 60.0)
}

fn build() -> Scene {
    let mut b = Builder::new(CASE.id);
    let ground = paving(&mut b);
    let wood = b.material("wood", 0xb98a5a);
    let stone = b.material("stones", 0x8f9aa0);
    let mut rng = Rng::new(11);
    for (at, turn) in [(vec3(-2.4, 0.0, 2.8), -0.5), (vec3(3.3, 0.0, -3.8), -0.9)] {
        b.at(at, |b| {
            let outline: Vec<_> = (0..24)
                .map(|k| {
                    let a = k as f32 / 24.0 * TAU;
                    let r = 1.5 + 0.12 * (3.0 * a).sin();
                    vec2(r * a.cos(), r * a.sin())
                })
                .collect();
            b.prism(ground, &outline, -0.25, 0.0, false);
            b.turned(vec3(0.0, 0.0, 0.0), turn, |b| {
                b.at(vec3(-1.0, 0.0, 0.3), |b| fence(b, wood, 2.0, 0.7, 0.08));
                b.at(vec3(-1.0, 0.0, -0.45), |b| fence(b, wood, 2.0, 0.5, 0.06));
            });
            for _ in 0..9 {
                let (a, r) = (rng.range(0.0, TAU), rng.range(0.2, 1.25));
                let size = rng.range(0.05, 0.14);
                b.icosphere(stone, vec3(r * a.cos(), size * 0.7, r * a.sin()), size, 1);
            }
        });
    }
    let camera = look(vec3(-1.0, 6.4, 9.8), vec3(-0.1, -0.4, 0.2), 46.0, 0.2, 60.0);
    b.finish(eye(camera), vec![light("sun", light_at(0.0))])
}
