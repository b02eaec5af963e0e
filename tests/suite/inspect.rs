//! Stories of pixels against closed forms, and what is named as the reason of wrong ones against what each case provokes.

use super::common::*;
use egui_kittest::Harness;
use egui_kittest::kittest::{NodeT, Queryable};
use glam::{Vec2, Vec3};
use shadowscope::frame::Renderer;
use shadowscope::measure::diagnosis::{self, Diagnosis};
use shadowscope::measure::story::{self, Seen};
use shadowscope::scene::builtin::cases::{self, CASES};
use shadowscope::setup::Setup;
use shadowscope::ui::{self, Action, Model, Tab};
use std::sync::Arc;

/// Numbers that look random, the same in each run.
struct Dice(u32);

impl Dice {
    fn below(&mut self, most: usize) -> usize {
        self.0 = self.0.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        (self.0 >> 8) as usize % most
    }
}

/// A case, a technique that fails there as it says, parameters, and where along the path.
const FAILING: &[(&str, &str, &[&str], f32)] = &[
    ("st-grazing", "shadow-map", &[], 0.9),
    ("st-grazing", "pssm", &[], 1.0),
    ("st-duel", "shadow-map", &[], 0.9),
    ("st-lightinview", "cube", &["resolution=256"], 0.5),
    ("st-behind", "tsm", &[], 0.75),
    ("st-longtri", "rtw", &["raster=linear"], 1.0),
    ("st-longtri", "notw", &["raster=linear"], 0.9),
    ("st-longtri", "shadow-map", &[], 0.95),
    ("st-foliage", "shadow-map", &[], 0.2),
    ("st-fence", "shadow-map", &[], 0.5),
    ("st-fence", "pcf", &["kernel=9"], 0.5),
    ("st-depthrange", "shadow-map", &[], 1.0),
    ("st-jitter", "lispsm", &[], 0.5),
    ("st-contact", "shadow-map", &[], 1.0),
    ("st-contact", "pcf", &[], 1.0),
    ("st-wire", "shadow-map", &[], 0.5),
    ("st-diagonal", "rtw", &[], 0.0),
    ("st-offscreen", "shadow-map", &[], 0.8),
    ("st-wide", "pcf", &[], 1.0),
    ("st-wide", "cssm", &[], 0.9),
    ("st-wide", "area-uniform", &[], 1.0),
    ("st-seam", "pssm", &[], 0.3),
    ("st-degenerate", "shadow-map", &[], 0.45),
    ("st-corner", "shadow-map", &[], 0.3),
    ("st-single-plane", "shadow-map", &["bias_kind=none"], 0.3),
];

/// The diagnoses of ten wrong pixels of a case, by chance. Of `st-jitter` only those count whose label changed since the frame before
/// though the truth's did not: what flickers is judged in the frame in which it is wrong.
fn diagnoses(case: &str, technique: &str, sets: &[&str], t: f32) -> Vec<Diagnosis> {
    let case = cases::find(case).unwrap();
    let scene = (case.build)();
    let mut setup = Setup::new(case.id, &scene).unwrap();
    setup.size = [256, 192];
    select(&mut setup, technique, sets);
    (case.place)(&mut setup, t);
    // A case may move parameters, which those asked for come after.
    sets.iter().for_each(|set| setup.set(set, &[technique.into()]).unwrap());
    let mut r = Renderer::new(gpu(), Arc::new(scene)).unwrap();
    let mut before = setup.clone();
    (case.place)(&mut before, t - 1.0 / (case.frames as f32 - 1.0));
    let steady = (case.id == "st-jitter").then(|| Seen::draw(&mut r, &before).unwrap());
    let seen = Seen::draw(&mut r, &setup).unwrap();
    let flickered = |i: usize| steady.as_ref().is_none_or(|before| !before.wrong(i));
    let mut wrong: Vec<usize> = (0..seen.pixels.mask.len()).filter(|i| seen.wrong(*i) && flickered(*i)).collect();
    let mut dice = Dice(7);
    let chosen: Vec<[u32; 2]> =
        (0..10.min(wrong.len())).map(|_| seen.pixel(wrong.swap_remove(dice.below(wrong.len())))).collect();
    let setup = story::judged(&setup);
    let stories = story::tell(&mut r, &setup, &seen, &chosen, [1, 1], false).unwrap();
    stories.into_iter().map(|s| s.diagnosis.expect("a wrong pixel has a diagnosis")).collect()
}

