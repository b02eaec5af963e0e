//! Light samples that are added where what they see differs.

use crate::area::{pick, rectangle, rms, seen};
use crate::common::*;
use crate::denoise::{in_the_yard, sun_at};
use glam::{Vec2, Vec3};
use shadowscope::frame::Renderer;
use shadowscope::light::Light;
use shadowscope::measure::metrics::FACING;
use shadowscope::setup::Setup;

/// What `area-adaptive` sees with maps of 512², and how many of these it drew.
fn adaptive(r: &mut Renderer, s: &Setup, sets: &[&str]) -> (Vec<f32>, u64) {
    let found = seen(r, s, "area-adaptive", 512, sets);
    let maps = r.analysis().maps_drawn(&r.gpu).unwrap().unwrap();
    (found, maps)
}

/// Values where the light can be hidden.
fn facing(values: &[f32], mask: &[u32]) -> Vec<f32> {
    values.iter().zip(mask).filter(|(_, m)| **m == FACING).map(|(v, _)| *v).collect()
}

/// A rectangle 1 m to a side, 4 m above a floor of 8 m and looked at from beside it, with what hangs between.
fn under_a_lamp(casters: &[[Vec3; 3]], half: f32) -> (Renderer, Setup) {
    let mut triangles = floor(Vec2::splat(-4.0), Vec2::splat(4.0), 0.0);
    triangles.extend(casters);
    let light = Light::RectArea {
        center: Vec3::new(0.0, 4.0, 0.0),
        half_u: Vec3::new(half, 0.0, 0.0),
        half_v: Vec3::new(0.0, 0.0, half),
        range: 40.0,
        color: Vec3::ONE,
    };
    let view = camera(Vec3::new(0.0, 3.0, 5.0), Vec3::ZERO);
    start(scene(vec![mesh(&triangles, 0)], vec![material(Vec3::ONE)], view, light), [120, 90])
}

/// Split once, the light has nine samples, and they weigh 1/16 at its corners, 1/8 at the middles of its edges and 1/4 in its own: the same
/// follows from the means over the four corners, all nine and the centre alone, which the uniform technique draws.
#[test]
fn nine_samples_weigh_as_a_trapezoid_has_it() {
    for light in [rectangle(), sun_at(0.0)] {
        let (mut r, s) = in_the_yard(light);
        for kernel in ["kernel=1", "kernel=3", "kernel=5"] {
            let (found, maps) = adaptive(&mut r, &s, &["levels=1", "tau=0", "criterion=count", kernel]);
            assert_eq!(maps, 9);
            let mut uniform = |side: &str| seen(&mut r, &s, "area-uniform", 512, &["placement=corners", side, kernel]);
            let [centre, four, nine] = ["side=1", "side=2", "side=3"].map(&mut uniform);
            let mask = r.read_mask().unwrap();
            let off = |i: usize| {
                let edges = 9.0 * nine[i] - 4.0 * four[i] - centre[i];
                (found[i] - (4.0 * four[i] + 2.0 * edges + 4.0 * centre[i]) / 16.0).abs()
            };
            let off: Vec<f32> = (0..mask.len()).filter(|i| mask[*i] == FACING).map(off).filter(|d| *d > 2e-6).collect();
            println!("{} {kernel}: {off:?}", light.kind());
            // Two shaders may round a place to either side of a texel's edge; and some places' maps do not reach pixels far aside, which weighs
            // the others more.
            assert!(off.len() <= 10 && off.iter().all(|d| *d < 0.2), "{kernel}: {off:?}");
            let steps = if kernel == "kernel=1" { 16.0 } else { 16.0 * 9.0 * 25.0 };
            let between = |v: &&f32| (*v * steps - (*v * steps).round()).abs() >= 1e-2;
            assert!(facing(&found, &mask).iter().filter(between).count() <= 10);
        }
    }
}

/// Deeper trees come to the truth, with no more maps than their grids have corners; what no sample sees is exactly dark, and what all
/// see exactly lit.
#[test]
fn deeper_trees_come_to_the_truth() {
    for light in [sun_at(0.0), rectangle()] {
        let (mut r, s) = in_the_yard(light);
        let exact = seen(&mut r, &s, "rt-soft", 64, &["samples=4096"]);
        let mask = r.read_mask().unwrap();
        let mut off = |sets: &[&str]| {
            let (found, maps) = adaptive(&mut r, &s, &[&["receiver_plane=true", "kernel=1"], sets].concat());
            let certain = (0..mask.len()).filter(|i| mask[*i] == FACING && (exact[*i] == 0.0 || exact[*i] == 1.0));
            let (same, not): (Vec<usize>, Vec<usize>) = certain.partition(|i| found[*i] == exact[*i]);
            (rms(&found, &exact, &mask), maps, same.len(), not.len())
        };
        let deep = ["levels=1", "levels=2", "levels=3"].map(|levels| off(&[levels, "criterion=count", "tau=0"]));
        let few = off(&["levels=3", "gap=2"]);
        println!("{}: {deep:?}, gap {few:?}", light.kind());
        let floor = if light.kind() == "rect-area" { 0.02 } else { 0.008 };
        assert!(deep.windows(2).all(|w| w[1].0 < (0.7 * w[0].0).max(floor)), "{deep:?}");
        assert!(deep[2].0 < floor && few.0 < 2.0 * floor, "{deep:?} {few:?}");
        assert!(deep.iter().zip([9, 25, 81]).all(|(d, most)| d.1 <= most) && few.1 < deep[2].1, "{deep:?} {few:?}");
        // Edges of texels alone are wrong there.
        assert!(deep.iter().all(|d| d.2 > 1000 && d.3 * 30 < d.2), "{deep:?}");
    }
}

