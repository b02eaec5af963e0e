//!include map/light_view.wgsl
// The place in a map that is warped in ways no matrix can express. Places are shares of the map's sides, x to the right
// and y down: u before the warp, as the light view draws it, and after it. Includers write
//     fn warp(u: vec2f) -> vec2f           after the warp; it takes each side of the unit square to itself
//     fn warp_slope(u: vec2f) -> mat2x2f   the derivative of `warp`
//     fn unwarp(at: vec2f) -> vec2f        its inverse
//     fn warp_bends() -> f32               in how many pieces a side falls within which the warp is smooth
// of the layer number `warped_layer`.

var<private> warped_layer: u32 = 0u;

// Has all that follows follow the warp of a view's layer.
fn follow(v: LightView) {
    warped_layer = v.layer;
}

// `warp`, continued outside the unit square.
fn warped(u: vec2f) -> vec2f {
    let inner = saturate(u);
    return warp(inner) + (u - inner);
}

fn map_texel(v: LightView, clip: vec4f) -> vec2f {
    follow(v);
    return v.resolution * warped(light_texel(v, clip) / v.resolution);
}

fn map_along(v: LightView, t: vec3f, clip: vec4f) -> vec4f {
    follow(v);
    let a = along(v, t, clip);
    return vec4f(warp_slope(saturate(light_texel(v, clip) / v.resolution)) * a.xy, a.zw);
}

// Longest extent in metres of the texel at a point, seen across the light's beam; `to_light` is a unit vector.
fn map_texel_size(v: LightView, position: vec3f, to_light: vec3f) -> f32 {
    let other = select(vec3f(1.0, 0.0, 0.0), vec3f(0.0, 1.0, 0.0), abs(to_light.x) > 0.5);
    let t = normalize(cross(to_light, other));
    let clip = light_clip(v, position);
    return longest_extent(map_along(v, t, clip).xy, map_along(v, cross(to_light, t), clip).xy);
}

// The place, texels, at which the light view's own image has what a place in the map shows.
fn before_place(v: LightView, texel: vec2f) -> vec2f {
    follow(v);
    return v.resolution * unwarp(saturate(texel / v.resolution));
}

// Texels a metre across the light at a point.
fn map_density(v: LightView, position: vec3f, to_light: vec3f) -> vec2f {
    return vec2f(1.0 / map_texel_size(v, position, to_light));
}

// From a receiver at one place in the map to the ray of another, texels as the warp has them at the first: along these the
// receiver's plane is what it is before the warp.
fn map_step(v: LightView, clip: vec4f, here: vec2f, there: vec2f) -> vec2f {
    follow(v);
    let u = saturate(light_texel(v, clip) / v.resolution);
    return warp_slope(u) * (unwarp(saturate(there / v.resolution)) - u) * v.resolution;
}

// The step to the ray of the texel's centre: where the warp turns within the texel, it is longer than half a texel's diagonal.
fn map_spread(v: LightView, clip: vec4f, texel: vec2f) -> vec2f {
    return map_step(v, clip, texel, floor(texel) + 0.5);
}
