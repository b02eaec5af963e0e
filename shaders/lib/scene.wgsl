// The scene's geometry and materials, shared by raster and rays.

struct Vertex {
    position: vec3f,
    // Octahedral, 2 × 16 bit.
    normal: u32,
    uv: vec2f,
    material: u32,
    padding: u32,
}

struct Material {
    base_color: vec4f,
    // Layer + 1; 0: no texture.
    texture: u32,
    // Below it there is no surface; negative: opaque.
    cutoff: f32,
    double_sided: u32,
    // Per axis 0 repeat, 1 mirror, 2 clamp: x + 4 y.
    wrap: u32,
}

var<storage, read> vertices: array<Vertex>;
// Three vertex indices and the surface id, which exact duplicates share.
var<storage, read> triangles: array<vec4u>;
var<storage, read> materials: array<Material>;
var textures: texture_2d_array<f32>;
var texture_sampler: sampler;

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

fn wrapped(x: f32, mode: u32, inset: f32) -> f32 {
    if mode == 0u {
        return x;
    }
    let mirrored = abs(x - 2.0 * floor(0.5 * x + 0.5));
    return clamp(select(mirrored, x, mode == 2u), inset, 1.0 - inset);
}

fn material_uv(m: Material, uv: vec2f) -> vec2f {
    let inset = 0.5 / f32(textureDimensions(textures).x);
    return vec2f(wrapped(uv.x, m.wrap & 3u, inset), wrapped(uv.y, m.wrap >> 2u, inset));
}

// Whether a masked material has a surface at these texture coordinates: the one rule for raster and rays.
fn masked_out(m: Material, uv: vec2f) -> bool {
    if m.cutoff < 0.0 {
        return false;
    }
    var alpha = m.base_color.a;
    if m.texture > 0u {
        alpha *= textureSampleLevel(textures, texture_sampler, material_uv(m, uv), m.texture - 1u, 0.0).a;
    }
    return alpha < m.cutoff;
}

fn hash(x: u32) -> u32 {
    // PCG output function (O'Neill 2014).
    let state = x * 747796405u + 2891336453u;
    let word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
    return (word >> 22u) ^ word;
}
