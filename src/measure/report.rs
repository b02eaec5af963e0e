//! A sweep as one page: charts, tables and pictures of the extremes, for a browser without a network.

use super::advise::Advice;
use super::columns::{COLUMNS, Column};
use super::record::params_text;
use super::table::per_light;
use super::{Axis, Record, expand, tied};
use crate::capture;
use crate::chart::{self, COSTS, ERRORS, escape};
use crate::files;
use crate::frame::Renderer;
use crate::setup::{Lamp, Setup};
use crate::techniques;
use anyhow::{Context, Result, ensure};
use base64::Engine;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// Writes `index.html`, `report.toml` and the pictures of the extremes into a folder. The page holds everything itself.
/// The renderer must hold the scene of the records, which share one set-up but for technique and parameters.
///
/// # Errors
/// No records, records of several set-ups, or what the device or the file system says.
pub fn write(records: &[Record], title: &str, folder: &Path, renderer: &mut Renderer) -> Result<()> {
    let first = records.first().context("a report needs at least one measured row")?;
    let mut base = first.setup()?;
    base.view = "shaded".into();
    let mut kept = BTreeMap::new();
    for r in records {
        let setup = r.setup()?;
        ensure!(
            setup.around() == base.around(),
            "a report covers one set-up, but row {} differs from the first in more than technique and parameters",
            r.index
        );
        // The first value of what a sweep varies, and the only one of the rest.
        kept.entry(setup.technique.clone()).or_insert_with(|| setup.values().clone());
    }
    base.params = kept;
    let toml = folder.join("report.toml");
    let setup_text = base.to_toml(&toml)?;
    save(&toml, setup_text.as_bytes())?;

    let mut page = format!("<h1>{}</h1>\n", escape(title));
    page += &told(records, &base, &setup_text)?;
    page += &charts(records)?;
    page += &front(records);
    page += &table(records);
    page += &lights(records);
    page += &extremes(records, folder, renderer)?;
    let html = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" \
         content=\"width=device-width\">\n<title>{}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n{page}\
         <script>\n{SCRIPT}</script>\n</body>\n</html>\n",
        escape(title)
    );
    save(&folder.join("index.html"), html.as_bytes())
}

fn save(path: &Path, bytes: &[u8]) -> Result<()> {
    files::save(path, bytes)
}

/// What was measured and how, and the command that does it again.
fn told(records: &[Record], base: &Setup, setup_text: &str) -> Result<String> {
    let all = |f: &dyn Fn(&Record) -> String| {
        let found: BTreeSet<String> = records.iter().map(f).filter(|t| !t.is_empty()).collect();
        found.into_iter().collect::<Vec<_>>().join("; ")
    };
    let frames = records.iter().map(|r| r.frames);
    let (least, most) = (frames.clone().min().unwrap_or(0), frames.max().unwrap_or(0));
    let software = records.iter().any(|r| r.software);
    let clock = match records.iter().any(|r| r.wall_clock) {
        true => "wall clock, each pass submitted alone and waited for",
        false => "GPU timestamps of each pass",
    };
    let taking_turns = "configurations take turns, warm-up is left out, the median counts";
    // In the file's own coordinates.
    let written = toml::Table::try_from(base).context("the set-up cannot be written as TOML")?;
    let table = |key: &str| written.get(key).map_or(Ok(String::new()), toml::to_string).map(|text| one_line(&text));
    let mut rows = vec![
        ("Scene", base.scene.clone()),
        ("Picture", format!("{} × {} pixels", base.size[0], base.size[1])),
        ("Configurations", format!("{} of {}", records.len(), ids(records).join(", "))),
        ("Camera", table("camera").context("the camera cannot be written as TOML")?),
        ("Light", table("light").context("the light cannot be written as TOML")?),
        ("Lights", lamps(base)),
        ("Clock", format!("{} s, animation {}, seed {}", base.time, base.animation, base.seed)),
        ("Adapter", all(&|r| r.adapter.clone())),
        ("Driver", all(&|r| r.driver.clone())),
        ("Times", format!("{clock}; {taking_turns}; {least} to {most} frames counted")),
        (
            "Errors",
            format!(
                "counts against one exact shadow ray per pixel, RMSE, MAE and FLIP against the mean of {}; over the pixels \
                 that face the light within its cone and range",
                all(&|r| r.truth_samples.to_string())
            ),
        ),
        ("Notes", all(&|r| r.notes.clone())),
    ];
    rows.retain(|r| !r.1.is_empty());
    let mut out = String::from("<h2>What was measured</h2>\n");
    if software {
        out += "<p class=\"warning\">The adapter is software: compare its times as ratios only. They say nothing of a \
                GPU.</p>\n";
    }
    out += "<table class=\"facts\">\n";
    for (name, value) in rows {
        out += &format!("<tr><th>{name}</th><td>{}</td></tr>\n", escape(&value));
    }
    let (command, more) = command(records, base)?;
    out += &format!("</table>\n<p>To do it again, in this page's folder:</p>\n<pre>{}</pre>\n", escape(&command));
    if records.iter().any(|r| r.flicker.is_some()) {
        out += "<p>Flicker was measured too: add <code>--flicker</code>.</p>\n";
    }
    if more != records.len() {
        out += &format!(
            "<p>These rows are not every combination of their values: the command measures {more} configurations.</p>\n"
        );
    }
    out += &format!("<details><summary>report.toml</summary><pre>{}</pre></details>\n", escape(setup_text));
    Ok(out)
}

