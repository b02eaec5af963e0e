//! The stability cases: that they hold what they promise, and that what is counted along them is right.

use crate::common::{rising, shadowscope};
use glam::Vec3;
use serde_json::Value;
use shadowscope::frame::Renderer;
use shadowscope::light::{Light, LightView};
use shadowscope::measure::stability::{self, Change, Point, Run, Stability, Track};
use shadowscope::scene::builtin::cases::{self, CASES, Case};
use shadowscope::scene::geometry::Geometry;
use shadowscope::setup::Setup;
use shadowscope::techniques;
use shadowscope::truth::Samples;
use std::path::Path;
use std::sync::Arc;

fn case(id: &str) -> &'static Case {
    cases::find(id).unwrap_or_else(|| panic!("there is no {id}"))
}

fn open(case: &Case, side: u32) -> (Renderer, Setup) {
    let (mut setup, scene) = Setup::open(case.id).unwrap();
    setup.size = [side; 2];
    (Renderer::new(crate::common::gpu(), Arc::new(scene)).unwrap(), setup)
}

/// Runs techniques along a case, against the hard truth.
fn along(id: &str, techniques: &[&str], side: u32, frames: usize) -> Stability {
    against(id, techniques, side, frames, Samples::Fixed(1))
}

fn against(id: &str, techniques: &[&str], side: u32, frames: usize, samples: Samples) -> Stability {
    let (mut renderer, mut setup) = open(case(id), side);
    setup.truth_samples = samples;
    let techniques: Vec<String> = techniques.iter().map(|t| t.to_string()).collect();
    let run = Run { techniques, frames, cost: false };
    stability::run(&mut renderer, &case(id).into(), &setup, &run, &mut rising()).unwrap()
}

/// Errors of the n-th technique in per cent, a frame each.
fn errors(found: &Stability, n: usize) -> Vec<f64> {
    found.tracks[n].points.iter().map(|p| p.error_share * 100.0).collect()
}

#[test]
fn every_path_is_valid_and_reopens() {
    assert_eq!(CASES.len(), 18);
    for case in CASES {
        let (start, scene) = Setup::open(case.id).unwrap();
        assert_eq!(scene.name, case.id);
        assert!(case.id.starts_with("st-") && case.doc.ends_with('.') && !case.axis.is_empty(), "{}", case.id);
        assert!(case.frames >= 32, "{}", case.id);
        let mut places: Vec<Setup> = Vec::new();
        for t in [0.0, 0.25, 0.5, 1.0] {
            let mut setup = start.clone();
            (case.place)(&mut setup, t);
            setup.check().unwrap_or_else(|e| panic!("{} at {t}: {e:#}", case.id));
            assert!((case.value)(t).is_finite());
            let text = setup.to_toml(Path::new("here.toml")).unwrap();
            let (reopened, _) = Setup::from_toml(&text, Path::new("here.toml")).unwrap();
            assert_eq!(reopened, setup, "{} at {t}", case.id);
            // Placed anew from anywhere on the path, the set-up is the same.
            for from in &places {
                let mut again = from.clone();
                (case.place)(&mut again, t);
                assert_eq!(again, setup, "{} at {t}", case.id);
            }
            places.push(setup);
        }
        for pair in places.windows(2) {
            assert_ne!(pair[0], pair[1], "{} stands still", case.id);
        }
    }
}

#[test]
fn rays_are_exact_and_steady_in_every_case() {
    for case in CASES {
        let found = along(case.id, &["rt-hard"], 96, 5);
        let (setup, _) = Setup::open(case.id).unwrap();
        assert_eq!(found.tracks.is_empty(), techniques::TRUTH.refuses(&setup.light).is_some(), "{}", case.id);
        for p in found.tracks.iter().flat_map(|t| &t.points) {
            assert_eq!(p.error_share, 0.0, "{} at {}", case.id, p.t);
            let change = p.change.unwrap_or_default();
            assert_eq!((change.flicker, change.label_flicker), (0.0, 0.0), "{} at {}", case.id, p.t);
            assert_eq!(change.change, change.truth_change, "{} at {}", case.id, p.t);
        }
        let seen_twice = found.tracks.iter().flat_map(|t| &t.points).filter(|p| p.change.is_some()).count();
        assert!(found.tracks.is_empty() || seen_twice >= 2, "{}: no surface is seen twice", case.id);
    }
}

