//! Moment shadow maps (Peters, Klein 2015).

use super::Info;
use super::shadow_map::{GROUPS, MAPS, single};
use crate::map::filter::Filter;
use crate::map::prefilter::{CURVE, Moments, PrefilterParams, reach};
use crate::params::Params;
use crate::view::{self, View};
use wgpu::TextureFormat as Format;

crate::params! {
    /// The bound by four moments.
    pub struct MsmParams {
        "Filter" {
            /// How far the moments are drawn towards those of depths half at the near and half at the far plane, in millionths (20 times as far with 16 bits). Too little: rounding shows as noise. Too much: light leaks.
            moment_bias: float(3.0, 0.0..=100.0, "× 10⁻⁶"),
            /// Subtracted from the receiver's depth before the comparison, as a share of the map's range.
            msm_offset: float(1.0, 0.0..=10.0, "‰"),
            /// Factor on the bound, to make up for the shadow that it usually misses.
            overestimation: float(1.02, 1.0..=1.1, "×"),
        }
    }
}

pub static FILTER: Filter = Filter {
    id: "msm",
    file: "map/filter/msm.wgsl",
    reach,
    moments: Some(|values| match Moments::of(values, 1, 4) {
        Moments { format: Format::Rgba16Float, planes } => Moments { format: Format::Rgba16Unorm, planes },
        exact => exact,
    }),
    views: VIEWS,
    ..Filter::PLAIN
};

const VIEWS: &[View] = &[
    view::map(
        "near-depth",
        "Nearer depth",
        "The nearer of the two depths, beside the receiver's own, that the four moments are explained by.",
        view::ramp("depth", "× range", [0.0, 1.0]),
    ),
    view::map(
        "far-depth",
        "Farther depth",
        "The farther of the two depths that the four moments are explained by.",
        view::ramp("depth", "× range", [0.0, 1.0]),
    ),
    view::map(
        "determinant",
        "Determinant",
        "The determinant of the moments' Hankel matrix, logarithmic. Dark: one or two depths explain all; rounding decides.",
        view::ramp("12 + log₁₀ of the determinant, over 12", "", [0.0, 1.0]),
    ),
    CURVE,
];

pub static INFO: Info = Info {
    id: "msm",
    title: "Moment shadow map",
    paper: "Peters, Klein 2015",
    family: "Filters",
    mark: 18,
    doc: "Four moments of depth, from which the least shadow follows that they allow. Two layers of casters come out exactly; \
          with more, light leaks.",
    lights: &["directional", "spot", "rect-area"],
    filter: Some(&FILTER),
    smooth: |_| false,
    params: crate::groups!(&[PrefilterParams::GROUP, MsmParams::GROUP], GROUPS),
    main: &[("resolution", "256..4096*2"), ("blur_radius", "1,3,7")],
    maps: &[MAPS],
    needs: |_| &[],
    make: single,
};
