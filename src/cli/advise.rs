//! `advise`: the cheapest configuration within an error budget.

use super::{Wanted, check_target, chosen, failures, interrupt, named, print, progress, renderer};
use crate::chart;
use crate::measure::advise::{Advice, Budget, Figure, advise};
use crate::measure::{self, Record, Step, table};
use crate::techniques;
use anyhow::{Result, ensure};
use std::path::PathBuf;
use std::process::ExitCode;

#[derive(clap::Args)]
pub struct Limits {
    /// The error allowed: 0.5% or 0.005 of a share, a number of the others.
    #[arg(long, allow_hyphen_values = true)]
    max_error: String,
    /// Which error: error (share of wrong pixels), rmse, mae, flip, boundary (95th percentile, pixels) or flicker; by default
    /// error, or rmse where a technique filters.
    #[arg(long)]
    by: Option<String>,
    /// Time allowed, as a multiple of that of the set-up's own plain map (its parameters as they stand in the set-up).
    #[arg(long, allow_hyphen_values = true)]
    max_ratio: Option<f64>,
    /// Write what was measured as .csv or .json.
    #[arg(short, long)]
    output: Option<PathBuf>,
    /// Print the advice as JSON.
    #[arg(long)]
    json: bool,
}

/// Exit code where nothing meets the budget.
const NOTHING: u8 = 3;

pub fn run(mut wanted: Wanted, ids: Vec<String>, limits: Limits, adapter: Option<&str>) -> Result<ExitCode> {
    let by = limits.by.as_deref().map(Figure::find).transpose()?;
    if let Some(ratio) = limits.max_ratio {
        ensure!(ratio > 0.0 && ratio.is_finite(), "--max-ratio {ratio} must be a number above 0");
    }
    let json_file = limits.output.as_deref().map(super::sweep::is_json).transpose()?;
    if let Some(path) = &limits.output {
        check_target(path)?;
    }
    let (axes, (mut setup, scene)) = (wanted.axes()?, wanted.open(&ids)?);
    setup.view = "shaded".into();
    wanted.apply(&mut setup, &scene, &named(&ids))?;
    let (ids, mut failed) = chosen(&ids, &setup)?;
    let by = by.unwrap_or_else(|| Figure::suited(&ids));
    let max_error = by.parse(&limits.max_error)?;
    let mut renderer = renderer(interrupt::device(adapter)?, scene)?;
    let bar = progress();
    let budget = Budget { by, max_error, max_ratio: limits.max_ratio };
    let mut tried = Vec::new();
    let advice = advise(&mut renderer, &setup, &ids, &axes, budget, &mut |step| {
        match step {
            Step::Working(done, what) => super::show(&bar, done, what),
            Step::Row(row) => tried.push(*row),
            Step::Failed(_) => {}
        }
        !interrupt::asked()
    });
    bar.finish_and_clear();
    let unfinished = advice.as_ref().is_err_and(interrupt::stopped);
    let written = match (&limits.output, json_file) {
        (Some(path), Some(json)) if unfinished && !tried.is_empty() => {
            measure::write(&tried, path, json)?;
            Some(path)
        }
        _ => None,
    };
    let advice = interrupt::kept(advice, || match written {
        Some(path) => format!("no advice yet; the {} rows measured so far are in {}", tried.len(), path.display()),
        None => "no advice yet, and nothing is written".into(),
    })?;
    if limits.json {
        let value = serde_json::json!({
            "by": by.id, "max_error": max_error, "max_ratio": limits.max_ratio, "space": advice.space,
            "answer": advice.answer.map(|i| &advice.tried[i]),
            "alike": advice.alike.iter().map(|i| &advice.tried[*i]).collect::<Vec<_>>(),
            "closest": advice.closest.map(|i| &advice.tried[i]),
            "halved": advice.halved.map(|i| &advice.tried[i]),
            "plain": advice.plain.map(|i| &advice.tried[i]),
            "plain_factor": advice.plain_factor(),
            "frontier": advice.frontier, "tried": advice.tried, "failed": advice.failed,
        });
        print(&(serde_json::to_string_pretty(&value)? + "\n"))?;
    } else {
        print(&text(&advice, budget))?;
    }
    if let (Some(path), Some(json)) = (&limits.output, json_file) {
        measure::write(&advice.tried, path, json)?;
    }
    failed.extend(advice.failed);
    failures(&failed, advice.tried.len() + failed.len())?;
    Ok(if advice.answer.is_some() { ExitCode::SUCCESS } else { ExitCode::from(NOTHING) })
}

/// The technique with its main parameters.
fn name(row: &Record) -> String {
    let main = techniques::find(&row.technique).map_or(&[][..], |i| i.main);
    let values = row.values();
    let main = main.iter().filter_map(|(name, _)| values.iter().find(|(n, _)| n == name));
    let main: Vec<String> = main.map(|(n, v)| format!("{n}={v}")).collect();
    format!("{} {}", row.technique, main.join(" ")).trim().into()
}

