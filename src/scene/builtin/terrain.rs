//! A village among hills, one kilometre across, under a low sun: for shadows from arm's length to
//! the horizon.

use super::builder::{Builder, Patch, Rng, Shading, camera, fbm, light};
use crate::light::Light;
use crate::scene::Scene;
use glam::{Mat4, Quat, Vec2, Vec3, Vec3Swizzles, vec2, vec3};
use std::f32::consts::{FRAC_PI_2, PI, TAU};

/// Half the landscape's edge, metres, and its cells along an edge.
const HALF: f32 = 500.0;
const CELLS: usize = 200;
/// Half the road's width, and how far its surface lies above the ground beside it.
const ROAD: f32 = 2.9;
const ROAD_RISE: f32 = 0.16;
/// Trees on the hills, trees in the gardens, and tufts of grass around the village.
const TREES: usize = 1260;
const GARDEN_TREES: usize = 130;
const TUFTS: usize = 2200;

/// A flat place for a building.
struct Pad {
    center: Vec2,
    radius: f32,
    height: f32,
}

/// What gives the ground its height.
#[derive(Default)]
struct Land {
    pads: Vec<Pad>,
}

/// 0 below `low`, 1 above `high`, smooth between.
fn smoothstep(low: f32, high: f32, x: f32) -> f32 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Where the road is at z, and its slope dx/dz.
fn road(z: f32) -> (f32, f32) {
    let x = 24.0 * (z / 90.0).sin() + 46.0 * (z / 210.0 + 0.6).sin() - 26.0;
    let slope = 24.0 / 90.0 * (z / 90.0).cos() + 46.0 / 210.0 * (z / 210.0 + 0.6).cos();
    (x, slope)
}

/// Distance from the road's middle, nearly.
fn road_distance(p: Vec2) -> f32 {
    let (x, slope) = road(p.y);
    (p.x - x).abs() / (1.0 + slope * slope).sqrt()
}

/// The ground before anything was built: a valley along the road between hills.
fn natural(p: Vec2) -> f32 {
    let hills = 120.0 * (fbm((p + 733.0) / 300.0, 5, 0, 5) - 0.22);
    let far = smoothstep(70.0, 430.0, p.length()).max(0.3 * smoothstep(40.0, 160.0, p.length()));
    let valley = 0.22 + 0.78 * smoothstep(20.0, 190.0, road_distance(p));
    5.0 * fbm(p / 90.0, 12, 0, 3) + hills * far * valley
}

/// Height of the road's surface.
fn road_height(z: f32) -> f32 {
    let steps = [-36.0, -24.0, -12.0, 0.0, 12.0, 24.0, 36.0];
    let sum: f32 = steps.iter().map(|dz| natural(vec2(road(z + dz).0, z + dz))).sum();
    sum / steps.len() as f32
}

impl Land {
    fn height(&self, p: Vec2) -> f32 {
        let beside = 1.0 - smoothstep(5.5, 24.0, road_distance(p));
        let mut height = natural(p);
        if beside > 0.0 {
            height += (road_height(p.y) - ROAD_RISE - height) * beside;
        }
        for pad in &self.pads {
            let d = pad.center.distance(p);
            if d < pad.radius + 8.0 {
                let weight = 1.0 - smoothstep(pad.radius, pad.radius + 8.0, d);
                height += (pad.height - height) * weight;
            }
        }
        height
    }

    fn point(&self, p: Vec2) -> Vec3 {
        vec3(p.x, self.height(p), p.y)
    }

    /// Levels a place and returns its middle.
    fn level(&mut self, center: Vec2, radius: f32, raise: f32) -> Vec3 {
        let height = self.height(center) + raise;
        self.pads.push(Pad { center, radius, height });
        center.extend(height).xzy()
    }

    /// Whether there is room for a tree: off the road and away from houses.
    fn free(&self, p: Vec2) -> bool {
        road_distance(p) > 10.0 && self.pads.iter().all(|pad| pad.center.distance(p) > pad.radius + 4.0)
    }
}

