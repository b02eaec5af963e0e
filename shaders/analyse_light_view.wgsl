//!include lib/light_view.wgsl
//!include lib/analysis.wgsl
// The analysis of techniques with one light view.

fn place(s: Surface, dx: vec3f, dy: vec3f) -> Place {
    let clip = light_clip(light_view, s.position);
    let x = along(light_view, dx, clip).xy;
    let y = along(light_view, dy, clip).xy;
    return Place(light_texel(light_view, clip), 0u, x, y);
}
