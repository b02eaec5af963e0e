//! Reading the last frame back: whole buffers, and the value at one pixel.

use super::{Analysis, NO_FRAME, Renderer};
use crate::chart::digits;
use crate::gpu::{Buffer, Slot};
use crate::legend::{Known, letter};
use crate::light::LightView;
use crate::map::fit::lixel::Plane;
use crate::measure::causes::CAUSES;
use crate::setup::Setup;
use crate::view::Drawn;
use anyhow::{Context, Result};
use glam::Vec3;

const PIXEL: wgpu::Extent3d = wgpu::Extent3d { width: 1, height: 1, depth_or_array_layers: 1 };

/// A picture in memory: four bytes a pixel, sRGB-encoded, rows from the top.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Pixels {
    pub size: [u32; 2],
    pub rgba: Vec<u8>,
}

impl Renderer {
    /// Reads the picture back: four bytes per pixel, rows from the top. Where a set-up is transparent colours are multiplied by their alpha.
    pub fn read_picture(&self) -> Result<Vec<u8>> {
        self.gpu.read_texture(self.output().context(NO_FRAME)?)
    }

    /// Width of what is read back, pixels: a side's of a comparison.
    pub fn read_width(&self) -> Result<usize> {
        Ok(self.targets.size()?[0] as usize)
    }

    /// Reads the technique's visibility back, a number per pixel.
    pub fn read_visibility(&self) -> Result<Vec<f32>> {
        Ok(bytemuck::pod_collect_to_vec(&self.read(&self.targets.visibility)?))
    }

    /// Reads the truth back, a number per pixel: the mean over as many samples as the last frame's set-up names
    /// ([`crate::truth::Samples::shown`]), which with one is the hard truth.
    pub fn read_truth(&self) -> Result<Vec<f32>> {
        Ok(bytemuck::pod_collect_to_vec(&self.read(self.truth.shown().context(NO_FRAME)?)?))
    }

    /// Reads the truth back that tells lit pixels, from 0.5 up, from those in shadow: [`crate::truth::Tracing::labels`].
    pub fn read_labels(&self) -> Result<Vec<f32>> {
        Ok(bytemuck::pod_collect_to_vec(&self.read(self.truth.labels().context(NO_FRAME)?)?))
    }

    /// Reads the truth of the one sample at each pixel's centre back, 0 or 1 a pixel.
    pub fn read_hard_truth(&self) -> Result<Vec<f32>> {
        Ok(bytemuck::pod_collect_to_vec(&self.read(self.truth.hard().context(NO_FRAME)?)?))
    }

    /// Reads the technique's own map back, if the last frame's view was one of those: a number per pixel, which the view's
    /// kind gives a meaning.
    pub fn read_map(&self) -> Result<Vec<f32>> {
        Ok(bytemuck::pod_collect_to_vec(&self.read(&self.targets.map)?))
    }

    /// The plane of the triangle at one pixel of the last frame; None for background.
    pub fn plane_at(&self, pixel: [u32; 2]) -> Result<Option<Plane>> {
        let Some((pixel, _)) = self.figure.pixel(pixel) else { return Ok(None) };
        if self.surface_at(pixel)?.is_none() {
            return Ok(None);
        }
        let texture = self.targets.surface.texture().context(NO_FRAME)?;
        let words: [u32; 4] = bytemuck::pod_read_unaligned(&self.gpu.read_texels(texture, pixel, PIXEL)?);
        Ok(Plane::of(self.geometry.corners(words[3] as usize).map(|p| p.as_dvec3())))
    }

    /// Draws the last frame's picture shaded with the truth in place of the technique's visibility, and reads it back as
    /// [`Renderer::read_picture`] would. That frame must have traced the truth.
    pub fn read_truth_picture(&mut self, setup: &Setup) -> Result<Vec<u8>> {
        self.trace_other_lights(setup)?;
        self.shade_truth(setup)?;
        self.read(&self.targets.output)
    }

    /// How many of the technique's and of the truth's rays gave up before they knew (`max_visits`).
    pub fn read_gave_up(&self) -> Result<[u32; 2]> {
        let truth = self.truth.tally().context(NO_FRAME)?;
        let beside = self.lights.tally().map_or(Ok([0; 4]), |tally| self.read_tally(tally))?;
        Ok([self.read_tally(&self.tally)?[0] + beside[0], self.read_tally(truth)?[0]])
    }

