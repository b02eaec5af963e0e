//! Techniques against the truth, against closed forms and against each other.

use crate::common::*;
use glam::{DMat4, DQuat, DVec3, Vec2, Vec3};
use shadowscope::frame::{Ask, Renderer, Truth};
use shadowscope::light::Light;
use shadowscope::measure;
use shadowscope::measure::Step;
use shadowscope::measure::metrics::{Errors, FACING};
use shadowscope::params::{Condition, Kind, Spec, Test, Value, Values};
use shadowscope::scene::{
    Animation, Camera, Channel, Clock, Interpolation, Local, Material, Node, Property, Scene, Texture, builtin,
};
use shadowscope::setup::{Base, Setup, scene_camera};
use shadowscope::techniques::{self, Info};
use std::collections::{BTreeMap, BTreeSet};

/// A built-in scene at a size.
fn built_in(name: &str, camera: &str, size: [u32; 2]) -> (Renderer, Setup) {
    let scene = builtin::build(name).unwrap();
    let camera = scene_camera(&scene, camera, Clock::default()).unwrap();
    let (renderer, mut setup) = start(scene, size);
    setup.camera = camera;
    (renderer, setup)
}

fn errors(renderer: &mut Renderer, setup: &mut Setup, technique: &str, sets: &[&str]) -> Errors {
    setup.select(technique).unwrap();
    setup.params.clear();
    setup.complete();
    for s in sets {
        setup.set(s, &[technique.into()]).unwrap();
    }
    measure::errors(renderer, setup).unwrap()
}

/// The visibility of the pixels that face the light.
fn visible(renderer: &mut Renderer, setup: &Setup) -> Vec<f32> {
    renderer.render(setup, Ask { truth: Truth::Off, ..ask(setup) }).unwrap();
    let (v, mask) = (renderer.read_visibility().unwrap(), renderer.read_mask().unwrap());
    v.into_iter().zip(mask).filter(|(_, m)| *m == FACING).map(|(v, _)| v).collect()
}

/// A box seen from outside.
pub fn cuboid(low: Vec3, high: Vec3) -> Vec<[Vec3; 3]> {
    let p = |i: usize| Vec3::from_array([0, 1, 2].map(|a| if i >> a & 1 == 1 { high[a] } else { low[a] }));
    let faces = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    faces.iter().flat_map(|f| [[p(f[0]), p(f[1]), p(f[2])], [p(f[0]), p(f[2]), p(f[3])]]).collect()
}

/// A box that hovers over a floor.
fn hovering(light: Light) -> Scene {
    let mut triangles = floor(Vec2::splat(-6.0), Vec2::splat(6.0), 0.0);
    triangles.extend(cuboid(Vec3::new(-1.0, 0.8, -1.0), Vec3::new(1.0, 2.4, 1.2)));
    let view = camera(Vec3::new(4.0, 6.0, 7.0), Vec3::ZERO);
    scene(vec![mesh(&triangles, 0)], vec![material(Vec3::splat(0.8))], view, light)
}

fn spot() -> Light {
    Light::Spot {
        position: Vec3::new(-3.0, 7.0, 2.0),
        direction: Vec3::new(0.45, -1.0, -0.3),
        outer_angle: 33.0,
        range: 40.0,
        radius: 0.0,
        color: Vec3::splat(50.0),
    }
}

/// The counts of a technique that is the truth itself add up and hold no error.
#[test]
fn the_reference_has_no_error() {
    let (mut r, mut s) = built_in("bench", "flowers-against", [192, 108]);
    let e = errors(&mut r, &mut s, "rt-hard", &[]);
    assert_eq!((e.lit_incorrect, e.shadow_incorrect, e.rmse, e.boundary), (0, 0, 0.0, None));
    assert!(e.lit_correct > 1000 && e.shadow_correct > 1000, "{e:?}");
    assert_eq!(e.facing + e.away + e.background, 192 * 108);
}

/// Morais 2015, tables 7 to 9: doubling the resolution halves the error.
#[test]
fn a_shadow_maps_error_halves_as_its_resolution_doubles() {
    let (mut r, mut s) = built_in("bench", "trees-side", [480, 270]);
    let mut last: Option<f64> = None;
    for resolution in [256, 512, 1024, 2048] {
        let share = errors(&mut r, &mut s, "shadow-map", &[&format!("resolution={resolution}")]).share();
        if let Some(last) = last {
            let ratio = share / last;
            assert!((0.35..0.7).contains(&ratio), "{resolution}: {share} after {last}, ratio {ratio}");
        }
        last = Some(share);
    }
    assert!(last.unwrap() < 0.004, "{last:?}");
}

/// The fit to the receivers gives smaller texels than the whole scene, so fewer errors.
#[test]
fn fitting_to_the_receivers_pays() {
    // The spot's cone is narrow already: less to gain.
    for (light, gain) in [("sun", 0.6), ("spot", 0.8)] {
        let (mut r, mut s) = built_in("bench", "flowers-side", [240, 135]);
        s.light = r.scene().lights.iter().find(|l| l.name == light).unwrap().light;
        let whole = errors(&mut r, &mut s, "shadow-map", &["fit=scene"]).share();
        let fitted = errors(&mut r, &mut s, "shadow-map", &["fit=receivers"]).share();
        assert!(fitted < gain * whole, "{light}: fitted {fitted}, whole {whole}");
    }
}

/// Under a directional and a spot light, with every fit, format and cull that keeps the box's shadow.
#[test]
fn every_setting_keeps_the_shadow() {
    for light in [sun(Vec3::new(0.4, 1.0, 0.3)), spot()] {
        let (mut r, mut s) = start(hovering(light), [160, 120]);
        for fit in ["receivers", "scene", "msf"] {
            for format in ["32f", "24", "16"] {
                for cull in ["none", "front", "back"] {
                    // Sixteen bits of a perspective depth are coarse: that bias is their price.
                    let bias = if format == "16" { 0.02 } else { 0.002 };
                    let sets = [
                        format!("fit={fit}"),
                        format!("format={format}"),
                        format!("cull={cull}"),
                        format!("bias={bias}"),
                    ];
                    let sets: Vec<&str> = sets.iter().map(String::as_str).collect();
                    let e = errors(&mut r, &mut s, "shadow-map", &sets);
                    let limit = if format == "16" { 0.03 } else { 0.012 };
                    assert!(e.shadow_correct > 150, "{sets:?}: {e:?}");
                    assert!(e.share() < limit, "{} {sets:?}: {} {e:?}", light.kind(), e.share());
                }
            }
        }
    }
}

/// Without bias a surface shadows itself; with too much the shadow leaves its caster.
#[test]
fn bias_trades_acne_for_detachment() {
    let mut triangles = floor(Vec2::splat(-4.0), Vec2::splat(4.0), 0.0);
    triangles.extend(cuboid(Vec3::new(-0.5, 0.0, -0.5), Vec3::new(0.5, 0.04, 0.5)));
    let view = camera(Vec3::new(-0.9, 0.5, 0.1), Vec3::new(-0.5, 0.0, 0.0));
    let scene = scene(vec![mesh(&triangles, 0)], vec![material(Vec3::ONE)], view, sun(Vec3::new(1.0, 0.6, 0.2)));
    let (mut r, mut s) = start(scene, [160, 120]);
    let acne = errors(&mut r, &mut s, "shadow-map", &["bias=0", "slope_bias=0"]);
    let good = errors(&mut r, &mut s, "shadow-map", &["resolution=2048"]);
    let detached = errors(&mut r, &mut s, "shadow-map", &["bias=0.1", "slope_bias=0", "resolution=2048"]);
    assert!(acne.shadow_incorrect * 10 > acne.facing, "{acne:?}");
    assert!(good.share() < 0.005, "{good:?}");
    assert!(good.shadow_correct > 300, "{good:?}");
    assert_eq!((detached.shadow_correct, detached.shadow_incorrect), (0, 0), "{detached:?}");
}

