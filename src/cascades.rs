//! Cascades: several shadow maps that share the camera's depth range, one after the other.

use crate::frame::{ANALYSIS, Frame, Maps};
use crate::gpu::{Gpu, Pass, Raster};
use crate::light::LightView;
use crate::scene::geometry::Vertex;
use crate::shadow_map::caster;
use crate::view::{self, Drawn, Legend, View, map};
use anyhow::{Context, Result, ensure};
use bytemuck::{Pod, Zeroable};

crate::params! {
    /// How cascades are made and compared.
    pub struct CascadeParams {
        "Cascades" {
            /// How many maps share the view.
            cascades: int(4, 1..=8, "maps"),
            /// Side of each cascade's square map, or of the first one's where others have sides of their own.
            resolution: int(1024, 64..=8192, "texels"),
            /// Side of the second cascade's map; 0: as the one before.
            resolution_2: int(0, 0..=8192, "texels", 64) if cascades > 1,
            /// Side of the third cascade's map; 0: as the one before.
            resolution_3: int(0, 0..=8192, "texels", 64) if cascades > 2,
            /// Side of the fourth cascade's map; 0: as the one before.
            resolution_4: int(0, 0..=8192, "texels", 64) if cascades > 3,
            /// Side of the fifth cascade's map; 0: as the one before.
            resolution_5: int(0, 0..=8192, "texels", 64) if cascades > 4,
            /// Side of the sixth cascade's map; 0: as the one before.
            resolution_6: int(0, 0..=8192, "texels", 64) if cascades > 5,
            /// Side of the seventh cascade's map; 0: as the one before.
            resolution_7: int(0, 0..=8192, "texels", 64) if cascades > 6,
            /// Side of the eighth cascade's map; 0: as the one before.
            resolution_8: int(0, 0..=8192, "texels", 64) if cascades > 7,
            /// The last part of each cascade's depth, in which the next one is blended in: the seam becomes a gradual change.
            blend: float(0.1, 0.0..=0.3, "× depth") if cascades > 1,
            /// Which faces are left out of the maps, as seen from the light.
            cull: choice("none", ["none", "front", "back"]),
        }
        "Filter" {
            /// Side of the square over which comparisons are averaged, the same in every cascade; 0: a single comparison.
            blur: float(0.0, 0.0..=1.0, "m"),
            /// Comparisons along each side of that square.
            taps: int(3, 1..=9, "taps") if blur > 0.0,
        }
        "Bias" {
            /// Depth added before the comparison, along the light's axis. Too little: acne. Too much: shadows detach (peter-panning).
            bias: float(0.002, 0.0..=100.0, "m", 0.1 of view),
            /// Depth added in proportion to the receiver's slope and the size of its cascade's texel.
            slope_bias: float(0.75, 0.0..=8.0, "× texel"),
            /// The largest tangent of the slope that the slope-scaled bias follows.
            slope_limit: float(10.0, 1.0..=20.0, "") if slope_bias > 0.0 or blur > 0.0,
            /// Moves the receiver along its normal before the look-up, by texels of its cascade.
            normal_offset: float(0.0, 0.0..=4.0, "texels"),
        }
    }
}

/// Most cascades.
pub const MOST: usize = 8;

impl CascadeParams {
    /// Side of each cascade's map, texels.
    pub fn sides(&self) -> Vec<u32> {
        let others = [
            self.resolution_2,
            self.resolution_3,
            self.resolution_4,
            self.resolution_5,
            self.resolution_6,
            self.resolution_7,
            self.resolution_8,
        ];
        let own = [&[self.resolution][..], &others].concat().into_iter().take(self.cascades as usize);
        own.scan(self.resolution, |last, side| {
            *last = if side > 0 { side } else { *last };
            Some(*last)
        })
        .collect()
    }

    /// Side of the largest map.
    fn largest(&self) -> u32 {
        self.sides().into_iter().max().unwrap_or(self.resolution)
    }
}

