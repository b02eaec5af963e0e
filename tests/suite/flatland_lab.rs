//! The flatland lab in the window, without a window and without a device.

use egui::{Modifiers, PointerButton, Pos2, vec2};
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;
use glam::DVec2;
use shadowscope::flatland::{Flatland, Metric};
use shadowscope::scene::geometry::Geometry;
use shadowscope::setup::Setup;
use shadowscope::ui::flatland::{Choice, FIGURES, Found, Lab, Origin, State, random};
use shadowscope::ui::{self, Action, Model};
use std::path::PathBuf;
use std::sync::Arc;

struct Shown {
    model: Model,
    actions: Vec<Action>,
    picture: egui::Rect,
}

type Window = Harness<'static, Shown>;

/// The window with the lab open, 1280 × 800 points.
fn window() -> Window {
    let (setup, scene) = Setup::open("cubes").unwrap();
    let geometry = Geometry::new(&scene, 0, 0.0).unwrap();
    let model = Model::new(setup, Arc::new(scene), geometry.bounds);
    let state = Shown { model, actions: Vec::new(), picture: egui::Rect::NOTHING };
    let builder = Harness::builder().with_size([1296.0, 816.0]).with_accessibility_check(false);
    let mut window = builder.build_ui_state(
        |ui, s: &mut Shown| {
            ui::apply_style(ui.ctx());
            s.picture = ui::layout(ui, &mut s.model, &mut s.actions);
        },
        state,
    );
    window.run_steps(2);
    window.key_press(egui::Key::F5);
    window.run_steps(4);
    window
}

fn lab(w: &Window) -> &Lab {
    &w.state().model.lab
}

fn screen(w: &Window, p: DVec2) -> Pos2 {
    lab(w).screen(p).expect("the point is drawn")
}

/// Presses at a place, moves to another, and lets go.
fn drag(w: &mut Window, from: Pos2, to: Pos2) {
    w.hover_at(from);
    w.run_steps(2);
    w.drag_at(from);
    w.run_steps(2);
    for t in [0.3, 0.7, 1.0] {
        w.hover_at(from + (to - from) * t);
        w.run_steps(2);
    }
    w.drop_at(to);
    w.run_steps(3);
}

fn click(w: &mut Window, label: &str) {
    w.get_all_by_label(label).next().unwrap().scroll_to_me();
    w.run_steps(6);
    w.get_all_by_label(label).next().unwrap().click();
    w.run_steps(3);
}

fn handle(w: &Window, label: &str) -> Pos2 {
    w.get_by_role_and_label(egui::accesskit::Role::Button, label).rect().center()
}

fn undo(w: &mut Window) {
    w.key_press_modifiers(Modifiers::COMMAND, egui::Key::Z);
    w.run_steps(3);
}

fn figure(number: &str) -> State {
    FIGURES.iter().find(|f| f.name.starts_with(number)).unwrap().state()
}

fn take(w: &mut Window, state: State) {
    w.state_mut().model.lab.take(state);
    w.run_steps(4);
}

fn found(state: &State) -> Found {
    let mut found = Found::default();
    found.update(state);
    found
}

/// The largest footprint over the smallest.
fn spread(footprints: impl Iterator<Item = f64>) -> f64 {
    let (low, high) = footprints.fold((f64::INFINITY, 0f64), |(a, b), x| (a.min(x), b.max(x)));
    high / low
}

#[test]
fn a_key_opens_the_lab_and_escape_leaves_it() {
    let mut w = window();
    assert!(lab(&w).shown);
    assert!(!w.state().picture.is_positive(), "the scene's picture has no room in the lab");
    let setup = w.state().model.setup.clone();
    // Keys of the scene mean nothing here.
    for key in [egui::Key::Num3, egui::Key::F, egui::Key::W, egui::Key::Space] {
        w.key_press(key);
        w.run_steps(2);
    }
    assert_eq!(w.state().model.setup, setup);
    w.key_press(egui::Key::Escape);
    w.run_steps(3);
    assert!(!lab(&w).shown && w.state().picture.is_positive());
    click(&mut w, "Flatland");
    assert!(lab(&w).shown);
    click(&mut w, "Leave");
    assert!(!lab(&w).shown);
}

