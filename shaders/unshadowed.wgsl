//!include lib/frame.wgsl
// Full visibility: what is drawn while no technique serves the light.

var visibility_out: texture_storage_2d<r32float, write>;

@compute @workgroup_size(8, 8)
fn fill(@builtin(global_invocation_id) id: vec3u) {
    if id.x < frame.size.x && id.y < frame.size.y {
        textureStore(visibility_out, id.xy, vec4f(1.0));
    }
}
