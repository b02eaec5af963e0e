//!include lib/direct.wgsl
// Adds what one light gives the surfaces of the picture to what others give them.

var visibility: texture_2d<f32>;
// Irradiance of each pixel by light that surfaces throw back.
var indirect: texture_2d<f32>;

// Below the largest number of 16 bits, also of 16 lights together, each with what surfaces throw back.
const most = 2000.0;

// Corner of a triangle that covers the picture.
@vertex
fn cover(@builtin(vertex_index) corner: u32) -> @builtin(position) vec4f {
    return vec4f(f32(corner & 1u) * 4.0 - 1.0, f32(corner >> 1u) * 4.0 - 1.0, 0.0, 1.0);
}

@fragment
fn add(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let s = load_surface(vec2u(at.xy));
    if !s.valid {
        return vec4f(0.0);
    }
    return vec4f(min(direct_light(s, textureLoad(visibility, s.pixel, 0).x), vec3f(most)), 0.0);
}

@fragment
fn add_indirect(@builtin(position) at: vec4f) -> @location(0) vec4f {
    return vec4f(min(textureLoad(indirect, vec2u(at.xy), 0).rgb, vec3f(most)), 0.0);
}
