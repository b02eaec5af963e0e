//! How comparisons are moved: by slope or by each texel's ray, and which of the surfaces that it meets a texel stands for.

use super::common::*;
use glam::{Vec2, Vec3};
use shadowscope::frame::{Ask, Renderer};
use shadowscope::light::Light;
use shadowscope::measure::causes::Causes;
use shadowscope::params::Kind;
use shadowscope::scene::Scene;
use shadowscope::setup::Setup;
use shadowscope::techniques;
use shadowscope::truth::Samples;
use std::collections::BTreeMap;
use std::sync::Arc;

fn rising(elevation: f32, azimuth: f32) -> Light {
    let (e, a) = (elevation.to_radians(), azimuth.to_radians());
    sun(Vec3::new(e.cos() * a.cos(), e.sin(), e.cos() * a.sin()))
}

fn cuboid(low: Vec3, high: Vec3) -> Vec<[Vec3; 3]> {
    let p = |i: usize| Vec3::from_array([0, 1, 2].map(|a| if i >> a & 1 == 1 { high[a] } else { low[a] }));
    let faces = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    faces.iter().flat_map(|f| [[p(f[0]), p(f[1]), p(f[2])], [p(f[0]), p(f[2]), p(f[3])]]).collect()
}

/// A lit floor; with a wall beyond it and beside that faces the sun and casts nothing on it, so that a map of the scene cannot shrink with
/// the floor as the sun sinks.
fn lit_floor(light: Light) -> Scene {
    let mut triangles = floor(Vec2::splat(-10.0), Vec2::splat(10.0), 0.0);
    let p = |y: f32, z: f32| Vec3::new(-14.0, y, z);
    triangles.extend([[p(-8.0, 44.0), p(-8.0, 30.0), p(52.0, 30.0)], [p(-8.0, 44.0), p(52.0, 30.0), p(52.0, 44.0)]]);
    let view = camera(Vec3::new(4.0, 4.0, 8.0), Vec3::new(2.0, 0.0, 0.0));
    scene(vec![mesh(&triangles, 0)], vec![material(Vec3::ONE)], view, light)
}

/// A body over a floor.
fn over_floor(body: &[[Vec3; 3]], light: Light) -> Scene {
    let mut triangles = floor(Vec2::splat(-6.0), Vec2::splat(6.0), 0.0);
    triangles.extend_from_slice(body);
    let view = camera(Vec3::new(-4.0, 4.5, 5.0), Vec3::new(-0.7, 0.3, -0.4));
    scene(vec![mesh(&triangles, 0)], vec![material(Vec3::ONE)], view, light)
}

fn boxed(light: Light) -> Scene {
    over_floor(&cuboid(Vec3::new(-1.0, 0.5, -1.0), Vec3::new(1.0, 1.5, 1.0)), light)
}

/// The wrong pixels by cause: acne, detachment, leak, missing caster, stairs; and where they are.
fn causes(r: &mut Renderer, s: &mut Setup, technique: &str, sets: &[&str]) -> Causes {
    select(s, technique, sets);
    let s = Setup { truth_samples: Samples::Fixed(1), ..s.clone() };
    r.render(&s, Ask { analysis: true, picture: false, ..ask(&s) }).unwrap();
    r.read_causes().unwrap()
}

fn visible(r: &mut Renderer, s: &mut Setup, technique: &str, sets: &[&str]) -> Vec<f32> {
    select(s, technique, sets);
    r.render(s, ask(s)).unwrap();
    r.read_visibility().unwrap()
}

