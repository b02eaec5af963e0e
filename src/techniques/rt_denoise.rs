//! A few rays a pixel, and a filter over frames and neighbours that makes up for the rest.

use super::{Info, Technique};
use crate::frame::{Frame, History, STORED, tally};
use crate::gpu::{Buffer, Gpu, Pass, Slot};
use crate::map::noise::{blue_tile, past};
use crate::params::Params;
use crate::view::{self, Class, Drawn, Legend};
use anyhow::Result;
use wgpu::BufferUsages as Use;
use wgpu::TextureFormat as Format;

crate::params! {
    /// Rays of a frame, and how they are averaged.
    pub struct RtDenoiseParams {
        "Rays" {
            /// Rays from each pixel to the light in each frame.
            rays: int(1, 1..=8, "rays"),
            /// Where on the light they end. Blue: a tile of 64 × 64 whose neighbours differ as much as can be. Ign: interleaved gradient noise. R2: at random from pixel to pixel. These three step from frame to frame by the R2 sequence. White: at random each time.
            sequence: choice("blue", ["white", "ign", "blue", "r2"]),
        }
        "Denoiser" {
            /// How neighbours are averaged. Ffx: as AMD's FidelityFX shadow denoiser, 3 × 3 taps, only in tiles that are neither all lit nor all dark. Svgf: spatiotemporal variance-guided filtering, 5 × 5 taps, history not clamped. Off: not at all, frames alone.
            denoiser: choice("ffx", ["off", "ffx", "svgf"]),
            /// Passes of the filter, each with its taps twice as far apart. SVGF's authors take 5.
            passes: int(3, 0..=5, "passes") if denoiser = ["ffx", "svgf"],
            /// Depth by which neighbours may differ, as a share of their distance. Small: edges stay sharp, and slanting surfaces noisy.
            sigma_z: float(0.01, 0.001..=0.1, "") if denoiser = "ffx" and passes > 0,
        }
        "History" {
            /// Take over what earlier frames saw of the same surface.
            history: flag(true),
            /// Frames that a picture or a measurement stands for: so many are drawn, from none on. Times are of one. In the window more are added while nothing changes, up to this number.
            frames: int(16, 1..=64, "frames") if history = true,
            /// What the newest frame counts at least. Small: smooth, but the shadow of what moves lags behind. SVGF's authors take 0.2.
            min_blend: float(0.05, 0.02..=1.0, "mean" => "newest") if history = true,
            /// How far history may lie from the mean of the 17 × 17 pixels around, in standard deviations of these. Small: moving shadows lag less, and noise and blur grow.
            clamp_k: float(0.5, 0.25..=2.0, "σ") if history = true and denoiser = "ffx",
            /// Let the next frame take over what the first pass made of this one, as SVGF does: less noise, and what lies still is blurred again in each frame. Off: what the passes are given.
            feedback: flag(true) if history = true and passes > 0,
        }
    }
}

