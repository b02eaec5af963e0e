//! Cascades: several shadow maps that share the camera's depth range, one after the other.

use super::casters::{Casters, DRAW, Target, Triangles};
use super::filter::Reach;
use super::peel::{Depths, Held};
use super::{MOST, Maps, light_views, margin};
use crate::frame::Frame;
use crate::gpu::{Buffer, Gpu, Pass};
use crate::light::LightView;
use crate::view::{self, Drawn, Legend, View, map};
use anyhow::{Context, Result};
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
        }
    }
}

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
}

/// The views that every technique with cascades has.
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

/// How the cascades of a frame are fitted, as `Fitting` in `shaders/map/splits.wgsl`.
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
    layers: Held,
    /// The light's view of the whole scene.
    pub whole: Buffer,
    /// Where the cascades meet: nine floats, metres along the camera's axis.
    pub splits: Buffer,
    pub fitting: Buffer,
    pub light_views: Buffer,
    /// Boxes of this frame and the last, as `Box` in `shaders/map/cascades.wgsl`.
    pub boxes: Buffer,
    extents: Buffer,
    draws: Buffer,
    /// The triangles that each cascade draws; None: every one draws all.
    indices: Option<Buffer>,
    /// The light view of each cascade alone, for drawing.
    single: Vec<Buffer>,
    /// The cascades' boxes are found from their samples.
    narrow: bool,
    gather: Pass,
    mark: Pass,
    fit: Pass,
    cull: Pass,
    casters: Casters,
}

/// Largest index buffer for culled triangles, bytes; above it every cascade draws every triangle.
const INDEX_BYTES: u64 = 1 << 30;
/// Threads of a row of `cull`, as in WGSL.
const ROW: u32 = 2_097_152;

impl Cascades {
    pub fn new(gpu: &Gpu) -> Result<Cascades> {
        use wgpu::BufferUsages as Use;
        let zero = |label, size: usize, usage| gpu.buffer(label, &vec![0; size], usage);
        let pass = |name, entry| Pass::compute(gpu, name, "map/cascades.wgsl", entry, &[]);
        Ok(Cascades {
            layers: Held::default(),
            whole: zero("whole light view", size_of::<LightView>(), Use::UNIFORM),
            splits: zero("splits", 48, Use::UNIFORM | Use::STORAGE | Use::COPY_SRC),
            fitting: zero("fitting", size_of::<Fitting>(), Use::UNIFORM),
            light_views: light_views(gpu, "light views"),
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
            casters: Casters::named(["shadow maps", "shadow maps (masked)"]),
        })
    }

    /// The light's view of the whole scene with maps of this size, also written for the GPU. `reach`: how far the filter's
    /// taps lie from the receiver.
    pub fn whole(&self, f: &Frame, p: &CascadeParams, reach: Reach) -> Result<LightView> {
        let view = LightView::whole(&f.light, f.scene.bounds, p.resolution, margin(f) + reach.texels);
        let view = view.with_context(|| format!("a {} light has no cascades", f.light.kind()))?;
        f.gpu.queue.write_buffer(&self.whole, 0, bytemuck::bytes_of(&view));
        Ok(view)
    }

    /// Writes how the cascades are fitted. Before any pass that reads `fitting`.
    pub fn prepare(&mut self, f: &mut Frame, p: &CascadeParams, reach: Reach, boxes: &Boxes) {
        let triangles = f.scene.triangle_count;
        let bytes = triangles as u64 * 12 * p.cascades as u64;
        let culled = bytes <= INDEX_BYTES.min(f.gpu.most_bound());
        if !culled {
            self.indices = None;
        } else if self.indices.as_ref().is_none_or(|b| b.size() != bytes.max(16)) {
            use wgpu::BufferUsages as Use;
            self.indices = Some(f.gpu.room("cascades' triangles", bytes, Use::STORAGE | Use::INDEX));
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
            margin: margin(f) + reach.texels + dilate,
            reach: reach.metres,
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
    pub fn draw(&mut self, f: &mut Frame, p: &CascadeParams) -> Result<Maps> {
        let sides = p.sides();
        let depths = Depths::hold(&mut self.layers, f, &sides)?;
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
        let size = size_of::<LightView>() as u64;
        for (i, side) in sides.iter().enumerate() {
            f.copy(&self.light_views, i as u64 * size, &self.single[i], size);
            let indices = self.indices.as_ref().unwrap_or(&scene.indices);
            let triangles = Triangles::Listed { indices, draws: &self.draws, at: 2 * i as u64 * DRAW };
            self.casters.draw_depths(f, (&depths, i), Target::whole(*side, &self.single[i], false), &triangles)?;
        }
        let bound: Vec<_> = vec![("fitting", (&self.fitting).into()), ("splits", (&self.splits).into())];
        f.keep_table("splits", &self.splits);
        let outlined = [("light_views", (&self.light_views).into()), ("cascade_draws", (&self.draws).into())];
        f.outline_cascades(p.cascades, bound.iter().cloned().chain(outlined).collect());
        f.tell_splits(&self.splits, p.cascades);
        Ok(Maps { layers: depths.looked_up(), light_views: self.light_views.clone(), sides, bound })
    }
}
