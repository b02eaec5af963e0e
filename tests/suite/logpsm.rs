//! The logarithmic perspective shadow map against closed forms and the truth.

use crate::common::*;
use glam::{DVec2, DVec3, Vec2, Vec3};
use shadowscope::frame::{Ask, Renderer};
use shadowscope::map::fit::{Scope, hull, lispsm, logpsm, sides, warped};
use shadowscope::measure::metrics::FACING;
use shadowscope::scene::Camera;
use shadowscope::setup::Setup;

/// A level view between two depths under a sun straight above, whose body is that part of the frustum.
fn level(near: f32, far: f32) -> Scope {
    let view = Camera::new(Vec3::new(0.0, 1.0, 0.0), Vec3::new(0.0, 1.0, -1.0), 60.0, near, far);
    let bounds = [Vec3::new(-1.0, -1.0, -1.0) * 4.0 * far, Vec3::new(1.0, 1.0, 1.0) * 4.0 * far];
    Scope { camera: view, light: sun(Vec3::Y), bounds, aspect: 1.0, resolution: 512, margin: 1.0 }
}

/// Texels that a map needs along and across the view so that m is 1 at most, per pixel of the picture, and the largest and
/// smallest share of them that a depth needs along the view.
fn needed(s: &Scope, n: f64, logarithm: bool) -> (DVec2, [f64; 2]) {
    let (image, body) = (s.image(), s.seen());
    let l = lispsm::fit(s, &image, &body, lispsm::Strength { strength: 1.0, fade: 0.9 });
    let h = lispsm::warp(l.direction, l.middle, l.near, n);
    let eye = s.eye();
    let across = image.along(eye.right);
    let place = |z: f64, x: f64| {
        let (p, w) = warped(&h, image.at(eye.position + eye.forward * z) + across * x);
        DVec2::new(p.x, if logarithm { w.ln() } else { p.y })
    };
    let (near, far) = (eye.near, eye.far);
    let whole = place(far, 0.0).y - place(near, 0.0).y;
    // As wide as the widest face of the body's image.
    let wide = [near, far].map(|z| 2.0 * place(z, z * eye.tangent.x).x.abs()).into_iter().fold(0.0, f64::max);
    let (mut most, mut least) = (DVec2::ZERO, f64::MAX);
    for i in 0..=2000 {
        let z = near * (far / near).powf(i as f64 / 2000.0);
        // A pixel's share of the picture's side is 2 z tan(fov/2).
        let (pixel, e) = (2.0 * z * eye.tangent.y, 1e-6 * z);
        let along = whole / ((place(z + e, 0.0).y - place(z - e, 0.0).y) / (2.0 * e) * pixel);
        let beside = wide / ((place(z, e).x - place(z, -e).x).abs() / (2.0 * e) * pixel);
        most = most.max(DVec2::new(along, beside));
        least = least.min(along);
    }
    (most, [least, most.x])
}

/// Under a sun at right angles the full perspective with a logarithm has the same m all along the view; and the texels
/// needed for m = 1 grow as ln(f/n), those of a perspective as f/n, of a plain map as (f/n)².
#[test]
fn texels_needed_grow_as_the_logarithm() {
    let mut last: Option<[f64; 3]> = None;
    for far in [10.0, 100.0, 1000.0] {
        let s = level(1.0, far);
        let (image, body) = (s.image(), s.seen());
        let full = logpsm::fit(&s, &image, &body, 1.0, 0.9).n;
        assert!((full - 1.0).abs() < 1e-3, "n_w = {full} is not the near plane's distance");
        let half = logpsm::fit(&s, &image, &body, 0.5, 0.9).n;
        let optimal = lispsm::fit(&s, &image, &body, lispsm::Strength { strength: 1.0, fade: 0.9 }).n;
        assert!((half / optimal - 1.0).abs() < 1e-9, "{half}, n_opt = {optimal}");
        assert_eq!(logpsm::fit(&s, &image, &body, 0.0, 0.9).n, f64::INFINITY);

        let (most, [low, high]) = needed(&s, full, true);
        assert!(high / low < 1.0 + 1e-3, "m goes from {low} to {high}");
        let texels = [most.x * most.y, needed(&s, full, false).0.element_product(), {
            let plain = needed(&s, 1e12, false).0;
            plain.x * plain.y
        }];
        let ratio = far as f64;
        let law = [ratio.ln(), ratio - 1.0, (ratio - 1.0) * ratio];
        if let Some(last) = last {
            for ((now, then), (name, grows)) in texels.iter().zip(last).zip([
                ("logarithm", law[0] / (ratio / 10.0).ln()),
                ("perspective", law[1] / (ratio / 10.0 - 1.0)),
                ("plain", law[2] / ((ratio / 10.0 - 1.0) * ratio / 10.0)),
            ]) {
                assert!((now / then / grows - 1.0).abs() < 0.01, "{name}: {} times, not {grows}", now / then);
            }
        }
        // Any weaker perspective is worse under the logarithm.
        for strength in [0.25, 0.5, 0.75] {
            let n = logpsm::fit(&s, &image, &body, strength, 0.9).n;
            assert!(needed(&s, n, true).0.element_product() > texels[0], "strength {strength}");
        }
        last = Some(texels);
    }
}

