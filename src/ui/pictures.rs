//! Small pictures: what they are of, those drawn so far, and where built-in scenes are shown by them.

use super::controls::Tip;
use super::model::{Action, Model};
use crate::scene::builtin::cases::{CASES, Case};
use egui::text::{LayoutJob, TextWrapping};
use egui::{
    EventFilter, FontId, Image, Key, Rect, Response, Role, Sense, StrokeKind, TextStyle, TextureHandle, Ui, Vec2,
};
use egui::{WidgetInfo, vec2};
use std::collections::HashMap;

/// Pictures with which those of rows are forgotten: the scenes' alone are never as many.
const KEPT: usize = 200;
/// Pixels of a built-in scene's picture.
pub const SIZE: [u32; 2] = [256, 160];
/// Pixels of a tile's picture on the start screen.
pub const TILE: [u32; 2] = [384, 240];
/// Size of a case's picture among the others, points: two pixels each way, so that edges are smooth.
const SMALL: Vec2 = vec2(128.0, 80.0);
/// Room around a case's picture and title, points.
const PAD: f32 = 3.0;
/// Between two cases, points.
const GAP: f32 = 3.0;
/// Height of a case's title of two lines and its id, points.
const TEXT: f32 = 43.0;
/// Most cases beside each other.
const COLUMNS: usize = 6;

