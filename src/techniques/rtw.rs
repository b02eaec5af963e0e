//! Rectilinear texture warping (Rosen 2012).

use super::cube::CubeParams;
use super::dual_paraboloid::SideParams;
use super::{Info, MAPS, NEAREST, Technique, notw};
use crate::frame::Frame;
use crate::gpu::{Buffer, Gpu, Need, Pass, Resource, hold};
use crate::map::Layers;
use crate::map::busy::Dispatches;
use crate::map::cascades::ANALYSED;
use crate::map::casters::{Casters, DRAW, Target, Triangles};
use crate::map::faces::{self, pulled};
use crate::map::filter::alone;
use crate::map::paraboloid::{Paraboloid, Side};
use crate::map::peel::Depths;
use crate::map::warp::around::{NearParams, PLAIN_RASTER, Plain, Views};
use crate::map::warp::{self, RasterParams, Warped, storage};
use crate::map::{BiasParams, CasterParams, MapParams};
use crate::params::Params;
use crate::view::{self, BEFORE_AFTER, Class, Drawn, Legend, View};
use anyhow::{Result, ensure};

crate::params! {
    /// From where importance is found.
    pub struct AnalysisParams {
        "Importance" {
            /// Where importance is found. Backward: at the pixels that the camera sees. Forward: at the texels of a plain map seen from the light, hidden ones too. Hybrid: the camera's terms at pixels, shadow edges in the light's map.
            analysis: choice("backward", ["backward", "forward", "hybrid"]),
        }
    }
}

crate::params! {
    /// What makes a part of the map important, and how the warp follows it.
    pub struct RtwParams {
        "Importance" {
            /// Desired view: 1 where the camera looks, 0 elsewhere. Backward analysis finds nothing else in any case.
            desired_view: flag(true),
            /// Distance to the eye: more importance near the camera.
            distance_to_eye: flag(true),
            /// Shadow edge: more importance where depth jumps in the light's map or, in backward analysis, at edges in the camera's picture.
            shadow_edge: flag(false),
            /// Surface normal: more importance where surfaces face the camera.
            surface_normal: flag(false),
            /// How the terms that are on make up one importance.
            combine: choice("product", ["product", "max", "sum"]),
            /// How importance falls with distance. Power: 1 - (d / d_max)^power, up to the farthest that can be in view. Inverse: near plane / d.
            falloff: choice("power", ["power", "inverse"]) if distance_to_eye = true,
            /// Exponent of the distance term: with 1 importance falls evenly, with 5 only far away.
            power: float(1.0, 1.0..=5.0, "") if falloff = "power",
            /// How much more an edge counts than a place without one.
            edge_weight: float(2.0, 0.0..=8.0, "×") if shadow_edge = true,
            /// The step in depth that makes an edge, as a share of the camera's depth, of the distance from a spot light, or of the whole depth range under the sun.
            edge_threshold: float(0.01, 0.001..=0.2, "× depth") if shadow_edge = true,
            /// How much more a surface counts that squarely faces the camera.
            normal_weight: float(1.0, 0.0..=4.0, "×") if surface_normal = true,
        }
        "Warp" {
            /// Bins along each side of the importance map; never more than the shadow map has texels.
            importance_bins: int(512, 64..=8192, "bins"),
            /// Standard deviation of the Gaussian that blurs both profiles. Small: the warp turns abruptly. Large: importance spreads to where there is none.
            profile_blur: float(4.0, 0.0..=32.0, "bins"),
            /// The importance that every row and column has at least, as a share of the largest; it keeps the warp increasing.
            floor: float(0.02, 0.0..=0.5, "× max"),
        }
    }
}

pub static INFO: Info = Info {
    id: "rtw",
    title: "Rectilinear texture warping",
    paper: "Rosen 2012",
    family: "Warping",
    mark: 8,
    doc: "Makes each row and each column of one map as wide as the most important thing in it asks. Two things on a \
          diagonal waste texels on the diagonal's other two corners.",
    lights: &["directional", "spot"],
    filter: Some(NEAREST),
    smooth: |_| false,
    params: &[
        AnalysisParams::GROUP,
        RtwParams::GROUP,
        RasterParams::GROUP,
        MapParams::GROUP,
        CasterParams::GROUP,
        BiasParams::GROUP,
    ],
    main: &[("resolution", "256..4096*2"), ("floor", "0.005,0.02,0.1"), ("profile_blur", "0,4,16")],
    maps: &[MAPS, &warp::MAPS, &OWN],
    needs: |_| &[Need::StorageBuffers(6)],
    make: |gpu, info| Ok(Box::new(Rtw::new(gpu, info, "techniques/rtw.wgsl", None)?)),
};

