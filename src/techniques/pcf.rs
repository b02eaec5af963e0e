//! Percentage-closer filtering (Reeves, Salesin, Cook 1987).

use super::Info;
use super::shadow_map::{GROUPS, MAPS, single};
use crate::map::filter::{Filter, Reach};
use crate::map::noise::NoiseParams;
use crate::params::Params;
use crate::view;

crate::params! {
    /// The filter of PCF.
    pub struct PcfParams {
        "Filter" {
            /// How the taps are laid out. Grid: single comparisons with equal weights. Hw2x2: bilinear comparisons of four texels each. Tent: the smoothest edge for its number of taps. Disk: a spiral of single comparisons. Tent3, 5 and 7: tents of that many texels in 4, 9 and 16 bilinear comparisons. Dpcf: a disk whose edges are sharpened where casters are close.
            mode: choice("grid", ["grid", "hw2x2", "tent", "disk", "tent3", "tent5", "tent7", "dpcf"]),
            /// Width of the filter. Wider: softer edges, more taps.
            kernel: int(3, 1..=9, "texels", 2) if mode = ["grid", "hw2x2", "tent"],
            /// Comparisons in the disk.
            samples: int(16, 4..=64, "taps") if mode = ["disk", "dpcf"],
            /// Radius of the disk, in dpcf that of the widest penumbra.
            radius: float(2.0, 0.5..=16.0, "texels") if mode = ["disk", "dpcf"],
            /// Width of the filter in the world, the same in all maps; 0: `kernel` texels, or a disk of `radius` texels.
            blur: float(0.0, 0.0..=1.0, "m") if mode = ["grid", "hw2x2", "disk", "dpcf"],
            /// How fast edges soften as the receiver moves away from the caster.
            ratio_scale: float(1.0, 0.1..=10.0, "") if mode = "dpcf",
        }
    }
}

pub static FILTER: Filter = Filter {
    id: "pcf",
    file: "map/filter/pcf.wgsl",
    reach: |f| {
        let p = PcfParams::read(f.values);
        let (texels, scales) = match p.mode.as_str() {
            "disk" | "dpcf" => (p.radius, true),
            "tent3" => (2.0, false),
            "tent5" => (3.0, false),
            "tent7" => (4.0, false),
            mode => (p.kernel as f32 / 2.0, mode != "tent"),
        };
        let casters = p.mode == "dpcf";
        match p.blur > 0.0 && scales {
            true => Reach { texels: 0.0, metres: p.blur / 2.0, casters },
            false => Reach { texels, metres: 0.0, casters },
        }
    },
    turns: Some(|values| matches!(PcfParams::read(values).mode.as_str(), "disk" | "dpcf")),
    views: &[
        view::map(
            "transition",
            "Transition",
            "Where the filter gives neither full light nor full shadow: bright is half lit.",
            view::ramp("nearness to half light", "", [0.0, 1.0]),
        ),
        view::map(
            "taps",
            "Tap pattern",
            "The filter's taps at the probed pixel, enlarged: squares are shadow-map texels, each dot is as bright as its weight.",
            view::ramp("weight over the largest", "", [0.0, 1.0]),
        ),
    ],
    ..Filter::PLAIN
};

pub static INFO: Info = Info {
    id: "pcf",
    title: "Percentage-closer filtering",
    paper: "Reeves, Salesin, Cook 1987",
    family: "Basics",
    mark: 1,
    doc: "Several depth comparisons around each pixel's place in the shadow map, averaged: the stairs blur. The blur \
          is equally wide everywhere, even where the shadow touches its caster.",
    lights: &["directional", "spot", "rect-area"],
    filter: Some(&FILTER),
    smooth: |_| false,
    params: crate::groups!(&[PcfParams::GROUP, NoiseParams::GROUP], GROUPS),
    main: &[("resolution", "256..8192*2"), ("mode", "grid,tent"), ("kernel", "3,5,7")],
    maps: &[MAPS],
    needs: |_| &[],
    make: single,
};
