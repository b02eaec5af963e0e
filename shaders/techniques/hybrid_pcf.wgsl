//!include map/choose/single.wgsl
//!include map/place/straight.wgsl
//!include techniques/hybrid_pcf/agree.wgsl
// Agreement in a single map.
