//!include map/ray_cells.wgsl
// The exact raster: the rays of the texels that view samples need, kept by cells of the light's image, meet the triangles
// themselves. Before the warp triangles are flat: nothing is split, and the warp is asked for each ray only.
//
// Where more texels are needed than there is room for rays, the map is made band by band. In which order threads fill the
// lists changes nothing: every ray keeps the nearest of all that it meets.

struct Ray {
    // Where the texel's centre lies before the warp.
    u: vec2f,
    // Its number in the map, row by row.
    texel: u32,
    // The next ray of the cell, counted from 1 on; 0: none.
    next: u32,
}

var<uniform> casters: CasterParams;
var<storage, read_write> rays: array<Ray>;
var<storage, read> drawn_rays: array<Ray>;
var<storage, read> drawn_cells: array<u32>;
// A bit a texel: whether it needs a ray.
var<storage, read_write> texels_needed: array<atomic<u32>>;
// What each ray meets first, stored depth as bits; 0: nothing.
var<storage, read_write> nearest: array<atomic<u32>>;
var<storage, read> drawn_nearest: array<u32>;

struct RayBand {
    // 0: the whole map at once, void if its rays find no room. From 1 on: a part of it, if there was none.
    number: u32,
    // Its first word in `texels_needed`, and how many.
    first: u32,
    words: u32,
    padding: u32,
}

var<uniform> ray_band: RayBand;

// Places in `state.counters`: rays that the whole map needs, and triangles that a band leaves to the rasteriser.
const asked_count = 62u;
const box_count = 63u;

fn map_texels() -> u32 {
    return u32(map_side());
}

// Cells along each side of the rays' box, as in Rust.
fn cells_side() -> u32 {
    return clamp(map_texels() / 2u, 32u, 512u);
}

// Large triangles are drawn into a picture with a pixel a cell.
fn boxes_side() -> u32 {
    return cells_side();
}

fn bounds_of_rays() -> Bounds {
    var found: vec4f;
    for (var k = 0u; k < 4u; k++) {
        found[k] = bitcast<f32>(atomicLoad(&state.ray_bounds[k]));
    }
    return bounds_from(found);
}

fn need_ray(texel: vec2u) {
    let index = texel.y * map_texels() + texel.x;
    let bit = 1u << (index & 31u);
    if (atomicLoad(&texels_needed[index / 32u]) & bit) == 0u {
        atomicOr(&texels_needed[index / 32u], bit);
    }
}

// The texels that view samples look up.
@compute @workgroup_size(8, 8)
fn need_looked_up(@builtin(global_invocation_id) id: vec3u) {
    let s = view_sample(id.xy);
    if !s.valid {
        return;
    }
    let at = looked_up(s);
    // Rounding may take the look-up to the next texel.
    let slope = warp_slope(saturate(at.before));
    let spare = 1e-3 + map_side() * (2e-7 + abs(slope[0]) * at.rounding.x + abs(slope[1]) * at.rounding.y);
    let low = vec2i(floor(at.texel - min(spare, vec2f(1.0))));
    let high = vec2i(floor(at.texel + min(spare, vec2f(1.0))));
    for (var y = max(low.y, 0); y <= min(high.y, i32(map_texels()) - 1); y++) {
        for (var x = max(low.x, 0); x <= min(high.x, i32(map_texels()) - 1); x++) {
            need_ray(vec2u(vec2i(x, y)));
        }
    }
}

// All texels, to look at the map.
@compute @workgroup_size(8, 8)
fn need_all(@builtin(global_invocation_id) id: vec3u) {
    if light_view.idle == 0u && all(id.xy < vec2u(map_texels())) {
        need_ray(id.xy);
    }
}

// Makes the rays of a band.
@compute @workgroup_size(64)
fn make_rays(@builtin(global_invocation_id) id: vec3u) {
    if ray_band.number > 0u && atomicLoad(&state.counters[asked_count]) <= arrayLength(&rays) {
        return;
    }
    for (var i = ray_band.first + id.x; i < ray_band.first + ray_band.words; i += stride) {
        var bits = atomicLoad(&texels_needed[i]);
        let number = countOneBits(bits);
        if number == 0u {
            continue;
        }
        let first = atomicAdd(&state.ray_arguments[0], number);
        if first + number > arrayLength(&rays) {
            continue;
        }
        for (var k = first; k < first + number; k++) {
            rays[k].texel = 32u * i + firstTrailingBit(bits);
            bits &= bits - 1u;
            atomicStore(&nearest[k], 0u);
        }
    }
}

// Rays of the band: none where not all of them found room.
fn ray_number() -> u32 {
    let number = atomicLoad(&state.ray_arguments[0]);
    return select(number, 0u, number > arrayLength(&nearest));
}

var<workgroup> group_bounds: array<atomic<u32>, 4>;

