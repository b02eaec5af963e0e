//! Shadow maps with a warp that no matrix can express: casters are split where it bends them, or drawn exactly.
//!
//! A technique's shader includes `shaders/lib/warped.wgsl` and writes the warp (`shaders/lib/warp.wgsl`). Its Rust file
//! asks [`Warped::base`] for the light's view before the warp, makes the warp anew where that says so, and calls
//! [`Warped::draw`].

use crate::fit::Scope;
use crate::frame::{ANALYSIS, Counting, Frame, Maps};
use crate::gpu::{Gpu, Pass, Raster, Resource, Slot};
use crate::light::LightView;
use crate::params::{Group, Params, Values};
use crate::shadow_map::{Fit, MapParams, USAGE, format, scope, whole};
use crate::view::View;
use anyhow::{Result, ensure};
use bytemuck::{Pod, Zeroable};

crate::params! {
    /// How casters are drawn into a warped map.
    pub struct RasterParams {
        /// Linear: corners are moved, edges stay straight, so that large triangles miss their places. Subdivide: triangles are split where an edge would deviate by more than `tolerance`. Exact: every texel's ray meets the triangles themselves.
        raster: choice("exact", ["linear", "subdivide", "exact"]),
        /// Subdivide: how far an edge may lie beside its warped image.
        tolerance: float(0.5, 0.05..=16.0, "texels"),
    }
}

/// The views that every technique with a warp has, after the seven of a shadow map; numbered as in `inspect_map` in WGSL.
pub const MAPS: [View; 3] = [
    View {
        id: "grid",
        title: "Warp grid",
        doc: "Left the light's image before the warp, with the lines that become every sixteenth of the map's sides; right \
              the map, with every sixteenth of the image's sides. Where cells are large, texels are many.",
        truth: false,
    },
    View {
        id: "folds",
        title: "Folds",
        doc: "Red: triangles of which the map holds a part turned inside out, because corners moved and edges stayed \
              straight. Their shadow is wrong there.",
        truth: false,
    },
    View {
        id: "counts-before",
        title: "View samples before the warp",
        doc: "The map as it would be without the warp. White: texels that no pixel looks up. Green: one pixel each. Ochre \
              to dark red: 4 to 256 pixels share a texel; blue: the mean of texels fewer than one.",
        truth: false,
    },
];

/// How often a triangle is split: each time edges are halved.
const LEVELS: u32 = 14;
/// Bytes of a piece, and of its box.
const PIECE: u64 = 64;
const BOX: u64 = 16;

/// As `Level` in `shaders/lib/warped.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Level {
    pub number: u32,
    pub last: u32,
    pub most: u32,
    pub most_drawn: u32,
}

/// What a warped map depends on.
#[derive(PartialEq)]
struct Key {
    scope: Scope,
    values: Values,
    size: [u32; 2],
    revision: u64,
}

/// Parameters that matter in the look-up only.
const LOOK_UP: [&str; 4] = ["bias", "slope_bias", "slope_limit", "receiver_plane"];

/// Buffers whose size depends on the scene.
struct Pieces {
    triangles: u32,
    levels: Vec<wgpu::Buffer>,
    work: wgpu::Buffer,
    pieces: wgpu::Buffer,
    boxes: wgpu::Buffer,
    folds: wgpu::Buffer,
}

/// A warped shadow map and the passes that draw and look it up.
pub struct Warped {
    file: &'static str,
    groups: &'static [Group],
    fit: Fit,
    light_view: Option<wgpu::Buffer>,
    depth: Slot,
    pieces: Option<Pieces>,
    counters: wgpu::Buffer,
    tiles: wgpu::Buffer,
    image_tiles: wgpu::Buffer,
    /// Not held for the linear raster.
    rays: wgpu::Buffer,
    arguments: wgpu::Buffer,
    need: Pass,
    spread: Pass,
    trace: Pass,
    start: Pass,
    split: Pass,
    finish: Pass,
    casters: Option<([String; 2], wgpu::TextureFormat, Pass)>,
    resolve: Pass,
    inspect: Pass,
    analyse: Pass,
    count: Pass,
    draw_counts: Pass,
    counting: wgpu::Buffer,
    counts: Option<wgpu::Buffer>,
    made: Option<Key>,
    /// What the frame at work makes.
    making: Option<Key>,
}