#[test]
fn a_segment_is_drawn_moved_deleted_and_undone() {
    let mut w = window();
    let before = lab(&w).now.world.clone();
    let ends = [DVec2::new(5.0, 1.0), DVec2::new(7.0, 3.5)];
    w.key_press(egui::Key::D);
    w.run_steps(2);
    assert!(lab(&w).drawing);
    let [a, b] = ends.map(|p| screen(&w, p));
    drag(&mut w, a, b);
    let drawn = lab(&w).now.world.segments.clone();
    assert_eq!(drawn.len(), before.segments.len() + 1);
    for (p, q) in drawn[1].iter().zip(ends) {
        // Within a point of where the pointer was.
        assert!(screen(&w, *p).distance(screen(&w, q)) < 1.0, "{p}, not {q}");
    }
    w.key_press(egui::Key::Escape);
    w.run_steps(2);
    assert!(!lab(&w).drawing && lab(&w).shown, "Escape lays the pen down first");
    let (from, by) = (handle(&w, "segment 2 end"), vec2(30.0, -20.0));
    drag(&mut w, from, from + by);
    let moved = lab(&w).now.world.segments[1];
    assert!(moved[0] == drawn[1][0] && screen(&w, moved[1]).distance(from + by) < 1.5, "{moved:?}");
    w.key_press(egui::Key::Delete);
    w.run_steps(3);
    assert_eq!(lab(&w).now.world, before);
    undo(&mut w);
    assert_eq!(lab(&w).now.world.segments[1], moved, "a drag is one step");
    undo(&mut w);
    assert_eq!(lab(&w).now.world.segments, drawn);
    undo(&mut w);
    assert_eq!(lab(&w).now.world, before);
    w.key_press_modifiers(Modifiers::COMMAND, egui::Key::Y);
    w.run_steps(3);
    assert_eq!(lab(&w).now.world.segments, drawn);
}

#[test]
fn eye_view_and_light_follow_the_pointer() {
    let mut w = window();
    let by = vec2(40.0, 30.0);
    let light = screen(&w, lab(&w).now.world.light) + by;
    let from = handle(&w, "light");
    drag(&mut w, from, from + by);
    assert!(screen(&w, lab(&w).now.world.light).distance(light) < 1.5);
    let eye = screen(&w, lab(&w).now.world.eye) - by;
    let from = handle(&w, "eye");
    drag(&mut w, from, from - by);
    assert!(screen(&w, lab(&w).now.world.eye).distance(eye) < 1.5);
    let (gaze, fov) = (lab(&w).now.world.gaze, lab(&w).now.world.fov);
    let from = handle(&w, "gaze");
    drag(&mut w, from, from - vec2(0.0, 20.0));
    assert!(lab(&w).now.world.gaze > gaze + 0.1, "the view looks higher");
    let from = handle(&w, "field of view");
    drag(&mut w, from, from - vec2(0.0, 20.0));
    assert!(lab(&w).now.world.fov > fov + 0.1 && lab(&w).now.world.fov < 3.0, "the view is wider");
}

/// Turned by hand on the ground and in the chart, and set to the best by a click.
#[test]
fn the_film_is_turned_and_its_best_angle_taken() {
    let mut w = window();
    let start = lab(&w).now.normal;
    let from = handle(&w, "film line");
    drag(&mut w, from, from + vec2(25.0, 60.0));
    assert!(lab(&w).now.film == Choice::Hand && (lab(&w).now.normal - start).abs() > 0.05);
    let chart = w.get_by_label("film's angle").rect();
    drag(&mut w, chart.center(), chart.center() + vec2(60.0, 0.0));
    let film = lab(&w).found.film.clone().unwrap();
    let by_hand = lab(&w).now.normal;
    assert!(lab(&w).now.film == Choice::Hand && film.is_valid(by_hand));
    let least = film.least(Metric::L1).normal;
    assert!(film.badness(by_hand).mean > film.badness(least).mean);
    click(&mut w, "least average (L1)");
    assert_eq!(lab(&w).now.film, Choice::Least(Metric::L1));
    assert_eq!(lab(&w).found.chosen.as_ref().unwrap().normal, least);
    undo(&mut w);
    assert_eq!((lab(&w).now.film, lab(&w).now.normal), (Choice::Hand, by_hand));
    // From the best on it is turned on.
    click(&mut w, "least worst (L∞)");
    click(&mut w, "by hand");
    let worst = film.least(Metric::Max).normal;
    assert!((lab(&w).found.chosen.as_ref().unwrap().normal - worst).abs() < 1e-3);
}

#[test]
fn a_world_is_saved_and_opened() {
    let mut w = window();
    w.key_press(egui::Key::D);
    w.run_steps(2);
    let [a, b] = [DVec2::new(4.0, 0.5), DVec2::new(6.0, 2.0)].map(|p| screen(&w, p));
    drag(&mut w, a, b);
    let saved = lab(&w).now.world.clone();
    w.key_press_modifiers(Modifiers::COMMAND, egui::Key::S);
    w.run_steps(2);
    assert_eq!(w.state().actions, [Action::SaveWorld(PathBuf::from("world.toml"))]);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("drawn.toml");
    lab(&w).save(&path).unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    assert!(shadowscope::flatland::file::is_world(&text));
    let read = Flatland::from_toml(&text).unwrap();
    assert_eq!(read, saved);
    // Over another world, as a step.
    take(&mut w, random(3));
    let other = lab(&w).now.clone();
    w.state_mut().model.show_world(&path, read);
    w.run_steps(3);
    assert_eq!((&lab(&w).now.world, lab(&w).now.origin), (&saved, Origin::Own));
    assert!(lab(&w).path.ends_with("drawn.toml"));
    undo(&mut w);
    assert_eq!(lab(&w).now, other);
    assert!(lab(&w).save(&folder.path().join("no/such\0name.toml")).is_err());
}

