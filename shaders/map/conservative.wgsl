//!include lib/gbuffer.wgsl
//!include map/view_of.wgsl
// Conservative maps (Hertel, Hormann, Westermann 2009; Morais 2015): casters grown, so that each texel that one touches holds
// the nearest depth it has there; and casters shrunk, so that a texel holds one only where casters cover all of it, and then the
// farthest depth they have there.
//
// Shrunk casters are drawn with their edges moved inwards. Along an edge behind which a neighbour casts too each texel asks
// whether the neighbour holds the rest of its square (`adjacency`), or all casters that meet at a corner do (`fan`).
//
// Places are texels of the map from its upper left corner, depths the light view's stored ones: both are affine along a plane,
// perspective or not. Around a lamp each face of a cube has its maps; `light_view.layer` is its number.

var<uniform> conservative: ConservativeParams;
// Of each triangle first the vertices opposite to its three edges, edge k running from corner k to the next, in the one neighbour
// that runs the other way along it, or `no_vertex`; w: bit 0 it belongs to a closed body, bit 1 it is opaque. Then its own
// corners, of each place always the same vertex.
var<storage, read> neighbours: array<vec4u>;
const no_vertex = 0xffffffffu;

struct Caster {
    a: vec2f,
    b: vec2f,
    c: vec2f,
    // Nearest and farthest depth (the largest and the smallest number).
    ends: vec2f,
    // Change of depth per texel, and the depth at a.
    slope: vec2f,
    depth: f32,
    // Bit k: edge k has a neighbour that casts; bit 3 + k: all around corner k cast; bit 6: it is opaque and whole.
    bits: u32,
}

// What of a caster's neighbours the shrunk map asks.
struct Beyond {
    // Of each edge's neighbour: its opposite corner, and its change of depth per texel.
    sides: array<vec4f, 3>,
    // Of each corner: how far around it casters reach without a gap, texels; the steepest of them, depth per texel; and the
    // farthest depth of any.
    around: array<vec4f, 3>,
    // Of each edge's neighbour the farthest depth.
    ends: vec4f,
}

// Closed bodies' casters from the first on, the others from the last.
var<storage, read_write> casters: array<Caster>;
var<storage, read_write> beyond: array<Beyond>;
// Edges behind which a neighbour casts: their casters × 4 + the edge.
var<storage, read_write> bands: array<u32>;
// Of each triangle that casts and whose lit side may be seen: change of depth per texel, nearest depth, and 1; else 0. For each face,
// or one entry where nothing asks.
var<storage, read_write> own_planes: array<vec4f>;
struct Gathered {
    // Casters of closed bodies, others, those for which there was no room, and all.
    casters: array<atomic<u32>, 4>,
    // The box around all lit samples of the picture that look this face up: -low and high, as words that grow with the number. 0: there
    // are none.
    seen: array<atomic<u32>, 6>,
    // Edges behind which a neighbour casts.
    bands: atomic<u32>,
    padding: u32,
}

// Of each face.
var<storage, read_write> gathered: array<Gathered, 6>;

// A place of the map, texels, and the stored depth there. w: the clip position's.
struct Spot {
    at: vec2f,
    depth: f32,
    w: f32,
}

fn spot_of(v: LightView, position: vec3f) -> Spot {
    let clip = light_clip(v, position);
    return Spot(light_texel(v, clip), clip.z / clip.w, clip.w);
}

