//! Cascades: where they are split, what each map covers, and what they bring.

use crate::common::*;
use glam::{DVec2, Vec2, Vec3};
use shadowscope::frame::{Ask, Renderer};
use shadowscope::light::{Light, LightView};
use shadowscope::map::cascades::CascadeParams;
use shadowscope::map::fit::Scope;
use shadowscope::measure::{self, stability};
use shadowscope::params::{Params, Values};
use shadowscope::scene::builtin::cases;
use shadowscope::scene::{Camera, builtin};
use shadowscope::setup::Setup;
use shadowscope::techniques::pssm::{PssmParams, Seen, crops, lamp_views, light_views, sphere, split_range, splits};

fn opened(name: &str, size: [u32; 2]) -> (Renderer, Setup) {
    start(builtin::build(name).unwrap(), size)
}

/// A set-up of a technique, with parameters as on the command line.
fn with(setup: &Setup, technique: &str, sets: &[&str]) -> Setup {
    let mut s = setup.clone();
    s.params.clear();
    s.select(technique).unwrap();
    for set in sets {
        s.set(set, &[technique.into()]).unwrap();
    }
    s
}

fn share(r: &mut Renderer, setup: &Setup, technique: &str, sets: &[&str]) -> f64 {
    measure::errors(r, &with(setup, technique, sets)).unwrap().share()
}

/// Renders with the analysis.
fn analysed(r: &mut Renderer, setup: &Setup) {
    r.render(setup, Ask { analysis: true, ..ask(setup) }).unwrap();
}

fn facing(r: &mut Renderer) -> Vec<bool> {
    r.read_mask().unwrap().into_iter().map(|m| m == 2).collect()
}

/// View samples in each cascade.
fn samples(r: &Renderer) -> Vec<u64> {
    let maps = r.analysis().maps().unwrap();
    let each = maps.layer();
    let mut sums = vec![0; maps.layers as usize];
    let found = r.analysis().counts(&r.gpu, |first, counts| {
        for (k, n) in counts.iter().enumerate() {
            sums[((first + k as u64) / each) as usize] += *n as u64;
        }
    });
    assert!(found.unwrap());
    sums
}

fn pssm(lambda: f32, split_bias: f32) -> PssmParams {
    PssmParams { lambda, split_bias, ..PssmParams::read(&Values::new()) }
}

/// Zhang 2006: even, logarithmic, and halfway; δ and one's own shares keep the order.
#[test]
fn splits_follow_their_formulas() {
    let (n, f) = (0.5, 128.0);
    let near = |a: &[f64], b: &[f64]| {
        assert!(a.len() == b.len() && a.iter().zip(b).all(|(x, y)| (x - y).abs() < 1e-5 * y), "{a:?} {b:?}")
    };
    near(&splits(&pssm(0.0, 0.0), 4, n, f), &[0.5, 32.375, 64.25, 96.125, 128.0]);
    // A ratio of 256 in four steps of 4.
    near(&splits(&pssm(1.0, 0.0), 4, n, f), &[0.5, 2.0, 8.0, 32.0, 128.0]);
    near(&splits(&pssm(0.5, 0.0), 4, n, f), &[0.5, 17.1875, 36.125, 64.0625, 128.0]);
    near(&splits(&pssm(1.0, 0.1), 4, n, f), &[0.5, 5.1875, 11.1875, 35.1875, 128.0]);
    near(&splits(&pssm(0.5, 0.0), 1, n, f), &[0.5, 128.0]);
    for count in 1..=8 {
        for lambda in [0.0, 0.3, 1.0] {
            for delta in [0.0, 0.5, 1.0] {
                let all = splits(&pssm(lambda, delta), count, n, f);
                assert_eq!((all.len(), all[0], all[count as usize]), (count as usize + 1, n, f));
                assert!(all.windows(2).all(|w| w[0] <= w[1]), "{all:?}");
            }
        }
    }
    let mut own = PssmParams { scheme: "percent".into(), ..pssm(0.5, 0.0) };
    (own.percent_1, own.percent_2, own.percent_3) = (10.0, 5.0, 60.0);
    near(&splits(&own, 4, 1.0, 101.0), &[1.0, 11.0, 11.0, 61.0, 101.0]);
}

