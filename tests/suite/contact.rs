//! Contact shadows in screen space, over any technique.

use crate::common::{
    ask, awkward_spots, built_in, camera, floor, lamp, material, mesh, scene, select, start, sun, yard,
};
use glam::{Vec2, Vec3};
use shadowscope::contact::Sweep;
use shadowscope::frame::{Ask, Renderer};
use shadowscope::light::Light;
use shadowscope::measure::metrics::FACING;
use shadowscope::measure::{self, accuracy};
use shadowscope::params::Value;
use shadowscope::scene::Camera;
use shadowscope::setup::{Setup, Side};

const MODES: [&str; 2] = ["march", "sweep"];

/// Draws the contact shadows over a technique; what they alone leave of the light, a number a pixel.
fn contact(r: &mut Renderer, s: &mut Setup, technique: &str, sets: &[&str]) -> Vec<f32> {
    select(s, technique, sets);
    s.view = "contact-visibility".into();
    r.render(s, ask(s)).unwrap();
    s.view = "shaded".into();
    r.read_map().unwrap()
}

fn visibility(r: &mut Renderer, s: &mut Setup, technique: &str, sets: &[&str]) -> Vec<f32> {
    select(s, technique, sets);
    r.render(s, ask(s)).unwrap();
    r.read_visibility().unwrap()
}

/// Lights in and outside the picture, before and behind the camera, and level with it.
fn lights(view: Camera) -> Vec<(&'static str, Light)> {
    let (forward, right) = (view.forward(), view.forward().cross(Vec3::Y).normalize());
    vec![
        ("sun behind", sun(Vec3::new(0.5, 0.6, 0.3) - 0.2 * forward)),
        ("sun in view", sun(forward + 0.15 * right + Vec3::new(0.0, 0.45, 0.0))),
        ("low sun aside", sun(right + Vec3::new(0.0, 0.2, 0.0))),
        // Its place in the picture is at infinity.
        ("sun level with the camera", sun(right - right.dot(forward) * forward)),
        ("sun above", sun(Vec3::Y)),
        ("lamp in view", lamp(Vec3::new(0.3, 2.2, 1.0))),
        ("lamp behind", lamp(view.position - 3.0 * forward + Vec3::new(1.0, 2.0, 0.0))),
        ("lamp beside the picture", lamp(view.position + 2.0 * forward + 9.0 * right)),
        ("lamp at the camera's height", lamp(view.position + 4.0 * right)),
        (
            "hemisphere",
            Light::Hemisphere {
                position: Vec3::new(1.0, 4.0, 2.0),
                direction: Vec3::NEG_Y,
                range: 60.0,
                color: Vec3::splat(20.0),
            },
        ),
    ]
}

/// What the sweep finds, by a loop over each pixel's own samples, without wedges, bands and shared memory but for the line that
/// they put the pixel on.
struct Loop {
    size: [i32; 2],
    /// 1 over the depth of each pixel; 0: nothing there.
    near: Vec<f64>,
    light: [i32; 2],
    light_depth: f64,
    towards: i32,
}

impl Loop {
    fn near(&self, p: [i32; 2]) -> f64 {
        let inside = (0..2).all(|i| (0..self.size[i]).contains(&p[i]));
        if inside { self.near[(p[1] * self.size[0] + p[0]) as usize] } else { 0.0 }
    }

    /// Row and offset from its middle of a line at a distance; `far`: where its number counts.
    fn place(line: i32, far: i32, distance: i32) -> (i32, f32) {
        let moved = line as f32 / far as f32 * (far - distance) as f32;
        (line - (moved + 0.5).floor() as i32, (moved + 0.5).floor() - moved)
    }

