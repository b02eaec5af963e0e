//!include lib/frame.wgsl
//!include lib/gbuffer.wgsl
// Shadow volumes (Crow 1977): what each triangle hides is bounded by the triangle, its sides away from the light, and its
// picture at infinity. A pixel lies in as many volumes as its ray, going on behind the surface, leaves and does not enter again
// (z-fail: Bilodeau, Songy 1999; Carmack 2000), or, on the way to it, has entered and not left (z-pass: Heidmann 1991).

// As in map/silhouettes.wgsl: which side of each triangle faces the light. Triangles with 0 hide nothing.
var<storage, read> facing: array<i32>;
// 1: triangles cast with their front only.
var<uniform> fronts_only: u32;
// Where each pixel's surface lies (bits of floats), and its surface id + 1; 0: it is not for the shadow to decide.
var receivers: texture_2d<u32>;

// What stands in place of a surface id.
const at_infinity = 0xfffffffeu;
const a_side = 0xffffffffu;

// A face of a volume.
struct Face {
    @invariant @builtin(position) clip: vec4f,
    // Its plane. The normal points to the side on which the eye is.
    @location(0) @interpolate(flat) start: vec3f,
    @location(1) @interpolate(flat) normal: vec3f,
    // 0: its corners run counterclockwise as seen from outside the volume; 1: from inside.
    @location(2) @interpolate(flat) turned: u32,
    // Of a triangle its surface id.
    @location(3) @interpolate(flat) surface: u32,
    // How many faces it stands for.
    @location(4) @interpolate(flat) weight: u32,
}

fn no_face() -> Face {
    return Face(vec4f(2.0, 2.0, 0.0, 1.0), vec3f(0.0), vec3f(0.0), 0u, a_side, 0u);
}

// The same expression as the G-buffer's: triangles cover the same pixels, at the same depth.
fn clip_of(p: vec3f) -> vec4f {
    return frame.eye_proj * vec4f(p - frame.eye, 1.0);
}

// From the light through a point to infinity: on depth 0, which nothing clips. An orthographic picture shows no infinity: as far
// as lies beyond the scene, which is before its depth's end.
fn far_clip_of(p: vec3f) -> vec4f {
    if frame.orthographic == 1u {
        let travels = select(p - frame.light_position, -frame.light_position, frame.light_kind == directional);
        return clip_of(select(frame.light_position, p, frame.light_kind == directional) + frame.beyond * normalize(travels));
    }
    if frame.light_kind == directional {
        return frame.eye_proj * vec4f(-frame.light_position, 0.0);
    }
    return frame.eye_proj * vec4f(p - frame.light_position, 0.0);
}

fn towards_light(p: vec3f) -> vec3f {
    if frame.light_kind == directional {
        return frame.light_position;
    }
    return frame.light_position - p;
}

// Faces that are drawn: 0 all; 1 those that are not `turned`; 2 the others.
var<uniform> part: u32;

// A face is never turned round: both triangles of an edge have the same side, which covers the same pixels, so that they cancel;
// and a triangle has the depth that it has in the G-buffer, whichever side is lit.
fn drawn_part(face: Face) -> Face {
    if part != 0u && part != face.turned + 1u {
        return no_face();
    }
    return face;
}

fn before(a: vec3f, b: vec3f) -> bool {
    return a.x < b.x || (a.x == b.x && (a.y < b.y || (a.y == b.y && a.z < b.z)));
}

fn towards_eye(normal: vec3f, start: vec3f) -> vec3f {
    return select(-normal, normal, dot(normal, to_eye(start)) > 0.0);
}

// Whether all far ends are one point: a sun's, at infinity.
fn one_far_end() -> bool {
    return frame.light_kind == directional && frame.orthographic == 0u;
}

// Corners that a side takes: it is a triangle where the far ends are one point.
fn corners_each() -> u32 {
    return select(6u, 3u, one_far_end());
}

