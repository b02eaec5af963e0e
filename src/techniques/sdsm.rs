//! Sample distribution shadow maps (Lauritzen, Salvi, Lefohn 2011).

use super::{FILTERING, Info, Technique, chosen};
use crate::frame::Frame;
use crate::gpu::{Buffer, Gpu, Pass};
use crate::light::LightView;
use crate::map::cascades::{ANALYSED, Boxes, CascadeParams, Cascades, MAPS};
use crate::map::filter::{LookUp, alone};
use crate::map::peel::StoredParams;
use crate::map::{BiasParams, CasterParams, HardwareParams};
use crate::params::{Params, Values};
use crate::scene::Camera;
use crate::view::{self, Area, Axis, Class, Drawn, Legend, Span};
use anyhow::Result;

crate::params! {
    /// How the cascades follow the view samples.
    pub struct SdsmParams {
        "Splits" {
            /// Where the cascades meet, between the nearest and the farthest sample. Log: each as many times as deep as the one before. Adaptive-log: equally many samples in each, so that empty depths get no map. Kmeans: around clusters of the samples' logarithmic depths.
            scheme: choice("log", ["log", "adaptive-log", "kmeans"]) if cascades > 1,
        }
        "Fit" {
            /// Texels to spare around each cascade's samples.
            dilate: float(2.0, 0.0..=16.0, "texels"),
            /// The smallest side that a cascade's box may have.
            min_box: float(0.01, 0.000001..=1000.0, "m", 0.5 of view),
            /// How much of the previous frame's splits and larger boxes is kept. Steadier, but figures then depend on earlier frames.
            smoothing: float(0.0, 0.0..=0.95, ""),
        }
    }
}

const FILE: &str = "techniques/sdsm.wgsl";

pub static INFO: Info = Info {
    id: "sdsm",
    title: "Sample distribution shadow maps",
    paper: "Lauritzen, Salvi, Lefohn 2011",
    family: "Cascades",
    mark: 3,
    doc: "Cascades between the nearest and the farthest surface seen, each map drawn tightly around its part of the \
          picture: no texel for what nobody sees. Something that comes into view can stretch a map suddenly: it pops.",
    lights: &["directional", "spot"],
    filter: None,
    smooth: |_| false,
    params: crate::groups!(
        &[CascadeParams::GROUP, CasterParams::GROUP, SdsmParams::GROUP],
        FILTERING,
        &[BiasParams::GROUP, StoredParams::GROUP, HardwareParams::GROUP],
    ),
    main: &[("resolution", "256..4096*2"), ("cascades", "2,4"), ("scheme", "log,kmeans")],
    maps: &[
        &MAPS,
        ANALYSED,
        &[
            view::map(
                "histogram",
                "Depth histogram",
                "How many samples lie at which depth: logarithmic, near at the left; heights are square roots. White: the \
              splits.",
                Drawn::Labels(Legend::Chart(
                    Area::Margins,
                    Axis { what: "depth, m", span: Span::Splits },
                    Axis { what: "share of the fullest bin", span: Span::Root },
                    &[Class::label(8, "splits")],
                )),
            ),
            view::map(
                "boxes",
                "Sample boxes",
                "The light's view with the box around each cascade's samples; grey: the previous frame's boxes, \
                      where they differ.",
                Drawn::Labels(Legend::Cascades),
            ),
        ],
    ],
    needs: |_| &[],
    make: |gpu, info| Ok(Box::new(Sdsm::new(gpu, info)?)),
};

/// What must not change suddenly for the last frame to be worth keeping.
#[derive(PartialEq)]
struct Last {
    camera: Camera,
    whole: LightView,
    size: [u32; 2],
    values: Values,
}

impl Last {
    /// Whether this is another view rather than the next step of the last: the camera turned by more than 10° or moved
    /// by more than a tenth of the distance to its target, or anything else changed.
    fn jumped(&self, now: &Last) -> bool {
        let (a, b) = (&self.camera, &now.camera);
        let still = Camera { position: b.position, target: b.target, ..*a };
        let moved = a.position.distance(b.position) > 0.1 * a.position.distance(a.target);
        let turned = a.forward().dot(b.forward()) < 10f32.to_radians().cos();
        moved || turned || still != *b || (self.whole, self.size, &self.values) != (now.whole, now.size, &now.values)
    }
}

struct Sdsm {
    cascades: Cascades,
    range: Buffer,
    bins: Buffer,
    find_range: Pass,
    fill_bins: Pass,
    place_splits: Pass,
    look_up: LookUp,
    last: Option<Last>,
}

impl Sdsm {
    fn new(gpu: &Gpu, info: &Info) -> Result<Sdsm> {
        let pass = |name, entry| Pass::compute(gpu, name, &alone(FILE), entry, info.params);
        let zero = |label, size: usize| gpu.buffer(label, &vec![0; size], wgpu::BufferUsages::STORAGE);
        Ok(Sdsm {
            cascades: Cascades::new(gpu)?,
            range: zero("depth range", 16),
            bins: zero("depth histogram", 1025 * 4),
            find_range: pass("depth range", "find_range")?,
            fill_bins: pass("depth histogram", "fill_bins")?,
            place_splits: pass("splits", "place_splits")?,
            look_up: LookUp::new(gpu, FILE, info.params),
            last: None,
        })
    }
}

impl Technique for Sdsm {
    fn render(&mut self, f: &mut Frame) -> Result<()> {
        let p = SdsmParams::read(f.values);
        let c = CascadeParams::read(f.values);
        let filter = chosen(f.values);
        let reach = (filter.reach)(f);
        let whole = self.cascades.whole(f, &c, reach)?;
        let boxes = Boxes::Samples { dilate: p.dilate, least: p.min_box, smoothing: p.smoothing };
        self.cascades.prepare(f, &c, reach, &boxes);
        let now = Last { camera: f.camera, whole, size: f.size, values: f.values.clone() };
        if self.last.as_ref().is_none_or(|last| last.jumped(&now)) {
            f.clear(&self.cascades.splits);
            f.clear(&self.cascades.boxes);
        }
        self.last = Some(now);
        f.clear(&self.range);
        f.clear(&self.bins);
        let [w, h] = f.size.map(|s| s.div_ceil(64));
        f.run(&self.find_range).bind("range", &self.range).dispatch(w, h, 1);
        // The logarithmic scheme needs the range only.
        if p.scheme != "log" || f.view == "histogram" {
            f.run(&self.fill_bins).bind("range", &self.range).bind("bins", &self.bins).dispatch(w, h, 1);
        }
        f.run(&self.place_splits)
            .bind("range", &self.range)
            .bind("bins", &self.bins)
            .bind("fitting", &self.cascades.fitting)
            .bind("parts", &self.cascades.splits)
            .dispatch(1, 1, 1);
        let maps = self.cascades.draw(f, &c)?;
        let bound = [
            ("light_view", (&self.cascades.whole).into()),
            ("range", (&self.range).into()),
            ("bins", (&self.bins).into()),
            ("boxes", (&self.cascades.boxes).into()),
        ];
        self.look_up.run(f, &maps, filter, &bound)
    }
}
