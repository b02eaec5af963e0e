//! Advice: the cheapest configuration that meets an error budget, over techniques and their main parameters.

use super::search::{Line, Sample, Search, Wanted};
use super::{Axis, Record, Step, accuracy, space, stability, sweep};
use crate::chart;
use crate::frame::Renderer;
use crate::params::Values;
use crate::setup::Setup;
use crate::techniques;
use anyhow::{Context, Result, bail, ensure};

/// What an error is counted in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// 0 to 1, written in per cent.
    Share,
    Plain,
    Pixels,
}

/// An error that a budget can be given in.
#[derive(Debug, PartialEq)]
pub struct Figure {
    /// As it is asked for.
    pub id: &'static str,
    /// In a sentence.
    pub title: &'static str,
    /// The record's field, one of [`chart::ERRORS`].
    pub field: &'static str,
    pub unit: Unit,
    /// A budget to begin with.
    pub usual: f64,
}

const fn figure(id: &'static str, title: &'static str, field: &'static str, unit: Unit, usual: f64) -> Figure {
    Figure { id, title, field, unit, usual }
}

/// The errors that a budget can be given in.
pub const FIGURES: &[Figure] = &[
    figure("error", "wrong pixels", "error_share", Unit::Share, 0.005),
    figure("rmse", "RMSE", "rmse", Unit::Plain, 0.05),
    figure("mae", "MAE", "mae", Unit::Plain, 0.01),
    figure("flip", "FLIP", "flip", Unit::Plain, 0.02),
    figure("jod", "loss of JOD", "jod", Unit::Plain, 0.2),
    figure("penumbra-rmse", "RMSE in the penumbra", "rmse_penumbra", Unit::Plain, 0.05),
    figure("penumbra", "penumbra's width", "penumbra_off_px", Unit::Pixels, 2.0),
    figure("boundary", "boundary error", "boundary_p95_px", Unit::Pixels, 2.0),
    figure("flicker", "flicker", "flicker", Unit::Share, 0.005),
];

impl Figure {
    /// The error of this name.
    ///
    /// # Errors
    /// There is none.
    pub fn find(id: &str) -> Result<&'static Figure> {
        let ids: Vec<&str> = FIGURES.iter().map(|f| f.id).collect();
        let found = FIGURES.iter().find(|f| f.id == id);
        found.with_context(|| format!("--by {id}: there is no such error; there are {}", ids.join(", ")))
    }

    /// The error that judges these techniques fairly: the share of wrong pixels where all of them say lit or dark, the
    /// RMSE where one filters, since a soft edge is no wrong pixel.
    pub fn suited(techniques: &[String]) -> &'static Figure {
        let filters = |id: &String| techniques::find(id).is_some_and(|info| info.filters(&Default::default()));
        &FIGURES[techniques.iter().any(filters) as usize]
    }

    /// Its value in a row; None where it does not apply or was not measured.
    pub fn of(&self, row: &Record) -> Option<f64> {
        chart::ERRORS.iter().find(|a| a.id == self.field).and_then(|a| (a.get)(row))
    }

    /// A value with its unit.
    pub fn value(&self, x: f64) -> String {
        match self.unit {
            Unit::Share => format!("{:.4} %", x * 100.0),
            Unit::Plain => format!("{x:.5}"),
            Unit::Pixels => format!("{x:.2} px"),
        }
    }

    /// Reads a value: `0.5%` or `0.005` of a share, a number of the others.
    ///
    /// # Errors
    /// No number, one that the figure does not take, or a unit that is not its own.
    pub fn parse(&self, text: &str) -> Result<f64> {
        let (title, trimmed) = (self.title, text.trim());
        let said = match self.unit {
            Unit::Share => format!("--max-error {text}: {title} is given as a share; write it as 0.5% or 0.005"),
            Unit::Plain => format!("--max-error {text}: {title} is not a share; write a number such as {}", self.usual),
            Unit::Pixels => format!("--max-error {text}: {title} is a distance in pixels; write it as 2 or 2px"),
        };
        let said = if self.unit == Unit::Share { said } else { said + ", or choose another error with --by" };
        let (number, scale) = match (self.unit, trimmed.strip_suffix('%'), trimmed.strip_suffix("px")) {
            (Unit::Share, Some(n), _) => (n, 0.01),
            (Unit::Pixels, _, Some(n)) => (n, 1.0),
            _ => (trimmed, 1.0),
        };
        let value = number.trim().parse::<f64>().ok().context(said)? * scale;
        let most = if self.unit == Unit::Pixels { f64::MAX } else { 1.0 };
        ensure!(
            (0.0..=most).contains(&value),
            match self.unit {
                Unit::Share => format!("--max-error {text}: it takes 0 to 100 %; two per cent are 2% or 0.02"),
                Unit::Plain => format!("--max-error {text}: {title} takes 0 to 1"),
                Unit::Pixels => format!("--max-error {text}: it takes a number of pixels from 0 on"),
            }
        );
        Ok(value)
    }
}

