//! How wrong a configuration is, and what its frame needs: everything of a [`Record`] but times.

use super::metrics::{self, Errors};
use super::record::{Record, params_text};
use crate::frame::{Ask, Renderer, Truth};
use crate::setup::Setup;
use crate::techniques;
use anyhow::{Context, Result};

/// The errors of the set-up's technique against the truth, at the set-up's full size.
///
/// # Errors
/// A light that the technique or the truth does not serve, or what the device reports.
pub fn errors(renderer: &mut Renderer, setup: &Setup) -> Result<Errors> {
    techniques::find_or_say(&setup.technique)?.serve(&setup.light)?;
    techniques::TRUTH.serve(&setup.light)?;
    renderer.render(setup, Ask { size: setup.size, truth: Truth::All, timed: false, picture: false })?;
    let mask = renderer.read_mask()?;
    Ok(metrics::errors(&renderer.read_visibility()?, &renderer.read_truth()?, &mask, setup.size[0] as usize))
}

/// Measures what does not depend on speed. `index` is the configuration's place in its sweep.
///
/// # Errors
/// As [`errors`].
pub fn accuracy(renderer: &mut Renderer, setup: &Setup, index: u64) -> Result<Record> {
    let e = errors(renderer, setup)?;
    let [own, truth] = renderer.read_gave_up()?;
    let mut notes = Vec::new();
    for (rays, whose) in [(own, "the technique's"), (truth, "the truth's")] {
        if rays > 0 {
            notes.push(format!("{rays} of {whose} rays passed max_visits and count as lit."));
        }
    }
    Ok(Record {
        index,
        technique: setup.technique.clone(),
        params: params_text(setup.values()),
        scene: setup.scene.clone(),
        width: setup.size[0],
        height: setup.size[1],
        facing: e.facing,
        lit_correct: e.lit_correct,
        lit_incorrect: e.lit_incorrect,
        shadow_correct: e.shadow_correct,
        shadow_incorrect: e.shadow_incorrect,
        away: e.away,
        background: e.background,
        error_share: e.share(),
        rmse: e.rmse,
        boundary_median_px: e.boundary.map(|b| b.median as f64),
        boundary_p95_px: e.boundary.map(|b| b.p95 as f64),
        boundary_max_px: e.boundary.map(|b| b.max as f64),
        adapter: renderer.gpu.info.name.clone(),
        driver: renderer.gpu.info.driver_info.clone(),
        software: renderer.gpu.software(),
        notes: notes.join(" "),
        setup: serde_json::to_string(setup).context("the set-up cannot be written as JSON")?,
        ..Record::default()
    })
}
