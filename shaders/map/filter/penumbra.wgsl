// Penumbras of lights with a size, by similar triangles (Fernando 2005).

// Half the light's extent along the map's sides, which run along a rectangle's, metres; a directional light's at a distance of 1.
fn half_light() -> vec2f {
    let sides = vec2f(length(frame.light_half_u), length(frame.light_half_v));
    return select(vec2f(frame.light_radius), sides, frame.light_kind == rect_area);
}

// Widths of the penumbras of straight edges across the map's sides, metres. Depths of receiver and caster are metres along the light's
// axis.
fn penumbra(depth: f32, casters: f32) -> vec2f {
    let away = max(depth - casters, 0.0);
    return 2.0 * half_light() * select(away / max(casters, 1e-6 * depth), away, frame.light_kind == directional);
}

// The wider of both.
fn widest_penumbra(depth: f32, casters: f32) -> f32 {
    let widths = penumbra(depth, casters);
    return max(widths.x, widths.y);
}

// Lengths in metres across the light along the map's sides, in texels, `most` at most; a disc's keep their ratio.
fn in_texels(metres: vec2f, density: vec2f, most: f32) -> vec2f {
    let wanted = metres * density;
    if frame.light_kind == rect_area {
        return min(wanted, vec2f(most));
    }
    return wanted * min(1.0, most / max(max(wanted.x, wanted.y), 1e-30));
}

// As far from the receiver as texels may lie that a filter reads up to `wanted` texels off: what fits leave free.
fn most_texels(layer: u32, wanted: f32) -> f32 {
    return max(min(wanted, light_views[layer].margin - 1.0 - normal_offset()), 0.0);
}
