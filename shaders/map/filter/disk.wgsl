// Taps in a disk, for filters.

// Vogel's spiral: the golden angle between neighbours, equal areas. Tap i of n.
fn in_disk(i: u32, n: f32, radius: f32, turn: f32) -> vec2f {
    let r = radius * sqrt((f32(i) + 0.5) / n);
    let angle = f32(i) * 2.3999632 + turn;
    return r * vec2f(cos(angle), sin(angle));
}

// Angles that differ from pixel to pixel: at random,
fn white_turn(pixel: vec2u) -> f32 {
    return f32(hash(pixel.x + hash(pixel.y + hash(frame.seed)))) * (6.2831853 / 4294967296.0);
}

// or by interleaved gradient noise (Jimenez 2014), of which any 3 × 3 neighbours have nearly all angles.
fn interleaved_turn(pixel: vec2u) -> f32 {
    let p = vec2f(pixel);
    return 6.2831853 * fract(52.9829189 * fract(0.06711056 * p.x + 0.00583715 * p.y));
}
