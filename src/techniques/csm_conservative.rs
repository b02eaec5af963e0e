//! Conservative shadow maps with rays (Hertel, Hormann, Westermann 2009; with adjacency Morais 2015).

use super::{Info, MAPS, Technique};
use crate::frame::{ANALYSIS, Frame, MapSizes};
use crate::gpu::{Need, Pass, Resource, hold};
use crate::listed_rays::ListedRays;
use crate::map::MapParams;
use crate::map::conservative::{Conservative, ConservativeParams, LAYERS};
use crate::map::faces::looked_at;
use crate::map::single::FitParams;
use crate::params::Params;
use crate::view::{Class, Drawn, Legend, View, map};
use anyhow::Result;

crate::params! {
    /// What decides where the maps disagree.
    pub struct DecidingParams {
        "Rays" {
            /// Traces a ray from each pixel about which the maps are uncertain. Off: one of them decides alone.
            rays: flag(true),
            /// The map that decides where no rays are traced. Grown: whatever a grown caster may shadow is in shadow. Shrunk: whatever no shrunk caster shadows is lit.
            uses: choice("grown", ["grown", "shrunk"]) if rays = false,
        }
    }
}

pub static INFO: Info = Info {
    id: "csm-conservative",
    title: "Conservative shadow map",
    paper: "Hertel et al. 2009; Morais 2015",
    family: "Hybrid",
    mark: 35,
    doc: "Two maps, of casters grown and of casters shrunk by half a texel: where both agree the answer is certain, elsewhere a \
          ray is traced. As exact as rays, for a share of them. With triangles smaller than texels nearly all shadows ask rays. \
          Around a lamp each face of a cube has its maps.",
    lights: &["directional", "spot", "omni", "hemisphere"],
    filter: None,
    smooth: |_| false,
    params: &[FitParams::GROUP, MapParams::GROUP, ConservativeParams::GROUP, DecidingParams::GROUP],
    main: &[("resolution", "256..8192*2"), ("mode", "none,adjacency,fan")],
    maps: &[&OWN, &[MAPS[1], MAPS[3], MAPS[4], MAPS[5], MAPS[6]]],
    needs: |_| &[Need::StorageBuffers(7)],
    make: |gpu, _| {
        Ok(Box::new(CsmConservative {
            maps: Conservative::new(gpu)?,
            rays: ListedRays::new(gpu)?,
            resolve: Pass::compute(gpu, "classify", FILE, "resolve", INFO.params)?,
            inspect: None,
            analyse: None,
        }))
    },
};

const FILE: &str = "techniques/csm_conservative.wgsl";

const OWN: [View; 6] = [
    map(
        "certainty",
        "Certainty",
        "What the two maps say of each pixel, and how the uncertain ones end. Where the shrunk map shadows what the grown one leaves \
         lit something is wrong.",
        Drawn::Labels(Legend::Classes(&[
            Class::label(1, "certainly lit"),
            Class::label(7, "certainly in shadow"),
            Class::label(2, "uncertain, ends lit"),
            Class::label(4, "uncertain, ends in shadow"),
            Class::label(0, "lit by the grown, shadowed by the shrunk map: wrong"),
        ])),
    ),
    map(
        "grown-errors",
        "Errors of the grown map",
        "Pixels that the grown map alone shadows wrongly.",
        Drawn::Labels(Legend::Classes(&[Class::label(0, "in shadow, should be lit")])),
    ),
    map(
        "shrunk-errors",
        "Errors of the shrunk map",
        "Pixels that the shrunk map alone lights wrongly.",
        Drawn::Labels(Legend::Classes(&[Class::label(4, "lit, should be in shadow")])),
    ),
    map(
        "grown-map",
        "Grown map",
        "Casters of closed bodies, grown: in each texel that one touches the nearest depth it has there. Near bright, far dark.",
        Drawn::Depth,
    ),
    map(
        "grown-others",
        "Grown map of open casters",
        "The same of casters that are no closed bodies: leaves, cloths, terrain.",
        Drawn::Depth,
    ),
    map(
        "shrunk-map",
        "Shrunk map",
        "Casters shrunk: a texel holds one where casters cover all of it, and then their farthest depth there.",
        Drawn::Depth,
    ),
];

struct CsmConservative {
    maps: Conservative,
    rays: ListedRays,
    resolve: Pass,
    inspect: Option<((), Pass)>,
    analyse: Option<((), Pass)>,
}

impl Technique for CsmConservative {
    fn render(&mut self, f: &mut Frame) -> Result<()> {
        let gpu = f.gpu;
        let maps = self.maps.draw(f)?;
        let pass = |name, entry| Pass::compute(gpu, name, FILE, entry, INFO.params);
        let mut bound: Vec<(&'static str, Resource)> = self.rays.begin(f)?.into();
        bound.extend([
            ("maps", (&maps.layers.all).into()),
            ("light_views", (&maps.light_views).into()),
            ("own_planes", (&maps.own_planes).into()),
            ("gathered", (&maps.gathered).into()),
        ]);
        f.keep_table("light_views", &maps.light_views);
        // Those that are looked at come first; around a lamp they are all, one for each face.
        let shown = OWN[4..].iter().position(|v| v.id == f.view).map_or(0, |i| i + 1);
        let (mut each, side) = (maps.layers.each.clone(), maps.layers.texture.width());
        each.rotate_left(shown);
        if maps.faces > 1 {
            each = each.into_iter().step_by(LAYERS).collect();
        }
        f.offer_maps(&each, &maps.light_views, &vec![side; each.len()]);
        f.offer_teller(|| FILE.into(), INFO.params, &bound, false);
        if maps.faces > 1 {
            f.show_map(looked_at(f));
        }
        if f.wants_analysis() {
            let analyse = hold(&mut self.analyse, (), |()| pass(ANALYSIS, "analyse"))?;
            f.analyse(analyse, MapSizes::of(&vec![side; maps.faces]), &bound);
        }
        f.run(&self.resolve).bind_all(&bound).per_pixel();
        if DecidingParams::read(f.values).rays {
            self.rays.trace(f);
        }
        if f.wants_any_map() {
            let inspect = hold(&mut self.inspect, (), |()| pass("inspect", "inspect"))?;
            f.run(inspect).bind_all(&bound).per_pixel();
        }
        Ok(())
    }
}