/// The light's view before the warp.
pub struct Base {
    pub light_view: wgpu::Buffer,
    /// The warp and the map must be made anew: something that they depend on changed.
    pub changed: bool,
}

impl Warped {
    /// From a technique's own shader, with all of its parameters.
    pub fn new(gpu: &Gpu, file: &'static str, groups: &'static [Group]) -> Result<Warped> {
        use wgpu::BufferUsages as Use;
        let pass = |name, entry| Pass::compute(gpu, name, file, entry, groups);
        let zero = |label, size: usize, usage| gpu.buffer(label, &vec![0; size], usage);
        Ok(Warped {
            file,
            groups,
            fit: Fit::new(gpu)?,
            light_view: None,
            depth: Slot::default(),
            pieces: None,
            counters: zero("pieces' counters", 128, Use::STORAGE | Use::COPY_SRC),
            tiles: zero("needed tiles", 512, Use::STORAGE),
            image_tiles: zero("needed tiles of the image", 512, Use::STORAGE),
            rays: storage(gpu, "texels' rays", 16),
            arguments: zero("draw of the pieces", 16, Use::STORAGE | Use::INDIRECT),
            need: pass("needed tiles", "need")?,
            spread: pass("needed tiles", "spread")?,
            trace: pass("texels' rays", "trace_rays")?,
            start: pass("caster culling", "start")?,
            split: pass("subdivision", "split")?,
            finish: pass("subdivision", "finish")?,
            casters: None,
            resolve: pass("resolve", "resolve")?,
            inspect: pass("inspect", "inspect")?,
            analyse: pass(ANALYSIS, "analyse")?,
            count: pass("count map", "count_before")?,
            draw_counts: Pass::compute(gpu, "count map", "counts.wgsl", "draw_counts", &[])?,
            counting: zero("counting", size_of::<Counting>(), Use::UNIFORM),
            counts: None,
            made: None,
            making: None,
        })
    }

    /// The light's view before the warp: `view`, or one of the whole scene; `narrow`: fitted to the receivers that the
    /// camera sees.
    ///
    /// # Errors
    /// A light without a single view.
    pub fn base(&mut self, f: &mut Frame, view: Option<LightView>, narrow: bool) -> Result<Base> {
        let scope = scope(f, 0.0);
        let values = f.values.iter().filter(|(k, _)| !LOOK_UP.contains(&k.as_str()));
        let values = values.map(|(k, v)| (k.clone(), v.clone())).collect();
        let key = Key { scope, values, size: f.size, revision: f.revision };
        let held = self.light_view.clone().filter(|_| !f.fresh && self.made.as_ref() == Some(&key));
        let changed = held.is_none();
        // Until it is made, there is none.
        self.made = None;
        self.making = Some(key);
        let light_view = match held {
            Some(held) => held,
            None => {
                let mut view = view.map_or_else(|| whole(&scope), Ok)?;
                // Depth is linear, as the warp leaves no plane flat.
                view.perspective = LightView::WARPED;
                self.fit.run(f, view, narrow)
            }
        };
        self.light_view = Some(light_view.clone());
        Ok(Base { light_view, changed })
    }

