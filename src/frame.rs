//! A frame from top to bottom: set-up in, visibility, truth and picture out.
//!
//! Window, command line and tests all come through [`Renderer::render`].

mod analysis;
mod figure;
mod freeze;
mod indirect;
mod judged;
mod lights;
mod lines;
mod maps;
mod read;
mod shot;
mod story;

pub use analysis::{Analysis, Counting, MapSizes, PieceCount};
pub use figure::{Pane, panes};
pub use indirect::Indirect;
pub use lights::ToldLight;
pub use lines::{Segment, Style};
pub use maps::{LightSpace, MapLayer, Place};
pub use read::Pixels;
pub use shot::{Shot, ShotUniform};
pub use story::{Looked, Shown, ShownValue, TAPS};

use crate::contact::{self, Contact};
use crate::gpu::{Account, Buffer, Failure, Gpu, Pass, Raster, Recorder, Slot, Timer, Unfit};
use crate::light::{Light, LightView};
use crate::measure::causes::Causes;
use crate::params::{Group, Values};
use crate::scene::geometry::{Geometry, Room, SceneGpu};
use crate::scene::{Camera, Scene};
use crate::setup::{Base, Setup};
use crate::techniques::{self, Info, Technique};
use crate::truth::{Progress, Tracing};
use crate::view::{self, Drawn, Legend, Source, View};
use anyhow::{Context, Result, bail, ensure};
use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Mat3, Mat4, Vec2, Vec3, Vec4};
use judged::Judged;
use maps::Offered;
use std::collections::hash_map::Entry;
use std::collections::{BTreeMap, HashMap, btree_map};
use std::sync::Arc;
use std::time::Instant;
use wgpu::TextureFormat as Format;

/// What every pass may know, as `Frame` in `shaders/lib/frame.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct FrameUniform {
    pub view_proj: Mat4,
    pub eye_proj: Mat4,
    pub rays: [Vec4; 3],
    pub eye: Vec3,
    pub near: f32,
    pub forward: Vec3,
    pub far: f32,
    pub bounds_min: Vec3,
    pub seed: u32,
    pub bounds_max: Vec3,
    pub light_radius: f32,
    pub light_position: Vec3,
    pub light_kind: u32,
    pub light_axis: Vec3,
    pub light_range: f32,
    pub light_color: Vec3,
    pub light_cosine: f32,
    pub light_half_u: Vec3,
    pub view: u32,
    pub light_half_v: Vec3,
    pub map: u32,
    pub size: [u32; 2],
    pub band: [u32; 2],
    pub shadow_eye: Vec3,
    pub frozen: u32,
    pub shadow_forward: Vec3,
    pub shadow_far: f32,
    pub shadow_up: Vec3,
    pub probe: u32,
    pub orthographic: u32,
    pub shadow_orthographic: u32,
    pub reach: f32,
    pub beyond: f32,
    pub padding: [u32; 3],
    pub triangle_count: u32,
}

/// How far from the light, or under the sun from the caster, an orthographic picture's volumes end, and the depth along the
/// camera's axis behind which nothing of them lies, metres: for all lights of the set-up, as they share the picture's depth. A
/// lamp's volume ends in a cap that is as flat as its caster: at sixteen times as far as the scene reaches, all but casters within
/// 4° of seeing the light edge-on have theirs behind all of it.
fn volume_ends(setup: &Setup, bounds: [Vec3; 2]) -> [f32; 2] {
    let middle = bounds[0].midpoint(bounds[1]);
    let half = 0.5 * bounds[0].distance(bounds[1]);
    let lamps = || {
        let all = setup.more_lights.iter().map(|l| l.light).chain([setup.light]);
        all.filter(|l| !matches!(l, Light::Directional { .. })).map(|l| l.position())
    };
    let beyond = lamps().map(|at| 16.0 * (at.distance(middle) + half)).fold(2.2 * half, f32::max);
    let depth = |p: Vec3| (p - setup.camera.position).dot(setup.camera.forward());
    let deepest = lamps().map(depth).fold(depth(middle) + half, f32::max);
    [beyond, deepest + 1.001 * beyond]
}

impl FrameUniform {
    fn new(setup: &Setup, size: [u32; 2], scene: &SceneGpu) -> FrameUniform {
        let bounds = scene.bounds;
        let camera = setup.camera;
        let aspect = size[0] as f32 / size[1] as f32;
        let [beyond, last] = volume_ends(setup, bounds);
        let projection = camera.unbounded_projection(aspect, last);
        let frozen = setup.frozen();
        let shadow = frozen.unwrap_or(camera);
        let uniform = FrameUniform {
            view_proj: projection * camera.view(),
            eye_proj: projection * Mat4::from_mat3(Mat3::from_mat4(camera.view())),
            rays: camera.rays(size).map(|r| r.as_vec3().extend(0.0)),
            eye: camera.position,
            near: camera.near,
            forward: camera.forward(),
            far: camera.far,
            bounds_min: bounds[0],
            seed: setup.seed,
            bounds_max: bounds[1],
            // A technique's own map is drawn with the number behind the last common view.
            view: view::index(&setup.view).unwrap_or(view::VIEWS.len()) as u32,
            map: techniques::map_number(&setup.view),
            size,
            band: [0, size[1]],
            shadow_eye: shadow.position,
            frozen: frozen.is_some() as u32,
            shadow_forward: shadow.forward(),
            shadow_far: freeze::far(&shadow, bounds),
            shadow_up: (shadow.projection(aspect) * shadow.view()).row(1).truncate(),
            probe: probe(setup, size),
            orthographic: camera.height.is_some() as u32,
            shadow_orthographic: shadow.height.is_some() as u32,
            reach: camera.position.distance(camera.target),
            beyond,
            triangle_count: scene.triangle_count,
            ..FrameUniform::zeroed()
        };
        let lit = uniform.with_light(&setup.light);
        // One that is off lights nothing, though its shadow can be looked at.
        FrameUniform { light_color: if setup.light_on { lit.light_color } else { Vec3::ZERO }, ..lit }
    }