/// What a small picture is of.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Subject {
    /// A measured row: its set-up (JSON).
    Row(String),
    /// A built-in scene, by its name.
    Scene(&'static str),
    /// What a lesson begins with, and a set-up of the gallery, by their ids.
    Lesson(&'static str),
    Exhibit(&'static str),
}

/// A picture that is drawn beside the window.
pub enum Picture {
    Waiting,
    Drawn(TextureHandle),
    Failed(String),
}

/// The small pictures.
#[derive(Default)]
pub struct Pictures(HashMap<Subject, Picture>);

impl Pictures {
    /// What is there of a picture. A missing one is asked for, once: after the one that is being drawn, and not while the
    /// window is `busy` measuring.
    pub fn look(&mut self, subject: &Subject, busy: bool, out: &mut Vec<Action>) -> &Picture {
        let drawing = || self.0.values().any(|p| matches!(p, Picture::Waiting));
        if !busy && !self.0.contains_key(subject) && !drawing() {
            if self.0.len() >= KEPT {
                self.forget_rows();
            }
            self.take(subject.clone(), Picture::Waiting);
            out.push(Action::Thumbnail(subject.clone()));
        }
        self.0.get(subject).unwrap_or(&Picture::Waiting)
    }

    /// Keeps a picture.
    pub fn take(&mut self, subject: Subject, picture: Picture) {
        self.0.insert(subject, picture);
    }

    /// Forgets the pictures of rows.
    pub fn forget_rows(&mut self) {
        self.0.retain(|subject, _| !matches!(subject, Subject::Row(_)));
    }

    /// Paints a built-in scene's picture, or an empty frame where there is none.
    fn paint(&mut self, ui: &Ui, rect: Rect, scene: &'static str, busy: bool, out: &mut Vec<Action>) {
        ui.painter().rect_filled(rect, 2.0, ui.visuals().extreme_bg_color);
        if let Picture::Drawn(texture) = self.look(&Subject::Scene(scene), busy, out) {
            Image::from_texture((texture.id(), rect.size())).corner_radius(2).paint_at(ui, rect);
        }
        ui.painter().rect_stroke(rect, 2.0, ui.visuals().window_stroke, StrokeKind::Inside);
    }
}

/// A tooltip on a built-in scene: its picture, and what it is.
pub fn about(ui: &mut Ui, pictures: &mut Pictures, scene: &'static str, doc: &str, busy: bool, out: &mut Vec<Action>) {
    let (rect, _) = ui.allocate_exact_size(2.0 * SMALL, Sense::hover());
    pictures.paint(ui, rect, scene, busy, out);
    ui.set_max_width(2.0 * SMALL.x);
    ui.label(doc);
}

/// All cases by picture, title and id; the one that was clicked. Arrow keys move the focus.
pub fn cases(ui: &mut Ui, m: &mut Model, out: &mut Vec<Action>) -> Option<&'static Case> {
    let (pictures, busy, chosen) = (&mut m.pictures, m.measuring.is_some(), m.timeline.case);
    ui.spacing_mut().item_spacing = Vec2::splat(GAP);
    let room = ui.ctx().content_rect().width() - 40.0;
    let columns = ((room / (SMALL.x + 2.0 * PAD + GAP)) as usize).clamp(1, COLUMNS);
    let mut cells = Vec::new();
    for row in CASES.chunks(columns) {
        ui.horizontal(|ui| {
            for case in row {
                let own = chosen.is_some_and(|c| c.id == case.id);
                cells.push(cell(ui, pictures, case, own, busy, out));
            }
        });
    }
    walk(ui, &cells, columns);
    cells.iter().zip(CASES).find(|(cell, _)| cell.clicked()).map(|(_, case)| case)
}

/// Moves the focus among cells in rows by the arrow keys.
pub fn walk(ui: &mut Ui, cells: &[Response], columns: usize) {
    if let Some(focused) = cells.iter().position(Response::has_focus) {
        // egui's own way through a menu knows up and down alone.
        let filter = EventFilter { horizontal_arrows: true, vertical_arrows: true, ..EventFilter::default() };
        ui.memory_mut(|memory| memory.set_focus_lock_filter(cells[focused].id, filter));
        let steps = [
            (Key::ArrowLeft, focused.checked_sub(1)),
            (Key::ArrowRight, focused.checked_add(1)),
            (Key::ArrowUp, focused.checked_sub(columns)),
            (Key::ArrowDown, focused.checked_add(columns)),
        ];
        let step = steps.into_iter().find(|(key, _)| ui.input(|i| i.key_pressed(*key)));
        if let Some(next) = step.and_then(|(_, to)| cells.get(to?)) {
            next.request_focus();
            next.scroll_to_me(None);
        }
    }
}

fn cell(
    ui: &mut Ui,
    pictures: &mut Pictures,
    case: &'static Case,
    own: bool,
    busy: bool,
    out: &mut Vec<Action>,
) -> Response {
    let (rect, r) = ui.allocate_exact_size(SMALL + vec2(2.0 * PAD, 2.0 * PAD + TEXT), Sense::click());
    let name = format!("{} ({})", case.title, case.id);
    r.widget_info(|| WidgetInfo::selected(Role::Button, true, own, &name));
    // A scene is drawn only where its picture is in sight.
    if ui.is_rect_visible(rect) {
        let look = ui.style().interact_selectable(&r, own);
        if own || r.hovered() || r.has_focus() {
            ui.painter().rect(rect, look.corner_radius, look.weak_bg_fill, look.bg_stroke, StrokeKind::Inside);
        }
        let picture = Rect::from_min_size(rect.min + Vec2::splat(PAD), SMALL);
        pictures.paint(ui, picture, case.id, busy, out);
        let mut title = LayoutJob::simple(case.title.into(), FontId::proportional(12.5), look.text_color(), SMALL.x);
        title.wrap = TextWrapping { max_rows: 2, ..title.wrap };
        let weak = if own { look.text_color() } else { ui.visuals().weak_text_color() };
        let title = ui.painter().layout_job(title);
        let at = picture.left_bottom() + vec2(0.0, 2.0);
        let below = at + vec2(0.0, title.size().y);
        ui.painter().galley(at, title, weak);
        let id = ui.painter().layout_no_wrap(case.id.into(), TextStyle::Small.resolve(ui.style()), weak);
        ui.painter().galley(below, id, weak);
    }
    r.tip_beside(ui.clip_rect(), case.doc)
}
