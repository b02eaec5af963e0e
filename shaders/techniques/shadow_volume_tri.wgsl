//!include lib/volume.wgsl
//!include lib/volume_lines.wgsl
// A volume of its own for each triangle, whatever its neighbours.

// The ends of a triangle's side, the shadow on the left of the way as seen from the light; none of what hides nothing.
struct Ends {
    found: bool,
    a: vec3f,
    b: vec3f,
}

fn ends_of(triangle: u32, k: u32) -> Ends {
    let t = triangle_at(triangle);
    let a = vertex_position(select(select(t.x, t.y, k == 1u), t.z, k == 2u));
    let b = vertex_position(select(select(t.y, t.z, k == 1u), t.x, k == 2u));
    let turned = facing[triangle] < 0;
    return Ends(facing[triangle] != 0, select(a, b, turned), select(b, a, turned));
}

@vertex
fn side_corner(@builtin(vertex_index) index: u32) -> Face {
    let i = index / corners_each();
    let ends = ends_of(i / 3u, i % 3u);
    if !ends.found {
        return no_face();
    }
    return side(index % corners_each(), ends.a, ends.b, 1u);
}

@vertex
fn volume_line(@builtin(vertex_index) index: u32) -> VolumeLine {
    let i = index / 6u;
    let ends = ends_of(i / 3u, i % 3u);
    if !ends.found {
        return no_line();
    }
    return side_line(index % 6u, ends.a, ends.b);
}
