//! Convolution shadow maps (Annen, Mertens, Bekaert, Seidel, Kautz 2007).

use super::Info;
use super::shadow_map::{GROUPS, MAPS, single};
use crate::map::filter::Filter;
use crate::map::prefilter::{CURVE, Moments, PrefilterParams, reach};
use crate::params::Params;
use crate::view::{self, View};

crate::params! {
    /// The series that stands for the depth test.
    pub struct CsmConvolutionParams {
        "Filter" {
            /// Terms of the series: two numbers a texel each. Few: the step is a ramp, and light leaks near contacts.
            terms: int(8, 1..=16, "terms"),
            /// How strongly high frequencies are damped. 0: the series rings, in stripes of light and dark.
            damping: float(1.0, 0.0..=4.0, ""),
            /// Subtracted from the receiver's depth before the comparison; about half the ramp's width.
            csm_offset: float(0.02, 0.0..=0.2, "× range"),
        }
    }
}

pub static FILTER: Filter = Filter {
    id: "csm-convolution",
    file: "map/filter/csm_convolution.wgsl",
    reach,
    moments: Some(|values| Moments::of(values, CsmConvolutionParams::read(values).terms.div_ceil(2), 4)),
    views: VIEWS,
    ..Filter::PLAIN
};

const VIEWS: &[View] = &[
    view::map(
        "first-term",
        "First term",
        "The averaged sine of the first term of the series.",
        view::ramp("(1 + sine) / 2", "", [0.0, 1.0]),
    ),
    view::map(
        "last-term",
        "Last term",
        "The averaged sine of the last term of the series: grey where depths in the kernel differ.",
        view::ramp("(1 + sine) / 2", "", [0.0, 1.0]),
    ),
    CURVE,
];

pub static INFO: Info = Info {
    id: "csm-convolution",
    title: "Convolution shadow map",
    paper: "Annen et al. 2007",
    family: "Filters",
    mark: 17,
    doc: "The depth test as a Fourier series: its terms can be blurred before the receiver is known. It takes many numbers a \
          texel, rings, and leaks near contacts.",
    lights: &["directional", "spot", "rect-area"],
    filter: Some(&FILTER),
    smooth: |_| false,
    params: crate::groups!(&[PrefilterParams::GROUP, CsmConvolutionParams::GROUP], GROUPS),
    main: &[("resolution", "256..2048*2"), ("terms", "4,8,16")],
    maps: &[MAPS],
    needs: |_| &[],
    make: single,
};
