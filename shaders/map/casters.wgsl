//!include lib/scene.wgsl
//!include map/light_view.wgsl
// Casters into a shadow map.

// A corner, as `Vertex::LAYOUT` in Rust gives it.
struct Corner {
    @location(0) position: vec3f,
    @location(1) uv: vec2f,
    @location(2) material: u32,
    @location(3) taken_off: vec4f,
}

// As `texture_place` has it.
fn corner_place(v: Corner) -> vec3f {
    return vec3f(v.uv, v.taken_off.a);
}

struct Caster {
    @builtin(position) clip: vec4f,
    @location(0) uv: vec3f,
    @location(1) @interpolate(flat) material: u32,
}

// Moved on to the near plane, if it is nearer.
fn clamped(clip: vec4f) -> vec4f {
    // A corner behind a spot light is cut off anyway; clamped, it would take the part before the light beyond the far plane.
    return vec4f(clip.xy, select(clip.z, min(clip.z, clip.w), clip.w > 0.0), clip.w);
}

// Opaque casters need their places only.
@vertex
fn caster(@location(0) position: vec3f) -> @builtin(position) vec4f {
    return light_clip(light_view, position);
}

@vertex
fn clamped_caster(@location(0) position: vec3f) -> @builtin(position) vec4f {
    return clamped(light_clip(light_view, position));
}

@vertex
fn masked_caster(v: Corner) -> Caster {
    return Caster(light_clip(light_view, v.position), corner_place(v), v.material);
}

@vertex
fn clamped_masked_caster(v: Corner) -> Caster {
    return Caster(clamped(light_clip(light_view, v.position)), corner_place(v), v.material);
}

// The part of a map that a view draws into where several share it: half planes whose products with a place (texels, 1) are not
// negative.
var<uniform> region: array<vec4f, 2>;

fn outside_part(clip: vec4f) -> bool {
    let at = vec3f(clip.xy, 1.0);
    return dot(region[0].xyz, at) < 0.0 || dot(region[1].xyz, at) < 0.0;
}

@fragment
fn part(@builtin(position) clip: vec4f) {
    if outside_part(clip) {
        discard;
    }
}

@fragment
fn part_masked(in: Caster) {
    if outside_part(in.clip) || masked_out(materials[in.material], in.uv) {
        discard;
    }
}

// A warped view: depth is linear, so it is no affine function of the place in the map, and each fragment writes its own.
struct WarpedCaster {
    @builtin(position) clip: vec4f,
    @location(0) uv: vec3f,
    @location(1) @interpolate(flat) material: u32,
    // Stored depth; linear in space, so that interpolation with perspective is exact.
    @location(2) depth: f32,
}

@vertex
fn warped_caster(v: Corner) -> WarpedCaster {
    var clip = light_clip(light_view, v.position);
    // Never cut off by the near or far plane.
    clip.z = 0.5 * clip.w;
    return WarpedCaster(clip, corner_place(v), v.material, stored_depth(light_view, dot(light_view.axis, vec4f(v.position, 1.0))));
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
