//! The minimal shadow frustum (Navratil 2015, algorithm 5): the smallest frustum that sees all receivers in view.

use super::hull::Polyhedron;
use super::{LightImage, Scope, hull};
use crate::light::{Light, LightView};
use glam::{DMat3, DVec2, DVec3, DVec4};

/// The light's view through the rectangle of least area around the receivers' silhouette. `scene`: the scene's convex hull;
/// `reach`: metres across the light that stay free around them.
/// None if the camera sees nothing of it that the light could reach, or the light has no single view.
pub fn view(scope: &Scope, scene: &Polyhedron, reach: f32) -> Option<LightView> {
    let seen = scope.seen_of(scene.clone());
    let corners = seen.corners();
    let casting = casting(scope, scene, &corners);
    let image = match scope.light {
        Light::Directional { .. } => scope.image(),
        // A spot light looks at the middle of what receives and what casts.
        Light::Spot { position, .. } => {
            let from = position.as_dvec3();
            let image = LightImage::new((casting.center()? - from).try_normalize()?, Some(from));
            // What would lie beside or behind the light has no place in this image; the cone's own then serves.
            let before = |image: &LightImage| corners.iter().all(|p| image.depth.dot(p.extend(1.0)) > scope.eps());
            if before(&image) { image } else { return None }
        }
        // A rectangle's keeps its axis and sides, along which filters lay theirs.
        Light::RectArea { .. } => scope.image(),
        _ => return None,
    };
    // Silhouettes of both are the same: what casts lies between the light and what receives.
    let points: Vec<DVec2> = corners.iter().map(|p| image.at(*p)).collect();
    let turn = match scope.light {
        Light::RectArea { .. } => DMat3::IDENTITY,
        _ => turned(&points)?,
    };
    let nearest = scope.nearest(&image, &casting.corners());
    // As far as a filter reaches on each corner's plane: two ends of a diagonal, around which the box lies.
    let around = |p: &DVec3| {
        let (at, out) = (image.at(*p), reach as f64 / image.rows[2].dot(p.extend(1.0)));
        let aside = (turn.transpose() * DVec3::new(out, out, 0.0)).truncate();
        [at - aside, at + aside]
    };
    let points: Vec<DVec2> = corners.iter().flat_map(around).collect();
    scope.view_between(&image, &turn, &points, Some(nearest), scope.deepest(&image, &corners))
}

/// What may cast on what is `seen`, and that itself (the algorithm's O): of the scene what lies in the hull of the light and
/// of what is seen. That hull ends at planes through the light and the edges of the silhouette, and at those planes of the
/// frustum that have the light inside.
fn casting(scope: &Scope, scene: &Polyhedron, seen: &[DVec3]) -> Polyhedron {
    let mut body = scene.clone();
    let image = scope.image();
    let light = match scope.light {
        Light::Directional { .. } => (-image.depth.truncate()).extend(0.0),
        _ => scope.light.position().as_dvec3().extend(1.0),
    };
    let ends = scope.eye().planes().into_iter().chain(scope.reach()).filter(|plane| plane.dot(light) >= 0.0);
    let around = hull::hull(&seen.iter().map(|p| image.at(*p)).collect::<Vec<_>>());
    let sides = (0..around.len()).map(|i| {
        let inward = (around[(i + 1) % around.len()] - around[i]).perp();
        image.rows[0] * inward.x + image.rows[1] * inward.y - image.rows[2] * inward.dot(around[i])
    });
    let sides: Vec<DVec4> = if around.len() > 2 { sides.collect() } else { Vec::new() };
    ends.chain(sides).for_each(|plane| body.clip(plane, scope.eps()));
    body
}

/// The rotation that lays the rectangle of least area around the points along the axes.
pub fn turned(points: &[DVec2]) -> Option<DMat3> {
    let e = hull::least_rectangle(&hull::hull(points))?;
    Some(DMat3::from_cols(DVec3::new(e.x, -e.y, 0.0), DVec3::new(e.y, e.x, 0.0), DVec3::Z))
}