/// Of ten wrong pixels of each case, drawn by a technique that fails there, at least eight are said to be what the case provokes.
#[test]
fn what_is_named_is_what_the_case_provokes() {
    let mut short = Vec::new();
    println!("| case | technique | provokes | named | of 10 |\n|---|---|---|---|---|");
    for (case, technique, sets, t) in FAILING {
        let provoked = cases::find(case).unwrap().provokes;
        let found = diagnoses(case, technique, sets, *t);
        let fits = found.iter().filter(|d| provoked.contains(&d.artefact)).count();
        let mut named: Vec<(&str, usize)> = Vec::new();
        for d in &found {
            match named.iter_mut().find(|(id, _)| *id == d.artefact) {
                Some((_, count)) => *count += 1,
                None => named.push((d.artefact, 1)),
            }
        }
        let named: Vec<String> = named.iter().map(|(id, count)| format!("{id} {count}")).collect();
        let told = [&[*technique][..], sets].concat().join(" ");
        println!("| {case} | {told} | {} | {} | {fits} of {} |", provoked.join(", "), named.join(", "), found.len());
        if std::env::var_os("WHY").is_some() {
            found.iter().for_each(|d| println!("{}", d.text()));
        }
        if found.len() < 10 || fits < 8 {
            short.push(format!("{case} with {told}: {fits} of {}", found.len()));
        }
    }
    assert!(short.is_empty(), "{}", short.join("\n"));
}

#[test]
fn every_case_names_artefacts_that_exist_and_is_tried() {
    for case in CASES {
        assert!(!case.provokes.is_empty(), "{}", case.id);
        case.provokes.iter().for_each(|id| assert!(diagnosis::find(id).is_some(), "{}: {id}", case.id));
        assert!(FAILING.iter().any(|(id, ..)| *id == case.id), "{}", case.id);
    }
}

/// A plate of 4 × 4 m that hangs 1 m above a floor, under the zenith sun.
fn plate_above_floor() -> (Renderer, Setup) {
    let mut triangles = floor(Vec2::splat(-8.0), Vec2::splat(8.0), 0.0);
    triangles.extend(floor(Vec2::splat(-2.0), Vec2::splat(2.0), 1.0));
    let view = camera(Vec3::new(0.0, 4.0, 9.0), Vec3::new(0.0, 0.0, 0.0));
    let scene = scene(vec![mesh(&triangles, 0)], vec![material(Vec3::ONE)], view, sun(Vec3::Y));
    start(scene, [160, 120])
}

/// The pixel that sees a place.
fn pixel_of(seen: &Seen, at: Vec3) -> [u32; 2] {
    let away = |p: &[f32; 4]| if p[3] > 0.0 { Vec3::new(p[0], p[1], p[2]).distance(at) } else { f32::INFINITY };
    let nearest = (0..seen.position.len()).min_by(|a, b| away(&seen.position[*a]).total_cmp(&away(&seen.position[*b])));
    seen.pixel(nearest.unwrap())
}

