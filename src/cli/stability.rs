//! `stability`: techniques along the paths on which some fail.

use super::{named, print, progress, show, try_file};
use crate::chart;
use crate::frame::Renderer;
use crate::gpu::Gpu;
use crate::measure::stability::{self, Point, Stability};
use crate::measure::table::aligned;
use crate::scene::Scene;
use crate::scene::builtin::cases::{self, CASES, Case};
use crate::setup::{self, Setup};
use crate::truth::Samples;
use crate::{capture, techniques};
use anyhow::{Result, bail, ensure};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Which paths, with what, and where the results go.
#[derive(clap::Args)]
pub struct Wanted {
    /// Cases; all of them if none is named. `list cases` says what each provokes.
    cases: Vec<String>,
    /// Techniques, separated by commas, or all.
    #[arg(long, value_delimiter = ',', default_value = "all")]
    techniques: Vec<String>,
    /// A parameter: key=value, or technique.key=value. Can be given many times.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    /// Another light of the scene, for cases whose path does not move the light.
    #[arg(long, allow_hyphen_values = true)]
    light: Option<String>,
    /// Samples a pixel of the truth that flicker is measured against: auto, 1, 4, 16 or 64. By default one for techniques that
    /// say lit or dark, 16 for those that filter.
    #[arg(long, value_name = "N")]
    truth_samples: Option<Samples>,
    /// Frames of each path; by default 32, and 64 where the camera hardly moves.
    #[arg(long, value_parser = clap::value_parser!(u32).range(2..=10_000))]
    frames: Option<u32>,
    /// Width and height in pixels.
    #[arg(long, default_value = "256x256")]
    size: String,
    /// Write all points as JSON (- for standard output).
    #[arg(long, value_name = "FILE", num_args = 0..=1, default_missing_value = "-")]
    json: Option<PathBuf>,
    /// Folder for a chart of each case, a picture of each technique's worst frame, and all points as CSV.
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
}

pub fn run(wanted: Wanted, adapter: Option<&str>) -> Result<()> {
    let cases = wanted.cases()?;
    let techniques = named(&wanted.techniques);
    for id in &techniques {
        techniques::find_or_say(id)?;
    }
    if let Some(path) = &wanted.json {
        ensure!(
            path.to_str().and_then(cases::find).is_none(),
            "--json {}: write --json behind the cases, or a file's name behind it",
            path.display()
        );
        try_file(path)?;
    }
    // What can be refused is, before anything is measured.
    let mut starts = Vec::new();
    for case in &cases {
        let scene = (case.build)();
        starts.push((*case, wanted.start(case, &scene, &techniques)?, scene));
    }
    let mut table = wanted.output.as_deref().map(Table::create).transpose()?;
    let gpu = Arc::new(Gpu::new(adapter)?);
    let bar = progress();
    let mut all = Vec::new();
    for (i, (case, start, scene)) in starts.into_iter().enumerate() {
        let mut renderer = Renderer::new(gpu.clone(), Arc::new(scene))?;
        let frames = wanted.frames.map_or(case.frames, |n| n as usize);
        let found = stability::run(&mut renderer, case, &start, &techniques, frames, &mut |done| {
            show(&bar, (i as f32 + done) / cases.len() as f32, case.id.into());
            true
        })?;
        if let (Some(folder), Some(table)) = (&wanted.output, &mut table) {
            table.table.add(&found)?;
            draw(&mut renderer, case, &start, &found, folder)?;
        }
        if wanted.json.as_deref() != Some(Path::new("-")) {
            bar.suspend(|| print(&text(&found)))?;
        }
        all.push(found);
    }
    bar.finish_and_clear();
    if let Some(table) = table {
        table.save()?;
    }
    match &wanted.json {
        Some(path) if path.as_os_str() == "-" => print(&(serde_json::to_string_pretty(&all)? + "\n")),
        Some(path) => capture::save(path, (serde_json::to_string_pretty(&all)? + "\n").as_bytes()),
        None => Ok(()),
    }
}

