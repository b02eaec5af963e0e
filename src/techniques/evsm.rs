//! Exponential variance shadow maps (Lauritzen, McCool 2008).

use super::Info;
use super::shadow_map::{GROUPS, MAPS, single};
use super::vsm::ChebyshevParams;
use crate::map::filter::Filter;
use crate::map::prefilter::{CURVE, Moments, PrefilterParams, reach};
use crate::params::Params;
use crate::view::{self, View};

crate::params! {
    /// The warps of exponential variance shadow maps.
    pub struct EvsmParams {
        "Filter" {
            /// How strongly the positive warp stretches what is far. Larger: less light leaks; overflows above 42 with 32 bits, above 5.5 with 16.
            far_exponent: float(40.0, 5.0..=60.0, ""),
            /// How strongly the negative warp stretches what is near. The same limits hold.
            near_exponent: float(5.0, 1.0..=60.0, ""),
            /// The smallest deviation of depth assumed. Too little: rounding shows as acne.
            least_deviation: float(0.5, 0.05..=5.0, "‰"),
        }
    }
}

pub static FILTER: Filter = Filter {
    id: "evsm",
    file: "map/filter/evsm.wgsl",
    reach,
    moments: Some(|values| Moments::of(values, 1, 4)),
    views: VIEWS,
    ..Filter::PLAIN
};

const VIEWS: &[View] = &[
    view::map(
        "positive-bound",
        "Bound by the positive warp",
        "The largest share of light that the moments of the positive exponential allow.",
        view::ramp("share of light", "", [0.0, 1.0]),
    ),
    view::map(
        "negative-bound",
        "Bound by the negative warp",
        "The largest share of light that the moments of the negative exponential allow. The smaller of the two bounds counts.",
        view::ramp("share of light", "", [0.0, 1.0]),
    ),
    CURVE,
];

pub static INFO: Info = Info {
    id: "evsm",
    title: "Exponential variance shadow map",
    paper: "Lauritzen, McCool 2008",
    family: "Filters",
    mark: 16,
    doc: "Variance shadow maps of depth that two exponentials have warped, of which the better bound counts. Little light leaks; \
          it takes twice the memory, and more bits.",
    lights: &["directional", "spot", "rect-area"],
    filter: Some(&FILTER),
    smooth: |_| false,
    params: crate::groups!(&[PrefilterParams::GROUP, EvsmParams::GROUP, ChebyshevParams::GROUP], GROUPS),
    main: &[("resolution", "256..4096*2"), ("blur_radius", "1,3,7")],
    maps: &[MAPS],
    needs: |_| &[],
    make: single,
};
