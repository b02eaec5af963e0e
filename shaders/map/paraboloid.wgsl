//!include map/peel.wgsl
//!include map/arcs.wgsl
// Casters into a side of a paraboloid (`light_view`), where straight edges become arcs of circles. Two ways to draw: pieces are
// parts of triangles so small that their edges follow the arcs; a `boxed` triangle is drawn as the box around its image, and each
// texel's ray meets the triangle itself or not. A third, map/moved.wgsl, leaves edges straight.

var<uniform> curved: CurvedParams;
// Three corners a triangle, as vertices' numbers.
var<storage, read> listed: array<u32>;

// A triangle in the light's frame: metres from the light, z along the side's axis.
struct Facet {
    corners: array<vec3f, 3>,
    // Its vertices.
    vertices: vec3u,
    // Its plane: n·q = n·(any corner).
    normal: vec3f,
    // Left out, by the side that it turns to the light.
    culled: bool,
}

fn facet(number: u32) -> Facet {
    var t: Facet;
    var world: array<vec3f, 3>;
    for (var k = 0u; k < 3u; k++) {
        t.vertices[k] = listed[3u * number + k];
        world[k] = vertex_position(t.vertices[k]);
        t.corners[k] = light_frame(light_view, world[k]);
    }
    t.normal = cross(t.corners[1] - t.corners[0], t.corners[2] - t.corners[0]);
    // In the light's frame, which may be mirrored, sides cannot be told apart.
    let mirrored = dot(cross(light_view.row_x.xyz, light_view.row_y.xyz), light_view.axis.xyz) < 0.0;
    let front = (dot(t.normal, t.corners[0]) < 0.0) != mirrored;
    t.culled = (casters.cull == cull_front && front) || (casters.cull == cull_back && !front);
    return t;
}

struct Drawn {
    @builtin(position) clip: vec4f,
    // Corners of the triangle in the light's frame.
    @location(0) @interpolate(flat) a: vec3f,
    @location(1) @interpolate(flat) b: vec3f,
    @location(2) @interpolate(flat) c: vec3f,
    // Normals of the planes through the light and the edges bc, ca and ab.
    @location(3) @interpolate(flat) e0: vec3f,
    @location(4) @interpolate(flat) e1: vec3f,
    @location(5) @interpolate(flat) e2: vec3f,
    @location(6) @interpolate(flat) uv0: vec3f,
    @location(7) @interpolate(flat) uv1: vec3f,
    @location(10) @interpolate(flat) uv2: vec3f,
    @location(8) @interpolate(flat) material: u32,
    // 1: of a piece that is half a box, so that rays are asked whether they meet the triangle.
    @location(9) @interpolate(flat) whole: u32,
}

fn described(t: Facet) -> Drawn {
    var out: Drawn;
    out.a = t.corners[0];
    out.b = t.corners[1];
    out.c = t.corners[2];
    out.e0 = edge_plane(out.b, out.c);
    out.e1 = edge_plane(out.c, out.a);
    out.e2 = edge_plane(out.a, out.b);
    if edge_on(out.a, out.b, out.c, length(vec3f(light_view.row_x.w, light_view.row_y.w, light_view.axis.w))) {
        // Met by no ray.
        out.e0 = vec3f(0.0);
        out.e1 = vec3f(0.0);
        out.e2 = vec3f(0.0);
    }
    out.uv0 = texture_place(t.vertices[0]);
    out.uv1 = texture_place(t.vertices[1]);
    out.uv2 = texture_place(t.vertices[2]);
    out.material = vertex_at(t.vertices[0]).material;
    // Nothing, unless told otherwise.
    out.clip = vec4f(2.0, 2.0, 0.5, 1.0);
    return out;
}

// Places of `out` planes against a direction of the light's frame: all of one sign where the triangle is met.
fn sides_of(in: Drawn, ray: vec3f) -> vec3f {
    return vec3f(dot(in.e0, ray), dot(in.e1, ray), dot(in.e2, ray));
}

fn inside(e: vec3f) -> bool {
    return min(min(e.x, e.y), e.z) >= 0.0 || max(max(e.x, e.y), e.z) <= 0.0;
}

@vertex
fn boxed_facet(@builtin(vertex_index) index: u32) -> Drawn {
    let t = facet(index / 6u);
    if t.culled {
        return described(t);
    }
    return boxed_corner(t, index % 6u);
}

// A corner of the two triangles that are the box around a triangle's image.
fn boxed_corner(t: Facet, corner: u32) -> Drawn {
    var out = described(t);
    let box = box_of_image(t.corners);
    // Half a texel more, and rounding.
    let spare = 1.5 / light_view.resolution;
    let low = clamp(box.low - spare, vec2f(-1.0), vec2f(1.0));
    let high = clamp(box.high + spare, vec2f(-1.0), vec2f(1.0));
    let right = (0x32u >> corner & 1u) == 1u;
    let down = (0x2cu >> corner & 1u) == 1u;
    if all(low < high) {
        out.clip = vec4f(select(low.x, high.x, right), select(low.y, high.y, down), 0.5, 1.0);
    }
    return out;
}

