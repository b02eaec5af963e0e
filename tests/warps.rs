//! Warped light views against closed forms, brute force and the truth.

mod common;

use common::*;
use glam::{DMat3, DVec2, DVec3, Vec2, Vec3, Vec4};
use shadowscope::fit::{Scope, hull, lispsm, msf, psm, tsm, warped};
use shadowscope::frame::{Ask, Renderer};
use shadowscope::light::LightView;
use shadowscope::measure::metrics::{Errors, FACING};
use shadowscope::measure::{self, stability};
use shadowscope::scene::{Camera, builtin};
use shadowscope::setup::Setup;
use std::sync::Arc;

const WARPS: [&str; 3] = ["lispsm", "tsm", "psm"];

fn scope(camera: Camera, to_light: Vec3) -> Scope {
    let bounds = [Vec3::new(-20.0, 0.0, -20.0), Vec3::new(20.0, 5.0, 20.0)];
    Scope { camera, light: sun(to_light), bounds, aspect: 1.5, resolution: 512, margin: 1.0 }
}

/// A random camera in the scope's box and a sun from anywhere above.
fn random(r: &mut Random) -> Scope {
    let at = Vec3::new(15.0, 2.0, 15.0) * r.point() + Vec3::Y * 3.0;
    let mut view = camera(at, at + r.point());
    view.fov = 30.0 + 60.0 * r.next();
    let l = r.point();
    scope(view, Vec3::new(l.x, l.y.abs() + 0.1, l.z))
}

fn select(s: &mut Setup, technique: &str, sets: &[&str]) {
    s.params.clear();
    s.select(technique).unwrap();
    for set in sets {
        s.set(set, &[technique.into()]).unwrap();
    }
}

fn errors(r: &mut Renderer, s: &mut Setup, technique: &str, sets: &[&str]) -> Errors {
    select(s, technique, sets);
    measure::errors(r, s).unwrap()
}

fn built_in(name: &str, size: [u32; 2]) -> (Renderer, Setup) {
    let (mut setup, scene) = Setup::open(name).unwrap();
    setup.size = size;
    (Renderer::new(gpu(), Arc::new(scene)).unwrap(), setup)
}

/// The eight matrices take the trapezoid's corners to the square's, and the point in focus to the 80 % line.
#[test]
fn a_trapezoid_becomes_the_square() {
    let mut r = Random(7);
    let mut found = 0;
    for i in 0..400 {
        let (s, p) = (random(&mut r), [0.8, 0.6, 0.9][i % 3]);
        let t = tsm::fit(&s, &s.image(), p, 0.2);
        let Some(corners) = t.trapezoid else { continue };
        let square = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(DVec2::from_array);
        for (corner, exact) in corners.iter().zip(square) {
            let (at, w) = warped(&t.warp, *corner);
            assert!(at.distance(exact) < 1e-6 && w > 0.0, "frustum {i}: {corner} lands at {at}");
        }
        for c in &t.hull {
            let (at, w) = warped(&t.warp, *c);
            assert!(at.abs().max_element() < 1.0 + 1e-6 && w > 0.0, "frustum {i}: the hull leaves the map at {at}");
        }
        // The share p of the map lies between the top line and the focus.
        let (focus, _) = warped(&t.warp, t.focus);
        assert!((focus.y - (1.0 - 2.0 * p)).abs() < 1e-6, "frustum {i}: the focus lands at {}", focus.y);
        found += 1;
    }
    assert!(found > 150, "only {found} trapezoids");
    // Morais' form for 80 %.
    let (lambda, delta) = (7.0, 1.3);
    let eta = tsm::vanishing(lambda, delta, 0.8).unwrap();
    assert!((eta - 0.4 * lambda * delta / (1.6 * lambda - 2.0 * delta)).abs() < 1e-12);
    assert_eq!(tsm::vanishing(1.0, 0.81, 0.8), None);
}

