//! Casters met by the rays of the texels that view samples need (`shaders/lib/warped_exact.wgsl`).

use super::{Casters, Way, shown, storage};
use crate::frame::Frame;
use crate::gpu::{Gpu, Pass, Raster, Resource, Slot, hold};
use crate::params::Group;
use anyhow::{Result, ensure};
use wgpu::BufferUsages as Use;

/// Bytes of a ray, and of a triangle with its box.
const RAY: u64 = 16;
const BOX: u64 = 16;
/// The format of the picture that triangles are drawn into, a pixel a cell; nothing is written there.
const CELLS: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

pub struct Exact {
    need: Pass,
    all: Pass,
    trace: Pass,
    sort: Pass,
    list: Pass,
    finish: Pass,
    meet: Pass,
    draw: Pass,
    picture: Slot,
    /// The box of the light's image that the rays lie in.
    bounds: wgpu::Buffer,
    /// Vertices of the draw of the rays.
    points: wgpu::Buffer,
    held: Option<(Size, Held)>,
}

#[derive(PartialEq)]
struct Size {
    triangles: u32,
    rays: u64,
    /// Texels of the map's side.
    resolution: u32,
}

struct Held {
    rays: wgpu::Buffer,
    nearest: wgpu::Buffer,
    taken: wgpu::Buffer,
    cells: wgpu::Buffer,
    boxes: wgpu::Buffer,
}

impl Exact {
    pub fn new(gpu: &Gpu, file: &'static str, groups: &[Group], way: &Way) -> Result<Exact> {
        let pass = |name, entry| Pass::compute(gpu, name, file, entry, groups);
        let untouched = wgpu::DepthStencilState {
            format: CELLS,
            depth_write_enabled: Some(false),
            depth_compare: Some(wgpu::CompareFunction::Always),
            stencil: Default::default(),
            bias: Default::default(),
        };
        let boxes = Raster { vertex: "box_caster", fragment: Some("box"), depth: Some(untouched), ..Raster::default() };
        let points = Raster {
            vertex: "ray_point",
            depth: Raster::nearest(way.format),
            topology: wgpu::PrimitiveTopology::PointList,
            ..Raster::default()
        };
        Ok(Exact {
            need: pass("needed texels", "needed_rays")?,
            all: pass("needed texels", "all_rays")?,
            trace: pass("texels' rays", "trace_needed_rays")?,
            sort: pass("texels' rays", "sort_rays")?,
            list: pass("rays meet casters", "box_triangles")?,
            finish: pass("rays meet casters", "finish_boxes")?,
            meet: Pass::render(gpu, "rays meet casters", file, boxes, groups)?,
            draw: Pass::render(gpu, "shadow map", file, points, groups)?,
            picture: Slot::default(),
            bounds: storage(gpu, "box of the rays", 16),
            points: gpu.buffer("draw of the rays", &[0; 16], Use::STORAGE | Use::INDIRECT),
            held: None,
        })
    }
}

impl Casters for Exact {
    fn draw(
        &mut self,
        f: &mut Frame,
        changed: bool,
        bound: &[(&'static str, Resource)],
        map: &wgpu::TextureView,
        arguments: &wgpu::Buffer,
    ) -> Result<()> {
        let resolution = map.texture().width();
        let texels = resolution as u64 * resolution as u64;
        // A view sample needs a texel, and rarely, on a border, more than one.
        let samples = 4 * f.size[0] as u64 * f.size[1] as u64;
        let whole = shown(f);
        let rays = if whole { texels } else { texels.min(samples) };
        let size = Size { triangles: f.scene.triangle_count, rays, resolution };
        let passes = [&self.need, &self.all, &self.trace, &self.sort, &self.list, &self.finish, &self.meet, &self.draw];
        let held = hold(&mut self.held, size, |size| {
            passes.iter().for_each(|p| p.forget());
            Held::new(f.gpu, size)
        })?;
        let side = cells_side(resolution);
        let picture = self.picture.get(f.gpu, "cells", [side; 2], CELLS, wgpu::TextureUsages::RENDER_ATTACHMENT);
        let buffers = [&held.rays, &held.nearest, &held.taken, &held.cells, &held.boxes];
        f.held(buffers.iter().map(|b| b.size()).sum());
        if let Some(texture) = self.picture.texture() {
            f.held(crate::gpu::bytes(texture));
        }
        if changed {
            let mut all = bound.to_vec();
            all.extend([
                ("rays", (&held.rays).into()),
                ("drawn_rays", (&held.rays).into()),
                ("nearest", (&held.nearest).into()),
                ("drawn_nearest", (&held.nearest).into()),
                ("texels_taken", (&held.taken).into()),
                ("cells", (&held.cells).into()),
                ("drawn_cells", (&held.cells).into()),
                ("boxes", (&held.boxes).into()),
                ("drawn_boxes", (&held.boxes).into()),
                ("ray_bounds", (&self.bounds).into()),
                ("found_bounds", (&self.bounds).into()),
                ("ray_arguments", (&self.points).into()),
            ]);
            for buffer in [&held.taken, &held.cells, &self.bounds, &self.points] {
                f.clear(buffer);
            }
            if whole {
                f.run(&self.all).bind_all(&all).dispatch(resolution.div_ceil(8), resolution.div_ceil(8), 1);
            } else {
                f.run(&self.need).bind_all(&all).per_pixel();
            }
            f.run(&self.trace).bind_all(&all).dispatch(256, 1, 1);
            f.run(&self.sort).bind_all(&all).dispatch(256, 1, 1);
            f.run(&self.list).bind_all(&all).dispatch(256, 1, 1);
            f.run(&self.finish).bind_all(&all).dispatch(1, 1, 1);
            f.run(&self.meet)
                .bind_all(&all)
                .uncounted()
                .draw(&[], Some((&picture, 0.0)), true, |p| p.draw_indirect(arguments, 0));
            let points = &self.points;
            f.run(&self.draw)
                .bind_all(&all)
                .uncounted()
                .draw(&[], Some((map, 0.0)), true, |p| p.draw_indirect(points, 0));
        }
        f.keep_table("rays", &held.rays);
        Ok(())
    }
}

/// Cells along each side of the rays' box, as in WGSL.
fn cells_side(resolution: u32) -> u32 {
    (resolution / 2).clamp(32, 512)
}

impl Held {
    fn new(gpu: &Gpu, size: &Size) -> Result<Held> {
        let &Size { triangles, rays, resolution } = size;
        let [texels, cells] = [resolution, cells_side(resolution)].map(|side| side as u64 * side as u64);
        ensure!(
            rays * RAY <= gpu.most_bound(),
            "{} binds too little memory at once for the rays of a {resolution}² map; choose a smaller resolution or another \
             view",
            gpu.info.name
        );
        Ok(Held {
            rays: storage(gpu, "texels' rays", rays * RAY),
            nearest: storage(gpu, "what rays meet", rays * 4),
            taken: storage(gpu, "texels with rays", texels.div_ceil(32) * 4),
            cells: storage(gpu, "cells", cells * 4),
            boxes: storage(gpu, "triangles' boxes", triangles as u64 * BOX),
        })
    }
}
