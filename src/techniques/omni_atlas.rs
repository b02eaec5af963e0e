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
            /// Side of each layer's square map.
            resolution: int(640, 16..=8192, "texels"),
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
    main: &[("resolution", "128..2048*2"), ("solid", "cube,octahedron,tetrahedron")],
    maps: &[&faces::MAPS, ANALYSED],
    make: |gpu, info| {
        let side = |f: &Frame| AtlasParams::read(f.values).resolution;
        Ok(Box::new(Solid { faces: Faces::new(gpu)?, look_up: look_up(gpu, info), side, views }))
    },
};

fn views(around: &Around, f: &Frame) -> Vec<Face> {
    match AtlasParams::read(f.values).solid.as_str() {
        "cube" => around.cube(),
        "tetrahedron" => around.tetrahedron(),
        _ => around.octahedron(),
    }
}
