//! `sweep` and `merge`: many configurations into one file, in parts if need be.

use super::{
    More, Wanted, cannot_write, check_folder, check_target, chosen, failures, interrupt, named, print, progress,
};
use crate::files;
use crate::frame::Renderer;
use crate::measure::{self, Record, Shard, Step};
use crate::message::shortened;
use crate::message::tell;
use crate::setup::Setup;
use anyhow::{Context, Result, bail, ensure};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs::{File, TryLockError};
use std::io::BufRead;
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
    #[command(flatten)]
    more: More,
    /// Also write an HTML page with charts, tables and pictures into this folder.
    #[arg(long, value_name = "DIR")]
    report: Option<PathBuf>,
}

pub fn run(mut wanted: Wanted, ids: Vec<String>, output: Output, adapter: Option<&str>) -> Result<()> {
    let json = is_json(&output.output)?;
    check_target(&output.output)?;
    output.report.as_deref().map_or(Ok(()), check_folder)?;
    let shard = output.shard.as_deref().map(Shard::parse).transpose()?;
    let axes = wanted.axes()?;
    let (mut setup, scene) = wanted.open(&ids)?;
    setup.view = "shaded".into();
    wanted.apply(&mut setup, &scene, &named(&ids))?;
    let (ids, mut refused) = chosen(&ids, &setup)?;
    let all = measure::expand(&setup, &ids, &axes, output.main)?;
    let total = all.len() as u64;
    let part = |(i, _): &(u64, Setup)| shard.is_none_or(|s| s.has(*i));
    let work: BTreeMap<u64, Setup> = (0..).zip(all).filter(part).collect();
    ensure!(!work.is_empty(), "this part of the sweep has no configurations: there are {total} in all");

    // Rows stand in a file beside the result until all are there, so that nothing measured is lost.
    let mut path = output.output.clone().into_os_string();
    path.push(".partial");
    let partial = PathBuf::from(path);
    // It is put there by us, or by nobody.
    if let Ok(about) = partial.symlink_metadata() {
        ensure!(
            about.is_file(),
            "{} is {}, and rows would be kept there until all are measured; remove it or write into another file",
            partial.display(),
            files::kind(&about)
        );
    }
    // Whoever writes it holds it. What another one is writing is not to be taken away under it.
    let free = |file: &File| {
        let taken = matches!(file.try_lock(), Err(TryLockError::WouldBlock));
        ensure!(!taken, "{} is being written by another sweep; wait for its end or stop it", partial.display());
        Ok(())
    };
    File::open(&partial).ok().as_ref().map_or(Ok(()), free)?;
    let finished = output.output.exists().then(|| measure::read(&output.output)).transpose()?.unwrap_or_default();
    let begun = if partial.exists() { readable(&partial)? } else { Vec::new() };
    let mut rows: BTreeMap<u64, Record> = BTreeMap::new();
    for (held, file) in [(&finished, &output.output), (&begun, &partial)] {
        agree(held, &work, total)
            .with_context(|| format!("{} holds another sweep; delete it or write into another file", file.display()))?;
        rows.extend(held.iter().map(|r| (r.index, r.clone())));
    }
    // Rows of versions without an averaged truth hold its figures against the hard one.
    rows.retain(|_, r| r.truth_samples > 0);
    if output.more.flicker {
        // Rows of other versions may hold flicker by another definition, and no label flicker.
        rows.retain(|_, r| r.label_flicker.is_some());
    }
    if output.more.seeds > 1 {
        rows.retain(|_, r| r.seeds == Some(output.more.seeds));
    }
    let missing: Vec<(u64, Setup)> =
        work.iter().filter(|(i, _)| !rows.contains_key(i)).map(|(i, s)| (*i, s.clone())).collect();
    if !rows.is_empty() {
        tell!("{} of {} configurations are measured already", rows.len(), work.len());
    }
    let gpu = Arc::new(interrupt::device(adapter)?);
    ensure!(
        missing.is_empty() || rows.values().all(|r| r.adapter == gpu.info.name),
        "{} was begun on another adapter; times of two adapters do not belong into one sweep",
        output.output.display()
    );
    let mut renderer = Renderer::new(gpu, Arc::new(scene))?;
    if !missing.is_empty() {
        // What is there goes into a fresh file first, whole; what comes is added row by row.
        let held: Vec<Record> = rows.values().cloned().collect();
        measure::write(&held, &partial, false)?;
        let file = File::options().append(true).open(&partial).with_context(|| cannot_write(&partial))?;
        free(&file)?;
        let mut writer = csv::WriterBuilder::new().has_headers(held.is_empty()).from_writer(file);
        let bar = progress();
        let mut failed = None;
        let measured = measure::run(&mut renderer, &setup, &missing, total, output.more.wanted(), &mut |step| {
            match step {
                Step::Working(done, what) => super::show(&bar, done, what),
                Step::Row(row) => {
                    let written = writer.serialize(&*row).map_err(io_error);
                    failed = written.and_then(|()| writer.flush()).err();
                    rows.insert(row.index, *row);
                }
                Step::Failed(why) => refused.push(why.to_string()),
            }
            failed.is_none() && !interrupt::asked()
        });
        bar.finish_and_clear();
        if let Some(error) = failed {
            let (file, why) = (partial.display(), files::reason(&error));
            bail!(
                "{file} cannot be written: {why}; the rows that it holds stay, and the same command goes on from there"
            );
        }
        interrupt::kept(measured, || match rows.len() {
            0 => "nothing is measured yet".into(),
            n => {
                let (of, file) = (work.len(), partial.display());
                format!(
                    "{n} of {of} configurations are measured and stand in {file}; the same command goes on from there"
                )
            }
        })?;
    }
    let rows: Vec<Record> = rows.into_values().collect();
    if finished != rows && !rows.is_empty() {
        measure::write(&rows, &output.output, json)?;
    }
    if partial.exists() {
        std::fs::remove_file(&partial).with_context(|| format!("{} cannot be removed", partial.display()))?;
    }
    if rows.is_empty() {
        return failures(&refused, refused.len());
    }
    tell!("{} holds {} rows", output.output.display(), rows.len());
    if let Some(folder) = &output.report {
        measure::report::write(&rows, &format!("Sweep of {}", setup.scene), folder, &mut renderer)?;
        tell!("wrote {}", folder.join("index.html").display());
    }
    failures(&refused, rows.len() + refused.len())
}

