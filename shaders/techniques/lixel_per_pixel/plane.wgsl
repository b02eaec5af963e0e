//!include map/light_view.wgsl
// Which pixels look up the plane's map.

const ordinary = 0u;
const planes_own = 1u;

var<uniform> lixel: LixelParams;
// The plane of the points X with dot(plane_of_interest, (X, -1)) = 0, its normal a unit vector; 0: there is no map of one.
var<uniform> plane_of_interest: vec4f;

fn near_plane(p: vec3f, tolerance: f32) -> bool {
    let plane = plane_of_interest;
    return any(plane.xyz != vec3f(0.0)) && abs(dot(plane.xyz, p) - plane.w) <= tolerance;
}

// Whether a point lies near the plane, and in that share of its map.
fn has_lixel(p: vec3f, share: f32) -> bool {
    if !near_plane(p, share * lixel.tolerance) {
        return false;
    }
    let v = light_views[planes_own];
    let clip = light_clip(v, p);
    return clip.w > 0.0 && all(abs(clip.xy) < vec2f(share * clip.w));
}
