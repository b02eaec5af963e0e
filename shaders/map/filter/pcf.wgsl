//!include map/filter/disk.wgsl
// Reeves, Salesin, Cook 1987: compare first, average after.

var<uniform> filtering: PcfParams;
var compare_sampler: sampler_comparison;

struct Tap {
    // From the receiver's place in the map, texels.
    offset: vec2f,
    weight: f32,
}

// Taps in a disk.
fn round_mode() -> bool {
    return filtering.mode == mode_disk || filtering.mode == mode_dpcf;
}

// A tent of texels, blended with the receiver's place between them.
fn folded() -> bool {
    return filtering.mode == mode_tent3 || filtering.mode == mode_tent5 || filtering.mode == mode_tent7;
}

fn hardware() -> bool {
    return filtering.mode == mode_hw2x2 || filtering.mode == mode_tent || folded();
}

// Texels of the kernel's side.
fn kernel() -> u32 {
    return select(filtering.kernel, 3u + 2u * (filtering.mode - mode_tent3), folded());
}

fn taps() -> u32 {
    let k = kernel();
    if round_mode() {
        return filtering.samples;
    }
    let side = select(k, (k + 1u) / 2u, filtering.mode == mode_tent || folded());
    return side * side;
}

// How far the outermost tap reaches, texels.
fn radius() -> f32 {
    return select(0.5 * f32(kernel() - 1u), filtering.radius, round_mode());
}

// By how much the pattern is stretched, so that it is as wide in the world in every layer as `blur` says.
fn stretch(s: Surface, layer: u32) -> vec2f {
    if filtering.blur == 0.0 || filtering.mode == mode_tent || folded() {
        return vec2f(1.0);
    }
    let width = select(f32(filtering.kernel), 2.0 * filtering.radius, round_mode());
    return filtering.blur / width * texels_per_metre(s, layer);
}

fn receiver(s: Surface, layer: u32, stretched: vec2f) -> Receiver {
    return receive(s, layer, radius() * max(stretched.x, stretched.y), select(1.0, 2.0, hardware()));
}

// Integral of a tent of half width h and area 1, from -∞ to x.
fn tent(x: f32, h: f32) -> f32 {
    let t = clamp(x, -h, h);
    let tail = (h - abs(t)) * (h - abs(t)) / (2.0 * h * h);
    return select(1.0 - tail, tail, t < 0.0);
}

// One axis of a tent of `kernel` texels, two texels in one bilinear tap: offset and weight.
fn tent_pair(i: u32, place: f32) -> vec2f {
    let h = 0.5 * f32(filtering.kernel);
    let a = floor(place - h) + 2.0 * f32(i) - place;
    let middle = tent(a + 1.0, h);
    let first = middle - tent(a, h);
    let second = tent(a + 2.0, h) - middle;
    let weight = first + second;
    return vec2f(a + 0.5 + second / max(weight, 1e-9), weight);
}

// One axis of the kernel [1 2 1] / 4, [1 3 4 3 1] / 12 or [1 5 12 16 12 5 1] / 52 of texels, blended with its copy a texel on
// by the place between the two; two texels in one bilinear tap: offset and weight (Castaño 2013).
fn folded_pair(i: u32, place: f32) -> vec2f {
    let s = fract(place + 0.5);
    // Offsets from the texel before the place.
    var o: vec4f;
    var w: vec4f;
    if filtering.mode == mode_tent3 {
        w = vec4f(3.0 - 2.0 * s, 1.0 + 2.0 * s, 0.0, 0.0) / 4.0;
        o = vec4f((2.0 - s) / (3.0 - 2.0 * s) - 1.0, s / (1.0 + 2.0 * s) + 1.0, 0.0, 0.0);
    } else if filtering.mode == mode_tent5 {
        w = vec4f(4.0 - 3.0 * s, 7.0, 1.0 + 3.0 * s, 0.0) / 12.0;
        o = vec4f((3.0 - 2.0 * s) / (4.0 - 3.0 * s) - 2.0, (3.0 + s) / 7.0, s / (1.0 + 3.0 * s) + 2.0, 0.0);
    } else {
        w = vec4f(6.0 - 5.0 * s, 28.0 - 11.0 * s, 17.0 + 11.0 * s, 1.0 + 5.0 * s) / 52.0;
        o = vec4f((5.0 - 4.0 * s) / (6.0 - 5.0 * s) - 3.0, (16.0 - 4.0 * s) / (28.0 - 11.0 * s) - 1.0,
                  (5.0 + 7.0 * s) / (17.0 + 11.0 * s) + 1.0, s / (1.0 + 5.0 * s) + 3.0);
    }
    return vec2f(o[i] - s, w[i]);
}

