//!include map/light_view.wgsl
// Boxes in one homography of a light's image, each with a map of its own.

struct FilmParts {
    // From (X, 1) in world space to that image.
    row_x: vec4f,
    row_y: vec4f,
    row_w: vec4f,
    count: u32,
    padding_0: u32,
    padding_1: u32,
    padding_2: u32,
    // Lowest and highest x and y.
    boxes: array<vec4f, most_layers>,
}

var<uniform> film_parts: FilmParts;

// The box that a point's image lies in.
fn part_of(position: vec3f) -> u32 {
    let p = vec4f(position, 1.0);
    let at = vec2f(dot(film_parts.row_x, p), dot(film_parts.row_y, p)) / dot(film_parts.row_w, p);
    for (var i = 1u; i < film_parts.count; i++) {
        let b = film_parts.boxes[i];
        if all(at >= b.xy) && all(at < b.zw) {
            return i;
        }
    }
    return 0u;
}
