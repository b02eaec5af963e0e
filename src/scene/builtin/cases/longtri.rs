//! Triangles of two hundred metres beside things of ten centimetres.

use super::{Case, FRAMES, bar, eye, floor, look, paving, sun};
use crate::scene::builtin::builder::{Builder, light};
use crate::scene::{Camera, Scene};
use glam::{Vec3, vec2, vec3};

pub const CASE: Case = Case {
    id: "st-longtri",
    title: "Long triangles: bent edges",
    doc: "Triangles 200 m long cross a small detail that the camera closes in on: warped maps drawn with straight \
          edges (rtw, notw, logpsm with the linear raster) bend or lose their shadows unless the triangles are \
          split.",
    provokes: &["misplaced", "missing-caster", "stairs", "thin-caster"],
    axis: "distance from the detail, m",
    value: distance,
    place: |setup, t| setup.camera = camera_at(t),
    telling: 0.7,
    frames: FRAMES,
    build,
};

fn distance(t: f32) -> f32 {
    16.0 * 0.075f32.powf(t)
}

fn camera_at(t: f32) -> Camera {
    let target = vec3(0.0, 0.12, 0.0);
    look(target + vec3(0.25, 0.42, 1.0).normalize() * distance(t), target, 48.0, 0.05, 300.0)
}

fn build() -> Scene {
    let mut b = Builder::new(CASE.id);
    let ground = paving(&mut b);
    let metal = b.material("rails", 0x8b9197);
    let pieces = [b.material("light pieces", 0xe4d3b0), b.material("dark pieces", 0x7a4b34)];
    floor(&mut b, ground, [-100.0, -100.0], [100.0, 100.0], 0.0);
    // Ropes and a handrail that run from end to end.
    for (y, z, width) in [(0.9, -0.75, 0.03), (1.0, -0.6, 0.015), (1.1, -0.45, 0.03), (1.25, -0.2, 0.015)] {
        bar(&mut b, metal, vec3(-100.0, y, z - 3.0), vec3(100.0, y, z + 3.0), width);
    }
    for y in [0.55, 0.95] {
        bar(&mut b, metal, vec3(-1.6, y, -100.0), vec3(-1.6, y, 100.0), 0.06);
    }
    for k in -8..=8 {
        let foot = vec3(-1.6, 0.0, k as f32 * 2.0);
        bar(&mut b, metal, foot, foot + Vec3::Y * 0.98, 0.05);
    }
    let profile: Vec<_> =
        [0.0, 0.0, 0.045, 0.0, 0.045, 0.02, 0.018, 0.05, 0.014, 0.1, 0.032, 0.115, 0.032, 0.13, 0.0, 0.16]
            .chunks_exact(2)
            .map(|p| vec2(p[0], p[1]))
            .collect();
    for i in -3..=3 {
        for j in -3..=3 {
            if (i * 3 + j * 5) % 4 != 1 {
                let place = vec3(i as f32 * 0.17, 0.0, j as f32 * 0.17);
                b.at(place, |b| b.lathe(pieces[(j > 0) as usize], &profile, 14));
            }
        }
    }
    b.finish(eye(camera_at(0.0)), vec![light("sun", sun(-62.0, 48.0))])
}
