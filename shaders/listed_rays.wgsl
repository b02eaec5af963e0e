//!include lib/listed.wgsl
//!include lib/shadow_ray.wgsl
// Shadow rays of listed pixels only.

// Of an indirect dispatch: workgroups along x, y and z.
var<storage, read_write> dispatch: array<u32>;
var visibility_out: texture_storage_2d<r32float, write>;

// Most workgroups along x.
const row = 32768u;

@compute @workgroup_size(1)
fn count() {
    let groups = (min(atomicLoad(&listed_count), arrayLength(&listed)) + 63u) / 64u;
    dispatch[0] = min(groups, row);
    dispatch[1] = (groups + row - 1u) / row;
    dispatch[2] = 1u;
}

@compute @workgroup_size(64)
fn resolve(@builtin(global_invocation_id) id: vec3u) {
    let i = id.x + id.y * row * 64u;
    if i >= min(atomicLoad(&listed_count), arrayLength(&listed)) {
        return;
    }
    let entry = listed[i];
    let pixel = vec2u(entry.pixel & 0xffffu, entry.pixel >> 16u);
    let s = load_surface(pixel);
    var ray = shadow_ray(s, light_at(s.position));
    ray.t_max = min(ray.t_max, entry.end);
    let hit = trace(ray);
    tally_ray(hit);
    textureStore(visibility_out, pixel, vec4f(select(1.0, 0.0, hit.blocked)));
}
