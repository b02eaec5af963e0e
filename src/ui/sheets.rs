//! The figure tab: a sheet of pictures for a paper, built from the present set-up.

use super::controls::{HEIGHT, Tip, chips, field, row};
use super::drawer::{beside, line, progress};
use super::model::{Action, Model};
use super::pictures::Picture;
use crate::figure::{Axis, FRAMES, Format, Inset, Kind, MOST_INSETS, Place, Sheet, Spec, WIDTHS, Width, measurable};
use crate::legend::side_name;
use crate::setup::Side;
use crate::view;
use anyhow::{Context, Result};
use egui::{
    Button, Color32, ComboBox, DragValue, Image, Painter, Pos2, Rect, RichText, ScrollArea, Stroke, StrokeKind,
    TextEdit, Ui, Vec2,
};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The sheet that is being built.
pub struct Builder {
    /// All but its base, which is the present set-up.
    pub spec: Spec,
    /// Where its files go, without an ending.
    pub path: String,
    pub formats: Vec<Format>,
    /// The next drag in the picture is an inset.
    pub marking: bool,
    /// The sheet drawn last, and its picture.
    pub drawn: Option<Arc<Sheet>>,
    pub preview: Option<Picture>,
}

impl Default for Builder {
    fn default() -> Builder {
        Builder {
            spec: Spec::default(),
            path: "figures/figure".into(),
            formats: Format::ALL.into(),
            marking: false,
            drawn: None,
            preview: None,
        }
    }
}

impl Builder {
    /// Takes over a spec from a file.
    pub fn open(&mut self, path: &Path, spec: Spec) {
        let stem = path.file_stem().map_or("figure".into(), |stem| stem.to_string_lossy().into_owned());
        *self = Builder { spec, path: format!("figures/{stem}"), ..Builder::default() };
    }

    /// The folder and the name of its files.
    fn target(&self) -> (PathBuf, String) {
        let path = PathBuf::from(self.path.trim());
        let name = path.file_name().map_or("figure".into(), |name| name.to_string_lossy().into_owned());
        (path.parent().unwrap_or(Path::new("")).to_path_buf(), name)
    }
}

impl Model {
    /// The spec of the sheet as it would be drawn now.
    ///
    /// # Errors
    /// The set-up cannot be written.
    pub fn sheet(&self) -> Result<Spec> {
        // Scenes count from where the program runs.
        let text = self.setup.to_toml(Path::new("figure.toml"))?;
        let mut base: toml::Table = toml::from_str(&text).context("the set-up cannot be read back")?;
        base.remove("legend");
        let mut spec = Spec { base, ..self.builder.spec.clone() };
        if spec.caption.trim().is_empty() {
            spec.caption = self.usual_caption();
        }
        Ok(spec)
    }

    /// What a sheet is called that has no caption of its own.
    fn usual_caption(&self) -> String {
        let view = self.setup.find_view(&self.setup.view).map_or("", |v| v.title);
        let scene = Kind::Scenes.label(&self.setup.scene);
        let of = match &self.builder.spec {
            Spec { rows: Axis::List(Kind::Techniques, _), .. }
            | Spec { columns: Axis::List(Kind::Techniques, _), .. } => String::new(),
            _ => format!(", {}", side_name(&self.setup, self.setup.front as usize)),
        };
        format!("The scene {scene}{of}: {view}.").replace('{', "{{")
    }
}

pub fn show(ui: &mut Ui, m: &mut Model, out: &mut Vec<Action>) {
    beside(ui, m, out, preview, controls);
}

/// The sheet as it was drawn last.
fn preview(ui: &mut Ui, m: &mut Model, _: &mut Vec<Action>) {
    let weak = |ui: &mut Ui, text: &str| {
        ui.centered_and_justified(|ui| ui.label(RichText::new(text).weak()));
    };
    let stale = match (&m.builder.drawn, m.sheet()) {
        (Some(drawn), Ok(now)) => drawn.spec != now,
        _ => false,
    };
    match &m.builder.preview {
        Some(Picture::Drawn(texture)) => {
            if stale {
                line(ui, "Something has changed since this was drawn: Preview draws it again, and Write does too.");
            }
            let size = texture.size_vec2();
            let width = ui.available_width() - 12.0;
            // No larger than drawn: text of a small sheet would be coarse.
            let scale = (width / size.x).min(1.0);
            ScrollArea::vertical().id_salt("sheet").auto_shrink([false, false]).show(ui, |ui| {
                ui.add(Image::new(texture).fit_to_exact_size(size * scale).alt_text("The sheet as it was drawn last"));
            });
        }
        Some(Picture::Failed(why)) => weak(ui, why),
        Some(Picture::Waiting) => weak(ui, "Drawing …"),
        None => {
            weak(ui, "A sheet for a paper, from what the picture shows now: choose its rows and columns, and write it.")
        }
    }
}

