//!include map/choose/faces.wgsl
//!include map/place/straight.wgsl
//!include techniques/edsm/edges.wgsl
// Edge distances in the maps of a cube's faces.
