//! The truth of a frame: one exact shadow ray at each pixel's centre, and the mean over more samples of the pixel.
//!
//! Both are traced in bands of rows, so that no frame waits for all of them.

use crate::frame::{DRAWN, FrameUniform, STORED, tally};
use crate::gpu::{Gpu, Pass, Recorder, Slot};
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
    /// Views: as many as the technique aims at, one or [`AVERAGED`]. Measurements: [`AVERAGED`], so that all techniques
    /// of a table share one truth.
    #[default]
    Auto,
    Fixed(u32),
}

/// Samples a pixel that a truth can have; 1 is the hard truth.
pub const COUNTS: [u32; 4] = [1, 4, 16, 64];
/// Samples a pixel of the averaged truth where nothing else is asked for.
pub const AVERAGED: u32 = 16;

impl Samples {
    /// What a set-up's key takes, in words.
    pub const TAKES: &str = "\"auto\", 1, 4, 16 or 64";

    /// Samples a pixel of the truth that is shown beside a technique.
    pub fn shown(self, info: &Info) -> u32 {
        match self {
            Samples::Auto if !info.filters => 1,
            _ => self.measured(),
        }
    }

    /// Samples a pixel of the truth that a technique is measured against.
    pub fn measured(self) -> u32 {
        match self {
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

/// What a truth is traced for: geometry, camera, light, size.
type Of = (u64, Camera, Light, [u32; 2]);

/// The averaged truth so far.
#[derive(Default)]
struct Average {
    /// Samples a pixel that it is to have; 0: none is begun.
    samples: u32,
    /// Those that all pixels have, and the rows that have one more.
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

/// The truth as far as it is traced.
pub struct Tracing {
    resolve: Pass,
    accumulate: Pass,
    params: wgpu::Buffer,
    frame: wgpu::Buffer,
    /// The frame of the sample that is being traced, and whether it is the first.
    shifted: wgpu::Buffer,
    first: wgpu::Buffer,
    /// How many rays gave up, as `Tally` in `shaders/lib/trace.wgsl`.
    pub tally: wgpu::Buffer,
    of: Option<Of>,
    uniform: FrameUniform,
    size: [u32; 2],
    /// Samples a pixel that are asked for.
    samples: u32,
    hard: Slot,
    /// Rows of the hard truth.
    rows: u32,
    average: Average,
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
            params: gpu.buffer("truth", bytemuck::cast_slice(&group.words(&Values::new())), uniform),
            frame: frame("frame of the truth"),
            shifted: frame("frame of a sample"),
            first: gpu.buffer("first sample", &[0; 16], uniform),
            tally: tally(gpu, "the truth's rays"),
            of: None,
            uniform: FrameUniform::zeroed(),
            size: [1, 1],
            samples: 1,
            hard: Slot::default(),
            rows: 0,
            average: Average::default(),
        })
    }

    /// Goes on with what is kept, or starts anew if that is of something else: the hard truth and, of more than one
    /// sample per pixel, the mean.
    pub fn start(&mut self, of: Of, samples: u32, recorder: &mut Recorder, uniform: &FrameUniform) {
        let gpu = recorder.gpu;
        if self.of != Some(of) {
            (self.of, self.uniform, self.size, self.rows) = (Some(of), *uniform, of.3, 0);
            self.average.samples = 0;
            gpu.queue.write_buffer(&self.frame, 0, bytemuck::bytes_of(uniform));
            recorder.clear(&self.tally);
        }
        self.samples = samples;
        if samples > 1 && self.average.samples != samples {
            (self.average.samples, self.average.whole, self.average.rows) = (samples, 0, 0);
        }
        self.hard.get(gpu, "truth", self.size, Format::R32Float, STORED);
    }

    /// Records the next rows, about as many pixels' samples as given. `gbuffer` draws the scene's `vertices`.
    pub fn record(&mut self, recorder: &mut Recorder, gbuffer: &Pass, vertices: u32, pixels: u32) {
        let [width, height] = self.size;
        let gpu = recorder.gpu;
        let band = std::mem::offset_of!(FrameUniform, band) as u64;
        let mut left = (pixels / width).max(8);
        let rows = left.min(height - self.rows);
        let Some(hard) = self.hard.view().cloned() else { return };
        if rows > 0 {
            gpu.queue.write_buffer(&self.frame, band, bytemuck::bytes_of(&[self.rows, rows]));
            recorder
                .run(&self.resolve)
                .bind("frame", &self.frame)
                .bind("params", &self.params)
                .bind("visibility_out", &hard)
                .bind("tally", &self.tally)
                .dispatch(width.div_ceil(8), rows.div_ceil(8), 1);
            self.rows += rows;
            left -= rows;
        }
        while left > 0 && self.rows == height && self.missing() {
            let a = &mut self.average;
            let mean = a.mean.get(gpu, "mean truth", self.size, Format::R32Float, STORED);
            let counts = a.counts.get(gpu, "samples", self.size, Format::R32Uint, STORED);
            let position = a.position.get(gpu, "position", self.size, Format::Rgba32Float, DRAWN);
            let surface = a.surface.get(gpu, "surface", self.size, Format::Rgba32Uint, DRAWN);
            let depth = a.depth.get(gpu, "depth", self.size, Format::Depth32Float, DRAWN);
            // What is written below holds for what follows; what is recorded was of the sample before.
            recorder.submit();
            if a.rows == 0 {
                let uniform = self.uniform.shifted(offset(a.whole, a.samples));
                gpu.queue.write_buffer(&self.shifted, 0, bytemuck::bytes_of(&uniform));
                gpu.queue.write_buffer(&self.first, 0, bytemuck::bytes_of(&((a.whole == 0) as u32)));
                recorder.run(gbuffer).named("truth").bind("frame", &self.shifted).draw(
                    &[&position, &surface],
                    Some((&depth, 0.0)),
                    true,
                    |p| p.draw(0..vertices, 0..1),
                );
            }
            let rows = left.min(height - a.rows);
            gpu.queue.write_buffer(&self.shifted, band, bytemuck::bytes_of(&[a.rows, rows]));
            recorder
                .run(&self.accumulate)
                .bind("frame", &self.shifted)
                .bind("params", &self.params)
                .bind("g_position", &position)
                .bind("g_surface", &surface)
                .bind("first_sample", &self.first)
                .bind("counts", &counts)
                .bind("hard", &hard)
                .bind("visibility_out", &mean)
                .bind("tally", &self.tally)
                .dispatch(width.div_ceil(8), rows.div_ceil(8), 1);
            a.rows += rows;
            left -= rows;
            if a.rows == height {
                (a.whole, a.rows) = (a.whole + 1, 0);
                if a.whole == a.samples {
                    // Complete: only the mean is still needed.
                    let (samples, whole) = (a.samples, a.whole);
                    *a = Average { mean: std::mem::take(&mut a.mean), samples, whole, ..Average::default() };
                    self.accumulate.forget();
                }
            }
        }
    }

    /// Whether samples of the mean that is asked for are missing.
    fn missing(&self) -> bool {
        self.samples > 1 && self.average.whole < self.samples
    }

    /// The truth of as many samples as are asked for, as far as it is known: the hard one until all pixels have a sample
    /// of the mean.
    pub fn shown(&self) -> &Slot {
        if self.samples > 1 && self.average.whole > 0 { &self.average.mean } else { &self.hard }
    }

    /// The truth of one sample at the pixel's centre.
    pub fn hard(&self) -> &Slot {
        &self.hard
    }

    /// How far it is.
    pub fn progress(&self) -> Progress {
        let [width, height] = self.size.map(u64::from);
        let a = &self.average;
        let (rows, all) = match self.samples {
            1 => (0, 1),
            n => (a.whole as u64 * height + a.rows as u64, 1 + n as u64),
        };
        let rows = rows + self.rows as u64;
        Progress {
            covered: self.rows as f32 / height as f32,
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