    /// What of the scene the adapter had no room for, a sentence.
    pub fn scene_note(&self) -> Option<&str> {
        self.scene_gpu.note.as_deref()
    }

    /// What the last frame did not do as it should, a sentence each.
    pub fn notes(&self) -> Result<Vec<String>> {
        let mut notes = Vec::new();
        if self.sizeless {
            notes.push("No penumbras: the light has no (angular) radius.".into());
        }
        notes.extend(self.technique_notes.iter().cloned());
        for (count, note) in &self.counted_notes {
            let [count]: [u32; 1] = bytemuck::pod_read_unaligned(&self.gpu.read_range(count, 0, 4)?);
            notes.extend((count > 0).then(|| note(count)));
        }
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

    /// What the legend of the last frame's picture needs to know of it, but for errors.
    pub fn known(&self) -> Result<Known> {
        let beside = (1..).map_while(|side| self.figure.beside(side)).map(|b| b.frames);
        let mut known = Known { frames: [self.frames].into_iter().chain(beside).collect(), ..Known::default() };
        if let Some((splits, cascades)) = &self.splits {
            let bytes = self.gpu.read_range(splits, 0, (u64::from(*cascades) + 1) * 4)?;
            known.splits = bytemuck::pod_collect_to_vec(&bytes);
        }
        if let Some(([samples, draws], count)) = &self.faces {
            let words = |buffer, words: u32| -> Result<Vec<u32>> {
                Ok(bytemuck::pod_collect_to_vec(&self.gpu.read_range(buffer, 0, u64::from(words) * 4)?))
            };
            let (samples, draws) = (words(samples, *count)?, words(draws, 10 * count)?);
            // Indices of opaque and masked triangles, and whether there is an instance of them.
            let face = |(samples, draw): (&u32, &[u32])| (draw[1] > 0).then(|| [*samples, (draw[0] + draw[5]) / 3]);
            known.faces = samples.iter().zip(draws.chunks(10)).map(face).collect();
        }
        if self.seen.is_some_and(|v| matches!(v.drawn, Drawn::Depth))
            && let Some(maps) = &self.offered
        {
            let bytes = self.gpu.read_range(&maps.light_views, 0, size_of::<LightView>() as u64)?;
            let view: LightView = bytemuck::pod_read_unaligned(&bytes);
            known.depth = Some([view.near, view.far]);
        }
        Ok(known)
    }

    /// How many shadow rays the technique traced in the last frame, which must have been analysed.
    pub fn read_rays(&self) -> Result<u32> {
        Ok(self.read_tally(&self.tally)?[1])
    }

    fn read_tally(&self, buffer: &Buffer) -> Result<[u32; 4]> {
        Ok(bytemuck::pod_read_unaligned(&self.gpu.read_range(buffer, 0, 16)?))
    }

    /// What the last frame's analysis found; empty unless that frame was analysed.
    pub fn analysis(&self) -> &Analysis {
        &self.analysis
    }

    /// Reads world positions back; w is the depth along the camera's axis, 0 for background.
    pub fn read_position(&self) -> Result<Vec<[f32; 4]>> {
        Ok(bytemuck::pod_collect_to_vec(&self.read(&self.targets.position)?))
    }

    /// Reads the world position at one pixel of the last frame; None for background.
    pub fn position_at(&self, pixel: [u32; 2]) -> Result<Option<Vec3>> {
        // All sides are seen by one camera.
        self.figure.pixel(pixel).map_or(Ok(None), |(pixel, _)| self.surface_at(pixel))
    }

    fn surface_at(&self, pixel: [u32; 2]) -> Result<Option<Vec3>> {
        let texture = self.targets.position.texture().context(NO_FRAME)?;
        let p: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&self.gpu.read_texels(texture, pixel, PIXEL)?);
        Ok(p.first().filter(|p| p[3] > 0.0).map(|p| Vec3::new(p[0], p[1], p[2])))
    }

