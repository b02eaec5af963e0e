//!include lib/listed.wgsl
//!include lib/shadow_ray.wgsl
// Shadow rays of listed pixels only.

// Of an indirect dispatch: workgroups along x, y and z.
var<storage, read_write> dispatch: array<u32>;
var visibility_out: texture_storage_2d<r32float, write>;

@compute @workgroup_size(1)
fn count() {
    let groups = (listed_number() + 63u) / 64u;
    dispatch[0] = min(groups, listed_row);
    dispatch[1] = (groups + listed_row - 1u) / listed_row;
    dispatch[2] = 1u;
}

@compute @workgroup_size(64)
fn resolve(@builtin(global_invocation_id) id: vec3u) {
    let i = listed_index(id);
    if i >= listed_number() {
        return;
    }
    let pixel = listed_pixel(i);
    let s = load_surface(pixel);
    var ray = shadow_ray(s, light_at(s.position));
    ray.t_max = min(ray.t_max, listed[i].end);
    let hit = trace(ray);
    tally_ray(hit);
    textureStore(visibility_out, pixel, vec4f(select(1.0, 0.0, hit.blocked)));
}
