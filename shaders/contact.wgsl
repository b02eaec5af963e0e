//!include constants.wgsl
//!include lib/frame.wgsl
//!include lib/gbuffer.wgsl
// Contact shadows: the light is hidden where the picture itself shows something near a surface, on the way to the light.

var<uniform> contact: ContactParams;
var visibility_before: texture_2d<f32>;
var visibility_out: texture_storage_2d<r32float, write>;
var map_out: texture_storage_2d<r32float, write>;

// Writes a pixel's visibility; `seen` is what the contact shadows let through, `reach` how far away in the picture what hides the
// light was found, pixels, negative where nothing was.
fn settle(pixel: vec2u, seen: f32, reach: f32) {
    let before = textureLoad(visibility_before, pixel, 0).x;
    textureStore(visibility_out, pixel, vec4f(min(before, seen)));
    if frame.map == shows_contact_visibility {
        textureStore(map_out, pixel, vec4f(seen));
    } else if frame.map == shows_contact_distance {
        textureStore(map_out, pixel, vec4f(reach));
    } else if frame.map == shows_contact_hits || frame.map == shows_contact_gain {
        // 1: they darken it. 2: the technique alone has it lit.
        textureStore(map_out, pixel, vec4f(select(0.0, 1.0, seen < 0.5) + select(0.0, 2.0, before >= 0.5)));
    }
}

fn inside(pixel: vec2i) -> bool {
    return all(pixel >= vec2i(0)) && all(pixel < vec2i(frame.size));
}

// Place in the picture, pixels from its upper left corner, of a point relative to the eye, and what is even there along a line: 1 over
// the depth, or an orthographic picture's depth.
fn seen_at(p: vec3f) -> vec3f {
    let clip = frame.eye_proj * vec4f(p, 1.0);
    let ndc = clip.xy / clip.w;
    let even = select(1.0 / clip.w, dot(p, frame.forward), frame.orthographic == 1u);
    return vec3f((vec2f(0.5) + vec2f(0.5, -0.5) * ndc) * vec2f(frame.size), even);
}

// The direction to the light, turned towards the normal where it grazes the surface.
fn lifted(to_light: vec3f, normal: vec3f) -> vec3f {
    let cosine = dot(to_light, normal);
    let tilt = radians(contact.contact_tilt) * (1.0 - smoothstep(0.25, 0.45, cosine));
    let aside = to_light - cosine * normal;
    if tilt == 0.0 || dot(aside, aside) < 1e-10 {
        return to_light;
    }
    let angle = max(acos(clamp(cosine, -1.0, 1.0)) - tilt, 0.0);
    return cos(angle) * normal + sin(angle) * normalize(aside);
}

