//! Passes: a pipeline whose resources are bound by their WGSL names, recorded and timed.

use super::shader::{Binding, Key, Loaded};
use super::timer::{DrawCount, MAX_DRAWS, Pending, Sent, Timer, TimerMode};
use super::{GivenUp, Gpu, Traffic, locked, traffic};
use crate::params::Group;
use anyhow::{Context, Result};
use std::cell::RefCell;
use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// Anything a shader can bind.
#[derive(Clone, Debug, PartialEq)]
pub enum Resource {
    Buffer(wgpu::Buffer),
    Texture(wgpu::TextureView),
    Sampler(wgpu::Sampler),
}

impl Resource {
    fn as_binding(&self) -> wgpu::BindingResource<'_> {
        match self {
            Resource::Buffer(b) => b.as_entire_binding(),
            Resource::Texture(t) => wgpu::BindingResource::TextureView(t),
            Resource::Sampler(s) => wgpu::BindingResource::Sampler(s),
        }
    }
}

impl From<&super::Buffer> for Resource {
    fn from(b: &super::Buffer) -> Self {
        Resource::Buffer((**b).clone())
    }
}
impl From<&wgpu::TextureView> for Resource {
    fn from(t: &wgpu::TextureView) -> Self {
        Resource::Texture(t.clone())
    }
}
impl From<&wgpu::Sampler> for Resource {
    fn from(s: &wgpu::Sampler) -> Self {
        Resource::Sampler(s.clone())
    }
}

#[derive(Clone)]
enum Pipeline {
    Compute(wgpu::ComputePipeline),
    Render(wgpu::RenderPipeline),
}

/// A pipeline and what it binds.
#[derive(Clone)]
struct Made {
    pipeline: Pipeline,
    layout: wgpu::BindGroupLayout,
    bindings: Arc<[Binding]>,
    /// Threads of a workgroup.
    group: u64,
}

/// Pipelines made so far, for passes that come again: another light's, another side's, those of a technique gone back to.
#[derive(Default)]
pub struct Pipelines {
    /// By shader, and by entry points with all else that they depend on; each with when it was asked for last.
    made: HashMap<(Key, String), (u64, Made)>,
    asked: u64,
}

/// Most pipelines that are kept; beyond, the one that was not asked for longest goes. A technique has up to some thirty. A software
/// adapter compiles each once more for every kind of texture that it meets, and keeps all of that: some ten MiB a pipeline.
const MOST_PIPELINES: usize = 512;
const MOST_ON_SOFTWARE: usize = 128;

/// A pipeline with what it binds. Bind groups are kept while their resources come back.
pub struct Pass {
    name: &'static str,
    made: Made,
    /// It looks maps up for the pixels of the picture, and so keeps out of [`Recorder::freeze`].
    looks_up: bool,
    bound: RefCell<Bound>,
}

/// The entry points that look maps up for the picture, or draw into it, whatever technique they belong to.
const LOOK_UPS: [&str; 6] = ["resolve", "accumulate", "inspect", "analyse", "draw_counts", "draw_curve"];

/// The bind groups that a pass used in the last two frames in which it ran: older ones would hold memory that nobody needs.
#[derive(Default)]
struct Bound {
    frame: u64,
    sets: Vec<Set>,
}

struct Set {
    /// When it was used last.
    frame: u64,
    resources: Vec<Resource>,
    group: wgpu::BindGroup,
}

/// What a render pipeline needs beside its shader.
#[derive(Clone, Debug, Default)]
pub struct Raster<'a> {
    pub vertex: &'a str,
    /// None: depth only.
    pub fragment: Option<&'a str>,
    pub targets: &'a [wgpu::TextureFormat],
    pub depth: Option<wgpu::DepthStencilState>,
    pub cull: Option<wgpu::Face>,
    /// What the vertex shader is handed; without one it pulls its geometry from storage buffers.
    pub vertices: Option<wgpu::VertexBufferLayout<'a>>,
    /// Triangles unless said otherwise.
    pub topology: wgpu::PrimitiveTopology,
    /// Depth beyond the near and far planes is clamped to them, not clipped; needs `DEPTH_CLIP_CONTROL`.
    pub unclipped_depth: bool,
    /// How colours mix with what is there; None: they replace it.
    pub blend: Option<wgpu::BlendState>,
}

