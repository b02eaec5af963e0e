//!include map/choose/faces.wgsl
//!include map/place/straight.wgsl
//!include techniques/imperfect_sm/bounces.wgsl
// Direct light by a cube's maps.
