//! The lab's settings: world, view, film, samples, frusta.

use super::found::{CHOICES, metric};
use super::{Choice, FIGURES, Lab, Origin, Spans, ground, random, save, short_name, tint, told};
use crate::flatland::file::MOST;
use crate::flatland::table::{self, Row};
use crate::flatland::{Badness, Metric};
use crate::measure::reproduce::short;
use crate::ui::controls::{HEIGHT, Tip, chips, row};
use crate::ui::model::{Action, Model};
use egui::scroll_area::ScrollBarVisibility;
use egui::{
    Align, Align2, Button, ComboBox, DragValue, FontId, Label, Layout, RichText, Role, ScrollArea, Sense, Slider,
    Stroke, StrokeKind, TextEdit, Ui, UiBuilder, WidgetInfo, vec2,
};

/// Height of what a figure says, points: all of them fit.
const SAID: f32 = 62.0;
/// Columns of the list of films from the right: mean and σ, mean, worst, angle, points.
const COLUMNS: [f32; 4] = [54.0, 43.0, 43.0, 50.0];

pub fn show(ui: &mut Ui, m: &mut Model, out: &mut Vec<Action>) {
    head(ui, m);
    ui.separator();
    // What is too wide is cut off and never widens the column.
    let rest = ui.available_rect_before_wrap();
    let mut inside = ui.new_child(UiBuilder::new().max_rect(rest));
    inside.shrink_clip_rect(rest);
    let area = ScrollArea::vertical().id_salt("flatland's settings").auto_shrink([false, false]);
    area.scroll_bar_visibility(ScrollBarVisibility::AlwaysVisible).show(&mut inside, |ui| {
        figure(ui, &mut m.lab);
        file(ui, m, out);
        title(ui, "World");
        world(ui, &mut m.lab);
        title(ui, "Show");
        view(ui, &mut m.lab);
        title(ui, "Film of the light");
        films(ui, &mut m.lab);
        samples(ui, &mut m.lab);
        ui.add_space(5.0);
        frusta(ui, &mut m.lab);
        ui.add_space(8.0);
    });
}

fn title(ui: &mut Ui, text: &str) {
    ui.add_space(3.0);
    ui.label(RichText::new(text).strong());
}

fn head(ui: &mut Ui, m: &mut Model) {
    ui.horizontal(|ui| {
        let lab = &mut m.lab;
        if ui.add_enabled(lab.can_undo(), Button::new("Undo")).tip("Take back the last change (Ctrl+Z).").clicked() {
            lab.undo();
        }
        let redo = ui.add_enabled(lab.can_redo(), Button::new("Redo"));
        if redo.tip("Do again what was taken back (Ctrl+Shift+Z or Ctrl+Y).").clicked() {
            lab.redo();
        }
        ui.add(Label::new(RichText::new("Flatland").strong()).truncate());
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            if ui.button("Leave").tip("Back to the scene (F5 or Escape). The world stays as it is.").clicked() {
                m.lab.shown = false;
            }
            if ui.selectable_label(m.show_help, "Help").tip("Mouse and keys (F1).").clicked() {
                m.show_help = !m.show_help;
            }
        });
    });
}

