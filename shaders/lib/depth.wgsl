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
    out.clip.z = min(out.clip.z, out.clip.w);
    return out;
}

@fragment
fn masked(in: Caster) {
    if masked_out(materials[in.material], in.uv) {
        discard;
    }
}
