//! Percentage-closer filtering: how many samples it takes, and why it compares before it averages.

use super::kenzel::SIZE;
use super::{Bench, holds, short, with};
use crate::frame::{Ask, Place};
use crate::measure::metrics::{self, FACING};
use crate::measure::{self, table};
use crate::scene::{Camera, Clock};
use crate::setup::{Setup, scene_camera, scene_light};
use crate::truth::Samples;
use anyhow::{Context, Result};
use glam::Vec3;
use std::collections::BTreeSet;

/// Numbers of samples, and how they are laid out.
const KERNELS: [(usize, &str, &[&str]); 4] = [
    (1, "one", &["mode=grid", "kernel=1"]),
    (4, "disk of 1 texel", &["mode=disk", "samples=4", "radius=1"]),
    (9, "3 × 3 texels", &["mode=grid", "kernel=3"]),
    (16, "disk of 2 texels", &["mode=disk", "samples=16", "radius=2"]),
];

/// The shadow in the corner of the wall of `st-contact`.
const DETAIL: Camera = Camera::new(Vec3::new(0.95, 0.5, 1.1), Vec3::new(0.72, 0.0, 0.42), 40.0, 0.05, 20.0);

/// Figures 2.17 and 2.12: ever more single comparisons.
pub fn samples(b: &mut Bench) -> Result<String> {
    let (_, start) = b.open("st-contact")?;
    let start = Setup { camera: DETAIL, size: SIZE, ..start };
    let head = ["samples", "where", "grey levels: most", "ours", "width of the edge, texels", "RMSE", "wrong, %"];
    let mut lines = vec![head.map(String::from).to_vec()];
    let (mut setups, mut found) = (Vec::new(), Vec::new());
    for (i, (count, place, sets)) in KERNELS.into_iter().enumerate() {
        b.done(i, KERNELS.len());
        let setup = with(&start, "pcf", &[&["resolution=64", "bias_kind=ray-plane"], sets].concat())?;
        let (renderer, _) = b.open(&setup.scene)?;
        let record = measure::accuracy(renderer, &setup, 0)?;
        let (visibility, mask) = (renderer.read_visibility()?, renderer.read_mask()?);
        let places = renderer.read_layer(0)?.context("pcf has a map")?.places;
        let levels = levels(&visibility, &mask);
        let width = width(&visibility, &mask, &places, SIZE[0] as usize);
        lines.push(vec![
            count.to_string(),
            place.into(),
            (count + 1).to_string(),
            levels.to_string(),
            short(width),
            short(record.rmse),
            short(100.0 * record.error_share),
        ]);
        setups.push(setup);
        found.push((levels, width));
    }
    let shown = b.panes("navratil-2.17.png", "Row by row: 1, 4, 9 and 16 samples", &setups)?;
    Ok(format!(
        "The corner of the wall of `st-contact`, {} × {} pixels, a map of 64², `bias_kind = \"ray-plane\"`. The width is the\n\
         median way in the map from a place that is all lit to the nearest one that is all dark.\n\n{}\n\
         - Figure 2.12, the filter makes greys between light and dark: n samples make n + 1, {}.\n\
         - Figure 2.17, more samples blur the edge more: {}.\n\n{shown}",
        SIZE[0],
        SIZE[1],
        table::markdown(&lines),
        holds(found.iter().zip(KERNELS).all(|(f, kernel)| f.0 == kernel.0 + 1)),
        holds(found.windows(2).all(|w| w[0].1 < w[1].1)),
    ))
}

/// How many values visibility takes where it can be wrong, apart from rounding.
fn levels(visibility: &[f32], mask: &[u32]) -> usize {
    let facing = visibility.iter().zip(mask).filter(|(_, m)| **m == FACING);
    facing.map(|(v, _)| (v * 1000.0).round() as u32).collect::<BTreeSet<u32>>().len()
}

/// The median way, texels, from pixels at the border of full light to the nearest pixel at that of full shadow. `wide`:
/// pixels in a row.
fn width(visibility: &[f32], mask: &[u32], places: &[Place], wide: usize) -> f64 {
    let beside = |i: usize| {
        let x = i % wide;
        let (left, right) = ((x > 0).then(|| i - 1), (x + 1 < wide).then_some(i + 1));
        [left, right, i.checked_sub(wide), Some(i + wide)].into_iter().flatten()
    };
    let border = |of: f32| -> Vec<[f32; 2]> {
        let differs = |j: usize| mask.get(j) == Some(&FACING) && visibility[j] != of;
        let all = (0..mask.len()).filter(|i| mask[*i] == FACING && visibility[*i] == of);
        all.filter(|i| beside(*i).any(differs)).filter_map(|i| places[i].map(|p| p.0)).collect()
    };
    let dark = border(0.0);
    let way = |p: [f32; 2]| dark.iter().map(|q| (p[0] - q[0]).hypot(p[1] - q[1])).fold(f32::INFINITY, f32::min);
    let mut ways: Vec<f32> = border(1.0).into_iter().map(way).collect();
    ways.sort_by(f32::total_cmp);
    metrics::quantile(&ways, 0.5) as f64
}

