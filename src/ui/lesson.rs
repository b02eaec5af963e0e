//! The card of a lesson beside the picture: what is to be seen, something to try, something to guess.

use super::controls::{self, Tip};
use super::drawer;
use super::model::{Action, Model, Tab};
use super::words::{Words, prose};
use crate::lessons::claim::{Whose, shown};
use crate::lessons::{self, Answer, Lesson, Question, Step};
use crate::scene::Scene;
use crate::setup::Setup;
use egui::{Align, Button, DragValue, Frame, Grid, Layout, Margin, Panel, RichText, ScrollArea, Ui, vec2};
use glam::Vec3;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Width of the card, points.
const WIDTH: f32 = 306.0;
/// A window that is narrower than this has the card as a strip under the picture, so high at most.
const NARROW: f32 = 940.0;
const STRIP: f32 = 230.0;

/// A lesson that is being taken.
pub struct Running {
    pub lesson: &'static Lesson,
    pub step: usize,
    /// The step's set-up as it came; None: on its way.
    pub came: Option<Setup>,
    guess: f64,
    chosen: Option<usize>,
    /// The answer is being measured.
    pub asked: bool,
    pub answer: Option<Answer>,
    /// What was guessed and measured at other steps.
    kept: BTreeMap<usize, Taken>,
}

/// What was guessed or chosen at a step, and what was measured.
#[derive(Default)]
struct Taken {
    guess: f64,
    chosen: Option<usize>,
    answer: Option<Answer>,
}

impl Running {
    fn step(&self) -> &'static Step {
        &self.lesson.steps[self.step.min(self.lesson.steps.len() - 1)]
    }
}

impl Model {
    /// Goes to a step of a lesson; the action loads its scene, where that is another.
    pub fn begin(&mut self, lesson: &'static Lesson, step: usize) -> Option<Action> {
        self.start.shown = false;
        self.lab.shown = false;
        let mut kept = BTreeMap::new();
        if let Some(before) = self.lesson.take().filter(|before| std::ptr::eq(before.lesson, lesson)) {
            kept = before.kept;
            kept.insert(before.step, Taken { guess: before.guess, chosen: before.chosen, answer: before.answer });
        }
        let Taken { guess, chosen, answer } = kept.remove(&step).unwrap_or_default();
        let running = Running { lesson, step, came: None, guess, chosen, asked: false, answer, kept };
        let plan = &running.step().scene;
        self.drawer = running.step().drawer.as_deref().and_then(tab);
        self.lesson = Some(running);
        self.return_to(plan)
    }

    /// Goes back to the step's set-up.
    fn return_to(&mut self, plan: &lessons::Plan) -> Option<Action> {
        let running = self.lesson.as_mut()?;
        running.came = None;
        if plan.scene() != self.setup.scene {
            return Some(Action::Step);
        }
        match plan.in_scene(&self.scene) {
            Ok(setup) => self.arrive(setup, self.scene.clone(), self.bounds),
            Err(e) => self.fail(&e),
        }
        None
    }

    /// Whether this is what a lesson waits for.
    pub fn awaits(&self, setup: &Setup) -> bool {
        self.lesson.as_ref().is_some_and(|r| r.came.is_none() && r.step().scene.scene() == setup.scene)
    }

    /// Shows a step's set-up, at the size that pictures have here.
    pub fn arrive(&mut self, mut setup: Setup, scene: Arc<Scene>, bounds: [Vec3; 2]) {
        setup.size = self.setup.size;
        setup.count_from(scene.origin);
        self.editing = 0;
        self.open(setup, scene, bounds, false);
        let Some(running) = &mut self.lesson else { return };
        running.came = Some(self.setup.clone());
        if let Some(at) = running.step().scene.at() {
            self.timeline.t = at;
        }
        self.sought = SOUGHT;
    }

    /// What the reader has made of the step's set-up, at the step's size, where that is another.
    pub fn own_of_step(&self) -> Option<Setup> {
        let running = self.lesson.as_ref()?;
        let came = running.came.as_ref()?;
        let alike =
            |s: &Setup| (s.measured().params.get(&s.technique).cloned(), s.technique.clone(), s.camera, s.light);
        if self.setup.scene != came.scene || alike(&self.setup) == alike(came) {
            return None;
        }
        let step = running.step();
        let planned = |plan: Option<&lessons::Plan>| plan.and_then(|p| p.in_scene(&self.scene).ok());
        let here = planned(Some(&step.scene))?;
        let own = Setup { size: here.size, truth_samples: here.truth_samples, ..self.setup.clone() };
        // After the try it is measured anyway.
        let tried = planned(step.trial.as_ref().and_then(|t| t.scene.as_ref()));
        tried.is_none_or(|tried| alike(&tried) != alike(&own)).then_some(own)
    }
}

