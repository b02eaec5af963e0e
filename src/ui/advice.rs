//! The advice tab: how exact a scene must be, and the cheapest configuration that is.

use super::drawer::{beside, line, pick_techniques, progress};
use super::model::{Action, Model, Tab};
use super::needs::{main_values, percent, title};
use super::plotting::{color, short};
use super::style::{SUN, WEAK};
use crate::measure::Record;
use crate::measure::advise::{Advice, Budget};
use egui::{Button, Checkbox, Grid, Label, RichText, ScrollArea, Slider, Ui};

/// The advice tab's state.
pub struct Advising {
    /// Greatest error asked for, per cent.
    pub max_error: f64,
    /// Greatest ratio to `shadow-map`, where there is to be one.
    pub limited: bool,
    pub max_ratio: f64,
    /// What was found, and for which budget.
    pub found: Option<(Budget, Advice)>,
}

impl Default for Advising {
    fn default() -> Advising {
        Advising { max_error: 0.5, limited: false, max_ratio: 2.0, found: None }
    }
}

impl Advising {
    /// What the sliders ask for.
    fn budget(&self) -> Budget {
        Budget { max_error: self.max_error / 100.0, max_ratio: self.limited.then_some(self.max_ratio) }
    }
}

pub fn show(ui: &mut Ui, m: &mut Model, out: &mut Vec<Action>) {
    beside(ui, m, out, found, controls);
}

fn controls(ui: &mut Ui, m: &mut Model, out: &mut Vec<Action>) {
    let a = &mut m.advice;
    ui.spacing_mut().slider_width = (ui.available_width() - 100.0).max(60.0);
    let tip = "Wrong pixels as a share of those that face the light: no more than this.";
    ui.label(RichText::new("error at most").small().color(WEAK)).on_hover_text(tip);
    let slider = Slider::new(&mut a.max_error, 0.01..=10.0).logarithmic(true).max_decimals(2).suffix(" %");
    ui.add(slider).on_hover_text(tip);
    let tip = "Time as a multiple of that of the shadow map as this set-up has it: no more than this.";
    ui.add(Checkbox::new(&mut a.limited, RichText::new("time at most, shadow-map = 1").small())).on_hover_text(tip);
    let slider = Slider::new(&mut a.max_ratio, 1.0..=100.0).logarithmic(true).max_decimals(1).prefix("× ");
    ui.add_enabled(a.limited, slider).on_hover_text(tip);
    pick_techniques(ui, m);
    ui.add_space(2.0);
    if let Some(job) = &m.measuring {
        progress(ui, job, out);
        return;
    }
    let techniques = m.techniques();
    let start = ui.add_enabled(!techniques.is_empty(), Button::new("Find the cheapest"));
    let tip = "Look among these techniques and their main parameters, measuring as few configurations as it takes. The picture waits meanwhile.";
    if start.on_hover_text(tip).on_disabled_hover_text("No technique is chosen that serves the light.").clicked() {
        out.push(Action::Advise(m.advice.budget(), techniques));
    }
    let [w, h] = m.setup.size;
    line(ui, &format!("at {w} × {h} pixels, as set under Capture"));
}

