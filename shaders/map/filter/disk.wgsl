//!include map/past.wgsl
// Taps in a disk, for filters.

var<uniform> turning: NoiseParams;
var<uniform> past: Past;
var blue_noise: texture_2d<f32>;

// Vogel's spiral: the golden angle between neighbours, equal areas. Tap i of n.
fn in_disk(i: u32, n: f32, radius: f32, turn: f32) -> vec2f {
    let r = radius * sqrt((f32(i) + 0.5) / n);
    let angle = f32(i) * 2.3999632 + turn;
    return r * vec2f(cos(angle), sin(angle));
}

// Taps in a square from -1 to 1, even along x, by the golden ratio along y, so that both sides are covered evenly (a Fibonacci lattice).
// A turn moves all of them around.
fn in_square(i: u32, n: f32, turn: f32) -> vec2f {
    let shift = turn / 6.2831853;
    return 2.0 * fract(vec2f((f32(i) + 0.5) / n + shift, (f32(i) + 0.5) * 0.618034 + 5.0 * shift)) - 1.0;
}

// The angle by which a pixel turns its taps in this frame.
fn turn_of(pixel: vec2u) -> f32 {
    if turning.rotate == 0u {
        return 0.0;
    }
    var turn = 0.0;
    switch turning.noise {
        case noise_ign: {
            // Jimenez 2014: any 3 × 3 neighbours have nearly all angles. The shift from frame to frame keeps that.
            let p = vec2f(pixel) + 5.588238 * f32(past.frames % 64u);
            turn = fract(52.9829189 * fract(0.06711056 * p.x + 0.00583715 * p.y));
        }
        case noise_blue: {
            // Frames follow one another by the golden ratio.
            turn = fract(textureLoad(blue_noise, pixel % textureDimensions(blue_noise), 0).x + 0.618034 * f32(past.frames % 64u));
        }
        default: {
            turn = f32(hash(pixel.x + hash(pixel.y + hash(frame.seed + 0x9e3779b9u * past.frames)))) / 4294967296.0;
        }
    }
    return 6.2831853 * turn;
}
