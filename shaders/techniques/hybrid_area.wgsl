//!include map/choose/single.wgsl
//!include map/places.wgsl
//!include lib/light_ray.wgsl
//!include lib/light_dots.wgsl
//!include constants.wgsl
// Beister, Ernst, Stamminger 2005, for lights with a size: where all texels of the windows in all maps agree, they decide; else rays do.

var<uniform> agreement: AreaAgreementParams;

fn window_side() -> u32 {
    return agreement.window;
}

fn slots() -> u32 {
    return 1u;
}

@compute @workgroup_size(8, 8)
fn decide(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) {
        return;
    }
    let s = load_surface(id.xy);
    var v = select(1.0, 0.0, s.valid);
    if may_be_shadowed(s, light_at(s.position)) {
        v = share(id.xy, 0u);
        if agreement.rays != 0u && ((v > 0.0 && v < 1.0) || reached_in_part(id.xy)) {
            list_ray(id.xy, 3.4e38);
        }
    }
    textureStore(visibility_out, id.xy, vec4f(v));
}

fn ray_count() -> u32 {
    return select(1u, agreement.samples, has_size());
}

fn ray_place(pixel: vec2u, i: u32) -> vec2f {
    if !has_size() {
        return vec2f(0.0);
    }
    return on_light(scattered_by_seed(pixel, i));
}

@compute @workgroup_size(64)
fn resolve_listed(@builtin(global_invocation_id) id: vec3u) {
    let i = listed_index(id);
    if i >= listed_number() {
        return;
    }
    let pixel = listed_pixel(i);
    let s = load_surface(pixel);
    let light = light_at(s.position);
    var lit = 0u;
    for (var k = 0u; k < ray_count(); k++) {
        lit += select(0u, 1u, sees(s, light, ray_place(pixel, k)));
    }
    textureStore(visibility_out, pixel, vec4f(f32(lit) / f32(ray_count())));
}

fn dot_count() -> u32 {
    return ray_count();
}

fn dot_place(i: u32) -> vec2f {
    return ray_place(probed_pixel(), i);
}

fn dot_seen(i: u32) -> bool {
    return probed_sees(dot_place(i));
}

fn inspect_map(s: Surface) -> f32 {
    if frame.map == shows_light_samples {
        return light_dots(s.pixel);
    }
    let light = light_at(s.position);
    if frame.map != shows_agreement && frame.map != shows_map_share {
        return inspect_filter(s);
    }
    if !may_be_shadowed(s, light) {
        return -1.0;
    }
    let v = share(s.pixel, 0u);
    if frame.map == shows_map_share {
        return v;
    }
    return penumbra_label(v);
}