fn controls(ui: &mut Ui, m: &mut Model, out: &mut Vec<Action>) {
    match &m.measuring {
        Some(job) => progress(ui, job, out),
        None => start(ui, m, out),
    }
    let tip = "Where the files go: a folder and a name without ending. A folder that is not there is made.";
    row(ui, "files", tip, |ui, label| {
        let width = ui.available_width() - 4.0;
        ui.add_sized([width, HEIGHT], TextEdit::singleline(&mut m.builder.path)).labelled_by(label.id).tip(tip);
    });
    let told = |format: &Format| match format {
        Format::Png => "The sheet in pixels, with its spec inside: opened here, it is built again.",
        Format::Svg => "Text as text, pictures as they are, with the spec inside.",
        Format::Pdf => "For LaTeX and print: text as text, pictures without loss.",
        Format::Tex => "The figure environment with caption, numbers and label.",
    };
    let formats = &mut m.builder.formats;
    let items = Format::ALL.iter().map(|f| (f.ending(), formats.contains(f), told(f).to_string()));
    if let Some(i) = chips(ui, items) {
        let all = Format::ALL.iter().filter(|f| formats.contains(f) != (**f == Format::ALL[i]));
        *formats = all.copied().collect();
    }
    let hint = m.usual_caption().replace("{{", "{");
    let b = &mut m.builder;
    let tip = "Below the sheet, and in LaTeX. {rmse 1,2} stands for the measured number of row 1, column 2; empty: what stands there in grey.";
    let caption = TextEdit::multiline(&mut b.spec.caption)
        .desired_rows(2)
        .hint_text(hint)
        .desired_width(ui.available_width() - 6.0);
    let field_of = ui.add(caption).tip(tip);
    field_of.widget_info(|| egui::WidgetInfo::labeled(egui::Role::MultilineTextInput, true, "caption"));
    ui.horizontal(|ui| {
        ui.checkbox(&mut b.spec.draw_caption, "caption")
            .tip("The caption stands below the sheet. The LaTeX snippet cuts it off there and sets its own.");
        ui.checkbox(&mut b.spec.legend, "legend").tip("The view's legend stands once, below the pictures.");
        ui.checkbox(&mut b.spec.cells, "cells").tip("Each picture is written as a capture of its own too.");
    });
    axis(ui, m, true);
    axis(ui, m, false);
    numbers(ui, m);
    insets(ui, m);
    sizes(ui, m);
}

/// What draws and writes.
fn start(ui: &mut Ui, m: &mut Model, out: &mut Vec<Action>) {
    let mut asked = None;
    ui.horizontal(|ui| {
        let formats: Vec<&str> = m.builder.formats.iter().map(|f| f.ending()).collect();
        let ready = !formats.is_empty() && !m.builder.path.trim().is_empty();
        let write = ui.add_enabled(ready, Button::new("Write figure"));
        let (folder, name) = m.builder.target();
        let tip = format!("Draws the sheet and writes {} ({}).", folder.join(name).display(), formats.join(", "));
        if write.tip(tip).clicked() {
            asked = Some(true);
        }
        if ui.button("Preview").tip("Draws the sheet without writing it. The picture waits meanwhile.").clicked() {
            asked = Some(false);
        }
    });
    line(ui, "");
    let Some(write) = asked else { return };
    match m.sheet() {
        Ok(spec) => {
            let to = write.then(|| (m.builder.target(), m.builder.formats.clone()));
            out.push(Action::Sheet(Box::new(spec), to));
        }
        Err(e) => m.fail(&e),
    }
}