/// Materials of the buildings.
struct Palette {
    walls: [u32; 4],
    roofs: [u32; 3],
    stone: u32,
    wood: u32,
    frame: u32,
    glass: u32,
}

pub fn build() -> Scene {
    let mut b = Builder::new("terrain");
    let mut rng = Rng::new(21);
    let mut land = Land::default();
    let church = land.level(vec2(48.0, -8.0), 21.0, 2.2);
    let houses = place_houses(&mut land, &mut rng);

    let map = b.texture(512, 512, |x, y| {
        let p = (vec2(x as f32, y as f32) + 0.5) / 512.0 * (2.0 * HALF) - HALF;
        ground_color(&land, p)
    });
    let ground = b.textured("ground", 0xffffff, map);
    let gravel = b.texture(128, 256, |x, y| {
        // Across the road: two worn tracks each way; along it: nothing but stones.
        let p = vec2(x as f32, y as f32) / 128.0;
        let track = (p.x * 4.0 * PI).cos() * 0.05;
        let tone = 0.86 + track + 0.2 * (fbm(p * 24.0, 31, 24, 3) - 0.5);
        [tone, tone * 0.985, tone * 0.95, 1.0]
    });
    let road_surface = b.textured("road", 0xc2b49a, gravel);
    let plaster = b.texture(64, 64, |x, y| {
        let tone = 0.93 + 0.07 * fbm(vec2(x as f32, y as f32) / 16.0, 2, 4, 3);
        [tone, tone, tone, 1.0]
    });
    let tiles = b.texture(128, 128, |x, y| {
        // Rows of tiles, 8 a metre and a half, each row shifted by half a tile.
        let row = y / 16;
        let across = (x + 8 * (row % 2)) % 16;
        let shade = 0.72 + 0.28 * (y % 16) as f32 / 16.0;
        let tone = shade * if across < 1 { 0.75 } else { 1.0 };
        [tone, tone, tone, 1.0]
    });
    let palette = Palette {
        walls: [0xeee3cc, 0xe3cfa8, 0xe8d8d0, 0xd8d6c6].map(|c| b.textured("plaster", c, plaster)),
        roofs: [0xa8583f, 0x94503f, 0x7b6a5e].map(|c| b.textured("tiles", c, tiles)),
        stone: b.textured("stone", 0xa39b8d, plaster),
        wood: b.material("wood", 0x6b4c36),
        frame: b.material("frame", 0xf2eee4),
        glass: b.material("glass", 0x3a4a57),
    };

    b.lattice(ground, CELLS + 1, CELLS + 1, Shading::Smooth(180.0), |i, j| {
        let uv = vec2(j as f32, i as f32) / CELLS as f32;
        (land.point(uv * (2.0 * HALF) - HALF), uv)
    });
    draw_road(&mut b, road_surface);
    for &(middle, turn) in &houses {
        b.turned(middle, turn, |b| house(b, &palette, &mut rng));
    }
    b.turned(church, -0.25, |b| draw_church(b, &palette));
    fences(&mut b, &land, palette.wood);
    plant(&mut b, &land, &mut rng);
    tufts(&mut b, &land, &mut rng);

    let eye = |x: f32, z: f32, up: f32| land.point(vec2(x, z)) + Vec3::Y * up;
    let on_road = |z: f32, up: f32| vec3(road(z).0, road_height(z) + up, z);
    let cameras = vec![
        camera("default", eye(-130.0, -90.0, 14.0), vec3(0.0, 6.0, 0.0), 45.0, 0.5, 1600.0),
        camera("street", on_road(58.0, 1.7), on_road(-10.0, 3.5), 55.0, 0.2, 1600.0),
        camera("square", on_road(-3.0, 1.7), church + vec3(-9.0, 8.0, 0.0), 60.0, 0.2, 1600.0),
        camera("meadow", eye(-66.0, 84.0, 1.7), church + vec3(-40.0, 6.0, 6.0), 50.0, 0.3, 1600.0),
        camera("wood", eye(-205.0, 126.0, 1.7), eye(-150.0, 90.0, 2.5), 55.0, 0.3, 1600.0),
        camera("hill", eye(-250.0, 150.0, 26.0), eye(20.0, 0.0, 0.0), 45.0, 1.0, 1600.0),
        camera("bird", vec3(-330.0, 260.0, 420.0), vec3(10.0, 0.0, -20.0), 45.0, 5.0, 2000.0),
        camera("above", vec3(-10.0, 330.0, 30.0), vec3(0.0, 0.0, 0.0), 50.0, 10.0, 1000.0),
    ];
    let lights = vec![
        light(
            "sun",
            Light::Directional { to_light: vec3(-0.80, 0.40, 0.42), angular_radius: 0.0, color: vec3(1.0, 0.92, 0.78) },
        ),
        light(
            "noon",
            Light::Directional { to_light: vec3(0.25, 0.90, 0.35), angular_radius: 0.0, color: vec3(1.0, 0.98, 0.94) },
        ),
        light(
            "floodlight",
            Light::Spot {
                position: church + vec3(-30.0, 22.0, 34.0),
                direction: vec3(30.0, -13.0, -34.0),
                outer_angle: 32.0,
                range: 160.0,
                radius: 0.0,
                color: vec3(2600.0, 2300.0, 1800.0),
            },
        ),
        light(
            "street lamp",
            Light::Omni { position: on_road(8.0, 6.0), range: 90.0, radius: 0.0, color: vec3(110.0, 88.0, 58.0) },
        ),
    ];
    b.finish(cameras, lights)
}

