//! Curtains, rugs, the fountain, plants and lanterns.

use super::{BAY, COURT, FLOOR, Palette, each_bay};
use crate::scene::builtin::builder::{Builder, Rng, Shading, pairs};
use glam::{Mat4, Vec2, Vec3, vec2, vec3};
use std::f32::consts::{PI, TAU};

/// A piece of cloth: its edges' x and its folds' depth by height, folded `folds` times.
fn drape(
    b: &mut Builder,
    material: u32,
    cells: [usize; 2],
    y: [f32; 2],
    folds: f32,
    phase: f32,
    edges: impl Fn(f32) -> (f32, f32, f32),
) {
    b.lattice(material, cells[0] + 1, cells[1] + 1, Shading::Smooth(60.0), |i, j| {
        let s = i as f32 / cells[0] as f32;
        let t = j as f32 / cells[1] as f32;
        let (left, right, depth) = edges(t);
        let fold = (TAU * (folds * s + 0.15 * (5.0 * t + phase).sin()) + phase).sin()
            + 0.3 * (TAU * folds * 0.37 * s + 3.0 * t + phase).sin();
        // The lower hem swings a little.
        let sway = 0.05 * (t * t) * (3.0 * s + phase).sin();
        let hem = 0.012 * t * (TAU * folds * s).sin();
        let height = y[0] + (y[1] - y[0]) * t + hem;
        (vec3(left + (right - left) * s, height, depth * fold + sway), vec2(s, t))
    });
}

pub(super) fn curtains(b: &mut Builder, m: &Palette) {
    // Per bay of the two long sides: n nothing, p a pair tied back, c closed, and its cloth.
    let plan = [["p0", "p0", "c1", "p2", "n", "p2", "c0", "p1"], ["n", "p2", "n", "p1", "c0", "n", "p0", "p2"]];
    each_bay(b, |b, side, bay| {
        if side % 2 == 1 {
            return;
        }
        let what = plan[side / 2][bay].as_bytes();
        if what[0] == b'n' {
            return;
        }
        let cloth = m.cloth[usize::from(what[1] - b'0')];
        let phase = bay as f32 * 1.7 + side as f32;
        let rod = 3.06;
        b.tube(m.iron, &[vec3(-1.55, rod, 0.0), vec3(1.55, rod, 0.0)], &[0.02; 2], 10, false);
        if what[0] == b'c' {
            drape(b, cloth, [96, 12], [rod + 0.04, 0.1], 11.0, phase, |t| (-1.38, 1.38, 0.035 + 0.035 * t));
            return;
        }
        for s in [-1.0, 1.0] {
            b.with(Mat4::from_scale(vec3(s, 1.0, 1.0)), |b| {
                drape(b, cloth, [48, 20], [rod + 0.04, 0.08], 6.0, phase + s, |t| {
                    // Gathered by a band at 0.6 of the height.
                    let u = (t - 0.58) / if t < 0.58 { 0.58 } else { 0.42 };
                    let open = (u.abs() * 1.05).min(1.0).powf(if t < 0.58 { 1.6 } else { 0.8 });
                    let (outer, inner) = if t < 0.58 { (1.4, 0.06) } else { (1.36, 0.75) };
                    let left = 1.3 + (outer - 1.3) * open;
                    let right = 1.12 + (inner - 1.12) * open;
                    (right, left, 0.012 + 0.05 * open)
                });
                let path: Vec<Vec3> = (0..14)
                    .map(|i| {
                        let angle = i as f32 / 14.0 * TAU;
                        vec3(1.21 + 0.115 * angle.cos(), 1.335 + 0.02 * angle.cos(), 0.062 * angle.sin())
                    })
                    .collect();
                b.tube(m.cloth[1], &path, &[0.022; 14], 6, true);
            });
        }
    });
    // Rugs over the gallery's rail.
    for (side, bay, cloth) in [(0, 2, 0), (0, 5, 2), (2, 3, 1), (2, 6, 0)] {
        each_bay(b, |b, s, k| {
            if (s, k) != (side, bay) {
                return;
            }
            let y = FLOOR[1] + 1.0;
            let path: Vec<Vec2> = rug_path(y);
            b.lattice(m.cloth[cloth], 25, path.len(), Shading::Smooth(80.0), |i, j| {
                let s = i as f32 / 24.0 - 0.5;
                let p = path[j];
                let below = (y - p.y).max(0.0);
                let wave = 0.02 * (below * 2.0).min(1.0) * (s * 14.0 + 2.0 * below).sin();
                (vec3(s * 1.5, p.y, p.x + wave + 0.03 * (below * 2.0).min(1.0)), vec2(s, p.y))
            });
        });
    }
}

