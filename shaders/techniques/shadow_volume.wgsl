//!include lib/volume.wgsl
//!include lib/silhouette.wgsl
//!include lib/edge_lines.wgsl
//!include lib/volume_lines.wgsl
// Volumes of all triangles at once: of the sides only those that do not cancel, the silhouette's (Kim, Kim, Turk 2008).

// As in map/silhouettes.wgsl.
var<storage, read> draw: array<u32>;
// Of two draws, as `draw`: lines of the silhouette, and of the volumes.
var<storage, read_write> line_draws: array<u32>;

fn position(vertex: u32) -> vec3f {
    return vertex_position(vertex);
}

@vertex
fn side_corner(@builtin(vertex_index) index: u32) -> Face {
    let s = silhouettes[index / corners_each()];
    return side(index % corners_each(), position(s.x), position(s.y), s.z);
}

@compute @workgroup_size(1)
fn count_lines() {
    let count = draw[0] / corners_each();
    line_draws[0] = 6u * count;
    line_draws[1] = 1u;
    line_draws[4] = 6u * count;
    line_draws[5] = 1u;
}

@vertex
fn line_corner(@builtin(vertex_index) index: u32) -> Line {
    return edge_corner(index % 6u, silhouettes[index / 6u].xy);
}

@vertex
fn volume_line(@builtin(vertex_index) index: u32) -> VolumeLine {
    let s = silhouettes[index / 6u];
    return side_line(index % 6u, position(s.x), position(s.y));
}
