// Lloyd et al. 2008: after a perspective along y, whose near end is the map's lower side, a logarithm along y. Includers say which
// (`fn shape() -> Shape`, of the layer that is followed) and include the warp's passes.
//
// Let 1 + k = f_w/n_w be the quotient of the distances s from the perspective's centre at the map's upper and lower side,
// and y the share of the map's side from the upper one. The perspective makes n_w/s = (1 + k y) / (1 + k), so that
// t = ln(s/n_w) / ln(f_w/n_w) is 1 - ln(1 + k y) / ln(1 + k). Said from the upper side on: there places crowd, and close
// to 0 they keep their digits.

struct Shape {
    // f_w/n_w - 1.
    k: f32,
    // ln(f_w/n_w); 0: no warp.
    ln: f32,
}

// ln(1 + x) for x >= 0, exact to a few of its last bits: 2 artanh(x / (2 + x)) where 1 + x would lose digits.
fn ln_1p(x: f32) -> f32 {
    if x > 1.0 {
        return log(1.0 + x);
    }
    let z = x / (2.0 + x);
    let q = z * z;
    return 2.0 * z * (1.0 + q * (1.0 / 3.0 + q * (1.0 / 5.0 + q * (1.0 / 7.0 + q * (1.0 / 9.0 + q * (1.0 / 11.0))))));
}

// exp(x) - 1, likewise.
fn exp_m1(x: f32) -> f32 {
    if abs(x) > 0.5 {
        return exp(x) - 1.0;
    }
    return x * (1.0 + x / 2.0 * (1.0 + x / 3.0 * (1.0 + x / 4.0 * (1.0 + x / 5.0 * (1.0 + x / 6.0 * (1.0 + x / 7.0))))));
}

fn warp(u: vec2f) -> vec2f {
    let by = shape();
    if by.ln <= 0.0 {
        return u;
    }
    return vec2f(u.x, min(ln_1p(by.k * u.y) / by.ln, 1.0));
}

fn warp_slope(u: vec2f) -> mat2x2f {
    let by = shape();
    var slope = 1.0;
    if by.ln > 0.0 {
        slope = by.k / (by.ln * (1.0 + by.k * u.y));
    }
    return mat2x2f(vec2f(1.0, 0.0), vec2f(0.0, slope));
}

fn unwarp(at: vec2f) -> vec2f {
    let by = shape();
    if by.ln <= 0.0 {
        return at;
    }
    return vec2f(at.x, exp_m1(at.y * by.ln) / by.k);
}

// A logarithm bends one way only: on any edge few samples tell by how much, and each halving takes an octave off its
// far end.
fn warp_bends() -> f32 {
    return 16.0 * (1.0 + shape().ln);
}

// A view that lacks its margin so far, and the logarithm on it.
struct Shaped {
    view: LightView,
    shape: Shape,
}

// `h`: 1 over the ndc y of infinity. The margin is added along y after the logarithm, as texels before it can reach farther than
// infinity.
fn shaped(tight_view: LightView, h: f32) -> Shaped {
    var v = tight_view;
    let tight = ln_1p(2.0 * h / (1.0 - h));
    let margin = 1.0 + normal_offset();
    let share = margin / max(v.resolution - 2.0 * margin, 1.0);
    var low = -1.0 - 2.0 * share;
    var high = 1.0 + 2.0 * share;
    if h > 1e-4 {
        low = -1.0 - (1.0 + h) / h * exp_m1(share * tight);
        high = 1.0 - (1.0 - h) / h * exp_m1(-share * tight);
    }
    v.row_x /= 1.0 + 2.0 * share;
    v.row_y = (v.row_y - 0.5 * (low + high) * v.row_w) * (2.0 / (high - low));
    v.margin = margin;
    let k = exp_m1(tight * (1.0 + 2.0 * share));
    return Shaped(v, Shape(k, select(0.0, ln_1p(k), h > 1e-6)));
}

// How many times longer a texel is than without the logarithm, seen across the light's beam: green shorter, red longer;
// full at four times.
fn gain(s: Surface, v: LightView) -> f32 {
    if !s.valid || !faces_light(s) {
        return -1.0;
    }
    let to_light = normalize(light_at(s.position).to_light);
    let times = log2(map_texel_size(v, s.position, to_light) / texel_size(v, s.position, to_light));
    return label(select(2u, 0u, times > 0.0), 0.9 * saturate(abs(times) / 2.0));
}
