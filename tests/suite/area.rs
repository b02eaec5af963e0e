//! Maps from many places of a light with a size.

use crate::common::*;
use crate::denoise::{in_the_yard, sun_at};
use glam::Vec3;
use shadowscope::frame::{Ask, History, Renderer, Truth};
use shadowscope::light::Light;
use shadowscope::measure::metrics::FACING;
use shadowscope::setup::Setup;

pub fn rectangle() -> Light {
    Light::RectArea {
        center: Vec3::new(-1.0, 5.0, 2.5),
        half_u: Vec3::new(0.5, 0.0, 0.0),
        half_v: Vec3::new(0.0, 0.2, 0.4),
        range: 40.0,
        color: Vec3::ONE,
    }
}

pub fn pick(s: &mut Setup, id: &str, resolution: u32, sets: &[&str]) {
    let sets: Vec<String> = sets.iter().map(|set| set.to_string()).collect();
    choose(s, shadowscope::techniques::find(id).unwrap(), resolution, &sets);
}

/// Root mean square of a difference over the pixels that can be wrong.
pub fn rms(found: &[f32], exact: &[f32], mask: &[u32]) -> f32 {
    let facing = (0..mask.len()).filter(|i| mask[*i] == FACING);
    let squares: Vec<f32> = facing.map(|i| (found[i] - exact[i]).powi(2)).collect();
    (squares.iter().sum::<f32>() / squares.len() as f32).sqrt()
}

/// The visibility of a technique without the truth; its rays are counted.
pub fn seen(r: &mut Renderer, s: &Setup, id: &str, resolution: u32, sets: &[&str]) -> Vec<f32> {
    let mut s = s.clone();
    pick(&mut s, id, resolution, sets);
    r.render(&s, Ask { truth: Truth::Off, analysis: true, ..Ask::of(&s) }).unwrap();
    r.read_visibility().unwrap()
}

/// More places come to the truth, whatever shape the light has; those in the middles of cells sooner than those from edge to edge. What is
/// lit or dark for all of the light is so by every map.
#[test]
fn the_mean_over_places_comes_to_the_truth() {
    for light in [sun_at(0.0), rectangle()] {
        let (mut r, s) = in_the_yard(light);
        let exact = seen(&mut r, &s, "rt-soft", 64, &["samples=4096"]);
        let mask = r.read_mask().unwrap();
        let mut off = |sets: &[&str]| {
            let found = seen(&mut r, &s, "area-uniform", 1024, &[&["receiver_plane=true", "kernel=1"], sets].concat());
            let facing = (0..mask.len()).filter(|i| mask[*i] == FACING);
            let certain = facing.filter(|i| exact[*i] == 0.0 || exact[*i] == 1.0);
            let wrong = certain.filter(|i| (found[*i] - exact[*i]).abs() > 0.5).count();
            (rms(&found, &exact, &mask), wrong)
        };
        let centers = ["side=1", "side=2", "side=4", "side=12"].map(|side| off(&[side]));
        let corners = off(&["side=4", "placement=corners"]);
        println!("{}: {centers:?}, corners {corners:?}", light.kind());
        // What the map's texels and its bias leave stays.
        let floor = if light.kind() == "rect-area" { 0.017 } else { 0.004 };
        assert!(centers.windows(2).all(|w| w[1].0 < (0.75 * w[0].0).max(floor)), "{centers:?}");
        assert!(centers[3].0 < floor && centers[3].1 <= 3 && centers[2].0 < corners.0, "{centers:?} {corners:?}");
    }
}

/// Along a path, where the light moves from frame to frame, rays of the last frame's light are none of this one's.
#[test]
fn no_ray_outlives_its_light() {
    let (mut r, s) = in_the_yard(sun_at(0.0));
    let mut s = s.clone();
    pick(&mut s, "rt-soft", 64, &["samples=32"]);
    let mut frame = |light: Light, history: History| {
        let s = Setup { light, ..s.clone() };
        r.render(&s, Ask { truth: Truth::Off, history, ..Ask::of(&s) }).unwrap();
        r.read_visibility().unwrap()
    };
    let alone = frame(sun_at(20.0), History::Whole);
    frame(sun_at(0.0), History::Whole);
    assert!(frame(sun_at(20.0), History::Goes) == alone);
}

