//!include lib/trace.wgsl
//!include lib/labels.wgsl
//!include lib/squares.wgsl
//!include techniques/imperfect_sm/tiles.wgsl
// Light that surfaces throw back once: virtual point lights (VPLs; Keller 1997), each with an imperfect shadow map (Ritschel
// et al. 2008).

var<uniform> vpl: ImperfectSmParams;

// A surface patch that the light shines on, taken for a point that shines.
struct Vpl {
    position: vec3f,
    // Its area over π, square metres: the squared radius of a disc as large.
    size: f32,
    // Towards the side that is lit.
    normal: vec3f,
    // Of a candidate: how likely it is chosen, up to a factor.
    weight: f32,
    // Power that it throws back, irradiance × square metres.
    flux: vec3f,
    padding: f32,
}

const most_vpls = 1024u;

struct Vpls {
    all: array<Vpl, most_vpls>,
}

var<uniform> vpls: Vpls;
var<storage, read_write> candidates: array<Vpl>;
// `vpls`, to be written.
var<storage, read_write> chosen: array<Vpl>;

const pi = 3.1415927;

fn luminance(color: vec3f) -> f32 {
    return dot(color, vec3f(0.2126, 0.7152, 0.0722));
}

// Points of the R2 sequence in the unit square (Roberts 2018), shifted by the seed; in whole numbers, so that late points are
// as fine as early ones.
fn sequence(i: u32, salt: u32) -> vec2f {
    let shift = hash(frame.seed ^ salt);
    let at = vec2u(shift, hash(shift)) + i * vec2u(3242174889u, 2447445414u);
    return vec2f(at >> vec2u(8u)) / 16777216.0;
}

// Two unit vectors at right angles to a unit vector and to each other (Duff et al. 2017).
fn tangents(n: vec3f) -> mat2x3f {
    let s = select(-1.0, 1.0, n.z >= 0.0);
    let a = -1.0 / (s + n.z);
    let b = n.x * n.y * a;
    return mat2x3f(vec3f(1.0 + s * n.x * n.x * a, s * b, -s * n.x), vec3f(b, s + n.y * n.y * a, -n.y));
}

// A ray of the light.
struct LightRay {
    origin: vec3f,
    direction: vec3f,
    reach: f32,
    // Irradiance that it stands for: where light spreads, at a distance of 1.
    irradiance: vec3f,
    // One over its density: square metres across the light, or steradians.
    beam: f32,
}

// Points of the picture that rays are aimed at.
const aims = 256u;

// One of them: position, and how far from it other surfaces may light it noticeably, metres; 0: there is none.
fn aim(k: u32) -> vec4f {
    let p = textureLoad(g_position, picture_pixel(k), 0);
    return vec4f(p.xyz, 0.5 * p.w);
}

fn picture_pixel(k: u32) -> vec2u {
    return min(vec2u(sequence(k, 2u) * vec2f(frame.size)), frame.size - 1u);
}

// Cosine of half the cone's angle in which a lamp's rays are aimed at what lies `far` metres from it.
fn aim_cosine(reach: f32, far: f32) -> f32 {
    return far * inverseSqrt(reach * reach + far * far + 1e-20);
}

