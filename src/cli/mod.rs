//! The command line.

mod advise;
mod animate;
mod chart;
mod figure;
mod flatland;
mod inspect;
mod interrupt;
mod lamps;
mod lessons;
mod list;
mod measure;
mod parameters;
mod profile;
mod stability;
mod sweep;
mod tables;

use crate::frame::Renderer;
use crate::gpu::{self, Gpu};
use crate::measure::{Axis, STOPPED, reproduce};
use crate::message::tell;
use crate::scene::{Clock, Scene, builtin};
use crate::setup::{self, Arrange, Overlay, Setup, Side};
use crate::truth::Samples;
use crate::{capture, files, message, techniques, ui};
use anyhow::{Context, Result, anyhow, bail, ensure};
use clap::builder::{OsStringValueParser, TypedValueParser};
use clap::{Args, Parser, Subcommand};
use indicatif::{ProgressBar, ProgressStyle};
use std::cell::Cell;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;

/// Explore shadow techniques beside ray-traced truth. Without a command the window opens.
#[derive(Parser)]
#[command(name = "shadowscope", version)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    /// What to open: a built-in scene, a scene's file, a set-up (.toml), a captured picture (.png) or a world of flatland (.toml).
    #[arg(value_parser = name())]
    setup: Option<String>,
    /// Take the lessons of this folder instead of those that come with the program; also SHADOWSCOPE_LESSONS.
    #[arg(long, global = true, value_name = "DIR")]
    lessons: Option<PathBuf>,
    /// Use the first graphics adapter whose name contains this.
    #[arg(long, global = true)]
    adapter: Option<String>,
    /// Take shaders from this folder where it has one of the same name; the window reloads them when they change.
    #[arg(long, global = true, value_name = "DIR")]
    shaders: Option<PathBuf>,
}

