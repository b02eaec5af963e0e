//! Fits on the CPU against brute force: over scattered crumbs, small enough to lie in one place, and over points of what is seen.

use crate::common::*;
use glam::{DMat3, DVec2, DVec3, DVec4, Vec3, Vec4};
use shadowscope::light::{Light, LightView};
use shadowscope::map::fit::crop::{Extent, crop};
use shadowscope::map::fit::faces::{Around, Face};
use shadowscope::map::fit::hull::extent;
use shadowscope::map::fit::lispsm::{self, Strength};
use shadowscope::map::fit::quickhull::convex_hull;
use shadowscope::map::fit::{Eye, Scope, casting, logpsm, msf, part, warped};
use shadowscope::scene::Camera;
use shadowscope::scene::geometry::Geometry;

/// Triangles a tenth of a millimetre wide, anywhere in a box 20 m wide and 6 m high, and where they lie.
fn crumbs(r: &mut Random, count: usize) -> (Geometry, Vec<DVec3>) {
    let at: Vec<Vec3> = (0..count).map(|_| r.point() * Vec3::new(10.0, 3.0, 10.0) + Vec3::Y * 3.0).collect();
    let triangles: Vec<[Vec3; 3]> = at.iter().map(|p| [Vec3::X, Vec3::Y, Vec3::Z].map(|a| *p + a * 1e-4)).collect();
    let built = scene(vec![mesh(&triangles, 0)], vec![material(Vec3::ONE)], camera(Vec3::Y, Vec3::ZERO), sun(Vec3::Y));
    (Geometry::new(&built, 0, 0.0).unwrap(), at.iter().map(|p| p.as_dvec3()).collect())
}

/// A random camera among them, under a sun or a spot.
fn among(r: &mut Random, geometry: &Geometry, spotted: bool) -> Scope {
    let at = r.point() * Vec3::new(9.0, 2.5, 9.0) + Vec3::Y * 3.0;
    let mut view = camera(at, at + r.point());
    view.fov = 40.0 + 50.0 * r.next();
    let (from, way) = (r.point() * Vec3::new(8.0, 2.0, 8.0) + Vec3::Y * 4.0, r.point());
    let light = if spotted {
        spot(from, from + way - Vec3::Y * 0.5, 25.0 + 40.0 * r.next())
    } else {
        sun(Vec3::new(way.x, way.y.abs() + 0.2, way.z))
    };
    Scope { camera: view, light, bounds: geometry.bounds, aspect: 1.5, resolution: 512, margin: 1.0 }
}

/// How far a point lies inside all of some planes, metres.
fn inside(planes: &[DVec4], p: DVec3) -> f64 {
    planes.iter().map(|plane| plane.dot(p.extend(1.0)) / plane.truncate().length()).fold(f64::INFINITY, f64::min)
}

