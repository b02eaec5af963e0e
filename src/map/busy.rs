//! Passes over layers around a light: those that nothing looks up run no workgroup. The GPU decides which (`shaders/map/busy.wgsl`).

use super::MOST;
use crate::frame::Frame;
use crate::gpu::{Buffer, Gpu, Pass, Resource, Run};
use anyhow::Result;
use wgpu::BufferUsages as Use;

/// Most sizes of passes, as in WGSL, and the bytes of an indirect dispatch.
const SIZES: usize = 32;
const DISPATCH: u64 = 12;

/// Indirect dispatches of a technique's passes, for each layer.
#[derive(Default)]
pub struct Dispatches {
    held: Option<Held>,
    /// Of this frame. None: every layer is in use.
    planned: bool,
}

struct Held {
    plan: Pass,
    sizes: Buffer,
    written: Vec<[u32; 2]>,
    arguments: Buffer,
}

impl Held {
    fn new(gpu: &Gpu) -> Result<Held> {
        let arguments = vec![0; MOST * SIZES * DISPATCH as usize];
        Ok(Held {
            plan: Pass::compute(gpu, "fit: faces", "map/busy.wgsl", "plan", &[])?,
            sizes: gpu.buffer("sizes of passes", &[0; SIZES * 16], Use::UNIFORM),
            written: Vec::new(),
            arguments: gpu.buffer("dispatches", &arguments, Use::STORAGE | Use::INDIRECT | Use::COPY_SRC),
        })
    }
}

impl Dispatches {
    /// Plans the passes that follow: `sizes` are their workgroups in x and y. `bound`: what the layers' passes bind; where there
    /// are no `face_draws` among it, every layer is in use.
    ///
    /// # Errors
    /// A pass that cannot be made.
    pub fn plan(&mut self, f: &mut Frame, bound: &[(&'static str, Resource)], sizes: &[[u32; 2]]) -> Result<()> {
        self.planned = bound.iter().any(|(name, _)| *name == "face_draws");
        if !self.planned {
            return Ok(());
        }
        if self.held.is_none() {
            self.held = Some(Held::new(f.gpu)?);
        }
        let Some(held) = &mut self.held else { return Ok(()) };
        let sizes = &sizes[..sizes.len().min(SIZES)];
        if held.written != sizes {
            let words: Vec<[u32; 4]> = sizes.iter().map(|[x, y]| [*x, *y, 0, 0]).collect();
            f.gpu.queue.write_buffer(&held.sizes, 0, bytemuck::cast_slice(&words));
            held.written = sizes.to_vec();
        }
        let run = f.run(&held.plan).bind_all(bound).bind("sizes", &held.sizes).bind("dispatches", &held.arguments);
        run.dispatch((MOST * SIZES / 64) as u32, 1, 1);
        Ok(())
    }

    /// Runs a pass over a layer with so many workgroups, or with none if the layer lies idle.
    pub fn run(&self, run: Run, layer: usize, size: [u32; 2]) {
        let held = self.held.as_ref().filter(|_| self.planned);
        match held.and_then(|held| Some((held, held.written.iter().position(|s| *s == size)?))) {
            Some((held, i)) => run.dispatch_indirect(&held.arguments, (layer * SIZES + i) as u64 * DISPATCH),
            // One that was not planned runs in any case.
            None => run.dispatch(size[0], size[1], 1),
        }
    }
}
