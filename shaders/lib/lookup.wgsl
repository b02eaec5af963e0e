//!include lib/light_view.wgsl
//!include lib/resolve.wgsl
//!include lib/cells.wgsl
// A receiver's place in a shadow map, with every bias applied. Includers choose how the map is drawn:
// lib/straight.wgsl or lib/warp.wgsl.

var<uniform> map: MapParams;
var shadow_map: texture_depth_2d;

struct Receiver {
    // Position in the map, texels.
    texel: vec2f,
    // Stored depth to compare with: lit where it is not below the map's (depth is reversed).
    depth: f32,
    // Change of `depth` per texel along the receiver's plane; zero unless asked for.
    gradient: vec2f,
    // Share by which a warp's w grows per texel along that plane.
    bend: vec2f,
    // How far all biases move the comparison towards the light, in texels.
    moved: f32,
}

// `radius`: how far the filter's taps reach from the receiver, texels; `tap`: how far the centre of a
// texel may be from the tap that compares with it, half texels (1 nearest, 2 bilinear).
fn receive(s: Surface, radius: f32, tap: f32) -> Receiver {
    let v = light_view;
    let to_light = normalize(light_at(s.position).to_light);
    let cosine = dot(s.normal, to_light);
    let straight = dot(v.axis, vec4f(s.position, 1.0));
    let texel = map_texel_size(v, s.position, to_light);

    let position = s.position + s.normal * (map.normal_offset * texel * sqrt(max(1.0 - cosine * cosine, 0.0)));
    let clip = light_clip(v, position);
    let z = dot(v.axis, vec4f(position, 1.0));
    // No steeper than the slope limit.
    let plane = plane_gradient(s.normal, clip);
    var gradient = plane.depth;
    let steepest = map.slope_limit * abs(stored_depth(v, z - texel) - stored_depth(v, z));
    let steepness = length(gradient);
    gradient *= min(1.0, steepest / max(steepness, 1e-30));
    let followed = map.receiver_plane != 0u;
    // A wider filter compares with farther texels of a sloping receiver, unless its plane is followed.
    let reach = tap + select(2.0 * radius, 0.0, followed);
    // Half a texel's diagonal farther a warp's plane has grown steeper than it is here.
    let grown = 1.0 - min(0.7072 * reach * length(plane.bend), 0.9);
    var r: Receiver;
    r.texel = map_texel(v, clip);
    // A bias of half a texel's diagonal, 0.7071, holds on a plane; under a warp that turns it takes what the ray asks.
    let turned = 1.4143 * abs(dot(gradient, map_spread(v, clip, r.texel)));
    let slope = map.slope_bias * max(min(steepness, steepest) * reach / grown, turned);
    // Cleared texels hold 0: what lies beyond the far plane is compared as if on it.
    r.depth = max(stored_depth(v, z - map.bias) + slope, 0.0);
    r.gradient = select(vec2f(0.0), gradient, followed);
    r.bend = plane.bend;
    r.moved = (straight - linear_depth(v, r.depth)) / texel;
    return r;
}

// How stored depth, and a warp's w, change per texel along a plane.
struct Gradient {
    depth: vec2f,
    bend: vec2f,
}

// Stored depth is an affine function of map position along a plane, perspective or not: solve for it
// from two tangents. Under a warp it is a quotient: with the gradients g of depth and k of ln w, a step of δ texels
// changes it by g·δ / (1 - k·δ).
fn plane_gradient(normal: vec3f, clip: vec4f) -> Gradient {
    let other = select(vec3f(1.0, 0.0, 0.0), vec3f(0.0, 1.0, 0.0), abs(normal.x) > 0.5);
    let t0 = normalize(cross(normal, other));
    let t1 = cross(normal, t0);
    let a = map_along(light_view, t0, clip);
    let b = map_along(light_view, t1, clip);
    let determinant = a.x * b.y - a.y * b.x;
    if abs(determinant) <= 1e-6 * length(a.xy) * length(b.xy) {
        // Edge-on to the light: as steep as can be, deeper along the normal.
        let out = map_along(light_view, normal, clip).xy;
        return Gradient(-1e20 * out / max(length(out), 1e-30), vec2f(0.0));
    }
    let depth = vec2f(a.z * b.y - b.z * a.y, b.z * a.x - a.z * b.x) / determinant;
    return Gradient(depth, vec2f(a.w * b.y - b.w * a.y, b.w * a.x - a.w * b.x) / determinant);
}

fn outside_map(texel: vec2f) -> bool {
    return any(texel < vec2f(0.0)) || any(texel >= vec2f(light_view.resolution));
}

// One nearest sample; lit outside the map, where nothing can cast.
fn compare(r: Receiver, texel: vec2f) -> f32 {
    if outside_map(texel) {
        return 1.0;
    }
    return select(0.0, 1.0, depth_at(r, floor(texel) + 0.5) >= textureLoad(shadow_map, vec2u(texel), 0));
}

// What to compare with at a place in the map: the receiver's plane there, if it is followed.
fn depth_at(r: Receiver, texel: vec2f) -> f32 {
    let step = texel - r.texel;
    return max(r.depth + dot(r.gradient, step) / max(1.0 - dot(r.bend, step), 0.1), 0.0);
}

// The maps that every technique with one shadow map shows; numbered as `MAPS` in Rust.
fn inspect_lookup(s: Surface, r: Receiver) -> f32 {
    if !s.valid || outside_map(r.texel) {
        return -1.0;
    }
    if frame.map == 1u {
        return cell_value(vec2u(r.texel));
    }
    return select(-1.0, r.moved, faces_light(s));
}