/// Passes in which the marked control is scrolled to: what it is folded away in opens first.
const SOUGHT: u8 = 12;

fn tab(name: &str) -> Option<Tab> {
    match name.to_lowercase().as_str() {
        "chart" => Some(Tab::Chart),
        "stability" => Some(Tab::Stability),
        "advice" => Some(Tab::Advice),
        _ => None,
    }
}

/// Draws the card, if a lesson is being taken, and marks the control that there is something to try with.
pub fn show(ui: &mut Ui, m: &mut Model, out: &mut Vec<Action>) {
    let Some(running) = &m.lesson else {
        controls::set_mark(ui.ctx(), None, false);
        return;
    };
    let control = running.step().trial.as_ref().map(|t| t.control.as_str());
    let title = |id: &str| m.setup.find_view(id).map(|v| format!("chip:{}", v.title));
    let marked = control.and_then(|c| match c.strip_prefix("view:") {
        Some(id) => title(id),
        None => Some(c.to_string()),
    });
    controls::set_mark(ui.ctx(), marked.as_deref(), m.sought > 0);
    if m.sought > 0 {
        m.sought -= 1;
        ui.ctx().request_repaint();
    }
    let fill = ui.visuals().panel_fill;
    let frame = Frame::new().fill(fill).inner_margin(Margin { left: 12, right: 8, top: 8, bottom: 8 });
    if ui.available_width() < NARROW {
        let high = STRIP.min(0.45 * ui.available_height());
        Panel::bottom("lesson below").exact_size(high).frame(frame).show(ui, |ui| card(ui, m, out));
    } else {
        Panel::left("lesson").resizable(false).exact_size(WIDTH).frame(frame).show(ui, |ui| card(ui, m, out));
    }
}

fn card(ui: &mut Ui, m: &mut Model, out: &mut Vec<Action>) {
    let Some(running) = &m.lesson else { return };
    let (lesson, at, step) = (running.lesson, running.step, running.step());
    let last = lesson.steps.len() - 1;
    let (mut go, mut leave) = (None, false);
    ui.horizontal(|ui| {
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            leave = ui
                .button("Leave")
                .on_hover_text("Close the lesson; the picture stays as it is. F8: all lessons.")
                .clicked();
            ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
                ui.add(egui::Label::new(RichText::new(&lesson.title).size(18.0).strong()).truncate());
            });
        });
    });
    ui.label(RichText::new(format!("Step {} of {}", at + 1, lesson.steps.len())).small().weak());
    ui.separator();
    // What leads on keeps its place at the bottom.
    ui.with_layout(Layout::bottom_up(Align::Min), |ui| {
        ui.horizontal(|ui| {
            let size = vec2(64.0, 24.0);
            if ui.add_enabled(at > 0, Button::new("Back").min_size(size)).on_hover_text("The step before.").clicked() {
                go = Some(at - 1);
            }
            let next = Button::new(RichText::new("Next").strong()).min_size(size);
            if ui.add_enabled(at < last, next).on_hover_text("The next step.").clicked() {
                go = Some(at + 1);
            }
            let changed = m.loading.is_none() && m.lesson.as_ref().is_some_and(|r| r.came.as_ref() != Some(&m.setup));
            let back = ui.add_enabled(changed, Button::new("Step's set-up").min_size(size));
            if back.on_hover_text("Back to the set-up that this step began with.").clicked() {
                out.extend(m.return_to(&step.scene));
            }
        });
        ui.separator();
        ui.with_layout(Layout::top_down(Align::Min), |ui| {
            ScrollArea::vertical()
                .id_salt(("step", at))
                .auto_shrink([false, false])
                .show(ui, |ui| body(ui, m, step, out));
        });
    });
    if (go.is_some() || leave) && m.measuring.as_ref().is_some_and(|job| job.title == ANSWER) {
        out.push(Action::CancelMeasuring);
    }
    if let Some(step) = go {
        out.extend(m.begin(lesson, step));
    }
    if leave {
        m.lesson = None;
    }
}

fn body(ui: &mut Ui, m: &mut Model, step: &'static Step, out: &mut Vec<Action>) {
    let mut term = None;
    ui.label(RichText::new(&step.title).size(15.5).strong());
    ui.add_space(3.0);
    term = prose(ui, &step.text).or(term);
    if let Some(trial) = &step.trial {
        ui.add_space(8.0);
        group(ui, "Try", |ui| {
            term = prose(ui, &trial.text).or(term);
            if trial.control != "picture"
                && ui.button("Show where").on_hover_text("Scroll to the framed control.").clicked()
            {
                if !m.panel_shows() {
                    m.toggle_panel();
                }
                m.sought = SOUGHT;
            }
        });
    }
    if let Some(question) = &step.question {
        ui.add_space(8.0);
        group(ui, "Guess, then measure", |ui| {
            term = prose(ui, &question.ask).or(term);
            ask(ui, m, question, out);
        });
    }
    ui.add_space(6.0);
    if let Some(term) = term {
        m.words = Some(Words::at(term));
    }
}

