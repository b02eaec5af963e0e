//!include techniques/shadow_map.wgsl
// Martin, Tan 2004: one comparison in a map that holds a trapezoid of the light's image.