/// On a plane the light's ray through each texel's centre meets what was stored there: nothing else is needed, whatever the sun's
/// elevation and the map's size, as long as the limit is no smaller than the slope. The slope bias needs its limit as much.
#[test]
fn a_ray_through_a_texel_needs_no_bias_on_a_plane() {
    let mut limited = [0, 0];
    for (elevation, azimuth) in [(60.0, 20.0), (30.0, -35.0), (10.0, 10.0), (5.0, 40.0), (2.0, -20.0), (1.0, 15.0)] {
        let (mut r, mut s) = start(lit_floor(rising(elevation, azimuth)), [160, 120]);
        for resolution in [64, 128, 256, 512, 1024] {
            let size = format!("resolution={resolution}");
            let mut wrong = |kind: &str, limit: &str| {
                let (own, more) = match kind {
                    "bias_kind=slope" => (kind, "bias=0"),
                    "toward_light=false" => ("bias_kind=ray-plane", kind),
                    _ => (kind, "cull=none"),
                };
                let sets = [own, limit, &size, "fit=scene", more];
                let e = errors(&mut r, &mut s, "shadow-map", &sets);
                assert!(e.facing > 5000, "{e:?}");
                e.shadow_incorrect + e.lit_incorrect
            };
            for exact in ["bias_kind=ray-plane", "toward_light=false"] {
                assert_eq!(wrong(exact, "slope_limit=60"), 0, "{elevation}° {size} {exact}");
            }
            if elevation == 1.0 {
                limited[0] += wrong("bias_kind=ray-plane", "slope_limit=20");
                limited[1] += wrong("bias_kind=slope", "slope_limit=20");
            }
            // Coarser texels hold the whole floor under a low sun.
            let bare = resolution < 256 || wrong("bias_kind=none", "slope_limit=10") > 100;
            assert!(bare, "nothing is moved: {elevation}° {size}");
        }
    }
    assert!(limited.iter().all(|wrong| *wrong > 200), "a sun of 1° asks for a limit of 57: {limited:?}");
}

/// The same in the cases that are made for it: no acne on the way down to a sun of 1°.
#[test]
fn no_acne_as_the_sun_sinks() {
    for case in ["st-single-plane", "st-grazing"] {
        let (mut r, mut s) = built_in(case, [160, 100]);
        for elevation in [60.0, 20.0, 6.0, 3.0, 1.0] {
            s.light = rising(elevation, 148.0);
            for resolution in ["resolution=64", "resolution=256", "resolution=1024"] {
                let sets = ["bias_kind=ray-plane", "slope_limit=60", resolution];
                let found = causes(&mut r, &mut s, "shadow-map", &sets);
                assert_eq!(found.counts[0], 0, "{case} {elevation}° {sets:?}: {:?}", found.counts);
            }
        }
    }
}

/// Techniques whose comparisons can be moved.
fn with_maps() -> impl Iterator<Item = &'static techniques::Info> {
    techniques::ALL.iter().copied().filter(|info| info.specs().any(|s| s.name == "bias_kind"))
}

/// Every map, however it is fitted, warped and filtered, keeps a lit floor exactly lit under the sun and a spot, and its shadows.
#[test]
fn every_map_follows_the_rays_of_its_texels() {
    let lamp = spot(Vec3::new(3.0, 7.0, 2.0), Vec3::ZERO, 40.0);
    let mut tried = 0;
    for light in [rising(50.0, 30.0), rising(12.0, 75.0), lamp] {
        let (mut bare, mut b) = start(over_floor(&[], light), [120, 90]);
        let (mut shaded, mut s) = start(boxed(light), [120, 90]);
        // Bounds by moments are lit nearly, not exactly.
        let exact = |info: &&techniques::Info| info.filter.is_none_or(|f| f.moments.is_none());
        for info in with_maps().filter(|info| info.refuses(&light).is_none()).filter(exact) {
            let has = |name| info.specs().any(|s| s.name == name);
            let filters: &[&str] = match info.specs().find(|s| s.name == "filter").map(|s| s.kind) {
                Some(Kind::Choice { .. }) => &["filter=nearest", "mode=grid", "mode=hw2x2"],
                _ => &[""],
            };
            // The high sun with all, the low one and the spot once each.
            for filter in &filters[..if light == rising(50.0, 30.0) { filters.len() } else { 1 }] {
                let mut sets = vec!["bias_kind=ray-plane", "slope_limit=60", "resolution=512"];
                sets.extend(Some(*filter).filter(|f| !f.is_empty()));
                if filter.starts_with("mode") {
                    sets.push("filter=pcf");
                }
                if has("raster") {
                    sets.push("raster=exact");
                }
                let e = errors(&mut bare, &mut b, info.id, &sets);
                assert!(e.rmse == 0.0 && e.facing > 3000, "{} {} {sets:?}: {e:?}", info.id, light.kind());
                let e = errors(&mut shaded, &mut s, info.id, &sets);
                assert!(e.share() < 0.04 && e.shadow_correct > 100, "{} {} {sets:?}: {e:?}", info.id, light.kind());
                tried += 1;
            }
        }
    }
    assert!(tried >= 30, "{tried}");
}

