//! Drivers that lack something, refuse something, or go away: what is told, and what goes on.

use crate::common::*;
use glam::Vec3;
use shadowscope::frame::{Ask, Renderer, Truth};
use shadowscope::gpu::{self, Failure, Gpu};
use shadowscope::light::Light;
use shadowscope::scene::Scene;
use shadowscope::techniques::{self, Info};
use std::sync::Arc;

fn over_the_yard(light: Light) -> Scene {
    scene(vec![mesh(&yard(), 0)], vec![material(Vec3::ONE)], camera(Vec3::new(4.0, 6.0, 7.0), Vec3::ZERO), light)
}

fn device(lower: impl FnOnce(wgpu::Features, wgpu::Limits) -> (wgpu::Features, wgpu::Limits)) -> Arc<Gpu> {
    Arc::new(Gpu::within(&gpu::instance(), None, None, lower).unwrap())
}

#[test]
fn survey() {
    let lights = [
        sun(Vec3::new(0.4, 0.8, 0.3).normalize()),
        lamp(Vec3::new(-0.5, 3.0, 2.0)),
        plate(Vec3::new(3.0, 7.0, 2.0), Vec3::ZERO, 0.3),
    ];
    let (mut strong, mut setup) = start(over_the_yard(lights[0]), [96, 72]);
    let mut weak: Vec<(&str, Arc<Gpu>)> = vec![("downlevel", device(|f, _| (f, wgpu::Limits::downlevel_defaults())))];
    for (n, f) in [
        ("no clip control", wgpu::Features::DEPTH_CLIP_CONTROL),
        ("no stencil8", wgpu::Features::DEPTH32FLOAT_STENCIL8),
        ("no filterable", wgpu::Features::FLOAT32_FILTERABLE),
        ("no blendable", wgpu::Features::FLOAT32_BLENDABLE),
        ("no 16 norm", wgpu::Features::TEXTURE_FORMAT_16BIT_NORM),
        ("no adapter specific", wgpu::Features::TEXTURE_ADAPTER_SPECIFIC_FORMAT_FEATURES),
        ("no statistics", wgpu::Features::PIPELINE_STATISTICS_QUERY),
    ] {
        weak.push((n, device(move |all, l| (all - f, l))));
    }
    let mut weak: Vec<_> = weak
        .into_iter()
        .map(|(n, g)| (n, Renderer::new(g, strong.scene().clone()).map_err(|e| println!("{n}: {e:#}"))))
        .collect();
    for info in techniques::ALL.iter() {
        let light = crate::laws::in_turn(info, &lights).unwrap();
        setup.light = light;
        let filters: Vec<String> = crate::laws::filters(info).into_iter().map(|f| format!("filter={}", f.id)).collect();
        let rasters = info.specs().any(|s| s.name == "raster");
        if !rasters && info.id != "prefiltered-soft" {
            continue;
        }
        let filters: Vec<String> = if rasters {
            vec!["raster=linear".into(), "raster=subdivide".into(), "raster=exact".into()]
        } else {
            filters
        };
        let all: Vec<Vec<String>> =
            if filters.is_empty() { vec![vec![]] } else { filters.into_iter().map(|f| vec![f]).collect() };
        for sets in all {
            choose(&mut setup, info, 512, &sets);
            let ask = Ask { analysis: true, truth: Truth::Off, ..ask(&setup) };
            if let Err(e) = strong.render(&setup, ask) {
                println!("STRONG {} {sets:?}: {e:#}", info.id);
                continue;
            }
            let right = strong.read_visibility().unwrap();
            for (name, r) in &mut weak {
                let Ok(r) = r else { continue };
                let got = r.render(&setup, ask).and_then(|_| r.read_visibility());
                match got {
                    Err(e) => println!("{name} {} {sets:?} ERR {}", info.id, shadowscope_short(&e)),
                    Ok(v) => {
                        let d = v.iter().zip(&right).map(|(a, b)| (a - b).abs()).fold(0.0f32, f32::max);
                        let n = v.iter().zip(&right).filter(|(a, b)| a != b).count();
                        if n > 0 {
                            println!("{name} {} {sets:?} DIFF {n} pixels, most {d}", info.id);
                        }
                    }
                }
            }
        }
    }
}

fn shadowscope_short(e: &anyhow::Error) -> String {
    let t = format!("{e:#}");
    t.chars().take(420).collect()
}
