//! What a texel stands for beside its nearest surface: something between that and the next one, or the next one.

use super::casters::{Drawing, Target, Triangles, format, vertices};
use super::{CasterParams, Layers};
use crate::frame::Frame;
use crate::gpu::{Gpu, Pass, Raster, hold};
use crate::params::Params;
use crate::scene::geometry::Vertex;
use anyhow::Result;

crate::params! {
    /// Which depth a texel holds of the surfaces that its light ray meets.
    pub struct StoredParams {
        "Bias" {
            /// The depth that a texel holds. Nearest: of the surface nearest to the light. Midpoint: halfway from there to the next surface. Dual: halfway, but no farther than a limit. Second: of the next surface. All but nearest draw the casters twice and need no bias on closed bodies, save at their outlines.
            stored: choice("nearest", ["nearest", "midpoint", "dual", "second"]),
            /// The farthest that a depth is moved behind the nearest surface.
            dual_limit: float(0.1, 0.0..=100.0, "m", 0.1 of view) if stored = "dual",
        }
    }
}

/// Layers that are kept from frame to frame: those of the nearest surfaces, and those made of the two nearest.
#[derive(Default)]
pub struct Held {
    nearest: Option<Layers>,
    peeled: Option<Layers>,
}

/// The layers that casters are drawn into.
pub struct Depths {
    pub nearest: Layers,
    /// Made of the two nearest surfaces, where these are looked up.
    pub peeled: Option<Layers>,
}

impl Depths {
    /// The layers that a frame's parameters ask for, held.
    ///
    /// # Errors
    /// More or larger layers than the adapter takes.
    pub fn hold(held: &mut Held, f: &mut Frame, sides: &[u32]) -> Result<Depths> {
        let format = format(&CasterParams::read(f.values));
        if StoredParams::read(f.values).stored == "nearest" {
            held.peeled = None;
            return Ok(Depths { nearest: Layers::hold(&mut held.nearest, f.gpu, sides, format)?, peeled: None });
        }
        let nearest = Layers::hold(&mut held.nearest, f.gpu, sides, format)?;
        Ok(Depths { nearest, peeled: Some(Layers::hold(&mut held.peeled, f.gpu, sides, format)?) })
    }

    /// Those that filters look up.
    pub fn looked_up(&self) -> Layers {
        self.peeled.as_ref().unwrap_or(&self.nearest).clone()
    }
}

/// What the pipelines depend on: culling, the layer's format, and how the view is drawn.
type State = (String, wgpu::TextureFormat, Drawing);

/// The passes that make a layer of the two nearest surfaces: texels with one surface only, opaque and masked casters.
#[derive(Default)]
pub struct Peel {
    passes: Option<(State, [Pass; 3])>,
}

impl Peel {
    /// Draws casters once more into the second layer, without what lies on the nearest surface, which is in the first.
    ///
    /// # Errors
    /// Passes that cannot be made.
    pub fn draw(
        &mut self,
        f: &mut Frame,
        [nearest, layer]: [&wgpu::TextureView; 2],
        to: Target,
        triangles: &Triangles,
    ) -> Result<()> {
        let state = (CasterParams::read(f.values).cull, layer.texture().format(), to.drawing);
        let [alone, opaque, masked] = hold(&mut self.passes, state, |state| passes(f.gpu, state))?;
        let scene = f.scene;
        let mut bound = to.bound();
        bound.push(("nearest_depth", nearest.into()));
        let (side, depth) = (to.side, Some((layer, 0.0)));
        f.run(alone).bind_all(&bound).uncounted().draw(&[], depth, to.first, |p| {
            p.set_viewport(0.0, 0.0, side as f32, side as f32, 0.0, 1.0);
            p.draw(0..3, 0..1);
        });
        f.run(opaque)
            .bind_all(&bound)
            .for_layer(nearest)
            .draw(&[], depth, false, |p| triangles.draw(scene, p, side, 0));
        if scene.opaque_count < scene.triangle_count {
            f.run(masked)
                .bind_all(&bound)
                .for_layer(nearest)
                .draw(&[], depth, false, |p| triangles.draw(scene, p, side, 1));
        }
        Ok(())
    }
}

fn passes(gpu: &Gpu, (cull, format, drawing): &State) -> Result<[Pass; 3]> {
    let groups = [CasterParams::GROUP, StoredParams::GROUP];
    let (file, _) = drawing.file("map/peel.wgsl");
    let pass = |name, raster| Pass::render(gpu, name, file, raster, &groups);
    let ([opaque, masked], unclipped_depth) = vertices(gpu, *drawing);
    let casters = |vertex, fragment| Raster {
        vertex,
        unclipped_depth,
        fragment: Some(fragment),
        depth: Raster::nearest(*format),
        cull: drawing.culled(cull),
        vertices: Some(Vertex::LAYOUT),
        ..Raster::default()
    };
    let fragments = match drawing {
        Drawing::Straight => ["peel", "peel_masked"],
        Drawing::Warped => ["peel_warped", "peel_warped_masked"],
        Drawing::Part => ["peel_part", "peel_part_masked"],
        Drawing::Moved => ["peel_moved", "peel_moved_masked"],
    };
    let alone = Raster {
        vertex: "whole_layer",
        fragment: Some("single_surface"),
        depth: Raster::nearest(*format),
        ..Raster::default()
    };
    Ok([
        pass("single surfaces", alone)?,
        pass("second surfaces", casters(opaque, fragments[0]))?,
        pass("second surfaces (masked)", casters(masked, fragments[1]))?,
    ])
}
