//! The command line.

use crate::frame::Renderer;
use crate::gpu::{self, Gpu};
use crate::scene::{Scene, builtin};
use crate::setup::{self, Setup};
use crate::{capture, measure, techniques, tour, ui, view};
use anyhow::{Context, Result, bail};
use clap::{Args, Parser, Subcommand};
use indicatif::{ProgressBar, ProgressStyle};
use std::fs::File;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Explore shadow techniques beside the exact shadow. Without a command the window opens.
#[derive(Parser)]
#[command(name = "shadowscope", version)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    /// What to open: a built-in scene, a glTF file, a set-up (.toml) or a captured picture (.png).
    setup: Option<String>,
    /// Use the first graphics adapter whose name contains this.
    #[arg(long, global = true)]
    adapter: Option<String>,
}

#[derive(Subcommand)]
enum Command {
    /// Render one picture: .png with the set-up inside, or .exr with the view's raw floats.
    Capture {
        #[command(flatten)]
        wanted: Wanted,
        /// File to write.
        #[arg(short, long)]
        output: PathBuf,
        /// What to draw; `list views` names them.
        #[arg(long)]
        view: Option<String>,
        /// The technique; `list techniques` names them.
        #[arg(long)]
        technique: Option<String>,
    },
    /// Measure errors, times and memory of techniques.
    Measure {
        #[command(flatten)]
        wanted: Wanted,
        /// Techniques, separated by commas, or all.
        #[arg(long, value_delimiter = ',', default_value = "all")]
        techniques: Vec<String>,
        /// Write the rows as JSON (- for standard output).
        #[arg(long, value_name = "FILE", num_args = 0..=1, default_missing_value = "-")]
        json: Option<PathBuf>,
        /// Write the rows as CSV (- for standard output).
        #[arg(long, value_name = "FILE", num_args = 0..=1, default_missing_value = "-")]
        csv: Option<PathBuf>,
    },
    /// Name what there is.
    List {
        what: Listed,
        /// As JSON.
        #[arg(long)]
        json: bool,
    },
    /// Write the tour: every built-in scene with every technique, and a contact sheet.
    Tour {
        /// Folder to write into.
        #[arg(short, long, default_value = "out")]
        output: PathBuf,
    },
}

/// What is drawn, and what differs from the set-up.
#[derive(Args)]
struct Wanted {
    /// A built-in scene, a glTF file, a set-up (.toml) or a captured picture (.png).
    setup: String,
    /// Width and height in pixels, such as 1920x1080.
    #[arg(long)]
    size: Option<String>,
    /// A camera of the scene, or px,py,pz:tx,ty,tz:fov.
    #[arg(long, allow_hyphen_values = true)]
    camera: Option<String>,
    /// A light of the scene, or KIND:key=value;… with the keys of a set-up's [light] table.
    #[arg(long, allow_hyphen_values = true)]
    light: Option<String>,
    /// Seconds on the scene's clock.
    #[arg(long)]
    time: Option<f32>,
    /// A parameter: key=value, or technique.key=value. Can be given many times.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum Listed {
    Scenes,
    Techniques,
    Views,
    Adapters,
}

/// Does what the command line says.
///
/// # Errors
/// One sentence for the user.
pub fn run() -> Result<()> {
    let cli = Cli::parse();
    let adapter = cli.adapter.as_deref();
    if let (Some(setup), Some(_)) = (&cli.setup, &cli.command) {
        bail!("{setup} stands before the command; write it after");
    }
    match cli.command {
        None => open(cli.setup.as_deref(), adapter),
        Some(Command::Capture { wanted, output, view, technique }) => {
            // What can be refused early is, before a scene is loaded and drawn.
            capture::check(view.as_deref().unwrap_or("truth"), &output)?;
            let (mut setup, scene) = wanted.open()?;
            if let Some(technique) = &technique {
                setup.select(technique)?;
            }
            if let Some(view) = view {
                setup.view = view;
            }
            let selected = [setup.technique.clone()];
            wanted.apply(&mut setup, &scene, &selected)?;
            let mut renderer = Renderer::new(Arc::new(Gpu::new(adapter)?), Arc::new(scene))?;
            capture::capture(&mut renderer, &setup, &output)?;
            eprintln!("wrote {}", output.display());
            Ok(())
        }
        Some(Command::Measure { wanted, techniques, json, csv }) => run_measure(wanted, techniques, json, csv, adapter),
        Some(Command::List { what, json }) => list(what, json),
        Some(Command::Tour { output }) => tour::write(&output, adapter),
    }
}

