//! The averaged truth under lights with a size: penumbras against closed forms.

use crate::common::*;
use glam::{DVec3, Vec2, Vec3};
use shadowscope::frame::{Ask, Renderer};
use shadowscope::light::Light;
use shadowscope::measure::metrics::FACING;
use shadowscope::setup::Setup;
use shadowscope::techniques;
use shadowscope::truth::Samples;
use std::f64::consts::PI;

/// Height of the lid that throws the shadow. It covers x < 0.
pub const LID: f32 = 2.0;
const SIZE: [u32; 2] = [72, 54];

fn lamp(position: Vec3, radius: f32) -> Light {
    let direction = Vec3::new(-position.x, -position.y, 0.0);
    Light::Spot { position, direction, outer_angle: 60.0, range: 30.0, radius, color: Vec3::splat(20.0) }
}

pub fn wide_sun(to_light: Vec3, angular_radius: f32) -> Light {
    Light::Directional { to_light, angular_radius, color: Vec3::ONE }
}

/// A floor under a lid with one straight edge, seen from between them, around x on the floor.
pub fn under_the_lid(light: Light, x: f32) -> (Renderer, Setup) {
    let mut triangles = floor(Vec2::splat(-20.0), Vec2::splat(20.0), 0.0);
    triangles.extend(floor(Vec2::splat(-20.0), Vec2::new(0.0, 20.0), LID));
    let view = camera(Vec3::new(x, 1.2, 0.3), Vec3::new(x, 0.0, 0.0));
    start(scene(vec![mesh(&triangles, 0)], vec![material(Vec3::ONE)], view, light), SIZE)
}

fn truth(r: &mut Renderer, s: &Setup, samples: u32) -> Vec<f32> {
    let s = Setup { truth_samples: Samples::Fixed(samples), ..s.clone() };
    r.render(&s, Ask { picture: false, ..ask(&s) }).unwrap();
    r.read_truth().unwrap()
}

/// Share of a disc that lies on one side of a line, of which its centre is `t` radii inside.
pub fn share(t: f64) -> f64 {
    let t = t.clamp(-1.0, 1.0);
    0.5 + (t * (1.0 - t * t).sqrt() + t.asin()) / PI
}

/// Share of the light's disc, which faces the point, on the upper side of a plane through the point.
fn above_plane(light: &Light, point: DVec3, normal: DVec3) -> f64 {
    let (to_light, radius) = match *light {
        Light::Directional { to_light, angular_radius, .. } => {
            (to_light.as_dvec3().normalize(), (angular_radius as f64).to_radians().tan())
        }
        Light::Spot { position, radius, .. } | Light::Omni { position, radius, .. } => {
            (position.as_dvec3() - point, radius as f64)
        }
        _ => panic!("no disc"),
    };
    // The plane cuts the disc's plane in a line; how far that is from the disc's centre.
    let above = normal.dot(to_light);
    let sine = above / to_light.length();
    share(above / (1.0 - sine * sine).sqrt() / radius)
}

/// Share of the light that a point of the floor sees beside the lid.
fn seen(light: &Light, point: DVec3) -> f64 {
    // The plane through the point and the lid's edge; light comes from the side of greater x.
    let up = DVec3::new(-point.x, LID as f64 - point.y, 0.0).normalize();
    above_plane(light, point, DVec3::new(up.y, -up.x, 0.0))
}

/// Pairs of a place on the floor and its truth.
pub fn places(r: &mut Renderer, truth: &[f32]) -> Vec<(DVec3, f64)> {
    let (mask, position) = (r.read_mask().unwrap(), r.read_position().unwrap());
    assert!(mask.iter().all(|m| *m == FACING));
    position.iter().zip(truth).map(|(p, v)| (Vec3::from_slice(p).as_dvec3(), *v as f64)).collect()
}

