//! Walls with arches, columns and what stands in them.

use super::{BAY, Palette};
use crate::scene::builtin::builder::{Builder, CREASED, Patch, Shading, pairs};
use glam::{Mat4, Quat, Vec2, Vec3, vec2, vec3};
use std::f32::consts::{FRAC_PI_2, PI, TAU};

/// A wall in local x and y with a round opening: `half` its half-width, from `base` to `top`, faces at
/// z = ±`thick` (the back one only if `back`). The opening's sides rise to `spring`, its arch by `rise`.
pub(super) struct ArchWall {
    pub(super) half: f32,
    pub(super) radius: f32,
    pub(super) rise: f32,
    pub(super) base: f32,
    pub(super) spring: f32,
    pub(super) top: f32,
    pub(super) thick: f32,
    pub(super) back: bool,
}

const ARCH_STEPS: usize = 22;

pub(super) fn arch_wall(b: &mut Builder, material: u32, w: &ArchWall) {
    let scale = b.uv_scale;
    let mut outline = vec![vec2(-w.radius, w.base)];
    for i in 0..=ARCH_STEPS {
        let angle = PI * (1.0 - i as f32 / ARCH_STEPS as f32);
        let x = if i == 0 || i == ARCH_STEPS { angle.cos().signum() } else { angle.cos() };
        outline.push(vec2(x * w.radius, w.spring + w.rise * angle.sin().max(0.0)));
    }
    outline.push(vec2(w.radius, w.base));
    let mut patch = Patch::default();
    for front in [true, false] {
        if !front && !w.back {
            continue;
        }
        let z = if front { w.thick } else { -w.thick };
        let mut face = |mut corners: [Vec2; 4]| {
            if !front {
                corners.reverse();
            }
            let ids = corners.map(|p| patch.vertex(p.extend(z), vec2(p.x, -p.y) * scale));
            patch.face(&ids);
        };
        for (x0, x1) in [(-w.half, -w.radius), (w.radius, w.half)] {
            face([vec2(x0, w.base), vec2(x1, w.base), vec2(x1, w.top), vec2(x0, w.top)]);
        }
        for pair in outline[1..=ARCH_STEPS + 1].windows(2) {
            let (p, q) = (pair[0], pair[1]);
            face([p, q, vec2(q.x, w.top), vec2(p.x, w.top)]);
        }
    }
    let mut along = vec![0.0];
    for pair in outline.windows(2) {
        along.push(along[along.len() - 1] + pair[0].distance(pair[1]));
    }
    patch.lattice(outline.len(), 2, |i, j| {
        let z = if j == 0 { -w.thick } else { w.thick };
        (outline[i].extend(z), vec2(along[i], z) * scale)
    });
    b.add(material, &patch, CREASED);
}

/// A moulding around an arch's upper half on the face at z = `face`, from `radius` outwards.
/// A plain one has a simpler profile.
pub(super) fn archivolt(b: &mut Builder, material: u32, radius: f32, spring: f32, face: f32, plain: bool) {
    // Radius and height over the wall; the ends are sunk into it.
    let profile: &[(f32, f32)] = if plain {
        &[(0.0, -0.03), (0.0, 0.05), (0.12, 0.06), (0.15, 0.03), (0.15, -0.03)]
    } else {
        &[
            (0.0, -0.03),
            (0.0, 0.05),
            (0.06, 0.05),
            (0.08, 0.03),
            (0.13, 0.03),
            (0.16, 0.08),
            (0.2, 0.085),
            (0.22, 0.06),
            (0.22, -0.03),
        ]
    };
    let turned = Mat4::from_rotation_translation(Quat::from_rotation_x(FRAC_PI_2), vec3(0.0, spring, face));
    let ring: Vec<Vec2> = profile.iter().rev().map(|&(r, h)| vec2(radius + 0.01 + r, h)).collect();
    b.with(turned, |b| b.lathe_arc(material, &ring, ARCH_STEPS, 0.0, PI));
    // The keystone, a little wider at its top.
    let (y0, y1) = (spring + radius - 0.03, spring + radius + 0.34);
    let stone = [vec2(-0.1, y0), vec2(0.1, y0), vec2(0.15, y1), vec2(-0.15, y1)];
    b.extrude(material, &stone, face - 0.03, face + 0.13, Shading::Flat);
}

/// A profile swept around a rectangle, facing its middle. Points are (distance from the rectangle
/// towards its middle, height), run upwards.
pub(super) fn ring(b: &mut Builder, material: u32, half: Vec2, profile: &[Vec2]) {
    let scale = b.uv_scale;
    let signs = [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)];
    for side in 0..4 {
        let mut along = 0.0;
        b.lattice(material, 2, profile.len(), CREASED, |i, j| {
            let (sx, sz) = signs[(side + i) % 4];
            let p = profile[j];
            if i == 0 && j > 0 {
                along += p.distance(profile[j - 1]);
            }
            let position = vec3(sx * (half.x - p.x), p.y, sz * (half.y - p.x));
            let u = if side % 2 == 0 { position.x } else { position.z };
            (position, vec2(u, -along) * scale)
        });
    }
}

