//! An observatory with an open dome on a round terrace, a lattice mast and pines, on a hill's top.

mod dome;

use super::builder::{Builder, Rng, Shading, camera, fbm, light, pairs};
use crate::light::Light;
use crate::scene::Scene;
use dome::{dome, drum, telescope};
use glam::{Mat4, Quat, Vec2, Vec3, vec2, vec3};
use std::f32::consts::{FRAC_PI_2, PI, TAU};

/// What the scene shows.
pub const DESCRIPTION: &str = "An observatory with an open dome, a lattice mast and pines on a hill's top";

const TERRACE: f32 = 1.2;
const TERRACE_RADIUS: f32 = 8.6;
/// Where the dome turns on the drum.
const SPRING: f32 = 4.9;
const DOME: f32 = 4.1;
const SHELL: f32 = 0.1;
/// Half the slit's width.
const SLIT: f32 = 0.75;
/// Steps of the dome from the front horizon over the zenith to the back one, and the slit's ends.
const ARC: usize = 60;
const SLIT_FROM: usize = 5;
const SLIT_TO: usize = 36;
/// Where the slit points, radians about y from +z.
const AZIMUTH: f32 = 0.62;
const FLOOR: f32 = 3.0;

struct Palette {
    grass: u32,
    gravel: u32,
    paving: u32,
    wall: u32,
    stone: u32,
    dome: u32,
    inner: u32,
    dark: u32,
    steel: u32,
    red: u32,
    white: u32,
    wood: u32,
    bark: u32,
    needles: u32,
    bush: u32,
    thicket: u32,
    glass: u32,
}

