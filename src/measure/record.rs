//! One measured configuration as one flat row: the same names in CSV, JSON, charts and docs/measures.md.

use crate::files;
use crate::params::Value;
use crate::setup::Setup;
use anyhow::{Context, Result, anyhow, bail, ensure};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// What was measured of one configuration. Absent: not applicable or not asked for; docs/measures.md says when.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Record {
    /// Place of the configuration in its sweep, from 0.
    pub index: u64,
    /// Configurations that the whole sweep has.
    pub configurations: u64,
    pub technique: String,
    /// The technique's parameters that mean something beside each other, `name=value` separated by semicolons.
    pub params: String,
    pub scene: String,
    /// Width and height of the picture, pixels.
    pub width: u32,
    pub height: u32,

    /// Pixels that face the light and are reached by it: the four counts below add up to it.
    pub facing: usize,
    pub lit_correct: usize,
    pub lit_incorrect: usize,
    pub shadow_correct: usize,
    pub shadow_incorrect: usize,
    pub away: usize,
    /// Pixels that face the light outside its cone or range.
    pub outside: usize,
    pub background: usize,
    /// Wrong pixels as a share of those that can be wrong, 0 to 1.
    pub error_share: f64,
    /// The same by what caused it ([`super::causes::CAUSES`]): they add up to `error_share`.
    pub acne_share: f64,
    pub detachment_share: f64,
    pub leak_share: f64,
    pub missing_caster_share: f64,
    pub stairs_share: f64,
    /// Samples a pixel of the truth that the sizes of errors below are against; the counts above are against one.
    pub truth_samples: u32,
    /// Visibility minus truth over the pixels that can be wrong: root mean square, mean of the absolute value, its largest,
    /// and the share of pixels where it is above [`super::metrics::TOLERANCE`].
    pub rmse: f64,
    pub mae: f64,
    pub max_error: f64,
    pub beyond_tolerance: f64,
    /// Root mean square of visibility minus the truth of one sample per pixel.
    pub rmse_hard: Option<f64>,
    /// Root mean square in the truth's penumbra, and of the final picture.
    pub rmse_penumbra: Option<f64>,
    pub rmse_image: f64,
    /// What the truth itself may be off by, root mean square.
    pub truth_error: Option<f64>,
    /// Widths of penumbrae from a tenth to nine tenths across the true contour, pixels: mean of the technique's, of the true ones,
    /// and of how far the one is off the other; and how much the former grow with the latter ([`super::softness::Penumbrae`]).
    pub penumbra_px: Option<f64>,
    pub penumbra_true_px: Option<f64>,
    pub penumbra_off_px: Option<f64>,
    pub penumbra_slope: Option<f64>,
    /// Shares of the power of visibility minus truth at wavelengths above 16 pixels, 8 to 16, 4 to 8 and below 4.
    pub power_16px: Option<f64>,
    pub power_8px: Option<f64>,
    pub power_4px: Option<f64>,
    pub power_2px: Option<f64>,
    /// Metres between blocker and surface at pixels that are lit by detachment: mean and 95th percentile.
    pub gap_mean_m: Option<f64>,
    pub gap_p95_m: Option<f64>,
    /// Mean FLIP difference of the shaded picture from the one shaded with the truth, 0 to 1.
    pub flip: f64,
    /// Quality of the shaded picture beside that with the truth, JOD: 10 where nobody sees a difference.
    pub jod: Option<f64>,
    /// Distance of wrong pixels from the true boundary, pixels.
    pub boundary_median_px: Option<f64>,
    pub boundary_p95_px: Option<f64>,
    pub boundary_max_px: Option<f64>,
    /// Mean distance between the technique's shadow contour and the true one, pixels.
    pub contour_mean_px: Option<f64>,
    /// Between neighbouring frames of a moving camera: mean change of visibility beyond the truth's, and the share of
    /// pixels whose label changes though the truth's does not.
    pub flicker: Option<f64>,
    pub label_flicker: Option<f64>,

    /// Frames drawn with a seed each: their number, the standard deviation over them (root mean square over the pixels), and what their
    /// mean is off by (root mean square, less what so few leave of the noise).
    pub seeds: Option<u32>,
    pub seed_noise: Option<f64>,
    pub seed_bias: Option<f64>,
    /// After a leap of the light: the frames until the error is within a tenth of its floor, and that floor; and by how many frames the
    /// picture is behind a light that turns by 0.4° a frame.
    pub settle_frames: Option<u32>,
    pub settle_rmse: Option<f64>,
    pub lag_frames: Option<u32>,

    /// Aliasing error m: the longest extent of a texel in the image, pixels.
    pub m_mean: Option<f64>,
    pub m_rms: Option<f64>,
    pub m_p50: Option<f64>,
    pub m_p95: Option<f64>,
    pub m_p99: Option<f64>,
    pub m_max: Option<f64>,
    /// Shares of the pixels with m above 1, 2, 10.
    pub m_over_1: Option<f64>,
    pub m_over_2: Option<f64>,
    pub m_over_10: Option<f64>,
    /// Medians of m's two factors.
    pub perspective_p50: Option<f64>,
    pub projection_p50: Option<f64>,
    /// A texel's area in the image, pixels²; the sum of the squares of its longest and its shortest extent there, pixels²;
    /// and the first over the second: median and 95th percentile.
    pub texel_area_p50: Option<f64>,
    pub texel_area_p95: Option<f64>,
    pub stretch_p50: Option<f64>,
    pub stretch_p95: Option<f64>,
    pub anisotropy_p50: Option<f64>,
    pub anisotropy_p95: Option<f64>,
    /// Places of the light's image, one a texel, that the map's warp turns over.
    pub folds: Option<u64>,

    /// Texels of all maps, and those that some view sample falls into.
    pub texels: Option<u64>,
    pub texels_covered: Option<u64>,
    /// Covered texels over all, 0 to 1: the rest is waste.
    pub covered_share: Option<f64>,
    /// Covered texels over the most that could be: min(texels, view samples).
    pub utilisation: Option<f64>,
    /// View samples a covered texel, mean and largest.
    pub count_mean: Option<f64>,
    pub count_max: Option<u64>,
    /// Inequality of the counts over all texels: 0 even, 1 all in one.
    pub count_gini: Option<f64>,
    /// Entropy of the counts over that of an even spread, 0 to 1.
    pub count_entropy: Option<f64>,

    /// Maps, faces, cascades or light samples rendered, and those that some view sample needs.
    pub views_rendered: Option<u64>,
    pub views_needed: Option<u64>,
    /// Triangles that the technique sent to the rasteriser, into the light's views or as silhouettes and volumes, and at most how
    /// many of them have a part inside.
    pub triangles_submitted: Option<u64>,
    pub triangles_drawn: Option<u64>,
    /// Fragments of those draws.
    pub fragments: Option<u64>,
    /// Warped maps: triangles that some view sample needs, and how many more are drawn in their place where they are split;
    /// negative where most are too small for a texel.
    pub triangles_needed: Option<u64>,
    pub triangles_added: Option<i64>,
    /// Of what is drawn in their place, what the map holds turned over.
    pub triangles_folded: Option<u64>,
    /// Shadow rays traced.
    pub rays: u64,
    /// Contact shadows: pixels that they darken, and those of them that are in shadow in truth.
    pub contact_hits: Option<u64>,
    pub contact_right: Option<u64>,
    /// Pixels that the technique alone has wrong by detachment, and those of them that contact shadows darken.
    pub contact_detached: Option<u64>,
    pub contact_repaired: Option<u64>,
    /// Pixels that are right only with contact shadows, and only without them.
    pub contact_gained: Option<u64>,
    pub contact_lost: Option<u64>,
    /// Bytes of GPU memory that the technique holds.
    pub gpu_bytes: u64,
    /// Lights that are on: what is counted is the sum over them, and errors are over the pixels of all of them that can be
    /// wrong.
    pub lights: u32,
    /// Where there are several, or the one that is on is not at work, each of them ([`LightRow`]), separated by semicolons.
    pub per_light: String,

    /// The technique's passes of one frame together, ms: median, quartiles, 99.9 % interval of the median.
    pub gpu_ms: f64,
    pub gpu_ms_q1: f64,
    pub gpu_ms_q3: f64,
    pub gpu_ms_low: f64,
    pub gpu_ms_high: f64,
    /// Frames counted.
    pub frames: usize,
    /// Median time over that of `shadow-map` at `ratio_resolution` in the same run.
    pub ratio: Option<f64>,
    pub ratio_resolution: Option<u32>,
    /// Median time over that of the `shadow-map` that the set-up itself describes, in the same turns: comparable across
    /// all rows of a sweep, however the machine drifts.
    pub cost: Option<f64>,
    /// Recording the technique's passes on the CPU, ms, median.
    pub cpu_ms: f64,
    /// Every pass of the frame, `name=median|q1|q3` in ms, separated by semicolons.
    pub passes: String,

    pub adapter: String,
    pub driver: String,
    /// The adapter is a program on the CPU: its times say nothing of a GPU's.
    pub software: bool,
    /// Passes were submitted one by one and timed by wall clock.
    pub wall_clock: bool,
    /// What must be known to read the row, sentences.
    pub notes: String,
    /// The whole set-up as JSON, so that the row can be measured and drawn again.
    pub setup: String,
}

