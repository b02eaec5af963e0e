//! What a frame took: times of its passes, triangles and fragments of its draws.

use super::{Gpu, Traffic};
use anyhow::{Result, anyhow};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// How passes are timed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TimerMode {
    /// GPU timestamps at the start and end of each pass.
    Stamps,
    /// Each pass submitted alone and waited for: wall-clock time, for software adapters and those without timestamps.
    Wall,
}

/// Times of passes, by name, in milliseconds.
pub struct Timer {
    pub(super) mode: TimerMode,
    /// Timestamps of so many passes each, and what they are resolved into; as many as a frame has needed.
    queries: Vec<(wgpu::QuerySet, wgpu::Buffer)>,
    pub(super) names: Vec<&'static str>,
    /// For which light each of them was recorded.
    pub(super) lights: Vec<Option<usize>>,
    pub(super) wall: Vec<f64>,
    /// Work on the CPU that belongs to the frame.
    pub(super) noted: Vec<(&'static str, f64)>,
    pub(super) pending: Vec<Pending>,
    /// The last complete frame.
    pub latest: Vec<(&'static str, f64)>,
    /// As many, behind what is noted.
    pub(super) latest_lights: Vec<Option<usize>>,
    /// What the passes of a frame that waits for each of them move, by name, where somebody asks ([`Timer::tell_traffic`]).
    pub(super) traffic: Option<Vec<(&'static str, Traffic)>>,
}

/// Timestamps on their way back.
pub(super) struct Pending {
    pub(super) staging: wgpu::Buffer,
    pub(super) names: Vec<&'static str>,
    pub(super) lights: Vec<Option<usize>>,
    pub(super) noted: Vec<(&'static str, f64)>,
    pub(super) ready: Arc<AtomicBool>,
}

/// Passes of one query set.
const SET: u32 = 256;

impl Timer {
    /// The way that can be trusted on the adapter: timestamps, or wall clock on software (lavapipe's compute
    /// timestamps are wrong once a render pass has run) and where there are none.
    pub fn new(gpu: &Gpu) -> Timer {
        let stamps = gpu.abilities.features.contains(wgpu::Features::TIMESTAMP_QUERY) && !gpu.software();
        Timer::with(if stamps { TimerMode::Stamps } else { TimerMode::Wall })
    }

    /// A way of one's choice; timestamps need the feature.
    pub fn with(mode: TimerMode) -> Timer {
        Timer {
            mode,
            queries: Vec::new(),
            names: Vec::new(),
            lights: Vec::new(),
            wall: Vec::new(),
            noted: Vec::new(),
            pending: Vec::new(),
            latest: Vec::new(),
            latest_lights: Vec::new(),
            traffic: None,
        }
    }

    /// Has the passes of frames from here on add up what they move, where each of them is waited for.
    pub fn tell_traffic(&mut self) {
        self.traffic = Some(Vec::new());
    }

    /// What passes moved since it was asked for, those of equal names added up, in order of first appearance.
    pub fn traffic(&self) -> Vec<(&'static str, Traffic)> {
        let mut sums: Vec<(&'static str, Traffic)> = Vec::new();
        for (name, moved) in self.traffic.iter().flatten() {
            match sums.iter_mut().find(|s| s.0 == *name) {
                Some(sum) => sum.1 = sum.1.and(*moved),
                None => sums.push((name, *moved)),
            }
        }
        sums
    }

    /// Where the pass that is recorded next puts its timestamps: a set, and the first of two places in it.
    pub(super) fn stamps(&mut self, gpu: &Gpu) -> (wgpu::QuerySet, u32) {
        let (i, at) = (self.names.len() / SET as usize, self.names.len() as u32 % SET);
        if i == self.queries.len() {
            let set = gpu.device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("pass times"),
                ty: wgpu::QueryType::Timestamp,
                count: SET * 2,
            });
            let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("pass times"),
                size: SET as u64 * 16,
                usage: wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            });
            self.queries.push((set, buffer));
        }
        (self.queries[i].0.clone(), at * 2)
    }

    /// Has the timestamps of all passes recorded copied into a buffer that can be read.
    pub(super) fn resolve(&self, gpu: &Gpu, encoder: &mut wgpu::CommandEncoder) -> wgpu::Buffer {
        let staging = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("pass times"),
            size: self.names.len() as u64 * 16,
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        for (names, (i, (set, resolved))) in self.names.chunks(SET as usize).zip(self.queries.iter().enumerate()) {
            let count = names.len() as u32 * 2;
            encoder.resolve_query_set(set, 0..count, resolved, 0);
            encoder.copy_buffer_to_buffer(resolved, 0, &staging, i as u64 * SET as u64 * 16, count as u64 * 8);
        }
        staging
    }

    pub fn mode(&self) -> TimerMode {
        self.mode
    }

    /// The last complete frame with passes of equal names added up, in order of first appearance.
    pub fn by_name(&self) -> Vec<(&'static str, f64)> {
        added_up(self.latest.iter())
    }

    /// The same of the passes that were recorded for a light ([`super::Recorder::of_light`]).
    pub fn of_light(&self, light: usize) -> Vec<(&'static str, f64)> {
        let passes = self.latest.iter().rev().zip(self.latest_lights.iter().rev()).rev();
        added_up(passes.filter(|(_, of)| **of == Some(light)).map(|(pass, _)| pass))
    }

    /// Takes in the frames whose times have arrived; with `wait`, all of them.
    pub fn collect(&mut self, gpu: &Gpu, wait: bool) -> Result<()> {
        if wait {
            gpu.wait()?;
        }
        while self.pending.first().is_some_and(|p| p.ready.load(Ordering::Acquire)) {
            let Pending { staging, names, lights, noted, .. } = self.pending.remove(0);
            let bytes = staging.get_mapped_range(..).map_err(|e| anyhow!("reading the pass times failed: {e}"))?;
            let stamps: &[u64] = bytemuck::cast_slice(&bytes);
            let to_ms = gpu.queue.get_timestamp_period() as f64 * 1e-6;
            let times = names.iter().zip(stamps.chunks_exact(2));
            (self.latest, self.latest_lights) = (noted, lights);
            self.latest.extend(times.map(|(n, s)| (*n, s[1].saturating_sub(s[0]) as f64 * to_ms)));
        }
        Ok(())
    }
}

fn added_up<'a>(passes: impl Iterator<Item = &'a (&'static str, f64)>) -> Vec<(&'static str, f64)> {
    let mut sums: Vec<(&'static str, f64)> = Vec::new();
    for (name, ms) in passes {
        match sums.iter_mut().find(|s| s.0 == *name) {
            Some(sum) => sum.1 += ms,
            None => sums.push((name, *ms)),
        }
    }
    sums
}

/// Counts what render passes draw, by pipeline statistics.
pub struct DrawCount {
    pub(super) queries: wgpu::QuerySet,
    pub(super) resolved: wgpu::Buffer,
    /// Of each draw of the last frame what it sent, and the number of the depth layer that it counts for.
    pub(super) draws: Vec<(Sent, Option<usize>)>,
}

/// What a draw sends to the clipper.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Sent {
    /// Triangles of the scene.
    Triangles,
    Points,
}

/// A draw: what it sent, the number of its layer, and what was counted, as [`COUNTED`] has it.
type Counted = (Sent, Option<usize>, [u64; 3]);

/// Depth layers that a frame's draws went into.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct LayerCount {
    pub layers: u32,
    /// Those into which something was drawn: an indirect draw of nothing, and triangles that all lie outside, are none.
    pub layers_drawn: u32,
}

