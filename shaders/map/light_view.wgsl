//!include constants.wgsl
// A light's view: the projection that a shadow map is drawn and looked up with.

struct LightView {
    // Rows of the matrix from world space to clip space, depth reversed: 1 near, 0 far.
    row_x: vec4f,
    row_y: vec4f,
    row_z: vec4f,
    row_w: vec4f,
    // dot(axis, (X, 1)) is the linear depth in metres along the light's axis.
    axis: vec4f,
    near: f32,
    far: f32,
    // 1: perspective (a spot's map), 0: orthographic, 2: a projective warp of the image, whose stored depth is linear, 3: a paraboloid,
    // whose depth is the distance from the light, linear: see `paraboloid_clip`.
    perspective: u32,
    // Side of a shadow-map texel in metres; perspective: at a depth of 1 m. 0: texels are no squares, or differ: see `texel_size`.
    texel: f32,
    // Side of the shadow map in texels.
    resolution: f32,
    // Texels that a fit leaves free at each border for the filter.
    margin: f32,
    // Metres that it leaves free, on top.
    reach: f32,
    // Of a paraboloid's: cosine of the farthest angle from the axis in `row_w` that the map holds.
    ahead: f32,
    // Its number among the layers that have a warp each.
    layer: u32,
    // 1: no pixel looks it up, and nothing of it is made.
    idle: u32,
    padding: vec2u,
}

// The one that a map is drawn from, and those that layers are looked up with.
var<uniform> light_view: LightView;
var<uniform> light_views: array<LightView, most_layers>;

// Where a paraboloid's view sees a point: in the light's frame, metres from the light. Its axis is z.
fn light_frame(v: LightView, position: vec3f) -> vec3f {
    let p = vec4f(position, 1.0);
    return vec3f(dot(v.row_x, p), dot(v.row_y, p), dot(v.axis, p));
}

// The paraboloid's image of a point q of the light's frame is q.xy / (|q| + q.z): the equator becomes the unit circle (Brabec,
// Annen, Seidel 2002). As a quotient it is a clip position; `row_z` says which part of the image the map is: its middle and
// the inverse of half its sides.
fn paraboloid_clip(v: LightView, q: vec3f) -> vec4f {
    let w = length(q) + q.z;
    return vec4f((q.xy - v.row_z.xy * w) * v.row_z.zw, stored_depth(v, length(q)) * w, w);
}

// The same point of the light's frame, from its clip position.
fn unclipped(v: LightView, clip: vec4f) -> vec3f {
    let xy = clip.xy / v.row_z.zw + v.row_z.xy * clip.w;
    return vec3f(xy, 0.5 * (clip.w - dot(xy, xy) / max(clip.w, 1e-30)));
}

// The direction in the light's frame of a place of a paraboloid's map, as clip positions over w have it; not normalised.
fn paraboloid_ray(v: LightView, ndc: vec2f) -> vec3f {
    let at = ndc / v.row_z.zw + v.row_z.xy;
    return vec3f(2.0 * at, 1.0 - dot(at, at));
}

fn light_clip(v: LightView, position: vec3f) -> vec4f {
    if v.perspective == 3u {
        return paraboloid_clip(v, light_frame(v, position));
    }
    let p = vec4f(position, 1.0);
    return vec4f(dot(v.row_x, p), dot(v.row_y, p), dot(v.row_z, p), dot(v.row_w, p));
}

// Linear depth of a point, metres: along the light's axis, or, in a paraboloid, from the light.
fn depth_in(v: LightView, position: vec3f) -> f32 {
    if v.perspective == 3u {
        return length(light_frame(v, position));
    }
    return dot(v.axis, vec4f(position, 1.0));
}

// Stored depth of a linear depth z in metres.
fn stored_depth(v: LightView, z: f32) -> f32 {
    let d = (v.far - z) / (v.far - v.near);
    return select(d, d * v.near / max(z, 1e-6 * v.near), v.perspective == 1u);
}