#[derive(Subcommand)]
enum Command {
    /// Render one picture: .png with the set-up inside, or .exr with the view's raw floats.
    Capture {
        #[command(flatten)]
        picture: Picture,
        /// File to write.
        #[arg(short, long)]
        output: PathBuf,
    },
    /// Render frames along a way, as an animation (.png, .apng, .webp) or as numbered pictures (frame-.png).
    Animate(animate::Wanted),
    /// Tell a pixel's story: what the technique did there, what rays say, why it is wrong and what would help.
    Inspect {
        #[command(flatten)]
        wanted: Wanted,
        #[command(flatten)]
        pixel: inspect::Pixel,
    },
    /// Measure errors, times and memory of techniques.
    Measure {
        #[command(flatten)]
        wanted: Wanted,
        /// Techniques, separated by commas, or all.
        #[arg(long, value_delimiter = ',', default_value = "all")]
        techniques: Vec<String>,
        #[command(flatten)]
        output: measure::Output,
    },
    /// Time every pass beside the bytes that it moves at least, and what a memory of known bandwidth needs for these.
    Profile {
        #[command(flatten)]
        wanted: Wanted,
        /// Techniques, separated by commas, or all.
        #[arg(long, value_delimiter = ',', default_value = "all")]
        techniques: Vec<String>,
        #[command(flatten)]
        output: profile::Output,
    },
    /// Measure many configurations into one file. --set takes lists and ranges: kernel=3,5,7, resolution=256..4096*2
    /// (each twice the last), slope_bias=0..2+0.5 (each 0.5 more).
    Sweep {
        #[command(flatten)]
        wanted: Wanted,
        /// Techniques, separated by commas, or all.
        #[arg(long, value_delimiter = ',', default_value = "all")]
        techniques: Vec<String>,
        #[command(flatten)]
        output: sweep::Output,
    },
    /// Join the parts of a sweep.
    Merge {
        /// The files of the parts.
        #[arg(required = true)]
        parts: Vec<PathBuf>,
        /// File to write: .csv or .json.
        #[arg(short, long)]
        output: PathBuf,
    },
    /// Find the cheapest technique and parameters within an error budget. Exit code 3: nothing meets it.
    Advise {
        #[command(flatten)]
        wanted: Wanted,
        /// Techniques, separated by commas, or all.
        #[arg(long, value_delimiter = ',', default_value = "all")]
        techniques: Vec<String>,
        #[command(flatten)]
        limits: advise::Limits,
    },
    /// Measure rows and columns of your choice and print them as a Markdown table.
    Table(tables::Wanted),
    /// Measure the tables of Markdown pages again, in place: each below a comment <!-- shadowscope table … --> that
    /// says how.
    Tables {
        /// The pages.
        #[arg(required = true)]
        pages: Vec<PathBuf>,
    },
    /// Measure published tables and figures again and print ours beside theirs, as Markdown.
    Reproduce {
        /// Which; all if none is named.
        ids: Vec<String>,
        /// Folder for their charts and pictures, which the Markdown then shows.
        #[arg(short, long, value_name = "DIR")]
        output: Option<PathBuf>,
    },
    /// Run techniques along paths on which some fail: error and flicker of each.
    Stability {
        #[command(flatten)]
        wanted: stability::Wanted,
    },
    /// Draw error against cost from measured rows.
    Chart(chart::Wanted),
    /// Compare the light's film lines in a world of two dimensions: pixels a texel, as in Chong 2003.
    Flatland {
        /// One of his four scenes, random-1 and so on, or a world from the lab (.toml); all four of his if none is named.
        #[arg(value_parser = name())]
        scene: Option<String>,
        /// As JSON.
        #[arg(long)]
        json: bool,
    },
    /// Write all shaders into a folder, to be changed there: the window then takes them with --shaders.
    Shaders {
        /// The folder.
        #[arg(short, long, value_name = "DIR")]
        output: PathBuf,
    },
    /// Print a lesson as Markdown, its answers measured now.
    Lesson {
        /// Which; `list lessons` names them.
        id: String,
        /// Print the set-up of this step instead, from 1.
        #[arg(long, value_name = "STEP")]
        setup: Option<usize>,
    },
    /// Print the glossary as Markdown.
    Glossary,
    /// Name what there is.
    List {
        what: Listed,
        /// As JSON.
        #[arg(long)]
        json: bool,
    },
    /// Draw a sheet of rows and columns of pictures for a paper: PNG, SVG, PDF and LaTeX.
    Figure(figure::Wanted),
    /// Draw the tour: every built-in scene with every technique as a contact sheet, and each as a capture.
    Tour(figure::Tour),
}

/// A picture of a set-up.
#[derive(Args)]
struct Picture {
    #[command(flatten)]
    wanted: Wanted,
    /// What to draw; `list views` names them.
    #[arg(long)]
    view: Option<String>,
    /// The technique; `list techniques` names them.
    #[arg(long)]
    technique: Option<String>,
    #[command(flatten)]
    figure: Figure,
}

impl Picture {
    /// Opens the set-up with all that was asked for on top.
    fn open(self) -> Result<(Setup, Scene)> {
        let Picture { wanted, view, technique, figure } = self;
        let own = technique.clone().unwrap_or(setup::DEFAULT_TECHNIQUE.into());
        let (mut setup, scene) = wanted.open(&[own])?;
        if let Some(technique) = &technique {
            setup.select(technique)?;
        }
        if let Some(view) = view {
            setup.view = view;
            setup.overlay = None;
        }
        let (crop, path) = (figure.crop.clone(), figure.own_path.clone());
        figure.apply(&mut setup, &scene)?;
        let selected = [setup.technique.clone()];
        wanted.apply(&mut setup, &scene, &selected)?;
        if let Some(path) = path {
            setup.path = Some(setup::parse_path(&scene, &path)?);
        }
        if let Some(crop) = crop {
            // Pixels are those of the size that it ends with.
            setup.crop = setup::parse_crop(&crop, setup.size)?;
        }
        setup.check()?;
        Ok((setup, scene))
    }
}

