//! Paths of one's own: in files, along them, and what frames cost there.

use crate::common::{built_in, ok, rising, select, shadowscope};
use glam::Vec3;
use shadowscope::frame::Renderer;
use shadowscope::light::Light;
use shadowscope::measure::Figure;
use shadowscope::measure::stability::{self, Run, Stability};
use shadowscope::path::{Between, Key, OwnPath, Route};
use shadowscope::scene::builtin::cases;
use shadowscope::scene::gltf;
use shadowscope::setup::Setup;
use std::path::Path;
use std::sync::Arc;

fn along(r: &mut Renderer, route: &Route, s: &Setup, techniques: &[&str], frames: usize, cost: bool) -> Stability {
    let run = Run { techniques: techniques.iter().map(|t| t.to_string()).collect(), frames, cost };
    stability::run(r, route, s, &run, &mut rising()).unwrap()
}

fn own(setup: &Setup) -> Route {
    Route::Own(setup.path.clone().expect("it has a path"))
}

/// A set-up with keys of camera and light at these times, each farther along.
fn keyed(mut setup: Setup, times: &[f32]) -> Setup {
    let mut path = OwnPath::default();
    let mut at = setup.clone();
    for time in times {
        path.set(Key::of(&at, *time, [true, true]));
        at.camera.position += Vec3::new(0.37, 0.11, -0.73);
        at.camera.fov += 1.5;
        match &mut at.light {
            Light::Directional { to_light, .. } => *to_light = (*to_light + Vec3::new(0.1, 0.0, 0.03)).normalize(),
            light => *light.place_mut().unwrap() += Vec3::new(0.5, 0.25, 0.1),
        }
    }
    setup.path = Some(Arc::new(path));
    setup
}

/// As TOML, in rows and in pictures; with places as the scene's file has them, however far that is from zero.
#[test]
fn a_path_survives_every_kind_of_file() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::copy("tests/data/origin-100km.glb", folder.path().join("far.glb")).unwrap();
    let far = folder.path().join("far.glb");
    for scene in ["cubes", &far.to_string_lossy()] {
        let (start, loaded) = Setup::open(scene).unwrap();
        for light in loaded.lights.iter().map(|l| l.light) {
            let mut setup = keyed(Setup { light, ..start.clone() }, &[0.25, 1.0, 4.5]);
            setup.count_from(loaded.origin);
            setup.check().unwrap();
            let file = folder.path().join("walk.toml");
            let text = setup.to_toml(&file).unwrap();
            std::fs::write(&file, &text).unwrap();
            assert_eq!(Setup::open(&file.to_string_lossy()).unwrap().0, setup, "{text}");
            let row = serde_json::to_string(&setup).unwrap();
            assert_eq!(serde_json::from_str::<Setup>(&row).unwrap(), setup, "{row}");
            let picture = folder.path().join("walk.png");
            shadowscope::capture::write_png(&picture, [1, 1], &[0; 4], Some(&text)).unwrap();
            assert_eq!(Setup::open(&picture.to_string_lossy()).unwrap().0, setup);
            // Counted from elsewhere the path stands in the same place.
            let mut other = setup.clone();
            other.count_from(loaded.origin + glam::DVec3::new(8.0, 0.0, -2.0));
            let place = |s: &Setup| s.path.as_ref().unwrap().keys[2].camera.unwrap().target;
            assert!((place(&setup) - place(&other)).distance(Vec3::new(8.0, 0.0, -2.0)) < 1e-3);
            // A path is written only where there is one.
            setup.path = None;
            assert!(!setup.to_toml(&file).unwrap().contains("path"));
        }
    }
    // By hand, in the scene's own coordinates.
    let origin = gltf::load(&far).unwrap().origin;
    let [x, y, z] = origin.to_array();
    let text = format!(
        "scene = \"far.glb\"\n[path]\nbetween = \"linear\"\n[[path.keys]]\ntime = 0\ncamera = {{ position = [{}, {y}, {z}], \
         target = [{x}, {y}, {z}] }}\n[[path.keys]]\ntime = 2\ncamera = {{ position = [{}, {y}, {z}], target = [{x}, {y}, \
         {z}], fov = 40 }}\n",
        x + 2.0,
        x + 4.0
    );
    let (mut setup, _) = Setup::from_toml(&text, &folder.path().join("hand.toml")).unwrap();
    assert_eq!(setup.path.as_ref().unwrap().between, Between::Linear);
    own(&setup).place(&mut setup, 0.5);
    assert!(setup.camera.position.distance(Vec3::X * 3.0) < 1e-2 && setup.camera.fov == 40.0, "{:?}", setup.camera);
}

