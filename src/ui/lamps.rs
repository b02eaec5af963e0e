//! The panel's list of lights: which there are, which shine, and which one is at work.

use super::controls::{HEIGHT, Tip, row};
use super::model::Model;
use super::panel::preset_name;
use crate::light::Light;
use crate::scene::{Clock, Scene};
use crate::setup::{Lamp, MOST_LIGHTS, Setup};
use egui::{Align, Button, ComboBox, Layout, ScrollArea, Ui, WidgetInfo, vec2};
use glam::Vec3;

/// Rows of the list that show at once, and points that each takes.
const SHOWN: f32 = 5.0;
const ROW: f32 = HEIGHT + 3.0;

/// What a light is called: its number, and the preset that it is, or else its kind.
fn name(scene: &Scene, clock: Clock, number: usize, light: &Light) -> String {
    let preset = scene.lights.iter().find(|l| l.at(scene, clock) == *light);
    format!("{number}: {}", preset.map_or_else(|| format!("own {}", light.kind()), |l| preset_name(&l.name, l.node)))
}

/// The lights by name, in their order.
pub fn names(m: &Model) -> Vec<String> {
    let clock = m.setup.clock();
    m.setup.lamps().iter().enumerate().map(|(i, lamp)| name(&m.scene, clock, i + 1, &lamp.light)).collect()
}

/// The list, where there are several.
pub fn list(ui: &mut Ui, m: &mut Model) {
    let mut lamps = m.setup.lamps();
    if lamps.len() == 1 {
        return;
    }
    let (before, work, names) = (lamps.clone(), m.setup.at_work(), names(m));
    let (mut chosen, mut removed) = (work, None);
    let area = ScrollArea::vertical().id_salt("lights").max_height(SHOWN * ROW).auto_shrink([false, true]);
    area.show(ui, |ui| {
        ui.spacing_mut().item_spacing.y = ROW - HEIGHT;
        for (i, (lamp, name)) in lamps.iter_mut().zip(&names).enumerate() {
            ui.push_id(i, |ui| ui.horizontal(|ui| entry(ui, lamp, (i, name), work, (&mut chosen, &mut removed))));
        }
    });
    if lamps != before {
        m.setup.set_lamps(lamps, work);
    }
    if let Some(at) = removed {
        m.setup.remove_light(at);
    } else if chosen != work {
        choose(m, chosen);
    }
}

/// A row of the list.
fn entry(
    ui: &mut Ui,
    lamp: &mut Lamp,
    (i, name): (usize, &String),
    work: usize,
    (chosen, removed): (&mut usize, &mut Option<usize>),
) {
    let on = ui.checkbox(&mut lamp.on, "");
    on.widget_info(|| WidgetInfo::selected(egui::Role::CheckBox, true, lamp.on, format!("light {} on", i + 1)));
    on.tip("Whether it shines. Off, it costs nothing.");
    let strength = lamp.light.color().max_element();
    let mut hue = if strength > 0.0 { (lamp.light.color() / strength).to_array() } else { [1.0; 3] };
    if ui.color_edit_button_rgb(&mut hue).tip("Its colour; how bright it is stays.").changed() {
        *lamp.light.color_mut() = Vec3::from(hue) * strength;
    }
    let tip = "Maps, visibility, truth and errors are of the light that is chosen here, and the controls of the light change it.";
    ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
        let remove = ui.small_button("×");
        remove.widget_info(|| WidgetInfo::labeled(egui::Role::Button, true, format!("remove light {}", i + 1)));
        if remove.tip("Remove this light.").clicked() {
            *removed = Some(i);
        }
        // Names stand at the left.
        ui.with_layout(Layout::top_down(Align::Min), |ui| {
            let label = Button::selectable(i == work, name).truncate().min_size(vec2(ui.available_width(), HEIGHT));
            if ui.add(label).tip(tip).clicked() {
                *chosen = i;
            }
        });
    });
}

/// Puts a light to work.
pub fn choose(m: &mut Model, at: usize) {
    if let Err(error) = m.setup.choose_light(at) {
        m.fail(&error);
    }
}

/// The row that adds lights; the one added is put to work.
pub fn add(ui: &mut Ui, m: &mut Model) {
    let tip = "Another light beside those that there are. Each is shadowed by the chosen technique, and the shaded picture is lit by \
               all that are on.";
    let scene = m.scene.clone();
    row(ui, "more lights", tip, |ui, label| {
        let count = m.setup.light_count();
        let text = if count == MOST_LIGHTS { "as many as there may be" } else { "add a light" };
        let combo = ComboBox::from_id_salt("add a light").selected_text(text).width(ui.available_width()).truncate();
        let shown = ui.add_enabled_ui(count < MOST_LIGHTS, |ui| {
            combo.show_ui(ui, |ui| {
                for preset in &scene.lights {
                    let name = preset_name(&preset.name, preset.node);
                    if ui.selectable_label(false, name).tip("A light of the scene.").clicked() {
                        added(m, |setup| setup.add_light(preset.at(&scene, setup.clock())));
                    }
                }
                let copy = ui.selectable_label(false, "a copy of the present one");
                if copy.tip("Then change its kind, place and colour.").clicked() {
                    added(m, |setup| setup.add_light(setup.light));
                }
                let all = ui.selectable_label(false, "all of the scene");
                if all.tip("All lights of the scene that are not there yet.").clicked() {
                    added(m, |setup| setup.add_all_lights(&scene));
                }
            })
        });
        shown.inner.response.labelled_by(label.id).tip(tip);
    });
}

fn added(m: &mut Model, add: impl FnOnce(&mut Setup) -> anyhow::Result<()>) {
    let before = m.setup.light_count();
    match add(&mut m.setup) {
        Err(error) => m.fail(&error),
        Ok(()) if m.setup.light_count() > before => choose(m, before),
        Ok(()) => m.say("All lights of the scene are there already."),
    }
}

/// Which light the views of a single one show, where there are several.
pub fn of_which(ui: &mut Ui, m: &mut Model) {
    if m.setup.light_count() == 1 {
        return;
    }
    let tip = "The light whose visibility, truth, errors and maps the views show. The shaded picture is lit by all.";
    let names = names(m);
    row(ui, "of light", tip, |ui, label| {
        let work = m.setup.at_work();
        let combo =
            ComboBox::from_id_salt("of light").selected_text(&names[work]).width(ui.available_width()).truncate();
        let shown = combo.show_ui(ui, |ui| {
            for (i, name) in names.iter().enumerate() {
                if ui.selectable_label(i == work, name).clicked() {
                    choose(m, i);
                }
            }
        });
        shown.response.labelled_by(label.id).tip(tip);
    });
}
