//! Three cubes on a plane, one for each of three cascades (the first scene of Azri 2020).

use super::builder::{Builder, Patch, Shading, camera, light};
use crate::light::Light;
use crate::scene::Scene;
use glam::{Vec3, vec2, vec3};
use std::f32::consts::TAU;

/// Where the cubes stand: distance in front of the default camera, to the side, turn in radians.
/// Its planes at 2 m and 60 m, split into three half or more logarithmically, part at 6 to 14 m and 19 to 30 m.
const CUBES: [(f32, f32, f32); 3] = [(5.0, -1.0, 0.42), (16.5, 0.9, 0.7), (34.0, 7.0, 0.25)];
/// Half the cubes' edge, metres.
const HALF: f32 = 0.6;

pub fn build() -> Scene {
    stage("cubes", |b, color| b.block(color, Vec3::splat(-HALF), Vec3::splat(HALF)))
}

/// The same with a trefoil knot in each cube's place, of about as many triangles in all: to measure with, no scene of the lists.
pub fn knots(triangles: usize) -> Scene {
    let rows = ((triangles / 48) as f32).sqrt().max(6.0) as usize;
    let columns = triangles / (6 * rows);
    let at = |t: f32| {
        let wide = 2.0 + (3.0 * t).cos();
        vec3(wide * (2.0 * t).cos(), wide * (2.0 * t).sin(), (3.0 * t).sin())
    };
    let mut knot = Patch::default();
    knot.lattice(columns + 1, rows + 1, |i, j| {
        let t = TAU * (i % columns) as f32 / columns as f32;
        let around = -TAU * (j % rows) as f32 / rows as f32;
        let along = (at(t + 1e-3) - at(t - 1e-3)).normalize();
        let out = along.cross(Vec3::Z).normalize();
        let p = at(t) + 0.45 * (around.cos() * out + around.sin() * along.cross(out));
        (HALF / 3.45 * p, vec2(t, around))
    });
    stage("knots", |b, color| b.add(color, &knot, Shading::Smooth(180.0)))
}

/// The ground with something in each cube's place, drawn around its middle.
fn stage(name: &str, draw: impl Fn(&mut Builder, u32)) -> Scene {
    let mut b = Builder::new(name);
    let tiles = b.texture(256, 256, |x, y| {
        let edge = x % 128 < 2 || y % 128 < 2;
        let dark = (x / 128 + y / 128) % 2 == 1;
        let c = match (edge, dark) {
            (true, _) => 0.70,
            (_, true) => 0.80,
            _ => 0.86,
        };
        [c, c * 0.985, c * 0.945, 1.0]
    });
    let ground = b.textured("ground", 0xe8e4da, tiles);
    let colors =
        [b.material("near cube", 0xc8553d), b.material("middle cube", 0xe0a63a), b.material("far cube", 0x3f7d8c)];
    b.uv_scale = 0.5;
    b.heightfield(ground, vec2(-44.0, -56.0), vec2(44.0, 12.0), [22, 17], |_, _| 0.0);
    for ((distance, side, turn), color) in CUBES.into_iter().zip(colors) {
        b.turned(vec3(side, HALF, -distance), turn, |b| {
            draw(b, color);
        });
    }
    let eye = vec3(0.0, 2.1, 0.0);
    b.finish(
        vec![
            camera("default", eye, vec3(0.9, 0.6, -9.0), 38.0, 2.0, 60.0),
            camera("near", vec3(1.2, 1.9, -1.9), vec3(-0.8, 0.45, -5.3), 45.0, 0.1, 80.0),
            camera("above", vec3(17.0, 13.0, -1.0), vec3(2.0, 0.0, -17.0), 50.0, 1.0, 120.0),
        ],
        vec![
            light(
                "sun",
                Light::Directional {
                    to_light: vec3(-0.62, 0.55, 0.48),
                    angular_radius: 0.0,
                    color: vec3(1.0, 0.96, 0.88),
                },
            ),
            light(
                "spot",
                Light::Spot {
                    position: vec3(-6.0, 8.0, 1.0),
                    direction: vec3(0.55, -0.62, -0.8),
                    outer_angle: 35.0,
                    range: 60.0,
                    radius: 0.0,
                    color: vec3(120.0, 112.0, 98.0),
                },
            ),
            light(
                "omni",
                Light::Omni { position: vec3(0.6, 3.0, -7.0), range: 50.0, radius: 0.0, color: vec3(16.0, 14.5, 12.0) },
            ),
            light(
                "area",
                Light::RectArea {
                    center: vec3(-5.0, 6.0, -2.0),
                    half_u: vec3(0.92, 0.0, 0.77),
                    half_v: vec3(-0.33, -0.67, 0.4),
                    range: 60.0,
                    color: vec3(60.0, 56.0, 50.0),
                },
            ),
        ],
    )
}