/// The views that every technique with cascades has, in the order of `inspect_cascades` in WGSL.
pub const MAPS: [View; 6] = [
    map(
        "cascades",
        "Cascades",
        "Each cascade in a colour of its own: which of the maps a pixel looks up.",
        Drawn::Labels(Legend::Cascades),
    ),
    map(
        "shadow-maps",
        "Shadow maps",
        "All maps side by side, framed in their cascades' colours: near the light bright, far dark.",
        Drawn::Labels(Legend::Cascades),
    ),
    map(
        "side",
        "Side view",
        "The upright plane through the camera's axis, the camera at the left. Its frustum in the cascades' colours, the \
         split planes white, and as outlines what each cascade's map covers of this plane. Where outlines overlap, the \
         same casters are drawn twice.",
        Drawn::Labels(Legend::Side),
    ),
    map(
        "seams",
        "Seams",
        "Where two cascades are blended: dark, all of the first; bright, all of the second.",
        view::ramp("share of the second cascade", "", [0.0, 1.0]),
    ),
    view::aliasing(
        "texels",
        "Texel grid",
        "Each map texel's footprint on the scene, as a chequerboard. Large squares: blocky shadows.",
        Drawn::Cells,
    ),
    map(
        "bias",
        "Bias",
        "How far the comparison is moved along the light's axis at each pixel, all biases together, in texels of its cascade.",
        view::ramp("bias", "texels", [0.0, 4.0]),
    ),
];

/// The views of the analysis, which follow them.
pub const ANALYSED: &[View] = crate::techniques::MAPS.split_at(3).1;

/// How the cascades of a frame are fitted, as `Fitting` in `shaders/lib/cascades.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Fitting {
    pub count: u32,
    pub blend: f32,
    pub narrow: u32,
    pub margin: f32,
    pub reach: f32,
    pub least: f32,
    pub smoothing: f32,
    pub opaque: u32,
    pub triangles: u32,
    pub culled: u32,
    pub padding: [u32; 2],
    pub sides: [[u32; 4]; 2],
}

/// Where the cascades' boxes come from.
pub enum Boxes {
    /// These light views.
    Given(Vec<LightView>),
    /// The smallest that hold each cascade's view samples that face the light, found on the GPU.
    Samples {
        /// Texels to spare at each border, beside the filter's reach.
        dilate: f32,
        /// Smallest side, metres.
        least: f32,
        /// Share of the last frame's box that stays where it is larger.
        smoothing: f32,
    },
}

/// The maps, and what they are drawn and looked up with.
pub struct Cascades {
    maps: Option<Layers>,
    /// The light's view of the whole scene.
    pub whole: wgpu::Buffer,
    /// Where the cascades meet: nine floats, metres along the camera's axis.
    pub splits: wgpu::Buffer,
    pub fitting: wgpu::Buffer,
    pub light_views: wgpu::Buffer,
    /// Boxes of this frame and the last, as `Box` in `shaders/cascades.wgsl`.
    pub boxes: wgpu::Buffer,
    extents: wgpu::Buffer,
    draws: wgpu::Buffer,
    /// The triangles that each cascade draws; None: every one draws all.
    indices: Option<wgpu::Buffer>,
    /// The light view of each cascade alone, for drawing.
    single: Vec<wgpu::Buffer>,
    /// The cascades' boxes are found from their samples.
    narrow: bool,
    gather: Pass,
    mark: Pass,
    fit: Pass,
    cull: Pass,
    analyse: Pass,
    casters: Option<(String, [Pass; 2])>,
}

/// A depth texture with a layer for each cascade, all as large as the largest map; smaller ones lie in the upper left
/// corners of theirs.
struct Layers {
    texture: wgpu::Texture,
    all: wgpu::TextureView,
    each: Vec<wgpu::TextureView>,
}

/// Largest index buffer for culled triangles, bytes; above it every cascade draws every triangle.
const INDEX_BYTES: u64 = 1 << 30;
/// Threads of a row of `cull`, as in WGSL.
const ROW: u32 = 2_097_152;

impl Cascades {
    pub fn new(gpu: &Gpu) -> Result<Cascades> {
        use wgpu::BufferUsages as Use;
        let zero = |label, size: usize, usage| gpu.buffer(label, &vec![0; size], usage);
        let pass = |name, entry| Pass::compute(gpu, name, "cascades.wgsl", entry, &[]);
        Ok(Cascades {
            maps: None,
            whole: zero("whole light view", size_of::<LightView>(), Use::UNIFORM),
            splits: zero("splits", 48, Use::UNIFORM | Use::STORAGE | Use::COPY_SRC),
            fitting: zero("fitting", size_of::<Fitting>(), Use::UNIFORM),
            light_views: zero(
                "light views",
                MOST * size_of::<LightView>(),
                Use::UNIFORM | Use::STORAGE | Use::COPY_SRC,
            ),
            boxes: zero("cascades' boxes", MOST * 32, Use::STORAGE | Use::COPY_SRC),
            extents: zero("cascades' extents", MOST * 32, Use::STORAGE),
            draws: zero("cascades' draws", MOST * 40, Use::STORAGE | Use::INDIRECT | Use::COPY_SRC),
            indices: None,
            single: (0..MOST).map(|_| zero("light view", size_of::<LightView>(), Use::UNIFORM)).collect(),
            narrow: false,
            gather: pass("fit: samples", "gather")?,
            mark: pass("fit: samples", "mark")?,
            fit: pass("fit: boxes", "fit")?,
            cull: pass("caster culling", "cull")?,
            analyse: Pass::compute(gpu, ANALYSIS, "analyse_cascades.wgsl", "analyse", &[])?,
            casters: None,
        })
    }

