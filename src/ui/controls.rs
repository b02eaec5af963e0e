//! Rows of the panel in fixed columns: name, slider, value with its unit, reset.

use super::words;
use crate::chart::digits;
use crate::params::{Kind, Spec, Value};
use egui::{
    Align, Align2, Button, ComboBox, DragValue, FontId, Id, Label, Layout, Rect, Response, Sense, Shape, Slider,
};
use egui::{RectAlign, Role, Stroke, Tooltip, Ui, Vec2, WidgetInfo, WidgetText, pos2, vec2};
use std::ops::RangeInclusive;

/// Width of the names, points.
const NAME: f32 = 100.0;
/// Width of the value fields, points.
const FIELD: f32 = 108.0;
pub const HEIGHT: f32 = 21.0;
/// Width of the button that resets a parameter, points.
const RESET: f32 = 20.0;

/// Tooltips that leave what they explain in view: in the panel they stand to its left.
pub trait Tip {
    fn tip(self, text: impl Into<WidgetText>) -> Self;
    /// As `tip`, with more than text.
    fn tip_ui(self, add: impl FnOnce(&mut Ui)) -> Self;
    /// As `tip`, while it is disabled.
    fn tip_disabled(self, text: impl Into<WidgetText>) -> Self;
    /// Of an entry of a list that is as wide as this: beside the list, whose other entries stay in view.
    fn tip_beside(self, list: Rect, text: impl Into<WidgetText>) -> Self;
}

impl Tip for Response {
    fn tip(self, text: impl Into<WidgetText>) -> Self {
        self.tip_ui(|ui| {
            ui.add(Label::new(text));
        })
    }

    fn tip_ui(self, add: impl FnOnce(&mut Ui)) -> Self {
        match in_panel(&self) {
            None => self.on_hover_ui(add),
            Some(around) => {
                show_left(Tooltip::for_enabled(&self), around, add);
                self
            }
        }
    }

    fn tip_disabled(self, text: impl Into<WidgetText>) -> Self {
        match in_panel(&self) {
            None => self.on_disabled_hover_text(text),
            Some(around) => {
                show_left(Tooltip::for_disabled(&self), around, |ui| _ = ui.label(text));
                self
            }
        }
    }

    fn tip_beside(self, list: Rect, text: impl Into<WidgetText>) -> Self {
        let around = self.rect.with_min_x(list.left()).with_max_x(list.right());
        show_left(Tooltip::for_enabled(&self), around, |ui| _ = ui.label(text));
        self
    }
}

/// The place of what stands in the panel, as far as the panel's left edge.
fn in_panel(r: &Response) -> Option<Rect> {
    let panel = panel_left(&r.ctx).filter(|left| r.rect.right() > *left)?;
    // A list that opens in the panel may be wider than that.
    Some(r.rect.with_min_x(panel.min(r.rect.left())))
}

/// Shows a tooltip to the left of a place; to its right where there is no room.
fn show_left(mut tooltip: Tooltip, around: Rect, add: impl FnOnce(&mut Ui)) {
    let others = &[RectAlign::RIGHT_START, RectAlign::LEFT_END, RectAlign::RIGHT_END];
    tooltip.popup = tooltip.popup.anchor(around).align(RectAlign::LEFT_START).align_alternatives(others).gap(8.0);
    tooltip.show(|ui| {
        ui.set_max_width(ui.spacing().tooltip_width);
        add(ui);
    });
}

fn panel_left(ctx: &egui::Context) -> Option<f32> {
    ctx.data(|d| d.get_temp(Id::unique("panel's left")))
}

/// Says where the panel begins, or that there is none.
pub fn set_panel_left(ctx: &egui::Context, left: Option<f32>) {
    let id = Id::unique("panel's left");
    match left {
        Some(left) => _ = ctx.data_mut(|d| d.insert_temp(id, left)),
        None => ctx.data_mut(|d| d.remove::<f32>(id)),
    }
}

/// Takes what a row has to say since the last call: that a number was out of range.
pub fn take_said(ctx: &egui::Context) -> Option<String> {
    ctx.data_mut(|d| d.remove_temp(Id::unique("a row says")))
}

