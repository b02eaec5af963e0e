//!include techniques/shadow_map.wgsl
// Stamminger, Drettakis 2002: one comparison in a map drawn in the space after the camera's perspective.
