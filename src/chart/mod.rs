//! Error against cost: what the window's chart, `chart` and the reports have in common, and charts for paper.

mod canvas;
mod error_cost;
mod labels;
mod lines;
mod raster;
mod scale;

pub use canvas::{escape, text_width, wrap};
pub use error_cost::{fronts_svg, svg};
pub use labels::inside;
pub use lines::{Line, Lines, lines_svg};
pub use raster::{lay_over, pixels, png};
pub use scale::{digits, round_step, short};

use crate::measure::Record;
use crate::techniques;
use std::collections::{BTreeMap, BTreeSet};

/// A number of a [`Record`] that can be put on an axis.
pub struct Axis {
    /// The record's field.
    pub id: &'static str,
    /// As written beside the axis, with its unit.
    pub title: &'static str,
    /// What it says, in a student's words.
    pub doc: &'static str,
    pub get: fn(&Record) -> Option<f64>,
}

impl Axis {
    /// It runs over shares, which are written in per cent.
    pub fn percent(&self) -> bool {
        ["error_share", "beyond_tolerance", "flicker"].contains(&self.id)
    }

    /// A record's value as the axis has it.
    pub fn of(&self, record: &Record) -> Option<f64> {
        let value = (self.get)(record)?;
        Some(if self.percent() { 100.0 * value } else { value })
    }

    /// The middle half of what was measured of a cost: quartiles of a time, else the value alone.
    pub fn spread(&self, record: &Record) -> Option<[f64; 2]> {
        let value = self.of(record)?;
        let timed = ["gpu_ms", "ratio", "cost"].contains(&self.id) && record.gpu_ms_q1 > 0.0;
        let scale = value / record.gpu_ms;
        Some(if timed { [record.gpu_ms_q1 * scale, record.gpu_ms_q3 * scale] } else { [value; 2] })
    }
}

/// What can stand on the error axis; the first is the default.
pub const ERRORS: &[Axis] = &[
    Axis {
        id: "error_share",
        title: "wrong pixels, % of those that can be wrong",
        doc: "Wrong pixels as a share of those that face the light and are reached by it, against one sample per pixel: for hard techniques.",
        get: |r| Some(r.error_share),
    },
    Axis {
        id: "rmse",
        title: "RMSE of visibility",
        doc: "Root mean square of visibility minus the truth averaged over the pixel: fair to filters.",
        get: |r| Some(r.rmse),
    },
    Axis {
        id: "mae",
        title: "mean absolute error of visibility",
        doc: "Mean absolute value of visibility minus the truth averaged over the pixel.",
        get: |r| Some(r.mae),
    },
    Axis {
        id: "beyond_tolerance",
        title: "visibility off by more than 0.1, % of pixels",
        doc: "Share of the pixels whose visibility differs from the truth averaged over the pixel by more than 0.1.",
        get: |r| Some(r.beyond_tolerance),
    },
    Axis {
        id: "flip",
        title: "FLIP of the shaded picture",
        doc: "How different the picture looks from the true one to a human eye.",
        get: |r| Some(r.flip),
    },
    Axis {
        id: "jod",
        title: "loss of quality (ColorVideoVDP), JOD",
        doc: "How far the picture's quality falls below 10 JOD, where nobody sees a difference from the true one; of two pictures 1 JOD apart three in four people prefer the better.",
        get: |r| r.jod.map(|jod| 10.0 - jod),
    },
    Axis {
        id: "rmse_penumbra",
        title: "RMSE of visibility in the penumbra",
        doc: "Root mean square of visibility minus the averaged truth over pixels whose truth lies between 0 and 1.",
        get: |r| r.rmse_penumbra,
    },
    Axis {
        id: "penumbra_off_px",
        title: "penumbra's width off the true one, pixels",
        doc: "How far penumbrae are wider or narrower than the true ones, from a tenth to nine tenths across the true contour, on average.",
        get: |r| r.penumbra_off_px,
    },
    Axis {
        id: "gap_p95_m",
        title: "contact gap (95th percentile), metres",
        doc: "How far the blocker is from pixels that are lit between a caster's foot and its shadow; 0 where there are none.",
        get: |r| r.gap_p95_m.or(Some(0.0)),
    },
    Axis {
        id: "boundary_p95_px",
        title: "boundary error (95th percentile), pixels",
        doc: "How far wrong pixels lie from the true shadow edge; 0 where none is wrong.",
        get: |r| r.boundary_p95_px.or((r.lit_incorrect + r.shadow_incorrect == 0).then_some(0.0)),
    },
    Axis {
        id: "contour_mean_px",
        title: "distance between the contours (mean), pixels",
        doc: "How far the shadow's edges run from the true ones, and those from them; 0 where nothing is wrong.",
        get: |r| r.contour_mean_px.or((r.lit_incorrect + r.shadow_incorrect == 0).then_some(0.0)),
    },
    Axis {
        id: "flicker",
        title: "flicker, mean change per frame beyond the truth's, %",
        doc: "How much visibility changes between neighbouring frames beyond the truth's change.",
        get: |r| r.flicker,
    },
    Axis {
        id: "m_p95",
        title: "texel's longest extent in the picture (95th percentile), pixels",
        doc: "Aliasing error m: above 1 the map has too few texels, below 1 more than pixels.",
        get: |r| r.m_p95,
    },
    Axis {
        id: "texel_area_p95",
        title: "texel's area in the picture (95th percentile), pixels²",
        doc: "How many pixels a texel covers.",
        get: |r| r.texel_area_p95,
    },
    Axis {
        id: "stretch_p95",
        title: "texel's stretch in the picture (95th percentile), pixels²",
        doc: "Squares of a texel's longest and shortest extent, added up: large where it is large or long.",
        get: |r| r.stretch_p95,
    },
    Axis {
        id: "anisotropy_p95",
        title: "texel's longest over its shortest extent (95th percentile)",
        doc: "1: texels appear as squares or circles do; large: as long strips.",
        get: |r| r.anisotropy_p95,
    },
    Axis {
        id: "folds",
        title: "folds of the warp, texels",
        doc: "Texels' worth of the light's image that the warp turns over; 0 for maps without a warp.",
        get: |r| r.folds.map(|n| n as f64),
    },
];

