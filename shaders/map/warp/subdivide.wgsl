// Casters moved through the warp corner by corner, and split where the warp bends their edges.

// A triangle or a part of one: corners in world space; their w: the triangle's number as bits, and c's texture
// coordinates; `uv`: those of a and b; `alphas`: what colours take off alpha there.
struct Piece {
    a: vec4f,
    b: vec4f,
    c: vec4f,
    uv: vec4f,
    alphas: vec4f,
}

struct Level {
    // 0: the scene's triangles. Pieces of level n lie in the half n mod 2 of `work`.
    number: u32,
    // No piece is split further.
    last: u32,
    // Most pieces of a level, and most that are drawn.
    most: u32,
    most_drawn: u32,
}

var<uniform> level: Level;
var<storage, read_write> work: array<Piece>;
var<storage, read_write> pieces: array<Piece>;
var<storage, read> drawn_pieces: array<Piece>;
// A bit a triangle: whether the map holds a part of it with its sides exchanged.
var<storage, read_write> folds: array<atomic<u32>>;
// Where the centre of each texel lies before the warp.
var<storage, read_write> texel_rays: array<vec2f>;
var<storage, read> drawn_texel_rays: array<vec2f>;

// From here on in `state.counters`: how many pieces each level has, and how many it draws.
const of_level = 5u;
const drawn_of_level = 32u;

struct Part {
    a: Corner,
    b: Corner,
    c: Corner,
    triangle: u32,
}

fn packed(t: Part) -> Piece {
    return Piece(vec4f(t.a.position, bitcast<f32>(t.triangle)), vec4f(t.b.position, t.c.uv.x),
                 vec4f(t.c.position, t.c.uv.y), vec4f(t.a.uv.xy, t.b.uv.xy), vec4f(t.a.uv.z, t.b.uv.z, t.c.uv.z, 0.0));
}

fn unpacked(p: Piece) -> Part {
    return Part(Corner(p.a.xyz, vec3f(p.uv.xy, p.alphas.x)), Corner(p.b.xyz, vec3f(p.uv.zw, p.alphas.y)),
                Corner(p.c.xyz, vec3f(p.b.w, p.c.w, p.alphas.z)),
                bitcast<u32>(p.a.w));
}

fn tile_of(texel: f32) -> u32 {
    return u32(clamp(texel, 0.0, map_side() - 1.0)) * 64u / u32(map_side());
}

// Marks the tiles that view samples look into.
@compute @workgroup_size(8, 8)
fn need(@builtin(global_invocation_id) id: vec3u) {
    let s = view_sample(id.xy);
    if !s.valid {
        return;
    }
    let texel = looked_up(s).texel;
    let x = tile_of(texel.x);
    let word = 2u * tile_of(texel.y) + x / 32u;
    let bit = 1u << (x & 31u);
    if (atomicLoad(&state.tiles[word]) & bit) == 0u {
        atomicOr(&state.tiles[word], bit);
    }
}

// Marks the tiles of the light's image that the rays of needed texels lie in: a thread a tile of the map.
@compute @workgroup_size(64)
fn spread(@builtin(global_invocation_id) id: vec3u) {
    follow(light_view);
    let tile = vec2u(id.x % 64u, id.x / 64u);
    if (atomicLoad(&state.tiles[2u * tile.y + tile.x / 32u]) >> (tile.x & 31u) & 1u) == 0u {
        return;
    }
    // A texel more on each side, as drawn edges lie a little beside their places.
    let low = vec2f(tile) / 64.0 - 1.0 / map_side();
    let high = vec2f(tile + 1u) / 64.0 + 1.0 / map_side();
    let steps = u32(ceil(map_side() / 64.0)) + 2u;
    var first = vec2f(1.0);
    var last = vec2f(0.0);
    for (var i = 0u; i <= steps; i++) {
        let t = f32(i) / f32(steps);
        let x = mix(low.x, high.x, t);
        let y = mix(low.y, high.y, t);
        var border = array<vec2f, 4>(vec2f(x, low.y), vec2f(x, high.y), vec2f(low.x, y), vec2f(high.x, y));
        for (var k = 0u; k < 4u; k++) {
            let u = unwarp(saturate(border[k]));
            first = min(first, u);
            last = max(last, u);
        }
    }
    let x0 = u32(clamp(first.x * 64.0, 0.0, 63.0));
    let x1 = u32(clamp(last.x * 64.0, 0.0, 63.0));
    for (var half = 0u; half < 2u; half++) {
        let bits = tile_bits(x0, x1, half);
        for (var y = u32(clamp(first.y * 64.0, 0.0, 63.0)); bits != 0u && y <= u32(clamp(last.y * 64.0, 0.0, 63.0)); y++) {
            atomicOr(&state.image_tiles[2u * y + half], bits);
        }
    }
}

