//! What techniques are followed along: a built-in case's path, or a set-up's own.

use super::OwnPath;
use crate::scene::builtin::cases::Case;
use crate::setup::Setup;
use std::sync::Arc;

/// A path from t = 0 to 1.
#[derive(Clone)]
pub enum Route {
    Case(&'static Case),
    Own(Arc<OwnPath>),
}

/// Seconds that a case's path takes when it plays.
const CASE_SECONDS: f32 = 8.0;
/// Fewest and most frames that a path of one's own has by default, and how many a second.
const FRAMES: [usize; 2] = [32, 256];
const PER_SECOND: f32 = 4.0;

impl From<&'static Case> for Route {
    fn from(case: &'static Case) -> Route {
        Route::Case(case)
    }
}

impl Route {
    /// What results call a path of one's own.
    pub const OWN: &str = "own path";

    /// What results call it.
    pub fn id(&self) -> &'static str {
        match self {
            Route::Case(case) => case.id,
            Route::Own(_) => Route::OWN,
        }
    }

    /// What runs along it, with its unit.
    pub fn axis(&self) -> &'static str {
        match self {
            Route::Case(case) => case.axis,
            Route::Own(_) => "time, s",
        }
    }

    /// The value of the axis at t.
    pub fn value(&self, t: f32) -> f32 {
        match self {
            Route::Case(case) => (case.value)(t),
            Route::Own(path) => path.time(t) as f32,
        }
    }

    /// Moves a set-up to t.
    pub fn place(&self, setup: &mut Setup, t: f32) {
        match self {
            Route::Case(case) => (case.place)(setup, t),
            Route::Own(path) => path.place(&mut setup.camera, &mut setup.light, path.time(t)),
        }
    }

    /// Moves a set-up to t; a parameter that the path moves moves on all sides of a comparison.
    pub fn place_sides(&self, setup: &mut Setup, t: f32) {
        let before = setup.params.clone();
        self.place(setup, t);
        for side in &mut setup.against {
            let (old, new) = (before.get(&side.technique), setup.params.get(&side.technique));
            let held = |name: &String| old.and_then(|old| old.get(name));
            let moved = new.into_iter().flatten().filter(|(name, value)| held(name) != Some(*value));
            side.params.extend(moved.map(|(name, value)| (name.clone(), value.clone())));
        }
    }

    /// Frames by default.
    pub fn frames(&self) -> usize {
        match self {
            Route::Case(case) => case.frames,
            Route::Own(path) => ((path.seconds() * PER_SECOND) as usize).clamp(FRAMES[0], FRAMES[1]),
        }
    }

    /// How long it takes when it plays, seconds.
    pub fn seconds(&self) -> f32 {
        match self {
            Route::Case(_) => CASE_SECONDS,
            Route::Own(path) => path.seconds(),
        }
    }
}
