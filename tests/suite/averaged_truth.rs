//! The truth averaged over a pixel against closed forms and larger pictures, and what counts as able to be wrong.

use crate::common::*;
use glam::{DVec2, Vec2, Vec3};
use shadowscope::frame::{Ask, Renderer, Truth};
use shadowscope::gpu::{GivenUp, Gpu};
use shadowscope::light::Light;
use shadowscope::measure;
use shadowscope::measure::metrics::{AWAY, BACKGROUND, FACING, OUTSIDE};
use shadowscope::scene::Camera;
use shadowscope::setup::Setup;
use shadowscope::truth::{COUNTS, Samples, offset};
use std::sync::Arc;
use std::sync::atomic::AtomicU32;
use std::sync::atomic::Ordering::Relaxed;

/// Renders the set-up with a truth of so many samples per pixel.
fn truth(r: &mut Renderer, setup: &Setup, samples: u32) -> Vec<f32> {
    let setup = Setup { truth_samples: Samples::Fixed(samples), ..setup.clone() };
    let told = r.render(&setup, Ask { picture: false, ..ask(&setup) }).unwrap();
    assert_eq!((told.truth.covered, told.truth.done), (1.0, 1.0));
    r.read_truth().unwrap()
}

fn lamp(position: Vec3, target: Vec3, outer_angle: f32, range: f32) -> Light {
    Light::Spot { position, direction: target - position, outer_angle, range, radius: 0.0, color: Vec3::splat(40.0) }
}

/// Share of the unit square around `center` where a linear function is negative, by clipping the square.
fn negative_share(center: DVec2, f: impl Fn(DVec2) -> f64) -> f64 {
    let corners = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)].map(|(x, y)| center + DVec2::new(x, y));
    let mut kept = Vec::new();
    for i in 0..4 {
        let (a, b) = (corners[i], corners[(i + 1) % 4]);
        let (fa, fb) = (f(a), f(b));
        if fa < 0.0 {
            kept.push(a);
        }
        if (fa < 0.0) != (fb < 0.0) {
            kept.push(a + (b - a) * (fa / (fa - fb)));
        }
    }
    let cross = |i: usize| kept[i].perp_dot(kept[(i + 1) % kept.len()]);
    0.5 * (0..kept.len()).map(cross).sum::<f64>().abs()
}

/// A shadow's straight edge over a floor: the mean is the share of the pixel's area that is lit.
#[test]
fn a_straight_edge_gives_the_lit_share_of_the_pixel() {
    let mut triangles = floor(Vec2::splat(-6.0), Vec2::splat(6.0), 0.0);
    // A lid over half of the floor, above the camera; its edge runs along z + 0.4 x = 0.3.
    let p = |x: f32, z: f32| Vec3::new(x, 9.0, z);
    triangles.extend([[p(-9.0, 3.9), p(9.0, -3.3), p(0.0, -40.0)]]);
    let view = camera(Vec3::new(1.0, 3.0, 5.0), Vec3::ZERO);
    let size = [96, 72];
    let (mut r, s) = start(scene(vec![mesh(&triangles, 0)], vec![material(Vec3::ONE)], view, sun(Vec3::Y)), size);
    // The ray through a place of the picture and the floor: the sign of the edge there is that of a linear function.
    let eye = view.position.as_dvec3();
    let forward = (view.target.as_dvec3() - eye).normalize();
    let right = forward.cross(glam::DVec3::Y).normalize();
    let up = right.cross(forward);
    let tangent = (view.fov as f64 / 2.0).to_radians().tan();
    let edge = |at: DVec2| {
        let ndc = (at / DVec2::new(96.0, 72.0) * 2.0 - 1.0) * DVec2::new(tangent * 96.0 / 72.0, -tangent);
        let d = forward + right * ndc.x + up * ndc.y;
        // z + 0.4 x - 0.3 at the floor, times -d.y > 0.
        -d.y * (eye.z + 0.4 * eye.x - 0.3) + eye.y * (d.z + 0.4 * d.x)
    };
    let hard = truth(&mut r, &s, 1);
    assert_eq!(hard, r.read_hard_truth().unwrap());
    let mask = r.read_mask().unwrap();
    for (n, most) in COUNTS.into_iter().zip([1.0, 0.4, 0.13, 0.05]) {
        let mean = truth(&mut r, &s, n);
        assert_eq!(r.read_hard_truth().unwrap(), hard, "the hard truth stays");
        let (mut edges, mut sum) = (0, 0.0);
        for i in (0..mean.len()).filter(|i| mask[*i] == FACING) {
            let center = DVec2::new((i % 96) as f64 + 0.5, (i / 96) as f64 + 0.5);
            let lit = 1.0 - negative_share(center, edge);
            let off = (mean[i] as f64 - lit).abs();
            if lit > 0.0 && lit < 1.0 {
                edges += 1;
                sum += off;
            }
            assert!(off <= most, "{n} samples: {} instead of {lit} in pixel {i}", mean[i]);
            assert!(((mean[i] * n as f32).round() / n as f32 - mean[i]).abs() < 1e-6, "{n} samples: {}", mean[i]);
        }
        assert!(edges > 60, "{edges}");
        // Independent samples would be off by 0.2 / √n in the mean.
        let (off, allowed) = (sum / edges as f64, if n == 1 { 0.3 } else { 0.6 / n as f64 });
        assert!(off < allowed, "{n} samples: off by {off} in the mean, more than {allowed}");
    }
}

