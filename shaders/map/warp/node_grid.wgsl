// A warp given by nodes: a regular grid of cells over the light's image, each of which becomes the quadrangle between its
// four nodes in the map (bilinear in a cell). Includers write `fn grid_side() -> u32`: the number of cells along a side.

// Where the nodes lie in the map, shares of its sides; a row after the other, grid_side() + 1 a row. Nodes on the rim
// stay on their side, corners in theirs.
var<storage, read> grid_nodes: array<vec2f>;
// The cell in which each place of a raster of table_side()² places over the map lies: where searches start.
var<storage, read> cell_table: array<u32>;

fn warp_bends() -> f32 {
    return f32(grid_side());
}

fn table_side() -> u32 {
    return 2u * grid_side();
}

// The corners of a cell, around it from its upper left one.
fn corners_of(cell: vec2u) -> array<vec2f, 4> {
    let row = grid_side() + 1u;
    let i = cell.y * row + cell.x;
    return array<vec2f, 4>(grid_nodes[i], grid_nodes[i + 1u], grid_nodes[i + row + 1u], grid_nodes[i + row]);
}

fn cross2(a: vec2f, b: vec2f) -> f32 {
    return a.x * b.y - a.y * b.x;
}

fn cell_before(u: vec2f) -> vec2u {
    return min(vec2u(saturate(u) * f32(grid_side())), vec2u(grid_side() - 1u));
}

fn warp(u: vec2f) -> vec2f {
    let cell = cell_before(u);
    let f = u * f32(grid_side()) - vec2f(cell);
    let c = corners_of(cell);
    return mix(mix(c[0], c[1], f.x), mix(c[3], c[2], f.x), f.y);
}

fn warp_slope(u: vec2f) -> mat2x2f {
    let cell = cell_before(u);
    let f = u * f32(grid_side()) - vec2f(cell);
    let c = corners_of(cell);
    return f32(grid_side()) * mat2x2f(mix(c[1] - c[0], c[2] - c[3], f.y), mix(c[3] - c[0], c[2] - c[1], f.x));
}

// On which sides of the cell the place lies: -1 or 1 a direction, 0 within. Less than a ten-millionth of the map's side
// beyond an edge is within, so that rounding sends no search back and forth.
fn side_of(at: vec2f, cell: vec2u) -> vec2i {
    let c = corners_of(cell);
    var beyond: array<f32, 4>;
    for (var k = 0u; k < 4u; k++) {
        let edge = c[(k + 1u) & 3u] - c[k];
        // Edges run around the cell, which lies to their right.
        beyond[k] = -cross2(edge, at - c[k]) - 1e-7 * length(edge);
    }
    return vec2i(select(0, 1, beyond[1] > 0.0) - select(0, 1, beyond[3] > 0.0),
                 select(0, 1, beyond[2] > 0.0) - select(0, 1, beyond[0] > 0.0));
}

// The cell that a place in the map lies in: from cell to cell across the edge that hides it. On a grid without folds
// that arrives; on others it gives up.
fn find_cell(at: vec2f, start: u32) -> u32 {
    let side = grid_side();
    let last = vec2i(i32(side) - 1);
    var cell = vec2i(i32(start % side), i32(start / side));
    for (var i = 0u; i < 6u * side; i++) {
        var step = side_of(at, vec2u(cell));
        // Diagonal steps are fast but may go round in circles: one direction a time when it takes long.
        if i > 2u * side && step.x != 0 && step.y != 0 {
            step = select(vec2i(step.x, 0), vec2i(0, step.y), (i & 1u) == 1u);
        }
        let next = clamp(cell + step, vec2i(0), last);
        if all(next == cell) {
            break;
        }
        cell = next;
    }
    return u32(cell.y) * side + u32(cell.x);
}

// The share of its sides at which a place lies in a quadrangle. Of the quadratic equation's roots the one is wanted at
// which the Jacobian is positive, taken in the form that does not cancel.
fn unmix(at: vec2f, c: array<vec2f, 4>) -> vec2f {
    let e = c[1] - c[0];
    let f = c[3] - c[0];
    let g = c[2] - c[1] - f;
    let h = at - c[0];
    let k2 = cross2(g, f);
    let k1 = cross2(e, f) + cross2(h, g);
    let k0 = cross2(h, e);
    let root = sqrt(max(k1 * k1 - 4.0 * k2 * k0, 0.0));
    var v = -2.0 * k0 / (k1 + root);
    if k1 <= 0.0 {
        v = (root - k1) / (2.0 * k2);
    }
    v = clamp(v, 0.0, 1.0);
    let across = e + v * g;
    return vec2f(clamp(dot(h - v * f, across) / max(dot(across, across), 1e-30), 0.0, 1.0), v);
}

fn unwarp(at: vec2f) -> vec2f {
    let place = min(vec2u(saturate(at) * f32(table_side())), vec2u(table_side() - 1u));
    let cell = find_cell(at, cell_table[place.y * table_side() + place.x]);
    let side = grid_side();
    let xy = vec2u(cell % side, cell / side);
    return (vec2f(xy) + unmix(at, corners_of(xy))) / f32(side);
}

var<storage, read_write> table_made: array<u32>;

@compute @workgroup_size(8, 8)
fn make_table(@builtin(global_invocation_id) id: vec3u) {
    if id.x < table_side() && id.y < table_side() {
        let at = (vec2f(id.xy) + 0.5) / f32(table_side());
        let same = id.xy / 2u;
        table_made[id.y * table_side() + id.x] = find_cell(at, same.y * grid_side() + same.x);
    }
}
