//!include lib/scene.wgsl
//!include lib/light_view.wgsl
// Casters into a shadow map.

struct Caster {
    @builtin(position) clip: vec4f,
    @location(0) uv: vec2f,
    @location(1) @interpolate(flat) material: u32,
}

fn caster_of(index: u32) -> Caster {
    let v = vertices[index];
    return Caster(light_clip(light_view, v.position), v.uv, v.material);
}

@vertex
fn caster(@builtin(vertex_index) index: u32) -> Caster {
    return caster_of(index);
}

@vertex
fn clamped_caster(@builtin(vertex_index) index: u32) -> Caster {
    var out = caster_of(index);
    // A corner behind a lamp is cut off anyway; clamped, it would take the part before the lamp beyond the far plane.
    if out.clip.w > 0.0 {
        out.clip.z = min(out.clip.z, out.clip.w);
    }
    return out;
}

// A warped view: depth is linear, so it is no affine function of the place in the map, and each fragment writes its own.
struct WarpedCaster {
    @builtin(position) clip: vec4f,
    @location(0) uv: vec2f,
    @location(1) @interpolate(flat) material: u32,
    // Stored depth; linear in space, so that interpolation with perspective is exact.
    @location(2) depth: f32,
}

@vertex
fn warped_caster(@builtin(vertex_index) index: u32) -> WarpedCaster {
    let v = vertices[index];
    var clip = light_clip(light_view, v.position);
    // Never cut off by the near or far plane.
    clip.z = 0.5 * clip.w;
    return WarpedCaster(clip, v.uv, v.material, stored_depth(light_view, dot(light_view.axis, vec4f(v.position, 1.0))));
}

@fragment
fn warped(in: WarpedCaster) -> @builtin(frag_depth) f32 {
    return saturate(in.depth);
}

@fragment
fn warped_masked(in: WarpedCaster) -> @builtin(frag_depth) f32 {
    if masked_out(materials[in.material], in.uv) {
        discard;
    }
    return saturate(in.depth);
}

@fragment
fn masked(in: Caster) {
    if masked_out(materials[in.material], in.uv) {
        discard;
    }
}
