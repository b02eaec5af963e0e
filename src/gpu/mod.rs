//! The device, and passes made from WGSL whose resources are bound by name.

mod abilities;
mod memory;
mod pass;
mod shader;
mod table;
mod timer;
mod traffic;

use crate::message::tell;
pub use abilities::{Abilities, Need};
pub use memory::{Account, Buffer, Counted, Texture};
pub use pass::{Pass, Raster, Recorder, Resource, Run, Unfit, Watch};
use shader::Loaded;
pub use shader::{Fault, Shaders, names as shader_files, read_from, write_files};
pub use table::Table;
pub use timer::{DrawCount, Draws, LayerCount, Timer, TimerMode};
pub use traffic::Traffic;

use anyhow::{Context, Result, anyhow, ensure};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::AtomicU64;
use std::sync::{Arc, Mutex, PoisonError};

/// What a slot holds for this key, made anew if it holds something for another one, which goes first.
///
/// # Errors
/// What `make` says.
pub fn hold<K: PartialEq, T>(slot: &mut Option<(K, T)>, key: K, make: impl FnOnce(&K) -> Result<T>) -> Result<&mut T> {
    if slot.as_ref().is_some_and(|(held, _)| *held != key) {
        *slot = None;
    }
    match slot {
        Some((_, held)) => Ok(held),
        None => {
            let made = make(&key)?;
            Ok(&mut slot.insert((key, made)).1)
        }
    }
}

/// The adapter in use and what it can do.
pub struct Gpu {
    pub device: wgpu::Device,
    pub queue: wgpu::Queue,
    pub adapter: wgpu::Adapter,
    pub info: wgpu::AdapterInfo,
    pub abilities: Arc<Abilities>,
    pub shaders: Shaders,
    /// Most work that is submitted at once: pixels, times how often as long as a plain full-screen pass each takes. A weak GPU does this
    /// in some 0.2 s, and Windows resets one that has not answered for 2. Software has no watchdog.
    pub longest: u64,
    /// The shader that the last pass was made of.
    loaded: Mutex<Option<Arc<Loaded>>>,
    pipelines: Mutex<pass::Pipelines>,
    /// The first failure that was not told yet, or that it is lost.
    failure: Arc<Mutex<Option<Failure>>>,
    /// Frames recorded so far.
    frames: AtomicU64,
    /// Where shaders count what they read and write ([`Gpu::count_traffic`]).
    traffic: Option<Buffer>,
    /// Whether the frame that is being rendered is no longer wanted.
    unwanted: Mutex<Option<Box<dyn Fn() -> bool + Send + Sync>>>,
}

/// What a frame fails with that was given up because it was no longer wanted ([`Gpu::give_up_when`]).
#[derive(Debug)]
pub struct GivenUp;

impl std::fmt::Display for GivenUp {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str("the frame was given up")
    }
}

impl std::error::Error for GivenUp {}

/// What a device fails with.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Failure {
    /// The driver has dropped it, and why: nothing that was made on it can be used any more.
    Lost(String),
    OutOfMemory,
    /// What it found wrong.
    Refused(String),
}

impl Failure {
    /// Whether an error is that a device is lost.
    pub fn is_loss(error: &anyhow::Error) -> bool {
        matches!(error.downcast_ref(), Some(Failure::Lost(_)))
    }

    /// Whether an error is that a device's memory is used up.
    pub fn is_out_of_memory(error: &anyhow::Error) -> bool {
        matches!(error.downcast_ref(), Some(Failure::OutOfMemory))
    }
}

impl std::fmt::Display for Failure {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self {
            Failure::Lost(why) => write!(
                f,
                "the graphics driver has dropped its device ({why}); if it does so again, update the driver, or choose another \
                 adapter with --adapter"
            ),
            Failure::OutOfMemory => f.write_str(
                "the graphics device reports: its memory is used up; close other programs, or take a smaller picture, a lower \
                 resolution or fewer triangles",
            ),
            Failure::Refused(what) => write!(f, "the graphics device reports: {}", what.replace('\n', " ")),
        }
    }
}

