//! The truth of a frame: one exact shadow ray at each pixel's centre, and the mean over more samples: of the pixel, or, where
//! the light has a size, of the light, seen from the pixel's centre. The latter is what `rt-soft` draws.
//!
//! Both are traced in bands of rows, so that no frame waits for all of them.

use crate::frame::{DRAWN, FrameUniform, STORED, tally};
use crate::gpu::{Buffer, Gpu, Pass, Recorder, Resource, Slot};
use crate::light::Light;
use crate::params::Values;
use crate::scene::Camera;
use crate::techniques::{self, Info};
use anyhow::Result;
use bytemuck::Zeroable;
use glam::Vec2;
use serde::{Deserialize, Serialize};
use wgpu::TextureFormat as Format;

/// How many samples per pixel the truth averages, as set-ups and the command line have it: `auto` or one of [`COUNTS`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "Word", into = "Word")]
pub enum Samples {
    /// [`SOFT`] under lights with a size. Under others views take as many as the technique aims at, one or [`AVERAGED`], and
    /// measurements [`AVERAGED`], so that all techniques of a table share one truth.
    #[default]
    Auto,
    Fixed(u32),
}

/// Samples a pixel that a truth can have; 1 is the hard truth.
pub const COUNTS: [u32; 7] = [1, 4, 16, 64, 256, 1024, 4096];
/// Samples a pixel of the averaged truth where nothing else is asked for.
pub const AVERAGED: u32 = 16;
/// The same under lights with a size.
pub const SOFT: u32 = 64;
/// Rays to a light with a size that one dispatch sends from each pixel.
const AT_ONCE: u32 = 8;

impl Samples {
    /// What a set-up's key takes, in words.
    pub const TAKES: &str = "\"auto\", 1, 4, 16, 64, 256, 1024 or 4096";

    /// Samples a pixel of the truth that is shown beside a technique with these values.
    pub fn shown(self, light: &Light, info: &Info, values: &Values) -> u32 {
        match self {
            Samples::Auto if !light.has_size() && !info.filters(values) => 1,
            _ => self.measured(light),
        }
    }

    /// Samples a pixel of the truth that a technique is measured against.
    pub fn measured(self, light: &Light) -> u32 {
        match self {
            Samples::Auto if light.has_size() => SOFT,
            Samples::Auto => AVERAGED,
            Samples::Fixed(n) => n,
        }
    }
}

impl std::fmt::Display for Samples {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self {
            Samples::Auto => f.write_str("auto"),
            Samples::Fixed(n) => n.fmt(f),
        }
    }
}

impl std::str::FromStr for Samples {
    type Err = String;

    fn from_str(text: &str) -> Result<Samples, String> {
        match text.parse() {
            Ok(n) if COUNTS.contains(&n) => Ok(Samples::Fixed(n)),
            _ if text == "auto" => Ok(Samples::Auto),
            _ => Err(format!("it takes {}", Samples::TAKES)),
        }
    }
}

/// As a file holds it.
#[derive(Serialize, Deserialize)]
#[serde(untagged)]
enum Word {
    Count(u32),
    Text(String),
}

impl TryFrom<Word> for Samples {
    type Error = String;

    fn try_from(word: Word) -> Result<Samples, String> {
        match word {
            Word::Count(n) => n.to_string().parse(),
            Word::Text(text) => text.parse(),
        }
    }
}

impl From<Samples> for Word {
    fn from(samples: Samples) -> Word {
        match samples {
            Samples::Auto => Word::Text("auto".into()),
            Samples::Fixed(n) => Word::Count(n),
        }
    }
}

/// Where the sample `i` of `n` lies, pixels from the pixel's centre, right and down. The first n points of Sobol's
/// (0,2)-sequence (Sobol 1967; Kollig, Keller 2002), which have n different x and y at equal distances, moved by half
/// that distance so that their mean is the centre. For n = 1 it is the centre.
pub fn offset(i: u32, n: u32) -> Vec2 {
    let (mut y, mut v, mut bits) = (0u32, 1u32 << 31, i);
    while bits > 0 {
        y ^= if bits & 1 == 1 { v } else { 0 };
        v ^= v >> 1;
        bits >>= 1;
    }
    let part = |word: u32| (word as f64 / 4294967296.0) as f32;
    Vec2::new(part(i.reverse_bits()), part(y)) + (0.5 / n as f32 - 0.5)
}

/// How far a truth is traced.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Progress {
    /// Share of the picture's rows that have a truth, if only their hard one: 0 to 1, from the top.
    pub covered: f32,
    /// Share of all that is asked for, 0 to 1.
    pub done: f32,
    /// Samples of pixels traced so far.
    pub samples: u64,
}

