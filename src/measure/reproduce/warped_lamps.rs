//! Navratil 2015, section 5.3.1: cubes and paraboloids with non-orthogonal warps.

use super::lamps::{frame_ms, lamp, map_ms, pass_ms, placed, told};
use super::{Bench, holds, short, with};
use crate::frame::{Ask, Truth};
use crate::measure::{self, Record, table, timing};
use crate::setup::Setup;
use crate::truth::Samples;
use anyhow::{Context, Result};
use glam::vec3;

/// A row of table 5.2: his name, ours, and his milliseconds of a frame, of its maps and of its look-up.
struct Row {
    name: &'static str,
    technique: &'static str,
    his: [f64; 3],
}

const fn row(name: &'static str, technique: &'static str, his: [f64; 3]) -> Row {
    Row { name, technique, his }
}

/// Each plain map before the same one warped.
const ROWS: [Row; 4] = [
    row("CubeSM", "cube", [2.5, 0.38, 0.10]),
    row("CubeSM with warping", "notw-cube", [5.8, 3.6, 0.11]),
    row("DPSM", "dual-paraboloid", [2.3, 0.16, 0.09]),
    row("DPSM with warping", "notw-paraboloid", [3.4, 1.2, 0.10]),
];

/// Side of each map, texels.
const SIDE: u32 = 512;

/// Table 5.2 and figures 5.7 to 5.9.
pub fn warped(b: &mut Bench) -> Result<String> {
    let start = placed(b, "hall", "room", None)?;
    // Just before the camera and in its view.
    let start = Setup { light: lamp(vec3(5.7, 1.95, -0.2), 40.0), truth_samples: Samples::Fixed(1), ..start };
    let resolution = format!("resolution={SIDE}");
    let all = |sets: &[&str]| -> Result<Vec<Setup>> {
        let sets = [&[&*resolution], sets].concat();
        // A cube's own raster is always exact.
        let of = |r: &Row| with(&start, r.technique, if r.technique == "cube" { &sets[..1] } else { &sets });
        ROWS.iter().map(of).collect()
    };
    // He moves corners, which is quick; where triangles are as large as here it is wrong, too.
    let (setups, quick) = (all(&[])?, all(&["raster=linear"])?);
    let (renderer, _) = b.open("hall")?;
    let times = timing::briefly(renderer, &quick, 2)?;
    let mut found: Vec<Record> = Vec::new();
    for (i, setup) in setups.iter().enumerate() {
        b.done(1 + i, 3 + ROWS.len());
        let (renderer, _) = b.open("hall")?;
        found.push(measure::accuracy(renderer, setup, 0)?);
    }
    let mut moved = Vec::new();
    for setup in &quick {
        moved.push(measure::errors(b.open("hall")?.0, setup)?.share());
    }
    let (cost, quality) = (costs(&times), qualities(&found, &moved));
    let (cube, sides) = (fullest(b, &quick[0])?, fullest(b, &quick[2])?);
    let gain = |i: usize| found[i].error_share / found[i + 1].error_share.max(1e-9);
    let mut text = format!(
        "{}The hall with a lamp in view; maps of {SIDE}². Times with corners moved, as he does:\n\n{cost}\n\
         Quality, and the pictures, with each texel's ray meeting the triangles themselves:\n\n{quality}\n\
         - Most of the view samples look up one of the cube's faces: {} ({:.0} %); of the paraboloids' sides the fuller has \
         {:.0} %.\n\
         - Warping uses the texels better: {} of the cube, {} of paraboloids.\n\
         - It makes paraboloids better by more than the cube: {}, {:.2} times fewer wrong pixels beside {:.2}.\n\
         - The look-up costs next to nothing more: {}.\n\
         - The cube's maps become dearer by more than the paraboloids': {}.\n\n",
        told(b, &start, &times),
        holds(cube > 0.5),
        100.0 * cube,
        100.0 * sides,
        holds(found[1].utilisation > found[0].utilisation),
        holds(found[3].utilisation > found[2].utilisation),
        holds(gain(2) > gain(0)),
        gain(2),
        gain(0),
        holds([0, 2].iter().all(|i| pass_ms(&times[i + 1], "resolve") < 1.25 * pass_ms(&times[*i], "resolve"))),
        holds(map_ms(&times[1]) / map_ms(&times[0]) > map_ms(&times[3]) / map_ms(&times[2])),
    );
    let sides = "left cubes, right paraboloids; above plain, below warped";
    let order = [0, 2, 1, 3];
    for (i, (view, figure, what)) in
        [("error", "5.7", "Wrong pixels"), ("shadow-maps", "5.8", "Shadow maps"), ("counts", "5.9", "Count maps")]
            .into_iter()
            .enumerate()
    {
        b.done(3 + i, 3 + ROWS.len());
        let shown: Vec<Setup> = order.iter().map(|k| Setup { view: view.into(), ..setups[*k].clone() }).collect();
        text += &b.panes(&format!("navratil-{figure}.png"), &format!("{what}: {sides}"), &shown)?;
    }
    text += &b.capture("navratil-5.7-truth.png", "The truth of figure 5.7", &with(&start, "rt-hard", &[])?)?;
    Ok(text)
}

