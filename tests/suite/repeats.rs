//! Every picture and every figure is the same each time, bit for bit, whichever thread comes first.

use crate::common::*;
use shadowscope::frame::{Ask, Renderer};
use shadowscope::light::Light;
use shadowscope::measure;
use shadowscope::setup::Setup;
use shadowscope::techniques;
use std::sync::Arc;

/// The set-up of a built-in scene as it starts, and with its first spot.
fn lights(name: &str) -> Vec<Setup> {
    let (setup, scene) = Setup::open(name).unwrap();
    let spot = scene.lights.iter().find(|l| matches!(l.light, Light::Spot { .. }));
    let spot = spot.map(|l| Setup { light: l.light, ..setup.clone() });
    [setup].into_iter().chain(spot).collect()
}

/// Renders the picture, the errors and the own maps of each technique anew, `times` over, under one of the lights that it serves.
fn repeat(name: &str, size: [u32; 2], times: usize) {
    let (_, scene) = Setup::open(name).unwrap();
    let mut r = Renderer::new(gpu(), Arc::new(scene)).unwrap();
    let lights = lights(name);
    for info in techniques::ALL.iter() {
        let served: Vec<_> = lights.iter().filter(|s| info.refuses(&s.light).is_none()).collect();
        // Every other under the spot.
        if let Some(s) = served.get(info.mark % served.len().max(1)) {
            let mut s = Setup { size, ..(*s).clone() };
            s.select(info.id).unwrap();
            // Smaller maps, where a technique has any: the same passes in less time.
            let _ = s.set("resolution=128", &[info.id.into()]);
            let mut seen = Vec::new();
            for _ in 0..times {
                // All anew with the first view; the others are of the same maps.
                for (k, id) in
                    ["shaded", "error"].into_iter().chain(info.views(&Default::default()).map(|m| m.id)).enumerate()
                {
                    s.view = id.into();
                    r.render(&s, Ask { fresh: k == 0, ..ask(&s) }).unwrap();
                    let found = (r.read_visibility().unwrap(), r.read_picture().unwrap(), r.notes().unwrap());
                    match seen.get(k) {
                        Some(first) => assert!(*first == found, "{name}, {} light, {}, {id}", s.light.kind(), info.id),
                        None => seen.push(found),
                    }
                }
            }
            s.view = "shaded".into();
            let measured: Vec<_> = (0..times)
                .map(|_| serde_json::to_string(&measure::accuracy(&mut r, &s, 0).unwrap()).unwrap())
                .collect();
            for other in &measured {
                assert_eq!(*other, measured[0], "{name}, {} light, {}", s.light.kind(), info.id);
            }
        }
    }
}

#[test]
fn pictures_and_figures_repeat() {
    repeat("cubes", [48, 32], 2);
}
