//! Techniques side by side: which there are, which one the panel edits, and what stands over their parts of the picture.

use super::controls::{Tip, chips};
use super::model::Model;
use super::style::ACCENT;
use crate::frame::{Pane, panes, technique_ms};
use crate::legend::{letter, percent, side_name};
use crate::params::{Spec, Value};
use crate::setup::{Arrange, Setup, Side};
use crate::techniques;
use egui::{
    Button, Color32, CursorIcon, Frame, Id, Margin, Pos2, Rect, RichText, Role, Sense, Stroke, Ui, UiBuilder,
    WidgetInfo, pos2, vec2,
};
use std::collections::BTreeMap;

/// The rows over the list of techniques: a chip for each side, one that adds a side, and how they share the picture.
pub fn show(ui: &mut Ui, m: &mut Model) {
    let sides = m.setup.sides();
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing = vec2(4.0, 4.0);
        for side in 0..sides {
            let name = if sides > 1 { short_name(&m.setup, side) } else { "A".into() };
            let chip = Button::selectable(m.editing == side && sides > 1, name).frame_when_inactive(true);
            let tip = "What stands below is of this side: technique, maps, parameters and figures.";
            if sides > 1 && ui.add(chip).tip(tip).clicked() {
                m.editing = side;
            }
            if side > 0 && ui.small_button("×").tip("Take this side away.").clicked() {
                m.remove_side(side);
                return;
            }
        }
        if sides < 4 {
            let title = if sides == 1 { "Compare with …" } else { "+" };
            ui.menu_button(title, |ui| add_menu(ui, m)).response.tip(
                "Another technique, other parameters of the same one, or the truth, beside this one in the picture.",
            );
        }
    });
    if sides > 1 {
        let now = m.setup.arrange;
        let tips = [
            "The first left of a line that can be dragged, the second right of it.",
            "Each in a part of its own, with the same camera.",
            "One at a time, at the same pixels: X changes.",
        ];
        let items = Arrange::ALL.into_iter().zip(["Swipe", "Side by side", "Flicker"]).zip(tips);
        let difference = m.setup.view == "difference";
        let items = items.map(|((a, title), tip)| (title, a == now && !difference, tip.to_string()));
        let difference = ("A − B", difference, "The difference of the first two (B).".to_string());
        match chips(ui, items.chain([difference])) {
            Some(3) => m.toggle_difference(),
            Some(i) => {
                m.setup.arrange = Arrange::ALL[i];
                if m.setup.view == "difference" {
                    m.toggle_difference();
                }
            }
            None => {}
        }
    }
}

/// Values of the side that the edited one is held against, which is the first, or for that the second: with its letter.
pub fn other_values(m: &Model) -> BTreeMap<String, (&'static str, Value)> {
    let side = if m.editing == 0 { 1 } else { 0 };
    if side >= m.setup.sides() || m.setup.is_truth(side) {
        return BTreeMap::new();
    }
    let setup = m.setup.side(side);
    let of = |(name, value): (&String, &Value)| (name.clone(), (letter(side), value.clone()));
    setup.values().iter().map(of).collect()
}

/// Marks a parameter's row whose value differs from the other side's.
pub fn differs(ui: &mut Ui, row: Rect, spec: &Spec, tip: &str) {
    let place = Rect::from_center_size(pos2(row.left() - 4.0, row.center().y), vec2(9.0, row.height()));
    let r = ui.interact(place, ui.scope_id().with(("differs", spec.name)), Sense::hover());
    r.widget_info(|| WidgetInfo::labeled(Role::Image, true, format!("{} differs: {tip}", spec.name)));
    ui.painter().circle_filled(place.center(), 2.5, ui.visuals().hyperlink_color);
    r.tip(tip);
}

/// A side's letter and its technique's id.
pub fn short_name(setup: &Setup, side: usize) -> String {
    let id = if setup.is_truth(side) { Side::TRUTH.into() } else { setup.side(side).technique };
    format!("{} {id}", letter(side))
}

