//!include map/light_view.wgsl
// The place in a map that is drawn as its light view says.

fn map_texel(v: LightView, clip: vec4f) -> vec2f {
    return light_texel(v, clip);
}

fn map_along(v: LightView, t: vec3f, clip: vec4f) -> vec4f {
    return along(v, t, clip);
}

fn map_texel_size(v: LightView, position: vec3f, to_light: vec3f) -> f32 {
    return texel_size(v, position, to_light);
}

// The place, texels, at which the light view's own image has what a place in the map shows.
fn before_place(v: LightView, texel: vec2f) -> vec2f {
    return texel;
}

// Texels a metre across the light at a point, along the map's sides.
fn map_density(v: LightView, position: vec3f, to_light: vec3f) -> vec2f {
    if v.perspective >= 2u {
        return vec2f(1.0 / texel_size(v, position, to_light));
    }
    return 0.5 * v.resolution * scale_of(v) / select(1.0, dot(v.axis, vec4f(position, 1.0)), v.perspective == 1u);
}

// The step in the map from a receiver at one place to another place's ray, texels.
fn map_step(v: LightView, clip: vec4f, here: vec2f, there: vec2f) -> vec2f {
    return there - here;
}

// See map/place/warp.wgsl: here the ray of a texel is never farther than half its diagonal.
fn map_spread(v: LightView, clip: vec4f, texel: vec2f) -> vec2f {
    return vec2f(0.0);
}
