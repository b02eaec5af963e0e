//!include lib/labels.wgsl
// Revectorised comparisons (Bondarev 2014; Macedo, Apolinário 2016): steps of the map's texels become slanting lines. Along a step
// the run of texels is walked to its ends; from one of them, where it meets what it is not, a line is drawn half a texel off
// the step to the run's middle.

var<uniform> revectorising: RbsmParams;

// Compared at the depth that the receiver's plane has at each texel: on a slope constant depth would end walks too early.
fn walker(s: Surface, layer: u32) -> Receiver {
    var r = receive(s, layer, 0.0, 1.0);
    r.gradient = r.plane;
    return r;
}

fn unlike(r: Receiver, texel: vec2f, c: f32) -> bool {
    return !outside_map(r, texel) && compare_beside(r, texel) != c;
}

// How far the run of a texel goes, texels: `last` texels of the run behind this one, and whether it ends where it meets what it is not.
struct Walk {
    last: f32,
    end: bool,
}

// Walks from a texel in a direction, as long as the step goes on that lies beside it on the sides `across`.
fn walk(r: Receiver, texel: vec2f, by: vec2f, across: vec2f, beside: vec2<bool>, c: f32) -> Walk {
    var at = texel;
    for (var i = 0u; i < revectorising.walk; i++) {
        at += by;
        if outside_map(r, at) {
            return Walk(f32(i), false);
        }
        if compare_beside(r, at) != c {
            return Walk(f32(i), true);
        }
        let low = beside.x && unlike(r, at - across, c);
        let high = beside.y && unlike(r, at + across, c);
        if !low && !high {
            return Walk(f32(i), false);
        }
    }
    return Walk(f32(revectorising.walk), false);
}

struct Revectorised {
    // What the texel's own comparison gives.
    own: f32,
    // Left, right, up, down: bits 0 to 3, where neighbours differ.
    sides: u32,
    // Place between the ends of the run along x and y, 0 where there is none, and how long these runs are, texels.
    place: vec2f,
    run: vec2f,
    // Ends along x (bits 0 and 1) and y (2 and 3).
    ends: u32,
    lit: f32,
}

fn place_in(low: Walk, high: Walk, here: f32, c: f32) -> vec2f {
    let before = low.last + here;
    let behind = high.last + 1.0 - here;
    let run = min(before + behind, f32(revectorising.walk));
    if low.end && high.end {
        return vec2f(2.0 * min(before, behind) / run, run);
    }
    return vec2f(select(select(0.0, behind / run, high.end), before / run, low.end), run);
}

fn revectorised(r: Receiver, texel: vec2f) -> Revectorised {
    var v: Revectorised;
    if outside_map(r, texel) {
        v.own = beside(r, texel).lit;
        v.lit = v.own;
        return v;
    }
    let c = compare_beside(r, texel);
    let x = vec2f(1.0, 0.0);
    let y = vec2f(0.0, 1.0);
    let left = unlike(r, texel - x, c);
    let right = unlike(r, texel + x, c);
    let up = unlike(r, texel - y, c);
    let down = unlike(r, texel + y, c);
    v.own = c;
    v.lit = c;
    v.sides = u32(left) | u32(right) << 1u | u32(up) << 2u | u32(down) << 3u;
    if v.sides == 0u || (c == 0.0 && revectorising.change == change_conservative) {
        return v;
    }
    if v.sides == 15u {
        v.lit = 1.0 - c;
        return v;
    }
    let rows = vec2<bool>(up, down);
    let columns = vec2<bool>(left, right);
    let here = fract(texel);
    let w = array<Walk, 4>(walk(r, texel, -x, y, rows, c), walk(r, texel, x, y, rows, c),
                           walk(r, texel, -y, x, columns, c), walk(r, texel, y, x, columns, c));
    v.ends = u32(w[0].end) | u32(w[1].end) << 1u | u32(w[2].end) << 2u | u32(w[3].end) << 3u;
    let along_x = place_in(w[0], w[1], here.x, c);
    let along_y = place_in(w[2], w[3], here.y, c);
    v.place = vec2f(along_x.x, along_y.x);
    v.run = vec2f(along_x.y, along_y.y);
    if all(v.place > vec2f(0.0)) {
        // The line is where both places add up to one half; on the near side of it lies what the texel is not.
        let off = v.place.x + v.place.y - 0.5;
        let away = off / length(1.0 / v.run);
        let like = select(select(0.0, 1.0, off >= 0.0), saturate(0.5 + away / max(revectorising.ramp, 1e-6)), revectorising.ramp > 0.0);
        v.lit = mix(1.0 - c, c, like);
    }
    return v;
}

// The middles of the kernel's taps lie a texel apart.
fn lit(s: Surface, layer: u32) -> f32 {
    let r = walker(s, layer);
    let side = revectorising.taps;
    var sum = 0.0;
    for (var i = 0u; i < side * side; i++) {
        let offset = vec2f(vec2u(i % side, i / side)) - 0.5 * f32(side - 1u);
        sum += revectorised(r, r.texel + offset).lit;
    }
    return sum / f32(side * side);
}

fn inspect_filter(s: Surface) -> f32 {
    let layer = choose(s).layer;
    let r = walker(s, layer);
    if frame.map != shows_discontinuities && frame.map != shows_run_ends && frame.map != shows_changed && frame.map != shows_run_x && frame.map != shows_run_y {
        return inspect_look_up(s, r);
    }
    if !s.valid || !faces_light(s) || outside_map(r, r.texel) {
        return -1.0;
    }
    let v = revectorised(r, r.texel);
    if frame.map == shows_changed {
        return select(label(select(0u, 4u, v.own == 0.0), abs(v.lit - v.own)), -1.0, v.lit == v.own);
    }
    if v.sides == 0u {
        return -1.0;
    }
    if frame.map == shows_discontinuities {
        // One side, two that meet, two that face each other, three, all.
        let opposite = v.sides == 3u || v.sides == 12u;
        let kinds = array<u32, 5>(0u, 3u, 2u, 6u, 5u);
        let count = countOneBits(v.sides);
        return label(kinds[select(count + select(0u, 1u, count > 2u) - 1u, 2u, opposite)], 0.8);
    }
    let ends = vec2u(countOneBits(v.ends & 3u), countOneBits(v.ends >> 2u));
    if frame.map == shows_run_ends {
        let most = max(ends.x, ends.y);
        return label(select(select(7u, 3u, min(ends.x, ends.y) > 0u), 1u, most == 2u), 0.8);
    }
    return select(v.place.x, v.place.y, frame.map == shows_run_y);
}
