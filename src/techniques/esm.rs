//! Exponential shadow maps (Annen, Mertens, Seidel, Flerackers, Kautz 2008; Salvi 2008).

use super::Info;
use super::shadow_map::{GROUPS, MAPS, single};
use crate::map::filter::Filter;
use crate::map::prefilter::{CURVE, Moments, PrefilterParams, reach};
use crate::params::Params;
use crate::view::{self, View};

crate::params! {
    /// The exponential that stands for the depth test.
    pub struct EsmParams {
        "Filter" {
            /// How steep the exponential is. Small: light leaks where shadows touch their casters. Overflows above 88 with 32 bits, above 11 with 16.
            exponent: float(60.0, 5.0..=120.0, ""),
            /// Subtracted from the receiver's depth before the comparison, as a share of the map's range.
            esm_offset: float(0.5, 0.0..=10.0, "‰"),
            /// Compare texel by texel where part of the kernel lies behind the receiver and the exponential says nothing about the rest.
            fall_back: flag(true),
        }
    }
}

pub static FILTER: Filter = Filter {
    id: "esm",
    file: "map/filter/esm.wgsl",
    reach,
    moments: Some(|values| Moments::of(values, 1, 1)),
    views: VIEWS,
    ..Filter::PLAIN
};

const VIEWS: &[View] = &[
    view::map(
        "filtered-depth",
        "Filtered depth",
        "The logarithm of what the map holds, over the exponent: a mean of depths in which the far ones weigh most.",
        view::ramp("depth", "× range", [0.0, 1.0]),
    ),
    view::map(
        "over-bound",
        "Beyond the bound",
        "Red: part of the kernel lies behind the receiver, and the exponential says nothing of the rest. Compared texel by texel \
         there, or taken for lit.",
        view::Drawn::Labels(view::Legend::Classes(&[view::Class::label(0, "part of the kernel lies behind")])),
    ),
    CURVE,
];

pub static INFO: Info = Info {
    id: "esm",
    title: "Exponential shadow map",
    paper: "Annen et al. 2008",
    family: "Filters",
    mark: 15,
    doc: "An exponential stands for the depth test, so that one number per texel can be blurred. Light leaks near contacts, and \
          where receivers are not flat it must be helped.",
    lights: &["directional", "spot", "rect-area"],
    filter: Some(&FILTER),
    smooth: |_| false,
    params: crate::groups!(&[PrefilterParams::GROUP, EsmParams::GROUP], GROUPS),
    main: &[("resolution", "256..4096*2"), ("blur_radius", "1,3,7")],
    maps: &[MAPS],
    needs: |_| &[],
    make: single,
};
