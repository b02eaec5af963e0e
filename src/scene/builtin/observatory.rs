//! An observatory with an open dome on a round terrace, a lattice mast and pines, on a hill's top.

use super::builder::{Builder, CREASED, Rng, Shading, camera, fbm, light};
use crate::light::Light;
use crate::scene::Scene;
use glam::{Mat4, Quat, Vec2, Vec3, vec2, vec3};
use std::f32::consts::{FRAC_PI_2, PI, TAU};

/// What the scene shows.
pub const DESCRIPTION: &str =
    "An observatory with an open dome, a lattice mast and pines on a hill's top";

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
        dome: b.material("painted steel dome", 0xe9edf0),
        inner: b.material("dome's inside", 0x9aa7b0),
        dark: b.material("dark paint", 0x3a434c),
        steel: b.material("galvanised steel", 0xaab2b8),
        red: b.material("signal red", 0xc2452f),
        white: b.material("white paint", 0xf0efe9),
        wood: b.textured("teak", 0x9a6b43, plaster),
        bark: b.textured("bark", 0x6c513c, plaster),
        needles: b.double_sided("needles", 0x3f6a48),
        bush: b.double_sided("shrub", 0x6f8f45),
        glass: b.material("window glass", 0x51697a),
    };
    landscape(&mut b, &m);
    terrace(&mut b, &m);
    drum(&mut b, &m);
    b.turned(vec3(0.0, SPRING, 0.0), AZIMUTH, |b| dome(b, &m));
    b.turned(vec3(0.0, FLOOR, 0.0), AZIMUTH, |b| telescope(b, &m));
    annex(&mut b, &m);
    b.at(vec3(-11.2, ground(-11.2, 3.4), 3.4), |b| mast(b, &m));
    plants(&mut b, &m);
    b.finish(
        vec![
            camera("path", vec3(8.6, 2.1, 18.6), vec3(-1.6, 4.3, 0.0), 50.0, 0.1, 250.0),
            camera("terrace", vec3(4.7, 2.85, 6.6), vec3(-1.2, 3.3, -0.6), 66.0, 0.05, 250.0),
            camera("telescope", vec3(-2.9, 4.5, -1.9), vec3(0.5, 5.5, 0.7), 72.0, 0.05, 120.0),
            camera("mast", vec3(-16.0, 2.2, 9.0), vec3(-8.0, 5.2, 0.5), 58.0, 0.1, 250.0),
            camera("aerial", vec3(21.0, 17.0, 19.0), vec3(-1.5, 1.8, 0.0), 42.0, 0.5, 300.0),
        ],
        vec![
            light("evening sun", Light::Directional { to_light: vec3(-0.78, 0.5, 0.62), color: vec3(1.0, 0.88, 0.7) * 1.3 }),
            light("noon sun", Light::Directional { to_light: vec3(0.3, 1.0, 0.45), color: vec3(1.0, 0.97, 0.92) * 1.2 }),
            light("dome lamp", Light::Omni { position: vec3(-1.6, 7.2, -1.2), range: 30.0, color: vec3(9.0, 4.6, 3.0) }),
            light("floodlight", Light::Spot { position: vec3(9.5, 6.5, 10.5), direction: vec3(-9.5, -2.6, -10.5), outer_angle: 32.0, range: 60.0, color: vec3(170.0, 165.0, 150.0) }),
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
    b.heightfield(m.grass, Vec2::splat(-80.0), Vec2::splat(80.0), [80, 80], ground);
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
    let profile = [(r + 0.12, -0.6), (r + 0.12, 0.12), (r, 0.2), (r, 1.0), (r + 0.1, 1.04), (r + 0.1, TERRACE - 0.02), (r + 0.08, TERRACE)];
    b.lathe(m.stone, &profile.map(|(r, y)| vec2(r, y)), 96);
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
            b.cuboid_sides(m.paving, vec3(-half, y1 - 0.16, z0), vec3(half, y1, z1), [false, false, false, true, false, true]);
        }
    }
    let foot = r + 0.1 + 7.0 * tread + 0.45;
    for s in [-1.0, 1.0] {
        let x = [s * half, s * (half + 0.34)];
        b.cuboid_sides(m.stone, vec3(x[0].min(x[1]), -0.6, r - 0.1), vec3(x[0].max(x[1]), TERRACE + 0.02, r + 0.45), [true, true, false, true, false, true]);
        let cheek = [vec2(r + 0.45, -0.6), vec2(foot, -0.6), vec2(foot, 0.28), vec2(r + 0.45, TERRACE - 0.05)];
        // The outline is in z and y: a quarter turn brings its x to +z.
        b.with(Mat4::from_rotation_y(-FRAC_PI_2), |b| b.extrude(m.stone, &cheek, -x[0], -x[1], Shading::Flat));
        b.rounded(m.stone, vec3(s * (half + 0.17) - 0.24, -0.6, foot - 0.03), vec3(s * (half + 0.17) + 0.24, 0.62, foot + 0.42), 0.03, 1);
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
        let path = arc(r - 0.1, TERRACE + y, gap, TAU - gap, 90);
        b.tube(m.dark, &path, &[radius; 91], segments, false);
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
        let frame = [vec3(x, y - 0.01, 0.2), vec3(x, y + 0.405, 0.2), vec3(x, y + 0.405, -0.2), vec3(x, y + 0.92, -0.37)];
        b.tube(m.dark, &frame, &[0.018; 4], 8, false);
        b.tube(m.dark, &[vec3(x, y - 0.01, -0.28), vec3(x, y + 0.405, -0.19)], &[0.018; 2], 8, false);
    }
}

