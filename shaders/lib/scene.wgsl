//!include table.wgsl
// The scene's geometry and materials, shared by raster and rays.

struct Vertex {
    position: vec3f,
    // Octahedral, 2 × 16 bit.
    normal: u32,
    uv: vec2f,
    material: u32,
    // What its colour takes off white, 8 bits each: see `taken_off`.
    color: u32,
}

struct Material {
    base_color: vec4f,
    // Layer + 1, and 65536 for a large one; 0: no texture.
    texture: u32,
    // Below it there is no surface; negative: opaque.
    cutoff: f32,
    double_sided: u32,
    // Per axis 0 repeat, 1 mirror, 2 clamp: x + 4 y.
    wrap: u32,
    // Size of the image.
    texels: vec2f,
    // Where a texel is taken as it is instead of a mean of neighbours: bits as below.
    nearest: u32,
    padding: u32,
}

// Two texels a vertex, as `Vertex`.
var vertices: texture_2d<u32>;
// Three vertex indices and the surface id, which exact duplicates share.
var triangles: texture_2d<u32>;
var<storage, read> materials: array<Material>;
// Images up to 1024 texels, and larger ones.
var textures: texture_2d_array<f32>;
var large_textures: texture_2d_array<f32>;
var texture_sampler: sampler;

// Where a record lies in a table (src/gpu/table.rs).
fn table_texel(i: u32) -> vec2u {
    return vec2u(i & ((1u << table_bits) - 1u), i >> table_bits);
}

fn triangle_at(i: u32) -> vec4u {
    return textureLoad(triangles, table_texel(i), 0);
}

fn vertex_position(i: u32) -> vec3f {
    return bitcast<vec3f>(textureLoad(vertices, table_texel(2u * i), 0).xyz);
}

fn vertex_at(i: u32) -> Vertex {
    let first = textureLoad(vertices, table_texel(2u * i), 0);
    let second = textureLoad(vertices, table_texel(2u * i + 1u), 0);
    return Vertex(bitcast<vec3f>(first.xyz), first.w, bitcast<vec2f>(second.xy), second.z, second.w);
}

// A unit vector from its place on the octahedron, unfolded to the square [-1, 1]².
fn from_octahedron(e: vec2f) -> vec3f {
    let n = vec3f(e, 1.0 - abs(e.x) - abs(e.y));
    let t = max(-n.z, 0.0);
    return normalize(vec3f(n.xy + select(vec2f(t), vec2f(-t), n.xy >= vec2f(0.0)), n.z));
}

fn to_octahedron(n: vec3f) -> vec2f {
    let p = n.xy / (abs(n.x) + abs(n.y) + abs(n.z));
    let folded = (1.0 - abs(p.yx)) * select(vec2f(-1.0), vec2f(1.0), p >= vec2f(0.0));
    return select(folded, p, n.z >= 0.0);
}

fn octahedral_decode(bits: u32) -> vec3f {
    return from_octahedron(unpack2x16snorm(bits));
}

// Bits of `Material::nearest`: where texels are larger than pixels; where they are smaller; then of the nearest smaller image, or of
// the two nearest in shares. Without the last two it is the image itself.
const magnified = 1u;
const minified = 2u;
const nearest_level = 4u;
const mixed_levels = 8u;

// What a vertex's colour takes off linear red, green and blue, and off alpha: nothing where there is none. Colours are interpolated
// like this, so that rounding takes nothing off white.
fn taken_off(color: u32) -> vec4f {
    // Roots of the linear parts are stored, which are even steps to the eye.
    let x = unpack4x8unorm(color);
    return vec4f(x.rgb * (2.0 - x.rgb), x.a);
}

// A vertex's texture coordinates, and what its colour takes off alpha.
fn texture_place(vertex: u32) -> vec3f {
    let v = vertex_at(vertex);
    return vec3f(v.uv, f32(v.color >> 24u) / 255.0);
}

fn wrapped(x: f32, mode: u32, inset: f32) -> f32 {
    if mode == 0u {
        return x;
    }
    let mirrored = abs(x - 2.0 * floor(0.5 * x + 0.5));
    return clamp(select(mirrored, x, mode == 2u), inset, 1.0 - inset);
}

