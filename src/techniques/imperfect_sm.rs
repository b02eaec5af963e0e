//! Instant radiosity (Keller 1997) with imperfect shadow maps (Ritschel et al. 2008).

use super::rt_hard::RAY_COST;
use super::shadow_map::GROUPS;
use super::{Info, MAPS, NEAREST, Technique};
use crate::frame::{Frame, Indirect, SAMPLED, STORED};
use crate::gpu::{self, Buffer, Gpu, Need, Pass, Resource, Slot, Texture, hold};
use crate::light::Light;
use crate::map::faces::FaceParams;
use crate::map::filter::{Reach, alone};
use crate::map::plain::PlainMaps;
use crate::params::{Params, Values};
use crate::scene::Camera;
use crate::scene::geometry::Geometry;
use crate::view::{self, Class, Drawn, Legend};
use anyhow::{Result, ensure};
use glam::{DVec2, DVec3};
use wgpu::{BufferUsages as Use, TextureFormat as Format};

crate::params! {
    /// The light that surfaces throw back, and how its lights see the scene.
    pub struct ImperfectSmParams {
        "Light shown" {
            /// What the shaded picture holds. Direct: the light as a plain shadow map has it. Indirect: only what surfaces throw back of it, once. Both: their sum.
            shown: choice("both", ["direct", "indirect", "both"]),
            /// How much of the constant ambient light is added to both. It stands for the sky and for all that is thrown back: 1 counts the first bounce twice, 0 leaves the sky out.
            ambient: float(0.5, 0.0..=1.0, "×") if shown = "both",
        }
        "Bounce lights" {
            /// How many points stand for the surfaces that throw light back (virtual point lights, VPLs). Few: banding, as each casts a shadow of its own.
            vpls: int(256, 1..=1024, "lights"),
            /// Where they are put, and which of the scene's points their maps are made of. Light: as many lights as light arrives, and points in proportion to area. View: lights where they light what the camera sees, and the more points the nearer they are to it; both then move with the camera.
            placing: choice("view", ["light", "view"]),
            /// Rays from the light for each of them, among whose hits they are chosen.
            candidates: int(16, 1..=64, "× lights"),
            /// How much of its patch a point is spread over, where it lights what is close. 0: not at all, bright blots in corners. 1: no surface gets more than the patch could give it. More: corners turn dark.
            clamp: float(1.0, 0.0..=16.0, "× patch"),
        }
        "Imperfect maps" {
            /// What tells whether a surface sees a bounce light. Imperfect: a small map of its own, made of points. Traced: a ray, exact and slow. None: it always does.
            vpl_shadows: choice("imperfect", ["imperfect", "traced", "none"]),
            /// Points of the scene in each map. Few: holes, through which light leaks.
            points: int(8192, 256..=32768, "points") if vpl_shadows = "imperfect",
            /// Side of each map.
            tile: int(64, 64..=256, "texels", 64) if vpl_shadows = "imperfect",
            /// How often a map is halved to fill holes: holes up to two to the power of this are closed. 0: none is.
            levels: int(3, 0..=6, "levels") if vpl_shadows = "imperfect",
            /// By what share distances may differ, beyond what the surface's slope explains, and still be taken for one surface. What lies farther behind is an outlier, seen between the points of the surface before it.
            tolerance: float(0.1, 0.0..=1.0, "") if vpl_shadows = "imperfect" and levels > 0,
            /// By what share of its distance a surface may be farther than its map says and still see a bounce light. Too little: acne. Too much: light leaks behind what is close.
            vpl_bias: float(0.02, 0.0..=1.0, "") if vpl_shadows = "imperfect",
        }
    }
}

/// How tiles are drawn.
const TILES: &[Class] =
    &[Class::label(8, "near; the darker the farther from the bounce light"), Class::label(0, "hole")];

