//!include lib/frame.wgsl
//!include lib/gbuffer.wgsl
//!include lib/trace.wgsl
// The shadow ray of a view sample, as the truth sends it.

// The largest of a point's coordinates: what its rounding goes by.
fn largest(p: vec3f) -> f32 {
    return max(abs(p.x), max(abs(p.y), abs(p.z)));
}

fn shadow_ray(s: Surface, light: LightSample) -> Ray {
    let size = largest(s.position);
    // The position lies on its triangle but for its rounding, up to half an ulp in each coordinate; and the test of a triangle
    // in the same plane errs by a few more. Off the surface by that much, the ray crosses neither this plane again nor
    // a neighbour's edge, however low the light. Lifted, it still meets all that stands on the surface.
    let rounding = 8.0 * unit * size;
    // It ends before the lamp by more than that rounding: one in the plane of a ceiling is not hidden by it.
    let short = max(1.0 - 64.0 * unit * max(size, largest(frame.light_position)) / length(light.to_light), 0.0);
    let sun = frame.light_kind == directional;
    let far = select(short, 3.4e38, sun);
    let start = 0.5 * rounding / length(light.to_light);
    let lift = rounding * s.normal;
    return Ray(s.position + lift, light.to_light - select(lift, vec3f(0.0), sun), start, far, triangle_at(s.triangle).w, true, 65536u);
}