// Corner `index` of the side through an edge. Seen from the light the shadow lies on the left of the way from a to b.
fn side(index: u32, a: vec3f, b: vec3f, weight: u32) -> Face {
    let turned = before(b, a);
    let first = select(a, b, turned);
    let second = select(b, a, turned);
    // First, far first, far second; first, far second, second. Under a sun: first, far, second.
    let corner = index % 3u;
    let upper = index < 3u;
    let sun = one_far_end();
    let at_second = corner == 2u || (!upper && corner == 1u);
    let far = corner == 1u || (upper && !sun && corner == 2u);
    let p = select(first, second, at_second);
    var out: Face;
    if far {
        out.clip = far_clip_of(p);
    } else {
        out.clip = clip_of(p);
    }
    out.start = first;
    out.normal = towards_eye(cross(second - first, towards_light(first)), first);
    out.turned = select(0u, 1u, turned);
    out.surface = a_side;
    out.weight = weight;
    return drawn_part(out);
}

// Corner `index` of a triangle turned towards the light, or of its picture at infinity turned away from it.
fn cap(index: u32, far: bool) -> Face {
    let triangle = index / 3u;
    let faces = facing[triangle];
    if faces == 0 || (faces < 0 && fronts_only != 0u) {
        return no_face();
    }
    let t = triangle_at(triangle);
    let a = vertex_position(t.x);
    let b = vertex_position(t.y);
    let c = vertex_position(t.z);
    let turned = (faces < 0) != far;
    let corner = index % 3u;
    let p = select(select(a, b, corner == 1u), c, corner == 2u);
    var out: Face;
    if far {
        out.clip = far_clip_of(p);
    } else {
        out.clip = clip_of(p);
    }
    out.start = a;
    out.normal = towards_eye(cross(b - a, c - a), a);
    out.turned = select(0u, 1u, turned);
    out.surface = select(t.w, at_infinity, far);
    out.weight = 1u;
    return drawn_part(out);
}

// Instance 0: triangles; 1: their pictures at infinity.
@vertex
fn cap_corner(@builtin(vertex_index) index: u32, @builtin(instance_index) i: u32) -> Face {
    return cap(index, i > 0u);
}

// Triangles that the camera may see through: those with holes, and those that it sees one side of only. Before what it
// sees there are no others.
@vertex
fn thin_cap_corner(@builtin(vertex_index) index: u32) -> Face {
    let m = materials[vertex_at(triangle_at(index / 3u).x).material];
    if m.cutoff < 0.0 && m.double_sided != 0u {
        return no_face();
    }
    return cap(index, false);
}

// Whether the pixel's ray meets the face behind what it sees. The face is taken as the plane that it is, not by the depth that a
// rasteriser interpolates between corners that it has moved; which pixels it covers, and from which side, is the rasteriser's say, so
// that what is closed stays closed. What is seen is seen first: a face that touches it within rounding, its own and its neighbours' at an edge, lies
// behind it.
fn behind(in: Face) -> bool {
    let r = textureLoad(receivers, vec2u(in.clip.xy), 0);
    if r.w == 0u {
        discard;
    }
    let p = bitcast<vec3f>(r.xyz);
    let rounding = 8.0 * unit * max(abs(p.x), max(abs(p.y), abs(p.z))) * length(in.normal);
    let off = dot(in.normal, p - in.start);
    return off > -rounding || in.surface == at_infinity || in.surface + 1u == r.w;
}

// For the stencil to count.
@fragment
fn keep_behind(in: Face) {
    if !behind(in) {
        discard;
    }
}

@fragment
fn keep_before(in: Face) {
    if behind(in) {
        discard;
    }
}

// For blending to count: what the eye sees from outside one way, what it sees from inside the other.
fn signed_weight(in: Face, front: bool) -> vec4f {
    return vec4f(select(-1.0, 1.0, front == (in.turned == 0u)) * f32(in.weight));
}

@fragment
fn add_behind(in: Face, @builtin(front_facing) front: bool) -> @location(0) vec4f {
    if !behind(in) {
        discard;
    }
    return -signed_weight(in, front);
}

