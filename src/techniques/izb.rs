//! The irregular z-buffer (Aila, Laine 2004; Johnson, Lee, Burns, Mark 2005) and frustum-traced shadows (Wyman, Hoetzlein,
//! Lefohn 2015).

use super::{Info, Technique};
use crate::frame::Frame;
use crate::gpu::{Buffer, Gpu, Need, Pass, Raster, Resource, Slot, hold};
use crate::light::{Light, LightView};
use crate::map::fit::Scope;
use crate::map::fit::faces::Around;
use crate::map::silhouettes::groups;
use crate::map::{light_views, whole};
use crate::params::{Params, Values};
use crate::truth;
use crate::view::{self, map};
use anyhow::{Result, ensure};
use bytemuck::{Pod, Zeroable};
use wgpu::BufferUsages as Use;

crate::params! {
    /// The lists, and what is kept in them.
    pub struct IzbParams {
        "Lists" {
            /// Cells along each side of the light's image (of each of six around a lamp). Too few: lists are long. Too many: triangles touch many cells, most of them empty. The result is the same.
            list_resolution: int(512, 128..=2048, "cells"),
            /// Samples of each pixel: one at its centre, or 32 spread over the part of the receiver's plane that the pixel covers.
            samples: choice("1", ["1", "32"]),
            /// The most entries that a list may have. What does not fit in is answered by rays.
            longest: int(4096, 16..=12000, "entries"),
        }
    }
}

pub static INFO: Info = Info {
    id: "izb",
    title: "Irregular z-buffer",
    paper: "Aila, Laine 2004; Johnson et al. 2005; Wyman et al. 2015",
    family: "Hybrid",
    mark: 37,
    doc: "The light's image keeps the pixels themselves in place of depth: each of its cells has a list of those that lie in it, and \
          each triangle is tested against the lists that it touches. Exact, without a tree; slow where many pixels share a \
          cell.",
    lights: &["directional", "spot", "omni", "hemisphere"],
    filter: None,
    smooth: averages,
    params: &[IzbParams::GROUP],
    main: &[("list_resolution", "128..2048*2"), ("samples", "1,32")],
    maps: &[&[
        map(
            "list-length",
            "List length",
            "How many entries the list has that each pixel stands in.",
            view::counts("entries in the list", 300.0),
        ),
        map(
            "lists",
            "Lists",
            "The light's image with the length of the list in each cell; around a lamp the six faces of a cube.",
            view::counts("entries in the list", 300.0),
        ),
        map(
            "tests",
            "Triangles tested",
            "How many triangles are brought to the list that each pixel stands in. One that is in shadow already meets no \
             more of them.",
            view::counts("triangles", 1000.0),
        ),
    ]],
    needs: |_| &[Need::StorageBuffers(6)],
    make: |gpu, _| Ok(Box::new(Izb::new(gpu)?)),
};

/// Whether it takes more than one sample of a pixel: it aims at the mean over it then.
pub fn averages(values: &Values) -> bool {
    IzbParams::read(values).samples != "1"
}

const FILE: &str = "techniques/izb.wgsl";
/// Cells along each side of a tile, `tile` in WGSL.
const TILE: u32 = 8;
/// The format of the picture that large triangles are drawn into, a pixel a tile; nothing is written there.
const TILES: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;
/// Bytes of an entry of a list, of a pixel's verdicts, of a triangle's box, and of the passes' state.
const ENTRY: u64 = 12;
const VERDICTS: u64 = 8;
const BOX: u64 = 16;
const STATE: u64 = 104;
/// Entries of a pixel that there is room for, where it may have several.
const ENTRIES: u64 = 4;

/// As `Plan` in WGSL.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
struct Plan {
    triangles: u32,
    images: u32,
    side: u32,
    padding: u32,
    places: [[f32; 2]; 32],
}

struct Izb {
    bound: Pass,
    list: Pass,
    bring: Pass,
    finish: Pass,
    draw: Pass,
    resolve: Pass,
    inspect: Pass,
    light_views: Buffer,
    plan: Buffer,
    state: Buffer,
    arguments: Buffer,
    picture: Slot,
    /// What `light_views` and `plan` say.
    written: Option<(Vec<LightView>, Plan)>,
    held: Option<(Size, Held)>,
}

#[derive(PartialEq)]
struct Size {
    pixels: u64,
    entries: u64,
    /// Bytes of the lists.
    lists: u64,
    boxes: u64,
}

struct Held {
    cells: Buffer,
    entries: Buffer,
    verdicts: Buffer,
    boxes: Buffer,
}

impl Izb {
    fn new(gpu: &Gpu) -> Result<Izb> {
        let pass = |name, entry| Pass::compute(gpu, name, FILE, entry, INFO.params);
        let untouched = wgpu::DepthStencilState {
            format: TILES,
            depth_write_enabled: Some(false),
            depth_compare: Some(wgpu::CompareFunction::Always),
            stencil: Default::default(),
            bias: Default::default(),
        };
        let boxes =
            Raster { vertex: "box_caster", fragment: Some("bring_box"), depth: Some(untouched), ..Raster::default() };
        Ok(Izb {
            bound: pass("samples' box", "bound")?,
            list: pass("lists", "list")?,
            bring: pass("lists meet triangles", "bring_triangles")?,
            finish: pass("lists meet triangles", "finish")?,
            draw: Pass::render(gpu, "lists meet large triangles", FILE, boxes, INFO.params)?,
            resolve: pass("resolve", "resolve")?,
            inspect: pass("inspect", "inspect")?,
            light_views: light_views(gpu, "light views of the lists"),
            plan: gpu.buffer("plan of the lists", bytemuck::bytes_of(&Plan::zeroed()), Use::UNIFORM),
            state: gpu.room("state of the lists", STATE, Use::STORAGE | Use::COPY_DST),
            arguments: gpu.room("draw of large triangles", 16, Use::STORAGE | Use::INDIRECT | Use::COPY_DST),
            picture: Slot::default(),
            written: None,
            held: None,
        })
    }
}