/// Of all n, n_opt has the smallest largest aliasing error along the view, and equal errors at both ends.
#[test]
fn n_opt_balances_near_and_far() {
    // Level over a floor, the sun in the zenith.
    let s = scope(camera(Vec3::new(0.0, 4.9, 15.0), Vec3::new(0.0, 4.9, -15.0)), Vec3::Y);
    let (image, eye) = (s.image(), s.eye());
    let body = s.seen();
    let by = lispsm::Strength { strength: 1.0, fade: 0.9 };
    let fit = lispsm::fit(&s, &image, &body, by);
    assert!((fit.gamma.to_degrees() - 90.0).abs() < 1e-4);
    let (z0, z1) = (eye.near, eye.near + fit.far - fit.near);
    assert!((fit.n - (z0 + (z0 * z1).sqrt())).abs() < 1e-6 * fit.n, "{} for {z0} to {z1}", fit.n);
    // m in the direction of the view: the texel's extent over the pixel's, up to a factor.
    let along = |n: f64| {
        let h = lispsm::warp(fit.direction, image.at(eye.position), fit.near, n);
        let base = image.at(eye.position) - fit.direction * (image.at(eye.position).dot(fit.direction) - fit.near);
        let y = |b: f64| warped(&h, base + fit.direction * b).0.y;
        let d = fit.far - fit.near;
        let e = 1e-6;
        (0..=200)
            .map(|i| i as f64 / 200.0 * d)
            .map(|b| (y(d) - y(0.0)) / ((y(b + e) - y(b - e)) / (2.0 * e)) / (z0 + b))
            .collect::<Vec<f64>>()
    };
    let worst = |n: f64| along(n).into_iter().fold(0.0, f64::max);
    let best = along(fit.n);
    assert!((best[0] / best[200] - 1.0).abs() < 1e-3, "near {}, far {}", best[0], best[200]);
    for n in [f64::INFINITY, z0, 0.7 * fit.n, 1.4 * fit.n] {
        assert!(worst(n) > 1.05 * worst(fit.n), "n = {n}: {} against {}", worst(n), worst(fit.n));
    }
    // A body that reaches behind the eye, gaze along the light, no strength: a plain map.
    assert_eq!(lispsm::optimal(3.0, -1.0, 2.0), f64::INFINITY);
    let down = scope(camera(Vec3::new(0.0, 4.0, 0.0), Vec3::new(0.0, 0.0, 0.0)), Vec3::Y);
    assert_eq!(lispsm::fit(&down, &down.image(), &down.seen(), by).n, f64::INFINITY);
    let off = lispsm::Strength { strength: 0.0, ..by };
    assert_eq!(lispsm::fit(&s, &image, &body, off).n, f64::INFINITY);
}

/// The rectangle of rotating calipers is the smallest of 3600 turned ones, and holds every point.
#[test]
fn calipers_find_the_least_rectangle() {
    let mut r = Random(3);
    let mut gained = 0;
    for i in 0..300 {
        let s = random(&mut r);
        let points: Vec<DVec2> = s.seen().iter().map(|p| s.image().at(*p)).collect();
        let Some(turn) = msf::turned(&points) else { continue };
        let least = msf::area(&turn, &points);
        let turned = |angle: f64| {
            let (sin, cos) = angle.sin_cos();
            let h = DMat3::from_cols(DVec3::new(cos, -sin, 0.0), DVec3::new(sin, cos, 0.0), DVec3::Z);
            msf::area(&h, &points)
        };
        let brute = (0..3600).map(|k| turned(k as f64 * std::f64::consts::FRAC_PI_2 / 3600.0)).fold(f64::MAX, f64::min);
        assert!(least <= brute * (1.0 + 1e-9) && least >= brute * 0.999, "frustum {i}: {least}, {brute}");
        gained += (least < 0.8 * turned(0.0)) as u32;
        // All that the frustum sees of the box is inside; corners are where three planes of theirs meet.
        let view = msf::view(&s).unwrap();
        for p in s.seen() {
            let t = texel(&view, p);
            assert!(t.min_element() > 0.5 && t.max_element() < 511.5, "frustum {i}: {p} at {t}");
        }
    }
    assert!(gained > 50, "{gained}");
    // The cut of a box by a plane through its middle, and by one that leaves nothing.
    let mut cube = hull::Polyhedron::cuboid(DVec3::ZERO, DVec3::ONE);
    cube.clip(DVec3::ONE.extend(-1.5), 1e-9);
    let corners = cube.corners();
    let rim = corners.iter().filter(|p| (p.element_sum() - 1.5).abs() < 1e-9);
    assert!(rim.count() == 18 && corners.len() == 30, "a hexagon that six of the seven faces share: {corners:?}");
    cube.clip(DVec3::ONE.extend(-4.0), 1e-9);
    assert!(cube.corners().is_empty());
}

