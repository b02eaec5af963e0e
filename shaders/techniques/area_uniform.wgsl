//!include map/choose/single.wgsl
//!include map/places.wgsl
//!include lib/light_dots.wgsl
//!include constants.wgsl
// The mean over maps from places all over the light.

var<uniform> samples: AreaUniformParams;
// The places on the light, as `lib/light_place.wgsl` has them.
var<storage, read> light_places: array<vec2f>;

fn window_side() -> u32 {
    return samples.kernel;
}

fn slots() -> u32 {
    return 1u;
}

@compute @workgroup_size(8, 8)
fn mean(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) {
        return;
    }
    let s = load_surface(id.xy);
    let v = select(select(1.0, 0.0, s.valid), share(id.xy, 0u), may_be_shadowed(s, light_at(s.position)));
    textureStore(visibility_out, id.xy, vec4f(v));
}

fn dot_count() -> u32 {
    return arrayLength(&light_places);
}

fn dot_place(i: u32) -> vec2f {
    return light_places[i];
}

fn dot_seen(i: u32) -> bool {
    return place_seen(i);
}

fn inspect_map(s: Surface) -> f32 {
    if frame.map == shows_light_samples {
        return light_dots(s.pixel);
    }
    if frame.map == shows_penumbra {
        return select(-1.0, penumbra_label(share(s.pixel, 0u)), may_be_shadowed(s, light_at(s.position)));
    }
    return inspect_filter(s);
}
