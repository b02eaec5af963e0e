//!include lib/listed.wgsl
//!include lib/shadow_ray.wgsl
//!include lib/labels.wgsl
//!include lib/cells.wgsl
//!include lib/analysis.wgsl
//!include map/view_of.wgsl
// Conservative shadow maps (Hertel, Hormann, Westermann 2009; Morais 2015): what the grown map leaves lit is lit, what the shrunk map
// shadows is in shadow, the rest asks a ray.

var<uniform> conservative: ConservativeParams;
var<uniform> deciding: DecidingParams;
// Grown casters of closed bodies, grown others, shrunk ones; of each face.
var maps: texture_depth_2d_array;
// See map/conservative.wgsl.
var<storage, read> own_planes: array<vec4f>;
var<storage, read> gathered: array<u32>;
var visibility_out: texture_storage_2d<r32float, write>;
var map_out: texture_storage_2d<r32float, write>;

struct Answers {
    // What the grown map says alone, and the shrunk one.
    grown_lit: bool,
    shrunk_lit: bool,
    // Parameter of the shadow ray where it reaches the nearest depth of any grown caster.
    end: f32,
}

// Rounding of depths, metres.
fn spare_depth(v: LightView, s: Surface) -> f32 {
    return 2e-6 * max(v.far, largest(s.position));
}

fn answers(s: Surface, light: LightSample) -> Answers {
    let face = view_of(s.position);
    let v = light_views[face];
    let at = light_texel(v, light_clip(v, s.position));
    // Words of each face: see `Gathered`.
    if any(at < vec2f(0.0)) || any(at >= vec2f(v.resolution)) || gathered[12u * face + 2u] > 0u {
        return Answers(false, true, 3.4e38);
    }
    let texel = vec2u(at);
    let closed = textureLoad(maps, texel, 3u * face, 0);
    let others = textureLoad(maps, texel, 3u * face + 1u, 0);
    let shrunk = textureLoad(maps, texel, 3u * face + 2u, 0);
    let z = depth_in(v, s.position);
    let spare = spare_depth(v, s);
    // Depth is reversed, and 0 where nothing is.
    let far = linear_depth(v, max(closed, others));
    // What is stored as 1 may be nearer to the light than the map begins.
    var grown_lit = closed <= 0.0 || (closed < 1.0 && linear_depth(v, closed) > z + spare);
    var compared = z + spare;
    if conservative.self_plane != 0u {
        let own = own_planes[face * (arrayLength(&own_planes) / select(1u, 6u, lights_around())) + s.triangle];
        // The nearest that its own plane is in this texel: as the grown map has it. What lies between is taken for the surface itself.
        let half = select(0.0, 0.52 + 2e-6 * v.resolution, conservative.safe_depth != 0u);
        let nearest = stored_depth(v, z) + dot(own.xy, vec2f(texel) + 0.5 - at) + half * (abs(own.x) + abs(own.y));
        compared = select(compared, linear_depth(v, saturate(min(nearest, own.z))) - spare, own.w > 0.0);
    }
    grown_lit = grown_lit && (others <= 0.0 || (others < 1.0 && linear_depth(v, others) > compared));
    let shrunk_lit = shrunk <= 0.0 || linear_depth(v, shrunk) >= z - spare;
    // Depth falls along the ray by this share of `light.to_light`; a lamp's from z to 0.
    let fall = select(z, 1.0, frame.light_kind == directional);
    let ends = conservative.safe_depth != 0u && conservative.eta >= 1.0 && max(closed, others) < 1.0;
    return Answers(grown_lit, shrunk_lit, select(3.4e38, (z - far + spare) / fall, ends));
}

@compute @workgroup_size(8, 8)
fn resolve(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= frame.size.x || id.y >= frame.size.y {
        return;
    }
    let s = load_surface(id.xy);
    let light = light_at(s.position);
    var v = select(1.0, 0.0, s.valid);
    if may_be_shadowed(s, light) {
        let a = answers(s, light);
        let lit = select(a.grown_lit, a.shrunk_lit, deciding.rays == 0u && deciding.uses == uses_shrunk);
        v = select(0.0, 1.0, lit);
        if deciding.rays != 0u && !a.grown_lit && a.shrunk_lit {
            list_ray(id.xy, a.end);
        }
    }
    textureStore(visibility_out, id.xy, vec4f(v));
}

// The classes of the view `certainty`, and those of the errors of either map alone, as labels.
const certainly_lit = 1u;
const certainly_shadowed = 7u;
const ends_lit = 2u;
const ends_shadowed = 4u;
const at_odds = 0u;

fn inspect_at(pixel: vec2u) -> f32 {
    let s = load_surface(pixel);
    let light = light_at(s.position);
    if frame.map == shows_texels {
        let v = light_views[view_of(s.position)];
        let at = light_texel(v, light_clip(v, s.position));
        let inside = s.valid && all(at >= vec2f(0.0)) && all(at < vec2f(v.resolution));
        return select(-1.0, cell_value(vec2u(max(at, vec2f(0.0)))), inside);
    }
    if !may_be_shadowed(s, light) {
        return -1.0;
    }
    let a = answers(s, light);
    if a.grown_lit && !a.shrunk_lit {
        return label(at_odds, 1.0);
    }
    if a.grown_lit || !a.shrunk_lit {
        let certain = frame.map == shows_certainty;
        return select(-1.0, label(select(certainly_shadowed, certainly_lit, a.grown_lit), 0.25), certain);
    }
    var ray = shadow_ray(s, light);
    ray.t_max = min(ray.t_max, a.end);
    let blocked = trace(ray).blocked;
    if frame.map == shows_grown_errors {
        return select(label(0u, 1.0), -1.0, blocked);
    }
    if frame.map == shows_shrunk_errors {
        return select(-1.0, label(4u, 1.0), blocked);
    }
    return label(select(ends_lit, ends_shadowed, blocked), 0.8);
}

@compute @workgroup_size(8, 8)
fn inspect(@builtin(global_invocation_id) id: vec3u) {
    if id.x < frame.size.x && id.y < frame.size.y {
        textureStore(map_out, id.xy, vec4f(inspect_at(id.xy)));
    }
}

fn place(s: Surface, dx: vec3f, dy: vec3f) -> Place {
    let face = view_of(s.position);
    let v = light_views[face];
    let clip = light_clip(v, s.position);
    // On the map's very edge, whatever the rounding, the map.
    let at = light_texel(v, clip);
    let inner = select(min(at, vec2f(v.resolution - 0.01)), vec2f(-1.0), any(at > vec2f(v.resolution + 0.02)));
    return Place(inner, face, along(v, dx, clip).xy, along(v, dy, clip).xy);
}
