//! What holds of every technique, under every light that it serves, with every filter that it takes.

use crate::common::*;
use glam::{Vec2, Vec3};
use shadowscope::frame::{Ask, Renderer, Truth};
use shadowscope::gpu::{self, Gpu};
use shadowscope::light::Light;
use shadowscope::map::filter::Filter;
use shadowscope::params::{Kind, Spec};
use shadowscope::scene::builtin::cases;
use shadowscope::scene::{Camera, Scene};
use shadowscope::setup::Setup;
use shadowscope::techniques::{self, Info};
use std::sync::Arc;

/// Some triangles that a light shines on.
fn lit(triangles: &[[Vec3; 3]], view: Camera, light: Light) -> Scene {
    scene(vec![mesh(triangles, 0)], vec![material(Vec3::ONE)], view, light)
}

fn options(spec: &Spec) -> Vec<String> {
    match spec.kind {
        Kind::Choice { options, .. } => options.iter().map(|o| o.to_string()).collect(),
        Kind::Flag { .. } => vec!["false".into(), "true".into()],
        _ => vec![],
    }
}

/// Casters drawn into a warp as exactly as can be: straight edges and split triangles miss bends. Nothing of techniques without.
fn exact(info: &Info) -> Option<Vec<String>> {
    info.specs().any(|s| s.name == "raster").then(|| vec!["raster=exact".into()])
}

/// Filters to look a technique's maps up by, where it lets them be chosen: all with one fit of each kind of maps, two that differ from
/// technique to technique with the others, since filters know nothing of fits.
pub fn filters(info: &Info) -> Vec<&'static Filter> {
    let all: Vec<_> = info.choosable().collect();
    if all.is_empty() || ["lispsm", "pssm", "cube"].contains(&info.id) {
        return all;
    }
    [info.mark, info.mark + all.len() / 2].map(|i| all[i % all.len()]).into()
}

/// Settings in which every choice takes each of its options and every flag both of its values, all beside each other.
fn rows(info: &Info) -> Vec<Vec<String>> {
    let specs: Vec<(&str, Vec<String>)> = info.specs().map(|s| (s.name, options(s))).collect();
    let most = specs.iter().map(|(_, o)| o.len()).max().unwrap_or(0).max(1);
    // Steps of their own part choices with equally many options.
    let option = |row: usize, at: usize, n: usize| (row + row / n * at) % n;
    (0..most)
        .map(|row| {
            let set = specs.iter().enumerate().filter(|(_, (_, o))| !o.is_empty());
            set.map(|(at, (name, o))| format!("{name}={}", o[option(row, at, o.len())])).collect()
        })
        .collect()
}

/// Settings with each of the filters that it lets be chosen; without `all`, or a choice, its own alone. Filters know nothing of the
/// light's kind: under one kind all of them are enough.
fn look_ups(info: &Info, all: bool) -> Vec<Vec<String>> {
    match all && info.filter.is_none() {
        true => filters(info).into_iter().map(|f| vec![format!("filter={}", f.id)]).collect(),
        false => vec![vec![]],
    }
}

/// One of the lights that a technique serves, another from technique to technique.
pub fn in_turn(info: &Info, lights: &[Light]) -> Option<Light> {
    let served: Vec<Light> = lights.iter().copied().filter(|light| info.refuses(light).is_none()).collect();
    served.get(info.mark % served.len().max(1)).copied()
}

fn serving(light: Light) -> impl Iterator<Item = &'static Info> {
    techniques::ALL.iter().copied().filter(move |i| i.refuses(&light).is_none())
}

/// A picture beside which no truth is traced.
fn untold(s: &Setup) -> Ask {
    Ask { truth: Truth::Off, ..ask(s) }
}

fn is_a_share(r: &mut Renderer, what: &str) {
    assert!(r.read_visibility().unwrap().iter().all(|v| (0.0..=1.0).contains(v)), "{what}");
}

