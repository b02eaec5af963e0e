//! A colonnaded atrium: two storeys of round arches around a court open to the sky.
//!
//! The court lies along x. Column lines are at ±[`COLUMNS_X`] and ±[`COLUMNS_Z`]; aisles run between
//! them and the outer walls at ±[`WALL_X`] and ±[`WALL_Z`].

use super::builder::{Builder, CREASED, Patch, Rng, Shading, camera, fbm, light};
use crate::light::Light;
use crate::scene::Scene;
use glam::{Mat4, Quat, Vec2, Vec3, vec2, vec3};
use std::f32::consts::{FRAC_PI_2, PI, TAU};

/// What the scene shows.
pub const DESCRIPTION: &str =
    "A colonnaded atrium with curtains, two storeys of arches around a court open to the sky";

/// Distance between columns.
const BAY: f32 = 3.6;
const COLUMNS_X: f32 = 14.4;
const COLUMNS_Z: f32 = 5.4;
/// Half the arcade walls' thickness.
const HALF_WALL: f32 = 0.31;
const WALL_X: f32 = 18.3;
const WALL_Z: f32 = 9.3;
/// The arcade openings' half-width.
const RADIUS: f32 = 1.44;
/// Heights of the arches' feet above the storey's floor.
const SPRING: [f32; 2] = [3.3, 2.5];
/// The floors' heights.
const FLOOR: [f32; 2] = [0.0, 5.4];
const COURT: f32 = -0.16;

struct Palette {
    plaster: u32,
    stone: u32,
    trim: u32,
    paving: u32,
    tiles: u32,
    roof: u32,
    wood: u32,
    iron: u32,
    leaf: u32,
    clay: u32,
    soil: u32,
    mortar: u32,
    earth: u32,
    acanthus: u32,
    cloth: [u32; 3],
}

/// Generates the scene.
pub fn build() -> Scene {
    let mut b = Builder::new("arches");
    let plaster = b.texture(256, 256, |x, y| {
        let p = vec2(x as f32, y as f32) / 256.0;
        let value = 0.86 + 0.1 * fbm(p * 8.0, 1, 8, 4) + 0.06 * fbm(p * 2.0, 5, 2, 3);
        [value, value * 0.99, value * 0.97, 1.0]
    });
    let paving = b.texture(512, 512, |x, y| floor_texel(x, y));
    let stone = b.texture(256, 256, |x, y| {
        let p = vec2(x as f32, y as f32) / 256.0;
        let vein = (fbm(p * 4.0, 9, 4, 5) * 14.0).sin() * 0.02;
        let value = 0.88 + 0.12 * fbm(p * 16.0, 3, 16, 3) + vein;
        [value, value, value, 1.0]
    });
    let m = Palette {
        plaster: b.textured("plaster", 0xefdcbc, plaster),
        stone: b.textured("limestone", 0xe8dfcf, stone),
        trim: b.textured("carved stone", 0xf2ebdd, stone),
        paving: b.textured("flagstones", 0xd9c8ae, stone),
        tiles: b.textured("floor tiles", 0xffffff, paving),
        roof: b.textured("roof tiles", 0xc4744e, plaster),
        wood: b.textured("timber", 0x7a5234, stone),
        iron: b.material("iron", 0x35322f),
        leaf: b.double_sided("leaves", 0x5d8a3c),
        clay: b.textured("terracotta", 0xc0714a, plaster),
        soil: b.material("soil", 0x4a3728),
        mortar: b.material("mortar", 0x8f8371),
        earth: b.textured("earth", 0xb7a586, stone),
        acanthus: b.double_sided("acanthus", 0xefe6d6),
        cloth: [
            b.double_sided("red cloth", 0xb0352a),
            b.double_sided("ochre cloth", 0xd9a13f),
            b.double_sided("teal cloth", 0x2e7480),
        ],
    };
    floors(&mut b, &m);
    for storey in 0..2 {
        arcades(&mut b, &m, storey);
        outer_walls(&mut b, &m, storey);
    }
    vaults(&mut b, &m);
    cornices(&mut b, &m);
    roof(&mut b, &m);
    curtains(&mut b, &m);
    furnish(&mut b, &m);
    b.finish(
        vec![
            camera("atrium", vec3(-12.9, 1.75, 1.9), vec3(2.0, 3.35, -1.0), 62.0, 0.1, 120.0),
            camera("gallery", vec3(13.2, 7.3, -7.6), vec3(1.0, 4.6, 1.0), 60.0, 0.1, 120.0),
            camera("curtain", vec3(-5.4, 1.55, -1.7), vec3(-8.4, 1.75, -5.4), 50.0, 0.05, 60.0),
            camera("corner", vec3(-17.6, 1.7, -7.5), vec3(-9.0, 2.0, -6.5), 65.0, 0.1, 80.0),
            camera("above", vec3(-3.0, 29.0, 9.5), vec3(0.0, 0.0, -0.3), 44.0, 1.0, 120.0),
        ],
        vec![
            light("sun", Light::Directional { to_light: vec3(0.42, 1.0, 0.36), color: vec3(1.0, 0.95, 0.86) * 1.1 }),
            light("lantern", Light::Omni { position: vec3(-9.0, 2.72, -7.5), range: 25.0, color: vec3(9.0, 7.6, 5.6) }),
            light("spot", Light::Spot { position: vec3(9.5, 9.4, 4.4), direction: vec3(-7.5, -9.4, -5.2), outer_angle: 34.0, range: 40.0, color: vec3(150.0, 138.0, 115.0) }),
            light("hemisphere", Light::Hemisphere { position: vec3(0.0, 9.6, 0.0), direction: vec3(0.0, -1.0, 0.0), range: 40.0, color: vec3(60.0, 58.0, 54.0) }),
            light("skylight", Light::RectArea { center: vec3(0.0, 10.4, 0.0), half_u: vec3(6.0, 0.0, 0.0), half_v: vec3(0.0, 0.0, 3.0), range: 50.0, color: vec3(1.6, 1.7, 1.9) }),
        ],
    )
}

