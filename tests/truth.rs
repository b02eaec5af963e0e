//! The ray-traced truth against a brute-force tracer in double precision.

mod common;

use common::*;
use glam::{DVec3, Vec2, Vec3};
use shadowscope::light::Light;
use shadowscope::measure::metrics::FACING;
use shadowscope::scene::Scene;

/// What a ray in double precision says of a pixel.
#[derive(PartialEq)]
enum Exact {
    Lit,
    Blocked,
    /// Within rounding of a triangle's edge or of its own surface: both answers are right.
    Tie,
}

/// Tests every triangle (Möller, Trumbore 1997). `margin` is relative: barycentric, or of the distance.
/// `rounding`: how far along the ray the origin's own rounding reaches.
fn brute_force(triangles: &[[Vec3; 3]], own: usize, origin: Vec3, to_light: DVec3, far: f64, rounding: f64) -> Exact {
    let margin = 2e-5;
    let o = origin.as_dvec3();
    let mut tie = false;
    for (i, t) in triangles.iter().enumerate() {
        if i == own {
            continue;
        }
        let [a, b, c] = t.map(|p| p.as_dvec3());
        let (e1, e2) = (b - a, c - a);
        let p = to_light.cross(e2);
        let det = e1.dot(p);
        if det.abs() < 1e-12 {
            continue;
        }
        let s = o - a;
        let u = s.dot(p) / det;
        let q = s.cross(e1);
        let v = to_light.dot(q) / det;
        let distance = e2.dot(q) / det;
        // Thin triangles and grazing rays magnify rounding.
        let slack = margin * (1.0 + to_light.length() * e1.length() * e2.length() / det.abs() * 0.05);
        let inside = u.min(v).min(1.0 - u - v);
        if inside < -slack || distance < -slack || distance > far + slack {
            continue;
        }
        if inside > slack && distance > slack.max(rounding) && distance < far - slack {
            return Exact::Blocked;
        }
        tie = true;
    }
    if tie { Exact::Tie } else { Exact::Lit }
}

/// Counts pixels that face the light where GPU and CPU differ, ties apart; also the lit, blocked and tied ones.
fn compare(scene: Scene, size: [u32; 2]) -> (usize, [usize; 3]) {
    let light = scene.lights[0].light;
    let (mut renderer, mut setup) = start(scene, size);
    setup.select("rt-hard").unwrap();
    renderer.render(&setup, ask(&setup)).unwrap();
    let truth = renderer.read_truth().unwrap();
    assert_eq!(truth, renderer.read_visibility().unwrap(), "the truth is rt-hard");
    let mask = renderer.read_mask().unwrap();
    let position = renderer.read_position().unwrap();
    let surface = renderer.read_surface().unwrap();
    let geometry = renderer.geometry();
    let triangles: Vec<_> = (0..geometry.triangles.len()).map(|t| geometry.corners(t)).collect();
    let (mut differing, mut counts) = (0, [0; 3]);
    for i in (0..truth.len()).filter(|i| mask[*i] == FACING) {
        let p = Vec3::from_slice(&position[i][..3]);
        let (to_light, far) = match light {
            Light::Directional { to_light, .. } => (to_light.normalize().as_dvec3(), 1e30),
            other => (other.position().as_dvec3() - p.as_dvec3(), 1.0),
        };
        if let Light::Spot { outer_angle, range, .. } = light {
            let cosine = -to_light.normalize().dot(light.axis().as_dvec3());
            let edge = (outer_angle as f64).to_radians().cos();
            if (cosine - edge).abs() < 1e-5 || (to_light.length() - range as f64).abs() < 1e-3 {
                continue;
            }
            if cosine < edge || to_light.length() > range as f64 {
                assert_eq!(truth[i], 0.0, "outside the cone nothing is lit");
                continue;
            }
        }
        let own = surface[i][3] as usize;
        let [a, b, c] = triangles[own].map(|p| p.as_dvec3());
        let cosine = (b - a).cross(c - a).normalize().dot(to_light.normalize()).abs();
        let rounding = 1e-6 * p.abs().max_element() as f64 / cosine.max(0.01) / to_light.length();
        match brute_force(&triangles, own, p, to_light, far, rounding) {
            Exact::Lit => {
                counts[0] += 1;
                differing += (truth[i] != 1.0) as usize;
            }
            Exact::Blocked => {
                counts[1] += 1;
                differing += (truth[i] != 0.0) as usize;
            }
            Exact::Tie => counts[2] += 1,
        }
    }
    (differing, counts)
}