impl Record {
    /// The configuration measured.
    ///
    /// # Errors
    /// A row that was changed by hand.
    pub fn setup(&self) -> Result<Setup> {
        serde_json::from_str(&self.setup).with_context(|| format!("row {}: its set-up cannot be read", self.index))
    }

    /// What the baseline of [`Record::cost`] took in the same turns, ms.
    pub fn cost_base_ms(&self) -> Option<f64> {
        self.cost.filter(|cost| *cost > 0.0).map(|cost| self.gpu_ms / cost)
    }

    /// What the baseline of [`Record::ratio`] took in the same turns, ms.
    pub fn ratio_base_ms(&self) -> Option<f64> {
        self.ratio.filter(|ratio| *ratio > 0.0).map(|ratio| self.gpu_ms / ratio)
    }

    /// Its lights, where it has several.
    pub fn per_light(&self) -> Vec<LightRow> {
        self.per_light.split(';').filter_map(LightRow::parse).collect()
    }

    /// The technique's parameters.
    pub fn values(&self) -> Vec<(&str, &str)> {
        self.params.split(';').filter_map(|p| p.split_once('=')).collect()
    }
}

/// A row's figures of one of its lights.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LightRow {
    /// Its number among the set-up's lights, from 1.
    pub number: u64,
    pub kind: String,
    /// Pixels that can be wrong, and those that are.
    pub facing: u64,
    pub wrong: u64,
    /// As [`Record::rmse`].
    pub rmse: f64,
    /// Median time of the technique's passes for it, ms.
    pub gpu_ms: f64,
    /// Bytes of GPU memory that the technique holds for it.
    pub gpu_bytes: u64,
}

