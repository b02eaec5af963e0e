//! `table` and `tables`: measured tables as Markdown, and those of a page refreshed where they stand.

use super::{Cli, Command, chosen, interrupt, print, progress, show};
use crate::files;
use crate::frame::Renderer;
use crate::gpu::Gpu;
use crate::measure::{self, Column, Record, Step, table};
use crate::message::tell;
use crate::setup::Setup;
use crate::{scene::Scene, techniques};
use anyhow::{Context, Result, bail, ensure};
use clap::Parser;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{SystemTime, UNIX_EPOCH};

/// What a table holds.
#[derive(clap::Args)]
pub struct Wanted {
    #[command(flatten)]
    wanted: super::Wanted,
    /// The rows, separated by commas: TECHNIQUE or TECHNIQUE:key=value;….
    #[arg(long, value_delimiter = ',', required = true, value_name = "ROW,…")]
    rows: Vec<String>,
    /// The columns, separated by commas, by their names in a file of results: rmse, beyond_tolerance, ratio, ….
    #[arg(long, value_delimiter = ',', required = true, value_name = "NAME,…")]
    columns: Vec<String>,
}

/// A table that can be measured: all that can be refused is.
struct Table {
    setup: Setup,
    scene: Scene,
    /// What each row says of itself, and its set-up.
    rows: Vec<(String, Setup)>,
    columns: Vec<&'static Column>,
}

/// Prints a table.
pub fn table(wanted: &Wanted, adapter: Option<&str>) -> Result<()> {
    let table = wanted.open()?;
    let gpu = Arc::new(interrupt::device(adapter)?);
    table.suits(&gpu)?;
    let bar = progress();
    let text = table.measure(gpu, &mut |done, what| show(&bar, done, what));
    bar.finish_and_clear();
    print(&text?)
}

/// Measures the tables of pages again and writes each page once all of its tables are there.
pub fn refresh(pages: &[PathBuf], adapter: Option<&str>) -> Result<()> {
    let mut work = Vec::new();
    for (_, path) in pages.iter().enumerate().filter(|(i, path)| !pages[..*i].contains(path)) {
        let name = path.display();
        let text = read(path)?;
        let places = places(&text).with_context(|| name.to_string())?;
        ensure!(
            !places.is_empty(),
            "{name} has no table to refresh: none of its lines starts with <!-- shadowscope table SETUP"
        );
        let mut tables = Vec::new();
        for place in places {
            let at = format!("{name}, line {}", place.line);
            let table = place.table().with_context(|| at.clone())?;
            tables.push((at, place.old, table));
        }
        work.push((path, text, tables));
    }
    let gpu = Arc::new(interrupt::device(adapter)?);
    for (at, _, table) in work.iter().flat_map(|(_, _, tables)| tables) {
        table.suits(&gpu).with_context(|| at.clone())?;
    }
    let (pages, mut written) = (work.len(), 0);
    let total = work.iter().map(|(_, _, tables)| tables.len()).sum::<usize>() as f32;
    let bar = progress();
    let mut done = 0.0;
    for (path, text, tables) in work {
        let mut out = String::new();
        let mut from = 0;
        for (at, old, table) in tables {
            let tick = &mut |share, what: String| show(&bar, (done + share) / total, format!("{at}: {what}"));
            let measured = table.measure(gpu.clone(), tick);
            if measured.is_err() {
                bar.finish_and_clear();
            }
            let measured = interrupt::kept(measured, || format!("{written} of {pages} pages are written"));
            let measured = measured.with_context(|| at.clone())?;
            out += &text[from..old.start];
            if !out.ends_with('\n') {
                out.push('\n');
            }
            out += &measured;
            from = old.end;
            if !text[from..].is_empty() && !text[from..].starts_with(['\n', '\r']) {
                out.push('\n');
            }
            done += 1.0;
        }
        out += &text[from..];
        ensure!(
            read(path)? == text,
            "{} was changed while its tables were measured, and is left as it is",
            path.display()
        );
        files::save(path, out.as_bytes())?;
        written += 1;
        bar.suspend(|| tell!("wrote {}", path.display()));
    }
    bar.finish_and_clear();
    Ok(())
}