/// A floor alone is lit, exactly by comparisons, under every filter and however casters are drawn; with half the exact slope
/// bias it is not.
#[test]
fn a_lit_floor_is_lit() {
    let ground = floor(Vec2::splat(-40.0), Vec2::splat(40.0), 0.0);
    let p = |x: f32, y: f32, z: f32| Vec3::new(x, y, z);
    let view = camera(p(0.0, 1.5, 12.0), p(0.0, 0.0, 2.0));
    // Filters are chosen where it is hardest, under the low sun and the spot that grazes.
    let low = sun(p(1.0, 0.2, 0.0));
    let mut floors: Vec<_> = [
        (sun(p(0.9, 1.0, 0.3)), false),
        (low, true),
        (spot(p(-9.0, 4.0, 1.0), p(2.0, 0.0, 2.0), 30.0), true),
        (spot(p(2.0, 5.0, 18.0), p(0.0, 0.0, 2.0), 35.0), false),
        (lamp(p(-2.0, 3.0, 1.0)), false),
        (plate(p(-2.0, 3.0, 1.0), p(2.0, 0.0, 1.0), 0.03), false),
    ]
    .into_iter()
    .map(|(light, grazes)| (start(lit(&ground, view, light), [120, 90]), grazes))
    .collect();
    for info in techniques::ALL.iter() {
        let mut acne = 0;
        for ((r, s), grazes) in floors.iter_mut().filter(|((_, s), _)| info.refuses(&s.light).is_none()) {
            let light = s.light;
            // Under one of the two, where it serves both: every other technique under the spot.
            let both = info.lights.contains(&"directional") && info.lights.contains(&"spot");
            let turn = !both || (info.mark % 2 == 0) == (light == low);
            let filters = if *grazes && turn { filters(info) } else { vec![] };
            let filters = filters.into_iter().map(|f| (Some(f), vec![format!("filter={}", f.id)]));
            let own = (info.filter, vec![]);
            let exact = exact(info).into_iter().map(|sets| (info.filter, sets));
            for (filter, sets) in filters.chain([own]).chain(exact) {
                choose(s, info, 256, &sets);
                let e = shadowscope::measure::errors(r, s).unwrap();
                let bound = if filter.is_some_and(|f| f.moments.is_some()) { 0.12 } else { 0.0 };
                assert!(e.rmse <= bound && e.facing > 2000, "{} {sets:?} {light:?}: {e:?}", info.id);
            }
            if info.specs().any(|s| s.name == "slope_bias") {
                // A wider window brings a greater bias with it.
                let one = ["area-uniform", "area-adaptive", "cssm"].contains(&info.id).then(|| "kernel=1".into());
                let sets: Vec<String> = ["bias=0".into(), "slope_bias=0.35".into()].into_iter().chain(one).collect();
                choose(s, info, 64, &sets);
                acne += shadowscope::measure::errors(r, s).unwrap().shadow_incorrect;
            }
        }
        // Where texels disagree rays put acne right.
        let compares = info.filter.is_none_or(|f| f.id == "nearest") && info.specs().any(|s| s.name == "slope_bias");
        let compares = compares && info.specs().all(|s| s.name != "rays");
        assert!(!compares || acne > 500, "{}: {acne}", info.id);
    }
}

