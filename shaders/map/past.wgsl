//!include lib/frame.wgsl
// What is known of the frames before this one.

struct Past {
    // The last frame's camera: world to clip space, and its place.
    view_proj: mat4x4f,
    eye: vec3f,
    // How many frames there are; 0: none, and nothing else is known.
    frames: u32,
}

// Where the last frame had a place of the world: pixels from the middle of its first one, exactly the same pixel where the
// camera rests, and the depth along its axis. Depth 0: nowhere.
fn place_before(past: Past, position: vec3f) -> vec3f {
    let clip = past.view_proj * vec4f(position, 1.0);
    if past.frames == 0u || clip.w <= 0.0 {
        return vec3f(0.0);
    }
    let at = (0.5 + vec2f(0.5, -0.5) * clip.xy / clip.w) * vec2f(frame.size) - 0.5;
    let near = round(at);
    return vec3f(select(at, near, abs(at - near) < vec2f(1e-2)), clip.w);
}