/// What the lab began with.
fn figure(ui: &mut Ui, lab: &mut Lab) {
    let name = match lab.now.origin {
        Origin::Figure(i) => FIGURES[i].name.to_string(),
        Origin::Chance(number) => format!("random-{number}"),
        Origin::Own => "a world of your own".into(),
    };
    let mut chosen = None;
    ui.horizontal(|ui| {
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            if ui
                .button("Random")
                .tip("Another world by chance: floor, walls and slopes, a lamp above or beside.")
                .clicked()
            {
                lab.chance += 1;
                chosen = Some(random(lab.chance));
            }
            let combo = ComboBox::from_id_salt("flatland's figures").selected_text(name).width(ui.available_width());
            let shown = combo.truncate().height(420.0).show_ui(ui, |ui| {
                for (i, figure) in FIGURES.iter().enumerate() {
                    if i == 0 || i == 5 {
                        let about = ["Figures of Chong 2003", "His four scenes, as found from his tables"][i / 5];
                        ui.label(RichText::new(about).small().weak());
                    }
                    if ui.selectable_label(lab.now.origin == Origin::Figure(i), figure.name).clicked() {
                        chosen = Some(figure.state());
                    }
                }
            });
            let shown = shown.response.tip("A figure or a scene to begin with. It can be changed, and undone.");
            shown.widget_info(|| WidgetInfo::labeled(Role::ComboBox, true, "figure"));
        });
    });
    if let Some(state) = chosen {
        lab.take(state);
    }
    let text = match lab.now.origin {
        Origin::Figure(i) => FIGURES[i].text,
        Origin::Chance(_) => {
            "A world by chance, the same for its number at every run. On the command line its name after `flatland` \
             prints its tables."
        }
        Origin::Own => {
            "Drag eye, light, and the ends of segments; turn the film by its round handle. Colours say how many pixels \
             share a lexel: green is one, red is too many."
        }
    };
    let (_, room) = ui.allocate_space(vec2(ui.available_width(), SAID));
    let mut inside = ui.new_child(UiBuilder::new().max_rect(room));
    inside.shrink_clip_rect(room);
    inside.add(Label::new(RichText::new(text).size(12.5)).wrap());
}

fn file(ui: &mut Ui, m: &mut Model, out: &mut Vec<Action>) {
    ui.horizontal(|ui| {
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            if ui.button("Browse…").tip("Choose a world's file (.toml). It can also be dropped on the window.").clicked() {
                out.push(Action::PickFile);
            }
            let named = !m.lab.path.trim().is_empty();
            if ui.add_enabled(named, Button::new("Open")).tip("Open the world in this file.").clicked() {
                out.push(Action::Open(m.lab.path.trim().into()));
            }
            if ui.add_enabled(named, Button::new("Save")).tip("Write the world into this file (Ctrl+S).").clicked() {
                save(m, out);
            }
            let edit = TextEdit::singleline(&mut m.lab.path).hint_text("world.toml");
            let edit = ui.add_sized([ui.available_width(), HEIGHT], edit);
            edit.widget_info(|| WidgetInfo::labeled(Role::TextInput, true, "world's file"));
            edit.tip("The world's file: eye, view, light and segments as text (.toml). The command line's `flatland` reads it too.");
        });
    });
}

/// A field for a number, with a name for those who do not see its place.
fn field(ui: &mut Ui, name: &str, width: f32, drag: DragValue, tip: &str) -> bool {
    let field = ui.add_sized([width, HEIGHT], drag);
    field.widget_info(|| WidgetInfo::labeled(Role::SpinButton, true, name));
    field.tip(tip).changed()
}

