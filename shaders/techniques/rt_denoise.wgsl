//!include lib/frame.wgsl
//!include lib/gbuffer.wgsl
//!include lib/light_ray.wgsl
//!include lib/labels.wgsl
//!include map/past.wgsl
//!include constants.wgsl
// A few rays a pixel, averaged over frames and neighbours. Each frame runs `send`, `classify`, `temporal` in the tiles that are
// neither all lit nor all dark, `settle`, and `a_trous` several times in those tiles.

var<uniform> params: RtDenoiseParams;
var<uniform> past: Past;
var<storage, read_write> past_out: Past;
var blue_noise: texture_2d<f32>;

// The share of this frame's rays that were not blocked; -1: the pixel cannot be shadowed and sent none.
var raw: texture_2d<f32>;
var raw_out: texture_storage_2d<r32float, write>;

// Of tiles of 8 × 8 pixels: whether some of its rays were not blocked (1), and whether some were (2). And what they come to with
// all tiles that a filter reaches: all lit, all dark, or mixed; 0 for one that sent no rays.
var<storage, read_write> tile_light_out: array<u32>;
var<storage> tile_light: array<u32>;
var<storage, read_write> tile_classes_out: array<u32>;
var<storage> tile_classes: array<u32>;
const some_lit = 1u;
const some_dark = 2u;
const mixed = 3u;

// The mixed tiles, in any order, x and y in 16 bits each, behind their count; and the workgroups that cover them.
struct Mixed {
    count: atomic<u32>,
    tiles: array<u32>,
}
var<storage, read_write> mixed_out: Mixed;
var<storage> mixed_tiles: array<u32>;
var<storage, read_write> dispatch: array<atomic<u32>, 3>;
// Workgroups of a row of that dispatch.
const groups_in_row = 1024u;

// Visibility (-1: none), and in 16 bits each its standard deviation, and how far the history was moved, of which the uppermost
// bit says that there was none.
var estimate: texture_2d<u32>;
var estimate_out: texture_storage_2d<rg32uint, write>;
// What the next frame takes for this one's.
var kept: texture_2d<u32>;
var kept_out: texture_storage_2d<rg32uint, write>;
var spare_out: texture_storage_2d<rg32uint, write>;
// `ffx`: the mean of the rays so far, the sum of their squared distances from it (Welford 1962); `svgf`: the means of the rays and
// of their squares. Then of how many frames, and the depth along the camera's axis.
var moments: texture_2d<f32>;
var moments_out: texture_storage_2d<rgba32float, write>;

var visibility_out: texture_storage_2d<r32float, write>;
var map_out: texture_storage_2d<r32float, write>;

fn tile_count() -> vec2u {
    return (frame.size + 7u) / 8u;
}

fn tile_number(tile: vec2u) -> u32 {
    return tile.y * tile_count().x + tile.x;
}

// A pixel's place in the square, which its rays' places start from: that of another pixel for another seed.
fn noise(picture_pixel: vec2u) -> vec2f {
    let shift = vec2u(hash(frame.seed), hash(frame.seed ^ 0x9e3779b9u)) % 1024u;
    let pixel = picture_pixel + select(shift, vec2u(0u), frame.seed == 0u);
    if params.sequence == sequence_blue {
        let side = textureDimensions(blue_noise);
        return vec2f(textureLoad(blue_noise, pixel % side, 0).x,
                     textureLoad(blue_noise, (pixel + vec2u(37u, 17u)) % side, 0).x);
    }
    // Jimenez 2014.
    let p = vec2f(pixel);
    let q = p.yx + 37.0;
    return fract(52.9829189 * fract(vec2f(0.06711056 * p.x + 0.00583715 * p.y, 0.06711056 * q.x + 0.00583715 * q.y)));
}

// Where on the light the ray `i` of all that a pixel has sent ends.
fn ray_place(pixel: vec2u, i: u32) -> vec2f {
    if !has_size() {
        return vec2f(0.0);
    }
    var square = vec2f(0.0);
    switch params.sequence {
        case sequence_white: {
            square = place_of_hash(hash(pixel.x ^ hash(pixel.y ^ hash(i ^ hash(frame.seed)))));
        }
        case sequence_r2: {
            square = scattered_by_seed(pixel, i);
        }
        default: {
            square = fract(noise(pixel) + r2_point(i));
        }
    }
    return on_light(square);
}

