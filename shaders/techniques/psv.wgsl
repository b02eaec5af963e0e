//!include constants.wgsl
//!include lib/frame.wgsl
//!include lib/gbuffer.wgsl
//!include lib/shadow_ray.wgsl
// Partitioned shadow volumes: a walk down the ternary tree of shadow planes (src/scene/shadow_tree.rs). A plane through the light and
// a triangle's edge is judged by the edge function that the ray test has for that edge, in the same digits: behind a triangle and
// within its three planes is where the shadow ray meets it. Where rounding leaves the side open, both are visited.

var<uniform> params: PsvParams;

struct Tree {
    // The first record, from 1 on; 0: none.
    root: u32,
    padding: vec3u,
}

var<uniform> tree: Tree;
// Two texels a triangle, in the order of the BVH. The nearest to the light that anything below comes, in the metric of `depth_of`, its
// last bit 1 where the triangle turns clockwise around the light; then links to records, from 1 on, 0 for none: what crosses the cap or
// lies before it; what crosses and what lies outside the plane of each edge, opposite to the first, second and third corner.
var records: texture_2d<u32>;
var visibility_out: texture_storage_2d<r32float, write>;
var map_out: texture_storage_2d<r32float, write>;

fn record_texel(i: u32) -> vec4u {
    return textureLoad(records, table_texel(i), 0);
}

// How far from the light a surface lies: metres from a lamp, along the direction of the sun's light.
fn depth_of(position: vec3f) -> f32 {
    if frame.light_kind == directional {
        return -dot(position, frame.light_position);
    }
    return distance(position, frame.light_position);
}

struct Walk {
    blocked: bool,
    // The stack was too small, or the way too long: nothing is known.
    overflowed: bool,
    // Triangles visited, and the most links that waited.
    visits: u32,
    deepest: u32,
}

// Mesa's software driver stops loops after 65535 rounds.
const most_visits = 32768u;

var<private> stack: array<u32, 64>;
var<private> top: u32;

fn push(link: u32) {
    if link != 0u {
        if top < params.max_stack {
            stack[top] = link;
        }
        top++;
    }
}

fn walk(s: Surface, ray: Ray) -> Walk {
    let h = shear_of(ray.direction);
    let depth = depth_of(s.position);
    // The edge functions' sign for a triangle that turns counter-clockwise around the light.
    let sense = sign(h.s.z);
    // The ray starts off the surface and does not quite pass through a lamp: the planes do.
    let size = max(largest(s.position), largest(frame.light_position));
    let aside = select(16.0 * size / length(ray.direction), 0.0, frame.light_kind == directional);
    let off = unit * (16.0 + aside);
    var found = Walk(false, false, 0u, 0u);
    top = 0u;
    var link = tree.root;
    loop {
        if link == 0u {
            if top == 0u {
                break;
            }
            top--;
            link = stack[top];
        }
        let i = link - 1u;
        link = 0u;
        let r = record_texel(2u * i);
        found.visits++;
        if params.prune != 0u && depth < bitcast<f32>(r.x) {
            continue;
        }
        let pa = bitcast<vec3f>(corner_texel(3u * i).xyz) - ray.origin;
        let pb = bitcast<vec3f>(corner_texel(3u * i + 1u).xyz) - ray.origin;
        let pc = bitcast<vec3f>(corner_texel(3u * i + 2u).xyz) - ray.origin;
        let turned = select(sense, -sense, (r.x & 1u) == 1u);
        let e = turned * edges_of(sheared(pa, h), sheared(pb, h), sheared(pc, h));
        let far = vec3f(length(pa), length(pb), length(pc));
        let open = off * far.yzx * far.zxy;
        let r2 = record_texel(2u * i + 1u);
        push(r.z);
        if e.x <= open.x {
            push(r.w);
        }
        if e.x >= -open.x {
            push(r2.x);
            if e.y <= open.y {
                push(r2.y);
            }
            if e.y >= -open.y {
                push(r2.z);
                if e.z <= open.z {
                    push(r2.w);
                }
                if e.z >= -open.z {
                    push(r.y);
                    let candidate = meets(ray, h, i);
                    if candidate.found && !passes(candidate) {
                        found.blocked = true;
                        break;
                    }
                }
            }
        }
        found.deepest = max(found.deepest, top);
        if top > params.max_stack || found.visits >= most_visits {
            found.overflowed = true;
            break;
        }
    }
    return found;
}

@compute @workgroup_size(8, 8)
fn resolve(@builtin(global_invocation_id) id: vec3u) {
    let pixel = banded(id.xy);
    if any(pixel >= frame.size) {
        return;
    }
    let s = load_surface(pixel);
    let light = light_at(s.position);
    var lit = 1.0;
    if s.valid {
        lit = 0.0;
        if may_be_shadowed(s, light) {
            let ray = shadow_ray(s, light);
            let found = walk(s, ray);
            var blocked = found.blocked;
            if found.overflowed {
                let hit = trace(ray);
                tally_ray(hit);
                blocked = hit.blocked;
            }
            lit = select(1.0, 0.0, blocked);
        }
    }
    textureStore(visibility_out, pixel, vec4f(lit));
}

@compute @workgroup_size(8, 8)
fn inspect(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) {
        return;
    }
    let s = load_surface(id.xy);
    var value = -1.0;
    if lit_sample(id.xy).w > 0.0 {
        let found = walk(s, shadow_ray(s, light_at(s.position)));
        value = select(f32(found.visits), f32(found.deepest), frame.map == shows_stack);
    }
    textureStore(map_out, id.xy, vec4f(value));
}
