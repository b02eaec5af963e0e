//! When to render what: few pixels while something moves, all of them at rest, then the exact shadow.

use super::model::{Model, Tab, Traced};
use super::work::{Desk, Done};
use crate::frame::{Ask, Renderer, Truth};
use crate::gpu::TimerMode;
use crate::measure::{Record, metrics, params_text};
use crate::setup::Setup;
use crate::techniques;
use crate::truth::{Progress, Samples};
use anyhow::Result;
use glam::Vec3;
use std::time::{Duration, Instant};

/// Shares of the viewport's side that are rendered at.
const SCALES: [f64; 6] = [1.0, 0.75, 0.5, 0.375, 0.25, 1.0 / 6.0];
/// Milliseconds that a frame may take while the scene moves; while only the technique or the view changes; and
/// then, where the truth is there already, which fewer pixels would lose.
const MOVING_MS: f64 = 50.0;
const TUNING_MS: f64 = 160.0;
const KEEPING_MS: f64 = 400.0;
/// At rest the picture goes straight to full resolution, if that takes no longer.
const STEP_MS: f64 = 120.0;
/// Milliseconds of truth that are traced between two frames at rest.
const TRUTH_MS: f64 = 60.0;
/// What counts as rest.
const SETTLE: Duration = Duration::from_millis(180);
/// Frames kept for the chart.
const RECENT: usize = 200;

/// When to come again.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Next {
    Now,
    In(Duration),
    /// Not before something changes.
    Rest,
}

/// What changed since the last frame.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Change {
    Nothing,
    /// The way to look at it; errors stay.
    View,
    /// The technique; the truth stays.
    Technique,
    /// What is seen.
    Scene,
}

/// Renders the viewport's picture, a frame at a time.
pub struct Stage {
    pub renderer: Renderer,
    drawn: Option<Setup>,
    full: [u32; 2],
    size: [u32; 2],
    scale: f64,
    changed: Instant,
    change: Change,
    /// Nanoseconds a pixel, of all passes but the truth and of the truth.
    cost: f64,
    truth_cost: f64,
    /// Samples of pixels that the last frame traced of the truth.
    truth_samples: f64,
    traced: Progress,
    /// How much of the truth is in the picture drawn last, and whether that frame lets it go on alone.
    drawn_truth: Progress,
    traceable: bool,
    /// The last frame made do with one sample a pixel where more are wanted.
    coarse: bool,
    picture: Option<wgpu::Texture>,
    /// The picture is an earlier, complete one of fewer pixels.
    keeping: bool,
    /// Frames since the size changed.
    steady: u32,
    failed: bool,
    /// The errors have been asked for; those of some picture are being counted.
    counting: bool,
    pending: bool,
    /// Counts the changes, so that late errors are known as such.
    generation: u64,
    awaiting_times: u32,
}

impl Stage {
    pub fn new(renderer: Renderer) -> Stage {
        // Before anything is timed: half a GPU's worth of caution for software.
        let cost = if renderer.gpu.software() { 250.0 } else { 2.0 };
        Stage {
            renderer,
            drawn: None,
            full: [0; 2],
            size: [0; 2],
            scale: 1.0,
            changed: Instant::now(),
            change: Change::Scene,
            cost,
            truth_cost: cost * 2.0,
            truth_samples: 0.0,
            traced: Progress::default(),
            drawn_truth: Progress::default(),
            traceable: false,
            coarse: false,
            picture: None,
            keeping: false,
            steady: 0,
            failed: false,
            counting: false,
            pending: false,
            generation: 0,
            awaiting_times: 0,
        }
    }

    /// The picture, once there is one that belongs to the set-up.
    pub fn picture(&self) -> Option<&wgpu::Texture> {
        self.picture.as_ref()
    }