// A march along the ray to the light in steps that are even in the picture. What lies between the ray and the camera, but no
// farther from the ray than the thickness, hides the light.
@compute @workgroup_size(8, 8)
fn march(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) {
        return;
    }
    let p = lit_sample(id.xy);
    if p.w == 0.0 {
        settle(id.xy, 1.0, -1.0);
        return;
    }
    let normal = g_normal(textureLoad(g_surface, id.xy, 0));
    let to_light = light_at(p.xyz).to_light;
    let distance_to_light = length(to_light);
    // A pixel's width at the surface.
    let width = pixel_at(p.w);
    let start = p.xyz - frame.eye + contact.contact_bias * width * normal;
    let reach = min(contact.contact_length, select(distance_to_light, 3.4e38, frame.light_kind == directional));
    var end = start + reach * lifted(to_light / distance_to_light, normal);
    let depths = vec2f(dot(start, frame.forward), dot(end, frame.forward));
    if depths.x <= frame.near {
        settle(id.xy, 1.0, -1.0);
        return;
    }
    // Of a ray that leaves through the near plane, the share in front of that.
    var share = 1.0;
    if depths.y < frame.near {
        share = (depths.x - frame.near) / (depths.x - depths.y);
        end = mix(start, end, share);
    }
    let first = seen_at(start);
    let last = seen_at(end);
    var offset = 0.5;
    if contact.contact_jitter == contact_jitter_ign {
        // Interleaved gradient noise (Jimenez 2014).
        let at = vec2f(id.xy) + 5.588238 * f32(frame.seed % 64u);
        offset = fract(52.9829189 * fract(dot(at, vec2f(0.06711056, 0.00583715))));
    }
    let steps = contact.contact_steps;
    for (var k = 0u; k < steps; k++) {
        let t = (f32(k) + offset) / f32(steps);
        let at = mix(first, last, t);
        let pixel = vec2i(floor(at.xy));
        if !inside(pixel) || all(pixel == vec2i(id.xy)) {
            continue;
        }
        let depth = textureLoad(g_position, pixel, 0).w;
        let behind = select(1.0 / at.z, at.z, frame.orthographic == 1u) - depth;
        // What rounding leaves of nothing is no hit.
        if depth == 0.0 || behind <= 1e-5 * depth || behind >= contact.contact_depth {
            continue;
        }
        // 1 over the depth is even in the picture, and the ray's length is not.
        let along = share * t * select(last.z / at.z, 1.0, frame.orthographic == 1u);
        let fading = saturate((along - contact.contact_fade) / max(1.0 - contact.contact_fade, 1e-6));
        let size = vec2f(frame.size);
        let edge = min(min(at.x, size.x - at.x), min(at.y, size.y - at.y));
        let border = contact.contact_border * min(size.x, size.y);
        let strength = (1.0 - fading * fading * (3.0 - 2.0 * fading)) * saturate(edge / max(border, 1e-6));
        settle(id.xy, 1.0 - strength, select(-1.0, distance(at.xy, first.xy), strength > 0.0));
        return;
    }
    settle(id.xy, 1.0, -1.0);
}

// Darkens nothing.
@compute @workgroup_size(8, 8)
fn pass_by(@builtin(global_invocation_id) id: vec3u) {
    if all(id.xy < frame.size) {
        settle(id.xy, 1.0, -1.0);
    }
}

// How the picture is cut up for the sweep: wedges around the light's pixel, and in each bands of 64 pixels along its axis. A
// workgroup takes the pixels of a band on one line through the light's pixel; in the picture all rays to the light run on
// such lines. The struct stands in src/contact.rs too.
struct Sweep {
    light: vec2i,
    // 1 over the light's depth; 0 of the sun.
    light_depth: f32,
    // 1: rays run towards the light's pixel. -1: away from it, as the light is behind the camera.
    towards: i32,
    // Wedge (1: along y; 2: on the side of lower numbers), distance of the farthest pixels from the light along the wedge's
    // axis, the first line, counted from the light at that distance, and how many there are.
    bands: array<vec4i, 544>,
}

var<uniform> cut: Sweep;

const lanes = 64u;
// More than four bands' worth of samples are never looked at.
const most_places = 384u;
// What hides nothing.
const nothing = -1e30;

// What stands along a line: 1 over the depth, as it hides the light.
var<workgroup> casters: array<f32, most_places>;

// A place on a line: its distance from the light along the wedge's axis, the pixel that it lies in, counted from the light
// across the axis, and how far from the pixel's middle it lies there.
struct Place {
    distance: i32,
    row: i32,
    off: f32,
}

fn place_on(line: i32, far: i32, distance: i32) -> Place {
    // From the band's far end, where lines are a pixel apart: at no step do they leave one out nearer to the light.
    let moved = f32(line) / f32(far) * f32(far - distance);
    let rounded = floor(moved + 0.5);
    return Place(distance, line - i32(rounded), rounded - moved);
}

fn pixel_of(place: Place, wedge: i32) -> vec2i {
    let along = select(place.distance, -place.distance, (wedge & 2) != 0);
    return cut.light + select(vec2i(along, place.row), vec2i(place.row, along), (wedge & 1) != 0);
}

// Lines meet near the light: of those that share a pixel the one nearest to its middle draws it, of two the first.
fn draws(line: i32, far: i32, here: Place) -> bool {
    let before = place_on(line - 1, far, here.distance);
    let after = place_on(line + 1, far, here.distance);
    return (before.row != here.row || abs(before.off) > abs(here.off))
        && (after.row != here.row || abs(after.off) >= abs(here.off));
}

