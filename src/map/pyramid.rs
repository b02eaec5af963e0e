//! The nearest and the farthest depth of parts of a map, and the largest jump between neighbours, from 2 × 2 texels up to all of them (`shaders/map/pyramid.wgsl`).

use crate::frame::Frame;
use crate::gpu::{self, Gpu, Pass, Texture, hold};
use anyhow::Result;
use wgpu::{TextureFormat as Format, TextureUsages as Use, TextureView};

/// Made anew from a map whenever it is asked for, and kept for maps of one size.
pub struct Pyramid {
    begin: Pass,
    build: Pass,
    levels: Option<(u32, Levels)>,
}

struct Levels {
    all: TextureView,
    each: Vec<TextureView>,
    /// Whose views these are: on the account as long as they are held.
    texture: Texture,
}

impl Pyramid {
    /// # Errors
    /// Passes that cannot be made.
    pub fn new(gpu: &Gpu) -> Result<Pyramid> {
        let pass = |entry| Pass::compute(gpu, "depth pyramid", "map/pyramid.wgsl", entry, &[]);
        Ok(Pyramid { begin: pass("begin_pyramid")?, build: pass("build_pyramid")?, levels: None })
    }

    /// Reduces a map of `side` × `side` stored depths, level by level: what shaders bind as `pyramid`.
    ///
    /// # Errors
    /// None that a map which could be held brings.
    pub fn make(&mut self, f: &mut Frame, map: &TextureView, side: u32) -> Result<TextureView> {
        let gpu = f.gpu;
        let passes = [&self.begin, &self.build];
        let levels = hold(&mut self.levels, side, |side| {
            passes.iter().for_each(|pass| pass.forget());
            // A power of two, so that each level halves the one before without a rest.
            let side = side.next_power_of_two() / 2;
            let count = side.ilog2() + 1;
            let usage = Use::STORAGE_BINDING | Use::TEXTURE_BINDING;
            let texture = gpu::texture(gpu, "depth pyramid", [side, side, 1], count, Format::Rgba32Float, usage);
            let view = |base_mip_level, mip_level_count| {
                let count = Some(mip_level_count);
                texture.create_view(&wgpu::TextureViewDescriptor {
                    base_mip_level,
                    mip_level_count: count,
                    ..Default::default()
                })
            };
            Ok(Levels { all: view(0, count), each: (0..count).map(|i| view(i, 1)).collect(), texture })
        })?;
        for (i, level) in levels.each.iter().enumerate() {
            let groups = (levels.texture.width() >> i).div_ceil(8);
            let run = match i {
                0 => f.run(&self.begin).bind("shadow_map", map),
                _ => f.run(&self.build).bind("finer", &levels.each[i - 1]),
            };
            run.bind("pyramid_out", level).dispatch(groups, groups, 1);
        }
        Ok(levels.all.clone())
    }
}
