//! Soft shadows as the mean over hard ones from places all over the light.

use super::rt_soft::LIGHT_SAMPLES;
use super::{Info, MAPS, NEAREST, Technique};
use crate::frame::Frame;
use crate::gpu::{Buffer, Gpu, Pass, hold};
use crate::map::filter::{Reach, alone};
use crate::map::peel::StoredParams;
use crate::map::places::{PENUMBRA, PlaceSet, PlacedMaps, PlacesFitParams, Spared, grid};
use crate::map::{BiasParams, CasterParams, HardwareParams, MapParams};
use crate::params::Params;
use anyhow::Result;
use glam::Vec2;
use wgpu::BufferUsages as Use;

crate::params! {
    /// Where maps are drawn from.
    pub struct AreaUniformParams {
        "Light samples" {
            /// Places along each side of the light, so that as many maps are drawn as this times itself. Too few: the penumbra is bands, a step for each.
            side: int(6, 1..=16, "places"),
            /// Where they lie. Centers: in the middles of as many cells, each of which stands for its part of the light. Corners: evenly from edge to edge, as Zerari et al. have them: those at the edges stand for too much, and penumbras are too wide, by a factor of 1.18 with six.
            placement: choice("centers", ["centers", "corners"]),
            /// Texels along each side of the window whose comparisons are averaged in each map (PCF): the bands of few places flow together.
            kernel: int(3, 1..=5, "texels", 2),
            /// Maps that are drawn into layers of one texture and looked up together. 1: each is added to the sum by itself (accumulation), which reads every pixel's surface again.
            layers: int(8, 1..=8, "maps"),
        }
    }
}

pub static INFO: Info = Info {
    id: "area-uniform",
    title: "Light sampling, uniform",
    paper: "Heckbert, Herf 1997; Zerari et al. 2014",
    family: "Soft shadows",
    mark: 42,
    doc: "A shadow map from each of k × k places of the light, and the mean of what they see: each is a hard shadow, and together they are \
          soft. Right with places enough; with few, bands.",
    lights: &["directional", "spot", "rect-area"],
    filter: Some(NEAREST),
    smooth: |_| false,
    params: &[
        PlacesFitParams::GROUP,
        MapParams::GROUP,
        AreaUniformParams::GROUP,
        CasterParams::GROUP,
        BiasParams::GROUP,
        StoredParams::GROUP,
        HardwareParams::GROUP,
    ],
    main: &[("resolution", "256..1024*2"), ("side", "3,6,9"), ("kernel", "1,3")],
    maps: &[&[LIGHT_SAMPLES, PENUMBRA], MAPS],
    needs: |_| &[],
    make: |gpu, _| Ok(Box::new(AreaUniform::new(gpu)?)),
};

const FILE: &str = "techniques/area_uniform.wgsl";

/// The places, and the same on the GPU.
type Held = (Vec<Vec2>, Buffer);

struct AreaUniform {
    maps: PlacedMaps,
    mean: Pass,
    places: Option<Held>,
}

impl AreaUniform {
    fn new(gpu: &Gpu) -> Result<AreaUniform> {
        let file = alone(FILE);
        Ok(AreaUniform {
            mean: Pass::compute(gpu, "mean over maps", &file, "mean", INFO.params)?,
            maps: PlacedMaps::new(gpu, file, INFO.params)?,
            places: None,
        })
    }
}

impl Technique for AreaUniform {
    fn render(&mut self, f: &mut Frame) -> Result<()> {
        let gpu = f.gpu;
        let p = AreaUniformParams::read(f.values);
        let mut places = vec![Vec2::ZERO];
        if f.light.has_size() {
            places = grid(&f.light, p.side, p.placement == "corners");
        } else {
            f.tell_note("The light has no size: one map is drawn, from its centre.".into());
        }
        let made =
            |places: &Vec<Vec2>| Ok(gpu.buffer("places on the light", bytemuck::cast_slice(places), Use::STORAGE));
        let held = hold(&mut self.places, places.clone(), made)?.clone();
        let reach = Reach { texels: 0.5 * (p.kernel - 1) as f32, ..Reach::default() };
        let set = PlaceSet { places, side: MapParams::read(f.values).resolution, depths: PlaceSet::ALL };
        let maps = self.maps.draw(f, &[set], p.layers, Spared::None, 1, reach)?;
        self.maps.resolve(f, &self.mean, &maps, vec![("light_places", (&held).into())])
    }
}
