//!include lib/frame.wgsl
//!include lib/gbuffer.wgsl
//!include lib/cells.wgsl
//!include map/light_view.wgsl
//!include map/analysis.wgsl
// Looking layers of maps up: a receiver's place with every bias applied, the pass that fills the visibility, and the views
// of the look-up. It is put together with
//     map/choose/…  fn choose(s: Surface) -> Chosen                    which layers a surface looks up
//                   fn texture_layer(layer: u32) -> u32                which layer of the texture holds one
//                   fn holds(layer: u32, texel: vec2f) -> bool         whether a place of a layer's square is the layer's own
//                   fn beside(r: Receiver, texel: vec2f) -> Beside     what lies at a place outside the receiver's map
//     map/place/…   fn map_texel(v: LightView, clip: vec4f) -> vec2f   where in a layer, and what goes with it
//     map/filter/…  fn lit(s: Surface, layer: u32) -> f32              visibility by one layer
//                   fn inspect_filter(s: Surface) -> f32               the filter's views, and inspect_look_up's
// and a technique's own `fn inspect_map(s: Surface) -> f32`.

var<uniform> biases: BiasParams;
var shadow_maps: texture_depth_2d_array;

struct Chosen {
    layer: u32,
    // The layer that takes over, by this share.
    next: u32,
    share: f32,
}

// What is found in another map: whether the light is seen there, and how far what is drawn lies from it, metres along the axis of the
// receiver's own.
struct Beside {
    lit: f32,
    depth: f32,
}

struct Receiver {
    layer: u32,
    // Of the surface.
    normal: vec3f,
    // Side of the layer's map, texels.
    side: f32,
    // Position in the map, texels, and in clip space.
    texel: vec2f,
    clip: vec4f,
    // Stored depth to compare with: lit where it is not below the map's (depth is reversed).
    depth: f32,
    // Change of depth per texel along the receiver's plane, no steeper than the slope limit; and by how much `depth` is compared as
    // changing: zero unless asked for.
    plane: vec2f,
    gradient: vec2f,
    // Share by which a warp's w grows per texel along that plane.
    bend: vec2f,
    // How far all biases move the comparison along the light's axis, in texels.
    moved: f32,
}

// The rasteriser moves a triangle's corners by up to a 512th of a texel along each side, and rounding moves a receiver's place
// in a large map as far. On a slope that changes depths.
const snapped = 0.0078125;

// Depth that every comparison is moved by, metres.
fn constant_bias() -> f32 {
    switch biases.bias_kind {
        case bias_kind_slope: {
            return biases.bias;
        }
        case bias_kind_ray_plane: {
            return 1e-6 * biases.epsilon * distance(frame.bounds_min, frame.bounds_max);
        }
        default: {
            return 0.0;
        }
    }
}

// Texels that a receiver is moved by along its normal, where the light grazes it.
fn normal_offset() -> f32 {
    return select(0.0, biases.normal_offset, biases.bias_kind == bias_kind_slope);
}

// What `receive` was asked for last, and the depths that it went through: metres with the normal offset; stored, with the constant bias.
var<private> received_with: vec2f = vec2f(0.0, 1.0);
var<private> received_depths: vec2f;