impl Wanted {
    fn cases(&self) -> Result<Vec<&'static Case>> {
        if self.cases.is_empty() {
            return Ok(CASES.iter().collect());
        }
        let find = |id: &String| match cases::find(id) {
            Some(case) => Ok(case),
            None => {
                let ids: Vec<&str> = CASES.iter().map(|c| c.id).collect();
                bail!("{id} is no stability case; there are {}", ids.join(", "))
            }
        };
        self.cases.iter().map(find).collect()
    }

    /// The case's set-up with what was asked for on top.
    fn start(&self, case: &Case, scene: &Scene, techniques: &[String]) -> Result<Setup> {
        let mut setup = Setup::new(case.id, scene)?;
        setup.size = capture::parse_size(&self.size)?;
        if let Some(light) = &self.light {
            setup.light = setup::parse_light(scene, light)?;
        }
        setup.truth_samples = self.truth_samples.unwrap_or(setup.truth_samples);
        for assignment in &self.sets {
            setup.set(assignment, techniques)?;
        }
        setup.check()?;
        Ok(setup)
    }
}

/// A figure as per cent.
fn percent(x: Option<f64>) -> String {
    x.map_or("-".into(), |x| format!("{:.3}", x * 100.0))
}

/// What was found on a path, for people.
fn text(found: &Stability) -> String {
    let runs = found.axis.split(',').next().unwrap_or_default();
    let heads =
        ["", "error %: worst", "at t", runs, "mean", "flicker %: mean", "worst", "of labels", "truth's change %"];
    let mut lines = vec![heads.map(String::from).to_vec()];
    for track in &found.tracks {
        if let Some(worst) = track.worst() {
            lines.push(vec![
                track.technique.clone(),
                percent(Some(worst.error_share)),
                format!("{:.3}", worst.t),
                format!("{:.4}", worst.value),
                percent(track.mean(|p| Some(p.error_share))),
                percent(track.mean(Point::flicker)),
                percent(track.max(Point::flicker)),
                percent(track.mean(|p| p.change.map(|c| c.label_flicker))),
                percent(track.mean(|p| p.change.map(|c| c.truth_change))),
            ]);
        }
    }
    let frames = found.tracks.first().map_or(0, |t| t.points.len());
    let mut out = format!("{}: {}", found.case, found.axis);
    if frames > 0 {
        out += &format!("; {frames} frames of {} × {} pixels\n{}", found.width, found.height, aligned(&lines));
    } else {
        out += "\n";
    }
    for (_, reason) in &found.left_out {
        out += &format!("left out: {reason}\n");
    }
    out + "\n"
}

/// `stability.csv`: a row a frame.
struct Table {
    path: PathBuf,
    table: stability::Table,
}

impl Table {
    fn create(folder: &Path) -> Result<Table> {
        let path = folder.join("stability.csv");
        try_file(&path)?;
        Ok(Table { path, table: stability::Table::new()? })
    }

    fn save(self) -> Result<()> {
        capture::save(&self.path, &self.table.finish()?)
    }
}

/// Error over the path as SVG and PNG, and each technique's worst frame with its set-up inside.
fn draw(renderer: &mut Renderer, case: &Case, start: &Setup, found: &Stability, folder: &Path) -> Result<()> {
    if found.tracks.is_empty() {
        return Ok(());
    }
    let svg = chart::lines_svg(&stability::lines(found, false))?;
    let png = chart::png(&svg, 1200)?;
    for (ending, bytes) in [("svg", svg.as_bytes()), ("png", &png)] {
        let path = folder.join(format!("{}.{ending}", case.id));
        capture::save(&path, bytes)?;
    }
    for track in &found.tracks {
        if let Some(worst) = track.worst() {
            let mut setup = Setup { view: "error".into(), ..start.clone() };
            setup.select(&track.technique)?;
            (case.place)(&mut setup, worst.t);
            let path = folder.join(format!("{}-{}.png", case.id, track.technique));
            capture::capture(renderer, &setup, &path)?;
        }
    }
    Ok(())
}
