//!include lib/scene.wgsl
//!include map/place/warp.wgsl
//!include map/arcs.wgsl
//!include map/look_up.wgsl
//!include lib/labels.wgsl
//!include lib/squares.wgsl
//!include map/warp/exact.wgsl
//!include map/warp/subdivide.wgsl
// All passes of a map with a warp (map/place/warp.wgsl): what view samples need of it, its casters, its look-up and its views.
//
// Three ways to draw: `linear` moves corners only; `subdivide` splits triangles until no edge deviates from its warped
// image by more than the tolerance, and takes the depth where every texel's ray meets the triangle's plane
// (map/warp/subdivide.wgsl); `exact` meets the triangles with the rays themselves (map/warp/exact.wgsl).
// What holds of one map is in map/warp/single.wgsl, of maps in all directions in map/warp/around.wgsl. Includers write
// `fn inspect_warp(s: Surface) -> f32` too: their own maps.
//
// `light_view` is that of the layer which is drawn. Passes that ask for its warp without a place in it say `follow` first.

var<uniform> raster: RasterParams;

// What the passes tell each other; one buffer, as not every adapter binds more than eight at once.
struct State {
    counters: array<atomic<u32>, 64>,
    // Vertices and instances of the draw of the rays, from 0 on.
    ray_arguments: array<atomic<u32>, 4>,
    // The largest 1 - u and u of all rays, as bits.
    ray_bounds: array<atomic<u32>, 4>,
    // 64 × 64 tiles of the light's image before the warp (exact: of the rays' box in it), a bit each: whether the rays of
    // needed texels lie in them.
    image_tiles: array<atomic<u32>, 128>,
    // The same of the map: whether a view sample needs one of their texels.
    tiles: array<atomic<u32>, 128>,
    // A bit a triangle: whether it met a cell with rays.
    triangles_met: array<atomic<u32>>,
}

var<storage, read_write> state: State;
// Vertices and instances of the casters' draw, from 0 on.
var<storage, read_write> arguments: array<u32, 4>;

// Places in `state.counters`: what is drawn, what was not split far enough, the triangles that some view sample needs, pieces
// turned over, and places where the warp itself turns the image over.
const drawn_count = 0u;
const unserved_count = 1u;
const kept_count = 2u;
const fold_count = 3u;
const warp_fold_count = 4u;
// Threads of a pass over triangles, pieces or rays.
const stride = 16384u;

struct Corner {
    position: vec3f,
    // As `texture_place` has it.
    uv: vec3f,
}

fn map_side() -> f32 {
    return light_view.resolution;
}

// The surface at a pixel, valid only if its visibility is looked up in this layer: where it faces the light and is reached by it.
fn view_sample(pixel: vec2u) -> Surface {
    follow(light_view);
    var s: Surface;
    if light_view.idle != 0u {
        return s;
    }
    s = load_surface(min(pixel, frame.size - 1u));
    let light = light_at(s.position);
    s.valid = all(pixel < frame.size) && may_be_shadowed(s, light) && in_layer(s.position);
    return s;
}

// Where a layer's part of a buffer begins that holds so much for each; 0 in one that the layers use one after the other.
fn own_part(length: u32, size: u32) -> u32 {
    return select(0u, warped_layer * size, length >= 2u * size);
}

// Whether the layer is a side of a paraboloid.
fn curved() -> bool {
    return light_view.perspective == 3u;
}

// Where a point appears before the warp; z: the projection's w, of a paraboloid 1.
fn unwarped_place(position: vec3f) -> vec3f {
    if curved() {
        return vec3f(0.5 + vec2f(0.5, -0.5) * place_of(light_frame(light_view, position)), 1.0);
    }
    let clip = light_clip(light_view, position);
    return vec3f(0.5 + vec2f(0.5, -0.5) * clip.xy / clip.w, clip.w);
}

// The box of a triangle's image before the warp. Low above high: it has none.
fn unwarped_box(corners: array<vec3f, 3>) -> Box {
    if curved() {
        var places: array<vec3f, 3>;
        for (var k = 0u; k < 3u; k++) {
            places[k] = light_frame(light_view, corners[k]);
        }
        let box = box_of_image(places);
        return Box(0.5 + vec2f(0.5 * box.low.x, -0.5 * box.high.y), 0.5 + vec2f(0.5 * box.high.x, -0.5 * box.low.y));
    }
    let a = unwarped_place(corners[0]).xy;
    let b = unwarped_place(corners[1]).xy;
    let c = unwarped_place(corners[2]).xy;
    return Box(min(min(a, b), c), max(max(a, b), c));
}

// Where a view sample looks into the map, texels, and the same place before the warp, shares of the image's sides, with
// how far rounding may move it.
struct LookedUp {
    texel: vec2f,
    before: vec2f,
    rounding: vec2f,
}

