//!include map/prefilter.wgsl
//!include map/filter/chebyshev.wgsl
// Lauritzen, McCool 2008: variance shadow maps of depth warped by two exponentials. Each bounds the light from above; the
// smaller bound counts.

var<uniform> evsm: EvsmParams;
var<uniform> bounding: ChebyshevParams;

// The positive and the negative warp of a depth from 0 to 1.
fn warped_depth(z: f32) -> vec2f {
    let at = 2.0 * z - 1.0;
    return vec2f(exp(evsm.far_exponent * at), -exp(-evsm.near_exponent * at));
}

fn moments(z: f32, slope: f32, plane: u32) -> vec4f {
    let w = warped_depth(z);
    return vec4f(w.x, w.x * w.x, w.y, w.y * w.y);
}

// The bounds by the positive and the negative warp.
fn bounds(s: Surface, r: Receiver, z: f32) -> vec2f {
    let m = moments_at(s, r);
    let t = warped_depth(z);
    // Warped, a length is longer by the warp's slope.
    let least = 0.002 * evsm.least_deviation * vec2f(evsm.far_exponent, evsm.near_exponent) * t;
    return vec2f(chebyshev(m.xy, t.x, least.x * least.x), chebyshev(m.zw, t.y, least.y * least.y));
}

fn light_at_depth(s: Surface, r: Receiver, z: f32) -> f32 {
    let b = bounds(s, r, z);
    return without_bleeding(min(b.x, b.y), bounding.bleed_reduction);
}

fn explaining_depths(s: Surface, r: Receiver) -> vec2f {
    return vec2f(-1.0);
}

fn inspect_filter(s: Surface) -> f32 {
    let r = received(s);
    if frame.map == shows_positive_bound || frame.map == shows_negative_bound {
        if !s.valid || outside_map(r, r.texel) || !faces_light(s) {
            return -1.0;
        }
        let b = bounds(s, r, receiver_share(r));
        return select(b.y, b.x, frame.map == shows_positive_bound);
    }
    return inspect_look_up(s, r);
}