/// What is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Budget {
    pub by: &'static Figure,
    /// The largest error, a share 0 to 1.
    pub max_error: f64,
    /// Time as a multiple of that of the set-up's own plain map ([`base`]).
    pub max_ratio: Option<f64>,
}

/// What was found.
#[derive(Clone, Debug, Default)]
pub struct Advice {
    /// The cheapest that meets the budget, as an index into `tried`.
    pub answer: Option<usize>,
    /// Others that meet it and whose quartiles of cost overlap with the answer's, the cheapest first: they may be cheaper.
    pub alike: Vec<usize>,
    /// Where nothing meets it: the closest miss.
    pub closest: Option<usize>,
    /// The cheapest found with at most half the answer's error, if any.
    pub halved: Option<usize>,
    /// The cheapest `shadow-map` (around a lamp `cube`) within the same error, at any cost, where the answer is another
    /// technique.
    pub plain: Option<usize>,
    /// What no other there beats, by ascending time; times whose quartiles overlap count as equal ([`chart::pareto`]).
    /// Indices into `tried`.
    pub frontier: Vec<usize>,
    /// All that was measured, in its order.
    pub tried: Vec<Record>,
    /// What could not be measured: why, each with its name.
    pub failed: Vec<String>,
    /// The plain map that times are multiples of, and its main parameters; None where none serves the light.
    pub base: Option<String>,
    /// Configurations there were to choose from, and how many of them could be measured at most.
    pub space: usize,
    pub limit: usize,
}

impl Advice {
    /// Time of a row as the search compares it: the multiple of the baseline's, milliseconds where there is none.
    pub fn cost(row: &Record) -> f64 {
        row.cost.unwrap_or(row.gpu_ms)
    }

    /// The middle half of a row's costs.
    pub fn quartiles(row: &Record) -> [f64; 2] {
        [row.gpu_ms_q1, row.gpu_ms_q3].map(|ms| ms * Advice::cost(row) / row.gpu_ms)
    }

    /// Where a row stands by this error.
    pub fn spot(row: &Record, error: f64) -> chart::Spot {
        chart::Spot { cost: Advice::cost(row), spread: Advice::quartiles(row), error }
    }

    /// Whether the two times cannot be told apart: their quartiles overlap.
    pub fn as_fast(a: &Record, b: &Record) -> bool {
        let [a, b] = [a, b].map(Advice::quartiles);
        a[0] <= b[1] && b[0] <= a[1]
    }

    /// The least and the greatest time, ms, that the plain map took which times are multiples of: it takes turns with
    /// each row anew, so that a machine which gets busy slows both alike. None where there is none.
    pub fn base_ms(&self) -> Option<[f64; 2]> {
        let all = || self.tried.iter().filter_map(Record::cost_base_ms);
        let ends = [all().fold(f64::INFINITY, f64::min), all().fold(f64::NEG_INFINITY, f64::max)];
        (ends[0] <= ends[1]).then_some(ends)
    }

