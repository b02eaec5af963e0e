//! What is known of a state of the lab.

use super::{Charted, Choice, State};
use crate::flatland::split::{self, Part, split};
use crate::flatland::table::{self, METHODS, Row};
use crate::flatland::{Badness, Film, Metric, Perspective, PostPerspective, Sample};
use std::f64::consts::PI;

/// A place of the chart of errors.
#[derive(Clone, Copy)]
pub struct Place {
    pub normal: f64,
    pub badness: Badness,
}

/// What a pixel sees.
#[derive(Clone, Copy)]
pub struct Seen {
    /// Of the pixel's middle in the image.
    pub place: f64,
    pub segment: usize,
    /// Pixels a lexel.
    pub footprint: f64,
}

/// All that is computed when a state changes.
#[derive(Default)]
pub struct Found {
    of: Option<State>,
    /// None: nothing is seen, or not all of it lies before the light.
    pub film: Option<Film>,
    pub post: Option<PostPerspective>,
    pub perspective: Option<Perspective>,
    /// Films that there are, in the order of the list.
    pub rows: Vec<(Choice, Row)>,
    /// The chosen film.
    pub chosen: Option<Row>,
    /// Its own parts, where there is more than one.
    pub parts: Vec<Part>,
    /// The pixels that see something, by their place.
    pub seen: Vec<Seen>,
    /// Pixels a lexel of the parts together.
    pub split: Option<Badness>,
    /// Over all valid films, by angle.
    pub curve: Vec<Place>,
    /// For numbers of samples what choosing from them adds to the mean of L1's film and to the mean with σ of L2's, as shares.
    pub added: Vec<(usize, [f64; 2])>,
}

/// The metric that a choice follows.
pub fn metric(choice: Choice) -> Option<Metric> {
    if let Choice::Least(metric) = choice { Some(metric) } else { None }
}

impl Found {
    /// Whether it is of another state.
    pub fn stale(&self, s: &State) -> bool {
        self.of.as_ref() != Some(s)
    }

    /// Computes what is not known yet.
    pub fn update(&mut self, s: &State) {
        if self.stale(s) {
            *self = Found::new(s);
        }
    }

    fn new(s: &State) -> Found {
        let of = Some(s.clone());
        let Some(film) = s.world.film() else { return Found { of, ..Found::default() } };
        let normal = normal(s, &film);
        let named = table::methods(&s.world, &film, s.push).into_iter().filter_map(|row| {
            let at = METHODS.iter().position(|m| *m == row.method)?;
            Some((CHOICES[at], row))
        });
        let mut rows: Vec<(Choice, Row)> = named.collect();
        let plane = |i: usize| table::row(&film, "a segment's plane", film.of_plane(&s.world, i));
        if let Choice::Plane(i) = s.film {
            rows.push((s.film, plane(i)));
        }
        rows.retain(|(_, row)| film.is_valid(row.normal));
        let chosen = normal.map(|n| table::row(&film, "chosen", n)).filter(|row| film.is_valid(row.normal));
        let parts = match metric(s.film) {
            Some(metric) if s.frusta > 1 => split(&film, metric, s.frusta, s.first),
            _ => Vec::new(),
        };
        let own = |film: &Film, normal: f64, share: f64| -> Vec<Seen> {
            let each = film.samples.iter().zip(film.footprints(normal));
            let seen = |(x, b): (&Sample, f64)| Seen {
                place: s.world.place(x.point),
                segment: x.segment,
                footprint: b * share,
            };
            each.map(seen).collect()
        };
        let mut seen: Vec<Seen> = match &chosen {
            _ if !parts.is_empty() => {
                let of = |p: &Part| {
                    let share = s.world.lexels as f64 / p.lexels.max(1) as f64;
                    film.part(p.hull).map_or(Vec::new(), |part| own(&part, p.normal, share))
                };
                parts.iter().flat_map(of).collect()
            }
            Some(row) => own(&film, row.normal, 1.0),
            None => Vec::new(),
        };
        seen.sort_by(|a, b| a.place.total_cmp(&b.place));
        let split = (!parts.is_empty()).then(|| split::badness(&film, &parts));
        let added = if s.show.chart == Charted::Added { added(s, &film) } else { Vec::new() };
        Found {
            post: Some(s.world.post_perspective(&film)),
            perspective: s.world.perspective(&film, s.push),
            curve: curve(&film),
            film: Some(film),
            of,
            rows,
            chosen,
            parts,
            seen,
            split,
            added,
        }
    }

