//! The window's layout: panel, viewport, status line, messages, help, keys.

use super::controls::{set_panel_left, take_said};
use super::history::REST;
use super::model::{Action, Code, Model, Tab, Traced};
use super::viewport;
use super::words::Words;
use super::{compare, drawer, flatland, freeze, lesson, lost, maps, panel, picker, start, words};
use crate::legend::letter;
use crate::view;
use egui::{
    Align, Align2, Area, Button, Context, Frame, Grid, Id, Key, Label, Layout, Margin, ModifierNames, Modifiers, Order,
    Panel, Popup, Rect,
};
use egui::{Color32, KeyboardShortcut, Modal, RichText, Stroke, StrokeKind, TextStyle, Ui, UiBuilder, pos2, vec2};
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// How long a message stays that the pointer has left.
const READING: Duration = Duration::from_secs(4);
/// Height of the line that tells what is going on, with the gap above it, points.
const BUSY: f32 = 46.0;
/// A window that is narrower than this has no room for picture and panel side by side, points.
const NARROW: f32 = 560.0;
/// Points of picture that the panel leaves.
const PICTURE: f32 = 200.0;
/// Width of the tab that stands for a hidden panel, points.
const TAB: f32 = 18.0;

/// Draws everything but the picture; the rectangle that is left for that, in points.
pub fn layout(ui: &mut Ui, m: &mut Model, out: &mut Vec<Action>) -> Rect {
    keys(ui.ctx(), m, out);
    if let Some(text) = take_said(ui.ctx()) {
        m.say(text);
    }
    lost::show(ui.ctx(), m, out);
    if m.lab.shown {
        let mut over = flatland::show(ui, m, out);
        over.min.y += busy(ui.ctx(), over, m, out);
        messages(ui.ctx(), over, m);
        help(ui.ctx(), m);
        closing(ui.ctx(), m, out);
        picker::show(ui.ctx(), m, out);
        return Rect::NOTHING;
    }
    if m.start.shown {
        start::show(ui, m, out);
        let over = ui.ctx().content_rect();
        busy(ui.ctx(), over, m, out);
        messages(ui.ctx(), over, m);
        help(ui.ctx(), m);
        words::show(ui.ctx(), m);
        closing(ui.ctx(), m, out);
        picker::show(ui.ctx(), m, out);
        return Rect::NOTHING;
    }
    let fill = ui.visuals().panel_fill;
    let bar = Frame::new().fill(fill).inner_margin(Margin::symmetric(10, 0));
    Panel::bottom("status").exact_size(26.0).frame(bar).show(ui, |ui| status(ui, m));
    lesson::show(ui, m, out);
    let room = ui.available_width();
    m.narrow = room < NARROW;
    let side = Frame::new().fill(fill).inner_margin(Margin { left: 10, right: 4, top: 6, bottom: 0 });
    match (m.narrow, m.panel_shows()) {
        (_, false) => set_panel_left(ui.ctx(), None),
        (true, true) => {
            let side = Panel::right("panel over").resizable(false).exact_size(panel::WIDTH.min(room - TAB)).frame(side);
            side.show(ui, |ui| panel::show(ui, m, out));
        }
        (false, true) => {
            let side = Panel::right("panel").resizable(true).default_size(panel::WIDTH).frame(side);
            side.size_range(panel::LEAST..=room - PICTURE).show(ui, |ui| panel::show(ui, m, out));
        }
    }
    // Views come and go with the filter that is chosen.
    m.settle_view();
    drawer::show(ui, m, out);
    let mut rect = ui.available_rect_before_wrap();
    if m.framed {
        rect = shaped(rect, m.setup.size);
        ui.painter().rect_stroke(rect, 0.0, Stroke::new(1.0, ui.visuals().weak_text_color()), StrokeKind::Outside);
    }
    let room = rect;
    let [viewer, rect] = maps::split(room, m.maps.place);
    if rect.is_positive() {
        viewport::show(ui, rect, m, out);
    }
    maps::show(ui, viewer, m);
    // Neither the viewer's buttons nor the sides' titles are covered.
    let mut over = match rect.is_positive() {
        true => rect.with_min_y(rect.top() + compare::titles_height(&m.setup)),
        false => viewer.with_min_y(viewer.top() + maps::bar_height(viewer, m)),
    };
    over.min.y += busy(ui.ctx(), over, m, out);
    messages(ui.ctx(), over, m);
    tab(ui, m);
    help(ui.ctx(), m);
    words::show(ui.ctx(), m);
    closing(ui.ctx(), m, out);
    picker::show(ui.ctx(), m, out);
    let ctx = ui.ctx();
    // While another scene is on its way the history waits: a step undone may be what is loading.
    let busy = ctx.input(|i| i.pointer.any_down() || !i.keys_down.is_empty()) || ctx.text_edit_focused();
    if m.loading.is_none() && !busy {
        let chosen = std::mem::take(&mut m.camera_chosen);
        m.history.commit(&m.setup, chosen);
        if m.history.waits(&m.setup) {
            ctx.request_repaint_after(REST);
        }
    }
    rect
}

