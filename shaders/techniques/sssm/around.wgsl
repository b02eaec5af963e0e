//!include map/choose/faces.wgsl
//!include map/place/straight.wgsl
//!include techniques/sssm/points.wgsl
// Silhouette points in the maps of a cube's faces.
