//! Rows of the panel: a name, a control of fixed width, a tooltip.

use crate::params::{Kind, Spec, Value};
use egui::{Align, Button, ComboBox, DragValue, Label, Layout, Rect, Response, Sense, Shape, Slider, Stroke, Ui, Vec2};
use egui::{Role, WidgetInfo, pos2, vec2};
use std::ops::RangeInclusive;

/// Width of the names, points.
const NAME: f32 = 96.0;
/// Width of the value fields, points.
const FIELD: f32 = 92.0;
const HEIGHT: f32 = 21.0;
/// Width of the button that resets a parameter, points.
const RESET: f32 = 20.0;

/// A row: the name on the left with its tooltip, controls on the right.
pub fn row<R>(ui: &mut Ui, name: &str, tip: &str, add: impl FnOnce(&mut Ui, &Response) -> R) -> R {
    ui.horizontal(|ui| {
        let layout = Layout::left_to_right(Align::Center);
        let label = ui.allocate_ui_with_layout(vec2(NAME, HEIGHT), layout, |ui| {
            ui.set_min_width(NAME);
            ui.add(Label::new(name).truncate().sense(Sense::click()).show_tooltip_when_elided(false))
        });
        let label = label.inner.on_hover_text(tip);
        add(ui, &label)
    })
    .inner
}

/// A number field of fixed width.
pub fn field(ui: &mut Ui, width: f32, drag: DragValue, tip: &str) -> Response {
    ui.add_sized([width, HEIGHT], drag).on_hover_text(tip)
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
        let scale = Scale { range, step: 0.0, smallest: if log { Some(1e-3) } else { None } };
        let changed = slider_and_field(ui, &mut v, scale, unit, tip, label, 0.0);
        if changed {
            *value = v as f32;
        }
        changed
    })
}

/// How a slider runs.
struct Scale {
    range: RangeInclusive<f64>,
    /// 0: any value.
    step: f64,
    /// Logarithmic, down to this value above 0.
    smallest: Option<f64>,
}

fn slider_and_field(
    ui: &mut Ui,
    value: &mut f64,
    scale: Scale,
    unit: &str,
    tip: &str,
    label: &Response,
    reserved: f32,
) -> bool {
    let before = *value;
    let suffix = if unit.is_empty() { String::new() } else { format!(" {unit}").replace(" °", "°") };
    let gap = ui.spacing().item_spacing.x;
    ui.spacing_mut().slider_width = (ui.available_width() - FIELD - gap - reserved).max(40.0);
    let (low, high) = (*scale.range.start(), *scale.range.end());
    let mut slider = Slider::new(value, scale.range.clone()).show_value(false).logarithmic(scale.smallest.is_some());
    if let Some(smallest) = scale.smallest {
        slider = slider.smallest_positive(smallest);
    }
    if scale.step > 0.0 {
        slider = slider.step_by(scale.step);
    }
    ui.add(slider).labelled_by(label.id).on_hover_text(tip);
    let speed = if scale.step > 0.0 { scale.step * 0.1 } else { (value.abs() * 0.01).max((high - low) * 1e-4) };
    let decimals = if scale.step > 0.0 { 0 } else { decimals(*value) };
    let drag = DragValue::new(value).range(scale.range).speed(speed).suffix(suffix).max_decimals(decimals);
    field(ui, FIELD, drag, tip).labelled_by(label.id);
    if scale.step > 0.0 {
        *value = (low + ((*value - low) / scale.step).round() * scale.step).clamp(low, high);
    }
    *value != before
}

/// Decimals that show about four figures.
fn decimals(value: f64) -> usize {
    let size = value.abs();
    if size == 0.0 { 2 } else { (3.0 - size.log10().floor()).clamp(0.0, 6.0) as usize }
}