/// The samples of 4 and of 16 lie at centres of pixels of a picture with 4 and 16 times as many a side: the mean is made
/// from that picture, with surfaces and light of its own at each sample.
#[test]
fn the_mean_is_that_of_a_larger_pictures_pixels() {
    let mut triangles = yard();
    // A thin rail, of which no pixel sees more than a part.
    triangles.extend(floor(Vec2::new(-4.0, 1.5), Vec2::new(4.0, 1.53), 1.2));
    let view = camera(Vec3::new(3.0, 4.0, 8.0), Vec3::new(0.0, 0.5, 0.0));
    for light in [sun(Vec3::new(0.6, 1.0, 0.3)), lamp(Vec3::new(-2.0, 5.0, 2.0), Vec3::ZERO, 25.0, 7.0)] {
        let [w, h] = [44, 32];
        let made = scene(vec![mesh(&triangles, 0)], vec![material(Vec3::ONE)], view, light);
        let (mut r, s) = start(made, [w, h]);
        for n in [4, 16] {
            let mean = truth(&mut r, &s, n);
            let hard = r.read_hard_truth().unwrap();
            let large = Setup { size: [w * n, h * n], ..s.clone() };
            let fine = truth(&mut r, &large, 1);
            let mask = r.read_mask().unwrap();
            let (mut differing, mut soft) = (0, 0);
            for (i, mean) in mean.iter().enumerate() {
                let (x, y) = (i as u32 % w, i as u32 / w);
                let places: Vec<usize> = (0..n)
                    .map(|k| {
                        let at = (Vec2::new(x as f32, y as f32) + 0.5 + offset(k, n)) * n as f32;
                        (at.y as u32 * w * n + at.x as u32) as usize
                    })
                    .filter(|at| mask[*at] == FACING)
                    .collect();
                let sum: f32 = places.iter().map(|at| fine[*at]).sum();
                let exact = if places.is_empty() { hard[i] } else { sum / places.len() as f32 };
                differing += ((mean - exact).abs() > 1e-5) as usize;
                soft += (exact > 0.0 && exact < 1.0) as usize;
            }
            let name = light.kind();
            assert!(soft > 8, "{name}: {soft} pixels of {n} samples are neither lit nor dark");
            // Rounding moves a sample that lies on an edge to its other side.
            assert!(differing <= 2, "{name}: {differing} of {} pixels differ with {n} samples", w * h);
        }
    }
}

