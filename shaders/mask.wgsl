//!include lib/frame.wgsl
//!include lib/gbuffer.wgsl
// Which pixels count: 0 background, 1 turned away from the light, 2 facing it and reached by it, 3 facing it outside its
// cone or range.

var mask: texture_storage_2d<r32uint, write>;

@compute @workgroup_size(8, 8)
fn classify(@builtin(global_invocation_id) id: vec3u) {
    if id.x < frame.size.x && id.y < frame.size.y {
        let s = load_surface(id.xy);
        var kind = 0u;
        if s.valid {
            let reached = select(3u, 2u, light_at(s.position).reached);
            kind = select(1u, reached, faces_light(s));
        }
        textureStore(mask, id.xy, vec4u(kind));
    }
}
