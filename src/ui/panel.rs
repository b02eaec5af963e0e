//! The side panel: every setting and figure, in sections that fold.

use super::controls::{chips, field, parameter, row, slide};
use super::freeze;
use super::lighting;
use super::model::{Action, Model};
use super::style::WEAK;
use super::{compare, needs, results, views};
use crate::scene::builtin;
use crate::setup::place;
use crate::techniques;
use egui::Response;
use egui::{
    Align, Button, CollapsingHeader, ComboBox, DragValue, Layout, RichText, ScrollArea, TextEdit, Ui, UiBuilder, vec2,
};
use glam::{DVec3, Vec3};
use std::path::PathBuf;

/// Width of the panel, points.
pub const WIDTH: f32 = 340.0;

/// Draws the panel's contents; changes go into the model, what only the window can do into `out`.
pub fn show(ui: &mut Ui, m: &mut Model, out: &mut Vec<Action>) {
    head(ui, m, out);
    ui.separator();
    // A space of its own: contents that are too wide are cut off and never widen the panel.
    let rest = ui.available_rect_before_wrap();
    let mut inside = ui.new_child(UiBuilder::new().max_rect(rest));
    inside.shrink_clip_rect(rest);
    ScrollArea::vertical().auto_shrink([false, false]).show(&mut inside, |ui| {
        section(ui, "Scene", true, |ui| scene(ui, m, out));
        // What differs from technique to technique comes last, so that the lists above stay where they are.
        section(ui, "Technique", true, |ui| technique(ui, m));
        section(ui, "View", true, |ui| views::show(ui, m));
        section(ui, "Parameters", true, |ui| parameters(ui, m));
        section(ui, "Light", false, |ui| lighting::show(ui, m));
        section(ui, "Camera", false, |ui| camera(ui, m));
        if !m.scene.animations.is_empty() {
            section(ui, "Animation", true, |ui| animation(ui, m));
        }
        section(ui, "Needs", true, |ui| needs::show(ui, m, out));
        section(ui, "Timings", true, |ui| results::timings(ui, &m.facts));
        section(ui, "Measure", false, |ui| results::measure(ui, m, out));
        section(ui, "Capture", false, |ui| capture(ui, m, out));
        ui.add_space(8.0);
    });
}

fn section(ui: &mut Ui, title: &str, open: bool, add: impl FnOnce(&mut Ui)) {
    CollapsingHeader::new(RichText::new(title).strong()).default_open(open).show_unindented(ui, |ui| {
        ui.add_space(1.0);
        add(ui);
        ui.add_space(7.0);
    });
}

fn head(ui: &mut Ui, m: &mut Model, out: &mut Vec<Action>) {
    ui.add_space(2.0);
    ui.horizontal(|ui| {
        let undo = ui.add_enabled(m.history.can_undo(), Button::new("Undo"));
        if undo.on_hover_text("Take back the last change of the set-up (Ctrl+Z).").clicked() {
            out.extend(m.undo());
        }
        let redo = ui.add_enabled(m.history.can_redo(), Button::new("Redo"));
        if redo.on_hover_text("Do again what was taken back (Ctrl+Shift+Z or Ctrl+Y).").clicked() {
            out.extend(m.redo());
        }
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            let help = ui.selectable_label(m.show_help, "Help").on_hover_text("Mouse and keys (F1).");
            if help.clicked() {
                m.show_help = !m.show_help;
            }
            if ui.button("Hide").on_hover_text("Hide this panel; Tab shows it again.").clicked() {
                m.show_panel = false;
            }
        });
    });
}

fn scene(ui: &mut Ui, m: &mut Model, out: &mut Vec<Action>) {
    row(
        ui,
        "scene",
        "What stands in the light: one of the scenes that come with the program, or a file.",
        |ui, label| {
            let width = ui.available_width();
            let combo = ComboBox::from_id_salt("scene").selected_text(m.setup.scene.as_str()).width(width).truncate();
            let shown = combo.show_ui(ui, |ui| {
                for b in builtin::SCENES {
                    let chosen = m.setup.scene == b.name;
                    if ui.selectable_label(chosen, b.name).on_hover_text(b.description).clicked() && !chosen {
                        out.push(Action::Open(b.name.into()));
                    }
                }
            });
            shown.response.labelled_by(label.id).on_hover_text("Choose a built-in scene.");
        },
    );
    row(
        ui,
        "file",
        "A glTF scene (.glb, .gltf), a saved set-up (.toml) or a captured picture (.png). Files can also be dropped on the window.",
        |ui, label| {
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                if ui.button("Browse…").on_hover_text("Choose a file in the system's dialog.").clicked() {
                    out.push(Action::PickFile);
                }
                let named = !m.open_path.trim().is_empty();
                let open = ui.add_enabled(named, Button::new("Open")).on_hover_text("Open the file at this path.");
                let width = ui.available_width() - 8.0;
                let edit = ui.add_sized([width, 21.0], TextEdit::singleline(&mut m.open_path).hint_text("path"));
                let edit = edit.labelled_by(label.id).on_hover_text("Type a path and press Enter.");
                let entered = edit.lost_focus() && ui.input(|i| i.key_pressed(egui::Key::Enter));
                if named && (open.clicked() || entered) {
                    out.push(Action::Open(m.open_path.trim().into()));
                }
            });
        },
    );
    let size = m.bounds[1] - m.bounds[0];
    let facts = format!("{} triangles, {:.1} × {:.1} × {:.1} m", grouped(m.scene.triangles()), size.x, size.y, size.z);
    ui.label(RichText::new(facts).small().color(WEAK))
        .on_hover_text("Size of the scene: width, height and depth in metres.");
    if !m.scene.notes.is_empty() {
        let title = format!("What the loader changed ({})", m.scene.notes.len());
        ui.collapsing(RichText::new(title).small(), |ui| {
            for note in &m.scene.notes {
                ui.label(RichText::new(note).small());
            }
        });
    }
}

