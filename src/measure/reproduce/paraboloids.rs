//! Navratil 2015, sections 3.3 and 4.1: how good paraboloids are beside cubes, how fast where all lies on one side, and better ones.

use super::lamps::{crowd_of, lamp, map_ms, pass_ms, placed, told};
use super::{Bench, holds, short, with};
use crate::chart::{Lines, mark};
use crate::measure::{self, Record, table, timing};
use crate::scene::Camera;
use crate::setup::Setup;
use anyhow::Result;
use glam::vec3;

/// Figure 3.20: wrong pixels of a cube and of paraboloids over the maps' sides.
pub fn resolutions(b: &mut Bench) -> Result<String> {
    const SIDES: [u32; 4] = [256, 512, 1024, 2048];
    const WAYS: [(&str, &str, &[&str]); 3] = [
        ("cube", "cube", &[]),
        ("paraboloids, corners moved as his", "dual-paraboloid", &["raster=linear"]),
        ("paraboloids, exact", "dual-paraboloid", &["raster=exact"]),
    ];
    let start = placed(b, "hall", "room", Some("cage lamp"))?;
    let mut wrong = [[0.0; WAYS.len()]; SIDES.len()];
    let mut shown = Vec::new();
    for (i, side) in SIDES.into_iter().enumerate() {
        b.done(i, SIDES.len());
        for (k, (_, technique, sets)) in WAYS.into_iter().enumerate() {
            let setup = with(&start, technique, &[&[&*format!("resolution={side}")][..], sets].concat())?;
            let (renderer, _) = b.open("hall")?;
            wrong[i][k] = 100.0 * measure::errors(renderer, &setup)?.share();
            if side == 512 {
                shown.push(setup);
            }
        }
    }
    shown.push(with(&start, "rt-hard", &[])?);
    // The shadow of a chair on the floor.
    shown.iter_mut().for_each(|s| s.camera = Camera { target: vec3(3.38, 0.0, -0.1), fov: 18.0, ..s.camera });
    let head = ["maps", "cube, % wrong", "paraboloids, corners moved", "over the cube's", "exact", "over the cube's"];
    let mut rows = vec![head.map(String::from).to_vec()];
    for (side, row) in SIDES.iter().zip(&wrong) {
        let ratio = |k: usize| format!("{:.2}", row[k] / row[0].max(1e-9));
        rows.push(vec![format!("{side}²"), short(row[0]), short(row[1]), ratio(1), short(row[2]), ratio(2)]);
    }
    let line = |k: usize| {
        let points = SIDES.iter().zip(&wrong).map(|(side, row)| (f64::from(*side).log2(), row[k])).collect();
        // Of two ways of one technique the second keeps its mark.
        (WAYS[k].0.to_string(), if k == 1 { 0 } else { mark(WAYS[k].1) }, points)
    };
    let chart = Lines {
        title: "hall: wrong pixels over the maps' sides".into(),
        x: "side of each map, as a power of two".into(),
        y: "wrong pixels, % of those facing the light".into(),
        log_y: true,
        lines: (0..WAYS.len()).map(line).collect(),
    };
    let chart = b.chart("navratil-3.20", &chart)?;
    let panes = "A detail, maps of 512²: above the cube, and paraboloids with moved corners; below exact paraboloids, and the truth";
    let panes = b.panes("navratil-3.20.png", panes, &shown)?;
    let falls = |k: usize| (1..SIDES.len()).all(|i| wrong[i][k] < wrong[i - 1][k]);
    Ok(format!(
        "The hall under its cage lamp; {} × {} pixels.\n\n{}\n\
         - Higher resolution improves all three: {}.\n\
         - At the same side a paraboloid does not reach the cube's quality: {} of corners moved, {} of exact ones.\n\
         - Even 2048² paraboloids of moved corners err more than a cube of 512²: {}; exact ones: {}.\n\n{chart}{panes}",
        start.size[0],
        start.size[1],
        table::markdown(&rows),
        holds((0..WAYS.len()).all(falls)),
        holds(wrong.iter().all(|row| row[1] > row[0])),
        holds(wrong.iter().all(|row| row[2] > row[0])),
        holds(wrong[3][1] > wrong[1][0]),
        holds(wrong[3][2] > wrong[1][0]),
    ))
}

