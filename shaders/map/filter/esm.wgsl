//!include map/prefilter.wgsl
// Annen, Mertens, Seidel, Flerackers, Kautz 2008; Salvi 2008: the step of the depth test as an exponential, which can be averaged
// before the receiver is known.

var<uniform> esm: EsmParams;

fn moments(z: f32, slope: f32, plane: u32) -> vec4f {
    return vec4f(exp(esm.exponent * z), 0.0, 0.0, 0.0);
}

// The mean of exp(c (t - z)) over the kernel's depths t. Above 1 some of its texels lie behind the receiver, and it tells nothing of
// the rest.
fn exponential(s: Surface, r: Receiver, z: f32) -> f32 {
    return moments_at(s, r).x * exp(-esm.exponent * z);
}

// Above 1 by so much it is no rounding, nor a gentle slope of the receiver itself.
const bound_margin = 1.05;

// Comparisons over the kernel that was averaged, of a receiver at depth z, with the bias that so wide a kernel asks for.
fn compared(s: Surface, r: Receiver, z: f32) -> f32 {
    let v = light_views[r.layer];
    var moved = receive(s, r.layer, f32(prefiltering.blur_radius), 1.0);
    let share = z + receiver_share(moved) - receiver_share(r);
    moved.depth = max(stored_depth(v, mix(v.near, v.far, share)), 0.0);
    let radius = i32(prefiltering.blur_radius);
    let narrow = -2.0 / max(f32(radius * radius), 1.0);
    let side = 2 * radius + 1;
    var sum = 0.0;
    var weight = 0.0;
    for (var i = 0; i < side * side; i++) {
        let x = f32(i % side - radius);
        let y = f32(i / side - radius);
        let w = exp(narrow * (x * x + y * y));
        sum += w * compare(moved, r.texel + vec2f(x, y));
        weight += w;
    }
    return sum / weight;
}

fn light_at_depth(s: Surface, r: Receiver, z: f32) -> f32 {
    let e = exponential(s, r, z);
    if esm.fall_back != 0u && e > bound_margin {
        return compared(s, r, z);
    }
    return saturate(e * exp(0.001 * esm.exponent * esm.esm_offset));
}

fn explaining_depths(s: Surface, r: Receiver) -> vec2f {
    return vec2f(log(moments_at(s, r).x) / esm.exponent, -1.0);
}

fn inspect_filter(s: Surface) -> f32 {
    let r = received(s);
    if frame.map == shows_over_bound || frame.map == shows_filtered_depth {
        if !s.valid || outside_map(r, r.texel) || !faces_light(s) {
            return -1.0;
        }
        if frame.map == shows_filtered_depth {
            return log(moments_at(s, r).x) / esm.exponent;
        }
        return label(0u, select(0.0, 0.7, exponential(s, r, receiver_share(r)) > bound_margin));
    }
    return inspect_look_up(s, r);
}
