//! Trapezoidal shadow maps (Martin, Tan 2004; the recipe of Morais 2015, equations 7 to 16).

use super::{Eye, LightImage, Scope, hull, msf};
use crate::light::Light;
use glam::{DMat3, DVec2, DVec3, DVec4};

/// A trapezoid around the view frustum in the light's image, and the warp that makes it a square.
#[derive(Clone, Debug)]
pub struct Tsm {
    pub warp: DMat3,
    /// The frustum's hull, counter-clockwise.
    pub hull: Vec<DVec2>,
    /// t₀ to t₃: two corners of the base, two of the top; None where an oriented rectangle stands in.
    pub trapezoid: Option<[DVec2; 4]>,
    /// The vanishing point.
    pub q: DVec2,
    /// The point in focus, projected onto the centre line.
    pub focus: DVec2,
    /// Unit vector along the centre line, from the near to the far face.
    pub axis: DVec2,
}

/// Distance from the top line to the vanishing point, so that what lies `focus` behind the top line of a trapezoid
/// `lambda` high gets the share `p` of the map (Morais equation 12 for p = 0.8). None where no such point exists.
pub fn vanishing(lambda: f64, focus: f64, p: f64) -> Option<f64> {
    let xi = 1.0 - 2.0 * p;
    let below = lambda - 2.0 * focus - xi * lambda;
    let eta = lambda * focus * (1.0 + xi) / below;
    (below > 1e-6 * lambda && eta > 0.0 && eta < 1e6 * lambda).then_some(eta)
}

/// Fits the trapezoid to the frustum's eight corners; under a spot light to those of the part of the frustum that its cone holds.
/// `p`: share of the map that the range from the near plane to the point in focus takes; `focus`: where that point lies on
/// the view's axis, as a share of the frustum's length.
pub fn fit(scope: &Scope, image: &LightImage, p: f64, focus: f64) -> Tsm {
    let eye = scope.eye();
    // Without a perspective a plain map serves, and of what is seen alone.
    let body = if eye.orthographic { scope.seen() } else { scope.slice(eye.near, eye.far) };
    let hull = hull::hull(&body.iter().map(|c| image.at(*c)).collect::<Vec<_>>());
    let line = match scope.light {
        Light::Spot { .. } => lamp_line(&eye, image, &body, focus),
        _ => {
            let on_axis = |z: f64| image.at(eye.position + eye.forward * z);
            let (near, far) = (on_axis(eye.near), on_axis(eye.far));
            let axis = (far - near).try_normalize().unwrap_or(DVec2::Y);
            let focus = on_axis(eye.near + focus * (eye.far - eye.near));
            Line {
                origin: near,
                axis,
                length: (far - near).length(),
                focus: (focus - near).dot(axis),
                eye: f64::INFINITY,
            }
        }
    };
    let (origin, axis) = (line.origin, line.axis);
    let [low, high] = hull::extent(hull.iter().copied());
    let heights = hull::extent(hull.iter().map(|c| DVec2::splat((*c - origin).dot(axis))));
    let (top, base) = (heights[0].x, heights[1].x);
    let lambda = base - top;
    let at_focus = origin + axis * line.focus;
    let mut out = Tsm { warp: DMat3::IDENTITY, trapezoid: None, q: origin, focus: at_focus, axis, hull };
    // Along the light the centre line is a point: the far face alone is seen.
    let clear = line.length > 1e-3 * (high - low).length();
    let delta = line.focus - top;
    // A spot light's cone may begin beyond the point in focus: then q is the eye.
    let rule = if delta > 0.0 { vanishing(lambda, delta, p) } else { Some(0.0) };
    let eta = rule.map(|eta| eta.max(top - line.eye)).filter(|eta| *eta > 0.0 && *eta < 1e6 * lambda);
    if let Some(eta) = eta.filter(|_| clear && !eye.orthographic) {
        out.q = origin + axis * (top - eta);
        // Tangents from q: the hull's corners at the smallest and largest angle.
        let slope = |c: &DVec2| (*c - out.q).dot(axis.perp()) / (*c - out.q).dot(axis);
        let [least, most] = hull::extent(out.hull.iter().map(|c| DVec2::splat(slope(c))));
        let corner = |height: f64, slope: f64| out.q + (axis + axis.perp() * slope) * height;
        let (left, right) = (least.x, most.x);
        let t = [corner(eta + lambda, left), corner(eta + lambda, right), corner(eta, right), corner(eta, left)];
        if let Some(warp) = normalise(&t) {
            (out.warp, out.trapezoid) = (warp, Some(t));
            return out;
        }
    }
    // The rectangle along the centre line, or that of least area where there is no such line.
    out.warp = if clear {
        let x = axis.perp();
        DMat3::from_cols(DVec3::new(x.x, -axis.x, 0.0), DVec3::new(x.y, -axis.y, 0.0), DVec3::Z)
    } else {
        msf::turned(&out.hull).unwrap_or(DMat3::IDENTITY)
    };
    out
}

