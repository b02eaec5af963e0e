//! `stability`: techniques along paths on which some fail, or along one's own.

use super::{check_folder, check_target, interrupt, named, print, progress, show};
use crate::chart;
use crate::files;
use crate::frame::Renderer;
use crate::measure::stability::{self, Point, Run, Stability, Track};
use crate::measure::table::aligned;
use crate::measure::{Cost, Figure};
use crate::path::Route;
use crate::scene::Scene;
use crate::scene::builtin::cases::{self, CASES};
use crate::setup::{self, Setup};
use crate::truth::Samples;
use crate::{capture, techniques};
use anyhow::{Context, Result, bail, ensure};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Which paths, with what, and where the results go.
#[derive(clap::Args)]
pub struct Wanted {
    /// Cases, and set-ups (.toml, .png) with a path of their own; all cases if nothing is named. `list cases` says what each
    /// provokes.
    #[arg(value_parser = super::name())]
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
    /// Samples a pixel of the truth that flicker is measured against: auto, 1, 4, 16, 64, 256, 1024 or 4096. By default one for techniques that
    /// say lit or dark, 16 for those that filter.
    #[arg(long, value_name = "N")]
    truth_samples: Option<Samples>,
    /// Frames of each path; by default 32, and more of long ones and where the camera hardly moves.
    #[arg(long, value_parser = clap::value_parser!(u32).range(2..=10_000))]
    frames: Option<u32>,
    /// Also count what each frame costs: passes, layers and triangles drawn, milliseconds. Renders every frame four times
    /// more.
    #[arg(long)]
    cost: bool,
    /// Width and height in pixels; by default 256x256 for cases, and what a set-up says for its own path.
    #[arg(long)]
    size: Option<String>,
    /// Write all points as JSON (- for standard output).
    #[arg(long, value_name = "FILE", num_args = 0..=1, default_missing_value = "-")]
    json: Option<PathBuf>,
    /// Folder for a chart of each case, a picture of each technique's worst frame, and all points as CSV.
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
}