/// Generates the scene.
pub fn build() -> Scene {
    let mut b = Builder::new("observatory");
    let grass = b.texture(256, 256, |x, y| {
        let p = vec2(x as f32, y as f32) / 256.0;
        let v = fbm(p * 8.0, 3, 8, 5);
        let dry = fbm(p * 4.0, 8, 4, 3);
        [0.36 + 0.26 * v + 0.14 * dry, 0.46 + 0.2 * v, 0.22 + 0.16 * v, 1.0]
    });
    let slabs = b.texture(256, 256, |x, y| {
        let row = y / 64;
        let u = (x + row % 2 * 64) % 256;
        let p = vec2(x as f32, y as f32) / 256.0;
        let piece = (u / 128 + row * 2) as f32;
        let v = 0.78 + 0.12 * fbm(p * 16.0, 5, 16, 3) + 0.08 * fbm(vec2(piece * 3.7, 0.5), 6, 0, 1);
        let v = if u % 128 < 2 || y % 64 < 2 { 0.52 } else { v };
        [v, v * 0.97, v * 0.92, 1.0]
    });
    let plaster = b.texture(256, 256, |x, y| {
        let v = 0.9 + 0.1 * fbm(vec2(x as f32, y as f32) / 32.0, 2, 8, 4);
        [v, v, v, 1.0]
    });
    let m = Palette {
        grass: b.textured("grass", 0xffffff, grass),
        gravel: b.textured("gravel", 0xcbb994, plaster),
        paving: b.textured("paving", 0xe2d6c2, slabs),
        wall: b.textured("plaster", 0xf0e4cf, plaster),
        stone: b.textured("sandstone", 0xd6bf9c, slabs),
        dome: b.material("painted steel dome", 0xd9dee1),
        inner: b.material("dome's inside", 0x9aa7b0),
        dark: b.material("dark paint", 0x3a434c),
        steel: b.material("galvanised steel", 0xaab2b8),
        red: b.material("signal red", 0xc2452f),
        white: b.material("white paint", 0xf0efe9),
        wood: b.textured("teak", 0x9a6b43, plaster),
        bark: b.textured("bark", 0x6c513c, plaster),
        needles: b.double_sided("needles", 0x3f6a48),
        bush: b.double_sided("shrub", 0x7c9a4e),
        thicket: b.material("thicket", 0x4f6a34),
        glass: b.material("window glass", 0x51697a),
    };
    landscape(&mut b, &m);
    terrace(&mut b, &m);
    drum(&mut b, &m);
    b.turned(vec3(0.0, SPRING, 0.0), AZIMUTH, |b| dome(b, &m));
    b.turned(vec3(0.0, FLOOR, 0.0), AZIMUTH, |b| telescope(b, &m));
    annex(&mut b, &m);
    b.at(vec3(-13.5, ground(-13.5, 4.5), 4.5), |b| mast(b, &m));
    plants(&mut b, &m);
    b.finish(
        vec![
            camera("path", vec3(8.4, 2.0, 16.6), vec3(-1.9, 4.0, 0.0), 50.0, 0.1, 250.0),
            camera("terrace", vec3(1.6, 2.95, 8.0), vec3(-5.0, 2.2, 2.2), 66.0, 0.05, 250.0),
            camera("telescope", vec3(-2.9, 4.5, -1.9), vec3(0.5, 5.5, 0.7), 72.0, 0.05, 120.0),
            camera("mast", vec3(-15.5, 1.9, 14.0), vec3(-8.5, 4.6, 1.0), 58.0, 0.1, 250.0),
            camera("aerial", vec3(21.0, 17.0, 19.0), vec3(-1.5, 1.8, 0.0), 42.0, 0.5, 300.0),
        ],
        vec![
            light(
                "evening sun",
                Light::Directional {
                    to_light: vec3(-0.78, 0.5, 0.62),
                    angular_radius: 0.0,
                    color: vec3(1.0, 0.88, 0.7) * 1.3,
                },
            ),
            light(
                "noon sun",
                Light::Directional {
                    to_light: vec3(0.3, 1.0, 0.45),
                    angular_radius: 0.0,
                    color: vec3(1.0, 0.97, 0.92) * 1.2,
                },
            ),
            light(
                "dome lamp",
                Light::Omni { position: vec3(-1.6, 7.2, -1.2), range: 30.0, radius: 0.0, color: vec3(9.0, 4.6, 3.0) },
            ),
            light(
                "floodlight",
                Light::Spot {
                    position: vec3(9.5, 6.5, 10.5),
                    direction: vec3(-9.5, -2.6, -10.5),
                    outer_angle: 32.0,
                    range: 60.0,
                    radius: 0.0,
                    color: vec3(170.0, 165.0, 150.0),
                },
            ),
        ],
    )
}

/// The hill's height: flat on top, uneven where it falls away.
fn ground(x: f32, z: f32) -> f32 {
    let r = vec2(x, z).length();
    let out = ((r - 15.0) / 60.0).clamp(0.0, 1.0);
    let fall = out * out * (3.0 - 2.0 * out);
    let rough = fbm(vec2(x, z) * 0.055 + 40.0, 4, 0, 4) - 0.5;
    let near = ((r - 10.0) / 8.0).clamp(0.0, 1.0);
    rough * (0.5 * near + 13.0 * out) - 19.0 * fall
}

fn landscape(b: &mut Builder, m: &Palette) {
    b.uv_scale = 0.16;
    b.heightfield(m.grass, Vec2::splat(-80.0), Vec2::splat(80.0), [64, 64], ground);
    // A gravel path from the stairs down the slope.
    b.uv_scale = 0.5;
    let path = |t: f32| vec2(3.6 * (t * 2.4).sin() * t, 10.2 + 26.0 * t);
    b.lattice(m.gravel, 7, 61, Shading::Smooth(180.0), |i, j| {
        let t = j as f32 / 60.0;
        let along = (path(t + 0.01) - path(t - 0.01)).normalize();
        let s = 1.0 - i as f32 / 3.0;
        let p = path(t) + vec2(along.y, -along.x) * s * (1.25 + 0.25 * (1.0 - 8.0 * t).max(0.0));
        // The edges dip into the grass, which is a coarser surface.
        let lift = if i == 0 || i == 6 { -0.5 } else { 0.09 };
        (vec3(p.x, ground(p.x, p.y) + lift, p.y), p * 0.5)
    });
    b.uv_scale = 1.0;
}

