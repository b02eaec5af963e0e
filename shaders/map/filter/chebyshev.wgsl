// What filters with a mean and a mean square share.

// A share of light of which so much counts as none, so that light that bleeds through behind casters goes dark (Lauritzen 2007).
fn without_bleeding(p: f32, none: f32) -> f32 {
    return saturate((p - none) / (1.0 - none));
}

// Chebyshev's inequality: at most this share of what has these moments (mean, mean square) lies at t or beyond.
fn chebyshev(m: vec2f, t: f32, least: f32) -> f32 {
    let variance = max(m.y - m.x * m.x, least);
    let beyond = t - m.x;
    return select(variance / (variance + beyond * beyond), 1.0, beyond <= 0.0);
}
