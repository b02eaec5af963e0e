//! The window's layout: panel, viewport, status line, messages, help, keys.

use super::model::{Action, Model, Traced};
use super::style::{ERROR, TEXT, WEAK};
use super::viewport;
use super::{drawer, panel};
use crate::view;
use egui::{
    Align, Align2, Area, Color32, Context, Frame, Grid, Id, Key, Label, Layout, Margin, Modifiers, Order, Panel, Rect,
};
use egui::{RichText, Ui, vec2};
use std::path::PathBuf;
use std::time::Duration;

/// Seconds that a message stays which is no error.
const NOTE_SECONDS: f32 = 6.0;

/// Draws everything but the picture; the rectangle that is left for that, in points.
pub fn layout(ui: &mut Ui, m: &mut Model, out: &mut Vec<Action>) -> Rect {
    keys(ui.ctx(), m, out);
    let bar = Frame::new().fill(super::style::PANEL).inner_margin(Margin::symmetric(10, 0));
    Panel::bottom("status").exact_size(26.0).frame(bar).show(ui, |ui| status(ui, m));
    if m.show_panel {
        let side =
            Frame::new().fill(super::style::PANEL).inner_margin(Margin { left: 10, right: 4, top: 6, bottom: 0 });
        let side = Panel::right("panel").resizable(false).exact_size(panel::WIDTH).frame(side);
        side.show(ui, |ui| panel::show(ui, m, out));
    }
    drawer::show(ui, m, out);
    let rect = ui.available_rect_before_wrap();
    viewport::show(ui, rect, m, out);
    messages(ui.ctx(), rect, m);
    busy(ui.ctx(), rect, m, out);
    help(ui.ctx(), m);
    let ctx = ui.ctx();
    // While another scene is on its way the history waits: a step undone may be what is loading.
    if m.loading.is_none() && !ctx.input(|i| i.pointer.any_down()) && !ctx.egui_wants_keyboard_input() {
        let chosen = std::mem::take(&mut m.camera_chosen);
        m.history.commit(&m.setup, chosen);
    }
    rect
}

/// Draws the window before the first scene is there.
pub fn opening(ui: &mut Ui, what: &str) {
    ui.centered_and_justified(|ui| {
        ui.horizontal_centered(|ui| {
            ui.spinner();
            ui.label(format!("Opening {what} …"));
        });
    });
}

fn keys(ctx: &Context, m: &mut Model, out: &mut Vec<Action>) {
    let typing = ctx.egui_wants_keyboard_input();
    let pressed = |modifiers: Modifiers, key: Key| ctx.input_mut(|i| i.consume_key(modifiers, key));
    if pressed(Modifiers::COMMAND, Key::Q) {
        out.push(Action::Quit);
    }
    if pressed(Modifiers::COMMAND, Key::S) {
        out.push(Action::SaveSetup(PathBuf::from(m.setup_path.trim())));
    }
    if pressed(Modifiers::NONE, Key::F12) {
        out.push(Action::Capture(numbered()));
    }
    if pressed(Modifiers::NONE, Key::F1) {
        m.show_help = !m.show_help;
    }
    for (key, (tab, ..)) in [Key::F2, Key::F3, Key::F4].into_iter().zip(drawer::TABS) {
        if pressed(Modifiers::NONE, key) {
            m.drawer = if m.drawer == Some(tab) { None } else { Some(tab) };
        }
    }
    if typing {
        return;
    }
    // The longer shortcut first: Ctrl+Z would match it too.
    if pressed(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z) || pressed(Modifiers::COMMAND, Key::Y) {
        out.extend(m.redo());
    }
    if pressed(Modifiers::COMMAND, Key::Z) {
        out.extend(m.undo());
    }
    if pressed(Modifiers::NONE, Key::Questionmark) || pressed(Modifiers::SHIFT, Key::Questionmark) {
        m.show_help = !m.show_help;
    }
    if m.show_help && pressed(Modifiers::NONE, Key::Escape) {
        m.show_help = false;
    }
    if pressed(Modifiers::NONE, Key::Space) && !m.scene.animations.is_empty() {
        m.playing = !m.playing;
    }
    if pressed(Modifiers::NONE, Key::F) {
        super::freeze::toggle(m);
    }
    if pressed(Modifiers::NONE, Key::R) {
        m.setup.camera = m.home;
        m.camera_chosen = true;
    }
    let digits = [Key::Num1, Key::Num2, Key::Num3, Key::Num4, Key::Num5, Key::Num6, Key::Num7, Key::Num8, Key::Num9];
    for (key, v) in digits.into_iter().zip(view::VIEWS) {
        if pressed(Modifiers::NONE, key) {
            m.setup.view = v.id.into();
        }
    }
}