/// Figure 2.13: the nine depths around a pixel's place, averaged after or before they are compared.
pub fn order(b: &mut Bench) -> Result<String> {
    /// Her receiver's depth, the mean depth around it and the share of the texels that PCF counts.
    const HERS: [f32; 3] = [54.0, 73.0, 4.0 / 9.0];
    /// Large enough for a pixel like hers to be among them.
    const SIZE: [u32; 2] = [320, 200];
    /// Metres: one that both ways can be given alike.
    const BIAS: f32 = 0.02;
    b.done(0, 1);
    let (renderer, mut start) = b.open("blocks")?;
    start.camera = scene_camera(renderer.scene(), "above", Clock::default())?;
    start.light = scene_light(renderer.scene(), "spot", Clock::default())?;
    let start = Setup { size: SIZE, truth_samples: Samples::Fixed(16), ..start };
    let setup = with(&start, "pcf", &["mode=grid", "kernel=3", "slope_bias=0", &format!("bias={BIAS}")])?;
    renderer.render(&setup, Ask { analysis: true, picture: false, ..Ask::of(&setup) })?;
    let map = renderer.read_layer(0)?.context("pcf has a map")?;
    let (visibility, mask, points) = (renderer.read_visibility()?, renderer.read_mask()?, renderer.read_position()?);
    let (hard, mean) = (renderer.read_hard_truth()?, renderer.read_truth()?);
    let mut before = visibility.clone();
    let (mut looked_up, mut same, mut soft, mut called_lit) = (0, 0, 0, 0);
    // The receiver's depth, those around it and their mean, of the pixel most like hers.
    let mut example: Option<(f32, [f32; 9], f32)> = None;
    let unlike = |z: f32, mean: f32| (mean / z - HERS[1] / HERS[0]).abs();
    for i in (0..mask.len()).filter(|i| mask[*i] == FACING) {
        let Some((place, _)) = map.places[i] else { continue };
        let at = map.view.axis.truncate().dot(Vec3::from_slice(&points[i])) + map.view.axis.w;
        let z = at - BIAS;
        let around = |k: i64, of: i64| (place[k as usize].floor() as i64 + of - 1).clamp(0, map.side as i64 - 1);
        let texel = |k: i64| (around(1, k / 3) * map.side as i64 + around(0, k % 3)) as usize;
        // Where there is no caster, the map holds its far plane.
        let stored: [Option<f32>; 9] = std::array::from_fn(|k| map.metres(texel(k as i64)));
        let depths = stored.map(|d| d.unwrap_or(map.view.far));
        let pass = depths.iter().filter(|d| z <= **d).count() as f32 / 9.0;
        let mean = depths.iter().sum::<f32>() / 9.0;
        before[i] = (z <= mean) as u32 as f32;
        looked_up += 1;
        same += ((pass - visibility[i]).abs() < 1e-3) as usize;
        if pass > 0.0 && pass < 1.0 {
            soft += 1;
            called_lit += (z <= mean) as usize;
        }
        let like = pass == HERS[2] && stored.iter().all(Option::is_some);
        if like && example.is_none_or(|(z0, _, mean0)| unlike(z, mean) < unlike(z0, mean0)) {
            example = Some((z, depths, mean));
        }
    }
    let (z, depths, mean_depth) = example.context("no pixel has four of nine texels behind it")?;
    let mut lines = vec![["", "grey levels", "RMSE", "wrong, %"].map(String::from).to_vec()];
    let mut found = Vec::new();
    for (name, v) in [("compared, then averaged: PCF", &visibility), ("averaged, then compared", &before)] {
        let e = metrics::errors(v, &hard, &mean, &mask, SIZE[0] as usize);
        found.push((levels(v, &mask), e.rmse));
        lines.push(vec![name.into(), found[found.len() - 1].0.to_string(), short(e.rmse), short(100.0 * e.share())]);
    }
    let rows = depths.chunks(3).map(|row| row.iter().map(|d| format!("{d:.2}")).collect::<Vec<_>>().join(", "));
    Ok(format!(
        "The blocks, camera `above`, the spot, {} × {} pixels, a map of 1024², a constant bias of {BIAS} m. The map is read back and\n\
         looked up on the CPU, 3 × 3 texels a pixel, in both orders. Compared first, that gives what the technique does in\n\
         {same} of {looked_up} pixels.\n\n{}\n\
         Of {soft} pixels with some of the nine texels before them and some not, the mean depth calls {called_lit} lit and the\n\
         others dark. The one most like hers:\n\n\
         | | hers | ours |\n|---|---|---|\n\
         | depth of the receiver | {} | {z:.2} m, bias taken off |\n\
         | depths around it | in the figure | {} |\n\
         | their mean | {} | {mean_depth:.2} m |\n\
         | mean compared | 1 | {} |\n\
         | PCF | 44 % | {:.0} % |\n\n\
         - Averaging first gives 0 or 1, comparing first the shares between: {} and {} grey levels, {}.\n\
         - Averaging first errs more: {}.\n",
        SIZE[0],
        SIZE[1],
        table::markdown(&lines),
        HERS[0],
        rows.collect::<Vec<_>>().join("; "),
        HERS[1],
        (z <= mean_depth) as u32,
        100.0 * HERS[2],
        found[1].0,
        found[0].0,
        holds(found[1].0 == 2 && found[0].0 == 10),
        holds(found[1].1 > found[0].1),
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::metrics::AWAY;

    #[test]
    fn an_edge_is_as_wide_as_its_greys() {
        const WIDE: usize = 20;
        // Lit up to column 7, grey up to column 11, then dark; two pixels a texel. Turned away, the last row does not count.
        let value = |i: usize| [1.0, 0.5, 0.0][(i % WIDE >= 8) as usize + (i % WIDE >= 12) as usize];
        let mut visibility: Vec<f32> = (0..4 * WIDE).map(value).collect();
        visibility[3 * WIDE..].fill(0.0);
        let mask: Vec<u32> = (0..4 * WIDE).map(|i| if i < 3 * WIDE { FACING } else { AWAY }).collect();
        let places: Vec<Place> =
            (0..4 * WIDE).map(|i| Some(([(i % WIDE) as f32 / 2.0, (i / WIDE) as f32 / 2.0], 0))).collect();
        assert_eq!(width(&visibility, &mask, &places, WIDE), 2.5);
        assert_eq!(levels(&visibility, &mask), 3);
    }
}