fn world(ui: &mut Ui, lab: &mut Lab) {
    let count = lab.now.world.segments.len();
    ui.horizontal(|ui| {
        let tip = "Press on the ground and drag: a new segment (D). Near an end of another it begins or ends there.";
        if ui.add(Button::selectable(lab.drawing, "Draw").frame_when_inactive(true)).tip(tip).clicked() {
            lab.drawing = !lab.drawing;
        }
        let delete = ui.add_enabled(lab.selected.is_some(), Button::new("Delete"));
        if delete.tip("Take the selected segment away (Del).").clicked() {
            lab.delete();
        }
        if ui.button("Fit").tip("Show all of it (Home). So does a double-click on the ground.").clicked() {
            lab.fit();
        }
        ui.add(
            Label::new(RichText::new(if count == 1 { "1 segment".into() } else { format!("{count} segments") }).weak())
                .truncate(),
        );
    });
    let world = &mut lab.now.world;
    let place = |ui: &mut Ui, name: &str, p: &mut glam::DVec2| {
        ui.add_sized([42.0, HEIGHT], Label::new(name));
        for (axis, x) in ["x", "y"].into_iter().zip([&mut p.x, &mut p.y]) {
            let drag = DragValue::new(x).range(-1e6..=1e6).speed(0.02).max_decimals(3);
            field(ui, &format!("{name} {axis}"), 56.0, drag, &format!("Where the {name} is along {axis}."));
        }
    };
    let angle = |ui: &mut Ui, name: &str, tip: &str, radians: &mut f64, range: std::ops::RangeInclusive<f64>| {
        ui.add_sized([46.0, HEIGHT], Label::new(name));
        let mut degrees = (radians.to_degrees() * 1e6).round() / 1e6;
        let drag = DragValue::new(&mut degrees).range(range).speed(0.2).max_decimals(2).suffix("°");
        if field(ui, name, 66.0, drag, tip) {
            *radians = degrees.to_radians();
        }
    };
    let number = |ui: &mut Ui, name: &str, tip: &str, n: &mut usize, [label, width]: [f32; 2]| {
        ui.add_sized([label, HEIGHT], Label::new(name));
        field(ui, name, width, DragValue::new(n).range(1..=MOST), tip);
    };
    ui.horizontal(|ui| {
        place(ui, "eye", &mut world.eye);
        angle(ui, "gaze", "Where the view looks, counter-clockwise from the right.", &mut world.gaze, -360.0..=360.0);
    });
    ui.horizontal(|ui| {
        place(ui, "light", &mut world.light);
        angle(ui, "view", "How wide the view is.", &mut world.fov, 1.0..=170.0);
    });
    ui.horizontal(|ui| {
        number(ui, "pixels", "Pixels of the camera's image.", &mut world.pixels, [42.0, 118.0]);
        number(ui, "lexels", "Texels of the light's image.", &mut world.lexels, [46.0, 66.0]);
    });
}

fn view(ui: &mut Ui, lab: &mut Lab) {
    let show = &mut lab.now.show;
    ui.horizontal_wrapped(|ui| {
        ui.checkbox(&mut show.pixel_rays, "pixel rays").tip("Rays of the camera's pixels; of many every so many-th.");
        ui.checkbox(&mut show.lexel_rays, "lexel rays")
            .tip("Rays between the light's lexels; of many every so many-th.");
        ui.checkbox(&mut show.all_films, "all films")
            .tip("The film lines of the list below at the light, each in its colour.");
    });
    row(
        ui,
        "footprints of",
        "What is coloured along the segments: each pixel, or each lexel that falls into the view.",
        |ui, _| {
            let all = [
                (Spans::Pixels, "pixels", "How many pixels share a lexel at each pixel."),
                (Spans::Lexels, "lexels", "How many pixels each lexel covers."),
                (Spans::Off, "nothing", "No colours."),
            ];
            let items = all.iter().map(|(spans, name, tip)| (*name, show.spans == *spans, tip.to_string()));
            if let Some(i) = chips(ui, items) {
                show.spans = all[i].0;
            }
        },
    );
    ui.horizontal(|ui| {
        let tip = "The world after the camera's perspective (P): the view becomes a square, and pixels' rays run parallel. Here a \
                   perspective shadow map sets its frustum up.";
        ui.checkbox(&mut show.post, "Post-perspective").tip(tip);
        let tip = "Where the near line of the perspective map stands: 0 at the light, 1 at what its rays meet first, as the \
                   method wants it.";
        let name = ui.label("push").tip(tip);
        ui.spacing_mut().slider_width = (ui.available_width() - 62.0).max(40.0);
        let slider = Slider::new(&mut lab.now.push, 0.02..=1.0).fixed_decimals(2).step_by(0.01);
        ui.add(slider).labelled_by(name.id).tip(tip);
    });
}

