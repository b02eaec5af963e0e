//! Chong's tables for any world: how each way to turn the light's film does.

use super::split::{self, split};
use super::{Badness, Film, Flatland, Metric};
use crate::measure::reproduce::short;
use crate::measure::table::markdown;
use anyhow::{Context, Result};
use serde::Serialize;

/// A film, and pixels a texel on it.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    pub method: &'static str,
    /// Of the film line, degrees counter-clockwise, 0 upright; from -45 to 135, as a line's angle is one of 180.
    pub angle: f64,
    pub worst: f64,
    pub average: f64,
    pub mean_sigma: f64,
    /// Steps of Newton's method, where it is used.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub steps: Option<usize>,
    /// Direction of the film's normal, radians.
    #[serde(skip)]
    pub normal: f64,
}

/// The light's frustum in parts.
#[derive(Clone, Debug, Serialize)]
pub struct Split {
    pub metric: &'static str,
    pub frusta: usize,
    /// How many equal parts were merged.
    pub of: usize,
    pub lexels: Vec<usize>,
    pub worst: f64,
    pub average: f64,
    pub mean_sigma: f64,
}

/// All that the tables say of a world.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    pub scene: String,
    /// Pixels that see something, of how many.
    pub seen: usize,
    pub pixels: usize,
    pub lexels: usize,
    /// Span of the directions from the light to what is seen, degrees.
    pub span: f64,
    pub methods: Vec<Row>,
    pub splits: Vec<Split>,
}

/// The rows' names.
pub const METHODS: [&str; 6] = [
    "least average (L1)",
    "least mean square (L2)",
    "least worst (L∞)",
    "common (half angle)",
    "perspective, near line",
    "perspective, its texels",
];

/// Equal parts that are merged to begin with.
pub const FIRST: usize = 16;

impl Report {
    /// # Errors
    /// A world in which nothing is seen, or not all of it lies before the light.
    pub fn of(scene: &str, world: &Flatland) -> Result<Report> {
        let film = world.film().with_context(|| {
            format!("{scene}: the camera sees nothing, or what it sees spans no angle as seen from the light, or not less than 180°")
        })?;
        let methods = methods(world, &film, 1.0);
        let mut splits = Vec::new();
        for metric in [Metric::L1, Metric::L2] {
            for frusta in 1..=4 {
                let parts = split(&film, metric, frusta, FIRST);
                let Badness { worst, mean, mean_sigma } = split::badness(&film, &parts);
                let lexels = parts.iter().map(|p| p.lexels).collect();
                splits.push(Split {
                    metric: metric.name(),
                    frusta,
                    of: FIRST,
                    lexels,
                    worst,
                    average: mean,
                    mean_sigma,
                });
            }
        }
        Ok(Report {
            scene: scene.into(),
            seen: film.samples.len(),
            pixels: world.pixels,
            lexels: world.lexels,
            span: (film.top - film.bottom).to_degrees(),
            methods,
            splits,
        })
    }

    /// The row of a method, if the world has it.
    pub fn row(&self, method: &str) -> Option<&Row> {
        self.methods.iter().find(|r| r.method == method)
    }

    /// As Markdown.
    pub fn text(&self) -> String {
        let least = self.methods[0].average;
        let head = ["method", "angle, °", "worst", "average", "mean + σ", "average over the least"];
        let mut lines = vec![head.map(String::from).to_vec()];
        for r in &self.methods {
            let ratio = format!("{:.2}", r.average / least);
            lines.push(vec![
                r.method.into(),
                format!("{:.2}", r.angle),
                short(r.worst),
                short(r.average),
                short(r.mean_sigma),
                ratio,
            ]);
        }
        let head = ["metric", "frusta", "texels of each", "worst", "average", "mean + σ"];
        let mut parts = vec![head.map(String::from).to_vec()];
        for s in &self.splits {
            let lexels: Vec<String> = s.lexels.iter().map(usize::to_string).collect();
            parts.push(vec![
                s.metric.into(),
                s.frusta.to_string(),
                lexels.join(" + "),
                short(s.worst),
                short(s.average),
                short(s.mean_sigma),
            ]);
        }
        format!(
            "## {}\n\nPixels a texel; {} of {} pixels see something, over {:.2}° as seen from the light, whose film has {} \
             texels. Angles are those of the film line, 0 upright.\n\n{}\n{}",
            self.scene,
            self.seen,
            self.pixels,
            self.span,
            self.lexels,
            markdown(&lines),
            markdown(&parts)
        )
    }
}

/// Each method's film, as far as there is a valid one. `push`: as [`Flatland::perspective`] takes it.
pub fn methods(world: &Flatland, film: &Film, push: f64) -> Vec<Row> {
    let mut methods: Vec<Row> = Vec::new();
    for (method, metric) in METHODS.into_iter().zip(Metric::ALL) {
        let least = film.least(metric);
        let steps = (metric == Metric::L2).then_some(least.steps);
        methods.push(Row { steps, ..row(film, method, least.normal) });
    }
    methods.push(row(film, METHODS[3], film.half_angle()));
    if let Some(p) = world.perspective(film, push) {
        let both = METHODS[4..].iter().zip([p.near_line, p.texels]);
        methods.extend(both.filter(|(_, x)| film.is_valid(*x)).map(|(method, x)| row(film, method, x)));
    }
    methods
}

/// The figures of a film with this normal.
pub fn row(film: &Film, method: &'static str, normal: f64) -> Row {
    let Badness { worst, mean, mean_sigma } = film.badness(normal);
    Row { method, angle: angle(normal), worst, average: mean, mean_sigma, steps: None, normal }
}

/// The angle of a film line with this normal as the tables give it, degrees.
pub fn angle(normal: f64) -> f64 {
    (-normal.to_degrees() + 45.0).rem_euclid(180.0) - 45.0
}