fn doubled_area(a: vec2f, b: vec2f, c: vec2f) -> f32 {
    return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

// Change of depth per texel along the plane of three places.
fn slope_of(a: Spot, b: Spot, c: Spot) -> vec2f {
    let area = doubled_area(a.at, b.at, c.at);
    let ab = b.at - a.at;
    let ac = c.at - a.at;
    let d = vec2f(b.depth - a.depth, c.depth - a.depth);
    let slope = vec2f(d.x * ac.y - d.y * ab.y, d.y * ab.x - d.x * ac.x) / select(area, 1e-20, area == 0.0);
    // Edge-on: as steep as can be; depths are then held by the ends alone.
    return clamp(slope, vec2f(-1e9), vec2f(1e9));
}

fn word_of(x: f32) -> u32 {
    let bits = bitcast<u32>(x);
    return select(bits | 0x80000000u, ~bits, (bits & 0x80000000u) != 0u);
}

fn number_of(word: u32) -> f32 {
    return bitcast<f32>(select(~word, word & 0x7fffffffu, (word & 0x80000000u) != 0u));
}

fn add_seen(face: u32, low: vec3f, high: vec3f) {
    for (var k = 0u; k < 3u; k++) {
        atomicMax(&gathered[face].seen[k], word_of(-low[k]));
        atomicMax(&gathered[face].seen[3u + k], word_of(high[k]));
    }
}

// A workgroup takes 64 × 64 pixels; a thread's mostly lie in one face.
@compute @workgroup_size(8, 8)
fn bound_seen(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_id) local: vec3u) {
    var low = vec3f(3.4e38);
    var high = vec3f(-3.4e38);
    var face = 0u;
    for (var i = 0u; i < 64u; i++) {
        let p = lit_sample(group.xy * 64u + vec2u(i % 8u, i / 8u) * 8u + local.xy);
        if p.w > 0.0 {
            let own = view_of(p.xyz);
            if own != face && low.x <= high.x {
                add_seen(face, low, high);
                low = vec3f(3.4e38);
                high = vec3f(-3.4e38);
            }
            face = own;
            low = min(low, p.xyz);
            high = max(high, p.xyz);
        }
    }
    if low.x <= high.x {
        add_seen(face, low, high);
    }
}

fn seen_word(k: u32) -> f32 {
    return number_of(atomicLoad(&gathered[light_view.layer].seen[k]));
}

// Whether something lit that the picture shows may lie behind a triangle, as the light sees it.
fn may_shadow(p: vec3f, normal: vec3f) -> bool {
    let low = -vec3f(seen_word(0u), seen_word(1u), seen_word(2u));
    let high = vec3f(seen_word(3u), seen_word(4u), seen_word(5u));
    let size = max(max(max(abs(low.x), abs(high.x)), max(abs(low.y), abs(high.y))), max(abs(low.z), abs(high.z)));
    // Rays start off their surface by 8 units.
    let farthest = dot(normal, select(low, high, normal < vec3f(0.0)) - p);
    return farthest < -2.4e-7 * size * length(normal);
}

// Whether a triangle with this sign of its area in the map casts: of closed bodies only what is turned away from the light, as any
// ray from outside that one blocks meets such a triangle too; of others both sides.
fn casts(area: f32, zero: f32, closed: bool) -> bool {
    let sided = select(conservative.casters, select(2u, 1u, closed), conservative.casters == casters_auto);
    // y runs downwards: what turns its front to the light has a negative area.
    return abs(area) <= zero || sided == 2u || (area > 0.0) == (sided == 1u);
}

fn add(caster: Caster, closed: bool, other: Beyond) {
    let face = light_view.layer;
    let room = arrayLength(&casters);
    if atomicAdd(&gathered[face].casters[3], 1u) >= room {
        atomicAdd(&gathered[face].casters[2], 1u);
        return;
    }
    let i = atomicAdd(&gathered[face].casters[select(1u, 0u, closed)], 1u);
    let at = select(room - 1u - i, i, closed);
    casters[at] = caster;
    if conservative.mode != mode_none {
        beyond[at] = other;
        for (var k = 0u; k < 3u; k++) {
            if (caster.bits & (1u << k)) != 0u {
                let band = atomicAdd(&gathered[face].bands, 1u);
                if band < arrayLength(&bands) {
                    bands[band] = 4u * at + k;
                }
            }
        }
    }
}

fn keep_plane(i: u32, plane: vec4f) {
    let at = light_view.layer * (arrayLength(&neighbours) / 2u) + i;
    if conservative.self_plane != 0u && at < arrayLength(&own_planes) {
        own_planes[at] = plane;
    }
}

// Places so far beside the map that their rounding counts in it.
fn far_off(v: LightView, at: vec2f) -> bool {
    return max(abs(at.x), abs(at.y)) > 16.0 * v.resolution;
}