/// The list of films with their figures.
fn films(ui: &mut Ui, lab: &mut Lab) {
    let width = ui.available_width();
    let (_, head) = ui.allocate_space(vec2(width, 16.0));
    let (font, weak) = (FontId::proportional(11.5), ui.visuals().weak_text_color());
    let mut right = head.right() - 4.0;
    for (name, column) in ["mean + σ", "mean", "worst", "angle"].into_iter().zip(COLUMNS) {
        ui.painter().text(egui::pos2(right, head.center().y), Align2::RIGHT_CENTER, name, font.clone(), weak);
        right -= column;
    }
    let plane = match lab.now.film {
        Choice::Plane(i) => Some(i),
        _ => lab.selected,
    };
    let hand = lab.found.chosen.clone().filter(|_| lab.now.film == Choice::Hand);
    let mut wanted = None;
    for choice in [Choice::Hand].into_iter().chain(CHOICES).chain(plane.map(Choice::Plane)) {
        let figures = match (choice, &lab.found.film) {
            (Choice::Hand, _) => hand.clone(),
            (Choice::Plane(i), Some(film)) => {
                let row = table::row(film, "a segment's plane", film.of_plane(&lab.now.world, i));
                Some(row).filter(|row| film.is_valid(row.normal))
            }
            _ => lab.found.row(choice).cloned(),
        };
        if film(ui, lab, choice, figures.as_ref()) {
            wanted = Some(choice);
        }
    }
    if plane.is_none() {
        let (_, room) = ui.allocate_space(vec2(width, HEIGHT));
        let at = room.left_center() + vec2(18.0, 0.0);
        ui.painter().text(at, Align2::LEFT_CENTER, "plane of a segment: select one", FontId::proportional(12.0), weak);
    }
    if let Some(choice) = wanted {
        // By hand it goes on from where it is.
        if let (Choice::Hand, Some(row)) = (choice, &lab.found.chosen) {
            lab.now.normal = row.normal;
        }
        lab.now.film = choice;
    }
}

/// A row of the list. True: it was clicked.
fn film(ui: &mut Ui, lab: &Lab, choice: Choice, figures: Option<&Row>) -> bool {
    let chosen = lab.now.film == choice;
    let able = figures.is_some() || choice == Choice::Hand || chosen;
    let sense = if able { Sense::click() } else { Sense::hover() };
    let (rect, r) = ui.allocate_exact_size(vec2(ui.available_width(), HEIGHT), sense);
    let (name, tip) = told(choice);
    r.widget_info(|| WidgetInfo::selected(Role::RadioButton, able, chosen, name.clone()));
    let visuals = ui.visuals();
    let text = match (chosen, able) {
        (true, _) => visuals.selection.stroke.color,
        (_, true) => visuals.text_color(),
        _ => visuals.weak_text_color(),
    };
    if chosen {
        ui.painter().rect_filled(rect, 4.0, visuals.selection.bg_fill);
    } else if able && r.hovered() {
        ui.painter().rect_filled(rect, 4.0, visuals.widgets.hovered.bg_fill);
    }
    ui.painter().circle_filled(rect.left_center() + vec2(8.0, 0.0), 3.5, tint(ui, choice));
    let at = rect.left_center() + vec2(18.0, 0.0);
    ui.painter().text(at, Align2::LEFT_CENTER, &name, FontId::proportional(12.0), text);
    let mut right = rect.right() - 4.0;
    let cells = match figures {
        Some(f) => [short(f.mean_sigma), short(f.average), short(f.worst), format!("{:.1}°", f.angle)],
        None => ["–"; 4].map(String::from),
    };
    for (cell, column) in cells.into_iter().zip(COLUMNS) {
        ui.painter().text(
            egui::pos2(right, rect.center().y),
            Align2::RIGHT_CENTER,
            cell,
            FontId::monospace(11.5),
            text,
        );
        right -= column;
    }
    if able {
        r.tip(tip).clicked()
    } else {
        r.tip(format!("{tip} None crosses all of the light's rays here.")).clicked()
    }
}