/// Every pixel that faces the light has a texel in some layer, whatever is chosen and wherever lamp and camera stand; and with its
/// defaults the picture is nearly right.
#[test]
fn every_view_sample_has_a_texel() {
    let mut scenes = vec![over_the_yard(awkward_spots().into_iter().step_by(2).collect())];
    scenes.extend(["bench"].map(|name| {
        let (r, s) = built_in(name, [120, 90]);
        (r, vec![(name.to_string(), s)])
    }));
    let view = camera(Vec3::new(0.0, 2.0, 9.0), Vec3::new(0.0, 0.5, 0.0));
    let lamps = [Vec3::new(0.5, 3.0, 2.0), Vec3::new(-6.0, 1.0, 12.0), Vec3::new(0.0, 30.0, 0.0)];
    scenes.push(over_the_yard(lamps.map(|at| ("a lamp", view, lamp(at))).into()));
    let plates = [Vec3::new(0.5, 3.0, 2.0), Vec3::new(0.0, 30.0, 0.0)];
    scenes
        .push(over_the_yard(plates.map(|at| ("a plate", view, plate(at, at * Vec3::new(1.0, 0.0, 1.0), 0.3))).into()));
    for (info, sets, turn, k) in turns(&scenes, |k, at| if k == 1 { k } else { at }) {
        let (r, places) = &mut scenes[k];
        // No filter moves a texel.
        let sets: Vec<String> = sets.into_iter().filter(|set| !set.starts_with("filter=")).collect();
        for at in turn {
            let (place, s) = &mut places[at];
            s.size = [96, 72];
            choose(s, info, 256, &sets);
            if !info.specs().any(|s| s.name == "resolution") {
                continue;
            }
            let what = format!("{place}, {} {sets:?}", info.id);
            let counted = counted(r, s);
            let [sure, most] = match s.light {
                Light::Spot { .. } => in_cone(r, &s.light),
                _ => [facing(r); 2],
            };
            assert!(sure > 200 && (sure..=most).contains(&counted), "{what}: {counted}, {sure} to {most}");
            is_a_share(r, &what);
            if sets.is_empty() && matches!(s.light, Light::Spot { .. }) {
                let e = shadowscope::measure::errors(r, s).unwrap();
                assert!(e.rmse < 0.25, "{what}: {e:?}");
            }
        }
    }
}

/// Eight times the resolution errs far less; maps filtered first, as far as the bound lets it.
#[test]
fn errors_fall_with_resolution() {
    let view = camera(Vec3::new(0.0, 5.0, 9.0), Vec3::ZERO);
    let cone = spot(Vec3::new(3.0, 9.0, 4.0), Vec3::ZERO, 45.0);
    let lamp = lamp(Vec3::new(-1.0, 4.0, 3.0));
    let plate = plate(Vec3::new(3.0, 9.0, 4.0), Vec3::ZERO, 0.01);
    for (at, light) in [sun(Vec3::new(0.5, 1.0, 0.3)), cone, lamp, plate].into_iter().enumerate() {
        let (mut r, mut s) = start(lit(&yard(), view, light), [160, 120]);
        // Under the sun, and in turn under one of the others.
        let turns = serving(light).filter(|i| at == 0 || in_turn(i, &[cone, lamp, plate]) == Some(light));
        for info in turns.filter(|i| i.specs().any(|s| s.name == "resolution")) {
            for mut sets in look_ups(info, at == 0) {
                // A far cascade's map would stay coarse.
                sets.extend(info.specs().any(|s| s.name == "coarser_3").then(|| "coarser_3=2".into()));
                let [coarse, fine] = [64, 512].map(|resolution| {
                    choose(&mut s, info, resolution, &sets);
                    shadowscope::measure::errors(&mut r, &s).unwrap().rmse
                });
                println!("{} {sets:?} {}: {coarse:.4} to {fine:.4}", info.id, light.kind());
                let soft = info.filter(&s.params[info.id]).is_some_and(|f| f.moments.is_some());
                // A skewed map's far rim stays coarse.
                let around = matches!(light, Light::Omni { .. });
                let bound = if soft { 0.8 } else { [0.6, 0.7][around as usize] };
                // Little is left where rays decide, whatever the map's resolution.
                assert!(
                    fine < bound * coarse || coarse < 0.005,
                    "{} {sets:?} {}: {coarse} to {fine}",
                    info.id,
                    light.kind()
                );
            }
        }
    }
}