/// A cascade's crop is the box around the image of what is seen between its depths, from the first thing on the way there to
/// the last that is seen.
#[test]
fn a_crop_is_that_of_what_is_there() {
    let mut r = Random(3);
    let (mut some, mut none, mut nearer) = (0, 0, 0);
    for i in 0..240 {
        let (geometry, at) = crumbs(&mut r, if i % 3 == 0 { 5 } else { 150 });
        let scope = among(&mut r, &geometry, i % 2 == 1);
        let image = scope.image();
        let near = 0.1 + 4.0 * r.next() as f64;
        let far = near + 8.0 * r.next() as f64;
        let body = scope.slice(near, far);
        let all = Extent::of(&image, &body, scope.eps());
        let found = crop(&scope, &geometry, [near, far], &all);
        let planes: Vec<DVec4> = Eye { near, far, ..scope.eye() }.planes().into_iter().chain(scope.reach()).collect();
        let (depth, w) = (|p: &DVec3| image.depth.dot(p.extend(1.0)), |p: &DVec3| image.rows[2].dot(p.extend(1.0)));
        // Of those that surely count, and of those that may.
        let [sure, perhaps] = [2e-3, -2e-3].map(|margin: f64| {
            let seen: Vec<DVec3> = at.iter().copied().filter(|p| inside(&planes, *p) > margin).collect();
            let over = |p: &&DVec3| {
                let at = image.at(**p);
                let free = (at - all.low).min(all.high - at).min_element() * w(p);
                w(p) > margin.max(1e-6) && free > margin && all.deepest - depth(p) > margin
            };
            let [low, high] = extent(seen.iter().map(|p| image.at(*p)));
            let nearest = at.iter().filter(over).map(depth).fold(f64::INFINITY, f64::min);
            (
                seen.len(),
                Extent { low, high, nearest, deepest: seen.iter().map(depth).fold(f64::NEG_INFINITY, f64::max) },
            )
        });
        let Some(found) = found else {
            assert_eq!(sure.0, 0, "{i}: {} are seen", sure.0);
            none += 1;
            continue;
        };
        assert!(perhaps.0 > 0, "{i}: nothing is seen");
        // A crumb's own size, as the spot sees it from a tip's distance.
        let spare = 2e-4 / perhaps.1.nearest.clamp(0.01, 1.0);
        for (name, least, x, most) in [
            ("left", perhaps.1.low.x, found.low.x, sure.1.low.x),
            ("below", perhaps.1.low.y, found.low.y, sure.1.low.y),
            ("right", -perhaps.1.high.x, -found.high.x, -sure.1.high.x),
            ("above", -perhaps.1.high.y, -found.high.y, -sure.1.high.y),
            ("nearest", perhaps.1.nearest, found.nearest, sure.1.nearest),
            ("deepest", -perhaps.1.deepest, -found.deepest, -sure.1.deepest),
        ] {
            assert!(least - spare <= x && x <= most + spare, "{i} {name}: {x} is not from {least} to {most}");
        }
        some += 1;
        nearer += (found.nearest < all.nearest - 0.5) as u32;
    }
    assert!(some > 60 && none > 20 && nearer > 10, "{some}, {none}, {nearer}");
}

/// Between its two ends a body seen by a spot has a place; with a part behind the light it may appear anywhere.
#[test]
fn what_lies_behind_a_spot_may_appear_anywhere() {
    let s = among(&mut Random(1), &crumbs(&mut Random(1), 9).0, false);
    let s = Scope { light: spot(Vec3::Y * 3.0, Vec3::ZERO, 30.0), ..s };
    let (image, p) = (s.image(), |x: f64, y: f64| DVec3::new(x, y, 0.0));
    let before = Extent::of(&image, &[p(1.0, 1.0), p(-1.0, 2.0), p(0.0, 0.0)], s.eps());
    // 1 m aside at a depth of 2 m, and of 1 m.
    assert!((before.nearest - 1.0).abs() < 1e-6 && (before.deepest - 3.0).abs() < 1e-6, "{before:?}");
    let ends = [before.low.x, before.high.x];
    assert!((ends[1] - ends[0] - 1.5).abs() < 1e-6 && ends.iter().any(|x| (x.abs() - 1.0).abs() < 1e-6), "{before:?}");
    let across = Extent::of(&image, &[p(1.0, 1.0), p(0.0, 4.0)], s.eps());
    assert_eq!((across.low, across.high), (DVec2::NEG_INFINITY, DVec2::INFINITY));
    assert!((across.nearest + 1.0).abs() < 1e-6 && (across.deepest - 2.0).abs() < 1e-6, "{across:?}");
}

