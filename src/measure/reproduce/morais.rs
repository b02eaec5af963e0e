//! Morais 2015: pixel states and wrong pixels of the standard shadow map.

use super::Bench;
use crate::measure::{self, Errors, table};
use crate::scene::Clock;
use crate::setup::scene_camera;
use anyhow::Result;

/// His three cases: our camera's name; of the facing pixels' share in percent and of those the lit share, at 512²,
/// 1024² and 1920 × 1080; and the standard shadow map's wrong pixels in percent of those called lit and called
/// shadowed, for maps of 512² to 4096².
pub(super) struct Case {
    pub camera: &'static str,
    facing: [f64; 3],
    lit: [f64; 3],
    light_incorrect: [f64; 4],
    shadow_incorrect: [f64; 4],
}

pub(super) const CASES: [Case; 3] = [
    Case {
        camera: "trees-side",
        facing: [100.0, 100.0, 99.99],
        lit: [64.45, 64.45, 63.68],
        light_incorrect: [1.30, 0.60, 0.31, 0.16],
        shadow_incorrect: [2.10, 1.18, 0.53, 0.27],
    },
    Case {
        camera: "flowers-against",
        facing: [94.21, 94.21, 96.74],
        lit: [52.99, 52.99, 69.75],
        light_incorrect: [1.37, 0.91, 0.61, 0.43],
        shadow_incorrect: [2.78, 1.62, 0.99, 0.58],
    },
    Case {
        camera: "bench-against",
        facing: [97.62, 97.62, 98.66],
        lit: [59.03, 59.03, 63.38],
        light_incorrect: [1.22, 0.85, 0.43, 0.27],
        shadow_incorrect: [2.44, 1.28, 0.70, 0.34],
    },
];

pub(super) const SIZES: [[u32; 2]; 3] = [[512, 512], [1024, 1024], [1920, 1080]];
pub(super) const RESOLUTIONS: [u32; 4] = [512, 1024, 2048, 4096];

/// Errors in one of his pictures.
pub(super) fn errors(b: &mut Bench, camera: &str, size: [u32; 2], technique: &str, sets: &[String]) -> Result<Errors> {
    let (renderer, mut setup) = b.open("bench")?;
    setup.camera = scene_camera(renderer.scene(), camera, Clock::default())?;
    setup.size = size;
    setup.select(technique)?;
    for set in sets {
        setup.set(set, &[technique.into()])?;
    }
    measure::errors(renderer, &setup)
}

pub fn pixel_states(b: &mut Bench, case: usize) -> Result<String> {
    let theirs = &CASES[case];
    let head = ["picture", "facing, %: theirs", "ours", "lit of facing, %: theirs", "ours", "lit, ours / theirs"];
    let mut lines = vec![head.map(String::from).to_vec()];
    for (i, size) in SIZES.into_iter().enumerate() {
        b.done(i, SIZES.len());
        let e = errors(b, theirs.camera, size, "rt-hard", &[])?;
        let lit = 100.0 * e.lit_correct as f64 / e.facing.max(1) as f64;
        lines.push(vec![
            format!("{} × {}", size[0], size[1]),
            format!("{:.2}", theirs.facing[i]),
            format!("{:.2}", 100.0 * e.facing as f64 / (size[0] * size[1]) as f64),
            format!("{:.2}", theirs.lit[i]),
            format!("{lit:.2}"),
            format!("{:.3}", lit / theirs.lit[i]),
        ]);
    }
    Ok(table::markdown(&lines))
}

pub fn shadow_map(b: &mut Bench, case: usize) -> Result<String> {
    let theirs = &CASES[case];
    let head = [
        "map",
        "lit wrong, %: theirs",
        "ours",
        "shadow wrong, %: theirs",
        "ours",
        "all wrong, %: theirs",
        "ours",
        "ours / theirs",
        "ours unfitted",
    ];
    let mut lines = vec![head.map(String::from).to_vec()];
    let (mut all_theirs, mut all_ours) = (Vec::new(), Vec::new());
    let percent = |part: usize, whole: usize| 100.0 * part as f64 / whole.max(1) as f64;
    for (i, resolution) in RESOLUTIONS.into_iter().enumerate() {
        b.done(i, RESOLUTIONS.len());
        let sets = [format!("resolution={resolution}"), "fit=scene".into()];
        let e = errors(b, theirs.camera, SIZES[2], "shadow-map", &sets[..1])?;
        let unfitted = errors(b, theirs.camera, SIZES[2], "shadow-map", &sets)?;
        // His shares are of what the technique calls lit and shadowed; with the true lit share they give all wrong ones.
        let [light, shadow] = [theirs.light_incorrect[i], theirs.shadow_incorrect[i]].map(|p| p / 100.0);
        let called_lit = (theirs.lit[2] / 100.0 - shadow) / (1.0 - light - shadow);
        let wrong = 100.0 * (called_lit * light + (1.0 - called_lit) * shadow);
        let ours = 100.0 * e.share();
        lines.push(vec![
            format!("{resolution}²"),
            format!("{:.2}", theirs.light_incorrect[i]),
            format!("{:.2}", percent(e.lit_incorrect, e.lit_correct + e.lit_incorrect)),
            format!("{:.2}", theirs.shadow_incorrect[i]),
            format!("{:.2}", percent(e.shadow_incorrect, e.shadow_correct + e.shadow_incorrect)),
            format!("{wrong:.2}"),
            format!("{ours:.2}"),
            format!("{:.2}", ours / wrong),
            format!("{:.2}", 100.0 * unfitted.share()),
        ]);
        all_theirs.push(wrong);
        all_ours.push(ours);
    }
    let falls = |all: &[f64]| all.windows(2).map(|w| format!("{:.2}", w[1] / w[0])).collect::<Vec<_>>().join(", ");
    let order = |all: &[f64]| {
        let mut order: Vec<usize> = (0..all.len()).collect();
        order.sort_by(|a, b| all[*a].total_cmp(&all[*b]));
        order.into_iter().map(|i| format!("{}²", RESOLUTIONS[i])).collect::<Vec<_>>().join(" < ")
    };
    let mut out = table::markdown(&lines);
    out += &format!("\nOrder by all wrong: {} (theirs), {} (ours). ", order(&all_theirs), order(&all_ours));
    out += &format!(
        "Each doubling of the map multiplies all wrong pixels by {} (theirs) and {} (ours): where that is one half,\n\
         the error is aliasing along the shadows' edges.\n",
        falls(&all_theirs),
        falls(&all_ours)
    );
    Ok(out)
}
