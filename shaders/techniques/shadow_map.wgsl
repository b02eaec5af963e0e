//!include lib/lookup.wgsl
// Williams 1978: one depth comparison with the nearest texel.

fn visibility(s: Surface) -> f32 {
    let r = receive(s, 0.0, 1.0);
    return compare(r, r.texel);
}

fn inspect_map(s: Surface) -> f32 {
    return inspect_lookup(s, receive(s, 0.0, 1.0));
}
