//!include map/choose/cascades.wgsl
//!include map/depth_range.wgsl
// Zhang, Sun, Xu, Lun 2006: a shadow map for each part of the view frustum.

var<uniform> pssm: PssmParams;
// `splits`, to be written.
var<storage, read_write> parts: array<f32>;

// As `splits` in Rust, between the nearest and the farthest sample.
@compute @workgroup_size(1)
fn place_splits() {
    let found = depth_range();
    let near = select(frame.near, found.x, found.x > 0.0);
    let far = max(select(frame.far, found.y, found.x > 0.0), near);
    let percents = array<f32, 7>(pssm.percent_1, pssm.percent_2, pssm.percent_3, pssm.percent_4, pssm.percent_5,
                                 pssm.percent_6, pssm.percent_7);
    let count = f32(fitting.count);
    parts[0] = near;
    for (var i = 1u; i < fitting.count; i++) {
        let share = f32(i) / count;
        let even = near + (far - near) * share;
        // Without a perspective all depths need the same texels.
        let lambda = select(pssm.lambda, 0.0, frame.shadow_orthographic == 1u);
        var at = mix(even, near * pow(far / near, share), lambda) + pssm.split_bias * (far - near) / count;
        if pssm.scheme == scheme_percent {
            at = near + (far - near) * percents[i - 1u] / 100.0;
        }
        parts[i] = clamp(at, parts[i - 1u], far);
    }
    parts[fitting.count] = far;
}

fn inspect_map(s: Surface) -> f32 {
    return inspect_cascades(s);
}