/// Cream and terracotta squares with joints; the texture spans 2 × 2 tiles.
fn floor_texel(x: u32, y: u32) -> [f32; 4] {
    let (i, j) = (x / 256, y / 256);
    let (u, v) = (x % 256, y % 256);
    let p = vec2(x as f32, y as f32) / 512.0;
    let grain = 0.9 + 0.14 * fbm(p * 16.0, 7 + i + 2 * j, 16, 4);
    let joint = u.min(v).min(255 - u).min(255 - v) < 5;
    let color = match (joint, (i + j) % 2) {
        (true, _) => [0.50, 0.45, 0.39],
        (_, 0) => [0.86, 0.79, 0.67],
        _ => [0.72, 0.47, 0.34],
    };
    [color[0] * grain, color[1] * grain, color[2] * grain, 1.0]
}

/// A wall in local x and y with a round opening: `half` its half-width, from `base` to `top`, faces at
/// z = ±`thick` (the back one only if `back`). The opening's sides rise to `spring`, its arch by `rise`.
struct ArchWall {
    half: f32,
    radius: f32,
    rise: f32,
    base: f32,
    spring: f32,
    top: f32,
    thick: f32,
    back: bool,
}

const ARCH_STEPS: usize = 24;

fn arch_wall(b: &mut Builder, material: u32, w: &ArchWall) {
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
fn archivolt(b: &mut Builder, material: u32, radius: f32, spring: f32, face: f32, plain: bool) {
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
    let turned = Mat4::from_rotation_translation(
        Quat::from_rotation_x(FRAC_PI_2),
        vec3(0.0, spring, face),
    );
    let ring: Vec<Vec2> = profile.iter().rev().map(|&(r, h)| vec2(radius + 0.01 + r, h)).collect();
    b.with(turned, |b| b.lathe_arc(material, &ring, ARCH_STEPS, 0.0, PI));
    // The keystone, a little wider at its top.
    let (y0, y1) = (spring + radius - 0.03, spring + radius + 0.34);
    let stone = [vec2(-0.1, y0), vec2(0.1, y0), vec2(0.15, y1), vec2(-0.15, y1)];
    b.extrude(material, &stone, face - 0.03, face + 0.13, Shading::Flat);
}

/// A profile swept around a rectangle, facing its middle. Points are (distance from the rectangle
/// towards its middle, height), run upwards.
fn ring(b: &mut Builder, material: u32, half: Vec2, profile: &[Vec2]) {
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

/// Runs `draw` for each bay of the court's four sides, the court in front (+z) of it.
fn each_bay(b: &mut Builder, mut draw: impl FnMut(&mut Builder, usize, usize)) {
    for side in 0..4 {
        let long = side % 2 == 0;
        let count = if long { 8 } else { 3 };
        let away = if long { COLUMNS_Z } else { COLUMNS_X };
        b.turned(Vec3::ZERO, side as f32 * FRAC_PI_2, |b| {
            for bay in 0..count {
                let x = (bay as f32 - (count - 1) as f32 * 0.5) * BAY;
                b.at(vec3(x, 0.0, -away), |b| draw(b, side, bay));
            }
        });
    }
}

fn arcades(b: &mut Builder, m: &Palette, storey: usize) {
    let floor = FLOOR[storey];
    let spring = floor + SPRING[storey];
    let top = [5.3, 10.22][storey];
    b.uv_scale = 0.4;
    each_bay(b, |b, side, bay| {
        // The wall's feet are sunk into the columns' top slabs.
        let wall = ArchWall {
            half: BAY * 0.5,
            radius: RADIUS,
            rise: RADIUS,
            base: spring - 0.02,
            spring,
            top,
            thick: HALF_WALL,
            back: true,
        };
        arch_wall(b, m.plaster, &wall);
        archivolt(b, m.trim, RADIUS, spring, HALF_WALL, false);
        let last = if side % 2 == 0 { 7 } else { 2 };
        if bay < last {
            b.at(vec3(BAY * 0.5, floor, 0.0), |b| column(b, m, SPRING[storey], storey));
        }
        if storey == 1 {
            b.at(vec3(0.0, floor, 0.0), |b| balustrade(b, m));
        }
    });
    for (x, z) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
        let middle = vec3(x * COLUMNS_X, 0.0, z * COLUMNS_Z);
        let half = vec3(0.4, 0.0, 0.4);
        let y = [COURT - 0.1, 5.25][storey];
        b.cuboid_sides(
            m.stone,
            middle - half + Vec3::Y * y,
            middle + half + Vec3::Y * top,
            [true, true, false, false, true, true],
        );
        let slab = vec3(0.45, 0.0, 0.45);
        let y = spring - 0.14;
        b.rounded(m.trim, middle - slab + Vec3::Y * y, middle + slab + Vec3::Y * (y + 0.16), 0.02, 1);
        let y = floor - 0.02;
        b.rounded(m.trim, middle - slab + Vec3::Y * y, middle + slab + Vec3::Y * (y + 0.3), 0.02, 1);
    }
    b.uv_scale = 1.0;
}

/// A column of the given height standing at the origin, slab on top and block below included.
fn column(b: &mut Builder, m: &Palette, height: f32, storey: usize) {
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
    torus(&mut profile, r + 0.01, 0.318, 0.028);
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
    b.lathe(m.stone, &profile, 20);
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
fn balustrade(b: &mut Builder, m: &Palette) {
    let half = BAY * 0.5 - 0.2;
    b.rounded(m.trim, vec3(-half, -0.02, -0.11), vec3(half, 0.14, 0.11), 0.01, 1);
    b.rounded(m.trim, vec3(-half, 0.88, -0.13), vec3(half, 1.0, 0.13), 0.025, 2);
    let profile: Vec<Vec2> = [
        (0.07, 0.12),
        (0.07, 0.17),
        (0.04, 0.21),
        (0.065, 0.31),
        (0.08, 0.4),
        (0.072, 0.48),
        (0.045, 0.6),
        (0.035, 0.71),
        (0.06, 0.78),
        (0.07, 0.9),
    ]
    .map(|(r, y)| vec2(r, y))
    .to_vec();
    for k in 0..8 {
        let x = (k as f32 - 3.5) * 0.36;
        b.at(vec3(x, 0.0, 0.0), |b| b.lathe(m.stone, &profile, 9));
    }
}

/// Outer walls with blind arches: doors below, shuttered windows above.
fn outer_walls(b: &mut Builder, m: &Palette, storey: usize) {
    let floor = FLOOR[storey];
    let top = [5.3, 11.6][storey];
    b.uv_scale = 0.4;
    for side in 0..4 {
        let long = side % 2 == 0;
        let (bays, away, end) = if long { (8, WALL_Z, WALL_X) } else { (3, WALL_X, WALL_Z) };
        b.turned(Vec3::ZERO, side as f32 * FRAC_PI_2, |b| {
            let thick = 0.12;
            let plane = -away - thick;
            for bay in 0..bays {
                let x = (bay as f32 - (bays - 1) as f32 * 0.5) * BAY;
                b.at(vec3(x, 0.0, plane), |b| {
                    let wall = ArchWall {
                        half: BAY * 0.5,
                        radius: 0.85,
                        rise: 0.85,
                        base: floor - 0.02 + 0.9 * storey as f32,
                        spring: floor + 2.15,
                        top,
                        thick,
                        back: false,
                    };
                    arch_wall(b, m.plaster, &wall);
                    archivolt(b, m.trim, 0.85, floor + 2.15, thick, true);
                    door(b, m, floor, storey, thick);
                });
            }
            // Plain wall behind the corner bays, and the sills' wall below the windows.
            let inner = bays as f32 * BAY * 0.5;
            let (y0, z) = (floor - 0.02, -away);
            for (x0, x1) in [(-end, -inner), (inner, end)] {
                b.polygon(m.plaster, &[vec3(x0, y0, z), vec3(x1, y0, z), vec3(x1, top, z), vec3(x0, top, z)]);
            }
            if storey == 1 {
                let y1 = floor + 0.88;
                b.polygon(m.plaster, &[vec3(-inner, y0, z), vec3(inner, y0, z), vec3(inner, y1, z), vec3(-inner, y1, z)]);
            }
        });
    }
    // Skirting, set off from the wall.
    let skirting = [vec2(0.04, floor - 0.02), vec2(0.04, floor + 0.22), vec2(0.02, floor + 0.26), vec2(-0.02, floor + 0.26)];
    if storey == 1 {
        ring(b, m.stone, vec2(WALL_X, WALL_Z), &skirting);
    }
    b.uv_scale = 1.0;
}

/// What fills a blind arch: boards with battens and, on the ground, a ring handle.
fn door(b: &mut Builder, m: &Palette, floor: f32, storey: usize, thick: f32) {
    let base = floor + 0.9 * storey as f32;
    let spring = floor + 2.15;
    let boards = 8;
    let width = 1.72 / boards as f32;
    for k in 0..boards {
        let x0 = -0.86 + k as f32 * width;
        let x1 = x0 + width - 0.012;
        let reach = x0.abs().max(x1.abs()).min(0.86);
        let y1 = spring + (0.87f32 * 0.87 - (reach - width * 0.8).max(0.0).powi(2)).max(0.0).sqrt() + 0.03;
        b.cuboid_sides(m.wood, vec3(x0, base - 0.02, -thick), vec3(x1, y1, -thick + 0.05), [true, true, false, false, false, true]);
    }
    // Behind the joints between boards.
    b.polygon(m.iron, &[vec3(-0.95, base - 0.1, -thick + 0.01), vec3(0.95, base - 0.1, -thick + 0.01), vec3(0.95, spring + 1.0, -thick + 0.01), vec3(-0.95, spring + 1.0, -thick + 0.01)]);
    for y in [base + 0.25, spring - 0.15] {
        b.cuboid_sides(m.iron, vec3(-0.84, y, -thick + 0.04), vec3(0.84, y + 0.07, -thick + 0.066), [true, true, true, true, false, true]);
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

fn floors(b: &mut Builder, m: &Palette) {
    let flat = |b: &mut Builder, material: u32, x: [f32; 2], z: [f32; 2], y: f32| {
        b.polygon(
            material,
            &[vec3(x[0], y, z[0]), vec3(x[0], y, z[1]), vec3(x[1], y, z[1]), vec3(x[1], y, z[0])],
        );
    };
    let court = vec2(COLUMNS_X - 0.45, COLUMNS_Z - 0.45);
    for storey in 0..2 {
        b.uv_scale = 0.625;
        let edge = if storey == 0 {
            court - 0.04
        } else {
            vec2(COLUMNS_X - HALF_WALL, COLUMNS_Z - HALF_WALL)
        };
        let y = FLOOR[storey];
        for s in [-1.0f32, 1.0] {
            let span = |a: f32, c: f32| if s > 0.0 { [a, c] } else { [-c, -a] };
            flat(b, m.tiles, [-WALL_X, WALL_X], span(edge.y, WALL_Z), y);
            flat(b, m.tiles, span(edge.x, WALL_X), [-edge.y, edge.y], y);
        }
    }
    b.uv_scale = 0.5;
    let step = [vec2(0.0, COURT - 0.1), vec2(0.0, -0.05), vec2(0.04, -0.05), vec2(0.04, 0.0)];
    ring(b, m.stone, court, &step);
    flat(b, m.mortar, [-court.x, court.x], [-court.y, court.y], COURT - 0.02);
    b.uv_scale = 0.05;
    flat(b, m.earth, [-70.0, 70.0], [-70.0, 70.0], -0.3);
    // Flagstones in rows of staggered joints.
    let mut rng = Rng::new(3);
    b.uv_scale = 0.5;
    let rows = 16;
    let depth = 2.0 * court.y / rows as f32;
    for row in 0..rows {
        let z = -court.y + row as f32 * depth;
        let mut x = -court.x;
        while x < court.x {
            let mut next = x + rng.range(0.55, 1.05);
            if court.x - next < 0.45 {
                next = court.x;
            }
            let top = COURT + rng.range(-0.004, 0.004);
            b.block(m.paving, vec3(x + 0.006, COURT - 0.04, z + 0.006), vec3(next - 0.006, top, z + depth - 0.006));
            x = next;
        }
    }
    b.uv_scale = 1.0;
}

/// Groin vaults over the lower aisles, with ribs between the bays.
fn vaults(b: &mut Builder, m: &Palette) {
    let spring = SPRING[0];
    let inner = vec2(COLUMNS_X + HALF_WALL, COLUMNS_Z + HALF_WALL);
    let middle = (inner + vec2(WALL_X, WALL_Z)) * 0.5;
    let half = (vec2(WALL_X, WALL_Z) - inner) * 0.5;
    b.uv_scale = 0.4;
    let vault = |b: &mut Builder, x: f32, z: f32, half: Vec2| {
        let scale = b.uv_scale;
        let steps = 16;
        let mut patch = Patch::default();
        // Even steps in angle, so that the diagonals run along the groins.
        let coordinate = |i: usize| {
            if i == steps / 2 { 0.0 } else { -(i as f32 / steps as f32 * PI).cos() }
        };
        for j in 0..=steps {
            for i in 0..=steps {
                let (u, v) = (coordinate(i), coordinate(j));
                let rise = (1.0 - u.abs().min(v.abs()).powi(2)).max(0.0).sqrt();
                let p = vec3(x + u * half.x, spring + 1.6 * rise, z + v * half.y);
                patch.vertex(p, vec2(p.x, p.z) * scale);
            }
        }
        for j in 0..steps as u32 {
            for i in 0..steps as u32 {
                let a = j * (steps as u32 + 1) + i;
                let (c, d, e) = (a + 1, a + steps as u32 + 2, a + steps as u32 + 1);
                let middle = steps as u32 / 2;
                if (i < middle) == (j < middle) {
                    patch.face(&[a, c, d, e]);
                } else {
                    patch.face(&[c, d, e, a]);
                }
            }
        }
        b.add(m.plaster, &patch, CREASED);
    };
    let rib = |b: &mut Builder, half: f32| {
        let wall = ArchWall {
            half,
            radius: half - 0.2,
            rise: 1.42,
            base: spring - 0.02,
            spring,
            top: 5.3,
            thick: 0.2,
            back: true,
        };
        arch_wall(b, m.stone, &wall);
        for s in [-1.0, 1.0] {
            let x = s * half;
            let corbel = [vec2(x, spring - 0.42), vec2(x - s * 0.06, spring - 0.38), vec2(x - s * 0.24, spring - 0.1), vec2(x - s * 0.24, spring), vec2(x, spring)];
            b.extrude(m.trim, &corbel, -0.24, 0.24, Shading::Flat);
        }
    };
    for s in [-1.0, 1.0] {
        for i in 0..8 {
            vault(b, (i as f32 - 3.5) * BAY, s * middle.y, vec2(1.62, half.y + 0.01));
        }
        for i in 0..3 {
            vault(b, s * middle.x, (i as f32 - 1.0) * BAY, vec2(half.x + 0.01, 1.62));
        }
        for t in [-1.0, 1.0] {
            vault(b, s * (middle.x + 0.02), t * (middle.y + 0.02), half + 0.03);
        }
        for i in 0..9 {
            let at = vec3((i as f32 - 4.0) * BAY, 0.0, s * middle.y);
            b.turned(at, FRAC_PI_2, |b| rib(b, half.y));
        }
        for i in 0..4 {
            b.at(vec3(s * middle.x, 0.0, (i as f32 - 1.5) * BAY), |b| rib(b, half.x));
        }
    }
    b.uv_scale = 1.0;
}

/// Bands around the court, between the storeys and under the eaves.
fn cornices(b: &mut Builder, m: &Palette) {
    b.uv_scale = 0.5;
    let face = vec2(COLUMNS_X - HALF_WALL, COLUMNS_Z - HALF_WALL);
    let band = [(-0.02, 4.99), (0.1, 4.99), (0.1, 5.04), (0.12, 5.06), (0.12, 5.14), (0.15, 5.2), (0.21, 5.25), (0.24, 5.27), (0.24, 5.36), (0.22, 5.4), (0.0, 5.4)];
    ring(b, m.trim, face, &band.map(|(x, y)| vec2(x, y)));
    let upper = [(-0.02, 9.62), (0.12, 9.62), (0.12, 9.67), (0.14, 9.69), (0.16, 9.76), (0.22, 9.82), (0.25, 9.84), (0.25, 9.95), (-0.02, 9.95)];
    ring(b, m.trim, face, &upper.map(|(x, y)| vec2(x, y)));
    // Dentils under the lower band's crown.
    each_bay(b, |b, _, _| {
        for k in 0..15 {
            let x = (k as f32 - 7.0) * 0.24;
            b.cuboid_sides(m.trim, vec3(x - 0.05, 5.07, HALF_WALL + 0.1), vec3(x + 0.05, 5.19, HALF_WALL + 0.19), [true, true, true, false, false, true]);
        }
    });
    b.uv_scale = 1.0;
}

/// The roof's underside at a distance from the court's face towards the court.
fn underside(inset: f32) -> f32 {
    10.0 - 0.3 * inset
}

fn roof(b: &mut Builder, m: &Palette) {
    let face = vec2(COLUMNS_X - HALF_WALL, COLUMNS_Z - HALF_WALL);
    b.uv_scale = 0.5;
    let eave = 0.55;
    ring(b, m.wood, face, &[vec2(-4.3, underside(-4.3)), vec2(eave, underside(eave)), vec2(eave, underside(eave) + 0.3)]);
    // Rafters, sunk a little into the boards above.
    for side in 0..4 {
        let (away, length) = if side % 2 == 0 { (face.y, face.x) } else { (face.x, face.y) };
        b.turned(Vec3::ZERO, side as f32 * FRAC_PI_2, |b| {
            let count = (length / 0.45).floor() as i32;
            for k in -count..=count {
                let x = k as f32 * 0.9;
                if x.abs() > length + 3.6 {
                    continue;
                }
                // Those beyond the court's corner start at the hip.
                let start = (-eave + 0.04).max(x.abs() - length);
                let outline = [vec2(start, 0.0), vec2(4.22, 0.0), vec2(4.22, -0.17), vec2(start, -0.17)]
                    .map(|p| vec2(p.x, underside(-p.x) + p.y + 0.02));
                b.turned(vec3(x, 0.0, -away), FRAC_PI_2, |b| {
                    b.extrude(m.wood, &outline, -0.06, 0.06, Shading::Flat);
                });
            }
        });
    }
    // Round tiles in rows that overlap: each row starts raised and dips under the next.
    let (rows, wave, low, high) = (7, 0.42, -0.62, 4.3);
    for side in 0..4 {
        let (away, length) = if side % 2 == 0 { (face.y, face.x) } else { (face.x, face.y) };
        b.turned(Vec3::ZERO, side as f32 * FRAC_PI_2, |b| {
            let columns = ((length + high) / wave * 4.0) as usize * 2 + 1;
            let scale = b.uv_scale;
            b.lattice(m.roof, columns, 2 * rows, Shading::Smooth(60.0), |i, j| {
                let row = (j / 2 + j % 2) as f32;
                let d = low + (high - low) * row / rows as f32;
                let x = (i as f32 - (columns / 2) as f32) * wave * 0.25;
                // Beyond the hips the lattice folds to nothing.
                let reach = length + d;
                let x = x.clamp(-reach, reach);
                let lift = if j % 2 == 0 { 0.05 } else { 0.0 };
                let y = underside(-d) + 0.36 + lift + 0.045 * (x / wave * TAU).cos();
                (vec3(x, y, -away - d), vec2(x, d) * scale)
            });
            // The hip's row of tiles.
            let path: Vec<Vec3> = (0..=24)
                .map(|k| {
                    let d = low + (high - low) * k as f32 / 24.0;
                    vec3(length + d, underside(-d) + 0.38, -away - d)
                })
                .collect();
            let radii: Vec<f32> = (0..=24).map(|k| 0.13 + 0.025 * (k % 2) as f32).collect();
            b.tube(m.roof, &path, &radii, 10, false);
        });
    }
    let outside = vec2(WALL_X + 0.5, WALL_Z + 0.5);
    let parapet = [(0.47, 11.4), (0.47, 11.86), (0.52, 11.88), (0.52, 11.98), (-0.06, 11.98), (-0.06, 11.88), (0.0, 11.86), (0.0, -0.35)];
    ring(b, m.plaster, outside, &parapet.map(|(x, y)| vec2(x, y)));
    b.uv_scale = 1.0;
}

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

fn curtains(b: &mut Builder, m: &Palette) {
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
            drape(b, cloth, [110, 12], [rod + 0.04, 0.1], 11.0, phase, |t| (-1.38, 1.38, 0.035 + 0.035 * t));
            return;
        }
        for s in [-1.0, 1.0] {
            b.with(Mat4::from_scale(vec3(s, 1.0, 1.0)), |b| {
                drape(b, cloth, [54, 20], [rod + 0.04, 0.08], 6.0, phase + s, |t| {
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

fn furnish(b: &mut Builder, m: &Palette) {
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
    for (x, z, size) in [(-14.4, -8.8, 1.0), (-13.7, -8.9, 0.75), (-14.1, -8.2, 0.6), (10.8, 8.8, 0.95), (11.45, 8.85, 0.7), (-7.2, 8.85, 0.9), (3.6, -8.85, 0.85), (17.8, -3.6, 0.9), (17.8, 3.6, 1.0)] {
        jar(b, m, vec3(x, 0.0, z), size);
    }
    for (x, z) in [(-3.6, 8.85), (7.2, -8.85), (0.0, 8.85)] {
        bench(b, m, vec3(x, 0.0, z));
    }
}

fn fountain(b: &mut Builder, m: &Palette) {
    b.at(vec3(0.0, COURT, 0.0), |b| {
        b.uv_scale = 0.5;
        let basin = [(1.72, -0.02), (1.72, 0.1), (1.5, 0.1), (1.46, 0.14), (1.46, 0.44), (1.5, 0.48), (1.55, 0.5), (1.55, 0.58), (1.3, 0.58), (1.27, 0.55), (1.25, 0.2)];
        b.lathe(m.stone, &basin.map(|(r, y)| vec2(r, y)), 48);
        let water = b.material("water", 0x5f8f93);
        b.lathe(water, &[vec2(1.28, 0.42), vec2(0.0, 0.42)], 48);
        let stem = [(0.3, 0.38), (0.3, 0.5), (0.2, 0.56), (0.14, 0.66), (0.12, 0.85), (0.17, 0.98), (0.14, 1.06), (0.2, 1.1), (0.45, 1.16), (0.62, 1.26), (0.66, 1.34), (0.68, 1.35), (0.68, 1.39), (0.64, 1.39), (0.58, 1.3), (0.12, 1.24), (0.09, 1.4), (0.11, 1.5), (0.08, 1.56), (0.1, 1.6), (0.24, 1.66), (0.3, 1.74), (0.27, 1.75), (0.2, 1.7), (0.05, 1.68), (0.05, 1.8), (0.07, 1.85), (0.0, 1.93)];
        b.lathe(m.trim, &stem.map(|(r, y)| vec2(r, y)), 40);
        b.uv_scale = 1.0;
    });
}

/// A clay pot with a clipped tree: a ball, or a tall cone.
fn shrub(b: &mut Builder, m: &Palette, rng: &mut Rng, tall: bool) {
    let pot = [(0.0, 0.0), (0.26, 0.0), (0.28, 0.03), (0.36, 0.42), (0.41, 0.5), (0.42, 0.56), (0.38, 0.57), (0.36, 0.5), (0.0, 0.48)];
    b.lathe(m.clay, &pot.map(|(r, y)| vec2(r, y)), 32);
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
    b.lathe(m.iron, &[vec2(0.19, 2.94), vec2(0.2, 2.96), vec2(0.1, 3.06), vec2(0.03, 3.1), vec2(0.03, 3.16), vec2(0.0, 3.16), vec2(0.0, 3.1), vec2(0.17, 2.95), vec2(0.19, 2.94)], 18);
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
    let profile = [(0.0, 0.0), (0.14, 0.0), (0.16, 0.02), (0.24, 0.2), (0.29, 0.42), (0.28, 0.6), (0.2, 0.78), (0.12, 0.86), (0.11, 0.92), (0.16, 0.97), (0.16, 1.0), (0.12, 1.0), (0.08, 0.94), (0.08, 0.8), (0.0, 0.75)];
    b.at(base, |b| b.lathe(m.clay, &profile.map(|(r, y)| vec2(r, y) * size), 32));
}

fn bench(b: &mut Builder, m: &Palette, at: Vec3) {
    b.at(at, |b| {
        b.rounded(m.wood, vec3(-0.8, 0.42, -0.2), vec3(0.8, 0.48, 0.2), 0.01, 1);
        for x in [-0.6, 0.6] {
            b.block(m.wood, vec3(x - 0.04, 0.0, -0.16), vec3(x + 0.04, 0.43, 0.16));
        }
    });
}
