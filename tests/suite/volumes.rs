//! Shadow volumes: exact wherever the mesh lets them, the same of silhouettes and of single triangles everywhere.

use crate::common::*;
use crate::edges::box_of;
use glam::{Vec2, Vec3, vec3};
use shadowscope::frame::{Ask, Renderer};
use shadowscope::light::Light;
use shadowscope::scene::{Camera, Material, Scene};
use shadowscope::setup::Setup;

const SIZE: [u32; 2] = [128, 96];
/// Techniques and parameters whose pictures are all the same, and exact.
const EXACT: &[(&str, &[&str])] = &[
    ("shadow-volume", &[]),
    ("shadow-volume-tri", &[]),
    ("shadow-volume", &["counting=stencil8"]),
    ("shadow-volume-tri", &["counting=stencil8"]),
    ("shadow-volume", &["method=auto"]),
    ("shadow-volume-tri", &["method=auto", "counting=stencil8"]),
];

fn visibility(r: &mut Renderer, s: &mut Setup, technique: &str, sets: &[&str]) -> Vec<f32> {
    select(s, technique, sets);
    r.render(s, Ask { picture: false, ..ask(s) }).unwrap();
    r.read_visibility().unwrap()
}

fn apart(a: &[f32], b: &[f32]) -> Vec<usize> {
    (0..a.len()).filter(|i| a[*i] != b[*i]).collect()
}

/// Whether the truth differs between a pixel and its neighbours: a boundary runs there.
fn on_boundary(truth: &[f32], i: usize) -> bool {
    let [w, h] = SIZE.map(|s| s as usize);
    let (x, y) = (i % w, i / w);
    let [mut rows, columns] = [y.saturating_sub(1)..(y + 2).min(h), x.saturating_sub(1)..(x + 2).min(w)];
    rows.any(|v| columns.clone().any(|u| truth[v * w + u] != truth[i]))
}

/// All of [`EXACT`] agree in every pixel, and with the truth but for `ties` pixels on boundaries; how many face the light.
fn is_exact(r: &mut Renderer, s: &mut Setup, ties: usize, what: &str) -> u64 {
    let truth = visibility(r, s, "rt-hard", &[]);
    let facing = facing(r);
    let mut first = None;
    for (technique, sets) in EXACT {
        let own = visibility(r, s, technique, sets);
        let wrong = apart(&own, &truth);
        assert!(wrong.len() <= ties, "{what}, {technique} {sets:?}: {} wrong pixels, {wrong:?}", wrong.len());
        assert!(wrong.iter().all(|i| on_boundary(&truth, *i)), "{what}, {technique} {sets:?}: {wrong:?}");
        let first = first.get_or_insert_with(|| own.clone());
        assert_eq!(apart(&own, first), [0usize; 0], "{what}, {technique} {sets:?}");
    }
    facing
}

fn lights() -> [Light; 4] {
    let place = vec3(-0.5, 3.0, 2.0);
    [
        sun(vec3(0.5, 0.6, 0.3)),
        spot(vec3(4.0, 7.0, 4.0), Vec3::ZERO, 45.0),
        lamp(place),
        Light::Hemisphere { position: place, direction: -Vec3::Y, range: 60.0, color: Vec3::splat(20.0) },
    ]
}

fn over(triangles: &[[Vec3; 3]], view: Camera) -> (Renderer, Setup) {
    start(scene(vec![mesh(triangles, 0)], vec![material(Vec3::ONE)], view, lights()[0]), SIZE)
}

/// The built-in scenes without holes, under every light of theirs.
#[test]
fn built_in_scenes_are_exact() {
    let mut seen = 0;
    for name in ["cubes", "blocks", "bench", "observatory"] {
        let (mut r, mut s) = built_in(name, SIZE);
        for light in r.scene().lights.clone().iter().filter(|l| l.light.kind() != "rect-area") {
            s.light = light.light;
            seen += is_exact(&mut r, &mut s, 1, &format!("{name}, {}", light.name));
        }
    }
    assert!(seen > 50_000, "{seen}");
}