pub static INFO: Info = Info {
    id: "imperfect-sm",
    title: "Imperfect shadow maps",
    paper: "Keller 1997; Ritschel et al. 2008",
    family: "Indirect light",
    mark: 29,
    doc: "Light that surfaces throw back once: hundreds of points stand for the lit surfaces (instant radiosity), and each \
          has a tiny shadow map of scattered points whose holes are filled. Direct light is a plain shadow map's. Small \
          things leave no indirect shadow, and where they touch the floor light leaks.",
    lights: &["directional", "spot", "omni", "hemisphere"],
    filter: Some(NEAREST),
    smooth: |_| false,
    params: crate::groups!(&[ImperfectSmParams::GROUP], GROUPS, &[FaceParams::GROUP]),
    main: &[("resolution", "256..8192*2")],
    maps: &[
        MAPS,
        &[
            view::map(
                "indirect",
                "Indirect light",
                "Irradiance by light that surfaces throw back once, before the surface's own colour.",
                view::ramp("irradiance, share of white", "", [0.0, 0.2]),
            ),
            view::map(
                "vpl-visibility",
                "Indirect visibility",
                "The share of that light which arrives: 1 where nothing is in its way.",
                view::ramp("visibility of the bounce lights", "", [0.0, 1.0]),
            ),
            view::map(
                "vpls",
                "Bounce lights",
                "The points that stand for lit surfaces.",
                Drawn::Labels(Legend::Classes(&[Class::label(1, "in sight"), Class::label(4, "behind a surface")])),
            ),
            view::map(
                "tiles-before",
                "Maps as splatted",
                "The maps of all bounce lights, each the half space before it: scene points, and holes between them.",
                Drawn::Labels(Legend::Classes(TILES)),
            ),
            view::map(
                "tiles",
                "Maps with holes filled",
                "The same maps after pull and push.",
                Drawn::Labels(Legend::Classes(TILES)),
            ),
            view::map(
                "tile",
                "Map of one bounce light",
                "The map of the bounce light that gives the probed pixel most, before and after its holes are filled.",
                Drawn::Labels(Legend::Squares(["as splatted", "holes filled"], TILES)),
            ),
        ],
    ],
    needs: |_| &[Need::UniformBytes(VPL * MOST_VPLS)],
    make: |gpu, _| Ok(Box::new(ImperfectSm::new(gpu)?)),
};

const FILE: &str = "techniques/imperfect_sm.wgsl";
const AROUND: &str = "techniques/imperfect_sm/around.wgsl";
/// Views that show tiles, whatever asks for visibility.
const TILE_VIEWS: [&str; 3] = ["tiles-before", "tiles", "tile"];
const OWN_VIEWS: [&str; 6] = ["indirect", "vpl-visibility", "vpls", "tiles-before", "tiles", "tile"];

/// Points of the scene to choose from, a power of two, in rows of 512.
const POOL: u32 = 1 << 17;
/// Bytes of `Vpl` in WGSL, and how many `Vpls` holds.
const VPL: u64 = 48;
const MOST_VPLS: u64 = 1024;

struct ImperfectSm {
    direct: PlainMaps,
    shoot: Pass,
    choose: Pass,
    place_points: Pass,
    splat: Pass,
    unpack: Pass,
    pull: Pass,
    push: Pass,
    /// By what tells visibility.
    gather: Option<(u32, Pass)>,
    /// For a number.
    candidates: Option<(u64, Buffer)>,
    vpls: Buffer,
    /// The scene's points, for its revision and the camera that they are spread for.
    points: Option<((u64, Option<Camera>), Points)>,
    /// For vpls, tile and levels.
    tiles: Option<([u32; 3], Tiles)>,
    indirect: Slot,
    /// Bound in place of tiles where there are none.
    no_tiles: Slot,
    /// What the bounce lights, the tiles and the gathered light were made for.
    lights_of: Option<LightsOf>,
    tiles_of: Option<(LightsOf, Values)>,
    gathered_of: Option<(LightsOf, Values, Camera, [u32; 2])>,
}

/// What bounce lights depend on.
#[derive(Clone, PartialEq)]
struct LightsOf {
    light: Light,
    revision: u64,
    seed: u32,
    values: Values,
    /// Camera and size of the picture that they are placed for.
    seen: Option<(Camera, [u32; 2])>,
}

struct Points {
    view: wgpu::TextureView,
    _texture: Texture,
}

/// The maps of all bounce lights.
struct Tiles {
    splats: Buffer,
    /// Texels along the sides of all tiles together.
    size: [u32; 2],
    /// Each half as wide as the one before.
    levels: Vec<wgpu::TextureView>,
    _texture: Texture,
}

/// Tiles in a row, as `tile_columns` in WGSL.
fn columns(vpls: u32) -> u32 {
    (vpls as f32).sqrt().ceil() as u32
}