// `radius`: how far the filter's taps reach from the receiver, texels; `tap`: how far the centre of a
// texel may be from the tap that compares with it, half texels (1 nearest, 2 bilinear).
fn receive(s: Surface, layer: u32, radius: f32, tap: f32) -> Receiver {
    let v = light_views[layer];
    let to_light = normalize(light_at(s.position).to_light);
    let cosine = dot(s.normal, to_light);
    let texel = map_texel_size(v, s.position, to_light);

    let position = s.position + s.normal * (normal_offset() * texel * sqrt(max(1.0 - cosine * cosine, 0.0)));
    let clip = light_clip(v, position);
    let z = depth_in(v, position);
    // No steeper than the slope limit.
    let plane = plane_gradient(v, s.normal, clip);
    var gradient = plane.depth;
    let steepest = biases.slope_limit * abs(stored_depth(v, z - texel) - stored_depth(v, z));
    let steepness = length(gradient);
    gradient *= min(1.0, steepest / max(steepness, 1e-30));
    let by_ray = biases.bias_kind == bias_kind_ray_plane;
    let sloped = biases.bias_kind == bias_kind_slope;
    let followed = by_ray || (sloped && biases.receiver_plane != 0u);
    // A wider filter compares with farther texels of a sloping receiver, unless its plane is followed.
    let reach = tap + select(2.0 * radius, 0.0, followed);
    // Half a texel's diagonal farther a warp's plane has grown steeper than it is here.
    let grown = 1.0 - min(0.7072 * reach * length(plane.bend), 0.9);
    var r: Receiver;
    r.layer = layer;
    r.normal = s.normal;
    r.side = v.resolution;
    r.texel = map_texel(v, clip);
    r.clip = clip;
    // A bias of half a texel's diagonal, 0.7071, holds on a plane; under a warp that turns it takes what the ray asks.
    let turned = 1.4143 * abs(dot(gradient, map_spread(v, clip, r.texel)));
    let climb = min(steepness, steepest);
    let slope = select(0.0, biases.slope_bias * max(climb * reach / grown, turned), sloped) + select(0.0, snapped * climb, by_ray);
    received_with = vec2f(radius, tap);
    received_depths = vec2f(z, stored_depth(v, z - constant_bias()));
    // Cleared texels hold 0: what lies beyond the far plane is compared as if on it.
    r.depth = max(stored_depth(v, z - constant_bias()) + slope, 0.0);
    r.plane = gradient;
    r.gradient = select(vec2f(0.0), gradient, followed);
    r.bend = plane.bend;
    r.moved = moved_to(s, layer, select(r.depth, depth_at(r, floor(r.texel) + 0.5), by_ray));
    return r;
}

// How far a comparison with this stored depth is moved along the light's axis, in texels.
fn moved_to(s: Surface, layer: u32, depth: f32) -> f32 {
    let v = light_views[layer];
    let texel = map_texel_size(v, s.position, normalize(light_at(s.position).to_light));
    return abs(depth_in(v, s.position) - linear_depth(v, depth)) / texel;
}

// How stored depth, and a warp's w, change per texel along a plane.
struct Gradient {
    depth: vec2f,
    bend: vec2f,
}

// Stored depth is an affine function of map position along a plane, perspective or not: solve for it
// from two tangents. Under a warp it is a quotient: with the gradients g of depth and k of ln w, a step of δ texels
// changes it by g·δ / (1 - k·δ).
fn plane_gradient(v: LightView, normal: vec3f, clip: vec4f) -> Gradient {
    let other = select(vec3f(1.0, 0.0, 0.0), vec3f(0.0, 1.0, 0.0), abs(normal.x) > 0.5);
    let t0 = normalize(cross(normal, other));
    let t1 = cross(normal, t0);
    let a = map_along(v, t0, clip);
    let b = map_along(v, t1, clip);
    let determinant = a.x * b.y - a.y * b.x;
    if abs(determinant) <= 1e-6 * length(a.xy) * length(b.xy) {
        // Edge-on to the light: as steep as can be, deeper along the normal.
        let out = map_along(v, normal, clip).xy;
        return Gradient(-1e20 * out / max(length(out), 1e-30), vec2f(0.0));
    }
    let depth = vec2f(a.z * b.y - b.z * a.y, b.z * a.x - a.z * b.x) / determinant;
    return Gradient(depth, vec2f(a.w * b.y - b.w * a.y, b.w * a.x - a.w * b.x) / determinant);
}

// Texels a metre across the light at a surface, along the map's sides.
fn texels_per_metre(s: Surface, layer: u32) -> vec2f {
    let v = light_views[layer];
    return map_density(v, s.position, normalize(light_at(s.position).to_light));
}

fn outside_map(r: Receiver, texel: vec2f) -> bool {
    return any(texel < vec2f(0.0)) || any(texel >= vec2f(r.side)) || !holds(r.layer, texel);
}

// One nearest sample.
fn compare(r: Receiver, texel: vec2f) -> f32 {
    if outside_map(r, texel) {
        return beside(r, texel).lit;
    }
    return select(0.0, 1.0, depth_at(r, floor(texel) + 0.5) >= drawn_depth(r.layer, vec2u(texel)));
}