/// A floor under a cloud of triangles of many sizes.
fn cloud(seed: u64, light: Light) -> Scene {
    let mut r = Random(seed);
    let mut triangles = floor(Vec2::splat(-8.0), Vec2::splat(8.0), -1.5);
    for _ in 0..400 {
        let (center, size) = (r.point() * Vec3::new(4.0, 1.2, 4.0), 0.05 + r.next().powi(3) * 2.0);
        triangles.push([0; 3].map(|_| center + r.point() * size));
    }
    let view = camera(Vec3::new(6.0, 5.0, 7.0), Vec3::ZERO);
    scene(vec![mesh(&triangles, 0)], vec![material(Vec3::splat(0.7))], view, light)
}

#[test]
fn rays_equal_double_precision_on_random_scenes() {
    let spot = Light::Spot {
        position: Vec3::new(3.0, 7.0, -2.0),
        direction: Vec3::new(-0.4, -1.0, 0.3),
        outer_angle: 35.0,
        range: 30.0,
        color: Vec3::ONE,
    };
    let omni = Light::Omni { position: Vec3::new(0.3, 2.2, -0.4), range: 50.0, color: Vec3::ONE };
    let lights = [sun(Vec3::new(0.5, 1.0, 0.2)), sun(Vec3::new(-1.0, 0.07, 0.3)), sun(Vec3::Y), spot, omni];
    for (seed, light) in lights.into_iter().enumerate() {
        let (differing, [lit, blocked, ties]) = compare(cloud(seed as u64 * 77 + 5, light), [160, 120]);
        assert_eq!(differing, 0, "{light:?}: lit {lit}, blocked {blocked}, ties {ties}");
        assert!(lit > 1000 && blocked > 1000, "{light:?} tests too little: lit {lit}, blocked {blocked}");
        assert!(ties * 50 < lit + blocked, "{light:?}: too many ties, {ties}");
    }
}

/// A lid of many small triangles with shared edges lets no ray through, whatever the direction.
#[test]
fn a_closed_lid_is_watertight() {
    let n = 48;
    let mut r = Random(3);
    // Heights are shared by neighbours, so that the lid has no gap.
    let heights: Vec<f32> = (0..(n + 1) * (n + 1)).map(|_| 2.0 + 0.4 * r.next()).collect();
    let p = |x: usize, z: usize| {
        Vec3::new(x as f32 / n as f32 * 20.0 - 10.0, heights[z * (n + 1) + x], z as f32 / n as f32 * 20.0 - 10.0)
    };
    let mut lid = Vec::new();
    for z in 0..n {
        for x in 0..n {
            let [a, b, c, d] = [p(x, z), p(x, z + 1), p(x + 1, z + 1), p(x + 1, z)];
            lid.extend([[a, b, c], [a, c, d]]);
        }
    }
    let ground = floor(Vec2::splat(-3.0), Vec2::splat(3.0), 0.0);
    for to_light in [Vec3::Y, Vec3::new(0.3, 1.0, -0.2), Vec3::new(1.0, 1.0, 1.0), Vec3::new(-0.9, 0.8, 0.1)] {
        let view = camera(Vec3::new(0.1, 1.5, 3.5), Vec3::new(0.0, 0.0, 0.0));
        let meshes = vec![mesh(&ground, 0), mesh(&lid, 0)];
        let (mut renderer, mut setup) =
            start(scene(meshes, vec![material(Vec3::ONE)], view, sun(to_light)), [256, 192]);
        setup.select("rt-hard").unwrap();
        renderer.render(&setup, ask(&setup)).unwrap();
        let (position, mask) = (renderer.read_position().unwrap(), renderer.read_mask().unwrap());
        let truth = renderer.read_truth().unwrap();
        let below = (0..truth.len()).filter(|i| mask[*i] == FACING && position[*i][1].abs() < 1e-3);
        let (count, leaks) = below.fold((0, 0), |(n, l), i| (n + 1, l + (truth[i] > 0.0) as usize));
        assert!(count > 5000, "{count} pixels of ground");
        assert_eq!(leaks, 0, "towards {to_light}: {leaks} of {count} rays slip through");
    }
}

