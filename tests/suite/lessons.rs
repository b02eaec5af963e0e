//! Lessons are as they say, by what is measured; the start screen, the card, recent files, glossary and gallery.

use crate::common::{gpu, ok, shadowscope};
use crate::panel::{State, click, harness};
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;
use shadowscope::lessons::claim::Whose;
use shadowscope::lessons::{self, Lesson, Measured};
use shadowscope::scene::geometry::Geometry;
use shadowscope::setup::Setup;
use shadowscope::ui::{self, Action, Recent, recent};
use shadowscope::{gallery, glossary};
use std::path::Path;
use std::sync::Arc;

fn docs(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs").join(name);
    std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// Whether two pages are the same but for figures that another driver rounds otherwise.
fn alike(a: &str, b: &str) -> Result<(), String> {
    let words = |text: &str| text.split_whitespace().map(String::from).collect::<Vec<_>>();
    let (a, b) = (words(a), words(b));
    for (x, y) in a.iter().zip(&b) {
        let near = || {
            let (x, y) = (x.parse::<f64>().ok()?, y.parse::<f64>().ok()?);
            Some((x - y).abs() <= 0.03 + 0.08 * x.abs().max(y.abs()))
        };
        if x != y && near() != Some(true) {
            return Err(format!("{x} is not {y}"));
        }
    }
    if a.len() == b.len() { Ok(()) } else { Err(format!("{} words are not {}", a.len(), b.len())) }
}

/// Walks a lesson: each claim of each step holds by what is measured, each question has one right answer, and the page in the docs says
/// what is measured.
fn holds(lesson: &Lesson) {
    let measured = lessons::walk(&gpu(), lesson, &mut |_, _| ()).unwrap();
    for (i, (step, found)) in lesson.steps.iter().zip(&measured).enumerate() {
        let name = format!("{}, step {}", lesson.id, i + 1);
        assert!(!step.expect.is_empty() || step.question.is_some(), "{name} claims nothing");
        for claim in &step.expect {
            let values: Vec<String> = claim.quantities().map(|q| format!("{q} = {:?}", found.value(*q))).collect();
            assert_eq!(claim.holds(&|q| found.value(q)), Some(true), "{name}: {claim}, but {}", values.join(", "));
        }
        if let Some(question) = &step.question {
            let right: Vec<&str> =
                question.choices.iter().filter(|c| found.all_hold(&c.holds)).map(|c| c.text.as_str()).collect();
            assert!(question.choices.is_empty() || right.len() == 1, "{name}: the right answers are {right:?}");
            let column = question.measure.column;
            if !column.is_time() && !column.is_multiple() {
                assert!(found.value(question.measure).is_some(), "{name}: {} is not measured", question.measure);
            }
        }
        if let Some(trial) = step.trial.as_ref().filter(|t| t.scene.is_some()) {
            let choices = step.question.iter().flat_map(|q| &q.choices).flat_map(|c| &c.holds);
            let told = step.expect.iter().chain(choices).flat_map(|c| c.quantities()).any(|q| q.whose == Whose::Tried);
            assert!(told, "{name}: nothing is claimed of what there is to try");
            // What the control is of is all that changes.
            let [here, tried] = [Whose::Here, Whose::Tried].map(|w| found.of(w).unwrap().setup().unwrap());
            if let Some(parameter) = trial.control.strip_prefix("parameter:") {
                let kept = |mut s: Setup| {
                    s.params.values_mut().for_each(|values| _ = values.remove(parameter));
                    s
                };
                assert_ne!(here.values().get(parameter), tried.values().get(parameter), "{name}");
                assert_eq!(kept(here), kept(tried), "{name}: {} changes more than {parameter}", trial.text);
            }
        }
    }
    let page = lessons::page(lesson, &measured);
    let told = docs(&format!("lessons/{}.md", lesson.id));
    alike(&page, &told)
        .unwrap_or_else(|e| panic!("docs/lessons/{0}.md: {e}; shadowscope lesson {0} writes it", lesson.id));
}

/// Two tests, for two cores.
#[test]
fn what_lessons_say_is_measured_first_half() {
    lessons::embedded().unwrap().iter().step_by(2).for_each(holds);
}

#[test]
fn what_lessons_say_is_measured_second_half() {
    lessons::embedded().unwrap().iter().skip(1).step_by(2).for_each(holds);
}

#[test]
fn a_claim_that_does_not_hold_is_found_out() {
    let text = "title = 'T'\nsee = 'S'\n[[steps]]\ntitle = 'A'\ntext = 'x'\nexpect = ['acne_share > 5 %', 'acne_share < 5 %']\n\
                [steps.setup]\nscene = 'cubes'\nsize = [64, 36]\nparams.shadow-map = { bias_kind = 'none' }\n\
                [[steps]]\ntitle = 'B'\ntext = 'y'\nexpect = ['acne_share < 0.2 * before.acne_share']\n\
                [steps.setup]\nparams.shadow-map = { bias_kind = 'slope' }\n";
    let lesson = lessons::read("own", text, Path::new("")).unwrap();
    let measured = lessons::walk(&gpu(), &lesson, &mut |_, _| ()).unwrap();
    let held = |i: usize, found: &Measured| -> Vec<Option<bool>> {
        lesson.steps[i].expect.iter().map(|c| c.holds(&|q| found.value(q))).collect()
    };
    assert_eq!(held(0, &measured[0]), [Some(true), Some(false)]);
    assert_eq!(held(1, &measured[1]), [Some(true)], "a step keeps what it does not change, but for the bias");
}

#[test]
fn lessons_that_cannot_be_used_are_refused_by_step_and_key() {
    let refused = |step: &str, why: &str| {
        let text = format!(
            "title = 'T'\nsee = 'S'\n[[steps]]\ntitle = 'A'\ntext = 'x'\n{step}\n[steps.setup]\nscene = 'cubes'\n"
        );
        let said = format!("{:#}", lessons::read("own", &text, Path::new("")).unwrap_err());
        assert!(said.contains(why), "{said}");
    };
    refused("expect = ['acne > 5']", "step 1: expect: \"acne > 5\" cannot be read: acne: there is no such column");
    refused("expect = ['before.acne_share > 5']", "no step stands before the first");
    refused("expect = ['tried.acne_share > 5']", "nothing to try");
    refused("expect = ['b.acne_share > 5']", "the comparison has 1 sides");
    refused("expect = ['gpu_ms > 5']", "times differ from machine to machine");
    refused("drawer = 'kitchen'", "drawer = kitchen is not allowed");
    refused("colour = 'red'", "unknown field `colour`");
    refused("try = { text = 't', control = 'knob' }", "control = \"knob\" is not allowed");
    refused(
        "question = { ask = 'q', measure = 'error_share', choices = [{ text = 'a', holds = [] }] }",
        "a choice of one",
    );
    let none = lessons::read("own", "title = 'T'\nsee = 'S'\nsteps = []", Path::new(""));
    assert!(format!("{:#}", none.unwrap_err()).contains("it has 0 steps"));
}

#[test]
fn a_folder_of_ones_own_is_read_and_its_faults_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let said = |folder: &Path| format!("{:#}", lessons::of_folder(folder).unwrap_err());
    assert!(said(folder.path()).contains("holds no lessons"));
    assert!(said(&folder.path().join("nowhere")).contains("cannot be read"));
    let one = "title = 'Mine'\nsee = 'S'\n[[steps]]\ntitle = 'A'\ntext = 'x'\n[steps.setup]\nscene = 'cubes'\n";
    std::fs::write(folder.path().join("mine.toml"), one).unwrap();
    assert_eq!(lessons::of_folder(folder.path()).unwrap()[0].id, "mine");
    let listed = ok(folder.path(), &["--lessons", ".", "list", "lessons"]).stdout;
    assert_eq!(String::from_utf8_lossy(&listed), "mine  Mine: 1 steps\n");
    std::fs::write(folder.path().join("bad.toml"), "title = 3").unwrap();
    let out = shadowscope(folder.path(), &["--lessons", ".", "list", "lessons"]);
    let message = String::from_utf8_lossy(&out.stderr).into_owned();
    assert!(!out.status.success() && message.contains("bad.toml is no usable lesson"), "{message}");
}

