//! What passes are said to move.

use crate::common::*;
use shadowscope::frame::{Ask, Renderer};
use shadowscope::gpu::{Gpu, Traffic};
use shadowscope::measure::{metrics::FACING, timing};
use shadowscope::setup::Setup;
use std::sync::Arc;

/// A look-up writes the picture's visibility once; every filtered tap more is a texel more of each pixel that looks one up; no cache has to
/// move more than was asked for. Counting changes no picture.
#[test]
fn counted_bytes_are_those_of_the_picture() {
    let (setup, scene) = Setup::open("cubes").unwrap();
    let scene = Arc::new(scene);
    let counting = Gpu::new(None).unwrap().count_traffic().unwrap();
    let mut counting = Renderer::new(Arc::new(strict(counting)), scene.clone()).unwrap();
    let mut plain = Renderer::new(gpu(), scene).unwrap();
    let mut s = Setup { size: [64, 48], ..setup };
    let pass = |all: &[(&str, Traffic)], name: &str| {
        all.iter().find(|p| p.0 == name).unwrap_or_else(|| panic!("{name}: {all:?}")).1
    };
    let mut reads = Vec::new();
    for kernel in ["kernel=1", "kernel=3", "kernel=5"] {
        select(&mut s, "pcf", &["resolution=128", "mode=grid", kernel]);
        let moved = timing::traffic(&mut counting, &s).unwrap();
        let resolve = pass(&moved, "resolve");
        assert_eq!(resolve.written, 64 * 48 * 4, "{moved:?}");
        assert_eq!(resolve.threads, 64 * 48);
        assert!(moved.iter().all(|(_, t)| t.least <= t.read + t.written && t.least > 0), "{moved:?}");
        // Depth is cleared and drawn: four bytes a texel.
        assert_eq!(pass(&moved, "shadow map").written, 128 * 128 * 4, "{moved:?}");
        reads.push(resolve.read as i64);
        let [there, here] = [&mut counting, &mut plain].map(|r| {
            r.render(&s, Ask { fresh: true, ..ask(&s) }).unwrap();
            r.read_visibility().unwrap()
        });
        assert!(there == here, "{kernel}");
    }
    let facing = plain.read_mask().unwrap().iter().filter(|m| **m == FACING).count() as i64;
    let [more, most] = [reads[1] - reads[0], reads[2] - reads[1]];
    assert!(facing > 500 && more % 4 == 0 && more > 0, "{reads:?}");
    // Pixels beyond the map look nothing up.
    assert!(most <= 16 * 4 * facing && most > 8 * 4 * facing, "{reads:?}, {facing} pixels");
    // Of a map in many layers a blur reads one and writes one at a time: at the least each texel once, and as asked for
    // what four neighbours share.
    select(&mut s, "csm-convolution", &["resolution=128", "blur_radius=3"]);
    let blur = pass(&timing::traffic(&mut counting, &s).unwrap(), "blur");
    assert_eq!(blur.least, 2 * blur.written, "{blur:?}");
    assert_eq!(2 * blur.read, 5 * blur.written, "(4 + 2 radius) / 4 texels: {blur:?}");
}
