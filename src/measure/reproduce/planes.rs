//! Chong 2003, 4.2.1: his flatland in three dimensions, which he left open.

use super::{Bench, short, with};
use crate::light::Light;
use crate::measure::{self, Record, table};
use crate::scene::builtin::SCENES;
use crate::setup::Setup;
use anyhow::Result;
use glam::Vec3;

/// What is compared: heading, technique, its parameters.
const WAYS: [(&str, &str, &[&str]); 8] = [
    ("shadow map", "shadow-map", &[]),
    ("psm", "psm", &[]),
    ("lispsm", "lispsm", &[]),
    ("half angle", "optimal-light-plane", &["plane=half-angle"]),
    ("best by L1", "optimal-light-plane", &[]),
    ("by L2", "optimal-light-plane", &["metric=L2"]),
    ("4 maps", "optimal-light-plane", &["maps=4"]),
    ("7 maps", "optimal-light-plane", &["maps=7"]),
];

/// Texels of a map's side, and of all maps together no more than one of that has.
const SIDE: u32 = 512;

/// Mean texels and wrong pixels under every spot light of the built-in scenes, and under one that faces the view.
pub fn run(b: &mut Bench) -> Result<String> {
    let mut places = Vec::new();
    for scene in SCENES {
        let (renderer, start) = b.open(scene.name)?;
        let start = Setup { size: [320, 200], ..start };
        for light in renderer.scene().lights.iter().filter(|l| matches!(l.light, Light::Spot { .. })) {
            places.push((format!("{}, {}", scene.name, light.name), Setup { light: light.light, ..start.clone() }));
        }
        places.push((format!("{}, facing the view", scene.name), Setup { light: facing(&start), ..start }));
    }
    let (mut texels, mut wrong) = (vec![head()], vec![head()]);
    let mut sums = [0.0; WAYS.len()];
    for (i, (name, start)) in places.iter().enumerate() {
        b.done(i, places.len());
        let mut lines = [vec![name.clone()], vec![name.clone()]];
        let mut plain = None;
        for ((_, technique, sets), sum) in WAYS.iter().zip(&mut sums) {
            let side = format!("resolution={SIDE}");
            let setup = with(start, technique, &[&[&*side], *sets].concat())?;
            let r: Record = measure::accuracy(b.open(&start.scene)?.0, &setup, 0)?;
            let m = r.m_mean.unwrap_or(f64::NAN);
            *sum += (m / *plain.get_or_insert(m)).ln() / places.len() as f64;
            lines[0].push(short(m));
            lines[1].push(short(100.0 * r.error_share));
        }
        let [m, errors] = lines;
        texels.push(m);
        wrong.push(errors);
    }
    let mut mean = vec!["geometric mean over the shadow map".to_string()];
    mean.extend(sums.map(|sum| format!("{:.2}", sum.exp())));
    texels.push(mean);
    Ok(format!(
        "The mean of m, the longest extent of a texel in the picture, pixels, at {} × {} with {SIDE}² texels, all fitted to the receivers:\n\n\
         {}\nWrong pixels, %:\n\n{}",
        320,
        200,
        table::markdown(&texels),
        table::markdown(&wrong)
    ))
}

fn head() -> Vec<String> {
    ["light"].into_iter().chain(WAYS.map(|(name, ..)| name)).map(String::from).collect()
}

/// A spot light behind what the camera looks at and above it, which shines towards the camera.
fn facing(setup: &Setup) -> Light {
    let camera = setup.camera;
    let far = camera.target - camera.position;
    let position = camera.target + far * 0.8 + Vec3::Y * far.length() * 0.6;
    let direction = camera.position.lerp(camera.target, 0.6) - position;
    Light::Spot {
        position,
        direction,
        outer_angle: 50.0,
        range: 10.0 * far.length(),
        radius: 0.0,
        color: Vec3::splat(far.length_squared()),
    }
}