@fragment
fn add_before(in: Face, @builtin(front_facing) front: bool) -> @location(0) vec4f {
    if behind(in) {
        discard;
    }
    return signed_weight(in, front);
}

// For the view of overdraw.
@fragment
fn add_one(in: Face) -> @location(0) vec4f {
    return vec4f(1.0);
}

var receivers_out: texture_storage_2d<rgba32uint, write>;

@compute @workgroup_size(8, 8)
fn receive(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= frame.size.x || id.y >= frame.size.y {
        return;
    }
    let p = lit_sample(id.xy);
    let triangle = textureLoad(g_surface, id.xy, 0).w;
    let receiver = vec4u(bitcast<vec3u>(p.xyz), select(0u, triangle_at(triangle).w + 1u, p.w > 0.0));
    textureStore(receivers_out, id.xy, receiver);
}

var visibility_out: texture_storage_2d<r32float, write>;
var map_out: texture_storage_2d<r32float, write>;
// What the stencil counted, modulo 256; what blending did.
var stencil: texture_2d<u32>;
var sums: texture_2d<f32>;
// Pixels that count so much that their stencil may have run over.
var<storage, read_write> overflowing: atomic<u32>;

// From this count on.
const nearly_over = 200u;

// What the stencil holds from here on stands for a count below 0. More than 255: it is taken for none.
var<uniform> negative_from: u32;

// Volumes that the pixel lies in; where the count fell below 0, how many too few.
fn magnitude(count: u32) -> u32 {
    return select(count, 256u - count, count >= negative_from);
}

// Pixels that are decided by what was counted.
fn decided(pixel: vec2u) -> bool {
    return lit_sample(pixel).w > 0.0;
}

fn store_visibility(pixel: vec2u, lit: bool) {
    let seen = textureLoad(g_position, pixel, 0).w > 0.0;
    textureStore(visibility_out, pixel, vec4f(select(0.0, 1.0, !seen || (lit && decided(pixel)))));
}

@compute @workgroup_size(8, 8)
fn resolve_stencil(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= frame.size.x || id.y >= frame.size.y {
        return;
    }
    let count = textureLoad(stencil, id.xy, 0).x;
    store_visibility(id.xy, count == 0u);
    if count >= nearly_over && negative_from >= nearly_over && decided(id.xy) {
        atomicAdd(&overflowing, 1u);
    }
}

@compute @workgroup_size(8, 8)
fn resolve_sums(@builtin(global_invocation_id) id: vec3u) {
    if id.x < frame.size.x && id.y < frame.size.y {
        store_visibility(id.xy, textureLoad(sums, id.xy, 0).x == 0.0);
    }
}

// The views: how many volumes each pixel lies in.
fn show_count(pixel: vec2u, count: f32) {
    textureStore(map_out, pixel, vec4f(select(-1.0, count, count > 0.0 && decided(pixel))));
}

@compute @workgroup_size(8, 8)
fn inspect_stencil(@builtin(global_invocation_id) id: vec3u) {
    if id.x < frame.size.x && id.y < frame.size.y {
        show_count(id.xy, f32(magnitude(textureLoad(stencil, id.xy, 0).x)));
    }
}

@compute @workgroup_size(8, 8)
fn inspect_sums(@builtin(global_invocation_id) id: vec3u) {
    if id.x < frame.size.x && id.y < frame.size.y {
        show_count(id.xy, abs(textureLoad(sums, id.xy, 0).x));
    }
}

// What is drawn for a view alone: fragments of all volumes; the strength of lines.
var drawing: texture_2d<f32>;

@compute @workgroup_size(8, 8)
fn inspect_overdraw(@builtin(global_invocation_id) id: vec3u) {
    if id.x < frame.size.x && id.y < frame.size.y {
        textureStore(map_out, id.xy, vec4f(textureLoad(drawing, id.xy, 0).x));
    }
}
