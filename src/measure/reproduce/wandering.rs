//! Navratil 2015, section 3.3.3: a light that wanders, and how many maps it needs.

use super::lamps::{METHODS, Method, lamp, map_ms, maps_drawn, pass_ms, placed, told};
use super::{Bench, holds, short};
use crate::chart::{Lines, mark};
use crate::measure::{self, table, timing};
use crate::setup::Setup;
use anyhow::{Context, Result};
use glam::{Vec3, vec3};
use std::f32::consts::TAU;

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
    Way { scene: "hall", camera: "counter", middle: vec3(-1.0, 1.9, 0.2), half: vec3(5.2, 0.4, 2.6) },
    Way { scene: "arches", camera: "atrium", middle: vec3(-9.0, 3.2, 0.0), half: vec3(-8.2, 1.2, 4.5) },
];
/// The cameras' field of view, degrees: so narrow that one face can hold it.
const FOV: f32 = 45.0;
/// Frames of a way.
const STEPS: usize = 16;

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
    /// Of it drawing alone.
    drawing: [f64; 2],
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
        start.camera.fov = FOV;
        let mut steps = Vec::new();
        for k in 0..STEPS {
            b.done(i * STEPS + k, WAYS.len() * STEPS);
            start.light = lamp(way.at(k), 40.0);
            let setups: Vec<Setup> = WALK.iter().map(|m| m.apply(&start, 512)).collect::<Result<_>>()?;
            let (renderer, _) = b.open(way.scene)?;
            let times = timing::briefly(renderer, &setups[..2], 2)?;
            let mut step = Step {
                seen: in_view(&start, way.at(k)),
                maps: [0; 4],
                ms: [0.0; 2],
                drawing: [0.0; 2],
                wrong: [0.0; 2],
            };
            // One technique after the other, so that neither is made twice.
            for m in 0..2 {
                step.ms[m] = map_ms(&times[m]);
                step.drawing[m] = pass_ms(&times[m], "shadow maps");
                step.wrong[m] = 100.0 * measure::errors(renderer, &setups[m])?.share();
                step.maps[m] = renderer.known()?.faces.iter().flatten().count();
                step.maps[m + 2] = maps_drawn(renderer, &setups[m + 2])?;
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
    let mut text = format!(
        "\n{scene}, from its camera \"{}\" with a field of view of {FOV}°; the light is in view in frames {seen}:\n\n",
        way.camera
    );
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
        "of it drawing",
        "sides drawn",
        "of paraboloids, ms",
        "of it drawing",
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
            short(mean(&|s| s.drawing[0])),
            format!("{:.1}", mean(&|s| s.maps[1] as f64)),
            short(mean(&|s| s.ms[1])),
            short(mean(&|s| s.drawing[1])),
        ]);
    }
    let of = |claim: &dyn Fn(&Step) -> bool| -> Vec<&Step> { steps.iter().filter(|s| claim(s)).collect() };
    let (one, few) = (of(&|s| s.maps[1] == 1), of(&|s| s.maps[0] <= 2));
    let faster = one.iter().filter(|s| s.ms[1] < s.ms[0]).count();
    // The cube's time over the paraboloids'.
    let ratio = |of: &[&Step], times: &dyn Fn(&Step) -> [f64; 2]| {
        sum(of, &|s| times(s)[0]) / sum(of, &|s| times(s)[1]).max(1e-9)
    };
    let [maps, drawing] = [ratio(&few, &|s| s.ms), ratio(&few, &|s| s.drawing)];
    let all = |claim: &dyn Fn(&Step) -> bool| holds(steps.iter().all(claim));
    let best = steps.iter().map(|s| s.maps[0]).min().unwrap_or(0);
    text += &format!(
        "\n{}\n\
         - Out of view the cube skips at least one face: {}; it skips up to {} of six.\n\
         - Where only one paraboloid is drawn, paraboloids are faster than the cube: {}, in {faster} of {} frames, {:.2} times as \
         fast on average.\n\
         - Where the cube draws one or two faces, in {} frames, it takes about as long as paraboloids: {}; {maps:.2} times as \
         long, drawing alone {drawing:.2} times.\n\
         - Chosen by samples, faces are never more than by frusta: {}; they are fewer in {} frames.\n",
        table::markdown(&rows),
        all(&|s| s.seen || s.maps[0] < 6),
        6 - best,
        holds(2 * faster > one.len()),
        one.len(),
        ratio(&one, &|s| s.ms),
        few.len(),
        holds(!few.is_empty() && (0.75..1.35).contains(&maps)),
        all(&|s| s.maps[2] <= s.maps[0]),
        of(&|s| s.maps[2] < s.maps[0]).len(),
    );
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::super::lamps::SIZE;
    use super::*;
    use crate::scene::{Camera, builtin};

    /// What the walk is about: the light comes into view and leaves it, and begins behind the camera.
    #[test]
    fn the_light_wanders_in_and_out_of_view() {
        for way in &WAYS {
            let scene = builtin::build(way.scene).unwrap();
            let found = scene.cameras.iter().find(|c| c.name == way.camera).unwrap();
            let setup = Setup {
                size: SIZE,
                camera: Camera { fov: FOV, ..found.camera },
                ..Setup::new(way.scene, &scene).unwrap()
            };
            let seen: Vec<bool> = (0..STEPS).map(|k| in_view(&setup, way.at(k))).collect();
            let number = seen.iter().filter(|s| **s).count();
            assert!((3..=STEPS - 6).contains(&number) && !seen[0], "{}: {seen:?}", way.scene);
        }
    }
}