/// Where gaze and light are parallel the warp is gone, and on the way there it fades steadily.
#[test]
fn the_warp_fades_steadily() {
    let s = level(1.0, 50.0);
    let strength = |degrees: f32| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let s = Scope { light: sun(Vec3::new(0.0, sin, cos)), ..s };
        let body = s.seen();
        let l = logpsm::fit(&s, &s.image(), &body, 1.0, 0.9);
        assert!(body.iter().all(|p| warped(&l.warp, s.image().at(*p)).1 > 0.0), "{degrees}°: a corner has no place");
        ((l.far - l.near) / l.n).ln_1p()
    };
    assert!(strength(90.0) > 3.0 && strength(0.0) == 0.0);
    let mut last = strength(0.0);
    for i in 1..=900 {
        let now = strength(i as f32 * 0.1);
        assert!((now - last).abs() < 0.06, "at {}° ln(f/n) goes from {last} to {now}", i as f32 * 0.1);
        last = now;
    }
}

/// The warp as the shader says it, in 32 bits: it rises strictly, keeps the ends, and its inverse is one to a thousandth
/// of a texel; and it is what it is in 64 bits.
#[test]
fn the_logarithm_is_exact() {
    let ln_1p = |x: f32| {
        if x > 1.0 {
            return (1.0 + x).ln();
        }
        let z = x / (2.0 + x);
        let q = z * z;
        2.0 * z * (1.0 + q * (1.0 / 3.0 + q * (1.0 / 5.0 + q * (1.0 / 7.0 + q * (1.0 / 9.0 + q * (1.0 / 11.0))))))
    };
    let exp_m1 = |x: f32| {
        if x.abs() > 0.5 {
            return x.exp() - 1.0;
        }
        let last = x / 6.0 * (1.0 + x / 7.0);
        x * (1.0 + x / 2.0 * (1.0 + x / 3.0 * (1.0 + x / 4.0 * (1.0 + x / 5.0 * (1.0 + last)))))
    };
    for ratio in [1.00001, 1.1, 2.0, 30.0, 1e3, 1e5] {
        let k = (ratio - 1.0) as f32;
        let ln = ln_1p(k);
        let warp = |y: f32| (ln_1p(k * y) / ln).min(1.0);
        let unwarp = |t: f32| exp_m1(t * ln) / k;
        assert_eq!((warp(0.0), warp(1.0)), (0.0, 1.0));
        let mut last = -1.0;
        for i in 0..=4096 {
            let t = i as f64 / 4096.0;
            let y = (t * (k as f64).ln_1p()).exp_m1() / k as f64;
            let at = warp(y as f32);
            assert!(at > last, "f/n = {ratio}: {at} follows {last}");
            last = at;
            let texels = 1024.0;
            assert!((at as f64 - t).abs() * texels < 1e-3, "f/n = {ratio}: {at}, not {t}");
            assert!((warp(unwarp(t as f32)) as f64 - t).abs() * texels < 1e-3, "f/n = {ratio}: inverse at {t}");
        }
    }
}

