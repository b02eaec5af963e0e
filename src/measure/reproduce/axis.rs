//! Aliasing error along the view's axis: closed forms and a floor under a sun in the zenith.

use super::{Bench, short};
use crate::chart::Lines;
use crate::frame::{Ask, Truth};
use crate::light::Light;
use crate::map::fit::{Scope, lispsm, warped};
use crate::measure::table;
use crate::params::{Params, Values};
use crate::scene::Camera;
use crate::techniques::pssm::{self, PssmParams};
use anyhow::{Context, Result};
use glam::Vec3;

/// A level view over a floor, far 64 times near, so that three logarithmic parts end at 4, 16 and 64 times near. The lowest
/// row of pixels sees the floor just before the near plane.
pub const CAMERA: Camera = Camera::new(Vec3::new(0.0, 1.0, 15.0), Vec3::new(0.0, 1.0, 0.0), 60.0, 1.75, 112.0);
/// As many rows of pixels as of texels; so narrow that only the direction along the view counts.
const SIZE: [u32; 2] = [16, 2048];
const RESOLUTION: u32 = SIZE[1];

/// The sun straight above.
pub fn zenith() -> Light {
    Light::Directional { to_light: Vec3::Y, angular_radius: 0.0, color: Vec3::ONE }
}

/// m where texels are `texel` metres long at depth z, for a surface that faces both the camera and the light: the length of
/// a texel over that of a pixel there.
fn aliasing(texel: f64, z: f64) -> f64 {
    texel * SIZE[1] as f64 / (2.0 * z * (CAMERA.fov as f64 / 2.0).to_radians().tan())
}

/// Depths along the axis, evenly many an octave.
fn depths(count: usize) -> impl Iterator<Item = f64> {
    let (near, far) = (CAMERA.near as f64, CAMERA.far as f64);
    (0..=count).map(move |i| near * (far / near).powf(i as f64 / count as f64))
}

/// Octaves from the near plane to a depth.
fn octaves(z: f64) -> f64 {
    (z / CAMERA.near as f64).log2()
}

const OCTAVES: &str = "depth, octaves from the near plane";
const ERROR: &str = "aliasing error m along the view, pixels per texel";

/// Depth and the perspective part of m of each pixel of the floor, measured.
fn floor(b: &mut Bench, technique: &str, sets: &[&str]) -> Result<Vec<[f64; 2]>> {
    let (renderer, mut setup) = b.open("st-single-plane")?;
    (setup.camera, setup.light, setup.size) = (CAMERA, zenith(), SIZE);
    setup.select(technique)?;
    setup.set(&format!("resolution={RESOLUTION}"), &[technique.into()])?;
    for set in sets {
        setup.set(set, &[technique.into()])?;
    }
    renderer
        .render(&setup, Ask { size: SIZE, truth: Truth::Off, analysis: true, picture: false, ..Ask::of(&setup) })?;
    let m = renderer.analysis().aliasing(&renderer.gpu)?.with_context(|| format!("{technique} has no maps"))?;
    let places = renderer.read_position()?;
    Ok(places.iter().zip(m).filter(|(_, m)| m[0] > 0.0).map(|(p, m)| [p[3] as f64, m[1] as f64]).collect())
}

/// Largest m between two depths.
fn worst(pixels: &[[f64; 2]], from: f64, to: f64) -> f64 {
    pixels.iter().filter(|[z, _]| (from..to).contains(z)).map(|p| p[1]).fold(0.0, f64::max)
}

