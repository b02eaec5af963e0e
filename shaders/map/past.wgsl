//!include lib/frame.wgsl
//!include lib/gbuffer.wgsl
// What is known of the frames before this one.

struct Past {
    // The last frame's camera: world to clip space, and its place.
    view_proj: mat4x4f,
    eye: vec3f,
    // How many frames there are; 0: none, and nothing else is known.
    frames: u32,
    // Along its view, and 1 if it is orthographic.
    forward: vec3f,
    orthographic: u32,
}

// The camera at work, for the next frame.
fn now_past(frames: u32) -> Past {
    return Past(frame.view_proj, frame.eye, frames, frame.forward, frame.orthographic);
}

// How far off a place is of a frame's camera: from the eye, or along an orthographic view, whose eye means nothing.
fn off_camera(camera: Past, position: vec3f) -> f32 {
    return select(distance(position, camera.eye), dot(position - camera.eye, camera.forward), camera.orthographic == 1u);
}

// Cosine of the angle at which the last frame's camera saw a surface.
fn seen_before(past: Past, s: Surface) -> f32 {
    let way = select(s.position - past.eye, past.forward, past.orthographic == 1u);
    return abs(dot(s.normal, normalize(way)));
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
    let depth = select(clip.w, dot(position - past.eye, past.forward), past.orthographic == 1u);
    return vec3f(select(at, near, abs(at - near) < vec2f(1e-2)), depth);
}