fn say(ui: &Ui, text: String) {
    ui.data_mut(|d| d.insert_temp(Id::unique("a row says"), text));
}

/// The control that a lesson has something to try with, by its name ([`crate::lessons::control`]), and whether it is scrolled to.
#[derive(Clone)]
struct Marked {
    what: String,
    sought: bool,
}

fn marked(ctx: &egui::Context) -> Option<Marked> {
    ctx.data(|d| d.get_temp(Id::unique("marked control")))
}

/// Says which control is marked in this pass.
pub fn set_mark(ctx: &egui::Context, what: Option<&str>, sought: bool) {
    let id = Id::unique("marked control");
    ctx.data_mut(|d| match what {
        Some(what) => _ = d.insert_temp(id, Marked { what: what.into(), sought }),
        None => d.remove::<Marked>(id),
    });
}

/// Whether the marked control is scrolled to and is one of these: what it is folded away in is to open.
pub fn seeks(ctx: &egui::Context, is: impl FnOnce(&str) -> bool) -> bool {
    marked(ctx).is_some_and(|m| m.sought && is(&m.what))
}

/// Frames a control if it is the marked one.
pub fn mark(ui: &Ui, rect: Rect, is: impl FnOnce(&str) -> bool) {
    let Some(marked) = marked(ui.ctx()).filter(|m| is(&m.what)) else { return };
    let stroke = Stroke::new(2.0, ui.visuals().warn_fg_color);
    let tint = stroke.color.gamma_multiply(0.14);
    // It reaches a little into the panel's margin.
    let mut painter = ui.painter().clone();
    painter.set_clip_rect(ui.clip_rect().expand2(vec2(6.0, 0.0)));
    painter.rect(rect.expand2(vec2(3.0, 1.0)), 4.0, tint, stroke, egui::StrokeKind::Inside);
    if marked.sought && !ui.clip_rect().contains_rect(rect.shrink(1.0)) {
        ui.scroll_to_rect_animation(rect, Some(Align::Center), egui::style::ScrollAnimation::none());
    }
    ui.data_mut(|d| d.insert_temp(Id::unique("marked place"), rect));
}

/// Where the marked control stood when it was last drawn.
pub fn marked_place(ctx: &egui::Context) -> Option<Rect> {
    ctx.data(|d| d.get_temp(Id::unique("marked place")))
}

/// A row: the name on the left with its tooltip, controls on the right.
pub fn row<R>(ui: &mut Ui, name: &str, tip: &str, add: impl FnOnce(&mut Ui, &Response) -> R) -> R {
    ui.horizontal(|ui| {
        let layout = Layout::left_to_right(Align::Center);
        let label = ui.allocate_ui_with_layout(vec2(NAME, HEIGHT), layout, |ui| {
            ui.set_min_width(NAME);
            ui.add(Label::new(name).truncate().sense(Sense::click()).show_tooltip_when_elided(false))
        });
        let label = label.inner.tip_ui(|ui| {
            ui.label(tip);
            words::under(ui, name);
        });
        let added = add(ui, &label);
        mark(ui, ui.min_rect(), |what| ["light", "camera"].iter().any(|at| what.split_once(':') == Some((at, name))));
        added
    })
    .inner
}

/// Draws what may become less high. While `still` holds, it takes the room that it once had: what stands below keeps its place.
pub fn steady(ui: &mut Ui, name: &str, still: bool, add: impl FnOnce(&mut Ui)) {
    let id = ui.scope_id().with(("steady", name));
    let height = ui.vertical(add).response.rect.height();
    let held = ui.data(|d| d.get_temp::<f32>(id)).filter(|held| still && *held > height).unwrap_or(height);
    if held > height {
        ui.add_space(held - height);
    }
    ui.data_mut(|d| d.insert_temp(id, held));
}

/// What is left of a row for its controls: all but the place of the reset.
pub fn room(ui: &Ui) -> f32 {
    ui.available_width() - RESET - ui.spacing().item_spacing.x
}

/// A number field of fixed width.
pub fn field(ui: &mut Ui, width: f32, drag: DragValue, tip: &str) -> Response {
    ui.add_sized([width, HEIGHT], drag).tip(tip)
}

