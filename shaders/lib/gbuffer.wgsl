//!include lib/frame.wgsl
//!include lib/scene.wgsl
//!include lib/color.wgsl
// Reading the G-buffer.

// World position; w is the depth along the camera's axis, 0 where there is only background.
var g_position: texture_2d<f32>;
// Geometric and shading normal (octahedral, 2 × 24 and 2 × 12 bits), albedo (rgb8), triangle: see `surface_words`.
var g_surface: texture_2d<u32>;

// Rounding of a number near 1: half of its last digit.
const unit = 5.9604645e-8;

// The words of `g_surface`. The geometric normal decides what faces the light, so it has as many bits as a float: its x is the
// first word's lower part, its y the upper eight bits of the first, second and third. Albedo is kept sRGB-encoded: eight
// bits band less so.
fn surface_words(normal: vec3f, shading: vec3f, albedo: vec3f, triangle: u32) -> vec4u {
    let n = bitcast<vec2u>(vec2i(round(to_octahedron(normal) * 8388607.0)));
    let s = bitcast<vec2u>(vec2i(round(to_octahedron(shading) * 2047.0))) & vec2u(0xfffu);
    let color = pack4x8unorm(vec4f(linear_to_srgb(saturate(albedo)), 0.0));
    return vec4u(insertBits(n.x, n.y, 24u, 8u),
                 insertBits(s.x | (s.y << 12u), n.y >> 8u, 24u, 8u),
                 insertBits(color, n.y >> 16u, 24u, 8u),
                 triangle);
}

// The geometric normal of the words of `g_surface`.
fn g_normal(words: vec4u) -> vec3f {
    let y = (words.x >> 24u) | ((words.y >> 24u) << 8u) | ((words.z >> 24u) << 16u);
    let n = bitcast<vec2i>(vec2u(words.x, y) << vec2u(8u)) >> vec2u(8u);
    return from_octahedron(vec2f(n) / 8388607.0);
}

fn g_shading_normal(words: vec4u) -> vec3f {
    let n = bitcast<vec2i>(vec2u(words.y << 20u, words.y << 8u)) >> vec2u(20u);
    return from_octahedron(vec2f(n) / 2047.0);
}

struct Surface {
    // False: background.
    valid: bool,
    position: vec3f,
    depth: f32,
    // Geometric; turned towards the camera on double-sided surfaces.
    normal: vec3f,
    shading_normal: vec3f,
    albedo: vec3f,
    triangle: u32,
    pixel: vec2u,
}

fn load_surface(pixel: vec2u) -> Surface {
    let p = textureLoad(g_position, pixel, 0);
    let s = textureLoad(g_surface, pixel, 0);
    return Surface(p.w > 0.0, p.xyz, p.w, g_normal(s), g_shading_normal(s), srgb_to_linear(unpack4x8unorm(s.z).xyz), s.w, pixel);
}

// Morais 2015: whether the surface faces the light, by its geometric normal.
fn faces_light(s: Surface) -> bool {
    return dot(s.normal, light_at(s.position).to_light) > 0.0;
}

// Whether something can hide this light from a surface: it lies within cone and range, and the surface faces it.
fn may_be_shadowed(s: Surface, light: LightSample) -> bool {
    return s.valid && light.reached && dot(s.normal, light.to_light) > 0.0;
}

// World position and depth of a view sample whose visibility is looked up; depth 0: none.
fn lit_sample(pixel: vec2u) -> vec4f {
    if pixel.x >= frame.size.x || pixel.y >= frame.size.y {
        return vec4f(0.0);
    }
    let p = textureLoad(g_position, pixel, 0);
    let light = light_at(p.xyz);
    let facing = dot(g_normal(textureLoad(g_surface, pixel, 0)), light.to_light) > 0.0;
    return select(vec4f(0.0), p, p.w > 0.0 && light.reached && facing);
}
