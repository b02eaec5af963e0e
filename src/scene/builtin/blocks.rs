//! A tower of wooden blocks that has been played for a while, in the manner of Kenzel's "jenga" scene.

use super::builder::{Builder, Rng, camera, fbm, light};
use crate::light::Light;
use crate::scene::Scene;
use glam::{Mat4, Quat, Vec3, vec2, vec3};
use std::f32::consts::FRAC_PI_2;

/// A block's length, height and width, metres times ten: three widths make a length.
const LENGTH: f32 = 0.75;
const HEIGHT: f32 = 0.15;
const WIDTH: f32 = 0.246;
/// How far blocks of a layer lie apart.
const PITCH: f32 = 0.252;
/// Radius of a block's edges and how many strips round them.
const EDGE: f32 = 0.012;
const STEPS: usize = 5;
/// The floor under the table.
const FLOOR: f32 = -4.4;
/// Air between a block and what it lies on.
const GAP: f32 = 0.0004;

/// Layers of the tower: for each of three places, how far the block is pulled out, or `None` where
/// it has been taken.
const LAYERS: [[Option<f32>; 3]; 17] = [
    [Some(0.0), Some(0.0), Some(0.0)],
    [Some(0.0), Some(0.0), Some(0.0)],
    [Some(0.0), None, Some(0.0)],
    [Some(0.0), Some(0.0), Some(0.0)],
    [None, Some(0.0), Some(0.02)],
    [Some(0.0), Some(0.17), Some(0.0)],
    [Some(0.0), None, Some(0.0)],
    [Some(0.0), Some(0.0), None],
    [Some(0.0), Some(-0.24), Some(0.0)],
    [None, Some(0.0), None],
    [Some(0.0), Some(0.0), Some(-0.03)],
    [Some(0.0), None, Some(0.0)],
    [Some(0.0), Some(0.31), Some(0.0)],
    [Some(0.0), Some(0.0), None],
    [Some(0.0), Some(0.0), Some(0.0)],
    [Some(0.0), Some(0.0), Some(0.01)],
    [None, Some(0.04), Some(0.0)],
];

/// Blocks that lie on the table: where their middle is in x and z, their turn about y, how they lie.
const FALLEN: [(f32, f32, f32, Pose); 10] = [
    (1.10, 0.42, 0.5, Pose::Flat),
    (0.95, -0.85, 2.2, Pose::Flat),
    (-1.45, 0.35, 1.3, Pose::Side),
    (-0.62, 1.22, -0.35, Pose::Flat),
    (0.38, 1.72, 0.95, Pose::Side),
    (1.75, -0.25, 1.75, Pose::End),
    (-1.25, -0.95, 0.15, Pose::Flat),
    (1.35, 1.35, 2.5, Pose::Flat),
    (-0.15, -1.55, 0.6, Pose::Side),
    SUPPORT,
];

/// The fallen block that another leans over.
const SUPPORT: (f32, f32, f32, Pose) = (-1.62, 1.45, 0.75, Pose::Flat);

/// The layer that a block leans against, and how steeply, radians.
const LEANT_ON: usize = 4;
const LEAN: f32 = 1.16;

/// How far the whole tower is turned about y.
const TOWER_TURN: f32 = 0.38;

/// Which side a block lies on.
#[derive(Clone, Copy)]
enum Pose {
    Flat,
    Side,
    End,
}

