// What is known of the frames before this one.

struct Past {
    // The last frame's camera: world to clip space, and its place.
    view_proj: mat4x4f,
    eye: vec3f,
    // How many frames there are; 0: none, and nothing else is known.
    frames: u32,
}