/// Lots along the road on both sides, each levelled: the middles and turns of the houses.
fn place_houses(land: &mut Land, rng: &mut Rng) -> Vec<(Vec3, f32)> {
    let mut houses = Vec::new();
    for side in [-1.0, 1.0] {
        let mut z = -196.0 + 7.0 * side;
        while z < 176.0 {
            z += rng.range(19.0, 29.0);
            let (x, slope) = road(z);
            let out = vec2(1.0, -slope).normalize() * side;
            let center = vec2(x, z) + out * rng.range(15.5, 20.0);
            // The church keeps a square before it.
            let square = side > 0.0 && z.abs() < 26.0;
            let clear = !square && land.pads.iter().all(|pad| pad.center.distance(center) > pad.radius + 11.0);
            if clear {
                let middle = land.level(center, 8.0, 0.0);
                // Its front, local +z, looks at the road.
                let turn = (-out.x).atan2(-out.y) + rng.range(-0.1, 0.1);
                houses.push((middle, turn));
            }
        }
    }
    houses
}

/// Colour of the landscape seen from far: meadows, fields, woods, trodden ground.
fn ground_color(land: &Land, p: Vec2) -> [f32; 4] {
    let fine = fbm(p / 7.0, 40, 0, 3);
    let broad = fbm(p / 70.0, 41, 0, 3);
    let mut color = vec3(0.53, 0.62, 0.33).lerp(vec3(0.69, 0.70, 0.42), broad * 1.2 - 0.1);
    // Fields: strips of a turned grid on the gentle ground around the village.
    let turned = Vec2::from_angle(0.35).rotate(p);
    let cell = (turned / vec2(70.0, 46.0)).floor();
    let pick = fbm(cell * 7.31 + 0.5, 50, 0, 1);
    let inside = (turned / vec2(70.0, 46.0) - cell - 0.5).abs();
    let off_road = smoothstep(26.0, 30.0, road_distance(p));
    let ring = smoothstep(70.0, 90.0, p.length()) * (1.0 - smoothstep(250.0, 270.0, p.length()));
    let edge = if inside.max_element() < 0.47 { 1.0 } else { 0.0 };
    if pick > 0.45 {
        let crop = if pick > 0.72 {
            vec3(0.78, 0.68, 0.40)
        } else if pick > 0.57 {
            vec3(0.55, 0.45, 0.33)
        } else {
            vec3(0.52, 0.63, 0.27)
        };
        let furrow = 0.95 + 0.05 * (turned.y * TAU / 5.0).sin();
        color = color.lerp(crop * furrow, 0.85 * ring * off_road * edge);
    }
    color = color.lerp(vec3(0.42, 0.46, 0.27), 0.8 * woods(p));
    for pad in &land.pads {
        let d = pad.center.distance(p);
        color = color.lerp(vec3(0.72, 0.66, 0.50), 0.45 * (1.0 - smoothstep(pad.radius * 0.7, pad.radius + 2.0, d)));
    }
    let verge = 1.0 - smoothstep(3.0, 7.0, road_distance(p));
    color = color.lerp(vec3(0.60, 0.56, 0.40), 0.6 * verge) * (0.88 + 0.24 * fine);
    [color.x, color.y, color.z, 1.0]
}

