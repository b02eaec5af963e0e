//!include lib/labels.wgsl
// Maps that are filtered before they are looked up: what a filter keeps of depth (its moments) is averaged over texels, and the
// look-up takes one bilinear sample. A filter writes
//     fn moments(z: f32, slope: f32, plane: u32) -> vec4f   of a depth z from 0 (near) to 1 (far) that changes by `slope` a
//                                                           texel; the plane-th four of them
//     fn light_at_depth(s: Surface, r: Receiver, z: f32) -> f32   visibility of a receiver, if its depth were z
//     fn explaining_depths(s: Surface, r: Receiver) -> vec2f      depths that stand for all in the kernel; negative: none
// A layer of the map is as many layers here as there are planes. The store/ file gives `moments_out`.

var<uniform> prefiltering: PrefilterParams;

struct Prefiltered {
    // The layer's map: its side, texels, and how many planes it has.
    side: u32,
    planes: u32,
    // The plane at work.
    plane: u32,
    // 1: along y.
    down: u32,
}

var<uniform> prefiltered: Prefiltered;
var layer_depth: texture_depth_2d;
var unfiltered: texture_2d<f32>;
var moments_map: texture_2d_array<f32>;
var moments_sampler: sampler;

// Of the map's texel at most as far out as its border.
fn drawn_share(texel: vec2i) -> f32 {
    let at = clamp(texel, vec2i(0), vec2i(i32(prefiltered.side) - 1));
    return depth_share(light_view, textureLoad(layer_depth, at, 0));
}

// Depths next to each other belong to one surface where they change least.
fn lesser(a: f32, b: f32) -> f32 {
    return select(b, a, abs(a) < abs(b));
}

@compute @workgroup_size(8, 8)
fn make_moments(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= textureDimensions(moments_out)) {
        return;
    }
    let at = vec2i(id.xy);
    let z = drawn_share(at);
    let x = lesser(drawn_share(at + vec2i(1, 0)) - z, z - drawn_share(at - vec2i(1, 0)));
    let y = lesser(drawn_share(at + vec2i(0, 1)) - z, z - drawn_share(at - vec2i(0, 1)));
    textureStore(moments_out, id.xy, moments(z, length(vec2f(x, y)), prefiltered.plane));
}

// Half of a Gaussian whose standard deviation is half the kernel's radius, along x or y. A thread makes the four texels of a strip, whose
// kernels share most of what they read.
@compute @workgroup_size(8, 8)
fn blur_moments(@builtin(global_invocation_id) id: vec3u) {
    let along = select(vec2i(1, 0), vec2i(0, 1), prefiltered.down == 1u);
    let start = vec2i(id.xy) * (1 + 3 * along);
    let last = vec2i(textureDimensions(unfiltered)) - 1;
    if any(start > last) {
        return;
    }
    let radius = i32(prefiltering.blur_radius);
    let narrow = -2.0 / f32(radius * radius);
    var sums = mat4x4f();
    var weight = 0.0;
    for (var i = -radius; i <= radius + 3; i++) {
        // Of the texel at hand for each of the strip's.
        let w = vec4f(blur_weight(i, radius, narrow), blur_weight(i - 1, radius, narrow),
            blur_weight(i - 2, radius, narrow), blur_weight(i - 3, radius, narrow));
        weight += w.x;
        let m = textureLoad(unfiltered, clamp(start + i * along, vec2i(0), last), 0);
        sums += mat4x4f(weighted(w.x, m), weighted(w.y, m), weighted(w.z, m), weighted(w.w, m));
    }
    // Constant indices leave the sums in registers.
    store_within(start, sums[0] / weight);
    store_within(start + along, sums[1] / weight);
    store_within(start + 2 * along, sums[2] / weight);
    store_within(start + 3 * along, sums[3] / weight);
}

fn blur_weight(i: i32, radius: i32, narrow: f32) -> f32 {
    return select(0.0, exp(narrow * f32(i * i)), abs(i) <= radius);
}

fn store_within(at: vec2i, m: vec4f) {
    if all(at < vec2i(textureDimensions(moments_out))) {
        textureStore(moments_out, at, m);
    }
}

// Outside of a kernel moments count for nothing, be they infinite.
fn weighted(w: f32, m: vec4f) -> vec4f {
    return select(vec4f(0.0), w * m, w > 0.0);
}

// A level of detail from the one before.
@compute @workgroup_size(8, 8)
fn halve_moments(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= textureDimensions(moments_out)) {
        return;
    }
    let at = vec2i(2u * id.xy);
    let last = vec2i(textureDimensions(unfiltered)) - 1;
    var sum = vec4f(0.0);
    for (var i = 0; i < 4; i++) {
        sum += textureLoad(unfiltered, min(at + vec2i(i & 1, i >> 1), last), 0);
    }
    textureStore(moments_out, id.xy, 0.25 * sum);
}