/// View samples counted in the map's texels, and pixels that face the light.
fn counted(r: &mut Renderer, s: &Setup) -> [u64; 2] {
    r.render(s, Ask { analysis: true, ..ask(s) }).unwrap();
    let mut all = 0;
    r.analysis().counts(&r.gpu, |_, part| all += part.iter().map(|c| *c as u64).sum::<u64>()).unwrap();
    [all, r.read_mask().unwrap().iter().filter(|m| **m == FACING).count() as u64]
}

/// Every pixel that faces the sun has a texel; the map errs less than a plain one of the whole scene, and its typical m
/// is no longer than light space perspective's.
#[test]
fn it_holds_all_receivers_and_pays() {
    for name in ["bench", "arches"] {
        let (mut r, mut s) = built_in(name, [160, 160]);
        let whole = errors(&mut r, &mut s, "shadow-map", &["resolution=256", "fit=scene"]).share();
        for raster in ["raster=subdivide", "raster=exact"] {
            let e = errors(&mut r, &mut s, "logpsm", &["resolution=256", raster]);
            assert!(e.share() < 0.8 * whole, "{name} {raster}: {} against {whole}", e.share());
            let [all, facing] = counted(&mut r, &s);
            assert_eq!(all, facing, "{name} {raster}");
        }
    }
}

/// The largest m on a floor under a sun in the zenith, along a level view.
#[test]
fn m_is_even_along_the_view() {
    let ground = floor(Vec2::splat(-60.0), Vec2::splat(60.0), 0.0);
    let mut view = camera(Vec3::new(0.0, 1.5, 55.0), Vec3::new(0.0, 1.5, 0.0));
    view.near = 2.0;
    let (mut r, mut s) = start(scene(vec![mesh(&ground, 0)], vec![material(Vec3::ONE)], view, sun(Vec3::Y)), [96, 256]);
    let mut spread = |technique: &str, sets: &[&str]| {
        select(&mut s, technique, sets);
        r.render(&s, Ask { analysis: true, ..ask(&s) }).unwrap();
        let m = r.analysis().aliasing(&r.gpu).unwrap().unwrap();
        // The perspective part, of the middle column.
        let column: Vec<f64> = m.iter().skip(48).step_by(96).filter(|m| m[0] > 0.0).map(|m| m[1] as f64).collect();
        assert!(column.len() > 80, "{}", column.len());
        let [low, high] = column.iter().fold([f64::MAX, 0f64], |[a, b], m| [a.min(*m), b.max(*m)]);
        (high, high / low)
    };
    let (worst, even) = spread("logpsm", &["resolution=512"]);
    let (others, uneven) = spread("lispsm", &["resolution=512"]);
    assert!(even < 1.02, "m differs {even} times");
    assert!(uneven > 2.0 && others > 1.3 * worst, "lispsm: {others}, {uneven} times; logpsm: {worst}");
    let (plain, _) = spread("logpsm", &["resolution=512", "strength=0"]);
    let (again, _) = spread("shadow-map", &["resolution=512"]);
    assert!((plain / again - 1.0).abs() < 0.05, "without strength {plain}, a plain map {again}");
}

/// Edges that stay straight miss their places; drawn exactly they do not.
#[test]
fn large_triangles_need_more_than_corners() {
    let (mut r, mut s) = built_in("st-longtri", [128, 128]);
    let mut share = |raster: &str| errors(&mut r, &mut s, "logpsm", &["resolution=256", raster]).share();
    let [linear, subdivide, exact] = ["raster=linear", "raster=subdivide", "raster=exact"].map(&mut share);
    assert!(linear > 3.0 * exact, "linear {linear}, exact {exact}");
    assert!(
        linear > 2.0 * subdivide && subdivide < 1.5 * exact + 0.005,
        "linear {linear}, subdivide {subdivide}, exact {exact}"
    );
}