/// The first of capture-001.png, capture-002.png … that does not exist yet.
fn numbered() -> PathBuf {
    let mut i = 1;
    loop {
        let path = PathBuf::from(format!("capture-{i:03}.png"));
        if !path.exists() {
            return path;
        }
        i += 1;
    }
}

fn status(ui: &mut Ui, m: &Model) {
    let f = &m.facts;
    ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
        let field = |ui: &mut Ui, width: f32, text: RichText, tip: &str| {
            let layout = Layout::left_to_right(Align::Center);
            ui.allocate_ui_with_layout(vec2(width, 20.0), layout, |ui| {
                ui.set_min_width(width);
                ui.add(Label::new(text.size(12.5)).truncate()).on_hover_text(tip);
            });
        };
        let error = match (f.traced, f.error) {
            (Traced::NotServed, _) => RichText::new("no exact shadow").color(WEAK),
            (Traced::Partly(p), _) => RichText::new(format!("tracing {:.0} %", p.done * 100.0)).color(WEAK),
            (Traced::Fully, None) => RichText::new("error …").color(WEAK),
            (Traced::Fully, Some([share, rmse])) => {
                RichText::new(format!("error {:.3} %, RMSE {rmse:.4}", share * 100.0)).color(TEXT)
            }
        };
        let tip = format!(
            "Against the exact shadow in this picture, which is traced while the picture rests. Error: wrong pixels as a share of those that face the light, within its cone and range, against one sample a pixel, which suits hard techniques. RMSE: against the truth of {}, which is fair to filters if it is more than one.",
            samples(m.setup.truth_samples.shown(m.info()))
        );
        field(ui, 210.0, error, &tip);
        let how = if f.wall_clock { "Wall clock." } else { "GPU time." };
        let technique = RichText::new(format!("technique {:.2} ms", f.technique_ms()));
        field(ui, 132.0, technique, &format!("The technique's passes together. {how}"));
        let frame = RichText::new(format!("frame {:.1} ms", f.frame_ms()));
        field(ui, 112.0, frame, &format!("All passes of the picture drawn last. {how}"));
        let [w, h] = f.size;
        let size = RichText::new(format!("{w} × {h}"));
        let size = if f.size == f.full { size } else { size.color(super::style::SUN) };
        field(ui, 96.0, size, "Pixels that the picture is rendered at. Fewer while it moves, if the adapter is slow; never fewer for captures and measurements.");
        ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
            // The name's first part; all of it is in the tooltip.
            let name = f.adapter.split(" (").next().unwrap_or_default();
            let software = if f.software { " (software)" } else { "" };
            let adapter = RichText::new(format!("{name}{software}")).size(12.5).color(WEAK);
            let tip = format!("{}: the graphics adapter. Start with --adapter NAME to use another.", f.adapter);
            ui.add(Label::new(adapter).truncate()).on_hover_text(tip);
        });
    });
}

/// Samples in words.
fn samples(n: u32) -> String {
    if n == 1 { "one sample a pixel".into() } else { format!("{n} samples a pixel") }
}

