//! Maps of a light that shines in all directions: faces of a solid or sides of a paraboloid, each a layer or a part of one. Which
//! of them are drawn, and which triangles into each, is decided on the GPU (`shaders/map/faces.wgsl`).

use super::casters::{Casters, DRAW, Drawing, Target, Triangles};
use super::clusters::Clusters;
use super::filter::Reach;
use super::fit::Scope;
use super::fit::faces::{Around, Face};
use super::paraboloid::{CurvedParams, Paraboloid, Side};
use super::peel::{Depths, Held};
use super::{MOST, Maps, light_views, margin};
use crate::frame::Frame;
use crate::gpu::{Buffer, Gpu, Pass, Resource};
use crate::light::{Light, LightView};
use crate::params::Params;
use crate::view::{self, Class, Drawn, Legend, View, map};
use anyhow::{Result, ensure};
use bytemuck::{Pod, Zeroable};
use glam::{DVec3, DVec4, Vec4};
use wgpu::BufferUsages as Use;

crate::params! {
    /// The maps around a light.
    pub struct FaceParams {
        "Map" {
            /// What is drawn. None: every map draws every triangle. Casters: the triangles that may touch it. View: also only maps that the camera's frustum meets, and casters whose shadow may fall into it. Samples: only maps in which some pixel is looked up, found on the GPU.
            culling: choice("samples", ["none", "casters", "view", "samples"]),
            /// Depth at which maps begin. Casters nearer to the light than this are drawn as if at it.
            near: float(0.05, 0.000001..=1000.0, "m", 0.1 of view),
        }
    }
}

/// The views that every technique with faces has.
pub const MAPS: [View; 7] = [
    map(
        "faces",
        "Faces",
        "Each face of the light's map in a colour of its own: which of the maps a pixel looks up. Faint: faces that are not \
         drawn.",
        Drawn::Labels(Legend::Faces),
    ),
    map(
        "shadow-maps",
        "Shadow maps",
        "All maps laid out, a cube unfolded: near the light bright, far dark. Seams in the faces' colours; what lies beyond \
         them is the guard band, darker. Faces that are not drawn are black.",
        Drawn::Labels(Legend::Faces),
    ),
    map(
        "face-load",
        "Load of the faces",
        "Of each face two bars: its share of the pixels that are looked up, strong, and its share of the scene's triangles \
         that are drawn into it, faint.",
        Drawn::Labels(Legend::Chart(
            view::Area::Margins,
            view::Axis { what: "face", span: view::Span::Faces },
            view::Axis { what: "share", span: view::Span::Linear(0.0, 1.0) },
            &[Class::label(8, "strong: share of the pixels; faint: of the triangles")],
        )),
    ),
    view::aliasing(
        "solid-angle",
        "Solid angle per texel",
        "How much of all directions around the light the texel takes, times the number of texels: 1 is an even share.",
        view::ramp("solid angle of a texel × texels / 4π", "", [0.0, 4.0]),
    ),
    view::aliasing(
        "texel-angle",
        "Solid angle across the map",
        "The solid angle of the texels along the middle row of the map that the probed pixel looks up, relative to an even \
         share of all directions.",
        Drawn::Labels(Legend::Chart(
            view::Area::Margins,
            view::Axis { what: "place in the map, from left to right", span: view::Span::Linear(0.0, 1.0) },
            view::Axis { what: "solid angle of a texel × texels / 4π", span: view::Span::Octaves(3) },
            &[Class::label(1, "texels of the row")],
        )),
    ),
    view::aliasing(
        "texels",
        "Texel grid",
        "Each map texel's footprint on the scene, as a chequerboard. Large squares: blocky shadows.",
        Drawn::Cells,
    ),
    map(
        "bias",
        "Bias",
        "How far the comparison is moved away from the light at each pixel, all biases together, in texels of its face.",
        view::ramp("bias", "texels", [0.0, 4.0]),
    ),
];

/// As `Faces` in `shaders/map/faces_of.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct FacesUniform {
    pub count: u32,
    pub triangles: u32,
    pub opaque: u32,
    pub listed: u32,
    pub met: u32,
    pub vertices: u32,
    pub angle: f32,
    pub metres: f32,
    pub axes: [Vec4; MOST],
    pub regions: [Vec4; 2 * MOST],
    pub frustum: [Vec4; 6],
}