#[test]
fn the_command_line_lists_lessons_and_prints_set_ups() {
    let folder = tempfile::tempdir().unwrap();
    let listed = String::from_utf8(ok(folder.path(), &["list", "lessons"]).stdout).unwrap();
    assert!(listed.lines().count() >= 11 && listed.contains("staircases"), "{listed}");
    let toml = ok(folder.path(), &["lesson", "acne", "--setup", "2"]).stdout;
    std::fs::write(folder.path().join("acne.toml"), toml).unwrap();
    let (setup, _) = Setup::open(&folder.path().join("acne.toml").to_string_lossy()).unwrap();
    assert_eq!((setup.scene.as_str(), setup.view.as_str()), ("cubes", "causes"));
    for (args, why) in [
        (&["lesson", "sewing"][..], "sewing: there is no such lesson; there are staircases"),
        (&["lesson", "acne", "--setup", "9"], "acne has the steps 1 to 5"),
    ] {
        let out = shadowscope(folder.path(), args);
        let message = String::from_utf8_lossy(&out.stderr).into_owned();
        assert!(!out.status.success() && message.contains(why), "{message}");
    }
    let printed = ok(folder.path(), &["glossary"]).stdout;
    assert_eq!(String::from_utf8_lossy(&printed), docs("glossary.md"), "shadowscope glossary writes docs/glossary.md");
}