    fn with_light(self, light: &Light) -> FrameUniform {
        let (cosine, half_u, half_v) = match *light {
            Light::Spot { outer_angle, .. } => (outer_angle.to_radians().cos(), Vec3::ZERO, Vec3::ZERO),
            Light::RectArea { half_u, half_v, .. } => (0.0, half_u, half_v),
            _ => (0.0, Vec3::ZERO, Vec3::ZERO),
        };
        FrameUniform {
            light_radius: light.radius(),
            light_position: light.position(),
            light_kind: light.index() as u32,
            light_axis: light.axis(),
            light_range: light.range().min(f32::MAX),
            light_color: light.color(),
            light_cosine: cosine,
            light_half_u: half_u,
            light_half_v: half_v,
            ..self
        }
    }

    /// The same for another light than the one at work, whose maps nobody looks at.
    fn lit_by(&self, light: &Light) -> FrameUniform {
        let view = view::index("shaded").unwrap_or_default() as u32;
        FrameUniform { view, map: techniques::map_number("shaded"), ..self.with_light(light) }
    }

    /// The same camera with its image moved so that each pixel's sample lies `by` pixels, right and down, from the centre.
    pub fn shifted(&self, by: Vec2) -> FrameUniform {
        let [width, height] = self.size.map(|s| s as f32);
        let ndc = Vec3::new(-2.0 * by.x / width, 2.0 * by.y / height, 0.0);
        let moved = Mat4::from_translation(ndc);
        let [x, y, corner] = self.rays;
        FrameUniform {
            view_proj: moved * self.view_proj,
            eye_proj: moved * self.eye_proj,
            rays: [x, y, corner + x * by.x + y * by.y],
            ..*self
        }
    }
}

/// The probed pixel as `Frame::probe` in WGSL has it.
fn probe(setup: &Setup, size: [u32; 2]) -> u32 {
    let [x, y] = pixel_at(setup.probe, size);
    x | y << 16
}

/// The pixel at a place of a picture, shares of its sides from the upper left corner.
pub fn pixel_at(place: [f32; 2], size: [u32; 2]) -> [u32; 2] {
    [0, 1].map(|i| ((place[i] * size[i] as f32) as u32).min(size[i].saturating_sub(1)))
}

/// How a technique's map is drawn, as `drawn_map` in `shaders/shade.wgsl` has it; 0: there is none.
fn drawn_map(drawn: &Drawn) -> u32 {
    match drawn {
        Drawn::Common(_) => 0,
        Drawn::Depth => 1,
        Drawn::Ramp(_) | Drawn::Diagram(_) => 2,
        Drawn::Cells => 3,
        Drawn::Aliasing(_) => 4,
        Drawn::Counts => 5,
        Drawn::Labels(_) => 6,
        Drawn::Contact(_) => 7,
    }
}

/// A number that the GPU counts, and what is told of it.
type CountedNote = (Buffer, fn(u32) -> String);

/// What a technique is given: the G-buffer, the scene and the light, through the names its shaders use.
pub struct Frame<'a> {
    recorder: Recorder<'a>,
    /// The camera that maps are fitted to.
    pub camera: Camera,
    /// The picture's own, which goes on where the other is frozen.
    pub eye: Camera,
    pub light: Light,
    /// Its place among the set-up's lights, from 0.
    pub lamp: usize,
    /// All of these that are on, and the one at work, each with its place.
    pub lamps: Vec<(usize, Light)>,
    /// The view that is asked for, by its id.
    pub view: &'a str,
    /// The values of the technique's parameters.
    pub values: &'a Values,
    pub scene: &'a SceneGpu,
    pub geometry: &'a Geometry,
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// The picture's depth buffer with its stencil ([`Gpu::depth_stencil`]): near over the depth along the camera's axis, 0 where
    /// nothing is; of an orthographic camera even, from 1 at the near plane on. Passes that count in the stencil draw into it; no pass may write its depth.
    pub depth: wgpu::TextureView,
    /// Of all that is random.
    pub seed: u32,
    /// What is taken off the scene's coordinates ([`Scene::origin`]).
    pub origin: DVec3,
    /// Counts the changes of the scene's geometry.
    pub revision: u64,
    /// Nothing may be taken over from the frame before.
    pub fresh: bool,
    /// Maps are looked into: their texels are drawn even where the picture looks none up.
    pub whole_maps: bool,
    pub history: History,
    frames: [u32; 2],
    notes: Vec<String>,
    counted_notes: Vec<CountedNote>,
    offered: Option<Offered>,
    indirect: Option<Indirect>,
    splits: Option<(Buffer, u32)>,
    faces: Option<([Buffer; 2], u32)>,
    pieces: Option<Buffer>,
    inspected: bool,
    analysis: Option<&'a mut Analysis>,
    draw_counts: &'a Pass,
    outlines: Option<lines::Outlines>,
}

impl<'a> std::ops::Deref for Frame<'a> {
    type Target = Recorder<'a>;
    fn deref(&self) -> &Recorder<'a> {
        &self.recorder
    }
}
impl std::ops::DerefMut for Frame<'_> {
    fn deref_mut(&mut self) -> &mut Self::Target {
        &mut self.recorder
    }
}

impl Frame<'_> {
    /// Whether one of the technique's own maps is asked for, so that `inspect` must run.
    pub fn wants_any_map(&self) -> bool {
        self.inspected
    }

    /// Tells of how many frames the light is averaged, and of how many it is to be.
    pub fn tell_frames(&mut self, averaged: u32, wanted: u32) {
        self.frames = [averaged, wanted];
    }

    /// Tells what must be known of the picture: what the scene has that the technique cannot do right, and how much of it was
    /// skipped. A sentence or two.
    pub fn tell_note(&mut self, note: String) {
        self.notes.push(note);
    }

    /// Tells a note of a number that the GPU counts into a buffer, where that is not 0.
    pub fn tell_counted(&mut self, count: &Buffer, note: fn(u32) -> String) {
        self.counted_notes.push((count.clone(), note));
    }

    /// Tells how many faces the light's maps have, and where the GPU keeps the samples and draws of each
    /// (`shaders/map/faces.wgsl`).
    pub fn tell_faces(&mut self, [samples, draws]: [&Buffer; 2], faces: u32) {
        self.faces = Some(([samples.clone(), draws.clone()], faces));
    }

    /// Tells where cascades meet: floats, metres along the camera's axis, one more than there are cascades.
    pub fn tell_splits(&mut self, splits: &Buffer, cascades: u32) {
        self.splits = Some((splits.clone(), cascades));
    }
}