/// Where a view puts a point, texels; in f64.
fn texel(v: &LightView, p: DVec3) -> DVec2 {
    let row = |r: Vec4| r.as_dvec4().dot(p.extend(1.0));
    let ndc = DVec2::new(row(v.row_x), -row(v.row_y)) / row(v.row_w);
    (ndc + 1.0) * 0.5 * v.resolution as f64
}

/// m of a warped map is that of central differences through the warp.
#[test]
fn aliasing_error_follows_the_warp() {
    let view = camera(Vec3::new(0.5, 2.0, 5.0), Vec3::new(0.0, 0.0, 0.5));
    let ground = floor(Vec2::splat(-6.0), Vec2::splat(6.0), 0.0);
    let (mut r, mut s) =
        start(scene(vec![mesh(&ground, 0)], vec![material(Vec3::ONE)], view, sun(Vec3::new(0.5, 1.0, 0.3))), [96, 72]);
    select(&mut s, "tsm", &["resolution=512"]);
    r.render(&s, Ask { analysis: true, ..ask(&s) }).unwrap();
    let bounds = [Vec3::new(-6.0, 0.0, -6.0), Vec3::new(6.0, 0.0, 6.0)];
    let scope = Scope { camera: view, light: s.light, bounds, aspect: 96.0 / 72.0, resolution: 512, margin: 1.0 };
    let image = scope.image();
    let t = tsm::fit(&scope, &image, 0.8f32 as f64, 0.2f32 as f64);
    let map = scope.view(&image, &t.warp, &t.trapezoid.unwrap(), scope.deepest(&image, &scope.seen())).unwrap();
    let eye = scope.eye();
    let ground = |x: f64, y: f64| {
        let ndc = DVec2::new(x / 96.0, y / 72.0) * 2.0 - 1.0;
        let ray = eye.forward + eye.right * (ndc.x * eye.tangent.x) - eye.up * (ndc.y * eye.tangent.y);
        eye.position - ray * (eye.position.y / ray.y)
    };
    let found = r.analysis().aliasing(&r.gpu).unwrap().unwrap();
    let mut checked = 0;
    let (mut least, mut most) = (f64::MAX, 0f64);
    for (i, m) in found.iter().map(|p| p[0] as f64).enumerate().filter(|(_, m)| *m > 0.0) {
        let (x, y, e) = ((i % 96) as f64 + 0.5, (i / 96) as f64 + 0.5, 1e-4);
        let jx = (texel(&map, ground(x + e, y)) - texel(&map, ground(x - e, y))) / (2.0 * e);
        let jy = (texel(&map, ground(x, y + e)) - texel(&map, ground(x, y - e))) / (2.0 * e);
        let (p, q, d) = (jx.length_squared(), jy.length_squared(), jx.perp_dot(jy));
        // Smallest eigenvalue of JᵀJ: one over m².
        let small = 0.5 * (p + q) - (0.25 * (p - q) * (p - q) + jx.dot(jy).powi(2)).sqrt();
        let exact = (0.5 * (p + q) + (0.25 * (p - q) * (p - q) + jx.dot(jy).powi(2)).sqrt()).sqrt() / d.abs();
        assert!(small > 0.0 && (m / exact - 1.0).abs() < 0.01, "pixel {i}: m = {m}, not {exact}");
        (least, most) = (least.min(exact), most.max(exact));
        checked += 1;
    }
    assert!(checked > 3000 && most > 1.5 * least, "{checked} pixels, {least} to {most}");
}