    /// Visibility of a pixel with the default parameters but for the number of samples.
    fn visibility(&self, p: [i32; 2], samples: i32) -> f64 {
        let d = [p[0] - self.light[0], p[1] - self.light[1]];
        if d == [0, 0] {
            return 1.0;
        }
        let axis = (d[1].abs() > d[0].abs()) as usize;
        let (distance, row, sign) = (d[axis].abs(), d[1 - axis], d[axis].signum());
        // Bands begin at the picture's border where the light is outside; else next to the light's pixel, or at it.
        let (l, end) = (self.light[axis], self.size[axis] - 1);
        let border = if sign < 0 { l - end } else { -l };
        let first = border.max(if axis == 0 && sign > 0 { 0 } else { 1 });
        let far = first + (distance - first) / 64 * 64 + 63;
        // Of the lines that cross the pixel that nearest to its middle.
        let guess = (row as f64 * far as f64 / distance as f64).round() as i32;
        let lines = (guess - 70..=guess + 70).filter(|m| Loop::place(*m, far, distance).0 == row);
        let off = |m: i32| Loop::place(m, far, distance).1.abs();
        let line = lines.reduce(|a, b| if off(b) < off(a) { b } else { a }).unwrap();
        let own = self.near(p);
        let slope = (own - self.light_depth) / distance as f64;
        let scale = ((distance - self.towards) as f64).min(1.0 / 0.005) * distance as f64 / own;
        let (mut hard, mut soft) = (1f64, [1f64; 4]);
        for i in 0..samples {
            let away = distance - self.towards * (i + 1);
            if away <= 0 {
                break;
            }
            let (row, off) = Loop::place(line, far, away);
            let at = |row: i32| {
                let mut q = [0; 2];
                q[axis] = self.light[axis] + sign * away;
                q[1 - axis] = self.light[1 - axis] + row;
                self.near(q)
            };
            let next = if off > 0.0 { 1 } else { -1 };
            let (here, beside) = (at(row), at(row + next));
            if here == 0.0 {
                continue;
            }
            let apart = (here - beside).abs();
            let other = at(row - next);
            let bent = other > 0.0 && (2.0 * here - beside - other).abs() > 0.25 * apart;
            let seen = if beside == 0.0 {
                here - if other > 0.0 { (here - other).abs() } else { 0.0 }
            } else if apart > 0.02 * here && bent {
                here
            } else {
                here + (beside - here) * off.abs() as f64 - apart
            };
            let slope_there = (seen - self.light_depth) / away as f64;
            let mut delta = (1.0 + (slope - slope_there) * scale).abs();
            if i >= samples - 8 {
                delta += 0.75 * (i - (samples - 8) + 1) as f64 / 9.0;
            }
            let least = if i < 4 { &mut hard } else { &mut soft[i as usize & 3] };
            *least = least.min(delta);
        }
        let cut = |x: f64| (4.0 * x - 3.0).clamp(0.0, 1.0);
        cut(hard).min(soft.map(cut).iter().sum::<f64>() / 4.0)
    }
}

/// Lines, wedges and shared memory change nothing: the sweep is what a loop over each pixel's samples finds. The pixel's line leads
/// to the light.
#[test]
fn the_sweep_is_a_loop_over_its_samples() {
    let view = camera(Vec3::new(0.5, 2.5, 7.0), Vec3::new(0.0, 0.6, 0.0));
    let mut shadowed = 0;
    for size in [[157, 91], [64, 120]] {
        let (mut r, mut s) = start(scene(vec![mesh(&yard(), 0)], vec![material(Vec3::ONE)], view, lamp(Vec3::Y)), size);
        for (what, light) in lights(view) {
            s.light = light;
            for samples in [60, 16, 200] {
                let set = format!("contact_pixels={samples}");
                let found = contact(&mut r, &mut s, "rt-hard", &["contact=sweep", &set]);
                let (mask, position) = (r.read_mask().unwrap(), r.read_position().unwrap());
                let (cut, _) = Sweep::new(&view, &light, size);
                let near = position.iter().map(|p| if p[3] > 0.0 { 1.0 / p[3] as f64 } else { 0.0 }).collect();
                let by_hand = Loop {
                    size: size.map(|s| s as i32),
                    near,
                    light: cut.light,
                    light_depth: cut.light_depth as f64,
                    towards: cut.towards,
                };
                let mut facing = 0;
                for (i, v) in found.iter().enumerate() {
                    let p = [i as i32 % size[0] as i32, i as i32 / size[0] as i32];
                    let expected = if mask[i] == FACING { by_hand.visibility(p, samples) } else { 1.0 };
                    facing += (mask[i] == FACING) as usize;
                    shadowed += (expected < 0.5) as usize;
                    let off = (*v as f64 - expected).abs();
                    assert!(off < 1.0 / 255.0, "{what}, {samples} samples, {size:?}: {v} for {expected} at {p:?}");
                }
                assert!(facing > 500 || what.starts_with("sun level"), "{what}: {facing} pixels");
            }
        }
    }
    assert!(shadowed > 1000, "{shadowed}");
}

