//!include lib/frame.wgsl
//!include lib/gbuffer.wgsl
// What the light gives a surface.

// Irradiance on a surface that sees the share `v` of the light.
fn direct_light(s: Surface, v: f32) -> vec3f {
    let light = light_at(s.position);
    let cosine = max(dot(s.shading_normal, normalize(light.to_light)), 0.0);
    return select(0.0, v, light.reached && faces_light(s)) * cosine * light.irradiance;
}