/// Screen-space textures of one size.
#[derive(Default)]
struct Targets {
    position: Slot,
    surface: Slot,
    depth: Slot,
    visibility: Slot,
    map: Slot,
    mask: Slot,
    output: Slot,
}

impl Targets {
    /// The view of a target that a frame has made.
    fn view(slot: &Slot) -> Result<&wgpu::TextureView> {
        slot.view().context(NO_FRAME)
    }

    /// Pixels of the last frame.
    fn size(&self) -> Result<[u32; 2]> {
        let texture = self.position.texture().context(NO_FRAME)?;
        Ok([texture.width(), texture.height()])
    }
}

const NO_FRAME: &str = "no frame has been rendered yet";

/// How far the truth is to be traced in a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Truth {
    /// Not at all.
    Off,
    /// Some more of it, as many pixels' samples as given.
    Some(u32),
    /// All that is missing.
    All,
}

/// What a frame takes over of what those before it saw, where the technique averages several.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum History {
    /// Everything: it is one frame more.
    Goes,
    /// Nothing: it is the first one.
    Starts,
    /// Nothing, and all frames that the technique is to average are drawn at once.
    Whole,
}

/// What a frame is asked for.
#[derive(Clone, Copy, Debug)]
pub struct Ask {
    /// Pixels to render at; the set-up's size unless a window wants another.
    pub size: [u32; 2],
    pub truth: Truth,
    /// Analyse it: see [`Renderer::analysis`]. Views that need the analysis ask for it themselves.
    pub analysis: bool,
    /// Time every pass.
    pub timed: bool,
    /// Draw the view into [`Renderer::output`].
    pub picture: bool,
    /// Do everything again, even what the last frame's results would serve for: its time is to be known.
    pub fresh: bool,
    pub history: History,
}

impl Ask {
    /// A set-up's picture at its size, with all of the truth and nothing from frames before, as captures draw it.
    pub fn of(setup: &Setup) -> Ask {
        Ask {
            size: setup.size,
            truth: Truth::All,
            analysis: false,
            timed: false,
            picture: true,
            fresh: false,
            history: History::Whole,
        }
    }
}

/// What a frame tells of itself.
#[derive(Clone, Debug, Default)]
pub struct Told {
    /// CPU milliseconds that the technique took to record its passes.
    pub cpu_ms: f64,
    /// How many these were; with the analysis', where the frame asked for one.
    pub passes: u32,
    /// Bytes of GPU memory that the technique holds.
    pub gpu_bytes: u64,
    /// How much of the truth is traced that the set-up names ([`crate::truth::Samples::shown`]).
    pub truth: Progress,
    /// Of how many frames the light is averaged, and of how many it is to be; of a comparison on the side that is farthest
    /// from it.
    pub frames: [u32; 2],
    /// What the technique holds for each light.
    pub lights: Vec<ToldLight>,
    /// What each side of a comparison tells; empty without one.
    pub sides: Vec<ToldSide>,
    /// Samples of pixels that the frame traced of it.
    pub traced: u64,
}

/// What a side of a comparison tells of itself; the truth nothing.
#[derive(Clone, Debug, Default)]
pub struct ToldSide {
    /// Its passes with their milliseconds, equal names added up, in a frame that was timed.
    pub passes: Vec<(&'static str, f64)>,
    /// Bytes of GPU memory that its technique holds.
    pub gpu_bytes: u64,
    /// The same, and its times, by light.
    pub lights: Vec<ToldLight>,
}

/// How a technique's own map is drawn, as `View` in `shaders/shade.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub struct ViewUniform {
    pub range: [f32; 2],
    /// Of the map, where it holds more than one value.
    pub channel: u32,
    /// Rows of the picture, from the top, that have what the view needs.
    pub rows: u32,
    /// How much an overlay hides; at 1 and above it lies small in a corner.
    pub opacity: f32,
    /// Of errors: pixels by which wrong ones grow, and whether what lies under them is light.
    pub dilation: u32,
    pub light_base: u32,
    /// Shares of direct and of ambient light, where a technique offers indirect light.
    pub direct: f32,
    pub ambient: f32,
    /// Of `range`: by the logarithm of one more.
    pub log: u32,
    /// The picture lets through what lies behind it where nothing is seen.
    pub transparent: u32,
    pub padding: u32,
}

/// What a picture is drawn as, as `layer` in `shaders/shade.wgsl`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Layer {
    #[default]
    Alone,
    Below,
    Over,
}

/// Most passes that draw the picture: more than one frame has. With more, all are made anew when they are asked for, which is quick
/// while the device still has their pipelines.
const MOST_SHADINGS: usize = 16;

/// The passes that draw the picture: each view has a pipeline of its own, made when it is first asked for.
struct Shading {
    passes: HashMap<[u32; 5], Pass>,
    view: Buffer,
    /// What the technique in use offers.
    indirect: Option<Indirect>,
    /// Bound where no technique shows a map.
    no_light_view: Buffer,
}

/// A picture to be drawn.
#[derive(Clone, Copy)]
struct Drawing {
    /// The view, as [`FrameUniform::view`] numbers it.
    number: u32,
    drawn: Drawn,
    layer: Layer,
    /// Of the picture, from the top, that have what the view needs.
    rows: u32,
    /// Of an overlay, as [`ViewUniform::opacity`].
    opacity: f32,
    dilation: u32,
    light_base: bool,
    transparent: bool,
    /// Lit by the other lights too, whose sum the recorder knows.
    more_lights: bool,
}

