//!include map/choose/cascades.wgsl
//!include map/places.wgsl
//!include lib/light_dots.wgsl
//!include constants.wgsl
// Azri 2020: the mean over maps from places all over the light, fewer and coarser ones in each of three cascades.

var<uniform> cssm: CssmParams;
// The places on the light, cascade by cascade, as `lib/light_place.wgsl` has them.
var<storage, read> light_places: array<vec2f>;

fn window_side() -> u32 {
    return cssm.kernel;
}

fn slots() -> u32 {
    return select(1u, 2u, cssm.blend > 0.0);
}

fn seen_share(s: Surface) -> f32 {
    let own = share(s.pixel, 0u);
    let c = choose(s);
    if c.share <= 0.0 {
        return own;
    }
    return mix(own, share(s.pixel, 1u), c.share);
}

@compute @workgroup_size(8, 8)
fn mean(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) {
        return;
    }
    let s = load_surface(id.xy);
    var v = select(1.0, 0.0, s.valid);
    if may_be_shadowed(s, light_at(s.position)) {
        v = seen_share(s);
    }
    textureStore(visibility_out, id.xy, vec4f(v));
}

// The probed pixel's cascade: the number of its first place, and how many it has.
fn probed_set() -> vec2u {
    let s = load_surface(probed_pixel());
    let c = choose(s).layer;
    if !has_size() {
        return vec2u(c, 1u);
    }
    let counts = vec3u(cssm.side, cssm.side_2, cssm.side_3) * vec3u(cssm.side, cssm.side_2, cssm.side_3);
    var first = 0u;
    for (var i = 0u; i < c; i++) {
        first += counts[i];
    }
    return vec2u(first, counts[c]);
}

fn dot_count() -> u32 {
    return probed_set().y;
}

fn dot_place(i: u32) -> vec2f {
    return light_places[probed_set().x + i];
}

fn dot_seen(i: u32) -> bool {
    return place_seen(probed_set().x + i);
}

fn inspect_map(s: Surface) -> f32 {
    if frame.map == shows_light_samples {
        return light_dots(s.pixel);
    }
    let asks = may_be_shadowed(s, light_at(s.position));
    if frame.map == shows_penumbra {
        return select(-1.0, penumbra_label(seen_share(s)), asks);
    }
    if frame.map == shows_maps_asked {
        return select(-1.0, maps_asked(s.pixel), asks);
    }
    return inspect_cascades(s);
}