/// The light's place in the picture lies where the ray of each pixel to the light leads, and on the side that it leads to.
#[test]
fn rays_run_towards_the_lights_place() {
    let view = camera(Vec3::new(0.5, 2.5, 7.0), Vec3::new(0.0, 0.6, 0.0));
    let size = [640u32, 400];
    let [x, y, corner] = view.rays(size);
    let rays = glam::DMat3::from_cols(x, y, corner);
    let seen = |p: glam::DVec3| {
        let q = rays.inverse() * (p - view.position.as_dvec3());
        (q.truncate() / q.z, q.z)
    };
    for (what, light) in lights(view) {
        let (cut, [bands, lines]) = Sweep::new(&view, &light, size);
        assert!(bands > 0 && lines > 0, "{what}");
        let is_sun = matches!(light, Light::Directional { .. });
        for at in [[10.5, 20.5], [320.5, 333.5], [600.5, 100.5]] {
            let from = view.position.as_dvec3() + rays * glam::DVec3::new(at[0], at[1], 1.0) * 6.0;
            let to_light = if is_sun { light.position().as_dvec3() } else { light.position().as_dvec3() - from };
            let (start, _) = seen(from);
            let (end, depth) = seen(from + to_light * (0.02 / to_light.length()));
            assert!(depth > 0.0);
            let went = (end - start).normalize();
            let place = glam::DVec2::new(cut.light[0] as f64 + 0.5, cut.light[1] as f64 + 0.5);
            let towards = (place - start).normalize() * cut.towards as f64;
            // The light's place is that of its pixel's middle.
            let spare = 1.0 / (place - start).length() + 1e-3;
            assert!((went - towards).length() < spare, "{what}: {went} and {towards} at {at:?}");
        }
    }
}

/// A floor with nothing on it stays lit whatever grazes it, and the technique's visibility stays as it was.
#[test]
fn a_floor_alone_is_untouched() {
    let plane = floor(Vec2::splat(-12.0), Vec2::splat(12.0), 0.0);
    let view = camera(Vec3::new(0.0, 2.0, 9.0), Vec3::new(0.0, 0.5, 0.0));
    let low = camera(Vec3::new(3.0, 0.4, 9.0), Vec3::new(0.0, 0.2, 0.0));
    let mut places: Vec<(&str, Camera, Light)> = awkward_spots();
    for (name, light) in lights(view) {
        places.extend([(name, view, light), (name, low, light)]);
    }
    for elevation in [2.0f32, 6.0, 15.0] {
        let (sin, cos) = elevation.to_radians().sin_cos();
        for turn in 0..6 {
            let (x, z) = (turn as f32 + 0.2).sin_cos();
            places.extend([view, low].map(|v| ("grazing sun", v, sun(Vec3::new(x * cos, sin, z * cos)))));
        }
    }
    let (mut r, mut s) =
        start(scene(vec![mesh(&plane, 0)], vec![material(Vec3::ONE)], view, lamp(Vec3::Y)), [150, 100]);
    for (what, camera, light) in places {
        (s.camera, s.light) = (camera, light);
        for mode in MODES {
            for sets in [vec![], vec!["contact_pixels=256", "contact_steps=64", "contact_jitter=ign"]] {
                let set = format!("contact={mode}");
                let sets = [vec![set.as_str()], sets].concat();
                let found = contact(&mut r, &mut s, "rt-hard", &sets);
                let dark = found.iter().filter(|v| **v < 1.0).count();
                if dark > 0 {
                    panic!(
                        "{dark} dark: {what}, {light:?} {camera:?} {sets:?} {:?}",
                        found
                            .iter()
                            .enumerate()
                            .filter(|(_, v)| **v < 1.0)
                            .take(6)
                            .map(|(i, v)| (i % 150, i / 150, *v))
                            .collect::<Vec<_>>()
                    );
                }
            }
        }
    }
}