/// A bilinear tap compares four texels with the depth that none of their rays meets the plane before: steep floors stay exactly lit, however wide the filter.
#[test]
fn bilinear_taps_clear_the_rays_of_four_texels() {
    for light in
        [rising(50.0, 20.0), rising(6.0, -30.0), spot(Vec3::new(9.0, 2.5, 1.0), Vec3::new(0.0, 0.0, 0.0), 40.0)]
    {
        let (mut r, mut s) = start(lit_floor(light), [120, 90]);
        for mode in ["mode=grid", "mode=hw2x2", "mode=tent", "mode=disk"] {
            for width in ["1", "3", "9"] {
                let width = if mode == "mode=disk" { format!("radius={width}") } else { format!("kernel={width}") };
                let sets = ["bias_kind=ray-plane", "slope_limit=60", "resolution=256", "fit=scene", mode, &width];
                let e = errors(&mut r, &mut s, "pcf", &sets);
                assert!(e.rmse == 0.0 && e.facing > 2000, "{} {sets:?}: {e:?}", light.kind());
            }
        }
    }
}

/// Where a lit floor meets a lit wall, the plane of each runs into the other: what is never compared farther from the light than
/// the receiver itself has fewer dark spots there, and is as exact on planes.
#[test]
fn inner_corners_stay_lit_toward_the_light() {
    let (mut r, mut s) =
        start(over_floor(&cuboid(Vec3::new(-1.0, 0.0, -1.0), Vec3::splat(1.0)), rising(40.0, 50.0)), [240, 180]);
    for resolution in ["resolution=128", "resolution=256"] {
        let [toward, exact] = ["toward_light=true", "toward_light=false"].map(|way| {
            errors(&mut r, &mut s, "shadow-map", &["bias_kind=ray-plane", "epsilon=10", way, resolution])
                .shadow_incorrect
        });
        assert!(exact > 10 && toward < exact, "{resolution}: {toward} {exact}");
    }
}

/// The view shows nothing where nothing is moved, and on a plane no more than the slope over half a texel's diagonal.
#[test]
fn the_view_shows_how_far_comparisons_are_moved() {
    let (mut r, mut s) = start(over_floor(&[], rising(35.0, 25.0)), [120, 90]);
    s.view = "bias".into();
    let mut most = |sets: &[&str]| {
        select(&mut s, "shadow-map", sets);
        r.render(&s, ask(&s)).unwrap();
        let moved: Vec<f32> = r.read_map().unwrap().into_iter().filter(|m| *m >= 0.0).collect();
        assert!(moved.len() > 3000, "{}", moved.len());
        moved.into_iter().fold(0.0, f32::max)
    };
    let slope = 1.0 / 35.0f32.to_radians().tan();
    let bare = most(&["bias_kind=none", "fit=scene"]);
    assert!(bare < 0.01, "{bare}");
    let plane = most(&["bias_kind=ray-plane", "fit=scene", "epsilon=0.1"]);
    assert!(plane > 0.2 * slope && plane < 0.72 * slope, "{plane} of {slope}");
    let wide = most(&["bias_kind=ray-plane", "fit=scene", "epsilon=10000"]);
    assert!(wide > plane + 1.0, "{wide} {plane}");
}

/// On a closed body over a floor what lies behind the nearest surface leaves no acne with no bias at all, but for a strip at the
/// body's outlines that is as narrow as texels are; and shadows stay.
#[test]
fn depths_behind_the_nearest_surface_need_no_bias() {
    for light in [rising(50.0, 30.0), spot(Vec3::new(3.0, 7.0, 2.0), Vec3::ZERO, 40.0)] {
        let (mut r, mut s) = start(boxed(light), [240, 180]);
        let bare = causes(&mut r, &mut s, "shadow-map", &["bias_kind=none"]);
        assert!(bare.counts[0] > 2000, "{:?}", bare.counts);
        for stored in ["stored=midpoint", "stored=dual", "stored=second"] {
            let acne = ["resolution=512", "resolution=2048"].map(|resolution| {
                let limit = ["dual_limit=1"];
                let mut sets = vec!["bias_kind=none", stored, resolution];
                sets.extend(limit.iter().filter(|_| stored == "stored=dual"));
                let found = causes(&mut r, &mut s, "shadow-map", &sets);
                assert_eq!(found.counts[1], 0, "nothing is detached: {} {sets:?}", light.kind());
                let e = errors(&mut r, &mut s, "shadow-map", &sets);
                assert!(e.shadow_correct > 1000 && e.lit_incorrect < 100, "{e:?}");
                // On the floor there is none, but for stairs.
                let at = r.read_position().unwrap();
                let on_floor = found.classes.iter().zip(&at).filter(|(c, p)| **c == 1 && p[1] < 0.01).count();
                assert!(on_floor < 10, "{} {sets:?}: {on_floor}", light.kind());
                found.counts[0]
            });
            assert!(acne[0] < 300 && acne[1] <= acne[0] / 2, "{} {stored}: {acne:?}", light.kind());
        }
    }
}