/// A row with a slider and a number field. True when the value changed.
pub fn slide(
    ui: &mut Ui,
    name: &str,
    tip: &str,
    value: &mut f32,
    range: RangeInclusive<f32>,
    log: bool,
    unit: &str,
) -> bool {
    row(ui, name, tip, |ui, label| {
        let mut v = *value as f64;
        let range = *range.start() as f64..=*range.end() as f64;
        let smallest = log.then(|| if unit == "m" { 1e-3 * length_unit(ui).1 } else { 1e-3 });
        let scale = Scale { name, range: range.clone(), slider: range, step: 0.0, smallest, unit };
        let changed = slider_and_field(ui, &mut v, scale, tip, label);
        if changed {
            *value = v as f32;
        }
        changed
    })
}

/// Keeps the unit in which lengths of a scene read well, whose diagonal is so many metres.
pub fn set_length_unit(ui: &Ui, diagonal: f32) {
    let unit: (&str, f64) = match diagonal {
        d if d < 5e-4 => ("µm", 1e-6),
        d if d < 0.5 => ("mm", 1e-3),
        d if d > 2e4 => ("km", 1e3),
        _ => ("m", 1.0),
    };
    ui.data_mut(|d| d.insert_temp(Id::unique("length unit"), unit));
}

/// The unit in which lengths are shown, and its metres.
pub fn length_unit(ui: &Ui) -> (&'static str, f64) {
    ui.data(|d| d.get_temp(Id::unique("length unit"))).unwrap_or(("m", 1.0))
}

/// How a slider and its field run.
struct Scale<'a> {
    name: &'a str,
    /// What the field takes.
    range: RangeInclusive<f64>,
    /// What the slider runs over.
    slider: RangeInclusive<f64>,
    /// 0: any value.
    step: f64,
    /// Logarithmic, down to this value above 0.
    smallest: Option<f64>,
    unit: &'a str,
}

fn slider_and_field(ui: &mut Ui, value: &mut f64, scale: Scale, tip: &str, label: &Response) -> bool {
    let (unit, metres) = length_unit(ui);
    if scale.unit == "m" && unit != "m" {
        let shown = |r: &RangeInclusive<f64>| r.start() / metres..=r.end() / metres;
        let (range, slider) = (shown(&scale.range), shown(&scale.slider));
        let smallest = scale.smallest.map(|s| s / metres);
        let mut length = *value / metres;
        let changed = slider_and_field(ui, &mut length, Scale { range, slider, smallest, unit, ..scale }, tip, label);
        if changed {
            *value = (length * metres).clamp(*scale.range.start(), *scale.range.end());
        }
        return changed;
    }
    let before = *value;
    let suffix = suffix(scale.unit);
    let gap = ui.spacing().item_spacing.x;
    ui.spacing_mut().slider_width = (room(ui) - FIELD - gap).max(32.0);
    let (low, high) = (*scale.slider.start(), *scale.slider.end());
    // A value beyond the slider's end stays until the slider is moved.
    let mut slid = value.clamp(low, high);
    let mut slider = Slider::new(&mut slid, low..=high).show_value(false).logarithmic(scale.smallest.is_some());
    if let Some(smallest) = scale.smallest {
        slider = slider.smallest_positive(smallest);
    }
    if scale.step > 0.0 {
        slider = slider.step_by(scale.step);
    }
    let slider = ui.add(slider).labelled_by(label.id);
    if slider.changed() {
        *value = slid;
    }
    slider.tip(tip);
    let speed = if scale.step > 0.0 { scale.step * 0.1 } else { (value.abs() * 0.01).max((high - low) * 1e-4) };
    let beyond = std::cell::Cell::new(None);
    let (now, text_now) = (*value, digits(*value));
    let drag = DragValue::new(value).range(scale.range.clone()).speed(speed).custom_formatter(|v, _| digits(v));
    let drag = drag.suffix(&suffix).update_while_editing(false).custom_parser(|text| {
        // Text that nobody changed is no reason to round the value.
        if text == text_now {
            return Some(now);
        }
        let typed = text.trim().trim_end_matches(suffix.trim()).trim().replace(['−', ','], "");
        let number = if text.contains('−') { format!("-{typed}") } else { typed }.parse::<f64>().ok()?;
        beyond.set((!scale.range.contains(&number)).then_some(number));
        Some(number)
    });
    field(ui, FIELD, drag, tip).labelled_by(label.id);
    if let Some(number) = beyond.get() {
        let (low, high) = (scale.range.start(), scale.range.end());
        say(
            ui,
            format!("{} takes {low} to {high}{suffix}: {number} became {}.", scale.name, number.clamp(*low, *high)),
        );
    }
    if scale.step > 0.0 {
        let (low, high) = (*scale.range.start(), *scale.range.end());
        *value = (low + ((*value - low) / scale.step).round() * scale.step).clamp(low, high);
    }
    *value != before
}