/// The worst m of each part of parallel splits, by λ.
pub fn splits(b: &mut Bench) -> Result<String> {
    const PARTS: u32 = 3;
    let ends = |lambda: f64| {
        let p = PssmParams { lambda: lambda as f32, ..PssmParams::read(&Values::new()) };
        pssm::splits(&p, PARTS, CAMERA.near as f64, CAMERA.far as f64)
    };
    // A part's map is as long as the part; its nearest place is the worst.
    let part = |ends: &[f64], i: usize| aliasing((ends[i + 1] - ends[i]) / RESOLUTION as f64, ends[i]);
    let head = [
        "λ",
        "parts meet at, m",
        "m in part 1: closed form",
        "measured",
        "2: closed form",
        "measured",
        "3: closed form",
        "measured",
    ];
    let mut lines = vec![head.map(String::from).to_vec()];
    let shown = [0.0, 0.25, 0.5, 0.75, 1.0];
    for (n, lambda) in shown.into_iter().enumerate() {
        b.done(n, shown.len());
        let sets = ["fit=indep".into(), "blend=0".into(), format!("cascades={PARTS}"), format!("lambda={lambda:?}")];
        let measured = floor(b, "pssm", &sets.each_ref().map(String::as_str))?;
        let ends = ends(lambda);
        let mut line =
            vec![format!("{lambda}"), ends[1..PARTS as usize].iter().map(|z| short(*z)).collect::<Vec<_>>().join(", ")];
        for i in 0..PARTS as usize {
            line.push(short(part(&ends, i)));
            line.push(short(worst(&measured, ends[i], ends[i + 1])));
        }
        lines.push(line);
    }
    let by_lambda = (0..PARTS as usize).map(|i| {
        let at = |k: i32| k as f64 / 40.0;
        (format!("part {}", i + 1), i, (0..=40).map(|k| (at(k), part(&ends(at(k)), i))).collect())
    });
    let first = Lines {
        title: "Worst aliasing error of each part".into(),
        x: "λ: 0 even, 1 logarithmic".into(),
        y: ERROR.into(),
        log_y: true,
        lines: by_lambda.collect(),
    };
    let along = [("one map", None), ("λ = 0", Some(0.0)), ("λ = 0.5", Some(0.5)), ("λ = 1", Some(1.0))];
    let along = along.into_iter().enumerate().map(|(place, (label, lambda))| {
        let ends = lambda.map_or(vec![CAMERA.near as f64, CAMERA.far as f64], ends);
        let mut points = Vec::new();
        for w in ends.windows(2) {
            let inside = depths(200).filter(|z| w[0] < *z && *z < w[1]);
            let all = std::iter::once(w[0]).chain(inside).chain([w[1]]);
            points.extend(all.map(|z| (octaves(z), aliasing((w[1] - w[0]) / RESOLUTION as f64, z))));
        }
        (label.to_string(), place, points)
    });
    let second = Lines {
        title: "Aliasing error along the view, three parts".into(),
        x: OCTAVES.into(),
        y: ERROR.into(),
        log_y: true,
        lines: along.collect(),
    };
    Ok(format!(
        "Three parts between {} and {} m, a view level over a floor, the sun in the zenith, as many texels as rows\n\
         of pixels.\n\n{}\n{}{}",
        CAMERA.near,
        CAMERA.far,
        table::markdown(&lines),
        b.chart("navratil-3.7-parts", &first)?,
        b.chart("navratil-3.7", &second)?
    ))
}

/// m along the view for light space perspective by its free parameter n.
pub fn free_parameter(b: &mut Bench) -> Result<String> {
    let (renderer, _) = b.open("st-single-plane")?;
    let bounds = renderer.geometry().bounds;
    let aspect = SIZE[0] as f32 / SIZE[1] as f32;
    let scope = Scope { camera: CAMERA, light: zenith(), bounds, aspect, resolution: RESOLUTION, margin: 1.0 };
    let (image, eye) = (scope.image(), scope.eye());
    let fit = lispsm::fit(&scope, &image, &scope.seen(), lispsm::Strength { strength: 1.0, fade: 0.9 });
    // Of the technique: no warp, n_opt, and the full perspective, which psm draws.
    let near = format!("min_near={}", CAMERA.near);
    let kinds: [(&str, f64, &str, Vec<&str>); 3] = [
        ("n = ∞", f64::INFINITY, "lispsm", vec!["strength=0"]),
        ("n_opt", fit.n, "lispsm", vec!["strength=1"]),
        ("n = near", eye.near, "psm", vec!["slide=fixed", "slide_back=0", &near]),
    ];
    let head = ["n", "n, m", "m at near: closed form", "at far", "largest m: closed form", "measured", "drawn by"];
    let mut lines = vec![head.map(String::from).to_vec()];
    let mut curves = Vec::new();
    for (i, (name, n, technique, sets)) in kinds.iter().enumerate() {
        b.done(i, kinds.len());
        let eye_at = image.at(eye.position);
        let h = lispsm::warp(fit.direction, eye_at, fit.near, *n);
        // Where a depth lies in the warped image, and how long a texel is there.
        let base = eye_at.dot(fit.direction);
        let place = |z: f64| warped(&h, eye_at + fit.direction * z).0.y;
        let whole = place(fit.far - base) - place(fit.near - base);
        let texel = |z: f64| {
            let step = 1e-5 * z;
            whole / RESOLUTION as f64 * 2.0 * step / (place(z + step) - place(z - step))
        };
        let curve: Vec<(f64, f64)> = depths(200).map(|z| (z, aliasing(texel(z), z))).collect();
        let measured = floor(b, technique, sets)?;
        lines.push(vec![
            name.to_string(),
            if n.is_finite() { format!("{n:.2}") } else { "∞".into() },
            short(curve[0].1),
            short(curve[curve.len() - 1].1),
            short(curve.iter().map(|c| c.1).fold(0.0, f64::max)),
            short(worst(&measured, CAMERA.near as f64, CAMERA.far as f64)),
            format!("{technique} {}", sets.join(" ")),
        ]);
        curves.push((name.to_string(), i, curve.into_iter().map(|(z, m)| (octaves(z), m)).collect()));
    }
    let chart = Lines {
        title: "Light space perspective: error along the view by n".into(),
        x: OCTAVES.into(),
        y: ERROR.into(),
        log_y: true,
        lines: curves,
    };
    Ok(format!(
        "The same view and floor, one map; n is the distance from the perspective's centre to the near plane.\n\
         (Measured, the map ends with the last pixel of the floor, 4 m before the far plane.)\n\n{}\n{}",
        table::markdown(&lines),
        b.chart("wimmer-n", &chart)?
    ))
}
