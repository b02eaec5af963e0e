//!include lib/scene.wgsl
//!include lib/warp.wgsl
//!include lib/nearest.wgsl
//!include lib/place.wgsl
//!include lib/labels.wgsl
// All passes of a map with a warp (lib/warp.wgsl): casters split where the warp bends them, drawn, and looked up.
//
// Three ways to draw: `linear` moves corners only; `subdivide` splits triangles until no edge deviates from its warped
// image by more than the tolerance, and takes the depth where every texel's ray meets the triangle's plane; `exact` draws a
// box around each piece and takes only the texels whose rays meet the triangle itself.
// Includers write `fn inspect_warp(s: Surface) -> f32` too: their own maps.

@group(1) @binding(40) var<uniform> raster: RasterParams;

// A triangle or a part of one: corners in world space; their w: the triangle's number as bits, and c's texture
// coordinates; `uv`: those of a and b.
struct Piece {
    a: vec4f,
    b: vec4f,
    c: vec4f,
    uv: vec4f,
}

struct Level {
    // Pieces of level n lie in the half n mod 2 of `work`.
    number: u32,
    // No piece is split further.
    last: u32,
    // Most pieces of a level, and most that are drawn.
    most: u32,
    most_drawn: u32,
}

@group(1) @binding(41) var<uniform> level: Level;
@group(1) @binding(42) var<storage, read_write> work: array<Piece>;
@group(1) @binding(43) var<storage, read_write> pieces: array<Piece>;
@group(1) @binding(44) var<storage, read> drawn_pieces: array<Piece>;
// In exact mode: what a piece covers of the map, texels: low, high.
@group(1) @binding(45) var<storage, read_write> boxes: array<vec4f>;
@group(1) @binding(46) var<storage, read> drawn_boxes: array<vec4f>;
@group(1) @binding(47) var<storage, read_write> counters: array<atomic<u32>, 32>;
// A bit a triangle: whether the map holds a part of it with its sides exchanged.
@group(1) @binding(48) var<storage, read_write> folds: array<atomic<u32>>;
@group(1) @binding(49) var<storage, read> folded: array<u32>;
// 64 × 64 tiles of the map, a bit each: whether a view sample needs one of its texels; and tiles of the light's image
// before the warp: whether the rays of such texels lie in them.
@group(1) @binding(50) var<storage, read_write> tiles: array<atomic<u32>, 128>;
@group(1) @binding(53) var<storage, read_write> image_tiles: array<atomic<u32>, 128>;
// Where the centre of each texel lies before the warp.
@group(1) @binding(54) var<storage, read_write> rays: array<vec2f>;
@group(1) @binding(55) var<storage, read> drawn_rays: array<vec2f>;
// Vertices and instances of the draw, from 0 on.
@group(1) @binding(51) var<storage, read_write> arguments: array<u32, 4>;

// Places in `counters`; from `of_level` on the pieces of each level.
const drawn_count = 0u;
const lost_count = 1u;
const kept_count = 2u;
const fold_count = 3u;
const of_level = 4u;
// Threads of a pass over pieces.
const stride = 16384u;

struct Corner {
    position: vec3f,
    uv: vec2f,
}

struct Part {
    a: Corner,
    b: Corner,
    c: Corner,
    triangle: u32,
}

fn packed(t: Part) -> Piece {
    return Piece(vec4f(t.a.position, bitcast<f32>(t.triangle)), vec4f(t.b.position, t.c.uv.x),
                 vec4f(t.c.position, t.c.uv.y), vec4f(t.a.uv, t.b.uv));
}

fn unpacked(p: Piece) -> Part {
    return Part(Corner(p.a.xyz, p.uv.xy), Corner(p.b.xyz, p.uv.zw), Corner(p.c.xyz, vec2f(p.b.w, p.c.w)),
                bitcast<u32>(p.a.w));
}

fn tile_of(texel: f32) -> u32 {
    return u32(clamp(texel, 0.0, map_side() - 1.0)) * 64u / u32(map_side());
}

fn map_side() -> f32 {
    return light_view.resolution;
}

