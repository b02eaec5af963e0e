//!include techniques/shadow_map.wgsl
// Wimmer, Scherzer, Purgathofer 2004: one comparison in a map that is warped along the view.
