//! The cheapest configuration within an error budget, found by measuring few.
//!
//! Configurations stand in lines along which the cost rises (a technique's main parameter) and, as a rule, the error
//! falls; some errors rise again behind a lowest place, as those of a filter do that is as many texels wide whatever the
//! map. Along a line only the first one good enough matters. What is not measured is predicted from what is, and the line
//! whose next candidate promises the lowest cost is measured next, until no line promises less than the best found.

use anyhow::Result;

/// Configurations of one technique that differ in its main parameter only, from the coarsest to the finest.
pub struct Line {
    /// Lines with equal numbers are of one technique and behave alike.
    pub family: usize,
    /// Numbers of the configurations.
    pub configurations: Vec<usize>,
}

/// What was measured of a configuration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// In any unit.
    pub error: f64,
    /// Time, in any unit.
    pub cost: f64,
}

/// What is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wanted {
    pub error: f64,
    /// Infinite: at any cost.
    pub cost: f64,
}

impl Wanted {
    pub fn met(&self, s: &Sample) -> bool {
        s.error <= self.error && s.cost <= self.cost
    }
}

/// How a step along a line changes error and cost where nothing else is known: aliasing along edges halves with each
/// doubling of the resolution, and the cost of a look-up hardly grows. Natural logarithms.
const ERROR_STEP: f64 = -0.6;
const COST_STEP: f64 = 0.15;
/// Below this an error counts as this, so that logarithms stay finite.
const LEAST: f64 = 1e-9;
/// How much better than predicted a candidate may be and is still tried: on a line with measurements of its own, and
/// on one that is known from its family only.
const HOPE: [f64; 2] = [0.8, 0.55];

/// All that is known so far.
pub struct Search {
    lines: Vec<Line>,
    /// By configuration.
    pub samples: Vec<Option<Sample>>,
    /// Configurations that may be measured in all.
    pub limit: usize,
    /// Those that could not be, which count towards it.
    failed: usize,
}

impl Search {
    /// A search over lines whose configurations are numbered from 0, that measures at most `limit` of them.
    pub fn new(lines: Vec<Line>, limit: usize) -> Search {
        let count = lines.iter().map(|l| l.configurations.len()).sum();
        Search { lines, samples: vec![None; count], limit, failed: 0 }
    }

    /// Measures until the cheapest configuration that meets `wanted` is known, of all or of one family, as far as predictions
    /// hold, or the limit is reached; its number, if there is one. What cannot be measured (None) is left out from then on.
    ///
    /// # Errors
    /// What `measure` says.
    pub fn cheapest(
        &mut self,
        wanted: Wanted,
        family: Option<usize>,
        measure: &mut dyn FnMut(usize) -> Result<Option<Sample>>,
    ) -> Result<Option<usize>> {
        while self.measured() + self.failed < self.limit {
            let next = self.unknown_family(family).or_else(|| self.most_promising(wanted, family));
            let Some(next) = next.or_else(|| self.last_hope(wanted, family)) else { break };
            self.samples[next] = measure(next)?;
            if self.samples[next].is_none() {
                self.failed += 1;
                self.lines.iter_mut().for_each(|l| l.configurations.retain(|i| *i != next));
            }
        }
        Ok(self.best(wanted, family))
    }

    /// The lines of one family, or all.
    fn lines_of(&self, family: Option<usize>) -> impl Iterator<Item = &Line> {
        self.lines.iter().filter(move |l| family.is_none_or(|f| l.family == f))
    }

    pub fn measured(&self) -> usize {
        self.samples.iter().flatten().count()
    }