impl Tiles {
    /// # Errors
    /// More than the adapter holds.
    fn new(gpu: &Gpu, [vpls, tile, levels]: [u32; 3]) -> Result<Tiles> {
        let bytes = vpls as u64 * tile as u64 * tile as u64 * 4;
        let size = [columns(vpls) * tile, vpls.div_ceil(columns(vpls)) * tile];
        ensure!(
            bytes <= gpu.most_bound() && size[0] <= gpu.device.limits().max_texture_dimension_2d,
            "{vpls} maps of {tile}² texels take {} MiB at once, and {} allows {}; choose fewer bounce lights (vpls) or \
             smaller maps (tile)",
            bytes >> 20,
            gpu.info.name,
            gpu.most_bound() >> 20
        );
        let usage = wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::TEXTURE_BINDING;
        let [w, h] = size;
        let texture = gpu::texture(gpu, "imperfect maps", [w, h, 1], levels + 1, Format::R32Float, usage);
        let level =
            |i| wgpu::TextureViewDescriptor { base_mip_level: i, mip_level_count: Some(1), ..Default::default() };
        Ok(Tiles {
            splats: gpu.room("splatted points", bytes, Use::STORAGE | Use::COPY_DST),
            size,
            levels: (0..=levels).map(|i| texture.create_view(&level(i))).collect(),
            _texture: texture,
        })
    }
}

/// A number for each of a stream, alike on every machine (PCG: O'Neill 2014).
fn hash(x: u32) -> u32 {
    let state = x.wrapping_mul(747796405).wrapping_add(2891336453);
    let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277803737);
    (word >> 22) ^ word
}

/// A triangle or a part of one, over which points are spread evenly.
struct Part {
    triangle: u32,
    /// Its corners as weights of the triangle's second and third one.
    corners: [DVec2; 3],
    /// Of this and all parts before, how many points they get, up to a factor.
    sum: f64,
}

/// The scene's triangles, each to get points in proportion to its area; with `near` also to one over the squared distance from a
/// camera, as far as that is greater than the distance of what it looks at. Triangles that are large beside their distance are
/// split for that.
fn parts(geometry: &Geometry, near: Option<Camera>) -> Vec<Part> {
    let mut all = Vec::with_capacity(geometry.triangles.len());
    let mut sum = 0.0;
    let (eye, reach) = near.map_or((DVec3::ZERO, 0.0), |c| (c.position.as_dvec3(), f64::from(c.reach())));
    let mut open = Vec::new();
    for i in 0..geometry.triangles.len() {
        let [a, b, c] = geometry.corners(i).map(|p| p.as_dvec3());
        open.push(([DVec2::ZERO, DVec2::X, DVec2::Y], 0));
        while let Some((corners, depth)) = open.pop() {
            let at = corners.map(|w| a + (b - a) * w.x + (c - a) * w.y);
            let sides = [0, 1, 2].map(|k| at[(k + 1) % 3].distance(at[k]));
            let longest = (0..3).fold(0, |l, k| if sides[k] > sides[l] { k } else { l });
            let far = (at[0] + at[1] + at[2]).distance(3.0 * eye) / 3.0;
            if near.is_some() && depth < 24 && sides[longest] > far.max(reach) {
                let middle = (corners[longest] + corners[(longest + 1) % 3]) / 2.0;
                for k in [longest, (longest + 1) % 3] {
                    let mut half = corners;
                    half[k] = middle;
                    open.push((half, depth + 1));
                }
                continue;
            }
            let area = (at[1] - at[0]).cross(at[2] - at[0]).length();
            sum += if near.is_some() { area / far.max(reach).max(1e-9).powi(2) } else { area };
            all.push(Part { triangle: i as u32, corners, sum });
        }
    }
    all
}

/// [`POOL`] points, spread over the scene as [`parts`] says, in random order: of each the triangle, and the weights of its
/// second and third corner as 2 × 16 bits.
fn spread_points(geometry: &Geometry, near: Option<Camera>) -> Vec<[u32; 2]> {
    let parts = parts(geometry, near);
    let whole = parts.last().map_or(0.0, |p| p.sum);
    let unit = |x: u32| f64::from(x) / 4294967296.0;
    let mut part = 0;
    let mut all: Vec<[u32; 2]> = (0..POOL)
        .map(|i| {
            let at = (f64::from(i) + unit(hash(3 * i))) / f64::from(POOL) * whole;
            while part + 1 < parts.len() && parts[part].sum <= at {
                part += 1;
            }
            // Uniform over the part: what lies beyond its long side is turned back into it.
            let (mut u, mut v) = (unit(hash(3 * i + 1)), unit(hash(3 * i + 2)));
            if u + v > 1.0 {
                (u, v) = (1.0 - u, 1.0 - v);
            }
            let [a, b, c] = parts[part].corners;
            let place = a + (b - a) * u + (c - a) * v;
            let [u, v] = place.to_array().map(|x| (x * 65535.0) as u32);
            [parts[part].triangle, u | v << 16]
        })
        .collect();
    for i in (1..POOL).rev() {
        all.swap(i as usize, hash(i ^ 0x9e3779b9) as usize % (i as usize + 1));
    }
    all
}

