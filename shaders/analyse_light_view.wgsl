//!include lib/straight.wgsl
//!include lib/place.wgsl
// The analysis of techniques with one light view.