/// A ray that passes exactly through the corner that six triangles share is stopped: each has an edge function of zero.
#[test]
fn a_ray_through_a_shared_corner_is_stopped() {
    let ground = floor(Vec2::splat(-3.0), Vec2::splat(3.0), 0.0);
    let view = camera(Vec3::new(0.1, 1.5, 3.5), Vec3::ZERO);
    let (mut renderer, setup) =
        start(scene(vec![mesh(&ground, 0)], vec![material(Vec3::ONE)], view, sun(Vec3::Y)), [96, 72]);
    renderer.render(&setup, ask(&setup)).unwrap();
    let position = renderer.read_position().unwrap();
    let pixels: Vec<usize> = (0..position.len()).step_by(7).filter(|i| position[*i][3] > 0.0).collect();
    // A small umbrella whose tip is straight above each of these pixels' positions, higher than the camera.
    let mut umbrellas = Vec::new();
    for i in &pixels {
        let tip = Vec3::new(position[*i][0], 2.0, position[*i][2]);
        let rim = |k: usize| tip + Vec3::new((k as f32).cos() * 0.003, -0.001, (k as f32).sin() * 0.003);
        umbrellas.extend((0..6).map(|k| [tip, rim(k), rim((k + 1) % 6)]));
    }
    let meshes = vec![mesh(&ground, 0), mesh(&umbrellas, 0)];
    let (mut renderer, setup) = start(scene(meshes, vec![material(Vec3::ONE)], view, sun(Vec3::Y)), [96, 72]);
    renderer.render(&setup, ask(&setup)).unwrap();
    assert_eq!(renderer.read_position().unwrap(), position, "the umbrellas are out of the camera's sight");
    let truth = renderer.read_truth().unwrap();
    let leaks = pixels.iter().filter(|i| truth[**i] > 0.0).count();
    assert!(pixels.len() > 400);
    assert_eq!(leaks, 0, "{leaks} of {} rays slip through the tip", pixels.len());
}

/// Triangles that are exact duplicates do not shadow each other.
#[test]
fn duplicates_do_not_shadow_each_other() {
    let ground = floor(Vec2::splat(-3.0), Vec2::splat(3.0), 0.0);
    let turned: Vec<_> = ground.iter().map(|t| [t[2], t[1], t[0]]).collect();
    let view = camera(Vec3::new(0.0, 4.0, 5.0), Vec3::ZERO);
    let meshes = vec![mesh(&ground, 0), mesh(&turned, 0), mesh(&ground, 0)];
    let (mut renderer, setup) =
        start(scene(meshes, vec![material(Vec3::ONE)], view, sun(Vec3::new(0.4, 1.0, 0.1))), [128, 96]);
    renderer.render(&setup, ask(&setup)).unwrap();
    let (truth, mask) = (renderer.read_truth().unwrap(), renderer.read_mask().unwrap());
    assert!((0..truth.len()).all(|i| mask[i] != FACING || truth[i] == 1.0));
}

/// Coplanar surfaces that are no exact duplicates do not speckle each other: the floor again, cut along its other diagonal.
#[test]
fn coplanar_neighbours_do_not_speckle() {
    let height = 0.3;
    let ground = floor(Vec2::splat(-3.0), Vec2::splat(3.0), height);
    let [a, b, c, d] = [ground[0][0], ground[0][1], ground[0][2], ground[1][2]];
    let again = [[a, b, d], [b, c, d]];
    let view = camera(Vec3::new(0.0, 4.0, 5.0), Vec3::ZERO);
    let meshes = vec![mesh(&ground, 0), mesh(&again, 0)];
    let (mut renderer, setup) =
        start(scene(meshes, vec![material(Vec3::ONE)], view, sun(Vec3::new(0.4, 1.0, 0.1))), [128, 96]);
    renderer.render(&setup, ask(&setup)).unwrap();
    let (truth, mask) = (renderer.read_truth().unwrap(), renderer.read_mask().unwrap());
    let dark = (0..truth.len()).filter(|i| mask[*i] == FACING && truth[*i] == 0.0).count();
    assert_eq!(dark, 0);
}

/// A hemisphere light has the shadow of an omni light at the same place in front of its plane, and lights nothing behind it.
#[test]
fn a_hemisphere_light_is_half_an_omni_light() {
    let direction = Vec3::new(0.4, -0.5, 0.3);
    let position = Vec3::new(0.3, 1.2, -0.4);
    let omni = Light::Omni { position, range: 50.0, color: Vec3::ONE };
    let hemisphere = Light::Hemisphere { position, direction, range: 50.0, color: Vec3::ONE };
    let (mut renderer, mut setup) = start(cloud(7, omni), [160, 120]);
    setup.select("rt-hard").unwrap();
    let mut truth = |light: Light| {
        setup.light = light;
        renderer.render(&setup, ask(&setup)).unwrap();
        let truth = renderer.read_truth().unwrap();
        assert_eq!(truth, renderer.read_visibility().unwrap());
        (truth, renderer.read_mask().unwrap(), renderer.read_position().unwrap())
    };
    let (whole, mask, at) = truth(omni);
    let (half, ..) = truth(hemisphere);
    let mut counts = [0; 3];
    for i in (0..mask.len()).filter(|i| mask[*i] == FACING) {
        let ahead = (Vec3::from_slice(&at[i]) - position).normalize().dot(direction.normalize());
        if ahead.abs() < 1e-5 {
            continue;
        }
        assert_eq!(half[i], if ahead > 0.0 { whole[i] } else { 0.0 }, "pixel {i}, cosine {ahead}");
        counts[if ahead < 0.0 { 2 } else { half[i] as usize }] += 1;
    }
    assert!(counts.iter().all(|n| *n > 500), "dark, lit, behind: {counts:?}");
}