pub static INFO: Info = Info {
    id: "rt-denoise",
    title: "Ray-traced, denoised",
    paper: "Schied et al. 2017; AMD FidelityFX 2021",
    family: "Ray traced",
    mark: 40,
    doc: "One ray a pixel to a random place of the light. Earlier frames, found again by reprojection, and neighbours on the same \
          surface stand in for the rays that are missing. It blurs narrow penumbras, starts anew where surfaces come into view, and \
          shadows lag behind lights that move.",
    lights: &["directional", "spot", "omni", "rect-area"],
    filter: None,
    smooth: |_| false,
    params: &[RtDenoiseParams::GROUP],
    main: &[("frames", "1..64*2"), ("rays", "1..8*2"), ("denoiser", "off,ffx,svgf")],
    maps: &[&[
        view::map(
            "raw-rays",
            "Rays of this frame",
            "The share of the newest frame's rays that nothing blocks: what the filter is given.",
            view::ramp("rays not blocked", "", [0.0, 1.0]),
        ),
        view::map(
            "history-length",
            "History length",
            "Of how many frames the light of each pixel is averaged. History that its neighbours contradict counts for fewer; tiles \
             that are all lit or all dark have none.",
            view::ramp("frames", "", [0.0, 32.0]),
        ),
        view::map(
            "light-variance",
            "Variance",
            "The variance of the rays, from earlier frames or, where there are few, from the neighbourhood and then taken for greater: \
             where it is large the filter blurs.",
            view::ramp("variance", "", [0.0, 0.5]),
        ),
        view::map(
            "clamp-distance",
            "Clamp distance",
            "How far history was moved to lie near the mean of the neighbourhood: where a shadow moved, and where the filter blurs \
             what is sharp.",
            view::ramp("change of visibility", "", [0.0, 0.25]),
        ),
        view::map(
            "disocclusion",
            "Disocclusion",
            "Which surfaces the last frame did not see, so that their light starts anew.",
            Drawn::Labels(Legend::Classes(&[
                Class::label(2, "history goes on"),
                Class::label(0, "starts anew"),
                Class::label(7, "tile is skipped"),
            ])),
        ),
        view::map(
            "tile-classes",
            "Tile classes",
            "Tiles of 8 × 8 pixels. Where all rays agree, as far as the filter reaches, it has nothing to do.",
            Drawn::Labels(Legend::Classes(&[
                Class::label(1, "all lit: skipped"),
                Class::label(4, "all dark: skipped"),
                Class::label(2, "filtered"),
            ])),
        ),
    ]],
    needs: |_| &[],
    make: |gpu, _| Ok(Box::new(RtDenoise::new(gpu)?)),
};

const FILE: &str = "techniques/rt_denoise.wgsl";
/// Most passes of the filter.
const MOST_PASSES: u32 = 5;

struct RtDenoise {
    send: Pass,
    classify: Pass,
    temporal: Pass,
    settle: Pass,
    a_trous: Pass,
    inspect: Pass,
    blue: Slot,
    /// `Past` in WGSL.
    past: Buffer,
    /// Counts the rays of all frames but the newest, where a picture stands for several: figures are of one.
    others: Buffer,
    raw: Slot,
    /// The last frame's and this one's take turns.
    moments: [Slot; 2],
    /// This frame's, what the next one takes over, and a third to go to and fro.
    estimates: [Slot; 3],
    dispatch: Buffer,
    tiles: Option<Tiles>,
    /// Distances between taps: none, then those of the passes.
    spacings: Vec<Buffer>,
    /// What the history is of, and of how many frames.
    of: Option<(RtDenoiseParams, [u32; 2])>,
    frames: u32,
}

/// Words for each tile of a picture that has so many.
struct Tiles {
    count: u64,
    light: Buffer,
    classes: Buffer,
    mixed: Buffer,
}

impl RtDenoise {
    fn new(gpu: &Gpu) -> Result<RtDenoise> {
        let pass = |name, entry| Pass::compute(gpu, name, FILE, entry, INFO.params);
        let spacing =
            |pass: u32| gpu.buffer("spacing", bytemuck::cast_slice(&[(1 << pass) >> 1, 0, 0, 0u32]), Use::UNIFORM);
        Ok(RtDenoise {
            send: pass("shadow rays", "send")?,
            classify: pass("tile classes", "classify")?,
            temporal: pass("temporal filter", "temporal")?,
            settle: pass("other tiles", "settle")?,
            a_trous: pass("spatial filter", "a_trous")?,
            inspect: pass("inspect", "inspect")?,
            blue: Slot::default(),
            past: past(gpu),
            others: tally(gpu, "other frames' rays"),
            raw: Slot::default(),
            moments: Default::default(),
            estimates: Default::default(),
            dispatch: gpu.buffer(
                "dispatch of tiles",
                &[0; 16],
                Use::STORAGE | Use::INDIRECT | Use::COPY_DST | Use::COPY_SRC,
            ),
            tiles: None,
            spacings: (0..=MOST_PASSES).map(spacing).collect(),
            of: None,
            frames: 0,
        })
    }
}

