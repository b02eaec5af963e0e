//! Times of configurations: many frames, warm-up left out, taking turns so that drift hits all alike.

use crate::frame::{Ask, History, Made, Renderer, Truth, technique_ms};
use crate::gpu::{Gpu, Timer, TimerMode, Traffic};
use crate::setup::Setup;
use anyhow::{Result, ensure};
use std::sync::LazyLock;
use std::time::{Duration, Instant};

/// Middle, quartiles and certainty of the counted frames, milliseconds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Quartiles {
    pub median: f64,
    pub q1: f64,
    pub q3: f64,
    /// The true median lies between these with 99.9 % certainty, whatever the distribution.
    pub low: f64,
    pub high: f64,
    /// Frames counted.
    pub frames: usize,
}

impl Quartiles {
    /// Of at least one value, in any order.
    pub fn of(mut values: Vec<f64>) -> Quartiles {
        values.sort_by(f64::total_cmp);
        let n = values.len();
        let at = |q: f64| {
            let x = (n - 1) as f64 * q;
            let (i, t) = (x as usize, x.fract());
            values[i] + (values[(i + 1).min(n - 1)] - values[i]) * t
        };
        // The order statistics between which the median lies; with few values the smallest and the largest.
        let half = 3.29 * (n as f64).sqrt() / 2.0;
        let low = (n as f64 / 2.0 - half).floor().max(0.0) as usize;
        let high = ((n as f64 / 2.0 + half).ceil() as usize).min(n - 1);
        Quartiles { median: at(0.5), q1: at(0.25), q3: at(0.75), low: values[low], high: values[high], frames: n }
    }
}

/// Times of one configuration.
#[derive(Clone, Debug, Default)]
pub struct Times {
    /// All of the technique's passes together.
    pub gpu: Quartiles,
    /// The same of each light that is on, by its place among all from 0.
    pub lights: Vec<(usize, Quartiles)>,
    /// Every pass of the frame by name, the G-buffer's too.
    pub passes: Vec<(String, Quartiles)>,
    /// Recording the technique's passes on the CPU.
    pub cpu_ms: f64,
    /// Wall-clock times of passes submitted one by one instead of GPU timestamps.
    pub wall_clock: bool,
}

/// Frames counted on a GPU.
const FRAMES: usize = 100;
/// Frames before counting starts.
const WARM_UP: usize = 10;
/// A software adapter counts until this time has passed for each configuration, but not fewer frames than `FEWEST`.
/// `SHADOWSCOPE_TIMING` says another, in seconds.
static BUDGET: LazyLock<Duration> = LazyLock::new(|| {
    let said = std::env::var("SHADOWSCOPE_TIMING").ok().and_then(|s| s.parse().ok());
    Duration::try_from_secs_f64(said.unwrap_or(3.0)).unwrap_or(Duration::from_secs(3))
});
const FEWEST: usize = 11;

/// How long a configuration is timed at least whose frames take so many seconds.
pub fn seconds_for(frame: f64, software: bool) -> f64 {
    match software {
        true => BUDGET.as_secs_f64().max(FEWEST as f64 * frame) + frame,
        false => (WARM_UP + FRAMES) as f64 * frame,
    }
}

/// The frames of one configuration so far.
struct Lane<'a> {
    setup: &'a Setup,
    made: Option<Made>,
    totals: Vec<f64>,
    lights: Vec<(usize, Vec<f64>)>,
    cpu: Vec<f64>,
    passes: Vec<(&'static str, Vec<f64>)>,
}

/// Times configurations that take turns, a frame each: A B C A B C …. `tick` is told the share done, and stops the
/// work by saying no.
///
/// # Errors
/// What the device reports, or that it was stopped.
pub fn time(renderer: &mut Renderer, setups: &[Setup], tick: &mut dyn FnMut(f32) -> bool) -> Result<Vec<Times>> {
    // A technique's own map would add passes that are not part of it.
    let setups: Vec<Setup> = setups.iter().map(|s| s.measured()).collect();
    let mut lanes: Vec<Lane> = setups.iter().map(Lane::new).collect();
    let software = renderer.gpu.software();
    let budget = *BUDGET * lanes.len() as u32;
    for _ in 0..if software { 1 } else { WARM_UP } {
        for lane in &mut lanes {
            lane.frame(renderer, false)?;
            ensure!(tick(0.0), STOPPED);
        }
    }
    let start = Instant::now();
    for round in 0..FRAMES {
        if software && round >= FEWEST && start.elapsed() > budget {
            break;
        }
        for (i, lane) in lanes.iter_mut().enumerate() {
            lane.frame(renderer, true)?;
            let spent = start.elapsed().as_secs_f32() / budget.as_secs_f32();
            let rounds = round as f32 + (i + 1) as f32 / setups.len() as f32;
            // Both the budget must be spent and the fewest frames counted, or all of them.
            let enough = if software { spent.min(rounds / FEWEST as f32).min(1.0) } else { 0.0 };
            ensure!(tick(enough.max(rounds / FRAMES as f32)), STOPPED);
        }
    }
    let wall_clock = renderer.timer.mode() == TimerMode::Wall;
    Ok(lanes.into_iter().map(|lane| lane.times(wall_clock)).collect())
}

