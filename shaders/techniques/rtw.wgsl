//!include map/warp/single.wgsl
//!include map/warp/forward.wgsl
// Rectilinear texture warping of one map.