/// The mean is traced in pieces like the hard truth, kept while nothing that it depends on changes, and leaves the
/// technique's G-buffer alone.
#[test]
fn the_mean_comes_in_pieces_and_is_kept() {
    let view = camera(Vec3::new(3.0, 4.0, 8.0), Vec3::new(0.0, 0.5, 0.0));
    let made = scene(vec![mesh(&yard(), 0)], vec![material(Vec3::ONE)], view, sun(Vec3::new(0.6, 1.0, 0.3)));
    let (mut r, mut s) = start(made, [64, 48]);
    s.view = "truth".into();
    let whole = truth(&mut r, &s, 4);
    s.camera.position.x += 0.1;
    truth(&mut r, &s, 1);
    s.camera.position.x = view.position.x;
    s.truth_samples = Samples::Fixed(4);
    let part = |pixels| Ask { truth: Truth::Some(pixels), ..ask(&s) };
    let mut told = r.render(&s, part(64 * 20)).unwrap();
    assert!(told.truth.covered < 0.5 && told.truth.done < 0.1, "{told:?}");
    let (position, surface) = (r.read_position().unwrap(), r.read_surface().unwrap());
    let hard_picture = {
        let hard = Setup { truth_samples: Samples::Fixed(1), ..s.clone() };
        r.render(&hard, ask(&hard)).unwrap();
        r.read_picture().unwrap()
    };
    let mut steps = 0;
    while told.truth.done < 1.0 {
        told = if steps % 2 == 0 { r.render(&s, part(64 * 30)).unwrap() } else { told };
        if steps % 2 == 1 {
            told.truth = r.trace(64 * 30).unwrap();
        }
        steps += 1;
        if steps == 1 {
            assert_eq!(
                r.read_picture().unwrap(),
                hard_picture,
                "until each pixel has a sample the hard truth is shown"
            );
        }
        assert_eq!((r.read_position().unwrap(), r.read_surface().unwrap()), (position.clone(), surface.clone()));
        assert!(steps < 30, "{told:?}");
    }
    assert!(steps >= 6 && r.read_truth().unwrap() == whole, "{steps}");
    // Another technique, other samples, the hard truth alone: nothing is traced again.
    s.select("pcf").unwrap();
    assert_eq!(r.render(&s, Ask { truth: Truth::Off, ..ask(&s) }).unwrap().truth.done, 1.0);
    assert_eq!(r.read_truth().unwrap(), whole);
    let hard = Setup { truth_samples: Samples::Fixed(1), ..s.clone() };
    assert_eq!(r.render(&hard, Ask { truth: Truth::Off, ..ask(&s) }).unwrap().truth.done, 1.0);
    assert_eq!(r.read_truth().unwrap(), r.read_hard_truth().unwrap());
    assert_eq!(r.render(&s, Ask { truth: Truth::Off, ..ask(&s) }).unwrap().truth.done, 1.0);
    // More samples are begun anew, and so is another light.
    s.truth_samples = Samples::Fixed(16);
    assert!(r.render(&s, Ask { truth: Truth::Off, ..ask(&s) }).unwrap().truth.done < 0.1);
    s.light = sun(Vec3::new(0.6, 1.0, 0.2));
    assert_eq!(r.render(&s, Ask { truth: Truth::Off, ..ask(&s) }).unwrap().truth.done, 0.0);
}

