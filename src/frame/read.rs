//! Reading the last frame back: whole buffers, and the value at one pixel.

use super::{Analysis, NO_FRAME, Renderer, STORED, Shown, Targets};
use crate::gpu::{Recorder, Slot};
use crate::view;
use anyhow::{Context, Result};
use glam::Vec3;
use wgpu::TextureFormat as Format;

const PIXEL: wgpu::Extent3d = wgpu::Extent3d { width: 1, height: 1, depth_or_array_layers: 1 };

impl Renderer {
    /// Reads the picture back: four bytes per pixel, rows from the top.
    pub fn read_picture(&self) -> Result<Vec<u8>> {
        self.read(&self.targets.output)
    }

    /// Reads the technique's visibility back, a number per pixel.
    pub fn read_visibility(&self) -> Result<Vec<f32>> {
        Ok(bytemuck::pod_collect_to_vec(&self.read(&self.targets.visibility)?))
    }

    /// Reads the truth back, a number per pixel: the mean over as many samples as the last frame's set-up names
    /// ([`crate::truth::Samples::shown`]), which with one is the hard truth.
    pub fn read_truth(&self) -> Result<Vec<f32>> {
        Ok(bytemuck::pod_collect_to_vec(&self.read(self.truth.shown())?))
    }

    /// Reads the truth of the one sample at each pixel's centre back, 0 or 1 a pixel.
    pub fn read_hard_truth(&self) -> Result<Vec<f32>> {
        Ok(bytemuck::pod_collect_to_vec(&self.read(self.truth.hard())?))
    }

    /// Reads the technique's own map back, if the last frame's view was one of those: a number per pixel, which the view's
    /// kind gives a meaning.
    pub fn read_map(&self) -> Result<Vec<f32>> {
        Ok(bytemuck::pod_collect_to_vec(&self.read(&self.targets.map)?))
    }

    /// The last frame's picture with the truth in place of the technique's visibility, as [`Renderer::read_picture`]
    /// gives it. That frame must have drawn the view `shaded` and traced the truth.
    pub fn read_truth_picture(&mut self) -> Result<Vec<u8>> {
        let shaded = view::index("shaded").unwrap_or_default() as u32;
        let pass = self.shading.pass(&self.gpu, shaded, 0)?;
        let (t, size) = (&self.targets, self.targets.size()?);
        let (truth, map) = (Targets::view(self.truth.shown())?, Targets::view(&t.map)?);
        let mut picture = Slot::default();
        let output = picture.get(&self.gpu, "picture of the truth", size, Format::Rgba8Unorm, STORED);
        let mut recorder = Recorder::new(&self.gpu, &mut self.timer, false, size);
        recorder
            .run(pass)
            .bind("frame", &self.frame_buffer)
            .bind("view", &self.view_buffer)
            .bind("g_position", Targets::view(&t.position)?)
            .bind("g_surface", Targets::view(&t.surface)?)
            .bind("visibility", truth)
            .bind("truth", truth)
            .bind("map", map)
            .bind("shown", map)
            .bind("light_view", &self.no_light_view)
            .bind("output", &output)
            .per_pixel();
        recorder.finish()?;
        self.read(&picture)
    }

    /// How many of the technique's and of the truth's rays gave up before they knew (`max_visits`).
    pub fn read_gave_up(&self) -> Result<[u32; 2]> {
        Ok([self.read_tally(&self.tally)?[0], self.read_tally(&self.truth.tally)?[0]])
    }

    /// What the last frame did not do as it should, a sentence each.
    pub fn notes(&self) -> Result<Vec<String>> {
        let mut notes = Vec::new();
        if let Some(pieces) = self.analysis.pieces(&self.gpu)?.filter(|p| p.unserved > 0) {
            notes.push(format!(
                "{} parts of triangles were not split as far as they should be: shadows are wrong there.",
                pieces.unserved
            ));
        }
        for (rays, whose) in self.read_gave_up()?.into_iter().zip(["the technique's", "the truth's"]) {
            if rays > 0 {
                notes.push(format!("{rays} of {whose} rays passed max_visits and count as lit."));
            }
        }
        Ok(notes)
    }

    /// How many shadow rays the technique traced in the last frame, which must have been analysed.
    pub fn read_rays(&self) -> Result<u32> {
        Ok(self.read_tally(&self.tally)?[1])
    }

    fn read_tally(&self, buffer: &wgpu::Buffer) -> Result<[u32; 4]> {
        Ok(bytemuck::pod_read_unaligned(&self.gpu.read_range(buffer, 0, 16)?))
    }

    /// What the last frame's analysis found; empty unless that frame was analysed.
    pub fn analysis(&self) -> &Analysis {
        &self.analysis
    }

