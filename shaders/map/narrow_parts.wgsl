//!include map/narrow_to.wgsl
//!include map/film_parts.wgsl
// Fits each view to the receivers in its part of the film.

fn is_taken(position: vec3f, view: u32) -> bool {
    return part_of(position) == view;
}