/// The wrong pixels of a technique by cause: acne, detachment, leak, missing caster, stairs.
fn causes(r: &mut Renderer, s: &mut Setup, technique: &str, sets: &[&str]) -> [usize; 5] {
    let e = errors(r, s, technique, sets);
    r.render(s, Ask { analysis: true, ..ask(s) }).unwrap();
    let found = r.read_causes().unwrap();
    assert_eq!(found.counts.iter().sum::<usize>(), e.lit_incorrect + e.shadow_incorrect, "{technique} {sets:?}");
    assert_eq!(found.facing, e.facing);
    let shown = Setup { view: "causes".into(), ..s.clone() };
    r.render(&shown, ask(&shown)).unwrap();
    assert_eq!(r.causes(), Some(&found), "the view shows the same");
    // What is right says so under the pointer.
    let mask = r.read_mask().unwrap();
    let right = (0..mask.len()).find(|i| mask[*i] == FACING && found.classes[*i] == 0).unwrap() as u32;
    let at = [right % s.size[0], right / s.size[0]];
    assert_eq!(r.value_at(at).unwrap().as_deref(), Some("right"));
    found.counts
}

/// Each way to spoil a shadow is called by its name.
#[test]
fn errors_are_told_by_their_cause() {
    let (mut r, mut s) = built_in("st-contact", "default", [320, 200]);
    let most = |counts: [usize; 5], cause: usize, rest: usize| {
        let all: usize = counts.iter().sum();
        assert!(all > 50 && (all - counts[cause]) * rest < all, "{cause} of {counts:?}");
    };
    most(causes(&mut r, &mut s, "shadow-map", &["bias=0", "slope_bias=0"]), 0, 5);
    most(causes(&mut r, &mut s, "shadow-map", &["bias=0.1", "resolution=2048"]), 1, 8);
    most(causes(&mut r, &mut s, "shadow-map", &["bias=0", "slope_bias=1", "resolution=96"]), 4, 2);
    // A kernel hides no wrong bias, and rays make no error.
    most(causes(&mut r, &mut s, "pcf", &["bias=0.1", "resolution=2048"]), 1, 8);
    assert_eq!(causes(&mut r, &mut s, "rt-hard", &[]), [0; 5]);
}

/// Light that passes through part of a caster leaks, also where nothing has texels; where all of it passes the caster is
/// missing.
#[test]
fn a_leak_is_no_missing_caster() {
    let sheet = |turned: &dyn Fn(f32) -> bool| {
        let mut triangles = floor(Vec2::splat(-6.0), Vec2::splat(6.0), 0.0);
        for i in 0..8 {
            let x = -2.0 + 0.5 * i as f32;
            for [a, b, c] in floor(Vec2::new(x, -2.0), Vec2::new(x + 0.5, 2.0), 1.5) {
                triangles.push(if turned(x) { [a, c, b] } else { [a, b, c] });
            }
        }
        let view = camera(Vec3::new(4.0, 7.0, 7.0), Vec3::ZERO);
        let light = sun(Vec3::new(0.3, 1.0, 0.2));
        start(scene(vec![mesh(&triangles, 0)], vec![material(Vec3::ONE)], view, light), [240, 180])
    };
    // The ray that stops only at front faces goes through what is turned.
    let one_sided = ["two_sided=false"];
    let (mut r, mut s) = sheet(&|_| true);
    let [acne, detached, leak, missing, stairs] = causes(&mut r, &mut s, "rt-hard", &one_sided);
    assert!(missing > 500 && acne + detached + leak + stairs == 0, "{:?}", [acne, detached, leak, missing, stairs]);
    let (mut r, mut s) = sheet(&|x| x < -0.5);
    let [acne, detached, leak, missing, stairs] = causes(&mut r, &mut s, "rt-hard", &one_sided);
    assert!(leak > 150 && acne + detached + missing == 0 && stairs < leak, "{:?}", [leak, missing, stairs]);
    let (mut r, mut s) = sheet(&|_| false);
    assert_eq!(causes(&mut r, &mut s, "rt-hard", &one_sided), [0; 5]);
}

/// Marked errors grow by as many pixels as asked for, over light as over dark; the density is that of the definition, and
/// FLIP's map has FLIP's mean.
#[test]
fn views_of_errors_show_the_errors() {
    let (mut r, mut s) = built_in("st-contact", "default", [160, 100]);
    errors(&mut r, &mut s, "shadow-map", &["resolution=64"]);
    let [w, h] = s.size.map(|x| x as usize);
    let mut draw = |s: &Setup| {
        r.render(s, ask(s)).unwrap();
        r.read_picture().unwrap()
    };
    for view in ["error", "causes", "error-size"] {
        let at = |dilation, base| Setup { view: view.into(), error_dilation: dilation, error_base: base, ..s.clone() };
        // What differs between dark and light is no mark.
        let mut marks = |dilation| {
            let [dark, light] = [Base::Dark, Base::Light].map(|base| draw(&at(dilation, base)));
            let pairs = dark.chunks_exact(4).zip(light.chunks_exact(4));
            pairs.map(|(a, b)| a == b).collect::<Vec<bool>>()
        };
        let wrong = marks(0);
        assert!(wrong.iter().filter(|m| **m).count() > 50, "{view}");
        for n in 1..=2usize {
            let near = |i: usize| {
                let (x, y) = (i % w, i / w);
                (y.saturating_sub(n)..(y + n + 1).min(h))
                    .any(|y| (x.saturating_sub(n)..(x + n + 1).min(w)).any(|x| wrong[y * w + x]))
            };
            assert_eq!(marks(n as u32), (0..w * h).map(near).collect::<Vec<bool>>(), "{view}, {n}");
        }
    }
    let window = 7;
    s.view = "error-density".into();
    s.error_window = window as u32;
    r.render(&s, ask(&s)).unwrap();
    let (v, t, mask) = (r.read_visibility().unwrap(), r.read_hard_truth().unwrap(), r.read_mask().unwrap());
    for (i, share) in r.read_map().unwrap().into_iter().enumerate() {
        let (x, y) = (i % w, i / w);
        let near = |j: &usize| (j % w).abs_diff(x) <= window / 2 && (j / w).abs_diff(y) <= window / 2;
        let around: Vec<usize> = (0..w * h).filter(near).filter(|j| mask[*j] == FACING).collect();
        let wrong = around.iter().filter(|j| (v[**j] >= 0.5) != (t[**j] >= 0.5)).count();
        let expected = if mask[i] == FACING { wrong as f32 / around.len() as f32 } else { -1.0 };
        assert_eq!(share, expected, "{x}, {y}");
    }
    s.view = "flip".into();
    r.render(&s, ask(&s)).unwrap();
    let map = r.read_map().unwrap();
    s.view = "shaded".into();
    r.render(&s, ask(&s)).unwrap();
    let (picture, exact) = (r.read_picture().unwrap(), r.read_truth_picture(&s).unwrap());
    let mean = map.iter().map(|x| f64::from(*x)).sum::<f64>() / map.len() as f64;
    assert!(mean > 0.0 && mean == measure::metrics::flip(&exact, &picture, s.size), "{mean}");
}

