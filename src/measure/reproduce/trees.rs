//! Gerhards, Mora, Aveneau, Ghazanfarpour 2015: a tree of shadow volumes beside rays through a hierarchy of boxes.

use super::lamps::{crowd_of, pass_ms, told};
use super::{Bench, holds, short, with};
use crate::chart::{Lines, mark};
use crate::frame::{Ask, Renderer};
use crate::measure::metrics::FACING;
use crate::measure::{accuracy, table, timing};
use crate::scene::bvh::Bvh;
use crate::setup::Setup;
use crate::techniques;
use anyhow::Result;
use obvhs::triangle::Triangle;
use std::time::Instant;

/// Triangles of the balls in the halls, about.
const TRIANGLES: [usize; 6] = [1_000, 5_000, 20_000, 80_000, 200_000, 500_000];
const SCENES: [&str; 3] = ["bench", "blocks", "hall"];

/// Milliseconds that the rays' hierarchy takes to build: the median of three.
fn hierarchy_ms(renderer: &Renderer) -> f64 {
    let g = renderer.geometry();
    let corners = |i: usize| {
        let [v0, v1, v2] = g.corners(i).map(Into::into);
        Triangle { v0, v1, v2 }
    };
    let triangles: Vec<Triangle> = (0..g.triangles.len()).map(corners).collect();
    let mut times = [0.0; 3].map(|_: f64| {
        let start = Instant::now();
        let built = Bvh::new(&triangles);
        let ms = start.elapsed().as_secs_f64() * 1e3;
        drop(built);
        ms
    });
    times.sort_by(f64::total_cmp);
    times[1]
}

/// Triangles that a pixel visits on average: of the lit ones, and of those in shadow.
fn visits(renderer: &mut Renderer, start: &Setup, prune: bool) -> Result<[f64; 2]> {
    let mut setup = with(start, "psv", &[&format!("prune={prune}")])?;
    setup.view = "visits".into();
    renderer.render(&setup, Ask::of(&setup))?;
    let (map, lit, mask) = (renderer.read_map()?, renderer.read_visibility()?, renderer.read_mask()?);
    let mut sums = [(0.0, 0u32); 2];
    for ((n, lit), _) in map.iter().zip(&lit).zip(&mask).filter(|(_, m)| **m == FACING) {
        let sum = &mut sums[(*lit < 0.5) as usize];
        *sum = (sum.0 + *n as f64, sum.1 + 1);
    }
    Ok(sums.map(|(sum, count)| sum / count.max(1) as f64))
}

/// Tree and hierarchy over the number of triangles, and what pruning saves.
pub fn crossing(b: &mut Bench) -> Result<String> {
    let steps = TRIANGLES.len() + SCENES.len();
    let head = [
        "triangles",
        "tree built, ms",
        "walk",
        "both",
        "hierarchy built, ms",
        "rays",
        "both",
        "tree / rays, all",
        "walk / rays",
    ];
    let mut lines = vec![head.map(String::from).to_vec()];
    let mut points = [vec![], vec![], vec![], vec![]];
    let (mut text, mut walked) = (String::new(), Vec::new());
    for (i, triangles) in TRIANGLES.into_iter().enumerate() {
        b.done(i, steps);
        let (mut renderer, start) = crowd_of(b, 3 * triangles)?;
        let setups = [with(&start, "psv", &[])?, with(&start, "rt-hard", &[])?];
        let times = timing::briefly(&mut renderer, &setups, 5)?;
        let [build, walk] = ["shadow planes (CPU)", "walk"].map(|pass| pass_ms(&times[0], pass));
        let (boxes, rays) = (hierarchy_ms(&renderer), pass_ms(&times[1], "shadow rays"));
        let n = renderer.geometry().triangles.len();
        let ms = [build, walk, build + walk, boxes, rays, boxes + rays].map(short);
        let ratios = [(build + walk) / (boxes + rays), walk / rays];
        lines.push([vec![n.to_string()], ms.to_vec(), ratios.map(short).to_vec()].concat());
        for (points, ms) in points.iter_mut().zip([build + walk, walk, boxes + rays, rays]) {
            points.push(((n as f64).log10(), ms));
        }
        walked.push(walk / rays);
        if i + 1 == TRIANGLES.len() {
            text = told(b, &start, &times);
        }
    }
    text += &table::markdown(&lines);
    let names =
        [("tree and walk", "psv"), ("walk alone", "psv"), ("hierarchy and rays", "rt-hard"), ("rays alone", "rt-hard")];
    let chart = Lines {
        title: "Shadow planes and rays over the number of triangles".into(),
        x: "triangles, power of ten".into(),
        y: "ms".into(),
        log_y: true,
        lines: names.iter().zip(points).map(|((name, of), p)| (name.to_string(), mark(of), p)).collect(),
    };
    text += "\n";
    text += &b.chart("psv-crossing", &chart)?;
    let cheaper = walked.iter().filter(|ratio| **ratio < 1.0).count();
    text += &format!("\nThe walk is quicker than rays in {cheaper} of {} halls.\n", walked.len());

    let head = [
        "scene",
        "visits of a lit pixel",
        "not pruned",
        "in shadow",
        "not pruned",
        "pruning saves, lit",
        "in shadow",
        "fragments of `shadow-volume` a pixel",
    ];
    let mut lines = vec![head.map(String::from).to_vec()];
    let mut most = true;
    for (i, scene) in SCENES.into_iter().enumerate() {
        b.done(TRIANGLES.len() + i, steps);
        let (renderer, start) = b.open(scene)?;
        let start = Setup { size: super::lamps::SIZE, ..start };
        let [[lit, dark], [all_lit, all_dark]] = [visits(renderer, &start, true)?, visits(renderer, &start, false)?];
        // Where that technique is there.
        let fragments = match techniques::find("shadow-volume") {
            Some(info) if info.refuses(&start.light).is_none() => {
                let record = accuracy(renderer, &with(&start, info.id, &[])?, 0)?;
                record.fragments.map(|n| short(n as f64 / (start.size[0] * start.size[1]) as f64))
            }
            _ => None,
        };
        let saved = [1.0 - lit / all_lit, 1.0 - dark / all_dark];
        most &= saved[0] > saved[1];
        let percent = saved.map(|s| format!("{:.0} %", 100.0 * s));
        let counts = [lit, all_lit, dark, all_dark].map(short);
        lines.push(
            [vec![scene.to_string()], counts.to_vec(), percent.to_vec(), vec![fragments.unwrap_or("-".into())]]
                .concat(),
        );
    }
    text += "\n";
    text += &table::markdown(&lines);
    text += &format!("\nThat pruning saves most on lit pixels {}.\n", holds(most));
    Ok(text)
}
