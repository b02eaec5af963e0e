//!include map/place/straight.wgsl
//!include map/look_up.wgsl
//!include map/pyramid.wgsl
//!include lib/light_place.wgsl
//!include lib/listed.wgsl
//!include lib/labels.wgsl
// Maps from several places of a light with a size, some of them drawn and looked up after the others; with a technique's own
//     fn window_side() -> u32   side of the window of texels that is looked at in each
//     fn slots() -> u32         sums that a pixel keeps: 2 where it may ask two sets of maps

// Maps that are looked up together. The struct stands in src/map/places.rs too; a test compares the two field by field.
struct Batch {
    // From the light's middle to the places that they are drawn from, and the places' numbers.
    steps: array<vec4f, most_layers>,
    // From the light's middle to the middles of its sides.
    half_u: vec4f,
    half_v: vec4f,
    // Depths along the camera's axis from which on they are looked up beside the maps before, looked up alone, and no longer.
    depths: vec3f,
    count: u32,
    // Maps after which a pixel that these agree on is done; 0: none.
    agreeing: u32,
    // Depth along the last map's axis before which nothing casts, metres.
    nearest: f32,
}

var<uniform> batch: Batch;
// Of each pixel the texels asked so far in the upper half, those of them that see the light in the lower. The topmost bit: all others
// would say the same. The next: some place's map does not reach it.
var<storage, read_write> seen: array<u32>;
// Of the probed pixel the texels of each place that see the light.
var<storage, read_write> seen_places: array<u32>;

const done = 0x80000000u;
const partly = 0x40000000u;
const flags = 0xc0000000u;
const unasked = 0xffffffffu;

@compute @workgroup_size(8, 8)
fn begin(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) {
        return;
    }
    for (var i = 0u; i < slots(); i++) {
        seen[slots() * (id.y * frame.size.x + id.x) + i] = 0u;
    }
    if all(id.xy == probed_pixel()) {
        for (var i = 0u; i < arrayLength(&seen_places); i++) {
            seen_places[i] = unasked;
        }
    }
}

// Where a pixel keeps what it sees in this batch; beyond the end: it does not look at it, or is done.
fn place_of_sum(pixel: vec2u) -> u32 {
    if any(pixel >= frame.size) {
        return unasked;
    }
    let p = textureLoad(g_position, pixel, 0);
    let depth = cascade_depth(p.xyz, p.w);
    if p.w <= 0.0 || depth < batch.depths.x || depth >= batch.depths.z {
        return unasked;
    }
    let at = slots() * (pixel.y * frame.size.x + pixel.x) + select(0u, 1u, depth < batch.depths.y);
    return select(at, unasked, (seen[at] & done) != 0u);
}

// Some maps more, the last place first.
@compute @workgroup_size(8, 8)
fn add(@builtin(global_invocation_id) id: vec3u) {
    let at = place_of_sum(id.xy);
    if at != unasked {
        ask(id.xy, at);
    }
}

// The same for those pixels that bounds did not decide.
@compute @workgroup_size(64)
fn add_listed(@builtin(global_invocation_id) id: vec3u) {
    let i = listed_index(id);
    if i < listed_number() {
        let pixel = listed_pixel(i);
        ask(pixel, place_of_sum(pixel));
    }
}

fn ask(pixel: vec2u, at: u32) {
    let s = load_surface(pixel);
    let light = light_at(s.position);
    if !may_be_shadowed(s, light) {
        return;
    }
    let n = window_side();
    let around = 0.5 * f32(n - 1u);
    let probed = all(pixel == probed_pixel());
    var sum = seen[at];
    for (var k = batch.count; k > 0u; k--) {
        let place = batch.steps[k - 1u];
        var lit = 0u;
        // A place that has set behind the surface's plane is not seen, whatever the map says.
        if dot(s.normal, light.to_light + place.xyz) > 0.0 {
            let r = receive(s, k - 1u, around, 1.0);
            // One whose view does not reach so far aside says nothing.
            if r.clip.w <= 0.0 || outside_map(r, r.texel) {
                sum |= partly;
                continue;
            }
            let first = floor(r.texel - around) + 0.5;
            for (var i = 0u; i < n * n; i++) {
                lit += u32(compare(r, first + vec2f(vec2u(i % n, i / n))) + 0.5);
            }
        }
        sum += (n * n << 16u) + lit;
        if probed {
            seen_places[u32(place.w)] = lit;
        }
        let asked = (sum & ~flags) >> 16u;
        let found = sum & 0xffffu;
        if asked == batch.agreeing * n * n && (found == 0u || found == asked) {
            sum |= done;
            break;
        }
    }
    seen[at] = sum;
}

// Where a caster at a depth along the map's axis throws the whole light on the map, on its way to a surface at a texel: the texels
// of the box around that. False where some of the light shines from beside or behind.
struct Thrown {
    sound: bool,
    low: vec2f,
    high: vec2f,
    corners: array<vec2f, 4>,
}

fn thrown(s: Surface, v: LightView, to_light: vec3f, here: vec2f, depth: f32) -> Thrown {
    let gap = depth_in(v, s.position) - depth;
    var t = Thrown(true, here, here, array<vec2f, 4>());
    for (var i = 0u; i < 4u; i++) {
        let u = select(-1.0, 1.0, (i & 1u) == 1u);
        let w = select(-1.0, 1.0, i > 1u);
        let way = to_light + u * batch.half_u.xyz + w * batch.half_v.xyz;
        let climb = -dot(v.axis.xyz, way);
        let clip = light_clip(v, s.position + way * (gap / max(climb, 1e-6 * length(way))));
        t.sound = t.sound && climb > 1e-3 * length(way) && clip.w > 0.0 && dot(s.normal, way) > 0.0;
        t.corners[i] = light_texel(v, clip);
        t.low = min(t.low, t.corners[i]);
        t.high = max(t.high, t.corners[i]);
    }
    return t;
}