/// The images that the samples are listed in: of the whole scene; the lists cover the box that samples lie in.
fn images(f: &Frame, resolution: u32) -> Result<Vec<LightView>> {
    if matches!(f.light, Light::Directional { .. } | Light::Spot { .. }) {
        return Ok(vec![whole(&Scope::of(f, resolution, 0.0))?]);
    }
    // Depths mean nothing here.
    let light = f.light.position().as_dvec3();
    let around = Around { light, near: 0.01, far: 1.0, side: resolution as f64, guard: 0.0, metres: 0.0 };
    Ok(around.cube().into_iter().map(|face| face.view).collect())
}

/// Bytes of so many images' lists with so many cells along each side.
fn list_bytes(images: u32, side: u32) -> u64 {
    let [cells, tiles] = [side, side.div_ceil(TILE)].map(|n| images as u64 * n as u64 * n as u64);
    12 * (cells + tiles)
}

/// Cells along each side: as many as are asked for, or as there is room for.
fn side(room: u64, images: u32, asked: u32) -> u32 {
    let fits = |side: &u32| list_bytes(images, *side) <= room;
    Some(asked).filter(fits).unwrap_or_else(|| (1..=asked / TILE).rev().map(|n| n * TILE).find(fits).unwrap_or(TILE))
}

impl Technique for Izb {
    fn render(&mut self, f: &mut Frame) -> Result<()> {
        let p = IzbParams::read(f.values);
        let views = images(f, p.list_resolution)?;
        let plan = Plan {
            triangles: f.geometry.bvh.order.len() as u32,
            images: views.len() as u32,
            side: side(f.gpu.most_bound(), views.len() as u32, p.list_resolution),
            padding: 0,
            places: std::array::from_fn(|k| truth::offset(k as u32, 32).into()),
        };
        let words = (views, plan);
        if self.written.as_ref() != Some(&words) {
            f.gpu.queue.write_buffer(&self.light_views, 0, bytemuck::cast_slice(&words.0));
            f.gpu.queue.write_buffer(&self.plan, 0, bytemuck::bytes_of(&words.1));
            self.written = Some(words);
        }
        let pixels = f.size[0] as u64 * f.size[1] as u64;
        let most = f.gpu.most_bound();
        ensure!(
            pixels * ENTRY <= most,
            "lists of {} × {} pixels take {} MiB, and {} binds {}; draw a smaller picture",
            f.size[0],
            f.size[1],
            (pixels * ENTRY).div_ceil(1 << 20),
            f.gpu.info.name,
            most >> 20
        );
        let bytes = list_bytes(plan.images, plan.side);
        if plan.side < p.list_resolution {
            f.tell_note(format!(
                "There is room for lists of {0} × {0} cells in each of six images, no more.",
                plan.side
            ));
        }
        let entries = if averages(f.values) { (ENTRIES * pixels).min(most / ENTRY) } else { pixels };
        // What finds no room is gone through where it stands.
        let boxes = (plan.images as u64 * plan.triangles as u64).min(most / BOX);
        let passes = [&self.bound, &self.list, &self.bring, &self.finish, &self.draw, &self.resolve, &self.inspect];
        let held = hold(&mut self.held, Size { pixels, entries, lists: bytes, boxes }, |size| {
            passes.iter().for_each(|p| p.forget());
            let room = |label, bytes| f.gpu.room(label, bytes, Use::STORAGE | Use::COPY_SRC | Use::COPY_DST);
            Ok(Held {
                cells: room("lists", size.lists),
                entries: room("entries of lists", ENTRY * size.entries),
                verdicts: room("verdicts", VERDICTS * size.pixels),
                boxes: room("boxes of large triangles", BOX * size.boxes),
            })
        })?;
        let picture = self.picture.get(
            f.gpu,
            "tiles",
            [plan.side.div_ceil(TILE); 2],
            TILES,
            wgpu::TextureUsages::RENDER_ATTACHMENT,
        );
        let all: Vec<(&'static str, Resource)> = vec![
            ("plan", (&self.plan).into()),
            ("light_views", (&self.light_views).into()),
            ("state", (&self.state).into()),
            ("arguments", (&self.arguments).into()),
            ("cells", (&held.cells).into()),
            ("entries", (&held.entries).into()),
            ("verdicts", (&held.verdicts).into()),
            ("boxes", (&held.boxes).into()),
            ("drawn_boxes", (&held.boxes).into()),
        ];
        for cleared in [&self.state, &self.arguments, &held.cells, &held.verdicts] {
            f.clear(cleared);
        }
        let [w, h] = f.size.map(|side| side.div_ceil(64));
        f.run(&self.bound).bind_all(&all).of_picture().dispatch(w, h, 1);
        f.run(&self.list).bind_all(&all).of_picture().per_pixel();
        let [x, y] = groups(plan.triangles);
        f.run(&self.bring).bind_all(&all).of_picture().dispatch(x, y, 1);
        f.run(&self.finish).bind_all(&all).of_picture().dispatch(1, 1, 1);
        f.run(&self.draw)
            .bind_all(&all)
            .of_picture()
            .uncounted()
            .draw(&[], Some((&picture, 0.0)), true, |p| p.draw_indirect(&self.arguments, 0));
        f.run(&self.resolve).bind_all(&all).per_pixel();
        if f.wants_any_map() {
            f.run(&self.inspect).bind_all(&all).per_pixel();
        }
        Ok(())
    }
}
