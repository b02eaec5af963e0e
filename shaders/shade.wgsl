//!include lib/frame.wgsl
//!include lib/gbuffer.wgsl
//!include lib/light_view.wgsl
//!include lib/cells.wgsl
//!include lib/labels.wgsl
// The picture: shading, the common views, and a technique's own maps.

// A pipeline draws one view: adapters that run both sides of a branch would pay for all of them. The common views are
// numbered by Rust: constants `view_shaded`, `view_split` and so on.
override drawn_view: u32;
// How it draws a technique's own map: 0 not, 1 texture, 2 ramp, 3 cells, 4 aliasing, 5 counts, 6 labels.
override drawn_map: u32;

struct View {
    range: vec2f,
    // Of `map`, where it holds more than one value.
    channel: u32,
    // Of the picture, from the top, that have what the view needs; the rest is shaded.
    rows: u32,
}

@group(1) @binding(0) var<uniform> view: View;
@group(1) @binding(1) var visibility: texture_2d<f32>;
@group(1) @binding(2) var truth: texture_2d<f32>;
@group(1) @binding(3) var map: texture_2d<f32>;
@group(1) @binding(4) var shown: texture_2d<f32>;
@group(1) @binding(5) var output: texture_storage_2d<rgba8unorm, write>;

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
    let light = light_at(s.position);
    let cosine = max(dot(s.shading_normal, normalize(light.to_light)), 0.0);
    let direct = select(0.0, v, light.reached && faces_light(s)) * cosine * light.irradiance;
    // Bright parts are bent below white; dark ones stay as they are.
    let c = 1.25 * s.albedo * (ambient(s.shading_normal) + direct);
    return c * (1.0 + c * 0.1) / (1.0 + c * 0.6);
}

// Dark blue over green to yellow: steps of equal lightness, readable by the colour-blind.
fn ramp(x: f32) -> vec3f {
    let t = saturate(x);
    let a = vec3f(0.27, 0.00, 0.33);
    let b = vec3f(0.19, 0.41, 0.56);
    let c = vec3f(0.21, 0.72, 0.47);
    let d = vec3f(0.99, 0.91, 0.14);
    if t < 0.333 {
        return mix(a, b, t * 3.0);
    }
    return select(mix(c, d, t * 3.0 - 2.0), mix(b, c, t * 3.0 - 1.0), t < 0.667);
}

