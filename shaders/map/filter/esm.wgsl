//!include map/prefilter.wgsl
// Annen, Mertens, Seidel, Flerackers, Kautz 2008; Salvi 2008: the step of the depth test as an exponential, which can be averaged
// before the receiver is known.

var<uniform> esm: EsmParams;

fn moments(z: f32, slope: f32, plane: u32) -> vec4f {
    return vec4f(exp(esm.exponent * z), 0.0, 0.0, 0.0);
}

// The mean of exp(c (z - t)) over the kernel. Above 1 some of its texels lie behind the receiver, and it tells nothing of the rest.
fn exponential(s: Surface, r: Receiver, z: f32) -> f32 {
    return moments_at(s, r).x * exp(-esm.exponent * (z - 0.001 * esm.esm_offset));
}

// A texel behind the receiver by so much is no rounding, nor the slope of the receiver itself.
const bound_margin = 1.05;

// Comparisons over the kernel that was averaged, of a receiver at depth z.
fn compared(r: Receiver, z: f32) -> f32 {
    let v = light_views[r.layer];
    var moved = r;
    moved.depth = max(stored_depth(v, mix(v.near, v.far, z)), 0.0);
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

fn kernel_reach() -> f32 {
    return select(0.0, f32(prefiltering.blur_radius), esm.fall_back != 0u);
}

fn light_at_depth(s: Surface, r: Receiver, z: f32) -> f32 {
    let e = exponential(s, r, z);
    if esm.fall_back != 0u && e > bound_margin {
        return compared(r, z);
    }
    return saturate(e);
}

fn explaining_depths(s: Surface, r: Receiver) -> vec2f {
    return vec2f(log(moments_at(s, r).x) / esm.exponent, -1.0);
}

fn inspect_filter(s: Surface) -> f32 {
    let r = receive(s, choose(s).layer, 0.0, 2.0);
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
