//! A flowing canopy of perforated panels that rises from a plaza and rests on funnels.
//!
//! The canopy is a height over the ground plan: u runs along x, v from the front (+z) to the back.

use super::builder::{Builder, CREASED, Patch, Rng, Shading, camera, fbm, light, pairs};
use crate::light::Light;
use crate::scene::Scene;
use glam::{Vec2, Vec3, vec2, vec3};
use std::f32::consts::{FRAC_PI_2, PI, TAU};

/// What the scene shows.
pub const DESCRIPTION: &str = "A flowing pavilion of perforated panels on funnels, with louvres, steps and trees";

/// The canopy's extent in x.
const LENGTH: f32 = 44.0;
/// Half its greatest depth.
const DEPTH: f32 = 10.5;
/// Half its thickness.
const SHEET: f32 = 0.06;
/// Panels along and across.
const PANELS: [usize; 2] = [146, 60];
/// The funnels: u and v of their heads, head radius, and how far their feet stand aside.
const FUNNELS: [(f32, f32, f32, Vec2); 4] = [
    (0.36, 0.12, 3.4, Vec2::new(0.5, -0.4)),
    (0.545, -0.36, 2.9, Vec2::new(-0.7, 0.3)),
    (0.69, 0.36, 3.5, Vec2::new(-0.4, -0.5)),
    (0.85, -0.18, 2.8, Vec2::new(-0.9, 0.4)),
];
/// The lawn's height; the plaza's is 0.
const LAWN: f32 = -0.6;

struct Palette {
    panel: u32,
    concrete: u32,
    fin: u32,
    paving: u32,
    step: u32,
    lawn: u32,
    wood: u32,
    steel: u32,
    water: u32,
    bark: u32,
    leaf: [u32; 2],
}