// Powers of two: pale blue (2⁻⁴ and less) over green (1) and ochre (2) to dark red (2⁴ and more). Lightness falls all the
// way, so that grey and the colour-blind's hues tell both sides apart.
fn octave_color(x: f32) -> vec3f {
    let stops = array<vec3f, 9>(
        vec3f(0.80, 0.90, 1.00), vec3f(0.66, 0.83, 0.97), vec3f(0.50, 0.76, 0.90), vec3f(0.37, 0.71, 0.72),
        vec3f(0.30, 0.65, 0.32), vec3f(0.72, 0.47, 0.08), vec3f(0.76, 0.28, 0.08), vec3f(0.58, 0.10, 0.12),
        vec3f(0.30, 0.03, 0.14));
    let t = clamp(x, -4.0, 4.0) + 4.0;
    let i = min(u32(t), 7u);
    return mix(stops[i], stops[i + 1u], t - f32(i));
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

// Colour of a pixel, sRGB-encoded.
fn color_of(pixel: vec2u) -> vec3f {
    let s = load_surface(pixel);
    let v = textureLoad(visibility, pixel, 0).x;
    if drawn_view == view_technique_map && drawn_map == 1u {
        return map_picture(pixel);
    }
    if drawn_view == view_technique_map {
        let x = textureLoad(map, pixel, 0)[view.channel];
        if drawn_map == 5u {
            // A texel with n samples is about √n pixels wide.
            let used = select(vec3f(0.98, 0.98, 0.97), octave_color(0.5 * log2(x)), x > 0.0);
            return select(vec3f(0.12), used, x >= 0.0);
        }
        if drawn_map == 4u && s.valid {
            return select(dimmed(s), octave_color(log2(x)), x > 0.0);
        }
        if x >= 0.0 && drawn_map == 6u {
            let plain = x >= plain_ground;
            let ground = select(linear_to_srgb(lit(s, v)), vec3f(0.12), plain || !s.valid);
            return mix(ground, label_color(label_of(x)), label_strength(x));
        }
        if x >= 0.0 && drawn_map == 2u {
            return ramp((x - view.range.x) / (view.range.y - view.range.x));
        }
        if x >= 0.0 && drawn_map == 3u && s.valid {
            let cell = cell_of(x);
            let odd = ((cell.x + cell.y) & 1u) == 1u;
            let tint = select(vec3f(0.95, 0.75, 0.35), vec3f(0.25, 0.45, 0.75), odd);
            return mix(linear_to_srgb(lit(s, v)), tint, 0.45);
        }
    }
    if !s.valid {
        // Only pictures have a sky; data have a plain background.
        let data = drawn_view != view_shaded && drawn_view != view_split && pixel.y < view.rows;
        return select(linear_to_srgb(sky(normalize(pixel_ray(vec2f(pixel) + 0.5)))), vec3f(0.22, 0.24, 0.27), data);
    }
    if pixel.y >= view.rows {
        return linear_to_srgb(lit(s, v));
    }
    switch drawn_view {
        case view_split: {
            let line = frame.split * f32(frame.size.x);
            let x = f32(pixel.x) + 0.5;
            if abs(x - line) < 1.0 {
                return vec3f(1.0);
            }
            return linear_to_srgb(lit(s, select(textureLoad(truth, pixel, 0).x, v, x < line)));
        }
        case view_visibility: {
            return vec3f(v);
        }
        case view_truth: {
            return vec3f(textureLoad(truth, pixel, 0).x);
        }
        case view_error: {
            let t = textureLoad(truth, pixel, 0).x;
            let off = abs(v - t);
            if !can_be_wrong(s) || off < 1.0 / 255.0 {
                return dimmed(s);
            }
            let hue = select(vec3f(0.95, 0.12, 0.10), vec3f(0.10, 0.25, 1.00), v > t);
            return mix(dimmed(s), hue, 0.35 + 0.65 * off);
        }
        case view_acne: {
            let amount = textureLoad(truth, pixel, 0).x - v;
            return mix(dimmed(s), vec3f(1.0, 0.85, 0.1), select(0.0, saturate(amount), can_be_wrong(s)));
        }
        case view_detachment: {
            let amount = v - textureLoad(truth, pixel, 0).x;
            return mix(dimmed(s), vec3f(0.2, 0.9, 0.9), select(0.0, saturate(amount), can_be_wrong(s)));
        }
        case view_facing: {
            let light = light_at(s.position);
            let cosine = dot(s.normal, normalize(light.to_light));
            let reached = mix(vec3f(0.10, 0.30, 0.18), vec3f(0.55, 0.88, 0.55), cosine);
            return select(vec3f(0.35), select(vec3f(0.60, 0.48, 0.25), reached, light.reached), cosine > 0.0);
        }
        case view_normals: {
            return 0.5 + 0.5 * s.shading_normal;
        }
        case view_albedo: {
            return linear_to_srgb(s.albedo);
        }
        case view_depth: {
            // Logarithmic from the nearest to the farthest corner of the scene, so that near things differ too.
            let low = max(frame.near, 1e-3);
            let reach = length(max(abs(frame.eye - frame.bounds_min), abs(frame.eye - frame.bounds_max)));
            return vec3f(saturate(log(s.depth / low) / log(max(min(frame.far, reach), 2.0 * low) / low)));
        }
        case view_light_depth: {
            return vec3f(saturate(light_depth(s.position)));
        }
        case view_position: {
            return fract(s.position);
        }
        case view_triangles: {
            return random_color(s.triangle);
        }
        default: {
            return linear_to_srgb(lit(s, v));
        }
    }
}

@compute @workgroup_size(8, 8)
fn shade(@builtin(global_invocation_id) id: vec3u) {
    if id.x < frame.size.x && id.y < frame.size.y {
        textureStore(output, id.xy, vec4f(saturate(color_of(id.xy)), 1.0));
    }
}
