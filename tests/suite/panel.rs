//! The window's panel, without a window and without a device.

use crate::gltf::motion::turntable;
use egui_kittest::kittest::{NodeT, Queryable};
use egui_kittest::{Harness, Node};
use shadowscope::chart;
use shadowscope::light::Light;
use shadowscope::measure::advise::{Advice, Budget, FIGURES, Figure};
use shadowscope::measure::{self, Record, params_text, stability};
use shadowscope::params::{Kind, Value};
use shadowscope::scene::Clock;
use shadowscope::scene::builtin::cases;
use shadowscope::scene::geometry::Geometry;
use shadowscope::sequence::Along;
use shadowscope::setup::{self, Arrange, Setup};
use shadowscope::techniques;
use shadowscope::ui::{self, Action, Job, Model, Picker, Picture, Reading, Subject, Tab, Traced};
use shadowscope::view;
use std::sync::Arc;

pub struct State {
    pub model: Model,
    pub actions: Vec<Action>,
    /// What the layout leaves for the picture.
    pub picture: egui::Rect,
}

pub fn harness(what: &str, height: f32) -> Harness<'static, State> {
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
pub fn click(harness: &mut Harness<'static, State>, label: &str) {
    // It may lie farther down in a list.
    harness.get_all_by_label(label).next().unwrap().scroll_to_me();
    harness.run_steps(8);
    harness.get_all_by_label(label).next().unwrap().click();
    harness.run_steps(3);
}

/// Opens a section that starts closed, or closes one that is open.
fn open(harness: &mut Harness<'static, State>, section: &str) {
    use egui::accesskit::Role;
    // In the panel's head a combo box bears the same name.
    match harness.query_by_role_and_label(Role::Label, section) {
        Some(name) => name.click(),
        None => click(harness, section),
    }
    harness.run_steps(20);
}

/// Chooses from a combo box of the panel's head.
fn choose(harness: &mut Harness<'static, State>, what: &str, entry: &str) {
    harness.get_by_role_and_label(egui::accesskit::Role::ComboBox, what).click();
    harness.run_steps(3);
    click(harness, entry);
}

fn setup(harness: &Harness<'static, State>) -> Setup {
    harness.state().model.setup.clone()
}

#[test]
fn all_sections_are_there_and_the_picture_keeps_its_place() {
    let mut harness = harness("cubes", 2400.0);
    for section in [
        "Scene",
        "Light",
        "Camera",
        "Technique",
        "View",
        "Parameters",
        "Texels used / held",
        "Timings",
        "Measure",
        "Capture",
    ] {
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
    let mut harness = harness("cubes", 2400.0);
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
fn a_flight_that_comes_to_rest_is_a_step() {
    let mut harness = harness("cubes", 1200.0);
    let before = setup(&harness);
    click(&mut harness, "Percentage-closer filtering");
    let flight = |h: &mut Harness<'static, State>| {
        for _ in 0..3 {
            h.state_mut().model.setup.camera.position.x += 1.0;
            h.run_steps(1);
        }
        setup(h).camera
    };
    let there = flight(&mut harness);
    std::thread::sleep(std::time::Duration::from_millis(500));
    harness.run_steps(1);
    let farther = flight(&mut harness);
    let mut undo = |redo: bool| {
        let shift = if redo { egui::Modifiers::SHIFT } else { egui::Modifiers::NONE };
        harness.key_press_modifiers(egui::Modifiers::COMMAND | shift, egui::Key::Z);
        harness.run_steps(3);
        (setup(&harness).technique, setup(&harness).camera, harness.state().model.notes.last().unwrap().text.clone())
    };
    assert_eq!(undo(false), ("pcf".into(), there, "Undid: camera".into()));
    assert_eq!(undo(false), ("pcf".into(), before.camera, "Undid: camera".into()));
    let technique = "technique shadow-map → pcf";
    assert_eq!(undo(false), ("shadow-map".into(), before.camera, format!("Undid: {technique}")));
    assert_eq!(undo(true), ("pcf".into(), before.camera, format!("Redid: {technique}")));
    undo(true);
    assert_eq!(undo(true), ("pcf".into(), farther, "Redid: camera".into()));
}

#[test]
fn a_camera_preset_is_a_step() {
    let mut harness = harness("cubes", 2400.0);
    let before = setup(&harness);
    choose(&mut harness, "Camera", "above");
    assert_ne!(setup(&harness).camera, before.camera);
    click(&mut harness, "Undo");
    assert_eq!(setup(&harness), before);
}

/// The shadow camera stays where it was frozen, and is released by the same key or button; each is a step.
#[test]
fn the_shadow_camera_freezes_and_is_released() {
    let mut harness = harness("cubes", 1600.0);
    open(&mut harness, "Camera");
    harness.get_by_role_and_label(egui::accesskit::Role::CheckBox, "outlines").click();
    harness.run_steps(3);
    let before = setup(&harness);
    assert!(before.outlines);
    harness.key_press(egui::Key::F);
    harness.run_steps(3);
    harness.state_mut().model.setup.camera.position.x += 1.0;
    harness.run_steps(3);
    assert_eq!(setup(&harness).shadow_camera, Some(before.camera));
    assert_eq!(setup(&harness).frozen(), Some(before.camera));
    click(&mut harness, "Freeze");
    assert_eq!(setup(&harness).shadow_camera, None);
    harness.key_press_modifiers(egui::Modifiers::COMMAND, egui::Key::Z);
    harness.run_steps(3);
    assert_eq!(setup(&harness).shadow_camera, Some(before.camera), "releasing is a step");
}

/// From the light's own camera all of the scene is in the picture, and what the light reaches of a lamp's cone.
#[test]
fn the_lights_own_view_is_a_preset() {
    let mut harness = harness("cubes", 1600.0);
    let scene = harness.state().model.scene.clone();
    for light in scene.lights.iter().filter(|l| !matches!(l.light, Light::RectArea { .. })) {
        harness.state_mut().model.setup.light = light.light;
        harness.run_steps(2);
        harness.get_by_role_and_label(egui::accesskit::Role::ComboBox, "Camera").click();
        harness.run_steps(3);
        harness.get_by_label("from the light").click();
        harness.run_steps(3);
        let s = setup(&harness);
        s.check().unwrap();
        match light.light {
            Light::Directional { .. } => {
                assert!(s.camera.forward().distance(light.light.axis()) < 1e-4);
                let seen = s.camera.projection(1.0) * s.camera.view();
                for i in 0..8 {
                    let bounds = harness.state().model.bounds;
                    let corner = glam::Vec3::from_array([0, 1, 2].map(|a| bounds[i >> a & 1][a]));
                    assert!(seen.project_point3(corner).truncate().abs().max_element() <= 1.0, "{corner} is not seen");
                }
            }
            Light::Spot { outer_angle, .. } => {
                assert!(s.camera.position == light.light.position() && s.camera.fov == 2.0 * outer_angle);
            }
            _ => assert_eq!(s.camera.position, light.light.position()),
        }
    }
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
    choose(&mut harness, "Light", "omni");
    assert!(matches!(setup(&harness).light, Light::Omni { .. }));
    assert_eq!(setup(&harness).technique, "cube", "the first technique that serves the light");
    let refused = techniques::find("shadow-map").unwrap();
    let button = harness.get_by_label(refused.title);
    assert!(button.accesskit_node().is_disabled());
    button.hover();
    harness.run_steps(40);
    let reason = refused.refuses(&setup(&harness).light).unwrap();
    harness.get_by_label(&reason);
    harness.get_by_label(refused.title).click();
    harness.run_steps(3);
    assert_eq!(setup(&harness).technique, "cube");
}

/// Lights are added, chosen, switched, coloured by name in the list, and removed; each is a step that can be undone, and the
/// technique stays. In the smallest window nothing of the list is cut off.
#[test]
fn lights_are_listed() {
    use egui::accesskit::Role;
    let mut harness = harness("bench", 2400.0);
    open(&mut harness, "Light");
    assert!(harness.query_by_label("light 1 on").is_none(), "one light has no list");
    choose(&mut harness, "more lights", "lamp");
    let now = setup(&harness);
    assert_eq!(
        (now.light_count(), now.at_work(), now.light.kind(), now.technique.as_str()),
        (2, 1, "omni", "shadow-map")
    );
    choose(&mut harness, "more lights", "all of the scene");
    assert_eq!((setup(&harness).light_count(), setup(&harness).at_work()), (3, 2));
    click(&mut harness, "1: sun");
    assert_eq!(setup(&harness).at_work(), 0);
    click(&mut harness, "light 2 on");
    assert_eq!(setup(&harness).lamps().iter().map(|l| l.on).collect::<Vec<_>>(), [true, false, true]);
    choose(&mut harness, "of light", "3: spot");
    assert_eq!((setup(&harness).at_work(), setup(&harness).light.kind()), (2, "spot"));
    // Techniques that serve the lights that are on can be measured.
    assert!(harness.state().model.techniques().contains(&"pcf".to_string()));
    let before = setup(&harness);
    click(&mut harness, "remove light 2");
    assert_eq!((setup(&harness).light_count(), setup(&harness).light), (2, before.light));
    harness.key_press_modifiers(egui::Modifiers::COMMAND, egui::Key::Z);
    harness.run_steps(3);
    assert_eq!(setup(&harness).lamps(), before.lamps());
    setup(&harness).check().unwrap();
    for _ in 3..16 {
        choose(&mut harness, "more lights", "a copy of the present one");
    }
    assert_eq!(setup(&harness).light_count(), 16);
    assert!(harness.get_by_role_and_label(Role::ComboBox, "more lights").accesskit_node().is_disabled());
    harness.set_size(egui::vec2(1296.0, 816.0));
    harness.run_steps(4);
    assert_eq!(harness.state().picture.width(), 1280.0 - 340.0, "the list is wider than the panel");
    for name in ["light 14 on", "remove light 14"] {
        let rect = harness.get_by_label(name).rect();
        assert!(rect.right() <= 1288.0 && rect.left() >= 948.0, "{name}: {rect}");
    }
}

/// A light's size is set by a slider, kept by the other kinds that have one, as seen from the scene, and taken back.
#[test]
fn a_lights_size_is_set_converted_and_undone() {
    use egui::accesskit::Role;
    let mut harness = harness("cubes", 2400.0);
    open(&mut harness, "Light");
    let drag = |h: &mut Harness<'static, State>, name: &str, to: f32| {
        let rect = h.get_by_role_and_label(Role::Slider, name).rect();
        let place = |x: f32| rect.left_center() + egui::vec2(rect.width() * x, 0.0);
        h.drag_at(place(0.05));
        h.run_steps(2);
        h.hover_at(place(to));
        h.run_steps(2);
        h.drop_at(place(to));
        h.run_steps(3);
    };
    drag(&mut harness, "angular radius", 0.6);
    let Light::Directional { angular_radius, .. } = setup(&harness).light else { panic!() };
    assert!(angular_radius > 0.0 && angular_radius < 10.0, "{angular_radius}");
    setup(&harness).check().unwrap();
    choose(&mut harness, "Light", "spot");
    assert_eq!(setup(&harness).light.radius(), 0.0);
    drag(&mut harness, "radius", 0.5);
    let spot = setup(&harness).light;
    assert!(spot.radius() > 1e-3 && spot.radius() < 10.0, "{spot:?}");
    choose(&mut harness, "kind", "omni");
    let omni = setup(&harness).light;
    assert!(matches!(omni, Light::Omni { radius, .. } if radius == spot.radius()), "{omni:?}");
    choose(&mut harness, "kind", "directional");
    let [low, high] = harness.state().model.bounds;
    let seen = spot.radius() / spot.position().distance((low + high) / 2.0);
    assert!((setup(&harness).light.radius() / seen - 1.0).abs() < 1e-3, "{:?}", setup(&harness).light);
    choose(&mut harness, "kind", "hemisphere");
    assert_eq!(setup(&harness).light.radius(), 0.0);
    let undo = |h: &mut Harness<'static, State>| {
        h.key_press_modifiers(egui::Modifiers::COMMAND, egui::Key::Z);
        h.run_steps(3);
    };
    undo(&mut harness);
    undo(&mut harness);
    assert_eq!(setup(&harness).light, omni);
    undo(&mut harness);
    assert_eq!(setup(&harness).light, spot);
    undo(&mut harness);
    assert_eq!((setup(&harness).light.kind(), setup(&harness).light.radius()), ("spot", 0.0));
    harness.key_press_modifiers(egui::Modifiers::COMMAND | egui::Modifiers::SHIFT, egui::Key::Z);
    harness.run_steps(3);
    assert_eq!(setup(&harness).light, spot);
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
    for label in ["Measure this set-up", "Save picture", "Save set-up", "Open…"] {
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
    harness.key_press(egui::Key::Num4);
    harness.run_steps(2);
    assert_eq!(setup(&harness).view, "error");
}

/// A row as a sweep of the harness's scene would measure it.
fn row(setup: &Setup, technique: &str, resolution: Option<i64>, error: f64, ms: f64) -> Record {
    let mut setup = Setup { view: "shaded".into(), ..setup.clone() };
    setup.select(technique).unwrap();
    if let Some(resolution) = resolution {
        let values = setup.params.get_mut(technique).unwrap();
        values.insert("resolution".into(), Value::Int(resolution));
    }
    Record {
        technique: technique.into(),
        params: params_text(&setup),
        scene: setup.scene.clone(),
        width: setup.size[0],
        height: setup.size[1],
        facing: 1000,
        error_share: error,
        gpu_ms: ms,
        gpu_bytes: resolution.map_or(0, |r| (r * r * 4) as u64),
        texels: resolution.map(|r| (r * r) as u64),
        texels_covered: resolution.map(|r| (r * r / 4) as u64),
        setup: serde_json::to_string(&setup).unwrap(),
        ..Record::default()
    }
}