/// What is split holds all that the camera sees of the scene, and little more; in steps under the stable fit, so that it
/// seldom changes.
#[test]
fn the_range_that_is_seen_is_split() {
    let bounds = [Vec3::new(-20.0, 0.0, -20.0), Vec3::new(20.0, 5.0, 20.0)];
    let mut last = [0.0; 2];
    let mut steps = 0;
    for i in 0..200 {
        let position = Vec3::new(40.0 - 0.1 * i as f32, 8.0, 3.0);
        let camera = Camera::new(position, Vec3::ZERO, 40.0, 0.1, 1000.0);
        let scope = Scope { camera, light: sun(Vec3::Y), bounds, aspect: 1.5, resolution: 512, margin: 1.0 };
        let range = |range: &str, fit: &str| {
            split_range(&PssmParams { range: range.into(), fit: fit.into(), ..pssm(0.5, 0.0) }, &scope)
        };
        assert_eq!(range("camera", "stable"), [0.1f32 as f64, 1000.0]);
        let ([near, far], coarse) = (range("scene", "indep"), range("scene", "stable"));
        let depth = |p: Vec3| camera.forward().dot(p - position) as f64;
        // The box's farthest corner is in view or hardly beside it; nothing of the box lies nearer than its side.
        let corner = |i: usize| Vec3::new(bounds[i & 1].x, bounds[i >> 1 & 1].y, bounds[i >> 2].z);
        let last_corner = (0..8).map(corner).map(depth).fold(0.0, f64::max);
        assert!(far <= last_corner * 1.001 && far > 0.8 * last_corner, "{far} {last_corner}");
        assert!(near >= 0.1 && near < depth(Vec3::ZERO) && (position.x < 25.0 || near > 5.0), "{near}");
        let step = 2f64.powf(0.2501);
        assert!(coarse[0] <= near * 1.001 && near < coarse[0] * step, "{near} {coarse:?}");
        assert!(coarse[1] >= far * 0.999 && far > coarse[1] / step, "{far} {coarse:?}");
        steps += (coarse != last) as usize;
        last = coarse;
    }
    assert!((2..30).contains(&steps), "{steps}");
    // Where nothing is seen, all that the camera has.
    let camera = Camera::new(Vec3::Y * 9.0, Vec3::Y * 99.0, 40.0, 0.1, 1000.0);
    let scope = Scope { camera, light: sun(Vec3::Y), bounds, aspect: 1.5, resolution: 512, margin: 1.0 };
    assert_eq!(split_range(&pssm(0.5, 0.0), &scope), [0.1f32 as f64, 1000.0]);
}

/// A camera that can see far beyond its scene wastes no cascade on that.
#[test]
fn cascades_are_spent_on_the_scene() {
    let (mut r, s) = opened("observatory", [160, 160]);
    let sets = |range| ["resolution=64", range];
    let [all, seen] = ["range=camera", "range=scene"].map(|range| share(&mut r, &s, "pssm", &sets(range)));
    let visible = share(&mut r, &s, "pssm", &["resolution=64", "fit=samples", "range=visible"]);
    println!("{all:.4}, of the scene {seen:.4}, visible {visible:.4}");
    assert!(seen < 0.9 * all && visible < 0.6 * seen, "{all} {seen} {visible}");
}

/// Between the nearest and the farthest sample a logarithmic split is that of sample distribution shadow maps.
#[test]
fn the_visible_range_is_that_of_the_samples() {
    let (mut r, s) = opened("bench", [160, 100]);
    let common = ["resolution=256", "blend=0"];
    let mut count = |name: &str, sets: &[&str]| {
        analysed(&mut r, &with(&s, name, &[&common[..], sets].concat()));
        samples(&r)
    };
    let ours = count("pssm", &["fit=samples", "range=visible", "lambda=1"]);
    let theirs = count("sdsm", &["scheme=log", "dilate=0", "min_box=0.001"]);
    let other: u64 = ours.iter().zip(&theirs).map(|(a, b)| a.abs_diff(*b)).sum();
    assert!(other <= 4 && ours.iter().all(|n| *n > 0), "{ours:?} {theirs:?}");
}

/// The crop ends where either nothing receives or nothing casts, and begins at the first caster (Navratil 2015, figure 3.8).
#[test]
fn a_crop_is_where_things_cast_and_receive() {
    // Over a tile of 4 × 4 m a board of 2 × 2 m, out of view; far off another tile with nothing above it, out of view too.
    let mut triangles = floor(Vec2::splat(-2.0), Vec2::splat(2.0), 0.0);
    triangles.extend(floor(Vec2::splat(-1.0), Vec2::splat(1.0), 9.0));
    triangles.extend(floor(Vec2::splat(200.0), Vec2::splat(210.0), 0.0));
    let mut view = camera(Vec3::new(0.0, 3.0, 20.0), Vec3::ZERO);
    (view.near, view.far) = (1.0, 60.0);
    let (r, s) = start(scene(vec![mesh(&triangles, 0)], vec![material(Vec3::ONE)], view, sun(Vec3::Y)), [96, 96]);
    let set = with(&s, "pssm", &["fit=crop", "cascades=1", "range=camera", "resolution=256", "blend=0"]);
    let side = |v: &LightView| [v.row_x, v.row_y].map(|row| 2.0 / row.truncate().length() * (254.0 / 256.0));
    let cropped = views_of(&r, &set)[0];
    let whole = views_of(&r, &with(&s, "pssm", &["fit=indep", "cascades=1", "range=camera", "resolution=256"]))[0];
    assert!(side(&cropped).iter().all(|m| (m - 4.0).abs() < 1e-3), "{:?}", side(&cropped));
    assert!(side(&whole).iter().all(|m| *m > 15.0), "{:?}", side(&whole));
    let depth = cropped.far - cropped.near;
    assert!((depth - 9.0).abs() < 1e-3, "{depth}");
}

