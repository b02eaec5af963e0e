//! Soft shadows by texels thrown back on the light: areas (Guennebaud, Barthe, Paulin 2006) and bitmasks (Schwarz, Stamminger 2007).

use super::rt_soft::LIGHT_SAMPLES;
use super::shadow_map::GROUPS;
use super::{Info, MAPS, Technique};
use crate::frame::Frame;
use crate::gpu::{self, Gpu, Pass, Resource, Texture, hold};
use crate::light::Light;
use crate::map::Maps;
use crate::map::filter::{Filter, LookUp, Reach, shader, soft_reach};
use crate::map::single::ShadowMap;
use crate::params::Params;
use crate::view::{self, Area, Axis, Class, Drawn, Legend, Span};
use anyhow::Result;
use wgpu::{TextureFormat as Format, TextureUsages as Use};

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
    make: |gpu, _| Ok(Box::new(Backprojection::new(gpu)?)),
};

const FILE: &str = "techniques/backprojection.wgsl";

struct Backprojection {
    map: ShadowMap,
    look_up: LookUp,
    begin: Pass,
    build: Pass,
    pyramid: Option<(u32, Pyramid)>,
}

/// Nearest and farthest stored depths, from 2 × 2 texels up to all of them.
struct Pyramid {
    all: wgpu::TextureView,
    levels: Vec<wgpu::TextureView>,
    /// Whose views these are: on the account as long as they are held.
    texture: Texture,
}

impl Backprojection {
    fn new(gpu: &Gpu) -> Result<Backprojection> {
        let file = shader(FILE, &FILTER, None);
        let pass = |entry| Pass::compute(gpu, "depth pyramid", &file, entry, INFO.params);
        Ok(Backprojection {
            map: ShadowMap::new(gpu)?,
            look_up: LookUp::new(gpu, FILE, INFO.params),
            begin: pass("begin_pyramid")?,
            build: pass("build_pyramid")?,
            pyramid: None,
        })
    }

    /// Reduces the map's depths, level by level.
    fn reduce(&mut self, f: &mut Frame, maps: &Maps) -> Result<wgpu::TextureView> {
        let gpu = f.gpu;
        let passes = [&self.begin, &self.build];
        let pyramid = hold(&mut self.pyramid, maps.sides[0], |side| {
            passes.iter().for_each(|pass| pass.forget());
            // A power of two, so that each level halves the one before without a rest.
            let side = side.next_power_of_two() / 2;
            let count = side.ilog2() + 1;
            let usage = Use::STORAGE_BINDING | Use::TEXTURE_BINDING;
            let texture = gpu::texture(gpu, "depth pyramid", [side, side, 1], count, Format::Rg32Float, usage);
            let view = |base_mip_level, mip_level_count| {
                let count = Some(mip_level_count);
                texture.create_view(&wgpu::TextureViewDescriptor {
                    base_mip_level,
                    mip_level_count: count,
                    ..Default::default()
                })
            };
            Ok(Pyramid { all: view(0, count), levels: (0..count).map(|i| view(i, 1)).collect(), texture })
        })?;
        for (i, level) in pyramid.levels.iter().enumerate() {
            let groups = (pyramid.texture.width() >> i).div_ceil(8);
            let run = match i {
                0 => f.run(&self.begin).bind("shadow_map", &maps.layers.each[0]),
                _ => f.run(&self.build).bind("finer", &pyramid.levels[i - 1]),
            };
            run.bind("pyramid_out", level).dispatch(groups, groups, 1);
        }
        Ok(pyramid.all.clone())
    }
}

impl Technique for Backprojection {
    fn render(&mut self, f: &mut Frame) -> Result<()> {
        let maps = self.map.render(f, (FILTER.reach)(f))?;
        let pyramid = self.reduce(f, &maps)?;
        let bound: [(&'static str, Resource); 1] = [("pyramid", (&pyramid).into())];
        self.look_up.run(f, &maps, &FILTER, &bound)
    }
}
