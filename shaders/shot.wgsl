// What a pass wrote, small: values between their extremes, as a picture; layers beside each other.

struct Shot {
    // Pixels of the picture, and of a layer of what it shows.
    size: vec2u,
    whole: vec2u,
    // 1: one value, grey. 3: colours, or three values of their own.
    channels: u32,
    // 1: values are stretched to their extremes; 0: they are colours already.
    stretched: u32,
    layers: u32,
    // How many layers stand in a row.
    columns: u32,
}

var source: texture_2d_array<f32>;
var<uniform> shot: Shot;
// The largest key of -x and of x, of all values x.
var<storage, read_write> extremes: array<atomic<u32>, 2>;
var shot_out: texture_storage_2d<rgba8unorm, write>;

// Whole numbers in the order of the floats; above 0.
fn key(x: f32) -> u32 {
    let bits = bitcast<u32>(x);
    return select(bits | 0x80000000u, ~bits, (bits >> 31u) == 1u);
}

fn value(key: u32) -> f32 {
    return bitcast<f32>(select(~key, key & 0x7fffffffu, key >= 0x80000000u));
}

// A workgroup takes 64 × 64 texels of a layer.
@compute @workgroup_size(8, 8)
fn find_extremes(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_id) local: vec3u) {
    var low = 0u;
    var high = 0u;
    for (var k = 0u; k < 64u; k++) {
        let texel = group.xy * 64u + vec2u(k % 8u, k / 8u) * 8u + local.xy;
        if any(texel >= shot.whole) {
            continue;
        }
        let x = textureLoad(source, texel, group.z, 0);
        for (var c = 0u; c < shot.channels; c++) {
            low = max(low, key(-x[c]));
            high = max(high, key(x[c]));
        }
    }
    if high > 0u {
        atomicMax(&extremes[0], low);
        atomicMax(&extremes[1], high);
    }
}

@compute @workgroup_size(8, 8)
fn draw_shot(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= shot.size) {
        return;
    }
    let columns = shot.columns;
    let all = shot.whole * vec2u(columns, (shot.layers + columns - 1u) / columns);
    let scale = vec2f(all) / vec2f(shot.size);
    let middle = (vec2f(id.xy) + 0.5) * scale;
    let tile = min(vec2u(middle), all - 1u) / shot.whole;
    let layer = tile.y * columns + tile.x;
    // A line of a pixel parts neighbouring layers.
    let parted = (tile.x > 0u && middle.x - f32(tile.x * shot.whole.x) < scale.x)
        || (tile.y > 0u && middle.y - f32(tile.y * shot.whole.y) < scale.y);
    if layer >= shot.layers || parted {
        textureStore(shot_out, id.xy, vec4f(vec3f(0.35), 1.0));
        return;
    }
    // The mean of up to 4 × 4 of the texels that it covers.
    let first = tile * shot.whole;
    var sum = vec3f(0.0);
    for (var i = 0u; i < 16u; i++) {
        let at = (vec2f(id.xy) + (vec2f(vec2u(i % 4u, i / 4u)) + 0.5) / 4.0) * scale;
        let texel = min(max(vec2u(at), first) - first, shot.whole - 1u);
        let x = textureLoad(source, texel, layer, 0);
        sum += select(x.xyz, x.xxx, shot.channels == 1u) / 16.0;
    }
    if shot.stretched == 1u {
        let low = -value(atomicLoad(&extremes[0]));
        let high = value(atomicLoad(&extremes[1]));
        sum = (sum - low) / max(high - low, 1e-30);
    }
    textureStore(shot_out, id.xy, vec4f(saturate(sum), 1.0));
}
