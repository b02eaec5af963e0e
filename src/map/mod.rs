//! Maps: where they look × how they are looked up.
//!
//! A fit gives [`Maps`]: layers with their depth, the light view of each, and what a shader in `shaders/map/choose/` and one
//! in `shaders/map/place/` need to find a surface's texel. A [`filter::Filter`] looks layers up, whoever drew them: see
//! [`filter::LookUp`]. A single map is one layer.

pub mod busy;
pub mod cascades;
pub mod casters;
mod clusters;
pub mod conservative;
pub mod edge_quads;
pub mod faces;
pub mod filter;
pub mod fit;
mod layers;
pub mod noise;
pub mod paraboloid;
pub mod peel;
pub mod places;
pub mod plain;
pub mod prefilter;
pub mod pyramid;
pub mod silhouettes;
pub mod single;
pub mod sums;
pub mod warp;

pub use layers::Layers;

use crate::frame::Frame;
use crate::gpu::{Buffer, Gpu, Resource};
use crate::light::LightView;
use crate::params::Params;
use anyhow::{Context, Result};
use fit::Scope;

crate::params! {
    /// A single map.
    pub struct MapParams {
        "Map" {
            /// Side of the square shadow map, around a lamp of that of each face. Double it, and the stairs at a shadow's edge are half as large.
            resolution: int(1024, 64..=8192, "texels"),
        }
    }
}

crate::params! {
    /// How casters are drawn into every layer.
    pub struct CasterParams {
        "Map" {
            /// Which faces are left out of the map, as seen from the light. Front: the bias then acts at the back faces.
            cull: choice("none", ["none", "front", "back"]),
            /// Precision of the stored depth, bits; f: a floating-point number.
            format: choice("32f", ["32f", "24", "16"]),
        }
    }
}

crate::params! {
    /// How the comparison with a map is moved.
    pub struct BiasParams {
        "Bias" {
            /// How the comparison is moved. None: not at all. Slope: by a constant and in proportion to the receiver's slope. Ray-plane: each texel is compared with the depth at which its own light ray meets the receiver's plane.
            bias_kind: choice("slope", ["none", "slope", "ray-plane"]),
            /// How far the light's ray must meet something before the receiver's plane, in millionths of the scene's diagonal. Only for rounding: one value serves all scenes.
            epsilon: float(100.0, 0.1..=10000.0, "ppm") if bias_kind = "ray-plane",
            /// Never compare farther from the light than the receiver is, though its plane may fall away there. Off: the plane's depth everywhere, as Dou et al. have it. Shadows then stay whole at contacts, but inner corners that are lit turn dark.
            toward_light: flag(true) if bias_kind = "ray-plane",
            /// Depth added before the comparison, along the light's axis. Too little: acne. Too much: shadows detach (peter-panning).
            bias: float(0.002, 0.0..=100.0, "m", 0.1 of view) if bias_kind = "slope",
            /// Depth added in proportion to the receiver's slope and the texel's size; 0.71 (half a texel's diagonal) is just enough for one nearest sample on a plane.
            slope_bias: float(0.75, 0.0..=8.0, "× texel") if bias_kind = "slope",
            /// Tilts the comparison along the receiver's plane, so that wide filters need no larger bias.
            receiver_plane: flag(false) if bias_kind = "slope",
            /// The largest tangent of the receiver's slope that is followed; 57 is what the sun 1° above the ground needs.
            slope_limit: float(10.0, 1.0..=60.0, "") if slope_bias > 0.0 or receiver_plane = true or bias_kind = "ray-plane" or bias_kind = "slope" and subdivision > 1 or edges = "silhouette" or edges = "all" or change = "both" or change = "conservative",
            /// Moves the receiver along its normal before the look-up, farther where light grazes it. Shifts the edges of all shadows sideways.
            normal_offset: float(0.0, 0.0..=4.0, "texels") if bias_kind = "slope",
        }
    }
}

crate::params! {
    /// The rasteriser's bias, where it makes the depth.
    pub struct HardwareParams {
        "Rasteriser bias" {
            /// Bias added by the rasteriser, in the smallest steps of the depth format (for 32f: of the exponent).
            hardware_bias: int(0, 0..=1024, "steps"),
            /// Bias added by the rasteriser in proportion to the triangle's largest depth slope per texel.
            hardware_slope: float(0.0, 0.0..=8.0, "× slope"),
            /// The most that the rasteriser may add; 0: no limit.
            hardware_clamp: float(0.0, 0.0..=0.1, "× range") if hardware_bias > 0 or hardware_slope > 0.0,
        }
    }
}

/// Most layers of a technique, `most_layers` in WGSL.
pub const MOST: usize = 8;

/// Layers with their depth, drawn, and what a shader needs to find a surface in them.
pub struct Maps {
    pub layers: Layers,
    /// [`MOST`] light views, of which each layer has its own.
    pub light_views: Buffer,
    /// Texels of each layer's side.
    pub sides: Vec<u32>,
    /// What `choose` and `map_texel` read beside, by name.
    pub bound: Vec<(&'static str, Resource)>,
}

/// A buffer for the light views of all layers; the first is `light_view` too.
pub fn light_views(gpu: &Gpu, label: &str) -> Buffer {
    let usage = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC;
    gpu.buffer(label, &[0; MOST * size_of::<LightView>()], usage)
}

/// The uniform buffer with these words, made once.
fn uniform_of<W: bytemuck::Pod + PartialEq>(held: &mut Vec<(W, Buffer)>, gpu: &Gpu, label: &str, words: W) -> Buffer {
    if let Some((_, buffer)) = held.iter().find(|(w, _)| *w == words) {
        return buffer.clone();
    }
    let buffer = gpu.buffer(label, bytemuck::bytes_of(&words), wgpu::BufferUsages::UNIFORM);
    held.push((words, buffer.clone()));
    buffer
}

/// The light's view of the whole scene.
///
/// # Errors
/// A light without a single view.
pub fn whole(scope: &Scope) -> Result<LightView> {
    LightView::whole(&scope.light, scope.bounds, scope.resolution, scope.margin)
        .with_context(|| format!("a {} light has no single shadow map", scope.light.kind()))
}

/// Texels that stay free at each border of a map beside a filter's reach: the receiver's own, and what the normal offset moves
/// it by.
pub fn margin(f: &Frame) -> f32 {
    let p = BiasParams::read(f.values);
    1.0 + if p.bias_kind == "slope" { p.normal_offset } else { 0.0 }
}
