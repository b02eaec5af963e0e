//! Navratil 2015, sections 3.3, 4.1 and 5: lights that shine in all directions.

use super::{Bench, holds, short, with};
use crate::chart::{Lines, mark};
use crate::frame::{Ask, Renderer};
use crate::light::Light;
use crate::measure::timing::{self, Times};
use crate::measure::{self, Record, table};
use crate::scene::builtin::crowd;
use crate::setup::Setup;
use anyhow::{Context, Result};
use glam::{Vec3, vec3};
use std::f32::consts::TAU;
use std::sync::Arc;

/// A row of his tables: his name, ours, and his frames a second at 1024² texels in tables 3.1 and 3.2.
struct Method {
    name: &'static str,
    technique: &'static str,
    culling: &'static str,
    rates: Option<[f64; 2]>,
}

const fn method(name: &'static str, technique: &'static str, culling: &'static str, rates: Option<[f64; 2]>) -> Method {
    Method { name, technique, culling, rates }
}

/// The unoptimised cube first. What he did not have is last.
const METHODS: [Method; 8] = [
    method("Cube6", "cube", "none", Some([75.71, 19.11])),
    method("Cube6Optim", "cube", "casters", Some([150.43, 57.15])),
    method("Cube6Opt+EFC", "cube", "view", Some([188.71, 127.47])),
    method("DP", "dual-paraboloid", "none", Some([167.95, 41.50])),
    method("DPOptim", "dual-paraboloid", "casters", Some([207.24, 57.47])),
    method("DPOptim+PC", "dual-paraboloid", "view", Some([208.15, 90.56])),
    method("cube, by samples", "cube", "samples", None),
    method("dual paraboloid, by samples", "dual-paraboloid", "samples", None),
];

impl Method {
    /// The set-up with it. His paraboloids move corners only, and have fine casters.
    fn apply(&self, start: &Setup, resolution: u32) -> Result<Setup> {
        let mut sets = vec![format!("resolution={resolution}"), format!("culling={}", self.culling)];
        if self.technique != "cube" {
            sets.push("raster=linear".into());
        }
        with(start, self.technique, &sets.iter().map(String::as_str).collect::<Vec<_>>())
    }
}

/// A light at a place.
fn lamp(position: Vec3, range: f32) -> Light {
    Light::Omni { position, range, radius: 0.0, color: Vec3::splat(12.0) }
}

/// The technique's passes but for the look-up, milliseconds.
fn map_ms(t: &Times) -> f64 {
    let own = |name: &str| !crate::frame::SHARED_PASSES.contains(&name) && name != "resolve";
    t.passes.iter().filter(|(name, _)| own(name)).map(|(_, q)| q.median).sum()
}

/// The whole frame without the picture: the G-buffer and the technique's passes.
fn frame_ms(t: &Times) -> f64 {
    let g_buffer: f64 = t.passes.iter().filter(|(name, _)| name == "G-buffer").map(|(_, q)| q.median).sum();
    g_buffer + t.gpu.median
}

/// Maps that a frame draws.
fn maps_drawn(renderer: &mut Renderer, setup: &Setup) -> Result<usize> {
    renderer.render(setup, Ask { picture: false, truth: crate::frame::Truth::Off, ..Ask::of(setup) })?;
    Ok(renderer.known()?.faces.iter().flatten().count())
}

fn told(b: &Bench, setup: &Setup, times: &[Times]) -> String {
    let frames = times.iter().map(|t| t.gpu.frames).min().unwrap_or(0);
    let software = if b.gpu.software() { " Software: compare ratios only." } else { "" };
    let [w, h] = setup.size;
    format!("{w} × {h} pixels, {}; medians of {frames} frames or more, taking turns.{software}\n", b.gpu.info.name)
}

/// Frames of the walk.
const STEPS: usize = 16;

