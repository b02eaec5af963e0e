//!include lib/frame.wgsl
//!include lib/gbuffer.wgsl
//!include map/light_view.wgsl
// Fits a light's view to the receivers that the camera sees and that face the light, without read-back.

// Of each view the largest u, v, 1 - u, 1 - v, depth share and 1 - depth share of any receiver, as the bits of floats in [0, 1].
var<storage, read_write> extent: array<atomic<u32>, 48>;
var<storage, read_write> fitted: array<LightView, most_layers>;
// Receivers that lie outside the first view: a single one cannot take all that lies before a rectangle.
var<storage, read_write> beyond: atomic<u32>;
// The depths along the camera's axis between which the receivers lie, metres; z: 1 if those outside are counted.
var<uniform> between: vec4f;

// A workgroup takes 64 × 64 pixels in one view, neighbouring threads neighbouring ones: few atomics, no barriers.
@compute @workgroup_size(8, 8)
fn receivers(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_id) local: vec3u) {
    let v = light_views[group.z];
    var most = array<f32, 6>(-1.0, -1.0, -1.0, -1.0, -1.0, -1.0);
    var outside = 0u;
    for (var i = 0u; i < 64u; i++) {
        let p = lit_sample(group.xy * 64u + vec2u(i % 8u, i / 8u) * 8u + local.xy);
        if p.w <= 0.0 || p.w < between.x || p.w >= between.y {
            continue;
        }
        let clip = light_clip(v, p.xyz);
        outside += select(0u, 1u, any(abs(clip.xy) > vec2f(clip.w)));
        let uv = saturate(0.5 + 0.5 * clip.xy / clip.w);
        let z = dot(v.axis, vec4f(p.xyz, 1.0));
        most[0] = max(most[0], uv.x);
        most[1] = max(most[1], uv.y);
        most[2] = max(most[2], 1.0 - uv.x);
        most[3] = max(most[3], 1.0 - uv.y);
        most[4] = max(most[4], saturate((z - v.near) / (v.far - v.near)));
        most[5] = max(most[5], saturate((v.far - z) / (v.far - v.near)));
    }
    if outside > 0u && group.z == 0u && between.z > 0.0 {
        atomicAdd(&beyond, outside);
    }
    if most[0] >= 0.0 {
        for (var i = 0u; i < 6u; i++) {
            // + 0.0 turns a negative zero, whose bits are the largest of all, into zero.
            atomicMax(&extent[6u * group.z + i], bitcast<u32>(most[i] + 0.0));
        }
    }
}

fn extent_of(k: u32, i: u32) -> f32 {
    return bitcast<f32>(atomicLoad(&extent[6u * k + i]));
}

// Narrows each of the whole light's views to the extent found, with `margin` texels to spare for the filter.
@compute @workgroup_size(8)
fn narrow(@builtin(local_invocation_index) k: u32) {
    var v = light_views[k];
    let high = vec2f(extent_of(k, 0u), extent_of(k, 1u));
    let low = 1.0 - vec2f(extent_of(k, 2u), extent_of(k, 3u));
    // With no receiver at all the whole view stays.
    if all(high >= low) {
        let depth = extent_of(k, 4u);
        let spare = v.margin / max(v.resolution - 2.0 * v.margin, 1.0);
        // Metres across the light take the largest share of the image at the receiver nearest to a lamp.
        let nearest = mix(v.far, v.near, extent_of(k, 5u));
        let metre = select(scale_of(v) / select(1.0, nearest, v.perspective == 1u), vec2f(0.0), v.perspective == 2u);
        let half = max((0.5 * (high - low) + 0.5 * min(v.reach * metre, vec2f(1.0))) * (1.0 + 2.0 * spare), vec2f(1e-5));
        let center = low + high - 1.0;
        let scale = 0.5 / half;
        v.row_x = (v.row_x - center.x * v.row_w) * scale.x;
        v.row_y = (v.row_y - center.y * v.row_w) * scale.y;
        if v.perspective == 1u {
            v.texel *= 2.0 * max(half.x, half.y);
        } else {
            v.texel = 2.0 / (v.resolution * min(length(v.row_x.xyz), length(v.row_y.xyz)));
        }
        // Casters are kept from the light on; beyond the last receiver nothing matters.
        let far = v.near + max(depth * 1.0001 + 1e-5, 1e-4) * (v.far - v.near);
        v.far = min(far, v.far);
        let inverse = 1.0 / (v.far - v.near);
        if v.perspective == 1u {
            v.row_z = v.near * inverse * (vec4f(0.0, 0.0, 0.0, v.far) - v.axis);
        } else {
            v.row_z = inverse * (vec4f(0.0, 0.0, 0.0, v.far) - v.axis);
        }
    }
    fitted[k] = v;
}
