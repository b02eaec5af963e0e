// Nearest and farthest stored depth of 2 × 2 texels of a map, and the largest jump from one of them to its next, to the right or
// below; of 4 × 4 in the next level, and so on. Beyond the map depths are 0.

var pyramid: texture_2d<f32>;

// Those of the texels of a window, and of some around it.
fn extremes(low: vec2i, high: vec2i) -> vec3f {
    let span = u32(max(max(high.x - low.x, high.y - low.y), 4));
    let level = firstLeadingBit(span) - 2u;
    let first = vec2u(low) >> vec2u(level + 1u);
    let last = vec2u(high) >> vec2u(level + 1u);
    var found = vec3f(0.0, 1.0, 0.0);
    for (var y = first.y; y <= last.y; y++) {
        for (var x = first.x; x <= last.x; x++) {
            found = wider(found, textureLoad(pyramid, vec2u(x, y), level).xyz);
        }
    }
    return found;
}

fn wider(a: vec3f, b: vec3f) -> vec3f {
    return vec3f(max(a.x, b.x), min(a.y, b.y), max(a.z, b.z));
}

// Of the whole map the nearest.
fn nearest_of_all() -> f32 {
    return textureLoad(pyramid, vec2u(0u), textureNumLevels(pyramid) - 1u).x;
}

// What it is made of: the map, or the level before.
var shadow_map: texture_depth_2d;
var finer: texture_2d<f32>;
var pyramid_out: texture_storage_2d<rgba32float, write>;

// The finest level, from a map whose sides the pyramid's may exceed.
@compute @workgroup_size(8, 8)
fn begin_pyramid(@builtin(global_invocation_id) id: vec3u) {
    let side = textureDimensions(shadow_map);
    var depths: array<f32, 9>;
    for (var i = 0u; i < 9u; i++) {
        let texel = 2u * id.xy + vec2u(i % 3u, i / 3u);
        depths[i] = select(0.0, textureLoad(shadow_map, min(texel, side - 1u), 0), all(texel < side));
    }
    var found = vec3f(0.0, 1.0, 0.0);
    for (var i = 0u; i < 4u; i++) {
        let k = 3u * (i >> 1u) + (i & 1u);
        let d = depths[k];
        found = wider(found, vec3f(d, d, max(abs(depths[k + 1u] - d), abs(depths[k + 3u] - d))));
    }
    textureStore(pyramid_out, id.xy, vec4f(found, 0.0));
}

@compute @workgroup_size(8, 8)
fn build_pyramid(@builtin(global_invocation_id) id: vec3u) {
    var found = vec3f(0.0, 1.0, 0.0);
    for (var i = 0u; i < 4u; i++) {
        found = wider(found, textureLoad(finer, 2u * id.xy + vec2u(i & 1u, i >> 1u), 0).xyz);
    }
    textureStore(pyramid_out, id.xy, vec4f(found, 0.0));
}
