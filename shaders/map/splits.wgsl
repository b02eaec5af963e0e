//!include lib/frame.wgsl
//!include map/light_view.wgsl
// Cascades: light views that share the camera's depth range between them.

// The struct stands in src/map/cascades.rs too; a test compares the two field by field.
struct Fitting {
    count: u32,
    // Share of a cascade's depth in which the next one takes over.
    blend: f32,
    // 1: `fit` narrows the whole view to the samples; 0: the light views stand as Rust wrote them.
    narrow: u32,
    // Texels that stay free at each border.
    margin: f32,
    // Metres that stay free at each border, for the blur.
    reach: f32,
    // Smallest side of a box, metres.
    least: f32,
    // Share of the last frame's box and splits that stays.
    smoothing: f32,
    // Triangles: opaque, and all.
    opaque: u32,
    triangles: u32,
    // 1: `cull` fills an index buffer for each cascade; 0: all triangles go to all.
    culled: u32,
    padding: vec2u,
    // Sides of the cascades' maps, texels.
    sides: array<vec4u, 2>,
}

var<uniform> fitting: Fitting;
// Where the cascades meet, metres along the camera's axis: cascade i lies between split(i) and split(i + 1).
var<uniform> splits: array<vec4f, 3>;

fn split(i: u32) -> f32 {
    return splits[i / 4u][i % 4u];
}

fn cascade_of(depth: f32) -> u32 {
    var i = 0u;
    for (var k = 1u; k < fitting.count; k++) {
        i += u32(depth >= split(k));
    }
    return i;
}

// How much of the next cascade is mixed in, 0 to 1.
fn blend_of(depth: f32, i: u32) -> f32 {
    let end = split(i + 1u);
    let width = fitting.blend * (end - split(i));
    if i + 1u >= fitting.count || width <= 0.0 {
        return 0.0;
    }
    return saturate(1.0 - (end - depth) / width);
}
