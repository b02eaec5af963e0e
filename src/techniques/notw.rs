//! Non-orthogonal texture warping (Milet, Navratil, Zemcik 2015).

use super::cube::CubeParams;
use super::dual_paraboloid::{self, SideParams};
use super::{Info, MAPS, NEAREST, Technique};
use crate::frame::Frame;
use crate::gpu::{Buffer, Gpu, Need, Pass, Resource, hold};
use crate::light::LightView;
use crate::map::busy::Dispatches;
use crate::map::cascades::ANALYSED;
use crate::map::faces;
use crate::map::filter::{Reach, alone};
use crate::map::fit::faces::{Around, Face};
use crate::map::fit::{Kept, msf, part};
use crate::map::single::scope;
use crate::map::warp::around::{NearParams, Views};
use crate::map::warp::{self, RasterParams, Warped, storage};
use crate::map::{BiasParams, CasterParams, MapParams};
use crate::params::Params;
use crate::view::{self, Area, Class, Drawn, Legend, Span, View};
use anyhow::{Result, ensure};

crate::params! {
    /// Where the map lies before the warp.
    pub struct CropParams {
        "Warp" {
            /// What the map covers before the warp. None: the whole scene. Dv (desired view): the view samples that face the light. Msf: the smallest frustum around the part of the scene's convex hull that the camera can see.
            crop: choice("dv", ["none", "dv", "msf"]),
        }
    }
}

crate::params! {
    /// The same of maps around a light.
    pub struct FaceCropParams {
        "Warp" {
            /// What each map covers before the warp. None: its whole face or side. Dv (desired view): the view samples in it that face the light. Msf: where in it the camera can see something of the scene's convex hull.
            crop: choice("dv", ["none", "dv", "msf"]),
        }
    }
}

crate::params! {
    /// How the warp follows the view samples.
    pub struct NotwParams {
        "Warp" {
            /// How strong the warp is. 0: the map is cropped but not warped. 1: the whole warp.
            strength: float(1.0, 0.0..=1.0, "none" => "full"),
            /// View samples that every texel has on top of its own, as a share of the mean. They keep the warp strictly increasing, and rows with few samples calm.
            floor: float(0.01, 0.0..=0.2, "× mean") if strength > 0.0,
        }
        "Smoothing" {
            /// Half the width of the smoothing window: how many rows (then columns) on each side share their warps. Small: large polygons break. Large: the warp follows the samples less.
            window: float(0.03125, 0.0..=0.125, "× map") if strength > 0.0,
            /// The shape of the window.
            kernel: choice("box", ["box", "tent"]) if window > 0.0,
            /// How much a row counts in the window. Count: as many times as it has view samples. Plain: once if it has any.
            weighting: choice("count", ["count", "plain"]) if window > 0.0,
            /// Half the width of the window that smooths each row's warp along the row.
            window_along: float(0.0, 0.0..=0.125, "× map") if strength > 0.0,
        }
    }
}

pub static INFO: Info = Info {
    id: "notw",
    title: "Non-orthogonal texture warping",
    paper: "Milet, Navratil, Zemcik 2015",
    family: "Warping",
    mark: 9,
    doc: "Counts how many pixels look into each texel and stretches every row, then every column of the map until all \
          texels are equally busy. Where the warp turns fast between a triangle's corners, its shadow goes astray.",
    lights: &["directional", "spot"],
    filter: Some(NEAREST),
    smooth: |_| false,
    params: &[
        CropParams::GROUP,
        NotwParams::GROUP,
        RasterParams::GROUP,
        MapParams::GROUP,
        CasterParams::GROUP,
        BiasParams::GROUP,
    ],
    main: &[("resolution", "256..4096*2"), ("window", "0.01,0.03125,0.125"), ("crop", "none,dv")],
    maps: &[MAPS, &warp::MAPS, &OWN],
    needs: |_| &[Need::StorageBuffers(5)],
    make: |gpu, info| Ok(Box::new(Notw::new(gpu, info, "techniques/notw.wgsl", None)?)),
};

pub static CUBE: Info = Info {
    id: "notw-cube",
    title: "Cube with non-orthogonal warps",
    paper: "Milet, Navratil, Zemcik 2015; Navratil 2015",
    family: "All directions",
    mark: 25,
    doc: "A cube's six maps, each cropped to the pixels that look it up and then warped until its texels are equally busy. Faces \
          that no pixel looks up cost nothing; but one face holds most of the pixels, and the others' texels cannot help it.",
    lights: faces::LIGHTS,
    filter: Some(NEAREST),
    smooth: |_| false,
    params: &[
        FaceCropParams::GROUP,
        NotwParams::GROUP,
        RasterParams::GROUP,
        CubeParams::GROUP,
        NearParams::GROUP,
        CasterParams::GROUP,
        BiasParams::GROUP,
    ],
    main: &[("resolution", "128..2048*2"), ("window", "0.01,0.03125,0.125"), ("crop", "none,dv")],
    maps: &[&faces::MAPS, ANALYSED, &warp::MAPS, &OWN],
    needs: |_| &[Need::StorageBuffers(5)],
    make: |gpu, info| Ok(Box::new(Notw::new(gpu, info, AROUND, Some(cropped_cube()))?)),
};