/// As [`time`], but on a software adapter only so many rounds, the first of all left out: for places along a way, of which there are
/// many.
///
/// # Errors
/// What the device reports.
pub fn briefly(renderer: &mut Renderer, setups: &[Setup], rounds: usize) -> Result<Vec<Times>> {
    if !renderer.gpu.software() {
        return time(renderer, setups, &mut |_| true);
    }
    let setups: Vec<Setup> = setups.iter().map(|s| s.measured()).collect();
    let mut lanes: Vec<Lane> = setups.iter().map(Lane::new).collect();
    for round in 0..=rounds {
        for lane in &mut lanes {
            lane.frame(renderer, round > 0)?;
        }
    }
    let wall_clock = renderer.timer.mode() == TimerMode::Wall;
    Ok(lanes.into_iter().map(|lane| lane.times(wall_clock)).collect())
}

/// What the passes of a frame of the set-up move, by name; the renderer's device must count it ([`Gpu::count_traffic`]).
///
/// # Errors
/// What the device reports.
pub fn traffic(renderer: &mut Renderer, setup: &Setup) -> Result<Vec<(&'static str, Traffic)>> {
    let setup = setup.measured();
    let mut lane = Lane::new(&setup);
    // What the first frame alone does is no part of it.
    lane.frame(renderer, false)?;
    let timer = std::mem::replace(&mut renderer.timer, Timer::with(TimerMode::Wall));
    renderer.timer.tell_traffic();
    let drawn = lane.frame(renderer, false);
    let told = std::mem::replace(&mut renderer.timer, timer).traffic();
    drawn.map(|()| told)
}

/// Bytes that the adapter moves in a second when it copies one buffer to another: read and written, the best of a few.
///
/// # Errors
/// What the device reports.
pub fn bandwidth(gpu: &Gpu) -> Result<f64> {
    const BYTES: u64 = 1 << 27;
    let usage = wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST;
    let [from, to] = ["copied", "copy"].map(|label| gpu.room(label, BYTES, usage));
    let mut best = f64::INFINITY;
    for _ in 0..6 {
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        (0..4).for_each(|_| encoder.copy_buffer_to_buffer(&from, 0, &to, 0, BYTES));
        gpu.wait()?;
        let start = Instant::now();
        gpu.queue.submit([encoder.finish()]);
        gpu.wait()?;
        best = best.min(start.elapsed().as_secs_f64());
    }
    gpu.check()?;
    Ok(8.0 * BYTES as f64 / best)
}

/// What is said where work was told to stop.
pub const STOPPED: &str = "measuring was cancelled";

impl Lane<'_> {
    fn new(setup: &Setup) -> Lane<'_> {
        let lights = setup.lit().into_iter().map(|(i, _)| (i, Vec::new())).collect();
        Lane { setup, made: None, totals: Vec::new(), lights, cpu: Vec::new(), passes: Vec::new() }
    }

    fn frame(&mut self, renderer: &mut Renderer, counted: bool) -> Result<()> {
        let ask = Ask {
            size: self.setup.size,
            truth: Truth::Off,
            analysis: false,
            timed: true,
            picture: false,
            fresh: true,
            history: History::Goes,
        };
        renderer.exchange(&mut self.made);
        let told = renderer.render(self.setup, ask);
        renderer.exchange(&mut self.made);
        let told = told?;
        renderer.collect_times(true)?;
        if counted {
            self.cpu.push(told.cpu_ms);
            let passes = renderer.timer.by_name();
            self.totals.push(technique_ms(&passes));
            for (light, all) in &mut self.lights {
                all.push(technique_ms(&renderer.timer.of_light(*light)));
            }
            for (name, ms) in passes {
                match self.passes.iter_mut().find(|(n, _)| *n == name) {
                    Some((_, all)) => all.push(ms),
                    None => self.passes.push((name, vec![ms])),
                }
            }
        }
        Ok(())
    }

    fn times(self, wall_clock: bool) -> Times {
        Times {
            gpu: Quartiles::of(self.totals),
            lights: self.lights.into_iter().map(|(light, all)| (light, Quartiles::of(all))).collect(),
            passes: self.passes.into_iter().map(|(name, all)| (name.into(), Quartiles::of(all))).collect(),
            cpu_ms: Quartiles::of(self.cpu).median,
            wall_clock,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quartiles_interpolate() {
        let q = Quartiles::of(vec![4.0, 1.0, 3.0, 2.0, 5.0]);
        assert_eq!((q.q1, q.median, q.q3, q.frames), (2.0, 3.0, 4.0, 5));
        assert_eq!((q.low, q.high), (1.0, 5.0), "five values say no more than their range");
        assert_eq!(Quartiles::of(vec![1.0, 2.0]).median, 1.5);
        let many = Quartiles::of((0..1000).map(f64::from).collect());
        assert!(many.low > 430.0 && many.low < 460.0 && many.high > 540.0 && many.high < 570.0, "{many:?}");
    }
}
