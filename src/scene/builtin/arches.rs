//! A colonnaded atrium: two storeys of round arches around a court open to the sky.
//!
//! The court lies along x. Column lines are at ±[`COLUMNS_X`] and ±[`COLUMNS_Z`]; aisles run between
//! them and the outer walls at ±[`WALL_X`] and ±[`WALL_Z`].

mod furnishings;
mod masonry;

use super::builder::{Builder, CREASED, Patch, Rng, Shading, camera, fbm, light, pairs};
use crate::light::Light;
use crate::scene::Scene;
use furnishings::{curtains, furnish};
use glam::{Vec2, Vec3, vec2, vec3};
use masonry::{ArchWall, arch_wall, archivolt, balustrade, column, door, ring};
use std::f32::consts::{FRAC_PI_2, PI, TAU};

/// What the scene shows.
pub const DESCRIPTION: &str = "A colonnaded atrium with curtains, two storeys of arches around a court open to the sky";

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
    let paving = b.texture(512, 512, floor_texel);
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
            light(
                "sun",
                Light::Directional {
                    to_light: vec3(0.42, 1.0, 0.36),
                    angular_radius: 0.0,
                    color: vec3(1.0, 0.95, 0.86) * 1.1,
                },
            ),
            light(
                "lantern",
                Light::Omni { position: vec3(-9.0, 2.72, -7.5), range: 25.0, radius: 0.0, color: vec3(9.0, 7.6, 5.6) },
            ),
            light(
                "spot",
                Light::Spot {
                    position: vec3(9.5, 9.4, 4.4),
                    direction: vec3(-7.5, -9.4, -5.2),
                    outer_angle: 34.0,
                    range: 40.0,
                    radius: 0.0,
                    color: vec3(150.0, 138.0, 115.0),
                },
            ),
            light(
                "hemisphere",
                Light::Hemisphere {
                    position: vec3(0.0, 9.6, 0.0),
                    direction: vec3(0.0, -1.0, 0.0),
                    range: 40.0,
                    color: vec3(60.0, 58.0, 54.0),
                },
            ),
            light(
                "skylight",
                Light::RectArea {
                    center: vec3(0.0, 10.4, 0.0),
                    half_u: vec3(6.0, 0.0, 0.0),
                    half_v: vec3(0.0, 0.0, 3.0),
                    range: 50.0,
                    color: vec3(1.6, 1.7, 1.9),
                },
            ),
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
                b.polygon(
                    m.plaster,
                    &[vec3(-inner, y0, z), vec3(inner, y0, z), vec3(inner, y1, z), vec3(-inner, y1, z)],
                );
            }
        });
    }
    // Skirting, set off from the wall.
    let skirting =
        [vec2(0.04, floor - 0.02), vec2(0.04, floor + 0.22), vec2(0.02, floor + 0.26), vec2(-0.02, floor + 0.26)];
    if storey == 1 {
        ring(b, m.stone, vec2(WALL_X, WALL_Z), &skirting);
    }
    b.uv_scale = 1.0;
}

fn floors(b: &mut Builder, m: &Palette) {
    let flat = |b: &mut Builder, material: u32, x: [f32; 2], z: [f32; 2], y: f32| {
        b.polygon(material, &[vec3(x[0], y, z[0]), vec3(x[0], y, z[1]), vec3(x[1], y, z[1]), vec3(x[1], y, z[0])]);
    };
    let court = vec2(COLUMNS_X - 0.45, COLUMNS_Z - 0.45);
    let gallery = vec2(COLUMNS_X - HALF_WALL, COLUMNS_Z - HALF_WALL);
    for (y, edge) in FLOOR.into_iter().zip([court - 0.04, gallery]) {
        b.uv_scale = 0.625;
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
            let corbel = [
                vec2(x, spring - 0.42),
                vec2(x - s * 0.06, spring - 0.38),
                vec2(x - s * 0.24, spring - 0.1),
                vec2(x - s * 0.24, spring),
                vec2(x, spring),
            ];
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
    let band = pairs(&[
        -0.02, 4.99, 0.1, 4.99, 0.1, 5.04, 0.12, 5.06, 0.12, 5.14, 0.15, 5.2, 0.21, 5.25, 0.24, 5.27, 0.24, 5.36, 0.22,
        5.4, 0.0, 5.4,
    ]);
    ring(b, m.trim, face, &band);
    let upper = pairs(&[
        -0.02, 9.62, 0.12, 9.62, 0.12, 9.67, 0.14, 9.69, 0.16, 9.76, 0.22, 9.82, 0.25, 9.84, 0.25, 9.95, -0.02, 9.95,
    ]);
    ring(b, m.trim, face, &upper);
    // Dentils under the lower band's crown.
    each_bay(b, |b, _, _| {
        for k in 0..15 {
            let x = (k as f32 - 7.0) * 0.24;
            b.cuboid_sides(
                m.trim,
                vec3(x - 0.05, 5.07, HALF_WALL + 0.1),
                vec3(x + 0.05, 5.19, HALF_WALL + 0.19),
                [true, true, true, false, false, true],
            );
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
    ring(
        b,
        m.wood,
        face,
        &[vec2(-4.3, underside(-4.3)), vec2(eave, underside(eave)), vec2(eave, underside(eave) + 0.3)],
    );
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
    let parapet =
        pairs(&[0.47, 11.4, 0.47, 11.86, 0.52, 11.88, 0.52, 11.98, -0.06, 11.98, -0.06, 11.88, 0.0, 11.86, 0.0, -0.35]);
    ring(b, m.plaster, outside, &parapet);
    b.uv_scale = 1.0;
}
