//!include map/faces_of.wgsl
// How many workgroups passes over layers get: none where no face of the layer is drawn, as nothing looks it up.

// Numbers of workgroups, x and y, that a layer in use gets.
var<uniform> sizes: array<vec4u, most_sizes>;
// As map/faces.wgsl and map/warp/faces.wgsl write them.
var<storage, read> face_draws: array<u32>;
// Of each layer, for each size, the arguments of an indirect dispatch.
var<storage, read_write> dispatches: array<u32>;

const most_sizes = 32u;

// One thread an entry.
@compute @workgroup_size(64)
fn plan(@builtin(global_invocation_id) id: vec3u) {
    let layer = id.x / most_sizes;
    var busy = 0u;
    for (var i = 0u; i < faces.count; i++) {
        let drawn = face_draws[10u * i + 1u] > 0u;
        busy |= u32(drawn && u32(faces.axes[i].w) == layer);
    }
    let size = sizes[id.x % most_sizes].xy * busy;
    dispatches[3u * id.x] = size.x;
    dispatches[3u * id.x + 1u] = size.y;
    dispatches[3u * id.x + 2u] = busy;
}
