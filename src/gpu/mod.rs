//! The device, and passes made from WGSL whose resources are bound by name.

mod memory;
mod pass;
mod shader;
mod table;
mod timer;

pub use memory::{Account, Buffer, Counted, Texture};
pub use pass::{Pass, Raster, Recorder, Resource, Run, Watch};
use shader::Loaded;
pub use shader::{Fault, Shaders, names as shader_files, read_from, write_files};
pub use table::Table;
pub use timer::{DrawCount, Draws, LayerCount, Timer, TimerMode};

use anyhow::{Context, Result, anyhow};
use std::sync::atomic::AtomicU64;
use std::sync::{Arc, Mutex};

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
    pub features: wgpu::Features,
    pub shaders: Shaders,
    /// The shader that the last pass was made of.
    loaded: Mutex<Option<Arc<Loaded>>>,
    pipelines: Mutex<pass::Pipelines>,
    error: Arc<Mutex<Option<String>>>,
    /// Frames recorded so far.
    frames: AtomicU64,
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

/// What we use where an adapter has it; nothing of it is required.
const WANTED: wgpu::Features = wgpu::Features::TIMESTAMP_QUERY
    .union(wgpu::Features::DEPTH_CLIP_CONTROL)
    .union(wgpu::Features::DEPTH32FLOAT_STENCIL8)
    .union(wgpu::Features::PIPELINE_STATISTICS_QUERY)
    .union(wgpu::Features::FLOAT32_FILTERABLE)
    .union(wgpu::Features::FLOAT32_BLENDABLE)
    .union(wgpu::Features::TEXTURE_FORMAT_16BIT_NORM)
    .union(wgpu::Features::TEXTURE_ADAPTER_SPECIFIC_FORMAT_FEATURES);

const OUT_OF_MEMORY: &str =
    "its memory is used up; close other programs, or take a smaller picture, a lower resolution or fewer triangles";

/// The instance that windows and the command line share.
pub fn instance() -> wgpu::Instance {
    wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle())
}

/// Every adapter of the system, the best first.
pub fn adapters(instance: &wgpu::Instance) -> Vec<wgpu::Adapter> {
    let mut all = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::all()));
    all.sort_by_key(|a| match a.get_info().device_type {
        wgpu::DeviceType::DiscreteGpu => 0,
        wgpu::DeviceType::IntegratedGpu => 1,
        wgpu::DeviceType::VirtualGpu => 2,
        wgpu::DeviceType::Other => 3,
        wgpu::DeviceType::Cpu => 4,
    });
    all
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
        Gpu::within(instance, surface, name, |limits| limits)
    }

    /// As [`Gpu::on`], with the limits that `lower` makes of the adapter's own: what a weaker one would do.
    pub fn within(
        instance: &wgpu::Instance,
        surface: Option<&wgpu::Surface>,
        name: Option<&str>,
        lower: impl FnOnce(wgpu::Limits) -> wgpu::Limits,
    ) -> Result<Gpu> {
        let all = adapters(instance);
        let names = || all.iter().map(|a| a.get_info().name).collect::<Vec<_>>().join(", ");
        if all.is_empty() {
            return Err(anyhow!(
                "no graphics adapter was found; install a Vulkan driver (on Debian or Ubuntu: ./setup.sh)"
            ));
        }
        let fits = |a: &&wgpu::Adapter| {
            name.is_none_or(|n| a.get_info().name.to_lowercase().contains(&n.to_lowercase()))
                && surface.is_none_or(|s| a.is_surface_supported(s))
        };
        let adapter = all.iter().find(fits).with_context(|| match name {
            Some(n) => format!("no adapter is called {n}; there are: {}", names()),
            None => format!("none of the adapters can draw in this window: {}", names()),
        })?;
        let info = adapter.get_info();
        let features = adapter.features() & WANTED;
        let error = Arc::new(Mutex::new(None));
        let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
            label: Some("shadowscope"),
            required_features: features,
            required_limits: lower(adapter.limits()),
            ..Default::default()
        }))
        .with_context(|| format!("{} refused to open", info.name))?;
        let slot = error.clone();
        device.on_uncaptured_error(Arc::new(move |e: wgpu::Error| {
            let told = match e {
                wgpu::Error::OutOfMemory { .. } => OUT_OF_MEMORY.into(),
                e => e.to_string(),
            };
            if let Ok(mut slot) = slot.lock() {
                slot.get_or_insert(told);
            }
        }));
        Ok(Gpu {
            device,
            queue,
            adapter: adapter.clone(),
            info,
            features,
            shaders: Shaders::default(),
            loaded: Mutex::new(None),
            pipelines: Mutex::default(),
            error,
            frames: AtomicU64::new(0),
            unwanted: Mutex::new(None),
        })
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
        match self.features.contains(wgpu::Features::DEPTH32FLOAT_STENCIL8) {
            true => wgpu::TextureFormat::Depth32FloatStencil8,
            false => wgpu::TextureFormat::Depth24PlusStencil8,
        }
    }

    /// The format of sums that are blended: whole numbers are exact up to 16,777,216, or 2048 where 32-bit floats cannot be blended.
    pub fn blended_sums(&self) -> wgpu::TextureFormat {
        match self.features.contains(wgpu::Features::FLOAT32_BLENDABLE) {
            true => wgpu::TextureFormat::R32Float,
            false => wgpu::TextureFormat::R16Float,
        }
    }

    /// Whether the adapter is a program on the CPU, whose timings say nothing of a GPU's.
    pub fn software(&self) -> bool {
        self.info.device_type == wgpu::DeviceType::Cpu
    }

    /// Fails with the first error that the device reported since the last call.
    pub fn check(&self) -> Result<()> {
        match self.error.lock().ok().and_then(|mut e| e.take()) {
            Some(message) => Err(anyhow!("the graphics device reports: {}", message.replace('\n', " "))),
            None => Ok(()),
        }
    }

    /// Waits until the device has done all that was submitted.
    pub fn wait(&self) -> Result<()> {
        self.device.poll(wgpu::PollType::wait_indefinitely()).context("the graphics device stopped answering")?;
        Ok(())
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

impl Drop for Gpu {
    /// What the device reported and nobody asked about is said at last.
    fn drop(&mut self) {
        if let Err(e) = self.check() {
            eprintln!("shadowscope: {e}");
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