/// What can stand on the cost axis; the first is the default.
pub const COSTS: &[Axis] = &[
    Axis {
        id: "gpu_ms",
        title: "technique, ms per frame",
        doc: "The technique's passes of one frame together.",
        get: |r| Some(r.gpu_ms),
    },
    Axis {
        id: "ratio",
        title: "time, plain map of the same resolution = 1",
        doc: "Time as a multiple of that of the plain map (shadow-map, around a lamp cube) of the same resolution, in the same run: each resolution has a base of its own.",
        get: |r| r.ratio,
    },
    Axis {
        id: "cost",
        title: "time, the set-up's own plain map = 1",
        doc: "Time as a multiple of that of the plain map that the set-up describes, in the same turns: one base for all rows.",
        get: |r| r.cost,
    },
    Axis {
        id: "gpu_bytes",
        title: "GPU memory held, bytes",
        doc: "Textures and buffers that the technique holds.",
        get: |r| Some(r.gpu_bytes as f64),
    },
    Axis {
        id: "rays",
        title: "shadow rays per frame",
        doc: "Rays that the technique traces in one frame.",
        get: |r| Some(r.rays as f64),
    },
    Axis {
        id: "triangles_submitted",
        title: "triangles sent to the light's views",
        doc: "Triangles in the draws of all maps of one frame.",
        get: |r| r.triangles_submitted.map(|n| n as f64),
    },
    Axis {
        id: "fragments",
        title: "fragments drawn",
        doc: "Runs of the fragment shader in the draws of all maps of one frame.",
        get: |r| r.fragments.map(|n| n as f64),
    },
];

/// Where a record stands in a chart, (cost, error); None if it lacks one of the two, or has one that nothing measures and whose
/// decade no axis can begin or end at.
pub fn point(record: &Record, x: &Axis, y: &Axis) -> Option<(f64, f64)> {
    let usable = |v: &f64| *v == 0.0 || (1e-300..=1e300).contains(v);
    Some((x.of(record).filter(usable)?, y.of(record).filter(usable)?))
}

/// Records that differ in their technique's main parameter only, in its order.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    pub technique: String,
    /// The technique's id and what else sets the line apart: `pcf kernel=5`.
    pub label: String,
    /// Indices into the records.
    pub points: Vec<usize>,
}

/// Sorts records into lines: one for each technique and each combination of its other parameters that vary, and of the
/// scene, size, camera, light, clock, seed and adapter where the records differ in them. Lines come in the order of
/// [`techniques::ALL`], then by the values that set them apart.
pub fn series(records: &[Record]) -> Vec<Series> {
    grouped(records, true)
}