fn io_error(error: csv::Error) -> std::io::Error {
    match error.into_kind() {
        csv::ErrorKind::Io(error) => error,
        other => std::io::Error::other(format!("{other:?}")),
    }
}

/// Joins the parts of a sweep.
pub fn merge(parts: &[PathBuf], output: &Path) -> Result<()> {
    let json = is_json(output)?;
    check_target(output)?;
    let mut all: BTreeMap<u64, Record> = BTreeMap::new();
    for path in parts {
        for row in measure::read(path)? {
            if let Some(first) = all.values().next() {
                if let Some(what) =
                    difference(&row, row.setup()?.around(), first.configurations, first.setup()?.around())?
                {
                    bail!("{} is part of another sweep than {}: {what}", path.display(), parts[0].display());
                }
                ensure!(
                    (&row.adapter, &row.driver) == (&first.adapter, &first.driver),
                    "{} was measured on {} ({}), {} on {} ({}); times of two adapters do not belong into one sweep",
                    path.display(),
                    row.adapter,
                    row.driver,
                    parts[0].display(),
                    first.adapter,
                    first.driver
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
    measure::write(&rows, output, json)?;
    if !missing.is_empty() {
        let named = if missing.len() > 20 { format!("{} …", missing[..20].join(", ")) } else { missing.join(", ") };
        tell!("{} of {total} configurations are missing: {named}", missing.len());
    }
    print(&format!("{} rows in {}\n", rows.len(), output.display()))?;
    ensure!(missing.is_empty(), "the sweep is not complete");
    Ok(())
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
    let mut file = files::open(path, files::MOST_ROWS).with_context(|| format!("{} cannot be read", path.display()))?;
    let begins = file.fill_buf().with_context(|| format!("{} cannot be read", path.display()))?;
    ensure!(
        begins.iter().zip(BEGINS).all(|(is, should)| is == should),
        "{} holds no rows of a sweep; remove it or write into another file",
        path.display()
    );
    let mut reader = csv::Reader::from_reader(file);
    let whole = |row: Result<Record, csv::Error>| row.ok().filter(|r| r.setup().is_ok());
    Ok(reader.deserialize().map_while(whole).collect())
}

/// What a file of rows begins with.
const BEGINS: &[u8] = b"index,";

/// Makes sure that rows are of these configurations.
fn agree(rows: &[Record], work: &BTreeMap<u64, Setup>, total: u64) -> Result<()> {
    for row in rows {
        let setup = work
            .get(&row.index)
            .with_context(|| format!("configuration {} is not among those asked for", row.index))?;
        if let Some(what) = difference(row, row.setup()?, total, setup.clone())? {
            bail!("configuration {} is another one: {what}", row.index);
        }
    }
    Ok(())
}

/// What differs first between a row that is there and what is asked for here; None if nothing does.
fn difference(row: &Record, there: Setup, total: u64, here: Setup) -> Result<Option<String>> {
    if row.configurations != total {
        return Ok(Some(format!("there are {} configurations there and {total} here", row.configurations)));
    }
    if there == here {
        return Ok(None);
    }
    let found = differing(String::new(), &serde_json::to_value(there)?, &serde_json::to_value(here)?);
    Ok(Some(found.unwrap_or_else(|| "a number was rounded".into())))
}

fn differing(key: String, there: &Value, here: &Value) -> Option<String> {
    match (there, here) {
        (a, b) if a == b => None,
        (Value::Object(a), Value::Object(b)) => a.keys().chain(b.keys()).find_map(|name| {
            let inner = if key.is_empty() { name.clone() } else { format!("{key}.{name}") };
            let [a, b] = [a, b].map(|values| values.get(name).unwrap_or(&Value::Null));
            differing(inner, a, b)
        }),
        _ => {
            let told = |value: &Value| if value.is_null() { "not set".into() } else { shortened(&value.to_string()) };
            Some(format!("{} is {} there and {} here", shortened(&key), told(there), told(here)))
        }
    }
}