var<workgroup> in_tile: atomic<u32>;

@compute @workgroup_size(8, 8)
fn send(@builtin(global_invocation_id) id: vec3u, @builtin(workgroup_id) tile: vec3u, @builtin(local_invocation_index) thread: u32) {
    if all(id.xy < frame.size) {
        let s = load_surface(id.xy);
        let light = light_at(s.position);
        var seen = -1.0;
        if may_be_shadowed(s, light) {
            let rays = select(1u, params.rays, has_size());
            seen = 0.0;
            for (var i = 0u; i < rays; i++) {
                seen += select(0.0, 1.0, sees(s, light, ray_place(id.xy, past.frames * rays + i)));
            }
            atomicOr(&in_tile, select(0u, some_lit, seen > 0.0) | select(0u, some_dark, seen < f32(rays)));
            seen /= f32(rays);
        }
        textureStore(raw_out, id.xy, vec4f(seen));
    }
    workgroupBarrier();
    if thread == 0u {
        tile_light_out[tile_number(tile.xy)] = atomicLoad(&in_tile);
    }
}

// Tiles around one in which its pixels' rays matter: those of the local mean, and what all passes of the filter reach.
fn tiles_around() -> i32 {
    let reach = (1u << params.passes) - 1u;
    return i32((max(reach, 8u) + 7u) / 8u);
}

@compute @workgroup_size(8, 8)
fn classify(@builtin(global_invocation_id) id: vec3u, @builtin(workgroup_id) tile: vec3u, @builtin(local_invocation_index) thread: u32) {
    let own = tile_light[tile_number(tile.xy)];
    let around = tiles_around();
    let side = u32(2 * around + 1);
    for (var i = thread; i < side * side; i += 64u) {
        let other = vec2i(tile.xy) - around + vec2i(vec2u(i % side, i / side));
        if all(other >= vec2i(0)) && all(other < vec2i(tile_count())) {
            atomicOr(&in_tile, tile_light[tile_number(vec2u(other))]);
        }
    }
    workgroupBarrier();
    // The others filter every tile.
    let found = select(mixed, atomicLoad(&in_tile), params.denoiser == denoiser_ffx);
    let kind = select(found, 0u, own == 0u);
    if thread == 0u {
        tile_classes_out[tile_number(tile.xy)] = kind;
        if kind == mixed {
            let at = atomicAdd(&mixed_out.count, 1u);
            mixed_out.tiles[at] = tile.x | (tile.y << 16u);
            atomicMax(&dispatch[0], min(at + 1u, groups_in_row));
            atomicMax(&dispatch[1], at / groups_in_row + 1u);
            atomicMax(&dispatch[2], 1u);
        }
    }
    if kind != mixed && all(id.xy < frame.size) {
        let depth = textureLoad(g_position, id.xy, 0).w;
        textureStore(moments_out, id.xy, vec4f(max(textureLoad(raw, id.xy, 0).x, 0.0), 0.0, 0.0, depth));
    }
}

const most_deviation = 4.0;

fn packed(visibility: f32, variance: f32, moved: f32) -> vec4u {
    return vec4u(bitcast<u32>(visibility), pack2x16unorm(vec2f(sqrt(variance) / most_deviation, 0.49999 * moved)), 0u, 0u);
}

fn variance_of(words: vec4u) -> f32 {
    let deviation = most_deviation * unpack2x16unorm(words.y).x;
    return deviation * deviation;
}

fn moved_of(words: vec4u) -> f32 {
    return unpack2x16unorm(words.y & 0x7fffffffu).y / 0.49999;
}

struct Earlier {
    // False: the surface was not seen, or sent no rays.
    found: bool,
    visibility: f32,
    moments: vec3f,
}

