//! Warped light views against closed forms, brute force and the truth.

use crate::common::*;
use glam::{DMat3, DVec2, DVec3, Vec2, Vec3, Vec4};
use shadowscope::frame::{Ask, Renderer};
use shadowscope::light::{Light, LightView};
use shadowscope::map::fit::{Scope, hull, lispsm, msf, psm, tsm, warped};
use shadowscope::measure::metrics::FACING;
use shadowscope::scene::Camera;
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
        // Under the sun the focus is the image of a place on the view's axis.
        let eye = s.eye();
        let on_axis = s.image().at(eye.position + eye.forward * (0.8 * eye.near + 0.2 * eye.far));
        assert!(t.focus.distance(on_axis) < 1e-6 * t.focus.length().max(1.0), "frustum {i}: {} {on_axis}", t.focus);
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

/// Area of the box around points after a warp.
fn area(h: &DMat3, points: &[DVec2]) -> f64 {
    let [low, high] = hull::extent(points.iter().map(|p| warped(h, *p).0));
    (high - low).element_product()
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
        let least = area(&turn, &points);
        let turned = |angle: f64| {
            let (sin, cos) = angle.sin_cos();
            let h = DMat3::from_cols(DVec3::new(cos, -sin, 0.0), DVec3::new(sin, cos, 0.0), DVec3::Z);
            area(&h, &points)
        };
        let brute = (0..3600).map(|k| turned(k as f64 * std::f64::consts::FRAC_PI_2 / 3600.0)).fold(f64::MAX, f64::min);
        assert!(least <= brute * (1.0 + 1e-9) && least >= brute * 0.999, "frustum {i}: {least}, {brute}");
        gained += (least < 0.8 * turned(0.0)) as u32;
        // All that the frustum sees of the box is inside; corners are where three planes of theirs meet.
        let view = msf::view(&s, &s.cuboid(), 0.0).unwrap();
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

/// A strip that lies across its box: the minimal shadow frustum covers the strip, not the box, and reaches from what casts
/// to what receives.
#[test]
fn the_minimal_frustum_is_that_of_the_hull() {
    let (along, across) = (Vec3::new(1.0, 0.0, 1.0).normalize(), Vec3::new(1.0, 0.0, -1.0).normalize());
    let (half, width) = (10.0 * std::f32::consts::SQRT_2 - 0.7, 0.7);
    let corner = |i: usize, y: f32| {
        let sign = |bit: usize| if i & bit == 0 { -1.0 } else { 1.0 };
        along * (half * sign(1)) + across * (width * sign(2)) + Vec3::Y * y
    };
    let strip = |y| [[corner(0, y), corner(1, y), corner(3, y)], [corner(0, y), corner(3, y), corner(2, y)]];
    let triangles = [&strip(0.0)[..], &strip(1.0)].concat();
    let mut view = camera(Vec3::new(0.0, 60.0, 0.1), Vec3::ZERO);
    view.far = 100.0;
    let built = scene(vec![mesh(&triangles, 0)], vec![material(Vec3::ONE)], view, sun(Vec3::Y));
    let (r, s) = start(built, [64, 64]);
    let bounds = r.geometry().bounds;
    let scope = Scope { camera: s.camera, light: s.light, bounds, aspect: 1.0, resolution: 512, margin: 1.0 };
    let area = |v: &LightView| {
        let side = |row: Vec4| 2.0 / row.truncate().length() * (510.0 / 512.0);
        side(v.row_x) * side(v.row_y)
    };
    let of_hull = msf::view(&scope, r.geometry().hull(), 0.0).unwrap();
    assert!((area(&of_hull) - 4.0 * half * width).abs() < 0.05, "{} m²", area(&of_hull));
    let of_box = msf::view(&scope, &scope.cuboid(), 0.0).unwrap();
    assert!((area(&of_box) - 400.0).abs() < 0.5, "{} m²", area(&of_box));
    assert!((of_hull.far - of_hull.near - 1.0).abs() < 0.01, "{}", of_hull.far - of_hull.near);
    // Seen from close by, casts only what stands between the light and what is seen.
    let p = |x: f32, y: f32, z: f32| Vec3::new(x, y, z);
    let mast = [[p(30.0, 0.0, 30.0), p(31.0, 0.0, 30.0), p(30.0, 90.0, 30.0)]];
    let ground = [
        [p(-40.0, 0.0, -40.0), p(40.0, 0.0, 40.0), p(40.0, 0.0, -40.0)],
        [p(-40.0, 0.0, -40.0), p(-40.0, 0.0, 40.0), p(40.0, 0.0, 40.0)],
    ];
    let view = camera(p(-30.0, 3.0, -30.0), p(-31.0, 0.0, -31.0));
    let built = scene(vec![mesh(&[&mast[..], &ground].concat(), 0)], vec![material(Vec3::ONE)], view, sun(Vec3::Y));
    let (r, s) = start(built, [64, 64]);
    let scope = Scope { camera: s.camera, bounds: r.geometry().bounds, aspect: 1.0, ..scope };
    let close = msf::view(&scope, r.geometry().hull(), 0.0).unwrap();
    // There the hull, a tent around the mast, is low.
    assert!(close.far - close.near < 25.0, "{}", close.far - close.near);
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
            assert_eq!(counted(&mut r, &s), facing(&mut r), "{name} {technique}");
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

/// A random camera and lamp in the scope's box.
fn random_spot(r: &mut Random) -> Scope {
    let s = random(r);
    let at = Vec3::new(18.0, 3.0, 18.0) * r.point() + Vec3::Y * 3.0;
    Scope { light: spot(at, at + r.point() - Vec3::Y * 0.5, 15.0 + 60.0 * r.next()), ..s }
}

/// Every warp's view of a lamp holds all that the camera can see in its cone, before the lamp and in the map.
#[test]
fn warps_of_a_lamp_hold_its_cone() {
    let mut r = Random(11);
    let (mut seen_by, mut warped_by) = (0, [0; 3]);
    for i in 0..400 {
        let s = random_spot(&mut r);
        let (image, seen) = (s.image(), s.seen());
        if seen.is_empty() {
            continue;
        }
        seen_by += 1;
        let points: Vec<DVec2> = seen.iter().map(|p| image.at(*p)).collect();
        let deepest = s.deepest(&image, &seen);
        let l = lispsm::fit(&s, &image, &seen, lispsm::Strength { strength: 1.0, fade: 0.9 });
        let t = tsm::fit(&s, &image, 0.8, 0.2);
        let p = psm::fit(&s, &image, &seen, psm::Slide { fixed: None, least_near: 0.5, push: true });
        let covered = t.trapezoid.as_ref().map_or(&t.hull[..], |t| t);
        let views = [
            s.view(&image, &l.warp, &points, deepest),
            s.view(&image, &t.warp, covered, deepest),
            s.view(&image, &p.warp, &points, deepest),
        ];
        for ((k, v), technique) in views.into_iter().enumerate().zip(WARPS) {
            let v = v.unwrap_or_else(|| panic!("{technique} {i}: no view"));
            warped_by[k] += (v.perspective == LightView::WARPED) as u32;
            // Near the tip f32 holds the image of a point to a share of its distance only.
            let near = 1e-3 * deepest;
            for q in seen.iter().filter(|q| image.depth.dot(q.extend(1.0)) > near) {
                let at = texel(&v, *q);
                let w = v.row_w.as_dvec4().dot(q.extend(1.0));
                assert!(w > 0.0, "{technique} {i}: {q} has w = {w}");
                assert!(at.min_element() > 0.0 && at.max_element() < 512.0, "{technique} {i}: {q} at {at}");
            }
        }
    }
    assert!(seen_by > 100 && warped_by.iter().all(|n| *n > 60), "{seen_by}, {warped_by:?}");
}

/// A lamp as far away as can be is the sun: the same perspectives, the same places in the map.
#[test]
fn a_far_lamp_is_the_sun() {
    let mut r = Random(5);
    let mut warped_by = 0;
    for i in 0..50 {
        let under_sun = random(&mut r);
        let to_light = under_sun.light.position();
        let mut light = spot(to_light * 1e5, Vec3::ZERO, 0.05);
        if let Light::Spot { range, .. } = &mut light {
            *range = f32::INFINITY;
        }
        let under_lamp = Scope { light, ..under_sun };
        let fits = [under_sun, under_lamp].map(|s| {
            let (image, seen) = (s.image(), s.seen());
            let l = lispsm::fit(&s, &image, &seen, lispsm::Strength { strength: 1.0, fade: 0.9 });
            let p = psm::fit(&s, &image, &seen, psm::Slide { fixed: Some(3.0), least_near: 1.0, push: true });
            let points: Vec<DVec2> = seen.iter().map(|p| image.at(*p)).collect();
            (l, p.case, s.view(&image, &p.warp, &points, s.deepest(&image, &seen)).unwrap())
        });
        let [(sun, case, a), (lamp, other, b)] = fits;
        if sun.n.is_finite() {
            let n = lamp.n * 1e5;
            assert!((n / sun.n - 1.0).abs() < 2e-2, "{i}: {n}, the sun's {}", sun.n);
            assert!(lamp.direction.dot(sun.direction) > 0.999, "{i}: {} {}", lamp.direction, sun.direction);
        }
        assert_eq!(case, other, "{i}");
        for p in under_sun.seen() {
            // f32 rows of a lamp so far away keep but few digits.
            let d = texel(&a, p).distance(texel(&b, p));
            assert!(case.is_none() || d < 20.0, "{i}: {p} lies {d} texels apart");
        }
        warped_by += (sun.n.is_finite() && case.is_some()) as u32;
    }
    assert!(warped_by > 20, "{warped_by}");
}

/// As a lamp goes past the camera, its map goes from point through parallel to sink, steadily.
#[test]
fn psm_follows_a_lamp_past_the_camera() {
    let view = camera(Vec3::new(0.0, 1.0, 8.0), Vec3::new(0.0, 1.0, 0.0));
    // Without a slide the cases are those of the camera itself.
    let by = psm::Slide { fixed: Some(0.0), least_near: 0.5, push: true };
    let at = |z: f32| {
        let s =
            Scope { light: spot(Vec3::new(0.3, 4.9, z), Vec3::new(0.0, 0.0, z - 5.0), 30.0), ..scope(view, Vec3::Y) };
        let (image, seen) = (s.image(), s.seen());
        let fit = psm::fit(&s, &image, &seen, by);
        let points: Vec<DVec2> = seen.iter().map(|p| image.at(*p)).collect();
        let v = s.view(&image, &fit.warp, &points, s.deepest(&image, &seen)).unwrap();
        // Points on the floor that stay before the lamp.
        let places = [-2.0, -1.0, 0.0, 1.0, 2.0].map(|x| texel(&v, DVec3::new(x, 0.0, z as f64 - 4.0)));
        (places, fit.case)
    };
    let mut cases = Vec::new();
    let mut last: Option<[DVec2; 5]> = None;
    for i in 0..=400 {
        let (now, case) = at(7.8 + i as f32 * 0.001);
        if cases.last() != Some(&case) {
            cases.push(case);
        }
        if let Some(last) = last {
            let moved = now.iter().zip(&last).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
            assert!(moved < 4.0, "at step {i} ({case:?}) a point moves by {moved} of 512 texels");
        }
        last = Some(now);
    }
    use psm::Case::{Parallel, Point, Sink};
    assert_eq!(cases, [Some(Point), Some(Parallel), Some(Sink)]);
}

/// As the camera goes past a lamp, the trapezoid turns into a rectangle steadily: it knows the frustum and the cone only.
#[test]
fn tsm_follows_a_camera_past_a_lamp() {
    let light = spot(Vec3::new(0.5, 3.0, 0.0), Vec3::new(0.0, 0.5, -8.0), 40.0);
    let at = |z: f32| {
        let view = camera(Vec3::new(0.0, 2.0, z), Vec3::new(0.0, 1.0, z - 10.0));
        let s = Scope { light, ..scope(view, Vec3::Y) };
        let (image, t) = (s.image(), tsm::fit(&s, &s.image(), 0.8, 0.2));
        let covered = t.trapezoid.as_ref().map_or(&t.hull[..], |t| t);
        let v = s.view(&image, &t.warp, covered, s.deepest(&image, &s.seen())).unwrap();
        let places = [-2.0, 0.0, 2.0].map(|x| texel(&v, DVec3::new(x, 0.5, -9.0)));
        (places, t.trapezoid.is_some())
    };
    let mut last: Option<[DVec2; 3]> = None;
    let mut trapezoids = 0;
    for i in 0..=4000 {
        let (now, trapezoid) = at(-4.0 + i as f32 * 0.002);
        trapezoids += trapezoid as u32;
        if let Some(last) = last {
            let moved = now.iter().zip(&last).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
            // The most where the cone's tip comes into view.
            assert!(moved < 6.0, "at step {i} a point moves by {moved} of 512 texels");
        }
        last = Some(now);
    }
    assert!(trapezoids > 800 && trapezoids < 3600, "{trapezoids}");
}

/// Under a built-in spot no warp errs much more than a plain fitted map, and where the camera is close some err far less.
#[test]
fn warps_pay_under_a_spot() {
    let mut gained = [0; 3];
    for (name, view, light) in [
        ("blocks", "close", "spot"),
        ("cubes", "near", "spot"),
        ("bench", "flowers-side", "spot"),
        ("terrain", "square", "floodlight"),
    ] {
        let (mut setup, content) = Setup::open(name).unwrap();
        setup.size = [256, 256];
        setup.camera = content.cameras.iter().find(|c| c.name == view).unwrap().camera;
        setup.light = content.lights.iter().find(|l| l.name == light).unwrap().light;
        let mut r = Renderer::new(gpu(), Arc::new(content)).unwrap();
        let plain = errors(&mut r, &mut setup, "shadow-map", &["resolution=512"]).share();
        for (i, technique) in WARPS.into_iter().enumerate() {
            let own = errors(&mut r, &mut setup, technique, &["resolution=512"]).share();
            println!("{name} {view} {technique}: {own:.5}, fitted {plain:.5}");
            gained[i] += (own < 0.9 * plain) as u32;
            assert!(technique == "tsm" || own < 1.1 * plain, "{name} {technique}: {own}, fitted {plain}");
        }
    }
    assert!(gained[0] >= 3 && gained[2] >= 3, "{gained:?}");
}
