//! Casters split where the warp bends their edges (`shaders/map/warp/subdivide.wgsl`), or with their corners moved only.

use super::{Casters, Dispatches, Way, storage};
use crate::frame::Frame;
use crate::gpu::{Buffer, Gpu, Pass, Raster, Resource, hold};
use crate::light::Light;
use crate::map::filter::alone;
use crate::params::Group;
use anyhow::{Result, ensure};
use bytemuck::{Pod, Zeroable};
use wgpu::BufferUsages as Use;

/// How often a triangle is split: each time edges are halved.
const LEVELS: u32 = 14;
/// Bytes of a piece.
const PIECE: u64 = 80;

/// As `Level` in WGSL.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Level {
    number: u32,
    last: u32,
    most: u32,
    most_drawn: u32,
}

pub struct Subdivide {
    linear: bool,
    need: Pass,
    spread: Pass,
    trace: Pass,
    plan: Pass,
    split: Pass,
    finish: Pass,
    draw: Pass,
    dispatches: Dispatches,
    /// For a number of triangles, and texels per side.
    held: Option<([u32; 2], Held)>,
}

struct Held {
    levels: Vec<Buffer>,
    /// The dispatch of a level.
    dispatch: Buffer,
    work: Buffer,
    pieces: Buffer,
    rays: Buffer,
}

impl Subdivide {
    pub fn new(gpu: &Gpu, file: &'static str, groups: &[Group], way: &Way) -> Result<Subdivide> {
        let pass = |name, entry| Pass::compute(gpu, name, &alone(file), entry, groups);
        let linear = way.raster == "linear";
        let raster = Raster {
            vertex: "piece_caster",
            fragment: Some(if linear { "linear_piece" } else { "piece" }),
            depth: Raster::nearest(way.format),
            cull: Raster::culled(&way.cull),
            ..Raster::default()
        };
        Ok(Subdivide {
            linear,
            need: pass("needed texels", "need")?,
            spread: pass("needed texels", "spread")?,
            trace: pass("texels' rays", "trace_rays")?,
            plan: pass("subdivision", "plan_level")?,
            split: pass("subdivision", "split")?,
            finish: pass("subdivision", "finish")?,
            draw: Pass::render(gpu, "shadow map", &alone(file), raster, groups)?,
            dispatches: Dispatches::default(),
            held: None,
        })
    }
}

impl Casters for Subdivide {
    fn draw(
        &mut self,
        f: &mut Frame,
        changed: bool,
        bound: &[(&'static str, Resource)],
        (layer, map): (usize, &wgpu::TextureView),
        [arguments, _]: [&Buffer; 2],
    ) -> Result<()> {
        let resolution = map.texture().width();
        let passes = [&self.need, &self.spread, &self.trace, &self.plan, &self.split, &self.finish, &self.draw];
        // What lies behind a lamp is cut off: of a triangle two parts may be left.
        let parts = f.scene.triangle_count as u64 * if matches!(f.light, Light::Directional { .. }) { 1 } else { 2 };
        ensure!(
            parts * PIECE <= f.gpu.most_bound(),
            "{} binds too little memory at once to split {} triangles; choose raster = exact",
            f.gpu.info.name,
            f.scene.triangle_count
        );
        let held = hold(&mut self.held, [f.scene.triangle_count, resolution], |of| {
            passes.iter().for_each(|p| p.forget());
            Held::new(f.gpu, *of, self.linear)
        })?;
        if !changed {
            return Ok(());
        }
        let mut all = bound.to_vec();
        all.extend([
            ("texel_rays", (&held.rays).into()),
            ("drawn_texel_rays", (&held.rays).into()),
            ("work", (&held.work).into()),
            ("pieces", (&held.pieces).into()),
            ("drawn_pieces", (&held.pieces).into()),
        ]);
        let (pixels, texels) = (f.pixel_groups(), [resolution.div_ceil(64), resolution]);
        let (tiles, threads) = ([64, 1], [f.scene.triangle_count.div_ceil(64).min(256), 1]);
        if layer == 0 {
            self.dispatches.plan(f, bound, &[pixels, texels, tiles, threads])?;
        }
        self.dispatches.run(f.run(&self.need).bind_all(&all), layer, pixels);
        if !self.linear {
            self.dispatches.run(f.run(&self.spread).bind_all(&all), layer, tiles);
            self.dispatches.run(f.run(&self.trace).bind_all(&all), layer, texels);
        }
        for (number, level) in held.levels.iter().enumerate() {
            if number == 0 {
                self.dispatches.run(f.run(&self.split).bind_all(&all).bind("level", level), layer, threads);
                continue;
            }
            let plan = f.run(&self.plan).bind_all(&all).bind("level", level);
            plan.bind("level_dispatch", &held.dispatch).dispatch(1, 1, 1);
            f.run(&self.split).bind_all(&all).bind("level", level).dispatch_indirect(&held.dispatch, 0);
        }
        f.run(&self.finish).bind_all(&all).bind("level", &held.levels[0]).dispatch(1, 1, 1);
        f.run(&self.draw).bind_all(&all).draw(&[], Some((map, 0.0)), true, |p| p.draw_indirect(arguments, 0));
        Ok(())
    }
}

impl Held {
    fn new(gpu: &Gpu, [triangles, resolution]: [u32; 2], linear: bool) -> Result<Held> {
        let binding = gpu.most_bound();
        let rays = if linear { 0 } else { resolution as u64 * resolution as u64 * 8 };
        ensure!(
            rays <= binding,
            "{} binds too little memory at once for the rays of a {resolution}² map; choose raster = exact or a smaller \
             resolution",
            gpu.info.name
        );
        // Room for each triangle twice, and for what a few large ones become.
        let most_drawn = (2 * triangles as u64 + (1 << 18)).min(binding / PIECE) as u32;
        let most = (triangles as u64 + (1 << 17)).min(binding / PIECE / 2) as u32;
        let last = if linear { 0 } else { LEVELS };
        let level = |number| {
            let level = Level { number, last: (number == last) as u32, most, most_drawn };
            gpu.buffer("level", bytemuck::bytes_of(&level), wgpu::BufferUsages::UNIFORM)
        };
        Ok(Held {
            levels: (0..=last).map(level).collect(),
            dispatch: gpu.room("dispatch of a level", 12, Use::STORAGE | Use::INDIRECT | Use::COPY_SRC),
            work: storage(gpu, "pieces to split", if linear { PIECE } else { 2 * most as u64 * PIECE }),
            pieces: storage(gpu, "pieces", most_drawn as u64 * PIECE),
            rays: storage(gpu, "texels' rays", rays),
        })
    }
}