/// A number with thin gaps between thousands.
pub fn grouped(n: usize) -> String {
    let digits = n.to_string();
    let mut out = String::new();
    for (i, c) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            out.push(' ');
        }
        out.push(c);
    }
    out
}

fn technique(ui: &mut Ui, m: &mut Model) {
    compare::show(ui, m);
    let chosen = m.edited();
    // A high window shows more of the list.
    let most = (0.29 * ui.ctx().content_rect().height()).max(230.0);
    ScrollArea::vertical().id_salt("techniques").max_height(most).auto_shrink([false, true]).show(ui, |ui| {
        ui.spacing_mut().item_spacing.y = 2.0;
        for info in techniques::ALL {
            let refused = info.refuses(&m.setup.light);
            let button = Button::selectable(chosen.is_some_and(|c| c.id == info.id), info.title)
                .min_size(vec2(ui.available_width(), 21.0));
            let button = ui.add_enabled(refused.is_none(), button);
            let button = button.on_hover_text(format!("{}\n{}", info.doc, info.paper));
            if button.on_disabled_hover_text(refused.unwrap_or_default()).clicked() {
                m.select(info);
            }
        }
    });
    if let Some(reason) = m.info().refuses(&m.setup.light) {
        ui.label(RichText::new(reason).color(ui.visuals().warn_fg_color));
    }
    for note in &m.facts.notes {
        ui.label(RichText::new(note).small().color(ui.visuals().warn_fg_color));
    }
}

fn parameters(ui: &mut Ui, m: &mut Model) {
    let Some(chosen) = m.edited() else {
        ui.label(RichText::new("The truth has no parameters but its samples, above.").small().color(WEAK));
        return;
    };
    ui.push_id(chosen.id, |ui| {
        let values = m.edited_values();
        for group in chosen.params {
            for spec in group.specs {
                let value = values.entry(spec.name.into()).or_insert_with(|| spec.default());
                parameter(ui, spec, value);
            }
        }
    });
}

fn camera(ui: &mut Ui, m: &mut Model) {
    let scene = m.scene.clone();
    let now = m.setup.camera;
    let presets = scene.cameras.iter().map(|c| (c.name.as_str(), c.camera == now, "Look from here.".to_string()));
    if let Some(i) = chips(ui, presets) {
        m.setup.camera = scene.cameras[i].camera;
        m.home = m.setup.camera;
        m.camera_chosen = true;
    }
    freeze::show(ui, m);
    let c = &mut m.setup.camera;
    slide(ui, "field of view", "Vertical angle that the picture covers.", &mut c.fov, 5.0..=120.0, false, "°");
    let far = c.far;
    let tip = "Nothing nearer than this is drawn. Techniques that divide depth logarithmically depend on it.";
    slide(ui, "near", tip, &mut c.near, 1e-3..=(far * 0.5).max(2e-3), true, "m");
    let near = c.near;
    let tip = "Nothing farther than this is drawn.";
    slide(ui, "far", tip, &mut c.far, (near * 2.0)..=(near * 2.0).max(1e5), true, "m");
    let o = scene.origin;
    vector(ui, "position", "Where the camera stands: x, y (up), z in metres.", &mut c.position, o, 0.05);
    vector(
        ui,
        "target",
        "The point that it looks at and turns around: x, y (up), z in metres.",
        &mut c.target,
        o,
        0.05,
    );
    if c.position == c.target {
        c.target.z -= 0.01;
    }
    if ui
        .button("Reset")
        .on_hover_text("Back to the preset chosen last, or to the camera of the file (key R).")
        .clicked()
    {
        m.setup.camera = m.home;
        m.camera_chosen = true;
    }
}

const AXES: [&str; 3] = ["x", "y", "z"];