// Whether all texels of a small box are seen as a comparison sees them; outside of its window, where no bias reaches, the receiver's plane
// may rise.
fn all_seen(r: Receiver, low: vec2f, high: vec2f, window: f32) -> bool {
    let wide = u32(high.x - low.x) + 1u;
    let count = wide * (u32(high.y - low.y) + 1u);
    let follows = any(r.gradient != vec2f(0.0));
    var i = 0u;
    while i < count {
        let texel = low + vec2f(vec2u(i % wide, i / wide)) + 0.5;
        let step = abs(texel - r.texel);
        let beside = !follows && max(step.x, step.y) > window + 0.5;
        let rise = select(0.0, max(dot(r.plane, texel - r.texel), 0.0), beside);
        if depth_at(r, texel) + rise < drawn_depth(r.layer, vec2u(texel)) {
            break;
        }
        i++;
    }
    return i == count;
}

const undecided = 2u;

// Bounds of what the whole light sees of a surface, by the nearest and farthest depths of one map. A caster between the two stands
// no nearer to the light than where casters begin, so that it lies in a box of the map, if that holds the box whole; the nearest texel of
// that box bounds it better, and so on. No texel nearer than the surface: it is lit (1). All of them nearer, and none so far behind
// its neighbour that rays to some of the light pass between the two: it is dark (0). (Under a perspective view such a gap is as wide as the
// stored depths differ, wherever they lie.) Of gaps a sixteenth of a texel wide there may be one at each texel, through which a sixteenth
// of the light along each side is seen at most. The neighbours' texels, that the window looks at, must say so too.
fn verdict(s: Surface, to_light: vec3f) -> u32 {
    let layer = batch.count - 1u;
    let v = light_views[layer];
    let window = 0.5 * f32(window_side() - 1u);
    let around = window + 1.0;
    let r = receive(s, layer, window, 1.0);
    var nearest = batch.nearest;
    for (var k = 0u; k < 8u; k++) {
        let box = thrown(s, v, to_light, r.texel, nearest);
        let low = floor(box.low - around);
        let high = floor(box.high + around);
        if !box.sound || any(low < vec2f(0.0)) || any(high >= vec2f(v.resolution)) {
            return undecided;
        }
        let found = extremes(vec2i(low), vec2i(high));
        if found.x <= r.depth || (all(high - low < vec2f(8.0)) && all_seen(r, low, high, window)) {
            return 1u;
        }
        if found.y > r.depth {
            let farther = max(found.x - found.z, 0.0);
            let beyond = thrown(s, v, to_light, r.texel, linear_depth(v, farther));
            let before = thrown(s, v, to_light, r.texel, linear_depth(v, found.x));
            var apart = 0.0;
            for (var i = 0u; i < 4u; i++) {
                let d = abs(before.corners[i] - beyond.corners[i]);
                apart = max(apart, max(d.x, d.y));
            }
            if apart < 0.0625 {
                return 0u;
            }
        }
        let next = linear_depth(v, found.x);
        if next <= nearest * (1.0 + 1e-4) {
            break;
        }
        nearest = next;
    }
    return undecided;
}

@compute @workgroup_size(8, 8)
fn bound(@builtin(global_invocation_id) id: vec3u) {
    let at = place_of_sum(id.xy);
    if at == unasked {
        return;
    }
    let s = load_surface(id.xy);
    let light = light_at(s.position);
    if !may_be_shadowed(s, light) {
        return;
    }
    let found = verdict(s, light.to_light);
    if found == undecided {
        list_ray(id.xy, 0.0);
        return;
    }
    // One comparison tells it all.
    seen[at] = done | (1u << 16u) | found;
}

// The share of the light that the maps which reach a pixel see together, by one of its sums; where none does it is lit.
fn share(pixel: vec2u, slot: u32) -> f32 {
    let both = seen[slots() * (pixel.y * frame.size.x + pixel.x) + slot] & ~flags;
    return select(f32(both & 0xffffu) / f32(both >> 16u), 1.0, both == 0u);
}

// Whether some place's map does not reach a pixel.
fn reached_in_part(pixel: vec2u) -> bool {
    var found = 0u;
    for (var i = 0u; i < slots(); i++) {
        found |= seen[slots() * (pixel.y * frame.size.x + pixel.x) + i] & partly;
    }
    return found != 0u;
}

var<storage, read_write> beyond: atomic<u32>;

// Counts such pixels.
@compute @workgroup_size(8, 8)
fn count_beyond(@builtin(global_invocation_id) id: vec3u) {
    if all(id.xy < frame.size) && reached_in_part(id.xy) {
        atomicAdd(&beyond, 1u);
    }
}

// How many maps a pixel asked.
fn maps_asked(pixel: vec2u) -> f32 {
    let n = window_side();
    var asked = 0.0;
    for (var i = 0u; i < slots(); i++) {
        let sum = seen[slots() * (pixel.y * frame.size.x + pixel.x) + i] & ~flags;
        asked += ceil(f32(sum >> 16u) / f32(n * n));
    }
    return asked;
}

// Whether the probed pixel sees a place, by most of its window; places that it was spared do as those that it asked.
fn place_seen(i: u32) -> bool {
    if seen_places[i] == unasked {
        return share(probed_pixel(), 0u) > 0.5;
    }
    return 2u * seen_places[i] >= window_side() * window_side();
}

// The view of a pixel that sees this share of the light.
fn penumbra_label(v: f32) -> f32 {
    return select(label(select(1u, 7u, v == 0.0), 0.25), label(2u, 0.8), v > 0.0 && v < 1.0);
}