/// Where the light's share rises through `level` as x grows, from the means over narrow strips along the edge.
pub fn crossing(places: &[(DVec3, f64)], strip: f64, level: f64) -> f64 {
    let mut strips = std::collections::BTreeMap::<i64, (f64, f64)>::new();
    for (p, v) in places {
        let (sum, n) = strips.entry((p.x / strip).floor() as i64).or_default();
        *sum += v;
        *n += 1.0;
    }
    // The outermost are cut by the picture.
    let means: Vec<(f64, f64)> = strips.iter().map(|(i, (sum, n))| ((*i as f64 + 0.5) * strip, sum / n)).collect();
    let means = &means[1..means.len() - 1];
    let pair = means.windows(2).find(|w| w[0].1 < level && w[1].1 >= level).expect("the share rises through the level");
    let ((x0, v0), (x1, v1)) = (pair[0], pair[1]);
    x0 + (x1 - x0) * (level - v0) / (v1 - v0)
}

/// The penumbra of an edge right under the light's middle is as wide as similar triangles have it, and the light is half
/// seen at the edge of the hard shadow.
#[test]
fn penumbras_are_as_wide_as_the_closed_form() {
    let by_lamp = |height: f32, radius: f32| 2.0 * radius * LID / (height - LID);
    let by_sun = |angle: f32| 2.0 * angle.to_radians().tan() * LID;
    for (light, width) in [
        (lamp(Vec3::new(0.0, 4.0, 0.0), 0.2), by_lamp(4.0, 0.2)),
        (lamp(Vec3::new(0.0, 7.0, 0.0), 0.5), by_lamp(7.0, 0.5)),
        (
            Light::Omni { position: Vec3::new(0.0, 5.0, 0.0), range: 30.0, radius: 0.25, color: Vec3::ONE },
            by_lamp(5.0, 0.25),
        ),
        (wide_sun(Vec3::Y, 3.0), by_sun(3.0)),
        (wide_sun(Vec3::Y, 6.0), by_sun(6.0)),
    ] {
        let width = width as f64;
        let (mut r, s) = under_the_lid(light, 0.0);
        let mean = truth(&mut r, &s, 64);
        let places = places(&mut r, &mean);
        let at = |level| crossing(&places, 0.02, level);
        // At 0.8 of the way from the middle to either end, where the share is not yet flat.
        let measured = (at(share(0.8)) - at(share(-0.8))) / 0.8;
        assert!((measured / width - 1.0).abs() < 0.03, "{light:?}: {measured} wide instead of {width}");
        assert!(at(0.5).abs() < 0.01 * width, "{light:?}: half lit at {}", at(0.5));
        // The hard shadow's edge lies there too, at x = 0.
        let hard = r.read_hard_truth().unwrap();
        for ((p, _), hard) in places.iter().zip(hard).filter(|((p, _), _)| p.x.abs() > 1e-4) {
            assert_eq!(hard, (p.x > 0.0) as u32 as f32, "{light:?}: the hard truth at {p}");
        }
    }
}

/// Lights that stand aslant: the share that is seen agrees with the closed form all over the picture, where the samples of a
/// pixel are better than random ones.
#[test]
fn the_share_seen_is_that_of_the_disc() {
    for (light, x) in [
        (lamp(Vec3::new(1.0, 4.0, 0.5), 0.25), -1.0),
        (Light::Omni { position: Vec3::new(-0.6, 3.5, -0.4), range: 30.0, radius: 0.2, color: Vec3::ONE }, 0.8),
        (wide_sun(Vec3::new(0.5, 1.0, 0.3), 4.0), -1.0),
    ] {
        let (mut r, s) = under_the_lid(light, x);
        for samples in [4, 16, 64] {
            let mean = truth(&mut r, &s, samples);
            let (mut n, mut sum, mut squares, mut random) = (0.0, 0.0, 0.0, 0.0);
            for (p, v) in places(&mut r, &mean) {
                let exact = seen(&light, p);
                // The samples lie all over the pixel, so that it may see a little from beside the penumbra.
                if exact > 0.02 && exact < 0.98 {
                    n += 1.0;
                    sum += v - exact;
                    squares += (v - exact) * (v - exact);
                    random += exact * (1.0 - exact) / samples as f64;
                } else {
                    assert!(
                        (v - exact).abs() < 2.0 / samples as f64 + 0.03,
                        "{light:?}, {samples} samples: {v} instead of {exact} at {p}"
                    );
                }
            }
            assert!(n > 400.0, "{light:?}: {n} pixels in the penumbra");
            let (bias, rms, random) = (sum / n, (squares / n).sqrt(), (random / n).sqrt());
            assert!(
                bias.abs() < 3.5 * rms / f64::sqrt(n) + 0.002,
                "{light:?}, {samples} samples: off by {bias} in the mean"
            );
            // The more samples, the more it helps that they are spread evenly.
            let most = [0.8, 0.6, 0.42][(samples.ilog2() / 2 - 1) as usize];
            assert!(rms < most * random, "{light:?}, {samples} samples: off by {rms}; random ones by {random}");
        }
    }
}