/// Figures 3.16 to 3.18: a light that wanders through two scenes, in and out of view.
pub fn walk(b: &mut Bench) -> Result<String> {
    // Round the camera's room: the middle of an ellipse, its half axes, and how far up and down the light goes.
    let ways = [
        ("hall", "room", vec3(0.0, 1.7, 0.0), vec3(5.6, 0.9, 3.0)),
        ("arches", "atrium", vec3(0.0, 3.2, 0.0), vec3(11.0, 1.6, 3.4)),
    ];
    let shown = [&METHODS[2], &METHODS[6], &METHODS[5], &METHODS[7]];
    let mut text = String::new();
    let mut all_times = Vec::new();
    let mut base = None;
    for (i, (scene, view, middle, half)) in ways.into_iter().enumerate() {
        let (_, start) = b.open(scene)?;
        let mut start = Setup { size: [480, 270], ..start };
        start.camera = {
            let (renderer, _) = b.open(scene)?;
            let found = renderer.scene().cameras.iter().find(|c| c.name == view);
            found.with_context(|| format!("{scene} has no camera {view}"))?.camera
        };
        let mut lines: [Vec<Vec<(f64, f64)>>; 3] = [0; 3].map(|_| vec![Vec::new(); shown.len()]);
        for k in 0..STEPS {
            b.done(i * STEPS + k, ways.len() * STEPS);
            let turn = TAU * k as f32 / STEPS as f32;
            let at = middle + half * vec3(turn.cos(), (2.0 * turn).sin(), turn.sin());
            start.light = lamp(at, 40.0);
            let (renderer, _) = b.open(scene)?;
            let setups: Vec<Setup> = shown.iter().map(|m| m.apply(&start, 512)).collect::<Result<_>>()?;
            let times = timing::time(renderer, &setups, &mut |_| true)?;
            for (m, setup) in setups.iter().enumerate() {
                let e = measure::errors(renderer, setup)?;
                let error = 100.0 * (e.lit_incorrect + e.shadow_incorrect) as f64 / e.facing.max(1) as f64;
                let figures = [maps_drawn(renderer, setup)? as f64, map_ms(&times[m]), error];
                lines.iter_mut().zip(figures).for_each(|(line, y)| line[m].push((k as f64, y)));
            }
            all_times.extend(times);
        }
        let titles = [
            ("maps", "maps drawn", "maps drawn"),
            ("ms", "time of the maps", "time of the maps, ms"),
            ("error", "wrong pixels", "wrong pixels, % of those facing the light"),
        ];
        for (line, (name, title, y)) in lines.iter().zip(titles) {
            let chart = Lines {
                title: format!("{scene}: {title} along the light's way"),
                x: "frame".into(),
                y: y.into(),
                log_y: false,
                lines: (shown.iter().zip(line))
                    .map(|(m, points)| (m.name.to_string(), mark(m.technique), points.clone()))
                    .collect(),
            };
            text += &b.chart(&format!("navratil-3.16-{scene}-{name}"), &chart)?;
        }
        let mean = |of: usize, m: usize| lines[of][m].iter().map(|p| p.1).sum::<f64>() / STEPS as f64;
        let most = |m: usize| lines[0][m].iter().map(|p| p.1).fold(0.0, f64::max);
        let head = ["method", "maps drawn: mean", "most", "map time, ms: mean", "wrong pixels, %: mean"];
        let mut rows = vec![head.map(String::from).to_vec()];
        for (m, method) in shown.iter().enumerate() {
            let cells = [short(mean(0, m)), short(most(m)), short(mean(1, m)), short(mean(2, m))];
            rows.push([&[method.name.to_string()][..], &cells].concat());
        }
        text += &format!("\n{scene}:\n\n{}\n", table::markdown(&rows));
        let few = lines[0][0].iter().filter(|p| p.1 <= 2.0).count();
        text += &format!(
            "Of {STEPS} frames the cube draws two faces or fewer in {few} by its frusta and in {} by samples; it never draws more \
             faces by samples: {}.\n\n",
            lines[0][1].iter().filter(|p| p.1 <= 2.0).count(),
            holds(lines[0][0].iter().zip(&lines[0][1]).all(|(a, b)| b.1 <= a.1))
        );
        base = Some(start);
    }
    let base = base.context("there is a scene")?;
    Ok(format!("{}Maps of 512²; {STEPS} places of the light.\n\n{text}", told(b, &base, &all_times)))
}

