//!include map/choose/faces.wgsl
//!include map/place/straight.wgsl
// Maps of a light that shines in all directions.

fn inspect_map(s: Surface) -> f32 {
    return inspect_faces(s);
}
