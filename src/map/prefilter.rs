//! Moments of depth, averaged over texels before they are looked up (`shaders/map/prefilter.wgsl`).

use super::busy::Dispatches;
use super::filter::Reach;
use super::{MOST, Maps, uniform_of};
use crate::frame::Frame;
use crate::gpu::{self, Buffer, Gpu, Pass, Resource, Texture, hold};
use crate::light::LightView;
use crate::params::{Group, Params, Values};
use crate::view::{self, Area, Axis, Class, Drawn, Legend, Span, View};
use anyhow::{Result, ensure};
use bytemuck::{Pod, Zeroable};
use wgpu::{TextureFormat as Format, TextureUsages as Use};

crate::params! {
    /// How a map is filtered before it is looked up.
    pub struct PrefilterParams {
        "Filter" {
            /// Radius of the Gaussian blur, cut off at two standard deviations. 0: no blur.
            blur_radius: int(3, 0..=16, "texels"),
            /// Bits of each number that the map holds. 16: half the memory; floating-point numbers, or, of moment shadow maps, whole numbers in a basis of their own.
            precision: choice("32", ["32", "16"]),
            /// Also average the map over the texels that a pixel covers.
            mipmaps: flag(true),
            /// The largest ratio of length to width of a pixel's footprint in the map.
            anisotropy: int(1, 1..=16, "") if mipmaps = true,
        }
    }
}

/// The view that every filter of moments has.
pub const CURVE: View = view::map(
    "curve",
    "Reconstruction",
    "A chart for the probed pixel: how much light the filter takes a receiver to see, over the depth that it might have, from the \
     map's near plane to its far plane. Green: how much it would see by the texels themselves. White: the receiver's own depth.",
    Drawn::Labels(Legend::Chart(
        Area::Margins,
        Axis { what: "depth of the receiver, share of the map's", span: Span::Linear(0.0, 1.0) },
        Axis { what: "visibility", span: Span::Linear(0.0, 1.0) },
        &[
            Class::label(1, "as the filter has it"),
            Class::label(2, "by the texels"),
            Class::label(0, "depths that stand for all"),
            Class::label(8, "the receiver's depth"),
        ],
    )),
);

/// How far a filtered map's texels come from: the blur, and the bilinear sample.
pub fn reach(f: &Frame) -> Reach {
    Reach { texels: PrefilterParams::read(f.values).blur_radius as f32 + 1.0, ..Reach::default() }
}

/// What a filter keeps of a depth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moments {
    /// Textures of four numbers, or fewer.
    pub planes: u32,
    pub format: Format,
}

impl Moments {
    /// Whether they are whole numbers, for summed-area tables, and not averaged.
    pub fn summed(self) -> bool {
        matches!(self.format, Format::Rg32Uint | Format::Rgba32Uint)
    }

    /// So many planes of so many numbers each, with the precision that the values ask for.
    pub fn of(values: &Values, planes: u32, numbers: u32) -> Moments {
        let format = match (PrefilterParams::read(values).precision.as_str(), numbers) {
            ("16", 1) => Format::R16Float,
            ("16", 2) => Format::Rg16Float,
            ("16", _) => Format::Rgba16Float,
            (_, 1) => Format::R32Float,
            (_, 2) => Format::Rg32Float,
            _ => Format::Rgba32Float,
        };
        Moments { planes, format }
    }
}

/// Texels that a thread of the blur makes, as in WGSL.
const STRIP: u32 = 4;

/// As `Prefiltered` in WGSL.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Prefiltered {
    pub side: u32,
    pub planes: u32,
    pub plane: u32,
    pub down: u32,
}

/// What the textures depend on: width, layers and levels, and what they hold.
type Size = ([u32; 3], Format);

/// The passes and textures of one filter.
pub struct Prefilter {
    make: Pass,
    blur: Pass,
    halve: Pass,
    textures: Option<(Size, Textures)>,
    /// For an anisotropy.
    sampler: Option<(u32, wgpu::Sampler)>,
    uniforms: Vec<(Prefiltered, Buffer)>,
    /// The light view of each layer alone.
    single: Vec<Buffer>,
    dispatches: Dispatches,
}

struct Textures {
    all: wgpu::TextureView,
    /// Level by level of each layer.
    levels: Vec<Vec<wgpu::TextureView>>,
    /// One layer on its way.
    scratch: wgpu::TextureView,
    /// Whose views these are: on the account as long as they are held.
    _counted: [Texture; 2],
}

impl Prefilter {
    /// From a shader that includes `map/prefilter.wgsl`.
    ///
    /// # Errors
    /// Passes that cannot be made.
    pub fn new(gpu: &Gpu, file: &str, groups: &[Group]) -> Result<Prefilter> {
        let pass = |name, entry| Pass::compute(gpu, name, file, entry, groups);
        let view = |_| gpu.buffer("light view", &[0; size_of::<LightView>()], wgpu::BufferUsages::UNIFORM);
        Ok(Prefilter {
            make: pass("moments", "make_moments")?,
            blur: pass("blur", "blur_moments")?,
            halve: pass("levels of detail", "halve_moments")?,
            textures: None,
            sampler: None,
            uniforms: Vec::new(),
            single: (0..MOST).map(view).collect(),
            dispatches: Dispatches::default(),
        })
    }