    /// The cheapest measured by its median where it is not on the frontier, and what there beats it: as fast, within the
    /// spread, and no less exact.
    pub fn cheapest_beaten(&self, by: &Figure) -> Option<(usize, usize)> {
        let error = |i: usize| by.of(&self.tried[i]).unwrap_or(UNKNOWN);
        let cost = |i: &usize| Advice::cost(&self.tried[*i]);
        let cheapest = (0..self.tried.len()).min_by(|a, b| cost(a).total_cmp(&cost(b)))?;
        let beats =
            |i: &&usize| error(**i) <= error(cheapest) && Advice::as_fast(&self.tried[**i], &self.tried[cheapest]);
        let winner = self.frontier.iter().filter(|_| !self.frontier.contains(&cheapest)).find(beats)?;
        Some((cheapest, *winner))
    }

    /// How many times as much as the answer the plain map costs.
    pub fn plain_factor(&self) -> Option<f64> {
        let [answer, plain] = [self.answer?, self.plain?].map(|i| self.tried.get(i));
        Some(Advice::cost(plain?) / Advice::cost(answer?))
    }
}

/// What a row without the error asked for counts as: as more than any.
const UNKNOWN: f64 = 1e9;
/// At most this share of the configurations is measured (at least one of each technique, though, and what answers are
/// compared with; and all, where there are so few).
const SHARE: usize = 3;
const FEW: usize = 12;
/// How many plain maps, which answers are compared with, may be measured beyond the share.
const PLAIN_MORE: usize = 4;

