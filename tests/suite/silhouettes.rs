//! Silhouette maps against closed forms and rays.

use crate::common::*;
use crate::edges::box_of;
use glam::{Vec2, Vec3, vec2, vec3};
use shadowscope::frame::{Ask, Renderer};
use shadowscope::light::Light;
use shadowscope::measure::metrics::FACING;
use shadowscope::scene::Scene;
use shadowscope::setup::Setup;
use std::f32::consts::TAU;

const TO_LIGHT: Vec3 = Vec3::new(0.3, 1.0, -0.9);
const HEIGHT: f32 = 6.0;

/// A floor seen from above, and flat polygons beside the view whose shadows fall into it.
fn under_polygons(polygons: &[Vec<Vec2>]) -> Scene {
    polygons_at(HEIGHT, polygons, sun(TO_LIGHT))
}

/// A floor seen from above, and flat polygons at a height over it.
fn polygons_at(height: f32, polygons: &[Vec<Vec2>], light: Light) -> Scene {
    let at = |p: Vec2| vec3(p.x, height, p.y);
    let mut triangles = floor(Vec2::splat(-8.0), Vec2::splat(8.0), 0.0);
    for p in polygons {
        // Fans, seen from above counter-clockwise.
        let middle = p.iter().sum::<Vec2>() / p.len() as f32;
        for (k, q) in p.iter().enumerate() {
            triangles.push([at(middle), at(p[(k + 1) % p.len()]), at(*q)]);
        }
    }
    let view = camera(vec3(0.0, 5.4, 0.02), Vec3::ZERO);
    scene(vec![mesh(&triangles, 0)], vec![material(Vec3::ONE)], view, light)
}

/// Where the light's ray of a place on the floor passes the polygons' plane.
fn above(p: Vec2) -> Vec2 {
    let d = TO_LIGHT * (HEIGHT / TO_LIGHT.y);
    p + vec2(d.x, d.z)
}

fn inside(polygon: &[Vec2], p: Vec2) -> bool {
    let crossings = (0..polygon.len()).filter(|k| {
        let (a, b) = (polygon[*k], polygon[(k + 1) % polygon.len()]);
        (a.y > p.y) != (b.y > p.y) && p.x < a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x)
    });
    crossings.count() % 2 == 1
}

/// Pixels that are wrong by the closed form, and all of the floor.
fn wrong(r: &mut Renderer, s: &mut Setup, polygons: &[Vec<Vec2>], technique: &str, sets: &[&str]) -> [u32; 2] {
    select(s, technique, sets);
    r.render(s, ask(s)).unwrap();
    let (mask, at) = (r.read_mask().unwrap(), r.read_position().unwrap());
    let seen = r.read_visibility().unwrap();
    let mut found = [0; 2];
    for ((_, p), v) in mask.iter().zip(&at).zip(&seen).filter(|((m, p), _)| **m == FACING && p[1] < 0.1) {
        let lit = !polygons.iter().any(|polygon| inside(polygon, above(vec2(p[0], p[2]))));
        found[0] += ((*v > 0.5) != lit) as u32;
        found[1] += 1;
    }
    found
}

/// Convex polygons of several sizes and a star with points of 40°, apart from one another, where their shadows are in view.
/// `above`: where the light's ray of a place on the floor passes the polygons' plane.
fn shapes(above: fn(Vec2) -> Vec2) -> Vec<Vec<Vec2>> {
    let mut random = Random(7);
    let mut shapes: Vec<Vec<Vec2>> = (0..11)
        .map(|i| {
            let center = vec2((i % 4) as f32 - 1.5, (i / 4) as f32 - 1.0) * 1.15;
            let (n, turn) = (3 + i % 4, random.next() * TAU);
            let corner = |k: usize| Vec2::from_angle(turn - TAU * k as f32 / n as f32);
            (0..n).map(|k| above(center + corner(k) * (0.36 + 0.12 * random.next()))).collect()
        })
        .collect();
    let center = vec2(1.5, 1.0) * 1.15;
    let corner = |k: usize| center + Vec2::from_angle(-TAU * k as f32 / 10.0) * [0.5, 0.2][k % 2];
    shapes.push((0..10).map(|k| above(corner(k))).collect());
    shapes
}

const MAP: &str = "resolution=96";

