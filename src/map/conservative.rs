//! Conservative maps of one light view (Hertel, Hormann, Westermann 2009; Morais 2015): casters grown and casters shrunk
//! (`shaders/map/conservative.wgsl`).

use super::faces::{self, around};
use super::single::ShadowMap;
use super::{Layers, MapParams, light_views};
use crate::frame::Frame;
use crate::gpu::{Buffer, Gpu, Pass, Raster, hold};
use crate::light::{Light, LightView};
use crate::map::filter::Reach;
use crate::map::silhouettes::groups;
use crate::params::{Group, Params};
use crate::scene::edges::Bodies;
use anyhow::{Result, ensure};
use glam::{Vec3, Vec4};
use std::time::Instant;
use wgpu::BufferUsages as Use;

crate::params! {
    /// How casters are grown and shrunk.
    pub struct ConservativeParams {
        "Conservative maps" {
            /// What shrunk casters keep. None: each triangle is shrunk for itself. Adjacency: edges stay behind which another triangle casts too. Fan: corners stay as well where casters meet all around.
            mode: choice("adjacency", ["none", "adjacency", "fan"]),
            /// Which triangles cast. Auto: of closed bodies those that are turned away from the light, of others all. Back: those turned away (for scenes of closed bodies only). Both: all. Front: those that face the light.
            casters: choice("auto", ["auto", "back", "both", "front"]),
            /// How far edges are moved. Worst: half a texel's diagonal in every direction. Tight: no farther than a square needs that they touch.
            shift: choice("tight", ["worst", "tight"]),
            /// The same times this. Below 1 answers may be wrong, above it more rays are traced than need be.
            eta: float(1.0, 0.5..=4.0, "× texel"),
            /// Stores the nearest depth that a grown caster has in a texel, and the farthest of a shrunk one. Off: the depth at the texel's middle, so that answers may be wrong.
            safe_depth: flag(true),
            /// How surfaces that are casters themselves are compared, as those of bodies that are not closed. On: with the nearest depth that their own plane has in the texel; what lies between that and the surface is missed. Off: exactly, so that all of these that are lit ask a short ray.
            self_plane: flag(false),
        }
    }
}

/// What of the light the maps hold.
pub struct ConservativeMaps {
    /// How many views there are: one, or those of a cube's faces.
    pub faces: usize,
    /// Of each face; of a single view for each of its layers.
    pub light_views: Buffer,
    /// Of each face in turn grown casters of closed bodies, grown others, shrunk ones.
    pub layers: Layers,
    /// Of each triangle its plane in each face, where it is a caster of the second layer: `own_planes` in WGSL.
    pub own_planes: Buffer,
    /// Of each face [`GATHERED`] bytes. Where the third word is not 0, casters were left out and nothing is certain.
    pub gathered: Buffer,
}

/// Bytes of a caster, of what lies beyond its edges, of a triangle's plane and of what stands beside it.
const CASTER: u64 = 48;
const BEYOND: u64 = 112;
const PLANE: u64 = 16;
/// Of a face, as `Gathered` in WGSL.
const GATHERED: usize = 48;
/// Faces of a cube.
const FACES: usize = 6;
/// Layers of each view: see [`ConservativeMaps::layers`].
pub const LAYERS: usize = 3;

/// Where rays begin and end: an eye, a lamp, and a near plane that is all an eye.
type Begins = ([Vec3; 2], Option<Vec4>);

