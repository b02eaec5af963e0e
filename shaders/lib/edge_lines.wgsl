//!include lib/gbuffer.wgsl
// Edges over the picture, two pixels wide.

struct Line {
    @builtin(position) at: vec4f,
    // Depth along the camera's axis.
    @location(0) depth: f32,
}

// Corner `index` of six, of the line between two vertices; twice the same one: of none.
fn edge_corner(index: u32, ends: vec2u) -> Line {
    if ends.x == ends.y {
        return Line(vec4f(2.0, 2.0, 0.0, 1.0), 0.0);
    }
    let p = vertex_position(ends.x) - frame.eye;
    let q = vertex_position(ends.y) - frame.eye;
    var a = frame.eye_proj * vec4f(p, 1.0);
    var b = frame.eye_proj * vec4f(q, 1.0);
    var depths = vec2f(dot(p, frame.forward), dot(q, frame.forward));
    if max(depths.x, depths.y) < frame.near {
        return Line(vec4f(2.0, 2.0, 0.0, 1.0), 0.0);
    }
    if depths.x < frame.near {
        a = mix(b, a, (depths.y - frame.near) / (depths.y - depths.x));
        depths.x = frame.near;
    } else if depths.y < frame.near {
        b = mix(a, b, (depths.x - frame.near) / (depths.x - depths.y));
        depths.y = frame.near;
    }
    let half = 0.5 * vec2f(frame.size);
    let along = (b.xy / b.w - a.xy / a.w) * half;
    let t = along / max(length(along), 1e-6);
    let corner = array<u32, 6>(0u, 1u, 2u, 2u, 1u, 3u)[index];
    var at = select(a, b, corner >= 2u);
    at += vec4f(vec2f(-t.y, t.x) * select(-1.0, 1.0, (corner & 1u) == 1u) / half * at.w, 0.0, 0.0);
    return Line(at, select(depths.x, depths.y, corner >= 2u));
}

// How strong a line is: faint behind surfaces. Lines on a surface belong before it.
@fragment
fn edge_line(l: Line) -> @location(0) vec4f {
    let surface = textureLoad(g_position, vec2u(l.at.xy), 0).w;
    return vec4f(select(1.0, 0.2, surface > 0.0 && l.depth > surface + 0.005 * distance_at(surface)));
}