/// Half of a sun that stands low has set behind the floor's own plane, and is not seen.
#[test]
fn what_has_set_is_not_seen() {
    let (sine, cosine) = 2f32.to_radians().sin_cos();
    for (light, share) in [
        (wide_sun(Vec3::new(cosine, sine, 0.0), 5.0), None),
        (Light::Omni { position: Vec3::new(0.0, 0.1, 0.0), range: 30.0, radius: 0.3, color: Vec3::ONE }, None),
        (wide_sun(Vec3::new(cosine, sine, 0.0), 0.5), Some(1.0)),
    ] {
        let triangles = floor(Vec2::splat(-20.0), Vec2::splat(20.0), 0.0);
        let view = camera(Vec3::new(1.0, 1.2, 0.3), Vec3::new(1.0, 0.0, 0.0));
        let made = scene(vec![mesh(&triangles, 0)], vec![material(Vec3::ONE)], view, light);
        let (mut r, s) = start(made, SIZE);
        let mean = truth(&mut r, &s, 64);
        let (mut off, mut n) = (0.0, 0.0);
        for (p, v) in places(&mut r, &mean) {
            let exact = share.unwrap_or_else(|| above_plane(&light, p, DVec3::Y));
            assert!((v - exact).abs() < 0.07, "{light:?}: {v} instead of {exact} at {p}");
            off += v - exact;
            n += 1.0;
        }
        assert!((off / n).abs() < 0.004, "{light:?}: off by {} in the mean", off / n);
        assert!(r.read_hard_truth().unwrap().iter().all(|v| *v == 1.0), "{light:?}");
    }
}

/// A size changes the averaged truth alone; without it all is as under a point, and each run gives the same.
#[test]
fn a_size_changes_only_the_mean() {
    let view = camera(Vec3::new(2.0, 3.0, 5.0), Vec3::new(0.0, 0.5, 0.0));
    let lights: [fn(f32) -> Light; 3] = [
        |size| Light::Spot {
            position: Vec3::new(-2.0, 5.0, 2.0),
            direction: Vec3::new(2.0, -5.0, -2.0),
            outer_angle: 40.0,
            range: 9.0,
            radius: size,
            color: Vec3::ONE,
        },
        |size| Light::Omni { position: Vec3::new(-2.0, 5.0, 2.0), range: 9.0, radius: size, color: Vec3::ONE },
        |size| wide_sun(Vec3::new(0.6, 1.0, 0.3), 5.0 * size),
    ];
    for light in lights {
        let made = || scene(vec![mesh(&yard(), 0)], vec![material(Vec3::ONE)], view, light(0.0));
        let (mut r, mut s) = start(made(), [64, 48]);
        let (point, hard) = (truth(&mut r, &s, 16), r.read_hard_truth().unwrap());
        let mask = r.read_mask().unwrap();
        s.light = light(1.0);
        let soft = truth(&mut r, &s, 16);
        assert_eq!(r.read_hard_truth().unwrap(), hard, "{:?}", s.light);
        assert_eq!(r.read_mask().unwrap(), mask, "what the light reaches is asked of its centre");
        let softer = soft.iter().zip(&point).filter(|(soft, point)| (*soft - *point).abs() > 0.1).count();
        assert!(softer > 20, "{:?}: {softer}", s.light);
        let (mut again, _) = start(made(), [64, 48]);
        assert_eq!(truth(&mut again, &s, 16), soft, "{:?} is not repeated", s.light);
        s.light = light(0.0);
        assert_eq!(truth(&mut r, &s, 16), point);
        assert_eq!(truth(&mut again, &s, 16), point);
    }
}