    /// What the last frame's view shows at a pixel of its picture, as a short text with numbers; None where it shows none.
    /// Of a comparison it names the side that lies there. Reads single values, but waits for the device.
    pub fn value_at(&self, pixel: [u32; 2]) -> Result<Option<String>> {
        let size = self.targets.size()?;
        let Some((pixel, side)) = self.figure.pixel(pixel) else { return Ok(None) };
        if pixel[0] >= size[0] || pixel[1] >= size[1] {
            return Ok(None);
        }
        if !self.figure.compares() {
            return self.value_of(0, pixel);
        }
        if self.seen.is_some_and(|v| v.id == "difference") {
            if self.surface_at(pixel)?.is_none() {
                return Ok(None);
            }
            let [a, b] = [self.visibility_of(0, pixel)?, self.visibility_of(1, pixel)?];
            return Ok(Some(format!("A {} − B {} = {}", short(a), short(b), short(a - b).replace('-', "−"))));
        }
        Ok(self.value_of(side, pixel)?.map(|text| format!("{}: {text}", letter(side))))
    }

    /// The same for a side at one of its pixels.
    fn value_of(&self, side: usize, pixel: [u32; 2]) -> Result<Option<String>> {
        let (seen, map, analysis) = match self.figure.beside(side) {
            Some(b) => (b.seen, &b.map, &b.analysis),
            None => (self.seen, &self.targets.map, &self.analysis),
        };
        let Some(view) = seen else { return Ok(None) };
        match view.drawn {
            Drawn::Aliasing(_) => {
                let values = analysis.aliasing_at(&self.gpu, pixel)?;
                return Ok(values.map(|[m, perspective, projection, _]| {
                    format!("m = {} (perspective {} × projection {})", short(m), short(perspective), short(projection))
                }));
            }
            Drawn::Counts => {
                let texel = analysis.count_at(&self.gpu, pixel, self.targets.size()?)?;
                let many = analysis.maps().is_some_and(|m| m.layers > 1);
                return Ok(texel.map(|[x, y, layer, count]| {
                    let layer = if many { format!(" of map {layer}") } else { String::new() };
                    format!("texel {x}, {y}{layer}: {count} view sample{}", if count == 1 { "" } else { "s" })
                }));
            }
            Drawn::Ramp(_) => {
                let x = self.value(map, pixel)?;
                return Ok((x >= 0.0).then(|| format!("{}: {}", view.title.to_lowercase(), short(x))));
            }
            Drawn::Cells => {
                let x = self.value(map, pixel)?;
                // As in shaders/lib/cells.wgsl.
                let bits = x.to_bits();
                return Ok((x >= 0.0).then(|| format!("texel {}, {}", bits & 16383, bits >> 14 & 16383)));
            }
            Drawn::Common(_) | Drawn::Depth | Drawn::Labels(_) | Drawn::Contact(_) | Drawn::Diagram(_) => {}
        }
        if self.surface_at(pixel)?.is_none() {
            return Ok(None);
        }
        let visibility = self.visibility_of(side, pixel)?;
        Ok(match view.id {
            "visibility" => Some(format!("visibility {}", short(visibility))),
            "causes" => {
                let class = self.value(map, pixel)? as usize;
                Some(CAUSES.get(class.wrapping_sub(1)).map_or("right", |c| c.title).into())
            }
            "error-density" => {
                let share = self.value(map, pixel)?;
                (share >= 0.0).then(|| format!("{} % of the pixels around it are wrong", short(100.0 * share)))
            }
            "flip" => Some(format!("FLIP {}", short(self.value(map, pixel)?))),
            "contact-visibility" => Some(format!("contact shadows let {} through", short(self.value(map, pixel)?))),
            "contact-hits" | "contact-gain" | "truth" | "error" | "error-size" | "difference" => {
                let truth = self.value(self.truth.shown().context(NO_FRAME)?, pixel)?;
                Some(format!("visibility {}, truth {}", short(visibility), short(truth)))
            }
            _ => None,
        })
    }

    /// A side's visibility at one of its pixels.
    fn visibility_of(&self, side: usize, pixel: [u32; 2]) -> Result<f32> {
        let own = self.figure.beside(side).map_or(&self.targets.visibility, |b| &b.visibility);
        let slot = if own.texture().is_some() { own } else { self.truth.shown().context(NO_FRAME)? };
        self.value(slot, pixel)
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

/// Three digits that count; what is less than a millionth is what 32 bits leave of nothing.
fn short(x: f32) -> String {
    digits((f64::from(x) * 1e6).round() * 1e-6)
}
