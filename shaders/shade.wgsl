//!include constants.wgsl
//!include lib/frame.wgsl
//!include lib/gbuffer.wgsl
//!include lib/direct.wgsl
//!include map/light_view.wgsl
//!include lib/cells.wgsl
//!include lib/labels.wgsl
//!include lib/inset.wgsl
// The picture: shading, the common views, and a technique's own maps.

// A pipeline draws one view: adapters that run both sides of a branch would pay for all of them. The common views are
// numbered by Rust: constants `view_shaded`, `view_error` and so on.
override drawn_view: u32;
// How it draws a technique's own map: 0 not, 1 texture, 2 ramp, 3 cells, 4 aliasing, 5 counts, 6 labels, 7 contact shadows.
override drawn_map: u32;
// 0: the picture alone. 1: with `over` over it. 2: it will lie over another.
override layer: u32;
// 1: the technique offers indirect light.
override indirect_light: u32;
// 1: other lights shine too.
override more_lights: u32;

struct View {
    range: vec2f,
    // Of `map`, where it holds more than one value.
    channel: u32,
    // Of the picture, from the top, that have what the view needs; the rest is shaded.
    rows: u32,
    // How much an overlay hides; from 1 on it lies small in a corner.
    opacity: f32,
    // Of errors: pixels by which wrong ones grow, and whether what lies under them is light.
    dilation: u32,
    light_base: u32,
    // Shares of direct and ambient light beside indirect light.
    direct: f32,
    ambient: f32,
    // Of `range`: by the logarithm of one more.
    log: u32,
    // 1: where nothing is seen the picture lets through what lies behind it.
    transparent: u32,
    padding: u32,
}

var<uniform> view: View;
var visibility: texture_2d<f32>;
var truth: texture_2d<f32>;
var map: texture_2d<f32>;
var shown: texture_2d<f32>;
// The visibility that this one is compared with.
var other: texture_2d<f32>;
// What the other lights give the surfaces: irradiance.
var others: texture_2d<f32>;
// The overlay, sRGB-encoded.
var over: texture_2d<f32>;
// Irradiance of each pixel by light that surfaces throw back.
var indirect: texture_2d<f32>;
var output: texture_storage_2d<rgba8unorm, write>;

fn sky(direction: vec3f) -> vec3f {
    let horizon = vec3f(0.78, 0.83, 0.88);
    if direction.y < 0.0 {
        // Darker below, so that bright floors stand out.
        return mix(horizon, vec3f(0.30, 0.31, 0.33), smoothstep(0.0, 0.12, -direction.y));
    }
    return mix(horizon, vec3f(0.36, 0.52, 0.74), pow(direction.y, 0.6));
}

// Light of the sky and what the ground throws back: no shadow technique touches it.
fn ambient(normal: vec3f) -> vec3f {
    return mix(vec3f(0.16, 0.15, 0.14), vec3f(0.24, 0.28, 0.34), 0.5 + 0.5 * normal.y);
}

fn lit(s: Surface, v: f32) -> vec3f {
    let direct = direct_light(s, v);
    var light_in = vec3f(0.0);
    if indirect_light == 1u {
        light_in = view.ambient * ambient(s.shading_normal) + view.direct * direct + textureLoad(indirect, s.pixel, 0).rgb;
    } else {
        light_in = ambient(s.shading_normal) + direct;
    }
    if more_lights == 1u {
        light_in += textureLoad(others, s.pixel, 0).rgb;
    }
    // Bright parts are bent below white; dark ones stay as they are.
    let c = 1.25 * s.albedo * light_in;
    return c * (1.0 + c * 0.1) / (1.0 + c * 0.6);
}

// Powers of two from 2⁻⁴ to 2⁴.
fn octave_color(x: f32) -> vec3f {
    return octaves(x / 8.0 + 0.5);
}

fn random_color(x: u32) -> vec3f {
    let h = hash(x + 1u);
    return vec3f(vec3u(h, h >> 10u, h >> 20u) & vec3u(1023u)) / 1023.0;
}

// Distance from the light in the scene's extent along it, 0 near to 1 far.
fn light_depth(position: vec3f) -> f32 {
    if frame.light_kind != directional {
        let diagonal = length(frame.bounds_max - frame.bounds_min);
        return distance(position, frame.light_position) / min(frame.light_range, diagonal);
    }
    let center = 0.5 * (frame.bounds_min + frame.bounds_max);
    let reach = 0.5 * dot(frame.bounds_max - frame.bounds_min, abs(frame.light_axis));
    return 0.5 + 0.5 * dot(position - center, frame.light_axis) / reach;
}