/// What a truth is traced for: geometry, camera, light.
type Of = (u64, Camera, Light);

/// An averaged truth so far.
#[derive(Default)]
struct Average {
    /// Samples a pixel that it is to have.
    samples: u32,
    /// Those that all pixels have, and the rows that have as many more as one dispatch takes.
    whole: u32,
    rows: u32,
    /// The mean so far, a number per pixel.
    mean: Slot,
    /// Samples that can be lit and those that are, as `shaders/techniques/rt_hard.wgsl` packs them.
    counts: Slot,
    /// The G-buffer of the sample that is being traced: the technique's own stays as it is.
    position: Slot,
    surface: Slot,
    depth: Slot,
}

/// The truth of pictures of one size.
struct Sized {
    uniform: FrameUniform,
    hard: Slot,
    /// Rows of the hard truth.
    rows: u32,
    /// One for each number of samples that was asked for.
    averages: Vec<Average>,
    /// How many rays gave up, as `Tally` in `shaders/lib/trace.wgsl`.
    tally: Buffer,
}

impl Average {
    /// Samples that the next dispatches take.
    fn batch(&self, light: &Light) -> u32 {
        if light.has_size() { AT_ONCE.min(self.samples - self.whole) } else { 1 }
    }
}

impl Sized {
    fn pixels(&self) -> u64 {
        self.uniform.size[0] as u64 * self.uniform.size[1] as u64
    }
}

/// Sizes whose truth is kept: the window's, one that it had before (without its drawer, say), and a draft's.
const SIZES: usize = 3;
/// Pixels that are traced at once: a frame may be given up between two passes, and a GPU's watchdog must not fire.
const SLICE: u32 = 1 << 18;

/// The truth as far as it is traced.
pub struct Tracing {
    resolve: Pass,
    accumulate: Pass,
    explain: Pass,
    params: Buffer,
    frame: Buffer,
    /// The frame of the sample that is being traced, and its number.
    shifted: Buffer,
    sample: Buffer,
    of: Option<Of>,
    /// Of the present frame's size last.
    kept: Vec<Sized>,
    /// The same of the set-up's other lights.
    parked: Vec<(Of, Vec<Sized>)>,
    /// Samples a pixel that are asked for.
    samples: u32,
}

impl Tracing {
    pub fn new(gpu: &Gpu) -> Result<Tracing> {
        let group = &techniques::TRUTH.params[0];
        let uniform = wgpu::BufferUsages::UNIFORM;
        let pass = |entry| Pass::compute(gpu, "truth", "techniques/rt_hard.wgsl", entry, techniques::TRUTH.params);
        let frame = |label| gpu.buffer(label, bytemuck::bytes_of(&FrameUniform::zeroed()), uniform);
        Ok(Tracing {
            resolve: pass("resolve")?,
            accumulate: pass("accumulate")?,
            explain: pass("explain")?,
            params: gpu.buffer("truth", bytemuck::cast_slice(&group.words(&Values::new())), uniform),
            frame: frame("frame of the truth"),
            shifted: frame("frame of a sample"),
            sample: gpu.buffer("sample", &[0; 16], uniform),
            of: None,
            kept: Vec::new(),
            parked: Vec::new(),
            samples: 1,
        })
    }

    /// Goes on with what is kept for pictures of this size: the hard truth and, of more than one sample per pixel, the mean.
    /// What was traced of another light stays, if it is among `lights` and all else is the same. What was recorded must have been
    /// submitted.
    pub fn start(&mut self, of: Of, lights: &[Light], samples: u32, gpu: &Gpu, uniform: &FrameUniform) {
        if self.of != Some(of) {
            if let Some(before) = self.of.replace(of) {
                self.parked.push((before, std::mem::take(&mut self.kept)));
            }
            if let Some(i) = self.parked.iter().position(|(parked, _)| *parked == of) {
                self.kept = self.parked.remove(i).1;
            }
        }
        self.parked.retain(|(o, _)| (o.0, o.1) == (of.0, of.1) && lights.contains(&o.2));
        self.samples = samples;
        let mut now = match self.kept.iter().position(|k| k.uniform.size == uniform.size) {
            Some(i) => self.kept.remove(i),
            None => {
                if self.kept.len() == SIZES {
                    // The smallest is traced again in the shortest time.
                    let smallest = (0..SIZES).min_by_key(|i| self.kept[*i].pixels()).unwrap_or_default();
                    self.kept.remove(smallest);
                }
                let tally = tally(gpu, "the truth's rays");
                Sized { uniform: *uniform, hard: Slot::default(), rows: 0, averages: Vec::new(), tally }
            }
        };
        now.hard.get(gpu, "truth", uniform.size, Format::R32Float, STORED);
        if samples > 1 && now.averages.iter().all(|a| a.samples != samples) {
            now.averages.push(Average { samples, ..Average::default() });
        }
        gpu.queue.write_buffer(&self.frame, 0, bytemuck::bytes_of(&now.uniform));
        self.kept.push(now);
    }

