//!include map/choose/faces.wgsl
//!include map/place/straight.wgsl
// Maps of lights that share an atlas.

struct Slots {
    count: u32,
    // Texels of the atlas' side.
    side: u32,
    // The slot of the light that is drawn.
    own: u32,
    padding: u32,
    // Left, top and side, texels; the light's place among all.
    each: array<vec4u, 16>,
}

var<uniform> slots: Slots;

fn inspect_map(s: Surface) -> f32 {
    if frame.map == shows_atlas {
        return atlas_drawn(s.pixel);
    }
    return inspect_faces(s);
}

// The atlas, as large as the picture allows.
fn atlas_drawn(pixel: vec2u) -> f32 {
    let picture = vec2f(frame.size);
    let scale = f32(slots.side) / (0.96 * min(picture.x, picture.y));
    let at = (vec2f(pixel) + 0.5 - 0.5 * picture) * scale + 0.5 * f32(slots.side);
    if any(at < vec2f(0.0)) || any(at >= vec2f(f32(slots.side))) {
        return drawn(white, 0.0);
    }
    for (var i = 0u; i < slots.count; i++) {
        let slot = slots.each[i];
        let inner = at - vec2f(slot.xy);
        let side = f32(slot.z);
        if any(inner < vec2f(0.0)) || any(inner >= vec2f(side)) {
            continue;
        }
        let owner = slot.w % 8u;
        if any(inner < vec2f(1.5 * scale)) || any(inner >= vec2f(side - 1.5 * scale)) {
            return drawn(owner, 1.0);
        }
        if i != slots.own {
            return drawn(owner, 0.4);
        }
        let face = face_at(0u, inner);
        return drawn(owner, select(0.1, 0.15 + 0.8 * nearness(face, vec2u(inner)), face_drawn(face)));
    }
    // Free.
    return drawn(white, 0.06);
}
