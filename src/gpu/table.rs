//! Records that shaders read by number from a texture.

use super::{Gpu, Texture, texture};

/// Most texels in a row: a power of two, as `table_texel` in `shaders/lib/scene.wgsl` wants it.
const WIDTH: usize = 4096;
/// Bytes of a texel: four words.
const TEXEL: usize = 16;

/// Texels of four words that shaders read by number. Software adapters read a texture far faster than a storage buffer,
/// and all adapters allow more of it to be bound.
pub struct Table {
    label: &'static str,
    texture: Texture,
    view: wgpu::TextureView,
}

impl Table {
    /// A table of the given contents, whole texels.
    pub fn new(gpu: &Gpu, label: &'static str, contents: &[u8]) -> Table {
        let width = Table::width(gpu);
        // Drivers round the height up: what is told is what is held.
        let height = contents.len().div_ceil(width * TEXEL).max(1).next_multiple_of(4) as u32;
        let usage = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST;
        let texture = texture(gpu, label, [width as u32, height, 1], 1, wgpu::TextureFormat::Rgba32Uint, usage);
        let view = texture.create_view(&Default::default());
        let mut table = Table { label, texture, view };
        table.write(gpu, contents);
        table
    }

    /// Replaces the contents; the texture is made anew if it is too small.
    pub fn write(&mut self, gpu: &Gpu, contents: &[u8]) {
        let row = self.texture.width() as usize * TEXEL;
        if contents.len() > self.texture.height() as usize * row {
            *self = Table::new(gpu, self.label, contents);
            return;
        }
        // Whole rows, then what is left over.
        let (rows, rest) = contents.split_at(contents.len() / row * row);
        for (y, part, width) in [(0, rows, WIDTH), (rows.len() / row, rest, rest.len() / TEXEL)] {
            if !part.is_empty() {
                gpu.queue.write_texture(
                    wgpu::TexelCopyTextureInfo {
                        origin: wgpu::Origin3d { x: 0, y: y as u32, z: 0 },
                        ..self.texture.as_image_copy()
                    },
                    part,
                    wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row as u32), rows_per_image: None },
                    wgpu::Extent3d {
                        width: width as u32,
                        height: part.len().div_ceil(row) as u32,
                        depth_or_array_layers: 1,
                    },
                );
            }
        }
    }

    /// What shaders bind.
    pub fn view(&self) -> &wgpu::TextureView {
        &self.view
    }

    /// Texels in a row on this adapter.
    fn width(gpu: &Gpu) -> usize {
        1 << gpu.shaders.table_bits
    }

    /// The logarithm of that, base 2, on an adapter whose textures are so wide at most.
    pub(super) fn bits(limits: &wgpu::Limits) -> u32 {
        WIDTH.min(limits.max_texture_dimension_2d as usize).ilog2()
    }

    /// Bytes that a table can hold on this adapter.
    pub fn most(gpu: &Gpu) -> u64 {
        gpu.device.limits().max_texture_dimension_2d as u64 * (Table::width(gpu) * TEXEL) as u64
    }
}
