//! Texels thrown back on a rectangle: against all texels of the map on the CPU, closed forms and the truth.

use crate::common::*;
use crate::light_size::{LID, places, under_the_lid};
use glam::{DVec2, DVec4, Vec2, Vec3};
use shadowscope::frame::{Ask, Renderer};
use shadowscope::light::Light;
use shadowscope::measure::metrics::FACING;
use shadowscope::setup::Setup;
use shadowscope::truth::Samples;

fn draw(r: &mut Renderer, s: &mut Setup, sets: &[&str]) -> Vec<f32> {
    select(s, "backprojection", sets);
    r.render(s, Ask { picture: false, ..ask(s) }).unwrap();
    r.read_visibility().unwrap()
}

/// Root of the mean square of visibility less the truth of 256 samples, and its mean, over what faces the light.
fn off(r: &mut Renderer, s: &mut Setup, sets: &[&str]) -> [f64; 2] {
    s.truth_samples = Samples::Fixed(256);
    let (seen, truth) = (draw(r, s, sets), r.read_truth().unwrap());
    let mask = r.read_mask().unwrap();
    let facing = mask.iter().zip(seen.iter().zip(&truth)).filter(|(m, _)| **m == FACING);
    let off: Vec<f64> = facing.map(|(_, (v, t))| (v - t) as f64).collect();
    let n = off.len() as f64;
    [(off.iter().map(|o| o * o).sum::<f64>() / n).sqrt(), off.iter().sum::<f64>() / n]
}

/// A rectangle that shines down, turned about its axis.
fn rectangle(center: Vec3, size: f32) -> Light {
    let (half_u, half_v) = (Vec3::new(3.0, 0.0, 1.0) * 0.2 * size, Vec3::new(-1.0, 0.0, 3.0) * 0.1 * size);
    Light::RectArea { center, half_u, half_v, range: 60.0, color: Vec3::ONE }
}

/// Bounds of how many samples all texels of the map hide together, as texels' borders may be rounded either way.
fn hidden(place: DVec2, depth: f64, before: f64, texels: &[f64], per_texel: DVec2, fill: bool, n: usize) -> [usize; 2] {
    let side = texels.len().isqrt();
    let thrown = |x: usize, y: usize| {
        let z = texels[y * side + x];
        (z < before).then(|| depth * z / (depth - z))
    };
    // A texel whose depth is that of the comparison may lie on either side: what it hides is asked for at no pixel of these tests.
    let mut hit = [vec![false; n * n], vec![false; n * n]];
    for y in 0..side {
        for x in 0..side {
            let Some(caster) = thrown(x, y) else { continue };
            let low = DVec2::new(x as f64, y as f64) - place;
            let (mut from, to) = (low * per_texel * caster, (low + 1.0) * per_texel * caster);
            if fill {
                if let Some(left) = (x > 0).then(|| thrown(x - 1, y)).flatten() {
                    from.x = from.x.min(low.x * per_texel.x * left);
                }
                if let Some(above) = (y > 0).then(|| thrown(x, y - 1)).flatten() {
                    from.y = from.y.min(low.y * per_texel.y * above);
                }
            }
            if from.max_element() > 1.1 || to.min_element() < -1.1 {
                continue;
            }
            for (hit, spare) in hit.iter_mut().zip([-3e-4, 3e-4]) {
                for (j, hit) in hit.iter_mut().enumerate() {
                    let at = (2.0 * DVec2::new((j % n) as f64, (j / n) as f64) + 1.0) / n as f64 - 1.0;
                    *hit |= at.cmpge(from - spare).all() && at.cmplt(to + spare).all();
                }
            }
        }
    }
    hit.map(|hit| hit.iter().filter(|h| **h).count())
}