/// A box, thin as a wall, that rests on a floor: a bias that is thicker tears its shadow from it.
fn resting(size: [u32; 2]) -> (Renderer, Setup) {
    let view = camera(Vec3::new(1.0, 1.2, 1.4), Vec3::new(0.1, 0.1, 0.0));
    let mut triangles = floor(Vec2::splat(-3.0), Vec2::splat(3.0), 0.0);
    let (low, high) = (Vec3::new(-0.03, 0.0, -0.4), Vec3::new(0.03, 0.25, 0.4));
    let p = |i: usize| Vec3::from_array([0, 1, 2].map(|a| if i >> a & 1 == 1 { high[a] } else { low[a] }));
    let faces = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    triangles.extend(faces.iter().flat_map(|f| [[p(f[0]), p(f[1]), p(f[2])], [p(f[0]), p(f[2]), p(f[3])]]));
    start(scene(vec![mesh(&triangles, 0)], vec![material(Vec3::ONE)], view, sun(Vec3::new(-1.0, 1.2, 0.3))), size)
}

/// Most of the gap that a bias of 25 cm leaves at a box's foot is closed, and hardly anything that should be lit is darkened.
#[test]
fn a_resting_box_gets_its_shadow_back() {
    let (mut r, mut s) = resting([160, 120]);
    let biased = ["resolution=1024", "bias=0.25"];
    select(&mut s, "shadow-map", &biased);
    let alone = accuracy(&mut r, &s, 0).unwrap();
    assert!(alone.detachment_share > 0.01, "{}", alone.detachment_share);
    assert_eq!((alone.contact_hits, alone.contact_detached), (None, None));
    for mode in MODES {
        let mode = format!("contact={mode}");
        select(
            &mut s,
            "shadow-map",
            &[&biased[..], &[mode.as_str(), "contact_length=0.3", "contact_tau=0.03"]].concat(),
        );
        let with = accuracy(&mut r, &s, 0).unwrap();
        let (detached, repaired) = (with.contact_detached.unwrap(), with.contact_repaired.unwrap());
        let told = || format!("{mode}: {with:#?}");
        // What was detached without them is told the same way.
        let before = alone.detachment_share * alone.facing as f64;
        assert_eq!(before.round() as u64, detached, "{}", told());
        assert!(repaired as f64 > 0.8 * detached as f64, "{}", told());
        assert!(with.detachment_share < 0.2 * alone.detachment_share, "{}", told());
        let (hits, right) = (with.contact_hits.unwrap(), with.contact_right.unwrap());
        assert!(right as f64 > 0.8 * hits as f64, "{}", told());
        let wrong = |r: &measure::Record| (r.lit_incorrect + r.shadow_incorrect) as i64;
        let gained = with.contact_gained.unwrap() as i64 - with.contact_lost.unwrap() as i64;
        assert!((wrong(&alone) - wrong(&with) - gained).abs() <= 1, "{}", told());
    }
}

/// The lower of the technique's visibility and the contact shadows' is taken, bit for bit; what does not face the light keeps
/// the technique's.
#[test]
fn the_lower_visibility_is_taken() {
    let (mut r, mut s) = resting([120, 90]);
    for technique in ["shadow-map", "pcf", "rt-hard"] {
        let alone = visibility(&mut r, &mut s, technique, &[]);
        let mask = r.read_mask().unwrap();
        for mode in MODES {
            let mode = format!("contact={mode}");
            let seen = contact(&mut r, &mut s, technique, &[&mode, "contact_fade=0"]);
            let both = visibility(&mut r, &mut s, technique, &[&mode, "contact_fade=0"]);
            assert!(seen.iter().any(|v| *v < 0.5), "{technique} {mode}");
            for i in 0..both.len() {
                assert_eq!(both[i], alone[i].min(seen[i]), "{technique} {mode}");
                assert!(mask[i] == FACING || seen[i] == 1.0, "{technique} {mode}");
            }
        }
    }
}

