//! Techniques that keep what earlier frames saw: how long a picture takes to settle, and how far shadows lag behind.

use super::accuracy::{compare, served};
use super::metrics::rms;
use crate::frame::{Ask, History, Renderer, Truth};
use crate::light::Light;
use crate::setup::Setup;
use crate::truth::Samples;
use anyhow::Result;
use glam::{Quat, Vec3};

/// Frames after the leap, of which the last quarter is the floor.
const FRAMES: usize = 64;
/// The leap of the light, and its turn from frame to frame, degrees around the middle of the scene.
const LEAP: f32 = 12.0;
const TURN: f32 = 0.4;
/// Frames that the light turns for, and how many of them it may be behind.
const TURNING: i32 = 64;
const MOST_BEHIND: i32 = 32;

/// What the light at work's frames show.
pub struct Temporal {
    /// Frames after a leap of the light until the error, averaged over four frames, is within a tenth of the floor. None: it still falls at
    /// the end.
    pub settle_frames: Option<u32>,
    /// The floor: RMSE of the last 16 of 64 frames.
    pub settle_rmse: f64,
    /// Frames by which the picture is behind a light that turns: those ago whose truth it is nearest to.
    pub lag_frames: u32,
}

/// The light as it is after a turn about an axis through the scene's middle: upright, or level and aslant for one that stands above.
fn turn_about(light: &Light, middle: Vec3, degrees: f32) -> Light {
    let way = match light {
        Light::Directional { to_light, .. } => *to_light,
        _ => light.position() - middle,
    };
    let axis = if way.normalize_or_zero().y.abs() > 0.9 { Vec3::new(1.0, 0.0, 1.0).normalize() } else { Vec3::Y };
    let turn = Quat::from_axis_angle(axis, degrees.to_radians());
    let mut turned = *light;
    if let Some(place) = turned.place_mut() {
        *place = middle + turn * (*place - middle);
    }
    match &mut turned {
        Light::Directional { to_light: v, .. }
        | Light::Spot { direction: v, .. }
        | Light::Hemisphere { direction: v, .. } => {
            *v = turn * *v;
        }
        Light::RectArea { half_u, half_v, .. } => (*half_u, *half_v) = (turn * *half_u, turn * *half_v),
        Light::Omni { .. } => {}
    }
    turned
}

/// Draws frames after a leap of the light at work, then while it turns.
///
/// # Errors
/// As [`super::errors`].
pub fn over_time(renderer: &mut Renderer, setup: &Setup) -> Result<Temporal> {
    let samples = setup.truth_samples.measured(&setup.light);
    let base = Setup { truth_samples: Samples::Fixed(samples), ..setup.measured() };
    let one = served(&base)?.swap_remove(0);
    let bounds = renderer.geometry().bounds;
    let middle = 0.5 * (bounds[0] + bounds[1]);
    let at = |degrees: f32| Setup { light: turn_about(&one.light, middle, degrees), ..one.clone() };
    let frame = |renderer: &mut Renderer, setup: &Setup, history: History| -> Result<Vec<f32>> {
        let ask = Ask { truth: Truth::Off, analysis: false, picture: false, history, ..Ask::of(setup) };
        renderer.render(setup, ask)?;
        renderer.read_visibility()
    };

    let (rest, _) = compare(renderer, &one, false)?;
    frame(renderer, &at(LEAP), History::Whole)?;
    for _ in 0..FRAMES {
        frame(renderer, &at(LEAP), History::Goes)?;
    }
    let mut errors = Vec::with_capacity(FRAMES);
    for _ in 0..FRAMES {
        errors.push(rms(&frame(renderer, &one, History::Goes)?, &rest.mean, &rest.mask));
    }
    let quarter = |k: usize| errors[k * FRAMES / 4..(k + 1) * FRAMES / 4].iter().sum::<f64>() / (FRAMES / 4) as f64;
    let floor = quarter(3);
    // It falls as much again as a tenth in the last quarter.
    let falls = quarter(2) > 1.1 * floor + 1e-4;
    // Single frames are better or worse than others.
    let near = |four: &[f64]| four.iter().sum::<f64>() <= 4.0 * (1.1 * floor + 1e-4);
    let settled = errors.windows(4).position(near).map_or(FRAMES, |k| k + 1);

    let mut seen = Vec::new();
    for k in 0..=TURNING {
        let history = if k == 0 { History::Starts } else { History::Goes };
        seen = frame(renderer, &at(TURN * (k - TURNING) as f32), history)?;
    }
    // Every fourth frame ago, then those beside the best.
    let mut behind = (f64::MAX, 0);
    let mut tried = (0..=MOST_BEHIND).step_by(4).collect::<Vec<_>>();
    while let Some(k) = tried.pop() {
        let (then, _) = compare(renderer, &at(-TURN * k as f32), false)?;
        // What the light leaves or reaches on its way is the same for all.
        let mask: Vec<u32> = then.mask.iter().zip(&rest.mask).map(|(a, b)| if a == b { *a } else { 0 }).collect();
        let error = rms(&seen, &then.mean, &mask);
        if error < behind.0 {
            behind = (error, k);
        }
        if tried.is_empty() && k % 4 == 0 {
            tried = (behind.1 - 3..behind.1 + 4).filter(|k| k % 4 != 0 && (1..MOST_BEHIND).contains(k)).collect();
        }
    }
    let settle_frames = (!falls).then_some(settled as u32);
    Ok(Temporal { settle_frames, settle_rmse: floor, lag_frames: behind.1 as u32 })
}
