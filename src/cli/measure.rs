//! `measure`: techniques side by side at one set-up.

use super::{More, Wanted, check_target, failures, interrupt, print, progress, renderer, to_measure};
use crate::measure::{self, Step, table};
use anyhow::{Result, ensure};
use std::path::PathBuf;

/// Where the rows go besides the table on standard output.
#[derive(clap::Args)]
pub struct Output {
    /// Write the rows as JSON (- for standard output).
    #[arg(long, value_name = "FILE", num_args = 0..=1, default_missing_value = "-")]
    json: Option<PathBuf>,
    /// Write the rows as CSV (- for standard output).
    #[arg(long, value_name = "FILE", num_args = 0..=1, default_missing_value = "-")]
    csv: Option<PathBuf>,
    #[command(flatten)]
    more: More,
}

pub fn run(wanted: Wanted, ids: Vec<String>, output: Output, adapter: Option<&str>) -> Result<()> {
    let both = [&output.json, &output.csv].map(|p| p.as_ref().is_some_and(|p| p.as_os_str() == "-"));
    ensure!(both != [true, true], "standard output takes either --json or --csv; give one of them a file");
    [&output.json, &output.csv].into_iter().flatten().try_for_each(|path| check_target(path))?;
    let (mut setup, scene, ids, mut failed) = to_measure(wanted, &ids)?;
    let mut work = Vec::new();
    for (i, id) in ids.iter().enumerate() {
        setup.select(id)?;
        work.push((i as u64, setup.clone()));
    }
    let mut renderer = renderer(interrupt::device(adapter)?, scene)?;
    let bar = progress();
    let mut rows = Vec::new();
    let measured = measure::run(&mut renderer, &setup, &work, work.len() as u64, output.more.wanted(), &mut |step| {
        match step {
            Step::Working(done, what) => super::show(&bar, done, what),
            Step::Row(row) => rows.push(*row),
            Step::Failed(why) => failed.push(why.to_string()),
        }
        !interrupt::asked()
    });
    bar.finish_and_clear();
    // What is measured is told, though Ctrl-C has stopped the rest.
    let measured = interrupt::kept(measured, || match rows.len() {
        0 => "nothing is measured yet".into(),
        n => format!("{n} of {} techniques are measured, and the figures are theirs", work.len()),
    });
    let measured = match measured {
        Err(error) if rows.is_empty() || !interrupt::stopped(&error) => return Err(error),
        measured => measured,
    };
    let of = rows.len() + failed.len();
    if rows.is_empty() {
        return failures(&failed, of);
    }
    let mut shown = false;
    for (path, json) in [(output.json, true), (output.csv, false)] {
        let mut text = Vec::new();
        match path {
            Some(path) if path.as_os_str() == "-" => {
                if json {
                    measure::write_json(&rows, &mut text)?
                } else {
                    measure::write_csv(&rows, &mut text)?
                }
                print(&String::from_utf8_lossy(&text))?;
                shown = true;
            }
            Some(path) => measure::write(&rows, &path, json)?,
            None => {}
        }
    }
    if !shown {
        print(&table::text(&rows))?;
    }
    measured?;
    failures(&failed, of)
}