/// A floor alone is lit everywhere, exactly, under every filter and bias that should hold.
#[test]
fn a_lit_plane_stays_lit() {
    for light in [sun(Vec3::new(0.9, 1.0, 0.3)), sun(Vec3::new(1.0, 0.2, 0.0)), spot()] {
        let ground = floor(Vec2::splat(-5.0), Vec2::splat(5.0), 0.0);
        let view = camera(Vec3::new(0.0, 3.0, 5.0), Vec3::ZERO);
        let (mut r, mut s) = start(scene(vec![mesh(&ground, 0)], vec![material(Vec3::ONE)], view, light), [160, 120]);
        for mode in ["grid", "hw2x2", "tent", "disk"] {
            for kernel in [1, 3, 5, 7, 9] {
                for plane in ["false", "true"] {
                    let sets = [
                        format!("mode={mode}"),
                        format!("kernel={kernel}"),
                        format!("receiver_plane={plane}"),
                        "rotate=true".into(),
                    ];
                    let sets: Vec<&str> = sets.iter().map(String::as_str).collect();
                    let e = errors(&mut r, &mut s, "pcf", &sets);
                    assert_eq!(e.rmse, 0.0, "{} {sets:?}: {e:?}", light.kind());
                }
            }
        }
    }
}

/// A kernel of one texel is the standard shadow map, and a grid is the mean of its comparisons.
#[test]
fn pcf_compares_first_and_averages_after() {
    let (mut r, mut s) = start(hovering(sun(Vec3::new(0.4, 1.0, 0.3))), [160, 120]);
    for technique in ["shadow-map", "pcf"] {
        s.select(technique).unwrap();
        s.set("resolution=256", &[technique.into()]).unwrap();
        s.set("fit=scene", &[technique.into()]).unwrap();
    }
    s.select("shadow-map").unwrap();
    let hard = visible(&mut r, &s);
    s.select("pcf").unwrap();
    s.set("kernel=1", &["pcf".into()]).unwrap();
    assert_eq!(visible(&mut r, &s), hard);
    for kernel in [3, 5, 7, 9] {
        s.set(&format!("kernel={kernel}"), &["pcf".into()]).unwrap();
        let soft = visible(&mut r, &s);
        let n = (kernel * kernel) as f32;
        assert!(soft.iter().all(|v| (v * n - (v * n).round()).abs() < 1e-3), "kernel {kernel}: not a count of {n}");
        assert!(soft.iter().any(|v| *v > 0.2 && *v < 0.8), "kernel {kernel}: no transition");
        // The wider the kernel, the wider the transition.
        let share = soft.iter().filter(|v| **v > 0.0 && **v < 1.0).count();
        assert!(share > kernel * 25, "kernel {kernel}: {share} pixels in transition");
    }
}

/// A straight edge filtered by a tent rises as the tent's integral says.
#[test]
fn a_tent_filters_as_its_integral() {
    // A half plane above the floor; the sun straight above: the shadow ends at x = 0.
    let mut triangles = floor(Vec2::splat(-4.0), Vec2::splat(4.0), 0.0);
    triangles.extend(floor(Vec2::new(-4.0, -4.0), Vec2::new(0.0, 4.0), 1.0));
    let view = camera(Vec3::new(0.001, 0.9, 0.0), Vec3::new(0.0, 0.0, 0.001));
    let scene = scene(vec![mesh(&triangles, 0)], vec![material(Vec3::ONE)], view, sun(Vec3::Y));
    let (mut r, mut s) = start(scene, [256, 64]);
    s.select("pcf").unwrap();
    for set in ["mode=tent", "kernel=5", "resolution=64", "fit=scene"] {
        s.set(set, &["pcf".into()]).unwrap();
    }
    r.render(&s, ask(&s)).unwrap();
    let (v, p) = (r.read_visibility().unwrap(), r.read_position().unwrap());
    // The map covers 8 m with 64 texels: an eighth of a metre each, and the edge lies between two of them.
    let (texel, h) = (8.0 / 64.0, 2.5f32);
    let integral = |x: f32| match x {
        x if x <= -h => 0.0,
        x if x < 0.0 => (x + h) * (x + h) / (2.0 * h * h),
        x if x < h => 1.0 - (h - x) * (h - x) / (2.0 * h * h),
        _ => 1.0,
    };
    let mut seen = 0;
    for (v, p) in v.iter().zip(&p).filter(|(_, p)| p[1].abs() < 1e-4 && p[0].abs() < 0.5) {
        let exact = integral(p[0] / texel);
        // The sampler's bilinear weights have eight bits.
        assert!((v - exact).abs() < 0.012, "at x = {}: {v} instead of {exact}", p[0]);
        seen += 1;
    }
    assert!(seen > 1000, "{seen}");
}

/// PCF with a wide grid on a slope shadows itself without a bias that follows the kernel or the plane.
#[test]
fn bias_follows_the_kernel_or_the_plane() {
    let ground = floor(Vec2::splat(-5.0), Vec2::splat(5.0), 0.0);
    let view = camera(Vec3::new(0.0, 3.0, 5.0), Vec3::ZERO);
    let sloping = scene(vec![mesh(&ground, 0)], vec![material(Vec3::ONE)], view, sun(Vec3::new(1.0, 0.5, 0.0)));
    let (mut r, mut s) = start(sloping, [128, 96]);
    let naive = errors(&mut r, &mut s, "pcf", &["kernel=9", "slope_bias=0.1"]);
    let plane = errors(&mut r, &mut s, "pcf", &["kernel=9", "slope_bias=0.75", "receiver_plane=true"]);
    assert!(naive.rmse > 0.1, "{naive:?}");
    assert_eq!(plane.rmse, 0.0, "{plane:?}");
}

/// Alpha-masked holes are holes for the camera, for every map and for rays alike.
#[test]
fn masked_holes_let_light_through() {
    let mut card = mesh(&floor(Vec2::splat(-2.0), Vec2::splat(2.0), 2.0), 1);
    card.uvs = card.positions.iter().map(|p| (Vec2::new(p.x, p.z) + 2.0) / 4.0).collect();
    // A chequerboard of 4 × 4 fields, each 16 texels wide.
    let rgba = (0..64 * 64).flat_map(|i| [200, 220, 90, if (i % 64 / 16 + i / 64 / 16) % 2 == 0 { 255 } else { 0 }]);
    let texture = Texture { width: 64, height: 64, rgba: rgba.collect(), ..Texture::default() };
    let masked = Material { texture: Some(0), alpha_cutoff: Some(0.5), ..material(Vec3::ONE) };
    let ground = mesh(&floor(Vec2::splat(-5.0), Vec2::splat(5.0), 0.0), 0);
    let view = camera(Vec3::new(1.0, 5.0, 6.0), Vec3::new(0.0, 0.5, 0.0));
    let mut with_card =
        scene(vec![ground, card], vec![material(Vec3::ONE), masked], view, sun(Vec3::new(0.2, 1.0, 0.1)));
    with_card.textures = vec![texture];
    let (mut r, mut s) = start(with_card, [200, 150]);
    for technique in ["shadow-map", "pcf"] {
        let e = errors(&mut r, &mut s, technique, &["resolution=2048"]);
        assert!(e.share() < 0.01, "{technique}: {e:?}");
    }
    let truth = r.read_truth().unwrap();
    let position = r.read_position().unwrap();
    // Straight under each field's middle the floor is lit where the card has a hole.
    let mut checked = 0;
    for (v, p) in truth.iter().zip(&position).filter(|(_, p)| p[1].abs() < 1e-4 && p[3] > 0.0) {
        let above = Vec2::new(p[0] + 0.4, p[2] + 0.2);
        let field = (above + 2.0).floor();
        let middle = (above + 2.0 - field - 0.5).abs().max_element() < 0.4;
        if middle && above.abs().max_element() < 2.0 {
            let solid = (field.x as i32 + field.y as i32) % 2 == 0;
            assert_eq!(*v, if solid { 0.0 } else { 1.0 }, "floor at {p:?}");
            checked += 1;
        }
    }
    assert!(checked > 500, "{checked}");
    // And the camera looks through the holes too.
    assert!(r.read_surface().unwrap().iter().zip(&position).any(|(_, p)| p[1] > 1.9));
}

