//! `sweep` and `merge`: many configurations into one file, in parts if need be.

use super::{Wanted, cannot_write, chosen, print, progress};
use crate::capture::create_folder;
use crate::frame::Renderer;
use crate::gpu::Gpu;
use crate::measure::{self, Axis, Record, Shard, Step};
use crate::setup::Setup;
use anyhow::{Context, Result, bail, ensure};
use std::collections::BTreeMap;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::Arc;

#[derive(clap::Args)]
pub struct Output {
    /// File to write: .csv or .json. An interrupted sweep goes on where it stopped.
    #[arg(short, long)]
    output: PathBuf,
    /// Vary each technique's main parameters over the values that `advise` tries, beside those of --set.
    #[arg(long)]
    main: bool,
    /// Measure only the i-th of n parts: i/n. `merge` joins the files.
    #[arg(long, value_name = "I/N")]
    shard: Option<String>,
    /// Also move the camera in small steps and count the labels that flicker.
    #[arg(long)]
    flicker: bool,
    /// Also write an HTML page with charts, tables and pictures into this folder.
    #[arg(long, value_name = "DIR")]
    report: Option<PathBuf>,
}

pub fn run(mut wanted: Wanted, ids: Vec<String>, output: Output, adapter: Option<&str>) -> Result<()> {
    let json = is_json(&output.output)?;
    let shard = output.shard.as_deref().map(Shard::parse).transpose()?;
    let axes = wanted.sets.iter().map(|s| Axis::parse(s)).collect::<Result<Vec<_>>>()?;
    wanted.sets.clear();
    let (mut setup, scene) = wanted.open()?;
    setup.view = "shaded".into();
    wanted.apply(&mut setup, &scene, &[])?;
    let ids = chosen(&ids, &setup)?;
    let all = measure::expand(&setup, &ids, &axes, output.main)?;
    let total = all.len() as u64;
    let part = |(i, _): &(u64, Setup)| shard.is_none_or(|s| s.has(*i));
    let work: Vec<(u64, Setup)> = (0..).zip(all).filter(part).collect();
    create_folder(&output.output)?;

    // Rows stand in a file beside the result until all are there, so that nothing measured is lost.
    let mut path = output.output.clone().into_os_string();
    path.push(".partial");
    let partial = PathBuf::from(path);
    let finished = output.output.exists().then(|| measure::read(&output.output)).transpose()?;
    let mut rows = match (&finished, partial.exists()) {
        (Some(rows), _) => rows.clone(),
        (None, true) => readable(&partial)?,
        (None, false) => Vec::new(),
    };
    let held = if finished.is_some() { &output.output } else { &partial };
    agree(&rows, &work, total)
        .with_context(|| format!("{} holds another sweep; delete it or write into another file", held.display()))?;
    let missing: Vec<(u64, Setup)> =
        work.iter().filter(|(i, _)| !rows.iter().any(|r| r.index == *i)).cloned().collect();
    if !rows.is_empty() {
        eprintln!("{} of {} configurations are measured already in {}", rows.len(), work.len(), held.display());
    }
    let gpu = Arc::new(Gpu::new(adapter)?);
    ensure!(
        missing.is_empty() || rows.iter().all(|r| r.adapter == gpu.info.name),
        "{} was begun on another adapter; times of two adapters do not belong into one sweep",
        held.display()
    );
    let mut renderer = Renderer::new(gpu, Arc::new(scene))?;
    if !missing.is_empty() {
        let file = File::create(&partial).with_context(|| cannot_write(&partial))?;
        let mut writer = csv::Writer::from_writer(file);
        for row in &rows {
            writer.serialize(row).with_context(|| cannot_write(&partial))?;
        }
        writer.flush().with_context(|| cannot_write(&partial))?;
        let bar = progress();
        let mut failed = None;
        let measured = measure::run(&mut renderer, &setup, &missing, total, output.flicker, &mut |step| {
            match step {
                Step::Working(done, what) => super::show(&bar, done, what),
                Step::Row(row) => {
                    let written = writer.serialize(&*row).map_err(anyhow::Error::from);
                    failed = written.and_then(|()| Ok(writer.flush()?)).err();
                    rows.push(*row);
                }
            }
            failed.is_none()
        });
        bar.finish_and_clear();
        failed.map_or(Ok(()), Err).with_context(|| cannot_write(&partial))?;
        measured?;
    }
    rows.sort_by_key(|r| r.index);
    if finished.as_ref() != Some(&rows) {
        measure::write(&rows, &output.output, json)?;
    }
    if partial.exists() {
        std::fs::remove_file(&partial).with_context(|| format!("{} cannot be removed", partial.display()))?;
    }
    eprintln!("{} holds {} rows", output.output.display(), rows.len());
    if let Some(folder) = &output.report {
        measure::report::write(&rows, &format!("Sweep of {}", setup.scene), folder, &mut renderer)?;
        eprintln!("wrote {}", folder.join("index.html").display());
    }
    Ok(())
}

