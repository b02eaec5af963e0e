//!include lib/frame.wgsl
//!include lib/gbuffer.wgsl
//!include map/light_view.wgsl
// Where in each of several layers pixels look: nothing of it is read back. Includers say which layer a surface belongs to:
// `fn layer_of(position: vec3f) -> u32`.

// View samples of each layer.
var<storage, read_write> samples: array<atomic<u32>, most_layers>;
// Of each layer the largest u, v, 1 - u, 1 - v and depth share of its view samples, as the bits of floats in [0, 1].
var<storage, read_write> extents: array<atomic<u32>, 40>;

const words = 5u;

// What a thread found in the layer that its last pixels lie in.
struct Found {
    layer: u32,
    number: u32,
    most: array<f32, 5>,
}

fn put_down(found: Found) {
    if found.number == 0u {
        return;
    }
    atomicAdd(&samples[found.layer], found.number);
    for (var k = 0u; k < words; k++) {
        // + 0.0 turns a negative zero, whose bits are the largest of all, into zero.
        atomicMax(&extents[words * found.layer + k], bitcast<u32>(found.most[k] + 0.0));
    }
}

// A workgroup takes 64 × 64 pixels; a thread's pixels mostly lie in one layer: few atomics.
@compute @workgroup_size(8, 8)
fn extents_of_layers(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_id) local: vec3u) {
    var found: Found;
    for (var i = 0u; i < 64u; i++) {
        let p = lit_sample(group.xy * 64u + vec2u(i % 8u, i / 8u) * 8u + local.xy);
        if p.w <= 0.0 {
            continue;
        }
        let layer = layer_of(p.xyz);
        if layer != found.layer {
            put_down(found);
            found = Found(layer, 0u, array<f32, 5>());
        }
        let v = light_views[layer];
        let clip = light_clip(v, p.xyz);
        let uv = saturate(0.5 + 0.5 * clip.xy / clip.w);
        found.number++;
        found.most[0] = max(found.most[0], uv.x);
        found.most[1] = max(found.most[1], uv.y);
        found.most[2] = max(found.most[2], 1.0 - uv.x);
        found.most[3] = max(found.most[3], 1.0 - uv.y);
        found.most[4] = max(found.most[4], saturate((depth_in(v, p.xyz) - v.near) / (v.far - v.near)));
    }
    put_down(found);
}

fn has_samples(layer: u32) -> bool {
    return atomicLoad(&samples[layer]) > 0u;
}

// A layer's view narrowed to its view samples.
fn narrowed_to_samples(whole: LightView, i: u32) -> LightView {
    var v = whole;
    var found: array<f32, 5>;
    for (var k = 0u; k < words; k++) {
        found[k] = bitcast<f32>(atomicLoad(&extents[words * i + k]));
    }
    let high = vec2f(found[0], found[1]);
    let low = 1.0 - vec2f(found[2], found[3]);
    let spare = v.margin / max(v.resolution - 2.0 * v.margin, 1.0);
    let half = max((0.5 * (high - low)) * (1.0 + 2.0 * spare), vec2f(1e-5));
    let center = low + high - 1.0;
    let scale = 0.5 / half;
    if v.perspective == 3u {
        // A part of a paraboloid's image.
        v.row_z = vec4f(v.row_z.xy + center / v.row_z.zw, v.row_z.zw * scale);
    } else {
        v.row_x = (v.row_x - center.x * v.row_w) * scale.x;
        v.row_y = (v.row_y - center.y * v.row_w) * scale.y;
    }
    // Beyond the last receiver nothing matters.
    v.far = min(v.near + max(found[4] * 1.0001 + 1e-5, 1e-4) * (v.far - v.near), v.far);
    if v.perspective != 3u {
        v.row_z = (vec4f(0.0, 0.0, 0.0, v.far) - v.axis) / (v.far - v.near);
    }
    return v;
}