/// What breaks fits leaves a finite picture, whatever is chosen: duelling frusta, light from behind, no area, a great range of
/// depths, lamps in awkward places, nothing in view.
#[test]
fn nothing_breaks() {
    let p = |x: f32, y: f32, z: f32| Vec3::new(x, y, z);
    let view = camera(p(0.0, 2.0, 9.0), p(0.0, 0.5, 0.0));
    let lamp = spot(p(0.5, 3.0, 2.0), Vec3::ZERO, 30.0);
    let mut spots = awkward_spots();
    spots.extend([
        ("out of view", camera(view.position, p(0.0, 9.0, 20.0)), lamp),
        ("to the sky", view, spot(p(0.5, 3.0, 2.0), p(0.5, 9.0, 2.0), 30.0)),
        ("from outside", view, spot(p(0.0, 40.0, 0.0), p(0.0, 90.0, 1.0), 60.0)),
    ]);
    let mut scenes = vec![over_the_yard(spots)];
    let plates = [p(0.5, 3.0, 2.0), view.position, p(0.0, 3.0, -6.0), p(-5.0, 0.1, 0.0), p(0.0, 0.0, 0.0)];
    scenes.push(over_the_yard(plates.map(|at| ("a plate", view, plate(at, p(0.1, -0.2, 0.0), 0.8))).into()));
    for id in ["st-duel", "st-behind", "st-degenerate", "st-depthrange"] {
        let (r, s) = built_in(id, [48, 48]);
        let place = |t| {
            let mut s = s.clone();
            (cases::find(id).unwrap().place)(&mut s, t);
            (format!("{id} at {t}"), s)
        };
        scenes.push((r, [0.0, 1.0].map(place).into()));
    }
    // A wall at one depth, and nothing but sky.
    let wall = [[p(-9.0, -9.0, 0.0), p(9.0, -9.0, 0.0), p(0.0, 18.0, 0.0)]];
    let (r, s) = start(lit(&wall, camera(p(0.0, 0.0, 3.0), Vec3::ZERO), sun(p(0.3, 0.4, 1.0))), [48, 48]);
    let away = Setup { camera: camera(p(0.0, 0.0, 3.0), p(0.0, 0.0, 9.0)), ..s.clone() };
    scenes.push((r, vec![("a wall".into(), s), ("the sky".into(), away)]));
    for (info, sets, turn, k) in turns(&scenes, |k, at| if k == 0 { at } else { k }) {
        let (r, places) = &mut scenes[k];
        for at in turn {
            let (place, s) = &mut places[at];
            choose(s, info, 128, &sets);
            let what = format!("{place}, {} {sets:?}", info.id);
            r.render(s, untold(s)).unwrap_or_else(|e| panic!("{what}: {e:#}"));
            is_a_share(r, &what);
            if *place == "the sky" {
                assert_eq!(facing(r), 0);
            }
        }
    }
}

/// A yard with spots and cameras over it.
fn over_the_yard(spots: Vec<(&str, Camera, Light)>) -> (Renderer, Vec<(String, Setup)>) {
    let (_, view, light) = spots[0];
    let (r, s) = start(lit(&yard(), view, light), [48, 48]);
    let place = |(name, camera, light): (&str, _, _)| (name.to_string(), Setup { camera, light, ..s.clone() });
    (r, spots.into_iter().map(place).collect())
}

/// Scenes with their places.
type Placed = [(Renderer, Vec<(String, Setup)>)];

/// Every technique that serves a scene's light, with its defaults at every other of many places, and at the rest (at each, of few) with
/// one of its [`rows`], of which `row` gives the number for the scene and the place; what has the same settings in all the scenes follows one
/// another, so that pipelines are made once. The last number is the scene's.
fn turns(scenes: &Placed, row: impl Fn(usize, usize) -> usize) -> Vec<(&'static Info, Vec<String>, Vec<usize>, usize)> {
    let mut all = Vec::new();
    for (k, (_, places)) in scenes.iter().enumerate() {
        let row: Vec<usize> = (0..places.len()).map(|at| row(k, at)).collect();
        for info in serving(places[0].1.light) {
            if row.len() > 2 {
                // The others are left to the techniques whose marks are odd.
                all.push((info, vec![], (info.mark % 2..row.len()).step_by(2).collect(), k));
            }
            let rows = rows(info);
            let n = rows.len();
            for (i, sets) in rows.into_iter().enumerate() {
                let rest = |at: &usize| row.len() <= 2 || (at + info.mark) % 2 == 1;
                let turn = (0..row.len()).filter(rest).filter(|at| (row[*at] / 2 + info.mark) % n == i).collect();
                all.push((info, sets, turn, k));
            }
        }
    }
    all.sort_by(|a, b| (a.0.id, &a.1).cmp(&(b.0.id, &b.1)));
    all
}

