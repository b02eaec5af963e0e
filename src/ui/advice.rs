//! The advice tab: how exact a scene must be, and the cheapest configuration that is.

use super::drawer::{beside, export, pick_techniques, progress, size};
use super::model::{Action, Model, Tab};
use super::needs::{listed, main_values, percent, title};
use super::plotting::{color, short};
use crate::chart::{self, Axis, COSTS, ERRORS};
use crate::measure::Record;
use crate::measure::advise::{self, Advice, Budget, FIGURES, Figure, Unit};
use egui::{Button, Checkbox, ComboBox, Grid, Label, RichText, Role, ScrollArea, Slider, Ui, WidgetInfo};

/// The advice tab's state.
pub struct Advising {
    /// The error that is asked for; None: what suits the techniques.
    pub by: Option<&'static Figure>,
    /// The greatest of each of [`FIGURES`], shares in per cent.
    pub max_errors: [f64; FIGURES.len()],
    /// Greatest ratio to the plain map, where there is to be one.
    pub limited: bool,
    pub max_ratio: f64,
    /// What was found, and for which budget.
    pub found: Option<(Budget, Advice)>,
}

impl Default for Advising {
    fn default() -> Advising {
        let usual = std::array::from_fn(|i| FIGURES[i].usual * scale(&FIGURES[i]));
        Advising { by: None, max_errors: usual, limited: false, max_ratio: 2.0, found: None }
    }
}

