//! Handles for the light over the picture: a small sky for the sun, points to drag for other lights.

use super::lamps;
use super::lighting::{angles, from_angles};
use super::model::Model;
use super::style::{SUN, TEXT};
use crate::light::{Light, MAX_RADIUS};
use crate::scene::Camera;
use egui::{Align, Align2, Color32, CursorIcon, FontId, Id, Pos2, Rect, Response, Sense, Stroke, Ui, Vec2, pos2, vec2};
use glam::{Quat, Vec3};

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
        Light::Omni { position, radius, .. } => {
            disc(ui, rect, &camera, *position, radius);
            place(ui, rect, &camera, position, "light");
        }
        Light::Spot { position, direction, outer_angle, radius, .. } => {
            disc(ui, rect, &camera, *position, radius);
            let cone = outer_angle.to_radians().min(1.4);
            aimed(ui, rect, &camera, position, direction, cone.tan());
        }
        Light::Hemisphere { position, direction, .. } => aimed(ui, rect, &camera, position, direction, 0.0),
        Light::RectArea { center, half_u, half_v, .. } => {
            rectangle(ui, rect, &camera, center, [half_u, half_v]);
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
    let axis = direction.normalize_or(Vec3::NEG_Y);
    let tip = tip(camera, *position, axis);
    if spread > 0.0 {
        let u = axis.any_orthonormal_vector() * spread * tip.distance(*position);
        let v = axis.cross(u);
        ring(ui, rect, camera, tip, [u, v]);
        for side in [u, v, -u, -v] {
            segment(ui, rect, camera, *position, tip + side);
        }
    }
    if let Some(way) = turned(ui, rect, camera, [*position, tip], "Drag to aim the light.") {
        *direction = way;
    }
    place(ui, rect, camera, position, "light");
}

/// Where the handle of a light's direction stands.
fn tip(camera: &Camera, position: Vec3, axis: Vec3) -> Vec3 {
    let depth = (position - camera.position).dot(camera.forward());
    let size = camera.height.unwrap_or(depth);
    position + axis * (size * 0.25).max(camera.near)
}

/// The handle of a light's direction, with the line to it; the new direction while it is dragged.
fn turned(ui: &mut Ui, rect: Rect, camera: &Camera, [position, tip]: [Vec3; 2], says: &str) -> Option<Vec3> {
    segment(ui, rect, camera, position, tip);
    let mut end = tip;
    let moved = handle(ui, rect, camera, &mut end, "light's direction", 5.0, says);
    moved.then(|| (end - position).try_normalize()).flatten()
}

/// A circle around a point, with two radii at right angles.
fn ring(ui: &Ui, rect: Rect, camera: &Camera, center: Vec3, [u, v]: [Vec3; 2]) {
    let edge = |i: usize| {
        let (sin, cos) = (i as f32 * std::f32::consts::TAU / 32.0).sin_cos();
        center + u * cos + v * sin
    };
    (0..32).for_each(|i| segment(ui, rect, camera, edge(i), edge(i + 1)));
}

/// The disc of a light with a radius, as it faces the camera: a handle at its edge.
fn disc(ui: &mut Ui, rect: Rect, camera: &Camera, position: Vec3, radius: &mut f32) {
    if *radius <= 0.0 {
        return;
    }
    let (right, up) = camera.axes();
    ring(ui, rect, camera, position, [right * *radius, up * *radius]);
    let mut end = position + right * *radius;
    if handle(ui, rect, camera, &mut end, "light's radius", 5.0, "Drag to change the light's radius.") {
        *radius = (end - position).dot(right).clamp(0.01 * *radius, MAX_RADIUS);
    }
}