#[test]
fn a_still_truth_and_a_crawling_map() {
    let found = along("st-jitter", &["shadow-map", "pcf", "rt-hard"], 128, 12);
    assert_eq!(found, along("st-jitter", &["shadow-map", "pcf", "rt-hard"], 128, 12), "two runs differ");
    let [map, pcf, rays] = &found.tracks[..] else { panic!("three techniques, not {}", found.tracks.len()) };
    assert!(map.mean(Point::flicker).unwrap() > 2e-3 && pcf.mean(Point::flicker).unwrap() > 2e-3);
    let mean = |track: &Track, of: fn(&Change) -> f64| {
        let all: Vec<f64> = track.points.iter().filter_map(|p| p.change.as_ref().map(of)).collect();
        all.iter().sum::<f64>() / all.len() as f64
    };
    assert!(mean(rays, |c| c.truth_change) < mean(map, |c| c.change));
    for track in &found.tracks {
        for (p, q) in track.points.iter().zip(&rays.points) {
            let (Some(c), Some(of_rays)) = (p.change, q.change) else {
                assert_eq!((p.t, p.change), (0.0, None));
                continue;
            };
            assert_eq!(c.truth_change, of_rays.truth_change, "the truth is one for all");
            assert!(c.flicker <= c.change && c.change <= c.flicker + c.truth_change + 1e-12);
            let labels = c.label_flicker + c.truth_label_changes;
            assert!(c.label_flicker <= c.label_changes && c.label_changes <= labels + 1e-12);
        }
    }
}

/// Wires too thin for the map, drawn softly: no label changes, yet their faint shadow comes and goes in every frame.
#[test]
fn a_faint_wire_that_changes_in_every_frame_is_not_steady() {
    let found = along("st-wire", &["shadow-map", "pcf", "rt-hard"], 256, 5);
    let [map, pcf, rays] = [0, 1, 2].map(|n| {
        let all: Vec<Change> = found.tracks[n].points.iter().filter_map(|p| p.change).collect();
        assert_eq!(all.len(), 4);
        [|c: &Change| c.flicker, |c: &Change| c.label_flicker, |c: &Change| c.truth_change]
            .map(|of| all.iter().map(of).sum::<f64>() / 4.0)
    });
    assert!(pcf[0] > 0.03 && pcf[1] < 0.002, "{pcf:?}");
    // One sample per pixel is a label: there the two are one.
    assert!(map[0] == map[1] && map[0] > 0.05, "{map:?}");
    assert!(rays[..2] == [0.0, 0.0] && rays[2] > 0.01, "{rays:?}");
}

/// Against one truth averaged over the pixel the filter is steadier than one sample per pixel; what is hard is measured against
/// that only where it is asked for.
#[test]
fn filters_are_measured_against_the_averaged_truth() {
    let [hard, auto, averaged] = [Samples::Fixed(1), Samples::Auto, Samples::Fixed(16)].map(|samples| {
        let found = against("st-wire", &["pcf", "rt-hard"], 128, 4, samples);
        found.tracks.iter().map(|t| t.mean(Point::flicker).unwrap()).collect::<Vec<f64>>()
    });
    assert_eq!((hard[1], auto[1], auto[0]), (0.0, 0.0, averaged[0]));
    assert!(averaged[0] < 0.95 * hard[0] && averaged[0] < 0.8 * averaged[1], "{hard:?} {averaged:?}");
}

#[test]
fn flicker_of_a_set_up_is_that_of_its_technique() {
    let (mut renderer, mut setup) = open(case("st-jitter"), 128);
    let map = stability::flicker(&mut renderer, &setup).unwrap().unwrap();
    assert!(map.flicker > 5e-4 && map.flicker == map.label_flicker, "{map:?}");
    assert_eq!(stability::flicker(&mut renderer, &setup).unwrap(), Some(map), "two runs differ");
    setup.select("rt-hard").unwrap();
    let rays = stability::flicker(&mut renderer, &setup).unwrap().unwrap();
    assert_eq!((rays.flicker, rays.change), (0.0, rays.truth_change));
    setup.camera.target.y = 1000.0;
    assert_eq!(stability::flicker(&mut renderer, &setup).unwrap(), None, "nothing is in the sky");
    setup.select("pssm").unwrap();
    setup.light = Light::RectArea { center: Vec3::Y, half_u: Vec3::X, half_v: Vec3::Z, range: 9.0, color: Vec3::ONE };
    assert!(stability::flicker(&mut renderer, &setup).is_err());
}

