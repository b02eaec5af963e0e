//!include map/warp/around.wgsl
//!include map/warp/forward.wgsl
// Rectilinear texture warping of a cube's faces and a paraboloid's sides, each by an importance of its own.