const row = 2097152u;

// Whether lamps are served, so that triangles may pass their plane.
override lamp = false;

@compute @workgroup_size(64)
fn gather(@builtin(global_invocation_id) id: vec3u) {
    let i = id.x + id.y * row;
    // Nothing is asked of a face that no lit sample lies in.
    if 2u * i + 1u >= arrayLength(&neighbours) || atomicLoad(&gathered[light_view.layer].seen[0]) == 0u {
        return;
    }
    let t = neighbours[2u * i + 1u];
    let beside = neighbours[2u * i];
    let closed = (beside.w & 1u) != 0u && conservative.casters == casters_auto;
    keep_plane(i, vec4f(0.0));
    let v = light_view;
    let p = vertex_position(t.x);
    let q = vertex_position(t.y);
    let r = vertex_position(t.z);
    let a = spot_of(v, p);
    let b = spot_of(v, q);
    let c = spot_of(v, r);
    // Lit side of the plane.
    var normal = cross(q - p, r - p);
    let to_light = select(frame.light_position - p, frame.light_position, frame.light_kind == directional);
    normal = select(normal, -normal, dot(normal, to_light) < 0.0);
    if !may_shadow(p, normal) {
        return;
    }
    if lamp && min(min(a.w, b.w), c.w) < 1e-3 * v.near {
        if max(max(a.w, b.w), c.w) >= 1e-3 * v.near {
            add_pieces(i, p, q, r);
        }
        return;
    }
    let area = doubled_area(a.at, b.at, c.at);
    let longest = max(max(distance(a.at, b.at), distance(b.at, c.at)), distance(c.at, a.at));
    let size = max(max(max(abs(a.at.x), abs(a.at.y)), max(abs(b.at.x), abs(b.at.y))), max(abs(c.at.x), abs(c.at.y)));
    let zero = 1e-6 * longest * max(size, v.resolution);
    if !casts(area, zero, (beside.w & 1u) != 0u) {
        return;
    }
    let grown = shift_most();
    let low = min(min(a.at, b.at), c.at) - grown;
    let high = max(max(a.at, b.at), c.at) + grown;
    let near = max(max(a.depth, b.depth), c.depth);
    if any(high < vec2f(0.0)) || any(low > vec2f(v.resolution)) || near < 0.0 {
        return;
    }
    if lamp && (far_off(v, a.at) || far_off(v, b.at) || far_off(v, c.at)) {
        add_pieces(i, p, q, r);
        return;
    }
    let far = min(min(a.depth, b.depth), c.depth);
    let slope = slope_of(a, b, c);
    if !closed {
        keep_plane(i, vec4f(slope, near, 1.0));
    }
    var caster = Caster(a.at, b.at, c.at, vec2f(near, far), slope, a.depth, 0u);
    var other: Beyond;
    if (beside.w & 2u) != 0u && abs(area) > zero {
        caster.bits = 64u;
        if conservative.mode != mode_none {
            let corners = array<Spot, 3>(a, b, c);
            let own_vertices = array<u32, 3>(t.x, t.y, t.z);
            for (var k = 0u; k < 3u; k++) {
                let vertex = beside[k];
                if vertex != no_vertex {
                    let o = spot_of(v, vertex_position(vertex));
                    let first = corners[k];
                    let second = corners[(k + 1u) % 3u];
                    // On the other side of the edge, so that it is turned as this one is.
                    let away = doubled_area(first.at, second.at, o.at);
                    if away * area < 0.0 && abs(away) > zero && (!lamp || (o.w >= 1e-3 * v.near && !far_off(v, o.at))) {
                        caster.bits |= 1u << k;
                        other.sides[k] = vec4f(o.at, slope_of(first, o, second));
                        other.ends[k] = min(min(first.depth, second.depth), o.depth);
                    }
                }
                if conservative.mode == mode_fan {
                    let around = fans_around[own_vertices[k]];
                    // Their areas' sign stands in w.
                    if around.w * area > 0.0 {
                        caster.bits |= 8u << k;
                        other.around[k] = around;
                    }
                }
            }
        }
    }
    add(caster, closed, other);
}

