//! Maps on the faces of a tetrahedron (Liao 2010) or an octahedron (Engelhardt, Dachsbacher 2008), two faces to a layer.

use super::cube::{Solid, look_up};
use super::{FILTERING, Info};
use crate::frame::Frame;
use crate::map::cascades::ANALYSED;
use crate::map::faces::{self, FaceParams, Faces};
use crate::map::fit::faces::{Around, Face};
use crate::map::peel::StoredParams;
use crate::map::{BiasParams, CasterParams, HardwareParams};
use crate::params::Params;

crate::params! {
    /// The solid around the light.
    pub struct AtlasParams {
        "Map" {
            /// The solid whose faces are drawn. Octahedron: eight faces in four layers; its texels differ least in area. Tetrahedron: four faces, one of each two cut in halves, in two layers; fewest draws, largest texels at its corners. Cube: six layers, for comparison.
            solid: choice("octahedron", ["cube", "octahedron", "tetrahedron"]),
            /// Side of each layer's square map; the largest one where it goes by importance.
            resolution: int(640, 16..=8192, "texels"),
            /// What sets the side. Fixed: the resolution. Importance: the size of the light's reach in the picture, so that each of many lights gets what it needs; by powers of two, and not below 32 texels.
            sizing: choice("fixed", ["fixed", "importance"]),
            /// Texels of a side for each pixel of the radius of the light's reach.
            importance: float(1.0, 0.25..=4.0, "texels/px") if sizing = "importance",
        }
    }
}

pub static INFO: Info = Info {
    id: "omni-atlas",
    title: "Tetrahedral and octahedral shadow maps",
    paper: "Liao 2010; Engelhardt, Dachsbacher 2008",
    family: "All directions",
    mark: 24,
    doc: "Maps on the faces of other solids than the cube, which share layers so that no texel is lost. Edges stay straight in each, \
          unlike a paraboloid's. The octahedron's texels are the most even ones by area; the tetrahedron takes the fewest draws.",
    lights: faces::LIGHTS,
    filter: None,
    params: crate::groups!(
        &[AtlasParams::GROUP, FaceParams::GROUP, CasterParams::GROUP],
        FILTERING,
        &[BiasParams::GROUP, StoredParams::GROUP, HardwareParams::GROUP],
    ),
    main: &[("resolution", "128..2048*2"), ("solid", "cube,octahedron,tetrahedron"), ("culling", "none,samples")],
    maps: &[&faces::MAPS, ANALYSED],
    make: |gpu, info| Ok(Box::new(Solid { faces: Faces::new(gpu)?, look_up: look_up(gpu, info), side, views })),
};

/// Side of a layer, texels. By importance R = k · radius of the light's reach in the picture, pixels, down to a power of two; all of the
/// resolution where the camera stands within reach.
fn side(f: &Frame) -> u32 {
    let p = AtlasParams::read(f.values);
    if p.sizing == "fixed" {
        return p.resolution;
    }
    let distance = (f.light.position() - f.camera.position).length();
    let reach = f.light.range();
    let focal = f.size[1] as f32 / 2.0 / (f.camera.fov.to_radians() / 2.0).tan();
    let wanted = match distance > reach {
        // The tangent cone of the sphere.
        true => p.importance * focal * reach / (distance * distance - reach * reach).sqrt(),
        false => f32::INFINITY,
    };
    let least = 32.min(p.resolution);
    let power = (wanted.clamp(1.0, 1e6) as u32).ilog2();
    if wanted >= p.resolution as f32 { p.resolution } else { (1 << power).clamp(least, p.resolution) }
}

fn views(around: &Around, f: &Frame) -> Vec<Face> {
    match AtlasParams::read(f.values).solid.as_str() {
        "cube" => around.cube(),
        "tetrahedron" => around.tetrahedron(),
        _ => around.octahedron(),
    }
}
