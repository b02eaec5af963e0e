//! `chart`: error against cost from measured rows.

use crate::chart::{self, Axis, COSTS, ERRORS};
use crate::files;
use crate::measure::{self, Record};
use crate::message::tell;
use anyhow::{Result, bail, ensure};
use std::path::PathBuf;

#[derive(clap::Args)]
pub struct Wanted {
    /// Results of sweeps and measurements, .csv or .json; several are joined.
    #[arg(required = true)]
    results: Vec<PathBuf>,
    /// File to write: .svg or .png.
    #[arg(short, long)]
    output: PathBuf,
    /// The cost: gpu_ms, ratio, cost, gpu_bytes, rays, triangles_submitted or fragments.
    #[arg(long, default_value = COSTS[0].id)]
    x: String,
    /// The error: error_share, rmse, mae, beyond_tolerance, flip, jod, rmse_penumbra, penumbra_off_px, gap_p95_m, boundary_p95_px, contour_mean_px
    /// or flicker; or of the texels m_p95, texel_area_p95, stretch_p95, anisotropy_p95 or folds.
    #[arg(long, default_value = ERRORS[0].id)]
    y: String,
    /// One line a technique: its own Pareto front over all of its parameters. The rest are faint points.
    #[arg(long)]
    fronts: bool,
    /// Heading of the chart.
    #[arg(long, default_value = "")]
    title: String,
    /// Width of a .png, pixels.
    #[arg(long, default_value_t = 1400)]
    width: u32,
}

pub fn run(wanted: &Wanted) -> Result<()> {
    let (x, y) = (axis("--x", &wanted.x, COSTS)?, axis("--y", &wanted.y, ERRORS)?);
    let name = wanted.output.display();
    let ends = |e: &str| wanted.output.extension().is_some_and(|f| f.eq_ignore_ascii_case(e));
    ensure!(ends("svg") || ends("png"), "{name}: a chart's file name ends in .svg or .png");
    super::check_target(&wanted.output)?;
    let mut rows: Vec<Record> = Vec::new();
    for path in &wanted.results {
        rows.append(&mut measure::read(path)?);
    }
    ensure!(!rows.is_empty(), "there is nothing to draw: the results hold no rows");
    for axis in [x, y] {
        let missing = rows.iter().filter(|r| (axis.get)(r).is_none()).count();
        if missing > 0 {
            let why = why_missing(axis);
            ensure!(missing < rows.len(), "there is nothing to draw: no row has a value for {}; {why}", axis.id);
            tell!("left out: {missing} of {} rows, which have no value for {}; {why}", rows.len(), axis.id);
        }
    }
    let svg = match wanted.fronts {
        true => chart::fronts_svg(&rows, x, y, &wanted.title)?,
        false => chart::svg(&rows, x, y, &wanted.title)?,
    };
    let bytes = if ends("png") { chart::png(&svg, wanted.width)? } else { svg.into_bytes() };
    files::save(&wanted.output, &bytes)?;
    tell!("wrote {name}");
    Ok(())
}

fn why_missing(axis: &Axis) -> &'static str {
    match axis.id {
        "flicker" => "only a sweep or measurement with --flicker measures it",
        "boundary_p95_px" | "contour_mean_px" => "there is no shadow edge to measure from",
        "rmse_penumbra" | "penumbra_off_px" => "there is no penumbra to measure",
        "m_p95" | "texel_area_p95" | "stretch_p95" | "anisotropy_p95" | "folds" => {
            "such a technique looks nothing up in a map"
        }
        "triangles_submitted" | "fragments" => "such a technique draws nothing, or the adapter does not count it",
        "ratio" => "no plain map serves that light",
        _ => "the file does not hold it",
    }
}

fn axis(option: &str, id: &str, axes: &'static [Axis]) -> Result<&'static Axis> {
    let Some(axis) = axes.iter().find(|a| a.id == id) else {
        let ids: Vec<&str> = axes.iter().map(|a| a.id).collect();
        bail!("{option} {id}: there is no such axis; there are {}", ids.join(", "));
    };
    Ok(axis)
}