/// The lights of a set-up that has several, in words.
fn lamps(base: &Setup) -> String {
    if base.light_count() == 1 {
        return String::new();
    }
    let off = |on: bool| if on { "" } else { ", off" };
    let one = |(i, lamp): (usize, &Lamp)| format!("{} {}{}", i + 1, lamp.light.kind(), off(lamp.on));
    let all: Vec<String> = base.lamps().iter().enumerate().map(one).collect();
    format!("{}; the table further down has the figures of each", all.join("; "))
}

/// The rows' figures light by light; nothing where there is one light.
fn lights(records: &[Record]) -> String {
    let lines = per_light(records);
    let [names, lines @ ..] = &lines[..] else { return String::new() };
    if lines.is_empty() {
        return String::new();
    }
    let row = |tag: &str, cells: &[String]| {
        let cell = |(i, text): (usize, &String)| {
            format!("<{tag}{}>{}</{tag}>", if i < 2 { " class=\"t\"" } else { "" }, escape(text))
        };
        format!("<tr>{}</tr>\n", cells.iter().enumerate().map(cell).collect::<String>())
    };
    let body: String = lines.iter().map(|line| row("td", line)).collect();
    format!(
        "<h2>Light by light</h2>\n<p>In the order of the rows above. Errors of all lights together are over the pixels of each \
         that can be wrong; times and memory are sums, but for the medians of times.</p>\n<div \
         class=\"wide\"><table>\n<thead>{}</thead>\n<tbody>\n{body}</tbody></table></div>\n",
        row("th", names)
    )
}

fn one_line(toml: &str) -> String {
    toml.trim().replace('\n', ", ").replace('"', "")
}

/// The techniques, in the order of their first rows.
fn ids(records: &[Record]) -> Vec<String> {
    let mut out: Vec<String> = Vec::new();
    for r in records {
        if !out.contains(&r.technique) {
            out.push(r.technique.clone());
        }
    }
    out
}

/// The values of each technique's parameters that vary, in the order of their rows.
fn varying(records: &[Record]) -> BTreeMap<(&str, &str), Vec<&str>> {
    let mut out: BTreeMap<(&str, &str), Vec<&str>> = BTreeMap::new();
    for r in records {
        for (name, value) in r.values() {
            let all = out.entry((&r.technique, name)).or_default();
            if !all.contains(&value) {
                all.push(value);
            }
        }
    }
    out.retain(|_, values| values.len() > 1);
    out
}

/// The sweep that measures these rows, and how many it measures.
fn command(records: &[Record], base: &Setup) -> Result<(String, usize)> {
    let techniques = ids(records);
    let mut text = format!("shadowscope sweep report.toml --techniques {}", techniques.join(","));
    let mut axes = Vec::new();
    for ((technique, name), values) in varying(records) {
        let set = format!("{technique}.{name}={}", values.join(","));
        text += &format!(" \\\n  --set {set}");
        axes.push(Axis::parse(&set)?);
    }
    let there = expand(base, &techniques, &axes, false)?;
    let config = |technique: &str, params: &str| (technique.to_string(), params.to_string());
    let wanted: BTreeSet<_> = records.iter().map(|r| config(&r.technique, &r.params)).collect();
    let swept: BTreeSet<_> = there.iter().map(|s| config(&s.technique, &params_text(s))).collect();
    ensure!(wanted.is_subset(&swept), "the rows' parameters are not those of their set-ups");
    // The same configuration measured twice is no more of the sweep.
    let again = records.len() - wanted.len();
    Ok((text + " \\\n  -o results.csv --report .", there.len() + again))
}

