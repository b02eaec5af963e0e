//! Conservative maps against what triangles cover exactly, and the answers that they are certain of against rays.

use crate::common::*;
use crate::edges::box_of;
use glam::{DVec2, DVec3, DVec4, Vec2, Vec3, vec3};
use shadowscope::frame::{Ask, MapLayer, Renderer};
use shadowscope::light::Light;
use shadowscope::measure;
use shadowscope::setup::Setup;
use std::ops::{Add, Mul, Sub};

const ID: &str = "csm-conservative";

/// A floor that nothing lies below, with what stands over it, seen from above.
fn over_a_floor(casters: &[[Vec3; 3]], light: Light) -> (Renderer, Setup) {
    let mut all = floor(Vec2::splat(-6.0), Vec2::splat(6.0), 0.0);
    all.extend(casters);
    let view = camera(vec3(0.0, 9.0, 7.0), Vec3::ZERO);
    start(scene(vec![mesh(&all, 0)], vec![material(Vec3::ONE)], view, light), [160, 120])
}

/// Triangles of all sizes and directions.
fn litter(count: usize, size: f32) -> Vec<[Vec3; 3]> {
    let mut random = Random(7);
    (0..count)
        .map(|_| {
            let p = random.point() * vec3(4.0, 0.8, 4.0) + Vec3::Y * 1.5;
            let long = if random.next() < 0.2 { 8.0 } else { 1.0 };
            [p, p + random.point() * size * long, p + random.point() * size]
        })
        .collect()
}

/// A closed ball of triangles.
fn ball(center: Vec3, radius: f32, rings: usize) -> Vec<[Vec3; 3]> {
    use std::f32::consts::PI;
    let at = |i: usize, k: usize| {
        let (a, b) = (PI * i as f32 / rings as f32, PI * (k % (2 * rings)) as f32 / rings as f32);
        let ring = if i == 0 || i == rings { 0.0 } else { a.sin() };
        center + radius * vec3(ring * b.cos(), a.cos(), ring * b.sin())
    };
    let quads = (0..rings).flat_map(|i| (0..2 * rings).map(move |k| (i, k)));
    let all = quads
        .flat_map(|(i, k)| [[at(i, k), at(i, k + 1), at(i + 1, k + 1)], [at(i, k), at(i + 1, k + 1), at(i + 1, k)]]);
    all.filter(|t| (t[1] - t[0]).cross(t[2] - t[0]).length() > 1e-6).collect()
}

/// A sheet with hills, over so many squares along each side.
fn hills(n: usize) -> Vec<[Vec3; 3]> {
    let at = |i: usize, k: usize| {
        let [x, z] = [i, k].map(|j| 6.0 * (j as f32 / n as f32 - 0.5));
        vec3(x, 1.2 + 0.5 * (2.0 * x).sin() * (1.7 * z).cos(), z)
    };
    let quads = (0..n).flat_map(|i| (0..n).map(move |k| (i, k)));
    quads
        .flat_map(|(i, k)| {
            let [a, b, c, d] = [at(i, k), at(i, k + 1), at(i + 1, k + 1), at(i + 1, k)];
            [[a, b, c], [a, c, d]]
        })
        .collect()
}

/// Draws the maps and reads those of a face: the grown ones together, and the shrunk one.
fn maps(r: &mut Renderer, s: &mut Setup, sets: &[&str], face: u32) -> [MapLayer; 2] {
    select(s, ID, &[&["resolution=64", "fit=scene"], sets].concat());
    let [mut closed, others, shrunk] = ["grown-map", "grown-others", "shrunk-map"].map(|view| {
        s.view = view.into();
        r.render(s, Ask { analysis: true, ..ask(s) }).unwrap();
        r.read_layer(face).unwrap().unwrap()
    });
    closed.depth.iter_mut().zip(&others.depth).for_each(|(c, o)| *c = c.max(*o));
    [closed, shrunk]
}

/// The cube's face below the lamp, or the only view.
fn below(light: &Light) -> u32 {
    if matches!(light, Light::Omni { .. }) { 3 } else { 0 }
}

