//! Revectorisation-based shadow mapping (Bondarev 2014; Macedo, Apolinário 2016).

use super::Info;
use super::shadow_map::{GROUPS, MAPS, single};
use crate::map::filter::{Filter, Reach};
use crate::params::Params;
use crate::view::{self, Class, Drawn, Legend};

crate::params! {
    /// How steps of the map's texels are made lines.
    pub struct RbsmParams {
        "Filter" {
            /// How far a step is followed to each side to find where it ends. Long walks straighten edges that run nearly along the map's rows, and cost four reads a texel.
            walk: int(16, 1..=64, "texels"),
            /// Which comparisons the line may change. Both: light and shadow. Conservative: only lit ones, so that no shadow shrinks.
            change: choice("both", ["both", "conservative"]),
            /// Width over which the line fades, so that its edge is anti-aliased. 0: a hard edge.
            ramp: float(0.0, 0.0..=2.0, "texels"),
            /// Taps along each side of a filter over lines instead of comparisons (RPCF), a texel apart. 1: no filter.
            taps: int(1, 1..=8, "taps"),
        }
    }
}

/// Walks that leave the map end there.
pub static FILTER: Filter = Filter {
    id: "rbsm",
    file: "map/filter/rbsm.wgsl",
    reach: |f| Reach { texels: 1.0 + RbsmParams::read(f.values).taps as f32 / 2.0, ..Reach::default() },
    smooth: |values| {
        let p = RbsmParams::read(values);
        p.ramp > 0.0 || p.taps > 1
    },
    views: &[
        view::map(
            "discontinuities",
            "Discontinuities",
            "Pixels whose texel is lit where a neighbour is in shadow, or the other way round, by how many of its four sides \
             are such.",
            Drawn::Labels(Legend::Classes(&[
                Class::label(0, "one side"),
                Class::label(3, "two that meet"),
                Class::label(2, "two that face each other"),
                Class::label(6, "three"),
                Class::label(5, "all four: a lone texel"),
            ])),
        ),
        view::map(
            "run-ends",
            "Ends of runs",
            "Where a step was followed to: what the line of each texel hangs on.",
            Drawn::Labels(Legend::Classes(&[
                Class::label(3, "an end along both axes: a line"),
                Class::label(1, "two ends along one: a peak"),
                Class::label(7, "none along one: left as it is"),
            ])),
        ),
        view::map(
            "run-x",
            "Place in the run, x",
            "How far the pixel lies from the end of its run along the map's rows, as a share of the run.",
            view::ramp("distance from the end over the run", "", [0.0, 1.0]),
        ),
        view::map(
            "run-y",
            "Place in the run, y",
            "How far the pixel lies from the end of its run along the map's columns, as a share of the run.",
            view::ramp("distance from the end over the run", "", [0.0, 1.0]),
        ),
        view::map(
            "changed",
            "Changed pixels",
            "Where the line says something else than the plain map.",
            Drawn::Labels(Legend::Classes(&[
                Class::label(0, "lit in the plain map, darker here"),
                Class::label(4, "in shadow in the plain map, brighter here"),
            ])),
        ),
    ],
    ..Filter::PLAIN
};

pub static INFO: Info = Info {
    id: "rbsm",
    title: "Revectorised shadow map",
    paper: "Bondarev 2014; Macedo, Apolinário 2016",
    family: "Silhouettes",
    mark: 32,
    doc: "Follows each step of the plain map's stairs to its ends and draws a slanting line in its place. Knows no geometry, \
          so that it serves any map; short steps stay, and thin things break up.",
    lights: &["directional", "spot", "rect-area"],
    filter: Some(&FILTER),
    smooth: |_| false,
    params: crate::groups!(&[RbsmParams::GROUP], GROUPS),
    main: &[("resolution", "256..8192*2"), ("walk", "4,16,64")],
    maps: &[MAPS],
    needs: |_| &[],
    make: single,
};