/// Every view of every technique, its filter's among them, shows more than one colour on a scene with shadows, finite values
/// and the same visibility; where nothing is in view it draws too. Each technique under one of the lights that it serves.
#[test]
fn every_view_of_half_the_techniques_shows_something() {
    every_view_shows_something(|k| k % 2 == 0);
}

#[test]
fn every_view_of_the_others_shows_something() {
    every_view_shows_something(|k| k % 2 == 1);
}

/// `those`: by their places in the registry.
fn every_view_shows_something(those: impl Fn(usize) -> bool) {
    let view = camera(Vec3::new(0.0, 4.0, 10.0), Vec3::ZERO);
    let lights = [
        sun(Vec3::new(0.5, 0.6, 0.3)),
        spot(Vec3::new(4.0, 7.0, 4.0), Vec3::ZERO, 45.0),
        lamp(Vec3::new(-0.5, 3.0, 2.0)),
        plate(Vec3::new(-0.5, 5.0, 2.0), Vec3::ZERO, 0.5),
    ];
    let (mut r, mut s) = start(lit(&yard(), view, lights[0]), [96, 72]);
    for (_, info) in techniques::ALL.iter().enumerate().filter(|(k, _)| those(*k)) {
        let light = in_turn(info, &lights).unwrap_or_else(|| panic!("{} serves none", info.id));
        s.light = light;
        for (k, sets) in look_ups(info, true).into_iter().enumerate() {
            choose(&mut s, info, 128, &sets);
            let values = s.params[info.id].clone();
            // A technique's own views are the same under all filters.
            let skipped = if k == 0 { 0 } else { info.maps.iter().map(|m| m.len()).sum() };
            for map in info.views(&values).skip(skipped) {
                s.view = map.id.into();
                let what = format!("{} {sets:?}, {} of a {}", info.id, map.id, light.kind());
                r.render(&s, untold(&s)).unwrap_or_else(|e| panic!("{what}: {e:#}"));
                let picture = r.read_picture().unwrap();
                let constant = picture.chunks(4).all(|p| p == &picture[..4]);
                assert!(!constant, "{what}");
                assert!(r.read_map().unwrap().iter().all(|v| v.is_finite()), "{what}");
                is_a_share(&mut r, &what);
            }
            s.view = "shaded".into();
        }
    }
}

