//! The irregular z-buffer and partitioned shadow volumes: both are exact, whatever their parameters.

use crate::common::*;
use glam::{Vec2, Vec3};
use shadowscope::frame::{Ask, Renderer};
use shadowscope::gpu::{Timer, TimerMode};
use shadowscope::light::Light;
use shadowscope::measure::metrics::FACING;
use shadowscope::scene::Material;
use shadowscope::scene::geometry::Geometry;
use shadowscope::scene::shadow_tree::{Order, ShadowTree};
use shadowscope::setup::Setup;
use shadowscope::truth::Samples;

/// Triangles thrown about over a floor, some of them masked, some twice in the same place.
fn heap(count: usize) -> (Vec<[Vec3; 3]>, Vec<[Vec3; 3]>) {
    let mut random = Random(7);
    let mut all: Vec<[Vec3; 3]> = (0..count)
        .map(|_| {
            let at = random.point() * Vec3::new(4.0, 1.4, 4.0) + Vec3::Y * 1.6;
            [0; 3].map(|_| at + 0.5 * random.point())
        })
        .collect();
    all.push(all[0]);
    let [a, b, c] = all[1];
    all.push([c, b, a]);
    let masked = all.split_off(count * 3 / 4);
    all.extend(floor(Vec2::splat(-8.0), Vec2::splat(8.0), 0.0));
    (all, masked)
}

fn heap_scene(light: Light) -> shadowscope::scene::Scene {
    let (solid, masked) = heap(300);
    let holes = Material { base_color: Vec3::ONE.extend(0.3), alpha_cutoff: Some(0.5), ..material(Vec3::ONE) };
    let meshes = vec![mesh(&solid, 0), mesh(&masked, 1)];
    scene(meshes, vec![material(Vec3::ONE), holes], camera(Vec3::new(1.0, 4.0, 9.0), Vec3::ZERO), light)
}

fn lights() -> [Light; 5] {
    [
        sun(Vec3::new(0.5, 0.8, 0.3)),
        sun(Vec3::new(0.9, 0.02, 0.1)),
        spot(Vec3::new(2.0, 6.0, 1.0), Vec3::ZERO, 40.0),
        lamp(Vec3::new(0.3, 1.5, -0.4)),
        Light::Hemisphere {
            position: Vec3::new(0.0, 5.0, 0.5),
            direction: -Vec3::Y,
            range: 60.0,
            color: Vec3::splat(20.0),
        },
    ]
}

/// Parameters under which both must be right: lists too short for most, a stack too small for most, every order.
const WAYS: [(&str, &[&str]); 7] = [
    ("izb", &[]),
    ("izb", &["list_resolution=128", "longest=16"]),
    ("izb", &["list_resolution=2048"]),
    ("psv", &[]),
    ("psv", &["order=area", "prune=false"]),
    ("psv", &["order=as-is"]),
    ("psv", &["max_stack=16"]),
];

fn wrong(s: &mut Setup, r: &mut Renderer, (id, sets): (&str, &[&str])) -> (usize, usize) {
    let e = errors(r, s, id, sets);
    (e.lit_incorrect + e.shadow_incorrect, e.facing)
}

/// Each of them finds the truth, pixel by pixel, under every kind of light.
#[test]
fn lists_and_trees_are_exact() {
    for light in lights() {
        let (mut r, mut s) = start(heap_scene(light), [160, 120]);
        for way in WAYS {
            let (wrong, facing) = wrong(&mut s, &mut r, way);
            assert!(facing > 2000, "{light:?}: {facing}");
            assert_eq!(wrong, 0, "{way:?} under {light:?}");
        }
    }
}

/// … and in built-in scenes and those made to break techniques: less than 0.01 % of the pixels, and none in pictures as small as these.
#[test]
fn lists_and_trees_are_exact_in_scenes() {
    for name in ["cubes", "blocks", "st-fence", "st-wire", "st-degenerate", "st-contact", "st-foliage", "st-longtri"] {
        let (mut r, mut s) = built_in(name, [128, 96]);
        for way in [WAYS[0], WAYS[3]] {
            assert_eq!(wrong(&mut s, &mut r, way).0, 0, "{way:?} in {name}");
        }
    }
}

/// The mean over a pixel comes nearer to the averaged truth than one sample does.
#[test]
fn samples_on_the_micro_quad_are_averaged() {
    let light = sun(Vec3::new(0.5, 0.8, 0.3));
    let (mut r, mut s) = start(
        scene(vec![mesh(&yard(), 0)], vec![material(Vec3::ONE)], camera(Vec3::new(0.0, 3.0, 8.0), Vec3::ZERO), light),
        [160, 120],
    );
    let mut seen = |sets: &[&str]| {
        select(&mut s, "izb", sets);
        s.truth_samples = Samples::Fixed(16);
        r.render(&s, ask(&s)).unwrap();
        let lit: Vec<bool> = r.read_mask().unwrap().iter().map(|m| *m == FACING).collect();
        let of_lit =
            |all: Vec<f32>| all.into_iter().zip(&lit).filter(|(_, lit)| **lit).map(|(v, _)| v).collect::<Vec<_>>();
        (of_lit(r.read_visibility().unwrap()), of_lit(r.read_truth().unwrap()))
    };
    let [(one, _), (many, mean), (few, _)] =
        [&["samples=1"][..], &["samples=32"], &["samples=32", "longest=16", "list_resolution=128"]].map(&mut seen);
    let rmse = |v: &[f32]| v.iter().zip(&mean).map(|(v, t)| ((v - t) as f64).powi(2)).sum::<f64>().sqrt();
    assert!(rmse(&many) < 0.6 * rmse(&one), "{} of 32 samples, {} of one", rmse(&many), rmse(&one));
    // What finds no room in the lists is traced, with the same result.
    assert_eq!(many, few);
}