    /// Draws the casters through the warp, fills the frame's visibility and shows the maps. `bound`: what the technique's
    /// shader needs beside, by name.
    ///
    /// # Errors
    /// A map that the adapter cannot hold.
    pub fn draw(&mut self, f: &mut Frame, base: &Base, bound: &[(&'static str, Resource)]) -> Result<()> {
        let p = MapParams::read(f.values);
        let limit = f.gpu.device.limits().max_texture_dimension_2d;
        ensure!(p.resolution <= limit, "a map of {}² texels is more than {} takes", p.resolution, f.gpu.info.name);
        let r = RasterParams::read(f.values);
        let exact = r.raster == "exact";
        self.prepare_casters(f.gpu, &p, &r.raster)?;
        self.prepare_rays(f.gpu, if r.raster == "linear" { 0 } else { p.resolution })?;
        let map = self.depth.get(f.gpu, "shadow map", [p.resolution; 2], format(&p), USAGE);
        let pieces = Pieces::hold(&mut self.pieces, f.gpu, f.scene.triangle_count);
        let mut all: Vec<(&'static str, Resource)> = bound.to_vec();
        all.extend([
            ("light_view", (&base.light_view).into()),
            ("shadow_map", (&map).into()),
            ("tiles", (&self.tiles).into()),
            ("image_tiles", (&self.image_tiles).into()),
            ("rays", (&self.rays).into()),
            ("drawn_rays", (&self.rays).into()),
            ("counters", (&self.counters).into()),
            ("arguments", (&self.arguments).into()),
            ("work", (&pieces.work).into()),
            ("pieces", (&pieces.pieces).into()),
            ("drawn_pieces", (&pieces.pieces).into()),
            ("boxes", (&pieces.boxes).into()),
            ("drawn_boxes", (&pieces.boxes).into()),
            ("folds", (&pieces.folds).into()),
            ("folded", (&pieces.folds).into()),
        ]);
        let own = [&self.counters, &self.tiles, &self.image_tiles, &self.rays, &self.arguments];
        let held = own.into_iter().chain([&pieces.work, &pieces.pieces, &pieces.boxes]);
        f.held(held.map(|b| b.size()).sum::<u64>() + pieces.folds.size());
        if let Some(texture) = self.depth.texture() {
            f.held(crate::gpu::bytes(texture));
        }
        if base.changed {
            for buffer in [&self.counters, &self.tiles, &self.image_tiles, &pieces.folds] {
                f.clear(buffer);
            }
            f.run(&self.need).bind_all(&all).per_pixel();
            if r.raster != "linear" {
                f.run(&self.spread).bind_all(&all).dispatch(64, 1, 1);
                f.run(&self.trace).bind_all(&all).dispatch(p.resolution.div_ceil(64), p.resolution, 1);
            }
            f.run(&self.start).bind_all(&all).bind("level", &pieces.levels[0]).dispatch(256, 1, 1);
            if r.raster != "linear" {
                for level in &pieces.levels[1..] {
                    f.run(&self.split).bind_all(&all).bind("level", level).dispatch(256, 1, 1);
                }
            }
            f.run(&self.finish).bind_all(&all).bind("level", &pieces.levels[0]).dispatch(1, 1, 1);
            if let Some((.., casters)) = &self.casters {
                let arguments = &self.arguments;
                f.run(casters).bind_all(&all).draw(&[], Some((&map, 0.0)), true, |p| p.draw_indirect(arguments, 0));
            }
        }
        f.count_pieces(&self.counters, exact);
        f.keep_table("light_view", &base.light_view);
        f.keep_table("rays", &self.rays);
        for (name, resource) in bound {
            if let Resource::Buffer(buffer) = resource {
                f.keep_table(name, buffer);
            }
        }
        f.run(&self.resolve).bind_all(&all).per_pixel();
        if f.wants_any_map() {
            f.run(&self.inspect).bind_all(&all).per_pixel();
        }
        f.show_texture("shadow-map", &map, &base.light_view);
        f.show_cells("texels");
        f.show_ramp("bias", [0.0, 4.0]);
        f.show_labels("grid");
        f.show_labels("folds");
        if f.setup.view == "counts-before" {
            let counts = self.counts(f.gpu, p.resolution);
            f.clear(&counts);
            f.run(&self.count).bind_all(&all).bind("before", &counts).per_pixel();
            self.show_counts(f, "counts-before", &counts, p.resolution);
        }
        f.analyse(&self.analyse, Maps { size: [p.resolution; 2], layers: 1 }, &all);
        self.made = self.making.take();
        Ok(())
    }

    /// Shows counts of view samples, a number a texel, where the map `id` is asked for.
    pub fn show_counts(&self, f: &mut Frame, id: &str, counts: &wgpu::Buffer, resolution: u32) {
        if f.setup.view != id {
            return;
        }
        let count = resolution * resolution;
        let counting = Counting { size: [resolution; 2], layers: 1, first: 0, count, padding: 0 };
        f.gpu.queue.write_buffer(&self.counting, 0, bytemuck::bytes_of(&counting));
        f.run(&self.draw_counts).bind("counting", &self.counting).bind("counts", counts).per_pixel();
        f.show_counts(id);
    }

    /// A buffer for a count a texel, held while it is looked at.
    fn counts(&mut self, gpu: &Gpu, resolution: u32) -> wgpu::Buffer {
        let size = resolution as u64 * resolution as u64 * 4;
        if self.counts.as_ref().is_none_or(|b| b.size() != size) {
            self.counts = Some(storage(gpu, "view samples before the warp", size));
        }
        self.counts.clone().unwrap_or_else(|| storage(gpu, "view samples before the warp", size))
    }

    /// Room for the ray of each texel of such a map.
    fn prepare_rays(&mut self, gpu: &Gpu, resolution: u32) -> Result<()> {
        let size = (resolution as u64 * resolution as u64 * 8).max(16);
        if self.rays.size() != size {
            let limits = gpu.device.limits();
            ensure!(
                size <= limits.max_storage_buffer_binding_size.min(limits.max_buffer_size),
                "{} binds too little memory at once for the rays of a {resolution}² map; choose raster = linear or a smaller \
                 resolution",
                gpu.info.name
            );
            self.rays = storage(gpu, "texels' rays", size);
        }
        Ok(())
    }

    /// Makes the caster pass anew if its pipeline's state changed.
    fn prepare_casters(&mut self, gpu: &Gpu, p: &MapParams, raster: &str) -> Result<()> {
        let (format, exact) = (format(p), raster == "exact");
        let state = [p.cull.clone(), raster.to_string()];
        if self.casters.as_ref().is_some_and(|(s, f, _)| (s, f) == (&state, &format)) {
            return Ok(());
        }
        let raster = Raster {
            vertex: if exact { "box_caster" } else { "piece_caster" },
            fragment: Some(match raster {
                "exact" => "box",
                "subdivide" => "piece",
                _ => "linear_piece",
            }),
            depth: Some(wgpu::DepthStencilState {
                format,
                depth_write_enabled: Some(true),
                depth_compare: Some(wgpu::CompareFunction::Greater),
                stencil: Default::default(),
                bias: Default::default(),
            }),
            // Boxes have no faces of their own: fragments tell the piece's.
            cull: match (exact, p.cull.as_str()) {
                (false, "front") => Some(wgpu::Face::Front),
                (false, "back") => Some(wgpu::Face::Back),
                _ => None,
            },
            ..Raster::default()
        };
        let pass = Pass::render(gpu, "shadow map", self.file, raster, self.groups)?;
        self.casters = Some((state, format, pass));
        Ok(())
    }
}

/// A storage buffer of so many bytes that can be copied both ways.
pub fn storage(gpu: &Gpu, label: &str, size: u64) -> wgpu::Buffer {
    gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size: size.max(16).next_multiple_of(4),
        usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}

impl Pieces {
    /// The buffers for a scene of that many triangles, made anew if those held are others.
    fn hold<'a>(held: &'a mut Option<Pieces>, gpu: &Gpu, triangles: u32) -> &'a Pieces {
        if held.as_ref().is_some_and(|p| p.triangles != triangles) {
            *held = None;
        }
        held.get_or_insert_with(|| {
            let limits = gpu.device.limits();
            let binding = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
            // Room for each triangle twice, and for what a few large ones become.
            let most_drawn = (2 * triangles as u64 + (1 << 18)).min(binding / PIECE) as u32;
            let most = (triangles as u64 + (1 << 16)).min(binding / PIECE / 2) as u32;
            let level = |number| {
                let level = Level { number, last: (number == LEVELS) as u32, most, most_drawn };
                gpu.buffer("level", bytemuck::bytes_of(&level), wgpu::BufferUsages::UNIFORM)
            };
            Pieces {
                triangles,
                levels: (0..=LEVELS).map(level).collect(),
                work: storage(gpu, "pieces to split", 2 * most as u64 * PIECE),
                pieces: storage(gpu, "pieces", most_drawn as u64 * PIECE),
                boxes: storage(gpu, "pieces' boxes", most_drawn as u64 * BOX),
                folds: storage(gpu, "folded triangles", triangles.div_ceil(32) as u64 * 4),
            }
        })
    }
}