// A triangle that passes the lamp's plane or reaches far beside the map, cut down to what lies before the lamp and not far beside the map. Its pieces
// hide what lies behind them, but are never relied on to do so.
fn add_pieces(i: u32, p: vec3f, q: vec3f, r: vec3f) {
    let v = light_view;
    var corners: array<vec4f, 9>;
    var cut: array<vec4f, 9>;
    corners[0] = light_clip(v, p);
    corners[1] = light_clip(v, q);
    corners[2] = light_clip(v, r);
    var n = 3u;
    for (var plane = 0u; plane < 5u; plane++) {
        var m = 0u;
        for (var k = 0u; k < n; k++) {
            let here = corners[k];
            let next = corners[(k + 1u) % n];
            let d = inside(plane, here);
            let e = inside(plane, next);
            if d >= 0.0 {
                cut[m] = here;
                m++;
            }
            if (d >= 0.0) != (e >= 0.0) && m < 9u {
                cut[m] = mix(here, next, d / (d - e));
                m++;
            }
        }
        n = m;
        for (var k = 0u; k < n; k++) {
            corners[k] = cut[k];
        }
    }
    for (var k = 2u; k < n; k++) {
        let a = Spot(light_texel(v, corners[0]), corners[0].z / corners[0].w, 1.0);
        let b = Spot(light_texel(v, corners[k - 1u]), corners[k - 1u].z / corners[k - 1u].w, 1.0);
        let c = Spot(light_texel(v, corners[k]), corners[k].z / corners[k].w, 1.0);
        let near = max(max(a.depth, b.depth), c.depth);
        let far = min(min(a.depth, b.depth), c.depth);
        let slope = slope_of(a, b, c);
        keep_plane(i, vec4f(slope, 3.4e38, 1.0));
        var other: Beyond;
        add(Caster(a.at, b.at, c.at, vec2f(near, far), slope, a.depth, 0u), false, other);
    }
}

// How far a clip position lies inside of what is kept.
fn inside(plane: u32, clip: vec4f) -> f32 {
    switch plane {
        case 0u: { return clip.w - 1e-3 * light_view.near; }
        case 1u: { return 2.0 * clip.w - clip.x; }
        case 2u: { return 2.0 * clip.w + clip.x; }
        case 3u: { return 2.0 * clip.w - clip.y; }
        default: { return 2.0 * clip.w + clip.y; }
    }
}

// Of each vertex where its triangles stand in `fan_triangles`: the first, how many (0: there is a gap around it), and the first
// vertex at the same place.
var<storage, read> fans: array<vec4u>;
// Triangles × 4 + the corner.
var<storage, read> fan_triangles: array<u32>;
// Of each first vertex: how far around it triangles reach, texels; the steepest; the farthest depth; the sign of their areas in the
// map, 0 if they differ.
var<storage, read_write> fans_around: array<vec4f>;

@compute @workgroup_size(64)
fn look_around(@builtin(global_invocation_id) id: vec3u) {
    let i = id.x + id.y * row;
    if i >= arrayLength(&fans_around) || i >= arrayLength(&fans) {
        return;
    }
    let fan = fans[i];
    if fan.z != i {
        return;
    }
    let v = light_view;
    let middle = spot_of(v, vertex_position(i));
    var reach = 1e9;
    var steepest = 0.0;
    var far = middle.depth;
    var sign = 0.0;
    var whole = fan.y > 0u && middle.w >= 1e-3 * v.near;
    for (var k = 0u; k < fan.y; k++) {
        let entry = fan_triangles[fan.x + k];
        let t = triangle_at(entry >> 2u);
        let corner = entry & 3u;
        let b = spot_of(v, vertex_position(t[(corner + 1u) % 3u]));
        let c = spot_of(v, vertex_position(t[(corner + 2u) % 3u]));
        let area = doubled_area(middle.at, b.at, c.at);
        let longest = max(distance(middle.at, b.at), distance(middle.at, c.at));
        sign = select(sign, area, k == 0u);
        whole = whole && area * sign > 0.0 && abs(area) > 1e-6 * longest * v.resolution && min(b.w, c.w) >= 1e-3 * v.near;
        reach = min(reach, abs(area) / max(distance(b.at, c.at), 1e-9));
        steepest = max(steepest, length(slope_of(middle, b, c)));
        far = min(far, min(b.depth, c.depth));
    }
    fans_around[i] = vec4f(reach, steepest, far, select(0.0, select(-1.0, 1.0, sign > 0.0), whole));
}

