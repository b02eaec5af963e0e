//! A dining room with laid tables under pendant lamps; the sun falls in through tall windows.
//!
//! The room spans ±[`ROOM_X`] and ±[`ROOM_Z`]; the windows are in the wall at -z.

mod tables;

use super::builder::{Builder, Rng, Shading, camera, fbm, light};
use crate::light::Light;
use crate::scene::Scene;
use glam::{Mat4, Vec3, vec2, vec3};
use std::f32::consts::{FRAC_PI_2, PI, TAU};
use tables::{bottle, cup, long_table, pendant, plate, round_table, vase};

/// What the scene shows.
pub const DESCRIPTION: &str = "A dining room with laid tables, pendant lamps and tall windows";

const ROOM_X: f32 = 7.0;
const ROOM_Z: f32 = 4.0;
const CEILING: f32 = 3.6;
/// The windows' outer face lies this far behind their wall's inner one.
const WINDOW_WALL: f32 = 0.42;
const WINDOWS: [f32; 4] = [-4.95, -1.65, 1.65, 4.95];
const WINDOW_HALF: f32 = 1.02;
const SILL: f32 = 0.5;
const LINTEL: f32 = 3.0;
const TABLE: f32 = 0.75;
/// Where the pendant lamps' shades end.
const LAMP: f32 = 1.86;

struct Palette {
    wall: u32,
    white: u32,
    floor: u32,
    oak: u32,
    walnut: u32,
    black: u32,
    brass: u32,
    china: u32,
    blue: u32,
    steel: u32,
    glass: u32,
    bulb: u32,
    cushion: [u32; 2],
    petal: [u32; 3],
    leaf: u32,
    grass: u32,
    cloth: u32,
}

/// Generates the scene.
pub fn build() -> Scene {
    let mut b = Builder::new("hall");
    let boards = b.texture(512, 512, floor_texel);
    let grain = b.texture(256, 256, |x, y| {
        let p = vec2(x as f32 / 256.0, y as f32 / 256.0);
        let v = 0.8 + 0.25 * fbm(vec2(p.x * 3.0, p.y * 48.0), 4, 0, 3);
        [v, v * 0.98, v * 0.95, 1.0]
    });
    let plaster = b.texture(256, 256, |x, y| {
        let v = 0.92 + 0.08 * fbm(vec2(x as f32, y as f32) / 16.0, 2, 16, 3);
        [v, v, v, 1.0]
    });
    let m = Palette {
        wall: b.textured("painted wall", 0x9fb39c, plaster),
        white: b.textured("white paint", 0xf1ece0, plaster),
        floor: b.textured("floor boards", 0xffffff, boards),
        oak: b.textured("oak", 0xc79a63, grain),
        walnut: b.textured("walnut", 0x7a4a2e, grain),
        black: b.material("black iron", 0x2d2c2b),
        brass: b.material("brass", 0xc79d4f),
        china: b.material("china", 0xf4f1e8),
        blue: b.material("blue glaze", 0x4f7fa8),
        steel: b.material("steel", 0xb9bcc0),
        glass: b.material("green glass", 0x3f6b4c),
        bulb: b.material("bulb", 0xfff6df),
        cushion: [b.material("mustard felt", 0xcf9a3c), b.material("petrol felt", 0x3b6f78)],
        petal: [
            b.double_sided("red petals", 0xc8443c),
            b.double_sided("yellow petals", 0xe8b93e),
            b.double_sided("white petals", 0xf3ede4),
        ],
        leaf: b.double_sided("leaves", 0x5b8a45),
        grass: b.material("lawn", 0x7f9a58),
        cloth: b.double_sided("linen", 0xe9dfca),
    };
    room(&mut b, &m);
    windows(&mut b, &m);
    panelling(&mut b, &m);
    counter(&mut b, &m);
    let mut rng = Rng::new(21);
    for (k, x) in WINDOWS.into_iter().enumerate() {
        let x = x * 0.97;
        b.turned(vec3(x, 0.0, -2.0), 0.3 * k as f32, |b| round_table(b, &m, &mut rng, k));
    }
    for (k, x) in [-3.5, 0.6, 4.7].into_iter().enumerate() {
        b.at(vec3(x, 0.0, 1.45), |b| long_table(b, &m, &mut rng, k));
    }
    for (k, x) in [-3.5, 0.6, 4.7].into_iter().enumerate() {
        b.at(vec3(x, 0.0, 1.45), |b| pendant(b, &m, k == 2));
    }
    for x in [WINDOWS[0] * 0.97, WINDOWS[1] * 0.97, WINDOWS[2] * 0.97, WINDOWS[3] * 0.97] {
        b.at(vec3(x, 0.0, -2.0), |b| pendant(b, &m, false));
    }
    b.finish(
        vec![
            camera("room", vec3(6.55, 1.65, -0.35), vec3(-1.0, 0.85, -0.85), 58.0, 0.05, 60.0),
            camera("table", vec3(-0.35, 1.5, -1.1), vec3(-1.65, 0.72, -2.4), 52.0, 0.05, 60.0),
            camera("windows", vec3(-5.9, 1.6, 3.4), vec3(1.2, 0.9, -2.6), 62.0, 0.05, 60.0),
            camera("counter", vec3(-2.4, 1.6, 0.4), vec3(-7.0, 1.2, -0.4), 60.0, 0.05, 60.0),
            camera("lamp", vec3(2.7, 1.5, 3.3), vec3(4.8, 1.1, 1.3), 58.0, 0.05, 60.0),
            camera("beams", vec3(6.7, 3.2, 3.7), vec3(-0.8, 0.2, -0.9), 68.0, 0.05, 60.0),
        ],
        vec![
            light(
                "sun",
                Light::Directional {
                    to_light: vec3(0.27, 0.52, -0.95),
                    angular_radius: 0.0,
                    color: vec3(1.0, 0.93, 0.8) * 1.5,
                },
            ),
            light(
                "pendant",
                Light::Spot {
                    position: vec3(0.6, LAMP - 0.01, 1.45),
                    direction: vec3(0.0, -1.0, 0.0),
                    outer_angle: 64.0,
                    range: 12.0,
                    radius: 0.0,
                    color: vec3(3.4, 2.8, 2.0),
                },
            ),
            light(
                "cage lamp",
                Light::Omni {
                    position: vec3(4.7, LAMP + 0.1, 1.45),
                    range: 20.0,
                    radius: 0.0,
                    color: vec3(4.6, 3.9, 2.8),
                },
            ),
            light(
                "ceiling lamp",
                Light::Hemisphere {
                    position: vec3(0.6, 3.3, -0.3),
                    direction: vec3(0.0, -1.0, 0.0),
                    range: 20.0,
                    color: vec3(9.0, 8.4, 7.2),
                },
            ),
            light(
                "window",
                Light::RectArea {
                    center: vec3(-1.65, 1.75, -3.85),
                    half_u: vec3(1.0, 0.0, 0.0),
                    half_v: vec3(0.0, 1.22, 0.0),
                    range: 25.0,
                    color: vec3(3.0, 3.3, 3.8),
                },
            ),
        ],
    )
}

