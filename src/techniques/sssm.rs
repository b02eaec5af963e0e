//! Shadow silhouette maps (Sen, Cammarano, Hanrahan 2003).

use super::shadow_map::GROUPS;
use super::{Info, MAPS, Technique};
use crate::frame::Frame;
use crate::gpu::{Need, Pass};
use crate::map::edge_quads::{self, EdgeQuads, Kept, QuadParams};
use crate::map::faces::FaceParams;
use crate::map::filter::{Filter, Reach};
use crate::params::Params;
use crate::view::{self, Class, Drawn, Legend};
use anyhow::Result;
use wgpu::TextureFormat as Format;

crate::params! {
    /// What edges leave in the map.
    pub struct SssmParams {
        "Edges" {
            /// Which point of the silhouette a square keeps. Vertex: a corner that lies in it, before the middle of an edge that passes through. Mid: the middle always, so that corners are cut off.
            store: choice("vertex", ["vertex", "mid"]),
        }
    }
}

/// For a single map, and for those around a lamp.
const FILES: [&str; 2] = ["techniques/sssm.wgsl", "techniques/sssm/around.wgsl"];

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
    lights: &["directional", "spot", "omni", "hemisphere"],
    filter: Some(&FILTER),
    smooth: |_| false,
    params: crate::groups!(&[SssmParams::GROUP, QuadParams::GROUP], GROUPS, &[FaceParams::GROUP]),
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
    needs: |_| &[Need::StorageBuffers(5)],
    make: |gpu, info| {
        let quads = EdgeQuads::new(gpu, FILES, &FILTER, info.params)?;
        Ok(Box::new(Sssm {
            keep: quads.pass(gpu, "edge quads", "keep", POINTS, false)?,
            quads,
            points: Kept::default(),
        }))
    },
};

const POINTS: Format = Format::Rg16Float;

struct Sssm {
    quads: EdgeQuads,
    keep: Pass,
    points: Kept,
}

impl Technique for Sssm {
    fn render(&mut self, f: &mut Frame) -> Result<()> {
        let edges = self.quads.find(f)?;
        let [points, _] = self.quads.draw(f, (&self.keep, POINTS), &edges, &mut self.points, None)?;
        self.quads.look_up(f, &edges, vec![("silhouette_points", (&points.all).into())])
    }
}