/// A rectangle: its outline, the way it shines, and handles for place, sides and direction.
fn rectangle(ui: &mut Ui, rect: Rect, camera: &Camera, center: &mut Vec3, [half_u, half_v]: [&mut Vec3; 2]) {
    let corner = |u: f32, v: f32| *center + *half_u * u + *half_v * v;
    let corners = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
    for i in 0..4 {
        segment(ui, rect, camera, corners[i], corners[(i + 1) % 4]);
    }
    let axis = half_u.cross(*half_v).normalize_or(Vec3::NEG_Y);
    let tip = tip(camera, *center, axis);
    if let Some(way) = turned(ui, rect, camera, [*center, tip], "Drag to turn the light.") {
        let turn = Quat::from_rotation_arc(axis, way);
        (*half_u, *half_v) = (turn * *half_u, turn * *half_v);
    }
    for (half, id, tip) in [
        (half_u, "light's half width", "Drag to make the light wider or narrower."),
        (half_v, "light's half height", "Drag to make the light higher or lower."),
    ] {
        let mut end = *center + *half;
        if handle(ui, rect, camera, &mut end, id, 5.0, tip) {
            let way = half.normalize_or(Vec3::X);
            // As far along the side as its handle is seen to have moved.
            let seen = way - camera.forward() * way.dot(camera.forward());
            let further = (end - *center - *half).dot(seen) / seen.length_squared().max(0.01);
            *half = way * (half.length() + further).max(0.01 * half.length());
        }
    }
    place(ui, rect, camera, center, "light");
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
pub fn project(camera: &Camera, rect: Rect, point: Vec3) -> Option<Pos2> {
    let eye = point - camera.position;
    let depth = eye.dot(camera.forward());
    if depth <= camera.near {
        return None;
    }
    let (right, up) = camera.axes();
    let scale = camera.metres_per_point(depth, rect.height());
    Some(rect.center() + vec2(eye.dot(right), -eye.dot(up)) / scale)
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui_kittest::Harness;

    const RECT: Rect = Rect { min: pos2(0.0, 0.0), max: pos2(800.0, 600.0) };

    fn camera() -> Camera {
        Camera::new(Vec3::new(1.0, 6.0, 7.0), Vec3::ZERO, 50.0, 0.1, 100.0)
    }

    /// The light after a drag from one point in space towards another, as they are seen.
    fn dragged(light: Light, [begin, end]: [Vec3; 2]) -> Light {
        let show = |ui: &mut Ui, light: &mut Light| match light {
            Light::RectArea { center, half_u, half_v, .. } => rectangle(ui, RECT, &camera(), center, [half_u, half_v]),
            Light::Omni { position, radius, .. } => disc(ui, RECT, &camera(), *position, radius),
            _ => {}
        };
        let mut harness = Harness::builder().with_size(RECT.size()).build_ui_state(show, light);
        let [begin, end] = [begin, end].map(|point| project(&camera(), RECT, point).unwrap());
        harness.drag_at(begin);
        harness.run_steps(2);
        harness.hover_at(begin + (end - begin) / 2.0);
        harness.run_steps(2);
        harness.hover_at(end);
        harness.run_steps(2);
        harness.drop_at(end);
        harness.run_steps(2);
        *harness.state()
    }

    #[test]
    fn a_rectangle_is_sized_and_turned_by_its_handles() {
        let (center, half_u, half_v) = (Vec3::new(0.0, 1.0, 0.0), Vec3::X, Vec3::new(0.0, 0.0, 0.5));
        let light = Light::RectArea { center, half_u, half_v, range: 20.0, color: Vec3::ONE };
        let sides = |light: Light| match light {
            Light::RectArea { center, half_u, half_v, .. } => (center, half_u, half_v),
            _ => unreachable!(),
        };
        let (c, u, v) = sides(dragged(light, [center + half_u, center + 1.6 * half_u]));
        assert!((c, v) == (center, half_v) && (u - 1.6 * half_u).length() < 0.05, "{u}");
        let (c, u, v) = sides(dragged(light, [center + half_v, center + 0.5 * half_v]));
        assert!((c, u) == (center, half_u) && (v - 0.5 * half_v).length() < 0.05, "{v}");
        // It never turns over.
        let (_, u, _) = sides(dragged(light, [center + half_u, center - 2.0 * half_u]));
        assert!(u.dot(half_u) > 0.0, "{u}");
        // It shines down; the handle stands a quarter of its depth below it.
        let depth = (center - camera().position).dot(camera().forward());
        let tip = center + half_u.cross(half_v).normalize() * depth * 0.25;
        let (c, u, v) = sides(dragged(light, [tip, tip + Vec3::X]));
        let lengths = u.length() - half_u.length() + v.length() - half_v.length();
        assert!(c == center && lengths.abs() < 1e-4 && u.dot(v).abs() < 1e-4, "{u} {v}");
        let turned = u.cross(v).normalize().dot((tip + Vec3::X - center).normalize());
        assert!(turned > 0.97, "{turned}");
    }

    #[test]
    fn a_radius_is_dragged() {
        let position = Vec3::new(0.0, 1.0, 0.0);
        let (right, _) = camera().axes();
        let light = Light::Omni { position, range: 20.0, radius: 0.5, color: Vec3::ONE };
        let wider = dragged(light, [position + 0.5 * right, position + 1.2 * right]);
        assert!((wider.radius() - 1.2).abs() < 0.05 && wider.position() == position, "{wider:?}");
        let none = Light::Omni { position, range: 20.0, radius: 0.0, color: Vec3::ONE };
        assert_eq!(dragged(none, [position, position + right]), none);
    }
}
