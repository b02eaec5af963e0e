//! Percentage-closer soft shadows (Fernando 2005).

use super::Info;
use super::shadow_map::{GROUPS, MAPS, single};
use crate::map::filter::{Filter, Reach, soft_reach};
use crate::map::noise::NoiseParams;
use crate::params::Params;
use crate::view::{self, View};

crate::params! {
    /// The two filters of PCSS.
    pub struct PcssParams {
        "Filter" {
            /// Comparisons that look for casters between the light and the receiver. Too few miss small casters.
            search_taps: int(25, 8..=64, "taps"),
            /// Comparisons over the penumbra. Too few show as bands.
            filter_taps: int(49, 8..=128, "taps"),
            /// The largest radius of search and filter, at most an eighth of the map's side. Wider penumbras are cut to it, and so many texels stay free at each border of a fitted map.
            max_radius: float(64.0, 1.0..=128.0, "texels"),
        }
    }
}

pub static FILTER: Filter = Filter {
    id: "pcss",
    file: "map/filter/pcss.wgsl",
    reach: |f| match f.light.has_size() {
        true => soft_reach(f, PcssParams::read(f.values).max_radius),
        false => Reach::default(),
    },
    turns: Some(|_| true),
    sized: |_| true,
    views: &[BLOCKER_DEPTH, PENUMBRA_WIDTH],
    cost: 16,
    ..Filter::PLAIN
};

pub const BLOCKER_DEPTH: View = view::map(
    "blocker-depth",
    "Mean depth of casters",
    "What the search finds: the mean depth of the casters between light and receiver, near the light dark, far from it bright. Where \
     it finds none, the scene shows.",
    view::ramp("depth in the map's range", "", [0.0, 1.0]),
);

pub const PENUMBRA_WIDTH: View = view::map(
    "penumbra-width",
    "Penumbra width",
    "The width that the penumbra of a straight edge would have at the depth that the search found; under a rectangle the wider one.",
    view::ramp("penumbra width", "m", [0.0, 1.0]),
);

pub static INFO: Info = Info {
    id: "pcss",
    title: "Percentage-closer soft shadows",
    paper: "Fernando 2005",
    family: "Filters",
    mark: 13,
    doc: "The farther a caster is from what it shades, the wider the penumbra: a search in the shadow map finds the \
          mean depth of the casters, and PCF as wide as the penumbra follows, over a disk or, under a rectangle, over one of its \
          shape. The light needs a size. Where casters lie at several depths their mean is the depth of none.",
    lights: &["directional", "spot", "rect-area"],
    filter: Some(&FILTER),
    smooth: |_| false,
    params: crate::groups!(&[PcssParams::GROUP, NoiseParams::GROUP], GROUPS),
    main: &[("resolution", "256..4096*2"), ("filter_taps", "16,49"), ("search_taps", "16,25")],
    maps: &[MAPS],
    needs: |_| &[],
    make: single,
};