impl ImperfectSm {
    fn new(gpu: &Gpu) -> Result<ImperfectSm> {
        let pass = |name, entry| Pass::compute(gpu, name, &alone(FILE), entry, INFO.params);
        Ok(ImperfectSm {
            direct: PlainMaps::new([FILE, AROUND], INFO.params),
            shoot: pass("rays from the light", "shoot")?,
            choose: pass("bounce lights", "choose_lights")?,
            place_points: pass("scene points", "place_points")?,
            splat: pass("splatting", "splat")?,
            unpack: pass("unpacking", "unpack")?,
            pull: pass("pull", "pull")?,
            push: pass("push", "push")?,
            gather: None,
            candidates: None,
            vpls: gpu.room("bounce lights", VPL * MOST_VPLS, Use::UNIFORM | Use::STORAGE),
            points: None,
            tiles: None,
            indirect: Slot::default(),
            no_tiles: Slot::default(),
            lights_of: None,
            tiles_of: None,
            gathered_of: None,
        })
    }

    /// Finds the bounce lights.
    fn place(&mut self, f: &mut Frame, p: &ImperfectSmParams, of: &LightsOf) -> Result<()> {
        if self.lights_of.as_ref() == Some(of) && !f.fresh {
            return Ok(());
        }
        let count = p.vpls * p.candidates;
        let gpu = f.gpu;
        let candidates = hold(&mut self.candidates, u64::from(count), |count| {
            Ok(gpu.room("candidates for bounce lights", count * VPL, Use::STORAGE))
        })?;
        f.run(&self.shoot).bind("candidates", &*candidates).dispatch(count.div_ceil(64), 1, 1);
        f.run(&self.choose).bind("candidates", &*candidates).bind("chosen", &self.vpls).dispatch(1, 1, 1);
        self.lights_of = Some(of.clone());
        Ok(())
    }

    /// Draws the maps of all bounce lights.
    fn draw(&mut self, f: &mut Frame, p: &ImperfectSmParams, of: &LightsOf) -> Result<()> {
        let key = (of.clone(), values(f, &["points", "tile", "levels", "tolerance"]));
        let gpu = f.gpu;
        let tiles = hold(&mut self.tiles, [p.vpls, p.tile, p.levels], |key| {
            self.tiles_of = None;
            [&self.splat, &self.unpack, &self.pull, &self.push].into_iter().for_each(Pass::forget);
            Tiles::new(gpu, *key)
        })?;
        if self.tiles_of.as_ref() == Some(&key) && !f.fresh {
            return Ok(());
        }
        let near = of.seen.map(|(camera, _)| camera);
        let points = hold(&mut self.points, (f.revision, near), |_| {
            self.splat.forget();
            let places = spread_points(f.geometry, near);
            let places = gpu.buffer("places of scene points", bytemuck::cast_slice(&places), Use::STORAGE);
            let usage = wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::TEXTURE_BINDING;
            let texture = gpu::texture(gpu, "scene points", [512, POOL / 512, 1], 1, Format::Rgba32Float, usage);
            let view = texture.create_view(&Default::default());
            f.run(&self.place_points).bind("places", &places).bind("points_out", &view).dispatch(POOL / 64, 1, 1);
            self.place_points.forget();
            Ok(Points { view, _texture: texture })
        })?;
        f.clear(&tiles.splats);
        f.run(&self.splat)
            .bind("points", &points.view)
            .bind("vpls", &self.vpls)
            .bind("splats", &tiles.splats)
            .dispatch(p.points.div_ceil(64), p.vpls, 1);
        let groups = |level: usize| tiles.size.map(|s| (s >> level).div_ceil(8));
        let [w, h] = groups(0);
        f.run(&self.unpack).bind("splatted", &tiles.splats).bind("tiles_out", &tiles.levels[0]).dispatch(w, h, 1);
        for i in 1..tiles.levels.len() {
            let [w, h] = groups(i);
            f.run(&self.pull).bind("finer", &tiles.levels[i - 1]).bind("tiles_out", &tiles.levels[i]).dispatch(w, h, 1);
        }
        for i in (1..tiles.levels.len()).rev() {
            let [w, h] = groups(i - 1);
            f.run(&self.push).bind("coarser", &tiles.levels[i]).bind("filled", &tiles.levels[i - 1]).dispatch(w, h, 1);
        }
        self.tiles_of = Some(key);
        Ok(())
    }
}