/// The outline of what is seen touches it on each of 32 sides, and the nearest thing before what is seen is that of all in the
/// light's image of it.
#[test]
fn casting_is_that_of_what_is_there() {
    let mut r = Random(9);
    let mut drawn = 0;
    for i in 0..120 {
        let (geometry, at) = crumbs(&mut r, 300);
        let scope = among(&mut r, &geometry, i % 2 == 1);
        let (image, seen) = (scope.image(), scope.seen());
        let (depth, w) = (|p: &DVec3| image.depth.dot(p.extend(1.0)), |p: &DVec3| image.rows[2].dot(p.extend(1.0)));
        let planes: Vec<DVec4> = scope.eye().planes().into_iter().chain(scope.reach()).collect();
        let outline = casting::outline(&scope, &image, &geometry);
        let visible = |margin: f64| at.iter().copied().filter(move |p| inside(&planes, *p) > margin);
        let (sure, perhaps) = (visible.clone()(1e-3).collect::<Vec<_>>(), visible(-1e-3).collect::<Vec<_>>());
        if outline.is_empty() {
            assert!(sure.is_empty(), "{i}: {} are seen", sure.len());
        } else {
            assert!(!perhaps.is_empty(), "{i}");
            for k in 0..32 {
                let out = DVec2::from_angle(k as f64 * std::f64::consts::TAU / 32.0);
                let far = |points: &[DVec2]| points.iter().map(|p| out.dot(*p)).fold(f64::NEG_INFINITY, f64::max);
                let [least, most] = [&sure, &perhaps].map(|p| far(&p.iter().map(|p| image.at(*p)).collect::<Vec<_>>()));
                let spare = 2e-4 / perhaps.iter().map(w).fold(1.0, f64::min);
                let x = far(&outline);
                assert!(least - spare <= x && x <= most + spare, "{i} side {k}: {x} is not from {least} to {most}");
            }
            drawn += 1;
        }
        if seen.is_empty() {
            continue;
        }
        let [low, high] = extent(seen.iter().map(|p| image.at(*p)));
        let deepest = scope.deepest(&image, &seen);
        let nearest = casting::nearest(&scope, &geometry, image.depth);
        let [most, least] = [1e-3, -1e-3].map(|margin: f64| {
            let counts = |p: &&DVec3| {
                let at = image.at(**p);
                w(p) > margin.max(1e-6)
                    && (at - low).min(high - at).min_element() * w(p) > margin
                    && deepest - depth(p) > margin
            };
            at.iter().filter(counts).map(depth).fold(f64::INFINITY, f64::min)
        });
        assert!(least - 2e-4 <= nearest && nearest <= most + 2e-4, "{i}: {nearest} is not from {least} to {most}");
    }
    assert!(drawn > 60, "{drawn}");
}

/// From a disc 2 m wide 10 m above, a caster counts as far aside as rays from the disc's near edge to what is seen.
#[test]
fn casters_of_a_wide_lamp_lie_between_it_and_what_is_seen() {
    let nearest = |x: f32| {
        let p = |x: f32, y: f32, z: f32| [Vec3::X, Vec3::Y, Vec3::Z].map(|a| Vec3::new(x, y, z) + a * 1e-4);
        let triangles = [p(x, 5.0, 0.0), p(0.0, 3.0, 0.0), p(-7.0, 0.0, -2.0), p(7.0, 0.0, 2.0)];
        let mut view = camera(Vec3::new(0.0, 0.0, 20.0), Vec3::ZERO);
        view.height = Some(1.0);
        let built = scene(vec![mesh(&triangles, 0)], vec![material(Vec3::ONE)], view, sun(Vec3::Y));
        let geometry = Geometry::new(&built, 0, 0.0).unwrap();
        let mut light = spot(Vec3::Y * 10.0, Vec3::ZERO, 60.0);
        if let Light::Spot { radius, .. } = &mut light {
            *radius = 1.0;
        }
        // 10 m wide, half a metre up and down.
        let bounds = geometry.bounds;
        let scope = Scope { camera: view, light, bounds, aspect: 10.0, resolution: 512, margin: 1.0 };
        casting::nearest(&scope, &geometry, scope.image().depth)
    };
    // The ray from 1 m to the left of the lamp to the highest place seen on the left: at half way 1 + (5 - 1) · 5 / 9.5 aside.
    let limit = 1.0 + 4.0 * 5.0 / 9.5;
    for (x, depth) in [(0.99 * limit, 5.0), (1.01 * limit, 7.0), (-0.99 * limit, 5.0), (-1.01 * limit, 7.0)] {
        assert!((nearest(x) - depth).abs() < 1e-3, "{x}: {}", nearest(x));
    }
}

/// A place in a view's map, texels, and the depth along its axis.
fn place(v: &LightView, p: DVec3) -> (DVec2, f64) {
    let dot = |row: Vec4| row.as_dvec4().dot(p.extend(1.0));
    let (x, y, w) = if v.perspective == LightView::PARABOLOID {
        let q = DVec3::new(dot(v.row_x), dot(v.row_y), dot(v.axis));
        let (w, part) = (q.length() + q.z, v.row_z.as_dvec4());
        ((q.x - part.x * w) * part.z, (q.y - part.y * w) * part.w, w)
    } else {
        (dot(v.row_x), dot(v.row_y), dot(v.row_w))
    };
    (DVec2::new(1.0 + x / w, 1.0 - y / w) * 0.5 * v.resolution as f64, dot(v.axis))
}