/// 1 in the woods, 0 outside: patches on the hills.
fn woods(p: Vec2) -> f32 {
    let patch = smoothstep(0.50, 0.54, fbm((p + 170.0) / 120.0, 60, 0, 3));
    patch * smoothstep(95.0, 150.0, p.length()) * smoothstep(28.0, 50.0, road_distance(p))
}

/// The road: a strip over its bed, with shoulders that go into the ground.
fn draw_road(b: &mut Builder, material: u32) {
    let rows = 501;
    b.lattice(material, 4, rows, Shading::Smooth(30.0), |i, j| {
        let z = HALF - j as f32 / (rows - 1) as f32 * 2.0 * HALF;
        let (x, slope) = road(z);
        let across = vec2(1.0, -slope).normalize();
        let (side, down) = [(-1.14, 0.7), (-1.0, 0.0), (1.0, 0.0), (1.14, 0.7)][i];
        let p = vec2(x, z) + across * side * ROAD;
        (vec3(p.x, road_height(z) - down, p.y.clamp(-HALF, HALF)), vec2(side * 0.5 + 0.5, z / 12.0))
    });
}

/// A house around the origin, its front to +z.
fn house(b: &mut Builder, palette: &Palette, rng: &mut Rng) {
    let wall = palette.walls[rng.index(4)];
    let roof = palette.roofs[rng.index(3)];
    let half = vec2(rng.range(4.2, 6.0), rng.range(3.2, 3.9));
    let storeys = 1 + rng.index(2);
    let eaves = 0.5 + 2.7 * storeys as f32;
    let pitch = rng.range(0.75, 1.0);
    gabled(b, wall, roof, palette.stone, half, eaves, pitch);
    // Every third house has a lower wing behind, at one of two places.
    let wing = match rng.index(6) {
        0 => Some(-0.45 * half.x),
        1 => Some(0.45 * half.x),
        _ => None,
    };
    if let Some(x) = wing {
        b.turned(vec3(x, 0.0, -half.y - 1.6), FRAC_PI_2, |b| {
            gabled(b, wall, roof, palette.stone, vec2(2.6, 2.3), 2.6, 0.8);
        });
    }
    // Windows at the front and the back, two at each gable; none where the wing is.
    for storey in 0..storeys {
        let y = 1.3 + 2.7 * storey as f32;
        for (turn, depth, reach, count) in [
            (0.0, half.y, half.x, 4),
            (PI, half.y, half.x, 3),
            (FRAC_PI_2, half.x, half.y, 2),
            (-FRAC_PI_2, half.x, half.y, 2),
        ] {
            b.turned(Vec3::ZERO, turn, |b| {
                for k in 0..count {
                    let x = ((k as f32 + 0.5) / count as f32 * 2.0 - 1.0) * reach * 0.88;
                    if turn == PI && wing.is_some_and(|wing| (-x - wing).abs() < 3.6) {
                        continue;
                    }
                    if turn == 0.0 && storey == 0 && k == 1 {
                        opening(b, palette.wood, palette.frame, vec3(x, 0.45, depth), 1.0, 2.1);
                    } else {
                        opening(b, palette.glass, palette.frame, vec3(x, y, depth), 0.9, 1.25);
                    }
                }
            });
        }
    }
    // The step before the door, and a chimney through the roof.
    let door = (1.5 / 4.0 * 2.0 - 1.0) * half.x * 0.88;
    b.block(palette.stone, vec3(door - 0.8, -0.4, half.y - 0.1), vec3(door + 0.8, 0.42, half.y + 1.0));
    let x = half.x * rng.range(-0.55, 0.55);
    let ridge = eaves + half.y * pitch;
    b.block(palette.stone, vec3(x - 0.4, eaves, -1.5), vec3(x + 0.4, ridge + 0.9, -0.8));
}

