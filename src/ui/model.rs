//! What the window shows and changes, without the device that draws it.

use super::advice::Advising;
use super::animating::Animating;
use super::chart::Chart;
use super::flatland::Lab;
use super::history::History;
use super::inspect::Inspect;
use super::lesson::Running;
use super::lost::{self, Lost};
use super::maps::Maps;
use super::picker::Picker;
use super::pictures::{Picture, Pictures, Subject};
use super::sheets::Builder;
use super::start::Start;
use super::timeline::Timeline;
use super::words::Words;
use crate::capture;
use crate::figure::{Format, Spec};
use crate::flatland::Flatland;
use crate::frame::{Told, ToldLight, technique_ms};
use crate::gpu::{Abilities, Fault, Gpu};
use crate::legend::Known;
use crate::map::fit::lixel::Plane;
use crate::measure::Record;
use crate::measure::advise::Budget;
use crate::measure::diagnosis::Remedy;
use crate::measure::stability::Run;
use crate::message;
use crate::params::Values;
use crate::scene::{Camera, Clock, Scene};
use crate::sequence::Sequence;
use crate::setup::{Arrange, Setup, Side};
use crate::techniques::{self, Info, lixel_per_pixel};
use crate::truth::Progress;
use crate::view;
use anyhow::Context;
use glam::Vec3;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

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
    /// Go on with the sweep that has not come to its end.
    GoOnSweeping,
    /// Run techniques along the path of a case; None: along the set-up's own.
    Stability(Option<&'static str>, Run),
    /// Look among techniques for the cheapest configuration that meets a budget.
    Advise(Budget, Vec<String>),
    CancelMeasuring,
    /// Change a parameter, and measure the errors before and after.
    Try(Remedy),
    CancelTrying,
    /// Load the scene of the lesson's step and show its set-up.
    Step,
    /// Measure the answer to the step's question.
    Answer,
    /// Open a set-up of the gallery by its id.
    Exhibit(&'static str),
    /// Find out which files were opened last.
    LookUpRecent,
    /// Go on with what a window that is gone has left, by its place in the list; or let go of it.
    GoOn(usize),
    Forget(usize),
    /// Draw a sheet, and write it into a folder under a name in these formats, if they are given.
    Sheet(Box<Spec>, Option<((PathBuf, String), Vec<Format>)>),
    /// Write what a tab of the drawer shows: as a chart or as figures, by the file's ending.
    Export(Tab, PathBuf),
    /// Render a small picture.
    Thumbnail(Subject),
    Capture(PathBuf),
    /// A file of 1920 × 1080 pixels with the legend in it.
    Figure(PathBuf),
    /// Write an animation of the set-up, or its frames.
    Animate(Sequence, PathBuf),
    /// Ask where to capture to.
    PickCapture,
    SaveSetup(PathBuf),
    /// Write the flatland lab's world.
    SaveWorld(PathBuf),
    /// Look at the surface under this pixel of the viewport (0 to 1 from its upper left corner).
    Focus([f32; 2]),
    /// Make the plane of the surface there the plane of interest.
    PickPlane([f32; 2]),
    /// Read what the view shows there.
    Read([f32; 2]),
    /// Show what the pass of this name wrote for a side, from 0.
    Shot(usize, &'static str),
    /// Draw the scene on the adapter of this name from here on.
    Adapter(String),
    Quit,
}

/// What a pass wrote into its last texture.
pub struct ShotSeen {
    /// The side of the comparison, from 0.
    pub side: usize,
    pub pass: &'static str,
    pub picture: Picture,
    /// Its size and range in words.
    pub told: String,
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
    /// The shader that it is about.
    pub code: Option<Code>,
    pub error: bool,
    /// When it goes; None: once it is dismissed.
    pub until: Option<Instant>,
    /// It tells what could not be opened, and goes when something else is.
    pub opening: bool,
}

/// Lines of a shader, of which one is wrong.
pub struct Code {
    pub lines: Vec<(usize, String)>,
    pub wrong: usize,
}

/// Most messages over the picture.
const MOST_NOTES: usize = 12;
/// How long what is said stays, and what went wrong.
const SAID: Duration = Duration::from_secs(6);
const FAILED: Duration = Duration::from_secs(12);
/// How it begins that a lost device was opened anew.
const GOES_ON: &str = "All goes on";

/// How far the truth of the picture is known.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Traced {
    /// The light has no truth here.
    #[default]
    NotServed,
    Partly(Progress),
    Fully,
}

/// What the last frame told.
#[derive(Clone, Default)]
pub struct Facts {
    /// The number of the order that it answers ([`Model::order`]).
    pub of: u64,
    pub adapter: String,
    pub software: bool,
    /// What the adapter can do, once that is known, and why it cannot run some techniques, by their ids.
    pub abilities: Option<Arc<Abilities>>,
    pub lacking: Arc<BTreeMap<&'static str, String>>,
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
    /// What the legend needs to know of the picture.
    pub known: Known,
    pub traced: Traced,
    /// The view waits for all pixels of the viewport; the picture is shaded meanwhile.
    pub waits: bool,
    /// What the last whole frame of each technique took at full resolution, seconds.
    pub seconds: BTreeMap<&'static str, f64>,
    /// Share of the pixels that can be wrong which are, and RMSE against the truth shown; None until they are known.
    pub error: Option<[f64; 2]>,
    /// What the picture shows wrong, known with the error.
    pub notes: Vec<String>,
    /// What of the scene the adapter had no room for.
    pub scene_note: Option<String>,
}

impl Facts {
    /// Takes note of the device that the scene is drawn on.
    pub fn know(&mut self, gpu: &Gpu) {
        let lacking = techniques::ALL.iter().filter_map(|info| Some((info.id, info.cannot_run(&gpu.abilities)?)));
        self.lacking = Arc::new(lacking.collect());
        (self.adapter, self.software) = (gpu.info.name.clone(), gpu.software());
        self.abilities = Some(gpu.abilities.clone());
    }

    /// Milliseconds of all passes, of all sides.
    pub fn frame_ms(&self) -> f64 {
        let sides = self.told.sides.iter().flat_map(|s| &s.passes);
        let passes = if self.told.sides.is_empty() { self.passes.iter().collect() } else { Vec::from_iter(sides) };
        passes.iter().fold(0.0, |sum, p| sum + p.1)
    }

    /// The passes of a side; none of the truth.
    pub fn passes_of(&self, side: usize) -> &[(&'static str, f64)] {
        if self.told.sides.is_empty() { &self.passes } else { self.told.sides.get(side).map_or(&[], |s| &s.passes) }
    }

    /// What a side's technique takes for each light.
    pub fn lights_of(&self, side: usize) -> &[ToldLight] {
        if self.told.sides.is_empty() {
            &self.told.lights
        } else {
            self.told.sides.get(side).map_or(&[], |s| &s.lights)
        }
    }

    /// Milliseconds of a side's technique.
    pub fn technique_ms(&self, side: usize) -> f64 {
        technique_ms(self.passes_of(side))
    }

    /// Bytes of GPU memory that a side's technique holds.
    pub fn bytes_of(&self, side: usize) -> u64 {
        let sides = &self.told.sides;
        if sides.is_empty() { self.told.gpu_bytes } else { sides.get(side).map_or(0, |s| s.gpu_bytes) }
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
    /// Rows measured so far.
    pub rows: usize,
    pub since: Instant,
}

impl Job {
    pub fn new(title: &'static str) -> Job {
        Job { title, what: String::new(), done: 0.0, rows: 0, since: Instant::now() }
    }

    /// How far it is and how long it will still take, in words.
    pub fn told(&self) -> String {
        let spent = self.since.elapsed().as_secs_f32();
        let left = spent * (1.0 - self.done) / self.done;
        // What is done has ended.
        let share = format!("{:.0} %", (self.done * 100.0).min(99.0));
        match left {
            // Too early to tell.
            _ if self.done < 0.02 || spent < 2.0 => share,
            s if s < 90.0 => format!("{share}, {s:.0} s left"),
            s if s < 5400.0 => format!("{share}, {:.0} min left", s / 60.0),
            s => format!("{share}, {:.0} h left", s / 3600.0),
        }
    }
}

/// A sweep that runs, or that was cancelled, failed or torn away before its end.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sweeping {
    /// The set-up that costs are multiples of.
    pub base: Setup,
    /// Configurations that are still to be measured, and how many there were.
    pub left: Vec<Setup>,
    pub of: usize,
}

/// What stands in the drawer under the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Tab {
    Chart,
    Stability,
    Advice,
    Pixel,
    Figure,
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
    /// The last sweep, until all of it is measured.
    pub sweeping: Option<Sweeping>,
    pub capturing: bool,
    /// All that was measured or read from files, the newest last: the chart's points.
    pub rows: Vec<Record>,
    /// The drawer's open tab.
    pub drawer: Option<Tab>,
    /// Techniques that sweeps, stability and advice leave out.
    pub left_out: BTreeSet<&'static str>,
    pub chart: Chart,
    pub pictures: Pictures,
    pub timeline: Timeline,
    pub lab: Lab,
    pub start: Start,
    /// The lesson that is being taken.
    pub lesson: Option<Running>,
    /// Passes in which its control is still scrolled to.
    pub sought: u8,
    /// The glossary, while it is open.
    pub words: Option<Words>,
    pub advice: Advising,
    pub inspect: Inspect,
    pub builder: Builder,
    pub facts: Facts,
    /// The number of what was ordered last from the scene's thread, and since when it is awaited.
    pub order: u64,
    pub ordered: Instant,
    /// The next click into the picture picks the plane of interest.
    pub picking: bool,
    /// None: not read since the picture changed.
    pub reading: Option<Reading>,
    /// Of the pass whose name was under the pointer last, in this picture.
    pub shot: Option<ShotSeen>,
    pub show_help: bool,
    pub show_panel: bool,
    /// The legend lies over the picture.
    pub show_legend: bool,
    pub maps: Maps,
    /// The side of the comparison that the panel edits, from 0.
    pub editing: usize,
    /// The view before the difference was looked at.
    look: String,
    /// The window has no room for panel and picture side by side: the panel then covers the picture, if `show_over`.
    pub narrow: bool,
    pub show_over: bool,
    /// What the technique's list is narrowed down to.
    pub search: String,
    /// The search is to be shown, and typed into.
    pub searching: bool,
    /// The technique that the list has shown as the chosen one; none after a set-up was opened.
    pub listed: Option<&'static str>,
    /// The pointer is in the panel, where nothing may move then.
    pub still: bool,
    /// Heights of the rows that parameters, by technique and name, have had since the pointer came there.
    pub places: BTreeMap<(&'static str, &'static str), f32>,
    /// Parameters that stand on top, by name.
    pub pinned: BTreeSet<&'static str>,
    /// The picture has the capture's shape.
    pub framed: bool,
    /// The part of the picture that captures show is being dragged out in it.
    pub cropping: bool,
    pub animating: Animating,
    /// A capture with a legend has the capture's size as a whole; else its picture has.
    pub whole: bool,
    /// The file dialog, where the system has none.
    pub picker: Option<Picker>,
    /// What these tabs show is in no file yet.
    pub unsaved: Vec<Tab>,
    /// Keys that the camera flies with, while they are held.
    pub flying: Vec<egui::Key>,
    /// Where the file dialog was last.
    pub folder: Option<PathBuf>,
    /// Asked to close all the same, and waiting for an answer.
    pub closing: bool,
    /// The scene's device is lost; which adapter goes on is being asked.
    pub lost: Option<Lost>,
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
            sweeping: None,
            capturing: false,
            rows: Vec::new(),
            drawer: None,
            left_out: BTreeSet::new(),
            chart: Chart::default(),
            pictures: Pictures::default(),
            timeline,
            lab: Lab::default(),
            start: Start::default(),
            lesson: None,
            sought: 0,
            words: None,
            advice: Advising::default(),
            inspect: Inspect::default(),
            builder: Builder::default(),
            facts: Facts::default(),
            order: 0,
            ordered: Instant::now(),
            picking: false,
            reading: None,
            shot: None,
            show_help: false,
            show_panel: true,
            show_legend: true,
            maps: Maps::default(),
            editing: 0,
            look: String::new(),
            narrow: false,
            show_over: false,
            search: String::new(),
            searching: false,
            listed: None,
            still: false,
            places: BTreeMap::new(),
            pinned: BTreeSet::new(),
            framed: false,
            cropping: false,
            animating: Animating::default(),
            whole: false,
            picker: None,
            unsaved: Vec::new(),
            flying: Vec::new(),
            folder: None,
            closing: false,
            lost: None,
            setup,
        }
    }

    /// Takes another scene and set-up; measurements stay, and messages but on what could not be opened. Opening is a step that can be undone,
    /// unless it `restored` one.
    pub fn open(&mut self, setup: Setup, scene: Arc<Scene>, bounds: [Vec3; 2], restored: bool) {
        self.notes.retain(|n| !n.opening);
        if !restored || self.setup.scene != setup.scene {
            self.home = setup.camera;
        }
        if !restored {
            self.history.commit(&self.setup, true);
            self.history.commit(&setup, true);
        }
        self.setup = setup;
        self.listed = None;
        self.editing = self.editing.min(self.setup.against.len());
        self.scene = scene;
        self.bounds = bounds;
        self.playing = false;
        self.chart.trail.clear();
        (self.inspect.story, self.inspect.tried) = (None, None);
        self.timeline.opened(&self.setup);
    }

    /// After a step that could not be undone or redone: the present set-up is the newest.
    pub fn keep_history(&mut self) {
        self.history.commit(&self.setup, true);
    }

    /// The first side's technique; the first of all where the set-up names none that exists.
    pub fn info(&self) -> &'static Info {
        techniques::find(&self.setup.technique).unwrap_or(techniques::ALL[0])
    }

    /// The technique of the side that the panel edits; None: that is the truth.
    pub fn edited(&self) -> Option<&'static Info> {
        self.setup.info(self.side())
    }

    /// The side that the panel edits, and that its figures are of; from 0.
    pub fn side(&self) -> usize {
        self.editing.min(self.setup.sides() - 1)
    }

    /// The parameters of that side.
    pub fn edited_values(&mut self) -> &mut Values {
        match self.side().checked_sub(1) {
            Some(i) => &mut self.setup.against[i].params,
            None => self.setup.params.entry(self.setup.technique.clone()).or_default(),
        }
    }

    /// Whether the side that the panel edits has a plane of interest.
    pub fn has_plane(&self) -> bool {
        self.edited().is_some_and(|info| info.id == lixel_per_pixel::INFO.id)
    }

    /// Gives that side a plane of interest, of scene space.
    pub fn give_plane(&mut self, plane: &Plane) {
        if self.has_plane() {
            let origin = self.scene.origin;
            lixel_per_pixel::give(self.edited_values(), plane, origin);
        }
    }

    /// Selects a technique for the side that the panel edits, and the shaded view where no side has the present one.
    pub fn select(&mut self, info: &Info) {
        self.set_side(self.side(), info.id);
    }

    /// Sets what a side shows: a technique, or [`Side::TRUTH`].
    pub fn set_side(&mut self, side: usize, technique: &str) {
        match side.checked_sub(1) {
            Some(i) => {
                if let Ok(new) = self.setup.kept(technique) {
                    self.setup.against[i] = new;
                }
            }
            None => {
                self.setup.technique = technique.into();
                self.setup.complete();
            }
        }
        self.settle_view();
    }

    /// Shows the shaded view where no side has the present one.
    pub(super) fn settle_view(&mut self) {
        let setup = &mut self.setup;
        if setup.find_view(&setup.view).is_none() {
            setup.view = view::VIEWS[0].id.into();
        }
        if setup.overlay.as_ref().is_some_and(|o| setup.find_view(&o.view).is_none()) {
            setup.overlay = None;
        }
    }

    /// Adds a side, and edits it.
    pub fn add_side(&mut self, side: Side) {
        self.setup.against.push(side);
        self.editing = self.setup.against.len();
        if self.setup.sides() > 2 && self.setup.arrange == Arrange::Swipe {
            self.setup.arrange = Arrange::SideBySide;
        }
    }

    /// Takes a side away that is not the first.
    pub fn remove_side(&mut self, side: usize) {
        self.setup.against.remove(side - 1);
        self.editing = if self.editing >= side { self.editing.saturating_sub(1) } else { self.editing };
        self.setup.front = self.setup.front.min(self.setup.against.len() as u32);
        if self.setup.sides() == 1 && self.setup.view == "difference" {
            self.toggle_difference();
        }
        self.settle_view();
    }

    /// Shows the difference of the first two sides, or again what was shown before.
    pub fn toggle_difference(&mut self) {
        if self.setup.view == "difference" {
            self.setup.view = std::mem::take(&mut self.look);
            self.settle_view();
        } else {
            self.look = std::mem::replace(&mut self.setup.view, "difference".into());
            self.setup.overlay = None;
        }
    }

    /// Shows the next side at the same pixels; what the sides show, where that was their difference.
    pub fn flicker(&mut self) {
        if self.setup.sides() > 1 {
            if self.setup.view == "difference" {
                self.toggle_difference();
            }
            if self.setup.arrange == Arrange::Flicker {
                self.setup.front = (self.setup.front + 1) % self.setup.sides() as u32;
            }
            self.setup.arrange = Arrange::Flicker;
        }
    }

    /// The techniques that serve the light and are not left out, in the order of the lists.
    pub fn techniques(&self) -> Vec<String> {
        let fits = |i: &&&Info| self.setup.refusal(i).is_none() && !self.left_out.contains(i.id);
        techniques::ALL.iter().filter(fits).map(|i| i.id.into()).collect()
    }

    /// Adds measured rows to the list; one that was measured before takes the place of the older.
    pub fn adopt(&mut self, rows: impl IntoIterator<Item = Record>) {
        for row in rows {
            let again = |r: &Record| r.setup == row.setup && r.adapter == row.adapter && !row.setup.is_empty();
            self.rows.retain(|r| !again(r));
            self.rows.push(row);
            self.unsaved(Tab::Chart);
        }
        self.chart.stale = true;
    }

    /// A row has come in: what of the sweep is left.
    pub fn swept(&mut self, row: &Record) {
        if let (Some(sweep), Ok(setup)) = (&mut self.sweeping, row.setup()) {
            sweep.left.retain(|left| *left != setup);
        }
    }

    /// What a tab shows is in no file.
    pub fn unsaved(&mut self, tab: Tab) {
        if !self.unsaved.contains(&tab) {
            self.unsaved.push(tab);
        }
    }

    /// Empties the list of measured rows.
    pub fn clear_rows(&mut self) {
        self.rows.clear();
        self.unsaved.retain(|tab| *tab != Tab::Chart);
        self.pictures.forget_rows();
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
        // How it is shown stays.
        let now = &self.setup;
        setup = Setup {
            split: now.split,
            arrange: now.arrange,
            front: now.front,
            legend: now.legend,
            supersample: now.supersample,
            transparent: now.transparent,
            crop: now.crop,
            against: now.against.clone(),
            error_dilation: now.error_dilation,
            error_base: now.error_base,
            error_window: now.error_window,
            probe: now.probe,
            outlines: now.outlines,
            overlay: now.overlay.clone(),
            path: now.path.clone().filter(|_| now.scene == setup.scene),
            shadow_camera: now.shadow_camera.filter(|_| now.scene == setup.scene),
            ..setup
        };
        let known = setup.find_view(&self.setup.view).is_some();
        setup.view = if known { self.setup.view.clone() } else { view::VIEWS[0].id.into() };
        let overlay = setup.overlay.take();
        setup.overlay = overlay.filter(|o| setup.find_view(&o.view).is_some());
        // Other techniques keep what they are set to.
        let own = setup.values().clone();
        setup.params = self.setup.params.clone();
        setup.params.insert(setup.technique.clone(), own);
        let unit = std::mem::replace(&mut setup.unit, self.setup.unit);
        setup.take_unit(unit);
        setup.complete();
        setup.fit_path();
        self.camera_chosen = true;
        self.timeline.playing = false;
        self.take(setup)
    }

    /// The picture has fewer pixels than the viewport.
    pub fn draft(&self) -> bool {
        self.facts.size != self.facts.full
    }

    /// The size that a capture into this file has as a whole, where its picture is to make room for the legend.
    pub fn whole_file(&self, path: &Path) -> Option<[u32; 2]> {
        (self.whole && self.setup.legend && !capture::is_exr(path)).then_some(self.setup.size)
    }

    /// Since when a picture of the set-up at full resolution is awaited.
    pub fn awaited(&self) -> Option<Instant> {
        let awaited = (self.order != self.facts.of || self.draft()) && self.measuring.is_none();
        awaited.then_some(self.ordered)
    }

    /// Something moves by itself.
    pub fn moving(&self) -> bool {
        self.playing || self.timeline.playing
    }

    /// Lets the clocks run.
    pub fn advance(&mut self, seconds: f32) {
        if self.playing {
            let duration = self.duration();
            let time = if duration > 0.0 { (self.setup.time + seconds) % duration } else { 0.0 };
            self.set_clock(Clock { time, ..self.setup.clock() });
        }
        self.play_on(seconds);
        self.take_sample();
    }

    /// Sets the scene's clock, and what follows it: no step that can be undone, but for a change of the animation.
    pub fn set_clock(&mut self, to: Clock) {
        self.home = self.scene.follow_camera(self.home, [self.setup.clock(), to]);
        self.setup.set_clock(&self.scene, to);
        self.history.pass(&self.scene, to.time);
    }

    /// Says something for a few seconds.
    pub fn say(&mut self, text: impl Into<String>) {
        let until = Some(Instant::now() + SAID);
        self.notes.push(Note { text: text.into(), code: None, error: false, until, opening: false });
    }

    /// Says what went wrong, long enough to be read.
    pub fn fail(&mut self, error: &anyhow::Error) {
        let until = Some(Instant::now() + FAILED);
        self.warn(Note { text: message::sentence(error), code: None, error: true, until, opening: false });
    }

    /// Says what could not be opened, until something else is.
    pub fn fail_to_open(&mut self, error: &anyhow::Error) {
        let until = Some(Instant::now() + FAILED);
        self.warn(Note { text: message::sentence(error), code: None, error: true, until, opening: true });
    }

    /// Says what keeps the picture from being drawn, until it is dismissed.
    pub fn stop(&mut self, error: &anyhow::Error) {
        let fault = error.downcast_ref::<Fault>();
        let code = fault.map(|f| Code { lines: f.lines.clone(), wrong: f.line });
        let text = match fault {
            Some(f) => format!(
                "{}, line {}: {}. The last picture stays until it is mended.",
                f.file,
                f.line,
                f.message.trim_end_matches('.')
            ),
            None => message::sentence(error),
        };
        self.warn(Note { text, code, error: true, until: None, opening: false });
    }

    /// Why a technique cannot be chosen: for the light at work, or on this adapter.
    pub fn refusal(&self, info: &Info) -> Option<String> {
        let lacking = || Some(format!("{}: {}", info.title, self.facts.lacking.get(info.id)?));
        info.refuses(&self.setup.light).or_else(lacking)
    }

    /// Says that the driver had dropped a device, and that all goes on.
    pub fn reopened(&mut self, why: &anyhow::Error) {
        let text = format!("{GOES_ON}: {}, and it was opened anew.", lost::why(why));
        self.warn(Note { text, code: None, error: false, until: Some(Instant::now() + FAILED), opening: false });
    }

    /// The scene's device is lost for good: an adapter is asked for.
    pub fn lose(&mut self, lost: Lost) {
        self.notes.retain(|n| !n.text.starts_with(GOES_ON));
        self.lost = Some(lost);
    }

    fn warn(&mut self, note: Note) {
        self.notes.retain(|n| n.text != note.text);
        self.notes.push(note);
        // What nobody dismisses does not pile up: the oldest goes.
        self.notes.drain(..self.notes.len().saturating_sub(MOST_NOTES));
    }

    /// Opens the drawer at a tab, or closes it there.
    pub fn toggle(&mut self, tab: Tab) {
        self.drawer = if self.drawer == Some(tab) { None } else { Some(tab) };
    }

    /// Whether the panel shows.
    pub fn panel_shows(&self) -> bool {
        if self.narrow { self.show_over } else { self.show_panel }
    }

    /// Opens the builder on a sheet's spec, whose base is open.
    pub fn build(&mut self, path: &Path, spec: Spec) {
        self.builder.open(path, spec);
        self.drawer = Some(Tab::Figure);
    }

    /// Opens the flatland lab on a world.
    pub fn show_world(&mut self, path: &Path, world: Flatland) {
        self.start.shown = false;
        self.lab.open(path, world);
        if !self.lab.shown {
            self.toggle_lab();
        }
    }

    /// Opens the flatland lab, or goes back to the scene, which rests meanwhile.
    pub fn toggle_lab(&mut self) {
        self.lab.shown = !self.lab.shown;
        self.playing = false;
        self.timeline.playing = false;
    }

    /// Shows the start screen, or leaves it; the scene rests meanwhile.
    pub fn toggle_start(&mut self) {
        self.start.shown = !self.start.shown;
        self.start.recent = None;
        self.lab.shown = false;
        self.playing = false;
        self.timeline.playing = false;
    }

    /// Hides or shows the panel.
    pub fn toggle_panel(&mut self) {
        let shown = if self.narrow { &mut self.show_over } else { &mut self.show_panel };
        *shown = !*shown;
    }

    /// Shows the search for techniques.
    pub fn find(&mut self) {
        if !self.panel_shows() {
            self.toggle_panel();
        }
        self.searching = true;
    }

    /// Goes back to the preset chosen last, or to the camera of the file, as a step.
    pub fn go_home(&mut self) {
        self.setup.camera = self.home;
        self.camera_chosen = true;
    }

    /// Whether the window may close now; else it asks what is to become of what was measured, or is being measured. Who asks
    /// again means it.
    pub fn may_close(&mut self) -> bool {
        self.closing = !self.closing && (!self.unsaved.is_empty() || self.measuring.is_some());
        !self.closing
    }

    /// Whether a technique is among those searched for.
    pub fn finds(&self, info: &Info) -> bool {
        let wanted = self.search.trim().to_lowercase();
        let text = [info.id, info.title, info.paper, info.family].join(" ").to_lowercase();
        wanted.split_whitespace().all(|word| text.contains(word))
    }

    /// The distance from which the scene is seen first, metres.
    pub fn first_reach(&self) -> f32 {
        self.scene.cameras.first().map_or(self.home, |c| c.camera).reach()
    }

    /// The scene's extent from corner to corner, metres.
    pub fn diagonal(&self) -> f32 {
        (self.bounds[1] - self.bounds[0]).length().max(1e-9)
    }

    /// Length of the chosen animation, seconds.
    pub fn duration(&self) -> f32 {
        self.scene.duration(self.setup.animation)
    }

    /// Undoes a step; the action loads the scene, where that differs.
    pub fn undo(&mut self) -> Option<Action> {
        self.history.commit(&self.setup, true);
        let (before, told) = self.history.undo(&self.scene, &self.setup)?;
        self.say_step(format!("Undid: {told}"));
        self.take(before)
    }

    /// Does an undone step again.
    pub fn redo(&mut self) -> Option<Action> {
        self.history.commit(&self.setup, true);
        let (after, told) = self.history.redo(&self.scene, &self.setup)?;
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
        self.editing = self.editing.min(self.setup.against.len());
        None
    }
}