/// A light without a size has one place, and the map is that of the standard technique.
#[test]
fn one_place_is_the_plain_map() {
    let Light::Directional { to_light, color, .. } = sun_at(0.0) else { return };
    let (mut r, s) = in_the_yard(Light::Directional { to_light, angular_radius: 0.0, color });
    let [area, plain] =
        [("area-uniform", &["kernel=1"][..]), ("shadow-map", &[])].map(|(id, sets)| seen(&mut r, &s, id, 256, sets));
    assert!(area == plain);
    let (mut r, s) = in_the_yard(rectangle());
    let [area, plain] = [("area-uniform", &["kernel=1", "side=1"][..]), ("shadow-map", &[])]
        .map(|(id, sets)| seen(&mut r, &s, id, 256, sets));
    let (mask, differ) = (r.read_mask().unwrap(), |i: &usize| area[*i] != plain[*i]);
    // Only where the centre has set behind the surface, which faces it not at all.
    assert!((0..mask.len()).filter(|i| mask[*i] == FACING).filter(differ).count() == 0);
}

/// Eight maps of a light with a size decide what they agree on; rays to all of the light put right what they do not.
#[test]
fn maps_agree_on_all_but_penumbras() {
    for light in [sun_at(0.0), rectangle()] {
        let (mut r, s) = in_the_yard(light);
        let exact = seen(&mut r, &s, "rt-soft", 64, &["samples=1024"]);
        let mask = r.read_mask().unwrap();
        let mut off = |id: &str, sets: &[&str]| {
            let found = seen(&mut r, &s, id, 1024, sets);
            (rms(&found, &exact, &mask), r.read_rays().unwrap())
        };
        let (rays, sent) = off("rt-soft", &["samples=64"]);
        let (hybrid, few) = off("hybrid-area", &["receiver_plane=true"]);
        let (maps, none) = off("hybrid-area", &["receiver_plane=true", "rays=false"]);
        println!("{}: rays {rays} ({sent}), hybrid {hybrid} ({few}), maps {maps} ({none})", light.kind());
        // A rectangle's corners lie beyond the eight places: what hides one of them alone is missed.
        let most = if light.kind() == "rect-area" { 0.015 } else { 1.1 * rays };
        assert!(hybrid < most && 2 * few < sent && few > 0, "{hybrid} {rays}, {few} of {sent}");
        assert!(none == 0 && maps > 1.2 * hybrid && maps < 0.05, "{maps} {hybrid}");
        // A light without a size has one place: rays end the same disputes as those of the hard hybrid.
        let Light::Directional { to_light, color, .. } = light else { continue };
        let point = Setup { light: Light::Directional { to_light, angular_radius: 0.0, color }, ..s.clone() };
        let [area, hard] = ["hybrid-area", "hybrid-pcf"].map(|id| seen(&mut r, &point, id, 256, &[]));
        assert!(area == hard, "one place is the centre");
    }
}

/// However many maps are looked up together, their sum is the same; and one cascade that holds all of the view is the uniform grid.
#[test]
fn sums_do_not_depend_on_how_maps_are_grouped() {
    for light in [sun_at(0.0), rectangle()] {
        let (mut r, s) = in_the_yard(light);
        let mut of = |id: &str, sets: &[&str]| seen(&mut r, &s, id, 256, sets);
        let uniform = ["side=3", "placement=corners"];
        let together = of("area-uniform", &[&uniform[..], &["layers=8"]].concat());
        let alone = of("area-uniform", &[&uniform[..], &["layers=1"]].concat());
        let near = of("cssm", &["percent_1=100", "percent_2=100", "side=3", "layers=5"]);
        // The far cascade alone, whose parameters have names of their own.
        let far = of("cssm", &["percent_1=0", "percent_2=0", "side_3=3", "coarser_3=1"]);
        assert!(together == alone && together == near && together == far, "{}", light.kind());
        let mixed = of("cssm", &["percent_1=30", "percent_2=60", "blend=0.2"]);
        let parted = of("cssm", &["percent_1=30", "percent_2=60"]);
        assert!(mixed != parted && mixed.iter().all(|v| (0.0..=1.0).contains(v)));
    }
}