/// What rows or columns change.
fn axis(ui: &mut Ui, m: &mut Model, rows: bool) {
    let name = if rows { "rows" } else { "columns" };
    let scene = m.scene.clone();
    let axis = if rows { &m.builder.spec.rows } else { &m.builder.spec.columns };
    let told = |axis: &Axis| match axis {
        Axis::One => "one".to_string(),
        Axis::List(kind, _) => kind.id().into(),
        Axis::Changes(changes) => format!("{} of the file", changes.len()),
    };
    let mut chosen = axis.clone();
    let tip = "What differs from row to row, or from column to column. A spec's file can change any key of a set-up.";
    row(ui, name, tip, |ui, label| {
        let combo = ComboBox::from_id_salt(name).width(ui.available_width() - 4.0).selected_text(told(&chosen));
        let shown = combo.show_ui(ui, |ui| {
            if ui.selectable_label(chosen == Axis::One, "one").clicked() {
                chosen = Axis::One;
            }
            for kind in Kind::ALL {
                let now = matches!(&chosen, Axis::List(k, _) if *k == kind);
                if ui.selectable_label(now, kind.id()).clicked() && !now {
                    chosen = Axis::List(kind, first(m, kind));
                }
            }
        });
        shown.response.labelled_by(label.id).tip(tip);
    });
    if let Axis::List(kind, names) = &mut chosen {
        let mut all: Vec<String> = kind.names(&scene);
        if *kind == Kind::Techniques {
            all.retain(|id| crate::techniques::find(id).is_some_and(|info| m.setup.refusal(info).is_none()));
            all.push(Side::TRUTH.into());
        }
        if names == &["all"] {
            *names = all.clone();
        }
        // A file may name what is not in this list.
        let others: Vec<String> = names.iter().filter(|name| !all.contains(name)).cloned().collect();
        all.extend(others);
        let list = ScrollArea::vertical().id_salt(("names", name)).max_height(110.0);
        let clicked = list.show(ui, |ui| {
            let items = all.iter().map(|name| (name.as_str(), names.contains(name), kind.label(name)));
            chips(ui, items)
        });
        if let Some(i) = clicked.inner {
            // In the order of the clicks; the last one stays.
            match names.iter().position(|name| *name == all[i]) {
                Some(place) if names.len() > 1 => _ = names.remove(place),
                Some(_) => {}
                None => names.push(all[i].clone()),
            }
        }
    }
    *(if rows { &mut m.builder.spec.rows } else { &mut m.builder.spec.columns }) = chosen;
}

/// What a list begins with: what the picture shows.
fn first(m: &Model, kind: Kind) -> Vec<String> {
    let names = kind.names(&m.scene);
    let shown = match kind {
        Kind::Techniques => return vec![m.setup.technique.clone(), Side::TRUTH.into()],
        Kind::Views if view::VIEWS.iter().any(|v| v.id == m.setup.view) => m.setup.view.clone(),
        Kind::Scenes => m.setup.scene.clone(),
        Kind::Cameras => {
            let shown = m.scene.cameras.iter().find(|c| c.camera == m.setup.camera);
            shown.or(m.scene.cameras.first()).map_or(String::new(), |c| c.name.clone())
        }
        Kind::Lights => {
            let shown = m.scene.lights.iter().find(|l| l.light == m.setup.light);
            shown.or(m.scene.lights.first()).map_or(String::new(), |l| l.name.clone())
        }
        _ => names.first().cloned().unwrap_or_default(),
    };
    vec![shown]
}

/// Numbers that stand below pictures; others can be named in a spec's file.
const NUMBERS: [&str; 8] = ["error_share", "rmse", "mae", "flip", "jod", "contour_mean_px", "gpu_bytes", "rays"];

fn numbers(ui: &mut Ui, m: &mut Model) {
    line(ui, "numbers below each picture");
    let chosen = &mut m.builder.spec.numbers;
    let mut all: Vec<&'static str> = NUMBERS.into();
    all.extend(chosen.iter().filter_map(|id| measurable(id).ok()).map(|c| c.id).filter(|id| !NUMBERS.contains(id)));
    let doc = |id: &str| measurable(id).map_or(String::new(), |c| c.doc.to_string());
    let items = all.iter().map(|id| (*id, chosen.iter().any(|c| c == id), doc(id)));
    if let Some(i) = chips(ui, items) {
        match chosen.iter().position(|id| id == all[i]) {
            Some(place) => _ = chosen.remove(place),
            None => chosen.push(all[i].into()),
        }
    }
}