/// Boxes on a floor from all sides: what touches is not torn, and no surface hides itself.
#[test]
fn boxes_on_a_floor_are_exact() {
    let (mut r, mut s) = over(&yard(), camera(vec3(0.0, 4.0, 10.0), Vec3::ZERO));
    let mut random = Random(5);
    for turn in 0..6 {
        let from = random.point() * vec3(9.0, 0.0, 9.0) + Vec3::Y * (0.3 + 4.0 * random.next());
        s.camera = camera(from, random.point() * vec3(2.0, 0.0, 2.0));
        for light in lights() {
            s.light = light;
            is_exact(&mut r, &mut s, 1, &format!("turn {turn}, {}", light.kind()));
        }
    }
}

/// Open, crowded, twisted, doubled and degenerate: silhouettes and single triangles still agree in every pixel, and are exact.
#[test]
fn any_soup_is_exact() {
    let mut random = Random(11);
    let mut triangles = floor(Vec2::splat(-12.0), Vec2::splat(12.0), 0.0);
    for i in 0..60 {
        let at = random.point() * vec3(3.0, 1.0, 3.0) + Vec3::Y * 1.4;
        let [a, b, c] = [0; 3].map(|_| at + 0.6 * random.point());
        triangles.push([a, b, c]);
        match i % 6 {
            // Twice the same, the other way round, neighbours along one edge, and what has no area.
            0 => triangles.push([a, b, c]),
            1 => triangles.push([a, c, b]),
            2 => triangles.extend([0; 4].map(|_| [a, b, at + 0.6 * random.point()])),
            3 => triangles.push([b, a, at + 0.6 * random.point()]),
            4 => triangles.extend([[a, a, b], [a, b, a.lerp(b, 0.5)], [a; 3]]),
            _ => {}
        }
    }
    let (mut r, mut s) = over(&triangles, camera(vec3(0.0, 3.0, 8.0), Vec3::Y));
    for light in lights() {
        s.light = light;
        is_exact(&mut r, &mut s, 2, light.kind());
    }
}

/// The depth test of old errs by its rounding, along edges.
#[test]
fn the_depth_buffer_is_nearly_exact() {
    let (mut r, mut s) = built_in("blocks", SIZE);
    let truth = visibility(&mut r, &mut s, "rt-hard", &[]);
    for technique in ["shadow-volume", "shadow-volume-tri"] {
        let own = visibility(&mut r, &mut s, technique, &["counting=stencil8", "depth_test=buffer"]);
        let wrong = apart(&own, &truth).len();
        assert!(wrong <= 4, "{technique}: {wrong}");
    }
}

/// Under a roof that hides the light from the eye z-pass starts to count too low; z-fail does not care, and auto knows.
#[test]
fn z_pass_fails_in_a_volume() {
    let mut triangles = floor(Vec2::splat(-12.0), Vec2::splat(12.0), 0.0);
    triangles.extend(box_of(vec3(-2.0, 3.0, 1.0), vec3(2.0, 3.2, 5.0)));
    let (mut r, mut s) = over(&triangles, camera(vec3(0.0, 1.5, 3.0), vec3(0.0, 0.0, -2.0)));
    s.light = sun(Vec3::Y);
    let truth = visibility(&mut r, &mut s, "rt-hard", &[]);
    let facing = facing(&mut r) as usize;
    for technique in ["shadow-volume", "shadow-volume-tri"] {
        for counting in ["counting=stencil8", "counting=additive"] {
            let mut wrong = |method| apart(&visibility(&mut r, &mut s, technique, &[method, counting]), &truth).len();
            assert_eq!(["method=zfail", "method=auto"].map(&mut wrong), [0, 0], "{technique} {counting}");
            assert!(wrong("method=zpass") > facing * 9 / 10, "{technique} {counting}");
        }
    }
    // Beside the shadow nothing stands in the way.
    s.camera = camera(vec3(5.0, 1.5, 8.0), Vec3::ZERO);
    let truth = visibility(&mut r, &mut s, "rt-hard", &[]);
    for method in ["method=zpass", "method=auto"] {
        let own = visibility(&mut r, &mut s, "shadow-volume", &[method]);
        assert_eq!(apart(&own, &truth), [0usize; 0], "{method}");
    }
    // Auto sends no more than z-pass.
    let sent = |r: &mut Renderer, s: &mut Setup, set| {
        select(s, "shadow-volume", &[set]);
        s.light = lamp(vec3(0.0, 9.0, 3.0));
        r.render(s, Ask { analysis: true, ..ask(s) }).unwrap();
        r.analysis().draws(&r.gpu).unwrap().map(|d| d.sent)
    };
    let [auto, pass, fail] = ["method=auto", "method=zpass", "method=zfail"].map(|set| sent(&mut r, &mut s, set));
    assert_eq!(auto, pass);
    assert!(fail.is_none() || fail > pass, "{fail:?} {pass:?}");
}

