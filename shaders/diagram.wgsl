//!include lib/frame.wgsl
// Draws the strokes of a diagram: two squares of side 1 beside each other, fitted into the picture.

struct Stroke {
    start: vec2f,
    end: vec2f,
    // Place on the colour ramp; 0: no stroke.
    value: f32,
    padding: f32,
}

var map_out: texture_storage_2d<r32float, write>;
var<storage, read> strokes: array<Stroke>;

@compute @workgroup_size(8, 8)
fn draw_diagram(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= frame.size.x || id.y >= frame.size.y {
        return;
    }
    let size = vec2f(frame.size);
    let pixel = max(2.0 / size.x, 1.0 / size.y);
    let here = (vec2f(id.xy) + 0.5 - 0.5 * size) * pixel + vec2f(1.0, 0.5);
    var value = 0.0;
    for (var i = 0u; i < arrayLength(&strokes); i++) {
        let s = strokes[i];
        let d = s.end - s.start;
        let t = saturate(dot(here - s.start, d) / max(dot(d, d), 1e-20));
        let far = distance(here, s.start + t * d) / pixel;
        let wide = max(1.0, 0.0022 / pixel);
        // Later strokes lie above earlier ones; each stays in its half.
        if s.value > 0.0 && far < wide && (here.x < 1.0) == (0.5 * (s.start.x + s.end.x) < 1.0) {
            value = mix(value, s.value, saturate(wide - far + 0.5));
        }
    }
    textureStore(map_out, id.xy, vec4f(value));
}
