//!include lib/frame.wgsl
//!include lib/labels.wgsl
// A drawing of the light's samples, with a technique's own
//     fn dot_count() -> u32               how many samples there are
//     fn dot_place(i: u32) -> vec2f       where on the light one lies, -1 to 1
//     fn dot_seen(i: u32) -> bool         whether the probed pixel sees it

// Half the drawn light's sides, pixels.
fn drawn_half() -> f32 {
    return 0.5 * f32(min(frame.size.x, frame.size.y)) / 1.04;
}

// The place of the light, -1 to 1, that a pixel of the drawing shows.
fn drawn_place(pixel: vec2u) -> vec2f {
    return vec2f(1.0, -1.0) * (vec2f(pixel) + 0.5 - 0.5 * vec2f(frame.size)) / drawn_half();
}

fn light_dots(pixel: vec2u) -> f32 {
    let at = drawn_place(pixel);
    let line = 1.0 / drawn_half();
    if any(abs(at) > vec2f(1.0 + line)) {
        return drawn(white, 0.0);
    }
    let n = min(dot_count(), 1024u);
    let radius = clamp(0.35 / sqrt(f32(n)), 2.0 * line, 0.03);
    var nearest = 0u;
    var away = 4.0;
    for (var i = 0u; i < n; i++) {
        let d = distance(dot_place(i), at);
        if d < away {
            away = d;
            nearest = i;
        }
    }
    if away < radius {
        return drawn(select(4u, 1u, dot_seen(nearest)), 1.0);
    }
    // The outline: a rectangle, or a disc.
    let edge = select(length(at), max(abs(at.x), abs(at.y)), frame.light_kind == rect_area);
    return drawn(white, select(select(0.0, 0.06, edge < 1.0), 0.7, abs(edge - 1.0) < line));
}
