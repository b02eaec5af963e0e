//! Shadow rays of those pixels only that a technique lists (`shaders/lib/listed.wgsl`): the others it has decided.

use crate::frame::Frame;
use crate::gpu::{Buffer, Gpu, Pass, Resource};
use anyhow::{Result, ensure};
use wgpu::BufferUsages as Use;

/// Bytes of an entry.
const ENTRY: u64 = 8;

/// The list and the passes that trace it.
pub struct ListedRays {
    count: Buffer,
    dispatch: Buffer,
    list: Option<Buffer>,
    begin: Pass,
    resolve: Pass,
}

impl ListedRays {
    pub fn new(gpu: &Gpu) -> Result<ListedRays> {
        let pass = |name, entry| Pass::compute(gpu, name, "listed_rays.wgsl", entry, &[]);
        Ok(ListedRays {
            count: gpu.buffer("listed pixels", &[0; 4], Use::STORAGE | Use::COPY_DST),
            dispatch: gpu.buffer("dispatch of listed rays", &[0; 16], Use::STORAGE | Use::INDIRECT | Use::COPY_SRC),
            list: None,
            begin: pass("list of rays", "count")?,
            resolve: pass("shadow rays", "resolve")?,
        })
    }

    /// An empty list with room for all pixels: what a pass binds that lists some.
    ///
    /// # Errors
    /// A picture with more pixels than the adapter can list.
    pub fn begin(&mut self, f: &mut Frame) -> Result<[(&'static str, Resource); 2]> {
        let bytes = f.size.iter().map(|side| *side as u64).product::<u64>() * ENTRY;
        ensure!(bytes <= f.gpu.most_bound(), "the picture has too many pixels to list them; choose a smaller one");
        if self.list.as_ref().is_none_or(|list| list.size() != bytes.max(16)) {
            self.list = None;
            self.list = Some(f.gpu.room("list of rays", bytes, Use::STORAGE));
        }
        f.clear(&self.count);
        Ok(self.bound())
    }

    /// Traces a ray from each listed pixel into the frame's visibility.
    pub fn trace(&self, f: &mut Frame) {
        self.trace_by(f, &self.resolve, &[]);
    }

    /// Runs another pass over the listed pixels, 64 a workgroup (`listed_index` in `shaders/lib/listed.wgsl`).
    /// `bound`: what it needs beside the list.
    pub fn trace_by(&self, f: &mut Frame, pass: &Pass, bound: &[(&'static str, Resource)]) {
        let listed = self.bound();
        f.run(&self.begin).bind_all(&listed).bind("dispatch", &self.dispatch).dispatch(1, 1, 1);
        f.run(pass).bind_all(&listed).bind_all(bound).of_picture().dispatch_indirect(&self.dispatch, 0);
    }

    fn bound(&self) -> [(&'static str, Resource); 2] {
        let list = self.list.as_ref().unwrap_or(&self.count);
        [("listed", list.into()), ("listed_count", (&self.count).into())]
    }
}
