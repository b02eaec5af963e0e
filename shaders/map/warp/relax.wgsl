// Moves the nodes of map/warp/node_grid.wgsl until the cells' areas follow their weights: one workgroup takes all steps, with
// barriers in between. Places are in cells of the regular grid here, so that areas are 1 at the start.
//
// A cell's four corner triangles (its halves along both diagonals) each shall have half the area A* that the cell's weight
// asks for. What is made small is the potential
//     Π = Σ over cells ½ Σ over triangles (A - ½A* ln A) + ½ smoothing Σ over nodes |p - mean of p's neighbours|²
// less the constant that makes its first sum 0 where all areas are as wanted. The logarithm lets no triangle turn over.

const relax_threads = 256u;
// Share of the last step that goes on: without it, wide grids take many times the steps.
const momentum = 0.9;

// Nodes' places, then their moves; fem-grid: further vectors of that length.
var<storage, read_write> solver: array<vec2f>;
// What share of the map's area each cell shall have; their mean is 1.
var<storage, read_write> weights: array<f32>;
// Number of steps taken; the potential before the first and after each.
var<storage, read_write> energies: array<f32>;
// As `grid_nodes`.
var<storage, read_write> placed_nodes: array<vec2f>;

var<workgroup> gathered: array<vec2f, 256>;
var<workgroup> gathered_all: vec2f;

// The sum of x and the least y of all threads, for all of them.
fn gather(index: u32, own: vec2f) -> vec2f {
    workgroupBarrier();
    gathered[index] = own;
    workgroupBarrier();
    for (var half = relax_threads / 2u; half > 0u; half /= 2u) {
        if index < half {
            let other = gathered[index + half];
            gathered[index] = vec2f(gathered[index].x + other.x, min(gathered[index].y, other.y));
        }
        workgroupBarrier();
    }
    if index == 0u {
        gathered_all = gathered[0];
    }
    return workgroupUniformLoad(&gathered_all);
}

fn node_count() -> u32 {
    return (grid_side() + 1u) * (grid_side() + 1u);
}

fn node_place(node: u32) -> vec2u {
    return vec2u(node % (grid_side() + 1u), node / (grid_side() + 1u));
}

fn node_at(place: vec2u) -> u32 {
    return place.y * (grid_side() + 1u) + place.x;
}

// In which directions a node may move.
fn free_of(place: vec2u) -> vec2f {
    return select(vec2f(0.0), vec2f(1.0), (place > vec2u(0u)) & (place < vec2u(grid_side())));
}

fn put_regular(index: u32) {
    for (var i = index; i < node_count(); i += relax_threads) {
        solver[i] = vec2f(node_place(i));
        solver[node_count() + i] = vec2f(0.0);
    }
    storageBarrier();
}

fn put_out(index: u32) {
    storageBarrier();
    for (var i = index; i < node_count(); i += relax_threads) {
        placed_nodes[i] = solver[i] / f32(grid_side());
    }
}

// Weights with a mean of 1, or 1 each where there are none; `spare`: a share of their mean that each has on top.
fn even_out(index: u32, spare: f32) {
    let cells = grid_side() * grid_side();
    var sum = 0.0;
    for (var i = index; i < cells; i += relax_threads) {
        sum += weights[i];
    }
    let mean = gather(index, vec2f(sum, 0.0)).x / f32(cells);
    for (var i = index; i < cells; i += relax_threads) {
        weights[i] = select((weights[i] / mean + spare) / (1.0 + spare), 1.0, mean <= 0.0);
    }
    storageBarrier();
}

fn corner_offset(k: u32) -> vec2u {
    return vec2u(u32(k == 1u || k == 2u), u32(k >= 2u));
}

// A node's place after a share of its move. With none the move is not read: it may be being written.
fn moved(i: u32, share: f32) -> vec2f {
    if share == 0.0 {
        return solver[i];
    }
    return solver[i] + share * solver[node_count() + i];
}

