//! Advice: the cheapest configuration that meets an error budget, over techniques and their main parameters.

use super::search::{Line, Sample, Search, Wanted};
use super::{Axis, Record, accuracy, space, sweep};
use crate::chart;
use crate::frame::Renderer;
use crate::params::Values;
use crate::setup::Setup;
use anyhow::{Result, ensure};

/// What is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Budget {
    /// Wrong pixels as a share of those that face the light, 0 to 1.
    pub max_error: f64,
    /// Time as a multiple of that of the set-up's `shadow-map`.
    pub max_ratio: Option<f64>,
}

/// What was found.
#[derive(Clone, Debug, Default)]
pub struct Advice {
    /// The cheapest that meets the budget, as an index into `tried`.
    pub answer: Option<usize>,
    /// Where nothing meets it: the closest miss.
    pub closest: Option<usize>,
    /// The cheapest found with at most half the answer's error, if any.
    pub halved: Option<usize>,
    /// The cheapest `shadow-map` within the same error, at any cost, where the answer is another technique.
    pub plain: Option<usize>,
    /// Those that no other beats in both, by ascending time: indices into `tried`.
    pub frontier: Vec<usize>,
    /// All that was measured, in its order.
    pub tried: Vec<Record>,
    /// Configurations there were to choose from, and how many of them could be measured at most.
    pub space: usize,
    pub limit: usize,
}

impl Advice {
    /// Time of a row as the search compares it: the multiple of the baseline's, milliseconds where there is none.
    pub fn cost(row: &Record) -> f64 {
        row.cost.unwrap_or(row.gpu_ms)
    }

    /// How many times as much as the answer the plain shadow map costs.
    pub fn plain_factor(&self) -> Option<f64> {
        let [answer, plain] = [self.answer?, self.plain?].map(|i| self.tried.get(i));
        Some(Advice::cost(plain?) / Advice::cost(answer?))
    }
}

/// At most this share of the configurations is measured (at least one of each technique, though, and what answers are
/// compared with).
const SHARE: usize = 3;
/// What answers are compared with, and how many of it may be measured beyond the share.
const PLAIN: &str = "shadow-map";
const PLAIN_MORE: usize = 4;

/// Searches the techniques and their main parameters, those that `axes` name over the values given there. `watch` is told
/// the share done and what is measured, and stops the work by saying no.
///
/// # Errors
/// A light that a technique does not serve, a ratio asked for without a baseline, what the device reports, or that it
/// was stopped.
pub fn advise(
    renderer: &mut Renderer,
    setup: &Setup,
    techniques: &[String],
    axes: &[Axis],
    budget: Budget,
    watch: &mut dyn FnMut(f32, &str) -> bool,
) -> Result<Advice> {
    let anchor = sweep::baseline(setup, None)?.map(|(setup, _)| setup);
    ensure!(
        budget.max_ratio.is_none() || anchor.is_some(),
        "a largest ratio needs shadow-map to compare with, and that does not serve {} light",
        setup.light.kind()
    );
    let (all, lines) = lines(setup, techniques, axes)?;
    let mut tried: Vec<(usize, Record)> = Vec::new();
    // Read while it is measured, and raised before the comparison.
    let most = std::cell::Cell::new((all.len() / SHARE).max(techniques.len()));
    let mut search = Search::new(lines, most.get());
    let mut measure = |i: usize| -> Result<Sample> {
        let setup = &all[i];
        let what = format!("{} {}", setup.technique, brief(setup));
        let limit = most.get() as f32;
        let begun = tried.len() as f32 / limit;
        ensure!(watch(begun, what.trim()), super::STOPPED);
        let mut row = accuracy(renderer, setup, i as u64)?;
        row.configurations = all.len() as u64;
        let mut go_on = |part: f32| watch(begun + part / limit, what.trim());
        sweep::time_one(renderer, &mut row, setup, anchor.as_ref(), &mut go_on)?;
        let sample = Sample { error: row.error_share, cost: Advice::cost(&row) };
        tried.push((i, row));
        Ok(sample)
    };
    let wanted = Wanted { error: budget.max_error, cost: budget.max_ratio.unwrap_or(f64::INFINITY) };
    let mut answer = search.cheapest(wanted, None, &mut measure)?;
    let within = |error: f64| Wanted { error, cost: f64::INFINITY };
    let family = techniques.iter().position(|t| t == PLAIN);
    if answer.is_some_and(|i| all[i].technique != PLAIN) && family.is_some() {
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
    let plain = family.filter(|_| answer.is_some_and(|i| all[i].technique != PLAIN));
    let plain = plain.and_then(|family| search.best(within(budget.max_error), Some(family)));
    let place = |i: usize| tried.iter().position(|(n, _)| *n == i);
    let points: Vec<(f64, f64)> = tried.iter().map(|(_, r)| (Advice::cost(r), r.error_share)).collect();
    let miss = |(cost, error): &(f64, f64)| (error / wanted.error).max(cost / wanted.cost);
    let closest = (0..points.len()).min_by(|a, b| miss(&points[*a]).total_cmp(&miss(&points[*b])));
    Ok(Advice {
        answer: answer.and_then(place),
        closest: if answer.is_none() { closest } else { None },
        halved: halved.and_then(place),
        plain: plain.and_then(place),
        frontier: chart::pareto(&points),
        tried: tried.into_iter().map(|(_, r)| r).collect(),
        space: all.len(),
        limit: most.get(),
    })
}

/// The values of the technique's main parameters, `resolution=1024 kernel=3`.
pub fn brief(setup: &Setup) -> String {
    let main = crate::techniques::find(&setup.technique).map_or(&[][..], |i| i.main);
    let one = |(name, _): &(&str, &str)| setup.values().get(*name).map(|v| format!("{name}={v}"));
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
        let mut key = configuration.values().clone();
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
                let answer = search.cheapest(wanted, None, &mut |i| Ok(sample(&rows[i]))).unwrap().unwrap();
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
