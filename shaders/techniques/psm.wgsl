//!include lib/lookup.wgsl
// Stamminger, Drettakis 2002: one comparison in a map drawn in the space after the camera's perspective.

fn visibility(s: Surface) -> f32 {
    let r = receive(s, 0.0, 1.0);
    return compare(r, r.texel);
}

fn inspect_map(s: Surface) -> f32 {
    return inspect_lookup(s, receive(s, 0.0, 1.0));
}
