//!include lib/frame.wgsl
//!include lib/gbuffer.wgsl
//!include lib/trace.wgsl
// The ray from a surface to the light.

// Nodes of the BVH that a ray may visit before it gives up, where no parameter says so.
const most_visits = 65536u;

// `epsilon`: see RtParams.
fn ray_to_light(s: Surface, light: LightSample, epsilon: f32, two_sided: bool, max_visits: u32) -> Ray {
    let size = max(abs(s.position.x), max(abs(s.position.y), abs(s.position.z)));
    // The position lies on its triangle but for its rounding, up to half an ulp in each coordinate; and the test of a triangle
    // in the same plane errs by a few more. Off the surface by that much, the ray crosses neither this plane again nor
    // a neighbour's edge, however low the light. Lifted, it still meets all that stands on the surface.
    let rounding = 8.0 * unit * size;
    // It ends before the lamp by more than that rounding: one in the plane of a ceiling is not hidden by it.
    let lamp = max(abs(frame.light_position.x), max(abs(frame.light_position.y), abs(frame.light_position.z)));
    let short = max(1.0 - 64.0 * unit * max(size, lamp) / length(light.to_light), 0.0);
    let far = select(short, 3.4e38, frame.light_kind == directional);
    let start = max(0.5 * rounding, epsilon * max(size, 1.0)) / length(light.to_light);
    let origin = s.position + rounding * s.normal;
    return Ray(origin, light.to_light, start, far, triangles[s.triangle].w, two_sided, max_visits);
}
