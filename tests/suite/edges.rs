//! Welded edges, and the silhouette that the GPU finds among them.

use crate::common::*;
use glam::{Vec3, vec3};
use shadowscope::scene::edges::Found;
use shadowscope::scene::geometry::Geometry;

/// The corners and outward triangles of a box.
pub fn box_of(low: Vec3, high: Vec3) -> Vec<[Vec3; 3]> {
    let p = |i: u32| Vec3::select(glam::BVec3::new(i & 1 > 0, i & 2 > 0, i & 4 > 0), high, low);
    [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
        .into_iter()
        .flat_map(|q| [[p(q[0]), p(q[1]), p(q[2])], [p(q[0]), p(q[2]), p(q[3])]])
        .collect()
}

fn geometry(triangles: &[[Vec3; 3]]) -> Geometry {
    let view = camera(Vec3::new(0.0, 2.0, 9.0), Vec3::ZERO);
    let s = scene(vec![mesh(triangles, 0)], vec![material(Vec3::ONE)], view, sun(Vec3::Y));
    Geometry::new(&s, 0, 0.0).unwrap()
}

/// Triangles whose corners are vertices of their own are welded by place; what is open, crowded, twisted or degenerate is
/// counted.
#[test]
fn edges_are_welded() {
    let cube = box_of(Vec3::ZERO, Vec3::ONE);
    let g = geometry(&cube);
    let edges = g.edges();
    assert_eq!((edges.all.len(), edges.sides.len(), edges.found), (18, 36, Found::default()));
    // Each triangle's edges name it again, running from corner to corner.
    for (i, own) in edges.of_triangles.iter().enumerate() {
        for (k, half) in own.iter().enumerate() {
            let edge = edges.all[*half as usize / 2];
            let sides = &edges.sides[edge.first as usize..][..edge.count as usize];
            assert!(sides.contains(&(i as u32 * 2 + half % 2)));
            let corners = g.corners(i);
            let at = |k: usize| g.vertices[edge.ends[k] as usize].position;
            let way = if half % 2 == 0 { [at(0), at(1)] } else { [at(1), at(0)] };
            assert_eq!(way, [corners[k], corners[(k + 1) % 3]]);
        }
    }
    // A lid taken off; one face doubled; one turned over; one drawn out of two points.
    let found = |triangles: &[[Vec3; 3]]| geometry(triangles).edges().found;
    assert_eq!(found(&cube[..10]), Found { open: 4, ..Found::default() });
    let more = [&cube[..], &[[Vec3::ZERO, Vec3::ONE, vec3(0.3, 0.9, 0.1)]]].concat();
    assert_eq!(found(&more), Found { open: 3, ..Found::default() });
    let doubled = [&cube[..], &cube[..1]].concat();
    assert_eq!(found(&doubled), Found { crowded: 3, twisted: 3, ..Found::default() });
    let mut turned = cube.clone();
    turned[0].swap(0, 1);
    assert_eq!(found(&turned), Found { twisted: 3, ..Found::default() });
    let flat = [&cube[..], &[[Vec3::ZERO, Vec3::ZERO, Vec3::ONE]]].concat();
    assert_eq!(found(&flat), Found { degenerate: 1, ..Found::default() });
}
