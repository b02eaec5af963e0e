//!include lib/frame.wgsl
//!include map/splits.wgsl
//!include map/faces_of.wgsl
//!include lib/labels.wgsl
//!include lib/inset.wgsl
// What maps cover, as lines over the picture: an instance a line, drawn as a rectangle of the line's width.

struct Segment {
    start: vec3f,
    // As `label_color` counts.
    color: u32,
    end: vec3f,
    // Times the width of the camera's frustum.
    weight: f32,
}

struct Style {
    // Half a line's width, pixels.
    half: f32,
    // 1: `map` holds labels, of which those on a plain ground belong to a drawing and not to the scene.
    labels: u32,
    // 1: a map lies small in the corner, which stays free.
    inset: u32,
    padding: u32,
}

var g_position: texture_2d<f32>;
var<uniform> style: Style;
var map: texture_2d<f32>;
var<storage, read> segments: array<Segment>;
// As `draws` in cascades.wgsl.
var<storage, read> cascade_draws: array<u32>;

// Colours of a map's box, where there is but one.
const box_color = 1u;

struct Line {
    @builtin(position) clip: vec4f,
    // In space, for the depth.
    @location(0) position: vec3f,
    // Both ends in the picture, pixels.
    @location(1) @interpolate(flat) ends: vec4f,
    @location(2) @interpolate(flat) color: u32,
    // Half its width, pixels.
    @location(3) @interpolate(flat) half: f32,
}

fn no_line() -> Line {
    return Line(vec4f(2.0, 2.0, 0.0, 1.0), vec3f(0.0), vec4f(0.0), 0u, 0.0);
}

// Corner `index` of 6 of the line from a to b, cut to what lies before the camera and not far beside the picture.
fn line(index: u32, a: vec3f, b: vec3f, color: u32, half: f32) -> Line {
    let one = frame.eye_proj * vec4f(a - frame.eye, 1.0);
    let other = frame.eye_proj * vec4f(b - frame.eye, 1.0);
    var first = 0.0;
    var last = 1.0;
    for (var k = 0u; k < 5u; k++) {
        // Positive inside.
        let side = select(-1.0, 1.0, (k & 1u) == 1u);
        var d = vec2f(dot(a - frame.eye, frame.forward), dot(b - frame.eye, frame.forward)) - frame.near;
        if k < 2u {
            d = 2.0 * vec2f(one.w, other.w) + side * vec2f(one.x, other.x);
        } else if k < 4u {
            d = 2.0 * vec2f(one.w, other.w) + side * vec2f(one.y, other.y);
        }
        if d.x < 0.0 && d.y < 0.0 {
            return no_line();
        }
        let at = d.x / (d.x - d.y);
        first = select(first, max(first, at), d.x < 0.0);
        last = select(last, min(last, at), d.y < 0.0);
    }
    if first >= last {
        return no_line();
    }
    let start = mix(one, other, first);
    let end = mix(one, other, last);
    let size = vec2f(frame.size);
    let p = (0.5 + vec2f(0.5, -0.5) * start.xy / start.w) * size;
    let q = (0.5 + vec2f(0.5, -0.5) * end.xy / end.w) * size;
    let way = q - p;
    let along = select(vec2f(1.0, 0.0), way / max(length(way), 1e-6), length(way) > 1e-6);
    // With room for the dark rim and the smooth edge.
    let wide = half * 2.0 + 1.0;
    let at_end = (0x32u >> index & 1u) == 1u;
    let left = (0x2cu >> index & 1u) == 1u;
    let corner = select(p - along * wide, q + along * wide, at_end)
        + vec2f(-along.y, along.x) * select(-wide, wide, left);
    let w = select(start.w, end.w, at_end);
    let ndc = (corner / size * 2.0 - 1.0) * vec2f(1.0, -1.0);
    return Line(vec4f(ndc * w, 0.5 * w, w), mix(a, b, select(first, last, at_end)), vec4f(p, q), color, half);
}

// The ends of a cuboid's edge `i` of 12: which of the two sides along each axis.
fn edge_end(i: u32, end: u32) -> vec3u {
    let beside = vec2u(i & 1u, i >> 1u & 1u);
    switch i / 4u {
        case 0u: {
            return vec3u(end, beside);
        }
        case 1u: {
            return vec3u(beside.x, end, beside.y);
        }
        default: {
            return vec3u(beside, end);
        }
    }
}

// Where three planes meet.
fn meeting(a: vec4f, b: vec4f, c: vec4f) -> vec3f {
    let bc = cross(b.xyz, c.xyz);
    return -(a.w * bc + b.w * cross(c.xyz, a.xyz) + c.w * cross(a.xyz, b.xyz)) / dot(a.xyz, bc);
}

// A corner of what a light's view holds: the map's square at its near and far end, taken back through whatever matrix.
fn view_corner(v: LightView, corner: vec3u) -> vec3f {
    let side = 2.0 * vec2f(corner.xy) - 1.0;
    let depth = select(v.near, v.far, corner.z == 1u);
    return meeting(v.row_x - side.x * v.row_w, v.row_y - side.y * v.row_w, v.axis - vec4f(0.0, 0.0, 0.0, depth));
}

