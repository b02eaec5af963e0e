//! Distorted shadow mapping (Jia, Luo, Zhang 2013), in our reading.

use super::{Info, MAPS, NEAREST, Technique};
use crate::frame::Frame;
use crate::gpu::{Gpu, Need, Pass};
use crate::map::Layers;
use crate::map::casters::{Casters, Target, Triangles};
use crate::map::filter::alone;
use crate::map::warp::node_grid::{self, NodeGrid};
use crate::map::warp::{self, RasterParams, Warped};
use crate::map::{BiasParams, CasterParams, MapParams};
use crate::params::Params;
use crate::view::{self, Class, Drawn, Legend};
use anyhow::Result;

crate::params! {
    /// How the grid follows the silhouettes.
    pub struct DsmParams {
        "Importance" {
            /// The smallest jump in depth between neighbouring texels that counts as an edge. Small: slopes that the light grazes count as edges too. Large: low casters are missed.
            depth_threshold: float(0.01, 0.001..=0.1, "× range"),
            /// Importance of a cell without an edge; a cell full of edges has 1 on top of it. Small: edges get nearly the whole map.
            floor: float(0.1, 0.01..=1.0, ""),
        }
        "Grid" {
            /// Cells along each side of the grid. With many, the warp follows thin silhouettes, but triangles cross more bends.
            grid: int(32, 8..=128, "cells"),
            /// Steps that the nodes take. Long moves need many.
            iterations: int(50, 10..=200, "steps"),
            /// How much of its own best step a node takes each time. A step that does not help is halved.
            relaxation: float(0.3, 0.05..=1.0, ""),
        }
    }
}

pub static INFO: Info = Info {
    id: "dsm",
    title: "Distorted shadow mapping",
    paper: "Jia, Luo, Zhang 2013",
    family: "Warping",
    mark: 10,
    doc: "Draws a plain map, finds the jumps in its depth, and distorts a grid over the map so that these silhouettes \
          get more texels. It knows nothing of the camera: edges that nobody sees get just as many.",
    lights: &["directional", "spot"],
    filter: Some(NEAREST),
    smooth: |_| false,
    params: &[DsmParams::GROUP, RasterParams::GROUP, MapParams::GROUP, CasterParams::GROUP, BiasParams::GROUP],
    main: &[("resolution", "256..4096*2"), ("grid", "16,32,64"), ("iterations", "50,200")],
    maps: &[
        MAPS,
        &warp::MAPS,
        &[view::map(
            "edges",
            "Edge mask",
            "The plain map that is drawn first; texels between which depth jumps are red.",
            Drawn::Labels(Legend::Classes(&[Class::label(0, "depth jumps")])),
        )],
        &node_grid::MAPS,
    ],
    needs: |_| &[Need::StorageBuffers(5)],
    make: |gpu, _| Ok(Box::new(Dsm::new(gpu)?)),
};

struct Dsm {
    warped: Warped,
    grid: NodeGrid,
    plain: Option<Layers>,
    casters: Casters,
    importance: Pass,
}

impl Dsm {
    fn new(gpu: &Gpu) -> Result<Dsm> {
        let file = "techniques/dsm.wgsl";
        Ok(Dsm {
            warped: Warped::new(gpu, file, INFO.params)?,
            grid: NodeGrid::new(gpu, file, INFO.params)?,
            plain: None,
            casters: Casters::named(["plain map", "plain map (masked)"]),
            importance: Pass::compute(gpu, "importance", &alone(file), "importance", INFO.params)?,
        })
    }
}

impl Technique for Dsm {
    fn render(&mut self, f: &mut Frame) -> Result<()> {
        let p = DsmParams::read(f.values);
        let resolution = MapParams::read(f.values).resolution;
        let base = self.warped.base(f, None, false, false)?;
        let plain = Layers::hold(&mut self.plain, f.gpu, &[resolution], wgpu::TextureFormat::Depth32Float)?;
        let map = &plain.each[0];
        let mut bound = self.grid.bound(f, p.grid);
        bound.extend([("light_view", (&base.light_view).into()), ("plain_map", map.into())]);
        if base.changed {
            // Linear depth, as the look-up has it.
            self.casters.draw(f, map, Target::whole(resolution, &base.light_view, true), &Triangles::All)?;
            f.run(&self.importance).bind_all(&bound).dispatch(p.grid, p.grid, 1);
            self.grid.solve(f, &bound);
        }
        self.grid.draw(f, &bound);
        self.warped.draw(f, &base, &bound)?;
        Ok(())
    }
}