// A map fitted into the picture, near bright in proportion to the distance, on a quiet background.
fn map_picture(pixel: vec2u) -> vec3f {
    let size = vec2f(textureDimensions(shown));
    let scale = max(size.x / f32(frame.size.x), size.y / f32(frame.size.y));
    let texel = (vec2f(pixel) + 0.5 - 0.5 * vec2f(frame.size)) * scale + 0.5 * size;
    if any(texel < vec2f(0.0)) || any(texel >= size) {
        return vec3f(0.12);
    }
    let z = linear_depth(light_view, textureLoad(shown, vec2u(texel), 0).x);
    return vec3f(saturate((light_view.far - z) / (light_view.far - light_view.near)));
}

// Whether errors count: the surface faces the light, within its cone and range.
fn can_be_wrong(s: Surface) -> bool {
    return faces_light(s) && light_at(s.position).reached;
}

fn dimmed(s: Surface) -> vec3f {
    let gray = dot(linear_to_srgb(lit(s, textureLoad(visibility, s.pixel, 0).x)), vec3f(0.3, 0.6, 0.1));
    return vec3f(0.15 + 0.4 * gray);
}

// What shows no data.
fn ground(color: vec3f) -> vec4f {
    return vec4f(color, 0.0);
}

fn data(color: vec3f) -> vec4f {
    return vec4f(color, 1.0);
}

// A colour over the dimmed scene, more of it the larger the amount.
fn over_dimmed(s: Surface, color: vec3f, amount: f32) -> vec4f {
    return vec4f(mix(dimmed(s), color, amount), select(0.0, 1.0, amount > 0.0));
}

// What lies under marked errors: the picture in greys, dark or light. Small differences are light themselves.
fn error_base(s: Surface) -> vec3f {
    if view.light_base == 0u || drawn_view == view_difference {
        return select(vec3f(0.22, 0.24, 0.27), dimmed(s), s.valid);
    }
    return select(vec3f(1.0), 0.65 + 0.75 * (dimmed(s) - 0.15), s.valid);
}

// By how much a pixel is wrong, visibility less truth, or differs from the one it is compared with; 0 where that is too
// little to be seen, or nothing can be wrong.
fn error_at(pixel: vec2u) -> f32 {
    var right = 0.0;
    if drawn_view == view_difference {
        right = textureLoad(other, pixel, 0).x;
    } else {
        right = textureLoad(truth, pixel, 0).x;
    }
    let off = textureLoad(visibility, pixel, 0).x - right;
    // The surface only where it matters.
    if abs(off) < 1.0 / 255.0 {
        return 0.0;
    }
    let s = load_surface(pixel);
    return select(0.0, off, s.valid && can_be_wrong(s));
}

// The views of errors. A pixel that is right takes after a wrong one at most `view.dilation` away.
fn error_picture(pixel: vec2u) -> vec4f {
    let s = load_surface(pixel);
    let base = error_base(s);
    let low = pixel - min(pixel, vec2u(view.dilation));
    let high = min(pixel + view.dilation, frame.size - 1u);
    if drawn_view == view_causes {
        var kind = textureLoad(map, pixel, 0).x;
        if kind == 0.0 && view.dilation > 0u {
            for (var y = low.y; y <= high.y; y++) {
                for (var x = low.x; x <= high.x; x++) {
                    let other = textureLoad(map, vec2u(x, y), 0).x;
                    kind = select(kind, other, other > 0.0 && (kind == 0.0 || other < kind));
                }
            }
        }
        return vec4f(select(base, cause_color(u32(max(kind, 1.0)) - 1u), kind > 0.0), select(0.0, 1.0, kind > 0.0));
    }
    if drawn_view == view_error_density || drawn_view == view_flip {
        let x = textureLoad(map, pixel, 0).x;
        let shown = select(x > 0.0, s.valid && x >= 0.0, drawn_view == view_flip);
        return vec4f(select(base, ramp(x / select(0.5, 1.0, drawn_view == view_flip)), shown), select(0.0, 1.0, shown));
    }
    var off = error_at(pixel);
    if off == 0.0 && view.dilation > 0u {
        for (var y = low.y; y <= high.y; y++) {
            for (var x = low.x; x <= high.x; x++) {
                let other = error_at(vec2u(x, y));
                off = select(off, other, abs(other) > abs(off));
            }
        }
    }
    if off == 0.0 {
        return ground(base);
    }
    if drawn_view == view_error_size {
        return data(ramp(abs(off)));
    }
    if drawn_view == view_difference {
        return data(mix(base, diverging(0.5 + 0.5 * off), 0.5 + 0.5 * abs(off)));
    }
    return data(mix(base, select(false_shadow_color, leak_color, off > 0.0), 0.35 + 0.65 * abs(off)));
}

