//! The stability tab: a case's path or one's own, and error, flicker and cost along it.

use super::controls::{Tip, chips, suffix};
use super::drawer::{beside, export, pick_techniques, progress, size};
use super::model::{Action, Model, Tab};
use super::needs::{percent, shown_params};
use super::own_path::{self, Recording, camera_moved, light_moved};
use super::pictures;
use super::plotting::{Labels, color, say, short};
use crate::chart::round_step;
use crate::light::Light;
use crate::measure::Figure;
use crate::measure::stability::{Point, Run, Stability, Track};
use crate::params::Values;
use crate::path::{OwnPath, Route};
use crate::scene::builtin::cases::{self, Case};
use crate::scene::{Camera, Scene};
use crate::setup::Setup;
use crate::{techniques, view};
use anyhow::Result;
use egui::{Button, ComboBox, DragValue, FontId, Grid, Label, RichText, Role, Slider, Ui, WidgetInfo, vec2};
use egui_plot::{GridMark, HLine, Line, Plot, PlotPoint, PlotPoints, VLine};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Width from which nine numbers stand beside each other under the chart, points.
const ALL_WRITTEN: f32 = 440.0;
/// Most keys that are marked in the chart.
const MARKED: usize = 64;

/// The timeline's state.
#[derive(Default)]
pub struct Timeline {
    pub case: Option<&'static Case>,
    /// The set-up's own path is followed, not the case's.
    pub own: bool,
    /// Where on the path, 0 to 1.
    pub t: f32,
    pub playing: bool,
    /// Frames of the next run; None: as many as the path has by default.
    pub frames: Option<usize>,
    /// The next run also finds out what frames cost.
    pub cost: bool,
    /// What is charted.
    pub figure: Figure,
    pub found: Option<Stability>,
    /// The path of one's own that it was found on.
    ran: Option<Arc<OwnPath>>,
    pub recording: Option<Recording>,
    /// What new keys take of the present set-up.
    pub without_camera: bool,
    pub with_light: bool,
    /// Where the path has put camera and light last, if it moved them then.
    placed: (Option<Camera>, Option<Light>),
}

impl Timeline {
    /// Another scene has been opened.
    pub fn opened(&mut self, setup: &Setup) {
        self.playing = false;
        self.recording = None;
        self.placed = (None, None);
        if setup.path.is_some() {
            self.choose_own();
            self.t = 0.0;
            if self.ran != setup.path {
                self.found = None;
            }
        } else if let Some(case) = cases::find(&setup.scene) {
            if self.own || self.case.is_none_or(|c| c.id != case.id) {
                self.choose(case);
            }
            self.t = 0.0;
        }
    }

    fn choose(&mut self, case: &'static Case) {
        self.case = Some(case);
        self.own = false;
        self.follow(case.id);
    }

    /// Goes over to the set-up's own path.
    pub fn choose_own(&mut self) {
        if !self.own {
            self.own = true;
            self.follow(Route::OWN);
        }
    }

    fn follow(&mut self, id: &str) {
        self.frames = None;
        self.playing = false;
        self.t = 0.0;
        if self.found.as_ref().is_some_and(|f| f.case != id) {
            self.found = None;
        }
    }
}

/// A set-up of a case's scene begins where the timeline does.
pub fn begin(setup: &mut Setup) {
    if let Some(case) = cases::find(&setup.scene) {
        (case.place)(setup, 0.0);
    }
}

/// The set-up that a built-in scene's small picture shows; a case is seen where its path tells most.
pub fn pictured(scene: &Scene) -> Result<Setup> {
    let mut setup = Setup::new(&scene.name, scene)?;
    if let Some(case) = cases::find(&scene.name) {
        (case.place)(&mut setup, case.telling);
    }
    serve(&mut setup);
    Ok(setup)
}

