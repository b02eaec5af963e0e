//!include lib/frame.wgsl
//!include lib/gbuffer.wgsl
// Between which depths view samples lie that the light may reach.

// Of the depths along the camera's axis the smallest, as the largest complement, and the largest: bits of floats.
var<storage, read_write> range: array<atomic<u32>, 2>;

// Smallest and largest depth; x ≤ 0: no samples.
fn depth_range() -> vec2f {
    let low = atomicLoad(&range[0]);
    return select(vec2f(0.0), vec2f(bitcast<f32>(0xffffffffu - low), bitcast<f32>(atomicLoad(&range[1]))), low > 0u);
}

var<workgroup> tile_range: array<atomic<u32>, 2>;

// A workgroup takes 64 × 64 pixels.
@compute @workgroup_size(8, 8)
fn find_range(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_id) local: vec3u,
              @builtin(local_invocation_index) index: u32) {
    var low = 0u;
    var high = 0u;
    for (var k = 0u; k < 64u; k++) {
        let z = bitcast<u32>(lit_sample(group.xy * 64u + vec2u(k % 8u, k / 8u) * 8u + local.xy).w);
        if z > 0u {
            low = max(low, 0xffffffffu - z);
            high = max(high, z);
        }
    }
    atomicMax(&tile_range[0], low);
    atomicMax(&tile_range[1], high);
    workgroupBarrier();
    if index < 2u {
        atomicMax(&range[index], atomicLoad(&tile_range[index]));
    }
}
