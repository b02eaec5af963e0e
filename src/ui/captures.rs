//! The panel's section on captures: what goes into a file, and which.

use super::animating;
use super::controls::{HEIGHT, Tip, field, row};
use super::cropping;
use super::model::{Action, Model};
use crate::legend::{Key as Legend, picture_height, strip_height};
use crate::setup::{MAX_SIZE, MAX_SUPERSAMPLE};
use anyhow::Result;
use egui::{Button, ComboBox, DragValue, RichText, TextEdit, Ui};
use std::path::{Path, PathBuf};

/// The section's contents.
pub fn show(ui: &mut Ui, m: &mut Model, out: &mut Vec<Action>) {
    row(
        ui,
        "size",
        "Width and height of the picture, whatever the window's size. Measurements use it too.",
        |ui, label| {
            let width = (ui.available_width() - 22.0) / 2.0;
            for (i, tip) in [(0, "Width in pixels"), (1, "Height in pixels")] {
                if i == 1 {
                    ui.label("×");
                }
                let drag = DragValue::new(&mut m.setup.size[i]).range(1..=MAX_SIZE).suffix(" px");
                field(ui, width - 4.0, drag, tip).labelled_by(label.id);
            }
        },
    );
    let tip = "Pixels that are drawn for each of the file, and averaged: edges without stairs. The technique is drawn at the larger size, where its errors are those of smaller pixels. Views of values and classes, and charts, stay as they are.";
    row(ui, "supersample", tip, |ui, label| {
        let mut chosen = m.setup.supersample as usize - 1;
        let named = |i: usize| if i == 0 { "off".to_string() } else { format!("{} × {} pixels", i + 1, i + 1) };
        let combo = ComboBox::from_id_salt("supersample").width(ui.available_width());
        let combo = combo.show_index(ui, &mut chosen, MAX_SUPERSAMPLE as usize, named);
        combo.labelled_by(label.id).tip(tip);
        m.setup.supersample = chosen as u32 + 1;
    });
    let tip = "Where no surface is the file has alpha 0, so that what lies under it shows there.";
    row(ui, "transparent", tip, |ui, label| {
        ui.checkbox(&mut m.setup.transparent, "").labelled_by(label.id).tip(tip);
    });
    cropping::rows(ui, m);
    let mut framed = m.framed;
    row(
        ui,
        "frame",
        "Give the picture here the shape of the one that is captured: what lies outside it is left dark.",
        |ui, label| {
            ui.checkbox(&mut framed, "").labelled_by(label.id);
        },
    );
    m.framed = framed;
    let tip = ".png: the view, with the set-up inside, so that it opens here again. .exr: the raw values of the views visibility, truth, depth, position, normals, aliasing and counts.";
    let legend = "The view's legend goes below the picture, and the axes of charts into it. The file is higher by the legend, unless the size is the whole file's.";
    let file = (m.setup.legend || m.setup.crop.is_some()).then(|| file_size(m));
    row(ui, "legend", legend, |ui, label| {
        ui.checkbox(&mut m.setup.legend, "").labelled_by(label.id).tip(legend);
        if let Some(text) = file {
            ui.label(RichText::new(text).small().weak()).tip(legend);
        }
    });
    if m.setup.legend {
        let tip = "The file with its legend has the size above: the picture is that much lower. A set-up's size is the picture's.";
        row(ui, "whole file", tip, |ui, label| {
            ui.checkbox(&mut m.whole, "").labelled_by(label.id).tip(tip);
        });
    }
    path_row(ui, "picture", tip, &mut m.picture_path);
    ui.horizontal(|ui| {
        let path = PathBuf::from(m.picture_path.trim());
        let ready = !m.capturing && !m.picture_path.trim().is_empty();
        let save = ui.add_enabled(ready, Button::new("Save picture"));
        if save
            .tip("Render at this size and write the file. F12 does so into capture-001.png, capture-002.png and so on.")
            .clicked()
        {
            out.push(Action::Capture(path));
        }
        if ui.button("Save as…").tip("Choose the file in the system's dialog.").clicked() {
            out.push(Action::PickCapture);
        }
        if m.capturing {
            ui.spinner();
        }
    });
    animating::rows(ui, m, out);
    ui.add_space(4.0);
    path_row(
        ui,
        "set-up",
        "All settings as a text file (.toml) that opens here and on the command line.",
        &mut m.setup_path,
    );
    ui.horizontal_wrapped(|ui| {
        let save = ui.add_enabled(!m.setup_path.trim().is_empty(), Button::new("Save set-up"));
        if save.tip("Write all settings into this file (Ctrl+S).").clicked() {
            out.push(Action::SaveSetup(PathBuf::from(m.setup_path.trim())));
        }
        let tip = "Put a command on the clipboard that draws this picture in a shell: shadowscope capture …";
        if ui.button("Copy command").tip(tip).clicked() {
            let file = m.picture_path.trim();
            let command = m.setup.command(&m.scene, if file.is_empty() { "picture.png" } else { file });
            copy(ui, m, command, "The command is on the clipboard.");
        }
        if ui.button("Copy TOML").tip("Put the set-up on the clipboard, as its file has it.").clicked() {
            let text = m.setup.to_toml(Path::new(m.setup_path.trim()));
            copy(ui, m, text, "The set-up is on the clipboard.");
        }
    });
}

fn copy(ui: &Ui, m: &mut Model, text: Result<String>, told: &str) {
    match text {
        Ok(text) => {
            ui.ctx().copy_text(text);
            m.say(told);
        }
        Err(e) => m.fail(&e),
    }
}

/// The size of a captured file, and of the picture in it where that is another than the one set.
fn file_size(m: &Model) -> String {
    let (size, [.., w, h]) = (m.setup.size, m.setup.part());
    if !m.setup.legend {
        return format!("file {w} × {h}");
    }
    let mut known = m.facts.known.clone();
    if !m.setup.needs_truth() {
        known.errors.clear();
    }
    let key = Legend::new(&m.setup, m.bounds, &known);
    match (m.whole, picture_height(&key, size)) {
        (true, Some(picture)) => format!("picture {} × {picture}", size[0]),
        (true, None) => "no room for the legend".into(),
        (false, _) => format!("file {w} × {}", h + strip_height(&key, [w, h])),
    }
}

pub fn path_row(ui: &mut Ui, name: &str, tip: &str, path: &mut String) {
    row(ui, name, tip, |ui, label| {
        let width = ui.available_width();
        ui.add_sized([width, HEIGHT], TextEdit::singleline(path)).labelled_by(label.id).tip(tip);
    });
}
