//! A texel for every pixel of a plane: against closed forms, the truth, and what it must refuse.

use crate::common::*;
use glam::{DVec3, Vec2, Vec3};
use shadowscope::frame::{Ask, Renderer};
use shadowscope::light::Light;
use shadowscope::map::fit::lixel::{self, Plane};
use shadowscope::map::fit::{Scope, warped};
use shadowscope::measure::metrics::FACING;
use shadowscope::params::Values;
use shadowscope::scene::geometry::Geometry;
use shadowscope::setup::Setup;
use shadowscope::techniques::lixel_per_pixel::{give, given};
use std::collections::BTreeMap;

const ID: &str = "lixel-per-pixel";
const GROUND: Plane = Plane { normal: DVec3::Y, distance: 0.0 };

/// The longest extent of a texel at each pixel that faces the light and lies on the ground, pixels.
fn on_the_ground(r: &mut Renderer, s: &Setup) -> Vec<f32> {
    r.render(s, Ask { analysis: true, ..ask(s) }).unwrap();
    let m = r.analysis().aliasing(&r.gpu).unwrap().unwrap();
    let (mask, at) = (r.read_mask().unwrap(), r.read_position().unwrap());
    (0..m.len()).filter(|i| mask[*i] == FACING && at[*i][1].abs() < 1e-3 && m[*i][0] > 0.0).map(|i| m[i][0]).collect()
}

/// A point's place through the warp is where the camera sees the point at which its ray of light meets the plane.
#[test]
fn the_warp_sees_the_plane_as_the_camera_does() {
    let mut r = Random(11);
    let mut seen = 0;
    for i in 0..300 {
        let at = Vec3::new(10.0, 3.0, 10.0) * r.point() + Vec3::Y * 3.5;
        let up = r.point();
        let light = match i % 2 {
            0 => sun(Vec3::new(up.x, up.y.abs() + 0.1, up.z)),
            _ => spot(Vec3::new(8.0 * up.x, 6.0 + up.y, 8.0 * up.z), r.point() * 5.0, 60.0),
        };
        let bounds = [Vec3::new(-20.0, 0.0, -20.0), Vec3::new(20.0, 5.0, 20.0)];
        let s = Scope { camera: camera(at, at + r.point()), light, bounds, aspect: 1.5, resolution: 512, margin: 1.0 };
        let tilted = Plane { normal: (DVec3::Y + 0.2 * r.point().as_dvec3()).normalize(), distance: 0.3 };
        let plane = [GROUND, tilted][i / 2 % 2];
        let image = s.image();
        let Ok(fit) = lixel::fit(&s, &image, &plane) else { continue };
        let eye = s.eye();
        for p in fit.seen.iter() {
            let (at, w) = warped(&fit.warp, *p);
            assert!(at.abs().max_element() < 1.0 + 1e-6 && w > 0.999_999, "{i}: {at}, w = {w}");
        }
        // Between the light and a point of the plane that is seen.
        for _ in 0..20 {
            let weights: Vec<f64> = fit.seen.iter().map(|_| f64::from(r.next()) + 1e-3).collect();
            let sum: f64 = weights.iter().sum();
            let place = fit.seen.iter().zip(&weights).map(|(p, w)| *p * *w).sum::<glam::DVec2>() / sum;
            // Its ray, by brute force: a point at a depth, and the way that light travels from there.
            let lamp = matches!(s.light, Light::Spot { .. });
            let [right, up, axis] = [image.rows[0], image.rows[1], image.depth].map(|r| r.truncate());
            let way = if lamp { right * place.x + up * place.y + axis } else { axis };
            let start = if lamp { s.light.position().as_dvec3() } else { right * place.x + up * place.y };
            let q = start + way * (-plane.height(start) / plane.normal.dot(way));
            let from = if lamp { start } else { q - axis * 30.0 };
            let x = from + (q - from) * (0.1 + 0.85 * f64::from(r.next()));
            let ndc = DVec3::new(
                eye.right.dot(q - eye.position) / eye.tangent.x,
                eye.up.dot(q - eye.position) / eye.tangent.y,
                0.0,
            ) / eye.depth(q);
            let (at, w) = warped(&fit.warp, image.at(x));
            assert!(at.distance(ndc.truncate()) < 1e-6 && w > 0.0, "{i}: {at} against {ndc}");
        }
        seen += 1;
    }
    assert!(seen > 60, "only {seen}");
}