impl std::error::Error for Failure {}

/// What we use where an adapter has it; nothing of it is required.
pub const WANTED: wgpu::Features = wgpu::Features::TIMESTAMP_QUERY
    .union(wgpu::Features::DEPTH_CLIP_CONTROL)
    .union(wgpu::Features::DEPTH32FLOAT_STENCIL8)
    .union(wgpu::Features::PIPELINE_STATISTICS_QUERY)
    .union(wgpu::Features::FLOAT32_FILTERABLE)
    .union(wgpu::Features::FLOAT32_BLENDABLE)
    .union(wgpu::Features::TEXTURE_FORMAT_16BIT_NORM)
    .union(wgpu::Features::VERTEX_WRITABLE_STORAGE)
    .union(wgpu::Features::TEXTURE_ADAPTER_SPECIFIC_FORMAT_FEATURES);

/// [`Gpu::longest`] of GPUs.
const LONGEST: u64 = 1 << 24;

const NO_ADAPTER: &str = "no graphics adapter was found; install a driver for it (for Vulkan on Debian or Ubuntu: apt install \
                          mesa-vulkan-drivers, which can also do without a GPU)";

/// The instance that windows and the command line share.
pub fn instance() -> wgpu::Instance {
    wgpu::Instance::new(wgpu::InstanceDescriptor {
        backends: wgpu::Backends::PRIMARY,
        ..wgpu::InstanceDescriptor::new_without_display_handle()
    })
}

/// Every adapter of the system by Vulkan, Metal or Direct3D 12, the best first: what OpenGL can do is not enough.
pub fn adapters(instance: &wgpu::Instance) -> Vec<wgpu::Adapter> {
    let mut all = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::PRIMARY));
    all.sort_by_key(|a| match a.get_info().device_type {
        wgpu::DeviceType::DiscreteGpu => 0,
        wgpu::DeviceType::IntegratedGpu => 1,
        wgpu::DeviceType::VirtualGpu => 2,
        wgpu::DeviceType::Other => 3,
        wgpu::DeviceType::Cpu => 4,
    });
    all
}

/// As [`adapters`], where there must be one.
///
/// # Errors
/// There is none.
pub fn found(instance: &wgpu::Instance) -> Result<Vec<wgpu::Adapter>> {
    let all = adapters(instance);
    ensure!(!all.is_empty(), NO_ADAPTER);
    Ok(all)
}

impl Gpu {
    /// Opens the best adapter, or the first whose name contains `name`, for use without a window.
    ///
    /// # Errors
    /// No adapter, none of that name, or a driver that refuses a device.
    pub fn new(name: Option<&str>) -> Result<Gpu> {
        Gpu::on(&instance(), None, name)
    }

    /// Opens an adapter that can draw on `surface`.
    pub fn on(instance: &wgpu::Instance, surface: Option<&wgpu::Surface>, name: Option<&str>) -> Result<Gpu> {
        Gpu::within(instance, surface, name, |features, limits| (features, limits))
    }