/// Largest buffer for the triangles of all faces, bytes; above it every face draws every triangle.
const INDEX_BYTES: u64 = 1 << 30;
/// The draws are timed under this name.
const MAPS_PASS: &str = "shadow maps";
/// Bytes of the draws of all faces: see `draws` in `shaders/map/faces.wgsl`.
pub const DRAWS: usize = MOST * 40 + MOST * 32;
/// Where draws begin that pull their vertices, and the bytes of one.
const PULLED: u64 = MOST as u64 * 40;
const PULLED_DRAW: u64 = 16;

/// Where the draws of a side's opaque and masked triangles begin that pull their vertices.
pub fn pulled(side: usize) -> [u64; 2] {
    [0, 1].map(|masked| PULLED + (2 * side as u64 + masked) * PULLED_DRAW)
}

/// The maps, and what they are drawn and looked up with.
pub struct Faces {
    layers: Held,
    pub uniform: Buffer,
    pub light_views: Buffer,
    samples: Buffer,
    draws: Buffer,
    /// The triangles that each face draws.
    indices: Option<Buffer>,
    /// Of each face its light view, its part of the layer and its number alone, for drawing.
    single: Vec<[Buffer; 3]>,
    mark: Pass,
    begin: Pass,
    cull: Pass,
    clusters: Clusters,
    finish: Pass,
    casters: Casters,
    paraboloid: Paraboloid,
    /// What the buffers on the GPU say.
    written: Option<(FacesUniform, Vec<LightView>)>,
}

/// What the faces around a frame's light share. `side`: texels of a layer's side.
///
/// # Errors
/// A guard band that leaves no texel to the faces.
pub fn around(f: &Frame, side: u32, reach: Reach) -> Result<Around> {
    let light = f.light.position().as_dvec3();
    let [low, high] = f.scene.bounds.map(|b| b.as_dvec3());
    let farthest = (light - low).abs().max((high - light).abs()).length() * 1.001;
    let far = farthest.min(f.light.range() as f64).max(1e-6);
    let near = (FaceParams::read(f.values).near as f64).min(0.5 * far);
    // A filter as wide in metres as it says is wide in texels only near the light: its taps there are looked up in other faces.
    let wide = if reach.metres > 0.0 { side as f64 / 16.0 } else { 0.0 };
    let guard = (margin(f) + reach.texels) as f64 + wide;
    ensure!(
        6.0 * guard < side as f64,
        "the filter reaches {guard:.0} texels beyond each face, too far for maps of {side}² texels; choose a higher resolution or a \
         narrower filter"
    );
    Ok(Around { light, near, far, side: side as f64, guard, metres: reach.metres as f64 })
}

/// Of a cube's faces the one that the camera's target lies in: where only one can be shown, this.
pub fn looked_at(f: &Frame) -> usize {
    let way = f.camera.target - f.light.position();
    let axis = way.abs().max_position();
    2 * axis + (way[axis] < 0.0) as usize
}

/// Bit i: what is looked up from the camera's frustum meets face i (King, Newhall 2005: two frusta are cut with each other).
fn met(scope: &Scope, faces: &[Face], around: &Around) -> u32 {
    let seen = scope.seen_of(scope.cuboid());
    let meets = |i: usize| !faces[i].part_of(&seen, faces, around, (around.metres, scope.eps())).corners().is_empty();
    (0..faces.len()).filter(|i| meets(*i)).map(|i| 1 << i).sum()
}

