//! Shadow silhouette maps (Sen, Cammarano, Hanrahan 2003).

use super::shadow_map::GROUPS;
use super::{Info, MAPS, Technique};
use crate::frame::Frame;
use crate::gpu::{Pass, Slot};
use crate::map::MapParams;
use crate::map::edge_quads::{self, EdgeQuads, QuadParams};
use crate::map::filter::{Filter, LookUp, Reach};
use crate::map::single::ShadowMap;
use crate::params::Params;
use crate::view::{self, Class, Drawn, Legend};
use anyhow::Result;
use wgpu::TextureFormat as Format;
use wgpu::TextureUsages as Use;

crate::params! {
    /// What edges leave in the map.
    pub struct SssmParams {
        "Edges" {
            /// Which point of the silhouette a square keeps. Vertex: a corner that lies in it, before the middle of an edge that passes through. Mid: the middle always, so that corners are cut off.
            store: choice("vertex", ["vertex", "mid"]),
        }
    }
}

const FILE: &str = "techniques/sssm.wgsl map/filter/sssm.wgsl";

static FILTER: Filter = Filter {
    id: "sssm",
    file: "map/filter/sssm.wgsl",
    reach: |_| Reach { texels: 1.0, metres: 0.0, casters: false },
    smooth: |_| false,
    ..Filter::PLAIN
};

pub static INFO: Info = Info {
    id: "sssm",
    title: "Shadow silhouette map",
    paper: "Sen, Cammarano, Hanrahan 2003",
    family: "Silhouettes",
    mark: 31,
    doc: "A plain map, and a point of the silhouette in each square between four of its texels. Lines between neighbouring \
          points part each square into four quadrants, one for each texel. Edges and corners are nearly exact; two edges in one \
          square are not.",
    lights: &["directional", "spot"],
    filter: Some(&FILTER),
    smooth: |_| false,
    params: crate::groups!(&[SssmParams::GROUP, QuadParams::GROUP], GROUPS),
    main: &[("resolution", "256..8192*2"), ("store", "vertex,mid")],
    maps: &[
        MAPS,
        &edge_quads::VIEWS,
        &[
            view::map(
                "silhouette-points",
                "Silhouette points",
                "A few texels around the place that the probed pixel looks up: in their middles whether they are lit for its \
                 surface, around them the light that is reconstructed, and the lines between points that part the squares.",
                Drawn::Labels(Legend::Classes(&[
                    Class::label(1, "points of the silhouette"),
                    Class::label(0, "lines that bound the shadow"),
                    Class::label(7, "middles of squares without a point, and lines that bound nothing"),
                    Class::label(8, "light"),
                ])),
            ),
            edge_quads::USE,
        ],
    ],
    make: |gpu, info| {
        let quads = EdgeQuads::new(gpu, FILE, info.params)?;
        Ok(Box::new(Sssm {
            map: ShadowMap::new(gpu)?,
            keep: quads.pass(gpu, "edge quads", "keep", POINTS, false)?,
            quads,
            points: Slot::default(),
            priority: Slot::default(),
            look_up: LookUp::new(gpu, "techniques/sssm.wgsl", info.params),
        }))
    },
};

const POINTS: Format = Format::Rg16Float;

struct Sssm {
    map: ShadowMap,
    quads: EdgeQuads,
    keep: Pass,
    points: Slot,
    priority: Slot,
    look_up: LookUp,
}

impl Technique for Sssm {
    fn render(&mut self, f: &mut Frame) -> Result<()> {
        let maps = self.map.render(f, (FILTER.reach)(f))?;
        let edges = self.quads.find(f)?;
        let mut bound = self.quads.bound(f, &maps, &edges)?;
        let side = [MapParams::read(f.values).resolution; 2];
        let usage = Use::RENDER_ATTACHMENT | Use::TEXTURE_BINDING;
        let points = self.points.get(f.gpu, "silhouette points", side, POINTS, usage);
        let priority = self.priority.get(f.gpu, "point priority", side, Format::Depth32Float, usage);
        let run = f.run(&self.keep).bind_all(&bound).for_layer(&maps.layers.each[0]);
        run.draw(&[&points], Some((&priority, 1.0)), true, |p| edges.draw(p));
        bound.push(("silhouette_points", (&points).into()));
        self.look_up.run(f, &maps, &FILTER, &bound)
    }
}
