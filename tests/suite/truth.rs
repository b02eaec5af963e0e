//! The ray-traced truth against a brute-force tracer in double precision.

use crate::common::*;
use glam::{DVec3, Vec2, Vec3};
use shadowscope::frame::Renderer;
use shadowscope::light::Light;
use shadowscope::measure::metrics::FACING;
use shadowscope::scene::bvh::Child;
use shadowscope::scene::geometry::Geometry;
use shadowscope::scene::{Material, Mesh, Scene};
use std::collections::HashSet;
use std::sync::Arc;

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
    let (light, materials) = (scene.lights[0].light, scene.materials.clone());
    let (mut renderer, mut setup) = start(scene, size);
    setup.select("rt-hard").unwrap();
    renderer.render(&setup, ask(&setup)).unwrap();
    let truth = renderer.read_truth().unwrap();
    assert_eq!(truth, renderer.read_visibility().unwrap(), "the truth is rt-hard");
    let mask = renderer.read_mask().unwrap();
    let position = renderer.read_position().unwrap();
    let surface = renderer.read_surface().unwrap();
    let geometry = renderer.geometry();
    // Masked triangles with an alpha below the cutoff are not there: no ray meets a point.
    let there = |t: usize| {
        let material = &materials[geometry.vertices[geometry.triangles[t][0] as usize].material as usize];
        material.alpha_cutoff.is_none_or(|cutoff| material.base_color.w >= cutoff)
    };
    let triangles: Vec<_> =
        (0..geometry.triangles.len()).map(|t| if there(t) { geometry.corners(t) } else { [Vec3::ZERO; 3] }).collect();
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

/// Triangles of many sizes.
fn scattered(seed: u64, count: usize) -> Vec<[Vec3; 3]> {
    let mut r = Random(seed);
    let one = |_| {
        let (center, size) = (r.point() * Vec3::new(4.0, 1.2, 4.0), 0.05 + r.next().powi(3) * 2.0);
        [0; 3].map(|_| center + r.point() * size)
    };
    (0..count).map(one).collect()
}

/// A material with holes where alpha is below 0.5: everywhere or nowhere.
fn masked(alpha: f32) -> Material {
    Material { base_color: Vec3::splat(0.7).extend(alpha), alpha_cutoff: Some(0.5), ..material(Vec3::ONE) }
}

/// A floor under a cloud of triangles of many sizes, opaque and masked ones, of which half are not there.
fn cloud(seed: u64, light: Light) -> Scene {
    let mut triangles = floor(Vec2::splat(-8.0), Vec2::splat(8.0), -1.5);
    triangles.extend(scattered(seed, 240));
    let meshes = vec![mesh(&triangles, 0), mesh(&scattered(seed + 1, 160), 1), mesh(&scattered(seed + 2, 160), 2)];
    let view = camera(Vec3::new(6.0, 5.0, 7.0), Vec3::ZERO);
    scene(meshes, vec![material(Vec3::splat(0.7)), masked(0.6), masked(0.4)], view, light)
}

