//! Depth textures with a layer for each map.

use crate::gpu::{self, Gpu, Texture};
use anyhow::{Result, ensure};
use wgpu::TextureUsages as Use;

/// A depth texture, all of whose layers are as large as the largest map; smaller maps lie in the upper left corners of theirs.
#[derive(Clone)]
pub struct Layers {
    pub texture: Texture,
    /// All of them, as an array.
    pub all: wgpu::TextureView,
    pub each: Vec<wgpu::TextureView>,
}

impl Layers {
    /// The layers in `held`, made anew if their number, side or format is another.
    ///
    /// # Errors
    /// More or larger layers than the adapter takes.
    pub fn hold(held: &mut Option<Layers>, gpu: &Gpu, sides: &[u32], format: wgpu::TextureFormat) -> Result<Layers> {
        let (side, count) = (sides.iter().copied().max().unwrap_or(1), sides.len() as u32);
        let limits = gpu.device.limits();
        ensure!(
            count <= limits.max_texture_array_layers && side <= limits.max_texture_dimension_2d,
            "{count} {} of {side}² texels {} more than {} takes",
            if count == 1 { "map" } else { "maps" },
            if count == 1 { "is" } else { "are" },
            gpu.info.name
        );
        let same = |l: &Layers| {
            let t = &l.texture;
            (t.width(), t.depth_or_array_layers(), t.format()) == (side, count, format)
        };
        if let Some(same) = held.as_ref().filter(|l| same(l)) {
            return Ok(same.clone());
        }
        // Its memory first.
        *held = None;
        Ok(held.insert(Layers::new(gpu, [side, side, count], format)).clone())
    }

    /// `size`: width, height and number.
    fn new(gpu: &Gpu, size: [u32; 3], format: wgpu::TextureFormat) -> Layers {
        let texture = gpu::texture(gpu, "shadow maps", size, 1, format, Use::RENDER_ATTACHMENT | Use::TEXTURE_BINDING);
        let layer = |i| wgpu::TextureViewDescriptor {
            dimension: Some(wgpu::TextureViewDimension::D2),
            base_array_layer: i,
            array_layer_count: Some(1),
            ..Default::default()
        };
        let array = Some(wgpu::TextureViewDimension::D2Array);
        Layers {
            all: texture.create_view(&wgpu::TextureViewDescriptor { dimension: array, ..Default::default() }),
            each: (0..size[2]).map(|i| texture.create_view(&layer(i))).collect(),
            texture,
        }
    }
}
