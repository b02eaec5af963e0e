//! Variance shadow maps (Donnelly, Lauritzen 2006).

use super::Info;
use super::shadow_map::{GROUPS, MAPS, single};
use crate::map::filter::Filter;
use crate::map::prefilter::{CURVE, Moments, PrefilterParams, reach};
use crate::params::Params;
use crate::view::{self, View};

crate::params! {
    /// What filters by Chebyshev's inequality share.
    pub struct ChebyshevParams {
        "Filter" {
            /// Light below this share counts as none, and the rest is rescaled: leaks behind several casters go dark, and penumbras get narrower.
            bleed_reduction: float(0.2, 0.0..=0.9, ""),
        }
    }
}

crate::params! {
    /// The moments of variance shadow maps.
    pub struct VsmParams {
        "Filter" {
            /// The smallest variance assumed, in millionths of the map's squared depth. Too little: rounding shows as acne. Too much: shadows pale close to their casters.
            least_variance: float(1.0, 0.01..=1000.0, "× 10⁻⁶"),
            /// The steepest slope within a texel that is added to the variance, as a share of the map's depth per texel.
            slope_within: float(0.01, 0.0..=0.1, "× range"),
        }
    }
}

pub static FILTER: Filter = Filter {
    id: "vsm",
    file: "map/filter/vsm.wgsl",
    reach,
    moments: Some(|values| Moments::of(values, 1, 2)),
    views: VIEWS,
    ..Filter::PLAIN
};

const VIEWS: &[View] = &[
    view::map(
        "mean-depth",
        "Mean depth",
        "The mean of the depths around each pixel's place in the map, near dark, far bright.",
        view::ramp("mean depth", "× range", [0.0, 1.0]),
    ),
    view::map(
        "deviation",
        "Deviation",
        "How far those depths lie from their mean, as the standard deviation. Large where the kernel holds both a caster and what \
         lies behind it: there light can leak.",
        view::ramp("standard deviation", "× range", [0.0, 0.25]),
    ),
    view::map(
        "bound",
        "Chebyshev's bound",
        "The largest share of light that the mean and the variance allow, before bleeding is reduced.",
        view::ramp("share of light", "", [0.0, 1.0]),
    ),
    CURVE,
];

pub static INFO: Info = Info {
    id: "vsm",
    title: "Variance shadow map",
    paper: "Donnelly, Lauritzen 2006",
    family: "Filters",
    mark: 14,
    doc: "The map holds the mean of depth and of its square, and can be blurred and mipmapped like any picture. Chebyshev's \
          inequality then bounds the light. Cheap and smooth, but light leaks through behind two casters one after the other.",
    lights: &["directional", "spot", "rect-area"],
    filter: Some(&FILTER),
    smooth: |_| false,
    params: crate::groups!(&[PrefilterParams::GROUP, VsmParams::GROUP, ChebyshevParams::GROUP], GROUPS),
    main: &[("resolution", "256..4096*2"), ("blur_radius", "1,3,7")],
    maps: &[MAPS],
    needs: |_| &[],
    make: single,
};