/// From the court's side over a rail with its top at `y` to the gallery's side: (z, y).
fn rug_path(y: f32) -> Vec<Vec2> {
    let mut path: Vec<Vec2> = (0..14).map(|k| vec2(0.175, y - 1.3 + k as f32 * 0.1)).collect();
    for k in 0..=8 {
        let angle = k as f32 / 8.0 * PI;
        path.push(vec2(0.15 * angle.cos() + 0.0, y + 0.012 + 0.03 * angle.sin()));
    }
    path.extend((1..8).map(|k| vec2(-0.15, y - k as f32 * 0.06)));
    path
}

pub(super) fn furnish(b: &mut Builder, m: &Palette) {
    fountain(b, m);
    let mut rng = Rng::new(11);
    for x in [-3.0, -1.0, 1.0, 3.0] {
        for z in [-1.0, 1.0] {
            let tall = (x * z) % 3.0 == 0.0;
            b.at(vec3(x * BAY, COURT, z * 4.2), |b| shrub(b, m, &mut rng, tall));
        }
    }
    for (i, x) in [-3, -1, 1, 3].into_iter().enumerate() {
        for s in [-1.0, 1.0] {
            let x = (x as f32 * 0.5 + if i < 2 { -1.0 } else { 1.0 }) * BAY;
            b.at(vec3(x, 0.0, s * 7.505), |b| lantern(b, m));
        }
    }
    // Jars by the walls.
    for (x, z, size) in [
        (-14.4, -8.8, 1.0),
        (-13.7, -8.9, 0.75),
        (-14.1, -8.2, 0.6),
        (10.8, 8.8, 0.95),
        (11.45, 8.85, 0.7),
        (-7.2, 8.85, 0.9),
        (3.6, -8.85, 0.85),
        (17.8, -3.6, 0.9),
        (17.8, 3.6, 1.0),
    ] {
        jar(b, m, vec3(x, 0.0, z), size);
    }
    for (x, z) in [(-3.6, 8.85), (7.2, -8.85), (0.0, 8.85)] {
        bench(b, m, vec3(x, 0.0, z));
    }
}

fn fountain(b: &mut Builder, m: &Palette) {
    b.at(vec3(0.0, COURT, 0.0), |b| {
        b.uv_scale = 0.5;
        let basin = pairs(&[
            1.72, -0.02, 1.72, 0.1, 1.5, 0.1, 1.46, 0.14, 1.46, 0.44, 1.5, 0.48, 1.55, 0.5, 1.55, 0.58, 1.3, 0.58,
            1.27, 0.55, 1.25, 0.2,
        ]);
        b.lathe(m.stone, &basin, 48);
        let water = b.material("water", 0x5f8f93);
        b.lathe(water, &[vec2(1.28, 0.42), vec2(0.0, 0.42)], 48);
        let stem = pairs(&[
            0.3, 0.38, 0.3, 0.5, 0.2, 0.56, 0.14, 0.66, 0.12, 0.85, 0.17, 0.98, 0.14, 1.06, 0.2, 1.1, 0.45, 1.16, 0.62,
            1.26, 0.66, 1.34, 0.68, 1.35, 0.68, 1.39, 0.64, 1.39, 0.58, 1.3, 0.12, 1.24, 0.09, 1.4, 0.11, 1.5, 0.08,
            1.56, 0.1, 1.6, 0.24, 1.66, 0.3, 1.74, 0.27, 1.75, 0.2, 1.7, 0.05, 1.68, 0.05, 1.8, 0.07, 1.85, 0.0, 1.93,
        ]);
        b.lathe(m.trim, &stem, 40);
        b.uv_scale = 1.0;
    });
}