// Draws: a triangle of each caster of closed bodies, of each other; two of each; two of each band.
var<storage, read_write> draws: array<u32>;

fn arrange_draw(i: u32, first: u32, count: u32) {
    draws[4u * i] = count;
    draws[4u * i + 1u] = 1u;
    draws[4u * i + 2u] = first;
    draws[4u * i + 3u] = 0u;
}

@compute @workgroup_size(1)
fn arrange() {
    let room = arrayLength(&casters);
    let closed = atomicLoad(&gathered[light_view.layer].casters[0]);
    let others = atomicLoad(&gathered[light_view.layer].casters[1]);
    arrange_draw(0u, 0u, 3u * closed);
    arrange_draw(1u, 3u * (room - others), 3u * others);
    arrange_draw(2u, 0u, 6u * closed);
    arrange_draw(3u, 6u * (room - others), 6u * others);
    arrange_draw(4u, 0u, 6u * min(atomicLoad(&gathered[light_view.layer].bands), arrayLength(&bands)));
}

// Rounding of places, and what the rasteriser moves corners by, texels.
fn spare_texels() -> f32 {
    // A sun's rays start off their surfaces by a share of the largest coordinate, and corners are rounded by it.
    let size = max(abs(frame.bounds_min), abs(frame.bounds_max));
    let moved = 1.5e-6 * max(size.x, max(size.y, size.z)) / max(light_view.texel, 1e-12);
    return 0.02 + 2e-6 * light_view.resolution + select(0.0, min(moved, 0.5), frame.light_kind == directional);
}

// How far an edge with this unit normal is moved, texels: by half a texel's diagonal, or just so far that a square that touches it
// is held.
fn shift(normal: vec2f) -> f32 {
    let tight = 0.5 * (abs(normal.x) + abs(normal.y));
    return conservative.eta * select(0.70710678, tight, conservative.shift == shift_tight) + spare_texels();
}

fn shift_most() -> f32 {
    return conservative.eta * 0.70710678 + spare_texels();
}

// Half the sides of the square that depths are asked of.
fn half_square() -> f32 {
    return 0.5 + spare_texels();
}

// Unit normal and offset of the line ab, positive on the side that c lies on where `turned` is the sign of abc's area.
fn line_of(a: vec2f, b: vec2f, turned: f32) -> vec3f {
    let e = b - a;
    let n = turned * vec2f(-e.y, e.x) / max(length(e), 1e-12);
    return vec3f(n, -dot(n, a));
}

fn clip_of(at: vec2f, depth: f32) -> vec4f {
    let side = light_view.resolution;
    return vec4f(2.0 * at.x / side - 1.0, 1.0 - 2.0 * at.y / side, depth, 1.0);
}

var<storage, read> drawn: array<Caster>;

// A caster's edges as lines, and how it is drawn.
struct Shape {
    x: vec3f,
    y: vec3f,
    z: vec3f,
    // Moved outwards its edges would meet far away.
    spiked: bool,
    // It is drawn as it is, moved outwards: so wide that its depth there lies little beyond its own range.
    plain: bool,
}

// By how much depth may differ within a texel from that at its middle.
fn rise(slope: vec2f) -> f32 {
    return select(0.0, half_square() * (abs(slope.x) + abs(slope.y)), conservative.safe_depth != 0u);
}

