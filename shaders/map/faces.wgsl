//!include lib/frame.wgsl
//!include lib/gbuffer.wgsl
//!include map/faces_of.wgsl
//!include map/clusters.wgsl
//!include map/culling.wgsl
//!include map/arcs.wgsl
// Which faces are drawn, and which triangles into each. Nothing of it is read back: a face without view samples has draws of
// no instance.

var<uniform> drawing: FaceParams;
// View samples of each face; then, bit by bit, the faces that their filters reach.
var<storage, read_write> samples: array<atomic<u32>, 9>;
// Of each face two indexed indirect draws, opaque and masked: index count, instances, first index, base vertex, first instance.
// Behind those of all faces two indirect draws each for shaders that pull their vertices: vertices, instances, first vertex, first
// instance.
var<storage, read_write> draws: array<atomic<u32>>;

const pulled = 80u;

var<workgroup> tile: array<atomic<u32>, most_layers>;

// Counts the view samples of each face. A workgroup takes 64 × 64 pixels; a thread's pixels mostly lie in one face: few atomics.
@compute @workgroup_size(8, 8)
fn mark(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_id) local: vec3u,
        @builtin(local_invocation_index) index: u32) {
    var held = 0u;
    var number = 0u;
    var reached = 0u;
    for (var k = 0u; k < 64u; k++) {
        let p = lit_sample(group.xy * 64u + vec2u(k % 8u, k / 8u) * 8u + local.xy);
        if p.w <= 0.0 {
            continue;
        }
        let face = face_of(p.xyz - frame.light_position);
        if face != held && number > 0u {
            atomicAdd(&tile[held], number);
            number = 0u;
        }
        held = face;
        number++;
        if faces.metres > 0.0 {
            // Guard bands hold what lies a few texels off, and no more.
            for (var i = 0u; i < faces.count; i++) {
                let across = faces.axes[held].xyz - faces.axes[i].xyz;
                reached |= u32(dot(across, p.xyz - frame.light_position) < faces.metres * length(across)) << i;
            }
        }
    }
    if number > 0u {
        atomicAdd(&tile[held], number);
    }
    if reached != 0u {
        atomicOr(&samples[most_layers], reached);
    }
    workgroupBarrier();
    if index < most_layers {
        let found = atomicLoad(&tile[index]);
        if found > 0u {
            atomicAdd(&samples[index], found);
        }
    }
}

// One thread a face.
@compute @workgroup_size(8)
fn begin(@builtin(global_invocation_id) id: vec3u) {
    let i = id.x;
    var used = i < faces.count;
    if drawing.culling == culling_samples {
        used = used && (atomicLoad(&samples[i]) > 0u || (atomicLoad(&samples[most_layers]) >> i & 1u) == 1u);
    } else if drawing.culling == culling_view {
        used = used && (faces.met >> i & 1u) == 1u;
    }
    let listed = faces.listed == 1u;
    for (var masked = 0u; masked < 2u; masked++) {
        let draw = (2u * i + masked) * 5u;
        let count = select(faces.opaque, faces.triangles - faces.opaque, masked == 1u) * 3u;
        let first = select(0u, i * faces.triangles * 3u, listed) + select(0u, faces.opaque * 3u, masked == 1u);
        atomicStore(&draws[draw], select(count, 0u, !used || listed));
        atomicStore(&draws[draw + 1u], u32(used));
        atomicStore(&draws[draw + 2u], first);
        atomicStore(&draws[draw + 3u], 0u);
        atomicStore(&draws[draw + 4u], 0u);
    }
}

var<storage, read_write> indices: array<u32>;
// Three corners a triangle, as casters are drawn.
var<storage, read> corners_of: array<u32>;

// Whether a triangle's shadow may fall where something of the camera's frustum looks: not if all of it lies beyond one side, and leads
// away from it, farther than a filter's taps lie from their receiver's ray.
fn shadows_view(p: vec3f, q: vec3f, r: vec3f) -> bool {
    let light = frame.light_position;
    let apart = faces.angle * max(max(distance(p, light), distance(q, light)), distance(r, light)) + faces.metres;
    for (var i = 0u; i < 6u; i++) {
        let plane = faces.frustum[i];
        let nearest = max(max(dot(plane, vec4f(p, 1.0)), dot(plane, vec4f(q, 1.0))), dot(plane, vec4f(r, 1.0)));
        let away = max(max(dot(plane.xyz, p - light), dot(plane.xyz, q - light)), dot(plane.xyz, r - light));
        if nearest < -apart && away <= -apart {
            return false;
        }
    }
    return true;
}

// Whether a triangle may touch a face's map.
fn touches_face(i: u32, p: vec3f, q: vec3f, r: vec3f) -> bool {
    let v = light_views[i];
    if v.perspective != 3u {
        return touches(v, p, q, r) && touches_region(i, v, p, q, r);
    }
    let a = p - frame.light_position;
    let b = q - frame.light_position;
    let c = r - frame.light_position;
    let axis = v.row_w.xyz;
    // What lies farther off the axis than the map goes, beyond a right angle, is the inside of a cone, and convex: a triangle whose
    // corners are in it is.
    let least = min(v.ahead, 0.0);
    if dot(axis, a) < least * length(a) && dot(axis, b) < least * length(b) && dot(axis, c) < least * length(c) {
        return false;
    }
    if faces.vertices == 0u {
        return covers_moved(v, p, q, r);
    }
    // A sphere around the triangle against the cone that the map holds.
    let middle = (a + b + c) / 3.0;
    let radius = max(max(distance(a, middle), distance(b, middle)), distance(c, middle));
    let far = length(middle);
    return radius >= far || acos(clamp(dot(axis, middle) / far, -1.0, 1.0)) - asin(radius / far) <= acos(v.ahead);
}