impl Drawing {
    /// A view of a set-up, by its number; all of it.
    fn new(setup: &Setup, number: u32, drawn: Drawn) -> Drawing {
        let (dilation, light_base) = (setup.error_dilation, setup.error_base == Base::Light);
        let shaded = view::index("shaded") == Some(number as usize);
        Drawing {
            number,
            drawn,
            layer: Layer::Alone,
            rows: u32::MAX,
            opacity: 0.0,
            dilation,
            light_base,
            transparent: setup.transparent,
            more_lights: shaded && !setup.lit_beside().is_empty(),
        }
    }
}

impl Shading {
    fn new(gpu: &Gpu) -> Shading {
        let uniform = |label, size: usize| gpu.buffer(label, &vec![0; size], wgpu::BufferUsages::UNIFORM);
        Shading {
            passes: HashMap::new(),
            view: uniform("view", size_of::<ViewUniform>()),
            indirect: None,
            no_light_view: uniform("no light view", size_of::<LightView>()),
        }
    }

    fn pass(&mut self, gpu: &Gpu, key: [u32; 5]) -> Result<&Pass> {
        for (_, other) in self.passes.iter().filter(|(k, _)| **k != key) {
            // What it bound may be gone by the time it is asked for again.
            other.forget();
        }
        if self.passes.len() >= MOST_SHADINGS && !self.passes.contains_key(&key) {
            self.passes.clear();
        }
        match self.passes.entry(key) {
            Entry::Occupied(held) => Ok(held.into_mut()),
            Entry::Vacant(free) => {
                let [view, map, layer, indirect, more] = key.map(f64::from);
                let constants = [
                    ("drawn_view", view),
                    ("drawn_map", map),
                    ("layer", layer),
                    ("indirect_light", indirect),
                    ("more_lights", more),
                ];
                let pass = Pass::specialised(gpu, "shading", "shade.wgsl", "shade", &[view::GROUP], &constants)?;
                Ok(free.insert(pass))
            }
        }
    }

    /// Records the pass that draws a picture. The recorder knows the frame's targets; `map` is what `map_out` holds. Of the
    /// technique: its depth maps, and the channels of the analysis.
    fn record(
        &mut self,
        recorder: &mut Recorder,
        picture: Drawing,
        map: &wgpu::TextureView,
        (maps, aliasing): (Option<&Offered>, Option<&wgpu::TextureView>),
    ) -> Result<()> {
        let gpu = recorder.gpu;
        let Drawing { rows, opacity, dilation, .. } = picture;
        let (buffer, no_light_view) = (self.view.clone(), self.no_light_view.clone());
        let indirect = self.indirect.clone();
        let [offered, more] = [indirect.is_some() as u32, picture.more_lights as u32];
        let key = [picture.number, drawn_map(&picture.drawn), picture.layer as u32, offered, more];
        let pass = self.pass(gpu, key)?;
        let light_base = picture.light_base as u32;
        // What will lie over another says by its alpha where it shows data.
        let transparent = (picture.transparent && picture.layer != Layer::Over) as u32;
        let mut view = ViewUniform {
            range: [0.0, 1.0],
            rows,
            opacity,
            dilation,
            light_base,
            transparent,
            ..ViewUniform::zeroed()
        };
        let mut run = recorder.run(pass).bind("view", &buffer).bind("shown", map).bind("light_view", &no_light_view);
        run = run.bind("indirect", indirect.as_ref().map_or(map, |i| &i.view));
        if let Some(indirect) = indirect {
            (view.direct, view.ambient) = (indirect.direct, indirect.ambient);
        }
        match (picture.drawn, maps, aliasing) {
            (Drawn::Ramp(values), ..) => (view.range, view.log) = (values.range, values.log as u32),
            (Drawn::Aliasing(channel), _, Some(aliasing)) => {
                view.channel = channel;
                run = run.bind("map", aliasing);
            }
            (Drawn::Depth, Some(maps), _) => {
                run = run.bind("shown", &maps.layers[maps.shown]).bind("light_view", &maps.light_views);
            }
            _ => {}
        }
        gpu.queue.write_buffer(&buffer, 0, bytemuck::bytes_of(&view));
        run.per_pixel();
        Ok(())
    }
}

/// A technique with its resources and parameters, made: once for each light that it shadows.
pub struct Made {
    info: &'static Info,
    /// By the light's place among the set-up's.
    own: BTreeMap<usize, Instance>,
    params: HashMap<&'static str, (Vec<u32>, Buffer)>,
}

/// A technique with what it holds for one light.
struct Instance {
    technique: Box<dyn Technique>,
    /// On top of it, where they are wanted.
    contact: Option<Contact>,
    /// What its buffers and textures take.
    account: Account,
}

impl Made {
    /// The technique in `slot`, made anew if another is in it.
    fn take<'s>(slot: &'s mut Option<Made>, info: &'static Info) -> &'s mut Made {
        if slot.as_ref().is_some_and(|held| held.info.id != info.id) {
            // Its memory first.
            *slot = None;
        }
        slot.get_or_insert_with(|| Made { info, own: BTreeMap::new(), params: HashMap::new() })
    }

    /// Renders a light's shadow, by an instance that is made if there is none.
    fn render(&mut self, f: &mut Frame, light: usize) -> Result<()> {
        let info = self.info;
        if let Some(why) = info.lacks(f.values, &f.gpu.abilities) {
            bail!("{}: {why}", info.title);
        }
        let held = match self.own.entry(light) {
            btree_map::Entry::Occupied(held) => held.into_mut(),
            btree_map::Entry::Vacant(free) => {
                let account = Account::default();
                let technique = account.charge(|| (info.make)(f.gpu, info));
                let technique = technique.with_context(|| cannot_be_made(info))?;
                free.insert(Instance { technique, contact: None, account })
            }
        };
        let Instance { technique, contact, account } = held;
        let rendered = account.charge(|| {
            if !contact::wanted(f.values) {
                *contact = None;
                return technique.render(f);
            }
            let contact = match contact {
                Some(contact) => contact,
                None => contact.insert(Contact::new(f.gpu)?),
            };
            contact.over(f, |f| technique.render(f))
        });
        // Which technique's shader that is the driver does not know.
        let name = |e: anyhow::Error| if e.is::<Unfit>() { e.context(cannot_be_made(info)) } else { e };
        rendered.map_err(name)
    }