// Every fourth ray is drawn from the whole light, the others around points of the picture: across the sun's light from
// a square, of a lamp's light from a cone. Each stands for as much light as its kind is rare there, so that any mixture gives
// the same light in the mean.
fn light_ray(i: u32) -> LightRay {
    let at = sequence(i, 1u);
    let axes = tangents(frame.light_axis);
    let pick = hash(i ^ hash(frame.seed ^ 5u));
    let aimed = aim(pick & (aims - 1u));
    let whole = vpl.placing == placing_light || (i & 3u) == 0u || aimed.w == 0.0;
    let count = vpl.vpls * vpl.candidates;
    let share = select(1.0 - f32((count + 3u) / 4u) / f32(count), 0.0, vpl.placing == placing_light);
    if frame.light_kind == directional {
        // The whole is the rectangle around the scene.
        let middle = 0.5 * (frame.bounds_max + frame.bounds_min);
        let half = 0.5 * (frame.bounds_max - frame.bounds_min);
        let sides = vec2f(dot(half, abs(axes[0])), dot(half, abs(axes[1])));
        let back = 1.001 * dot(half, abs(frame.light_axis));
        let place = select((aimed.xyz - middle) * axes + aimed.w * (2.0 * at - 1.0), sides * (2.0 * at - 1.0), whole);
        let even = select(0.0, 0.25 / (sides.x * sides.y), all(abs(place) <= sides));
        var density = 0.0;
        if share > 0.0 {
            for (var k = 0u; k < aims; k++) {
                let other = aim(k);
                let off = abs((other.xyz - middle) * axes - place);
                let square = select(0.0, 0.25 / max(other.w * other.w, 1e-20), max(off.x, off.y) <= other.w);
                density += select(square, even, other.w == 0.0) / f32(aims);
            }
        }
        let origin = middle + axes * place - back * frame.light_axis;
        let beam = 1.0 / (share * density + (1.0 - share) * even);
        return LightRay(origin, frame.light_axis, 3.4e38, frame.light_color, beam);
    }
    let lowest = select(select(-1.0, 0.0, frame.light_kind == hemisphere), frame.light_cosine, frame.light_kind == spot);
    var cosine = 1.0 - at.x * (1.0 - lowest);
    var around = frame.light_axis;
    if !whole {
        let there = aimed.xyz - frame.light_position;
        let far = length(there);
        around = select(frame.light_axis, there / max(far, 1e-20), far > 0.0);
        cosine = 1.0 - at.x * (1.0 - aim_cosine(aimed.w, far));
    }
    let beside = tangents(around);
    let sine = sqrt(max(1.0 - cosine * cosine, 0.0));
    let angle = 2.0 * pi * at.y;
    let direction = sine * (cos(angle) * beside[0] + sin(angle) * beside[1]) + cosine * around;
    let along = dot(direction, frame.light_axis);
    let even = select(0.0, 1.0 / (2.0 * pi * (1.0 - lowest)), along >= lowest);
    var density = 0.0;
    if share > 0.0 {
        for (var k = 0u; k < aims; k++) {
            let other = aim(k);
            let there = other.xyz - frame.light_position;
            let far = length(there);
            let least = aim_cosine(other.w, far);
            let cone = select(0.0, 1.0 / max(2.0 * pi * (1.0 - least), 1e-9), dot(direction, there) >= least * far);
            density += select(cone, even, other.w == 0.0) / f32(aims);
        }
    }
    let falloff = select(1.0, max(along, 0.0), frame.light_kind == hemisphere);
    let irradiance = select(vec3f(0.0), frame.light_color * falloff, along >= lowest);
    let beam = 1.0 / max(share * density + (1.0 - share) * even, 1e-20);
    return LightRay(frame.light_position, direction, frame.light_range, irradiance, beam);
}

// How far rounding may have put a position off its surface.
fn rounding(position: vec3f) -> f32 {
    return 8.0 * unit * max(abs(position.x), max(abs(position.y), abs(position.z)));
}

// Pixels of the picture that are tried for each candidate.
const tried = 64u;

// How brightly a candidate shines on eight pixels of the picture in the mean, and with a small share wherever else it stands
// and whatever is in the way: none is left out, as eight pixels may miss the one that it shines on, or all be of the sky. More than
// eight are tried where some are.
fn brightness(light: Vpl, first: u32) -> f32 {
    let across = frame.bounds_max - frame.bounds_min;
    var sum = 0.0;
    var found = 0u;
    for (var k = 0u; k < tried && found < 8u; k++) {
        let s = load_surface(picture_pixel(first + k));
        if s.valid {
            let bright = luminance(given(light, s));
            var seen = 0.0;
            if bright > 0.0 {
                seen = select(0.0, 1.0, seen_by_ray(s, light));
            }
            let there = light.position - s.position;
            sum += seen * bright + 0.005 * luminance(light.flux) / (pi * max(dot(there, there), light.size));
            found++;
        }
    }
    let least = 0.005 * luminance(light.flux) / (pi * max(dot(across, across), light.size));
    return sum / f32(max(found, 1u)) + least;
}