fn rows(setup: &Setup) -> Vec<Record> {
    vec![
        row(setup, "shadow-map", Some(256), 0.02, 0.1),
        row(setup, "shadow-map", Some(512), 0.01, 0.3),
        row(setup, "pcf", Some(512), 0.008, 0.5),
        row(setup, "pcf", Some(2048), 0.002, 2.0),
        row(setup, "rt-hard", None, 0.0, 5.0),
    ]
}

/// The chart with rows in it, open.
fn charted() -> Harness<'static, State> {
    let mut harness = harness("cubes", 800.0);
    let rows = rows(&setup(&harness));
    harness.state_mut().model.adopt(rows);
    click(&mut harness, "Chart");
    harness.run_steps(4);
    harness
}

const POINT: &str = "pcf resolution 2048, mode grid, kernel 3";

#[test]
fn the_drawer_opens_under_the_picture_and_closes() {
    let mut harness = harness("cubes", 800.0);
    let whole = harness.state().picture;
    for tab in ["Chart", "Stability", "Advice"] {
        click(&mut harness, tab);
        harness.run_steps(2);
        let left = harness.state().picture;
        assert_eq!((left.min, left.width()), (whole.min, whole.width()), "{tab} moves the picture");
        let share = left.height() / whole.height();
        assert!(share > 0.5 && share < 0.6, "{tab} leaves {share} of the picture");
    }
    click(&mut harness, "Advice");
    assert_eq!(harness.state().picture, whole);
    harness.key_press(egui::Key::F2);
    harness.run_steps(2);
    assert_eq!(harness.state().model.drawer, Some(Tab::Chart));
}

#[test]
fn nothing_in_the_drawer_is_clipped() {
    use egui::accesskit::Role;
    // The room that is left of the panel, with the harness's margin; in the smallest window the drawer scrolls.
    for (size, bottom) in [([1280.0, 800.0], true), ([1182.0, 800.0], true), ([640.0, 384.0], false)] {
        let mut harness = harness("st-jitter", 800.0);
        harness.set_size(egui::vec2(size[0] + 16.0, size[1] + 16.0));
        let rows = rows(&setup(&harness));
        let found = advice(&rows, Some(3));
        harness.state_mut().model.advice.found = Some(found);
        harness.state_mut().model.adopt(rows);
        let right = 8.0 + size[0] - 340.0;
        for tab in ["Chart", "Stability", "Advice"] {
            click(&mut harness, tab);
            harness.run_steps(4);
            assert_eq!(harness.state().picture.width(), size[0] - 340.0);
            let mut seen = 0;
            for role in [Role::Button, Role::ComboBox, Role::Slider, Role::SpinButton, Role::TextInput] {
                for node in harness.get_all_by_role(role) {
                    let rect = node.rect();
                    let inside = rect.left() < right && rect.top() >= harness.state().picture.bottom();
                    if inside {
                        seen += 1;
                        let name = node.accesskit_node().label().unwrap_or_default();
                        assert!(rect.right() <= right, "{tab}: {name:?} reaches to {} of {right}", rect.right());
                        // The list of techniques scrolls.
                        let scrolls = techniques::find(&name).is_some();
                        let below = rect.bottom() > 8.0 + size[1];
                        assert!(!bottom || scrolls || !below, "{tab}: {name:?} is cut off below");
                    }
                }
            }
            assert!(seen > 2, "{tab} shows {seen} controls at {size:?}");
            if tab == "Chart" && bottom {
                let end = harness.get_by_label("cost axis").rect().right();
                let controls = harness.get_by_label("techniques").rect().left();
                assert!(end < controls, "the boxes of the axes reach to {end}, under what begins at {controls}");
            }
        }
    }
}

#[test]
fn a_click_on_a_point_applies_it_as_one_step() {
    let mut harness = charted();
    let before = setup(&harness);
    // Labels of the lines are painted; points are there by name.
    assert_eq!(harness.get_all_by_role(egui::accesskit::Role::Button).filter(is_point).count(), 5);
    click(&mut harness, POINT);
    let after = setup(&harness);
    assert_eq!(after.technique, "pcf");
    assert_eq!(after.values()["resolution"], Value::Int(2048));
    assert_eq!((after.camera, after.light), (before.camera, before.light));
    after.check().unwrap();
    click(&mut harness, "Undo");
    assert_eq!(setup(&harness), before, "a click is one step");
    assert!(!harness.state().model.history.can_undo());
    click(&mut harness, "Redo");
    assert_eq!(setup(&harness), after);
}

fn is_point(node: &Node) -> bool {
    let label = node.accesskit_node().label().unwrap_or_default();
    techniques::ALL.iter().any(|i| label.starts_with(&format!("{} ", i.id)))
}

#[test]
fn a_point_of_another_view_or_scene_brings_it_along() {
    let mut harness = harness("cubes", 800.0);
    let before = setup(&harness);
    let mut moved = before.clone();
    moved.camera.position.x += 2.0;
    let (other, _) = Setup::open("blocks").unwrap();
    let rows = [row(&moved, "pcf", Some(512), 0.01, 0.1), row(&other, "pcf", Some(1024), 0.001, 1.0)];
    harness.state_mut().model.adopt(rows);
    click(&mut harness, "Chart");
    click(&mut harness, "pcf resolution 512, mode grid, kernel 3");
    assert_eq!(setup(&harness).camera, moved.camera);
    click(&mut harness, "Undo");
    assert_eq!(setup(&harness), before, "the camera belongs to the step");
    harness.state_mut().actions.clear();
    click(&mut harness, "pcf resolution 1024, mode grid, kernel 3");
    let asked = &harness.state().actions;
    assert!(matches!(&asked[..], [Action::Restore(s)] if s.scene == "blocks" && s.technique == "pcf"), "{asked:?}");
    assert_eq!(setup(&harness), before, "until the scene is there");
}

#[test]
fn the_axes_can_be_changed() {
    let mut harness = charted();
    let place = |h: &Harness<'static, State>, label: &str| h.get_by_label(label).rect().center();
    let fast = "shadow-map resolution 256";
    assert!(place(&harness, fast).x < place(&harness, "rt-hard ").x, "the faster stands to the left");
    assert!(place(&harness, fast).y < place(&harness, POINT).y, "the more exact stands below");
    click(&mut harness, "cost axis");
    click(&mut harness, "GPU memory held, bytes");
    harness.run_steps(4);
    assert_eq!(chart::COSTS[harness.state().model.chart.cost].id, "gpu_bytes");
    assert!(place(&harness, fast).x > place(&harness, "rt-hard ").x, "rays hold no memory");
    click(&mut harness, "error axis");
    click(&mut harness, "flicker, mean change per frame beyond the truth's, %");
    harness.run_steps(4);
    assert_eq!(harness.get_all_by_role(egui::accesskit::Role::Button).filter(is_point).count(), 0, "none has flicker");
}

#[test]
fn a_sweep_is_asked_for_with_the_techniques_chosen() {
    let mut harness = charted();
    let light = setup(&harness).light;
    for other in techniques::ALL.iter().filter(|i| i.id != "shadow-map" && i.refuses(&light).is_none()) {
        click(&mut harness, other.id);
    }
    let axes = [measure::Axis::parse("resolution=256..8192*2").unwrap()];
    let expected = measure::expand(&setup(&harness), &["shadow-map".into()], &axes, false).unwrap();
    click(&mut harness, &format!("Sweep {} configurations", expected.len()));
    assert_eq!(harness.state().actions, [Action::Sweep(expected)]);
    harness.state_mut().model.measuring = Some(Job::new("Sweep"));
    harness.run_steps(2);
    click(&mut harness, "Cancel");
    assert_eq!(harness.state().actions.last(), Some(&Action::CancelMeasuring));
}

/// Under the stability chart stand what runs along the path and its unit, beside it what the tracks were made with.
#[test]
fn a_paths_chart_says_its_units_and_parameters() {
    let mut harness = harness("st-duel", 1100.0);
    click(&mut harness, "Stability");
    let mut base = setup(&harness);
    base.set("resolution=4096", &["shadow-map".into()]).unwrap();
    let track = |technique: &str| {
        let mut own = base.clone();
        own.select(technique).unwrap();
        let points = (0..3).map(|i| stability::Point {
            t: i as f32 / 2.0,
            error_share: 0.00557 * (1 + i % 2) as f64,
            ..Default::default()
        });
        stability::Track { technique: technique.into(), params: params_text(&own), points: points.collect() }
    };
    harness.state_mut().model.timeline.found = Some(stability::Stability {
        case: "st-duel".into(),
        width: 320,
        height: 180,
        tracks: vec![track("shadow-map"), track("pssm")],
        ..Default::default()
    });
    harness.run_steps(4);
    harness.get_by_label("With shadow-map resolution 4096 texels; the others with default parameters.");
    let painted: Vec<String> = texts(&harness).into_iter().map(|t| t.0).collect();
    for text in ["sun's azimuth from the view direction", "80°", "40°", "0.5 %", "1 %"] {
        assert!(painted.iter().any(|p| p == text), "{text} is not among {painted:?}");
    }
    harness.get_all_by_label("1.11 %").next().unwrap().hover();
    harness.run_steps(60);
    harness.get_by_label_contains("Counted in 320 × 180 pixels; the status bar counts the picture in the window");
}

/// How long a sweep will take is said where something is known of it.
#[test]
fn a_sweep_says_how_long_it_takes() {
    let mut harness = charted();
    let light = setup(&harness).light;
    for other in techniques::ALL.iter().filter(|i| i.id != "shadow-map" && i.refuses(&light).is_none()) {
        click(&mut harness, other.id);
    }
    assert!(harness.query_by_label_contains("by what frames take").is_none(), "nothing is known yet");
    let model = &mut harness.state_mut().model;
    (model.facts.software, model.facts.size, model.facts.full) = (true, model.setup.size, model.setup.size);
    model.facts.seconds.insert("shadow-map", 0.01);
    harness.run_steps(2);
    // Six resolutions, each for three seconds, and errors of a million pixels.
    assert_eq!(setup(&harness).size, [1280, 720]);
    harness.get_by_label("at least 35 s, by what frames take here");
    harness.state_mut().model.facts.seconds.insert("shadow-map", 2.0);
    harness.run_steps(2);
    harness.get_by_label("at least 3 min, by what frames take here");
    let model = &mut harness.state_mut().model;
    let job =
        Job { rows: 2, since: std::time::Instant::now() - std::time::Duration::from_secs(60), ..Job::new("Sweep") };
    model.chart.range.learn(&model.setup, &job);
    harness.run_steps(2);
    harness.get_by_label("about 3 min, as fast as the last sweep");
    harness.state_mut().model.setup.size = [64, 64];
    harness.run_steps(2);
    assert!(harness.query_by_label_contains("as the last sweep").is_none(), "that was of another size");
}

/// With a legend the file is higher than the picture, unless it is to have the size as a whole.
#[test]
fn the_captures_file_size_is_said() {
    let mut harness = harness("cubes", 2400.0);
    open(&mut harness, "Capture");
    harness.state_mut().model.setup.size = [1920, 1080];
    harness.run_steps(2);
    assert!(harness.query_by_label_contains("file 1920").is_none());
    harness.state_mut().model.setup.legend = true;
    harness.run_steps(2);
    let told = |h: &Harness<'static, State>, start: &str| {
        let text = h.get_by_label_contains(start).accesskit_node().value().unwrap_or_default();
        text.trim_start_matches(start).parse::<u32>().unwrap()
    };
    let file = told(&harness, "file 1920 × ");
    assert!(file > 1100 && file < 1160, "{file}");
    let png = std::path::Path::new("a.png");
    assert_eq!(harness.state().model.whole_file(png), None);
    harness.state_mut().model.whole = true;
    harness.run_steps(2);
    let picture = told(&harness, "picture 1920 × ");
    assert!((1080 - picture).abs_diff(file - 1080) <= 3, "{picture} in 1080, 1080 in {file}");
    assert_eq!(harness.state().model.whole_file(png), Some([1920, 1080]));
    assert_eq!(harness.state().model.whole_file(std::path::Path::new("a.exr")), None);
}

/// The graph of times ends inside the panel, however wide the rows above are, and each of its lines has a number.
#[test]
fn the_newest_time_is_in_sight() {
    let mut harness = harness("cubes", 2800.0);
    let now = setup(&harness);
    let most = 8192 * 8192;
    let used =
        Record { texels: Some(most), texels_covered: Some(most), ..row(&now, "shadow-map", Some(1024), 0.01, 1.0) };
    harness.state_mut().model.adopt([used]);
    harness.run_steps(3);
    let used = texts(&harness).into_iter().find(|t| t.0.starts_with("100") && t.0.ends_with("of 67 108 864")).unwrap();
    assert!(used.1.right() <= used.2.right(), "what is used reaches to {} of {}", used.1.right(), used.2.right());
    for times in
        [[230.0, 110.0, 120.0, 180.0, 207.0], [0.2, 0.21, 0.25, 0.3, 0.18], [148.0, 150.0, 168.0, 149.0, 160.0]]
    {
        harness.state_mut().model.facts.recent = times.into();
        harness.run_steps(4);
        let mut ends = Vec::new();
        for s in &harness.output().shapes {
            fn collect(clip: egui::Rect, shape: &egui::Shape, out: &mut Vec<(f32, f32)>) {
                match shape {
                    egui::Shape::Vec(all) => all.iter().for_each(|s| collect(clip, s, out)),
                    egui::Shape::Path(p) if p.points.len() == 5 && !p.closed => {
                        out.extend(p.points.last().map(|last| (last.x, clip.right())));
                    }
                    _ => {}
                }
            }
            collect(s.clip_rect, &s.shape, &mut ends);
        }
        assert!(!ends.is_empty() && ends.iter().all(|(x, right)| x <= right), "{ends:?}");
        let graph = harness.get_by_label_contains("GPU timestamps").rect().bottom();
        let rows = texts(&harness).into_iter().filter(|t| (graph..graph + 90.0).contains(&t.1.center().y));
        let numbers = rows.filter(|t| t.0.parse::<f64>().is_ok()).count();
        assert!(numbers >= 2, "{numbers} numbers beside the graph of {times:?}");
    }
}

