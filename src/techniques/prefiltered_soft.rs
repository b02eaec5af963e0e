//! Shadows from summed-area tables: summed-area variance shadow maps (Lauritzen 2007), variance (Yang et al. 2010) and moment soft
//! shadow mapping (Peters et al. 2016).

use super::Info;
use super::pcss::{BLOCKER_DEPTH, PENUMBRA_WIDTH};
use super::shadow_map::{GROUPS, MAPS, single};
use crate::map::filter::{Filter, Reach, soft_reach};
use crate::map::prefilter::Moments;
use crate::params::Params;
use wgpu::TextureFormat as Format;

crate::params! {
    /// The box means of shadows.
    pub struct PrefilteredSoftParams {
        "Filter" {
            /// What is kept of depth. Savsm: two moments, and a box as wide whatever casts. Vssm: the same two, and a box as wide as the penumbra. Light leaks where casters lie at several depths. Mssm: four moments, twice the memory. Less leaks, and the casters' mean depth is closer.
            soft_kind: choice("mssm", ["vssm", "mssm", "savsm"]),
            /// Side of the box that is averaged, where no pixel covers more of the map.
            box_width: float(7.0, 1.0..=256.0, "texels") if soft_kind = "savsm",
            /// Side of the widest box that is searched or averaged, at most a quarter of the map's side. Wider penumbras are cut to it. Too wide: few bits are left for each texel, and shadows get noisy.
            max_box: int(128, 8..=256, "texels"),
            /// Boxes to a side that a box is cut into where its mean depth lies behind the receiver, as on receivers that are not flat, so that it tells little of the casters. 1: none is cut.
            subdivision: int(4, 1..=4, "boxes"),
            /// Light below this share counts as none, and the rest is rescaled: leaks behind several casters go dark, and penumbras get narrower.
            soft_bleeding: float(0.0, 0.0..=0.9, ""),
            /// How much of a box's half, from its middle, the comparison clears of the receiver's own slope. 0: wide lights shade lit slopes. 1: none is shaded, but casters close to a slope lose their shadow. Without a bias that knows the slope it does nothing.
            box_bias: float(0.5, 0.0..=1.0, "× box"),
            /// How far the moments are drawn towards those of depths half at the near and half at the far plane. Too little: rounding shows as noise. Too much: light leaks.
            mssm_bias: float(6.0, 0.0..=100.0, "× 10⁻⁶") if soft_kind = "mssm",
        }
    }
}

pub static FILTER: Filter = Filter {
    id: "prefiltered-soft",
    file: "map/filter/prefiltered_soft.wgsl",
    reach: |f| {
        let p = PrefilteredSoftParams::read(f.values);
        match (p.soft_kind.as_str(), f.light.has_size()) {
            ("savsm", _) => Reach { casters: false, ..soft_reach(f, 0.5 * p.box_width.min(p.max_box as f32)) },
            (_, true) => soft_reach(f, 0.5 * p.max_box as f32),
            (_, false) => Reach { texels: 1.0, ..Reach::default() },
        }
    },
    moments: Some(|values| Moments {
        planes: 1,
        format: match PrefilteredSoftParams::read(values).soft_kind.as_str() {
            "mssm" => Format::Rgba32Uint,
            _ => Format::Rg32Uint,
        },
    }),
    sized: |values| PrefilteredSoftParams::read(values).soft_kind != "savsm",
    views: &[BLOCKER_DEPTH, PENUMBRA_WIDTH],
    cost: 24,
    ..Filter::PLAIN
};

pub static INFO: Info = Info {
    id: "prefiltered-soft",
    title: "Prefiltered soft shadows",
    paper: "Lauritzen 2007; Yang et al. 2010; Peters et al. 2016",
    family: "Filters",
    mark: 19,
    doc: "Penumbras as wide as PCSS has them, at the same cost whatever their width: moments of depth are summed up over the map, so \
          that the mean over a box takes a few reads. One box tells how far off the casters are, a second how much light \
          they leave. The light needs a size, unless the box's width is given. Light leaks where casters lie at several depths.",
    lights: &["directional", "spot", "rect-area"],
    filter: Some(&FILTER),
    smooth: |_| false,
    params: crate::groups!(&[PrefilteredSoftParams::GROUP], GROUPS),
    main: &[("resolution", "256..4096*2"), ("soft_kind", "vssm,mssm")],
    maps: &[MAPS],
    needs: |_| &[],
    make: single,
};
