//!include lib/frame.wgsl
//!include lib/gbuffer.wgsl
//!include map/light_view.wgsl
// Fits a light's view to the receivers that the camera sees and that face the light, without read-back; those that includers take
// (`fn is_taken(position: vec3f, view: u32) -> bool`).

// Of each view the largest u, v, 1 - u, 1 - v, depth share and 1 - depth share of any receiver, as the bits of floats in [0, 1].
var<storage, read_write> extent: array<atomic<u32>, 48>;
var<storage, read_write> fitted: array<LightView, most_layers>;
// Receivers that lie outside the first view: a single one cannot take all that lies before a rectangle.
var<storage, read_write> beyond: atomic<u32>;
// The depths along the camera's axis between which the receivers lie, metres; z: 1 if those outside are counted.
var<uniform> between: vec4f;

// Of some receivers: `most` as a view's `extent`, all negative where there are none, and how many lie outside the view.
struct Extent {
    most: array<f32, 6>,
    outside: u32,
}

// Of the receivers between two depths among 64 × 64 pixels that a thread takes, neighbouring threads neighbouring ones: few atomics, no
// barriers.
fn extent_in(v: LightView, view: u32, group: vec2u, local: vec2u, depths: vec2f) -> Extent {
    var e = Extent(array<f32, 6>(-1.0, -1.0, -1.0, -1.0, -1.0, -1.0), 0u);
    for (var i = 0u; i < 64u; i++) {
        let p = lit_sample(group * 64u + vec2u(i % 8u, i / 8u) * 8u + local);
        if p.w <= 0.0 || p.w < depths.x || p.w >= depths.y || !is_taken(p.xyz, view) {
            continue;
        }
        let clip = light_clip(v, p.xyz);
        e.outside += select(0u, 1u, any(abs(clip.xy) > vec2f(clip.w)));
        let uv = saturate(0.5 + 0.5 * clip.xy / clip.w);
        let z = dot(v.axis, vec4f(p.xyz, 1.0));
        e.most[0] = max(e.most[0], uv.x);
        e.most[1] = max(e.most[1], uv.y);
        e.most[2] = max(e.most[2], 1.0 - uv.x);
        e.most[3] = max(e.most[3], 1.0 - uv.y);
        e.most[4] = max(e.most[4], saturate((z - v.near) / (v.far - v.near)));
        e.most[5] = max(e.most[5], saturate((v.far - z) / (v.far - v.near)));
    }
    return e;
}

// A workgroup takes 64 × 64 pixels in one view.
@compute @workgroup_size(8, 8)
fn receivers(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_id) local: vec3u) {
    let e = extent_in(light_views[group.z], group.z, group.xy, local.xy, between.xy);
    if e.outside > 0u && group.z == 0u && between.z > 0.0 {
        atomicAdd(&beyond, e.outside);
    }
    if e.most[0] >= 0.0 {
        for (var i = 0u; i < 6u; i++) {
            // + 0.0 turns a negative zero, whose bits are the largest of all, into zero.
            atomicMax(&extent[6u * group.z + i], bitcast<u32>(e.most[i] + 0.0));
        }
    }
}

// The view of the whole light narrowed to an extent, with `margin` texels to spare for the filter.
fn narrowed(whole: LightView, most: array<f32, 6>) -> LightView {
    var v = whole;
    let high = vec2f(most[0], most[1]);
    let low = 1.0 - vec2f(most[2], most[3]);
    // With no receiver at all the whole view stays.
    if all(high >= low) {
        let depth = most[4];
        let spare = v.margin / max(v.resolution - 2.0 * v.margin, 1.0);
        // Metres across the light take the largest share of the image at the receiver nearest to a lamp.
        let nearest = mix(v.far, v.near, most[5]);
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
    return v;
}

// A thread a view.
@compute @workgroup_size(8)
fn narrow(@builtin(local_invocation_index) k: u32) {
    var most: array<f32, 6>;
    for (var i = 0u; i < 6u; i++) {
        most[i] = bitcast<f32>(atomicLoad(&extent[6u * k + i]));
    }
    fitted[k] = narrowed(light_views[k], most);
}
