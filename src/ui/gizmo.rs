//! Handles for the light over the picture: a small sky for the sun, points to drag for other lights.

use super::lamps;
use super::lighting::{angles, from_angles};
use super::model::Model;
use super::style::{SUN, TEXT};
use crate::light::Light;
use crate::scene::Camera;
use egui::{Align, Align2, Color32, CursorIcon, FontId, Id, Pos2, Rect, Response, Sense, Stroke, Ui, Vec2, pos2, vec2};
use glam::Vec3;

/// Radius of the sun's sky, points.
const SKY: f32 = 50.0;
const GROUND: Color32 = Color32::from_black_alpha(140);

/// Draws and moves the light's handles over a picture in `rect`, of which no legend hides `free`.
pub fn show(ui: &mut Ui, rect: Rect, free: Rect, m: &mut Model) {
    if rect.width() < 4.0 * SKY || rect.height() < 4.0 * SKY {
        return;
    }
    let camera = m.setup.camera;
    others(ui, rect, &camera, m);
    let light = &mut m.setup.light;
    match light {
        Light::Directional { to_light, .. } => sun(ui, rect.intersect(free), &camera, to_light),
        Light::Omni { position, .. } => {
            place(ui, rect, &camera, position, "light");
        }
        Light::Spot { position, direction, outer_angle, .. } => {
            let cone = outer_angle.to_radians().min(1.4);
            aimed(ui, rect, &camera, position, direction, cone.tan());
        }
        Light::Hemisphere { position, direction, .. } => aimed(ui, rect, &camera, position, direction, 0.0),
        Light::RectArea { center, half_u, half_v, .. } => {
            let corner = |u: f32, v: f32| *center + *half_u * u + *half_v * v;
            let corners = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
            for i in 0..4 {
                segment(ui, rect, &camera, corners[i], corners[(i + 1) % 4]);
            }
            place(ui, rect, &camera, center, "light");
        }
    }
}

/// The other lights that stand somewhere, as points: a click chooses one.
fn others(ui: &mut Ui, rect: Rect, camera: &Camera, m: &mut Model) {
    let work = m.setup.at_work();
    for (i, mut lamp) in m.setup.lamps().into_iter().enumerate().filter(|(i, _)| *i != work) {
        let Some(at) = lamp.light.place_mut().and_then(|place| project(camera, rect, *place)) else { continue };
        if !rect.shrink(8.0).contains(at) {
            continue;
        }
        let area = Rect::from_center_size(at, Vec2::splat(20.0));
        let r = ui.interact(area, Id::unique(("other light", i)), Sense::click());
        let color = if r.hovered() { Color32::WHITE } else { SUN.gamma_multiply(if lamp.on { 0.8 } else { 0.35 }) };
        let painter = ui.painter().with_clip_rect(rect);
        painter.circle(at, 7.0, GROUND, Stroke::new(1.0, color));
        painter.text(at, Align2::CENTER_CENTER, (i + 1).to_string(), FontId::proportional(10.0), color);
        if r.on_hover_text(format!("Light {}. Click to choose it.", i + 1)).clicked() {
            lamps::choose(m, i);
        }
    }
}

