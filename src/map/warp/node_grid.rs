//! A warp by a grid of nodes that move until cells have the areas they ask for: its buffers, passes and views.
//!
//! Shaders: `map/warp/node_grid.wgsl` (the warp), `map/warp/relax.wgsl` (how the nodes move), `map/warp/node_views.wgsl`. A technique's
//! own shader has the entry point `solve`, one workgroup, which leaves the nodes in `placed_nodes`.

use crate::frame::Frame;
use crate::gpu::{Buffer, Gpu, Pass, Resource};
use crate::map::filter::alone;
use crate::map::warp::storage;
use crate::params::Group;
use crate::view::{self, BEFORE_AFTER, Class, Drawn, Legend, View};
use anyhow::Result;

/// The views of the grid.
pub const MAPS: [View; 2] = [
    view::map(
        "nodes",
        "Grid of nodes",
        "The map with the deformed grid: lines between nodes, which are red. Yellow: cells that are folded over \
              or not convex, where two places of the scene share texels.",
        Drawn::Labels(Legend::Classes(&[
            Class::label(0, "nodes"),
            Class::label(3, "lines of the grid"),
            Class::label(1, "folded or not convex"),
        ])),
    ),
    view::map(
        "cells",
        "Balance of the cells",
        "Left: before the warp. Right: in the map. What a cell asks for over what it has: orange, more than its \
              area; blue, less; strongest from 16 times on. Pale on the right: the grid has reached its goal.",
        Drawn::Labels(Legend::Squares(
            BEFORE_AFTER,
            &[Class::label(0, "asks for more than its area"), Class::label(4, "for less")],
        )),
    ),
];

/// Vectors a node that the solvers keep.
const VECTORS: u64 = 5;
/// Room for the potential: the number of steps, then one before the first and one after each of 500.
const ENERGIES: u64 = 502;

/// The grid, and what makes it.
pub struct NodeGrid {
    solve: Pass,
    table: Pass,
    draw: Pass,
    held: Option<Held>,
    drawing: Option<Buffer>,
    energies: Buffer,
}

/// Buffers of one number of cells along a side.
struct Held {
    side: u32,
    nodes: Buffer,
    table: Buffer,
    solver: Buffer,
    weights: Buffer,
}

impl NodeGrid {
    /// From a technique's own shader, with all of its parameters.
    pub fn new(gpu: &Gpu, file: &'static str, groups: &'static [Group]) -> Result<NodeGrid> {
        let pass = |name, entry| Pass::compute(gpu, name, &alone(file), entry, groups);
        Ok(NodeGrid {
            solve: pass("node relaxation", "solve")?,
            table: pass("cell table", "make_table")?,
            draw: pass("node drawing", "draw_nodes")?,
            held: None,
            drawing: None,
            energies: storage(gpu, "potential", ENERGIES * 4),
        })
    }

    /// What the technique's shader binds of a grid of `side`² cells, by name.
    pub fn bound(&mut self, f: &mut Frame, side: u32) -> Vec<(&'static str, Resource)> {
        if self.held.as_ref().is_some_and(|h| h.side != side) {
            self.held = None;
        }
        let held = self.held.get_or_insert_with(|| {
            let (cells, nodes) = (side as u64 * side as u64, (side as u64 + 1).pow(2));
            Held {
                side,
                nodes: storage(f.gpu, "grid nodes", nodes * 8),
                table: storage(f.gpu, "cell table", cells * 16),
                solver: storage(f.gpu, "nodes on their way", nodes * 8 * VECTORS),
                weights: storage(f.gpu, "cell weights", cells * 4),
            }
        });
        // Drawn into where it is looked at; elsewhere it need only be there.
        let pixels = if f.view == "nodes" { f.size[0] as u64 * f.size[1] as u64 } else { 4 };
        let drawing = match self.drawing.take().filter(|d| d.size() >= pixels * 4) {
            Some(drawing) => drawing,
            None => storage(f.gpu, "node drawing", pixels * 4),
        };
        let bound = vec![
            ("grid_nodes", (&held.nodes).into()),
            ("placed_nodes", (&held.nodes).into()),
            ("cell_table", (&held.table).into()),
            ("table_made", (&held.table).into()),
            ("solver", (&held.solver).into()),
            ("weights", (&held.weights).into()),
            ("cell_weights", (&held.weights).into()),
            ("energies", (&self.energies).into()),
            ("energy_curve", (&self.energies).into()),
            ("drawing", (&drawing).into()),
            ("drawn_grid", (&drawing).into()),
        ];
        self.drawing = Some(drawing);
        bound
    }

    /// Moves the nodes to where the cells' weights want them.
    pub fn solve(&self, f: &mut Frame, bound: &[(&'static str, Resource)]) {
        let Some(held) = &self.held else { return };
        f.run(&self.solve).bind_all(bound).dispatch(1, 1, 1);
        let groups = held.side.div_ceil(4);
        f.run(&self.table).bind_all(bound).dispatch(groups, groups, 1);
    }

    /// Draws the grid where it is looked at; before the map's own views.
    pub fn draw(&self, f: &mut Frame, bound: &[(&'static str, Resource)]) {
        if let (Some(held), Some(drawing), "nodes") = (&self.held, &self.drawing, f.view) {
            f.clear(drawing);
            let groups = held.side.div_ceil(8);
            f.run(&self.draw).bind_all(bound).dispatch(groups, groups, 1);
        }
    }
}