fn group(ui: &mut Ui, title: &str, add: impl FnOnce(&mut Ui)) {
    let frame = Frame::new().fill(ui.visuals().faint_bg_color).corner_radius(5).inner_margin(Margin::same(8));
    frame.show(ui, |ui| {
        ui.set_width(ui.available_width());
        ui.label(RichText::new(title).small().strong().color(ui.visuals().warn_fg_color));
        add(ui);
    });
}

fn ask(ui: &mut Ui, m: &mut Model, question: &'static Question, out: &mut Vec<Action>) {
    let measuring = m.measuring.is_some();
    let unit = question.measure.column.unit();
    let Some(running) = &mut m.lesson else { return };
    let right = running.answer.as_ref().map(|a| a.right);
    for (i, choice) in question.choices.iter().enumerate() {
        ui.horizontal_top(|ui| {
            let chosen = running.chosen == Some(i);
            let mark = match right {
                Some(right) if right == Some(i) => "right: ",
                Some(_) if chosen => "not so: ",
                _ => "",
            };
            let radio = ui.add_enabled(right.is_none(), egui::RadioButton::new(chosen, ""));
            radio.widget_info(|| {
                egui::WidgetInfo::selected(egui::Role::RadioButton, right.is_none(), chosen, &choice.text)
            });
            let text = RichText::new(format!("{mark}{}", choice.text));
            let text = if right == Some(Some(i)) { text.strong() } else { text };
            let label = ui.add(egui::Label::new(text).wrap().sense(egui::Sense::click()));
            if (radio.clicked() || label.clicked()) && right.is_none() {
                running.chosen = Some(i);
            }
        });
    }
    ui.add_space(2.0);
    let done = running.answer.is_some();
    ui.horizontal(|ui| {
        if question.choices.is_empty() {
            ui.label("I guess");
            let suffix = if unit.is_empty() { String::new() } else { format!(" {unit}") };
            let drag = DragValue::new(&mut running.guess).range(0.0..=1e9).speed(0.1).max_decimals(3).suffix(suffix);
            let field = ui.add_enabled_ui(!done, |ui| ui.add_sized([84.0, 21.0], drag)).inner;
            field.widget_info(|| egui::WidgetInfo::labeled(egui::Role::SpinButton, !done, "your guess"));
        }
        let ready = !measuring && running.came.is_some();
        let text = if done { "Measure again" } else { "Measure" };
        if ui.add_enabled(ready, Button::new(text)).tip("Measure the answer now, beside the window.").clicked() {
            running.asked = true;
            out.push(Action::Answer);
        }
    });
    if let Some(job) = m.measuring.as_ref().filter(|job| job.title == ANSWER) {
        drawer::progress(ui, job, out);
    }
    if let Some(answer) = running.answer.clone() {
        answered(ui, question, &answer, running.guess);
    }
}

/// What the work is called that measures an answer.
pub const ANSWER: &str = "Measuring the answer";

/// What was guessed and what was measured.
fn answered(ui: &mut Ui, question: &Question, answer: &Answer, guess: f64) {
    ui.add_space(4.0);
    let column = question.measure.column;
    Grid::new("answer").num_columns(2).spacing([14.0, 3.0]).show(ui, |ui| {
        let mut line = |name: &str, value: String, strong: bool| {
            let text = |t: String| if strong { RichText::new(t).strong() } else { RichText::new(t) };
            ui.label(text(name.into()));
            ui.label(text(value));
            ui.end_row();
        };
        if question.choices.is_empty() {
            line("you guessed", format!("{guess} {}", column.unit()).trim().into(), false);
        }
        for (whose, record) in &answer.measured.records {
            let name = if *whose == Whose::Here { "as the step begins" } else { whose.told() };
            line(name, shown(column, record), *whose == question.measure.whose);
        }
        if let Some(own) = &answer.own {
            line("as you have it", shown(column, own), false);
        }
    });
    if let Some((_, record)) = answer.measured.records.first() {
        let [w, h] = [record.width, record.height];
        let told = format!("{}. Measured at {w} × {h} pixels by {}.", column.doc, record.adapter);
        ui.label(RichText::new(told).small().weak());
    }
}