/// With bits for samples the shadow is exactly what all texels of the map hide together, each taken as a rectangle: windows, pyramid and
/// shrinking leave none out, and gaps are closed as they are said to be.
#[test]
fn bits_are_those_of_all_texels() {
    let view = camera(Vec3::new(-0.2, 4.0, 2.2), Vec3::new(-0.2, 0.0, -0.6));
    let light = rectangle(Vec3::new(0.4, 4.5, 0.3), 2.0);
    let made = scene(vec![mesh(&yard(), 0)], vec![material(Vec3::ONE)], view, light);
    let (mut r, mut s) = start(made, [44, 33]);
    let Light::RectArea { half_u, half_v, .. } = light else { unreachable!() };
    for (n, fill, shrink) in [(16, false, 3), (16, true, 3), (8, false, 1), (8, true, 0)] {
        let sets = [
            format!("mode=bitmask{}", n * n),
            format!("gap_fill={fill}"),
            format!("shrink={shrink}"),
            "early_umbra=false".into(),
            "window_max=128".into(),
            "resolution=64".into(),
            "bias=0.03".into(),
            "slope_bias=0".into(),
        ];
        let seen = draw(&mut r, &mut s, &sets.each_ref().map(String::as_str));
        let (mask, at) = (r.read_mask().unwrap(), r.read_position().unwrap());
        let map = r.read_layer(0).unwrap().unwrap();
        let v = map.view;
        let texels: Vec<f64> = map.depth.iter().map(|d| v.linear_depth(*d) as f64).collect();
        let row = |r: glam::Vec4, p: DVec4| r.as_dvec4().dot(p);
        let scale = [v.row_x, v.row_y].map(|r| (r - v.axis * r.truncate().dot(v.axis.truncate())).truncate().length());
        let per_texel = DVec2::new(
            2.0 / (map.side as f64 * scale[0] as f64 * half_u.length() as f64),
            2.0 / (map.side as f64 * scale[1] as f64 * half_v.length() as f64),
        );
        let (mut half, mut sure, mut all) = (0, 0, 0);
        // Of what lies level, so that none of the light has set.
        let level = |y: f32| [0.0, 1.2, 1.8, 2.5].iter().any(|h| (y - h).abs() < 1e-4);
        for ((_, p), seen) in mask.iter().zip(&at).zip(seen).filter(|((m, p), _)| **m == FACING && level(p[1])) {
            let p = Vec3::from_slice(p).as_dvec3().extend(1.0);
            let depth = row(v.axis, p);
            let ndc = DVec2::new(row(v.row_x, p), -row(v.row_y, p)) / row(v.row_w, p);
            let place = 0.5 * map.side as f64 * (1.0 + ndc);
            let [least, most] = hidden(place, depth, depth - 0.03, &texels, per_texel, fill, n);
            let hidden = ((1.0 - seen) * (n * n) as f32).round() as usize;
            assert!((least..=most).contains(&hidden), "{sets:?}: {hidden} hidden instead of {least} to {most} at {p}");
            all += 1;
            sure += (least == most) as u32;
            half += (hidden > 0 && hidden < n * n) as u32;
        }
        println!("{sets:?}: {all} pixels, {sure} beyond doubt, {half} in penumbras");
        assert!(sure * 10 > all * 9 && half > 150, "{sets:?}: {sure} of {all}, {half}");
    }
}

/// An edge along a side of the rectangle throws the closed form's ramp, in all modes as far as their samples go; also where texels are
/// skipped, as far as these stand for others.
#[test]
fn an_edge_throws_a_ramp() {
    let (height, half) = (4.0, 0.3);
    let light = Light::RectArea {
        center: Vec3::Y * height,
        half_u: Vec3::X * half,
        half_v: Vec3::Z * 0.4,
        range: 30.0,
        color: Vec3::ONE,
    };
    let (mut r, mut s) = under_the_lid(light, 0.0);
    let ramp = |x: f64| ((half as f64 + x * (height / LID - 1.0) as f64) / (2.0 * half as f64)).clamp(0.0, 1.0);
    for (sets, most) in [
        (["mode=area", "stride=1", "window_max=128"], 0.01),
        (["mode=bitmask64", "stride=1", "window_max=128"], 0.03),
        (["mode=bitmask256", "stride=1", "window_max=128"], 0.02),
        (["mode=area", "stride=4", "window_max=128"], 0.02),
        (["mode=bitmask256", "stride=1", "window_max=8"], 0.04),
    ] {
        for more in ["gap_fill=true", "gap_fill=false", "early_umbra=false", "fit=msf"] {
            let seen = draw(&mut r, &mut s, &[sets[0], sets[1], sets[2], more, "resolution=256"]);
            let (mut n, mut squares, mut sum) = (0.0, 0.0, 0.0);
            for (p, v) in places(&mut r, &seen) {
                let off = v - ramp(p.x);
                squares += off * off;
                sum += off;
                n += 1.0;
            }
            let (rms, bias) = (f64::sqrt(squares / n), sum / n);
            println!("{sets:?} {more}: {rms:.4}, {bias:+.4} in the mean");
            assert!(rms < most && bias.abs() < 0.6 * most, "{sets:?} {more}: {rms} {bias}");
        }
    }
}

