// The views that techniques with a grid of nodes have: the grid in the map, and how busy its cells are.

// The picture's pixels: bits, as below.
var<storage, read_write> drawing: array<atomic<u32>>;
var<storage, read> drawn_grid: array<u32>;
var<storage, read> cell_weights: array<f32>;

const line_bit = 1u;
const node_bit = 2u;
const fold_bit = 4u;

// A square fitted into the middle of the picture: the pixel of a place in it, and back.
fn square_scale() -> f32 {
    return f32(min(frame.size.x, frame.size.y)) / 1.04;
}

fn square_pixel(at: vec2f) -> vec2f {
    return (at - 0.5) * square_scale() + 0.5 * vec2f(frame.size);
}

fn mark(pixel: vec2f, radius: f32, bit: u32) {
    let low = vec2i(floor(pixel - radius));
    let high = vec2i(floor(pixel + radius));
    for (var y = max(low.y, 0); y <= min(high.y, i32(frame.size.y) - 1); y++) {
        for (var x = max(low.x, 0); x <= min(high.x, i32(frame.size.x) - 1); x++) {
            if distance(vec2f(vec2i(x, y)) + 0.5, pixel) <= max(radius, 0.71) {
                atomicOr(&drawing[u32(y) * frame.size.x + u32(x)], bit);
            }
        }
    }
}

fn mark_line(a: vec2f, b: vec2f, radius: f32, bit: u32) {
    let from_a = square_pixel(a);
    let to_b = square_pixel(b);
    let steps = clamp(ceil(max(abs(to_b.x - from_a.x), abs(to_b.y - from_a.y))), 1.0, 16384.0);
    for (var i = 0.0; i <= steps; i += 1.0) {
        mark(mix(from_a, to_b, i / steps), radius, bit);
    }
}

// A thread a cell: its edges, its nodes, and whether it is folded.
@compute @workgroup_size(8, 8)
fn draw_nodes(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= grid_side() || id.y >= grid_side() {
        return;
    }
    let c = corners_of(id.xy);
    var folded_over = false;
    for (var k = 0u; k < 4u; k++) {
        folded_over = folded_over || cross2(c[(k + 1u) & 3u] - c[k], c[(k + 3u) & 3u] - c[k]) <= 0.0;
    }
    let wide = f32(min(frame.size.x, frame.size.y)) / 1000.0;
    let node = clamp(0.12 * square_scale() / f32(grid_side()), 1.0, 3.5 * max(wide, 0.5));
    for (var k = 0u; k < 4u; k++) {
        let next = c[(k + 1u) & 3u];
        mark_line(c[k], next, 0.5 * wide, line_bit);
        if folded_over {
            mark_line(c[k], next, wide, fold_bit);
        }
        mark(square_pixel(c[k]), node, node_bit);
    }
}

fn nodes_view(pixel: vec2u) -> f32 {
    let bits = drawn_grid[pixel.y * frame.size.x + pixel.x];
    if (bits & node_bit) != 0u {
        // Red circles, as in Navratil 2015, figure 5.12.
        return drawn(0u, 1.0);
    }
    if (bits & fold_bit) != 0u {
        return drawn(1u, 1.0);
    }
    if (bits & line_bit) != 0u {
        return drawn(3u, 0.9);
    }
    let at = (vec2f(pixel) + 0.5 - 0.5 * vec2f(frame.size)) / square_scale() + 0.5;
    if any(at < vec2f(0.0)) || any(at >= vec2f(1.0)) {
        return drawn(white, 0.0);
    }
    return drawn(white, 0.05 + 0.5 * textureLoad(shadow_maps, vec2u(at * map_side()), 0, 0));
}

// Left the light's image, right the map: a cell's share of the weight over its share of the area, in orange above 1, in
// blue below, at full strength from 16 and 1/16 on.
fn cells_view(pixel: vec2u) -> f32 {
    let at = square_place(vec2f(pixel) + 0.5);
    let right = at.x >= 1.0;
    let place = select(at, at - vec2f(1.0, 0.0), right);
    if any(place < vec2f(0.0)) || any(place >= vec2f(1.0)) {
        return drawn(white, 0.0);
    }
    var u = place;
    if right {
        u = unwarp(place);
    }
    let side = grid_side();
    let cell = cell_before(u);
    var area = 1.0;
    if right {
        let c = corners_of(cell);
        area = 0.5 * cross2(c[2] - c[0], c[3] - c[1]) * f32(side * side);
    }
    let octaves = log2(max(cell_weights[cell.y * side + cell.x], 1e-6) / max(area, 1e-6));
    return drawn(select(4u, 0u, octaves > 0.0), abs(octaves) / 4.0);
}

fn inspect_nodes(s: Surface) -> f32 {
    switch frame.map {
        case shows_nodes: {
            return nodes_view(s.pixel);
        }
        case shows_cells: {
            return cells_view(s.pixel);
        }
        default: {
            return -1.0;
        }
    }
}
