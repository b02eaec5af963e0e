//! Shadow maps with a warp that no matrix can express: casters are split where it bends them, or met by each texel's ray.
//!
//! A technique's shader includes `shaders/map/warp/warped.wgsl` and writes the warp (`shaders/map/place/warp.wgsl`). Its Rust file
//! asks [`Warped::base`] for the light's view before the warp, or the views of all layers around a light, makes the warp of each
//! layer anew where that says so, and calls [`Warped::draw`].

pub mod around;
mod exact;
pub mod node_grid;
mod subdivide;

use super::busy::Dispatches;
use super::casters::format;
use super::filter::{LookUp, Reach, alone};
use super::fit::Scope;
use super::single::{Fit, scope};
use super::{CasterParams, Layers, MapParams, Maps, whole};
use crate::frame::{ANALYSIS, Counting, Frame};
use crate::gpu::{Buffer, Gpu, Pass, Resource, hold};
use crate::light::LightView;
use crate::params::{Group, Params, Values};
use crate::techniques::NEAREST;
use crate::view::{self, BEFORE_AFTER, Class, Drawn, Legend, View};
use anyhow::Result;
use exact::Exact;
use subdivide::Subdivide;

crate::params! {
    /// How casters are drawn into a warped map.
    pub struct RasterParams {
        "Raster" {
            /// How casters are drawn. Linear: corners are moved and edges stay straight, so that large triangles end up in the wrong place. Subdivide: triangles are split where an edge would deviate by more than the tolerance. Exact: each texel's ray meets the triangles themselves.
            raster: choice("exact", ["linear", "subdivide", "exact"]),
            /// How far an edge may deviate from its warped image before its triangle is split.
            tolerance: float(0.5, 0.05..=16.0, "texels") if raster = "subdivide",
        }
    }
}

/// The views that every technique with a warp has, after the seven of a shadow map.
pub const MAPS: [View; 3] = [
    view::map(
        "grid",
        "Warp grid",
        "Left the light's image before the warp, with the lines that become every sixteenth of the map's sides; right \
              the map, with every sixteenth of the image's sides. Where cells are large, texels are many.",
        Drawn::Labels(Legend::Squares(
            BEFORE_AFTER,
            &[Class::label(3, "sixteenths of the map"), Class::label(1, "sixteenths of the light's image")],
        )),
    ),
    view::map(
        "folds",
        "Folds",
        "Red: triangles of which the map holds a part turned inside out, because corners moved and edges stayed \
              straight. Their shadow is wrong there.",
        Drawn::Labels(Legend::Classes(&[Class::label(0, "triangles with a part turned inside out")])),
    ),
    view::aliasing(
        "counts-before",
        "Samples before the warp",
        "The map as it would be without the warp. White: texels that no pixel looks up. Green: one pixel each. Ochre \
              to dark red: 4 to 256 pixels share a texel. Blue: many texels for each pixel, which are too small to be seen one by \
              one.",
        Drawn::Counts,
    ),
];

/// What a warped map depends on.
#[derive(PartialEq)]
struct Key {
    scope: Scope,
    values: Values,
    size: [u32; 2],
    revision: u64,
    /// Texels that no view sample needs are drawn too.
    shown: bool,
    /// What the layers' warps are made of is kept for all of them.
    kept: bool,
}

/// Bytes of `State` in `shaders/map/warp/warped.wgsl` before its parts: the rays' draw and box, and a bit a triangle.
const RAY_ARGUMENTS: u64 = 256;
const TRIANGLES_MET: u64 = 256 + 32 + 1024;
const STATE: wgpu::BufferUsages = wgpu::BufferUsages::STORAGE
    .union(wgpu::BufferUsages::INDIRECT)
    .union(wgpu::BufferUsages::COPY_SRC)
    .union(wgpu::BufferUsages::COPY_DST);

/// Parameters that matter in the look-up only.
const LOOK_UP: [&str; 6] = ["epsilon", "toward_light", "bias", "slope_bias", "slope_limit", "receiver_plane"];