/// A set-up is not taken for a world.
#[test]
fn a_set_up_is_no_world() {
    let (setup, _) = Setup::open("cubes").unwrap();
    let text = setup.to_toml(std::path::Path::new("cubes.toml")).unwrap();
    assert!(!shadowscope::flatland::file::is_world(&text));
}

/// Each figure opens, in its space, and says so; nothing is as wide as to push the world away.
#[test]
fn every_figure_opens() {
    let mut w = window();
    for (i, f) in FIGURES.iter().enumerate() {
        take(&mut w, f.state());
        let (now, found) = (&lab(&w).now, &lab(&w).found);
        assert_eq!(now.origin, Origin::Figure(i));
        assert!(found.chosen.is_some() && found.seen.len() * 2 >= now.world.pixels, "{}", f.name);
        w.get_by_label(f.text);
        let side = w.get_by_label("Leave").rect();
        assert!(side.right() <= 1288.0 && side.left() > 900.0, "{}: {side:?}", f.name);
        for row in ["by hand", "least average (L1)", "common (half angle)", "perspective, near line"] {
            assert!(w.get_by_label(row).rect().right() <= 1288.0);
        }
    }
}

#[test]
fn figure_1_5_crowds_lexels_where_the_film_turns() {
    let state = figure("1.5");
    let first = found(&state);
    let film = first.film.clone().unwrap();
    assert!(spread(first.seen.iter().map(|s| s.footprint)) > 2.0);
    // Turned past the best, the other end of the floor has the small footprints.
    let other = State { normal: 2.0 * film.least(Metric::L1).normal - state.normal, ..state.clone() };
    let ends = |f: &Found| f.seen[0].footprint / f.seen[f.seen.len() - 1].footprint;
    assert!((ends(&first) < 1.0) != (ends(&found(&other)) < 1.0));
}

#[test]
fn figure_2_1_is_even_all_over_the_floor() {
    let state = figure("2.1");
    assert!(spread(found(&state).seen.iter().map(|s| s.footprint)) < 1.0 + 1e-6);
    for light in [DVec2::new(1.0, 5.0), DVec2::new(9.0, 12.0)] {
        let moved = State { world: Flatland { light, ..state.world.clone() }, ..state.clone() };
        assert!(spread(found(&moved).seen.iter().map(|s| s.footprint)) < 1.0 + 1e-6);
    }
    // Another film is not.
    let common = State { film: Choice::Common, ..state };
    assert!(spread(found(&common).seen.iter().map(|s| s.footprint)) > 1.5);
}

#[test]
fn figure_2_2_is_even_within_each_polygon() {
    let state = figure("2.2");
    let found = found(&state);
    // It is the film of a perspective shadow map, as the texels lie.
    let texels = found.row(Choice::Texels).unwrap().normal;
    assert!((texels - state.world.gaze).abs() < 1e-6 && (found.chosen.as_ref().unwrap().normal - texels).abs() < 1e-6);
    let of = |i: usize| found.seen.iter().filter(move |s| s.segment == i).map(|s| s.footprint);
    let all: Vec<f64> = (0..state.world.segments.len()).filter_map(|i| of(i).next()).collect();
    assert!(all.len() >= 3, "polygons are seen: {all:?}");
    for i in 0..state.world.segments.len() {
        if of(i).next().is_some() {
            assert!(spread(of(i)) < 1.0 + 1e-6, "segment {i}");
        }
    }
    let between = spread(all.iter().copied());
    assert!((between - 5.5).abs() < 0.1, "and differ from each other: {all:?}");
}

#[test]
fn figure_2_3_turns_the_near_line_and_not_the_texels() {
    let state = figure("2.3");
    let angles = |push: f64| {
        let found = found(&State { push, ..state.clone() });
        [Choice::NearLine, Choice::Texels].map(|c| found.row(c).unwrap().angle)
    };
    let [far, near] = [angles(0.3), angles(1.0)];
    assert!((far[0] - near[0]).abs() > 1.0, "{far:?}, {near:?}");
    assert!((far[1] - near[1]).abs() < 1e-6);
}

