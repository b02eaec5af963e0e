//!include lib/frame.wgsl
//!include lib/scene.wgsl
//!include lib/color.wgsl
// Reading the G-buffer.

// World position; w is the depth along the camera's axis, 0 where there is only background.
@group(0) @binding(10) var g_position: texture_2d<f32>;
// Geometric normal, shading normal (both octahedral), albedo (rgba8), triangle.
@group(0) @binding(11) var g_surface: texture_2d<u32>;

struct Surface {
    // False: background.
    valid: bool,
    position: vec3f,
    depth: f32,
    // Geometric; turned towards the camera on double-sided surfaces.
    normal: vec3f,
    shading_normal: vec3f,
    albedo: vec3f,
    triangle: u32,
    pixel: vec2u,
}

fn load_surface(pixel: vec2u) -> Surface {
    let p = textureLoad(g_position, pixel, 0);
    let s = textureLoad(g_surface, pixel, 0);
    return Surface(p.w > 0.0, p.xyz, p.w, octahedral_decode(s.x), octahedral_decode(s.y), srgb_to_linear(unpack4x8unorm(s.z).xyz), s.w, pixel);
}

// Morais 2015: whether the surface faces the light, by its geometric normal.
fn faces_light(s: Surface) -> bool {
    return dot(s.normal, light_at(s.position).to_light) > 0.0;
}