/// A board over the floor that the picture cuts off casts nothing into it; once it is in the picture it does.
#[test]
fn nothing_outside_the_picture_counts() {
    let view = camera(Vec3::new(0.0, 2.0, 4.0), Vec3::ZERO);
    let mut triangles = floor(Vec2::splat(-8.0), Vec2::splat(8.0), 0.0);
    triangles.extend(floor(Vec2::new(-4.0, -2.9), Vec2::new(4.0, -2.2), 0.4));
    let light = sun(Vec3::new(0.0, 1.0, -1.0));
    let (mut r, mut s) = start(scene(vec![mesh(&triangles, 0)], vec![material(Vec3::ONE)], view, light), [120, 90]);
    for (fov, sees) in [(24.0, false), (70.0, true)] {
        s.camera.fov = fov;
        for mode in MODES {
            let mode = format!("contact={mode}");
            let sets = [&mode, "contact_length=3", "contact_pixels=256", "contact_steps=64", "contact_depth=3"];
            let sets = [&sets[..], &["contact_tau=0.05"]].concat();
            let dark = contact(&mut r, &mut s, "shadow-map", &sets).iter().filter(|v| **v < 0.5).count();
            assert_eq!(dark > 0, sees, "{mode} at {fov}°: {dark} dark pixels");
        }
    }
}

/// Off they leave no trace: neither in the picture nor among the passes, whatever else of them is set, and after they were on.
#[test]
fn off_changes_nothing() {
    let (mut r, mut s) = built_in("st-contact", [160, 90]);
    s.legend = false;
    let drawn = |r: &mut Renderer, s: &mut Setup, sets: &[&str]| {
        select(s, "shadow-map", sets);
        let told = r.render(s, Ask { timed: true, ..ask(s) }).unwrap();
        r.collect_times(true).unwrap();
        let passes: Vec<&str> = r.timer.latest.iter().map(|p| p.0).collect();
        (r.read_picture().unwrap(), r.read_visibility().unwrap(), passes, told.gpu_bytes)
    };
    // The truth is traced once.
    drawn(&mut r, &mut s, &[]);
    let before = drawn(&mut r, &mut s, &[]);
    for mode in MODES {
        let on = drawn(&mut r, &mut s, &[&format!("contact={mode}")]);
        assert_eq!(on.2.iter().filter(|p| **p == "contact shadows").count(), 1, "{:?}", on.2);
        assert!(on.0 != before.0 && on.3 > before.3);
        let off = drawn(&mut r, &mut s, &["contact=off", "contact_length=2", "contact_pixels=99"]);
        assert!(off == before);
    }
    assert!(!measure::params_text(&s).contains("contact"));
    s.params.get_mut("shadow-map").unwrap().retain(|name, _| !name.starts_with("contact"));
    r.render(&s, ask(&s)).unwrap();
    assert_eq!(r.read_picture().unwrap(), before.0, "a set-up of before there were contact shadows");
}

/// Each mode draws the same on a device that has drawn other things before.
#[test]
fn captures_repeat() {
    let (mut r, mut s) = built_in("st-contact", [200, 120]);
    for mode in MODES {
        let sets = [&format!("contact={mode}"), "contact_jitter=ign"];
        let first = visibility(&mut r, &mut s, "shadow-map", &sets);
        visibility(&mut r, &mut s, "pcf", &["contact=sweep"]);
        assert_eq!(visibility(&mut r, &mut s, "shadow-map", &sets), first, "{mode}");
        let (mut other, mut t) = built_in("st-contact", [200, 120]);
        assert_eq!(visibility(&mut other, &mut t, "shadow-map", &sets), first, "{mode}");
    }
}