/// Runs `draw` at `count` places on a circle, from angle `from` to `to` about y, +z being angle 0,
/// with +z pointing outwards.
fn around(b: &mut Builder, radius: f32, count: usize, from: f32, to: f32, mut draw: impl FnMut(&mut Builder, usize)) {
    for k in 0..count {
        let angle = from + (to - from) * k as f32 / (count - 1) as f32;
        let out = Quat::from_rotation_y(angle) * Vec3::Z;
        b.turned(out * radius, angle, |b| draw(b, k));
    }
}

/// Points of an arc about the y axis at a height; +z is angle 0.
fn arc(radius: f32, y: f32, from: f32, to: f32, steps: usize) -> Vec<Vec3> {
    (0..=steps)
        .map(|k| {
            let angle = from + (to - from) * k as f32 / steps as f32;
            vec3(radius * angle.sin(), y, radius * angle.cos())
        })
        .collect()
}

fn terrace(b: &mut Builder, m: &Palette) {
    b.uv_scale = 0.5;
    let r = TERRACE_RADIUS;
    let wall = pairs(&[8.72, -0.6, 8.72, 0.12, 8.6, 0.2, 8.6, 1.0, 8.7, 1.04, 8.7, 1.18, 8.68, TERRACE]);
    b.lathe(m.stone, &wall, 96);
    // The paving as one flat disc, textured from above.
    let disc: Vec<Vec3> = (0..96)
        .map(|k| {
            let angle = k as f32 / 96.0 * TAU;
            vec3((r + 0.08) * angle.cos(), TERRACE, -(r + 0.08) * angle.sin())
        })
        .collect();
    b.polygon(m.paving, &disc);
    let half = 1.4;
    let steps = 8;
    let tread = 0.3;
    for k in 0..steps {
        let y1 = TERRACE - (k + 1) as f32 * 0.15 + 0.0;
        let z0 = r - 0.1;
        let z1 = r + 0.1 + (k + 1) as f32 * tread;
        if y1 > 0.05 {
            // Each step reaches under the one above, its front just proud of it.
            b.cuboid_sides(
                m.paving,
                vec3(-half, y1 - 0.16, z0),
                vec3(half, y1, z1),
                [false, false, false, true, false, true],
            );
        }
    }
    let foot = r + 0.1 + 7.0 * tread + 0.45;
    for s in [-1.0, 1.0] {
        let x = [s * half, s * (half + 0.34)];
        b.cuboid_sides(
            m.stone,
            vec3(x[0].min(x[1]), -0.6, r - 0.1),
            vec3(x[0].max(x[1]), TERRACE + 0.02, r + 0.45),
            [true, true, false, true, false, true],
        );
        let cheek = [vec2(r + 0.45, -0.6), vec2(foot, -0.6), vec2(foot, 0.28), vec2(r + 0.45, TERRACE - 0.05)];
        // The outline is in z and y: a quarter turn brings its x to +z.
        b.with(Mat4::from_rotation_y(-FRAC_PI_2), |b| b.extrude(m.stone, &cheek, -x[0], -x[1], Shading::Flat));
        b.rounded(
            m.stone,
            vec3(s * (half + 0.17) - 0.24, -0.6, foot - 0.03),
            vec3(s * (half + 0.17) + 0.24, 0.62, foot + 0.42),
            0.03,
            1,
        );
        b.icosphere(m.stone, vec3(s * (half + 0.17), 0.78, foot + 0.195), 0.2, 2);
        // The stairs' handrail.
        let x = s * (half + 0.17);
        let rail = [vec3(x, TERRACE + 1.0, r - 0.1), vec3(x, TERRACE + 1.0, r + 0.3), vec3(x, 1.32, foot - 0.1)];
        b.tube(m.dark, &rail, &[0.028; 3], 10, false);
        for (z, y) in [(r + 0.4, TERRACE - 0.05), (r + 1.25, 0.75), (r + 2.15, 0.4)] {
            b.frustum(m.dark, vec3(x, y - 0.2, z), vec3(x, y + 0.99, z), 0.018, 0.018, 8, [false; 2]);
        }
    }
    // The terrace's railing, open at the stairs.
    let gap = 1.62 / (r - 0.1);
    for (y, radius, segments) in [(1.02, 0.03, 8), (0.72, 0.012, 5), (0.44, 0.012, 5), (0.16, 0.012, 5)] {
        let path = arc(r - 0.1, TERRACE + y, gap, TAU - gap, 64);
        b.tube(m.dark, &path, &[radius; 65], segments, false);
    }
    around(b, r - 0.1, 31, gap, TAU - gap, |b, _| {
        b.frustum(m.dark, vec3(0.0, TERRACE - 0.02, 0.0), vec3(0.0, TERRACE + 1.02, 0.0), 0.022, 0.022, 8, [false; 2]);
    });
    around(b, 6.9, 4, 0.75, 2.4, |b, _| bench(b, m));
    around(b, 7.4, 3, -0.45, -0.95, |b, k| {
        if k != 1 {
            b.at(vec3(0.0, TERRACE, 0.0), |b| planter(b, m, k as u64));
        }
    });
    around(b, 7.3, 2, 0.42, 0.5, |b, k| {
        if k == 0 {
            b.at(vec3(0.0, TERRACE, 0.0), |b| viewer(b, m));
        }
    });
    b.uv_scale = 1.0;
}

