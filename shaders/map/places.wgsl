//!include map/choose/single.wgsl
//!include map/place/straight.wgsl
//!include map/look_up.wgsl
//!include lib/light_place.wgsl
// Maps from several places of a light with a size, drawn and looked up one after the other; with a technique's own
//     fn window_side() -> u32   side of the window of texels that is looked at in each

// From the light's middle to the place that the map is drawn from, and its number.
var<uniform> step_to_place: vec4f;
// Of each pixel the texels asked so far in the upper half, those of them that see the light in the lower.
var<storage, read_write> seen: array<u32>;
// Of the probed pixel the texels of each place that see the light.
var<storage, read_write> seen_places: array<u32>;

@compute @workgroup_size(8, 8)
fn begin(@builtin(global_invocation_id) id: vec3u) {
    if all(id.xy < frame.size) {
        seen[id.y * frame.size.x + id.x] = 0u;
    }
}

// One map more.
@compute @workgroup_size(8, 8)
fn add(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) {
        return;
    }
    let s = load_surface(id.xy);
    let light = light_at(s.position);
    if !may_be_shadowed(s, light) {
        return;
    }
    let n = window_side();
    let around = 0.5 * f32(n - 1u);
    let r = receive(s, choose(s).layer, around, 1.0);
    let first = floor(r.texel - around) + 0.5;
    var lit = 0u;
    // A place that has set behind the surface's plane is not seen, whatever the map says.
    let risen = dot(s.normal, light.to_light + step_to_place.xyz) > 0.0;
    for (var i = 0u; i < select(0u, n * n, risen); i++) {
        lit += u32(compare(r, first + vec2f(vec2u(i % n, i / n))) + 0.5);
    }
    seen[id.y * frame.size.x + id.x] += (n * n << 16u) + lit;
    if all(id.xy == probed_pixel()) {
        seen_places[u32(step_to_place.w)] = lit;
    }
}

// The share of the light that the maps see together.
fn share(pixel: vec2u) -> f32 {
    let both = seen[pixel.y * frame.size.x + pixel.x];
    return f32(both & 0xffffu) / f32(max(both >> 16u, 1u));
}