fn shape_of(t: Caster) -> Shape {
    let turned = select(-1.0, 1.0, doubled_area(t.a, t.b, t.c) > 0.0);
    let sides = vec3f(distance(t.a, t.b), distance(t.b, t.c), distance(t.c, t.a));
    let longest = max(max(sides.x, sides.y), sides.z);
    let area = abs(doubled_area(t.a, t.b, t.c));
    let h = shift_most();
    let scale = 1.0 + h * (sides.x + sides.y + sides.z) / max(area, 1e-12);
    let width = area / max(longest, 1e-12);
    let spiked = !(0.5 * area * scale * scale < (longest + 2.0 * h) * (width + 2.0 * h)) || width < 1e-3 || min(min(sides.x, sides.y), sides.z) < 1e-3;
    let x = line_of(t.a, t.b, turned);
    let y = line_of(t.b, t.c, turned);
    let z = line_of(t.c, t.a, turned);
    // Corners of 37° and more move by less than 3.2 times the shift.
    let blunt = 1.0 + min(min(dot(x.xy, y.xy), dot(y.xy, z.xy)), dot(z.xy, x.xy)) >= 0.2;
    // Wholly between the near and the far plane, also where it is grown.
    let more = rise(t.slope) + 3.2 * h * length(t.slope);
    let plain = blunt && !spiked && width >= 2.0 && t.ends.x + more < 1.0 && t.ends.y - more > 0.0;
    return Shape(x, y, z, spiked, plain);
}

// Where the lines n and m meet, moved inwards by h.x and h.y, seen from where they meet unmoved.
fn moved(n: vec2f, m: vec2f, h: vec2f) -> vec2f {
    let determinant = n.x * m.y - n.y * m.x;
    return vec2f(h.x * m.y - h.y * n.y, h.y * n.x - h.x * m.x) / select(determinant, 1e-12, determinant == 0.0);
}

// The corner k of a caster with its edges moved by the share `by` of their shift: outwards -1, inwards 1.
fn moved_corner(t: Caster, s: Shape, k: u32, by: f32) -> vec2f {
    let n = select(select(s.y.xy, s.x.xy, k == 1u), s.z.xy, k == 0u);
    let m = select(select(s.z.xy, s.y.xy, k == 1u), s.x.xy, k == 0u);
    let corner = select(select(t.c, t.b, k == 1u), t.a, k == 0u);
    return corner + moved(n, m, by * vec2f(shift(n), shift(m)));
}

// Casters that are drawn without a look at each texel.
@vertex
fn grow_plain(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    let t = drawn[index / 3u];
    let s = shape_of(t);
    let at = moved_corner(t, s, index % 3u, -1.0);
    let depth = t.depth + dot(t.slope, at - t.a) + rise(t.slope);
    return select(vec4f(0.0, 0.0, 0.5, 1.0), clip_of(at, depth), s.plain);
}

// What each caster covers wholly by itself.
@vertex
fn shrink(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    let t = drawn[index / 3u];
    let s = shape_of(t);
    let k = index % 3u;
    let at = moved_corner(t, s, k, 1.0);
    // Of a small one nothing is left: where two moved edges meet lies beyond the third.
    let third = select(select(s.x, s.z, k == 1u), s.y, k == 0u);
    let left = dot(third, vec3f(at, 1.0)) > shift(third.xy) && (t.bits & 64u) != 0u;
    let depth = t.depth + dot(t.slope, at - t.a) - rise(t.slope);
    return select(vec4f(0.0, 0.0, 0.5, 1.0), clip_of(at, depth), left);
}

struct Grown {
    @builtin(position) clip: vec4f,
    // The lines of its edges.
    @location(0) @interpolate(flat, either) x: vec3f,
    @location(1) @interpolate(flat, either) y: vec3f,
    @location(2) @interpolate(flat, either) z: vec3f,
    // Its box, grown.
    @location(3) @interpolate(flat, either) extent: vec4f,
    // A place, and the depth and its change there.
    @location(4) @interpolate(flat, either) plane: vec4f,
    @location(5) @interpolate(flat, either) rest: vec4f,
}

