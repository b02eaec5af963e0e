//!include lib/frame.wgsl
//!include map/pyramid.wgsl
// Guennebaud, Barthe, Paulin 2006: every texel of the map that lies before the receiver is a rectangle of its own, whose shadow on the
// light is known: what they cover together is hidden. Schwarz, Stamminger 2007: samples of the light as bits, so that nothing is
// covered twice.

var<uniform> backprojection: BackprojectionParams;

// Closed: nothing is left to look at, `hidden` is all there is to say.
struct Window {
    // Compared with at the receiver, and `radius` texels from it.
    here: Receiver,
    there: Receiver,
    radius: f32,
    // Depth of the receiver along the light's axis, metres.
    depth: f32,
    // Half the light's sides that a texel takes on a plane at a depth of 1 m, seen from the light's centre.
    texel: vec2f,
    // The first and last texel that can hide some of the light, and how many stand for one along each side.
    low: vec2i,
    high: vec2i,
    step: i32,
    closed: bool,
    hidden: f32,
}

// What of the light is hidden: the summed areas of all rectangles over the light's, and the samples that lie in one.
struct Covered {
    area: f32,
    bits: array<u32, 8>,
}

// By how much a step on the map from the receiver grows on the light's plane where a caster at a depth throws it, for `Window::texel`:
// X + (q - X) z / (z - z_s), with q the caster's place seen from the light's centre.
fn thrown(w: Window, casters: f32) -> f32 {
    return w.depth * casters / max(w.depth - casters, 1e-6 * w.depth);
}

// Lets the window be as wide as the light is from the receiver, seen through a plane at a depth: no texel farther off can hide any of
// it if none is nearer to the light. In whole texels, within the map.
fn narrow_window(w: ptr<function, Window>, nearest: f32) {
    let half = min(1.0 / ((*w).texel * thrown(*w, nearest)), vec2f(32768.0));
    let place = (*w).here.texel;
    (*w).low = vec2i(max(floor(place - half), vec2f(0.0)));
    (*w).high = vec2i(min(floor(place + half), vec2f((*w).here.side - 1.0)));
    (*w).radius = max(half.x, half.y);
}

fn window(s: Surface, layer: u32) -> Window {
    let v = light_views[layer];
    var w: Window;
    w.here = receive(s, layer, 0.0, 1.0);
    w.there = w.here;
    w.depth = w.here.clip.w;
    w.texel = 2.0 / (v.resolution * scale_of(v) * half_light());
    w.closed = outside_map(w.here, w.here.texel);
    if w.closed {
        return w;
    }
    // No caster is nearer than the nearest of the map.
    var nearest = linear_depth(v, nearest_of_all());
    var found = vec2f(0.0);
    // Round after round the nearest caster in the window makes it narrower; the last one asks what is left in it.
    for (var i = 0u; i <= backprojection.shrink; i++) {
        narrow_window(&w, min(nearest, w.depth));
        found = extremes(w.low, w.high).xy;
        nearest = linear_depth(v, found.x);
    }
    if found.x <= w.here.depth {
        w.closed = true;
        return w;
    }
    w.there = receive(s, layer, w.radius, 1.0);
    let span = w.high - w.low + 1;
    if backprojection.early_umbra != 0u {
        // As near to the light as any comparison in the window can be.
        let steepest = dot(abs(w.here.gradient), vec2f(span));
        let before = mix(w.here.depth, w.there.depth, 1.4143) + steepest;
        let half = vec2f(w.radius);
        let whole = all(w.here.texel - half >= vec2f(0.0)) && all(w.here.texel + half < vec2f(w.here.side));
        w.closed = whole && found.y > before;
        w.hidden = select(0.0, 1.0, w.closed);
    }
    let most = i32(backprojection.window_max);
    w.step = max(i32(backprojection.stride), (max(span.x, span.y) + most - 1) / most);
    // Where the camera turns the same texels stand for others.
    w.low -= w.low % w.step;
    return w;
}

// What a texel throws on the light, as `thrown` has it; 0 where it hides nothing from the receiver. Of several texels the middle one
// stands for all.
fn caster_at(w: Window, cell: vec2i) -> f32 {
    let middle = cell + w.step / 2;
    if any(middle < vec2i(0)) || any(middle >= vec2i(i32(w.here.side))) {
        return 0.0;
    }
    let at = vec2f(middle) + 0.5;
    var r = w.here;
    r.depth = mix(r.depth, w.there.depth, distance(at, r.texel) / max(w.radius, 1e-6));
    // Behind an inner corner the receiver's plane runs on below other surfaces: nothing farther than the receiver hides anything from it.
    let before = max(depth_at(r, at), r.depth);
    let stored = drawn_depth(r.layer, vec2u(middle));
    return select(0.0, thrown(w, linear_depth(light_views[r.layer], stored)), stored > before);
}