/// Draws them.
pub struct Conservative {
    map: ShadowMap,
    layers: Option<Layers>,
    light_views: Buffer,
    /// Of a cube's faces each one's view alone, and what they and `light_views` say.
    face_views: Vec<Buffer>,
    written: Vec<LightView>,
    bound_seen: Pass,
    around: Pass,
    /// For a lamp, or not.
    gather: Option<(bool, Pass)>,
    arrange: Pass,
    /// Casters without and with a look at each texel.
    grow: [Pass; 2],
    shrink: [Pass; 2],
    gathered: Buffer,
    draws: Buffer,
    /// For a revision of the scene, and room for so many casters.
    scene: Option<((u64, u64), OfScene)>,
    /// Which bodies count as closed where rays begin there, and how many triangles belong to others.
    closed: Option<(Begins, Vec<bool>, usize)>,
    /// For so many bytes.
    own_planes: Option<(u64, Buffer)>,
    /// For so many triangles, or 0 where none are kept.
    beyond: Option<(u64, [Buffer; 2])>,
    fans: Option<(u64, [Buffer; 3])>,
}

struct OfScene {
    bodies: Bodies,
    neighbours: Buffer,
    casters: Buffer,
}

const FILE: &str = "map/conservative.wgsl";
const REACH: Reach = Reach { texels: 1.0, metres: 0.0, casters: false };
const GROUPS: &[Group] = &[ConservativeParams::GROUP];

impl Conservative {
    pub fn new(gpu: &Gpu) -> Result<Conservative> {
        let compute = |name, entry| Pass::compute(gpu, name, FILE, entry, GROUPS);
        let render = |name, vertex, fragment| {
            let raster = Raster {
                vertex,
                fragment,
                depth: Raster::nearest(wgpu::TextureFormat::Depth32Float),
                ..Raster::default()
            };
            Pass::render(gpu, name, FILE, raster, GROUPS)
        };
        Ok(Conservative {
            map: ShadowMap::new(gpu)?,
            layers: None,
            light_views: light_views(gpu, "views of the layers"),
            face_views: Vec::new(),
            written: Vec::new(),
            bound_seen: compute("bounds of what is seen", "bound_seen")?,
            around: compute("fans", "look_around")?,
            gather: None,
            arrange: compute("casters", "arrange")?,
            grow: [render("grown map", "grow_plain", None)?, render("grown map", "grow", Some("keep_grown"))?],
            shrink: [render("shrunk map", "shrink", None)?, render("shrunk map", "shrink_band", Some("keep_shrunk"))?],
            gathered: gpu.buffer("casters found", &[0; FACES * GATHERED], Use::STORAGE | Use::COPY_DST),
            draws: gpu.buffer("draws of casters", &[0; 80], Use::STORAGE | Use::INDIRECT),
            scene: None,
            closed: None,
            own_planes: None,
            beyond: None,
            fans: None,
        })
    }

    /// The views of the faces around a lamp, a buffer each. `light_views` holds all.
    fn look_around(&mut self, f: &Frame, side: u32) -> Result<Vec<Buffer>> {
        let cube = around(f, side, REACH)?.cube();
        let views: Vec<_> = (0..).zip(cube).map(|(layer, face)| LightView { layer, ..face.view }).collect();
        let buffer = |_| f.gpu.buffer("light view", &[0; size_of::<LightView>()], Use::UNIFORM);
        if self.face_views.is_empty() {
            self.face_views = (0..FACES).map(buffer).collect();
        }
        if self.written != views {
            f.gpu.queue.write_buffer(&self.light_views, 0, bytemuck::cast_slice(&views));
            for (view, to) in views.iter().zip(&self.face_views) {
                f.gpu.queue.write_buffer(to, 0, bytemuck::bytes_of(view));
            }
            self.written = views;
        }
        Ok(self.face_views.clone())
    }

