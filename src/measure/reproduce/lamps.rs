//! Navratil 2015, section 3.3: cubes and paraboloids around lights that shine in all directions, and how much of them is drawn.

use super::{Bench, holds, short, with};
use crate::chart::{Lines, mark};
use crate::frame::{Ask, Renderer};
use crate::light::Light;
use crate::measure::timing::{self, Times};
use crate::measure::{self, table};
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

/// Pixels of the pictures.
const SIZE: [u32; 2] = [480, 270];

/// A light at a place.
pub fn lamp(position: Vec3, range: f32) -> Light {
    Light::Omni { position, range, radius: 0.0, color: Vec3::splat(12.0) }
}

/// A crowd of so many vertices, and the set-up that it starts with. The scene opened last is let go of first.
pub fn crowd_of(b: &mut Bench, vertices: usize) -> Result<(Renderer, Setup)> {
    b.open = None;
    let scene = crowd::build(vertices);
    let start = Setup { size: SIZE, ..Setup::new("crowd", &scene)? };
    Ok((Renderer::new(b.gpu.clone(), Arc::new(scene))?, start))
}

/// A built-in scene from one of its cameras, under one of its lights or the one that it starts with.
pub fn placed(b: &mut Bench, scene: &str, camera: &str, light: Option<&str>) -> Result<Setup> {
    let (renderer, start) = b.open(scene)?;
    let mut start = Setup { size: SIZE, ..start };
    let all = renderer.scene();
    let found = all.cameras.iter().find(|c| c.name == camera);
    start.camera = found.with_context(|| format!("{scene} has no camera {camera}"))?.camera;
    if let Some(light) = light {
        let found = all.lights.iter().find(|l| l.name == light);
        start.light = found.with_context(|| format!("{scene} has no light {light}"))?.light;
    }
    Ok(start)
}

/// The passes of a name, milliseconds; those of masked casters too.
pub fn pass_ms(t: &Times, name: &str) -> f64 {
    t.passes.iter().filter(|(n, _)| n.starts_with(name)).map(|(_, q)| q.median).sum()
}

/// The technique's passes but for the look-up, milliseconds.
pub fn map_ms(t: &Times) -> f64 {
    let own = |name: &str| !crate::frame::SHARED_PASSES.contains(&name) && name != "resolve";
    t.passes.iter().filter(|(name, _)| own(name)).map(|(_, q)| q.median).sum()
}

/// The whole frame without the picture: the G-buffer and the technique's passes.
pub fn frame_ms(t: &Times) -> f64 {
    pass_ms(t, "G-buffer") + t.gpu.median
}

/// Maps that a frame draws.
pub fn maps_drawn(renderer: &mut Renderer, setup: &Setup) -> Result<usize> {
    renderer.render(setup, Ask { picture: false, truth: crate::frame::Truth::Off, ..Ask::of(setup) })?;
    Ok(renderer.known()?.faces.iter().flatten().count())
}

pub fn told(b: &Bench, setup: &Setup, times: &[Times]) -> String {
    let frames = times.iter().map(|t| t.gpu.frames).min().unwrap_or(0);
    let software = if b.gpu.software() { " Software: compare ratios only." } else { "" };
    let [w, h] = setup.size;
    format!("{w} × {h} pixels, {}; medians of {frames} frames or more, taking turns.{software}\n", b.gpu.info.name)
}

/// A way of the light: once around an ellipse.
struct Way {
    scene: &'static str,
    camera: &'static str,
    middle: Vec3,
    /// Half axes, and how far up and down it goes, twice.
    half: Vec3,
}

/// Both begin behind the camera, come into view on one side of it and leave on the other.
const WAYS: [Way; 2] = [
    Way { scene: "hall", camera: "counter", middle: vec3(-0.3, 1.9, 0.2), half: vec3(5.2, 0.4, 2.6) },
    Way { scene: "arches", camera: "atrium", middle: vec3(-9.0, 3.2, 0.0), half: vec3(-8.2, 1.2, 4.5) },
];
/// Frames of a way.
const STEPS: usize = 16;
/// Rounds that a frame of it is timed on a software adapter.
const ROUNDS: usize = 3;