/// Maps with sides of their own: each is used in its own part of its layer, and counted as large as it is.
#[test]
fn each_cascade_has_a_resolution() {
    let p =
        CascadeParams { resolution: 1024, resolution_2: 512, resolution_4: 128, ..CascadeParams::read(&Values::new()) };
    assert_eq!(p.sides(), [1024, 512, 512, 128]);
    let (mut r, s) = opened("bench", [160, 100]);
    let sides = [256u64, 128, 128, 64];
    for (name, set) in [("pssm", "fit=stable"), ("pssm", "fit=samples"), ("sdsm", "scheme=log")] {
        let own = ["resolution=256", "resolution_2=128", "resolution_4=64", set];
        analysed(&mut r, &with(&s, name, &own));
        let facing = facing(&mut r).into_iter().filter(|f| *f).count() as u64;
        let maps = r.analysis().maps().unwrap();
        assert_eq!(maps.texels(), sides.iter().map(|side| side * side).sum::<u64>());
        assert_eq!(samples(&r).iter().sum::<u64>(), facing, "{name} {set}");
        let counted = r.analysis().counts(&r.gpu, |first, counts| {
            for at in counts.iter().enumerate().filter(|(_, n)| **n > 0).map(|(k, _)| first + k as u64) {
                let (layer, x, y) = (at / maps.layer(), at % 256, at / 256 % 256);
                assert!(x.max(y) < sides[layer as usize], "{name} {set}: {x} {y} of map {layer}");
            }
        });
        assert!(counted.unwrap());
        // As right as four maps between the smallest and the largest.
        let [fine, coarse] = ["resolution=256", "resolution=64"].map(|side| share(&mut r, &s, name, &[side, set]));
        let mixed = share(&mut r, &s, name, &own);
        println!("{name} {set}: {fine:.4} {mixed:.4} {coarse:.4}");
        assert!(fine < mixed && mixed < coarse, "{name} {set}: {fine} {mixed} {coarse}");
    }
}

/// The sphere of a slice holds its corners, and no smaller one around the axis does.
#[test]
fn the_sphere_is_the_smallest() {
    for (a, b, k) in [(0.1, 1.0, 0.2), (1.0, 40.0, 0.05), (3.0, 4.0, 0.9), (5.0, 5.0, 0.5), (0.5, 20.0, 2.0)] {
        let [z, r] = sphere(a, b, k);
        let reach = |c: f64| [a, b].map(|d: f64| ((d - c).powi(2) + d * d * k).sqrt()).into_iter().fold(0.0, f64::max);
        assert!((reach(z) - r).abs() < 1e-9 * r, "{a} {b} {k}: {} and {r}", reach(z));
        for other in [z - 0.01 * r, z + 0.01 * r] {
            assert!(reach(other) > r - 1e-9, "{a} {b} {k}");
        }
    }
}

/// Navratil 2015, figure 3.7: along the axis the worst aliasing of each slice, of those across the view.
#[test]
fn lambda_decides_where_aliasing_is_worst() {
    let worst = |lambda: f32| -> Vec<f64> {
        let all = splits(&pssm(lambda, 0.0), 4, 1.0, 256.0);
        // A slice's map is as wide as the slice; a pixel as its distance: the nearest point is worst.
        all.windows(2).map(|w| (w[1] - w[0]) / w[0]).collect()
    };
    let log = worst(1.0);
    assert!(log.iter().all(|m| (m / log[0] - 1.0).abs() < 1e-6), "{log:?}");
    let even = worst(0.0);
    assert!(even[0] > 20.0 * log[0] && even.windows(2).all(|w| w[0] > 10.0 * w[1] || w[0] > w[1]), "{even:?}");
    let half = worst(0.5);
    assert!(log[0] < half[0] && half[0] < even[0] && half[3] < log[3], "{half:?}");
}

/// The same on the screen: with λ = 1 the cascades' worst m on a floor are alike, with λ = 0 the first is far worse.
#[test]
fn drawn_cascades_alias_as_lambda_says() {
    let mut camera = camera(Vec3::new(0.0, 2.0, 0.0), Vec3::new(0.0, 1.2, -8.0));
    (camera.near, camera.far) = (2.0, 128.0);
    let floor = floor(Vec2::new(-150.0, -150.0), Vec2::new(150.0, 10.0), 0.0);
    let scene = scene(vec![mesh(&floor, 0)], vec![material(Vec3::ONE)], camera, sun(Vec3::new(0.2, 1.0, 0.1)));
    let (mut r, s) = start(scene, [128, 128]);
    let mut worst = |lambda: f32| {
        let set =
            with(&s, "pssm", &["fit=indep", "range=camera", "blend=0", "cascades=3", &format!("lambda={lambda:?}")]);
        analysed(&mut r, &set);
        let m = r.analysis().aliasing(&r.gpu).unwrap().unwrap();
        let depth = r.read_position().unwrap();
        let all = splits(&pssm(lambda, 0.0), 3, 2.0, 128.0);
        let mut worst = [0f32; 3];
        for (m, p) in m.iter().zip(&depth).filter(|(m, _)| m[0] > 0.0) {
            let i = all[1..3].iter().filter(|z| p[3] as f64 >= **z).count();
            // The perspective part: what distances decide.
            worst[i] = worst[i].max(m[1]);
        }
        worst
    };
    let (even, log) = (worst(0.0), worst(1.0));
    assert!(log[1] < 1.6 * log[2] && log[2] < 1.6 * log[1], "{log:?}");
    assert!(even[0] > 2.5 * log[0].max(log[1]), "{even:?} {log:?}");
    assert!(even[0] > 4.0 * even[2], "{even:?}");
}

/// Cascades that no sample needs draw no triangle.
#[test]
fn unused_cascades_draw_nothing() {
    let (mut r, mut s) = opened("bench", [96, 64]);
    // Straight down: all samples are in one cascade.
    s.camera.target = s.camera.position - Vec3::Y * 2.0;
    (s.camera.near, s.camera.far) = (0.5, 1000.0);
    analysed(&mut r, &with(&s, "pssm", &["cascades=8", "blend=0", "range=camera"]));
    let (many, drawn) = (samples(&r), r.analysis().draws(&r.gpu).unwrap());
    assert_eq!(many.iter().filter(|n| **n > 0).count(), 1, "{many:?}");
    if let Some(sent) = drawn.map(|d| d.sent) {
        // One map alone, so that no triangle is sent twice.
        let all = r.geometry().triangles.len() as u64;
        assert!(sent > all / 4 && sent <= all, "{sent} of {all}");
    }
}