/// What can be set beside the present technique.
fn add_menu(ui: &mut Ui, m: &mut Model) {
    let mut chosen = None;
    let now = m.setup.side(m.editing);
    if ui.button("Truth").tip("The ray-traced shadow.").clicked() {
        chosen = Side::new(Side::TRUTH).ok();
    }
    let title = techniques::find(&now.technique).map_or("", |i| i.title);
    if ui.button(format!("{title}, other parameters")).tip("A copy to be changed.").clicked() {
        chosen = Some(Side { technique: now.technique.clone(), params: now.values().clone() });
    }
    ui.separator();
    for info in techniques::ALL.iter().filter(|i| i.id != now.technique) {
        let served = m.refusal(info);
        let button = ui.add_enabled(served.is_none(), Button::new(info.title));
        if button.tip(info.doc).tip_disabled(served.unwrap_or_default()).clicked() {
            chosen = m.setup.kept(info.id).ok();
        }
    }
    if let Some(side) = chosen {
        m.add_side(side);
        ui.close();
    }
}

/// A side's part of the viewport.
pub struct Part {
    pub side: usize,
    /// What of it is seen, and where all of its picture would lie.
    pub seen: Rect,
    pub whole: Rect,
}

/// The parts of a viewport.
pub fn parts(rect: Rect, setup: &Setup) -> Vec<Part> {
    // In parts of the viewport: panes know whole pixels only.
    const PARTS: u32 = 4000;
    let place = |[x, y]: [u32; 2]| rect.min + rect.size() * vec2(x as f32, y as f32) / PARTS as f32;
    let part = |pane: Pane| {
        let [x, y] = pane.at;
        let seen = Rect::from_min_max(place(pane.at), place([x + pane.part[2], y + pane.part[3]]));
        let from = place([x - pane.part[0].min(x), y - pane.part[1].min(y)]);
        let size = rect.size() * vec2(pane.size[0] as f32, pane.size[1] as f32) / PARTS as f32;
        Part { side: pane.side, seen, whole: Rect::from_min_size(from, size) }
    };
    panes(setup, [PARTS; 2]).into_iter().map(part).collect()
}

/// Where all of the first side's picture would lie.
pub fn first(rect: Rect, setup: &Setup) -> Rect {
    parts(rect, setup).iter().find(|p| p.side == 0).map_or(rect, |p| p.whole)
}

/// The titles of the sides over their parts of the picture, with menus, and the swipe's line; `free`: what no legend hides.
pub fn over(ui: &mut Ui, rect: Rect, free: Rect, m: &mut Model) {
    if m.setup.sides() == 1 {
        return;
    }
    let difference = m.setup.view == "difference";
    if m.setup.arrange == Arrange::Swipe && m.setup.sides() == 2 && !difference {
        line(ui, free, m);
    }
    for Part { side, seen: part, .. } in parts(rect, &m.setup) {
        let part = part.intersect(free);
        if difference {
            title(ui, part, m, 0);
            title(ui, part.translate(vec2(0.0, 28.0)), m, 1);
        } else {
            title(ui, part, m, side);
        }
        if part.left() > rect.left() && m.setup.arrange == Arrange::SideBySide {
            let line = Stroke::new(2.0, Color32::from_gray(20));
            ui.painter().with_clip_rect(rect).line_segment([part.left_top(), part.left_bottom()], line);
        }
    }
}

/// Height that the titles of the sides take at the picture's upper edge.
pub fn titles_height(setup: &Setup) -> f32 {
    match setup.sides() {
        1 => 0.0,
        _ if setup.view == "difference" => 60.0,
        _ => 32.0,
    }
}