fn tap(i: u32, place: vec2f, turn: f32) -> Tap {
    let k = kernel();
    let n = f32(taps());
    if round_mode() {
        return Tap(in_disk(i, n, filtering.radius, turn), 1.0 / n);
    }
    if folded() {
        let side = (k + 1u) / 2u;
        let x = folded_pair(i % side, place.x);
        let y = folded_pair(i / side, place.y);
        return Tap(vec2f(x.x, y.x), x.y * y.y);
    }
    if filtering.mode == mode_tent {
        let side = (k + 1u) / 2u;
        let x = tent_pair(i % side, place.x);
        let y = tent_pair(i / side, place.y);
        return Tap(vec2f(x.x, y.x), x.y * y.y);
    }
    let cell = vec2f(vec2u(i % k, i / k)) - 0.5 * f32(k - 1u);
    return Tap(cell, 1.0 / n);
}

fn lit(s: Surface, layer: u32) -> f32 {
    let stretched = stretch(s, layer);
    let r = receiver(s, layer, stretched);
    let turn = turn_of(s.pixel);
    var lit = 0.0;
    // Depths of what is in the way.
    var before = 0.0;
    let n = taps();
    for (var i = 0u; i < n; i++) {
        let t = tap(i, r.texel, turn);
        let texel = r.texel + t.offset * stretched;
        if hardware() {
            var v: f32;
            if outside_map(r, texel) {
                v = beside(r, texel).lit;
            } else {
                v = textureSampleCompareLevel(shadow_maps, compare_sampler, texel / f32(textureDimensions(shadow_maps).x), texture_layer(layer), depth_at_four(r, texel));
            }
            lit += t.weight * v;
        } else {
            let v = compare(r, texel);
            lit += t.weight * v;
            if filtering.mode == mode_dpcf && v == 0.0 {
                before += t.weight * caster_depth(r, texel);
            }
        }
    }
    // Weights of many taps add up to 1 only nearly; fully lit is exactly 1.
    lit = saturate(select(lit, round(lit), abs(lit - round(lit)) < 1e-5));
    if filtering.mode == mode_dpcf && lit < 1.0 {
        return 1.0 - mix(hardened(1.0 - lit), 1.0 - lit, softness(s, layer, before / (1.0 - lit)));
    }
    return lit;
}

// A share, steeper around one half.
fn hardened(share: f32) -> f32 {
    let y = 2.0 * share - 1.0;
    let rest = 1.0 - abs(y);
    return 0.5 + 0.5 * sign(y) * (1.0 - rest * rest * rest);
}

// The penumbra's width, as a share of the widest, under casters at this mean depth: how much farther from the lamp, or from
// where the sun enters the scene's box, the receiver is than they are.
fn softness(s: Surface, layer: u32, casters: f32) -> f32 {
    let v = light_views[layer];
    // The corner of the box that the light meets first; a view's own near plane may be another in each cascade.
    let corner = select(frame.bounds_max, frame.bounds_min, v.axis.xyz > vec3f(0.0));
    let first = select(0.0, dot(v.axis, vec4f(corner, 1.0)), frame.light_kind == directional);
    let depth = depth_in(v, s.position);
    return saturate(filtering.ratio_scale * (depth - casters) / max(casters - first, 1e-6 * max(depth - first, 1e-6)));
}

// The pattern of taps, enlarged: each a dot as bright as its weight, over a receiver in the middle of a texel. It is as wide, and
// turned, as at the probed pixel.
fn tap_pattern(pixel: vec2u) -> f32 {
    let probed = probed_pixel();
    let s = load_surface(probed);
    let stretched = select(vec2f(1.0), stretch(s, choose(s).layer), s.valid);
    let turn = turn_of(probed);
    let size = vec2f(frame.size);
    let zoom = (2.0 * radius() * max(stretched.x, stretched.y) + 3.0) / min(size.x, size.y);
    let here = (vec2f(pixel) + 0.5 - 0.5 * size) * zoom;
    let grid = abs(fract(here) - 0.5) > vec2f(0.5 - zoom);
    var v = select(0.0, 0.15, any(grid));
    var most = 0.0;
    for (var i = 0u; i < taps(); i++) {
        most = max(most, tap(i, vec2f(0.5), turn).weight);
    }
    for (var i = 0u; i < taps(); i++) {
        let t = tap(i, vec2f(0.5), turn);
        if distance(t.offset * stretched, here) < max(0.2, 2.0 * zoom) {
            v = max(v, 0.2 + 0.8 * t.weight / most);
        }
    }
    return v;
}

fn inspect_filter(s: Surface) -> f32 {
    if frame.map == shows_taps {
        return tap_pattern(s.pixel);
    }
    if frame.map == shows_transition {
        if !s.valid || !faces_light(s) {
            return -1.0;
        }
        let v = visibility(s);
        return 2.0 * min(v, 1.0 - v);
    }
    let layer = choose(s).layer;
    return inspect_look_up(s, receiver(s, layer, stretch(s, layer)));
}
