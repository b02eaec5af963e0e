//! What is asked where the driver has dropped the scene's device again and again.

use super::model::{Action, Model};
use crate::gpu::Failure;
use crate::message;
use egui::{Context, Id, Modal};

/// The scene's device is lost.
pub struct Lost {
    /// In words.
    pub why: String,
    /// Adapters to go on with, by their names.
    pub adapters: Vec<String>,
}

/// Why a device was lost, in words; what else keeps one from being opened.
pub fn why(error: &anyhow::Error) -> String {
    match error.downcast_ref() {
        Some(Failure::Lost(why)) => format!("the graphics driver has dropped its device ({why})"),
        _ => message::sentence(error),
    }
}

/// Asks which adapter is to go on.
pub fn show(ctx: &Context, m: &Model, out: &mut Vec<Action>) {
    let Some(lost) = &m.lost else { return };
    Modal::new(Id::unique("lost")).show(ctx, |ui| {
        ui.set_max_width(ui.ctx().content_rect().width().clamp(160.0, 520.0) - 60.0);
        ui.label(format!("No more pictures can be drawn: {}.", lost.why));
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
