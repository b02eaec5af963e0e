//!include map/light_view.wgsl
// Images of triangles on a paraboloid (`light_view`), where straight edges become arcs of circles. Corners in the light's frame: metres
// from the light, z along the side's axis.

// An order of places, so that both sides of an edge take it in the same direction.
fn precedes(p: vec3f, q: vec3f) -> bool {
    return p.x < q.x || (p.x == q.x && (p.y < q.y || (p.y == q.y && p.z < q.z)));
}

// The plane through the light and an edge (Olano, Greer 1997): the same digits from both of its sides, with opposite signs, so that
// no ray passes between neighbours.
fn edge_plane(a: vec3f, b: vec3f) -> vec3f {
    if precedes(a, b) {
        return cross(a, b);
    }
    return -cross(b, a);
}

// Where a point of the light's frame lies on the map, not as a quotient: edges between such places are straight on it. Far behind the
// side places run off to infinity; they are held off.
fn place_in(v: LightView, q: vec3f) -> vec2f {
    let w = max(length(q) + q.z, 0.02 * length(q));
    return (q.xy / max(w, 1e-30) - v.row_z.xy) * v.row_z.zw;
}

fn place_of(q: vec3f) -> vec2f {
    return place_in(light_view, q);
}

// The axis of the half space that the side holds, in the light's frame.
fn side_axis() -> vec3f {
    let v = light_view;
    return vec3f(dot(v.row_x.xyz, v.row_w.xyz), dot(v.row_y.xyz, v.row_w.xyz), dot(v.axis.xyz, v.row_w.xyz));
}

// Cosine of the angle between a direction and that axis.
fn ahead_of(q: vec3f) -> f32 {
    return dot(side_axis(), q) / max(length(q), 1e-30);
}

// Whether the light stands in a triangle's plane, as far as rounding can tell: seen edge-on the triangle has no image, and only rounding
// would say where. `a`, `b`, `c`: its corners from the light; `away`: how far the light is from the origin.
fn edge_on(a: vec3f, b: vec3f, c: vec3f, away: f32) -> bool {
    let normal = cross(b - a, c - a);
    return abs(dot(a, normal)) <= 1e-6 * (max(max(length(a), length(b)), length(c)) + away) * length(normal);
}

// The box of what lies in a side's map of a triangle: low and high corners in clip space over w.
struct Box {
    low: vec2f,
    high: vec2f,
}

// Stretches a box to an edge's image: the arc of a circle that a plane through the light becomes, with the middle m.xy/m.z and the
// radius 1/|m.z| for its unit normal m. It reaches farthest at its ends, or at the circle's four extremes if it passes them.
fn with_arc(box: Box, a: vec3f, b: vec3f) -> Box {
    var grown = box;
    let normal = cross(a, b);
    let size = length(normal);
    if size <= 1e-12 * length(a) * length(b) {
        return grown;
    }
    let m = normal / size;
    if abs(m.z) < 1e-5 {
        // Straight, or as good as that.
        return grown;
    }
    let middle = m.xy / m.z;
    for (var k = 0u; k < 4u; k++) {
        let along = select(vec2f(1.0, 0.0), vec2f(0.0, 1.0), k > 1u) * select(1.0, -1.0, (k & 1u) == 1u);
        let at = middle + along / abs(m.z);
        let ray = vec3f(2.0 * at, 1.0 - dot(at, at));
        if dot(cross(a, ray), m) >= 0.0 && dot(cross(ray, b), m) >= 0.0 {
            let place = (at - light_view.row_z.xy) * light_view.row_z.zw;
            grown.low = min(grown.low, place);
            grown.high = max(grown.high, place);
        }
    }
    return grown;
}

// The box of a triangle's image. What lies behind the side has none: low above high.
fn box_of_image(corners: array<vec3f, 3>) -> Box {
    var box = Box(vec2f(1e9), vec2f(-1e9));
    var near_infinity = false;
    var beyond = true;
    // Where the direction that lies at infinity is met, if not by the triangle then opposite to it.
    var sides: vec3f;
    for (var k = 0u; k < 3u; k++) {
        let q = corners[k];
        let next = corners[(k + 1u) % 3u];
        near_infinity |= length(q) + q.z < 0.02 * length(q);
        beyond &= ahead_of(q) < min(light_view.ahead, 0.0);
        sides[(k + 2u) % 3u] = -edge_plane(q, next).z;
        let place = place_of(q);
        box.low = min(box.low, place);
        box.high = max(box.high, place);
        box = with_arc(box, q, next);
    }
    // All of it lies behind the side.
    if beyond {
        return Box(vec2f(1e9), vec2f(-1e9));
    }
    // What holds that direction, or comes near it, may be anywhere.
    let sum = sides.x + sides.y + sides.z;
    let at = (sides.x * corners[0].z + sides.y * corners[1].z + sides.z * corners[2].z) / sum;
    let all_of_a_sign = min(min(sides.x, sides.y), sides.z) >= 0.0 || max(max(sides.x, sides.y), sides.z) <= 0.0;
    if near_infinity || (sum != 0.0 && all_of_a_sign && at < 0.0) {
        box = Box(vec2f(-1.0), vec2f(1.0));
    }
    return box;
}
