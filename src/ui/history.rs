//! Undo and redo: the set-up before and after each step.

use crate::setup::Setup;

/// Steps kept.
const LIMIT: usize = 200;

struct Step {
    before: Setup,
    after: Setup,
    /// The camera belongs to the step (a preset or another scene); else it stays where the user has flown.
    camera: bool,
}

/// What can be undone and redone.
pub struct History {
    last: Setup,
    past: Vec<Step>,
    future: Vec<Step>,
}

impl History {
    pub fn new(setup: &Setup) -> History {
        History { last: setup.clone(), past: Vec::new(), future: Vec::new() }
    }

    pub fn can_undo(&self) -> bool {
        !self.past.is_empty()
    }

    pub fn can_redo(&self) -> bool {
        !self.future.is_empty()
    }

    /// Makes a step of what changed since the last call. Flying about and the passing of time alone are none,
    /// unless `camera` says that the camera was chosen.
    pub fn commit(&mut self, now: &Setup, camera: bool) {
        if (camera && now.camera != self.last.camera) || *now != flown(&self.last, now) {
            self.past.push(Step { before: self.last.clone(), after: now.clone(), camera });
            self.past.drain(..self.past.len().saturating_sub(LIMIT));
            self.future.clear();
            self.last = now.clone();
        } else if self.last.camera != now.camera || self.last.time != now.time {
            self.last.camera = now.camera;
            self.last.time = now.time;
        }
    }

    /// Takes what changed since the last call as no step: the passing of time on a path.
    pub fn absorb(&mut self, now: &Setup) {
        self.last = now.clone();
    }

    /// The set-up before the last step.
    pub fn undo(&mut self, now: &Setup) -> Option<Setup> {
        let step = self.past.pop()?;
        let setup = if step.camera { step.before.clone() } else { flown(&step.before, now) };
        self.future.push(step);
        self.last = setup.clone();
        Some(setup)
    }

    /// The set-up after the step that was undone last.
    pub fn redo(&mut self, now: &Setup) -> Option<Setup> {
        let step = self.future.pop()?;
        let setup = if step.camera { step.after.clone() } else { flown(&step.after, now) };
        self.past.push(step);
        self.last = setup.clone();
        Some(setup)
    }
}

/// A set-up with the camera and the clock of another.
fn flown(setup: &Setup, now: &Setup) -> Setup {
    Setup { camera: now.camera, time: now.time, ..setup.clone() }
}