#[test]
fn the_glossary_is_whole() {
    let terms = glossary::all();
    assert!(terms.len() >= 60, "{}", terms.len());
    let mut names: Vec<String> =
        terms.iter().flat_map(|t| t.also.iter().chain([&t.term])).map(|n| n.to_lowercase()).collect();
    names.sort_unstable();
    let doubled = names.windows(2).find(|pair| pair[0] == pair[1]);
    assert_eq!(doubled, None);
    for term in terms {
        assert!(term.text.trim().ends_with('.') && term.text.len() > 30, "{}", term.term);
        for page in &term.read {
            let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs").join(page);
            assert!(path.is_file(), "{}: there is no docs/{page}", term.term);
        }
    }
    use glossary::Piece::{Code, Term, Text};
    assert_eq!(
        glossary::pieces("Two Texels, then `texel`, then texels; pretexel"),
        [Text("Two "), Term("Texels", "texel"), Text(", then "), Code("texel"), Text(", then texels; pretexel")]
    );
    assert_eq!(
        glossary::pieces("slope-scaled bias")[..],
        [Term("slope-scaled bias", "slope-scaled bias")],
        "the longest word counts"
    );
}

#[test]
fn every_set_up_of_the_gallery_opens() {
    assert!(gallery::all().len() >= 12);
    for exhibit in gallery::all() {
        assert!(!exhibit.title.is_empty() && exhibit.about.ends_with('.'), "{}", exhibit.id);
        let (setup, _) = exhibit.open().unwrap();
        for side in 0..setup.sides() {
            let refused = setup.info(side).and_then(|info| setup.refusal(info));
            assert_eq!(refused, None, "{}", exhibit.id);
        }
    }
}

/// What the window does when the scene of a step has been loaded.
fn deliver(harness: &mut Harness<'static, State>) {
    let actions = std::mem::take(&mut harness.state_mut().actions);
    let model = &mut harness.state_mut().model;
    if actions.contains(&Action::Step) {
        let running = model.lesson.as_ref().unwrap();
        let (setup, scene) = running.lesson.steps[running.step].scene.open().unwrap();
        let bounds = Geometry::new(&scene, 0, 0.0).unwrap().bounds;
        assert!(model.awaits(&setup));
        model.arrive(setup, Arc::new(scene), bounds);
    }
    harness.run_steps(16);
}

fn start_screen(harness: &mut Harness<'static, State>) {
    harness.state_mut().model.toggle_start();
    harness.run_steps(4);
}

/// One click on a tile shows a lesson's first set-up, which is the one that the claims above are measured of.
#[test]
fn one_click_from_the_start_screen_to_each_lesson() {
    let mut harness = harness("cubes", 1400.0);
    start_screen(&mut harness);
    assert_eq!(harness.state().picture, egui::Rect::NOTHING, "no picture is drawn behind it");
    for lesson in lessons::all() {
        harness.state_mut().model.start.shown = true;
        harness.run_steps(3);
        let tile = harness.query_all_by_label(&lesson.title).next().expect("a tile");
        tile.click();
        harness.run_steps(3);
        deliver(&mut harness);
        let model = &harness.state().model;
        let running = model.lesson.as_ref().expect("the lesson runs");
        assert_eq!((running.lesson.id.as_str(), running.step, model.start.shown), (lesson.id.as_str(), 0, false));
        let (planned, _) = lesson.steps[0].scene.open().unwrap();
        assert_eq!(Setup { size: model.setup.size, ..planned }, model.setup, "{}", lesson.id);
        harness.get_by_label(&format!("Step 1 of {}", lesson.steps.len()));
    }
}