/// A map of 512² on a landscape: four cascades beat one map, fitted or not.
#[test]
fn four_cascades_beat_one_map() {
    let (mut r, s) = opened("terrain", [256, 256]);
    let scene = share(&mut r, &s, "shadow-map", &["resolution=512", "fit=scene"]);
    let fitted = share(&mut r, &s, "shadow-map", &["resolution=512"]);
    // The stable maps pay for their steadiness with empty corners, and reach as far as the camera does.
    for (name, set, gain) in [
        ("pssm", "fit=stable", 0.65),
        ("pssm", "fit=samples", 0.5),
        ("sdsm", "scheme=log", 0.5),
        ("sdsm", "scheme=kmeans", 0.5),
    ] {
        let own = share(&mut r, &s, name, &["resolution=512", set]);
        println!("{name} {set}: {own:.4}; whole {scene:.4}, fitted {fitted:.4}");
        assert!(own < fitted && own < gain * scene, "{name} {set}: {own}; whole {scene}, fitted {fitted}");
    }
}

/// One cropped cascade is the fitted shadow map.
fn cropped_as_fitted(r: &mut Renderer, s: &Setup) {
    let mut draw = |name: &str, sets: &[&str]| {
        let set = with(s, name, sets);
        r.render(&set, ask(&set)).unwrap();
        r.read_visibility().unwrap()
    };
    let map = draw("shadow-map", &["resolution=512"]);
    let cascade = draw("pssm", &["resolution=512", "cascades=1", "fit=samples"]);
    let other = map.iter().zip(&cascade).filter(|(a, b)| a != b).count();
    assert!(other <= map.len() / 1000, "{other} of {} pixels differ", map.len());
    assert!(map.contains(&0.0) && map.contains(&1.0));
}

#[test]
fn one_cropped_cascade_is_a_fitted_map() {
    let (mut r, s) = opened("bench", [160, 100]);
    cropped_as_fitted(&mut r, &s);
}

/// A caster behind the camera, nearer to the light than any map reaches, keeps its shadow.
#[test]
fn casters_out_of_view_keep_their_shadows() {
    // A tall pole stands behind the camera; its shadow lies before it.
    let mut triangles = floor(Vec2::splat(-60.0), Vec2::splat(60.0), 0.0);
    let p = |x: f32, y: f32, z: f32| Vec3::new(x, y, z);
    triangles.push([p(-3.0, 0.0, 30.0), p(3.0, 0.0, 30.0), p(0.0, 60.0, 30.0)]);
    let camera = camera(Vec3::new(0.0, 3.0, 10.0), Vec3::new(0.0, 0.0, 0.0));
    let scene = scene(vec![mesh(&triangles, 0)], vec![material(Vec3::ONE)], camera, sun(Vec3::new(0.0, 1.0, 1.0)));
    let (mut r, s) = start(scene, [128, 96]);
    for (name, set) in [
        ("pssm", "fit=indep"),
        ("pssm", "fit=stable"),
        ("pssm", "fit=crop"),
        ("pssm", "fit=samples"),
        ("sdsm", "scheme=log"),
    ] {
        let e = measure::errors(&mut r, &with(&s, name, &[set])).unwrap();
        assert!(e.shadow_correct > 300 && e.share() < 0.01, "{name} {set}: {e:?}");
    }
}

/// Under translation and rotation of the camera the stable maps' texels keep their places in the world.
#[test]
fn stable_texels_stay_in_the_world() {
    let light = sun(Vec3::new(0.5, 1.0, 0.3));
    let c = CascadeParams { resolution: 512, ..CascadeParams::read(&Values::new()) };
    let whole = LightView::whole(&light, [Vec3::splat(-50.0), Vec3::splat(50.0)], c.resolution, 1.0).unwrap();
    let mut random = Random(7);
    let mut fractions = |snap: bool| {
        let p = PssmParams { snap, ..pssm(0.5, 0.0) };
        let mut first: Option<Vec<DVec2>> = None;
        let mut most = 0f64;
        for _ in 0..200 {
            let position = random.point() * 20.0;
            let camera = Camera::new(position, position + random.point(), 50.0, 0.5, 60.0);
            let seen = Seen { camera: &camera, aspect: 1.5, whole, reach: 0.0 };
            let views = light_views(&p, &c, &splits(&p, 4, 0.5, 60.0), &seen, &[None; 4]);
            // The texel that holds the world's origin, with its fraction.
            let at = |v: &LightView| DVec2::new(v.row_x.w as f64, -v.row_y.w as f64) * 0.5 * v.resolution as f64;
            let now: Vec<DVec2> = views.iter().map(at).collect();
            if let Some(first) = &first {
                for (a, b) in first.iter().zip(&now) {
                    let d = *a - *b;
                    most = most.max((d - d.round()).abs().max_element());
                }
            }
            first.get_or_insert(now);
        }
        most
    };
    let (snapped, loose) = (fractions(true), fractions(false));
    assert_eq!(snapped, 0.0, "texels off");
    assert!(loose > 0.4, "{loose} texels off");
}

