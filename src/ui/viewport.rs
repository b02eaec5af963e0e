//! The viewport: camera by mouse and keys, the split line, and what is written over the picture.

use super::model::{Action, Model, Reading, Tab, Traced};
use super::style::{ACCENT, TEXT};
use super::{compare, cropping, freeze, gizmo, inspect, legend, maps};
use crate::view;
use egui::{Align2, Color32, CursorIcon, Event, FontId, Id, Key, PointerButton, Pos2, Rect, Response, Sense, Ui, vec2};

/// Radians that a drag of one point turns.
const TURN: f32 = 0.006;

/// Handles input on the viewport and draws over its picture.
pub fn show(ui: &mut Ui, rect: Rect, m: &mut Model, out: &mut Vec<Action>) {
    inspect::follow(compare::first(rect, &m.setup), m);
    let r = ui.interact(rect, Id::unique("viewport"), Sense::click_and_drag());
    m.builder.marking &= m.drawer == Some(Tab::Figure);
    if m.cropping || m.builder.marking {
        cropping::drag(ui, rect, &r, m);
        cropping::insets(ui, rect, m);
        tracing(ui, rect, m);
        return draft(ui, rect, m);
    }
    // While a lesson's next scene is on its way the picture is still of the one before.
    if m.loading.is_some() && m.lesson.as_ref().is_some_and(|lesson| lesson.came.is_none()) {
        ui.painter().rect_filled(rect, 0.0, ui.visuals().panel_fill);
        return;
    }
    let camera = &mut m.setup.camera;
    let moved = r.drag_delta();
    if r.dragged_by(PointerButton::Primary) {
        camera.orbit(moved.x * TURN, moved.y * TURN);
    } else if r.dragged_by(PointerButton::Secondary) {
        camera.look(moved.x * TURN * 0.7, -moved.y * TURN * 0.7);
    } else if r.dragged_by(PointerButton::Middle) {
        let (right, up) = camera.axes();
        let scale = camera.metres_per_point(camera.reach(), rect.height());
        camera.shift((up * moved.y - right * moved.x) * scale);
    }
    if r.dragged() {
        ui.ctx().set_cursor_icon(CursorIcon::Grabbing);
    }
    if r.contains_pointer() {
        let (wheel, alt) = ui.input(|i| (i.smooth_scroll_delta.y, i.modifiers.alt));
        let turned = ui.input(|i| {
            i.events.iter().find_map(|e| match e {
                Event::MouseWheel { delta, .. } if delta.y != 0.0 => Some(delta.y > 0.0),
                _ => None,
            })
        });
        match (alt && m.inspect.magnifier.on, turned) {
            (true, Some(larger)) => m.inspect.magnifier.step(larger),
            (true, None) => {}
            (false, _) if wheel != 0.0 => camera.dolly((-wheel * 0.004).exp()),
            _ => {}
        }
    }
    read(ui, rect, r.hover_pos().filter(|_| !r.dragged()), m, out);
    if r.double_clicked()
        && let Some(at) = r.interact_pointer_pos()
    {
        let at = (at - rect.min) / rect.size();
        out.push(Action::Focus([at.x, at.y]));
    }
    pick(ui, rect, &r, m, out);
    inspect::pick(ui, rect, &r, m);
    fly(ui, m);
    m.maps.pointed = r.hover_pos().and_then(|p| {
        let part = compare::parts(rect, &m.setup).into_iter().find(|part| part.seen.contains(p))?;
        let at = (p - part.whole.min) / part.whole.size();
        Some([at.x, at.y])
    });
    maps::marks(ui, rect, m);
    cropping::outside(ui, rect, m);
    if let Some(first) = compare::parts(rect, &m.setup).into_iter().find(|part| part.side == 0) {
        inspect::over(ui, first.whole, first.seen, m);
    }
    if m.drawer == Some(Tab::Figure) {
        cropping::insets(ui, rect, m);
    }
    tracing(ui, rect, m);
    let free = legend::show(ui, rect, m);
    draft(ui, free, m);
    compare::over(ui, rect, free, m);
    gizmo::show(ui, compare::first(rect, &m.setup), free, m);
    if m.inspect.picking {
        label(ui, rect, rect.center_top() + vec2(0.0, 12.0), Align2::CENTER_TOP, inspect::PICKING);
    }
    inspect::magnify(ui, rect, r.hover_pos().filter(|_| !r.dragged()), m);
    if m.setup.shadow_camera.is_some() {
        label(ui, rect, free.center_bottom() - vec2(0.0, 12.0), Align2::CENTER_BOTTOM, freeze::FROZEN);
    }
    if let Some(reason) = m.setup.refusal(m.info()) {
        let text = format!("{reason}: drawn without shadow");
        label(ui, rect, rect.center_top() + vec2(0.0, 40.0), Align2::CENTER_TOP, &text);
    }
}