impl Way {
    fn at(&self, k: usize) -> Vec3 {
        let turn = TAU * k as f32 / STEPS as f32;
        self.middle + self.half * vec3(turn.cos(), (2.0 * turn).sin(), turn.sin())
    }
}

/// Whether a place lies in the camera's frustum.
fn in_view(setup: &Setup, place: Vec3) -> bool {
    let [w, h] = setup.size;
    let clip = setup.camera.projection(w as f32 / h as f32) * setup.camera.view() * place.extend(1.0);
    clip.w > 0.0 && clip.x.abs() <= clip.w && clip.y.abs() <= clip.w
}

/// A frame of a way: what each of the walk's methods draws, and of the first two also time and error.
struct Step {
    seen: bool,
    maps: [usize; 4],
    ms: [f64; 2],
    wrong: [f64; 2],
}

/// The walk's methods: those that are timed, and those that skip maps by samples.
const WALK: [&Method; 4] = [&METHODS[2], &METHODS[5], &METHODS[6], &METHODS[7]];

/// Figures 3.16 to 3.19: a light that wanders through two scenes, in and out of view.
pub fn walk(b: &mut Bench) -> Result<String> {
    let mut text = String::new();
    let (mut all_times, mut base) = (Vec::new(), None);
    for (i, way) in WAYS.iter().enumerate() {
        let mut start = placed(b, way.scene, way.camera, None)?;
        let mut steps = Vec::new();
        for k in 0..STEPS {
            b.done(i * STEPS + k, WAYS.len() * STEPS);
            start.light = lamp(way.at(k), 40.0);
            let setups: Vec<Setup> = WALK.iter().map(|m| m.apply(&start, 512)).collect::<Result<_>>()?;
            let (renderer, _) = b.open(way.scene)?;
            let times = timing::briefly(renderer, &setups[..2], ROUNDS)?;
            let mut step = Step { seen: in_view(&start, way.at(k)), maps: [0; 4], ms: [0.0; 2], wrong: [0.0; 2] };
            for (m, setup) in setups.iter().enumerate() {
                step.maps[m] = maps_drawn(renderer, setup)?;
                if let Some(times) = times.get(m) {
                    step.ms[m] = map_ms(times);
                    step.wrong[m] = 100.0 * measure::errors(renderer, setup)?.share();
                }
            }
            all_times.extend(times);
            steps.push(step);
        }
        text += &told_walk(b, way, &steps)?;
        base = Some(start);
    }
    let base = base.context("there is a scene")?;
    Ok(format!("{}Maps of 512²; {STEPS} places of the light.\n{text}", told(b, &base, &all_times)))
}