/// A slab that is thinner than a bias loses its shadow to it, but not to the depths halfway through it.
#[test]
fn thin_slabs_keep_their_shadows() {
    let slab = cuboid(Vec3::new(-1.0, 0.04, -1.0), Vec3::new(1.0, 0.06, 1.0));
    let (mut r, mut s) = start(over_floor(&slab, rising(20.0, 30.0)), [240, 180]);
    let held = |r: &mut Renderer, s: &mut Setup, sets: &[&str]| {
        let e = errors(r, s, "shadow-map", sets);
        e.shadow_correct as f64 / (e.shadow_correct + e.lit_incorrect) as f64
    };
    let constant = held(&mut r, &mut s, &["resolution=2048", "slope_bias=0", "bias=0.3"]);
    assert!(constant < 0.1, "{constant}");
    for stored in ["stored=midpoint", "stored=dual", "stored=second"] {
        let kept = held(&mut r, &mut s, &["resolution=2048", "bias_kind=none", stored]);
        assert!(kept > 0.9, "{stored}: {kept}");
    }
}

/// Dual depth without a limit is the midpoint; with a limit of nothing it is the nearest surface.
#[test]
fn dual_depth_lies_between_the_nearest_and_the_midpoint() {
    for (technique, light) in [
        ("shadow-map", rising(50.0, 30.0)),
        ("shadow-map", spot(Vec3::new(3.0, 7.0, 2.0), Vec3::ZERO, 40.0)),
        ("pssm", rising(50.0, 30.0)),
        ("lispsm", rising(50.0, 30.0)),
    ] {
        let (mut r, mut s) = start(boxed(light), [160, 120]);
        let mut seen =
            |sets: &[&str]| visible(&mut r, &mut s, technique, &[&["bias_kind=none", "resolution=512"], sets].concat());
        let [nearest, midpoint, second] =
            ["nearest", "midpoint", "second"].map(|stored| seen(&[&format!("stored={stored}")]));
        assert_eq!(seen(&["stored=dual", "dual_limit=100"]), midpoint, "{technique}");
        let none = seen(&["stored=dual", "dual_limit=0"]);
        let apart = none.iter().zip(&nearest).filter(|(a, b)| a != b).count();
        assert!(apart < nearest.len() / 50, "{technique}: {apart} differ from the nearest");
        assert!(nearest != midpoint && midpoint != second, "{technique}");
        // The farther a texel's depth, the less is dark.
        let lit = |v: &[f32]| v.iter().sum::<f32>();
        assert!(lit(&nearest) < lit(&midpoint) && lit(&midpoint) <= lit(&second), "{technique}");
    }
}

/// Sheets have no inside: behind one lies what it shades, and the second depth is that surface's own.
#[test]
fn the_second_depth_fails_behind_sheets() {
    let sheet = floor(Vec2::splat(-1.0), Vec2::splat(1.0), 1.0);
    let (mut r, mut s) = start(over_floor(&sheet, rising(50.0, 30.0)), [160, 120]);
    let mut wrong = |stored: &str| errors(&mut r, &mut s, "shadow-map", &["bias_kind=none", stored]).lit_incorrect;
    let [second, midpoint] = ["stored=second", "stored=midpoint"].map(&mut wrong);
    assert!(second > 200 && midpoint < second / 5, "{second} {midpoint}");
}

/// All maps that casters are drawn into by the rasteriser take two surfaces, in every format and whatever is culled.
#[test]
fn maps_of_every_kind_take_two_surfaces() {
    for info in with_maps() {
        let offered = info.specs().any(|s| s.name == "stored");
        // Not those with a warp; a paraboloid's are drawn as all are.
        let warped = info.specs().any(|s| s.name == "raster") && info.filter.is_some();
        assert_eq!(offered, !warped, "{}", info.id);
    }
    let lamp = spot(Vec3::new(3.0, 7.0, 2.0), Vec3::ZERO, 40.0);
    for light in [rising(50.0, 30.0), lamp] {
        let (mut r, mut s) = start(boxed(light), [160, 120]);
        let stored = with_maps().filter(|i| i.refuses(&light).is_none() && i.specs().any(|s| s.name == "stored"));
        // Filters look the map of the first up.
        for info in stored.filter(|i| i.filter.is_none_or(|f| f.id == "nearest")) {
            for sets in [&["format=32f"][..], &["format=24"], &["format=16"], &["cull=back"]] {
                let sets = [&["bias_kind=none", "stored=midpoint", "resolution=1024"], sets].concat();
                let e = errors(&mut r, &mut s, info.id, &sets);
                assert!(e.share() < 0.05 && e.shadow_correct > 200, "{} {} {sets:?}: {e:?}", info.id, light.kind());
            }
        }
    }
}

