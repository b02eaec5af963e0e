//!include map/laid.wgsl
//!include map/choose/whole_layers.wgsl
// One layer for all surfaces.

fn choose(s: Surface) -> Chosen {
    return Chosen(0u, 0u, 0.0);
}

// The map in the middle of the picture, as large as fits.
fn laid_out(pixel: vec2f) -> Laid {
    let size = vec2f(frame.size);
    let side = light_views[0].resolution;
    let scale = side / min(size.x, size.y);
    let place = (pixel - 0.5 * size) * scale + 0.5 * side;
    return Laid(all(place >= vec2f(0.0)) && all(place < vec2f(side)), 0u, place, scale, false);
}

// The pixel at which that shows a place of a view's map.
fn pixel_of(v: LightView, place: vec2f) -> vec2f {
    let size = vec2f(frame.size);
    return (place / v.resolution - 0.5) * min(size.x, size.y) + 0.5 * size;
}
