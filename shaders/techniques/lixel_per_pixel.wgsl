//!include map/place/straight.wgsl
//!include map/look_up.wgsl
//!include map/tiles.wgsl
//!include techniques/lixel_per_pixel/plane.wgsl
//!include map/choose/whole_layers.wgsl
// Chong, Gortler 2004: the pixels of one plane have a map whose texels are pixels, all others an ordinary one.

fn choose(s: Surface) -> Chosen {
    return Chosen(select(ordinary, planes_own, has_lixel(s.position, 1.0)), ordinary, 0.0);
}

fn inspect_map(s: Surface) -> f32 {
    if frame.map == shows_shadow_maps {
        return maps_picture(s.pixel, textureNumLayers(shadow_maps));
    }
    if !s.valid {
        return -1.0;
    }
    if frame.map == shows_plane {
        // Near the plane, but not in its map: the third colour.
        let layer = choose(s).layer;
        return label(select(layer, 2u, layer == ordinary && near_plane(s.position, lixel.tolerance)), 0.5);
    }
    return inspect_filter(s);
}
