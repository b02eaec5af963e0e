//!include lib/scene.wgsl
// Shadow rays: any-hit traversal of the BVH with a watertight triangle test.

// Texels by number: the BVH's nodes, three each as `Node` in src/scene/bvh.rs, and its triangles, three each: a corner
// in x, y, z; in w the surface id, which exact duplicates share; material + 1 if it is masked, else 0; the index.
var nodes: texture_2d<u32>;
var corners: texture_2d<u32>;

fn node_texel(i: u32) -> vec4u {
    return textureLoad(nodes, table_texel(i), 0);
}

fn corner_texel(i: u32) -> vec4u {
    return textureLoad(corners, table_texel(i), 0);
}

// What the rays of a frame add up to.
struct Tally {
    gave_up: atomic<u32>,
    rays: atomic<u32>,
    // Set by Rust: rays are counted, which takes time.
    counting: u32,
}

var<storage, read_write> tally: Tally;

struct Ray {
    origin: vec3f,
    direction: vec3f,
    // Parameters between which a hit counts, in lengths of `direction`.
    t_min: f32,
    t_max: f32,
    // The surface that the ray starts on: never hit.
    own: u32,
    // Whether a triangle blocks light that arrives at its back.
    two_sided: bool,
    max_visits: u32,
}

struct Hit {
    blocked: bool,
    // It passed `max_visits`, so that nothing is known.
    gave_up: bool,
    // Nodes visited.
    visits: u32,
    // What blocks it: a parameter of the ray, and the triangle. Not the first thing that does.
    t: f32,
    triangle: u32,
}

// Adds a shadow ray that decides visibility to the frame's tally.
fn tally_ray(hit: Hit) {
    if hit.gave_up {
        atomicAdd(&tally.gave_up, 1u);
    }
    if tally.counting != 0u {
        atomicAdd(&tally.rays, 1u);
    }
}

// Twice the signed area of (0, p, q), exactly opposite for (0, q, p) whatever the compiler contracts:
// two triangles that share an edge see the same number, so that no ray slips between them.
fn edge(p: vec2f, q: vec2f) -> f32 {
    let swap = p.x > q.x || (p.x == q.x && p.y > q.y);
    let a = select(p, q, swap);
    let b = select(q, p, swap);
    let area = a.x * b.y - a.y * b.x;
    return select(area, -area, swap);
}

// Woop, Benthin, Wald 2013: the ray is sheared to +z, so that edges are judged in 2D.
struct Shear {
    // Axes of the dominant direction and the two others, keeping the winding.
    k: vec3u,
    s: vec3f,
}

fn shear_of(direction: vec3f) -> Shear {
    let size = abs(direction);
    var k = vec3u(0u, 1u, 2u);
    if size.x > size.y && size.x > size.z {
        k = vec3u(1u, 2u, 0u);
    } else if size.y > size.z {
        k = vec3u(2u, 0u, 1u);
    }
    let d = vec3f(direction[k.x], direction[k.y], direction[k.z]);
    return Shear(k, vec3f(d.x / d.z, d.y / d.z, 1.0 / d.z));
}

fn sheared(p: vec3f, h: Shear) -> vec3f {
    let q = vec3f(p[h.k.x], p[h.k.y], p[h.k.z]);
    return vec3f(q.x - h.s.x * q.z, q.y - h.s.y * q.z, h.s.z * q.z);
}

// On which side of the edges opposite to a, b and c the ray passes, of a sheared triangle.
fn edges_of(a: vec3f, b: vec3f, c: vec3f) -> vec3f {
    return vec3f(edge(c.xy, b.xy), edge(a.xy, c.xy), edge(b.xy, a.xy));
}

// A triangle that the ray hits.
struct Candidate {
    // Else nothing is hit.
    found: bool,
    // Of which the material may leave holes: material + 1, else 0.
    masked: u32,
    triangle: u32,
    // Barycentric.
    weights: vec3f,
    // A parameter of the ray.
    t: f32,
}

// Meets triangle `i` in BVH order.
fn meets(ray: Ray, h: Shear, i: u32) -> Candidate {
    return meets_corners(ray, h, corner_texel(3u * i), corner_texel(3u * i + 1u), corner_texel(3u * i + 2u));
}

// Whether a triangle's plane holds the lamp that a ray ends in, within rounding: seen edge-on it hides nothing, however low the ray
// comes along it.
fn holds_lamp(a: vec3f, b: vec3f, c: vec3f, lamp: vec3f) -> bool {
    let normal = cross(b - a, c - a);
    let size = max(abs(lamp.x), max(abs(lamp.y), abs(lamp.z)));
    let away = lamp - a;
    let rounding = 2.4e-7 * (distance(a, b) * distance(a, c) * length(away) + size * length(normal));
    return abs(dot(normal, away)) <= rounding;
}

fn meets_corners(ray: Ray, h: Shear, ta: vec4u, tb: vec4u, tc: vec4u) -> Candidate {
    let pa = bitcast<vec3f>(ta.xyz);
    let pb = bitcast<vec3f>(tb.xyz);
    let pc = bitcast<vec3f>(tc.xyz);
    let a = sheared(pa - ray.origin, h);
    let b = sheared(pb - ray.origin, h);
    let c = sheared(pc - ray.origin, h);
    let e = edges_of(a, b, c);
    let outside = any(e < vec3f(0.0)) && any(e > vec3f(0.0));
    let determinant = e.x + e.y + e.z;
    let distance = (e.x * a.z + e.y * b.z + e.z * c.z) / determinant;
    let between = distance > ray.t_min && distance < ray.t_max;
    let faces = ray.two_sided || dot(cross(pb - pa, pc - pa), ray.direction) > 0.0;
    var found = ta.w != ray.own && !outside && determinant != 0.0 && between && faces;
    if found && ray.t_max <= 1.0 {
        found = !holds_lamp(pa, pb, pc, ray.origin + ray.direction);
    }
    return Candidate(found, tb.w, tc.w, e / determinant, distance);
}

