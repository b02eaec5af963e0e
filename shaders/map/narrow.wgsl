//!include map/narrow_to.wgsl
// Fits to all receivers.

fn is_taken(position: vec3f, view: u32) -> bool {
    return true;
}