    /// Renders the model's set-up for a viewport of `full` pixels, if that is due.
    pub fn frame(&mut self, m: &mut Model, full: [u32; 2], desk: &Desk) -> Next {
        if full.contains(&0) {
            return Next::Rest;
        }
        let change = self.what_changed(&m.setup, full);
        if change > Change::Nothing {
            let settled = self.changed.elapsed() > SETTLE;
            self.change = if settled { change } else { self.change.max(change) };
            self.changed = Instant::now();
            self.failed = false;
        }
        if change > Change::View {
            self.generation += 1;
            self.counting = false;
            m.facts.error = None;
            m.facts.notes.clear();
        }
        self.full = full;
        m.facts.full = full;
        if self.failed {
            return Next::Rest;
        }
        let rest = self.changed.elapsed() >= SETTLE && !m.moving();
        let served = techniques::TRUTH.refuses(&m.setup.light).is_none();
        let shown = served && m.setup.needs_truth();
        let scale = self.next_scale(rest, shown);
        let size = full.map(|side| ((side as f64 * scale).round() as u32).max(1));
        let refining = scale < 1.0;
        let missing = served && (self.traced.done < 1.0 || self.coarse);
        let still = change == Change::Nothing && size == self.size && rest && !refining;
        // The truth may have been completed by a frame that drew no picture.
        let mut redraw = self.keeping && self.traced.covered >= 1.0;
        if still && missing && self.traceable && !self.coarse {
            match self.trace() {
                Ok(()) => self.times(m),
                Err(e) => {
                    m.fail(&e);
                    self.failed = true;
                    return Next::Rest;
                }
            }
            // Whole rows first, then a better mean of all.
            let (now, drawn) = (self.traced, self.drawn_truth);
            let covered = now.covered >= 1.0 && (self.keeping || drawn.covered < 1.0);
            let step = !self.keeping && (now.covered - drawn.covered >= 0.2 || now.done - drawn.done >= 0.2);
            redraw = shown && (covered || now.done >= 1.0 || step);
            if !redraw {
                m.facts.traced = match self.traced.done < 1.0 {
                    // What covers the untraced part of the picture fits the picture that is shown.
                    true if shown && !self.keeping => Traced::Partly(Progress { covered: drawn.covered, ..now }),
                    true => Traced::Partly(now),
                    false => Traced::Fully,
                };
                return Next::Now;
            }
        }
        let due = redraw
            || change > Change::Nothing
            || size != self.size
            || (rest && missing && !refining)
            || self.drawn.is_none();
        if !due {
            self.times(m);
            if rest && !refining && served && !missing && !self.counting {
                self.count(m, desk);
            }
            let waiting = self.awaiting_times > 0;
            return match (rest, waiting) {
                (true, false) => Next::Rest,
                (true, true) => Next::In(Duration::from_millis(30)),
                (false, _) => Next::In(SETTLE.saturating_sub(self.changed.elapsed()).max(Duration::from_millis(1))),
            };
        }
        // While the scene moves every frame needs all of its truth: what an earlier frame left would be a lie. One sample
        // a pixel must do until it rests.
        let several = m.setup.truth_samples.shown(m.info()) > 1;
        self.coarse = several && (refining || !rest && self.change == Change::Scene);
        let samples = if self.coarse { Samples::Fixed(1) } else { m.setup.truth_samples };
        let setup = Setup { truth_samples: samples, ..m.setup.clone() };
        let truth = match () {
            _ if !served => Truth::Off,
            _ if rest && !refining => Truth::Some((TRUTH_MS * 1e6 / self.truth_cost) as u32),
            _ if shown && self.change == Change::Scene => Truth::All,
            _ if shown => Truth::Some((TRUTH_MS * 1e6 / self.truth_cost) as u32),
            _ => Truth::Off,
        };
        let before = if size == self.size && change < Change::Scene { self.traced.samples } else { 0 };
        self.steady = if size == self.size { self.steady + 1 } else { 0 };
        self.size = size;
        // A complete picture of fewer pixels stays until one of all pixels is complete too.
        let complete = |traced: Progress| shown && traced.covered >= 1.0;
        self.keeping = change == Change::Nothing && rest && !refining && !redraw && complete(self.drawn_truth);
        let ask = Ask { size, truth, analysis: false, timed: true, picture: !self.keeping, fresh: false };
        match self.renderer.draw(&setup, ask) {
            Ok(told) => {
                self.traced = told.truth;
                self.traceable = truth != Truth::Off;
                if ask.picture {
                    self.drawn_truth = told.truth;
                    self.picture = self.renderer.output().cloned();
                    m.reading = None;
                    m.facts.size = size;
                }
                self.truth_samples = told.truth.samples.saturating_sub(before) as f64;
                m.facts.told = told;
            }
            Err(e) => {
                m.fail(&e);
                self.failed = true;
                return Next::Rest;
            }
        }
        self.drawn = Some(m.setup.clone());
        self.scale = scale;
        self.awaiting_times = self.times_late();
        self.times(m);
        m.facts.keeping = self.keeping;
        m.facts.traced = match served {
            false => Traced::NotServed,
            true if refining => Traced::Partly(Progress::default()),
            true if self.traced.done < 1.0 || self.coarse => Traced::Partly(self.traced),
            true => Traced::Fully,
        };
        if refining && shown && self.traced.done >= 1.0 {
            // A complete truth at fewer pixels: right as far as it goes.
            m.facts.traced = if self.coarse { Traced::Partly(self.traced) } else { Traced::Fully };
        }
        // The chart's live point follows while sliders move, as fast as pictures are counted.
        let followed = m.drawer == Some(Tab::Chart) && !self.pending;
        if followed && served && !self.coarse && self.traced.done >= 1.0 && self.size == self.full {
            self.count(m, desk);
        }
        Next::Now
    }