/// The largest rectangle in the middle of another that has the shape of a picture of this size.
fn shaped(rect: Rect, [width, height]: [u32; 2]) -> Rect {
    let shape = vec2(width as f32, height as f32);
    let scale = (rect.width() / shape.x).min(rect.height() / shape.y).max(0.0);
    Rect::from_center_size(rect.center(), shape * scale)
}

/// What brings a hidden panel back.
fn tab(ui: &Ui, m: &mut Model) {
    if m.panel_shows() {
        return;
    }
    let edge = ui.available_rect_before_wrap();
    let area = Area::new(Id::unique("panel's tab")).order(Order::Foreground).constrain(false);
    area.fixed_pos(pos2(edge.right() - TAB, edge.center().y - 28.0)).show(ui.ctx(), |ui| {
        let button = ui.add(Button::new(RichText::new("‹").heading()).min_size(vec2(TAB, 56.0)));
        button.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, "Show the panel"));
        if button.on_hover_text("Show the panel (F9).").clicked() {
            m.toggle_panel();
        }
    });
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

/// Keys, and what they do in words and in fact.
struct Shortcut {
    keys: &'static [(Modifiers, Key)],
    /// Also while text is typed.
    typing: bool,
    does: &'static str,
    run: fn(&mut Model, &mut Vec<Action>),
}

const fn shortcut(
    keys: &'static [(Modifiers, Key)],
    does: &'static str,
    run: fn(&mut Model, &mut Vec<Action>),
) -> Shortcut {
    Shortcut { keys, typing: false, does, run }
}

const fn always(
    keys: &'static [(Modifiers, Key)],
    does: &'static str,
    run: fn(&mut Model, &mut Vec<Action>),
) -> Shortcut {
    Shortcut { keys, typing: true, does, run }
}

const NONE: Modifiers = Modifiers::NONE;
const CTRL: Modifiers = Modifiers::COMMAND;
const SHIFT: Modifiers = Modifiers::SHIFT;
const VIEWS: [Key; 9] =
    [Key::Num1, Key::Num2, Key::Num3, Key::Num4, Key::Num5, Key::Num6, Key::Num7, Key::Num8, Key::Num9];

