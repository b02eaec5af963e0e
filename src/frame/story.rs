//! What the last frame's look-up did at single pixels (`shaders/map/story.wgsl`), and what the technique's own views show there.

use super::maps::Teller;
use super::{FrameUniform, NO_FRAME, Renderer, STORED};
use crate::gpu::{Pass, Recorder, Slot, hold};
use crate::palette::LABELS;
use crate::setup::Setup;
use crate::techniques;
use crate::view::{Drawn, Legend, View};
use anyhow::{Context, Result};
use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec3, Vec4};
use wgpu::BufferUsages as Use;
use wgpu::TextureFormat as Format;

/// Side of the square of [`Looked::taps`].
pub const TAPS: usize = 5;

/// A look-up at a pixel, as `Looked` in `shaders/map/story.wgsl`; lengths and depths are metres, places texels.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Looked {
    pub position: Vec3,
    /// What the layer leaves of the light, and the one that takes over by `share`.
    pub lit: f32,
    pub normal: Vec3,
    pub lit_next: f32,
    /// Where the surface lies in its layer; the same before a warp; and where it is looked up, with the normal offset.
    pub texel: Vec2,
    pub before: Vec2,
    pub looked: Vec2,
    pub layer: u32,
    pub next: u32,
    pub share: f32,
    pub side: f32,
    /// How far the filter's taps reach.
    pub radius: f32,
    /// Longest extent of a texel across the light.
    pub texel_size: f32,
    /// Depth from the light of the surface, of what it is compared as, and of what its texel holds.
    pub depth: f32,
    pub compared: f32,
    pub held: f32,
    /// What the texel holds as it is stored, 1 near, 0 far or empty.
    pub stored: f32,
    /// How far the comparison is moved towards the light: constant, by slope, along the normal, onto the receiver's plane.
    pub bias: Vec4,
    /// What the surface's plane gains in depth over a texel along each side.
    pub slope: Vec2,
    pub near: f32,
    pub far: f32,
    pub perspective: u32,
    /// 1: the map holds nothing there; 2: the light does not reach the surface.
    pub outside: u32,
    /// Metres of depth that a metre towards the light is.
    pub fall: f32,
    /// Texels between two taps.
    pub spread: f32,
    /// The texel's corners on the surface's plane.
    pub corners: [Vec4; 4],
    /// Places around: the depth held there, that compared with, that of the surface's plane; last 0 where nothing is held, 1 where
    /// something is, 2 beside the map.
    pub taps: [Vec4; TAPS * TAPS],
}

/// What one of a technique's own views shows at a pixel.
pub struct Shown {
    pub view: &'static View,
    /// A number on its scale, with its unit, or the name of a class.
    pub value: ShownValue,
}

pub enum ShownValue {
    Number(f32, &'static str),
    Class(&'static str),
}

/// Whether a view of a technique's own shows a number or a class for each pixel of the scene.
fn tells_pixels(view: &View) -> bool {
    match view.drawn {
        // The one ramp that is no picture of the scene.
        Drawn::Ramp(_) => view.id != "taps" && view.id != "bias",
        Drawn::Labels(Legend::Classes(_)) => true,
        _ => false,
    }
}

impl Renderer {
    /// What the look-up of the last frame's technique did at these pixels; None of techniques without one. Of a comparison it is the
    /// first side's.
    pub fn looked(&mut self, pixels: &[[u32; 2]]) -> Result<Option<Vec<Looked>>> {
        let Some(teller) = self.teller().filter(|t| t.looks_up && !pixels.is_empty()) else { return Ok(None) };
        let gpu = self.gpu.clone();
        let file = format!("{} map/story.wgsl", teller.file);
        let pass = hold(&mut self.tell, file, |file| Pass::compute(&gpu, "story", file, "tell_story", teller.groups))?;
        let asked = gpu.buffer("pixels asked for", bytemuck::cast_slice(pixels), Use::STORAGE);
        let told = gpu.room("story", (pixels.len() * size_of::<Looked>()) as u64, Use::STORAGE | Use::COPY_SRC);
        let size = self.targets.size()?;
        let mut recorder = Recorder::new(&gpu, &mut self.timer, false, size);
        for (name, resource) in teller.bound {
            recorder.set(name, resource);
        }
        let run = recorder.run(pass).bind("story_pixels", &asked).bind("stories", &told);
        run.dispatch(pixels.len() as u32, 1, 1);
        recorder.finish()?;
        pass.forget();
        Ok(Some(bytemuck::pod_collect_to_vec(&gpu.read_buffer(&told)?)))
    }

    /// What the technique's own views show at a pixel of the last frame, of which `setup` is the set-up: those that show a number or a
    /// class for each.
    pub fn shown_at(&mut self, setup: &Setup, pixel: [u32; 2]) -> Result<Vec<Shown>> {
        let Some(teller) = self.teller() else { return Ok(Vec::new()) };
        let (gpu, size) = (self.gpu.clone(), self.targets.size()?);
        let info = techniques::find_or_say(&setup.technique)?;
        let views: Vec<_> = info.views(setup.values()).filter(|v| tells_pixels(v)).collect();
        let mut found = Vec::new();
        if views.is_empty() {
            return Ok(found);
        }
        let pass = hold(&mut self.show, teller.file.clone(), |file| {
            Pass::compute(&gpu, "inspect", file, "inspect", teller.groups)
        })?;
        // Some draw their views from more than the look-up reads; these are not told.
        if !pass.needs_only(&teller.bound) {
            return Ok(found);
        }
        let mut held = Slot::default();
        let map = held.get(&gpu, "shown at a pixel", size, Format::R32Float, STORED);
        for view in views {
            let shown = Setup { view: view.id.into(), ..setup.clone() };
            let uniform = FrameUniform::new(&shown, size, &self.scene_gpu);
            gpu.queue.write_buffer(&self.frame_buffer, 0, bytemuck::bytes_of(&uniform));
            let mut recorder = Recorder::new(&gpu, &mut self.timer, false, size);
            for (name, resource) in &teller.bound {
                recorder.set(name, resource.clone());
            }
            recorder.run(pass).bind("map_out", &map).per_pixel();
            recorder.finish()?;
            let one = wgpu::Extent3d { width: 1, height: 1, depth_or_array_layers: 1 };
            let texture = held.texture().context(NO_FRAME)?;
            let x: f32 = bytemuck::pod_read_unaligned(&gpu.read_texels(texture, pixel, one)?);
            let value = match view.drawn {
                _ if x < 0.0 || !x.is_finite() => None,
                Drawn::Ramp(values) => Some(ShownValue::Number(x, values.unit)),
                // As in shaders/lib/labels.wgsl.
                Drawn::Labels(Legend::Classes(classes)) => {
                    let color = LABELS.get(x as usize & 15);
                    let class = classes.iter().find(|c| Some(&c.color) == color);
                    class.map(|c| ShownValue::Class(c.what))
                }
                _ => None,
            };
            found.extend(value.map(|value| Shown { view, value }));
        }
        pass.forget();
        let uniform = FrameUniform::new(setup, size, &self.scene_gpu);
        gpu.queue.write_buffer(&self.frame_buffer, 0, bytemuck::bytes_of(&uniform));
        Ok(found)
    }

    fn teller(&self) -> Option<Teller> {
        self.offered.as_ref()?.teller.clone()
    }

    /// Of each pixel of the last frame its place in the technique's maps; none unless that frame was analysed.
    pub fn read_places(&self) -> Result<Vec<super::Place>> {
        self.analysis.places(&self.gpu)
    }
}