/// A random point of a convex body.
fn point_of(r: &mut Random, corners: &[DVec3]) -> DVec3 {
    let weights: Vec<f64> = corners.iter().map(|_| -(r.next().max(1e-9) as f64).ln()).collect();
    let sum: f64 = weights.iter().sum();
    corners.iter().zip(weights).map(|(p, w)| *p * (w / sum)).sum()
}

/// The minimal frustum under spots, rectangles and suns keeps a filter's reach free around all that is seen, not more on any
/// side, and begins before what may cast on it.
#[test]
fn the_minimal_frustum_leaves_a_filters_reach() {
    let mut r = Random(21);
    let (geometry, _) = crumbs(&mut r, 200);
    let hull = geometry.hull();
    let mut of = [0; 3];
    for i in 0..150 {
        let mut scope = among(&mut r, &geometry, i % 3 == 1);
        if i % 3 == 2 {
            let from = r.point() * Vec3::new(6.0, 0.5, 6.0) + Vec3::Y * 5.0;
            scope.light = plate(from, from + r.point() - Vec3::Y, 0.3);
        }
        let reach = if i % 2 == 0 { 0.0 } else { 0.2 };
        let body = scope.seen_of(hull.clone());
        let corners = body.corners();
        let Some(view) = msf::view(&scope, hull, reach) else { continue };
        assert!(!corners.is_empty(), "{i}");
        let axis = view.axis.truncate().as_dvec3().normalize();
        let (u, v) = axis.any_orthonormal_pair();
        // Near a lamp f32 holds places to a share of their distance only.
        let tip: f64 = corners.iter().map(|p| place(&view, *p).1).fold(f64::INFINITY, f64::min);
        let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        for p in &corners {
            for k in 0..64 {
                let (sin, cos) = (k as f64 * std::f64::consts::TAU / 64.0).sin_cos();
                let (at, depth) = place(&view, *p + (u * cos + v * sin) * reach as f64);
                (low, high) = (low.min(at), high.max(at));
                assert!(depth < view.far as f64 * (1.0 + 1e-4) + 1e-4, "{i}: {depth} beyond {}", view.far);
            }
        }
        let spare = 0.05 + 1e-3 / tip.abs().max(1e-3);
        assert!(low.min_element() > 1.0 - spare && high.max_element() < 511.0 + spare, "{i}: {low} to {high}");
        // A square around a disc is touched but for the disc's 64 corners, and but for the turn of its sides.
        assert!(
            low.max_element() < 1.0 + spare + 0.4 * reach as f64 * 510.0 / (1e-9 + tip.abs()).min(4.0f64),
            "{i}: {low}"
        );
        for _ in 0..200 {
            let receiver = point_of(&mut r, &corners);
            let to_light = match scope.light {
                Light::Directional { to_light, .. } => to_light.as_dvec3().normalize() * 30.0,
                _ => scope.light.position().as_dvec3() - receiver,
            };
            let caster = receiver + to_light * (r.next() as f64).powi(2);
            let height = hull.faces().iter().map(|f| {
                let n = (f[1] - f[0]).cross(f[2] - f[0]).normalize();
                n.dot(caster - f[0])
            });
            // In the scene's hull, whose facets run counter-clockwise from outside.
            if height.fold(f64::NEG_INFINITY, f64::max) < -1e-3 {
                let (_, depth) = place(&view, caster);
                let from = view.near as f64;
                assert!(depth > from * 0.999 - 2e-3 || from <= 1.1e-3 * view.far as f64, "{i}: {depth} before {from}");
            }
        }
        of[i % 3] += 1;
    }
    assert!(of.iter().all(|n| *n > 15), "{of:?}");
}

/// Of a wedge that rises to the right only what stands over what is seen moves the minimal frustum's beginning.
#[test]
fn the_minimal_frustum_begins_over_what_is_seen() {
    let corner = |x: f64, y: f64| [-5.0, 5.0].map(|z| DVec3::new(x, y, z));
    let wedge = convex_hull([corner(0.0, 0.0), corner(10.0, 0.0), corner(10.0, 10.0)].into_iter().flatten());
    // Straight down from half a metre, as wide: what is seen lies from 2 to 3 m, above which the wedge is 3 m high at most.
    let view = Camera::new(Vec3::new(2.5, 0.5, 0.0), Vec3::new(2.5, 0.0, -1e-3), 90.0, 0.01, 100.0);
    let bounds = [Vec3::new(0.0, 0.0, -5.0), Vec3::new(10.0, 10.0, 5.0)];
    let scope = Scope { camera: view, light: sun(Vec3::Y), bounds, aspect: 1.0, resolution: 512, margin: 1.0 };
    let view = msf::view(&scope, &wedge, 0.0).unwrap();
    let (_, first) = place(&view, DVec3::new(3.0, 3.0, 0.0));
    assert!((view.near as f64 - first).abs() < 0.01, "{} {first}", view.near);
    assert!((view.far - view.near - 3.0).abs() < 0.02, "{} to {}", view.near, view.far);
}