/// All shortcuts but the views' digits; of two that match, the longer stands first.
const SHORTCUTS: &[Shortcut] = &[
    always(&[(NONE, Key::F1)], "this help", |m, _| m.show_help = !m.show_help),
    shortcut(&[(NONE, Key::Questionmark), (SHIFT, Key::Questionmark)], "this help", |m, _| m.show_help = !m.show_help),
    always(&[(NONE, Key::F2)], "open or close the chart", |m, _| m.toggle(Tab::Chart)),
    always(&[(NONE, Key::F3)], "open or close stability", |m, _| m.toggle(Tab::Stability)),
    always(&[(NONE, Key::F4)], "open or close advice", |m, _| m.toggle(Tab::Advice)),
    always(&[(NONE, Key::F7)], "open or close the figure builder", |m, _| m.toggle(Tab::Figure)),
    always(&[(NONE, Key::F5)], "open the flatland lab", |m, _| m.toggle_lab()),
    always(&[(NONE, Key::F6)], "open or close the pixel's story", |m, _| m.toggle(Tab::Pixel)),
    always(&[(NONE, Key::F8)], "the start screen: lessons, recent files, gallery", |m, _| m.toggle_start()),
    always(&[(NONE, Key::F9)], "hide or show the panel", |m, _| m.toggle_panel()),
    always(&[(CTRL, Key::F)], "search the techniques", |m, _| m.find()),
    shortcut(&[(NONE, Key::R)], "reset the camera", |m, _| m.go_home()),
    shortcut(&[(NONE, Key::F)], "freeze the shadow camera, or release it", |m, _| freeze::toggle(m)),
    shortcut(&[(NONE, Key::L)], "show or hide the legend", |m, _| m.show_legend = !m.show_legend),
    shortcut(&[(NONE, Key::M)], "the map viewer: beside the picture, instead of it, closed", |m, _| m.maps.toggle()),
    shortcut(&[(NONE, Key::I)], "inspect the pixel that is clicked next", |m, _| {
        m.inspect.picking = !m.inspect.picking
    }),
    shortcut(&[(NONE, Key::Z)], "the magnifier", |m, _| m.inspect.magnifier.on ^= true),
    shortcut(
        &[(NONE, Key::Plus), (SHIFT, Key::Plus), (NONE, Key::Equals)],
        "magnify more, while the magnifier is on",
        |m, _| m.inspect.magnifier.step(true),
    ),
    shortcut(&[(NONE, Key::Minus)], "magnify less", |m, _| m.inspect.magnifier.step(false)),
    shortcut(&[(NONE, Key::X)], "flicker between the sides of a comparison", |m, _| m.flicker()),
    shortcut(&[(NONE, Key::B)], "show the difference A − B, or leave it", |m, _| m.toggle_difference()),
    shortcut(&[(NONE, Key::Space)], "run or stop the animation", |m, _| {
        m.playing = !m.playing && !m.scene.animations.is_empty();
    }),
    shortcut(&[(CTRL.plus(SHIFT), Key::Z), (CTRL, Key::Y)], "redo", |m, out| out.extend(m.redo())),
    shortcut(&[(CTRL, Key::Z)], "undo, camera moves too", |m, out| out.extend(m.undo())),
    always(&[(CTRL, Key::S)], "save the set-up", |m, out| {
        out.push(Action::SaveSetup(PathBuf::from(m.setup_path.trim())));
    }),
    always(
        &[(SHIFT, Key::F12)],
        "capture 1920 × 1080 pixels, legend and all, into figure-001.png and so on",
        |_, out| {
            out.push(Action::Figure(numbered("figure", "png")));
        },
    ),
    always(&[(NONE, Key::F12)], "capture into capture-001.png and so on", |_, out| {
        out.push(Action::Capture(numbered("capture", "png")));
    }),
    always(&[(CTRL, Key::Q)], "quit", |m, out| {
        if m.may_close() {
            out.push(Action::Quit);
        }
    }),
];

/// Those of the start screen.
const START: &[Shortcut] = &[
    always(&[(NONE, Key::F1)], "this help", |m, _| m.show_help = !m.show_help),
    always(&[(NONE, Key::F8)], "leave the start screen", |m, _| m.toggle_start()),
    always(&[(CTRL, Key::Q)], "quit", |m, out| {
        if m.may_close() {
            out.push(Action::Quit);
        }
    }),
];

/// What keys do on the start screen beside that.
const START_GESTURES: [(&str, &str); 4] = [
    ("Click a picture", "take a lesson, or open a set-up"),
    ("Tab, arrows, Enter", "the same by keys"),
    ("Escape", "explore freely"),
    ("Drop a file", "open it: .glb, .gltf, .obj, .ply, .stl, .toml, .png"),
];

/// Those of the flatland lab.
const LAB: &[Shortcut] = &[
    always(&[(NONE, Key::F1)], "this help", |m, _| m.show_help = !m.show_help),
    always(&[(NONE, Key::F5)], "leave the flatland lab", |m, _| m.toggle_lab()),
    shortcut(&[(NONE, Key::D)], "draw segments, or stop drawing", |m, _| m.lab.drawing = !m.lab.drawing),
    shortcut(&[(NONE, Key::Delete), (NONE, Key::Backspace)], "delete the selected segment", |m, _| m.lab.delete()),
    shortcut(&[(NONE, Key::Home)], "show all of the world", |m, _| m.lab.fit()),
    shortcut(&[(NONE, Key::P)], "post-perspective space, or back", |m, _| m.lab.now.show.post ^= true),
    shortcut(&[(CTRL.plus(SHIFT), Key::Z), (CTRL, Key::Y)], "redo", |m, _| m.lab.redo()),
    shortcut(&[(CTRL, Key::Z)], "undo", |m, _| m.lab.undo()),
    always(&[(CTRL, Key::S)], "save the world", |m, out| flatland::save(m, out)),
    always(&[(CTRL, Key::Q)], "quit", |m, out| {
        if m.may_close() {
            out.push(Action::Quit);
        }
    }),
];