impl Raster<'_> {
    /// Depth of which the greatest stays: the nearest, as depth is reversed.
    pub fn nearest(format: wgpu::TextureFormat) -> Option<wgpu::DepthStencilState> {
        Some(wgpu::DepthStencilState {
            format,
            depth_write_enabled: Some(true),
            depth_compare: Some(wgpu::CompareFunction::Greater),
            stencil: Default::default(),
            bias: Default::default(),
        })
    }

    /// The faces that a technique's parameter `cull` leaves out: `front`, `back`, or none.
    pub fn culled(cull: &str) -> Option<wgpu::Face> {
        match cull {
            "front" => Some(wgpu::Face::Front),
            "back" => Some(wgpu::Face::Back),
            _ => None,
        }
    }
}

impl Pass {
    /// A compute pass from a shader's entry point. `groups` are the parameter structs the shader uses.
    pub fn compute(gpu: &Gpu, name: &'static str, file: &str, entry: &str, groups: &[Group]) -> Result<Pass> {
        Pass::specialised(gpu, name, file, entry, groups, &[])
    }

    /// As [`Pass::compute`], with values for the shader's `override` constants.
    pub fn specialised(
        gpu: &Gpu,
        name: &'static str,
        file: &str,
        entry: &str,
        groups: &[Group],
        constants: &[(&str, f64)],
    ) -> Result<Pass> {
        let made = made(gpu, (file, groups), format!("{entry} {constants:?}"), &[entry], |shader, layout| {
            Pipeline::Compute(gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(name),
                layout: Some(layout),
                module: &shader.on_device,
                entry_point: Some(entry),
                compilation_options: wgpu::PipelineCompilationOptions { constants, ..Default::default() },
                cache: None,
            }))
        })?;
        Ok(Pass { name, made, looks_up: LOOK_UPS.contains(&entry), bound: RefCell::default() })
    }

    /// A render pass.
    pub fn render(gpu: &Gpu, name: &'static str, file: &str, raster: Raster, groups: &[Group]) -> Result<Pass> {
        let entries: Vec<&str> = [Some(raster.vertex), raster.fragment].into_iter().flatten().collect();
        let made = made(gpu, (file, groups), format!("{raster:?}"), &entries, |shader, layout| {
            let buffers: Vec<_> = raster.vertices.iter().cloned().map(Some).collect();
            let target =
                |format| wgpu::ColorTargetState { blend: raster.blend, ..wgpu::ColorTargetState::from(format) };
            let targets: Vec<_> = raster.targets.iter().map(|f| Some(target(*f))).collect();
            Pipeline::Render(gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
                label: Some(name),
                layout: Some(layout),
                vertex: wgpu::VertexState {
                    module: &shader.on_device,
                    entry_point: Some(raster.vertex),
                    compilation_options: Default::default(),
                    buffers: &buffers,
                },
                primitive: wgpu::PrimitiveState {
                    topology: raster.topology,
                    cull_mode: raster.cull,
                    unclipped_depth: raster.unclipped_depth,
                    ..Default::default()
                },
                depth_stencil: raster.depth.clone(),
                multisample: Default::default(),
                fragment: raster.fragment.map(|entry| wgpu::FragmentState {
                    module: &shader.on_device,
                    entry_point: Some(entry),
                    compilation_options: Default::default(),
                    targets: &targets,
                }),
                multiview_mask: None,
                cache: None,
            }))
        })?;
        Ok(Pass { name, made, looks_up: false, bound: RefCell::default() })
    }

    /// Lets go of all that it bound so far.
    pub fn forget(&self) {
        self.bound.borrow_mut().sets.clear();
    }

    /// Whether these resources are all that it binds.
    pub fn needs_only(&self, known: &[(&'static str, Resource)]) -> bool {
        let known = |name: &str| known.iter().any(|(n, _)| *n == name);
        self.made.bindings.iter().all(|b| known(&b.name) || known(&b.type_name))
    }

    /// Makes the bind group, or takes that of a call before with the same resources.
    fn bind(&self, gpu: &Gpu, frame: u64, find: impl Fn(&Binding) -> Option<Resource>) -> Result<wgpu::BindGroup> {
        let mut resources = Vec::with_capacity(self.made.bindings.len());
        for b in self.made.bindings.iter() {
            resources.push(find(b).with_context(|| format!("pass {}: nothing is bound to {}", self.name, b.name))?);
        }
        let mut bound = self.bound.borrow_mut();
        if bound.frame != frame {
            let before = std::mem::replace(&mut bound.frame, frame);
            bound.sets.retain(|s| s.frame >= before);
        }
        if let Some(set) = bound.sets.iter_mut().find(|s| s.resources == resources) {
            set.frame = frame;
            return Ok(set.group.clone());
        }
        let entry = |(b, r): (&Binding, _)| wgpu::BindGroupEntry { binding: b.entry.binding, resource: r };
        let entries: Vec<_> =
            self.made.bindings.iter().zip(resources.iter().map(Resource::as_binding)).map(entry).collect();
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some(self.name),
            layout: &self.made.layout,
            entries: &entries,
        });
        bound.sets.push(Set { frame, resources, group: group.clone() });
        Ok(group)
    }
}

