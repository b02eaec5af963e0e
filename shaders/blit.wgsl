// The picture onto the window, filtered where it was rendered smaller, and plain ground around it. One triangle covers the
// window; a scissor cuts out what is drawn again.

// Left, top, right and bottom in the window's pixels.
struct Placed {
    picture: vec4f,
    viewport: vec4f,
}

var picture: texture_2d<f32>;
var smooth_sampler: sampler;
var<uniform> placed: Placed;

// Where there is no picture.
const ground = vec3f(0.075, 0.082, 0.098);

@vertex
fn corner(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    let uv = vec2f(f32(index & 1u) * 2.0, f32(index >> 1u) * 2.0);
    return vec4f(uv.x * 2.0 - 1.0, 1.0 - uv.y * 2.0, 0.0, 1.0);
}

fn inside(at: vec2f, rect: vec4f) -> bool {
    return all(at >= rect.xy) && all(at < rect.zw);
}

@fragment
fn fill(@builtin(position) at: vec4f) -> @location(0) vec4f {
    if !inside(at.xy, placed.picture) || !inside(at.xy, placed.viewport) {
        return vec4f(ground, 1.0);
    }
    let uv = (at.xy - placed.picture.xy) / (placed.picture.zw - placed.picture.xy);
    return vec4f(textureSampleLevel(picture, smooth_sampler, uv, 0.0).rgb, 1.0);
}