/// What the mouse does in the flatland lab.
const LAB_GESTURES: [(&str, &str); 9] = [
    ("Drag eye or light", "move it; the round knob before the eye turns the view, the square one widens it"),
    ("Drag the film's knob", "turn the film line about the light"),
    ("Drag an end", "move that end of a segment; the segment itself moves as a whole"),
    ("Click a segment", "select it"),
    ("Drag the ground", "pan, with any button"),
    ("Wheel", "zoom about the pointer"),
    ("Double-click the ground", "show all of it"),
    ("Drag in a chart", "turn the film; choose how many samples"),
    ("Escape", "lay the pen down, select nothing, leave"),
];

/// What the mouse does, and keys that egui or the viewport handle.
const GESTURES: [(&str, &str); 15] = [
    ("Left drag", "orbit around the target"),
    ("Right drag", "look around"),
    ("Middle drag", "pan"),
    ("Wheel", "move towards the target and away from it"),
    ("Double-click", "look at that point and orbit around it"),
    ("Alt+click", "inspect that pixel: its story, and why it is wrong"),
    ("Alt+wheel", "magnify more or less, while the magnifier (Z) is on"),
    ("Rest on a map or an error view", "read the value there"),
    ("W A S D", "fly; Q down, E up; Shift is faster"),
    ("Drag the light", "move it; Shift: nearer and farther"),
    ("Double-click a name", "reset that parameter; right-click: pin it to the top"),
    ("Tab, Shift+Tab", "move the focus"),
    ("← →", "turn the slider in focus; ↑ ↓ a number"),
    ("Escape", "leave a field, pick no plane, close this help"),
    ("Drop a file", "open it: .glb, .gltf, .obj, .ply, .stl, .toml, .png, .csv, .json"),
];

fn keys(ctx: &Context, m: &mut Model, out: &mut Vec<Action>) {
    // Of what stands behind a dialog only closing is heard, which asks twice.
    let behind = m.picker.is_some() || m.closing || m.lost.is_some();
    // The glossary hears its own keys.
    if m.words.is_some() {
        return;
    }
    let (typing, focused) = (ctx.text_edit_focused(), ctx.egui_wants_keyboard_input());
    let pressed = |(modifiers, key): (Modifiers, Key)| ctx.input_mut(|i| i.consume_key(modifiers, key));
    let quits = |s: &Shortcut| s.keys.contains(&(CTRL, Key::Q));
    let shortcuts = match (m.lab.shown, m.start.shown) {
        (true, _) => LAB,
        (false, true) => START,
        (false, false) => SHORTCUTS,
    };
    for shortcut in shortcuts.iter().filter(|s| if behind { quits(s) } else { s.typing || !typing }) {
        for keys in shortcut.keys {
            // A button in focus takes the space bar.
            if !(focused && keys.1 == Key::Space) && pressed(*keys) {
                (shortcut.run)(m, out);
            }
        }
    }
    if typing || behind {
        return;
    }
    if m.show_help && pressed((NONE, Key::Escape)) {
        m.show_help = false;
    }
    if m.start.shown {
        if pressed((NONE, Key::Escape)) {
            m.toggle_start();
        }
        return;
    }
    if m.lab.shown {
        if !Popup::is_any_open(ctx) && pressed((NONE, Key::Escape)) {
            m.lab.back();
        }
        return;
    }
    for (key, v) in VIEWS.into_iter().zip(view::VIEWS) {
        if pressed((NONE, key)) {
            m.setup.view = v.id.into();
            m.setup.overlay = None;
        }
    }
}

/// The first of NAME-001.ENDING, NAME-002.ENDING … that does not exist yet.
fn numbered(name: &str, ending: &str) -> PathBuf {
    let mut i = 1;
    loop {
        let path = PathBuf::from(format!("{name}-{i:03}.{ending}"));
        if !path.exists() {
            return path;
        }
        i += 1;
    }
}