fn read(page: &Path) -> Result<String> {
    files::read_text(page)
}

/// A table in a page.
struct Place {
    /// The line that its comment starts in, from 1.
    line: usize,
    /// The command in it.
    command: String,
    /// What the command wrote last, in the page's bytes; empty if nothing.
    old: Range<usize>,
}

/// Seeds over which a table's noise and bias are told apart.
const SEEDS: u32 = 8;

/// How a comment starts that holds a table's command.
const START: &str = "<!-- shadowscope table ";
/// How the line below a table starts.
const MEASURED: &str = "Measured on ";

/// The tables of a page; what stands in fenced code is none.
fn places(text: &str) -> Result<Vec<Place>> {
    let mut out = Vec::new();
    let mut fenced = false;
    let mut at = 0;
    let mut line = 0;
    while at < text.len() {
        line += 1;
        let end = line_end(text, at);
        let this = text[at..end].trim_start();
        fenced ^= this.starts_with("```");
        if fenced || !this.starts_with(START) {
            at = end;
            continue;
        }
        let inside = &text[at..][text[at..].find(START).unwrap_or(0) + "<!-- ".len()..];
        let (command, _) = inside.split_once("-->").with_context(|| format!("line {line}: the comment has no end"))?;
        let close = text.len() - inside.len() + command.len() + "-->".len();
        let start = line_end(text, close);
        ensure!(text[close..start].trim().is_empty(), "line {line}: something stands behind the comment of a table");
        let old = start..old_end(text, start);
        let next = old.end.max(start);
        out.push(Place { line, command: command.trim().into(), old });
        line += text[at..next].lines().count().saturating_sub(1);
        at = next;
    }
    Ok(out)
}

/// Where the line that a place is in ends, behind its line break.
fn line_end(text: &str, at: usize) -> usize {
    text[at..].find('\n').map_or(text.len(), |n| at + n + 1)
}

/// Where what a table's command wrote ends: the table, and the paragraph on how it was measured.
fn old_end(text: &str, start: usize) -> usize {
    let run = |mut at: usize, belongs: &dyn Fn(&str) -> bool| {
        while at < text.len() && belongs(text[at..line_end(text, at)].trim()) {
            at = line_end(text, at);
        }
        at
    };
    let blank = |line: &str| line.is_empty();
    let below = run(start, &blank);
    let table = run(below, &|line| line.starts_with('|'));
    if table == below {
        return start;
    }
    let below = run(table, &blank);
    match text[below..].starts_with(MEASURED) {
        true => run(below, &|line| !line.is_empty()),
        false => table,
    }
}

impl Place {
    fn table(&self) -> Result<Table> {
        // A line that goes on, as a shell has it.
        let command = self.command.replace('\r', "").replace("\\\n", " ");
        let words = shlex::split(&command).context("a quotation mark in the command has no partner")?;
        let cli = Cli::try_parse_from(words).map_err(|error| {
            // Its first paragraph in one line; the rest is the usage.
            let text = error.to_string();
            let told: Vec<&str> = text.lines().take_while(|l| !l.is_empty()).map(str::trim).collect();
            anyhow::anyhow!(told.join(" ").trim_start_matches("error: ").to_string())
        })?;
        ensure!(cli.adapter.is_none(), "a table's command names no adapter; give it to `shadowscope tables`");
        match cli.command {
            Some(Command::Table(wanted)) => wanted.open(),
            _ => bail!("the comment holds no `shadowscope table`"),
        }
    }
}

