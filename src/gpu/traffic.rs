//! Bytes that passes move between memory and processor.

use super::pass::Resource;
use super::shader::Binding;

/// What passes move at the least, in bytes: of every resource that they bind an element a thread, but no more than it holds, and of what
/// they clear and draw into each texel once. A cache without bounds would leave that much; what is drawn over what is there already, and
/// the vertices of a draw, are not counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Traffic {
    /// Threads of compute passes.
    pub threads: u64,
    pub read: u64,
    pub written: u64,
}

impl Traffic {
    /// Of one compute pass.
    pub(super) fn of<'a>(threads: u64, bound: impl Iterator<Item = (&'a Binding, &'a Resource)>) -> Traffic {
        let mut traffic = Traffic { threads, ..Traffic::default() };
        for (binding, resource) in bound {
            let (element, all) = match resource {
                Resource::Buffer(buffer) => (binding.element, buffer.size()),
                Resource::Texture(view) => (texel(view.texture()), size(view.texture())),
                Resource::Sampler(_) => continue,
            };
            let bytes = all.min(threads.saturating_mul(element));
            let (reads, writes) = match binding.entry.ty {
                wgpu::BindingType::Buffer { ty: wgpu::BufferBindingType::Storage { read_only }, .. } => (true, !read_only),
                wgpu::BindingType::StorageTexture { access, .. } => {
                    (access != wgpu::StorageTextureAccess::WriteOnly, access != wgpu::StorageTextureAccess::ReadOnly)
                }
                wgpu::BindingType::Texture { .. } => (true, false),
                // Of a light or a camera: nobody waits for these few bytes.
                _ => (false, false),
            };
            traffic.read += if reads { bytes } else { 0 };
            traffic.written += if writes { bytes } else { 0 };
        }
        traffic
    }

    /// Of a draw that clears the views first.
    pub(super) fn cleared<'a>(views: impl Iterator<Item = &'a wgpu::TextureView>) -> Traffic {
        let layer = |view: &wgpu::TextureView| {
            let texture = view.texture();
            u64::from(texture.width()) * u64::from(texture.height()) * texel(texture)
        };
        Traffic { written: views.map(layer).sum(), ..Traffic::default() }
    }

    /// Both together.
    pub fn and(self, other: Traffic) -> Traffic {
        Traffic {
            threads: self.threads + other.threads,
            read: self.read + other.read,
            written: self.written + other.written,
        }
    }

    pub fn bytes(self) -> u64 {
        self.read + self.written
    }
}

/// Bytes of a texel. Formats of depth and stencil keep theirs to themselves: 4, and 1 for a stencil.
fn texel(texture: &wgpu::Texture) -> u64 {
    let format = texture.format();
    let stencil = u64::from(format.has_stencil_aspect());
    format.block_copy_size(None).map_or(4 + stencil, u64::from)
}

/// Bytes of the largest level of a texture, all its layers.
fn size(texture: &wgpu::Texture) -> u64 {
    let size = texture.size();
    u64::from(size.width) * u64::from(size.height) * u64::from(size.depth_or_array_layers) * texel(texture)
}
