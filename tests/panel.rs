//! The window's panel, without a window and without a device.

use egui_kittest::kittest::{NodeT, Queryable};
use egui_kittest::{Harness, Node};
use shadowscope::light::Light;
use shadowscope::params::Value;
use shadowscope::scene::geometry::Geometry;
use shadowscope::setup::Setup;
use shadowscope::techniques;
use shadowscope::ui::{self, Action, Model};
use std::sync::Arc;

struct State {
    model: Model,
    actions: Vec<Action>,
    /// What the layout leaves for the picture.
    picture: egui::Rect,
}

fn harness(what: &str, height: f32) -> Harness<'static, State> {
    let (setup, scene) = Setup::open(what).unwrap();
    let geometry = Geometry::new(&scene, 0, 0.0).unwrap();
    let model = Model::new(setup, Arc::new(scene), geometry.bounds);
    let state = State { model, actions: Vec::new(), picture: egui::Rect::NOTHING };
    // The harness keeps a margin of 8 points around what it shows.
    let mut harness =
        Harness::builder().with_size([1296.0, height + 16.0]).with_accessibility_check(false).build_ui_state(
            |ui, s: &mut State| {
                ui::apply_style(ui.ctx());
                s.picture = ui::layout(ui, &mut s.model, &mut s.actions);
            },
            state,
        );
    harness.run_steps(4);
    harness
}

/// Clicks what has this label; the upper one of two, as a technique and its map may share a name.
fn click(harness: &mut Harness<'static, State>, label: &str) {
    harness.get_all_by_label(label).next().unwrap().click();
    harness.run_steps(3);
}

/// Opens a section that starts closed.
fn open(harness: &mut Harness<'static, State>, section: &str) {
    click(harness, section);
    harness.run_steps(20);
}

fn setup(harness: &Harness<'static, State>) -> Setup {
    harness.state().model.setup.clone()
}

#[test]
fn all_sections_are_there_and_the_picture_keeps_its_place() {
    let mut harness = harness("cubes", 2400.0);
    for section in ["Scene", "Technique", "View", "Parameters", "Light", "Camera", "Timings", "Measure", "Capture"] {
        harness.get_by_label(section);
    }
    for section in ["Light", "Camera", "Measure", "Capture"] {
        open(&mut harness, section);
    }
    for label in ["azimuth", "field of view", "near", "far", "Measure this set-up", "Save picture", "Save set-up"] {
        harness.get_all_by_label(label).next().unwrap();
    }
    assert_eq!(harness.state().picture.width(), 1280.0 - 340.0, "the panel's contents are wider than the panel");
}

#[test]
fn the_smallest_window_clips_nothing_sideways() {
    let mut harness = harness("cubes", 384.0);
    harness.set_size(egui::vec2(656.0, 400.0));
    harness.run_steps(4);
    assert_eq!(harness.state().picture.width(), 640.0 - 340.0);
}

#[test]
fn a_click_selects_another_technique() {
    let mut harness = harness("cubes", 1200.0);
    for info in techniques::ALL.iter().rev() {
        if info.refuses(&setup(&harness).light).is_none() {
            click(&mut harness, info.title);
            assert_eq!(setup(&harness).technique, info.id);
            setup(&harness).check().unwrap();
        }
    }
}

#[test]
fn a_technique_without_the_view_shows_the_shaded_picture() {
    let mut harness = harness("cubes", 1200.0);
    click(&mut harness, "Texel grid");
    assert_eq!(setup(&harness).view, "texels");
    click(&mut harness, "Ray-traced hard shadow");
    assert_eq!(setup(&harness).view, "shaded");
}

#[test]
fn dragging_a_slider_changes_the_parameter_and_is_one_step() {
    let mut harness = harness("cubes", 1200.0);
    let before = setup(&harness);
    let slider = |h: &Harness<'static, State>| {
        let all = h.get_all_by_role_and_label(egui::accesskit::Role::Slider, "bias");
        all.map(|n: Node| n.rect()).next().unwrap()
    };
    let rect = slider(&harness);
    harness.drag_at(rect.center());
    harness.run_steps(2);
    for x in [0.6, 0.7, 0.8] {
        harness.hover_at(rect.left_center() + egui::vec2(rect.width() * x, 0.0));
        harness.run_steps(2);
    }
    harness.drop_at(rect.left_center() + egui::vec2(rect.width() * 0.8, 0.0));
    harness.run_steps(3);
    let after = setup(&harness);
    assert_ne!(after.params, before.params);
    assert!(matches!(after.values()["bias"], Value::Float(v) if v > 0.002));
    after.check().unwrap();
    click(&mut harness, "Undo");
    assert_eq!(setup(&harness), before, "a drag is one step");
    click(&mut harness, "Redo");
    assert_eq!(setup(&harness), after);
}

