//! The chart tab's controls: what is swept, and files.

use super::chart;
use super::controls::chips;
use super::drawer::{beside, export, line, pick_techniques, progress, size};
use super::model::{Action, Job, Model, Sweeping, Tab};
use crate::measure::{self, Axis};
use crate::setup::Setup;
use crate::techniques;
use anyhow::Result;
use egui::{Align, Button, Layout, RichText, TextEdit, Ui, vec2};
use std::path::Path;

/// Which configurations a sweep has.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Range {
    /// Over all main parameters, not over the first alone.
    pub all: bool,
    techniques: Vec<String>,
    /// The technique of each configuration that these have; None: not counted yet.
    each: Option<Vec<String>>,
    /// What a configuration of the last sweep took, seconds, and of what scene and size it was.
    pace: Option<(f64, String, [u32; 2])>,
}

impl Range {
    /// Keeps how fast a sweep was that has ended.
    pub fn learn(&mut self, setup: &Setup, job: &Job) {
        if job.title == SWEEP && job.rows > 0 {
            let seconds = job.since.elapsed().as_secs_f64() / job.rows as f64;
            self.pace = Some((seconds, setup.scene.clone(), setup.size));
        }
    }
}

/// What counting a configuration's errors takes at least, seconds for a million pixels.
const ERRORS_SECONDS: f64 = 3.0;
/// What a sweep is called while it runs.
pub const SWEEP: &str = "Sweep";

pub fn show(ui: &mut Ui, m: &mut Model, out: &mut Vec<Action>) {
    beside(ui, m, out, chart::show, controls);
}

fn controls(ui: &mut Ui, m: &mut Model, out: &mut Vec<Action>) {
    pick_techniques(ui, m);
    ui.label(RichText::new("over").small().weak());
    let all = m.chart.range.all;
    let first = "Each technique over its first main parameter only, such as the resolution.";
    let every = "Each technique over all combinations of its main parameters.";
    let items = [("main parameter", !all, first.to_string()), ("all main parameters", all, every.to_string())];
    if let Some(i) = chips(ui, items.into_iter()) {
        m.chart.range.all = i == 1;
        m.chart.range.each = None;
    }
    ui.add_space(2.0);
    start(ui, m, out);
    ui.add_space(4.0);
    files(ui, m, out);
}

/// The button that starts, or how far what runs is.
fn start(ui: &mut Ui, m: &mut Model, out: &mut Vec<Action>) {
    if let Some(job) = &m.measuring {
        progress(ui, job, out);
        return;
    }
    let chosen = m.techniques();
    if m.chart.range.each.is_none() || m.chart.range.techniques != chosen {
        let all = configurations(&m.setup, &chosen, m.chart.range.all).unwrap_or_default();
        m.chart.range.each = Some(all.into_iter().map(|c| c.technique).collect());
        m.chart.range.techniques = chosen;
    }
    let count = m.chart.range.each.as_ref().map_or(0, Vec::len);
    let text = if count == 1 { "Sweep 1 configuration".into() } else { format!("Sweep {count} configurations") };
    ui.horizontal(|ui| {
        let start = ui.add_enabled(count > 0, Button::new(text));
        let tip = "Measure every configuration's error and time, each a point of the chart. The picture waits meanwhile, so that it does not disturb the times.";
        if start.on_hover_text(tip).on_disabled_hover_text("No technique is chosen that serves the light.").clicked() {
            match configurations(&m.setup, &m.chart.range.techniques, m.chart.range.all) {
                Ok(all) => out.push(Action::Sweep(all)),
                Err(e) => m.fail(&e),
            }
        }
        let clear = ui.add_enabled(!m.rows.is_empty(), Button::new("Clear"));
        if clear.on_hover_text("Remove all points from the chart.").clicked() {
            m.clear_rows();
        }
    });
    let here = |s: &&Sweeping| !s.left.is_empty() && s.base.scene == m.setup.scene;
    if let Some(sweep) = m.sweeping.as_ref().filter(here) {
        let text = format!("Go on: {} of {} left", sweep.left.len(), sweep.of);
        let tip = "Measure what the last sweep has left, each with the set-up that it had then.";
        if ui.button(text).on_hover_text(tip).clicked() {
            out.push(Action::GoOnSweeping);
        }
    }
    size(ui, m);
    line(ui, &estimate(m).unwrap_or_default());
}

