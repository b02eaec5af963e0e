//! The analysis of a frame: aliasing error of every pixel, view samples of every texel, triangles and rays counted.
//! It runs, and holds memory, only in frames that ask for it.

use super::maps::Place;
use super::{Frame, STORED};
use crate::gpu::{Account, Buffer, DrawCount, Draws, Gpu, LayerCount, Pass, Resource, Slot};
use anyhow::Result;
use bytemuck::{Pod, Zeroable};

/// A band of the counts, as `Counting` in `shaders/lib/counting.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Counting {
    pub size: [u32; 2],
    pub layers: u32,
    pub first: u32,
    pub count: u32,
    pub padding: u32,
    pub spare: [u32; 2],
    pub sides: [[u32; 4]; 2],
}

/// The maps of a technique: layers of one size, of which maps may fill less.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MapSizes {
    /// Width and height of each layer, texels.
    pub size: [u32; 2],
    pub layers: u32,
    /// Sides of the first eight maps where they are smaller, in the upper left corners of their layers; 0: as large.
    sides: [u32; 8],
}

impl MapSizes {
    /// Square maps with these sides, texels; different ones only among the first eight.
    pub fn of(sides: &[u32]) -> MapSizes {
        let largest = sides.iter().copied().max().unwrap_or(0);
        let mut smaller = [0; 8];
        smaller.iter_mut().zip(sides).filter(|(_, side)| **side < largest).for_each(|(to, side)| *to = *side);
        MapSizes { size: [largest; 2], layers: sides.len() as u32, sides: smaller }
    }

    /// Texels of a layer.
    pub fn layer(&self) -> u64 {
        self.size[0] as u64 * self.size[1] as u64
    }

    /// Texels of all maps together.
    pub fn texels(&self) -> u64 {
        let own = |i: usize| match self.sides.get(i) {
            Some(side) if *side > 0 => *side as u64 * *side as u64,
            _ => self.layer(),
        };
        (0..self.layers as usize).map(own).sum()
    }

    /// Texels of all layers together, which are counted.
    fn counted(&self) -> u64 {
        self.layer() * self.layers as u64
    }
}

/// As many counts as fit into one storage binding.
struct Band {
    uniform: Buffer,
    counts: Buffer,
    first: u64,
    count: u64,
}

/// What the last frame's analysis found.
#[derive(Default)]
pub struct Analysis {
    pub(super) aliasing: Slot,
    places: Slot,
    maps: Option<MapSizes>,
    bands: Vec<Band>,
    pub(super) draws: Option<DrawCount>,
    pub(super) pieces: Option<Buffer>,
    /// Buffers that say where maps look, by their names in WGSL.
    tables: Vec<(&'static str, wgpu::Buffer)>,
    /// Maps that were drawn one after the other into the one that is offered.
    maps_drawn: Option<MapsDrawn>,
}

/// How many maps were drawn one after the other: known, or the first word of a buffer on the GPU.
enum MapsDrawn {
    Known(u64),
    Counted(wgpu::Buffer),
}

/// What a warped map's casters became.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PieceCount {
    /// Triangles that some view sample needs.
    pub kept: u64,
    /// Triangles drawn in their place; the exact raster takes them as they are.
    pub drawn: u64,
    /// Pieces drawn that should have been split further.
    pub unserved: u64,
    /// Pieces that the map holds turned inside out.
    pub folded: u64,
    /// Places of the light's image, one a texel, where the warp itself turns it over.
    pub folds: u64,
}

/// Most memory that counts may take, bytes: above it there are none.
const COUNT_BYTES: u64 = 512 << 20;
/// Counts read back at a time.
const CHUNK: u64 = 4 << 20;

