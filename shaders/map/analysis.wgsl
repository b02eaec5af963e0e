//!include lib/analysis.wgsl
//!include map/light_view.wgsl
// Where a surface lies in the layers of a technique: in the one that it looks up first.

fn place(s: Surface, dx: vec3f, dy: vec3f) -> Place {
    let layer = choose(s).layer;
    let v = light_views[layer];
    let clip = light_clip(v, s.position);
    let texel = map_texel(v, clip);
    // Beside a map that is smaller than its layer lies nothing; on its very edge, whatever the rounding, the map.
    let beside = any(texel > vec2f(v.resolution + 0.02));
    let inner = select(min(texel, vec2f(v.resolution - 0.01)), vec2f(-1.0), beside);
    return Place(inner, texture_layer(layer), map_along(v, dx, clip).xy, map_along(v, dy, clip).xy);
}