#[test]
fn figure_4_1_adds_little_from_ten_samples() {
    let state = figure("4.1");
    let found = found(&state);
    assert!(found.added.len() > 20 && found.added[0].0 == 5 && found.added.last().unwrap().0 == 1000);
    for (count, added) in &found.added {
        assert!(added.iter().all(|a| *a > -1e-3), "{count}: {added:?}");
        // A thousand are all.
        let most = if *count == 1000 {
            1e-6
        } else if *count >= 10 {
            0.05
        } else {
            0.5
        };
        assert!(added[0] < most, "{count}: {added:?}");
    }
    // As docs/flatland.md has them.
    let of = |count: usize| found.added.iter().find(|a| a.0 == count).unwrap().1;
    for (count, told) in [(5, [0.036, 0.093]), (10, [0.0004, 0.014])] {
        let near = of(count).iter().zip(told).all(|(a, told)| (a - told).abs() < 0.06 * told + 5e-5);
        assert!(near, "{count}: {:?}, not {told:?}", of(count));
    }
    // The chosen film is that from the few.
    let whole = found.film.as_ref().unwrap().least(Metric::L1).normal;
    assert!(found.chosen.as_ref().unwrap().normal != whole);
}

/// More frusta, less error; the bar shares out all lexels.
#[test]
fn frusta_share_the_lexels() {
    let state = State { frusta: 2, ..figure("scene: projection") };
    let found = found(&state);
    assert_eq!(found.parts.len(), 2);
    assert_eq!(found.parts.iter().map(|p| p.lexels).sum::<usize>(), state.world.lexels);
    let (one, two) = (found.chosen.as_ref().unwrap().average, found.split.unwrap().mean);
    assert!(two * 2.0 < one, "{two}, {one}");
    let seen = found.seen.iter().map(|s| s.footprint).sum::<f64>() / found.seen.len() as f64;
    assert!((seen / two - 1.0).abs() < 1e-9, "the colours are those of the parts");
}

/// Through the wheel and a drag the world moves under the pointer, in both spaces.
#[test]
fn the_ground_pans_and_zooms() {
    for post in [false, true] {
        let mut w = window();
        let mut state = figure("2.3");
        state.show.post = post;
        take(&mut w, state);
        let p = lab(&w).found.film.as_ref().unwrap().samples[40].point;
        let at = screen(&w, p);
        w.hover_at(at);
        w.run_steps(2);
        w.event(egui::Event::MouseWheel {
            unit: egui::MouseWheelUnit::Point,
            delta: vec2(0.0, 120.0),
            phase: egui::TouchPhase::Move,
            source: egui::MouseWheelSource::Wheel,
            modifiers: Modifiers::NONE,
        });
        w.run_steps(12);
        assert!(screen(&w, p).distance(at) < 1.0, "what lies under the pointer stays");
        let from = at + vec2(-60.0, -90.0);
        w.hover_at(from);
        w.event(egui::Event::PointerButton {
            pos: from,
            button: PointerButton::Middle,
            pressed: true,
            modifiers: Modifiers::NONE,
        });
        w.run_steps(2);
        w.hover_at(from + vec2(50.0, 10.0));
        w.run_steps(2);
        w.event(egui::Event::PointerButton {
            pos: from + vec2(50.0, 10.0),
            button: PointerButton::Middle,
            pressed: false,
            modifiers: Modifiers::NONE,
        });
        w.run_steps(2);
        assert!(screen(&w, p).distance(at + vec2(50.0, 10.0)) < 1.5, "the ground follows the pointer");
    }
}

/// Worlds by chance, worlds in which nothing is seen, lights behind, on and before the view's plane: all are drawn.
#[test]
fn nothing_breaks() {
    let mut w = window();
    for number in 1..6 {
        let mut state = random(number);
        state.show.post = number % 2 == 0;
        state.frusta = number as usize % 4 + 1;
        take(&mut w, state);
    }
    let base = figure("2.1");
    let eye = base.world.eye;
    let (forward, side) = (base.world.forward(), base.world.forward().perp());
    for light in [eye + side * 5.0, eye - forward * 3.0 + side * 4.0, eye, DVec2::new(6.0, 0.0), DVec2::new(6.0, -2.0)]
    {
        for post in [false, true] {
            let mut state = State { world: Flatland { light, ..base.world.clone() }, ..base.clone() };
            state.show.post = post;
            take(&mut w, state.clone());
            state.world.segments.clear();
            state.film = Choice::Common;
            take(&mut w, state);
            assert!(lab(&w).found.film.is_none());
        }
    }
    w.set_size(egui::vec2(500.0, 320.0));
    w.run_steps(4);
    w.set_size(egui::vec2(3840.0, 2160.0));
    w.run_steps(4);
}