/// One line a technique (and scene, size and so on): its own front, the configurations that no other of its own beats in
/// cost and error, by ascending cost. And the rest, each alone. All records must have both numbers.
pub fn fronts(records: &[Record], x: &Axis, y: &Axis) -> (Vec<Series>, Vec<Series>) {
    let (mut out, mut rest) = (Vec::new(), Vec::new());
    for s in grouped(records, false) {
        let values: Vec<(f64, f64)> = s.points.iter().filter_map(|i| point(&records[*i], x, y)).collect();
        let front = pareto(&values);
        let others = (0..s.points.len()).filter(|n| !front.contains(n));
        rest.extend(others.map(|n| Series { points: vec![s.points[n]], ..s.clone() }));
        out.push(Series { points: front.iter().map(|n| s.points[*n]).collect(), ..s });
    }
    (out, rest)
}

/// [`series`]; with `own` the techniques' parameters set lines apart, without only what lies around them.
fn grouped(records: &[Record], own: bool) -> Vec<Series> {
    let mut traits: Vec<Vec<Trait>> = records.iter().map(traits).collect();
    if !own {
        traits.iter_mut().for_each(|t| t.retain(|(of, ..)| of.is_empty()));
    }
    let mut values: BTreeMap<(&str, &str), BTreeSet<&str>> = BTreeMap::new();
    for (of, name, value) in traits.iter().flatten() {
        values.entry((of, name)).or_default().insert(value);
    }
    let mut found: BTreeMap<(usize, &str, Vec<Sorted>), Series> = BTreeMap::new();
    for (i, r) in records.iter().enumerate() {
        let mut label = r.technique.clone();
        let mut key = Vec::new();
        for (of, name, value) in &traits[i] {
            let all = &values[&(*of, *name)];
            if all.len() > 1 {
                label += &match *name {
                    "scene" | "size" => format!(" {value}"),
                    // Too long to print: their place among those there are.
                    "camera" | "light" | "adapter" => {
                        format!(" {name} {}", all.iter().position(|v| v == value).unwrap_or(0) + 1)
                    }
                    _ => format!(" {name}={value}"),
                };
                key.push(Sorted::of(value));
            }
        }
        let new = || Series { technique: r.technique.clone(), label, points: vec![] };
        found.entry((place(&r.technique), &r.technique, key)).or_insert_with(new).points.push(i);
    }
    let mut out: Vec<Series> = found.into_values().collect();
    for s in &mut out {
        s.points.sort_by_cached_key(|i| (Sorted::of(main_value(&records[*i]).unwrap_or_default()), records[*i].index));
    }
    out
}

/// Numbers in their order, then words in theirs.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
enum Sorted {
    Number(i128),
    Word(String),
}

impl Sorted {
    fn of(text: &str) -> Sorted {
        // Nine digits behind the point are more than any parameter is written with.
        text.parse::<f64>().map_or_else(|_| Sorted::Word(text.into()), |v| Sorted::Number((v * 1e9).round() as i128))
    }
}

/// What sets a record apart: the technique whose parameter it is (or none), its name and value.
type Trait<'a> = (&'a str, &'a str, String);

/// What sets a record apart from others besides its technique and main parameter.
fn traits(r: &Record) -> Vec<Trait<'_>> {
    let main = main_parameter(&r.technique);
    let own = r.values().into_iter().filter(|(name, _)| Some(*name) != main);
    let mut out: Vec<_> = own.map(|(name, value)| (r.technique.as_str(), name, value.to_string())).collect();
    out.push(("", "scene", r.scene.clone()));
    out.push(("", "size", format!("{}×{}", r.width, r.height)));
    if let Ok(setup) = serde_json::from_str::<serde_json::Value>(&r.setup) {
        for name in ["camera", "light", "time", "animation", "seed"] {
            out.push(("", name, setup[name].to_string()));
        }
    }
    out.push(("", "truth_samples", r.truth_samples.to_string()));
    out.push(("", "adapter", r.adapter.clone()));
    out
}

/// A technique's place in [`techniques::ALL`]; unknown ones stand behind.
fn place(technique: &str) -> usize {
    techniques::ALL.iter().position(|i| i.id == technique).unwrap_or(techniques::ALL.len())
}

/// The number of a technique's colour in [`COLORS`] and of its marker.
pub fn mark(technique: &str) -> usize {
    techniques::find(technique).map_or(techniques::ALL.len(), |i| i.mark)
}