// The surface at a pixel, valid only if its visibility is looked up: where it faces the light and is reached by it.
fn view_sample(pixel: vec2u) -> Surface {
    var s = load_surface(min(pixel, frame.size - 1u));
    let light = light_at(s.position);
    s.valid = s.valid && all(pixel < frame.size) && light.reached && dot(s.normal, light.to_light) > 0.0;
    return s;
}

// Marks the tiles that view samples look into.
@compute @workgroup_size(8, 8)
fn need(@builtin(global_invocation_id) id: vec3u) {
    let s = view_sample(id.xy);
    if !s.valid {
        return;
    }
    // With the normal offset the look-up may lie elsewhere.
    let to_light = normalize(light_at(s.position).to_light);
    var position = s.position;
    if map.normal_offset > 0.0 {
        let cosine = dot(s.normal, to_light);
        let texel = map_texel_size(light_view, s.position, to_light);
        position += s.normal * (map.normal_offset * texel * sqrt(max(1.0 - cosine * cosine, 0.0)));
    }
    let texel = map_texel(light_view, light_clip(light_view, position));
    let x = tile_of(texel.x);
    let word = 2u * tile_of(texel.y) + x / 32u;
    let bit = 1u << (x & 31u);
    if (atomicLoad(&tiles[word]) & bit) == 0u {
        atomicOr(&tiles[word], bit);
    }
}

// The bits of tiles `first` to `last` of a row that lie in one half of it.
fn tile_bits(x0: u32, x1: u32, half: u32) -> u32 {
    let first = max(x0, half * 32u);
    let last = min(x1, half * 32u + 31u);
    if first > last {
        return 0u;
    }
    return (0xffffffffu >> (31u - (last - first))) << (first & 31u);
}

// Marks the tiles of the light's image that the rays of needed texels lie in: a thread a tile of the map.
@compute @workgroup_size(64)
fn spread(@builtin(global_invocation_id) id: vec3u) {
    let tile = vec2u(id.x % 64u, id.x / 64u);
    if (atomicLoad(&tiles[2u * tile.y + tile.x / 32u]) >> (tile.x & 31u) & 1u) == 0u {
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
            atomicOr(&image_tiles[2u * y + half], bits);
        }
    }
}

// Whether a view sample needs a ray in a box of the light's image.
fn image_needed(low: vec2f, high: vec2f) -> bool {
    if !(all(high >= vec2f(0.0)) && all(low <= vec2f(1.0))) {
        return false;
    }
    let x0 = u32(clamp(low.x * 64.0, 0.0, 63.0));
    let x1 = u32(clamp(high.x * 64.0, 0.0, 63.0));
    for (var half = 0u; half < 2u; half++) {
        let bits = tile_bits(x0, x1, half);
        for (var y = u32(clamp(low.y * 64.0, 0.0, 63.0)); bits != 0u && y <= u32(clamp(high.y * 64.0, 0.0, 63.0)); y++) {
            if (atomicLoad(&image_tiles[2u * y + half]) & bits) != 0u {
                return true;
            }
        }
    }
    return false;
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
            if (atomicLoad(&tiles[2u * y + half]) & bits) != 0u {
                return true;
            }
        }
    }
    return false;
}