fn planter(b: &mut Builder, m: &Palette, seed: u64) {
    let bowl = [(0.0, 0.0), (0.26, 0.0), (0.28, 0.06), (0.2, 0.12), (0.24, 0.2), (0.48, 0.42), (0.54, 0.5), (0.54, 0.56), (0.48, 0.56), (0.44, 0.5), (0.0, 0.48)];
    b.lathe(m.stone, &bowl.map(|(r, y)| vec2(r, y)), 32);
    shrub(b, m, seed + 40, vec3(0.0, 0.62, 0.0), vec3(0.42, 0.34, 0.42), 260);
}

/// A coin telescope on a post.
fn viewer(b: &mut Builder, m: &Palette) {
    b.lathe(m.dark, &[(0.0, 0.0), (0.2, 0.0), (0.2, 0.03), (0.06, 0.06), (0.05, 1.1), (0.09, 1.16), (0.0, 1.2)].map(|(r, y)| vec2(r, y)), 20);
    for x in [-0.075, 0.075] {
        b.frustum(m.steel, vec3(x, 1.3, -0.24), vec3(x, 1.24, 0.3), 0.06, 0.07, 16, [true; 2]);
    }
    b.rounded(m.steel, vec3(-0.15, 1.16, -0.16), vec3(0.15, 1.36, 0.14), 0.04, 2);
}