impl Analysis {
    /// Forgets the last frame's; the buffers too, unless the next one needs them.
    pub(super) fn start(&mut self, gpu: &Gpu, wanted: bool) {
        self.maps = None;
        self.pieces = None;
        self.tables.clear();
        self.maps_drawn = None;
        if !wanted {
            self.aliasing = Slot::default();
            self.places = Slot::default();
            self.bands.clear();
            self.draws = None;
        } else if self.draws.is_none() {
            self.draws = DrawCount::new(gpu);
        }
    }

    /// Buffers for the counts of these maps, in bands of what the adapter binds at once.
    fn hold(&mut self, gpu: &Gpu, maps: MapSizes) {
        self.maps = Some(maps);
        let most = gpu.most_bound() / 4;
        // Where all counts are too many, one empty band remains: the aliasing error needs none.
        let texels = if maps.counted() * 4 <= COUNT_BYTES { maps.counted() } else { 0 };
        let held: u64 = self.bands.iter().map(|b| b.count).sum();
        if !self.bands.is_empty() && held == texels {
            let sizes = |b: &Band| gpu.queue.write_buffer(&b.uniform, 0, bytemuck::bytes_of(&b.words(maps)));
            return self.bands.iter().for_each(sizes);
        }
        self.bands.clear();
        use wgpu::BufferUsages as Use;
        for i in 0..texels.div_ceil(most).max(1) {
            let (first, count) = (i * most, (texels - i * most).min(most));
            let uniform = gpu.buffer("band of counts", &[0; size_of::<Counting>()], Use::UNIFORM);
            let counts = gpu.room("samples per texel", count * 4, Use::STORAGE | Use::COPY_SRC | Use::COPY_DST);
            let band = Band { uniform, counts, first, count };
            gpu.queue.write_buffer(&band.uniform, 0, bytemuck::bytes_of(&band.words(maps)));
            self.bands.push(band);
        }
    }

    /// The maps that the technique had analysed; None if it has none, or the frame was not asked.
    pub fn maps(&self) -> Option<MapSizes> {
        self.maps
    }

    /// Aliasing error m, its perspective and projection parts and a texel's area in pixels, for every pixel; all -1
    /// where the technique looks nothing up. None as [`Analysis::maps`].
    pub fn aliasing(&self, gpu: &Gpu) -> Result<Option<Vec<[f32; 4]>>> {
        match (self.maps, self.aliasing.texture()) {
            (Some(_), Some(texture)) => Ok(Some(bytemuck::pod_collect_to_vec(&gpu.read_texture(texture)?))),
            _ => Ok(None),
        }
    }

    /// Of each pixel its place in the maps, texels, and which map; None: in none.
    pub(super) fn places(&self, gpu: &Gpu) -> Result<Vec<Place>> {
        let Some(texture) = self.places.texture() else { return Ok(Vec::new()) };
        let bytes = gpu.read_texture(texture)?;
        let place = |p: [f32; 4]| (p[2] >= 0.0).then(|| ([p[0], p[1]], p[2] as u32));
        Ok(bytes.chunks_exact(16).map(|p| place(bytemuck::pod_read_unaligned(p))).collect())
    }

    /// The aliasing error and its parts as a texture.
    pub(super) fn aliasing_view(&self) -> Option<&wgpu::TextureView> {
        self.maps.and_then(|_| self.aliasing.view())
    }