impl Faces {
    pub fn new(gpu: &Gpu) -> Result<Faces> {
        let zero = |label, size: usize, usage| gpu.buffer(label, &vec![0; size], usage);
        let pass = |name, entry| Pass::compute(gpu, name, "map/faces.wgsl", entry, &[FaceParams::GROUP]);
        let single = |i: u32| {
            let region = size_of::<[Vec4; 2]>();
            [
                zero("light view", size_of::<LightView>(), Use::UNIFORM),
                zero("part of a map", region, Use::UNIFORM),
                gpu.buffer("number of a face", bytemuck::bytes_of(&[i, 0, 0, 0]), Use::UNIFORM),
            ]
        };
        Ok(Faces {
            layers: Held::default(),
            uniform: zero("faces", size_of::<FacesUniform>(), Use::UNIFORM | Use::STORAGE | Use::COPY_SRC),
            light_views: light_views(gpu, "light views"),
            samples: zero("faces' samples", MOST * 4 + 4, Use::STORAGE | Use::COPY_SRC),
            draws: zero("faces' draws", DRAWS, Use::STORAGE | Use::INDIRECT | Use::COPY_SRC),
            indices: None,
            single: (0..MOST as u32).map(single).collect(),
            mark: pass("fit: samples", "mark")?,
            begin: pass("fit: faces", "begin")?,
            cull: pass("caster culling", "cull")?,
            clusters: Clusters::new(gpu)?,
            finish: pass("caster culling", "finish")?,
            casters: Casters::named(["shadow maps", "shadow maps (masked)"]),
            paraboloid: Paraboloid::named(MAPS_PASS),
            written: None,
        })
    }