/// Walls with gables at ±x under a pitched roof with overhang, on a stone foot.
fn gabled(b: &mut Builder, wall: u32, roof: u32, stone: u32, half: Vec2, eaves: f32, pitch: f32) {
    let ridge = eaves + half.y * pitch;
    b.block(stone, vec3(-half.x - 0.08, -0.9, -half.y - 0.08), vec3(half.x + 0.08, 0.45, half.y + 0.08));
    // The section lies in x and y; turned, its x runs along -z.
    b.uv_scale = 0.5;
    b.turned(Vec3::ZERO, FRAC_PI_2, |b| {
        let section =
            [vec2(-half.y, 0.3), vec2(half.y, 0.3), vec2(half.y, eaves), vec2(0.0, ridge), vec2(-half.y, eaves)];
        b.extrude(wall, &section, -half.x, half.x, Shading::Flat);
        // The roof sinks a little into the walls' slope and hangs over all sides.
        let (out, sink, thick) = (0.55, -0.05, 0.22);
        let low = eaves - out * pitch + sink;
        let slab = [
            vec2(-half.y - out, low),
            vec2(0.0, ridge + sink),
            vec2(half.y + out, low),
            vec2(half.y + out, low + thick),
            vec2(0.0, ridge + sink + thick),
            vec2(-half.y - out, low + thick),
        ];
        b.extrude(roof, &slab, -half.x - 0.5, half.x + 0.5, Shading::Flat);
    });
    b.uv_scale = 1.0;
}

/// A window or door on a wall that faces +z: a frame that stands out, and the pane on it.
fn opening(b: &mut Builder, pane: u32, frame: u32, middle_low: Vec3, width: f32, height: f32) {
    let sides = [true, true, true, true, false, true];
    let Vec3 { x, y, z } = middle_low;
    let (w, t) = (width * 0.5, 0.12);
    b.cuboid_sides(frame, vec3(x - w - t, y - t, z - 0.02), vec3(x + w + t, y + height + t, z + 0.06), sides);
    b.cuboid_sides(pane, vec3(x - w, y, z + 0.05), vec3(x + w, y + height, z + 0.075), sides);
}