/// Bounds spare pixels most of the maps, and hardly a texel changes for it; where four places agree, others may not.
#[test]
fn bounds_agree_with_all_maps() {
    for light in [sun_at(0.0), rectangle()] {
        let (mut r, s) = in_the_yard(light);
        let whole = ["percent_1=100", "percent_2=100", "placement=nested", "receiver_plane=true"];
        let flat = [&whole[..3], &["receiver_plane=false"]].concat();
        let [all, bounds] =
            ["ask=all", "ask=bounds"].map(|ask| seen(&mut r, &s, "cssm", 512, &[&flat[..], &[ask]].concat()));
        let differ = all.iter().zip(&bounds).filter(|(a, b)| (*a - *b).abs() > 1e-6).count();
        println!("{}: {differ} with a bias for all of the window", light.kind());
        assert!(differ <= 2, "{}: {differ}", light.kind());
        let mut of = |ask: &str| seen(&mut r, &s, "cssm", 512, &[&whole[..], &[ask]].concat());
        let [all, bounds, corners] = ["ask=all", "ask=bounds", "ask=corners"].map(&mut of);
        let differ = |other: &[f32]| all.iter().zip(other).filter(|(a, b)| (*a - *b).abs() > 1e-6).count();
        let most = |other: &[f32]| all.iter().zip(other).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        println!("{}: bounds {} up to {}, corners {}", light.kind(), differ(&bounds), most(&bounds), differ(&corners));
        // But for a texel or two at the edge of one map.
        assert!(differ(&bounds) <= 2 && most(&bounds) < 0.02, "{}", light.kind());
        assert!(differ(&corners) > if light.kind() == "rect-area" { 0 } else { 20 }, "{}", light.kind());
        // Few pixels ask all of them.
        let asked = |r: &mut Renderer, ask: &str| {
            let mut s = Setup { view: "maps-asked".into(), ..s.clone() };
            pick(&mut s, "cssm", 512, &[&whole[..], &[ask]].concat());
            r.render(&s, Ask { truth: Truth::Off, ..Ask::of(&s) }).unwrap();
            let (map, mask) = (r.read_map().unwrap(), r.read_mask().unwrap());
            let facing: Vec<f32> = (0..mask.len()).filter(|i| mask[*i] == FACING).map(|i| map[i]).collect();
            facing.iter().sum::<f32>() / facing.len() as f32
        };
        let [every, some, few] = ["ask=all", "ask=bounds", "ask=corners"].map(|ask| asked(&mut r, ask));
        println!("{}: {every} maps a pixel, {some} with bounds, {few} by four", light.kind());
        // Maps that do not reach a pixel are not asked.
        assert!(every > 13.0 && some < 10.0 && few < 10.0, "{every} {some} {few}");
    }
}

/// Four maps from the corners spread penumbras too wide; four that are some of sixteen do not.
#[test]
fn few_nested_places_are_as_good_as_they_can_be() {
    let (mut r, s) = in_the_yard(rectangle());
    let exact = seen(&mut r, &s, "rt-soft", 64, &["samples=1024"]);
    let mask = r.read_mask().unwrap();
    let far = ["percent_1=0", "percent_2=0", "coarser_3=1", "receiver_plane=true"];
    let mut off =
        |placement: &str| rms(&seen(&mut r, &s, "cssm", 1024, &[&far[..], &[placement]].concat()), &exact, &mask);
    let [corners, centers, nested] = ["placement=corners", "placement=centers", "placement=nested"].map(&mut off);
    println!("corners {corners}, centers {centers}, nested {nested}");
    assert!(corners > 1.5 * nested && nested < 1.15 * centers, "{corners} {centers} {nested}");
}

/// A level rectangle.
fn plate(low: [f32; 2], high: [f32; 2], y: f32) -> Vec<[Vec3; 3]> {
    floor(low.into(), high.into(), y)
}