/// A picture lies in the middle of its map, pixels on texels where they fit, evenly smaller where they do not.
#[test]
fn a_picture_is_laid_in_its_map() {
    let fits = lixel::grid([160, 120], 512, 0.0);
    assert_eq!(fits.pixels, 1.0);
    let texel = |g: &lixel::Grid, side: f64, x: f64, y: f64| {
        let p = g.placed * DVec3::new(2.0 * x - 1.0, 1.0 - 2.0 * y, 1.0);
        [0.5 + 0.5 * p.x, 0.5 - 0.5 * p.y].map(|x| x * side)
    };
    assert_eq!((texel(&fits, 512.0, 0.0, 0.0), texel(&fits, 512.0, 1.0, 1.0)), ([176.0, 196.0], [336.0, 316.0]));
    let large = lixel::grid([400, 300], 128, 14.0);
    assert_eq!(large.pixels, 4.0);
    assert_eq!((texel(&large, 128.0, 0.0, 0.0), texel(&large, 128.0, 1.0, 1.0)), ([14.0, 26.0], [114.0, 101.0]));
}

/// On the plane a texel is a pixel, under sun and spot, with the horizon in view or not; a map that is too small has them
/// evenly larger and says so.
#[test]
fn on_the_plane_m_is_one() {
    let (mut r, s) = built_in("st-single-plane", [160, 120]);
    let tilted = camera(Vec3::new(0.0, 3.0, 0.0), Vec3::new(1.0, 2.6, -4.0));
    for view in [s.camera, tilted] {
        for light in [s.light, spot(Vec3::new(-4.0, 6.0, -3.0), Vec3::new(0.0, 0.0, -1.0), 50.0)] {
            let mut s = Setup { camera: view, light, ..s.clone() };
            for (side, exact) in [("resolution=256", 1.0), ("resolution=80", 2.0)] {
                select(&mut s, ID, &[side]);
                let m = on_the_ground(&mut r, &s);
                assert!(m.len() > 3000, "{light:?}: {}", m.len());
                let off = m.iter().map(|m| (m / exact - 1.0).abs()).fold(0.0, f32::max);
                assert!(off < 0.02, "{view:?} {light:?} {side}: off by {off}");
                let notes = r.notes().unwrap().concat();
                assert_eq!(notes.contains("2.000 pixels wide"), exact == 2.0, "{notes}");
            }
        }
    }
}

/// Over a whole map what is seen of the plane is spread evenly over the picture too, though texels are no squares.
#[test]
fn filled_maps_waste_nothing() {
    let view = camera(Vec3::new(0.0, 3.0, 9.0), Vec3::new(0.0, 0.5, 0.0));
    let (mut r, mut s) = start(
        scene(vec![mesh(&yard(), 0)], vec![material(Vec3::ONE)], view, sun(Vec3::new(0.5, 0.8, 0.3))),
        [160, 120],
    );
    for light in [s.light, spot(Vec3::new(4.0, 8.0, 3.0), Vec3::ZERO, 50.0)] {
        s.light = light;
        select(&mut s, ID, &["resolution=256", "scale=fill"]);
        let m = on_the_ground(&mut r, &s);
        let [least, most] = m.iter().fold([f32::MAX, 0.0], |[l, h], m| [f32::min(l, *m), f32::max(h, *m)]);
        // 256² texels for at most 160 × 120 pixels.
        assert!(m.len() > 5000 && most < 0.64 && most < 1.02 * least, "{light:?}: {least} to {most} on {}", m.len());
    }
}