impl Wanted {
    /// Opens the set-up and prints the scene's load report to standard error.
    fn open(&self) -> Result<(Setup, Scene)> {
        let (setup, scene) = Setup::open(&self.setup)?;
        eprint!("{}", scene.report());
        Ok((setup, scene))
    }

    /// Applies what was asked for on top of the set-up, and checks the result.
    fn apply(&self, setup: &mut Setup, scene: &Scene, selected: &[String]) -> Result<()> {
        if let Some(size) = &self.size {
            setup.size = capture::parse_size(size)?;
        }
        if let Some(camera) = &self.camera {
            setup.camera = setup::parse_camera(scene, camera)?;
        }
        if let Some(light) = &self.light {
            setup.light = setup::parse_light(scene, light)?;
        }
        if let Some(time) = self.time {
            setup.time = time;
        }
        for assignment in &self.sets {
            setup.set(assignment, selected)?;
        }
        setup.check()
    }
}

/// Opens the window, or where there is no display writes the tour.
fn open(what: Option<&str>, adapter: Option<&str>) -> Result<()> {
    match ui::run(what, adapter)? {
        ui::Ended::Closed => Ok(()),
        ui::Ended::NoDisplay(reason) => match what {
            Some(what) => {
                bail!("there is no display to open {what} on ({reason}); use `shadowscope capture {what} -o FILE.png`")
            }
            None => {
                eprintln!("There is no display ({reason}), so the tour is written into out/ instead.");
                tour::write(&PathBuf::from("out"), adapter)
            }
        },
    }
}

fn run_measure(
    wanted: Wanted,
    ids: Vec<String>,
    json: Option<PathBuf>,
    csv: Option<PathBuf>,
    adapter: Option<&str>,
) -> Result<()> {
    let (mut setup, scene) = wanted.open()?;
    let all = ids == ["all"];
    let ids: Vec<String> = if all { techniques::ALL.iter().map(|i| i.id.into()).collect() } else { ids };
    // A capture may show a map that only its own technique has.
    setup.view = "shaded".into();
    for id in &ids {
        setup.select(id)?;
    }
    wanted.apply(&mut setup, &scene, &ids)?;
    for path in [&json, &csv].into_iter().flatten() {
        try_file(path)?;
    }
    let mut renderer = Renderer::new(Arc::new(Gpu::new(adapter)?), Arc::new(scene))?;
    let bar = progress_bar(ids.len() as u64 * 100);
    let mut rows = Vec::new();
    for (i, id) in ids.iter().enumerate() {
        setup.select(id)?;
        if let Some(reason) = techniques::find_or_say(id)?.refuses(&setup.light) {
            if !all {
                bail!(reason);
            }
            bar.suspend(|| eprintln!("left out: {reason}"));
            continue;
        }
        bar.set_message(id.clone());
        let tick = |done: f32| {
            bar.set_position(((i as f32 + done) * 100.0) as u64);
            true
        };
        rows.push(measure::measure(&mut renderer, &setup, tick)?);
    }
    bar.finish_and_clear();
    let gpu = &renderer.gpu;
    let mut table = true;
    for (path, text) in
        [(json, serde_json::to_string_pretty(&measure::json(gpu, &rows))? + "\n"), (csv, measure::csv(gpu, &rows))]
    {
        match path {
            Some(path) if path.as_os_str() == "-" => {
                table = false;
                print(&text)?;
            }
            Some(path) => std::fs::write(&path, text).with_context(|| cannot_write(&path))?,
            None => {}
        }
    }
    if table { print(&measure::text(gpu, &rows)) } else { Ok(()) }
}

fn cannot_write(path: &Path) -> String {
    format!("{} cannot be written", path.display())
}

/// Makes sure that results can be written to a file later, so that no measurement is lost to a wrong path. What the
/// file holds stays until then.
fn try_file(path: &Path) -> Result<()> {
    if path.as_os_str() != "-" {
        capture::create_folder(path)?;
        File::options().append(true).create(true).open(path).with_context(|| cannot_write(path))?;
    }
    Ok(())
}

