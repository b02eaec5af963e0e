//! The part of the picture that captures show: its numbers, and how it is dragged out in the picture.

use super::controls::{HEIGHT, Tip, field, row, steady};
use super::model::Model;
use super::sheets;
use super::style::ACCENT;
use egui::{
    Button, Color32, CursorIcon, DragValue, Id, Key, PointerButton, Pos2, Rect, Response, Stroke, StrokeKind, Ui,
};
use egui::{pos2, vec2};

const TIP: &str =
    "The part of the picture that the file shows. All of the picture is drawn, so that its shadows are the same.";

/// The rows of the section on captures.
pub fn rows(ui: &mut Ui, m: &mut Model) {
    row(ui, "crop", TIP, |ui, _| {
        let drag = Button::selectable(m.cropping, "From the picture").frame_when_inactive(true);
        let tip = "Drag a rectangle in the picture, which takes the shape of the captured one. Escape: cancel.";
        if ui.add_sized([118.0, HEIGHT], drag).tip(tip).clicked() {
            m.cropping ^= true;
            m.framed |= m.cropping;
        }
        let all = ui.add_enabled(m.setup.crop.is_some(), Button::new("All of it"));
        if all.tip("The file shows the whole picture.").clicked() {
            m.setup.crop = None;
        }
    });
    steady(ui, "crop", m.still, |ui| {
        if m.setup.crop.is_none() {
            return;
        }
        let size = m.setup.size;
        let mut part = m.setup.part();
        let before = part;
        for (name, first) in [("left, top", 0), ("width, height", 2)] {
            row(ui, name, TIP, |ui, label| {
                let gap = ui.spacing().item_spacing.x;
                let width = (ui.available_width() - gap) / 2.0 - 2.0;
                for (i, side) in (first..).zip(size) {
                    let range = if first == 0 { 0..=side - 1 } else { 1..=side };
                    let drag = DragValue::new(&mut part[i]).range(range).suffix(" px");
                    field(ui, width, drag, ["Left edge", "Upper edge", "Width", "Height"][i]).labelled_by(label.id);
                }
            });
        }
        if part != before {
            m.setup.crop_to(part);
        }
    });
}

/// Where the captured picture lies over the viewport's: both have the same middle and show the same from top to bottom.
fn captured(rect: Rect, [width, height]: [u32; 2]) -> Rect {
    Rect::from_center_size(rect.center(), vec2(rect.height() * width as f32 / height as f32, rect.height()))
}

/// Takes a rectangle that is dragged out in the viewport, as the crop or as an inset of a sheet.
pub fn drag(ui: &Ui, rect: Rect, r: &Response, m: &mut Model) {
    if ui.input(|i| i.key_pressed(Key::Escape)) {
        (m.cropping, m.builder.marking) = (false, false);
        return;
    }
    if r.contains_pointer() {
        ui.ctx().set_cursor_icon(CursorIcon::Crosshair);
    }
    let id = Id::unique("a corner of the crop");
    if r.drag_started_by(PointerButton::Primary)
        && let Some(at) = ui.input(|i| i.pointer.press_origin())
    {
        ui.data_mut(|d| d.insert_temp(id, at));
    }
    let (Some(from), Some(to)) = (ui.data(|d| d.get_temp::<Pos2>(id)), r.interact_pointer_pos()) else { return };
    let whole = captured(rect, m.setup.size);
    let pixel = |at: Pos2| {
        let at = (at - whole.min) / whole.size();
        [(at.x, m.setup.size[0]), (at.y, m.setup.size[1])]
            .map(|(share, side)| (share.clamp(0.0, 1.0) * side as f32).round() as u32)
    };
    let ([x0, y0], [x1, y1]) = (pixel(from), pixel(to));
    let part = [x0.min(x1), y0.min(y1), x0.abs_diff(x1), y0.abs_diff(y1)];
    if r.drag_stopped() {
        ui.data_mut(|d| d.remove::<Pos2>(id));
        // Less is a slip of the hand.
        if part[2] > 1 && part[3] > 1 {
            if m.builder.marking {
                sheets::add(m, within(part, m.setup.part()));
            } else {
                m.setup.crop_to(part);
                m.cropping = false;
            }
        }
    } else if r.dragged_by(PointerButton::Primary) {
        frame(ui, rect, whole, part, m.setup.size);
    }
}

/// A rectangle as shares of the part that captures show.
fn within([x, y, w, h]: [u32; 4], [left, top, width, height]: [u32; 4]) -> [f64; 4] {
    let share = |from: u32, length: u32, first: u32, all: u32| {
        let end = (from + length).clamp(first + 1, first + all) - first;
        let start = from.clamp(first, first + all - 1) - first;
        [f64::from(start) / f64::from(all), f64::from(end.max(start + 1) - start) / f64::from(all)]
    };
    let ([x, w], [y, h]) = (share(x, w, left, width), share(y, h, top, height));
    [x, y, w, h]
}

/// Shows a sheet's insets over the picture.
pub fn insets(ui: &Ui, rect: Rect, m: &Model) {
    let whole = captured(rect, m.setup.size);
    let [x, y, w, h] = m.setup.part().map(|pixels| pixels as f32);
    let scale = whole.size() / vec2(m.setup.size[0] as f32, m.setup.size[1] as f32);
    let part = Rect::from_min_size(whole.min + vec2(x, y) * scale, vec2(w, h) * scale);
    sheets::frames(&ui.painter().with_clip_rect(rect), part, m);
}

/// Shows what the crop leaves out, while the picture has the captured one's shape.
pub fn outside(ui: &Ui, rect: Rect, m: &Model) {
    if m.framed && m.setup.crop.is_some() {
        frame(ui, rect, captured(rect, m.setup.size), m.setup.part(), m.setup.size);
    }
}

/// Darkens what lies outside a part of the picture.
fn frame(ui: &Ui, clip: Rect, whole: Rect, [x, y, w, h]: [u32; 4], size: [u32; 2]) {
    let at = |x: u32, y: u32| whole.min + whole.size() * vec2(x as f32 / size[0] as f32, y as f32 / size[1] as f32);
    let part = Rect::from_min_max(at(x, y), at(x + w, y + h));
    let painter = ui.painter().with_clip_rect(clip);
    let dark = Color32::from_black_alpha(120);
    let (left, right) = (part.left(), part.right());
    for rest in [
        clip.with_max_y(part.top()),
        clip.with_min_y(part.bottom()),
        Rect::from_min_max(pos2(clip.left(), part.top()), pos2(left, part.bottom())),
        Rect::from_min_max(pos2(right, part.top()), pos2(clip.right(), part.bottom())),
    ] {
        if rest.is_positive() {
            painter.rect_filled(rest, 0.0, dark);
        }
    }
    painter.rect_stroke(part, 0.0, Stroke::new(1.0, ACCENT), StrokeKind::Outside);
}