    fn what_changed(&self, setup: &Setup, full: [u32; 2]) -> Change {
        let Some(d) = &self.drawn else { return Change::Scene };
        let scene = |s: &Setup| (s.camera, s.light, s.time, s.animation, s.seed);
        if full != self.full || scene(d) != scene(setup) {
            return Change::Scene;
        }
        let technique = |s: &Setup| (s.technique.clone(), s.truth_samples, s.shadow_camera);
        let sides = d.against != setup.against;
        if sides || technique(d) != technique(setup) || d.params.get(&d.technique) != setup.params.get(&setup.technique)
        {
            return Change::Technique;
        }
        let look = |s: &Setup| (s.view.clone(), s.split, s.arrange, s.front, s.overlay.clone(), s.outlines);
        if look(d) != look(setup) { Change::View } else { Change::Nothing }
    }

    /// The share of the side to render at next.
    fn next_scale(&self, rest: bool, truth: bool) -> f64 {
        let pixels = self.full[0] as f64 * self.full[1] as f64;
        if rest {
            // In steps, so that a touch in between does not wait for the whole picture.
            let straight = pixels * self.cost * 1e-6 <= STEP_MS || self.drawn.is_none() || self.scale >= 0.5;
            return if straight { 1.0 } else { (self.scale * 2.0).min(1.0) };
        }
        // Only what moves needs all of its truth in every frame.
        let moving = self.change == Change::Scene;
        let predicted = pixels * (self.cost + if moving && truth { self.truth_cost } else { 0.0 }) * 1e-6;
        let allowed = match moving {
            true => MOVING_MS,
            false if self.traced.done >= 1.0 && self.size == self.full => KEEPING_MS,
            false => TUNING_MS,
        };
        let wanted = (allowed / predicted.max(1e-3)).sqrt();
        // A little room before more pixels are drawn, so that the size does not swing.
        let fits = |s: &f64| if *s > self.scale { *s * 1.2 <= wanted } else { *s <= wanted * 1.1 };
        SCALES.iter().copied().find(fits).unwrap_or(SCALES[SCALES.len() - 1])
    }

    /// Takes in pass times that have arrived.
    fn times(&mut self, m: &mut Model) {
        if self.awaiting_times == 0 {
            return;
        }
        let stamps = self.renderer.timer.mode() == TimerMode::Stamps;
        if stamps {
            // Errors of polling show when the frame's own check runs.
            let _ = self.renderer.gpu.device.poll(wgpu::PollType::Poll);
        }
        if let Err(e) = self.renderer.collect_times(false) {
            m.fail(&e);
        }
        self.awaiting_times -= 1;
        let f = &mut m.facts;
        f.wall_clock = !stamps;
        let latest = &self.renderer.timer.latest;
        let traced: f64 = latest.iter().filter(|p| p.0 == "truth").map(|p| p.1).sum();
        if traced > 0.0 && self.truth_samples > 0.0 {
            let cost = (traced * 1e6 / self.truth_samples).max(0.01);
            self.truth_cost = cost.clamp(self.truth_cost / 4.0, self.truth_cost * 4.0);
        }
        if latest.iter().all(|p| p.0 == "truth") {
            // The truth went on alone: the list keeps the last whole frame.
            return;
        }
        f.passes = self.renderer.timer.by_name();
        // Timestamps come some frames late: those of another size do not count.
        if f.passes.is_empty() || (stamps && self.steady < 3 && self.awaiting_times > 5) {
            return;
        }
        let pixels = self.size[0] as f64 * self.size[1] as f64;
        let cost = (f.frame_ms() - traced) * 1e6 / pixels;
        self.cost += (cost.max(0.01) - self.cost) * 0.6;
        if self.size == self.full && !stamps || self.awaiting_times == 19 {
            if f.recent.len() == RECENT {
                f.recent.pop_front();
            }
            f.recent.push_back(f.technique_ms());
        }
    }

