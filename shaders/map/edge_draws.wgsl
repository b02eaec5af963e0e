//!include constants.wgsl
//!include lib/edges.wgsl
// The draws of edges into each face's map: of no instance into faces that are not drawn.

var<uniform> quads: QuadParams;
// Of all silhouette edges; vertices first.
var<storage, read> listed_draw: array<u32>;
// As map/faces.wgsl writes them.
var<storage, read> face_draws: array<u32>;
// Of each face vertices, instances, first vertex, first instance.
var<storage, read_write> edge_draws: array<vec4u, most_layers>;

// One thread a face.
@compute @workgroup_size(8)
fn draw_edges(@builtin(local_invocation_index) i: u32) {
    let vertices_of_all = select(listed_draw[0], 6u * arrayLength(&edges), quads.edges == edges_all);
    edge_draws[i] = vec4u(vertices_of_all, face_draws[10u * i + 1u], 0u, 0u);
}
