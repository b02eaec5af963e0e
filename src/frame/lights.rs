//! The other lights of a set-up: what they add to the shaded picture, each shadowed by an instance of the technique of its own.

use super::{Frame, FrameUniform, Made, NO_FRAME, Renderer, STORED, Targets, know_scene, tally};
use crate::gpu::{Buffer, Gpu, Pass, Raster, Recorder, Resource, Slot};
use crate::light::Light;
use crate::scene::Camera;
use crate::setup::Setup;
use crate::techniques;
use crate::truth::{Progress, Tracing};
use anyhow::{Context, Result};
use std::collections::BTreeMap;
use wgpu::TextureFormat as Format;

/// The pass's name among the times.
pub const PASS: &str = "light sum";

/// What a light of a frame tells of itself.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ToldLight {
    /// Its place among the set-up's lights, from 0.
    pub light: usize,
    /// Bytes of GPU memory that the technique holds for it.
    pub gpu_bytes: u64,
    /// Milliseconds of the technique's passes for it, in a frame that was timed; 0 where it was not drawn.
    pub ms: f64,
}

/// A light beside the one at work, as the last frame that showed it had it.
#[derive(Clone, Copy)]
pub(super) struct Beside {
    /// Its place among the set-up's lights, from 0.
    pub(super) index: usize,
    light: Light,
    uniform: FrameUniform,
}

/// What the other lights are drawn with.
#[derive(Default)]
pub(super) struct Lights {
    passes: Option<Passes>,
    /// Visibility of the one drawn last; their sum, and that with the truth in place of the technique.
    visibility: Slot,
    sum: Slot,
    true_sum: Slot,
    /// The frame uniform of each, and its shadow camera's, by its place among the set-up's lights.
    frames: BTreeMap<usize, [Buffer; 2]>,
    /// Those of the last frame, if its picture showed them.
    pub(super) beside: Vec<Beside>,
    /// The last frame's truth is of all lights, and so many of the picture's rows, from the top, have that of each.
    truths: bool,
    rows: u32,
    /// Samples of pixels that were traced of the others last.
    pub(super) traced: u64,
    /// What the truth is traced for beside the light, and samples a pixel of it.
    of: Option<(u64, Camera, u32)>,
    /// All lights of the last frame that are on, and the one at work with its uniform.
    all: Vec<Light>,
    own: Option<(Light, FrameUniform)>,
}

/// What traces truths.
pub(super) struct Tracer<'a> {
    pub(super) truth: &'a mut Tracing,
    pub(super) gbuffer: &'a Pass,
    /// Of the scene.
    pub(super) vertices: u32,
}

struct Passes {
    add: Pass,
    add_indirect: Pass,
    /// Their rays, as `Tally` in `shaders/lib/trace.wgsl`.
    tally: Buffer,
}

impl Passes {
    fn new(gpu: &Gpu) -> Result<Passes> {
        let part = wgpu::BlendComponent {
            src_factor: wgpu::BlendFactor::One,
            dst_factor: wgpu::BlendFactor::One,
            operation: wgpu::BlendOperation::Add,
        };
        let pass = |fragment| {
            let raster = Raster {
                vertex: "cover",
                fragment: Some(fragment),
                targets: &[Format::Rgba16Float],
                blend: Some(wgpu::BlendState { color: part, alpha: part }),
                ..Raster::default()
            };
            Pass::render(gpu, PASS, "light_sum.wgsl", raster, &[])
        };
        let (add, add_indirect) = (pass("add")?, pass("add_indirect")?);
        Ok(Passes { add, add_indirect, tally: tally(gpu, "rays of other lights") })
    }
}

impl Lights {
    /// Begins a frame: which of the set-up's other lights it shows. `uniform`: of the light at work.
    pub(super) fn start(&mut self, gpu: &Gpu, setup: &Setup, uniform: &FrameUniform) -> Result<()> {
        (self.truths, self.own) = (false, Some((setup.light, *uniform)));
        if setup.more_lights.is_empty() {
            *self = Lights { passes: self.passes.take(), own: self.own, ..Lights::default() };
            return Ok(());
        }
        let lamps = setup.lamps();
        self.all = lamps.iter().filter(|lamp| lamp.on).map(|lamp| lamp.light).collect();
        self.all.push(setup.light);
        let shown = if setup.shows_all_lights() { setup.lit_beside() } else { Vec::new() };
        let beside = |(index, light): (usize, Light)| Beside { index, light, uniform: uniform.lit_by(&light) };
        self.beside = shown.into_iter().map(beside).collect();
        self.frames.retain(|index, _| lamps.get(*index).is_some_and(|lamp| lamp.on));
        if self.passes.is_none() && !self.beside.is_empty() {
            self.passes = Some(Passes::new(gpu)?);
        }
        Ok(())
    }

    /// The lights whose truths are kept.
    pub(super) fn all(&self) -> &[Light] {
        &self.all
    }