/// Every control that a lesson names is there, in view, and framed, in a window of 1280 × 800 points.
#[test]
fn every_control_is_framed_and_in_view() {
    let mut harness = harness("cubes", 800.0);
    for lesson in lessons::all() {
        for (i, step) in lesson.steps.iter().enumerate() {
            let action = harness.state_mut().model.begin(lesson, i);
            harness.state_mut().actions.extend(action);
            harness.run_steps(2);
            deliver(&mut harness);
            let Some(trial) = step.trial.as_ref().filter(|t| t.control != "picture") else { continue };
            let place = ui::marked_place(&harness.ctx);
            let name = format!("{}, step {}: {}", lesson.id, i + 1, trial.control);
            let place = place.unwrap_or_else(|| panic!("{name} is not there"));
            let window = egui::Rect::from_min_size(egui::pos2(8.0, 8.0), egui::vec2(1280.0, 800.0));
            assert!(window.expand(2.0).contains_rect(place), "{name} is at {place:?}");
            harness.ctx.data_mut(|d| d.remove::<egui::Rect>(egui::Id::unique("marked place")));
        }
    }
}

#[test]
fn the_card_leads_on_resets_and_can_be_left() {
    let mut harness = harness("st-corner", 800.0);
    let lesson = lessons::find("staircases").unwrap();
    let action = harness.state_mut().model.begin(lesson, 0);
    assert_eq!(action, None, "the scene is open: nothing is loaded");
    harness.run_steps(16);
    let first = harness.state().model.setup.clone();
    let picture = harness.state().picture;
    harness.state_mut().model.lesson.as_mut().unwrap().answer = Some(lessons::Answer::default());
    click(&mut harness, "Next");
    assert_eq!(harness.state().model.setup.view, "texels");
    assert_eq!(harness.state().picture, picture, "the layout does not jump");
    assert!(harness.state().model.lesson.as_ref().unwrap().answer.is_none());
    click(&mut harness, "Back");
    let kept = harness.state_mut().model.lesson.as_mut().unwrap().answer.take();
    assert!(kept.is_some(), "what was measured is gone");
    assert_eq!(harness.state().model.setup, first);
    // Whoever changes something gets back.
    harness.state_mut().model.setup.view = "depth".into();
    harness.run_steps(2);
    click(&mut harness, "Step's set-up");
    assert_eq!(harness.state().model.setup, first);
    // Undo goes across steps.
    click(&mut harness, "Undo");
    assert_eq!(harness.state().model.setup.view, "depth");
    click(&mut harness, "Measure");
    assert!(harness.state().actions.contains(&Action::Answer));
    click(&mut harness, "Leave");
    assert!(harness.state().model.lesson.is_none());
    assert!(harness.state().picture.width() > picture.width());
}

/// An answer shows what was guessed and what was measured.
#[test]
fn an_answer_is_measured_and_shown() {
    let mut harness = harness("st-corner", 800.0);
    let lesson = lessons::find("staircases").unwrap();
    harness.state_mut().model.begin(lesson, 1);
    harness.run_steps(16);
    harness.state_mut().model.setup.set("resolution=200", &["shadow-map".into()]).unwrap();
    let own = harness.state().model.own_of_step().expect("another set-up");
    assert_eq!(own.size, [320, 180], "measured as the step is");
    let scene = harness.state().model.scene.clone();
    let renderer = shadowscope::frame::Renderer::new(gpu(), scene).unwrap();
    let answer = lessons::answer(renderer, lesson, 1, Some(own), &mut |_, _| ()).unwrap();
    assert_eq!(answer.right, Some(1), "half");
    let [here, tried] = [Whose::Here, Whose::Tried].map(|w| answer.measured.of(w).unwrap().error_share);
    let own = answer.own.as_ref().unwrap().error_share;
    assert!(tried < own && own < here, "{tried} < {own} < {here}");
    harness.state_mut().model.lesson.as_mut().unwrap().answer = Some(answer);
    harness.run_steps(3);
    for label in ["as the step begins", "after the try", "as you have it"] {
        harness.get_by_label(label);
    }
    let right = format!("right: {}", lesson.steps[1].question.as_ref().unwrap().choices[1].text);
    harness.get_by_label(&right);
}

#[test]
fn the_start_screen_is_left_by_escape_and_brought_back() {
    let mut harness = harness("cubes", 800.0);
    let shown = |h: &Harness<'static, State>| h.state().model.start.shown;
    harness.key_press(egui::Key::F8);
    harness.run_steps(3);
    assert!(shown(&harness));
    assert!(harness.state().actions.contains(&Action::LookUpRecent));
    harness.key_press(egui::Key::Escape);
    harness.run_steps(3);
    assert!(!shown(&harness));
    start_screen(&mut harness);
    click(&mut harness, "Explore freely");
    assert!(!shown(&harness));
    // A small window scrolls, and nothing is wider than it.
    harness.set_size(egui::vec2(380.0, 400.0));
    start_screen(&mut harness);
    let tile = harness.query_all_by_label("Acne").next().unwrap().rect();
    assert!(tile.left() >= 8.0 && tile.right() <= 372.0, "{tile:?}");
    // By keys: Tab to a tile, arrows to the next, Enter.
    harness.set_size(egui::vec2(1296.0, 816.0));
    harness.run_steps(3);
    harness.query_all_by_label(&lessons::all()[0].title).next().unwrap().focus();
    harness.run_steps(2);
    harness.key_press(egui::Key::ArrowRight);
    harness.run_steps(3);
    harness.key_press(egui::Key::Enter);
    harness.run_steps(3);
    assert_eq!(
        harness.state().model.lesson.as_ref().map(|r| r.lesson.id.as_str()),
        Some(lessons::all()[1].id.as_str())
    );
}