// Traces the rays back through the warp, and finds their box.
@compute @workgroup_size(64)
fn trace_needed_rays(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) index: u32) {
    follow(light_view);
    let number = ray_number();
    var most = vec4f(0.0);
    for (var i = id.x; i < number; i += stride) {
        let texel = rays[i].texel;
        let u = unwarp((vec2f(vec2u(texel % map_texels(), texel / map_texels())) + 0.5) / map_side());
        rays[i].u = u;
        most = max(most, vec4f(1.0 - u, u));
    }
    for (var k = 0u; k < 4u; k++) {
        atomicMax(&group_bounds[k], bitcast<u32>(most[k]));
    }
    workgroupBarrier();
    if index < 4u {
        atomicMax(&state.ray_bounds[index], atomicLoad(&group_bounds[index]));
    }
}

// Sorts the rays into their cells.
@compute @workgroup_size(64)
fn sort_rays(@builtin(global_invocation_id) id: vec3u) {
    let number = ray_number();
    let bounds = bounds_of_rays();
    for (var i = id.x; i < number; i += stride) {
        let at = share_of(bounds, rays[i].u);
        let cell = cell_at(at);
        rays[i].next = atomicExchange(&cells[cell.y * cells_side() + cell.x], i + 1u);
        let tile = min(vec2u(at * 64.0), vec2u(63u));
        let word = 2u * tile.y + tile.x / 32u;
        let mark = 1u << (tile.x & 31u);
        if (atomicLoad(&state.image_tiles[word]) & mark) == 0u {
            atomicOr(&state.image_tiles[word], mark);
        }
    }
}

// The edge function of the edge from a to b (Olano, Greer 1997): the same digits from both of its sides, with opposite
// signs, so that no ray passes between neighbours (met in one pass, or by passes whose arithmetic is alike).
fn edge_function(a: vec3f, b: vec3f, before: bool) -> vec3f {
    if before {
        return cross(a, b);
    }
    return -cross(b, a);
}

struct Caster {
    // Corners in world space, in the light's clip space (x, y, w), of a paraboloid in the light's frame, and their linear depths.
    positions: array<vec3f, 3>,
    clips: array<vec3f, 3>,
    depths: vec3f,
    // Its vertices.
    triangle: vec3u,
}

fn caster_of(triangle: u32) -> Caster {
    let t = triangle_at(triangle).xyz;
    var c: Caster;
    c.triangle = t;
    for (var k = 0u; k < 3u; k++) {
        c.positions[k] = vertex_position(t[k]);
        if curved() {
            c.clips[k] = light_frame(light_view, c.positions[k]);
            c.depths[k] = length(c.clips[k]);
            continue;
        }
        c.clips[k] = light_clip(light_view, c.positions[k]).xyw;
        c.depths[k] = dot(light_view.axis, vec4f(c.positions[k], 1.0));
    }
    return c;
}

// Lets the rays of a cell, from the `first` one on, meet a triangle.
fn meet(c: Caster, cell: vec2u, first: u32) {
    // The cell's middle is the origin, so that places near by keep their digits.
    let bounds = bounds_of_rays();
    let origin = bounds.low + (vec2f(cell) + 0.5) / f32(cells_side()) * bounds.size;
    let ndc = vec2f(2.0 * origin.x - 1.0, 1.0 - 2.0 * origin.y);
    var a = vec3f(c.clips[0].xy - ndc * c.clips[0].z, c.clips[0].z);
    var b = vec3f(c.clips[1].xy - ndc * c.clips[1].z, c.clips[1].z);
    var d = vec3f(c.clips[2].xy - ndc * c.clips[2].z, c.clips[2].z);
    if curved() {
        a = c.clips[0];
        b = c.clips[1];
        d = c.clips[2];
    }
    let e0 = edge_function(b, d, precedes(c.positions[1], c.positions[2]));
    let e1 = edge_function(d, a, precedes(c.positions[2], c.positions[0]));
    let e2 = edge_function(a, b, precedes(c.positions[0], c.positions[1]));
    // How much they change from the middle to the cell's corners; a little more, for rounding.
    let half = 1.001 / f32(cells_side()) * bounds.size + 8e-7;
    // On a paraboloid they are quadratic in the place.
    let spread = vec3f(dot(abs(e0.xy), half), dot(abs(e1.xy), half), dot(abs(e2.xy), half));
    if !curved() && passes_by(vec3f(e0.z, e1.z, e2.z), spread) {
        return;
    }
    // Where some corners lie behind the light, so does a part of what is within the edges.
    let facing = select(0.0, dot(a, e0), curved() || min(min(a.z, b.z), d.z) <= 0.0);
    let light = frame.light_position;
    if frame.light_kind != directional
        && edge_on(c.positions[0] - light, c.positions[1] - light, c.positions[2] - light, length(light)) {
        return;
    }
    // A light's frame may be mirrored, and then clip space is not.
    let turned = curved() && dot(cross(light_view.row_x.xyz, light_view.row_y.xyz), light_view.axis.xyz) > 0.0;
    let front = casters.cull != select(cull_front, cull_back, turned) && facing >= 0.0;
    let back = casters.cull != select(cull_back, cull_front, turned) && facing <= 0.0;
    let low = min(min(c.depths.x, c.depths.y), c.depths.z);
    let high = max(max(c.depths.x, c.depths.y), c.depths.z);
    var i = first;
    while i != 0u {
        let ray = drawn_rays[i - 1u];
        var at = vec3f(2.0 * (ray.u.x - origin.x), -2.0 * (ray.u.y - origin.y), 1.0);
        if curved() {
            at = paraboloid_ray(light_view, vec2f(2.0 * ray.u.x - 1.0, 1.0 - 2.0 * ray.u.y));
        }
        let e = vec3f(dot(e0, at), dot(e1, at), dot(e2, at));
        let sum = e.x + e.y + e.z;
        if sum != 0.0 && ((front && min(min(e.x, e.y), e.z) >= 0.0) || (back && max(max(e.x, e.y), e.z) <= 0.0)) {
            let share = e / sum;
            let v = c.triangle;
            if !masked_out(materials[vertex_at(v.x).material],
                           share.x * texture_place(v.x) + share.y * texture_place(v.y) + share.z * texture_place(v.z)) {
                // Seen edge-on, the plane is met anywhere: no farther than the triangle goes.
                var z = clamp(dot(share, c.depths), low, high);
                if curved() {
                    z = min(length(share.x * a + share.y * b + share.z * d), high);
                }
                let depth = saturate(stored_depth(light_view, z));
                atomicMax(&nearest[i - 1u], bitcast<u32>(depth));
            }
        }
        i = ray.next;
    }
}