#[test]
fn rays_equal_double_precision_on_random_scenes() {
    let spot = Light::Spot {
        position: Vec3::new(3.0, 7.0, -2.0),
        direction: Vec3::new(-0.4, -1.0, 0.3),
        outer_angle: 35.0,
        range: 30.0,
        radius: 0.0,
        color: Vec3::ONE,
    };
    let omni = Light::Omni { position: Vec3::new(0.3, 2.2, -0.4), range: 50.0, radius: 0.0, color: Vec3::ONE };
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
    let omni = Light::Omni { position, range: 50.0, radius: 0.0, color: Vec3::ONE };
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

/// Checks that the BVH names each triangle once and that every box above one holds it; returns how many it names.
fn check_bvh(triangles: &[[Vec3; 3]]) -> usize {
    let made = scene(vec![mesh(triangles, 0)], vec![material(Vec3::ONE)], camera(Vec3::Z, Vec3::ZERO), sun(Vec3::Y));
    let geometry = Geometry::new(&made, 0, 0.0).unwrap();
    let bvh = &geometry.bvh;
    let mut named = vec![0; geometry.triangles.len()];
    let mut todo = vec![(0, Vec::new())];
    let mut nodes = 0;
    while let Some((at, above)) = todo.pop() {
        nodes += 1;
        for (own, child) in bvh.nodes[at].children() {
            let within: Vec<[Vec3; 2]> = above.iter().copied().chain([own]).collect();
            let triangles = match child {
                Child::Node(at) => {
                    todo.push((at, within));
                    continue;
                }
                Child::Triangles(range) => &bvh.order[range],
            };
            for triangle in triangles.iter().map(|t| *t as usize) {
                named[triangle] += 1;
                for p in geometry.corners(triangle) {
                    let held = within.iter().all(|[low, high]| low.cmple(p).all() && high.cmpge(p).all());
                    assert!(held, "triangle {triangle} at {p} is not in {within:?}");
                }
            }
        }
    }
    assert_eq!(nodes, bvh.nodes.len());
    assert!(named.iter().all(|n| *n <= 1));
    // Who is not named has a duplicate that is.
    let surfaces: HashSet<u32> = bvh.order.iter().map(|t| geometry.triangles[*t as usize][3]).collect();
    assert!(geometry.triangles.iter().all(|t| surfaces.contains(&t[3])));
    bvh.order.len()
}

/// Boxes of a byte a plane lose nothing, however scales and places mix.
#[test]
fn every_box_of_the_bvh_holds_its_triangles() {
    let moved = |seed, count, scale: f32, by: Vec3| -> Vec<[Vec3; 3]> {
        scattered(seed, count).into_iter().map(|t| t.map(|p| p * scale + by)).collect()
    };
    let mut mixed = floor(Vec2::splat(-1e5), Vec2::splat(1e5), 0.0);
    for (i, scale) in [1e-6, 1e-3, 1.0, 1e3].into_iter().enumerate() {
        mixed.extend(moved(i as u64 + 9, 300, scale, Vec3::new(3e4 * i as f32, 7.0, 1e-3)));
    }
    let flat = floor(Vec2::splat(-1.0), Vec2::splat(1.0), 1e6);
    let points = vec![[Vec3::new(2.0, 1.0, 2.0); 3]; 500];
    let mut r = Random(5);
    let close: Vec<_> = (0..2000).map(|_| [Vec3::X, Vec3::Y, Vec3::Z].map(|p| p * 3.0 + r.point() * 1e-6)).collect();
    for triangles in [moved(1, 1, 1.0, Vec3::ZERO), moved(2, 5000, 1.0, Vec3::ZERO), mixed, flat, close] {
        assert_eq!(check_bvh(&triangles), triangles.len());
    }
    assert_eq!(check_bvh(&moved(3, 400, 1e-30, Vec3::ZERO)), 400);
    assert_eq!(check_bvh(&points), 1);
}

/// Thousands of triangles at one place cost a ray no more than one does, and nearly equal ones a share of a visit each.
#[test]
fn triangles_at_one_place_are_cheap() {
    let count = 8000;
    let ground = floor(Vec2::splat(-3.0), Vec2::splat(3.0), 0.0);
    let roof = [Vec3::new(-1.0, 1.0, -1.0), Vec3::new(-1.0, 1.0, 1.0), Vec3::new(1.0, 1.0, 0.0)];
    let mut r = Random(8);
    let equal = vec![roof; count];
    let near: Vec<_> = (0..count).map(|_| roof.map(|p| p + r.point() * 1e-5)).collect();
    let most = |roofs: &[[Vec3; 3]]| {
        let view = camera(Vec3::new(0.0, 6.0, 5.0), Vec3::ZERO);
        let meshes = vec![mesh(&ground, 0), mesh(roofs, 0)];
        let sun = sun(Vec3::new(0.3, 1.0, 0.0));
        let (mut renderer, mut setup) = start(scene(meshes, vec![material(Vec3::ONE)], view, sun), [64, 48]);
        setup.select("rt-hard").unwrap();
        setup.view = "visits".into();
        renderer.render(&setup, ask(&setup)).unwrap();
        let visits = renderer.read_map().unwrap();
        let truth = renderer.read_truth().unwrap();
        assert!(truth.iter().filter(|t| **t == 0.0).count() > 20, "the roof casts");
        assert_eq!(renderer.read_gave_up().unwrap(), [0, 0]);
        (visits.into_iter().fold(0.0, f32::max), truth)
    };
    let (one, truth) = most(&[roof]);
    assert_eq!(most(&equal), (one, truth), "{count} are as one");
    let (all, _) = most(&near);
    assert!(all > one && all <= count as f32 / 3.0, "{all} nodes visited for {count} triangles");
}

/// Of duplicates only those are left out that stop just what another one stops: not the one that faces the other way,
/// and not the opaque one beside a masked one.
#[test]
fn duplicates_that_differ_all_count() {
    let ground = floor(Vec2::splat(-3.0), Vec2::splat(3.0), 0.0);
    let roof = floor(Vec2::splat(-1.0), Vec2::splat(1.0), 1.0);
    let turned: Vec<_> = roof.iter().map(|t| [t[0], t[2], t[1]]).collect();
    let shadow = |roofs: [Mesh; 2], two_sided: bool| {
        let view = camera(Vec3::new(0.0, 6.0, 5.0), Vec3::ZERO);
        let [a, b] = roofs;
        let meshes = vec![mesh(&ground, 0), a, b];
        let materials = vec![material(Vec3::ONE), masked(0.4)];
        let (mut renderer, mut setup) = start(scene(meshes, materials, view, sun(Vec3::new(0.3, 1.0, 0.0))), [64, 48]);
        setup.select("rt-hard").unwrap();
        setup.set(&format!("two_sided={two_sided}"), &["rt-hard".into()]).unwrap();
        renderer.render(&setup, ask(&setup)).unwrap();
        let (visibility, position) = (renderer.read_visibility().unwrap(), renderer.read_position().unwrap());
        (0..visibility.len()).filter(|i| position[*i][1].abs() < 1e-3 && visibility[*i] == 0.0).count()
    };
    let alone = shadow([mesh(&roof, 0), mesh(&roof, 0)], true);
    assert!(alone > 40, "{alone}");
    for (a, b) in [(&roof, &turned), (&turned, &roof)] {
        assert_eq!(shadow([mesh(a, 0), mesh(b, 0)], false), alone);
    }
    for [a, b] in [[0, 1], [1, 0]] {
        assert_eq!(shadow([mesh(&roof, a), mesh(&roof, b)], true), alone);
    }
    let none = shadow([mesh(&roof, 1), mesh(&roof, 1)], true);
    let way = shadow([mesh(&roof, 0), mesh(&roof, 0)], false) + shadow([mesh(&turned, 0), mesh(&turned, 0)], false);
    assert_eq!([none, way], [0, alone], "only one side of the roof faces the sun");
}

/// A scene that does not fit the adapter is refused in one sentence that says what would.
#[test]
fn too_many_vertices_are_refused() {
    // A million in a mesh, as often as goes beyond any buffer: nothing of it may be made.
    let most = gpu().device.limits().max_buffer_size.min(1 << 42) / 32;
    let mut large = mesh(&floor(Vec2::ZERO, Vec2::ONE, 0.0), 0);
    large.positions.resize(1_000_000, Vec3::ZERO);
    large.normals.resize(1_000_000, Vec3::Y);
    large.uvs.resize(1_000_000, Vec2::ZERO);
    let mut large = scene(vec![large], vec![material(Vec3::ONE)], camera(Vec3::Z, Vec3::ZERO), sun(Vec3::Y));
    let times = most / 1_000_000 + 1;
    large.nodes[0].instances = vec![glam::Mat4::IDENTITY; times as usize];
    let error = Renderer::new(gpu(), Arc::new(large)).err().expect("it is refused").to_string();
    assert!(
        error.starts_with(&format!(
            "test has {} vertices in {} triangles: its vertices take ",
            times * 1_000_000,
            2 * times
        )),
        "{error}"
    );
    assert!(error.contains("has room for") && !error.contains('\n'), "{error}");
}

/// A lamp in the plane of a wide ceiling lights the floor as far as it goes, where its rays come in lower than any rounding.
#[test]
fn a_lamp_in_a_wide_ceiling_lights_all_of_the_floor() {
    for (half, height) in [(30.0, 3.0), (40.0, 0.5)] {
        let mut triangles = floor(Vec2::splat(-half), Vec2::splat(half), 0.0);
        triangles.extend(floor(Vec2::splat(-half), Vec2::splat(half), height).into_iter().map(|[a, b, c]| [a, c, b]));
        let view = camera(Vec3::new(0.6 * half, 0.4 * height, 0.7 * half), Vec3::new(0.0, 0.0, 0.0));
        let light = lamp(Vec3::new(0.0, height, 0.0));
        let light = match light {
            Light::Omni { position, radius, color, .. } => Light::Omni { position, radius, color, range: 1000.0 },
            other => other,
        };
        let (mut r, mut s) =
            start(scene(vec![mesh(&triangles, 0)], vec![material(Vec3::ONE)], view, light), [160, 120]);
        s.select("rt-hard").unwrap();
        r.render(&s, ask(&s)).unwrap();
        let (position, mask, truth) = (r.read_position().unwrap(), r.read_mask().unwrap(), r.read_truth().unwrap());
        let below: Vec<usize> =
            (0..truth.len()).filter(|i| mask[*i] == FACING && position[*i][1] < 0.1 * height).collect();
        let dark = below.iter().filter(|i| truth[**i] < 0.5).count();
        assert!(below.len() > 2000 && dark == 0, "{height} m: {dark} of {} are dark", below.len());
    }
}