#[test]
fn a_lower_sun_makes_a_larger_error() {
    // 60, 45, 30.5 and 15.75 degrees, then 1.
    let found = along("st-grazing", &["shadow-map"], 128, 5);
    let e = errors(&found, 0);
    assert!(e[..4].windows(2).all(|w| w[1] > w[0]), "{e:?}");
    assert!(e[3] > 3.0 * e[0] && e[4] > 3.0 * e[0], "{e:?}");
    let values: Vec<f32> = found.tracks[0].points.iter().map(|p| p.value).collect();
    assert_eq!(values, [60.0, 45.25, 30.5, 15.75, 1.0]);
}

#[test]
fn maps_fail_where_the_cases_say() {
    let both = ["shadow-map", "pcf"];
    for (n, technique) in both.iter().enumerate() {
        let found = along("st-wire", &both, 128, 3);
        assert!(errors(&found, n).iter().all(|e| *e > 3.0), "st-wire, {technique}: {:?}", errors(&found, n));
        // Frames 0 and 1 without the sail, 3 and 4 with it.
        let e = errors(&along("st-depthrange", &both, 256, 5), n);
        assert!(e[3] > 10.0 * e[0].max(e[1]) && e[4] > 3.0, "st-depthrange, {technique}: {e:?}");
        let e = errors(&along("st-contact", &both, 128, 3), n);
        assert!(e[2] > 5.0 * e[0] && e[2] > 0.5, "st-contact, {technique}: {e:?}");
        let e = errors(&along("st-longtri", &both, 128, 3), n);
        assert!(e[2] > 3.0 * e[0] && e[2] > 8.0, "st-longtri, {technique}: {e:?}");
        let e = errors(&along("st-single-plane", &both, 128, 3), n);
        assert_eq!(e, [0.0; 3], "st-single-plane, {technique}: nothing casts a shadow");
    }
}

/// Sides of a texel of a 1024² map fitted to what a set-up's camera sees, metres.
fn texel(renderer: &mut Renderer, setup: &Setup) -> [f32; 2] {
    renderer.render(setup, crate::common::ask(setup)).unwrap();
    let view = LightView::whole(&setup.light, renderer.geometry().bounds, 1024, 1.0).unwrap();
    let mask = renderer.read_mask().unwrap();
    let points = renderer.read_position().unwrap();
    [view.row_x, view.row_y].map(|row| {
        let along = row.truncate().normalize();
        let lit = points.iter().zip(&mask).filter(|(_, m)| **m == 2);
        let (low, high) = lit
            .map(|(p, _)| along.dot(Vec3::new(p[0], p[1], p[2])))
            .fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
        (high - low) / 1024.0
    })
}

#[test]
fn steps_and_wires_are_as_small_as_they_say() {
    let jitter = case("st-jitter");
    let (mut renderer, mut setup) = open(jitter, stability::SIZE[0]);
    let side = texel(&mut renderer, &setup).into_iter().fold(0.0, f32::max);
    let from = setup.camera;
    let frame = 1.0 / (jitter.frames - 1) as f32;
    (jitter.place)(&mut setup, frame);
    let step = setup.camera.position.distance(from.position);
    assert!((step * 64.0 / side - 1.0).abs() < 0.05, "a step of {step} m, a texel of {side} m");
    // The second half turns.
    (jitter.place)(&mut setup, 1.0);
    let end = setup.camera;
    (jitter.place)(&mut setup, 1.0 - frame);
    assert!(setup.camera.position == end.position && setup.camera.target != end.target);

    let (mut renderer, setup) = open(case("st-wire"), stability::SIZE[0]);
    let scene = renderer.scene().clone();
    let wires = scene.meshes.iter().find(|m| scene.materials[m.material as usize].name == "wires").unwrap();
    // They hang at 1.5 m and 1.64 m.
    let heights = wires.positions.iter().map(|p| p.y);
    let thickness = heights.clone().fold(0.0, f32::max) - heights.fold(9.0, f32::min) - 0.14;
    for side in texel(&mut renderer, &setup) {
        assert!((0.16..0.25).contains(&(thickness / side)), "wires of {thickness} m, texels of {side} m");
    }
}

#[test]
fn a_light_that_is_not_served_is_left_out_with_the_reason() {
    let all: Vec<&str> = techniques::ALL.iter().map(|i| i.id).collect();
    let wide = along("st-wide", &all, 64, 2);
    let (setup, _) = Setup::open("st-wide").unwrap();
    for (id, reason) in &wide.left_out {
        assert!(reason.contains("rect-area"), "{id}: {reason}");
    }
    assert!(techniques::TRUTH.refuses(&setup.light).is_none() || wide.tracks.is_empty());
    assert_eq!(wide.tracks.len() + wide.left_out.len(), all.len());
    let lamp = along("st-lightinview", &["shadow-map", "rt-hard"], 64, 2);
    assert_eq!(lamp.tracks.len(), 1);
    assert_eq!(lamp.left_out[0].0, "shadow-map");
    assert!(lamp.left_out[0].1.contains("omni"), "{}", lamp.left_out[0].1);
}