/// A pipeline as it was made before, or made by `make`. `what`: all that it depends on beside the shader.
fn made(
    gpu: &Gpu,
    (file, groups): (&str, &[Group]),
    what: String,
    entries: &[&str],
    make: impl FnOnce(&Loaded, &wgpu::PipelineLayout) -> Pipeline,
) -> Result<Made> {
    let key = (gpu.shader_key(file, groups), what);
    {
        let mut held = locked(&gpu.pipelines);
        held.asked += 1;
        let now = held.asked;
        if let Some((asked, made)) = held.made.get_mut(&key) {
            *asked = now;
            return Ok(made.clone());
        }
    }
    // What the driver makes of a shader is the pass's own trouble, and nobody else's.
    let validation = gpu.device.push_error_scope(wgpu::ErrorFilter::Validation);
    let internal = gpu.device.push_error_scope(wgpu::ErrorFilter::Internal);
    let tried = gpu.shader(file, groups).and_then(|shader| {
        let bindings = shader.program.bindings(entries).with_context(|| file.to_string())?;
        let all: Vec<_> = bindings.iter().map(|b| b.entry).collect();
        let descriptor = wgpu::BindGroupLayoutDescriptor { label: Some(file), entries: &all };
        let layout = gpu.device.create_bind_group_layout(&descriptor);
        let pipeline_layout = gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(file),
            bind_group_layouts: &[Some(&layout)],
            immediate_size: 0,
        });
        let group = shader.program.group(entries[0]);
        Ok(Made { pipeline: make(&shader, &pipeline_layout), layout, bindings: bindings.into(), group })
    });
    let [internal, validation] = [internal, validation].map(|scope| pollster::block_on(scope.pop()));
    let made = tried?;
    if let Some(error) = internal.or(validation) {
        *locked(&gpu.loaded) = None;
        let (file, entry) = (file.into(), entries.join(" and "));
        return Err(Unfit { file, entry, adapter: gpu.info.name.clone(), why: error.to_string() }.into());
    }
    let mut held = locked(&gpu.pipelines);
    let most = if gpu.software() { MOST_ON_SOFTWARE } else { MOST_PIPELINES };
    if held.made.len() >= most {
        let oldest = held.made.iter().min_by_key(|(_, (asked, _))| *asked).map(|(key, _)| key.clone());
        oldest.and_then(|key| held.made.remove(&key));
    }
    let now = held.asked;
    held.made.insert(key, (now, made.clone()));
    Ok(made)
}

/// A shader that is right, but of which the driver makes no pipeline.
#[derive(Debug)]
pub struct Unfit {
    file: String,
    entry: String,
    adapter: String,
    why: String,
}

impl std::fmt::Display for Unfit {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        let Unfit { file, entry, adapter, why } = self;
        write!(f, "{adapter} cannot run {entry} of {file}: {}", why.split_whitespace().collect::<Vec<_>>().join(" "))
    }
}

impl std::error::Error for Unfit {}

/// Clears of buffers are timed under this name.
const CLEARS: &str = "clears";

/// What looks at the textures that a pass writes.
pub trait Watch {
    fn wrote(&self, recorder: &mut Recorder, texture: &wgpu::Texture);
}

/// Records passes into command buffers and times them.
pub struct Recorder<'a> {
    pub gpu: &'a Gpu,
    /// Counts the recorders.
    frame: u64,
    resources: HashMap<&'static str, Resource>,
    /// What passes that make maps find under these names instead.
    frozen: Vec<(&'static str, Resource)>,
    /// A pass, and what looks at the texture that it writes; that texture, until all is drawn into it.
    watched: Option<(&'static str, &'a dyn Watch)>,
    written: Option<wgpu::Texture>,
    encoder: wgpu::CommandEncoder,
    timer: &'a mut Timer,
    timed: bool,
    /// The light that the passes are recorded for, where they are one light's.
    light: Option<usize>,
    /// What [`Run::per_pixel`] covers.
    pixels: [u32; 2],
    /// Where render passes count what they draw, and what each of them counts as.
    draws: Option<Counting>,
    /// Passes recorded so far.
    recorded: u32,
    /// Work recorded since the last submission, as [`Gpu::longest`] has it.
    work: u64,
    /// Where the uniform `frame` says which rows a pass covers, bytes from its start: the first, and how many.
    pub rows_at: Option<u64>,
    error: Option<anyhow::Error>,
}