/// Writes to standard output; a reader that has gone away is no error.
fn print(text: &str) -> Result<()> {
    match std::io::stdout().lock().write_all(text.as_bytes()) {
        Err(e) if e.kind() != ErrorKind::BrokenPipe => Err(e).context("standard output cannot be written"),
        _ => Ok(()),
    }
}

/// A progress bar on standard error; nothing where that is not a terminal.
pub fn progress_bar(steps: u64) -> ProgressBar {
    let style = ProgressStyle::with_template("{bar:32} {percent:>3} %  {msg}  {eta} left");
    ProgressBar::new(steps).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
}

fn list(what: Listed, json: bool) -> Result<()> {
    let pairs = |rows: Vec<(String, String)>| {
        let width = rows.iter().map(|r| r.0.len()).max().unwrap_or(0);
        rows.iter().map(|(a, b)| format!("{a:<width$}  {b}\n")).collect::<String>()
    };
    let (value, text) = match what {
        Listed::Scenes => {
            let rows: Vec<_> = builtin::SCENES.iter().filter_map(|b| Some((b, builtin::build(b.name)?))).collect();
            let value = rows.iter().map(|(b, s)| {
                serde_json::json!({
                    "name": b.name, "description": b.description, "triangles": s.triangles(),
                    "cameras": s.cameras.iter().map(|c| &c.name).collect::<Vec<_>>(),
                    "lights": s.lights.iter().map(|l| &l.name).collect::<Vec<_>>(),
                })
            });
            let text = rows.iter().map(|(b, s)| {
                let cameras: Vec<_> = s.cameras.iter().map(|c| c.name.as_str()).collect();
                let lights: Vec<_> = s.lights.iter().map(|l| l.name.as_str()).collect();
                format!(
                    "{:<12} {} triangles. {}\n{:12} cameras: {}\n{:12} lights: {}\n",
                    b.name,
                    s.triangles(),
                    b.description,
                    "",
                    cameras.join(", "),
                    "",
                    lights.join(", ")
                )
            });
            (value.collect(), text.collect())
        }
        Listed::Techniques => {
            let value = techniques::ALL.iter().map(|i| {
                let params = i.specs().map(|s| {
                    serde_json::json!({"name": s.name, "default": s.default(), "range": s.range(), "unit": s.unit, "doc": s.doc.trim()})
                });
                serde_json::json!({
                    "id": i.id, "title": i.title, "paper": i.paper, "doc": i.doc, "lights": i.lights,
                    "maps": i.maps.iter().map(|m| m.id).collect::<Vec<_>>(), "params": params.collect::<Vec<_>>(),
                })
            });
            let text = techniques::ALL.iter().map(|i| {
                let params =
                    i.specs().map(|s| format!("    {} = {}: {}. {}\n", s.name, s.default(), s.range(), s.doc.trim()));
                format!(
                    "{}: {} ({}); {} light\n{}",
                    i.id,
                    i.title,
                    i.paper,
                    i.lights.join(", "),
                    params.collect::<String>()
                )
            });
            (value.collect(), text.collect())
        }
        Listed::Views => {
            let own = techniques::ALL.iter().flat_map(|i| i.maps.iter().map(move |m| (m, Some(i.id))));
            let rows: Vec<_> = view::VIEWS.iter().map(|v| (v, None)).chain(own).collect();
            let value = rows.iter().map(|(v, of)| serde_json::json!({"id": v.id, "doc": v.doc, "technique": of}));
            let text = rows.iter().map(|(v, of)| match of {
                Some(id) => (v.id.to_string(), format!("{} ({id})", v.doc)),
                None => (v.id.to_string(), v.doc.to_string()),
            });
            (value.collect(), pairs(text.collect()))
        }
        Listed::Adapters => {
            let all: Vec<_> = gpu::adapters(&gpu::instance()).iter().map(|a| a.get_info()).collect();
            let value = all.iter().map(|i| {
                serde_json::json!({"name": i.name, "backend": i.backend.to_str(), "driver": i.driver_info,
                    "software": i.device_type == wgpu::DeviceType::Cpu})
            });
            let text =
                all.iter().map(|i| (i.name.clone(), format!("{} {:?} {}", i.backend, i.device_type, i.driver_info)));
            (value.collect(), pairs(text.collect()))
        }
    };
    let value: serde_json::Value = value;
    print(&if json { serde_json::to_string_pretty(&value)? + "\n" } else { text })
}
