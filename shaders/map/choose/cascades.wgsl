//!include map/splits.wgsl
//!include map/place/straight.wgsl
//!include map/look_up.wgsl
//!include map/tiles.wgsl
//!include map/choose/whole_layers.wgsl
// Choosing among cascades, and the maps that techniques with cascades show.

fn choose(s: Surface) -> Chosen {
    let depth = cascade_depth(s.position, s.depth);
    let i = cascade_of(depth);
    return Chosen(i, i + 1u, blend_of(depth, i));
}

fn inside(v: LightView, p: vec3f) -> bool {
    let clip = light_clip(v, p);
    return all(abs(clip.xy) < vec2f(clip.w)) && clip.z > 0.0 && clip.z < clip.w;
}

// The upright plane through the camera's axis, the camera at the left: its frustum by cascades, split planes white, and
// the cross-sections of the light views' boxes as outlines.
fn side_view(pixel: vec2u) -> f32 {
    let eye = frame.shadow_eye;
    let forward = frame.shadow_forward;
    // Half the picture's height at a depth is that of 0 and a slope times the depth.
    let parallel = frame.shadow_orthographic == 1u;
    let half = 1.0 / length(frame.shadow_up);
    let slope = select(half, 0.0, parallel);
    let least = select(0.0, half, parallel);
    let up = normalize(frame.shadow_up);
    // As far as the scene goes, or the camera sees.
    let sides = max(abs(frame.bounds_min - eye), abs(frame.bounds_max - eye));
    let end = min(split(fitting.count), dot(sides, abs(forward)));
    let size = vec2f(frame.size);
    let scale = max(1.1 * end / size.x, 2.2 * (least + end * slope) / size.y);
    let x = (f32(pixel.x) + 0.5) * scale - 0.05 * end;
    let y = (0.5 * size.y - f32(pixel.y) - 0.5) * scale;
    let p = eye + x * forward + y * up;
    for (var i = 0u; i < fitting.count; i++) {
        let v = light_views[i];
        let here = inside(v, p);
        let next = vec3f(1.5 * scale);
        if here && !(inside(v, p + next * forward) && inside(v, p - next * forward) && inside(v, p + next * up) && inside(v, p - next * up)) {
            return drawn(i, 0.95);
        }
    }
    if x < split(0u) || x > end || abs(y) > least + x * slope {
        return drawn(white, 0.0);
    }
    for (var i = 0u; i <= fitting.count; i++) {
        if abs(x - split(i)) < 0.75 * scale {
            return drawn(white, 0.9);
        }
    }
    return drawn(cascade_of(x), 0.4);
}

// The views of every technique with cascades.
fn inspect_cascades(s: Surface) -> f32 {
    if frame.map == shows_shadow_maps {
        return maps_picture(s.pixel, fitting.count);
    }
    if frame.map == shows_side {
        return side_view(s.pixel);
    }
    if !s.valid {
        return -1.0;
    }
    let c = choose(s);
    if frame.map == shows_cascades {
        // A frozen camera leaves surfaces without a map.
        let r = receive(s, c.layer, 0.0, 1.0);
        return select(label(c.layer, 0.5), -1.0, frame.frozen == 1u && outside_map(r, r.texel));
    }
    if frame.map == shows_seams {
        return select(-1.0, c.share, c.share > 0.0);
    }
    return inspect_filter(s);
}