// Whether a view sample needs a texel in a box of the map, texels.
fn needed(low: vec2f, high: vec2f) -> bool {
    if !(all(high >= vec2f(0.0)) && all(low <= vec2f(map_side()))) {
        return false;
    }
    let x0 = tile_of(low.x);
    let x1 = tile_of(high.x);
    for (var half = 0u; half < 2u; half++) {
        let bits = tile_bits(x0, x1, half);
        for (var y = tile_of(low.y); bits != 0u && y <= tile_of(high.y); y++) {
            if (atomicLoad(&state.tiles[2u * y + half]) & bits) != 0u {
                return true;
            }
        }
    }
    return false;
}

// A thread per texel.
@compute @workgroup_size(64)
fn trace_rays(@builtin(global_invocation_id) id: vec3u) {
    follow(light_view);
    let side = u32(map_side());
    if light_view.idle == 0u && id.x < side {
        texel_rays[id.y * side + id.x] = unwarp((vec2f(id.xy) + 0.5) / map_side());
    }
}

// The part of a segment inside the unit square, as shares of its length; y < x: none.
fn inside(a: vec2f, b: vec2f) -> vec2f {
    var span = vec2f(0.0, 1.0);
    let d = b - a;
    for (var i = 0u; i < 2u; i++) {
        if d[i] == 0.0 {
            if a[i] < 0.0 || a[i] > 1.0 {
                return vec2f(1.0, 0.0);
            }
            continue;
        }
        let t = (vec2f(0.0, 1.0) - a[i]) / d[i];
        span = vec2f(max(span.x, min(t.x, t.y)), min(span.y, max(t.x, t.y)));
    }
    return span;
}

// What is known of an edge, the same from both its sides: so neighbours split alike and leave no crack.
struct Edge {
    split: bool,
    // Where it is split.
    middle: Corner,
}

// Where a place at a share t between two projected points lies between their points in space.
fn in_space(t: f32, wa: f32, wb: f32) -> f32 {
    return t * wa / ((1.0 - t) * wb + t * wa);
}

// Distance of a place from a segment.
fn off_segment(at: vec2f, start: vec2f, end: vec2f) -> f32 {
    let d = end - start;
    let t = saturate(dot(at - start, d) / max(dot(d, d), 1e-20));
    return distance(at, start + t * d);
}

fn judge(one: Corner, other: Corner) -> Edge {
    var first = one;
    var second = other;
    if precedes(other.position, one.position) {
        first = other;
        second = one;
    }
    let a = unwarped_place(first.position);
    let b = unwarped_place(second.position);
    let start = warped(a.xy);
    let end = warped(b.xy);
    if curved() {
        return judge_arc(first, second, start, end);
    }
    let span = inside(a.xy, b.xy);
    if span.y <= span.x {
        return Edge(false, between(first, second, 0.5));
    }
    let middle = clamp(0.5 * (span.x + span.y), 0.02, 0.98);
    var e = Edge(false, between(first, second, in_space(middle, a.z, b.z)));
    let length_inside = (span.y - span.x) * length(b.xy - a.xy);
    // A curve shorter than a texel is not worth a corner.
    if max(length_inside, (span.y - span.x) * distance(start, end)) * map_side() <= 1.0 {
        return e;
    }
    // Every bend.
    let number = u32(clamp(ceil(length_inside * warp_bends()), 2.0, 128.0));
    for (var i = 0u; i <= number && !e.split; i++) {
        let at = warped(mix(a.xy, b.xy, mix(span.x, span.y, f32(i) / f32(number))));
        e.split = off_segment(at, start, end) * map_side() > raster.tolerance;
    }
    return e;
}

// The same of an edge that is an arc before the warp: asked at places along it in space, as far as the image has them.
fn judge_arc(first: Corner, second: Corner, start: vec2f, end: vec2f) -> Edge {
    var e = Edge(false, between(first, second, 0.5));
    let long = distance(unwarped_place(first.position).xy, unwarped_place(second.position).xy);
    if max(long, distance(start, end)) * map_side() <= 1.0 {
        return e;
    }
    let number = u32(clamp(ceil(long * warp_bends()), 8.0, 128.0));
    for (var i = 1u; i < number && !e.split; i++) {
        let u = unwarped_place(between(first, second, f32(i) / f32(number)).position).xy;
        let seen = all(u > vec2f(-0.01)) && all(u < vec2f(1.01));
        e.split = seen && off_segment(warped(u), start, end) * map_side() > raster.tolerance;
    }
    return e;
}