fn charts(records: &[Record]) -> Result<String> {
    let find = |axes: &'static [chart::Axis], id: &str| axes.iter().find(|a| a.id == id);
    let mut out = String::from("<h2>Error against cost</h2>\n<div class=\"charts\">\n");
    let time = if records.iter().any(|r| r.cost.is_some()) { "cost" } else { "gpu_ms" };
    let mut shown = vec![(time, "error_share"), ("gpu_ms", "error_share"), (time, "rmse"), (time, "flip")];
    shown.dedup();
    for (x, y) in shown {
        let (Some(x), Some(y)) = (find(COSTS, x), find(ERRORS, y)) else { continue };
        if records.iter().any(|r| chart::point(r, x, y).is_some()) {
            let svg = chart::svg(records, x, y, "")?;
            // The XML line at its start is for files only.
            let svg = svg.split_once("?>").map_or(svg.as_str(), |s| s.1);
            out += &format!(
                "<figure>{}<figcaption>{} {}</figcaption></figure>\n",
                svg.trim(),
                escape(y.doc),
                escape(x.doc)
            );
        }
    }
    Ok(out + "</div>\n")
}

/// A row's name: its technique and what varies.
fn name(r: &Record, varying: &BTreeMap<(&str, &str), Vec<&str>>) -> String {
    let own = r.values().into_iter().filter(|(n, _)| varying.contains_key(&(r.technique.as_str(), *n)));
    own.fold(r.technique.clone(), |out, (n, v)| out + &format!(" {n}={v}"))
}

/// The columns that some row has a value for.
fn columns(records: &[Record]) -> Vec<&'static Column> {
    COLUMNS.iter().filter(|c| records.iter().any(|r| (c.get)(r).is_some())).collect()
}

fn cells(r: &Record, columns: &[&Column]) -> String {
    let cell = |c: &&Column| match (c.get)(r) {
        Some(v) => format!("<td data-v=\"{v}\">{v:.*}</td>", c.digits),
        None => "<td>–</td>".into(),
    };
    columns.iter().map(cell).collect()
}

fn heads(columns: &[&Column]) -> String {
    columns.iter().map(|c| format!("<th title=\"{}\">{}</th>", c.doc, c.name)).collect()
}

/// The configurations that no other beats in both time and error.
fn front(records: &[Record]) -> String {
    let values: Vec<chart::Spot> = records.iter().map(|r| Advice::spot(r, r.error_share)).collect();
    let varying = varying(records);
    let shown: Vec<&Column> = columns(records)
        .into_iter()
        .filter(|c| {
            ["error_share", "rmse", "flip", "gpu_ms", "gpu_ms_q1", "gpu_ms_q3", "cost", "gpu_bytes"].contains(&c.id)
        })
        .collect();
    let mut out = format!(
        "<h2>The cheapest for each error</h2>\n<p>No other configuration is as fast and as accurate as one of \
         these: the Pareto front of time and error share, where times whose quartiles overlap count as equal.</p>\n<div class=\"wide\"><table>\n<thead><tr><th>#</th>\
         <th class=\"t\">configuration</th>{}</tr></thead>\n<tbody>\n",
        heads(&shown)
    );
    for i in chart::pareto(&values) {
        let r = &records[i];
        out += &format!(
            "<tr><td>{}</td><td class=\"t\">{}</td>{}</tr>\n",
            i + 1,
            escape(&name(r, &varying)),
            cells(r, &shown)
        );
    }
    out + "</tbody></table></div>\n"
}

