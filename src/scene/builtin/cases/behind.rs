//! A clearing with the sun coming round behind the camera.

use super::{Case, FRAMES, conifer, eye, floor, look, paving, sun};
use crate::light::Light;
use crate::scene::Scene;
use crate::scene::builtin::builder::{Builder, Rng, light};
use glam::vec3;

pub const CASE: Case = Case {
    id: "st-behind",
    title: "Behind: a warp turned inside out",
    doc: "The sun moves from ahead of the camera to exactly behind it: in psm's perspective space it passes through \
          infinity and comes out inverted, and lispsm and tsm lose what they gain.",
    provokes: &["stairs"],
    axis: "sun's azimuth from the view direction, °",
    value: azimuth,
    place: |setup, t| setup.light = light_at(t),
    telling: 0.75,
    frames: FRAMES,
    build,
};

/// As steep as the camera looks down, so that at the end the sun looks along with it.
const ELEVATION: f32 = 22.0;

fn azimuth(t: f32) -> f32 {
    60.0 + 120.0 * t
}

fn light_at(t: f32) -> Light {
    sun(azimuth(t), ELEVATION)
}

fn build() -> Scene {
    let mut b = Builder::new(CASE.id);
    let ground = paving(&mut b);
    let wood = b.material("trunks", 0x7b5a3c);
    let green = b.material("needles", 0x4f7d4a);
    let crate_ = b.material("crates", 0xc79a5b);
    floor(&mut b, ground, [-16.0, -34.0], [16.0, 12.0], 0.0);
    let mut rng = Rng::new(21);
    for k in 0..44 {
        let (x, z) = (rng.range(-12.0, 12.0), 3.0 - 0.8 * k as f32);
        let height = rng.range(1.6, 3.6);
        conifer(&mut b, wood, green, vec3(x, 0.0, z), height);
    }
    for (x, z, turn) in [(-0.9, 3.4, 0.3), (1.6, 2.2, 1.1), (0.4, 0.2, 0.7), (-2.6, 0.9, 0.1)] {
        b.turned(vec3(x, 0.0, z), turn, |b| b.block(crate_, vec3(-0.35, 0.0, -0.35), vec3(0.35, 0.7, 0.35)));
    }
    let from = vec3(0.0, 5.2, 11.5);
    let camera = look(from, from + super::direction(0.0, -ELEVATION) * 13.0, 50.0, 0.2, 80.0);
    b.finish(eye(camera), vec![light("sun", light_at(0.0))])
}