pub fn build() -> Scene {
    let mut b = Builder::new("blocks");
    let grain = b.texture(256, 256, |x, y| {
        let p = vec2(x as f32, y as f32) / 256.0;
        let rings = (p.y * 22.0 + 2.2 * fbm(p * vec2(2.0, 4.0), 3, 0, 3)).fract();
        let fibre = fbm(p * vec2(6.0, 96.0), 8, 0, 2);
        let tone = 0.86 + 0.08 * (rings - 0.5).abs() * 2.0 + 0.06 * fibre;
        [tone, tone * 0.97, tone * 0.92, 1.0]
    });
    let planks = b.texture(512, 512, |x, y| {
        let p = vec2(x as f32, y as f32) / 512.0;
        let plank = y / 128;
        let joint = y % 128 < 2;
        let shift = plank as f32 * 7.3;
        let rings = (p.y * 14.0 + 1.6 * fbm(vec2(p.x * 2.0 + shift, p.y * 6.0), 21, 0, 3)).fract();
        let fibre = fbm(vec2(p.x * 5.0 + shift, p.y * 128.0), 23, 0, 2);
        let tone = 0.70 + 0.05 * (plank * 7 % 4) as f32 + 0.10 * (rings - 0.5).abs() * 2.0 + 0.08 * fibre;
        let tone = if joint { tone * 0.55 } else { tone };
        [tone, tone * 0.95, tone * 0.90, 1.0]
    });
    let woods = [
        b.textured("beech", 0xe6c08c, grain),
        b.textured("light beech", 0xf0d2a2, grain),
        b.textured("dark beech", 0xd4a56c, grain),
    ];
    let table = b.textured("table", 0x8f6a52, planks);
    let mut rng = Rng::new(4);

    // The table's top lies at y = 0.
    b.uv_scale = 0.4;
    b.rounded(table, vec3(-4.2, -0.2, -3.2), vec3(4.2, 0.0, 3.2), 0.05, 2);
    for (x, z) in [(-3.8, -2.8), (3.8, -2.8), (-3.8, 2.8), (3.8, 2.8)] {
        b.cuboid_sides(
            table,
            vec3(x - 0.16, FLOOR - 0.01, z - 0.16),
            vec3(x + 0.16, -0.19, z + 0.16),
            [true, true, false, false, true, true],
        );
    }
    let floor = b.material("floor", 0xb9b2a6);
    b.heightfield(floor, vec2(-30.0, -30.0), vec2(30.0, 30.0), [1, 1], |_, _| FLOOR);
    b.uv_scale = 1.3;
    for (level, layer) in LAYERS.iter().enumerate() {
        let loose = if level == LEANT_ON { 0.0 } else { 0.012 };
        let quarter = if level % 2 == 0 { 0.0 } else { FRAC_PI_2 };
        let turn = TOWER_TURN + quarter + rng.range(-loose, loose);
        let y = (level as f32 + 0.5) * HEIGHT + (level + 1) as f32 * GAP;
        for (place, pulled) in layer.iter().enumerate() {
            // Nudges small enough that neighbours keep clear of each other.
            let nudge = rng.range(-loose, loose);
            let wood = woods[rng.index(3)];
            b.uv_offset = vec2(rng.unit(), rng.unit());
            if let Some(pulled) = pulled {
                b.turned(Vec3::Y * y, turn, |b| {
                    b.at(vec3(pulled + nudge, 0.0, (place as f32 - 1.0) * PITCH), |b| {
                        block(b, wood);
                    });
                });
            }
        }
    }
    for (x, z, turn, pose) in FALLEN {
        let (roll, half) = match pose {
            Pose::Flat => (Quat::IDENTITY, HEIGHT * 0.5),
            Pose::Side => (Quat::from_rotation_x(FRAC_PI_2), WIDTH * 0.5),
            Pose::End => (Quat::from_rotation_z(FRAC_PI_2), LENGTH * 0.5),
        };
        let place = Mat4::from_rotation_translation(Quat::from_rotation_y(turn) * roll, vec3(x, half + GAP, z));
        let wood = woods[rng.index(3)];
        b.uv_offset = vec2(rng.unit(), rng.unit());
        b.with(place, |b| block(b, wood));
    }
    leaning(&mut b, woods);
    b.finish(
        vec![
            camera("default", vec3(3.1, 2.5, 4.6), vec3(0.1, 1.0, 0.1), 40.0, 0.1, 40.0),
            camera("low", vec3(-2.6, 0.75, 2.9), vec3(0.1, 1.1, 0.0), 48.0, 0.05, 40.0),
            camera("close", vec3(1.9, 2.3, 1.5), vec3(0.0, 1.6, 0.0), 42.0, 0.05, 40.0),
            camera("fallen", vec3(0.9, 1.15, 3.0), vec3(0.1, 0.05, 0.9), 42.0, 0.05, 40.0),
            camera("above", vec3(0.6, 6.4, 1.6), vec3(0.1, 0.3, 0.1), 45.0, 0.1, 40.0),
        ],
        vec![
            light(
                "sun",
                Light::Directional {
                    to_light: vec3(-0.58, 0.62, 0.60),
                    angular_radius: 0.0,
                    color: vec3(1.0, 0.95, 0.86),
                },
            ),
            light(
                "spot",
                Light::Spot {
                    position: vec3(-3.2, 4.6, 2.4),
                    direction: vec3(3.2, -3.8, -2.3),
                    outer_angle: 30.0,
                    range: 20.0,
                    radius: 0.0,
                    color: vec3(38.0, 35.0, 30.0),
                },
            ),
            light(
                "omni",
                Light::Omni { position: vec3(-1.6, 2.6, 1.5), range: 16.0, radius: 0.0, color: vec3(9.0, 7.8, 6.0) },
            ),
            light(
                "window",
                Light::RectArea {
                    center: vec3(-4.0, 3.4, 1.2),
                    half_u: vec3(-0.25, 0.0, -0.85),
                    half_v: vec3(0.42, 0.68, -0.12),
                    range: 20.0,
                    color: vec3(40.0, 40.0, 40.0),
                },
            ),
        ],
    )
}