/// Asks what is to become of what was measured before the window closes.
fn closing(ctx: &Context, m: &mut Model, out: &mut Vec<Action>) {
    if !m.closing {
        return;
    }
    let mut wait = true;
    let answer = Modal::new(Id::unique("closing")).show(ctx, |ui| {
        ui.set_max_width(ui.ctx().content_rect().width().clamp(160.0, 400.0) - 60.0);
        for tab in &m.unsaved {
            ui.label(match (tab, m.rows.len()) {
                (Tab::Chart, 1) => "1 measured row is not saved.".into(),
                (Tab::Chart, n) => format!("{n} measured rows are not saved."),
                (Tab::Stability, _) => "The stability run is not saved.".into(),
                (Tab::Advice, _) => "The advice is not saved.".into(),
                (Tab::Pixel, _) => String::new(),
                (Tab::Figure, _) => "The figure is not saved.".into(),
            });
        }
        if let Some(job) = &m.measuring {
            ui.label(format!("{}: {}. What it has found so far would be lost.", job.title, job.told()));
        }
        ui.label(RichText::new("Ctrl+Q again closes the window all the same.").small().weak());
        ui.add_space(6.0);
        ui.horizontal_wrapped(|ui| {
            if !m.unsaved.is_empty() && m.measuring.is_none() {
                let stem = |tab: &Tab| match tab {
                    Tab::Chart => "measured",
                    Tab::Stability => "stability",
                    Tab::Advice => "advice",
                    Tab::Pixel => "pixel",
                    Tab::Figure => "figure",
                };
                let paths: Vec<PathBuf> = m.unsaved.iter().map(|tab| numbered(stem(tab), "csv")).collect();
                let names: Vec<String> = paths.iter().map(|p| p.display().to_string()).collect();
                if ui.button(format!("Save {} and close", names.join(", "))).clicked() {
                    out.extend(m.unsaved.iter().zip(paths).map(|(tab, path)| Action::Export(*tab, path)));
                }
            }
            let close = if m.measuring.is_some() { "Stop and close" } else { "Close without saving" };
            if ui.button(close).clicked() {
                m.unsaved.clear();
                out.push(Action::Quit);
            }
            wait = !ui.button("Cancel").clicked();
        });
    });
    m.closing = wait && !answer.should_close();
}

fn status(ui: &mut Ui, m: &Model) {
    let f = &m.facts;
    // Of a comparison the side that the panel edits.
    let side = m.side();
    let of = if m.setup.sides() > 1 { format!("{} ", letter(side)) } else { String::new() };
    let counted = match m.setup.sides() {
        1 => f.error,
        _ => f.known.errors.get(side).copied().flatten().map(|e| [e.share(), e.rmse]),
    };
    let several = m.setup.light_count() > 1;
    let of_light = if several { format!("light {} ", m.setup.at_work() + 1) } else { String::new() };
    let error = match (f.traced, counted) {
        _ if m.setup.idles() => RichText::new(format!("{of_light}is off")).weak(),
        _ if m.edited().is_none() => RichText::new(format!("{of}is the truth")).weak(),
        (Traced::NotServed, _) => RichText::new("no truth").weak(),
        _ if m.order != f.of => RichText::new("error …").weak(),
        _ if m.draft() => RichText::new("error … (draft)").weak(),
        _ if f.told.frames[0] < f.told.frames[1] => {
            RichText::new(format!("averaged {} of {} frames", f.told.frames[0], f.told.frames[1])).weak()
        }
        (Traced::Partly(p), _) => RichText::new(format!("tracing truth {:.0} %", p.done * 100.0)).weak(),
        (Traced::Fully, None) => RichText::new("error …").weak(),
        (Traced::Fully, Some([share, rmse])) => {
            RichText::new(format!("{of}{of_light}error {:.3} %, RMSE {rmse:.4}", share * 100.0))
        }
    };
    let [width, height] = m.setup.size;
    let tip = format!(
        "Against the truth, which is traced while the picture rests. Error: wrong pixels as a share of those that face the light within its cone and range, judged by one sample per pixel, which suits hard techniques. RMSE: against the truth of {}; with more than one it is fair to filters.\nBoth are of the picture here, {} × {} pixels. What is measured differs: there it is {width} × {height} pixels, and the RMSE is against {}.",
        samples(m.setup.shown_samples()),
        f.size[0],
        f.size[1],
        samples(m.setup.truth_samples.measured(&m.setup.light))
    );
    let how = if f.wall_clock { "Wall clock." } else { "GPU time." };
    let [w, h] = f.size;
    let size = RichText::new(format!("{w} × {h}"));
    let size = if f.size == f.full { size } else { size.color(ui.visuals().warn_fg_color) };
    let fields = [
        (if several { 260.0 } else { 210.0 }, error, tip),
        (
            144.0,
            match m.edited() {
                Some(_) => RichText::new(format!("{of}technique {:.2} ms", f.technique_ms(side))),
                None => RichText::new(""),
            },
            format!("The technique's passes together. {how}"),
        ),
        (
            112.0,
            RichText::new(format!("frame {:.1} ms", f.frame_ms())),
            format!("All passes of the picture drawn last, of all sides. {how}"),
        ),
        (96.0, size, "Pixels that the picture is rendered at. Fewer while it moves, if the adapter is slow; never fewer for captures and measurements.".into()),
    ];
    ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
        for (width, text, tip) in fields {
            // A narrow window shows the first ones.
            if ui.available_width() < width {
                break;
            }
            let layout = Layout::left_to_right(Align::Center);
            ui.allocate_ui_with_layout(vec2(width, 20.0), layout, |ui| {
                ui.set_min_width(width);
                ui.add(Label::new(text.size(12.5)).truncate()).on_hover_text(tip);
            });
        }
        ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
            // The name's first part; all of it is in the tooltip.
            let name = f.adapter.split(" (").next().unwrap_or_default();
            let software = if f.software { " (software)" } else { "" };
            let adapter = RichText::new(format!("{name}{software}")).size(12.5).weak();
            let tip = format!("{}: the graphics adapter. Start with --adapter NAME to use another.", f.adapter);
            ui.add(Label::new(adapter).truncate()).on_hover_text(tip);
        });
    });
}