/// Every pixel that faces the sun has a texel, and a warp errs less than a map of the whole scene.
#[test]
fn warps_hold_all_receivers_and_pay() {
    for name in ["bench", "arches", "terrain"] {
        let (mut r, mut s) = built_in(name, [192, 192]);
        let whole = errors(&mut r, &mut s, "shadow-map", &["resolution=512", "fit=scene"]).share();

        for (technique, sets) in [
            ("lispsm", vec!["resolution=512"]),
            ("tsm", vec!["resolution=512"]),
            ("psm", vec!["resolution=512"]),
            ("shadow-map", vec!["resolution=512", "fit=msf"]),
        ] {
            let e = errors(&mut r, &mut s, technique, &sets);
            assert!(e.share() < 0.9 * whole, "{name} {technique}: {} against {whole}", e.share());
            r.render(&s, Ask { analysis: true, ..ask(&s) }).unwrap();
            let mut counted = 0u64;
            r.analysis().counts(&r.gpu, |_, part| counted += part.iter().map(|c| *c as u64).sum::<u64>()).unwrap();
            let facing = r.read_mask().unwrap().iter().filter(|m| **m == FACING).count() as u64;
            assert_eq!(counted, facing, "{name} {technique}");
        }
    }
}

/// A lit plane stays lit under every sun, with the default bias; with half the exact slope bias it does not.
#[test]
fn a_warped_plane_casts_nothing_on_itself() {
    let (mut r, mut s) = built_in("st-single-plane", [160, 160]);
    for technique in WARPS {
        assert_eq!(errors(&mut r, &mut s, technique, &["resolution=256"]).shadow_incorrect, 0, "{technique}");
    }
    let ground = floor(Vec2::splat(-40.0), Vec2::splat(40.0), 0.0);
    let mut acne = [0; 3];
    for to_light in
        [Vec3::new(0.9, 1.0, 0.3), Vec3::new(0.0, 0.6, 1.0), Vec3::new(0.3, 0.5, -1.0), Vec3::new(1.0, 0.2, 0.0)]
    {
        let view = camera(Vec3::new(0.0, 1.5, 20.0), Vec3::new(0.0, 0.0, 8.0));
        let (mut r, mut s) =
            start(scene(vec![mesh(&ground, 0)], vec![material(Vec3::ONE)], view, sun(to_light)), [160, 120]);
        for (i, technique) in WARPS.into_iter().enumerate() {
            for sets in [["resolution=64", "receiver_plane=false"], ["resolution=256", "receiver_plane=true"]] {
                let e = errors(&mut r, &mut s, technique, &sets);
                assert_eq!(e.rmse, 0.0, "{technique} {to_light} {sets:?}: {e:?}");
            }
            let e = errors(&mut r, &mut s, technique, &["resolution=64", "bias=0", "slope_bias=0.35"]);
            acne[i] += e.shadow_incorrect;
        }
    }
    assert!(acne.iter().all(|a| *a > 500), "{acne:?}");
}

/// The stored depth is the linear one: a plate 6 mm above a floor shades all of it with a bias of 5 mm, none with 7.
#[test]
fn warped_depth_is_linear() {
    let mut triangles = floor(Vec2::splat(-30.0), Vec2::splat(30.0), 0.0);
    // Seen from below the plate, the floor is all in its shadow; a second box makes the scene 20 m high.
    triangles.extend(floor(Vec2::splat(-30.0), Vec2::splat(30.0), 0.006).iter().map(|t| [t[0], t[2], t[1]]));
    triangles.extend(floor(Vec2::splat(29.0), Vec2::splat(30.0), 20.0));
    let mut single = material(Vec3::ONE);
    single.double_sided = false;
    let view = camera(Vec3::new(0.0, 3.0, 25.0), Vec3::new(0.0, 0.0, 10.0));
    let (mut r, mut s) = start(scene(vec![mesh(&triangles, 0)], vec![single], view, sun(Vec3::Y)), [160, 120]);
    for technique in WARPS {
        for (bias, lit) in [("bias=0.005", 0), ("bias=0.007", 1)] {
            select(&mut s, technique, &["resolution=256", bias, "slope_bias=0"]);
            r.render(&s, ask(&s)).unwrap();
            let (v, mask, at) = (r.read_visibility().unwrap(), r.read_mask().unwrap(), r.read_position().unwrap());
            // Inside the plate's edge.
            let inner = |p: &[f32; 4]| p[0].abs().max(p[2].abs()) < 25.0;
            let seen: Vec<f32> = (0..v.len()).filter(|i| mask[*i] == FACING && inner(&at[*i])).map(|i| v[i]).collect();
            assert!(seen.len() > 5000, "{technique}: {}", seen.len());
            assert!(seen.iter().all(|v| *v == lit as f32), "{technique} {bias}: not all {lit}");
        }
    }
}

