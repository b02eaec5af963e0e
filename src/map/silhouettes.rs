//! The silhouette as the light sees it (`shaders/map/silhouettes.wgsl`): found on the GPU whenever it is drawn.

use crate::frame::Frame;
use crate::gpu::{Buffer, Gpu, Pass, Raster, hold};
use crate::params::Group;
use crate::scene::edges::{EdgeBuffers, Found};
use crate::view::{self, Class, Drawn, Legend, View};
use anyhow::Result;
use wgpu::BufferUsages as Use;

/// Edges that a thread looks through, `run_length` in WGSL.
const RUN: u32 = 32;
/// Most workgroups along x.
const ROW: u32 = 32768;

/// Finds silhouette edges.
pub struct Silhouettes {
    edges: EdgeBuffers,
    face: Pass,
    count: Pass,
    scan: Pass,
    list: Pass,
    draw: Buffer,
    /// An edge is listed as often as its weight says.
    repeated: bool,
    /// For so many triangles, runs of edges and entries of the list.
    held: Option<([u32; 3], Held)>,
}

struct Held {
    facing: Buffer,
    runs: Buffer,
    list: Buffer,
}

/// What is listed.
#[derive(Clone, Copy, Debug)]
pub struct Kind {
    /// How many vertices each entry is drawn by.
    pub vertices: u32,
    /// Triangles that are turned away from the light count too.
    pub both_sides: bool,
    /// An edge is listed as often as its weight says, each time with a weight of 1: for what counts by ones.
    pub repeated: bool,
    /// Triangles with holes by their texture count, as if they had none.
    pub masked: bool,
}

/// The pass that fills `facing`; `masked` as in [`Kind`].
///
/// # Errors
/// A pass that cannot be made.
pub fn face(gpu: &Gpu, masked: bool) -> Result<Pass> {
    let constants = [("with_masked", masked as u32 as f64)];
    Pass::specialised(gpu, "silhouette", "map/silhouettes.wgsl", "face", &[], &constants)
}

/// The view of the edges.
pub const EDGES: View = view::map(
    "silhouette-edges",
    "Silhouette edges",
    "The edges over the scene that bound what the light sees of it; faint behind surfaces.",
    Drawn::Labels(Legend::Classes(&[Class::label(0, "silhouette edge; faint behind surfaces")])),
);

/// The pass that draws that view's lines into a target of [`Gpu::blended_sums`], six vertices an edge. `file` includes
/// `lib/edge_lines.wgsl` and has its `line_corner`.
///
/// # Errors
/// A pass that cannot be made.
pub fn lines(gpu: &Gpu, name: &'static str, file: &str, groups: &[Group]) -> Result<Pass> {
    let strongest = wgpu::BlendComponent {
        src_factor: wgpu::BlendFactor::One,
        dst_factor: wgpu::BlendFactor::One,
        operation: wgpu::BlendOperation::Max,
    };
    let raster = Raster {
        vertex: "line_corner",
        fragment: Some("edge_line"),
        targets: &[gpu.blended_sums()],
        blend: Some(wgpu::BlendState { color: strongest, alpha: strongest }),
        ..Raster::default()
    };
    Pass::render(gpu, name, file, raster, groups)
}

/// Workgroups of 64 threads for so many, in rows.
pub fn groups(threads: u32) -> [u32; 2] {
    let groups = threads.div_ceil(64);
    [groups.min(ROW), groups.div_ceil(ROW)]
}

impl Silhouettes {
    /// `vertices`: how many each silhouette edge is drawn by. `both_sides`: triangles that are turned away from the light count
    /// too, so that open meshes have silhouettes where they end.
    ///
    /// # Errors
    /// Passes that cannot be made.
    pub fn new(gpu: &Gpu, vertices: u32, both_sides: bool) -> Result<Silhouettes> {
        Silhouettes::of(gpu, Kind { vertices, both_sides, repeated: false, masked: true })
    }

    /// # Errors
    /// Passes that cannot be made.
    pub fn of(gpu: &Gpu, kind: Kind) -> Result<Silhouettes> {
        let flag = |name, on: bool| (name, on as u32 as f64);
        let listed = [flag("both_sides", kind.both_sides), flag("repeated", kind.repeated)];
        let pass = |entry, constants: &[(&str, f64)]| {
            Pass::specialised(gpu, "silhouette", "map/silhouettes.wgsl", entry, &[], constants)
        };
        Ok(Silhouettes {
            edges: EdgeBuffers::default(),
            face: face(gpu, kind.masked)?,
            count: pass("count", &listed)?,
            scan: pass("scan", &[("vertices_each", kind.vertices as f64)])?,
            list: pass("list", &listed)?,
            repeated: kind.repeated,
            draw: gpu.room("draw of silhouettes", 16, Use::STORAGE | Use::INDIRECT | Use::COPY_SRC),
            held: None,
        })
    }

    /// Lists the silhouette edges for the frame's light. Passes that follow find them as `silhouettes`
    /// (`shaders/lib/silhouette.wgsl`), what faces the light as `facing`, and the edges themselves; the buffer holds the arguments of
    /// an indirect draw of all.
    ///
    /// # Errors
    /// More edges than the adapter can bind at once.
    pub fn find(&mut self, f: &mut Frame) -> Result<(Buffer, Found)> {
        let edges = self.edges.get(f)?;
        let (count, found) = (edges.count, edges.found);
        let most_listed = if self.repeated { f.geometry.edges().sides.len() as u32 } else { count };
        let runs = self.face(f, [count.div_ceil(RUN), most_listed])?;
        let [x, y] = groups(count.div_ceil(RUN));
        f.run(&self.count).bind("runs", &runs).dispatch(x, y, 1);
        f.run(&self.scan).bind("runs", &runs).bind("draw", &self.draw).dispatch(1, 1, 1);
        f.run(&self.list).bind("runs", &runs).dispatch(x, y, 1);
        Ok((self.draw.clone(), found))
    }

    /// For what takes all edges: as [`Silhouettes::find`], but nothing is listed, and how many edges there are is told. The buffer is
    /// bound in the other's place.
    ///
    /// # Errors
    /// As [`Silhouettes::find`].
    pub fn take_all(&mut self, f: &mut Frame) -> Result<(u32, Buffer, Found)> {
        let edges = self.edges.get(f)?;
        let (count, found) = (edges.count, edges.found);
        self.face(f, [1, 1])?;
        Ok((count, self.draw.clone(), found))
    }

    /// Finds what faces the light; room for runs of edges and for entries of the list.
    fn face(&mut self, f: &mut Frame, [runs, listed]: [u32; 2]) -> Result<Buffer> {
        let (gpu, triangles) = (f.gpu, f.scene.triangle_count);
        let held = hold(&mut self.held, [triangles, runs, listed], |_| {
            let room =
                |label, count: u32, bytes| gpu.room(label, u64::from(count) * bytes, Use::STORAGE | Use::COPY_SRC);
            Ok(Held {
                facing: room("facing", triangles, 4),
                runs: room("runs of edges", runs, 4),
                list: room("silhouettes", listed, 16),
            })
        })?;
        f.set("facing", &held.facing);
        f.set("silhouettes", &held.list);
        let [x, y] = groups(triangles);
        f.run(&self.face).dispatch(x, y, 1);
        Ok(held.runs.clone())
    }
}