#[test]
fn a_point_tells_what_it_is_and_asks_for_its_picture() {
    let mut harness = charted();
    let place = harness.get_by_label(POINT).rect().center();
    harness.hover_at(place);
    harness.run_steps(40);
    harness.get_by_label("0.200 %");
    // Parameters as the panel calls them, with their units.
    harness.get_by_label_contains("slope limit 10");
    harness.get_by_label_contains("bias 0.002 m, ");
    let row = harness.state().model.rows.iter().find(|r| r.params.contains("resolution=2048")).unwrap().setup.clone();
    assert!(harness.state().actions.contains(&Action::Thumbnail(Subject::Row(row))));
}

#[test]
fn measured_again_a_row_takes_the_place_of_the_older() {
    let mut harness = charted();
    let again = row(&setup(&harness), "pcf", Some(2048), 0.003, 1.0);
    harness.state_mut().model.adopt([again.clone()]);
    let rows = &harness.state().model.rows;
    assert_eq!((rows.len(), rows.last()), (5, Some(&again)));
}

#[test]
fn what_is_used_stands_beside_the_technique_once_measured() {
    let mut harness = harness("cubes", 2400.0);
    let now = setup(&harness);
    let place = |h: &Harness<'static, State>| h.get_by_label("Timings").rect().top();
    let (before, value) = (place(&harness), "25.0 % of 1 048 576");
    harness.get_by_label("texels used");
    assert!(harness.query_by_label(value).is_none());
    let measured = row(&now, "shadow-map", Some(1024), 0.01, 1.0);
    harness.state_mut().model.adopt([measured]);
    harness.run_steps(3);
    harness.get_by_label(value);
    assert_eq!(place(&harness), before, "nothing moves when it becomes known");
    harness.state_mut().model.setup.camera.position.x += 1.0;
    harness.run_steps(3);
    assert!(harness.query_by_label(value).is_none(), "measured from elsewhere");
}

#[test]
fn the_timeline_places_the_setup_and_leaves_no_steps() {
    // Its sun moves, which would be a step; a camera that moves never is.
    let mut harness = harness("st-grazing", 800.0);
    let case = cases::find("st-grazing").unwrap();
    click(&mut harness, "Stability");
    let before = setup(&harness);
    let placed = |h: &Harness<'static, State>| {
        let mut expected = before.clone();
        (case.place)(&mut expected, h.state().model.timeline.t);
        expected
    };
    let slider = harness.get_by_role_and_label(egui::accesskit::Role::Slider, "t").rect();
    for x in [0.3, 0.7] {
        harness.drag_at(slider.left_center() + egui::vec2(slider.width() * x, 0.0));
        harness.run_steps(2);
        harness.drop_at(slider.left_center() + egui::vec2(slider.width() * x, 0.0));
        harness.run_steps(3);
        let t = harness.state().model.timeline.t;
        assert!((t - x).abs() < 0.1, "{t} for {x}");
        assert_eq!(setup(&harness), placed(&harness));
        assert_ne!(setup(&harness), before);
    }
    // In the chart, under the slider.
    let at = egui::pos2(slider.left(), slider.bottom() + 80.0);
    harness.hover_at(at);
    harness.drag_at(at);
    harness.run_steps(1);
    harness.drop_at(at);
    harness.run_steps(3);
    let t = harness.state().model.timeline.t;
    assert!(t > 0.05 && t < 0.6, "{t}");
    assert_eq!(setup(&harness), placed(&harness));
    harness.state_mut().model.timeline.playing = true;
    harness.state_mut().model.advance(0.5);
    assert!(harness.state().model.timeline.t > t);
    assert_eq!(setup(&harness), placed(&harness));
    assert!(!harness.state().model.history.can_undo());
    click(&mut harness, "Run");
    let all = harness.state().model.techniques();
    let run = stability::Run { techniques: all, frames: case.frames, cost: false };
    assert_eq!(harness.state().actions, [Action::Stability(Some("st-grazing"), run)]);
}

/// What the popup of the stability tab shows of each case: the place of its cell.
fn cells(harness: &Harness<'static, State>) -> Vec<egui::Rect> {
    let name = |c: &&cases::Case| format!("{} ({})", c.title, c.id);
    cases::CASES.iter().map(|c| harness.get_by_label(&name(&c)).rect()).collect()
}

fn open_cases(harness: &mut Harness<'static, State>) {
    harness.state_mut().model.drawer = Some(Tab::Stability);
    harness.run_steps(4);
    harness.get_by_role_and_label(egui::accesskit::Role::ComboBox, "case").click();
    harness.run_steps(4);
}

/// Answers what was asked for last, as the window does; whether something was.
fn draw_picture(harness: &mut Harness<'static, State>) -> bool {
    let Some(Action::Thumbnail(subject)) = harness.state_mut().actions.pop() else { return false };
    let texture = harness.ctx.load_texture("small", egui::ColorImage::example(), egui::TextureOptions::LINEAR);
    // One fails: its frame stays empty, and it is not asked for again.
    let drawn = match subject == Subject::Scene("st-duel") {
        true => Picture::Failed("no device".into()),
        false => Picture::Drawn(texture),
    };
    harness.state_mut().model.pictures.take(subject, drawn);
    harness.run_steps(2);
    true
}

/// Pictures are asked for one after the other and once each; nothing moves when they come.
#[test]
fn cases_keep_their_places_when_their_pictures_come() {
    let mut harness = harness("cubes", 800.0);
    open_cases(&mut harness);
    let before = cells(&harness);
    let mut asked = Vec::new();
    while let [Action::Thumbnail(subject)] = &harness.state().actions[..] {
        asked.push(subject.clone());
        assert!(draw_picture(&mut harness));
    }
    let all: Vec<Subject> = cases::CASES.iter().map(|c| Subject::Scene(c.id)).collect();
    assert_eq!(asked, all);
    assert_eq!(cells(&harness), before);
    assert_eq!(harness.state().actions, []);
}

#[test]
fn no_small_picture_is_asked_for_while_measuring() {
    let mut harness = harness("cubes", 800.0);
    harness.state_mut().model.measuring = Some(Job::new("Sweep"));
    open_cases(&mut harness);
    assert_eq!(harness.state().actions, []);
    harness.state_mut().model.measuring = None;
    harness.run_steps(2);
    assert_eq!(harness.state().actions, [Action::Thumbnail(Subject::Scene(cases::CASES[0].id))]);
}

/// In both themes; a smaller window scrolls.
#[test]
fn the_popup_of_cases_clips_nothing() {
    for (size, theme) in [
        ([1280.0, 800.0], egui::Theme::Dark),
        ([1280.0, 800.0], egui::Theme::Light),
        ([640.0, 384.0], egui::Theme::Dark),
    ] {
        let mut harness = harness("st-jitter", 800.0);
        harness.set_size(egui::vec2(size[0] + 16.0, size[1] + 16.0));
        harness.ctx.set_theme(theme);
        open_cases(&mut harness);
        while draw_picture(&mut harness) {}
        let window = egui::Rect::from_min_size(egui::Pos2::ZERO, harness.ctx.content_rect().size());
        let cells = cells(&harness);
        let whole = size[1] > 500.0;
        assert!(cells.iter().all(|c| c.left() >= window.left() && c.right() <= window.right()), "{cells:?}");
        assert!(!whole || cells.iter().all(|c| window.contains_rect(*c)), "{cells:?} in {window:?}");
        let combo = harness.get_by_role_and_label(egui::accesskit::Role::ComboBox, "case").rect();
        assert!(!whole || cells.iter().all(|c| !c.intersects(combo)), "the popup covers what it opens at");
        let panel = harness.ctx.global_style().visuals.panel_fill;
        let mut seen = 0;
        for (text, rect, clip, elided, color) in texts(&harness) {
            let Some(case) = cases::CASES.iter().find(|c| [c.title, c.id].contains(&text.as_str())) else {
                continue;
            };
            let Some(cell) = cells.iter().find(|c| c.contains_rect(rect)) else { continue };
            seen += 1;
            assert!(!elided && (!whole || clip.contains_rect(*cell)), "{text:?} is cut off");
            let own = case.id == "st-jitter";
            assert!(own || contrast(color, panel) > 3.0, "{theme:?}: {text:?}");
        }
        assert!(seen == 2 * cells.len() || !whole && seen > 4, "{seen} texts");
    }
}

/// The arrow keys go through the cases in two directions, Enter chooses one.
#[test]
fn cases_are_chosen_by_keys() {
    let mut harness = harness("cubes", 800.0);
    open_cases(&mut harness);
    harness.state_mut().actions.clear();
    let press = |h: &mut Harness<'static, State>, key| {
        h.key_press(key);
        h.run_steps(4);
    };
    let focused = |h: &Harness<'static, State>| {
        let name = |c: &&cases::Case| format!("{} ({})", c.title, c.id);
        cases::CASES.iter().position(|c| h.get_by_label(&name(&c)).is_focused())
    };
    harness.get_by_role_and_label(egui::accesskit::Role::ComboBox, "case").focus();
    harness.run_steps(2);
    let keys = [
        (egui::Key::ArrowDown, 0),
        (egui::Key::ArrowRight, 1),
        (egui::Key::ArrowDown, 7),
        (egui::Key::ArrowLeft, 6),
        (egui::Key::ArrowUp, 0),
        (egui::Key::ArrowUp, 0),
        (egui::Key::ArrowRight, 1),
    ];
    for (key, expected) in keys {
        press(&mut harness, key);
        assert_eq!(focused(&harness), Some(expected), "after {key:?}");
    }
    press(&mut harness, egui::Key::Enter);
    assert_eq!(harness.state().actions, [Action::Open(cases::CASES[1].id.into())]);
    assert_eq!(harness.state().model.timeline.case.map(|c| c.id), Some(cases::CASES[1].id));
}

/// A scene under the pointer in the panel's list shows its picture.
#[test]
fn scenes_show_their_pictures_in_tooltips() {
    let mut harness = harness("cubes", 800.0);
    harness.get_by_role_and_label(egui::accesskit::Role::ComboBox, "Scene").click();
    harness.run_steps(4);
    assert_eq!(harness.state().actions, [], "none is looked for yet");
    for (label, name) in [("hall", "hall"), ("Duel: sun and camera face to face (st-duel)", "st-duel")] {
        harness.get_by_label(label).hover();
        harness.run_steps(60);
        assert_eq!(harness.state().actions, [Action::Thumbnail(Subject::Scene(name))]);
        assert!(draw_picture(&mut harness));
    }
}

fn advice(tried: &[Record], answer: Option<usize>) -> (Budget, Advice) {
    let budget = Budget { by: &FIGURES[0], max_error: 0.005, max_ratio: None };
    let closest = if answer.is_none() { Some(2) } else { None };
    let frontier = (0..tried.len()).collect();
    (budget, Advice { answer, closest, frontier, tried: tried.to_vec(), space: 19, limit: 6, ..Advice::default() })
}

#[test]
fn advice_is_asked_for_and_applied() {
    let mut harness = harness("cubes", 800.0);
    click(&mut harness, "Advice");
    click(&mut harness, "Find the cheapest");
    let all = harness.state().model.techniques();
    // Among them pcf, which filters.
    let budget = Budget { by: Figure::find("rmse").unwrap(), max_error: 0.05, max_ratio: None };
    assert_eq!(harness.state().actions, [Action::Advise(budget, all.clone())]);
    harness.state_mut().actions.clear();
    click(&mut harness, "error asked for");
    click(&mut harness, "wrong pixels");
    click(&mut harness, "Find the cheapest");
    let budget = Budget { by: &FIGURES[0], max_error: 0.005, max_ratio: None };
    assert_eq!(harness.state().actions, [Action::Advise(budget, all)]);
    let before = setup(&harness);
    let rows = rows(&before);
    harness.state_mut().model.advice.found = Some(advice(&rows, Some(3)));
    harness.run_steps(3);
    harness.get_by_label("Measured 5 of 19 configurations.");
    let (budget, told) = harness.state_mut().model.advice.found.as_mut().unwrap();
    budget.by = Figure::find("rmse").unwrap();
    told.base = Some("resolution=1024".into());
    for (row, base) in told.tried.iter_mut().zip([0.2, 0.2, 0.2, 0.4, 0.4]) {
        row.cost = Some(row.gpu_ms / base);
    }
    harness.run_steps(2);
    harness.get_by_label_contains("RMSE 0, 5 × the set-up's plain map (2.000 ms against 0.400 ms)");
    harness.get_by_label_contains("the set-up's own plain map (resolution 1024); it took 0.2 to 0.4 ms in turn");
    click(&mut harness, "To the chart");
    let chart = &harness.state().model.chart;
    assert_eq!((chart::ERRORS[chart.error].id, chart::COSTS[chart.cost].id), ("rmse", "cost"));
    harness.state_mut().model.clear_rows();
    harness.state_mut().model.advice.found = Some(advice(&rows, Some(3)));
    click(&mut harness, "Advice");
    harness.get_by_label("Margin: 60 % of the error allowed is to spare.");
    harness.state_mut().model.advice.found.as_mut().unwrap().1.alike = vec![1];
    harness.run_steps(2);
    harness.get_by_label_contains("As fast, within the spread of the times: shadow-map");
    click(&mut harness, "Apply");
    assert_eq!(
        (setup(&harness).technique.as_str(), &setup(&harness).values()["resolution"]),
        ("pcf", &Value::Int(2048))
    );
    click(&mut harness, "Undo");
    assert_eq!(setup(&harness), before);
    click(&mut harness, "Apply shadow-map resolution 512");
    assert_eq!(setup(&harness).values()["resolution"], Value::Int(512));
    harness.state_mut().model.advice.found = Some(advice(&rows, None));
    harness.run_steps(3);
    harness.get_by_label("The closest miss");
    click(&mut harness, "To the chart");
    assert_eq!(harness.state().model.rows, rows);
    assert_eq!(harness.state().model.drawer, Some(Tab::Chart));
}

