// Copies a depth map, whatever its format, into numbers that can be read back.

var shown: texture_2d<f32>;
var values: texture_storage_2d<r32float, write>;

@compute @workgroup_size(8, 8)
fn copy_map(@builtin(global_invocation_id) id: vec3u) {
    if all(id.xy < textureDimensions(values)) {
        textureStore(values, id.xy, vec4f(textureLoad(shown, id.xy, 0).x));
    }
}