#[test]
fn degenerate_triangles_survive_and_yield_numbers() {
    let (mut renderer, setup) = open(case("st-degenerate"), 96);
    let geometry = renderer.geometry();
    let area = |t: usize| {
        let [a, b, c] = geometry.corners(t);
        (b - a).cross(c - a).length()
    };
    let none = (0..geometry.triangles.len()).filter(|t| area(*t) == 0.0).count();
    assert!(none >= 18, "{none} triangles without area");
    let mut empty = false;
    for (k, info) in techniques::ALL.iter().enumerate() {
        // The law that nothing breaks looks at both ends.
        let between = [0.3, 0.6, 0.9][k % 3];
        for t in [between].into_iter().chain((k == 0).then_some(1.0)) {
            let mut setup = setup.clone();
            setup.select(info.id).unwrap();
            (case("st-degenerate").place)(&mut setup, t);
            renderer.render(&setup, crate::common::ask(&setup)).unwrap();
            let visibility = renderer.read_visibility().unwrap();
            assert!(visibility.iter().all(|v| (0.0..=1.0).contains(v)), "{} at {t}", info.id);
            empty |= renderer.read_mask().unwrap().iter().all(|m| *m == 0);
        }
    }
    assert!(empty, "at its end the camera looks into an empty sky");
    let last = along("st-degenerate", &["shadow-map"], 64, 9).tracks[0].points[8];
    assert_eq!((last.error_share, last.change), (0.0, None));
}

#[test]
fn foliage_overflows_eight_bits() {
    let case = case("st-foliage");
    let (mut setup, scene) = Setup::open(case.id).unwrap();
    let geometry = Geometry::new(&scene, 0, 0.0).unwrap();
    let most = |setup: &Setup| {
        let to_light = setup.light.position();
        let layers = |from: Vec3| {
            let hit = |i: usize| {
                let [a, b, c] = geometry.corners(i).map(|p| p - from);
                let side = |p: Vec3, q: Vec3| p.cross(q).dot(to_light);
                let s = [side(a, b), side(b, c), side(c, a)];
                let normal = (b - a).cross(c - a);
                let ahead = normal.dot(a) * normal.dot(to_light) > 0.0;
                ahead && (s.iter().all(|x| *x > 0.0) || s.iter().all(|x| *x < 0.0))
            };
            (0..geometry.triangles.len()).filter(|i| hit(*i)).count()
        };
        // In the shadow of the crown's axis.
        let foot = |k: usize| {
            let top = Vec3::Y * (0.9 + 0.25 * k as f32);
            top - to_light * (top.y / to_light.y) + Vec3::new(0.07, 0.001, 0.05)
        };
        (0..16).map(|k| layers(foot(k))).max()
    };
    let high = most(&setup);
    assert!(high >= Some(256), "the light of a high sun passes {high:?} layers at most");
    (case.place)(&mut setup, 1.0);
    assert!(most(&setup) < high);
}