impl<'a> Recorder<'a> {
    pub fn new(gpu: &'a Gpu, timer: &'a mut Timer, timed: bool, pixels: [u32; 2]) -> Recorder<'a> {
        timer.names.clear();
        timer.lights.clear();
        timer.wall.clear();
        timer.noted.clear();
        let encoder = gpu.device.create_command_encoder(&Default::default());
        let frame = gpu.frames.fetch_add(1, Ordering::Relaxed) + 1;
        let resources = gpu.traffic.iter().map(|counts| (traffic::NAME, counts.into())).collect();
        let frozen = Vec::new();
        let (watched, written) = (None, None);
        let (draws, recorded, error) = (None, 0, None);
        Recorder {
            gpu,
            frame,
            resources,
            frozen,
            watched,
            written,
            encoder,
            timer,
            timed,
            light: None,
            pixels,
            draws,
            recorded,
            work: 0,
            rows_at: None,
            error,
        }
    }

    /// Makes a resource known to all passes that follow, by its WGSL name or its parameter group's name; what was known by it
    /// before.
    pub fn set(&mut self, name: &'static str, resource: impl Into<Resource>) -> Option<Resource> {
        self.resources.insert(name, resource.into())
    }

    /// All that is known by a name.
    pub fn known(&self) -> Vec<(&'static str, Resource)> {
        self.resources.iter().map(|(name, resource)| (*name, resource.clone())).collect()
    }

    /// Lets the passes that follow find other resources under these names, but for those that look maps up for the picture.
    pub fn freeze(&mut self, resources: Vec<(&'static str, Resource)>) {
        self.frozen = resources;
    }

    /// Has the texture looked at that passes of this name write last, once the passes that follow draw into others.
    pub fn watch(&mut self, pass: &'static str, by: &'a dyn Watch) {
        self.watched = Some((pass, by));
    }

    /// Tells for which light, by its place among all, the passes that follow are recorded: [`Timer::of_light`].
    pub fn of_light(&mut self, light: Option<usize>) {
        self.light = light;
    }

    /// Has nothing looked at from here on; what was to be looked at, for [`Recorder::look_again`].
    pub fn look_away(&mut self) -> Option<(&'static str, &'a dyn Watch)> {
        self.look();
        self.watched.take()
    }

    /// Has again looked at what was before.
    pub fn look_again(&mut self, watched: Option<(&'static str, &'a dyn Watch)>) {
        self.watched = watched;
    }

    fn look(&mut self) {
        let Some(texture) = self.written.take() else { return };
        // What looks runs passes of its own.
        if let Some((pass, by)) = self.watched.take() {
            by.wrote(self, &texture);
            self.watched = Some((pass, by));
        }
    }

    /// Starts a pass.
    pub fn run<'r>(&'r mut self, pass: &'r Pass) -> Run<'r, 'a> {
        Run {
            recorder: self,
            pass,
            name: pass.name,
            extra: Vec::new(),
            counted: Some(Sent::Triangles),
            layer: None,
            of_picture: pass.looks_up,
            stencil: None,
            traffic: Traffic::default(),
            cost: None,
        }
    }

    /// Submits what is recorded so far: what is written into buffers from here on holds for what follows.
    pub fn submit(&mut self) {
        self.work = 0;
        let encoder = self.gpu.device.create_command_encoder(&Default::default());
        let recorded = std::mem::replace(&mut self.encoder, encoder);
        self.gpu.queue.submit([recorded.finish()]);
    }

    /// Adds work on the CPU to the frame's times.
    pub fn note(&mut self, name: &'static str, ms: f64) {
        self.timer.noted.push((name, ms));
    }

    /// Zeroes a buffer. Timestamps tell the time as that of `clears`; by wall clock it is part of the next pass's.
    pub fn clear(&mut self, buffer: &wgpu::Buffer) {
        self.clear_part(buffer, 0, None);
    }

    /// Clears `size` bytes of a buffer from `offset` on, both multiples of 4.
    pub fn clear_range(&mut self, buffer: &wgpu::Buffer, offset: u64, size: u64) {
        self.clear_part(buffer, offset, Some(size));
    }

    fn clear_part(&mut self, buffer: &wgpu::Buffer, offset: u64, size: Option<u64>) {
        let stamped = self.timed && self.timer.mode == TimerMode::Stamps;
        let stamps = stamped.then(|| self.timer.stamps(self.gpu));
        // Where encoders write no timestamps, passes of nothing do.
        let stamp = |encoder: &mut wgpu::CommandEncoder, end: u32| {
            let Some((query_set, at)) = &stamps else { return };
            encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
                label: Some(CLEARS),
                timestamp_writes: Some(wgpu::ComputePassTimestampWrites {
                    query_set,
                    beginning_of_pass_write_index: (end == 0).then_some(*at),
                    end_of_pass_write_index: (end == 1).then_some(at + 1),
                }),
            });
        };
        stamp(&mut self.encoder, 0);
        self.encoder.clear_buffer(buffer, offset, size);
        stamp(&mut self.encoder, 1);
        if stamped {
            self.timer.names.push(CLEARS);
            self.timer.lights.push(self.light);
        }
    }

    /// Copies `size` bytes from `offset` on to the start of another buffer.
    pub fn copy(&mut self, from: &wgpu::Buffer, offset: u64, to: &wgpu::Buffer, size: u64) {
        self.encoder.copy_buffer_to_buffer(from, offset, to, 0, size);
    }

    /// Copies `size` bytes from the start of a buffer to `offset` of another.
    pub fn copy_to(&mut self, from: &wgpu::Buffer, to: &wgpu::Buffer, offset: u64, size: u64) {
        self.encoder.copy_buffer_to_buffer(from, 0, to, offset, size);
    }

    /// Counts what the render passes from here on draw.
    pub fn count_draws(&mut self, count: &DrawCount) {
        self.draws = Some(Counting { queries: count.queries.clone(), layers: Vec::new(), draws: Vec::new() });
    }

    /// Counts no further, and keeps what was counted.
    pub fn keep_draws(&mut self, count: &mut DrawCount) {
        count.draws = self.draws.take().map_or(Vec::new(), |counting| counting.draws);
        let draws = count.draws.len() as u32;
        if (1..=MAX_DRAWS).contains(&draws) {
            self.encoder.resolve_query_set(&count.queries, 0..draws, &count.resolved, 0);
        }
    }

    /// Workgroups of 8 × 8 threads that cover the picture.
    pub fn pixel_groups(&self) -> [u32; 2] {
        self.pixels.map(|side| side.div_ceil(8))
    }

    /// Passes recorded so far.
    pub fn recorded(&self) -> u32 {
        self.recorded
    }

    /// Whether each pass is waited for, so that a frame can be given up between two of them.
    pub fn waits(&self) -> bool {
        self.timer.mode == TimerMode::Wall
    }

    /// Whether something went wrong, and nothing more is recorded.
    pub fn failed(&self) -> bool {
        self.error.is_some()
    }

    /// Milliseconds spent so far in waiting for passes (wall-clock timing only).
    pub fn waited(&self) -> f64 {
        self.timer.wall.iter().sum()
    }

    /// Submits what is recorded. Times arrive in [`Timer::latest`], at once if measured by wall clock.
    pub fn finish(mut self) -> Result<()> {
        self.look();
        if let Some(error) = self.error {
            return Err(error);
        }
        let timer = self.timer;
        match timer.mode {
            TimerMode::Stamps if self.timed && !timer.names.is_empty() => {
                let staging = timer.resolve(self.gpu, &mut self.encoder);
                self.gpu.queue.submit([self.encoder.finish()]);
                let ready = Arc::new(AtomicBool::new(false));
                let flag = ready.clone();
                staging.map_async(wgpu::MapMode::Read, .., move |r| flag.store(r.is_ok(), Ordering::Release));
                timer.pending.push(Pending {
                    staging,
                    names: std::mem::take(&mut timer.names),
                    lights: std::mem::take(&mut timer.lights),
                    noted: std::mem::take(&mut timer.noted),
                    ready,
                });
            }
            _ => {
                self.gpu.queue.submit([self.encoder.finish()]);
                if self.timed && timer.mode == TimerMode::Wall {
                    timer.latest = std::mem::take(&mut timer.noted);
                    timer.latest.extend(timer.names.iter().copied().zip(timer.wall.iter().copied()));
                    timer.latest_lights = std::mem::take(&mut timer.lights);
                }
            }
        }
        Ok(())
    }
}

