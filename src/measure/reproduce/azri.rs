//! Azri 2020, table 3.1 and figures 3.9 to 3.16: cascaded soft shadow maps beside uniform sampling.

use super::{Bench, holds, short, with};
use crate::frame::{Ask, Renderer, Truth};
use crate::light::Light;
use crate::measure::metrics::{self, rms};
use crate::measure::{table, timing};
use crate::scene::builtin::cubes;
use crate::setup::Setup;
use anyhow::Result;
use glam::{Vec3, vec3};
use std::sync::Arc;

const SIZE: [u32; 2] = [640, 400];

/// The square light, 2 m wide, as far from the near cube as the far one is.
const LIGHT: Light = Light::RectArea {
    center: vec3(-14.0, 22.0, 6.0),
    half_u: vec3(0.75, 0.0, 0.66),
    half_v: vec3(-0.53, -0.6, 0.6),
    range: 120.0,
    color: Vec3::splat(2200.0),
};

/// Her models: what stands in each cascade, her seconds of both methods, and hers of 256 samples.
const MODELS: [(&str, usize, [f64; 2], Option<f64>); 4] = [
    ("cubes", 0, [0.03, 0.085], None),
    ("5 thousand triangles", 5_000, [0.12, 0.22], None),
    ("100 thousand", 100_000, [0.29, 0.54], Some(4.0)),
    ("500 thousand", 500_000, [2.57, 5.09], None),
];

struct Method {
    name: &'static str,
    technique: &'static str,
    sets: &'static [&'static str],
    maps: u32,
}

const fn method(name: &'static str, technique: &'static str, sets: &'static [&'static str], maps: u32) -> Method {
    Method { name, technique, sets, maps }
}

/// As many samples as the first has, in cascades with maps as large as those of the others: what their fewer samples alone get wrong.
const FULL: &[&str] = &["side=16", "side_2=16", "side_3=16", "placement=centers"];

/// All others are held against the first.
const METHODS: [Method; 8] = [
    method("256 samples", "area-uniform", &["side=16"], 256),
    method("36 samples, from edge to edge", "area-uniform", &["side=6", "placement=corners"], 36),
    method("`cssm` 16/9/4, as hers", "cssm", &[], 29),
    method("`cssm`, `centers`", "cssm", &["placement=centers"], 29),
    method("`cssm`, `nested`", "cssm", &["placement=nested"], 29),
    method("`cssm`, `nested`, `corners` asked first", "cssm", &["placement=nested", "ask=corners"], 29),
    method("`cssm`, `nested` and `bounds`", "cssm", &["placement=nested", "ask=bounds"], 29),
    method("the same with 9/9/4", "cssm", &["placement=nested", "ask=bounds", "side=3"], 22),
];
const HERS: usize = 2;
const OURS: usize = 7;

/// The scene with these triangles, 0 for the cubes, and what it is measured with.
fn open(b: &mut Bench, triangles: usize) -> Result<(Renderer, Setup)> {
    b.open = None;
    let scene = if triangles == 0 { cubes::build() } else { cubes::knots(triangles) };
    let name = if triangles == 0 { "cubes" } else { "knots" };
    let start = Setup { size: SIZE, light: LIGHT, ..Setup::new(name, &scene)? };
    Ok((Renderer::new(b.gpu.clone(), Arc::new(scene))?, start))
}

/// Visibility and picture of one frame.
fn seen(renderer: &mut Renderer, setup: &Setup) -> Result<(Vec<f32>, Vec<u8>)> {
    renderer.render(setup, Ask { truth: Truth::Off, ..Ask::of(setup) })?;
    Ok((renderer.read_visibility()?, renderer.read_picture()?))
}

