//! The part of a face around a light in which the camera can see something of the scene (after Navratil 2015, algorithm 5: what the
//! minimal shadow frustum is fitted to).

use super::Scope;
use super::faces::{Around, Face};
use super::hull::{Polyhedron, extent};
use crate::light::LightView;
use glam::{DVec2, DVec3};

/// Each face's map narrowed to the box of that part, along the face's sides, and to the depth of its farthest point. `scene`: the
/// scene's convex hull. A face in which the camera sees nothing stays as it is.
pub fn narrowed(scope: &Scope, around: &Around, scene: &Polyhedron, faces: Vec<Face>) -> Vec<Face> {
    let seen = scope.seen_of(scene.clone());
    let narrow = |face: &Face| {
        let body = face.part_of(&seen, &faces, around, (0.0, scope.eps()));
        let sides = body.faces().iter().flat_map(|f| (0..f.len()).map(|i| [f[i], f[(i + 1) % f.len()]]));
        let view = &face.view;
        let (places, depths): (Vec<[DVec2; 2]>, Vec<f64>) =
            sides.filter_map(|side| seen_side(view, around, side.map(|p| p - around.light))).unzip();
        let [low, high] = extent(places.into_iter().flatten()).map(|p| p.clamp(DVec2::NEG_ONE, DVec2::ONE));
        if !(low.cmplt(high).all()) {
            return *face;
        }
        Face { view: cropped(view, around, [low, high], depths.into_iter().fold(0.0, f64::max)), ..*face }
    };
    faces.iter().map(narrow).collect()
}

/// The box of an edge's image, clip positions over w, and its largest depth; both ends from the light on. None where it runs through the light.
fn seen_side(view: &LightView, around: &Around, ends: [DVec3; 2]) -> Option<([DVec2; 2], f64)> {
    let [x, y, z] = [view.row_x, view.row_y, view.axis].map(|row| row.truncate().as_dvec3());
    let least = 1e-9 * around.far;
    if view.perspective != LightView::PARABOLOID {
        // Before the light all the same, if by a hair: what lies beside it is seen in all of the face.
        let at = |p: DVec3| DVec2::new(x.dot(p), y.dot(p)) / z.dot(p).max(least);
        let depth = ends.map(|p| z.dot(p)).into_iter().fold(0.0, f64::max);
        return Some((extent(ends.map(at)), depth));
    }
    let ends = ends.map(|p| DVec3::new(x.dot(p), y.dot(p), z.dot(p)));
    if ends.iter().any(|q| q.length() <= least) {
        return None;
    }
    let part = view.row_z.as_dvec4();
    let placed = |at: DVec2| (at - DVec2::new(part.x, part.y)) * DVec2::new(part.z, part.w);
    let mut places: Vec<DVec2> = ends.iter().map(|q| placed(q.truncate() / (q.length() + q.z).max(least))).collect();
    // An arc of a circle reaches farthest at its ends, or at those of the circle's extremes that it passes: as `with_arc` in WGSL.
    if let Some(m) = ends[0].cross(ends[1]).try_normalize().filter(|m| m.z.abs() > 1e-9) {
        for along in [DVec2::X, DVec2::NEG_X, DVec2::Y, DVec2::NEG_Y] {
            let at = m.truncate() / m.z + along / m.z.abs();
            let ray = (2.0 * at).extend(1.0 - at.length_squared());
            if ends[0].cross(ray).dot(m) >= 0.0 && ray.cross(ends[1]).dot(m) >= 0.0 {
                places.push(placed(at));
            }
        }
    }
    Some((extent(places), ends.iter().map(|q| q.length()).fold(0.0, f64::max)))
}

/// A view that holds a box of its image, with its guard band around it: as `fit_faces` in `shaders/map/warp/faces.wgsl`.
fn cropped(view: &LightView, around: &Around, [low, high]: [DVec2; 2], deepest: f64) -> LightView {
    let spare = around.guard / (around.side - 2.0 * around.guard).max(1.0);
    // Rounding of what is looked up in 32 bits.
    let half = (0.5 * (high - low) * (1.0 + 2.0 * spare) + 1e-5).max(DVec2::splat(1e-5));
    let center = 0.5 * (low + high);
    let mut view = *view;
    let far = (deepest * 1.0001 + 1e-5).clamp(around.near * 1.001, around.far) as f32;
    if view.perspective == LightView::PARABOLOID {
        let part = view.row_z.as_dvec4();
        let middle = DVec2::new(part.x, part.y) + center / DVec2::new(part.z, part.w);
        let scale = DVec2::new(part.z, part.w) / half;
        view.row_z = glam::DVec4::new(middle.x, middle.y, scale.x, scale.y).as_vec4();
    } else {
        let row =
            |row: glam::Vec4, i: usize| ((row.as_dvec4() - view.row_w.as_dvec4() * center[i]) / half[i]).as_vec4();
        (view.row_x, view.row_y) = (row(view.row_x, 0), row(view.row_y, 1));
        view.row_z = (glam::Vec4::W * far - view.axis) / (far - view.near);
    }
    view.far = far;
    view
}
