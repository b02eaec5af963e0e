//! A hall full of balls, as many as are wanted, to measure with; no scene of the lists.

use super::builder::{Builder, camera, light};
use crate::light::Light;
use crate::scene::{Mesh, Scene};
use glam::{Vec3, vec3};

/// A hall full of balls with this many vertices, three to a triangle as his are.
pub fn build(vertices: usize) -> Scene {
    let mut b = Builder::new("crowd");
    let wall = b.material("wall", 0xc8c2b6);
    let ball = b.material("balls", 0x9a7d5a);
    // Seen from inside.
    let (low, high) = (vec3(-20.0, 0.0, -20.0), vec3(20.0, 9.0, 20.0));
    b.cuboid(wall, low - Vec3::splat(0.2), vec3(high.x, 0.0, high.z) + vec3(0.2, 0.0, 0.2));
    for (axis, side) in [(0, -1.0), (0, 1.0), (2, -1.0), (2, 1.0)] {
        let (mut from, mut to) = (low, high);
        from[axis] = if side < 0.0 { low[axis] - 0.2 } else { high[axis] };
        to[axis] = from[axis] + 0.2;
        b.cuboid(wall, from, to);
    }
    // 1280 triangles each.
    let count = (vertices / 3).div_ceil(1280);
    let columns = (count as f32 / 3.0).sqrt().ceil() as usize;
    let pitch = 38.0 / columns as f32;
    for i in 0..count {
        let (layer, place) = (i % 3, i / 3);
        let at = |k: usize| (k as f32 + 0.5) * pitch - 19.0;
        let center = vec3(at(place % columns), 1.0 + 2.6 * layer as f32, at(place / columns));
        b.icosphere(ball, center, 0.3 * pitch.min(2.0), 3);
    }
    let eye = camera("aisle", vec3(-17.0, 4.9, 0.0), vec3(6.0, 3.6, 0.0), 60.0, 0.1, 80.0);
    let lamp = Light::Omni { position: vec3(0.0, 4.0, 0.0), range: 60.0, radius: 0.0, color: Vec3::splat(12.0) };
    let mut scene = b.finish(vec![eye], vec![light("lamp", lamp)]);
    for mesh in &mut scene.meshes {
        let own = |all: &[Vec3], mesh: &Mesh| mesh.indices.iter().map(|i| all[*i as usize]).collect();
        let (positions, normals) = (own(&mesh.positions, mesh), own(&mesh.normals, mesh));
        let uvs = mesh.indices.iter().map(|i| mesh.uvs[*i as usize]).collect();
        let indices = (0..mesh.indices.len() as u32).collect();
        *mesh = Mesh { positions, normals, uvs, indices, ..mesh.clone() };
    }
    scene
}