/// A slatted bench that looks outwards (+z).
fn bench(b: &mut Builder, m: &Palette) {
    let y = TERRACE;
    for k in 0..4 {
        let z = -0.2 + k as f32 * 0.12;
        b.rounded(m.wood, vec3(-0.8, y + 0.42, z), vec3(0.8, y + 0.455, z + 0.095), 0.008, 1);
    }
    for k in 0..3 {
        let (z, up) = (-0.27 - k as f32 * 0.035, y + 0.55 + k as f32 * 0.13);
        b.rounded(m.wood, vec3(-0.8, up, z - 0.03), vec3(0.8, up + 0.095, z), 0.008, 1);
    }
    for x in [-0.6, 0.6] {
        let frame =
            [vec3(x, y - 0.01, 0.2), vec3(x, y + 0.405, 0.2), vec3(x, y + 0.405, -0.2), vec3(x, y + 0.92, -0.37)];
        b.tube(m.dark, &frame, &[0.018; 4], 8, false);
        b.tube(m.dark, &[vec3(x, y - 0.01, -0.28), vec3(x, y + 0.405, -0.19)], &[0.018; 2], 8, false);
    }
}

fn planter(b: &mut Builder, m: &Palette, seed: u64) {
    let bowl = pairs(&[
        0.0, 0.0, 0.26, 0.0, 0.28, 0.06, 0.2, 0.12, 0.24, 0.2, 0.48, 0.42, 0.54, 0.5, 0.54, 0.56, 0.48, 0.56, 0.44,
        0.5, 0.0, 0.48,
    ]);
    b.lathe(m.stone, &bowl, 32);
    shrub(b, m, seed + 40, vec3(0.0, 0.62, 0.0), vec3(0.42, 0.3, 0.42), 130);
}

