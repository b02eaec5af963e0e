//!include lib/cascades.wgsl
//!include lib/analysis.wgsl
// The analysis of techniques with cascades: each sample in the map that it looks up first.

fn place(s: Surface, dx: vec3f, dy: vec3f) -> Place {
    let i = cascade_of(cascade_depth(s.position, s.depth));
    let v = light_views[i];
    let clip = light_clip(v, s.position);
    let texel = light_texel(v, clip);
    // Beside a map that is smaller than its layer lies nothing; on its very edge, whatever the rounding, the map.
    let beside = any(texel > vec2f(v.resolution + 0.02));
    return Place(select(min(texel, vec2f(v.resolution - 0.01)), vec2f(-1.0), beside), i, along(v, dx, clip).xy, along(v, dy, clip).xy);
}
