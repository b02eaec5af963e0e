// Maps that are filtered before they are looked up: what a filter keeps of depth (its moments) is averaged over texels, and the
// look-up takes one bilinear sample. A filter writes
//     fn moments(z: f32, slope: f32, plane: u32) -> vec4f   of a depth z from 0 (near) to 1 (far) that changes by `slope` a
//                                                           texel; the plane-th four of them
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

// Depth from 0 at the view's near plane to 1 at its far plane, linear along the light's axis.
fn depth_share(v: LightView, stored: f32) -> f32 {
    return saturate((linear_depth(v, stored) - v.near) / (v.far - v.near));
}

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

// Half of a Gaussian whose standard deviation is half the kernel's radius, along x or y.
@compute @workgroup_size(8, 8)
fn blur_moments(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= textureDimensions(moments_out)) {
        return;
    }
    let radius = i32(prefiltering.blur_radius);
    let along = select(vec2i(1, 0), vec2i(0, 1), prefiltered.down == 1u);
    let last = vec2i(textureDimensions(unfiltered)) - 1;
    let narrow = -2.0 / f32(radius * radius);
    var sum = vec4f(0.0);
    var weight = 0.0;
    for (var i = -radius; i <= radius; i++) {
        let w = exp(narrow * f32(i * i));
        sum += w * textureLoad(unfiltered, clamp(vec2i(id.xy) + i * along, vec2i(0), last), 0);
        weight += w;
    }
    textureStore(moments_out, id.xy, sum / weight);
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

// The averaged moments at a receiver's place.
fn moments_at(s: Surface, r: Receiver, plane: u32) -> vec4f {
    let side = f32(textureDimensions(moments_map).x);
    // Where a map is smaller than its layer, what lies beside it stays out.
    let at = clamp(r.texel, vec2f(0.5), vec2f(r.side - 0.5)) / side;
    let layer = r.layer * prefiltered.planes + plane;
    if prefiltering.mipmaps == 0u {
        return textureSampleLevel(moments_map, moments_sampler, at, layer, 0.0);
    }
    let v = light_views[r.layer];
    let clip = light_clip(v, s.position);
    let steps = pixel_steps(s);
    let x = map_along(v, steps[0], clip).xy / side;
    let y = map_along(v, steps[1], clip).xy / side;
    return textureSampleGrad(moments_map, moments_sampler, at, layer, x, y);
}