pub static CUBE: Info = Info {
    id: "rtw-cube",
    title: "Cube with rectilinear warps",
    paper: "Rosen 2012",
    family: "All directions",
    mark: 27,
    doc: "A cube's six maps, each with rows and columns as wide as the most important thing in them asks. Faces that no pixel looks \
          up cost nothing.",
    lights: faces::LIGHTS,
    filter: Some(NEAREST),
    smooth: |_| false,
    params: &[
        AnalysisParams::GROUP,
        RtwParams::GROUP,
        RasterParams::GROUP,
        CubeParams::GROUP,
        NearParams::GROUP,
        CasterParams::GROUP,
        BiasParams::GROUP,
    ],
    main: &[("resolution", "128..2048*2"), ("floor", "0.005,0.02,0.1"), ("profile_blur", "0,4,16")],
    maps: &[&faces::MAPS, ANALYSED, &warp::MAPS, &OWN],
    needs: |_| &[Need::StorageBuffers(6)],
    make: |gpu, info| Ok(Box::new(Rtw::new(gpu, info, AROUND, Some(notw::cube()))?)),
};

pub static PARABOLOID: Info = Info {
    id: "rtw-paraboloid",
    title: "Paraboloid with rectilinear warps",
    paper: "Rosen 2012",
    family: "All directions",
    mark: 28,
    doc: "A dual paraboloid's two maps, each with rows and columns as wide as the most important thing in them asks. What the pixels \
          need lies slantwise across a side more often than not, and then both corners beside it get texels too.",
    lights: faces::LIGHTS,
    filter: Some(NEAREST),
    smooth: |_| false,
    params: &[
        AnalysisParams::GROUP,
        RtwParams::GROUP,
        RasterParams::GROUP,
        SideParams::GROUP,
        NearParams::GROUP,
        CasterParams::GROUP,
        BiasParams::GROUP,
    ],
    main: &[("resolution", "128..4096*2"), ("floor", "0.005,0.02,0.1"), ("profile_blur", "0,4,16")],
    maps: &[&faces::MAPS, ANALYSED, &warp::MAPS, &OWN],
    needs: |_| &[Need::StorageBuffers(6)],
    make: |gpu, info| Ok(Box::new(Rtw::new(gpu, info, AROUND, Some(notw::sides()))?)),
};

/// The shader of warps around a light.
const AROUND: &str = "techniques/rtw_around.wgsl";

const OWN: [View; 3] = [
    view::map(
        "importance",
        "Importance map",
        "Left: in the light's image before the warp. Right: in the map. The brighter the yellow, the more \
                      important; blue: not at all.",
        Drawn::Labels(Legend::Squares(BEFORE_AFTER, &[Class::label(1, "important"), Class::label(4, "not at all")])),
    ),
    view::map(
        "profiles",
        "Importance profiles",
        "Left: of the columns. Right: of the rows. The largest importance in each (grey), blurred \
                      (orange), and the warp that its sums make (blue), which is steep where there are many texels. \
                      Thin line: no warp.",
        Drawn::Labels(Legend::Curves(
            ["columns", "rows"],
            ["place across the light's image", "importance, warped place"],
            &[Class::new([0.55; 3], "largest importance"), Class::label(6, "blurred"), Class::label(3, "warp")],
        )),
    ),
    view::map(
        "over-dense",
        "Over-dense cells",
        "Blue: bins without importance that have more texels than they would without the warp, stronger \
                      the more they have; grey: others without importance; yellow: important. Left: before the warp. \
                      Right: in the map.",
        Drawn::Labels(Legend::Squares(
            BEFORE_AFTER,
            &[
                Class::label(1, "important"),
                Class::label(4, "not important, texels to spare"),
                Class::label(7, "not important"),
            ],
        )),
    ),
];

struct Rtw {
    warped: Warped,
    /// For a number of bins and of layers.
    tables: Option<([u32; 2], Tables)>,
    samples: Pass,
    forward: Forward,
    collapse: Pass,
    blur: Pass,
    sum: Pass,
    dispatches: Dispatches,
}

/// What finds importance in the light's own map.
struct Forward {
    light_depth: Option<Layers>,
    casters: Casters,
    paraboloid: Paraboloid,
    texels: Pass,
}

/// The importance map of each layer and what becomes of it.
struct Tables {
    importance: Buffer,
    profiles: Buffer,
    blurred: Buffer,
    warps: Buffer,
}

impl Rtw {
    fn new(gpu: &Gpu, info: &'static Info, file: &'static str, views: Option<Views>) -> Result<Rtw> {
        let pass = |name, entry| Pass::compute(gpu, name, &alone(file), entry, info.params);
        Ok(Rtw {
            warped: Warped::around(gpu, file, info.params, views)?,
            tables: None,
            samples: pass("importance of view samples", "importance_of_samples")?,
            forward: Forward {
                light_depth: None,
                casters: Casters::named(["light's depth", "light's depth (masked)"]),
                paraboloid: Paraboloid::named("light's depth"),
                texels: pass("importance of texels", "importance_of_texels")?,
            },
            collapse: pass("collapse", "collapse")?,
            blur: pass("blur", "blur")?,
            sum: pass("prefix sums", "sum_up")?,
            dispatches: Dispatches::default(),
        })
    }
}

