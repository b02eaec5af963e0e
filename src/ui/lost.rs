//! What is asked where the driver has dropped the scene's device again and again.

use super::model::{Action, Model};
use egui::{Context, Id, Modal};

/// The scene's device is lost.
pub struct Lost {
    /// In words.
    pub why: String,
    /// Adapters to go on with, by their names.
    pub adapters: Vec<String>,
}

/// Asks which adapter is to go on.
pub fn show(ctx: &Context, m: &Model, out: &mut Vec<Action>) {
    let Some(lost) = &m.lost else { return };
    Modal::new(Id::unique("lost")).show(ctx, |ui| {
        ui.set_max_width(ui.ctx().content_rect().width().clamp(160.0, 520.0) - 60.0);
        ui.label(format!("No picture can be drawn: {}.", lost.why.trim_end_matches('.')));
        ui.label("Set-up, history and all that was measured are still there.");
        ui.add_space(6.0);
        for name in &lost.adapters {
            let again =
                if *name == m.facts.adapter { format!("Try {name} again") } else { format!("Go on with {name}") };
            if ui.button(again).clicked() {
                out.push(Action::Adapter(name.clone()));
            }
        }
        if lost.adapters.is_empty() && ui.button("Try again").clicked() {
            out.push(Action::Adapter(m.facts.adapter.clone()));
        }
    });
}