/// What of a triangle lies before the light, in the map: texels, and stored depth.
fn in_map(map: &MapLayer, t: &[Vec3; 3]) -> Vec<DVec3> {
    let v = map.view;
    let rows = [v.row_x, v.row_y, v.row_z, v.row_w].map(|row| row.as_dvec4());
    let corners = t.map(|p| DVec4::from_array(rows.map(|row| row.dot(p.as_dvec3().extend(1.0)))));
    let half = 0.5 * map.side as f64;
    let before = |p: &DVec4| p.w - if v.perspective == 1 { 1e-3 * v.near as f64 } else { 0.0 };
    let placed = |p: DVec4| DVec3::new(half * (1.0 + p.x / p.w), half * (1.0 - p.y / p.w), p.z / p.w);
    cut(&corners, before).into_iter().map(placed).collect()
}

/// What of a polygon lies where this is positive (Sutherland, Hodgman 1974).
fn cut<P: Copy + Sub<Output = P> + Add<Output = P> + Mul<f64, Output = P>>(
    all: &[P],
    inside: impl Fn(&P) -> f64,
) -> Vec<P> {
    let mut kept = Vec::new();
    for i in 0..all.len() {
        let (p, q) = (all[i], all[(i + 1) % all.len()]);
        let (d, e) = (inside(&p), inside(&q));
        if d >= 0.0 {
            kept.push(p);
        }
        if (d >= 0.0) != (e >= 0.0) {
            kept.push(p + (q - p) * (d / (d - e)));
        }
    }
    kept
}

/// What a polygon covers of a square, with its depths.
fn clipped(t: &[DVec3], low: DVec2, high: DVec2) -> Vec<DVec3> {
    let sides = [(0, low.x, 1.0), (0, high.x, -1.0), (1, low.y, 1.0), (1, high.y, -1.0)];
    sides.into_iter().fold(t.to_vec(), |polygon, (axis, at, sign)| cut(&polygon, |p| sign * (p[axis] - at)))
}

fn area(polygon: &[DVec3]) -> f64 {
    let crossed = |i: usize| polygon[i].truncate().perp_dot(polygon[(i + 1) % polygon.len()].truncate());
    (0..polygon.len()).map(crossed).sum::<f64>().abs() / 2.0
}

fn square(i: usize, side: usize) -> [DVec2; 2] {
    let low = DVec2::new((i % side) as f64, (i / side) as f64);
    [low, low + 1.0]
}

fn lights() -> [Light; 4] {
    let above = lamp(vec3(0.4, 5.0, 0.3));
    [sun(vec3(0.3, 1.0, 0.2)), sun(vec3(0.9, 0.5, -0.4)), spot(vec3(1.0, 8.0, 2.0), Vec3::ZERO, 42.0), above]
}

/// Each texel that a caster touches holds at least the nearest depth it has there; and no texel two away from all of them holds
/// any.
#[test]
fn grown_casters_cover_all_that_they_touch() {
    let casters = litter(60, 0.5);
    for light in lights() {
        let (mut r, mut s) = over_a_floor(&casters, light);
        for shift in ["worst", "tight"] {
            let [grown, _] = maps(&mut r, &mut s, &[&format!("shift={shift}"), "casters=both"], below(&light));
            let side = grown.side as usize;
            let placed: Vec<_> = casters.iter().map(|t| in_map(&grown, t)).collect();
            let (mut touched, mut beside) = (0, 0);
            for (i, depth) in grown.depth.iter().enumerate() {
                let [low, high] = square(i, side);
                let nearest = placed.iter().flat_map(|t| clipped(t, low, high)).map(|p| p.z).fold(0.0, f64::max);
                assert!(*depth as f64 >= nearest.min(1.0) - 1e-6, "{light:?} {shift} {i}: {depth} {nearest}");
                touched += (nearest > 0.0) as usize;
                let near = placed.iter().any(|t| !clipped(t, low - 2.0, high + 2.0).is_empty());
                assert!(near || *depth == 0.0, "{light:?} {shift} {i}");
                beside += (nearest == 0.0 && *depth > 0.0) as usize;
            }
            println!("{} {shift}: {touched} touched, {beside} more", light.kind());
            assert!(touched > 100 && beside < 2 * touched);
        }
    }
}