/// A block around the origin, its length along x.
fn block(b: &mut Builder, wood: u32) {
    let half = vec3(LENGTH, HEIGHT, WIDTH) * 0.5;
    b.rounded(wood, -half, half, EDGE, STEPS);
}

/// Two blocks with one edge on the table: over a block that lies flat, and against the tower.
/// The edges are cylinders of radius [`EDGE`]; their axes are what the contacts are computed with.
fn leaning(b: &mut Builder, woods: [u32; 3]) {
    // Draws a block whose lower long edge has its axis at the origin, raised by `angle` towards +x.
    let raised = |b: &mut Builder, wood: u32, angle: f32| {
        let lift = Mat4::from_rotation_translation(Quat::from_rotation_z(angle), Vec3::Y * (EDGE + GAP));
        b.with(lift, |b| {
            b.at(vec3(LENGTH * 0.5 - EDGE, HEIGHT * 0.5 - EDGE, 0.0), |b| {
                block(b, wood);
            });
        });
    };
    // Over the block: the upper edge of its side is `reach` away and touches the underside.
    let (x, z, turn, _) = SUPPORT;
    let reach = 0.46;
    let rise = HEIGHT - 2.0 * EDGE;
    let angle = rise.atan2(reach) + ((2.0 * EDGE + GAP) / rise.hypot(reach)).asin();
    b.uv_offset = vec2(0.31, 0.77);
    b.turned(vec3(x, 0.0, z), turn - FRAC_PI_2, |b| {
        let edge = WIDTH * 0.5 - EDGE;
        b.at(vec3(-edge - reach, 0.0, 0.06), |b| raised(b, woods[1], angle));
    });
    // Against the tower: the upper end's lower edge touches the side of a layer.
    b.uv_offset = vec2(0.64, 0.12);
    b.turned(Vec3::ZERO, TOWER_TURN - FRAC_PI_2, |b| {
        let side = PITCH + WIDTH * 0.5 + GAP;
        let run = (LENGTH - 2.0 * EDGE) * LEAN.cos() + EDGE;
        b.at(vec3(-side - run, 0.0, 0.08), |b| raised(b, woods[0], LEAN));
    });
}
