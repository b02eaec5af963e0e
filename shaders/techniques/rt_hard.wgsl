//!include lib/frame.wgsl
//!include lib/gbuffer.wgsl
//!include lib/light_place.wgsl
//!include lib/shadow_ray.wgsl
// One shadow ray per pixel that faces the light: exact hard visibility at the G-buffer sample. The averaged truth takes more
// of them: over the pixel, or over a light that has a size.

var<uniform> params: RtParams;
var visibility_out: texture_storage_2d<r32float, write>;
var map_out: texture_storage_2d<r32float, write>;

// The same with what the parameters say.
fn chosen_ray(s: Surface, light: LightSample) -> Ray {
    var ray = shadow_ray(s, light);
    ray.t_min = max(ray.t_min, params.epsilon * max(largest(s.position), 1.0) / length(light.to_light));
    ray.two_sided = params.two_sided != 0u;
    ray.max_visits = params.max_visits;
    return ray;
}

// Whether a pixel's surface sees a place of the light. Whether the light reaches it at all, and the surface faces it, is asked
// of the centre, (0, 0).
fn visible(pixel: vec2u, place: vec2f) -> Hit {
    let s = load_surface(pixel);
    if !s.valid {
        return Hit(false, false, 0u, 0.0, 0u);
    }
    var light = light_at(s.position);
    if !light.reached || dot(s.normal, light.to_light) <= 0.0 {
        return Hit(true, false, 0u, 0.0, 0u);
    }
    if any(place != vec2f(0.0)) {
        light.to_light = towards(light.to_light, place);
        if dot(s.normal, light.to_light) <= 0.0 {
            // That part has set behind the surface's own plane. Not 0 visits: it counts among those that could be lit.
            return Hit(true, false, 1u, 0.0, 0u);
        }
    }
    return trace(chosen_ray(s, light));
}

// The pixel of a thread. Rows of workgroups are dealt out 16 apart: software adapters give each core a run of
// neighbours, and the sky takes less than the ground.
fn dealt(id: vec2u) -> vec2u {
    let rows = (frame.band.y + 7u) / 8u;
    let row = id.y / 8u;
    let each = rows / 16u;
    // So many rounds have a row more than the others.
    let longer = rows % 16u;
    let rest = max(row, longer * (each + 1u)) - longer * (each + 1u);
    let long = row < longer * (each + 1u);
    let least = max(each, 1u);
    let first = select(longer + rest / least, row / (each + 1u), long);
    let round = select(rest % least, row % (each + 1u), long);
    return vec2u(id.x, frame.band.x + (round * 16u + first) * 8u + id.y % 8u);
}

// Whether the picture and the rows of this dispatch hold the pixel.
fn in_band(pixel: vec2u) -> bool {
    return pixel.x < frame.size.x && pixel.y < min(frame.size.y, frame.band.x + frame.band.y);
}

@compute @workgroup_size(8, 8)
fn resolve(@builtin(global_invocation_id) id: vec3u) {
    let pixel = dealt(id.xy);
    if in_band(pixel) {
        let hit = visible(pixel, vec2f(0.0));
        if hit.visits > 0u {
            tally_ray(hit);
        }
        textureStore(visibility_out, pixel, vec4f(select(1.0, 0.0, hit.blocked)));
    }
}

// The mean over several samples: of a pixel, whose surfaces the G-buffer of each holds, or of a light that has a size, from the
// pixel's own surface.

// The first that this dispatch takes, from 0, and how many.
var<uniform> sample: vec2u;
// Of the samples so far those that can be lit in the upper half, those that are in the lower.
var counts: texture_storage_2d<r32uint, read_write>;
var hard: texture_2d<f32>;

