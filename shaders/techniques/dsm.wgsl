//!include map/warp/single.wgsl
//!include map/warp/node_grid.wgsl
//!include map/warp/relax.wgsl
//!include map/warp/node_views.wgsl
// Jia, Luo, Zhang 2013, as far as Navratil 2015 (3.2.3, 4.2.2) tells of it: a plain map first; where its depth jumps lie
// silhouettes, and the grid gives them room. The rest is our reading.

var<uniform> dsm: DsmParams;
// The plain map of the same view and side; depth is linear.
var plain_map: texture_depth_2d;

fn grid_side() -> u32 {
    return dsm.grid;
}

// Whether depth jumps between a texel and one of its four neighbours. Where the map is empty nothing can be shadowed, so
// that the border of all there is makes no edge.
fn edge_at(texel: vec2i) -> bool {
    let last = i32(map_side()) - 1;
    let z = textureLoad(plain_map, texel, 0);
    if z <= 0.0 {
        return false;
    }
    let steps = array<vec2i, 4>(vec2i(1, 0), vec2i(-1, 0), vec2i(0, 1), vec2i(0, -1));
    for (var i = 0u; i < 4u; i++) {
        let other = textureLoad(plain_map, clamp(texel + steps[i], vec2i(0), vec2i(last)), 0);
        if other > 0.0 && abs(z - other) > dsm.depth_threshold {
            return true;
        }
    }
    return false;
}

// The first texel of a row or column of cells.
fn first_texel(cell: u32) -> u32 {
    return cell * u32(map_side()) / grid_side();
}

var<workgroup> edge_texels: atomic<u32>;

// What each cell weighs: the share of its texels on edges, and a floor. A workgroup a cell.
@compute @workgroup_size(64)
fn importance(@builtin(workgroup_id) cell: vec3u, @builtin(local_invocation_index) index: u32) {
    let low = vec2u(first_texel(cell.x), first_texel(cell.y));
    let size = vec2u(first_texel(cell.x + 1u), first_texel(cell.y + 1u)) - low;
    var own = 0u;
    for (var i = index; i < size.x * size.y; i += 64u) {
        own += u32(edge_at(vec2i(low + vec2u(i % size.x, i / size.x))));
    }
    atomicAdd(&edge_texels, own);
    workgroupBarrier();
    if index == 0u {
        let share = f32(atomicLoad(&edge_texels)) / f32(max(size.x * size.y, 1u));
        weights[cell.y * grid_side() + cell.x] = dsm.floor + share;
    }
}

@compute @workgroup_size(256)
fn solve(@builtin(local_invocation_index) index: u32) {
    even_out(index, 0.0);
    // A hundredth of what a triangle has at first: enough for f32, and the logarithm keeps them well above.
    relax(index, dsm.iterations, dsm.relaxation, 0.0, 0.005);
}

// The mask in the middle of the picture.
fn edges_view(pixel: vec2u) -> f32 {
    let at = (vec2f(pixel) + 0.5 - 0.5 * vec2f(frame.size)) / square_scale() + 0.5;
    if any(at < vec2f(0.0)) || any(at >= vec2f(1.0)) {
        return drawn(white, 0.0);
    }
    // All texels of a pixel, so that no thin edge falls between.
    let size = map_side() / square_scale();
    let low = vec2i(at * map_side() - 0.5 * max(size - 1.0, 0.0));
    for (var y = 0; y < max(i32(size), 1); y++) {
        for (var x = 0; x < max(i32(size), 1); x++) {
            if edge_at(clamp(low + vec2i(x, y), vec2i(0), vec2i(i32(map_side()) - 1))) {
                return drawn(0u, 1.0);
            }
        }
    }
    return drawn(white, 0.05 + 0.5 * textureLoad(plain_map, vec2u(at * map_side()), 0));
}

fn inspect_warp(s: Surface) -> f32 {
    if frame.map == shows_edges {
        return edges_view(s.pixel);
    }
    return inspect_nodes(s);
}