#[test]
fn a_wrong_path_is_refused_in_a_sentence() {
    let key = |time: &str, rest: &str| format!("[[path.keys]]\ntime = {time}\n{rest}\n");
    let camera = "camera = { position = [0, 1, 2], target = [0, 0, 0] }";
    for (text, says) in [
        ("[path]\nkeys = []\n".to_string(), "path.keys is empty"),
        ("[path]\nbetween = \"smooth\"\n".into(), "path lacks the key keys"),
        ("[path]\nbetween = \"round\"\nkeys = []\n".into(), "\"smooth\" or \"linear\""),
        ("path = 3\n".into(), "path = 3 is not allowed"),
        ("[path]\nspeed = 3\nkeys = []\n".into(), "path.speed is unknown"),
        (key("3", camera) + &key("1", camera), "key 2 of the path is at 1 s, not after key 1 at 3 s"),
        (key("1", camera) + &key("1", camera), "key 2 of the path is at 1 s, not after key 1 at 1 s"),
        (key("nan", camera), "key 1 of the path: time = NaN is not allowed; it takes 0 to 1000000 s"),
        (key("-1", camera), "key 1 of the path: time = -1 is not allowed"),
        (key("\"soon\"", camera), "key 1 of the path: time = \"soon\" is not allowed"),
        (key("1", ""), "key 1 of the path: it moves nothing"),
        (format!("[[path.keys]]\n{camera}\n"), "key 1 of the path lacks the key time"),
        (key("1", "camera = { position = [0, 1, 2] }"), "key 1 of the path: camera lacks the key target"),
        (key("1", "camera = { position = [0, inf, 2], target = [0, 0, 0] }"), "three finite numbers"),
        (key("1", "camera = { position = [0, 1, 2], target = [0, 1, 2] }"), "camera.target must differ"),
        (key("1", "camera = { position = [0, 1, 2], target = [0, 0, 2], fov = 400 }"), "camera.fov = 400"),
        (key("1", "camera = { position = [0, 1, 2], target = [0, 0, 2], near = 1 }"), "camera.near is unknown"),
        (
            key("1", "light = { position = [0, 1, 2] }"),
            "light.position is not for a directional light, of which a path moves to_light",
        ),
        (key("1", "light = { to_light = [0, 0, 0] }"), "must not be zero"),
        (key("1", "light = { to_light = \"up\" }"), "light.to_light = \"up\" is not allowed"),
        (key("1", "light = { }"), "light is empty; of a directional light it takes to_light"),
    ] {
        let whole = format!("scene = \"cubes\"\n{text}");
        let said = format!("{:#}", Setup::from_toml(&whole, Path::new("x.toml")).expect_err(&text));
        assert!(said.contains(says) && !said.contains('\n'), "{says:?} is not in: {said}");
    }
}

/// Two keys at a case's ends: the same frames there, and so the same errors. What a run finds does not depend on whether it
/// also counts costs.
#[test]
fn at_a_cases_ends_a_path_of_ones_own_is_wrong_by_as_much() {
    let case = cases::find("st-duel").unwrap();
    let (mut r, mut s) = built_in(case.id, [96, 96]);
    let mut path = OwnPath::default();
    for (t, time) in [(0.0, 0.0), (1.0, 3.0)] {
        let mut there = s.clone();
        (case.place)(&mut there, t);
        path.set(Key::of(&there, time, [true, true]));
    }
    s.path = Some(Arc::new(path));
    let techniques = ["shadow-map", "pssm"];
    let of_case = along(&mut r, &case.into(), &s, &techniques, 2, false);
    let of_own = along(&mut r, &own(&s), &s, &techniques, 2, false);
    let errors = |found: &Stability| -> Vec<Vec<f64>> {
        found.tracks.iter().map(|t| t.points.iter().map(|p| p.error_share).collect()).collect()
    };
    assert_eq!(errors(&of_case), errors(&of_own));
    assert!(errors(&of_own).iter().flatten().all(|e| *e > 0.0), "{:?}", errors(&of_own));
    assert_eq!((of_own.case.as_str(), of_own.tracks[0].points[1].value), ("own path", 3.0));
    let costly = along(&mut r, &own(&s), &s, &techniques, 2, true);
    for (a, b) in of_own.tracks.iter().zip(&costly.tracks) {
        for (p, q) in a.points.iter().zip(&b.points) {
            assert_eq!((p.error_share, p.change, p.cost), (q.error_share, q.change, None));
            let cost = q.cost.expect("costs were asked for");
            assert!(cost.passes >= 2 && cost.ms > 0.0 && cost.triangles.is_some_and(|n| n > 0), "{cost:?}");
        }
    }
}