/// On the floor below the plate everything is known: the blocker is 1 m away, the map holds it 1 m before the receiver, the biases are
/// what they were set to, and a texel's footprint is as large as the map's side over its texels.
#[test]
fn a_story_tells_what_closed_forms_say() {
    let (mut r, mut s) = plate_above_floor();
    select(&mut s, "shadow-map", &["fit=scene", "resolution=256", "bias=0.05", "slope_bias=0"]);
    let s = story::judged(&s);
    let seen = Seen::draw(&mut r, &s).unwrap();
    let pixel = pixel_of(&seen, Vec3::new(0.0, 0.0, 1.2));
    let told = story::tell(&mut r, &s, &seen, &[pixel], [1, 1], true).unwrap().remove(0);
    let close = |a: f32, b: f32| (a - b).abs() < 2e-3;
    let hit = told.hit.expect("the plate is in the way");
    assert!(close(hit.distance, 1.0) && close(hit.at[1], 1.0), "{hit:?}");
    assert!(hit.triangle >= 2, "the plate's triangles come last: {hit:?}");
    let map = told.map.as_ref().expect("a map");
    assert!(close(map.receiver_m - map.held_m.unwrap(), 1.0), "{map:?}");
    assert!(close(map.before_plane_m.unwrap(), 1.0) && close(map.slope_m, 0.0), "{map:?}");
    assert!(close(map.bias_m[0], 0.05) && close(map.moved(), 0.05), "{map:?}");
    assert!(close(map.receiver_m - map.compared_m, 0.05), "{map:?}");
    assert!(close(map.footprint_m, 16.0 / 256.0), "{map:?}");
    // The corners lie on the floor, around the pixel's place.
    let place = told.place.unwrap();
    for axis in [0, 2] {
        let along = map.footprint.map(|c| c[axis]);
        let (low, high) =
            (along.iter().copied().fold(f32::MAX, f32::min), along.iter().copied().fold(f32::MIN, f32::max));
        assert!(low <= place[axis] + 1e-3 && place[axis] <= high + 1e-3, "{along:?} around {place:?}");
    }
    assert!(map.footprint.iter().all(|c| c[1].abs() < 1e-4), "{map:?}");
    assert!(told.diagnosis.is_none() && !told.wrong && told.facing, "{}", told.text());
    assert!(told.text().contains("stopped after 1 m"), "{}", told.text());

    // Where nothing is in the way the texel holds the floor itself.
    let lit = pixel_of(&seen, Vec3::new(5.0, 0.0, 3.0));
    let told = story::tell(&mut r, &s, &seen, &[lit], [1, 1], true).unwrap().remove(0);
    let map = told.map.unwrap();
    assert!(told.hit.is_none() && close(map.before_plane_m.unwrap(), 0.0), "{map:?}");
}

/// A bias of more than the plate's height lets the light through, and is named with its parameter; a smaller one mends it.
#[test]
fn a_bias_beyond_the_gap_is_named_and_mended() {
    let (mut r, mut s) = plate_above_floor();
    select(&mut s, "shadow-map", &["fit=scene", "bias=1.5", "slope_bias=0"]);
    let seen = Seen::draw(&mut r, &s).unwrap();
    let pixel = pixel_of(&seen, Vec3::new(0.0, 0.0, 1.2));
    let place = [0, 1].map(|i| (pixel[i] as f32 + 0.5) / seen.size[i] as f32);
    let told = story::at(&mut r, &s, place).unwrap();
    let diagnosis = told.diagnosis.expect("it is wrong");
    assert_eq!(diagnosis.artefact, "detachment", "{}", diagnosis.text());
    assert_eq!(diagnosis.remedies[0].name, "bias", "{}", diagnosis.text());
    let before = diagnosis::measure(&mut r, &s, s.size, place).unwrap();
    let after = diagnosis::measure(&mut r, &diagnosis.remedies[0].applied(&s), s.size, place).unwrap();
    assert!(before.wrong && !after.wrong && after.share < 0.1 * before.share, "{before:?} {after:?}");
}

/// The artefacts named of a set-up's wrong or far-off pixels, every so many of them, with how many each.
fn named(r: &mut Renderer, s: &Setup, every: usize) -> std::collections::BTreeMap<&'static str, usize> {
    let s = story::judged(s);
    let seen = Seen::draw(r, &s).unwrap();
    let p = &seen.pixels;
    let off = |i: usize| (p.visibility[i] - p.mean[i]).abs() > 0.1;
    let bad = (0..p.mask.len()).filter(|i| p.mask[*i] == 2 && (seen.wrong(*i) || off(*i)));
    let chosen: Vec<[u32; 2]> = bad.step_by(every).map(|i| seen.pixel(i)).collect();
    let mut found = std::collections::BTreeMap::new();
    for told in story::tell(r, &s, &seen, &chosen, [1, 1], false).unwrap() {
        if let Some(d) = told.diagnosis {
            *found.entry(d.artefact).or_insert(0) += 1;
        }
    }
    found
}