/// A church around the origin: nave along x, tower at -x, apse at +x.
fn draw_church(b: &mut Builder, palette: &Palette) {
    let (wall, roof) = (palette.walls[3], palette.roofs[2]);
    let (stone, glass) = (palette.stone, palette.glass);
    let half = vec2(11.0, 5.0);
    gabled(b, wall, roof, stone, half, 8.0, 1.15);
    // Round-headed windows between buttresses.
    let arched = |b: &mut Builder, material: u32, w: f32, h: f32, z0: f32, z1: f32| {
        let mut outline = vec![vec2(-w, 0.0), vec2(w, 0.0)];
        for k in 0..=10 {
            let a = k as f32 / 10.0 * PI;
            outline.push(vec2(w * a.cos(), h + w * a.sin()));
        }
        b.extrude(material, &outline, z0, z1, Shading::Flat);
    };
    for turn in [0.0, PI] {
        b.turned(Vec3::ZERO, turn, |b| {
            for k in 0..5 {
                let x = -8.0 + 4.0 * k as f32;
                b.at(vec3(x, 2.4, half.y), |b| {
                    arched(b, palette.frame, 0.75, 3.2, -0.1, 0.06);
                    b.at(Vec3::Y * 0.12, |b| arched(b, glass, 0.58, 3.08, -0.1, 0.1));
                });
            }
            for k in 0..6 {
                let x = -10.0 + 4.0 * k as f32;
                b.block(stone, vec3(x - 0.35, -0.9, half.y - 0.1), vec3(x + 0.35, 5.6, half.y + 0.9));
            }
        });
    }
    // The apse: half a drum under half a cone.
    b.at(vec3(half.x - 0.2, 0.0, 0.0), |b| {
        let drum = [vec2(3.6, -0.9), vec2(3.6, 6.0)];
        b.lathe_arc(wall, &drum, 14, -FRAC_PI_2, FRAC_PI_2);
        let cone = [vec2(3.4, 5.75), vec2(4.0, 5.75), vec2(4.0, 5.9), vec2(0.0, 9.2)];
        b.lathe_arc(roof, &cone, 14, -FRAC_PI_2, FRAC_PI_2);
    });
    // The tower with its openings, a cornice and the steeple.
    b.at(vec3(-half.x - 2.4, 0.0, 0.0), |b| {
        b.block(stone, vec3(-3.2, -0.9, -3.2), vec3(3.2, 0.6, 3.2));
        b.block(wall, vec3(-3.0, 0.5, -3.0), vec3(3.0, 19.0, 3.0));
        b.cuboid(stone, vec3(-3.3, 18.8, -3.3), vec3(3.3, 19.4, 3.3));
        for side in 0..4 {
            b.turned(Vec3::ZERO, side as f32 * FRAC_PI_2, |b| {
                for x in [-1.0, 1.0] {
                    b.at(vec3(x, 14.5, 3.0), |b| {
                        arched(b, stone, 0.7, 2.4, -0.1, 0.06);
                        b.at(Vec3::Y * 0.1, |b| arched(b, glass, 0.5, 2.3, -0.1, 0.1));
                    });
                }
                if side != 1 {
                    b.at(vec3(0.0, 8.6, 3.0), |b| arched(b, glass, 0.35, 1.5, -0.1, 0.06));
                }
            });
        }
        // The door looks away from the nave.
        b.turned(Vec3::ZERO, -FRAC_PI_2, |b| {
            b.at(vec3(0.0, 0.6, 3.0), |b| {
                arched(b, stone, 1.35, 2.2, -0.1, 0.12);
                arched(b, palette.wood, 1.05, 2.2, -0.1, 0.18);
            });
            b.block(stone, vec3(-1.9, -0.9, 3.0), vec3(1.9, 0.3, 4.6));
            b.block(stone, vec3(-1.6, 0.29, 3.0), vec3(1.6, 0.6, 4.0));
        });
        b.with(Mat4::from_translation(vec3(0.0, 19.38, 0.0)), |b| {
            let corner = |k: usize, r: f32, y: f32| {
                let a = (k as f32 + 0.5) * FRAC_PI_2;
                vec3(a.cos() * r, y, a.sin() * r)
            };
            for k in 0..4 {
                let [a, c] = [corner(k + 1, 4.9, 0.0), corner(k, 4.9, 0.0)];
                let [d, e] = [corner(k + 1, 2.4, 3.2), corner(k, 2.4, 3.2)];
                b.polygon(roof, &[a, c, e, d]);
                b.polygon(roof, &[d, e, vec3(0.0, 17.0, 0.0)]);
            }
            b.polygon(roof, &[0, 1, 2, 3].map(|k| corner(k, 4.9, 0.0)));
            b.cylinder(palette.wood, vec3(0.0, 16.6, 0.0), 0.09, 2.6, 6);
            b.cuboid(palette.wood, vec3(-0.6, 18.2, -0.08), vec3(0.6, 18.36, 0.08));
        });
    });
}

