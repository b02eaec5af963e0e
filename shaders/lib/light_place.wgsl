//!include lib/frame.wgsl
//!include lib/scene.wgsl
// Places of a light with a size: of the disc that shines and faces what it lights, or of the rectangle. Within -1 to 1 along
// its half sides, or in units of the disc's radius.

fn has_size() -> bool {
    return frame.light_radius > 0.0 || frame.light_kind == rect_area;
}

// Two unit vectors at right angles to a unit vector and to each other.
fn across(direction: vec3f) -> mat2x3f {
    let other = select(vec3f(1.0, 0.0, 0.0), vec3f(0.0, 1.0, 0.0), abs(direction.x) > 0.5);
    let u = normalize(cross(direction, other));
    return mat2x3f(u, cross(direction, u));
}

// From a surface to a place of the light, given what `light_at` says there: the way to its centre.
fn towards(to_centre: vec3f, place: vec2f) -> vec3f {
    if frame.light_kind == rect_area {
        return to_centre + place.x * frame.light_half_u + place.y * frame.light_half_v;
    }
    return to_centre + frame.light_radius * (across(normalize(to_centre)) * place);
}

// A place of the unit disc for a place of the unit square: concentric, so that equal areas stay equal and neighbours stay
// neighbours (Shirley, Chiu 1997).
fn on_disc(square: vec2f) -> vec2f {
    let p = 2.0 * square - 1.0;
    let wide = abs(p.x) > abs(p.y);
    let radius = select(p.y, p.x, wide);
    let angle = 0.7853982 * select(p.x, p.y, wide) / select(radius, 1.0, radius == 0.0);
    return radius * select(vec2f(sin(angle), cos(angle)), vec2f(cos(angle), sin(angle)), wide);
}

// A place of the light for one of the unit square: equal areas of both are the same share of the light.
fn on_light(square: vec2f) -> vec2f {
    if frame.light_kind == rect_area {
        return 2.0 * square - 1.0;
    }
    return on_disc(square);
}

// A place of the unit square for a hashed number.
fn place_of_hash(x: u32) -> vec2f {
    return vec2f(vec2u(x, hash(x)) >> vec2u(8u)) / 16777216.0;
}

// The point `i` of the R2 sequence (Roberts 2018), in the unit square. In whole numbers, which thousands of steps do not round.
fn r2_point(i: u32) -> vec2f {
    return vec2f(vec2u(i * 3242174889u, i * 2447445414u) >> vec2u(8u)) / 16777216.0;
}

// The place of the sample `i` that a pixel sends its ray to: the points of that sequence, shifted in the square by a distance
// that differs from pixel to pixel (Cranley, Patterson 1976).
fn scattered(pixel: vec2u, i: u32) -> vec2f {
    return fract(place_of_hash(hash(pixel.x ^ hash(pixel.y))) + r2_point(i));
}

// As `scattered`, but shifted otherwise than the truth's rays, by the seed: what is measured against them is not measured against itself.
fn scattered_by_seed(pixel: vec2u, i: u32) -> vec2f {
    return scattered(pixel ^ vec2u(hash(frame.seed + 1u)), i);
}