/// What casts on other places than the one whose map bounds the penumbra may lie beside that map: a plate right below a lamp, with a hole
/// that the map looks through, hides most of the lamp.
#[test]
fn bounds_know_casters_beside_the_map() {
    let light = Light::RectArea {
        center: Vec3::new(0.0, 4.0, 0.0),
        half_u: Vec3::new(0.5, 0.0, 0.0),
        half_v: Vec3::new(0.0, 0.0, 0.5),
        range: 40.0,
        color: Vec3::ONE,
    };
    let mut all = plate([-4.0, -4.0], [4.0, 4.0], 0.0);
    all.extend(plate([-2.0, -2.0], [2.0, -0.2], 3.95));
    all.extend(plate([-2.0, 0.2], [2.0, 2.0], 3.95));
    all.extend(plate([-2.0, -0.2], [-0.2, 0.2], 3.95));
    all.extend(plate([0.2, -0.2], [2.0, 0.2], 3.95));
    let view = camera(Vec3::new(0.0, 1.5, 3.0), Vec3::ZERO);
    let (mut r, s) = start(scene(vec![mesh(&all, 0)], vec![material(Vec3::ONE)], view, light), [80, 60]);
    let whole = ["percent_1=100", "percent_2=100", "placement=nested"];
    let [every, bounded] =
        ["ask=all", "ask=bounds"].map(|ask| seen(&mut r, &s, "cssm", 256, &[&whole[..], &[ask]].concat()));
    let mask = r.read_mask().unwrap();
    assert!(rms(&bounded, &every, &mask) < 0.01, "{}", rms(&bounded, &every, &mask));
    let facing: Vec<f32> = (0..mask.len()).filter(|i| mask[*i] == FACING).map(|i| every[i]).collect();
    assert!(facing.iter().sum::<f32>() / (facing.len() as f32) < 0.5, "the plate hides most of the lamp");
}

/// Maps from places beside a lamp's middle still hold all of its cone; and those of a wide lamp that do not reach what lies far aside say nothing
/// of it, but that they do not.
#[test]
fn places_hold_the_lights_cone_or_say_nothing() {
    let eye = camera(Vec3::new(-3.0, 2.5, 2.5), Vec3::new(0.0, 0.3, 0.0));
    let mut all = plate([-4.0, -4.0], [4.0, 4.0], 0.0);
    // A wall.
    let corner = |x: f32, y: f32| Vec3::new(x, y, -1.0);
    let [a, b, c, d] = [corner(-1.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.5), corner(-1.0, 1.5)];
    all.extend([[a, b, c], [a, c, d]]);
    let narrow = Light::Spot {
        position: Vec3::new(4.0, 3.0, 0.0),
        direction: Vec3::new(-4.0, -3.0, 0.0),
        outer_angle: 20.0,
        range: 200.0,
        radius: 1.5,
        color: Vec3::ONE,
    };
    let wide = Light::RectArea {
        center: Vec3::new(20.0, 3.0, 0.0),
        half_u: Vec3::new(20.0, 0.0, 0.0),
        half_v: Vec3::new(0.0, 0.0, 1.0),
        range: 200.0,
        color: Vec3::ONE,
    };
    // As found before: 0.10 and 0.40.
    for (light, id, most) in
        [(narrow, "area-uniform", 0.07), (narrow, "area-adaptive", 0.07), (wide, "hybrid-area", 0.05)]
    {
        let meshes = vec![mesh(&all, 0)];
        let (mut r, s) = start(scene(meshes, vec![material(Vec3::ONE)], eye, light), [48, 36]);
        let exact = seen(&mut r, &s, "rt-soft", 64, &["samples=256"]);
        let found = seen(&mut r, &s, id, 512, &[]);
        let off = rms(&found, &exact, &r.read_mask().unwrap());
        println!("{id} under a {}: {off}", light.kind());
        assert!(off < most, "{id} under a {}: {off}", light.kind());
        let mut s = s.clone();
        pick(&mut s, id, 512, &[]);
        let notes = shadowscope::measure::accuracy(&mut r, &s, 0).unwrap().notes;
        assert_eq!(notes.contains("far aside"), light.kind() == "rect-area", "{notes}");
    }
}
