//! A pixel inspected: pinned in the picture, its story in the drawer, why it is wrong, and what would help, tried on the spot. And the
//! magnifier.

use super::drawer;
use super::gizmo::project;
use super::model::{Action, Model, Tab};
use super::style::{ACCENT, SUN, TEXT};
use crate::measure::diagnosis::{Errors, Remedy};
use crate::measure::story::{Section, Story};
use crate::scene::Camera;
use crate::setup::Setup;
use egui::scroll_area::ScrollBarVisibility;
use egui::{
    Align2, Button, Color32, CursorIcon, FontId, Grid, Id, Key, Label, LayerId, Order, Painter, Pos2, Rect, Response,
    RichText, ScrollArea, Shape, Stroke, StrokeKind, TextureId, Ui, Vec2, pos2, vec2,
};
use glam::Vec3;

/// What is inspected, and what was tried.
#[derive(Default)]
pub struct Inspect {
    /// The next click into the picture pins a pixel.
    pub picking: bool,
    /// Of the pinned pixel, as the picture was last at rest.
    pub story: Option<Box<Story>>,
    /// Why there is none.
    pub failed: Option<String>,
    pub trying: Option<Trying>,
    pub tried: Option<Tried>,
    pub magnifier: Magnifier,
    /// Width over height of the first side's picture, to which the pinned place belongs.
    aspect: Option<f32>,
}

/// A change that is being tried.
pub struct Trying {
    /// The window's number of the work.
    pub job: u64,
    pub remedy: Remedy,
    pub before: Box<Setup>,
}

/// A change that was tried, and what it did.
pub struct Tried {
    pub remedy: Remedy,
    pub before: Box<Setup>,
    pub errors: [Errors; 2],
}

/// The magnifier under the pointer.
pub struct Magnifier {
    pub on: bool,
    /// Pixels of the window for one of the picture, along each side.
    pub times: u32,
    /// The picture on the GPU, and its pixels.
    pub picture: Option<(TextureId, [u32; 2])>,
}

impl Default for Magnifier {
    fn default() -> Magnifier {
        Magnifier { on: false, times: 8, picture: None }
    }
}

/// What the magnifier can be set to.
pub const TIMES: [u32; 2] = [2, 32];

impl Magnifier {
    /// Twice as large, or half.
    pub fn step(&mut self, larger: bool) {
        let times = if larger { self.times * 2 } else { self.times / 2 };
        self.times = times.clamp(TIMES[0], TIMES[1]);
    }
}

impl Model {
    /// Pins the pixel at a place of a side's picture, 0 to 1 from its upper left corner, and shows its story.
    pub fn pin(&mut self, at: [f32; 2]) {
        self.setup.probe = at.map(|share| share.clamp(0.0, 1.0));
        self.drawer = Some(Tab::Pixel);
        self.inspect.picking = false;
        self.inspect.tried = None;
        self.inspect.failed = None;
    }

    /// The place whose story is wanted.
    pub fn inspected(&self) -> Option<[f32; 2]> {
        (self.drawer == Some(Tab::Pixel)).then_some(self.setup.probe)
    }

    /// Begins to try a change of a parameter, which is a step that can be undone: the set-ups before and after.
    pub fn begin_try(&mut self, job: u64, remedy: Remedy) -> [Setup; 2] {
        self.history.commit(&self.setup, true);
        let before = self.setup.clone();
        self.setup = remedy.applied(&self.setup);
        self.history.commit(&self.setup, true);
        self.inspect.tried = None;
        self.inspect.trying = Some(Trying { job, remedy, before: Box::new(before.clone()) });
        [before, self.setup.clone()]
    }

    /// Takes in what a change did.
    pub fn end_try(&mut self, job: u64, errors: Option<[Errors; 2]>) {
        if let Some(Trying { remedy, before, .. }) = self.inspect.trying.take_if(|t| t.job == job) {
            self.inspect.tried = errors.map(|errors| Tried { remedy, before, errors });
        }
    }

    /// Takes a tried change back: as the step that it was, or, where more has been changed since, by itself.
    fn take_back(&mut self) -> Option<Action> {
        let tried = self.inspect.tried.take()?;
        let now = Setup { camera: tried.before.camera, time: tried.before.time, ..self.setup.clone() };
        if now == tried.remedy.applied(&tried.before) && self.setup.camera == tried.before.camera {
            return self.undo();
        }
        let values = self.setup.params.entry(tried.before.technique.clone()).or_default();
        values.insert(tried.remedy.name.into(), tried.remedy.from);
        None
    }
}