// Whether the material has a hole where the ray passes.
fn passes(c: Candidate) -> bool {
    if c.masked == 0u {
        return false;
    }
    let index = triangle_at(c.triangle);
    let w = c.weights;
    let place = w.x * texture_place(index.x) + w.y * texture_place(index.y) + w.z * texture_place(index.z);
    return masked_out(materials[c.masked - 1u], place);
}

// Where the ray meets one plane of each of the four children's boxes: the decoded planes are exact, see src/scene/bvh.rs.
fn planes(bytes: u32, origin: f32, scale: f32, at: f32, inverse: f32) -> vec4f {
    return (origin + vec4f(unpack4xU8(bytes)) * scale - at) * inverse;
}

// Which children's boxes the ray enters, a bit each. The slab test, widened by 3 ulp so that rounding never loses a hit
// (Ize 2013).
fn entered(ray: Ray, inverse: vec3f, origin: vec3f, scales: u32, low: vec3u, high: vec3u) -> u32 {
    let scale = bitcast<vec3f>((vec3u(scales, scales >> 8u, scales >> 16u) & vec3u(255u)) << vec3u(23u));
    let turned = inverse < vec3f(0.0);
    let near = select(low, high, turned);
    let far = select(high, low, turned);
    let first = max(
        max(planes(near.x, origin.x, scale.x, ray.origin.x, inverse.x), planes(near.y, origin.y, scale.y, ray.origin.y, inverse.y)),
        max(planes(near.z, origin.z, scale.z, ray.origin.z, inverse.z), vec4f(0.0)));
    let last = min(
        min(planes(far.x, origin.x, scale.x, ray.origin.x, inverse.x), planes(far.y, origin.y, scale.y, ray.origin.y, inverse.y)),
        min(planes(far.z, origin.z, scale.z, ray.origin.z, inverse.z), vec4f(ray.t_max))) * 1.0000005;
    let hit = select(vec4u(0u), vec4u(1u, 2u, 4u, 8u), first <= last);
    return hit.x | hit.y | hit.z | hit.w;
}

// Nodes and triangles in turns, each as long as one of the threads that run together has some: what is masked waits
// until all have found a candidate.
fn trace(ray: Ray) -> Hit {
    let h = shear_of(ray.direction);
    // No zero component: 0 * inf would be NaN.
    let tiny = select(vec3f(-1e-30), vec3f(1e-30), ray.direction >= vec3f(0.0));
    let inverse = 1.0 / select(ray.direction, tiny, abs(ray.direction) < vec3f(1e-30));
    // Inner nodes that lie side by side: the first × 16, and a bit for each that is to be visited.
    var stack: array<u32, 64>;
    var top = 0u;
    var inner = 1u;
    // Triangles that lie side by side: the first, and a bit for each that is to be tested.
    var first = 0u;
    var leaves = 0u;
    var visits = 0u;
    loop {
        var candidate = Candidate(false, 0u, 0u, vec3f(0.0), 0.0);
        loop {
            while leaves == 0u && visits <= ray.max_visits {
                if (inner & 15u) == 0u {
                    if top == 0u {
                        break;
                    }
                    top--;
                    inner = stack[top];
                }
                let at = 3u * ((inner >> 4u) + firstTrailingBit(inner));
                inner &= inner - 1u;
                if (inner & 15u) != 0u && top < 64u {
                    stack[top] = inner;
                    top++;
                }
                let a = node_texel(at);
                let b = node_texel(at + 1u);
                let c = node_texel(at + 2u);
                visits++;
                let hits = entered(ray, inverse, bitcast<vec3f>(a.xyz), a.w, vec3u(b.zw, c.x), c.yzw);
                inner = ((b.x >> 3u) << 4u) | (hits & ((1u << (b.x & 7u)) - 1u));
                first = b.y;
                // Each leaf's triangles behind those of the leaves before it.
                let count = (vec4u(a.w) >> vec4u(24u, 26u, 28u, 30u)) & vec4u(3u);
                let before = vec4u(0u, count.x, count.x + count.y, count.x + count.y + count.z);
                let bits = select(vec4u(0u), ((vec4u(1u) << count) - 1u) << before, (vec4u(hits) & vec4u(1u, 2u, 4u, 8u)) != vec4u(0u));
                leaves = bits.x | bits.y | bits.z | bits.w;
            }
            if leaves == 0u || visits > ray.max_visits {
                break;
            }
            while leaves != 0u && !candidate.found {
                candidate = meets(ray, h, first + firstTrailingBit(leaves));
                leaves &= leaves - 1u;
            }
            if candidate.found {
                break;
            }
        }
        if visits > ray.max_visits {
            return Hit(false, true, visits, 0.0, 0u);
        }
        if !candidate.found {
            return Hit(false, false, visits, 0.0, 0u);
        }
        if !passes(candidate) {
            return Hit(true, false, visits, candidate.t, candidate.triangle);
        }
    }
    return Hit(false, false, visits, 0.0, 0u);
}

// What the ray meets first.
fn nearest(ray: Ray) -> Hit {
    var shorter = ray;
    var found = Hit(false, false, 0u, 0.0, 0u);
    loop {
        let next = trace(shorter);
        if !next.blocked {
            return found;
        }
        found = next;
        shorter.t_max = next.t;
    }
    return found;
}
