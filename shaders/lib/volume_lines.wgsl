//!include constants.wgsl
//!include lib/volume.wgsl
//!include lib/labels.wgsl
// Lines of shadow volumes over the scene, a pixel wide.

struct VolumeLine {
    @builtin(position) clip: vec4f,
}

fn no_line() -> VolumeLine {
    return VolumeLine(vec4f(2.0, 2.0, 0.0, 1.0));
}

fn line_end(p: vec3f, far: bool) -> VolumeLine {
    if far {
        return VolumeLine(far_clip_of(p));
    }
    return VolumeLine(clip_of(p));
}

// End `index` of the three lines around a side: the edge, and from its ends to infinity.
fn side_line(index: u32, a: vec3f, b: vec3f) -> VolumeLine {
    return line_end(select(a, b, index == 1u || index > 3u), index == 3u || index == 5u);
}

// Faint behind surfaces. Lines on a surface belong before it.
@fragment
fn draw_lines(in: VolumeLine) -> @location(0) vec4f {
    let surface = textureLoad(g_position, vec2u(in.clip.xy), 0).w;
    // Depth, near over the distance along the axis, is 0 at infinity; orthographic, even.
    let steps = vec3f(frame.eye_proj[0].z, frame.eye_proj[1].z, frame.eye_proj[2].z);
    var depth = frame.near / max(in.clip.z, 1e-30);
    if frame.orthographic == 1u {
        depth = frame.near + (1.0 - in.clip.z) / length(steps);
    }
    let hidden = surface > 0.0 && depth > surface + 0.003 * distance_at(surface);
    return vec4f(select(1.0, 0.2, hidden));
}

@compute @workgroup_size(8, 8)
fn inspect_lines(@builtin(global_invocation_id) id: vec3u) {
    if id.x < frame.size.x && id.y < frame.size.y {
        textureStore(map_out, id.xy, vec4f(label(select(1u, 0u, frame.map == shows_silhouette_edges), textureLoad(drawing, id.xy, 0).x)));
    }
}
