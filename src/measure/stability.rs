//! Error and flicker along a path of camera, light or parameter.

use crate::frame::Renderer;
use crate::setup::Setup;
use anyhow::Result;

/// A scene with a path on which some techniques fail.
pub struct Case {
    /// Also the name of its scene.
    pub id: &'static str,
    /// What it provokes and in which techniques, a sentence.
    pub doc: &'static str,
    /// What runs along the path, with its unit: `sun elevation, °`.
    pub axis: &'static str,
    /// The value of `axis` at t, 0 to 1.
    pub value: fn(f32) -> f32,
    /// Moves a set-up of the case's scene to t.
    pub place: fn(&mut Setup, f32),
    /// Frames that the path has by default.
    pub frames: usize,
}

/// All of them, in the order of the lists.
pub static CASES: &[Case] = &[];

/// A case by id.
pub fn find(id: &str) -> Option<&'static Case> {
    CASES.iter().find(|c| c.id == id)
}

/// One frame of a path.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Point {
    pub t: f32,
    /// Wrong pixels as a share of those that face the light.
    pub error_share: f64,
    /// Shares of the pixels seen in this frame and the last whose label changed: the technique's, the truth's, and the
    /// technique's where the truth's did not. None in the first frame.
    pub changes: Option<f64>,
    pub truth_changes: Option<f64>,
    pub flicker: Option<f64>,
}

/// A technique along a path.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct Track {
    pub technique: String,
    pub params: String,
    pub points: Vec<Point>,
}

/// What was found on a path.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct Stability {
    pub case: String,
    pub axis: String,
    pub width: u32,
    pub height: u32,
    pub tracks: Vec<Track>,
    /// Techniques that do not serve the light, and why.
    pub left_out: Vec<(String, String)>,
}

/// Runs the techniques (with the set-up's parameters) along a case's path of `frames` frames. `watch` is told the share
/// done, and stops the work by saying no.
///
/// # Errors
/// What the device reports, or that it was stopped.
pub fn run(
    renderer: &mut Renderer,
    case: &Case,
    setup: &Setup,
    techniques: &[String],
    frames: usize,
    watch: &mut dyn FnMut(f32) -> bool,
) -> Result<Stability> {
    let _ = (renderer, case, setup, techniques, frames, watch);
    todo!()
}

/// Mean flicker of a set-up whose camera moves sideways in small steps; None if no pixel is seen twice.
pub fn flicker(renderer: &mut Renderer, setup: &Setup) -> Result<Option<f64>> {
    let _ = (renderer, setup);
    todo!()
}
