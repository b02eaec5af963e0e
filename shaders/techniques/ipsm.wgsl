//!include map/depth_range.wgsl
//!include map/light_view.wgsl
//!include map/faces_of.wgsl
// Vanek, Navratil, Herout, Zemcik 2011: a paraboloid turned to the part of the camera's frustum that holds samples, and magnified.

var<uniform> ipsm: IpsmParams;
// Written before with plain sides, which stay where no cone is narrow enough.
var<storage, read_write> aimed_faces: Faces;
var<storage, read_write> aimed_views: array<LightView, most_layers>;
// Of the last frame; zero: none.
var<storage, read_write> last_axis: vec4f;

// Cosine of the widest angle between an axis and the directions.
fn cosine_around(axis: vec3f, directions: ptr<function, array<vec3f, 8>>) -> f32 {
    var least = 1.0;
    for (var i = 0u; i < 8u; i++) {
        least = min(least, dot(axis, (*directions)[i]));
    }
    return least;
}

// The axis of the narrowest cone that holds all directions: two of them lie opposite each other on it, or three.
fn smallest_axis(directions: ptr<function, array<vec3f, 8>>, start: vec3f) -> vec3f {
    var best = start;
    var cosine = cosine_around(start, directions);
    for (var i = 0u; i < 8u; i++) {
        for (var j = 0u; j < i; j++) {
            let a = (*directions)[i];
            let b = (*directions)[j];
            let pair = a + b;
            if length(pair) > 1e-6 {
                let axis = normalize(pair);
                let here = cosine_around(axis, directions);
                if here > cosine {
                    best = axis;
                    cosine = here;
                }
            }
            for (var k = 0u; k < j; k++) {
                let normal = cross(a - b, (*directions)[k] - b);
                if length(normal) > 1e-9 {
                    var axis = normalize(normal);
                    axis *= select(1.0, -1.0, dot(axis, b) < 0.0);
                    let here = cosine_around(axis, directions);
                    if here > cosine {
                        best = axis;
                        cosine = here;
                    }
                }
            }
        }
    }
    return best;
}

@compute @workgroup_size(1)
fn aim() {
    var ends = vec2f(frame.near, frame.shadow_far);
    let found = depth_range();
    if ipsm.depths == depths_samples && found.x > 0.0 {
        ends = found;
    }
    let more = 0.01 * ipsm.depth_margin * (ends.y - ends.x);
    // Never beyond the whole frustum, whose cone is known to be wide enough.
    ends = vec2f(max(ends.x - more, frame.near), min(ends.y + more, frame.shadow_far));
    // The corners of the frustum between these depths.
    var directions: array<vec3f, 8>;
    var sum = vec3f(0.0);
    for (var i = 0u; i < 8u; i++) {
        let side = vec2f(select(-1.0, 1.0, (i & 1u) == 1u), select(-1.0, 1.0, (i & 2u) == 2u));
        let depth = select(ends.x, ends.y, i >= 4u);
        let corner = shadow_view_place(side, depth);
        directions[i] = normalize(corner - frame.light_position);
        sum += directions[i];
    }
    if length(sum) < 1e-6 {
        return;
    }
    var axis = normalize(sum);
    if ipsm.cone == cone_smallest {
        axis = smallest_axis(&directions, axis);
    }
    if ipsm.smoothing > 0.0 && dot(last_axis, last_axis) > 0.0 {
        axis = normalize(mix(axis, last_axis.xyz, ipsm.smoothing));
    }
    last_axis = vec4f(axis, 0.0);
    // A hair wider, for rounding. Within a right angle a cone that holds the corners holds all between them.
    let half = 1.001 * acos(clamp(cosine_around(axis, &directions), -1.0, 1.0)) + 1e-5;
    if half > radians(min(ipsm.widest, 89.9)) {
        return;
    }
    var v = aimed_views[0];
    let other = select(vec3f(0.0, 1.0, 0.0), vec3f(0.0, 0.0, -1.0), abs(axis.y) > 0.99);
    let x = normalize(cross(other, axis));
    let y = cross(axis, x);
    let light = frame.light_position;
    v.row_x = vec4f(x, -dot(x, light));
    v.row_y = vec4f(y, -dot(y, light));
    v.axis = vec4f(axis, -dot(axis, light));
    v.row_w = v.axis;
    // The zoom, Navratil 4.1: the cone's rim touches the map's sides, less the guard band.
    let zoom = tan(0.5 * half);
    let wide = zoom * v.resolution / (v.resolution - 2.0 * v.margin);
    v.row_z = vec4f(0.0, 0.0, vec2f(1.0 / wide));
    v.ahead = cos(min(half + 4.0 * v.margin * wide / v.resolution + 0.02, 3.1415927));
    aimed_views[0] = v;
    aimed_faces.count = 1u;
    aimed_faces.met = 1u;
    aimed_faces.axes[0] = vec4f(axis, 0.0);
}
