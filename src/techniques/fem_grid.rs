//! A warp grid of finite elements (Navratil 2015, section 5.4.3): his direct stiffness method, and the potential that he left
//! open.

use super::{Info, MAPS, NEAREST, Technique};
use crate::frame::Frame;
use crate::gpu::{Buffer, Gpu, Need, Pass};
use crate::map::filter::alone;
use crate::map::warp::node_grid::{self, NodeGrid};
use crate::map::warp::{self, RasterParams, Warped, storage};
use crate::map::{BiasParams, CasterParams, MapParams};
use crate::params::Params;
use crate::view::{self, Area, Axis, Class, Drawn, Legend, Span};
use anyhow::Result;

crate::params! {
    /// How the grid follows the aliasing error.
    pub struct FemGridParams {
        "Grid" {
            /// What the map covers before the warp. None: the whole scene. Dv (desired view): the view samples that face the light.
            crop: choice("dv", ["none", "dv"]),
            /// Cells along each side of the grid.
            grid: int(16, 8..=64, "cells"),
            /// How the nodes find their places. Energy: the potential of all cells is lowered step by step, and no cell folds. Seed-stiffness: one linear system of springs, as the thesis tried it; the grid folds.
            variant: choice("energy", ["energy", "seed-stiffness"]),
            /// The most steps that the nodes take; 0 leaves the grid regular.
            steps: int(100, 0..=500, "steps") if variant = "energy",
            /// How stiffly the grid resists bending, where a node lies off the mean of its neighbours (the springs of the thesis; μ).
            smoothing: float(0.05, 0.0..=1.0, "") if variant = "energy" and steps > 0,
        }
        "Importance" {
            /// What a cell holds: the sum of its view samples' aliasing errors, or the square root of that sum, which warps less and leaves fewer errors.
            error: choice("sqrt", ["sum", "sqrt"]) if variant = "seed-stiffness" or steps > 0,
            /// What every cell holds on top, as a share of the mean. Small: empty cells give up nearly all of their area, and long moves take many steps.
            floor: float(0.1, 0.001..=1.0, "× mean") if variant = "seed-stiffness" or steps > 0,
        }
    }
}

pub static INFO: Info = Info {
    id: "fem-grid",
    title: "Finite-element warp grid",
    paper: "Navratil 2015",
    family: "Warping",
    mark: 11,
    doc: "Adds up the aliasing errors of all pixels in the cells of a coarse grid, and lets the cells press against each \
          other until their areas follow the errors. Its seed, a system of springs solved at once, folds the grid.",
    lights: &["directional", "spot"],
    filter: Some(NEAREST),
    smooth: |_| false,
    params: &[FemGridParams::GROUP, RasterParams::GROUP, MapParams::GROUP, CasterParams::GROUP, BiasParams::GROUP],
    main: &[("resolution", "256..4096*2"), ("grid", "8,16,32"), ("steps", "0,100,300")],
    maps: &[
        MAPS,
        &warp::MAPS,
        &[view::map(
            "energy",
            "Energy",
            "The potential after each step, over that of the regular grid, with a line at each tenth. Seed- \
                  stiffness: the linear solver's squared residual, from 1 at the top down to 10⁻¹⁰.",
            Drawn::Labels(Legend::Chart(
                Area::Square,
                Axis { what: "share of the steps", span: Span::Linear(0.0, 1.0) },
                Axis { what: "potential over the regular grid's", span: Span::Linear(0.0, 1.0) },
                &[Class::label(1, "potential")],
            )),
        )],
        &node_grid::MAPS,
    ],
    needs: |_| &[Need::StorageBuffers(5)],
    make: |gpu, _| Ok(Box::new(FemGrid::new(gpu)?)),
};

struct FemGrid {
    warped: Warped,
    grid: NodeGrid,
    cell_errors: Pass,
    errors: Option<Buffer>,
}

impl FemGrid {
    fn new(gpu: &Gpu) -> Result<FemGrid> {
        let file = "techniques/fem_grid.wgsl";
        Ok(FemGrid {
            warped: Warped::new(gpu, file, INFO.params)?,
            grid: NodeGrid::new(gpu, file, INFO.params)?,
            cell_errors: Pass::compute(gpu, "cell errors", &alone(file), "cell_errors", INFO.params)?,
            errors: None,
        })
    }
}

impl Technique for FemGrid {
    fn render(&mut self, f: &mut Frame) -> Result<()> {
        let p = FemGridParams::read(f.values);
        let base = self.warped.base(f, None, p.crop == "dv", false)?;
        let size = p.grid as u64 * p.grid as u64 * 8;
        let errors = match self.errors.take().filter(|e| e.size() == size) {
            Some(errors) => errors,
            None => storage(f.gpu, "cell errors", size),
        };
        let mut bound = self.grid.bound(f, p.grid);
        bound.extend([("light_view", (&base.light_view).into()), ("error_sums", (&errors).into())]);
        if base.changed {
            f.clear(&errors);
            f.run(&self.cell_errors).bind_all(&bound).bind("errors_found", &errors).per_pixel();
            self.grid.solve(f, &bound);
        }
        self.errors = Some(errors);
        self.grid.draw(f, &bound);
        self.warped.draw(f, &base, &bound)?;
        Ok(())
    }
}
