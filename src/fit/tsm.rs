//! Trapezoidal shadow maps (Martin, Tan 2004; the recipe of Morais 2015, equations 7 to 16).

use super::{LightImage, Scope, hull, msf};
use glam::{DMat3, DVec2, DVec3};

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

/// Fits the trapezoid to the frustum's eight corners. `p`: share of the map that the range from the near plane to the
/// point in focus takes; `focus`: where that point lies on the view's axis, as a share of the frustum's length.
pub fn fit(scope: &Scope, image: &LightImage, p: f64, focus: f64) -> Tsm {
    let eye = scope.eye();
    let corners = eye.corners().map(|c| image.at(c));
    let hull = hull::hull(&corners);
    let on_axis = |z: f64| image.at(eye.position + eye.forward * z);
    let (near, far) = (on_axis(eye.near), on_axis(eye.far));
    let focus = on_axis(eye.near + focus * (eye.far - eye.near));
    let [low, high] = hull::extent(hull.iter().copied());
    let axis = (far - near).try_normalize().unwrap_or(DVec2::Y);
    let heights = hull::extent(hull.iter().map(|c| DVec2::splat((*c - near).dot(axis))));
    let (top, base) = (heights[0].x, heights[1].x);
    let lambda = base - top;
    let mut out = Tsm { warp: DMat3::IDENTITY, trapezoid: None, q: near, focus, axis, hull };
    // Along the light the centre line is a point: the far face alone is seen.
    let clear = (far - near).length() > 1e-3 * (high - low).length();
    let delta = (focus - near).dot(axis) - top;
    if let Some(eta) = vanishing(lambda, delta, p).filter(|_| clear && delta > 0.0) {
        out.q = near + axis * (top - eta);
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
