//!include lib/light_view.wgsl
//!include lib/analysis.wgsl
// Where a surface lies in the one map of a technique, however it is drawn.

fn place(s: Surface, dx: vec3f, dy: vec3f) -> Place {
    let clip = light_clip(light_view, s.position);
    let x = map_along(light_view, dx, clip).xy;
    let y = map_along(light_view, dy, clip).xy;
    return Place(map_texel(light_view, clip), 0u, x, y);
}
