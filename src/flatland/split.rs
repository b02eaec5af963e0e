//! The light's frustum split into parts, each with a film of its own and its share of the texels (Chong 2003, 3.2).

use super::{Badness, Film, Metric};

/// A part of the light's directions.
#[derive(Clone, Debug)]
pub struct Part {
    /// Directions from the light between which it lies, radians.
    pub hull: [f64; 2],
    /// Direction of its film's normal, radians.
    pub normal: f64,
    /// Its texels; 0 where no pixel looks.
    pub lexels: usize,
    /// The sum over its pixels of what the metric counts, with a single texel.
    pub error: f64,
}

/// At most `budget` parts: greedily merged out of `first` equal ones, each time the neighbours whose merger costs least once the
/// texels are shared out anew.
/// By [`Metric::Max`], which has no sum to share out, parts are those of [`Metric::L2`].
pub fn split(film: &Film, metric: Metric, budget: usize, first: usize) -> Vec<Part> {
    let metric = if metric == Metric::Max { Metric::L2 } else { metric };
    // No part goes without a texel.
    let (first, budget) = (first.max(1), budget.clamp(1, (film.lexels as usize).max(1)));
    let place = |i: usize| film.bottom + (film.top - film.bottom) * i as f64 / first as f64;
    // The last direction as it is, so that rounding loses no pixel.
    let edge = |i: usize| if i == first { film.top } else { place(i) };
    let mut parts: Vec<Part> = (0..first).map(|i| part(film, metric, [edge(i), edge(i + 1)])).collect();
    while parts.len() > budget {
        let merged: Vec<Part> =
            parts.windows(2).map(|two| part(film, metric, [two[0].hull[0], two[1].hull[1]])).collect();
        let cost = |i: usize| {
            let rest = parts.iter().enumerate().filter(|(k, _)| *k != i && *k != i + 1).map(|(_, p)| p.error);
            total(order(metric), rest.chain([merged[i].error]))
        };
        let Some(least) = (0..merged.len()).min_by(|a, b| cost(*a).total_cmp(&cost(*b))) else {
            break;
        };
        parts.splice(least..least + 2, [merged[least].clone()]);
    }
    let errors: Vec<f64> = parts.iter().map(|p| p.error).collect();
    let lexels = shared(&errors, metric, film.lexels as usize);
    parts.iter_mut().zip(lexels).for_each(|(part, lexels)| part.lexels = lexels);
    parts
}

fn part(film: &Film, metric: Metric, hull: [f64; 2]) -> Part {
    let Some(own) = film.part(hull) else {
        return Part { hull, normal: (hull[0] + hull[1]) / 2.0, lexels: 0, error: 0.0 };
    };
    let (s, _) = own.least_turn(metric);
    let power = order(metric) as i32;
    // Footprints count texels of the whole film.
    let error = own.turned(s).map(|b| (b * film.lexels).powi(power)).sum();
    Part { hull, normal: own.normal(s), lexels: 0, error }
}

/// The power of a footprint that the metric sums.
fn order(metric: Metric) -> f64 {
    if metric == Metric::L1 { 1.0 } else { 2.0 }
}

/// The least Σ e_i / x_i^p where the texels x_i may be any positive numbers that add up to one: (Σ e_i^1/(p+1))^(p+1), with
/// x_i in proportion to e_i^1/(p+1) (Lagrange).
pub fn total(p: f64, errors: impl Iterator<Item = f64>) -> f64 {
    errors.map(|e| e.powf(1.0 / (p + 1.0))).sum::<f64>().powf(p + 1.0)
}

/// Whole texels for parts with these errors, so that Σ e_i / x_i^p is least: one each to begin with, then each next one to whom it
/// helps most (water-filling; exact, as what one more helps only shrinks). Parts without pixels get none.
pub fn shared(errors: &[f64], metric: Metric, lexels: usize) -> Vec<usize> {
    let p = order(metric);
    let mut all: Vec<usize> = errors.iter().map(|e| (*e > 0.0) as usize).collect();
    let helps = |e: f64, x: usize| e / (x as f64).powf(p) - e / (x as f64 + 1.0).powf(p);
    for _ in all.iter().sum::<usize>()..lexels {
        let whom = (0..all.len()).filter(|i| all[*i] > 0);
        let Some(most) = whom.max_by(|a, b| helps(errors[*a], all[*a]).total_cmp(&helps(errors[*b], all[*b]))) else {
            break;
        };
        all[most] += 1;
    }
    all
}

/// Pixels a texel over all parts with the texels that they have.
pub fn badness(film: &Film, parts: &[Part]) -> Badness {
    let own = |p: &Part| {
        let share = film.lexels / p.lexels.max(1) as f64;
        film.part(p.hull).map(|own| own.footprints(p.normal).map(|b| b * share).collect::<Vec<_>>())
    };
    Badness::of(parts.iter().filter_map(own).flatten())
}
