//!include lib/silhouette.wgsl
//!include lib/edges.wgsl
//!include map/light_view.wgsl
//!include lib/edge_lines.wgsl
//!include lib/labels.wgsl
// Quads around silhouette edges in a map (Kenzel 2013): both ends are pushed along and across the edge in the light's image, after the
// projection, so that quads of edges that meet overlap. A technique says how far (`quad_reach`, texels, where the clip position has this w) and what its quads leave behind.

// Drawn already: the casters' depth.
var depth_map: texture_depth_2d;
var<storage, read> facing: array<i32>;
var<uniform> quads: QuadParams;

// An edge in the map: texels, and depth along the light's axis, metres. Seen from the light the shadow lies on the left of the way from
// a to b. Where it leaves the map, beyond the reach of any quad, it is cut off.
struct Segment {
    a: vec2f,
    b: vec2f,
    depth: vec2f,
    // Of the clip positions, for what is linear in space.
    w: vec2f,
    there: bool,
}

const nowhere = Segment(vec2f(0.0), vec2f(0.0), vec2f(0.0), vec2f(1.0), false);

fn masked_triangle(triangle: u32) -> bool {
    return materials[vertex_at(triangle_at(triangle).x).material].cutoff >= 0.0;
}

// The two vertices of edge number `i`, in the order that leaves the shadow on the left; twice the same one where it casts none. Edges of
// masked triangles alone are left out: not they bound the shadow, but the mask does.
fn ends_of(i: u32) -> vec2u {
    var number = i;
    var ends: vec2u;
    if quads.edges == edges_silhouette {
        let listed = silhouettes[i];
        number = listed.w;
        ends = listed.xy;
    }
    let edge = edges[number];
    var opaque = false;
    var turned = false;
    for (var k = 0u; k < edge.count; k++) {
        let side = sides[edge.first + k];
        opaque = opaque || !masked_triangle(side >> 1u);
        // The last triangle with a side to the light decides.
        let way = select(1, -1, (side & 1u) == 1u) * facing[side >> 1u];
        turned = select(turned, way < 0, way != 0);
    }
    if quads.edges == edges_all {
        ends = select(edge.ends, edge.ends.yx, turned);
    }
    return select(ends.xx, ends, opaque);
}

// Shares of the way from one clip position to another that lie in front of the light and no farther from the map than `beyond` texels.
fn inner_part(v: LightView, a: vec4f, b: vec4f, beyond: f32) -> vec2f {
    let g = 1.0 + 2.0 * beyond / v.resolution;
    let least = 0.01 * select(1.0, v.near, v.perspective == 1u);
    let in_a = array<f32, 5>(a.w - least, g * a.w - a.x, g * a.w + a.x, g * a.w - a.y, g * a.w + a.y);
    let in_b = array<f32, 5>(b.w - least, g * b.w - b.x, g * b.w + b.x, g * b.w - b.y, g * b.w + b.y);
    var part = vec2f(0.0, 1.0);
    for (var k = 0u; k < 5u; k++) {
        let at = in_a[k] / (in_a[k] - in_b[k]);
        if in_a[k] < 0.0 && in_b[k] < 0.0 {
            return vec2f(1.0, 0.0);
        }
        part.x = select(part.x, max(part.x, at), in_a[k] < 0.0);
        part.y = select(part.y, min(part.y, at), in_b[k] < 0.0);
    }
    return part;
}

// Edge number `i` in a layer's map.
fn segment_in(v: LightView, i: u32) -> Segment {
    let ends = ends_of(i);
    if ends.x == ends.y {
        return nowhere;
    }
    let p = vertex_position(ends.x);
    let q = vertex_position(ends.y);
    let clip_p = light_clip(v, p);
    let clip_q = light_clip(v, q);
    let part = inner_part(v, clip_p, clip_q, 2.0 * quad_reach(v, v.near) + 2.0);
    if part.x >= part.y {
        return nowhere;
    }
    // Ends that are not cut off stay the same bit for bit in all edges that they belong to.
    let a = select(mix(clip_p, clip_q, part.x), clip_p, part.x == 0.0);
    let b = select(mix(clip_p, clip_q, part.y), clip_q, part.y == 1.0);
    let depths = vec2f(depth_in(v, p), depth_in(v, q));
    let s = Segment(light_texel(v, a), light_texel(v, b), mix(depths.xx, depths.yy, part), vec2f(a.w, b.w), true);
    return select_segment(s, any(s.a != s.b));
}

fn select_segment(s: Segment, there: bool) -> Segment {
    var out = s;
    out.there = there;
    return out;
}

// Where a place lies by a segment.
struct Near {
    // From the line, positive in the shadow.
    signed: f32,
    // From the segment.
    off: f32,
    // Along it, 0 to 1 between its ends and as far beyond them as the place lies, texels.
    along: f32,
    length: f32,
}

fn by_segment(s: Segment, p: vec2f) -> Near {
    let whole = distance(s.a, s.b);
    let t = (s.b - s.a) / max(whole, 1e-20);
    let from_a = p - s.a;
    let along = dot(from_a, t);
    // Rows run down: left of t is this.
    let signed = dot(from_a, vec2f(t.y, -t.x));
    let beyond = max(max(-along, along - whole), 0.0);
    // At an end both edges are as far, bit for bit.
    let off = select(select(distance(p, s.b), distance(p, s.a), along < 0.0), abs(signed), beyond == 0.0);
    return Near(signed, off, along, whole);
}