#[test]
fn values_are_read_under_the_pointer_where_the_view_has_them() {
    let mut harness = harness("cubes", 800.0);
    let picture = harness.state().picture;
    let read = |h: &Harness<'static, State>| h.state().actions.contains(&Action::Read([0.25, 0.5]));
    harness.hover_at(picture.min + picture.size() * egui::vec2(0.25, 0.5));
    harness.run_steps(2);
    assert!(!read(&harness), "a shaded picture has no values");
    harness.state_mut().model.setup.view = "error".into();
    harness.run_steps(2);
    assert!(!read(&harness), "the truth is not there yet");
    harness.state_mut().model.facts.traced = Traced::Fully;
    harness.run_steps(2);
    assert!(read(&harness));
    harness.state_mut().actions.clear();
    harness.state_mut().model.reading = Some(Reading { at: [0.25, 0.5], text: Some("visibility 1, truth 0".into()) });
    harness.run_steps(2);
    assert!(!read(&harness), "once is enough while the picture rests");
}

#[test]
fn the_live_point_leaves_a_trail_that_ends() {
    let mut harness = charted();
    let base = setup(&harness);
    let trail = |h: &Harness<'static, State>| h.state().model.chart.trail.len();
    for (error, expected) in [(0.02, 1), (0.02, 1), (0.01, 2)] {
        harness.state_mut().model.chart.live(row(&base, "shadow-map", Some(1024), error, 1.0));
        harness.run_steps(2);
        assert_eq!(trail(&harness), expected, "only what moves leaves a trail");
    }
    for i in 0..100 {
        harness.state_mut().model.chart.live(row(&base, "pcf", Some(1024), 0.01 + i as f64 * 1e-4, 1.0));
    }
    harness.run_steps(2);
    assert!(trail(&harness) < 100);
    let (other, scene) = Setup::open("blocks").unwrap();
    let bounds = harness.state().model.bounds;
    harness.state_mut().model.open(other, Arc::new(scene), bounds, false);
    assert_eq!(trail(&harness), 0, "another scene, another matter");
}

/// A scene 141 km from the zero point of its coordinates: the fields show and take those, the camera turns in its own.
#[test]
fn places_are_shown_in_the_files_coordinates() {
    let mut harness = harness("tests/data/origin-100km.glb", 2400.0);
    for section in ["Light", "Camera"] {
        open(&mut harness, section);
    }
    let m = &mut harness.state_mut().model;
    m.setup.camera = setup::parse_camera(&m.scene, "100002,4,100004.25:100000,0,100000:50", Clock::default()).unwrap();
    harness.run_steps(3);
    for shown in [100002.0, 4.0, 100004.25, 100000.0] {
        let fields = harness.get_all_by_role(egui::accesskit::Role::SpinButton).filter_map(|n| n.value());
        let mut numbers = fields.filter_map(|text| text.trim_end_matches(" m").parse::<f64>().ok());
        assert!(numbers.any(|x| (x - shown).abs() < 0.06), "no field shows {shown}");
    }
    let before = setup(&harness).camera;
    harness.state_mut().model.setup.camera.orbit(0.3, 0.1);
    harness.run_steps(3);
    let after = setup(&harness).camera;
    assert_eq!(after.target, before.target);
    assert!((after.reach() - before.reach()).abs() < 1e-4 && after.position.distance(before.position) > 1.0);
    assert!(after.position.length() < 10.0, "{after:?}");
}

/// A camera and a light on animated nodes go along while the clock runs and say so; what is taken in hand stays, and an undone
/// step gives it back to the animation, where that stands now.
#[test]
fn what_is_animated_is_followed_until_it_is_taken_in_hand() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("turntable.glb");
    std::fs::write(&path, turntable().glb()).unwrap();
    let mut harness = harness(&path.to_string_lossy(), 2400.0);
    let shows = |harness: &Harness<'static, State>, what: &str| texts(harness).iter().any(|t| t.0 == what);
    let named = |harness: &Harness<'static, State>| {
        let (m, clock) = (&harness.state().model, setup(harness).clock());
        (setup::parse_camera(&m.scene, "rider", clock).unwrap(), setup::parse_light(&m.scene, "beam", clock).unwrap())
    };
    let play = |harness: &mut Harness<'static, State>, seconds: f32| {
        let m = &mut harness.state_mut().model;
        m.playing = true;
        m.advance(seconds);
        m.playing = false;
        harness.run_steps(3);
    };
    assert!(shows(&harness, "rider (animated)") && shows(&harness, "beam (animated)"));
    let start = setup(&harness).camera;
    for _ in 0..3 {
        play(&mut harness, 0.2);
        assert_eq!((setup(&harness).camera, setup(&harness).light), named(&harness));
    }
    assert!(setup(&harness).camera.position.distance(start.position) > 3.0);
    assert!(shows(&harness, "rider (animated)") && shows(&harness, "beam (animated)"));
    assert!(!harness.state().model.history.can_undo(), "time passes without steps");
    // Back to the start of the camera, not to where it stood then.
    harness.state_mut().model.setup.camera.orbit(0.3, 0.1);
    harness.state_mut().model.go_home();
    assert_eq!(setup(&harness).camera, named(&harness).0);

    harness.state_mut().model.setup.camera.orbit(0.3, 0.1);
    let own = setup(&harness).camera;
    play(&mut harness, 0.2);
    assert_eq!((setup(&harness).camera, setup(&harness).light), (own, named(&harness).1));
    assert!(shows(&harness, "free") && shows(&harness, "beam (animated)"));
    harness.state_mut().model.undo();
    harness.run_steps(3);
    assert_eq!(setup(&harness).camera, named(&harness).0, "at {}", setup(&harness).time);
    harness.state_mut().model.redo();
    assert_eq!(setup(&harness).camera, own);
    choose(&mut harness, "Camera", "rider (animated)");
    play(&mut harness, 0.1);
    assert_eq!(setup(&harness).camera, named(&harness).0);
}

/// Every text that is painted: where, in what clip rectangle, whether it was shortened, and its colour.
fn texts(harness: &Harness<'static, State>) -> Vec<(String, egui::Rect, egui::Rect, bool, egui::Color32)> {
    fn collect(
        clip: egui::Rect,
        shape: &egui::Shape,
        out: &mut Vec<(String, egui::Rect, egui::Rect, bool, egui::Color32)>,
    ) {
        match shape {
            egui::Shape::Vec(all) => all.iter().for_each(|s| collect(clip, s, out)),
            egui::Shape::Text(t) => {
                let own = t.galley.job.sections.first().map_or(egui::Color32::PLACEHOLDER, |s| s.format.color);
                let own = if own == egui::Color32::PLACEHOLDER { t.fallback_color } else { own };
                let color = t.override_text_color.unwrap_or(own);
                let rect = t.galley.rect.translate(t.pos.to_vec2());
                out.push((t.galley.text().to_string(), rect, clip, t.galley.elided, color));
            }
            _ => {}
        }
    }
    let mut out = Vec::new();
    harness.output().shapes.iter().for_each(|s| collect(s.clip_rect, &s.shape, &mut out));
    out
}

/// WCAG's contrast of two opaque colours, 1 to 21.
fn contrast(a: egui::Color32, b: egui::Color32) -> f32 {
    let luminance = |c: egui::Color32| {
        let [r, g, b, _] = egui::Rgba::from(c).to_array();
        0.2126 * r + 0.7152 * g + 0.0722 * b
    };
    let [a, b] = [luminance(a), luminance(b)];
    (a.max(b) + 0.05) / (a.min(b) + 0.05)
}

/// For every technique, in both themes: no text of the panel is shortened or cut off sideways, all can be read, and names,
/// sliders and values stand in columns. At 1280 × 800 what is in sight, at 1280 × 2600 all of it, sections that fold too.
#[test]
fn the_panel_clips_nothing_and_keeps_its_columns() {
    use egui::accesskit::Role;
    let ends = |nodes: Vec<egui::Rect>, what: &str| {
        let lefts: std::collections::BTreeSet<i32> = nodes.iter().map(|r| r.left().round() as i32).collect();
        let rights: std::collections::BTreeSet<i32> = nodes.iter().map(|r| r.right().round() as i32).collect();
        assert!(lefts.len() <= 1 && rights.len() <= 1, "{what}: left {lefts:?}, right {rights:?}");
    };
    // Choices beside the rows that they leave: many techniques share them.
    let mut looked_at = std::collections::BTreeSet::new();
    for (height, theme) in [(800.0, egui::Theme::Dark), (2600.0, egui::Theme::Dark), (2600.0, egui::Theme::Light)] {
        let mut harness = harness("cubes", height);
        harness.ctx.set_theme(theme);
        if height < 1000.0 {
            // What stands above the parameters is folded away, so that they are in sight.
            for title in ["Technique", "View"] {
                open(&mut harness, title);
            }
        }
        let mut opened = height < 1000.0;
        for info in techniques::ALL.iter() {
            // Every parameter that some value of another shows.
            let choices: Vec<Option<(&str, &str)>> = info
                .specs()
                .filter_map(|s| match s.kind {
                    Kind::Choice { options, .. } => {
                        Some(options.iter().map(|o| Some((s.name, *o))).collect::<Vec<_>>())
                    }
                    _ => None,
                })
                .flatten()
                .chain([None])
                .collect();
            // In another theme nothing moves.
            let all = height > 1000.0 && theme == egui::Theme::Dark;
            for choice in choices.into_iter().filter(|c| all || c.is_none()) {
                let m = &mut harness.state_mut().model;
                m.setup.params.clear();
                m.select(info);
                let values = m.setup.params.get_mut(info.id).unwrap();
                *values = info.specs().map(|s| (s.name.to_string(), s.default())).collect();
                for s in info.specs() {
                    match s.kind {
                        Kind::Flag { .. } => _ = values.insert(s.name.into(), Value::Bool(true)),
                        // The longest numbers.
                        Kind::Float { max, .. } if height > 1000.0 => {
                            _ = values.insert(s.name.into(), Value::Float(max / 1.3))
                        }
                        Kind::Int { max, .. } if height > 1000.0 => _ = values.insert(s.name.into(), Value::Int(max)),
                        _ => {}
                    }
                }
                if let Some((name, option)) = choice {
                    values.insert(name.into(), Value::Text(option.into()));
                    let shown = info.specs().filter(|s| info.applies(s, values)).map(|s| s.name).collect::<Vec<_>>();
                    if !looked_at.insert((name, option, shown)) {
                        continue;
                    }
                }
                harness.run_steps(3);
                if !opened {
                    click(&mut harness, "Rasteriser bias");
                    harness.run_steps(20);
                    opened = true;
                }
                let left = harness.state().picture.right();
                let panel = harness.ctx.global_style().visuals.panel_fill;
                let mut seen = 0;
                for (text, rect, clip, elided, color) in texts(&harness) {
                    if rect.left() < left || text.trim().is_empty() {
                        continue;
                    }
                    seen += 1;
                    let at = format!("{} {choice:?}: {text:?} at {rect:?} in {clip:?}", info.id);
                    assert!(!elided, "shortened: {at}");
                    assert!(rect.left() >= clip.left() - 0.5 && rect.right() <= clip.right() + 0.5, "cut off: {at}");
                    let off = ["Undo", "Redo", "Reset", "Clear"].contains(&text.as_str());
                    assert!(off || contrast(color, panel) > 3.0, "{theme:?}, {:.1}: {at}", contrast(color, panel));
                }
                assert!(seen > 20, "{} texts", seen);
                let rects =
                    |role| harness.query_all_by_role(role).map(|n| n.rect()).filter(|r| r.left() >= left).collect();
                ends(rects(Role::SpinButton), &format!("{}: values", info.id));
                ends(rects(Role::Slider), &format!("{}: sliders", info.id));
                let mut names = Vec::new();
                for spec in info.specs().filter(|s| info.applies(s, setup(&harness).values())) {
                    let name = spec.name.replace('_', " ");
                    names.extend(
                        harness
                            .query_all_by_role_and_label(Role::Label, &name)
                            .map(|n| n.rect())
                            .filter(|r| r.left() >= left),
                    );
                    assert!(height < 1000.0 || !names.is_empty(), "{}: {name} is missing", info.id);
                }
                let lefts: std::collections::BTreeSet<i32> = names.iter().map(|r| r.left().round() as i32).collect();
                assert_eq!(lefts.len(), 1, "{}: names at {lefts:?}", info.id);
            }
        }
    }
}