fn drum(b: &mut Builder, m: &Palette) {
    b.uv_scale = 0.5;
    let r = DOME - 0.1;
    let base = [(r + 0.16, TERRACE - 0.05), (r + 0.16, TERRACE + 0.42), (r + 0.1, TERRACE + 0.5), (r + 0.1, TERRACE + 0.52)];
    b.lathe(m.stone, &base.map(|(r, y)| vec2(r, y)), 80);
    b.lathe(m.wall, &[vec2(r + 0.02, TERRACE + 0.4), vec2(r + 0.02, SPRING - 0.3)], 80);
    let crown = [(r, SPRING - 0.46), (r + 0.1, SPRING - 0.44), (r + 0.14, SPRING - 0.34), (r + 0.26, SPRING - 0.26), (r + 0.3, SPRING - 0.22), (r + 0.3, SPRING - 0.08), (r - 0.35, SPRING - 0.08), (r - 0.35, FLOOR - 0.02)];
    b.lathe(m.stone, &crown.map(|(r, y)| vec2(r, y)), 80);
    b.lathe(m.stone, &[vec2(r + 0.1, TERRACE + 0.52), vec2(r, TERRACE + 0.54)], 80);
    b.lathe(m.wood, &[vec2(r - 0.34, FLOOR), vec2(0.0, FLOOR)], 48);
    // The track and the skirt on which the dome turns.
    b.lathe(m.dark, &[(r + 0.1, SPRING - 0.1), (r + 0.1, SPRING - 0.03), (r + 0.26, SPRING - 0.03), (r + 0.26, SPRING + 0.14), (r + 0.1, SPRING + 0.16)].map(|(r, y)| vec2(r, y)), 80);
    b.lathe(m.dark, &[(r - 0.02, SPRING + 0.14), (r - 0.16, SPRING + 0.12), (r - 0.16, SPRING - 0.1)].map(|(r, y)| vec2(r, y)), 80);
    // Pilasters and windows between; the door where the stairs arrive.
    around(b, r, 17, 0.0, TAU, |b, k| {
        let out = 0.1;
        if k % 2 == 1 {
            b.cuboid_sides(m.stone, vec3(-0.2, TERRACE + 0.5, -0.1), vec3(0.2, SPRING - 0.4, out), [true, true, false, false, false, true]);
        } else if k == 0 {
            b.cuboid_sides(m.stone, vec3(-0.75, TERRACE - 0.02, -0.2), vec3(0.75, TERRACE + 2.45, 0.3), [true, true, false, true, false, true]);
            b.rounded(m.stone, vec3(-0.95, TERRACE + 2.43, -0.2), vec3(0.95, TERRACE + 2.58, 0.55), 0.02, 1);
            b.cuboid_sides(m.wood, vec3(-0.55, TERRACE - 0.02, 0.0), vec3(0.55, TERRACE + 2.2, 0.33), [true, true, false, true, false, true]);
            for x in [-0.47, 0.04] {
                for (y0, y1) in [(0.2, 0.95), (1.1, 2.05)] {
                    b.rounded(m.wood, vec3(x, TERRACE + y0, 0.2), vec3(x + 0.43, TERRACE + y1, 0.35), 0.015, 1);
                }
            }
            b.icosphere(m.steel, vec3(0.03, TERRACE + 1.03, 0.37), 0.035, 1);
        } else if k < 16 {
            let (y0, y1) = (TERRACE + 1.2, TERRACE + 2.7);
            b.cuboid_sides(m.stone, vec3(-0.5, y0 - 0.12, -0.2), vec3(0.5, y1 + 0.12, 0.09), [true, true, true, true, false, true]);
            b.rounded(m.stone, vec3(-0.58, y0 - 0.14, -0.2), vec3(0.58, y0 - 0.06, 0.16), 0.015, 1);
            b.cuboid_sides(m.glass, vec3(-0.38, y0, -0.2), vec3(0.38, y1, 0.095), [true, true, true, true, false, true]);
            for (a, c) in [(vec3(-0.02, y0, 0.0), vec3(0.02, y1, 0.115)), (vec3(-0.38, y0 + 0.5, 0.0), vec3(0.38, y0 + 0.53, 0.11)), (vec3(-0.38, y0 + 1.0, 0.0), vec3(0.38, y0 + 1.03, 0.11))] {
                b.cuboid_sides(m.white, a, c, [true, true, true, true, false, true]);
            }
        }
    });
    b.uv_scale = 1.0;
}

/// A point of the dome: `x` across the slit, `step` of [`ARC`] from front to back, at `radius`.
fn shell(x: f32, step: f32, radius: f32) -> Vec3 {
    let angle = step / ARC as f32 * PI;
    let rho = (radius * radius - x * x).max(0.0).sqrt();
    vec3(x, rho * angle.sin(), rho * angle.cos())
}

