//! A figure: the picture of one technique with an overlay, or of several techniques side by side.

use super::{
    Analysis, Ask, DRAWN, Drawing, Indirect, Layer, Made, NO_FRAME, Renderer, STORED, Targets, Told, ToldSide,
};
use crate::gpu::{Gpu, Recorder, Slot};
use crate::setup::{Arrange, Overlay, Setup, Side};
use crate::techniques;
use crate::truth::{Samples, Tracing};
use crate::view::{self, Drawn, Group, Legend, VIEWS, View};
use anyhow::{Context, Result};
use std::mem::swap;
use wgpu::TextureFormat as Format;

/// A part of the figure that one side fills.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pane {
    /// The side, from 0.
    pub side: usize,
    /// Pixels that the side is rendered at.
    pub size: [u32; 2],
    /// What of that is shown: upper left corner, width and height.
    pub part: [u32; 4],
    /// Where its upper left corner goes.
    pub at: [u32; 2],
}

/// The parts of a set-up's figure of `size` pixels. Sides that are not seen have none.
pub fn panes(setup: &Setup, size: [u32; 2]) -> Vec<Pane> {
    let [w, h] = size;
    let whole = |side| Pane { side, size, part: [0, 0, w, h], at: [0, 0] };
    match (setup.sides(), setup.arrange) {
        (1, _) => vec![whole(0)],
        _ if setup.view == "difference" => vec![whole(0)],
        (n, Arrange::Flicker) => vec![whole((setup.front as usize).min(n - 1))],
        (2, Arrange::Swipe) => {
            let line = ((setup.split * w as f32).round() as u32).min(w);
            let all = [
                Pane { part: [0, 0, line, h], ..whole(0) },
                Pane { part: [line, 0, w - line, h], at: [line, 0], ..whole(1) },
            ];
            all.into_iter().filter(|p| p.part[2] > 0).collect()
        }
        (n, _) => {
            // Two columns; a row for each two sides.
            let rows = n.div_ceil(2) as u32;
            let size = [(w / 2).max(1), (h / rows).max(1)];
            let at = |i: u32| [i % 2 * (w - size[0]), i / 2 * (h - size[1])];
            (0..n).map(|i| Pane { side: i, size, part: [0, 0, size[0], size[1]], at: at(i as u32) }).collect()
        }
    }
}

/// What figures are made of beside the frame's own targets.
#[derive(Default)]
pub(super) struct Figure {
    picture: Slot,
    over: Slot,
    /// What the frame being rendered is drawn as.
    pub(super) layer: Layer,
    /// A side shows all lights with their truths.
    pub(super) truly_lit: bool,
    /// The last frame was composed into `picture`.
    composed: bool,
    /// The parts of the last frame, and pixels of the whole.
    panes: Vec<Pane>,
    size: [u32; 2],
    /// The second side and those behind it.
    beside: Vec<Beside>,
}

/// What a side that is not the first has of its own, as the renderer has the first one's.
#[derive(Default)]
pub(super) struct Beside {
    made: Option<Made>,
    /// Empty: the truth's.
    pub(super) visibility: Slot,
    pub(super) map: Slot,
    output: Slot,
    pub(super) analysis: Analysis,
    pub(super) seen: Option<&'static View>,
    indirect: Option<Indirect>,
    /// As [`Told::frames`] has it first.
    pub(super) frames: u32,
}

impl Figure {
    pub(super) fn texture(&self) -> Option<&wgpu::Texture> {
        self.picture.texture().filter(|_| self.composed)
    }

    /// A plain frame follows.
    pub(super) fn forget(&mut self) {
        self.composed = false;
        self.panes.clear();
    }

    /// Whether the last frame's picture shows several sides, or the difference of two.
    pub(super) fn compares(&self) -> bool {
        !self.panes.is_empty()
    }

    /// A side of the last comparison; None: the first one.
    pub(super) fn beside(&self, side: usize) -> Option<&Beside> {
        self.beside.get(side.checked_sub(1)?)
    }

    /// Visibility that the view `difference` takes off; None: the truth's.
    pub(super) fn other(&self) -> Option<&wgpu::TextureView> {
        self.beside.first().and_then(|b| b.visibility.view())
    }

