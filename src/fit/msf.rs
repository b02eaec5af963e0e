//! The minimal shadow frustum (Navratil 2015, algorithm 5): the smallest frustum that sees all receivers in view.

use super::{LightImage, Scope, hull, warped};
use crate::light::{Light, LightView};
use glam::{DMat3, DVec2, DVec3};

/// The light's view through the rectangle of least area around the receivers' silhouette. None if the camera sees
/// nothing of the scene that the light could reach, or the light has no single view.
pub fn view(scope: &Scope) -> Option<LightView> {
    let seen = scope.seen();
    let image = match scope.light {
        Light::Directional { .. } => scope.image(),
        // A lamp looks at the middle of what it shall see.
        Light::Spot { position, .. } => {
            let middle = seen.iter().sum::<DVec3>() / seen.len().max(1) as f64;
            let from = position.as_dvec3();
            let axis = (middle - from).try_normalize()?;
            let image = LightImage::new(axis, Some(from));
            // What would lie beside or behind the lamp has no place in this image; the cone's own then serves.
            let before = |image: &LightImage| seen.iter().all(|p| image.depth.dot(p.extend(1.0)) > scope.eps());
            if before(&image) { image } else { return None }
        }
        _ => return None,
    };
    let points: Vec<DVec2> = seen.iter().map(|p| image.at(*p)).collect();
    let turn = turned(&points)?;
    scope.view(&image, &turn, &points, scope.deepest(&image, &seen))
}

/// The rotation that lays the rectangle of least area around the points along the axes.
pub fn turned(points: &[DVec2]) -> Option<DMat3> {
    let e = hull::least_rectangle(&hull::hull(points))?;
    Some(DMat3::from_cols(DVec3::new(e.x, -e.y, 0.0), DVec3::new(e.y, e.x, 0.0), DVec3::Z))
}

/// Area of the box around points after a warp.
pub fn area(h: &DMat3, points: &[DVec2]) -> f64 {
    let [low, high] = hull::extent(points.iter().map(|p| warped(h, *p).0));
    (high - low).element_product()
}