// Whether a box of the map holds the centre of a texel.
fn holds_centre(low: vec2f, high: vec2f) -> bool {
    return all(ceil(low - 0.5) <= floor(high - 0.5));
}

// Draws a piece, unless it lies between the centres of texels; true if it is drawn.
fn draw(t: Part) -> bool {
    let a = unwarped_place(t.a.position).xy;
    let b = unwarped_place(t.b.position).xy;
    let c = unwarped_place(t.c.position).xy;
    let before = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
    let wa = warped(a) * map_side();
    let wb = warped(b) * map_side();
    let wc = warped(c) * map_side();
    let after = (wb.x - wa.x) * (wc.y - wa.y) - (wb.y - wa.y) * (wc.x - wa.x);
    // Some room for the rasteriser's own rounding.
    if !holds_centre(min(min(wa, wb), wc) - 0.01, max(max(wa, wb), wc) + 0.01) {
        return false;
    }
    // Not slivers that rounding turns over.
    if before * after < 0.0 && abs(after) > 0.02 {
        atomicAdd(&state.counters[fold_count], 1u);
        atomicOr(&folds[t.triangle / 32u], 1u << (t.triangle & 31u));
    }
    // There is room: see `full`. Where it stands in the list changes nothing: the nearest is kept.
    let at = drawn_before(level.number) + atomicAdd(&state.counters[drawn_of_level + level.number], 1u);
    pieces[at] = packed(t);
    return true;
}

// How many pieces the levels before this one draw.
fn drawn_before(number: u32) -> u32 {
    var sum = 0u;
    for (var k = 0u; k < number; k++) {
        sum += atomicLoad(&state.counters[drawn_of_level + k]);
    }
    return sum;
}

// Whether a level has more pieces than there is room for. Then the level before it splits none: which ones found room
// would be chance, and cracks would open between them and the others. All triangles find room, by the size of the list.
fn full(number: u32) -> bool {
    let its = atomicLoad(&state.counters[of_level + number]);
    return its > level.most || drawn_before(number) + its > level.most_drawn;
}

// The triangles that a triangle falls into when some of its edges are split, 3 bits each for corners and edges: 0 to 2
// a, b, c; 3 to 5 the middles of ab, bc, ca. By the mask of split edges; bits 30 and 31: the number of triangles less one.
const patterns = array<u32, 8>(
    0u,
    // ab: a p c, p b c.
    (1u << 30u) | 0u | (3u << 3u) | (2u << 6u) | (3u << 9u) | (1u << 12u) | (2u << 15u),
    // bc: a b q, a q c.
    (1u << 30u) | 0u | (1u << 3u) | (4u << 6u) | (0u << 9u) | (4u << 12u) | (2u << 15u),
    // ab, bc: p b q, a p q, a q c.
    (2u << 30u) | 3u | (1u << 3u) | (4u << 6u) | (0u << 9u) | (3u << 12u) | (4u << 15u) | (0u << 18u) | (4u << 21u) | (2u << 24u),
    // ca: a b r, r b c.
    (1u << 30u) | 0u | (1u << 3u) | (5u << 6u) | (5u << 9u) | (1u << 12u) | (2u << 15u),
    // ab, ca: a p r, p b c, r p c.
    (2u << 30u) | 0u | (3u << 3u) | (5u << 6u) | (3u << 9u) | (1u << 12u) | (2u << 15u) | (5u << 18u) | (3u << 21u) | (2u << 24u),
    // bc, ca: r q c, a b q, a q r.
    (2u << 30u) | 5u | (4u << 3u) | (2u << 6u) | (0u << 9u) | (1u << 12u) | (4u << 15u) | (0u << 18u) | (4u << 21u) | (5u << 24u),
    // All: a p r, p b q, r q c, and p q r last.
    (3u << 30u) | 0u | (3u << 3u) | (5u << 6u) | (3u << 9u) | (1u << 12u) | (4u << 15u) | (5u << 18u) | (4u << 21u) | (2u << 24u));