/// A unit as it follows a number.
pub fn suffix(unit: &str) -> String {
    if unit.is_empty() { String::new() } else { format!(" {unit}").replace(" °", "°") }
}

/// A value in words.
pub fn shown_value(value: &Value) -> String {
    match value {
        Value::Float(v) => digits(*v),
        Value::Bool(v) => if *v { "on" } else { "off" }.into(),
        other => other.to_string(),
    }
}

/// What a parameter is called in the panel.
pub fn shown_name(spec: &Spec) -> String {
    spec.name.replace('_', " ")
}

/// Why an option of a choice cannot be taken; None if it can.
pub type Refused<'a> = &'a dyn Fn(&str) -> Option<String>;

/// A row for a technique's parameter in a scene that is seen from this distance, metres, and with this default; `pinned` is changed by
/// the name's menu, and `refused` says why an option cannot be chosen.
pub fn parameter(
    ui: &mut Ui,
    spec: &Spec,
    value: &mut Value,
    (distance, default): (f64, Value),
    (pinned, refused): (&mut bool, Refused),
) {
    let name = shown_name(spec);
    let (doc, range) = (spec.doc.trim(), spec.range());
    let tip =
        format!("{doc}\nRange: {range}. Default: {default}.\nDouble-click the name to reset, right-click to pin.");
    row(ui, &name, &tip, |ui, label| {
        match (spec.kind, &mut *value) {
            (Kind::Flag { .. }, Value::Bool(on)) => {
                ui.checkbox(on, "").labelled_by(label.id).tip(&tip);
            }
            (Kind::Int { min, max, step, .. }, Value::Int(number)) => {
                let mut v = *number as f64;
                let log = min > 0 && max / min >= 64 && step == 1;
                let smallest = log.then_some(min as f64);
                let range = min as f64..=max as f64;
                let (slider, step, unit) = (range.clone(), step as f64, spec.unit);
                if slider_and_field(ui, &mut v, Scale { name: &name, range, slider, step, smallest, unit }, &tip, label)
                {
                    *number = v as i64;
                }
            }
            (Kind::Float { default: ordinary, min, max }, Value::Float(number)) => {
                let default = if let Value::Float(default) = default { default } else { ordinary };
                let end = spec.reach.map_or(max, |share| nice(share * distance).clamp(4.0 * default, max));
                let smallest = if min > 0.0 && end / min >= 50.0 {
                    Some(min)
                } else if min == 0.0 && default > 0.0 && end / default >= 20.0 {
                    Some(default * 0.1)
                } else {
                    None
                };
                let (range, slider, unit) = (min..=max, min..=end, spec.unit);
                slider_and_field(
                    ui,
                    number,
                    Scale { name: &name, range, slider, step: 0.0, smallest, unit },
                    &tip,
                    label,
                );
            }
            (Kind::Choice { options, .. }, Value::Text(chosen)) => {
                let width = room(ui);
                let combo = ComboBox::from_id_salt(spec.name).selected_text(chosen.as_str()).width(width);
                let shown = combo.show_ui(ui, |ui| {
                    for option in options {
                        let why = refused(option);
                        let button = Button::selectable(chosen == option, *option);
                        let button = ui.add_enabled(why.is_none(), button);
                        if button.on_disabled_hover_text(why.unwrap_or_default()).clicked() {
                            *chosen = (*option).to_string();
                        }
                    }
                });
                shown.response.labelled_by(label.id).tip(&tip);
            }
            _ => *value = default.clone(),
        }
        let chosen = *value != default;
        let reset = chosen && reset(ui, &name, &default);
        if reset || label.double_clicked() {
            *value = default.clone();
        }
        label.context_menu(|ui| {
            if ui.button(if *pinned { "Unpin" } else { "Pin to the top" }).clicked() {
                *pinned ^= true;
                ui.close();
            }
            if ui.add_enabled(chosen, Button::new(format!("Reset to {default}"))).clicked() {
                *value = default.clone();
                ui.close();
            }
        });
    });
    if let Some(ends) = spec.ends {
        captions(ui, ends);
    }
}

