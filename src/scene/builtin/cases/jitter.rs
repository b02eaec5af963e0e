//! A park seen by a camera that hardly moves.

use super::{Case, conifer, eye, fence, floor, look, paving, sun};
use crate::scene::builtin::builder::{Builder, Rng, light};
use crate::scene::{Camera, Scene};
use glam::{Mat3, vec3};

pub const CASE: Case = Case {
    id: "st-jitter",
    title: "Jitter: crawling edges",
    doc: "The camera moves sideways by a sixty-fourth of a texel per frame, then turns as slowly: fits that are not \
          snapped to the texels crawl (shadow-map, pcf, pssm with any fit but stable), warps swim (lispsm, tsm, rtw, \
          notw), and sdsm's boxes pop.",
    provokes: &["stairs"],
    axis: "frame",
    value: |t| t * (FRAMES - 1) as f32,
    place: |setup, t| setup.camera = camera_at(t),
    telling: 0.0,
    frames: FRAMES,
    build,
};

const FRAMES: usize = 64;
/// A texel of a 1024² map fitted to the view, metres; tests hold it against the fit.
const TEXEL: f32 = 0.039;

/// Half the frames go sideways, the others turn about the eye, as fast at the middle of the picture.
fn camera_at(t: f32) -> Camera {
    let step = TEXEL / 64.0;
    let frame = t * (FRAMES - 1) as f32;
    let half = (FRAMES / 2) as f32;
    let (from, to) = (vec3(0.0, 2.3, 14.0), vec3(0.2, 0.2, 5.0));
    let aside = vec3(step * frame.min(half), 0.0, 0.0);
    let turn = Mat3::from_rotation_y(-step * (frame - half).max(0.0) / from.distance(to));
    look(from + aside, from + aside + turn * (to - from), 48.0, 0.2, 80.0)
}

fn build() -> Scene {
    let mut b = Builder::new(CASE.id);
    let ground = paving(&mut b);
    let wood = b.material("wood", 0xb98a5a);
    let green = b.material("needles", 0x4f7d4a);
    floor(&mut b, ground, [-16.0, -26.0], [16.0, 16.0], 0.0);
    b.at(vec3(-5.4, 0.0, 9.3), |b| fence(b, wood, 6.0, 0.9, 0.14));
    b.turned(vec3(1.4, 0.0, 8.6), 0.5, |b| fence(b, wood, 4.0, 0.9, 0.14));
    b.turned(vec3(-8.0, 0.0, -2.0), -0.15, |b| fence(b, wood, 16.0, 1.1, 0.18));
    let mut rng = Rng::new(3);
    for k in 0..26 {
        let (x, z) = (rng.range(-13.0, 13.0), 5.0 - 1.1 * k as f32);
        let height = rng.range(1.5, 3.5);
        conifer(&mut b, wood, green, vec3(x, 0.0, z), height);
    }
    b.finish(eye(camera_at(0.0)), vec![light("sun", sun(-62.0, 36.0))])
}
