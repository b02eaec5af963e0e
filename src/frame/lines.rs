//! What maps cover, drawn into the scene as lines (`shaders/lines.wgsl`): frusta, the boxes of light views, bodies.

use super::{Ask, Frame};
use crate::gpu::{Buffer, Gpu, Pass, Raster, Recorder, Resource};
use crate::map::fit::Scope;
use crate::map::fit::hull::Polyhedron;
use crate::setup::Setup;
use crate::view::Drawn;
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
/// Lines of a face around a light: its border, and from the light to it.
const FACE: u32 = 56;

/// As `Segment` in WGSL.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
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
    pub inset: u32,
    pub padding: u32,
}

/// What a technique has to outline. Light views stay on the GPU.
#[derive(Default)]
pub struct Outlines {
    view: Option<Buffer>,
    cascades: Option<(u32, Vec<(&'static str, Resource)>)>,
    faces: Option<(u32, Vec<(&'static str, Resource)>)>,
    edges: Vec<[DVec3; 2]>,
}

/// Whether a frame draws lines.
pub fn wanted(setup: &Setup, ask: &Ask) -> bool {
    ask.picture && (setup.outlines || setup.frozen().is_some())
}

impl Frame<'_> {
    /// Outlines what the one map's light view holds.
    pub fn outline_view(&mut self, light_view: &Buffer) {
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

    /// Outlines faces around a light. `bound`: what `face_line` in `shaders/lines.wgsl` reads.
    pub fn outline_faces(&mut self, count: u32, bound: Vec<(&'static str, Resource)>) {
        if let Some(o) = &mut self.outlines {
            o.faces = Some((count, bound));
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

/// The passes, made when lines are first drawn, and what the last frame outlined.
#[derive(Default)]
pub struct Lines {
    passes: Option<Passes>,
    outlines: Option<Outlines>,
}

struct Passes {
    segments: Pass,
    view: Pass,
    cascades: Pass,
    faces: Pass,
    style: Buffer,
    /// The lines that the CPU knows of.
    held: Option<(Vec<Segment>, Buffer)>,
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
            faces: pass("face_line")?,
            style: gpu.buffer("lines' style", &[0; size_of::<Style>()], Use::UNIFORM),
            held: None,
        })
    }
}

impl Lines {
    /// Takes in what a frame outlines.
    ///
    /// # Errors
    /// A shader that does not compile.
    pub(super) fn take(
        &mut self,
        gpu: &Gpu,
        outlines: Option<Outlines>,
        setup: &Setup,
        bounds: [Vec3; 2],
        [width, height]: [u32; 2],
    ) -> Result<()> {
        self.outlines = outlines;
        let Some(outlines) = &self.outlines else { return Ok(()) };
        let p = match &mut self.passes {
            Some(passes) => passes,
            None => self.passes.insert(Passes::new(gpu)?),
        };
        let line = |[a, b]: [DVec3; 2], color, weight| Segment { start: a.as_vec3(), color, end: b.as_vec3(), weight };
        let mut segments = Vec::new();
        if let Some(camera) = setup.frozen() {
            let aspect = width as f32 / height as f32;
            let eye = Scope { camera, light: setup.light, bounds, aspect, resolution: 1, margin: 0.0 }.eye();
            let c = eye.corners();
            for i in 0..4 {
                let next = (i + 1) % 4;
                let start = if eye.orthographic { c[i] } else { eye.position };
                let lines = [[start, c[4 + i]], [c[i], c[next]], [c[4 + i], c[4 + next]]];
                segments.extend(lines.map(|ends| line(ends, WHITE, 1.0)));
            }
        }
        segments.extend(outlines.edges.iter().map(|ends| line(*ends, GREEN, 0.6)));
        if p.held.as_ref().is_none_or(|(held, _)| *held != segments) {
            let buffer = |s: &[Segment]| gpu.buffer("outlines", bytemuck::cast_slice(s), Use::STORAGE);
            p.held = if segments.is_empty() { None } else { Some((segments.clone(), buffer(&segments))) };
        }
        Ok(())
    }

    /// Draws what the last frame outlined over the picture, where the view, `drawn` so, shows the scene. `bound`: what of
    /// the frame the recorder does not know. `inset`: a map lies in the corner.
    pub(super) fn draw(
        &self,
        recorder: &mut Recorder,
        view: &str,
        drawn: &Drawn,
        inset: bool,
        bound: &[(&'static str, Resource)],
        output: &wgpu::TextureView,
    ) {
        let (Some(outlines), Some(p)) = (&self.outlines, &self.passes) else { return };
        // The tap pattern is the one ramp that is no picture of the scene.
        if matches!(drawn, Drawn::Depth | Drawn::Counts | Drawn::Diagram(_)) || view == "taps" {
            return;
        }
        // The same share of any picture.
        let half = 0.8 * (output.texture().height() as f32 / 800.0).max(0.4);
        let labels = matches!(drawn, Drawn::Labels(_)) as u32;
        let style = Style { half, labels, inset: inset as u32, padding: 0 };
        recorder.gpu.queue.write_buffer(&p.style, 0, bytemuck::bytes_of(&style));
        let mut lines = |pass, own: &[(&'static str, Resource)], count| {
            let run = recorder.run(pass).bind_all(bound).bind_all(own).bind("style", &p.style).uncounted();
            run.draw(&[output], None, false, |pass| pass.draw(0..6, 0..count));
        };
        if let Some((segments, buffer)) = &p.held {
            lines(&p.segments, &[("segments", buffer.into())], segments.len() as u32);
        }
        if let Some(light_view) = &outlines.view {
            lines(&p.view, &[("light_view", light_view.into())], BOX);
        }
        if let Some((count, own)) = &outlines.cascades {
            lines(&p.cascades, own, CASCADE * count);
        }
        if let Some((count, own)) = &outlines.faces {
            lines(&p.faces, own, FACE * count);
        }
    }
}
