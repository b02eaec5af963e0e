//! Soft shadows as the mean over hard ones from places all over the light.

use super::rt_soft::LIGHT_SAMPLES;
use super::{Info, MAPS, NEAREST, Technique};
use crate::frame::Frame;
use crate::gpu::{Buffer, Gpu, Pass, hold};
use crate::light::Light;
use crate::map::filter::{Reach, alone};
use crate::map::peel::StoredParams;
use crate::map::places::PlacedMaps;
use crate::map::single::FitParams;
use crate::map::{BiasParams, CasterParams, HardwareParams, MapParams};
use crate::params::Params;
use anyhow::Result;
use glam::{Vec2, vec2};
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
        FitParams::GROUP,
        MapParams::GROUP,
        AreaUniformParams::GROUP,
        CasterParams::GROUP,
        BiasParams::GROUP,
        StoredParams::GROUP,
        HardwareParams::GROUP,
    ],
    main: &[("resolution", "256..1024*2"), ("side", "3,6,9"), ("kernel", "1,3")],
    maps: &[&[LIGHT_SAMPLES], MAPS],
    make: |gpu, _| Ok(Box::new(AreaUniform::new(gpu)?)),
};

const FILE: &str = "techniques/area_uniform.wgsl";

/// A place of the disc for a place of the square, -1 to 1: concentric (Shirley, Chiu 1997).
fn on_disc(p: Vec2) -> Vec2 {
    let wide = p.x.abs() > p.y.abs();
    let (radius, other) = if wide { (p.x, p.y) } else { (p.y, p.x) };
    let angle = std::f32::consts::FRAC_PI_4 * if radius == 0.0 { 0.0 } else { other / radius };
    let (sine, cosine) = angle.sin_cos();
    radius * if wide { vec2(cosine, sine) } else { vec2(sine, cosine) }
}

/// A place on a light for one of the square: equal areas of both are the same share of it.
pub(super) fn on_light(light: &Light, place: Vec2) -> Vec2 {
    if matches!(light, Light::RectArea { .. }) { place } else { on_disc(place) }
}

/// The places on a light, evenly spread over its area.
fn places(light: &Light, p: &AreaUniformParams) -> Vec<Vec2> {
    if !light.has_size() {
        return vec![Vec2::ZERO];
    }
    let along = |i: u32| match p.placement.as_str() {
        "corners" if p.side > 1 => 2.0 * i as f32 / (p.side - 1) as f32 - 1.0,
        _ => (2 * i + 1) as f32 / p.side as f32 - 1.0,
    };
    let square = (0..p.side * p.side).map(|i| vec2(along(i % p.side), along(i / p.side)));
    square.map(|place| on_light(light, place)).collect()
}

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
        let places = places(&f.light, &p);
        if !f.light.has_size() {
            f.tell_note("The light has no size: one map is drawn, from its centre.".into());
        }
        let made =
            |places: &Vec<Vec2>| Ok(gpu.buffer("places on the light", bytemuck::cast_slice(places), Use::STORAGE));
        let held = hold(&mut self.places, places.clone(), made)?.clone();
        let reach = Reach { texels: 0.5 * (p.kernel - 1) as f32, ..Reach::default() };
        let Some(maps) = self.maps.draw(f, &places, reach)? else { return Ok(()) };
        self.maps.resolve(f, &self.mean, &maps, vec![("light_places", (&held).into())])
    }
}
