//!include map/look_up.wgsl
//!include map/edge_quads.wgsl
//!include map/edge_zoom.wgsl
// Shadow silhouette maps (Sen, Cammarano, Hanrahan 2003): a point on the silhouette in each square between four texels' middles.

var<uniform> sssm: SssmParams;

// Each square that an edge meets has its middle in the quad: half its diagonal, and a little for rounding.
fn quad_reach(v: LightView, w: f32) -> f32 {
    return 0.75;
}

// Squares lie half a texel off the texels.
@vertex
fn corner(@builtin(vertex_index) i: u32) -> Quad {
    return quad_corner(i, 0.5);
}

struct Left {
    // The place in the square, and 1, so that 0 is none.
    @location(0) point: vec2f,
    @builtin(frag_depth) priority: f32,
}

fn inside_square(p: vec2f) -> bool {
    return all(p >= vec2f(0.0)) && all(p <= vec2f(1.0));
}

@fragment
fn keep(q: Quad) -> Left {
    let s = segment_of(q);
    // The square, texels of the map.
    let low = floor(q.at.xy) + 0.5;
    let a = s.a - low;
    let b = s.b - low;
    // The part of the segment in the square.
    var part = vec2f(0.0, 1.0);
    for (var k = 0u; k < 2u; k++) {
        let step = b[k] - a[k];
        if abs(step) < 1e-9 {
            if a[k] < 0.0 || a[k] > 1.0 {
                discard;
            }
        } else {
            let ends = vec2f(-a[k], 1.0 - a[k]) / step;
            part = vec2f(max(part.x, min(ends.x, ends.y)), min(part.y, max(ends.x, ends.y)));
        }
    }
    if part.x > part.y {
        discard;
    }
    var point = mix(a, b, 0.5 * (part.x + part.y));
    // The longer the part, the more it says.
    var priority = 0.6 - 0.2 * saturate((part.y - part.x) * distance(a, b) / 1.5);
    if sssm.store == store_vertex && (inside_square(a) || inside_square(b)) {
        point = select(b, a, inside_square(a));
        priority = 0.2 * distance(point, vec2f(0.5));
    }
    if hidden(light_view, low + 0.5, segment_depth(s, by_segment(s, low + point))) {
        discard;
    }
    return Left(saturate(point) + 1.0, priority);
}

fn inspect_map(s: Surface) -> f32 {
    if frame.map == shows_silhouette_edges || frame.map == shows_edge_quads {
        return inspect_edges(s.pixel);
    }
    if frame.map == shows_silhouette_points {
        return points_picture(s.pixel);
    }
    if frame.map == shows_edge_use {
        if !s.valid || !faces_light(s) {
            return -1.0;
        }
        let r = edge_receiver(s, choose(s).layer);
        let low = floor(r.texel - 0.5);
        let four = four_around(r, low);
        let all_lit = dot(four, vec4f(1.0));
        return select(-1.0, label(select(0u, 2u, has_point(r.layer, vec2i(low))), 0.9), all_lit > 0.0 && all_lit < 4.0);
    }
    return inspect_filter(s);
}

// The squares around the probe, enlarged: light, points, and the lines between them that part their quadrants.
fn points_picture(pixel: vec2u) -> f32 {
    let z = zoom(pixel);
    let r = edge_receiver(z.s, z.layer);
    if !z.valid || outside_map(r, z.place) {
        return drawn(white, select(0.05, 0.4, on_grid(z)));
    }
    let low = floor(z.place - 0.5);
    let here = z.place - 0.5 - low;
    let square = vec2i(low);
    let point = point_of(z.layer, square);
    if distance(here, point) < 0.12 {
        return drawn(select(7u, 1u, has_point(z.layer, square)), 1.0);
    }
    for (var k = 0u; k < 4u; k++) {
        let to = point_beyond(z.layer, square, k) - point;
        let along = saturate(dot(here - point, to) / max(dot(to, to), 1e-12));
        if distance(here, point + along * to) < 1.2 * z.scale {
            let corners = array<vec2u, 4>(vec2u(1u, 3u), vec2u(2u, 3u), vec2u(0u, 2u), vec2u(0u, 1u))[k];
            let four = four_around(r, low);
            return drawn(select(7u, 0u, four[corners.x] != four[corners.y]), 1.0);
        }
    }
    return zoomed_light(z, compare_beside(r, z.place), light_in(r, z.place));
}