impl Advising {
    /// The rows measured, and the axes that they are charted on.
    pub fn exported(&self) -> Option<(Vec<Record>, [&'static Axis; 2])> {
        let (budget, advice) = self.found.as_ref()?;
        let cost = if advice.tried.iter().all(|r| r.cost.is_some()) { "cost" } else { "gpu_ms" };
        let find = |all: &'static [Axis], id: &str| all.iter().find(|a| a.id == id);
        Some((advice.tried.clone(), [find(COSTS, cost)?, find(ERRORS, budget.by.field)?]))
    }

    /// What the sliders ask for of these techniques.
    fn budget(&self, techniques: &[String]) -> Budget {
        let by = self.by.unwrap_or_else(|| Figure::suited(techniques));
        let max_error = self.max_errors[place(by)] / scale(by);
        Budget { by, max_error, max_ratio: self.limited.then_some(self.max_ratio) }
    }
}

/// A figure's place in [`FIGURES`].
fn place(by: &Figure) -> usize {
    FIGURES.iter().position(|f| f == by).unwrap_or(0)
}

/// What one is on its slider.
fn scale(by: &Figure) -> f64 {
    if by.unit == Unit::Share { 100.0 } else { 1.0 }
}

pub fn show(ui: &mut Ui, m: &mut Model, out: &mut Vec<Action>) {
    beside(ui, m, out, found, controls);
}

fn controls(ui: &mut Ui, m: &mut Model, out: &mut Vec<Action>) {
    let techniques = m.techniques();
    let a = &mut m.advice;
    let by = a.budget(&techniques).by;
    let doc = |f: &Figure| chart::ERRORS.iter().find(|axis| axis.id == f.field).map_or("", |axis| axis.doc);
    ui.spacing_mut().slider_width = (ui.available_width() - 100.0).max(60.0);
    let combo = ComboBox::from_id_salt("error asked for").selected_text(format!("{} at most", by.title));
    let shown = combo.width(ui.available_width() - 4.0).truncate().show_ui(ui, |ui| {
        for figure in FIGURES {
            if ui.selectable_label(figure == by, figure.title).on_hover_text(doc(figure)).clicked() {
                a.by = Some(figure);
            }
        }
    });
    let tip = "Which error. Until one is chosen: wrong pixels, or RMSE where a technique filters, as a soft edge is no wrong pixel.";
    shown.response.on_hover_text(tip).widget_info(|| WidgetInfo::labeled(Role::ComboBox, true, "error asked for"));
    let (range, decimals, suffix) = match by.unit {
        Unit::Share => (0.01..=10.0, 2, " %"),
        Unit::Plain => (0.001..=0.5, 4, ""),
        Unit::Pixels => (0.5..=100.0, 1, " px"),
    };
    let slider = Slider::new(&mut a.max_errors[place(by)], range).logarithmic(true).max_decimals(decimals);
    ui.add(slider.suffix(suffix)).on_hover_text(doc(by));
    let base = advise::base(&m.setup);
    let tip = format!(
        "Time as a multiple of that of the set-up's own plain map ({}), which takes turns with what is measured: no more than this.",
        base.as_deref().map_or("it does not serve this light".into(), spaced)
    );
    let text = RichText::new("time at most, the set-up's plain map = 1").small();
    ui.add(Checkbox::new(&mut a.limited, text)).on_hover_text(&tip);
    let slider = Slider::new(&mut a.max_ratio, 1.0..=100.0).logarithmic(true).max_decimals(1).prefix("× ");
    ui.add_enabled(a.limited, slider).on_hover_text(tip);
    pick_techniques(ui, m);
    ui.add_space(2.0);
    if let Some(job) = &m.measuring {
        progress(ui, job, out);
        return;
    }
    let start = ui.add_enabled(!techniques.is_empty(), Button::new("Find the cheapest"));
    let tip = "Look among these techniques and their main parameters, measuring as few configurations as it takes. The picture waits meanwhile.";
    if start.on_hover_text(tip).on_disabled_hover_text("No technique is chosen that serves the light.").clicked() {
        out.push(Action::Advise(m.advice.budget(&techniques), techniques));
    }
    size(ui, m);
}

/// What was found.
fn found(ui: &mut Ui, m: &mut Model, out: &mut Vec<Action>) {
    let Some((budget, advice)) = &m.advice.found else {
        ui.centered_and_justified(|ui| {
            let text = "Say how exact the shadow must be, and find the cheapest technique that is.";
            ui.label(RichText::new(text).weak());
        });
        return;
    };
    let mut apply: Option<usize> = None;
    let mut to_chart = false;
    ScrollArea::vertical().id_salt("advice").auto_shrink([false, false]).show(ui, |ui| {
        let by = budget.by;
        let mut wanted = format!("{} at most {}", by.title, value(by, budget.max_error));
        if let Some(ratio) = budget.max_ratio {
            wanted += &format!(", time at most {} × the set-up's plain map", short(ratio));
        }
        let tried = format!("Measured {} of {} configurations.", advice.tried.len(), advice.space);
        match (advice.answer, advice.closest) {
            (Some(i), _) => {
                let best = if advice.alike.is_empty() { "Cheapest" } else { "As fast as any, within the spread," };
                answer(ui, by, &format!("{best} with {wanted}"), i, &advice.tried[i], &mut apply);
                ui.label(margin(budget, &advice.tried[i]));
                if !advice.alike.is_empty() {
                    let names = advice.alike.iter().map(|i| &advice.tried[*i]);
                    let names: Vec<String> = names.map(|r| format!("{} {}", r.technique, main_values(r))).collect();
                    ui.label(format!("As fast, within the spread of the times: {}.", names.join("; ")));
                }
                if let (Some(factor), Some(map)) = (advice.plain_factor(), advice.plain) {
                    let map = &advice.tried[map];
                    let what = format!("{} {}", map.technique, main_values(map));
                    let told = match Advice::as_fast(&advice.tried[i], map) {
                        true => "as fast, within the spread".into(),
                        false => format!("{} × its time", short(factor)),
                    };
                    ui.label(format!("A plain map: {told}, with {}.", what.trim()));
                }
                if let Some(half) = advice.halved.and_then(|h| advice.tried.get(h)) {
                    ui.label(halved(by, &advice.tried[i], half));
                } else if by.of(&advice.tried[i]).is_some_and(|x| x > 0.0) {
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
                ui.label(RichText::new(text).color(ui.visuals().warn_fg_color).strong());
                answer(ui, by, "The closest miss", i, &advice.tried[i], &mut apply);
            }
            (None, None) => {
                ui.label(format!("Nothing found with {wanted}."));
            }
        }
        ui.horizontal_wrapped(|ui| {
            ui.label(RichText::new(tried).small().weak());
            let send = ui.small_button("To the chart");
            let tip = "Add all that was measured to the chart, and open it with this error against this time.";
            to_chart = send.on_hover_text(tip).clicked();
            export(ui, Tab::Advice, "advice", !advice.tried.is_empty(), out);
        });
        if let Some(busy) = chart::busy(&advice.tried) {
            ui.label(RichText::new(busy).color(ui.visuals().warn_fg_color));
        }
        ui.add_space(4.0);
        ui.label(RichText::new("frontier").strong()).on_hover_text(FRONTIER);
        frontier(ui, by, advice, &mut apply);
        for text in told(by, advice) {
            ui.label(RichText::new(text).small().weak());
        }
    });
    let row = apply.and_then(|i| advice.tried.get(i)).cloned();
    if to_chart && let Some((tried, [cost, error])) = m.advice.exported() {
        let place = |all: &[Axis], id: &str| all.iter().position(|a| a.id == id).unwrap_or(0);
        (m.chart.cost, m.chart.error) = (place(COSTS, cost.id), place(ERRORS, error.id));
        m.adopt(tried);
        m.drawer = Some(Tab::Chart);
    }
    if let Some(row) = row {
        out.extend(m.apply(&row));
    }
}

/// A row in large, with its button.
fn answer(ui: &mut Ui, by: &Figure, head: &str, i: usize, r: &Record, apply: &mut Option<usize>) {
    ui.label(RichText::new(head).small().weak());
    ui.horizontal(|ui| {
        ui.label(RichText::new(title(&r.technique)).heading().color(color(&r.technique)));
        let button = ui.button("Apply").on_hover_text("Take over its technique and parameters.");
        if button.clicked() {
            *apply = Some(i);
        }
    });
    let main = main_values(r);
    if !main.is_empty() {
        ui.label(main).on_hover_text(listed(r));
    }
    let time = match r.cost.zip(r.cost_base_ms()) {
        Some((x, base)) => format!("{} × the set-up's plain map ({:.3} ms against {base:.3} ms)", short(x), r.gpu_ms),
        None => format!("{:.3} ms", r.gpu_ms),
    };
    ui.label(format!("{} {}, {time}", by.title, error(by, r)));
}

/// A row's error, in words.
fn error(by: &Figure, r: &Record) -> String {
    by.of(r).map_or("-".into(), |x| value(by, x))
}

/// A value with its unit, in about three figures.
fn value(by: &Figure, x: f64) -> String {
    match by.unit {
        Unit::Share => percent(x),
        Unit::Plain => short(x),
        Unit::Pixels => format!("{} px", short(x)),
    }
}

/// How much of the budget is left.
fn margin(budget: &Budget, r: &Record) -> String {
    let left = |part: f64, whole: f64| format!("{:.0} %", 100.0 * (1.0 - part / whole));
    let spare = budget.by.of(r).map_or("-".into(), |x| left(x, budget.max_error));
    let error = format!("{spare} of the error allowed is to spare");
    match (budget.max_ratio, r.cost) {
        (Some(most), Some(ratio)) => format!("Margin: {error}, {} of the time.", left(ratio, most)),
        _ => format!("Margin: {error}."),
    }
}

/// What half the error would cost.
fn halved(by: &Figure, r: &Record, half: &Record) -> String {
    let times = Advice::cost(half) / Advice::cost(r);
    let what = format!("{} {}", half.technique, main_values(half));
    format!("Half the error or less: {} × its time, with {} ({}).", short(times), what.trim(), error(by, half))
}

/// What the frontier is.
const FRONTIER: &str = "What nothing measured beats: nothing there is as fast and more exact, or faster and as exact. Of times whose quartiles overlap none is faster.";

/// What must be known to read the frontier: where the rest is, and what times are multiples of.
fn told(by: &Figure, advice: &Advice) -> Vec<String> {
    let mut out: Vec<String> = advice.failed.iter().map(|why| format!("Could not be measured: {why}.")).collect();
    let rest = advice.tried.len() - advice.frontier.len();
    if rest > 0 {
        out.push(format!(
            "The other {rest} are beaten: one of these is at least as exact, and not slower beyond the spread of the times."
        ));
    }
    let name = |i: usize| {
        let r = &advice.tried[i];
        format!("{} {}", r.technique, main_values(r)).trim().to_string()
    };
    if let Some((cheapest, winner)) = advice.cheapest_beaten(by) {
        out.push(format!(
            "The least median time has {} ({} {}), but {} is more exact, and their times overlap.",
            name(cheapest),
            by.title,
            error(by, &advice.tried[cheapest]),
            name(winner)
        ));
    }
    if let (Some(base), Some([least, most])) = (&advice.base, advice.base_ms()) {
        let took = match most > 1.1 * least {
            true => format!(
                "took {} to {} ms in turn with the rows, as the machine was more or less busy: compare multiples, not ms.",
                short(least),
                short(most)
            ),
            false => format!("took {} ms.", short(least)),
        };
        out.push(format!("1 × is the set-up's own plain map ({}); it {took}", spaced(base)));
    }
    out
}

/// Parameters as they stand in a sentence.
fn spaced(brief: &str) -> String {
    brief.replace(['=', '_'], " ")
}

fn frontier(ui: &mut Ui, by: &Figure, advice: &Advice, apply: &mut Option<usize>) {
    let table = ScrollArea::horizontal().id_salt("frontier").auto_shrink([false, true]);
    table.show(ui, |ui| frontier_table(ui, by, advice, apply));
}

fn frontier_table(ui: &mut Ui, by: &Figure, advice: &Advice, apply: &mut Option<usize>) {
    let error_doc = ERRORS.iter().find(|a| a.id == by.field).map_or("", |a| a.doc);
    let heads = [
        ("technique", FRONTIER),
        ("main parameters", "Point at them for all parameters."),
        (by.title, error_doc),
        (
            "× plain map",
            "Time as a multiple of that of the set-up's own plain map, in the same turns: what rows are compared by.",
        ),
        ("time, ms", "Median of the technique's time. A machine that gets busy lengthens it; the multiple stays."),
        ("1 ×, ms", "What the set-up's own plain map took in turn with this row: 1 in the column of multiples."),
    ];
    Grid::new("frontier").num_columns(heads.len() + 1).striped(true).spacing([12.0, 3.0]).show(ui, |ui| {
        for (head, tip) in heads {
            ui.label(RichText::new(head).small().weak()).on_hover_text(tip);
        }
        ui.end_row();
        for i in &advice.frontier {
            let Some(r) = advice.tried.get(*i) else { continue };
            ui.label(RichText::new(&r.technique).color(color(&r.technique)));
            ui.add(Label::new(main_values(r)).extend()).on_hover_text(listed(r));
            let number = |text: String| RichText::new(text).monospace().size(11.5);
            ui.label(number(error(by, r)));
            ui.label(number(r.cost.map_or("-".into(), short)));
            ui.label(number(format!("{:.3}", r.gpu_ms)));
            ui.label(number(r.cost_base_ms().map_or("-".into(), |ms| format!("{ms:.3}"))));
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