/// Selects the first technique that serves the light, if there is one and the present one does not.
fn serve(setup: &mut Setup) {
    let light = setup.light;
    let serves = |id: &str| techniques::find(id).is_some_and(|i| i.refuses(&light).is_none());
    if !serves(&setup.technique) {
        let other = techniques::ALL.iter().find(|i| serves(i.id));
        setup.technique = other.map_or(setup.technique.clone(), |i| i.id.into());
    }
    setup.complete();
}

/// Gives back to their defaults the parameters that the path of a set-up's case, if it is one's, moves.
fn let_go(setup: &mut Setup) {
    let Some(case) = cases::find(&setup.scene) else { return };
    let [start, end] = [0.0, 1.0].map(|t| {
        let mut there = setup.clone();
        (case.place)(&mut there, t);
        there.params
    });
    for (id, values) in &mut setup.params {
        let at = |t: &BTreeMap<String, Values>, name: &str| t.get(id).and_then(|v| v.get(name).cloned());
        values.retain(|name, _| at(&start, name) == at(&end, name));
    }
    setup.complete();
}

impl Model {
    /// Takes technique, parameters, view and sizes over into the set-up that another scene starts with, as far as its light
    /// allows.
    pub fn carry(&self, setup: &mut Setup) {
        let mut kept = self.setup.clone();
        let_go(&mut kept);
        let (camera, lamps, work) = (setup.camera, setup.lamps(), setup.at_work());
        let (scene, origin) = (std::mem::take(&mut setup.scene), setup.origin);
        *setup = Setup { scene, origin, time: 0.0, animation: 0, camera, shadow_camera: None, path: None, ..kept };
        setup.set_lamps(lamps, work);
        begin(setup);
        serve(setup);
        if setup.find_view(&setup.view).is_none() {
            setup.view = view::VIEWS[0].id.into();
        }
        let overlay = setup.overlay.take();
        setup.overlay = overlay.filter(|o| setup.find_view(&o.view).is_some());
    }

    /// The path that is followed: the set-up's own, or that of the case whose scene is open.
    pub fn route(&self) -> Option<Route> {
        if self.loading.is_some() {
            return None;
        }
        match self.timeline.own {
            true => self.setup.path.clone().map(Route::Own),
            false => self.timeline.case.filter(|c| c.id == self.setup.scene).map(Route::Case),
        }
    }

    /// Lets the path play on by so many seconds, unless camera or light were taken in hand meanwhile: then it stops.
    pub fn play_on(&mut self, seconds: f32) {
        let Some(route) = self.route().filter(|_| self.timeline.playing) else { return };
        let (camera, light) = self.timeline.placed;
        let (now, diagonal) = (&self.setup, self.diagonal());
        if camera.is_some_and(|c| camera_moved(&c, &now.camera))
            || light.is_some_and(|l| light_moved(&l, &now.light, diagonal))
        {
            self.timeline.playing = false;
            return;
        }
        let t = self.timeline.t + seconds / route.seconds().max(1e-3);
        self.scrub(if t > 1.0 { 0.0 } else { t });
    }

    /// Moves along the path. It is no step that can be undone, like flying.
    pub fn scrub(&mut self, t: f32) {
        let Some(route) = self.route() else { return };
        self.history.commit(&self.setup, true);
        self.timeline.t = t.clamp(0.0, 1.0);
        let (camera, light) = (self.setup.camera, self.setup.light);
        route.place_sides(&mut self.setup, self.timeline.t);
        let now = &self.setup;
        self.timeline.placed =
            ((now.camera != camera).then_some(now.camera), (now.light != light).then_some(now.light));
        self.history.absorb(&self.setup);
    }
}

pub fn show(ui: &mut Ui, m: &mut Model, out: &mut Vec<Action>) {
    beside(ui, m, out, path, controls);
}