/// Front and back faces stay what they are, though Martin and Tan's second matrix mirrors.
#[test]
fn culling_knows_the_faces() {
    let (mut r, mut s) = built_in("bench", [160, 120]);
    for technique in WARPS {
        for cull in ["cull=front", "cull=back"] {
            let plain = errors(&mut r, &mut s, "shadow-map", &["resolution=2048", cull]).share();
            let warped = errors(&mut r, &mut s, technique, &["resolution=2048", cull]).share();
            assert!(warped < 1.5 * plain + 0.004, "{technique} {cull}: {warped}, unwarped {plain}");
        }
    }
}

/// As the sun goes from ahead of the camera to behind it, the perspective shadow map changes steadily.
#[test]
fn psm_goes_through_its_cases_steadily() {
    let place = |s: &Scope, fit: &psm::Psm| -> Vec<DVec2> {
        let image = s.image();
        let seen = s.seen();
        let points: Vec<DVec2> = seen.iter().map(|p| image.at(*p)).collect();
        let view = s.view(&image, &fit.warp, &points, 1.0).unwrap();
        seen.iter().map(|p| texel(&view, *p)).collect()
    };
    let view = camera(Vec3::new(0.0, 4.0, 18.0), Vec3::new(0.0, 1.0, 0.0));
    let by = psm::Slide { fixed: None, least_near: 1.0, push: true };
    let at = |degrees: f64| {
        let (sin, cos) = (degrees.to_radians().sin() as f32, degrees.to_radians().cos() as f32);
        // Round the camera's right axis: at 90° across the view.
        let forward = view.forward();
        let up = Vec3::X.cross(forward);
        let s = scope(view, forward * cos + up * sin + Vec3::X * 0.2);
        let fit = psm::fit(&s, &s.image(), &s.seen(), by);
        (place(&s, &fit), fit.case)
    };
    let mut cases = Vec::new();
    let mut last: Option<Vec<DVec2>> = None;
    for i in 0..=400 {
        let (now, case) = at(89.0 + i as f64 * 0.005);
        if cases.last() != Some(&case) {
            cases.push(case);
        }
        if let Some(last) = last {
            let moved = now.iter().zip(&last).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
            assert!(moved < 2.0, "at step {i} ({case:?}) a corner moves by {moved} of 512 texels");
        }
        last = Some(now);
    }
    use psm::Case::{Parallel, Point, Sink};
    assert_eq!(cases, [Some(Point), Some(Parallel), Some(Sink)]);
}

/// What breaks fits leaves a finite picture: duelling frusta, light from behind, no area, nothing in view.
#[test]
fn nothing_breaks() {
    for id in ["st-duel", "st-behind", "st-degenerate", "st-depthrange"] {
        let (mut r, mut s) = built_in(id, [64, 64]);
        let case = stability::find(id).unwrap();
        for t in [0.0, 0.5, 1.0] {
            (case.place)(&mut s, t);
            for (technique, sets) in [
                ("lispsm", "strength=2"),
                ("lispsm", "focus=false"),
                ("tsm", "p=0.95"),
                ("psm", "push=false"),
                ("psm", "delta_mode=fixed"),
                ("shadow-map", "fit=msf"),
            ] {
                let e = errors(&mut r, &mut s, technique, &["resolution=256", sets]);
                assert!(e.rmse.is_finite(), "{id} {technique} at {t}");
                assert!(
                    r.read_visibility().unwrap().iter().all(|v| (0.0..=1.0).contains(v)),
                    "{id} {technique} at {t}"
                );
            }
        }
    }
    let scene = builtin::build("bench").unwrap();
    let (mut r, mut s) = start(scene, [64, 64]);
    s.camera = camera(Vec3::new(0.0, 500.0, 0.0), Vec3::new(1.0, 900.0, 0.0));
    for (technique, sets) in
        [("lispsm", "strength=1"), ("tsm", "p=0.8"), ("psm", "push=true"), ("shadow-map", "fit=msf")]
    {
        assert_eq!(errors(&mut r, &mut s, technique, &[sets]).facing, 0);
    }
}