/// Silhouettes decide nearly all pixels that a plain map of the same size gets wrong; corners need more than one distance.
#[test]
fn silhouettes_straighten_polygons() {
    let shapes = shapes(above);
    let (mut r, mut s) = start(under_polygons(&shapes), [320, 240]);
    assert_eq!(wrong(&mut r, &mut s, &shapes, "rt-hard", &[])[0], 0);
    let mut share = |technique: &str, sets: &[&str]| {
        let [bad, all] = wrong(&mut r, &mut s, &shapes, technique, &[&["resolution=192"], sets].concat());
        println!("{technique} {sets:?}: {bad} of {all}");
        assert!(all > 15000);
        bad as f32 / all as f32
    };
    let plain = share("shadow-map", &[]);
    let rounded = share("edsm", &[]);
    let exact = share("edsm", &["corners=exact"]);
    let sssm = share("sssm", &[]);
    let mid = share("sssm", &["store=mid"]);
    let lines = share("rbsm", &[]);
    assert!(plain > 0.005, "{plain}");
    assert!(10.0 * rounded < plain, "{rounded} {plain}");
    assert!(40.0 * exact < plain && exact <= rounded, "{exact} {plain}");
    assert!(10.0 * sssm < plain && sssm < mid && mid < plain, "{sssm} {mid} {plain}");
    assert!(lines < 0.6 * plain, "{lines} {plain}");
    // The orders in which distances win, from the best to the worst (Kenzel's figures 3.6 and 3.7).
    let by = ["segment", "seed", "min", "order"].map(|p| share("edsm", &["check=false", &format!("priority={p}")]));
    assert!(by.windows(2).all(|w| w[0] < w[1]), "{by:?}");
    // Half the four texels around an edge keep nothing of quads that are too thin.
    let thin = share("edsm", &["reach=0.5"]);
    assert!(thin > 3.0 * rounded && thin < 1.05 * plain, "{thin} {plain}");
}

/// A lamp over the floor's middle, near enough that the view spans five of its faces, and the height of what hangs below it.
const LAMP: Vec3 = Vec3::new(0.13, 1.0, -0.07);
const BELOW: f32 = 0.75;

/// Where the lamp's ray of a place on the floor passes the polygons' plane.
fn below_lamp(p: Vec2) -> Vec2 {
    let foot = vec2(LAMP.x, LAMP.z);
    foot + (p - foot) * (1.0 - BELOW / LAMP.y)
}

/// Pixels of the floor that are wrong by the closed form: in the face below the lamp, in those beside it, and of both those close to
/// the seam between them; and how many there are.
fn wrong_around(r: &mut Renderer, s: &Setup, polygons: &[Vec<Vec2>]) -> [[u32; 2]; 3] {
    r.render(s, ask(s)).unwrap();
    let (mask, at) = (r.read_mask().unwrap(), r.read_position().unwrap());
    let seen = r.read_visibility().unwrap();
    let mut found = [[0; 2]; 3];
    for ((_, p), v) in mask.iter().zip(&at).zip(&seen).filter(|((m, p), _)| **m == FACING && p[1] < 0.1) {
        let lit = !polygons.iter().any(|polygon| inside(polygon, below_lamp(vec2(p[0], p[2]))));
        let aside = (p[0] - LAMP.x).abs().max((p[2] - LAMP.z).abs()) - LAMP.y;
        let classes = [aside < 0.0, aside >= 0.0, aside.abs() < 0.1];
        for (class, found) in classes.into_iter().zip(&mut found).filter(|(class, _)| *class) {
            found[0] += (class && (*v > 0.5) != lit) as u32;
            found[1] += 1;
        }
    }
    found
}

/// Around a lamp silhouettes decide in every face what they decide in a single map, and no seam shows; faces that no pixel looks
/// up do without.
#[test]
fn silhouettes_straighten_polygons_around_a_lamp() {
    let shapes = shapes(below_lamp);
    let (mut r, mut s) = start(polygons_at(BELOW, &shapes, lamp(LAMP)), [320, 240]);
    let mut bad = |technique: &str, sets: &[&str]| {
        select(&mut s, technique, sets);
        let found = wrong_around(&mut r, &s, &shapes);
        println!("{technique} {sets:?}: {found:?}");
        (found, r.read_visibility().unwrap())
    };
    let (truth, _) = bad("rt-hard", &[]);
    assert!(truth.iter().all(|[bad, all]| *bad == 0 && *all > 1500), "{truth:?}");
    let small = "resolution=96";
    let (plain, _) = bad("cube", &[small]);
    assert!(plain.iter().all(|[bad, _]| *bad > 20), "{plain:?}");
    for (technique, sets, times) in
        [("edsm", &[small][..], 8), ("edsm", &[small, "corners=exact"], 30), ("sssm", &[small], 8)]
    {
        let (found, seen) = bad(technique, sets);
        for (([bad, _], [plain, _]), class) in found.iter().zip(&plain).zip(["below", "beside", "seam"]) {
            assert!(times * bad <= times.max(*plain), "{technique} {sets:?}, {class}: {bad} of {plain}");
        }
        let (_, all) = bad(technique, &[sets, &["culling=none"]].concat());
        assert!(seen == all, "{technique} {sets:?}: idle faces are looked up");
    }
}