/// Lists hold every pixel that faces the light once, and the longest is what the view of them shows.
#[test]
fn lists_hold_every_sample() {
    for light in lights() {
        let (mut r, mut s) = start(heap_scene(light), [96, 64]);
        select(&mut s, "izb", &["list_resolution=128"]);
        s.view = "list-length".into();
        r.render(&s, ask(&s)).unwrap();
        let lengths = r.read_map().unwrap();
        let facing = facing(&mut r);
        // Each list is seen as often as it is long.
        let lists: f64 = lengths.iter().filter(|n| **n > 0.0).map(|n| 1.0 / *n as f64).sum();
        assert_eq!(lengths.iter().filter(|n| **n > 0.0).count() as u64, facing);
        assert!((lists - lists.round()).abs() < 1e-3, "{lists} lists");
        assert!(lists.round() as u64 <= facing);
    }
}

/// Built from the top, the tree is the one that inserting one triangle after the other makes: each triangle is in it once, or
/// covered, or edge-on.
#[test]
fn every_triangle_is_in_the_tree_or_covered() {
    for light in lights() {
        let s = heap_scene(light);
        let g = Geometry::new(&s, 0, 0.0).unwrap();
        for order in [Order::Random(1), Order::AsIs, Order::Area] {
            let tree = ShadowTree::new(&g, g.opaque, &light, order).unwrap();
            let mut links: Vec<u32> = tree.records.iter().flat_map(|r| &r[1..]).filter(|l| **l > 0).copied().collect();
            links.push(tree.root);
            let count = links.len();
            links.sort_unstable();
            links.dedup();
            assert_eq!((links.len(), count as u32), (count, tree.inserted), "{order:?} {light:?}");
            assert_eq!(tree.inserted + tree.covered + tree.edge_on, g.bvh.order.len() as u32);
            // The same again, however its parts were dealt out.
            let again = ShadowTree::new(&g, g.opaque, &light, order).unwrap();
            assert!(again.records == tree.records && again.depth == tree.depth);
            // Nothing below comes nearer to the light than its record says.
            let near = |i: u32| f32::from_bits(tree.records[i as usize - 1][0]);
            for (i, r) in tree.records.iter().enumerate().filter(|(i, _)| links.binary_search(&(*i as u32 + 1)).is_ok())
            {
                assert!(r[1..].iter().filter(|l| **l > 0).all(|l| near(*l) >= near(i as u32 + 1) - 1e-6));
            }
        }
    }
}

/// A large square above many small triangles shadows them all: inserted first, it leaves nothing else in the tree, unless it is
/// masked.
#[test]
fn what_lies_in_shadow_is_dropped() {
    let light = sun(Vec3::Y);
    let mut random = Random(3);
    let small: Vec<[Vec3; 3]> = (0..50).map(|_| [0; 3].map(|_| random.point() * Vec3::new(0.9, 0.5, 0.9))).collect();
    let lid = [Vec3::new(-9.0, 2.0, -9.0), Vec3::new(0.0, 2.0, 18.0), Vec3::new(9.0, 2.0, -9.0)];
    for masked in [false, true] {
        let mut cover = material(Vec3::ONE);
        cover.alpha_cutoff = masked.then_some(0.5);
        let view = camera(Vec3::new(0.0, 4.0, 9.0), Vec3::ZERO);
        let s = scene(vec![mesh(&small, 0), mesh(&[lid], 1)], vec![material(Vec3::ONE), cover], view, light);
        let g = Geometry::new(&s, 0, 0.0).unwrap();
        let tree = ShadowTree::new(&g, g.opaque, &light, Order::Area).unwrap();
        assert_eq!(tree.inserted + tree.covered, 51);
        assert!(if masked { tree.inserted > 1 } else { tree.inserted == 1 }, "{masked}: {}", tree.inserted);
    }
}

/// By timestamps the clears of its lists are a part of its time.
#[test]
fn clears_are_timed() {
    let (mut r, mut s) = built_in("cubes", [64, 48]);
    if !r.gpu.abilities.features.contains(wgpu::Features::TIMESTAMP_QUERY) {
        return;
    }
    r.timer = Timer::with(TimerMode::Stamps);
    select(&mut s, "izb", &[]);
    for _ in 0..2 {
        r.render(&s, Ask { timed: true, ..ask(&s) }).unwrap();
        r.collect_times(true).unwrap();
        let passes = r.timer.by_name();
        let names: Vec<_> = passes.iter().map(|p| p.0).collect();
        assert!(names.contains(&"clears") && names.contains(&"lists"), "{names:?}");
        assert_eq!(r.timer.latest.iter().filter(|p| p.0 == "clears").count(), 4);
    }
}