/// Pins a pixel by Alt and a click, or by the next click after I.
pub fn pick(ui: &Ui, rect: Rect, r: &Response, m: &mut Model) {
    m.inspect.picking &= !ui.input(|i| i.key_pressed(Key::Escape));
    let alt = ui.input(|i| i.modifiers.alt);
    if (m.inspect.picking || alt) && r.contains_pointer() {
        ui.ctx().set_cursor_icon(CursorIcon::Crosshair);
    }
    if let Some(at) = r.interact_pointer_pos().filter(|_| r.clicked() && (m.inspect.picking || alt))
        && let Some(part) = super::compare::parts(rect, &m.setup).into_iter().find(|part| part.seen.contains(at))
    {
        let at = (at - part.whole.min) / part.whole.size();
        m.pin([at.x, at.y]);
    }
}

/// Keeps the pinned place where it is in the scene while the picture's shape changes: what is seen above and below stays. `rect`: all of
/// the first side's picture.
pub fn follow(rect: Rect, m: &mut Model) {
    let aspect = rect.width() / rect.height();
    let before = m.inspect.aspect.replace(aspect);
    let pinned = m.drawer == Some(Tab::Pixel) || m.inspect.story.is_some();
    if let Some(before) = before.filter(|before| pinned && (before / aspect - 1.0).abs() > 1e-4) {
        let moved = |probe: &mut [f32; 2]| probe[0] = (0.5 + (probe[0] - 0.5) * before / aspect).clamp(0.0, 1.0);
        moved(&mut m.setup.probe);
        m.history.move_probes(moved);
    }
}

/// What is said while a pixel is picked.
pub const PICKING: &str = "Click a pixel to inspect it. Escape: cancel.";

/// Draws the drawer's tab.
pub fn show(ui: &mut Ui, m: &mut Model, out: &mut Vec<Action>) {
    drawer::beside(ui, m, out, told, helped);
}

/// Lines of a column of the story.
const COLUMN: f32 = 250.0;

/// The story in columns.
fn told(ui: &mut Ui, m: &mut Model, _: &mut Vec<Action>) {
    let Some(story) = &m.inspect.story else {
        let text = match &m.inspect.failed {
            Some(why) => why.clone(),
            None if m.setup.refusal(m.info()).is_some() => "The technique does not serve this light.".into(),
            None => "The pinned pixel's story follows once the picture rests and the truth is traced. Alt and a click into the picture, or I and a click, pins another.".into(),
        };
        ui.label(RichText::new(text).weak());
        return;
    };
    let [x, y] = story.pixel;
    ui.horizontal(|ui| {
        let of = format!("Pixel {x}, {y} of {} × {}", story.size[0], story.size[1]);
        ui.label(RichText::new(of).strong());
        ui.label(RichText::new(&story.class).color(if story.wrong {
            ui.visuals().warn_fg_color
        } else {
            ui.visuals().text_color()
        }));
        if m.order != m.facts.of || m.draft() {
            ui.label(RichText::new("…").weak());
        }
    });
    ui.separator();
    let sections = story.sections();
    let bar = ScrollBarVisibility::AlwaysVisible;
    ScrollArea::vertical().id_salt("story").auto_shrink([false, false]).scroll_bar_visibility(bar).show(ui, |ui| {
        let columns = ((ui.available_width() / COLUMN) as usize).clamp(1, 3);
        ui.columns(columns, |ui| {
            // Each section has its column, whatever stands in the others.
            for section in &sections {
                let k = match (section.0, columns) {
                    ("In the map", 2..) => 1,
                    ("Aliasing" | "Technique", 3) => 2,
                    _ => 0,
                };
                self::section(&mut ui[k], section);
            }
        });
    });
}

fn section(ui: &mut Ui, (title, lines): &Section) {
    ui.label(RichText::new(*title).strong());
    Grid::new(title).num_columns(2).spacing([10.0, 2.0]).show(ui, |ui| {
        for (what, value) in lines.iter().filter(|(what, _)| what != "pixel" && what != "class") {
            ui.label(RichText::new(what.replace("  ", "· ")).small().weak());
            let width = (ui.available_width() - 4.0).max(60.0);
            ui.allocate_ui(vec2(width, 16.0), |ui| {
                ui.set_max_width(width);
                ui.add(Label::new(RichText::new(value).size(12.5)).wrap().selectable(true));
            });
            ui.end_row();
        }
    });
    ui.add_space(8.0);
}

