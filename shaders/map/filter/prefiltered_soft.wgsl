//!include map/sums.wgsl
//!include map/filter/chebyshev.wgsl
//!include map/filter/hamburger.wgsl
//!include map/filter/penumbra.wgsl
//!include map/filter/quantised.wgsl
// Soft shadows from box means of moments: variance (Yang et al. 2010) and moment soft shadow mapping (Peters et al. 2016). As PCSS,
// a search for casters and a filter as wide as the penumbra, but each is one mean.

var<uniform> soft: PrefilteredSoftParams;

// Half the side of a square as large as a disc of radius 1.
const square = 0.8862269;

// Smaller shares of casters are rounding (Yang et al., section 5).
const least_share = 0.01;

fn widest_box() -> f32 {
    return f32(soft.max_box);
}

fn moments(z: f32) -> vec4f {
    let b = vec4f(z, z * z, z * z * z, z * z * z * z);
    return select(b, saturate(packed(b)), soft.soft_kind == soft_kind_mssm);
}

// The share of a box's depths that lie before a depth, and their mean, from the box's moments.
fn casters_before(m: vec4f, t: f32) -> vec2f {
    // What is lit lies at the receiver's depth.
    let seen = chebyshev(m.xy, t, 1.0 / one());
    let two = vec2f(1.0 - seen, max((m.x - seen * t) / max(1.0 - seen, 1e-6), 0.0));
    let four = depths_before(mix(unpacked(m), vec4f(0.5), 1e-6 * soft.mssm_bias), t);
    return select(two, four, soft.soft_kind == soft_kind_mssm);
}

// What a box around the receiver holds before it. One comparison serves the whole box: before the receiver's plane as far out as
// `box_bias` says.
fn casters_in(s: Surface, layer: u32, half: vec2f) -> vec2f {
    let followed = soft.box_bias * half;
    let r = receive(s, layer, max(followed.x, followed.y), 1.0);
    let out = followed + 0.5;
    let left = max(depth_at(r, r.texel - out), depth_at(r, r.texel + vec2f(-out.x, out.y)));
    let right = max(depth_at(r, r.texel + out), depth_at(r, r.texel + vec2f(out.x, -out.y)));
    let found = casters_before(mean_of_box(r.texel, half, layer, r.side), depth_share(light_views[layer], max(left, right)));
    return select(found, vec2f(0.0), outside_map(r, r.texel));
}

// Half the sides of the box that stands for a disc, texels.
fn half_box(s: Surface, layer: u32, diameter: f32) -> vec2f {
    let most = most_texels(layer, 0.5 * widest_box());
    return max(in_texels(0.5 * square * diameter, texels_per_metre(s, layer), most), vec2f(0.5));
}

fn depth_along_axis(s: Surface, layer: u32) -> f32 {
    return dot(light_views[layer].axis, vec4f(s.position, 1.0));
}

// Mean depth of the casters before the receiver, metres; negative: there are none. The search covers what the light takes
// of the map's near plane, seen from the receiver.
fn search_casters(s: Surface, layer: u32) -> f32 {
    let v = light_views[layer];
    let found = casters_in(s, layer, half_box(s, layer, penumbra(depth_along_axis(s, layer), v.near)));
    return select(-1.0, mix(v.near, v.far, found.y), found.x > least_share);
}

fn lit(s: Surface, layer: u32) -> f32 {
    let depth = depth_along_axis(s, layer);
    let casters = search_casters(s, layer);
    // Casters so close that the search takes them for the receiver's plane have hardly a penumbra.
    let width = penumbra(depth, select(depth, casters, casters >= 0.0));
    let seen = 1.0 - casters_in(s, layer, half_box(s, layer, width)).x;
    return without_bleeding(seen, soft.soft_bleeding);
}

fn inspect_filter(s: Surface) -> f32 {
    let layer = choose(s).layer;
    let r = receive(s, layer, 0.0, 1.0);
    let v = light_views[layer];
    let casters = search_casters(s, layer);
    let shown = select(penumbra(depth_along_axis(s, layer), casters), saturate((casters - v.near) / (v.far - v.near)),
                       frame.map == shows_blocker_depth);
    let found = s.valid && faces_light(s) && casters >= 0.0;
    return select(inspect_look_up(s, r), select(-1.0, shown, found),
                  frame.map == shows_blocker_depth || frame.map == shows_penumbra_width);
}