/// Boards along u, 4 across the texture, with staggered ends.
fn floor_texel(x: u32, y: u32) -> [f32; 4] {
    let (board, v) = (y / 64, y % 64);
    let shift = (board * 197) % 512;
    let u = (x + shift) % 512;
    let piece = board * 2 + u / 256;
    let tone = 0.82 + 0.18 * fbm(vec2(piece as f32 * 7.3, 0.5), 8, 0, 1);
    let p = vec2(u as f32 / 512.0 * 4.0, y as f32 / 8.0);
    let grain = 0.9 + 0.16 * fbm(p + vec2(piece as f32 * 17.0, 0.0), 6, 0, 3);
    let joint = v < 2 || u % 256 < 2;
    let k = tone * grain * if joint { 0.55 } else { 1.0 };
    [0.80 * k, 0.67 * k, 0.52 * k, 1.0]
}

fn room(b: &mut Builder, m: &Palette) {
    let (x, z, y) = (ROOM_X, ROOM_Z, CEILING);
    let t = 0.3;
    b.uv_scale = 0.55;
    b.cuboid(m.floor, vec3(-x - t, -0.3, -z - WINDOW_WALL), vec3(x + t, 0.0, z + t));
    b.uv_scale = 0.5;
    b.block(m.white, vec3(-x - t, y, -z - WINDOW_WALL), vec3(x + t, y + 0.25, z + t));
    let ceiling = [vec3(-x, y, -z), vec3(x, y, -z), vec3(x, y, z), vec3(-x, y, z)];
    b.polygon(m.white, &ceiling);
    for s in [-1.0f32, 1.0] {
        let (near, far) = (s * x, s * (x + t));
        b.cuboid_sides(
            m.wall,
            vec3(near.min(far), 0.0, -z - WINDOW_WALL),
            vec3(near.max(far), y, z + t),
            [true, true, false, false, true, true],
        );
    }
    b.cuboid_sides(m.wall, vec3(-x, 0.0, z), vec3(x, y, z + t), [false, false, false, false, true, true]);
    // Beams from wall to wall, and a rail under their ends.
    for k in 0..9 {
        let x = (k as f32 - 4.0) * 1.55;
        b.cuboid_sides(
            m.walnut,
            vec3(x - 0.09, y - 0.24, -z),
            vec3(x + 0.09, y, z),
            [true, true, true, false, false, false],
        );
    }
    b.uv_scale = 0.1;
    b.polygon(
        m.grass,
        &[vec3(-60.0, -0.45, -80.0), vec3(-60.0, -0.45, 60.0), vec3(60.0, -0.45, 60.0), vec3(60.0, -0.45, -80.0)],
    );
    b.uv_scale = 1.0;
    // A hedge beyond the windows, low enough for the sun.
    let mut rng = Rng::new(5);
    for k in 0..9 {
        let center = vec3(k as f32 * 2.4 - 9.6, 0.0, -13.0 + rng.range(-0.5, 0.5));
        let size = vec3(1.7, rng.range(0.7, 1.2), 1.0);
        b.blob(m.leaf, 2, 180.0, |d| {
            let bump = 1.0 + 0.25 * (fbm(vec2(d.x * 4.0 + k as f32, d.y * 4.0 + d.z * 3.0), 3, 0, 2) - 0.5);
            center + d * size * bump
        });
    }
}

