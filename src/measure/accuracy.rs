//! How wrong a configuration is, and what its frame needs: everything of a [`Record`] but times.

use super::analysis::{Aliasing, Counts};
use super::contour;
use super::metrics::{self, Errors};
use super::record::{Record, params_text};
use crate::frame::{Ask, Renderer, Told};
use crate::setup::Setup;
use crate::techniques;
use crate::truth::Samples;
use anyhow::{Context, Result};

/// The errors of the set-up's technique at the set-up's full size, against the hard truth alone: one sample per pixel.
///
/// # Errors
/// A light that the technique or the truth does not serve, or what the device reports.
pub fn errors(renderer: &mut Renderer, setup: &Setup) -> Result<Errors> {
    Ok(compare(renderer, &Setup { truth_samples: Samples::Fixed(1), ..setup.clone() }, false)?.0)
}

/// Renders technique and truth and counts the errors; with `all` also the shaded picture, the analysis, and how far the
/// contours lie apart.
fn compare(renderer: &mut Renderer, setup: &Setup, all: bool) -> Result<(Errors, Option<f64>, Told)> {
    techniques::find_or_say(&setup.technique)?.serve(&setup.light)?;
    techniques::TRUTH.serve(&setup.light)?;
    let ask = Ask { analysis: all, picture: all, ..Ask::of(setup) };
    let told = renderer.render(setup, ask)?;
    let mask = renderer.read_mask()?;
    let width = setup.size[0] as usize;
    let (hard, mean) = (renderer.read_hard_truth()?, renderer.read_truth()?);
    let visibility = renderer.read_visibility()?;
    let apart = if all { contour::mean_distance(&visibility, &hard, &mask, width) } else { None };
    Ok((metrics::errors(&visibility, &hard, &mean, &mask, width), apart, told))
}

