//! `advise`: the cheapest configuration within an error budget.

use super::{Wanted, chosen, named, print, progress, try_file};
use crate::frame::Renderer;
use crate::gpu::Gpu;
use crate::measure::advise::{Advice, Budget, advise};
use crate::measure::{self, Record, table};
use crate::techniques;
use anyhow::{Context, Result, ensure};
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;

#[derive(clap::Args)]
pub struct Limits {
    /// Wrong pixels allowed, of those that face the light: 0.5% or 0.005.
    #[arg(long, allow_hyphen_values = true)]
    max_error: String,
    /// Time allowed, as a multiple of that of the set-up's own shadow-map (its parameters as they stand in the set-up).
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
    let max_error = share(&limits.max_error)?;
    if let Some(ratio) = limits.max_ratio {
        ensure!(ratio > 0.0 && ratio.is_finite(), "--max-ratio {ratio} must be a number above 0");
    }
    let json_file = limits.output.as_deref().map(super::sweep::is_json).transpose()?;
    if let Some(path) = &limits.output {
        try_file(path)?;
    }
    let (axes, (mut setup, scene)) = (wanted.axes()?, wanted.open()?);
    setup.view = "shaded".into();
    wanted.apply(&mut setup, &scene, &named(&ids))?;
    let ids = chosen(&ids, &setup)?;
    let mut renderer = Renderer::new(Arc::new(Gpu::new(adapter)?), Arc::new(scene))?;
    let bar = progress();
    let budget = Budget { max_error, max_ratio: limits.max_ratio };
    let advice = advise(&mut renderer, &setup, &ids, &axes, budget, &mut |done, what| {
        super::show(&bar, done, what.into());
        true
    })?;
    bar.finish_and_clear();
    if limits.json {
        let value = serde_json::json!({
            "max_error": max_error, "max_ratio": limits.max_ratio, "space": advice.space,
            "answer": advice.answer.map(|i| &advice.tried[i]),
            "closest": advice.closest.map(|i| &advice.tried[i]),
            "halved": advice.halved.map(|i| &advice.tried[i]),
            "plain": advice.plain.map(|i| &advice.tried[i]),
            "plain_factor": advice.plain_factor(),
            "frontier": advice.frontier, "tried": advice.tried,
        });
        print(&(serde_json::to_string_pretty(&value)? + "\n"))?;
    } else {
        print(&text(&advice, budget))?;
    }
    if let (Some(path), Some(json)) = (&limits.output, json_file) {
        measure::write(&advice.tried, path, json)?;
    }
    Ok(if advice.answer.is_some() { ExitCode::SUCCESS } else { ExitCode::from(NOTHING) })
}

/// Reads `0.5%` or `0.005`.
fn share(text: &str) -> Result<f64> {
    let (number, unit) = text.strip_suffix('%').map_or((text, 1.0), |n| (n, 0.01));
    let value =
        number.trim().parse::<f64>().with_context(|| format!("--max-error {text}: write it as 0.5% or 0.005"))?;
    ensure!((0.0..=1.0).contains(&(value * unit)), "--max-error {text}: it takes 0 to 100 %");
    Ok(value * unit)
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
    let figures = |r: &Record| {
        let ratio = r.cost.map_or(String::new(), |x| format!(" ({x:.2} × the set-up's shadow-map)"));
        format!(
            "{:.4} % wrong, {:.3} ms{ratio}, {:.2} MiB",
            r.error_share * 100.0,
            r.gpu_ms,
            r.gpu_bytes as f64 / 1048576.0
        )
    };
    let asked = match budget.max_ratio {
        Some(ratio) => format!("at most {} % wrong and {ratio} × shadow-map", budget.max_error * 100.0),
        None => format!("at most {} % wrong", budget.max_error * 100.0),
    };
    let mut out = format!("asked for: {asked}\n");
    match (advice.answer.map(row), advice.closest.map(row)) {
        (Some(r), _) => {
            out += &format!("take:      {}: {}\n", name(r), figures(r));
            let mut margin = Vec::new();
            if budget.max_error > 0.0 {
                margin.push(format!("{:.0} % of the error", (1.0 - r.error_share / budget.max_error) * 100.0));
            }
            if let (Some(most), Some(cost)) = (budget.max_ratio, r.cost) {
                margin.push(format!("{:.0} % of the time", (1.0 - cost / most) * 100.0));
            }
            if !margin.is_empty() {
                out += &format!("margin:    {} allowed is left\n", margin.join(" and "));
            }
            if let Some(more) = plain(advice, r) {
                out += &more;
            }
            match advice.halved.map(row) {
                Some(h) => {
                    let more = Advice::cost(h) / Advice::cost(r);
                    out += &format!("half of that error costs {more:.2} times as much: {}: {}\n", name(h), figures(h));
                }
                None if r.error_share == 0.0 => out += "it makes no error that could be halved\n",
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
    out += "; those marked * are beaten by no other in both error and time:\n";
    let mut lines =
        vec![["configuration", "", "error %", "GPU ms", "× set-up's shadow-map", "MiB"].map(String::from).to_vec()];
    for (i, r) in advice.tried.iter().enumerate() {
        lines.push(vec![
            name(r),
            if advice.frontier.contains(&i) { "*" } else { "" }.into(),
            format!("{:.4}", r.error_share * 100.0),
            format!("{:.3}", r.gpu_ms),
            r.cost.map_or("-".into(), |x| format!("{x:.2}")),
            format!("{:.2}", r.gpu_bytes as f64 / 1048576.0),
        ]);
    }
    out += &table::aligned(&lines);
    if let Some(r) = advice.tried.first() {
        out += &format!("adapter: {} ({})\n", r.adapter, r.driver);
        if r.software {
            out += "This adapter is software: compare its times as ratios only; they say nothing of a GPU.\n";
        }
    }
    out
}

/// What a plain shadow map in place of the answer `r` would cost; None if it is one, or none was measured.
fn plain(advice: &Advice, r: &Record) -> Option<String> {
    if let (Some(factor), Some(map)) = (advice.plain_factor(), advice.plain) {
        let map = &advice.tried[map];
        return Some(format!("a plain shadow map within that error costs {factor:.2} times as much: {}\n", name(map)));
    }
    let measured = r.technique != "shadow-map" && advice.tried.iter().any(|t| t.technique == "shadow-map");
    measured.then(|| "no plain shadow map measured is within that error\n".into())
}
