//! What the window shows and changes, without the device that draws it.

use super::advice::Advising;
use super::chart::Chart;
use super::history::History;
use super::picker::Picker;
use super::timeline::Timeline;
use crate::frame::{SHARED_PASSES, Told};
use crate::measure::Record;
use crate::measure::advise::Budget;
use crate::scene::{Camera, Scene};
use crate::setup::Setup;
use crate::techniques::{self, Info};
use crate::truth::Progress;
use crate::view;
use anyhow::Context;
use glam::Vec3;
use std::collections::{BTreeSet, VecDeque};
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
    /// Measure these one after the other, each a row of the chart.
    Sweep(Vec<Setup>),
    /// Run techniques along the path of a case, in so many frames.
    Stability(&'static str, Vec<String>, usize),
    /// Look among techniques for the cheapest configuration that meets a budget.
    Advise(Budget, Vec<String>),
    CancelMeasuring,
    /// Write the measured rows: .svg and .png the chart, .csv and .json the figures.
    SaveRows(PathBuf),
    /// Render a small picture of this set-up (JSON, as a row holds it).
    Thumbnail(String),
    Capture(PathBuf),
    /// Ask where to capture to.
    PickCapture,
    SaveSetup(PathBuf),
    /// Look at the surface under this pixel of the viewport (0 to 1 from its upper left corner).
    Focus([f32; 2]),
    /// Read what the view shows there.
    Read([f32; 2]),
    Quit,
}

/// What the picture shows under the pointer.
pub struct Reading {
    /// Place in the viewport, 0 to 1 from its upper left corner.
    pub at: [f32; 2],
    /// In words; None: no value there.
    pub text: Option<String>,
}

/// A message in the bar over the viewport.
pub struct Note {
    pub text: String,
    /// Stays until it is dismissed.
    pub error: bool,
    pub since: Instant,
}

/// How far the truth of the picture is known.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Traced {
    /// The light has no truth here.
    #[default]
    NotServed,
    Partly(Progress),
    Fully,
}

impl Traced {
    /// Share of the picture's rows that have a truth, 0 to 1.
    pub fn covered(&self) -> f32 {
        match self {
            Traced::NotServed => 0.0,
            Traced::Partly(progress) => progress.covered,
            Traced::Fully => 1.0,
        }
    }
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
    /// Share of the pixels that can be wrong which are, and RMSE against the truth shown; None until they are known.
    pub error: Option<[f64; 2]>,
    /// What the picture shows wrong, known with the error.
    pub notes: Vec<String>,
}

impl Facts {
    /// Milliseconds of all passes.
    pub fn frame_ms(&self) -> f64 {
        self.passes.iter().fold(0.0, |sum, p| sum + p.1)
    }

    /// Milliseconds of the technique's passes.
    pub fn technique_ms(&self) -> f64 {
        self.passes.iter().filter(|p| !SHARED_PASSES.contains(&p.0)).fold(0.0, |sum, p| sum + p.1)
    }
}

/// A piece of work beside the window.
pub struct Job {
    /// What was started, such as `Sweep`.
    pub title: &'static str,
    /// What it is at.
    pub what: String,
    /// Share done, 0 to 1.
    pub done: f32,
    pub since: Instant,
}

impl Job {
    pub fn new(title: &'static str) -> Job {
        Job { title, what: String::new(), done: 0.0, since: Instant::now() }
    }

    /// How far it is and how long it will still take, in words.
    pub fn told(&self) -> String {
        let spent = self.since.elapsed().as_secs_f32();
        let left = spent * (1.0 - self.done) / self.done;
        let share = format!("{:.0} %", self.done * 100.0);
        match left {
            // Too early to tell.
            _ if self.done < 0.02 || spent < 2.0 => share,
            s if s < 90.0 => format!("{share}, {s:.0} s left"),
            s if s < 5400.0 => format!("{share}, {:.0} min left", s / 60.0),
            s => format!("{share}, {:.0} h left", s / 3600.0),
        }
    }
}

/// What stands in the drawer under the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tab {
    Chart,
    Stability,
    Advice,
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
    /// All that was measured or read from files, the newest last: the chart's points.
    pub rows: Vec<Record>,
    /// The drawer's open tab.
    pub drawer: Option<Tab>,
    /// Techniques that sweeps, stability and advice leave out.
    pub left_out: BTreeSet<&'static str>,
    pub chart: Chart,
    pub timeline: Timeline,
    pub advice: Advising,
    pub facts: Facts,
    /// None: not read since the picture changed.
    pub reading: Option<Reading>,
    pub show_help: bool,
    pub show_panel: bool,
    /// The window has no room for panel and picture side by side: the panel then covers the picture, if `show_over`.
    pub narrow: bool,
    pub show_over: bool,
    /// What the technique's list is narrowed down to.
    pub search: String,
    /// Parameters that stand on top, by name.
    pub pinned: BTreeSet<&'static str>,
    /// The picture has the capture's shape.
    pub framed: bool,
    /// The file dialog, where the system has none.
    pub picker: Option<Picker>,
    /// Measured rows are in no file yet.
    pub unsaved: bool,
    /// Asked to close with such rows, and waiting for an answer.
    pub closing: bool,
}