/// Layers without a triangle are told apart from those with some: a camera that looks straight down needs one cascade, one
/// that looks up no map at all, and one that looks along the ground several.
#[test]
fn layers_drawn_are_those_that_the_view_needs() {
    let (mut r, mut s) = built_in("bench", [96, 64]);
    (s.camera.near, s.camera.far) = (0.5, 1000.0);
    let mut path = OwnPath::default();
    for (time, ahead) in [(0.0, s.camera.target), (1.0, s.camera.position - Vec3::Y * 2.0)] {
        let mut there = s.clone();
        there.camera.target = ahead;
        path.set(Key::of(&there, time, [true, false]));
    }
    s.path = Some(Arc::new(path));
    for (technique, sets, all) in [
        ("pssm", &["cascades=8", "blend=0", "range=camera"][..], 8),
        // Peeled layers are their maps' and no more of them.
        ("pssm", &["cascades=8", "blend=0", "range=camera", "stored=midpoint"], 8),
        ("shadow-map", &[], 1),
        // Points, where a warp draws its map exactly.
        ("notw", &[], 1),
        ("rt-hard", &[], 0),
    ] {
        select(&mut s, technique, sets);
        let found = along(&mut r, &own(&s), &s, &[technique], 2, true);
        let [ahead, down] = &found.tracks[0].points[..] else { panic!("two frames") };
        let layers = |p: &stability::Point| p.cost.unwrap().layers.map(|l| (l.layers, l.layers_drawn));
        if !r.gpu.abilities.features.contains(wgpu::Features::PIPELINE_STATISTICS_QUERY) {
            assert_eq!((layers(ahead), Figure::Layers.of(down)), (None, None));
            continue;
        }
        match all {
            0 => assert_eq!((layers(ahead), down.cost.unwrap().triangles), (None, None), "{technique}"),
            1 => assert_eq!((layers(ahead), layers(down)), (Some((1, 1)), Some((1, 1))), "{technique}"),
            all => {
                assert_eq!(layers(down), Some((all, 1)), "{sets:?}");
                let (number, drawn) = layers(ahead).unwrap();
                assert!(number == all && drawn > 1, "{sets:?}: {drawn} of {number}");
                assert!(Figure::Triangles.of(ahead) > Figure::Triangles.of(down), "{sets:?}");
            }
        }
    }
}

#[test]
fn the_command_takes_set_ups_with_a_path() {
    let folder = tempfile::tempdir().unwrap();
    let (setup, _) = Setup::open("cubes").unwrap();
    let setup = Setup { size: [64, 48], ..keyed(setup, &[0.0, 1.0, 2.0]) };
    let write = |name: &str, setup: &Setup| {
        let file = folder.path().join(name);
        std::fs::write(&file, setup.to_toml(&file).unwrap()).unwrap();
    };
    write("walk.toml", &setup);
    let args = ["stability", "walk.toml", "--techniques", "pssm", "--frames", "3", "--cost", "-o", "out"];
    let table = String::from_utf8(ok(folder.path(), &args).stdout).unwrap();
    for part in ["walk: time, s; 3 frames of 64 × 48 pixels", "layers drawn", "ms: mean", "cost on "] {
        assert!(table.contains(part), "{part} is not in\n{table}");
    }
    for figure in ["", "-flicker", "-passes", "-time"] {
        assert!(folder.path().join(format!("out/walk{figure}.svg")).exists(), "{figure}");
    }
    let mut rows = csv::Reader::from_path(folder.path().join("out/stability.csv")).unwrap();
    let rows: Vec<csv::StringRecord> = rows.records().map(Result::unwrap).collect();
    assert_eq!((rows.len(), &rows[2][0], &rows[2][5]), (3, "walk", "2.0"));
    assert!(rows.iter().all(|r| r[13].parse::<u32>().is_ok() && r[17].parse::<f64>().is_ok()), "{rows:?}");
    // The worst frame's picture goes on along the path.
    let (worst, _) = Setup::open(&folder.path().join("out/walk-pssm.png").to_string_lossy()).unwrap();
    assert_eq!(worst.path, setup.path);

    let fail = |args: &[&str], sentence: &str| {
        let out = shadowscope(folder.path(), args);
        let said = String::from_utf8_lossy(&out.stderr).into_owned();
        assert!(!out.status.success() && said.contains(sentence), "{args:?}: {said}");
    };
    write("still.toml", &Setup { path: None, ..setup.clone() });
    fail(&["stability", "still.toml"], "still.toml has no path of its own");
    write("one.toml", &keyed(Setup { path: None, ..setup.clone() }, &[1.0]));
    fail(&["stability", "one.toml"], "the path of one.toml has one key");
    fail(&["stability", "walk.toml", "walk.toml"], "two paths are named walk");
    fail(&["stability", "--json", "walk.toml"], "write --json behind the cases");
    let spot = "spot:position=0,5,0;direction=0,-1,0.1;outer_angle=30;range=20";
    fail(&["stability", "walk.toml", "--light", spot], "light.to_light is not for a spot light");
}
