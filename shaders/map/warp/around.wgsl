//!include map/warp/warped.wgsl
//!include map/choose/faces.wgsl
// Maps of a light that shines in all directions, each with a warp of its own.

fn in_layer(position: vec3f) -> bool {
    return face_of(position - frame.light_position) == light_view.layer;
}

// The layer whose warp is shown: the one that the probed surface is looked up in, or the one that most pixels are.
fn shown_layer() -> u32 {
    let probe = probed_pixel();
    if all(probe < frame.size) {
        let s = load_surface(probe);
        if s.valid && faces_light(s) {
            return choose(s).layer;
        }
    }
    var most = 0u;
    for (var i = 1u; i < faces.count; i++) {
        most = select(most, i, face_samples[i] > face_samples[most]);
    }
    return most;
}

fn inspect_map(s: Surface) -> f32 {
    switch frame.map {
        case shows_faces, shows_shadow_maps, shows_face_load, shows_texel_angle, shows_solid_angle, shows_texels, shows_bias: {
            return inspect_faces(s);
        }
        default: {
            warped_layer = shown_layer();
            return inspect_warped(s);
        }
    }
}

// Of all layers together what their passes told: the first of `state.counters`, and of each face the triangles that it met, as
// map/faces.wgsl writes them.
var<storage, read_write> told: array<u32, 5>;
var<storage, read_write> told_draws: array<u32>;

// After a layer's passes.
@compute @workgroup_size(1)
fn tell() {
    for (var k = 0u; k < 5u; k++) {
        told[k] += atomicLoad(&state.counters[k]);
    }
    told_draws[10u * light_view.layer] = 3u * atomicLoad(&state.counters[kept_count]);
    told_draws[10u * light_view.layer + 5u] = 0u;
}
