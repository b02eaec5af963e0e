//! Drawing casters into a paraboloid's sides, where straight edges become arcs (`shaders/map/paraboloid.wgsl`). Those of which only
//! corners are moved are drawn as into any other map ([`Drawing::Moved`](super::casters::Drawing::Moved)).

use super::CasterParams;
use super::peel::{Depths, StoredParams};
use crate::frame::Frame;
use crate::gpu::{Buffer, Gpu, Pass, Raster, Resource, hold};
use crate::params::Params;
use anyhow::Result;
use wgpu::BufferUsages as Use;

crate::params! {
    /// How casters are drawn into a curved map.
    pub struct CurvedParams {
        "Raster" {
            /// How casters are drawn. Linear: corners are moved and edges stay straight, so that large triangles bend and miss their place. Subdivide: triangles are split where an edge would deviate by more than the tolerance. Exact: each texel's ray meets the triangles themselves.
            raster: choice("exact", ["linear", "subdivide", "exact"]),
            /// How far an edge may deviate from its image before its triangle is split, into as many parts as that takes, 64 of each edge at most.
            tolerance: float(0.5, 0.05..=16.0, "texels") if raster = "subdivide",
        }
    }
}

/// What the passes depend on: the raster, the layers' format, and whether two surfaces are looked at.
type State = (String, wgpu::TextureFormat, bool);

/// The passes that draw into a side, its triangles split or met exactly.
pub struct Paraboloid {
    name: &'static str,
    passes: Option<(State, Passes)>,
    /// Pieces of a side's split triangles, for a number of triangles; and the draw of them.
    pieces: Option<(u32, [Buffer; 2])>,
}

struct Passes {
    nearest: Pass,
    /// Texels with a single surface, and the second surfaces.
    peel: Option<[Pass; 2]>,
    split: Option<[Pass; 2]>,
}

/// Pieces that memory is held for beside one for each triangle, and their bytes.
const SPARE_PIECES: u64 = 1 << 22;
const PIECE: u64 = 8;

/// What a side is drawn from, all on the GPU.
#[derive(Clone, Copy)]
pub struct Side<'a> {
    /// As [`CurvedParams::raster`].
    pub raster: &'a str,
    pub light_view: &'a Buffer,
    /// Corners of the listed triangles.
    pub indices: &'a Buffer,
    /// See `draws` in `shaders/map/faces.wgsl`.
    pub draws: &'a Buffer,
    /// Where the draws of opaque and masked triangles begin, bytes.
    pub at: [u64; 2],
    /// The side's number, a word, by which `subdivide` finds its draws; nothing else needs it.
    pub number: Option<&'a Buffer>,
}

impl Paraboloid {
    /// The draws of the nearest surfaces are timed under this name.
    pub fn named(name: &'static str) -> Paraboloid {
        Paraboloid { name, passes: None, pieces: None }
    }

    /// Vertices that a triangle is drawn with, of those that are not drawn like any other map's.
    pub fn vertices(raster: &str) -> u32 {
        match raster {
            "linear" => 0,
            "exact" => 6,
            _ => 3,
        }
    }

    /// Draws the layer number `i`.
    ///
    /// # Errors
    /// Passes that cannot be made.
    pub fn draw(&mut self, f: &mut Frame, (depths, i): (&Depths, usize), side: Side) -> Result<()> {
        let state = (side.raster.to_string(), depths.nearest.texture.format(), depths.peeled.is_some());
        let passes = hold(&mut self.passes, state, |state| Passes::new(f.gpu, state))?;
        let scene = f.scene;
        let mut bound: Vec<(&'static str, Resource)> =
            vec![("light_view", side.light_view.into()), ("listed", side.indices.into())];
        let (mut arguments, mut at) = (side.draws, side.at.to_vec());
        match &passes.split {
            None => self.pieces = None,
            Some([split, finish]) => {
                let [pieces, draw] = hold(&mut self.pieces, scene.triangle_count, |triangles| {
                    let bytes = ((*triangles as u64 + SPARE_PIECES) * PIECE).min(f.gpu.most_bound());
                    Ok([
                        f.gpu.room("pieces of triangles", bytes, Use::STORAGE),
                        f.gpu.room("draw of the pieces", 32, Use::STORAGE | Use::INDIRECT | Use::COPY_DST),
                    ])
                })?;
                let mut own =
                    vec![("pieces", (&*pieces).into()), ("piece_draw", (&*draw).into()), ("draws", side.draws.into())];
                own.extend(side.number.map(|number| ("side", number.into())));
                f.clear(draw);
                f.run(split).bind_all(&bound).bind_all(&own).dispatch(256, 1, 1);
                f.run(finish).bind_all(&own).dispatch(1, 1, 1);
                bound.push(("drawn_pieces", (&*pieces).into()));
                (arguments, at) = (draw, vec![0]);
            }
        }
        let texels = depths.nearest.texture.width() as f32;
        let issue = |p: &mut wgpu::RenderPass| {
            p.set_viewport(0.0, 0.0, texels, texels, 0.0, 1.0);
            at.iter().for_each(|at| p.draw_indirect(arguments, *at));
        };
        let nearest = &depths.nearest.each[i];
        f.run(&passes.nearest).named(self.name).bind_all(&bound).draw(&[], Some((nearest, 0.0)), true, issue);
        if let (Some([alone, second]), Some(peeled)) = (&passes.peel, &depths.peeled) {
            bound.push(("nearest_depth", nearest.into()));
            let depth = Some((&peeled.each[i], 0.0));
            f.run(alone).bind_all(&bound).uncounted().draw(&[], depth, true, |p| {
                p.set_viewport(0.0, 0.0, texels, texels, 0.0, 1.0);
                p.draw(0..3, 0..1);
            });
            f.run(second).bind_all(&bound).for_layer(nearest).draw(&[], depth, false, issue);
        }
        Ok(())
    }
}

impl Passes {
    fn new(gpu: &Gpu, (raster, format, peeled): &State) -> Result<Passes> {
        const FILE: &str = "map/paraboloid.wgsl";
        let groups = [CasterParams::GROUP, StoredParams::GROUP, CurvedParams::GROUP];
        let pass = |name, vertex, fragment| {
            let depth = Raster::nearest(*format);
            let raster = Raster { vertex, fragment: Some(fragment), depth, ..Raster::default() };
            Pass::render(gpu, name, FILE, raster, &groups)
        };
        let (vertex, first, second) = match raster.as_str() {
            "exact" => ("boxed_facet", "met_facet", "peel_met_facet"),
            _ => ("piece_of_facet", "plane_facet", "peel_plane_facet"),
        };
        let compute = |entry| Pass::compute(gpu, "triangles split", FILE, entry, &groups);
        Ok(Passes {
            nearest: pass("shadow maps", vertex, first)?,
            peel: match peeled {
                false => None,
                true => Some([
                    pass("single surfaces", "whole_layer", "single_surface")?,
                    pass("second surfaces", vertex, second)?,
                ]),
            },
            split: match raster.as_str() {
                "subdivide" => Some([compute("split_facets")?, compute("finish_pieces")?]),
                _ => None,
            },
        })
    }
}
