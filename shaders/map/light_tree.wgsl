//!include map/narrow.wgsl
//!include lib/light_cells.wgsl
// What is decided of light samples on the GPU (Schwärzler, Mattausch, Scherzer, Wimmer 2012): where their maps look, which of them are
// drawn, and what each weighs.

var<uniform> sampling: AreaAdaptiveParams;
var<uniform> what: PlacesFitParams;
var<storage, read_write> growing: LightTree;
// Of each cell the pixels whose four samples disagree, and those of them beside which another four are seen; behind all cells the
// receivers of each level.
var<storage, read_write> tallies: array<u32>;
// Of each sample the arguments of what is run for it: a dispatch over the picture, a triangle over the map, opaque and masked casters.
var<storage, read_write> draws: array<u32>;
// Of each sample the view of the whole light, the extent of the receivers in it, and the view narrowed to them.
var<storage, read> whole_views: array<LightView>;
var<storage, read_write> extents: array<atomic<u32>>;
var<storage, read_write> place_views: array<LightView>;

const draw_words = 17u;

fn write_draws(k: u32, wanted: bool) {
    let at = draw_words * k;
    let on = select(0u, 1u, wanted);
    let groups = (frame.size + 7u) / 8u;
    let words = array<u32, 17>(
        groups.x, groups.y, on,
        3u, on, 0u, 0u,
        sample_level.opaque, on, 0u, 0u, 0u,
        sample_level.corners - sample_level.opaque, on, sample_level.opaque, 0u, 0u,
    );
    for (var i = 0u; i < draw_words; i++) {
        draws[at + i] = words[i];
    }
}

fn is_drawn(k: u32) -> bool {
    return draws[draw_words * k + 2u] != 0u;
}

// One workgroup: the first level's samples are drawn, no others yet.
@compute @workgroup_size(256)
fn begin(@builtin(local_invocation_index) i: u32) {
    for (var k = i; k < arrayLength(&draws) / draw_words; k += 256u) {
        write_draws(k, k < sample_level.end);
    }
    if i == 0u {
        growing.maps = 0u;
        growing.split = vec4u(0u);
    }
}

// A workgroup takes 64 × 64 pixels for one of the level's samples.
@compute @workgroup_size(8, 8)
fn place_receivers(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_id) local: vec3u) {
    let k = sample_level.first + group.z;
    if !is_drawn(k) {
        return;
    }
    let e = extent_in(whole_views[k], k, group.xy, local.xy, vec2f(0.0, 3.4e38));
    if e.most[0] >= 0.0 {
        for (var i = 0u; i < 6u; i++) {
            atomicMax(&extents[6u * k + i], bitcast<u32>(e.most[i] + 0.0));
        }
    }
}

// A thread a sample of the level.
@compute @workgroup_size(64)
fn narrow_places(@builtin(global_invocation_id) id: vec3u) {
    let k = sample_level.first + id.x;
    if k >= sample_level.end || !is_drawn(k) {
        return;
    }
    var v = whole_views[k];
    if what.fit != fit_scene {
        var most: array<f32, 6>;
        for (var i = 0u; i < 6u; i++) {
            most[i] = bitcast<f32>(atomicLoad(&extents[6u * k + i]));
        }
        v = narrowed(v, most);
    }
    place_views[k] = v;
}

fn too_coarse(cell: u32) -> bool {
    let apart = f32(tallies[2u * cell]);
    let edges = f32(tallies[2u * cell + 1u]);
    let receivers = f32(tallies[2u * most_cells + sample_level.level]);
    // Each step in the penumbra has two edges.
    let wide = sampling.criterion != criterion_gap || 2.0 * apart > sampling.gap * edges;
    return apart > sampling.tau * receivers && wide;
}

var<workgroup> splits: array<atomic<u32>, 4>;
var<workgroup> weights: array<atomic<u32>, most_samples>;

// One workgroup: splits cells of the level, and has the samples at the corners of the new ones drawn.
@compute @workgroup_size(256)
fn decide(@builtin(local_invocation_index) i: u32) {
    let level = sample_level.level;
    let cell = first_cell(level) + i;
    if i < 1u << (2u * level) && is_there(growing.split, level, i) && too_coarse(cell) {
        atomicOr(&splits[cell / 32u], 1u << (cell % 32u));
        let side = 1u << level;
        let corner = first_cell(level + 1u) + 2u * (i / side) * 2u * side + 2u * (i % side);
        for (var child = 0u; child < 4u; child++) {
            let corners = cell_corners[corner + (child & 1u) + (child >> 1u) * 2u * side];
            for (var c = 0u; c < 4u; c++) {
                atomicStore(&weights[corners[c]], 1u);
            }
        }
    }
    workgroupBarrier();
    if i < 4u {
        growing.split[i] |= atomicLoad(&splits[i]);
    }
    // The next level's come behind this one's.
    for (var k = sample_level.end + i; k < min(arrayLength(&draws) / draw_words, most_samples); k += 256u) {
        write_draws(k, atomicLoad(&weights[k]) != 0u);
    }
}

// One workgroup: lists the samples drawn. A cell that is not split gives its area to its corners in equal parts; areas are counted in
// quarters of the smallest cell's.
@compute @workgroup_size(256)
fn weigh(@builtin(local_invocation_index) i: u32) {
    let levels = sample_level.levels;
    for (var level = 0u; level <= levels; level++) {
        let cells = 1u << (2u * level);
        for (var c = i; c < cells; c += 256u) {
            if is_leaf(growing.split, level, c, levels) {
                let corners = cell_corners[first_cell(level) + c];
                for (var j = 0u; j < 4u; j++) {
                    atomicAdd(&weights[corners[j]], 1u << (2u * (levels - level)));
                }
            }
        }
    }
    workgroupBarrier();
    if i == 0u {
        var n = 0u;
        for (var k = 0u; k < most_samples; k++) {
            let weight = atomicLoad(&weights[k]);
            if weight > 0u {
                growing.samples[n / 4u][n % 4u] = k | (weight << 16u);
                n++;
            }
        }
        growing.maps = n;
    }
}

// A triangle over all of a map, as far as can be.
@vertex
fn cleared(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    return vec4f(f32(index & 1u) * 4.0 - 1.0, f32(index >> 1u) * 4.0 - 1.0, 0.0, 1.0);
}