/// The light's views of a set-up of pssm, as the technique fits them, and what they were fitted with.
fn views_of(r: &Renderer, setup: &Setup) -> Vec<LightView> {
    let (p, c) = (PssmParams::read(setup.values()), CascadeParams::read(setup.values()));
    let whole = LightView::whole(&setup.light, r.geometry().bounds, c.resolution, 1.0).unwrap();
    let camera = &setup.camera;
    let aspect = setup.size[0] as f32 / setup.size[1] as f32;
    let bounds = r.geometry().bounds;
    let scope = Scope { camera: *camera, light: setup.light, bounds, aspect, resolution: c.resolution, margin: 1.0 };
    let [near, far] = split_range(&p, &scope);
    let all = splits(&p, c.cascades, near, far);
    let crops = crops(&p, &c, &all, &scope, r.geometry());
    light_views(&p, &c, &all, &Seen { camera, aspect: aspect as f64, whole, reach: 0.0 }, &crops)
}

/// Whole texels by which the maps' content moves from one light view to another of the same cascade; None where it is no
/// whole number, or anything else differs. `steps`: also the depth may have moved.
fn moved(a: &LightView, b: &LightView, steps: bool) -> Option<[i32; 2]> {
    let texels = |of: fn(&LightView) -> f32| (of(b) - of(a)) * 0.5 * a.resolution;
    let by = [texels(|v| v.row_x.w), -texels(|v| v.row_y.w)];
    let mut same = *b;
    (same.row_x.w, same.row_y.w) = (a.row_x.w, a.row_y.w);
    if steps {
        (same.row_z, same.axis) = (a.row_z, a.axis);
    }
    (same == *a && by.iter().all(|t| t.fract() == 0.0)).then(|| by.map(|t| t as i32))
}

/// So no texel crawls. Along the path each map stays as it is, bit for bit, or steps by whole texels. The label of a pixel
/// then changes only where the pixel's sample moves over an edge in the map: as often in the frames in which a map steps as
/// in those in which none does. That is not quite as often as the truth's edges are crossed: a staircase of texels is on
/// average 4/π as long as the edge that it follows, but lacks what is finer than a texel.
#[test]
fn stable_maps_do_not_crawl() {
    let case = cases::find("st-jitter").unwrap();
    let (mut r, setup) = opened("st-jitter", stability::SIZE);
    let mut run = |sets: &[&str]| {
        let mut set = with(&setup, "pssm", sets);
        let run = stability::Run { techniques: vec!["pssm".into()], frames: case.frames, cost: false };
        let found = stability::run(&mut r, &case.into(), &set, &run, &mut |_| true).unwrap();
        let points = found.tracks[0].points.clone();
        let mut views = Vec::new();
        for p in &points {
            (case.place)(&mut set, p.t);
            views.push(views_of(&r, &set));
        }
        // For each frame by how much its maps moved since the last one.
        let steps: Vec<Option<Vec<[i32; 2]>>> = views
            .windows(2)
            .map(|w| w[0].iter().zip(&w[1]).map(|(a, b)| moved(a, b, false)).collect::<Option<Vec<_>>>())
            .collect();
        (points, steps)
    };
    // Label changes against the truth's, over some of the frames.
    let ratio = |points: &[stability::Point], frames: &dyn Fn(usize) -> bool| {
        let sum = |of: fn(&stability::Point) -> Option<f64>| {
            (1..points.len()).filter(|k| frames(*k)).filter_map(|k| of(&points[k])).sum::<f64>()
        };
        sum(|p| p.change.map(|c| c.label_changes)) / sum(|p| p.change.map(|c| c.truth_label_changes))
    };
    let (points, steps) = run(&["snap=true"]);
    let steps: Vec<bool> = steps
        .into_iter()
        .map(|s| s.expect("a map moved by no whole texel").into_iter().any(|by| by != [0, 0]))
        .collect();
    let stepping = steps.iter().filter(|s| **s).count();
    assert!((3..=20).contains(&stepping), "the maps step in {stepping} frames");
    let (still, stepped) = (ratio(&points, &|k| !steps[k - 1]), ratio(&points, &|k| steps[k - 1]));
    let all = ratio(&points, &|_| true);
    let (loose, moves) = run(&["snap=false"]);
    assert!(moves.iter().all(Option::is_none), "without snapping no map stays");
    // All frames, and those in which the camera turns.
    let loose = [ratio(&loose, &|_| true), ratio(&loose, &|k| k > case.frames / 2)];
    println!(
        "maps still {still:.3}, stepping {stepped:.3}, all {all:.3}, not snapped {loose:.3?} × the truth's changes"
    );
    assert!(stepped < 1.05 * still, "steps show: {stepped} against {still}");
    assert!((all - 1.0).abs() < 0.1 && still < 4.0 / std::f64::consts::PI, "{all} {still}");
    assert!(loose[0] > 1.15 * all && loose[1] > 1.4 * all, "{loose:?}");
}

