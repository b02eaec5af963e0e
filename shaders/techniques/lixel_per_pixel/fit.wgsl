//!include map/narrow_to.wgsl
//!include techniques/lixel_per_pixel/plane.wgsl
// Fits the ordinary map to the receivers that look it up.

fn is_taken(position: vec3f, view: u32) -> bool {
    // What rounding may take out of the plane's map is held by both.
    return !has_lixel(position, 0.9999);
}
