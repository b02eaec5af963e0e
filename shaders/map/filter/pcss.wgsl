//!include map/filter/disk.wgsl
//!include map/filter/penumbra.wgsl
//!include lib/light_place.wgsl
// Fernando 2005: how far off the casters are says how wide the penumbra is, and that how wide to filter.

var<uniform> soft: PcssParams;

// What a pixel knows before its taps.
struct Search {
    // Compared with at the receiver, and `radius` texels from it: biases grow with the distance.
    here: Receiver,
    there: Receiver,
    radius: f32,
    // Depth along the light's axis, metres.
    depth: f32,
    // Texels a metre.
    density: vec2f,
    turn: f32,
}

// Radii of the disc, or half the sides of the rectangle, under whose middle casters at a depth make a penumbra, texels.
fn disc(search: Search, casters: f32) -> vec2f {
    return in_texels(0.5 * penumbra(search.depth, casters), search.density, most_texels(search.here.layer, soft.max_radius));
}

fn begin(s: Surface, layer: u32) -> Search {
    let v = light_views[layer];
    var search: Search;
    search.here = receive(s, layer, 0.0, 1.0);
    search.there = search.here;
    search.depth = depth_in(v, s.position);
    search.density = texels_per_metre(s, layer);
    search.turn = turn_of(s.pixel);
    return search;
}

// A tap within the shape of the light, in units of its radius or half its sides.
fn tap(i: u32, n: u32, turn: f32) -> vec2f {
    if frame.light_kind == rect_area {
        return in_square(i, f32(n), turn);
    }
    return in_disk(i, f32(n), 1.0, turn);
}

// What to compare with `offset` texels from the receiver.
fn at_tap(search: Search, offset: vec2f) -> Receiver {
    var r = search.here;
    r.depth = mix(r.depth, search.there.depth, length(offset) / max(search.radius, 1e-6));
    return r;
}

// Mean depth of the casters before the receiver, metres; negative: there are none. The search covers what the light takes
// of the map's near plane, seen from the receiver.
fn search_casters(s: Surface, layer: u32, search: ptr<function, Search>) -> f32 {
    let v = light_views[layer];
    let radii = disc(*search, v.near);
    (*search).radius = max(radii.x, radii.y);
    (*search).there = receive(s, layer, (*search).radius, 1.0);
    var sum = 0.0;
    var found = 0u;
    for (var i = 0u; i < soft.search_taps; i++) {
        let offset = tap(i, soft.search_taps, (*search).turn) * radii;
        let r = at_tap(*search, offset);
        let texel = r.texel + offset;
        if compare(r, texel) == 0.0 {
            sum += caster_depth(r, texel);
            found++;
        }
    }
    return select(-1.0, sum / f32(found), found > 0u);
}

fn lit(s: Surface, layer: u32) -> f32 {
    var search = begin(s, layer);
    if !has_size() {
        return compare(search.here, search.here.texel);
    }
    let casters = search_casters(s, layer, &search);
    if casters < 0.0 {
        return 1.0;
    }
    let radii = disc(search, casters);
    var seen = 0.0;
    for (var i = 0u; i < soft.filter_taps; i++) {
        let offset = tap(i, soft.filter_taps, search.turn) * radii;
        let r = at_tap(search, offset);
        seen += compare(r, r.texel + offset);
    }
    return seen / f32(soft.filter_taps);
}

fn inspect_filter(s: Surface) -> f32 {
    let layer = choose(s).layer;
    if frame.map != shows_blocker_depth && frame.map != shows_penumbra_width {
        return inspect_look_up(s, receive(s, layer, 0.0, 1.0));
    }
    if !s.valid || !faces_light(s) {
        return -1.0;
    }
    let v = light_views[layer];
    var search = begin(s, layer);
    let casters = search_casters(s, layer, &search);
    if casters < 0.0 {
        return -1.0;
    }
    if frame.map == shows_blocker_depth {
        return saturate((casters - v.near) / (v.far - v.near));
    }
    return widest_penumbra(search.depth, casters);
}
