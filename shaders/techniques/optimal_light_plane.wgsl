//!include map/choose/film_parts.wgsl
//!include lib/labels.wgsl
//!include constants.wgsl
// Chong 2003: maps on planes that are turned to where the pixels are.

fn inspect_map(s: Surface) -> f32 {
    if frame.map == shows_shadow_maps {
        return maps_picture(s.pixel, film_parts.count);
    }
    if frame.map == shows_parts {
        return select(-1.0, label(choose(s).layer, 0.5), s.valid);
    }
    return inspect_filter(s);
}
