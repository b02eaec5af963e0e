//! Silhouette edges drawn into maps as quads around them (`shaders/map/edge_quads.wgsl`).

use super::filter::{Filter, shader};
use super::plain::PlainMaps;
use super::silhouettes::{self, Silhouettes};
use super::{Layers, MOST, Maps};
use crate::frame::Frame;
use crate::gpu::{Buffer, Gpu, Pass, Raster, Resource, Slot, hold};
use crate::params::{Group, Params};
use crate::scene::edges::Found;
use crate::view::{self, Class, Drawn, Legend, View};
use anyhow::Result;
use wgpu::TextureFormat as Format;
use wgpu::{BufferUsages, TextureUsages as Use};

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
    silhouettes::EDGES,
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

/// Draws maps, finds the edges, draws these into them and looks both up.
pub struct EdgeQuads {
    files: [&'static str; 2],
    filter: &'static Filter,
    groups: &'static [Group],
    maps: PlainMaps,
    silhouettes: Silhouettes,
    /// Of maps around a lamp: writes the draws of each.
    each: Option<((), (Pass, Buffer))>,
    lines: Option<(String, [Pass; 2])>,
    drawn: Slot,
}

/// The maps of a frame, and its edges.
pub struct Edges {
    pub maps: Maps,
    all: Draw,
    /// Of each map.
    onto: Vec<Onto>,
}

/// A map as edges are drawn into it.
struct Onto {
    light_view: Buffer,
    draw: Draw,
}

#[derive(Clone)]
enum Draw {
    /// Arguments of an indirect draw, from a byte on.
    Indirect(Buffer, u64),
    /// So many edges.
    Edges(u32),
}

impl Draw {
    fn draw(&self, p: &mut wgpu::RenderPass) {
        match self {
            Draw::Indirect(draw, at) => p.draw_indirect(draw, *at),
            Draw::Edges(count) => p.draw(0..6 * count, 0..1),
        }
    }
}

/// What edges leave in each map, and the priorities that decide between them.
#[derive(Default)]
pub struct Kept {
    what: Option<Layers>,
    priority: Option<Layers>,
}

impl EdgeQuads {
    /// `files`: the technique's shaders for a single map and for those around a lamp, which include `map/edge_quads.wgsl`;
    /// `filter`: what looks them up; `groups`: all of its parameters.
    ///
    /// # Errors
    /// Passes that cannot be made.
    pub fn new(
        gpu: &Gpu,
        files: [&'static str; 2],
        filter: &'static Filter,
        groups: &'static [Group],
    ) -> Result<EdgeQuads> {
        Ok(EdgeQuads {
            files,
            filter,
            groups,
            maps: PlainMaps::new(files, groups),
            silhouettes: Silhouettes::new(gpu, 6, true)?,
            each: None,
            lines: None,
            drawn: Slot::default(),
        })
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
        // Whatever the light, as edges know the view of a map alone.
        Pass::render(gpu, name, &shader(self.files[0], self.filter, None), raster, self.groups)
    }

    /// Draws the maps and finds the edges for the frame's light; what the mesh makes of them is told in a note.
    ///
    /// # Errors
    /// More edges than the adapter can bind at once, or maps that it cannot hold.
    pub fn find(&mut self, f: &mut Frame) -> Result<Edges> {
        let maps = self.maps.draw(f, (self.filter.reach)(f))?;
        let (all, listed, found) = if QuadParams::read(f.values).edges == "all" {
            let (count, unlisted, found) = self.silhouettes.take_all(f)?;
            (Draw::Edges(count), unlisted, found)
        } else {
            let (listed, found) = self.silhouettes.find(f)?;
            (Draw::Indirect(listed.clone(), 0), listed, found)
        };
        tell(f, found);
        let Some((views, face_draws)) = self.maps.faces() else {
            self.each = None;
            let onto = vec![Onto { light_view: maps.light_views.clone(), draw: all.clone() }];
            return Ok(Edges { maps, all, onto });
        };
        let gpu = f.gpu;
        let (pass, draws) = hold(&mut self.each, (), |()| {
            let pass = Pass::compute(gpu, "edge draws", "map/edge_draws.wgsl", "draw_edges", &[QuadParams::GROUP])?;
            Ok((pass, gpu.room("draws of edges", MOST as u64 * 16, BufferUsages::STORAGE | BufferUsages::INDIRECT)))
        })?;
        let (pass, draws) = (&*pass, &*draws);
        f.run(pass)
            .bind("listed_draw", &listed)
            .bind("face_draws", &face_draws)
            .bind("edge_draws", draws)
            .dispatch(1, 1, 1);
        let onto = |(i, light_view)| Onto { light_view, draw: Draw::Indirect(draws.clone(), 16 * i as u64) };
        let onto = views.into_iter().take(maps.layers.each.len()).enumerate().map(onto).collect();
        Ok(Edges { maps, all, onto })
    }

    /// Draws the edges into all maps, by a pass of [`EdgeQuads::pass`]: what they leave, and its priority. `beside`: what each map
    /// holds that the pass reads, by name.
    ///
    /// # Errors
    /// Maps that the adapter cannot hold.
    pub fn draw(
        &self,
        f: &mut Frame,
        (pass, format): (&Pass, Format),
        edges: &Edges,
        kept: &mut Kept,
        beside: Option<(&'static str, &Layers)>,
    ) -> Result<[Layers; 2]> {
        let maps = &edges.maps;
        let what = Layers::hold(&mut kept.what, f.gpu, &maps.sides, format)?;
        let priority = Layers::hold(&mut kept.priority, f.gpu, &maps.sides, Format::Depth32Float)?;
        for (i, (onto, map)) in edges.onto.iter().zip(&maps.layers.each).enumerate() {
            let run = f.run(pass).bind("light_view", &onto.light_view).bind("depth_map", map).for_layer(map);
            let run = match beside {
                Some((name, layers)) => run.bind(name, &layers.each[i]),
                None => run,
            };
            let depth = Some((&priority.each[i], 1.0));
            run.draw(&[&what.each[i]], depth, true, |p| onto.draw.draw(p));
        }
        Ok([what, priority])
    }

    /// Looks maps and edges up, and draws the views. `bound`: what the filter and the technique's views read, by name.
    ///
    /// # Errors
    /// Passes that cannot be made.
    pub fn look_up(&mut self, f: &mut Frame, edges: &Edges, mut bound: Vec<(&'static str, Resource)>) -> Result<()> {
        if f.wants_any_map() {
            bound.push(("edge_lines", (&self.lines(f, edges)?).into()));
        } else {
            self.drawn = Slot::default();
        }
        self.maps.look_up(f, &edges.maps, self.filter, &bound)
    }

    /// The lines that a view shows: none but in the views of lines.
    fn lines(&mut self, f: &mut Frame, edges: &Edges) -> Result<wgpu::TextureView> {
        let usage = Use::RENDER_ATTACHMENT | Use::TEXTURE_BINDING;
        let (gpu, format) = (f.gpu, f.gpu.blended_sums());
        let drawn = self.drawn.get(gpu, "edge lines", f.size, format, usage);
        if VIEWS.iter().all(|v| v.id != f.view) {
            return Ok(drawn);
        }
        let (groups, maps) = (self.groups, &edges.maps);
        let file = shader(self.maps.file(), self.filter, None);
        let [wire, line] = hold(&mut self.lines, file, |file| {
            let raster =
                Raster { vertex: "wire_corner", fragment: Some("wire"), targets: &[format], ..Raster::default() };
            let wire = Pass::render(gpu, "edge lines", file, raster, groups)?;
            Ok([wire, silhouettes::lines(gpu, "edge lines", file, groups)?])
        })?;
        if f.view == silhouettes::EDGES.id {
            let run = f.run(line).uncounted().of_picture();
            run.draw(&[&drawn], None, true, |p| edges.all.draw(p));
            return Ok(drawn);
        }
        for (i, onto) in edges.onto.iter().enumerate() {
            let run = f.run(wire).bind_all(&maps.bound).bind("light_view", &onto.light_view);
            let run = run.bind("light_views", &maps.light_views).uncounted();
            run.draw(&[&drawn], None, i == 0, |p| onto.draw.draw(p));
        }
        Ok(drawn)
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