/// What a picture is composed of.
#[derive(Args)]
struct Figure {
    /// Compare with TECHNIQUE, TECHNIQUE:key=value;… or truth. Can be given up to three times; none: with nothing.
    #[arg(long, value_name = "TECHNIQUE[:K=V;…]")]
    against: Vec<String>,
    /// How the sides of a comparison share the picture: swipe, side-by-side or flicker.
    #[arg(long, value_name = "HOW")]
    arrange: Option<String>,
    /// Where swipe changes sides, as a share of the width.
    #[arg(long, value_name = "SHARE")]
    split: Option<f32>,
    /// The side that flicker shows, from 0.
    #[arg(long, value_name = "SIDE")]
    front: Option<u32>,
    /// Blend this view over the shaded picture: VIEW or VIEW:opacity.
    #[arg(long, value_name = "VIEW[:OPACITY]")]
    overlay: Option<String>,
    /// Show this view small in a corner of the shaded picture; its opacity counts once it is laid over all of it.
    #[arg(long, value_name = "VIEW[:OPACITY]", conflicts_with = "overlay")]
    inset: Option<String>,
    /// Pixels by which wrong ones grow in views of errors: 0, 1 or 2.
    #[arg(long, value_name = "PIXELS")]
    error_dilation: Option<u32>,
    /// What lies under marked errors.
    #[arg(long, value_name = "BASE")]
    error_base: Option<setup::Base>,
    /// Width of the window of the view error-density: an odd number of pixels.
    #[arg(long, value_name = "PIXELS")]
    error_window: Option<u32>,
    /// Place in the picture that charts of a single pixel are of: X,Y, from 0 to 1 from its upper left corner.
    #[arg(long, value_parser = parse_place, value_name = "X,Y")]
    probe: Option<[f32; 2]>,
    /// Put the view's legend below the picture.
    #[arg(long)]
    legend: bool,
    /// The camera that maps are fitted to while the other looks at them, written as that one is.
    #[arg(long, allow_hyphen_values = true, value_name = "CAMERA")]
    shadow_camera: Option<String>,
    /// Draw what maps cover as lines into the scene; with a shadow camera they are drawn anyway.
    #[arg(long)]
    outlines: bool,
    /// Draw N × N pixels for each of the file and average them, 1 to 4. Values, classes and charts stay as they are.
    #[arg(long, value_name = "N")]
    supersample: Option<u32>,
    /// Leave what no surface covers transparent.
    #[arg(long, num_args = 0..=1, require_equals = true, default_missing_value = "true", value_name = "BOOL")]
    transparent: Option<bool>,
    /// Show only this part of the picture: X,Y,WIDTH,HEIGHT, each as a share of the side or as pixels (320px); none: all of it.
    #[arg(long, value_name = "X,Y,W,H")]
    crop: Option<String>,
    /// Start of every random pattern.
    #[arg(long, value_name = "N")]
    seed: Option<u32>,
    /// A path of its own: the table [path] of a set-up's file in one line, { keys = [{ time = 0, camera = { … } }, …] }.
    #[arg(long, value_name = "TABLE")]
    own_path: Option<String>,
}

fn parse_place(text: &str) -> Result<[f32; 2]> {
    match text.split_once(',').map(|(x, y)| [x.trim().parse(), y.trim().parse()]) {
        Some([Ok(x), Ok(y)]) => Ok([x, y]),
        _ => bail!("{text} is no place; write two numbers from 0 to 1, such as 0.5,0.25"),
    }
}