    /// Fits the light's view, or looks around the light, and draws all layers.
    ///
    /// # Errors
    /// A light that neither serves, or more than the adapter can hold.
    pub fn draw(&mut self, f: &mut Frame) -> Result<ConservativeMaps> {
        let p = ConservativeParams::read(f.values);
        let side = MapParams::read(f.values).resolution;
        let views = if faces::LIGHTS.contains(&f.light.kind()) {
            self.look_around(f, side)?
        } else {
            self.written.clear();
            vec![self.map.fit(f, REACH)?]
        };
        let format = wgpu::TextureFormat::Depth32Float;
        let layers = Layers::hold(&mut self.layers, f.gpu, &vec![side; LAYERS * views.len()], format)?;
        let (gpu, revision, triangles) = (f.gpu, f.revision, u64::from(f.scene.triangle_count));
        let lamp = !matches!(f.light, Light::Directional { .. });
        // A triangle may be cut into pieces before a lamp.
        let room = if lamp { triangles + triangles / 2 + 8192 } else { triangles };
        let kept = if p.mode == "none" { 1 } else { room };
        let planes = if p.self_plane { triangles * views.len() as u64 } else { 1 };
        ensure!(
            planes * PLANE <= gpu.most_bound(),
            "the scene has too many triangles for self_plane = on with this light on {}; turn it off",
            gpu.info.name
        );
        ensure!(
            kept * BEYOND <= gpu.most_bound() && room * CASTER <= gpu.most_bound(),
            "the scene has too many triangles for conservative maps on {}; choose mode = none or a scene with fewer",
            gpu.info.name
        );
        let scene = hold(&mut self.scene, (revision, room), |_| {
            let start = Instant::now();
            let bodies = f.geometry.edges().bodies(f.geometry);
            let beside = f.geometry.edges().beside(f.geometry, &bodies.closed);
            self.closed = None;
            let made = OfScene {
                bodies,
                neighbours: gpu.buffer("neighbours", bytemuck::cast_slice(&beside), Use::STORAGE),
                casters: gpu.room("casters", room * CASTER, Use::STORAGE),
            };
            f.note("edges (CPU)", start.elapsed().as_secs_f64() * 1e3);
            Ok(made)
        })?;
        // A ray that begins or ends in a body may cross fronts only: there it counts as open.
        let places = [f.eye.position, if lamp { f.light.position() } else { f.eye.position }];
        // An orthographic camera's rays begin all over its near plane.
        let cut = f.eye.height.map(|_| f.eye.near_plane());
        let places = (places, cut);
        if self.closed.as_ref().is_none_or(|(of, ..)| *of != places) {
            let closed = scene.bodies.without(f.geometry, &places.0, cut);
            if *self.closed.as_ref().map_or(&scene.bodies.closed, |(_, held, _)| held) != closed {
                let beside = f.geometry.edges().beside(f.geometry, &closed);
                gpu.queue.write_buffer(&scene.neighbours, 0, bytemuck::cast_slice(&beside));
            }
            let open = f.geometry.casters().iter().filter(|body| !closed[**body as usize]).count();
            self.closed = Some((places, closed, open));
        }
        let open = self.closed.as_ref().map_or(0, |(.., open)| *open);
        let one_sided = match p.casters.as_str() {
            "back" => Some("face the light"),
            "front" => Some("are turned away from the light"),
            _ => None,
        };
        if let Some(skipped) = one_sided.filter(|_| open > 0) {
            f.tell_note(format!(
                "{open} triangles belong to no closed body, or to one that the eye or the lamp is in: those of them that {skipped} \
                 cast no shadow with casters = {}.",
                p.casters
            ));
        }
        let room_of = |label, bytes| gpu.room(label, kept * bytes, Use::STORAGE);
        let made = |_: &u64| Ok([room_of("beyond casters", BEYOND), room_of("bands of casters", 12)]);
        let [beyond, bands] = hold(&mut self.beyond, kept, made)?.clone();
        let made = |planes: &u64| Ok(gpu.room("planes of casters", planes * PLANE, Use::STORAGE));
        let own_planes = hold(&mut self.own_planes, planes, made)?.clone();
        let fans = if p.mode == "fan" {
            Some(&*hold(&mut self.fans, revision, |_| {
                let start = Instant::now();
                let fans = f.geometry.edges().fans(f.geometry);
                let buffer = |label, words: &[u8]| gpu.buffer(label, words, Use::STORAGE);
                let made = [
                    buffer("fans", bytemuck::cast_slice(&fans.of_vertices)),
                    buffer("triangles of fans", bytemuck::cast_slice(&fans.triangles)),
                    gpu.room("around fans", fans.of_vertices.len() as u64 * 16, Use::STORAGE),
                ];
                f.note("fans (CPU)", start.elapsed().as_secs_f64() * 1e3);
                Ok(made)
            })?)
        } else {
            self.fans = None;
            None
        };
        f.clear(&self.gathered);
        let [w, h] = f.size.map(|side| side.div_ceil(64));
        f.run(&self.bound_seen)
            .of_picture()
            .bind("light_views", &self.light_views)
            .bind("gathered", &self.gathered)
            .dispatch(w, h, 1);
        let gather = hold(&mut self.gather, lamp, |lamp| {
            let constants = [("lamp", *lamp as u32 as f64)];
            Pass::specialised(gpu, "casters", FILE, "gather", GROUPS, &constants)
        })?;
        for (light_view, into) in views.iter().zip(layers.each.chunks(LAYERS)) {
            let fans_around = match fans {
                Some([fans, of, around]) => {
                    let [x, y] = groups((fans.size() / 16) as u32);
                    f.run(&self.around)
                        .bind("light_view", light_view)
                        .bind("fans", fans)
                        .bind("fan_triangles", of)
                        .bind("fans_around", around)
                        .dispatch(x, y, 1);
                    around
                }
                None => &self.gathered,
            };
            let [x, y] = groups(triangles as u32);
            f.run(gather)
                .bind("light_view", light_view)
                .bind("neighbours", &scene.neighbours)
                .bind("casters", &scene.casters)
                .bind("beyond", &beyond)
                .bind("bands", &bands)
                .bind("own_planes", &own_planes)
                .bind("gathered", &self.gathered)
                .bind("fans_around", fans_around)
                .dispatch(x, y, 1);
            f.run(&self.arrange)
                .bind("light_view", light_view)
                .bind("casters", &scene.casters)
                .bind("bands", &bands)
                .bind("gathered", &self.gathered)
                .bind("draws", &self.draws)
                .dispatch(1, 1, 1);
            let draws = &self.draws;
            let viewport = |p: &mut wgpu::RenderPass| p.set_viewport(0.0, 0.0, side as f32, side as f32, 0.0, 1.0);
            for (layer, view) in into[..2].iter().enumerate() {
                for (k, grow) in self.grow.iter().enumerate() {
                    f.run(grow).bind("light_view", light_view).bind("drawn", &scene.casters).draw(
                        &[],
                        Some((view, 0.0)),
                        k == 0,
                        |p| {
                            viewport(p);
                            p.draw_indirect(draws, (2 * k + layer) as u64 * 16);
                        },
                    );
                }
            }
            let [inner, along] = &self.shrink;
            let shrunk = Some((&into[2], 0.0));
            f.run(inner).bind("light_view", light_view).bind("drawn", &scene.casters).draw(&[], shrunk, true, |p| {
                viewport(p);
                p.draw_indirect(draws, 0);
                p.draw_indirect(draws, 16);
            });
            if p.mode != "none" {
                f.run(along)
                    .bind("light_view", light_view)
                    .bind("drawn", &scene.casters)
                    .bind("beyond_drawn", &beyond)
                    .bind("bands_drawn", &bands)
                    .draw(&[], shrunk, false, |p| {
                        viewport(p);
                        p.draw_indirect(draws, 64);
                    });
            }
        }
        if let [light_view] = &views[..] {
            let size = size_of::<LightView>() as u64;
            for layer in 0..LAYERS as u64 {
                f.copy_to(light_view, &self.light_views, layer * size, size);
            }
        }
        Ok(ConservativeMaps {
            faces: views.len(),
            light_views: self.light_views.clone(),
            layers,
            own_planes,
            gathered: self.gathered.clone(),
        })
    }
}
