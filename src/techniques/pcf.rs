//! Percentage-closer filtering (Reeves, Salesin, Cook 1987).

use super::shadow_map::MAPS;
use super::{Info, Technique};
use crate::frame::Frame;
use crate::gpu::{Gpu, Pass};
use crate::params::Params;
use crate::shadow_map::{FitParams, HardwareParams, MapParams, ShadowMap};
use crate::view;
use anyhow::Result;

crate::params! {
    /// The filter of PCF.
    pub struct PcfParams {
        "Filter" {
            /// How the taps are laid out. Grid: single comparisons with equal weights. Hw2x2: bilinear comparisons of four texels each. Tent: the smoothest edge for its number of taps. Disk: a spiral of single comparisons.
            mode: choice("grid", ["grid", "hw2x2", "tent", "disk"]),
            /// Width of the filter. Wider: softer edges, more taps.
            kernel: int(3, 1..=9, "texels", 2) if mode = ["grid", "hw2x2", "tent"],
            /// Comparisons in the disk.
            samples: int(16, 4..=64, "taps") if mode = "disk",
            /// Radius of the disk.
            radius: float(2.0, 0.5..=16.0, "texels") if mode = "disk",
            /// Turn the disk by a different angle at every pixel: bands become noise.
            rotate: flag(false) if mode = "disk",
        }
    }
}

pub static INFO: Info = Info {
    id: "pcf",
    title: "Percentage-closer filtering",
    paper: "Reeves, Salesin, Cook 1987",
    family: "Basics",
    mark: 1,
    doc: "Several depth comparisons around each pixel's place in the shadow map, averaged: the stairs blur. The blur \
          is equally wide everywhere, even where the shadow touches its caster.",
    lights: &["directional", "spot"],
    filters: true,
    params: &[PcfParams::GROUP, FitParams::GROUP, MapParams::GROUP, HardwareParams::GROUP],
    main: &[("resolution", "256..8192*2"), ("mode", "grid,tent"), ("kernel", "3,5,7")],
    maps: &[
        MAPS.split_at(3).0,
        &[
            view::map(
                "transition",
                "Transition",
                "Where the filter gives neither full light nor full shadow: bright is half lit.",
                view::ramp("nearness to half light", "", [0.0, 1.0]),
            ),
            view::map(
                "taps",
                "Tap pattern",
                "The filter's taps, enlarged: squares are shadow-map texels, each dot is as bright as its weight.",
                view::ramp("weight over the largest", "", [0.0, 1.0]),
            ),
        ],
        MAPS.split_at(3).1,
    ],
    make: |gpu| Ok(Box::new(Pcf::new(gpu)?)),
};

struct Pcf {
    map: ShadowMap,
    resolve: Pass,
    inspect: Pass,
    sampler: wgpu::Sampler,
}

impl Pcf {
    fn new(gpu: &Gpu) -> Result<Pcf> {
        let file = "techniques/pcf.wgsl";
        Ok(Pcf {
            map: ShadowMap::new(gpu)?,
            resolve: Pass::compute(gpu, "resolve", file, "resolve", INFO.params)?,
            inspect: Pass::compute(gpu, "inspect", file, "inspect", INFO.params)?,
            sampler: gpu.device.create_sampler(&wgpu::SamplerDescriptor {
                label: Some("depth comparison"),
                mag_filter: wgpu::FilterMode::Linear,
                min_filter: wgpu::FilterMode::Linear,
                compare: Some(wgpu::CompareFunction::GreaterEqual),
                ..Default::default()
            }),
        })
    }
}

impl Technique for Pcf {
    fn render(&mut self, f: &mut Frame) -> Result<()> {
        let p = PcfParams::read(f.values);
        let reach = if p.mode == "disk" { p.radius } else { p.kernel as f32 / 2.0 };
        let drawn = self.map.render(f, reach)?;
        f.run(&self.resolve)
            .bind("shadow_map", &drawn.map)
            .bind("light_view", &drawn.light_view)
            .bind("compare_sampler", &self.sampler)
            .per_pixel();
        if f.wants_any_map() {
            f.run(&self.inspect)
                .bind("shadow_map", &drawn.map)
                .bind("light_view", &drawn.light_view)
                .bind("compare_sampler", &self.sampler)
                .per_pixel();
        }
        Ok(())
    }
}
