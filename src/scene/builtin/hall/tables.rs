//! Tables, chairs, tableware and the lamps over them.

use super::{CEILING, LAMP, Palette, TABLE};
use crate::scene::builtin::builder::{Builder, Rng, Shading, pairs};
use glam::{Mat4, Quat, Vec2, Vec3, vec2, vec3};
use std::f32::consts::{FRAC_PI_2, PI, TAU};

fn lathe(b: &mut Builder, material: u32, scale: f32, profile: &[f32], segments: usize) {
    let profile: Vec<Vec2> = pairs(profile).iter().map(|&p| p * scale).collect();
    b.lathe(material, &profile, segments);
}

pub(super) fn plate(b: &mut Builder, material: u32, radius: f32, segments: usize) {
    let profile =
        [0.0, 0.02, 0.58, 0.02, 0.64, 0.0, 0.7, 0.02, 0.98, 0.13, 1.0, 0.155, 0.97, 0.16, 0.68, 0.06, 0.0, 0.05];
    lathe(b, material, radius, &profile, segments);
}

/// A cup on its saucer.
pub(super) fn cup(b: &mut Builder, material: u32, segments: usize) {
    let saucer = [0.0, 0.002, 0.04, 0.0, 0.072, 0.01, 0.074, 0.013, 0.045, 0.008, 0.0, 0.008];
    lathe(b, material, 1.0, &saucer, segments);
    let cup =
        [0.024, 0.006, 0.026, 0.014, 0.034, 0.03, 0.041, 0.066, 0.042, 0.07, 0.039, 0.07, 0.032, 0.034, 0.0, 0.018];
    lathe(b, material, 1.0, &cup, segments);
    let handle: Vec<Vec3> = (0..7)
        .map(|i| {
            let angle = -1.3 + i as f32 / 6.0 * 2.6;
            vec3(0.034 + 0.021 * angle.cos(), 0.042 + 0.02 * angle.sin(), 0.0)
        })
        .collect();
    b.tube(material, &handle, &[0.0035; 7], 5, false);
}

pub(super) fn bottle(b: &mut Builder, material: u32, segments: usize) {
    let profile = [
        0.0, 0.0, 0.033, 0.0, 0.037, 0.006, 0.037, 0.18, 0.032, 0.205, 0.016, 0.235, 0.013, 0.26, 0.013, 0.295, 0.016,
        0.298, 0.016, 0.31, 0.0, 0.31,
    ];
    lathe(b, material, 1.0, &profile, segments);
}

fn glass(b: &mut Builder, material: u32) {
    let profile = [0.0, 0.0, 0.03, 0.0, 0.038, 0.12, 0.0355, 0.12, 0.028, 0.012, 0.0, 0.012];
    lathe(b, material, 1.0, &profile, 14);
}

pub(super) fn vase(b: &mut Builder, material: u32, size: f32) {
    let profile = [
        0.0, 0.0, 0.04, 0.0, 0.045, 0.005, 0.06, 0.05, 0.055, 0.09, 0.03, 0.13, 0.026, 0.15, 0.034, 0.17, 0.03, 0.17,
        0.021, 0.15, 0.024, 0.12, 0.0, 0.1,
    ];
    lathe(b, material, size, &profile, 20);
}

/// Flowers in a vase on the table at the origin.
fn bouquet(b: &mut Builder, m: &Palette, rng: &mut Rng, kind: usize) {
    vase(b, [m.blue, m.china][kind % 2], 1.0);
    for k in 0..7 {
        let angle = k as f32 * 2.4 + kind as f32;
        let lean = if k == 0 { 0.0 } else { rng.range(0.04, 0.085) };
        let top = vec3(angle.cos() * lean, rng.range(0.27, 0.34), angle.sin() * lean);
        let knee = vec3(top.x * 0.25, 0.17, top.z * 0.25);
        b.tube(m.leaf, &[vec3(0.0, 0.11, 0.0), knee, top], &[0.0022; 3], 4, false);
        let up = (top - knee).normalize();
        let turn = Mat4::from_rotation_translation(Quat::from_rotation_arc(Vec3::Y, up), top);
        let petal = m.petal[(k + kind) % 3];
        b.with(turn, |b| {
            for p in 0..8 {
                b.turned(Vec3::ZERO, p as f32 / 8.0 * TAU, |b| {
                    b.lattice(petal, 3, 3, Shading::Smooth(180.0), |i, j| {
                        let (s, t) = (i as f32 - 1.0, j as f32 / 2.0);
                        let width = 0.004 + 0.012 * t;
                        (vec3(0.004 + 0.03 * t, 0.004 + 0.012 * t * t + 0.002 * s * s, -s * width), vec2(s, t))
                    });
                });
            }
            b.ellipsoid(m.brass, vec3(0.0, 0.005, 0.0), vec3(0.009, 0.006, 0.009), 8, 4);
        });
        b.leaves(m.leaf, rng, 3, 0.05, |rng| {
            (knee.lerp(top, rng.range(0.1, 0.6)), vec3(angle.cos(), 0.8, angle.sin()))
        });
    }
}

