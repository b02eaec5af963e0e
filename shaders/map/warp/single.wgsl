//!include map/warp/warped.wgsl
//!include map/choose/single.wgsl
// One map with a warp.

fn in_layer(position: vec3f) -> bool {
    return true;
}

fn inspect_map(s: Surface) -> f32 {
    return inspect_warped(s);
}