/// Searches the techniques and their main parameters, those that `axes` name over the values given there. `watch` is told
/// of progress and of each row, and stops the work by saying no.
///
/// # Errors
/// A ratio asked for without a baseline, that no surface is seen twice where flicker is asked for, or that it was stopped.
pub fn advise(
    renderer: &mut Renderer,
    setup: &Setup,
    techniques: &[String],
    axes: &[Axis],
    budget: Budget,
    watch: &mut dyn FnMut(Step) -> bool,
) -> Result<Advice> {
    let anchor = sweep::baseline(setup, None)?.map(|(setup, _)| setup);
    ensure!(
        budget.max_ratio.is_none() || anchor.is_some(),
        "a largest ratio needs a plain map to compare with, and none serves {} light",
        setup.light.kind()
    );
    let by = budget.by;
    let (all, lines) = lines(setup, techniques, axes)?;
    let mut tried: Vec<(usize, Record)> = Vec::new();
    // Read while it is measured, and raised before the comparison.
    let most = std::cell::Cell::new((all.len() / SHARE).max(techniques.len()).max(all.len().min(FEW)));
    let mut search = Search::new(lines, most.get());
    let mut failed = Vec::new();
    // For all, and not for one that fails.
    let over = std::cell::Cell::new(false);
    let mut row_of = |i: usize, begun: f32| -> Result<Record> {
        let setup = &all[i];
        let what = format!("{} {}", setup.technique, brief(setup));
        let limit = most.get() as f32;
        let mut tell = |step| {
            over.set(!watch(step));
            !over.get()
        };
        ensure!(tell(Step::Working(begun, what.trim().into())), super::STOPPED);
        let mut row = accuracy(renderer, setup, i as u64)?;
        row.configurations = all.len() as u64;
        if by.id == "flicker" {
            let Some(change) = stability::flicker(renderer, setup)? else {
                over.set(true);
                bail!(
                    "as the camera moves no surface that faces the light is seen twice: there is no flicker to ask for"
                );
            };
            (row.flicker, row.label_flicker) = (Some(change.flicker), Some(change.label_flicker));
        }
        // Errors take about as long as times; how long is not known before.
        let mut go_on =
            |part: f32| tell(Step::Working(begun + (0.5 + 0.5 * part) / limit, format!("{}: times", what.trim())));
        ensure!(go_on(0.0), super::STOPPED);
        sweep::time_one(renderer, &mut row, setup, anchor.as_ref(), &mut go_on)?;
        ensure!(tell(Step::Row(Box::new(row.clone()))), super::STOPPED);
        Ok(row)
    };
    let mut measure = |i: usize| -> Result<Option<Sample>> {
        match row_of(i, (tried.len() + failed.len()) as f32 / most.get() as f32) {
            Ok(row) => {
                let sample = Sample { error: by.of(&row).unwrap_or(UNKNOWN), cost: Advice::cost(&row) };
                tried.push((i, row));
                Ok(Some(sample))
            }
            Err(e) if over.get() => Err(e),
            Err(e) => {
                failed.push(sweep::failure(&all[i], e)?.to_string());
                Ok(None)
            }
        }
    };
    let wanted = Wanted { error: budget.max_error, cost: budget.max_ratio.unwrap_or(f64::INFINITY) };
    let mut answer = search.cheapest(wanted, None, &mut measure)?;
    let within = |error: f64| Wanted { error, cost: f64::INFINITY };
    let family = sweep::PLAIN.iter().find_map(|plain| techniques.iter().position(|t| t == plain));
    // Whether it is another technique than what answers are compared with.
    let other = |i: usize| family.is_some_and(|family| all[i].technique != techniques[family]);
    if answer.is_some_and(other) {
        most.set(most.get().max(search.measured() + PLAIN_MORE));
        search.limit = most.get();
        search.cheapest(within(budget.max_error), family, &mut measure)?;
    }
    let error = |search: &Search, i: Option<usize>| i.and_then(|i| search.samples[i]).map(|s| s.error);
    // What is measured for comparison may turn out to be better than the answer found before.
    answer = search.best(wanted, None);
    let mut halved = None;
    while let Some(error) = error(&search, answer).filter(|e| *e > 0.0) {
        halved = search.cheapest(within(error / 2.0), None, &mut measure)?;
        let before = std::mem::replace(&mut answer, search.best(wanted, None));
        if answer == before {
            break;
        }
        halved = None;
    }
    let plain = family.filter(|_| answer.is_some_and(other));
    let plain = plain.and_then(|family| search.best(within(budget.max_error), Some(family)));
    let place = |i: usize| tried.iter().position(|(n, _)| *n == i);
    let points: Vec<(f64, f64)> = tried.iter().map(|(_, r)| (Advice::cost(r), by.of(r).unwrap_or(UNKNOWN))).collect();
    let spots: Vec<chart::Spot> = tried.iter().zip(&points).map(|((_, r), p)| Advice::spot(r, p.1)).collect();
    // Shares of what was wanted; of nothing, that is 0, all that is more misses by as much.
    let share = |x: f64, wanted: f64| if wanted > 0.0 { x / wanted } else { 1.0 + x };
    let miss = |(cost, error): &(f64, f64)| share(*error, wanted.error).max(share(*cost, wanted.cost));
    let closest = (0..points.len()).min_by(|a, b| miss(&points[*a]).total_cmp(&miss(&points[*b])));
    let answer = answer.and_then(place);
    let rows: Vec<Record> = tried.iter().map(|(_, r)| r.clone()).collect();
    let meets = |i: usize| points[i].1 <= wanted.error && points[i].0 <= wanted.cost;
    Ok(Advice {
        alike: answer.map_or(Vec::new(), |i| alike(&rows, i, meets)),
        answer,
        closest: if answer.is_none() { closest } else { None },
        halved: halved.and_then(place),
        plain: plain.and_then(place),
        frontier: chart::pareto(&spots),
        tried: rows,
        failed,
        base: anchor.as_ref().map(brief),
        space: all.len(),
        limit: most.get(),
    })
}

/// The rows that meet what is asked and whose quartiles of cost overlap with those of the answer, by ascending cost.
fn alike(rows: &[Record], answer: usize, meets: impl Fn(usize) -> bool) -> Vec<usize> {
    let overlaps = |i: &usize| *i != answer && meets(*i) && Advice::as_fast(&rows[*i], &rows[answer]);
    let mut found: Vec<usize> = (0..rows.len()).filter(overlaps).collect();
    found.sort_by(|a, b| Advice::cost(&rows[*a]).total_cmp(&Advice::cost(&rows[*b])));
    found
}