/// A row, or far from zero three, with the three parts of a vector, shown with `origin` added: a place's in the scene's own coordinates.
pub fn vector(ui: &mut Ui, name: &str, tip: &str, v: &mut Vec3, origin: DVec3, speed: f32) -> bool {
    let before = *v;
    let part = |ui: &mut Ui, width: f32, label: &Response, axis: usize, part: &mut f32| {
        let origin = origin[axis];
        let now = place::original(*part, origin);
        let mut shown = now;
        let drag = DragValue::new(&mut shown).speed(speed).max_decimals(2).suffix(" m");
        let drag = drag.range(origin - 1e7..=origin + 1e7);
        field(ui, width, drag, &format!("{} in metres: {now}", AXES[axis])).labelled_by(label.id);
        if shown != now {
            *part = place::local(shown, origin);
        }
    };
    let parts = [&mut v.x, &mut v.y, &mut v.z].into_iter().enumerate();
    // Far from zero the digits of one fill a row.
    if origin.abs().max_element() >= 1e4 {
        for (axis, x) in parts {
            row(ui, &format!("{name} {}", AXES[axis]), tip, |ui, label| {
                part(ui, ui.available_width(), label, axis, x);
            });
        }
    } else {
        row(ui, name, tip, |ui, label| {
            let gap = 4.0;
            ui.spacing_mut().item_spacing.x = gap;
            let width = (ui.available_width() - 2.0 * gap) / 3.0;
            parts.for_each(|(axis, x)| part(ui, width, label, axis, x));
        });
    }
    *v != before
}

fn animation(ui: &mut Ui, m: &mut Model) {
    let scene = m.scene.clone();
    let duration = m.duration();
    ui.horizontal(|ui| {
        let (text, tip) =
            if m.playing { ("Pause", "Stop the clock (Space).") } else { ("Play", "Let the clock run (Space).") };
        if ui.add_sized([60.0, 21.0], Button::new(text)).on_hover_text(tip).clicked() {
            m.playing = !m.playing;
        }
        let names: Vec<String> = scene
            .animations
            .iter()
            .enumerate()
            .map(|(i, a)| if a.name.is_empty() { format!("animation {}", i + 1) } else { a.name.clone() })
            .collect();
        let mut chosen = m.setup.animation as usize;
        let width = ui.available_width();
        let combo = ComboBox::from_id_salt("animation").width(width).truncate();
        let combo = combo.show_index(ui, &mut chosen, names.len(), |i| names.get(i).cloned().unwrap_or_default());
        combo.on_hover_text("Which of the file's animations plays.");
        m.setup.animation = chosen as u32;
    });
    slide(
        ui,
        "time",
        "Where the animation stands. Drag to scrub.",
        &mut m.setup.time,
        0.0..=duration.max(0.01),
        false,
        "s",
    );
}

fn capture(ui: &mut Ui, m: &mut Model, out: &mut Vec<Action>) {
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
                let drag = DragValue::new(&mut m.setup.size[i]).range(1..=crate::setup::MAX_SIZE).suffix(" px");
                field(ui, width - 4.0, drag, tip).labelled_by(label.id);
            }
        },
    );
    let tip = ".png: the view, with the set-up inside, so that it opens here again. .exr: the raw values of the views visibility, truth, depth, position, normals, aliasing and counts.";
    let legend = "The view's legend, and the axes of charts, go into the picture.";
    row(ui, "legend", legend, |ui, label| {
        ui.checkbox(&mut m.setup.legend, "").labelled_by(label.id).on_hover_text(legend);
    });
    path_row(ui, "picture", tip, &mut m.picture_path);
    ui.horizontal(|ui| {
        let path = PathBuf::from(m.picture_path.trim());
        let ready = !m.capturing && !m.picture_path.trim().is_empty();
        let save = ui.add_enabled(ready, Button::new("Save picture"));
        if save.on_hover_text("Render at this size and write the file (F12: into capture-001.png and so on).").clicked()
        {
            out.push(Action::Capture(path));
        }
        if ui.button("Save as…").on_hover_text("Choose the file in the system's dialog.").clicked() {
            out.push(Action::PickCapture);
        }
        if m.capturing {
            ui.spinner();
        }
    });
    path_row(
        ui,
        "set-up",
        "All settings as a text file (.toml) that opens here and on the command line.",
        &mut m.setup_path,
    );
    let save = ui.add_enabled(!m.setup_path.trim().is_empty(), Button::new("Save set-up"));
    if save.on_hover_text("Write all settings into this file (Ctrl+S).").clicked() {
        out.push(Action::SaveSetup(PathBuf::from(m.setup_path.trim())));
    }
}

fn path_row(ui: &mut Ui, name: &str, tip: &str, path: &mut String) {
    row(ui, name, tip, |ui, label| {
        let width = ui.available_width();
        ui.add_sized([width, 21.0], TextEdit::singleline(path)).labelled_by(label.id).on_hover_text(tip);
    });
}