impl LightRow {
    /// As [`Record::per_light`] holds them: `number=kind|facing|wrong|rmse|ms|bytes`.
    pub fn text(all: &[LightRow]) -> String {
        let one = |l: &LightRow| {
            let LightRow { number, kind, facing, wrong, rmse, gpu_ms, gpu_bytes } = l;
            format!("{number}={kind}|{facing}|{wrong}|{rmse:.6}|{gpu_ms:.4}|{gpu_bytes}")
        };
        all.iter().map(one).collect::<Vec<_>>().join(";")
    }

    fn parse(text: &str) -> Option<LightRow> {
        let (number, rest) = text.split_once('=')?;
        let [kind, facing, wrong, rmse, gpu_ms, gpu_bytes] = rest.split('|').collect::<Vec<_>>().try_into().ok()?;
        Some(LightRow {
            number: number.parse().ok()?,
            kind: kind.into(),
            facing: facing.parse().ok()?,
            wrong: wrong.parse().ok()?,
            rmse: rmse.parse().ok()?,
            gpu_ms: gpu_ms.parse().ok()?,
            gpu_bytes: gpu_bytes.parse().ok()?,
        })
    }

    /// Wrong pixels as a share of those that can be wrong, 0 to 1.
    pub fn error_share(&self) -> f64 {
        self.wrong as f64 / self.facing.max(1) as f64
    }
}

