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
    var a = frame.eye_proj * vec4f(vertices[ends.x].position - frame.eye, 1.0);
    var b = frame.eye_proj * vec4f(vertices[ends.y].position - frame.eye, 1.0);
    if max(a.w, b.w) < frame.near {
        return Line(vec4f(2.0, 2.0, 0.0, 1.0), 0.0);
    }
    if a.w < frame.near {
        a = mix(b, a, (b.w - frame.near) / (b.w - a.w));
    } else if b.w < frame.near {
        b = mix(a, b, (a.w - frame.near) / (a.w - b.w));
    }
    let half = 0.5 * vec2f(frame.size);
    let along = (b.xy / b.w - a.xy / a.w) * half;
    let t = along / max(length(along), 1e-6);
    let corner = array<u32, 6>(0u, 1u, 2u, 2u, 1u, 3u)[index];
    var at = select(a, b, corner >= 2u);
    at += vec4f(vec2f(-t.y, t.x) * select(-1.0, 1.0, (corner & 1u) == 1u) / half * at.w, 0.0, 0.0);
    return Line(at, at.w);
}

// How strong a line is: faint behind surfaces. Lines on a surface belong before it.
@fragment
fn edge_line(l: Line) -> @location(0) vec4f {
    let surface = textureLoad(g_position, vec2u(l.at.xy), 0).w;
    return vec4f(select(1.0, 0.2, surface > 0.0 && l.depth > 1.005 * surface));
}