/// The pointer on a pass asks what that wrote, once for a picture, and shows it.
#[test]
fn a_pass_under_the_pointer_asks_for_what_it_wrote() {
    let mut harness = harness("cubes", 2400.0);
    harness.state_mut().model.facts.passes = vec![("fit: narrow", 0.1), ("shadow map", 1.5)];
    harness.run_steps(3);
    harness.get_by_label("shadow map").scroll_to_me();
    harness.run_steps(8);
    harness.get_by_label("shadow map").hover();
    harness.run_steps(60);
    let asked = |s: &State| s.actions.iter().filter(|a| matches!(a, Action::Shot(0, "shadow map"))).count();
    assert_eq!(asked(harness.state()), 1);
    let shot = harness.state_mut().model.shot.as_mut().unwrap();
    shot.picture = ui::Picture::Failed("It wrote lists.".into());
    harness.run_steps(3);
    harness.get_by_label("It wrote lists.");
    assert_eq!(asked(harness.state()), 1);
}

#[test]
fn a_parameter_shows_only_where_it_means_something() {
    let mut harness = harness("cubes", 2600.0);
    click(&mut harness, "Percentage-closer filtering");
    assert!(
        harness.query_by_role_and_label(egui::accesskit::Role::Slider, "kernel").is_some()
            && harness.query_by_role_and_label(egui::accesskit::Role::Slider, "samples").is_none()
    );
    harness.state_mut().model.setup.set("mode=disk", &["pcf".into()]).unwrap();
    harness.run_steps(2);
    assert!(
        harness.query_by_role_and_label(egui::accesskit::Role::Slider, "kernel").is_none()
            && harness.query_by_role_and_label(egui::accesskit::Role::Slider, "samples").is_some()
    );
    // Splits that fewer cascades have not, and the two ends of λ.
    click(&mut harness, "Parallel-split (cascaded) shadow maps");
    assert!(
        harness.query_by_role_and_label(egui::accesskit::Role::Slider, "resolution 4").is_some()
            && harness.query_by_role_and_label(egui::accesskit::Role::Slider, "resolution 5").is_none()
    );
    assert!(texts(&harness).iter().any(|t| t.0 == "uniform") && texts(&harness).iter().any(|t| t.0 == "logarithmic"));
}

#[test]
fn a_pinned_parameter_stands_on_top_and_folded_sections_stay_so() {
    let mut harness = harness("cubes", 2600.0);
    let top = |h: &Harness<'static, State>, name: &str| {
        h.get_by_role_and_label(egui::accesskit::Role::Slider, name).rect().top()
    };
    assert!(top(&harness, "slope bias") > top(&harness, "resolution"));
    harness.state_mut().model.pinned.insert("slope_bias");
    harness.run_steps(3);
    assert!(top(&harness, "slope bias") < top(&harness, "resolution"));
    click(&mut harness, "Map");
    harness.run_steps(20);
    assert!(harness.query_by_role_and_label(egui::accesskit::Role::Slider, "resolution").is_none());
    click(&mut harness, "Percentage-closer filtering");
    assert!(
        harness.query_by_role_and_label(egui::accesskit::Role::Slider, "resolution").is_none()
            && harness.query_by_role_and_label(egui::accesskit::Role::Slider, "slope bias").is_some()
    );
}

#[test]
fn a_number_out_of_range_says_what_became_of_it() {
    use egui::accesskit::Role;
    let mut harness = harness("cubes", 2600.0);
    let field = |h: &Harness<'static, State>| {
        let all = h.get_all_by_role_and_label(Role::SpinButton, "slope bias");
        all.map(|n: Node| n.rect().center()).next().unwrap()
    };
    let mut enter = |text: &str| {
        harness.hover_at(field(&harness));
        harness.run_steps(1);
        harness.drag_at(field(&harness));
        harness.drop_at(field(&harness));
        harness.run_steps(3);
        harness.event(egui::Event::Text(text.into()));
        harness.run_steps(2);
        harness.key_press(egui::Key::Enter);
        harness.run_steps(3);
        let m = &harness.state().model;
        (m.setup.values()["slope_bias"].clone(), m.notes.last().map_or(String::new(), |n| n.text.clone()))
    };
    assert_eq!(enter("1.234567"), (Value::Float(1.234567), String::new()));
    // Left as it stands, the shortened text changes nothing.
    assert_eq!(enter(""), (Value::Float(1.234567), String::new()));
    assert_eq!(enter("100"), (Value::Float(8.0), "slope bias takes 0 to 8 × texel: 100 became 8.".into()));
}

#[test]
fn the_focus_moves_by_tab_and_arrows_turn_what_has_it() {
    use egui::accesskit::Role;
    let mut harness = harness("cubes", 2600.0);
    let before = setup(&harness);
    let bias = |h: &Harness<'static, State>| {
        let all = h.get_all_by_role_and_label(Role::Slider, "bias");
        all.map(|n: Node| n.accesskit_node().is_focused()).next().unwrap()
    };
    for _ in 0..200 {
        if bias(&harness) {
            break;
        }
        harness.key_press(egui::Key::Tab);
        harness.run_steps(2);
    }
    assert!(bias(&harness), "the slider is never in focus");
    assert!(harness.state().model.show_panel, "Tab no longer hides the panel");
    for _ in 0..3 {
        harness.key_press(egui::Key::ArrowRight);
        harness.run_steps(2);
    }
    let Value::Float(more) = setup(&harness).values()["bias"] else { panic!() };
    assert!(more > 0.002, "{more}");
    // Other keys go on working.
    harness.key_press(egui::Key::Num4);
    harness.run_steps(2);
    assert_eq!(setup(&harness).view, "error");
    for _ in 0..4 {
        harness.key_press_modifiers(egui::Modifiers::COMMAND, egui::Key::Z);
        harness.run_steps(2);
    }
    assert_eq!(setup(&harness), before);
}

#[test]
fn a_hidden_panel_comes_back() {
    let mut harness = harness("cubes", 800.0);
    harness.key_press(egui::Key::F9);
    harness.run_steps(3);
    assert_eq!(harness.state().picture.width(), 1280.0);
    click(&mut harness, "Show the panel");
    assert_eq!(harness.state().picture.width(), 940.0);
    // The edge can be dragged.
    let edge = egui::pos2(harness.state().picture.right() + 2.0, 400.0);
    harness.hover_at(edge);
    harness.run_steps(2);
    harness.drag_at(edge);
    harness.run_steps(2);
    harness.hover_at(edge - egui::vec2(100.0, 0.0));
    harness.run_steps(2);
    harness.drop_at(edge - egui::vec2(100.0, 0.0));
    harness.run_steps(4);
    let width = harness.state().picture.width();
    assert!((820.0..=860.0).contains(&width), "{width}");
}

#[test]
fn a_small_window_hides_the_panel_and_holds_everything() {
    for size in [[300.0, 200.0], [420.0, 260.0], [559.0, 300.0]] {
        let mut harness = harness("st-jitter", 800.0);
        harness.set_size(egui::vec2(size[0] + 16.0, size[1] + 16.0));
        harness.run_steps(4);
        assert_eq!(harness.state().picture.width(), size[0], "the picture has all the width");
        assert!(harness.state().picture.height() >= size[1] - 60.0);
        click(&mut harness, "Show the panel");
        assert!(harness.state().picture.width() <= size[0] - 200.0);
        for step in 0..9 {
            let m = &mut harness.state_mut().model;
            match step {
                0 => m.show_help = true,
                1 => (m.show_help, m.closing) = (false, true),
                2 => m.closing = false,
                3 => m.drawer = Some(Tab::Chart),
                4 => m.drawer = Some(Tab::Stability),
                5 => m.drawer = Some(Tab::Advice),
                7 => m.drawer = Some(Tab::Pixel),
                6 => m.framed = true,
                _ => m.fail(&anyhow::anyhow!(
                    "a long message that must find its place in a window that is hardly larger"
                )),
            }
            harness.run_steps(3);
        }
        harness.key_press(egui::Key::F9);
        harness.run_steps(3);
        assert!(!harness.state().model.panel_shows());
    }
}

#[test]
fn the_frame_gives_the_picture_the_captures_shape() {
    let mut harness = harness("cubes", 800.0);
    harness.state_mut().model.framed = true;
    harness.run_steps(3);
    let picture = harness.state().picture;
    assert!((picture.aspect_ratio() - 1280.0 / 720.0).abs() < 1e-3 && picture.width() == 940.0, "{picture:?}");
}

/// All parameters of a group, or of the technique, go back at once, in one step.
#[test]
fn a_group_of_parameters_resets_in_one_step() {
    let mut harness = harness("cubes", 2400.0);
    let there = |h: &Harness<'static, State>, name: &str| h.query_by_label(&format!("reset {name}")).is_some();
    assert!(!there(&harness, "all parameters"));
    let default = setup(&harness);
    let set = |h: &mut Harness<'static, State>, sets: &[&str]| {
        let id = default.technique.clone();
        sets.iter().for_each(|set| h.state_mut().model.setup.set(set, std::slice::from_ref(&id)).unwrap());
        h.run_steps(4);
    };
    let info = techniques::find(&default.technique).unwrap();
    let section = |name: &str| info.specs().find(|s| s.name == name).unwrap().section;
    assert_ne!(section("bias"), section("resolution"));
    set(&mut harness, &["bias=0.05", "slope_bias=2", "resolution=512"]);
    let turned = setup(&harness);
    click(&mut harness, &format!("reset {}", section("bias")));
    let now = setup(&harness);
    assert_eq!(
        (&now.values()["bias"], &now.values()["slope_bias"]),
        (&default.values()["bias"], &default.values()["slope_bias"])
    );
    assert_eq!(now.values()["resolution"], Value::Int(512), "the other group stays");
    assert!(!there(&harness, section("bias")) && there(&harness, section("resolution")));
    click(&mut harness, "Undo");
    assert_eq!(setup(&harness), turned, "it was one step");
    click(&mut harness, "reset all parameters");
    assert_eq!(setup(&harness), default);
    click(&mut harness, "Undo");
    assert_eq!(setup(&harness), turned);
}

/// The command and the set-up go to the clipboard as they are.
#[test]
fn the_command_goes_to_the_clipboard() {
    let mut harness = harness("cubes", 1600.0);
    open(&mut harness, "Capture");
    let copied = |h: &Harness<'static, State>| {
        h.output().platform_output.commands.iter().find_map(|c| match c {
            egui::OutputCommand::CopyText(text) => Some(text.clone()),
            _ => None,
        })
    };
    for (button, says) in
        [("Copy command", "shadowscope capture cubes -o picture.png"), ("Copy TOML", "scene = \"cubes\"")]
    {
        harness.get_by_label(button).scroll_to_me();
        harness.run_steps(8);
        harness.get_by_label(button).click();
        let mut found = None;
        for _ in 0..4 {
            harness.step();
            found = found.or(copied(&harness));
        }
        assert!(found.as_ref().is_some_and(|text| text.starts_with(says)), "{button}: {found:?}");
    }
}

/// A turntable is asked for with the frames that are set; a case has its path, and what cannot be written is said.
#[test]
fn an_animation_is_asked_for() {
    let mut harness = harness("st-wire", 1600.0);
    open(&mut harness, "Capture");
    let asked = |h: &mut Harness<'static, State>| {
        h.state_mut().actions.clear();
        click(h, "Save animation");
        h.state().actions.iter().find_map(|a| match a {
            Action::Animate(sequence, path) => Some((sequence.clone(), path.clone())),
            _ => None,
        })
    };
    let (sequence, path) = asked(&mut harness).unwrap();
    assert_eq!((sequence.frames, sequence.fps, path.to_str()), (60, 30.0, Some("animation.webp")));
    assert_eq!(sequence.along, Along::Turntable { start: 0.0 });
    harness.get_by_role_and_label(egui::accesskit::Role::ComboBox, "moves").click();
    harness.run_steps(3);
    click(&mut harness, "along the path");
    let (sequence, _) = asked(&mut harness).unwrap();
    assert_eq!(sequence.along, Along::Case { case: "st-wire".into() });
    assert_eq!(sequence.frames, 32);
    harness.state_mut().model.animating.path = "film.gif".into();
    harness.run_steps(2);
    assert_eq!(asked(&mut harness), None);
    assert!(harness.state().model.notes.iter().any(|n| n.error && n.text.contains("film.gif")));
    // Nothing else is asked for meanwhile.
    harness.state_mut().model.animating.path = "film.png".into();
    harness.state_mut().model.measuring = Some(Job::new("Animation"));
    harness.run_steps(2);
    assert_eq!(asked(&mut harness), None);
}