// A cell's corners after a share of their moves.
fn quadrangle(cell: vec2u, share: f32) -> array<vec2f, 4> {
    var c: array<vec2f, 4>;
    for (var k = 0u; k < 4u; k++) {
        c[k] = moved(node_at(cell + corner_offset(k)), share);
    }
    return c;
}

// Area of the triangle at a corner.
fn corner_area(c: array<vec2f, 4>, k: u32) -> f32 {
    let at = c[k];
    return 0.5 * cross2(c[(k + 1u) & 3u] - at, c[(k + 3u) & 3u] - at);
}

// The derivative of the area of a triangle a, b, c by a.
fn area_slope(b: vec2f, c: vec2f) -> vec2f {
    return 0.5 * vec2f(b.y - c.y, c.x - b.x);
}

// By corner k: the derivative of the area of the triangle at the corner before it, at itself, and after it.
fn slope_of(c: array<vec2f, 4>, k: u32, triangle: u32) -> vec2f {
    let next = c[(k + 1u) & 3u];
    let across = c[(k + 2u) & 3u];
    let before = c[(k + 3u) & 3u];
    switch triangle {
        case 0u: {
            return area_slope(across, before);
        }
        case 1u: {
            return area_slope(next, before);
        }
        default: {
            return area_slope(next, across);
        }
    }
}

// From the mean of its neighbours to a node, after a share of the moves; on the rim along it only.
fn bend(place: vec2i, share: f32) -> vec2f {
    if any(place < vec2i(0)) || any(place > vec2i(i32(grid_side()))) {
        return vec2f(0.0);
    }
    let free = free_of(vec2u(place));
    if all(free == vec2f(0.0)) {
        return vec2f(0.0);
    }
    let i = node_at(vec2u(place));
    let row = grid_side() + 1u;
    var sum = vec2f(0.0);
    if free.x > 0.0 {
        sum += moved(i - 1u, share) + moved(i + 1u, share);
    }
    if free.y > 0.0 {
        sum += moved(i - row, share) + moved(i + row, share);
    }
    return free * (moved(i, share) - sum / (2.0 * (free.x + free.y)));
}

// How much of a neighbour's mean a node is: the neighbour lies at `place`, in direction 0 (x) or 1 (y).
fn share_of_mean(place: vec2i, direction: u32) -> f32 {
    let inner = (place > vec2i(0)) & (place < vec2i(i32(grid_side())));
    if all(inner) {
        return 0.25;
    }
    return select(0.0, 0.5, inner[direction]);
}

// The potential after a share of the moves, and the least area of any triangle.
fn potential(index: u32, share: f32, smoothing: f32) -> vec2f {
    var sum = 0.0;
    var least = 1e30;
    let side = grid_side();
    for (var i = index; i < side * side; i += relax_threads) {
        let c = quadrangle(vec2u(i % side, i / side), share);
        let wanted = 0.5 * weights[i];
        for (var k = 0u; k < 4u; k++) {
            let area = corner_area(c, k);
            let ratio = max(area, 1e-20) / wanted;
            sum += 0.5 * wanted * (ratio - 1.0 - log(ratio));
            least = min(least, area);
        }
    }
    if smoothing > 0.0 {
        for (var i = index; i < node_count(); i += relax_threads) {
            let b = bend(vec2i(node_place(i)), share);
            sum += 0.5 * smoothing * dot(b, b);
        }
    }
    return gather(index, vec2f(sum, least));
}