/// A curved plate between x = `x` and steps `steps` of the dome, from radius `r0` to `r1`.
fn plate(b: &mut Builder, material: u32, x: [f32; 2], cells: usize, steps: [usize; 2], r: [f32; 2]) {
    // Once around the cross-section: outside from x[0] to x[1], inside back.
    let around: Vec<(f32, f32)> = (0..=cells)
        .map(|i| (x[0] + (x[1] - x[0]) * i as f32 / cells as f32, r[1]))
        .chain((0..=cells).map(|i| (x[1] + (x[0] - x[1]) * i as f32 / cells as f32, r[0])))
        .chain([(x[0], r[1])])
        .collect();
    let count = steps[1] - steps[0] + 1;
    b.lattice(material, count, around.len(), CREASED, |i, j| {
        let (x, r) = around[j];
        let p = shell(x, (steps[1] - i) as f32, r);
        (p, vec2(i as f32, j as f32) * 0.2)
    });
    for (step, flip) in [(steps[0], false), (steps[1], true)] {
        b.lattice(material, cells + 1, 2, Shading::Flat, |i, j| {
            let t = i as f32 / cells as f32;
            let at = if flip { x[1] + (x[0] - x[1]) * t } else { x[0] + (x[1] - x[0]) * t };
            (shell(at, step as f32, r[j]), vec2(t, j as f32))
        });
    }
}

/// The dome around its springing's middle, its slit over +z.
fn dome(b: &mut Builder, m: &Palette) {
    let (outer, inner) = (DOME, DOME - SHELL);
    let bands = 12;
    for s in [-1.0, 1.0] {
        b.with(Mat4::from_scale(vec3(s, 1.0, 1.0)), |b| {
            for (radius, material, out) in [(outer, m.dome, true), (inner, m.inner, false)] {
                let start = (SLIT / radius).asin();
                b.lattice(material, ARC + 1, bands + 1, Shading::Smooth(180.0), |i, j| {
                    let step = if out { ARC - i } else { i };
                    let angle = start + (FRAC_PI_2 - start) * j as f32 / bands as f32;
                    let x = if j == bands { radius } else { radius * angle.sin() };
                    let x = if j == 0 { SLIT } else { x };
                    (shell(x, step as f32, radius), vec2(i as f32, j as f32) * 0.2)
                });
            }
            // The shell's edge along the slit.
            b.lattice(m.dome, SLIT_TO - SLIT_FROM + 1, 2, Shading::Smooth(40.0), |i, j| {
                let p = shell(SLIT, (SLIT_FROM + i) as f32, [outer, inner][j]);
                (p, vec2(i as f32, j as f32))
            });
            // The half shutter, slid aside, and its rails.
            let shutter = [SLIT + 0.08, SLIT + 0.92];
            plate(b, m.dome, shutter, 4, [SLIT_FROM - 1, SLIT_TO + 1], [outer + 0.13, outer + 0.18]);
            let curb: Vec<Vec3> = (2 * (SLIT_FROM - 2)..=2 * (SLIT_TO + 4))
                .map(|k| shell(SLIT + 0.03, k as f32 * 0.5, outer + 0.03))
                .collect();
            b.tube(m.dark, &curb, &vec![0.06; curb.len()], 8, false);
            for step in [SLIT_FROM, SLIT_TO] {
                let rail: Vec<Vec3> = (0..=12)
                    .map(|k| shell(SLIT + 1.1 * k as f32 / 12.0, step as f32, outer + 0.06))
                    .collect();
                b.tube(m.dark, &rail, &[0.055; 13], 8, false);
            }
            // Seams of the plates.
            for x in [1.9f32, 2.75, 3.45] {
                let seam: Vec<Vec3> = (0..=40).map(|k| shell(x, k as f32 * 1.5, outer)).collect();
                b.tube(m.dome, &seam, &[0.03; 41], 6, false);
            }
        });
    }
    for (from, to, end, flip) in [(0, SLIT_FROM, SLIT_FROM, true), (SLIT_TO, ARC, SLIT_TO, false)] {
        for (radius, material, out) in [(outer, m.dome, true), (inner, m.inner, false)] {
            b.lattice(material, to - from + 1, 5, Shading::Smooth(180.0), |i, j| {
                let x = (j as f32 / 2.0 - 1.0) * if out { -SLIT } else { SLIT };
                (shell(x, (from + i) as f32, radius), vec2(i as f32, j as f32) * 0.2)
            });
        }
        b.lattice(m.dome, 5, 2, Shading::Flat, |i, j| {
            let x = (i as f32 / 2.0 - 1.0) * if flip { -SLIT } else { SLIT };
            (shell(x, end as f32, [inner, outer][j]), vec2(i as f32, j as f32))
        });
    }
}