impl Figure {
    fn apply(self, setup: &mut Setup, scene: &Scene) -> Result<()> {
        if let Some(camera) = &self.shadow_camera {
            setup.shadow_camera = Some(setup::parse_camera(scene, camera, setup.clock())?);
        }
        setup.outlines |= self.outlines;
        if self.against == ["none"] {
            (setup.against, setup.front) = (Vec::new(), 0);
        } else if !self.against.is_empty() {
            setup.against = self.against.iter().map(|a| Side::parse(a)).collect::<Result<_>>()?;
            setup.complete();
            setup.front = setup.front.min(setup.against.len() as u32);
        }
        if let Some(how) = &self.arrange {
            let found = Arrange::ALL.into_iter().find(|a| a.id() == how);
            setup.arrange = found
                .with_context(|| format!("--arrange {how}: there are {}", Arrange::ALL.map(Arrange::id).join(", ")))?;
        }
        setup.split = self.split.unwrap_or(setup.split);
        setup.front = self.front.unwrap_or(setup.front);
        setup.seed = self.seed.unwrap_or(setup.seed);
        setup.legend |= self.legend;
        setup.error_dilation = self.error_dilation.unwrap_or(setup.error_dilation);
        setup.error_base = self.error_base.unwrap_or(setup.error_base);
        setup.error_window = self.error_window.unwrap_or(setup.error_window);
        setup.probe = self.probe.unwrap_or(setup.probe);
        setup.supersample = self.supersample.unwrap_or(setup.supersample);
        setup.transparent = self.transparent.unwrap_or(setup.transparent);
        let over = |option: &str, text: &str, usual: f32| match text.split_once(':') {
            Some((view, opacity)) => {
                let opacity = opacity.parse().with_context(|| format!("--{option} {text}: write it as VIEW:0.5"))?;
                anyhow::Ok((view.to_string(), opacity))
            }
            None => Ok((text.to_string(), usual)),
        };
        if let Some(overlay) = &self.overlay {
            let (view, opacity) = over("overlay", overlay, 0.5)?;
            setup.overlay = Some(Overlay { view, opacity, inset: false });
        }
        if let Some(inset) = &self.inset {
            let (view, opacity) = over("inset", inset, 1.0)?;
            setup.overlay = Some(Overlay { view, opacity, inset: true });
        }
        Ok(())
    }
}

/// What is measured beside errors and times.
#[derive(Args, Clone, Copy)]
struct More {
    /// Also move the camera in small steps and measure what flickers.
    #[arg(long)]
    flicker: bool,
    /// Also draw with so many seeds, and tell apart what changes with them (noise) and what stays wrong (bias).
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u32).range(..=1024))]
    seeds: u32,
    /// Also draw frames after a leap of the light and while it turns: how long the picture takes to settle, and how far it lags behind.
    #[arg(long)]
    temporal: bool,
}

impl More {
    fn wanted(self) -> crate::measure::More {
        crate::measure::More { flicker: self.flicker, seeds: self.seeds, temporal: self.temporal }
    }
}

/// What is drawn, and what differs from the set-up.
#[derive(Args)]
struct Wanted {
    /// A built-in scene, a scene's file, a set-up (.toml) or a captured picture (.png).
    #[arg(value_parser = name())]
    setup: String,
    /// Width and height in pixels, such as 1920x1080.
    #[arg(long)]
    size: Option<String>,
    /// A camera of the scene, px,py,pz:tx,ty,tz:fov, or orthographic px,py,pz:tx,ty,tz:height=METRES; behind either :ux,uy,uz for what is up, :near=METRES, :far=METRES.
    #[arg(long, allow_hyphen_values = true)]
    camera: Option<String>,
    /// A light of the scene, NAME:key=value;… for one changed, or KIND:key=value;… with the keys of a set-up's [light] table. Of several it changes the one at
    /// work.
    #[arg(long, allow_hyphen_values = true)]
    light: Option<String>,
    #[command(flatten)]
    lamps: lamps::Lamps,
    /// Seconds on the scene's clock. A camera or light of the scene that its animation moves goes along.
    #[arg(long)]
    time: Option<f32>,
    /// Which of the file's animations plays: its name, or its number from 0.
    #[arg(long, value_name = "NAME")]
    animation: Option<String>,
    /// Samples a pixel of the truth: auto, 1, 4, 16, 64, 256, 1024 or 4096.
    #[arg(long, value_name = "N")]
    truth_samples: Option<Samples>,
    /// A parameter: key=value, or technique.key=value. Can be given many times.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
}