/// Figure 3.21: times of maps around a light on a wall, which all of the scene lies before.
pub fn one_side(b: &mut Bench) -> Result<String> {
    const VERTICES: [usize; 3] = [100_000, 600_000, 3_000_000];
    let head = ["vertices", "maps", "cube, ms", "paraboloids, ms", "cube / paraboloids", "drawing alone"];
    let mut rows = vec![head.map(String::from).to_vec()];
    let mut told_of = String::new();
    let mut ratios = Vec::new();
    for (i, vertices) in VERTICES.into_iter().enumerate() {
        b.done(i, VERTICES.len());
        let (mut renderer, mut start) = crowd_of(b, vertices)?;
        start.light = lamp(vec3(-19.99, 4.9, 0.0), 60.0);
        let drawn = 3 * renderer.scene().triangles();
        for culling in ["none", "casters"] {
            // As the lights of instant radiosity, it shines on what the camera does not see, too.
            let sets = ["resolution=512", &format!("culling={culling}")];
            let linear = [&sets[..], &["raster=linear"]].concat();
            let setups = [with(&start, "cube", &sets)?, with(&start, "dual-paraboloid", &linear)?];
            let times = timing::briefly(&mut renderer, &setups, 3)?;
            let [cube, sides] = [0, 1].map(|m| map_ms(&times[m]));
            let drawing = [0, 1].map(|m| pass_ms(&times[m], "shadow maps"));
            ratios.push((culling, cube / sides));
            rows.push(vec![
                drawn.to_string(),
                if culling == "none" { "all draw all" } else { "each draws its own" }.into(),
                short(cube),
                short(sides),
                format!("{:.2}", cube / sides),
                format!("{:.2}", drawing[0] / drawing[1]),
            ]);
            told_of = told(b, &start, &times);
        }
    }
    // The geometric mean over the levels of geometry, and how far the ratios spread.
    let of = |culling: &str| {
        let all: Vec<f64> = ratios.iter().filter(|r| r.0 == culling).map(|r| r.1.ln()).collect();
        let ends = [f64::min, f64::max].map(|end| all.iter().copied().reduce(end).unwrap_or(0.0));
        [(all.iter().sum::<f64>() / all.len() as f64).exp(), (ends[1] - ends[0]).exp()]
    };
    let [all, own] = [of("none"), of("casters")];
    Ok(format!(
        "{told_of}Maps of 512², around a light on a wall of a hall full of balls; nothing lies behind it but the wall.\n\n{}\n\
         - Paraboloids are about twice as fast where each map draws its own triangles: {}, {:.2} times on average.\n\
         - Where each map draws all: {}, {:.2} times.\n\
         - It is similar at all levels of geometry: {}; the ratios differ by up to {:.2} and {:.2} times.\n",
        table::markdown(&rows),
        holds((1.5..2.7).contains(&own[0])),
        own[0],
        holds((1.5..2.7).contains(&all[0])),
        all[0],
        holds(all[1].max(own[1]) <= 1.5),
        own[1],
        all[1],
    ))
}

/// Figure 4.1: a paraboloid turned and magnified to what is seen, beside two plain ones with as many texels.
pub fn improved(b: &mut Bench) -> Result<String> {
    let start = placed(b, "hall", "table", Some("cage lamp"))?;
    let ways: [(&str, &str, &[&str]); 4] = [
        ("two paraboloids, 1024² each", "dual-paraboloid", &["resolution=1024"]),
        ("improved, 1448²: as many texels", "ipsm", &["resolution=1448"]),
        ("improved, 1024²", "ipsm", &["resolution=1024"]),
        ("improved as published (mean cone), 1024²", "ipsm", &["resolution=1024", "cone=mean"]),
    ];
    let head = ["map", "utilisation", "texels looked up, %", "wrong pixels, %", "m: median", "largest"];
    let mut rows = vec![head.map(String::from).to_vec()];
    let mut found: Vec<Record> = Vec::new();
    let mut setups = Vec::new();
    for (i, (name, technique, sets)) in ways.into_iter().enumerate() {
        b.done(i, ways.len());
        let setup = with(&start, technique, sets)?;
        let (renderer, _) = b.open("hall")?;
        let r = measure::accuracy(renderer, &setup, 0)?;
        let of = |x: Option<f64>| x.map_or("-".into(), short);
        let covered = of(r.covered_share.map(|s| 100.0 * s));
        let cells = [of(r.utilisation), covered, short(100.0 * r.error_share), of(r.m_p50), of(r.m_max)];
        rows.push([&[name.to_string()][..], &cells].concat());
        found.push(r);
        setups.push(Setup { view: "visibility".into(), ..setup });
    }
    let shown =
        b.panes("navratil-4.1.png", "left two paraboloids, right the improved one with as many texels", &setups[..2])?;
    let better = found[1].error_share < found[0].error_share && found[1].utilisation > found[0].utilisation;
    Ok(format!(
        "The hall under its cage lamp, which stands outside the view; {} × {} pixels.\n\n{}\n\
         - At equal texels the improved map is used better and errs less: {}.\n\n{shown}",
        start.size[0],
        start.size[1],
        table::markdown(&rows),
        holds(better)
    ))
}

/// Figures 4.4 to 4.6: the solid angle of texels across the map, plain and skewed.
pub fn skewed(b: &mut Bench) -> Result<String> {
    let start = placed(b, "hall", "room", Some("cage lamp"))?;
    let mut text = String::new();
    for (i, view) in ["texel-angle", "shadow-maps", "texels"].into_iter().enumerate() {
        b.done(i, 3);
        let setups: Vec<Setup> = [0, 30]
            .iter()
            .map(|beta| {
                let setup =
                    with(&start, "skewed-paraboloid", &["resolution=512", &format!("beta={beta}"), "culling=none"])?;
                Ok(Setup { view: view.into(), ..setup })
            })
            .collect::<Result<_>>()?;
        text +=
            &b.panes(&format!("navratil-4.4-{view}.png"), &format!("{view}: left plain, right cut by 30°"), &setups)?;
    }
    // By closed form, as tests measure it on the map.
    let density = |degrees: f64| {
        let s = degrees.to_radians().sin();
        (1.0 + s) / (1.0 - s)
    };
    let rows: Vec<Vec<String>> = std::iter::once(["cut", "favoured rim", "opposite rim"].map(String::from).to_vec())
        .chain([0.0, 15.0, 30.0, 45.0, 60.0].map(|a| vec![format!("{a}°"), short(density(a)), short(1.0 / density(a))]))
        .collect();
    Ok(format!(
        "Texels per solid angle at the rim, over those of a plain paraboloid's rim, which has four times those of its middle:\n\n{}\n{text}",
        table::markdown(&rows)
    ))
}
