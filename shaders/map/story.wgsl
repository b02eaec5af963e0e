//!include map/look_up.wgsl
// What a look-up does at single pixels, in numbers: by the functions that it looks up with.

// As `Looked` in src/frame/story.rs; a test compares the two field by field.
struct Looked {
    position: vec3f,
    // What the first layer leaves of the light.
    lit: f32,
    normal: vec3f,
    // And the one that takes over, by `share`.
    lit_next: f32,
    // Where the surface lies in its layer, texels; the same before a warp; and where it is looked up, with the normal offset.
    texel: vec2f,
    before: vec2f,
    looked: vec2f,
    layer: u32,
    next: u32,
    share: f32,
    // Side of the map, texels.
    side: f32,
    // How far the filter's taps reach, texels.
    radius: f32,
    // Longest extent of a texel across the light, metres.
    texel_size: f32,
    // Depth from the light of the surface, of what it is compared as, and of what the texel holds, metres along the axis; stored: 0
    // is empty.
    depth: f32,
    compared: f32,
    held: f32,
    stored: f32,
    // How far the comparison is moved towards the light, metres: constant, by slope, along the normal, onto the receiver's plane.
    bias: vec4f,
    // Metres that the surface's plane gains along the texel's sides, however steep.
    slope: vec2f,
    near: f32,
    far: f32,
    perspective: u32,
    // 1: the map holds nothing there.
    outside: u32,
    // Metres of depth that a metre towards the light is.
    fall: f32,
    // Texels between two of `taps`.
    spread: f32,
    // The texel's corners on the surface's plane, metres.
    corners: array<vec4f, 4>,
    // 5 × 5 places around: what is held there, what it is compared with, where the surface's plane lies; metres. Last 0 where nothing is
    // held, 1 where something is, 2 beside the map.
    taps: array<vec4f, 25>,
}

var<storage, read> story_pixels: array<vec2u>;
var<storage, read_write> stories: array<Looked>;

// A surface's point moved on its plane until it lies at a place of the map, by Newton's method.
fn on_plane(s: Surface, layer: u32, texel: vec2f) -> vec3f {
    let v = light_views[layer];
    let other = select(vec3f(1.0, 0.0, 0.0), vec3f(0.0, 1.0, 0.0), abs(s.normal.x) > 0.5);
    let u = normalize(cross(s.normal, other));
    let w = cross(s.normal, u);
    var p = s.position;
    for (var i = 0u; i < 6u; i++) {
        let clip = light_clip(v, p);
        let off = texel - map_texel(v, clip);
        let a = map_along(v, u, clip).xy;
        let b = map_along(v, w, clip).xy;
        let determinant = a.x * b.y - a.y * b.x;
        if abs(determinant) <= 1e-9 * length(a) * length(b) {
            break;
        }
        p += ((off.x * b.y - off.y * b.x) * u + (a.x * off.y - a.y * off.x) * w) / determinant;
    }
    return p;
}

// Depth from the light at which a texel's ray meets the surface's own plane, metres.
fn plane_depth(v: LightView, here: Receiver, plane: Gradient, depth: f32, texel: vec2f) -> f32 {
    let step = map_step(v, here.clip, here.texel, texel);
    let rise = dot(plane.depth, step) / max(1.0 - dot(plane.bend, step), 0.1);
    return linear_depth(v, stored_depth(v, depth) + rise);
}

@compute @workgroup_size(1)
fn tell_story(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= arrayLength(&story_pixels) {
        return;
    }
    var l: Looked;
    let s = load_surface(story_pixels[id.x]);
    let light = light_at(s.position);
    if !may_be_shadowed(s, light) {
        l.outside = 2u;
        stories[id.x] = l;
        return;
    }
    let c = choose(s);
    let v = light_views[c.layer];
    l.position = s.position;
    l.normal = s.normal;
    l.layer = texture_layer(c.layer);
    l.next = l.layer;
    l.share = c.share;
    if c.share > 0.0 {
        l.next = texture_layer(c.next);
        l.lit_next = lit(s, c.next);
    }
    l.lit = lit(s, c.layer);
    // As that was asked for.
    l.radius = received_with.x;
    let r = receive(s, c.layer, received_with.x, received_with.y);
    let moved = received_depths;
    let clip = light_clip(v, s.position);
    l.texel = map_texel(v, clip);
    l.before = before_place(v, l.texel);
    l.looked = r.texel;
    l.side = v.resolution;
    let to_light = normalize(light.to_light);
    l.texel_size = map_texel_size(v, s.position, to_light);
    l.depth = depth_in(v, s.position);
    l.fall = (l.depth - depth_in(v, s.position + 1e-3 * l.depth * to_light)) / (1e-3 * l.depth);
    l.near = v.near;
    l.far = v.far;
    l.perspective = v.perspective;
    // Beside its own map another one may hold it, and is then looked up.
    let elsewhere = outside_map(r, r.texel);
    var next_to = Beside(1.0, v.far);
    if elsewhere {
        next_to = beside(r, r.texel);
    }
    l.outside = select(0u, 1u, elsewhere && next_to.depth >= v.far);
    l.compared = linear_depth(v, depth_at(r, floor(r.texel) + 0.5));
    let plain = linear_depth(v, r.depth);
    l.bias = vec4f(moved.x - linear_depth(v, moved.y), linear_depth(v, moved.y) - plain, l.depth - moved.x, plain - l.compared);
    let plane = plane_gradient(v, s.normal, clip);
    var here = r;
    here.clip = clip;
    here.texel = l.texel;
    // Half a texel to either side, as depth may not be linear.
    for (var i = 0u; i < 2u; i++) {
        let step = select(vec2f(0.5, 0.0), vec2f(0.0, 0.5), i == 1u);
        let ends = vec2f(plane_depth(v, here, plane, l.depth, l.texel + step), plane_depth(v, here, plane, l.depth, l.texel - step));
        l.slope[i] = ends.x - ends.y;
    }
    if elsewhere {
        l.held = next_to.depth;
        l.stored = stored_depth(v, next_to.depth);
    } else {
        l.stored = drawn_depth(c.layer, vec2u(r.texel));
        l.held = linear_depth(v, l.stored);
    }
    let cell = floor(r.texel);
    for (var i = 0u; i < 4u; i++) {
        let corner = cell + vec2f(select(0.0, 1.0, i == 1u || i == 2u), select(0.0, 1.0, i > 1u));
        l.corners[i] = vec4f(on_plane(s, c.layer, corner), 1.0);
    }
    l.spread = max(1.0, 0.5 * l.radius);
    for (var i = 0u; i < 25u; i++) {
        let at = r.texel + (vec2f(vec2u(i % 5u, i / 5u)) - 2.0) * l.spread;
        var tap = vec4f(0.0, 0.0, 0.0, 2.0);
        if outside_map(r, at) {
            let there = beside(r, at);
            let centre = floor(at) + 0.5;
            if there.depth < v.far {
                tap = vec4f(there.depth, linear_depth(v, depth_at(r, centre)), plane_depth(v, here, plane, l.depth, centre), 1.0);
            }
        } else {
            let centre = floor(at) + 0.5;
            let stored = drawn_depth(c.layer, vec2u(at));
            tap = vec4f(linear_depth(v, stored), linear_depth(v, depth_at(r, centre)), plane_depth(v, here, plane, l.depth, centre), select(0.0, 1.0, stored > 0.0));
        }
        l.taps[i] = tap;
    }
    stories[id.x] = l;
}
