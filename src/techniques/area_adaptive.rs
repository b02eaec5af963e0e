//! Soft shadows as the weighted mean over hard ones from places of the light that are added where what they see differs.

use super::rt_soft::LIGHT_SAMPLES;
use super::{Info, MAPS, NEAREST, Technique};
use crate::frame::{ANALYSIS, Frame, MapSizes};
use crate::gpu::{Buffer, Gpu, Pass, Raster, Resource, hold};
use crate::light::LightView;
use crate::map::casters::{Casters, DRAW, Target, Triangles};
use crate::map::filter::{Reach, alone};
use crate::map::fit::Scope;
use crate::map::peel::{Depths, Held, StoredParams};
use crate::map::places::{PlacesFitParams, moved, on_light, reached_in_part, step};
use crate::map::single::scope;
use crate::map::{BiasParams, CasterParams, HardwareParams, MapParams, light_views, whole};
use crate::params::Params;
use crate::view::{self, Area, Axis, Class, Drawn, Legend, Span};
use anyhow::{Result, ensure};
use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec4, vec2};
use wgpu::BufferUsages as Use;

crate::params! {
    /// Where maps are drawn from.
    pub struct AreaAdaptiveParams {
        "Light samples" {
            /// When a cell of the light is split. Count: where its corners disagree on more of the receivers than `tau`. Gap: where besides, on the mean, the bands of its penumbra are wider than `gap`, so that they would be seen.
            criterion: choice("gap", ["count", "gap"]),
            /// The share of the receivers' pixels on which the corners of a cell may disagree before it is split.
            tau: float(0.0005, 0.0..=0.05, ""),
            /// The mean width of bands that need no more samples. No band counts as narrower than 2; 3 × 3 texels of a map hide some 2 to 3 pixels.
            gap: float(2.0, 1.0..=16.0, "px") if criterion = "gap",
            /// How often cells are halved at most: up to 9, 25, 81 or 289 samples, each of which is a map.
            levels: int(3, 1..=4, "times"),
            /// Texels along each side of the window whose comparisons are averaged in each map (PCF): the bands of few places flow together.
            kernel: int(3, 1..=5, "texels", 2),
        }
    }
}

pub static INFO: Info = Info {
    id: "area-adaptive",
    title: "Light sampling, adaptive",
    paper: "Schwärzler, Mattausch, Scherzer, Wimmer 2012",
    family: "Soft shadows",
    mark: 44,
    doc: "Shadow maps from the light's corners first; where the four corners of a part of the light disagree on too many pixels, that part \
          is cut in four, with a map from each new corner. Few maps for narrow penumbras, many for wide ones. A caster that none of four \
          corners notices is missed.",
    lights: &["directional", "spot", "rect-area"],
    filter: Some(NEAREST),
    smooth: |_| false,
    params: &[
        PlacesFitParams::GROUP,
        MapParams::GROUP,
        AreaAdaptiveParams::GROUP,
        CasterParams::GROUP,
        BiasParams::GROUP,
        StoredParams::GROUP,
        HardwareParams::GROUP,
    ],
    main: &[("resolution", "256..1024*2"), ("gap", "2,2.5,3"), ("levels", "2,3"), ("kernel", "1,3")],
    maps: &[
        &[
            LIGHT_SAMPLES,
            view::map(
                "light-cells",
                "Cells of the light",
                "The quadtree on the light: its cells, and on how many of the receivers' pixels the corners of each disagree.",
                Drawn::Labels(Legend::Chart(
                    Area::Square,
                    Axis { what: "along the light's width", span: Span::Linear(-1.0, 1.0) },
                    Axis { what: "along its height", span: Span::Linear(-1.0, 1.0) },
                    &[
                        Class::label(2, "split as often as may be"),
                        Class::label(1, "on more than 1 %"),
                        Class::label(0, "on 0.1 to 1 %"),
                        Class::label(3, "on less; pale: on none"),
                    ],
                )),
            ),
            view::map(
                "penumbra-cells",
                "Cells in penumbra",
                "Of how many of the light's cells the corners disagree on the pixel: how many steps its penumbra is drawn with at the \
                 least. All pixels see the same samples.",
                view::counts("cells that disagree", 256.0),
            ),
            view::map(
                "penumbra-level",
                "Level in penumbra",
                "How often the smallest cell was halved whose corners disagree on the pixel.",
                view::ramp("level", "", [0.0, 4.0]),
            ),
        ],
        MAPS,
    ],
    needs: |_| &[],
    make: |gpu, _| Ok(Box::new(AreaAdaptive::new(gpu)?)),
};