    /// The light's view of the whole scene with maps of this size, also written for the GPU.
    pub fn whole(&self, f: &Frame, p: &CascadeParams) -> Result<LightView> {
        let view = LightView::whole(&f.light, f.scene.bounds, p.resolution, self.margin(p));
        let view = view.with_context(|| format!("a {} light has no cascades", f.light.kind()))?;
        f.gpu.queue.write_buffer(&self.whole, 0, bytemuck::bytes_of(&view));
        Ok(view)
    }

    /// Texels that look-ups may lie outside a receiver's own.
    fn margin(&self, p: &CascadeParams) -> f32 {
        1.0 + p.normal_offset
    }

    /// Writes how the cascades are fitted. Before any pass that reads `fitting`.
    pub fn prepare(&mut self, f: &mut Frame, p: &CascadeParams, boxes: &Boxes) {
        let triangles = f.scene.triangle_count;
        let bytes = triangles as u64 * 12 * p.cascades as u64;
        let culled = bytes <= INDEX_BYTES.min(f.gpu.most_bound());
        if !culled {
            self.indices = None;
        } else if self.indices.as_ref().is_none_or(|b| b.size() != bytes.max(16)) {
            self.indices = Some(f.gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("cascades' triangles"),
                size: bytes.max(16),
                usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::INDEX,
                mapped_at_creation: false,
            }));
        }
        let (dilate, least, smoothing) = match boxes {
            Boxes::Given(_) => (0.0, 0.0, 0.0),
            Boxes::Samples { dilate, least, smoothing } => (*dilate, *least, *smoothing),
        };
        let mut sides = [0; MOST];
        sides.iter_mut().zip(p.sides()).for_each(|(to, side)| *to = side);
        self.narrow = matches!(boxes, Boxes::Samples { .. });
        let fitting = Fitting {
            count: p.cascades,
            blend: p.blend,
            narrow: self.narrow as u32,
            margin: self.margin(p) + dilate,
            reach: p.blur / 2.0,
            least,
            smoothing,
            opaque: f.scene.opaque_count,
            triangles,
            culled: culled as u32,
            padding: [0; 2],
            sides: bytemuck::cast(sides),
        };
        f.gpu.queue.write_buffer(&self.fitting, 0, bytemuck::bytes_of(&fitting));
        if let Boxes::Given(views) = boxes {
            f.gpu.queue.write_buffer(&self.light_views, 0, bytemuck::cast_slice(views));
        }
    }

    /// Fits the cascades and draws the casters' depth. `splits` must be filled and `prepare` called.
    ///
    /// # Errors
    /// Maps that the adapter cannot hold.
    pub fn draw(&mut self, f: &mut Frame, p: &CascadeParams) -> Result<wgpu::TextureView> {
        let limits = f.gpu.device.limits();
        ensure!(
            p.cascades <= limits.max_texture_array_layers && p.largest() <= limits.max_texture_dimension_2d,
            "{} maps of {}² texels are more than {} takes",
            p.cascades,
            p.largest(),
            f.gpu.info.name
        );
        let [w, h] = f.size;
        f.clear(&self.extents);
        f.run(if self.narrow { &self.gather } else { &self.mark })
            .bind("light_view", &self.whole)
            .bind("fitting", &self.fitting)
            .bind("splits", &self.splits)
            .bind("extents", &self.extents)
            .dispatch(w.div_ceil(64), h.div_ceil(64), 1);
        f.run(&self.fit)
            .bind("light_view", &self.whole)
            .bind("fitting", &self.fitting)
            .bind("extents", &self.extents)
            .bind("boxes", &self.boxes)
            .bind("fitted", &self.light_views)
            .bind("draws", &self.draws)
            .dispatch(1, 1, 1);
        let scene = f.scene;
        let groups = f.scene.triangle_count.min(ROW).div_ceil(64);
        let rows = f.scene.triangle_count.div_ceil(ROW);
        if let Some(indices) = &self.indices {
            f.run(&self.cull)
                .bind("fitting", &self.fitting)
                .bind("light_views", &self.light_views)
                .bind("draws", &self.draws)
                .bind("corners_of", &scene.indices)
                .bind("indices", indices)
                .dispatch(groups, rows, 1);
        }
        self.prepare_casters(f.gpu, p)?;
        let maps = Layers::hold(&mut self.maps, f.gpu, p);
        if let Some((_, [opaque, masked])) = &self.casters {
            let size = size_of::<LightView>() as u64;
            for ((i, layer), side) in maps.each.iter().enumerate().zip(p.sides()) {
                f.copy(&self.light_views, i as u64 * size, &self.single[i], size);
                let from = self.indices.as_ref().unwrap_or(&scene.indices);
                let issue = |pass: &mut wgpu::RenderPass, which: u64| {
                    pass.set_viewport(0.0, 0.0, side as f32, side as f32, 0.0, 1.0);
                    scene.set_casters(pass, from);
                    pass.draw_indexed_indirect(&self.draws, (2 * i as u64 + which) * 20);
                };
                let depth = Some((layer, 0.0));
                f.run(opaque).bind("light_view", &self.single[i]).draw(&[], depth, true, |p| issue(p, 0));
                if scene.opaque_count < scene.triangle_count {
                    f.run(masked).bind("light_view", &self.single[i]).draw(&[], depth, false, |p| issue(p, 1));
                }
            }
        }
        let (map, each) = (maps.all.clone(), maps.each.clone());
        let held = crate::gpu::bytes(&maps.texture);
        f.held(held + self.indices.as_ref().map_or(0, |b| b.size()) + self.small());
        let layers = Maps::of(&p.sides());
        let bound = [
            ("fitting", (&self.fitting).into()),
            ("splits", (&self.splits).into()),
            ("light_views", (&self.light_views).into()),
        ];
        f.analyse(&self.analyse, layers, &bound);
        f.keep_table("light_views", &self.light_views);
        f.keep_table("splits", &self.splits);
        f.outline_cascades(p.cascades, bound.into_iter().chain([("cascade_draws", (&self.draws).into())]).collect());
        f.tell_splits(&self.splits, p.cascades);
        f.offer_maps(&each, &self.light_views, &p.sides());
        Ok(map)
    }

    /// Bytes of the buffers whose size does not change.
    fn small(&self) -> u64 {
        let buffers =
            [&self.whole, &self.splits, &self.fitting, &self.light_views, &self.boxes, &self.extents, &self.draws];
        buffers.into_iter().chain(&self.single).map(|b| b.size()).sum()
    }

    /// Makes the caster passes anew if their pipelines' state changed.
    fn prepare_casters(&mut self, gpu: &Gpu, p: &CascadeParams) -> Result<()> {
        if self.casters.as_ref().is_some_and(|(cull, _)| *cull == p.cull) {
            return Ok(());
        }
        let unclipped_depth = gpu.features.contains(wgpu::Features::DEPTH_CLIP_CONTROL);
        let pass = |name, fragment: Option<&str>| {
            let raster = Raster {
                // Casters between the light and a cascade's box lie flat on its near plane (pancaking).
                vertex: caster(unclipped_depth, fragment.is_some()),
                unclipped_depth,
                fragment,
                depth: Raster::nearest(FORMAT),
                cull: Raster::culled(&p.cull),
                vertices: Some(Vertex::LAYOUT),
                ..Raster::default()
            };
            Pass::render(gpu, name, "lib/depth.wgsl", raster, &[])
        };
        self.casters =
            Some((p.cull.clone(), [pass("shadow maps", None)?, pass("shadow maps (masked)", Some("masked"))?]));
        Ok(())
    }
}

const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

impl Layers {
    /// The maps of these parameters, made anew if those held are others.
    fn hold<'a>(held: &'a mut Option<Layers>, gpu: &Gpu, p: &CascadeParams) -> &'a Layers {
        let side = p.largest();
        let same = |l: &Layers| l.texture.width() == side && l.each.len() == p.cascades as usize;
        if !held.as_ref().is_some_and(same) {
            *held = None;
        }
        held.get_or_insert_with(|| {
            let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
                label: Some("shadow maps"),
                size: wgpu::Extent3d { width: side, height: side, depth_or_array_layers: p.cascades },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: FORMAT,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING,
                view_formats: &[],
            });
            let array = Some(wgpu::TextureViewDimension::D2Array);
            let layer = |i| wgpu::TextureViewDescriptor {
                dimension: Some(wgpu::TextureViewDimension::D2),
                base_array_layer: i,
                array_layer_count: Some(1),
                ..Default::default()
            };
            Layers {
                all: texture.create_view(&wgpu::TextureViewDescriptor { dimension: array, ..Default::default() }),
                each: (0..p.cascades).map(|i| texture.create_view(&layer(i))).collect(),
                texture,
            }
        })
    }
}