/// What no case provokes is provoked by parameters: depths of 16 bits on a plane across the light, four rays a pixel to a lamp with a
/// size, and moments of two layers.
#[test]
fn what_parameters_provoke_is_named() {
    let most = |found: &std::collections::BTreeMap<&'static str, usize>, id: &str| {
        let all: usize = found.values().sum();
        let fits = found.get(id).copied().unwrap_or(0);
        assert!(all >= 10 && 5 * fits >= 4 * all, "{id}: {found:?}");
    };
    let (mut r, mut s) = plate_above_floor();
    select(&mut s, "shadow-map", &["fit=scene", "bias_kind=none", "format=16"]);
    most(&named(&mut r, &s, 7), "precision");

    s.light = plate(Vec3::new(0.5, 5.0, 0.3), Vec3::new(0.5, 0.0, 0.3), 1.0);
    select(&mut s, "rt-soft", &["samples=4"]);
    most(&named(&mut r, &s, 7), "noise");
    select(&mut s, "pcf", &["bias=0.01"]);
    most(&named(&mut r, &s, 3), "blur-narrow");

    // The edge of an awning 6 m up falls on a table, whose whole shadow should be dark below.
    let mut triangles = floor(Vec2::splat(-8.0), Vec2::splat(8.0), 0.0);
    triangles.extend(floor(Vec2::splat(-2.0), Vec2::splat(2.0), 0.5));
    triangles.extend(floor(Vec2::new(-7.0, -7.0), Vec2::new(0.3, 7.0), 6.0));
    let view = camera(Vec3::new(3.0, 0.4, 6.0), Vec3::new(0.2, 0.0, 0.0));
    let scene = scene(vec![mesh(&triangles, 0)], vec![material(Vec3::ONE)], view, sun(Vec3::Y));
    let (mut r, mut s) = start(scene, [160, 120]);
    select(&mut s, "vsm", &["fit=scene", "resolution=128", "bleed_reduction=0", "blur_radius=4"]);
    let found = named(&mut r, &s, 3);
    assert!(found.get("bleeding").is_some_and(|n| *n >= 5), "{found:?}");
}

/// What a technique lacks is left out.
#[test]
fn rays_have_no_texels() {
    let (mut r, mut s) = plate_above_floor();
    for technique in ["rt-hard", "shadow-volume"] {
        select(&mut s, technique, &[]);
        let told = story::at(&mut r, &s, [0.5, 0.6]).unwrap();
        assert!(told.map.is_none() && told.texel.is_none() && told.aliasing.is_none(), "{}", told.text());
        assert!(!told.text().contains("map"), "{}", told.text());
    }
}

/// Stories can be told of every technique under a light that it serves; those that look maps up by the common functions tell what these
/// hold.
#[test]
fn every_technique_has_stories() {
    let (mut r, mut s) = plate_above_floor();
    let mut in_maps = Vec::new();
    for info in shadowscope::techniques::ALL.iter() {
        s.light = match info.lights[0] {
            "directional" => sun(Vec3::new(0.3, 1.0, 0.2)),
            "rect-area" => plate(Vec3::new(0.0, 6.0, 0.0), Vec3::ZERO, 0.5),
            _ => lamp(Vec3::new(0.0, 6.0, 0.0)),
        };
        s.size = [64, 48];
        select(&mut s, info.id, &[]);
        let told = story::at(&mut r, &s, [0.5, 0.55]).unwrap_or_else(|e| panic!("{}: {e:#}", info.id));
        let text = told.text();
        assert!(!text.contains("NaN") && !text.contains("inf "), "{}: {text}", info.id);
        assert!(told.facing && told.hit.is_some(), "{}: {text}", info.id);
        if let Some(map) = &told.map {
            assert!(told.texel.is_some() && map.held_m.is_some(), "{}: {text}", info.id);
            in_maps.push(info.id);
        }
    }
    for id in
        ["shadow-map", "pcf", "msm", "pssm", "rtw", "notw", "cube", "ipsm", "edsm", "hybrid-pcf", "backprojection"]
    {
        assert!(in_maps.contains(&id), "{id} is not among {in_maps:?}");
    }
    for id in ["rt-hard", "shadow-volume", "psv", "izb"] {
        assert!(!in_maps.contains(&id), "{id}");
    }
}

