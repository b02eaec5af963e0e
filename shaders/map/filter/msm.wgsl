//!include map/prefilter.wgsl
//!include map/filter/hamburger.wgsl
// Peters, Klein 2015: of all depths with these four moments, those that shadow the receiver least (the Hamburger moment problem).

var<uniform> msm: MsmParams;

// Sixteen bits hold the moments turned into a basis that fills them evenly (their section 3.4): each row of `b` times these
// columns, and back.
fn packed(b: vec4f) -> vec4f {
    return vec4f(dot(b, vec4f(-2.07224649, 32.23703778, -68.571074599, 39.3703274134)) + 0.035955884801,
                 dot(b, vec4f(13.7948857237, -59.4683975703, 82.0359750338, -35.364903257)),
                 dot(b, vec4f(0.105877704, -1.9077466311, 9.3496555107, -6.6543490743)),
                 dot(b, vec4f(9.7924062118, -33.7652110555, 47.9456096605, -23.9728048165)));
}

fn unpacked(packed: vec4f) -> vec4f {
    let p = packed - vec4f(0.035955884801, 0.0, 0.0, 0.0);
    return vec4f(dot(p, vec4f(0.2227744146, 0.0771972861, 0.7926986636, 0.0319417555)),
                 dot(p, vec4f(0.1549679261, 0.1394629426, 0.7963415838, -0.1722823173)),
                 dot(p, vec4f(0.1451988946, 0.2120202157, 0.7258694464, -0.2758014811)),
                 dot(p, vec4f(0.163127443, 0.2591432266, 0.6539092497, -0.3376131734)));
}

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

fn kernel_reach() -> f32 {
    return 0.0;
}

fn light_at_depth(s: Surface, r: Receiver, z: f32) -> f32 {
    return 1.0 - saturate(msm.overestimation * known(s, r, z).shadow);
}

fn explaining_depths(s: Surface, r: Receiver) -> vec2f {
    let d = known(s, r, receiver_share(r));
    return vec2f(d.near, d.far);
}

fn inspect_filter(s: Surface) -> f32 {
    let r = receive(s, choose(s).layer, 0.0, 2.0);
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