/// What was found.
fn found(ui: &mut Ui, m: &mut Model, out: &mut Vec<Action>) {
    let Some((budget, advice)) = &m.advice.found else {
        ui.centered_and_justified(|ui| {
            let text = "Say how exact the shadow must be, and find the cheapest technique that is.";
            ui.label(RichText::new(text).color(WEAK));
        });
        return;
    };
    let mut apply: Option<usize> = None;
    let mut to_chart = false;
    ScrollArea::vertical().id_salt("advice").auto_shrink([false, false]).show(ui, |ui| {
        let wanted = match budget.max_ratio {
            Some(ratio) => {
                format!("error at most {}, time at most {} × shadow-map", percent(budget.max_error), short(ratio))
            }
            None => format!("error at most {}", percent(budget.max_error)),
        };
        let tried = format!("Measured {} of {} configurations.", advice.tried.len(), advice.space);
        match (advice.answer, advice.closest) {
            (Some(i), _) => {
                answer(ui, &format!("Cheapest with {wanted}"), i, &advice.tried[i], &mut apply);
                ui.label(margin(budget, &advice.tried[i]));
                if let (Some(factor), Some(map)) = (advice.plain_factor(), advice.plain) {
                    let what = format!("shadow-map {}", main_values(&advice.tried[map]));
                    ui.label(format!("A plain shadow map: {} × its time, with {}.", short(factor), what.trim()));
                }
                if let Some(half) = advice.halved.and_then(|h| advice.tried.get(h)) {
                    ui.label(halved(&advice.tried[i], half));
                } else if advice.tried[i].error_share > 0.0 {
                    let limited = advice.tried.len() >= advice.limit;
                    ui.label(if limited {
                        "What halves that error was not found before the limit."
                    } else {
                        "Nothing there halves that error."
                    });
                }
            }
            (None, Some(i)) => {
                let text = format!("Nothing found with {wanted}.");
                ui.label(RichText::new(text).color(SUN).strong());
                answer(ui, "The closest miss", i, &advice.tried[i], &mut apply);
            }
            (None, None) => {
                ui.label(format!("Nothing found with {wanted}."));
            }
        }
        ui.horizontal(|ui| {
            ui.label(RichText::new(tried).small().color(WEAK));
            let send = ui.small_button("To the chart");
            to_chart = send.on_hover_text("Add all that was measured to the chart, and open it.").clicked();
        });
        ui.add_space(4.0);
        let tip = "Those that nothing measured beats both in error and in time.";
        ui.label(RichText::new("frontier").strong()).on_hover_text(tip);
        frontier(ui, advice, &mut apply);
    });
    let row = apply.and_then(|i| advice.tried.get(i)).cloned();
    if to_chart {
        let tried = advice.tried.clone();
        m.adopt(tried);
        m.drawer = Some(Tab::Chart);
    }
    if let Some(row) = row {
        out.extend(m.apply(&row));
    }
}

/// A row in large, with its button.
fn answer(ui: &mut Ui, head: &str, i: usize, r: &Record, apply: &mut Option<usize>) {
    ui.label(RichText::new(head).small().color(WEAK));
    ui.horizontal(|ui| {
        ui.label(RichText::new(title(&r.technique)).heading().color(color(&r.technique)));
        let button = ui.button("Apply").on_hover_text("Take over its technique and parameters.");
        if button.clicked() {
            *apply = Some(i);
        }
    });
    let main = main_values(r);
    if !main.is_empty() {
        ui.label(main).on_hover_text(r.params.replace(';', "\n"));
    }
    let ratio = r.cost.map_or(String::new(), |x| format!(", {} × shadow-map", short(x)));
    ui.label(format!("error {}, {:.3} ms{ratio}", percent(r.error_share), r.gpu_ms));
}

/// How much of the budget is left.
fn margin(budget: &Budget, r: &Record) -> String {
    let left = |part: f64, whole: f64| format!("{:.0} %", 100.0 * (1.0 - part / whole));
    let error = format!("{} of the error allowed is to spare", left(r.error_share, budget.max_error));
    match (budget.max_ratio, r.cost) {
        (Some(most), Some(ratio)) => format!("Margin: {error}, {} of the time.", left(ratio, most)),
        _ => format!("Margin: {error}."),
    }
}

/// What half the error would cost.
fn halved(r: &Record, half: &Record) -> String {
    let times = Advice::cost(half) / Advice::cost(r);
    let what = format!("{} {}", half.technique, main_values(half));
    format!(
        "Half the error or less: {} × its time, with {} ({}).",
        short(times),
        what.trim(),
        percent(half.error_share)
    )
}

fn frontier(ui: &mut Ui, advice: &Advice, apply: &mut Option<usize>) {
    Grid::new("frontier").num_columns(5).striped(true).spacing([12.0, 3.0]).show(ui, |ui| {
        for head in ["technique", "main parameters", "error", "time, ms", "× shadow-map"] {
            ui.label(RichText::new(head).small().color(WEAK));
        }
        ui.end_row();
        for i in &advice.frontier {
            let Some(r) = advice.tried.get(*i) else { continue };
            ui.label(RichText::new(&r.technique).color(color(&r.technique)));
            ui.add(Label::new(main_values(r)).truncate()).on_hover_text(r.params.replace(';', "\n"));
            let number = |text: String| RichText::new(text).monospace().size(11.5);
            ui.label(number(percent(r.error_share)));
            ui.label(number(format!("{:.3}", r.gpu_ms)));
            ui.label(number(r.cost.map_or("-".into(), short)));
            let button = ui.small_button("Apply");
            button.widget_info(|| {
                let name = format!("Apply {} {}", r.technique, main_values(r));
                egui::WidgetInfo::labeled(egui::Role::Button, true, name)
            });
            if button.on_hover_text("Take over its technique and parameters.").clicked() {
                *apply = Some(*i);
            }
            ui.end_row();
        }
    });
}