/// Under any sun the perspective's middle line goes through the eye, along the gaze; w is 1 at the near face; its strength and
/// its fading multiply n.
#[test]
fn the_perspective_follows_the_gaze() {
    let mut r = Random(8);
    let (geometry, _) = crumbs(&mut r, 50);
    let mut bent = 0;
    for i in 0..200 {
        let s = among(&mut r, &geometry, false);
        let (image, eye, body) = (s.image(), s.eye(), s.seen());
        if body.is_empty() {
            continue;
        }
        let of = |strength: f64, fade: f64| lispsm::fit(&s, &image, &body, Strength { strength, fade });
        let l = of(1.0, 1.0);
        let along = |p: &DVec3| image.at(*p).dot(l.direction);
        let [near, far] =
            [body.iter().map(along).fold(f64::MAX, f64::min), body.iter().map(along).fold(f64::MIN, f64::max)];
        assert!((l.near - near).abs() < 1e-9 && (l.far - far).abs() < 1e-9, "{i}");
        // Light travels against the direction to it.
        let cosine = -eye.forward.dot(s.light.position().as_dvec3().normalize());
        assert!((l.gamma.cos() - cosine).abs() < 1e-6, "{i}: {} {cosine}", l.gamma);
        let gaze = image.at(eye.position + eye.forward) - image.at(eye.position);
        assert!(l.direction.dot(gaze.normalize()) > 1.0 - 1e-9, "{i}");
        for p in &body {
            let (at, w) = warped(&l.warp, image.at(*p));
            assert!((w - (1.0 + (along(p) - near) / l.n)).abs() < 1e-6 * w.abs(), "{i}: w = {w}");
            assert!((at.y * w - (along(p) - near)).abs() < 1e-6, "{i}: {at}");
        }
        // A line of the image before and behind the eye is the map's middle one.
        for t in [-3.0, 0.0, 5.0] {
            let (at, w) = warped(&l.warp, image.at(eye.position) + l.direction * t);
            assert!((at.x * w).abs() < 1e-6, "{i}: {at} at {t}");
        }
        // To the right of the gaze, to the right in the map, as far in its image.
        let aside = DVec2::new(l.direction.y, -l.direction.x);
        let (at, w) = warped(&l.warp, image.at(eye.position) + aside * 2.0);
        assert!((at.x * w - 2.0).abs() < 1e-6, "{i}: {at}");
        if l.n.is_finite() && l.n > 1.01 * eye.near {
            // n_opt where the line through the nearest point meets the body's two ends.
            let z0 = body.iter().map(|p| eye.depth(*p)).fold(f64::MAX, f64::min);
            let z1 = z0 + (far - near) * gaze.length();
            let exact = (far - near) / ((z1 / z0).sqrt() - 1.0);
            assert!((l.n / exact - 1.0).abs() < 1e-6, "{i}: {} {exact}", l.n);
            assert!((of(0.5, 1.0).n / l.n - 2.0).abs() < 1e-9, "{i}");
            // From no fading at the limit, in a straight line.
            let limit = |share: f64| (cosine.abs() - share) / (1.0 - share);
            if (0.05..0.99).contains(&cosine.abs()) {
                assert_eq!(of(1.0, cosine.abs() + 1e-9).n, l.n, "{i}");
                let faded = limit(0.8 * cosine.abs());
                assert!((of(1.0, 0.8 * cosine.abs()).n / l.n - 1.0 - 20.0 * faded).abs() < 1e-6, "{i}");
                // Under the logarithm what is left of ln(f/n) goes to nothing in the same way.
                let ln = |l: &lispsm::Lispsm| ((l.far - l.near) / l.n).ln_1p();
                let (whole, part) =
                    (logpsm::fit(&s, &image, &body, 0.5, 1.0), logpsm::fit(&s, &image, &body, 0.5, 0.8 * cosine.abs()));
                assert!((ln(&whole) / ln(&l) - 1.0).abs() < 1e-6, "{i}: half of it is n_opt's");
                assert!((ln(&part) / ln(&whole) - (1.0 - faded)).abs() < 1e-6, "{i}");
                for (fit, name) in [(&whole, "whole"), (&part, "part")] {
                    let w = warped(&fit.warp, image.at(body[0])).1;
                    assert!((w - 1.0 - (along(&body[0]) - near) / fit.n).abs() < 1e-6 * w, "{i} {name}");
                }
                bent += 1;
            }
        }
    }
    assert!(bent > 40, "{bent}");
    // The perspective is never stronger than that whose centre is the eye, nor at once nearer than the body is long.
    let s = Scope {
        camera: camera(Vec3::new(0.0, 3.0, 9.0), Vec3::new(0.0, 3.0, 0.0)),
        light: sun(Vec3::Y),
        ..among(&mut r, &geometry, false)
    };
    let fit = lispsm::fit(&s, &s.image(), &s.seen(), Strength { strength: 1e6, fade: 1.0 });
    assert!((fit.n - s.eye().near).abs() < 1e-9, "{}", fit.n);
    // A hair off the light's own direction there is none to warp along.
    let down = camera(Vec3::Y * 5.0, Vec3::X * 1e-4);
    let s = Scope { camera: down, ..s };
    let fit = lispsm::fit(&s, &s.image(), &s.seen(), Strength { strength: 1.0, fade: 1.0 });
    assert!(s.image().along(s.eye().forward).length() > 1e-5 && fit.n == f64::INFINITY, "{}", fit.n);
    // Closed forms of the logarithm's n: 1 gives d / (z₁/z₀ - 1), a half n_opt, and f/n has an end.
    let optimal: f64 = lispsm::optimal(30.0, 2.0, 32.0);
    assert!((optimal - 10.0).abs() < 1e-12);
    assert!((logpsm::parameter(30.0, optimal, 1.0) - 2.0).abs() < 1e-12);
    assert!((logpsm::parameter(30.0, optimal, 0.5) - optimal).abs() < 1e-12);
    assert!((30.0 / logpsm::parameter(30.0, 1e-9, 1.0) + 1.0 - logpsm::DEEPEST).abs() < 1e-4);
    assert_eq!([(30.0, f64::INFINITY), (0.0, 5.0)].map(|(d, n)| logpsm::parameter(d, n, 1.0)), [f64::INFINITY; 2]);
    assert_eq!([lispsm::optimal(3.0, 0.0, 2.0), lispsm::optimal(3.0, 2.0, 2.0)], [f64::INFINITY; 2]);
}