// The other casters: two triangles that hold all texels whose squares one touches. Its own with each edge moved outwards, or, where
// that has spikes, the box along its longest side.
@vertex
fn grow(@builtin(vertex_index) index: u32) -> Grown {
    let t = drawn[index / 6u];
    let s = shape_of(t);
    let h = shift_most();
    let k = index % 6u;
    let aside = conservative.eta * 0.5 + spare_texels();
    let low = min(min(t.a, t.b), t.c) - aside;
    let high = max(max(t.a, t.b), t.c) + aside;
    var at = t.a;
    if s.spiked {
        // Along the longest side.
        let sides = vec3f(distance(t.a, t.b), distance(t.b, t.c), distance(t.c, t.a));
        let longest = max(max(sides.x, sides.y), sides.z);
        var start = t.a;
        var end = t.b;
        var tip = t.c;
        if sides.y >= longest {
            start = t.b;
            end = t.c;
            tip = t.a;
        } else if sides.z >= longest {
            start = t.c;
            end = t.a;
            tip = t.b;
        }
        let u = select(vec2f(1.0, 0.0), (end - start) / max(longest, 1e-12), longest > 1e-6);
        let off = vec2f(-u.y, u.x);
        let along = vec3f(0.0, dot(end - start, u), dot(tip - start, u));
        let across = vec2f(0.0, dot(tip - start, off));
        let first = vec2f(min(min(along.x, along.y), along.z), min(across.x, across.y)) - h;
        let last = vec2f(max(max(along.x, along.y), along.z), max(across.x, across.y)) + h;
        let right = k == 1u || k == 2u || k == 4u;
        let upper = k == 2u || k == 4u || k == 5u;
        let place = vec2f(select(first.x, last.x, right), select(first.y, last.y, upper));
        at = start + place.x * u + place.y * off;
    } else if k < 3u {
        at = moved_corner(t, s, k, -1.0);
    }
    let clip = select(clip_of(at, 0.5), vec4f(0.0, 0.0, 0.5, 1.0), s.plain);
    return Grown(clip, s.x, s.y, s.z, vec4f(low, high), vec4f(t.a, t.depth, 0.0), vec4f(t.slope, t.ends));
}

@fragment
fn keep_grown(in: Grown) -> @builtin(frag_depth) f32 {
    let p = vec3f(in.clip.xy, 1.0);
    let outside = dot(in.x, p) < -shift(in.x.xy) || dot(in.y, p) < -shift(in.y.xy) || dot(in.z, p) < -shift(in.z.xy);
    if outside || any(p.xy < in.extent.xy) || any(p.xy > in.extent.zw) {
        discard;
    }
    let depth = in.plane.z + dot(in.rest.xy, p.xy - in.plane.xy) + rise(in.rest.xy);
    return saturate(clamp(depth, in.rest.w, in.rest.z));
}

var<storage, read> beyond_drawn: array<Beyond>;

struct Shrunk {
    @builtin(position) clip: vec4f,
    @location(0) @interpolate(flat, either) a: vec4f,
    @location(1) @interpolate(flat, either) b: vec4f,
    @location(2) @interpolate(flat, either) c: vec4f,
    @location(3) @interpolate(flat, either) x: vec4f,
    @location(4) @interpolate(flat, either) y: vec4f,
    @location(5) @interpolate(flat, either) z: vec4f,
    @location(6) @interpolate(flat, either) ends: vec4f,
    @location(7) @interpolate(flat, either) around_a: vec4f,
    @location(8) @interpolate(flat, either) around_b: vec4f,
    @location(9) @interpolate(flat, either) around_c: vec4f,
}

var<storage, read> bands_drawn: array<u32>;

// Two triangles along an edge behind which a neighbour casts: the texels there that cross it.
@vertex
fn shrink_band(@builtin(vertex_index) index: u32) -> Shrunk {
    let band = bands_drawn[index / 6u];
    let t = drawn[band >> 2u];
    let other = beyond_drawn[band >> 2u];
    let edge = band & 3u;
    let start = select(select(t.c, t.b, edge == 1u), t.a, edge == 0u);
    let end = select(select(t.a, t.c, edge == 1u), t.b, edge == 0u);
    let turned = select(-1.0, 1.0, doubled_area(t.a, t.b, t.c) > 0.0);
    let inwards = line_of(start, end, turned).xy;
    let u = (end - start) / max(distance(start, end), 1e-12);
    let h = shift_most();
    let k = index % 6u;
    let right = k == 1u || k == 2u || k == 4u;
    let inner = k == 2u || k == 4u || k == 5u;
    // A little beyond the edge, so that no texel on it is lost between the two.
    let at = select(start - h * u, end + h * u, right) + select(-0.02, h, inner) * inwards;
    return Shrunk(
        clip_of(at, 0.5), vec4f(t.a, t.depth, bitcast<f32>(t.bits | 0x40000000u)), vec4f(t.b, t.slope), vec4f(t.c, t.ends),
        other.sides[0], other.sides[1], other.sides[2], other.ends, other.around[0], other.around[1], other.around[2]);
}