/// Of several lights each has contact shadows of its own: which one is at work changes nothing in the picture.
#[test]
fn every_light_has_them() {
    let (mut r, mut s) = resting([100, 75]);
    let (a, b) = (s.light, sun(Vec3::new(1.0, 0.9, 0.6)));
    let mut pictures = Vec::new();
    for contact in ["off", "march", "sweep"] {
        select(&mut s, "shadow-map", &["bias=0.25", &format!("contact={contact}")]);
        let mut both = Vec::new();
        for (own, other, number) in [(a, b, 1), (b, a, 2)] {
            s.light = own;
            s.light_number = number;
            s.more_lights = vec![shadowscope::setup::Lamp { on: true, light: other }];
            r.render(&s, ask(&s)).unwrap();
            both.push(r.read_picture().unwrap());
        }
        let far = both[0].iter().zip(&both[1]).map(|(a, b)| a.abs_diff(*b)).max().unwrap();
        assert!(far <= 2, "{contact}: {far}");
        pictures.push(both.swap_remove(0));
    }
    assert!(pictures[0] != pictures[1] && pictures[0] != pictures[2]);
}

/// They are a set of parameters beside the technique's own: on the command line, in files, in sides of a comparison, in sweeps.
#[test]
fn set_ups_hold_them() {
    let (mut r, mut s) = resting([90, 60]);
    let (_, view) = (s.view.clone(), "contact-gain");
    s.view = view.into();
    let refused = s.check().unwrap_err().to_string();
    assert_eq!(refused, "view = contact-gain needs contact = march or contact = sweep");
    s.view = "shaded".into();
    s.set("contact=march", &["shadow-map".into()]).unwrap();
    s.set("contact_length=0.4", &["shadow-map".into()]).unwrap();
    let told = measure::params_text(&s);
    assert!(told.contains("contact=march;") && told.contains("contact_length=0.4") && !told.contains("contact_pixels"));
    s.view = view.into();
    s.check().unwrap();
    let side = Side::parse("shadow-map:contact=sweep;contact_pixels=32").unwrap();
    assert_eq!(side.params["contact_pixels"], Value::Int(32));
    s.view = "shaded".into();
    s.against = vec![side];
    r.draw(&s, ask(&s)).unwrap();
    s.against.clear();
    let axes = ["contact=off,march,sweep", "contact_length=0.1,0.2"].map(|a| measure::Axis::parse(a).unwrap());
    let all = measure::expand(&s, &["shadow-map".into()], &axes, false).unwrap();
    // The length means something to the march alone.
    assert_eq!(all.len(), 4, "{:?}", all.iter().map(measure::params_text).collect::<Vec<_>>());
}

/// Every view of theirs shows something, and the masks what they are named after.
#[test]
fn their_views_show_hits_and_gains() {
    let (mut r, mut s) = resting([120, 90]);
    for mode in MODES {
        select(&mut s, "shadow-map", &["bias=0.25", &format!("contact={mode}")]);
        for view in ["contact-visibility", "contact-distance", "contact-hits", "contact-gain"] {
            s.view = view.into();
            r.render(&s, ask(&s)).unwrap();
            let picture = r.read_picture().unwrap();
            assert!(picture.chunks(4).any(|p| p != &picture[..4]), "{mode} {view}");
            let map = r.read_map().unwrap();
            let (mask, hard) = (r.read_mask().unwrap(), r.read_hard_truth().unwrap());
            assert!(map.iter().all(|v| v.is_finite()));
            if view == "contact-distance" {
                let most = map.iter().fold(0f32, |a, b| a.max(*b));
                assert!(most > 1.0 && most < 150.0, "{mode}: {most} pixels");
            }
            if view == "contact-hits" {
                // Green where the light is truly hidden.
                let hits = (0..map.len()).filter(|i| mask[*i] == FACING && map[*i] as u32 & 1 == 1);
                let mut counts = [0, 0];
                for i in hits {
                    let green = picture[4 * i + 1] > picture[4 * i];
                    counts[green as usize] += 1;
                    assert_eq!(green, hard[i] < 0.5, "{mode} {i}");
                }
                assert!(counts[1] > 10 * counts[0].max(1), "{mode}: {counts:?}");
            }
        }
        s.view = "shaded".into();
    }
}