const FILE: &str = "techniques/area_adaptive.wgsl";
const TREE: &str = "map/light_tree.wgsl";

/// As in `shaders/lib/light_cells.wgsl`.
const MOST_CELLS: usize = 341;
const LIGHT_TREE: u64 = 32 + 73 * 16;
/// Bytes of each sample's arguments: a dispatch, a draw, and two indexed draws.
const ARGUMENTS: u64 = 12 + 16 + 2 * DRAW;
const VIEW: u64 = size_of::<LightView>() as u64;

/// As `SampleLevel` in `shaders/lib/light_cells.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct SampleLevel {
    level: u32,
    levels: u32,
    first: u32,
    end: u32,
    opaque: u32,
    corners: u32,
    padding: [u32; 2],
}

/// The samples at the corners of cells, by the level that first has them.
struct Corners {
    /// Of each sample its place in the square, -1 to 1.
    places: Vec<Vec2>,
    /// Of each level the number of samples up to its end.
    ends: Vec<usize>,
    /// Of each cell, level by level, the samples at its corners.
    cells: Vec<[u32; 4]>,
}

impl Corners {
    /// Of so many levels below the whole light; one sample in the middle of a light without a size.
    fn new(levels: u32, sized: bool) -> Corners {
        if !sized {
            return Corners { places: vec![Vec2::ZERO], ends: vec![1], cells: vec![[0; 4]] };
        }
        let side = 1usize << levels;
        let mut numbers = vec![None; (side + 1) * (side + 1)];
        let mut corners = Corners { places: Vec::new(), ends: Vec::new(), cells: Vec::new() };
        for level in 0..=levels {
            let (across, cell) = (1 << level, side >> level);
            let at = |x: usize, y: usize| y * cell * (side + 1) + x * cell;
            let mut number = |x: usize, y: usize| {
                *numbers[at(x, y)].get_or_insert_with(|| {
                    corners.places.push(2.0 * vec2(x as f32, y as f32) / across as f32 - 1.0);
                    corners.places.len() as u32 - 1
                })
            };
            for (y, x) in (0..across).flat_map(|y| (0..across).map(move |x| (y, x))) {
                let four = [number(x, y), number(x + 1, y), number(x, y + 1), number(x + 1, y + 1)];
                corners.cells.push(four);
            }
            corners.ends.push(corners.places.len());
        }
        corners
    }
}

/// What the samples' buffers depend on: levels, whether the light has a size, and the triangles, opaque and all.
type Size = (u32, bool, [u32; 2]);

/// The samples on the GPU.
struct Samples {
    corners: Corners,
    levels: Vec<Buffer>,
    cells: Buffer,
    /// Arguments of draws and dispatches, a view of the whole light, what of it is used, and the view narrowed to that, for each.
    draws: Buffer,
    whole: Buffer,
    extents: Buffer,
    fitted: Buffer,
    /// The places on the light, and the steps there from its middle, each with its number.
    places: Buffer,
    steps: Buffer,
    written: Option<(Vec<LightView>, Vec<Vec4>, Vec<Vec2>)>,
}