/// What is traced is kept for pictures of several sizes and for several numbers of samples: neither another technique,
/// parameter or view nor a draft between traces it again.
#[test]
fn the_truth_is_kept_beside_that_of_drafts() {
    let view = camera(Vec3::new(3.0, 4.0, 8.0), Vec3::new(0.0, 0.5, 0.0));
    let made = scene(vec![mesh(&yard(), 0)], vec![material(Vec3::ONE)], view, sun(Vec3::new(0.6, 1.0, 0.3)));
    let (mut r, mut s) = start(made, [64, 48]);
    let whole = truth(&mut r, &s, 4);
    let draft = Ask { size: [16, 12], ..ask(&s) };
    s.truth_samples = Samples::Fixed(1);
    let small = r.render(&s, draft).unwrap();
    assert_eq!(small.traced, 16 * 12, "a draft has a truth of its own");
    let few = r.read_truth().unwrap();
    for (technique, bias, view, samples) in [
        ("shadow-map", "0.02", "error", 1),
        ("pcf", "0.001", "shaded", 4),
        ("pcf", "0.01", "truth", 1),
        ("lispsm", "0.01", "lispsm", 4),
        ("rt-hard", "", "error", 4),
    ] {
        s.select(technique).unwrap();
        if !bias.is_empty() {
            s.set(&format!("bias={bias}"), &[technique.into()]).unwrap();
        }
        s.view = if view == technique { "shadow-map".into() } else { view.into() };
        s.truth_samples = Samples::Fixed(1);
        assert_eq!(r.render(&s, draft).unwrap().traced, 0, "{technique}, draft");
        assert_eq!(r.read_truth().unwrap(), few);
        s.truth_samples = Samples::Fixed(samples);
        let told = r.render(&s, ask(&s)).unwrap();
        assert_eq!((told.traced, told.truth.done), (0, 1.0), "{technique}");
        assert!(samples == 1 || r.read_truth().unwrap() == whole);
    }
    // Other samples are begun anew and leave those there; other sizes cost the smallest its place.
    s.truth_samples = Samples::Fixed(16);
    assert_eq!(r.render(&s, ask(&s)).unwrap().traced, 16 * 64 * 48);
    s.truth_samples = Samples::Fixed(4);
    assert_eq!(r.render(&s, ask(&s)).unwrap().traced, 0);
    for size in [[32, 24], [40, 30]] {
        assert!(r.render(&s, Ask { size, ..ask(&s) }).unwrap().traced > 0);
    }
    assert_eq!(r.render(&s, ask(&s)).unwrap().traced, 0);
    s.truth_samples = Samples::Fixed(1);
    assert_eq!(r.render(&s, draft).unwrap().traced, 16 * 12);
    s.camera.fov += 1.0;
    assert_eq!(r.render(&s, ask(&s)).unwrap().traced, 64 * 48);
}

/// Rows without a truth show the shaded picture; another view, and more of the truth, are drawn without a new frame.
#[test]
fn what_is_not_traced_yet_is_shaded() {
    let view = camera(Vec3::new(3.0, 4.0, 8.0), Vec3::new(0.0, 0.5, 0.0));
    let made = scene(vec![mesh(&yard(), 0)], vec![material(Vec3::ONE)], view, sun(Vec3::new(0.6, 1.0, 0.3)));
    let (mut r, shaded) = start(made, [64, 48]);
    let error = Setup { view: "error".into(), ..shaded.clone() };
    let split = Setup { view: "split".into(), split: 0.25, ..shaded.clone() };
    r.render(&shaded, Ask { truth: Truth::Off, ..ask(&shaded) }).unwrap();
    let plain = r.read_picture().unwrap();
    r.render(&error, Ask { truth: Truth::Off, ..ask(&error) }).unwrap();
    assert!(r.read_picture().unwrap() == plain, "nothing is traced");
    let rows = r.trace(64 * 16).unwrap();
    assert_eq!(rows.covered, 16.0 / 48.0);
    r.redraw(&error).unwrap();
    let part = r.read_picture().unwrap();
    r.trace(64 * 48).unwrap();
    r.redraw(&error).unwrap();
    let drawn = r.read_picture().unwrap();
    let border = 16 * 64 * 4;
    assert!(
        part[border..] == plain[border..] && part[..border] == drawn[..border] && drawn[border..] != plain[border..]
    );
    for other in [&split, &shaded, &error] {
        r.redraw(other).unwrap();
        let again = r.read_picture().unwrap();
        r.render(other, ask(other)).unwrap();
        assert!(again == r.read_picture().unwrap(), "{}", other.view);
    }
}