    /// What the other lights give the surfaces of the last frame; `truth`: shadowed by the truth. None: nothing.
    pub(super) fn sum(&self, truth: bool) -> Option<&wgpu::TextureView> {
        if self.beside.is_empty() {
            return None;
        }
        if truth { self.true_sum.view().filter(|_| self.truths) } else { self.sum.view() }
    }

    /// Of so many rows that have the truth of the light at work those that have the others' too.
    pub(super) fn rows(&self, own: u32) -> u32 {
        if self.truths { own.min(self.rows) } else { own }
    }

    /// Rays of the other lights, where there are any.
    pub(super) fn tally(&self) -> Option<&Buffer> {
        self.passes.as_ref().filter(|_| !self.beside.is_empty()).map(|p| &p.tally)
    }

    /// Draws their shadows, one after the other, and adds up what they give the surfaces. `frozen`: what passes that make maps
    /// find instead of the picture's own, and the uniform among that. `unshadowed` fills the visibility where the technique does
    /// not serve a light.
    pub(super) fn draw(
        &mut self,
        f: &mut Frame,
        made: &mut Made,
        (frozen, shadow): (&[(&'static str, Resource)], Option<FrameUniform>),
        unshadowed: &Pass,
    ) -> Result<()> {
        let (Some(passes), false) = (&self.passes, self.beside.is_empty()) else { return Ok(()) };
        let (gpu, info) = (f.recorder.gpu, made.info);
        // Of a technique's pass the light at work is shown.
        let watched = f.recorder.look_away();
        if watched.as_ref().is_some_and(|w| w.0 == PASS) {
            f.recorder.look_again(watched);
        }
        (f.view, f.inspected, f.whole_maps) = ("shaded", false, false);
        let visibility = self.visibility.get(gpu, "another light's visibility", f.size, Format::R32Float, STORED);
        let sum = self.sum.get(gpu, "other lights", f.size, Format::Rgba16Float, super::DRAWN);
        gpu.queue.write_buffer(&passes.tally, 0, bytemuck::cast_slice(&[0u32; 4]));
        f.recorder.set("tally", &passes.tally);
        f.recorder.set("visibility", &visibility);
        f.recorder.set("visibility_out", &visibility);
        let averaged = |[now, wanted]: [u32; 2]| f64::from(now) / f64::from(wanted);
        for (nth, beside) in self.beside.iter().enumerate() {
            let empty =
                || gpu.buffer("another light's frame", &[0; size_of::<FrameUniform>()], wgpu::BufferUsages::UNIFORM);
            let frames = self.frames.entry(beside.index).or_insert_with(|| [empty(), empty()]);
            gpu.queue.write_buffer(&frames[0], 0, bytemuck::bytes_of(&beside.uniform));
            f.recorder.set("frame", &frames[0]);
            let mut own = frozen.to_vec();
            if let Some(shadow) = shadow {
                let uniform = shadow.lit_by(&beside.light);
                gpu.queue.write_buffer(&frames[1], 0, bytemuck::bytes_of(&uniform));
                own.iter_mut().filter(|(name, _)| *name == "frame").for_each(|(_, r)| *r = (&frames[1]).into());
            }
            f.recorder.freeze(own);
            f.recorder.of_light(Some(beside.index));
            (f.light, f.lamp) = (beside.light, beside.index);
            let frames = std::mem::replace(&mut f.frames, [1, 1]);
            if info.refuses(&beside.light).is_none() {
                made.render(f, beside.index)?;
            } else {
                f.recorder.run(unshadowed).per_pixel();
            }
            if averaged(frames) < averaged(f.frames) {
                f.frames = frames;
            }
            f.recorder.of_light(None);
            let indirect = f.indirect.take();
            let mut begun = nth > 0;
            if indirect.as_ref().is_none_or(|light| light.direct > 0.0) {
                f.recorder.run(&passes.add).uncounted().draw(&[&sum], None, !begun, |p| p.draw(0..3, 0..1));
                begun = true;
            }
            if let Some(light) = indirect {
                let run = f.recorder.run(&passes.add_indirect).bind("indirect", &light.view).uncounted();
                run.draw(&[&sum], None, !begun, |p| p.draw(0..3, 0..1));
            }
        }
        f.recorder.freeze(Vec::new());
        f.recorder.look_again(watched);
        Ok(())
    }

    /// Traces more of their truths, about as many pixels' samples as given, once that of the light at work is as far as it
    /// is to be, and goes back to that one. How far all of them together are, `own` being how far that one is.
    fn trace(&mut self, with: &mut Tracer, recorder: &mut Recorder, mut pixels: u64, own: Progress) -> Progress {
        let Tracer { truth, gbuffer, vertices } = with;
        let (Some((revision, camera, samples)), Some((light, uniform))) = (self.of, self.own) else { return own };
        let gpu = recorder.gpu;
        let (mut all, mut count) = (own, 1.0f32);
        (self.rows, self.traced) = (u32::MAX, 0);
        for beside in &self.beside {
            if techniques::TRUTH.refuses(&beside.light).is_some() {
                continue;
            }
            recorder.submit();
            truth.start((revision, camera, beside.light), &self.all, samples, gpu, &beside.uniform);
            let before = truth.progress();
            if pixels > 0 && before.done < 1.0 {
                truth.record(recorder, gbuffer, *vertices, pixels.min(u32::MAX.into()) as u32);
            }
            let now = truth.progress();
            let traced = now.samples - before.samples;
            pixels = pixels.saturating_sub(traced);
            self.traced += traced;
            self.rows = self.rows.min(truth.rows());
            all.covered = all.covered.min(now.covered);
            all.samples += now.samples;
            (all.done, count) = (all.done + now.done, count + 1.0);
        }
        recorder.submit();
        truth.start((revision, camera, light), &self.all, samples, gpu, &uniform);
        // The mean of ones is one.
        all.done = if all.done >= count { 1.0 } else { (all.done / count).min(0.999_999) };
        all
    }

    /// Adds up what they give the surfaces with their truths, as far as these are traced. The recorder knows the G-buffer.
    fn add_truths(
        &mut self,
        truth: &mut Tracing,
        recorder: &mut Recorder,
        unshadowed: &Pass,
        size: [u32; 2],
    ) -> Result<()> {
        let (Some((revision, camera, samples)), Some((light, uniform))) = (self.of, self.own) else { return Ok(()) };
        let Some(passes) = &self.passes else { return Ok(()) };
        let gpu = recorder.gpu;
        let sum = self.true_sum.get(gpu, "other lights, truly", size, Format::Rgba16Float, super::DRAWN);
        for (nth, beside) in self.beside.iter().enumerate() {
            let frame = &self.frames.get(&beside.index).context(NO_FRAME)?[0];
            let seen = if techniques::TRUTH.refuses(&beside.light).is_some() {
                let open = self.visibility.get(gpu, "another light's visibility", size, Format::R32Float, STORED);
                recorder.run(unshadowed).bind("visibility_out", &open).per_pixel();
                open
            } else {
                recorder.submit();
                truth.start((revision, camera, beside.light), &self.all, samples, gpu, &beside.uniform);
                Targets::view(truth.shown().context(NO_FRAME)?)?.clone()
            };
            let run = recorder.run(&passes.add).bind("frame", frame).bind("visibility", &seen);
            run.uncounted().draw(&[&sum], None, nth == 0, |p| p.draw(0..3, 0..1));
        }
        recorder.submit();
        truth.start((revision, camera, light), &self.all, samples, gpu, &uniform);
        self.truths = true;
        Ok(())
    }

    /// Traces the other lights' truths and adds them up: [`Lights::trace`], then the sum.
    pub(super) fn true_light(
        &mut self,
        (of, size): ((u64, Camera, u32), [u32; 2]),
        mut with: Tracer,
        recorder: &mut Recorder,
        unshadowed: &Pass,
        (pixels, own): (u64, Progress),
    ) -> Result<Progress> {
        if self.beside.is_empty() {
            return Ok(own);
        }
        self.of = Some(of);
        let all = self.trace(&mut with, recorder, pixels, own);
        self.add_truths(with.truth, recorder, unshadowed, size)?;
        Ok(all)
    }

    /// As [`Lights::trace`], where the last frame's truth is of all lights.
    pub(super) fn trace_on(
        &mut self,
        mut with: Tracer,
        recorder: &mut Recorder,
        pixels: u64,
        own: Progress,
    ) -> Progress {
        if self.truths { self.trace(&mut with, recorder, pixels, own) } else { own }
    }
}

impl Renderer {
    /// Milliseconds of the technique's passes for each light of the last frame that was timed, entered into what it told.
    pub fn time_lights(&self, lights: &mut [ToldLight]) {
        lights.iter_mut().for_each(|l| l.ms = super::technique_ms(&self.timer.of_light(l.light)));
    }

    /// Traces all of the other lights' truths for the last frame, which showed all lights, and adds up what they give.
    pub(super) fn trace_other_lights(&mut self, setup: &Setup) -> Result<()> {
        if self.lights.beside.is_empty() {
            return Ok(());
        }
        let (t, size) = (&self.targets, self.targets.size()?);
        let mut recorder = Recorder::new(&self.gpu, &mut self.timer, false, size);
        know_scene(&mut recorder, &self.scene_gpu);
        recorder.set("g_position", Targets::view(&t.position)?);
        recorder.set("g_surface", Targets::view(&t.surface)?);
        let of = (self.revision, setup.camera, setup.shown_samples());
        let own = self.truth.progress();
        let vertices = self.scene_gpu.triangle_count * 3;
        let with = Tracer { truth: &mut self.truth, gbuffer: &self.gbuffer, vertices };
        self.lights.true_light((of, size), with, &mut recorder, &self.unshadowed, (u64::MAX, own))?;
        let finished = recorder.finish().and_then(|()| self.gpu.check());
        if finished.is_err() {
            self.truth.forget();
        }
        finished
    }
}