/// Under a spot the middle line halves the body's image.
#[test]
fn a_spots_middle_line_halves_the_body() {
    let mut r = Random(14);
    let (geometry, _) = crumbs(&mut r, 50);
    let mut found = 0;
    for i in 0..60 {
        let s = among(&mut r, &geometry, true);
        let (image, body) = (s.image(), s.seen());
        if body.is_empty() {
            continue;
        }
        let l = lispsm::fit(&s, &image, &body, Strength { strength: 1.0, fade: 1.0 });
        let [low, high] = extent(body.iter().map(|p| {
            let (at, w) = warped(&l.warp, image.at(*p));
            at * w
        }));
        assert!((low.x + high.x).abs() < 1e-6 * (high.x - low.x).max(1.0), "{i}: {low} {high}");
        found += 1;
    }
    assert!(found > 20, "{found}");
}

/// Faces narrowed to what the camera sees are the box around it, guard band and depth included.
#[test]
fn narrowed_faces_are_the_box_of_what_is_seen() {
    let mut r = Random(17);
    let (geometry, _) = crumbs(&mut r, 200);
    let hull = geometry.hull();
    let (mut flat, mut round, mut left) = (0, 0, 0);
    for i in 0..90 {
        let mut scope = among(&mut r, &geometry, false);
        let at = r.point() * Vec3::new(12.0, 3.0, 12.0) + Vec3::Y * 3.0;
        scope.light = lamp(at);
        let guard = [0.0, 6.0][i % 2];
        let around = Around { light: at.as_dvec3(), near: 0.05, far: 60.0, side: 256.0, guard, metres: 0.0 };
        let frame = DMat3::from_rotation_y(0.7) * DMat3::from_rotation_x(0.4);
        let back = DMat3::from_cols(-frame.x_axis, frame.y_axis, -frame.z_axis);
        let cut = [DMat3::IDENTITY, DMat3::from_rotation_y(0.6) * DMat3::from_rotation_x(-0.2)][i / 3 % 2];
        let faces: Vec<Face> = match i % 3 {
            0 => around.cube(),
            1 => around.octahedron(),
            _ => [(frame, 0), (back, 1)].map(|(f, layer)| around.paraboloid(f, cut, layer)).into(),
        };
        let seen = scope.seen_of(hull.clone());
        let narrowed = part::narrowed(&scope, &around, hull, faces.clone());
        assert_eq!(narrowed.len(), faces.len());
        for (face, whole) in narrowed.iter().zip(&faces) {
            // What is seen of it: nearer to its axis than to any other face's.
            let mut own = seen.clone();
            for other in faces.iter().filter(|f| f.axis != whole.axis) {
                let n = whole.axis - other.axis;
                own.clip(n.extend(-n.dot(around.light)), 1e-9);
            }
            let edges = own.faces().iter().flat_map(|f| (0..f.len()).map(|k| [f[k], f[(k + 1) % f.len()]]));
            let along = |[a, b]: [DVec3; 2]| (0..=200).map(move |t| a.lerp(b, t as f64 / 200.0));
            let points: Vec<DVec3> = edges.flat_map(along).collect();
            let nearest = points.iter().map(|p| p.distance(around.light)).fold(f64::INFINITY, f64::min);
            let paraboloid = whole.view.perspective == LightView::PARABOLOID;
            let depth = |p: &DVec3| {
                let way = *p - around.light;
                if paraboloid { way.length() } else { whole.view.axis.truncate().as_dvec3().dot(way) }
            };
            let deepest = points.iter().map(depth).fold(0.0, f64::max);
            if points.is_empty() {
                assert!(face.view.row_x == whole.view.row_x && face.view.far == whole.view.far, "{i}");
                left += 1;
            }
            if nearest < 0.2 || points.is_empty() {
                continue;
            }
            let [low, high] = extent(points.iter().map(|p| place(&face.view, *p).0));
            let free = [low.min_element(), around.side - high.max_element()];
            assert!(free.iter().all(|free| *free > guard - 0.02), "{i}: {low} to {high}");
            let most = [low.max_element(), around.side - high.min_element()];
            // Arcs are touched but for the steps along them, and the paraboloid's rim is a circle.
            let (step, ends) = if paraboloid { (1.0, 0.01) } else { (0.05, 1e-3) };
            // A hundred-thousandth of the whole face is left free for rounding.
            let [l, h] = extent(points.iter().map(|p| place(&whole.view, *p).0));
            let step = step + around.side * 2e-5 * around.side / (h - l).min_element();
            assert!(most.iter().all(|free| *free < guard + step), "{i}: {low} to {high}");
            let far = face.view.far as f64;
            assert!(deepest <= far && far < deepest * (1.0 + ends) + 1e-3, "{i}: {deepest}, {far}");
            if !paraboloid {
                // Depth from 1 at the near plane to 0 at the far one, linear in between.
                let (v, dot) = (&face.view, |row: Vec4, p: &DVec3| row.as_dvec4().dot(p.extend(1.0)));
                let p = &points[0];
                let linear = (far - depth(p)) / (far - v.near as f64);
                assert!((dot(v.row_z, p) - linear).abs() < 1e-4, "{i}: {} {linear}", dot(v.row_z, p));
            }
            *if paraboloid { &mut round } else { &mut flat } += 1;
        }
    }
    assert!(flat > 60 && round > 15 && left > 60, "{flat} {round} {left}");
    // Nearer than where maps begin: there they still have a depth.
    let scope = Scope { light: lamp(Vec3::Y * 3.0), ..among(&mut r, &geometry, false) };
    let around = Around { light: Vec3::Y.as_dvec3() * 3.0, near: 50.0, far: 60.0, side: 64.0, guard: 0.0, metres: 0.0 };
    let narrowed = part::narrowed(&scope, &around, hull, around.cube());
    let far: Vec<f32> = narrowed.iter().map(|f| f.view.far).collect();
    assert!(far.iter().all(|far| *far > 50.0), "{far:?}");
}