impl Samples {
    fn new(gpu: &Gpu, &(levels, sized, [opaque, triangles]): &Size) -> Samples {
        let corners = Corners::new(levels, sized);
        let count = corners.places.len();
        let firsts = std::iter::once(0).chain(corners.ends.iter().copied());
        let of_level = firsts.zip(&corners.ends).zip(0..).map(|((first, end), level)| {
            let words = SampleLevel {
                level,
                levels: corners.ends.len() as u32 - 1,
                first: first as u32,
                end: *end as u32,
                opaque: 3 * opaque,
                corners: 3 * triangles,
                padding: [0; 2],
            };
            gpu.buffer("level of samples", bytemuck::bytes_of(&words), Use::UNIFORM)
        });
        let mut cells = corners.cells.clone();
        cells.resize(MOST_CELLS, [0; 4]);
        let room = |label, bytes: usize, usage| gpu.room(label, bytes as u64, usage | Use::STORAGE | Use::COPY_DST);
        Samples {
            levels: of_level.collect(),
            cells: gpu.buffer("corners of cells", bytemuck::cast_slice(&cells), Use::UNIFORM),
            draws: room("samples' draws", count * ARGUMENTS as usize, Use::INDIRECT | Use::COPY_SRC),
            whole: room("samples' whole views", count * VIEW as usize, Use::empty()),
            extents: room("samples' receivers", count * 24, Use::empty()),
            fitted: room("samples' views", count * VIEW as usize, Use::COPY_SRC),
            places: room("places on the light", count * 8, Use::empty()),
            steps: room("steps to places", count * 16, Use::COPY_SRC),
            corners,
            written: None,
        }
    }

    /// Writes where the samples lie and look, where that has changed.
    fn write(&mut self, f: &Frame, reach: Reach) -> Result<()> {
        let places: Vec<Vec2> = self.corners.places.iter().map(|place| on_light(&f.light, *place)).collect();
        let steps = places.iter().map(|place| step(&f.light, *place)).zip(0..);
        let steps: Vec<Vec4> = steps.map(|(step, k)| step.extend(k as f32)).collect();
        let view = |step: &Vec4| {
            let view = whole(&Scope { light: moved(&f.light, step.truncate(), f.scene.bounds), ..scope(f, reach) })?;
            Ok(LightView { reach: reach.metres, ..view })
        };
        let views = steps.iter().map(view).collect::<Result<Vec<_>>>()?;
        let words = (views, steps, places);
        if self.written.as_ref() != Some(&words) {
            f.gpu.queue.write_buffer(&self.whole, 0, bytemuck::cast_slice(&words.0));
            f.gpu.queue.write_buffer(&self.steps, 0, bytemuck::cast_slice(&words.1));
            f.gpu.queue.write_buffer(&self.places, 0, bytemuck::cast_slice(&words.2));
            self.written = Some(words);
        }
        Ok(())
    }

    fn bound(&self) -> Vec<(&'static str, Resource)> {
        vec![
            ("cell_corners", (&self.cells).into()),
            ("draws", (&self.draws).into()),
            ("whole_views", (&self.whole).into()),
            ("extents", (&self.extents).into()),
            ("place_views", (&self.fitted).into()),
            ("light_places", (&self.places).into()),
        ]
    }
}

struct AreaAdaptive {
    begin: Pass,
    receivers: Pass,
    narrow: Pass,
    decide: Pass,
    weigh: Pass,
    look: Pass,
    count: Pass,
    resolve: Pass,
    inspect: Option<((), Pass)>,
    analyse: Option<((), Pass)>,
    clear: Option<(wgpu::TextureFormat, Pass)>,
    casters: Casters,
    /// The map of the first sample, which views tell of, and the one that all others are drawn into; and the views of both.
    maps: [Held; 2],
    views: [Buffer; 2],
    samples: Option<(Size, Samples)>,
    /// The step to the sample at work.
    step: Buffer,
    tree: Buffer,
    tallies: Buffer,
    beyond: Buffer,
    /// What the samples see of each pixel.
    codes: Option<(u64, Buffer)>,
}

