//!include map/light_view.wgsl
// Which pixels look up the plane's map.

const ordinary = 0u;
const planes_own = 1u;

var<uniform> lixel: LixelParams;
// The plane of the points X with dot(plane_of_interest, (X, -1)) = 0, its normal a unit vector. Where there is no map of one, one that no
// point is near: no branch asks for it, as by its place among the uniforms it may decide none (`what_decides_branches_comes_first`).
var<uniform> plane_of_interest: vec4f;

fn near_plane(p: vec3f, tolerance: f32) -> bool {
    let plane = plane_of_interest;
    return abs(dot(plane.xyz, p) - plane.w) <= tolerance;
}

// Whether a point lies near the plane, and in that share of its map.
fn has_lixel(p: vec3f, share: f32) -> bool {
    let near = near_plane(p, share * lixel.tolerance);
    let clip = light_clip(light_views[select(ordinary, planes_own, near)], p);
    return near && clip.w > 0.0 && all(abs(clip.xy) < vec2f(share * clip.w));
}
