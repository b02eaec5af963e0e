//!include map/prefilter.wgsl
// Annen, Mertens, Bekaert, Seidel, Kautz 2007: the step of the depth test as a Fourier series, whose terms can be averaged before
// the receiver is known.

var<uniform> csm: CsmConvolutionParams;

// The wave number of the k-th term, k from 1 on.
fn wave(k: u32) -> f32 {
    return 3.14159265 * f32(2u * k - 1u);
}

// The series repeats after twice its range, so that the far end comes close to the near one again: a tenth is kept free.
const share_used = 0.9;

// Sine and cosine of two terms each.
fn moments(z: f32, slope: f32, plane: u32) -> vec4f {
    let a = wave(2u * plane + 1u) * share_used * z;
    let b = wave(2u * plane + 2u) * share_used * z;
    return vec4f(sin(a), cos(a), sin(b), cos(b));
}

// The k-th term's weight: damped, so that the series rings less (their section 4).
fn term_weight(k: u32) -> f32 {
    let share = f32(k) / f32(csm.terms);
    return 2.0 / wave(k) * exp(-csm.damping * share * share);
}

// The series for a receiver at depth t; `m`: sine and cosine of the k-th term.
fn term(k: u32, m: vec2f, t: f32) -> f32 {
    let at = wave(k) * t;
    return term_weight(k) * (cos(at) * m.x - sin(at) * m.y);
}

fn light_at_depth(s: Surface, r: Receiver, z: f32) -> f32 {
    let t = share_used * max(z - csm.csm_offset, 0.0);
    let places = averaged(s, r);
    var v = 0.5;
    for (var k = 1u; k <= csm.terms; k += 2u) {
        let m = moments_of(places, k / 2u);
        v += term(k, m.xy, t);
        v += select(0.0, term(k + 1u, m.zw, t), k < csm.terms);
    }
    // On the caster the series is at one half: there the light begins to be whole.
    return saturate(2.0 * v);
}

fn explaining_depths(s: Surface, r: Receiver) -> vec2f {
    return vec2f(-1.0);
}

fn inspect_filter(s: Surface) -> f32 {
    let r = received(s);
    if frame.map == shows_first_term || frame.map == shows_last_term {
        if !s.valid || outside_map(r, r.texel) {
            return -1.0;
        }
        let last = csm.terms - 1u;
        let k = select(last, 0u, frame.map == shows_first_term);
        let m = moments_of(averaged(s, r), k / 2u);
        return 0.5 + 0.5 * select(m.x, m.z, k % 2u == 1u);
    }
    return inspect_look_up(s, r);
}
