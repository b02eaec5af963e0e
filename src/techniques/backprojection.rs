//! Soft shadows by texels thrown back on the light: areas (Guennebaud, Barthe, Paulin 2006) and bitmasks (Schwarz, Stamminger 2007).

use super::rt_soft::LIGHT_SAMPLES;
use super::shadow_map::GROUPS;
use super::{Info, MAPS, Technique};
use crate::frame::Frame;
use crate::gpu::{Gpu, Resource};
use crate::light::Light;
use crate::map::filter::{Filter, LookUp, Reach, soft_reach};
use crate::map::pyramid::Pyramid;
use crate::map::single::ShadowMap;
use crate::params::Params;
use crate::view::{self, Area, Axis, Class, Drawn, Legend, Span};
use anyhow::Result;

crate::params! {
    /// Texels thrown back on the light.
    pub struct BackprojectionParams {
        "Backprojection" {
            /// How what the texels hide is added up. Area: their rectangles' areas, so that what several hide counts several times. Bitmask64, bitmask256: 8 × 8 or 16 × 16 samples of the light, each of which is hidden once.
            mode: choice("bitmask64", ["area", "bitmask64", "bitmask256"]),
            /// Texels to a side that a pixel reads at most. Where more lie between it and the light, every second, third, … stands for those around it.
            window_max: int(48, 8..=128, "texels"),
            /// Reads only every so manieth texel along each side, which stands for those around it.
            stride: int(1, 1..=4, "texels"),
            /// Closes gaps between the rectangles of texels side by side that lie at different depths. Off: light leaks through surfaces that slope. On: it no longer passes between two casters of which one hides the edge of the other.
            gap_fill: flag(true),
            /// How often the window is narrowed to what casters as near as the nearest in it can hide. 0: it is as wide as if the map's nearest caster lay before each pixel, and too many texels are read, or skipped.
            shrink: int(3, 0..=3, "times"),
            /// A pixel all of whose window's texels lie before it is dark, whatever gaps there are between them.
            early_umbra: flag(true),
        }
    }
}

static FILTER: Filter = Filter {
    id: "backprojection",
    file: "map/filter/backprojection.wgsl",
    // How far texels lie that can hide some of the light is known only when the map is drawn: half the light's sides for casters half-way
    // up to it.
    reach: |f| match f.light {
        Light::RectArea { half_u, half_v, .. } => {
            Reach { metres: half_u.length().max(half_v.length()), ..soft_reach(f, f32::INFINITY) }
        }
        _ => Reach::default(),
    },
    smooth: |_| false,
    cost: 512,
    ..Filter::PLAIN
};

pub static INFO: Info = Info {
    id: "backprojection",
    title: "Backprojected soft shadow map",
    paper: "Guennebaud, Barthe, Paulin 2006; Schwarz, Stamminger 2007",
    family: "Soft shadows",
    mark: 41,
    doc: "Each texel of the map that lies before a pixel is a little rectangle in space, and hides a rectangle of the light: the shadow of \
          many casters at many depths from one map. As bits of the light's samples, what several hide counts once. What the light's \
          centre does not see casts nothing, so that light leaks beside the casters' flanks.",
    lights: &["rect-area"],
    filter: Some(&FILTER),
    smooth: |_| false,
    params: crate::groups!(&[BackprojectionParams::GROUP], GROUPS),
    main: &[("resolution", "128..2048*2"), ("mode", "area,bitmask64,bitmask256"), ("stride", "1,2,4")],
    maps: &[
        MAPS,
        &[
            view::map(
                "window-size",
                "Window size",
                "How many texels lie between the pixel and the light, along the longer side. Where none can hide the light, or all do, the \
                 scene shows.",
                view::ramp("window", "texels", [0.0, 128.0]),
            ),
            view::map(
                "overlap",
                "Overlap",
                "The share of the light that rectangles hide beyond the first that does: how much darker a pixel is where their areas \
                 are added up.",
                view::ramp("hidden more than once", "", [0.0, 1.0]),
            ),
            LIGHT_SAMPLES,
            view::map(
                "texel-rectangles",
                "Texels on the light",
                "The light as the probed pixel sees it, and the rectangles of it that the map's texels hide. Click into the picture of \
                 another view to choose the pixel.",
                Drawn::Labels(Legend::Chart(
                    Area::Square,
                    Axis { what: "along the light's width", span: Span::Linear(-1.0, 1.0) },
                    Axis { what: "along its height", span: Span::Linear(-1.0, 1.0) },
                    &[
                        Class::label(1, "seen"),
                        Class::label(4, "hidden by one texel"),
                        Class::label(2, "hidden by several"),
                    ],
                )),
            ),
        ],
    ],
    needs: |_| &[],
    make: |gpu, _| Ok(Box::new(Backprojection::new(gpu)?)),
};

const FILE: &str = "techniques/backprojection.wgsl";

struct Backprojection {
    map: ShadowMap,
    look_up: LookUp,
    pyramid: Pyramid,
}

impl Backprojection {
    fn new(gpu: &Gpu) -> Result<Backprojection> {
        Ok(Backprojection {
            map: ShadowMap::new(gpu)?,
            look_up: LookUp::new(gpu, FILE, INFO.params),
            pyramid: Pyramid::new(gpu)?,
        })
    }
}

impl Technique for Backprojection {
    fn render(&mut self, f: &mut Frame) -> Result<()> {
        let maps = self.map.render(f, (FILTER.reach)(f))?;
        let pyramid = self.pyramid.make(f, &maps.layers.each[0], maps.sides[0])?;
        let bound: [(&'static str, Resource); 1] = [("pyramid", (&pyramid).into())];
        self.look_up.run(f, &maps, &FILTER, &bound)
    }
}