/// How long the sweep will take, as far as that is known: by what the last one took of this scene at this size, else by the
/// frames of the picture.
fn estimate(m: &Model) -> Option<String> {
    let each = m.chart.range.each.as_ref().filter(|e| !e.is_empty())?;
    let of = |pace: &&(f64, String, [u32; 2])| (&pace.1, pace.2) == (&m.setup.scene, m.setup.size);
    if let Some((seconds, ..)) = m.chart.range.pace.as_ref().filter(of) {
        return Some(format!("about {}, as fast as the last sweep", lasting(seconds * each.len() as f64)));
    }
    let f = &m.facts;
    if f.seconds.is_empty() || m.draft() || m.setup.sides() > 1 {
        return None;
    }
    // One that was not shown yet is taken for a middling one.
    let mean = f.seconds.values().sum::<f64>() / f.seconds.len() as f64;
    let pixels = |[w, h]: [u32; 2]| w as f64 * h as f64;
    let more = pixels(m.setup.size) / pixels(f.full).max(1.0);
    let errors = ERRORS_SECONDS * pixels(m.setup.size) * 1e-6;
    let frame = |technique: &String| f.seconds.get(technique.as_str()).unwrap_or(&mean) * more;
    let one = |technique: &String| measure::seconds_for(frame(technique), f.software) + errors;
    let all: f64 = each.iter().map(one).sum();
    Some(format!("at least {}, by what frames take here", lasting(all)))
}

/// A time in words, rounded as guesses are.
fn lasting(seconds: f64) -> String {
    match seconds {
        s if s < 5.0 => "a few seconds".into(),
        s if s < 90.0 => format!("{:.0} s", (s / 5.0).round() * 5.0),
        s if s < 5400.0 => format!("{:.0} min", s / 60.0),
        s => format!("{:.1} h", s / 3600.0),
    }
}

/// The set-ups of a sweep over the techniques' main parameters, or over the first of them.
fn configurations(setup: &Setup, chosen: &[String], all: bool) -> Result<Vec<Setup>> {
    let setup = setup.measured();
    if all {
        return measure::expand(&setup, chosen, &[], true);
    }
    let mut out = Vec::new();
    for id in chosen {
        let main = techniques::find_or_say(id)?.main.first();
        let axis = main.map(|(name, values)| Axis::parse(&format!("{id}.{name}={values}"))).transpose()?;
        out.append(&mut measure::expand(&setup, std::slice::from_ref(id), axis.as_slice(), false)?);
    }
    Ok(out)
}

fn files(ui: &mut Ui, m: &mut Model, out: &mut Vec<Action>) {
    let tip = "Export writes the chart or its figures under this name, with the ending chosen. Open reads the figures of a sweep, .csv or .json; such files can also be dropped on the window.";
    ui.label(RichText::new("file").small().weak()).on_hover_text(tip);
    ui.with_layout(Layout::right_to_left(Align::Min), |ui| {
        let path = m.chart.path.trim().to_string();
        let is = |endings: &[&str]| endings.iter().any(|e| path.to_ascii_lowercase().ends_with(e));
        let open = ui.add_enabled(is(&[".csv", ".json"]), Button::new("Open"));
        if open.on_hover_text("Add the rows of this .csv or .json file to the chart.").clicked() {
            out.push(Action::Open(path.clone()));
        }
        let stem = Path::new(&path).with_extension("");
        let stem = stem.to_str().filter(|s| !s.is_empty()).unwrap_or("chart");
        export(ui, Tab::Chart, stem, !m.rows.is_empty(), out);
        let room = vec2(ui.available_width() - 2.0, 21.0);
        ui.add_sized(room, TextEdit::singleline(&mut m.chart.path).hint_text("path")).on_hover_text(tip);
    });
}
