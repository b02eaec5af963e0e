//!include map/look_up.wgsl
//!include map/edge_quads.wgsl
//!include map/edge_zoom.wgsl
// Edge distance shadow mapping (Kenzel 2013): silhouette edges leave their signed distance in the texels around them.

var<uniform> edsm: EdsmParams;

// The priority of what lies in each texel, small first; 1: nothing.
var edge_priority: texture_depth_2d_array;
// The numbers that lie nearest, where second ones are drawn.
var first_numbers: texture_2d<u32>;

fn quad_reach(v: LightView, w: f32) -> f32 {
    // As wide in space all along: farther from a lamp it is thinner in the map.
    let thin = edsm.quads_in == quads_in_world && v.perspective == 1u;
    return edsm.reach * select(1.0, min(v.near / w, 1.0), thin);
}

@vertex
fn corner(@builtin(vertex_index) i: u32) -> Quad {
    return quad_corner(i, 0.0);
}

// What a texel keeps of an edge, and which edge it keeps: that of the smallest priority.
struct Left {
    @location(0) what: u32,
    @builtin(frag_depth) priority: f32,
}

fn priority_of(s: Segment, b: Near, p: vec2f) -> f32 {
    let widest = 2.0 * edsm.reach + 1.0;
    switch edsm.priority {
        case priority_segment: {
            // Beyond the end that two edges share both are as far: the one that decides there has the larger distance.
            return saturate((b.off + 1e-3 * (b.off - abs(b.signed))) / widest);
        }
        case priority_seed: {
            // From the nearer end; e runs away from it into the edge.
            let second = b.along > 0.5 * b.length;
            let from_end = p - select(s.a, s.b, second);
            let along = select(b.along, b.length - b.along, second);
            let cosine = -along / max(length(from_end), 1e-6);
            return saturate(select(max(cosine, abs(b.signed)), abs(b.signed), along > 0.0) / widest);
        }
        case priority_min: {
            return saturate(abs(b.signed) / widest);
        }
        default: {
            return 0.5;
        }
    }
}

fn left_by(q: Quad) -> Left {
    let s = segment_of(q);
    let b = by_segment(s, q.at.xy);
    if hidden(light_view, q.at.xy, segment_depth(s, b)) {
        discard;
    }
    if edsm.corners == corners_exact {
        return Left(q.number, priority_of(s, b, q.at.xy));
    }
    // 0 is for texels without an edge.
    let bits = bitcast<u32>(b.signed);
    return Left(select(bits, 0x80000000u, bits == 0u), priority_of(s, b, q.at.xy));
}

@fragment
fn keep(q: Quad) -> Left {
    return left_by(q);
}

// Once more, without the edge that is kept already.
@fragment
fn keep_second(q: Quad) -> Left {
    if textureLoad(first_numbers, vec2u(q.at.xy), 0).x == q.number {
        discard;
    }
    return left_by(q);
}

fn distance_map(pixel: vec2u) -> f32 {
    let at = laid_out(vec2f(pixel) + 0.5);
    if !at.inside || at.rim {
        return drawn(white, select(0.0, 0.4, at.rim));
    }
    let kept = kept_at(texture_layer(at.layer), vec2i(at.place));
    if kept == 0u {
        return drawn(white, 0.08 + 0.2 * nearness_of(at));
    }
    var signed = bitcast<f32>(kept);
    if edsm.corners == corners_exact {
        signed = by_segment(segment_in(light_views[at.layer], kept - 1u), floor(at.place) + 0.5).signed;
    }
    return drawn(select(6u, 4u, signed > 0.0), 1.0 - 0.8 * saturate(abs(signed) / edsm.reach));
}

fn inspect_map(s: Surface) -> f32 {
    if frame.map == shows_silhouette_edges || frame.map == shows_edge_quads {
        return inspect_edges(s.pixel);
    }
    if frame.map == shows_edge_distance {
        return distance_map(s.pixel);
    }
    if frame.map == shows_edge_priority {
        let at = laid_out(vec2f(s.pixel) + 0.5);
        return select(0.0, 1.0 - textureLoad(edge_priority, vec2u(at.place), texture_layer(at.layer), 0), at.inside);
    }
    if frame.map == shows_edge_zoom {
        let z = zoom(s.pixel);
        let r = edge_receiver(z.s, z.layer);
        if !z.valid || outside_map(r, z.place) {
            return drawn(white, select(0.05, 0.4, on_grid(z)));
        }
        let v = look_at(r, z.s, z.place);
        if v.kept < 4u && v.mixed {
            return drawn(select(0u, 1u, on_grid(z)), 0.4 + 0.4 * v.lit);
        }
        return zoomed_light(z, compare_beside(r, z.place), v.lit);
    }
    if frame.map == shows_edge_use {
        if !s.valid || !faces_light(s) {
            return -1.0;
        }
        let r = edge_receiver(s, choose(s).layer);
        let v = look_at(r, s, r.texel);
        return select(-1.0, label(select(0u, select(2u, 3u, v.edges == 1u), v.kept == 4u), 0.9), v.mixed);
    }
    return inspect_filter(s);
}
