// Peters, Klein 2015, algorithm 3: three depths, one of them the receiver's, that have given moments.

struct Depths {
    // The other two.
    near: f32,
    far: f32,
    // The least share of depths before the receiver.
    shadow: f32,
    // Of the Hankel matrix: zero where one or two depths have these moments.
    determinant: f32,
}

// `b`: the first four moments of depths; `t`: the receiver's depth.
fn depths_of(b: vec4f, t: f32) -> Depths {
    // The Hankel matrix [1 b1 b2; b1 b2 b3; b2 b3 b4] as L D Lᵀ.
    // Without branches, of which adapters may run both sides. Without variance there is one depth only.
    let variance = b.y - b.x * b.x;
    let d2 = max(variance, 1e-12);
    let l32_d2 = b.z - b.x * b.y;
    let d3_d2 = (b.w - b.y * b.y) * d2 - l32_d2 * l32_d2;
    let l32 = l32_d2 / d2;
    let d3 = max(d3_d2 / d2, 1e-14);
    // Solves for the polynomial whose roots are the depths sought: c · (1, z, z²).
    var c = vec3f(1.0, t, t * t);
    c.y -= b.x;
    c.z -= b.y + l32 * c.y;
    c.y /= d2;
    c.z /= d3;
    c.y -= l32 * c.z;
    c.x -= c.y * b.x + c.z * b.y;
    let p = c.y / c.z;
    let q = c.x / c.z;
    let root = sqrt(max(0.25 * p * p - q, 0.0));
    let z1 = -0.5 * p - root;
    let z2 = -0.5 * p + root;
    let beyond = 1.0 - (z1 * z2 - b.x * (z1 + z2) + b.y) / ((t - z1) * (t - z2));
    let between = (t * z2 - b.x * (t + z2) + b.y) / ((z2 - z1) * (t - z1));
    let shadow = select(select(0.0, between, t > z1), beyond, t > z2);
    // NaN compares false.
    let least = select(0.0, saturate(shadow), shadow > 0.0);
    let single = variance <= 1e-12;
    return Depths(select(z1, b.x, single), select(z2, b.x, single), select(least, select(0.0, 1.0, t > b.x), single),
                  select(max(d3_d2, 0.0), 0.0, single));
}

// The share of depths before the receiver, by the same three depths, and their mean.
fn depths_before(b: vec4f, t: f32) -> vec2f {
    let d = depths_of(b, t);
    let others = vec2f(d.near, d.far);
    // Where one depth has all, the other two are the same.
    let apart = max(d.far - d.near, 1e-7);
    let weight = (t * others.yx - b.x * (t + others.yx) + b.y) / ((others - t) * vec2f(-apart, apart));
    let before = select(vec2f(0.0), weight, (others < vec2f(t)) & (weight > vec2f(0.0)));
    let mean = dot(before, others) / max(before.x + before.y, 1e-7);
    return vec2f(d.shadow, clamp(select(mean, d.near, d.far == d.near), 0.0, max(t, 0.0)));
}
