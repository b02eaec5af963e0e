//! Taps that differ from pixel to pixel and from frame to frame, and what several frames saw, averaged
//! (`shaders/map/accumulate.wgsl`).

use crate::frame::{Frame, History, STORED};
use crate::gpu::{Buffer, Gpu, Pass, Resource, Slot};
use crate::params::Params;
use anyhow::Result;
use std::sync::LazyLock;
use wgpu::TextureFormat as Format;

crate::params! {
    /// How a filter's taps are turned, for filters that lay them out in a disk.
    pub struct NoiseParams {
        "Noise" {
            /// Turn the taps by another angle at every pixel: bands become noise.
            rotate: flag(false) if mode = ["disk", "dpcf"] or search_taps > 0,
            /// The angles. White: at random. Ign: interleaved gradient noise, more evenly spread among neighbours, so that it looks finer. Blue: a tile of 64 × 64 whose neighbours differ as much as can be, the finest to look at.
            noise: choice("white", ["white", "ign", "blue"]) if rotate = true,
            /// Frames whose light is averaged, each with other angles; 1: only the newest. Pictures and measurements show what so many frames at rest come to, times are those of one. Where each new frame weighs more than 1 / frames, later ones hardly add.
            accumulate: int(1, 1..=64, "frames") if rotate = true,
            /// What the newest frame counts at least (the α of temporal anti-aliasing). Small: smooth, but where something moved old shadows stay behind as ghosts. 0: all frames count alike.
            blend_factor: float(0.1, 0.0..=1.0, "mean" => "newest") if accumulate > 1,
            /// Keep what earlier frames saw within the values of the 3 × 3 pixels around. Ghosts go sooner, and noise stays.
            clamp_history: flag(true) if accumulate > 1,
        }
    }
}

/// Side of the tile of blue noise.
const SIDE: usize = 64;

/// A tile of numbers from 0 to 1, each once, whose neighbours differ as much as can be: void and cluster (Ulichney 1993). Each
/// pixel is ranked by when it joins a pattern that always grows where it is emptiest.
static BLUE: LazyLock<Vec<f32>> = LazyLock::new(|| {
    const ALL: usize = SIDE * SIDE;
    // How much a pixel fills the place of another, across the tile's borders; whole numbers add up alike everywhere.
    let near = |d: usize| d.min(SIDE - d) as f64;
    let weights: Vec<i64> = (0..ALL)
        .map(|i| {
            let [x, y] = [i % SIDE, i / SIDE].map(near);
            ((x * x + y * y) / (-2.0 * 1.9 * 1.9)).exp().mul_add(1e6, 0.5) as i64
        })
        .collect();
    let mut filled = vec![0i64; ALL];
    let mut taken = vec![false; ALL];
    let put = |at: usize, there: bool, filled: &mut [i64], taken: &mut [bool]| {
        taken[at] = there;
        for (i, f) in filled.iter_mut().enumerate() {
            let [x, y] = [(i % SIDE + SIDE - at % SIDE) % SIDE, (i / SIDE + SIDE - at / SIDE) % SIDE];
            *f += if there { weights[y * SIDE + x] } else { -weights[y * SIDE + x] };
        }
    };
    let void = |filled: &[i64], taken: &[bool]| (0..ALL).filter(|i| !taken[*i]).min_by_key(|i| filled[*i]);
    let cluster = |filled: &[i64], taken: &[bool]| (0..ALL).filter(|i| taken[*i]).max_by_key(|i| filled[*i]);
    // A tenth of the pixels at random, moved from the densest place to the emptiest until that is the same.
    let mut state = 1u32;
    for _ in 0..ALL / 10 {
        state = state.wrapping_mul(747796405).wrapping_add(2891336453);
        let at = (state >> 8) as usize % ALL;
        if !taken[at] {
            put(at, true, &mut filled, &mut taken);
        }
    }
    while let Some(densest) = cluster(&filled, &taken) {
        put(densest, false, &mut filled, &mut taken);
        let emptiest = void(&filled, &taken).unwrap_or(densest);
        put(emptiest, true, &mut filled, &mut taken);
        if emptiest == densest {
            break;
        }
    }
    // Those are ranked by what is densest last, the others by what is emptiest first.
    let mut ranks = vec![0; ALL];
    let (first, pattern) = (filled.clone(), taken.clone());
    let mut rank = pattern.iter().filter(|t| **t).count();
    while let Some(at) = cluster(&filled, &taken) {
        put(at, false, &mut filled, &mut taken);
        rank -= 1;
        ranks[at] = rank;
    }
    (filled, taken) = (first, pattern);
    rank = taken.iter().filter(|t| **t).count();
    while let Some(at) = void(&filled, &taken) {
        put(at, true, &mut filled, &mut taken);
        ranks[at] = rank;
        rank += 1;
    }
    ranks.into_iter().map(|rank| (rank as f32 + 0.5) / ALL as f32).collect()
});