fn controls(ui: &mut Ui, m: &mut Model, out: &mut Vec<Action>) {
    let own = m.timeline.own;
    let items = [
        ("built-in case", !own, "A scene with a path on which some techniques fail."),
        ("own path", own, "A path of your own through the scene that is open: recorded, or made key by key."),
    ];
    match chips(ui, items.into_iter().map(|(name, on, tip)| (name, on, tip.to_string()))) {
        Some(1) => m.timeline.choose_own(),
        Some(_) if own => {
            m.timeline.own = false;
            m.timeline.follow(m.timeline.case.map_or("", |c| c.id));
        }
        _ => {}
    }
    if m.timeline.own {
        own_path::show(ui, m);
    } else {
        choose_case(ui, m, out);
    }
    if let Some(route) = m.route() {
        run(ui, m, &route, out);
        found(ui, m, out);
    }
}

/// The list of cases, and what the chosen one is about.
fn choose_case(ui: &mut Ui, m: &mut Model, out: &mut Vec<Action>) {
    let chosen = m.timeline.case;
    let combo = ComboBox::from_id_salt("case").width(ui.available_width() - 4.0).truncate();
    let combo = combo.height(ui.ctx().content_rect().height() - 24.0);
    let shown = combo.selected_text(chosen.map_or("choose a case", |c| c.title)).show_ui(ui, |ui| {
        if let Some(case) = pictures::cases(ui, m, out) {
            m.timeline.choose(case);
            if m.setup.scene != case.id {
                out.push(Action::Open(case.id.into()));
            }
        }
    });
    let tip = chosen.map_or("A scene with a path on which some techniques fail.", |c| c.doc);
    shown.response.on_hover_text(tip).widget_info(|| WidgetInfo::labeled(Role::ComboBox, true, "case"));
    let Some(case) = chosen else {
        ui.label(RichText::new(tip).small().weak());
        return;
    };
    ui.label(RichText::new(format!("{}: {}", case.id, case.doc)).small().weak());
    if m.route().is_none() {
        let open = ui.add_enabled(m.loading.is_none(), Button::new(format!("Open {}", case.title)));
        if open.on_hover_text("Load the case's scene.").clicked() {
            out.push(Action::Open(case.id.into()));
        }
    }
}

/// What a run takes, and its button.
fn run(ui: &mut Ui, m: &mut Model, route: &Route, out: &mut Vec<Action>) {
    ui.add_space(2.0);
    pick_techniques(ui, m);
    ui.add_space(2.0);
    if let Some(job) = &m.measuring {
        progress(ui, job, out);
    } else {
        let techniques = m.techniques();
        ui.horizontal(|ui| {
            let ready = !techniques.is_empty() && route.seconds() > 0.0 && m.timeline.recording.is_none();
            let run = ui.add_enabled(ready, Button::new("Run"));
            let tip = "Count each technique's errors along the path, and what flickers from frame to frame, with the parameters set now. The picture waits meanwhile.";
            let mut frames = m.timeline.frames.unwrap_or(route.frames());
            if run.on_hover_text(tip).clicked() {
                let case = if let Route::Case(case) = route { Some(case.id) } else { None };
                m.timeline.ran = m.setup.path.clone().filter(|_| case.is_none());
                out.push(Action::Stability(case, Run { techniques, frames, cost: m.timeline.cost }));
            }
            let drag = DragValue::new(&mut frames).range(2..=1000).suffix(" frames");
            if ui.add_sized([96.0, 21.0], drag).on_hover_text("Frames along the path.").changed() {
                m.timeline.frames = Some(frames);
            }
            let tip = "Also count what each frame costs: passes, layers and triangles drawn, milliseconds. It takes longer: every \
                       frame is rendered four times more.";
            ui.checkbox(&mut m.timeline.cost, "cost").on_hover_text(tip);
        });
        size(ui, m);
    }
}

