//! Drawing casters into layers.

use super::peel::{Depths, Peel, StoredParams};
use super::{CasterParams, HardwareParams};
use crate::frame::Frame;
use crate::gpu::{Buffer, Gpu, Pass, Raster, Resource, hold};
use crate::params::{Group, Params};
use crate::scene::geometry::{SceneGpu, Vertex};
use anyhow::Result;

/// What the pipelines depend on: culling, the layer's format, the rasteriser's bias, and how the view is drawn.
type State = (String, wgpu::TextureFormat, HardwareParams, Drawing);

/// How a view's casters are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Drawing {
    /// As its matrix says.
    #[default]
    Straight,
    /// Its `perspective` is [`LightView::WARPED`](crate::light::LightView::WARPED).
    Warped,
    /// As its matrix says, into a part of the map: `region` is bound.
    Part,
    /// Its `perspective` is [`LightView::PARABOLOID`](crate::light::LightView::PARABOLOID): corners are moved, edges stay
    /// straight.
    Moved,
}

impl Drawing {
    /// The shader file of what is drawn as this, where `other` holds the rest, and the parameters that it reads beside
    /// the other's.
    pub fn file(self, other: &'static str) -> (&'static str, &'static [Group]) {
        match self {
            Drawing::Moved => ("map/moved.wgsl", &[CasterParams::GROUP, StoredParams::GROUP]),
            _ => (other, &[]),
        }
    }

    /// The faces that the rasteriser leaves out. On a side that mirrors they would be the wrong ones: there shaders do.
    pub fn culled(self, cull: &str) -> Option<wgpu::Face> {
        if self == Drawing::Moved { None } else { Raster::culled(cull) }
    }
}

/// Where a view's casters go.
#[derive(Clone, Copy)]
pub struct Target<'a> {
    /// Texels of the map's side.
    pub side: u32,
    pub light_view: &'a Buffer,
    pub drawing: Drawing,
    /// Of [`Drawing::Part`]: two half planes, as `region` in `shaders/map/casters.wgsl`.
    pub region: Option<&'a Buffer>,
    /// The layer holds nothing yet: all of it is cleared before.
    pub first: bool,
}