/// How many samples the film is chosen from.
fn samples(ui: &mut Ui, lab: &mut Lab) {
    let able = metric(lab.now.film).is_some();
    ui.add_space(2.0);
    ui.horizontal(|ui| {
        let mut few = lab.now.few.is_some();
        let tip = "Choose the best film from fewer pixels than the image has, as a small image drawn first would. Figures and \
                   colours are of the whole image all the same.";
        ui.add_enabled_ui(able, |ui| {
            if ui.checkbox(&mut few, "choose it from").tip(tip).changed() {
                lab.now.few = few.then_some(10);
            }
        });
        let mut count = lab.now.few.unwrap_or(lab.now.world.pixels);
        ui.add_enabled_ui(able && few, |ui| {
            let drag = DragValue::new(&mut count).range(5..=1000).speed(0.3).suffix(" samples");
            if field(ui, "samples", 96.0, drag, tip) {
                lab.now.few = Some(count);
            }
        });
        // What that adds to the error.
        if let (true, true, Some(now), Some(best)) = (able, few, &lab.found.chosen, lab.found.row(lab.now.film)) {
            let [now, best] = [now, best].map(|row| match lab.now.film {
                Choice::Least(Metric::L1) => row.average,
                Choice::Least(Metric::L2) => row.mean_sigma,
                _ => row.worst,
            });
            let text = format!("+{:.2} %", (now / best - 1.0) * 100.0);
            ui.add(Label::new(RichText::new(text).monospace()).truncate()).tip("What the film from few samples adds to the error that its metric keeps small.");
        }
    });
}

/// Parts of the light's frustum.
fn frusta(ui: &mut Ui, lab: &mut Lab) {
    let able = metric(lab.now.film).is_some();
    ui.add_enabled_ui(able, |ui| {
        ui.horizontal(|ui| {
            ui.label(RichText::new("Frusta").strong());
            let tip = "Split the light's frustum into so many, each with a film and a share of the lexels of its own. Choose L1 or L2 above.";
            let items = (1..=4).map(|n| (["1", "2", "3", "4"][n - 1], lab.now.frusta == n, tip.to_string()));
            if let Some(i) = chips(ui, items) {
                lab.now.frusta = i + 1;
            }
            ui.label("of");
            let tip = "Equal parts to begin with, of which neighbours are merged as long as that costs least.";
            field(ui, "equal parts", 84.0, DragValue::new(&mut lab.now.first).range(4..=32).suffix(" merged"), tip);
        });
    });
    let (_, bar) = ui.allocate_space(vec2(ui.available_width() - 4.0, 18.0));
    let line = Stroke::new(1.0, ui.visuals().window_stroke.color);
    let total: usize = lab.found.parts.iter().map(|p| p.lexels).sum();
    let mut left = bar.left();
    for (i, part) in lab.found.parts.iter().enumerate().filter(|(_, p)| p.lexels > 0) {
        let width = bar.width() * part.lexels as f32 / total.max(1) as f32;
        let block = egui::Rect::from_min_size(egui::pos2(left, bar.top()), vec2(width, bar.height()));
        ui.painter().rect_filled(block, 0.0, ground::part_color(ui, i));
        if width > 22.0 {
            let text = part.lexels.to_string();
            ui.painter().text(
                block.center(),
                Align2::CENTER_CENTER,
                text,
                FontId::proportional(12.0),
                egui::Color32::BLACK,
            );
        }
        left += width;
    }
    ui.painter().rect_stroke(bar, 2.0, line, StrokeKind::Inside);
    let r = ui.interact(bar, ui.scope_id().with("shares"), Sense::hover());
    r.tip("Each frustum's share of the lexels.");
    let text = match (able, lab.found.split, &lab.found.chosen) {
        (false, ..) => format!("The film {} is one for all: choose L1 or L2 to split.", short_name(lab.now.film)),
        (_, Some(Badness { worst, mean, mean_sigma }), Some(one)) => format!(
            "{} frusta: worst {}, mean {}, mean + σ {}; the mean of one is {:.2} times that.",
            lab.found.parts.len(),
            short(worst),
            short(mean),
            short(mean_sigma),
            one.average / mean
        ),
        _ => "One frustum has all lexels.".into(),
    };
    let (_, room) = ui.allocate_space(vec2(ui.available_width(), 36.0));
    ui.new_child(UiBuilder::new().max_rect(room)).add(Label::new(RichText::new(text).size(12.0).weak()).wrap());
}