/// Each technique's worst place and its flicker.
fn found(ui: &mut Ui, m: &mut Model, out: &mut Vec<Action>) {
    let Some(found) = &m.timeline.found else { return };
    let mut to = None;
    ui.add_space(4.0);
    Grid::new("tracks").num_columns(4).spacing([8.0, 2.0]).show(ui, |ui| {
        for (head, tip) in [
            ("technique", "Its parameters were those set when the run began: point at a name for all of them."),
            ("worst error", "Largest share of wrong pixels along the path. Click to go there."),
            (
                "flicker",
                "How much visibility changes from frame to frame beyond the truth's change: mean along the path.",
            ),
        ] {
            ui.label(RichText::new(head).small().weak()).on_hover_text(tip);
        }
        ui.end_row();
        for track in &found.tracks {
            ui.label(RichText::new(&track.technique).small().color(color(&track.technique)))
                .on_hover_text(shown_params(&track.technique, &track.params).into_iter().map(|p| p.0).collect::<Vec<_>>().join("\n"));
            if let Some(worst) = track.worst() {
                let text = RichText::new(percent(worst.error_share)).monospace().size(11.5);
                let [w, h] = [found.width, found.height];
                let tip = format!(
                    "Go to t = {:.3}. Counted in {w} × {h} pixels; the status bar counts the picture in the window, whose size is another, so that its figure is too.",
                    worst.t
                );
                if ui.add(Button::new(text).small()).on_hover_text(tip).clicked() {
                    to = Some(worst.t);
                }
            }
            let text = track.mean(Point::flicker).map_or("-".into(), percent);
            ui.label(RichText::new(text).monospace().size(11.5));
            ui.end_row();
        }
    });
    if found.has(Figure::Time) {
        costs(ui, found);
    }
    ui.label(RichText::new(changed(found)).small().weak());
    if m.timeline.own && m.timeline.ran != m.setup.path {
        ui.label(RichText::new("The path has changed since this run.").small().color(ui.visuals().warn_fg_color));
    }
    for (id, why) in &found.left_out {
        ui.label(RichText::new(format!("{id}: {why}")).small().weak());
    }
    export(ui, Tab::Stability, &format!("stability-{}", found.case.replace(' ', "-")), !found.tracks.is_empty(), out);
    if let Some(t) = to {
        m.timeline.playing = false;
        m.scrub(t);
    }
}

/// Which parameters the tracks had that differ from their defaults.
fn changed(found: &Stability) -> String {
    let own = |track: &Track| {
        let all = shown_params(&track.technique, &track.params);
        let changed: Vec<String> = all.into_iter().filter(|p| p.1).map(|p| p.0).collect();
        (!changed.is_empty()).then(|| format!("{} {}", track.technique, changed.join(", ")))
    };
    let told: Vec<String> = found.tracks.iter().filter_map(own).collect();
    match told.len() {
        0 => "All with default parameters.".into(),
        n if n == found.tracks.len() => format!("With {}.", told.join("; ")),
        _ => format!("With {}; the others with default parameters.", told.join("; ")),
    }
}