pub static PARABOLOID: Info = Info {
    id: "notw-paraboloid",
    title: "Paraboloid with non-orthogonal warps",
    paper: "Milet, Navratil, Zemcik 2015; Navratil 2015",
    family: "All directions",
    mark: 26,
    doc: "A dual paraboloid's two maps, each cropped to the pixels that look it up and then warped until its texels are equally \
          busy. A side holds more of the scene than a cube's face, and so has more idle texels to give away.",
    lights: faces::LIGHTS,
    filter: Some(NEAREST),
    smooth: |_| false,
    params: &[
        FaceCropParams::GROUP,
        NotwParams::GROUP,
        RasterParams::GROUP,
        SideParams::GROUP,
        NearParams::GROUP,
        CasterParams::GROUP,
        BiasParams::GROUP,
    ],
    main: &[("resolution", "128..4096*2"), ("window", "0.01,0.03125,0.125"), ("crop", "none,dv")],
    maps: &[&faces::MAPS, ANALYSED, &warp::MAPS, &OWN],
    needs: |_| &[Need::StorageBuffers(5)],
    make: |gpu, info| Ok(Box::new(Notw::new(gpu, info, AROUND, Some(cropped_sides()))?)),
};

/// The shader of warps around a light.
const AROUND: &str = "techniques/notw_around.wgsl";

/// A cube's faces and a paraboloid's sides as warps take them.
pub fn cube() -> Views {
    Views { side: |f| CubeParams::read(f.values).resolution, faces: |around, _| around.cube() }
}

pub fn sides() -> Views {
    Views { side: |f| SideParams::read(f.values).resolution, faces: dual_paraboloid::sides }
}

/// The same, narrowed to what the camera can see if `crop` asks for that.
fn cropped_cube() -> Views {
    Views { faces: |around, f| cropped(around, f, around.cube()), ..cube() }
}

fn cropped_sides() -> Views {
    Views { faces: |around, f| cropped(around, f, dual_paraboloid::sides(around, f)), ..sides() }
}

fn cropped(around: &Around, f: &Frame, faces: Vec<Face>) -> Vec<Face> {
    match FaceCropParams::read(f.values).crop.as_str() {
        "msf" => part::narrowed(&scope(f, Reach::default()), around, f.geometry.hull(), faces),
        _ => faces,
    }
}

/// The views that need what each layer's warp is made of.
const KEPT: [&str; 4] = ["counts-between", "row-offsets", "column-offsets", "occupancy"];

const OWN: [View; 4] = [
    view::map(
        "counts-between",
        "Samples between the warps",
        "The map after the rows' warp, before the columns': what each column still has to even out. Colours as in \
                  the other counts.",
        Drawn::Counts,
    ),
    view::map(
        "row-offsets",
        "Row offsets",
        "How far each row's warp moves its texels: yellow to the right, blue to the left, strongest from \
                      a quarter of the map on. Left: before smoothing. Right: after it.",
        Drawn::Labels(Legend::Squares(
            ["before smoothing", "after it"],
            &[Class::label(1, "to the right"), Class::label(4, "to the left")],
        )),
    ),
    view::map(
        "column-offsets",
        "Column offsets",
        "How far each column's warp moves its texels: yellow down, blue up, strongest from a quarter of \
                      the map on. Left: before smoothing. Right: after it.",
        Drawn::Labels(Legend::Squares(
            ["before smoothing", "after it"],
            &[Class::label(1, "down"), Class::label(4, "up")],
        )),
    ),
    view::map(
        "occupancy",
        "Occupancy histogram",
        "How many texels have how many view samples: none at the left, then 1 and on in half octaves; heights are \
                  square roots of shares. Grey: before the warps; blue: after the rows'; yellow: after both.",
        Drawn::Labels(Legend::Chart(
            Area::Margins,
            view::Axis { what: "samples per texel", span: Span::HalfOctaves(20) },
            view::Axis { what: "share of the texels", span: Span::Root },
            &[Class::label(7, "before the warps"), Class::label(3, "after the rows'"), Class::label(1, "after both")],
        )),
    ),
];

