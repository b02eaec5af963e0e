//!include lib/frame.wgsl
//!include lib/gbuffer.wgsl
//!include lib/light_ray.wgsl
//!include constants.wgsl
//!include lib/light_dots.wgsl
// The mean over rays to places all over the light. Each dispatch adds some to those that the pixels have.

var<uniform> params: RtSoftParams;
// Of each pixel's rays so far those that were sent in the upper half, those that were not blocked in the lower.
var<storage, read_write> counts: array<u32>;
var visibility_out: texture_storage_2d<r32float, write>;
var map_out: texture_storage_2d<r32float, write>;

const at_once = 8u;

// Cells along each side of the grid that as many rays fill.
fn grid_side() -> u32 {
    return u32(sqrt(f32(params.samples) + 0.5));
}

fn wanted() -> u32 {
    if !has_size() {
        return 1u;
    }
    return select(grid_side() * grid_side(), params.samples, params.pattern == pattern_r2);
}

// Where on the light a pixel's ray ends.
fn ray_place(pixel: vec2u, i: u32) -> vec2f {
    if !has_size() {
        return vec2f(0.0);
    }
    if params.pattern == pattern_r2 {
        return on_light(scattered_by_seed(pixel, i));
    }
    let k = grid_side();
    var inside = vec2f(0.5);
    if params.pattern == pattern_stratified {
        inside = place_of_hash(hash(pixel.x ^ hash(pixel.y ^ hash(i ^ hash(frame.seed))))) + 0.5 / 16777216.0;
    }
    return on_light((vec2f(vec2u(i % k, i / k)) + inside) / f32(k));
}

@compute @workgroup_size(8, 8)
fn resolve(@builtin(global_invocation_id) id: vec3u) {
    let pixel = banded(id.xy);
    if any(pixel >= frame.size) {
        return;
    }
    let s = load_surface(pixel);
    let light = light_at(s.position);
    var v = select(1.0, 0.0, s.valid);
    if may_be_shadowed(s, light) {
        let at = pixel.y * frame.size.x + pixel.x;
        var count = counts[at];
        let first = count >> 16u;
        for (var i = first; i < min(first + at_once, wanted()); i++) {
            count += 0x10000u + select(0u, 1u, sees(s, light, ray_place(pixel, i)));
        }
        counts[at] = count;
        v = f32(count & 0xffffu) / f32(count >> 16u);
    }
    textureStore(visibility_out, pixel, vec4f(v));
}

fn dot_count() -> u32 {
    return wanted();
}

fn dot_place(i: u32) -> vec2f {
    return ray_place(probed_pixel(), i);
}

fn dot_seen(i: u32) -> bool {
    return probed_sees(dot_place(i));
}

@compute @workgroup_size(8, 8)
fn inspect(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= frame.size.x || id.y >= frame.size.y {
        return;
    }
    var value = -1.0;
    if frame.map == shows_light_samples {
        value = light_dots(id.xy);
    } else {
        let count = counts[id.y * frame.size.x + id.x];
        if count > 0u {
            let n = f32(count >> 16u);
            let v = f32(count & 0xffffu) / n;
            value = sqrt(v * (1.0 - v) / n);
        }
    }
    textureStore(map_out, id.xy, vec4f(value));
}