pub fn run(wanted: Wanted, adapter: Option<&str>) -> Result<()> {
    let techniques = named(&wanted.techniques);
    for id in &techniques {
        techniques::find_or_say(id)?;
    }
    if let Some(path) = &wanted.json {
        let text = path.to_str().unwrap_or_default();
        ensure!(
            cases::find(text).is_none() && !is_setup(text),
            "--json {text}: write --json behind the cases, or a file's name behind it"
        );
        check_target(path)?;
    }
    wanted.output.as_deref().map_or(Ok(()), check_folder)?;
    // What can be refused is, before anything is measured.
    let mut starts: Vec<Start> = Vec::new();
    for id in wanted.ids() {
        let start = wanted.start(&id, &techniques)?;
        ensure!(
            starts.iter().all(|s| s.name != start.name),
            "two paths are named {}; give one of the files another name",
            start.name
        );
        starts.push(start);
    }
    let number = starts.len();
    let mut table = wanted.output.as_deref().map(Table::create).transpose()?;
    let gpu = Arc::new(interrupt::device(adapter)?);
    let bar = progress();
    let mut all = Vec::new();
    let mut ended = Ok(());
    for (i, Start { name, route, setup, scene }) in starts.into_iter().enumerate() {
        let mut renderer = Renderer::new(gpu.clone(), Arc::new(scene))?;
        let frames = wanted.frames.map_or(route.frames(), |n| n as usize);
        let run = Run { techniques: techniques.clone(), frames, cost: wanted.cost };
        let found = stability::run(&mut renderer, &route, &setup, &run, &mut |done| {
            show(&bar, (i as f32 + done) / number as f32, name.clone());
            !interrupt::asked()
        });
        let found = interrupt::kept(found, || match i {
            0 => "no path is complete yet, and nothing is written".into(),
            n => format!("{n} of {number} paths are complete, and what is written is theirs"),
        });
        let mut found = match found {
            Err(error) if i > 0 && interrupt::stopped(&error) => {
                ended = Err(error);
                break;
            }
            found => found?,
        };
        found.case = name;
        if let (Some(folder), Some(table)) = (&wanted.output, &mut table) {
            table.table.add(&found)?;
            draw(&mut renderer, &route, &setup, &found, folder)?;
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
        Some(path) if path.as_os_str() == "-" => print(&(serde_json::to_string_pretty(&all)? + "\n"))?,
        Some(path) => files::save(path, (serde_json::to_string_pretty(&all)? + "\n").as_bytes())?,
        None => {}
    }
    ended
}

/// What is followed, and from where.
struct Start {
    /// The case's id, or the file's name without its ending.
    name: String,
    route: Route,
    setup: Setup,
    scene: Scene,
}

/// Whether a name is that of a file that holds a set-up.
fn is_setup(name: &str) -> bool {
    let ending = Path::new(name).extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    ending == "toml" || capture::HOLD.contains(&ending.as_str())
}

impl Wanted {
    /// What is named; all cases if nothing is.
    fn ids(&self) -> Vec<String> {
        if self.cases.is_empty() { CASES.iter().map(|c| c.id.into()).collect() } else { self.cases.clone() }
    }

    /// A case, or a set-up's own path, with what was asked for on top.
    fn start(&self, id: &str, techniques: &[String]) -> Result<Start> {
        let (name, route, mut setup, scene) = match cases::find(id) {
            Some(case) => {
                let scene = (case.build)();
                let setup = Setup { size: stability::SIZE, ..Setup::new(case.id, &scene)? };
                (case.id.to_string(), Route::Case(case), setup, scene)
            }
            None if is_setup(id) => {
                let (setup, scene) = Setup::open(id)?;
                let path = setup.path.clone().with_context(|| {
                    format!("{id} has no path of its own; record one in the window (F3) or write its [[path.keys]]")
                })?;
                ensure!(path.keys.len() > 1, "the path of {id} has one key; it takes two to go anywhere");
                let name = files::path_of(id).file_stem().map_or(id.into(), |n| n.to_string_lossy().into_owned());
                (name, Route::Own(path), setup, scene)
            }
            None => {
                let ids: Vec<&str> = CASES.iter().map(|c| c.id).collect();
                bail!("{id} is no stability case; there are {}; a set-up's file ends in .toml or .png", ids.join(", "))
            }
        };
        if let Some(size) = &self.size {
            setup.size = capture::parse_size(size)?;
        }
        if let Some(light) = &self.light {
            setup.light = setup::parse_light(&scene, light, setup.clock())?;
        }
        setup.truth_samples = self.truth_samples.unwrap_or(setup.truth_samples);
        for assignment in &self.sets {
            setup.set(assignment, techniques)?;
        }
        setup.check()?;
        Ok(Start { name, route, setup, scene })
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
        out += &costs(found);
    } else {
        out += "\n";
    }
    for (_, reason) in &found.left_out {
        out += &format!("left out: {reason}\n");
    }
    out + "\n"
}

/// What frames cost along a path, for people; empty where that was not asked for.
fn costs(found: &Stability) -> String {
    if !found.has(Figure::Time) {
        return String::new();
    }
    let heads =
        ["", "passes: mean", "layers drawn: fewest", "mean", "most", "triangles: mean", "most", "ms: mean", "most"];
    let mut lines = vec![heads.map(String::from).to_vec()];
    for track in &found.tracks {
        let all = |figure: Figure| -> Vec<f64> { track.points.iter().filter_map(|p| figure.of(p)).collect() };
        let told = |values: &[f64], digits: usize, of: fn(&[f64]) -> f64| match values {
            [] => "-".into(),
            values => format!("{:.digits$}", of(values)),
        };
        let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
        let least = |v: &[f64]| v.iter().copied().fold(f64::INFINITY, f64::min);
        let most = |v: &[f64]| v.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let (layers, triangles, ms) = (all(Figure::Layers), all(Figure::Triangles), all(Figure::Time));
        lines.push(vec![
            track.technique.clone(),
            told(&all(Figure::Passes), 1, mean),
            told(&layers, 0, least),
            told(&layers, 2, mean),
            layers_of(track, &told(&layers, 0, most)),
            told(&triangles, 0, mean),
            told(&triangles, 0, most),
            told(&ms, 3, mean),
            told(&ms, 3, most),
        ]);
    }
    let software = if found.software { " (software)" } else { "" };
    let mut out = format!("cost on {}{software}\n{}", found.adapter, aligned(&lines));
    if found.software {
        out += "This adapter is software: compare its times as ratios only; they say nothing of a GPU.\n";
    }
    out
}

/// The most layers drawn, and how many there are.
fn layers_of(track: &Track, most: &str) -> String {
    let layers = |c: Cost| c.layers.map(|l| l.layers);
    let all = track.points.iter().filter_map(|p| p.cost.and_then(layers)).max();
    all.map_or(most.into(), |all| format!("{most} of {all}"))
}

/// `stability.csv`: a row a frame.
struct Table {
    path: PathBuf,
    table: stability::Table,
}

impl Table {
    fn create(folder: &Path) -> Result<Table> {
        let path = folder.join("stability.csv");
        Ok(Table { path, table: stability::Table::new()? })
    }

    fn save(self) -> Result<()> {
        files::save(&self.path, &self.table.finish()?)
    }
}

/// Each figure over the path as SVG and PNG, the error under the path's plain name, and each technique's worst frame with
/// its set-up inside.
fn draw(renderer: &mut Renderer, route: &Route, start: &Setup, found: &Stability, folder: &Path) -> Result<()> {
    if found.tracks.is_empty() {
        return Ok(());
    }
    for figure in Figure::ALL.into_iter().filter(|f| found.has(*f)) {
        let svg = chart::lines_svg(&stability::lines(found, figure))?;
        let png = chart::png(&svg, 1200)?;
        let of = if figure == Figure::Error { String::new() } else { format!("-{}", figure.name()) };
        for (ending, bytes) in [("svg", svg.as_bytes()), ("png", &png)] {
            files::save(&folder.join(format!("{}{of}.{ending}", found.case)), bytes)?;
        }
    }
    for track in &found.tracks {
        if let Some(worst) = track.worst() {
            let mut setup = Setup { view: "error".into(), ..start.clone() };
            setup.select(&track.technique)?;
            route.place(&mut setup, worst.t);
            let path = folder.join(format!("{}-{}.png", found.case, track.technique));
            capture::capture(renderer, &setup, &path)?;
        }
    }
    Ok(())
}
