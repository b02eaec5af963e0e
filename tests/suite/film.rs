//! The light's film plane turned to where the pixels are.

use crate::common::*;
use glam::{DVec2, Vec3};
use shadowscope::flatland::Metric;
use shadowscope::frame::Renderer;
use shadowscope::light::Light;
use shadowscope::map::fit::film::{self, Films, Sample};
use shadowscope::map::fit::{Scope, casting, warped};
use shadowscope::measure;
use shadowscope::scene::geometry::Geometry;
use shadowscope::setup::Setup;

fn scope_of(s: &Setup, geometry: &Geometry) -> Scope {
    let aspect = s.size[0] as f32 / s.size[1] as f32;
    Scope { camera: s.camera, light: s.light, bounds: geometry.bounds, aspect, resolution: 256, margin: 1.0 }
}

/// A built-in scene under its spot light.
fn under_a_spot(name: &str, size: [u32; 2]) -> (Renderer, Setup, Geometry) {
    let (r, mut s) = built_in(name, size);
    s.light = r.scene().lights.iter().find(|l| matches!(l.light, Light::Spot { .. })).unwrap().light;
    let geometry = Geometry::new(r.scene(), 0, 0.0).unwrap();
    (r, s, geometry)
}

fn samples_of(s: &Setup, geometry: &Geometry, side: usize) -> Vec<Sample> {
    let scope = scope_of(s, geometry);
    film::samples(&scope, &scope.image(), geometry, side)
}

fn outline_of(s: &Setup, geometry: &Geometry) -> Vec<DVec2> {
    let scope = scope_of(s, geometry);
    casting::outline(&scope, &scope.image(), geometry)
}

/// The coarse look on the CPU sees what the picture sees: surfaces by the same place, and only those that face the light in its cone.
#[test]
fn the_coarse_look_sees_the_picture() {
    let (mut r, mut s, geometry) = under_a_spot("cubes", [48, 48]);
    select(&mut s, "shadow-map", &[]);
    let facing = r.render(&s, ask(&s)).map(|_| r.read_mask().unwrap()).unwrap();
    let positions = r.read_position().unwrap();
    let samples = samples_of(&s, &geometry, 48);
    let lit: Vec<usize> = (0..facing.len()).filter(|i| facing[*i] == measure::metrics::FACING).collect();
    // Edges fall to one side or the other.
    assert!((samples.len() as i64 - lit.len() as i64).abs() < 8, "{} samples, {} pixels", samples.len(), lit.len());
    let far = samples.iter().filter(|sample| {
        let near = |i: &usize| Vec3::from_slice(&positions[*i][..3]).as_dvec3().distance(sample.point) < 1e-3;
        !lit.iter().any(near)
    });
    assert!(far.count() < 8);
}

/// The film found has less error than any of many others, and never more than the common one.
#[test]
fn no_film_tried_beats_the_best() {
    for name in ["bench", "blocks", "cubes"] {
        let (_, s, geometry) = under_a_spot(name, [160, 100]);
        let samples = samples_of(&s, &geometry, 24);
        let outline = outline_of(&s, &geometry);
        for metric in [Metric::L1, Metric::L2] {
            let films = Films::new(&samples, &outline, metric, true).unwrap();
            let best = films.least().unwrap().error;
            let common = films.half_angle().unwrap().error;
            assert!(best <= common, "{name} {metric:?}: {best}, {common}");
            for k in 0..600 {
                let lean = DVec2::from_angle(k as f64 * 2.4) * (3.0 * (k as f64 / 600.0).sqrt());
                if let Some(film) = films.film(lean) {
                    assert!(best <= film.error * 1.005, "{name} {metric:?}: {best} at best, {} at {lean}", film.error);
                }
            }
        }
    }
}