struct Notw {
    warped: Warped,
    least: Kept<Option<LightView>>,
    around: bool,
    /// For a resolution and a number of layers, of which so many keep what their warps are made of.
    lines: Option<((u32, u64, u64), Lines)>,
    passes: Passes,
    count_after: Pass,
    occupy: Pass,
    /// A histogram, and those before, between and after the warps one after the other.
    occupancy: [Buffer; 2],
}

/// What makes the warps of a layer.
struct Passes {
    count: Pass,
    count_moved: Pass,
    sum: Pass,
    smooth: [Pass; 3],
    smooth_along: Pass,
    dispatches: Dispatches,
}

/// Bytes of a histogram.
const HISTOGRAM: u64 = 80;

/// The warps of rows and columns, and what they are made from.
struct Lines {
    axes: [Axis; 2],
    /// Between the steps of smoothing; nothing of it is needed later.
    halfway: Buffer,
    halfway_weights: Buffer,
    /// Bound where the last step leaves no weights.
    no_weights: Buffer,
}

/// Rows or columns.
struct Axis {
    counts: Buffer,
    sums: Buffer,
    weights: Buffer,
    total: Buffer,
    warp: Buffer,
}

impl Notw {
    fn new(gpu: &Gpu, info: &'static Info, file: &'static str, views: Option<Views>) -> Result<Notw> {
        let pass = |name, entry| Pass::compute(gpu, name, &alone(file), entry, info.params);
        Ok(Notw {
            warped: Warped::around(gpu, file, info.params, views)?,
            around: views.is_some(),
            least: Kept::default(),
            lines: None,
            passes: Passes {
                count: pass("view samples", "count_before")?,
                count_moved: pass("view samples", "count_moved")?,
                sum: pass("prefix sums", "sum")?,
                smooth: [
                    pass("smoothing", "smooth_box")?,
                    pass("smoothing", "smooth_tent_first")?,
                    pass("smoothing", "smooth_tent_second")?,
                ],
                smooth_along: pass("smoothing", "smooth_along")?,
                dispatches: Dispatches::default(),
            },
            count_after: pass("view samples", "count_after")?,
            occupy: pass("occupancy", "occupy")?,
            occupancy: {
                let usage = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
                [storage(gpu, "occupancy", HISTOGRAM), gpu.room("occupancies", 3 * HISTOGRAM, usage)]
            },
        })
    }
}

impl Lines {
    fn new(gpu: &Gpu, resolution: u32, layers: u64, kept: u64) -> Lines {
        let side = resolution as u64;
        let texels = |label, layers| storage(gpu, label, layers * side * side * 4);
        let edges = |label, layers| storage(gpu, label, layers * side * (side + 1) * 4);
        let axis = || Axis {
            counts: texels("view samples", kept),
            sums: edges("prefix sums", kept),
            weights: storage(gpu, "samples per line", side * 4),
            total: storage(gpu, "samples", 16),
            warp: edges("lines' warps", layers),
        };
        Lines {
            axes: [axis(), axis()],
            halfway: edges("lines' warps on the way", 1),
            halfway_weights: storage(gpu, "weights on the way", side * 4),
            no_weights: storage(gpu, "no weights", 16),
        }
    }
}

