// Williams 1978: one depth comparison with the nearest texel.

fn lit(s: Surface, layer: u32) -> f32 {
    let r = receive(s, layer, 0.0, 1.0);
    return compare(r, r.texel);
}

fn inspect_filter(s: Surface) -> f32 {
    return inspect_look_up(s, receive(s, choose(s).layer, 0.0, 1.0));
}