/// A way to draw casters.
trait Casters {
    /// Draws them into the map of a layer, if anything `changed`. `bound`: what shaders need, by name; `layer_and_map`: its number
    /// and its depth; `arguments_and_state`: where the passes put the draw's arguments, and what they tell each other.
    ///
    /// # Errors
    /// More than the adapter binds at once.
    fn draw(
        &mut self,
        f: &mut Frame,
        changed: bool,
        bound: &[(&'static str, Resource)],
        layer_and_map: (usize, &wgpu::TextureView),
        arguments_and_state: [&Buffer; 2],
    ) -> Result<()>;
}

/// What the casters' passes were made for.
#[derive(Clone, PartialEq)]
struct Way {
    raster: String,
    cull: String,
    format: wgpu::TextureFormat,
}

/// A warped shadow map and the passes that draw and look it up.
pub struct Warped {
    file: &'static str,
    groups: &'static [Group],
    fit: Fit,
    around: Option<around::Layers>,
    /// Of several layers that lie around no light: what their passes count together, as the first of `State`, and what adds it up.
    told: Option<(Pass, Buffer)>,
    views: Option<(Buffer, Vec<Buffer>)>,
    layers: Option<Layers>,
    casters: Option<(Way, Box<dyn Casters>)>,
    arguments: Buffer,
    /// `State` in `shaders/map/warp/warped.wgsl` of each layer, for a number of triangles and layers.
    states: Option<((u32, usize), Vec<Buffer>)>,
    /// For a number of triangles.
    folds: Option<(u32, Buffer)>,
    look_up: LookUp,
    count: Pass,
    count_folds: Pass,
    counting: Buffer,
    counts: Option<Buffer>,
    made: Option<Key>,
    /// What the frame at work makes.
    making: Option<Key>,
}

/// The light's views before the warp.
pub struct Base {
    /// Of all layers; a single map's is the first.
    pub light_view: Buffer,
    /// Of each layer its own.
    pub each: Vec<Buffer>,
    /// Texels of each layer's side.
    pub side: u32,
    /// The warp and the map must be made anew: something that they depend on changed.
    pub changed: bool,
    /// Of all layers, if they lie around a light: what their passes bind.
    pub faces: Vec<(&'static str, Resource)>,
    /// Of them, what draws casters before the warp.
    pub plain: Option<around::Plain>,
}

impl Base {
    /// What a layer's passes bind, beside `bound`.
    pub fn layer(&self, i: usize, bound: &[(&'static str, Resource)]) -> Vec<(&'static str, Resource)> {
        let mut all = bound.to_vec();
        all.extend_from_slice(&self.faces);
        all.push(("light_view", (&self.each[i]).into()));
        all
    }
}

impl Warped {
    /// From a technique's own shader, with all of its parameters.
    pub fn new(gpu: &Gpu, file: &'static str, groups: &'static [Group]) -> Result<Warped> {
        use wgpu::BufferUsages as Use;
        let pass = |name, entry| Pass::compute(gpu, name, &alone(file), entry, groups);
        let zero = |label, size: usize, usage| gpu.buffer(label, &vec![0; size], usage);
        Ok(Warped {
            file,
            groups,
            fit: Fit::new(gpu)?,
            around: None,
            told: None,
            views: None,
            layers: None,
            casters: None,
            arguments: zero("draw of the casters", 16, Use::STORAGE | Use::INDIRECT),
            states: None,
            folds: None,
            look_up: LookUp::new(gpu, file, groups),
            count: pass("count map", "count_before")?,
            count_folds: pass(ANALYSIS, "count_folds")?,
            counting: zero("counting", size_of::<Counting>(), Use::UNIFORM),
            counts: None,
            made: None,
            making: None,
        })
    }

    /// As [`Warped::new`], of faces around a light, with a warp each.
    pub fn around(
        gpu: &Gpu,
        file: &'static str,
        groups: &'static [Group],
        views: Option<around::Views>,
    ) -> Result<Warped> {
        let around = views.map(|views| around::Layers::new(gpu, file, groups, views)).transpose()?;
        Ok(Warped { around, ..Warped::new(gpu, file, groups)? })
    }

    /// As [`Warped::new`], of several layers whose views the technique makes ([`Warped::layers`]).
    ///
    /// # Errors
    /// Passes that cannot be made.
    pub fn several(gpu: &Gpu, file: &'static str, groups: &'static [Group]) -> Result<Warped> {
        let tell = Pass::compute(gpu, "layers told", &alone(file), "tell", groups)?;
        let told = storage(gpu, "triangles of all layers", TRIANGLES_MET + 4);
        Ok(Warped { told: Some((tell, told)), ..Warped::new(gpu, file, groups)? })
    }

    /// The light's views of several layers before the warp, whose sides have `side` texels: all together and one by one, made where
    /// anything changed since the last frame. `bound`: what their passes bind beside.
    ///
    /// # Errors
    /// What `make` says.
    pub fn layers(
        &mut self,
        f: &mut Frame,
        side: u32,
        bound: Vec<(&'static str, Resource)>,
        make: impl FnOnce(&mut Frame) -> (Buffer, Vec<Buffer>),
    ) -> Base {
        let held = self.begin(f, false);
        let changed = held.is_none();
        let (light_view, each) = held.unwrap_or_else(|| make(f));
        self.views = Some((light_view.clone(), each.clone()));
        Base { light_view, each, side, changed, faces: bound, plain: None }
    }

    /// The views of the last frame, if nothing changed since. What is drawn from now on is of what this frame asks for.
    fn begin(&mut self, f: &Frame, kept: bool) -> Option<(Buffer, Vec<Buffer>)> {
        let values = f.values.iter().filter(|(k, _)| !LOOK_UP.contains(&k.as_str()));
        let values = values.map(|(k, v)| (k.clone(), v.clone())).collect();
        let scope = scope(f, Reach::default());
        let key = Key { scope, values, size: f.size, revision: f.revision, shown: shown(f), kept };
        let held = self.views.clone().filter(|_| !f.fresh && self.made.as_ref() == Some(&key));
        // Until it is made, there is none.
        self.made = None;
        self.making = Some(key);
        held
    }

    /// The light's view before the warp: `view`, or one of the whole scene; `narrow`: fitted to the receivers that the
    /// camera sees. Of faces around a light: each whole, or narrowed so. `kept`: what warps are made of is kept for all of them.
    ///
    /// # Errors
    /// A light without a single view.
    pub fn base(&mut self, f: &mut Frame, view: Option<LightView>, narrow: bool, kept: bool) -> Result<Base> {
        let side = self.around.as_ref().map_or_else(|| MapParams::read(f.values).resolution, |around| around.side(f));
        let held = self.begin(f, kept);
        let changed = held.is_none();
        let (light_view, each) = match (held, &mut self.around) {
            (Some(held), _) => held,
            (None, Some(around)) => {
                let layers = around.fit(f, narrow)?;
                let (all, mut each) = around.light_views();
                each.truncate(layers);
                (all, each)
            }
            (None, None) => {
                let mut view = view.map_or_else(|| whole(&scope(f, Reach::default())), Ok)?;
                // Depth is linear, as the warp leaves no plane flat.
                view.perspective = LightView::WARPED;
                let view = self.fit.run(f, view, narrow);
                (view.clone(), vec![view])
            }
        };
        self.views = Some((light_view.clone(), each.clone()));
        let faces = self.around.iter().flat_map(|around| around.bound()).collect();
        let plain = self.around.as_ref().map(|around| around.plain());
        Ok(Base { light_view, each, side, changed, faces, plain })
    }

    /// Draws the casters through the warp, fills the frame's visibility and shows the maps. `bound`: what the technique's
    /// shader needs beside, by name.
    ///
    /// # Errors
    /// A map that the adapter cannot hold.
    pub fn draw(&mut self, f: &mut Frame, base: &Base, bound: &[(&'static str, Resource)]) -> Result<()> {
        let p = CasterParams::read(f.values);
        let r = RasterParams::read(f.values);
        let (resolution, number) = (base.side, base.each.len());
        let sides = vec![resolution; number];
        let layers = Layers::hold(&mut self.layers, f.gpu, &sides, format(&p))?;
        let triangles = f.scene.triangle_count;
        let states = hold(&mut self.states, (triangles, number), |(n, layers)| {
            let bytes = TRIANGLES_MET + n.div_ceil(32).max(1) as u64 * 4;
            Ok((0..*layers).map(|_| f.gpu.room("state of a warped map", bytes, STATE)).collect())
        })?
        .clone();
        let folds =
            hold(&mut self.folds, triangles, |n| Ok(storage(f.gpu, "folded triangles", n.div_ceil(32) as u64 * 4)))?;
        let mut all: Vec<(&'static str, Resource)> = bound.to_vec();
        all.extend([
            ("light_view", (&base.light_view).into()),
            ("arguments", (&self.arguments).into()),
            ("folds", (&*folds).into()),
            ("folded", (&*folds).into()),
        ]);
        all.extend_from_slice(&base.faces);
        let of_layer = |i: usize| {
            let mut bound = base.layer(i, &all);
            bound.push(("state", (&states[i]).into()));
            bound
        };
        if base.changed {
            f.clear(folds);
            if let Some((_, told)) = &self.told {
                f.clear(told);
            }
        }
        let way = Way { raster: r.raster, format: format(&p), cull: p.cull };
        let (file, groups) = (self.file, self.groups);
        let casters = hold(&mut self.casters, way, |way| {
            Ok(match way.raster.as_str() {
                "exact" => Box::new(Exact::new(f.gpu, file, groups, way)?) as Box<dyn Casters>,
                _ => Box::new(Subdivide::new(f.gpu, file, groups, way)?),
            })
        })?;
        for (i, state) in states.iter().enumerate() {
            if base.changed {
                f.clear(state);
            }
            let bound = of_layer(i);
            casters.draw(f, base.changed, &bound, (i, &layers.each[i]), [&self.arguments, state])?;
            if let Some(around) = self.around.as_ref().filter(|_| base.changed) {
                around.drawn(f, &bound);
            }
            if let Some((tell, told)) = self.told.as_ref().filter(|_| base.changed) {
                f.run(tell).bind_all(&bound).bind("told", told).dispatch(1, 1, 1);
            }
        }
        match (&self.around, &self.told) {
            (Some(around), _) => around.report(f, number),
            (None, Some((_, told))) => f.count_pieces(told),
            (None, None) => {
                f.count_pieces(&states[0]);
                f.outline_view(&base.light_view);
            }
        }
        for (name, resource) in bound {
            if let Resource::Buffer(buffer) = resource {
                f.keep_table(name, buffer);
            }
        }
        let maps = Maps { layers, light_views: base.light_view.clone(), sides, bound: all.clone() };
        self.look_up.run(f, &maps, NEAREST, &[])?;
        if self.around.is_none() && self.told.is_none() {
            f.offer_warp(file, groups, &all);
        }
        let bound: Vec<_> = (0..number).map(of_layer).collect();
        if f.view == "counts-before" {
            let counts = self.counts(f.gpu, resolution, number);
            f.clear(&counts);
            for bound in &bound {
                f.run(&self.count).bind_all(bound).bind("before", &counts).per_pixel();
            }
            self.show_counts(f, &counts, resolution, number);
        }
        if f.wants_analysis() {
            let groups = resolution.div_ceil(8);
            for (bound, state) in bound.iter().zip(&states) {
                let several = self.told.as_ref().map(|(_, told)| told);
                let state = self.around.as_ref().map(|around| around.told()).or(several).unwrap_or(state);
                f.run(&self.count_folds).bind_all(bound).bind("state", state).dispatch(groups, groups, 1);
            }
        }
        self.made = self.making.take();
        Ok(())
    }

    /// Shows counts of view samples, a number per texel.
    fn show_counts(&self, f: &mut Frame, counts: &Buffer, resolution: u32, layers: usize) {
        let count = resolution * resolution * layers as u32;
        let counting = Counting {
            size: [resolution; 2],
            layers: layers as u32,
            first: 0,
            count,
            padding: 0,
            spare: [0; 2],
            sides: [[0; 4]; 2],
        };
        f.gpu.queue.write_buffer(&self.counting, 0, bytemuck::bytes_of(&counting));
        f.draw_counts(&self.counting, counts);
    }

    /// A buffer for a count a texel, held while it is looked at.
    fn counts(&mut self, gpu: &Gpu, resolution: u32, layers: usize) -> Buffer {
        let size = resolution as u64 * resolution as u64 * 4 * layers as u64;
        if self.counts.as_ref().is_none_or(|b| b.size() != size) {
            self.counts = Some(storage(gpu, "view samples before the warp", size));
        }
        self.counts.clone().unwrap_or_else(|| storage(gpu, "view samples before the warp", size))
    }
}

/// Whether the map itself is looked at, so that the exact raster, which draws needed texels only, has to draw all.
fn shown(f: &Frame) -> bool {
    let looked_into = f.whole_maps || ["shadow-map", "shadow-maps", "grid", "nodes"].contains(&f.view);
    looked_into && RasterParams::read(f.values).raster == "exact"
}

/// A storage buffer of so many bytes that can be copied both ways.
pub fn storage(gpu: &Gpu, label: &str, size: u64) -> Buffer {
    use wgpu::BufferUsages as Use;
    gpu.room(label, size, Use::STORAGE | Use::COPY_SRC | Use::COPY_DST)
}