/// A stair of 300 cards: eight bits take 256 volumes for none, and say so; sixteen-bit floats do not.
#[test]
fn counters_run_over() {
    let mut triangles = floor(Vec2::splat(-6.0), Vec2::splat(6.0), 0.0);
    for i in 0..300i32 {
        let end = 3.0 - 0.1 * (i - 250).max(0) as f32;
        triangles.extend(floor(Vec2::new(-3.0, -2.0), Vec2::new(end, 2.0), 2.0 + 0.002 * i as f32));
    }
    let (mut r, mut s) = over(&triangles, camera(vec3(0.0, 1.2, 7.0), Vec3::ZERO));
    s.light = sun(Vec3::Y);
    let truth = visibility(&mut r, &mut s, "rt-hard", &[]);
    for technique in ["shadow-volume", "shadow-volume-tri"] {
        let own = visibility(&mut r, &mut s, technique, &["counting=additive"]);
        assert_eq!(apart(&own, &truth), [0usize; 0], "{technique}");
        assert!(r.notes().unwrap().is_empty());
        let own = visibility(&mut r, &mut s, technique, &["counting=stencil8"]);
        let wrong = apart(&own, &truth);
        assert!(wrong.len() > 10 && wrong.iter().all(|i| own[*i] == 1.0), "{technique}: {}", wrong.len());
        assert!(r.notes().unwrap().concat().contains("runs over at 256"), "{:?}", r.notes());
    }
}

/// Volumes of fronts alone are the same where the mesh is closed. Where it is not, what turns its back to the light hides nothing,
/// and a note says so.
#[test]
fn fronts_alone_need_closed_meshes() {
    let closed =
        [box_of(vec3(-8.0, -1.0, -8.0), vec3(8.0, 0.0, 8.0)), box_of(vec3(-1.0, 0.5, -1.0), vec3(1.0, 2.0, 1.0))];
    let (mut r, mut s) = over(&closed.concat(), camera(vec3(2.0, 4.0, 8.0), Vec3::ZERO));
    for light in lights() {
        s.light = light;
        let [all, fronts] = ["multiplicity", "closed"]
            .map(|t| visibility(&mut r, &mut s, "shadow-volume", &[&format!("topology={t}")]));
        assert_eq!(apart(&all, &fronts), [0usize; 0], "{}", light.kind());
        assert!(r.notes().unwrap().is_empty());
    }
    // A card that shows the light its back.
    let mut open = floor(Vec2::splat(-8.0), Vec2::splat(8.0), 0.0);
    open.extend(floor(Vec2::splat(-1.0), Vec2::splat(1.0), 1.0).iter().map(|[a, b, c]| [*a, *c, *b]));
    let (mut r, mut s) = over(&open, camera(vec3(2.0, 4.0, 8.0), Vec3::ZERO));
    let truth = visibility(&mut r, &mut s, "rt-hard", &[]);
    assert_eq!(apart(&visibility(&mut r, &mut s, "shadow-volume", &[]), &truth), [0usize; 0]);
    let fronts = visibility(&mut r, &mut s, "shadow-volume", &["topology=closed"]);
    assert!(apart(&fronts, &truth).len() > 50);
    assert!(r.notes().unwrap().concat().contains("8 open edges"), "{:?}", r.notes());
}

