//!include map/choose/single.wgsl
//!include map/place/straight.wgsl
//!include map/look_up.wgsl
//!include map/filter/penumbra.wgsl
//!include lib/light_dots.wgsl
// A rectangle's soft shadow from a single map: what a probed pixel sees of the light.

fn dot_count() -> u32 {
    return samples() * samples();
}

fn dot_place(i: u32) -> vec2f {
    return sample_place(i, samples());
}

fn dot_seen(i: u32) -> bool {
    let s = load_surface(probed_pixel());
    if !may_be_shadowed(s, light_at(s.position)) {
        return false;
    }
    let w = window(s, 0u);
    let c = covered(w, s, samples(), true);
    return w.hidden == 0.0 && (c.bits[i / 32u] >> (i % 32u) & 1u) == 0u;
}

// The light as the probed pixel sees it, and on it every texel's rectangle: how many lie at a place, and their outlines.
fn texel_rectangles(pixel: vec2u) -> f32 {
    let at = drawn_place(pixel);
    let line = 1.0 / drawn_half();
    let edge = max(abs(at.x), abs(at.y));
    let s = load_surface(probed_pixel());
    if edge > 1.0 + line || !may_be_shadowed(s, light_at(s.position)) {
        return drawn(white, 0.0);
    }
    let w = window(s, 0u);
    var count = 0u;
    var outlined = false;
    for (var y = w.low.y; y <= w.high.y && !w.closed; y += w.step) {
        for (var x = w.low.x; x <= w.high.x; x += w.step) {
            let cell = vec2i(x, y);
            let caster = caster_at(w, cell);
            var beside = 0.0;
            var above = 0.0;
            if backprojection.gap_fill != 0u {
                beside = caster_at(w, cell - vec2i(w.step, 0));
                above = caster_at(w, cell - vec2i(0, w.step));
            }
            let corners = rectangle(w, cell, caster, beside, above);
            let inside = min(at - corners.xy, corners.zw - at);
            let within = min(inside.x, inside.y);
            if caster > 0.0 && within >= 0.0 {
                count++;
                outlined = outlined || within < 0.5 * line;
            }
        }
    }
    if w.hidden > 0.0 {
        count = 1u;
    }
    if abs(edge - 1.0) < line {
        return drawn(white, 0.7);
    }
    let color = select(select(2u, 4u, count == 1u), 1u, count == 0u);
    return drawn(color, select(select(0.55, 0.15, count == 0u), 1.0, outlined));
}

fn inspect_map(s: Surface) -> f32 {
    if frame.map == shows_light_samples {
        return light_dots(s.pixel);
    }
    if frame.map == shows_texel_rectangles {
        return texel_rectangles(s.pixel);
    }
    return inspect_filter(s);
}
