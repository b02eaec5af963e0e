//!include map/choose/faces.wgsl
//!include map/place/straight.wgsl
//!include techniques/hybrid_pcf/agree.wgsl
// Agreement in a cube's maps. The window lies in their guard bands.