/// Why it is wrong, and what would help.
fn helped(ui: &mut Ui, m: &mut Model, out: &mut Vec<Action>) {
    let pin = ui.add(Button::selectable(m.inspect.picking, "Pin a pixel").frame_when_inactive(true));
    if pin.on_hover_text("Then click into the picture (I). Alt and a click pins at once.").clicked() {
        m.inspect.picking = !m.inspect.picking;
    }
    ui.add_space(4.0);
    tried(ui, m, out);
    let Some(story) = &m.inspect.story else { return };
    let Some(diagnosis) = &story.diagnosis else {
        if story.facing {
            ui.label("Nothing is wrong here.");
        }
        return;
    };
    ui.label(RichText::new("Why is it wrong?").small().weak());
    let title = ui.label(RichText::new(diagnosis.title).strong().color(ui.visuals().warn_fg_color));
    title.on_hover_text(diagnosis.doc);
    ui.add(Label::new(RichText::new(diagnosis.doc).size(12.5)).wrap());
    ui.add_space(3.0);
    for because in &diagnosis.because {
        ui.add(Label::new(RichText::new(format!("• {because}")).size(12.5)).wrap());
    }
    if diagnosis.remedies.is_empty() {
        return;
    }
    ui.add_space(5.0);
    ui.label(RichText::new("What would help?").small().weak());
    let free = m.inspect.trying.is_none() && m.measuring.is_none() && m.loading.is_none();
    for remedy in &diagnosis.remedies {
        ui.horizontal(|ui| {
            let tip =
                "Change this parameter, and measure what that does to the errors. It is one step that can be undone.";
            let button = ui.add_enabled(free, Button::new("Try"));
            let named = format!("Try {}", remedy.text());
            button.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, free, &named));
            if button.on_hover_text(tip).clicked() {
                out.push(Action::Try(remedy.clone()));
            }
            ui.add(Label::new(RichText::new(remedy.text()).size(12.5)).truncate());
        });
    }
}

/// What is being tried, or was.
fn tried(ui: &mut Ui, m: &mut Model, out: &mut Vec<Action>) {
    if let Some(trying) = &m.inspect.trying {
        ui.label(RichText::new(trying.remedy.text()).strong());
        ui.horizontal(|ui| {
            ui.spinner();
            ui.label("measuring the errors before and after …");
        });
        if ui.button("Cancel").on_hover_text("Measure no longer. The change stays; Ctrl+Z takes it back.").clicked() {
            out.push(Action::CancelTrying);
        }
        ui.separator();
    }
    let Some(tried) = &m.inspect.tried else { return };
    let [a, b] = tried.errors;
    ui.label(RichText::new(tried.remedy.text()).strong());
    let label = |e: &Errors| if e.wrong { "wrong" } else { "right" };
    let off = |e: &Errors| format!("{:+.3}", e.off).replace('-', "−");
    Grid::new("tried").num_columns(3).spacing([12.0, 2.0]).show(ui, |ui| {
        let rows = [
            (
                "wrong pixels",
                format!("{:.3} %", 100.0 * a.share),
                format!("{:.3} %", 100.0 * b.share),
                b.share - a.share,
            ),
            ("RMSE", format!("{:.4}", a.rmse), format!("{:.4}", b.rmse), b.rmse - a.rmse),
            ("this pixel is", label(&a).into(), label(&b).into(), f64::from(b.wrong as u8) - f64::from(a.wrong as u8)),
            ("off by", off(&a), off(&b), f64::from(b.off.abs() - a.off.abs())),
        ];
        for (what, before, after, worse) in rows {
            let color = match worse {
                w if w > 1e-9 => ui.visuals().error_fg_color,
                w if w < -1e-9 => Color32::from_rgb(110, 190, 120),
                _ => ui.visuals().text_color(),
            };
            ui.label(RichText::new(what).small().weak());
            ui.label(before);
            ui.label(RichText::new(format!("→ {after}")).color(color));
            ui.end_row();
        }
    });
    let (mut keep, mut undo) = (false, false);
    ui.horizontal(|ui| {
        keep = ui.button("Keep").on_hover_text("The change stays.").clicked();
        undo = ui.button("Undo").on_hover_text("Take the change back.").clicked();
    });
    ui.separator();
    if keep {
        m.inspect.tried = None;
    } else if undo {
        out.extend(m.take_back());
    }
}

