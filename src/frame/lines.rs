//! What maps cover, drawn into the scene as lines (`shaders/lines.wgsl`): frusta, the boxes of light views, bodies.

use super::{Ask, Frame, Shown};
use crate::fit::Scope;
use crate::fit::hull::Polyhedron;
use crate::gpu::{Gpu, Pass, Raster, Recorder, Resource};
use crate::setup::Setup;
use anyhow::Result;
use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Vec3};
use wgpu::BufferUsages as Use;

/// The passes' name among the times.
pub const PASS: &str = "outlines";

/// Colours of the palette of labels (`shaders/lib/labels.wgsl`): the camera's frustum, and the body that a fit encloses.
const WHITE: u32 = 8;
const GREEN: u32 = 2;
/// Lines of a box, and of a cascade: its box and its slice of the frustum.
const BOX: u32 = 12;
const CASCADE: u32 = 24;

/// As `Segment` in WGSL.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Segment {
    pub start: Vec3,
    pub color: u32,
    pub end: Vec3,
    /// Times the width of the camera's frustum.
    pub weight: f32,
}

/// As `Style` in WGSL.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Style {
    pub half: f32,
    pub labels: u32,
    pub padding: [u32; 2],
}

/// What a technique has to outline. Light views stay on the GPU.
#[derive(Default)]
pub struct Outlines {
    view: Option<wgpu::Buffer>,
    cascades: Option<(u32, Vec<(&'static str, Resource)>)>,
    edges: Vec<[DVec3; 2]>,
}

/// Whether a frame draws lines.
pub fn wanted(setup: &Setup, ask: &Ask) -> bool {
    ask.picture && (setup.outlines || setup.frozen().is_some())
}

impl Frame<'_> {
    /// Outlines what the one map's light view holds.
    pub fn outline_view(&mut self, light_view: &wgpu::Buffer) {
        if let Some(o) = &mut self.outlines {
            o.view = Some(light_view.clone());
        }
    }

    /// Outlines cascades. `bound`: what `cascade_line` in `shaders/lines.wgsl` reads.
    pub fn outline_cascades(&mut self, count: u32, bound: Vec<(&'static str, Resource)>) {
        if let Some(o) = &mut self.outlines {
            o.cascades = Some((count, bound));
        }
    }

    /// Draws the edges of a body that a fit encloses.
    pub fn outline_body(&mut self, body: Polyhedron) {
        if let Some(o) = &mut self.outlines {
            o.edges.extend(body.edges());
        }
    }

    /// Whether outlines are drawn, so that it pays to make what only they need.
    pub fn wants_outlines(&self) -> bool {
        self.outlines.is_some()
    }
}

/// The passes, made when lines are first drawn.
#[derive(Default)]
pub struct Lines {
    passes: Option<Passes>,
}

struct Passes {
    segments: Pass,
    view: Pass,
    cascades: Pass,
    style: wgpu::Buffer,
    held: Option<(Vec<u8>, wgpu::Buffer)>,
}

impl Passes {
    fn new(gpu: &Gpu) -> Result<Passes> {
        let pass = |vertex| {
            let raster = Raster {
                vertex,
                fragment: Some("draw_line"),
                targets: &[wgpu::TextureFormat::Rgba8Unorm],
                blend: Some(wgpu::BlendState::ALPHA_BLENDING),
                ..Raster::default()
            };
            Pass::render(gpu, PASS, "lines.wgsl", raster, &[])
        };
        Ok(Passes {
            segments: pass("segment_line")?,
            view: pass("view_line")?,
            cascades: pass("cascade_line")?,
            style: gpu.buffer("lines' style", &[0; size_of::<Style>()], Use::UNIFORM),
            held: None,
        })
    }
}

impl Lines {
    /// Draws over the picture, where it shows the scene.
    ///
    /// # Errors
    /// A shader that does not compile.
    pub(super) fn draw(
        &mut self,
        recorder: &mut Recorder,
        outlines: &Outlines,
        shown: &Option<Shown>,
        setup: &Setup,
        bounds: [Vec3; 2],
        output: &wgpu::TextureView,
    ) -> Result<()> {
        // The tap pattern is the one ramp that is no picture of the scene.
        if matches!(shown, Some(Shown::Texture(..) | Shown::Counts)) || setup.view == "taps" {
            return Ok(());
        }
        let gpu = recorder.gpu;
        let p = match &mut self.passes {
            Some(passes) => passes,
            None => self.passes.insert(Passes::new(gpu)?),
        };
        let height = output.texture().height() as f32;
        let labels = matches!(shown, Some(Shown::Labels)) as u32;
        // The same share of any picture.
        let style = Style { half: 0.8 * (height / 800.0).max(0.4), labels, padding: [0; 2] };
        gpu.queue.write_buffer(&p.style, 0, bytemuck::bytes_of(&style));

        let mut segments = Vec::new();
        let mut add = |[a, b]: [DVec3; 2], color| {
            let weight = if color == WHITE { 1.0 } else { 0.6 };
            segments.push(Segment { start: a.as_vec3(), color, end: b.as_vec3(), weight });
        };
        if let Some(camera) = setup.frozen() {
            let aspect = output.texture().width() as f32 / height;
            let eye = Scope { camera, light: setup.light, bounds, aspect, resolution: 1, margin: 0.0 }.eye();
            let c = eye.corners();
            for i in 0..4 {
                let next = (i + 1) % 4;
                for ends in [[eye.position, c[4 + i]], [c[i], c[next]], [c[4 + i], c[4 + next]]] {
                    add(ends, WHITE);
                }
            }
        }
        outlines.edges.iter().for_each(|s| add(*s, GREEN));
        if !segments.is_empty() {
            let bytes = bytemuck::cast_slice(&segments).to_vec();
            if p.held.as_ref().is_none_or(|(held, _)| *held != bytes) {
                let buffer = gpu.buffer("outlines", &bytes, Use::STORAGE);
                p.held = Some((bytes, buffer));
            }
            if let Some((_, buffer)) = &p.held {
                let run = recorder.run(&p.segments).bind("style", &p.style).bind("segments", buffer).uncounted();
                run.draw(&[output], None, false, |pass| pass.draw(0..6, 0..segments.len() as u32));
            }
        }
        if let Some(light_view) = &outlines.view {
            let run = recorder.run(&p.view).bind("style", &p.style).bind("light_view", light_view).uncounted();
            run.draw(&[output], None, false, |pass| pass.draw(0..6, 0..BOX));
        }
        if let Some((count, bound)) = &outlines.cascades {
            let run = recorder.run(&p.cascades).bind("style", &p.style).bind_all(bound).uncounted();
            run.draw(&[output], None, false, |pass| pass.draw(0..6, 0..CASCADE * count));
        }
        Ok(())
    }
}
