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

/// A row of her table.
struct Model {
    name: &'static str,
    /// What stands in each cascade, triangles; 0: the cubes.
    triangles: usize,
    /// Her cascades' places along a side, and the uniform samples that she holds them against.
    places: [&'static str; 3],
    uniform: u32,
    /// Her seconds of both methods.
    seconds: [f64; 2],
    /// The RMSE of her picture, and against how many samples.
    rmse: (f64, u32),
}

/// Cubes, bunny, horse and dragon. Of the horse's 256 samples she gives 4.0 s too.
const MODELS: [Model; 4] = [
    Model { name: "cubes", triangles: 0, places: FEW, uniform: 36, seconds: [0.03, 0.085], rmse: (0.0075, 36) },
    Model {
        name: "5 thousand triangles",
        triangles: 5_000,
        places: FEW,
        uniform: 36,
        seconds: [0.12, 0.22],
        rmse: (0.0077, 36),
    },
    Model {
        name: "100 thousand",
        triangles: 100_000,
        places: FEW,
        uniform: 36,
        seconds: [0.29, 0.54],
        rmse: (0.0091, 256),
    },
    Model {
        name: "500 thousand",
        triangles: 500_000,
        places: ["side=5", "side_2=4", "side_3=2"],
        uniform: 81,
        seconds: [2.57, 5.09],
        rmse: (0.0085, 81),
    },
];
/// 16, 9 and 4 places.
const FEW: [&str; 3] = ["side=4", "side_2=3", "side_3=2"];
/// Her horse's 256 samples over her cascades.
const HER_SPEED: f64 = 4.0 / 0.29;

struct Method {
    name: String,
    technique: &'static str,
    sets: Vec<&'static str>,
    maps: u32,
}

/// As many samples as the first has, in cascades with maps as large as those of the others: what their fewer samples alone get wrong.
const FULL: &[&str] = &["side=16", "side_2=16", "side_3=16", "placement=centers"];

/// What is measured of a model: all others are held against the first, and the third is hers.
fn methods(model: &Model) -> Vec<Method> {
    let (few, many) = match model.uniform {
        36 => ("side=6", "16/9/4"),
        _ => ("side=9", "25/16/4"),
    };
    let count = |side: &str| side.rsplit('=').next().and_then(|k| k.parse().ok()).map_or(0, |k: u32| k * k);
    let maps = model.places.iter().map(|side| count(side)).sum();
    let method =
        |name: String, technique, sets: &[&'static str], maps| Method { name, technique, sets: sets.to_vec(), maps };
    let cascades = |name: &str, sets: &[&'static str]| {
        method(format!("`cssm` {many}{name}"), "cssm", &[&model.places, sets].concat(), maps)
    };
    vec![
        method("256 samples".into(), "area-uniform", &["side=16"], 256),
        method(
            format!("{} samples, from edge to edge", model.uniform),
            "area-uniform",
            &[few, "placement=corners"],
            model.uniform,
        ),
        cascades(", as hers", &[]),
        cascades(", `centers`", &["placement=centers"]),
        cascades(", `nested`", &["placement=nested"]),
        cascades(", `nested`, `corners` asked first", &["placement=nested", "ask=corners"]),
        cascades(", `nested` and `bounds`", &["placement=nested", "ask=bounds"]),
        method(
            "`cssm` 9/9/4, `nested` and `bounds`".into(),
            "cssm",
            &["placement=nested", "ask=bounds", "side=3", "side_2=3", "side_3=2"],
            22,
        ),
    ]
}
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
    let (mut errors, mut speeds, mut pictures) = (Vec::new(), Vec::new(), Vec::new());
    for (i, model) in MODELS.iter().enumerate() {
        b.done(i, MODELS.len());
        let (mut renderer, start) = open(b, model.triangles)?;
        let methods = methods(model);
        let setups: Vec<Setup> = methods.iter().map(|m| with(&start, m.technique, &m.sets)).collect::<Result<_>>()?;
        let rays = seen(&mut renderer, &with(&start, "rt-soft", &["samples=1024"])?)?.0;
        let full = seen(&mut renderer, &with(&start, "cssm", FULL)?)?.0;
        let found: Vec<_> = setups.iter().map(|setup| seen(&mut renderer, setup)).collect::<Result<_>>()?;
        let mask = renderer.read_mask()?;
        let times = timing::briefly(&mut renderer, &setups, 3)?;
        let ms: Vec<f64> = times.iter().map(|t| t.gpu.median).collect();
        let few = format!("against {}", model.uniform);
        let head = [
            "method",
            "maps",
            "RMSE of the picture against 256 samples",
            &few,
            "of visibility against 256 samples",
            "against 256 in each cascade",
            "against 1024 rays",
            "ms",
            "times as fast as 256 samples",
            &format!("as {}", model.uniform),
        ];
        let mut lines = vec![head.map(String::from).to_vec()];
        for (k, m) in methods.iter().enumerate() {
            let rmse = rms(&found[k].0, &full, &mask);
            let picture = [0, 1].map(|of| metrics::rmse_image(&found[k].1, &found[of].1));
            lines.push(vec![
                m.name.clone(),
                m.maps.to_string(),
                format!("{:.4}", picture[0]),
                format!("{:.4}", picture[1]),
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
                pictures.push(picture[0]);
            }
        }
        if i == 0 {
            text += &super::lamps::told(b, &start, &times);
        }
        let [hers, uniform] = model.seconds;
        text += &format!(
            "\n**{}** ({} triangles; hers takes {hers} s, {} samples {uniform} s: {:.1} times as fast; RMSE of her picture {} against {})\n\n{}",
            model.name,
            renderer.geometry().triangles.len(),
            model.uniform,
            uniform / hers,
            model.rmse.0,
            model.rmse.1,
            table::markdown(&lines)
        );
    }
    let most = |k: usize, all: &[f64]| all.iter().skip(k).step_by(2).copied().fold(0.0, f64::max);
    let least = |k: usize, all: &[f64]| all.iter().skip(k).step_by(2).copied().fold(f64::MAX, f64::min);
    let judged = |k: usize, rmse: f64, speed: f64| {
        format!(
            "RMSE of the picture against 256 samples up to {:.4}, at most {rmse} {}; of visibility against as many samples in the same \
             cascades up to {:.4}, at most {rmse} {}; {:.1} times as fast as 256 samples at least, {speed:.0} times {}",
            most(k, &pictures),
            holds(most(k, &pictures) <= rmse),
            most(k, &errors),
            holds(most(k, &errors) <= rmse),
            least(k, &speeds),
            holds(least(k, &speeds) >= speed)
        )
    };
    text += &format!(
        "\n- As hers: {} (hers: {HER_SPEED:.1}).\n- Nested places and bounds, 22 maps: {}.\n",
        judged(0, 0.0091, 14.0),
        judged(1, 0.006, 20.0)
    );
    let (_, start) = b.open("cubes")?;
    let start = Setup { size: SIZE, light: LIGHT, ..start };
    let methods = methods(&MODELS[0]);
    let of = |k: usize| with(&start, methods[k].technique, &methods[k].sets);
    let (hers, uniform) = (of(HERS)?, of(1)?);
    text += "\n";
    text += &b.panes("azri-3.9.png", "Figure 3.9: `cssm` and 36 samples", &[hers.clone(), uniform.clone()])?;
    let mut apart = hers.clone();
    apart.view = "difference".into();
    apart.against = vec![uniform.kept(&uniform.technique)?];
    text += &b.capture("azri-3.10.png", "Figure 3.10: their difference", &apart)?;
    apart.against = vec![of(0)?.kept(methods[0].technique)?];
    text += &b.capture("azri-3.14.png", "As figure 3.14: `cssm` less 256 samples", &apart)?;
    let mut cascades = hers;
    cascades.view = "cascades".into();
    text += &b.capture("azri-3.11.png", "As figure 3.11: the cascades", &cascades)?;
    Ok(text)
}
