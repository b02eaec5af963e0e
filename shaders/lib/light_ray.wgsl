//!include lib/light_place.wgsl
//!include lib/shadow_ray.wgsl
// The shadow ray to a place of a light with a size.

// Whether a surface that faces the light sees that place of it. Where the place has set behind the surface's plane it does not.
fn sees(s: Surface, light: LightSample, place: vec2f) -> bool {
    var there = light;
    there.to_light = towards(light.to_light, place);
    if dot(s.normal, there.to_light) <= 0.0 {
        return false;
    }
    let hit = trace(shadow_ray(s, there));
    tally_ray(hit);
    return !hit.blocked;
}

// Whether the probed pixel sees that place of the light.
fn probed_sees(place: vec2f) -> bool {
    let s = load_surface(probed_pixel());
    let light = light_at(s.position);
    return may_be_shadowed(s, light) && sees(s, light, place);
}