/// What has holes by its texture is left out, or taken for whole; the note says which.
#[test]
fn volumes_have_no_holes() {
    let ground = floor(Vec2::splat(-8.0), Vec2::splat(8.0), 0.0);
    let leaf = floor(Vec2::splat(-1.0), Vec2::splat(1.0), 1.5);
    let masked = Material { alpha_cutoff: Some(0.5), ..material(Vec3::ONE) };
    let view = camera(vec3(2.0, 4.0, 8.0), Vec3::ZERO);
    let scene: Scene =
        scene(vec![mesh(&ground, 0), mesh(&leaf, 1)], vec![material(Vec3::ONE), masked], view, lights()[0]);
    let (mut r, mut s) = start(scene, SIZE);
    for technique in ["shadow-volume", "shadow-volume-tri"] {
        // This leaf's mask has no hole.
        let truth = visibility(&mut r, &mut s, "rt-hard", &[]);
        let whole = visibility(&mut r, &mut s, technique, &["holes=whole"]);
        assert_eq!(apart(&whole, &truth), [0usize; 0], "{technique}");
        assert!(r.notes().unwrap().concat().starts_with("2 triangles have holes"), "{:?}", r.notes());
        let none = visibility(&mut r, &mut s, technique, &[]);
        assert!(apart(&none, &truth).len() > 50 && r.notes().unwrap().concat().contains("no shadow"), "{technique}");
    }
}

/// Triangles sent are those of caps and sides: of a box seen by the sun, six edges of its silhouette twice each, or all edges of all
/// its triangles. The stencil is sent all of them for each of the two ways that it counts.
#[test]
fn triangles_are_counted() {
    let (mut r, mut s) = over(&box_of(Vec3::splat(-1.0), Vec3::ONE), camera(vec3(3.0, 4.0, 8.0), Vec3::ZERO));
    for (light, caps, corners) in [(sun(vec3(0.5, 0.6, 0.3)), 1, 1), (lamp(vec3(3.0, 4.0, 2.0)), 2, 2)] {
        s.light = light;
        for (technique, set, sides, times) in [
            ("shadow-volume", "counting=additive", 6, 1),
            ("shadow-volume", "counting=stencil8", 12, 2),
            ("shadow-volume-tri", "counting=additive", 36, 1),
            ("shadow-volume-tri", "counting=stencil8", 36, 2),
        ] {
            select(&mut s, technique, &[set]);
            r.render(&s, Ask { analysis: true, ..ask(&s) }).unwrap();
            let Some(draws) = r.analysis().draws(&r.gpu).unwrap() else { return };
            let what = format!("{technique} {set} {}", light.kind());
            assert_eq!(draws.sent, times * (12 * caps + sides * corners), "{what}");
            assert!(
                draws.drawn > 0 && draws.drawn < 2 * draws.sent / times && draws.fragments > 1000,
                "{what}: {draws:?}"
            );
        }
    }
}

/// What the old depth test counts below 0 is not told as 255 volumes.
#[test]
fn a_stencil_below_none_is_told_as_such() {
    let (mut r, mut s) = built_in("bench", [480, 360]);
    for technique in ["shadow-volume", "shadow-volume-tri"] {
        select(&mut s, technique, &["counting=stencil8", "depth_test=buffer"]);
        s.view = "volume-count".into();
        r.render(&s, ask(&s)).unwrap();
        let counts = r.read_map().unwrap();
        let most = counts.iter().copied().fold(0.0, f32::max);
        println!("{technique}: {most} {:?}", r.notes().unwrap());
        assert!(most > 0.0 && most < 100.0, "{technique}: {most}");
        let notes = r.notes().unwrap().concat();
        assert!(notes.contains("counts below 0"), "{notes}");
    }
}

/// Its lines lie where silhouettes are, in both families by one name.
#[test]
fn silhouettes_are_seen_alike() {
    let (mut r, mut s) = over(&yard(), camera(vec3(0.0, 4.0, 10.0), Vec3::ZERO));
    let [volumes, quads] = ["shadow-volume", "edsm"].map(|technique| {
        select(&mut s, technique, &[]);
        s.view = "silhouette-edges".into();
        r.render(&s, ask(&s)).unwrap();
        r.read_map().unwrap()
    });
    assert_eq!(apart(&volumes, &quads), [0usize; 0]);
    let strong = volumes.iter().filter(|x| **x > 0.9).count();
    let faint = volumes.iter().filter(|x| **x > 0.1 && **x < 0.3).count();
    assert!(strong > 200 && faint > 50, "{strong} {faint}");
}
