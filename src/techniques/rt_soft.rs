//! Ray-traced soft shadows: the exact reference of lights with a size.

use super::{Info, Technique, rt_hard};
use crate::frame::{Frame, History};
use crate::gpu::{Buffer, Gpu, Pass};
use crate::light::Light;
use crate::params::Params;
use crate::scene::Camera;
use crate::view::{self, Area, Axis, Class, Drawn, Legend, Span, View};
use anyhow::{Result, ensure};
use wgpu::BufferUsages as Use;

crate::params! {
    /// Rays to a light with a size.
    pub struct RtSoftParams {
        "Rays" {
            /// Rays from each pixel to the light, of which the mean is taken. In the window each frame adds some while nothing changes; pictures, measurements and times are of all.
            samples: int(64, 1..=4096, "rays"),
            /// Where on the light they end. R2: a sequence of evenly spread points, shifted from pixel to pixel, so that errors are fine noise. Stratified: one at random in each cell of a grid. Grid: the cells' middles, the same for each pixel, so that errors are bands. Both take the largest square number of rays.
            pattern: choice("r2", ["r2", "stratified", "grid"]),
        }
    }
}

pub static INFO: Info = Info {
    id: "rt-soft",
    title: "Ray-traced soft shadow",
    paper: "Cook, Porter, Carpenter 1984; R2: Roberts 2018",
    family: "Ray traced",
    mark: 39,
    doc: "The mean over rays from each pixel to points all over the light. With enough of them it is exact: the truth that all \
          others are measured against where the light has a size.",
    lights: &["directional", "spot", "omni", "hemisphere", "rect-area"],
    filter: None,
    smooth: |_| false,
    params: &[RtSoftParams::GROUP],
    main: &[("samples", "1..256*4"), ("pattern", "r2,grid")],
    maps: &[&[
        view::map(
            "standard-error",
            "Standard error",
            "How far each pixel may be off: the standard error of as many rays at random. Rays that are spread evenly err less.",
            view::ramp("standard error", "", [0.0, 0.1]),
        ),
        LIGHT_SAMPLES,
    ]],
    needs: |_| &[],
    make: |gpu, _| Ok(Box::new(RtSoft::new(gpu)?)),
};

/// The light as a pixel sees it.
pub const LIGHT_SAMPLES: View = view::map(
    "light-samples",
    "Samples of the light",
    "The light as the probed pixel sees it: a dot for each sample, up to 1024 of them. Click into the picture of another view to \
     choose the pixel.",
    Drawn::Labels(Legend::Chart(
        Area::Square,
        Axis { what: "along the light's width", span: Span::Linear(-1.0, 1.0) },
        Axis { what: "along its height", span: Span::Linear(-1.0, 1.0) },
        &[Class::label(1, "seen"), Class::label(4, "blocked")],
    )),
);

const FILE: &str = "techniques/rt_soft.wgsl";
/// Rays from each pixel that one dispatch sends, `at_once` in WGSL.
const AT_ONCE: u32 = 8;

/// What rays depend on beside the parameters: the scene's revision, camera, size, light and seed.
type Picture = (u64, Camera, [u32; 2], Light, u32);

struct RtSoft {
    resolve: Pass,
    inspect: Pass,
    /// Rays so far and those that were not blocked, a word a pixel, and the picture that they are of.
    counts: Option<(u64, Buffer)>,
    of: Option<(RtSoftParams, Picture)>,
    traced: u32,
}

impl RtSoft {
    fn new(gpu: &Gpu) -> Result<RtSoft> {
        let pass = |name, entry| Pass::compute(gpu, name, FILE, entry, INFO.params);
        Ok(RtSoft {
            resolve: pass("shadow rays", "resolve")?,
            inspect: pass("inspect", "inspect")?,
            counts: None,
            of: None,
            traced: 0,
        })
    }
}

impl Technique for RtSoft {
    fn render(&mut self, f: &mut Frame) -> Result<()> {
        let p = RtSoftParams::read(f.values);
        let wanted = match p.pattern.as_str() {
            _ if !f.light.has_size() => 1,
            "r2" => p.samples,
            _ => p.samples.isqrt().pow(2),
        };
        if !f.light.has_size() {
            f.tell_note("The light has no size: one ray goes to its centre.".into());
        }
        let bytes = f.size.iter().map(|side| *side as u64).product::<u64>() * 4;
        ensure!(
            bytes <= f.gpu.most_bound(),
            "the picture has too many pixels to count their rays; choose a smaller one"
        );
        if self.counts.as_ref().is_none_or(|(held, _)| *held != bytes) {
            self.counts = None;
            self.counts = Some((bytes, f.gpu.room("rays so far", bytes, Use::STORAGE | Use::COPY_DST)));
        }
        let Some((_, counts)) = &self.counts else { return Ok(()) };
        let of = Some((p, (f.revision, f.eye, f.size, f.light, f.seed)));
        // Along a path each frame is another picture, and wants all of its rays.
        let other = self.of != of;
        if f.history != History::Goes || f.fresh || other {
            (self.traced, self.of) = (0, of);
            f.clear(counts);
        }
        let whole = f.history == History::Whole || f.fresh || (other && f.history == History::Goes);
        let target = if whole { wanted } else { (self.traced + AT_ONCE).min(wanted) };
        // Once more where all are there: the frame's visibility is filled anew.
        loop {
            f.run(&self.resolve).in_bands(AT_ONCE * rt_hard::RAY_COST).bind("counts", counts).per_pixel();
            self.traced = (self.traced + AT_ONCE).min(wanted);
            if self.traced >= target {
                break;
            }
        }
        f.tell_frames(self.traced.div_ceil(AT_ONCE), wanted.div_ceil(AT_ONCE));
        if f.wants_any_map() {
            f.run(&self.inspect).bind("counts", counts).per_pixel();
        }
        Ok(())
    }
}