/// With a texel for each pixel no pixel of the plane is wrong but by bias; all told it is better than a map of twice its texels.
#[test]
fn the_plane_is_right() {
    let view = camera(Vec3::new(0.0, 3.0, 9.0), Vec3::new(0.0, 0.5, 0.0));
    let (mut r, mut s) = start(
        scene(vec![mesh(&yard(), 0)], vec![material(Vec3::ONE)], view, sun(Vec3::new(0.5, 0.8, 0.3))),
        [160, 120],
    );
    for light in [s.light, spot(Vec3::new(4.0, 8.0, 3.0), Vec3::ZERO, 50.0)] {
        s.light = light;
        let others = errors(&mut r, &mut s, "shadow-map", &["resolution=256", "bias=0.0005"]).share();
        let own = errors(&mut r, &mut s, ID, &["resolution=180", "bias=0.0005"]).share();
        let (v, truth) = (r.read_visibility().unwrap(), r.read_hard_truth().unwrap());
        let (mask, at) = (r.read_mask().unwrap(), r.read_position().unwrap());
        let ground: Vec<usize> = (0..v.len()).filter(|i| mask[*i] == FACING && at[*i][1].abs() < 1e-4).collect();
        let wrong = ground.iter().filter(|i| (v[**i] - truth[**i]).abs() > 0.5).count();
        println!("{}: {own} against {others}; {wrong} of {} on the ground", light.kind(), ground.len());
        assert!(ground.len() > 8000 && wrong * 1000 < ground.len(), "{light:?}: {wrong} of {}", ground.len());
        assert!(own < 0.7 * others, "{light:?}: {own} against {others}");
    }
}

/// The largest plane is found, and is that which is given by the values that a pick sets; of two floors the one most seen.
#[test]
fn the_largest_plane_is_found() {
    let view = camera(Vec3::new(0.0, 3.0, 9.0), Vec3::new(0.0, 0.5, 0.0));
    let light = sun(Vec3::new(0.5, 0.8, 0.6));
    let low = floor(Vec2::splat(-12.0), Vec2::splat(12.0), -1.5);
    let wall = [
        [Vec3::new(-3.0, -1.5, -2.0), Vec3::new(3.0, -1.5, -2.0), Vec3::new(3.0, 6.0, -2.0)],
        [Vec3::new(-3.0, -1.5, -2.0), Vec3::new(3.0, 6.0, -2.0), Vec3::new(-3.0, 6.0, -2.0)],
    ];
    let triangles = [&low[..], &wall].concat();
    let world = scene(vec![mesh(&triangles, 0)], vec![material(Vec3::ONE)], view, light);
    let geometry = Geometry::new(&world, 0, 0.0).unwrap();
    let found = |view| {
        let s = Scope { camera: view, light, bounds: geometry.bounds, aspect: 4.0 / 3.0, resolution: 256, margin: 1.0 };
        lixel::largest(&s, &geometry, 0.01).unwrap()
    };
    let below = found(view);
    assert!(
        (below.normal.y.abs() - 1.0).abs() < 1e-9 && (below.distance * below.normal.y + 1.5).abs() < 1e-6,
        "{below:?}"
    );
    let close = camera(Vec3::new(0.0, 3.0, 1.0), Vec3::new(0.0, 3.0, -2.0));
    let upright = found(close);
    assert!((upright.normal.z.abs() - 1.0).abs() < 1e-9 && (upright.distance * upright.normal.z + 2.0).abs() < 1e-6);
    // What a spot's cone does not reach counts for nothing, however large it is in the picture.
    let light = spot(Vec3::new(0.0, 3.0, 4.0), Vec3::new(0.0, 3.0, -2.0), 20.0);
    let s = Scope { camera: view, light, bounds: geometry.bounds, aspect: 4.0 / 3.0, resolution: 256, margin: 1.0 };
    let lit = lixel::largest(&s, &geometry, 0.01).unwrap();
    assert!((lit.normal.z.abs() - 1.0).abs() < 1e-9, "{lit:?}");
    // The truth of the look: the surface in the middle of the picture is the plane that a pick finds there.
    let (mut r, mut s) = start(world, [80, 60]);
    s.camera = close;
    select(&mut s, ID, &["resolution=128"]);
    r.render(&s, ask(&s)).unwrap();
    let (picked, largest) = (r.plane_at([40, 30]).unwrap().unwrap(), r.read_visibility().unwrap());
    assert!(picked.normal.cross(upright.normal).length() < 1e-9, "{picked:?}");
    give(s.params.get_mut(ID).unwrap(), &picked, DVec3::ZERO);
    s.check().unwrap();
    r.render(&s, ask(&s)).unwrap();
    assert_eq!(r.read_visibility().unwrap(), largest);
}

