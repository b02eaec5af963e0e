//! A file dialog of our own, for systems that have none.

use super::model::{Action, Model};
use crate::files;
use egui::{Align, Button, Context, Key, Layout, Modal, RichText, ScrollArea, TextEdit, vec2};
use std::path::{Path, PathBuf};

/// What can be opened, and what a picture can be saved as.
pub const OPENED: [&str; 11] = ["glb", "gltf", "obj", "ply", "stl", "toml", "png", "apng", "webp", "csv", "json"];
pub const SAVED: [&str; 2] = ["png", "exr"];

/// The dialog while it is open.
pub struct Picker {
    /// A picture is to be saved, not a file to be opened.
    pub save: bool,
    folder: PathBuf,
    /// Name of the chosen file, or a path as typed.
    name: String,
    /// What was wrong with it.
    wrong: String,
    /// It has been drawn: the field has the focus.
    drawn: bool,
    /// What the folder holds, folders first; or why that is not known.
    entries: Result<Vec<(String, bool)>, String>,
}

impl Picker {
    /// Opens in the folder where the last one was, in that of `at`, or where the program was started.
    pub fn new(save: bool, at: &Path, last: Option<PathBuf>) -> Picker {
        let here = std::env::current_dir().unwrap_or_default();
        let folder = last.or(at.parent().map(|f| here.join(f))).filter(|f| f.is_dir()).unwrap_or(here);
        let name = at.file_name().filter(|_| save).map_or(String::new(), |n| n.to_string_lossy().into_owned());
        let mut picker = Picker { save, folder, name, wrong: String::new(), drawn: false, entries: Ok(Vec::new()) };
        picker.list();
        picker
    }

    fn list(&mut self) {
        let endings: &[&str] = if self.save { &SAVED } else { &OPENED };
        let read = || -> std::io::Result<Vec<(String, bool)>> {
            let mut all = Vec::new();
            for entry in std::fs::read_dir(&self.folder)? {
                let path = entry?.path();
                let name = files::name_of(path.file_name().unwrap_or_default());
                let fits = path.extension().is_some_and(|e| endings.iter().any(|known| e.eq_ignore_ascii_case(known)));
                if !name.starts_with('.') && (path.is_dir() || fits) {
                    all.push((name, path.is_dir()));
                }
            }
            all.sort_by_key(|(name, folder)| (!folder, name.to_lowercase()));
            Ok(all)
        };
        self.entries = read().map_err(|e| e.to_string());
    }

    fn enter(&mut self, folder: PathBuf) {
        self.folder = folder;
        self.list();
    }

    /// The file that is named, if it is there and none to walk into.
    fn chosen(&mut self) -> Option<PathBuf> {
        self.wrong.clear();
        let path = self.folder.join(files::path_of(self.name.trim()));
        if self.name.trim().is_empty() {
            None
        } else if path.is_dir() {
            self.name.clear();
            self.enter(path);
            None
        } else if !self.save && !path.exists() {
            self.wrong = format!("There is no file {}.", path.display());
            None
        } else {
            Some(path)
        }
    }
}

/// Draws the dialog, if it is open.
pub fn show(ctx: &Context, m: &mut Model, out: &mut Vec<Action>) {
    let Some(picker) = &mut m.picker else { return };
    let (mut done, mut cancelled) = (None, false);
    let room = ctx.content_rect().size();
    let size = vec2((room.x - 60.0).clamp(200.0, 520.0), (room.y - 190.0).clamp(40.0, 360.0));
    let answer = Modal::new(egui::Id::unique("picker")).show(ctx, |ui| {
        ui.set_width(size.x);
        ui.label(RichText::new(if picker.save { "Save the picture" } else { "Open a file" }).heading());
        ui.horizontal(|ui| {
            let above = picker.folder.parent().map(Path::to_path_buf);
            if ui.add_enabled(above.is_some(), Button::new("Up")).clicked() {
                picker.enter(above.unwrap_or_default());
            }
            ui.add(egui::Label::new(RichText::new(picker.folder.display().to_string()).weak()).truncate());
        });
        let mut entered = None;
        ScrollArea::vertical().max_height(size.y).min_scrolled_height(size.y).auto_shrink([false, false]).show(
            ui,
            |ui| match &picker.entries {
                Err(why) => _ = ui.label(why),
                Ok(entries) if entries.is_empty() => {
                    ui.label(RichText::new("Nothing here that can be opened.").weak());
                }
                Ok(entries) => {
                    for (name, folder) in entries {
                        let text = if *folder { format!("{name}/") } else { name.clone() };
                        let button = Button::selectable(*name == picker.name, text);
                        let r = ui.add(button.min_size(vec2(ui.available_width(), 21.0)));
                        if r.clicked() && *folder {
                            entered = Some(name.clone());
                        } else if r.clicked() {
                            picker.name = name.clone();
                        }
                        if r.double_clicked() && !*folder {
                            done = Some(picker.folder.join(files::path_of(name)));
                        }
                    }
                }
            },
        );
        if let Some(name) = entered {
            let folder = picker.folder.join(files::path_of(&name));
            picker.enter(folder);
        }
        if !picker.wrong.is_empty() {
            ui.label(RichText::new(&picker.wrong).color(ui.visuals().error_fg_color));
        }
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            cancelled = ui.button("Cancel").clicked();
            let go =
                ui.add_enabled(!picker.name.trim().is_empty(), Button::new(if picker.save { "Save" } else { "Open" }));
            let edit = TextEdit::singleline(&mut picker.name).hint_text("name or path");
            let edit = ui.add_sized([ui.available_width(), 21.0], edit);
            if !std::mem::replace(&mut picker.drawn, true) {
                edit.request_focus();
            }
            // Enter means the file that is named, wherever the focus is but on another button.
            let others = ui.memory(|memory| memory.focused()).is_some_and(|id| id != edit.id);
            let enter = ui.input(|i| i.key_pressed(Key::Enter)) && (edit.lost_focus() || !others);
            if go.clicked() || enter {
                done = picker.chosen();
                edit.request_focus();
            }
        });
    });
    let save = picker.save;
    if done.is_some() || cancelled || answer.should_close() {
        m.folder = m.picker.take().map(|p| p.folder);
    }
    if let Some(path) = done {
        if save {
            m.picture_path = path.to_string_lossy().into_owned();
            out.push(Action::Capture(path));
        } else {
            out.push(Action::Open(files::name_of(path.as_os_str())));
        }
    }
}
