//! The flatland lab: a world of two dimensions whose light's film line can be turned by hand, and what each angle costs.

mod figures;
mod found;
mod ground;
mod handles;
mod plots;
mod side;

pub use figures::{FIGURES, random};
pub use found::Found;

use super::controls::set_panel_left;
use super::model::{Action, Model};
use crate::flatland::{Film, Flatland, Metric, table};
use crate::palette::{LABELS, Rgb, bytes};
use anyhow::Result;
use egui::{Color32, Frame, Margin, Panel, Rect, Ui};
use glam::DVec2;
use std::path::{Path, PathBuf};

/// Which film the light has.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Choice {
    Hand,
    /// The best by a metric.
    Least(Metric),
    Common,
    /// The near line of a perspective shadow map, and the line that its texels lie on.
    NearLine,
    Texels,
    /// Best for the plane of a segment.
    Plane(usize),
}

/// What is coloured along the segments.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Spans {
    Off,
    Pixels,
    Lexels,
}

/// The chart on the right.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Charted {
    Footprints,
    /// What few samples add to the error.
    Added,
}

/// What the world began as.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Origin {
    Own,
    Figure(usize),
    /// Chance, by its number.
    Chance(u64),
}

/// How the world is shown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Show {
    pub pixel_rays: bool,
    pub lexel_rays: bool,
    pub spans: Spans,
    /// The films that were not chosen are drawn too.
    pub all_films: bool,
    /// In the camera's post-perspective space.
    pub post: bool,
    /// The chart of errors runs over s, not over the angle.
    pub stretched: bool,
    pub chart: Charted,
}

/// All that can be undone.
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    pub world: Flatland,
    pub film: Choice,
    /// Direction of the film's normal where it is turned by hand, radians.
    pub normal: f64,
    /// Where the perspective map's near line stands, 0 to 1.
    pub push: f64,
    /// Samples that the best film is chosen from; None: all pixels.
    pub few: Option<usize>,
    pub frusta: usize,
    /// Equal parts that are merged into these.
    pub first: usize,
    pub show: Show,
    pub origin: Origin,
}

/// Steps kept.
const LIMIT: usize = 200;

/// The lab.
pub struct Lab {
    pub shown: bool,
    pub now: State,
    pub found: Found,
    /// The state as the last step left it.
    last: State,
    past: Vec<State>,
    future: Vec<State>,
    /// The world's and the post-perspective space's place on the screen; None: to be fitted.
    views: [Option<ground::View>; 2],
    pub selected: Option<usize>,
    /// A drag on the ground draws a segment.
    pub drawing: bool,
    drag: Option<ground::Drag>,
    /// Part of the valid films that the chart of errors shows, in its own units.
    zoom: Option<[f64; 2]>,
    pub path: String,
    /// Number of the last world by chance.
    chance: u64,
}

impl Default for Lab {
    fn default() -> Lab {
        let now = FIGURES[0].state();
        Lab {
            shown: false,
            last: now.clone(),
            now,
            found: Found::default(),
            past: Vec::new(),
            future: Vec::new(),
            views: [None; 2],
            selected: None,
            drawing: false,
            drag: None,
            zoom: None,
            path: "world.toml".into(),
            chance: 0,
        }
    }
}

impl Lab {
    /// Shows a world from a file, with the film that is chosen where the lab is open already.
    pub fn open(&mut self, path: &Path, world: Flatland) {
        self.commit();
        let film = if let Choice::Plane(_) = self.now.film { Choice::Least(Metric::L1) } else { self.now.film };
        let state =
            if self.shown { State { world, film, origin: Origin::Own, ..self.now.clone() } } else { State::of(world) };
        self.take(state);
        self.path = path.display().to_string();
    }

    /// Goes on with another state, as a step.
    pub fn take(&mut self, state: State) {
        self.commit();
        self.now = state;
        self.renew();
        self.commit();
    }

