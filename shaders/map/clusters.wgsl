//!include lib/frame.wgsl
//!include map/light_view.wgsl
//!include map/faces_of.wgsl
// Clusters of 64 triangles in a row, each in a box: a face leaves all of them out by one test before its triangles are asked one by one.

// A box: its middle, and half its sides.
struct Cluster {
    middle: vec3f,
    half: vec3f,
}

const cluster_size = 64u;
// Clusters to a row of the dispatch over those that are listed.
const cluster_row = 32768u;

var<storage, read> clusters: array<Cluster>;

fn cluster_count() -> u32 {
    return (faces.triangles + cluster_size - 1u) / cluster_size;
}

// Whether all of a box lies where the product with a plane is negative, rounding spared.
fn box_beyond(plane: vec4f, c: Cluster) -> bool {
    let reach = dot(abs(plane.xyz), c.half);
    let rounding = 1e-5 * (dot(abs(plane.xyz), abs(c.middle)) + reach + abs(plane.w));
    return dot(plane, vec4f(c.middle, 1.0)) + reach + rounding < 0.0;
}

// Whether a triangle in the box may cast a shadow into the camera's frustum: as `shadows_view` asks each.
fn cluster_shadows_view(c: Cluster) -> bool {
    let apart = vec4f(0.0, 0.0, 0.0, faces.angle * (distance(c.middle, frame.light_position) + length(c.half)) + faces.metres);
    for (var i = 0u; i < 6u; i++) {
        let plane = faces.frustum[i] + apart;
        // Leading away from a side: beyond the plane through the light that is parallel to it.
        if box_beyond(plane, c) && box_beyond(vec4f(plane.xyz, -dot(plane.xyz, frame.light_position)) + apart, c) {
            return false;
        }
    }
    return true;
}

// Whether a triangle in the box may touch a face's map: as `touches_face` asks each.
fn cluster_touches_face(i: u32, c: Cluster) -> bool {
    let v = light_views[i];
    if v.perspective == 3u {
        let middle = c.middle - frame.light_position;
        let radius = 1.00001 * length(c.half);
        let far = length(middle);
        let angle = acos(clamp(dot(v.row_w.xyz, middle) / far, -1.0, 1.0)) - asin(min(radius / far, 1.0));
        return radius >= 0.999 * far || angle <= acos(v.ahead) + 1e-3;
    }
    if box_beyond(v.row_w - v.row_x, c) || box_beyond(v.row_w + v.row_x, c) || box_beyond(v.row_w - v.row_y, c)
        || box_beyond(v.row_w + v.row_y, c) || box_beyond(v.row_w, c) || box_beyond(v.row_z, c) {
        return false;
    }
    let half = 0.5 * v.resolution;
    for (var k = 0u; k < 2u; k++) {
        // As in `touches_region`, its spare texels at the largest w included.
        let e = faces.regions[2u * i + k].xyz;
        let spare = 1e-4 * v.resolution;
        let plane = half * e.x * v.row_x - half * e.y * v.row_y + (half * (e.x + e.y) + e.z + spare) * v.row_w;
        if box_beyond(plane, c) {
            return false;
        }
    }
    return true;
}
