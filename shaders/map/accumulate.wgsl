//!include lib/frame.wgsl
//!include lib/gbuffer.wgsl
//!include map/past.wgsl
// Temporal accumulation: the light that earlier frames saw at the same place of a surface, averaged with this frame's.

var<uniform> turning: NoiseParams;
var<uniform> past: Past;
var<storage, read_write> past_out: Past;
var visibility: texture_2d<f32>;
var visibility_out: texture_storage_2d<r32float, write>;
// The light, and the distance from the eye, of whose bits the last eight are how many frames the light is the mean of.
var history: texture_2d<u32>;
var history_out: texture_storage_2d<rg32uint, write>;

struct Held {
    light: f32,
    distance: f32,
    frames: f32,
}

fn held(pixel: vec2u) -> Held {
    let words = textureLoad(history, pixel, 0).xy;
    return Held(bitcast<f32>(words.x), bitcast<f32>(words.y & ~0xffu), f32(words.y & 0xffu));
}

// What the last frame held where it saw this surface: its four pixels around the place, as far as they show the same surface.
// Of 0 frames: none did.
fn earlier(s: Surface) -> Held {
    let before = place_before(past, s.position);
    if before.z <= 0.0 {
        return Held(0.0, 0.0, 0.0);
    }
    let size = vec2f(frame.size);
    let place = before.xy;
    let away = off_camera(past, s.position);
    // How much farther off the surface is a pixel on.
    let facing = max(seen_before(past, s), 0.02);
    let step = pixel_at(away) * sqrt(1.0 - facing * facing) / facing;
    var sum = vec2f(0.0);
    var weights = 0.0;
    for (var i = 0u; i < 4u; i++) {
        let pixel = floor(place) + vec2f(vec2u(i & 1u, i >> 1u));
        let apart = abs(place - pixel);
        let weight = (1.0 - apart.x) * (1.0 - apart.y);
        if weight > 0.0 && all(pixel >= vec2f(0.0)) && all(pixel < size) {
            let h = held(vec2u(pixel));
            if h.frames > 0.0 && abs(h.distance - away) < 0.003 * distance_at(away) + 1.5 * step {
                sum += weight * vec2f(h.light, h.frames);
                weights += weight;
            }
        }
    }
    if weights < 1e-3 {
        return Held(0.0, 0.0, 0.0);
    }
    return Held(sum.x / weights, away, floor(sum.y / weights + 0.5));
}

@compute @workgroup_size(8, 8)
fn accumulate(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= frame.size.x || id.y >= frame.size.y {
        return;
    }
    let s = load_surface(id.xy);
    var light = textureLoad(visibility, id.xy, 0).x;
    var frames = 0.0;
    if s.valid {
        let before = earlier(s);
        var held = before.light;
        if turning.clamp_history != 0u {
            var low = light;
            var high = light;
            for (var i = 0u; i < 9u; i++) {
                let beside = clamp(vec2i(id.xy) + vec2i(vec2u(i % 3u, i / 3u)) - 1, vec2i(0), vec2i(frame.size) - 1);
                // What has no filtered shadow says nothing of one: the sky, and what faces away.
                if lit_sample(vec2u(beside)).w > 0.0 {
                    let v = textureLoad(visibility, beside, 0).x;
                    low = min(low, v);
                    high = max(high, v);
                }
            }
            held = clamp(held, low, high);
        }
        frames = min(before.frames + 1.0, f32(turning.accumulate));
        light = mix(held, light, max(turning.blend_factor, 1.0 / frames));
    }
    let away = (bitcast<u32>(off_camera(now_past(0u), s.position)) & ~0xffu) | u32(frames);
    textureStore(history_out, id.xy, vec4u(bitcast<u32>(light), away, 0u, 0u));
}

// Keeps it for the next frame.
@compute @workgroup_size(8, 8)
fn keep_history(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= frame.size.x || id.y >= frame.size.y {
        return;
    }
    let words = textureLoad(history, id.xy, 0);
    textureStore(history_out, id.xy, words);
    textureStore(visibility_out, id.xy, vec4f(bitcast<f32>(words.x)));
    if all(id.xy == vec2u(0u)) {
        past_out = now_past(past_out.frames + 1u);
    }
}