// Linear depth in metres of a stored depth.
fn linear_depth(v: LightView, d: f32) -> f32 {
    if v.perspective == 1u {
        return v.near * v.far / (v.near + d * (v.far - v.near));
    }
    return v.far - d * (v.far - v.near);
}

// Depth from 0 at the view's near plane to 1 at its far plane, linear along the light's axis.
fn depth_share(v: LightView, stored: f32) -> f32 {
    return saturate((linear_depth(v, stored) - v.near) / (v.far - v.near));
}

// Place in the map of a clip position, texels from the upper left corner.
fn light_texel(v: LightView, clip: vec4f) -> vec2f {
    return 0.5 * v.resolution * vec2f(1.0 + clip.x / clip.w, 1.0 - clip.y / clip.w);
}

// Texels and stored depth gained as a point with this clip position moves by t: the derivative. w: the share of clip.w
// that a warp gains.
fn along(v: LightView, t: vec3f, clip: vec4f) -> vec4f {
    if v.perspective == 3u {
        let q = unclipped(v, clip);
        let step = vec3f(dot(v.row_x.xyz, t), dot(v.row_y.xyz, t), dot(v.axis.xyz, t));
        let farther = dot(q, step) / max(length(q), 1e-30);
        let w = farther + step.z;
        let xy = (step.xy * clip.w - q.xy * w) / (clip.w * clip.w) * v.row_z.zw;
        return vec4f(0.5 * v.resolution * vec2f(xy.x, -xy.y), -farther / (v.far - v.near), 0.0);
    }
    let d = vec4f(dot(v.row_x.xyz, t), dot(v.row_y.xyz, t), dot(v.row_z.xyz, t), dot(v.row_w.xyz, t));
    let ndc = (d.xyz * clip.w - clip.xyz * d.w) / (clip.w * clip.w);
    let texels = 0.5 * v.resolution * vec2f(ndc.x, -ndc.y);
    if v.perspective == 2u {
        return vec4f(texels, -dot(v.axis.xyz, t) / (v.far - v.near), d.w / clip.w);
    }
    return vec4f(texels, ndc.z, 0.0);
}

// Longest extent of J⁻¹ for a 2 × 2 matrix J with columns a and b: σmax(J⁻¹) = σmax(J) / |det J|.
fn longest_extent(a: vec2f, b: vec2f) -> f32 {
    let longest = 0.5 * (length(vec2f(a.x + b.y, a.y - b.x)) + length(vec2f(a.x - b.y, a.y + b.x)));
    return longest / max(abs(a.x * b.y - a.y * b.x), 1e-30);
}

// Half the map's sides that a metre across the light's axis takes; a spot light's at a depth of 1 m. A spot light's rows lean along
// the axis where the map's middle is off it.
fn scale_of(v: LightView) -> vec2f {
    let along = vec2f(dot(v.row_x.xyz, v.axis.xyz), dot(v.row_y.xyz, v.axis.xyz));
    return vec2f(length(v.row_x.xyz - along.x * v.axis.xyz), length(v.row_y.xyz - along.y * v.axis.xyz));
}

// Longest extent in metres of the texel at a point, seen across the light's beam; `to_light` is a unit vector.
fn texel_size(v: LightView, position: vec3f, to_light: vec3f) -> f32 {
    if v.perspective < 2u && v.texel > 0.0 {
        return v.texel * select(1.0, dot(v.axis, vec4f(position, 1.0)), v.perspective == 1u);
    }
    let other = select(vec3f(1.0, 0.0, 0.0), vec3f(0.0, 1.0, 0.0), abs(to_light.x) > 0.5);
    let t = normalize(cross(to_light, other));
    let clip = light_clip(v, position);
    return longest_extent(along(v, t, clip).xy, along(v, cross(to_light, t), clip).xy);
}