/// A coin telescope on a post.
fn viewer(b: &mut Builder, m: &Palette) {
    b.lathe(m.dark, &pairs(&[0.0, 0.0, 0.2, 0.0, 0.2, 0.03, 0.06, 0.06, 0.05, 1.1, 0.09, 1.16, 0.0, 1.2]), 20);
    for x in [-0.075, 0.075] {
        b.frustum(m.steel, vec3(x, 1.3, -0.24), vec3(x, 1.24, 0.3), 0.06, 0.07, 16, [true; 2]);
    }
    b.rounded(m.steel, vec3(-0.15, 1.16, -0.16), vec3(0.15, 1.36, 0.14), 0.04, 2);
}

/// A low building behind the terrace, with aerials on its roof.
fn annex(b: &mut Builder, m: &Palette) {
    b.turned(vec3(-9.2, 0.0, -6.4), 0.55, |b| {
        b.uv_scale = 0.5;
        let (w, d, h) = (3.6, 2.3, 3.1);
        b.block(m.wall, vec3(-w, -0.6, -d), vec3(w, h, d));
        b.block(m.stone, vec3(-w - 0.06, -0.6, -d - 0.06), vec3(w + 0.06, 0.4, d + 0.06));
        b.cuboid_sides(
            m.stone,
            vec3(-w - 0.12, h - 0.14, -d - 0.12),
            vec3(w + 0.12, h + 0.1, d + 0.12),
            [true, true, true, false, true, true],
        );
        let rim = [(w + 0.12, d + 0.12), (w - 0.16, d - 0.16)];
        for side in 0..4 {
            let half = |k: usize| if side % 2 == 0 { rim[k] } else { (rim[k].1, rim[k].0) };
            b.turned(Vec3::ZERO, side as f32 * FRAC_PI_2, |b| {
                let (a, c) = (half(0), half(1));
                b.polygon(
                    m.stone,
                    &[
                        vec3(-a.0, h + 0.1, a.1),
                        vec3(a.0, h + 0.1, a.1),
                        vec3(c.0, h + 0.1, c.1),
                        vec3(-c.0, h + 0.1, c.1),
                    ],
                );
                b.polygon(
                    m.stone,
                    &[vec3(c.0, h, c.1), vec3(-c.0, h, c.1), vec3(-c.0, h + 0.1, c.1), vec3(c.0, h + 0.1, c.1)],
                );
            });
        }
        for x in [-2.3, 0.2, 1.7] {
            b.cuboid_sides(
                m.white,
                vec3(x - 0.5, 1.0, d),
                vec3(x + 0.5, 2.3, d + 0.05),
                [true, true, true, true, false, true],
            );
            b.cuboid_sides(
                m.glass,
                vec3(x - 0.42, 1.08, d),
                vec3(x + 0.42, 2.22, d + 0.055),
                [true, true, true, true, false, true],
            );
            b.cuboid_sides(
                m.white,
                vec3(x - 0.02, 1.08, d),
                vec3(x + 0.02, 2.22, d + 0.07),
                [true, true, true, true, false, true],
            );
            b.rounded(m.stone, vec3(x - 0.58, 0.92, d - 0.05), vec3(x + 0.58, 1.01, d + 0.14), 0.015, 1);
        }
        b.cuboid_sides(m.wood, vec3(-1.4, 0.0, d), vec3(-0.5, 2.2, d + 0.09), [true, true, false, true, false, true]);
        b.block(m.paving, vec3(-1.7, -0.3, d + 0.02), vec3(-0.2, 0.06, d + 0.9));
        // A dish on a mount.
        b.at(vec3(2.1, h, -0.6), |b| {
            b.lathe(m.steel, &pairs(&[0.35, -0.01, 0.35, 0.06, 0.1, 0.12, 0.08, 0.9, 0.0, 0.9]), 16);
            let aim = Mat4::from_rotation_translation(
                Quat::from_rotation_y(0.5) * Quat::from_rotation_x(0.85),
                vec3(0.0, 1.0, 0.0),
            );
            b.with(aim, |b| {
                let mut bowl: Vec<Vec2> =
                    (0..=8).map(|k| vec2(k as f32 / 8.0 * 1.1, 0.08 + 0.32 * (k as f32 / 8.0).powi(2))).collect();
                bowl.push(vec2(1.12, 0.41));
                bowl.extend((0..8).rev().map(|k| vec2(k as f32 / 8.0 * 1.1, 0.13 + 0.32 * (k as f32 / 8.0).powi(2))));
                b.lathe(m.white, &bowl, 36);
                b.cylinder(m.dark, vec3(0.0, -0.15, 0.0), 0.14, 0.26, 16);
                for k in 0..3 {
                    let a = k as f32 / 3.0 * TAU;
                    b.frustum(
                        m.dark,
                        vec3(1.0 * a.cos(), 0.38, 1.0 * a.sin()),
                        vec3(0.05 * a.cos(), 1.05, 0.05 * a.sin()),
                        0.014,
                        0.014,
                        6,
                        [false; 2],
                    );
                }
                b.cylinder(m.dark, vec3(0.0, 0.98, 0.0), 0.08, 0.16, 14);
            });
        });
        yagi(b, m, vec3(-2.6, h, -1.2), 2.6, 0.9);
        yagi(b, m, vec3(-1.0, h, 0.9), 1.9, -0.4);
        b.uv_scale = 1.0;
    });
}