// Whether a texel's square lies within the neighbour across the edge ab, but for that edge: within the lines to its opposite
// corner.
fn holds_rest(p: vec3f, a: vec2f, b: vec2f, opposite: vec2f, turned: f32) -> bool {
    // The neighbour runs along the edge from b to a.
    let first = line_of(a, opposite, turned);
    let second = line_of(opposite, b, turned);
    return dot(first, p) >= shift(first.xy) && dot(second, p) >= shift(second.xy);
}

// Whether all around a corner hold the square.
fn holds_corner(p: vec2f, corner: vec2f, around: vec4f) -> bool {
    return distance(p, corner) + shift_most() <= around.x;
}

@fragment
fn keep_shrunk(in: Shrunk) -> @builtin(frag_depth) f32 {
    let p = vec3f(in.clip.xy, 1.0);
    let turned = select(-1.0, 1.0, doubled_area(in.a.xy, in.b.xy, in.c.xy) > 0.0);
    let x = line_of(in.a.xy, in.b.xy, turned);
    let y = line_of(in.b.xy, in.c.xy, turned);
    let z = line_of(in.c.xy, in.a.xy, turned);
    let crossed = vec3<bool>(dot(x, p) < shift(x.xy), dot(y, p) < shift(y.xy), dot(z, p) < shift(z.xy));
    let at = in.a.z + dot(in.b.zw, p.xy - in.a.xy);
    var depth = clamp(at - rise(in.b.zw), in.c.w, in.c.z);
    if any(crossed) {
        let bits = bitcast<u32>(in.a.w);
        var held = false;
        if u32(crossed.x) + u32(crossed.y) + u32(crossed.z) == 1u {
            // Across one edge: the neighbour there holds the rest.
            var edge = 0u;
            var first = in.a.xy;
            var second = in.b.xy;
            var side = in.x;
            var end = in.ends.x;
            var start_depth = in.a.z;
            if crossed.y {
                edge = 1u;
                first = in.b.xy;
                second = in.c.xy;
                side = in.y;
                end = in.ends.y;
            } else if crossed.z {
                edge = 2u;
                first = in.c.xy;
                second = in.a.xy;
                side = in.z;
                end = in.ends.z;
            }
            start_depth += dot(in.b.zw, first - in.a.xy);
            held = (bits & (1u << edge)) != 0u && holds_rest(p, first, second, side.xy, turned);
            let other = start_depth + dot(side.zw, p.xy - first) - rise(side.zw);
            depth = select(depth, min(depth, max(other, end)), held);
        }
        if !held && conservative.mode == mode_fan {
            var corner = in.a.xy;
            var around = in.around_a;
            var bit = 8u;
            let far = vec3f(distance(p.xy, in.a.xy), distance(p.xy, in.b.xy), distance(p.xy, in.c.xy));
            if far.y < far.x && far.y <= far.z {
                corner = in.b.xy;
                around = in.around_b;
                bit = 16u;
            } else if far.z < far.x {
                corner = in.c.xy;
                around = in.around_c;
                bit = 32u;
            }
            held = (bits & bit) != 0u && holds_corner(p.xy, corner, around);
            let at_corner = in.a.z + dot(in.b.zw, corner - in.a.xy);
            let reach = distance(p.xy, corner) + shift_most();
            depth = select(depth, min(depth, max(at_corner - around.y * reach, around.z)), held);
        }
        if !held {
            discard;
        }
    }
    return saturate(depth);
}