/// Samples in words.
fn samples(n: u32) -> String {
    if n == 1 { "one sample per pixel".into() } else { format!("{n} samples per pixel") }
}

fn messages(ctx: &Context, rect: Rect, m: &mut Model) {
    let now = Instant::now();
    m.notes.retain(|n| n.until.is_none_or(|until| until > now));
    if m.notes.is_empty() {
        return;
    }
    ctx.request_repaint_after(Duration::from_millis(500));
    let mut dismissed = None;
    let area = Area::new(Id::unique("messages")).order(Order::Foreground).fixed_pos(rect.min + vec2(12.0, 12.0));
    area.show(ctx, |ui| {
        for (i, note) in m.notes.iter_mut().enumerate() {
            let color = if note.error { ui.visuals().error_fg_color } else { ui.visuals().hyperlink_color };
            let frame = Frame::popup(ui.style()).stroke(Stroke::new(1.0, color.gamma_multiply(0.7)));
            let shown = frame.show(ui, |ui| {
                let width = (rect.width() - 60.0).clamp(120.0, 620.0);
                ui.horizontal_top(|ui| {
                    ui.vertical(|ui| {
                        ui.set_width(width - 30.0);
                        ui.add(Label::new(RichText::new(&note.text)).wrap().selectable(true));
                        if let Some(code) = &note.code {
                            faulty(ui, code);
                        }
                    });
                    if ui.small_button("×").on_hover_text("Dismiss.").clicked() {
                        dismissed = Some(i);
                    }
                });
            });
            // Who points at it is still reading.
            if shown.response.contains_pointer() {
                note.until = note.until.map(|until| until.max(now + READING));
            }
        }
    });
    if let Some(i) = dismissed {
        m.notes.remove(i);
    }
}

/// The lines around a shader's fault.
fn faulty(ui: &mut Ui, code: &Code) {
    ui.add_space(4.0);
    let wide = code.lines.last().map_or(1, |l| l.0.to_string().len());
    for (number, text) in &code.lines {
        let line = RichText::new(format!("{number:wide$}  {text}")).monospace();
        let line = if *number == code.wrong { line.color(ui.visuals().error_fg_color) } else { line.weak() };
        ui.add(Label::new(line).truncate().selectable(true));
    }
}