fn windows(b: &mut Builder, m: &Palette) {
    let (back, front) = (-ROOM_Z - WINDOW_WALL, -ROOM_Z);
    b.uv_scale = 0.5;
    let sides = [false, false, false, false, true, true];
    b.cuboid_sides(m.wall, vec3(-ROOM_X, 0.0, back), vec3(ROOM_X, SILL, front), sides);
    b.cuboid_sides(m.wall, vec3(-ROOM_X, LINTEL, back), vec3(ROOM_X, CEILING, front), sides);
    let mut edges = vec![-ROOM_X];
    for x in WINDOWS {
        edges.extend([x - WINDOW_HALF, x + WINDOW_HALF]);
    }
    edges.push(ROOM_X);
    for pier in edges.chunks_exact(2) {
        b.cuboid_sides(
            m.wall,
            vec3(pier[0], SILL, back),
            vec3(pier[1], LINTEL, front),
            [true, true, false, false, true, true],
        );
    }
    for x in WINDOWS {
        b.at(vec3(x, 0.0, 0.0), |b| window(b, m, back, front));
    }
    b.uv_scale = 1.0;
}

fn window(b: &mut Builder, m: &Palette, back: f32, front: f32) {
    let h = WINDOW_HALF;
    // Sill and lintel of the opening, then the board on the inside.
    b.polygon(m.white, &[vec3(-h, SILL, front), vec3(h, SILL, front), vec3(h, SILL, back), vec3(-h, SILL, back)]);
    b.polygon(
        m.white,
        &[vec3(-h, LINTEL, back), vec3(h, LINTEL, back), vec3(h, LINTEL, front), vec3(-h, LINTEL, front)],
    );
    b.rounded(
        m.white,
        vec3(-h - 0.08, SILL - 0.035, front - 0.2),
        vec3(h + 0.08, SILL + 0.012, front + 0.12),
        0.012,
        2,
    );
    // The architrave around the opening, on the room's wall.
    let (r, w) = (0.1, front + 0.025);
    for s in [-1.0f32, 1.0] {
        let (a, c) = (s * (h - 0.012), s * (h + r));
        b.cuboid_sides(
            m.white,
            vec3(a.min(c), SILL, front - 0.02),
            vec3(a.max(c), LINTEL + r, w),
            [true, true, false, true, false, true],
        );
    }
    b.cuboid_sides(
        m.white,
        vec3(-h + 0.012, LINTEL - 0.012, front - 0.02),
        vec3(h - 0.012, LINTEL + r, w),
        [false, false, true, true, false, true],
    );
    // Frame and glazing bars.
    let (z0, z1) = (back + 0.12, back + 0.18);
    let bar = |b: &mut Builder, x: [f32; 2], y: [f32; 2], d: f32| {
        b.cuboid(m.white, vec3(x[0], y[0], z0 + d), vec3(x[1], y[1], z1 - d));
    };
    for s in [-1.0f32, 1.0] {
        let (a, c) = (s * (h - 0.07), s * (h + 0.02));
        bar(b, [a.min(c), a.max(c)], [SILL - 0.02, LINTEL + 0.02], 0.0);
    }
    for y in [SILL - 0.02, LINTEL - 0.07] {
        bar(b, [-h + 0.06, h - 0.06], [y, y + 0.09], 0.004);
    }
    bar(b, [-0.045, 0.045], [SILL + 0.05, LINTEL - 0.05], 0.007);
    bar(b, [-h + 0.06, h - 0.06], [2.4, 2.47], 0.009);
    for x in [-0.5, 0.5] {
        bar(b, [x - 0.014, x + 0.014], [SILL + 0.05, LINTEL - 0.05], 0.018);
    }
    for y in [1.2, 1.8] {
        bar(b, [-h + 0.06, h - 0.06], [y - 0.014, y + 0.014], 0.021);
    }
    // Linen curtains drawn aside, on a rod in front of the wall.
    let rod = LINTEL + 0.18;
    b.tube(m.brass, &[vec3(-h - 0.45, rod, front + 0.11), vec3(h + 0.45, rod, front + 0.11)], &[0.014; 2], 10, false);
    for s in [-1.0f32, 1.0] {
        b.with(Mat4::from_scale(vec3(s, 1.0, 1.0)), |b| {
            b.icosphere(m.brass, vec3(h + 0.46, rod, front + 0.11), 0.03, 1);
            let cells = [44, 10];
            b.lattice(m.cloth, cells[0] + 1, cells[1] + 1, Shading::Smooth(60.0), |i, j| {
                let (u, t) = (i as f32 / cells[0] as f32, j as f32 / cells[1] as f32);
                let spread = 1.0 + 0.12 * t * t;
                let x = h + 0.24 + (u - 0.5) * 0.36 * spread;
                let fold = (u * 6.0 * TAU + 0.5 * t).sin() * (0.028 + 0.014 * t);
                (vec3(x, rod + 0.03 - t * (rod + 0.01), front + 0.11 + fold), vec2(u, t))
            });
        });
    }
}