/// The sky seen from below, turned with the camera: the middle is overhead, the edge the horizon.
fn sun(ui: &mut Ui, rect: Rect, camera: &Camera, to_light: &mut Vec3) {
    let center = pos2(rect.left() + SKY + 22.0, rect.bottom() - SKY - 30.0);
    let (right, _) = camera.axes();
    let ahead = Vec3::Y.cross(right);
    let (_, elevation) = angles(*to_light);
    let flat = vec2(to_light.dot(right), -to_light.dot(ahead));
    let flat = if flat.length() > 1e-6 { flat.normalized() } else { Vec2::ZERO };
    let below = elevation < 0.0;
    let at = center + flat * (1.0 - elevation.max(0.0) / 90.0) * SKY;

    let handle = Rect::from_center_size(at, Vec2::splat(26.0));
    let r = ui.interact(handle, Id::unique("sun"), Sense::drag());
    let sky = ui.interact(Rect::from_center_size(center, Vec2::splat(2.0 * SKY)), Id::unique("sky"), Sense::hover());
    sky.on_hover_text("Drag the sun. The middle is overhead, the ring the horizon, and up is where the camera looks.");
    if r.dragged()
        && let Some(pointer) = r.interact_pointer_pos()
    {
        let d = (pointer - center) / SKY;
        // Half a degree above the horizon at least, and not quite overhead, so that a direction remains.
        let elevation = (90.0 * (1.0 - d.length())).clamp(0.5, 89.9);
        let side = right * d.x - ahead * d.y;
        let (azimuth, _) = angles(side);
        if d.length() > 1e-3 {
            *to_light = from_angles(azimuth, elevation);
        }
    }
    let painter = ui.painter().with_clip_rect(rect);
    painter.circle(center, SKY, GROUND, Stroke::new(1.0, Color32::from_white_alpha(90)));
    for ring in [1.0, 2.0] {
        painter.circle_stroke(center, SKY * ring / 3.0, Stroke::new(1.0, Color32::from_white_alpha(28)));
    }
    painter.circle_filled(center, 1.5, Color32::from_white_alpha(120));
    painter.line_segment([center, at], Stroke::new(1.0, SUN.gamma_multiply(0.6)));
    let color = hot(ui, &r);
    for i in 0..8 {
        let ray = Vec2::angled(i as f32 * std::f32::consts::TAU / 8.0);
        painter.line_segment([at + ray * 8.0, at + ray * 11.5], Stroke::new(1.5, color));
    }
    if below {
        painter.circle(at, 6.0, GROUND, Stroke::new(1.5, color));
    } else {
        painter.circle_filled(at, 6.0, color);
    }
    let text = format!("sun at {elevation:.0}°");
    let under = center + vec2(0.0, SKY + 4.0);
    // A dark ground, so that it can be read over a bright sky too.
    painter.rect_filled(Rect::from_center_size(under + vec2(0.0, 8.0), vec2(70.0, 17.0)), 4.0, GROUND);
    painter.text(under, Align2::CENTER_TOP, text, FontId::proportional(12.0), TEXT);
}

/// A light with a direction: two handles, and the cone's outline where it has one.
fn aimed(ui: &mut Ui, rect: Rect, camera: &Camera, position: &mut Vec3, direction: &mut Vec3, spread: f32) {
    let depth = (*position - camera.position).dot(camera.forward());
    let length = (depth * 0.25).max(camera.near);
    let axis = direction.normalize_or(Vec3::NEG_Y);
    let tip = *position + axis * length;
    segment(ui, rect, camera, *position, tip);
    if spread > 0.0 {
        let u = axis.any_orthonormal_vector() * spread * length;
        let v = axis.cross(u);
        let edge = |i: usize| {
            let (sin, cos) = (i as f32 * std::f32::consts::TAU / 32.0).sin_cos();
            tip + u * cos + v * sin
        };
        for i in 0..32 {
            segment(ui, rect, camera, edge(i), edge(i + 1));
            if i % 8 == 0 {
                segment(ui, rect, camera, *position, edge(i));
            }
        }
    }
    let mut end = tip;
    if handle(ui, rect, camera, &mut end, "light's direction", 5.0, "Drag to aim the light.") {
        *direction = (end - *position).normalize_or(axis);
    }
    place(ui, rect, camera, position, "light");
}

fn place(ui: &mut Ui, rect: Rect, camera: &Camera, position: &mut Vec3, id: &str) {
    let tip = "Drag to move the light across the picture; with Shift nearer and farther.";
    handle(ui, rect, camera, position, id, 8.0, tip);
    beyond(ui, rect, camera, position, id);
}

