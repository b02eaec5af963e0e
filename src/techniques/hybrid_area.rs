//! Maps from places all over a light with a size: what they agree on is decided, the penumbra asks rays (Beister, Ernst, Stamminger 2005).

use super::rt_soft::LIGHT_SAMPLES;
use super::{Info, MAPS, NEAREST, Technique};
use crate::frame::Frame;
use crate::gpu::{Gpu, Pass};
use crate::listed_rays::ListedRays;
use crate::map::filter::{Reach, alone};
use crate::map::peel::StoredParams;
use crate::map::places::{PlaceSet, PlacedMaps, PlacesFitParams, Spared, left_to_rays, reached_in_part};
use crate::map::{BiasParams, CasterParams, HardwareParams, MapParams};
use crate::params::Params;
use crate::view::{self, Class, Drawn, Legend, map};
use anyhow::Result;
use glam::Vec2;

crate::params! {
    /// Places of the light that must agree, and the rays of what does not.
    pub struct AreaAgreementParams {
        "Agreement" {
            /// Side of the window of texels around the receiver that must agree in each map.
            window: int(2, 2..=7, "texels"),
            /// Traces rays from each pixel that the maps do not agree on. Off: such a pixel sees as much of the light as the texels do.
            rays: flag(true),
            /// Rays to the light from such a pixel.
            samples: int(64, 16..=256, "rays") if rays = true,
        }
    }
}

pub static INFO: Info = Info {
    id: "hybrid-area",
    title: "Area agreement hybrid",
    paper: "Beister, Ernst, Stamminger 2005",
    family: "Hybrid",
    mark: 45,
    doc: "Eight maps, from the middle of the light and from seven places at its rim. Where all of them see a pixel or none does, it is lit \
          or dark; elsewhere rays to all of the light decide. What lies between the eight places is missed.",
    lights: &["directional", "spot", "rect-area"],
    filter: Some(NEAREST),
    smooth: |_| false,
    params: &[
        PlacesFitParams::GROUP,
        MapParams::GROUP,
        AreaAgreementParams::GROUP,
        CasterParams::GROUP,
        BiasParams::GROUP,
        StoredParams::GROUP,
        HardwareParams::GROUP,
    ],
    main: &[("resolution", "256..2048*2"), ("samples", "16,64"), ("receiver_plane", "false,true")],
    maps: &[
        &[
            map(
                "agreement",
                "Agreement",
                "Where the eight maps agree, and where rays decide.",
                Drawn::Labels(Legend::Classes(&[
                    Class::label(1, "all see the light"),
                    Class::label(7, "none sees it"),
                    Class::label(2, "they disagree: rays"),
                ])),
            ),
            map(
                "map-share",
                "What the maps see",
                "The share of the light that the maps' texels see together, before any ray.",
                view::ramp("share of the light", "", [0.0, 1.0]),
            ),
            LIGHT_SAMPLES,
        ],
        MAPS,
    ],
    needs: |_| &[],
    make: |gpu, _| Ok(Box::new(HybridArea::new(gpu)?)),
};

const FILE: &str = "techniques/hybrid_area.wgsl";

struct HybridArea {
    maps: PlacedMaps,
    rays: ListedRays,
    decide: Pass,
    resolve: Pass,
}

impl HybridArea {
    fn new(gpu: &Gpu) -> Result<HybridArea> {
        let file = alone(FILE);
        let pass = |name, entry| Pass::compute(gpu, name, &file, entry, INFO.params);
        Ok(HybridArea {
            maps: PlacedMaps::new(gpu, file.clone(), INFO.params)?,
            rays: ListedRays::new(gpu)?,
            decide: pass("agreement", "decide")?,
            resolve: pass("shadow rays", "resolve_listed")?,
        })
    }
}

impl Technique for HybridArea {
    fn render(&mut self, f: &mut Frame) -> Result<()> {
        let p = AreaAgreementParams::read(f.values);
        // The middle, and seven places at the rim: of a rectangle on the ellipse that touches its sides.
        let rim = |k| Vec2::from_angle(std::f32::consts::TAU * k as f32 / 7.0);
        let mut places = vec![Vec2::ZERO];
        if f.light.has_size() {
            places.extend((0..7).map(rim));
        } else {
            f.tell_note("The light has no size: one map and one ray a pixel, from and to its centre.".into());
        }
        let reach = Reach { texels: 0.5 * p.window as f32, ..Reach::default() };
        let set = PlaceSet { places, side: MapParams::read(f.values).resolution, depths: PlaceSet::ALL };
        self.maps.aside = if p.rays { left_to_rays } else { reached_in_part };
        let maps = self.maps.draw(f, &[set], 8, Spared::None, 1, reach)?;
        let listed = self.rays.begin(f)?;
        self.maps.resolve(f, &self.decide, &maps, listed.into())?;
        if p.rays {
            self.rays.trace_by(f, &self.resolve, &[]);
        }
        Ok(())
    }
}
