//! The perspective under a logarithmic warp (Lloyd, Govindaraju, Quammen, Molnar, Manocha 2008).
//!
//! From its centre at a distance s in [n, f] the map's axis along the view is ln(s/n) / ln(f/n); the other one stays
//! perspective. The logarithm follows a perspective of the same centre, a homography as in [`lispsm`].

use super::lispsm::{self, Lispsm, Strength};
use super::{LightImage, Scope};
use glam::DVec3;

/// Largest f/n: at this one a 32-bit place after the perspective, near its far end, is known to half a texel in 1024.
pub const DEEPEST: f64 = 1e5;

/// Fits the perspective over `body`, as [`lispsm::fit`]. `strength`: as in [`parameter`]; `fade`: the |cos γ| from which it
/// goes to 0, where gaze and light are parallel.
pub fn fit(scope: &Scope, image: &LightImage, body: &[DVec3], strength: f64, fade: f64) -> Lispsm {
    let optimal = lispsm::fit(scope, image, body, Strength { strength: 1.0, fade: 1.0 });
    let faded = ((optimal.gamma.cos().abs() - fade) / (1.0 - fade)).clamp(0.0, 1.0);
    let n = parameter(optimal.far - optimal.near, optimal.n, strength * (1.0 - faded));
    Lispsm { warp: lispsm::warp(optimal.direction, optimal.middle, optimal.near, n), n, ..optimal }
}

/// The distance n from the perspective's centre to the near face of a body that is `d` long: d / ((z₁/z₀)^strength - 1),
/// with eye-space depths z₀ and z₁ at its ends.
///
/// 1: s is proportional to the eye's depth (n = z_n where light and gaze are at right angles), and so are, after the
/// logarithm, texels and pixels: m is the same all along the view. 0.5: n_opt of light space perspective. 0: infinite.
/// `optimal` is that n_opt = d / (√(z₁/z₀) - 1), from which follows the quotient of depths; infinite if there is none.
pub fn parameter(d: f64, optimal: f64, strength: f64) -> f64 {
    let ratio = (2.0 * strength * (d / optimal).ln_1p()).min(DEEPEST.ln());
    if ratio > 0.0 { d / ratio.exp_m1() } else { f64::INFINITY }
}
