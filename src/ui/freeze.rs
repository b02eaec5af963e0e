//! The shadow camera, left behind and taken up again; what maps cover; and the light's own view.

use super::controls::{Tip, row};
use super::model::Model;
use egui::{Button, Ui};

/// Written over the picture while maps are fitted to another camera.
pub const FROZEN: &str = "shadow camera frozen: F releases it";

/// Leaves the shadow camera where the camera is, or takes it up again.
pub fn toggle(m: &mut Model) {
    m.setup.shadow_camera = match m.setup.shadow_camera {
        Some(_) => None,
        None => Some(m.setup.camera),
    };
}

pub fn button(ui: &mut Ui, m: &mut Model) {
    let freeze = Button::selectable(m.setup.shadow_camera.is_some(), "Freeze").frame_when_inactive(true);
    let tip = "Fit maps to the camera as it stands now, and fly on: its frustum, the cascades and what each map covers are drawn \
               as lines. Click again, and maps follow the camera (F).";
    if ui.add(freeze).tip(tip).clicked() {
        toggle(m);
    }
}

/// A preset beside the scene's own.
pub fn from_the_light(ui: &mut Ui, m: &mut Model) {
    let from = m.setup.light.camera(m.bounds, m.setup.camera);
    let tip = "Look along the light: a spot from where it stands, the sun from far outside the scene. Hardly a shadow is seen \
               from there, as each hides behind its caster.";
    if ui.selectable_label(m.setup.camera == from, "from the light").tip(tip).clicked() {
        m.home = from;
        m.go_home();
    }
}

pub fn outlines(ui: &mut Ui, m: &mut Model) {
    let tip = "Draw what maps cover as lines, cascades in their own colours. While the shadow camera is frozen they are always \
               drawn.";
    row(ui, "outlines", tip, |ui, label| {
        ui.checkbox(&mut m.setup.outlines, "").labelled_by(label.id).tip(tip);
    });
}