/// Each place of the world keeps its texel and the depth in it when the camera moves by several texels and turns.
#[test]
fn stable_maps_hold_the_same_texels_elsewhere() {
    let (mut r, setup) = opened("st-jitter", [512; 2]);
    let (cascades, side) = (4, 256);
    // Depths of the maps, as the picture of them holds them where a pixel is a texel.
    let mut draw = |snap: &str, by: Vec3, turn: f32| {
        let mut set = with(&setup, "pssm", &["resolution=256", "fit=stable", snap]);
        let camera = &mut set.camera;
        let gaze = glam::Mat3::from_rotation_y(turn) * (camera.target - camera.position);
        camera.position += by;
        camera.target = camera.position + gaze;
        set.view = "shadow-maps".into();
        r.render(&set, ask(&set)).unwrap();
        let depth = |v: f32| ((v - 24.0) / 0.99 - 0.05) / 0.9;
        let map = r.read_map().unwrap().into_iter().map(depth).collect::<Vec<f32>>();
        (views_of(&r, &set), map)
    };
    let mut other = |snap: &str| {
        let (from, before) = draw(snap, Vec3::ZERO, 0.0);
        let (to, after) = draw(snap, Vec3::new(0.53, 0.11, -0.37), 0.02);
        let (mut seen, mut other) = (0, 0);
        for i in 0..cascades {
            let (a, b) = (&from[i], &to[i]);
            let by = match moved(a, b, true) {
                Some(by) => by,
                None => [b.row_x.w - a.row_x.w, a.row_y.w - b.row_y.w].map(|w| (w * 0.5 * side as f32).round() as i32),
            };
            assert_eq!(moved(a, b, true).is_some(), snap == "snap=true", "cascade {i}");
            let at = |x: i32, y: i32| ((y + (i as i32 / 2) * side) * 2 * side + x + (i as i32 % 2) * side) as usize;
            // Without the frame drawn around each map.
            for (x, y) in (6..side - 6).flat_map(|y| (6..side - 6).map(move |x| (x, y))) {
                let (u, v) = (x + by[0], y + by[1]);
                if !(6..side - 6).contains(&u) || !(6..side - 6).contains(&v) {
                    continue;
                }
                let (d, e) = (before[at(x, y)], after[at(u, v)]);
                // Flat on the near or the far plane, which may have moved.
                if [d, e].iter().any(|d| *d < 1e-4 || *d > 1.0 - 1e-4) {
                    continue;
                }
                let metres = |v: &LightView, d: f32| v.far - d * (v.far - v.near) - v.axis.w;
                seen += 1;
                other += ((metres(a, d) - metres(b, e)).abs() > 1e-5 * (a.far - a.near)) as usize;
            }
        }
        (other, seen)
    };
    let ((other_snapped, seen), (other_loose, _)) = (other("snap=true"), other("snap=false"));
    println!("{other_snapped} of {seen} texels differ, without snapping {other_loose}");
    assert!(seen > 50_000 && other_snapped < seen / 2000, "{other_snapped} of {seen}");
    assert!(other_loose > seen / 20, "{other_loose} of {seen}");
}

/// Splits lie between the nearest and the farthest sample that faces the light, by a reference on the CPU.
#[test]
fn sample_distribution_matches_a_reference() {
    let (mut r, s) = opened("bench", [160, 100]);
    for scheme in ["log", "adaptive-log", "kmeans"] {
        let set = with(&s, "sdsm", &[&format!("scheme={scheme}"), "blend=0", "resolution=256"]);
        analysed(&mut r, &set);
        let mask = facing(&mut r);
        let mut depths: Vec<f64> =
            r.read_position().unwrap().iter().zip(&mask).filter(|(_, f)| **f).map(|(p, _)| p[3] as f64).collect();
        depths.sort_by(f64::total_cmp);
        let (low, high) = (depths[0], depths[depths.len() - 1]);
        let all: Vec<f64> = match scheme {
            "log" => (1..4).map(|i| low * (high / low).powf(i as f64 / 4.0)).collect(),
            "adaptive-log" => (1..4).map(|i| depths[depths.len() * i / 4]).collect(),
            _ => {
                let logs: Vec<f64> = depths.iter().map(|z| z.ln()).collect();
                let mut means: Vec<f64> = (0..4).map(|i| logs[(logs.len() * (2 * i + 1)) / 8]).collect();
                let cuts = |m: &[f64]| -> Vec<f64> { m.windows(2).map(|w| (w[0] + w[1]) / 2.0).collect() };
                for _ in 0..8 {
                    let at = cuts(&means);
                    for (i, mean) in means.iter_mut().enumerate() {
                        let from = if i > 0 { logs.partition_point(|z| *z < at[i - 1]) } else { 0 };
                        let to = if i < 3 { logs.partition_point(|z| *z < at[i]) } else { logs.len() };
                        *mean = logs[from..to].iter().sum::<f64>() / (to - from) as f64;
                    }
                }
                cuts(&means).iter().map(|z| z.exp()).collect()
            }
        };
        // Within two of the 1024 bins, by the samples that the cascades got.
        let bin = (high / low).powf(2.0 / 1024.0);
        let below = |z: f64| depths.partition_point(|d| *d < z) as u64;
        let mut sum = 0;
        for (got, z) in samples(&r).iter().zip(&all) {
            sum += got;
            assert!((below(z / bin)..=below(z * bin)).contains(&sum), "{scheme}: {sum} samples before {z}");
        }
        // The boxes hold the samples tightly: some texel within 2 + 1 + 1 of each border of each map is used.
        let maps = r.analysis().maps().unwrap();
        let (side, layers) = (maps.size[0] as u64, maps.layers as usize);
        let mut ends = vec![[side, 0, side, 0]; layers];
        let reading = r.analysis().counts(&r.gpu, |first, counts| {
            for (k, _) in counts.iter().enumerate().filter(|(_, n)| **n > 0) {
                let at = first + k as u64;
                let (x, y, e) = (at % side, at / side % side, &mut ends[(at / side / side) as usize]);
                *e = [e[0].min(x), e[1].max(x), e[2].min(y), e[3].max(y)];
            }
        });
        assert!(reading.unwrap());
        for [left, right, top, bottom] in ends {
            assert!((2..=4).contains(&left) && (2..=4).contains(&top), "{scheme}: {left} {top}");
            assert!(
                (side - 5..=side - 3).contains(&right) && (side - 5..=side - 3).contains(&bottom),
                "{right} {bottom}"
            );
        }
    }
}