/// Reads the view's value under the pointer, while the picture is at rest.
fn read(ui: &Ui, rect: Rect, pointer: Option<Pos2>, m: &mut Model, out: &mut Vec<Action>) {
    let shown = m.setup.overlay.as_ref().map_or(&m.setup.view, |o| &o.view);
    // Scene data have none, and what is shaded.
    let valued = view::index(shown).is_none() || view::needs_truth(shown) || shown == "visibility";
    let traced = !m.setup.needs_truth() || m.facts.traced == Traced::Fully;
    let rest = !m.draft() && !m.moving() && m.measuring.is_none();
    let (Some(pointer), true) = (pointer, valued && traced && rest) else { return };
    let at = (pointer - rect.min) / rect.size();
    let at = [at.x, at.y];
    match m.reading.as_ref().filter(|r| r.at == at) {
        None => {
            m.reading = Some(Reading { at, text: None });
            out.push(Action::Read(at));
        }
        Some(reading) => {
            // The magnifier says it below its glass.
            if let Some(text) = reading.text.as_ref().filter(|_| !m.inspect.magnifier.on) {
                let left = pointer.x > rect.center().x;
                let align = if left { Align2::RIGHT_BOTTOM } else { Align2::LEFT_BOTTOM };
                let offset = if left { vec2(-14.0, -14.0) } else { vec2(14.0, -14.0) };
                let place = (pointer + offset).clamp(rect.min + vec2(0.0, 22.0), rect.max);
                label(ui, rect, place, align, text);
            }
        }
    }
}

/// Picks the plane of interest by the next click, until Escape.
fn pick(ui: &Ui, rect: Rect, r: &Response, m: &mut Model, out: &mut Vec<Action>) {
    m.picking &= m.has_plane() && !ui.input(|i| i.key_pressed(Key::Escape));
    if !m.picking {
        return;
    }
    if r.contains_pointer() {
        ui.ctx().set_cursor_icon(CursorIcon::Crosshair);
    }
    if let Some(at) = r.interact_pointer_pos().filter(|_| r.clicked()) {
        let at = (at - rect.min) / rect.size();
        out.push(Action::PickPlane([at.x, at.y]));
        m.picking = false;
    }
    label(ui, rect, rect.center_top() + vec2(0.0, 12.0), Align2::CENTER_TOP, PICKING);
}

/// What is said while a plane is picked.
const PICKING: &str = "Click a surface to pick its plane. Escape: cancel.";

/// Flies with W A S D and Q E; Shift is faster.
fn fly(ui: &Ui, m: &mut Model) {
    let keys = [Key::W, Key::S, Key::D, Key::A, Key::E, Key::Q];
    let heard = !ui.ctx().egui_wants_keyboard_input() && m.picker.is_none() && !m.closing;
    let (down, fast, seconds) = ui.input(|i| {
        for event in &i.events {
            // Of a shortcut the key may be up later than Ctrl.
            if let Event::Key { key, pressed: true, repeat: false, modifiers, .. } = event {
                m.flying.extend(keys.contains(key).then_some(*key).filter(|_| heard && !modifiers.command));
            }
        }
        m.flying.retain(|k| heard && i.key_down(*k));
        (keys.map(|k| m.flying.contains(&k)), i.modifiers.shift, i.stable_dt.min(0.2))
    });
    if down.iter().any(|d| *d) {
        let axis = |plus: usize, minus: usize| down[plus] as i32 as f32 - down[minus] as i32 as f32;
        let speed = m.setup.camera.reach().clamp(m.diagonal() * 0.01, m.diagonal()) * if fast { 3.0 } else { 0.8 };
        let camera = &mut m.setup.camera;
        let (right, up) = camera.axes();
        let direction = camera.forward() * axis(0, 1) + right * axis(2, 3) + up * axis(4, 5);
        camera.shift(direction * speed * seconds);
        ui.ctx().request_repaint();
    }
}

/// How far the exact shadow is traced: a thin bar along the upper edge.
fn tracing(ui: &Ui, rect: Rect, m: &Model) {
    if let (Traced::Partly(progress), false) = (m.facts.traced, m.draft()) {
        let bar = Rect::from_min_size(rect.min, vec2(rect.width(), 3.0));
        let painter = ui.painter().with_clip_rect(rect);
        painter.rect_filled(bar, 0.0, Color32::from_black_alpha(90));
        painter.rect_filled(bar.with_max_x(rect.left() + rect.width() * progress.done), 0.0, ACCENT);
    }
}

/// Says that the picture has fewer pixels than it will have.
fn draft(ui: &Ui, rect: Rect, m: &Model) {
    if !m.draft() {
        return;
    }
    let [width, height] = m.facts.size;
    let waits = if m.facts.waits { "; this view waits for the full resolution" } else { "" };
    let text = format!("draft {width} × {height}, refining{waits}");
    label(ui, rect, rect.right_bottom() - vec2(12.0, 12.0), Align2::RIGHT_BOTTOM, &text);
}

/// Text on a dark ground over the picture.
fn label(ui: &Ui, clip: Rect, at: Pos2, align: Align2, text: &str) {
    let painter = ui.painter().with_clip_rect(clip);
    let galley = painter.layout_no_wrap(text.into(), FontId::proportional(13.0), TEXT);
    let place = align.anchor_size(at, galley.size());
    painter.rect_filled(place.expand2(vec2(5.0, 2.0)), 3.0, Color32::from_black_alpha(150));
    painter.galley(place.min, galley, TEXT);
}
