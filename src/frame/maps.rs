//! The depth maps of a frame, to be looked into: every texel's depth and samples, and every pixel's place in them.

use super::{Frame, Renderer, STORED};
use crate::gpu::{Pass, Recorder, Slot};
use crate::light::LightView;
use anyhow::Result;
use wgpu::TextureFormat as Format;

/// The depth maps that a technique has drawn.
#[derive(Clone)]
pub(super) struct Offered {
    pub(super) layers: Vec<wgpu::TextureView>,
    /// As many as layers, one behind the other.
    pub(super) light_views: wgpu::Buffer,
    /// Texels of each side.
    sides: Vec<u32>,
}

/// A pixel's place in the maps, texels, and the number of the map; None: in none.
pub type Place = Option<([f32; 2], u32)>;

/// One of a technique's maps, read back.
pub struct MapLayer {
    /// Its number, and how many there are.
    pub layer: u32,
    pub layers: u32,
    /// Texels of each side.
    pub side: u32,
    /// Stored depths, reversed: 1 near, 0 far; rows from the top.
    pub depth: Vec<f32>,
    pub view: LightView,
    /// Samples per texel, where they could be counted.
    pub samples: Option<Vec<u32>>,
    /// Of each pixel of the picture its place in the maps, texels, and the number of the map; None: in none.
    pub places: Vec<Place>,
    /// Pixels of the picture.
    pub size: [u32; 2],
}

impl MapLayer {
    /// The depth of a texel in metres along the light's axis; None: no caster.
    pub fn metres(&self, texel: usize) -> Option<f32> {
        self.depth.get(texel).filter(|d| **d > 0.0).map(|d| self.view.linear_depth(*d))
    }
}

impl Frame<'_> {
    /// Offers the technique's depth maps to be looked at: a view and a side for each, and a buffer with their light views.
    pub fn offer_maps(&mut self, layers: &[wgpu::TextureView], light_views: &wgpu::Buffer, sides: &[u32]) {
        self.offered = Some(Offered { layers: layers.into(), light_views: light_views.clone(), sides: sides.into() });
    }
}

impl Renderer {
    /// Reads one of the last frame's maps back, the last one if there are fewer; None: there are none. That frame must have
    /// been analysed.
    pub fn read_layer(&mut self, layer: u32) -> Result<Option<MapLayer>> {
        let Some(Offered { layers, light_views, sides }) = self.offered.clone() else { return Ok(None) };
        let layer = (layer as usize).min(layers.len() - 1);
        let (gpu, side) = (self.gpu.clone(), sides[layer]);
        if self.read_map.is_none() {
            self.read_map = Some(Pass::compute(&gpu, "map to numbers", "read_map.wgsl", "copy_map", &[])?);
        }
        let mut values = Slot::default();
        let out = values.get(&gpu, "map as numbers", [side; 2], Format::R32Float, STORED);
        let mut recorder = Recorder::new(&gpu, &mut self.timer, false, [side; 2]);
        if let Some(pass) = &self.read_map {
            recorder.run(pass).bind("shown", &layers[layer]).bind("values", &out).per_pixel();
            recorder.finish()?;
            pass.forget();
        }
        let depth = match values.texture() {
            Some(texture) => bytemuck::pod_collect_to_vec(&gpu.read_texture(texture)?),
            None => Vec::new(),
        };
        let size = size_of::<LightView>() as u64;
        let view = bytemuck::pod_read_unaligned(&gpu.read_range(&light_views, layer as u64 * size, size)?);
        let samples = self.layer_samples(layer, side)?;
        let places = self.analysis.places(&gpu)?;
        let size = self.targets.size()?;
        Ok(Some(MapLayer {
            layer: layer as u32,
            layers: layers.len() as u32,
            side,
            depth,
            view,
            samples,
            places,
            size,
        }))
    }

    fn layer_samples(&self, layer: usize, side: u32) -> Result<Option<Vec<u32>>> {
        let Some(maps) = self.analysis.maps() else { return Ok(None) };
        let (width, first) = (maps.size[0] as u64, layer as u64 * maps.layer());
        let mut samples = vec![0; side as usize * side as usize];
        let counted = self.analysis.counts(&self.gpu, |at, counts| {
            for (i, count) in counts.iter().enumerate() {
                let Some(texel) = (at + i as u64).checked_sub(first).filter(|t| *t < maps.layer()) else { continue };
                let (x, y) = (texel % width, texel / width);
                if x < side as u64 && y < side as u64 {
                    samples[(y * side as u64 + x) as usize] = *count;
                }
            }
        })?;
        Ok(counted.then_some(samples))
    }
}