impl Technique for RtDenoise {
    fn render(&mut self, f: &mut Frame) -> Result<()> {
        let p = RtDenoiseParams::read(f.values);
        if !f.light.has_size() {
            f.tell_note("The light has no size: one ray goes to its centre, and the filter blurs the edges.".into());
        }
        let wanted = if p.history { p.frames } else { 1 };
        // Pass 0 filters nothing, and hands on what the next frame takes over.
        let passes = if p.denoiser == "off" { 0 } else { p.passes as usize };
        let first = usize::from(p.feedback && passes > 0);
        let blue = blue_tile(f.gpu, &mut self.blue, p.sequence == "blue");
        let of = Some((p, f.size));
        if f.history != History::Goes || self.of != of {
            (self.of, self.frames) = (of, 0);
            f.clear(&self.past);
        }
        let [across, down] = f.pixel_groups().map(u64::from);
        let count = across * down;
        let room = |words: u64, label, usage| f.gpu.room(label, 4 * words, Use::STORAGE | usage);
        if self.tiles.as_ref().is_none_or(|t| t.count != count) {
            self.tiles = None;
        }
        let tiles = self.tiles.get_or_insert_with(|| Tiles {
            count,
            light: room(count, "rays of tiles", Use::empty()),
            classes: room(count, "tile classes", Use::empty()),
            mixed: room(count + 1, "mixed tiles", Use::COPY_DST),
        });
        let raw = self.raw.get(f.gpu, "rays of this frame", f.size, Format::R32Float, STORED);
        let mut moments = [0, 1].map(|i| {
            let label = ["moments", "other moments"][i];
            self.moments[i].get(f.gpu, label, f.size, Format::Rgba32Float, STORED)
        });
        let [estimate, kept, spare] = [0, 1, 2].map(|i| {
            let label = ["estimate", "kept estimate", "spare estimate"][i];
            self.estimates[i].get(f.gpu, label, f.size, Format::Rg32Uint, STORED)
        });
        let drawn = if f.history == History::Whole { wanted } else { 1 };
        for left in (0..drawn).rev() {
            if self.frames % 2 == 1 {
                moments.swap(0, 1);
            }
            let [before, now] = &moments;
            f.clear_range(&tiles.mixed, 0, 4);
            f.clear(&self.dispatch);
            let send = f.run(&self.send).of_picture().bind("past", &self.past).bind("blue_noise", &blue);
            let send = send.bind("raw_out", &raw).bind("tile_light_out", &tiles.light);
            if left > 0 { send.bind("tally", &self.others) } else { send }.per_pixel();
            f.run(&self.classify)
                .of_picture()
                .bind("raw", &raw)
                .bind("tile_light", &tiles.light)
                .bind("tile_classes_out", &tiles.classes)
                .bind("mixed_out", &tiles.mixed)
                .bind("dispatch", &self.dispatch)
                .bind("moments_out", now)
                .per_pixel();
            f.run(&self.temporal)
                .of_picture()
                .bind("past", &self.past)
                .bind("mixed_tiles", &tiles.mixed)
                .bind("raw", &raw)
                .bind("kept", &kept)
                .bind("moments", before)
                .bind("moments_out", now)
                .bind("estimate_out", &estimate)
                .dispatch_indirect(&self.dispatch, 0);
            f.run(&self.settle)
                .of_picture()
                .bind("past_out", &self.past)
                .bind("tile_classes", &tiles.classes)
                .bind("raw", &raw)
                .bind("estimate_out", &estimate)
                .bind("kept_out", &kept)
                .bind("spare_out", &spare)
                .per_pixel();
            // Before the filter writes over it.
            if left == 0 && f.wants_any_map() {
                f.run(&self.inspect)
                    .of_picture()
                    .bind("raw", &raw)
                    .bind("tile_classes", &tiles.classes)
                    .bind("estimate", &estimate)
                    .bind("moments", now)
                    .per_pixel();
            }
            let mut way = [&estimate, &kept, &spare];
            for spacing in &self.spacings[first..=passes] {
                f.run(&self.a_trous)
                    .of_picture()
                    .bind("spacing", spacing)
                    .bind("mixed_tiles", &tiles.mixed)
                    .bind("estimate", way[0])
                    .bind("estimate_out", way[1])
                    .dispatch_indirect(&self.dispatch, 0);
                // What is kept stays as it is.
                way = [way[1], way[2], if way[1] == &kept { &estimate } else { way[1] }];
            }
            if self.frames % 2 == 1 {
                moments.swap(0, 1);
            }
            self.frames = self.frames.wrapping_add(1);
        }
        f.tell_frames(self.frames.min(wanted), wanted);
        Ok(())
    }
}