/// A chair that faces -z, its seat's middle at the origin.
fn chair(b: &mut Builder, m: &Palette, wood: u32, felt: usize) {
    b.uv_scale = 2.0;
    let seat = 0.445;
    b.rounded(wood, vec3(-0.21, seat - 0.03, -0.21), vec3(0.21, seat, 0.2), 0.012, 2);
    b.rounded(m.cushion[felt], vec3(-0.185, seat - 0.004, -0.19), vec3(0.185, seat + 0.03, 0.165), 0.016, 2);
    for s in [-1.0, 1.0] {
        b.frustum(wood, vec3(s * 0.2, 0.0, -0.2), vec3(s * 0.17, seat - 0.02, -0.17), 0.013, 0.019, 10, [true, false]);
        // The back leg goes on as the back's post.
        let post = [(0.235, 0.0), (0.19, 0.25), (0.18, 0.44), (0.19, 0.6), (0.215, 0.75), (0.25, 0.9)]
            .map(|(z, y)| vec3(s * (0.2 - 0.012 * y), y, z));
        b.tube(wood, &post, &[0.013, 0.017, 0.019, 0.017, 0.015, 0.012], 9, false);
        b.frustum(wood, vec3(s * 0.192, 0.17, -0.19), vec3(s * 0.197, 0.2, 0.2), 0.009, 0.009, 7, [false; 2]);
    }
    b.frustum(wood, vec3(-0.194, 0.185, 0.0), vec3(0.194, 0.185, 0.0), 0.009, 0.009, 7, [false; 2]);
    let rail = |y: f32, z: f32, bow: f32| -> Vec<Vec3> {
        (0..9)
            .map(|i| {
                let s = i as f32 / 4.0 - 1.0;
                vec3(s * (0.2 - 0.012 * y), y, z + bow * (1.0 - s * s))
            })
            .collect()
    };
    b.tube(wood, &rail(0.87, 0.244, 0.035), &[0.017; 9], 8, false);
    b.tube(wood, &rail(0.53, 0.185, 0.02), &[0.011; 9], 7, false);
    for k in 0..5 {
        let s = (k as f32 - 2.0) * 0.35;
        let bow = 1.0 - s * s;
        let (low, high) = (vec3(s * 0.194, 0.53, 0.185 + 0.02 * bow), vec3(s * 0.19, 0.87, 0.244 + 0.035 * bow));
        b.frustum(wood, low, high, 0.0065, 0.0065, 7, [false; 2]);
    }
    b.uv_scale = 1.0;
}

/// What lies before one guest, who sits at +z.
fn setting(b: &mut Builder, m: &Palette, rng: &mut Rng, round: bool) {
    plate(b, m.china, 0.125, 28);
    for (x, w) in [(-0.165, 0.012), (0.165, 0.01), (0.188, 0.012)] {
        let tilt = rng.range(-0.03, 0.03);
        b.turned(vec3(x, 0.0, 0.01), tilt, |b| {
            b.block(m.steel, vec3(-w * 0.4, 0.0, -0.01), vec3(w * 0.4, 0.004, 0.1));
            b.block(m.steel, vec3(-w, 0.0, -0.1), vec3(w, 0.003, -0.01));
        });
    }
    let near = if round { 0.15 } else { 0.19 };
    b.turned(vec3(0.13, 0.0, -near), rng.range(0.0, TAU), |b| cup(b, m.blue, 22));
    b.at(vec3(-0.12, 0.0, -near + rng.range(-0.015, 0.015)), |b| glass(b, m.steel));
}

fn seat(b: &mut Builder, m: &Palette, rng: &mut Rng, at: Vec3, facing: f32, wood: u32, felt: usize) {
    let turn = facing + rng.range(-0.16, 0.16);
    let pull = Quat::from_rotation_y(facing) * Vec3::Z * rng.range(-0.03, 0.1);
    b.turned(at + pull, turn, |b| chair(b, m, wood, felt));
}

