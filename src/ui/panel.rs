//! The side panel: every setting and figure, in sections that fold.

use super::controls::{
    HEIGHT, Tip, field, length_unit, mark, parameter, reset_all, row, seeks, set_length_unit, set_panel_left, slide,
};
use super::lighting;
use super::model::{Action, Model};
use super::style::TEXT;
use super::{captures, compare, freeze, needs, pictures, results, views};
use crate::legend::letter;
use crate::params::Spec;
use crate::scene::builtin;
use crate::scene::builtin::cases;
use crate::scene::{Camera, Clock};
use crate::setup::place;
use crate::techniques::{self, Info, lixel_per_pixel};
use egui::collapsing_header::{CollapsingState, paint_default_icon};
use egui::scroll_area::ScrollBarVisibility;
use egui::style::ScrollAnimation;
use egui::{
    Align, Align2, Button, CollapsingHeader, ComboBox, DragValue, FontId, Key, Label, Layout, Rect, RichText,
    ScrollArea, Sense, Shape, Stroke, TextEdit, Ui, UiBuilder, Vec2, vec2,
};
use egui::{Id, Popup, Response, Role, WidgetInfo};
use glam::{DVec3, Vec3};
use std::collections::BTreeSet;
use std::path::Path;
use std::time::Duration;

/// Width of the panel at first, and the least, points.
pub const WIDTH: f32 = 340.0;
pub const LEAST: f32 = 300.0;

/// Draws the panel's contents; changes go into the model, what only the window can do into `out`.
pub fn show(ui: &mut Ui, m: &mut Model, out: &mut Vec<Action>) {
    set_panel_left(ui.ctx(), Some(ui.max_rect().left()));
    set_length_unit(ui, m.diagonal());
    head(ui, m, out);
    ui.separator();
    // A space of its own: contents that are too wide are cut off and never widen the panel.
    let rest = ui.available_rect_before_wrap();
    let mut inside = ui.new_child(UiBuilder::new().max_rect(rest));
    inside.shrink_clip_rect(rest);
    // Nothing moves under the pointer: while that is here, a content that becomes less high does not slide down.
    let end_id = Id::unique("end of what the panel shows");
    let end = ui.data(|d| d.get_temp::<f32>(end_id)).unwrap_or(0.0);
    let pressed = ui.input(|i| i.pointer.any_down());
    m.still = ui.rect_contains_pointer(rest) || pressed || Popup::is_any_open(ui.ctx());
    let still = m.still;
    let area =
        ScrollArea::vertical().auto_shrink([false, false]).scroll_bar_visibility(ScrollBarVisibility::AlwaysVisible);
    let shown = area.show(&mut inside, |ui| {
        scene(ui, m, out);
        lighting::show(ui, m);
        camera(ui, m);
        ui.add_space(4.0);
        // What differs from technique to technique comes last, so that the lists above stay where they are.
        let searched = m.searching.then_some(true);
        let sought = seeks(ui.ctx(), |what| what.starts_with("technique:")).then_some(true);
        section(ui, "Technique", header("Technique", true).open(searched.or(sought)), |ui| {
            technique(ui, m, rest.height())
        });
        let sought = seeks(ui.ctx(), |what| what.starts_with("chip:")).then_some(true);
        section(ui, "View", header("View", true).open(sought), |ui| views::show(ui, m));
        // Of a comparison these are of the side chosen above.
        let of = |title: &str, m: &Model| match m.setup.sides() {
            1 => title.to_string(),
            _ => format!("{title}: {}", letter(m.side())),
        };
        let sought = seeks(ui.ctx(), |what| what.starts_with("parameter:")).then_some(true);
        let folded = header(&of("Parameters", m), true).open(sought);
        let heading = section(ui, "Parameters", folded, |ui| parameters(ui, m));
        if m.edited().is_some_and(|info| changed(info, m, None)) && reset_all(ui, &heading, "all parameters") {
            reset_group(m, None);
        }
        if !m.scene.animations.is_empty() {
            section(ui, "Animation", header("Animation", true), |ui| animation(ui, m));
        }
        let needs = section(ui, "Needs", header(&of("Texels used / held", m), true), |ui| needs::show(ui, m, out));
        needs.tip(needs::TIP);
        section(ui, "Timings", header(&of("Timings", m), true), |ui| results::timings(ui, m, out));
        section(ui, "Measure", header("Measure", false), |ui| results::measure(ui, m, out));
        section(ui, "Capture", header("Capture", false), |ui| captures::show(ui, m, out));
        ui.add_space(8.0);
        if still {
            ui.add_space((end - ui.min_rect().height()).max(0.0));
        }
    });
    ui.data_mut(|d| d.insert_temp(end_id, shown.state.clamped_offset().y + shown.inner_rect.height()));
}