fn messages(ctx: &Context, rect: Rect, m: &mut Model) {
    m.notes.retain(|n| n.error || n.since.elapsed().as_secs_f32() < NOTE_SECONDS);
    if m.notes.is_empty() {
        return;
    }
    ctx.request_repaint_after(Duration::from_millis(500));
    let mut dismissed = None;
    let area = Area::new(Id::unique("messages")).order(Order::Foreground).fixed_pos(rect.min + vec2(12.0, 12.0));
    area.show(ctx, |ui| {
        for (i, note) in m.notes.iter().enumerate() {
            let color = if note.error { ERROR } else { super::style::ACCENT };
            let frame = Frame::popup(ui.style()).stroke(egui::Stroke::new(1.0, color.gamma_multiply(0.7)));
            frame.show(ui, |ui| {
                let width = (rect.width() - 60.0).clamp(120.0, 620.0);
                ui.horizontal_top(|ui| {
                    ui.vertical(|ui| {
                        ui.set_width(width - 30.0);
                        ui.add(Label::new(RichText::new(&note.text).color(TEXT)).wrap().selectable(true));
                    });
                    if ui.small_button("×").on_hover_text("Dismiss.").clicked() {
                        dismissed = Some(i);
                    }
                });
            });
        }
    });
    if let Some(i) = dismissed {
        m.notes.remove(i);
    }
}

/// What is going on beside the window.
fn busy(ctx: &Context, rect: Rect, m: &Model, out: &mut Vec<Action>) {
    let (text, cancel) = match (&m.loading, &m.measuring) {
        (Some(what), _) => (format!("Opening {what} …"), Action::CancelLoading),
        (None, Some(job)) => (format!("{}: {}. The picture waits.", job.title, job.told()), Action::CancelMeasuring),
        _ => return,
    };
    let width = (rect.width() - 140.0).clamp(80.0, 320.0);
    let area = Area::new(Id::unique("busy")).order(Order::Foreground).pivot(Align2::CENTER_TOP);
    area.fixed_pos(rect.center_top() + vec2(0.0, 16.0)).show(ctx, |ui| {
        Frame::popup(ui.style()).show(ui, |ui| {
            ui.horizontal(|ui| {
                if m.loading.is_some() {
                    // Not while measuring: what turns is drawn anew all the time, and disturbs what is timed.
                    ui.spinner();
                }
                ui.add_sized([width, 20.0], Label::new(text).truncate());
                if ui.button("Cancel").on_hover_text("Stop; what was open or measured before stays.").clicked() {
                    out.push(cancel);
                }
            });
        });
    });
}

const HELP: [(&str, &str); 22] = [
    ("Left drag", "orbit around the target"),
    ("Right drag", "look around"),
    ("Middle drag", "pan"),
    ("Wheel", "nearer to the target, farther from it"),
    ("Double-click", "look at that point and orbit around it"),
    ("Rest on a map, an error", "read the value there"),
    ("W A S D, Q E", "fly, down and up; Shift is faster"),
    ("R", "reset the camera"),
    ("F", "freeze the shadow camera, release it"),
    ("Drag the sun or lamp", "move the light; Shift: nearer and farther"),
    ("1 … 9", "choose a view"),
    ("Space", "run or stop the animation"),
    ("Tab", "hide or show the panel"),
    ("F2, F3, F4", "chart, stability, advice"),
    ("Ctrl+Z", "undo"),
    ("Ctrl+Shift+Z, Ctrl+Y", "redo"),
    ("Ctrl+S", "save the set-up"),
    ("F12", "capture into capture-001.png, …"),
    ("Double-click a name", "reset that parameter"),
    ("Drop a file", "open it: .glb, .gltf, .toml, .png, .csv, .json"),
    ("F1 or ?", "this help"),
    ("Ctrl+Q", "quit"),
];

fn help(ctx: &Context, m: &mut Model) {
    if !m.show_help {
        return;
    }
    let mut open = true;
    let window = egui::Window::new("Mouse and keys").open(&mut open).collapsible(false).resizable(false);
    window.anchor(Align2::CENTER_CENTER, vec2(-panel::WIDTH / 2.0, 0.0)).show(ctx, |ui| {
        Grid::new("help").num_columns(2).spacing([24.0, 5.0]).show(ui, |ui| {
            for (key, does) in HELP {
                ui.label(RichText::new(key).color(Color32::WHITE));
                ui.label(does);
                ui.end_row();
            }
        });
    });
    m.show_help &= open;
}
