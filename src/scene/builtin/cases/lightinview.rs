//! A lamp that flies through the picture.

use super::{Case, FRAMES, eye, floor, look, paving};
use crate::light::Light;
use crate::scene::Scene;
use crate::scene::builtin::builder::{Builder, light};
use glam::{vec2, vec3};

pub const CASE: Case = Case {
    id: "st-lightinview",
    title: "Light in view: a circling light",
    doc: "A light circles through the view frustum and out behind the camera: the gain of notw comes and goes.",
    provokes: &["stairs"],
    axis: "lamp's angle on its circle, °",
    value: angle,
    place: |setup, t| setup.light = light_at(t),
    telling: 0.0,
    frames: FRAMES,
    build,
};

fn angle(t: f32) -> f32 {
    360.0 * t
}

/// The circle lies around a point before the camera; at 0° the lamp is farthest from it.
fn light_at(t: f32) -> Light {
    let a = angle(t).to_radians();
    let position = vec3(0.0, 2.3, 4.0) + vec3(a.sin(), 0.0, -a.cos()) * 5.0;
    Light::Omni { position, range: 60.0, radius: 0.0, color: vec3(22.0, 20.0, 16.8) }
}

fn build() -> Scene {
    let mut b = Builder::new(CASE.id);
    let ground = paving(&mut b);
    let wall = b.material("walls", 0xd9cdb8);
    let stone = b.material("columns", 0xb9c0c4);
    let pots = b.material("pots", 0xb5613f);
    floor(&mut b, ground, [-8.0, -8.0], [8.0, 12.0], 0.0);
    b.cuboid(wall, vec3(-8.2, 0.0, -8.2), vec3(8.2, 4.5, -8.0));
    b.cuboid(wall, vec3(-8.2, 0.0, -8.0), vec3(-8.0, 4.5, 12.0));
    b.cuboid(wall, vec3(8.0, 0.0, -8.0), vec3(8.2, 4.5, 12.0));
    for k in 0..9 {
        let a = k as f32 / 9.0 * std::f32::consts::TAU;
        let foot = vec3(3.6 * a.sin(), 0.0, -1.6 - 3.6 * a.cos());
        b.cylinder(stone, foot, 0.2, 2.6, 14);
        b.cuboid(stone, foot + vec3(-0.3, 2.6, -0.3), foot + vec3(0.3, 2.8, 0.3));
    }
    let profile = [0.0, 0.0, 0.22, 0.0, 0.34, 0.35, 0.2, 0.6, 0.26, 0.7, 0.2, 0.7, 0.14, 0.6];
    let profile: Vec<_> = profile.chunks_exact(2).map(|p| vec2(p[0], p[1])).collect();
    for (x, z) in [(-1.3, 1.2), (1.5, 0.4), (0.2, -2.0), (-5.6, -4.5), (5.4, -5.5), (-5.2, 2.5), (4.8, 2.2)] {
        b.at(vec3(x, 0.0, z), |b| b.lathe(pots, &profile, 20));
    }
    let camera = look(vec3(0.0, 3.4, 7.6), vec3(0.0, 0.9, -1.5), 56.0, 0.2, 60.0);
    b.finish(eye(camera), vec![light("lamp", light_at(0.0))])
}
