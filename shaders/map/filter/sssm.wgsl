// Four comparisons around a square; its point and those of the squares beside it part it into quadrants, one for each corner.

var silhouette_points: texture_2d_array<f32>;

// Square (i, j) has its upper left corner in the middle of texel (i, j).
fn stored_point(layer: u32, square: vec2i) -> vec2f {
    let last = vec2i(textureDimensions(silhouette_points)) - 1;
    return textureLoad(silhouette_points, clamp(square, vec2i(0), last), texture_layer(layer), 0).xy;
}

fn has_point(layer: u32, square: vec2i) -> bool {
    return stored_point(layer, square).x > 0.0;
}

// Its place in the square; the middle, where no edge left one.
fn point_of(layer: u32, square: vec2i) -> vec2f {
    let stored = stored_point(layer, square);
    return select(vec2f(0.5), stored - 1.0, stored.x > 0.0);
}

// The point of the square beside it, in its own coordinates: 0 right, 1 below, 2 left, 3 above.
fn point_beyond(layer: u32, square: vec2i, k: u32) -> vec2f {
    let by = array<vec2i, 4>(vec2i(1, 0), vec2i(0, 1), vec2i(-1, 0), vec2i(0, -1))[k];
    return point_of(layer, square + by) + vec2f(by);
}

fn edge_receiver(s: Surface, layer: u32) -> Receiver {
    var r = receive(s, layer, 0.0, 1.0);
    r.gradient = r.plane;
    return r;
}

// The comparisons at a square's corners: upper left, upper right, lower left, lower right.
fn four_around(r: Receiver, low: vec2f) -> vec4f {
    var four: vec4f;
    for (var i = 0u; i < 4u; i++) {
        four[i] = compare_beside(r, low + 0.5 + vec2f(vec2u(i & 1u, i >> 1u)));
    }
    return four;
}

fn turn_between(a: vec2f, b: vec2f) -> f32 {
    return a.x * b.y - a.y * b.x;
}

// The light at a place in the map for a receiver's plane.
fn light_in(r: Receiver, place: vec2f) -> f32 {
    let low = floor(place - 0.5);
    let four = four_around(r, low);
    let all_lit = dot(four, vec4f(1.0));
    if all_lit == 0.0 || all_lit == 4.0 {
        return four.x;
    }
    let square = vec2i(low);
    let point = point_of(r.layer, square);
    let p = place - 0.5 - low - point;
    // Clockwise, as rows run down: between right and below lies the lower right corner's quadrant, and so on.
    let corners = array<u32, 4>(3u, 2u, 0u, 1u);
    var nearest = four[u32(p.x + point.x >= 0.5) + 2u * u32(p.y + point.y >= 0.5)];
    var from_ = point_beyond(r.layer, square, 0u) - point;
    for (var k = 0u; k < 4u; k++) {
        let to = point_beyond(r.layer, square, (k + 1u) % 4u) - point;
        let straight = turn_between(from_, p) >= 0.0 && turn_between(p, to) >= 0.0;
        // Of a quadrant wider than half a turn it is what the rest is not.
        let wide = !(turn_between(to, p) > 0.0 && turn_between(p, from_) > 0.0);
        if select(wide, straight, turn_between(from_, to) >= 0.0) {
            return four[corners[k]];
        }
        from_ = to;
    }
    return nearest;
}

fn lit(s: Surface, layer: u32) -> f32 {
    let r = edge_receiver(s, layer);
    if outside_map(r, r.texel) {
        return beside(r, r.texel).lit;
    }
    return light_in(r, r.texel);
}

fn inspect_filter(s: Surface) -> f32 {
    return inspect_look_up(s, edge_receiver(s, choose(s).layer));
}