/// What is going on beside the window; the height that it takes.
fn busy(ctx: &Context, rect: Rect, m: &Model, out: &mut Vec<Action>) -> f32 {
    let (told, more, cancel) = match (&m.loading, &m.measuring) {
        (Some(what), _) => (format!("Opening {what} …"), String::new(), Action::CancelLoading),
        (None, Some(job)) => {
            let what = if job.what.is_empty() { String::new() } else { format!("{}. ", job.what) };
            let told = format!("{}: {}", job.title, job.told());
            (told, format!("{what}The picture waits."), Action::CancelMeasuring)
        }
        _ => {
            ctx.data_mut(|d| d.remove::<f32>(Id::unique("busy's width")));
            return 0.0;
        }
    };
    let area = Area::new(Id::unique("busy")).order(Order::Foreground).pivot(Align2::CENTER_TOP);
    area.fixed_pos(rect.center_top() + vec2(0.0, 16.0)).show(ctx, |ui| {
        Frame::popup(ui.style()).show(ui, |ui| {
            ui.horizontal(|ui| {
                if m.loading.is_some() {
                    // Not while measuring: what turns is drawn anew all the time, and disturbs what is timed.
                    ui.spinner();
                }
                // How far it is comes first and is never cut off; what it is at takes the room that is left.
                let font = TextStyle::Body.resolve(ui.style());
                let wide = |text: &str| ui.painter().layout_no_wrap(text.into(), font.clone(), Color32::WHITE).size().x;
                let gap = ui.spacing().item_spacing.x;
                let told_width = wide(&told).ceil();
                let most = (rect.width() - if m.loading.is_some() { 140.0 } else { 110.0 }).max(80.0);
                let natural = told_width + if more.is_empty() { 0.0 } else { 2.0 * gap + wide(&more).ceil() };
                // It only grows, so that the button keeps its place.
                let id = Id::unique("busy's width");
                let width = natural.max(ui.data(|d| d.get_temp(id)).unwrap_or(0.0)).min(most);
                ui.data_mut(|d| d.insert_temp(id, width));
                let (_, room) = ui.allocate_space(vec2(width, 20.0));
                let first = room.with_max_x(room.left() + told_width.min(width));
                let left_to_right = Layout::left_to_right(Align::Center);
                let mut inside = ui.new_child(UiBuilder::new().max_rect(first).layout(left_to_right));
                inside.add(Label::new(&told).truncate());
                let rest = room.with_min_x(first.right() + 2.0 * gap);
                if !more.is_empty() && rest.width() > 30.0 {
                    let mut inside = ui.new_child(UiBuilder::new().max_rect(rest).layout(left_to_right));
                    inside.add(Label::new(RichText::new(&more).weak()).truncate());
                }
                if ui.button("Cancel").on_hover_text("Stop; what was open or measured before stays.").clicked() {
                    out.push(cancel);
                }
            });
        });
    });
    BUSY
}

fn help(ctx: &Context, m: &mut Model) {
    if !m.show_help {
        return;
    }
    let mut open = true;
    let window = egui::Window::new("Mouse and keys").open(&mut open).collapsible(false).resizable(false).vscroll(true);
    let room = ctx.content_rect().size();
    let mut words = false;
    window.default_height(room.y - 80.0).anchor(Align2::CENTER_CENTER, vec2(0.0, 0.0)).show(ctx, |ui| {
        words = ui.button("Glossary").on_hover_text("What the words mean.").clicked();
        Grid::new("help").num_columns(2).spacing([24.0, 4.0]).show(ui, |ui| {
            let mut line = |keys: String, does: &str| {
                ui.label(RichText::new(keys).strong());
                ui.label(does);
                ui.end_row();
            };
            let mac = ctx.os() == egui::os::OperatingSystem::Mac;
            let named =
                |keys: &(Modifiers, Key)| KeyboardShortcut::new(keys.0, keys.1).format(&ModifierNames::NAMES, mac);
            let (gestures, shortcuts): (&[_], _) = match (m.lab.shown, m.start.shown) {
                (true, _) => (&LAB_GESTURES, LAB),
                (false, true) => (&START_GESTURES, START),
                (false, false) => (&GESTURES, SHORTCUTS),
            };
            gestures.iter().for_each(|(keys, does)| line((*keys).into(), does));
            if !m.lab.shown && !m.start.shown {
                line("1 … 9".into(), "choose a view");
            }
            for s in shortcuts.iter().filter(|s| s.keys[0].1 != Key::Questionmark) {
                line(s.keys.iter().map(named).collect::<Vec<_>>().join(", "), s.does);
            }
        });
    });
    m.show_help &= open && !words;
    if words {
        m.words = Some(Words::default());
    }
}