/// A mirrored and a double-sided material: what the camera sees turns its normal to it.
#[test]
fn back_faces_are_culled_unless_double_sided() {
    let down: Vec<_> = floor(Vec2::splat(-1.0), Vec2::splat(1.0), 0.0).iter().map(|t| [t[0], t[2], t[1]]).collect();
    let view = camera(Vec3::new(0.0, 3.0, 1.0), Vec3::ZERO);
    let count = |double_sided: bool, mirror: bool| {
        let mat = Material { double_sided, ..material(Vec3::ONE) };
        let mut test = scene(vec![mesh(&down, 0)], vec![mat], view, sun(Vec3::Y));
        if mirror {
            test.nodes[0].local = Local::Matrix(DMat4::from_scale(DVec3::new(1.0, -1.0, 1.0)));
        }
        let (mut r, s) = start(test, [64, 48]);
        r.render(&s, ask(&s)).unwrap();
        r.read_mask().unwrap().iter().filter(|m| **m == FACING).count()
    };
    assert_eq!(count(false, false), 0, "a back face is culled");
    assert!(count(true, false) > 100, "a double-sided back face is seen and faces the light");
    assert_eq!(count(true, false), count(false, true), "a mirror turns the winding");
}

/// A box that an animation carries over the floor: raster, rays and bounds follow the clock.
#[test]
fn geometry_and_bvh_follow_the_clock() {
    let ground = mesh(&floor(Vec2::splat(-6.0), Vec2::splat(6.0), 0.0), 0);
    let block = mesh(&cuboid(Vec3::new(-0.5, 1.0, -0.5), Vec3::new(0.5, 2.0, 0.5)), 0);
    let view = camera(Vec3::new(0.0, 8.0, 7.0), Vec3::ZERO);
    let mut moving = scene(vec![ground, block], vec![material(Vec3::ONE)], view, sun(Vec3::new(0.2, 1.0, 0.0)));
    moving.nodes[0].meshes = vec![0];
    let identity = Local::Trs { translation: DVec3::ZERO, rotation: DQuat::IDENTITY, scale: DVec3::ONE };
    moving.nodes.push(Node { parent: Some(0), local: identity, meshes: vec![1], ..Node::default() });
    moving.animations.push(Animation {
        name: "slide".into(),
        channels: vec![Channel {
            node: 1,
            property: Property::Translation,
            interpolation: Interpolation::Linear,
            times: vec![0.0, 2.0],
            values: vec![Vec3::new(-3.0, 0.0, 0.0).extend(0.0), Vec3::new(3.0, 0.0, 0.0).extend(0.0)],
        }],
    });
    let (mut r, mut s) = start(moving, [160, 120]);
    for time in [0.0, 0.5, 1.0, 2.0] {
        s.time = time;
        let e = errors(&mut r, &mut s, "shadow-map", &["resolution=2048"]);
        assert!(e.share() < 0.004 && e.shadow_correct > 100, "t = {time}: {e:?}");
        let (v, p) = (r.read_truth().unwrap(), r.read_position().unwrap());
        let dark: Vec<f32> = v
            .iter()
            .zip(&p)
            .filter(|(v, p)| **v == 0.0 && p[1].abs() < 1e-4 && p[3] > 0.0)
            .map(|(_, p)| p[0])
            .collect();
        let middle = dark.iter().sum::<f32>() / dark.len() as f32;
        // The box's middle is 1.5 m up, so its shadow falls 0.3 m to the left of it.
        let expected = -3.0 + 3.0 * time - 0.3;
        assert!((middle - expected).abs() < 0.15, "t = {time}: the shadow is at {middle}, not {expected}");
    }
}

/// The truth goes on in bands and ends where one go would; a change of the camera starts it anew.
#[test]
fn a_progressive_truth_ends_the_same() {
    use shadowscope::frame::{Ask, Truth};
    let (mut r, s) = start(hovering(spot()), [160, 120]);
    r.render(&s, ask(&s)).unwrap();
    let whole = r.read_truth().unwrap();
    let mut other = s.clone();
    other.camera.position.x += 0.5;
    r.render(&other, ask(&other)).unwrap();
    assert_ne!(r.read_truth().unwrap(), whole);
    let mut steps = 0;
    loop {
        let told = r.render(&s, Ask { truth: Truth::Some(1600), ..ask(&s) }).unwrap();
        steps += 1;
        if told.truth.done == 1.0 {
            break;
        }
        assert!(steps < 20, "{told:?}");
    }
    assert!(steps > 5, "{steps}");
    assert_eq!(r.read_truth().unwrap(), whole);
}

/// A node that slides `from` one place `to` another, and grows from one scale to the other, in two seconds.
fn moving(parts: Vec<[Vec3; 3]>, from: (Vec3, f32), to: (Vec3, f32)) -> Scene {
    let ground = mesh(&floor(Vec2::splat(-6.0), Vec2::splat(6.0), 0.0), 0);
    let view = camera(Vec3::new(0.0, 8.0, 7.0), Vec3::ZERO);
    let meshes = vec![ground, mesh(&parts, 0)];
    let mut scene = scene(meshes, vec![material(Vec3::ONE)], view, sun(Vec3::new(0.2, 1.0, 0.1)));
    scene.nodes[0].meshes = vec![0];
    let (translation, scale) = (from.0.as_dvec3(), DVec3::splat(from.1 as f64));
    let local = Local::Trs { translation, rotation: DQuat::IDENTITY, scale };
    scene.nodes.push(Node { parent: None, local, meshes: vec![1], ..Node::default() });
    let channel = |property, from: Vec3, to: Vec3| Channel {
        node: 1,
        property,
        interpolation: Interpolation::Linear,
        times: vec![0.0, 2.0],
        values: vec![from.extend(0.0), to.extend(0.0)],
    };
    let channels = vec![
        channel(Property::Translation, from.0, to.0),
        channel(Property::Scale, Vec3::splat(from.1), Vec3::splat(to.1)),
    ];
    scene.animations.push(Animation { name: "move".into(), channels });
    scene
}

/// What was a point, a duplicate or inside out at the clock's start is none later: every frame is as good as a file
/// that stands there.
#[test]
fn an_animation_may_begin_degenerate() {
    let body = || cuboid(Vec3::new(-1.0, 0.5, -1.0), Vec3::new(1.0, 1.5, 1.0));
    let sheet = || floor(Vec2::splat(-6.0), Vec2::splat(6.0), 0.0);
    for (name, parts, from, to) in [
        ("grows from a point", body(), (Vec3::ZERO, 0.0), (Vec3::ZERO, 2.0)),
        ("rises off its duplicate", sheet(), (Vec3::ZERO, 1.0), (Vec3::Y * 2.0, 1.0)),
        ("turns inside out", body(), (Vec3::Y * 3.0, 1.0), (Vec3::Y * 3.0, -1.0)),
    ] {
        let (mut r, mut s) = start(moving(parts.clone(), from, to), [160, 120]);
        // Not the middle, where the last one is a point.
        s.time = 1.5;
        let moved = errors(&mut r, &mut s, "shadow-map", &["resolution=2048"]);
        let at = (from.0.lerp(to.0, 0.75), from.1 + (to.1 - from.1) * 0.75);
        let (mut r, mut s) = start(moving(parts, at, at), [160, 120]);
        let still = errors(&mut r, &mut s, "shadow-map", &["resolution=2048"]);
        assert_eq!(moved, still, "{name}");
        assert!(still.share() < 0.01, "{name}: {still:?}");
    }
}