/// Generates the scene.
pub fn build() -> Scene {
    let mut b = Builder::new("pavilion");
    let concrete = b.texture(256, 256, |x, y| {
        let p = vec2(x as f32, y as f32) / 256.0;
        let v = 0.86 + 0.1 * fbm(p * 8.0, 2, 8, 4) + 0.06 * fbm(p * 2.0, 6, 2, 2);
        [v, v, v * 0.99, 1.0]
    });
    let paving = b.texture(512, 512, |x, y| {
        // Bands of slabs, every other band half a slab on.
        let band = y / 64;
        let u = (x + band % 2 * 64) % 512;
        let p = vec2(x as f32, y as f32) / 512.0;
        let tone = fbm(vec2((u / 128) as f32 * 3.3 + band as f32 * 7.1, 0.5), 9, 0, 1);
        let v = 0.74 + 0.1 * tone + 0.12 * fbm(p * 32.0, 3, 32, 3);
        let v = if u % 128 < 2 || y % 64 < 2 { v * 0.68 } else { v };
        [v, v * 0.975, v * 0.93, 1.0]
    });
    let lawn = b.texture(256, 256, |x, y| {
        let v = fbm(vec2(x as f32, y as f32) / 16.0, 7, 16, 5);
        [0.40 + 0.2 * v, 0.48 + 0.18 * v, 0.28 + 0.14 * v, 1.0]
    });
    let m = Palette {
        panel: b.material("white panels", 0xdcd8ce),
        concrete: b.textured("pale concrete", 0xe3ded3, concrete),
        fin: b.material("copper fins", 0xcc8a5c),
        paving: b.textured("paving", 0xe6dccb, paving),
        step: b.textured("granite", 0xc4bcb0, concrete),
        lawn: b.textured("lawn", 0xffffff, lawn),
        wood: b.textured("larch", 0xb08258, concrete),
        steel: b.material("dark steel", 0x454a4f),
        water: b.material("water", 0x4f8590),
        bark: b.textured("bark", 0x6e5a48, concrete),
        leaf: [b.double_sided("leaves", 0x6f9a45), b.double_sided("young leaves", 0x93b054)],
    };
    canopy(&mut b, &m);
    for (k, &(u, v, radius, foot)) in FUNNELS.iter().enumerate() {
        funnel(&mut b, &m, u, v, radius, foot, k);
    }
    fins(&mut b, &m);
    plaza(&mut b, &m);
    furniture(&mut b, &m);
    trees(&mut b, &m);
    b.finish(
        vec![
            camera("plaza", vec3(22.5, 6.4, 22.0), vec3(2.0, 1.9, 0.0), 50.0, 0.1, 250.0),
            camera("canopy", vec3(14.0, 1.7, 1.5), vec3(2.0, 2.2, -1.5), 65.0, 0.1, 250.0),
            camera("fins", vec3(2.0, 1.7, 4.5), vec3(3.5, 2.2, -6.0), 72.0, 0.05, 250.0),
            camera("ramp", vec3(-21.0, 2.0, 18.0), vec3(2.0, 2.9, 0.0), 54.0, 0.1, 250.0),
            camera("panels", vec3(-14.5, 5.2, 9.6), vec3(-7.5, 4.6, 0.0), 50.0, 0.1, 250.0),
            camera("aerial", vec3(27.0, 25.0, 32.0), vec3(0.0, 1.5, 0.0), 42.0, 1.0, 300.0),
        ],
        vec![
            light(
                "sun",
                Light::Directional {
                    to_light: vec3(-0.42, 0.9, 0.36),
                    angular_radius: 0.0,
                    color: vec3(1.0, 0.96, 0.88) * 1.2,
                },
            ),
            light(
                "low sun",
                Light::Directional {
                    to_light: vec3(-0.85, 0.42, 0.7),
                    angular_radius: 0.0,
                    color: vec3(1.0, 0.82, 0.62) * 1.3,
                },
            ),
            light(
                "floodlight",
                Light::Spot {
                    position: vec3(13.0, 7.5, 17.0),
                    direction: vec3(-12.0, -5.5, -16.0),
                    outer_angle: 38.0,
                    range: 70.0,
                    radius: 0.0,
                    color: vec3(380.0, 350.0, 300.0),
                },
            ),
            light(
                "canopy lamp",
                Light::Omni { position: vec3(2.2, 4.6, -0.5), range: 40.0, radius: 0.0, color: vec3(24.0, 21.0, 17.0) },
            ),
        ],
    )
}

