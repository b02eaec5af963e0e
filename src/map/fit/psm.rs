//! Perspective shadow maps (Stamminger, Drettakis 2002), with what Kozlov 2004 mended.

use super::{LightImage, Scope, hull, warped};
use crate::light::Light;
use glam::{DMat3, DVec2, DVec3, DVec4, Vec4Swizzles};

/// What the light is in the space after the camera's perspective.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Case {
    /// Parallel light: the sun stands at a right angle to the view, or a spot light in the eye's plane.
    Parallel,
    /// A point before which all lies: the light stands ahead of the camera.
    Point,
    /// A point that light runs into: it stands behind the camera.
    Sink,
}

/// How far the camera that gives the perspective is slid back.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slide {
    /// Metres along the view's axis; None: as little as brings all receivers and casters before the eye.
    pub fixed: Option<f64>,
    /// Least near distance of that camera, metres.
    pub least_near: f64,
    /// Push its near plane to the first receiver.
    pub push: bool,
}

/// A fit of a perspective shadow map.
#[derive(Clone, Debug)]
pub struct Psm {
    /// Of the light's image.
    pub warp: DMat3,
    /// None where no slide-back brought all receivers before the light: a plain map.
    pub case: Option<Case>,
    /// How far the eye was slid back, metres.
    pub delta: f64,
    /// The light after the perspective, homogeneous.
    pub light: DVec4,
    /// The receivers' corners after the perspective.
    pub receivers: Vec<DVec3>,
    /// Angle between the light's film plane and the camera's, after the perspective, radians: a right angle where the
    /// light is parallel. None for a plain map.
    pub plane: Option<f64>,
}

/// |w| of the light below which it counts as parallel: the cosine of the angle between its direction from the eye and the
/// view.
const PARALLEL: f64 = 1e-4;

/// Fits the map over `seen`, the corners of what the camera sees.
pub fn fit(scope: &Scope, image: &LightImage, seen: &[DVec3], by: Slide) -> Psm {
    let eye = scope.eye();
    let plain =
        Psm { warp: DMat3::IDENTITY, case: None, delta: 0.0, light: DVec4::ZERO, receivers: Vec::new(), plane: None };
    // There is no perspective to follow.
    if eye.orthographic {
        return plain;
    }
    let depth = |points: &[DVec3]| hull::extent(points.iter().map(|p| DVec2::splat(eye.depth(*p)))).map(|e| e.x);
    let [first, last] = depth(seen);
    // Far enough back for the casters too, and for the least near distance. A spot light's casters reach up to the light, and from
    // behind it little is left of the perspective; wherever they are, they lie on the receivers' rays and keep their place.
    let lamp = matches!(scope.light, Light::Spot { .. });
    let caster = if lamp { first } else { depth(&casters(scope, image, seen))[0] };
    let start = if by.push { first } else { eye.near.min(first) };
    let mut delta = by.fixed.unwrap_or((by.least_near - start.min(caster)).max(0.0));
    for _ in 0..32 {
        let near = (start + delta).max(by.least_near);
        let far = (last + delta).max(near * 1.001);
        if let Some(psm) = perspective(scope, image, seen, delta, [near, far]) {
            return psm;
        }
        if by.fixed.is_some() {
            break;
        }
        // Receivers beside the light's point lie behind it: farther back the perspective is weaker.
        delta = 2.0 * delta + 0.1 * (last - first) + by.least_near;
    }
    plain
}

/// The corners of the body that the light crosses on its way to what is seen: the scene's box within the silhouette of
/// `seen`.
fn casters(scope: &Scope, image: &LightImage, seen: &[DVec3]) -> Vec<DVec3> {
    let mut body = scope.cuboid();
    let around = hull::hull(&seen.iter().map(|p| image.at(*p)).collect::<Vec<_>>());
    for (i, p) in around.iter().enumerate() {
        let inward = (around[(i + 1) % around.len()] - *p).perp();
        let plane = image.rows[0] * inward.x + image.rows[1] * inward.y - DVec4::W * inward.dot(*p);
        body.clip(plane, scope.eps());
    }
    // What lies behind all that is seen casts nothing on it.
    body.clip(DVec4::W * scope.deepest(image, seen) - image.depth, scope.eps());
    body.corners()
}