impl Wanted {
    fn open(&self) -> Result<Table> {
        let columns = self.columns.iter().map(|id| Column::find(id.trim())).collect::<Result<_>>()?;
        let rows: Vec<(&str, &str)> =
            self.rows.iter().map(|r| r.trim().split_once(':').unwrap_or((r.trim(), ""))).collect();
        let ids: Vec<String> = rows.iter().map(|r| r.0.to_string()).collect();
        let ids = super::named(&ids);
        for id in &ids {
            techniques::find_or_say(id)?;
        }
        let (mut setup, scene) = self.wanted.open(&ids)?;
        setup.view = "shaded".into();
        for id in &ids {
            setup.select(id)?;
        }
        self.wanted.apply(&mut setup, &scene, &ids)?;
        chosen(&ids, &setup)?;
        let rows = rows.into_iter().map(|(id, values)| row(&setup, id, values)).collect::<Result<_>>()?;
        Ok(Table { setup, scene, rows, columns })
    }
}

/// A row's name, and the set-up with its technique and values.
fn row(setup: &Setup, id: &str, values: &str) -> Result<(String, Setup)> {
    let mut setup = setup.clone();
    setup.select(id)?;
    let info = techniques::find_or_say(id)?;
    let mut name = format!("`{id}`");
    let mut written = Vec::new();
    for assignment in values.split(';').filter(|a| !a.is_empty()) {
        let Some((key, text)) = assignment.split_once('=').map(|(k, v)| (k.trim(), v.trim())) else {
            bail!("row {id}:{values}: write {assignment} as key=value");
        };
        let Some(spec) = info.specs().find(|s| s.name == key) else {
            let names: Vec<&str> = info.specs().map(|s| s.name).collect();
            bail!("row {id}:{values}: {id} has no parameter {key}; there are {}", names.join(", "));
        };
        let value = spec.parse(&format!("{id}.{key}"), text)?;
        setup.params.entry(id.into()).or_default().insert(key.into(), value);
        name += &format!(", `{key} = {text}`");
        written.push(key);
    }
    let meaningful = setup.meaningful();
    for key in written {
        ensure!(meaningful.contains_key(key), "row {id}:{values}: {key} means nothing beside the other parameters");
    }
    setup.check()?;
    Ok((name, setup))
}

impl Table {
    /// Refuses times that say nothing.
    fn suits(&self, gpu: &Gpu) -> Result<()> {
        match self.columns.iter().find(|c| c.is_time() && gpu.software()) {
            Some(c) => bail!(
                "{}: {} is software, whose times say nothing of a GPU's; take ratio or cost in its place",
                c.id,
                gpu.info.name
            ),
            None => Ok(()),
        }
    }

    /// The Markdown, and below it how it was measured.
    fn measure(self, gpu: Arc<Gpu>, tick: &mut dyn FnMut(f32, String)) -> Result<String> {
        let (names, setups): (Vec<String>, Vec<Setup>) = self.rows.into_iter().unzip();
        let work: Vec<(u64, Setup)> = (0..).zip(setups).collect();
        let asks = |ids: &[&str]| self.columns.iter().any(|c| ids.contains(&c.id));
        let seeds = if asks(&["seed_noise", "seed_bias"]) { SEEDS } else { 0 };
        let temporal = asks(&["settle_frames", "settle_rmse", "lag_frames"]);
        let more = measure::More { flicker: asks(&["flicker", "label_flicker"]), seeds, temporal };
        let mut renderer = Renderer::new(gpu, Arc::new(self.scene))?;
        let mut records: Vec<Record> = Vec::new();
        let mut failed = Vec::new();
        measure::run(&mut renderer, &self.setup, &work, work.len() as u64, more, &mut |step| {
            match step {
                Step::Working(done, what) => tick(done, what),
                Step::Row(record) => records.push(*record),
                Step::Failed(why) => failed.push(why),
            }
            failed.is_empty() && !interrupt::asked()
        })
        .map_err(|e| failed.pop().unwrap_or(e))?;
        let mut lines = vec![vec![String::new()]];
        lines[0].extend(self.columns.iter().map(|c| c.name.to_string()));
        for (name, record) in names.into_iter().zip(&records) {
            let mut line = vec![name];
            line.extend(self.columns.iter().map(|c| c.rounded(record)));
            lines.push(line);
        }
        let first = records.first().context("a table needs at least one row")?;
        Ok(format!(
            "{}\n{MEASURED}{}{}, {}: `{}`, {} × {} pixels, averaged truth of {}.\n",
            table::markdown(&lines),
            first.adapter,
            match first.software {
                true if self.columns.iter().any(|c| c.is_multiple()) => " (software: of times only ratios count)",
                true => " (software)",
                false => "",
            },
            today(),
            first.scene,
            first.width,
            first.height,
            match first.truth_samples {
                1 => "one sample per pixel".into(),
                n => format!("{n} samples per pixel"),
            }
        ))
    }
}