/// 0 below `a`, 1 above `b`, smooth between.
fn ramp(a: f32, b: f32, x: f32) -> f32 {
    let t = ((x - a) / (b - a)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Half the canopy's depth at u.
fn half_depth(u: f32) -> f32 {
    let e = (2.0 * (0.012 + 0.976 * u) - 1.0).abs();
    DEPTH * (1.0 - e.powf(2.6)).sqrt() * (1.0 - 0.16 * (u * TAU * 1.5).sin() * (u * PI).sin())
}

/// The canopy's middle line bends to the front.
fn middle_z(u: f32) -> f32 {
    2.4 * (u * PI * 1.3 + 0.5).sin() - 1.4
}

/// The canopy's middle surface.
fn surface(u: f32, v: f32) -> Vec3 {
    let x = (u - 0.5) * LENGTH;
    let z = middle_z(u) - v * half_depth(u);
    let crest = 7.0 * ramp(-0.03, 0.34, u) - 0.55;
    let wave = 0.75 * ((u - 0.34) * TAU * 1.15).sin() * ramp(0.25, 0.5, u);
    let lip = 1.5 * ramp(0.78, 1.0, u) * u;
    let edge = ramp(0.08, 0.4, u) * (-1.25 * v * v + 0.8 * v * (u * TAU * 0.9 + 0.6).cos());
    vec3(x, crest + wave + lip + edge, z)
}

/// The canopy's point at a height over its middle surface, along the normal.
fn offset(u: f32, v: f32, height: f32) -> Vec3 {
    let d = 2e-3;
    let along = surface(u + d, v) - surface(u - d, v);
    let across = surface(u, v + d) - surface(u, v - d);
    surface(u, v) + along.cross(across).normalize() * height
}

/// u and v over a place on the ground.
fn plan(x: f32, z: f32) -> Vec2 {
    let u = x / LENGTH + 0.5;
    vec2(u, (middle_z(u) - z) / half_depth(u))
}

/// The radius of a panel's hole, as a share of the panel; 0: none.
fn hole(u: f32, v: f32) -> f32 {
    let band = 0.5 + 0.5 * (u * 19.0 + 2.6 * v + 1.5 * (v * 2.0 + u * 4.0).sin()).sin();
    let mut share = 0.43 * (0.3 + 0.7 * band);
    share *= ramp(1.0, 0.86, v.abs()) * ramp(0.03, 0.14, u) * ramp(1.0, 0.965, u);
    let p = surface(u, v);
    for &(fu, fv, radius, _) in &FUNNELS {
        let head = surface(fu, fv);
        let distance = vec2(p.x - head.x, p.z - head.z).length();
        share *= ramp(radius * 0.96, radius * 1.45, distance);
    }
    if share < 0.1 { 0.0 } else { share }
}

fn canopy(b: &mut Builder, m: &Palette) {
    let [columns, rows] = PANELS;
    let at = |i: f32, j: f32, height: f32| {
        let (u, v) = (i / columns as f32, j / rows as f32 * 2.0 - 1.0);
        (offset(u, v, height), vec2(i, j) * 0.5)
    };
    let mut patch = Patch::default();
    let mut corners = Vec::new();
    for height in [SHEET, -SHEET] {
        let first = patch.positions.len() as u32;
        corners.push(first);
        for j in 0..=rows {
            for i in 0..=columns {
                let (p, uv) = at(i as f32, j as f32, height);
                patch.vertex(p, uv);
            }
        }
    }
    for j in 0..rows {
        for i in 0..columns {
            let middle = vec2(i as f32 + 0.5, j as f32 + 0.5);
            let radius = hole(middle.x / columns as f32, middle.y / rows as f32 * 2.0 - 1.0);
            let mut rings = Vec::new();
            for (side, height) in [SHEET, -SHEET].into_iter().enumerate() {
                let a = corners[side] + (j * (columns + 1) + i) as u32;
                let d = a + columns as u32 + 1;
                let cell = [a, a + 1, d + 1, d];
                let mut face = |mut f: Vec<u32>| {
                    if side == 1 {
                        f.reverse();
                    }
                    patch.face(&f);
                };
                if radius == 0.0 {
                    face(cell.to_vec());
                    continue;
                }
                let ring: Vec<u32> = (0..12)
                    .map(|k| {
                        let angle = PI + k as f32 / 12.0 * TAU;
                        let (p, uv) = at(middle.x + radius * angle.cos(), middle.y + radius * angle.sin(), height);
                        patch.positions.push(p);
                        patch.uvs.push(uv);
                        patch.positions.len() as u32 - 1
                    })
                    .collect();
                let mut face = |mut f: Vec<u32>| {
                    if side == 1 {
                        f.reverse();
                    }
                    patch.face(&f);
                };
                for (q, &corner) in cell.iter().enumerate() {
                    for k in 0..3 {
                        face(vec![corner, ring[(3 * q + k + 1) % 12], ring[3 * q + k]]);
                    }
                    face(vec![corner, cell[(q + 1) % 4], ring[(3 * q + 3) % 12]]);
                }
                rings.push(ring);
            }
            if let [top, bottom] = &rings[..] {
                for k in 0..12 {
                    let next = (k + 1) % 12;
                    patch.face(&[bottom[k], top[k], top[next], bottom[next]]);
                }
            }
        }
    }
    b.add(m.panel, &patch, CREASED);
    // A round edge all along.
    let mut path = Vec::new();
    let (nu, nv) = (200, 40);
    path.extend((0..nu).map(|k| surface(k as f32 / nu as f32, -1.0)));
    path.extend((0..nv).map(|k| surface(1.0, k as f32 / nv as f32 * 2.0 - 1.0)));
    path.extend((0..nu).map(|k| surface(1.0 - k as f32 / nu as f32, 1.0)));
    path.extend((0..nv).map(|k| surface(0.0, 1.0 - k as f32 / nv as f32 * 2.0)));
    let radii = vec![0.17; path.len()];
    b.tube(m.panel, &path, &radii, 12, true);
}

/// A trumpet from the plaza into the canopy, with a seat around its foot.
fn funnel(b: &mut Builder, m: &Palette, u: f32, v: f32, radius: f32, foot: Vec2, k: usize) {
    let head = surface(u, v);
    let (stem, turns, rows) = (0.62, 72, 44);
    b.uv_scale = 0.3;
    let scale = b.uv_scale;
    b.lattice(m.concrete, turns + 1, rows + 1, Shading::Smooth(180.0), |i, j| {
        let t = j as f32 / rows as f32 * FRAC_PI_2;
        let angle = (i % turns) as f32 / turns as f32 * TAU;
        // The foot is three-lobed, the head round.
        let lobes = 1.0 + 0.16 * (1.0 - t.sin()) * (3.0 * angle + k as f32).cos();
        let r = stem * lobes * (1.0 + 0.25 * (1.0 - t.sin()).powi(6)) + (radius - stem) * (1.0 - t.cos()).powf(1.25);
        let lean = foot * (1.0 - t.sin());
        let x = head.x + lean.x + r * angle.cos();
        let z = head.z + lean.y - r * angle.sin();
        let top = plan(x, z);
        let y = surface(top.x, top.y).y * t.sin();
        let y = if j == 0 { -0.1 } else { y };
        (vec3(x, y, z), vec2(i as f32 / turns as f32 * TAU * 2.0, -y) * scale)
    });
    b.at(vec3(head.x + foot.x, 0.0, head.z + foot.y), |b| {
        let leg = pairs(&[1.35, 0.0, 1.35, 0.36, 1.3, 0.385, 1.3, 0.0]);
        b.lathe(m.steel, &leg, 48);
        for s in 0..4 {
            let r = 1.12 + 0.15 * s as f32;
            let slat = pairs(&[
                r,
                0.38,
                r + 0.125,
                0.38,
                r + 0.13,
                0.385,
                r + 0.13,
                0.42,
                r + 0.12,
                0.43,
                r + 0.01,
                0.43,
                r,
                0.42,
                r,
                0.38,
            ]);
            b.lathe(m.wood, &slat, 64);
        }
    });
    b.uv_scale = 1.0;
}

/// Twisted blades from the plaza to the canopy along the back, in one long wave.
fn fins(b: &mut Builder, m: &Palette) {
    let count = 118;
    for k in 0..count {
        let t = k as f32 / (count - 1) as f32;
        let u = 0.33 + 0.6 * t;
        let v = 0.7 - 0.12 * (t * TAU * 1.2).sin() - 0.1 * t;
        let foot = surface(u, v);
        let rows = 26;
        let (width, thick) = (0.145 + 0.03 * (t * TAU * 2.0).sin(), 0.022);
        let corner = |c: usize, y: f32, height: f32| {
            let h = y / height;
            let angle = 0.55 * (t * TAU * 1.5 + h * 2.4).sin() + 0.1;
            let sway = 0.35 * (h * PI).sin() * (t * TAU * 1.5).cos();
            let (s, w) = [(-1.0, -1.0), (-1.0, 1.0), (1.0, 1.0), (1.0, -1.0)][c % 4];
            let across = vec3(angle.sin(), 0.0, angle.cos()) * (s * width * (0.75 + 0.5 * h));
            let side = vec3(angle.cos(), 0.0, -angle.sin()) * (w * thick);
            vec3(foot.x, y, foot.z + sway) + across + side
        };
        b.lattice(m.fin, 5, rows + 1, CREASED, |i, j| {
            let y = -0.02 + (foot.y + 0.02) * j as f32 / rows as f32;
            (corner(i, y, foot.y), vec2(i as f32 * 0.2, y))
        });
    }
    // The rail on which they stand.
    for side in [-0.09f32, 0.09] {
        let path: Vec<Vec3> = (0..=120)
            .map(|k| {
                let t = k as f32 / 120.0;
                let p = surface(0.325 + 0.61 * t, 0.7 - 0.12 * (t * TAU * 1.2).sin() - 0.1 * t);
                vec3(p.x, 0.03, p.z + side)
            })
            .collect();
        b.tube(m.steel, &path, &[0.045; 121], 6, false);
    }
}

/// A closed outline, counter-clockwise from above: an ellipse with a wave.
fn outline(a: f32, c: f32, count: usize) -> Vec<Vec2> {
    (0..count)
        .map(|k| {
            let angle = k as f32 / count as f32 * TAU;
            let wave = 1.0 + 0.05 * (3.0 * angle + 0.8).sin();
            vec2(a * wave * angle.cos(), -c * wave * angle.sin())
        })
        .collect()
}

fn plaza(b: &mut Builder, m: &Palette) {
    b.uv_scale = 0.08;
    let l = 90.0;
    b.polygon(m.lawn, &[vec3(-l, LAWN, -l), vec3(-l, LAWN, l), vec3(l, LAWN, l), vec3(l, LAWN, -l)]);
    b.uv_scale = 0.25;
    // Wide steps all around, the lowest first.
    for k in 0..4 {
        let out = 0.42 * (3 - k) as f32;
        let y1 = LAWN + 0.15 * (k + 1) as f32;
        let material = if k == 3 { m.paving } else { m.step };
        b.prism(material, &outline(29.0 + out, 17.5 + out, 180), y1 - 0.16, y1, true);
    }
    b.uv_scale = 1.0;
    // A pool before the canopy's low end.
    b.turned(vec3(-13.5, 0.0, 11.2), 0.25, |b| {
        b.uv_scale = 0.5;
        let ring = |scale: f32| -> Vec<Vec3> {
            outline(5.2, 2.1, 72).iter().map(|p| vec3(p.x * scale, 0.0, p.y * scale)).collect()
        };
        let profile = [(1.06, -0.02), (1.06, 0.3), (1.045, 0.33), (0.985, 0.33), (0.97, 0.3), (0.97, 0.1)];
        b.lattice(m.step, 73, profile.len(), CREASED, |i, j| {
            let (scale, y) = profile[j];
            (ring(scale)[i % 72] + Vec3::Y * y, vec2(i as f32 * 0.2, -y * 2.0) * 0.5)
        });
        let surface: Vec<Vec3> = ring(0.975).iter().map(|p| *p + Vec3::Y * 0.25).collect();
        b.polygon(m.water, &surface);
        b.uv_scale = 1.0;
    });
    railing(b, m);
}

/// A railing along the plaza's back edge.
fn railing(b: &mut Builder, m: &Palette) {
    let edge: Vec<Vec3> = outline(28.6, 17.1, 720)[40..320].iter().map(|p| vec3(p.x, 0.0, p.y)).collect();
    for (y, radius, sides) in [(1.05, 0.028, 8), (0.98, 0.012, 5), (0.1, 0.012, 5)] {
        let path: Vec<Vec3> = edge.iter().step_by(2).map(|p| *p + Vec3::Y * y).collect();
        b.tube(m.steel, &path, &vec![radius; path.len()], sides, false);
    }
    for (k, p) in edge.iter().enumerate() {
        if k % 10 == 0 {
            b.frustum(m.steel, *p - Vec3::Y * 0.01, *p + Vec3::Y * 1.05, 0.024, 0.02, 8, [false; 2]);
        } else {
            b.frustum(m.steel, *p + Vec3::Y * 0.1, *p + Vec3::Y * 0.98, 0.007, 0.007, 5, [false; 2]);
        }
    }
}

/// A bench of slats along a curve given by a point and the way across, for t from 0 to 1.
fn ribbon(b: &mut Builder, m: &Palette, steps: usize, curve: impl Fn(f32) -> (Vec3, Vec3)) {
    b.uv_scale = 0.6;
    // Position across the seat and height of each slat, and the back rest's.
    let slats = [
        (0.0, 0.43, 0.09),
        (0.11, 0.44, 0.09),
        (0.22, 0.44, 0.09),
        (0.33, 0.43, 0.09),
        (0.45, 0.56, 0.03),
        (0.48, 0.69, 0.03),
        (0.51, 0.82, 0.03),
    ];
    for (out, y, width) in slats {
        let tall = if width < 0.05 { 0.095 } else { 0.035 };
        let section = [(0.0, 0.0), (0.0, tall), (width, tall), (width, 0.0), (0.0, 0.0)];
        let place = |t: f32, j: usize| {
            let (p, across) = curve(t);
            let (o, h) = section[j];
            p + across * (out + o) + Vec3::Y * (y + h)
        };
        b.lattice(m.wood, 5, steps + 1, CREASED, |j, i| {
            let t = i as f32 / steps as f32;
            (place(t, j), vec2(t * 8.0, j as f32 * 0.1))
        });
        for (t, turned) in [(0.0, false), (1.0, true)] {
            let mut end: Vec<Vec3> = (0..4).map(|j| place(t, j)).collect();
            if turned {
                end.reverse();
            }
            b.polygon(m.wood, &end);
        }
    }
    for k in 0..=8 {
        let (p, across) = curve(0.04 + 0.92 * k as f32 / 8.0);
        let path = [vec3(0.04, -0.01, 0.0), vec3(0.1, 0.42, 0.0), vec3(0.44, 0.42, 0.0), vec3(0.53, 0.88, 0.0)]
            .map(|q| p + across * q.x + Vec3::Y * q.y);
        b.tube(m.steel, &path, &[0.02; 4], 7, false);
        b.tube(m.steel, &[p + across * 0.44 - Vec3::Y * 0.01, p + across * 0.4 + Vec3::Y * 0.42], &[0.02; 2], 7, false);
    }
    b.uv_scale = 1.0;
}

fn furniture(b: &mut Builder, m: &Palette) {
    // (middle, radius, from, to): arcs whose seats face their middle or, with a negative radius, away.
    for (x, z, radius, from, to) in
        [(4.0, 21.0, 7.0, 1.2, 2.4), (20.0, 8.5, 5.0, -0.35, 1.0), (-18.0, -6.5, 5.5, 2.0, 3.3)]
    {
        ribbon(b, m, 64, |t| {
            let angle = from + (to - from) * t;
            let out = vec3(angle.cos(), 0.0, -angle.sin());
            (vec3(x, 0.0, z) + out * radius, out)
        });
    }
    // Lamps along the front edge.
    for k in 0..7 {
        let angle = PI + 0.45 + k as f32 * 0.37;
        let p = vec3(27.0 * angle.cos(), 0.0, -15.6 * angle.sin());
        b.at(p, |b| {
            let post =
                [(0.13, -0.01), (0.13, 0.03), (0.055, 0.05), (0.05, 0.82), (0.09, 0.84), (0.09, 0.87), (0.0, 0.9)];
            b.lathe(m.steel, &post.map(|(r, y)| vec2(r, y)), 24);
            b.lathe(m.panel, &[vec2(0.085, 0.68), vec2(0.085, 0.8)], 24);
            b.lathe(m.steel, &pairs(&[0.05, 0.66, 0.092, 0.67, 0.092, 0.69, 0.05, 0.69]), 24);
        });
    }
}

fn trees(b: &mut Builder, m: &Palette) {
    let mut rng = Rng::new(2013);
    let places = [
        (-27.0, 14.5, 6.2),
        (-34.5, 2.0, 7.5),
        (-29.5, -12.0, 8.2),
        (-17.0, -19.8, 8.8),
        (-6.0, -22.5, 7.8),
        (6.5, -22.0, 9.2),
        (19.0, -19.5, 8.0),
        (30.5, -11.5, 8.6),
        (34.5, 1.5, 7.6),
        (25.6, -3.2, 5.4),
        (-5.4, 12.6, 4.9),
        (29.5, 15.0, 7.0),
    ];
    for (k, (x, z, height)) in places.into_iter().enumerate() {
        let plan = vec2(x / 29.0, z / 17.5).length();
        let y = if plan < 1.0 { 0.0 } else { LAWN };
        b.turned(vec3(x, y, z), rng.range(0.0, TAU), |b| {
            tree(b, m, &mut rng, height, k % 2);
            if y == 0.0 {
                let tub = pairs(&[0.0, 0.0, 0.75, 0.0, 0.85, 0.5, 0.85, 0.55, 0.78, 0.55, 0.76, 0.48, 0.0, 0.5]);
                b.lathe(m.step, &tub, 40);
            }
        });
    }
}

/// A broad-leaved tree: branches that fork twice, and leaves around their ends.
fn tree(b: &mut Builder, m: &Palette, rng: &mut Rng, height: f32, kind: usize) {
    let fork = height * 0.36;
    let thick = 0.02 * height;
    let crook = vec3(rng.range(-0.1, 0.1), fork * 0.5, rng.range(-0.1, 0.1));
    let top = vec3(0.0, fork, 0.0);
    b.tube(
        m.bark,
        &[vec3(0.0, -0.1, 0.0), vec3(0.0, 0.12, 0.0), crook, top],
        &[thick * 1.7, thick * 1.15, thick, thick * 0.85],
        12,
        false,
    );
    let mut ends = Vec::new();
    let limbs = 6;
    for k in 0..limbs {
        let angle = k as f32 / limbs as f32 * TAU + rng.range(-0.3, 0.3);
        let out = vec3(angle.cos(), 0.0, angle.sin());
        let reach = height * rng.range(0.17, 0.25);
        let rise = height * rng.range(0.2, 0.42);
        let knee = top + out * reach * 0.45 + Vec3::Y * rise * 0.55;
        let tip = top + out * reach + Vec3::Y * rise;
        b.tube(m.bark, &[top - Vec3::Y * 0.08, knee, tip], &[thick * 0.6, thick * 0.4, thick * 0.15], 8, false);
        ends.push((tip, height * 0.15));
        ends.push((knee.lerp(tip, 0.5) + rng.direction() * height * 0.08, height * 0.12));
        for _ in 0..2 {
            let twig = tip + (rng.direction() + out * 0.4 + Vec3::Y * 0.5) * height * 0.11;
            b.tube(m.bark, &[knee.lerp(tip, 0.4), twig], &[thick * 0.22, thick * 0.08], 6, false);
            ends.push((twig, height * 0.12));
        }
    }
    ends.push((top + Vec3::Y * height * 0.44, height * 0.16));
    b.tube(m.bark, &[top - Vec3::Y * 0.1, top + Vec3::Y * height * 0.44], &[thick * 0.6, thick * 0.1], 8, false);
    b.leaves(m.leaf[kind], rng, 2600, 0.034 * height.min(7.0) + 0.03, |rng| {
        let (middle, radius) = ends[rng.index(ends.len())];
        let d = rng.direction();
        (middle + d * radius * rng.unit().powf(0.45), d + Vec3::Y * 0.3)
    });
}
