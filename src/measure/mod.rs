//! How wrong a technique is, and what it costs.

pub mod metrics;
mod table;
mod timing;

pub use metrics::Errors;
pub use table::{csv, json, text};
pub use timing::{Quartiles, Times};

use crate::frame::{Ask, Renderer, Truth};
use crate::params::Values;
use crate::setup::Setup;
use crate::techniques;
use anyhow::Result;

/// What was measured of one technique.
#[derive(Clone, Debug)]
pub struct Row {
    pub technique: String,
    /// All its parameters.
    pub params: Values,
    pub errors: Errors,
    pub times: Times,
    /// Bytes of GPU memory that the technique holds.
    pub gpu_bytes: u64,
    /// What must be known to read the row, a sentence each.
    pub notes: Vec<String>,
}

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

/// Measures the set-up's technique: errors and times. `tick` is told the share done, and stops the work by saying no.
///
/// # Errors
/// As [`errors`], or that it was stopped.
pub fn measure(renderer: &mut Renderer, setup: &Setup, tick: impl Fn(f32) -> bool) -> Result<Row> {
    let errors = errors(renderer, setup)?;
    let [own, truth] = renderer.read_gave_up()?;
    let mut notes = Vec::new();
    for (rays, whose) in [(own, "the technique's"), (truth, "the truth's")] {
        if rays > 0 {
            notes.push(format!("{rays} of {whose} rays passed max_visits and count as lit."));
        }
    }
    let (times, gpu_bytes) = timing::time(renderer, setup, tick)?;
    Ok(Row { technique: setup.technique.clone(), params: setup.values().clone(), errors, times, gpu_bytes, notes })
}