// The ray of a fragment's texel.
fn ray_at(clip: vec4f) -> vec3f {
    let ndc = vec2f(2.0, -2.0) * clip.xy / light_view.resolution + vec2f(-1.0, 1.0);
    return paraboloid_ray(light_view, ndc);
}

// Shares of the corners where a ray meets the triangle; all zero: it does not, or its texel is beyond the side.
fn met(in: Drawn, ray: vec3f) -> vec3f {
    let e = sides_of(in, ray);
    let sum = e.x + e.y + e.z;
    if sum == 0.0 || !inside(e) {
        return vec3f(0.0);
    }
    let share = e / sum;
    // Behind the light the same line meets it too.
    let at = share.x * in.a + share.y * in.b + share.z * in.c;
    return select(vec3f(0.0), share, dot(at, ray) > 0.0);
}

fn met_depth(in: Drawn) -> f32 {
    let share = met(in, ray_at(in.clip));
    if all(share == vec3f(0.0)) {
        discard;
    }
    if masked_out(materials[in.material], share.x * in.uv0 + share.y * in.uv1 + share.z * in.uv2) {
        discard;
    }
    return saturate(stored_depth(light_view, length(share.x * in.a + share.y * in.b + share.z * in.c)));
}

@fragment
fn met_facet(in: Drawn) -> @builtin(frag_depth) f32 {
    return met_depth(in);
}

@fragment
fn peel_met_facet(in: Drawn) -> @builtin(frag_depth) f32 {
    return peeled(in.clip, met_depth(in));
}

// A part of a triangle: its place in the list, and how it is cut: see `cut_of`.
var<storage, read_write> pieces: array<vec2u>;
var<storage, read> drawn_pieces: array<vec2u>;
// Vertices, instances, first vertex and first instance of the draw; then how many pieces come on top of one for each triangle, and
// how many triangles were not split as far as they should be.
var<storage, read_write> piece_draw: array<atomic<u32>, 8>;
// As map/faces.wgsl writes them.
var<storage, read> draws: array<u32>;
// The side's number.
var<uniform> side: vec4u;

// Into how many parts, as a power of two, an edge is cut so that none deviates from its arc by more than the tolerance. Parts are equal
// angles seen from the light. In the map one of angle δ is δ k R/2 long at most, with k the largest scale of the side's
// image, on a circle of radius ρ = R/2 · scale / |m.z|, and deviates by its square over 8 ρ.
fn cuts_of(a: vec3f, b: vec3f) -> u32 {
    let normal = cross(a, b);
    let size = length(normal);
    let angle = atan2(size, dot(a, b));
    let v = light_view;
    let scale = v.row_z.z;
    let farthest = length(v.row_z.xy) + 1.0 / scale;
    let k = 0.5 * (1.0 + farthest * farthest) * scale;
    let bent = abs(normal.z) / max(size, 1e-30);
    let parts = angle * k * sqrt(v.resolution * bent / (16.0 * scale * curved.tolerance));
    return u32(clamp(ceil(log2(max(parts, 1.0))), 0.0, 6.0));
}

// Bits: the power of two that the triangle is cut by, those of its edges ab, bc and ca, three each, and from bit 12 on the part.
fn cut_of(level: u32, cuts: vec3u, part: u32) -> u32 {
    return level | cuts.x << 3u | cuts.y << 6u | cuts.z << 9u | part << 12u;
}

// Of a part: it is half the box around the triangle's image, the first or the second.
const boxed = 0x80000000u;

// Whether an edge leaves the cone that the map holds: at an end, or between them, at the point of its great circle that lies
// farthest behind.
fn edge_behind(a: vec3f, b: vec3f) -> bool {
    let axis = side_axis();
    let from_a = normalize(a);
    let from_b = normalize(b);
    if min(dot(axis, from_a), dot(axis, from_b)) < light_view.ahead {
        return true;
    }
    let m = normalize(cross(a, b));
    let most = dot(axis, m) * m - axis;
    let middle = from_a + from_b;
    return -length(most) < light_view.ahead && dot(most, middle) > length(most) * dot(from_a, middle);
}

// Whether a triangle leaves that cone. What does may run off to infinity in the image, where the bound above says nothing: its texels'
// rays are met one by one.
fn goes_behind(t: Facet) -> bool {
    let back = vec3f(0.0, 0.0, -1.0);
    let e = vec3f(dot(edge_plane(t.corners[1], t.corners[2]), back), dot(edge_plane(t.corners[2], t.corners[0]), back),
                  dot(edge_plane(t.corners[0], t.corners[1]), back));
    return inside(e) || edge_behind(t.corners[0], t.corners[1]) || edge_behind(t.corners[1], t.corners[2])
        || edge_behind(t.corners[2], t.corners[0]);
}

