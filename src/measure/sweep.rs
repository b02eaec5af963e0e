//! Measures many configurations: accuracy one by one, times taking turns.

use super::advise::brief;
use super::record::{LightRow, Record};
use super::temporal::over_time;
use super::timing::{self, Times};
use super::{accuracy, accuracy::over_seeds, stability};
use crate::contact;
use crate::frame::Renderer;
use crate::gpu::{Failure, GivenUp};
use crate::params::Value;
use crate::setup::Setup;
use crate::techniques;
use anyhow::{Context, Error, Result, anyhow, ensure};
use std::cell::Cell;

/// What a sweep tells while it runs.
pub enum Step {
    /// Share done, 0 to 1, and what it is at.
    Working(f32, String),
    /// A configuration is measured.
    Row(Box<Record>),
    /// One cannot be, and why.
    Failed(Error),
}

/// Why a configuration could not be measured, with its name; the error itself where it is no fault of the configuration: frames are
/// no longer wanted, or the device is lost.
pub(super) fn failure(setup: &Setup, error: Error) -> Result<Error> {
    if error.is::<GivenUp>() || Failure::is_loss(&error) {
        return Err(error);
    }
    let name = format!("{} {}", setup.technique, brief(setup));
    Ok(anyhow!("{}: {error:#}", name.trim()))
}

/// Configurations that take turns in one timing: enough that drift cancels, few enough that their maps fit.
const TURNS: usize = 16;
const TURNS_BYTES: u64 = 2 << 30;
/// Plain maps: times are given as a multiple of the first that serves the light.
pub const PLAIN: [&str; 2] = ["shadow-map", "cube"];
/// Share of a configuration's work that its errors take, roughly: for the progress only.
const ERRORS_SHARE: f32 = 0.1;

/// What is measured beside errors and times.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct More {
    /// What changes while the camera moves.
    pub flicker: bool,
    /// Seeds over which noise and bias are told apart; below 2 they are not.
    pub seeds: u32,
    /// How long pictures settle, and lag behind a light that turns.
    pub temporal: bool,
}

/// Measures configurations, each with its place in a sweep of so many, in their order. `base` is the set-up that they
/// were made from: costs are multiples of its plain map's. `more`: what is measured besides.
/// `watch` is told of progress, of each row and of each configuration that cannot be measured, and stops the work by saying no.
///
/// # Errors
/// That it was stopped, or is no longer wanted.
pub fn run(
    renderer: &mut Renderer,
    base: &Setup,
    work: &[(u64, Setup)],
    configurations: u64,
    more: More,
    watch: &mut dyn FnMut(Step) -> bool,
) -> Result<()> {
    let total = work.len() as f32;
    let anchor = baseline(base, None)?.map(|(setup, _)| setup);
    let stopped = Cell::new(false);
    let mut watch = |step| {
        stopped.set(!watch(step));
        !stopped.get()
    };
    let mut rest = work;
    let mut done = 0.0;
    while !rest.is_empty() {
        let mut group: Vec<(Record, &Setup)> = Vec::new();
        let (mut taken, mut bytes) = (0, 0);
        for (index, setup) in rest.iter().take(TURNS) {
            ensure!(watch(Step::Working(done / total, format!("{}: errors", setup.technique))), timing::STOPPED);
            taken += 1;
            let measured = errors(renderer, setup, *index, more);
            done += ERRORS_SHARE;
            match measured {
                Ok(record) => {
                    bytes += record.gpu_bytes;
                    group.push((Record { configurations, ..record }, setup));
                }
                Err(e) => {
                    ensure!(watch(Step::Failed(failure(setup, e)?)), timing::STOPPED);
                    done += 1.0 - ERRORS_SHARE;
                }
            }
            if bytes > TURNS_BYTES {
                break;
            }
        }
        rest = &rest[taken..];
        // All together; where one of them fails, each by itself.
        let mut groups = vec![group];
        while let Some(mut group) = groups.pop().filter(|g| !g.is_empty()) {
            let share = (1.0 - ERRORS_SHARE) * group.len() as f32;
            let what = format!("{}: times", group[0].1.technique);
            let mut tick = |part: f32| watch(Step::Working((done + share * part) / total, what.clone()));
            match times(renderer, &mut group, anchor.as_ref(), &mut tick) {
                Ok(()) => {
                    for (record, _) in group {
                        ensure!(watch(Step::Row(Box::new(record))), timing::STOPPED);
                    }
                }
                Err(e) if stopped.get() => return Err(e),
                Err(e) => match group[..] {
                    [(_, setup)] => ensure!(watch(Step::Failed(failure(setup, e)?)), timing::STOPPED),
                    _ => {
                        groups.extend(group.into_iter().rev().map(|one| vec![one]));
                        continue;
                    }
                },
            }
            done += share;
        }
    }
    Ok(())
}

/// A row without times.
fn errors(renderer: &mut Renderer, setup: &Setup, index: u64, more: More) -> Result<Record> {
    let mut record = accuracy(renderer, setup, index)?;
    if more.seeds > 1 {
        let spread = over_seeds(renderer, setup, more.seeds)?;
        record.seeds = Some(more.seeds);
        record.seed_noise = Some(spread.noise);
        record.seed_bias = Some(spread.bias);
    }
    if more.temporal {
        let found = over_time(renderer, setup)?;
        record.settle_frames = found.settle_frames;
        record.settle_rmse = Some(found.settle_rmse);
        record.lag_frames = Some(found.lag_frames);
    }
    if more.flicker {
        let change = stability::flicker(renderer, setup)?;
        record.flicker = change.map(|c| c.flicker);
        record.label_flicker = change.map(|c| c.label_flicker);
    }
    Ok(record)
}