    /// Goes on with the truth alone; the picture stays.
    fn trace(&mut self) -> Result<()> {
        let before = self.traced.samples;
        self.traced = self.renderer.trace((TRUTH_MS * 1e6 / self.truth_cost) as u32)?;
        self.truth_samples = self.traced.samples.saturating_sub(before) as f64;
        self.awaiting_times = self.times_late();
        Ok(())
    }

    /// Passes after which times are no longer waited for.
    fn times_late(&self) -> u32 {
        if self.renderer.timer.mode() == TimerMode::Stamps { 20 } else { 1 }
    }

    /// Has the errors of the picture counted.
    fn count(&mut self, m: &mut Model, desk: &Desk) {
        self.counting = true;
        self.pending = true;
        if let Err(e) = self.start_counting(m, desk) {
            self.pending = false;
            m.fail(&e);
        }
    }

    /// Reads back what the errors need, and has them counted on a thread.
    fn start_counting(&mut self, m: &mut Model, desk: &Desk) -> Result<()> {
        m.facts.notes = self.renderer.notes()?;
        let visibility = self.renderer.read_visibility()?;
        let (hard, mean) = (self.renderer.read_hard_truth()?, self.renderer.read_truth()?);
        let mask = self.renderer.read_mask()?;
        let (width, generation) = (self.size[0] as usize, self.generation);
        let row = Record {
            technique: m.setup.technique.clone(),
            params: params_text(m.setup.values()),
            gpu_bytes: m.facts.told.gpu_bytes,
            gpu_ms: m.facts.technique_ms(),
            truth_samples: m.setup.truth_samples.shown(m.info()),
            ..Record::default()
        };
        desk.start(move |post| {
            let e = metrics::errors(&visibility, &hard, &mean, &mask, width);
            let boundary_p95_px = e.boundary.map(|b| b.p95 as f64);
            let (error_share, rmse, mae, beyond_tolerance) = (e.share(), e.rmse, e.mae, e.beyond_tolerance);
            let row = Record { error_share, rmse, mae, beyond_tolerance, boundary_p95_px, ..row };
            post.send(Done::Counted(generation, Box::new(row)));
        });
        Ok(())
    }

    /// Takes note that errors are counted; whether they belong to the present set-up.
    pub fn counted(&mut self, generation: u64) -> bool {
        self.pending = false;
        generation == self.generation
    }

    /// The surface point under a place of the viewport (0 to 1), if there is one.
    pub fn point_at(&self, at: [f32; 2]) -> Result<Option<Vec3>> {
        self.renderer.position_at(self.pixel(at))
    }

    /// What the view shows at a place of the viewport (0 to 1), in words, if it shows values.
    pub fn value_at(&self, at: [f32; 2]) -> Result<Option<String>> {
        self.renderer.value_at(self.pixel(at))
    }

    fn pixel(&self, at: [f32; 2]) -> [u32; 2] {
        [0, 1].map(|i| ((at[i] * self.size[i] as f32) as u32).min(self.size[i].saturating_sub(1)))
    }

    /// Makes all passes anew from changed shaders; on an error those in use stay.
    pub fn reload(&mut self, setup: &Setup) -> Result<()> {
        let mut renderer = Renderer::new(self.renderer.gpu.clone(), self.renderer.scene().clone())?;
        renderer.render(
            setup,
            Ask { size: [16, 16], truth: Truth::All, analysis: false, timed: false, picture: true, fresh: false },
        )?;
        *self = Stage::new(renderer);
        Ok(())
    }
}