/// The tile of blue noise as shaders read it; one texel stands in where it is not `wanted`.
pub fn blue_tile(gpu: &Gpu, slot: &mut Slot, wanted: bool) -> wgpu::TextureView {
    let usage = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST;
    let side = if wanted { SIDE as u32 } else { 1 };
    let held = slot.texture().map(|t| t.width());
    let blue = slot.get(gpu, "blue noise", [side; 2], Format::R32Float, usage);
    if let Some(texture) = slot.texture().filter(|_| wanted && held != Some(side)) {
        gpu.write_texture(texture, bytemuck::cast_slice(&BLUE));
    }
    blue
}

/// Bytes of `Past` in WGSL.
const PAST: usize = 112;

/// What is known of the frames before, `Past` in WGSL: of none.
pub fn past(gpu: &Gpu) -> Buffer {
    gpu.buffer("past", &[0; PAST], wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::STORAGE)
}

/// What the turned taps of a filter need, and what earlier frames saw.
pub struct Noise {
    blue: Slot,
    /// `Past` in WGSL.
    past: Buffer,
    history: Option<Accumulation>,
}

/// The light of the frames so far, averaged.
struct Accumulation {
    accumulate: Pass,
    keep: Pass,
    lights: [Slot; 2],
    /// Of how many frames, and pixels.
    frames: u32,
    size: [u32; 2],
}

impl Accumulation {
    fn new(gpu: &Gpu) -> Result<Accumulation> {
        let file = "map/accumulate.wgsl";
        let pass = |entry| Pass::compute(gpu, "accumulation", file, entry, &[NoiseParams::GROUP]);
        let (accumulate, keep) = (pass("accumulate")?, pass("keep_history")?);
        Ok(Accumulation { accumulate, keep, lights: Default::default(), frames: 0, size: [0; 2] })
    }
}

impl Noise {
    pub fn new(gpu: &Gpu) -> Noise {
        Noise { blue: Slot::default(), past: past(gpu), history: None }
    }

    /// What a shader that includes `map/filter/disk.wgsl` binds, by name.
    pub fn bound(&mut self, f: &Frame) -> [(&'static str, Resource); 2] {
        let blue = blue_tile(f.gpu, &mut self.blue, NoiseParams::read(f.values).noise == "blue");
        [("blue_noise", (&blue).into()), ("past", (&self.past).into())]
    }

    /// Fills the visibility by `resolve`, and averages it over frames where that is asked for. `turns`: the taps can be turned.
    ///
    /// # Errors
    /// Passes that cannot be made.
    pub fn accumulate(&mut self, f: &mut Frame, turns: bool, resolve: impl Fn(&mut Frame)) -> Result<()> {
        let p = NoiseParams::read(f.values);
        let wanted = if turns && p.rotate { p.accumulate } else { 1 };
        if wanted == 1 {
            if self.history.take().is_some() {
                f.clear(&self.past);
            }
            resolve(f);
            return Ok(());
        }
        let history = match &mut self.history {
            Some(history) => history,
            None => self.history.insert(Accumulation::new(f.gpu)?),
        };
        if f.history != History::Goes || f.size != history.size {
            (history.frames, history.size) = (0, f.size);
            f.clear(&self.past);
        }
        let mut light = |i: usize, label| history.lights[i].get(f.gpu, label, f.size, Format::Rg32Uint, STORED);
        let (now, before) = (light(0, "light so far"), light(1, "light before"));
        let drawn = if f.history == History::Whole { wanted } else { 1 };
        for _ in 0..drawn {
            resolve(f);
            f.run(&history.accumulate)
                .bind("past", &self.past)
                .bind("history", &before)
                .bind("history_out", &now)
                .per_pixel();
            f.run(&history.keep)
                .bind("past_out", &self.past)
                .bind("history", &now)
                .bind("history_out", &before)
                .per_pixel();
        }
        history.frames = (history.frames + drawn).min(wanted);
        f.tell_frames(history.frames, wanted);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    /// Each number stands once, and waves eight pixels long and longer have less than a hundredth of the power that they have in
    /// numbers at random.
    #[test]
    fn the_tile_is_blue() {
        let all = (SIDE * SIDE) as f64;
        let mut sorted = BLUE.clone();
        sorted.sort_by(f32::total_cmp);
        assert!(sorted.iter().enumerate().all(|(i, v)| *v == (i as f32 + 0.5) / all as f32));
        let power = |u: i32, v: i32| {
            let (mut re, mut im) = (0.0, 0.0);
            for (i, value) in BLUE.iter().enumerate() {
                let turn = (u * (i % SIDE) as i32 + v * (i / SIDE) as i32) as f64 / SIDE as f64;
                let (s, c) = (TAU * turn).sin_cos();
                (re, im) = (re + c * f64::from(*value - 0.5), im + s * f64::from(*value - 0.5));
            }
            // Of numbers at random: a twelfth each.
            (re * re + im * im) / (all / 12.0)
        };
        let long =
            (-8..=8).flat_map(|u| (0..=8).map(move |v| (u, v))).filter(|(u, v)| (1..=64).contains(&(u * u + v * v)));
        let powers: Vec<f64> = long.map(|(u, v)| power(u, v)).collect();
        let mean = powers.iter().sum::<f64>() / powers.len() as f64;
        assert!(mean < 0.01, "{mean}");
    }
}