/// The value of a record's main parameter.
pub fn main_value(record: &Record) -> Option<&str> {
    let main = main_parameter(&record.technique)?;
    record.values().into_iter().find(|(name, _)| *name == main).map(|(_, value)| value)
}

/// The parameter that a technique's line runs over.
pub fn main_parameter(technique: &str) -> Option<&'static str> {
    techniques::find(technique)?.main.first().map(|(name, _)| *name)
}

/// Where a record stands, with the spread of its cost.
pub fn spot(record: &Record, cost: &Axis, error: &Axis) -> Option<Spot> {
    let (x, y) = point(record, cost, error)?;
    Some(Spot { cost: x, spread: cost.spread(record)?, error: y })
}

/// The Pareto front, as [`pareto`]; none over `ratio`, each of whose points has a denominator of its own.
pub fn front(cost: &Axis, spots: &[Spot]) -> Vec<usize> {
    if cost.id == "ratio" { Vec::new() } else { pareto(spots) }
}

/// A cost, the middle half of what was measured of it, and an error.
#[derive(Clone, Copy, Debug)]
pub struct Spot {
    pub cost: f64,
    pub spread: [f64; 2],
    pub error: f64,
}

/// A cost that is known exactly.
impl From<(f64, f64)> for Spot {
    fn from((cost, error): (f64, f64)) -> Spot {
        Spot { cost, spread: [cost; 2], error }
    }
}

impl Spot {
    /// Cheaper for sure: the spreads do not overlap.
    fn cheaper(&self, other: &Spot) -> bool {
        self.spread[1] < other.spread[0]
    }
}

/// Indices of the front, by ascending cost: nothing on it is at least as good in both as another there and better in one,
/// where costs whose spreads overlap are as good as each other, and whatever is not on it is beaten so by something that
/// is. (Not by anything at all: spreads overlap in chains, along which the cheap would give way to the dear.) Of equal
/// points the first stands for all; those that are no numbers are left out.
pub fn pareto<P: Copy + Into<Spot>>(points: &[P]) -> Vec<usize> {
    let spots: Vec<Spot> = points.iter().map(|p| (*p).into()).collect();
    let mut order: Vec<usize> =
        (0..spots.len()).filter(|i| !spots[*i].cost.is_nan() && !spots[*i].error.is_nan()).collect();
    let by_cost = |a: &usize, b: &usize| spots[*a].cost.total_cmp(&spots[*b].cost);
    let by_error = |a: &usize, b: &usize| spots[*a].error.total_cmp(&spots[*b].error);
    // What beats another stands before it.
    order.sort_by(|a, b| by_error(a, b).then(by_cost(a, b)).then(a.cmp(b)));
    let beats = |i: usize, j: usize| {
        let (a, b) = (&spots[i], &spots[j]);
        let same = a.cost == b.cost && a.error == b.error && i < j;
        a.error <= b.error && !b.cheaper(a) && (a.error < b.error || a.cheaper(b) || same)
    };
    let mut front: Vec<usize> = Vec::new();
    for j in order {
        if !front.iter().any(|i| beats(*i, j)) {
            front.push(j);
        }
    }
    front.sort_by(|a, b| by_cost(a, b).then(by_error(a, b)));
    front
}

/// What is said where the times scatter so much that they rank nothing; None where they do not.
pub fn busy(rows: &[Record]) -> Option<String> {
    let timed = rows.iter().filter(|r| r.gpu_ms > 0.0 && r.gpu_ms_q3 > 0.0);
    let mut scatter: Vec<f64> = timed.map(|r| (r.gpu_ms_q3 - r.gpu_ms_q1) / r.gpu_ms).collect();
    scatter.sort_by(f64::total_cmp);
    let middle = *scatter.get(scatter.len() / 2)?;
    (middle > BUSY).then(|| {
        format!(
            "The machine was too busy to rank times: the middle half of a row's frames spans {:.0} % of its median.",
            100.0 * middle
        )
    })
}

/// Span of the quartiles over the median, for half of the rows, above which times rank nothing.
const BUSY: f64 = 0.3;

/// Colour of the n-th technique: Okabe and Ito's palette, which the colour-blind can tell apart, then three more; the
/// markers tell them apart too.
pub const COLORS: [[u8; 3]; 10] = [
    [0, 114, 178],
    [230, 159, 0],
    [0, 158, 115],
    [204, 121, 167],
    [213, 94, 0],
    [86, 180, 233],
    [120, 120, 120],
    [117, 79, 184],
    [140, 102, 46],
    [90, 160, 60],
];