struct State {
    model: Model,
    actions: Vec<Action>,
    picture: egui::Rect,
}

/// The window, without one: on the plate under too large a bias.
fn window(size: [f32; 2]) -> (Harness<'static, State>, Renderer) {
    let (r, mut s) = plate_above_floor();
    select(&mut s, "shadow-map", &["fit=scene", "bias=1.5", "slope_bias=0"]);
    let mut model = Model::new(s, r.scene().clone(), r.geometry().bounds);
    model.facts.size = [940, 748];
    model.facts.full = [940, 748];
    let state = State { model, actions: Vec::new(), picture: egui::Rect::NOTHING };
    let built = Harness::builder().with_size([size[0] + 16.0, size[1] + 16.0]).with_accessibility_check(false);
    let mut harness = built.build_ui_state(
        |ui, s: &mut State| {
            ui::apply_style(ui.ctx());
            s.picture = ui::layout(ui, &mut s.model, &mut s.actions);
        },
        state,
    );
    harness.run_steps(4);
    (harness, r)
}

/// Clicks into the picture, at shares of its sides.
fn click_at(harness: &mut Harness<'static, State>, share: [f32; 2], modifiers: egui::Modifiers) {
    let rect = harness.state().picture;
    let pos = rect.min + rect.size() * egui::Vec2::from(share);
    let button = |pressed| egui::Event::PointerButton { pos, button: egui::PointerButton::Primary, pressed, modifiers };
    harness.event(egui::Event::ModifiersChanged(modifiers));
    harness.event(egui::Event::PointerMoved(pos));
    harness.run_steps(1);
    harness.event(button(true));
    harness.run_steps(1);
    harness.event(button(false));
    harness.run_steps(1);
    harness.event(egui::Event::ModifiersChanged(egui::Modifiers::NONE));
    harness.run_steps(3);
}

/// A click after I, or with Alt, pins the pixel, opens its story, and stays where it was pinned though the drawer takes room from the
/// picture; a plain click pins nothing.
#[test]
fn a_click_pins_a_pixel_where_it_lies_in_the_scene() {
    let (mut harness, _) = window([1280.0, 800.0]);
    let shape = |h: &Harness<'static, State>| h.state().picture.width() / h.state().picture.height();
    click_at(&mut harness, [0.3, 0.6], egui::Modifiers::NONE);
    assert_eq!(harness.state().model.drawer, None);
    harness.key_press(egui::Key::I);
    harness.run_steps(2);
    assert!(harness.state().model.inspect.picking);
    let before = shape(&harness);
    click_at(&mut harness, [0.3, 0.6], egui::Modifiers::NONE);
    assert_eq!(harness.state().model.drawer, Some(Tab::Pixel));
    let (after, probe) = (shape(&harness), harness.state().model.setup.probe);
    assert!(after > 1.3 * before, "the drawer takes room: {before} {after}");
    let expected = [0.5 + (0.3 - 0.5) * before / after, 0.6];
    assert!((0..2).all(|i| (probe[i] - expected[i]).abs() < 2e-3), "{probe:?} {expected:?}");
    assert!(harness.state().model.setup.camera == harness.state().model.home, "a click turns nothing");
    click_at(&mut harness, [0.7, 0.4], egui::Modifiers::ALT);
    let probe = harness.state().model.setup.probe;
    assert!((probe[0] - 0.7).abs() < 2e-3 && (probe[1] - 0.4).abs() < 2e-3, "{probe:?}");
    harness.key_press(egui::Key::F6);
    harness.run_steps(3);
    assert_eq!(harness.state().model.drawer, None);
}