// What the last frame kept where it saw this surface: of its four pixels around the place, those that show it.
fn earlier(s: Surface) -> Earlier {
    let before = place_before(past, s.position);
    if params.history == 0u || before.z <= 0.0 {
        return Earlier(false, 0.0, vec3f(0.0));
    }
    let facing = clamp(seen_before(past, s), 0.02, 1.0);
    // Depth may differ by a hundredth, of a surface seen edge on by a tenth, and by as much as it changes on the way to the pixel.
    let off = distance_at(before.z) * mix(0.01, 0.1, pow(1.0 - facing, 8.0));
    let slope = pixel_at(before.z) * sqrt(1.0 - facing * facing) / facing;
    var sum = vec4f(0.0);
    var weights = 0.0;
    for (var i = 0u; i < 4u; i++) {
        let pixel = floor(before.xy) + vec2f(vec2u(i & 1u, i >> 1u));
        let apart = abs(before.xy - pixel);
        let weight = (1.0 - apart.x) * (1.0 - apart.y);
        if weight > 0.0 && all(pixel >= vec2f(0.0)) && all(pixel < vec2f(frame.size)) {
            let visibility = bitcast<f32>(textureLoad(kept, vec2u(pixel), 0).x);
            let held = textureLoad(moments, vec2u(pixel), 0);
            if visibility >= 0.0 && abs(held.w - before.z) < off + slope * length(apart) {
                sum += weight * vec4f(held.xyz, visibility);
                weights += weight;
            }
        }
    }
    if weights < 1e-3 {
        return Earlier(false, 0.0, vec3f(0.0));
    }
    return Earlier(true, sum.w / weights, sum.xyz / weights);
}

// The tile that a workgroup of the mixed ones' dispatch works on; beyond the last one there is none.
fn mixed_tile(group: vec3u) -> vec2u {
    let word = mixed_tiles[1u + group.y * groups_in_row + group.x];
    return vec2u(word & 0xffffu, word >> 16u);
}

// A tile's rays with those of 8 pixels around it, and of its columns the weighted sums along rows: rays, their squares, weights.
var<workgroup> rays_around: array<f32, 576>;
var<workgroup> row_sums: array<vec3f, 192>;

fn falloff(away: u32) -> f32 {
    let d = f32(away) - 8.0;
    return exp(-3.0 * d * d / 81.0);
}

@compute @workgroup_size(8, 8)
fn temporal(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_id) local: vec3u, @builtin(local_invocation_index) thread: u32) {
    if group.y * groups_in_row + group.x >= mixed_tiles[0] {
        return;
    }
    let tile = mixed_tile(group);
    for (var i = thread; i < 576u; i += 64u) {
        let at = vec2i(8u * tile + vec2u(i % 24u, i / 24u)) - 8;
        let inside = all(at >= vec2i(0)) && all(at < vec2i(frame.size));
        rays_around[i] = select(-1.0, textureLoad(raw, vec2u(max(at, vec2i(0))), 0).x, inside);
    }
    workgroupBarrier();
    for (var i = thread; i < 192u; i += 64u) {
        var sum = vec3f(0.0);
        for (var k = 0u; k < 17u; k++) {
            let s = rays_around[(i / 8u) * 24u + i % 8u + k];
            sum += select(vec3f(0.0), falloff(k) * vec3f(s, s * s, 1.0), s >= 0.0);
        }
        row_sums[i] = sum;
    }
    workgroupBarrier();
    let pixel = 8u * tile + local.xy;
    if any(pixel >= frame.size) {
        return;
    }
    let seen = rays_around[(local.y + 8u) * 24u + local.x + 8u];
    let s = load_surface(pixel);
    if seen < 0.0 {
        textureStore(estimate_out, pixel, packed(-1.0, 0.0, 0.0));
        textureStore(moments_out, pixel, vec4f(0.0, 0.0, 0.0, s.depth));
        return;
    }
    var sum = vec3f(0.0);
    for (var k = 0u; k < 17u; k++) {
        sum += falloff(k) * row_sums[(local.y + k) * 8u + local.x];
    }
    let mean = sum.x / sum.z;
    let spread = max(sum.y / sum.z - mean * mean, 0.0);

    let before = earlier(s);
    var m = before.moments;
    var visibility = seen;
    var variance = 0.0;
    var moved = 0.0;
    if params.denoiser == denoiser_ffx {
        m.z += 1.0;
        let last = m.x;
        m.x += (seen - last) / m.z;
        m.y += (seen - last) * (seen - m.x);
        variance = select(min(m.y / (m.z - 1.0), 1.0), 1.0, m.z <= 1.0);
        if before.found {
            let half = params.clamp_k * sqrt(spread);
            let history = clamp(before.visibility, mean - half, mean + half);
            moved = abs(history - before.visibility);
            // History that the neighbourhood contradicts counts for fewer frames.
            let d = (before.visibility - mean) / max(half, 0.001);
            let trust = exp(-d * d / 20.0);
            m.z *= trust;
            let newest = mix(params.min_blend, 1.0, sqrt(max(8.0 - m.z, 0.0) / 8.0));
            visibility = history + newest * (seen - history);
        }
        if m.z < 16.0 {
            variance = max(variance, spread) * max(16.0 - m.z, 1.0);
        }
    } else {
        let frames = m.z + 1.0;
        let newest = max(params.min_blend, 1.0 / frames);
        visibility = before.visibility + newest * (seen - before.visibility);
        m = vec3f(m.xy + newest * (vec2f(seen, seen * seen) - m.xy), frames);
        variance = max(m.y - m.x * m.x, 0.0);
        if frames < 4.0 {
            variance = max(variance, spread) * 4.0 / frames;
        }
    }
    textureStore(moments_out, pixel, vec4f(m, s.depth));
    let words = packed(visibility, variance, moved) | vec4u(0u, select(0x80000000u, 0u, before.found), 0u, 0u);
    textureStore(estimate_out, pixel, words);
}