/// Nothing casts a shadow: the four corners agree, and all is lit.
#[test]
fn a_bare_floor_takes_four_maps() {
    let (mut r, s) = under_a_lamp(&[], 0.5);
    for sets in [&["tau=0", "criterion=count"][..], &["tau=0", "gap=1"], &["levels=4", "tau=0"]] {
        let (found, maps) = adaptive(&mut r, &s, sets);
        let lit = facing(&found, &r.read_mask().unwrap());
        assert!(maps == 4 && lit.len() > 3000 && lit.iter().all(|v| *v == 1.0), "{maps}");
    }
    let notes = r.notes().unwrap();
    assert!(notes.iter().any(|n| n.starts_with("4 maps were drawn")), "{notes:?}");
}

/// The wider the light, the wider the penumbra and the more maps, as long as bands would be seen; the bare count goes to the full depth
/// for any.
#[test]
fn wide_penumbras_take_more_maps() {
    let lid = floor(Vec2::new(-8.0, -8.0), Vec2::new(0.0, 8.0), 1.5);
    let maps = |half: f32, sets: &[&str]| {
        let (mut r, s) = under_a_lamp(&lid, half);
        adaptive(&mut r, &s, sets).1
    };
    let [point, narrow, wide] = [0.02, 0.4, 0.8].map(|half| maps(half, &["gap=3"]));
    println!("{point} {narrow} {wide}");
    assert!(point <= 4 && point < narrow && narrow < wide, "{point} {narrow} {wide}");
    let counts = [0.4, 0.8].map(|half| maps(half, &["criterion=count"]));
    assert!(counts[0] > narrow && counts[1] >= wide, "{counts:?}");
    // A coarser band, and a larger share that may disagree, take fewer.
    assert!(maps(0.8, &["gap=12"]) < wide && maps(0.8, &["criterion=count", "tau=0.05"]) <= counts[1]);
}

/// A plate close to the light hides a sixth of it from all of the floor, but from each of the four corners only what lies beyond the
/// floor: they agree that all is lit, and it is missed. Samples all over the light notice it.
#[test]
fn what_no_corner_notices_is_missed() {
    let plate = floor(Vec2::splat(-0.2), Vec2::splat(0.2), 3.95);
    let (mut r, s) = under_a_lamp(&plate, 0.5);
    let mean = |found: &[f32], mask: &[u32]| {
        let lit = facing(found, mask);
        lit.iter().sum::<f32>() / lit.len() as f32
    };
    let exact = seen(&mut r, &s, "rt-soft", 64, &["samples=256"]);
    let mask = r.read_mask().unwrap();
    let (found, maps) = adaptive(&mut r, &s, &["tau=0", "criterion=count"]);
    let uniform = seen(&mut r, &s, "area-uniform", 512, &["side=6"]);
    let means = [&exact, &found, &uniform].map(|v| mean(v, &mask));
    println!("{means:?}, {maps} maps");
    assert!(maps == 4 && means[1] == 1.0, "{maps} {means:?}");
    assert!(means[0] < 0.9 && means[2] < 0.9, "{means:?}");
}

/// A light without a size has one place, and the map is that of the standard technique.
#[test]
fn one_place_is_the_plain_map() {
    let Light::Directional { to_light, color, .. } = sun_at(0.0) else { return };
    let (mut r, s) = in_the_yard(Light::Directional { to_light, angular_radius: 0.0, color });
    let area = seen(&mut r, &s, "area-adaptive", 256, &["kernel=1"]);
    assert_eq!(r.analysis().maps_drawn(&r.gpu).unwrap(), Some(1));
    assert!(area == seen(&mut r, &s, "shadow-map", 256, &[]));
}

/// What the GPU decides in one frame is nothing that the next one takes over.
#[test]
fn a_frame_knows_nothing_of_the_last() {
    let (mut r, s) = in_the_yard(sun_at(0.0));
    let alone = adaptive(&mut r, &s, &[]);
    adaptive(&mut r, &Setup { light: sun_at(40.0), ..s.clone() }, &["levels=4", "tau=0", "kernel=5"]);
    adaptive(&mut r, &s, &["levels=1", "kernel=1"]);
    assert!(adaptive(&mut r, &s, &[]) == alone);
}

/// Pictures whose samples no buffer holds are refused by a sentence.
#[test]
fn too_many_pixels_are_refused() {
    let (mut r, s) = in_the_yard(sun_at(0.0));
    let mut s = Setup { size: [4000, 4000], ..s };
    pick(&mut s, "area-adaptive", 64, &["levels=4", "kernel=5"]);
    if r.gpu.most_bound() < 4000 * 4000 * 58 * 4 {
        let error = r.render(&s, ask(&s)).expect_err("an error").to_string();
        assert!(error.contains("289 samples"), "{error}");
    }
}
