//! Error against cost: what the window's chart, `chart` and the reports have in common.

use crate::measure::Record;
use crate::techniques;
use std::collections::BTreeSet;

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

/// What can stand on the error axis; the first is the default.
pub const ERRORS: &[Axis] = &[
    Axis {
        id: "error_share",
        title: "wrong pixels, share of those facing the light",
        doc: "Wrong pixels as a share of those that face the light.",
        get: |r| Some(r.error_share),
    },
    Axis {
        id: "rmse",
        title: "RMSE of visibility",
        doc: "Root mean square of visibility minus truth: counts soft errors too.",
        get: |r| Some(r.rmse),
    },
    Axis {
        id: "flip",
        title: "FLIP of the shaded picture",
        doc: "How different the picture looks from the true one to a human eye.",
        get: |r| Some(r.flip),
    },
    Axis {
        id: "boundary_p95_px",
        title: "boundary error (95th percentile), pixels",
        doc: "How far wrong pixels lie from the true shadow edge.",
        get: |r| r.boundary_p95_px,
    },
    Axis {
        id: "flicker",
        title: "flicker, share of pixels a frame",
        doc: "Labels that change between neighbouring frames though the truth's do not.",
        get: |r| r.flicker,
    },
];

/// What can stand on the cost axis; the first is the default.
pub const COSTS: &[Axis] = &[
    Axis {
        id: "gpu_ms",
        title: "GPU time, ms a frame",
        doc: "The technique's passes of one frame together.",
        get: |r| Some(r.gpu_ms),
    },
    Axis {
        id: "ratio",
        title: "time, shadow-map of the same resolution = 1",
        doc: "Time as a multiple of the standard shadow map's, measured in the same run.",
        get: |r| r.ratio,
    },
    Axis {
        id: "cost",
        title: "time, the set-up's own shadow-map = 1",
        doc: "Time as a multiple of that of the shadow map that the set-up describes: comparable across all rows.",
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
        title: "shadow rays a frame",
        doc: "Rays that the technique traces in one frame.",
        get: |r| Some(r.rays as f64),
    },
];

/// Records of one technique that differ in its main parameter only, in its order.
pub struct Series {
    pub technique: String,
    /// The technique's id and what else sets the line apart: `pcf kernel=5`.
    pub label: String,
    /// Indices into the records.
    pub points: Vec<usize>,
}

/// Sorts records into lines: one for each technique and each combination of its other parameters that vary.
pub fn series(records: &[Record]) -> Vec<Series> {
    let mut out: Vec<Series> = Vec::new();
    for (i, r) in records.iter().enumerate() {
        let main = main_parameter(&r.technique);
        let alike = |o: &&Record| o.technique == r.technique;
        let others = r.values().into_iter().filter(|(name, _)| Some(*name) != main);
        let mut label = r.technique.clone();
        for (name, value) in others {
            let all: BTreeSet<&str> = records
                .iter()
                .filter(alike)
                .flat_map(|o| o.values())
                .filter(|(n, _)| *n == name)
                .map(|(_, v)| v)
                .collect();
            if all.len() > 1 {
                label += &format!(" {name}={value}");
            }
        }
        match out.iter_mut().find(|s| s.label == label) {
            Some(s) => s.points.push(i),
            None => out.push(Series { technique: r.technique.clone(), label, points: vec![i] }),
        }
    }
    for s in &mut out {
        let main = main_parameter(&s.technique);
        let place = |i: &usize| {
            let values = records[*i].values();
            let value = values.iter().find(|(n, _)| Some(*n) == main).map(|(_, v)| *v).unwrap_or_default();
            value.parse::<f64>().unwrap_or(0.0)
        };
        s.points.sort_by(|a, b| place(a).total_cmp(&place(b)));
    }
    out
}

/// The parameter that a technique's line runs over.
pub fn main_parameter(technique: &str) -> Option<&'static str> {
    techniques::find(technique)?.main.first().map(|(name, _)| *name)
}

/// Indices of the points that no other beats in both numbers, by ascending x. Points are (cost, error).
pub fn pareto(points: &[(f64, f64)]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_by(|a, b| points[*a].0.total_cmp(&points[*b].0).then(points[*a].1.total_cmp(&points[*b].1)));
    let mut least = f64::INFINITY;
    order.retain(|i| {
        let better = points[*i].1 < least;
        least = least.min(points[*i].1);
        better
    });
    order
}

/// Colour of the n-th technique: Okabe and Ito's palette, which the colour-blind can tell apart.
pub const COLORS: [[u8; 3]; 7] =
    [[0, 114, 178], [230, 159, 0], [0, 158, 115], [204, 121, 167], [213, 94, 0], [86, 180, 233], [120, 120, 120]];