/// A reflector in a fork on a pier, standing on the origin and pointing through the slit.
fn telescope(b: &mut Builder, m: &Palette) {
    b.lathe(m.steel, &[(0.75, -0.02), (0.75, 0.1), (0.5, 0.2), (0.45, 0.7), (0.6, 0.76), (0.62, 0.82), (0.0, 0.82)].map(|(r, y)| vec2(r, y)), 32);
    b.lathe(m.dark, &[(0.7, 0.8), (0.72, 0.84), (0.72, 0.98), (0.66, 1.02), (0.0, 1.02)].map(|(r, y)| vec2(r, y)), 32);
    let pivot = 2.1;
    for s in [-1.0, 1.0] {
        let arm = [vec2(-0.35, 0.98), vec2(0.35, 0.98), vec2(0.24, 1.5), vec2(0.2, pivot + 0.05), vec2(0.0, pivot + 0.25), vec2(-0.2, pivot + 0.05), vec2(-0.24, 1.5)];
        b.with(Mat4::from_translation(vec3(s * 0.82, 0.0, 0.0)) * Mat4::from_rotation_y(FRAC_PI_2), |b| {
            b.extrude(m.steel, &arm, -0.09, 0.09, Shading::Flat);
        });
        b.frustum(m.dark, vec3(s * 0.55, pivot, 0.0), vec3(s * 0.96, pivot, 0.0), 0.16, 0.16, 24, [false, true]);
    }
    // The tube's axis is the local y.
    let tilt = Mat4::from_rotation_translation(Quat::from_rotation_x(0.72), vec3(0.0, pivot, 0.0));
    b.with(tilt, |b| {
        let tub = [(0.0, -0.95), (0.5, -0.95), (0.58, -0.88), (0.6, -0.86), (0.6, -0.2), (0.64, -0.18), (0.64, 0.2), (0.6, 0.22), (0.6, 0.42), (0.65, 0.44), (0.65, 0.52), (0.56, 0.52), (0.56, -0.7), (0.0, -0.66)];
        b.lathe(m.white, &tub.map(|(r, y)| vec2(r, y)), 40);
        let top = [(0.56, 2.3), (0.62, 2.28), (0.62, 2.72), (0.66, 2.74), (0.66, 2.8), (0.58, 2.8), (0.56, 2.3)];
        b.lathe(m.white, &top.map(|(r, y)| vec2(r, y)), 40);
        for k in 0..8 {
            let (a, c) = (k as f32 / 8.0 * TAU, (k as f32 + if k % 2 == 0 { 1.0 } else { -1.0 }) / 8.0 * TAU);
            let (foot, head) = (vec3(a.cos(), 0.0, a.sin()) * 0.61 + Vec3::Y * 0.5, vec3(c.cos(), 0.0, c.sin()) * 0.59 + Vec3::Y * 2.32);
            let head = head.lerp(vec3(a.cos(), 0.0, a.sin()) * 0.59 + Vec3::Y * 2.32, 0.3);
            b.frustum(m.dark, foot, head, 0.025, 0.025, 8, [false; 2]);
        }
        for k in 0..4 {
            let a = k as f32 * FRAC_PI_2;
            let out = vec3(a.cos(), 0.0, a.sin());
            b.frustum(m.dark, out * 0.14 + Vec3::Y * 2.5, out * 0.6 + Vec3::Y * 2.5, 0.012, 0.012, 6, [false; 2]);
        }
        b.cylinder(m.dark, vec3(0.0, 2.36, 0.0), 0.16, 0.3, 20);
        // Instruments at the foot, and a finder.
        b.rounded(m.dark, vec3(-0.25, -1.35, -0.25), vec3(0.25, -0.9, 0.25), 0.03, 2);
        b.frustum(m.red, vec3(0.0, -0.3, -0.74), vec3(0.0, 1.3, -0.74), 0.08, 0.08, 16, [true; 2]);
        for y in [-0.1, 0.35] {
            b.cuboid(m.dark, vec3(-0.03, y, -0.7), vec3(0.03, y + 0.06, -0.58));
        }
    });
    // Astronomers' steps.
    b.turned(vec3(-1.9, 0.0, 1.0), 2.4, |b| {
        for k in 0..4 {
            let y = 0.25 * (k + 1) as f32;
            b.rounded(m.wood, vec3(-0.35, y - 0.04, 0.25 * k as f32 - 0.02), vec3(0.35, y, 0.25 * (k + 1) as f32), 0.008, 1);
        }
        for x in [-0.36, 0.36] {
            b.tube(m.dark, &[vec3(x, -0.01, -0.05), vec3(x, 0.98, 0.95), vec3(x, -0.01, 1.0)], &[0.02; 3], 8, false);
            b.tube(m.dark, &[vec3(x, 0.55, 0.6), vec3(x, 1.6, 0.6), vec3(x, 1.95, 0.95), vec3(x, 0.95, 0.95)], &[0.015; 4], 8, false);
        }
    });
}