fn is_large_texture(m: Material) -> bool {
    return m.texture > 65536u;
}

fn material_layer(m: Material) -> u32 {
    return (m.texture & 65535u) - 1u;
}

// Side of its layer at a level, texels.
fn texture_side(m: Material, level: u32) -> u32 {
    if is_large_texture(m) {
        return textureDimensions(large_textures, level).x;
    }
    return textureDimensions(textures, level).x;
}

// A material's texture at a level, `level` being one of the images of its layer.
fn texture_at_level(m: Material, uv: vec2f, level: f32) -> vec4f {
    if is_large_texture(m) {
        return textureSampleLevel(large_textures, texture_sampler, material_uv(m, uv), material_layer(m), level);
    }
    return textureSampleLevel(textures, texture_sampler, material_uv(m, uv), material_layer(m), level);
}

fn material_uv(m: Material, uv: vec2f) -> vec2f {
    let inset = 0.5 / f32(texture_side(m, 0u));
    return vec2f(wrapped(uv.x, m.wrap & 3u, inset), wrapped(uv.y, m.wrap >> 2u, inset));
}

// The texel nearest to a place in the array's `level`, of an image of `size` texels.
fn nearest_texel(m: Material, uv: vec2f, size: vec2f, level: u32) -> vec4f {
    let modes = vec2u(m.wrap & 3u, m.wrap >> 2u);
    let inside = vec2f(wrapped(uv.x, modes.x, 0.0), wrapped(uv.y, modes.y, 0.0));
    let place = select(inside, fract(inside), modes == vec2u(0u));
    // The array is as large as the image, or larger: the image's texel is found first.
    let middle = (clamp(floor(place * size), vec2f(0.0), size - 1.0) + 0.5) / size;
    let texel = vec2i(middle * f32(texture_side(m, level)));
    if is_large_texture(m) {
        return textureLoad(large_textures, texel, material_layer(m), level);
    }
    return textureLoad(textures, texel, material_layer(m), level);
}

// The texture where a pixel sees it; `dx`, `dy`: how far its coordinates change to the next pixel.
fn texture_seen(m: Material, uv: vec2f, dx: vec2f, dy: vec2f) -> vec4f {
    if m.nearest != 0u {
        let large = max(length(dx * m.texels), length(dy * m.texels)) <= 1.0;
        if (m.nearest & select(minified, magnified, large)) != 0u {
            if large || (m.nearest & (nearest_level | mixed_levels)) == 0u {
                return nearest_texel(m, uv, m.texels, 0u);
            }
            let side = f32(texture_side(m, 0u));
            let last = log2(side);
            let level = clamp(log2(side * max(length(dx), length(dy))), 0.0, last);
            if (m.nearest & nearest_level) != 0u {
                return nearest_texel(m, uv, vec2f(side * exp2(-round(level))), u32(round(level)));
            }
            let finer = nearest_texel(m, uv, vec2f(side * exp2(-floor(level))), u32(level));
            let coarser = nearest_texel(m, uv, vec2f(side * exp2(-ceil(level))), u32(ceil(level)));
            return mix(finer, coarser, fract(level));
        }
    }
    if is_large_texture(m) {
        return textureSampleGrad(large_textures, texture_sampler, material_uv(m, uv), material_layer(m), dx, dy);
    }
    return textureSampleGrad(textures, texture_sampler, material_uv(m, uv), material_layer(m), dx, dy);
}

// Whether a masked material has a surface at these texture coordinates, whose third says what the vertices' colours take off
// alpha: the one rule for raster and rays. Textures count in full size, as if magnified.
fn masked_out(m: Material, uv: vec3f) -> bool {
    if m.cutoff < 0.0 {
        return false;
    }
    var alpha = m.base_color.a;
    if m.texture > 0u {
        if (m.nearest & magnified) != 0u {
            alpha *= nearest_texel(m, uv.xy, m.texels, 0u).a;
        } else {
            alpha *= texture_at_level(m, uv.xy, 0.0).a;
        }
    }
    return alpha * (1.0 - uv.z) < m.cutoff;
}

fn hash(x: u32) -> u32 {
    // PCG output function (O'Neill 2014).
    let state = x * 747796405u + 2891336453u;
    let word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
    return (word >> 22u) ^ word;
}