/// What is counted of a frame's draws.
struct Counting {
    queries: wgpu::QuerySet,
    /// The depth layers drawn into.
    layers: Vec<wgpu::TextureView>,
    /// Of each draw what it sends, and the number of its layer.
    draws: Vec<(Sent, Option<usize>)>,
}

/// Threads of so many workgroups.
fn threads(groups: &[u32], pass: &Pass) -> u64 {
    groups.iter().map(|n| u64::from(*n)).product::<u64>() * pass.made.group
}

/// One pass being put together.
pub struct Run<'r, 'a> {
    recorder: &'r mut Recorder<'a>,
    pass: &'r Pass,
    name: &'static str,
    extra: Vec<(&'static str, Resource)>,
    counted: Option<Sent>,
    /// The layer that a draw counts for; None: the one that it draws into.
    layer: Option<wgpu::TextureView>,
    /// It works on the picture, wherever the shadow camera is.
    of_picture: bool,
    /// What the stencil starts with, where it is kept.
    stencil: Option<wgpu::LoadOp<u32>>,
    /// What is known of what it moves before it binds anything: its threads, and what a draw clears.
    traffic: Traffic,
    /// How long it takes for a pixel, in full-screen passes, where it may be cut into bands of rows.
    cost: Option<u32>,
}

impl Run<'_, '_> {
    /// Keeps a draw that sends no triangles of the scene out of the count.
    pub fn uncounted(mut self) -> Self {
        self.counted = None;
        self
    }