@compute @workgroup_size(8, 8)
fn accumulate(@builtin(global_invocation_id) id: vec3u) {
    let pixel = dealt(id.xy);
    if !in_band(pixel) {
        return;
    }
    var count = 0u;
    if sample.x > 0u {
        count = textureLoad(counts, pixel).x;
    }
    for (var i = 0u; i < sample.y; i++) {
        var place = vec2f(0.0);
        if has_size() {
            place = on_light(scattered(pixel, sample.x + i));
        }
        let hit = visible(pixel, place);
        if hit.visits > 0u {
            tally_ray(hit);
            count += 0x10000u + select(1u, 0u, hit.blocked);
        }
    }
    textureStore(counts, pixel, vec4u(count));
    // Where no sample can be lit the pixel's centre decides.
    var mean = textureLoad(hard, pixel, 0).x;
    if count > 0u {
        mean = f32(count & 0xffffu) / f32(count >> 16u);
    }
    textureStore(visibility_out, pixel, vec4f(mean));
}

// What tells the causes of errors apart (src/measure/causes.rs).

var visibility: texture_2d<f32>;
// As `aliasing_out` in lib/analysis.wgsl; its second channel is 0 for techniques without maps.
var aliasing: texture_2d<f32>;
// Of pixels in true shadow the metres to what blocks the light nearest to them (bits of a float) and its triangle; of wrong
// lit ones their own triangle and one that stands beside them, or their own again. Of wrong ones 1 if a true edge lies within
// two texels, and the metres below which a blocker is near.
var evidence_out: texture_storage_2d<rgba32uint, write>;

// Whether the hard truth changes within two texels of the light's image, `texel` metres wide at the surface, whatever the
// camera sees of that; 1 if so. Beside a lit surface something may stand that is no farther away than a texel: perhaps only
// the next facet of the same caster. Then its triangle.
fn edge_nearby(s: Surface, lit: bool, texel: f32) -> vec2u {
    let to_light = normalize(light_at(s.position).to_light);
    let axes = across(to_light);
    for (var i = 0u; i < select(16u, 32u, lit); i++) {
        let angle = 0.7853982 * f32(i);
        let aside = texel * f32(1u + i / 8u % 2u) * (cos(angle) * axes[0] + sin(angle) * axes[1]);
        // Along the light onto the surface's plane.
        let slide = -dot(s.normal, aside) / dot(s.normal, to_light);
        var beside = s;
        beside.position += aside + slide * to_light;
        let light = light_at(beside.position);
        var ray = chosen_ray(beside, light);
        if lit && i < 16u {
            ray.t_min = max(ray.t_min, (texel + abs(slide)) / length(light.to_light));
        }
        let hit = trace(ray);
        if hit.blocked == lit {
            return vec2u(select(1u, 0u, i >= 16u), select(s.triangle, hit.triangle, lit));
        }
    }
    return vec2u(0u, s.triangle);
}

@compute @workgroup_size(8, 8)
fn explain(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= frame.size.x || id.y >= frame.size.y {
        return;
    }
    let pixel = id.xy;
    let s = load_surface(pixel);
    let light = light_at(s.position);
    var evidence = vec4u(0u);
    if may_be_shadowed(s, light) {
        let lit = textureLoad(hard, pixel, 0).x >= 0.5;
        if !lit {
            let hit = nearest(chosen_ray(s, light));
            evidence.x = bitcast<u32>(hit.t * length(light.to_light));
            evidence.y = hit.triangle;
        }
        if (textureLoad(visibility, pixel, 0).x >= 0.5) != lit {
            let side = pixel_at(s.depth);
            let slope = abs(dot(s.normal, normalize(to_eye(s.position))));
            let texel = side * max(textureLoad(aliasing, pixel, 0).y, 0.0);
            evidence.w = bitcast<u32>(2.0 * max(texel, side / max(slope, 0.1)));
            if texel > 0.0 {
                let found = edge_nearby(s, lit, texel);
                evidence.z = found.x;
                if lit {
                    evidence.x = s.triangle;
                    evidence.y = found.y;
                }
            }
        }
    }
    textureStore(evidence_out, pixel, evidence);
}

// Map: nodes visited by each pixel's ray.
@compute @workgroup_size(8, 8)
fn inspect(@builtin(global_invocation_id) id: vec3u) {
    if id.x < frame.size.x && id.y < frame.size.y {
        textureStore(map_out, id.xy, vec4f(f32(visible(id.xy, vec2f(0.0)).visits)));
    }
}
