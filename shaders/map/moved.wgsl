//!include map/peel.wgsl
//!include map/arcs.wgsl
// Casters into a side of a paraboloid (`light_view`) of which only the corners are moved (Brabec, Annen, Seidel 2002): edges stay
// straight, and depth is linear between corners.

struct Moved {
    @builtin(position) clip: vec4f,
    // How far within the half space that the side holds: see `ahead_of`.
    @location(0) ahead: f32,
    // Of which triangles nothing is drawn: 1: those whose corners go around anticlockwise on the map, -1: the others, 0: none.
    @location(1) @interpolate(flat) without: f32,
}

struct MaskedMoved {
    @builtin(position) clip: vec4f,
    @location(0) ahead: f32,
    @location(1) @interpolate(flat) without: f32,
    @location(2) uv: vec3f,
    @location(3) @interpolate(flat) material: u32,
}

fn moved(position: vec3f) -> Moved {
    let v = light_view;
    let q = light_frame(v, position);
    // What is nearer than the near plane lies on it.
    let clip = vec4f(place_of(q), min(stored_depth(v, length(q)), 1.0), 1.0);
    // The map mirrors what the light sees, unless its frame is mirrored.
    let mirrored = dot(cross(v.row_x.xyz, v.row_y.xyz), v.axis.xyz) < 0.0;
    let without = select(-1.0, 1.0, mirrored == (casters.cull == cull_front));
    return Moved(clip, ahead_of(q) - v.ahead, select(without, 0.0, casters.cull == cull_none));
}

@vertex
fn moved_corner(@location(0) position: vec3f) -> Moved {
    return moved(position);
}

@vertex
fn masked_moved_corner(v: Corner) -> MaskedMoved {
    let at = moved(v.position);
    return MaskedMoved(at.clip, at.ahead, at.without, corner_place(v), v.material);
}

fn left_out(ahead: f32, without: f32, upright: bool) -> bool {
    return ahead < 0.0 || without == select(-1.0, 1.0, upright);
}

@fragment
fn keep_moved(in: Moved, @builtin(front_facing) upright: bool) {
    if left_out(in.ahead, in.without, upright) {
        discard;
    }
}

@fragment
fn keep_moved_masked(in: MaskedMoved, @builtin(front_facing) upright: bool) {
    if left_out(in.ahead, in.without, upright) || masked_out(materials[in.material], in.uv) {
        discard;
    }
}

@fragment
fn peel_moved(in: Moved, @builtin(front_facing) upright: bool) -> @builtin(frag_depth) f32 {
    if left_out(in.ahead, in.without, upright) {
        discard;
    }
    return peeled(in.clip, in.clip.z);
}

@fragment
fn peel_moved_masked(in: MaskedMoved, @builtin(front_facing) upright: bool) -> @builtin(frag_depth) f32 {
    if left_out(in.ahead, in.without, upright) || masked_out(materials[in.material], in.uv) {
        discard;
    }
    return peeled(in.clip, in.clip.z);
}