/// A side's name with a menu of techniques, its error, its time and the ratio to the first one's.
fn title(ui: &mut Ui, part: Rect, m: &mut Model, side: usize) {
    if part.width() < 60.0 || part.height() < 40.0 {
        return;
    }
    let inside = part.shrink2(vec2(8.0, 8.0));
    let mut child = ui.new_child(UiBuilder::new().max_rect(inside).id_salt(("side", side)));
    child.shrink_clip_rect(part);
    Frame::new().fill(Color32::from_black_alpha(165)).corner_radius(3.0).inner_margin(Margin::symmetric(5, 2)).show(
        &mut child,
        |ui| {
            // Over the picture all is written light on dark.
            ui.set_style(ui.ctx().style_of(egui::Theme::Dark));
            ui.horizontal(|ui| {
                ui.spacing_mut().item_spacing.x = 8.0;
                let color = if side == m.editing { ACCENT } else { Color32::WHITE };
                // A narrow part has room for the id only.
                let full = part.width() > 560.0;
                let name = if full { side_name(&m.setup, side) } else { short_name(&m.setup, side) };
                let name = RichText::new(name).color(color);
                ui.menu_button(name, |ui| side_menu(ui, m, side)).response.on_hover_text("What is shown on this side.");
                let info = if m.setup.is_truth(side) { None } else { techniques::find(&m.setup.side(side).technique) };
                if let Some(reason) = info.and_then(|i| i.refuses(&m.setup.light)) {
                    let text = RichText::new("no shadow").color(ui.visuals().warn_fg_color);
                    ui.label(text).on_hover_text(reason);
                }
                let shown = m.setup.overlay.as_ref().map_or(&m.setup.view, |o| &o.view);
                let has = m.setup.view_of(side, shown).is_some();
                if let (false, Some(view)) = (has, m.setup.find_view(shown)) {
                    let text = RichText::new(format!("has no {}: shaded", view.title.to_lowercase()));
                    ui.label(text.color(ui.visuals().warn_fg_color));
                }
                let error = m.facts.known.errors.get(side).copied().flatten();
                if let Some(e) = error.filter(|_| !m.setup.is_truth(side)) {
                    let light = if m.setup.light_count() > 1 {
                        format!(" of light {}", m.setup.light_number)
                    } else {
                        String::new()
                    };
                    ui.label(RichText::new(format!("{} wrong{light}", percent(e.share()))).color(Color32::WHITE));
                }
                if let Some(ms) = side_ms(m, side) {
                    let ratio = side_ms(m, 0).filter(|first| side > 0 && *first > 0.0);
                    let ratio = ratio.map_or(String::new(), |first| format!(" · {:.2} × A", ms / first));
                    ui.label(RichText::new(format!("{ms:.1} ms{ratio}")).weak());
                }
            });
        },
    );
}

/// Milliseconds of a side's technique in the last frame.
fn side_ms(m: &Model, side: usize) -> Option<f64> {
    let told = m.facts.told.sides.get(side).filter(|s| !s.passes.is_empty())?;
    Some(technique_ms(&told.passes))
}

fn side_menu(ui: &mut Ui, m: &mut Model, side: usize) {
    if ui.button("Edit in the panel").clicked() {
        m.editing = side;
        ui.close();
    }
    if side > 0 && ui.button("Take away").clicked() {
        m.remove_side(side);
        ui.close();
        return;
    }
    ui.separator();
    if side > 0 && ui.selectable_label(m.setup.is_truth(side), "Truth").clicked() {
        m.set_side(side, Side::TRUTH);
        ui.close();
    }
    for info in techniques::ALL.iter() {
        let chosen = !m.setup.is_truth(side) && m.setup.side(side).technique == info.id;
        let served = m.refusal(info);
        let button = ui.add_enabled(served.is_none(), Button::selectable(chosen, info.title));
        if button.on_disabled_hover_text(served.unwrap_or_default()).clicked() {
            m.set_side(side, info.id);
            ui.close();
        }
    }
}

/// The line of the swipe, which can be dragged.
fn line(ui: &mut Ui, rect: Rect, m: &mut Model) {
    let x = rect.left() + rect.width() * m.setup.split;
    let handle = Rect::from_center_size(pos2(x, rect.center().y), vec2(12.0, rect.height()));
    let r = ui.interact(handle, Id::unique("split line"), Sense::drag());
    if r.hovered() || r.dragged() {
        ui.set_cursor_icon(CursorIcon::ResizeHorizontal);
    }
    if r.dragged()
        && let Some(at) = r.interact_pointer_pos()
    {
        m.setup.split = ((at.x - rect.left()) / rect.width()).clamp(0.0, 1.0);
    }
    let painter = ui.painter().with_clip_rect(rect);
    let x = rect.left() + rect.width() * m.setup.split;
    let stroke = Stroke::new(1.5, if r.hovered() || r.dragged() { ACCENT } else { Color32::WHITE });
    painter.line_segment([pos2(x, rect.top()), pos2(x, rect.bottom())], stroke);
    painter.circle(Pos2::new(x, rect.center().y), 6.0, Color32::from_black_alpha(160), stroke);
}
