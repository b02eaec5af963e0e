//!include map/warp/around.wgsl
//!include map/warp/rtw.wgsl
// Rectilinear texture warping of a cube's faces and a paraboloid's sides, each by the importance of its own view samples.

fn edges_at_pixels() -> bool {
    return true;
}
