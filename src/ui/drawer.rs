//! The drawer under the picture: its tabs, and what they have in common.

use super::controls::{Tip, chips, mark};
use super::model::{Action, Job, Model, Tab};
use super::{advice, inspect, sheets, sweep, timeline};
use crate::techniques;
use egui::scroll_area::ScrollBarVisibility;
use egui::{Align, Button, Frame, Label, Layout, Margin, Panel, ProgressBar, Rect, RichText, ScrollArea, Sense, Ui};
use egui::{DragValue, Role, UiBuilder, WidgetInfo, vec2};
use std::collections::BTreeSet;
use std::path::PathBuf;

/// Height of the strip with the tabs, points.
const STRIP: f32 = 26.0;
/// Share of the room that the drawer takes at first.
const SHARE: f32 = 0.45;
/// Points of picture that always stay.
const PICTURE: f32 = 90.0;
/// Width of a column with controls, points.
const SIDE: f32 = 270.0;
/// Height of the list of techniques in it at most, points.
const MOST_CHIPS: f32 = 150.0;
/// Below this width tabs stand closer together, and lessons and flatland have their keys alone, points.
const TIGHT: f32 = 470.0;
/// Below this width controls stand under the chart, points.
const NARROW: f32 = 520.0;

/// The tabs with their titles, keys, and what they are for.
pub const TABS: [(Tab, &str, &str); 5] = [
    (Tab::Chart, "Chart", "Error against cost: sweep techniques over their parameters and compare them (F2)."),
    (Tab::Stability, "Stability", "Paths of camera and light on which some techniques fail (F3)."),
    (Tab::Advice, "Advice", "The cheapest technique and parameters that are exact enough (F4)."),
    (Tab::Pixel, "Pixel", "What the technique did at one pixel, why it is wrong, and what would help (F6)."),
    (Tab::Figure, "Figure", "A sheet of pictures for a paper: rows, columns, insets, numbers, caption (F7)."),
];

/// Draws the strip and, above it, the open tab.
pub fn show(ui: &mut Ui, m: &mut Model, out: &mut Vec<Action>) {
    let strip = Frame::new().fill(ui.visuals().panel_fill).inner_margin(Margin::symmetric(10, 0));
    Panel::bottom("tabs").exact_size(STRIP).frame(strip).show(ui, |ui| {
        ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
            let tight = ui.available_width() < TIGHT;
            if tight {
                (ui.spacing_mut().item_spacing.x, ui.spacing_mut().button_padding.x) = (3.0, 4.0);
            }
            for (tab, title, tip) in TABS {
                let open = m.drawer == Some(tab);
                let button = Button::selectable(open, title).frame_when_inactive(true);
                let button = ui.add(button);
                mark(ui, button.rect, |what| {
                    what.strip_prefix("drawer:").is_some_and(|tab| tab.eq_ignore_ascii_case(title))
                });
                if button.on_hover_text(tip).clicked() {
                    m.drawer = if open { None } else { Some(tab) };
                }
            }
            if tight {
                return;
            }
            ui.separator();
            if ui.button("Lessons").on_hover_text("The start screen: lessons, recent files, gallery (F8).").clicked() {
                m.toggle_start();
            }
            let tip =
                "Shadow maps in a world of two dimensions: turn the light's film and see what each angle costs (F5).";
            if ui.button("Flatland").on_hover_text(tip).clicked() {
                m.toggle_lab();
            }
        });
    });
    let Some(tab) = m.drawer else { return };
    let room = ui.available_height();
    let most = (room - PICTURE).max(room * 0.5);
    let body = Panel::bottom("drawer").resizable(true).default_size(room * SHARE).size_range(most.min(140.0)..=most);
    let frame =
        Frame::new().fill(ui.visuals().panel_fill).inner_margin(Margin { left: 10, right: 6, top: 6, bottom: 4 });
    body.frame(frame).show(ui, |ui| {
        let rest = ui.available_rect_before_wrap();
        within(ui, rest, |ui| match tab {
            Tab::Chart => sweep::show(ui, m, out),
            Tab::Stability => timeline::show(ui, m, out),
            Tab::Advice => advice::show(ui, m, out),
            Tab::Pixel => inspect::show(ui, m, out),
            Tab::Figure => sheets::show(ui, m, out),
        });
        ui.allocate_rect(rest, Sense::hover());
    });
}

/// Draws into a rectangle, beyond which nothing reaches.
fn within(ui: &mut Ui, rect: Rect, add: impl FnOnce(&mut Ui)) {
    let mut inside = ui.new_child(UiBuilder::new().max_rect(rect));
    inside.shrink_clip_rect(rect);
    add(&mut inside);
}

/// What is drawn of a tab's part.
pub type Part = fn(&mut Ui, &mut Model, &mut Vec<Action>);

