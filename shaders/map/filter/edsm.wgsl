// Four comparisons; where they differ, the signed distance from the edge that passes between them.

// Of each texel the distance of the edge kept there, texels as bits of a float, positive in shadow; or 1 more than the edge's number.
// 0: none. The second only of numbers.
var edge_map: texture_2d_array<u32>;
var second_edge_map: texture_2d_array<u32>;

fn kept_at(layer: u32, texel: vec2i) -> u32 {
    return textureLoad(edge_map, clamp(texel, vec2i(0), vec2i(textureDimensions(edge_map)) - 1), layer, 0).x;
}

fn second_at(layer: u32, texel: vec2i) -> u32 {
    return textureLoad(second_edge_map, clamp(texel, vec2i(0), vec2i(textureDimensions(second_edge_map)) - 1), layer, 0).x;
}

// Each of the four texels is compared at its own place on the receiver's plane.
fn edge_receiver(s: Surface, layer: u32) -> Receiver {
    var r = receive(s, layer, 0.0, 1.0);
    r.gradient = r.plane;
    return r;
}

struct EdgeLook {
    lit: f32,
    // The four comparisons differ, and so many of the four texels keep an edge.
    mixed: bool,
    kept: u32,
    // Of exact corners, how many edges they keep together.
    edges: u32,
}

// Light at a signed distance, texels, positive in shadow.
fn light_beside(signed: f32) -> f32 {
    let k = min(edsm.softness, edsm.reach);
    if k <= 0.0 {
        return select(1.0, 0.0, signed > 0.0);
    }
    return 1.0 - smoothstep(-k, k, signed);
}

// Whether one segment lies on the shadow's side of another, but for rounding.
fn within(s: Segment, other: Segment) -> bool {
    return by_segment(other, s.a).signed > -1e-3 && by_segment(other, s.b).signed > -1e-3;
}

// The distance from the shadow's edge where two edges are the nearest, each tested by itself: where each lies on the shadow's side of
// the other, as at a convex corner or in a thin strip, the shadow is where both say so, else where one does.
fn combined(first: Segment, second: Segment, place: vec2f) -> f32 {
    let a = by_segment(first, place);
    let b = by_segment(second, place);
    let joined = all(first.a == second.b) || all(first.b == second.a);
    // Beyond its end an edge says nothing, unless the other goes on from there.
    if !joined && b.off > abs(b.signed) {
        return a.signed;
    }
    return select(max(a.signed, b.signed), min(a.signed, b.signed), within(first, second) && within(second, first));
}

struct FromEdges {
    // 1e9: no edge.
    signed: f32,
    edges: u32,
}

// The distance from the nearest edges among those that the four texels keep. None that lies farther from the light than the receiver's
// plane casts on it.
fn nearest_edges(r: Receiver, s: Surface, place: vec2f, low: vec2i, lit: vec4f) -> FromEdges {
    let v = light_views[r.layer];
    let depth = depth_in(v, s.position);
    var numbers = vec2u(0u);
    var offs = vec2f(1e9);
    var first = nowhere;
    var second = nowhere;
    var found = FromEdges(1e9, 0u);
    for (var i = 0u; i < 8u; i++) {
        let texel = low + vec2i(i32(i & 1u), i32(i >> 1u & 1u));
        var number = 0u;
        if i < 4u {
            number = kept_at(texture_layer(r.layer), texel);
        } else {
            number = second_at(texture_layer(r.layer), texel);
        }
        if number == 0u || any(numbers == vec2u(number)) {
            continue;
        }
        let segment = segment_in(v, number - 1u);
        let b = by_segment(segment, place);
        let near = segment.a + (segment.b - segment.a) * saturate(b.along / b.length);
        let step = near - r.texel;
        let plane = stored_depth(v, depth + quads.kill_bias) + dot(r.plane, step) / max(1.0 - dot(r.bend, step), 0.1);
        if stored_depth(v, segment_depth(segment, b)) < plane {
            continue;
        }
        // At an end that two share, the one that decides there first.
        let off = b.off + 1e-3 * (b.off - abs(b.signed));
        found.edges++;
        if off < offs.x {
            second = first;
            first = segment;
            numbers = vec2u(number, numbers.x);
            offs = vec2f(off, offs.x);
        } else if off < offs.y {
            second = segment;
            numbers.y = number;
            offs.y = off;
        }
    }
    if !first.there {
        return found;
    }
    if edsm.check != 0u {
        // A third edge may have one of the four another way: that says nothing of the place. And the second may cast elsewhere.
        let both = agreeing(first, second, low, lit);
        let alone = agreeing(first, nowhere, low, lit);
        if max(both, alone) < 3u {
            return found;
        }
        second.there = second.there && both >= alone;
    }
    found.signed = from_edges(first, second, place);
    return found;
}