    /// As [`Gpu::on`], with the features and limits that `lower` makes of the adapter's own: what a weaker one would do.
    pub fn within(
        instance: &wgpu::Instance,
        surface: Option<&wgpu::Surface>,
        name: Option<&str>,
        lower: impl FnOnce(wgpu::Features, wgpu::Limits) -> (wgpu::Features, wgpu::Limits),
    ) -> Result<Gpu> {
        let all = found(instance)?;
        let names = || all.iter().map(|a| a.get_info().name).collect::<Vec<_>>().join(", ");
        let fits = |a: &&wgpu::Adapter| {
            name.is_none_or(|n| a.get_info().name.to_lowercase().contains(&n.to_lowercase()))
                && surface.is_none_or(|s| a.is_surface_supported(s))
        };
        let adapter = all.iter().find(fits).with_context(|| match name {
            Some(n) => format!("no adapter is called {n}; there are: {}", names()),
            None => format!("none of the adapters can draw in this window: {}", names()),
        })?;
        let info = adapter.get_info();
        let (features, required_limits) = lower(adapter.features() & WANTED, adapter.limits());
        let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
            label: Some("shadowscope"),
            required_features: features,
            required_limits,
            ..Default::default()
        }))
        .with_context(|| format!("{} refused to open", info.name))?;
        let abilities = Abilities { adapter: info.name.clone(), features, limits: device.limits() };
        let mut shaders = Shaders::default();
        shaders.table_bits = Table::bits(&abilities.limits);
        let failure = Arc::new(Mutex::new(None));
        let slot = failure.clone();
        device.on_uncaptured_error(Arc::new(move |e: wgpu::Error| {
            let told = match e {
                wgpu::Error::OutOfMemory { .. } => Failure::OutOfMemory,
                e => Failure::Refused(e.to_string()),
            };
            locked(&slot).get_or_insert(told);
        }));
        let slot = failure.clone();
        device.set_device_lost_callback(move |reason, message| {
            let why = match reason {
                wgpu::DeviceLostReason::Destroyed => "it was destroyed".into(),
                _ if message.is_empty() => "it does not say why".into(),
                _ => message.trim_end_matches('.').to_lowercase(),
            };
            *locked(&slot) = Some(Failure::Lost(why));
        });
        Ok(Gpu {
            device,
            queue,
            adapter: adapter.clone(),
            longest: if info.device_type == wgpu::DeviceType::Cpu { u64::MAX } else { LONGEST },
            abilities: Arc::new(abilities),
            info,
            shaders,
            loaded: Mutex::new(None),
            pipelines: Mutex::default(),
            failure,
            frames: AtomicU64::new(0),
            traffic: None,
            unwanted: Mutex::new(None),
        })
    }

    /// Has the shaders of all passes made from here on count what they read and write: for [`Timer::tell_traffic`], and slow.
    ///
    /// # Errors
    /// An adapter on which vertex shaders cannot count.
    pub fn count_traffic(mut self) -> Result<Gpu> {
        let can = self.abilities.features.contains(wgpu::Features::VERTEX_WRITABLE_STORAGE);
        ensure!(can, "{} cannot count what passes move: its vertex shaders write no buffers", self.info.name);
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST;
        self.traffic = Some(self.room("traffic", traffic::BYTES, usage));
        Ok(self)
    }

    /// From here on frames ask `unwanted` between their passes, and fail with [`GivenUp`] where it says yes. Where passes
    /// are not waited for it is asked as they are recorded.
    pub fn give_up_when(&self, unwanted: impl Fn() -> bool + Send + Sync + 'static) {
        if let Ok(mut slot) = self.unwanted.lock() {
            *slot = Some(Box::new(unwanted));
        }
    }

    /// Whether the frame that is being rendered is to be given up.
    fn unwanted(&self) -> bool {
        self.unwanted.lock().is_ok_and(|slot| slot.as_ref().is_some_and(|ask| ask()))
    }

    /// Most bytes that a storage buffer may have and be bound with.
    pub fn most_bound(&self) -> u64 {
        let limits = self.device.limits();
        limits.max_storage_buffer_binding_size.min(limits.max_buffer_size)
    }

    /// The format of a picture's depth, with a stencil for techniques that count.
    pub fn depth_stencil(&self) -> wgpu::TextureFormat {
        match self.abilities.features.contains(wgpu::Features::DEPTH32FLOAT_STENCIL8) {
            true => wgpu::TextureFormat::Depth32FloatStencil8,
            false => wgpu::TextureFormat::Depth24PlusStencil8,
        }
    }

    /// The format of sums that are blended: whole numbers are exact up to 16,777,216, or 2048 where 32-bit floats cannot be blended.
    pub fn blended_sums(&self) -> wgpu::TextureFormat {
        match self.abilities.features.contains(wgpu::Features::FLOAT32_BLENDABLE) {
            true => wgpu::TextureFormat::R32Float,
            false => wgpu::TextureFormat::R16Float,
        }
    }

    /// Whether the adapter is a program on the CPU, whose timings say nothing of a GPU's.
    pub fn software(&self) -> bool {
        self.info.device_type == wgpu::DeviceType::Cpu
    }

    /// Fails with the first error that the device reported since the last call, and whenever it is lost.
    ///
    /// # Errors
    /// A [`Failure`].
    pub fn check(&self) -> Result<()> {
        self.look()?;
        locked(&self.failure).take().map_or(Ok(()), |failure| Err(failure.into()))
    }

    /// Fails if the device is lost. All else that it reports is left to [`Gpu::check`].
    ///
    /// # Errors
    /// [`Failure::Lost`].
    pub fn look(&self) -> Result<()> {
        self.poll(wgpu::PollType::Poll)
    }

    /// Waits until the device has done all that was submitted.
    ///
    /// # Errors
    /// [`Failure::Lost`].
    pub fn wait(&self) -> Result<()> {
        self.poll(wgpu::PollType::wait_indefinitely())
    }

    fn poll(&self, how: wgpu::PollType) -> Result<()> {
        // wgpu 30 panics where the driver answers that the device is lost.
        match catch_unwind(AssertUnwindSafe(|| self.device.poll(how))) {
            Ok(polled) => _ = polled.context("the graphics device stopped answering")?,
            Err(_) => _ = locked(&self.failure).insert(Failure::Lost("it no longer answers".into())),
        }
        match &*locked(&self.failure) {
            Some(lost @ Failure::Lost(_)) => Err(lost.clone().into()),
            _ => Ok(()),
        }
    }

    /// A buffer with the given contents.
    pub fn buffer(&self, label: &str, contents: &[u8], usage: wgpu::BufferUsages) -> Buffer {
        let size = contents.len().next_multiple_of(16) as u64;
        let buffer = self.room(label, size, usage | wgpu::BufferUsages::COPY_DST);
        self.queue.write_buffer(&buffer, 0, contents);
        buffer
    }

    /// A buffer of zeros, of so many bytes, 16 at least.
    pub fn room(&self, label: &str, size: u64, usage: wgpu::BufferUsages) -> Buffer {
        let size = size.max(16).next_multiple_of(4);
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size,
            usage,
            mapped_at_creation: false,
        });
        Counted::new(buffer, size)
    }

    /// Reads a buffer back, waiting for the device. It needs the usage `COPY_SRC`.
    pub fn read_buffer(&self, buffer: &wgpu::Buffer) -> Result<Vec<u8>> {
        self.read_range(buffer, 0, buffer.size())
    }

    /// As [`Gpu::read_buffer`], but only `size` bytes from `offset` on, both multiples of 4.
    pub fn read_range(&self, buffer: &wgpu::Buffer, offset: u64, size: u64) -> Result<Vec<u8>> {
        let staging = self.staging(size);
        let mut encoder = self.device.create_command_encoder(&Default::default());
        encoder.copy_buffer_to_buffer(buffer, offset, &staging, 0, size);
        self.queue.submit([encoder.finish()]);
        self.read_staging(&staging)
    }

    /// Writes a whole 2D texture, rows from the top without padding. It needs the usage `COPY_DST`.
    pub fn write_texture(&self, texture: &wgpu::Texture, texels: &[u8]) {
        let size = texture.size();
        let bytes_per_row = Some((texels.len() / size.height as usize) as u32);
        let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row, rows_per_image: None };
        self.queue.write_texture(texture.as_image_copy(), texels, layout, size);
    }

    /// Reads a 2D texture back, rows from the top without padding. It needs the usage `COPY_SRC`.
    pub fn read_texture(&self, texture: &wgpu::Texture) -> Result<Vec<u8>> {
        self.read_texels(texture, [0, 0], texture.size())
    }

    /// As [`Gpu::read_texture`], but only `size` texels from `origin` on.
    pub fn read_texels(&self, texture: &wgpu::Texture, origin: [u32; 2], size: wgpu::Extent3d) -> Result<Vec<u8>> {
        let texel = texture.format().block_copy_size(None).context("this texture format cannot be read back")?;
        let row = (size.width * texel) as usize;
        let padded = row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT as usize);
        let staging = self.staging((padded * size.height as usize) as u64);
        let mut encoder = self.device.create_command_encoder(&Default::default());
        let origin = wgpu::Origin3d { x: origin[0], y: origin[1], z: 0 };
        encoder.copy_texture_to_buffer(
            wgpu::TexelCopyTextureInfo { origin, ..texture.as_image_copy() },
            wgpu::TexelCopyBufferInfo {
                buffer: &staging,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(padded as u32),
                    rows_per_image: None,
                },
            },
            size,
        );
        self.queue.submit([encoder.finish()]);
        let bytes = self.read_staging(&staging)?;
        let mut packed = Vec::with_capacity(row * size.height as usize);
        bytes.chunks_exact(padded).for_each(|r| packed.extend_from_slice(&r[..row]));
        Ok(packed)
    }

    fn staging(&self, size: u64) -> wgpu::Buffer {
        self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("read-back"),
            size,
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        })
    }

    fn read_staging(&self, staging: &wgpu::Buffer) -> Result<Vec<u8>> {
        staging.map_async(wgpu::MapMode::Read, .., |_| {});
        self.wait()?;
        self.check()?;
        let bytes = staging.get_mapped_range(..).map_err(|e| anyhow!("reading back from the device failed: {e}"))?;
        Ok(bytes.to_vec())
    }
}