/// Smoothed boxes and splits go on from the last frame, and start anew when the camera jumps.
#[test]
fn smoothing_remembers_until_the_camera_jumps() {
    let (mut r, s) = opened("st-depthrange", [96, 96]);
    let counts = |r: &mut Renderer, s: &Setup| {
        analysed(r, s);
        samples(r)
    };
    let set = with(&s, "sdsm", &["smoothing=0.9", "scheme=kmeans", "blend=0"]);
    let fresh = counts(&mut r, &set);
    let mut step = set.clone();
    let right = set.camera.view().row(0).truncate();
    step.camera.target += right * 0.2;
    let moved = counts(&mut r, &step);
    let again = counts(&mut r, &step);
    assert_ne!(moved, again, "the splits creep on");
    // Turned away by far more than 10°, and back.
    let mut away = set.clone();
    away.camera.target = away.camera.position + right - Vec3::Y * 0.5;
    counts(&mut r, &away);
    assert_eq!(counts(&mut r, &set), fresh, "forgotten after a jump");
    // In a sweep the configuration before is none of its business.
    counts(&mut r, &with(&s, "sdsm", &["smoothing=0.9", "scheme=log", "blend=0"]));
    assert_eq!(counts(&mut r, &set), fresh, "forgotten with other parameters");
    let plain = with(&s, "sdsm", &["scheme=kmeans", "blend=0"]);
    assert_eq!(counts(&mut r, &plain), fresh, "nothing to remember in the first frame");
}

/// The blur is as wide in metres in each cascade, and softens edges.
#[test]
fn the_blur_spans_the_same_metres_in_all_cascades() {
    // A half-plane casts a straight edge along the view, through all cascades.
    let mut triangles = floor(Vec2::new(-40.0, -80.0), Vec2::new(40.0, 10.0), 0.0);
    triangles.extend(floor(Vec2::new(-20.0, -80.0), Vec2::new(0.0, 10.0), 6.0));
    let mut view = camera(Vec3::new(0.0, 2.0, 4.0), Vec3::new(0.0, 0.5, -4.0));
    (view.near, view.far) = (1.0, 60.0);
    let light = Light::Directional { to_light: Vec3::Y, angular_radius: 0.0, color: Vec3::ONE };
    let scene = scene(vec![mesh(&triangles, 0)], vec![material(Vec3::ONE)], view, light);
    let (mut r, s) = start(scene, [256, 160]);
    let set = with(
        &s,
        "pssm",
        &[
            "filter=pcf",
            "blur=0.8",
            "kernel=9",
            "resolution=2048",
            "cascades=3",
            "blend=0",
            "lambda=0.7",
            "range=camera",
        ],
    );
    analysed(&mut r, &set);
    let all = splits(&pssm(0.7, 0.0), 3, 1.0, 60.0);
    let (v, p) = (r.read_visibility().unwrap(), r.read_position().unwrap());
    for (i, w) in all.windows(2).enumerate() {
        let soft: Vec<f32> = v
            .iter()
            .zip(&p)
            .filter(|(v, p)| {
                **v > 0.0
                    && **v < 1.0
                    && p[3] > 0.0
                    && (w[0]..w[1]).contains(&(p[3] as f64))
                    && p[1] < 1.0
                    && p[0].abs() < 5.0
            })
            .map(|(_, p)| p[0])
            .collect();
        let low = soft.iter().copied().fold(f32::MAX, f32::min);
        let high = soft.iter().copied().fold(f32::MIN, f32::max);
        assert!(
            soft.len() > 5 && high < 0.42 && low > -0.42 && high - low > 0.35,
            "{i}: {low} to {high}, {}",
            soft.len()
        );
    }
}

const FITS: [(&str, &[&str]); 6] = [
    ("pssm", &["fit=indep"]),
    ("pssm", &["fit=stable"]),
    ("pssm", &["fit=samples", "blend=0"]),
    ("pssm", &["fit=stable", "filter=pcf", "blur=0.1", "normal_offset=1"]),
    ("sdsm", &["scheme=log"]),
    ("sdsm", &["scheme=kmeans", "cascades=7"]),
];

/// Casters behind the camera, and close to the lamp, keep their shadows; those behind the lamp cast none.
#[test]
fn a_spots_casters_are_kept() {
    let p = |x: f32, y: f32, z: f32| Vec3::new(x, y, z);
    let mut triangles = floor(Vec2::splat(-500.0), Vec2::splat(500.0), 0.0);
    triangles.extend(floor(Vec2::new(-0.06, -0.2), Vec2::new(0.0, 0.2), 7.9));
    // A wall that begins behind the lamp and goes on before it, and one behind it.
    triangles.push([p(-40.0, 0.0, 6.0), p(60.0, 0.0, 6.0), p(0.0, 3.0, 6.0)]);
    triangles.push([p(-3.0, 0.0, -40.0), p(-3.0, 0.0, 40.0), p(-3.0, 30.0, 0.0)]);
    let light = spot(p(0.0, 8.0, 0.0), p(7.0, -2.0, 0.0), 60.0);
    let view = camera(p(1.0, 5.0, 10.0), p(4.0, 0.0, 3.0));
    let (mut r, s) = start(scene(vec![mesh(&triangles, 0)], vec![material(Vec3::ONE)], view, light), [160, 120]);
    for (name, sets) in [FITS[0], FITS[1], FITS[2], FITS[4]] {
        let e = measure::errors(&mut r, &with(&s, name, &[sets, &["resolution=2048"]].concat())).unwrap();
        assert!(e.share() < 0.01 && e.shadow_correct > 1000 && e.lit_correct > 1000, "{name} {sets:?}: {e:?}");
    }
}