    /// Classes of the last frame's pixels, as [`crate::measure::metrics`] names them.
    pub fn read_mask(&mut self) -> Result<Vec<u32>> {
        let size = self.targets.size()?;
        let mask = self.targets.mask.get(&self.gpu, "mask", size, Format::R32Uint, STORED);
        let mut recorder = Recorder::new(&self.gpu, &mut self.timer, false, size);
        recorder
            .run(&self.classify)
            .bind("frame", &self.frame_buffer)
            .bind("g_position", Targets::view(&self.targets.position)?)
            .bind("g_surface", Targets::view(&self.targets.surface)?)
            .bind("mask", &mask)
            .per_pixel();
        recorder.finish()?;
        Ok(bytemuck::pod_collect_to_vec(&self.read(&self.targets.mask)?))
    }

    /// Reads world positions back; w is the depth along the camera's axis, 0 for background.
    pub fn read_position(&self) -> Result<Vec<[f32; 4]>> {
        Ok(bytemuck::pod_collect_to_vec(&self.read(&self.targets.position)?))
    }

    /// Reads the world position at one pixel of the last frame; None for background.
    pub fn position_at(&self, pixel: [u32; 2]) -> Result<Option<Vec3>> {
        let texture = self.targets.position.texture().context(NO_FRAME)?;
        let p: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&self.gpu.read_texels(texture, pixel, PIXEL)?);
        Ok(p.first().filter(|p| p[3] > 0.0).map(|p| Vec3::new(p[0], p[1], p[2])))
    }

    /// What the last frame's view shows at one of its pixels, as a short text with numbers; None where it shows none.
    /// Reads single values, but waits for the device.
    pub fn value_at(&self, pixel: [u32; 2]) -> Result<Option<String>> {
        let size = self.targets.size()?;
        if pixel[0] >= size[0] || pixel[1] >= size[1] {
            return Ok(None);
        }
        let (view, title, shown) = &self.seen;
        match shown {
            Some(Shown::Aliasing(..)) => {
                let values = self.analysis.aliasing_at(&self.gpu, pixel)?;
                return Ok(values.map(|[m, perspective, projection, _]| {
                    format!("m = {} (perspective {} × projection {})", short(m), short(perspective), short(projection))
                }));
            }
            Some(Shown::Counts) => {
                let texel = self.analysis.count_at(&self.gpu, pixel, size)?;
                let many = self.analysis.maps().is_some_and(|m| m.layers > 1);
                return Ok(texel.map(|[x, y, layer, count]| {
                    let layer = if many { format!(" of map {layer}") } else { String::new() };
                    format!("texel {x}, {y}{layer}: {count} view sample{}", if count == 1 { "" } else { "s" })
                }));
            }
            Some(Shown::Ramp(_)) => {
                let x = self.value(&self.targets.map, pixel)?;
                return Ok((x >= 0.0).then(|| format!("{}: {}", title.to_lowercase(), short(x))));
            }
            Some(Shown::Cells) => {
                let x = self.value(&self.targets.map, pixel)?;
                // As in shaders/lib/cells.wgsl.
                let bits = x.to_bits();
                return Ok((x >= 0.0).then(|| format!("texel {}, {}", bits & 16383, bits >> 14 & 16383)));
            }
            Some(Shown::Texture(..) | Shown::Labels) | None => {}
        }
        if self.position_at(pixel)?.is_none() {
            return Ok(None);
        }
        let visibility = self.value(&self.targets.visibility, pixel)?;
        Ok(match view.as_str() {
            "visibility" => Some(format!("visibility {}", short(visibility))),
            "truth" | "error" | "acne" | "detachment" | "split" => {
                let truth = self.value(self.truth.shown(), pixel)?;
                Some(format!("visibility {}, truth {}", short(visibility), short(truth)))
            }
            _ => None,
        })
    }

    /// One number of a target.
    fn value(&self, slot: &Slot, pixel: [u32; 2]) -> Result<f32> {
        let texture = slot.texture().context(NO_FRAME)?;
        Ok(bytemuck::pod_read_unaligned(&self.gpu.read_texels(texture, pixel, PIXEL)?))
    }

    /// Reads the G-buffer's surface words back: normals and albedo, and last the triangle.
    pub fn read_surface(&self) -> Result<Vec<[u32; 4]>> {
        Ok(bytemuck::pod_collect_to_vec(&self.read(&self.targets.surface)?))
    }

    fn read(&self, slot: &Slot) -> Result<Vec<u8>> {
        self.gpu.read_texture(slot.texture().context(NO_FRAME)?)
    }
}

/// Three significant digits.
fn short(x: f32) -> String {
    let digits = if x == 0.0 { 0 } else { (2 - x.abs().log10().floor() as i32).clamp(0, 6) as usize };
    let text = format!("{x:.digits$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').into() } else { text }
}
