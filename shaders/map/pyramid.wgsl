// Nearest and farthest stored depth of 2 × 2 texels of a map, of 4 × 4 in the next level, and so on. Beyond the map both are 0.

var pyramid: texture_2d<f32>;

// Those of the texels of a window, and of some around it.
fn extremes(low: vec2i, high: vec2i) -> vec2f {
    let span = u32(max(max(high.x - low.x, high.y - low.y), 4));
    let level = firstLeadingBit(span) - 2u;
    let first = vec2u(low) >> vec2u(level + 1u);
    let last = vec2u(high) >> vec2u(level + 1u);
    var found = vec2f(0.0, 1.0);
    for (var y = first.y; y <= last.y; y++) {
        for (var x = first.x; x <= last.x; x++) {
            let both = textureLoad(pyramid, vec2u(x, y), level).xy;
            found = vec2f(max(found.x, both.x), min(found.y, both.y));
        }
    }
    return found;
}

// Of the whole map the nearest.
fn nearest_of_all() -> f32 {
    return textureLoad(pyramid, vec2u(0u), textureNumLevels(pyramid) - 1u).x;
}

// What it is made of: the map, or the level before.
var shadow_map: texture_depth_2d;
var finer: texture_2d<f32>;
var pyramid_out: texture_storage_2d<rg32float, write>;

// The finest level, from a map whose sides the pyramid's may exceed.
@compute @workgroup_size(8, 8)
fn begin_pyramid(@builtin(global_invocation_id) id: vec3u) {
    let side = textureDimensions(shadow_map);
    var both = vec2f(0.0, 1.0);
    for (var i = 0u; i < 4u; i++) {
        let texel = 2u * id.xy + vec2u(i & 1u, i >> 1u);
        let depth = select(0.0, textureLoad(shadow_map, min(texel, side - 1u), 0), all(texel < side));
        both = vec2f(max(both.x, depth), min(both.y, depth));
    }
    textureStore(pyramid_out, id.xy, vec4f(both, 0.0, 0.0));
}

@compute @workgroup_size(8, 8)
fn build_pyramid(@builtin(global_invocation_id) id: vec3u) {
    var both = vec2f(0.0, 1.0);
    for (var i = 0u; i < 4u; i++) {
        let four = textureLoad(finer, 2u * id.xy + vec2u(i & 1u, i >> 1u), 0).xy;
        both = vec2f(max(both.x, four.x), min(both.y, four.y));
    }
    textureStore(pyramid_out, id.xy, vec4f(both, 0.0, 0.0));
}
