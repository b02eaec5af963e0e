//! Triangles without area, surfaces edge-on to the sun, and a view of nothing.

use super::{Case, FRAMES, direction, eye, floor, look, paving};
use crate::light::Light;
use crate::scene::builtin::builder::{Builder, Patch, Shading, light};
use crate::scene::{Camera, Scene};
use glam::{Vec2, Vec3, vec3};

pub const CASE: Case = Case {
    id: "st-degenerate",
    title: "Degenerate: triangles without area",
    doc: "Triangles without area, twins with either winding, slivers and sheets whose plane holds the sun, while the \
          camera swings from straight down to an empty sky: what divides by an area or a count (rtw, notw, every \
          fit) must neither crash nor yield NaN.",
    provokes: &["stairs"],
    axis: "camera's pitch, °",
    value: pitch,
    place: |setup, t| setup.camera = camera_at(t),
    telling: 0.45,
    frames: FRAMES,
    build,
};

fn pitch(t: f32) -> f32 {
    -90.0 + 135.0 * t
}

fn camera_at(t: f32) -> Camera {
    let from = vec3(0.3, 4.2, 2.0);
    let p = pitch(t);
    // Exactly down, where the camera's up changes.
    let along = if t == 0.0 { Vec3::NEG_Y } else { direction(0.0, p) };
    look(from, from + along * 4.0, 60.0, 0.1, 60.0)
}

/// Without a part along z, so that it lies exactly in the plane of every sheet across z.
const SUN: Light =
    Light::Directional { to_light: vec3(-0.6, 0.8, 0.0), angular_radius: 0.0, color: vec3(1.0, 0.96, 0.88) };

fn build() -> Scene {
    let mut b = Builder::new(CASE.id);
    let ground = paving(&mut b);
    let boxes = b.material("boxes", 0xc8553d);
    let sheets = b.double_sided("sheets", 0xe0c48a);
    let none = b.double_sided("without area", 0x5f8a72);
    floor(&mut b, ground, [-8.0, -22.0], [8.0, 6.0], 0.0);
    for k in 0..6 {
        let z = 2.6 - 3.2 * k as f32;
        // A box, there twice.
        for _ in 0..2 {
            b.at(vec3(-1.2, 0.0, z), |b| b.cuboid(boxes, vec3(-0.4, 0.0, -0.4), vec3(0.4, 0.8, 0.4)));
        }
        // A sheet edge-on to the sun, and one edge-on at its side.
        b.polygon(sheets, &[vec3(0.4, 0.0, z), vec3(1.6, 0.0, z), vec3(1.6, 1.0, z), vec3(0.4, 1.0, z)]);
        b.polygon(sheets, &[vec3(2.2, 0.0, z), vec3(2.2, 0.0, z - 0.8), vec3(2.2, 1.0, z - 0.8), vec3(2.2, 1.0, z)]);
        let mut patch = Patch::default();
        let mut triangle = |corners: [Vec3; 3]| {
            let ids = corners.map(|p| patch.vertex(p, Vec2::ZERO));
            patch.indices.extend(ids);
        };
        let p = vec3(0.2, 0.6, z + 0.9);
        // A point, a needle of three points in line, one of two, a sliver, and a triangle with its twin.
        triangle([p; 3]);
        triangle([p, p + Vec3::Y, p + Vec3::Y * 2.0]);
        triangle([p, p, p + Vec3::X]);
        triangle([p, p + Vec3::Z * 1.5, p + vec3(1e-7, 0.0, 0.75)]);
        let twin = [p + vec3(0.5, 0.0, 0.0), p + vec3(1.0, 0.0, 0.2), p + vec3(0.7, 0.5, 0.1)];
        triangle(twin);
        triangle([twin[0], twin[2], twin[1]]);
        b.add(none, &patch, Shading::Flat);
    }
    b.finish(eye(camera_at(0.0)), vec![light("sun", SUN)])
}