/// The charts of a way, what they show by the number of faces drawn, and what is claimed of it.
fn told_walk(b: &Bench, way: &Way, steps: &[Step]) -> Result<String> {
    let scene = way.scene;
    let seen: Vec<String> = (0..).zip(steps).filter(|(_, s)| s.seen).map(|(k, _): (usize, _)| k.to_string()).collect();
    let seen = seen.join(", ");
    let mut text = format!("\n{scene}, from its camera \"{}\"; the light is in view in frames {seen}:\n\n", way.camera);
    type Value = fn(&Step, usize) -> f64;
    let charts: [(&str, &str, &str, usize, Value); 3] = [
        ("maps", "maps drawn", "maps drawn", 4, |s, m| s.maps[m] as f64),
        ("ms", "time of the maps", "time of the maps, ms", 2, |s, m| s.ms[m]),
        ("error", "wrong pixels", "wrong pixels, % of those facing the light", 2, |s, m| s.wrong[m]),
    ];
    for (name, title, y, count, value) in charts {
        let points = |m: usize| steps.iter().enumerate().map(|(k, s)| (k as f64, value(s, m))).collect();
        let line = |m: usize| (WALK[m].name.to_string(), mark(WALK[m].technique), points(m));
        let chart = Lines {
            title: format!("{scene}: {title} along the light's way"),
            x: format!("frame; in view: {seen}"),
            y: y.into(),
            log_y: false,
            lines: (0..count).map(line).collect(),
        };
        text += &b.chart(&format!("navratil-3.16-{scene}-{name}"), &chart)?;
    }
    let head = [
        "faces drawn",
        "frames",
        "in view",
        "maps of the cube, ms",
        "sides drawn",
        "of paraboloids, ms",
        "over the cube's",
    ];
    let mut rows = vec![head.map(String::from).to_vec()];
    let sum = |of: &[&Step], value: &dyn Fn(&Step) -> f64| of.iter().map(|s| value(s)).sum::<f64>();
    for faces in 0..=6 {
        let of: Vec<&Step> = steps.iter().filter(|s| s.maps[0] == faces).collect();
        if of.is_empty() {
            continue;
        }
        let mean = |value: &dyn Fn(&Step) -> f64| sum(&of, value) / of.len() as f64;
        rows.push(vec![
            faces.to_string(),
            of.len().to_string(),
            of.iter().filter(|s| s.seen).count().to_string(),
            short(mean(&|s| s.ms[0])),
            format!("{:.1}", mean(&|s| s.maps[1] as f64)),
            short(mean(&|s| s.ms[1])),
            format!("{:.2}", mean(&|s| s.ms[1]) / mean(&|s| s.ms[0])),
        ]);
    }
    let one: Vec<&Step> = steps.iter().filter(|s| s.maps[1] == 1).collect();
    let faster = one.iter().filter(|s| s.ms[1] < s.ms[0]).count();
    let few: Vec<&Step> = steps.iter().filter(|s| s.maps[0] <= 2).collect();
    let ratio = sum(&few, &|s| s.ms[0]) / sum(&few, &|s| s.ms[1]).max(1e-9);
    let all = |claim: &dyn Fn(&Step) -> bool| holds(steps.iter().all(claim));
    let best = steps.iter().map(|s| s.maps[0]).min().unwrap_or(0);
    text += &format!(
        "\n{}\n\
         - Out of view the cube skips at least one face: {}; it skips up to {} of six.\n\
         - Where only one paraboloid is drawn, paraboloids are faster than the cube: {}, in {faster} of {} frames.\n\
         - Where the cube draws one or two faces, in {} frames, it is as fast as paraboloids or faster: {}; it takes {ratio:.2} \
           times as long.\n\
         - Chosen by samples, faces are never more than by frusta: {}; they are fewer in {} frames.\n",
        table::markdown(&rows),
        all(&|s| s.seen || s.maps[0] < 6),
        6 - best,
        holds(2 * faster > one.len()),
        one.len(),
        few.len(),
        holds(!few.is_empty() && ratio < 1.1),
        all(&|s| s.maps[2] <= s.maps[0]),
        steps.iter().filter(|s| s.maps[2] < s.maps[0]).count(),
    );
    Ok(text)
}

/// Where the light of tables 3.1 and 3.2 stands: behind the camera, so that it sees as the camera does, and in the camera's view.
const PLACES: [Vec3; 2] = [vec3(-19.6, 4.9, 0.0), vec3(0.0, 4.9, 0.0)];

