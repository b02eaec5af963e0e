//! The standard shadow map (Williams 1978).

use super::{Info, Technique};
use crate::frame::Frame;
use crate::gpu::{Gpu, Pass};
use crate::params::Params;
use crate::shadow_map::{Drawn, FitParams, HardwareParams, MapParams, ShadowMap};
use crate::view::{self, View};
use anyhow::Result;

pub static INFO: Info = Info {
    id: "shadow-map",
    title: "Shadow map",
    paper: "Williams 1978",
    family: "Basics",
    mark: 0,
    doc: "Depth seen from the light, compared once per pixel. Fast; its edges are stairs of the map's texels, and \
          without a bias surfaces shadow themselves (acne).",
    lights: &["directional", "spot"],
    filters: false,
    params: &[FitParams::GROUP, MapParams::GROUP, HardwareParams::GROUP],
    main: &[("resolution", "256..8192*2")],
    maps: &[MAPS],
    make: |gpu| {
        Ok(Box::new(StandardShadowMap {
            map: ShadowMap::new(gpu)?,
            comparison: Comparison::new(gpu, "techniques/shadow_map.wgsl")?,
        }))
    },
};

/// The views that every technique with one shadow map has; the first three in the order of `inspect_lookup` in WGSL.
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

/// The look-up by one depth comparison with the nearest texel, whatever fit or warp made the map.
pub struct Comparison {
    resolve: Pass,
    inspect: Pass,
}

impl Comparison {
    /// From a technique's own shader, which is or includes `techniques/shadow_map.wgsl`.
    pub fn new(gpu: &Gpu, file: &str) -> Result<Comparison> {
        let pass = |entry| Pass::compute(gpu, entry, file, entry, &[MapParams::GROUP]);
        Ok(Comparison { resolve: pass("resolve")?, inspect: pass("inspect")? })
    }

    /// Fills the frame's visibility from a map, and shows the texel grid and the bias where they are asked for.
    pub fn look_up(&self, f: &mut Frame, drawn: &Drawn) {
        f.run(&self.resolve).bind("shadow_map", &drawn.map).bind("light_view", &drawn.light_view).per_pixel();
        if f.wants_any_map() {
            f.run(&self.inspect).bind("light_view", &drawn.light_view).per_pixel();
        }
    }
}

struct StandardShadowMap {
    map: ShadowMap,
    comparison: Comparison,
}

impl Technique for StandardShadowMap {
    fn render(&mut self, f: &mut Frame) -> Result<()> {
        let drawn = self.map.render(f, 0.0)?;
        self.comparison.look_up(f, &drawn);
        Ok(())
    }
}