/// A frame may be given up before any of its passes: the next is as if it had never been begun, and so is its truth.
#[test]
fn a_frame_that_is_given_up_leaves_nothing_behind() {
    let view = camera(Vec3::new(3.0, 4.0, 8.0), Vec3::new(0.0, 0.5, 0.0));
    let made = scene(vec![mesh(&yard(), 0)], vec![material(Vec3::ONE)], view, sun(Vec3::new(0.6, 1.0, 0.3)));
    // The others share their device.
    let gpu = Arc::new(strict(Gpu::new(None).unwrap()));
    let mut r = Renderer::new(gpu.clone(), Arc::new(made)).unwrap();
    let mut s = Setup::new("test", r.scene()).unwrap();
    s.size = [64, 48];
    s.truth_samples = Samples::Fixed(4);
    let other = Setup { light: sun(Vec3::new(-0.5, 1.0, 0.4)), ..s.clone() };
    for technique in ["shadow-map", "rtw", "dsm", "pssm"] {
        let with = |s: &Setup| {
            let mut s = s.clone();
            s.select(technique).unwrap();
            s
        };
        let (s, other) = (with(&s), with(&other));
        gpu.give_up_when(|| false);
        r.render(&s, Ask { fresh: true, ..ask(&s) }).unwrap();
        let whole = [r.read_visibility().unwrap(), r.read_truth().unwrap(), r.read_hard_truth().unwrap()];
        let mut passes = 0;
        loop {
            gpu.give_up_when(|| false);
            r.render(&other, ask(&other)).unwrap();
            let left = AtomicU32::new(passes);
            gpu.give_up_when(move || left.fetch_update(Relaxed, Relaxed, |n| n.checked_sub(1)).is_err());
            let given_up = r.render(&s, ask(&s)).err();
            gpu.give_up_when(|| false);
            let told = r.render(&s, ask(&s)).unwrap();
            assert_eq!(told.truth.done, 1.0);
            let now = [r.read_visibility().unwrap(), r.read_truth().unwrap(), r.read_hard_truth().unwrap()];
            assert!(now == whole, "{technique}, given up before pass {passes}");
            match given_up {
                Some(e) => assert!(e.is::<GivenUp>(), "{e:#}"),
                None => break,
            }
            // Each of the first, and then ever fewer.
            passes += 1 + passes / 6;
        }
        assert!(passes >= 8, "{technique} has {passes} passes");
    }
}

/// Judged by the mean over the pixel a filter is better than single comparisons; by one sample it seems worse.
#[test]
fn the_mean_credits_filters() {
    let (mut s, scene) = Setup::open("bench").unwrap();
    s.camera = scene.cameras.iter().find(|c| c.name == "trees-side").unwrap().camera;
    s.size = [128, 128];
    let mut r = Renderer::new(gpu(), std::sync::Arc::new(scene)).unwrap();
    let mut row = |technique: &str, sets: &[&str], samples: Samples| {
        s.select(technique).unwrap();
        for set in sets {
            s.set(set, &[technique.into()]).unwrap();
        }
        measure::accuracy(&mut r, &Setup { truth_samples: samples, ..s.clone() }, 0).unwrap()
    };
    let mut rows = |samples| {
        [
            row("shadow-map", &["resolution=512"], samples),
            row("pcf", &["resolution=512", "mode=grid", "kernel=3"], samples),
            row("pcf", &["resolution=512", "mode=tent", "kernel=3"], samples),
            row("rt-hard", &[], samples),
        ]
    };
    let (hard, mean) = (rows(Samples::Fixed(1)), rows(Samples::Auto));
    assert!(hard[1].rmse > hard[0].rmse && hard[3].rmse == 0.0, "{:?}", hard.map(|r| r.rmse));
    for pcf in 1..3 {
        for (name, error) in [
            ("rmse", (|r| r.rmse) as fn(&measure::Record) -> f64),
            ("mae", |r| r.mae),
            ("beyond_tolerance", |r| r.beyond_tolerance),
        ] {
            let [plain, filtered] = [0, pcf].map(|i| error(&mean[i]));
            assert!(filtered < 0.75 * plain, "{name}: {filtered} of pcf, {plain} of shadow-map");
        }
    }
    for (a, b) in hard.iter().zip(&mean) {
        let counts = |r: &measure::Record| [r.facing, r.lit_incorrect, r.shadow_incorrect, r.away, r.background];
        assert_eq!(counts(a), counts(b), "{}: counts are against one sample", a.technique);
        assert_eq!((a.truth_samples, b.truth_samples), (1, 16));
        assert!(b.rmse_penumbra.is_some() && b.max_error <= 1.0 && b.mae <= b.rmse, "{b:?}");
    }
    assert!(mean[3].rmse > 0.0 && mean[3].error_share == 0.0, "a single ray is not the pixel's mean");
}