/// Hundreds of triangles in one place are legal: the BVH must not nest without end.
#[test]
fn many_triangles_in_one_place_are_taken() {
    let mut triangles = floor(Vec2::splat(-4.0), Vec2::splat(4.0), 0.0);
    triangles.extend([[Vec3::new(-1.0, 1.0, -1.0), Vec3::new(-1.0, 1.0, 1.0), Vec3::new(1.0, 1.0, 0.0)]; 600]);
    triangles.extend([[Vec3::new(2.0, 1.0, 2.0); 3]; 3000]);
    let view = camera(Vec3::new(0.0, 6.0, 5.0), Vec3::ZERO);
    let (mut r, mut s) = start(
        scene(vec![mesh(&triangles, 0)], vec![material(Vec3::ONE)], view, sun(Vec3::new(0.3, 1.0, 0.0))),
        [96, 72],
    );
    let e = errors(&mut r, &mut s, "shadow-map", &["resolution=2048"]);
    assert!(e.share() < 0.01 && e.shadow_correct > 50, "{e:?}");
}

/// On a slope the receiver's plane alone keeps the acne away, for one sample and for many, at any size of the world.
#[test]
fn the_receivers_plane_replaces_the_slope_bias() {
    for size in [1.0, 1e6] {
        let ground = floor(Vec2::splat(-5.0 * size), Vec2::splat(5.0 * size), 0.0);
        let mut view = camera(Vec3::new(0.0, 3.0, 5.0) * size, Vec3::ZERO);
        (view.near, view.far) = (0.1 * size, 200.0 * size);
        let sloping = scene(vec![mesh(&ground, 0)], vec![material(Vec3::ONE)], view, sun(Vec3::new(1.0, 0.5, 0.0)));
        let (mut r, mut s) = start(sloping, [128, 96]);
        let slope = ["bias=0.002", "slope_bias=0.75"];
        assert_eq!(errors(&mut r, &mut s, "shadow-map", &slope).rmse, 0.0, "slope bias at size {size}");
        if size == 1.0 {
            let bare = errors(&mut r, &mut s, "shadow-map", &["slope_bias=0"]);
            let plane = errors(&mut r, &mut s, "shadow-map", &["slope_bias=0", "receiver_plane=true"]);
            assert!(bare.share() > 0.05, "{bare:?}");
            assert_eq!(plane.rmse, 0.0, "{plane:?}");
        }
    }
}

/// The map's picture shows what the light sees, near bright, under parallel light and under a spot.
#[test]
fn the_maps_picture_tells_near_from_far() {
    for light in [sun(Vec3::new(0.1, 1.0, 0.05)), spot()] {
        let (mut r, mut s) = start(hovering(light), [120, 120]);
        s.view = "shadow-map".into();
        r.render(&s, ask(&s)).unwrap();
        let picture = r.read_picture().unwrap();
        assert!(picture.chunks_exact(4).all(|p| p[0] == p[1] && p[1] == p[2]), "depth is grey");
        let values: Vec<u8> = picture.chunks_exact(4).map(|p| p[0]).collect();
        let bright = values.iter().filter(|v| **v > 60).count();
        let dark = values.iter().filter(|v| **v < 40).count();
        assert!(bright > 500 && dark > 500, "{}: {bright} bright, {dark} dark", light.kind());
    }
}

/// Rays that give up are counted and said.
#[test]
fn rays_that_give_up_are_reported() {
    let (mut r, mut s) = built_in("bench", "flowers-against", [160, 90]);
    errors(&mut r, &mut s, "rt-hard", &["max_visits=16"]);
    let [own, truth] = r.read_gave_up().unwrap();
    assert!(own > 100 && truth == 0, "{own} {truth}");
    s.set("max_visits=65536", &["rt-hard".into()]).unwrap();
    let work = [(0, s)];
    let mut rows = Vec::new();
    measure::run(&mut r, &work[0].1, &work, 1, measure::More::default(), &mut |step| {
        if let Step::Row(row) = step {
            rows.push(row);
        }
        true
    })
    .unwrap();
    assert!(rows.len() == 1 && rows[0].notes.is_empty(), "{:?}", rows[0].notes);
    let stopped = measure::run(&mut r, &work[0].1, &work, 1, measure::More::default(), &mut |step| {
        assert!(matches!(step, Step::Working(..)), "a measurement that is told to stop gives no row");
        false
    });
    assert!(stopped.is_err());
}

/// Timestamps come back for every pass, in order, also where they are not the way of choice (software).
#[test]
fn timestamps_arrive_for_every_pass() {
    use shadowscope::gpu::{Pass, Recorder, Slot, Timer, TimerMode};
    let gpu = gpu();
    if !gpu.abilities.features.contains(wgpu::Features::TIMESTAMP_QUERY) {
        eprintln!("skipped: {} has no timestamps", gpu.info.name);
        return;
    }
    let (mut r, mut s) = start(hovering(spot()), [160, 120]);
    s.select("pcf").unwrap();
    r.timer = Timer::with(TimerMode::Stamps);
    for _ in 0..3 {
        r.render(&s, shadowscope::frame::Ask { timed: true, ..ask(&s) }).unwrap();
    }
    r.collect_times(true).unwrap();
    let names: Vec<&str> = r.timer.latest.iter().map(|(n, _)| *n).collect();
    // The truth was traced in the first frame only.
    assert_eq!(names, ["G-buffer", "clears", "fit: receivers", "fit: narrow", "shadow map", "resolve", "shading"]);
    assert!(r.timer.latest.iter().all(|(_, ms)| ms.is_finite() && *ms >= 0.0), "{:?}", r.timer.latest);

    // However many there are.
    let usage = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::STORAGE_BINDING;
    let [mut from, mut to] = [Slot::default(), Slot::default()];
    let from = from.get(&gpu, "from", [8; 2], wgpu::TextureFormat::R32Float, usage);
    let to = to.get(&gpu, "to", [8; 2], wgpu::TextureFormat::R32Float, usage);
    let pass = Pass::compute(&gpu, "copy", "read_map.wgsl", "copy_map", &[]).unwrap();
    let mut timer = Timer::with(TimerMode::Stamps);
    let mut recorder = Recorder::new(&gpu, &mut timer, true, [8; 2]);
    for _ in 0..700 {
        recorder.run(&pass).bind("shown", &from).bind("values", &to).per_pixel();
    }
    recorder.finish().unwrap();
    timer.collect(&gpu, true).unwrap();
    assert_eq!(timer.by_name().len(), 1);
    assert!(timer.latest.len() == 700 && timer.latest.iter().all(|(_, ms)| ms.is_finite()), "{}", timer.latest.len());
}

/// Where maps look: the buffers that hold it, of the last frame's analysis.
fn fits(r: &mut Renderer, setup: &Setup) -> Vec<Vec<u8>> {
    r.render(setup, Ask { analysis: true, ..ask(setup) }).unwrap();
    let names = ["light_view", "light_views", "splits", "warps", "rows", "columns", "grid_nodes"];
    names.iter().filter_map(|name| r.analysis().table(&r.gpu, name).unwrap()).collect()
}

/// Two cameras that see much the same of the yard, and what shadows of it each technique with maps draws.
fn from_two_places(check: impl Fn(&str, &mut Renderer, &Setup, [Camera; 2])) {
    let views = [
        camera(Vec3::new(4.0, 5.0, 9.0), Vec3::new(0.0, 0.3, 0.0)),
        camera(Vec3::new(-4.5, 5.5, 8.0), Vec3::new(0.3, 0.0, -0.2)),
    ];
    let lights = [sun(Vec3::new(0.5, 1.0, 0.3)), crate::common::spot(Vec3::new(3.0, 9.0, 1.0), Vec3::ZERO, 48.0)];
    for light in lights {
        let scene = scene(vec![mesh(&yard(), 0)], vec![material(Vec3::splat(0.8))], views[0], light);
        let (mut r, mut s) = start(scene, [96, 72]);
        let turn = |info: &&&Info| info.id != "rt-hard" && crate::laws::in_turn(info, &lights) == Some(light);
        for info in techniques::ALL.iter().filter(turn) {
            s.select(info.id).unwrap();
            if info.specs().any(|spec| spec.name == "resolution") {
                s.set("resolution=256", &[info.id.into()]).unwrap();
            }
            check(&format!("{} under a {} light", info.id, light.kind()), &mut r, &s, views);
        }
    }
}

