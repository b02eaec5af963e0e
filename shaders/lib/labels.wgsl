//!include palettes.wgsl
// Labels in `map_out`: one of nine colours and how strongly it covers the scene, or from 16 on a plain ground.

const plain_ground = 16.0;
// The last of the colours.
const white = 8u;

// A colour over the scene; strength 0 to 1.
fn label(color: u32, strength: f32) -> f32 {
    return f32(color) + 0.99 * saturate(strength);
}

// A colour over the plain ground.
fn drawn(color: u32, strength: f32) -> f32 {
    return plain_ground + label(color, strength);
}

fn label_of(x: f32) -> u32 {
    return u32(x) & 15u;
}

fn label_strength(x: f32) -> f32 {
    return fract(x) / 0.99;
}