    /// The cheapest one measured that meets `wanted`, of all or of one family.
    pub fn best(&self, wanted: Wanted, family: Option<usize>) -> Option<usize> {
        let all = self.lines_of(family).flat_map(|l| &l.configurations);
        let good = all.filter_map(|i| self.samples[*i].filter(|s| wanted.met(s)).map(|s| (*i, s.cost)));
        good.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(i, _)| i)
    }

    /// The middle of the first line of a family of which nothing is measured.
    fn unknown_family(&self, family: Option<usize>) -> Option<usize> {
        let known = |family| self.lines.iter().any(|l| l.family == family && self.points(l).next().is_some());
        let line = self.lines_of(family).find(|l| !l.configurations.is_empty() && !known(l.family))?;
        Some(line.configurations[line.configurations.len() / 2])
    }

    /// The candidate that promises the lowest cost of all lines, if it promises less than the best known.
    fn most_promising(&self, wanted: Wanted, family: Option<usize>) -> Option<usize> {
        let bound = self.best(wanted, family).and_then(|i| self.samples[i]).map_or(f64::INFINITY, |s| s.cost);
        let candidates = self.lines_of(family).filter_map(|l| self.candidate(l, wanted));
        let cheapest = candidates.min_by(|a, b| a.1.total_cmp(&b.1))?;
        (cheapest.1 < bound && cheapest.1 <= wanted.cost).then_some(cheapest.0)
    }

    /// Where nothing measured meets `wanted`, whatever was predicted: of the places that are still open, the one on each
    /// line that is expected to err least, and of those again. While errors fall along a line that is the finest.
    fn last_hope(&self, wanted: Wanted, family: Option<usize>) -> Option<usize> {
        if self.best(wanted, family).is_some() {
            return None;
        }
        let open = self.lines_of(family).filter_map(|line| {
            let good = self.points(line).any(|(_, s)| s.error <= wanted.error);
            let (start, end) = self.open(line, wanted);
            let all = (start..end).rev().map(|k| (line.configurations[k], self.predict(line, k)));
            let least = all.min_by(|a, b| a.1.error.total_cmp(&b.1.error));
            let (number, expected) = least.filter(|_| !good)?;
            (expected.cost * HOPE[1] <= wanted.cost).then_some((number, expected.error))
        });
        open.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(number, _)| number)
    }

    /// Where on a line what is wanted may still be, unmeasured: from a place on, and before another. That is between what is
    /// too coarse and the first known to be good. Where none is good yet, errors have either fallen so far, and it is
    /// beyond; or they have turned, and it is beside the lowest.
    fn open(&self, line: &Line, wanted: Wanted) -> (usize, usize) {
        let points: Vec<(usize, f64)> = self.points(line).map(|(k, s)| (k, s.error)).collect();
        let good = points.iter().position(|(_, error)| *error <= wanted.error);
        // Of equal ones the finest: there they still fall.
        let lowest = (0..points.len()).rev().min_by(|a, b| points[*a].1.total_cmp(&points[*b].1));
        let turned = lowest.filter(|i| i + 1 < points.len());
        let place = |i: usize| points[i].0;
        let behind = |i: usize| i.checked_sub(1).map_or(0, |i| place(i) + 1);
        match (good, turned) {
            (Some(i), _) => (behind(i), place(i)),
            (None, Some(i)) if place(i) + 1 < place(i + 1) || behind(i) < place(i) => {
                // Its own place is measured: the wider of the two sides.
                let sides = [(behind(i), place(i)), (place(i) + 1, place(i + 1))];
                if sides[0].1 - sides[0].0 >= sides[1].1 - sides[1].0 { sides[0] } else { sides[1] }
            }
            (None, Some(i)) => (place(i), place(i)),
            (None, None) => (behind(points.len()), line.configurations.len()),
        }
    }

    /// What to measure next on a line, and the cost hoped for: the first open place that may be good enough. None: nothing
    /// is left to learn.
    fn candidate(&self, line: &Line, wanted: Wanted) -> Option<(usize, f64)> {
        let (start, end) = self.open(line, wanted);
        let hope = HOPE[self.points(line).next().is_none() as usize];
        let place = (start..end).find(|k| self.predict(line, *k).error * hope <= wanted.error);
        // The finest is tried even where the prediction misses by a little: predictions from afar are rough.
        let last = line.configurations.len().checked_sub(1)?;
        let near = || (end > last && self.predict(line, last).error <= wanted.error * 2.0).then_some(last);
        let place = place.or_else(near).filter(|k| *k >= start)?;
        Some((line.configurations[place], self.predict(line, place).cost * hope))
    }

    /// Places and samples of a line.
    fn points<'a>(&'a self, line: &'a Line) -> impl Iterator<Item = (usize, Sample)> + 'a {
        line.configurations.iter().enumerate().filter_map(|(k, i)| self.samples[*i].map(|s| (k, s)))
    }

    /// What is to be expected at a place of a line.
    fn predict(&self, line: &Line, place: usize) -> Sample {
        if self.points(line).next().is_some() {
            return self.along(line, place, self.steps(line.family));
        }
        // Lines of the family are averaged, as logarithms.
        let (mut error, mut cost, mut count) = (0.0, 0.0, 0.0);
        for other in self.lines.iter().filter(|l| l.family == line.family && self.points(l).next().is_some()) {
            let s = self.along(other, place.min(other.configurations.len() - 1), self.steps(line.family));
            error += s.error.max(LEAST).ln();
            cost += s.cost.ln();
            count += 1.0;
        }
        Sample { error: f64::exp(error / count), cost: f64::exp(cost / count) }
    }

    /// Between measured places of a line the logarithms are interpolated; beyond them they follow `steps`.
    fn along(&self, line: &Line, place: usize, steps: [f64; 2]) -> Sample {
        let below = self.points(line).filter(|(k, _)| *k <= place).last();
        let above = self.points(line).find(|(k, _)| *k >= place);
        let blend = |of: fn(&Sample) -> f64, step: f64| {
            let log = |s: &Sample| of(s).max(LEAST).ln();
            match (&below, &above) {
                (Some((a, low)), Some((b, high))) if a != b => {
                    log(low) + (log(high) - log(low)) * (place - a) as f64 / (b - a) as f64
                }
                (Some((k, s)), _) => log(s) + (place - k) as f64 * step,
                (None, Some((k, s))) => log(s) - (k - place) as f64 * step,
                (None, None) => 0.0,
            }
        };
        Sample { error: blend(|s| s.error, steps[0]).exp(), cost: blend(|s| s.cost, steps[1]).exp() }
    }

    /// How a step changes the logarithms of error and cost in a family: the mean over its measured stretches.
    fn steps(&self, family: usize) -> [f64; 2] {
        let (mut error, mut cost, mut length) = (0.0, 0.0, 0.0);
        for line in self.lines.iter().filter(|l| l.family == family) {
            if let (Some((a, low)), Some((b, high))) = (self.points(line).next(), self.points(line).last())
                && a < b
            {
                error += high.error.max(LEAST).ln() - low.error.max(LEAST).ln();
                cost += high.cost.ln() - low.cost.ln();
                length += (b - a) as f64;
            }
        }
        if length == 0.0 { [ERROR_STEP, COST_STEP] } else { [(error / length).min(0.0), (cost / length).max(0.0)] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// PCG (O'Neill 2014), in [0, 1).
    fn random(state: &mut u64) -> f64 {
        let old = *state;
        *state = old.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (((old >> 18 ^ old) >> 27) as u32).rotate_right((old >> 59) as u32) as f64 / 4294967296.0
    }

    /// Techniques as they are: errors that fall by a factor a step with some noise, costs with a fixed part and one
    /// that quadruples; lines of a family alike up to a factor; and an exact, dear one.
    fn world(seed: u64) -> (Vec<Line>, Vec<Sample>) {
        let s = &mut (seed * 77 + 5);
        let (mut lines, mut samples) = (Vec::new(), Vec::new());
        for family in 0..3 {
            let count = [1, 6, 3][family];
            let (error, fall) = (0.02 + 0.05 * random(s), 0.45 + 0.2 * random(s));
            let (fixed, grow) = (1.0 + family as f64 * random(s), 0.002 * random(s));
            for _ in 0..count {
                let (better, dearer) = (0.7 + 0.6 * random(s), 1.0 + random(s));
                let mut configurations = Vec::new();
                for k in 0..6 {
                    configurations.push(samples.len());
                    let error = error * better * fall.powi(k) * (0.95 + 0.1 * random(s));
                    samples.push(Sample { error, cost: (fixed + grow * 4f64.powi(k)) * dearer });
                }
                lines.push(Line { family, configurations });
            }
        }
        lines.push(Line { family: 3, configurations: vec![samples.len()] });
        samples.push(Sample { error: 0.0, cost: 9.0 });
        (lines, samples)
    }

    /// Where errors halve and costs double with each step, what is not measured is predicted exactly: between measured places, beyond
    /// them, on a line of the family with one measured place, and on one with none, as the others' mean.
    #[test]
    fn even_falls_are_predicted_exactly() {
        let lines = (0..3).map(|l| Line { family: 0, configurations: (0..5).map(|k| 5 * l + k).collect() }).collect();
        let mut search = Search::new(lines, 15);
        let exact = |l: usize, k: usize| {
            let step = 2f64.powi(k as i32);
            Sample { error: 0.1 * [1.0, 4.0, 2.0][l] / step, cost: [1.0, 9.0, 3.0][l] * step }
        };
        for (l, k) in [(0, 1), (0, 3), (1, 2)] {
            search.samples[5 * l + k] = Some(exact(l, k));
        }
        for l in 0..3 {
            for k in 0..5 {
                let (told, exact) = (search.predict(&search.lines[l], k), exact(l, k));
                let off = (told.error / exact.error - 1.0).abs().max((told.cost / exact.cost - 1.0).abs());
                assert!(off < 1e-9, "line {l}, place {k}: {told:?} for {exact:?}");
            }
        }
    }

    #[test]
    fn a_third_of_the_configurations_finds_an_answer_within_a_tenth_of_the_best() {
        let (mut good, mut all) = (0, 0);
        for seed in 0..100 {
            for error in [0.03, 0.01, 0.003, 0.001] {
                let (lines, samples) = world(seed);
                let limit = samples.len() / 3;
                let mut search = Search::new(lines, limit);
                let wanted = Wanted { error, cost: f64::INFINITY };
                let mut calls = 0;
                let found = search.cheapest(wanted, None, &mut |i| {
                    calls += 1;
                    Ok(Some(samples[i]))
                });
                let found = found.unwrap().expect("the exact one always meets it");
                assert!(samples[found].error <= error && calls <= limit, "seed {seed}: {calls} measured");
                let best = samples.iter().filter(|s| wanted.met(s)).map(|s| s.cost).fold(f64::INFINITY, f64::min);
                all += 1;
                good += (samples[found].cost <= best * 1.1) as usize;
            }
        }
        // Random lines of a family differ by up to a factor of two in cost: not every one can be known.
        assert!(good * 100 >= all * 98, "{good} of {all} answers are within a tenth of the best");
    }

    /// Filters as they are: errors that fall until the filter suits the map, and rise again; the lowest place lies anywhere on
    /// the line. Beside them a hard technique whose errors fall to a floor.
    #[test]
    fn errors_that_turn_are_found_beside_their_lowest() {
        let (mut good, mut met, mut all) = (0, 0, 0);
        for seed in 0..100 {
            let s = &mut (seed * 31 + 7);
            let (mut lines, mut samples) = (Vec::new(), Vec::new());
            for family in 0..2 {
                for _ in 0..[1, 5][family] {
                    let (middle, floor, fixed) = (5.0 * random(s), 0.02 + 0.02 * random(s), 1.0 + random(s));
                    let turn =
                        |k: f64| if family == 0 { 2.0 + 3.0 * 0.5f64.powf(k) } else { 1.4f64.powf((k - middle).abs()) };
                    let mut configurations = Vec::new();
                    for k in 0..6 {
                        configurations.push(samples.len());
                        let cost = (fixed + 0.004 * 4f64.powi(k)) * (1.0 + family as f64);
                        samples.push(Sample { error: floor * turn(k as f64) * (0.98 + 0.04 * random(s)), cost });
                    }
                    lines.push(Line { family, configurations });
                }
            }
            let mut errors: Vec<f64> = samples.iter().map(|s| s.error).collect();
            errors.sort_by(f64::total_cmp);
            for place in [1, 4, 12] {
                let wanted = Wanted { error: errors[place], cost: f64::INFINITY };
                let lines = lines.iter().map(|l| Line { family: l.family, configurations: l.configurations.clone() });
                let mut search = Search::new(lines.collect(), samples.len() / 2);
                let found = search.cheapest(wanted, None, &mut |i| Ok(Some(samples[i]))).unwrap();
                let best = samples.iter().filter(|s| wanted.met(s)).map(|s| s.cost).fold(f64::INFINITY, f64::min);
                all += 1;
                met += found.is_some() as usize;
                good += found.is_some_and(|i| samples[i].cost <= best * 1.1) as usize;
            }
        }
        // Half of the places are measured, and nothing tells of a line's lowest but what was measured on it.
        assert!(met * 100 >= all * 95 && good * 100 >= all * 65, "{met} are met and {good} near the best, of {all}");
        // On a line alone: its middle fails, its end is worse, what is asked for stands before the middle.
        let errors = [0.05, 0.03, 0.04, 0.06, 0.09];
        let mut search = Search::new(vec![Line { family: 0, configurations: (0..5).collect() }], 4);
        let wanted = Wanted { error: 0.031, cost: f64::INFINITY };
        let mut measure = |i: usize| Ok(Some(Sample { error: errors[i], cost: 1.0 + i as f64 }));
        assert_eq!(search.cheapest(wanted, None, &mut measure).unwrap(), Some(1));
    }

    /// Of one family alone the answer is its own best, with no regard to what the others cost.
    #[test]
    fn one_family_alone_is_searched_on() {
        let (lines, samples) = world(3);
        let own: Vec<usize> = lines.iter().filter(|l| l.family == 0).flat_map(|l| l.configurations.clone()).collect();
        let wanted = Wanted { error: 0.01, cost: f64::INFINITY };
        let mut search = Search::new(lines, samples.len() / 3);
        search.cheapest(wanted, None, &mut |i| Ok(Some(samples[i]))).unwrap();
        search.limit = search.measured() + 4;
        let found = search.cheapest(wanted, Some(0), &mut |i| Ok(Some(samples[i]))).unwrap().expect("it meets that");
        let best = own.iter().filter(|i| wanted.met(&samples[**i])).map(|i| samples[*i].cost).min_by(f64::total_cmp);
        assert!(own.contains(&found) && Some(samples[found].cost) == best);
    }

    #[test]
    fn what_nothing_meets_has_no_answer() {
        let (lines, samples) = world(1);
        let mut search = Search::new(lines, 20);
        let wanted = Wanted { error: 1e-6, cost: 5.0 };
        assert_eq!(search.cheapest(wanted, None, &mut |i| Ok(Some(samples[i]))).unwrap(), None);
        assert!(search.measured() > 0);
    }

    /// What fails is tried once, and what is next is found all the same.
    #[test]
    fn what_cannot_be_measured_is_left_out() {
        for seed in 0..20 {
            let (lines, samples) = world(seed);
            let wanted = Wanted { error: 0.01, cost: f64::INFINITY };
            let best = |fails: &dyn Fn(usize) -> bool| {
                let good = (0..samples.len()).filter(|i| !fails(*i) && wanted.met(&samples[*i]));
                good.map(|i| samples[i].cost).fold(f64::INFINITY, f64::min)
            };
            // The best, and whole lines.
            let least = best(&|_| false);
            let fails = |i: usize| samples[i].cost == least || lines[i % lines.len()].configurations.contains(&i);
            let mut tried = Vec::new();
            let own = lines.iter().map(|l| Line { family: l.family, configurations: l.configurations.clone() });
            let mut search = Search::new(own.collect(), samples.len());
            let found = search.cheapest(wanted, None, &mut |i| {
                assert!(!tried.contains(&i), "{i} again");
                tried.push(i);
                Ok((!fails(i)).then(|| samples[i]))
            });
            let left = best(&fails);
            match found.unwrap() {
                Some(i) => assert!(!fails(i) && samples[i].cost <= 1.3 * left, "{seed}"),
                None => assert!(left.is_infinite(), "{seed}: {left}"),
            }
        }
    }

    #[test]
    fn what_measuring_says_is_passed_on() {
        let (lines, _) = world(1);
        let mut search = Search::new(lines, 20);
        let wanted = Wanted { error: 0.1, cost: f64::INFINITY };
        assert!(search.cheapest(wanted, None, &mut |_| anyhow::bail!("stopped")).is_err());
    }
}
