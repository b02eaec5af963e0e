//! Times of a technique: many frames, warm-up left out, median with quartiles.

use crate::frame::{Ask, Renderer, SHARED_PASSES, Truth};
use crate::gpu::TimerMode;
use crate::setup::Setup;
use anyhow::{Result, ensure};
use std::time::{Duration, Instant};

/// Middle and quartiles of the counted frames, milliseconds.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Quartiles {
    pub median: f64,
    pub q1: f64,
    pub q3: f64,
    /// Frames counted.
    pub frames: usize,
}

impl Quartiles {
    /// Of at least one value, in any order.
    pub fn of(mut values: Vec<f64>) -> Quartiles {
        values.sort_by(f64::total_cmp);
        let at = |q: f64| {
            let x = (values.len() - 1) as f64 * q;
            let (i, t) = (x as usize, x.fract());
            values[i] + (values[(i + 1).min(values.len() - 1)] - values[i]) * t
        };
        Quartiles { median: at(0.5), q1: at(0.25), q3: at(0.75), frames: values.len() }
    }
}

/// Times of one technique.
#[derive(Clone, Debug)]
pub struct Times {
    /// All of the technique's passes together.
    pub gpu: Quartiles,
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
/// On a software adapter, counting stops after this time, but not before `FEWEST` frames.
const BUDGET: Duration = Duration::from_secs(3);
const FEWEST: usize = 5;

/// Times the set-up's technique; also the bytes of GPU memory that it holds.
pub fn time(renderer: &mut Renderer, setup: &Setup, tick: impl Fn(f32) -> bool) -> Result<(Times, u64)> {
    // A technique's own map would add passes that are not part of it.
    let setup = &Setup { view: "shaded".into(), ..setup.clone() };
    let ask = Ask { size: setup.size, truth: Truth::Off, timed: true, picture: false };
    let software = renderer.gpu.software();
    let (mut totals, mut cpu, mut gpu_bytes) = (Vec::new(), Vec::new(), 0);
    let mut passes: Vec<(String, Vec<f64>)> = Vec::new();
    for _ in 0..if software { 1 } else { WARM_UP } {
        renderer.render(setup, ask)?;
        renderer.gpu.wait()?;
    }
    renderer.collect_times(true)?;
    let start = Instant::now();
    for frame in 0..FRAMES {
        if software && frame >= FEWEST && start.elapsed() > BUDGET {
            break;
        }
        let told = renderer.render(setup, ask)?;
        renderer.collect_times(true)?;
        cpu.push(told.cpu_ms);
        gpu_bytes = told.gpu_bytes;
        let frame_passes = renderer.timer.by_name();
        totals.push(frame_passes.iter().filter(|(n, _)| !SHARED_PASSES.contains(n)).map(|(_, ms)| ms).sum());
        for (name, ms) in frame_passes {
            match passes.iter_mut().find(|(n, _)| n == name) {
                Some((_, all)) => all.push(ms),
                None => passes.push((name.into(), vec![ms])),
            }
        }
        let spent = start.elapsed().as_secs_f32() / BUDGET.as_secs_f32();
        let done = if software { spent.min(1.0) } else { (frame + 1) as f32 / FRAMES as f32 };
        ensure!(tick(done), "measuring was cancelled");
    }
    let times = Times {
        gpu: Quartiles::of(totals),
        passes: passes.into_iter().map(|(name, all)| (name, Quartiles::of(all))).collect(),
        cpu_ms: Quartiles::of(cpu).median,
        wall_clock: renderer.timer.mode() == TimerMode::Wall,
    };
    Ok((times, gpu_bytes))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quartiles_interpolate() {
        let q = Quartiles::of(vec![4.0, 1.0, 3.0, 2.0, 5.0]);
        assert_eq!((q.q1, q.median, q.q3, q.frames), (2.0, 3.0, 4.0, 5));
        assert_eq!(Quartiles::of(vec![1.0, 2.0]).median, 1.5);
    }
}