/// In a narrow window the card is a strip under the picture, with all that leads on in view.
#[test]
fn a_narrow_window_has_the_card_below() {
    let mut harness = harness("st-corner", 600.0);
    harness.set_size(egui::vec2(736.0, 616.0));
    harness.state_mut().model.begin(lessons::find("staircases").unwrap(), 0);
    harness.run_steps(16);
    let (picture, next) = (harness.state().picture, harness.get_by_label("Next").rect());
    assert!(picture.height() > 150.0 && picture.width() > 150.0, "{picture:?}");
    assert!(next.top() > picture.bottom() && next.bottom() < 608.0, "{next:?}");
}

#[test]
fn a_missing_recent_file_says_so_and_opens_nothing() {
    let mut harness = harness("cubes", 1800.0);
    start_screen(&mut harness);
    let file = |name: &str, missing: Option<&str>| Recent { name: name.into(), missing: missing.map(String::from) };
    harness.state_mut().model.start.recent =
        Some(Ok(vec![file("/a/there.glb", None), file("/a/gone.glb", Some("there is no such file"))]));
    harness.run_steps(2);
    click(&mut harness, "gone.glb");
    harness.get_by_label("/a: there is no such file");
    let opened = |h: &Harness<'static, State>| h.state().actions.iter().any(|a| matches!(a, Action::Open(_)));
    assert!(!opened(&harness));
    click(&mut harness, "there.glb");
    assert!(harness.state().actions.contains(&Action::Open("/a/there.glb".into())));
}

#[test]
fn recent_files_are_kept_in_a_folder() {
    let folder = tempfile::tempdir().unwrap();
    let config = folder.path().join("config/shadowscope");
    assert_eq!(recent::read(&config).unwrap(), [], "no list is an empty list");
    let names: Vec<String> =
        (0..14).map(|i| folder.path().join(format!("{i}.toml")).to_string_lossy().into_owned()).collect();
    std::fs::write(&names[13], "").unwrap();
    for name in &names {
        recent::add(&config, name).unwrap();
    }
    let again = recent::add(&config, &names[12]).unwrap();
    let listed: Vec<&str> = again.iter().map(|r| r.name.as_str()).collect();
    assert_eq!(listed.len(), recent::MOST);
    assert_eq!(listed[..3], [&names[12], &names[13], &names[11]], "the newest first, each once");
    let missing: Vec<bool> = again.iter().take(3).map(|r| r.missing.is_some()).collect();
    assert_eq!(missing, [true, false, true]);
    assert_eq!(std::fs::read_dir(&config).unwrap().count(), 1, "nothing half written is left");
    // What is no list is told of, and stays.
    std::fs::write(config.join("recent.toml"), "files = 3").unwrap();
    let said = format!("{:#}", recent::add(&config, "a").unwrap_err());
    assert!(said.contains("recent.toml is no list of recent files"), "{said}");
    assert_eq!(std::fs::read_to_string(config.join("recent.toml")).unwrap(), "files = 3");
}

/// A name in the panel that is a word of the field explains itself by the glossary.
#[test]
fn a_parameters_tooltip_has_the_glossary() {
    let mut harness = harness("cubes", 2400.0);
    let place = harness.get_by_role_and_label(egui::accesskit::Role::Label, "slope bias").rect();
    harness.hover_at(place.center());
    for _ in 0..60 {
        harness.run_steps(1);
    }
    let text = glossary::find("slope bias").unwrap().text.trim();
    harness.get_by_label(text);
}

#[test]
fn the_glossary_is_searched_in_the_window() {
    let mut harness = harness("cubes", 800.0);
    harness.state_mut().model.words = Some(ui::Words::at("umbra"));
    harness.run_steps(4);
    harness.get_by_label(glossary::find("umbra").unwrap().text.trim());
    assert!(harness.query_by_label(glossary::find("texel").unwrap().text.trim()).is_none());
    harness.key_press(egui::Key::Escape);
    harness.run_steps(3);
    assert!(harness.state().model.words.is_none());
}
