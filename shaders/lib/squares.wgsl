//!include lib/frame.wgsl
// Two squares beside each other, fitted into the picture.

// A place in the picture, pixels, in units of the squares' sides from the first one's upper left corner.
fn square_place(pixel: vec2f) -> vec2f {
    let size = vec2f(frame.size);
    let scale = max(2.08 / size.x, 1.04 / size.y);
    return (pixel - 0.5 * size) * scale + vec2f(1.0, 0.5);
}
