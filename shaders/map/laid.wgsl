// Maps laid out in the picture, as shaders in map/choose/ do it for techniques that show something over them.

struct Laid {
    // Whether a map lies there.
    inside: bool,
    layer: u32,
    // In its map, texels.
    place: vec2f,
    // Texels a pixel.
    scale: f32,
    // Close to the border between two maps.
    rim: bool,
}