// Whether a triangle of which only the corners are moved may cover the centre of a texel.
fn covers_moved(v: LightView, p: vec3f, q: vec3f, r: vec3f) -> bool {
    let places = array<vec2f, 3>(place_in(v, light_frame(v, p)), place_in(v, light_frame(v, q)), place_in(v, light_frame(v, r)));
    let farthest = max(max(abs(places[0]), abs(places[1])), abs(places[2]));
    let size = max(farthest.x, farthest.y);
    let half = 0.5 * v.resolution;
    // The rasteriser's own grid, and rounding: far out it grows with the square of the distance from the map's middle.
    let spare = 0.0625 + 2e-6 * half * (1.0 + size * size);
    return covers_centre(half + half * places[0], half + half * places[1], half + half * places[2], v.resolution, spare);
}

// Whether a triangle may reach into the part of the map that a face draws into.
fn touches_region(i: u32, v: LightView, p: vec3f, q: vec3f, r: vec3f) -> bool {
    let a = light_clip(v, p);
    let b = light_clip(v, q);
    let c = light_clip(v, r);
    let half = 0.5 * v.resolution;
    for (var k = 0u; k < 2u; k++) {
        // Times w, as no corner behind the light can be divided by its w.
        let e = faces.regions[2u * i + k].xyz;
        let row = vec3f(half * e.x, -half * e.y, half * (e.x + e.y) + e.z);
        let spare = 1e-4 * v.resolution * abs(vec3f(a.w, b.w, c.w));
        let at = vec3f(dot(row, a.xyw), dot(row, b.xyw), dot(row, c.xyw)) + spare;
        if all(at < vec3f(0.0)) {
            return false;
        }
    }
    return true;
}

// The arguments of a dispatch with a workgroup for each cluster that some face may draw, how many these are, and of each its number and
// the faces, a bit each.
var<storage, read_write> listing: array<atomic<u32>>;
var<storage, read> listed_clusters: array<u32>;

// One thread a cluster.
@compute @workgroup_size(64)
fn list_clusters(@builtin(global_invocation_id) id: vec3u) {
    if id.x == 0u {
        atomicStore(&listing[2], 1u);
    }
    if id.x >= cluster_count() {
        return;
    }
    let c = clusters[id.x];
    var met = 0u;
    for (var i = 0u; i < faces.count; i++) {
        met |= u32(cluster_touches_face(i, c) && atomicLoad(&draws[10u * i + 1u]) > 0u) << i;
    }
    if met == 0u || (drawing.culling >= culling_view && !cluster_shadows_view(c)) {
        return;
    }
    let at = atomicAdd(&listing[3], 1u);
    atomicMax(&listing[0], min(at + 1u, cluster_row));
    atomicMax(&listing[1], at / cluster_row + 1u);
    atomicStore(&listing[4u + 2u * at], id.x);
    atomicStore(&listing[5u + 2u * at], met);
}

// A workgroup a cluster that was listed, one thread a triangle.
@compute @workgroup_size(64)
fn cull(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) own: u32) {
    let cluster = group.y * cluster_row + group.x;
    if cluster >= listed_clusters[3] {
        return;
    }
    let index = listed_clusters[4u + 2u * cluster] * cluster_size + own;
    if index >= faces.triangles {
        return;
    }
    let t = vec3u(corners_of[3u * index], corners_of[3u * index + 1u], corners_of[3u * index + 2u]);
    let p = vertex_position(t.x);
    let q = vertex_position(t.y);
    let r = vertex_position(t.z);
    let light = frame.light_position;
    if edge_on(p - light, q - light, r - light, length(light)) || (drawing.culling >= culling_view && !shadows_view(p, q, r)) {
        return;
    }
    let masked = u32(index >= faces.opaque);
    for (var left = listed_clusters[5u + 2u * cluster]; left != 0u; left &= left - 1u) {
        let i = firstTrailingBit(left);
        let draw = (2u * i + masked) * 5u;
        if !touches_face(i, p, q, r) {
            continue;
        }
        let at = 3u * (i * faces.triangles + masked * faces.opaque) + atomicAdd(&draws[draw], 3u);
        indices[at] = t.x;
        indices[at + 1u] = t.y;
        indices[at + 2u] = t.z;
    }
}

// One thread a face: the draws of shaders that pull their vertices.
@compute @workgroup_size(8)
fn finish(@builtin(global_invocation_id) id: vec3u) {
    for (var masked = 0u; masked < 2u; masked++) {
        let own = (2u * id.x + masked) * 5u;
        let to = pulled + (2u * id.x + masked) * 4u;
        atomicStore(&draws[to], atomicLoad(&draws[own]) / 3u * faces.vertices);
        atomicStore(&draws[to + 1u], atomicLoad(&draws[own + 1u]));
        atomicStore(&draws[to + 2u], atomicLoad(&draws[own + 2u]) / 3u * faces.vertices);
        atomicStore(&draws[to + 3u], 0u);
    }
}
