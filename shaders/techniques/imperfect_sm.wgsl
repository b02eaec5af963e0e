//!include map/choose/single.wgsl
//!include map/place/straight.wgsl
//!include map/look_up.wgsl
//!include techniques/imperfect_sm/bounces.wgsl
// Direct light by a single map.
