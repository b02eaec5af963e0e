//!include lib/straight.wgsl
//!include lib/nearest.wgsl
// Williams 1978: one depth comparison with the nearest texel.

fn inspect_map(s: Surface) -> f32 {
    return inspect_lookup(s, receive(s, 0.0, 1.0));
}