/// The date, in universal time.
fn today() -> String {
    const MONTHS: [&str; 12] = [
        "January",
        "February",
        "March",
        "April",
        "May",
        "June",
        "July",
        "August",
        "September",
        "October",
        "November",
        "December",
    ];
    let days = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |d| d.as_secs() / 86400);
    let [year, month, day] = date(days);
    format!("{day} {} {year}", MONTHS[month as usize - 1])
}

/// Year, month and day of a day since 1 January 1970.
fn date(mut days: u64) -> [u64; 3] {
    let leap = |y: u64| (y.is_multiple_of(4) && !y.is_multiple_of(100)) || y.is_multiple_of(400);
    let mut year = 1970;
    while days >= 365 + leap(year) as u64 {
        days -= 365 + leap(year) as u64;
        year += 1;
    }
    let lengths = [31, 28 + leap(year) as u64, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31];
    let mut month = 0;
    while days >= lengths[month] {
        days -= lengths[month];
        month += 1;
    }
    [year, month as u64 + 1, days + 1]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates() {
        assert_eq!(date(0), [1970, 1, 1]);
        assert_eq!(date(11_016), [2000, 2, 29]);
        assert_eq!(date(11_017), [2000, 3, 1]);
        assert_eq!(date(20_453), [2025, 12, 31]);
        assert_eq!(date(20_454), [2026, 1, 1]);
    }

    /// No page names a technique, a parameter, a value or a column that is no longer there.
    #[test]
    fn the_tables_of_the_docs_can_be_measured() {
        let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs");
        let mut found = 0;
        for folder in [docs.clone(), docs.join("techniques")] {
            for file in std::fs::read_dir(folder).unwrap().map(|f| f.unwrap().path()) {
                if file.extension().is_some_and(|e| e == "md") {
                    let text = read(&file).unwrap();
                    for place in places(&text).unwrap() {
                        place.table().unwrap_or_else(|e| panic!("{}, line {}: {e:#}", file.display(), place.line));
                        assert!(!place.old.is_empty(), "{}, line {}: not measured", file.display(), place.line);
                        found += 1;
                    }
                }
            }
        }
        assert!(found >= 8, "{found}");
    }

    #[test]
    fn a_page_keeps_what_no_command_wrote() {
        let page = "a\n<!-- shadowscope table x \\\n  --y 'z w' -->\n\n| |\n|---|\n\nMeasured on b,\nc.\n\nd\n\
                    ```md\n<!-- shadowscope table in code -->\n| kept |\n```\n\
                    <!-- shadowscope table e -->\nno table yet\n| kept |\n<!-- shadowscope table f -->\n| old |\n";
        let found = places(page).unwrap();
        let told: Vec<(usize, &str, &str)> =
            found.iter().map(|p| (p.line, p.command.as_str(), &page[p.old.clone()])).collect();
        assert_eq!(
            told,
            [
                (2, "shadowscope table x \\\n  --y 'z w'", "\n| |\n|---|\n\nMeasured on b,\nc.\n"),
                (16, "shadowscope table e", ""),
                (19, "shadowscope table f", "| old |\n"),
            ]
        );
        assert!(places("<!-- shadowscope table x").is_err());
        assert!(places("<!-- shadowscope table x --> y\n").is_err());
    }
}