/// A rectangle that is dragged out in the picture is what captures show, in one step; Escape and slips leave all as it was.
#[test]
fn a_crop_is_dragged_out_in_the_picture() {
    let mut harness = harness("cubes", 1400.0);
    open(&mut harness, "Capture");
    let before = setup(&harness);
    let drag = |harness: &mut Harness<'static, State>, from: [f32; 2], to: [f32; 2]| {
        let at = |share: [f32; 2]| {
            let rect = harness.state().picture;
            let [w, h] = before.size.map(|side| side as f32);
            // The picture has the capture's shape, in the middle of what the panel leaves.
            let scale = (rect.width() / w).min(rect.height() / h);
            let whole = egui::Rect::from_center_size(rect.center(), scale * egui::vec2(w, h));
            whole.min + whole.size() * egui::vec2(share[0], share[1])
        };
        let (from, to) = (at(from), at(to));
        harness.drag_at(from);
        harness.run_steps(2);
        harness.hover_at(to);
        harness.run_steps(2);
        harness.drop_at(to);
        harness.run_steps(4);
    };
    click(&mut harness, "From the picture");
    assert!(harness.state().model.framed && harness.state().model.cropping);
    drag(&mut harness, [0.75, 0.9], [0.25, 0.1]);
    let part = setup(&harness).part();
    let near = [320, 72, 640, 576].iter().zip(part).all(|(a, b)| b.abs_diff(*a) <= 3);
    assert!(near && !harness.state().model.cropping, "{part:?}");
    assert_eq!(setup(&harness).camera, before.camera, "the camera has not moved");
    let field = |harness: &Harness<'static, State>, text: &str| harness.query_by_value(text).is_some();
    assert!(field(&harness, &format!("{} px", part[0])), "its numbers stand in the panel");
    // Another drag is the camera's again.
    drag(&mut harness, [0.5, 0.5], [0.6, 0.5]);
    assert_ne!(setup(&harness).camera, before.camera);
    assert_eq!(setup(&harness).part(), part);
    click(&mut harness, "From the picture");
    harness.key_press(egui::Key::Escape);
    harness.run_steps(2);
    assert!(!harness.state().model.cropping);
    click(&mut harness, "All of it");
    assert_eq!(setup(&harness).crop, None);
    click(&mut harness, "Undo");
    assert_eq!(setup(&harness).part(), part);
}

#[test]
fn closing_with_rows_in_no_file_asks() {
    let mut harness = charted();
    harness.state_mut().actions.clear();
    let quit = |h: &mut Harness<'static, State>| {
        h.key_press_modifiers(egui::Modifiers::COMMAND, egui::Key::Q);
        h.run_steps(4);
    };
    quit(&mut harness);
    assert!(harness.state().actions.is_empty());
    harness.get_by_label("5 measured rows are not saved.");
    click(&mut harness, "Cancel");
    assert!(harness.query_by_label("Close without saving").is_none());
    quit(&mut harness);
    quit(&mut harness);
    assert_eq!(harness.state().actions, [Action::Quit], "asked twice");
    harness.state_mut().actions.clear();
    quit(&mut harness);
    click(&mut harness, "Save measured-001.csv and close");
    assert_eq!(harness.state().actions, [Action::Export(Tab::Chart, "measured-001.csv".into())]);
    harness.state_mut().model.closing = false;
    harness.state_mut().actions.clear();
    quit(&mut harness);
    click(&mut harness, "Close without saving");
    assert_eq!(harness.state().actions, [Action::Quit]);
    harness.state_mut().actions.clear();
    quit(&mut harness);
    assert_eq!(harness.state().actions, [Action::Quit], "nothing is left to save");
}

/// What a run would lose is asked about too: its own results, and those that are on their way.
#[test]
fn closing_asks_about_runs_and_their_results() {
    let mut harness = harness("cubes", 800.0);
    let quit = |h: &mut Harness<'static, State>| {
        h.key_press_modifiers(egui::Modifiers::COMMAND, egui::Key::Q);
        h.run_steps(4);
    };
    harness.state_mut().model.measuring = Some(Job::new("Sweep"));
    quit(&mut harness);
    assert!(harness.state().actions.is_empty());
    click(&mut harness, "Cancel");
    quit(&mut harness);
    click(&mut harness, "Stop and close");
    assert_eq!(harness.state_mut().actions.split_off(0), [Action::Quit]);
    let m = &mut harness.state_mut().model;
    (m.measuring, m.closing) = (None, false);
    m.unsaved(Tab::Stability);
    m.unsaved(Tab::Advice);
    quit(&mut harness);
    click(&mut harness, "Save stability-001.csv, advice-001.csv and close");
    let saved = [(Tab::Stability, "stability-001.csv"), (Tab::Advice, "advice-001.csv")];
    assert_eq!(harness.state().actions, saved.map(|(tab, path)| Action::Export(tab, path.into())));
}

/// Keys go to the dialog, not to what stands behind it.
#[test]
fn the_file_dialog_hears_the_keys_alone() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.glb"), "").unwrap();
    let mut harness = harness("cubes", 800.0);
    let camera = harness.state().model.setup.camera;
    harness.state_mut().model.picker = Some(Picker::new(false, &folder.path().join("x"), None));
    harness.run_steps(3);
    for (key, text) in [(egui::Key::B, "b"), (egui::Key::S, "s"), (egui::Key::Num4, "4")] {
        harness.event(egui::Event::Text(text.into()));
        harness.key_press(key);
        harness.run_steps(2);
    }
    harness.key_press(egui::Key::Enter);
    harness.run_steps(3);
    let missing = folder.path().join("bs4");
    harness.get_by_label(&format!("There is no file {}.", missing.display()));
    let m = &harness.state().model;
    assert!(m.picker.is_some() && harness.state().actions.is_empty());
    assert_eq!((m.setup.view.as_str(), m.setup.camera), ("shaded", camera));
    harness.get_by_label("a.glb").click();
    harness.run_steps(3);
    harness.key_press(egui::Key::Enter);
    harness.run_steps(3);
    let path = folder.path().join("a.glb").to_string_lossy().into_owned();
    assert_eq!(harness.state().actions, [Action::Open(path)]);
    assert_eq!(harness.state().model.folder.as_deref(), Some(folder.path()));
}

/// Where Ctrl is up before the key of a shortcut, the camera does not fly with that.
#[test]
fn a_shortcuts_key_does_not_move_the_camera() {
    let mut harness = harness("cubes", 800.0);
    let camera = harness.state().model.setup.camera;
    let key = |pressed, modifiers| egui::Event::Key {
        key: egui::Key::S,
        physical_key: None,
        pressed,
        repeat: false,
        modifiers,
    };
    harness.event(key(true, egui::Modifiers::COMMAND));
    harness.run_steps(1);
    harness.event(egui::Event::PointerMoved(egui::pos2(200.0, 200.0)));
    harness.run_steps(3);
    assert_eq!(harness.state().model.setup.camera, camera);
    harness.event(key(false, egui::Modifiers::NONE));
    harness.run_steps(1);
    harness.event(key(true, egui::Modifiers::NONE));
    harness.run_steps(3);
    assert_ne!(harness.state().model.setup.camera, camera);
}

#[test]
fn another_scene_keeps_technique_parameters_view_and_size() {
    let mut harness = harness("cubes", 800.0);
    let m = &mut harness.state_mut().model;
    m.select(techniques::find("pcf").unwrap());
    m.setup.set("kernel=7", &["pcf".into()]).unwrap();
    m.setup.set("bias=0.05", &["pcf".into()]).unwrap();
    m.setup.view = "texels".into();
    m.setup.size = [320, 200];
    let (mut next, scene) = Setup::open("st-contact").unwrap();
    let first = next.clone();
    m.carry(&mut next);
    assert_eq!((next.technique.as_str(), next.view.as_str(), next.size), ("pcf", "texels", [320, 200]));
    assert_eq!((next.scene.as_str(), next.camera, next.light), ("st-contact", first.camera, first.light));
    assert_eq!(next.values()["kernel"], Value::Int(7));
    // The case begins where its timeline does, and what its path moves goes back to the default afterwards.
    assert_eq!(next.values()["bias"], Value::Float(0.0));
    next.check().unwrap();
    let bounds = m.bounds;
    m.open(next, Arc::new(scene), bounds, false);
    let (mut back, _) = Setup::open("blocks").unwrap();
    m.carry(&mut back);
    assert_eq!((&back.values()["kernel"], &back.values()["bias"]), (&Value::Int(7), &Value::Float(0.002)));
    // A light that the technique does not serve.
    let (mut lit, scene) = Setup::open("cubes").unwrap();
    lit.light = setup::scene_light(&scene, "omni", Clock::default()).unwrap();
    m.carry(&mut lit);
    lit.check().unwrap();
    assert_eq!((lit.technique.as_str(), lit.view.as_str()), ("cube", "texels"));
    // And a view that the next technique does not have.
    m.setup.view = "shadow-map".into();
    m.carry(&mut lit);
    assert_eq!((lit.technique.as_str(), lit.view.as_str()), ("cube", "shaded"), "a cube has more than one map");
}

#[test]
fn every_case_names_only_techniques_that_are_there() {
    let known: Vec<&str> = techniques::ALL.iter().map(|i| i.id).collect();
    let absent = [
        "shadow-volume",
        "izb",
        "vsm",
        "esm",
        "evsm",
        "msm",
        "pcss",
        "sssm",
        "edsm",
        "ipsm",
        "cube",
        "cssm",
        "hybrid-pcf",
        "csm-conservative",
        "dual-paraboloid",
        "area-uniform",
        "area-adaptive",
        "lixel-per-pixel",
        "optimal-light-plane",
    ];
    for case in cases::CASES {
        assert!(case.title.contains(": "), "{}", case.title);
        for word in case.doc.split(|c: char| !(c.is_alphanumeric() || c == '-')).map(|w| w.trim_end_matches("'s")) {
            assert!(!absent.contains(&word) || known.contains(&word), "{}: {word}", case.id);
        }
    }
}

#[test]
fn techniques_are_searched_for() {
    let mut harness = harness("cubes", 800.0);
    harness.key_press_modifiers(egui::Modifiers::COMMAND, egui::Key::F);
    harness.run_steps(2);
    harness.event(egui::Event::Text("lauritzen, salvi".into()));
    harness.run_steps(3);
    assert!(harness.query_by_label("Sample distribution shadow maps").is_some());
    assert!(harness.query_by_label("Shadow map").is_none_or(|n| n.rect().top() > 300.0), "only the view is left");
    harness.key_press(egui::Key::Enter);
    harness.run_steps(3);
    assert_eq!((setup(&harness).technique.as_str(), harness.state().model.search.as_str()), ("sdsm", ""));
}

/// The next click into the picture picks the plane of interest, until Escape or another technique.
#[test]
fn a_plane_is_picked_in_the_picture() {
    let mut harness = harness("cubes", 2400.0);
    harness.state_mut().model.select(techniques::find("lixel-per-pixel").unwrap());
    harness.run_steps(3);
    click(&mut harness, "Pick a plane");
    assert!(harness.state().model.picking);
    let at = harness.state().picture.center();
    harness.hover_at(at);
    for pressed in [true, false] {
        let button = egui::PointerButton::Primary;
        harness.event(egui::Event::PointerButton { pos: at, button, pressed, modifiers: egui::Modifiers::NONE });
        harness.run_steps(2);
    }
    let asked =
        |a: &Action| matches!(a, Action::PickPlane([x, y]) if (*x - 0.5).abs() < 0.02 && (*y - 0.5).abs() < 0.02);
    assert!(harness.state().actions.iter().any(asked) && !harness.state().model.picking);
    // What is found there is one step, and can be undone.
    let before = setup(&harness);
    let plane = shadowscope::map::fit::lixel::Plane { normal: glam::DVec3::NEG_Z, distance: 2.0 };
    let model = &mut harness.state_mut().model;
    let origin = model.scene.origin;
    model.give_plane(&plane);
    harness.run_steps(3);
    let values = setup(&harness).params["lixel-per-pixel"].clone();
    let back = techniques::lixel_per_pixel::given(&values, origin);
    assert!(
        values["plane"] == Value::Text("given".into()) && (back.normal.z * back.distance + 2.0).abs() < 1e-9,
        "{values:?}"
    );
    harness.key_press_modifiers(egui::Modifiers::COMMAND, egui::Key::Z);
    harness.run_steps(3);
    assert_eq!(setup(&harness), before);
    click(&mut harness, "Pick a plane");
    harness.key_press(egui::Key::Escape);
    harness.run_steps(3);
    assert!(!harness.state().model.picking);
    click(&mut harness, "Pick a plane");
    harness.state_mut().model.select(techniques::find("pcf").unwrap());
    harness.run_steps(3);
    assert!(!harness.state().model.picking);
}

/// Nothing that the window says in tooltips shows as an empty box.
#[test]
fn the_fonts_have_every_letter_of_the_tooltips() {
    let harness = harness("cubes", 800.0);
    let mut all: Vec<&str> = cases::CASES.iter().flat_map(|c| [c.title, c.doc, c.axis]).collect();
    all.extend(
        view::VIEWS.iter().chain(techniques::ALL.iter().flat_map(|i| i.all_views())).flat_map(|v| [v.title, v.doc]),
    );
    all.extend(techniques::ALL.iter().flat_map(|i| [i.title, i.doc, i.paper]));
    all.extend(techniques::ALL.iter().flat_map(|i| i.specs()).flat_map(|s| [s.doc, s.unit]));
    let font = egui::FontId::proportional(13.5);
    let has = |c: char| c.is_whitespace() || harness.ctx.fonts_mut(|f| f.has_glyph(&font, c));
    for text in all {
        let missing: String = text.chars().filter(|c| !has(*c)).collect();
        assert!(missing.is_empty(), "{missing:?} in {text}");
    }
}