/// Tables 3.1 and 3.2: two scenes, each with every method, as ratios to the unoptimised cube.
pub fn rates(b: &mut Bench) -> Result<String> {
    const VERTICES: [usize; 2] = [600_000, 3_000_000];
    let mut frames = [[0.0; METHODS.len()]; 2];
    let mut maps = [[[0usize; 2]; METHODS.len()]; 2];
    let mut parts = [[[0.0; 3]; METHODS.len()]; 2];
    let (mut told_of, mut drawn_vertices) = (String::new(), [0; 2]);
    for (i, vertices) in VERTICES.into_iter().enumerate() {
        let (mut renderer, mut start) = crowd_of(b, vertices)?;
        drawn_vertices[i] = 3 * renderer.scene().triangles();
        for (place, at) in PLACES.into_iter().enumerate() {
            b.done(i * PLACES.len() + place, VERTICES.len() * PLACES.len());
            start.light = lamp(at, 60.0);
            let setups: Vec<Setup> = METHODS.iter().map(|m| m.apply(&start, 1024)).collect::<Result<_>>()?;
            let times = timing::briefly(&mut renderer, &setups, ROUNDS)?;
            for (m, setup) in setups.iter().enumerate() {
                let t = &times[m];
                frames[i][m] += frame_ms(t) / PLACES.len() as f64;
                let ms = [frame_ms(t) - t.gpu.median, pass_ms(t, "caster culling"), pass_ms(t, "shadow maps")];
                parts[i][m].iter_mut().zip(ms).for_each(|(sum, ms)| *sum += ms / PLACES.len() as f64);
                maps[i][m][place] = maps_drawn(&mut renderer, setup)?;
            }
            told_of = told(b, &start, &times);
        }
    }
    let head = ["method", "3.1: his", "ours", "3.2: his", "ours", "maps drawn, behind / in view", "maps, MB"];
    let mut rows = vec![head.map(String::from).to_vec()];
    let head = ["3.2, ms", "G-buffer", "culling", "drawing the maps", "frame"];
    let mut spent = vec![head.map(String::from).to_vec()];
    for (m, method) in METHODS.iter().enumerate() {
        let mut row = vec![method.name.to_string()];
        for i in 0..2 {
            row.push(method.rates.map_or("-".into(), |r| format!("{:.2}", r[i] / METHODS[0].rates.unwrap_or(r)[i])));
            row.push(format!("{:.2}", frames[i][0] / frames[i][m]));
        }
        let [behind, seen] = maps[1][m];
        row.push(format!("{behind} / {seen}"));
        let layers = if method.technique == "cube" { 6 } else { 2 };
        row.push(format!("{}", layers * 4));
        rows.push(row);
        let cells = parts[1][m].iter().chain([&frames[1][m]]).map(|ms| short(*ms));
        spent.push([method.name.to_string()].into_iter().chain(cells).collect());
    }
    // As fast, within the twentieth that times of so few frames vary by.
    let order = |i: usize, a: usize, b: usize| frames[i][b] <= 1.05 * frames[i][a];
    let both = |pairs: &[[usize; 2]]| holds((0..2).all(|i| pairs.iter().all(|[a, b]| order(i, *a, *b))));
    let skipped = 6 - maps[1][2][0];
    Ok(format!(
        "{told_of}Maps of 1024²; {} and {} vertices; means of two places of the light, behind the camera and in its view. Frames a \
         second over those of the unoptimised cube:\n\n{}\n{}\n\
         - Culling casters makes neither slower, culling maps neither slower again: {}.\n\
         - Unoptimised, two paraboloids are faster than six faces: {}.\n\
         - With all culled the cube is as fast as paraboloids or, with so many vertices, faster: {}.\n\
         - Face culling skips {skipped} of six faces where the light stands behind the camera, {} of what the cube draws; plane \
         clipping one side of two.\n\
         - Two paraboloids take a third of the cube's memory at the same side.\n",
        drawn_vertices[0],
        drawn_vertices[1],
        table::markdown(&rows),
        table::markdown(&spent),
        both(&[[0, 1], [1, 2], [3, 4], [4, 5]]),
        both(&[[0, 3]]),
        holds(order(1, 5, 2)),
        format_args!("{:.0} %", 100.0 * skipped as f64 / 6.0),
    ))
}