// A thread for each candidate: where its ray meets the scene first.
@compute @workgroup_size(64)
fn shoot(@builtin(global_invocation_id) id: vec3u) {
    let count = vpl.vpls * vpl.candidates;
    if id.x >= count {
        return;
    }
    let ray = light_ray(id.x);
    let hit = nearest(Ray(ray.origin, ray.direction, 0.0, ray.reach, 0xffffffffu, true, 65536u));
    candidates[id.x] = Vpl(vec3f(0.0), 0.0, vec3f(0.0), 0.0, vec3f(0.0), 0.0);
    if !hit.blocked {
        return;
    }
    let index = triangle_at(hit.triangle);
    let a = vertex_at(index.x);
    let b = vertex_at(index.y);
    let c = vertex_at(index.z);
    let ab = b.position - a.position;
    let ac = c.position - a.position;
    let area = cross(ab, ac);
    // Its place in the triangle, and from that the position, which is finer than a far ray's.
    let off = ray.origin + hit.t * ray.direction - a.position;
    let y = dot(cross(off, ac), area) / dot(area, area);
    let z = dot(cross(ab, off), area) / dot(area, area);
    let front = dot(area, ray.direction) < 0.0;
    let normal = select(-1.0, 1.0, front) * normalize(area);
    let flat = a.position + y * ab + z * ac;
    let position = flat + rounding(flat) * normal;
    let m = materials[a.material];
    let paint = (1.0 - y - z) * taken_off(a.color) + y * taken_off(b.color) + z * taken_off(c.color);
    var albedo = m.base_color.rgb * (1.0 - paint.rgb);
    if m.texture > 0u {
        let uv = (1.0 - y - z) * a.uv + y * b.uv + z * c.uv;
        // Coarse: it stands for a patch.
        albedo *= texture_at_level(m, uv, 3.0).rgb;
    }
    let spread = select(hit.t * hit.t, 1.0, frame.light_kind == directional);
    let beam = ray.beam / f32(count);
    let size = beam * spread / (pi * max(-dot(normal, ray.direction), 0.05));
    let flux = albedo * ray.irradiance * beam;
    var light = Vpl(position, size, normal, luminance(flux), flux, 0.0);
    if vpl.placing == placing_view && light.weight > 0.0 {
        light.weight = brightness(light, tried * id.x);
    }
    candidates[id.x] = light;
}

var<workgroup> sums: array<f32, 256>;

// Draws lights from the candidates in proportion to their weights, at equal steps along the sum of these (systematic
// resampling), and makes each as much brighter as it was unlikely.
@compute @workgroup_size(256)
fn choose_lights(@builtin(local_invocation_index) thread: u32) {
    let count = vpl.vpls * vpl.candidates;
    let each = (count + 255u) / 256u;
    let first = thread * each;
    var sum = 0.0;
    for (var i = first; i < min(first + each, count); i++) {
        sum += candidates[i].weight;
    }
    sums[thread] = sum;
    workgroupBarrier();
    if thread == 0u {
        for (var i = 1u; i < 256u; i++) {
            sums[i] += sums[i - 1u];
        }
    }
    workgroupBarrier();
    let whole = sums[255];
    let jitter = f32(hash(frame.seed ^ 3u) >> 8u) / 16777216.0;
    for (var i = thread; i < vpl.vpls; i += 256u) {
        let at = (f32(i) + jitter) / f32(vpl.vpls) * whole;
        var part = 0u;
        while part < 255u && sums[part] <= at {
            part++;
        }
        var before = 0.0;
        if part > 0u {
            before = sums[part - 1u];
        }
        // The last that has any weight, where rounding leaves none.
        var found = count;
        for (var k = part * each; k < min((part + 1u) * each, count); k++) {
            let weight = candidates[k].weight;
            if weight > 0.0 && (found == count || before <= at) {
                found = k;
            }
            before += weight;
        }
        var light = Vpl(vec3f(0.0), 0.0, vec3f(0.0, 1.0, 0.0), 0.0, vec3f(0.0), 0.0);
        if found < count {
            light = candidates[found];
            let times = whole / (f32(vpl.vpls) * light.weight);
            light.flux *= times;
            light.size *= times;
        }
        chosen[i] = light;
    }
}

