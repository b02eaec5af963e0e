//!include lib/frame.wgsl
//!include lib/gbuffer.wgsl
// The resolve pass of filter techniques, which write `fn visibility(s: Surface) -> f32`.

var visibility_out: texture_storage_2d<r32float, write>;
var map_out: texture_storage_2d<r32float, write>;

@compute @workgroup_size(8, 8)
fn resolve(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= frame.size.x || id.y >= frame.size.y {
        return;
    }
    let s = load_surface(id.xy);
    var v = 1.0;
    if s.valid {
        v = 0.0;
        let light = light_at(s.position);
        if light.reached && dot(s.normal, light.to_light) > 0.0 {
            v = visibility(s);
        }
    }
    textureStore(visibility_out, id.xy, vec4f(v));
}

// Draws the technique's own map, `fn inspect_map(s: Surface) -> f32`; -1 where there is nothing to show.
@compute @workgroup_size(8, 8)
fn inspect(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= frame.size.x || id.y >= frame.size.y {
        return;
    }
    textureStore(map_out, id.xy, vec4f(inspect_map(load_surface(id.xy))));
}