/// What can be wrong faces the light within its cone and range; the rest of what faces it is a class of its own.
#[test]
fn only_what_the_light_reaches_can_be_wrong() {
    let view: Camera = camera(Vec3::new(3.0, 4.0, 8.0), Vec3::new(0.0, 0.5, 0.0));
    let lights = [
        lamp(Vec3::new(-2.0, 5.0, 2.0), Vec3::ZERO, 12.0, 60.0),
        lamp(Vec3::new(-2.0, 5.0, 2.0), Vec3::ZERO, 30.0, 5.5),
        Light::Omni { position: Vec3::new(0.5, 2.0, 1.0), range: 3.0, radius: 0.0, color: Vec3::ONE },
        sun(Vec3::new(0.6, 1.0, 0.3)),
    ];
    for light in lights {
        let made = scene(vec![mesh(&yard(), 0)], vec![material(Vec3::ONE)], view, light);
        let (mut r, mut s) = start(made, [160, 120]);
        s.select("rt-hard").unwrap();
        let row = measure::accuracy(&mut r, &Setup { truth_samples: Samples::Fixed(4), ..s.clone() }, 0).unwrap();
        let (position, surface) = (r.read_position().unwrap(), r.read_surface().unwrap());
        let (mask, geometry) = (r.read_mask().unwrap(), r.geometry());
        let mut counts = [0usize; 4];
        let mut ties = 0;
        for (i, p) in position.iter().enumerate() {
            let at = Vec3::from_slice(p).as_dvec3();
            let [a, b, c] = geometry.corners(surface[i][3] as usize).map(|p| p.as_dvec3());
            let normal = (b - a).cross(c - a).normalize();
            let normal = normal * normal.dot(view.position.as_dvec3() - at).signum();
            let mut near = 1.0f64;
            let mut class = FACING;
            if p[3] <= 0.0 {
                class = BACKGROUND;
            } else {
                let to_light = match light {
                    Light::Directional { to_light, .. } => to_light.as_dvec3().normalize(),
                    other => other.position().as_dvec3() - at,
                };
                let cosine = normal.dot(to_light.normalize());
                near = near.min(cosine.abs());
                if let Light::Spot { outer_angle, range, .. } = light {
                    let across =
                        -to_light.normalize().dot(light.axis().as_dvec3()) - (outer_angle as f64).to_radians().cos();
                    let along = range as f64 - to_light.length();
                    near = near.min(across.abs()).min(along.abs());
                    class = if across >= 0.0 && along >= 0.0 { FACING } else { OUTSIDE };
                } else if let Light::Omni { range, .. } = light {
                    let along = range as f64 - to_light.length();
                    near = near.min(along.abs());
                    class = if along >= 0.0 { FACING } else { OUTSIDE };
                }
                class = if cosine <= 0.0 { AWAY } else { class };
            }
            counts[class as usize] += 1;
            if near < 1e-4 {
                ties += 1;
            } else {
                assert_eq!(mask[i], class, "{light:?} pixel {i}");
            }
        }
        let [background, away, facing, outside] = counts;
        let off = |a: usize, b: usize| a.abs_diff(b) <= ties;
        assert!(off(row.facing, facing) && off(row.away, away) && off(row.outside, outside), "{row:?} {counts:?}");
        assert_eq!(row.background, background);
        assert_eq!(row.facing + row.away + row.outside + row.background, 160 * 120);
        assert_eq!(row.lit_correct + row.shadow_correct, row.facing);
        assert_eq!(row.rays, row.facing as u64, "each pixel that can be wrong has its ray");
        let reach = light.kind() != "directional";
        assert_eq!(outside > 1000, reach, "{counts:?}");
        assert!(ties < 20 && facing > 300, "{counts:?} {ties}");
    }
}