/// A pole with a comb aerial.
fn yagi(b: &mut Builder, m: &Palette, at: Vec3, height: f32, turn: f32) {
    b.turned(at, turn, |b| {
        b.frustum(m.steel, vec3(0.0, -0.01, 0.0), vec3(0.0, height, 0.0), 0.025, 0.02, 8, [false, true]);
        b.frustum(m.steel, vec3(-0.7, height - 0.15, 0.0), vec3(0.9, height - 0.15, 0.0), 0.015, 0.015, 6, [true; 2]);
        for k in 0..9 {
            let x = -0.65 + k as f32 * 0.18;
            let half = 0.42 - 0.025 * k as f32;
            b.frustum(m.steel, vec3(x, height - 0.13, -half), vec3(x, height - 0.13, half), 0.007, 0.007, 5, [true; 2]);
        }
    });
}

/// A three-sided lattice mast with guys.
fn mast(b: &mut Builder, m: &Palette) {
    let bays = 26;
    let step = 0.55;
    let corner = |k: usize, level: f32| {
        let angle = k as f32 / 3.0 * TAU + PI / 3.0;
        let radius = 0.42 - 0.18 * level / bays as f32;
        vec3(radius * angle.cos(), 0.25 + level * step, radius * angle.sin())
    };
    b.block(m.stone, vec3(-0.7, -0.8, -0.7), vec3(0.7, 0.26, 0.7));
    for band in 0..bays {
        let paint = if band / 4 % 2 == 0 { m.red } else { m.white };
        let (low, high) = (band as f32, band as f32 + 1.0);
        for k in 0..3 {
            let next = (k + 1) % 3;
            b.frustum(paint, corner(k, low), corner(k, high), 0.032, 0.032, 6, [false; 2]);
            b.frustum(paint, corner(k, high), corner(next, high), 0.014, 0.014, 5, [false; 2]);
            let (from, to) = if band % 2 == 0 { (k, next) } else { (next, k) };
            b.frustum(paint, corner(from, low), corner(to, high), 0.014, 0.014, 5, [false; 2]);
        }
    }
    let top = 0.25 + bays as f32 * step;
    b.frustum(m.white, vec3(0.0, top - 0.02, 0.0), vec3(0.0, top + 2.4, 0.0), 0.03, 0.012, 8, [false, true]);
    for (k, y) in [(0, 4.2), (1, 8.0), (2, 11.5)] {
        let angle = k as f32 * 2.1;
        b.turned(vec3(0.0, y, 0.0), angle, |b| {
            b.frustum(m.steel, vec3(0.2, 0.0, 0.0), vec3(0.62, 0.0, 0.0), 0.03, 0.03, 8, [false; 2]);
            b.frustum(m.white, vec3(0.6, 0.0, 0.0), vec3(0.85, 0.0, 0.0), 0.3, 0.4, 24, [true; 2]);
        });
    }
    for k in 0..3 {
        let angle = k as f32 / 3.0 * TAU + PI / 3.0;
        let foot = vec3(6.0 * angle.cos(), -0.3, 6.0 * angle.sin());
        for level in [13.0, 24.0] {
            b.frustum(m.steel, corner(k, level), foot, 0.011, 0.011, 5, [false; 2]);
        }
        b.block(m.stone, foot - vec3(0.25, 0.6, 0.25), foot + vec3(0.25, 0.25, 0.25));
    }
}