/// Tips of ten degrees: each of the two edges tested by itself.
#[test]
fn exact_corners_beat_rounded_ones() {
    let (mut r, mut s) = built_in("st-corner", [160, 100]);
    let mut share = |technique: &str, sets: &[&str]| {
        let e = errors(&mut r, &mut s, technique, &[&["resolution=256"], sets].concat());
        println!("{technique} {sets:?}: {} + {}", e.lit_incorrect, e.shadow_incorrect);
        e.lit_incorrect + e.shadow_incorrect
    };
    let [plain, rounded, exact] = [share("shadow-map", &[]), share("edsm", &[]), share("edsm", &["corners=exact"])];
    assert!(2 * rounded < plain && 3 * exact < rounded, "{plain} {rounded} {exact}");
}

/// Half planes of all slopes: lines take away two thirds of what steps get wrong, and where they may only darken, no shadow shrinks.
#[test]
fn lines_replace_steps() {
    let mut sums = [0; 2];
    for slope in [-0.5f32, -0.3, -0.15, 0.07, 0.2, 0.35, 0.6] {
        let along = vec2(1.0, slope).normalize();
        let across = along.perp();
        let p = |x: f32, y: f32| above(along * x + across * y);
        let half = vec![vec![p(-5.0, 0.0), p(5.0, 0.0), p(5.0, -4.0), p(-5.0, -4.0)]];
        let (mut r, mut s) = start(under_polygons(&half), [160, 120]);
        let mut bad = |technique, sets: &[&str]| {
            let bad = wrong(&mut r, &mut s, &half, technique, &[&[MAP], sets].concat())[0];
            (bad, r.read_visibility().unwrap())
        };
        let (plain, _) = bad("shadow-map", &["receiver_plane=true"]);
        let (lines, seen) = bad("rbsm", &[]);
        println!("slope {slope}: {plain}, {lines}");
        sums = [sums[0] + plain, sums[1] + lines];
        let (_, darker) = bad("rbsm", &["change=conservative"]);
        assert!(darker.iter().zip(&seen).all(|(d, s)| d <= s) && darker != seen, "{slope}");
        let (short, _) = bad("rbsm", &["walk=1"]);
        assert!(short > lines, "{slope}: {short} {lines}");
        let (edge, _) = bad("edsm", &[]);
        assert!(30 * edge <= plain.max(30), "{slope}: {edge}");
    }
    assert!(sums[1] * 20 < sums[0] * 9, "{sums:?}");
}

/// In a spot's light quads that get their width in space are too thin far from the lamp: pixels fall back to the plain map.
#[test]
fn far_quads_are_thin() {
    let mut triangles = floor(Vec2::new(-3.0, -3.0), Vec2::new(3.0, 30.0), 0.0);
    for z in [2.0, 9.0, 16.0] {
        triangles.extend(box_of(vec3(-0.4, 0.0, z), vec3(0.4, 0.9, z + 0.5)));
    }
    let light = spot(vec3(0.0, 6.0, -4.0), vec3(0.0, 0.0, 12.0), 35.0);
    let view = camera(vec3(3.0, 5.0, 4.0), vec3(0.0, 0.0, 14.0));
    let scene = scene(vec![mesh(&triangles, 0)], vec![material(Vec3::ONE)], view, light);
    let (mut r, mut s) = start(scene, [160, 120]);
    s.view = "edge-use".into();
    let mut without = |sets: &[&str]| {
        select(&mut s, "edsm", &[&["resolution=256", "check=false"], sets].concat());
        r.render(&s, ask(&s)).unwrap();
        let map = r.read_map().unwrap();
        let none = map.iter().filter(|x| (0.0..1.0).contains(*x)).count();
        (none, map.iter().filter(|x| (2.0..4.0).contains(*x)).count())
    };
    let (screen, world) = (without(&[]), without(&["quads_in=world"]));
    assert!(20 * screen.0 < screen.1 && world.0 > 4 * screen.0 + 20, "{screen:?} {world:?}");
}