/// All rows, with the neighbours in the order of time that cannot be told from them.
fn table(records: &[Record]) -> String {
    let mut order: Vec<usize> = (0..records.len()).collect();
    order.sort_by(|a, b| Advice::cost(&records[*a]).total_cmp(&Advice::cost(&records[*b])).then(a.cmp(b)));
    let mut ties: Vec<Vec<String>> = vec![Vec::new(); records.len()];
    for pair in order.windows(2) {
        if tied(&records[pair[0]], &records[pair[1]]) {
            ties[pair[0]].push((pair[1] + 1).to_string());
            ties[pair[1]].insert(0, (pair[0] + 1).to_string());
        }
    }
    let shown = columns(records);
    let varying = varying(records);
    let mut out = format!(
        "<h2>All rows</h2>\n<p>A click on a heading sorts by it. \u{201c}Tied\u{201d} names the next faster and next \
         slower rows whose times these frames cannot tell from the row's own.</p>\n<div class=\"wide\"><table \
         class=\"sortable\">\n<thead><tr><th>#</th><th class=\"t\">technique</th><th class=\"t\">parameters</th>{}<th>tied</th></tr></thead>\n\
         <tbody>\n",
        heads(&shown)
    );
    for (i, r) in records.iter().enumerate() {
        let name = name(r, &varying);
        let params = name.strip_prefix(&r.technique).unwrap_or_default().trim();
        out += &format!(
            "<tr><td data-v=\"{0}\">{0}</td><td class=\"t\">{1}</td><td class=\"t\">{2}</td>{3}<td>{4}</td></tr>\n",
            i + 1,
            escape(&r.technique),
            escape(params),
            cells(r, &shown),
            ties[i].iter().map(|n| format!("#{n}")).collect::<Vec<_>>().join(", ")
        );
    }
    out += "</tbody></table></div>\n<p>The same in every row:</p>\n<ul>\n";
    for id in ids(records) {
        let fixed = records.iter().find(|r| r.technique == id).map(|r| r.values()).unwrap_or_default();
        let fixed: Vec<String> = fixed
            .iter()
            .filter(|(n, _)| !varying.contains_key(&(id.as_str(), *n)))
            .map(|(n, v)| format!("{n}={v}"))
            .collect();
        let title = techniques::find(&id).map_or(id.as_str(), |t| t.title);
        out += &format!("<li><b>{}</b> ({}): {}</li>\n", escape(&id), escape(title), escape(&fixed.join(", ")));
    }
    out + "</ul>\n"
}

/// Pictures of the most and least accurate, the cheapest and the dearest.
fn extremes(records: &[Record], folder: &Path, renderer: &mut Renderer) -> Result<String> {
    let by = |key: fn(&Record) -> [f64; 2]| {
        let compare = move |a: &&(usize, &Record), b: &&(usize, &Record)| {
            let (x, y) = (key(a.1), key(b.1));
            x[0].total_cmp(&y[0]).then(x[1].total_cmp(&y[1])).then(a.0.cmp(&b.0))
        };
        let rows: Vec<(usize, &Record)> = records.iter().enumerate().collect();
        rows.iter().min_by(compare).map(|(i, _)| *i)
    };
    let mut chosen: Vec<(usize, Vec<&str>)> = Vec::new();
    for (role, row) in [
        ("most accurate", by(|r| [r.error_share, Advice::cost(r)])),
        ("least accurate", by(|r| [-r.error_share, Advice::cost(r)])),
        ("cheapest", by(|r| [Advice::cost(r), r.error_share])),
        ("dearest", by(|r| [-Advice::cost(r), r.error_share])),
    ] {
        let Some(row) = row else { continue };
        match chosen.iter_mut().find(|(i, _)| *i == row) {
            Some((_, roles)) => roles.push(role),
            None => chosen.push((row, vec![role])),
        }
    }
    let varying = varying(records);
    let mut out = String::from(
        "<h2>The extremes</h2>\n<p>Left the shaded picture, right its errors: blue is light where shadow should be, red \
         is shadow where light should be. The same pictures lie in this page's folder with their set-up inside: \
         <code>shadowscope FILE.png</code> opens it.</p>\n",
    );
    for (i, roles) in chosen {
        let r = &records[i];
        let mut setup = r.setup()?;
        let mut pictures = String::new();
        for view in ["shaded", "error"] {
            setup.view = view.into();
            let file = format!("{}-{}-{view}.png", r.technique, i + 1);
            let path = folder.join(&file);
            capture::capture(renderer, &setup, &path)?;
            let bytes =
                files::read(&path, files::MOST_DATA).with_context(|| format!("{} cannot be read", path.display()))?;
            let data = base64::engine::general_purpose::STANDARD.encode(bytes);
            let (file, said) = (escape(&file), format!("{}, {view}", escape(&name(r, &varying))));
            pictures += &format!("<img src=\"data:image/png;base64,{data}\" alt=\"{said}\" title=\"{file}\">");
        }
        out += &format!(
            "<figure class=\"pair\"><figcaption><b>{}</b>: #{} {}; {:.4} % wrong, {:.3} ms</figcaption>\
             <div>{pictures}</div></figure>\n",
            sentence(&roles.join(" and ")),
            i + 1,
            escape(&name(r, &varying)),
            100.0 * r.error_share,
            r.gpu_ms
        );
    }
    if records.iter().any(|r| r.adapter != renderer.gpu.info.name) {
        let name = escape(&renderer.gpu.info.name);
        out += &format!("<p>Drawn on another adapter than measured: {name}.</p>\n");
    }
    Ok(out)
}