/// Draws what is known of the pinned pixel over the scene: its place, its texel on the surface, and its ray to the light.
pub fn over(ui: &Ui, rect: Rect, seen: Rect, m: &Model) {
    if m.drawer != Some(Tab::Pixel) {
        return;
    }
    let painter = ui.painter().with_clip_rect(seen);
    let at = rect.min + rect.size() * Vec2::from(m.setup.probe);
    if let Some(story) = &m.inspect.story {
        let camera = &m.setup.camera;
        if let Some(map) = story.map.as_ref().filter(|map| !map.outside) {
            let corners = map.footprint.map(Vec3::from);
            for i in 0..4 {
                line(&painter, rect, camera, [corners[i], corners[(i + 1) % 4]], ACCENT);
            }
        }
        if let Some(place) = story.place.filter(|_| story.facing).map(Vec3::from) {
            let far = story.light_distance.unwrap_or(m.diagonal());
            let end = place + Vec3::from(story.to_light) * far;
            match story.hit {
                Some(hit) => {
                    let at = Vec3::from(hit.at);
                    line(&painter, rect, camera, [place, at], SUN);
                    line(&painter, rect, camera, [at, end], SUN.gamma_multiply(0.3));
                    if let Some(p) = project(camera, rect, at) {
                        painter.circle(p, 4.0, Color32::BLACK, Stroke::new(1.5, SUN));
                        let told =
                            format!("{}, triangle {}", crate::measure::story::metres(hit.distance), hit.triangle);
                        said(&painter, p + vec2(9.0, 0.0), Align2::LEFT_CENTER, &told);
                    }
                }
                None => line(&painter, rect, camera, [place, end], SUN),
            }
        }
    }
    // The pinned pixel itself: hair lines that leave it free.
    for way in [vec2(1.0, 0.0), vec2(-1.0, 0.0), vec2(0.0, 1.0), vec2(0.0, -1.0)] {
        for (width, color) in [(3.0, Color32::BLACK), (1.2, Color32::WHITE)] {
            painter.line_segment([at + 4.0 * way, at + 12.0 * way], Stroke::new(width, color));
        }
    }
}

/// A line of the scene, as far as it lies before the camera.
fn line(painter: &Painter, rect: Rect, camera: &Camera, [a, b]: [Vec3; 2], color: Color32) {
    let depth = |p: Vec3| (p - camera.position).dot(camera.forward()) - 1.01 * camera.near;
    let (da, db) = (depth(a), depth(b));
    if da <= 0.0 && db <= 0.0 {
        return;
    }
    let cut = a.lerp(b, da / (da - db));
    let ends = [if da <= 0.0 { cut } else { a }, if db <= 0.0 { cut } else { b }];
    if let [Some(p), Some(q)] = ends.map(|p| project(camera, rect, p)) {
        let ground = Color32::from_black_alpha(if color.a() == 255 { 140 } else { 0 });
        for (width, color) in [(3.5, ground), (1.5, color)] {
            painter.line_segment([p, q], Stroke::new(width, color));
        }
    }
}

fn said(painter: &Painter, at: Pos2, align: Align2, text: &str) {
    let galley = painter.layout_no_wrap(text.into(), FontId::proportional(12.5), TEXT);
    let place = align.anchor_size(at, galley.size());
    painter.rect_filled(place.expand2(vec2(4.0, 2.0)), 3.0, Color32::from_black_alpha(160));
    painter.galley(place.min, galley, TEXT);
}

/// Side of the magnifier's glass, and how far from the pointer it stays, points.
const GLASS: f32 = 184.0;
const APART: f32 = 30.0;
/// Height of the line below the glass.
const FOOT: f32 = 20.0;