    /// What it holds for each light.
    fn told(&self) -> Vec<ToldLight> {
        let one =
            |(light, held): (&usize, &Instance)| ToldLight { light: *light, gpu_bytes: held.account.bytes(), ms: 0.0 };
        self.own.iter().map(one).collect()
    }
}

fn cannot_be_made(info: &Info) -> String {
    format!("{} cannot be made", info.title)
}

/// Renders set-ups of one scene on one device.
pub struct Renderer {
    pub gpu: Arc<Gpu>,
    scene: Arc<Scene>,
    geometry: Geometry,
    scene_gpu: SceneGpu,
    clock: (u32, f32),
    targets: Targets,
    made: Option<Made>,
    pub timer: Timer,
    /// See [`Frame::whole_maps`].
    pub whole_maps: bool,
    frame_buffer: Buffer,
    gbuffer: Pass,
    unshadowed: Pass,
    truth: Tracing,
    classify: Pass,
    shading: Shading,
    /// The technique's rays, as `Tally` in `shaders/lib/trace.wgsl`.
    tally: Buffer,
    analysis: Analysis,
    draw_counts: Pass,
    figure: figure::Figure,
    lights: lights::Lights,
    /// The last frame's view; None: the technique could not draw it.
    seen: Option<&'static View>,
    /// Of how many frames its light is averaged.
    frames: u32,
    /// It draws penumbras, and its light has no size.
    sizeless: bool,
    /// What the technique told of the last frame.
    technique_notes: Vec<String>,
    /// Those of numbers that the GPU counts.
    counted_notes: Vec<CountedNote>,
    /// The last frame's depth maps.
    offered: Option<Offered>,
    read_map: Option<Pass>,
    /// By the technique's shader.
    read_warp: Option<(&'static str, Pass)>,
    /// What tells of pixels, and what draws the technique's own views, by their shaders.
    tell: Option<(String, Pass)>,
    show: Option<(String, Pass)>,
    /// The last frame's, and its place among the set-up's.
    light: Option<Light>,
    at_work: usize,
    /// Where the last frame's cascades meet, and how many there are.
    splits: Option<(Buffer, u32)>,
    /// Samples and draws of the last frame's faces, and how many there are.
    faces: Option<([Buffer; 2], u32)>,
    /// What caused the last frame's errors, if its view showed that.
    causes: Option<Causes>,
    revision: u64,
    frozen: freeze::Frozen,
    lines: lines::Lines,
    shots: Option<shot::Shots>,
    /// The pass whose texture is to be shown.
    watched: Option<&'static str>,
    /// The last frame failed: nothing of it serves the next.
    broken: bool,
}

/// What the frame itself takes, beside its technique, by the names in the pass times.
pub const SHARED_PASSES: [&str; 10] =
    [ANIMATION, "G-buffer", freeze::PASS, ANALYSIS, "count map", lights::PASS, "truth", JUDGED, "shading", lines::PASS];
/// Milliseconds of the technique's passes among these, each with its name.
pub fn technique_ms(passes: &[(&'static str, f64)]) -> f64 {
    // Not sum(), whose zero is -0.
    passes.iter().filter(|p| !SHARED_PASSES.contains(&p.0)).fold(0.0, |sum, p| sum + p.1)
}

/// The name of every technique's analysis pass.
pub(crate) const ANALYSIS: &str = "analysis";
/// What [`judged`] does.
const JUDGED: &str = "error map (CPU)";
/// Moving the animated geometry and building its BVH, on the CPU.
const ANIMATION: &str = "geometry and BVH (CPU)";

pub(crate) const SAMPLED: wgpu::TextureUsages =
    wgpu::TextureUsages::TEXTURE_BINDING.union(wgpu::TextureUsages::COPY_SRC);
pub const DRAWN: wgpu::TextureUsages = SAMPLED.union(wgpu::TextureUsages::RENDER_ATTACHMENT);
pub const STORED: wgpu::TextureUsages = SAMPLED.union(wgpu::TextureUsages::STORAGE_BINDING);

impl Renderer {
    /// Uploads a scene and makes the passes that every frame has.
    ///
    /// # Errors
    /// A scene larger than the adapter takes, or a shader that does not compile.
    pub fn new(gpu: Arc<Gpu>, scene: Arc<Scene>) -> Result<Renderer> {
        Room::of(&gpu).check(&scene)?;
        let geometry = Geometry::new(&scene, 0, 0.0)?;
        Renderer::with_geometry(gpu, scene, geometry)
    }

    /// As [`Renderer::new`], with geometry that was made elsewhere (by a loading thread).
    pub fn with_geometry(gpu: Arc<Gpu>, scene: Arc<Scene>, geometry: Geometry) -> Result<Renderer> {
        let scene_gpu = SceneGpu::new(&gpu, &scene, &geometry)?;
        let uniform = |label, size: usize| gpu.buffer(label, &vec![0; size], wgpu::BufferUsages::UNIFORM);
        let gbuffer = Raster {
            vertex: "vertex",
            fragment: Some("fragment"),
            targets: &[Format::Rgba32Float, Format::Rgba32Uint],
            depth: Raster::nearest(gpu.depth_stencil()),
            ..Raster::default()
        };
        let made = Renderer {
            timer: Timer::new(&gpu),
            frame_buffer: uniform("frame", size_of::<FrameUniform>()),
            gbuffer: Pass::render(&gpu, "G-buffer", "gbuffer.wgsl", gbuffer, &[])?,
            unshadowed: Pass::compute(&gpu, "no shadow", "unshadowed.wgsl", "fill", &[])?,
            truth: Tracing::new(&gpu)?,
            classify: Pass::compute(&gpu, "mask", "mask.wgsl", "classify", &[])?,
            shading: Shading::new(&gpu),
            tally: tally(&gpu, "rays"),
            analysis: Analysis::default(),
            draw_counts: Pass::compute(&gpu, "count map", "counts.wgsl", "draw_counts", &[])?,
            figure: figure::Figure::default(),
            lights: lights::Lights::default(),
            seen: None,
            frames: 1,
            sizeless: false,
            technique_notes: Vec::new(),
            counted_notes: Vec::new(),
            offered: None,
            whole_maps: false,
            read_map: None,
            read_warp: None,
            tell: None,
            show: None,
            light: None,
            at_work: 0,
            splits: None,
            faces: None,
            causes: None,
            gpu,
            scene,
            geometry,
            scene_gpu,
            clock: (0, 0.0),
            targets: Targets::default(),
            made: None,
            revision: 0,
            frozen: freeze::Frozen::default(),
            lines: lines::Lines::default(),
            shots: None,
            watched: None,
            broken: false,
        };
        made.gpu.check()?;
        Ok(made)
    }

    pub fn scene(&self) -> &Arc<Scene> {
        &self.scene
    }

    pub fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    /// Renders one frame of the set-up's own technique, without overlay and comparison: see [`Renderer::draw`].
    ///
    /// # Errors
    /// A picture larger than the adapter takes, or what the device reports.
    pub fn render(&mut self, setup: &Setup, ask: Ask) -> Result<Told> {
        let rendered = self.record(setup, ask);
        if rendered.as_ref().is_err_and(Failure::is_out_of_memory) {
            self.let_go()?;
        }
        rendered
    }

    /// Lets go of all that frames have made: what there was no memory for must not be taken for whole.
    fn let_go(&mut self) -> Result<()> {
        (self.made, self.offered, self.shading.indirect) = (None, None, None);
        (self.splits, self.faces, self.read_map, self.read_warp) = (None, None, None, None);
        (self.tell, self.show, self.shots) = (None, None, None);
        self.counted_notes.clear();
        self.targets = Targets::default();
        self.analysis = Analysis::default();
        self.figure = figure::Figure::default();
        self.lights = lights::Lights::default();
        self.frozen = freeze::Frozen::default();
        self.lines = lines::Lines::default();
        self.truth = Tracing::new(&self.gpu)?;
        self.shading.passes.values().chain([&self.gbuffer, &self.unshadowed, &self.classify]).for_each(Pass::forget);
        self.draw_counts.forget();
        Ok(())
    }

    fn record(&mut self, setup: &Setup, ask: Ask) -> Result<Told> {
        let mut moved;
        let setup = if setup.origin == self.scene.origin {
            setup
        } else {
            // Kept from when the scene's file stood or reached elsewhere.
            moved = setup.clone();
            moved.count_from(self.scene.origin);
            &moved
        };
        let info = techniques::find_or_say(&setup.technique)?;
        let limit = self.gpu.device.limits().max_texture_dimension_2d;
        let [width, height] = ask.size;
        ensure!(
            width.max(height) <= limit,
            "{width} × {height} pixels are more than {} takes ({limit})",
            self.gpu.info.name
        );
        self.figure.forget();
        let animated_ms = self.advance(setup)?;
        let mut told = Told::default();
        let broken = std::mem::replace(&mut self.broken, true);

        let gpu = &*self.gpu;
        let made = Made::take(&mut self.made, info);
        let t = &mut self.targets;
        let position = t.position.get(gpu, "position", ask.size, Format::Rgba32Float, DRAWN);
        let surface = t.surface.get(gpu, "surface", ask.size, Format::Rgba32Uint, DRAWN);
        let depth = t.depth.get(gpu, "depth", ask.size, gpu.depth_stencil(), DRAWN);
        let visibility = t.visibility.get(gpu, "visibility", ask.size, Format::R32Float, STORED);
        let written = STORED.union(wgpu::TextureUsages::COPY_DST);
        let map = t.map.get(gpu, "technique's map", ask.size, Format::R32Float, written);
        let output = t.output.get(gpu, "picture", ask.size, Format::Rgba8Unorm, STORED | DRAWN);

        let uniform = FrameUniform::new(setup, ask.size, &self.scene_gpu);
        gpu.queue.write_buffer(&self.frame_buffer, 0, bytemuck::bytes_of(&uniform));
        self.lights.start(gpu, setup, &uniform)?;
        let lamps = setup.lamps();
        made.own.retain(|i, _| *i == setup.at_work() || lamps.get(*i).is_some_and(|lamp| lamp.on));
        let values = setup.values();
        for group in info.params.iter().chain(contact::wanted(values).then_some(&contact::GROUP)) {
            upload(gpu, &mut made.params, group, values);
        }

        let mut recorder = Recorder::new(gpu, &mut self.timer, ask.timed, ask.size);
        recorder.rows_at = Some(std::mem::offset_of!(FrameUniform, band) as u64);
        if let Some(ms) = animated_ms {
            recorder.note(ANIMATION, ms);
        }
        if let (Some(pass), Some(shots)) = (self.watched, &self.shots) {
            recorder.watch(pass, shots);
        }
        let scene = &self.scene_gpu;
        know_scene(&mut recorder, scene);
        recorder.set("frame", &self.frame_buffer);
        let view = view::find(&setup.view, info, values);
        let analysed = ask.analysis || view.is_some_and(View::needs_analysis);
        self.analysis.start(gpu, analysed);
        gpu.queue.write_buffer(&self.tally, 0, bytemuck::cast_slice(&[0, 0, analysed as u32, 0]));
        recorder.set("tally", &self.tally);
        for (name, view) in [
            ("g_position", &position),
            ("g_surface", &surface),
            ("visibility_out", &visibility),
            ("visibility", &visibility),
            ("map_out", &map),
            ("map", &map),
            ("output", &output),
        ] {
            recorder.set(name, view);
        }
        for (name, (_, buffer)) in &made.params {
            recorder.set(name, buffer);
        }

        let count = scene.triangle_count * 3;
        // What techniques know of the camera is the frozen one's; what they look up is this picture's.
        let fitted_to = setup.frozen().map(|camera| Setup { camera, shadow_camera: None, ..setup.clone() });
        let shadow = fitted_to.as_ref().map(|to| FrameUniform::new(to, ask.size, scene));
        let frozen = if let Some(uniform) = shadow {
            self.frozen.draw(&mut recorder, &self.gbuffer, &depth, count, self.revision, uniform)
        } else {
            self.frozen = Default::default();
            Vec::new()
        };
        recorder.run(&self.gbuffer).draw(&[&position, &surface], Some((&depth, 0.0)), true, |p| p.draw(0..count, 0..1));
        recorder.freeze(frozen.clone());

        if let Some(count) = &self.analysis.draws {
            recorder.count_draws(count);
        }
        let analysis = analysed.then_some(&mut self.analysis);
        let mut f = Frame {
            recorder,
            camera: fitted_to.as_ref().unwrap_or(setup).camera,
            eye: setup.camera,
            light: setup.light,
            lamp: setup.at_work(),
            lamps: (lamps.iter().enumerate())
                .filter(|(i, lamp)| lamp.on || *i == setup.at_work())
                .map(|(i, lamp)| (i, lamp.light))
                .collect(),
            view: &setup.view,
            values,
            scene,
            geometry: &self.geometry,
            size: ask.size,
            depth,
            seed: setup.seed,
            origin: self.scene.origin,
            revision: self.revision,
            // What is analysed counts what is drawn.
            fresh: ask.fresh || analysed || broken,
            whole_maps: self.whole_maps,
            history: if broken && ask.history == History::Goes { History::Starts } else { ask.history },
            frames: [1, 1],
            notes: Vec::new(),
            counted_notes: Vec::new(),
            offered: None,
            indirect: None,
            splits: None,
            faces: None,
            pieces: None,
            inspected: view.is_some_and(|v| v.source == Source::Technique),
            analysis,
            draw_counts: &self.draw_counts,
            outlines: lines::wanted(setup, &ask).then(Default::default),
        };
        let start = Instant::now();
        let (waited, recorded) = (f.waited(), f.recorded());
        // A light that is off is drawn only where it alone is looked at.
        let idle = setup.idles() && !analysed;
        f.of_light(Some(setup.at_work()));
        if info.refuses(&setup.light).is_none() && !idle {
            made.render(&mut f, setup.at_work())?;
        } else {
            // Without a technique that serves the light the picture has no shadow.
            made.own.remove(&setup.at_work());
            f.run(&self.unshadowed).per_pixel();
        }
        f.of_light(None);
        f.freeze(Vec::new());
        let (offered, indirect) = (f.offered.take(), f.indirect.take());
        self.technique_notes = std::mem::take(&mut f.notes);
        self.counted_notes = std::mem::take(&mut f.counted_notes);
        let (splits, faces, pieces, outlines) = (f.splits.take(), f.faces.take(), f.pieces.take(), f.outlines.take());
        let mut aliasing = None;
        if let Some(analysis) = f.analysis.take() {
            aliasing = analysis.aliasing_view().cloned();
            if let Some(count) = &mut analysis.draws {
                f.keep_draws(count);
            }
        }
        f.fresh = ask.fresh || broken;
        self.lights.draw(&mut f, made, (&frozen, shadow), &self.unshadowed)?;
        told.cpu_ms = start.elapsed().as_secs_f64() * 1e3 - (f.waited() - waited);
        told.passes = f.recorded() - recorded;
        told.lights = made.told();
        told.gpu_bytes = told.lights.iter().map(|l| l.gpu_bytes).sum();
        told.frames = f.frames;
        self.frames = f.frames[0];
        self.sizeless = !setup.light.has_size() && info.filter(values).is_some_and(|f| (f.sized)(values));
        let Frame { mut recorder, .. } = f;
        recorder.set("frame", &self.frame_buffer);
        recorder.set("tally", &self.tally);
        recorder.set("visibility", &visibility);
        recorder.set("visibility_out", &visibility);

        // The truth goes on from where it stood, while nothing that it depends on changes.
        let of = (self.revision, setup.camera, setup.light);
        let samples = setup.truth_samples.shown(&setup.light, info, values);
        let lights = if setup.more_lights.is_empty() { &[setup.light][..] } else { self.lights.all() };
        self.truth.start(of, lights, samples, gpu, &uniform);
        let before = self.truth.progress();
        let mut pixels = if let Truth::Some(pixels) = ask.truth { u64::from(pixels) } else { u64::MAX };
        if ask.truth != Truth::Off && techniques::TRUTH.refuses(&setup.light).is_none() {
            self.truth.record(&mut recorder, &self.gbuffer, count, pixels.min(u32::MAX.into()) as u32);
        }
        told.truth = self.truth.progress();
        told.traced = told.truth.samples - before.samples;
        if ask.truth != Truth::Off && (self.figure.truly_lit || setup.view == "flip") {
            pixels = pixels.saturating_sub(told.traced);
            let of = (self.revision, setup.camera, samples);
            let own = (pixels, told.truth);
            let with = lights::Tracer { truth: &mut self.truth, gbuffer: &self.gbuffer, vertices: count };
            told.truth = self.lights.true_light((of, ask.size), with, &mut recorder, &self.unshadowed, own)?;
            told.traced += self.lights.traced;
        }

        // What only the technique can draw is not there where it does not serve the light.
        self.seen = view.filter(|v| view::index(v.id).is_some() || info.refuses(&setup.light).is_none());
        self.offered = offered;
        self.shading.indirect = indirect;
        (self.light, self.at_work) = (Some(setup.light), setup.at_work());
        self.splits = splits;
        self.faces = faces;
        self.causes = None;
        if ask.picture {
            let truth = Targets::view(self.truth.shown().context(NO_FRAME)?)?;
            recorder.set("truth", truth);
            recorder.set("over", &map);
            recorder.set("others", self.lights.sum(false).unwrap_or(&position));
            // Without another technique the truth is the other one.
            recorder.set("other", self.figure.other().unwrap_or(truth));
            if view.is_some_and(View::is_judged) {
                let start = Instant::now();
                let mut judged = Judged {
                    geometry: &self.geometry,
                    truth: &self.truth,
                    aliasing: aliasing.clone(),
                    targets: &mut *t,
                    classify: &self.classify,
                    lights: &self.lights,
                };
                let (values, causes) = judged.values(setup, &mut recorder, &mut self.shading)?;
                gpu.write_texture(t.map.texture().context(NO_FRAME)?, bytemuck::cast_slice(&values));
                self.causes = causes;
                recorder.note(JUDGED, start.elapsed().as_secs_f64() * 1e3);
            }
            let drawn = self.seen.map_or(Drawn::Common(Legend::None), |v| v.drawn);
            let (layer, rows) = (self.figure.layer, self.figure.rows(setup, &self.truth));
            let picture = Drawing { layer, rows, ..Drawing::new(setup, uniform.view, drawn) };
            self.shading.record(&mut recorder, picture, &map, (self.offered.as_ref(), aliasing.as_ref()))?;
            self.lines.take(gpu, outlines, setup, scene.bounds, ask.size)?;
            if layer == Layer::Alone {
                self.lines.draw(&mut recorder, &setup.view, &drawn, false, &[], &output);
            }
        }
        let finished = recorder.finish().and_then(|()| gpu.check());
        if finished.is_err() && told.truth != before {
            self.truth.forget();
        }
        finished?;
        self.frozen.finished();
        self.analysis.pieces = pieces;
        self.broken = false;
        Ok(told)
    }

    /// Moves the animated geometry to the set-up's clock; the milliseconds that took, if it moved.
    fn advance(&mut self, setup: &Setup) -> Result<Option<f64>> {
        let clock = (setup.animation, setup.time);
        if self.clock == clock || self.scene.animations.is_empty() {
            return Ok(None);
        }
        let start = Instant::now();
        self.geometry = Geometry::new(&self.scene, setup.animation as usize, setup.time)?;
        self.scene_gpu.update(&self.gpu, &self.scene, &self.geometry);
        self.clock = clock;
        self.revision += 1;
        Ok(Some(start.elapsed().as_secs_f64() * 1e3))
    }

    /// Swaps the technique in use for one kept aside, so that several can take turns without being made anew.
    pub fn exchange(&mut self, kept: &mut Option<Made>) {
        std::mem::swap(&mut self.made, kept);
    }

    /// The picture of the last frame, sRGB-encoded.
    pub fn output(&self) -> Option<&wgpu::Texture> {
        self.figure.texture().or(self.targets.output.texture())
    }

    /// Traces some more of the truth, as many pixels' samples as given, and draws nothing else; how far it is then. The
    /// last frame must have asked for the truth.
    pub fn trace(&mut self, pixels: u32) -> Result<Progress> {
        let (gpu, t, size) = (&*self.gpu, &self.targets, self.targets.size()?);
        let mut recorder = Recorder::new(gpu, &mut self.timer, true, size);
        know_scene(&mut recorder, &self.scene_gpu);
        recorder.set("g_position", Targets::view(&t.position)?);
        recorder.set("g_surface", Targets::view(&t.surface)?);
        let (before, count) = (self.truth.progress(), self.scene_gpu.triangle_count * 3);
        self.truth.record(&mut recorder, &self.gbuffer, count, pixels);
        let own = self.truth.progress();
        let left = u64::from(pixels).saturating_sub(own.samples - before.samples);
        let with = lights::Tracer { truth: &mut self.truth, gbuffer: &self.gbuffer, vertices: count };
        let progress = self.lights.trace_on(with, &mut recorder, left, own);
        let finished = recorder.finish().and_then(|()| gpu.check());
        if finished.is_err() {
            self.truth.forget();
        }
        finished?;
        Ok(progress)
    }

    /// Draws the last frame's picture again: with as much of the truth as there is by now, and in the view of `setup`, which is
    /// the last frame's but for this. A technique's own map must be that of the last frame; of a comparison only the
    /// arrangement may change. Where it shows all lights the last frame must have drawn them.
    pub fn redraw(&mut self, setup: &Setup) -> Result<()> {
        if !setup.against.is_empty() {
            return self.compose(setup);
        }
        let info = techniques::find_or_say(&setup.technique)?;
        let uniform = FrameUniform::new(setup, self.targets.size()?, &self.scene_gpu);
        self.gpu.queue.write_buffer(&self.frame_buffer, 0, bytemuck::bytes_of(&uniform));
        self.seen = view::find(&setup.view, info, setup.values());
        let drawn = self.seen.map_or(Drawn::Common(Legend::None), |v| v.drawn);
        let rows = self.figure.rows(setup, &self.truth);
        self.shade_again(Drawing { rows, ..Drawing::new(setup, uniform.view, drawn) }, false)
    }

    /// Takes in the pass times that have arrived; with `wait`, all of them.
    pub fn collect_times(&mut self, wait: bool) -> Result<()> {
        self.timer.collect(&self.gpu, wait)
    }
}

/// A buffer for `Tally` in `shaders/lib/trace.wgsl`.
pub(crate) fn tally(gpu: &Gpu, label: &str) -> Buffer {
    gpu.buffer(label, &[0; 16], wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC)
}

/// Makes the scene's buffers and textures known under the shaders' names.
fn know_scene(recorder: &mut Recorder, scene: &SceneGpu) {
    let tables = [
        ("vertices", &scene.records),
        ("triangles", &scene.triangles),
        ("nodes", &scene.nodes),
        ("corners", &scene.corners),
    ];
    for (name, table) in tables {
        recorder.set(name, table.view());
    }
    recorder.set("materials", &scene.materials);
    let [textures, large_textures] = &scene.textures;
    recorder.set("textures", textures);
    recorder.set("large_textures", large_textures);
    recorder.set("texture_sampler", &scene.sampler);
}

fn upload(gpu: &Gpu, held: &mut HashMap<&'static str, (Vec<u32>, Buffer)>, group: &Group, values: &Values) {
    let words = group.words(values);
    match held.get_mut(group.name) {
        Some((old, _)) if *old == words => {}
        Some((old, buffer)) => {
            gpu.queue.write_buffer(buffer, 0, bytemuck::cast_slice(&words));
            *old = words;
        }
        None => {
            let buffer = gpu.buffer(group.name, bytemuck::cast_slice(&words), wgpu::BufferUsages::UNIFORM);
            held.insert(group.name, (words, buffer));
        }
    }
}