/// Chong's light from the top, with a width: a wall right below the lamp is seen face on, and only a film that leans far gives it texels.
#[test]
fn a_wall_below_the_lamp_gets_its_texels() {
    let view = camera(Vec3::new(0.0, 2.0, 0.0), Vec3::new(0.0, 1.9, -6.2));
    let light = spot(Vec3::new(0.0, 12.7, -6.15), Vec3::new(0.0, 0.0, -4.5), 50.0);
    let wall = [(-4.0, 0.0), (4.0, 0.0), (4.0, 5.9), (-4.0, 5.9)].map(|(x, y)| Vec3::new(x, y, -6.2 - 0.004 * y));
    let [a, b, c, d] = wall;
    let mut all = floor(glam::Vec2::new(-4.0, -6.2), glam::Vec2::new(4.0, 2.0), 0.0);
    all.extend([[a, b, c], [a, c, d]]);
    let built = scene(vec![mesh(&all, 0)], vec![material(Vec3::ONE)], view, light);
    let (mut r, mut s) = start(built, [96, 64]);
    let mut m = |sets: &[&str]| {
        select(&mut s, "optimal-light-plane", &[&["resolution=256"], sets].concat());
        measure::accuracy(&mut r, &s, 0).unwrap().m_mean.unwrap()
    };
    let (best, common) = (m(&[]), m(&["plane=half-angle"]));
    println!("best {best}, half angle {common}");
    assert!(best < 0.4 * common, "{best}, {common}");
}

/// Parts hold every place once, share all texels, and lower the error as there are more; where one gains nothing it costs nothing.
#[test]
fn parts_share_the_film() {
    let (_, s, geometry) = under_a_spot("blocks", [160, 100]);
    let samples = samples_of(&s, &geometry, 32);
    let mut last = f64::INFINITY;
    for most in [1, 4, 7] {
        let made = film::parts(&samples, &outline_of(&s, &geometry), Metric::L1, true, true, most).unwrap();
        assert_eq!(made.parts.len(), most);
        assert!((made.parts.iter().map(|p| p.share).sum::<f64>() - 1.0).abs() < 1e-9);
        for sample in &samples {
            let at = warped(&made.whole, sample.place).0;
            let inside = |p: &&film::Part| at.cmpge(p.cell[0]).all() && at.cmplt(p.cell[1]).all();
            assert_eq!(made.parts.iter().filter(inside).count(), 1, "{at}");
        }
        let error: f64 =
            made.parts.iter().filter(|p| p.share > 0.0).map(|p| p.film.error / p.share.sqrt()).sum::<f64>();
        assert!(error < last, "{most}: {error}, before {last}");
        last = error;
    }
}

/// Texels are smaller in the picture than a common map's and the errors fewer, fewer still in parts; and where the light faces the
/// view, where a warp along the view has nothing to gain, they are no larger than a plain map's.
#[test]
fn pixels_gain() {
    let (mut r, mut s, _) = under_a_spot("blocks", [160, 100]);
    let mut found = |s: &mut Setup, id: &str, sets: &[&str]| {
        select(s, id, &[&["resolution=256"], sets].concat());
        let record = measure::accuracy(&mut r, s, 0).unwrap();
        [record.m_mean.unwrap(), record.error_share]
    };
    let plane = "optimal-light-plane";
    let (plain, half) = (found(&mut s, "shadow-map", &[]), found(&mut s, plane, &["plane=half-angle"]));
    let (one, seven) = (found(&mut s, plane, &[]), found(&mut s, plane, &["maps=7"]));
    println!("plain {plain:?}, half angle {half:?}, best {one:?}, in seven {seven:?}");
    assert!(one[0] < half[0] && one[0] < plain[0] && seven[0] < 0.8 * one[0]);
    assert!(one[1] < plain[1] && seven[1] < one[1]);
    let (eye, target) = (s.camera.position, s.camera.target);
    s.light = spot(target + (target - eye) * 0.8 + Vec3::Y * 6.0, eye.lerp(target, 0.6), 50.0);
    let (plain, one) = (found(&mut s, "shadow-map", &[]), found(&mut s, plane, &[]));
    println!("facing the view: plain {plain:?}, best {one:?}");
    assert!(one[0] <= plain[0] * 1.02 && one[1] <= plain[1] * 1.1, "{one:?}, {plain:?}");
}