/// Split sides part all that the camera sees among their maps: each point belongs to one, whose part of the light's image holds it, and
/// whose map has a place for it before which nothing lies. Together the parts are as large as the whole.
#[test]
fn sides_cover_what_is_seen_once() {
    let mut r = Random(23);
    let (mut numbers, mut points) = ([0; 7], 0);
    for i in 0..240 {
        let at = Vec3::new(10.0, 3.0, 10.0) * r.point() + Vec3::Y * 3.5;
        let view = camera(at, at + r.point());
        let way = match i % 4 {
            // Along the gaze, against it, and anyhow.
            0 => (view.position - view.target).normalize() + 0.2 * r.point(),
            1 => (view.target - view.position).normalize() + 0.2 * r.point(),
            _ => r.point(),
        };
        let light = match i % 3 {
            0 => spot(at + 6.0 * r.point(), at + view.forward() * 8.0 + r.point(), 55.0),
            _ => sun(way),
        };
        let bounds = [Vec3::new(-20.0, 0.0, -20.0), Vec3::new(20.0, 5.0, 20.0)];
        let s = Scope { camera: view, light, bounds, aspect: 1.5, resolution: 512, margin: 0.0 };
        let (body, image) = (s.seen(), s.image());
        if body.is_empty() {
            continue;
        }
        let sides = sides::fit(&s, &image, &body);
        assert!((1..=6).contains(&sides.len()), "{i}: {} sides", sides.len());
        numbers[sides.len()] += 1;
        let whole = hull::hull(&body.iter().map(|p| image.at(*p)).collect::<Vec<_>>());
        let area = |points: &[DVec2]| {
            (0..points.len()).map(|k| points[k].perp_dot(points[(k + 1) % points.len()])).sum::<f64>().abs() / 2.0
        };
        let parts = sides.iter().map(|side| side.area()).sum::<f64>();
        assert!((parts / area(&whole) - 1.0).abs() < 1e-6, "{i}: {parts} of {}", area(&whole));
        for _ in 0..40 {
            let weights: Vec<f64> = body.iter().map(|_| f64::from(r.next()).powi(4) + 1e-4).collect();
            let x = body.iter().zip(&weights).map(|(p, w)| *p * *w).sum::<DVec3>() / weights.iter().sum::<f64>();
            let value = |side: &sides::Side| side.row.dot(x.extend(1.0));
            let own = sides.iter().max_by(|a, b| value(a).total_cmp(&value(b))).unwrap();
            // Not on a border between two, where rounding decides.
            let close = |side: &&sides::Side| (value(own) - value(side)).abs() < 1e-9 * value(own).abs().max(1.0);
            if sides.iter().filter(close).count() > 1 {
                continue;
            }
            let [low, high] = hull::extent(own.points.iter().map(|p| warped(&own.warp, *p).0));
            let (place, w) = warped(&own.warp, image.at(x));
            let spare = 1e-6 * (high - low);
            assert!(w > 0.999_99, "{i}: w = {w}");
            assert!(
                (low - spare).cmple(place).all() && (high + spare).cmpge(place).all(),
                "{i}: {place} off {low}, {high}"
            );
            points += 1;
        }
    }
    println!("{numbers:?} views of 0 to 6 sides, {points} points");
    assert!(points > 5000 && numbers[1] + numbers[2] > 10 && numbers[4] + numbers[5] > 10, "{numbers:?}");
}

/// Along a side's own face w is proportional to the eye's depth, so that the logarithm makes texels grow as pixels do.
#[test]
fn sides_are_warped_along_their_faces() {
    for to_light in [Vec3::new(0.1, 0.3, 1.0), Vec3::new(0.1, 0.3, -1.0), Vec3::Y] {
        let s = Scope { light: sun(to_light), ..level(1.0, 50.0) };
        let (image, body, eye) = (s.image(), s.seen(), s.eye());
        let sides = sides::fit(&s, &image, &body);
        let mut slanted = 0;
        for side in sides.iter().filter(|side| side.face > 1) {
            let plane = eye.planes()[side.face].truncate();
            assert!(
                plane.dot(side.along).abs() < 1e-12 && (side.along.dot(eye.forward) - 1.0).abs() < 1e-12,
                "{side:?}"
            );
            let w = |z: f64| warped(&side.warp, image.at(eye.position + side.along * z)).1;
            for z in [1.0, 7.0, 50.0] {
                assert!((w(z) / w(1.0) / z - 1.0).abs() < 1e-9, "{to_light}, face {}: {}", side.face, w(z) / w(1.0));
            }
            slanted += 1;
        }
        assert!(slanted > 0, "{to_light}");
    }
}

