//! Casters met by the rays of the texels that view samples need (`shaders/map/warp/exact.wgsl`).

use super::{Casters, Dispatches, RAY_ARGUMENTS, Way, shown, storage};
use crate::frame::Frame;
use crate::gpu::{Buffer, Gpu, Pass, Raster, Resource, Slot, hold};
use crate::map::filter::alone;
use crate::params::Group;
use anyhow::Result;
use bytemuck::{Pod, Zeroable};
use wgpu::BufferUsages as Use;

/// Bytes of a ray, and of a triangle with its box.
const RAY: u64 = 16;
const BOX: u64 = 16;
/// Most rays that memory is held for at once: as many as a 4096² map has texels.
const MOST_RAYS: u64 = 1 << 24;
/// The format of the picture that triangles are drawn into, a pixel a cell; nothing is written there.
const CELLS: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// Workgroups of passes whose threads share rays or triangles: see `stride` in WGSL.
const THREADS: [u32; 2] = [256, 1];

/// As `RayBand` in WGSL.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Band {
    number: u32,
    first: u32,
    words: u32,
    padding: u32,
}

pub struct Exact {
    need: Pass,
    all: Pass,
    make: Pass,
    trace: Pass,
    sort: Pass,
    list: Pass,
    finish: Pass,
    meet: Pass,
    draw: Pass,
    picture: Slot,
    dispatches: Dispatches,
    held: Option<(Size, Held)>,
}

#[derive(PartialEq)]
struct Size {
    triangles: u32,
    /// Most that are needed.
    rays: u64,
    /// Texels of the map's side.
    resolution: u32,
}

struct Held {
    bands: Vec<Buffer>,
    rays: Buffer,
    nearest: Buffer,
    needed: Buffer,
    cells: Buffer,
    boxes: Buffer,
}

impl Exact {
    pub fn new(gpu: &Gpu, file: &'static str, groups: &[Group], way: &Way) -> Result<Exact> {
        let pass = |name, entry| Pass::compute(gpu, name, &alone(file), entry, groups);
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
            need: pass("needed texels", "need_looked_up")?,
            all: pass("needed texels", "need_all")?,
            make: pass("texels' rays", "make_rays")?,
            trace: pass("texels' rays", "trace_needed_rays")?,
            sort: pass("texels' rays", "sort_rays")?,
            list: pass("rays meet casters", "box_triangles")?,
            finish: pass("rays meet casters", "finish_band")?,
            meet: Pass::render(gpu, "rays meet casters", &alone(file), boxes, groups)?,
            draw: Pass::render(gpu, "shadow map", &alone(file), points, groups)?,
            picture: Slot::default(),
            dispatches: Dispatches::default(),
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
        (layer, map): (usize, &wgpu::TextureView),
        [arguments, state]: [&Buffer; 2],
    ) -> Result<()> {
        let resolution = map.texture().width();
        let texels = resolution as u64 * resolution as u64;
        let whole = shown(f);
        // A view sample needs a texel, and its eight neighbours at most.
        let asked = 9 * f.size[0] as u64 * f.size[1] as u64;
        let rays = if whole { texels } else { texels.min(asked) };
        let size = Size { triangles: f.scene.triangle_count, rays, resolution };
        let compute = [&self.need, &self.all, &self.make, &self.trace, &self.sort, &self.list, &self.finish];
        let held = hold(&mut self.held, size, |size| {
            compute.iter().chain(&[&self.meet, &self.draw]).for_each(|p| p.forget());
            Ok(Held::new(f.gpu, size))
        })?;
        let side = cells_side(resolution);
        let picture = self.picture.get(f.gpu, "cells", [side; 2], CELLS, wgpu::TextureUsages::RENDER_ATTACHMENT);
        if changed {
            let mut all = bound.to_vec();
            all.extend([
                ("rays", (&held.rays).into()),
                ("drawn_rays", (&held.rays).into()),
                ("nearest", (&held.nearest).into()),
                ("drawn_nearest", (&held.nearest).into()),
                ("texels_needed", (&held.needed).into()),
                ("cells", (&held.cells).into()),
                ("drawn_cells", (&held.cells).into()),
                ("boxes", (&held.boxes).into()),
                ("drawn_boxes", (&held.boxes).into()),
            ]);
            let (texels, pixels) = ([resolution.div_ceil(8); 2], f.pixel_groups());
            if layer == 0 {
                self.dispatches.plan(f, bound, &[texels, pixels, THREADS])?;
            }
            f.clear(&held.needed);
            let (pass, size) = if whole { (&self.all, texels) } else { (&self.need, pixels) };
            self.dispatches.run(f.run(pass).bind_all(&all), layer, size);
            for (i, band) in held.bands.iter().enumerate() {
                f.clear(&held.cells);
                f.clear_range(state, RAY_ARGUMENTS, 32);
                for pass in [&self.make, &self.trace, &self.sort, &self.list] {
                    self.dispatches.run(f.run(pass).bind_all(&all).bind("ray_band", band), layer, THREADS);
                }
                f.run(&self.finish).bind_all(&all).bind("ray_band", band).dispatch(1, 1, 1);
                f.run(&self.meet)
                    .bind_all(&all)
                    .uncounted()
                    .draw(&[], Some((&picture, 0.0)), true, |p| p.draw_indirect(arguments, 0));
                f.run(&self.draw)
                    .bind_all(&all)
                    .points()
                    .draw(&[], Some((map, 0.0)), i == 0, |p| p.draw_indirect(state, RAY_ARGUMENTS));
            }
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
    fn new(gpu: &Gpu, size: &Size) -> Held {
        let &Size { triangles, rays, resolution } = size;
        let [texels, cells] = [resolution, cells_side(resolution)].map(|side| side as u64 * side as u64);
        let room = rays.min(MOST_RAYS).min(gpu.most_bound() / RAY);
        let words = texels.div_ceil(32) as u32;
        let band = |number, first, words| {
            let band = Band { number, first, words, padding: 0 };
            gpu.buffer("band of rays", bytemuck::bytes_of(&band), Use::UNIFORM)
        };
        let mut bands = vec![band(0, 0, words)];
        if room < rays {
            let most = (room / 32) as usize;
            let parts = (0..words).step_by(most).enumerate();
            bands.extend(parts.map(|(i, first)| band(i as u32 + 1, first, (words - first).min(most as u32))));
        }
        Held {
            bands,
            rays: storage(gpu, "texels' rays", room * RAY),
            nearest: storage(gpu, "what rays meet", room * 4),
            needed: storage(gpu, "needed texels", words as u64 * 4),
            cells: storage(gpu, "cells", cells * 4),
            boxes: storage(gpu, "triangles' boxes", triangles as u64 * BOX),
        }
    }
}