/// Under a rectangle a straight edge along one of its sides gives a linear ramp. Truth and `rt-soft` come to it at least as fast as
/// rays at random do, each within its standard error; rays to a grid's middles do too.
#[test]
fn a_rectangle_over_an_edge_gives_a_ramp() {
    let (height, half) = (4.0, 0.3);
    let (center, half_u, half_v) = (Vec3::Y * height, Vec3::X * half, Vec3::Z * 0.4);
    let light = Light::RectArea { center, half_u, half_v, range: 30.0, color: Vec3::ONE };
    let (mut r, mut s) = under_the_lid(light, 0.0);
    // Over the lid's edge the light's plane is seen from a floor's point shifted by this share of its place.
    let ramp = |x: f64| ((half as f64 + x * (height / LID - 1.0) as f64) / (2.0 * half as f64)).clamp(0.0, 1.0);
    let mean = truth(&mut r, &s, 64);
    let exact: Vec<f64> = places(&mut r, &mean).iter().map(|(p, _)| ramp(p.x)).collect();
    let rms = |seen: &[f32]| {
        let sum: f64 = seen.iter().zip(&exact).map(|(v, e)| (*v as f64 - e).powi(2)).sum();
        (sum / exact.len() as f64).sqrt()
    };
    let at_random = |n: f64| (exact.iter().map(|e| e * (1.0 - e) / n).sum::<f64>() / exact.len() as f64).sqrt();
    for pattern in ["r2", "stratified", "grid"] {
        for n in [16, 64, 256, 1024] {
            choose(
                &mut s,
                techniques::find("rt-soft").unwrap(),
                64,
                &[format!("samples={n}"), format!("pattern={pattern}")],
            );
            r.render(&s, Ask { picture: false, ..ask(&s) }).unwrap();
            let off = rms(&r.read_visibility().unwrap());
            assert!(off < at_random(n as f64), "{pattern}, {n} rays: {off} instead of {}", at_random(n as f64));
        }
    }
    for n in [16, 64, 256] {
        let off = rms(&truth(&mut r, &s, n));
        assert!(off < at_random(n as f64), "the truth of {n}: {off}");
    }
    // What is lit is told by half of the light.
    let labels = r.read_labels().unwrap();
    for (label, e) in labels.iter().zip(&exact).filter(|(_, e)| (*e - 0.5).abs() > 0.1) {
        assert_eq!(*label >= 0.5, *e >= 0.5);
    }
}

/// Single maps see what lies before a rectangle's centre: penumbras of an edge along either of its sides are the closed form's ramps, as
/// their kernels are boxes of its shape, whichever side lies along the edge.
#[test]
fn penumbras_of_a_rectangle_are_ramps() {
    let (height, wide, narrow) = (4.0, 0.3, 0.1);
    for (half_u, half_v, half) in [
        (Vec3::X * wide, Vec3::Z * narrow, wide),
        (Vec3::X * narrow, Vec3::Z * wide, narrow),
        (Vec3::Z * wide, Vec3::NEG_X * narrow, narrow),
        (Vec3::Z * narrow, Vec3::NEG_X * wide, wide),
    ] {
        let light = Light::RectArea { center: Vec3::Y * height, half_u, half_v, range: 30.0, color: Vec3::ONE };
        let (mut r, mut s) = under_the_lid(light, 0.0);
        let ramp = |x: f64| ((half as f64 + x * (height / LID - 1.0) as f64) / (2.0 * half as f64)).clamp(0.0, 1.0);
        for (technique, most) in [("pcss", 0.015), ("prefiltered-soft", 0.04)] {
            for fit in ["receivers", "msf"] {
                let sets = [format!("fit={fit}"), "max_radius=128".into(), "max_box=256".into()];
                let info = techniques::find(technique).unwrap();
                let own = sets.into_iter().filter(|set| info.specs().any(|p| set.split('=').next() == Some(p.name)));
                choose(&mut s, info, 1024, &own.collect::<Vec<_>>());
                r.render(&s, Ask { picture: false, ..ask(&s) }).unwrap();
                let seen = r.read_visibility().unwrap();
                let (mut n, mut sum, mut edge) = (0.0, 0.0, 0);
                for (p, v) in places(&mut r, &seen) {
                    let e = ramp(p.x);
                    edge += (e > 0.0 && e < 1.0) as u32;
                    sum += (v - e) * (v - e);
                    n += 1.0;
                }
                let rms = f64::sqrt(sum / n);
                println!("{technique} {fit} {half_u} {half_v}: {rms:.4} of {edge}");
                assert!(rms < most && edge > 300, "{technique} {fit} {half_u} {half_v}: {rms}, {edge}");
            }
        }
    }
}