/// Under a spot, too, one cropped cascade is the fitted map.
#[test]
fn one_cropped_cascade_of_a_spot_is_a_fitted_map() {
    let (mut r, mut s) = opened("blocks", [160, 100]);
    s.light = builtin::build("blocks").unwrap().lights.iter().find(|l| l.name == "spot").unwrap().light;
    cropped_as_fitted(&mut r, &s);
}

/// Under a built-in spot cascades beat one fitted map, most of all where the camera is close.
#[test]
fn cascades_pay_under_a_spot() {
    for (name, view, light, gains) in [
        ("blocks", "close", "spot", [0.9, 0.6, 0.5]),
        ("cubes", "near", "spot", [1.0, 0.7, 0.7]),
        ("bench", "flowers-side", "spot", [1.1, 0.8, 0.8]),
    ] {
        let (mut r, mut s) = opened(name, [256, 256]);
        let content = builtin::build(name).unwrap();
        s.camera = content.cameras.iter().find(|c| c.name == view).unwrap().camera;
        s.light = content.lights.iter().find(|l| l.name == light).unwrap().light;
        let fitted = share(&mut r, &s, "shadow-map", &["resolution=512"]);
        for ((technique, set), gain) in
            [("pssm", "fit=stable"), ("pssm", "fit=samples"), ("sdsm", "scheme=log")].into_iter().zip(gains)
        {
            let own = share(&mut r, &s, technique, &["resolution=512", set]);
            println!("{name} {view} {technique} {set}: {own:.5}, fitted {fitted:.5}");
            assert!(own < gain * fitted, "{name} {technique} {set}: {own}, fitted {fitted}");
        }
    }
}

/// A lamp's stable texels keep their places in its image as long as their map's sides stay, and these seldom step.
#[test]
fn stable_texels_stay_in_a_lamps_image() {
    let light = spot(Vec3::new(3.0, 20.0, 0.0), Vec3::new(0.0, 0.0, 2.0), 50.0);
    let c = CascadeParams { resolution: 512, cascades: 3, ..CascadeParams::read(&Values::new()) };
    let bounds = [Vec3::new(-50.0, 0.0, -50.0), Vec3::new(50.0, 20.0, 50.0)];
    let whole = LightView::whole(&light, bounds, c.resolution, 1.0).unwrap();
    // Along a path: how far texels stray from their grid while it stays, and how often sides step.
    let run = |snap: bool| {
        let p = PssmParams { snap, ..pssm(0.5, 0.0) };
        let mut last: Vec<(DVec2, DVec2)> = Vec::new();
        let (mut most, mut steps, mut kept) = (0f64, 0, 0);
        for i in 0..400 {
            let t = i as f32 / 400.0;
            let position = Vec3::new(-6.0 + 10.0 * t, 2.0, 5.0 - 4.0 * t);
            let (sin, cos) = (1.5 * t).sin_cos();
            let camera = Camera::new(position, position + Vec3::new(sin, -0.2, -cos), 50.0, 0.5, 60.0);
            let scope = Scope { camera, light, bounds, aspect: 1.5, resolution: 512, margin: 1.0 };
            let views = lamp_views(&p, &c, &[0.5, 3.0, 8.0, 20.0], &scope, (whole, 0.0), &[None; 3]);
            // A lamp's axis is at (c, 1 / side): the texel in which the axis lies, and the map's sides.
            let now: Vec<(DVec2, DVec2)> = views
                .iter()
                .map(|v| {
                    let axis = v.axis.truncate();
                    let lean = DVec2::new(axis.dot(v.row_x.truncate()) as f64, -axis.dot(v.row_y.truncate()) as f64);
                    let side = |row: glam::Vec4, lean: f64| {
                        2.0 / (row.truncate().length_squared() as f64 - lean * lean).sqrt()
                    };
                    (lean * 256.0, DVec2::new(side(v.row_x, lean.x), side(v.row_y, lean.y)))
                })
                .collect();
            for (a, b) in last.iter().zip(&now) {
                for k in 0..2 {
                    if (a.1[k] / b.1[k] - 1.0).abs() > 1e-3 {
                        steps += 1;
                    } else {
                        let d = a.0[k] - b.0[k];
                        most = most.max((d - d.round()).abs());
                        kept += 1;
                    }
                }
            }
            last = now;
        }
        (most, steps, kept)
    };
    let (snapped, loose) = (run(true), run(false));
    println!("snapped {snapped:?}, loose {loose:?}");
    assert!(snapped.0 < 0.01 && loose.0 > 0.4, "{snapped:?} {loose:?}");
    assert!((3..60).contains(&snapped.1) && snapped.2 > 2300, "{snapped:?}");
}
