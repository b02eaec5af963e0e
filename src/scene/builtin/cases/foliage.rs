//! A poplar of loose leaves, each there twice.

use super::{Case, FRAMES, eye, floor, look, paving, sun};
use crate::light::Light;
use crate::scene::Scene;
use crate::scene::builtin::builder::{Builder, Patch, Rng, Shading, light};
use glam::{Vec2, Vec3, vec3};

pub const CASE: Case = Case {
    id: "st-foliage",
    title: "Foliage: hundreds of leaves",
    doc: "Open leaf cards, each of them twice in the same place, stand by the hundred one behind another under a \
          high sun: shadow-map and pcf blotch the specks of light.",
    provokes: &["stairs", "thin-caster"],
    axis: "sun elevation, °",
    value: elevation,
    place: |setup, t| setup.light = light_at(t),
    telling: 0.6,
    frames: FRAMES,
    build,
};

fn elevation(t: f32) -> f32 {
    85.0 - 60.0 * t
}

fn light_at(t: f32) -> Light {
    sun(-70.0, elevation(t))
}

/// Leaves of the poplar and its crown's half width, foot and top, metres.
const LEAVES: usize = 7000;
const RADIUS: f32 = 0.62;
const CROWN: [f32; 2] = [0.9, 5.2];

fn build() -> Scene {
    let mut b = Builder::new(CASE.id);
    let ground = paving(&mut b);
    let bark = b.material("bark", 0x8a755c);
    let leaf = b.double_sided("leaves", 0x7ba05b);
    let paper = b.double_sided("paper", 0xe9e4d6);
    floor(&mut b, ground, [-9.0, -9.0], [9.0, 9.0], 0.0);
    b.frustum(bark, Vec3::ZERO, vec3(0.0, 4.6, 0.0), 0.11, 0.02, 10, [false; 2]);
    for _ in 0..2 {
        let mut rng = Rng::new(5);
        b.leaves(leaf, &mut rng, LEAVES, 0.39, |rng| {
            let y = CROWN[0] + (CROWN[1] - CROWN[0]) * rng.unit();
            let away = RADIUS * rng.unit().sqrt() * (1.0 - ((y - 2.2) / 3.0).powi(2)).max(0.0).sqrt();
            let out = rng.direction();
            let foot = vec3(out.x * away, y, out.z * away);
            (foot, vec3(out.x, 0.6, out.z))
        });
    }
    // A low bush, thin enough that specks of light reach the ground.
    let mut rng = Rng::new(8);
    b.leaves(leaf, &mut rng, 420, 0.3, |rng| {
        let out = rng.direction();
        (vec3(1.9, 0.5, 1.4) + out * vec3(0.8, 0.5, 0.8), out)
    });
    // Folded sheets: surfaces with edges that have no other side.
    for (x, z, turn) in [(-1.6f32, 1.9f32, 0.4f32), (-0.3, 2.4, 1.3), (0.7, 2.9, 2.4)] {
        b.turned(vec3(x, 0.0, z), turn, |b| {
            let mut sheet = Patch::default();
            for p in [
                vec3(-0.4, 0.0, 0.0),
                vec3(0.4, 0.0, 0.0),
                vec3(0.4, 0.45, 0.25),
                vec3(-0.4, 0.45, 0.25),
                vec3(0.4, 0.5, 0.7),
                vec3(-0.4, 0.5, 0.7),
            ] {
                sheet.vertex(p, Vec2::ZERO);
            }
            sheet.face(&[0, 1, 2, 3]);
            sheet.face(&[3, 2, 4, 5]);
            b.add(paper, &sheet, Shading::Flat);
        });
    }
    let camera = look(vec3(1.4, 4.6, 9.0), vec3(0.5, 2.3, 0.0), 48.0, 0.2, 60.0);
    b.finish(eye(camera), vec![light("sun", light_at(0.0))])
}