/// Without any optional feature, and within the lowest limits that wgpu knows, or WebGPU's guarantees where a technique says that it
/// needs more, all is drawn as ever: rasters, fits and analysis included. What is lacking is said before anything is drawn. The picture is
/// nearly right. Under a lamp, where it serves that, and in turn under one of the other lights.
#[test]
fn what_adapters_guarantee_is_enough() {
    let view = camera(Vec3::new(4.0, 6.0, 7.0), Vec3::ZERO);
    let lights = [
        sun(Vec3::new(0.4, 0.8, 0.3).normalize()),
        spot(Vec3::new(3.0, 7.0, 2.0), Vec3::ZERO, 50.0),
        lamp(Vec3::new(-0.5, 3.0, 2.0)),
        plate(Vec3::new(3.0, 7.0, 2.0), Vec3::ZERO, 0.3),
    ];
    let (mut strong, mut setup) = start(lit(&yard(), view, lights[0]), [96, 72]);
    let bare = |limits: wgpu::Limits| {
        let gpu = Gpu::within(&gpu::instance(), None, None, |_, _| (wgpu::Features::empty(), limits)).unwrap();
        Renderer::new(Arc::new(strict(gpu)), strong.scene().clone()).unwrap()
    };
    let (mut least, mut guaranteed) = (bare(wgpu::Limits::downlevel_defaults()), bare(wgpu::Limits::default()));
    let (mut seen, mut refused) = (0, 0);
    for light in lights {
        setup.light = light;
        let others = [lights[0], lights[1], lights[3]];
        for info in serving(light).filter(|i| light == lights[2] || in_turn(i, &others) == Some(light)) {
            // Four numbers of 16 bits are averaged everywhere.
            let averaged = info.specs().any(|s| s.name == "precision" && info.filter.is_some());
            let averaged = averaged.then(|| vec!["precision=16".into()]);
            for sets in exact(info).into_iter().chain(averaged).chain([vec![]]) {
                choose(&mut setup, info, 512, &sets);
                let what = format!("{} {sets:?} {}", info.id, light.kind());
                let e = shadowscope::measure::errors(&mut strong, &setup).unwrap_or_else(|e| panic!("{what}: {e:#}"));
                println!("{what}: rmse {:.4}", e.rmse);
                // Exponents that 32 bits are chosen for overflow 16.
                let right = e.rmse < 0.25 && e.lit_correct > 1000 && e.shadow_correct > 20;
                assert!(right || sets == ["precision=16"], "{what}: {e:?}");
                let ask = Ask { analysis: true, ..untold(&setup) };
                let mut weak = &mut least;
                if let Some(why) = info.lacks(setup.values(), &weak.gpu.abilities) {
                    let told = weak.render(&setup, ask).expect_err(&what).to_string();
                    assert!(told == format!("{}: {why}", info.title), "{what}: {told}");
                    weak.gpu.check().unwrap();
                    refused += 1;
                    weak = &mut guaranteed;
                }
                if let Some(why) = info.lacks(setup.values(), &weak.gpu.abilities) {
                    // Only formats are left to lack.
                    assert!(why.contains("cannot average"), "{what}: {why}");
                    continue;
                }
                let visibility = |r: &mut Renderer| {
                    r.render(&setup, ask).unwrap_or_else(|e| panic!("{what}: {e:#}"));
                    r.read_visibility().unwrap()
                };
                let (there, here) = (visibility(&mut strong), visibility(weak));
                // Where depth cannot be clamped casters are clipped, which rounds it, and filters add it up.
                let mean = there.iter().zip(&here).map(|(a, b)| (a - b).abs()).sum::<f32>() / there.len() as f32;
                let adds = info.filter.is_some_and(|f| f.moments.is_some());
                assert!(there == here || adds && mean < 1e-3, "{what}: {mean}");
                seen += 1;
            }
        }
    }
    println!("{seen} drawn, {refused} refused within the lowest limits");
    assert!(seen >= techniques::ALL.len() && refused > 10, "{seen}, {refused}");
}

/// A caster close to a spot's lamp, far nearer than the scene is large, still casts, however far the light reaches.
#[test]
fn a_caster_near_the_lamp_casts() {
    let mut triangles = floor(Vec2::splat(-500.0), Vec2::splat(500.0), 0.0);
    triangles.extend(floor(Vec2::new(-0.06, -0.2), Vec2::new(0.0, 0.2), 7.9));
    let mut light = spot(Vec3::new(0.0, 8.0, 0.0), Vec3::new(5.6, 0.0, 0.0), 60.0);
    let (mut r, mut s) = start(lit(&triangles, camera(Vec3::new(0.0, 9.0, 12.0), Vec3::ZERO), light), [120, 90]);
    for reach in [40.0, 1e9] {
        if let Light::Spot { range, .. } = &mut light {
            *range = reach;
        }
        s.light = light;
        for info in serving(light) {
            choose(&mut s, info, 1024, &[]);
            let e = shadowscope::measure::errors(&mut r, &s).unwrap();
            println!("{} {reach}: {:.4} of {}", info.id, e.rmse, e.shadow_correct);
            assert!(e.rmse < 0.2 && e.shadow_correct > 400, "{} with a range of {reach}: {e:?}", info.id);
        }
    }
}