/// A cloud of leaves around a middle.
fn shrub(b: &mut Builder, m: &Palette, seed: u64, middle: Vec3, radii: Vec3, count: usize) {
    let mut rng = Rng::new(seed);
    b.blob(m.thicket, 1, 180.0, |d| middle + d * radii * 0.82);
    b.leaves(m.bush, &mut rng, count, 0.22, |rng| {
        let d = rng.direction();
        (middle + d * radii * rng.range(0.72, 0.95), d)
    });
}

fn plants(b: &mut Builder, m: &Palette) {
    let mut rng = Rng::new(77);
    let pines = [
        (11.5, -6.0, 7.5),
        (14.0, -1.5, 6.0),
        (9.0, -10.5, 8.5),
        (1.5, -14.5, 7.0),
        (-4.5, -14.0, 8.0),
        (17.5, -9.0, 9.0),
        (-18.5, -3.0, 7.0),
        (-13.0, 14.5, 5.5),
        (15.5, 6.5, 5.0),
        (-23.5, 8.0, 8.0),
    ];
    for (x, z, height) in pines {
        b.turned(vec3(x, ground(x, z) - 0.1, z), rng.range(0.0, TAU), |b| pine(b, m, &mut rng, height));
    }
    for (k, (x, z, r)) in [
        (9.3, 4.6, 0.8),
        (10.2, 3.2, 0.6),
        (-4.2, 10.4, 0.7),
        (4.4, 10.3, 0.65),
        (5.6, 9.9, 0.45),
        (-12.6, 9.2, 0.7),
        (-7.2, 8.9, 0.55),
    ]
    .into_iter()
    .enumerate()
    {
        let y = ground(x, z);
        shrub(b, m, k as u64, vec3(x, y + 0.45 * r, z), vec3(r, r * 0.8, r), 160);
    }
}

fn pine(b: &mut Builder, m: &Palette, rng: &mut Rng, height: f32) {
    b.frustum(m.bark, vec3(0.0, -0.3, 0.0), vec3(0.0, height * 0.96, 0.0), 0.035 * height, 0.01, 9, [false, true]);
    let whorls = 11;
    for k in 0..whorls {
        let t = k as f32 / whorls as f32;
        let y = height * (0.14 + 0.82 * t);
        let reach = height * 0.27 * (1.0 - t).powf(0.85) + 0.12;
        let count = 7;
        for n in 0..count {
            let angle = (n as f32 + 0.5 * (k % 2) as f32) / count as f32 * TAU + rng.range(-0.2, 0.2);
            let length = reach * rng.range(0.8, 1.1);
            let droop = rng.range(0.25, 0.45);
            b.turned(vec3(0.0, y, 0.0), angle, |b| {
                b.lattice(m.needles, 3, 4, Shading::Smooth(60.0), |i, j| {
                    let (s, u) = (i as f32 - 1.0, j as f32 / 3.0);
                    let width = length * 0.36 * (u * (1.0 - u * 0.8) * 3.2).min(1.0);
                    let sag = -droop * length * u * u - s.abs() * width * 0.45 + 0.1 * length * u;
                    (vec3(length * u, sag, -s * width), vec2(u, s))
                });
            });
        }
    }
}
