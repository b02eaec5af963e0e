// Rays kept by cells of the light's image, so that each triangle is brought only to those that it may block: the irregular z-buffer
// (Johnson, Lee, Burns, Mark 2005; Aila, Laine 2004). Cells cover that box of the light's image which the rays lie in. Who includes
// this says how many there are along each side (`cells_side`).

// The first ray of each cell, from 1 on.
var<storage, read_write> cells: array<atomic<u32>>;
// Triangles to draw: the number, the first and the last cell that may hold a ray of theirs, x + 65536 y, and the image's number.
var<storage, read_write> boxes: array<vec4u>;
var<storage, read> drawn_boxes: array<vec4u>;

// Most cells of a box that is gone through at once; larger ones are left to the rasteriser.
const few = 64u;

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

// Whether a triangle, by its edge functions around a cell's middle, leaves the cell alone: `half` is half the cell's size as the
// functions have it, `spare` what rounding may have changed of each.
fn passes_by(e0: vec3f, e1: vec3f, e2: vec3f, half: vec2f, spare: vec3f) -> bool {
    let spread = vec3f(dot(abs(e0.xy), half), dot(abs(e1.xy), half), dot(abs(e2.xy), half)) + spare;
    let middle = vec3f(e0.z, e1.z, e2.z);
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

// Drawn into a picture with a pixel a cell.
@vertex
fn box_caster(@builtin(vertex_index) index: u32) -> BoxCaster {
    let box = drawn_boxes[index / 6u];
    let low = vec2f(vec2u(box.y & 65535u, box.y >> 16u)) / f32(cells_side());
    let high = vec2f(vec2u(box.z & 65535u, box.z >> 16u) + 1u) / f32(cells_side());
    let right = (0x32u >> (index % 6u) & 1u) == 1u;
    let down = (0x2cu >> (index % 6u) & 1u) == 1u;
    let corner = vec2f(select(low.x, high.x, right), select(low.y, high.y, down));
    return BoxCaster(vec4f(2.0 * corner.x - 1.0, 1.0 - 2.0 * corner.y, 0.5, 1.0), box.x, box.w);
}