/// The map through the perspective of an eye `delta` behind the camera's; None if a receiver is not before it, or not
/// before the light.
fn perspective(scope: &Scope, image: &LightImage, seen: &[DVec3], delta: f64, [near, far]: [f64; 2]) -> Option<Psm> {
    let eye = scope.eye();
    let from = eye.position - eye.forward * delta;
    let row = |v: DVec3, d: f64| v.extend(-v.dot(from) + d);
    let stretch = far / (far - near);
    // Rows of Q, the camera's matrix with depth from 0 at the near to 1 at the far plane.
    let q = [
        row(eye.right / eye.tangent.x, 0.0),
        row(eye.up / eye.tangent.y, 0.0),
        row(eye.forward * stretch, -near * stretch),
        row(eye.forward, 0.0),
    ];
    let apply = |p: DVec4| DVec4::new(q[0].dot(p), q[1].dot(p), q[2].dot(p), q[3].dot(p));
    let lamp = matches!(scope.light, Light::Spot { .. });
    // Homogeneous, towards it of unit length; in the very eye it shines along all lines of sight.
    let light = if lamp {
        let at = scope.light.position().as_dvec3();
        let distance = at.distance(from).max(scope.eps());
        apply(at.extend(1.0)) * (1.0 / distance)
    } else {
        apply((-image.depth.truncate()).extend(0.0))
    };
    let mut receivers = Vec::with_capacity(seen.len());
    for p in seen {
        let c = apply(p.extend(1.0));
        if c.w <= 0.0 {
            return None;
        }
        receivers.push(c.xyz() / c.w);
    }
    let [low, high] =
        receivers.iter().fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[low, high], p| [low.min(*p), high.max(*p)]);
    let middle = (low + high) / 2.0;
    let case = match light.w {
        w if w.abs() < PARALLEL => Case::Parallel,
        w if w > 0.0 => Case::Point,
        _ => Case::Sink,
    };
    // From the light to the receivers' middle.
    let point = if case == Case::Parallel { DVec3::ZERO } else { light.xyz() / light.w };
    let gaze = if case == Case::Parallel { -light.xyz() } else { middle - point }.try_normalize()?;
    // Up is the camera's depth where it can be, so that the map does not roll.
    let up = if gaze.z.abs() > 0.999 { DVec3::Y } else { DVec3::Z };
    let right = gaze.cross(up).normalize();
    let up = right.cross(gaze);
    // A row over world space that is blind along the light's rays, as a row over its image.
    let blind = |r: DVec4| {
        let [a, b] = [0, 1].map(|i| r.truncate().dot(image.rows[i].truncate()));
        DVec3::new(a, b, if lamp { r.truncate().dot(image.rows[2].truncate()) } else { r.w })
    };
    // A row over the space after the perspective.
    let over = |v: DVec3| {
        let straight = q[0] * v.x + q[1] * v.y + q[2] * v.z;
        blind(if case == Case::Parallel { straight } else { straight - q[3] * v.dot(point) })
    };
    let w = if case == Case::Parallel { blind(q[3]) } else { over(gaze) };
    let h = DMat3::from_cols(over(right), over(up), w).transpose();
    // w is 1 in the middle of what it takes to the map.
    let ws: Vec<f64> = seen.iter().map(|p| warped(&h, image.at(*p)).1).collect();
    let [least, most] = hull::extent(ws.iter().map(|w| DVec2::splat(*w))).map(|e| e.x);
    if !(least > 1e-4 * most && most.is_finite()) {
        return None;
    }
    let plane = gaze.z.abs().min(1.0).acos();
    Some(Psm { warp: h * (1.0 / least), case: Some(case), delta, light, receivers, plane: Some(plane) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Camera;
    use glam::Vec3;

    /// After the perspective depth runs from 0 at the near plane to 1 at the last receiver, wherever the eye was slid; with its near
    /// plane pushed on from 0 at the first one.
    #[test]
    fn receivers_fill_the_depth_after_the_perspective() {
        let camera = Camera {
            position: Vec3::new(0.0, 2.0, 12.0),
            target: Vec3::new(0.0, 1.0, 0.0),
            up: Vec3::Y,
            fov: 50.0,
            height: None,
            near: 0.5,
            far: 100.0,
        };
        let bounds = [Vec3::new(-5.0, 0.0, -5.0), Vec3::new(5.0, 2.0, 5.0)];
        for to_light in [Vec3::new(0.3, 1.0, 0.2), Vec3::new(0.2, 0.4, 1.0), Vec3::new(0.2, 0.4, -1.0)] {
            let light = Light::Directional { to_light, angular_radius: 0.0, color: Vec3::ONE };
            let scope = Scope { camera, light, bounds, aspect: 1.5, resolution: 512, margin: 1.0 };
            for (delta, push) in [(0.0, true), (3.0, true), (3.0, false), (20.0, false)] {
                let slide = Slide { fixed: Some(delta), least_near: 0.01, push };
                let psm = fit(&scope, &scope.image(), &scope.seen(), slide);
                if psm.case.is_none() {
                    continue;
                }
                let [first, last] = hull::extent(psm.receivers.iter().map(|p| DVec2::splat(p.z))).map(|e| e.x);
                assert!((last - 1.0).abs() < 1e-9, "{to_light} {delta} {push}: up to {last}");
                assert!(if push { first.abs() < 1e-9 } else { first > 0.0 }, "{to_light} {delta} {push}: from {first}");
                assert_eq!(psm.delta, delta);
            }
        }
    }
}
