//! Edge distance shadow mapping (Kenzel 2013), and a mode that keeps corners exact.

use super::shadow_map::GROUPS;
use super::{Info, MAPS, Technique};
use crate::frame::Frame;
use crate::gpu::{Need, Pass, hold};
use crate::map::edge_quads::{self, EdgeQuads, Kept, QuadParams};
use crate::map::faces::FaceParams;
use crate::map::filter::{Filter, Reach};
use crate::params::Params;
use crate::view::{self, Class, Drawn, Legend};
use anyhow::Result;
use wgpu::TextureFormat as Format;

crate::params! {
    /// What edges leave in the map, and how it is looked up.
    pub struct EdsmParams {
        "Edges" {
            /// How far the distance from an edge is kept to each side and beyond its ends. The four texels around a place on the edge lie up to 1.42 texels off: below, some keep none.
            reach: float(2.0, 0.5..=6.0, "texels"),
            /// Which of several edges a texel keeps. Segment: the one whose segment is the nearest. Seed: the function of the paper. Min: the smallest distance from the line, wrong beyond ends. Order: the one drawn last.
            priority: choice("segment", ["segment", "seed", "min", "order"]),
            /// Rounded: one distance a texel, mixed between four texels, so that corners are cut off. Exact: each texel names its two nearest edges, and each is tested by itself.
            corners: choice("rounded", ["rounded", "exact"]),
            /// Take distances only where they say the same of each of the four texels as its comparison does, with exact corners of three of them, so that an edge which casts elsewhere leaves the plain map's result. Off, as the paper has it: whatever is kept there decides.
            check: flag(true),
            /// Where quads get their width. Screen: in the light's image. World: in space before a spot's projection, so that far ones are too thin to be looked up. The same under the sun.
            quads_in: choice("screen", ["screen", "world"]),
        }
        "Filter" {
            /// Half the width over which the shadow's edge fades, no wider than `reach`. 0: a hard edge.
            softness: float(0.0, 0.0..=6.0, "texels"),
        }
    }
}

/// For a single map, and for those around a lamp.
const FILES: [&str; 2] = ["techniques/edsm.wgsl", "techniques/edsm/around.wgsl"];

static FILTER: Filter = Filter {
    id: "edsm",
    file: "map/filter/edsm.wgsl",
    reach: |_| Reach { texels: 1.0, metres: 0.0, casters: false },
    smooth: |values| EdsmParams::read(values).softness > 0.0,
    ..Filter::PLAIN
};

pub static INFO: Info = Info {
    id: "edsm",
    title: "Edge distance shadow map",
    paper: "Kenzel 2013",
    family: "Silhouettes",
    mark: 30,
    doc: "A plain map, and beside it the distance from the silhouette's edges, drawn in quads along them: where the map's \
          texels differ, the distance mixed between them says on which side of the edge a pixel lies. Straight edges are \
          exact; corners are cut, and edges less than two texels apart get in each other's way.",
    lights: &["directional", "spot", "omni", "hemisphere"],
    filter: Some(&FILTER),
    smooth: |_| false,
    params: crate::groups!(&[EdsmParams::GROUP, QuadParams::GROUP], GROUPS, &[FaceParams::GROUP]),
    main: &[("resolution", "256..8192*2"), ("corners", "rounded,exact")],
    maps: &[
        MAPS,
        &edge_quads::VIEWS,
        &[
            view::map(
                "edge-distance",
                "Edge distance",
                "The map. Where an edge was drawn, how far its line is and on which side: bright at the edge itself.",
                Drawn::Labels(Legend::Classes(&[
                    Class::label(4, "on the shadow's side of the edge"),
                    Class::label(6, "on the light's side"),
                ])),
            ),
            view::map(
                "edge-priority",
                "Edge priority",
                "The map. How much an edge is preferred to others where it was drawn: what is brightest stays.",
                view::ramp("1 − priority", "", [0.5, 1.0]),
            ),
            view::map(
                "edge-zoom",
                "Edge, enlarged",
                "A few texels around the place that the probed pixel looks up: in their middles whether they are lit for its \
                 surface, around them the shadow's edge as it is reconstructed.",
                Drawn::Labels(Legend::Classes(&[
                    Class::label(8, "light, in middles that of the plain map"),
                    Class::label(0, "a texel that differs keeps no edge"),
                ])),
            ),
            edge_quads::USE,
        ],
    ],
    needs: |_| &[Need::StorageBuffers(5)],
    make: |gpu, info| {
        Ok(Box::new(Edsm {
            quads: EdgeQuads::new(gpu, FILES, &FILTER, info.params)?,
            passes: None,
            kept: Kept::default(),
            second: Kept::default(),
        }))
    },
};

struct Edsm {
    quads: EdgeQuads,
    /// The first's and the second's; whether what comes last stays.
    passes: Option<(bool, [Pass; 2])>,
    kept: Kept,
    second: Kept,
}

impl Technique for Edsm {
    fn render(&mut self, f: &mut Frame) -> Result<()> {
        let p = EdsmParams::read(f.values);
        let edges = self.quads.find(f)?;
        let (gpu, quads) = (f.gpu, &self.quads);
        let [first, second] = hold(&mut self.passes, p.priority == "order", |last| {
            Ok([
                quads.pass(gpu, "edge quads", "keep", Format::R32Uint, *last)?,
                quads.pass(gpu, "second edge quads", "keep_second", Format::R32Uint, *last)?,
            ])
        })?;
        let [kept, priority] = quads.draw(f, (first, Format::R32Uint), &edges, &mut self.kept, None)?;
        let mut beside = kept.clone();
        if p.corners == "exact" {
            let first = Some(("first_numbers", &kept));
            [beside, _] = quads.draw(f, (second, Format::R32Uint), &edges, &mut self.second, first)?;
        } else {
            self.second = Kept::default();
        }
        let bound = vec![
            ("edge_map", (&kept.all).into()),
            ("second_edge_map", (&beside.all).into()),
            ("edge_priority", (&priority.all).into()),
        ];
        self.quads.look_up(f, &edges, bound)
    }
}
