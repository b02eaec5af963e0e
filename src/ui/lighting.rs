//! The panel's light section.

use super::controls::{Tip, field, room, row, slide};
use super::lamps;
use super::model::Model;
use super::panel::{choice, preset_name, vector};
use crate::light::{KINDS, Light, MAX_RADIUS};
use crate::techniques;
use egui::{ComboBox, DragValue, Response, Ui};
use glam::{DVec3, Vec3};

/// What a kind of light is, in the order of [`KINDS`].
const DOCS: [&str; 5] = [
    "Parallel rays, like the sun.",
    "A cone of light from a point.",
    "A point that shines in all directions.",
    "A point that shines into the half space around a direction.",
    "A rectangle that shines from its front.",
];

pub fn show(ui: &mut Ui, m: &mut Model) {
    let before = (m.setup.light.kind(), m.setup.light_number);
    let tip = "What shines. Click to fold out its kind, place, direction and colour.";
    choice(ui, m, ("Light", tip), presets, details);
    lamps::list(ui, m);
    // Another light that is chosen leaves the technique as it is.
    if m.setup.light.kind() != before.0 && m.setup.light_number == before.1 {
        serve(m);
        m.setup.fit_path();
    }
}

fn presets(ui: &mut Ui, m: &mut Model, label: &Response) {
    let scene = m.scene.clone();
    let clock = m.setup.clock();
    let now = scene.lights.iter().find(|l| l.at(&scene, clock) == m.setup.light);
    let text = now.map_or_else(|| format!("own {}", m.setup.light.kind()), |l| preset_name(&l.name, l.node));
    let width = ui.available_width();
    let shown = ComboBox::from_id_salt("light").selected_text(text).width(width).truncate().show_ui(ui, |ui| {
        for preset in &scene.lights {
            let doc = DOCS[preset.light.index()];
            let light = preset.at(&scene, clock);
            if ui.selectable_label(light == m.setup.light, preset_name(&preset.name, preset.node)).tip(doc).clicked() {
                m.setup.light = light;
            }
        }
    });
    shown
        .response
        .labelled_by(label.id)
        .tip("The lights of the scene. Animated ones move with the clock, until you move them. Own: changed by you.");
}

fn details(ui: &mut Ui, m: &mut Model) {
    row(ui, "kind", "What kind of light it is. Some techniques serve only some kinds.", |ui, label| {
        let width = room(ui);
        let combo = ComboBox::from_id_salt("kind").selected_text(m.setup.light.kind()).width(width);
        let shown = combo.show_ui(ui, |ui| {
            for (i, kind) in KINDS.iter().enumerate() {
                let chosen = m.setup.light.index() == i;
                if ui.selectable_label(chosen, *kind).tip(DOCS[i]).clicked() && !chosen {
                    m.setup.light = converted(&m.setup.light, i, m.bounds);
                }
            }
        });
        shown.response.labelled_by(label.id).tip(DOCS[m.setup.light.index()]);
    });
    let speed = m.diagonal() * 0.002;
    let far = m.diagonal() * 20.0;
    let origin = m.scene.origin;
    match &mut m.setup.light {
        Light::Directional { to_light, angular_radius, .. } => {
            let (mut azimuth, mut elevation) = angles(*to_light);
            let a = slide(
                ui,
                "azimuth",
                "Where the sun stands: 0° is +z, 90° is +x.",
                &mut azimuth,
                -180.0..=180.0,
                false,
                "°",
            );
            let e = slide(
                ui,
                "elevation",
                "How high the sun stands over the horizon.",
                &mut elevation,
                -90.0..=90.0,
                false,
                "°",
            );
            if a || e {
                *to_light = from_angles(azimuth, elevation);
            }
            let tip = "Half the angle that the light's disc takes in the sky; the sun's is 0.27°. The truth of more than one \
                       sample is averaged over it.";
            slide(ui, "angular radius", tip, angular_radius, 0.0..=MAX_RADIUS, true, "°");
        }
        Light::Spot { position, direction, outer_angle, range, radius, .. } => {
            vector(ui, "position", "Where the light is.", position, origin, speed);
            aim(ui, direction);
            let tip = "Angle between the cone's axis and its edge.";
            slide(ui, "cone", tip, outer_angle, 1.0..=85.0, false, "°");
            reach(ui, range, far);
            size(ui, radius);
        }
        Light::Omni { position, range, radius, .. } => {
            vector(ui, "position", "Where the light is.", position, origin, speed);
            reach(ui, range, far);
            size(ui, radius);
        }
        Light::Hemisphere { position, direction, range, .. } => {
            vector(ui, "position", "Where the light is.", position, origin, speed);
            aim(ui, direction);
            reach(ui, range, far);
        }
        Light::RectArea { center, half_u, half_v, range, .. } => {
            vector(ui, "center", "Middle of the rectangle.", center, origin, speed);
            vector(ui, "half width", "From the middle to the right edge.", half_u, DVec3::ZERO, speed);
            vector(
                ui,
                "half height",
                "From the middle to the upper edge. The front is where width × height points.",
                half_v,
                DVec3::ZERO,
                speed,
            );
            reach(ui, range, far);
        }
    }
    color(ui, &mut m.setup.light);
    lamps::add(ui, m);
}