/// With the shadow camera where the camera is, each picture stays as it was, whether or not maps have a G-buffer of their own.
#[test]
fn freezing_the_shadow_camera_changes_nothing_by_itself() {
    from_two_places(|what, r, s, [here, _]| {
        r.render(s, ask(s)).unwrap();
        let (visibility, picture) = (r.read_visibility().unwrap(), r.read_picture().unwrap());
        let same = Setup { shadow_camera: Some(here), ..s.clone() };
        r.render(&same, ask(&same)).unwrap();
        assert!(r.read_visibility().unwrap() == visibility && r.read_picture().unwrap() == picture, "{what}");
        // Another far plane moves no surface, but has the camera of the maps rendered beside this one.
        let beside = Setup { camera: Camera { far: here.far * 1.5, ..here }, ..same };
        r.render(&beside, ask(&beside)).unwrap();
        assert!(r.read_visibility().unwrap() == visibility, "{what}, beside");
    });
}

/// Maps look where the frozen camera has them look, and a surface that both cameras see keeps its shadow.
#[test]
fn maps_stay_with_the_frozen_camera() {
    from_two_places(|what, r, s, [here, there]| {
        let fitted = fits(r, s);
        let (at, lit) = (r.read_position().unwrap(), r.read_visibility().unwrap());
        let flown = Setup { camera: there, shadow_camera: Some(here), ..s.clone() };
        if ["shadow-volume", "psv", "izb", "rt-soft", "rt-denoise"].iter().any(|id| what.starts_with(id)) {
            // Without maps the picture is that of its own camera.
            let seen = [&flown, &Setup { camera: there, ..s.clone() }].map(|s| {
                r.render(s, ask(s)).unwrap();
                r.read_visibility().unwrap()
            });
            assert!(fitted.is_empty() && seen[0] == seen[1], "{what}");
            return;
        }
        assert!(!fitted.is_empty() && fits(r, &flown) == fitted, "{what}: another fit");
        let (at_there, lit_there) = (r.read_position().unwrap(), r.read_visibility().unwrap());
        let mask = r.read_mask().unwrap();
        let moved = Setup { camera: there, ..s.clone() };
        // Distortion by silhouettes takes no notice of the camera.
        assert!(fits(r, &moved) != fitted || what.starts_with("dsm"), "{what}: the fit is no camera's");
        // The nearest sample of the one picture to each of the other's.
        let aspect = s.size[0] as f32 / s.size[1] as f32;
        let project = here.projection(aspect) * here.view();
        let (mut pairs, mut off) = (0, 0);
        for ((p, v), _) in at_there.iter().zip(&lit_there).zip(&mask).filter(|(_, m)| **m == FACING) {
            let p = Vec3::new(p[0], p[1], p[2]);
            let ndc = project.project_point3(p);
            let pixel = (Vec2::new(ndc.x, -ndc.y) * 0.5 + 0.5) * Vec2::new(s.size[0] as f32, s.size[1] as f32);
            if pixel.min_element() < 0.0 || pixel.x >= s.size[0] as f32 || pixel.y >= s.size[1] as f32 {
                continue;
            }
            let i = pixel.y as usize * s.size[0] as usize + pixel.x as usize;
            if Vec3::new(at[i][0], at[i][1], at[i][2]).distance(p) < 0.04 {
                pairs += 1;
                off += ((lit[i] - v).abs() > 0.5) as usize;
            }
        }
        assert!(pairs > 500 && off * 50 < pairs, "{what}: {off} of {pairs} differ");
    });
}

/// The lines of the frozen camera's frustum and of the light's box lie where they belong, and are faint behind surfaces.
#[test]
fn outlines_lie_where_maps_end() {
    let light = sun(Vec3::new(0.3, 1.0, 0.2));
    let view = camera(Vec3::new(0.0, 3.0, 6.0), Vec3::new(0.0, 0.5, 0.0));
    let from = camera(Vec3::new(26.0, 16.0, 14.0), Vec3::new(0.0, 2.0, 0.0));
    let (mut r, mut s) =
        start(scene(vec![mesh(&yard(), 0)], vec![material(Vec3::splat(0.8))], view, light), [320, 240]);
    s.set("fit=scene", &["shadow-map".into()]).unwrap();
    s.camera = from;
    s.shadow_camera = Some(view);
    r.render(&s, ask(&s)).unwrap();
    let (with, at) = (r.read_picture().unwrap(), r.read_position().unwrap());
    let plain = Setup { shadow_camera: None, ..s.clone() };
    r.render(&plain, ask(&plain)).unwrap();
    let without = r.read_picture().unwrap();
    let outlined = Setup { outlines: true, ..plain.clone() };
    r.render(&outlined, ask(&outlined)).unwrap();
    let own = r.read_picture().unwrap();
    assert_ne!(own, without, "outlines without freezing");

    let project = from.projection(320.0 / 240.0) * from.view();
    // How much lighter or more coloured the picture is along a line, in front of surfaces and behind them.
    let seen = |picture: &[u8], a: Vec3, b: Vec3, channel: usize| {
        let mut sums = [[0.0f32; 2]; 2];
        for i in 1..200 {
            let p = a.lerp(b, i as f32 / 200.0);
            let ndc = project.project_point3(p);
            let pixel = (Vec2::new(ndc.x, -ndc.y) * 0.5 + 0.5) * Vec2::new(320.0, 240.0);
            let before = (p - from.position).dot(from.forward());
            if before < 0.1 || pixel.min_element() < 1.0 || pixel.x >= 319.0 || pixel.y >= 239.0 {
                continue;
            }
            let i = pixel.y as usize * 320 + pixel.x as usize;
            let hidden = at[i][3] > 0.0 && before > at[i][3] * 1.02;
            let near = at[i][3] > 0.0 && before > at[i][3] * 0.98;
            if hidden == near {
                let change = (picture[4 * i + channel] as f32 - without[4 * i + channel] as f32).abs();
                sums[hidden as usize][0] += change;
                sums[hidden as usize][1] += 1.0;
            }
        }
        sums.map(|[sum, n]| if n > 8.0 { Some(sum / n) } else { None })
    };
    let eye = shadowscope::map::fit::Scope {
        camera: view,
        light,
        bounds: r.geometry().bounds,
        aspect: 320.0 / 240.0,
        resolution: 1,
        margin: 0.0,
    };
    let corners = eye.eye().corners();
    let mut faint = 0;
    for corner in &corners[4..] {
        let [front, behind] = seen(&with, view.position, corner.as_vec3(), 1);
        assert!(front.is_none_or(|c| c > 12.0), "an edge of the frustum: {front:?}");
        if let (Some(front), Some(behind)) = (front, behind) {
            assert!(behind > 3.0 && behind < front, "{front} before, {behind} behind");
            faint += 1;
        }
    }
    assert!(faint > 0, "no edge both before and behind surfaces");
    // The box of the whole scene: where planes across the light's axes touch its bounds.
    let whole = shadowscope::light::LightView::whole(&light, r.geometry().bounds, 1024, 0.0).unwrap();
    let (right, up) = (whole.row_x.truncate().normalize(), whole.row_y.truncate().normalize());
    let axis = whole.axis.truncate();
    let [low, high] = r.geometry().bounds;
    let ends = |d: Vec3| {
        let middle = d.dot((low + high) / 2.0);
        let half = d.abs().dot((high - low) / 2.0);
        [middle - half, middle + half]
    };
    let corner = |x: usize, y: usize, z: usize| right * ends(right)[x] + up * ends(up)[y] + axis * ends(axis)[z];
    for (x, y) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
        // Yellow takes the blue out of the sky.
        let [front, _] = seen(&with, corner(x, y, 0), corner(x, y, 1), 2);
        assert!(front.is_none_or(|c| c > 12.0), "an edge of the box: {front:?}");
    }
}