    /// Records the next rows, about as many pixels' samples as given. `gbuffer` draws the scene's `vertices`.
    pub fn record(&mut self, recorder: &mut Recorder, gbuffer: &Pass, vertices: u32, pixels: u32) {
        let (Some(now), Some((_, _, light))) = (self.kept.last_mut(), self.of) else { return };
        let [width, height] = now.uniform.size;
        let gpu = recorder.gpu;
        let band = std::mem::offset_of!(FrameUniform, band) as u64;
        let mut left = (pixels / width).max(8);
        let most = (SLICE / width).max(8);
        let Some(hard) = now.hard.view().cloned() else { return };
        while left > 0 && now.rows < height && !recorder.failed() {
            let rows = left.min(most).min(height - now.rows);
            recorder.submit();
            gpu.queue.write_buffer(&self.frame, band, bytemuck::bytes_of(&[now.rows, rows]));
            recorder
                .run(&self.resolve)
                .bind("frame", &self.frame)
                .bind("params", &self.params)
                .bind("visibility_out", &hard)
                .bind("tally", &now.tally)
                .dispatch(width.div_ceil(8), rows.div_ceil(8), 1);
            now.rows += rows;
            left -= rows;
        }
        let Some(a) = now.averages.iter_mut().find(|a| a.samples == self.samples) else { return };
        while left > 0 && now.rows == height && a.whole < a.samples && !recorder.failed() {
            let mean = a.mean.get(gpu, "mean truth", now.uniform.size, Format::R32Float, STORED);
            let counts = a.counts.get(gpu, "samples", now.uniform.size, Format::R32Uint, STORED);
            // What is written below holds for what follows; what is recorded was of the sample before.
            recorder.submit();
            let batch = a.batch(&light);
            // Another number of samples may have used the buffers since.
            let by = if light.has_size() { Vec2::ZERO } else { offset(a.whole, a.samples) };
            gpu.queue.write_buffer(&self.shifted, 0, bytemuck::bytes_of(&now.uniform.shifted(by)));
            gpu.queue.write_buffer(&self.sample, 0, bytemuck::bytes_of(&[a.whole, batch]));
            let mut surfaces = Vec::new();
            if !light.has_size() {
                let position = a.position.get(gpu, "position", now.uniform.size, Format::Rgba32Float, DRAWN);
                let surface = a.surface.get(gpu, "surface", now.uniform.size, Format::Rgba32Uint, DRAWN);
                let depth = a.depth.get(gpu, "depth", now.uniform.size, gpu.depth_stencil(), DRAWN);
                if a.rows == 0 {
                    recorder.run(gbuffer).named("truth").bind("frame", &self.shifted).draw(
                        &[&position, &surface],
                        Some((&depth, 0.0)),
                        true,
                        |p| p.draw(0..vertices, 0..1),
                    );
                }
                surfaces = vec![("g_position", Resource::from(&position)), ("g_surface", Resource::from(&surface))];
            }
            let rows = (left / batch).max(8).min(most).min(height - a.rows);
            gpu.queue.write_buffer(&self.shifted, band, bytemuck::bytes_of(&[a.rows, rows]));
            recorder
                .run(&self.accumulate)
                .bind("frame", &self.shifted)
                .bind("params", &self.params)
                .bind_all(&surfaces)
                .bind("sample", &self.sample)
                .bind("counts", &counts)
                .bind("hard", &hard)
                .bind("visibility_out", &mean)
                .bind("tally", &now.tally)
                .dispatch(width.div_ceil(8), rows.div_ceil(8), 1);
            a.rows += rows;
            left = left.saturating_sub(rows * batch);
            if a.rows == height {
                (a.whole, a.rows) = (a.whole + batch, 0);
                if a.whole == a.samples {
                    // Complete: only the mean is still needed.
                    let (samples, whole) = (a.samples, a.whole);
                    *a = Average { mean: std::mem::take(&mut a.mean), samples, whole, ..Average::default() };
                    self.accumulate.forget();
                }
            }
        }
    }

    /// Forgets what is traced for pictures of the present size: what was recorded last may not have been done.
    pub fn forget(&mut self) {
        self.kept.pop();
        self.parked.clear();
    }

