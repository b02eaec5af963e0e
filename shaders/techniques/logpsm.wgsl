//!include map/warp/single.wgsl
// Lloyd et al. 2008: after a perspective along y, whose near end is the map's lower side, a logarithm along y.
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

var<uniform> shape: Shape;

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
    if shape.ln <= 0.0 {
        return u;
    }
    return vec2f(u.x, min(ln_1p(shape.k * u.y) / shape.ln, 1.0));
}

fn warp_slope(u: vec2f) -> mat2x2f {
    var slope = 1.0;
    if shape.ln > 0.0 {
        slope = shape.k / (shape.ln * (1.0 + shape.k * u.y));
    }
    return mat2x2f(vec2f(1.0, 0.0), vec2f(0.0, slope));
}

fn unwarp(at: vec2f) -> vec2f {
    if shape.ln <= 0.0 {
        return at;
    }
    return vec2f(at.x, exp_m1(at.y * shape.ln) / shape.k);
}

// A logarithm bends one way only: on any edge few samples tell by how much, and each halving takes an octave off its
// far end.
fn warp_bends() -> f32 {
    return 16.0 * (1.0 + shape.ln);
}

var<storage, read_write> made_shape: Shape;
var<storage, read_write> made_view: LightView;

// f_w/n_w of the light's view, which may be narrowed to the receivers: a part of a logarithm is one again, with the same
// centre. Then the margin, which the view lacks so far: along y it is added after the logarithm, as texels before it can
// reach farther than infinity.
@compute @workgroup_size(1)
fn shape_of_view() {
    var v = light_view;
    // Along the perspective and across the light: what w gains there as y gains 1; 1 over the ndc y of infinity.
    let along = v.row_y.xyz - v.axis.xyz * dot(v.axis.xyz, v.row_y.xyz);
    // At 1 - 2e-5 f_w/n_w is 1e5.
    let h = clamp(dot(v.row_w.xyz, along) / dot(v.row_y.xyz, along), 0.0, 1.0 - 2e-5);
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
    made_view = v;
    let k = exp_m1(tight * (1.0 + 2.0 * share));
    made_shape = Shape(k, select(0.0, ln_1p(k), h > 1e-6));
}

// How many times longer a texel is than without the logarithm, seen across the light's beam: green shorter, red longer;
// full at four times.
fn gain(s: Surface) -> f32 {
    if !s.valid || !faces_light(s) {
        return -1.0;
    }
    let to_light = normalize(light_at(s.position).to_light);
    let times = log2(map_texel_size(light_view, s.position, to_light) / texel_size(light_view, s.position, to_light));
    return label(select(2u, 0u, times > 0.0), 0.9 * saturate(abs(times) / 2.0));
}

fn inspect_warp(s: Surface) -> f32 {
    if frame.map == shows_gain {
        return gain(s);
    }
    return -1.0;
}