pub(super) fn round_table(b: &mut Builder, m: &Palette, rng: &mut Rng, kind: usize) {
    b.uv_scale = 1.0;
    let top = pairs(&[0.0, 0.715, 0.5, 0.715, 0.54, 0.722, 0.55, 0.735, 0.545, 0.746, 0.535, 0.75, 0.0, 0.75]);
    b.lathe(m.oak, &top, 48);
    let stem = pairs(&[
        0.0, 0.0, 0.27, 0.0, 0.28, 0.012, 0.25, 0.03, 0.06, 0.06, 0.04, 0.12, 0.04, 0.55, 0.06, 0.66, 0.2, 0.72,
    ]);
    b.lathe(m.black, &stem, 28);
    for k in 0..4 {
        let angle = k as f32 * FRAC_PI_2;
        b.turned(vec3(0.0, TABLE, 0.0), angle, |b| b.at(vec3(0.0, 0.0, 0.36), |b| setting(b, m, rng, true)));
        let at = Quat::from_rotation_y(angle) * vec3(0.0, 0.0, 0.7);
        seat(b, m, rng, at, angle, m.walnut, (k + kind) % 2);
    }
    b.at(vec3(0.0, TABLE, 0.0), |b| bouquet(b, m, rng, kind));
}

pub(super) fn long_table(b: &mut Builder, m: &Palette, rng: &mut Rng, kind: usize) {
    b.uv_scale = 1.0;
    b.rounded(m.oak, vec3(-1.05, 0.71, -0.46), vec3(1.05, TABLE, 0.46), 0.012, 2);
    b.cuboid_sides(m.oak, vec3(-0.95, 0.63, -0.37), vec3(0.95, 0.712, 0.37), [true, true, true, false, true, true]);
    for (x, z) in [(-0.92, -0.34), (0.92, -0.34), (-0.92, 0.34), (0.92, 0.34)] {
        b.frustum(m.oak, vec3(x * 1.02, 0.0, z * 1.04), vec3(x, 0.64, z), 0.022, 0.038, 14, [true, false]);
    }
    for side in 0..2 {
        let turn = side as f32 * PI;
        for x in [-0.68, 0.0, 0.68] {
            let local = Quat::from_rotation_y(turn);
            b.turned(local * vec3(x, 0.0, 0.3) + Vec3::Y * TABLE, turn, |b| setting(b, m, rng, false));
            seat(b, m, rng, local * vec3(x, 0.0, 0.68), turn, m.walnut, (side + kind) % 2);
        }
    }
    b.at(vec3(0.0, TABLE, 0.0), |b| bouquet(b, m, rng, kind + 1));
    b.at(vec3(-0.34, TABLE, 0.03), |b| bottle(b, m.glass, 20));
    b.at(vec3(0.36, TABLE, -0.03), |b| bottle(b, m.glass, 20));
}

/// A lamp over a table: a bell shade, or a cage of wires around nothing but its socket.
pub(super) fn pendant(b: &mut Builder, m: &Palette, cage: bool) {
    let top = LAMP + if cage { 0.24 } else { 0.2 };
    b.frustum(m.black, vec3(0.0, top, 0.0), vec3(0.0, CEILING - 0.02, 0.0), 0.006, 0.006, 6, [false; 2]);
    b.lathe(m.brass, &[vec2(0.0, CEILING - 0.04), vec2(0.045, CEILING - 0.035), vec2(0.05, CEILING)], 20);
    let socket = pairs(&[0.0, top - 0.06, 0.024, top - 0.06, 0.024, top, 0.012, top + 0.03, 0.0, top + 0.03]);
    b.lathe(m.brass, &socket, 16);
    if !cage {
        let bell = pairs(&[
            0.24, 0.0, 0.237, 0.03, 0.2, 0.1, 0.12, 0.165, 0.05, 0.19, 0.02, 0.2, 0.02, 0.19, 0.05, 0.18, 0.115, 0.155,
            0.194, 0.094, 0.23, 0.026, 0.235, 0.0, 0.24, 0.0,
        ]);
        b.at(Vec3::Y * LAMP, |b| b.lathe(m.black, &bell, 32));
        b.icosphere(m.bulb, vec3(0.0, LAMP + 0.085, 0.0), 0.055, 2);
        return;
    }
    let center = vec3(0.0, LAMP + 0.1, 0.0);
    let radius = 0.15;
    for k in 0..8 {
        let angle = k as f32 / 8.0 * TAU;
        let wire: Vec<Vec3> = (0..=12)
            .map(|i| {
                let t = 0.18 + i as f32 / 12.0 * (PI - 0.36);
                center + vec3(angle.cos() * t.sin(), t.cos(), angle.sin() * t.sin()) * radius
            })
            .collect();
        b.tube(m.black, &wire, &[0.0025; 13], 5, false);
    }
    for t in [0.18, 0.8, 1.4, 2.2, PI - 0.18] {
        let ring: Vec<Vec3> = (0..20)
            .map(|i| {
                let angle = i as f32 / 20.0 * TAU;
                center + vec3(angle.cos() * f32::sin(t), f32::cos(t), angle.sin() * f32::sin(t)) * radius
            })
            .collect();
        b.tube(m.black, &ring, &[0.0025; 20], 5, true);
    }
}
