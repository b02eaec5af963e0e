//!include map/warp/single.wgsl
//!include map/warp/notw.wgsl
// Non-orthogonal texture warping of one map.
