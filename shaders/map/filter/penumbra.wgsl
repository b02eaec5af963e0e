// Penumbras of lights with a size, by similar triangles (Fernando 2005).

// Width of a straight edge's penumbra, metres. Depths of receiver and caster are metres along the light's axis.
fn penumbra(depth: f32, casters: f32) -> f32 {
    let away = max(depth - casters, 0.0);
    return 2.0 * frame.light_radius * select(away / max(casters, 1e-6 * depth), away, frame.light_kind == directional);
}

// A length in metres across the light, in texels along the map's sides; the longer is `most` at most.
fn in_texels(metres: f32, density: vec2f, most: f32) -> vec2f {
    let wanted = metres * density;
    return wanted * min(1.0, most / max(max(wanted.x, wanted.y), 1e-30));
}

// As far from the receiver as texels may lie that a filter reads up to `wanted` texels off: what fits leave free.
fn most_texels(layer: u32, wanted: f32) -> f32 {
    return max(min(wanted, light_views[layer].margin - 1.0 - normal_offset()), 0.0);
}
