//! The drum, the dome on it and the telescope inside.

use super::{ARC, DOME, FLOOR, Palette, SHELL, SLIT, SLIT_FROM, SLIT_TO, SPRING, TERRACE, around};
use crate::scene::builtin::builder::{Builder, CREASED, Shading, pairs};
use glam::{Mat4, Quat, Vec3, vec2, vec3};
use std::f32::consts::{FRAC_PI_2, PI, TAU};

pub(super) fn drum(b: &mut Builder, m: &Palette) {
    b.uv_scale = 0.5;
    let r = DOME - 0.1;
    b.lathe(m.stone, &pairs(&[4.16, 1.15, 4.16, 1.62, 4.1, 1.7, 4.1, 1.72, 4.0, 1.74]), 80);
    b.lathe(m.wall, &pairs(&[4.02, 1.6, 4.02, 4.6]), 80);
    b.at(Vec3::Y * SPRING, |b| {
        let cornice = [
            4.0,
            -0.46,
            4.1,
            -0.44,
            4.14,
            -0.34,
            4.26,
            -0.26,
            4.3,
            -0.22,
            4.3,
            -0.08,
            3.65,
            -0.08,
            3.65,
            FLOOR - SPRING,
        ];
        b.lathe(m.stone, &pairs(&cornice), 80);
        // The track and the skirt on which the dome turns.
        b.lathe(m.dark, &pairs(&[4.1, -0.1, 4.1, -0.03, 4.26, -0.03, 4.26, 0.14, 4.1, 0.16]), 80);
        b.lathe(m.dark, &pairs(&[3.98, 0.14, 3.84, 0.12, 3.84, -0.1]), 80);
    });
    b.lathe(m.wood, &pairs(&[3.66, FLOOR, 0.0, FLOOR]), 48);
    // Pilasters and windows between; the door where the stairs arrive.
    around(b, r, 17, 0.0, TAU, |b, k| {
        let out = 0.1;
        if k % 2 == 1 {
            b.cuboid_sides(
                m.stone,
                vec3(-0.2, TERRACE + 0.5, -0.1),
                vec3(0.2, SPRING - 0.4, out),
                [true, true, false, false, false, true],
            );
        } else if k == 0 {
            b.cuboid_sides(
                m.stone,
                vec3(-0.75, TERRACE - 0.02, -0.2),
                vec3(0.75, TERRACE + 2.45, 0.3),
                [true, true, false, true, false, true],
            );
            b.rounded(m.stone, vec3(-0.95, TERRACE + 2.43, -0.2), vec3(0.95, TERRACE + 2.58, 0.55), 0.02, 1);
            b.cuboid_sides(
                m.wood,
                vec3(-0.55, TERRACE - 0.02, 0.0),
                vec3(0.55, TERRACE + 2.2, 0.33),
                [true, true, false, true, false, true],
            );
            for x in [-0.47, 0.04] {
                for (y0, y1) in [(0.2, 0.95), (1.1, 2.05)] {
                    b.rounded(m.wood, vec3(x, TERRACE + y0, 0.2), vec3(x + 0.43, TERRACE + y1, 0.35), 0.015, 1);
                }
            }
            b.icosphere(m.steel, vec3(0.03, TERRACE + 1.03, 0.37), 0.035, 1);
        } else if k < 16 {
            let (y0, y1) = (TERRACE + 1.2, TERRACE + 2.7);
            b.cuboid_sides(
                m.stone,
                vec3(-0.5, y0 - 0.12, -0.2),
                vec3(0.5, y1 + 0.12, 0.09),
                [true, true, true, true, false, true],
            );
            b.rounded(m.stone, vec3(-0.58, y0 - 0.14, -0.2), vec3(0.58, y0 - 0.06, 0.16), 0.015, 1);
            b.cuboid_sides(
                m.glass,
                vec3(-0.38, y0, -0.2),
                vec3(0.38, y1, 0.095),
                [true, true, true, true, false, true],
            );
            for (a, c) in [
                (vec3(-0.02, y0, 0.0), vec3(0.02, y1, 0.115)),
                (vec3(-0.38, y0 + 0.5, 0.0), vec3(0.38, y0 + 0.53, 0.11)),
                (vec3(-0.38, y0 + 1.0, 0.0), vec3(0.38, y0 + 1.03, 0.11)),
            ] {
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
pub(super) fn dome(b: &mut Builder, m: &Palette) {
    let (outer, inner) = (DOME, DOME - SHELL);
    let bands = 10;
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
            let curb: Vec<Vec3> =
                (SLIT_FROM - 2..=SLIT_TO + 4).map(|k| shell(SLIT + 0.03, k as f32, outer + 0.03)).collect();
            b.tube(m.dark, &curb, &vec![0.06; curb.len()], 8, false);
            for step in [SLIT_FROM, SLIT_TO] {
                let rail: Vec<Vec3> =
                    (0..=12).map(|k| shell(SLIT + 1.1 * k as f32 / 12.0, step as f32, outer + 0.06)).collect();
                b.tube(m.dark, &rail, &[0.055; 13], 8, false);
            }
            // Seams of the plates.
            for x in [1.9f32, 2.75, 3.45] {
                let seam: Vec<Vec3> = (0..=30).map(|k| shell(x, k as f32 * 2.0, outer)).collect();
                b.tube(m.dome, &seam, &[0.03; 31], 6, false);
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
pub(super) fn telescope(b: &mut Builder, m: &Palette) {
    b.lathe(m.steel, &pairs(&[0.75, -0.02, 0.75, 0.1, 0.5, 0.2, 0.45, 0.7, 0.6, 0.76, 0.62, 0.82, 0.0, 0.82]), 32);
    b.lathe(m.dark, &pairs(&[0.7, 0.8, 0.72, 0.84, 0.72, 0.98, 0.66, 1.02, 0.0, 1.02]), 32);
    let pivot = 2.1;
    for s in [-1.0, 1.0] {
        let arm = [
            vec2(-0.35, 0.98),
            vec2(0.35, 0.98),
            vec2(0.24, 1.5),
            vec2(0.2, pivot + 0.05),
            vec2(0.0, pivot + 0.25),
            vec2(-0.2, pivot + 0.05),
            vec2(-0.24, 1.5),
        ];
        b.with(Mat4::from_translation(vec3(s * 0.82, 0.0, 0.0)) * Mat4::from_rotation_y(FRAC_PI_2), |b| {
            b.extrude(m.steel, &arm, -0.09, 0.09, Shading::Flat);
        });
        b.frustum(m.dark, vec3(s * 0.55, pivot, 0.0), vec3(s * 0.96, pivot, 0.0), 0.16, 0.16, 24, [false, true]);
    }
    // The tube's axis is the local y.
    let tilt = Mat4::from_rotation_translation(Quat::from_rotation_x(0.72), vec3(0.0, pivot, 0.0));
    b.with(tilt, |b| {
        let tub = pairs(&[
            0.0, -0.95, 0.5, -0.95, 0.58, -0.88, 0.6, -0.86, 0.6, -0.2, 0.64, -0.18, 0.64, 0.2, 0.6, 0.22, 0.6, 0.42,
            0.65, 0.44, 0.65, 0.52, 0.56, 0.52, 0.56, -0.7, 0.0, -0.66,
        ]);
        b.lathe(m.white, &tub, 40);
        let top = pairs(&[0.56, 2.3, 0.62, 2.28, 0.62, 2.72, 0.66, 2.74, 0.66, 2.8, 0.58, 2.8, 0.56, 2.3]);
        b.lathe(m.white, &top, 40);
        for k in 0..8 {
            let (a, c) = (k as f32 / 8.0 * TAU, (k as f32 + if k % 2 == 0 { 1.0 } else { -1.0 }) / 8.0 * TAU);
            let (foot, head) = (
                vec3(a.cos(), 0.0, a.sin()) * 0.61 + Vec3::Y * 0.5,
                vec3(c.cos(), 0.0, c.sin()) * 0.59 + Vec3::Y * 2.32,
            );
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
            b.rounded(
                m.wood,
                vec3(-0.35, y - 0.04, 0.25 * k as f32 - 0.02),
                vec3(0.35, y, 0.25 * (k + 1) as f32),
                0.008,
                1,
            );
        }
        for x in [-0.36, 0.36] {
            b.tube(m.dark, &[vec3(x, -0.01, -0.05), vec3(x, 0.98, 0.95), vec3(x, -0.01, 1.0)], &[0.02; 3], 8, false);
            b.tube(
                m.dark,
                &[vec3(x, 0.55, 0.6), vec3(x, 1.6, 0.6), vec3(x, 1.95, 0.95), vec3(x, 0.95, 0.95)],
                &[0.015; 4],
                8,
                false,
            );
        }
    });
}