// A thread a texel.
@compute @workgroup_size(64)
fn trace_rays(@builtin(global_invocation_id) id: vec3u) {
    let side = u32(map_side());
    if id.x < side {
        rays[id.y * side + id.x] = unwarp((vec2f(id.xy) + 0.5) / map_side());
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

fn precedes(p: vec3f, q: vec3f) -> bool {
    return p.x < q.x || (p.x == q.x && (p.y < q.y || (p.y == q.y && p.z < q.z)));
}

// What is known of an edge, the same from both its sides: so neighbours split alike and leave no crack.
struct Edge {
    split: bool,
    // Where it is split.
    middle: Corner,
    // Unless it is split: what the warped samples on it cover, shares of the map's sides, and how much the steps between
    // them differ.
    low: vec2f,
    high: vec2f,
    bend: vec2f,
}

fn between(a: Corner, b: Corner, t: f32) -> Corner {
    return Corner(a.position + (b.position - a.position) * t, a.uv + (b.uv - a.uv) * t);
}

// Where a place at a share t between two projected points lies between their points in space.
fn in_space(t: f32, wa: f32, wb: f32) -> f32 {
    return t * wa / ((1.0 - t) * wb + t * wa);
}

// Distance of a place from a segment.
fn beside(at: vec2f, start: vec2f, end: vec2f) -> f32 {
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
    var e: Edge;
    e.low = min(start, end);
    e.high = max(start, end);
    let span = inside(a.xy, b.xy);
    if span.y <= span.x {
        e.middle = between(first, second, 0.5);
        return e;
    }
    let middle = clamp(0.5 * (span.x + span.y), 0.02, 0.98);
    e.middle = between(first, second, in_space(middle, a.z, b.z));
    let exact = raster.raster == raster_exact;
    let length_inside = (span.y - span.x) * length(b.xy - a.xy);
    let longest = max(length_inside, (span.y - span.x) * distance(start, end)) * map_side();
    // Boxes are the tighter the smaller the piece.
    if exact && longest > 32.0 && level.last == 0u {
        e.split = true;
        return e;
    }
    // A curve shorter than a texel is not worth a corner.
    if !exact && longest <= 1.0 {
        return e;
    }
    // Every bend, twice where boxes must hold.
    let number = u32(clamp(ceil(length_inside * warp_bends() * select(1.0, 2.0, exact)), 2.0, 128.0));
    var last = warped(mix(a.xy, b.xy, span.x));
    var last_step = vec2f(0.0);
    for (var i = 0u; i <= number; i++) {
        let t = mix(span.x, span.y, f32(i) / f32(number));
        let at = warped(mix(a.xy, b.xy, t));
        if !exact && beside(at, start, end) * map_side() > raster.tolerance {
            e.split = true;
            return e;
        }
        e.low = min(e.low, at);
        e.high = max(e.high, at);
        let step = at - last;
        e.bend = max(e.bend, select(vec2f(0.0), abs(step - last_step), i > 1u));
        last = at;
        last_step = step;
    }
    return e;
}

// Whether a box of the map holds the centre of a texel.
fn holds_centre(low: vec2f, high: vec2f) -> bool {
    return all(ceil(low - 0.5) <= floor(high - 0.5));
}

fn draw(t: Part, low: vec2f, high: vec2f) {
    let exact = raster.raster == raster_exact;
    var kept = exact && holds_centre(low, high);
    if !exact {
        let a = unwarped_place(t.a.position).xy;
        let b = unwarped_place(t.b.position).xy;
        let c = unwarped_place(t.c.position).xy;
        let before = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
        let wa = warped(a) * map_side();
        let wb = warped(b) * map_side();
        let wc = warped(c) * map_side();
        let after = (wb.x - wa.x) * (wc.y - wa.y) - (wb.y - wa.y) * (wc.x - wa.x);
        // Some room for the rasteriser's own rounding.
        kept = holds_centre(min(min(wa, wb), wc) - 0.01, max(max(wa, wb), wc) + 0.01);
        // Not slivers that rounding turns over.
        if kept && before * after < 0.0 && abs(after) > 0.02 {
            atomicAdd(&counters[fold_count], 1u);
            atomicOr(&folds[t.triangle / 32u], 1u << (t.triangle & 31u));
        }
    }
    if kept {
        let at = atomicAdd(&counters[drawn_count], 1u);
        if at < level.most_drawn {
            pieces[at] = packed(t);
            if exact {
                boxes[at] = vec4f(low, high);
            }
        } else {
            atomicAdd(&counters[lost_count], 1u);
        }
    }
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

// Draws a part, splits it for the next level, or drops it if no view sample needs what it covers. True if it is kept.
fn handle(t: Part) -> bool {
    let ua = unwarped_place(t.a.position);
    let ub = unwarped_place(t.b.position);
    let uc = unwarped_place(t.c.position);
    if raster.raster == raster_linear {
        let a = warped(ua.xy) * map_side();
        let b = warped(ub.xy) * map_side();
        let c = warped(uc.xy) * map_side();
        if !needed(min(min(a, b), c), max(max(a, b), c)) {
            return false;
        }
    } else if !image_needed(min(min(ua.xy, ub.xy), uc.xy), max(max(ua.xy, ub.xy), uc.xy)) {
        return false;
    }
    var corners = array<Corner, 6>(t.a, t.b, t.c, t.a, t.b, t.c);
    var mask = 0u;
    var low = vec2f(1e9);
    var high = vec2f(-1e9);
    var bend = vec2f(0.0);
    if raster.raster != raster_linear {
        for (var k = 0u; k < 3u; k++) {
            let e = judge(corners[k], corners[(k + 1u) % 3u]);
            mask |= u32(e.split) << k;
            corners[3u + k] = e.middle;
            low = min(low, e.low);
            high = max(high, e.high);
            bend = max(bend, e.bend);
        }
    }
    let pattern = patterns[mask];
    let number = (pattern >> 30u) + 1u;
    var whole = mask == 0u || level.last == 1u;
    var at = 0u;
    if !whole {
        at = atomicAdd(&counters[of_level + level.number + 1u], number);
        // Where there is no room for its parts it stays as it is.
        whole = at + number > level.most;
    }
    if whole {
        // A part's image is bounded by its edges' images; these may bulge between samples by less than their steps differ.
        draw(t, (low - bend) * map_side() - 0.01, (high + bend) * map_side() + 0.01);
    }
    if mask == 0u || level.last == 1u {
        return true;
    }
    let half = ((level.number + 1u) & 1u) * level.most;
    for (var k = 0u; k < number && at + k < level.most; k++) {
        var bits = pattern >> (9u * k);
        // The middle triangle of four stands in no pattern.
        if k == 3u {
            bits = 3u | (4u << 3u) | (5u << 6u);
        }
        // Nothing, in the last places of a list that is full.
        bits = select(bits, 0u, whole);
        work[half + at + k] =
            packed(Part(corners[bits & 7u], corners[(bits >> 3u) & 7u], corners[(bits >> 6u) & 7u], t.triangle));
    }
    return true;
}

// Level 0: the scene's triangles, without what the projection takes to infinity and beyond.
@compute @workgroup_size(64)
fn start(@builtin(global_invocation_id) id: vec3u) {
    for (var i = id.x; i < arrayLength(&triangles); i += stride) {
        let t = triangles[i].xyz;
        var corners: array<Corner, 3>;
        var ws: vec3f;
        for (var k = 0u; k < 3u; k++) {
            let v = vertices[t[k]];
            corners[k] = Corner(v.position, v.uv);
            ws[k] = dot(light_view.row_w, vec4f(v.position, 1.0));
        }
        let least = select(0.0, max(1e-3 * light_view.near, 1e-6), any(light_view.row_w.xyz != vec3f(0.0)));
        // What is left of it: a triangle or two.
        var cut: array<Corner, 4>;
        var number = 0u;
        for (var k = 0u; k < 3u; k++) {
            let next = (k + 1u) % 3u;
            if ws[k] > least {
                cut[number] = corners[k];
                number++;
            }
            if (ws[k] > least) != (ws[next] > least) {
                cut[number] = between(corners[k], corners[next], (1.001 * least - ws[k]) / (ws[next] - ws[k]));
                number++;
            }
        }
        var kept = false;
        for (var k = 2u; k < number; k++) {
            kept = handle(Part(cut[0], cut[k - 1u], cut[k], i)) || kept;
        }
        if kept {
            atomicAdd(&counters[kept_count], 1u);
        }
    }
}

// One level of splitting.
@compute @workgroup_size(64)
fn split(@builtin(global_invocation_id) id: vec3u) {
    let number = min(atomicLoad(&counters[of_level + level.number]), level.most);
    for (var i = id.x; i < number; i += stride) {
        handle(unpacked(work[(level.number & 1u) * level.most + i]));
    }
}

@compute @workgroup_size(1)
fn finish() {
    let number = min(atomicLoad(&counters[drawn_count]), level.most_drawn);
    arguments[0] = number * select(3u, 6u, raster.raster == raster_exact);
    arguments[1] = 1u;
    arguments[2] = 0u;
    arguments[3] = 0u;
}

// A piece as it lies before the warp: edge functions (Olano, Greer 1997), taken relative to `origin` so that small pieces
// keep their digits.
struct PieceCaster {
    @builtin(position) clip: vec4f,
    @location(0) @interpolate(flat) e0: vec3f,
    @location(1) @interpolate(flat) e1: vec3f,
    @location(2) @interpolate(flat) e2: vec3f,
    @location(3) @interpolate(flat) depths: vec3f,
    @location(4) @interpolate(flat) uv01: vec4f,
    @location(5) @interpolate(flat) uv2: vec2f,
    @location(6) @interpolate(flat) origin: vec2f,
    @location(7) @interpolate(flat) material: u32,
    // As corners have them, for the linear raster.
    @location(8) depth: f32,
    @location(9) uv: vec2f,
}

fn caster_of(t: Part) -> PieceCaster {
    var out: PieceCaster;
    let positions = array<vec3f, 3>(t.a.position, t.b.position, t.c.position);
    let middle = (unwarped_place(t.a.position).xy + unwarped_place(t.b.position).xy + unwarped_place(t.c.position).xy) / 3.0;
    out.origin = saturate(middle);
    let ndc = vec2f(2.0 * out.origin.x - 1.0, 1.0 - 2.0 * out.origin.y);
    var corners: array<vec3f, 3>;
    for (var k = 0u; k < 3u; k++) {
        let clip = light_clip(light_view, positions[k]);
        corners[k] = vec3f(clip.xy - ndc * clip.w, clip.w);
        out.depths[k] = dot(light_view.axis, vec4f(positions[k], 1.0));
    }
    out.e0 = cross(corners[1], corners[2]);
    out.e1 = cross(corners[2], corners[0]);
    out.e2 = cross(corners[0], corners[1]);
    out.uv01 = vec4f(t.a.uv, t.b.uv);
    out.uv2 = t.c.uv;
    out.material = vertices[triangles[t.triangle].x].material;
    return out;
}

@vertex
fn piece_caster(@builtin(vertex_index) index: u32) -> PieceCaster {
    let t = unpacked(drawn_pieces[index / 3u]);
    var out = caster_of(t);
    let corners = array<Corner, 3>(t.a, t.b, t.c);
    let corner = corners[index % 3u];
    let u = unwarped_place(corner.position);
    let at = warped(u.xy);
    out.clip = vec4f((2.0 * at.x - 1.0) * u.z, (1.0 - 2.0 * at.y) * u.z, 0.5 * u.z, u.z);
    out.depth = stored_depth(light_view, out.depths[index % 3u]);
    out.uv = corner.uv;
    return out;
}

@vertex
fn box_caster(@builtin(vertex_index) index: u32) -> PieceCaster {
    let box = drawn_boxes[index / 6u];
    var out = caster_of(unpacked(drawn_pieces[index / 6u]));
    let corner = array<vec2f, 6>(box.xy, box.zy, box.xw, box.xw, box.zy, box.zw)[index % 6u] / map_side();
    out.clip = vec4f(2.0 * corner.x - 1.0, 1.0 - 2.0 * corner.y, 0.5, 1.0);
    return out;
}

@fragment
fn linear_piece(in: PieceCaster) -> @builtin(frag_depth) f32 {
    if masked_out(materials[in.material], in.uv) {
        discard;
    }
    return saturate(in.depth);
}

// Shares of the corners where the texel's ray meets the piece's plane; w: positive if the piece turns its front to the
// light.
fn met(in: PieceCaster) -> vec4f {
    let u = drawn_rays[u32(in.clip.y) * u32(map_side()) + u32(in.clip.x)];
    let place = vec3f(2.0 * (u.x - in.origin.x), -2.0 * (u.y - in.origin.y), 1.0);
    let e = vec3f(dot(in.e0, place), dot(in.e1, place), dot(in.e2, place));
    let sum = e.x + e.y + e.z;
    return vec4f(e / sum, sum);
}

fn kept_depth(in: PieceCaster, share: vec3f) -> f32 {
    if masked_out(materials[in.material], share.x * in.uv01.xy + share.y * in.uv01.zw + share.z * in.uv2) {
        discard;
    }
    // Seen edge-on, the plane is met anywhere: no farther than the piece goes.
    let low = min(min(in.depths.x, in.depths.y), in.depths.z);
    let high = max(max(in.depths.x, in.depths.y), in.depths.z);
    return saturate(stored_depth(light_view, clamp(dot(share, in.depths), low, high)));
}

@fragment
fn piece(in: PieceCaster) -> @builtin(frag_depth) f32 {
    return kept_depth(in, met(in).xyz);
}

@fragment
fn box(in: PieceCaster) -> @builtin(frag_depth) f32 {
    let share = met(in);
    let front = share.w > 0.0;
    if !(min(min(share.x, share.y), share.z) >= -1e-6) || (map.cull == cull_front && front) || (map.cull == cull_back && !front) {
        discard;
    }
    return kept_depth(in, share.xyz);
}

// Counts view samples by their texels before the warp.
@group(1) @binding(52) var<storage, read_write> before: array<atomic<u32>>;

@compute @workgroup_size(8, 8)
fn count_before(@builtin(global_invocation_id) id: vec3u) {
    let s = view_sample(id.xy);
    if !s.valid {
        return;
    }
    let u = unwarped_place(s.position).xy;
    if all(u >= vec2f(0.0)) && all(u <= vec2f(1.0)) {
        let cell = min(vec2u(u * map_side()), vec2u(u32(map_side()) - 1u));
        atomicAdd(&before[cell.y * u32(map_side()) + cell.x], 1u);
    }
}

// Two squares of side 1 beside each other, fitted into the picture as in a diagram: the place in them of a pixel.
// x in 0 to 2.
fn square_place(pixel: vec2f) -> vec2f {
    let size = vec2f(frame.size);
    let scale = max(2.08 / size.x, 1.04 / size.y);
    return (pixel - 0.5 * size) * scale + vec2f(1.0, 0.5);
}

// Left the light's image before the warp with every sixteenth of the map's sides, right the map with every sixteenth of the
// image's sides.
fn grid_cell(at: vec2f) -> vec2i {
    let right = at.x >= 1.0;
    let place = select(at, at - vec2f(1.0, 0.0), right);
    if any(place < vec2f(0.0)) || any(place > vec2f(1.0)) {
        return vec2i(-1);
    }
    var there: vec2f;
    if right {
        there = unwarp(place);
    } else {
        there = warp(place);
    }
    return vec2i(floor(there * 16.0));
}

fn grid(pixel: vec2u) -> f32 {
    let at = square_place(vec2f(pixel) + 0.5);
    let cell = grid_cell(at);
    if cell.x < 0 {
        return drawn(white, 0.0);
    }
    let wide = max(1.0, f32(frame.size.y) / 1000.0);
    let beside = grid_cell(square_place(vec2f(pixel) + 0.5 + vec2f(wide, 0.0)));
    let below = grid_cell(square_place(vec2f(pixel) + 0.5 + vec2f(0.0, wide)));
    if any(beside != cell) || any(below != cell) {
        return drawn(select(3u, 1u, at.x >= 1.0), 0.9);
    }
    var place = at - vec2f(1.0, 0.0);
    if at.x < 1.0 {
        place = warp(at);
    }
    let texel = vec2u(clamp(place * map_side(), vec2f(0.0), vec2f(map_side() - 1.0)));
    return drawn(white, 0.05 + 0.6 * textureLoad(shadow_map, texel, 0));
}

fn fold(s: Surface) -> f32 {
    if !s.valid {
        return -1.0;
    }
    return label(0u, select(0.0, 0.8, (folded[s.triangle / 32u] >> (s.triangle & 31u) & 1u) == 1u));
}

fn inspect_map(s: Surface) -> f32 {
    switch frame.map {
        case 1u, 2u: {
            return inspect_lookup(s, receive(s, 0.0, 1.0));
        }
        case 7u: {
            return grid(s.pixel);
        }
        case 8u: {
            return fold(s);
        }
        default: {
            return inspect_warp(s);
        }
    }
}