/// An arrow at the picture's edge towards a light that is out of sight. Dragged into the picture, the light comes along.
fn beyond(ui: &mut Ui, rect: Rect, camera: &Camera, point: &mut Vec3, id: &str) {
    let inner = rect.shrink(16.0);
    let eye = *point - camera.position;
    let (right, up) = camera.axes();
    let ahead = eye.dot(camera.forward()) > camera.near;
    let way = match project(camera, rect, *point) {
        Some(at) if inner.contains(at) => return,
        Some(at) => at - rect.center(),
        None => vec2(eye.dot(right), -eye.dot(up)),
    };
    let way = if way.length() > 1e-6 { way.normalized() } else { vec2(0.0, 1.0) };
    let half = inner.size() / 2.0;
    let at = inner.center() + way * (half.x / way.x.abs().max(1e-6)).min(half.y / way.y.abs().max(1e-6));
    // The same handle as in sight, so that one drag goes on there.
    let r = ui.interact(Rect::from_center_size(at, Vec2::splat(30.0)), Id::unique(id), Sense::drag());
    let color = hot(ui, &r);
    if r.dragged()
        && let Some(pointer) = r.interact_pointer_pos().filter(|p| rect.shrink(12.0).contains(*p))
    {
        let depth = if ahead { eye.dot(camera.forward()) } else { camera.reach() };
        let by = (pointer - rect.center()) * camera.metres_per_point(depth, rect.height());
        *point = camera.position + camera.forward() * depth + right * by.x - up * by.y;
    }
    r.on_hover_text("The light is out of sight there. Drag it into the picture.");
    let painter = ui.painter().with_clip_rect(rect);
    painter.circle_filled(at, 13.0, GROUND);
    painter.arrow(at - way * 8.0, way * 16.0, Stroke::new(2.0, color));
    let text = if ahead { "light" } else { "light behind" };
    let align = Align2([Align::Center, Align::Center]);
    let label = at - way * 34.0;
    painter.rect_filled(Rect::from_center_size(label, vec2(7.0 * text.len() as f32 + 8.0, 17.0)), 4.0, GROUND);
    painter.text(label, align, text, FontId::proportional(12.0), TEXT);
}

/// A point in space that can be dragged. True while it moves.
fn handle(ui: &mut Ui, rect: Rect, camera: &Camera, point: &mut Vec3, id: &str, radius: f32, tip: &str) -> bool {
    let Some(at) = project(camera, rect, *point).filter(|at| rect.shrink(radius).contains(*at)) else {
        return false;
    };
    let area = Rect::from_center_size(at, Vec2::splat(2.0 * radius + 10.0));
    let r = ui.interact(area, Id::unique(id), Sense::drag());
    let color = hot(ui, &r);
    let painter = ui.painter().with_clip_rect(rect);
    painter.circle(at, radius, GROUND, Stroke::new(2.0, color));
    painter.circle_filled(at, radius * 0.45, color);
    let d = r.drag_delta();
    let moved = r.dragged() && d != Vec2::ZERO;
    if moved {
        let eye = *point - camera.position;
        let scale = camera.metres_per_point(eye.dot(camera.forward()), rect.height());
        if ui.input(|i| i.modifiers.shift) {
            *point -= eye.normalize_or_zero() * d.y * scale * 3.0;
        } else {
            let (right, up) = camera.axes();
            *point += (right * d.x - up * d.y) * scale;
        }
    }
    r.on_hover_text(tip);
    moved
}

fn hot(ui: &Ui, r: &Response) -> Color32 {
    if r.dragged() {
        ui.ctx().set_cursor_icon(CursorIcon::Grabbing);
        Color32::WHITE
    } else if r.hovered() {
        ui.ctx().set_cursor_icon(CursorIcon::Grab);
        Color32::from_rgb(255, 230, 160)
    } else {
        SUN
    }
}

fn segment(ui: &Ui, rect: Rect, camera: &Camera, a: Vec3, b: Vec3) {
    if let (Some(a), Some(b)) = (project(camera, rect, a), project(camera, rect, b)) {
        ui.painter().with_clip_rect(rect).line_segment([a, b], Stroke::new(1.2, SUN.gamma_multiply(0.7)));
    }
}

/// Where a point lies in the picture; None behind the near plane.
fn project(camera: &Camera, rect: Rect, point: Vec3) -> Option<Pos2> {
    let eye = point - camera.position;
    let depth = eye.dot(camera.forward());
    if depth <= camera.near {
        return None;
    }
    let (right, up) = camera.axes();
    let scale = camera.metres_per_point(depth, rect.height());
    Some(rect.center() + vec2(eye.dot(right), -eye.dot(up)) / scale)
}