    /// The picture's rows, from the top, that have what a set-up's view needs.
    pub(super) fn rows(&self, setup: &Setup, truth: &Tracing) -> u32 {
        let other = setup.view == "difference" && self.other().is_some();
        if setup.needs_truth() && !other { truth.rows() } else { u32::MAX }
    }

    /// Where a pixel of the figure lies in the frame of its side, and which side that is; None: beside all.
    pub(super) fn pixel(&self, [x, y]: [u32; 2]) -> Option<([u32; 2], usize)> {
        if self.panes.is_empty() {
            return Some(([x, y], 0));
        }
        let inside = |p: &&Pane| {
            let d = [x.wrapping_sub(p.at[0]), y.wrapping_sub(p.at[1])];
            d[0] < p.part[2] && d[1] < p.part[3]
        };
        let p = self.panes.iter().find(inside)?;
        Some(([x - p.at[0] + p.part[0], y - p.at[1] + p.part[1]], p.side))
    }
}

/// The shaded view.
pub(super) fn shaded(setup: &Setup) -> Drawing {
    Drawing::new(setup, view::index("shaded").unwrap_or_default() as u32, Drawn::Common(Legend::None))
}

/// The set-up that a side of a figure is drawn by: shaded, where it has no such view.
fn drawn_side(setup: &Setup, side: usize) -> Result<Setup> {
    let mut own = setup.side(side);
    let info = techniques::find_or_say(&own.technique)?;
    let lacks = |id: &str| view::find(id, info, own.values()).is_none();
    if lacks(&own.view) || own.overlay.as_ref().is_some_and(|o| lacks(&o.view)) {
        own.view = VIEWS[0].id.into();
        own.overlay = None;
    }
    Ok(own)
}

const COPIED: wgpu::TextureUsages = STORED.union(wgpu::TextureUsages::COPY_DST);

impl Renderer {
    /// Renders what the set-up's picture shows: its technique, with the overlay, or all sides of its comparison. What is
    /// read back afterwards, but for the picture and [`Renderer::read_side`], is of the first side.
    ///
    /// # Errors
    /// As [`Renderer::render`].
    pub fn draw(&mut self, setup: &Setup, ask: Ask) -> Result<Told> {
        let beside = &mut self.figure.beside;
        beside.resize_with(setup.against.len(), Beside::default);
        // The truth needs nothing of the technique that was there before it.
        let replaced = beside.iter_mut().zip(&setup.against).filter(|(b, s)| s.is_truth() && b.made.is_some());
        replaced.for_each(|(b, _)| *b = Beside::default());
        if setup.against.is_empty() {
            return self.render_over(setup, ask);
        }
        // All sides are held against one truth.
        let setup = &Setup { truth_samples: Samples::Fixed(setup.shown_samples()), ..setup.clone() };
        let panes = panes(setup, ask.size);
        // All parts have one size.
        let size = panes[0].size;
        // A side that the swipe line hides is drawn too: the line can then be moved at once.
        let alone = setup.view == "difference";
        let seen = |side: usize| !alone || side == 0;
        let mut sides = vec![ToldSide::default(); setup.sides()];
        let mut told = Told { frames: [1, 1], ..Told::default() };
        let averaged = |[now, wanted]: [u32; 2]| f64::from(now) / f64::from(wanted);
        // The first one last, so that what is read back is its.
        for i in (0..setup.sides()).rev().filter(|i| !setup.is_truth(*i)) {
            let ask_side = Ask { size, picture: ask.picture && seen(i), ..ask };
            let side = drawn_side(setup, i)?;
            self.exchange_side(i);
            self.figure.truly_lit = i == 0 && setup.against.iter().any(Side::is_truth);
            let rendered = self.render_over(&side, ask_side);
            self.figure.truly_lit = false;
            self.exchange_side(i);
            let frames = told.frames;
            told = rendered?;
            if averaged(frames) < averaged(told.frames) {
                told.frames = frames;
            }
            sides[i].gpu_bytes = told.gpu_bytes;
            if ask.timed {
                self.collect_times(true)?;
                sides[i].passes = self.timer.by_name();
                self.time_lights(&mut told.lights);
            }
            sides[i].lights = told.lights.clone();
        }
        for i in (1..setup.sides()).filter(|i| setup.is_truth(*i) && ask.picture && seen(*i)) {
            self.exchange_side(i);
            let drawn = self.draw_truth(setup, size);
            self.exchange_side(i);
            drawn?;
        }
        self.figure.size = ask.size;
        if ask.picture {
            self.compose(setup)?;
        }
        told.sides = sides;
        Ok(told)
    }