// Most cells of a box that is gone through at once; larger ones are left to the rasteriser.
const few = 64u;

// Counts a triangle that some view sample needs, once in all bands.
fn keep(triangle: u32) {
    let bit = 1u << (triangle & 31u);
    if (atomicOr(&state.triangles_met[triangle / 32u], bit) & bit) == 0u {
        atomicAdd(&state.counters[kept_count], 1u);
    }
}

// Finds the cells that each triangle may meet rays in.
@compute @workgroup_size(64)
fn box_triangles(@builtin(global_invocation_id) id: vec3u) {
    if ray_number() == 0u {
        return;
    }
    let bounds = bounds_of_rays();
    for (var i = id.x; i < frame.triangle_count; i += stride) {
        let corners = triangle_corners(triangle_at(i).xyz);
        let cut = cut_off(corners);
        var low = vec2f(1e9);
        var high = vec2f(-1e9);
        if curved() {
            let image = unwarped_box(array<vec3f, 3>(corners[0].position, corners[1].position, corners[2].position));
            low = image.low;
            high = image.high;
        } else {
            for (var k = 0u; k < cut.number; k++) {
                let u = unwarped_place(cut.corners[k].position).xy;
                low = min(low, u);
                high = max(high, u);
            }
        }
        // A little more, for rounding.
        low = (low - bounds.low - 4e-7) / bounds.size - 1e-5;
        high = (high - bounds.low + 4e-7) / bounds.size + 1e-5;
        if cut.number < 3u || !image_needed(low, high) {
            continue;
        }
        let first_cell = cell_at(low);
        let last_cell = cell_at(high);
        let size = last_cell - first_cell + 1u;
        if size.x * size.y > few {
            let at = atomicAdd(&state.counters[box_count], 1u);
            boxes[at] = boxed(i, first_cell, last_cell, 0u);
            keep(i);
            continue;
        }
        let caster = caster_of(i);
        var needed = false;
        for (var k = 0u; k < size.x * size.y; k++) {
            let cell = first_cell + vec2u(k % size.x, k / size.x);
            let first = atomicLoad(&cells[cell.y * cells_side() + cell.x]);
            if first != 0u {
                meet(caster, cell, first);
                needed = true;
            }
        }
        if needed {
            keep(i);
        }
    }
}

// Writes the draws of a band, and empties what the next one fills.
@compute @workgroup_size(1)
fn finish_band() {
    arguments[0] = 6u * atomicLoad(&state.counters[box_count]);
    arguments[1] = 1u;
    atomicStore(&state.counters[box_count], 0u);
    // No triangle was split.
    atomicStore(&state.counters[drawn_count], atomicLoad(&state.counters[kept_count]));
    if ray_band.number == 0u {
        atomicStore(&state.counters[asked_count], atomicLoad(&state.ray_arguments[0]));
    }
    atomicStore(&state.ray_arguments[0], ray_number());
    atomicStore(&state.ray_arguments[1], 1u);
    for (var i = 0u; i < 128u; i++) {
        atomicStore(&state.image_tiles[i], 0u);
    }
}

@fragment
fn box(in: BoxCaster) {
    let cell = vec2u(in.clip.xy);
    let first = drawn_cells[cell.y * cells_side() + cell.x];
    if first != 0u {
        meet(caster_of(in.triangle), cell, first);
    }
}

// A point a ray: its depth into its texel.
@vertex
fn ray_point(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    let texel = drawn_rays[index].texel;
    let at = (vec2f(vec2u(texel % map_texels(), texel / map_texels())) + 0.5) / map_side();
    return vec4f(2.0 * at.x - 1.0, 1.0 - 2.0 * at.y, bitcast<f32>(drawn_nearest[index]), 1.0);
}