/// A low building behind the terrace, with aerials on its roof.
fn annex(b: &mut Builder, m: &Palette) {
    b.turned(vec3(-9.2, 0.0, -6.4), 0.55, |b| {
        b.uv_scale = 0.5;
        let (w, d, h) = (3.6, 2.3, 3.1);
        b.block(m.wall, vec3(-w, -0.6, -d), vec3(w, h, d));
        b.block(m.stone, vec3(-w - 0.06, -0.6, -d - 0.06), vec3(w + 0.06, 0.4, d + 0.06));
        b.cuboid_sides(m.stone, vec3(-w - 0.12, h - 0.14, -d - 0.12), vec3(w + 0.12, h + 0.1, d + 0.12), [true, true, true, false, true, true]);
        let rim = [(w + 0.12, d + 0.12), (w - 0.16, d - 0.16)];
        for side in 0..4 {
            let half = |k: usize| if side % 2 == 0 { rim[k] } else { (rim[k].1, rim[k].0) };
            b.turned(Vec3::ZERO, side as f32 * FRAC_PI_2, |b| {
                let (a, c) = (half(0), half(1));
                b.polygon(m.stone, &[vec3(-a.0, h + 0.1, a.1), vec3(a.0, h + 0.1, a.1), vec3(c.0, h + 0.1, c.1), vec3(-c.0, h + 0.1, c.1)]);
                b.polygon(m.stone, &[vec3(c.0, h, c.1), vec3(-c.0, h, c.1), vec3(-c.0, h + 0.1, c.1), vec3(c.0, h + 0.1, c.1)]);
            });
        }
        for x in [-2.3, 0.2, 1.7] {
            b.cuboid_sides(m.white, vec3(x - 0.5, 1.0, d), vec3(x + 0.5, 2.3, d + 0.05), [true, true, true, true, false, true]);
            b.cuboid_sides(m.glass, vec3(x - 0.42, 1.08, d), vec3(x + 0.42, 2.22, d + 0.055), [true, true, true, true, false, true]);
            b.cuboid_sides(m.white, vec3(x - 0.02, 1.08, d), vec3(x + 0.02, 2.22, d + 0.07), [true, true, true, true, false, true]);
            b.rounded(m.stone, vec3(x - 0.58, 0.92, d - 0.05), vec3(x + 0.58, 1.01, d + 0.14), 0.015, 1);
        }
        b.cuboid_sides(m.wood, vec3(-1.4, 0.0, d), vec3(-0.5, 2.2, d + 0.09), [true, true, false, true, false, true]);
        b.block(m.paving, vec3(-1.7, -0.3, d + 0.02), vec3(-0.2, 0.06, d + 0.9));
        // A dish on a mount.
        b.at(vec3(2.1, h, -0.6), |b| {
            b.lathe(m.steel, &[(0.35, -0.01), (0.35, 0.06), (0.1, 0.12), (0.08, 0.9), (0.0, 0.9)].map(|(r, y)| vec2(r, y)), 16);
            let aim = Mat4::from_rotation_translation(Quat::from_rotation_y(0.5) * Quat::from_rotation_x(0.85), vec3(0.0, 1.0, 0.0));
            b.with(aim, |b| {
                let mut bowl: Vec<Vec2> = (0..=8).map(|k| vec2(k as f32 / 8.0 * 1.1, 0.08 + 0.32 * (k as f32 / 8.0).powi(2))).collect();
                bowl.push(vec2(1.12, 0.41));
                bowl.extend((0..8).rev().map(|k| vec2(k as f32 / 8.0 * 1.1, 0.13 + 0.32 * (k as f32 / 8.0).powi(2))));
                b.lathe(m.white, &bowl, 36);
                b.cylinder(m.dark, vec3(0.0, -0.15, 0.0), 0.14, 0.26, 16);
                for k in 0..3 {
                    let a = k as f32 / 3.0 * TAU;
                    b.frustum(m.dark, vec3(1.0 * a.cos(), 0.38, 1.0 * a.sin()), vec3(0.05 * a.cos(), 1.05, 0.05 * a.sin()), 0.014, 0.014, 6, [false; 2]);
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
        let angle = k as f32 / 3.0 * TAU + 0.3;
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
        let angle = k as f32 / 3.0 * TAU + 0.3;
        let foot = vec3(7.0 * angle.cos(), -0.3, 7.0 * angle.sin());
        for level in [13.0, 24.0] {
            b.frustum(m.steel, corner(k, level), foot, 0.011, 0.011, 5, [false; 2]);
        }
        b.block(m.stone, foot - vec3(0.25, 0.6, 0.25), foot + vec3(0.25, 0.25, 0.25));
    }
}

/// A cloud of leaves around a middle.
fn shrub(b: &mut Builder, m: &Palette, seed: u64, middle: Vec3, radii: Vec3, count: usize) {
    let mut rng = Rng::new(seed);
    b.leaves(m.bush, &mut rng, count, 0.17, |rng| {
        let d = rng.direction();
        (middle + d * radii * rng.range(0.55, 1.0), d)
    });
}

fn plants(b: &mut Builder, m: &Palette) {
    let mut rng = Rng::new(77);
    let pines = [(11.5, -6.0, 7.5), (14.0, -1.5, 6.0), (9.0, -10.5, 8.5), (1.5, -14.5, 7.0), (-4.5, -14.0, 8.0), (17.5, -9.0, 9.0), (-18.5, -3.0, 7.0), (-13.0, 14.5, 5.5), (15.5, 6.5, 5.0), (-21.0, 6.0, 8.0)];
    for (x, z, height) in pines {
        b.turned(vec3(x, ground(x, z) - 0.1, z), rng.range(0.0, TAU), |b| pine(b, m, &mut rng, height));
    }
    for (k, (x, z, r)) in [(9.3, 4.6, 0.8), (10.2, 3.2, 0.6), (-4.2, 10.4, 0.7), (4.4, 10.3, 0.65), (5.6, 9.9, 0.45), (-9.9, -1.8, 0.7), (-7.2, 8.9, 0.55)].into_iter().enumerate() {
        let y = ground(x, z);
        shrub(b, m, k as u64, vec3(x, y + 0.5 * r, z), vec3(r, r * 0.8, r), 220);
    }
}

fn pine(b: &mut Builder, m: &Palette, rng: &mut Rng, height: f32) {
    b.frustum(m.bark, vec3(0.0, -0.3, 0.0), vec3(0.0, height * 0.96, 0.0), 0.035 * height, 0.01, 9, [false, true]);
    let whorls = 13;
    for k in 0..whorls {
        let t = k as f32 / whorls as f32;
        let y = height * (0.14 + 0.82 * t);
        let reach = height * 0.27 * (1.0 - t).powf(0.85) + 0.12;
        let count = 8;
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