/// Some of the technique's values.
fn values(f: &Frame, names: &[&str]) -> Values {
    let held = names.iter().filter_map(|name| f.values.get_key_value(*name));
    held.map(|(name, value)| (name.clone(), value.clone())).collect()
}

impl ImperfectSm {
    /// Gathers the light of all bounce lights at each pixel.
    fn gather(&mut self, f: &mut Frame, p: &ImperfectSmParams, of: LightsOf) -> Result<()> {
        let read = ["vpl_shadows", "clamp", "vpl_bias", "points", "tile", "levels", "tolerance"];
        let key = (of, values(f, &read), f.eye, f.size);
        let held = self.indirect.view().cloned();
        let indirect = self.indirect.get(f.gpu, "indirect light", f.size, Format::Rgba16Float, STORED);
        if held.as_ref() == Some(&indirect) && self.gathered_of.as_ref() == Some(&key) && !f.fresh {
            return Ok(());
        }
        let asks = match p.vpl_shadows.as_str() {
            "none" => 0,
            "imperfect" => 1,
            _ => 2,
        };
        let gpu = f.gpu;
        let gather = hold(&mut self.gather, asks, |asks| {
            let constants = [("asks", f64::from(*asks))];
            Pass::specialised(gpu, "gather", &alone(FILE), "gather", INFO.params, &constants)
        })?;
        let none = self.no_tiles.get(gpu, "no maps", [1, 1], Format::R32Float, SAMPLED);
        let tiles = self.tiles.as_ref().map_or(&none, |(_, t)| &t.levels[0]);
        // A look-up of a tile for each light, or a ray.
        let cost = if p.vpl_shadows == "traced" { p.vpls * RAY_COST } else { p.vpls.div_ceil(4) };
        let run = f.run(gather).in_bands(cost).bind("vpls", &self.vpls).bind("tiles", tiles);
        run.bind("indirect_out", &indirect).per_pixel();
        self.gathered_of = Some(key);
        Ok(())
    }
}

impl Technique for ImperfectSm {
    fn render(&mut self, f: &mut Frame) -> Result<()> {
        let p = ImperfectSmParams::read(f.values);
        let of = LightsOf {
            light: f.light,
            revision: f.revision,
            seed: f.seed,
            values: values(f, &["vpls", "placing", "candidates"]),
            seen: (p.placing == "view").then_some((f.camera, f.size)),
        };
        if p.shown != "direct" || OWN_VIEWS.contains(&f.view) {
            self.place(f, &p, &of)?;
            if p.vpl_shadows == "imperfect" || TILE_VIEWS.contains(&f.view) {
                self.draw(f, &p, &of)?;
            }
            self.gather(f, &p, of)?;
        }
        let indirect = self.indirect.get(f.gpu, "indirect light", f.size, Format::Rgba16Float, STORED);
        if p.shown != "direct" {
            let both = p.shown == "both";
            let [direct, ambient] = if both { [1.0, p.ambient] } else { [0.0, 0.0] };
            f.offer_indirect(Indirect { view: indirect.clone(), direct, ambient });
        }
        let none = self.no_tiles.get(f.gpu, "no maps", [1, 1], Format::R32Float, SAMPLED);
        // Views that show no tiles bind them all the same.
        let (splatted, tiles) = self.tiles.as_ref().map_or((&self.vpls, &none), |(_, t)| (&t.splats, &t.levels[0]));
        let bound: [(&'static str, Resource); 4] = [
            ("indirect", (&indirect).into()),
            ("vpls", (&self.vpls).into()),
            ("splatted", splatted.into()),
            ("tiles", tiles.into()),
        ];
        let maps = self.direct.draw(f, Reach::default())?;
        self.direct.look_up(f, &maps, NEAREST, &bound)
    }
}
