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

// Okabe and Ito 2008, hues that the colour-blind tell apart; neighbours differ in lightness too.
fn label_color(i: u32) -> vec3f {
    let colors = array<vec3f, 9>(
        vec3f(0.84, 0.37, 0.00), vec3f(0.94, 0.89, 0.26), vec3f(0.00, 0.62, 0.45), vec3f(0.34, 0.71, 0.91),
        vec3f(0.00, 0.45, 0.70), vec3f(0.80, 0.47, 0.65), vec3f(0.90, 0.62, 0.00), vec3f(0.55, 0.55, 0.58),
        vec3f(1.0));
    return colors[min(i, 8u)];
}