/// The drawer tells the story and what would help; a try is one step, and says what it did; Undo takes it back.
#[test]
fn a_change_is_tried_and_taken_back() {
    for size in [[1280.0, 800.0], [760.0, 420.0], [3840.0, 2160.0]] {
        let (mut harness, mut r) = window(size);
        let setup = harness.state().model.setup.clone();
        let seen = Seen::draw(&mut r, &setup).unwrap();
        let pixel = pixel_of(&seen, Vec3::new(0.0, 0.0, 1.2));
        let place = [0, 1].map(|i| (pixel[i] as f32 + 0.5) / seen.size[i] as f32);
        let told = story::at(&mut r, &setup, place).unwrap();
        let remedy = told.diagnosis.as_ref().unwrap().remedies[0].clone();
        harness.state_mut().model.pin(place);
        harness.run_steps(3);
        harness.state_mut().model.inspect.story = Some(Box::new(told));
        harness.run_steps(4);
        for label in ["In the map", "Surface", "detachment (peter-panning)"] {
            harness.get_all_by_label(label).next().unwrap_or_else(|| panic!("{label} at {size:?}"));
        }
        let button = format!("Try {}", remedy.text());
        harness.get_by_label(&button).scroll_to_me();
        harness.run_steps(6);
        harness.get_by_label(&button).click();
        harness.run_steps(3);
        assert_eq!(harness.state().actions, [Action::Try(remedy.clone())]);
        let [before, after] = harness.state_mut().model.begin_try(5, remedy.clone());
        assert_eq!(after.values()["bias"], remedy.to);
        harness.run_steps(3);
        assert!(harness.get_by_label(&button).accesskit_node().is_disabled(), "one at a time");
        let errors = [&before, &after].map(|s| diagnosis::measure(&mut r, s, s.size, place).unwrap());
        harness.state_mut().model.end_try(4, None);
        assert!(harness.state().model.inspect.trying.is_some(), "that was another one's");
        harness.state_mut().model.end_try(5, Some(errors));
        harness.run_steps(3);
        harness.get_by_label("→ right");
        harness.get_by_label("Keep");
        harness.get_all_by_label("Undo").last().unwrap().click();
        harness.run_steps(4);
        let m = &harness.state().model;
        assert_eq!(m.setup.values()["bias"], remedy.from);
        assert!(m.inspect.tried.is_none() && m.history.can_redo(), "it was one step");
    }
}

/// Z shows the magnifier under the pointer, + and − change it; the camera stays while Alt and the wheel do.
#[test]
fn the_magnifier_obeys_its_keys() {
    let (mut harness, _) = window([1280.0, 800.0]);
    harness.key_press(egui::Key::Z);
    harness.run_steps(2);
    let times = |h: &Harness<'static, State>| h.state().model.inspect.magnifier.times;
    assert!(harness.state().model.inspect.magnifier.on && times(&harness) == 8);
    harness.key_press(egui::Key::Plus);
    harness.run_steps(2);
    assert_eq!(times(&harness), 16);
    for _ in 0..6 {
        harness.key_press(egui::Key::Minus);
        harness.run_steps(2);
    }
    assert_eq!(times(&harness), 2);
    let camera = harness.state().model.setup.camera;
    let rect = harness.state().picture;
    harness.event(egui::Event::PointerMoved(rect.center()));
    harness.run_steps(2);
    let wheel = |modifiers| egui::Event::MouseWheel {
        unit: egui::MouseWheelUnit::Line,
        delta: egui::vec2(0.0, 1.0),
        phase: egui::TouchPhase::Move,
        source: egui::MouseWheelSource::Wheel,
        modifiers,
    };
    harness.event(egui::Event::ModifiersChanged(egui::Modifiers::ALT));
    harness.event(wheel(egui::Modifiers::ALT));
    harness.run_steps(1);
    assert_eq!((times(&harness), harness.state().model.setup.camera == camera), (4, true));
}