/// Wainscot, skirting, pictures and a door.
fn panelling(b: &mut Builder, m: &Palette) {
    b.uv_scale = 0.5;
    // Each piece: its wall's turn and distance, and from where to where it runs; the door interrupts one.
    let pieces = [
        (PI, ROOM_Z, -ROOM_X, ROOM_X),
        (-FRAC_PI_2, ROOM_X, -ROOM_Z, -0.8),
        (-FRAC_PI_2, ROOM_X, 0.4, ROOM_Z),
        (FRAC_PI_2, ROOM_X, -ROOM_Z, ROOM_Z),
    ];
    for (turn, away, x0, x1) in pieces {
        b.turned(Vec3::ZERO, turn, |b| {
            let z = -away;
            b.cuboid_sides(m.white, vec3(x0, 0.0, z), vec3(x1, 1.1, z + 0.02), [true, true, false, false, false, true]);
            b.rounded(m.white, vec3(x0 - 0.01, 1.08, z - 0.02), vec3(x1 + 0.01, 1.14, z + 0.05), 0.015, 2);
            b.cuboid_sides(
                m.white,
                vec3(x0, 0.0, z + 0.02),
                vec3(x1, 0.14, z + 0.04),
                [true, true, false, true, false, true],
            );
            let count = ((x1 - x0) / 0.95).round();
            let width = (x1 - x0) / count;
            for k in 0..count as usize {
                let a = x0 + k as f32 * width + 0.09;
                let c = x0 + (k + 1) as f32 * width - 0.09;
                b.rounded(m.white, vec3(a, 0.24, z), vec3(c, 0.98, z + 0.036), 0.014, 1);
            }
        });
    }
    // Pictures on the wall that faces the windows.
    b.turned(Vec3::ZERO, PI, |b| {
        for (k, (x, w, h)) in
            [(-5.2, 0.5, 0.65), (-3.9, 0.42, 0.42), (-0.6, 0.95, 0.6), (3.2, 0.42, 0.55), (4.4, 0.42, 0.55)]
                .into_iter()
                .enumerate()
        {
            let y = 1.95;
            let z = -ROOM_Z;
            b.rounded(m.walnut, vec3(x - w, y - h, z - 0.01), vec3(x + w, y + h, z + 0.04), 0.012, 1);
            b.cuboid_sides(
                m.white,
                vec3(x - w + 0.05, y - h + 0.05, z),
                vec3(x + w - 0.05, y + h - 0.05, z + 0.043),
                [true, true, true, true, false, true],
            );
            let color = [m.blue, m.petal[1], m.cushion[1], m.petal[0], m.leaf][k];
            b.cuboid_sides(
                color,
                vec3(x - w * 0.66, y - h * 0.62, z),
                vec3(x + w * 0.66, y + h * 0.62, z + 0.046),
                [true, true, true, true, false, true],
            );
        }
    });
    // The door.
    b.turned(Vec3::ZERO, -FRAC_PI_2, |b| {
        let z = -ROOM_X;
        b.cuboid_sides(
            m.walnut,
            vec3(-0.68, 0.0, z),
            vec3(0.28, 2.15, z + 0.03),
            [true, true, false, true, false, true],
        );
        for (y0, y1) in [(0.2, 0.95), (1.1, 1.98)] {
            for x in [-0.6, -0.15] {
                b.rounded(m.walnut, vec3(x, y0, z), vec3(x + 0.36, y1, z + 0.045), 0.014, 1);
            }
        }
        for (x0, x1, y1) in [(-0.8, -0.68, 2.28), (0.28, 0.4, 2.28)] {
            b.cuboid_sides(m.white, vec3(x0, 0.0, z), vec3(x1, y1, z + 0.05), [true, true, false, true, false, true]);
        }
        b.cuboid_sides(
            m.white,
            vec3(-0.68, 2.15, z),
            vec3(0.28, 2.28, z + 0.05),
            [false, false, true, true, false, true],
        );
        b.tube(
            m.brass,
            &[
                vec3(0.2, 1.02, z + 0.02),
                vec3(0.2, 1.02, z + 0.09),
                vec3(0.19, 1.02, z + 0.1),
                vec3(0.08, 1.02, z + 0.1),
            ],
            &[0.011; 4],
            8,
            false,
        );
    });
    b.uv_scale = 1.0;
}