/// A row for a technique's parameter. True when the value changed.
pub fn parameter(ui: &mut Ui, spec: &Spec, value: &mut Value) -> bool {
    let name = spec.name.replace('_', " ");
    let tip = format!(
        "{}\nTakes {}; {} at first. Double-click the name to reset.",
        spec.doc.trim(),
        spec.range(),
        spec.default()
    );
    let before = value.clone();
    row(ui, &name, &tip, |ui, label| {
        let reserved = RESET + ui.spacing().item_spacing.x;
        match (spec.kind, &mut *value) {
            (Kind::Flag { .. }, Value::Bool(on)) => {
                ui.checkbox(on, "").labelled_by(label.id).on_hover_text(&tip);
            }
            (Kind::Int { min, max, step, .. }, Value::Int(number)) => {
                let mut v = *number as f64;
                let log = min > 0 && max / min >= 64 && step == 1;
                let smallest = log.then_some(min as f64);
                let scale = Scale { range: min as f64..=max as f64, step: step as f64, smallest };
                if slider_and_field(ui, &mut v, scale, spec.unit, &tip, label, reserved) {
                    *number = v as i64;
                }
            }
            (Kind::Float { default, min, max }, Value::Float(number)) => {
                let smallest = if min > 0.0 && max / min >= 50.0 {
                    Some(min)
                } else if min == 0.0 && default > 0.0 && max / default >= 20.0 {
                    Some(default * 0.01)
                } else {
                    None
                };
                slider_and_field(
                    ui,
                    number,
                    Scale { range: min..=max, step: 0.0, smallest },
                    spec.unit,
                    &tip,
                    label,
                    reserved,
                );
            }
            (Kind::Choice { options, .. }, Value::Text(chosen)) => {
                let width = ui.available_width() - reserved;
                let combo = ComboBox::from_id_salt(spec.name).selected_text(chosen.as_str()).width(width);
                let shown = combo.show_ui(ui, |ui| {
                    for option in options {
                        ui.selectable_value(chosen, (*option).to_string(), *option);
                    }
                });
                shown.response.labelled_by(label.id).on_hover_text(&tip);
            }
            _ => *value = spec.default(),
        }
        let default = *value == spec.default();
        let reset = !default && reset(ui, &name, &spec.default());
        if reset || label.double_clicked() {
            *value = spec.default();
        }
    });
    *value != before
}

/// A small arrow that turns back, at the row's end. True when clicked.
fn reset(ui: &mut Ui, name: &str, default: &Value) -> bool {
    let right = ui.max_rect().right();
    let rect = Rect::from_center_size(pos2(right - RESET / 2.0, ui.min_rect().center().y), vec2(RESET, HEIGHT));
    let r = ui.allocate_rect(rect, Sense::click());
    r.widget_info(|| WidgetInfo::labeled(Role::Button, true, format!("reset {name}")));
    let color = ui.style().interact(&r).fg_stroke.color;
    let at = |degrees: f32| rect.center() + 5.0 * Vec2::angled(degrees.to_radians());
    let arc: Vec<_> = (0..=12).map(|i| at(-130.0 + i as f32 * 22.5)).collect();
    ui.painter().line(arc, Stroke::new(1.3, color));
    let tip = at(-130.0);
    let head = [tip + vec2(-2.5, -3.5), tip + vec2(3.5, 0.5), tip + vec2(-3.0, 2.5)];
    ui.painter().add(Shape::convex_polygon(head.to_vec(), color, Stroke::NONE));
    r.on_hover_text(format!("Back to {default}.")).clicked()
}

/// Buttons of which one is chosen, in as many lines as they need. The one that was clicked.
pub fn chips<'a>(ui: &mut Ui, items: impl Iterator<Item = (&'a str, bool, String)>) -> Option<usize> {
    let mut clicked = None;
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing = vec2(4.0, 4.0);
        for (i, (name, chosen, tip)) in items.enumerate() {
            let chip = Button::selectable(chosen, name).frame_when_inactive(true);
            if ui.add(chip).on_hover_text(tip).clicked() {
                clicked = Some(i);
            }
        }
    });
    clicked
}