    pub fn row(&self, choice: Choice) -> Option<&Row> {
        self.rows.iter().find(|(c, _)| *c == choice).map(|(_, row)| row)
    }
}

/// The choices that [`METHODS`] stand for.
pub const CHOICES: [Choice; 6] = [
    Choice::Least(Metric::L1),
    Choice::Least(Metric::L2),
    Choice::Least(Metric::Max),
    Choice::Common,
    Choice::NearLine,
    Choice::Texels,
];

/// The valid film that is nearest to one with this normal.
pub fn within(film: &Film, normal: f64) -> f64 {
    let ([low, high], half) = (film.valid(), film.half_angle());
    // As near to the last valid angles as figures can tell.
    let edge = ((high - low) * 1e-4).min(1e-4);
    (half + (normal - half + PI).rem_euclid(2.0 * PI) - PI).clamp(low + edge, high - edge)
}

/// The chosen film's normal; None: there is no such film.
fn normal(s: &State, film: &Film) -> Option<f64> {
    Some(match s.film {
        Choice::Hand => within(film, s.normal),
        Choice::Least(metric) => match s.few {
            Some(count) => coarse(s, film, count)?.least(metric).normal,
            None => film.least(metric).normal,
        },
        Choice::Common => film.half_angle(),
        Choice::NearLine => s.world.perspective(film, s.push)?.near_line,
        Choice::Texels => s.world.perspective(film, s.push)?.texels,
        Choice::Plane(i) => film.of_plane(&s.world, i),
    })
}

/// What `count` pixels say of the world.
fn coarse(s: &State, film: &Film, count: usize) -> Option<Film> {
    s.world.film_of(count, Some([film.bottom, film.top]))
}

/// Errors over all films, close enough where they are flat and where they are steep.
fn curve(film: &Film) -> Vec<Place> {
    let [low, high] = film.valid();
    let count = if film.samples.len() > 2000 { 60 } else { 120 };
    let even = (1..count).map(|i| low + (high - low) * i as f64 / count as f64);
    let stretched = (0..=count).map(|i| film.normal(-6.0 + 12.0 * i as f64 / count as f64));
    let mut normals: Vec<f64> = even.chain(stretched).filter(|n| film.is_valid(*n)).collect();
    normals.sort_by(f64::total_cmp);
    normals.into_iter().map(|normal| Place { normal, badness: film.badness(normal) }).collect()
}

/// What choosing from few samples adds.
fn added(s: &State, film: &Film) -> Vec<(usize, [f64; 2])> {
    let value = |metric: Metric, normal: f64| {
        let b = film.badness(normal);
        if metric == Metric::L1 { b.mean } else { b.mean_sigma }
    };
    let both = [Metric::L1, Metric::L2];
    let best = both.map(|metric| value(metric, film.least(metric).normal));
    let steps = 44;
    let mut counts: Vec<usize> =
        (0..=steps).map(|i| (5.0 * 200f64.powf(i as f64 / steps as f64)).round() as usize).collect();
    counts.dedup();
    let at = |count: usize| {
        let coarse = coarse(s, film, count)?;
        let of = |i: usize| value(both[i], coarse.least(both[i]).normal) / best[i] - 1.0;
        Some((count, [of(0), of(1)]))
    };
    counts.into_iter().filter_map(at).collect()
}
