//! What a pass wrote, as a small picture (`shaders/shot.wgsl`).

use super::{ANALYSIS, Ask, History, JUDGED, Renderer, STORED, Truth};
use crate::gpu::{Buffer, Gpu, Pass, Recorder, Slot, Watch};
use crate::setup::Setup;
use anyhow::{Context, Result};
use bytemuck::{Pod, Zeroable};
use std::cell::Cell;
use wgpu::{BufferUsages as Use, TextureFormat as Format};

/// Width and height that it fits into, pixels.
const MOST: [u32; 2] = [288, 216];

/// As `Shot` in WGSL.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct ShotUniform {
    pub size: [u32; 2],
    pub whole: [u32; 2],
    pub channels: u32,
    pub stretched: u32,
    pub layers: u32,
    pub columns: u32,
}

/// What a pass wrote: the texture that it wrote last, with all its layers beside each other.
#[derive(Clone, Debug, PartialEq)]
pub struct Shot {
    /// Of a layer of the texture, texels; how many layers there are, and how many stand in a row.
    pub whole: [u32; 2],
    pub layers: u32,
    pub columns: u32,
    /// Of the picture, whose pixels are four bytes each, rows from the top.
    pub size: [u32; 2],
    pub rgba: Vec<u8>,
    /// Smallest and largest value, where the picture runs from the one to the other.
    pub range: Option<[f32; 2]>,
}

/// The passes, made when they are first asked for.
pub(super) struct Shots {
    extremes: Pass,
    draw: Pass,
    found: Buffer,
    uniform: Buffer,
    picture: Slot,
    /// What the frame at work has drawn.
    last: Cell<Option<ShotUniform>>,
}

impl Shots {
    fn new(gpu: &Gpu) -> Result<Shots> {
        let pass = |entry| Pass::compute(gpu, "shot", "shot.wgsl", entry, &[]);
        let mut picture = Slot::default();
        picture.get(gpu, "shot", MOST, Format::Rgba8Unorm, STORED);
        Ok(Shots {
            extremes: pass("find_extremes")?,
            draw: pass("draw_shot")?,
            found: gpu.buffer("extremes", &[0; 16], Use::STORAGE | Use::COPY_SRC),
            uniform: gpu.buffer("shot", &[0; size_of::<ShotUniform>()], Use::UNIFORM),
            picture,
            last: Cell::new(None),
        })
    }
}

impl Watch for Shots {
    /// Draws the texture, if it holds what can be shown, over those that the pass wrote before.
    fn wrote(&self, recorder: &mut Recorder, texture: &wgpu::Texture) {
        let format = texture.format();
        let kind = format.sample_type(Some(wgpu::TextureAspect::All), None);
        let Some(wgpu::TextureSampleType::Float { .. } | wgpu::TextureSampleType::Depth) = kind else { return };
        // One that is drawn into for the side effects alone cannot be read.
        if !texture.usage().contains(wgpu::TextureUsages::TEXTURE_BINDING) {
            return;
        }
        let Some(picture) = self.picture.view() else { return };
        let array = Some(wgpu::TextureViewDimension::D2Array);
        let view = texture.create_view(&wgpu::TextureViewDescriptor { dimension: array, ..Default::default() });
        let (whole, layers) = ([texture.width(), texture.height()], texture.depth_or_array_layers());
        // As the view of all maps has them.
        let columns = (layers as f32).sqrt().ceil() as u32;
        let all = [whole[0] * columns, whole[1] * layers.div_ceil(columns)];
        let scale = (0..2).map(|i| all[i] as f32 / MOST[i] as f32).fold(0.0, f32::max);
        let size = all.map(|side| ((side as f32 / scale) as u32).max(1));
        let shot = ShotUniform {
            size,
            whole,
            channels: if format.components() == 1 { 1 } else { 3 },
            stretched: (format != Format::Rgba8Unorm) as u32,
            layers,
            columns,
        };
        recorder.submit();
        recorder.gpu.queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&shot));
        recorder.clear(&self.found);
        let [w, h] = whole.map(|side| side.div_ceil(64));
        let [columns, rows] = size.map(|side| side.div_ceil(8));
        for (pass, [x, y, z]) in [(&self.extremes, [w, h, layers]), (&self.draw, [columns, rows, 1])] {
            recorder
                .run(pass)
                .bind("source", &view)
                .bind("shot", &self.uniform)
                .bind("extremes", &self.found)
                .bind("shot_out", picture)
                .dispatch(x, y, z);
        }
        self.last.set(Some(shot));
    }
}

impl Renderer {
    /// Shows what the pass of this name wrote for a side of the last frame; None: no texture, or none that can be shown. That
    /// is rendered once more for it, but for what stays of it: the truth, and what the CPU made of that. `setup`: the frame's.
    ///
    /// # Errors
    /// As [`Renderer::render`].
    pub fn shot(&mut self, setup: &Setup, side: usize, pass: &'static str) -> Result<Option<Shot>> {
        self.exchange_side(side);
        let shot = self.shot_in_use(setup, side, pass);
        self.exchange_side(side);
        shot
    }

    fn shot_in_use(&mut self, setup: &Setup, side: usize, pass: &'static str) -> Result<Option<Shot>> {
        let size = self.targets.size()?;
        if self.shots.is_none() {
            self.shots = Some(Shots::new(&self.gpu)?);
        }
        let stays = match pass {
            "truth" => self.truth.shown().and_then(Slot::texture),
            JUDGED => self.targets.map.texture(),
            _ => None,
        };
        if let (Some(texture), Some(shots)) = (stays, &self.shots) {
            let mut recorder = Recorder::new(&self.gpu, &mut self.timer, false, size);
            shots.wrote(&mut recorder, texture);
            recorder.finish()?;
        } else {
            self.watched = Some(pass);
            let analysis = pass == ANALYSIS;
            let ask = Ask {
                size,
                truth: Truth::Off,
                analysis,
                timed: false,
                picture: true,
                fresh: true,
                history: History::Goes,
            };
            let rendered = self.again(setup, side, ask);
            self.watched = None;
            rendered?;
        }
        let shots = self.shots.as_ref().context(super::NO_FRAME)?;
        let Some(shot) = shots.last.take() else { return Ok(None) };
        let extent = wgpu::Extent3d { width: shot.size[0], height: shot.size[1], depth_or_array_layers: 1 };
        let picture = shots.picture.texture().context(super::NO_FRAME)?;
        let rgba = self.gpu.read_texels(picture, [0, 0], extent)?;
        let keys: [u32; 4] = bytemuck::pod_read_unaligned(&self.gpu.read_buffer(&shots.found)?);
        // As `value` in WGSL.
        let value = |key: u32| f32::from_bits(if key >> 31 == 1 { key & 0x7fff_ffff } else { !key });
        let range = (shot.stretched == 1).then(|| [-value(keys[0]), value(keys[1])]);
        let ShotUniform { whole, layers, columns, size, .. } = shot;
        Ok(Some(Shot { whole, layers, columns, size, rgba, range }))
    }
}
