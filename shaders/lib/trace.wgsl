//!include lib/scene.wgsl
// Shadow rays: any-hit traversal of the BVH with a watertight triangle test.

struct Node {
    low: vec3f,
    // 0: inner node, whose children are `first` and `first + 1`; else a leaf's triangles.
    count: u32,
    high: vec3f,
    first: u32,
}

// A triangle in BVH order.
struct Corners {
    a: vec3f,
    // Shared by exact duplicates.
    surface: u32,
    b: vec3f,
    // Index + 1 if its material is masked, else 0.
    masked: u32,
    c: vec3f,
    triangle: u32,
}

@group(0) @binding(6) var<storage, read> nodes: array<Node>;
@group(0) @binding(7) var<storage, read> corners: array<Corners>;

// What the rays of a frame add up to.
struct Tally {
    gave_up: atomic<u32>,
    rays: atomic<u32>,
    // Set by Rust: rays are counted, which takes time.
    counting: u32,
}

@group(0) @binding(8) var<storage, read_write> tally: Tally;

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

fn hits_triangle(ray: Ray, h: Shear, t: Corners) -> bool {
    let a = sheared(t.a - ray.origin, h);
    let b = sheared(t.b - ray.origin, h);
    let c = sheared(t.c - ray.origin, h);
    let u = edge(c.xy, b.xy);
    let v = edge(a.xy, c.xy);
    let w = edge(b.xy, a.xy);
    if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
        return false;
    }
    let determinant = u + v + w;
    if determinant == 0.0 {
        return false;
    }
    let distance = (u * a.z + v * b.z + w * c.z) / determinant;
    if !(distance > ray.t_min && distance < ray.t_max) {
        return false;
    }
    if !ray.two_sided && dot(cross(t.b - t.a, t.c - t.a), ray.direction) <= 0.0 {
        return false;
    }
    if t.masked > 0u {
        let index = triangles[t.triangle];
        let weights = vec3f(u, v, w) / determinant;
        let uv = weights.x * vertices[index.x].uv + weights.y * vertices[index.y].uv + weights.z * vertices[index.z].uv;
        return !masked_out(materials[t.masked - 1u], uv);
    }
    return true;
}

// The slab test, widened by 3 ulp so that rounding never loses a hit (Ize 2013).
fn enters(ray: Ray, inverse: vec3f, n: Node) -> f32 {
    let t0 = (n.low - ray.origin) * inverse;
    let t1 = (n.high - ray.origin) * inverse;
    let near = min(t0, t1);
    let far = max(t0, t1);
    let first = max(max(near.x, near.y), max(near.z, 0.0));
    let last = min(min(far.x, far.y), min(far.z, ray.t_max)) * 1.0000005;
    return select(-1.0, first, first <= last);
}

fn trace(ray: Ray) -> Hit {
    let h = shear_of(ray.direction);
    // No zero component: 0 * inf would be NaN.
    let tiny = select(vec3f(-1e-30), vec3f(1e-30), ray.direction >= vec3f(0.0));
    let inverse = 1.0 / select(ray.direction, tiny, abs(ray.direction) < vec3f(1e-30));
    var stack: array<u32, 64>;
    var top = 0u;
    var index = 0u;
    var visits = 1u;
    if enters(ray, inverse, nodes[0]) < 0.0 {
        return Hit(false, false, visits);
    }
    loop {
        let node = nodes[index];
        if node.count > 0u {
            for (var i = node.first; i < node.first + node.count; i++) {
                if corners[i].surface != ray.own && hits_triangle(ray, h, corners[i]) {
                    return Hit(true, false, visits);
                }
            }
        } else {
            let left = enters(ray, inverse, nodes[node.first]);
            let right = enters(ray, inverse, nodes[node.first + 1u]);
            visits += 2u;
            if visits > ray.max_visits {
                return Hit(false, true, visits);
            }
            if left >= 0.0 && right >= 0.0 {
                // The nearer child first.
                let swap = u32(right < left);
                if top < 64u {
                    stack[top] = node.first + 1u - swap;
                    top++;
                }
                index = node.first + swap;
                continue;
            }
            if left >= 0.0 || right >= 0.0 {
                index = node.first + u32(right >= 0.0);
                continue;
            }
        }
        if top == 0u {
            break;
        }
        top--;
        index = stack[top];
    }
    return Hit(false, false, visits);
}
