//! The exact shadow of a frame, traced in bands of rows so that no frame waits for all of it.

use crate::frame::{FrameUniform, tally};
use crate::gpu::{Gpu, Pass, Recorder};
use crate::light::Light;
use crate::params::Values;
use crate::scene::Camera;
use crate::techniques;
use anyhow::Result;
use bytemuck::Zeroable;

/// The truth as far as it is traced.
pub struct Tracing {
    pass: Pass,
    params: wgpu::Buffer,
    frame: wgpu::Buffer,
    /// How many rays gave up, as `Tally` in `shaders/lib/trace.wgsl`.
    pub tally: wgpu::Buffer,
    /// What the rows so far were traced for: geometry, camera, light, size.
    of: Option<(u64, Camera, Light, [u32; 2])>,
    rows: u32,
    size: [u32; 2],
}

impl Tracing {
    pub fn new(gpu: &Gpu) -> Result<Tracing> {
        let group = &techniques::TRUTH.params[0];
        let uniform = wgpu::BufferUsages::UNIFORM;
        Ok(Tracing {
            pass: Pass::compute(gpu, "truth", "techniques/rt_hard.wgsl", "resolve", techniques::TRUTH.params)?,
            params: gpu.buffer("truth", bytemuck::cast_slice(&group.words(&Values::new())), uniform),
            frame: gpu.buffer("frame of the truth", bytemuck::bytes_of(&FrameUniform::zeroed()), uniform),
            tally: tally(gpu, "the truth's rays"),
            of: None,
            rows: 0,
            size: [1, 1],
        })
    }

    /// Starts anew if the truth so far is of something else.
    pub fn start(&mut self, of: (u64, Camera, Light, [u32; 2]), recorder: &mut Recorder, uniform: &FrameUniform) {
        if self.of != Some(of) {
            self.size = of.3;
            self.of = Some(of);
            self.rows = 0;
            recorder.gpu.queue.write_buffer(&self.frame, 0, bytemuck::bytes_of(uniform));
            recorder.clear(&self.tally);
        }
    }

    /// Records the next rows, about as many pixels as given.
    pub fn record(&mut self, recorder: &mut Recorder, target: &wgpu::TextureView, pixels: u32) {
        let [width, height] = self.size;
        let rows = (pixels / width).max(8).min(height - self.rows);
        if rows > 0 {
            let at = std::mem::offset_of!(FrameUniform, band) as u64;
            recorder.gpu.queue.write_buffer(&self.frame, at, bytemuck::bytes_of(&[self.rows, rows]));
            recorder
                .run(&self.pass)
                .bind("frame", &self.frame)
                .bind("params", &self.params)
                .bind("visibility_out", target)
                .bind("tally", &self.tally)
                .dispatch(width.div_ceil(8), rows.div_ceil(8), 1);
            self.rows += rows;
        }
    }

    /// Share that is traced, 0 to 1.
    pub fn done(&self) -> f32 {
        self.rows as f32 / self.size[1] as f32
    }
}