/// Picket fences along the village road: cut-out panels between posts.
fn fences(b: &mut Builder, land: &Land, wood: u32) {
    let pickets = b.texture(256, 128, |x, y| {
        let across = (x % 32) as f32;
        // Pickets with pointed heads, and two rails.
        let tip = (across - 12.0).abs() * 1.1;
        let picket = (3.0..22.0).contains(&across) && y as f32 > 4.0 + tip;
        let rail = (34..46).contains(&y) || (92..104).contains(&y);
        let tone = if picket { 0.92 } else { 0.80 };
        [tone, tone, tone * 0.97, if picket || rail { 1.0 } else { 0.0 }]
    });
    let panel = b.cutout("fence", 0xe9e4d6, pickets);
    let (step, reach) = (2.4, 7.4);
    for side in [-1.0, 1.0] {
        let at = |k: i32| {
            let z = k as f32 * step;
            let (x, slope) = road(z);
            land.point(vec2(x, z) + vec2(1.0, -slope).normalize() * side * reach)
        };
        for k in -62i32..58 {
            // A gap for each drive, and before the church.
            let gap = k.rem_euclid(11) >= 9 || (side > 0.0 && (-9..9).contains(&k));
            if gap {
                continue;
            }
            let (from, to) = (at(k), at(k + 1));
            let up = Vec3::Y;
            b.picture(panel, [from + up, from - up * 0.12, to - up * 0.12, to + up]);
            for post in [from, to] {
                let first = k.rem_euclid(11) == 0 || post == to;
                if first {
                    b.block(wood, post + vec3(-0.07, -0.4, -0.07), post + vec3(0.07, 1.08, 0.07));
                }
            }
        }
    }
}

/// Woods on the hills, single trees in the meadows and gardens.
fn plant(b: &mut Builder, land: &Land, rng: &mut Rng) {
    let bark = b.material("bark", 0x65503f);
    let leaves = [0x7d9b46, 0x98a848, 0x6a8d44].map(|c| b.material("leaves", c));
    let needles = [0x4c7046, 0x58794a].map(|c| b.material("needles", c));
    let mut planted: Vec<Vec2> = Vec::new();
    while planted.len() < TREES + GARDEN_TREES {
        let in_garden = planted.len() < GARDEN_TREES;
        let p = if in_garden {
            let z = rng.range(-215.0, 195.0);
            let side = if rng.index(2) == 0 { -1.0 } else { 1.0 };
            vec2(road(z).0 + side * rng.range(24.0, 68.0), z)
        } else {
            vec2(rng.range(-1.0, 1.0), rng.range(-1.0, 1.0)) * (HALF - 6.0)
        };
        let wood = woods(p);
        // Outside the woods a tree now and then.
        if !in_garden && rng.unit() > wood.max(0.03) || !land.free(p) {
            continue;
        }
        let room = if wood > 0.5 { 6.9 } else { 7.6 };
        if planted.iter().any(|q| q.distance(p) < room) {
            continue;
        }
        planted.push(p);
        let size = rng.range(0.8, 1.25) * if in_garden { 0.75 } else { 1.0 };
        let turn = Quat::from_rotation_y(rng.range(0.0, TAU));
        let place = Mat4::from_scale_rotation_translation(Vec3::splat(size), turn, land.point(p));
        let conifer = wood > 0.5 && fbm(p / 80.0, 71, 0, 2) + rng.range(-0.08, 0.08) > 0.5;
        if conifer {
            let needle = needles[rng.index(2)];
            b.with(place, |b| spruce(b, bark, needle, rng));
        } else {
            let leaf = leaves[rng.index(3)];
            b.with(place, |b| broadleaf(b, bark, leaf, rng));
        }
    }
}