/// All settings of the parameters that decide whether a parameter means anything, each with values on both sides.
fn deciding(info: &Info, spec: &Spec) -> Vec<Vec<(&'static str, Value)>> {
    let mut all = vec![vec![]];
    // A group that filters share may name what only one of them has.
    let known = |c: &&Condition| info.specs().any(|s| s.name == c.of);
    assert!(
        spec.when.is_empty() || spec.when.iter().any(|one| one.iter().all(|c| known(&c))),
        "{}.{}",
        info.id,
        spec.name
    );
    let mut open: Vec<&Condition> = spec.when.iter().copied().flatten().filter(known).collect();
    while let Some(c) = open.pop() {
        let of = info.specs().find(|s| s.name == c.of).unwrap();
        open.extend(of.when.iter().copied().flatten().filter(known));
        if all[0].iter().any(|(name, _)| *name == of.name) {
            continue;
        }
        let values = match (of.kind, c.test) {
            (Kind::Flag { .. }, Test::Flag(_)) => vec![Value::Bool(false), Value::Bool(true)],
            (Kind::Choice { options, .. }, Test::Among(wanted)) => {
                assert!(wanted.iter().all(|w| options.contains(w)), "{}.{}: {wanted:?}", info.id, spec.name);
                options.iter().map(|o| Value::Text((*o).into())).collect()
            }
            (Kind::Int { min, .. }, Test::Above(least)) => {
                vec![Value::Int(min), Value::Int(least as i64), Value::Int(least as i64 + 1)]
            }
            (Kind::Float { max, .. }, Test::Above(least)) => {
                vec![Value::Float(least), Value::Float(least.max(max / 2.0))]
            }
            _ => panic!("{}.{}: the condition on {} cannot hold", info.id, spec.name, c.of),
        };
        let with = |v: &Value, rest: &Vec<_>| rest.iter().cloned().chain([(of.name, v.clone())]).collect();
        all = all.iter().flat_map(|rest| values.iter().map(|v| with(v, rest)).collect::<Vec<_>>()).collect();
    }
    all
}

/// Another value than the default, that turns on what it can.
fn other(spec: &Spec) -> Value {
    match (spec.kind, spec.default()) {
        (Kind::Flag { default }, _) => Value::Bool(!default),
        (Kind::Choice { default, options }, _) => {
            let next = options.iter().position(|o| *o == default).map_or(0, |i| (i + 1) % options.len());
            Value::Text(options[next].into())
        }
        (Kind::Float { max, .. }, Value::Float(0.0)) => Value::Float(max / 4.0),
        (Kind::Int { max, step, .. }, Value::Int(0)) => Value::Int(max.min(8 * step)),
        (_, default) => default,
    }
}

/// What the panel hides changes nothing, whatever else is set.
#[test]
fn parameters_that_do_not_apply_change_nothing() {
    let (mut r, mut s) = built_in("cubes", "near", [48, 30]);
    let mut asked = BTreeMap::new();
    for info in techniques::ALL.iter() {
        s.select(info.id).unwrap();
        let mut settings = Vec::new();
        let mut groups = BTreeSet::new();
        for spec in info.specs().filter(|s| !s.when.is_empty()) {
            // Of a group that many techniques share all decisions are drawn by two of them, and one by each.
            let group = info.group(spec).name;
            if groups.insert(group) {
                *asked.entry(group).or_insert(0) += 1;
            }
            let chosen = info.group(spec).when.map(|c| (c.of.to_string(), within(&c)));
            let mut applied = false;
            for setting in deciding(info, spec) {
                let mut values: Values = info.specs().map(|s| (s.name.to_string(), other(s))).collect();
                values.extend(setting.iter().map(|(name, v)| (name.to_string(), v.clone())));
                values.extend(chosen.clone());
                if values.contains_key("resolution") {
                    values.insert("resolution".into(), Value::Int(128));
                }
                applied |= info.applies(spec, &values);
                if !settings.contains(&values) && (asked[group] <= 2 || settings.is_empty()) {
                    settings.push(values);
                }
            }
            assert!(applied, "{}.{} never applies", info.id, spec.name);
        }
        for values in settings {
            let hidden: Vec<&Spec> = info.specs().filter(|spec| !info.applies(spec, &values)).collect();
            let mut seen = (0..hidden.iter().map(|spec| ends(spec).len()).max().unwrap_or(0)).map(|i| {
                let mut values = values.clone();
                values.extend(
                    hidden.iter().map(|spec| (spec.name.to_string(), ends(spec)[i % ends(spec).len()].clone())),
                );
                s.params.insert(info.id.into(), values);
                visible(&mut r, &s)
            });
            let first = seen.next();
            let names = || hidden.iter().map(|spec| spec.name).collect::<Vec<_>>();
            assert!(seen.all(|v| Some(v) == first), "{}: one of {:?} matters with {values:?}", info.id, names());
        }
    }
}

/// A parameter's extremes, or two options of a choice.
fn ends(spec: &Spec) -> Vec<Value> {
    match spec.kind {
        Kind::Flag { .. } => vec![Value::Bool(false), Value::Bool(true)],
        Kind::Int { min, max, .. } => vec![Value::Int(min), Value::Int(max.min(2048))],
        Kind::Float { min, max, .. } => vec![Value::Float(min), Value::Float(max)],
        Kind::Choice { options, .. } => {
            [options[0], options[options.len() - 1]].iter().map(|o| Value::Text((*o).into())).collect()
        }
    }
}

/// The choice that turns a group on.
fn within(c: &Condition) -> Value {
    match c.test {
        Test::Among(options) => Value::Text(options[0].into()),
        _ => panic!("groups depend on choices"),
    }
}

/// Groups that another choice hides change nothing either, all their parameters at once.
#[test]
fn groups_that_do_not_apply_change_nothing() {
    let (mut r, mut s) = built_in("cubes", "near", [48, 30]);
    for info in techniques::ALL.iter() {
        s.select(info.id).unwrap();
        for group in info.params.iter().filter(|g| g.when.is_some()) {
            let condition = group.when.unwrap();
            let of = info.specs().find(|s| s.name == condition.of).unwrap();
            let Kind::Choice { options, .. } = of.kind else { panic!("groups depend on choices") };
            let without = *options.iter().rev().find(|o| !condition.test.holds(&Value::Text((**o).into()))).unwrap();
            let mut values = Values::from([(of.name.to_string(), Value::Text(without.into()))]);
            assert!(group.specs.iter().all(|spec| !info.applies(spec, &values)), "{} with {without}", info.id);
            s.params.insert(info.id.into(), values.clone());
            let first = visible(&mut r, &s);
            values.extend(group.specs.iter().map(|spec| (spec.name.to_string(), other(spec))));
            s.params.insert(info.id.into(), values.clone());
            assert!(visible(&mut r, &s) == first, "{}: {values:?}", info.id);
            let (name, value) = (of.name.to_string(), within(&condition));
            values.insert(name, value);
            assert!(group.specs.iter().filter(|s| s.when.is_empty()).all(|spec| info.applies(spec, &values)));
        }
    }
}