fn header(title: &str, open: bool) -> CollapsingHeader {
    CollapsingHeader::new(RichText::new(title).strong()).default_open(open)
}

/// A section that folds; the response of its header.
fn section(ui: &mut Ui, id: &str, header: CollapsingHeader, add: impl FnOnce(&mut Ui)) -> Response {
    let shown = header.id_salt(id).show_unindented(ui, |ui| {
        ui.add_space(1.0);
        add(ui);
        ui.add_space(7.0);
    });
    mark(ui, shown.header_response.rect, |what| what.strip_prefix("section:") == Some(id));
    shown.header_response
}

/// Width that the button needs which changes the theme, points.
const THEME: f32 = 84.0;
/// Width of the names in the panel's head, points.
const HEAD: f32 = 76.0;

/// A row of the panel's head: what is chosen, and its details folded away below.
pub fn choice(
    ui: &mut Ui,
    m: &mut Model,
    (title, tip): (&str, &str),
    choose: impl FnOnce(&mut Ui, &mut Model, &Response),
    details: impl FnOnce(&mut Ui, &mut Model),
) {
    let id = ui.make_persistent_id(title);
    let mut state = CollapsingState::load_with_default_open(ui.ctx(), id, false);
    let place = title.to_lowercase();
    if seeks(ui.ctx(), |what| what.split_once(':').is_some_and(|(at, _)| at == place)) {
        state.set_open(true);
    }
    ui.horizontal(|ui| {
        let layout = Layout::left_to_right(Align::Center);
        let label = ui.allocate_ui_with_layout(vec2(HEAD, HEIGHT), layout, |ui| {
            ui.set_min_width(HEAD);
            state.show_toggle_button(ui, paint_default_icon);
            ui.add(Label::new(RichText::new(title).strong()).sense(Sense::click()))
        });
        let label = label.inner.tip(tip);
        if label.clicked() {
            state.toggle(ui);
        }
        choose(ui, m, &label);
    });
    state.show_body_unindented(ui, |ui| {
        details(ui, m);
        ui.add_space(8.0);
    });
}

fn head(ui: &mut Ui, m: &mut Model, out: &mut Vec<Action>) {
    ui.add_space(2.0);
    ui.horizontal(|ui| {
        let undo = ui.add_enabled(m.history.can_undo(), Button::new("Undo"));
        if undo.tip("Take back the last change (Ctrl+Z).").clicked() {
            out.extend(m.undo());
        }
        let redo = ui.add_enabled(m.history.can_redo(), Button::new("Redo"));
        if redo.tip("Do again what was taken back (Ctrl+Shift+Z or Ctrl+Y).").clicked() {
            out.extend(m.redo());
        }
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            if ui.button("Hide").tip("Hide this panel (F9). The tab at the window's edge brings it back.").clicked() {
                m.toggle_panel();
            }
            if ui.selectable_label(m.show_help, "Help").tip("Mouse and keys (F1).").clicked() {
                m.show_help = !m.show_help;
            }
            let theme = ui.ctx().theme();
            let (other, name, icon) = match theme {
                egui::Theme::Dark => (egui::Theme::Light, "Light theme", "◑"),
                egui::Theme::Light => (egui::Theme::Dark, "Dark theme", "◐"),
            };
            // A narrow panel has room for the icon only.
            let change = ui.button(if ui.available_width() > THEME { name } else { icon });
            change.widget_info(|| WidgetInfo::labeled(Role::Button, true, name));
            if change.tip(format!("{name}. At first the window's colours are those of the system.")).clicked() {
                ui.ctx().set_theme(other);
            }
        });
    });
}

/// What a scene is called: a built-in one's name, a file's name without its folders.
pub fn scene_name(scene: &str) -> String {
    Path::new(scene).file_name().map_or(scene.into(), |n| n.to_string_lossy().into_owned())
}