/// Tufts of grass beside the road and in the meadows: two crossed cut-out cards each.
fn tufts(b: &mut Builder, land: &Land, rng: &mut Rng) {
    let mut blades = Rng::new(77);
    // Each blade: its foot, tip and half width in texels.
    let strokes: Vec<(f32, Vec2, f32)> = (0..34)
        .map(|_| {
            let foot = blades.range(38.0, 90.0);
            let tip = vec2(foot + blades.range(-34.0, 34.0), blades.range(6.0, 70.0));
            (foot, tip, blades.range(2.0, 3.6))
        })
        .collect();
    let texture = b.texture(128, 128, |x, y| {
        let p = vec2(x as f32, y as f32) + 0.5;
        let mut shade = None;
        for (k, &(foot, tip, half)) in strokes.iter().enumerate() {
            let t = (128.0 - p.y) / (128.0 - tip.y);
            let middle = foot + (tip.x - foot) * t * t;
            if t <= 1.0 && (p.x - middle).abs() < half * (1.0 - t).max(0.15) {
                shade = Some(0.62 + 0.3 * t + 0.08 * (k % 3) as f32);
            }
        }
        let tone = shade.unwrap_or(0.8);
        [tone, tone, tone * 0.9, if shade.is_some() { 1.0 } else { 0.0 }]
    });
    let grass = b.cutout("grass", 0x9cab58, texture);
    let mut drawn = 0;
    while drawn < TUFTS {
        let z = rng.range(-150.0, 150.0);
        let side = if rng.index(2) == 0 { -1.0 } else { 1.0 };
        let near = rng.unit();
        let p = vec2(road(z).0 + side * (4.2 + 70.0 * near * near), z);
        let level = land.pads.iter().any(|pad| pad.center.distance(p) < pad.radius - 1.0);
        let beside = road_distance(p);
        if level || beside < 3.9 || (6.9..8.0).contains(&beside) {
            continue;
        }
        drawn += 1;
        let (wide, tall) = (rng.range(0.22, 0.42), rng.range(0.28, 0.58));
        b.turned(land.point(p), rng.range(0.0, PI), |b| {
            for out in [Vec3::X, Vec3::Z] {
                let (foot, up) = (out * wide, Vec3::Y * tall);
                let low = -Vec3::Y * 0.06;
                b.picture(grass, [up - foot, low - foot, low + foot, up + foot]);
            }
        });
    }
}

/// A spruce, 11 m: skirts of branches that get smaller upwards.
fn spruce(b: &mut Builder, bark: u32, needle: u32, rng: &mut Rng) {
    b.frustum(bark, vec3(0.0, -0.7, 0.0), vec3(0.0, 2.4, 0.0), 0.28, 0.2, 6, [false; 2]);
    let skirts = 4;
    for k in 0..skirts {
        let t = k as f32 / skirts as f32;
        let (low, radius) = (1.5 + 8.0 * t, 2.5 * (1.0 - 0.78 * t));
        let (sides, tall) = (9, 3.6 - 0.8 * t);
        let mut patch = Patch::default();
        let apex = patch.vertex(vec3(0.0, low + tall, 0.0), Vec2::ZERO);
        let foot = patch.vertex(vec3(0.0, low + 0.5, 0.0), Vec2::ZERO);
        let ring: Vec<u32> = (0..sides)
            .map(|i| {
                let angle = (i as f32 + 0.5 * (k % 2) as f32) / sides as f32 * TAU;
                let r = radius * rng.range(0.82, 1.1);
                let y = low + rng.range(-0.15, 0.15);
                patch.vertex(vec3(r * angle.cos(), y, -r * angle.sin()), Vec2::ZERO)
            })
            .collect();
        for i in 0..sides {
            let (p, q) = (ring[i], ring[(i + 1) % sides]);
            patch.face(&[p, q, apex]);
            patch.face(&[q, p, foot]);
        }
        b.add(needle, &patch, Shading::Flat);
    }
}

/// A broad-leaved tree, 8 m: a trunk under two or three uneven balls.
fn broadleaf(b: &mut Builder, bark: u32, leaf: u32, rng: &mut Rng) {
    let top = vec3(0.0, 3.6, 0.0);
    b.frustum(bark, vec3(0.0, -0.7, 0.0), top, 0.32, 0.2, 6, [false; 2]);
    let mut ball = |b: &mut Builder, center: Vec3, radius: f32| {
        let phase = rng.range(0.0, TAU);
        b.blob(leaf, 1, 0.0, |dir| {
            let bump = (dir.x * 5.0 + phase).sin() * (dir.z * 5.0 - phase).cos() + 0.6 * (dir.y * 6.0 + phase).sin();
            center + dir * vec3(1.0, 0.88, 1.0) * radius * (1.0 + 0.13 * bump)
        });
    };
    ball(b, vec3(0.1, 5.0, 0.0), 2.5);
    ball(b, vec3(-1.2, 4.2, 0.7), 1.7);
}
