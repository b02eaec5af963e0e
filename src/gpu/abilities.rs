//! What adapters can do, as far as some of what we draw asks for more than others.

use wgpu::{Features, TextureFormat as Format};

/// What a technique needs of its adapter: more than the least that wgpu knows ([`wgpu::Limits::downlevel_defaults`]), at most what
/// WebGPU guarantees ([`wgpu::Limits::default`]).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Need {
    /// So many storage buffers in one shader.
    StorageBuffers(u32),
    /// Uniform buffers of so many bytes.
    UniformBytes(u64),
}

/// What a device can do.
#[derive(Clone, Debug)]
pub struct Abilities {
    /// Its adapter's name.
    pub adapter: String,
    /// Of those that we use ([`super::WANTED`]).
    pub features: Features,
    pub limits: wgpu::Limits,
}

impl Abilities {
    /// Whether it may lack something that a technique needs.
    pub fn weak(&self) -> bool {
        let all = Features::FLOAT32_FILTERABLE
            | Features::TEXTURE_FORMAT_16BIT_NORM
            | Features::TEXTURE_ADAPTER_SPECIFIC_FORMAT_FEATURES;
        !self.features.contains(all) || !wgpu::Limits::default().check_limits(&self.limits)
    }

    /// Why a need is not met, or None if it is.
    pub fn lacks(&self, need: Need) -> Option<String> {
        let (needed, most, what) = match need {
            Need::StorageBuffers(n) => {
                (n.into(), self.limits.max_storage_buffers_per_shader_stage.into(), "storage buffers in one shader")
            }
            Need::UniformBytes(n) => (n, self.limits.max_uniform_buffer_binding_size, "bytes in a uniform buffer"),
        };
        (needed > most).then(|| format!("it needs {needed} {what}, and {} has {most}", self.adapter))
    }

    /// Why textures of a format cannot be written and averaged, and what to choose instead; None if they can.
    pub fn cannot_average(&self, format: Format) -> Option<String> {
        if self.averages(format) {
            return None;
        }
        let (precision, other) = match format {
            Format::R32Float => (16, Format::R16Float),
            Format::Rg32Float => (16, Format::Rg16Float),
            Format::Rgba32Float => (16, Format::Rgba16Float),
            Format::R16Float => (32, Format::R32Float),
            Format::Rg16Float => (32, Format::Rg32Float),
            _ => (32, Format::Rgba32Float),
        };
        let instead = match self.averages(other) {
            true => format!("precision = {precision}"),
            false => "another filter".into(),
        };
        Some(format!("{} cannot average textures of {format:?}; choose {instead}", self.adapter))
    }

    fn averages(&self, format: Format) -> bool {
        self.features.contains(match format {
            Format::R32Float | Format::Rg32Float | Format::Rgba32Float => Features::FLOAT32_FILTERABLE,
            Format::Rgba16Unorm => Features::TEXTURE_FORMAT_16BIT_NORM,
            // WebGPU alone does not let these be written.
            Format::R16Float | Format::Rg16Float => Features::TEXTURE_ADAPTER_SPECIFIC_FORMAT_FEATURES,
            _ => Features::empty(),
        })
    }
}