/// Where gaze and light are nearly parallel one warp fades to nothing, and sides do not: with no more texels these are smaller in
/// the picture, and errors fewer. Beside the camera a spot has texels that are small enough without.
#[test]
fn sides_pay_where_one_warp_fades() {
    let view = camera(Vec3::new(0.0, 1.6, 18.0), Vec3::new(0.0, 0.8, -10.0));
    let ground = floor(Vec2::splat(-60.0), Vec2::splat(60.0), 0.0);
    let mut triangles = ground;
    // Posts along the way.
    for i in 0..24 {
        let (x, z) = ([-2.0, 2.2, 0.4][i % 3], 15.0 - 2.5 * i as f32);
        for side in floor(Vec2::new(x - 0.1, z - 0.1), Vec2::new(x + 0.1, z + 0.1), 1.2) {
            triangles.push(side);
        }
        let p = |dx: f32, y: f32| Vec3::new(x + dx, y, z);
        triangles.extend([[p(-0.1, 0.0), p(0.1, 0.0), p(0.1, 1.2)], [p(-0.1, 0.0), p(0.1, 1.2), p(-0.1, 1.2)]]);
    }
    let (mut r, mut s) =
        start(scene(vec![mesh(&triangles, 0)], vec![material(Vec3::ONE)], view, sun(Vec3::Y)), [160, 120]);
    for (light, gains) in [
        (sun(Vec3::new(0.06, 0.2, 1.0)), true),
        (sun(Vec3::new(0.06, 0.2, -1.0)), true),
        (spot(Vec3::new(0.5, 6.0, 24.0), Vec3::new(0.0, 0.0, -10.0), 40.0), true),
        (sun(Vec3::new(1.0, 0.8, 0.0)), false),
    ] {
        s.light = light;
        let mut of = |sides: &str| {
            let e = errors(&mut r, &mut s, "logpsm", &["resolution=256", sides, "slope_limit=57"]).share();
            r.render(&s, Ask { analysis: true, ..ask(&s) }).unwrap();
            let m = r.analysis().aliasing(&r.gpu).unwrap().unwrap();
            let mut m: Vec<f32> = m.iter().map(|m| m[0]).filter(|m| *m > 0.0).collect();
            m.sort_by(f32::total_cmp);
            let [all, facing] = counted(&mut r, &s);
            // On the edge of a spot's cone rounding decides.
            assert!(all.abs_diff(facing) * 1000 <= facing, "{light:?} {sides}: {all} of {facing}");
            (e, m[m.len() / 2], m[m.len() * 19 / 20])
        };
        let [one, split] = ["sides=1", "sides=faces"].map(&mut of);
        println!("{light:?}: {one:?} and {split:?}");
        if gains {
            assert!(split.1 < 0.7 * one.1, "{light:?}: {one:?} and {split:?}");
            assert!(split.0 < 0.5 * one.0 || one.0 < 0.005, "{light:?}: {one:?} and {split:?}");
        } else {
            assert!(split.1 < 1.5 * one.1, "{light:?}: {one:?} and {split:?}");
        }
    }
}

/// Sides hold no more texels than a single map.
#[test]
fn sides_share_the_texels_of_one_map() {
    let (mut r, mut s) = built_in("bench", [80, 60]);
    for light in [s.light, sun(s.camera.position - s.camera.target)] {
        s.light = light;
        select(&mut s, "logpsm", &["resolution=256", "sides=faces"]);
        r.render(&s, Ask { analysis: true, ..ask(&s) }).unwrap();
        let sizes = r.analysis().maps().unwrap();
        let texels = sizes.layers * sizes.size[0] * sizes.size[1];
        assert!(sizes.layers > 1 && texels <= 256 * 256 && texels > 250 * 250, "{sizes:?}");
    }
}