/// The timeline and, under it, the chart.
fn path(ui: &mut Ui, m: &mut Model, _: &mut Vec<Action>) {
    let route = m.route();
    transport(ui, m, route.as_ref());
    let figure = m.timeline.figure;
    let value = |p: &Point| figure.of(p);
    let at = route.as_ref().map(|_| m.timeline.t as f64);
    let found = m.timeline.found.as_ref();
    let most = found.iter().flat_map(|f| &f.tracks).flat_map(|t| &t.points).filter_map(value).fold(0.0, f64::max);
    let (weak, accent) = (ui.visuals().weak_text_color(), ui.visuals().hyperlink_color);
    // Where there is room every line of the grid has its number.
    let all_written = ui.available_width() > ALL_WRITTEN;
    let plot = Plot::new(("stability", figure.name()))
        .show_x(false)
        .show_y(false)
        .include_x(0.0)
        .include_x(1.0)
        .include_y(0.0)
        .include_y(if most > 0.0 { most } else { 1.0 })
        .set_margin_fraction(vec2(0.045, 0.08))
        .y_axis_min_width(44.0)
        .grid_color(ui.visuals().window_stroke.color)
        .allow_drag(false)
        .allow_zoom(false)
        .allow_scroll(false)
        .allow_boxed_zoom(false)
        .x_grid_spacer(move |_| {
            let step = |i: i32| if i % 2 == 0 || all_written { 0.25 } else { 0.125 };
            (0..=8).map(|i| GridMark { value: i as f64 / 8.0, step_size: step(i) }).collect()
        })
        .y_grid_spacer(|g| {
            let step_size = round_step(0.0, g.bounds.1, 5);
            (0..=(g.bounds.1 / step_size) as u32).map(|i| GridMark { value: i as f64 * step_size, step_size }).collect()
        })
        .y_axis_formatter(
            move |mark, _| if mark.value < -1e-9 { String::new() } else { short(mark.value) + &suffix(figure.unit()) },
        )
        .x_axis_formatter({
            let route = route.clone();
            move |mark, _| match &route {
                Some(route) if (0.0..=1.0).contains(&mark.value) => {
                    short(route.value(mark.value as f32) as f64) + &suffix(named(route).1)
                }
                _ => String::new(),
            }
        })
        .x_axis_label(route.as_ref().map_or("", |r| named(r).0));
    let shown = plot.show(ui, |plot| {
        plot.hline(HLine::new("", 0.0).color(weak.gamma_multiply(0.5)).width(1.0).allow_hover(false));
        if let Some(Route::Own(path)) = route.as_ref().filter(|_| at.is_some()) {
            for key in path.keys.iter().filter(|_| path.keys.len() <= MARKED) {
                let line = VLine::new("", path.share(key.time) as f64);
                plot.vline(line.color(weak.gamma_multiply(0.35)).width(1.0).allow_hover(false));
            }
        }
        for track in found.iter().flat_map(|f| &f.tracks) {
            let points = track.points.iter().filter_map(|p| Some([p.t as f64, value(p)?]));
            let points: PlotPoints = points.collect();
            plot.line(Line::new("", points).color(color(&track.technique)).width(1.6).allow_hover(false));
        }
        if let Some(t) = at {
            plot.vline(VLine::new("", t).color(accent).width(1.2).allow_hover(false));
        }
    });
    let frame = *shown.transform.frame();
    let mut labels = Labels::new(frame);
    for track in found.iter().flat_map(|f| &f.tracks) {
        let points = track.points.iter().filter_map(|p| Some(PlotPoint::new(p.t, value(p)?)));
        let points: Vec<_> = points.map(|p| shown.transform.position_from_point(&p)).collect();
        labels.keep_off(points.windows(2).map(|p| [p[0], p[1]]));
    }
    for track in found.iter().flat_map(|f| &f.tracks) {
        let top = track.points.iter().filter_map(|p| Some((p.t, value(p)?)));
        if let Some((t, v)) = top.max_by(|a, b| a.1.total_cmp(&b.1)) {
            let place = shown.transform.position_from_point(&PlotPoint::new(t, v));
            labels.write(ui, &[place], &track.technique, color(&track.technique), true);
        }
    }
    if found.is_none_or(|f| !f.has(figure)) {
        let text = match (&route, found) {
            (Some(_), Some(f)) if !f.tracks.is_empty() && figure.is_cost() => {
                "Tick cost and run again: what frames cost appears here."
            }
            (Some(_), _) => "Run: error and flicker along the path appear here.",
            (None, _) if m.timeline.own => "Record a path, or add keys: it can be played, and techniques run along it.",
            (None, _) => "Choose a case: its scene opens, and its path can be played.",
        };
        say(ui, frame, (egui::Align2::CENTER_CENTER, frame.center()), text.into(), FontId::proportional(13.0), weak);
    }
    let r = shown.response.interact(egui::Sense::click_and_drag());
    if route.is_some()
        && (r.clicked() || r.dragged())
        && let Some(pointer) = r.interact_pointer_pos()
    {
        m.timeline.playing = false;
        m.scrub(shown.transform.value_from_position(pointer).x as f32);
    }
}

