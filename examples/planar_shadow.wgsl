//!include lib/gbuffer.wgsl
//!include lib/labels.wgsl
// Shadows projected on a plane of one height (Blinn 1988): each triangle is drawn where its shadow on the plane is seen.

var<uniform> params: PlanarParams;
// Its height in scene space.
var<uniform> plane: vec4f;
var shadow: texture_2d<f32>;
var visibility_out: texture_storage_2d<r32float, write>;
var map_out: texture_storage_2d<r32float, write>;

struct Squashed {
    @builtin(position) clip: vec4f,
    // How far the caster rises above the plane.
    @location(0) rise: f32,
    // Positive where the light is above the caster, so that the shadow falls on the plane.
    @location(1) below_light: f32,
    // Texture coordinates, and what the vertex's colour takes off alpha.
    @location(2) place: vec3f,
    @location(3) @interpolate(flat) material: u32,
}

@vertex
fn squash(@builtin(vertex_index) index: u32) -> Squashed {
    let vertex = triangle_at(index / 3u)[index % 3u];
    let p = vertex_position(vertex);
    let rise = p.y - plane.x;
    // From the light through p on to the plane, as a homogeneous point (xyz, w): linear in p, so that what is between the
    // corners comes out right too.
    var w: f32;
    var onto: vec3f;
    if frame.light_kind == directional {
        w = frame.light_position.y;
        onto = (p - frame.eye) * w - frame.light_position * rise;
    } else {
        w = frame.light_position.y - p.y;
        let height = frame.light_position.y - plane.x;
        onto = (frame.light_position - frame.eye) * w + (p - frame.light_position) * height;
    }
    var out: Squashed;
    out.clip = frame.eye_proj * vec4f(onto, w);
    out.rise = rise;
    out.below_light = w;
    out.place = texture_place(vertex);
    out.material = vertex_at(vertex).material;
    return out;
}

// Whether a surface is part of the plane.
fn on_plane(s: Surface) -> bool {
    return s.valid && abs(s.position.y - plane.x) <= params.tolerance && s.normal.y > 0.99;
}

@fragment
fn cast_shadow(in: Squashed) -> @location(0) f32 {
    if params.casts == casts_above && in.rise <= params.tolerance {
        discard;
    }
    if in.below_light <= 0.0 || masked_out(materials[in.material], in.place) {
        discard;
    }
    return 1.0;
}

@compute @workgroup_size(8, 8)
fn resolve(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) {
        return;
    }
    let s = load_surface(id.xy);
    let lit = !on_plane(s) || textureLoad(shadow, id.xy, 0).x == 0.0;
    textureStore(visibility_out, id.xy, vec4f(select(0.0, 1.0, lit && s.valid && faces_light(s))));
}

@compute @workgroup_size(8, 8)
fn inspect(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) {
        return;
    }
    let s = load_surface(id.xy);
    textureStore(map_out, id.xy, vec4f(label(select(7u, 2u, on_plane(s)), select(0.0, 0.8, s.valid))));
}