impl<'a> Target<'a> {
    /// All of a layer.
    pub fn whole(side: u32, light_view: &'a Buffer, warped: bool) -> Target<'a> {
        let drawing = if warped { Drawing::Warped } else { Drawing::Straight };
        Target { side, light_view, drawing, region: None, first: true }
    }

    /// What the casters' passes bind.
    pub fn bound(&self) -> Vec<(&'static str, Resource)> {
        let mut bound = vec![("light_view", self.light_view.into())];
        bound.extend(self.region.map(|region| ("region", region.into())));
        bound
    }
}

/// The passes that draw opaque and masked casters into a layer, made anew when what they depend on changes.
pub struct Casters {
    names: [&'static str; 2],
    passes: Option<(State, [Pass; 2])>,
    peel: Peel,
}

/// The triangles that a layer draws.
pub enum Triangles<'a> {
    All,
    /// Those of an index buffer, by two indexed indirect draws from a byte on: opaque and masked.
    Listed {
        indices: &'a Buffer,
        draws: &'a Buffer,
        at: u64,
    },
}

/// Bytes of an indexed indirect draw.
pub const DRAW: u64 = 20;

/// The format of depth that these parameters ask for.
pub fn format(p: &CasterParams) -> wgpu::TextureFormat {
    match p.format.as_str() {
        "16" => wgpu::TextureFormat::Depth16Unorm,
        "24" => wgpu::TextureFormat::Depth24Plus,
        _ => wgpu::TextureFormat::Depth32Float,
    }
}

impl Casters {
    /// Passes timed under these names.
    pub fn named(names: [&'static str; 2]) -> Casters {
        Casters { names, passes: None, peel: Peel::default() }
    }

    /// Draws casters into a layer.
    ///
    /// # Errors
    /// Passes that cannot be made.
    pub fn draw(&mut self, f: &mut Frame, layer: &wgpu::TextureView, to: Target, triangles: &Triangles) -> Result<()> {
        let cull = CasterParams::read(f.values).cull;
        let state = (cull, layer.texture().format(), HardwareParams::read(f.values), to.drawing);
        let names = self.names;
        let [opaque, masked] = hold(&mut self.passes, state, |state| passes(f.gpu, names, state))?;
        let scene = f.scene;
        let issue = |p: &mut wgpu::RenderPass, which| triangles.draw(scene, p, to.side, which);
        let depth = Some((layer, 0.0));
        let bound = to.bound();
        f.run(opaque).bind_all(&bound).draw(&[], depth, to.first, |p| issue(p, 0));
        if scene.opaque_count < scene.triangle_count {
            f.run(masked).bind_all(&bound).draw(&[], depth, false, |p| issue(p, 1));
        }
        Ok(())
    }

    /// Draws the layer number `i`: the nearest surfaces, and what is made of the two nearest where that is looked up.
    ///
    /// # Errors
    /// Passes that cannot be made.
    pub fn draw_depths(
        &mut self,
        f: &mut Frame,
        (depths, i): (&Depths, usize),
        to: Target,
        triangles: &Triangles,
    ) -> Result<()> {
        let nearest = &depths.nearest.each[i];
        self.draw(f, nearest, to, triangles)?;
        match &depths.peeled {
            Some(peeled) => self.peel.draw(f, [nearest, &peeled.each[i]], to, triangles),
            None => Ok(()),
        }
    }
}

impl Triangles<'_> {
    /// Draws the opaque (0) or the masked ones (1).
    pub fn draw(&self, scene: &SceneGpu, p: &mut wgpu::RenderPass, side: u32, which: u64) {
        p.set_viewport(0.0, 0.0, side as f32, side as f32, 0.0, 1.0);
        match self {
            Triangles::All if which == 0 => scene.draw_opaque(p),
            Triangles::All => scene.draw_masked(p),
            Triangles::Listed { indices, draws, at } => {
                scene.set_casters(p, indices);
                p.draw_indexed_indirect(draws, at + which * DRAW);
            }
        }
    }
}

/// Vertex shaders for opaque and masked casters, and whether casters between the light and the near plane stay by themselves:
/// they lie flat on it (pancaking).
pub fn vertices(gpu: &Gpu, drawing: Drawing) -> ([&'static str; 2], bool) {
    let straight = matches!(drawing, Drawing::Straight | Drawing::Part);
    let unclipped_depth = straight && gpu.abilities.features.contains(wgpu::Features::DEPTH_CLIP_CONTROL);
    let names = match drawing {
        Drawing::Warped => ["warped_caster", "warped_caster"],
        Drawing::Moved => ["moved_corner", "masked_moved_corner"],
        _ if unclipped_depth => ["caster", "masked_caster"],
        // Clamped by their corners where the rasteriser does not clamp.
        _ => ["clamped_caster", "clamped_masked_caster"],
    };
    (names, unclipped_depth)
}

fn passes(gpu: &Gpu, names: [&'static str; 2], (cull, format, hardware, drawing): &State) -> Result<[Pass; 2]> {
    let ([opaque, masked], unclipped_depth) = vertices(gpu, *drawing);
    let (file, groups) = drawing.file("map/casters.wgsl");
    let pass = |name, vertex, fragment: Option<&str>| {
        let raster = Raster {
            vertex,
            unclipped_depth,
            fragment,
            depth: Raster::nearest(*format).map(|state| wgpu::DepthStencilState {
                // Reversed depth: away from the light is down.
                bias: wgpu::DepthBiasState {
                    constant: -(hardware.hardware_bias as i32),
                    slope_scale: -hardware.hardware_slope,
                    clamp: -hardware.hardware_clamp,
                },
                ..state
            }),
            cull: drawing.culled(cull),
            vertices: Some(Vertex::LAYOUT),
            ..Raster::default()
        };
        Pass::render(gpu, name, file, raster, groups)
    };
    let fragments = match drawing {
        Drawing::Straight => [None, Some("masked")],
        Drawing::Warped => [Some("warped"), Some("warped_masked")],
        Drawing::Part => [Some("part"), Some("part_masked")],
        Drawing::Moved => [Some("keep_moved"), Some("keep_moved_masked")],
    };
    Ok([pass(names[0], opaque, fragments[0])?, pass(names[1], masked, fragments[1])?])
}