/// Joins the parts of a sweep.
pub fn merge(parts: &[PathBuf], output: &Path) -> Result<()> {
    let json = is_json(output)?;
    let mut all: BTreeMap<u64, Record> = BTreeMap::new();
    for path in parts {
        for row in measure::read(path)? {
            if let Some(first) = all.values().next() {
                let same = (row.configurations, &row.scene) == (first.configurations, &first.scene);
                ensure!(same, "{} is part of another sweep than {}", path.display(), parts[0].display());
                ensure!(
                    row.adapter == first.adapter,
                    "{} was measured on {}, {} on {}; times of two adapters do not belong into one sweep",
                    path.display(),
                    row.adapter,
                    parts[0].display(),
                    first.adapter
                );
            }
            let index = row.index;
            if let Some(old) = all.insert(index, row)
                && all.get(&index).is_some_and(|new| new.setup != old.setup)
            {
                bail!("{}: configuration {index} is another one in an earlier part", path.display());
            }
        }
    }
    let total = all.values().next().map_or(0, |r| r.configurations);
    let missing: Vec<String> = (0..total).filter(|i| !all.contains_key(i)).map(|i| i.to_string()).collect();
    let rows: Vec<Record> = all.into_values().collect();
    create_folder(output)?;
    measure::write(&rows, output, json)?;
    if !missing.is_empty() {
        let named = if missing.len() > 20 { format!("{} …", missing[..20].join(", ")) } else { missing.join(", ") };
        eprintln!("{} of {total} configurations are missing: {named}", missing.len());
    }
    print(&format!("{} rows in {}\n", rows.len(), output.display()))
}

/// Whether a results file is JSON; else it is CSV.
pub fn is_json(path: &Path) -> Result<bool> {
    match path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase).as_deref() {
        Some("json") => Ok(true),
        Some("csv") => Ok(false),
        _ => bail!("{}: a results file's name ends in .csv or .json", path.display()),
    }
}

/// The rows of a file that may end in the middle of one.
fn readable(path: &Path) -> Result<Vec<Record>> {
    let mut reader = csv::Reader::from_path(path).with_context(|| format!("{} cannot be read", path.display()))?;
    Ok(reader.deserialize().map_while(|row| row.ok()).collect())
}

/// Makes sure that rows are of these configurations.
fn agree(rows: &[Record], work: &[(u64, Setup)], total: u64) -> Result<()> {
    for row in rows {
        let known = work.iter().find(|(i, _)| *i == row.index);
        let (_, setup) = known.with_context(|| format!("configuration {} is not among those asked for", row.index))?;
        ensure!(
            row.configurations == total && row.setup()? == *setup,
            "configuration {} is {} there and {} here",
            row.index,
            row.technique,
            setup.technique
        );
    }
    Ok(())
}