/// A setting, its wrong pixels, and those of acne and detachment, as shares of the pixels that face the light.
type Found = (String, f64, f64);

fn measured(r: &mut Renderer, s: &mut Setup, sets: &[String]) -> Found {
    let all: Vec<&str> = sets.iter().map(String::as_str).chain(["resolution=512"]).collect();
    let found = causes(r, s, "shadow-map", &all);
    let share = |counts: &[usize]| counts.iter().sum::<usize>() as f64 / found.facing.max(1) as f64;
    (sets.join(" "), share(&found.counts), share(&found.counts[..2]))
}

/// Prints the table of `docs/bias.md`: for each built-in scene and light the best of many settings of each kind.
#[test]
#[ignore = "takes minutes, and is a measurement: the table of docs/bias.md"]
fn the_best_bias_of_each_scene() {
    let grid = |rows: &[(&str, &[&str])]| {
        rows.iter().fold(vec![Vec::new()], |all: Vec<Vec<String>>, (name, values)| {
            let more = |sets: &Vec<String>| {
                let one = |v: &&str| [sets.clone(), vec![format!("{name}={v}")]].concat();
                values.iter().map(one).collect::<Vec<_>>()
            };
            all.iter().flat_map(more).collect()
        })
    };
    let kinds = [
        grid(&[
            ("slope_bias", &["0"]),
            ("bias", &["0.002", "0.005", "0.01", "0.02", "0.05", "0.1", "0.2", "0.5", "1", "2"]),
        ]),
        grid(&[("bias", &["0.002", "0.01", "0.05"]), ("slope_bias", &["0.5", "0.75", "1", "1.5"])]),
        grid(&[
            ("bias_kind", &["ray-plane"]),
            ("slope_limit", &["10", "60"]),
            ("toward_light", &["true", "false"]),
            ("epsilon", &["10", "100", "300", "1000"]),
        ]),
    ];
    let defaults = [vec![], vec!["bias_kind=ray-plane".to_string()]];
    let share = |x: f64| format!("{:.2}", 100.0 * x);
    // For each setting the sum of logarithms of its wrong pixels over those of the row's best, with a tenth of a per cent on top of
    // both, so that rows without errors count too.
    let (mut sums, mut rows) = (BTreeMap::<String, f64>::new(), 0.0);
    let names = [
        "bench",
        "blocks",
        "arches",
        "hall",
        "observatory",
        "pavilion",
        "cubes",
        "terrain",
        "st-grazing",
        "st-single-plane",
    ];
    for name in names {
        let (setup, scene) = Setup::open(name).unwrap();
        let lights = scene.lights.clone();
        let mut r = Renderer::new(gpu(), Arc::new(scene)).unwrap();
        for named in lights.iter().filter(|l| techniques::find("shadow-map").unwrap().refuses(&l.light).is_none()) {
            let mut s = Setup { size: [320, 200], light: named.light, ..setup.clone() };
            let mut row = format!("| {name} | {} |", named.name);
            let mut every = Vec::new();
            for sets in &kinds {
                let all: Vec<Found> = sets.iter().map(|sets| measured(&mut r, &mut s, sets)).collect();
                let best = all.iter().min_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
                let spared = all.iter().map(|f| f.2).fold(f64::INFINITY, f64::min);
                row += &format!(" {} `{}` | {} |", share(best.1), best.0, share(spared));
                every.extend(all);
            }
            for sets in &defaults {
                row += &format!(" {} |", share(measured(&mut r, &mut s, sets).1));
            }
            println!("{row}");
            rows += 1.0;
            let best = every.iter().map(|f| f.1).fold(f64::INFINITY, f64::min);
            every.into_iter().for_each(|f| *sums.entry(f.0).or_default() += ((f.1 + 1e-3) / (best + 1e-3)).ln());
        }
    }
    let mut means: Vec<_> = sums.into_iter().map(|(setting, sum)| ((sum / rows).exp(), setting)).collect();
    means.sort_by(|a, b| a.0.total_cmp(&b.0));
    means.iter().for_each(|(mean, setting)| println!("{mean:.3} × the best: {setting}"));
}