#[test]
fn undo_leaves_the_camera_where_it_was_flown() {
    let mut harness = harness("cubes", 1200.0);
    let before = setup(&harness);
    click(&mut harness, "Percentage-closer filtering");
    harness.state_mut().model.setup.camera.position.x += 1.0;
    harness.run_steps(2);
    let flown = setup(&harness).camera;
    harness.key_press_modifiers(egui::Modifiers::COMMAND, egui::Key::Z);
    harness.run_steps(3);
    assert_eq!(setup(&harness).technique, before.technique);
    assert_eq!(setup(&harness).camera, flown);
    harness.key_press_modifiers(egui::Modifiers::COMMAND | egui::Modifiers::SHIFT, egui::Key::Z);
    harness.run_steps(3);
    assert_eq!(setup(&harness).technique, "pcf");
}

#[test]
fn a_camera_preset_is_a_step() {
    let mut harness = harness("cubes", 2400.0);
    open(&mut harness, "Camera");
    let before = setup(&harness);
    click(&mut harness, "above");
    assert_ne!(setup(&harness).camera, before.camera);
    click(&mut harness, "Undo");
    assert_eq!(setup(&harness), before);
}

#[test]
fn undo_goes_back_to_the_scene_before() {
    let mut harness = harness("cubes", 1200.0);
    let before = setup(&harness);
    let (other, scene) = Setup::open("blocks").unwrap();
    let bounds = harness.state().model.bounds;
    harness.state_mut().model.open(other.clone(), Arc::new(scene), bounds, false);
    harness.run_steps(2);
    click(&mut harness, "Undo");
    assert_eq!(harness.state().actions, [Action::Restore(Box::new(before.clone()))]);
    // The window loads it; until it is there the other scene stays.
    assert_eq!(harness.state().model.loading.as_deref(), Some("cubes"));
    assert_eq!(setup(&harness), other);
    let (_, scene) = Setup::open("cubes").unwrap();
    harness.state_mut().model.loading = None;
    harness.state_mut().model.open(before.clone(), Arc::new(scene), bounds, true);
    harness.run_steps(2);
    assert!(!harness.state().model.history.can_undo());
    click(&mut harness, "Redo");
    assert_eq!(harness.state().actions.last(), Some(&Action::Restore(Box::new(other))));
}

#[test]
fn a_technique_that_does_not_serve_the_light_says_so() {
    let mut harness = harness("cubes", 2400.0);
    open(&mut harness, "Light");
    click(&mut harness, "omni");
    assert!(matches!(setup(&harness).light, Light::Omni { .. }));
    assert_eq!(setup(&harness).technique, "rt-hard", "the first technique that serves the light");
    let refused = techniques::find("shadow-map").unwrap();
    let button = harness.get_by_label(refused.title);
    assert!(button.accesskit_node().is_disabled());
    button.hover();
    harness.run_steps(40);
    let reason = refused.refuses(&setup(&harness).light).unwrap();
    harness.get_by_label(&reason);
    harness.get_by_label(refused.title).click();
    harness.run_steps(3);
    assert_eq!(setup(&harness).technique, "rt-hard");
}

#[test]
fn a_parameter_resets() {
    let mut harness = harness("cubes", 1200.0);
    let values = harness.state_mut().model.setup.params.get_mut("shadow-map").unwrap();
    values.insert("bias".into(), Value::Float(0.05));
    harness.run_steps(3);
    click(&mut harness, "reset bias");
    assert_eq!(setup(&harness).values()["bias"], Value::Float(0.002));
}

#[test]
fn buttons_ask_the_window_for_what_only_it_can_do() {
    let mut harness = harness("cubes", 2400.0);
    open(&mut harness, "Measure");
    open(&mut harness, "Capture");
    harness.state_mut().actions.clear();
    for label in ["Measure this set-up", "Save picture", "Save set-up", "Browse…"] {
        click(&mut harness, label);
    }
    let expected = [
        Action::Measure,
        Action::Capture("picture.png".into()),
        Action::SaveSetup("setup.toml".into()),
        Action::PickFile,
    ];
    assert_eq!(harness.state().actions, expected);
}

#[test]
fn digits_choose_views() {
    let mut harness = harness("cubes", 1200.0);
    harness.key_press(egui::Key::Num5);
    harness.run_steps(2);
    assert_eq!(setup(&harness).view, "error");
}
