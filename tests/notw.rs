//! Non-orthogonal texture warping, and the raster that all warps share.

mod common;

use common::*;
use shadowscope::frame::{Ask, Renderer};
use shadowscope::setup::Setup;
use std::sync::Arc;

fn built_in(name: &str, size: [u32; 2]) -> (Renderer, Setup) {
    let (mut setup, scene) = Setup::open(name).unwrap();
    setup.size = size;
    (Renderer::new(gpu(), Arc::new(scene)).unwrap(), setup)
}

#[test]
fn probe() {
    let name = std::env::var("S").unwrap_or("bench".into());
    let (mut r, mut s) = built_in(&name, [256, 256]);
    s.select("notw").unwrap();
    for set in std::env::var("O").unwrap_or_default().split_whitespace() {
        s.set(set, &["notw".into()]).unwrap();
    }
    for _ in 0..2 {
        r.render(&s, Ask { analysis: true, timed: true, ..ask(&s) }).unwrap();
    }
    println!("{:?}", r.analysis().pieces(&r.gpu));
    println!("{:?}", shadowscope::measure::errors(&mut r, &s).unwrap().share() * 100.0);
    println!("{:?}", r.analysis().pieces(&r.gpu));
    for (n, ms) in &r.timer.latest {
        println!("{n}: {ms:.2}");
    }
}
