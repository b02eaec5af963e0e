//! Ray-traced hard shadows: the exact reference.

use super::{Info, Technique};
use crate::frame::Frame;
use crate::gpu::Pass;
use crate::params::Params;
use crate::view;
use anyhow::Result;

crate::params! {
    /// The shadow rays.
    pub struct RtParams {
        "Rays" {
            /// Where a ray starts, as a share of the largest coordinate (of 1 m at least). 0 is exact, as the receiver's own triangle is left out by its number.
            epsilon: float(0.0, 0.0..=0.01, ""),
            /// Off: a triangle blocks only light that arrives at its front.
            two_sided: flag(true),
            /// How many nodes of the BVH a ray may visit before it gives up and counts as lit.
            max_visits: int(65536, 16..=1048576, "nodes"),
        }
    }
}

pub static INFO: Info = Info {
    id: "rt-hard",
    title: "Ray-traced hard shadow",
    paper: "watertight test: Woop, Benthin, Wald 2013",
    family: "Ray traced",
    mark: 12,
    doc: "One ray from each pixel to the light, against every triangle. Exact for a point light or the sun: the truth \
          that all others are measured against. Of a light with a size it sees the centre alone.",
    lights: &["directional", "spot", "omni", "hemisphere", "rect-area"],
    filter: None,
    smooth: |_| false,
    params: &[RtParams::GROUP],
    main: &[],
    maps: &[&[view::map(
        "visits",
        "Node visits",
        "How many nodes of the BVH each pixel's ray visits: where ray tracing is slow.",
        view::counts("nodes visited", 300.0),
    )]],
    needs: |_| &[],
    make: |gpu, _| {
        Ok(Box::new(RtHard {
            resolve: Pass::compute(gpu, "shadow rays", FILE, "resolve", INFO.params)?,
            inspect: Pass::compute(gpu, "inspect", FILE, "inspect", INFO.params)?,
        }))
    },
};

const FILE: &str = "techniques/rt_hard.wgsl";
/// How long a ray from each pixel takes, in full-screen passes ([`crate::gpu::Run::in_bands`]).
pub(super) const RAY_COST: u32 = 12;

struct RtHard {
    resolve: Pass,
    inspect: Pass,
}

impl Technique for RtHard {
    fn render(&mut self, f: &mut Frame) -> Result<()> {
        f.run(&self.resolve).in_bands(RAY_COST).per_pixel();
        if f.wants_any_map() {
            f.run(&self.inspect).per_pixel();
        }
        Ok(())
    }
}