/// A clay pot with a clipped tree: a ball, or a tall cone.
fn shrub(b: &mut Builder, m: &Palette, rng: &mut Rng, tall: bool) {
    let pot =
        pairs(&[0.0, 0.0, 0.26, 0.0, 0.28, 0.03, 0.36, 0.42, 0.41, 0.5, 0.42, 0.56, 0.38, 0.57, 0.36, 0.5, 0.0, 0.48]);
    b.lathe(m.clay, &pot, 32);
    b.lathe(m.soil, &[vec2(0.365, 0.52), vec2(0.15, 0.54), vec2(0.0, 0.55)], 24);
    let (height, trunk) = if tall { (0.72, 0.045) } else { (1.25, 0.035) };
    b.frustum(m.wood, vec3(0.0, 0.5, 0.0), vec3(0.02, height, 0.0), trunk, trunk * 0.8, 8, [false; 2]);
    b.leaves(m.leaf, rng, 700, 0.11, |rng| {
        let d = rng.direction();
        if tall {
            let t = rng.unit();
            let radius = 0.36 * (1.0 - t).powf(0.7) * (t * 8.0).min(1.0).sqrt() * rng.range(0.75, 1.0);
            let flat = vec3(d.x, 0.0, d.z).normalize_or(Vec3::X);
            (vec3(0.0, 0.68 + 1.6 * t, 0.0) + flat * radius, flat + Vec3::Y * 0.7)
        } else {
            (vec3(0.02, 1.55, 0.0) + d * 0.46 * rng.range(0.75, 1.0), d)
        }
    });
}

/// An open lantern on a chain from the vault's crown.
fn lantern(b: &mut Builder, m: &Palette) {
    b.frustum(m.iron, vec3(0.0, 3.1, 0.0), vec3(0.0, 4.92, 0.0), 0.012, 0.012, 6, [false; 2]);
    b.lathe(
        m.iron,
        &[
            vec2(0.19, 2.94),
            vec2(0.2, 2.96),
            vec2(0.1, 3.06),
            vec2(0.03, 3.1),
            vec2(0.03, 3.16),
            vec2(0.0, 3.16),
            vec2(0.0, 3.1),
            vec2(0.17, 2.95),
            vec2(0.19, 2.94),
        ],
        18,
    );
    for k in 0..6 {
        let angle = k as f32 / 6.0 * TAU;
        let out = vec3(angle.cos(), 0.0, angle.sin());
        b.frustum(m.iron, out * 0.13 + Vec3::Y * 2.5, out * 0.175 + Vec3::Y * 2.96, 0.008, 0.008, 6, [true; 2]);
    }
    for (y, r) in [(2.5, 0.13), (2.72, 0.152)] {
        let path: Vec<Vec3> = (0..18)
            .map(|i| {
                let angle = i as f32 / 18.0 * TAU;
                vec3(r * angle.cos(), y, r * angle.sin())
            })
            .collect();
        b.tube(m.iron, &path, &[0.012; 18], 6, true);
    }
}

fn jar(b: &mut Builder, m: &Palette, base: Vec3, size: f32) {
    let profile = pairs(&[
        0.0, 0.0, 0.14, 0.0, 0.16, 0.02, 0.24, 0.2, 0.29, 0.42, 0.28, 0.6, 0.2, 0.78, 0.12, 0.86, 0.11, 0.92, 0.16,
        0.97, 0.16, 1.0, 0.12, 1.0, 0.08, 0.94, 0.08, 0.8, 0.0, 0.75,
    ]);
    b.with(Mat4::from_translation(base) * Mat4::from_scale(Vec3::splat(size)), |b| b.lathe(m.clay, &profile, 32));
}

fn bench(b: &mut Builder, m: &Palette, at: Vec3) {
    b.at(at, |b| {
        b.rounded(m.wood, vec3(-0.8, 0.42, -0.2), vec3(0.8, 0.48, 0.2), 0.01, 1);
        for x in [-0.6, 0.6] {
            b.block(m.wood, vec3(x - 0.04, 0.0, -0.16), vec3(x + 0.04, 0.43, 0.16));
        }
    });
}
