//! Summed-area tables of moments of depth (`shaders/map/sums.wgsl`).

use super::busy::Dispatches;
use super::prefilter::Moments;
use super::{Maps, uniform_of};
use crate::frame::Frame;
use crate::gpu::{self, Buffer, Gpu, Pass, Resource, Texture, hold};
use crate::params::Group;
use anyhow::Result;
use bytemuck::{Pod, Zeroable};
use wgpu::TextureUsages as Use;

/// As `Summed` in WGSL.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
struct Summed {
    layer: u32,
    side: u32,
    down: u32,
    padding: u32,
}

/// The passes and textures of one filter.
pub struct Sums {
    across: Pass,
    down: Pass,
    textures: Option<([u32; 2], Textures)>,
    uniforms: Vec<(Summed, Buffer)>,
    dispatches: Dispatches,
}

struct Textures {
    all: wgpu::TextureView,
    each: Vec<wgpu::TextureView>,
    /// One layer on its way.
    scratch: wgpu::TextureView,
    /// Whose views these are: on the account as long as they are held.
    _counted: [Texture; 2],
}

impl Sums {
    /// From a shader that includes `map/sums.wgsl`.
    ///
    /// # Errors
    /// Passes that cannot be made.
    pub fn new(gpu: &Gpu, file: &str, groups: &[Group]) -> Result<Sums> {
        Ok(Sums {
            across: Pass::compute(gpu, "summed-area table", file, "sum_moments", groups)?,
            down: Pass::compute(gpu, "summed-area table", file, "sum_up", groups)?,
            textures: None,
            uniforms: Vec::new(),
            dispatches: Dispatches::default(),
        })
    }

    /// Sums maps up; what the look-up binds, by name.
    ///
    /// # Errors
    /// Textures that the adapter cannot hold.
    pub fn run(&mut self, f: &mut Frame, maps: &Maps, of: Moments) -> Result<Vec<(&'static str, Resource)>> {
        let (gpu, size) = (f.gpu, [maps.layers.texture.width(), maps.sides.len() as u32]);
        let passes = [&self.across, &self.down];
        let textures = hold(&mut self.textures, size, |[side, layers]| {
            passes.iter().for_each(|pass| pass.forget());
            let usage = Use::STORAGE_BINDING | Use::TEXTURE_BINDING;
            let texture = |label, layers| gpu::texture(gpu, label, [*side, *side, layers], 1, of.format, usage);
            let (sums, way) = (texture("summed-area tables", *layers), texture("sums on their way", 1));
            let view = |dimension, layer, count| {
                sums.create_view(&wgpu::TextureViewDescriptor {
                    dimension: Some(dimension),
                    base_array_layer: layer,
                    array_layer_count: Some(count),
                    ..Default::default()
                })
            };
            Ok(Textures {
                all: view(wgpu::TextureViewDimension::D2Array, 0, *layers),
                each: (0..*layers).map(|i| view(wgpu::TextureViewDimension::D2, i, 1)).collect(),
                scratch: way.create_view(&Default::default()),
                _counted: [sums, way],
            })
        })?;
        let scratch = &textures.scratch;
        let sizes: Vec<[u32; 2]> = maps.sides.iter().map(|side| [*side, 1]).collect();
        self.dispatches.plan(f, &maps.bound, &sizes)?;
        for (layer, (depth, side)) in maps.layers.each.iter().zip(&maps.sides).enumerate() {
            let table = &textures.each[layer];
            let [across, down] = [0, 1].map(|down| {
                let words = Summed { layer: layer as u32, side: *side, down, padding: 0 };
                uniform_of(&mut self.uniforms, gpu, "summed map", words)
            });
            let run = f
                .run(&self.across)
                .bind("summed", &across)
                .bind("light_views", &maps.light_views)
                .bind("layer_depth", depth)
                .bind("moments_out", scratch);
            self.dispatches.run(run, layer, [*side, 1]);
            let run = f.run(&self.down).bind("summed", &down).bind("unsummed", scratch).bind("moments_out", table);
            self.dispatches.run(run, layer, [*side, 1]);
        }
        Ok(vec![("sums_map", (&textures.all).into())])
    }
}