    /// Reads the visibility of a side of the last comparison back, a number a pixel of that side; the first is 0.
    pub fn read_side(&self, side: usize) -> Result<Vec<f32>> {
        match side.checked_sub(1) {
            None => self.read_visibility(),
            Some(i) => {
                let held = self.figure.beside.get(i).and_then(|b| b.visibility.texture());
                let held = held.context("this side has not been rendered yet")?;
                Ok(bytemuck::pod_collect_to_vec(&self.gpu.read_texture(held)?))
            }
        }
    }

    /// Exchanges what a side that is not the first has of its own with what is in use.
    pub(super) fn exchange_side(&mut self, side: usize) {
        let Some(beside) = side.checked_sub(1).and_then(|i| self.figure.beside.get_mut(i)) else { return };
        swap(&mut self.made, &mut beside.made);
        swap(&mut self.targets.visibility, &mut beside.visibility);
        swap(&mut self.targets.map, &mut beside.map);
        swap(&mut self.targets.output, &mut beside.output);
        swap(&mut self.analysis, &mut beside.analysis);
        swap(&mut self.seen, &mut beside.seen);
        swap(&mut self.shading.indirect, &mut beside.indirect);
        swap(&mut self.frames, &mut beside.frames);
    }

    /// Draws the picture of a side that is the truth, which has been taken in use: as of a technique that is always right.
    /// Of another technique's maps it has none, and is shaded.
    fn draw_truth(&mut self, setup: &Setup, size: [u32; 2]) -> Result<()> {
        // Where the errors of others are read the truth has zeros: it is never written.
        self.targets.map.get(&self.gpu, "no errors", size, Format::R32Float, STORED);
        self.targets.output.get(&self.gpu, "picture", size, Format::Rgba8Unorm, STORED | DRAWN);
        let overlay = setup.overlay.as_ref();
        let Some(i) = view::index(overlay.map_or(&setup.view, |o| &o.view)) else {
            self.seen = None;
            return self.shade_truth(setup);
        };
        let view = &VIEWS[i];
        self.seen = Some(view);
        let rows = if view.group == Group::Scene { u32::MAX } else { self.lights.rows(self.truth.rows()) };
        let layer = if overlay.is_some() { Layer::Over } else { Layer::Alone };
        self.shade_again(Drawing { layer, rows, ..Drawing::new(setup, i as u32, view.drawn) }, true)?;
        overlay.map_or(Ok(()), |overlay| self.lay_over(setup, overlay, true))
    }

