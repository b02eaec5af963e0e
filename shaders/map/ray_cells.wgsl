// Rays kept by cells of the light's image, so that each triangle is brought only to those that it may block: the irregular z-buffer
// (Johnson, Lee, Burns, Mark 2005; Aila, Laine 2004). Cells cover that box of the light's image which the rays lie in. Who includes
// this says how many there are along each side (`cells_side`), and how many pixels has the picture that large triangles are drawn
// into (`boxes_side`).

// The first ray of each cell, from 1 on.
var<storage, read_write> cells: array<atomic<u32>>;
// Triangles to draw: the number, the first and the last pixel that may hold a ray of theirs, x + 65536 y, and the image's number.
var<storage, read_write> boxes: array<vec4u>;
var<storage, read> drawn_boxes: array<vec4u>;

// The rays' box in the light's image.
struct Bounds {
    low: vec2f,
    size: vec2f,
}

// From the largest 1 - u, 1 - v, u and v of all rays.
fn bounds_from(found: vec4f) -> Bounds {
    let low = 1.0 - found.xy;
    return Bounds(low, max(found.zw - low, vec2f(1e-6)));
}

// Where a place of the light's image lies in the bounds, 0 to 1.
fn share_of(bounds: Bounds, u: vec2f) -> vec2f {
    return saturate((u - bounds.low) / bounds.size);
}

fn cell_at(share: vec2f) -> vec2u {
    return vec2u(clamp(share * f32(cells_side()), vec2f(0.0), vec2f(f32(cells_side()) - 1.0)));
}

// Whether a triangle leaves a part of the image alone, by its edge functions in the middle of it and how much they change from there.
fn passes_by(middle: vec3f, spread: vec3f) -> bool {
    return any(middle + spread < vec3f(0.0)) && any(middle - spread > vec3f(0.0));
}

fn boxed(triangle: u32, first: vec2u, last: vec2u, image: u32) -> vec4u {
    return vec4u(triangle, first.x + 65536u * first.y, last.x + 65536u * last.y, image);
}

struct BoxCaster {
    @builtin(position) clip: vec4f,
    @location(0) @interpolate(flat) triangle: u32,
    @location(1) @interpolate(flat) image: u32,
}

@vertex
fn box_caster(@builtin(vertex_index) index: u32) -> BoxCaster {
    let box = drawn_boxes[index / 6u];
    let low = vec2f(vec2u(box.y & 65535u, box.y >> 16u)) / f32(boxes_side());
    let high = vec2f(vec2u(box.z & 65535u, box.z >> 16u) + 1u) / f32(boxes_side());
    let right = (0x32u >> (index % 6u) & 1u) == 1u;
    let down = (0x2cu >> (index % 6u) & 1u) == 1u;
    let corner = vec2f(select(low.x, high.x, right), select(low.y, high.y, down));
    return BoxCaster(vec4f(2.0 * corner.x - 1.0, 1.0 - 2.0 * corner.y, 0.5, 1.0), box.x, box.w);
}