impl AreaAdaptive {
    fn new(gpu: &Gpu) -> Result<AreaAdaptive> {
        let file = alone(FILE);
        let tree = |name, entry| Pass::compute(gpu, name, TREE, entry, INFO.params);
        let own = |name, entry| Pass::compute(gpu, name, &file, entry, INFO.params);
        let room = |label, bytes| gpu.room(label, bytes, Use::STORAGE | Use::COPY_DST | Use::COPY_SRC);
        Ok(AreaAdaptive {
            begin: tree("light's cells", "begin")?,
            receivers: tree("fit: receivers", "place_receivers")?,
            narrow: tree("fit: narrow", "narrow_places")?,
            decide: tree("light's cells", "decide")?,
            weigh: tree("light's cells", "weigh")?,
            look: own("look-up of a map", "look")?,
            count: own("disagreement", "count_pixels")?,
            resolve: own("mean over maps", "weighed")?,
            inspect: None,
            analyse: None,
            clear: None,
            casters: Casters::named(["shadow map", "shadow map (masked)"]),
            maps: Default::default(),
            views: ["first sample's view", "other samples' views"].map(|label| light_views(gpu, label)),
            samples: None,
            step: gpu.buffer("step to a place", &[0; 16], Use::UNIFORM),
            tree: gpu.room("light's cells", LIGHT_TREE, Use::STORAGE | Use::UNIFORM | Use::COPY_SRC),
            tallies: room("pixels of cells", 4 * (2 * MOST_CELLS as u64 + 5)),
            beyond: room("receivers beyond the map", 4),
            codes: None,
        })
    }
}