// Depth along the light's axis, metres, of the segment's point nearest to a place.
fn segment_depth(s: Segment, b: Near) -> f32 {
    let share = saturate(b.along / max(b.length, 1e-20));
    let inverse = mix(1.0 / s.w.x, 1.0 / s.w.y, share);
    return mix(s.depth.x, s.depth.y, share / (s.w.y * inverse));
}

// Whether what the map holds around a place hides an edge of this depth: all of it is nearer.
fn hidden(v: LightView, place: vec2f, depth: f32) -> bool {
    let last = vec2i(i32(v.resolution) - 1);
    var farthest = 1.0;
    for (var i = 0; i < 9; i++) {
        let at = clamp(vec2i(floor(place)) + vec2i(i % 3 - 1, i / 3 - 1), vec2i(0), last);
        farthest = min(farthest, textureLoad(depth_map, at, 0));
    }
    return stored_depth(v, depth - quads.kill_bias) < farthest;
}

struct Quad {
    @builtin(position) at: vec4f,
    @location(0) @interpolate(flat) ends: vec4f,
    // Depths of the ends and their w.
    @location(1) @interpolate(flat) depths: vec4f,
    // 1 more than the edge's number, so that 0 is none.
    @location(2) @interpolate(flat) number: u32,
    // The place in the map, texels.
    @location(3) @interpolate(linear) place: vec2f,
}

fn segment_of(q: Quad) -> Segment {
    return Segment(q.ends.xy, q.ends.zw, q.depths.xy, q.depths.zw, true);
}

// A quad's corner in the map, texels: 0 and 1 at the first end, 2 and 3 at the other.
fn corner_of(v: LightView, s: Segment, corner: u32) -> vec2f {
    let t = normalize(s.b - s.a);
    let n = vec2f(t.y, -t.x);
    let second = corner >= 2u;
    let out = quad_reach(v, select(s.w.x, s.w.y, second));
    let along = select(-t, t, second);
    let across = select(-n, n, (corner & 1u) == 1u);
    return select(s.a, s.b, second) + (along + across) * out;
}

fn quad_corner(i: u32, moved: f32) -> Quad {
    let s = segment_in(light_view, i / 6u);
    var q: Quad;
    q.at = vec4f(2.0, 2.0, 0.0, 1.0);
    if s.there {
        let corners = array<u32, 6>(0u, 1u, 2u, 2u, 1u, 3u);
        q.place = corner_of(light_view, s, corners[i % 6u]);
        let shown = q.place - moved;
        q.at = vec4f(2.0 * shown.x / light_view.resolution - 1.0, 1.0 - 2.0 * shown.y / light_view.resolution, 0.5, 1.0);
        q.ends = vec4f(s.a, s.b);
        q.depths = vec4f(s.depth, s.w);
        q.number = i / 6u + 1u;
    }
    return q;
}

// Views.

// Of the picture: outlines of quads in the map, or edges over the scene.
var edge_lines: texture_2d<f32>;

@vertex
fn wire_corner(@builtin(vertex_index) i: u32) -> Quad {
    var q = quad_corner(i, 0.0);
    if q.number > 0u {
        let shown = pixel_of(light_view, q.place) / vec2f(frame.size);
        q.at = vec4f(2.0 * shown.x - 1.0, 1.0 - 2.0 * shown.y, 0.5, 1.0);
    }
    return q;
}

// The outline of a quad, and the edge in it.
@fragment
fn wire(q: Quad) -> @location(0) vec4f {
    if any(q.place < vec2f(0.0)) || any(q.place > vec2f(light_view.resolution)) {
        discard;
    }
    let s = segment_of(q);
    let b = by_segment(s, q.place);
    let share = saturate(b.along / b.length);
    let reach = vec2f(distance(corner_of(light_view, s, 0u), s.a), distance(corner_of(light_view, s, 2u), s.b)) * 0.70710678;
    let width = mix(reach.x, reach.y, share);
    let pixel = laid_out(q.at.xy).scale;
    let rim = min(width - abs(b.signed), min(b.along + reach.x, b.length + reach.y - b.along));
    if abs(b.off) < 0.6 * pixel {
        return vec4f(2.0);
    }
    if rim > 1.2 * pixel {
        discard;
    }
    return vec4f(1.0);
}

@vertex
fn line_corner(@builtin(vertex_index) i: u32) -> Line {
    return edge_corner(i % 6u, ends_of(i / 6u));
}

// The views of both techniques: quads over the map, edges over the scene.
fn inspect_edges(pixel: vec2u) -> f32 {
    let line = textureLoad(edge_lines, pixel, 0).x;
    if frame.map == shows_silhouette_edges {
        return label(0u, line);
    }
    let at = laid_out(vec2f(pixel) + 0.5);
    if line > 0.0 {
        return drawn(select(3u, 0u, line > 1.5), 0.9);
    }
    if !at.inside || at.rim {
        return drawn(white, select(0.0, 0.4, at.rim));
    }
    return drawn(white, 0.1 + 0.5 * nearness_of(at));
}

// What the map holds there, linear: 1 at its near, 0 at its far end.
fn nearness_of(at: Laid) -> f32 {
    return 1.0 - depth_share(light_views[at.layer], drawn_depth(at.layer, vec2u(at.place)));
}