impl Model {
    pub fn new(setup: Setup, scene: Arc<Scene>, bounds: [Vec3; 2]) -> Model {
        let mut timeline = Timeline::default();
        timeline.opened(&setup);
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
            drawer: None,
            left_out: BTreeSet::new(),
            chart: Chart::default(),
            timeline,
            advice: Advising::default(),
            facts: Facts::default(),
            reading: None,
            show_help: false,
            show_panel: true,
            narrow: false,
            show_over: false,
            search: String::new(),
            pinned: BTreeSet::new(),
            framed: false,
            picker: None,
            unsaved: false,
            closing: false,
            setup,
        }
    }

    /// Takes another scene and set-up; messages and measurements stay. Opening is a step that can be undone,
    /// unless it `restored` one.
    pub fn open(&mut self, setup: Setup, scene: Arc<Scene>, bounds: [Vec3; 2], restored: bool) {
        if !restored || self.setup.scene != setup.scene {
            self.home = setup.camera;
        }
        if !restored {
            self.history.commit(&self.setup, true);
            self.history.commit(&setup, true);
        }
        self.setup = setup;
        self.scene = scene;
        self.bounds = bounds;
        self.playing = false;
        self.chart.trail.clear();
        self.timeline.opened(&self.setup);
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

    /// The techniques that serve the light and are not left out, in the order of the lists.
    pub fn techniques(&self) -> Vec<String> {
        let fits = |i: &&&Info| i.refuses(&self.setup.light).is_none() && !self.left_out.contains(i.id);
        techniques::ALL.iter().filter(fits).map(|i| i.id.into()).collect()
    }

    /// Adds measured rows to the list; one that was measured before takes the place of the older.
    pub fn adopt(&mut self, rows: impl IntoIterator<Item = Record>) {
        for row in rows {
            let again = |r: &Record| r.setup == row.setup && r.adapter == row.adapter && !row.setup.is_empty();
            self.rows.retain(|r| !again(r));
            self.rows.push(row);
            self.unsaved = true;
        }
        self.chart.stale = true;
    }

    /// Empties the list of measured rows.
    pub fn clear_rows(&mut self) {
        self.rows.clear();
        self.unsaved = false;
        self.chart.pictures.clear();
        self.chart.stale = true;
    }

    /// Takes over the set-up of a measured row, as one step that can be undone; the view stays. The action loads its
    /// scene, where that is another.
    pub fn apply(&mut self, row: &Record) -> Option<Action> {
        let setup = row.setup().and_then(|s| s.check().map(|()| s).context("this row cannot be used"));
        let mut setup = match setup {
            Ok(setup) => setup,
            Err(e) => {
                self.fail(&e);
                return None;
            }
        };
        // What was changed just before is a step of its own.
        self.history.commit(&self.setup, true);
        setup.split = self.setup.split;
        let known = techniques::find(&setup.technique).is_some_and(|i| view::check(&self.setup.view, i).is_ok());
        setup.view = if known { self.setup.view.clone() } else { view::VIEWS[0].id.into() };
        // Other techniques keep what they are set to.
        let own = setup.values().clone();
        setup.params = self.setup.params.clone();
        setup.params.insert(setup.technique.clone(), own);
        setup.complete();
        self.camera_chosen = true;
        self.timeline.playing = false;
        self.take(setup)
    }

    /// Something moves by itself.
    pub fn moving(&self) -> bool {
        self.playing || self.timeline.playing
    }

    /// Lets the clocks run.
    pub fn advance(&mut self, seconds: f32) {
        if self.playing {
            let duration = self.duration();
            self.setup.time = if duration > 0.0 { (self.setup.time + seconds) % duration } else { 0.0 };
        }
        if self.timeline.playing {
            let t = self.timeline.t + seconds / super::timeline::SECONDS;
            self.scrub(if t > 1.0 { 0.0 } else { t });
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

    /// Opens the drawer at a tab, or closes it there.
    pub fn toggle(&mut self, tab: Tab) {
        self.drawer = if self.drawer == Some(tab) { None } else { Some(tab) };
    }

    /// Whether the panel shows.
    pub fn panel_shows(&self) -> bool {
        if self.narrow { self.show_over } else { self.show_panel }
    }

    /// Hides or shows the panel.
    pub fn toggle_panel(&mut self) {
        let shown = if self.narrow { &mut self.show_over } else { &mut self.show_panel };
        *shown = !*shown;
    }

    /// Goes back to the preset chosen last, or to the camera of the file, as a step.
    pub fn go_home(&mut self) {
        self.setup.camera = self.home;
        self.camera_chosen = true;
    }

    /// Whether the window may close now; else it asks what is to become of the rows measured. Who asks again means it.
    pub fn may_close(&mut self) -> bool {
        self.closing = !self.closing && self.unsaved && !self.rows.is_empty();
        !self.closing
    }

    /// Whether a technique is among those searched for.
    pub fn finds(&self, info: &Info) -> bool {
        let wanted = self.search.trim().to_lowercase();
        let text = [info.id, info.title, info.paper, info.family].join(" ").to_lowercase();
        wanted.split_whitespace().all(|word| text.contains(word))
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
        self.history.commit(&self.setup, true);
        let (before, told) = self.history.undo(&self.setup)?;
        self.say_step(format!("Undid: {told}"));
        self.take(before)
    }

    /// Does an undone step again.
    pub fn redo(&mut self) -> Option<Action> {
        self.history.commit(&self.setup, true);
        let (after, told) = self.history.redo(&self.setup)?;
        self.say_step(format!("Redid: {told}"));
        self.take(after)
    }

    /// Says what a step was, instead of what the last one was.
    fn say_step(&mut self, text: String) {
        self.notes.retain(|n| !n.text.starts_with("Undid: ") && !n.text.starts_with("Redid: "));
        self.say(text);
    }

    fn take(&mut self, mut setup: Setup) -> Option<Action> {
        if setup.scene != self.setup.scene {
            self.loading = Some(setup.scene.clone());
            return Some(Action::Restore(Box::new(setup)));
        }
        setup.count_from(self.scene.origin);
        self.setup = setup;
        None
    }
}