/// The view's axis in the light's image.
struct Line {
    /// A point of it, and its direction from near to far.
    origin: DVec2,
    axis: DVec2,
    /// From the near to the far face.
    length: f64,
    /// Where the point in focus and the eye lie, from the origin along the axis; the sun's rule asks for no eye.
    focus: f64,
    eye: f64,
}

/// The view's axis under a spot light, whose cone holds `body` of the frustum. The near and far face are those of the body.
///
/// As the eye comes beside the light its image goes to infinity, and with it the vanishing point. Behind the light the
/// foreground is close to it, so that its texels are small already: a rectangle serves.
fn lamp_line(eye: &Eye, image: &LightImage, body: &[DVec3], focus: f64) -> Line {
    let place = |row: DVec4, z: f64| row.dot((eye.position + eye.forward * z).extend(1.0));
    let depth = |z: f64| place(image.rows[2], z);
    let before = depth(0.0);
    // The image's derivative along the axis at the eye, times `before` squared.
    let at_eye = DVec2::new(place(image.rows[0], 0.0), place(image.rows[1], 0.0));
    let derivative = image.along(eye.forward) * before - at_eye * image.depth.truncate().dot(eye.forward);
    let axis = derivative.try_normalize().unwrap_or(DVec2::Y);
    if before <= 0.0 {
        let length = derivative.length() * f64::INFINITY;
        return Line { origin: DVec2::ZERO, axis, length, focus: f64::INFINITY, eye: f64::NEG_INFINITY };
    }
    let [near, far] = hull::extent(body.iter().map(|p| DVec2::splat(eye.depth(*p)))).map(|z| z.x);
    // From the eye on; infinite from the light's plane on.
    let along = |z: f64| if depth(z) > 0.0 { derivative.length() * z / (before * depth(z)) } else { f64::INFINITY };
    let length = if depth(near) > 0.0 { along(far) - along(near) } else { f64::INFINITY };
    Line { origin: at_eye / before, axis, length, focus: along(near + focus * (far - near)), eye: 0.0 }
}

/// The eight matrices of Martin and Tan that take a trapezoid to the square from (-1, -1) to (1, 1):
/// t₀ to its lower left corner, and so on around it. With N's last row as Martin and Tan have it, w' = y.
pub fn normalise(t: &[DVec2; 4]) -> Option<DMat3> {
    let rows = |a: [f64; 3], b: [f64; 3], c: [f64; 3]| DMat3::from_cols_array_2d(&[a, b, c]).transpose();
    let shift = |d: DVec2| rows([1.0, 0.0, d.x], [0.0, 1.0, d.y], [0.0, 0.0, 1.0]);
    let middle = (t[2] + t[3]) / 2.0;
    let t1 = shift(-middle);
    let u = (t[2] - t[3]).try_normalize()?;
    let r = rows([u.x, u.y, 0.0], [u.y, -u.x, 0.0], [0.0, 0.0, 1.0]);
    // Where the sides meet.
    let (a, b) = (t[3] - t[0], t[2] - t[1]);
    let i = t[0] + a * ((t[1] - t[0]).perp_dot(b) / a.perp_dot(b));
    let m = r * t1;
    let t2 = shift(-(m * i.extend(1.0)).truncate());
    let m = t2 * m;
    let u = m * middle.extend(1.0);
    let h = rows([1.0, -u.x / u.y, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]);
    let m = h * m;
    let u = m * t[2].extend(1.0);
    let s1 = rows([1.0 / u.x, 0.0, 0.0], [0.0, 1.0 / u.y, 0.0], [0.0, 0.0, 1.0]);
    let n = rows([1.0, 0.0, 0.0], [0.0, 1.0, 1.0], [0.0, 1.0, 0.0]);
    let m = n * s1 * m;
    let (u, v) = (m * t[0].extend(1.0), m * t[2].extend(1.0));
    let t3 = rows([1.0, 0.0, 0.0], [0.0, 1.0, -(u.y / u.z + v.y / v.z) / 2.0], [0.0, 0.0, 1.0]);
    let m = t3 * m;
    let u = m * t[0].extend(1.0);
    let s2 = rows([1.0, 0.0, 0.0], [0.0, -u.z / u.y, 0.0], [0.0, 0.0, 1.0]);
    let m = s2 * m;
    // w is 1 on the top line.
    let all = m * (1.0 / (m * t[2].extend(1.0)).z);
    all.to_cols_array().iter().all(|v| v.is_finite()).then_some(all)
}
