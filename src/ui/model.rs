//! What the window shows and changes, without the device that draws it.

use super::history::History;
use crate::frame::{SHARED_PASSES, Told};
use crate::measure::Record;
use crate::scene::{Camera, Scene};
use crate::setup::Setup;
use crate::techniques::{self, Info};
use crate::view;
use glam::Vec3;
use std::collections::VecDeque;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

/// What the panel asks the window to do.
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    /// Open a scene, a set-up or a capture.
    Open(String),
    /// Load the scene of this set-up and go on with it.
    Restore(Box<Setup>),
    /// Ask for a file to open.
    PickFile,
    CancelLoading,
    Measure,
    CancelMeasuring,
    Capture(PathBuf),
    /// Ask where to capture to.
    PickCapture,
    SaveSetup(PathBuf),
    /// Look at the surface under this pixel of the viewport (0 to 1 from its upper left corner).
    Focus([f32; 2]),
    Quit,
}

/// A message in the bar over the viewport.
pub struct Note {
    pub text: String,
    /// Stays until it is dismissed.
    pub error: bool,
    pub since: Instant,
}

/// How far the exact shadow of the picture is known.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Traced {
    /// The light has no exact shadow here.
    #[default]
    NotServed,
    /// Share of the picture, 0 to 1.
    Partly(f32),
    Fully,
}

/// What the last frame told.
#[derive(Default)]
pub struct Facts {
    pub adapter: String,
    pub software: bool,
    /// Pass times are wall clock, not GPU timestamps.
    pub wall_clock: bool,
    /// Pixels that the viewport was rendered at.
    pub size: [u32; 2],
    /// Pixels that the viewport covers.
    pub full: [u32; 2],
    /// Passes and their milliseconds, equal names added up.
    pub passes: Vec<(&'static str, f64)>,
    /// The technique's milliseconds in recent frames at full resolution, oldest first.
    pub recent: VecDeque<f64>,
    pub told: Told,
    pub traced: Traced,
    /// The picture shown is an earlier one of fewer pixels, complete, while the truth is traced for all.
    pub keeping: bool,
    /// Share of the pixels facing the light that are wrong; None until it is known.
    pub error: Option<f64>,
}

impl Facts {
    /// Milliseconds of all passes.
    pub fn frame_ms(&self) -> f64 {
        self.passes.iter().map(|p| p.1).sum()
    }

    /// Milliseconds of the technique's passes.
    pub fn technique_ms(&self) -> f64 {
        self.passes.iter().filter(|p| !SHARED_PASSES.contains(&p.0)).map(|p| p.1).sum()
    }
}

/// A piece of work beside the window.
pub struct Job {
    pub what: String,
    /// Share done, 0 to 1.
    pub done: f32,
}

/// All that the window shows.
pub struct Model {
    pub setup: Setup,
    pub scene: Arc<Scene>,
    /// The scene's lowest and highest corner, metres.
    pub bounds: [Vec3; 2],
    /// Where the reset returns to: the camera of the file, or the preset chosen last.
    pub home: Camera,
    pub history: History,
    /// The camera was chosen, not flown: it is part of the next undo step.
    pub camera_chosen: bool,
    /// The animation runs.
    pub playing: bool,
    pub open_path: String,
    pub picture_path: String,
    pub setup_path: String,
    pub notes: Vec<Note>,
    pub loading: Option<String>,
    pub measuring: Option<Job>,
    pub capturing: bool,
    /// Measured, the newest first.
    pub rows: Vec<Record>,
    pub facts: Facts,
    pub show_help: bool,
    pub show_panel: bool,
}

impl Model {
    pub fn new(setup: Setup, scene: Arc<Scene>, bounds: [Vec3; 2]) -> Model {
        Model {
            history: History::new(&setup),
            home: setup.camera,
            scene,
            bounds,
            camera_chosen: false,
            playing: false,
            open_path: String::new(),
            picture_path: "picture.png".into(),
            setup_path: "setup.toml".into(),
            notes: Vec::new(),
            loading: None,
            measuring: None,
            capturing: false,
            rows: Vec::new(),
            facts: Facts::default(),
            show_help: false,
            show_panel: true,
            setup,
        }
    }

    /// Takes another scene and set-up; messages and measurements stay. Opening is a step that can be undone,
    /// unless it `restored` one.
    pub fn open(&mut self, setup: Setup, scene: Arc<Scene>, bounds: [Vec3; 2], restored: bool) {
        if !restored {
            self.home = setup.camera;
            self.history.commit(&self.setup, false);
            self.history.commit(&setup, true);
        }
        self.setup = setup;
        self.scene = scene;
        self.bounds = bounds;
        self.playing = false;
    }

    /// After a step that could not be undone or redone: the present set-up is the newest.
    pub fn keep_history(&mut self) {
        self.history.commit(&self.setup, true);
    }

    /// The selected technique; the first where the set-up names none that exists.
    pub fn info(&self) -> &'static Info {
        techniques::find(&self.setup.technique).unwrap_or(techniques::ALL[0])
    }

    /// Selects a technique, and the shaded view where it lacks the present one.
    pub fn select(&mut self, info: &Info) {
        self.setup.technique = info.id.into();
        self.setup.complete();
        if view::check(&self.setup.view, info).is_err() {
            self.setup.view = view::VIEWS[0].id.into();
        }
    }

    /// Says something for a few seconds.
    pub fn say(&mut self, text: impl Into<String>) {
        self.notes.push(Note { text: text.into(), error: false, since: Instant::now() });
    }

    /// Says what went wrong, until it is dismissed.
    pub fn fail(&mut self, error: &anyhow::Error) {
        let text = format!("{error:#}");
        self.notes.retain(|n| n.text != text);
        self.notes.push(Note { text, error: true, since: Instant::now() });
    }

    /// The scene's extent from corner to corner, metres.
    pub fn diagonal(&self) -> f32 {
        (self.bounds[1] - self.bounds[0]).length().max(1e-3)
    }

    /// Length of the chosen animation, seconds.
    pub fn duration(&self) -> f32 {
        let Some(animation) = self.scene.animations.get(self.setup.animation as usize) else { return 0.0 };
        animation.channels.iter().filter_map(|c| c.times.last()).fold(0.0, |a, t| a.max(*t))
    }

    /// Undoes a step; the action loads the scene, where that differs.
    pub fn undo(&mut self) -> Option<Action> {
        let before = self.history.undo(&self.setup)?;
        self.take(before)
    }

    /// Does an undone step again.
    pub fn redo(&mut self) -> Option<Action> {
        let after = self.history.redo(&self.setup)?;
        self.take(after)
    }

    fn take(&mut self, setup: Setup) -> Option<Action> {
        if setup.scene != self.setup.scene {
            self.loading = Some(setup.scene.clone());
            return Some(Action::Restore(Box::new(setup)));
        }
        self.setup = setup;
        None
    }
}