impl Forward {
    /// Draws a layer's casters as its view has them before the warp, a texel a bin; `plain`: of layers around a light.
    fn draw(
        &mut self,
        f: &mut Frame,
        bins: u32,
        (layer, view): (usize, &Buffer),
        plain: Option<&Plain>,
    ) -> Result<wgpu::TextureView> {
        let layers = Layers::hold(&mut self.light_depth, f.gpu, &[bins], wgpu::TextureFormat::Depth32Float)?;
        let (depth, indices) = (layers.each[0].clone(), &f.scene.indices);
        match plain {
            Some(Plain { draws, curved: true }) => {
                let side =
                    Side { raster: PLAIN_RASTER, light_view: view, indices, draws, at: pulled(layer), number: None };
                self.paraboloid.draw(f, (&Depths { nearest: layers, peeled: None }, 0), side)?;
            }
            _ => {
                let triangles = match plain {
                    Some(Plain { draws, .. }) => Triangles::Listed { indices, draws, at: 2 * layer as u64 * DRAW },
                    None => Triangles::All,
                };
                // A view whose depth is linear, as the base of every warp.
                self.casters.draw(f, &depth, Target::whole(bins, view, true), &triangles)?;
            }
        }
        Ok(depth)
    }
}

impl Tables {
    fn new(gpu: &Gpu, [bins, layers]: [u32; 2]) -> Tables {
        let (side, layers) = (bins as u64, layers as u64);
        Tables {
            importance: storage(gpu, "importance map", layers * side * side * 4),
            profiles: storage(gpu, "profiles", layers * (2 * side + 1) * 4),
            blurred: storage(gpu, "blurred profiles", layers * 2 * side * 4),
            warps: storage(gpu, "warps", layers * 2 * (side + 1) * 4),
        }
    }
}

impl Technique for Rtw {
    fn render(&mut self, f: &mut Frame) -> Result<()> {
        let analysis = AnalysisParams::read(f.values).analysis;
        // The whole scene: what the camera wants weighs, but cuts nothing off.
        let base = self.warped.base(f, None, false, false)?;
        // As `bins` in the shader.
        let bins = RtwParams::read(f.values).importance_bins.min(base.side);
        let layers = base.each.len() as u32;
        ensure!(
            bins as u64 * bins as u64 * layers as u64 * 4 <= f.gpu.most_bound()
                && bins <= f.gpu.device.limits().max_texture_dimension_2d,
            "{} binds too little memory at once for {bins}² bins in {layers} {}; choose fewer importance_bins",
            f.gpu.info.name,
            if layers == 1 { "map" } else { "maps" }
        );
        let tables = hold(&mut self.tables, [bins, layers], |n| Ok(Tables::new(f.gpu, *n)))?;
        let bound: [(&'static str, Resource); 4] = [
            ("warps", (&tables.warps).into()),
            ("raw", (&tables.profiles).into()),
            ("smooth_profiles", (&tables.blurred).into()),
            ("importance_map", (&tables.importance).into()),
        ];
        if analysis == "backward" {
            self.forward.light_depth = None;
        }
        if base.changed {
            f.clear(&tables.importance);
            f.clear(&tables.profiles);
            let (pixels, texels) = (f.pixel_groups(), [bins.div_ceil(8); 2]);
            let (collapsed, blurred, axes) = ([bins.div_ceil(64); 2], [bins.div_ceil(64), 2], [2, 1]);
            self.dispatches.plan(f, &base.faces, &[pixels, texels, collapsed, blurred, axes])?;
            let dispatches = &self.dispatches;
            for (i, view) in base.each.iter().enumerate() {
                let own = base.layer(i, &bound);
                if analysis != "forward" {
                    let run = f.run(&self.samples).bind_all(&own).bind("importance", &tables.importance);
                    dispatches.run(run, i, pixels);
                }
                if analysis != "backward" {
                    let depth = self.forward.draw(f, bins, (i, view), base.plain.as_ref())?;
                    let run = f.run(&self.forward.texels).bind_all(&own).bind("importance", &tables.importance);
                    dispatches.run(run.bind("light_depth", &depth), i, texels);
                }
                let run = f.run(&self.collapse).bind_all(&own).bind("importance", &tables.importance);
                dispatches.run(run.bind("profiles", &tables.profiles), i, collapsed);
                dispatches.run(f.run(&self.blur).bind_all(&own).bind("blurred", &tables.blurred), i, blurred);
                dispatches.run(f.run(&self.sum).bind_all(&own).bind("edges", &tables.warps), i, axes);
            }
        }
        self.warped.draw(f, &base, &bound)
    }
}
