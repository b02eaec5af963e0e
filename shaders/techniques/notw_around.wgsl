//!include map/warp/around.wgsl
//!include map/warp/notw.wgsl
// Non-orthogonal texture warping of a cube's faces and a paraboloid's sides (Navratil 2015, section 5.3.1).