/// A column of the given height standing at the origin, slab on top and block below included.
pub(super) fn column(b: &mut Builder, m: &Palette, height: f32, storey: usize) {
    let r = [0.27, 0.22][storey];
    let neck = r * 0.86;
    let h = height;
    b.rounded(m.trim, vec3(-0.38, -0.02, -0.36), vec3(0.38, 0.15, 0.36), 0.012, 1);
    b.rounded(m.trim, vec3(-0.39, h - 0.13, -0.36), vec3(0.39, h + 0.01, 0.36), 0.015, 1);
    let mut profile = vec![vec2(r + 0.06, 0.13)];
    let torus = |profile: &mut Vec<Vec2>, inner: f32, y: f32, radius: f32| {
        for i in 0..=4 {
            let angle = i as f32 / 4.0 * PI - FRAC_PI_2;
            profile.push(vec2(inner + radius * angle.cos(), y + radius * (1.0 + angle.sin())));
        }
    };
    torus(&mut profile, r + 0.035, 0.15, 0.05);
    profile.extend([vec2(r + 0.03, 0.262), vec2(r + 0.012, 0.285), vec2(r + 0.015, 0.31)]);
    torus(&mut profile, r + 0.01, 0.317, 0.028);
    // The shaft swells a little.
    for i in 0..=4 {
        let t = i as f32 / 4.0;
        profile.push(vec2(r + (neck - r) * t * t, 0.39 + (h - 0.62 - 0.39) * t));
    }
    torus(&mut profile, neck + 0.004, h - 0.61, 0.022);
    // The bell under the slab.
    for i in 0..=4 {
        let t = i as f32 / 4.0;
        profile.push(vec2(neck + 0.005 + 0.12 * t * t * t, h - 0.56 + 0.44 * t));
    }
    b.lathe(m.stone, &profile, 18);
    for tier in 0..2 {
        let count = 6;
        for k in 0..count {
            let angle = (k as f32 + 0.5 * tier as f32) / count as f32 * TAU;
            let y = h - 0.56 + tier as f32 * 0.17;
            b.turned(vec3(0.0, y, 0.0), angle, |b| leaf(b, m.acanthus, neck, tier as f32 * 0.02));
        }
    }
}

/// One leaf of a capital, rising along +x at `radius` and curling outwards.
fn leaf(b: &mut Builder, material: u32, radius: f32, lift: f32) {
    b.lattice(material, 5, 5, Shading::Smooth(60.0), |i, j| {
        let t = j as f32 / 4.0;
        let s = i as f32 / 2.0 - 1.0;
        let width = 0.085 * (1.0 - t.powi(4)).max(0.06) * (0.8 + 0.4 * (t * PI).sin());
        let curl = (t - 0.55).max(0.0) / 0.45;
        let out = radius + 0.012 + lift + 0.035 * t * t + 0.075 * curl.powi(2) - 0.02 * s * s;
        let y = 0.235 * t - 0.06 * curl.powi(3);
        (vec3(out, y, -s * width), vec2(s, t))
    });
}

/// The rail between two upper columns, on the floor around the origin.
pub(super) fn balustrade(b: &mut Builder, m: &Palette) {
    let half = BAY * 0.5 - 0.2;
    b.rounded(m.trim, vec3(-half, -0.02, -0.11), vec3(half, 0.14, 0.11), 0.01, 1);
    b.rounded(m.trim, vec3(-half, 0.88, -0.13), vec3(half, 1.0, 0.13), 0.025, 2);
    let profile = pairs(&[
        0.07, 0.12, 0.07, 0.17, 0.04, 0.21, 0.065, 0.31, 0.08, 0.4, 0.072, 0.48, 0.045, 0.6, 0.035, 0.71, 0.06, 0.78,
        0.07, 0.9,
    ]);
    for k in 0..8 {
        let x = (k as f32 - 3.5) * 0.36;
        b.at(vec3(x, 0.0, 0.0), |b| b.lathe(m.stone, &profile, 9));
    }
}

/// What fills a blind arch: boards with battens and, on the ground, a ring handle.
pub(super) fn door(b: &mut Builder, m: &Palette, floor: f32, storey: usize, thick: f32) {
    let base = floor + 0.9 * storey as f32;
    let spring = floor + 2.15;
    let boards = 8;
    let width = 1.72 / boards as f32;
    for k in 0..boards {
        let x0 = -0.86 + k as f32 * width;
        let x1 = x0 + width - 0.012;
        let reach = x0.abs().max(x1.abs()).min(0.86);
        let y1 = spring + (0.87f32 * 0.87 - (reach - width * 0.8).max(0.0).powi(2)).max(0.0).sqrt() + 0.03;
        b.cuboid_sides(
            m.wood,
            vec3(x0, base - 0.02, -thick),
            vec3(x1, y1, -thick + 0.05),
            [true, true, false, false, false, true],
        );
    }
    // Behind the joints between boards.
    b.polygon(
        m.iron,
        &[
            vec3(-0.95, base - 0.1, -thick + 0.01),
            vec3(0.95, base - 0.1, -thick + 0.01),
            vec3(0.95, spring + 1.0, -thick + 0.01),
            vec3(-0.95, spring + 1.0, -thick + 0.01),
        ],
    );
    for y in [base + 0.25, spring - 0.15] {
        b.cuboid_sides(
            m.iron,
            vec3(-0.84, y, -thick + 0.04),
            vec3(0.84, y + 0.07, -thick + 0.066),
            [true, true, true, true, false, true],
        );
    }
    if storey == 0 {
        let path: Vec<Vec3> = (0..12)
            .map(|i| {
                let angle = i as f32 / 12.0 * TAU;
                vec3(0.12 + 0.07 * angle.cos(), 1.1 + 0.07 * angle.sin(), -thick + 0.075)
            })
            .collect();
        b.tube(m.iron, &path, &[0.011; 12], 5, true);
    } else {
        b.rounded(m.trim, vec3(-1.05, base - 0.1, -thick), vec3(1.05, base, thick + 0.1), 0.02, 1);
    }
}
