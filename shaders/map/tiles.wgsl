//!include map/look_up.wgsl
//!include lib/labels.wgsl
// Several maps in one picture.

// The first `count` maps side by side, fitted into the picture as the counts are; near bright.
fn maps_picture(pixel: vec2u, count: u32) -> f32 {
    let columns = u32(ceil(sqrt(f32(count))));
    let rows = (count + columns - 1u) / columns;
    let side = f32(textureDimensions(shadow_maps).x);
    let whole = side * vec2f(vec2u(columns, rows));
    let picture = vec2f(frame.size);
    let scale = max(whole.x / picture.x, whole.y / picture.y);
    let at = (vec2f(pixel) + 0.5 - 0.5 * picture) * scale + 0.5 * whole;
    let tile = vec2u(max(at, vec2f(0.0)) / side);
    let i = tile.y * columns + tile.x;
    if any(at < vec2f(0.0)) || any(at >= whole) || i >= count {
        return drawn(white, 0.0);
    }
    let inner = at - vec2f(tile) * side;
    if any(inner < vec2f(4.0 * scale)) || any(inner >= vec2f(side - 4.0 * scale)) {
        return drawn(i, 0.8);
    }
    return drawn(white, 0.05 + 0.9 * nearness(i, vec2u(inner * (light_views[i].resolution / side))));
}

// What a map holds, linear: 1 at its near, 0 at its far end.
fn nearness(i: u32, texel: vec2u) -> f32 {
    let v = light_views[i];
    return (v.far - linear_depth(v, textureLoad(shadow_maps, texel, i, 0))) / (v.far - v.near);
}