/// A texel holds a shrunk caster only where casters cover all of it, and at most the farthest depth that these have there.
#[test]
fn shrunk_casters_cover_all_of_a_texel() {
    for (casters, fewest) in [(litter(60, 1.5), [20, 20, 20]), (hills(9), [5, 100, 200])] {
        for light in lights() {
            let (mut r, mut s) = over_a_floor(&casters, light);
            let mut counts = [0; 3];
            for (mode, count) in ["none", "adjacency", "fan"].into_iter().zip(&mut counts) {
                let [grown, shrunk] = maps(&mut r, &mut s, &[&format!("mode={mode}")], below(&light));
                let placed: Vec<_> = casters.iter().map(|t| in_map(&shrunk, t)).collect();
                for (i, depth) in shrunk.depth.iter().enumerate().filter(|(_, d)| **d > 0.0) {
                    let [low, high] = square(i, shrunk.side as usize);
                    // What is nearer than the map says is no part of it.
                    let parts = placed.iter().map(|t| clipped(t, low, high));
                    let covering = |p: &Vec<DVec3>| p.iter().all(|p| p.z >= *depth as f64 - 1e-6);
                    let whole: f64 = parts.filter(covering).map(|p| area(&p)).sum();
                    assert!(whole > 1.0 - 1e-6, "{light:?} {mode} {i}: {whole}");
                    assert!(grown.depth[i] >= *depth, "{light:?} {mode} {i}");
                    *count += 1;
                }
            }
            println!("{}: {counts:?}", light.kind());
            assert!(counts.iter().zip(fewest).all(|(c, f)| *c >= f) && counts.is_sorted(), "{light:?} {counts:?}");
        }
    }
}

/// What the maps are certain of is right: the grown one where it says lit, the shrunk one where it says shadowed, and both with rays
/// everywhere, whatever the shift and mode.
#[test]
fn certain_answers_are_right() {
    let open = |light| over_a_floor(&[litter(80, 0.4), hills(12)].concat(), light);
    let closed = box_of(vec3(-2.0, 0.0, -1.0), vec3(-1.0, 1.3, 0.2));
    let closed = [closed, ball(vec3(1.0, 0.9, 0.5), 0.9, 10), ball(vec3(2.2, 0.2, -1.6), 0.3, 24)].concat();
    let mut scenes: Vec<_> = lights().map(open).into();
    scenes.extend(lights()[1..3].iter().map(|light| over_a_floor(&closed, *light)));
    scenes.extend(["st-wire", "st-foliage", "st-contact", "bench"].map(|name| built_in(name, [160, 90])));
    right(&mut scenes);
}