/// What a slot holds is whole, whoever panicked.
fn locked<T>(slot: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    slot.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Drop for Gpu {
    /// What the device reported and nobody asked about is said at last.
    fn drop(&mut self) {
        if let Err(e) = self.check() {
            tell!("shadowscope: {e}");
        }
    }
}

/// A texture with a view of all of it, remade when its description changes.
#[derive(Default)]
pub struct Slot {
    made: Option<(Texture, wgpu::TextureView)>,
}

impl Slot {
    /// The view of a texture of this description, made anew if the held one differs.
    pub fn get(
        &mut self,
        gpu: &Gpu,
        label: &str,
        size: [u32; 2],
        format: wgpu::TextureFormat,
        usage: wgpu::TextureUsages,
    ) -> wgpu::TextureView {
        if let Some((t, v)) = &self.made
            && t.format() == format
            && [t.width(), t.height()] == size
            && t.usage() == usage
        {
            return v.clone();
        }
        let texture = texture(gpu, label, [size[0], size[1], 1], 1, format, usage);
        let view = texture.create_view(&Default::default());
        self.made = Some((texture, view.clone()));
        view
    }

    /// The view, once made.
    pub fn view(&self) -> Option<&wgpu::TextureView> {
        self.made.as_ref().map(|(_, v)| v)
    }

    /// The texture, once made.
    pub fn texture(&self) -> Option<&wgpu::Texture> {
        self.made.as_ref().map(|(t, _)| &**t)
    }
}

/// A texture. `size`: width, height and layers.
pub fn texture(
    gpu: &Gpu,
    label: &str,
    [width, height, depth_or_array_layers]: [u32; 3],
    mip_level_count: u32,
    format: wgpu::TextureFormat,
    usage: wgpu::TextureUsages,
) -> Texture {
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d { width, height, depth_or_array_layers },
        mip_level_count,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage,
        view_formats: &[],
    });
    let bytes = bytes(&texture);
    Counted::new(texture, bytes)
}

/// Bytes that a texture takes, all mips and layers (24-bit depth counted as 32).
fn bytes(texture: &wgpu::Texture) -> u64 {
    let texel = match texture.format() {
        wgpu::TextureFormat::Depth24Plus | wgpu::TextureFormat::Depth24PlusStencil8 => 4,
        wgpu::TextureFormat::Depth32FloatStencil8 => 8,
        other => other.block_copy_size(None).unwrap_or(4) as u64,
    };
    let level = |i: u32| (texture.width() >> i).max(1) as u64 * (texture.height() >> i).max(1) as u64;
    (0..texture.mip_level_count()).map(level).sum::<u64>() * texture.depth_or_array_layers() as u64 * texel
}
