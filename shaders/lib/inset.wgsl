//!include lib/frame.wgsl
// The place of a small picture in the lower right corner of the large one, of a third its size.

fn inset_gap() -> u32 {
    return max(frame.size.y / 90u, 2u);
}

fn inset_corner() -> vec2u {
    return frame.size - frame.size / 3u - inset_gap();
}

// Whether a pixel lies neither in it nor in the line around it.
fn beside_inset(pixel: vec2u) -> bool {
    let line = max(inset_gap() / 6u, 1u);
    return any(pixel + line < inset_corner()) || any(pixel >= frame.size - inset_gap() + line);
}
