//!include lib/scene.wgsl
// Edges of the triangles, welded by position: see src/scene/edges.rs, a test compares the struct.

struct Edge {
    // Vertices, of each place always the same one.
    ends: vec2u,
    // Its triangles in `sides`.
    first: u32,
    count: u32,
}

var<storage, read> edges: array<Edge>;
// Triangles × 2, and 1 more of those that run along the edge from its second end to its first.
var<storage, read> sides: array<u32>;