// Draws a part, splits it for the next level, or drops it if no view sample needs what it covers. `again`: it was to be
// split, but the level that its parts would be in is full. True if it is kept.
fn handle(t: Part, again: bool) -> bool {
    let ua = unwarped_place(t.a.position);
    let ub = unwarped_place(t.b.position);
    let uc = unwarped_place(t.c.position);
    if raster.raster == raster_linear {
        let a = warped(ua.xy) * map_side();
        let b = warped(ub.xy) * map_side();
        let c = warped(uc.xy) * map_side();
        let kept = needed(min(min(a, b), c), max(max(a, b), c));
        if kept {
            _ = draw(t);
        }
        return kept;
    }
    let image = unwarped_box(array<vec3f, 3>(t.a.position, t.b.position, t.c.position));
    if !image_needed(image.low, image.high) {
        return false;
    }
    var corners = array<Corner, 6>(t.a, t.b, t.c, t.a, t.b, t.c);
    var mask = 0u;
    for (var k = 0u; k < 3u; k++) {
        let e = judge(corners[k], corners[(k + 1u) % 3u]);
        mask |= u32(e.split) << k;
        corners[3u + k] = e.middle;
    }
    let unsplit = mask != 0u && (again || level.last == 1u);
    if (unsplit || (mask == 0u && !again)) && draw(t) && unsplit {
        atomicAdd(&state.counters[unserved_count], 1u);
    }
    if unsplit || mask == 0u {
        return true;
    }
    let pattern = patterns[mask];
    let number = (pattern >> 30u) + 1u;
    let at = atomicAdd(&state.counters[of_level + level.number + 1u], number);
    let half = ((level.number + 1u) & 1u) * level.most;
    for (var k = 0u; k < number && at + k < level.most; k++) {
        var bits = pattern >> (9u * k);
        // The middle triangle of four stands in no pattern.
        if k == 3u {
            bits = 3u | (4u << 3u) | (5u << 6u);
        }
        work[half + at + k] =
            packed(Part(corners[bits & 7u], corners[(bits >> 3u) & 7u], corners[(bits >> 6u) & 7u], t.triangle));
    }
    return true;
}

// Level 0: the scene's triangles.
fn handle_triangles(thread: u32, again: bool) {
    for (var i = thread; i < frame.triangle_count; i += stride) {
        let cut = cut_off(triangle_corners(triangle_at(i).xyz));
        var kept = false;
        for (var k = 2u; k < cut.number; k++) {
            kept = handle(Part(cut.corners[0], cut.corners[k - 1u], cut.corners[k], i), again) || kept;
        }
        if kept && !again {
            atomicAdd(&state.counters[kept_count], 1u);
        }
    }
}

// Workgroups of a level's pass, x, y and z: as many as its pieces need, up to `stride` threads.
var<storage, read_write> level_dispatch: array<u32, 3>;

// Before each level but the first.
@compute @workgroup_size(1)
fn plan_level() {
    let source = level.number - u32(full(level.number));
    let number = select(atomicLoad(&state.counters[of_level + source]), frame.triangle_count, source == 0u);
    level_dispatch[0] = min((number + 63u) / 64u, stride / 64u);
    level_dispatch[1] = 1u;
    level_dispatch[2] = 1u;
}

// One level of splitting; or, if its pieces found no room, the level before it once more.
@compute @workgroup_size(64)
fn split(@builtin(global_invocation_id) id: vec3u) {
    if light_view.idle != 0u {
        return;
    }
    follow(light_view);
    let again = level.number > 0u && full(level.number);
    let source = level.number - u32(again);
    if source == 0u {
        handle_triangles(id.x, again);
        return;
    }
    let number = atomicLoad(&state.counters[of_level + source]);
    for (var i = id.x; i < number; i += stride) {
        handle(unpacked(work[(source & 1u) * level.most + i]), again);
    }
}

@compute @workgroup_size(1)
fn finish() {
    let number = drawn_before(drawn_of_level - of_level);
    atomicStore(&state.counters[drawn_count], number);
    arguments[0] = number * 3u;
    arguments[1] = 1u;
}

// A piece as it lies before the warp: edge functions (Olano, Greer 1997), taken relative to `origin` so that small pieces
// keep their digits.
struct PieceCaster {
    @builtin(position) clip: vec4f,
    @location(0) @interpolate(flat) e0: vec3f,
    @location(1) @interpolate(flat) e1: vec3f,
    @location(2) @interpolate(flat) e2: vec3f,
    @location(3) @interpolate(flat) depths: vec3f,
    @location(4) @interpolate(flat) uv0: vec3f,
    @location(5) @interpolate(flat) uv1: vec3f,
    @location(10) @interpolate(flat) uv2: vec3f,
    // On a paraboloid instead x: the volume that the whole triangle's corners and the light span.
    @location(6) @interpolate(flat) origin: vec2f,
    @location(7) @interpolate(flat) material: u32,
    // As corners have them, for the linear raster.
    @location(8) depth: f32,
    @location(9) uv: vec3f,
}

