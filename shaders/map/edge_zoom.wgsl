//!include lib/frame.wgsl
//!include lib/labels.wgsl
// A few texels around the place that the probed pixel looks up, enlarged: the comparisons with them for that pixel's surface, and where
// its shadow's edge is drawn through them.

struct Zoom {
    // Whether the probe meets a surface that is looked up.
    valid: bool,
    s: Surface,
    layer: u32,
    place: vec2f,
    // Texels a pixel.
    scale: f32,
}

const zoomed_texels = 12.0;

fn zoom(pixel: vec2u) -> Zoom {
    var z: Zoom;
    z.s = load_surface(probed_pixel());
    let size = vec2f(frame.size);
    z.scale = zoomed_texels / min(size.x, size.y);
    z.valid = z.s.valid;
    z.layer = select(0u, choose(z.s).layer, z.valid);
    let v = light_views[z.layer];
    let here = map_texel(v, light_clip(v, z.s.position));
    z.place = (vec2f(pixel) + 0.5 - 0.5 * size) * z.scale + select(vec2f(0.5), floor(here) + 0.5, z.valid);
    return z;
}

// Whether a place lies on the grid of texels.
fn on_grid(z: Zoom) -> bool {
    return any(abs(fract(z.place + 0.5) - 0.5) < vec2f(0.5 * z.scale));
}

// Light with the receiver `r` there, and each texel's own comparison in its middle.
fn zoomed_light(z: Zoom, own: f32, drawn_light: f32) -> f32 {
    let middle = distance(fract(z.place), vec2f(0.5)) < 0.16;
    let v = select(drawn_light, own, middle);
    if on_grid(z) {
        return drawn(white, 0.4);
    }
    return drawn(white, select(0.12, 0.08, middle) + select(0.65, 0.85, middle) * v);
}