// About how many pixels wide the texels around a pixel with this cell are, the narrower way.
fn texel_width(pixel: vec2u, cell: vec2u) -> f32 {
    let step = 3u;
    var most = 0.0;
    for (var i = 0u; i < 2u; i++) {
        let by = select(vec2u(0u, step), vec2u(step, 0u), i == 0u);
        let beside = select(pixel - min(by, pixel), pixel + by, all(pixel + by < frame.size));
        let x = textureLoad(map, beside, 0).x;
        let deeper = textureLoad(g_position, beside, 0).w / textureLoad(g_position, pixel, 0).w;
        // Beyond an edge of the surface lies another part of the map.
        if x >= 0.0 && abs(deeper - 1.0) < 0.05 {
            most = max(most, distance(vec2f(cell_of(x)), vec2f(cell)));
        }
    }
    return f32(step) / max(most, 1e-3);
}

// Where there is no surface: the sky, or a plain background.
fn beyond(pixel: vec2u, plain: bool) -> vec4f {
    let color = linear_to_srgb(sky(normalize(pixel_ray(vec2f(pixel) + 0.5))));
    return ground(select(color, vec3f(0.22, 0.24, 0.27), plain));
}

// Colour of a pixel, sRGB-encoded; the last number says whether it shows data.
fn color_of(pixel: vec2u) -> vec4f {
    let s = load_surface(pixel);
    let v = textureLoad(visibility, pixel, 0).x;
    if drawn_view == view_technique_map && drawn_map == 1u {
        return data(map_picture(pixel));
    }
    if drawn_view == view_technique_map {
        let x = textureLoad(map, pixel, 0)[view.channel];
        if drawn_map == 5u {
            // A texel with n samples is about √n pixels wide.
            let used = select(vec3f(0.98, 0.98, 0.97), octave_color(0.5 * log2(x)), x > 0.0);
            return data(select(vec3f(0.12), used, x >= 0.0));
        }
        if drawn_map == 4u && s.valid {
            return over_dimmed(s, octave_color(log2(x)), select(0.0, 1.0, x > 0.0));
        }
        if x >= 0.0 && drawn_map == 6u {
            let plain = x >= plain_ground;
            let below = select(linear_to_srgb(lit(s, v)), vec3f(0.12), plain || !s.valid);
            return vec4f(mix(below, label_color(label_of(x)), label_strength(x)), select(0.0, 1.0, plain || label_strength(x) > 0.0));
        }
        if x >= 0.0 && drawn_map == 2u {
            let along = (x - view.range.x) / (view.range.y - view.range.x);
            return data(ramp(select(along, log(1.0 + x) / log(1.0 + view.range.y), view.log == 1u)));
        }
        if x >= 0.0 && drawn_map == 3u && s.valid {
            let cell = cell_of(x);
            let odd = ((cell.x + cell.y) & 1u) == 1u;
            let tint = select(vec3f(0.95, 0.75, 0.35), vec3f(0.25, 0.45, 0.75), odd);
            // Squares of a pixel and less would make other patterns: they fade.
            let strength = smoothstep(1.0, 2.5, texel_width(pixel, cell));
            return vec4f(mix(linear_to_srgb(lit(s, v)), tint, 0.45 * strength), select(0.0, 1.0, strength > 0.0));
        }
    }
    if pixel.y >= view.rows {
        if s.valid {
            return ground(linear_to_srgb(lit(s, v)));
        }
        return beyond(pixel, false);
    }
    if drawn_view == view_error || drawn_view == view_causes || drawn_view == view_error_density
        || drawn_view == view_error_size || drawn_view == view_flip || drawn_view == view_difference {
        return error_picture(pixel);
    }
    if !s.valid {
        // Only pictures have a sky; data have a plain background.
        return beyond(pixel, drawn_view != view_shaded);
    }
    if drawn_view == view_technique_map && drawn_map == 7u {
        return contact_picture(s);
    }
    switch drawn_view {
        case view_visibility: {
            return data(vec3f(v));
        }
        case view_truth: {
            return data(vec3f(textureLoad(truth, pixel, 0).x));
        }
        case view_facing: {
            let light = light_at(s.position);
            let cosine = dot(s.normal, normalize(light.to_light));
            let reached = mix(vec3f(0.10, 0.30, 0.18), vec3f(0.55, 0.88, 0.55), cosine);
            return data(select(vec3f(0.35), select(vec3f(0.60, 0.48, 0.25), reached, light.reached), cosine > 0.0));
        }
        case view_normals: {
            return data(0.5 + 0.5 * s.shading_normal);
        }
        case view_albedo: {
            return data(linear_to_srgb(s.albedo));
        }
        case view_depth: {
            // Logarithmic from the nearest to the farthest corner of the scene, so that near things differ too. How far before the
            // scene an orthographic camera stands means nothing.
            if frame.orthographic == 1u {
                let middle = dot(0.5 * (frame.bounds_min + frame.bounds_max) - frame.eye, frame.forward);
                let half = dot(0.5 * (frame.bounds_max - frame.bounds_min), abs(frame.forward));
                let first = max(middle - half, frame.near);
                return data(vec3f(saturate(log(s.depth / first) / log(max(min(middle + half, frame.far) / first, 1.0001)))));
            }
            let low = max(frame.near, 1e-3);
            let reach = length(max(abs(frame.eye - frame.bounds_min), abs(frame.eye - frame.bounds_max)));
            return data(vec3f(saturate(log(s.depth / low) / log(max(min(frame.far, reach), 2.0 * low) / low))));
        }
        case view_light_depth: {
            return data(vec3f(saturate(light_depth(s.position))));
        }
        case view_position: {
            return data(fract(s.position));
        }
        case view_triangles: {
            return data(random_color(s.triangle));
        }
        default: {
            return data(linear_to_srgb(lit(s, v)));
        }
    }
}

