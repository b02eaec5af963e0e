//! Chong 2003: shadow maps in flatland.

use super::{Bench, short};
use crate::flatland::{self, Badness};
use crate::measure::table;
use anyhow::{Context, Result};

/// His rows for a scene: the film's angle, and worst, average and mean + σ in pixels per texel.
struct Theirs {
    best: [f64; 4],
    perspective: [f64; 4],
    common: [f64; 4],
}

/// In the order of [`flatland::scenes`].
const THEIRS: [Theirs; 4] = [
    Theirs {
        best: [9.0, 0.975, 0.960, 0.968],
        perspective: [91.0, 4.33, 1.88, 3.10],
        common: [51.0, 2.08, 1.17, 1.65],
    },
    Theirs { best: [24.8, 1.54, 1.09, 1.42], perspective: [86.8, 4.74, 1.95, 3.20], common: [25.3, 1.54, 1.09, 1.42] },
    Theirs { best: [5.11, 6.42, 3.38, 4.39], perspective: [77.3, 73.7, 44.4, 67.4], common: [83.1, 76.7, 46.2, 70.2] },
    Theirs { best: [33.9, 60.0, 17.7, 41.4], perspective: [67.7, 72.7, 22.1, 50.5], common: [83.7, 82.5, 25.3, 57.5] },
];

pub fn run(b: &mut Bench) -> Result<String> {
    b.done(0, 1);
    let head = [
        "scene",
        "method",
        "angle, °: his",
        "ours",
        "worst: his",
        "ours",
        "average: his",
        "ours",
        "mean + σ: his",
        "ours",
    ];
    let mut lines = vec![head.map(String::from).to_vec()];
    let mut ratios = Vec::new();
    for ((name, world), theirs) in flatland::scenes().iter().zip(&THEIRS) {
        let film = world.film().with_context(|| format!("{name}: nothing is seen"))?;
        let [near_line, exact] = world.perspective(&film).with_context(|| format!("{name}: there is no near line"))?;
        let mut row = |method: &str, theirs: Option<&[f64; 4]>, normal: f64| {
            let Badness { worst, mean, mean_sigma } = film.badness(normal);
            // Of the line, counter-clockwise with 0 upright, as he has it; a line's angle is one of 180.
            let angle = (-normal.to_degrees() + 45.0).rem_euclid(180.0) - 45.0;
            let ours = [angle, worst, mean, mean_sigma];
            let mut line = vec![name.to_string(), method.to_string()];
            for (i, x) in ours.iter().enumerate() {
                line.push(theirs.map_or("-".into(), |t| short(t[i])));
                line.push(if i == 0 { format!("{x:.1}") } else { short(*x) });
            }
            lines.push(line);
            mean
        };
        let best = row("least average (L1)", Some(&theirs.best), film.least_mean());
        let common = row("common (half angle)", Some(&theirs.common), film.half_angle());
        let perspective = row("perspective, near line", Some(&theirs.perspective), near_line);
        let exact = row("perspective, its texels", None, exact);
        let of = |row: &[f64; 4]| row[2] / theirs.best[2];
        let all = [common, perspective, exact].map(|x| x / best);
        ratios.push(vec![
            name.to_string(),
            format!("{:.2}", of(&theirs.common)),
            format!("{:.2}", all[0]),
            format!("{:.2}", of(&theirs.perspective)),
            format!("{:.2}", all[1]),
            format!("{:.2}", all[2]),
        ]);
    }
    let head =
        ["average over the least", "common: his", "ours", "perspective, near line: his", "ours", "its texels: ours"];
    ratios.insert(0, head.map(String::from).to_vec());
    Ok(format!(
        "Pixels a texel over an image of 100 pixels from a map of 100 texels; angles are those of the film line, 0 upright.\n\n\
         {}\n{}\n{READINGS}",
        table::markdown(&lines),
        table::markdown(&ratios)
    ))
}

const READINGS: &str = "\
He takes the angle of a perspective map from the near line of its frustum, pushed to what the light meets first and taken
back to the world, as if texels lay evenly on that line there. They lie evenly in post-perspective space; the last row of
each scene counts them so, and the near line's distance then does not matter. No row beats the least average. Counted so,
the perspective map is within 1 % of the best on the single plane, where the lamp stands almost on the line through the eye
across the view (his own ideal case), better than in his reading on the simple geometry, and worse in the other two. His
reading's row on the single plane is sensitive: the film is there but 2° from being parallel to the ray to the floor's
farthest pixel, which lies over 170 m away in our scene.
";
