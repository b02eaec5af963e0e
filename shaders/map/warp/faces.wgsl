//!include lib/frame.wgsl
//!include lib/gbuffer.wgsl
//!include map/faces_of.wgsl
//!include map/light_view.wgsl
//!include map/warp/extents.wgsl
// The faces around a light that are warped: which of them some pixel looks up, and where in each. Nothing of it is read back.

fn layer_of(position: vec3f) -> u32 {
    return face_of(position - frame.light_position);
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
    v.idle = u32(i >= faces.count || !has_samples(i));
    if v.idle == 0u && cropping.x != 0u {
        v = narrowed_to_samples(v, i);
    }
    fitted[i] = v;
    begin_draws(i, v.idle == 0u);
}