@compute @workgroup_size(64)
fn split_facets(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    for (var masked = 0u; masked < 2u; masked++) {
        let draw = (2u * side.x + masked) * 5u;
        let number = draws[draw] / 3u * draws[draw + 1u];
        let first = draws[draw + 2u] / 3u;
        for (var i = id.x; i < number; i += 64u * groups.x) {
            let t = facet(first + i);
            if t.culled {
                continue;
            }
            let cuts = vec3u(cuts_of(t.corners[0], t.corners[1]), cuts_of(t.corners[1], t.corners[2]),
                             cuts_of(t.corners[2], t.corners[0]));
            var level = max(max(cuts.x, cuts.y), cuts.z);
            let spare = arrayLength(&pieces) - min(number, arrayLength(&pieces));
            var whole = goes_behind(t);
            var extra = select((1u << (2u * level)) - 1u, 1u, whole);
            var own = cuts;
            if extra > 0u && atomicAdd(&piece_draw[4], extra) + extra > spare {
                atomicAdd(&piece_draw[5], 1u);
                level = 0u;
                own = vec3u(0u);
                whole = false;
                extra = 0u;
            }
            let at = atomicAdd(&piece_draw[0], 1u + extra);
            for (var k = 0u; k <= extra && at + k < arrayLength(&pieces); k++) {
                pieces[at + k] = vec2u(first + i, select(cut_of(level, own, k), boxed | k, whole));
            }
        }
    }
}

@compute @workgroup_size(1)
fn finish_pieces() {
    atomicStore(&piece_draw[0], 3u * min(atomicLoad(&piece_draw[0]), arrayLength(&pieces)));
    atomicStore(&piece_draw[1], 1u);
}

// The place between two points that lies at a share t of the angle between them, seen from the light.
fn at_angle(a: vec3f, b: vec3f, t: f32) -> vec3f {
    let angle = atan2(length(cross(a, b)), dot(a, b));
    let first = sin(t * angle) * length(a);
    let second = sin((1.0 - t) * angle) * length(b);
    return mix(a, b, select(first / max(first + second, 1e-30), t, angle < 1e-4));
}

// A place on an edge cut into 2^cuts parts: the last end of a part up to t from a on. The same digits from both sides of the edge.
fn on_edge(a: vec3f, b: vec3f, t: f32, cuts: u32) -> vec3f {
    let parts = f32(1u << cuts);
    let at = floor(t * parts) / parts;
    if at == 0.0 {
        return a;
    }
    if at == 1.0 {
        return b;
    }
    if precedes(b, a) {
        return at_angle(b, a, 1.0 - at);
    }
    return at_angle(a, b, at);
}

@vertex
fn piece_of_facet(@builtin(vertex_index) index: u32) -> Drawn {
    let piece = drawn_pieces[index / 3u];
    let t = facet(piece.x);
    var out = described(t);
    if piece.y >= boxed {
        out = boxed_corner(t, 3u * (piece.y & 1u) + index % 3u);
        out.whole = 1u;
        return out;
    }
    let n = 1u << (piece.y & 7u);
    let part = piece.y >> 12u;
    // Rows of parts from the corner a on: row r has 2 r + 1.
    let r = u32(sqrt(f32(part) + 0.5));
    let k = part - r * r;
    let j = k / 2u;
    var corners = array<vec2u, 3>(vec2u(r, j), vec2u(r + 1u, j), vec2u(r + 1u, j + 1u));
    if (k & 1u) == 1u {
        corners = array<vec2u, 3>(vec2u(r, j), vec2u(r + 1u, j + 1u), vec2u(r, j + 1u));
    }
    let at = corners[index % 3u];
    var q: vec3f;
    if at.y == 0u {
        q = on_edge(t.corners[0], t.corners[1], f32(at.x) / f32(n), piece.y >> 3u & 7u);
    } else if at.x == n {
        q = on_edge(t.corners[1], t.corners[2], f32(at.y) / f32(n), piece.y >> 6u & 7u);
    } else if at.y == at.x {
        q = on_edge(t.corners[2], t.corners[0], 1.0 - f32(at.x) / f32(n), piece.y >> 9u & 7u);
    } else {
        let down = f32(at.x) / f32(n);
        q = at_angle(at_angle(t.corners[0], t.corners[1], down), at_angle(t.corners[0], t.corners[2], down),
                     f32(at.y) / f32(at.x));
    }
    out.clip = vec4f(place_of(q), 0.5, 1.0);
    return out;
}

// Where a ray meets the triangle's plane, held within it: pieces end a little beside their triangle.
fn plane_depth(in: Drawn) -> f32 {
    if in.whole == 1u {
        return met_depth(in);
    }
    let ray = ray_at(in.clip);
    let e = sides_of(in, ray);
    let sum = e.x + e.y + e.z;
    let share = select(e / sum, vec3f(1.0 / 3.0), sum == 0.0);
    if masked_out(materials[in.material], share.x * in.uv0 + share.y * in.uv1 + share.z * in.uv2) {
        discard;
    }
    let at = share.x * in.a + share.y * in.b + share.z * in.c;
    let farthest = max(max(length(in.a), length(in.b)), length(in.c));
    return saturate(stored_depth(light_view, min(length(at), farthest)));
}

@fragment
fn plane_facet(in: Drawn) -> @builtin(frag_depth) f32 {
    return plane_depth(in);
}

@fragment
fn peel_plane_facet(in: Drawn) -> @builtin(frag_depth) f32 {
    return peeled(in.clip, plane_depth(in));
}
