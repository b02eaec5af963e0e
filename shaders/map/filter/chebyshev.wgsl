// What filters with a mean and a mean square share.

var<uniform> bounding: ChebyshevParams;

// What of a share of light counts as none, so that light that bleeds through behind casters goes dark (Lauritzen 2007).
fn without_bleeding(p: f32) -> f32 {
    return saturate((p - bounding.bleed_reduction) / (1.0 - bounding.bleed_reduction));
}

// Chebyshev's inequality: at most this share of what has these moments (mean, mean square) lies at t or beyond.
fn chebyshev(m: vec2f, t: f32, least: f32) -> f32 {
    let variance = max(m.y - m.x * m.x, least);
    let beyond = t - m.x;
    return select(variance / (variance + beyond * beyond), 1.0, beyond <= 0.0);
}