    /// Keeps a draw that sends points in place of the scene's triangles out of the count of these. Its layer counts.
    pub fn points(mut self) -> Self {
        self.counted = Some(Sent::Points);
        self
    }

    /// Counts a draw for another layer than its own: it adds to what that one holds.
    pub fn for_layer(mut self, layer: &wgpu::TextureView) -> Self {
        self.layer = Some(layer.clone());
        self
    }

    /// Hands it the picture's G-buffer and camera, also where maps are fitted to another one ([`Recorder::freeze`]). The depth
    /// that it draws into is then no layer of a map.
    pub fn of_picture(mut self) -> Self {
        self.of_picture = true;
        self
    }

    /// Clears the depth view's stencil to 0 and keeps what the draws leave there.
    pub fn counting_in_stencil(mut self) -> Self {
        self.stencil = Some(wgpu::LoadOp::Clear(0));
        self
    }

    /// Goes on from what the draws before left in the depth view's stencil, and keeps it.
    pub fn counting_on_in_stencil(mut self) -> Self {
        self.stencil = Some(wgpu::LoadOp::Load);
        self
    }

    /// Submits it in bands of rows where it may take too long for a GPU's watchdog ([`Gpu::longest`]); `cost`: how often as long as a
    /// plain full-screen pass it may take. Of [`Run::per_pixel`] the shader takes its pixel from `banded`.
    pub fn in_bands(mut self, cost: u32) -> Self {
        self.cost = Some(cost);
        self
    }

    /// The picture's rows that each submission covers: the first, and how many, whole workgroups. Empty or of one: it needs no bands.
    fn bands(&self) -> Vec<[u32; 2]> {
        let [width, height] = self.recorder.pixels;
        let cost = u64::from(self.cost.unwrap_or_default()) * u64::from(width);
        let most = self.recorder.gpu.longest.checked_div(cost).unwrap_or(u64::MAX) / 8 * 8;
        // What is counted is drawn at once.
        if most >= height.into() || self.recorder.draws.is_some() {
            return Vec::new();
        }
        let most = most.max(8) as u32;
        (0..height).step_by(most as usize).map(|first| [first, most.min(height - first)]).collect()
    }

    /// Times it under another name than the pass's own.
    pub fn named(mut self, name: &'static str) -> Self {
        self.name = name;
        self
    }

    /// Binds a resource to the WGSL name `name`, for this pass only; the last one of a name counts.
    pub fn bind(mut self, name: &'static str, resource: impl Into<Resource>) -> Self {
        self.extra.push((name, resource.into()));
        self
    }

    /// Binds several at once.
    pub fn bind_all(mut self, bound: &[(&'static str, Resource)]) -> Self {
        self.extra.extend_from_slice(bound);
        self
    }

    /// Runs a compute pass with a thread per pixel, in workgroups of 8 × 8.
    pub fn per_pixel(mut self) {
        let [w, h] = self.recorder.pixel_groups();
        let bands = self.bands();
        let (Some(at), 2..) = (self.recorder.rows_at, bands.len()) else { return self.dispatch(w, h, 1) };
        let frame = self.pass.made.bindings.iter().find(|b| b.name == "frame").and_then(|b| self.find(b));
        let Some(Resource::Buffer(frame)) = frame else { return self.dispatch(w, h, 1) };
        let gpu = self.recorder.gpu;
        for [first, rows] in bands {
            self.recorder.submit();
            gpu.queue.write_buffer(&frame, at, bytemuck::bytes_of(&[first, rows]));
            self.groups([w, rows.div_ceil(8), 1]);
        }
        self.recorder.submit();
        gpu.queue.write_buffer(&frame, at, bytemuck::bytes_of(&[0, self.recorder.pixels[1]]));
    }

    /// Runs a compute pass of that many workgroups.
    pub fn dispatch(mut self, x: u32, y: u32, z: u32) {
        self.groups([x, y, z]);
    }

    fn groups(&mut self, count: [u32; 3]) {
        self.traffic.threads = threads(&count, self.pass);
        let [x, y, z] = count;
        self.compute(|p| p.dispatch_workgroups(x, y, z));
    }

    /// Runs a compute pass of as many workgroups as the buffer says from the byte `at` on: x, y and z.
    pub fn dispatch_indirect(mut self, arguments: &wgpu::Buffer, at: u64) {
        if self.recorder.timer.traffic.is_some() && self.recorder.waits() {
            // What is recorded so far may write them.
            self.recorder.submit();
            match self.recorder.gpu.read_range(arguments, at, 12) {
                Ok(groups) => self.traffic.threads = threads(bytemuck::cast_slice(&groups), self.pass),
                Err(e) => self.recorder.error = self.recorder.error.take().or(Some(e)),
            }
        }
        self.compute(|p| p.dispatch_workgroups_indirect(arguments, at));
    }

    fn compute(&mut self, dispatch: impl FnOnce(&mut wgpu::ComputePass)) {
        self.record(None, |encoder, pass, group, first| {
            let Pipeline::Compute(pipeline) = &pass.made.pipeline else { return };
            let mut p = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
                label: Some(pass.name),
                timestamp_writes: first.map(|(query_set, i)| wgpu::ComputePassTimestampWrites {
                    query_set,
                    beginning_of_pass_write_index: Some(i),
                    end_of_pass_write_index: Some(i + 1),
                }),
            });
            p.set_pipeline(pipeline);
            p.set_bind_group(0, group, &[]);
            dispatch(&mut p);
        });
    }

