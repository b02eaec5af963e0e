//!include map/light_view.wgsl
// Which triangles a light's view may draw.

// Triangles to a row of the dispatch.
const row = 2097152u;

// Whether a triangle may cover the centre of a texel, where alone a rasteriser samples it. `a`, `b`, `c`: its corners in the
// map, texels; `side`: the map's; `spare`: how far the rasteriser may move corners. Separating axes: the sides of the box of
// centres, and the triangle's edges.
fn covers_centre(a: vec2f, b: vec2f, c: vec2f, side: f32, spare: f32) -> bool {
    // The map's outermost centres in the triangle's box.
    let low = max(ceil(min(min(a, b), c) - spare - 0.5), vec2f(0.0)) + 0.5;
    let high = min(floor(max(max(a, b), c) + spare - 0.5), vec2f(side - 1.0)) + 0.5;
    return !any(low > high) && !beyond(a, b, c, low, high, spare) && !beyond(b, c, a, low, high, spare)
        && !beyond(c, a, b, low, high, spare);
}

// Whether all points between `low` and `high` lie on the other side of the edge ab than c.
fn beyond(a: vec2f, b: vec2f, c: vec2f, low: vec2f, high: vec2f, spare: f32) -> bool {
    let across = vec2f(a.y - b.y, b.x - a.x);
    let outwards = select(across, -across, dot(across, c - a) > 0.0);
    let nearest = select(high, low, outwards > vec2f(0.0));
    return dot(outwards, nearest - a) > spare * (abs(outwards.x) + abs(outwards.y));
}

// Whether a triangle may touch the map of a view with a matrix: its box, swept towards the light, and the centres of its texels.
fn touches(v: LightView, p: vec3f, q: vec3f, r: vec3f) -> bool {
    let a = light_clip(v, p);
    let b = light_clip(v, q);
    let c = light_clip(v, r);
    // How far each corner lies beyond each side, a little spared for rounding: all beyond one, or all behind a spot light.
    let right = min(min(a.xy - a.w * 1.00001, b.xy - b.w * 1.00001), c.xy - c.w * 1.00001);
    let left = max(max(a.xy + a.w * 1.00001, b.xy + b.w * 1.00001), c.xy + c.w * 1.00001);
    let last = max(max(a.w, b.w), c.w);
    // Depth is reversed: below 0 lies beyond the far plane.
    if any(right > vec2f(0.0)) || any(left < vec2f(0.0)) || last <= 0.0 || max(max(a.z, b.z), c.z) < -1e-5 {
        return false;
    }
    let nearest = min(min(a.w, b.w), c.w);
    if nearest <= 0.0 {
        return true;
    }
    let half = 0.5 * v.resolution;
    let places = array<vec2f, 3>(a.xy / a.w, b.xy / b.w, c.xy / c.w);
    let farthest = max(max(abs(places[0]), abs(places[1])), abs(places[2]));
    // Rounding of the projection, some ulps of its terms; and the rasteriser's own grid, at the coarsest 16 steps a
    // texel (Vulkan's least).
    let size = vec4f(max(max(abs(p), abs(q)), abs(r)), 1.0);
    let terms = vec2f(dot(abs(v.row_x), size), dot(abs(v.row_y), size)) + farthest * dot(abs(v.row_w), size);
    let spare = 0.0625 + 1e-6 * half * (1.0 + max(terms.x, terms.y) / nearest);
    return covers_centre(half + half * places[0], half + half * places[1], half + half * places[2], v.resolution, spare);
}