// Where a receiver's moments lie: a place of the first plane's layer, and how it changes from pixel to pixel.
struct Averaged {
    at: vec2f,
    along_x: vec2f,
    along_y: vec2f,
    layer: u32,
}

fn averaged(s: Surface, r: Receiver) -> Averaged {
    let side = f32(textureDimensions(moments_map).x);
    // Where a map is smaller than its layer, what lies beside it stays out.
    let at = clamp(r.texel, vec2f(0.5), vec2f(r.side - 0.5)) / side;
    // Without levels of detail there is only the finest.
    let v = light_views[r.layer];
    let clip = light_clip(v, s.position);
    let steps = pixel_steps(s);
    let wide = select(0.0, 1.0 / side, prefiltering.mipmaps != 0u);
    let x = wide * map_along(v, steps[0], clip).xy;
    let y = wide * map_along(v, steps[1], clip).xy;
    return Averaged(at, x, y, texture_layer(r.layer) * prefiltered.planes);
}

fn moments_of(a: Averaged, plane: u32) -> vec4f {
    return textureSampleGrad(moments_map, moments_sampler, a.at, a.layer + plane, a.along_x, a.along_y);
}

// The averaged moments at a receiver's place, of the first plane.
fn moments_at(s: Surface, r: Receiver) -> vec4f {
    return moments_of(averaged(s, r), 0u);
}

// A receiver's depth, from 0 to 1, with every bias.
fn receiver_share(r: Receiver) -> f32 {
    return depth_share(light_views[r.layer], r.depth);
}

// What views show of a receiver: its depth is compared as it is, whatever way its plane leans.
fn received(s: Surface) -> Receiver {
    var r = receive(s, choose(s).layer, 0.0, 2.0);
    r.moved = moved_to(s, r.layer, r.depth);
    return r;
}

fn lit(s: Surface, layer: u32) -> f32 {
    let r = receive(s, layer, 0.0, 2.0);
    let v = light_at_depth(s, r, receiver_share(r));
    return select(v, 1.0, outside_map(r, r.texel));
}

// The share of the kernel's texels that lie at a depth z or beyond, weighted as the blur does.
fn exact_share(r: Receiver, z: f32) -> f32 {
    let v = light_views[r.layer];
    let radius = i32(prefiltering.blur_radius);
    let narrow = -2.0 / max(f32(radius * radius), 1.0);
    let last = vec2i(i32(r.side) - 1);
    var beyond = 0.0;
    var weight = 0.0;
    let side = 2 * radius + 1;
    for (var i = 0; i < side * side; i++) {
        let step = vec2i(i % side, i / side) - radius;
        let at = clamp(vec2i(r.texel) + step, vec2i(0), last);
        let w = exp(narrow * f32(step.x * step.x + step.y * step.y));
        beyond += select(0.0, w, depth_share(v, drawn_depth(r.layer, vec2u(at))) >= z);
        weight += w;
    }
    return beyond / weight;
}

// A chart for the probed surface: visibility over the depth that its receiver might have, from the near plane at the left to
// the far plane.
fn curve(pixel: vec2u) -> f32 {
    let size = vec2f(frame.size);
    let s = load_surface(probed_pixel());
    let at = ((vec2f(pixel) + 0.5) / size - 0.05) / 0.9;
    let r = received(s);
    let step = vec2f(1.0) / (0.9 * size);
    let wide = max(1.0, size.y / 400.0);
    let half = 0.5 * wide * step;
    // From one column to the next the curves may fall steeply: they are drawn as far as they fall.
    let y = 1.0 - at.y;
    var here = vec2f(0.0);
    var next = vec2f(0.0);
    for (var i = 0u; i < 2u; i++) {
        here = next;
        let z = at.x + f32(i) * step.x;
        next = vec2f(light_at_depth(s, r, z), exact_share(r, z));
    }
    let on = (vec2f(y) > min(here, next) - half.y) & (vec2f(y) < max(here, next) + half.y);
    let tenth = abs(fract(10.0 * vec2f(at.x, y) + 0.5) - 0.5) / 10.0;
    // What lies below others first.
    var v = drawn(white, select(0.05, 0.2, any(tenth < 0.5 * step)));
    v = select(v, drawn(0u, 0.8), any(abs(at.x - explaining_depths(s, r)) < vec2f(half.x)));
    v = select(v, drawn(2u, 1.0), on.y);
    v = select(v, drawn(1u, 1.0), on.x);
    v = select(v, drawn(white, 0.9), abs(at.x - receiver_share(r)) < half.x);
    return select(v, drawn(white, 0.0), any(at < vec2f(0.0)) || any(at > vec2f(1.0)) || !s.valid);
}

// A pass of its own: a chart takes as long to compile as all the other views.
@compute @workgroup_size(8, 8)
fn draw_curve(@builtin(global_invocation_id) id: vec3u) {
    if all(id.xy < frame.size) {
        textureStore(map_out, id.xy, vec4f(curve(id.xy)));
    }
}