fn told(seen: f32, valid: bool) -> vec4f {
    // Turned away, out of reach: dark. Nothing there: lit.
    return vec4f(select(select(1.0, 0.0, valid), saturate(seen), seen >= 0.0));
}

// The other tiles are what their rays say. The camera is kept for the next frame.
@compute @workgroup_size(8, 8)
fn settle(@builtin(global_invocation_id) id: vec3u, @builtin(workgroup_id) tile: vec3u) {
    if all(id.xy == vec2u(0u)) {
        past_out = now_past(past_out.frames + 1u);
    }
    if any(id.xy >= frame.size) || tile_classes[tile_number(tile.xy)] == mixed {
        return;
    }
    let seen = textureLoad(raw, id.xy, 0).x;
    textureStore(estimate_out, id.xy, packed(seen, 0.0, 0.0));
    textureStore(kept_out, id.xy, packed(seen, 0.0, 0.0));
    textureStore(spare_out, id.xy, packed(seen, 0.0, 0.0));
    textureStore(visibility_out, id.xy, told(seen, textureLoad(g_position, id.xy, 0).w > 0.0));
}

// Pixels from one tap to the next; 0: the pass filters nothing.
struct Spacing {
    step: u32,
}
var<uniform> spacing: Spacing;

// Visibility and variance of a pixel; visibility -1 beyond the picture.
fn estimate_at(pixel: vec2i) -> vec2f {
    if any(pixel < vec2i(0)) || any(pixel >= vec2i(frame.size)) {
        return vec2f(-1.0, 0.0);
    }
    let words = textureLoad(estimate, pixel, 0);
    return vec2f(bitcast<f32>(words.x), variance_of(words));
}

// The variance, blurred a little.
fn blurred_variance(pixel: vec2i) -> f32 {
    var sum = vec2f(0.0);
    for (var i = 0u; i < 9u; i++) {
        let by = vec2i(vec2u(i % 3u, i / 3u)) - 1;
        let e = estimate_at(pixel + by);
        sum += select(vec2f(0.0), exp2(-f32(abs(by.x) + abs(by.y))) * vec2f(e.y, 1.0), e.x >= 0.0);
    }
    return sum.x / sum.y;
}

