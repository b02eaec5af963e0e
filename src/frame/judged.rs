//! Pictures of a frame's errors that the CPU makes of its visibility and truth.

use super::figure::shaded;
use super::lights::Lights;
use super::{Drawing, NO_FRAME, Renderer, STORED, Shading, Targets, know_scene};
use crate::gpu::{Pass, Recorder, Slot};
use crate::measure::causes::{self, Causes, Evidence};
use crate::measure::metrics;
use crate::scene::geometry::Geometry;
use crate::setup::Setup;
use crate::truth::Tracing;
use anyhow::{Context, Result};
use wgpu::TextureFormat as Format;

/// What a judgement is made of.
pub(super) struct Judged<'a> {
    pub geometry: &'a Geometry,
    pub truth: &'a Tracing,
    /// The frame's, if it was analysed and its technique has maps.
    pub aliasing: Option<wgpu::TextureView>,
    pub targets: &'a mut Targets,
    pub classify: &'a Pass,
    pub lights: &'a Lights,
}

impl Judged<'_> {
    /// Reads back which pixels count, as [`metrics`] names them.
    pub fn mask(&mut self, recorder: &mut Recorder) -> Result<Vec<u32>> {
        let t = &mut *self.targets;
        let mask = t.mask.get(recorder.gpu, "mask", t.size()?, Format::R32Uint, STORED);
        recorder.run(self.classify).bind("mask", &mask).per_pixel();
        recorder.submit();
        Ok(bytemuck::pod_collect_to_vec(&read(recorder, &t.mask)?))
    }

    /// Visibility, the frame's or another, and the truth's labels, a number a pixel.
    fn labels(&self, recorder: &Recorder, other: Option<&Slot>) -> Result<[Vec<f32>; 2]> {
        let number = |slot| anyhow::Ok(bytemuck::pod_collect_to_vec(&read(recorder, slot)?));
        Ok([number(other.unwrap_or(&self.targets.visibility))?, number(self.truth.labels().context(NO_FRAME)?)?])
    }

    /// Tells the causes of the wrong pixels of the frame's visibility, or another, apart; the hard truth must be there.
    pub fn causes(&mut self, recorder: &mut Recorder, other: Option<&Slot>) -> Result<Causes> {
        Ok(self.evidence(recorder, other)?.0)
    }

    /// The same with what it is told by.
    fn evidence(&mut self, recorder: &mut Recorder, other: Option<&Slot>) -> Result<(Causes, Vec<Evidence>)> {
        let (gpu, size) = (recorder.gpu, self.targets.size()?);
        let mut held = Slot::default();
        let evidence = held.get(gpu, "evidence", size, Format::Rgba32Uint, STORED);
        let visibility = Targets::view(other.unwrap_or(&self.targets.visibility))?;
        self.truth.explain(recorder, visibility, self.aliasing.as_ref(), &evidence);
        let mask = self.mask(recorder)?;
        let [visibility, hard] = self.labels(recorder, other)?;
        let evidence: Vec<Evidence> = bytemuck::pod_collect_to_vec(&read(recorder, &held)?);
        let causes = causes::split(&visibility, &hard, &mask, &evidence, self.geometry.casters(), size[0] as usize);
        Ok((causes, evidence))
    }

    /// Share of wrong pixels around each, as [`metrics::density`].
    fn density(&mut self, recorder: &mut Recorder, window: u32) -> Result<Vec<f32>> {
        let mask = self.mask(recorder)?;
        let [visibility, hard] = self.labels(recorder, None)?;
        Ok(metrics::density(&visibility, &hard, &mask, self.targets.size()?[0] as usize, window as usize))
    }

    /// The FLIP difference of the shaded picture from that with the truth, a number a pixel.
    fn flip(&mut self, setup: &Setup, recorder: &mut Recorder, shading: &mut Shading) -> Result<Vec<f32>> {
        let (gpu, t) = (recorder.gpu, &*self.targets);
        let (size, map) = (t.size()?, Targets::view(&t.map)?);
        let shaded = Drawing { transparent: false, ..shaded(setup) };
        let mut picture = |visibility: &Slot, true_light: bool| {
            let mut held = Slot::default();
            let output = held.get(gpu, "picture to compare", size, Format::Rgba8Unorm, STORED);
            let seen = Targets::view(visibility)?;
            recorder.set("visibility", seen);
            recorder.set("others", self.lights.sum(true_light).unwrap_or(seen));
            recorder.set("output", &output);
            shading.record(recorder, shaded, map, (None, None))?;
            recorder.submit();
            read(recorder, &held)
        };
        let truth = self.truth.shown().context(NO_FRAME)?;
        let (test, reference) = (picture(&t.visibility, false)?, picture(truth, true)?);
        recorder.set("visibility", Targets::view(&t.visibility)?);
        recorder.set("output", Targets::view(&t.output)?);
        Ok(metrics::flip_map(&reference, &test, size))
    }

    /// What the set-up's view shows, which is made here: a number a pixel, all 0 until the truth is there, and the causes
    /// if it shows those.
    pub fn values(
        &mut self,
        setup: &Setup,
        recorder: &mut Recorder,
        shading: &mut Shading,
    ) -> Result<(Vec<f32>, Option<Causes>)> {
        let [width, height] = self.targets.size()?;
        // What is recorded is to be read back.
        recorder.submit();
        let (covered, done) = (self.truth.covered(), self.truth.progress().done >= 1.0);
        Ok(match setup.view.as_str() {
            "causes" if covered => {
                let causes = self.causes(recorder, None)?;
                (causes.classes.iter().map(|c| *c as f32).collect(), Some(causes))
            }
            "error-density" if covered => (self.density(recorder, setup.error_window)?, None),
            "flip" if done => (self.flip(setup, recorder, shading)?, None),
            _ => (vec![0.0; (width * height) as usize], None),
        })
    }
}