fn scene(ui: &mut Ui, m: &mut Model, out: &mut Vec<Action>) {
    let tip = "What stands in the light: a scene that comes with the program, or a file. Click to fold out the file's path and the scene's size.";
    let mut asked = Vec::new();
    let choose = |ui: &mut Ui, m: &mut Model, label: &Response| {
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            if ui
                .button("Open…")
                .tip("Choose a file: a glTF scene, a set-up, a captured picture, or results.")
                .clicked()
            {
                asked.push(Action::PickFile);
            }
            let width = ui.available_width();
            let now = m.setup.scene.as_str();
            let combo = ComboBox::from_id_salt("scene").selected_text(scene_name(now)).width(width).truncate();
            let shown = combo.height(420.0).show_ui(ui, |ui| {
                let busy = m.measuring.is_some();
                let scenes = builtin::SCENES.iter().map(|b| (b.name, b.name.to_string(), b.description));
                let cases = cases::CASES.iter().map(|c| (c.id, format!("{} ({})", c.title, c.id), c.doc));
                let mut entry = |ui: &mut Ui, (id, title, doc): (&'static str, String, &str)| {
                    let chosen = now == id;
                    let entry = ui.selectable_label(chosen, title);
                    let entry = entry.tip_ui(|ui| pictures::about(ui, &mut m.pictures, id, doc, busy, &mut asked));
                    if entry.clicked() && !chosen {
                        asked.push(Action::Open(id.into()));
                    }
                };
                scenes.for_each(|s| entry(ui, s));
                ui.separator();
                ui.label(RichText::new("Cases on which some techniques fail").small().weak());
                cases.for_each(|c| entry(ui, c));
            });
            shown.response.labelled_by(label.id).tip(format!("{now}\nChoose a built-in scene."));
        });
    };
    let mut named = Vec::new();
    choice(ui, m, ("Scene", tip), choose, |ui, m| file(ui, m, &mut named));
    out.append(&mut asked);
    out.append(&mut named);
}