/// A counter with shelves of crockery on the wall at -x.
fn counter(b: &mut Builder, m: &Palette) {
    b.turned(vec3(-ROOM_X, 0.0, -0.2), FRAC_PI_2, |b| {
        b.uv_scale = 0.7;
        b.block(m.walnut, vec3(-2.3, 0.08, 0.02), vec3(2.3, 0.93, 0.6));
        b.block(m.black, vec3(-2.25, 0.0, 0.02), vec3(2.25, 0.09, 0.55));
        b.rounded(m.oak, vec3(-2.0, 0.92, 0.0), vec3(2.35, 0.97, 0.66), 0.012, 2);
        for k in 0..6 {
            let x = -2.25 + k as f32 * 0.75;
            b.rounded(m.walnut, vec3(x + 0.03, 0.14, 0.55), vec3(x + 0.72, 0.88, 0.622), 0.01, 1);
            b.tube(
                m.brass,
                &[
                    vec3(x + 0.3, 0.8, 0.615),
                    vec3(x + 0.3, 0.8, 0.645),
                    vec3(x + 0.45, 0.8, 0.645),
                    vec3(x + 0.45, 0.8, 0.615),
                ],
                &[0.006; 4],
                6,
                false,
            );
        }
        for (row, y) in [1.45, 1.87, 2.29].into_iter().enumerate() {
            b.rounded(m.oak, vec3(-2.2, y, -0.01), vec3(2.2, y + 0.035, 0.3), 0.008, 1);
            for x in [-1.9, -0.65, 0.65, 1.9] {
                b.block(m.black, vec3(x - 0.012, y - 0.14, -0.01), vec3(x + 0.012, y + 0.005, 0.02));
                b.tube(m.black, &[vec3(x, y - 0.12, 0.005), vec3(x, y + 0.005, 0.26)], &[0.008; 2], 6, false);
            }
            for k in 0..14 {
                let at = vec3(-2.05 + k as f32 * 0.315, y + 0.034, 0.15);
                match (row, k % 7) {
                    (0, 2 | 3) | (1, 5) => {
                        for i in 0..5 {
                            b.at(at + Vec3::Y * 0.014 * i as f32, |b| plate(b, m.china, 0.115, 14));
                        }
                    }
                    (0, _) | (1, 0 | 1) => b.turned(at, k as f32, |b| cup(b, [m.china, m.blue][k % 2], 12)),
                    (2, 1 | 4) => b.at(at, |b| vase(b, m.blue, 1.2)),
                    (2, 6) => {}
                    _ => b.at(at, |b| bottle(b, m.glass, 14)),
                }
            }
        }
        b.at(vec3(1.5, 0.968, 0.3), |b| vase(b, m.china, 1.9));
        b.at(vec3(-1.7, 0.968, 0.28), |b| bottle(b, m.glass, 16));
        b.at(vec3(-1.55, 0.968, 0.4), |b| bottle(b, m.glass, 16));
        for i in 0..8 {
            b.at(vec3(-0.6, 0.968 + 0.016 * i as f32, 0.33), |b| plate(b, m.china, 0.13, 20));
        }
        b.uv_scale = 1.0;
    });
}