/// Of casters one behind the other, areas that are added up hide too much of the light, samples do not.
#[test]
fn areas_count_twice_and_bits_once() {
    // Slats over slats, so that both cover the same part of the light from most of the floor.
    let mut triangles = floor(Vec2::splat(-12.0), Vec2::splat(12.0), 0.0);
    for i in -6..6 {
        let x = i as f32 * 0.5;
        triangles.extend(floor(Vec2::new(x, -3.0), Vec2::new(x + 0.25, 3.0), 1.0));
        triangles.extend(floor(Vec2::new(-3.0, x), Vec2::new(3.0, x + 0.25), 1.6));
    }
    let view = camera(Vec3::new(0.0, 0.7, 1.4), Vec3::new(0.0, 0.0, -0.6));
    let light = rectangle(Vec3::new(0.2, 5.0, 0.1), 1.0);
    let (mut r, mut s) = start(scene(vec![mesh(&triangles, 0)], vec![material(Vec3::ONE)], view, light), [96, 72]);
    let [area, small, large] = ["area", "bitmask64", "bitmask256"].map(|mode| {
        let off = off(&mut r, &mut s, &["resolution=512", &format!("mode={mode}")]);
        println!("{mode}: {:.4}, {:+.4} in the mean", off[0], off[1]);
        off
    });
    assert!(area[0] > 1.5 * small[0] && small[0] > large[0], "{area:?} {small:?} {large:?}");
    assert!(area[1] < -0.03 && small[1].abs() < 0.4 * area[1].abs(), "{area:?} {small:?}");
}

/// What of the light has set behind a wall's plane is not seen, in each mode.
#[test]
fn what_has_set_is_hidden() {
    let p = |y: f32, z: f32| Vec3::new(0.0, y, z);
    let wall = [[p(-8.0, -8.0), p(8.0, -8.0), p(8.0, 8.0)], [p(-8.0, -8.0), p(8.0, 8.0), p(-8.0, 8.0)]];
    let view = camera(Vec3::new(4.0, 0.0, 0.0), Vec3::ZERO);
    // It shines down; most of it lies before the wall, x > 0.
    let light = Light::RectArea {
        center: Vec3::new(0.2, 3.0, 0.0),
        half_u: Vec3::X * 0.5,
        half_v: Vec3::Z * 0.4,
        range: 60.0,
        color: Vec3::ONE,
    };
    let (mut r, mut s) = start(scene(vec![mesh(&wall, 0)], vec![material(Vec3::ONE)], view, light), [48, 36]);
    for (mode, spare) in [("area", 0.05), ("bitmask64", 0.07), ("bitmask256", 0.04)] {
        let seen = draw(&mut r, &mut s, &[&format!("mode={mode}")]);
        let mask = r.read_mask().unwrap();
        let facing: Vec<f32> = mask.iter().zip(seen).filter(|(m, _)| **m == FACING).map(|(_, v)| v).collect();
        assert!(facing.len() > 300 && facing.iter().all(|v| (v - 0.7).abs() < spare), "{mode}: {facing:?}");
    }
}

/// The error falls with resolution to a floor that more texels do not lower: what the light's centre does not see.
#[test]
fn the_error_has_a_floor() {
    let view = camera(Vec3::new(2.0, 3.0, 5.0), Vec3::new(0.0, 0.3, 0.0));
    let light = rectangle(Vec3::new(0.4, 4.0, 0.3), 2.0);
    let (mut r, mut s) = start(scene(vec![mesh(&yard(), 0)], vec![material(Vec3::ONE)], view, light), [96, 72]);
    let rmse = [64, 256, 1024, 2048].map(|resolution| {
        let sets = [format!("resolution={resolution}"), "mode=bitmask256".into(), "window_max=128".into()];
        off(&mut r, &mut s, &sets.each_ref().map(String::as_str))[0]
    });
    println!("{rmse:.4?}");
    assert!(rmse[0] > 1.5 * rmse[2] && rmse[1] > rmse[2] && rmse[3] > 0.8 * rmse[2] && rmse[2] > 0.005, "{rmse:?}");
}
