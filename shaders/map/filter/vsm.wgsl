//!include map/prefilter.wgsl
//!include map/filter/chebyshev.wgsl
// Donnelly, Lauritzen 2006: mean and mean square of depth bound the share of casters behind the receiver.

var<uniform> vsm: VsmParams;
var<uniform> bounding: ChebyshevParams;

// A texel's surface is not flat: within it, depth varies by a quarter of the squared slope (their equation 5).
fn moments(z: f32, slope: f32, plane: u32) -> vec4f {
    let varied = min(slope, vsm.slope_within);
    return vec4f(z, z * z + 0.25 * varied * varied, 0.0, 0.0);
}

fn bound(s: Surface, r: Receiver, z: f32) -> f32 {
    return chebyshev(moments_at(s, r).xy, z, 1e-6 * vsm.least_variance);
}

fn light_at_depth(s: Surface, r: Receiver, z: f32) -> f32 {
    return without_bleeding(bound(s, r, z), bounding.bleed_reduction);
}

fn explaining_depths(s: Surface, r: Receiver) -> vec2f {
    return vec2f(moments_at(s, r).x, -1.0);
}

fn inspect_filter(s: Surface) -> f32 {
    let r = received(s);
    if !s.valid || outside_map(r, r.texel) {
        return -1.0;
    }
    if frame.map == shows_mean_depth {
        return moments_at(s, r).x;
    }
    if frame.map == shows_deviation {
        let m = moments_at(s, r);
        return sqrt(max(m.y - m.x * m.x, 0.0));
    }
    if frame.map == shows_bound {
        return select(-1.0, bound(s, r, receiver_share(r)), faces_light(s));
    }
    return inspect_look_up(s, r);
}