/// Rounded to one digit.
fn nice(x: f64) -> f64 {
    let power = 10f64.powf(x.log10().floor());
    (x / power).round() * power
}

/// What the two ends of the slider above mean.
fn captions(ui: &mut Ui, ends: [&str; 2]) {
    let gap = ui.spacing().item_spacing.x;
    let left = ui.cursor().left() + NAME + gap;
    let right = ui.cursor().left() + ui.available_width() - RESET - FIELD - 2.0 * gap;
    let (rect, _) = ui.allocate_exact_size(vec2(ui.available_width(), 11.0), Sense::hover());
    for (text, x) in ends.into_iter().zip([left + 6.0, right - 6.0]) {
        let at = pos2(x, rect.top() - 3.0);
        ui.painter().text(at, Align2::CENTER_TOP, text, FontId::proportional(10.5), ui.visuals().weak_text_color());
    }
}

/// A small arrow that turns back, at the row's end. True when clicked.
fn reset(ui: &mut Ui, name: &str, default: &Value) -> bool {
    let rect = reset_place(ui, ui.min_rect().center().y);
    let r = ui.allocate_rect(rect, Sense::click());
    arrow(ui, r, name).tip(format!("Back to {default}.")).clicked()
}

/// The same at the end of a heading, for all that stands below it. True when clicked.
pub fn reset_all(ui: &Ui, heading: &Response, name: &str) -> bool {
    let rect = reset_place(ui, heading.rect.center().y);
    let r = ui.interact(rect, heading.id.with("reset"), Sense::click());
    arrow(ui, r, name).tip("All that stands below back to its default.").clicked()
}

/// Where the last column's button stands in a row at this height.
fn reset_place(ui: &Ui, y: f32) -> Rect {
    Rect::from_center_size(pos2(ui.max_rect().right() - RESET / 2.0, y), vec2(RESET, HEIGHT))
}

fn arrow(ui: &Ui, r: Response, name: &str) -> Response {
    r.widget_info(|| WidgetInfo::labeled(Role::Button, true, format!("reset {name}")));
    let rect = r.rect;
    let color = ui.style().interact(&r).fg_stroke.color;
    let at = |degrees: f32| rect.center() + 5.0 * Vec2::angled(degrees.to_radians());
    let arc: Vec<_> = (0..=12).map(|i| at(-130.0 + i as f32 * 22.5)).collect();
    ui.painter().line(arc, Stroke::new(1.3, color));
    let tip = at(-130.0);
    let head = [tip + vec2(-2.5, -3.5), tip + vec2(3.5, 0.5), tip + vec2(-3.0, 2.5)];
    ui.painter().add(Shape::convex_polygon(head.to_vec(), color, Stroke::NONE));
    r
}

/// Buttons of which one is chosen, in as many lines as they need. The one that was clicked.
pub fn chips<'a>(ui: &mut Ui, items: impl Iterator<Item = (&'a str, bool, String)>) -> Option<usize> {
    let mut clicked = None;
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing = vec2(4.0, 4.0);
        for (i, (name, chosen, tip)) in items.enumerate() {
            let chip = Button::selectable(chosen, name).frame_when_inactive(true);
            let chip = ui.add(chip);
            mark(ui, chip.rect, |what| what.strip_prefix("chip:") == Some(name));
            if chip.tip(tip).clicked() {
                clicked = Some(i);
            }
        }
    });
    clicked
}
