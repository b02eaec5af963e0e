//! A map where its texels agree, rays where they do not (Beister, Ernst, Stamminger 2005).

use super::{Info, MAPS, NEAREST, Technique};
use crate::frame::{ANALYSIS, Frame, MapSizes};
use crate::gpu::{Gpu, Pass, Resource, hold};
use crate::listed_rays::ListedRays;
use crate::map::faces::{self, FaceParams, Faces, around, looked_at};
use crate::map::filter::{Reach, alone};
use crate::map::peel::StoredParams;
use crate::map::single::{FitParams, ShadowMap};
use crate::map::{BiasParams, CasterParams, HardwareParams, MapParams, Maps};
use crate::params::Params;
use crate::view::{Class, Drawn, Legend, View, map};
use anyhow::Result;

crate::params! {
    /// The texels that must agree.
    pub struct AgreementParams {
        "Agreement" {
            /// Side of the window of texels around the receiver that must agree. Wider ones ask more rays and are wrong less often.
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
    main: &[("resolution", "256..8192*2"), ("window", "2..4")],
    maps: &[&OWN, MAPS],
    make: |gpu, _| Ok(Box::new(HybridPcf { rays: ListedRays::new(gpu)?, single: None, around: None })),
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

/// Made when a light first asks for it: a single map, and a cube's where the light shines in all directions.
struct HybridPcf {
    rays: ListedRays,
    single: Option<(ShadowMap, Passes)>,
    around: Option<(Faces, Passes)>,
}

/// What looks the maps up.
struct Passes {
    file: &'static str,
    agree: Pass,
    inspect: Option<((), Pass)>,
    analyse: Option<((), Pass)>,
}

impl Passes {
    fn new(gpu: &Gpu, file: &'static str) -> Result<Passes> {
        let agree = Pass::compute(gpu, "agree", &alone(file), "agree", INFO.params)?;
        Ok(Passes { file, agree, inspect: None, analyse: None })
    }

    fn run(&mut self, f: &mut Frame, maps: &Maps, rays: &mut ListedRays) -> Result<()> {
        let (gpu, file) = (f.gpu, self.file);
        let pass = |name, entry| Pass::compute(gpu, name, &alone(file), entry, INFO.params);
        let mut bound: Vec<(&'static str, Resource)> = rays.begin(f)?.into();
        bound.extend_from_slice(&maps.bound);
        bound.extend([("shadow_maps", (&maps.layers.all).into()), ("light_views", (&maps.light_views).into())]);
        f.keep_table("light_views", &maps.light_views);
        f.offer_maps(&maps.layers.each, &maps.light_views, &maps.sides);
        if file == AROUND {
            f.show_map(looked_at(f));
        }
        if f.wants_analysis() {
            let analyse = hold(&mut self.analyse, (), |()| pass(ANALYSIS, "analyse"))?;
            f.analyse(analyse, MapSizes::of(&maps.sides), &bound);
        }
        f.run(&self.agree).of_picture().bind_all(&bound).per_pixel();
        if AgreementParams::read(f.values).rays {
            rays.trace(f);
        }
        if f.wants_any_map() {
            let inspect = hold(&mut self.inspect, (), |()| pass("inspect", "inspect"))?;
            f.run(inspect).bind_all(&bound).per_pixel();
        }
        Ok(())
    }
}

impl Technique for HybridPcf {
    fn render(&mut self, f: &mut Frame) -> Result<()> {
        let gpu = f.gpu;
        // How far the window reaches.
        let reach = Reach { texels: 0.5 * AgreementParams::read(f.values).window as f32, ..Reach::default() };
        if !faces::LIGHTS.contains(&f.light.kind()) {
            self.around = None;
            let (map, passes) = match &mut self.single {
                Some(held) => held,
                none => none.insert((ShadowMap::new(gpu)?, Passes::new(gpu, FILE)?)),
            };
            let maps = map.render(f, reach)?;
            return passes.run(f, &maps, &mut self.rays);
        }
        self.single = None;
        let (cube, passes) = match &mut self.around {
            Some(held) => held,
            none => none.insert((Faces::new(gpu)?, Passes::new(gpu, AROUND)?)),
        };
        let around = around(f, MapParams::read(f.values).resolution, reach)?;
        let views = around.cube();
        cube.prepare(f, &around, &views);
        let maps = cube.draw(f, &around, &views)?;
        passes.run(f, &maps, &mut self.rays)
    }
}
