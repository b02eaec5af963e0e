// A quadtree over a light with a size: level 0 is all of it, each level halves the sides. Samples lie at the corners of cells, and are
// numbered by the level that first has them. Cells are numbered level by level, and row by row within each.
// Tables and structs are made in src/techniques/area_adaptive.rs.

// Of levels 0 to 4.
const most_cells = 341u;
const most_samples = 289u;

struct SampleLevel {
    level: u32,
    // The last one.
    levels: u32,
    // The samples that this level adds: the first, and the one after the last.
    first: u32,
    end: u32,
    // Corners of the opaque triangles, and of all.
    opaque: u32,
    corners: u32,
    padding: vec2u,
}

struct LightTree {
    // Samples drawn: one a map.
    maps: u32,
    spare: u32,
    padding: vec2u,
    // A bit for each cell: whether it is split.
    split: vec4u,
    // Those samples, in order: the number of each, and 65536 times its weight.
    samples: array<vec4u, 73>,
}

var<uniform> sample_level: SampleLevel;
// Of each cell the numbers of the samples at its corners.
var<uniform> cell_corners: array<vec4u, most_cells>;

fn first_cell(level: u32) -> u32 {
    return ((1u << (2u * level)) - 1u) / 3u;
}

fn is_split(split: vec4u, cell: u32) -> bool {
    return (split[cell / 32u] >> (cell % 32u) & 1u) != 0u;
}

// Whether the cell `i` of a level is there: its parent is split.
fn is_there(split: vec4u, level: u32, i: u32) -> bool {
    if level == 0u {
        return true;
    }
    let side = 1u << level;
    return is_split(split, first_cell(level - 1u) + (i / side / 2u) * (side / 2u) + i % side / 2u);
}

// Whether it is there, and no smaller ones in its place. Cells of the last level are never split.
fn is_leaf(split: vec4u, level: u32, i: u32, levels: u32) -> bool {
    return is_there(split, level, i) && (level == levels || !is_split(split, first_cell(level) + i));
}
