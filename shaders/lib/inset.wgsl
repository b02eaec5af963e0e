//!include lib/frame.wgsl
// The place of a small picture in the upper right corner of the large one, of a third its size.

fn inset_gap() -> u32 {
    return max(frame.size.y / 90u, 2u);
}

fn inset_corner() -> vec2u {
    return vec2u(frame.size.x - frame.size.x / 3u - inset_gap(), inset_gap());
}

fn inside_inset(pixel: vec2u) -> bool {
    return all(pixel >= inset_corner()) && all(pixel < inset_corner() + frame.size / 3u);
}

// Whether a pixel lies neither in it nor in the line around it.
fn beside_inset(pixel: vec2u) -> bool {
    let line = max(inset_gap() / 6u, 1u);
    return any(pixel + line < inset_corner()) || any(pixel >= inset_corner() + frame.size / 3u + line);
}