    /// Puts the pictures of the sides together.
    pub(super) fn compose(&mut self, setup: &Setup) -> Result<()> {
        let size = self.figure.size;
        let usage = COPIED | wgpu::TextureUsages::RENDER_ATTACHMENT;
        let view = self.figure.picture.get(&self.gpu, "figure", size, Format::Rgba8Unorm, usage);
        let to = self.figure.picture.texture().context(NO_FRAME)?;
        let panes = panes(setup, size);
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        // Parts need not fill the whole.
        let ops = wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::BLACK), store: wgpu::StoreOp::Store };
        encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("ground"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &view,
                depth_slice: None,
                resolve_target: None,
                ops,
            })],
            ..Default::default()
        });
        self.gpu.queue.submit([encoder.finish()]);
        for pane in &panes {
            let from = self.figure.beside(pane.side).map_or(&self.targets.output, |b| &b.output);
            let [x, y, w, h] = pane.part;
            copy(&self.gpu, from.texture().context(NO_FRAME)?, [x, y], to, pane.at, [w, h]);
        }
        (self.figure.composed, self.figure.panes) = (true, panes);
        Ok(())
    }

    /// Renders the side of the last figure that is in use once more, without the figure taking notice.
    pub(super) fn again(&mut self, setup: &Setup, side: usize, ask: Ask) -> Result<Told> {
        // As it was rendered in the figure.
        let again = Setup { truth_samples: Samples::Fixed(setup.shown_samples()), ..drawn_side(setup, side)? };
        let kept = (self.figure.composed, std::mem::take(&mut self.figure.panes), self.seen);
        let rendered = self.render_over(&again, ask);
        (self.figure.composed, self.figure.panes, self.seen) = kept;
        rendered
    }

    /// Renders one technique's picture, with the set-up's overlay over it.
    fn render_over(&mut self, setup: &Setup, ask: Ask) -> Result<Told> {
        let Some(overlay) = setup.overlay.as_ref().filter(|_| ask.picture) else { return self.render(setup, ask) };
        self.figure.layer = Layer::Over;
        let rendered = self.render(&Setup { view: overlay.view.clone(), ..setup.clone() }, ask);
        self.figure.layer = Layer::Alone;
        let told = rendered?;
        self.lay_over(setup, overlay, false)?;
        Ok(told)
    }

    /// Lays the picture just drawn over the shaded one; `truth`: shaded with it in place of the visibility.
    fn lay_over(&mut self, setup: &Setup, overlay: &Overlay, truth: bool) -> Result<()> {
        let size = self.targets.size()?;
        self.figure.over.get(&self.gpu, "overlay", size, Format::Rgba8Unorm, COPIED);
        let (from, to) = (self.targets.output.texture(), self.figure.over.texture());
        copy(&self.gpu, from.context(NO_FRAME)?, [0, 0], to.context(NO_FRAME)?, [0, 0], size);
        let opacity = if overlay.inset { 1.0 } else { overlay.opacity.min(0.999) };
        let rows = if truth { self.lights.rows(self.truth.rows()) } else { u32::MAX };
        self.shade_again(Drawing { layer: Layer::Below, opacity, rows, ..shaded(setup) }, truth)
    }

    /// Draws the last frame's picture shaded, with the truth in place of the visibility.
    pub(super) fn shade_truth(&mut self, setup: &Setup) -> Result<()> {
        let rows = self.lights.rows(self.truth.rows());
        self.shade_again(Drawing { rows, ..shaded(setup) }, true)
    }

    /// Draws the last frame's picture again; `truth`: in place of the visibility.
    pub(super) fn shade_again(&mut self, picture: Drawing, truth: bool) -> Result<()> {
        // Beside the maps of another side the truth is lit by one light, as these are.
        let more_lights = picture.more_lights && self.lights.sum(truth).is_some();
        let picture = Drawing { more_lights, ..picture };
        let (t, size) = (&self.targets, self.targets.size()?);
        let exact = Targets::view(self.truth.shown().context(NO_FRAME)?)?;
        let map = Targets::view(&t.map)?;
        let over = self.figure.over.get(&self.gpu, "overlay", size, Format::Rgba8Unorm, COPIED);
        let mut recorder = Recorder::new(&self.gpu, &mut self.timer, false, size);
        recorder.set("frame", &self.frame_buffer);
        recorder.set("visibility", if truth { exact } else { Targets::view(&t.visibility)? });
        let output = Targets::view(&t.output)?;
        for (name, view) in [
            ("g_position", Targets::view(&t.position)?),
            ("g_surface", Targets::view(&t.surface)?),
            ("map", map),
            ("output", output),
            ("truth", exact),
            ("other", exact),
            ("others", self.lights.sum(truth).unwrap_or(exact)),
            ("over", &over),
        ] {
            recorder.set(name, view);
        }
        self.shading.record(&mut recorder, picture, map, (self.offered.as_ref(), self.analysis.aliasing_view()))?;
        if picture.layer != Layer::Over {
            let id = self.seen.map_or("", |v| v.id);
            self.lines.draw(&mut recorder, id, &picture.drawn, picture.opacity >= 1.0, &[], output);
        }
        recorder.finish()?;
        self.gpu.check()
    }
}

fn copy(gpu: &Gpu, from: &wgpu::Texture, at: [u32; 2], to: &wgpu::Texture, goes: [u32; 2], size: [u32; 2]) {
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let place = |[x, y]: [u32; 2]| wgpu::Origin3d { x, y, z: 0 };
    encoder.copy_texture_to_texture(
        wgpu::TexelCopyTextureInfo { origin: place(at), ..from.as_image_copy() },
        wgpu::TexelCopyTextureInfo { origin: place(goes), ..to.as_image_copy() },
        wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
    );
    gpu.queue.submit([encoder.finish()]);
}
