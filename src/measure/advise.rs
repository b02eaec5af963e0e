//! The cheapest configuration that meets an error budget.

use super::Record;
use crate::frame::Renderer;
use crate::setup::Setup;
use anyhow::Result;

/// What is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Budget {
    /// Wrong pixels as a share of those that face the light, 0 to 1.
    pub max_error: f64,
    /// Time as a multiple of the set-up's `shadow-map`.
    pub max_ratio: Option<f64>,
}

/// What was found.
#[derive(Clone, Debug, Default)]
pub struct Advice {
    /// The cheapest that meets the budget, as an index into `tried`.
    pub answer: Option<usize>,
    /// Where nothing meets it: the closest miss.
    pub closest: Option<usize>,
    /// The cheapest with half the answer's error among those tried, if any.
    pub halved: Option<usize>,
    /// Those that no other beats in both, by ascending time: indices into `tried`.
    pub frontier: Vec<usize>,
    /// All that was measured, in its order.
    pub tried: Vec<Record>,
    /// Configurations there were to choose from.
    pub space: usize,
}

/// Searches the techniques and their main parameters. `watch` is told the share done and what is measured, and stops
/// the work by saying no.
///
/// # Errors
/// What the device reports, or that it was stopped.
pub fn advise(
    renderer: &mut Renderer,
    setup: &Setup,
    techniques: &[String],
    budget: Budget,
    watch: &mut dyn FnMut(f32, &str) -> bool,
) -> Result<Advice> {
    let _ = (renderer, setup, techniques, budget, watch);
    todo!()
}
