//! Warps on maps that look in all directions.

use crate::common::*;
use glam::Vec3;
use shadowscope::frame::{Ask, Renderer};
use shadowscope::light::Light;
use shadowscope::measure;
use shadowscope::setup::Setup;

const ALL: [&str; 4] = ["notw-cube", "notw-paraboloid", "rtw-cube", "rtw-paraboloid"];

/// A yard with a lamp in it.
fn lamp_lit(size: [u32; 2]) -> (Renderer, Setup) {
    let light = Light::Omni { position: Vec3::new(1.5, 2.5, 1.0), range: 100.0, radius: 0.0, color: Vec3::ONE };
    let view = camera(Vec3::new(2.0, 5.0, 9.0), Vec3::ZERO);
    start(scene(vec![mesh(&yard(), 0)], vec![material(Vec3::ONE)], view, light), size)
}

fn visibility(r: &mut Renderer, s: &Setup) -> Vec<f32> {
    r.render(s, Ask { analysis: true, ..ask(s) }).unwrap();
    r.read_visibility().unwrap()
}

/// Four times the resolution errs less, and split triangles as little as the texels' own rays.
#[test]
fn errors_fall_around_a_lamp() {
    let (mut r, mut s) = lamp_lit([160, 120]);
    for id in ALL {
        let [coarse, fine] = ["resolution=64", "resolution=256"].map(|resolution| {
            select(&mut s, id, &[resolution]);
            measure::errors(&mut r, &s).unwrap().rmse
        });
        println!("{id}: {coarse:.4} to {fine:.4}");
        assert!(fine < 0.75 * coarse && fine < 0.15, "{id}: {coarse} to {fine}");
    }
    for id in &ALL[2..] {
        let [exact, split] = ["raster=exact", "raster=subdivide"].map(|raster| {
            select(&mut s, id, &["resolution=128", raster]);
            measure::errors(&mut r, &s).unwrap().rmse
        });
        println!("{id}: exact {exact:.4}, subdivided {split:.4}");
        assert!((split - exact).abs() < 0.03, "{id}: {exact} against {split}");
    }
}

/// Neither cropped nor bent, a map is the plain one.
#[test]
fn without_a_warp_faces_are_plain() {
    let (mut r, mut s) = lamp_lit([160, 120]);
    for (id, plain) in [("notw-cube", "cube"), ("notw-paraboloid", "dual-paraboloid")] {
        select(&mut s, plain, &["resolution=256"]);
        let expected = visibility(&mut r, &s);
        select(&mut s, id, &["resolution=256", "strength=0", "crop=none"]);
        let found = visibility(&mut r, &s);
        let other = expected.iter().zip(&found).filter(|(a, b)| a != b).count();
        println!("{id}: {other} pixels differ from {plain}");
        assert!(other <= 20, "{id}: {other} of {} pixels differ", found.len());
        // The comparison would see a warp.
        select(&mut s, id, &["resolution=256"]);
        let warped = visibility(&mut r, &s);
        assert!(warped.iter().zip(&expected).filter(|(a, b)| a != b).count() > other, "{id}");
    }
}

/// Every view sample is counted in one face. A face without any holds nothing at all, and the others only what is looked up.
#[test]
fn faces_hold_what_is_looked_up() {
    let (mut r, mut s) = lamp_lit([96, 72]);
    for id in ALL {
        select(&mut s, id, &["resolution=256"]);
        visibility(&mut r, &s);
        let samples: Vec<u32> =
            bytemuck::pod_collect_to_vec(&r.analysis().table(&r.gpu, "face_samples").unwrap().unwrap());
        assert_eq!(samples.iter().sum::<u32>() as u64, facing(&mut r), "{id}: {samples:?}");
        let known = r.known().unwrap().faces;
        let mut idle = 0;
        for (i, face) in known.iter().enumerate() {
            let map = r.read_layer(i as u32).unwrap().unwrap();
            let held = map.depth.iter().filter(|d| **d > 0.0).count() as u32;
            // A sample may need its texel's neighbours too.
            assert!(held <= 9 * samples[i], "{id} {i}: {held} texels for {} samples", samples[i]);
            assert_eq!(face.is_some(), samples[i] > 0, "{id} {i}: {face:?}");
            assert!(samples[i] < 500 || (held > 100 && face.is_some_and(|[_, n]| n > 0)), "{id} {i}: {held}");
            idle += (samples[i] == 0) as usize;
        }
        assert!(idle > 0 || known.len() == 2, "{id}: {samples:?}");
    }
}