#[test]
fn the_command_writes_tables_charts_and_worst_frames() {
    let dir = tempfile::tempdir().unwrap();
    let small = "--frames 3 --size 64x64 --set resolution=256 --set imperfect-sm.vpls=32 --set pcf.kernel=5";
    let args: Vec<&str> = ["stability", "st-corner", "st-wide"].into_iter().chain(small.split(' ')).collect();
    let run = |more: &[&str]| {
        let out = shadowscope(dir.path(), &[&args[..], more].concat());
        assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
        String::from_utf8(out.stdout).unwrap()
    };
    let table = run(&["-o", "out"]);
    assert!(table.contains("st-corner: sun's azimuth, °; 3 frames of 64 × 64 pixels"), "{table}");
    assert!(table.contains("left out: Parallel-split (cascaded) shadow maps: for"), "{table}");
    let some = ["--json", "--techniques", "shadow-map,pcf,rtw,rt-hard"];
    let json = run(&some);
    assert_eq!(json, run(&some), "two runs print different figures");
    let value: Value = serde_json::from_str(&json).unwrap();
    let track = &value[0]["tracks"][1];
    assert_eq!((&value[0]["case"], &track["technique"]), (&"st-corner".into(), &"pcf".into()));
    assert!(track["params"].as_str().unwrap().contains("kernel=5"), "{track}");
    assert_eq!(track["points"].as_array().unwrap().len(), 3);
    assert_eq!(track["points"][2]["value"], 0.0);

    let mut rows = csv::Reader::from_path(dir.path().join("out/stability.csv")).unwrap();
    let rows: Vec<csv::StringRecord> = rows.records().map(Result::unwrap).collect();
    // Of the sun in one case, of a rectangle in the other.
    let serving = |kind| techniques::ALL.iter().filter(|i| i.lights.contains(&kind)).count();
    assert_eq!(rows.len(), 3 * (serving("directional") + serving("rect-area")));
    assert_eq!(rows[0].len(), 19);
    assert!(rows[0].iter().skip(13).all(str::is_empty), "costs were not asked for");
    assert!(rows[0][7].is_empty() && rows[1][7].parse::<f64>().is_ok(), "the first frame has none before it");
    let svg = std::fs::read_to_string(dir.path().join("out/st-corner.svg")).unwrap();
    assert!(svg.starts_with("<svg") || svg.starts_with("<?xml"), "{}", &svg[..40]);
    assert!(image::open(dir.path().join("out/st-corner.png")).unwrap().width() >= 1000);
    // A worst frame reopens at its place on the path.
    let picture = dir.path().join("out/st-corner-shadow-map.png");
    let (setup, _) = Setup::open(picture.to_str().unwrap()).unwrap();
    let points = &value[0]["tracks"][0]["points"];
    let worst = (0..3).rev().max_by(|a, b| {
        let error = |i: &usize| points[*i]["error_share"].as_f64().unwrap();
        error(a).total_cmp(&error(b))
    });
    let mut placed = setup.clone();
    (case("st-corner").place)(&mut placed, worst.unwrap() as f32 / 2.0);
    assert_eq!(setup, placed);
    assert_eq!((setup.view.as_str(), setup.technique.as_str(), setup.size), ("error", "shadow-map", [64, 64]));
}

#[test]
fn cases_are_known_by_name_everywhere() {
    let dir = tempfile::tempdir().unwrap();
    let fail = |args: &[&str], sentence: &str| {
        let out = shadowscope(dir.path(), args);
        let said = String::from_utf8_lossy(&out.stderr).into_owned();
        assert!(!out.status.success() && said.contains(sentence), "{args:?}: {said}");
    };
    fail(&["stability", "st-none"], "st-none is no stability case; there are st-grazing, st-duel");
    fail(&["stability", "--techniques", "none"], "technique = none is unknown");
    fail(&["stability", "st-wire", "--set", "pcf.kernel=4"], "pcf.kernel = 4 is not allowed");
    fail(&["stability", "--json", "st-wire"], "write --json behind the cases");
    let list = shadowscope(dir.path(), &["list", "cases", "--json"]);
    let list: Value = serde_json::from_slice(&list.stdout).unwrap();
    assert_eq!(list.as_array().unwrap().len(), CASES.len());
    assert_eq!(list[0]["id"], "st-grazing");
    // A file of the same name beside a set-up does not hide the case.
    std::fs::write(dir.path().join("st-fence"), "").unwrap();
    let args = ["capture", "st-fence", "--size", "48x48", "-o", "a.png"];
    assert!(shadowscope(dir.path(), &args).status.success());
    let (setup, _) = Setup::open(dir.path().join("a.png").to_str().unwrap()).unwrap();
    assert_eq!(setup.scene, "st-fence");
}

/// Mean, largest and worst of a track are over the frames that have the figure; of none there is nothing.
#[test]
fn figures_of_a_track_leave_out_frames_without_them() {
    let point = |flicker: Option<f64>, error_share: f64| Point {
        error_share,
        change: flicker.map(|flicker| Change { flicker, ..Change::default() }),
        ..Point::default()
    };
    let points = vec![point(None, 0.5), point(Some(1.0), 0.1), point(Some(4.0), 0.75), point(Some(1.0), 0.75)];
    let track = Track { points, ..Track::default() };
    assert_eq!([track.mean(Point::flicker), track.max(Point::flicker)], [Some(2.0), Some(4.0)]);
    assert_eq!(track.worst(), Some(&track.points[2]));
    let first = Track { points: track.points[..1].to_vec(), ..Track::default() };
    assert_eq!([first.mean(Point::flicker), first.max(Point::flicker)], [None, None]);
    assert_eq!(Track::default().worst(), None);
}