    /// Writes where the maps look. Before any pass that reads `uniform` or `light_views`, or changes them on the GPU.
    pub fn prepare(&mut self, f: &mut Frame, around: &Around, faces: &[Face]) {
        let triangles = f.scene.triangle_count;
        let bytes = triangles as u64 * 12 * faces.len() as u64;
        let culling = FaceParams::read(f.values).culling;
        // Maps that draw everything need no lists of their own.
        let listed = culling != "none" && bytes <= INDEX_BYTES.min(f.gpu.most_bound());
        if !listed {
            self.indices = None;
        } else if self.indices.as_ref().is_none_or(|b| b.size() != bytes.max(16)) {
            self.indices = Some(f.gpu.room("faces' triangles", bytes, Use::STORAGE | Use::INDEX));
        }
        let scope = Scope::of(f, around.side as u32, 0.0);
        let raster = CurvedParams::read(f.values).raster;
        let mut uniform = FacesUniform {
            count: faces.len() as u32,
            triangles,
            opaque: f.scene.opaque_count,
            listed: listed as u32,
            met: if culling == "view" { met(&scope, faces, around) } else { 0 },
            vertices: Paraboloid::vertices(&raster),
            // Along both sides of the map at once.
            angle: (faces.iter().map(Face::texel_angle).fold(0.0, f64::max) * 2f64.sqrt() * around.guard) as f32,
            metres: around.metres as f32,
            ..FacesUniform::zeroed()
        };
        for (i, face) in faces.iter().enumerate() {
            uniform.axes[i] = face.axis.as_vec3().extend(face.layer as f32);
            uniform.regions[2 * i..2 * i + 2].copy_from_slice(&face.region);
        }
        for (to, plane) in uniform.frustum.iter_mut().zip(scope.eye().planes()) {
            *to = (plane / DVec4::from((plane.truncate(), 0.0)).length().max(1e-30)).as_vec4();
        }
        let views: Vec<LightView> = faces.iter().map(|face| face.view).collect();
        let words = (uniform, views);
        if self.written.as_ref() != Some(&words) {
            f.gpu.queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&words.0));
            f.gpu.queue.write_buffer(&self.light_views, 0, bytemuck::cast_slice(&words.1));
            for (face, [_, region, _]) in faces.iter().zip(&self.single) {
                f.gpu.queue.write_buffer(region, 0, bytemuck::bytes_of(&face.region));
            }
            self.written = Some(words);
        }
    }

    /// Of each face its light view alone, for drawing.
    pub fn single_views(&self) -> Vec<Buffer> {
        self.single.iter().map(|[view, _, _]| view.clone()).collect()
    }

    /// Which faces are drawn, as `draws` in `shaders/map/faces.wgsl`.
    pub fn draws(&self) -> &Buffer {
        &self.draws
    }

    /// What was prepared is changed on the GPU, and must be written anew.
    pub fn rewritten(&mut self) {
        self.written = None;
    }

    /// Draws the casters' depth into the faces that [`Faces::prepare`] was told of.
    ///
    /// # Errors
    /// Maps that the adapter cannot hold.
    pub fn draw(&mut self, f: &mut Frame, around: &Around, faces: &[Face]) -> Result<Maps> {
        let layers = faces.iter().map(|face| face.layer as usize + 1).max().unwrap_or(1);
        let sides = vec![around.side as u32; layers];
        let depths = Depths::hold(&mut self.layers, f, &sides)?;
        let scene = f.scene;
        f.clear(&self.samples);
        let [w, h] = f.size.map(|side| side.div_ceil(64));
        f.run(&self.mark).bind("faces", &self.uniform).bind("samples", &self.samples).dispatch(w, h, 1);
        let bound: [(&'static str, Resource); 4] = [
            ("faces", (&self.uniform).into()),
            ("light_views", (&self.light_views).into()),
            ("samples", (&self.samples).into()),
            ("draws", (&self.draws).into()),
        ];
        f.run(&self.begin).bind_all(&bound).dispatch(1, 1, 1);
        let indices = self.indices.as_ref().unwrap_or(&scene.indices);
        if self.indices.is_some() {
            let listed = self.clusters.list(f, &bound);
            f.run(&self.cull)
                .bind_all(&bound)
                .bind("corners_of", &scene.indices)
                .bind("listed_clusters", &listed)
                .bind("indices", indices)
                .dispatch_indirect(&listed, 0);
        }
        let curved = faces.iter().any(|face| face.view.perspective == LightView::PARABOLOID);
        let raster = CurvedParams::read(f.values).raster;
        let drawn_apart = curved && raster != "linear";
        if drawn_apart {
            f.run(&self.finish).bind_all(&bound).dispatch(1, 1, 1);
        } else {
            self.paraboloid = Paraboloid::named(MAPS_PASS);
        }
        let size = size_of::<LightView>() as u64;
        let mut begun = vec![false; layers];
        for (i, face) in faces.iter().enumerate() {
            let [view, region, number] = &self.single[i];
            f.copy(&self.light_views, i as u64 * size, view, size);
            let layer = face.layer as usize;
            let first = !std::mem::replace(&mut begun[layer], true);
            if drawn_apart {
                let side = Side {
                    raster: &raster,
                    light_view: view,
                    indices,
                    draws: &self.draws,
                    at: pulled(i),
                    number: Some(number),
                };
                self.paraboloid.draw(f, (&depths, layer), side)?;
                continue;
            }
            let part = face.region[0] != Vec4::ZERO;
            let drawing = match part {
                _ if curved => Drawing::Moved,
                true => Drawing::Part,
                false => Drawing::Straight,
            };
            let to = Target { side: sides[layer], light_view: view, drawing, region: part.then_some(region), first };
            let triangles = Triangles::Listed { indices, draws: &self.draws, at: 2 * i as u64 * DRAW };
            self.casters.draw_depths(f, (&depths, layer), to, &triangles)?;
        }
        let bound: Vec<(&'static str, Resource)> = vec![
            ("faces", (&self.uniform).into()),
            ("face_samples", (&self.samples).into()),
            ("face_draws", (&self.draws).into()),
        ];
        f.keep_table("faces", &self.uniform);
        let outlined = ("light_views", (&self.light_views).into());
        f.outline_faces(faces.len() as u32, bound.iter().cloned().chain([outlined]).collect());
        f.tell_faces([&self.samples, &self.draws], faces.len() as u32);
        Ok(Maps { layers: depths.looked_up(), light_views: self.light_views.clone(), sides, bound })
    }
}

/// The kinds of light that maps in all directions serve.
pub const LIGHTS: &[&str] = &["omni", "hemisphere"];

/// Two axes at right angles to a unit vector and to each other: the first and second column of a frame whose third it is.
pub fn frame_of(axis: DVec3) -> glam::DMat3 {
    let other = if axis.y.abs() > 0.99 { DVec3::NEG_Z } else { DVec3::Y };
    let x = other.cross(axis).normalize();
    glam::DMat3::from_cols(x, axis.cross(x), axis)
}

/// A hemisphere light's axis; an omni light has none of its own.
pub fn own_axis(light: &Light) -> Option<DVec3> {
    matches!(light, Light::Hemisphere { .. }).then(|| light.axis().as_dvec3())
}