// What contact shadows leave of the light; or what they darken and what they change, against the truth.
fn contact_picture(s: Surface) -> vec4f {
    let x = textureLoad(map, s.pixel, 0).x;
    if frame.map == shows_contact_visibility {
        return data(vec3f(x));
    }
    // As shaders/contact.wgsl leaves it.
    let hit = (u32(x) & 1u) == 1u;
    let changed = frame.map == shows_contact_hits || (u32(x) & 2u) == 2u;
    if !(hit && changed && can_be_wrong(s)) {
        return ground(error_base(s));
    }
    return data(select(false_shadow_color, label_color(2u), textureLoad(truth, s.pixel, 0).x < 0.5));
}

// The overlay over the picture's colour, multiplied by alpha: blended, or small in the upper right corner.
fn below_overlay(pixel: vec2u, color: vec4f) -> vec4f {
    if view.opacity < 1.0 {
        let o = textureLoad(over, pixel, 0);
        return mix(color, vec4f(o.rgb, 1.0), view.opacity * o.a);
    }
    if beside_inset(pixel) {
        return color;
    }
    if !inside_inset(pixel) {
        return vec4f(vec3f(0.9), 1.0);
    }
    let corner = inset_corner();
    // The mean of the nine pixels that it covers.
    var sum = vec4f(0.0);
    for (var i = 0u; i < 9u; i++) {
        let at = (pixel - corner) * 3u + vec2u(i % 3u, i / 3u);
        sum += textureLoad(over, min(at, frame.size - 1u), 0);
    }
    return vec4f(sum.rgb / 9.0, 1.0);
}

@compute @workgroup_size(8, 8)
fn shade(@builtin(global_invocation_id) id: vec3u) {
    if id.x < frame.size.x && id.y < frame.size.y {
        let color = color_of(id.xy);
        var alpha = 1.0;
        if view.transparent == 1u && color.a == 0.0 && !(textureLoad(g_position, id.xy, 0).w > 0.0) {
            alpha = 0.0;
        }
        // Multiplied by alpha, so that lines can be blended over it.
        var out = vec4f(saturate(color.rgb) * alpha, select(alpha, color.a, layer == 2u));
        if layer == 1u {
            out = below_overlay(id.xy, out);
        }
        textureStore(output, id.xy, out);
    }
}
