//!include map/sums.wgsl
//!include map/filter/chebyshev.wgsl
//!include map/filter/hamburger.wgsl
//!include map/filter/penumbra.wgsl
//!include map/filter/quantised.wgsl
// Shadows from box means of moments: summed-area variance shadow maps, whose box is given (Lauritzen 2007); variance (Yang et al. 2010)
// and moment soft shadow mapping (Peters et al. 2016), which as PCSS search for casters and filter as wide as the penumbra, but each is
// one mean.

var<uniform> soft: PrefilteredSoftParams;

// The side of a square as large as a disc of diameter 1, or of the rectangle itself.
fn square() -> f32 {
    return select(0.8862269, 1.0, frame.light_kind == rect_area);
}

// Smaller shares of casters are rounding (Yang et al., section 5).
const least_share = 0.01;

fn widest_box() -> f32 {
    return f32(soft.max_box);
}

fn moments(z: f32) -> vec4f {
    let b = vec4f(z, z * z, z * z * z, z * z * z * z);
    return select(b, saturate(packed(b)), soft.soft_kind == soft_kind_mssm);
}

// The mean of a box's depths, from its moments.
fn mean_depth(m: vec4f) -> f32 {
    return select(m.x, unpacked(m).x, soft.soft_kind == soft_kind_mssm);
}

// The share of a box's depths that lie before a depth, and their mean, from the box's moments.
fn casters_before(m: vec4f, t: f32) -> vec2f {
    // What is lit lies at the receiver's depth.
    let seen = chebyshev(m.xy, t, 1.0 / one());
    let two = vec2f(1.0 - seen, max((m.x - seen * t) / max(1.0 - seen, 1e-6), 0.0));
    let four = depths_before(mix(unpacked(m), vec4f(0.5), 1e-6 * soft.mssm_bias), t);
    return select(two, four, soft.soft_kind == soft_kind_mssm);
}

// What a box around the receiver is compared with. One comparison serves the whole box: before the receiver's plane as far out as
// `box_bias` says.
fn received(s: Surface, layer: u32, half: vec2f) -> Receiver {
    let followed = soft.box_bias * half;
    var r = receive(s, layer, max(followed.x, followed.y), 1.0);
    let out = followed + 0.5;
    let left = max(depth_at(r, r.texel - out), depth_at(r, r.texel + vec2f(-out.x, out.y)));
    let right = max(depth_at(r, r.texel + out), depth_at(r, r.texel + vec2f(out.x, -out.y)));
    r.depth = max(left, right);
    r.moved = moved_to(s, layer, r.depth);
    return r;
}

// What a box around the receiver holds before it: a share, and its mean depth. Where the box's own mean lies behind the receiver it is
// cut into smaller ones (Yang et al., section 4), each compared with the receiver's plane at its own place.
fn casters_in(s: Surface, layer: u32, half: vec2f) -> vec2f {
    let v = light_views[layer];
    let k = soft.subdivision;
    let part_half = half / f32(k);
    let whole = received(s, layer, half);
    var part = received(s, layer, part_half);
    part.gradient = select(part.plane, vec2f(0.0), biases.bias_kind == bias_kind_none);
    // Round 0 takes the whole box, the others a part each.
    var rounds = 1u;
    // Sums over the parts: the share, and its depths.
    var found = vec2f(0.0);
    for (var i = 0u; i < rounds; i++) {
        let first = i == 0u;
        let cell = vec2f(vec2u((i - 1u) % k, (i - 1u) / k));
        let at = whole.texel + select(part_half * (2.0 * cell + 1.0) - half, vec2f(0.0), first);
        let t = depth_share(v, select(depth_at(part, at), whole.depth, first));
        let m = mean_of_box(at, select(part_half, half, first), texture_layer(layer), whole.side);
        let c = casters_before(m, t);
        let cut = first & (k > 1u) & (mean_depth(m) >= t);
        found += select(vec2f(c.x, c.x * c.y), vec2f(0.0), cut);
        rounds = select(rounds, 1u + k * k, cut);
    }
    let share = found.x / max(f32(rounds) - 1.0, 1.0);
    return select(vec2f(share, found.y / max(found.x, 1e-6)), vec2f(0.0), outside_map(whole, whole.texel));
}

// Half the sides of the box that stands for a disc, texels. `widths`: along the map's sides, metres.
fn half_box(s: Surface, layer: u32, widths: vec2f) -> vec2f {
    let most = most_texels(layer, 0.5 * widest_box());
    return max(in_texels(0.5 * square() * widths, texels_per_metre(s, layer), most), vec2f(0.5));
}

fn depth_along_axis(s: Surface, layer: u32) -> f32 {
    return depth_in(light_views[layer], s.position);
}

// Mean depth of the casters before the receiver, metres; negative: there are none. The search covers what the light takes
// of the map's near plane, seen from the receiver.
fn search_casters(s: Surface, layer: u32) -> f32 {
    let v = light_views[layer];
    let found = casters_in(s, layer, half_box(s, layer, penumbra(depth_along_axis(s, layer), v.near)));
    return select(-1.0, mix(v.near, v.far, found.y), found.x > least_share);
}

// Half the sides of the box that is averaged. Casters so close that the search takes them for the receiver's plane have hardly a
// penumbra.
fn half_filter(s: Surface, layer: u32) -> vec2f {
    if soft.soft_kind == soft_kind_savsm {
        // As wide as asked for, and at least as what the pixel covers.
        let v = light_views[layer];
        let clip = light_clip(v, s.position);
        let steps = pixel_steps(s);
        let covered = max(abs(map_along(v, steps[0], clip).xy), abs(map_along(v, steps[1], clip).xy));
        return clamp(0.5 * max(vec2f(soft.box_width), covered), vec2f(0.5), vec2f(0.5 * widest_box()));
    }
    let depth = depth_along_axis(s, layer);
    let casters = search_casters(s, layer);
    return half_box(s, layer, penumbra(depth, select(depth, casters, casters >= 0.0)));
}

fn lit(s: Surface, layer: u32) -> f32 {
    return without_bleeding(1.0 - casters_in(s, layer, half_filter(s, layer)).x, soft.soft_bleeding);
}

fn inspect_filter(s: Surface) -> f32 {
    let layer = choose(s).layer;
    let v = light_views[layer];
    if frame.map != shows_blocker_depth && frame.map != shows_penumbra_width {
        return inspect_look_up(s, received(s, layer, half_filter(s, layer)));
    }
    let casters = search_casters(s, layer);
    let shown = select(widest_penumbra(depth_along_axis(s, layer), casters), saturate((casters - v.near) / (v.far - v.near)),
                       frame.map == shows_blocker_depth);
    return select(-1.0, shown, s.valid && faces_light(s) && casters >= 0.0 && soft.soft_kind != soft_kind_savsm);
}