/// A hard shadow under a rectangle is its centre's, by every fit; and what lies too far off its axis for a map is lit and counted.
#[test]
fn single_maps_see_a_rectangle_from_its_centre() {
    let view = camera(Vec3::new(0.0, 4.0, 10.0), Vec3::ZERO);
    let light = |height: f32| Light::RectArea {
        center: Vec3::new(0.3, height, 0.2),
        half_u: Vec3::new(3e-3, 0.0, 1e-3),
        half_v: Vec3::new(-1e-3, 0.0, 3e-3),
        range: 60.0,
        color: Vec3::ONE,
    };
    let made = scene(vec![mesh(&yard(), 0)], vec![material(Vec3::ONE)], view, light(5.0));
    let (mut r, mut s) = start(made, [96, 72]);
    for fit in ["receivers", "scene", "msf"] {
        let e = errors(&mut r, &mut s, "shadow-map", &["resolution=2048", &format!("fit={fit}")]);
        println!("{fit}: {:.4}, {} in shadow", e.rmse, e.shadow_correct);
        assert!(e.rmse < 0.1 && e.shadow_correct > 60 && r.notes().unwrap().is_empty(), "{fit}: {e:?}");
    }
    s.light = light(0.9);
    let e = errors(&mut r, &mut s, "shadow-map", &["resolution=2048"]);
    let (mask, at) = (r.read_mask().unwrap(), r.read_position().unwrap());
    let seen = r.read_visibility().unwrap();
    let (right, far) = (Vec3::new(3.0, 0.0, 1.0).normalize(), Vec3::new(-1.0, 0.0, 3.0).normalize());
    let mut beyond = 0;
    for ((_, p), v) in mask.iter().zip(&at).zip(&seen).filter(|((m, _), _)| **m == FACING) {
        let q = Vec3::from_slice(p) - s.light.position();
        let tangent = q.dot(right).abs().max(q.dot(far).abs()) / -q.y;
        if tangent > 80f32.to_radians().tan() {
            // A texel at the border may see a little more.
            assert!(*v == 1.0 || tangent < 1.02 * 80f32.to_radians().tan(), "{p:?}");
            beyond += 1;
        }
    }
    let notes = r.notes().unwrap().join(" ");
    assert!(beyond > 100 && notes.starts_with(&format!("{beyond} pixels")), "{beyond}: {notes} {e:?}");
}

/// Every built-in rectangle shines into its scene: some of the default picture faces it.
#[test]
fn built_in_rectangles_shine_into_their_scenes() {
    let mut rectangles = 0;
    for name in ["cubes", "blocks", "arches", "hall", "st-wide"] {
        let (mut r, s) = built_in(name, SIZE);
        for lamp in r.scene().lights.clone().iter().filter(|l| matches!(l.light, Light::RectArea { .. })) {
            let s =
                Setup { technique: "rt-soft".into(), light: lamp.light, truth_samples: Samples::Fixed(1), ..s.clone() };
            r.render(&s, Ask { picture: false, ..ask(&s) }).unwrap();
            let facing = r.read_mask().unwrap().iter().filter(|m| **m == FACING).count();
            assert!(facing * 10 > (SIZE[0] * SIZE[1]) as usize, "{name}: {facing}");
            rectangles += 1;
        }
    }
    assert_eq!(rectangles, 5);
}
