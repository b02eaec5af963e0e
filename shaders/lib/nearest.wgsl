//!include lib/lookup.wgsl
// One depth comparison with the nearest texel.

fn visibility(s: Surface) -> f32 {
    let r = receive(s, 0.0, 1.0);
    return compare(r, r.texel);
}
