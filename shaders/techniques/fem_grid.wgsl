//!include map/warp/single.wgsl
//!include map/warp/node_grid.wgsl
//!include map/warp/relax.wgsl
//!include map/warp/node_views.wgsl
// Navratil 2015, section 5.4.3: view samples bring their aliasing errors into the cells of a grid, and a cell whose error is
// K wants K times its area: e(A) = K A0/A shall be 1 (equation 5.2 as its text means it).

var<uniform> fem: FemGridParams;
// A cell's sum of errors in 64 bits, low word first; in 256ths.
var<storage, read_write> errors_found: array<atomic<u32>>;
var<storage, read> error_sums: array<u32>;
var<storage, read> energy_curve: array<f32>;

fn grid_side() -> u32 {
    return fem.grid;
}

// Adds each view sample's aliasing error, as it is without the warp, to its cell.
@compute @workgroup_size(8, 8)
fn cell_errors(@builtin(global_invocation_id) id: vec3u) {
    let s = view_sample(id.xy);
    if !s.valid {
        return;
    }
    let clip = light_clip(light_view, s.position);
    let u = light_texel(light_view, clip) / light_view.resolution;
    if !(all(u >= vec2f(0.0)) && all(u <= vec2f(1.0))) {
        return;
    }
    let steps = pixel_steps(s);
    let m = longest_extent(along(light_view, steps[0], clip).xy, along(light_view, steps[1], clip).xy);
    // A pixel that sees its surface edge-on must not outweigh all others.
    let own = u32(256.0 * clamp(m, 0.0, 1024.0));
    let cell = cell_before(u);
    let at = 2u * (cell.y * grid_side() + cell.x);
    let old = atomicAdd(&errors_found[at], own);
    if old > 0xffffffffu - own {
        atomicAdd(&errors_found[at + 1u], 1u);
    }
}

@compute @workgroup_size(256)
fn solve(@builtin(local_invocation_index) index: u32) {
    for (var i = index; i < grid_side() * grid_side(); i += relax_threads) {
        let sum = (f32(error_sums[2u * i]) + 4294967296.0 * f32(error_sums[2u * i + 1u])) / 256.0;
        weights[i] = select(sum, sqrt(sum), fem.error == error_sqrt);
    }
    even_out(index, fem.floor);
    if fem.variant == variant_seed_stiffness {
        stiffness(index);
    } else {
        // Triangles keep a tenth of the half that they have at first.
        relax(index, fem.steps, 0.5, fem.smoothing, 0.05);
    }
}

// The direct stiffness method. Element c pushes its corners with the force (e(A0) - 1) dA/dp as it is on the regular grid;
// its edges are springs after Hooke, F = k x. The assembled system is solved for the displacements at once, by conjugate
// gradients. Forces are those of small displacements and these are not small: cells turn over, as nothing in a linear
// system keeps them from it.

// Derivative of a regular cell's area by its corner k.
fn regular_slope(k: u32) -> vec2f {
    return vec2f(corner_offset(k)) - 0.5;
}

// Assembled forces on a node.
fn force(place: vec2u) -> vec2f {
    var sum = vec2f(0.0);
    for (var k = 0u; k < 4u; k++) {
        let cell = vec2i(place) - vec2i(corner_offset(k));
        if all(cell >= vec2i(0)) && all(cell < vec2i(i32(grid_side()))) {
            sum += (weights[u32(cell.y) * grid_side() + u32(cell.x)] - 1.0) * regular_slope(k);
        }
    }
    return sum * free_of(place);
}

// Row of the assembled stiffness matrix times that vector of `solver`.
fn times_stiffness(place: vec2u, vector: u32) -> vec2f {
    let first = vector * node_count();
    let own = solver[first + node_at(place)];
    var sum = vec2f(0.0);
    for (var k = 0u; k < 4u; k++) {
        let cell = vec2i(place) - vec2i(corner_offset(k));
        if any(cell < vec2i(0)) || any(cell >= vec2i(i32(grid_side()))) {
            continue;
        }
        // Half of each spring to each cell beside it.
        let p = vec2u(cell);
        let beside = solver[first + node_at(p + corner_offset(k ^ 1u))];
        let below = solver[first + node_at(p + corner_offset(3u - k))];
        sum += 0.5 * (2.0 * own - beside - below);
    }
    return sum * free_of(place);
}