/// A second technique is added from the menu; list and parameters are of the side that is edited, and what differs from the
/// other is marked.
#[test]
fn sides_of_a_comparison_are_edited_one_at_a_time() {
    let mut harness = harness("cubes", 2600.0);
    click(&mut harness, "Compare with …");
    click(&mut harness, "Shadow map, other parameters");
    let model = &harness.state().model;
    assert_eq!((model.setup.against.len(), model.editing), (1, 1));
    assert_eq!(model.setup.against[0].technique, "shadow-map");
    harness.state_mut().model.edited_values().insert("resolution".into(), Value::Int(512));
    harness.run_steps(3);
    assert!(harness.query_by_label("resolution differs: A has 1024.").is_some());
    click(&mut harness, "A shadow-map");
    assert_eq!(harness.state().model.editing, 0);
    assert!(harness.query_by_label("resolution differs: B has 512.").is_some());
    click(&mut harness, "B shadow-map");
    click(&mut harness, "Percentage-closer filtering");
    let model = &harness.state().model;
    assert_eq!((model.setup.technique.as_str(), model.setup.against[0].technique.as_str()), ("shadow-map", "pcf"));
    // The difference is a view, which the same key leaves again.
    harness.key_press(egui::Key::B);
    harness.run_steps(2);
    assert_eq!(harness.state().model.setup.view, "difference");
    harness.key_press(egui::Key::B);
    harness.run_steps(2);
    assert_eq!(harness.state().model.setup.view, "shaded");
    for front in [0, 1, 0] {
        harness.key_press(egui::Key::X);
        harness.run_steps(2);
        assert_eq!((harness.state().model.setup.arrange, harness.state().model.setup.front), (Arrange::Flicker, front));
    }
    // From the difference it goes to what the sides show.
    for (key, view) in [(egui::Key::B, "difference"), (egui::Key::X, "shaded")] {
        harness.key_press(key);
        harness.run_steps(2);
        assert_eq!(harness.state().model.setup.view, view);
    }
    assert_eq!(harness.state().model.setup.arrange, Arrange::Flicker);
    harness.state().model.setup.check().unwrap();
    click(&mut harness, "×");
    assert_eq!((harness.state().model.setup.sides(), harness.state().model.editing), (1, 0));
}

#[test]
fn shift_f12_captures_a_figure_and_f12_the_set_up() {
    let mut harness = harness("cubes", 800.0);
    harness.key_press_modifiers(egui::Modifiers::SHIFT, egui::Key::F12);
    harness.run_steps(2);
    assert!(matches!(harness.state().actions[..], [Action::Figure(_)]), "{:?}", harness.state().actions);
    harness.state_mut().actions.clear();
    harness.key_press(egui::Key::F12);
    harness.run_steps(2);
    assert!(matches!(harness.state().actions[..], [Action::Capture(_)]), "{:?}", harness.state().actions);
}

/// A comparison of pcf with pssm of which figures are known, the second side edited.
fn compared(height: f32) -> Harness<'static, State> {
    use shadowscope::frame::ToldSide;
    use shadowscope::measure::metrics::Errors;
    let mut harness = harness("cubes", height);
    let m = &mut harness.state_mut().model;
    m.select(techniques::find("pcf").unwrap());
    m.add_side(m.setup.kept("pssm").unwrap());
    m.add_side(setup::Side::new(setup::Side::TRUTH).unwrap());
    m.editing = 1;
    m.facts.passes = vec![("shadow map", 11.0), ("resolve", 1.0)];
    let side = |passes: &[(&'static str, f64)], gpu_bytes| ToldSide {
        passes: passes.to_vec(),
        gpu_bytes,
        ..ToldSide::default()
    };
    let second = side(&[("shadow maps", 20.0), ("splits", 3.0)], 16 << 20);
    m.facts.told.sides = vec![side(&[("shadow map", 11.0), ("resolve", 1.0)], 4 << 20), second, ToldSide::default()];
    let errors = |wrong| Some(Errors { facing: 100, lit_incorrect: wrong, rmse: 0.5, ..Errors::default() });
    m.facts.known.errors = vec![errors(1), errors(2), None];
    m.facts.traced = Traced::Fully;
    harness.run_steps(4);
    harness
}

/// What belongs to one side is that of the tab chosen, or bears the side's letter.
#[test]
fn figures_are_those_of_the_side_that_is_edited() {
    let mut harness = compared(2600.0);
    let now = setup(&harness);
    let measured = row(&now.side(1), "pssm", Some(1024), 0.01, 1.0);
    harness.state_mut().model.adopt([measured]);
    harness.run_steps(3);
    for label in ["Parameters: B", "Texels used / held: B", "Timings: B", "Maps of B", "Aliasing of B"] {
        harness.get_by_label(label);
    }
    harness.get_by_label("as measured with this set-up");
    harness.get_by_label("shadow maps");
    harness.get_by_label("   16.00 MiB");
    harness.get_by_label("B technique 23.00 ms");
    harness.get_by_label("B error 2.000 %, RMSE 0.5000");
    harness.get_by_label("frame 35.0 ms");
    open(&mut harness, "Measure");
    harness.get_by_label("Measure B pssm");
    click(&mut harness, "A pcf");
    for label in ["Parameters: A", "Timings: A", "Maps of A", "Measure A pcf", "    4.00 MiB"] {
        harness.get_by_label(label);
    }
    harness.get_by_label("A technique 12.00 ms");
    harness.get_by_label("A error 1.000 %, RMSE 0.5000");
    assert!(harness.query_by_label("shadow maps").is_none());
    harness.get_by_label("the rest is known once it is measured");
    click(&mut harness, "C truth");
    harness.get_by_label("C is the truth");
    use egui::accesskit::Role;
    assert!(harness.get_by_role_and_label(Role::Button, "Measure C truth").accesskit_node().is_disabled());
}

/// The views of the side that is edited are offered, and one stays as long as some side has it.
#[test]
fn a_view_of_one_side_is_shown() {
    let mut harness = compared(2600.0);
    // A family of techniques and a section of parameters are called so too.
    let view = |h: &Harness<'static, State>| h.query_all_by_label("Cascades").count();
    assert_eq!(view(&harness), 3);
    harness.get_all_by_label("Cascades").nth(1).unwrap().click();
    harness.run_steps(3);
    assert_eq!(setup(&harness).view, "cascades");
    setup(&harness).check().unwrap();
    let shaded = harness.query_all_by_label("has no cascades: shaded").count();
    assert_eq!(shaded, 2, "A and the truth have none");
    click(&mut harness, "A pcf");
    assert_eq!(setup(&harness).view, "cascades");
    assert_eq!(view(&harness), 1);
    harness.get_by_label("Tap pattern");
    click(&mut harness, "B pssm");
    click(&mut harness, "Shadow map");
    assert_eq!(setup(&harness).view, "shaded", "no side has it any more");
}

/// Rows that go leave their place empty while the pointer is in the panel.
#[test]
fn no_row_moves_under_the_pointer() {
    use egui::accesskit::Role;
    for height in [2600.0, 700.0] {
        let mut harness = harness("cubes", height);
        let values = harness.state_mut().model.edited_values();
        values.insert("slope_bias".into(), Value::Float(2.0));
        harness.run_steps(3);
        let slider = |h: &Harness<'static, State>, name: &str| {
            let all = h.query_all_by_role_and_label(Role::Slider, name);
            all.map(|n: Node| n.rect()).next()
        };
        // So that the end of the panel is in sight.
        for title in ["Technique", "View", "Texels used / held"] {
            open(&mut harness, title);
        }
        harness.get_by_label("Capture").scroll_to_me();
        harness.run_steps(20);
        let rows = |h: &Harness<'static, State>| -> Vec<Option<egui::Rect>> {
            let headers = ["Parameters", "Timings", "Capture"].map(|t| h.query_by_label(t).map(|n| n.rect()));
            headers.into_iter().chain(["bias", "slope bias"].map(|s| slider(h, s))).collect()
        };
        let before = rows(&harness);
        let rect = slider(&harness, "slope bias").unwrap();
        assert!(slider(&harness, "slope limit").is_some());
        harness.drag_at(rect.center());
        harness.run_steps(2);
        let zero = rect.left_center() - egui::vec2(30.0, 0.0);
        harness.hover_at(zero);
        harness.run_steps(3);
        assert!(slider(&harness, "slope limit").is_none(), "what means nothing is not shown");
        assert_eq!(rows(&harness), before, "while it is dragged");
        harness.event(egui::Event::PointerButton {
            pos: zero,
            button: egui::PointerButton::Primary,
            pressed: false,
            modifiers: egui::Modifiers::NONE,
        });
        harness.run_steps(20);
        assert_eq!(setup(&harness).values()["slope_bias"], Value::Float(0.0));
        assert_eq!(rows(&harness), before, "after it is dropped");
        harness.hover_at(egui::pos2(100.0, 100.0));
        harness.run_steps(20);
        if height > 1000.0 {
            let up = before[1].unwrap().top() - rows(&harness)[1].unwrap().top();
            assert_eq!(up, 26.0, "the place is free once the pointer is elsewhere");
        }
    }
}

/// What another parameter switches on or off stands below that: rows that come move none that was touched.
#[test]
fn parameters_stand_below_those_they_depend_on() {
    for info in techniques::ALL.iter() {
        let mut sections: Vec<&str> = Vec::new();
        info.specs().for_each(|s| {
            if !sections.contains(&s.section) {
                sections.push(s.section);
            }
        });
        let place = |name: &str| {
            let (i, spec) = info.specs().enumerate().find(|(_, s)| s.name == name)?;
            Some((sections.iter().position(|s| *s == spec.section), i))
        };
        for spec in info.specs() {
            for of in spec.when.iter().flat_map(|all| all.iter()) {
                // What only another technique of the group has stands nowhere here.
                assert!(place(of.of) < place(spec.name), "{}: {} stands above {}", info.id, spec.name, of.of);
            }
        }
    }
}

/// Options that come with a view or an overlay stand below what chooses them.
#[test]
fn an_overlays_options_move_nothing_above_them() {
    let mut harness = harness("cubes", 2600.0);
    let place = |h: &Harness<'static, State>| {
        ["overlay", "legend", "truth samples"].map(|l| h.get_all_by_label(l).next().unwrap().rect().top())
    };
    let before = place(&harness);
    for view in ["error-density", "error", "counts"] {
        let inset = view == "counts";
        let overlay = setup::Overlay { view: view.into(), opacity: 0.5, inset };
        harness.state_mut().model.setup.overlay = Some(overlay);
        harness.run_steps(3);
        assert_eq!(place(&harness), before, "{view}");
    }
}

#[test]
fn the_search_comes_into_view() {
    use egui::accesskit::Role;
    let mut harness = harness("cubes", 700.0);
    open(&mut harness, "Technique");
    assert!(harness.query_by_role_and_label(Role::TextInput, "search techniques").is_none());
    harness.get_by_label("Capture").scroll_to_me();
    harness.run_steps(20);
    harness.key_press(egui::Key::F9);
    harness.run_steps(3);
    harness.key_press_modifiers(egui::Modifiers::COMMAND, egui::Key::F);
    harness.run_steps(60);
    let search = harness.get_by_role_and_label(Role::TextInput, "search techniques");
    assert!(search.is_focused());
    let rect = search.rect();
    assert!(rect.top() > 30.0 && rect.bottom() < 350.0, "{rect:?}");
    harness.event(egui::Event::Text("lauritzen, salvi".into()));
    harness.run_steps(3);
    let found = harness.get_by_label("Sample distribution shadow maps").rect();
    assert!(found.top() > rect.bottom() && found.bottom() < 700.0, "{found:?}");
}

/// The list shows the technique that a file, an undo or a search has chosen; where it is in sight, or was clicked, nothing moves, and
/// who scrolls away from it is let go.
#[test]
fn the_chosen_technique_is_in_sight() {
    let mut harness = harness("cubes", 700.0);
    let first = techniques::ALL[0].title;
    let place = |harness: &Harness<'static, State>, title: &str| {
        // The view of a map may have the same name.
        harness.get_all_by_label(title).map(|n| n.rect()).next().unwrap()
    };
    let search = harness.get_by_role_and_label(egui::accesskit::Role::TextInput, "search techniques").rect();
    let seen = |rect: egui::Rect| rect.top() > search.bottom() && rect.bottom() < 700.0;
    let start = place(&harness, first);
    assert!(seen(start), "{start:?}");
    let (mut other, scene) = Setup::open("cubes").unwrap();
    let (scene, bounds) = (Arc::new(scene), harness.state().model.bounds);
    for id in ["izb", "rt-hard", "pcf"] {
        let title = techniques::find(id).unwrap().title;
        other.select(id).unwrap();
        harness.state_mut().model.open(other.clone(), scene.clone(), bounds, false);
        harness.run_steps(4);
        let shown = place(&harness, title);
        assert!(seen(shown), "{id}: {shown:?}");
        // Only once.
        harness.get_all_by_label(first).next().unwrap().scroll_to_me();
        harness.run_steps(20);
        assert_eq!(place(&harness, first).top(), start.top(), "{id}");
    }
    // Opened again, though it is the same.
    other.select("izb").unwrap();
    for _ in 0..2 {
        harness.state_mut().model.open(other.clone(), scene.clone(), bounds, false);
        harness.run_steps(4);
        assert!(seen(place(&harness, techniques::find("izb").unwrap().title)));
        harness.get_all_by_label(first).next().unwrap().scroll_to_me();
        harness.run_steps(20);
    }
    let before = place(&harness, "Percentage-closer filtering");
    click(&mut harness, "Percentage-closer filtering");
    harness.run_steps(4);
    assert_eq!((setup(&harness).technique.as_str(), place(&harness, "Percentage-closer filtering")), ("pcf", before));
}