// One sample of a texel that lies off the receiver's place: compared where its light ray meets the receiver's plane, but never farther
// from the light than the receiver itself, as behind an inner corner the plane runs on below other surfaces.
fn compare_beside(r: Receiver, texel: vec2f) -> f32 {
    if outside_map(r, texel) {
        return beside(r, texel).lit;
    }
    let step = map_step(light_views[r.layer], r.clip, r.texel, floor(texel) + 0.5);
    let rise = dot(r.plane, step) / max(1.0 - dot(r.bend, step), 0.1);
    return select(0.0, 1.0, r.depth + max(rise, 0.0) >= drawn_depth(r.layer, vec2u(texel)));
}

// How far what is drawn at a place lies from the light, metres along the axis of the receiver's map.
fn caster_depth(r: Receiver, texel: vec2f) -> f32 {
    if outside_map(r, texel) {
        return beside(r, texel).depth;
    }
    return linear_depth(light_views[r.layer], drawn_depth(r.layer, vec2u(texel)));
}

fn drawn_depth(layer: u32, texel: vec2u) -> f32 {
    return textureLoad(shadow_maps, texel, texture_layer(layer), 0);
}

// What to compare with at a place in the map: the depth at which its light ray meets the receiver's plane, if that is followed.
fn depth_at(r: Receiver, texel: vec2f) -> f32 {
    var step = texel - r.texel;
    if biases.bias_kind == bias_kind_ray_plane {
        step = map_step(light_views[r.layer], r.clip, r.texel, texel);
    }
    var rise = dot(r.gradient, step) / max(1.0 - dot(r.bend, step), 0.1);
    if biases.bias_kind == bias_kind_ray_plane && biases.toward_light != 0u {
        rise = max(rise, 0.0);
    }
    return max(r.depth + rise, 0.0);
}

// What a bilinear tap compares its four texels with: as near the light as the receiver's plane may be at any of them.
fn depth_at_four(r: Receiver, texel: vec2f) -> f32 {
    if biases.bias_kind != bias_kind_ray_plane {
        return depth_at(r, texel);
    }
    let low = max(depth_at(r, texel - 1.0), depth_at(r, texel + vec2f(1.0, -1.0)));
    return max(low, max(depth_at(r, texel + vec2f(-1.0, 1.0)), depth_at(r, texel + 1.0)));
}

fn visibility(s: Surface) -> f32 {
    let c = choose(s);
    // One copy of the look-up: adapters that run both sides of a branch pay for each.
    var seen = 0.0;
    var k = 0u;
    loop {
        let v = lit(s, select(c.layer, c.next, k == 1u));
        seen = select(mix(seen, v, c.share), v, k == 0u);
        k++;
        if c.share <= 0.0 || k == 2u {
            break;
        }
    }
    return seen;
}

var visibility_out: texture_storage_2d<r32float, write>;
var map_out: texture_storage_2d<r32float, write>;

@compute @workgroup_size(8, 8)
fn resolve(@builtin(global_invocation_id) id: vec3u) {
    let pixel = banded(id.xy);
    if any(pixel >= frame.size) {
        return;
    }
    let s = load_surface(pixel);
    var v = 1.0;
    if s.valid {
        v = 0.0;
        let light = light_at(s.position);
        if may_be_shadowed(s, light) {
            v = visibility(s);
        }
    }
    textureStore(visibility_out, pixel, vec4f(v));
}

// Draws the technique's own map; -1 where there is nothing to show.
@compute @workgroup_size(8, 8)
fn inspect(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= frame.size.x || id.y >= frame.size.y {
        return;
    }
    textureStore(map_out, id.xy, vec4f(inspect_map(load_surface(id.xy))));
}

// The views of every look-up. `r`: what the filter compares with.
fn inspect_look_up(s: Surface, r: Receiver) -> f32 {
    if !s.valid || outside_map(r, r.texel) {
        return -1.0;
    }
    if frame.map == shows_texels {
        return cell_value(vec2u(r.texel));
    }
    return select(-1.0, r.moved, faces_light(s));
}