impl Technique for AreaAdaptive {
    fn render(&mut self, f: &mut Frame) -> Result<()> {
        let (gpu, scene) = (f.gpu, f.scene);
        let p = AreaAdaptiveParams::read(f.values);
        let sized = f.light.has_size();
        if !sized {
            f.tell_note("The light has no size: one map is drawn, from its centre.".into());
        }
        let size = (if sized { p.levels } else { 0 }, sized, [scene.opaque_count, scene.triangle_count]);
        let reach = Reach { texels: 0.5 * (p.kernel - 1) as f32, ..Reach::default() };
        let samples = hold(&mut self.samples, size, |size| Ok(Samples::new(gpu, size)))?;
        samples.write(f, reach)?;
        let ends = samples.corners.ends.clone();
        let per_word = match p.kernel {
            1 => 16,
            3 => 6,
            _ => 5,
        };
        let words = ends[ends.len() - 1].div_ceil(per_word) as u64;
        let bytes = f.size.iter().map(|side| u64::from(*side)).product::<u64>() * words * 4;
        ensure!(
            bytes <= gpu.most_bound(),
            "the picture has too many pixels to keep what {} samples see of each; choose a smaller one, fewer levels or a smaller kernel",
            ends[ends.len() - 1]
        );
        let codes = hold(&mut self.codes, bytes, |bytes| Ok(gpu.room("what samples see", *bytes, Use::STORAGE)))?;

        let sides = [MapParams::read(f.values).resolution];
        let [first, others] = &mut self.maps;
        let first = Depths::hold(first, f, &sides)?;
        // A single sample needs no other map.
        let others = if sized { Some(Depths::hold(others, f, &sides)?) } else { None };
        let format = first.nearest.texture.format();
        let clear = hold(&mut self.clear, format, |format| {
            let raster = Raster {
                vertex: "cleared",
                depth: Raster::nearest(*format).map(|state| wgpu::DepthStencilState {
                    depth_compare: Some(wgpu::CompareFunction::Always),
                    ..state
                }),
                ..Raster::default()
            };
            Pass::render(gpu, "shadow map", TREE, raster, INFO.params)
        })?;
        let maps = [(&first, &self.views[0]), (others.as_ref().unwrap_or(&first), &self.views[1])];
        let mut bound = samples.bound();
        bound.extend([
            ("growing", (&self.tree).into()),
            ("light_tree", (&self.tree).into()),
            ("tallies", (&self.tallies).into()),
            ("beyond", (&self.beyond).into()),
            ("codes", (&*codes).into()),
            ("step_to_place", (&self.step).into()),
        ]);
        f.clear(&self.tallies);
        f.clear(&samples.extents);
        f.clear(&self.beyond);
        let levels = &samples.levels;
        let at_level = |level: usize| ("sample_level", Resource::from(&levels[level]));
        f.run(&self.begin).bind_all(&bound).bind_all(&[at_level(0)]).of_picture().dispatch(1, 1, 1);
        let mut k = 0;
        for (level, end) in ends.iter().enumerate() {
            bound.retain(|(name, _)| *name != "sample_level");
            bound.push(at_level(level));
            let count = (end - k) as u32;
            let [w, h] = f.size.map(|side| side.div_ceil(64));
            if PlacesFitParams::read(f.values).fit != "scene" {
                f.run(&self.receivers).bind_all(&bound).dispatch(w, h, count);
            }
            f.run(&self.narrow).bind_all(&bound).dispatch(count.div_ceil(64), 1, 1);
            while k < *end {
                let (depths, view) = maps[usize::from(k > 0)];
                f.copy(&samples.fitted, k as u64 * VIEW, view, VIEW);
                f.copy(&samples.steps, k as u64 * 16, &self.step, 16);
                // A map that is not drawn is not cleared either: the GPU says which are, and all of the first level's.
                let (at, always) = (k as u64 * ARGUMENTS, level == 0);
                if !always {
                    for layer in [Some(&depths.nearest), depths.peeled.as_ref()].into_iter().flatten() {
                        f.run(clear).uncounted().draw(&[], Some((&layer.each[0], 0.0)), false, |pass| {
                            pass.draw_indirect(&samples.draws, at + 12);
                        });
                    }
                }
                let to = Target { first: always, ..Target::whole(sides[0], view, false) };
                let casters = Triangles::Listed { indices: &scene.indices, draws: &samples.draws, at: at + 28 };
                self.casters.draw_depths(f, (depths, 0), to, &casters)?;
                f.run(&self.look)
                    .bind_all(&bound)
                    .bind("shadow_maps", &depths.looked_up().all)
                    .bind("light_views", view)
                    .of_picture()
                    .dispatch_indirect(&samples.draws, at);
                k += 1;
            }
            if level + 1 < ends.len() {
                let [w, h] = f.size.map(|side| side.div_ceil(32));
                f.run(&self.count).bind_all(&bound).of_picture().dispatch(w, h, 1);
                f.run(&self.decide).bind_all(&bound).of_picture().dispatch(1, 1, 1);
            }
        }
        f.run(&self.weigh).bind_all(&bound).of_picture().dispatch(1, 1, 1);
        f.outline_view(&self.views[0]);
        f.count_maps_in(&self.tree);
        if sized {
            f.tell_counted(&self.tree, |maps| format!("{maps} maps were drawn, each from another place of the light."));
        }
        f.tell_counted(&self.beyond, reached_in_part);

        let (layers, view) = (first.looked_up(), &self.views[0]);
        bound.extend([("shadow_maps", (&layers.all).into()), ("light_views", view.into())]);
        f.keep_table("light_views", view);
        f.offer_maps(&layers.each, view, &sides);
        f.run(&self.resolve).bind_all(&bound).of_picture().per_pixel();
        let made = |name, entry| Pass::compute(gpu, name, &alone(FILE), entry, INFO.params);
        if f.wants_analysis() {
            let analyse = hold(&mut self.analyse, (), |()| made(ANALYSIS, "analyse"))?;
            f.analyse(analyse, MapSizes::of(&sides), &bound);
        }
        if f.wants_any_map() {
            let inspect = hold(&mut self.inspect, (), |()| made("inspect", "inspect"))?;
            f.run(inspect).bind_all(&bound).per_pixel();
        }
        Ok(())
    }
}