fn looked_up(s: Surface) -> LookedUp {
    let to_light = normalize(light_at(s.position).to_light);
    var position = s.position;
    // With the normal offset it is not where the sample lies.
    if normal_offset() > 0.0 {
        let cosine = dot(s.normal, to_light);
        let texel = map_texel_size(light_view, s.position, to_light);
        position += s.normal * (normal_offset() * texel * sqrt(max(1.0 - cosine * cosine, 0.0)));
    }
    let clip = light_clip(light_view, position);
    let size = abs(vec4f(position, 1.0));
    var terms = vec2f(dot(abs(light_view.row_x), size), dot(abs(light_view.row_y), size)) / max(abs(clip.w), 1e-30);
    if curved() {
        terms = (terms + abs(light_view.row_z.xy)) * light_view.row_z.zw;
    }
    return LookedUp(map_texel(light_view, clip), light_texel(light_view, clip) / light_view.resolution,
                    1.2e-7 * (1.0 + terms));
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

// Whether a view sample needs a ray in a box, shares of what the tiles cover.
fn image_needed(low: vec2f, high: vec2f) -> bool {
    if !(all(high >= vec2f(0.0)) && all(low <= vec2f(1.0))) {
        return false;
    }
    let x0 = u32(clamp(low.x * 64.0, 0.0, 63.0));
    let x1 = u32(clamp(high.x * 64.0, 0.0, 63.0));
    for (var half = 0u; half < 2u; half++) {
        let bits = tile_bits(x0, x1, half);
        for (var y = u32(clamp(low.y * 64.0, 0.0, 63.0)); bits != 0u && y <= u32(clamp(high.y * 64.0, 0.0, 63.0)); y++) {
            if (atomicLoad(&state.image_tiles[2u * y + half]) & bits) != 0u {
                return true;
            }
        }
    }
    return false;
}

fn between(a: Corner, b: Corner, t: f32) -> Corner {
    return Corner(a.position + (b.position - a.position) * t, a.uv + (b.uv - a.uv) * t);
}

// What is left of a triangle without what the projection takes to infinity and beyond: none, or a polygon. A paraboloid takes
// nothing there but one direction, off its sides.
struct Cut {
    corners: array<Corner, 4>,
    number: u32,
}

fn cut_off(corners: array<Corner, 3>) -> Cut {
    var ws: vec3f;
    for (var k = 0u; k < 3u; k++) {
        ws[k] = select(dot(light_view.row_w, vec4f(corners[k].position, 1.0)), 1e30, curved());
    }
    let least = select(0.0, max(1e-3 * light_view.near, 1e-6), any(light_view.row_w.xyz != vec3f(0.0)));
    var cut: Cut;
    for (var k = 0u; k < 3u; k++) {
        let next = (k + 1u) % 3u;
        if ws[k] > least {
            cut.corners[cut.number] = corners[k];
            cut.number++;
        }
        if (ws[k] > least) != (ws[next] > least) {
            cut.corners[cut.number] = between(corners[k], corners[next], (1.001 * least - ws[k]) / (ws[next] - ws[k]));
            cut.number++;
        }
    }
    return cut;
}

fn triangle_corners(t: vec3u) -> array<Corner, 3> {
    var corners: array<Corner, 3>;
    for (var k = 0u; k < 3u; k++) {
        corners[k] = Corner(vertex_position(t[k]), texture_place(t[k]));
    }
    return corners;
}

// Counts view samples by their texels before the warp.
var<storage, read_write> before: array<atomic<u32>>;

@compute @workgroup_size(8, 8)
fn count_before(@builtin(global_invocation_id) id: vec3u) {
    let s = view_sample(id.xy);
    if !s.valid {
        return;
    }
    let u = unwarped_place(s.position).xy;
    if all(u >= vec2f(0.0)) && all(u <= vec2f(1.0)) {
        let side = u32(map_side());
        let cell = min(vec2u(u * map_side()), vec2u(side - 1u));
        atomicAdd(&before[own_part(arrayLength(&before), side * side) + cell.y * side + cell.x], 1u);
    }
}

// Counts the places of the light's image, one a texel, where the warp's Jacobian is not positive. As the warp takes each side
// of the image to itself, without such places it is one to one.
@compute @workgroup_size(8, 8)
fn count_folds(@builtin(global_invocation_id) id: vec3u) {
    follow(light_view);
    if light_view.idle == 0u && all(id.xy < vec2u(u32(map_side()))) && determinant(warp_slope((vec2f(id.xy) + 0.5) / map_side())) <= 0.0 {
        atomicAdd(&state.counters[warp_fold_count], 1u);
    }
}

// The warp at places evenly spread over the sides, the first and the last on them: where it takes them (xy) and where it takes
// from (zw).
var warp_nodes: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn tabulate(@builtin(global_invocation_id) id: vec3u) {
    let last = textureDimensions(warp_nodes) - 1u;
    if all(id.xy <= last) {
        let at = vec2f(id.xy) / vec2f(last);
        textureStore(warp_nodes, id.xy, vec4f(warp(at), unwarp(at)));
    }
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
    return drawn(white, 0.05 + 0.6 * textureLoad(shadow_maps, texel, texture_layer(warped_layer), 0));
}

var<storage, read> folded: array<u32>;

fn fold(s: Surface) -> f32 {
    if !s.valid {
        return -1.0;
    }
    return label(0u, select(0.0, 0.8, (folded[s.triangle / 32u] >> (s.triangle & 31u) & 1u) == 1u));
}

// The views of every technique with a warp, of the layer that is followed.
fn inspect_warped(s: Surface) -> f32 {
    switch frame.map {
        case shows_texels, shows_bias: {
            return inspect_filter(s);
        }
        case shows_grid: {
            return grid(s.pixel);
        }
        case shows_folds: {
            return fold(s);
        }
        default: {
            return inspect_warp(s);
        }
    }
}