/// Draws the magnifier beside the pointer; `rect`: the viewport.
pub fn magnify(ui: &Ui, rect: Rect, pointer: Option<Pos2>, m: &mut Model) {
    let glass = &m.inspect.magnifier;
    let (true, Some(at)) = (glass.on, pointer.filter(|p| rect.contains(*p))) else { return };
    let share = (at - rect.min) / rect.size();
    let size = glass.picture.map_or(m.facts.size, |(_, size)| size);
    if size.contains(&0) {
        return;
    }
    let pixel =
        [share.x, share.y].iter().zip(size).map(|(s, n)| ((s * n as f32) as u32).min(n - 1)).collect::<Vec<_>>();
    let around = beside(rect, at);
    let lens = around.with_max_y(around.bottom() - FOOT);
    let painter = ui.ctx().layer_painter(LayerId::new(Order::Foreground, Id::unique("magnifier"))).with_clip_rect(rect);
    painter.rect_filled(around, 3.0, Color32::from_rgb(16, 18, 22));
    // Points that a pixel takes, and how many fit.
    let side = glass.times as f32 / ui.ctx().pixels_per_point();
    let middle = pos2(pixel[0] as f32 + 0.5, pixel[1] as f32 + 0.5);
    let half = lens.size() / (2.0 * side);
    let whole = vec2(size[0] as f32, size[1] as f32);
    let shown = Rect::from_center_size(middle, 2.0 * half).intersect(Rect::from_min_size(Pos2::ZERO, whole));
    let place = |p: Pos2| lens.center() + (p - middle) * side;
    if let Some((texture, _)) = glass.picture {
        let part = Rect::from_min_max((shown.min.to_vec2() / whole).to_pos2(), (shown.max.to_vec2() / whole).to_pos2());
        painter.image(texture, Rect::from_min_max(place(shown.min), place(shown.max)), part, Color32::WHITE);
    }
    let framed = Rect::from_center_size(lens.center(), Vec2::splat(side.max(2.0)));
    for (width, color) in [(2.5, Color32::BLACK), (1.2, Color32::WHITE)] {
        painter.add(Shape::Rect(egui::epaint::RectShape::stroke(
            framed,
            0.0,
            Stroke::new(width, color),
            StrokeKind::Outside,
        )));
    }
    painter.rect_stroke(around, 3.0, Stroke::new(1.0, Color32::from_gray(120)), StrokeKind::Inside);
    let value = m.reading.as_ref().and_then(|r| r.text.clone()).unwrap_or_default();
    let text = format!("{}, {}   ×{}   {value}", pixel[0], pixel[1], glass.times);
    let foot = around.with_min_y(lens.bottom());
    let galley = painter.layout(text, FontId::proportional(12.0), TEXT, f32::INFINITY);
    let fits = galley.size().x <= foot.width() - 12.0;
    let painter = if fits { painter.with_clip_rect(foot.intersect(rect)) } else { painter };
    if !fits {
        // A long value stands on a ground of its own.
        let wide = Rect::from_min_size(foot.min, vec2(galley.size().x + 12.0, FOOT));
        let wide = wide.translate(vec2((rect.right() - wide.right()).min(0.0), 0.0));
        painter.rect_filled(wide, 3.0, Color32::from_rgb(16, 18, 22));
        painter.galley(wide.min + vec2(6.0, 3.0), galley, TEXT);
    } else {
        painter.galley(foot.min + vec2(6.0, 3.0), galley, TEXT);
    }
}

/// Where the magnifier stands: beside the pointer, on the other side near an edge, and never over it.
pub fn beside(rect: Rect, at: Pos2) -> Rect {
    let size = vec2(GLASS, GLASS + FOOT).min(rect.size());
    let one = |at: f32, low: f32, high: f32, size: f32| {
        if at + APART + size <= high { at + APART } else { (at - APART - size).max(low) }
    };
    let min = pos2(one(at.x, rect.left(), rect.right(), size.x), one(at.y, rect.top(), rect.bottom(), size.y));
    Rect::from_min_size(min, size)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// However near an edge the pointer is, the glass stays in the viewport and leaves what is around the pointer free.
    #[test]
    fn the_glass_never_covers_what_it_magnifies() {
        let rect = Rect::from_min_size(pos2(10.0, 20.0), vec2(940.0, 700.0));
        for i in 0..=20 {
            for j in 0..=20 {
                let at = rect.min + rect.size() * vec2(i as f32, j as f32) / 20.0;
                let glass = beside(rect, at);
                assert!(rect.expand(0.01).contains_rect(glass), "{at:?}: {glass:?}");
                assert!(!glass.expand(APART - 1.0).contains(at), "{at:?}: {glass:?}");
            }
        }
    }

    #[test]
    fn the_glass_keeps_within_its_range() {
        let mut glass = Magnifier::default();
        (0..9).for_each(|_| glass.step(true));
        assert_eq!(glass.times, 32);
        (0..9).for_each(|_| glass.step(false));
        assert_eq!(glass.times, 2);
    }
}