/// The scene's file and facts.
fn file(ui: &mut Ui, m: &mut Model, out: &mut Vec<Action>) {
    row(
        ui,
        "file",
        "A scene (.glb, .gltf, .obj, .ply, .stl), a saved set-up (.toml), a captured picture (.png) or results (.csv, .json). Files can also be dropped on the window.",
        |ui, label| {
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                let named = !m.open_path.trim().is_empty();
                let open = ui.add_enabled(named, Button::new("Open")).tip("Open the file at this path.");
                let width = ui.available_width();
                let edit = ui.add_sized([width, HEIGHT], TextEdit::singleline(&mut m.open_path).hint_text("path"));
                let edit = edit.labelled_by(label.id).tip("Type a path and press Enter.");
                let entered = edit.lost_focus() && ui.input(|i| i.key_pressed(Key::Enter));
                if named && (open.clicked() || entered) {
                    out.push(Action::Open(m.open_path.trim().into()));
                }
            });
        },
    );
    let size = m.bounds[1] - m.bounds[0];
    let (unit, metres) = length_unit(ui);
    let [x, y, z] = size.to_array().map(|side| f64::from(side) / metres);
    let facts = format!("{} triangles, {x:.1} × {y:.1} × {z:.1} {unit}", grouped(m.scene.triangles()));
    ui.label(RichText::new(facts).small().weak()).tip("Size of the scene: width, height and depth.");
    let notes: Vec<&String> = m.scene.notes.iter().chain(&m.facts.scene_note).collect();
    if !notes.is_empty() {
        let title = format!("What the loader changed ({})", notes.len());
        ui.collapsing(RichText::new(title).small(), |ui| {
            for note in notes {
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

/// `room`: height that the panel has for its sections.
fn technique(ui: &mut Ui, m: &mut Model, room: f32) {
    compare::show(ui, m);
    let chosen = m.edited();
    let search =
        ui.add_sized([ui.available_width() - 4.0, HEIGHT], TextEdit::singleline(&mut m.search).hint_text("search"));
    search.widget_info(|| egui::WidgetInfo::labeled(egui::Role::TextInput, true, "search techniques"));
    let search = search.tip(
        "Show only techniques whose name, authors, year or family hold these words (Ctrl+F). Enter takes the first.",
    );
    if std::mem::take(&mut m.searching) {
        search.request_focus();
        search.scroll_to_me(Some(Align::TOP));
    }
    let found: Vec<_> = techniques::ALL.iter().copied().filter(|i| m.finds(i)).collect();
    if search.lost_focus()
        && ui.input(|i| i.key_pressed(Key::Enter))
        && let Some(first) = found.iter().find(|i| m.refusal(i).is_none())
    {
        m.select(first);
        m.search.clear();
    }
    // A high window shows all of the list.
    let most = (room - OTHERS).max(0.26 * room).max(140.0);
    let list = ScrollArea::vertical().id_salt("techniques").max_height(most).auto_shrink([false, true]);
    let shown = list.show(ui, |ui| {
        ui.spacing_mut().item_spacing.y = 2.0;
        let (mut family, mut picked) = ("", None);
        for info in &found {
            if info.family != family {
                family = info.family;
                ui.label(RichText::new(family).small().weak());
            }
            let refused = m.refusal(info);
            let is_chosen = chosen.is_some_and(|c| c.id == info.id);
            // The list's end fades too, but stands upright.
            let title = RichText::new(info.title);
            let title = if refused.is_some() { title.italics() } else { title };
            let button = Button::selectable(is_chosen, title).min_size(vec2(ui.available_width(), HEIGHT));
            let button = ui.add_enabled(refused.is_none(), button);
            // Chosen elsewhere, as by a file, it may lie out of sight.
            if is_chosen && m.listed.replace(info.id) != Some(info.id) && !ui.clip_rect().contains_rect(button.rect) {
                ui.scroll_to_rect_animation(button.rect, Some(Align::Center), ScrollAnimation::none());
                ui.ctx().request_repaint();
            }
            mark(ui, button.rect, |what| what.strip_prefix("technique:") == Some(info.id));
            let button = button.tip(format!("{}\n{}", info.doc, info.paper));
            awaited(ui, m, info, button.rect);
            if button.tip_disabled(refused.unwrap_or_default()).clicked() {
                picked = Some(*info);
            }
        }
        if let Some(info) = picked {
            m.select(info);
            // It is under the pointer, and stays there.
            m.listed = Some(info.id);
        }
        if found.is_empty() {
            ui.label(RichText::new("No technique is called that.").weak());
        }
    });
    // The list scrolls to the row that is sought, the panel to the list.
    let sought = seeks(ui.ctx(), |what| what.starts_with("technique:"));
    if sought && !ui.clip_rect().contains_rect(shown.inner_rect) {
        ui.scroll_to_rect_animation(shown.inner_rect, Some(Align::Center), ScrollAnimation::none());
    }
    // Always a line high, so that what stands below keeps its place: what is wrong, or who thought of it.
    let of = if m.setup.sides() > 1 { format!("{}: ", letter(0)) } else { String::new() };
    let told = m.facts.notes.iter().map(|note| format!("{of}{note}"));
    // Which technique it is stands right above.
    let refusal = |c: &Info| {
        let why = m.setup.refusal(c)?;
        Some(why.strip_prefix(&format!("{}: ", c.title)).map_or(why.clone(), String::from))
    };
    let notes: Vec<String> = chosen.and_then(refusal).into_iter().chain(told).collect();
    let (text, tip) = match (notes.is_empty(), chosen) {
        (false, _) => (RichText::new(notes.join(" ")).color(ui.visuals().warn_fg_color), notes.join("\n")),
        (true, Some(c)) => (RichText::new(c.paper).weak(), format!("{}\n{}", c.doc, c.paper)),
        (true, None) => (RichText::new("ray traced").weak(), "The exact shadow.".into()),
    };
    ui.add(Label::new(text.small()).truncate().show_tooltip_when_elided(false)).tip(tip);
}

/// Shows at the end of a technique's row that its picture is being rendered, and how long it took last. No spinner of
/// egui's: that is drawn anew all the time, by the cores that render where the adapter is software.
fn awaited(ui: &Ui, m: &Model, info: &Info, row: Rect) {
    let Some(since) = m.awaited().filter(|_| (0..m.setup.sides()).any(|i| m.setup.side(i).technique == info.id)) else {
        return;
    };
    let wait = AWAITED.saturating_sub(since.elapsed());
    if !wait.is_zero() {
        return ui.ctx().request_repaint_after(wait);
    }
    ui.ctx().request_repaint_after(Duration::from_millis(100));
    let center = row.right_center() - vec2(14.0, 0.0);
    let turn = (since.elapsed().as_millis() / 100) as f32 * 0.6;
    let points = (0..=12).map(|i| center + 5.0 * Vec2::angled(turn + i as f32 * 0.4)).collect();
    ui.painter().add(Shape::line(points, Stroke::new(1.5, TEXT)));
    if let Some(seconds) = m.facts.seconds.get(info.id) {
        let at = center - vec2(12.0, 0.0);
        let text = format!("{seconds:.1} s last time");
        let text = ui.painter().layout_no_wrap(text, FontId::proportional(11.5), TEXT);
        let place = Align2::RIGHT_CENTER.anchor_size(at, text.size());
        // A long title ends under it.
        ui.painter().rect_filled(place.expand2(vec2(6.0, 2.0)), 2.0, ui.visuals().panel_fill);
        ui.painter().galley(place.min, text, TEXT);
    }
}

/// Height that the panel needs beside the list of techniques, where it has it, points.
const OTHERS: f32 = 560.0;

/// What is rendered sooner needs no sign of it.
const AWAITED: Duration = Duration::from_millis(150);

/// Whether something of a section of a technique's parameters, or of all, is not at its default.
fn changed(info: &Info, m: &mut Model, section: Option<&str>) -> bool {
    let (unit, values) = (m.setup.unit, m.edited_values());
    let mut specs = info.specs().filter(|s| section.is_none_or(|title| s.section == title));
    specs.any(|s| values.get(s.name).is_some_and(|value| *value != s.default_in(unit)))
}

/// Sets a section of the parameters, or all, back to their defaults.
fn reset_group(m: &mut Model, section: Option<&str>) {
    let Some(info) = m.edited() else { return };
    let unit = m.setup.unit;
    let values = m.edited_values();
    for spec in info.specs().filter(|s| section.is_none_or(|title| s.section == title)) {
        values.insert(spec.name.into(), spec.default_in(unit));
    }
}

fn parameters(ui: &mut Ui, m: &mut Model) {
    let Some(chosen) = m.edited() else {
        ui.label(RichText::new("The truth has no parameters but its samples, above.").small().weak());
        return;
    };
    let (distance, unit) = (m.first_reach() as f64, m.setup.unit);
    let all: BTreeSet<&str> = chosen.specs().map(|s| s.section).collect();
    let touched: BTreeSet<&str> = all.into_iter().filter(|title| changed(chosen, m, Some(title))).collect();
    let mut reset = None;
    let other = compare::other_values(m);
    let mut held = std::mem::take(&mut m.pinned);
    let pinned = &mut held;
    let mut places = std::mem::take(&mut m.places);
    let (with_plane, mut picking) = (m.has_plane(), m.picking);
    if !m.still {
        places.clear();
    }
    let abilities = m.facts.abilities.clone().filter(|a| a.weak());
    let values = m.edited_values();
    // Nothing moves under the pointer: a row that goes while that is here leaves its place empty.
    let applying: BTreeSet<&str> = chosen.specs().filter(|s| chosen.applies(s, values)).map(|s| s.name).collect();
    let rows = chosen.specs().filter(|s| applying.contains(s.name) || places.contains_key(&(chosen.id, s.name)));
    let rows: Vec<&'static Spec> = rows.collect();
    let mut one = |ui: &mut Ui, spec: &'static Spec, pinned: &mut BTreeSet<&'static str>| {
        let place = (chosen.id, spec.name);
        if !applying.contains(spec.name) {
            ui.allocate_space(vec2(0.0, places.get(&place).copied().unwrap_or_default()));
            return;
        }
        let default = spec.default_in(unit);
        let weak = abilities.as_ref().map(|on| (on, values.clone()));
        let refused = |option: &str| {
            let (on, others) = weak.as_ref()?;
            chosen.cannot_take(others, spec.name, option, on)
        };
        let value = values.entry(spec.name.into()).or_insert_with(|| default.clone());
        let mut held = pinned.contains(spec.name);
        let row = ui.push_id((chosen.id, spec.name), |ui| {
            parameter(ui, spec, value, (distance, default), (&mut held, &refused))
        });
        mark(ui, row.response.rect, |what| what.strip_prefix("parameter:") == Some(spec.name));
        places.insert(place, row.response.rect.height());
        if let Some((side, theirs)) = other.get(spec.name).filter(|(_, theirs)| theirs != value) {
            compare::differs(ui, row.response.rect, spec, &format!("{side} has {theirs}."));
        }
        if held {
            pinned.insert(spec.name)
        } else {
            pinned.remove(spec.name)
        };
    };
    let (top, rest): (Vec<_>, Vec<_>) = rows.into_iter().partition(|s| pinned.contains(s.name));
    if !top.is_empty() {
        ui.label(RichText::new("Pinned").small().weak());
        top.into_iter().for_each(|spec| one(ui, spec, pinned));
        ui.add_space(2.0);
    }
    let mut sections: Vec<&str> = Vec::new();
    chosen.specs().for_each(|s| {
        if !sections.contains(&s.section) {
            sections.push(s.section)
        }
    });
    for title in sections.into_iter().filter(|title| rest.iter().any(|s| s.section == *title)) {
        let header = CollapsingHeader::new(RichText::new(title).small().weak()).id_salt(("parameters", title));
        let within = |what: &str| {
            let name = what.strip_prefix("parameter:");
            name.is_some_and(|name| chosen.specs().any(|s| s.section == title && s.name == name))
        };
        let sought = seeks(ui.ctx(), within).then_some(true);
        let header = header.default_open(title != "Rasteriser bias").open(sought);
        let shown = header.show_unindented(ui, |ui| {
            rest.iter().filter(|s| s.section == title).for_each(|spec| one(ui, spec, pinned));
            if with_plane && title == lixel_per_pixel::SECTION {
                let button = ui.selectable_label(picking, "Pick a plane");
                picking ^= button
                    .tip("Then click a surface in the picture: its plane becomes the plane of interest.")
                    .clicked();
            }
        });
        if touched.contains(title) && reset_all(ui, &shown.header_response, title) {
            reset = Some(title);
        }
    }
    (m.pinned, m.places, m.picking) = (held, places, picking);
    if let Some(title) = reset {
        reset_group(m, Some(title));
    }
}

fn camera(ui: &mut Ui, m: &mut Model) {
    let tip = "Where the picture is seen from. Click to fold out its place and field of view.";
    choice(
        ui,
        m,
        ("Camera", tip),
        |ui, m, label| {
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                let reset = ui.add_enabled(m.setup.camera != m.home, Button::new("Reset"));
                if reset.tip("Back to the preset chosen last, or to the camera of the file (R).").clicked() {
                    m.go_home();
                }
                freeze::button(ui, m);
                let scene = m.scene.clone();
                let clock = m.setup.clock();
                let now = scene.cameras.iter().find(|c| c.at(&scene, clock) == m.setup.camera);
                let now = now.map_or_else(|| "free".into(), |c| preset_name(&c.name, c.node));
                let combo = ComboBox::from_id_salt("camera").selected_text(now).width(ui.available_width()).truncate();
                let shown = combo.show_ui(ui, |ui| {
                    for preset in &scene.cameras {
                        let camera = preset.at(&scene, clock);
                        let name = preset_name(&preset.name, preset.node);
                        if ui.selectable_label(camera == m.setup.camera, name).clicked() {
                            m.home = camera;
                            m.go_home();
                        }
                    }
                    freeze::from_the_light(ui, m);
                });
                shown
                    .response
                    .labelled_by(label.id)
                    .tip("The cameras of the scene. Animated ones move with the clock, until you move them. Free: moved away from all of them.");
            });
        },
        place_of_camera,
    );
}

/// What a camera or light of the scene is called; one with a node is moved by the scene's animation.
pub fn preset_name(name: &str, node: Option<u32>) -> String {
    if node.is_some() { format!("{name} (animated)") } else { name.into() }
}

fn place_of_camera(ui: &mut Ui, m: &mut Model) {
    freeze::outlines(ui, m);
    let (o, speed) = (m.scene.origin, 0.002 * m.diagonal());
    let least = (1e-3 * m.setup.unit as f32).max(1e-6);
    let c = &mut m.setup.camera;
    projection(ui, c, m.bounds);
    let far = c.far;
    let tip = "Nothing nearer than this is drawn. Techniques that divide depth logarithmically depend on it.";
    slide(ui, "near", tip, &mut c.near, least..=(far * 0.5).max(2.0 * least), true, "m");
    let near = c.near;
    let tip = "Nothing farther away than this is drawn.";
    slide(ui, "far", tip, &mut c.far, (near * 2.0)..=(near * 2.0).max(1e5), true, "m");
    vector(ui, "position", "Where the camera stands: x, y (up), z.", &mut c.position, o, speed);
    let tip = "The point that it looks at and turns around: x, y (up), z.";
    vector(ui, "target", tip, &mut c.target, o, speed);
    if c.position == c.target {
        c.target.z -= 10.0 * least;
    }
}

/// Perspective or orthographic, how much the picture covers, and how it is turned.
fn projection(ui: &mut Ui, c: &mut Camera, bounds: [Vec3; 2]) {
    let kinds = ["perspective", "orthographic"];
    let mut kind = c.height.is_some() as usize;
    let tip = "Perspective: rays meet in the camera. Orthographic: they run side by side, and all depths are shown at one size.";
    row(ui, "projection", tip, |ui, label| {
        let combo = ComboBox::from_id_salt("projection").width(ui.available_width());
        combo.show_index(ui, &mut kind, 2, |i| kinds[i]).labelled_by(label.id);
    });
    if (kind == 1) != c.height.is_some() {
        // What lies at the target keeps its size.
        let height = c.height_at(c.reach());
        if let Some(height) = c.height.take() {
            let back = -c.forward() * 0.5 * height / (0.5 * c.fov.to_radians()).tan();
            c.position = c.target + back;
        } else {
            c.height = Some(height);
        }
    }
    match &mut c.height {
        Some(height) => {
            let whole = bounds[0].distance(bounds[1]);
            let tip = "How much the picture covers from its lower to its upper edge.";
            slide(ui, "height", tip, height, (1e-3 * whole).max(1e-6)..=(4.0 * whole).max(*height), true, "m");
        }
        None => {
            let tip = "Vertical angle that the picture covers.";
            slide(ui, "field of view", tip, &mut c.fov, 5.0..=120.0, false, "°");
        }
    }
    let mut roll = c.roll().to_degrees();
    let before = roll;
    slide(ui, "roll", "How far the camera is turned clockwise from upright.", &mut roll, -180.0..=180.0, false, "°");
    if roll != before {
        c.set_roll(roll.to_radians());
    }
}

const AXES: [&str; 3] = ["x", "y", "z"];

/// A row, or far from zero three, with the three parts of a vector, shown with `origin` added: a place's in the scene's own coordinates.
pub fn vector(ui: &mut Ui, name: &str, tip: &str, v: &mut Vec3, origin: DVec3, speed: f32) -> bool {
    let before = *v;
    let part = |ui: &mut Ui, width: f32, label: &Response, axis: usize, part: &mut f32| {
        let origin = origin[axis];
        let (unit, metres) = length_unit(ui);
        let now = place::original(*part, origin) / metres;
        let mut shown = now;
        let drag =
            DragValue::new(&mut shown).speed(f64::from(speed) / metres).max_decimals(2).suffix(format!(" {unit}"));
        let drag = drag.range((origin - 1e7) / metres..=(origin + 1e7) / metres);
        field(ui, width, drag, &format!("{} in {unit}: {now}", AXES[axis])).labelled_by(label.id);
        if shown != now {
            *part = place::local(shown * metres, origin);
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
        if ui.add_sized([60.0, 21.0], Button::new(text)).tip(tip).clicked() {
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
        combo.tip("Which of the file's animations plays.");
        if chosen != m.setup.animation as usize {
            m.set_clock(Clock { animation: chosen as u32, ..m.setup.clock() });
        }
    });
    let mut time = m.setup.time;
    if slide(ui, "time", "Where the animation stands. Drag to scrub.", &mut time, 0.0..=duration.max(0.01), false, "s")
    {
        m.set_clock(Clock { time, ..m.setup.clock() });
    }
}
