//! What is dragged in the world: films at the light, eye, view, light, and the ends of segments.

use super::found::metric;
use super::ground::{Drag, FARTHEST, Placed, RAYS, frusta, part_color, round_place};
use super::{Lab, short_name, tint};
use crate::flatland::Film;
use crate::ui::style::SUN;
use egui::{
    Align2, Color32, CursorIcon, FontId, Id, Painter, Pos2, Rect, Response, Role, Sense, Stroke, Ui, WidgetInfo, vec2,
};
use glam::DVec2;
use std::f64::consts::PI;

/// Segments whose ends all have handles; of more only those of the selected one.
const HANDLED: usize = 40;
/// From the eye to the handles of gaze and view, points.
const REACH: f64 = 84.0;

/// Films at the light as lines of lexels, and the handle that turns them.
pub fn films(ui: &mut Ui, painter: &Painter, placed: &Placed, lab: &mut Lab, film: &Film) {
    let (world, scale) = (lab.now.world.clone(), placed.view.scale);
    let nearest = film.samples.iter().map(|s| s.point.distance(world.light)).fold(f64::INFINITY, f64::min);
    // The line's distance from the light: not so far that it reaches what is lit, nor too long.
    let away = |hull: [f64; 2], normal: f64| {
        let width = (hull[1] - normal).tan() - (hull[0] - normal).tan();
        (150.0 / scale / width).min(0.4 * nearest).max(6.0 / scale)
    };
    let ends = |hull: [f64; 2], normal: f64, away: f64| {
        let (axis, middle) = (DVec2::from_angle(normal), world.light + DVec2::from_angle(normal) * away);
        hull.map(|a| middle + axis.perp() * (away * (a - normal).tan()))
    };
    let line = |a: DVec2, b: DVec2, stroke: Stroke| {
        for line in placed.lines(&world, a, b) {
            painter.line_segment(line, stroke);
        }
    };
    let hull = [film.bottom, film.top];
    if lab.now.show.all_films && lab.found.parts.is_empty() {
        for (choice, row) in lab.found.rows.iter().filter(|(c, _)| *c != lab.now.film) {
            let (axis, tint) = (DVec2::from_angle(row.normal), tint(ui, *choice));
            let middle = world.light + axis * (14.0 / scale);
            let along = axis.perp() * (38.0 / scale);
            line(middle - along, middle + along, Stroke::new(1.2, tint.gamma_multiply(0.85)));
        }
    }
    for (hull, normal, lexels, part) in frusta(&lab.found, film, world.lexels) {
        let tint = part.map_or(ui.visuals().strong_text_color(), |i| part_color(ui, i));
        let away = away(hull, normal);
        let [a, b] = ends(hull, normal, away);
        line(a, b, Stroke::new(2.5, tint));
        let stride = lexels.div_ceil(RAYS).max(1);
        let side = DVec2::from_angle(normal) * (4.0 / scale);
        for j in (0..=lexels).step_by(stride) {
            let at = a + (b - a) * (j as f64 / lexels as f64);
            line(at - side, at + side, Stroke::new(1.0, tint));
        }
    }
    let Some(row) = lab.found.chosen.clone().filter(|_| lab.found.parts.is_empty()) else { return };
    let distance = away(hull, row.normal);
    let axis = DVec2::from_angle(row.normal);
    let middle = world.light + axis * distance;
    // Beyond the upper end, unless that is far off or out of sight.
    let [low, high] = hull.map(|a| distance * (a - row.normal).tan());
    let knobs = [(high, 1.0), (low, -1.0)].map(|(end, side)| {
        let point = |gap: f64| middle + axis.perp() * (end + side * gap / scale);
        let off = placed.at(point(24.0)).filter(|at| placed.view.rect.shrink(12.0).contains(*at)).is_none();
        (off || end * side > 320.0 / scale, point(0.0), point(24.0))
    });
    let (_, end, knob) = if knobs[0].0 && !knobs[1].0 { knobs[1] } else { knobs[0] };
    line(end, knob, Stroke::new(1.0, ui.visuals().strong_text_color().gamma_multiply(0.5)));
    let Some(at) = placed.at(knob) else { return };
    let tip = "Turn the film line about the light. The chart below follows.";
    let r = handle(ui, placed, lab.drawing, at, Id::unique("film line"), "film line", tip);
    let direction = |at: Pos2| (placed.world(at) - world.light).to_angle();
    if r.drag_started() {
        lab.drag = Some(Drag::Turn(row.normal - direction(at)));
    }
    if let (true, Some(pointer), Some(Drag::Turn(offset))) = (r.dragged(), r.interact_pointer_pos(), lab.drag) {
        let turned = offset + direction(pointer) - row.normal;
        lab.turn(film, row.normal + (turned + PI).rem_euclid(2.0 * PI) - PI);
    }
    let tint = if r.hovered() || r.dragged() { Color32::WHITE } else { tint(ui, lab.now.film) };
    painter.circle(at, 6.0, tint, Stroke::new(1.5, ui.visuals().extreme_bg_color));
    let name =
        if metric(lab.now.film).is_some() && lab.now.few.is_some() { "few samples" } else { &short_name(lab.now.film) };
    let text = format!("{name}, {:.1}°", row.angle);
    painter.text(
        at + vec2(9.0, -3.0),
        Align2::LEFT_BOTTOM,
        text,
        FontId::proportional(12.0),
        ui.visuals().text_color(),
    );
}

