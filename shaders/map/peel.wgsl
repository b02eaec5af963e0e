//!include map/casters.wgsl
// Depth made of the two surfaces nearest to the light: the nearest has been drawn, and casters are drawn once more without
// what lies on it or before it. Every combination grows with the second depth, so that the depth test keeps that of the nearest
// of the others.

var<uniform> stored_as: StoredParams;
var<uniform> casters: CasterParams;
// What was drawn first.
var nearest_depth: texture_depth_2d;

// Whether a depth is the nearest surface's, or before it: as near as rounding, or surfaces that touch, may bring the next one.
fn on_first(first: f32, depth: f32) -> bool {
    let steps = select(select(4294967296.0, 16777216.0, casters.format == format_24), 65536.0, casters.format == format_16);
    let apart = linear_depth(light_view, depth) - linear_depth(light_view, first);
    return depth >= first - 1.0 / steps || apart < 1e-5 * (light_view.far - light_view.near);
}

// What a texel holds whose first and second depths are these.
fn combined(first: f32, second: f32) -> f32 {
    if stored_as.stored == stored_second {
        return second;
    }
    let a = linear_depth(light_view, first);
    let b = linear_depth(light_view, second);
    var to = 0.5 * (a + b);
    if stored_as.stored == stored_dual {
        to = min(to, a + stored_as.dual_limit);
    }
    return saturate(stored_depth(light_view, to));
}

fn first_at(clip: vec4f) -> f32 {
    return textureLoad(nearest_depth, vec2u(clip.xy), 0);
}

// Discards what lies on the nearest surface or before it.
fn peeled(clip: vec4f, depth: f32) -> f32 {
    let first = first_at(clip);
    if on_first(first, depth) {
        discard;
    }
    return combined(first, depth);
}

// Texels with a single surface: the next one is as far as can be.
@vertex
fn whole_layer(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    return vec4f(f32(index & 1u) * 4.0 - 1.0, f32(index >> 1u) * 4.0 - 1.0, 0.5, 1.0);
}

@fragment
fn single_surface(@builtin(position) clip: vec4f) -> @builtin(frag_depth) f32 {
    let first = first_at(clip);
    if first <= 0.0 {
        discard;
    }
    return combined(first, 0.0);
}

@fragment
fn peel(@builtin(position) clip: vec4f) -> @builtin(frag_depth) f32 {
    return peeled(clip, clip.z);
}

@fragment
fn peel_part(@builtin(position) clip: vec4f) -> @builtin(frag_depth) f32 {
    if outside_part(clip) {
        discard;
    }
    return peeled(clip, clip.z);
}

@fragment
fn peel_part_masked(in: Caster) -> @builtin(frag_depth) f32 {
    if outside_part(in.clip) || masked_out(materials[in.material], in.uv) {
        discard;
    }
    return peeled(in.clip, in.clip.z);
}

@fragment
fn peel_masked(in: Caster) -> @builtin(frag_depth) f32 {
    if masked_out(materials[in.material], in.uv) {
        discard;
    }
    return peeled(in.clip, in.clip.z);
}

@fragment
fn peel_warped(in: WarpedCaster) -> @builtin(frag_depth) f32 {
    return peeled(in.clip, saturate(in.depth));
}

@fragment
fn peel_warped_masked(in: WarpedCaster) -> @builtin(frag_depth) f32 {
    if masked_out(materials[in.material], in.uv) {
        discard;
    }
    return peeled(in.clip, saturate(in.depth));
}
