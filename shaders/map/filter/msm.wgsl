//!include map/prefilter.wgsl
//!include map/filter/hamburger.wgsl
//!include map/filter/quantised.wgsl
// Peters, Klein 2015: of all depths with these four moments, those that shadow the receiver least (the Hamburger moment problem).

var<uniform> msm: MsmParams;

fn sixteen_bits() -> bool {
    return prefiltering.precision_ == precision_16;
}

fn moments(z: f32, slope: f32, plane: u32) -> vec4f {
    let b = vec4f(z, z * z, z * z * z, z * z * z * z);
    if sixteen_bits() {
        return packed(b);
    }
    return b;
}

// What is known of the depths around a receiver, if it were at depth z.
fn known(s: Surface, r: Receiver, z: f32) -> Depths {
    var b = moments_at(s, r);
    var bias = 1e-6 * msm.moment_bias;
    if sixteen_bits() {
        b = unpacked(b);
        // Rounding is so much coarser.
        bias *= 20.0;
    }
    return depths_of(mix(b, vec4f(0.5), bias), z - 0.001 * msm.msm_offset);
}

fn light_at_depth(s: Surface, r: Receiver, z: f32) -> f32 {
    return 1.0 - saturate(msm.overestimation * known(s, r, z).shadow);
}

fn explaining_depths(s: Surface, r: Receiver) -> vec2f {
    let d = known(s, r, receiver_share(r));
    return vec2f(d.near, d.far);
}

fn inspect_filter(s: Surface) -> f32 {
    let r = received(s);
    if frame.map == shows_near_depth || frame.map == shows_far_depth || frame.map == shows_determinant {
        if !s.valid || outside_map(r, r.texel) || !faces_light(s) {
            return -1.0;
        }
        let d = known(s, r, receiver_share(r));
        if frame.map == shows_determinant {
            // From 10⁻¹² to 1.
            return saturate(1.0 + log2(max(d.determinant, 1e-12)) / 39.8631);
        }
        return saturate(select(d.far, d.near, frame.map == shows_near_depth));
    }
    return inspect_look_up(s, r);
}
