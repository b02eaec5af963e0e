//!include map/choose/single.wgsl
//!include map/place/straight.wgsl
//!include techniques/edsm/edges.wgsl
// Edge distances in a single map.
