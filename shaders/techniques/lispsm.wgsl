//!include lib/lookup.wgsl
// Wimmer, Scherzer, Purgathofer 2004: one comparison in a map that is warped along the view.

fn visibility(s: Surface) -> f32 {
    let r = receive(s, 0.0, 1.0);
    return compare(r, r.texel);
}

fn inspect_map(s: Surface) -> f32 {
    return inspect_lookup(s, receive(s, 0.0, 1.0));
}