/// Where the slider of the bias ends, light shows between casters and their shadows in every built-in scene.
#[test]
fn the_bias_reaches_peter_panning_in_every_scene() {
    for name in builtin::NAMES {
        let scene = builtin::build(name).unwrap();
        let (mut r, mut s) = start(scene, [192, 108]);
        let info = techniques::find("shadow-map").unwrap();
        let bias = info.specs().find(|s| s.name == "bias").unwrap();
        let end = bias.reach.unwrap() * s.camera.reach() as f64;
        bias.check("bias", &Value::Float(end)).unwrap();
        let before = errors(&mut r, &mut s, "shadow-map", &["resolution=2048"]);
        let after = errors(&mut r, &mut s, "shadow-map", &["resolution=2048", &format!("bias={end}")]);
        let leaks = |e: &Errors| e.lit_incorrect as f64 / (e.lit_incorrect + e.shadow_correct).max(1) as f64;
        println!("{name}: {end:.2} m, {:.4} -> {:.4} of the shadow is lit", leaks(&before), leaks(&after));
        assert!(leaks(&after) > leaks(&before) + 0.02, "{name}: {end} m, {} -> {}", leaks(&before), leaks(&after));
    }
}

/// What a pass wrote is shown small, whatever it is, and leaves the frame as it was.
#[test]
fn a_shot_shows_what_a_pass_wrote() {
    let light = sun(Vec3::new(0.5, 1.0, 0.3));
    let view = camera(Vec3::new(4.0, 5.0, 9.0), Vec3::new(0.0, 0.3, 0.0));
    let (mut r, mut s) = start(scene(vec![mesh(&yard(), 0)], vec![material(Vec3::splat(0.8))], view, light), [96, 72]);
    s.set("resolution=256", &["shadow-map".into()]).unwrap();
    r.render(&s, ask(&s)).unwrap();
    let before = (r.read_picture().unwrap(), r.read_visibility().unwrap(), r.read_truth().unwrap());
    let map = r.shot(&s, 0, "shadow map").unwrap().unwrap();
    assert_eq!((map.whole, map.size), ([256; 2], [216; 2]));
    let [low, high] = map.range.unwrap();
    // Depth is reversed and cleared to 0; the casters lie between the light and the last receiver.
    assert!(low >= 0.0 && low < high && high <= 1.0, "{low} to {high}");
    let grey: Vec<u8> = map.rgba.chunks(4).map(|p| p[0]).collect();
    assert!(grey.iter().any(|g| *g > 200) && grey.iter().any(|g| *g < 60), "the map's extremes are its own");
    // Visibility is a picture of its own size, 0 and 1.
    let lit = r.shot(&s, 0, "resolve").unwrap().unwrap();
    assert_eq!((lit.whole, lit.range), ([96, 72], Some([0.0, 1.0])));
    let share = |v: &mut dyn Iterator<Item = f32>| {
        let all: Vec<f32> = v.collect();
        all.iter().sum::<f32>() / all.len() as f32
    };
    let shown = share(&mut lit.rgba.chunks(4).map(|p| p[0] as f32 / 255.0));
    assert!((shown - share(&mut before.1.iter().copied())).abs() < 0.02, "{shown}");
    // Positions have three values; a picture is shown as it is; lists are none.
    assert!(r.shot(&s, 0, "G-buffer").unwrap().unwrap().range.is_some());
    let shading = r.shot(&s, 0, "shading").unwrap().unwrap();
    assert_eq!(shading.range, None);
    assert_eq!(r.shot(&s, 0, "fit: narrow").unwrap(), None);
    assert_eq!(r.shot(&s, 0, "no such pass").unwrap(), None);
    let after = (r.read_picture().unwrap(), r.read_visibility().unwrap(), r.read_truth().unwrap());
    assert!(before == after, "a shot changed the frame");
    // What is drawn into for side effects alone cannot be shown.
    for id in ["izb", "notw"] {
        select(&mut s, id, &[]);
        r.render(&s, Ask { timed: true, ..ask(&s) }).unwrap();
        r.collect_times(true).unwrap();
        for (pass, _) in r.timer.by_name() {
            r.shot(&s, 0, pass).unwrap_or_else(|e| panic!("{id}, {pass}: {e:#}"));
        }
    }
}

/// All layers of a map are in the shot, with one range; the truth, the analysis and what the CPU judges have shots too.
#[test]
fn shots_show_all_layers_and_what_every_technique_shares() {
    let light = sun(Vec3::new(0.5, 1.0, 0.3));
    let view = camera(Vec3::new(4.0, 5.0, 9.0), Vec3::new(0.0, 0.3, 0.0));
    let (mut r, mut s) = start(scene(vec![mesh(&yard(), 0)], vec![material(Vec3::splat(0.8))], view, light), [96, 72]);
    s.select("pssm").unwrap();
    for cascades in [3, 4] {
        s.set(&format!("cascades={cascades}"), &["pssm".into()]).unwrap();
        s.set("resolution=256", &["pssm".into()]).unwrap();
        s.view = "error-density".into();
        r.render(&s, Ask { analysis: true, ..ask(&s) }).unwrap();
        let layers: Vec<Vec<f32>> = (0..cascades).map(|i| r.read_layer(i).unwrap().unwrap().depth).collect();
        let shot = r.shot(&s, 0, "shadow maps").unwrap().unwrap();
        assert_eq!((shot.whole, shot.layers, shot.columns, shot.size), ([256; 2], cascades, 2, [216; 2]));
        let [low, high] = shot.range.unwrap();
        let most = |f: fn(f32, f32) -> f32| layers.iter().flatten().copied().reduce(f).unwrap();
        assert_eq!((low, high), (most(f32::min), most(f32::max)));
        for (i, layer) in layers.iter().enumerate() {
            let ([x, y], rgba) = ([i % 2 * 108, i / 2 * 108], &shot.rgba);
            // Less the line between layers.
            let inside = (y + 2..y + 107).flat_map(|y| (x + 2..x + 107).map(move |x| rgba[(y * 216 + x) * 4]));
            let shown = inside.map(|g| g as f32 / 255.0).sum::<f32>() / (105.0 * 105.0);
            let exact = layer.iter().map(|d| (d - low) / (high - low)).sum::<f32>() / layer.len() as f32;
            assert!((shown - exact).abs() < 0.03, "layer {i} of {cascades}: {shown}, {exact}");
        }
    }
    // Frames that are not analysed, and do not trace the truth again.
    r.render(&s, ask(&s)).unwrap();
    let places = r.shot(&s, 0, "analysis").unwrap().unwrap();
    assert_eq!((places.whole, places.layers), ([96, 72], 1));
    assert!(places.range.unwrap()[1] > 200.0, "places are in texels: {:?}", places.range);
    let truth = r.shot(&s, 0, "truth").unwrap().unwrap();
    assert_eq!((truth.whole, truth.range), ([96, 72], Some([0.0, 1.0])));
    let exact = r.read_truth().unwrap();
    let mean = exact.iter().sum::<f32>() / exact.len() as f32;
    let shown = truth.rgba.chunks(4).map(|p| p[0] as f32 / 255.0).sum::<f32>() / (truth.rgba.len() / 4) as f32;
    assert!((shown - mean).abs() < 0.02, "{shown}, {mean}");
    let density = r.read_map().unwrap().into_iter().fold(0.0, f32::max);
    assert!(density > 0.0);
    assert_eq!(r.shot(&s, 0, "error map (CPU)").unwrap().unwrap().range.unwrap()[1], density);
}

/// Charts tell techniques apart, and one that comes changes no other's colour or marker.
#[test]
fn each_technique_has_a_mark_of_its_own() {
    let mut marks: Vec<usize> = techniques::ALL.iter().map(|i| i.mark).collect();
    marks.sort_unstable();
    marks.dedup();
    assert_eq!(marks.len(), techniques::ALL.len());
}