/// The selected technique's parameters as [`Record::params`] holds them.
pub fn params_text(setup: &Setup) -> String {
    setup.meaningful().iter().map(|(k, v): (&String, &Value)| format!("{k}={v}")).collect::<Vec<_>>().join(";")
}

/// Writes rows as CSV with a line of names.
pub fn write_csv(rows: &[Record], to: impl std::io::Write) -> Result<()> {
    let mut writer = csv::Writer::from_writer(to);
    for row in rows {
        writer.serialize(row)?;
    }
    writer.flush()?;
    Ok(())
}

/// Writes rows as a JSON array of objects.
pub fn write_json(rows: &[Record], to: impl std::io::Write) -> Result<()> {
    Ok(serde_json::to_writer_pretty(to, rows)?)
}

/// Reads what [`write_csv`] wrote.
pub fn read_csv(from: impl std::io::Read) -> Result<Vec<Record>> {
    Ok(csv::Reader::from_reader(from).deserialize().collect::<Result<_, _>>()?)
}

/// Reads what [`write_json`] wrote.
pub fn read_json(from: impl std::io::Read) -> Result<Vec<Record>> {
    Ok(serde_json::from_reader(from)?)
}

/// Reads rows from a .csv or .json file.
///
/// # Errors
/// No such file, or one that holds no rows of ours.
pub fn read(path: &Path) -> Result<Vec<Record>> {
    let name = path.display();
    let file =
        files::open(path, files::MOST_ROWS).map_err(|e| anyhow!("{name} cannot be read: {}", files::reason(&e)))?;
    let json = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("json"));
    let rows = if json { read_json(file) } else { read_csv(file) };
    let rows: Vec<Record> = rows.with_context(|| format!("{name} does not hold measured rows"))?;
    ensure!(!rows.is_empty(), "{name} holds no rows");
    ensure!(
        rows.iter().all(|r| !r.technique.is_empty()),
        "{name} does not hold measured rows: the column technique is missing"
    );
    let long = |r: &&Record| [&r.technique, &r.params, &r.scene].iter().any(|text| text.chars().count() > MOST_NAME);
    if let Some(row) = rows.iter().find(long) {
        bail!("{name}: row {} has a technique, params or a scene of more than {MOST_NAME} characters", row.index);
    }
    Ok(rows)
}

/// Most characters of what lists and charts show of a row.
const MOST_NAME: usize = 4096;

/// Writes rows into a file, as JSON or as CSV.
pub fn write(rows: &[Record], path: &Path, json: bool) -> Result<()> {
    let mut text = Vec::new();
    if json {
        write_json(rows, &mut text)?
    } else {
        write_csv(rows, &mut text)?
    }
    files::save(path, &text)
}

/// Whether two rows' times cannot be told apart: the intervals of their medians, widened by what frames of one
/// configuration differ from run to run, overlap.
pub fn tied(a: &Record, b: &Record) -> bool {
    let spare = if a.software || b.software { 0.10 } else { 0.02 };
    // Where both know what the same baseline took in their turns, drift between the turns is left out.
    let scale = |r: &Record| match (a.cost, b.cost) {
        (Some(_), Some(_)) => r.cost.map_or(1.0, |c| c / r.gpu_ms),
        _ => 1.0,
    };
    let interval = |r: &Record| [r.gpu_ms_low, r.gpu_ms, r.gpu_ms_high].map(|ms| ms * scale(r));
    let (a, b) = (interval(a), interval(b));
    let [first, second] = if a[1] <= b[1] { [a, b] } else { [b, a] };
    first[2] * (1.0 + spare) >= second[0] * (1.0 - spare)
}
