//!include lib/frame.wgsl
//!include lib/edges.wgsl
// The silhouette as the light sees it, in an order that does not depend on how threads run: edges where what faces the light
// and what is turned away do not cancel (Kim, Kim, Turk 2008).

// Of each triangle: 1 if its front faces the light, -1 if its back does, 0 if the light lies in its plane or it hides nothing.
var<storage, read_write> facing: array<i32>;
// So many silhouette edges each run of edges has; then so many lie before it.
var<storage, read_write> runs: array<u32>;
// See lib/silhouette.wgsl.
var<storage, read_write> silhouettes: array<vec4u>;
// Of an indirect draw: vertices, instances, first vertex, first instance.
var<storage, read_write> draw: array<u32>;

// Vertices that each silhouette edge is drawn by.
override vertices_each = 6u;
// Whether triangles that are turned away count too; without them the mesh must be closed, as for silhouettes of convex parts.
override both_sides = 1u;
// Whether an edge is listed as often as its weight says, each time with a weight of 1.
override repeated = 0u;
// Whether triangles with holes by their texture hide something; as if they had none.
override with_masked = 1u;

const run_length = 32u;

fn thread(id: vec3u, groups: vec3u) -> u32 {
    return id.x + id.y * groups.x * 64u;
}

@compute @workgroup_size(64)
fn face(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let i = thread(id, groups);
    if i >= arrayLength(&facing) || i >= frame.triangle_count {
        return;
    }
    let t = triangle_at(i);
    // From the corner of the largest angle, opposite the longest edge: there rounding is least, also of a sliver.
    let p = vertex_position(t.x);
    let q = vertex_position(t.y);
    let r = vertex_position(t.z);
    let longest = vec3f(distance(q, r), distance(r, p), distance(p, q));
    let at_p = longest.x >= max(longest.y, longest.z);
    let at_q = !at_p && longest.y >= longest.z;
    let a = select(select(r, q, at_q), p, at_p);
    let ab = select(select(p, r, at_q), q, at_p) - a;
    let ac = select(select(q, p, at_q), r, at_p) - a;
    var to_light = frame.light_position;
    if frame.light_kind != directional {
        to_light -= a;
    }
    let side = dot(cross(ab, ac), to_light);
    // What rounding can make of 0.
    let zero = 2.4e-7 * length(ab) * length(ac) * length(to_light);
    let casts = with_masked != 0u || materials[vertex_at(t.x).material].cutoff < 0.0;
    facing[i] = select(0, select(-1, 1, side > 0.0), abs(side) > zero && casts);
}

// How often the shadow lies on the left of the edge more than on the right, seen from the light along it.
fn weight(edge: Edge) -> i32 {
    var sum = 0;
    for (var k = 0u; k < edge.count; k++) {
        let side = sides[edge.first + k];
        let way = select(1, -1, (side & 1u) == 1u);
        let faces = facing[side >> 1u];
        sum += select(0, way * faces, both_sides != 0u || faces > 0);
    }
    return sum;
}

// How often an edge is listed.
fn entries(weight: i32) -> u32 {
    let size = u32(abs(weight));
    return select(min(size, 1u), size, repeated != 0u);
}

@compute @workgroup_size(64)
fn count(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let run = thread(id, groups);
    let last = min((run + 1u) * run_length, arrayLength(&edges));
    var found = 0u;
    for (var i = run * run_length; i < last; i++) {
        found += entries(weight(edges[i]));
    }
    if run < arrayLength(&runs) {
        runs[run] = found;
    }
}

var<workgroup> sums: array<u32, 256>;

@compute @workgroup_size(256)
fn scan(@builtin(local_invocation_index) i: u32) {
    let each = (arrayLength(&runs) + 255u) / 256u;
    let last = min((i + 1u) * each, arrayLength(&runs));
    var sum = 0u;
    for (var k = i * each; k < last; k++) {
        sum += runs[k];
    }
    sums[i] = sum;
    workgroupBarrier();
    if i == 0u {
        var all = 0u;
        for (var k = 0u; k < 256u; k++) {
            let own = sums[k];
            sums[k] = all;
            all += own;
        }
        draw[0] = all * vertices_each;
        draw[1] = 1u;
        draw[2] = 0u;
        draw[3] = 0u;
    }
    workgroupBarrier();
    var before = sums[i];
    for (var k = i * each; k < last; k++) {
        let own = runs[k];
        runs[k] = before;
        before += own;
    }
}

@compute @workgroup_size(64)
fn list(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let run = thread(id, groups);
    if run >= arrayLength(&runs) {
        return;
    }
    let last = min((run + 1u) * run_length, arrayLength(&edges));
    var at = runs[run];
    for (var i = run * run_length; i < last; i++) {
        let edge = edges[i];
        let w = weight(edge);
        let ends = select(edge.ends.yx, edge.ends, vec2<bool>(w > 0));
        for (var left = entries(w); left > 0u && at < arrayLength(&silhouettes); left--) {
            silhouettes[at] = vec4u(ends, select(u32(abs(w)), 1u, repeated != 0u), i);
            at++;
        }
    }
}
