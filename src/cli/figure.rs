//! `figure` and `tour`: sheets of pictures.

use super::{check_folder, interrupt, name, progress, show};
use crate::figure::{self, Axis, Format, Kind, Spec};
use crate::files;
use crate::message::tell;
use crate::scene::builtin;
use crate::setup::Side;
use crate::techniques;
use anyhow::{Context, Result, ensure};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What is drawn, and where to.
#[derive(clap::Args)]
pub struct Wanted {
    /// A spec (.toml), a sheet that is to be drawn again (.png, .svg), or one that comes with the program: compare, tour.
    #[arg(value_parser = name())]
    spec: String,
    /// Folder to write into.
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Kinds of files, separated by commas: png, svg, pdf, tex.
    #[arg(long, value_delimiter = ',', default_value = "png,svg,pdf,tex")]
    formats: Vec<Format>,
    /// Write each cell as a capture of its own too.
    #[arg(long)]
    cells: bool,
}

/// Which of the tour's pictures.
#[derive(clap::Args)]
pub struct Tour {
    /// Folder to write into.
    #[arg(short, long, default_value = "out")]
    output: PathBuf,
    /// Built-in scenes, separated by commas.
    #[arg(long, value_delimiter = ',', default_value = "all")]
    scenes: Vec<String>,
    /// Techniques, separated by commas; truth is the ray-traced one.
    #[arg(long, value_delimiter = ',', default_value = "all")]
    techniques: Vec<String>,
}

impl Default for Tour {
    fn default() -> Tour {
        Tour { output: "out".into(), scenes: vec!["all".into()], techniques: vec!["all".into()] }
    }
}

/// Name of the tour's sheet.
const CONTACT_SHEET: &str = "contact-sheet";

pub fn run(wanted: &Wanted, adapter: Option<&str>) -> Result<()> {
    check_folder(&wanted.output)?;
    let mut spec = Spec::open(&wanted.spec)?;
    spec.cells |= wanted.cells;
    let path = files::path_of(&wanted.spec);
    let name = path.file_stem().map_or("figure".into(), |stem| stem.to_string_lossy().into_owned());
    draw(&spec, &wanted.output, &name, &wanted.formats, adapter).with_context(|| wanted.spec.clone())
}

pub fn tour(wanted: &Tour, adapter: Option<&str>) -> Result<()> {
    check_folder(&wanted.output)?;
    let text = figure::BUILT_IN.iter().find(|(name, _)| *name == "tour").map_or("", |(_, text)| text);
    let mut spec = Spec::from_toml(text, Path::new("")).context("the tour's own spec cannot be read")?;
    for scene in wanted.scenes.iter().filter(|scene| *scene != "all") {
        ensure!(builtin::is_builtin(scene), "--scenes {scene}: there are {}", builtin::NAMES.join(", "));
    }
    for id in wanted.techniques.iter().filter(|id| *id != "all" && *id != Side::TRUTH) {
        techniques::find_or_say(id).context("--techniques")?;
    }
    let list = |names: &[String], kind: Kind| match names.iter().any(|name| name == "all") {
        true => Axis::List(kind, vec!["all".into()]),
        false => Axis::List(kind, super::named(names)),
    };
    spec.columns = list(&wanted.scenes, Kind::Scenes);
    spec.rows = list(&wanted.techniques, Kind::Techniques);
    draw(&spec, &wanted.output, CONTACT_SHEET, &[Format::Png], adapter)
}

fn draw(spec: &Spec, folder: &Path, name: &str, formats: &[Format], adapter: Option<&str>) -> Result<()> {
    let gpu = Arc::new(interrupt::device(adapter)?);
    let bar = progress();
    let sheet = figure::draw(spec, &gpu, &mut |done, what| {
        show(&bar, done, what.into());
        !interrupt::asked()
    });
    bar.finish_and_clear();
    let sheet = sheet?;
    sheet.notes.iter().for_each(|note| tell!("{note}"));
    let written = figure::write(&sheet, folder, name, formats)?;
    let (sheets, cells) = written.split_at(formats.len().min(written.len()));
    for path in sheets {
        tell!("wrote {}", path.display());
    }
    if !cells.is_empty() {
        tell!("and {} captures beside it", cells.len());
    }
    Ok(())
}
