//!include lib/frame.wgsl
//!include lib/gbuffer.wgsl
//!include map/faces_of.wgsl
//!include map/light_view.wgsl
// The faces around a light that are warped: which of them some pixel looks up, and where in each. Nothing of it is read back.

// View samples of each face.
var<storage, read_write> samples: array<atomic<u32>, most_layers>;
// Of each face the largest u, v, 1 - u, 1 - v and depth share of its view samples, as the bits of floats in [0, 1].
var<storage, read_write> extents: array<atomic<u32>, 40>;

const words = 5u;

// What a thread found in the face that its last pixels lie in.
struct Found {
    face: u32,
    number: u32,
    most: array<f32, 5>,
}

fn put_down(found: Found) {
    if found.number == 0u {
        return;
    }
    atomicAdd(&samples[found.face], found.number);
    for (var k = 0u; k < words; k++) {
        // + 0.0 turns a negative zero, whose bits are the largest of all, into zero.
        atomicMax(&extents[words * found.face + k], bitcast<u32>(found.most[k] + 0.0));
    }
}

// A workgroup takes 64 × 64 pixels; a thread's pixels mostly lie in one face: few atomics.
@compute @workgroup_size(8, 8)
fn extents_of_faces(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_id) local: vec3u) {
    var found: Found;
    for (var i = 0u; i < 64u; i++) {
        let p = lit_sample(group.xy * 64u + vec2u(i % 8u, i / 8u) * 8u + local.xy);
        if p.w <= 0.0 {
            continue;
        }
        let face = face_of(p.xyz - frame.light_position);
        if face != found.face {
            put_down(found);
            found = Found(face, 0u, array<f32, 5>());
        }
        let v = light_views[face];
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

// x: 1: each face is narrowed to its view samples.
var<uniform> cropping: vec4u;
var<storage, read_write> fitted: array<LightView, most_layers>;
// As map/faces.wgsl writes them: draws of all casters into the faces in use. What they met in the warped map is told later.
var<storage, read_write> told_draws: array<u32>;

fn begin_draws(face: u32, used: bool) {
    for (var masked = 0u; masked < 2u; masked++) {
        let triangles = select(faces.opaque, faces.triangles - faces.opaque, masked == 1u);
        let first = select(0u, faces.opaque, masked == 1u);
        let draw = (2u * face + masked) * 5u;
        told_draws[draw] = 3u * triangles;
        told_draws[draw + 1u] = u32(used);
        told_draws[draw + 2u] = 3u * first;
        let pulled = 10u * most_layers + (2u * face + masked) * 4u;
        told_draws[pulled] = faces.vertices * triangles;
        told_draws[pulled + 1u] = u32(used);
        told_draws[pulled + 2u] = faces.vertices * first;
    }
}

// One thread a face.
@compute @workgroup_size(8)
fn fit_faces(@builtin(global_invocation_id) id: vec3u) {
    let i = id.x;
    var v = light_views[i];
    v.layer = i;
    v.idle = u32(i >= faces.count || atomicLoad(&samples[i]) == 0u);
    if v.idle == 0u && cropping.x != 0u {
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
    }
    fitted[i] = v;
    begin_draws(i, v.idle == 0u);
}
