//! The numbers of a row as columns of tables.

use super::Record;
use anyhow::{Context, Result};

/// A number of a row as a column of a table.
pub struct Column {
    /// The record's field.
    pub id: &'static str,
    /// Its heading, with its unit.
    pub name: &'static str,
    /// What it says.
    pub doc: &'static str,
    pub get: fn(&Record) -> Option<f64>,
    /// Digits behind the point in a report; 0 for counts.
    pub digits: usize,
}

impl Column {
    /// The column of a record's field.
    ///
    /// # Errors
    /// No column of that name.
    pub fn find(id: &str) -> Result<&'static Column> {
        COLUMNS.iter().find(|c| c.id == id).with_context(|| {
            let ids: Vec<&str> = COLUMNS.iter().map(|c| c.id).collect();
            format!("{id}: there is no such column; there are {}", ids.join(", "))
        })
    }

    /// Times of their own, which say nothing on a software adapter.
    pub fn is_time(&self) -> bool {
        self.id.contains("_ms")
    }

    /// Whether it is a time as a multiple of another.
    pub fn is_multiple(&self) -> bool {
        ["ratio", "cost"].contains(&self.id)
    }

    /// Whether it is told by labels and maps alone, so that the truth of one sample per pixel is all that it needs.
    pub fn is_of_labels(&self) -> bool {
        let averaged = ["rmse", "mae", "beyond_tolerance", "rmse_penumbra", "truth_error", "flip", "jod"];
        !averaged.contains(&self.id) && !["penumbra_", "power_"].iter().any(|start| self.id.starts_with(start))
    }

    /// Its unit, as the heading has it; empty without one.
    pub fn unit(&self) -> &'static str {
        match (self.id, self.name.split_once(", ")) {
            ("gpu_ms" | "cpu_ms", _) => "ms",
            ("gpu_bytes", _) => "MiB",
            ("ratio" | "cost", _) => "×",
            (_, Some((_, unit))) => unit,
            _ => "",
        }
    }

    /// A row's number as a reader takes it in: counts whole, the rest with three digits that count.
    pub fn rounded(&self, record: &Record) -> String {
        match (self.get)(record) {
            None => "–".into(),
            Some(0.0) => "0".into(),
            Some(v) if self.digits == 0 => format!("{v:.0}"),
            Some(v) => {
                let places = (2.0 - v.abs().log10().floor()).clamp(0.0, 9.0);
                format!("{v:.0$}", places as usize)
            }
        }
    }
}

const fn column(
    id: &'static str,
    name: &'static str,
    doc: &'static str,
    digits: usize,
    get: fn(&Record) -> Option<f64>,
) -> Column {
    Column { id, name, doc, get, digits }
}

/// Of so many, in percent; None of none.
fn share(part: Option<u64>, of: Option<u64>) -> Option<f64> {
    let of = of.filter(|n| *n > 0)?;
    Some(100.0 * part? as f64 / of as f64)
}