/// Something to drag at a place.
fn handle(ui: &Ui, placed: &Placed, drawing: bool, at: Pos2, id: Id, name: &str, tip: &str) -> Response {
    let area = Rect::from_center_size(at, vec2(18.0, 18.0)).intersect(placed.view.rect);
    let r = ui.interact(area, id, if drawing { Sense::hover() } else { Sense::drag() });
    r.widget_info(|| WidgetInfo::labeled(Role::Button, true, name));
    if drawing {
        return r;
    }
    if r.hovered() {
        ui.set_cursor_icon(CursorIcon::Grab);
    }
    if r.dragged() {
        ui.set_cursor_icon(CursorIcon::Grabbing);
        return r;
    }
    r.on_hover_text(tip)
}

/// Handles of eye, view, light and the ends of segments.
pub fn handles(ui: &mut Ui, painter: &Painter, placed: &Placed, lab: &mut Lab) {
    let drawing = lab.drawing;
    let inside = placed.view.rect.shrink(3.0);
    let flat = placed.post.is_none();
    let hot =
        |r: &Response, color: Color32| if !drawing && (r.hovered() || r.dragged()) { Color32::WHITE } else { color };
    let ground = Stroke::new(1.5, ui.visuals().extreme_bg_color);
    let world = &mut lab.now.world;
    let grey = ui.visuals().text_color();
    let all = world.segments.len() <= HANDLED;
    // An end that is out of all sight has no handle, wherever perspective brings it.
    let within = |p: &DVec2| p.abs().max_element() < FARTHEST / 2.0;
    let selected = lab.selected;
    for i in (0..world.segments.len()).filter(|i| all || selected == Some(*i)) {
        for end in 0..2 {
            let Some(at) = placed
                .at(world.segments[i][end])
                .filter(|at| inside.contains(*at))
                .filter(|_| within(&world.segments[i][end]))
            else {
                continue;
            };
            let name = format!("segment {} {}", i + 1, ["start", "end"][end]);
            let r = handle(
                ui,
                placed,
                drawing,
                at,
                Id::unique(("segment", i, end)),
                &name,
                "Drag this end of the segment.",
            );
            if let (true, Some(pointer)) = (r.dragged(), r.interact_pointer_pos()) {
                let to = round_place(placed, pointer);
                if to.is_finite() {
                    world.segments[i][end] = to;
                }
                lab.selected = Some(i);
            }
            painter.circle(at, 4.0, hot(&r, grey), ground);
        }
    }
    let view_color = ui.visuals().hyperlink_color;
    if flat && let Some(at) = placed.at(world.eye) {
        let reach = REACH / placed.view.scale;
        let [gaze, edge] = [world.gaze, world.gaze + world.fov / 2.0].map(|a| world.eye + DVec2::from_angle(a) * reach);
        if let (Some(gaze_at), Some(edge_at)) = (placed.at(gaze), placed.at(edge)) {
            let direction = |at: Pos2| (placed.world(at) - world.eye).to_angle();
            let degrees = |a: f64| ((a.to_degrees() * 100.0).round() / 100.0).to_radians();
            let across = world.forward().perp() * (46.0 / placed.view.scale);
            let plane = [world.eye - across, world.eye + across].map(|p| placed.at(p));
            if let [Some(a), Some(b)] = plane {
                painter.line_segment([a, b], Stroke::new(1.0, view_color.gamma_multiply(0.6)));
            }
            painter.line_segment([at, gaze_at], Stroke::new(1.0, view_color));
            let r =
                handle(ui, placed, drawing, edge_at, Id::unique("view"), "field of view", "Widen or narrow the view.");
            let mut fov = world.fov;
            if let (true, Some(pointer)) = (r.dragged(), r.interact_pointer_pos()) {
                let half = (direction(pointer) - world.gaze + PI).rem_euclid(2.0 * PI) - PI;
                fov = degrees(2.0 * half).clamp(1f64.to_radians(), 170f64.to_radians());
            }
            painter.rect_filled(Rect::from_center_size(edge_at, vec2(8.0, 8.0)), 1.0, hot(&r, view_color));
            let r = handle(ui, placed, drawing, gaze_at, Id::unique("gaze"), "gaze", "Turn the view.");
            if let (true, Some(pointer)) = (r.dragged(), r.interact_pointer_pos()) {
                world.gaze = degrees(direction(pointer));
            }
            world.fov = fov;
            painter.circle(gaze_at, 5.0, hot(&r, view_color), ground);
        }
        let r = handle(ui, placed, drawing, at, Id::unique("eye"), "eye", "Move the eye.");
        if let (true, Some(pointer)) = (r.dragged(), r.interact_pointer_pos()) {
            world.eye = round_place(placed, pointer);
        }
        painter.circle(at, 7.0, hot(&r, view_color), ground);
        painter.circle_filled(at, 2.5, ui.visuals().extreme_bg_color);
        painter.text(at + vec2(0.0, 10.0), Align2::CENTER_TOP, "eye", FontId::proportional(12.0), grey);
    }
    let Some(at) = placed.at(world.light).filter(|at| inside.contains(*at)) else { return };
    let behind = (world.light - world.eye).dot(world.forward()) < 0.0;
    let r = handle(ui, placed, drawing, at, Id::unique("light"), "light", "Move the light.");
    if let (true, Some(pointer)) = (r.dragged(), r.interact_pointer_pos()) {
        let to = round_place(placed, pointer);
        if to.is_finite() {
            world.light = to;
        }
    }
    let color = hot(&r, SUN);
    for i in 0..8 {
        let ray = egui::Vec2::angled(i as f32 * std::f32::consts::TAU / 8.0);
        painter.line_segment([at + ray * 8.0, at + ray * 11.5], Stroke::new(1.5, color));
    }
    painter.circle(at, 6.0, color, ground);
    let name = if !flat && behind { "light, a sink here" } else { "light" };
    painter.text(at - vec2(0.0, 13.0), Align2::CENTER_BOTTOM, name, FontId::proportional(12.0), grey);
}
