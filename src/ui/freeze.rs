//! The shadow camera, left behind and taken up again; what maps cover; and the light's own view.

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

/// The rows of the camera's section.
pub fn show(ui: &mut Ui, m: &mut Model) {
    ui.horizontal_wrapped(|ui| {
        let from = m.setup.light.camera(m.bounds, m.setup.camera);
        let chip = Button::selectable(m.setup.camera == from, "From the light").frame_when_inactive(true);
        let tip = "Look along the light: a lamp from where it stands, the sun from far outside the scene. No shadow is seen \
                   from there, but where a technique is wrong.";
        if ui.add(chip).on_hover_text(tip).clicked() {
            m.setup.camera = from;
            m.camera_chosen = true;
        }
        let frozen = m.setup.shadow_camera.is_some();
        let freeze = Button::selectable(frozen, "Freeze shadow camera").frame_when_inactive(true);
        let tip = "Fit maps to the camera as it stands now, and fly on: its frustum, the cascades and what each map covers are \
                   drawn as lines. Once more, and they follow the camera again (F).";
        if ui.add(freeze).on_hover_text(tip).clicked() {
            toggle(m);
        }
        let tip = "Draw what maps cover as lines, in the cascades' colours. While the shadow camera is frozen they are always \
                   drawn.";
        ui.checkbox(&mut m.setup.outlines, "Outlines").on_hover_text(tip);
    });
}