@compute @workgroup_size(8, 8)
fn a_trous(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_id) local: vec3u) {
    if group.y * groups_in_row + group.x >= mixed_tiles[0] {
        return;
    }
    let pixel = 8u * mixed_tile(group) + local.xy;
    if any(pixel >= frame.size) {
        return;
    }
    let here = estimate_at(vec2i(pixel));
    let s = load_surface(pixel);
    if here.x < 0.0 || spacing.step == 0u {
        textureStore(estimate_out, pixel, packed(here.x, here.y, 0.0));
        textureStore(visibility_out, pixel, told(here.x, s.valid));
        return;
    }
    let ffx = params.denoiser == denoiser_ffx;
    let deviation = sqrt(blurred_variance(vec2i(pixel)));
    // Dammertz et al. 2010: the taps of a small kernel, wider apart from pass to pass.
    let radius = select(2, 1, ffx);
    let kernel = select(vec3f(0.375, 0.25, 0.0625), vec3f(1.0, 2.0 / 3.0, 1.0 / 6.0), ffx);
    let off_light = max(select(4.0, 1.0, ffx) * deviation, 1e-6);
    let sharpness = select(128.0, 32.0, ffx);
    // How depth along the camera's axis changes on the surface's plane from pixel to pixel.
    let ray = pixel_ray(vec2f(pixel) + 0.5);
    let facing = dot(s.normal, ray);
    let slope = -scale_at(s.depth) * vec2f(dot(s.normal, frame.rays[0]), dot(s.normal, frame.rays[1])) / select(facing, -1e-4, abs(facing) < 1e-4);
    var sum = vec2f(0.0);
    var weights = 0.0;
    for (var y = -radius; y <= radius; y++) {
        for (var x = -radius; x <= radius; x++) {
            let by = i32(spacing.step) * vec2i(x, y);
            let e = estimate_at(vec2i(pixel) + by);
            if e.x >= 0.0 {
                let at = vec2u(vec2i(pixel) + by);
                let depth = textureLoad(g_position, at, 0).w;
                let normal = g_normal(textureLoad(g_surface, at, 0));
                let off_depth = select(abs(dot(slope, vec2f(by))) + 1e-3 * distance_at(s.depth), params.sigma_z * distance_at(s.depth), ffx);
                let weight = kernel[abs(x)] * kernel[abs(y)] * pow(saturate(dot(s.normal, normal)), sharpness)
                    * exp(-abs(here.x - e.x) / off_light - abs(s.depth - depth) / off_depth);
                // A pixel is always its own neighbour.
                let own = select(weight, kernel.x * kernel.x, x == 0 && y == 0);
                sum += own * vec2f(e.x, own * e.y);
                weights += own;
            }
        }
    }
    let smoothed = sum / vec2f(weights, weights * weights);
    textureStore(estimate_out, pixel, packed(smoothed.x, smoothed.y, 0.0));
    textureStore(visibility_out, pixel, told(smoothed.x, s.valid));
}

@compute @workgroup_size(8, 8)
fn inspect(@builtin(global_invocation_id) id: vec3u, @builtin(workgroup_id) tile: vec3u) {
    if any(id.xy >= frame.size) {
        return;
    }
    let seen = textureLoad(raw, id.xy, 0).x;
    let kind = tile_classes[tile_number(tile.xy)];
    let words = textureLoad(estimate, id.xy, 0);
    var value = 0.0;
    switch frame.map {
        case shows_history_length: {
            value = textureLoad(moments, id.xy, 0).z;
        }
        case shows_light_variance: {
            value = variance_of(words);
        }
        case shows_clamp_distance: {
            value = moved_of(words);
        }
        case shows_disocclusion: {
            let anew = words.y >> 31u == 1u;
            value = select(label(7u, 0.7), select(label(2u, 0.5), label(0u, 0.9), anew), kind == mixed);
        }
        case shows_tile_classes: {
            value = select(select(label(4u, 0.6), label(1u, 0.6), kind == some_lit), label(2u, 0.6), kind == mixed);
        }
        default: {
            value = seen;
        }
    }
    textureStore(map_out, id.xy, vec4f(select(-1.0, value, seen >= 0.0)));
}
