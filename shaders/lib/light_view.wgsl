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
    // 1: perspective (a spot's map), 0: orthographic.
    perspective: u32,
    // Side of a shadow-map texel in metres; perspective: at a depth of 1 m.
    texel: f32,
    // Side of the shadow map in texels.
    resolution: f32,
    // Texels that a fit leaves free at each border for the filter.
    margin: f32,
    padding: vec2f,
}

@group(1) @binding(8) var<storage, read> light_view: LightView;

fn light_clip(v: LightView, position: vec3f) -> vec4f {
    let p = vec4f(position, 1.0);
    return vec4f(dot(v.row_x, p), dot(v.row_y, p), dot(v.row_z, p), dot(v.row_w, p));
}

// Stored depth of a linear depth z in metres.
fn stored_depth(v: LightView, z: f32) -> f32 {
    let d = (v.far - z) / (v.far - v.near);
    return select(d, d * v.near / max(z, 1e-6 * v.near), v.perspective != 0u);
}

// Linear depth in metres of a stored depth.
fn linear_depth(v: LightView, d: f32) -> f32 {
    if v.perspective != 0u {
        return v.near * v.far / (v.near + d * (v.far - v.near));
    }
    return v.far - d * (v.far - v.near);
}

// Place in the map of a clip position, texels from the upper left corner.
fn light_texel(v: LightView, clip: vec4f) -> vec2f {
    return 0.5 * v.resolution * vec2f(1.0 + clip.x / clip.w, 1.0 - clip.y / clip.w);
}

// Texels and stored depth gained as a point with this clip position moves by t: the derivative.
fn along(v: LightView, t: vec3f, clip: vec4f) -> vec3f {
    let d = vec4f(dot(v.row_x.xyz, t), dot(v.row_y.xyz, t), dot(v.row_z.xyz, t), dot(v.row_w.xyz, t));
    let ndc = (d.xyz * clip.w - clip.xyz * d.w) / (clip.w * clip.w);
    return vec3f(0.5 * v.resolution * vec2f(ndc.x, -ndc.y), ndc.z);
}