/// The values of a plane give it back, wherever the scene's zero lies.
#[test]
fn a_picked_plane_comes_back() {
    let mut r = Random(5);
    for origin in [DVec3::ZERO, DVec3::new(4e5, -20.0, 5.2e6)] {
        for _ in 0..50 {
            let plane = Plane { normal: r.point().as_dvec3().normalize(), distance: 20.0 * f64::from(r.next()) - 10.0 };
            let mut values: Values = BTreeMap::new();
            give(&mut values, &plane, origin);
            let back = given(&values, origin);
            let turned = plane.normal.dot(back.normal);
            assert!(
                (turned.abs() - 1.0).abs() < 1e-12 && (back.distance * turned - plane.distance).abs() < 1e-6,
                "{plane:?}: {back:?}"
            );
        }
    }
}

/// A plane that cannot be served says why, and the picture is that of an ordinary map.
#[test]
fn what_has_no_map_of_its_own_says_so() {
    let view = camera(Vec3::new(0.0, 2.0, 9.0), Vec3::new(0.0, 0.5, 0.0));
    let light = sun(Vec3::new(0.5, 0.8, 0.3));
    let (mut r, start) = start(scene(vec![mesh(&yard(), 0)], vec![material(Vec3::ONE)], view, light), [80, 60]);
    let wall = ["plane=given", "azimuth=0", "elevation=0"];
    let away = camera(view.position, Vec3::new(0.0, 9.0, 20.0));
    let cases: [(&str, &[&str], Setup); 6] = [
        (
            "light lies in the plane",
            &[&wall[..], &["distance=0"]].concat(),
            Setup { light: sun(Vec3::X), ..start.clone() },
        ),
        ("camera lies in the plane", &[&wall[..], &["distance=9"]].concat(), start.clone()),
        (
            "camera is behind",
            &[&wall[..], &["distance=0"]].concat(),
            Setup { light: sun(Vec3::new(0.5, 0.8, -0.3)), ..start.clone() },
        ),
        (
            "camera sees nothing of the plane",
            &[&wall[..], &["distance=50"]].concat(),
            Setup { light: sun(Vec3::new(0.5, 0.8, -0.3)), ..start.clone() },
        ),
        ("there is no plane of interest", &[], Setup { camera: away, ..start.clone() }),
        (
            "light lies in the plane",
            &["plane=given"],
            Setup { light: spot(Vec3::new(3.0, 0.0, 3.0), Vec3::ZERO, 50.0), ..start.clone() },
        ),
    ];
    for (says, sets, mut s) in cases {
        select(&mut s, ID, &[&["resolution=128"], sets].concat());
        r.render(&s, ask(&s)).unwrap();
        let (notes, own) = (r.notes().unwrap().concat(), r.read_visibility().unwrap());
        assert!(notes.contains(says), "{says}: {notes}");
        select(&mut s, "shadow-map", &["resolution=128"]);
        r.render(&s, ask(&s)).unwrap();
        assert!(r.read_visibility().unwrap() == own, "{says}: another picture");
    }
}
