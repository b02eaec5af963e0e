//! The start screen: lessons by picture, files, and a gallery of set-ups.

use super::journal::Left;
use super::model::{Action, Model};
use super::pictures::{self, Picture, Pictures, Subject};
use super::recent::Recent;
use super::words::Words;
use crate::{files, gallery, lessons};
use egui::text::{LayoutJob, TextWrapping};
use egui::{Align, Button, CentralPanel, FontId, Frame, Image, Layout, Margin, Rect, Response, RichText, ScrollArea};
use egui::{Role, Sense, StrokeKind, Ui, Vec2, WidgetInfo, vec2};

/// The start screen.
#[derive(Default)]
pub struct Start {
    pub shown: bool,
    /// The files opened last, or why they are not known; None: not asked for yet.
    pub recent: Option<Result<Vec<Recent>, String>>,
    /// What windows that are gone have left.
    pub left: Vec<Left>,
}

/// Width of a tile at least, points, and of all of them together at most.
const TILE: f32 = 236.0;
const WIDEST: f32 = 2000.0;
/// Between tiles, and around a tile's picture.
const GAP: f32 = 10.0;
const PAD: f32 = 6.0;
/// Height of a tile's words, points.
const WORDS: f32 = 62.0;
/// Most tiles beside each other.
const COLUMNS: usize = 6;

/// Draws it over the whole window.
pub fn show(ui: &mut Ui, m: &mut Model, out: &mut Vec<Action>) {
    if m.start.recent.is_none() {
        m.start.recent = Some(Ok(Vec::new()));
        out.push(Action::LookUpRecent);
    }
    let frame = Frame::new().fill(ui.visuals().panel_fill).inner_margin(Margin::symmetric(20, 12));
    CentralPanel::default().frame(frame).show(ui, |ui| {
        head(ui, m, out);
        ui.add_space(6.0);
        ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
            let room = (ui.available_width() - 12.0).min(WIDEST);
            ui.set_max_width(room);
            left(ui, m, out);
            let columns = (((room + GAP) / (TILE + GAP)) as usize).clamp(1, COLUMNS);
            let mut cells = Vec::new();
            let tiles: Vec<Tile> = lessons::all().iter().map(Tile::lesson).collect();
            if let Some(i) = grid(ui, m, &tiles, columns, &mut cells, out) {
                out.extend(m.begin(&lessons::all()[i], 0));
            }
            ui.add_space(14.0);
            open(ui, m, out);
            ui.add_space(14.0);
            ui.label(RichText::new("Gallery").heading());
            ui.label(RichText::new("Set-ups to begin with: what a scene or a technique is at its best.").weak());
            ui.add_space(4.0);
            let tiles: Vec<Tile> = gallery::all().iter().map(Tile::exhibit).collect();
            if let Some(i) = grid(ui, m, &tiles, columns, &mut cells, out) {
                out.push(Action::Exhibit(&gallery::all()[i].id));
            }
            pictures::walk(ui, &cells, columns);
            ui.add_space(12.0);
        });
    });
}

fn head(ui: &mut Ui, m: &mut Model, out: &mut Vec<Action>) {
    ui.horizontal(|ui| {
        ui.label(RichText::new("What do you want to see?").size(22.0).strong());
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            let free = Button::new(RichText::new("Explore freely").strong());
            if ui.add(free).on_hover_text("Leave this screen (Esc). F8 brings it back.").clicked() {
                m.start.shown = false;
            }
            if ui.button("Open a file…").on_hover_text("A scene, a set-up, a captured picture or results.").clicked()
            {
                out.push(Action::PickFile);
            }
            if ui.button("Glossary").on_hover_text("What the words mean.").clicked() {
                m.words = Some(Words::default());
            }
        });
    });
}

/// What was open in windows that are gone.
fn left(ui: &mut Ui, m: &Model, out: &mut Vec<Action>) {
    if m.start.left.is_empty() {
        return;
    }
    ui.label(RichText::new("Go on where you were").heading());
    for (i, left) in m.start.left.iter().enumerate() {
        ui.horizontal(|ui| {
            let button = ui.add_enabled(left.told.is_ok(), Button::new(&left.title).min_size(vec2(200.0, 22.0)));
            if button.on_hover_text("Open it as it was.").clicked() {
                out.push(Action::GoOn(i));
            }
            if ui.small_button("×").on_hover_text("Let go of it.").clicked() {
                out.push(Action::Forget(i));
            }
            let told = match &left.told {
                Ok(told) => RichText::new(told).weak(),
                Err(why) => RichText::new(why).color(ui.visuals().warn_fg_color),
            };
            ui.add(egui::Label::new(told.small()).truncate());
        });
    }
    ui.add_space(14.0);
}

