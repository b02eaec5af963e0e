//! Convex hulls in space, against exact predicates.

use glam::{DVec3, Vec3};
use robust::{Coord3D, orient3d};
use shadowscope::map::fit::hull::Polyhedron;
use shadowscope::map::fit::quickhull::convex_hull;

/// Above 0: `d` lies outside the plane through `a`, `b`, `c`, which run counter-clockwise from there. Its sign is exact.
fn above(a: DVec3, b: DVec3, c: DVec3, d: DVec3) -> f64 {
    let [a, b, c, d] = [a, b, c, d].map(|p| Coord3D { x: p.x, y: p.y, z: p.z });
    -orient3d(a, b, c, d)
}

/// Every point lies on the inner side of every facet or in it, every corner is a point, and, by Euler, the facets
/// close up. Exact.
fn check(points: &[DVec3], facets: usize) {
    let hull = convex_hull(points.iter().copied());
    let faces = hull.faces();
    assert_eq!(faces.len(), facets);
    for f in faces {
        assert!(f.iter().all(|c| points.contains(c)));
        assert!((f[1] - f[0]).cross(f[2] - f[0]).length_squared() > 0.0);
        assert!(points.iter().all(|p| above(f[0], f[1], f[2], *p) <= 0.0), "{f:?}");
    }
    let edge = |f: &[DVec3], i: usize| [f[i], f[(i + 1) % f.len()]].map(|p| p.to_array().map(f64::to_bits));
    let edges: Vec<_> = faces.iter().flat_map(|f| (0..f.len()).map(|i| edge(f, i))).collect();
    let each: std::collections::HashSet<_> = edges.iter().copied().collect();
    assert!(each.len() == edges.len() && edges.iter().all(|[a, b]| each.contains(&[*b, *a])));
    let corners: std::collections::HashSet<_> = edges.iter().map(|e| e[0]).collect();
    assert_eq!(corners.len() + faces.len(), edges.len() / 2 + 2, "Euler");
}

fn random(seed: &mut u64) -> f64 {
    *seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
    // As a scene has them.
    ((*seed >> 40) as f32 / (1 << 24) as f32) as f64
}

#[test]
fn a_cubes_lattice_has_twelve_facets() {
    // Most points lie in facets, on edges, or twice at one place.
    let at = |i: usize, k: usize| (i / 7usize.pow(k as u32) % 7) as f64 / 3.0;
    let points: Vec<DVec3> = (0..343).chain(0..343).map(|i| DVec3::new(at(i, 0), at(i, 1), at(i, 2))).collect();
    let hull = convex_hull(points.iter().copied());
    assert!((hull.volume() - 8.0).abs() < 1e-12);
    // Every facet's plane is one of the cube's, however it is cut into triangles.
    let plane = |f: &[DVec3]| (0..3).any(|k| f.iter().all(|p| p[k] == f[0][k] && (p[k] == 0.0 || p[k] == 2.0)));
    assert!(hull.faces().iter().all(|f| plane(f)));
    assert!(points.iter().all(|p| hull.faces().iter().all(|f| above(f[0], f[1], f[2], *p) <= 0.0)));
}

#[test]
fn facets_support_all_points() {
    let mut seed = 5;
    for scale in [1.0, 1e-3, 1e5] {
        // On a sphere, rounded to f32: nearly all are corners, and many facets nearly lie in one plane.
        let mut point = || {
            let p = DVec3::from_array([0, 1, 2].map(|_| 2.0 * random(&mut seed) - 1.0));
            (p.normalize() * scale).as_vec3().as_dvec3()
        };
        let sphere: Vec<DVec3> = (0..400).map(|_| point()).collect();
        let corners = convex_hull(sphere.iter().copied()).faces().len() / 2 + 2;
        assert!(corners > 390);
        check(&sphere, 2 * corners - 4);
    }
    // A box turned so that its faces are planes only but for rounding.
    let turn = glam::Quat::from_rotation_y(0.7) * glam::Quat::from_rotation_x(0.3);
    let wall = |k: usize| (k as f32 / 8.0 - 0.5) * 12.0;
    let points: Vec<DVec3> =
        (0..729).map(|i| (turn * Vec3::new(wall(i % 9), wall(i / 9 % 9), wall(i / 81))).as_dvec3()).collect();
    let facets = convex_hull(points.iter().copied()).faces().len();
    check(&points, facets);
}

#[test]
fn flat_and_thin_things_have_hulls() {
    let p = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
    assert!(convex_hull([]).faces().is_empty());
    assert!(convex_hull([DVec3::NAN]).faces().is_empty());
    assert_eq!(convex_hull([p(1.0, 2.0, 3.0); 5]).faces(), [[p(1.0, 2.0, 3.0); 3]]);
    let line: Vec<DVec3> = (0..9).map(|i| p(0.5, 1.0, 7.0) * ((i * 4) % 9) as f64).collect();
    assert_eq!(convex_hull(line.iter().copied()).faces(), [[line[0], line[2], line[2]]]);
    // In the planes x = 3, y = 3, z = 3 and one aslant, with points inside, on edges and twice, in no order.
    let mut seed = 3;
    for axis in 0..4 {
        let mut order: Vec<usize> = (0..50).collect();
        order.sort_by_cached_key(|_| random(&mut seed).to_bits());
        let square = order.iter().map(|i| {
            let (a, b) = ((i % 5) as f64, (i / 5 % 5) as f64);
            [p(3.0, a, b), p(b, 3.0, a), p(a, b, 3.0), p(a, b, a + 2.0 * b)][axis]
        });
        let hull = convex_hull(square);
        let [one, other] = hull.faces() else { panic!("{:?}", hull.faces()) };
        assert!(one.len() == 4 && other.iter().rev().eq(one.iter()), "{one:?}");
    }
    let triangle = [p(0.0, 0.0, 0.0), p(5.0, 0.0, 1.0), p(0.0, 2.0, 9.0)];
    assert_eq!(convex_hull(triangle).faces().len(), 2);
}

/// The edges of a box are its twelve, however its sides are cut into triangles; cut across a corner it has three more.
#[test]
fn edges_are_where_faces_meet() {
    let (low, high) = (DVec3::new(-1.0, 0.0, 2.0), DVec3::new(1.0, 3.0, 7.0));
    let mut body = Polyhedron::cuboid(low, high);
    for of in [&body, &convex_hull(body.corners())] {
        let edges = of.edges();
        let lengths: f64 = edges.iter().map(|[a, b]| a.distance(*b)).sum();
        assert!(edges.len() == 12 && (lengths - 4.0 * (2.0 + 3.0 + 5.0)).abs() < 1e-9, "{edges:?}");
    }
    // The plane half a metre from the corner along each edge.
    body.clip((-DVec3::ONE).extend(high.element_sum() - 0.5), 1e-9);
    let edges = body.edges();
    let lengths: f64 = edges.iter().map(|[a, b]| a.distance(*b)).sum();
    assert!(edges.len() == 15 && (lengths - 40.0 + 1.5 - 1.5 * 2f64.sqrt()).abs() < 1e-9, "{lengths}: {edges:?}");
}
