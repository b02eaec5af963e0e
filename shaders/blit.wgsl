// The picture onto the window: one triangle over the viewport, filtered where it was rendered smaller.

@group(0) @binding(0) var picture: texture_2d<f32>;
@group(0) @binding(1) var smooth_sampler: sampler;

struct Corner {
    @builtin(position) clip: vec4f,
    @location(0) uv: vec2f,
}

@vertex
fn corner(@builtin(vertex_index) index: u32) -> Corner {
    let uv = vec2f(f32(index & 1u) * 2.0, f32(index >> 1u) * 2.0);
    return Corner(vec4f(uv.x * 2.0 - 1.0, 1.0 - uv.y * 2.0, 0.0, 1.0), uv);
}

@fragment
fn fill(in: Corner) -> @location(0) vec4f {
    return vec4f(textureSampleLevel(picture, smooth_sampler, in.uv, 0.0).rgb, 1.0);
}