/// Times rows in turn with what their times are multiples of.
fn times(
    renderer: &mut Renderer,
    rows: &mut [(Record, &Setup)],
    anchor: Option<&Setup>,
    tick: &mut dyn FnMut(f32) -> bool,
) -> Result<()> {
    let setups: Vec<Setup> = rows.iter().map(|(_, s)| (*s).clone()).collect();
    let (mut lanes, baselines) = with_baselines(&setups)?;
    let anchor = anchor.map(|a| lane_of(&mut lanes, a));
    let times = timing::time(renderer, &lanes, tick)?;
    for (i, (record, _)) in rows.iter_mut().enumerate() {
        enter(record, &times[i]);
        if let Some((lane, resolution)) = baselines[i] {
            record.ratio = Some(record.gpu_ms / times[lane].gpu.median);
            record.ratio_resolution = Some(resolution);
        }
        record.cost = anchor.map(|lane| record.gpu_ms / times[lane].gpu.median);
    }
    Ok(())
}

/// Enters times into a row.
fn enter(record: &mut Record, times: &Times) {
    let t = &times.gpu;
    record.gpu_ms = t.median;
    record.gpu_ms_q1 = t.q1;
    record.gpu_ms_q3 = t.q3;
    record.gpu_ms_low = t.low;
    record.gpu_ms_high = t.high;
    record.frames = t.frames;
    let mut lights = record.per_light();
    for light in &mut lights {
        let timed = times.lights.iter().find(|(i, _)| *i as u64 + 1 == light.number);
        light.gpu_ms = timed.map_or(0.0, |(_, q)| q.median);
    }
    record.per_light = LightRow::text(&lights);
    record.cpu_ms = times.cpu_ms;
    let passes = times.passes.iter().map(|(name, q)| format!("{name}={:.4}|{:.4}|{:.4}", q.median, q.q1, q.q3));
    record.passes = passes.collect::<Vec<_>>().join(";");
    record.wall_clock = times.wall_clock;
}

/// Times one configuration in turn with what its cost is a multiple of, and enters both into its row.
pub fn time_one(
    renderer: &mut Renderer,
    record: &mut Record,
    setup: &Setup,
    anchor: Option<&Setup>,
    tick: &mut dyn FnMut(f32) -> bool,
) -> Result<()> {
    let mut lanes = vec![setup.clone()];
    let base = anchor.map(|a| lane_of(&mut lanes, a));
    let times = timing::time(renderer, &lanes, tick)?;
    enter(record, &times[0]);
    record.cost = base.map(|lane| record.gpu_ms / times[lane].gpu.median);
    Ok(())
}

/// The set-up with the plain map that serves its light, at a resolution or its own (around a lamp that of a face), and that
/// resolution.
pub fn baseline(setup: &Setup, resolution: Option<&Value>) -> Result<Option<(Setup, u32)>> {
    let serves = |id: &&str| techniques::find(id).is_some_and(|info| setup.refusal(info).is_none());
    let Some(plain) = PLAIN.into_iter().find(serves) else {
        return Ok(None);
    };
    let mut base = setup.clone();
    base.select(plain)?;
    let values = base.params.entry(plain.into()).or_default();
    contact::turn_off(values);
    if let Some(resolution) = resolution {
        values.insert("resolution".into(), resolution.clone());
    }
    Ok(match values.get("resolution") {
        Some(Value::Int(side)) => {
            let side = *side as u32;
            Some((base, side))
        }
        _ => None,
    })
}

/// For each configuration which lane is its baseline, at what resolution.
type Baselines = Vec<Option<(usize, u32)>>;

/// The set-ups to time, with baselines of the same resolution added where they are not among them.
fn with_baselines(setups: &[Setup]) -> Result<(Vec<Setup>, Baselines)> {
    let mut lanes = setups.to_vec();
    let mut baselines = Vec::new();
    for setup in setups {
        let Some((base, resolution)) = baseline(setup, setup.values().get("resolution"))? else {
            baselines.push(None);
            continue;
        };
        baselines.push(Some((lane_of(&mut lanes, &base), resolution)));
    }
    Ok((lanes, baselines))
}

/// The place of a baseline among set-ups, added if it is not there.
fn lane_of(lanes: &mut Vec<Setup>, base: &Setup) -> usize {
    let same = |s: &Setup| s.technique == base.technique && s.meaningful() == base.meaningful() && s.size == base.size;
    lanes.iter().position(same).unwrap_or_else(|| {
        lanes.push(base.clone());
        lanes.len() - 1
    })
}

/// A part of a sweep: every `of`-th configuration from `part` on (1 to `of`).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    pub part: u64,
    pub of: u64,
}

impl Shard {
    /// Reads `i/n`.
    pub fn parse(text: &str) -> Result<Shard> {
        let numbers = text.split_once('/').and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
        let (part, of) = numbers.with_context(|| format!("--shard {text}: write it as i/n, such as 2/8"))?;
        ensure!(of > 0, "--shard {text}: there are no 0 parts; the second number takes 1 and more");
        ensure!((1..=of).contains(&part), "--shard {text}: the first number takes 1 to {of}");
        Ok(Shard { part, of })
    }

    /// Whether the configuration with this index belongs to it.
    pub fn has(&self, index: u64) -> bool {
        index % self.of == self.part - 1
    }
}
