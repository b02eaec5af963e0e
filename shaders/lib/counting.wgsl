// How many view samples each texel of a technique's maps has.
// The struct stands in src/frame/analysis.rs too; a test compares the two field by field.

struct Counting {
    // Texels of one map, or of the largest.
    size: vec2u,
    // Maps, one after the other in `counts`, rows from the top.
    layers: u32,
    // Texels that this band of `counts` holds: the first, and how many.
    first: u32,
    count: u32,
    padding: u32,
    spare: vec2u,
    // Sides of the first eight maps where they are smaller, in the upper left corners; 0: as large.
    sides: array<vec4u, 2>,
}

var<uniform> counting: Counting;
var<storage, read_write> counts: array<atomic<u32>>;