fn dot_all(index: u32, a: u32, b: u32) -> f32 {
    var sum = 0.0;
    let n = node_count();
    for (var i = index; i < n; i += relax_threads) {
        sum += dot(solver[a * n + i], solver[b * n + i]);
    }
    return gather(index, vec2f(sum, 0.0)).x;
}

// Vectors of `solver`: 1 displacements, 2 residual, 3 search direction, 4 its product.
fn stiffness(index: u32) {
    let n = node_count();
    put_regular(index);
    for (var i = index; i < n; i += relax_threads) {
        let f = force(node_place(i));
        solver[2u * n + i] = f;
        solver[3u * n + i] = f;
    }
    storageBarrier();
    var residual = dot_all(index, 2u, 2u);
    let first = residual;
    var taken = 0u;
    if index == 0u {
        energies[1] = first;
    }
    for (var step = 0u; step < 500u; step++) {
        if residual <= 1e-10 * first {
            break;
        }
        for (var i = index; i < n; i += relax_threads) {
            solver[4u * n + i] = times_stiffness(node_place(i), 3u);
        }
        storageBarrier();
        let rate = residual / dot_all(index, 3u, 4u);
        for (var i = index; i < n; i += relax_threads) {
            solver[n + i] += rate * solver[3u * n + i];
            solver[2u * n + i] -= rate * solver[4u * n + i];
        }
        storageBarrier();
        let next = dot_all(index, 2u, 2u);
        for (var i = index; i < n; i += relax_threads) {
            solver[3u * n + i] = solver[2u * n + i] + next / residual * solver[3u * n + i];
        }
        storageBarrier();
        residual = next;
        taken++;
        if index == 0u {
            energies[taken + 1u] = residual;
        }
    }
    if index == 0u {
        energies[0] = f32(taken);
    }
    for (var i = index; i < n; i += relax_threads) {
        // Nodes that leave the map would take its samples with them.
        solver[i] = clamp(solver[i] + solver[n + i], vec2f(0.0), vec2f(f32(grid_side())));
    }
    put_out(index);
}

// What the curve shows at a step that need not be whole: the potential over that before the first step. The stiffness
// method: the squared residual in ten decades.
fn curve_at(step: f32) -> f32 {
    let taken = energy_curve[0];
    let before = u32(clamp(floor(step), 0.0, taken));
    let after = u32(clamp(floor(step) + 1.0, 0.0, taken));
    let share = mix(energy_curve[1u + before], energy_curve[1u + after], fract(step)) / max(energy_curve[1], 1e-30);
    return select(share, 1.0 + log2(max(share, 1e-10)) / 33.3, fem.variant == variant_seed_stiffness);
}

// Steps to the right, the potential upwards from 0, lines every tenth.
fn energy_view(pixel: vec2u) -> f32 {
    let scale = square_scale();
    let at = (vec2f(pixel) + 0.5 - 0.5 * vec2f(frame.size)) / scale + 0.5;
    let wide = max(f32(frame.size.y) / 500.0, 1.0) / scale;
    if any(at < vec2f(-wide)) || any(at > vec2f(1.0 + wide)) {
        return drawn(white, 0.0);
    }
    let steps = max(energy_curve[0], 1.0);
    let here = curve_at(saturate(at.x) * steps);
    let beside = curve_at(saturate(at.x + 0.5 * wide) * steps);
    let before = curve_at(saturate(at.x - 0.5 * wide) * steps);
    let y = 1.0 - at.y;
    if y > min(min(here, beside), before) - 0.5 * wide && y < max(max(here, beside), before) + 0.5 * wide {
        return drawn(1u, 1.0);
    }
    let tenth = abs(fract(10.0 * at + 0.5) - 0.5) / 10.0;
    return drawn(white, select(0.05, 0.2, min(tenth.x, tenth.y) < 0.5 / scale));
}

fn inspect_warp(s: Surface) -> f32 {
    if frame.map == shows_energy {
        return energy_view(s.pixel);
    }
    return inspect_nodes(s);
}
