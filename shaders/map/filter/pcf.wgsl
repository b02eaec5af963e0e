// Reeves, Salesin, Cook 1987: compare first, average after.

var<uniform> filtering: PcfParams;
var compare_sampler: sampler_comparison;

struct Tap {
    // From the receiver's place in the map, texels.
    offset: vec2f,
    weight: f32,
}

fn hardware() -> bool {
    return filtering.mode == mode_hw2x2 || filtering.mode == mode_tent;
}

fn taps() -> u32 {
    let k = filtering.kernel;
    if filtering.mode == mode_disk {
        return filtering.samples;
    }
    let side = select(k, (k + 1u) / 2u, filtering.mode == mode_tent);
    return side * side;
}

// How far the outermost tap reaches, texels.
fn radius() -> f32 {
    return select(0.5 * f32(filtering.kernel - 1u), filtering.radius, filtering.mode == mode_disk);
}

// By how much the pattern is stretched, so that it is as wide in the world in every layer as `blur` says.
fn stretch(s: Surface, layer: u32) -> vec2f {
    if filtering.blur == 0.0 || filtering.mode == mode_tent {
        return vec2f(1.0);
    }
    let width = select(f32(filtering.kernel), 2.0 * filtering.radius, filtering.mode == mode_disk);
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

fn tap(i: u32, place: vec2f, turn: f32) -> Tap {
    let k = filtering.kernel;
    let n = f32(taps());
    if filtering.mode == mode_disk {
        // Vogel's spiral: the golden angle between neighbours, equal areas.
        let r = filtering.radius * sqrt((f32(i) + 0.5) / n);
        let angle = f32(i) * 2.3999632 + turn;
        return Tap(r * vec2f(cos(angle), sin(angle)), 1.0 / n);
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

fn turn_of(pixel: vec2u) -> f32 {
    if filtering.rotate == 0u {
        return 0.0;
    }
    return f32(hash(pixel.x + hash(pixel.y + hash(frame.seed)))) * (6.2831853 / 4294967296.0);
}

fn lit(s: Surface, layer: u32) -> f32 {
    let stretched = stretch(s, layer);
    let r = receiver(s, layer, stretched);
    let turn = turn_of(s.pixel);
    var lit = 0.0;
    let n = taps();
    for (var i = 0u; i < n; i++) {
        let t = tap(i, r.texel, turn);
        let texel = r.texel + t.offset * stretched;
        if hardware() {
            var v = 1.0;
            if !outside_map(r, texel) {
                v = textureSampleCompareLevel(shadow_maps, compare_sampler, texel / f32(textureDimensions(shadow_maps).x), layer, depth_at_four(r, texel));
            }
            lit += t.weight * v;
        } else {
            lit += t.weight * compare(r, texel);
        }
    }
    // Weights of many taps add up to 1 only nearly; fully lit is exactly 1.
    return saturate(select(lit, round(lit), abs(lit - round(lit)) < 1e-5));
}

// The pattern of taps, enlarged: each a dot as bright as its weight, over one receiver in the middle of a texel.
fn tap_pattern(pixel: vec2u) -> f32 {
    let size = vec2f(frame.size);
    let zoom = (2.0 * radius() + 3.0) / min(size.x, size.y);
    let here = (vec2f(pixel) + 0.5 - 0.5 * size) * zoom;
    let grid = abs(fract(here) - 0.5) > vec2f(0.5 - zoom);
    var v = select(0.0, 0.15, any(grid));
    var most = 0.0;
    for (var i = 0u; i < taps(); i++) {
        most = max(most, tap(i, vec2f(0.5), turn_of(vec2u(0u))).weight);
    }
    for (var i = 0u; i < taps(); i++) {
        let t = tap(i, vec2f(0.5), turn_of(vec2u(0u)));
        if distance(t.offset, here) < 0.2 {
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