pub const COLUMNS: &[Column] = &[
    column("error_share", "error, %", "Wrong pixels of those that face the light and are reached by it", 4, |r| {
        Some(100.0 * r.error_share)
    }),
    column("facing", "facing", "Pixels that face the light and are reached by it", 0, |r| Some(r.facing as f64)),
    column("lit_incorrect", "lit wrong", "Pixels called lit, but in shadow", 0, |r| Some(r.lit_incorrect as f64)),
    column("shadow_incorrect", "shadow wrong", "Pixels called shadow, but lit", 0, |r| Some(r.shadow_incorrect as f64)),
    column("acne_share", "acne, %", "Wrong pixels that their own surface darkens", 4, |r| Some(100.0 * r.acne_share)),
    column("detachment_share", "detached, %", "Wrong pixels lit at the foot of what should shadow them", 4, |r| {
        Some(100.0 * r.detachment_share)
    }),
    column("leak_share", "leaks, %", "Wrong pixels lit through a caster", 4, |r| Some(100.0 * r.leak_share)),
    column(
        "missing_caster_share",
        "missing, %",
        "Wrong pixels where nearly all of a caster's shadow is missing",
        4,
        |r| Some(100.0 * r.missing_caster_share),
    ),
    column("stairs_share", "stairs, %", "Wrong pixels within two pixels or texels of a true edge", 4, |r| {
        Some(100.0 * r.stairs_share)
    }),
    column("rmse", "RMSE", "Root mean square of visibility minus the averaged truth", 5, |r| Some(r.rmse)),
    column(
        "rmse_hard",
        "RMSE, one sample",
        "Root mean square of visibility minus the truth of one sample per pixel",
        5,
        |r| r.rmse_hard,
    ),
    column("mae", "MAE", "Mean absolute value of visibility minus the averaged truth", 5, |r| Some(r.mae)),
    column("beyond_tolerance", "off > 0.1, %", "Pixels whose visibility is off by more than 0.1", 3, |r| {
        Some(100.0 * r.beyond_tolerance)
    }),
    column(
        "rmse_penumbra",
        "RMSE, penumbra",
        "Root mean square of visibility minus the truth, over the true penumbra",
        5,
        |r| r.rmse_penumbra,
    ),
    column("truth_error", "truth ±", "What the averaged truth may itself be off by, root mean square", 5, |r| {
        r.truth_error
    }),
    column("penumbra_px", "penumbra, px", "Mean width of penumbrae from a tenth to nine tenths", 1, |r| r.penumbra_px),
    column("penumbra_true_px", "true penumbra, px", "Mean width of the true penumbrae there", 1, |r| {
        r.penumbra_true_px
    }),
    column("penumbra_off_px", "penumbra off, px", "Mean of how far these widths are off the true ones", 1, |r| {
        r.penumbra_off_px
    }),
    column("penumbra_slope", "penumbra slope", "How much these widths grow where the true ones do", 2, |r| {
        r.penumbra_slope
    }),
    column("power_16px", "> 16 px, %", "Share of the error's power at wavelengths above 16 pixels", 1, |r| {
        r.power_16px.map(|p| 100.0 * p)
    }),
    column("power_8px", "8–16 px, %", "Share of the error's power at wavelengths of 8 to 16 pixels", 1, |r| {
        r.power_8px.map(|p| 100.0 * p)
    }),
    column("power_4px", "4–8 px, %", "Share of the error's power at wavelengths of 4 to 8 pixels", 1, |r| {
        r.power_4px.map(|p| 100.0 * p)
    }),
    column("power_2px", "< 4 px, %", "Share of the error's power at wavelengths below 4 pixels", 1, |r| {
        r.power_2px.map(|p| 100.0 * p)
    }),
    column("gap_mean_m", "gap, m", "Mean distance of the blocker at detached pixels", 3, |r| r.gap_mean_m),
    column("gap_p95_m", "gap p95, m", "95th percentile of that distance", 3, |r| r.gap_p95_m),
    column("flip", "FLIP", "How different the shaded picture looks, 0 to 1", 5, |r| Some(r.flip)),
    column("jod", "JOD", "Quality of the picture by ColorVideoVDP: 10 where nobody sees a difference", 3, |r| r.jod),
    column("boundary_p95_px", "edge p95, px", "Distance of wrong pixels from the true edge", 1, |r| r.boundary_p95_px),
    column("contour_mean_px", "contours, px", "Mean distance between the contour and the true one", 2, |r| {
        r.contour_mean_px
    }),
    column("flicker", "flicker, %", "Change from frame to frame beyond the truth's", 4, |r| {
        r.flicker.map(|f| 100.0 * f)
    }),
    column("label_flicker", "label flicker, %", "Labels that change though the truth's do not", 4, |r| {
        r.label_flicker.map(|f| 100.0 * f)
    }),
    column("seed_noise", "noise", "Standard deviation of visibility over seeds, root mean square", 5, |r| r.seed_noise),
    column("seed_bias", "bias", "What the mean over seeds is off by, root mean square", 5, |r| r.seed_bias),
    column(
        "settle_frames",
        "settles, frames",
        "Frames after a leap of the light until the error is near its floor",
        0,
        |r| r.settle_frames.map(f64::from),
    ),
    column("settle_rmse", "settled RMSE", "RMSE of frames at rest", 5, |r| r.settle_rmse),
    column(
        "lag_frames",
        "lag, frames",
        "Frames by which the picture is behind a light that turns by 0.4° a frame",
        0,
        |r| r.lag_frames.map(f64::from),
    ),
    column("gpu_ms", "GPU ms", "Median time of the technique's passes", 3, |r| Some(r.gpu_ms)),
    column("gpu_ms_q1", "q1", "A quarter of the frames took less", 3, |r| Some(r.gpu_ms_q1)),
    column("gpu_ms_q3", "q3", "A quarter of the frames took more", 3, |r| Some(r.gpu_ms_q3)),
    column(
        "ratio",
        "× same-size plain map",
        "Time over that of the plain map (shadow-map, around a lamp cube) at the same resolution",
        2,
        |r| r.ratio,
    ),
    column("cost", "× plain map", "Time over that of the set-up's own plain map, in the same turns", 2, |r| r.cost),
    column("cpu_ms", "CPU ms", "Recording the passes", 3, |r| Some(r.cpu_ms)),
    column("gpu_bytes", "MiB", "GPU memory held", 2, |r| Some(r.gpu_bytes as f64 / 1048576.0)),
    column("rays", "rays", "Shadow rays traced", 0, |r| Some(r.rays as f64)),
    column("contact_right", "precision, %", "Pixels in true shadow of those that contact shadows darken", 1, |r| {
        share(r.contact_right, r.contact_hits)
    }),
    column("contact_repaired", "repaired, %", "Detached pixels that contact shadows darken", 1, |r| {
        share(r.contact_repaired, r.contact_detached)
    }),
    column("contact_detached", "detached", "Pixels that the technique alone has wrong by detachment", 0, |r| {
        r.contact_detached.map(|n| n as f64)
    }),
    column("contact_gained", "gained", "Pixels that are right only with contact shadows", 0, |r| {
        r.contact_gained.map(|n| n as f64)
    }),
    column("contact_lost", "lost", "Pixels that are wrong only with contact shadows", 0, |r| {
        r.contact_lost.map(|n| n as f64)
    }),
    column("m_p50", "m median, px", "Extent of a texel in the picture", 2, |r| r.m_p50),
    column("m_p95", "m p95, px", "Extent of a texel in the picture", 2, |r| r.m_p95),
    column("perspective_p50", "perspective m, px", "The part of m that comes from distances, median", 2, |r| {
        r.perspective_p50
    }),
    column("projection_p50", "projection m", "The part of m that comes from slopes, median", 2, |r| r.projection_p50),
    column("texel_area_p95", "texel area p95, px²", "Area of a texel in the picture", 2, |r| r.texel_area_p95),
    column("stretch_p95", "stretch p95, px²", "Squares of a texel's longest and shortest extent", 2, |r| {
        r.stretch_p95
    }),
    column("anisotropy_p95", "long/short p95", "Longest over shortest extent of a texel", 2, |r| r.anisotropy_p95),
    column("folds", "folds", "Texels' worth of the light's image that the warp turns over", 0, |r| {
        r.folds.map(|n| n as f64)
    }),
    column("views_rendered", "maps", "Maps rendered", 0, |r| r.views_rendered.map(|v| v as f64)),
    column("views_needed", "needed", "Maps that some view sample falls into", 0, |r| r.views_needed.map(|v| v as f64)),
    column("covered_share", "covered, %", "Texels that some view sample falls into", 1, |r| {
        r.covered_share.map(|c| 100.0 * c)
    }),
    column("triangles_submitted", "triangles sent", "Triangles sent to the maps", 0, |r| {
        r.triangles_submitted.map(|t| t as f64)
    }),
    column("triangles_drawn", "drawn", "At most so many of them have a part inside a map", 0, |r| {
        r.triangles_drawn.map(|t| t as f64)
    }),
    column("fragments", "fragments", "Runs of the fragment shader in these draws", 0, |r| {
        r.fragments.map(|n| n as f64)
    }),
    column("utilisation", "texel use, %", "Covered texels of those that could be", 1, |r| {
        r.utilisation.map(|u| 100.0 * u)
    }),
    column("frames", "frames", "Frames counted", 0, |r| Some(r.frames as f64)),
];