fn read(recorder: &Recorder, slot: &Slot) -> Result<Vec<u8>> {
    recorder.gpu.read_texture(slot.texture().context(NO_FRAME)?)
}

impl Renderer {
    /// Tells the causes of the last frame's wrong pixels apart. That frame must have traced the truth, and been analysed:
    /// where it was not, or the technique has no maps, an edge's errors are told by pixels alone.
    pub fn read_causes(&mut self) -> Result<Causes> {
        self.judge(|judged, recorder, _| judged.causes(recorder, None))
    }

    /// The same with what each pixel's cause is told by.
    pub fn read_evidence(&mut self) -> Result<(Causes, Vec<Evidence>)> {
        self.judge(|judged, recorder, _| judged.evidence(recorder, None))
    }

    /// The visibility of the last frame's technique without contact shadows, a number per pixel, and the causes of its wrong pixels
    /// as [`Renderer::read_causes`] tells them; None where it had no contact shadows.
    pub fn read_without_contact(&mut self) -> Result<Option<(Vec<f32>, Causes)>> {
        self.judge(|judged, recorder, without| {
            let Some(slot) = without else { return Ok(None) };
            let visibility = bytemuck::pod_collect_to_vec(&read(recorder, slot)?);
            Ok(Some((visibility, judged.causes(recorder, without)?)))
        })
    }

    /// Classes of the last frame's pixels, as [`crate::measure::metrics`] names them.
    pub fn read_mask(&mut self) -> Result<Vec<u32>> {
        self.judge(|judged, recorder, _| judged.mask(recorder))
    }

    /// The causes of the last frame's wrong pixels, if its view showed them.
    pub fn causes(&self) -> Option<&Causes> {
        self.causes.as_ref()
    }

    /// `what` is also given the technique's visibility without contact shadows, where it has some.
    fn judge<T>(&mut self, what: impl FnOnce(&mut Judged, &mut Recorder, Option<&Slot>) -> Result<T>) -> Result<T> {
        let size = self.targets.size()?;
        let mut recorder = Recorder::new(&self.gpu, &mut self.timer, false, size);
        know_scene(&mut recorder, &self.scene_gpu);
        recorder.set("frame", &self.frame_buffer);
        recorder.set("g_position", Targets::view(&self.targets.position)?);
        recorder.set("g_surface", Targets::view(&self.targets.surface)?);
        let mut judged = Judged {
            geometry: &self.geometry,
            truth: &self.truth,
            aliasing: self.analysis.aliasing_view().cloned(),
            targets: &mut self.targets,
            classify: &self.classify,
            lights: &self.lights,
        };
        let without = self.made.as_ref().and_then(|made| made.own.get(&self.at_work)?.contact.as_ref());
        let result = what(&mut judged, &mut recorder, without.map(|c| c.before()))?;
        recorder.finish()?;
        Ok(result)
    }
}