fn insets(ui: &mut Ui, m: &mut Model) {
    let tip = "Parts of each picture that are shown magnified, texel by texel. Drag a rectangle in the picture; Escape: cancel.";
    row(ui, "insets", tip, |ui, _| {
        let room = m.builder.spec.insets.len() < MOST_INSETS;
        let mark = Button::selectable(m.builder.marking, "Drag one").frame_when_inactive(true);
        if ui.add_enabled(room, mark).tip(tip).clicked() {
            m.builder.marking ^= true;
            m.framed |= m.builder.marking;
        }
        let below = m.builder.spec.insets_at == Place::Below;
        let name = if below { "below" } else { "beside" };
        if ui.button(name).tip("Whether insets stand below each picture or beside it.").clicked() {
            m.builder.spec.insets_at = if below { Place::Beside } else { Place::Below };
        }
    });
    let mut gone = None;
    for (i, inset) in m.builder.spec.insets.iter_mut().enumerate() {
        ui.horizontal(|ui| {
            ui.spacing_mut().item_spacing.x = 3.0;
            ui.color_edit_button_srgb(&mut inset.color).tip("The colour of its frames.");
            let before = inset.at;
            for (side, what) in ["Left edge", "Upper edge", "Width", "Height"].into_iter().enumerate() {
                let range = if side < 2 { 0.0..=0.99 } else { 0.01..=1.0 };
                let tip = format!("{what}, % of the picture.");
                let mut percent = 100.0 * inset.at[side];
                let range = 100.0 * range.start()..=100.0 * range.end();
                let drag = DragValue::new(&mut percent).range(range).speed(0.2).max_decimals(1);
                if field(ui, 46.0, drag, &tip).changed() {
                    inset.at[side] = percent / 100.0;
                }
            }
            if inset.at != before {
                let [x, y, w, h] = inset.at;
                inset.at = [x.min(1.0 - w).max(0.0), y.min(1.0 - h).max(0.0), w, h];
            }
            if ui.small_button("×").tip("Remove this inset.").clicked() {
                gone = Some(i);
            }
        });
    }
    if let Some(i) = gone {
        m.builder.spec.insets.remove(i);
    }
}

fn sizes(ui: &mut Ui, m: &mut Model) {
    let picture = m.setup.part()[2];
    let b = &mut m.builder.spec;
    let told = |width: &Width| match width {
        Width::Journal(name) => WIDTHS.iter().find(|w| w.0 == *name).map_or(String::new(), |w| w.2.into()),
        Width::Mm(_) => "millimetres".into(),
        Width::Picture(_) => "by its pictures".into(),
    };
    let tip = "The sheet's width. Pictures are drawn in as many pixels as they have room at this many pixels an inch.";
    row(ui, "width", tip, |ui, label| {
        let combo = ComboBox::from_id_salt("sheet's width").width(ui.available_width() - 4.0).truncate();
        let shown = combo.selected_text(told(&b.width)).show_ui(ui, |ui| {
            for (name, mm, what) in WIDTHS {
                let now = b.width == Width::Journal(name);
                if ui.selectable_label(now, format!("{what} ({mm:.1} mm)")).clicked() {
                    b.width = Width::Journal(name);
                }
            }
            if ui.selectable_label(matches!(b.width, Width::Mm(_)), "millimetres").clicked() {
                b.width = Width::Mm(b.width.mm().unwrap_or(170.0).round());
            }
            if ui.selectable_label(matches!(b.width, Width::Picture(_)), "by its pictures").clicked() {
                b.width = Width::Picture(picture.max(16));
            }
        });
        shown.response.labelled_by(label.id).tip(tip);
    });
    match &mut b.width {
        Width::Journal(_) => {}
        Width::Mm(mm) => row(ui, "", tip, |ui, _| {
            _ = field(ui, 80.0, DragValue::new(mm).range(10.0..=2000.0).suffix(" mm"), "Width of the sheet.")
        }),
        Width::Picture(pixels) => row(ui, "", tip, |ui, _| {
            _ = field(ui, 80.0, DragValue::new(pixels).range(16..=4096).suffix(" px"), "Width of each picture.")
        }),
    }
    row(ui, "resolution", "Pixels an inch, and the size of labels in points.", |ui, _| {
        field(
            ui,
            78.0,
            DragValue::new(&mut b.dpi).range(50..=1200).suffix(" dpi"),
            "Pixels an inch: 300 is usual for print.",
        );
        let size = DragValue::new(&mut b.font_size).range(4.0..=24.0).speed(0.1).max_decimals(1).suffix(" pt");
        field(ui, 64.0, size, "Size of labels and caption, points.");
    });
}

/// Frames of the insets over the picture, while the tab is open.
pub fn frames(painter: &Painter, part: Rect, m: &Model) {
    for inset in &m.builder.spec.insets {
        let [x, y, w, h] = inset.at.map(|share| share as f32);
        let min: Pos2 = part.min + part.size() * Vec2::new(x, y);
        let rect = Rect::from_min_size(min, part.size() * Vec2::new(w, h));
        let [r, g, b] = inset.color;
        painter.rect_stroke(rect, 0.0, Stroke::new(2.0, Color32::from_rgb(r, g, b)), StrokeKind::Inside);
    }
}

/// Adds an inset that shows these shares of the picture.
pub fn add(m: &mut Model, at: [f64; 4]) {
    let insets = &mut m.builder.spec.insets;
    if insets.len() < MOST_INSETS {
        let free = FRAMES.into_iter().find(|color| insets.iter().all(|inset| inset.color != *color));
        insets.push(Inset { at, color: free.unwrap_or(FRAMES[0]) });
    }
    m.builder.marking = false;
}
