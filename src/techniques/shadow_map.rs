//! The standard shadow map (Williams 1978).

use super::{Info, NEAREST, Technique};
use crate::frame::Frame;
use crate::gpu::Gpu;
use crate::map::filter::{Filter, LookUp};
use crate::map::peel::StoredParams;
use crate::map::single::{FitParams, ShadowMap};
use crate::map::{BiasParams, CasterParams, HardwareParams, MapParams};
use crate::params::{Group, Params};
use crate::view::{self, View};
use anyhow::Result;

/// One comparison with the nearest texel.
pub static FILTER: Filter =
    Filter { id: "nearest", file: "map/filter/nearest.wgsl", smooth: |_| false, ..Filter::PLAIN };

/// The parameters of a single fitted map, beside its filter's.
pub const GROUPS: &[Group] = &[
    FitParams::GROUP,
    MapParams::GROUP,
    CasterParams::GROUP,
    BiasParams::GROUP,
    StoredParams::GROUP,
    HardwareParams::GROUP,
];

pub static INFO: Info = Info {
    id: "shadow-map",
    title: "Shadow map",
    paper: "Williams 1978",
    family: "Basics",
    mark: 0,
    doc: "Depth seen from the light, compared once per pixel. Fast; its edges are stairs of the map's texels, and \
          without a bias surfaces shadow themselves (acne).",
    lights: &["directional", "spot", "rect-area"],
    filter: Some(&FILTER),
    smooth: |_| false,
    params: GROUPS,
    main: &[("resolution", "256..8192*2")],
    maps: &[MAPS],
    needs: |_| &[],
    make: single,
};

/// The views that every technique with one shadow map has.
pub const MAPS: &[View] = &[
    view::map(
        "shadow-map",
        "Shadow map",
        "The map itself: what the light sees, near bright, far dark.",
        view::Drawn::Depth,
    ),
    view::aliasing(
        "texels",
        "Texel grid",
        "Each shadow-map texel's footprint on the scene, as a chequerboard. Large squares: blocky shadows.",
        view::Drawn::Cells,
    ),
    view::map(
        "bias",
        "Bias",
        "How far the comparison is moved along the light's axis at each pixel, all biases together.",
        view::ramp("bias", "texels", [0.0, 4.0]),
    ),
    view::aliasing(
        "aliasing",
        "Aliasing error",
        "The longest extent of a shadow-map texel in the picture, pixels. Green: 1, as it should be. Ochre to dark \
              red: 2 to 16, too few texels, shadows have stairs. Blue to white: 1/2 to 1/16, more texels than pixels.",
        view::Drawn::Aliasing(0),
    ),
    view::aliasing(
        "perspective-aliasing",
        "Perspective aliasing",
        "The part of the aliasing error that comes from distances: the texel's width over the pixel's, both at \
              the surface and facing it. Near the camera pixels are small, so texels look large. Colours as for the \
              aliasing error.",
        view::Drawn::Aliasing(1),
    ),
    view::aliasing(
        "projection-aliasing",
        "Projection aliasing",
        "The part of the aliasing error that comes from the surface's slope: light that grazes it stretches \
              texels (ochre, red), a gaze that grazes it shortens them (blue). Colours as for the aliasing error.",
        view::Drawn::Aliasing(2),
    ),
    View {
        source: view::Source::Analysis,
        ..view::aliasing(
            "counts",
            "Samples per texel",
            "The map itself. White: texels that no pixel looks up. Green: one pixel each. Ochre to dark red: 4 to 256 \
              pixels share a texel. Blue: many texels for each pixel, which are too small to be seen \
              one by one.",
            view::Drawn::Counts,
        )
    },
];

/// A single map, looked up by the filter of its technique: what most filters are as techniques of their own.
struct Single {
    map: ShadowMap,
    look_up: LookUp,
    filter: &'static Filter,
}

/// Makes a technique that looks a single fitted map up.
///
/// # Errors
/// Passes that cannot be made.
pub fn single(gpu: &Gpu, info: &'static Info) -> Result<Box<dyn Technique>> {
    let look_up = LookUp::new(gpu, "map/single.wgsl", info.params);
    Ok(Box::new(Single { map: ShadowMap::new(gpu)?, look_up, filter: info.filter.unwrap_or(NEAREST) }))
}

impl Technique for Single {
    fn render(&mut self, f: &mut Frame) -> Result<()> {
        let maps = self.map.render(f, (self.filter.reach)(f))?;
        self.look_up.run(f, &maps, self.filter, &[])
    }
}