/// Files opened before.
fn open(ui: &mut Ui, m: &Model, out: &mut Vec<Action>) {
    ui.label(RichText::new("Recent files").heading());
    let files = match &m.start.recent {
        Some(Err(why)) => {
            ui.label(RichText::new(why).color(ui.visuals().warn_fg_color));
            return;
        }
        Some(Ok(files)) if !files.is_empty() => files,
        _ => {
            ui.label(RichText::new("None yet. Files can also be dropped on the window.").weak());
            return;
        }
    };
    for recent in files {
        let path = files::path_of(&recent.name);
        let name = path.file_name().map_or(recent.name.clone(), |n| n.to_string_lossy().into_owned());
        let folder = path.parent().map_or(String::new(), |f| f.display().to_string());
        ui.horizontal(|ui| {
            let button = ui.add_enabled(recent.missing.is_none(), Button::new(name).min_size(vec2(200.0, 22.0)));
            if button.on_hover_text(path.display().to_string()).clicked() {
                out.push(Action::Open(recent.name.clone()));
            }
            let told = recent.missing.as_ref().map_or(folder.clone(), |why| format!("{folder}: {why}"));
            ui.add(egui::Label::new(RichText::new(told).small().weak()).truncate());
        });
    }
}

/// A picture with words that is clicked.
struct Tile {
    subject: Subject,
    title: &'static str,
    about: &'static str,
}

impl Tile {
    fn lesson(lesson: &'static lessons::Lesson) -> Tile {
        Tile { subject: Subject::Lesson(&lesson.id), title: &lesson.title, about: &lesson.see }
    }

    fn exhibit(exhibit: &'static gallery::Exhibit) -> Tile {
        Tile { subject: Subject::Exhibit(&exhibit.id), title: &exhibit.title, about: &exhibit.about }
    }
}

/// Tiles in rows; the one that was clicked.
fn grid(
    ui: &mut Ui,
    m: &mut Model,
    tiles: &[Tile],
    columns: usize,
    cells: &mut Vec<Response>,
    out: &mut Vec<Action>,
) -> Option<usize> {
    let (pictures, busy) = (&mut m.pictures, m.measuring.is_some());
    let wide = (ui.available_width() - (columns - 1) as f32 * GAP) / columns as f32;
    let mut clicked = None;
    ui.spacing_mut().item_spacing = Vec2::splat(GAP);
    for (row, some) in tiles.chunks(columns).enumerate() {
        ui.horizontal(|ui| {
            for (i, tile) in some.iter().enumerate() {
                let cell = cell(ui, pictures, tile, wide.floor(), busy, out);
                if cell.clicked() {
                    clicked = Some(row * columns + i);
                }
                cells.push(cell);
            }
        });
        // Rows are whole, so that the arrow keys find what stands above and below.
        let missing = columns - some.len();
        if missing > 0
            && let Some(last) = cells.last().cloned()
        {
            cells.extend(std::iter::repeat_n(last, missing));
        }
    }
    clicked
}

fn cell(ui: &mut Ui, pictures: &mut Pictures, tile: &Tile, wide: f32, busy: bool, out: &mut Vec<Action>) -> Response {
    let picture = vec2(wide - 2.0 * PAD, ((wide - 2.0 * PAD) * 0.625).round());
    let (rect, r) = ui.allocate_exact_size(vec2(wide, picture.y + 2.0 * PAD + WORDS), Sense::click());
    r.widget_info(|| WidgetInfo::labeled(Role::Button, true, tile.title));
    if !ui.is_rect_visible(rect) {
        return r;
    }
    let look = *ui.style().interact(&r);
    let lit = r.hovered() || r.has_focus();
    let fill = if lit { look.weak_bg_fill } else { ui.visuals().faint_bg_color };
    ui.painter().rect(
        rect,
        6.0,
        fill,
        if lit { look.bg_stroke } else { ui.visuals().window_stroke },
        StrokeKind::Inside,
    );
    let place = Rect::from_min_size(rect.min + Vec2::splat(PAD), picture);
    ui.painter().rect_filled(place, 4.0, ui.visuals().extreme_bg_color);
    match pictures.look(&tile.subject, busy, out) {
        Picture::Drawn(texture) => {
            Image::from_texture((texture.id(), picture)).corner_radius(4).paint_at(ui, place);
        }
        Picture::Waiting => {}
        Picture::Failed(why) => {
            let why = ui.painter().layout(
                why.clone(),
                FontId::proportional(11.5),
                ui.visuals().weak_text_color(),
                picture.x - 12.0,
            );
            ui.painter().galley(place.min + vec2(6.0, 6.0), why, ui.visuals().weak_text_color());
        }
    }
    let at = place.left_bottom() + vec2(2.0, 5.0);
    let title =
        ui.painter().layout_no_wrap(tile.title.into(), FontId::proportional(15.0), ui.visuals().strong_text_color());
    let below = at + vec2(0.0, title.size().y + 1.0);
    ui.painter().galley(at, title, ui.visuals().strong_text_color());
    let weak = ui.visuals().weak_text_color();
    let mut about = LayoutJob::simple(tile.about.into(), FontId::proportional(12.5), weak, picture.x - 4.0);
    about.wrap = TextWrapping { max_rows: 2, ..about.wrap };
    let about = ui.painter().layout_job(about);
    ui.painter().galley(below, about, weak);
    r
}