    /// The same four numbers at one pixel.
    pub(super) fn aliasing_at(&self, gpu: &Gpu, pixel: [u32; 2]) -> Result<Option<[f32; 4]>> {
        let Some(texture) = self.aliasing.texture() else { return Ok(None) };
        let one = wgpu::Extent3d { width: 1, height: 1, depth_or_array_layers: 1 };
        let values: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&gpu.read_texels(texture, pixel, one)?);
        Ok(values.first().copied().filter(|v| v[0] > 0.0))
    }

    /// Samples per texel, given to `take` piece by piece with the index of each piece's first texel: rows from the
    /// top, layer after layer. False where there are too many texels to count, or none.
    pub fn counts(&self, gpu: &Gpu, mut take: impl FnMut(u64, &[u32])) -> Result<bool> {
        if self.maps.is_none() || self.bands.iter().all(|b| b.count == 0) {
            return Ok(false);
        }
        for band in &self.bands {
            for at in (0..band.count).step_by(CHUNK as usize) {
                let count = (band.count - at).min(CHUNK);
                let words: Vec<u32> = bytemuck::pod_collect_to_vec(&gpu.read_range(&band.counts, at * 4, count * 4)?);
                take(band.first + at, &words);
            }
        }
        Ok(true)
    }

    /// Where the picture of the counts, `size` pixels, shows which texel: column, row, map and its count.
    pub(super) fn count_at(&self, gpu: &Gpu, pixel: [u32; 2], size: [u32; 2]) -> Result<Option<[u32; 4]>> {
        let Some(maps) = self.maps else { return Ok(None) };
        // As in shaders/counts.wgsl.
        let columns = (maps.layers as f32).sqrt().ceil() as u32;
        let rows = maps.layers.div_ceil(columns);
        let whole = [maps.size[0] * columns, maps.size[1] * rows].map(|side| side as f32);
        let scale = (whole[0] / size[0] as f32).max(whole[1] / size[1] as f32);
        let at = [0, 1].map(|i| (pixel[i] as f32 + 0.5 - 0.5 * size[i] as f32) * scale + 0.5 * whole[i]);
        if (0..2).any(|i| at[i] < 0.0 || at[i] >= whole[i]) {
            return Ok(None);
        }
        let (x, y) = (at[0] as u32, at[1] as u32);
        let layer = y / maps.size[1] * columns + x / maps.size[0];
        let (x, y) = (x % maps.size[0], y % maps.size[1]);
        if maps.sides.get(layer as usize).is_some_and(|side| *side > 0 && x.max(y) >= *side) {
            return Ok(None);
        }
        let index = (layer as u64 * maps.size[1] as u64 + y as u64) * maps.size[0] as u64 + x as u64;
        let Some(band) = self.bands.iter().find(|b| (b.first..b.first + b.count).contains(&index)) else {
            return Ok(None);
        };
        let count = bytemuck::pod_read_unaligned(&gpu.read_range(&band.counts, (index - band.first) * 4, 4)?);
        Ok(Some([x, y, layer, count]))
    }

    /// What a warped map's casters were split into, of every frame; None of techniques without a warp.
    pub fn pieces(&self, gpu: &Gpu) -> Result<Option<PieceCount>> {
        let Some(counters) = &self.pieces else { return Ok(None) };
        let words: [u32; 5] = bytemuck::pod_read_unaligned(&gpu.read_range(counters, 0, 20)?);
        let [drawn, unserved, kept, folded, folds] = words.map(u64::from);
        Ok(Some(PieceCount { kept, drawn, unserved, folded, folds }))
    }

    /// A buffer that says where maps look, by its name in WGSL: `light_view`, and what the technique's warp reads, or
    /// `light_views` and `splits`. None if there is none of that name.
    pub fn table(&self, gpu: &Gpu, name: &str) -> Result<Option<Vec<u8>>> {
        let found = self.tables.iter().find(|(n, _)| *n == name);
        found.map(|(_, buffer)| gpu.read_buffer(buffer)).transpose()
    }

    /// What the technique's draws made of the scene's triangles. None where the adapter cannot count it.
    pub fn draws(&self, gpu: &Gpu) -> Result<Option<Draws>> {
        self.draws.as_ref().map_or(Ok(None), |d| d.read(gpu))
    }

    /// How many maps were drawn one after the other into the one that was counted; None of others.
    pub fn maps_drawn(&self, gpu: &Gpu) -> Result<Option<u64>> {
        Ok(match &self.maps_drawn {
            Some(MapsDrawn::Known(number)) => Some(*number),
            Some(MapsDrawn::Counted(buffer)) => {
                let [number]: [u32; 1] = bytemuck::pod_read_unaligned(&gpu.read_range(buffer, 0, 4)?);
                Some(number.into())
            }
            None => None,
        })
    }

    /// The depth layers that the technique drew into, and those of them that got something. None as [`Analysis::draws`], and
    /// of techniques that draw into none.
    pub fn layers(&self, gpu: &Gpu) -> Result<Option<LayerCount>> {
        self.draws.as_ref().map_or(Ok(None), |d| d.layers(gpu))
    }
}