fn sentence(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |c| c.to_uppercase().collect::<String>() + letters.as_str())
}

const STYLE: &str = "\
:root { color-scheme: light dark; --line: #d4d6da; --weak: #5d6470; --warn: #8a4b00; --shade: #f4f5f7; }
@media (prefers-color-scheme: dark) {
  :root { --line: #3c4048; --weak: #a3aab6; --warn: #ffb65c; --shade: #23262b; }
  body { background: #17191c; color: #e6e8eb; }
}
body { font: 15px/1.5 system-ui, sans-serif; max-width: 1180px; margin: 2rem auto; padding: 0 1.2rem; }
h1 { font-size: 1.6rem; margin-bottom: .4rem; }
h2 { font-size: 1.15rem; margin: 2.2rem 0 .6rem; }
table { border-collapse: collapse; font-size: 12.5px; font-variant-numeric: tabular-nums; }
th, td { padding: .22rem .45rem; border-bottom: 1px solid var(--line); text-align: right; white-space: nowrap; }
th { color: var(--weak); font-weight: 600; }
td.t, th.t { text-align: left; }
.facts th { text-align: left; vertical-align: top; }
.facts td { text-align: left; white-space: normal; }
.wide { overflow-x: auto; }
.sortable th { cursor: pointer; }
.sortable tbody tr:hover { background: var(--shade); }
.warning { color: var(--warn); font-weight: 600; }
pre { background: var(--shade); padding: .7rem .9rem; overflow-x: auto; font-size: 13px; }
summary { cursor: pointer; color: var(--weak); }
figure { margin: 0; break-inside: avoid; }
figcaption { color: var(--weak); font-size: 13px; margin: .3rem 0; }
.charts { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(440px, 100%), 1fr)); gap: 1.4rem; }
.charts svg { width: 100%; height: auto; border-radius: 4px; }
.pair { margin-bottom: 1.4rem; }
.pair div { display: flex; gap: .6rem; }
.pair img { width: 50%; height: auto; min-width: 0; }
@media print {
  :root { color-scheme: light; --line: #bbb; --weak: #444; --warn: #8a4b00; --shade: #f4f5f7; }
  body { font-size: 10pt; max-width: none; margin: 0; background: none; color: #000; }
  .charts { grid-template-columns: 1fr 1fr; }
  figcaption { font-size: 8pt; }
  table { font-size: 6.5pt; }
  .facts { font-size: 8pt; }
  th, td { padding: .1rem .15rem; white-space: normal; }
  .wide { overflow: visible; }
}
";

/// Sorts a table by the column whose heading is clicked; a second click turns the order around.
const SCRIPT: &str = "\
for (const table of document.querySelectorAll('table.sortable')) {
  table.querySelectorAll('th').forEach((head, column) => head.addEventListener('click', () => {
    const body = table.tBodies[0];
    const up = head.dataset.up !== 'true';
    head.dataset.up = up;
    const key = row => {
      const cell = row.cells[column];
      return cell.dataset.v === undefined ? cell.textContent : Number(cell.dataset.v);
    };
    const compare = (a, b) => typeof a === typeof b && typeof a === 'number' ? a - b : String(a).localeCompare(b, 'en', { numeric: true });
    const rows = [...body.rows].sort((a, b) => compare(key(a), key(b)) * (up ? 1 : -1));
    body.append(...rows);
  }));
}
";
