//! The silhouette as the light sees it (`shaders/map/silhouettes.wgsl`): found on the GPU whenever it is drawn.

use crate::frame::Frame;
use crate::gpu::{Buffer, Gpu, Pass, hold};
use crate::scene::edges::{EdgeBuffers, Found};
use anyhow::Result;
use wgpu::BufferUsages as Use;

/// Edges that a thread looks through, `run_length` in WGSL.
const RUN: u32 = 32;
/// Most workgroups along x.
const ROW: u32 = 32768;

/// Finds silhouette edges.
pub struct Silhouettes {
    pub edges: EdgeBuffers,
    face: Pass,
    count: Pass,
    scan: Pass,
    list: Pass,
    draw: Buffer,
    /// An edge is listed as often as its weight says.
    repeated: bool,
    /// For so many triangles, edges and entries of the list.
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
        let (edges, found) = {
            let held = self.edges.get(f)?;
            (held.count, held.found)
        };
        let most_listed = if self.repeated { f.geometry.edges().sides.len() as u32 } else { edges };
        let sizes = [f.scene.triangle_count, edges, most_listed];
        let gpu = f.gpu;
        let held = hold(&mut self.held, sizes, |_| {
            let room =
                |label, count: u32, bytes| gpu.room(label, u64::from(count) * bytes, Use::STORAGE | Use::COPY_SRC);
            Ok(Held {
                facing: room("facing", sizes[0], 4),
                runs: room("runs of edges", edges.div_ceil(RUN), 4),
                list: room("silhouettes", most_listed, 16),
            })
        })?;
        f.set("facing", &held.facing);
        f.set("silhouettes", &held.list);
        let [triangles, runs] = [groups(sizes[0]), groups(edges.div_ceil(RUN))];
        f.run(&self.face).dispatch(triangles[0], triangles[1], 1);
        f.run(&self.count).bind("runs", &held.runs).dispatch(runs[0], runs[1], 1);
        f.run(&self.scan).bind("runs", &held.runs).bind("draw", &self.draw).dispatch(1, 1, 1);
        f.run(&self.list).bind("runs", &held.runs).dispatch(runs[0], runs[1], 1);
        Ok((self.draw.clone(), found))
    }
}