impl Band {
    fn words(&self, maps: MapSizes) -> Counting {
        let MapSizes { size, layers, sides } = maps;
        let (first, count) = (self.first as u32, self.count as u32);
        Counting { size, layers, first, count, padding: 0, spare: [0; 2], sides: bytemuck::cast(sides) }
    }
}

impl Frame<'_> {
    /// Tells where a warped map counts its pieces (`State` in `shaders/map/warp/warped.wgsl`, which begins with its counters).
    pub(crate) fn count_pieces(&mut self, counters: &Buffer) {
        self.pieces = Some(counters.clone());
    }

    /// Tells how many maps were drawn one after the other into the one that is offered.
    pub(crate) fn count_maps(&mut self, number: usize) {
        if let Some(analysis) = self.analysis.as_deref_mut() {
            analysis.maps_drawn = Some(MapsDrawn::Known(number as u64));
        }
    }

    /// Tells where the GPU counts, in the first word, how many maps were drawn one after the other into the one that is offered.
    pub(crate) fn count_maps_in(&mut self, counted: &Buffer) {
        if let Some(analysis) = self.analysis.as_deref_mut() {
            analysis.maps_drawn = Some(MapsDrawn::Counted((**counted).clone()));
        }
    }

    /// Keeps a buffer that says where maps look for [`Analysis::table`].
    pub(crate) fn keep_table(&mut self, name: &'static str, buffer: &wgpu::Buffer) {
        if let Some(analysis) = self.analysis.as_deref_mut() {
            analysis.tables.push((name, buffer.clone()));
        }
    }

    /// Whether the frame is to be analysed, so that `analyse` has an effect.
    pub fn wants_analysis(&self) -> bool {
        self.analysis.is_some()
    }

    /// Runs the technique's analysis pass (`shaders/lib/analysis.wgsl`, entry point `analyse`) over its maps, if the
    /// frame asks for it. `bound`: what its `place` needs.
    pub fn analyse(&mut self, pass: &Pass, maps: MapSizes, bound: &[(&'static str, Resource)]) {
        let Some(analysis) = self.analysis.as_deref_mut() else { return };
        let recorder = &mut self.recorder;
        let gpu = recorder.gpu;
        // It is not the technique's.
        let [aliasing, places] = Account::default().charge(|| {
            analysis.hold(gpu, maps);
            [("aliasing", &mut analysis.aliasing), ("places", &mut analysis.places)]
                .map(|(label, slot)| slot.get(gpu, label, self.size, wgpu::TextureFormat::Rgba32Float, STORED))
        });
        for band in &analysis.bands {
            recorder.clear(&band.counts);
            let mut run = recorder.run(pass);
            for (name, resource) in bound {
                run = run.bind(name, resource.clone());
            }
            run.bind("aliasing_out", &aliasing)
                .bind("places_out", &places)
                .bind("counting", &band.uniform)
                .bind("counts", &band.counts)
                .per_pixel();
        }
        if self.view == "counts" {
            for band in &analysis.bands {
                let run = recorder.run(self.draw_counts);
                run.bind("counting", &band.uniform).bind("counts", &band.counts).per_pixel();
            }
        }
    }

    /// Draws counts of view samples, a number per texel, into the technique's map (`shaders/counts.wgsl`).
    pub(crate) fn draw_counts(&mut self, counting: &Buffer, counts: &Buffer) {
        self.recorder.run(self.draw_counts).bind("counting", counting).bind("counts", counts).per_pixel();
    }
}
