//! A long wall behind a long row of posts.

use super::{Case, FRAMES, bar, eye, floor, look, paving, sun};
use crate::light::Light;
use crate::scene::builtin::builder::{Builder, light};
use crate::scene::{Camera, Scene};
use glam::vec3;

pub const CASE: Case = Case {
    id: "st-seam",
    title: "Seam: across the splits",
    doc: "A wall runs from the camera into the distance, across every split of pssm and sdsm: seams, and taps of pcf \
          beyond the map's edge.",
    provokes: &["seam", "stairs"],
    axis: "camera's way, m",
    value: way,
    place: |setup, t| setup.camera = camera_at(t),
    telling: 0.3,
    frames: FRAMES,
    build,
};

fn way(t: f32) -> f32 {
    6.0 * t
}

fn camera_at(t: f32) -> Camera {
    let ahead = vec3(0.0, 0.0, -way(t));
    look(vec3(3.0, 2.0, 4.5) + ahead, vec3(-1.4, 1.0, -1.2) + ahead, 54.0, 0.1, 90.0)
}

fn build() -> Scene {
    let mut b = Builder::new(CASE.id);
    let ground = paving(&mut b);
    let wall = b.material("wall", 0xd9cdb8);
    let posts = b.material("posts", 0x8a6246);
    floor(&mut b, ground, [-2.0, -60.0], [8.0, 8.0], 0.0);
    b.cuboid(wall, vec3(-2.3, 0.0, -60.0), vec3(-2.0, 3.0, 8.0));
    for k in 0..66 {
        let z = 6.0 - k as f32;
        bar(&mut b, posts, vec3(-1.1, 0.0, z), vec3(-1.1, 2.2, z), 0.07);
    }
    bar(&mut b, posts, vec3(-1.1, 2.2, 7.0), vec3(-1.1, 2.2, -60.0), 0.09);
    let lamp = Light::Omni { position: vec3(0.8, 2.6, -4.2), range: 60.0, radius: 0.0, color: vec3(9.0, 8.2, 6.8) };
    b.finish(eye(camera_at(0.0)), vec![light("sun", sun(62.0, 34.0)), light("lamp", lamp)])
}