fn text(advice: &Advice, budget: Budget) -> String {
    let row = |i: usize| &advice.tried[i];
    let by = budget.by;
    let error = |r: &Record| by.of(r).map_or("-".into(), |x| by.value(x));
    let figures = |r: &Record| {
        let ratio = r.cost.map_or(String::new(), |x| format!(" ({x:.2} × the set-up's plain map)"));
        format!("{} {}, {:.3} ms{ratio}, {:.2} MiB", by.title, error(r), r.gpu_ms, r.gpu_bytes as f64 / 1048576.0)
    };
    let mut asked = format!("{} at most {}", by.title, by.value(budget.max_error));
    if let Some(ratio) = budget.max_ratio {
        asked += &format!(", time at most {ratio} × the set-up's plain map");
    }
    let mut out = format!("asked for: {asked}\n");
    match (advice.answer.map(row), advice.closest.map(row)) {
        (Some(r), _) => {
            out += &format!("take:      {}: {}\n", name(r), figures(r));
            let mut margin = Vec::new();
            if let Some(error) = by.of(r).filter(|_| budget.max_error > 0.0) {
                margin.push(format!("{:.0} % of the error", (1.0 - error / budget.max_error) * 100.0));
            }
            if let (Some(most), Some(cost)) = (budget.max_ratio, r.cost) {
                margin.push(format!("{:.0} % of the time", (1.0 - cost / most) * 100.0));
            }
            if !margin.is_empty() {
                out += &format!("margin:    {} allowed is left\n", margin.join(" and "));
            }
            if !advice.alike.is_empty() {
                let names: Vec<String> = advice.alike.iter().map(|i| name(row(*i))).collect();
                out += &format!("as fast, within the spread of the times: {}\n", names.join(", "));
            }
            if let Some(more) = plain(advice, r) {
                out += &more;
            }
            match advice.halved.map(row) {
                Some(h) => {
                    let more = Advice::cost(h) / Advice::cost(r);
                    out += &format!("half of that error costs {more:.2} times as much: {}: {}\n", name(h), figures(h));
                }
                None if by.of(r) == Some(0.0) => out += "it makes no error that could be halved\n",
                None if advice.tried.len() >= advice.limit => {
                    out += "what halves that error was not found before the limit was reached\n";
                }
                None => out += "nothing there halves that error\n",
            }
        }
        (None, Some(r)) => {
            out += &format!("nothing measured meets that; the closest miss is {}: {}\n", name(r), figures(r));
        }
        (None, None) => out += "there is no configuration to choose from\n",
    }
    out += &format!("\nmeasured {} of {} configurations (at most {})", advice.tried.len(), advice.space, advice.limit);
    out += "; those marked * are beaten by no other (times whose quartiles overlap count as equal):\n";
    let heads = ["configuration", "", by.title, "× set-up's plain map", "GPU ms", "plain map, ms", "MiB"];
    let mut lines = vec![heads.map(String::from).to_vec()];
    for (i, r) in advice.tried.iter().enumerate() {
        lines.push(vec![
            name(r),
            if advice.frontier.contains(&i) { "*" } else { "" }.into(),
            error(r),
            r.cost.map_or("-".into(), |x| format!("{x:.2}")),
            format!("{:.3}", r.gpu_ms),
            r.cost_base_ms().map_or("-".into(), |ms| format!("{ms:.3}")),
            format!("{:.2}", r.gpu_bytes as f64 / 1048576.0),
        ]);
    }
    out += &table::aligned(&lines);
    if let (Some(base), Some([least, most])) = (&advice.base, advice.base_ms()) {
        out += &format!("The set-up's plain map ({base}) took {least:.3} to {most:.3} ms in turn with the rows");
        out += if most > 1.1 * least { ": compare multiples of it, not ms.\n" } else { ".\n" };
    }
    if let Some((cheapest, winner)) = advice.cheapest_beaten(by) {
        let [cheapest, winner] = [cheapest, winner].map(|i| name(row(i)));
        out +=
            &format!("The least median time has {cheapest}; {winner} beats it: more exact, and their times overlap.\n");
    }
    if let Some(busy) = chart::busy(&advice.tried) {
        out += &format!("{busy}\n");
    }
    if let Some(r) = advice.tried.first() {
        out += &format!("adapter: {} ({})\n", r.adapter, r.driver);
        if r.software {
            out += "This adapter is software: compare its times as ratios only; they say nothing of a GPU.\n";
        }
    }
    out
}

/// What a plain shadow map (around a lamp, a cube) in place of the answer `r` would cost; None if it is one, or none was measured.
fn plain(advice: &Advice, r: &Record) -> Option<String> {
    let called = |cube: bool| if cube { "cube" } else { "shadow map" };
    if let (Some(factor), Some(map)) = (advice.plain_factor(), advice.plain) {
        let map = &advice.tried[map];
        let what = called(map.technique == "cube");
        if Advice::as_fast(map, r) {
            return Some(format!("a plain {what} within that error is as fast, within the spread: {}\n", name(map)));
        }
        return Some(format!("a plain {what} within that error costs {factor:.2} times as much: {}\n", name(map)));
    }
    let tried = |id: &str| advice.tried.iter().any(|t| t.technique == id);
    let plain = measure::PLAIN.into_iter().find(|id| tried(id)).filter(|id| r.technique != *id)?;
    Some(format!("no plain {} measured is within that error\n", called(plain == "cube")))
}