/// A chart with a column of controls beside it, or under it where the drawer is narrow.
pub fn beside(ui: &mut Ui, m: &mut Model, out: &mut Vec<Action>, chart: Part, controls: Part) {
    let rest = ui.available_rect_before_wrap();
    if rest.width() < NARROW {
        scrolled("narrow").show(ui, |ui| {
            controls(ui, m, out);
            let size = vec2(ui.available_width(), (rest.height() - 20.0).max(230.0));
            let (_, rect) = ui.allocate_space(size);
            within(ui, rect, |ui| chart(ui, m, out));
        });
        return;
    }
    let middle = rest.right() - SIDE;
    let [left, right] = [rest.with_max_x(middle - 10.0), rest.with_min_x(middle)];
    within(ui, left, |ui| chart(ui, m, out));
    within(ui, right, |ui| {
        scrolled("controls").show(ui, |ui| controls(ui, m, out));
    });
}

/// A part that scrolls. The bar is always there: nothing is wrapped anew when there is more to show.
fn scrolled(name: &str) -> ScrollArea {
    let area = ScrollArea::vertical().id_salt(name).auto_shrink([false, false]);
    area.scroll_bar_visibility(ScrollBarVisibility::AlwaysVisible)
}

/// What runs and how far it is, with a button that ends it; two lines high.
pub fn progress(ui: &mut Ui, job: &Job, out: &mut Vec<Action>) {
    ui.horizontal(|ui| {
        let bar = ProgressBar::new(job.done).desired_width((ui.available_width() - 64.0).max(60.0));
        ui.add(bar.text(RichText::new(job.told()).size(12.0)));
        if ui.button("Cancel").on_hover_text("Stop. What is measured so far stays.").clicked() {
            out.push(Action::CancelMeasuring);
        }
    });
    let what = if job.what.is_empty() { job.title.to_string() } else { format!("{}: {}", job.title, job.what) };
    line(ui, &what);
}

/// A line of small grey text that never breaks.
pub fn line(ui: &mut Ui, text: &str) {
    ui.add(Label::new(RichText::new(text).small().weak()).truncate());
}

/// Chips for the techniques that take part; those that do not serve the light are left out.
pub fn pick_techniques(ui: &mut Ui, m: &mut Model) {
    ui.horizontal(|ui| {
        ui.label(RichText::new("techniques").small().weak());
        if ui.small_button("all").on_hover_text("Take all that serve the light.").clicked() {
            m.left_out = BTreeSet::new();
        }
        if ui.small_button("none").on_hover_text("Leave all out.").clicked() {
            m.left_out = techniques::ALL.iter().map(|i| i.id).collect();
        }
    });
    let serving: Vec<_> = techniques::ALL.iter().filter(|i| m.setup.refusal(i).is_none()).collect();
    let items = serving.iter().map(|i| (i.id, !m.left_out.contains(i.id), format!("{}\n{}", i.title, i.doc)));
    // As many as there is room for above what stands below them; the others are scrolled to.
    let list = ScrollArea::vertical().id_salt("techniques").max_height(MOST_CHIPS);
    if let Some(i) = list.show(ui, |ui| chips(ui, items)).inner
        && !m.left_out.remove(serving[i].id)
    {
        m.left_out.insert(serving[i].id);
    }
}

/// A menu that writes a tab's chart or figures; `stem`: the file's name without its ending.
pub fn export(ui: &mut Ui, tab: Tab, stem: &str, ready: bool, out: &mut Vec<Action>) {
    ui.add_enabled_ui(ready, |ui| {
        let menu = ui.menu_button("Export", |ui| {
            for (ending, what) in [
                ("svg", "The chart, for papers."),
                ("png", "The chart as a picture."),
                ("csv", "The figures as a table."),
                ("json", "The figures with all their names."),
            ] {
                let file = format!("{stem}.{ending}");
                if ui
                    .button(ending.to_uppercase())
                    .tip_beside(ui.max_rect(), format!("{what} Writes {file}."))
                    .clicked()
                {
                    out.push(Action::Export(tab, PathBuf::from(file)));
                }
            }
        });
        menu.response.on_hover_text("Write the chart (SVG, PNG) or its figures (CSV, JSON) into a file.");
    });
}

/// The size that everything is measured and captured at.
pub fn size(ui: &mut Ui, m: &mut Model) {
    let tip = "Width and height of the picture that is measured, in pixels: one size for all figures and captures.";
    ui.horizontal(|ui| {
        ui.label(RichText::new("at").small().weak());
        for (i, what) in ["width", "height"].into_iter().enumerate() {
            if i > 0 {
                ui.label("×");
            }
            let drag = DragValue::new(&mut m.setup.size[i]).range(1..=crate::setup::MAX_SIZE);
            let field = ui.add_sized([52.0, 21.0], drag).on_hover_text(tip);
            field.widget_info(|| WidgetInfo::labeled(Role::SpinButton, true, format!("measured {what}")));
        }
        ui.label(RichText::new("pixels").small().weak()).on_hover_text(tip);
    });
}
