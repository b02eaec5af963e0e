//!include map/light_view.wgsl
// Summed-area tables (Crow 1984): each texel holds the sum of moments of depth over the texels from the map's upper left corner to
// itself, so that a mean over any box takes the same few reads. The sums are whole numbers that wrap around, which loses
// nothing of a box whose own sum fits 32 bits. A filter writes
//     fn moments(z: f32) -> vec4f   of a depth from 0 (near) to 1 (far); each from 0 to 1
//     fn widest_box() -> f32        side of the widest box that it asks for, texels
// The store/ file gives `moments_out`.

struct Summed {
    // The layer's map and its side, texels.
    layer: u32,
    side: u32,
    // 1: along y.
    down: u32,
    padding: u32,
}

var<uniform> summed: Summed;
var layer_depth: texture_depth_2d;
var unsummed: texture_2d<u32>;
var sums_map: texture_2d_array<u32>;

// What stands for 1: as much as the widest box leaves room for, and 32-bit floats hold.
fn one() -> f32 {
    return floor(min(4294967040.0 / (widest_box() * widest_box()), 16777216.0));
}

// A texel's own moments, fixed.
fn fixed_moments(at: vec2u) -> vec4u {
    let z = depth_share(light_views[summed.layer], textureLoad(layer_depth, at, 0));
    return vec4u(round(one() * moments(z)));
}

// Prefix sums of a row or column, a workgroup each: threads take pieces one after the other.
struct Piece {
    start: u32,
    end: u32,
    across: vec2u,
    along: vec2u,
}

fn piece_of(line: u32, index: u32) -> Piece {
    let piece = (summed.side + 63u) / 64u;
    let start = min(index * piece, summed.side);
    let along = select(vec2u(1u, 0u), vec2u(0u, 1u), summed.down == 1u);
    return Piece(start, min(start + piece, summed.side), line * (vec2u(1u) - along), along);
}

var<workgroup> pieces: array<vec4u, 64>;

// What the pieces before this thread's sum up to; `own`: its own sum.
fn before_piece(own: vec4u, index: u32) -> vec4u {
    pieces[index] = own;
    workgroupBarrier();
    var sum = vec4u(0u);
    for (var k = 0u; k < index; k++) {
        sum += pieces[k];
    }
    return sum;
}

// Of the map's moments. Making them twice from depths moves a sixth of what keeping them would.
@compute @workgroup_size(64)
fn sum_moments(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) index: u32) {
    let p = piece_of(group.x, index);
    var own = vec4u(0u);
    for (var i = p.start; i < p.end; i++) {
        own += fixed_moments(p.across + i * p.along);
    }
    var sum = before_piece(own, index);
    for (var i = p.start; i < p.end; i++) {
        sum += fixed_moments(p.across + i * p.along);
        textureStore(moments_out, p.across + i * p.along, sum);
    }
}

// Of sums.
@compute @workgroup_size(64)
fn sum_up(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) index: u32) {
    let p = piece_of(group.x, index);
    var own = vec4u(0u);
    for (var i = p.start; i < p.end; i++) {
        own += textureLoad(unsummed, p.across + i * p.along, 0);
    }
    var sum = before_piece(own, index);
    for (var i = p.start; i < p.end; i++) {
        sum += textureLoad(unsummed, p.across + i * p.along, 0);
        textureStore(moments_out, p.across + i * p.along, sum);
    }
}

// The sum over the texels left of and above a corner of the texel grid; there are none beyond the map's border.
fn sum_before(corner: vec2i, layer: u32, side: i32) -> vec4u {
    let sum = textureLoad(sums_map, max(min(corner, vec2i(side)) - 1, vec2i(0)), layer, 0);
    return select(vec4u(0u), sum, all(corner > vec2i(0)));
}

// Where a side of a box cuts the texel grid: its first texel, which it may cut, whole ones up to its last, which it may cut too.
fn cuts(low: f32, high: f32) -> vec4i {
    let first = i32(floor(low));
    let last = max(i32(floor(high)), first + 1);
    return vec4i(first, first + 1, last, last + 1);
}

// The shares of the three pieces that lie in the box.
fn shares(low: f32, high: f32) -> vec3f {
    let at = vec4f(cuts(low, high));
    return vec3f(min(high, at.y) - low, 1.0, max(high - at.z, 0.0));
}

// Sums over all that lies above a line of the grid, in three pieces from left to right.
struct Above {
    first: vec4u,
    whole: vec4u,
    last: vec4u,
}

fn above(y: i32, x: vec4i, layer: u32, side: i32) -> Above {
    let a = sum_before(vec2i(x.x, y), layer, side);
    let b = sum_before(vec2i(x.y, y), layer, side);
    let c = sum_before(vec2i(x.z, y), layer, side);
    let d = sum_before(vec2i(x.w, y), layer, side);
    return Above(b - a, c - b, d - c);
}

// The three boxes between two lines. Each is exact, and becomes a float only here.
fn between(top: Above, bottom: Above, share: vec3f) -> vec4f {
    return share.x * vec4f(bottom.first - top.first) + share.y * vec4f(bottom.whole - top.whole)
        + share.z * vec4f(bottom.last - top.last);
}

// The sum over a box within the map, in units of `one`; texels that the box cuts count by their share, so that the sum changes
// steadily as the box moves or grows.
fn sum_of_box(low: vec2f, high: vec2f, layer: u32, side: i32) -> vec4f {
    let x = cuts(low.x, high.x);
    let y = cuts(low.y, high.y);
    let share_x = shares(low.x, high.x);
    let share_y = shares(low.y, high.y);
    let a = above(y.x, x, layer, side);
    let b = above(y.y, x, layer, side);
    let c = above(y.z, x, layer, side);
    let d = above(y.w, x, layer, side);
    return share_y.x * between(a, b, share_x) + share_y.y * between(b, c, share_x) + share_y.z * between(c, d, share_x);
}

// The mean moments over a box around a place, texels, at least one texel wide. Nothing casts outside the map: depths are 1 there.
fn mean_of_box(centre: vec2f, half: vec2f, layer: u32, side: f32) -> vec4f {
    let low = centre - half;
    let high = centre + half;
    let inner_low = clamp(low, vec2f(0.0), vec2f(side));
    let inner_high = clamp(high, vec2f(0.0), vec2f(side));
    let size = high - low;
    let inner = inner_high - inner_low;
    let outside = 1.0 - inner.x * inner.y / (size.x * size.y);
    return sum_of_box(inner_low, inner_high, layer, i32(side)) / (one() * size.x * size.y) + outside * moments(1.0);
}