    /// What belonged to another world goes.
    fn renew(&mut self) {
        self.views = [None; 2];
        self.zoom = None;
        self.drag = None;
        self.selected = None;
    }

    /// Makes a step of what has changed.
    fn commit(&mut self) {
        if self.now != self.last {
            self.past.push(std::mem::replace(&mut self.last, self.now.clone()));
            self.past.drain(..self.past.len().saturating_sub(LIMIT));
            self.future.clear();
        }
    }

    pub fn can_undo(&self) -> bool {
        !self.past.is_empty() || self.now != self.last
    }

    pub fn can_redo(&self) -> bool {
        !self.future.is_empty()
    }

    pub fn undo(&mut self) {
        self.commit();
        if let Some(before) = self.past.pop() {
            self.future.push(std::mem::replace(&mut self.last, before));
            self.step();
        }
    }

    pub fn redo(&mut self) {
        self.commit();
        if let Some(after) = self.future.pop() {
            self.past.push(std::mem::replace(&mut self.last, after));
            self.step();
        }
    }

    /// After a step back or forth.
    fn step(&mut self) {
        let (before, after) = (&self.now, &self.last);
        let other = before.origin != after.origin || before.show.post != after.show.post;
        self.now = self.last.clone();
        if other {
            self.renew();
        }
        self.selected = self.selected.filter(|i| *i < self.now.world.segments.len());
    }

    /// Shows all of the world.
    pub fn fit(&mut self) {
        self.views = [None; 2];
    }

    /// Takes the selected segment away.
    pub fn delete(&mut self) {
        let Some(i) = self.selected.take().filter(|i| *i < self.now.world.segments.len()) else { return };
        self.now.world.segments.remove(i);
        self.now.film = match self.now.film {
            Choice::Plane(k) if k == i => Choice::Least(Metric::L1),
            Choice::Plane(k) if k > i => Choice::Plane(k - 1),
            film => film,
        };
    }

    /// Escape: lays the tool down, then the choice; then it leaves.
    pub fn back(&mut self) {
        if self.drawing {
            self.drawing = false;
            self.drag = None;
        } else if self.selected.take().is_none() {
            self.shown = false;
        }
    }

    /// # Errors
    /// A file that cannot be written.
    pub fn save(&self, path: &Path) -> Result<()> {
        crate::files::save(path, self.now.world.to_toml()?.as_bytes())
    }

    /// Turns the film by hand.
    fn turn(&mut self, film: &Film, normal: f64) {
        let degrees = (normal.to_degrees() * 1e3).round() / 1e3;
        self.now.film = Choice::Hand;
        self.now.normal = found::within(film, degrees.to_radians());
    }

    /// Where a point of the world is drawn, once it is.
    pub fn screen(&self, p: DVec2) -> Option<egui::Pos2> {
        let post = if self.now.show.post { Some(self.found.post?) } else { None };
        self.views[post.is_some() as usize]?.placed(post).at(p)
    }
}

/// Width of the column on the right, points; of the least room that is left for the world.
const SIDE: f32 = 368.0;
const WORLD: f32 = 180.0;