/// Play, the slider, what runs along the path, and which figure is charted.
fn transport(ui: &mut Ui, m: &mut Model, route: Option<&Route>) {
    ui.horizontal(|ui| {
        let text = if m.timeline.playing { "Pause" } else { "Play" };
        let ready = route.is_some_and(|r| r.seconds() > 0.0) && m.measuring.is_none() && m.timeline.recording.is_none();
        let play = ui.add_enabled(ready, Button::new(text).min_size(vec2(54.0, 21.0)));
        let tip = "Run along the path, again and again. Whoever moves the camera or the light meanwhile takes over: it stops.";
        if play.on_hover_text(tip).clicked() {
            m.timeline.playing = !m.timeline.playing;
            if m.timeline.playing {
                m.scrub(m.timeline.t);
            }
        }
        choose_figure(ui, m);
        let Some(route) = route else { return };
        let (name, unit) = named(route);
        let mut t = m.timeline.t;
        ui.spacing_mut().slider_width = (ui.available_width() - 80.0).clamp(60.0, 400.0);
        let slider = ui.add(Slider::new(&mut t, 0.0..=1.0).show_value(false));
        slider.widget_info(|| WidgetInfo::slider(true, t as f64, "t"));
        if slider.on_hover_text("Where on the path. Drag to scrub; in the chart, click or drag.").changed() {
            m.timeline.playing = false;
            m.scrub(t);
        }
        let value = short(route.value(m.timeline.t) as f64);
        let text = RichText::new(format!("{value}{}", suffix(unit))).small();
        ui.add(Label::new(text).truncate()).on_hover_text(format!("{name}: where on the path the picture is."));
    });
}

/// The figure that is charted.
fn choose_figure(ui: &mut Ui, m: &mut Model) {
    let now = m.timeline.figure;
    let combo = ComboBox::from_id_salt("figure").width(84.0).selected_text(now.name());
    let shown = combo.show_ui(ui, |ui| {
        for figure in Figure::ALL {
            // What it costs is known only where it was asked for.
            let known = m.timeline.found.as_ref().is_none_or(|f| f.has(figure)) || !figure.is_cost();
            let text = RichText::new(figure.name());
            let text = if known { text } else { text.weak() };
            if ui.selectable_label(figure == now, text).tip_beside(ui.max_rect(), figure.doc()).clicked() {
                m.timeline.figure = figure;
            }
        }
    });
    shown.response.on_hover_text(now.doc()).widget_info(|| WidgetInfo::labeled(Role::ComboBox, true, "figure"));
}

/// Each technique's costs along the path: means, and the layers drawn of how many.
fn costs(ui: &mut Ui, found: &Stability) {
    ui.add_space(2.0);
    Grid::new("costs").num_columns(4).spacing([8.0, 2.0]).show(ui, |ui| {
        for (head, tip) in [
            ("mean", "Means along the path; the chart has each frame's."),
            ("layers", "Layers with a triangle drawn, of how many."),
            ("triangles", Figure::Triangles.doc()),
            ("ms", Figure::Time.doc()),
        ] {
            ui.label(RichText::new(head).small().weak()).on_hover_text(tip);
        }
        ui.end_row();
        for track in &found.tracks {
            let mean = |figure: Figure| {
                let all: Vec<f64> = track.points.iter().filter_map(|p| figure.of(p)).collect();
                (!all.is_empty()).then(|| all.iter().sum::<f64>() / all.len() as f64)
            };
            let of = track.points.iter().filter_map(|p| p.cost?.layers).map(|l| l.layers).max();
            let layers = mean(Figure::Layers).zip(of).map(|(drawn, of)| format!("{drawn:.1} of {of}"));
            let figures = [layers, mean(Figure::Triangles).map(|n| format!("{n:.0}")), mean(Figure::Time).map(short)];
            ui.label(RichText::new(&track.technique).small().color(color(&track.technique)));
            for text in figures {
                ui.label(RichText::new(text.unwrap_or("-".into())).monospace().size(11.5));
            }
            ui.end_row();
        }
    });
    if found.software {
        let text = "On a software adapter: compare its times as ratios only.";
        ui.label(RichText::new(text).small().weak());
    }
}

/// What runs along a path, and its unit.
fn named(route: &Route) -> (&'static str, &'static str) {
    route.axis().rsplit_once(", ").unwrap_or((route.axis(), ""))
}