/// The set-up's own plain map, which times are multiples of: its technique and main parameters; None where none serves the light.
pub fn base(setup: &Setup) -> Option<String> {
    sweep::baseline(setup, None).ok().flatten().map(|(base, _)| format!("{} {}", base.technique, brief(&base)))
}

/// The values of the technique's main parameters, `resolution=1024 kernel=3`.
pub fn brief(setup: &Setup) -> String {
    let main = techniques::find(&setup.technique).map_or(&[][..], |i| i.main);
    let values = setup.meaningful();
    let one = |(name, _): &(&str, &str)| values.get(*name).map(|v| format!("{name}={v}"));
    main.iter().filter_map(one).collect::<Vec<_>>().join(" ")
}

/// All configurations, and the lines in which they stand.
fn lines(setup: &Setup, techniques: &[String], axes: &[Axis]) -> Result<(Vec<Setup>, Vec<Line>)> {
    let all = space::expand(setup, techniques, axes, true)?;
    let mut lines: Vec<Line> = Vec::new();
    // Configurations that agree in everything but the main parameter stand in one line, in its order.
    let mut keys: Vec<(usize, Values)> = Vec::new();
    for (i, configuration) in all.iter().enumerate() {
        let family = techniques.iter().position(|t| *t == configuration.technique).unwrap_or(0);
        let mut key = configuration.meaningful();
        chart::main_parameter(&configuration.technique).map(|name| key.remove(name));
        let key = (family, key);
        let line = keys.iter().position(|k| *k == key).unwrap_or_else(|| {
            keys.push(key);
            lines.push(Line { family, configurations: Vec::new() });
            keys.len() - 1
        });
        lines[line].configurations.push(i);
    }
    Ok((all, lines))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::read;
    use std::path::Path;

    /// Those that meet the budget and whose middle halves overlap with the answer's, scaled to the baseline's time.
    #[test]
    fn overlapping_times_are_told() {
        let row = |ms: f64, spread: f64, scale: f64| Record {
            gpu_ms: ms,
            gpu_ms_q1: ms - spread,
            gpu_ms_q3: ms + spread,
            cost: Some(ms * scale),
            ..Record::default()
        };
        // Costs 1.9 to 2.1; 2.05 to 2.25; the same, but too wrong; 2.2 to 2.4; and 1.8 to 2.4.
        let rows =
            [row(20.0, 1.0, 0.1), row(4.3, 0.2, 0.5), row(4.3, 0.2, 0.5), row(2.3, 0.1, 1.0), row(2.1, 0.3, 1.0)];
        assert_eq!(alike(&rows, 0, |i| i != 2), [4, 1]);
        assert_eq!(alike(&rows[..1], 0, |_| true), [0; 0]);
    }

    /// What the multiples are of, where the machine got busier between rows; and why the cheapest is not on the frontier.
    #[test]
    fn the_base_of_the_multiples_is_told() {
        let row = |ms: f64, base: f64, rmse: f64| Record {
            gpu_ms: ms,
            gpu_ms_q1: ms - 0.2 * ms,
            gpu_ms_q3: ms + 0.2 * ms,
            cost: Some(ms / base),
            rmse,
            ..Record::default()
        };
        let tried = vec![row(20.0, 20.0, 0.09), row(25.0, 20.0, 0.08), row(60.0, 20.0, 0.07), row(240.0, 40.0, 0.06)];
        let by = Figure::find("rmse").unwrap();
        let spots: Vec<chart::Spot> = tried.iter().map(|r| Advice::spot(r, r.rmse)).collect();
        let advice = Advice { frontier: chart::pareto(&spots), tried, ..Advice::default() };
        assert_eq!(advice.base_ms(), Some([20.0, 40.0]));
        assert_eq!(advice.frontier, [1, 2, 3]);
        assert_eq!(advice.cheapest_beaten(by), Some((0, 1)));
        let all = Advice { frontier: vec![0, 2, 3], ..advice };
        assert_eq!(all.cheapest_beaten(by), None);
        let (setup, _) = Setup::open("cubes").unwrap();
        assert_eq!(base(&setup).as_deref(), Some("shadow-map resolution=1024"));
    }

    /// Numbers with the unit that a figure has, and none other.
    #[test]
    fn budgets_are_read_in_their_figures_unit() {
        let read = |by: &str, text: &str| Figure::find(by).unwrap().parse(text);
        for (by, text, value) in [
            ("error", "0.5%", 0.005),
            ("error", "0.005", 0.005),
            ("flicker", " 1 %", 0.01),
            ("rmse", "0.03", 0.03),
            ("flip", "0", 0.0),
            ("boundary", "2.5", 2.5),
            ("boundary", "3px", 3.0),
        ] {
            assert!((read(by, text).unwrap() - value).abs() < 1e-12, "{by} {text}");
        }
        for (by, text, says) in [
            ("error", "half", "write it as 0.5% or 0.005"),
            ("error", "2px", "write it as 0.5% or 0.005"),
            ("error", "101%", "takes 0 to 100 %"),
            ("rmse", "0.5%", "RMSE is not a share; write a number such as 0.05"),
            ("rmse", "1.5", "takes 0 to 1"),
            ("boundary", "3%", "distance in pixels"),
            ("boundary", "-1", "from 0 on"),
            ("flicker", "nan", "0 to 100 %"),
        ] {
            let said = read(by, text).unwrap_err().to_string();
            assert!(said.contains(says), "{by} {text}: {said}");
        }
        assert!(Figure::find("luck").unwrap_err().to_string().contains("error, rmse,"));
        assert!(FIGURES.iter().all(|f| chart::ERRORS.iter().any(|a| a.id == f.field)));
        let suited = |ids: &[&str]| Figure::suited(&ids.iter().map(|i| i.to_string()).collect::<Vec<_>>()).id;
        assert_eq!((suited(&["shadow-map", "rt-hard"]), suited(&["shadow-map", "pcf"])), ("error", "rmse"));
    }

    /// Sweeps of all main parameters that were measured once (480 × 270 pixels, software adapter), as the search finds
    /// them: its answers against the best in the whole table.
    #[test]
    fn a_third_of_a_measured_space_is_enough() {
        for scene in ["bench", "terrain"] {
            let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/data/{scene}.csv"));
            let rows = read(&path).unwrap();
            let sample = |r: &Record| Sample { error: r.error_share, cost: Advice::cost(r) };
            let mut families: Vec<String> = Vec::new();
            let mut lines = Vec::new();
            for s in chart::series(&rows) {
                let known = families.iter().position(|f| *f == s.technique);
                let family = known.unwrap_or(families.len());
                if known.is_none() {
                    families.push(s.technique);
                }
                lines.push(Line { family, configurations: s.points });
            }
            assert!(rows.len() > 40 && lines.len() > 7, "{scene}: {} rows in {} lines", rows.len(), lines.len());
            for error in [0.02, 0.005, 0.001] {
                let lines: Vec<Line> =
                    lines.iter().map(|l| Line { family: l.family, configurations: l.configurations.clone() }).collect();
                let mut search = Search::new(lines, rows.len() / SHARE);
                let wanted = Wanted { error, cost: f64::INFINITY };
                let answer = search.cheapest(wanted, None, &mut |i| Ok(Some(sample(&rows[i])))).unwrap().unwrap();
                let all = rows.iter().map(sample).filter(|s| wanted.met(s)).map(|s| s.cost);
                let best = all.fold(f64::INFINITY, f64::min);
                let found = sample(&rows[answer]);
                assert!(wanted.met(&found), "{scene} at {error}: {found:?}");
                assert!(found.cost <= best * 1.1, "{scene} at {error}: {} for {best}", found.cost);
                assert!(search.measured() * SHARE <= rows.len(), "{scene} at {error}: {} measured", search.measured());
            }
        }
    }
}