// 1 over the depth; 0 where nothing is.
fn nearness(pixel: vec2i) -> f32 {
    if !inside(pixel) {
        return 0.0;
    }
    let depth = textureLoad(g_position, pixel, 0).w;
    return select(0.0, 1.0 / depth, depth > 0.0);
}

// Aldridge (Bend Studio) 2023: the threads share what they read, as their rays lie on one line.
@compute @workgroup_size(64)
fn sweep(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    let band = cut.bands[group.y];
    if i32(group.x) >= band.w {
        return;
    }
    let wedge = band.x;
    let far = band.y;
    let line = band.z + i32(group.x);
    let samples = contact.contact_pixels;
    let across = select(vec2i(0, 1), vec2i(1, 0), (wedge & 1) != 0);
    var here: Place;
    var own = 0.0;
    for (var k = 0u; k < samples / lanes + 2u; k++) {
        let step = i32(lane + k * lanes);
        let place = place_on(line, far, select(far - i32(lanes) + 1 + step, far - step, cut.towards == 1));
        let pixel = pixel_of(place, wedge);
        let near = nearness(pixel);
        if k == 0u {
            here = place;
            own = near;
        }
        var caster = nothing;
        if near > 0.0 && place.distance > 0 {
            // Between the two pixels that the line runs through, but not across an edge; and as far behind as they are apart,
            // so that a surface never hides the light from itself.
            let next = select(-across, across, place.off > 0.0);
            let beside = nearness(pixel + next);
            let apart = abs(near - beside);
            caster = mix(near, beside, abs(place.off)) - apart;
            if beside == 0.0 || apart > contact.contact_edge * near {
                // A plane that is seen at a grazing angle is no edge: it goes on to the other side.
                let other = nearness(pixel - next);
                if beside == 0.0 {
                    caster = near - select(0.0, abs(near - other), other > 0.0);
                } else if other > 0.0 && abs(near - beside + near - other) > 0.25 * apart {
                    caster = near;
                }
            }
        }
        casters[step] = caster;
    }
    workgroupBarrier();

    let pixel = pixel_of(here, wedge);
    // Each pixel belongs to one wedge.
    let most = select(here.distance, here.distance - 1, (wedge & 1) != 0);
    if !inside(pixel) || abs(here.row) > most || !draws(line, far, here) {
        return;
    }
    if here.distance == 0 || lit_sample(vec2u(pixel)).w == 0.0 {
        settle(vec2u(pixel), 1.0, -1.0);
        return;
    }
    let distance = f32(here.distance);
    // With 1 over the depth as depth, straight lines are straight in the picture: what the ray gains from pixel to pixel.
    let rise = (cut.light_depth - own) / distance * f32(cut.towards);
    // What lies before the ray by up to twice the thickness hides the light, most in the middle.
    let scale = min(distance - f32(cut.towards), 1.0 / contact.contact_tau) * distance / own;
    let last = samples - min(contact.contact_fading, samples);
    var hard = 1.0;
    var soft = vec4f(1.0);
    var nearest = 1.0;
    var reach = 0u;
    for (var i = 0u; i < samples; i++) {
        let on = f32(i + 1u);
        let away = distance - f32(cut.towards) * on;
        if away <= 0.0 {
            break;
        }
        var off = abs(1.0 - (casters[lane + 1u + i] - own - rise * on) / away * scale);
        if i >= last {
            off += 0.75 * f32(i - last + 1u) / f32(contact.contact_fading + 1u);
        }
        if i < contact.contact_hard {
            hard = min(hard, off);
        } else {
            soft[i & 3u] = min(soft[i & 3u], off);
        }
        if off < nearest {
            nearest = off;
            reach = i + 1u;
        }
    }
    let contrast = contact.contact_sharp;
    let mean = dot(saturate(soft * contrast + 1.0 - contrast), vec4f(0.25));
    let seen = min(saturate(hard * contrast + 1.0 - contrast), mean);
    let slant = f32(line) / f32(far);
    settle(vec2u(pixel), seen, select(-1.0, f32(reach) * sqrt(1.0 + slant * slant), seen < 1.0));
}