/// What draws made of the triangles that they sent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Draws {
    /// Triangles sent to the clipper.
    pub sent: u64,
    /// At most how many of them have a part inside the view.
    pub drawn: u64,
    /// Runs of the fragment shader; where depth alone is drawn, without one, the driver may count fragments or not.
    pub fragments: u64,
}

/// Most draws that are counted in one frame.
pub(super) const MAX_DRAWS: u32 = 2048;
/// What is counted of each draw, in the order in which it is written.
const COUNTED: wgpu::PipelineStatisticsTypes = wgpu::PipelineStatisticsTypes::CLIPPER_INVOCATIONS
    .union(wgpu::PipelineStatisticsTypes::CLIPPER_PRIMITIVES_OUT)
    .union(wgpu::PipelineStatisticsTypes::FRAGMENT_SHADER_INVOCATIONS);
/// Its bytes.
const QUERY: u64 = 24;

impl DrawCount {
    /// None where the adapter cannot count.
    pub fn new(gpu: &Gpu) -> Option<DrawCount> {
        gpu.abilities.features.contains(wgpu::Features::PIPELINE_STATISTICS_QUERY).then(|| DrawCount {
            queries: gpu.device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("draws"),
                ty: wgpu::QueryType::PipelineStatistics(COUNTED),
                count: MAX_DRAWS,
            }),
            resolved: gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("draws"),
                size: MAX_DRAWS as u64 * QUERY,
                usage: wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            }),
            draws: Vec::new(),
        })
    }

    /// All draws of the last frame that counted, together; None if that frame drew nothing, or more often than can be
    /// counted.
    pub fn read(&self, gpu: &Gpu) -> Result<Option<Draws>> {
        let mut sum = Draws::default();
        let mut any = false;
        for (_, _, [sent, left, fragments]) in self.each(gpu)?.into_iter().filter(|draw| draw.0 == Sent::Triangles) {
            any = true;
            sum.sent += sent;
            // The clipper makes at least one triangle of each that it does not drop, and several of one that it cuts.
            sum.drawn += left.min(sent);
            sum.fragments += fragments;
        }
        Ok(any.then_some(sum))
    }

    /// The depth layers that these draws went into, and those of them into which they drew something; None as in
    /// [`DrawCount::read`], and where no draw had a depth.
    pub fn layers(&self, gpu: &Gpu) -> Result<Option<LayerCount>> {
        let mut drawn: Vec<bool> = Vec::new();
        for (_, layer, [sent, left, _]) in self.each(gpu)? {
            if let Some(layer) = layer {
                drawn.resize(drawn.len().max(layer + 1), false);
                drawn[layer] |= left.min(sent) > 0;
            }
        }
        let layers_drawn = drawn.iter().filter(|d| **d).count() as u32;
        Ok((!drawn.is_empty()).then_some(LayerCount { layers: drawn.len() as u32, layers_drawn }))
    }

    /// Of each draw what it was and what was counted; nothing where there were more than can be counted.
    fn each(&self, gpu: &Gpu) -> Result<Vec<Counted>> {
        if self.draws.is_empty() || self.draws.len() > MAX_DRAWS as usize {
            return Ok(Vec::new());
        }
        let bytes = gpu.read_range(&self.resolved, 0, self.draws.len() as u64 * QUERY)?;
        let words: Vec<[u64; 3]> = bytemuck::pod_collect_to_vec(&bytes);
        Ok(self.draws.iter().zip(words).map(|((sent, layer), words)| (*sent, *layer, words)).collect())
    }
}
