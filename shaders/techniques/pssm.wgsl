//!include lib/lookup_cascades.wgsl
// Zhang, Sun, Xu, Lun 2006: a shadow map for each part of the view frustum.

fn inspect_map(s: Surface) -> f32 {
    return inspect_cascades(s);
}