// How many of the four texels two edges have as their comparisons do.
fn agreeing(first: Segment, second: Segment, low: vec2i, lit: vec4f) -> u32 {
    var number = 0u;
    for (var i = 0u; i < 4u; i++) {
        let middle = vec2f(low + vec2i(i32(i & 1u), i32(i >> 1u))) + 0.5;
        number += u32(agrees(from_edges(first, second, middle), lit[i]));
    }
    return number;
}

fn from_edges(first: Segment, second: Segment, place: vec2f) -> f32 {
    if !second.there {
        return by_segment(first, place).signed;
    }
    return combined(first, second, place);
}

// Whether a distance says the same of a texel as its comparison; close to the edge the raster may have it either way.
fn agrees(signed: f32, lit: f32) -> bool {
    return abs(signed) < 0.05 || (signed > 0.0) == (lit == 0.0);
}

// The light at a place in the map for a receiver's plane.
fn look_at(r: Receiver, s: Surface, place: vec2f) -> EdgeLook {
    let low = floor(place - 0.5);
    let share = place - 0.5 - low;
    var lit: vec4f;
    for (var i = 0u; i < 4u; i++) {
        lit[i] = compare_beside(r, low + 0.5 + vec2f(vec2u(i & 1u, i >> 1u)));
    }
    let all_lit = dot(lit, vec4f(1.0));
    let mixed = all_lit > 0.0 && all_lit < 4.0;
    // The texel that the place lies in.
    let own = lit[u32(share.x >= 0.5) + 2u * u32(share.y >= 0.5)];
    var look = EdgeLook(own, mixed, 0u, 0u);
    if !mixed && edsm.softness <= 0.0 {
        return look;
    }
    var signed: vec4f;
    for (var i = 0u; i < 4u; i++) {
        let kept = kept_at(texture_layer(r.layer), vec2i(low) + vec2i(i32(i & 1u), i32(i >> 1u)));
        signed[i] = bitcast<f32>(kept);
        look.kept += u32(kept != 0u && (edsm.check == 0u || edsm.corners == corners_exact || agrees(signed[i], lit[i])));
    }
    var from_edge: f32;
    if edsm.corners == corners_exact {
        let found = nearest_edges(r, s, place, vec2i(low), lit);
        from_edge = found.signed;
        look.edges = found.edges;
        look.kept = select(4u, 0u, from_edge == 1e9);
    } else {
        from_edge = mix(mix(signed.x, signed.y, share.x), mix(signed.z, signed.w, share.x), share.y);
    }
    // Beside the four that differ, an edge softens only what it agrees with.
    if look.kept == 4u && (mixed || (from_edge > 0.0) == (all_lit == 0.0)) {
        look.lit = light_beside(from_edge);
    }
    return look;
}

fn lit(s: Surface, layer: u32) -> f32 {
    let r = edge_receiver(s, layer);
    if outside_map(r, r.texel) {
        return beside(r, r.texel).lit;
    }
    return look_at(r, s, r.texel).lit;
}

fn inspect_filter(s: Surface) -> f32 {
    return inspect_look_up(s, edge_receiver(s, choose(s).layer));
}