fn aim(ui: &mut Ui, direction: &mut Vec3) {
    let (mut azimuth, mut elevation) = angles(*direction);
    let a = slide(ui, "azimuth", "Which way it shines: 0° is +z, 90° is +x.", &mut azimuth, -180.0..=180.0, false, "°");
    let e =
        slide(ui, "elevation", "-90° shines straight down, 90° straight up.", &mut elevation, -90.0..=90.0, false, "°");
    if a || e {
        *direction = from_angles(azimuth, elevation);
    }
}

fn reach(ui: &mut Ui, range: &mut f32, far: f32) {
    let tip = "Distance beyond which the light no longer reaches.";
    let least = 0.1f32.min(1e-3 * far);
    slide(ui, "range", tip, range, least..=far.max(*range), true, "m");
}

fn size(ui: &mut Ui, radius: &mut f32) {
    let tip = "Of the disc that shines, which faces every point that it lights; 0: a point. The truth of more than one sample \
               is averaged over it.";
    slide(ui, "radius", tip, radius, 0.0..=MAX_RADIUS, true, "m");
}

/// Colour as a hue of full brightness and a strength.
fn color(ui: &mut Ui, light: &mut Light) {
    let color = light.color_mut();
    let (tip, unit) =
        ("Colour, and strength as a multiple of white: at a distance of 1 m, or anywhere for the sun.", "×");
    row(ui, "colour", tip, |ui, label| {
        let strength = color.max_element();
        let mut hue = if strength > 0.0 { (*color / strength).to_array() } else { [1.0; 3] };
        let picked = ui.color_edit_button_rgb(&mut hue).tip("Choose the colour.");
        let mut value = strength;
        let drag =
            DragValue::new(&mut value).range(0.0..=1e6).speed(strength.max(0.1) * 0.01).max_decimals(2).prefix(unit);
        let width = room(ui);
        let dragged = field(ui, width, drag, tip).labelled_by(label.id);
        if picked.changed() || dragged.changed() {
            *color = Vec3::from(hue) * value;
        }
    });
}

/// Azimuth from +z towards +x and elevation of a vector, degrees.
pub fn angles(v: Vec3) -> (f32, f32) {
    let v = v.normalize_or(Vec3::Y);
    (v.x.atan2(v.z).to_degrees(), v.y.clamp(-1.0, 1.0).asin().to_degrees())
}

/// The unit vector of an azimuth and an elevation, degrees.
pub fn from_angles(azimuth: f32, elevation: f32) -> Vec3 {
    let (sin_a, cos_a) = azimuth.to_radians().sin_cos();
    let (sin_e, cos_e) = elevation.to_radians().sin_cos();
    Vec3::new(sin_a * cos_e, sin_e, cos_a * cos_e)
}

/// A light of another kind that lights the scene from about where the old one does, as brightly, and is as large from there.
pub fn converted(light: &Light, kind: usize, bounds: [Vec3; 2]) -> Light {
    let middle = (bounds[0] + bounds[1]) / 2.0;
    let radius = ((bounds[1] - bounds[0]).length() / 2.0).max(1e-9);
    let sun = matches!(light, Light::Directional { .. });
    let direction = light.axis();
    let position = if sun { middle - direction * radius } else { light.position() };
    let distance = position.distance(middle).max(radius * 0.1);
    let range = if sun { radius * 4.0 } else { light.range() };
    let color = match (sun, kind == 0) {
        (true, false) => light.color() * distance * distance,
        (false, true) => light.color() / (distance * distance),
        _ => light.color(),
    };
    let size = light.radius() * if sun { distance } else { 1.0 };
    match kind {
        0 => {
            let to_light = (position - middle).normalize_or(Vec3::Y);
            let angular_radius = (size / distance).atan().to_degrees().min(MAX_RADIUS);
            Light::Directional { to_light: if sun { -direction } else { to_light }, angular_radius, color }
        }
        1 => Light::Spot { position, direction, outer_angle: 40.0, range, radius: size.min(MAX_RADIUS), color },
        2 => Light::Omni { position, range, radius: size.min(MAX_RADIUS), color },
        3 => Light::Hemisphere { position, direction, range, color },
        _ => {
            let side = direction.any_orthonormal_vector() * radius * 0.1;
            Light::RectArea { center: position, half_u: side, half_v: direction.cross(side), range, color }
        }
    }
}

/// Changes to the first technique that serves the light, where the chosen one does not.
pub fn serve(m: &mut Model) {
    let Some(reason) = m.info().refuses(&m.setup.light) else { return };
    if let Some(other) = techniques::ALL.iter().find(|i| i.refuses(&m.setup.light).is_none()) {
        m.select(other);
        m.say(format!("{reason}. Changed to {}.", other.title));
    }
}
