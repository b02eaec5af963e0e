//! The rows of the section on captures that write an animation.

use super::captures::path_row;
use super::controls::{HEIGHT, Tip, field, row};
use super::model::{Action, Model};
use crate::sequence::{self, Along, FPS, FRAMES, Sequence};
use anyhow::Result;
use egui::{Button, ComboBox, DragValue, RichText, Ui};
use std::path::PathBuf;

/// What the next animation is to be.
pub struct Animating {
    /// Of [`WAYS`].
    way: usize,
    /// None: as many as the way has by default.
    frames: Option<u32>,
    fps: Option<f32>,
    /// Of a turntable, degrees.
    start: f32,
    pub path: String,
}

impl Default for Animating {
    fn default() -> Animating {
        Animating { way: 0, frames: None, fps: None, start: 0.0, path: "animation.webp".into() }
    }
}

const WAYS: [(&str, &str); 3] = [
    ("turntable", "The camera once around the upright line through its target."),
    (
        "along the path",
        "Camera and light along the set-up's own path, or what the case whose scene is open moves (both under Stability, F3).",
    ),
    ("clock", "The scene's animation from its start to its end."),
];

impl Model {
    /// The way of a number, if the set-up has it.
    fn way(&self, way: usize) -> Option<Along> {
        match way {
            0 => Some(Along::Turntable { start: self.animating.start }),
            1 => Along::path_of(&self.setup),
            _ => sequence::whole_clock(&self.setup, &self.scene).ok(),
        }
    }

    fn sequence(&self, along: Along) -> Result<Sequence> {
        Sequence::new(along, &self.setup, self.animating.frames, self.animating.fps)
    }
}

pub fn rows(ui: &mut Ui, m: &mut Model, out: &mut Vec<Action>) {
    ui.add_space(4.0);
    ui.label(RichText::new("Animation").small().weak());
    if m.way(m.animating.way).is_none() {
        m.animating = Animating { path: std::mem::take(&mut m.animating.path), ..Animating::default() };
    }
    let Some(along) = m.way(m.animating.way) else { return };
    let before = m.animating.way;
    row(ui, "moves", "What moves from frame to frame.", |ui, label| {
        let combo = ComboBox::from_id_salt("moves").selected_text(WAYS[before].0).width(ui.available_width());
        let shown = combo.show_ui(ui, |ui| {
            for (i, (name, tip)) in WAYS.into_iter().enumerate() {
                let entry = ui.add_enabled(m.way(i).is_some(), Button::selectable(i == before, name));
                if entry.tip(tip).tip_disabled(tip).clicked() {
                    m.animating.way = i;
                }
            }
        });
        shown.response.labelled_by(label.id).tip(WAYS[before].1);
    });
    if m.animating.way != before {
        (m.animating.frames, m.animating.fps) = (None, None);
        return;
    }
    let sequence = m.sequence(along);
    let (mut frames, mut fps) = sequence.as_ref().map_or((FRAMES[0], FPS[0]), |s| (s.frames, s.fps));
    let tip = "Frames, and how many of them are shown in a second.";
    row(ui, "frames", tip, |ui, label| {
        let width = (ui.available_width() - ui.spacing().item_spacing.x) / 2.0 - 2.0;
        let drag = DragValue::new(&mut frames).range(FRAMES[0]..=FRAMES[1]);
        if field(ui, width, drag, tip).labelled_by(label.id).changed() {
            m.animating.frames = Some(frames);
        }
        let drag = DragValue::new(&mut fps).range(FPS[0]..=FPS[1]).max_decimals(2).speed(0.2).suffix(" a second");
        if field(ui, width, drag, tip).labelled_by(label.id).changed() {
            m.animating.fps = Some(fps);
        }
    });
    let tip = "An animation (.webp, .png or .apng) that opens here again, or numbered frames: frame-.png becomes frame-0001.png and so on.";
    path_row(ui, "animation", tip, &mut m.animating.path);
    ui.horizontal(|ui| {
        let path = PathBuf::from(m.animating.path.trim());
        let ready = m.measuring.is_none() && !m.animating.path.trim().is_empty();
        let save = ui.add_enabled(ready, Button::new("Save animation").min_size(egui::vec2(0.0, HEIGHT)));
        let tip = "Render all frames at this size and write them. What averages over frames goes on from each to the next. The picture waits meanwhile.";
        if save.tip(tip).clicked() {
            match sequence.and_then(|s| sequence::check_name(&path).map(|()| s)) {
                Ok(sequence) => out.push(Action::Animate(sequence, path)),
                Err(e) => m.fail(&e),
            }
        }
        let lasts = f64::from(frames) / f64::from(fps);
        ui.label(RichText::new(format!("{} s", crate::chart::digits(lasts))).small().weak()).tip("How long it plays.");
    });
}