// A line of the box of a light's view. A warp may take a corner beyond infinity; its edges are left out.
fn box_line(index: u32, v: LightView, edge: u32, color: u32) -> Line {
    let a = view_corner(v, edge_end(edge, 0u));
    let b = view_corner(v, edge_end(edge, 1u));
    if !(dot(v.row_w, vec4f(a, 1.0)) > 0.0 && dot(v.row_w, vec4f(b, 1.0)) > 0.0) {
        return no_line();
    }
    // Thinner than the frustum that it was made for.
    return line(index, a, b, color, 0.6 * style.half);
}

// A corner of the shadow camera's frustum between depths.
fn frustum_corner(corner: vec3u, near: f32, far: f32) -> vec3f {
    return shadow_view_place(2.0 * vec2f(corner.xy) - 1.0, select(near, far, corner.z == 1u));
}

@vertex
fn segment_line(@builtin(vertex_index) index: u32, @builtin(instance_index) i: u32) -> Line {
    let s = segments[i];
    return line(index, s.start, s.end, s.color, s.weight * style.half);
}

// The box of the one map.
@vertex
fn view_line(@builtin(vertex_index) index: u32, @builtin(instance_index) i: u32) -> Line {
    return box_line(index, light_view, i, box_color);
}

// Of each cascade its box, and, seen from elsewhere, its slice of the frustum.
@vertex
fn cascade_line(@builtin(vertex_index) index: u32, @builtin(instance_index) i: u32) -> Line {
    let cascade = i / 24u;
    let edge = i % 12u;
    if i % 24u < 12u {
        // One that is fitted to samples and has none has no box.
        if fitting.narrow == 1u && cascade_draws[10u * cascade + 1u] == 0u {
            return no_line();
        }
        return box_line(index, light_views[cascade], edge, cascade);
    }
    let far = min(split(cascade + 1u), frame.shadow_far);
    // Where it begins the one before ends, in that one's colour.
    let begins = edge < 8u && (edge & 2u) == 0u;
    if frame.frozen == 0u || split(cascade) >= far || (begins && cascade > 0u) {
        return no_line();
    }
    let a = frustum_corner(edge_end(edge, 0u), split(cascade), far);
    let b = frustum_corner(edge_end(edge, 1u), split(cascade), far);
    return line(index, a, b, cascade, style.half);
}

// As `draws` in map/faces.wgsl.
var<storage, read> face_draws: array<u32>;

// Lines around a face's border, and those from the light to it.
const around = 48u;
const spokes = 8u;

// The direction from the light at which a face ends, at a turn of `turn` (0 to 1) around its axis: where another one's axis
// becomes the nearest, or where its map ends if it is alone.
fn border(i: u32, turn: f32) -> vec3f {
    let axis = faces.axes[i].xyz;
    let other = select(vec3f(1.0, 0.0, 0.0), vec3f(0.0, 1.0, 0.0), abs(axis.x) > 0.5);
    let x = normalize(cross(axis, other));
    let out = cos(6.2831853 * turn) * x + sin(6.2831853 * turn) * cross(axis, x);
    var angle = select(3.1415927, acos(light_views[i].ahead), faces.count == 1u && light_views[i].perspective == 3u);
    for (var j = 0u; j < faces.count; j++) {
        let apart = axis - faces.axes[j].xyz;
        // Halves of one face lie as good as at one place.
        if length(apart) > 0.01 {
            let at = atan2(dot(apart, axis), -dot(apart, out));
            angle = min(angle, at);
        }
    }
    return cos(angle) * axis + sin(angle) * out;
}

// Of each face that is drawn the border, and lines to it from the light.
@vertex
fn face_line(@builtin(vertex_index) index: u32, @builtin(instance_index) i: u32) -> Line {
    let face = i / (around + spokes);
    let part = i % (around + spokes);
    if face_draws[10u * face + 1u] == 0u {
        return no_line();
    }
    let far = min(light_views[face].far, 0.25 * distance(frame.bounds_min, frame.bounds_max));
    let light = frame.light_position;
    if part >= around {
        return line(index, light, light + far * border(face, f32(part - around) / f32(spokes)), face, 0.6 * style.half);
    }
    let a = light + far * border(face, f32(part) / f32(around));
    let b = light + far * border(face, f32(part + 1u) / f32(around));
    return line(index, a, b, face, style.half);
}

// A light core with a dark rim, so that it shows on any ground; behind surfaces faint.
@fragment
fn draw_line(in: Line) -> @location(0) vec4f {
    let pixel = vec2u(in.clip.xy);
    if style.labels == 1u && textureLoad(map, pixel, 0).x >= plain_ground {
        discard;
    }
    if style.inset == 1u && !beside_inset(pixel) {
        discard;
    }
    let way = in.ends.zw - in.ends.xy;
    let along = saturate(dot(in.clip.xy - in.ends.xy, way) / max(dot(way, way), 1e-12));
    let off = distance(in.clip.xy, in.ends.xy + along * way);
    let core = saturate(in.half + 0.5 - off);
    let surface = textureLoad(g_position, pixel, 0).w;
    let depth = dot(in.position - frame.eye, frame.forward);
    // Lines on a surface belong before it.
    if surface > 0.0 && depth > surface + 0.003 * distance_at(surface) {
        return vec4f(label_color(in.color), 0.35 * core);
    }
    let rim = 0.6 * saturate(2.0 * in.half + 0.5 - off);
    return vec4f(label_color(in.color) * core / max(max(core, rim), 1e-6), max(core, rim));
}
