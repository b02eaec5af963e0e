//! The cube shadow map (Gerasimov 2004), with faces and casters culled (King, Newhall 2005).

use super::{FILTERING, Info, Technique, chosen};
use crate::frame::Frame;
use crate::gpu::Gpu;
use crate::map::cascades::ANALYSED;
use crate::map::faces::{self, FaceParams, Faces, around};
use crate::map::filter::LookUp;
use crate::map::fit::faces::{Around, Face};
use crate::map::peel::StoredParams;
use crate::map::{BiasParams, CasterParams, HardwareParams};
use crate::params::Params;
use anyhow::Result;

crate::params! {
    /// The cube's maps.
    pub struct CubeParams {
        "Map" {
            /// Side of each face's square map. A cube has six.
            resolution: int(512, 16..=8192, "texels"),
        }
    }
}

pub static INFO: Info = Info {
    id: "cube",
    title: "Cube shadow map",
    paper: "Gerasimov 2004; King, Newhall 2005",
    family: "All directions",
    mark: 20,
    doc: "Six maps, one for each face of a cube around the lamp. Faces that no pixel looks up are not drawn at all. With the \
          lamp in view all six may be needed.",
    lights: faces::LIGHTS,
    filter: None,
    smooth: |_| false,
    params: crate::groups!(
        &[CubeParams::GROUP, FaceParams::GROUP, CasterParams::GROUP],
        FILTERING,
        &[BiasParams::GROUP, StoredParams::GROUP, HardwareParams::GROUP],
    ),
    main: &[("resolution", "128..2048*2"), ("culling", "none,samples")],
    maps: &[&faces::MAPS, ANALYSED],
    needs: |_| &[],
    make: |gpu, info| {
        let side = |f: &Frame| CubeParams::read(f.values).resolution;
        Ok(Box::new(Solid { faces: Faces::new(gpu)?, look_up: look_up(gpu, info), side, views: |a, _| a.cube() }))
    },
};

/// Passes that look faces up.
pub fn look_up(gpu: &Gpu, info: &'static Info) -> LookUp {
    LookUp::new(gpu, "map/around.wgsl", info.params)
}

/// A technique whose faces the light's place alone decides.
pub struct Solid {
    pub faces: Faces,
    pub look_up: LookUp,
    /// Texels of a layer's side.
    pub side: fn(&Frame) -> u32,
    pub views: fn(&Around, &Frame) -> Vec<Face>,
}

impl Technique for Solid {
    fn render(&mut self, f: &mut Frame) -> Result<()> {
        let filter = chosen(f.values);
        let around = around(f, (self.side)(f), (filter.reach)(f))?;
        let views = (self.views)(&around, f);
        self.faces.prepare(f, &around, &views);
        let maps = self.faces.draw(f, &around, &views)?;
        self.look_up.run(f, &maps, filter, &[])
    }
}
