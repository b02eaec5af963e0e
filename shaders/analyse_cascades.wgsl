//!include lib/cascades.wgsl
//!include lib/analysis.wgsl
// The analysis of techniques with cascades: each sample in the map that it looks up first.

fn place(s: Surface, dx: vec3f, dy: vec3f) -> Place {
    let i = cascade_of(s.depth);
    let v = light_views[i];
    let clip = light_clip(v, s.position);
    return Place(light_texel(v, clip), i, along(v, dx, clip).xy, along(v, dy, clip).xy);
}
