//! What a technique's frames cost along a path.

use super::timing::{Quartiles, STOPPED};
use crate::frame::{Ask, History, Renderer, Truth, technique_ms};
use crate::gpu::LayerCount;
use crate::path::Route;
use crate::setup::Setup;
use anyhow::{Result, ensure};

/// What a frame of a technique costs.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Cost {
    /// Passes that the technique recorded.
    pub passes: u32,
    /// Depth layers that it has, cascades, faces or sides among them, and those into which at least one triangle was drawn.
    /// None: it draws into none, or the adapter cannot count.
    #[serde(flatten)]
    pub layers: Option<LayerCount>,
    /// Triangles drawn into them, as [`super::Record::triangles_drawn`]; of exact rasters, which draw points, those that
    /// some view sample needs.
    pub triangles: Option<u64>,
    /// Of the technique's passes, milliseconds: the median of [`TIMED`] frames.
    pub ms: f64,
}

/// Frames timed at each place.
pub const TIMED: usize = 3;

/// The cost of a set-up's technique at each of so many places of a path: first everything is counted, which warms up, then
/// everything is timed. `watch` is told the share done, and stops the work by saying no.
///
/// # Errors
/// What the device reports, or that it was stopped.
pub fn along(
    renderer: &mut Renderer,
    route: &Route,
    setup: &Setup,
    places: &[f32],
    watch: &mut dyn FnMut(f32) -> bool,
) -> Result<Vec<Cost>> {
    let mut setup = setup.clone();
    // Every frame does all of its work, as where techniques are measured.
    let ask = Ask { truth: Truth::Off, picture: false, fresh: true, history: History::Goes, ..Ask::of(&setup) };
    let mut costs = Vec::with_capacity(places.len());
    let all = 2.0 * places.len() as f32;
    for (i, t) in places.iter().enumerate() {
        route.place(&mut setup, *t);
        renderer.render(&setup, Ask { analysis: true, ..ask })?;
        let (gpu, analysis) = (&renderer.gpu, renderer.analysis());
        let triangles = match (analysis.draws(gpu)?, analysis.pieces(gpu)?) {
            (Some(draws), _) => Some(draws.drawn),
            (None, pieces) => pieces.map(|p| p.kept),
        };
        costs.push(Cost { layers: analysis.layers(gpu)?, triangles, ..Cost::default() });
        ensure!(watch((i + 1) as f32 / all), STOPPED);
    }
    for (i, (t, cost)) in places.iter().zip(&mut costs).enumerate() {
        route.place(&mut setup, *t);
        let mut times = Vec::with_capacity(TIMED);
        for _ in 0..TIMED {
            cost.passes = renderer.render(&setup, Ask { timed: true, ..ask })?.passes;
            renderer.collect_times(true)?;
            times.push(technique_ms(&renderer.timer.by_name()));
        }
        cost.ms = Quartiles::of(times).median;
        ensure!(watch((places.len() + i + 1) as f32 / all), STOPPED);
    }
    Ok(costs)
}