// The rectangle that a texel hides of the light: its lower and its upper corner, in the light's half sides from its middle. `beside`
// and `above` are what the texels before it along both sides throw: where there is a gap up to theirs it is closed.
fn rectangle(w: Window, cell: vec2i, caster: f32, beside: f32, above: f32) -> vec4f {
    let low = vec2f(cell) - w.here.texel;
    let here = w.texel * caster;
    let there = low * w.texel * vec2f(beside, above);
    let closed = select(low * here, min(low * here, there), vec2f(beside, above) > vec2f(0.0));
    return clamp(vec4f(closed, (low + f32(w.step)) * here), vec4f(-1.0), vec4f(1.0));
}

// Numbers of the first sample of a side that lies at a place or above it. There are n, in the middles of cells.
fn first_samples(place: vec4f, n: f32) -> vec4u {
    return vec4u(clamp(ceil(0.5 * n * (place + 1.0) - 0.5), vec4f(0.0), vec4f(n)));
}

// The lower bits of a word.
fn lower(count: u32) -> u32 {
    return select((1u << (count & 31u)) - 1u, 0xffffffffu, count >= 32u);
}

// Marks the samples of a rectangle. n to a side, row by row.
fn cover(c: ptr<function, Covered>, corners: vec4f, n: u32) {
    let size = corners.zw - corners.xy;
    (*c).area += 0.25 * max(size.x, 0.0) * max(size.y, 0.0);
    let first = first_samples(corners, f32(n));
    let rows = 32u / n;
    let columns = (lower(first.z) & ~lower(first.x)) * select(0x00010001u, 0x01010101u, n == 8u);
    for (var word = first.y / rows; word * rows < first.w; word++) {
        let base = word * rows;
        let from_row = max(first.y, base) - base;
        let to_row = min(first.w - base, rows);
        (*c).bits[word] |= columns & lower(to_row * n) & ~lower(from_row * n);
    }
}

fn marked(c: Covered) -> u32 {
    var sum = 0u;
    for (var i = 0u; i < 8u; i++) {
        sum += countOneBits(c.bits[i]);
    }
    return sum;
}

// Where a sample of the light lies, -1 to 1 along its sides.
fn sample_place(i: u32, n: u32) -> vec2f {
    return (2.0 * vec2f(vec2u(i % n, i / n)) + 1.0) / f32(n) - 1.0;
}

// What has set behind the receiver's own plane.
fn set_of(s: Surface, n: u32) -> Covered {
    var c: Covered;
    let height = dot(s.normal, light_at(s.position).to_light);
    let slope = vec2f(dot(s.normal, frame.light_half_u), dot(s.normal, frame.light_half_v));
    if height > abs(slope.x) + abs(slope.y) {
        return c;
    }
    for (var i = 0u; i < n * n; i++) {
        if height + dot(slope, sample_place(i, n)) <= 0.0 {
            c.bits[i / 32u] |= 1u << (i % 32u);
        }
    }
    c.area = f32(marked(c)) / f32(n * n);
    return c;
}

// What all texels of a window hide of the light, on top of what has set. `all_of_it`: also where nothing more can be hidden.
fn covered(w: Window, s: Surface, n: u32, all_of_it: bool) -> Covered {
    var c = set_of(s, n);
    if w.closed {
        return c;
    }
    for (var y = w.low.y; y <= w.high.y; y += w.step) {
        var beside = 0.0;
        if backprojection.gap_fill != 0u {
            beside = caster_at(w, vec2i(w.low.x - w.step, y));
        }
        for (var x = w.low.x; x <= w.high.x; x += w.step) {
            let caster = caster_at(w, vec2i(x, y));
            if caster > 0.0 {
                var above = 0.0;
                if backprojection.gap_fill != 0u {
                    above = caster_at(w, vec2i(x, y - w.step));
                }
                cover(&c, rectangle(w, vec2i(x, y), caster, beside, above), n);
            }
            beside = select(0.0, caster, backprojection.gap_fill != 0u);
        }
        if !all_of_it && full(c, n) {
            break;
        }
    }
    return c;
}

// Samples to a side of the light.
fn samples() -> u32 {
    return select(16u, 8u, backprojection.mode == mode_bitmask64);
}

fn full(c: Covered, n: u32) -> bool {
    if backprojection.mode == mode_area {
        return c.area >= 1.0;
    }
    return marked(c) == n * n;
}

fn lit(s: Surface, layer: u32) -> f32 {
    let w = window(s, layer);
    let n = samples();
    let c = covered(w, s, n, false);
    let hidden = select(f32(marked(c)) / f32(n * n), min(c.area, 1.0), backprojection.mode == mode_area);
    return 1.0 - max(hidden, w.hidden);
}

fn inspect_filter(s: Surface) -> f32 {
    if frame.map != shows_window_size && frame.map != shows_overlap {
        return inspect_look_up(s, receive(s, 0u, 0.0, 1.0));
    }
    if !may_be_shadowed(s, light_at(s.position)) {
        return -1.0;
    }
    let w = window(s, 0u);
    if w.closed {
        return -1.0;
    }
    if frame.map == shows_window_size {
        let span = w.high - w.low + 1;
        return f32(max(span.x, span.y));
    }
    let c = covered(w, s, 16u, true);
    return max(c.area - f32(marked(c)) / 256.0, 0.0);
}