    fn now(&self) -> Option<(&Sized, Option<&Average>)> {
        let now = self.kept.last()?;
        Some((now, now.averages.iter().find(|a| self.samples > 1 && a.samples == self.samples)))
    }

    /// The truth of as many samples as are asked for, as far as it is known: the hard one until all pixels have a sample
    /// of the mean. None before the first frame, as below.
    pub fn shown(&self) -> Option<&Slot> {
        let (now, average) = self.now()?;
        Some(average.filter(|a| a.whole > 0).map_or(&now.hard, |a| &a.mean))
    }

    /// The truth that tells lit pixels from those in shadow: the hard one, or, of a light with a size, whether at least half of
    /// it is seen.
    pub fn labels(&self) -> Option<&Slot> {
        let soft = self.of.is_some_and(|(_, _, light)| light.has_size());
        if soft { self.shown() } else { self.hard() }
    }

    /// The truth of one sample at the pixel's centre.
    pub fn hard(&self) -> Option<&Slot> {
        self.now().map(|(now, _)| &now.hard)
    }

    /// How many rays gave up.
    pub fn tally(&self) -> Option<&Buffer> {
        self.now().map(|(now, _)| &now.tally)
    }

    /// The picture's rows that have a truth, from the top.
    pub fn rows(&self) -> u32 {
        self.now().map_or(0, |(now, _)| now.rows)
    }

    /// Whether each pixel has its hard truth.
    pub fn covered(&self) -> bool {
        self.now().is_some_and(|(now, _)| now.rows == now.uniform.size[1])
    }

    /// Traces what tells the causes of errors apart into `evidence`. `aliasing`: the frame's, if the technique has maps.
    pub fn explain(
        &self,
        recorder: &mut Recorder,
        visibility: &wgpu::TextureView,
        aliasing: Option<&wgpu::TextureView>,
        evidence: &wgpu::TextureView,
    ) {
        let Some(hard) = self.labels().and_then(Slot::view) else { return };
        recorder
            .run(&self.explain)
            .bind("params", &self.params)
            .bind("hard", hard)
            .bind("visibility", visibility)
            // Of a texture with one channel the others are 0.
            .bind("aliasing", aliasing.unwrap_or(hard))
            .bind("evidence_out", evidence)
            .per_pixel();
    }

    /// How far it is.
    pub fn progress(&self) -> Progress {
        let Some((now, average)) = self.now() else { return Progress::default() };
        let [width, height] = now.uniform.size.map(u64::from);
        let (rows, all) = match average {
            None => (0, 1),
            Some(a) => {
                let batch = self.of.map_or(1, |(_, _, light)| a.batch(&light));
                (a.whole as u64 * height + a.rows as u64 * batch as u64, 1 + a.samples as u64)
            }
        };
        let rows = rows + now.rows as u64;
        Progress {
            covered: now.rows as f32 / height as f32,
            done: (rows as f64 / (all * height) as f64) as f32,
            samples: rows * width,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each of the n columns and rows of a pixel holds one sample, so does each cell of √n × √n, and their mean is the centre.
    #[test]
    fn samples_are_well_distributed() {
        for n in COUNTS {
            let all: Vec<Vec2> = (0..n).map(|i| offset(i, n)).collect();
            assert!(all.iter().sum::<Vec2>().length() < 1e-5, "{n}");
            let side = (n as f32).sqrt() as u32;
            type Cell = fn(Vec2, u32, u32) -> u32;
            let cells: [(&str, Cell); 3] = [
                ("columns", |p, n, _| ((p.x + 0.5) * n as f32) as u32),
                ("rows", |p, n, _| ((p.y + 0.5) * n as f32) as u32),
                ("cells", |p, _, k| ((p.y + 0.5) * k as f32) as u32 * k + ((p.x + 0.5) * k as f32) as u32),
            ];
            for (name, cell) in cells {
                let mut seen: Vec<u32> = all.iter().map(|p| cell(*p, n, side)).collect();
                seen.sort_unstable();
                assert_eq!(seen, (0..n).collect::<Vec<_>>(), "{n} {name}");
            }
        }
    }

    #[test]
    fn samples_are_written_as_they_are_read() {
        for (samples, json) in [(Samples::Auto, "\"auto\""), (Samples::Fixed(64), "64")] {
            assert_eq!(serde_json::to_string(&samples).ok().as_deref(), Some(json));
            assert_eq!(serde_json::from_str::<Samples>(json).ok(), Some(samples));
            assert_eq!(samples.to_string().parse(), Ok(samples));
        }
        for bad in ["3", "\"many\"", "0", "-4", "1.5"] {
            assert!(serde_json::from_str::<Samples>(bad).is_err(), "{bad}");
        }
    }
}