/// Straight edges, under the sun and around a lamp: pixels whose four texels keep one and the same edge.
#[test]
fn straight_edges_are_exact() {
    let view = camera(vec3(0.0, 5.0, 9.0), Vec3::ZERO);
    let around = scene(vec![mesh(&yard(), 0)], vec![material(Vec3::ONE)], view, lamp(vec3(-0.5, 3.0, 2.0)));
    for ((mut r, mut s), plain, map) in [
        (built_in("blocks", [400, 250]), "shadow-map", "resolution=512"),
        (start(around, [320, 200]), "cube", "resolution=128"),
    ] {
        select(&mut s, "rt-hard", &[]);
        r.render(&s, ask(&s)).unwrap();
        let truth = r.read_visibility().unwrap();
        s.view = "edge-use".into();
        select(&mut s, "edsm", &[map, "corners=exact"]);
        r.render(&s, ask(&s)).unwrap();
        let facing = r.read_mask().unwrap();
        let straight: Vec<bool> =
            r.read_map().unwrap().iter().zip(&facing).map(|(x, m)| (3.0..4.0).contains(x) && *m == FACING).collect();
        s.view = "shaded".into();
        let mut bad = |technique: &str, sets: &[&str]| {
            select(&mut s, technique, &[&[map], sets].concat());
            r.render(&s, ask(&s)).unwrap();
            let seen = r.read_visibility().unwrap();
            let all = seen.iter().zip(&truth).zip(&straight).filter(|((v, t), here)| **here && (*v - **t).abs() > 0.5);
            let bad = all.count();
            println!("{technique} {sets:?}: {bad}");
            bad
        };
        let steps = bad(plain, &[]);
        assert!(steps > 60, "{steps}");
        assert!(10 * bad("edsm", &["corners=exact"]) <= steps);
        assert!(10 * bad("edsm", &[]) <= steps);
        assert!(10 * bad("sssm", &[]) <= steps);
        if plain == "shadow-map" {
            // Most edges run slantwise over the map, where runs are a texel long and lines gain little.
            assert!(bad("rbsm", &[]) < steps);
        }
    }
}

/// What the mesh breaks is told; a closed one has nothing to tell.
#[test]
fn broken_meshes_are_told() {
    let cube = box_of(vec3(-0.5, 1.0, -0.5), vec3(0.5, 2.0, 0.5));
    let ground = box_of(vec3(-4.0, -0.1, -4.0), vec3(4.0, 0.0, 4.0));
    let view = camera(vec3(0.0, 4.0, 6.0), Vec3::ZERO);
    let notes = |triangles: &[[Vec3; 3]], technique: &str| {
        let all = [&ground[..], triangles].concat();
        let (mut r, mut s) =
            start(scene(vec![mesh(&all, 0)], vec![material(Vec3::ONE)], view, sun(TO_LIGHT)), [64, 48]);
        let e = errors(&mut r, &mut s, technique, &["resolution=256"]);
        assert!(e.rmse < 0.1, "{e:?}");
        r.notes().unwrap().join(" ")
    };
    for technique in ["edsm", "sssm"] {
        assert_eq!(notes(&cube, technique), "");
        assert!(notes(&cube[..10], technique).contains("4 edges belong to one triangle only"));
        let doubled = [&cube[..], &cube[..1]].concat();
        assert!(notes(&doubled, technique).contains("3 edges belong to more than two"));
        let flat = [&cube[..], &[[Vec3::ZERO, Vec3::ZERO, Vec3::ONE]]].concat();
        assert!(notes(&flat, technique).contains("1 triangles without an area"));
    }
}

/// Where all edges are drawn none is looked for: that takes three passes fewer, and no room for a list.
#[test]
fn all_edges_need_no_list() {
    let cube = box_of(vec3(-0.5, 1.0, -0.5), vec3(0.5, 2.0, 0.5));
    let ground = box_of(vec3(-4.0, -0.1, -4.0), vec3(4.0, 0.0, 4.0));
    let view = camera(vec3(0.0, 4.0, 6.0), Vec3::ZERO);
    for light in [sun(TO_LIGHT), lamp(vec3(0.5, 4.0, 1.0))] {
        let all = [ground.clone(), cube.clone()].concat();
        let (mut r, mut s) = start(scene(vec![mesh(&all, 0)], vec![material(Vec3::ONE)], view, light), [64, 48]);
        for technique in ["edsm", "sssm"] {
            let [some, every] = ["edges=silhouette", "edges=all"].map(|set| {
                select(&mut s, technique, &["resolution=64", set]);
                r.render(&s, Ask { fresh: true, ..ask(&s) }).unwrap()
            });
            assert_eq!(every.passes + 3, some.passes, "{technique} {}", light.kind());
            assert!(every.gpu_bytes < some.gpu_bytes, "{technique}: {} {}", every.gpu_bytes, some.gpu_bytes);
            // They are seen, more of them than bound the shadow.
            let [some, every] = ["edges=silhouette", "edges=all"].map(|set| {
                select(&mut s, technique, &["resolution=64", set]);
                s.view = "silhouette-edges".into();
                r.render(&s, ask(&s)).unwrap();
                r.read_map().unwrap().iter().filter(|x| **x > 0.0).count()
            });
            assert!(some > 0 && every > some, "{technique}: {some} {every}");
        }
    }
}