// Where a node goes: against the potential's slope, by its own curvature (a Jacobi step of its 2 × 2 block), times `rate`.
fn step_of(i: u32, rate: f32, smoothing: f32, floor: f32) -> vec2f {
    let place = node_place(i);
    let side = grid_side();
    let free = free_of(place);
    if all(free == vec2f(0.0)) {
        return vec2f(0.0);
    }
    var slope = vec2f(0.0);
    // xx, xy, yy.
    var curvature = vec3f(0.0);
    for (var k = 0u; k < 4u; k++) {
        let cell = vec2i(place) - vec2i(corner_offset(k));
        if any(cell < vec2i(0)) || any(cell >= vec2i(i32(side))) {
            continue;
        }
        let c = quadrangle(vec2u(cell), 0.0);
        let wanted = 0.5 * weights[u32(cell.y) * side + u32(cell.x)];
        for (var t = 0u; t < 3u; t++) {
            let area = corner_area(c, (k + t + 3u) & 3u);
            let g = slope_of(c, k, t);
            slope += 0.5 * (1.0 - wanted / area) * g;
            curvature += 0.5 * wanted / (area * area) * vec3f(g.x * g.x, g.x * g.y, g.y * g.y);
        }
    }
    if smoothing > 0.0 {
        let p = vec2i(place);
        let x = vec2i(1, 0);
        let y = vec2i(0, 1);
        slope += smoothing * (bend(p, 0.0)
            - share_of_mean(p - x, 0u) * bend(p - x, 0.0) - share_of_mean(p + x, 0u) * bend(p + x, 0.0)
            - share_of_mean(p - y, 1u) * bend(p - y, 0.0) - share_of_mean(p + y, 1u) * bend(p + y, 0.0));
        curvature += smoothing * vec3f(1.25, 0.0, 1.25);
    }
    var way: vec2f;
    if free.x * free.y > 0.0 {
        let det = curvature.x * curvature.z - curvature.y * curvature.y;
        way = -vec2f(curvature.z * slope.x - curvature.y * slope.y, curvature.x * slope.y - curvature.y * slope.x)
            / max(det, 1e-20);
    } else {
        way = -slope / max(curvature.xz, vec2f(1e-20));
    }
    way = free * (rate * way + momentum * solver[node_count() + i]);
    // No triangle may lose more than a third of what it has above the floor to each of its corners.
    var least = 1.0;
    for (var k = 0u; k < 4u; k++) {
        let cell = vec2i(place) - vec2i(corner_offset(k));
        if any(cell < vec2i(0)) || any(cell >= vec2i(i32(side))) {
            continue;
        }
        let c = quadrangle(vec2u(cell), 0.0);
        for (var t = 0u; t < 3u; t++) {
            let loss = -dot(slope_of(c, k, t), way);
            if loss > 0.0 {
                least = min(least, 0.3 * (corner_area(c, (k + t + 3u) & 3u) - floor) / loss);
            }
        }
    }
    return way * least;
}

// `rate`: how far to go of each node's own best step; `floor`: the least area of a triangle, 0.5 at the start. A step
// that raises the potential or leaves a triangle too small is halved until it does not.
fn relax(index: u32, steps: u32, rate: f32, smoothing: f32, floor: f32) {
    put_regular(index);
    var now = potential(index, 0.0, smoothing).x;
    if index == 0u {
        energies[1] = now;
    }
    var taken = 0u;
    var gone_on = false;
    for (var i = 0u; i < steps; i++) {
        for (var v = index; v < node_count(); v += relax_threads) {
            solver[node_count() + v] = step_of(v, rate, smoothing, floor);
        }
        storageBarrier();
        var share = 1.0;
        var better = false;
        for (var k = 0u; k < 12u; k++) {
            let then = potential(index, share, smoothing);
            if then.x < now && then.y > floor {
                now = then.x;
                better = true;
                break;
            }
            share *= 0.5;
        }
        if !better {
            // Not even without what goes on from the last step.
            if !gone_on {
                break;
            }
            share = 0.0;
        }
        gone_on = better;
        storageBarrier();
        for (var v = index; v < node_count(); v += relax_threads) {
            let way = share * solver[node_count() + v];
            solver[v] += way;
            solver[node_count() + v] = way;
        }
        storageBarrier();
        taken++;
        if index == 0u {
            energies[taken + 1u] = now;
        }
    }
    if index == 0u {
        energies[0] = f32(taken);
    }
    put_out(index);
}