/// Tables 3.1 and 3.2: two scenes, each with every method, as ratios to the unoptimised cube.
pub fn rates(b: &mut Bench) -> Result<String> {
    const VERTICES: [usize; 2] = [600_000, 3_000_000];
    const PLACES: usize = 2;
    let mut frames = [[0.0; METHODS.len()]; 2];
    let mut maps = [[0usize; METHODS.len()]; 2];
    let mut bytes = [0u64; METHODS.len()];
    let (mut told_of, mut drawn_vertices) = (String::new(), [0; 2]);
    let mut least = usize::MAX;
    for (i, vertices) in VERTICES.into_iter().enumerate() {
        let scene = crowd::build(vertices);
        drawn_vertices[i] = 3 * scene.triangles();
        let mut start = Setup::new("crowd", &scene)?;
        start.size = [480, 270];
        // The scene opened last is let go of first.
        b.open = None;
        let mut renderer = Renderer::new(b.gpu.clone(), Arc::new(scene))?;
        for place in 0..PLACES {
            b.done(i * PLACES + place, VERTICES.len() * PLACES);
            let turn = TAU * place as f32 / PLACES as f32;
            start.light = lamp(vec3(17.0 * turn.cos(), 4.0 + 2.0 * (3.0 * turn).sin(), 17.0 * turn.sin()), 60.0);
            let setups: Vec<Setup> = METHODS.iter().map(|m| m.apply(&start, 1024)).collect::<Result<_>>()?;
            let times = timing::time(&mut renderer, &setups, &mut |_| true)?;
            for (m, setup) in setups.iter().enumerate() {
                frames[i][m] += frame_ms(&times[m]) / PLACES as f64;
                let drawn = maps_drawn(&mut renderer, setup)?;
                maps[i][m] += drawn;
                if METHODS[m].technique == "cube" && METHODS[m].culling == "view" {
                    least = least.min(drawn);
                }
                let faces = if METHODS[m].technique == "cube" { 6 } else { 2 };
                bytes[m] = (faces * 4) << 20;
            }
            told_of = told(b, &start, &times);
        }
    }
    let head = ["method", "3.1: his", "ours", "maps drawn", "3.2: his", "ours", "maps drawn", "maps, MB"];
    let mut rows = vec![head.map(String::from).to_vec()];
    for (m, method) in METHODS.iter().enumerate() {
        let mut row = vec![method.name.to_string()];
        for i in 0..2 {
            row.push(method.rates.map_or("-".into(), |r| format!("{:.2}", r[i] / METHODS[0].rates.unwrap_or(r)[i])));
            row.push(format!("{:.2}", frames[i][0] / frames[i][m]));
            row.push(format!("{:.1}", maps[i][m] as f64 / PLACES as f64));
        }
        row.push(format!("{}", bytes[m] >> 20));
        rows.push(row);
    }
    let order = |i: usize, a: usize, b: usize| frames[i][b] <= frames[i][a];
    let kept = (0..2).all(|i| order(i, 0, 1) && order(i, 1, 2) && order(i, 3, 4) && order(i, 4, 5) && order(i, 0, 3));
    Ok(format!(
        "{told_of}Maps of 1024²; {} and {} vertices; {PLACES} places of the light. Frames a second over those of the unoptimised \
         cube:\n\n{}\n\
         - Each step of optimisation is no slower, and two paraboloids are faster than six faces: {}.\n\
         - Face culling leaves as few as {least} of six faces.\n\
         - Two paraboloids take a third of the cube's memory at the same side.\n",
        drawn_vertices[0],
        drawn_vertices[1],
        table::markdown(&rows),
        holds(kept)
    ))
}

/// Figure 4.1: a paraboloid turned and magnified to what is seen, beside two plain ones with as many texels.
pub fn improved(b: &mut Bench) -> Result<String> {
    let (_, start) = b.open("hall")?;
    let mut start = Setup { size: [480, 270], ..start };
    {
        let (renderer, _) = b.open("hall")?;
        let scene = renderer.scene();
        start.camera = scene.cameras.iter().find(|c| c.name == "table").context("hall has a table")?.camera;
        start.light = scene.lights.iter().find(|l| l.name == "cage lamp").context("hall has a lamp")?.light;
    }
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
    let (_, start) = b.open("hall")?;
    let mut start = Setup { size: [480, 270], ..start };
    {
        let (renderer, _) = b.open("hall")?;
        start.light = renderer.scene().lights.iter().find(|l| l.name == "cage lamp").context("hall has a lamp")?.light;
    }
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