    /// Runs a render pass onto the colour views (cleared to zero) and the depth view (cleared to the
    /// given value, or kept). `draw` issues the draws.
    pub fn draw(
        mut self,
        colors: &[&wgpu::TextureView],
        depth: Option<(&wgpu::TextureView, f32)>,
        clear: bool,
        draw: impl Fn(&mut wgpu::RenderPass),
    ) {
        let bands = self.bands();
        if bands.len() < 2 {
            return self.draw_band(colors, depth, clear, draw);
        }
        let width = self.recorder.pixels[0];
        for (i, [first, rows]) in bands.into_iter().enumerate() {
            self.recorder.submit();
            if i > 0 {
                self.stencil = self.stencil.map(|_| wgpu::LoadOp::Load);
            }
            self.draw_band(colors, depth, clear && i == 0, |p| {
                p.set_scissor_rect(0, first, width, rows);
                draw(p);
            });
        }
        self.recorder.submit();
    }

    fn draw_band(
        &mut self,
        colors: &[&wgpu::TextureView],
        depth: Option<(&wgpu::TextureView, f32)>,
        clear: bool,
        draw: impl FnOnce(&mut wgpu::RenderPass),
    ) {
        let layer = self.layer.as_ref().or(depth.map(|d| d.0).filter(|_| !self.of_picture));
        let stencil = self.stencil;
        let query = self.recorder.draws.as_mut().zip(self.counted).and_then(|(counting, sent)| {
            let layers = &mut counting.layers;
            let layer = layer.map(|view| {
                layers.iter().position(|l| l == view).unwrap_or_else(|| {
                    layers.push(view.clone());
                    layers.len() - 1
                })
            });
            counting.draws.push((sent, layer));
            let draws = counting.draws.len() as u32;
            (draws <= MAX_DRAWS).then(|| (counting.queries.clone(), draws - 1))
        });
        self.traffic = Traffic::default();
        if clear {
            self.traffic = Traffic::cleared(colors.iter().copied().chain(depth.map(|d| d.0)));
        }
        let load = |value| if clear { wgpu::LoadOp::Clear(value) } else { wgpu::LoadOp::Load };
        let wrote = colors.first().copied().or(depth.map(|d| d.0)).cloned();
        self.record(wrote, |encoder, pass, group, first| {
            let Pipeline::Render(pipeline) = &pass.made.pipeline else { return };
            let attachments: Vec<_> = colors
                .iter()
                .map(|view| {
                    Some(wgpu::RenderPassColorAttachment {
                        view,
                        depth_slice: None,
                        resolve_target: None,
                        ops: wgpu::Operations {
                            load: if clear {
                                wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT)
                            } else {
                                wgpu::LoadOp::Load
                            },
                            store: wgpu::StoreOp::Store,
                        },
                    })
                })
                .collect();
            let mut p = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some(pass.name),
                color_attachments: &attachments,
                depth_stencil_attachment: depth.map(|(view, value)| wgpu::RenderPassDepthStencilAttachment {
                    view,
                    depth_ops: Some(wgpu::Operations { load: load(value), store: wgpu::StoreOp::Store }),
                    stencil_ops: stencil.map(|load| wgpu::Operations { load, store: wgpu::StoreOp::Store }),
                }),
                timestamp_writes: first.map(|(query_set, i)| wgpu::RenderPassTimestampWrites {
                    query_set,
                    beginning_of_pass_write_index: Some(i),
                    end_of_pass_write_index: Some(i + 1),
                }),
                occlusion_query_set: None,
                multiview_mask: None,
            });
            p.set_pipeline(pipeline);
            p.set_bind_group(0, group, &[]);
            if let Some((set, i)) = &query {
                p.begin_pipeline_statistics_query(set, *i);
            }
            draw(&mut p);
            if query.is_some() {
                p.end_pipeline_statistics_query();
            }
        });
    }

    /// What a binding is bound to.
    fn find(&self, b: &Binding) -> Option<Resource> {
        let recorder = &self.recorder;
        let own = self.extra.iter().rev().find(|(n, _)| *n == b.name).map(|(_, r)| r);
        // A parameter group is known by its type, whatever the shader calls it.
        let group = recorder.resources.get(b.type_name.as_str());
        let frozen = recorder.frozen.iter().find(|(n, _)| *n == b.name && !self.of_picture).map(|(_, r)| r);
        own.or(frozen).or(group).or_else(|| recorder.resources.get(b.name.as_str())).cloned()
    }

    /// `wrote`: the texture that it writes, where that is no storage texture.
    fn record(
        &mut self,
        wrote: Option<wgpu::TextureView>,
        write: impl FnOnce(&mut wgpu::CommandEncoder, &Pass, &wgpu::BindGroup, Option<(&wgpu::QuerySet, u32)>),
    ) {
        let (pass, name, traffic) = (self.pass, self.name, self.traffic);
        if self.recorder.error.is_none() && self.recorder.gpu.unwanted() {
            self.recorder.error = Some(GivenUp.into());
        }
        if self.recorder.error.is_some() {
            return;
        }
        let find = |b: &Binding| self.find(b);
        let stores = |b: &&Binding| matches!(b.entry.ty, wgpu::BindingType::StorageTexture { .. });
        let watched = self.recorder.watched.is_some();
        let stored = pass.made.bindings.iter().rfind(stores).filter(|_| watched).and_then(find);
        let wrote = wrote.or(stored.and_then(|r| if let Resource::Texture(t) = r { Some(t) } else { None }));
        let wrote = wrote.map(|view| view.texture().clone());
        let counting = self.recorder.timer.traffic.is_some() && self.recorder.waits();
        let counts = self.recorder.gpu.traffic.as_ref().filter(|_| counting);
        let moved = counts.map(|_| pass.made.bindings.iter().filter_map(|b| Some((b, find(b)?))).collect::<Vec<_>>());
        let bound = pass.bind(self.recorder.gpu, self.recorder.frame, find);
        let recorder = &mut *self.recorder;
        let group = match bound {
            Ok(group) => group,
            Err(e) => {
                recorder.error = Some(e);
                return;
            }
        };
        if let Some((watched, _)) = recorder.watched {
            // Layers come one by one, and masked casters after opaque ones.
            if watched != name && recorder.written != wrote {
                recorder.look();
            } else if watched == name && wrote.is_some() {
                recorder.written = wrote;
            }
        }
        recorder.recorded += 1;
        if let Some(counts) = counts {
            recorder.encoder.clear_buffer(counts, 0, None);
        }
        let timer = &mut *recorder.timer;
        let stamped = recorder.timed && timer.mode == TimerMode::Stamps;
        let first = stamped.then(|| timer.stamps(recorder.gpu));
        write(&mut recorder.encoder, pass, &group, first.as_ref().map(|(set, at)| (set, *at)));
        if recorder.timed {
            timer.names.push(name);
            timer.lights.push(recorder.light);
        }
        if recorder.waits() {
            let start = Instant::now();
            recorder.submit();
            if let Err(e) = recorder.gpu.wait() {
                recorder.error = Some(e);
            }
            recorder.timer.wall.push(start.elapsed().as_secs_f64() * 1e3);
            if let Some((counts, bound)) = counts.zip(moved) {
                match recorder.gpu.read_buffer(counts) {
                    Ok(read) => {
                        let moved = traffic.with(bytemuck::cast_slice(&read), bound.iter().map(|(b, r)| (*b, r)));
                        recorder.timer.traffic.get_or_insert_default().push((name, moved));
                    }
                    Err(e) => recorder.error = Some(e),
                }
            }
            return;
        }
        // Passes that are short one by one may be long together.
        recorder.work += recorder.pixels.iter().map(|side| u64::from(*side)).product::<u64>();
        if recorder.work >= recorder.gpu.longest {
            recorder.submit();
        }
    }
}