impl Technique for Notw {
    fn render(&mut self, f: &mut Frame) -> Result<()> {
        let crop = CropParams::read(f.values).crop;
        let keeps = self.around && KEPT.contains(&f.view);
        let view = match crop.as_str() {
            "msf" => {
                if f.wants_outlines() {
                    f.outline_body(scope(f, Reach::default()).seen_of(f.geometry.hull().clone()));
                }
                // Faces around a light are narrowed each: see `cropped`.
                match self.around {
                    true => None,
                    false => *self.least.get(f, scope(f, Reach::default()), |s| msf::view(s, f.geometry.hull(), 0.0)),
                }
            }
            _ => None,
        };
        let base = self.warped.base(f, view, crop == "dv", keeps)?;
        let (resolution, layers) = (base.side, base.each.len() as u64);
        let edges = resolution as u64 * (resolution as u64 + 1) * 4 * layers;
        ensure!(
            edges <= f.gpu.most_bound(),
            "{} binds too little memory at once for the warps of {}; choose a smaller resolution",
            f.gpu.info.name,
            match layers {
                1 => format!("a {resolution}² map"),
                _ => format!("{layers} maps of {resolution}² texels"),
            }
        );
        let kept = if keeps { layers } else { 1 };
        let lines = hold(&mut self.lines, (resolution, layers, kept), |(side, layers, kept)| {
            Ok(Lines::new(f.gpu, *side, *layers, *kept))
        })?;
        let [x, y] = &lines.axes;
        let bound: [(&'static str, Resource); 6] = [
            ("occupancies", (&self.occupancy[1]).into()),
            ("rows", (&x.warp).into()),
            ("columns", (&y.warp).into()),
            ("row_sums", (&x.sums).into()),
            ("column_sums", (&y.sums).into()),
            ("moved_counts", (&y.counts).into()),
        ];
        let each: Vec<Vec<_>> = (0..base.each.len()).map(|i| base.layer(i, &bound)).collect();
        if base.changed {
            for axis in &lines.axes {
                f.clear(&axis.counts);
            }
            let sizes = Passes::sizes(f, resolution);
            self.passes.dispatches.plan(f, &base.faces, &sizes)?;
            for (i, own) in each.iter().enumerate() {
                // What the layer before left.
                if i > 0 && kept == 1 {
                    lines.axes.iter().for_each(|axis| f.clear(&axis.counts));
                }
                self.passes.make(f, lines, resolution, (i, own));
            }
        }
        if f.view == "occupancy" {
            for (i, counts) in [&x.counts, &y.counts, &lines.halfway].into_iter().enumerate() {
                let [one, all] = &self.occupancy;
                f.clear(one);
                for own in &each {
                    if i == 2 {
                        f.clear(counts);
                        f.run(&self.count_after).bind_all(own).bind("moved", counts).per_pixel();
                    }
                    f.run(&self.occupy).bind_all(own).bind("samples", counts).bind("occupancy", one).dispatch(
                        resolution.div_ceil(64),
                        resolution,
                        1,
                    );
                }
                f.copy_to(one, all, i as u64 * HISTOGRAM, HISTOGRAM);
            }
        }
        self.warped.draw(f, &base, &bound)
    }
}

impl Passes {
    /// Workgroups of passes with a thread a pixel, of those with one for each line, and of those with one for each edge that take
    /// lines one by one or in runs.
    fn sizes(f: &Frame, resolution: u32) -> [[u32; 2]; 4] {
        let edges = (resolution + 1).div_ceil(64);
        [f.pixel_groups(), [resolution, 1], [edges, resolution], [edges, resolution.div_ceil(16)]]
    }

    /// Makes a layer's warps of its view samples. `bound`: what its passes need.
    fn make(
        &self,
        f: &mut Frame,
        lines: &Lines,
        resolution: u32,
        (layer, bound): (usize, &[(&'static str, Resource)]),
    ) {
        let p = NotwParams::read(f.values);
        let [pixels, each_line, each_edge, edges_of_runs] = Passes::sizes(f, resolution);
        let dispatches = &self.dispatches;
        for (i, axis) in lines.axes.iter().enumerate() {
            f.clear(&axis.total);
            let (count, counts) = [(&self.count, "before"), (&self.count_moved, "moved")][i];
            dispatches.run(f.run(count).bind_all(bound).bind(counts, &axis.counts), layer, pixels);
            let sum = f
                .run(&self.sum)
                .bind_all(bound)
                .bind("samples", &axis.counts)
                .bind("sums", &axis.sums)
                .bind("weights", &axis.weights)
                .bind("total", &axis.total);
            dispatches.run(sum, layer, each_line);
            let along = (p.window_along * resolution as f32).round() > 0.0;
            let weights = |last: bool| if last { &lines.no_weights } else { &lines.halfway_weights };
            let mut smooth = |pass: &Pass, from: [&Buffer; 2], to: &Buffer, size: [u32; 2]| {
                let run = f
                    .run(pass)
                    .bind_all(bound)
                    .bind("line_sums", from[0])
                    .bind("line_weights", from[1])
                    .bind("samples_total", &axis.total)
                    .bind("smoothed", to)
                    .bind("smoothed_weights", weights(std::ptr::eq(from[1], &lines.halfway_weights)));
                dispatches.run(run, layer, size);
            };
            let own = [&axis.sums, &axis.weights];
            let halfway = [&lines.halfway, &lines.halfway_weights];
            match (p.kernel.as_str(), along) {
                ("tent", false) => {
                    smooth(&self.smooth[1], own, &lines.halfway, edges_of_runs);
                    smooth(&self.smooth[2], halfway, &axis.warp, edges_of_runs);
                }
                ("tent", true) => {
                    // By way of the warp's own buffer, which is written again at the end.
                    smooth(&self.smooth[1], own, &axis.warp, edges_of_runs);
                    smooth(&self.smooth[2], [&axis.warp, &lines.halfway_weights], &lines.halfway, edges_of_runs);
                    smooth(&self.smooth_along, halfway, &axis.warp, each_edge);
                }
                (_, true) => {
                    smooth(&self.smooth[0], own, &lines.halfway, edges_of_runs);
                    smooth(&self.smooth_along, halfway, &axis.warp, each_edge);
                }
                _ => smooth(&self.smooth[0], own, &axis.warp, edges_of_runs),
            }
        }
    }
}