@vertex
fn piece_caster(@builtin(vertex_index) index: u32) -> PieceCaster {
    follow(light_view);
    let t = unpacked(drawn_pieces[index / 3u]);
    let corners = array<Corner, 3>(t.a, t.b, t.c);
    var out: PieceCaster;
    let middle = (unwarped_place(t.a.position).xy + unwarped_place(t.b.position).xy + unwarped_place(t.c.position).xy) / 3.0;
    out.origin = saturate(middle);
    let ndc = vec2f(2.0 * out.origin.x - 1.0, 1.0 - 2.0 * out.origin.y);
    var clips: array<vec3f, 3>;
    for (var k = 0u; k < 3u; k++) {
        let clip = light_clip(light_view, corners[k].position);
        clips[k] = vec3f(clip.xy - ndc * clip.w, clip.w);
        out.depths[k] = dot(light_view.axis, vec4f(corners[k].position, 1.0));
    }
    out.uv0 = t.a.uv;
    out.uv1 = t.b.uv;
    out.uv2 = t.c.uv;
    var k = index % 3u;
    if curved() {
        // The whole triangle, whose plane keeps its digits; in a frame that turns the image over, round the other way.
        let whole = triangle_corners(triangle_at(t.triangle).xyz);
        for (var i = 0u; i < 3u; i++) {
            clips[i] = light_frame(light_view, whole[i].position);
            out.depths[i] = length(clips[i]);
        }
        out.uv0 = whole[0].uv;
        out.uv1 = whole[1].uv;
        out.uv2 = whole[2].uv;
        if dot(cross(light_view.row_x.xyz, light_view.row_y.xyz), light_view.axis.xyz) > 0.0 {
            k = (3u - k) % 3u;
        }
    }
    out.e0 = cross(clips[1], clips[2]);
    out.e1 = cross(clips[2], clips[0]);
    out.e2 = cross(clips[0], clips[1]);
    if curved() {
        out.origin = vec2f(dot(clips[0], out.e0), 0.0);
    }
    out.material = vertex_at(triangle_at(t.triangle).x).material;
    let corner = corners[k];
    let u = unwarped_place(corner.position);
    let at = warped(u.xy);
    out.clip = vec4f((2.0 * at.x - 1.0) * u.z, (1.0 - 2.0 * at.y) * u.z, 0.5 * u.z, u.z);
    out.depth = stored_depth(light_view, depth_in(light_view, corner.position));
    out.uv = corner.uv;
    return out;
}

@fragment
fn linear_piece(in: PieceCaster) -> @builtin(frag_depth) f32 {
    if masked_out(materials[in.material], in.uv) {
        discard;
    }
    return saturate(in.depth);
}

// Shares of the corners where the texel's ray meets the piece's plane; w: the linear depth there.
fn met(in: PieceCaster) -> vec4f {
    let u = drawn_texel_rays[u32(in.clip.y) * u32(map_side()) + u32(in.clip.x)];
    var place = vec3f(2.0 * (u.x - in.origin.x), -2.0 * (u.y - in.origin.y), 1.0);
    if curved() {
        place = paraboloid_ray(light_view, vec2f(2.0 * u.x - 1.0, 1.0 - 2.0 * u.y));
    }
    let e = vec3f(dot(in.e0, place), dot(in.e1, place), dot(in.e2, place));
    let sum = e.x + e.y + e.z;
    // A piece seen edge-on is met in its middle.
    let share = select(e / sum, vec3f(1.0 / 3.0), sum == 0.0);
    // Seen edge-on, the plane is met anywhere: no farther than the piece goes.
    let low = min(min(in.depths.x, in.depths.y), in.depths.z);
    let high = max(max(in.depths.x, in.depths.y), in.depths.z);
    if curved() {
        return vec4f(share, min(length(place) * abs(in.origin.x / sum), high));
    }
    return vec4f(share, clamp(dot(share, in.depths), low, high));
}

@fragment
fn piece(in: PieceCaster) -> @builtin(frag_depth) f32 {
    let share = met(in);
    if masked_out(materials[in.material], share.x * in.uv0 + share.y * in.uv1 + share.z * in.uv2) {
        discard;
    }
    return saturate(stored_depth(light_view, share.w));
}
