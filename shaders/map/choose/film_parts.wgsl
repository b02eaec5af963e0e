//!include map/place/straight.wgsl
//!include map/look_up.wgsl
//!include map/tiles.wgsl
//!include map/film_parts.wgsl
//!include map/choose/whole_layers.wgsl
// Choosing among maps that share a light's image by boxes.

fn choose(s: Surface) -> Chosen {
    return Chosen(part_of(s.position), 0u, 0.0);
}