/// How far a measurement is stands first and is never cut off; the button keeps its place.
#[test]
fn progress_over_the_picture_is_never_cut_off() {
    for width in [640.0, 1600.0] {
        let mut harness = harness("cubes", 800.0);
        harness.set_size(egui::vec2(width + 16.0, 600.0));
        let long = "shadow-map resolution=2048, hardware_bias=3: errors at 1280 × 720 with 16 samples, view 7 of 12";
        let mut job = Job::new("Advice");
        (job.what, job.done) = (long.into(), 0.5);
        job.since = std::time::Instant::now() - std::time::Duration::from_secs(50);
        harness.state_mut().model.measuring = Some(job);
        harness.run_steps(4);
        let banner = |h: &Harness<'static, State>, start: &str| {
            let found = texts(h).into_iter().find(|t| t.0.starts_with(start) && t.1.right() < width - 340.0);
            found.unwrap_or_else(|| panic!("{start} is missing"))
        };
        let (_, rect, clip, elided, _) = banner(&harness, "Advice: 50 %, 50 s left");
        assert!(!elided && clip.contains_rect(rect));
        let (_, more, _, cut, _) = banner(&harness, "shadow-map resolution=2048");
        assert_eq!(cut, width < 1000.0, "what it is at takes the room there is");
        assert!(more.left() > rect.right());
        let cancel = harness.get_by_label("Cancel").rect();
        harness.state_mut().model.measuring.as_mut().unwrap().what = "short".into();
        harness.run_steps(4);
        assert_eq!(harness.get_by_label("Cancel").rect(), cancel);
    }
}

/// The longest figures of a measured row are neither shortened nor cut off, nor do the buttons above lie over each other.
#[test]
fn measured_rows_and_the_head_clip_nothing() {
    let mut harness = harness("cubes", 2600.0);
    let base = setup(&harness);
    let many = Record {
        facing: 8_294_400,
        lit_correct: 8_294_400,
        boundary_median_px: Some(1234.5),
        boundary_p95_px: Some(1234.5),
        boundary_max_px: Some(12345.6),
        m_p50: Some(12345.6),
        m_p95: Some(12345.6),
        m_max: Some(12345.6),
        texel_area_p95: Some(123456.7),
        anisotropy_p95: Some(12345.6),
        texels: Some(536_870_912),
        texels_covered: Some(500_000_000),
        views_needed: Some(8),
        views_rendered: Some(8),
        triangles_drawn: Some(90_000_000),
        triangles_submitted: Some(99_999_999),
        fragments: Some(4_000_000_000),
        triangles_needed: Some(99_999_999),
        triangles_added: Some(99_999_999),
        rays: 8_294_400,
        gpu_ms: 12345.678,
        gpu_ms_q1: 12345.678,
        gpu_ms_q3: 12345.678,
        ratio: Some(1234.5),
        cost: Some(1234.5),
        ..row(&base, "shadow-map", Some(1024), 0.01, 1.0)
    };
    harness.state_mut().model.adopt([many]);
    open(&mut harness, "Measure");
    for label in ["edge error, median", "texel, worst", "93.1 % of 536 870 912"] {
        harness.get_all_by_label(label).next().unwrap();
    }
    let left = harness.state().picture.right();
    for (text, rect, clip, elided, _) in texts(&harness).into_iter().filter(|t| t.1.left() >= left) {
        assert!(!elided && rect.right() <= clip.right() + 0.5, "{text:?} at {rect:?} in {clip:?}");
    }
    harness.set_size(egui::vec2(316.0, 216.0));
    harness.run_steps(4);
    click(&mut harness, "Show the panel");
    let buttons = ["Undo", "Redo", "Light theme", "Help", "Hide"].map(|l| harness.get_by_label(l).rect());
    for pair in buttons.windows(2) {
        assert!(pair[0].right() <= pair[1].left(), "{buttons:?}");
    }
}

/// What could not be opened is forgotten when something else is, and after a while; not while the pointer is there.
#[test]
fn messages_go_when_they_are_read() {
    let mut harness = harness("cubes", 800.0);
    let says = |h: &Harness<'static, State>, text: &str| h.query_by_label(text).is_some();
    let m = &mut harness.state_mut().model;
    m.fail_to_open(&anyhow::anyhow!("no such file"));
    m.fail(&anyhow::anyhow!("too much"));
    m.stop(&anyhow::anyhow!("rendering has stopped"));
    harness.run_steps(3);
    assert!(says(&harness, "no such file") && says(&harness, "too much"));
    let (other, scene) = Setup::open("blocks").unwrap();
    let bounds = harness.state().model.bounds;
    harness.state_mut().model.open(other, Arc::new(scene), bounds, false);
    harness.run_steps(3);
    assert!(!says(&harness, "no such file") && says(&harness, "too much"));
    // At the end of its time the pointer keeps it.
    let soon = std::time::Instant::now() + std::time::Duration::from_millis(100);
    let at = harness.get_by_label("too much").rect().center();
    harness.hover_at(at);
    harness.state_mut().model.notes[0].until = Some(soon);
    harness.run_steps(3);
    std::thread::sleep(std::time::Duration::from_millis(150));
    harness.run_steps(3);
    assert!(says(&harness, "too much"));
    harness.hover_at(egui::pos2(600.0, 600.0));
    harness.state_mut().model.notes[0].until = Some(std::time::Instant::now());
    harness.run_steps(3);
    assert!(!says(&harness, "too much") && says(&harness, "rendering has stopped"));
}

/// Messages leave the titles of a comparison and the map viewer's buttons in view.
#[test]
fn messages_cover_no_titles() {
    let mut harness = compared(800.0);
    harness.state_mut().model.fail(&anyhow::anyhow!("too much"));
    harness.run_steps(3);
    let message = harness.get_by_label("too much").rect();
    let title =
        harness.get_all_by_label("A pcf").map(|n| n.rect()).min_by(|a, b| a.left().total_cmp(&b.left())).unwrap();
    assert!(message.top() > title.bottom(), "{message:?} over {title:?}");
    harness.key_press(egui::Key::M);
    harness.key_press(egui::Key::M);
    harness.run_steps(4);
    let message = harness.get_by_label("too much").rect();
    let button = harness.get_by_label("Beside the picture").rect();
    assert!(message.top() > button.bottom(), "{message:?} over {button:?}");
}

/// The tooltip of an entry of a list leaves the other entries in view.
#[test]
fn tooltips_of_lists_stand_beside_them() {
    let mut harness = harness("cubes", 2000.0);
    harness.get_by_role_and_label(egui::accesskit::Role::ComboBox, "overlay").click();
    harness.run_steps(4);
    let doc = view::VIEWS.iter().find(|v| v.id == "visibility").unwrap().doc;
    let entry = harness.get_all_by_label("Visibility").last().unwrap();
    entry.hover();
    let left = entry.rect().left();
    harness.run_steps(60);
    let tip = harness.get_by_label(doc).rect();
    assert!(tip.right() <= left, "{tip:?} covers what stands at {left}");
}

/// A window of 1900 points and more shows all techniques at once.
#[test]
fn a_high_window_shows_all_techniques() {
    let harness = harness("cubes", 1900.0);
    let last = techniques::ALL.last().unwrap();
    let (_, rect, clip, ..) = texts(&harness).into_iter().find(|t| t.0 == last.title).expect("it is painted");
    assert!(clip.contains_rect(rect), "{rect:?} in {clip:?}");
}

/// A path of one's own: recorded, seen, scrubbed, edited, run, and undone.
#[test]
fn a_path_of_ones_own_is_recorded_edited_and_scrubbed() {
    let mut harness = harness("cubes", 1600.0);
    click(&mut harness, "Stability");
    click(&mut harness, "own path");
    harness.get_by_label_contains("No path yet.");
    assert!(harness.state().model.route().is_none() && harness.query_by_label("Run").is_none());
    // Straight ahead: two keys, from where it began to where it ended.
    let before = setup(&harness);
    click(&mut harness, "Record");
    harness.get_by_label_contains("recording, ");
    let ahead = before.camera.forward();
    for _ in 0..5 {
        harness.state_mut().model.setup.camera.shift(ahead * 0.2);
        harness.state_mut().model.advance(0.02);
        std::thread::sleep(std::time::Duration::from_millis(60));
    }
    click(&mut harness, "Stop");
    let path = setup(&harness).path.expect("it was recorded");
    let ends = [&path.keys[0], &path.keys[path.keys.len() - 1]].map(|k| k.camera.unwrap().position);
    assert_eq!(ends, [before.camera.position, setup(&harness).camera.position]);
    assert!(path.keys.iter().all(|k| k.light.is_none()) && path.seconds() > 0.1, "{path:?}");
    // Recorded again where nothing moves, it stays.
    click(&mut harness, "Record");
    click(&mut harness, "Stop");
    assert_eq!(setup(&harness).path.as_ref(), Some(&path));

    // Scrubbed in the chart and by the slider; places are the path's.
    let slider = harness.get_by_role_and_label(egui::accesskit::Role::Slider, "t").rect();
    let middle = slider.left_center() + egui::vec2(slider.width() * 0.5, 0.0);
    harness.drag_at(middle);
    harness.run_steps(2);
    harness.drop_at(middle);
    harness.run_steps(3);
    let t = harness.state().model.timeline.t;
    assert!((t - 0.5).abs() < 0.1, "{t}");
    let mut placed = setup(&harness);
    harness.state().model.route().unwrap().place(&mut placed, t);
    assert_eq!(setup(&harness).camera, placed.camera);
    assert_ne!(placed.camera.position, ends[0]);

    // It plays on, until the camera is taken in hand.
    click(&mut harness, "Play");
    harness.state_mut().model.advance(0.02);
    assert!(harness.state().model.timeline.playing && harness.state().model.timeline.t > t);
    harness.state_mut().model.setup.camera.shift(glam::Vec3::Y * 0.5);
    let taken = setup(&harness).camera;
    harness.state_mut().model.advance(0.02);
    assert!(!harness.state().model.timeline.playing);
    assert_eq!(setup(&harness).camera, taken);

    // A key at the end, another time for it, and away with the first; each is a step.
    let keys = path.keys.len();
    click(&mut harness, "Add at end");
    let now = setup(&harness).path.unwrap();
    assert_eq!((now.keys.len(), now.keys[keys].camera.unwrap().position), (keys + 1, taken.position));
    assert!((now.times()[1] - path.times()[1] - 2.0).abs() < 1e-3);
    click(&mut harness, "remove key 1");
    harness.run_steps(4);
    assert_eq!(setup(&harness).path.unwrap().keys[..], now.keys[1..]);
    let m = &mut harness.state_mut().model;
    m.undo();
    assert_eq!(m.setup.path.as_ref(), Some(&now));
    m.undo();
    assert_eq!(m.setup.path.as_ref(), Some(&path));
    while m.undo().is_none() && m.history.can_undo() && m.setup.path.is_some() {}
    assert_eq!(m.setup.path, None);
    m.setup.path = Some(path.clone());
    harness.run_steps(4);
    click(&mut harness, "cost");
    click(&mut harness, "Run");
    let all = harness.state().model.techniques();
    let run = stability::Run { techniques: all, frames: 32, cost: true };
    assert_eq!(harness.state().actions, [Action::Stability(None, run)]);
    // Another scene that is opened by its name has no path.
    let mut other = setup(&harness);
    other.scene = "bench".into();
    harness.state().model.carry(&mut other);
    assert_eq!(other.path, None);
}

/// Costs have lines and a table of their own, and nothing of the tab reaches beyond the window.
#[test]
fn costs_along_a_path_are_shown_within_the_window() {
    let mut harness = harness("cubes", 800.0);
    harness.state_mut().model.drawer = Some(Tab::Stability);
    let camera = setup(&harness).camera;
    for _ in 0..6 {
        harness.state_mut().model.add_key(true);
        harness.state_mut().model.setup.camera.orbit(0.3, 0.0);
    }
    harness.state_mut().model.timeline.choose_own();
    let layers = |i: u32| Some(shadowscope::gpu::LayerCount { layers: 4, layers_drawn: 1 + i });
    let cost = |i: u32| measure::Cost { passes: 9, layers: layers(i), triangles: Some(1000 * i as u64), ms: 2.5 };
    let points = (0..3u32).map(|i| stability::Point {
        t: i as f32 / 2.0,
        error_share: 0.01,
        cost: Some(cost(i)),
        ..Default::default()
    });
    let track = stability::Track { technique: "pssm".into(), points: points.collect(), ..Default::default() };
    let found = stability::Stability {
        case: "own path".into(),
        software: true,
        width: 64,
        height: 64,
        tracks: vec![track],
        ..Default::default()
    };
    harness.state_mut().model.timeline.found = Some(found);
    harness.state_mut().model.timeline.figure = measure::Figure::Layers;
    harness.run_steps(4);
    for text in ["2.0 of 4", "1000", "2.5", "On a software adapter: compare its times as ratios only."] {
        harness.get_by_label(text);
    }
    harness.get_by_label("The path has changed since this run.");
    let painted: Vec<String> = texts(&harness).into_iter().map(|t| t.0).collect();
    for text in ["pssm", "time", "10 s", "2"] {
        assert!(painted.iter().any(|p| p == text), "{text} is not among {painted:?}");
    }
    for (text, place, ..) in texts(&harness) {
        assert!(place.left() >= 0.0 && place.right() <= 1296.0, "{text} lies at {place:?}");
    }
    // Going to a key goes to its place.
    click(&mut harness, "key 1");
    assert_eq!((harness.state().model.timeline.t, setup(&harness).camera), (0.0, camera));
}