pub fn table(b: &mut Bench) -> Result<String> {
    let mut text = String::new();
    let (mut errors, mut speeds) = (Vec::new(), Vec::new());
    for (i, (model, triangles, [hers, uniform], all)) in MODELS.into_iter().enumerate() {
        b.done(i, MODELS.len());
        let (mut renderer, start) = open(b, triangles)?;
        let setups: Vec<Setup> = METHODS.iter().map(|m| with(&start, m.technique, m.sets)).collect::<Result<_>>()?;
        let rays = seen(&mut renderer, &with(&start, "rt-soft", &["samples=1024"])?)?.0;
        let full = seen(&mut renderer, &with(&start, "cssm", FULL)?)?.0;
        let found: Vec<_> = setups.iter().map(|setup| seen(&mut renderer, setup)).collect::<Result<_>>()?;
        let mask = renderer.read_mask()?;
        let times = timing::briefly(&mut renderer, &setups, 3)?;
        let ms: Vec<f64> = times.iter().map(|t| t.gpu.median).collect();
        let head = [
            "method",
            "maps",
            "RMSE of the picture against 256 samples",
            "of visibility",
            "against 256 in each cascade",
            "against 1024 rays",
            "ms",
            "times as fast as 256 samples",
            "as 36",
        ];
        let mut lines = vec![head.map(String::from).to_vec()];
        for (k, m) in METHODS.iter().enumerate() {
            let rmse = rms(&found[k].0, &full, &mask);
            lines.push(vec![
                m.name.into(),
                m.maps.to_string(),
                format!("{:.4}", metrics::rmse_image(&found[k].1, &found[0].1)),
                format!("{:.4}", rms(&found[k].0, &found[0].0, &mask)),
                format!("{rmse:.4}"),
                format!("{:.4}", rms(&found[k].0, &rays, &mask)),
                short(ms[k]),
                short(ms[0] / ms[k]),
                short(ms[1] / ms[k]),
            ]);
            if k == HERS || k == OURS {
                errors.push(rmse);
                speeds.push(ms[0] / ms[k]);
            }
        }
        if i == 0 {
            text += &super::lamps::told(b, &start, &times);
        }
        let hers_of = all.map_or(String::new(), |all| format!(", {:.1} times as fast as 256 samples", all / hers));
        text += &format!(
            "\n**{model}** ({} triangles; hers takes {hers} s, 36 samples {uniform} s: {:.1} times as fast{hers_of})\n\n{}",
            renderer.geometry().triangles.len(),
            uniform / hers,
            table::markdown(&lines)
        );
    }
    let most = |k: usize, all: &[f64]| all.iter().skip(k).step_by(2).copied().fold(0.0, f64::max);
    let least = |k: usize, all: &[f64]| all.iter().skip(k).step_by(2).copied().fold(f64::MAX, f64::min);
    text += &format!(
        "\n- As hers: RMSE of visibility against as many samples as the first has, in the same cascades, up to {:.4}, at most 0.0091 {}; {:.1} times as fast as 256 samples at least, 14 times {}.\n\
         - Nested places and bounds, 22 maps: up to {:.4}, at most 0.006 {}; {:.1} times as fast at least, 20 times {}.\n",
        most(0, &errors),
        holds(most(0, &errors) <= 0.0091),
        least(0, &speeds),
        holds(least(0, &speeds) >= 14.0),
        most(1, &errors),
        holds(most(1, &errors) <= 0.006),
        least(1, &speeds),
        holds(least(1, &speeds) >= 20.0),
    );
    let (_, start) = b.open("cubes")?;
    let start = Setup { size: SIZE, light: LIGHT, ..start };
    let [hers, uniform] = [HERS, 1].map(|k| with(&start, METHODS[k].technique, METHODS[k].sets));
    let (hers, uniform) = (hers?, uniform?);
    text += "\n";
    text += &b.panes("azri-3.9.png", "Figure 3.9: `cssm` and 36 samples", &[hers.clone(), uniform.clone()])?;
    let mut apart = hers.clone();
    apart.view = "difference".into();
    apart.against = vec![uniform.kept(&uniform.technique)?];
    text += &b.capture("azri-3.10.png", "Figure 3.10: their difference", &apart)?;
    apart.against = vec![with(&start, METHODS[0].technique, METHODS[0].sets)?.kept(METHODS[0].technique)?];
    text += &b.capture("azri-3.14.png", "As figure 3.14: `cssm` less 256 samples", &apart)?;
    let mut cascades = hers;
    cascades.view = "cascades".into();
    text += &b.capture("azri-3.11.png", "As figure 3.11: the cascades", &cascades)?;
    Ok(text)
}
