//! Silhouette edges drawn into a single map as quads around them (`shaders/map/edge_quads.wgsl`).

use super::Maps;
use super::silhouettes::Silhouettes;
use crate::frame::Frame;
use crate::gpu::{Buffer, Gpu, Pass, Raster, Resource, Slot, hold};
use crate::params::{Group, Params};
use crate::scene::edges::Found;
use crate::view::{self, Class, Drawn, Legend, View};
use anyhow::Result;
use wgpu::TextureFormat as Format;
use wgpu::TextureUsages as Use;

crate::params! {
    /// Which edges are drawn into the map.
    pub struct QuadParams {
        "Edges" {
            /// Which edges are drawn. Silhouette: those between what faces the light and what is turned away, or where a surface ends. All: every edge; those inside a shadow's outline then get in the way.
            edges: choice("silhouette", ["silhouette", "all"]),
            /// How much farther from the light than all that the map holds around it an edge may lie before it counts as hidden.
            kill_bias: float(0.01, 0.0..=100.0, "m", 0.1 of view),
        }
    }
}

/// The views of techniques with quads.
pub const VIEWS: [View; 2] = [
    view::map(
        "edge-quads",
        "Edge quads",
        "The map, near bright, with the silhouette's edges and the quads that are drawn around them.",
        Drawn::Labels(Legend::Classes(&[Class::label(0, "an edge"), Class::label(3, "its quad's outline")])),
    ),
    view::map(
        "silhouette-edges",
        "Silhouette edges",
        "The edges over the scene that bound what the light sees of it.",
        Drawn::Labels(Legend::Classes(&[Class::label(0, "an edge of the silhouette")])),
    ),
];

/// Where pixels lie among texels that differ.
pub const USE: View = view::map(
    "edge-use",
    "Edges looked up",
    "Pixels whose four texels are neither all lit nor all in shadow, so that an edge decides.",
    Drawn::Labels(Legend::Classes(&[
        Class::label(2, "by the silhouette"),
        Class::label(3, "by one edge alone, where edges have numbers (exact corners)"),
        Class::label(0, "by none: as the plain map has it"),
    ])),
);

/// Finds the edges and draws them.
pub struct EdgeQuads {
    file: &'static str,
    groups: &'static [Group],
    silhouettes: Silhouettes,
    lines: Option<((), [Pass; 2])>,
    drawn: Slot,
}

/// The edges that a frame draws.
pub enum Edges {
    /// Arguments of an indirect draw.
    Silhouette(Buffer),
    /// So many.
    All(u32),
}

impl Edges {
    pub fn draw(&self, p: &mut wgpu::RenderPass) {
        match self {
            Edges::Silhouette(draw) => p.draw_indirect(draw, 0),
            Edges::All(count) => p.draw(0..6 * count, 0..1),
        }
    }
}

impl EdgeQuads {
    /// `file`: the technique's shader, which includes `map/edge_quads.wgsl`, with its filter; `groups`: all of its parameters.
    ///
    /// # Errors
    /// Passes that cannot be made.
    pub fn new(gpu: &Gpu, file: &'static str, groups: &'static [Group]) -> Result<EdgeQuads> {
        let silhouettes = Silhouettes::new(gpu, 6, true)?;
        Ok(EdgeQuads { file, groups, silhouettes, lines: None, drawn: Slot::default() })
    }

    /// A pass that draws quads: `fragment` leaves what `format` holds and a priority, of which the smallest wins; with `last`, what
    /// comes last.
    ///
    /// # Errors
    /// A pass that cannot be made.
    pub fn pass(&self, gpu: &Gpu, name: &'static str, fragment: &str, format: Format, last: bool) -> Result<Pass> {
        let compare = if last { wgpu::CompareFunction::Always } else { wgpu::CompareFunction::Less };
        let depth = wgpu::DepthStencilState {
            format: Format::Depth32Float,
            depth_write_enabled: Some(true),
            depth_compare: Some(compare),
            stencil: Default::default(),
            bias: Default::default(),
        };
        let targets = [format];
        let fragment = Some(fragment);
        let raster = Raster { vertex: "corner", fragment, targets: &targets, depth: Some(depth), ..Raster::default() };
        Pass::render(gpu, name, self.file, raster, self.groups)
    }

    /// The edges for the frame's light, and what the mesh makes of them, told in a note.
    ///
    /// # Errors
    /// More edges than the adapter can bind at once.
    pub fn find(&mut self, f: &mut Frame) -> Result<Edges> {
        let (draw, found) = self.silhouettes.find(f)?;
        tell(f, found);
        Ok(match QuadParams::read(f.values).edges.as_str() {
            "all" => Edges::All(self.silhouettes.edges.get(f)?.count),
            _ => Edges::Silhouette(draw),
        })
    }

    /// What passes over the map bind: the map that is drawn already, and where edges are looked at the lines of the view.
    ///
    /// # Errors
    /// Passes that cannot be made.
    pub fn bound(&mut self, f: &mut Frame, maps: &Maps, edges: &Edges) -> Result<Vec<(&'static str, Resource)>> {
        let mut bound: Vec<(&'static str, Resource)> =
            vec![("light_view", (&maps.light_views).into()), ("depth_map", (&maps.layers.each[0]).into())];
        if !f.wants_any_map() {
            self.drawn = Slot::default();
            return Ok(bound);
        }
        let usage = Use::RENDER_ATTACHMENT | Use::TEXTURE_BINDING;
        let drawn = self.drawn.get(f.gpu, "edge lines", f.size, Format::R32Float, usage);
        let shown = VIEWS.iter().position(|v| v.id == f.view);
        if let Some(i) = shown {
            let (gpu, file, groups) = (f.gpu, self.file, self.groups);
            let pass = |vertex, fragment| {
                let raster =
                    Raster { vertex, fragment: Some(fragment), targets: &[Format::R32Float], ..Raster::default() };
                Pass::render(gpu, "edge lines", file, raster, groups)
            };
            let lines =
                hold(&mut self.lines, (), |()| Ok([pass("wire_corner", "wire")?, pass("line_corner", "edge_line")?]))?;
            let run = f.run(&lines[i]).bind_all(&bound).uncounted();
            let run = if i == 1 { run.of_picture() } else { run };
            run.draw(&[&drawn], None, true, |p| edges.draw(p));
        }
        bound.push(("edge_lines", (&drawn).into()));
        Ok(bound)
    }
}

/// Tells what the mesh breaks.
fn tell(f: &mut Frame, found: Found) {
    let mut parts = Vec::new();
    if found.open > 0 {
        parts.push(format!(
            "{} edges belong to one triangle only: where a surface ends they count as silhouette",
            found.open
        ));
    }
    if found.crowded > 0 {
        parts.push(format!(
            "{} edges belong to more than two triangles: only the sum of their sides says whether they cast",
            found.crowded
        ));
    }
    if found.twisted > 0 {
        parts.push(format!(
            "along {} edges triangles are turned against one another: some count as silhouette inside a shadow",
            found.twisted
        ));
    }
    if found.degenerate > 0 {
        parts.push(format!("{} triangles without an area have no edges and are skipped", found.degenerate));
    }
    if !parts.is_empty() {
        f.tell_note(format!("The mesh is not closed and even: {}.", parts.join("; ")));
    }
}