    /// Filters maps; what the look-up binds, by name.
    ///
    /// # Errors
    /// Textures that the adapter cannot hold.
    pub fn run(&mut self, f: &mut Frame, maps: &Maps, of: Moments) -> Result<Vec<(&'static str, Resource)>> {
        let p = PrefilterParams::read(f.values);
        let (side, layers) = (maps.layers.texture.width(), maps.sides.len() as u32 * of.planes);
        let limit = f.gpu.device.limits().max_texture_array_layers;
        ensure!(layers <= limit, "{layers} layers of moments are more than {} takes", f.gpu.info.name);
        let levels = if p.mipmaps { side.ilog2() + 1 } else { 1 };
        let gpu = f.gpu;
        let passes = [&self.make, &self.blur, &self.halve];
        let textures = hold(&mut self.textures, ([side, layers, levels], of.format), |(size, format)| {
            passes.iter().for_each(|pass| pass.forget());
            Ok(Textures::new(gpu, *size, *format))
        })?;
        let scratch = &textures.scratch;
        let view_size = size_of::<LightView>() as u64;
        let groups = |level: u32| [(side >> level).max(1).div_ceil(8); 2];
        let (whole, strips) = (side.div_ceil(8), side.div_ceil(8 * STRIP));
        // Of the blur along x and y, and of each level.
        let blurred = [[strips, whole], [whole, strips]];
        let sizes: Vec<[u32; 2]> = (0..levels).map(groups).chain(blurred).collect();
        self.dispatches.plan(f, &maps.bound, &sizes)?;
        for (layer, (depth, map_side)) in maps.layers.each.iter().zip(&maps.sides).enumerate() {
            f.copy(&maps.light_views, layer as u64 * view_size, &self.single[layer], view_size);
            for plane in 0..of.planes {
                let level = &textures.levels[layer * of.planes as usize + plane as usize];
                let uniform = |down| Prefiltered { side: *map_side, planes: of.planes, plane, down };
                let [across, down] =
                    [0, 1].map(|down| uniform_of(&mut self.uniforms, gpu, "prefiltered map", uniform(down)));
                let run = f
                    .run(&self.make)
                    .bind("layer_depth", depth)
                    .bind("light_view", &self.single[layer])
                    .bind("prefiltered", &across)
                    .bind("moments_out", &level[0]);
                self.dispatches.run(run, layer, sizes[0]);
                if p.blur_radius > 0 {
                    let ways = [(&across, &level[0], scratch), (&down, scratch, &level[0])];
                    for ((uniform, from, to), size) in ways.into_iter().zip(blurred) {
                        let run = f.run(&self.blur).bind("prefiltered", uniform);
                        let run = run.bind("unfiltered", from).bind("moments_out", to);
                        self.dispatches.run(run, layer, size);
                    }
                }
                for (pair, size) in level.windows(2).zip(&sizes[1..]) {
                    let run = f.run(&self.halve).bind("unfiltered", &pair[0]).bind("moments_out", &pair[1]);
                    self.dispatches.run(run, layer, *size);
                }
            }
        }
        let sampler = hold(&mut self.sampler, if p.mipmaps { p.anisotropy } else { 1 }, |anisotropy| {
            Ok(gpu.device.create_sampler(&wgpu::SamplerDescriptor {
                label: Some("moments"),
                mag_filter: wgpu::FilterMode::Linear,
                min_filter: wgpu::FilterMode::Linear,
                mipmap_filter: wgpu::MipmapFilterMode::Linear,
                anisotropy_clamp: *anisotropy as u16,
                ..Default::default()
            }))
        })?;
        let looked_up = uniform_of(
            &mut self.uniforms,
            gpu,
            "prefiltered map",
            Prefiltered { planes: of.planes, ..Zeroable::zeroed() },
        );
        Ok(vec![
            ("moments_map", (&textures.all).into()),
            ("moments_sampler", (&*sampler).into()),
            ("prefiltered", (&looked_up).into()),
        ])
    }
}

impl Textures {
    fn new(gpu: &Gpu, [side, layers, levels]: [u32; 3], format: Format) -> Textures {
        let texture = |label, layers, levels| {
            let usage = Use::STORAGE_BINDING | Use::TEXTURE_BINDING | Use::COPY_SRC;
            gpu::texture(gpu, label, [side, side, layers], levels, format, usage)
        };
        let moments = texture("moments", layers, levels);
        let view = |dimension, layer: Option<u32>, level: Option<u32>| {
            moments.create_view(&wgpu::TextureViewDescriptor {
                dimension: Some(dimension),
                base_array_layer: layer.unwrap_or(0),
                array_layer_count: layer.map(|_| 1),
                base_mip_level: level.unwrap_or(0),
                mip_level_count: level.map(|_| 1),
                ..Default::default()
            })
        };
        let level = |layer| {
            let one = |level| view(wgpu::TextureViewDimension::D2, Some(layer), Some(level));
            (0..levels).map(one).collect()
        };
        let (all, levels) = (view(wgpu::TextureViewDimension::D2Array, None, None), (0..layers).map(level).collect());
        let way = texture("moments on their way", 1, 1);
        Textures { all, levels, scratch: way.create_view(&Default::default()), _counted: [moments, way] }
    }
}
