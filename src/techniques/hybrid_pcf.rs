//! A map where its texels agree, rays where they do not (Beister, Ernst, Stamminger 2005).

use super::{Info, MAPS, NEAREST, Technique};
use crate::frame::{ANALYSIS, Frame, MapSizes};
use crate::gpu::{Pass, Resource, hold};
use crate::listed_rays::ListedRays;
use crate::map::faces::{FaceParams, looked_at};
use crate::map::filter::{Reach, alone};
use crate::map::peel::StoredParams;
use crate::map::plain::PlainMaps;
use crate::map::single::FitParams;
use crate::map::{BiasParams, CasterParams, HardwareParams, MapParams};
use crate::params::Params;
use crate::view::{Class, Drawn, Legend, View, map};
use anyhow::Result;

crate::params! {
    /// The texels that must agree.
    pub struct AgreementParams {
        "Agreement" {
            /// Side of the window of texels around the receiver that must agree. Wider ones ask more rays and find more of what is thin. They are wrong less often with receiver_plane; without it the bias grows with the window, and with it the gap at contacts.
            window: int(2, 2..=7, "texels"),
            /// Traces a ray from each pixel whose texels disagree. Off: it sees as much of the light as they do.
            rays: flag(true),
        }
    }
}

pub static INFO: Info = Info {
    id: "hybrid-pcf",
    title: "Agreement hybrid",
    paper: "Beister, Ernst, Stamminger 2005",
    family: "Hybrid",
    mark: 36,
    doc: "A shadow map where the texels around the receiver agree, a ray where they do not. Sharp edges for few rays; but texels that \
          agree may all be wrong: what is thinner than one is lost. Around a lamp the maps are a cube's.",
    lights: &["directional", "spot", "omni", "hemisphere"],
    filter: Some(NEAREST),
    smooth: |_| false,
    params: &[
        FitParams::GROUP,
        MapParams::GROUP,
        FaceParams::GROUP,
        AgreementParams::GROUP,
        CasterParams::GROUP,
        BiasParams::GROUP,
        StoredParams::GROUP,
        HardwareParams::GROUP,
    ],
    main: &[("resolution", "256..8192*2"), ("window", "2..4"), ("receiver_plane", "false,true")],
    maps: &[&OWN, MAPS],
    needs: |_| &[],
    make: |gpu, _| {
        let maps = PlainMaps::new([FILE, AROUND], INFO.params);
        Ok(Box::new(HybridPcf { rays: ListedRays::new(gpu)?, maps, passes: None }))
    },
};

/// One map, and a cube's.
const FILE: &str = "techniques/hybrid_pcf.wgsl";
const AROUND: &str = "techniques/hybrid_pcf/around.wgsl";

const OWN: [View; 1] = [map(
    "agreement",
    "Agreement",
    "Where the texels agree, and how the others' rays end.",
    Drawn::Labels(Legend::Classes(&[
        Class::label(1, "all see the light"),
        Class::label(7, "none sees it"),
        Class::label(2, "they disagree, ends lit"),
        Class::label(4, "they disagree, ends in shadow"),
        Class::label(0, "they agree and are wrong"),
    ])),
)];

struct HybridPcf {
    rays: ListedRays,
    maps: PlainMaps,
    /// What looks them up, by its shader.
    passes: Option<(&'static str, Passes)>,
}

struct Passes {
    agree: Pass,
    inspect: Option<((), Pass)>,
    analyse: Option<((), Pass)>,
}

impl Technique for HybridPcf {
    fn render(&mut self, f: &mut Frame) -> Result<()> {
        let gpu = f.gpu;
        let p = AgreementParams::read(f.values);
        // How far the window reaches.
        let maps = self.maps.draw(f, Reach { texels: 0.5 * p.window as f32, ..Reach::default() })?;
        let file = self.maps.file();
        let pass = |name, entry| Pass::compute(gpu, name, &alone(file), entry, INFO.params);
        let made = |_: &&str| Ok(Passes { agree: pass("agree", "agree")?, inspect: None, analyse: None });
        let passes = hold(&mut self.passes, file, made)?;
        let mut bound: Vec<(&'static str, Resource)> = self.rays.begin(f)?.into();
        bound.extend_from_slice(&maps.bound);
        bound.extend([("shadow_maps", (&maps.layers.all).into()), ("light_views", (&maps.light_views).into())]);
        f.keep_table("light_views", &maps.light_views);
        f.offer_maps(&maps.layers.each, &maps.light_views, &maps.sides);
        f.offer_teller(|| alone(file), INFO.params, &bound, true);
        if file == AROUND {
            f.show_map(looked_at(f));
        }
        if f.wants_analysis() {
            let analyse = hold(&mut passes.analyse, (), |()| pass(ANALYSIS, "analyse"))?;
            f.analyse(analyse, MapSizes::of(&maps.sides), &bound);
        }
        f.run(&passes.agree).of_picture().bind_all(&bound).per_pixel();
        if p.rays {
            self.rays.trace(f);
        }
        if f.wants_any_map() {
            let inspect = hold(&mut passes.inspect, (), |()| pass("inspect", "inspect"))?;
            f.run(inspect).bind_all(&bound).per_pixel();
        }
        Ok(())
    }
}