// What a VPL gives a surface, before anything is in the way: irradiance, and 0 where one of the two faces away.
fn given(light: Vpl, s: Surface) -> vec3f {
    let there = light.position - s.position;
    let distance2 = max(dot(there, there), 1e-12);
    let direction = there * inverseSqrt(distance2);
    let faces = dot(s.normal, there) > 0.0;
    let cosines = max(dot(s.shading_normal, direction), 0.0) * max(-dot(light.normal, direction), 0.0);
    return select(vec3f(0.0), light.flux * (cosines / (pi * max(distance2, vpl.clamp * light.size))), faces);
}

// How the gather asks what is in the way: 0 not at all, 1 in the tiles, 2 by rays.
override asks: u32 = 1u;

fn seen_by_ray(s: Surface, light: Vpl) -> bool {
    let origin = s.position + rounding(s.position) * s.normal;
    return !trace(Ray(origin, light.position - origin, 0.0, 0.9999, triangle_at(s.triangle).w, true, 65536u)).blocked;
}

var indirect_out: texture_storage_2d<rgba16float, write>;
var indirect: texture_2d<f32>;

// Each pixel's irradiance by all VPLs, and the share of their light that nothing is in the way of.
@compute @workgroup_size(8, 8)
fn gather(@builtin(global_invocation_id) id: vec3u) {
    let pixel = banded(id.xy);
    if any(pixel >= frame.size) {
        return;
    }
    let s = load_surface(pixel);
    var sum = vec3f(0.0);
    var all = 0.0;
    if s.valid {
        for (var i = 0u; i < vpl.vpls; i++) {
            let light = vpls.all[i];
            let by = given(light, s);
            let bright = luminance(by);
            if bright > 0.0 {
                var seen = true;
                if asks == 1u {
                    seen = seen_in_tile(s, light.position, light.normal, i);
                } else if asks == 2u {
                    seen = seen_by_ray(s, light);
                }
                sum += select(vec3f(0.0), by, seen);
                all += bright;
            }
        }
    }
    let share = select(1.0, luminance(sum) / all, all > 0.0);
    textureStore(indirect_out, pixel, vec4f(sum, share));
}

// The views.

// The VPLs as dots over the scene: full where the camera sees them, faint behind surfaces.
fn dots(s: Surface) -> f32 {
    let radius = max(2.5, f32(frame.size.y) / 240.0);
    var strength = 0.0;
    var hidden = 0.0;
    for (var i = 0u; i < vpl.vpls; i++) {
        let light = vpls.all[i];
        let clip = frame.view_proj * vec4f(light.position, 1.0);
        if clip.w <= 0.0 || luminance(light.flux) <= 0.0 {
            continue;
        }
        let at = (vec2f(0.5, -0.5) * clip.xy / clip.w + 0.5) * vec2f(frame.size);
        let cover = saturate(radius + 0.5 - distance(at, vec2f(s.pixel) + 0.5));
        let behind = s.valid && dot(light.position - frame.eye, frame.forward) > s.depth + 0.01 * distance_at(s.depth);
        strength = max(strength, select(cover, 0.0, behind));
        hidden = max(hidden, select(0.0, cover, behind));
    }
    let color = select(4u, 1u, strength > 0.0);
    return label(color, max(strength, 0.45 * hidden));
}

// The VPL that gives the probed pixel most.
fn probed_light() -> u32 {
    let s = load_surface(probed_pixel());
    var best = 0u;
    var most = 0.0;
    if s.valid {
        for (var i = 0u; i < vpl.vpls; i++) {
            let bright = luminance(given(vpls.all[i], s));
            if bright > most {
                best = i;
                most = bright;
            }
        }
    }
    return best;
}

fn inspect_map(s: Surface) -> f32 {
    switch frame.map {
        case shows_indirect: {
            return select(-1.0, luminance(textureLoad(indirect, s.pixel, 0).rgb), s.valid);
        }
        case shows_vpl_visibility: {
            return select(-1.0, textureLoad(indirect, s.pixel, 0).a, s.valid);
        }
        case shows_vpls: {
            return dots(s);
        }
        case shows_tiles_before: {
            return all_tiles(s.pixel, false);
        }
        case shows_tiles: {
            return all_tiles(s.pixel, true);
        }
        case shows_tile: {
            return one_tile(s.pixel, probed_light());
        }
        default: {
            return inspect_filter(s);
        }
    }
}