fn right(scenes: &mut [(Renderer, Setup)]) {
    for (r, s) in scenes {
        let mut rays = Vec::new();
        for sets in [["mode=none", "shift=worst"], ["mode=adjacency", "shift=tight"], ["mode=fan", "shift=tight"]] {
            for resolution in ["resolution=128", "resolution=512"] {
                let what = format!("{} {:?} {sets:?} {resolution}", s.scene, s.light);
                let sets = [&sets[..], &[resolution]].concat();
                let of = |more: &[&'static str]| [&sets[..], more].concat();
                let both = errors(r, s, ID, &of(&[]));
                assert_eq!(both.lit_incorrect + both.shadow_incorrect, 0, "{what}: {both:?}");
                let grown = errors(r, s, ID, &of(&["rays=false"]));
                let shrunk = errors(r, s, ID, &of(&["rays=false", "uses=shrunk"]));
                assert_eq!((grown.lit_incorrect, shrunk.shadow_incorrect), (0, 0), "{what}: {grown:?} {shrunk:?}");
                assert!(grown.facing > 1000 && grown.shadow_correct > 0, "{what}: {grown:?}");
                let uncertain = grown.shadow_incorrect + shrunk.lit_incorrect;
                rays.push((uncertain, both.facing));
            }
        }
        println!("{} {}: {rays:?}", s.scene, s.light.kind());
        // Fewer are uncertain with neighbours, fewer again with fans, and in a finer map.
        assert!(rays[0].0 >= rays[2].0 && rays[2].0 >= rays[4].0 && rays[2].0 > rays[3].0, "{} {rays:?}", s.scene);
    }
}

/// The same in the midst of casters: on all sides of the lamp, across its planes, and nearer to it than its maps begin.
#[test]
fn certain_answers_around_a_lamp_are_right() {
    let at = vec3(0.3, 1.6, 0.4);
    let half =
        Light::Hemisphere { position: at, direction: vec3(0.3, -1.0, 0.2), range: 60.0, color: Vec3::splat(20.0) };
    let close = [[vec3(0.28, 1.57, 0.38), vec3(0.34, 1.58, 0.39), vec3(0.3, 1.56, 0.45)]];
    let room = box_of(vec3(-5.0, -0.5, -5.0), vec3(5.0, 4.0, 5.0));
    let bodies = [box_of(vec3(-2.0, 0.0, -1.0), vec3(-1.0, 1.3, 0.2)), ball(vec3(1.5, 1.5, 0.9), 0.6, 10)].concat();
    let mut scenes = vec![
        over_a_floor(&[&litter(120, 0.3)[..], &close].concat(), lamp(at)),
        over_a_floor(&[hills(12), bodies.clone()].concat(), half),
    ];
    let (r, mut s) = over_a_floor(&[room, bodies].concat(), lamp(at));
    s.camera = camera(vec3(0.0, 3.0, 4.5), vec3(0.0, 1.0, 0.0));
    scenes.push((r, s));
    let (r, mut s) = built_in("st-foliage", [160, 90]);
    s.light = lamp(s.camera.target + vec3(0.2, 1.5, 0.1));
    scenes.push((r, s));
    right(&mut scenes);
}

/// The record tells as many rays as there are uncertain pixels, and the view as many of each kind; the shrunk map never shadows what
/// the grown one leaves lit.
#[test]
fn rays_are_counted() {
    let (mut r, mut s) = over_a_floor(&ball(vec3(0.0, 1.0, 0.0), 1.0, 12), lights()[1]);
    let grown = errors(&mut r, &mut s, ID, &["resolution=128", "rays=false"]);
    let shrunk = errors(&mut r, &mut s, ID, &["resolution=128", "rays=false", "uses=shrunk"]);
    select(&mut s, ID, &["resolution=128"]);
    let record = measure::accuracy(&mut r, &s, 0).unwrap();
    let uncertain = grown.shadow_incorrect + shrunk.lit_incorrect;
    assert!(uncertain > 100 && record.rays as usize == uncertain, "{} {uncertain}", record.rays);
    s.view = "certainty".into();
    r.render(&s, ask(&s)).unwrap();
    let mut classes = [0; 9];
    r.read_map().unwrap().iter().filter(|x| **x >= 0.0).for_each(|x| classes[*x as usize & 15] += 1);
    assert_eq!([classes[0], classes[2], classes[4]], [0, grown.shadow_incorrect, shrunk.lit_incorrect]);
    assert_eq!([classes[1], classes[7]], [grown.lit_correct, shrunk.shadow_correct]);
    // The stored depth ends rays early; without it they decide the same.
    let far = errors(&mut r, &mut s, ID, &["resolution=128", "eta=4", "safe_depth=false"]);
    assert_eq!(far.lit_correct + far.shadow_correct, grown.facing, "{far:?}");
}

/// Centres of texels that agree are no proof: thin wires are lost where all of them miss. Conservative maps lose none.
#[test]
fn agreement_loses_wires() {
    let (mut r, mut s) = built_in("st-wire", [160, 120]);
    let all = |e: &shadowscope::measure::Errors| e.lit_incorrect + e.shadow_incorrect;
    let mut wrong = Vec::new();
    for window in ["window=2", "window=4", "window=7"] {
        let e = errors(&mut r, &mut s, "hybrid-pcf", &["resolution=1024", window]);
        wrong.push(all(&e));
    }
    let e = errors(&mut r, &mut s, ID, &["resolution=1024"]);
    println!("wrong of {}: {wrong:?}, conservative {}", e.facing, all(&e));
    assert!(wrong[0] > 50 && wrong[0] >= wrong[1] && wrong[1] >= wrong[2] && all(&e) == 0, "{wrong:?} {e:?}");
}

/// Rays put right what disagrees, so that the hybrid errs less than the map, and less the wider its window.
#[test]
fn agreement_and_rays_err_less_than_the_map() {
    for light in lights() {
        let (mut r, mut s) = over_a_floor(&[ball(vec3(0.0, 1.0, 0.0), 1.0, 12), litter(20, 1.0)].concat(), light);
        let mut wrong = |technique: &str, sets: &[&str]| {
            let e = errors(&mut r, &mut s, technique, &[&["resolution=256"], sets].concat());
            e.lit_incorrect + e.shadow_incorrect
        };
        let plain = if below(&light) > 0 { "cube" } else { "shadow-map" };
        let (map, two, five) = (wrong(plain, &[]), wrong("hybrid-pcf", &[]), wrong("hybrid-pcf", &["window=5"]));
        println!("{}: {map} {two} {five}", light.kind());
        assert!(map > 50 && 3 * two < map && five <= two, "{light:?}: {map} {two} {five}");
    }
}

/// A room whose walls show the lamp inside their fronts, and a camera inside a closed body: neither body's backs alone will do.
#[test]
fn bodies_around_lamp_or_eye_are_not_closed() {
    let mut room = box_of(vec3(-4.0, 0.0, -4.0), vec3(4.0, 3.0, 4.0));
    let outward = room.clone();
    room.iter_mut().for_each(|t| t.swap(1, 2));
    let ground = floor(Vec2::splat(-20.0), Vec2::splat(20.0), -0.5);
    let within = spot(vec3(0.0, 2.5, 0.0), vec3(3.0, 0.0, 1.0), 70.0);
    let outside = camera(vec3(9.0, 4.0, 9.0), vec3(4.0, 0.0, 3.0));
    let inside = camera(vec3(-3.0, 2.0, -3.0), vec3(3.0, 0.5, 3.0));
    for (walls, view, light) in [
        (&room, outside, within),
        (&outward, outside, within),
        (&room, inside, sun(vec3(0.4, 1.0, 0.3))),
        (&outward, inside, sun(vec3(0.4, 1.0, 0.3))),
        (&outward, inside, lamp(vec3(1.0, 2.0, 0.5))),
    ] {
        let triangles = [&ground[..], walls].concat();
        let whole = scene(vec![mesh(&triangles, 0)], vec![material(Vec3::ONE)], view, light);
        let (mut r, mut s) = start(whole, [96, 72]);
        for mode in ["mode=none", "mode=adjacency", "mode=fan"] {
            select(&mut s, ID, &["resolution=256", mode]);
            let e = measure::errors(&mut r, &s).unwrap();
            assert!(e.share() == 0.0 && e.facing > 300, "{mode} {light:?} {:?}: {e:?}", view.position);
        }
    }
}

/// Cast by one side alone, open surfaces lose shadows, and a note says of how many triangles; closed bodies lose none.
#[test]
fn one_sided_casters_need_closed_bodies() {
    let body = box_of(vec3(-3.0, 0.2, -1.0), vec3(-1.0, 1.3, 0.5));
    let card = floor(Vec2::splat(0.5), Vec2::splat(2.0), 1.5);
    let turned: Vec<_> = card.iter().map(|[a, b, c]| [*a, *c, *b]).collect();
    let ground = box_of(vec3(-6.0, -1.0, -6.0), vec3(6.0, 0.0, 6.0));
    for light in lights() {
        for (open, casters) in
            [(vec![], ["back", "front"]), (card.clone(), ["back", "auto"]), (turned.clone(), ["front", "both"])]
        {
            let triangles = [&ground[..], &body, &open].concat();
            let view = camera(vec3(0.0, 9.0, 7.0), Vec3::ZERO);
            let (mut r, mut s) =
                start(scene(vec![mesh(&triangles, 0)], vec![material(Vec3::ONE)], view, light), [160, 120]);
            for (k, casters) in casters.into_iter().enumerate() {
                let e = errors(&mut r, &mut s, ID, &["resolution=128", &format!("casters={casters}")]);
                let notes = r.notes().unwrap().join(" ");
                let what = format!("{} {casters} {open:?}: {notes} {e:?}", light.kind());
                if open.is_empty() || k == 1 {
                    assert!(notes.is_empty() && e.lit_incorrect == 0, "{what}");
                } else {
                    assert!(notes.starts_with("2 triangles") && notes.contains(casters), "{what}");
                    assert!(e.lit_incorrect > 100, "{what}");
                }
            }
        }
    }
}
