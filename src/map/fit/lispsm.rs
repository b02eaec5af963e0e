//! Light space perspective (Wimmer, Scherzer, Purgathofer 2004), with the free parameter of Scherzer 2005.

use super::{LightImage, Scope, hull};
use crate::light::Light;
use glam::{DMat3, DVec2, DVec3};

/// How strongly a light space perspective map is warped.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Strength {
    /// 0: not at all; 1: n_opt; above it as if n_opt were divided by it.
    pub strength: f64,
    /// |cos γ| from which the warp fades out.
    pub fade: f64,
}

/// A fit of light space perspective.
#[derive(Clone, Debug)]
pub struct Lispsm {
    /// Of the light's image: y along the view, x across it.
    pub warp: DMat3,
    /// Distance from the perspective's centre to the near face of the body in the light's image: metres, a spot light's at 1 m;
    /// infinite: no warp.
    pub n: f64,
    /// Angle between the view's direction and that in which light travels, radians.
    pub gamma: f64,
    /// The perspective's direction in the light's image: a unit vector.
    pub direction: DVec2,
    /// A point on the perspective's middle line.
    pub middle: DVec2,
    /// The body's extent along it, from the image's origin.
    pub near: f64,
    pub far: f64,
}

/// n_opt = d / (√(z₁/z₀) − 1) for a body `d` metres long in light space, whose eye-space depths at its two ends are
/// z₀ and z₁ (Scherzer 2005, general form). Infinite where the two are equal, or one of them is behind the eye.
pub fn optimal(d: f64, z0: f64, z1: f64) -> f64 {
    if z0 <= 0.0 || z1 <= z0 { f64::INFINITY } else { d / ((z1 / z0).sqrt() - 1.0) }
}

/// Fits the perspective over `body`, points in world space that have a place in the light's image. Casters before the body
/// lie on the same rays of the light, so that the body extended towards the light has the same image.
///
/// Under a spot light this is the fit in the space after the light's own perspective, where its light is parallel too. A texel is
/// as many times larger as the light is farther, so that what counts is not the eye's depth but its quotient with the light's
/// depth: like the eye's depth under the sun, it is an affine function of the place in that space.
pub fn fit(scope: &Scope, image: &LightImage, body: &[DVec3], by: Strength) -> Lispsm {
    let eye = scope.eye();
    let light = image.depth.truncate();
    let cosine = eye.forward.dot(light).clamp(-1.0, 1.0);
    let across = image.along(eye.forward);
    // Straight into or out of the light there is no direction to warp along.
    let direction = if across.length() < 1e-4 { DVec2::Y } else { across.normalize() };
    // 1 under the sun.
    let distance = |p: &DVec3| image.rows[2].dot(p.extend(1.0));
    let [low, high] =
        hull::extent(body.iter().map(|p| DVec2::new(image.at(*p).dot(direction), eye.depth(*p) / distance(p))));
    // Depths at the ends of the line through the nearest point, across the light.
    let (d, z0) = (high.x - low.x, low.y);
    let mut n = optimal(d, z0, z0 + d * across.length()) / by.strength.max(1e-9);
    // An orthographic camera's pixels are as large everywhere: there is no perspective to follow.
    if across.length() < 1e-4 || by.strength <= 0.0 || eye.orthographic {
        n = f64::INFINITY;
    }
    if cosine.abs() > by.fade {
        n *= 1.0 + 20.0 * (cosine.abs() - by.fade) / (1.0 - by.fade);
    }
    // Not nearer than the view's own near plane: that is the full strength of a perspective shadow map.
    let deepest = body.iter().map(distance).fold(0.0, f64::max);
    n = n.max((eye.near / deepest).min(d));
    let middle = middle(scope, image, body, direction);
    let warp = warp(direction, middle, low.x, n);
    Lispsm { warp, n, gamma: cosine.acos(), direction, middle, near: low.x, far: high.x }
}

/// A point of the light's image on the perspective's middle line: the eye, or, as the eye may have no place in a spot light's,
/// the middle of the body.
fn middle(scope: &Scope, image: &LightImage, body: &[DVec3], direction: DVec2) -> DVec2 {
    if !matches!(scope.light, Light::Spot { .. }) {
        return image.at(scope.eye().position);
    }
    let across = direction.perp();
    let [low, high] = hull::extent(body.iter().map(|p| DVec2::splat(image.at(*p).dot(across)))).map(|x| x.x);
    across * ((low + high) / 2.0)
}

/// The perspective along `direction` whose centre lies `n` before `near`, straight before the point `middle`:
/// w is 1 at the near face and grows to 1 + d/n.
pub fn warp(direction: DVec2, middle: DVec2, near: f64, n: f64) -> DMat3 {
    // x across so that the image is turned, not mirrored.
    let (y, x) = (direction, -direction.perp());
    let (slope, w) = (y / n, 1.0 - near / n);
    DMat3::from_cols(DVec3::new(x.x, y.x, slope.x), DVec3::new(x.y, y.y, slope.y), DVec3::new(-x.dot(middle), -near, w))
}