/// One picture of every technique, under one of the lights that it serves: what a second driver is asked for, where each takes seconds to compile.
#[test]
fn every_technique_draws() {
    let plate = plate(Vec3::new(-0.5, 3.0, 2.0), Vec3::ZERO, 0.1);
    let lights = [sun(Vec3::new(0.8, 0.6, 0.3)), lamp(Vec3::new(-0.5, 3.0, 2.0)), plate];
    let (mut r, mut s) = start(lit(&yard(), camera(Vec3::new(2.0, 3.0, 4.0), Vec3::ZERO), lights[0]), [64, 48]);
    println!("{}", r.gpu.info.name);
    let mut seen = Vec::new();
    for light in lights {
        s.light = light;
        for info in serving(light).filter(|i| in_turn(i, &lights) == Some(light)) {
            choose(&mut s, info, 256, &[]);
            let e = shadowscope::measure::errors(&mut r, &s).unwrap_or_else(|e| panic!("{}: {e:#}", info.id));
            println!("{}: rmse {:.4}", info.id, e.rmse);
            assert!(e.rmse < 0.2 && e.lit_correct > 1000 && e.shadow_correct > 50, "{}: {e:?}", info.id);
            seen.push(info.id);
        }
    }
    assert!(techniques::ALL.iter().all(|i| seen.contains(&i.id)));
}

/// The memory that is told is what the driver's allocator gave, however maps are looked up and casters drawn, and the analysis is
/// no part of it.
#[test]
fn memory_told_is_memory_made() {
    let light = sun(Vec3::new(0.8, 0.6, 0.3));
    let scene = lit(&yard(), camera(Vec3::new(2.0, 3.0, 4.0), Vec3::ZERO), light);
    let (_, mut s) = start(scene.clone(), [64, 48]);
    // A device of its own, on which nobody else allocates.
    let gpu = Arc::new(strict(Gpu::new(None).unwrap()));
    let mut r = Renderer::new(gpu.clone(), Arc::new(scene)).unwrap();
    let mut taken = |s: &Setup, analysis: bool| {
        // Bind groups outlive what they bind by two frames.
        let told = [(); 3].map(|()| r.render(s, Ask { analysis, ..untold(s) }).unwrap().gpu_bytes)[2];
        // Buffers that a frame let go are freed once the device has done with them.
        gpu.queue.submit([]);
        gpu.wait().unwrap();
        let report = gpu.device.generate_allocator_report().expect("an allocator that reports");
        // What wgpu takes for itself is nobody's: room to check indirect draws in.
        let made = report.allocations.iter().filter(|a| !a.name.starts_with("(wgpu internal)"));
        (told, made.map(|a| a.size).sum::<u64>())
    };
    choose(&mut s, techniques::find("rt-hard").unwrap(), 512, &[]);
    taken(&s, true);
    let [with, without] = [true, false].map(|analysis| {
        let (told, all) = taken(&s, analysis);
        all - told
    });
    let mut seen = Vec::new();
    let others = [lamp(Vec3::new(-0.5, 3.0, 2.0)), plate(Vec3::new(-0.5, 3.0, 2.0), Vec3::ZERO, 0.3)];
    for light in [light].into_iter().chain(others) {
        s.light = light;
        let turn = |i: &&Info| light.kind() == "directional" || in_turn(i, &others) == Some(light);
        for info in serving(light).filter(turn) {
            // Filters know nothing of the light's kind.
            let filters = if matches!(light, Light::Directional { .. }) { filters(info) } else { vec![] };
            let chosen = filters.into_iter().map(|f| vec![format!("filter={}", f.id)]).chain(exact(info));
            for sets in chosen.chain([vec![]]) {
                choose(&mut s, info, 512, &sets);
                let (told, all) = taken(&s, false);
                let made = all.saturating_sub(without);
                println!("{} {sets:?}: {told} told, {made} made", info.id);
                // What alignment adds.
                assert!(told.abs_diff(made) < 32768 + made / 50, "{} {sets:?}: {told} told, {made} made", info.id);
                seen.push((s.clone(), told));
            }
        }
    }
    for (s, told) in seen.iter().step_by(5) {
        assert_eq!(taken(s, true).0, *told, "{} with the analysis", s.technique);
    }
    assert!(with >= without);
}