/// Table 5.2.
fn costs(times: &[timing::Times]) -> String {
    let mut head = vec!["method".to_string()];
    head.extend(
        ["frame", "maps", "look-up"]
            .iter()
            .flat_map(|what| [format!("{what}, ms: his"), "ours".into(), "over plain: his".into(), "ours".into()]),
    );
    let mut rows = vec![head];
    for (i, method) in ROWS.iter().enumerate() {
        let ours = |i: usize| [frame_ms(&times[i]), map_ms(&times[i]), pass_ms(&times[i], "resolve")];
        let plain = i - i % 2;
        let mut cells = vec![method.name.to_string()];
        for k in 0..3 {
            cells.extend([format!("{:.2}", method.his[k]), short(ours(i)[k])]);
            cells.extend([method.his[k] / ROWS[plain].his[k], ours(i)[k] / ours(plain)[k]].map(|x| format!("{x:.2}")));
        }
        rows.push(cells);
    }
    table::markdown(&rows)
}

/// What the warps buy; `moved`: wrong pixels with corners moved only, shares.
fn qualities(found: &[Record], moved: &[f64]) -> String {
    let head = [
        "method",
        "wrong pixels, %",
        "plain over it",
        "utilisation",
        "texels looked up, %",
        "m: median",
        "corners moved: wrong, %",
    ];
    let mut rows = vec![head.map(String::from).to_vec()];
    for (i, (method, r)) in ROWS.iter().zip(found).enumerate() {
        let of = |x: Option<f64>| x.map_or("-".into(), short);
        let plain = found[i - i % 2].error_share / r.error_share.max(1e-9);
        rows.push(vec![
            method.name.to_string(),
            short(100.0 * r.error_share),
            format!("{plain:.2}"),
            of(r.utilisation),
            of(r.covered_share.map(|s| 100.0 * s)),
            of(r.m_p50),
            short(100.0 * moved[i]),
        ]);
    }
    table::markdown(&rows)
}

/// The share of the view samples that look up the map with the most of them.
fn fullest(b: &mut Bench, setup: &Setup) -> Result<f64> {
    let (renderer, _) = b.open(&setup.scene)?;
    renderer.render(setup, Ask { picture: false, truth: Truth::Off, ..Ask::of(setup) })?;
    let samples: Vec<u32> = renderer.known()?.faces.iter().flatten().map(|[samples, _]| *samples).collect();
    let most = samples.iter().max().context("no map is drawn")?;
    Ok(f64::from(*most) / f64::from(samples.iter().sum::<u32>().max(1)))
}
