//!include map/choose/single.wgsl
//!include map/place/straight.wgsl
//!include map/look_up.wgsl
// A single map that is drawn as its light view says.

fn inspect_map(s: Surface) -> f32 {
    return inspect_filter(s);
}