/// Draws the lab; the rectangle of the world.
pub fn show(ui: &mut Ui, m: &mut Model, out: &mut Vec<Action>) -> Rect {
    m.lab.found.update(&m.lab.now);
    let fill = ui.visuals().panel_fill;
    let room = ui.available_rect_before_wrap();
    let frame = Frame::new().fill(fill).inner_margin(Margin { left: 10, right: 4, top: 6, bottom: 0 });
    let width = SIDE.min((room.width() - WORLD).max(room.width() * 0.5));
    Panel::right("flatland").resizable(false).exact_size(width).frame(frame).show(ui, |ui| {
        set_panel_left(ui.ctx(), Some(ui.max_rect().left()));
        side::show(ui, m, out);
    });
    m.lab.found.update(&m.lab.now);
    if room.height() > 420.0 {
        let frame = Frame::new().fill(fill).inner_margin(Margin { left: 8, right: 8, top: 4, bottom: 4 });
        let charts = Panel::bottom("flatland charts").resizable(true).default_size((room.height() * 0.3).max(200.0));
        charts.size_range(140.0..=room.height() - WORLD).frame(frame).show(ui, |ui| {
            let rest = ui.available_rect_before_wrap();
            plots::show(ui, rest, &mut m.lab);
            ui.allocate_rect(rest, egui::Sense::hover());
        });
        m.lab.found.update(&m.lab.now);
    }
    let rect = ui.available_rect_before_wrap();
    ground::show(ui, rect, &mut m.lab);
    let ctx = ui.ctx();
    if !ctx.input(|i| i.pointer.any_down() || !i.keys_down.is_empty()) && !ctx.text_edit_focused() {
        m.lab.commit();
    }
    if m.lab.found.stale(&m.lab.now) {
        ctx.request_repaint();
    }
    rect
}

/// Writes the world.
pub fn save(m: &Model, out: &mut Vec<Action>) {
    let path = m.lab.path.trim();
    if !path.is_empty() {
        out.push(Action::SaveWorld(PathBuf::from(path)));
    }
}

/// The colour of a film.
fn tint(ui: &Ui, choice: Choice) -> Color32 {
    color(
        ui,
        match choice {
            Choice::Hand => return ui.visuals().strong_text_color(),
            Choice::Least(Metric::L1) => LABELS[2],
            Choice::Least(Metric::L2) => LABELS[3],
            Choice::Least(Metric::Max) => LABELS[1],
            Choice::Common => LABELS[5],
            Choice::NearLine => LABELS[0],
            Choice::Texels => LABELS[6],
            Choice::Plane(_) => LABELS[7],
        },
    )
}

/// A colour that is told from the theme's ground.
fn color(ui: &Ui, color: Rgb) -> Color32 {
    let [r, g, b] = bytes(color);
    let color = Color32::from_rgb(r, g, b);
    if ui.visuals().dark_mode {
        color.lerp_to_gamma(Color32::WHITE, 0.15)
    } else {
        color.lerp_to_gamma(Color32::BLACK, 0.25)
    }
}

/// What a choice is called in a chart.
fn short_name(choice: Choice) -> String {
    match choice {
        Choice::Hand => "by hand".into(),
        Choice::Least(metric) => metric.name().into(),
        Choice::Common => "common".into(),
        Choice::NearLine => "near line".into(),
        Choice::Texels => "PSM texels".into(),
        Choice::Plane(i) => format!("segment {}", i + 1),
    }
}

/// What it is called in the list, and what it means.
fn told(choice: Choice) -> (String, &'static str) {
    match choice {
        Choice::Hand => (
            "by hand".into(),
            "The angle as you turn it: drag the round handle on the film line, or the line in the chart below.",
        ),
        Choice::Least(Metric::L1) => {
            (table::METHODS[0].into(), "The film with the least mean of pixels a lexel. There is a closed form.")
        }
        Choice::Least(Metric::L2) => (
            table::METHODS[1].into(),
            "The film with the least mean of squares, which punishes bad pixels more. By Newton's method.",
        ),
        Choice::Least(Metric::Max) => (table::METHODS[2].into(), "The film whose worst pixel is best."),
        Choice::Common => (
            table::METHODS[3].into(),
            "The common shadow map: the light looks along the middle of what the camera sees.",
        ),
        Choice::NearLine => (
            table::METHODS[4].into(),
            "The near line of a perspective shadow map, taken back to the world. Push moves it.",
        ),
        Choice::Texels => (
            table::METHODS[5].into(),
            "The line on which the texels of a perspective shadow map lie evenly. Push does not move it.",
        ),
        Choice::Plane(i) => (
            format!("plane of segment {}", i + 1),
            "The film on which all pixels of this segment's plane have equal lexels (theorem 1).",
        ),
    }
}