/// The set-up that a `capture` command draws ([`Setup::command`]), and its scene.
///
/// # Errors
/// What the command would say.
pub fn captured(command: &str) -> Result<(Setup, Scene)> {
    let words = shlex::split(command).context("a quotation mark in the command has no partner")?;
    match Cli::try_parse_from(words)?.command {
        Some(Command::Capture { picture, .. }) => picture.open(),
        _ => bail!("{command} captures nothing"),
    }
}

/// Takes what may be a path, whatever its bytes ([`files::name_of`]).
fn name() -> impl TypedValueParser<Value = String> {
    OsStringValueParser::new().map(|path| files::name_of(&path))
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum Listed {
    Scenes,
    Cases,
    Techniques,
    Views,
    /// Of every technique, as Markdown.
    Parameters,
    Lessons,
    Adapters,
}

/// The whole program, with techniques of one's own on top of ours.
pub fn main(own: &'static [techniques::Own]) -> ExitCode {
    #[cfg(target_os = "linux")]
    give_runtime_folder();
    techniques::add(own).and_then(|()| run()).unwrap_or_else(|error| {
        interrupt::told(&error).unwrap_or_else(|| {
            tell!("shadowscope: {}", message::sentence(&error));
            ExitCode::FAILURE
        })
    })
}

/// Graphics drivers complain where a session has no folder for its sockets, as on machines without a display: makes one that
/// is the user's alone. Where that fails they may complain.
#[cfg(target_os = "linux")]
fn give_runtime_folder() {
    use std::os::unix::fs::{DirBuilderExt, MetadataExt};
    const NAME: &str = "XDG_RUNTIME_DIR";
    if std::env::var_os(NAME).is_some_and(|folder| Path::new(&folder).is_dir()) {
        return;
    }
    let user = rustix::process::getuid().as_raw();
    let folder = std::env::temp_dir().join(format!("shadowscope-{user}"));
    // One that is there may be anybody's.
    let _ = std::fs::DirBuilder::new().mode(0o700).create(&folder);
    let private = |about: std::fs::Metadata| about.is_dir() && about.uid() == user && about.mode() & 0o077 == 0;
    if std::fs::symlink_metadata(&folder).is_ok_and(private) {
        // SAFETY: no other thread runs yet that could read the environment meanwhile.
        unsafe { std::env::set_var(NAME, folder) };
    }
}

/// Does what the command line says.
fn run() -> Result<ExitCode> {
    let cli = Cli::parse();
    cli.shaders.as_deref().map_or(Ok(()), gpu::read_from)?;
    let adapter = cli.adapter.as_deref();
    if let (Some(setup), Some(_)) = (&cli.setup, &cli.command) {
        bail!("{setup} stands before the command; write it after");
    }
    let folder = std::env::var_os("SHADOWSCOPE_LESSONS").filter(|f| !f.is_empty()).map(PathBuf::from);
    if let Some(folder) = cli.lessons.or(folder) {
        crate::lessons::take_folder(&folder)?;
    }
    let done = match cli.command {
        None => open(cli.setup.as_deref(), adapter),
        Some(Command::Capture { picture, output }) => {
            // What can be refused early is, before a scene is loaded and drawn.
            capture::check(picture.view.as_deref().unwrap_or("truth"), &output)?;
            check_target(&output)?;
            let (setup, scene) = picture.open()?;
            let mut renderer = renderer(Gpu::new(adapter)?, scene)?;
            for note in capture::capture(&mut renderer, &setup, &output)? {
                tell!("{note}");
            }
            tell!("wrote {}", output.display());
            Ok(())
        }
        Some(Command::Animate(wanted)) => animate::run(wanted, adapter),
        Some(Command::Inspect { wanted, pixel }) => inspect::run(&wanted, pixel, adapter),
        Some(Command::Measure { wanted, techniques, output }) => measure::run(wanted, techniques, output, adapter),
        Some(Command::Profile { wanted, techniques, output }) => profile::run(wanted, &techniques, &output, adapter),
        Some(Command::Sweep { wanted, techniques, output }) => sweep::run(wanted, techniques, output, adapter),
        Some(Command::Chart(wanted)) => chart::run(&wanted),
        Some(Command::Table(wanted)) => tables::table(&wanted, adapter),
        Some(Command::Tables { pages }) => tables::refresh(&pages, adapter),
        Some(Command::Merge { parts, output }) => sweep::merge(&parts, &output),
        Some(Command::Advise { wanted, techniques, limits }) => {
            return advise::run(wanted, techniques, limits, adapter);
        }
        Some(Command::Stability { wanted }) => stability::run(wanted, adapter),
        Some(Command::Reproduce { ids, output }) => reproduce(&ids, output.as_deref(), adapter),
        Some(Command::Flatland { scene, json }) => flatland::run(scene.as_deref(), json),
        Some(Command::Shaders { output }) => {
            check_folder(&output)?;
            for name in gpu::write_files(&output)? {
                tell!("{} stays as it is: it differs from ours.", output.join(name).display());
            }
            tell!("wrote the shaders; try them with `shadowscope --shaders {}`", output.display());
            Ok(())
        }
        Some(Command::Lesson { id, setup }) => lessons::lesson(&id, setup, adapter),
        Some(Command::Glossary) => print(&crate::glossary::page()),
        Some(Command::List { what, json }) => list::list(what, json),
        Some(Command::Figure(wanted)) => figure::run(&wanted, adapter),
        Some(Command::Tour(wanted)) => figure::tour(&wanted, adapter),
    };
    done.map(|()| ExitCode::SUCCESS)
}

impl Wanted {
    /// What `--set` asks to vary. What fixes a single value stays to be applied to the set-up too.
    fn axes(&mut self) -> Result<Vec<Axis>> {
        let axes = self.sets.iter().map(|s| Axis::parse(s)).collect::<Result<Vec<_>>>()?;
        let mut fixed = axes.iter().map(Axis::is_fixed);
        self.sets.retain(|_| fixed.next().unwrap_or(false));
        Ok(axes)
    }

    /// Opens the set-up, where it names no light with one for these techniques, sets its clock, and prints the scene's load report
    /// to standard error. `all` techniques ask for no light of a kind.
    fn open(&self, techniques: &[String]) -> Result<(Setup, Scene)> {
        let named = self.light.is_some() || self.lamps.chosen();
        let (mut setup, scene) = match named {
            true => Setup::open(&self.setup)?,
            false => Setup::open_for(&self.setup, &techniques.iter().map(String::as_str).collect::<Vec<_>>())?,
        };
        tell!("{}", scene.report().trim_end());
        let animation = self.animation.as_ref().map(|name| scene.animation(name)).transpose()?;
        let now = setup.clock();
        let clock = Clock { time: self.time.unwrap_or(now.time), animation: animation.unwrap_or(now.animation) };
        setup.set_clock(&scene, clock);
        Ok((setup, scene))
    }

    /// Applies what was asked for on top of the set-up, and checks the result.
    fn apply(&self, setup: &mut Setup, scene: &Scene, selected: &[String]) -> Result<()> {
        if let Some(size) = &self.size {
            setup.size = capture::parse_size(size)?;
        }
        if let Some(camera) = &self.camera {
            setup.camera = setup::parse_camera(scene, camera, setup.clock())?;
        }
        if let Some(light) = &self.light {
            setup.light = setup::parse_light(scene, light, setup.clock())?;
            setup.fit_path();
        }
        self.lamps.apply(setup, scene)?;
        if let Some(samples) = self.truth_samples {
            setup.truth_samples = samples;
        }
        for assignment in &self.sets {
            setup.set(assignment, selected)?;
        }
        setup.check()
    }
}

/// Opens the window, or where there is no display writes the tour.
fn open(what: Option<&str>, adapter: Option<&str>) -> Result<()> {
    // What is not there is said before a window opens.
    if let Some(what) = what.filter(|w| !builtin::is_builtin(w) && !files::path_of(w).exists()) {
        Setup::open(what)?;
    }
    match ui::run(what, adapter)? {
        ui::Ended::Closed => Ok(()),
        ui::Ended::NoDisplay(reason) => match what {
            Some(what) => {
                bail!("there is no display to open {what} on ({reason}); use `shadowscope capture {what} -o FILE.png`")
            }
            None => {
                tell!("There is no display ({reason}), so the tour is written into out/ instead.");
                figure::tour(&figure::Tour::default(), adapter)
            }
        },
    }
}

/// The ids of `--techniques`, `all` spelt out.
fn named(ids: &[String]) -> Vec<String> {
    if ids == ["all"] {
        return techniques::ALL.iter().map(|i| i.id.into()).collect();
    }
    // Each once, in the order named.
    let mut out: Vec<String> = Vec::new();
    ids.iter().for_each(|id| {
        if !out.contains(id) {
            out.push(id.clone());
        }
    });
    out
}

/// Opens what is to be measured, with all that was asked for on top: the techniques that serve its light, and why others do not.
fn to_measure(wanted: Wanted, ids: &[String]) -> Result<(Setup, Scene, Vec<String>, Vec<String>)> {
    let (mut setup, scene) = wanted.open(ids)?;
    // A capture may show a map that only its own technique has.
    setup.view = "shaded".into();
    let named = named(ids);
    for id in &named {
        setup.select(id)?;
    }
    wanted.apply(&mut setup, &scene, &named)?;
    let (ids, refused) = chosen(ids, &setup)?;
    Ok((setup, scene, ids, refused))
}

/// As [`named`], but only those that serve the set-up's light; of `all` those left out are said. The rest was asked for: why each does
/// not, to be told by [`failures`] behind what can be measured.
///
/// # Errors
/// No such technique, or none that serves it.
fn chosen(ids: &[String], setup: &Setup) -> Result<(Vec<String>, Vec<String>)> {
    let all = ids == ["all"];
    let (mut out, mut refused) = (Vec::new(), Vec::new());
    for id in named(ids) {
        match setup.unmeasurable(techniques::find_or_say(&id)?) {
            Some(reason) if all => tell!("left out: {reason}"),
            Some(reason) => refused.push(reason),
            None => out.push(id),
        }
    }
    if out.is_empty() {
        failures(&refused, refused.len())?;
    }
    let kinds = || setup.lit().iter().map(|(_, light)| light.kind()).collect::<Vec<_>>().join(", ");
    ensure!(!out.is_empty(), "no technique serves {} light yet", kinds());
    Ok((out, refused))
}

/// Tells what could not be measured, of so many configurations.
///
/// # Errors
/// Why one could not, or how many could not.
fn failures(failed: &[String], of: usize) -> Result<()> {
    match failed {
        [] => Ok(()),
        [one] => bail!("{one}"),
        all => {
            all.iter().for_each(|why| tell!("{why}"));
            bail!("{} of {of} configurations could not be measured", all.len())
        }
    }
}

fn reproduce(ids: &[String], folder: Option<&Path>, adapter: Option<&str>) -> Result<()> {
    reproduce::check(ids)?;
    folder.map_or(Ok(()), check_folder)?;
    let bar = progress();
    let mut printed = 0;
    let done = reproduce::run(Arc::new(interrupt::device(adapter)?), ids, folder, &mut |step| match step {
        reproduce::Step::Working(done, what) => {
            show(&bar, done, what.into());
            if interrupt::asked() { Err(anyhow!(STOPPED)) } else { Ok(()) }
        }
        reproduce::Step::Head(text) => print(&text),
        reproduce::Step::Measured(text) => {
            printed += 1;
            bar.suspend(|| print(&text))
        }
    });
    bar.finish_and_clear();
    interrupt::kept(done, || match printed {
        0 => "nothing is measured yet".into(),
        1 => "1 reproduction is measured and printed".into(),
        n => format!("{n} reproductions are measured and printed"),
    })
}

fn cannot_write(path: &Path) -> String {
    format!("{} cannot be written", path.display())
}

/// Makes sure that results can be written to a file later, or to standard output (-), and says if its folder has to be made.
fn check_target(path: &Path) -> Result<()> {
    if path.as_os_str() != "-"
        && let Some(note) = files::check_target(path)?
    {
        tell!("{note}");
    }
    Ok(())
}

/// The same for a folder.
fn check_folder(folder: &Path) -> Result<()> {
    files::check_folder(folder)?.iter().for_each(|note| tell!("{note}"));
    Ok(())
}

/// Writes to standard output; a reader that has gone away is no error.
fn print(text: &str) -> Result<()> {
    match std::io::stdout().lock().write_all(text.as_bytes()) {
        Err(e) if e.kind() != ErrorKind::BrokenPipe => Err(e).context("standard output cannot be written"),
        _ => Ok(()),
    }
}

/// Progress over a share, 0 to 1: a bar on standard error; where that is no terminal, a line now and then.
struct Progress {
    bar: ProgressBar,
    /// Lines said.
    lines: Cell<u64>,
}

impl std::ops::Deref for Progress {
    type Target = ProgressBar;
    fn deref(&self) -> &ProgressBar {
        &self.bar
    }
}

fn progress() -> Progress {
    Progress { bar: progress_bar(1000), lines: Cell::new(0) }
}

/// Seconds between two lines.
const LINE: u64 = 30;

fn show(progress: &Progress, done: f32, what: String) {
    let due = progress.elapsed().as_secs() / LINE;
    if progress.is_hidden() && due > progress.lines.get() {
        progress.lines.set(due);
        tell!("{:3.0} %  {what}", done * 100.0);
    }
    progress.set_position((done * 1000.0) as u64);
    progress.set_message(what);
}

/// A progress bar on standard error; nothing where that is not a terminal.
pub fn progress_bar(steps: u64) -> ProgressBar {
    let style = ProgressStyle::with_template("{bar:32} {percent:>3} %  {msg}  {eta} left");
    ProgressBar::new(steps).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
}

/// A renderer of a scene on a device; says what of the scene that had no room for.
fn renderer(gpu: Gpu, scene: Scene) -> Result<Renderer> {
    let renderer = Renderer::new(Arc::new(gpu), Arc::new(scene))?;
    if let Some(note) = renderer.scene_note() {
        tell!("  {note}");
    }
    Ok(renderer)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The command line takes what the docs tell their readers to type, whatever it would take to run it.
    #[test]
    fn commands_of_the_docs_are_understood() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR"));
        let mut pages = vec![root.join("README.md")];
        for folder in ["docs", "docs/techniques", "docs/lessons"] {
            let entries = std::fs::read_dir(root.join(folder)).into_iter().flatten().flatten();
            pages.extend(entries.map(|e| e.path()).filter(|p| p.extension().is_some_and(|e| e == "md")));
        }
        let (mut wrong, mut found) = (Vec::new(), 0);
        for page in pages {
            let text = std::fs::read_to_string(&page).unwrap().replace("\\\n", " ");
            let mut shell = false;
            for line in text.lines().map(str::trim) {
                if line.starts_with("```") {
                    shell = line.starts_with("```sh");
                }
                // What a shell fills in is not there.
                if !shell || !line.starts_with("shadowscope") || line.contains('$') {
                    continue;
                }
                let command = line.split(" #").next().and_then(|l| l.split(" > ").next()).unwrap_or_default();
                let words = shlex::split(command).unwrap_or_default();
                found += 1;
                if let Err(error) = Cli::try_parse_from(&words) {
                    wrong.push(format!("{}: {command}: {error}", page.display()));
                }
            }
        }
        assert!(wrong.is_empty(), "{wrong:#?}");
        assert!(found > 80, "{found} commands");
    }
}