/// Measures what does not depend on speed. `index` is the configuration's place in its sweep.
///
/// # Errors
/// As [`errors`].
pub fn accuracy(renderer: &mut Renderer, setup: &Setup, index: u64) -> Result<Record> {
    let samples = setup.truth_samples.measured();
    // Another view would change the picture, and a technique's own trace rays of its own.
    let shaded = Setup { truth_samples: Samples::Fixed(samples), ..setup.measured() };
    let (e, contour, told) = compare(renderer, &shaded, true)?;
    let picture = renderer.read_picture()?;
    let exact = renderer.read_truth_picture(&shaded)?;
    let [acne_share, detachment_share, leak_share, missing_caster_share, stairs_share] =
        renderer.read_causes()?.shares();
    let faces = renderer.known()?.faces;
    let drawn = faces.iter().flatten().count();
    let (gpu, analysis) = (&renderer.gpu, renderer.analysis());
    let maps = analysis.maps();
    let m = analysis.aliasing(gpu)?.and_then(|pixels| Aliasing::of(&pixels));
    let mut filled = Vec::new();
    let mut needed = maps.map_or(Vec::new(), |m| vec![false; m.layers as usize]);
    let counted = analysis.counts(gpu, |first, counts| {
        for (i, count) in counts.iter().enumerate().filter(|(_, c)| **c > 0) {
            filled.push(*count);
            let layer = (first + i as u64) / maps.map_or(1, |m| m.layer());
            needed[layer as usize] = true;
        }
    })?;
    let counts = maps.filter(|_| counted).map(|m| Counts::of(m.texels(), filled));
    let draws = analysis.draws(gpu)?;
    let pieces = analysis.pieces(gpu)?;
    let mut notes = renderer.notes()?;
    if e.facing == 0 {
        notes.push("No pixel faces the light within its cone and range: nothing can be wrong.".into());
    }
    if let Some(maps) = maps.filter(|_| !counted) {
        notes.push(format!("Samples per texel are not counted: {} texels are too many.", maps.texels()));
    }
    Ok(Record {
        index,
        technique: setup.technique.clone(),
        params: params_text(setup),
        scene: setup.scene.clone(),
        width: setup.size[0],
        height: setup.size[1],
        facing: e.facing,
        lit_correct: e.lit_correct,
        lit_incorrect: e.lit_incorrect,
        shadow_correct: e.shadow_correct,
        shadow_incorrect: e.shadow_incorrect,
        away: e.away,
        outside: e.outside,
        background: e.background,
        error_share: e.share(),
        acne_share,
        detachment_share,
        leak_share,
        missing_caster_share,
        stairs_share,
        truth_samples: samples,
        rmse: e.rmse,
        mae: e.mae,
        max_error: e.max_error,
        beyond_tolerance: e.beyond_tolerance,
        rmse_hard: Some(e.rmse_hard),
        rmse_penumbra: e.rmse_penumbra,
        rmse_image: metrics::rmse_image(&picture, &exact),
        flip: metrics::flip(&exact, &picture, setup.size),
        boundary_median_px: e.boundary.map(|b| b.median as f64),
        boundary_p95_px: e.boundary.map(|b| b.p95 as f64),
        boundary_max_px: e.boundary.map(|b| b.max as f64),
        contour_mean_px: contour,
        m_mean: m.map(|m| m.mean),
        m_rms: m.map(|m| m.rms),
        m_p50: m.map(|m| m.p50),
        m_p95: m.map(|m| m.p95),
        m_p99: m.map(|m| m.p99),
        m_max: m.map(|m| m.max),
        m_over_1: m.map(|m| m.over[0]),
        m_over_2: m.map(|m| m.over[1]),
        m_over_10: m.map(|m| m.over[2]),
        perspective_p50: m.map(|m| m.perspective_p50),
        projection_p50: m.map(|m| m.projection_p50),
        texel_area_p50: m.map(|m| m.area[0]),
        texel_area_p95: m.map(|m| m.area[1]),
        stretch_p50: m.map(|m| m.stretch[0]),
        stretch_p95: m.map(|m| m.stretch[1]),
        anisotropy_p50: m.map(|m| m.anisotropy[0]),
        anisotropy_p95: m.map(|m| m.anisotropy[1]),
        // A projection by a matrix turns nothing over.
        folds: maps.map(|_| pieces.map_or(0, |p| p.folds)),
        texels: maps.map(|m| m.texels()),
        texels_covered: counts.map(|c| c.covered),
        covered_share: counts.zip(maps).map(|(c, m)| c.covered as f64 / m.texels() as f64),
        utilisation: counts.and_then(|c| c.utilisation()),
        count_mean: counts.and_then(|c| c.mean()),
        count_max: counts.map(|c| c.max),
        count_gini: counts.and_then(|c| c.gini),
        count_entropy: counts.and_then(|c| c.entropy),
        // Of faces around a light only some are drawn.
        views_rendered: maps.map(|m| if faces.is_empty() { m.layers as u64 } else { drawn as u64 }),
        views_needed: counts.map(|_| needed.iter().filter(|n| **n).count() as u64),
        triangles_submitted: draws.map(|d| d.sent),
        triangles_drawn: draws.map(|d| d.drawn),
        fragments: draws.map(|d| d.fragments),
        triangles_needed: pieces.map(|p| p.kept),
        triangles_added: pieces.map(|p| p.drawn as i64 - p.kept as i64),
        triangles_folded: pieces.map(|p| p.folded),
        rays: renderer.read_rays()? as u64,
        gpu_bytes: told.gpu_bytes,
        adapter: renderer.gpu.info.name.clone(),
        driver: renderer.gpu.info.driver_info.clone(),
        software: renderer.gpu.software(),
        notes: notes.join(" "),
        // A shadow camera had no part in it, nor had a path.
        setup: serde_json::to_string(&Setup { shadow_camera: None, outlines: false, path: None, ..setup.clone() })
            .context("the set-up cannot be written as JSON")?,
        ..Record::default()
    })
}
