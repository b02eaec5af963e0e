//!include map/choose/single.wgsl
//!include map/place/straight.wgsl
//!include techniques/sssm/points.wgsl
// Silhouette points in a single map.
