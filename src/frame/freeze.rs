//! The shadow camera that stays behind: what it sees, for the passes that decide where maps look.

use super::{DRAWN, FrameUniform};
use crate::gpu::{Buffer, Pass, Recorder, Resource, Slot};
use crate::scene::Camera;
use glam::Vec3;
use wgpu::TextureFormat as Format;

/// The pass's name among the times.
pub const PASS: &str = "shadow camera's G-buffer";

/// How far a camera sees of the scene's box, metres along its axis.
pub fn far(camera: &Camera, bounds: [Vec3; 2]) -> f32 {
    let forward = camera.forward();
    let corner = Vec3::select(forward.cmpgt(Vec3::ZERO), bounds[1], bounds[0]);
    camera.far.min(forward.dot(corner - camera.position) * 1.0001).max(camera.near * 1.0001)
}

/// The G-buffer of the shadow camera, kept while neither it nor the scene changes.
#[derive(Default)]
pub struct Frozen {
    position: Slot,
    surface: Slot,
    frame: Option<Buffer>,
    /// The scene's revision and the words of the frame that it was drawn for.
    drawn: Option<(u64, Vec<u8>)>,
    /// What the frame at work draws it for.
    drawing: Option<(u64, Vec<u8>)>,
}

impl Frozen {
    /// Draws it if need be; what passes that make maps find under the names of the picture's own. `depth`: of the
    /// picture's size, to be drawn over afterwards.
    pub fn draw(
        &mut self,
        recorder: &mut Recorder,
        gbuffer: &Pass,
        depth: &wgpu::TextureView,
        corners: u32,
        revision: u64,
        uniform: FrameUniform,
    ) -> Vec<(&'static str, Resource)> {
        let gpu = recorder.gpu;
        let position = self.position.get(gpu, "shadow camera's position", uniform.size, Format::Rgba32Float, DRAWN);
        let surface = self.surface.get(gpu, "shadow camera's surface", uniform.size, Format::Rgba32Uint, DRAWN);
        let frame = self.frame.get_or_insert_with(|| {
            gpu.buffer("shadow camera's frame", &[0; size_of::<FrameUniform>()], wgpu::BufferUsages::UNIFORM)
        });
        let key = (revision, bytemuck::bytes_of(&uniform).to_vec());
        if self.drawn.take().as_ref() != Some(&key) {
            gpu.queue.write_buffer(frame, 0, &key.1);
            recorder.run(gbuffer).named(PASS).bind("frame", &*frame).draw(
                &[&position, &surface],
                Some((depth, 0.0)),
                true,
                |p| p.draw(0..corners, 0..1),
            );
        }
        self.drawing = Some(key);
        vec![("frame", (&*frame).into()), ("g_position", (&position).into()), ("g_surface", (&surface).into())]
    }

    /// The frame was submitted: what was drawn is there.
    pub fn finished(&mut self) {
        self.drawn = self.drawing.take();
    }
}
