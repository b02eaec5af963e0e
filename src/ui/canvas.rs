//! The window's surface: the picture and, over it, egui.
//!
//! The window's contents are kept in a texture, of which only those parts are drawn again that have changed: on software
//! adapters egui's fragments are dear, and a row that lights up under the pointer must not cost a whole window.

use super::stage::Picture;
use crate::gpu::{Buffer, Gpu, Slot};
use anyhow::{Context, Result, ensure};
use bytemuck::{Pod, Zeroable};
use egui::epaint::{ClippedShape, ImageData, ImageDelta, Shape};
use egui::{ClippedPrimitive, ColorImage, Rect, TextureId, TextureOptions, TexturesDelta};
use egui_wgpu::ScreenDescriptor;
use std::collections::HashMap;
use std::sync::Arc;

/// As `Placed` in `shaders/blit.wgsl`: left, top, right and bottom in the window's pixels.
#[repr(C)]
#[derive(Clone, Copy, Default, PartialEq, Pod, Zeroable)]
struct Placed {
    /// Of the picture.
    picture: [f32; 4],
    /// Of the viewport, beyond which nothing of it is shown.
    viewport: [f32; 4],
}

pub struct Canvas {
    surface: wgpu::Surface<'static>,
    config: wgpu::SurfaceConfiguration,
    egui: egui_wgpu::Renderer,
    blit: wgpu::RenderPipeline,
    sampler: wgpu::Sampler,
    placed: (Placed, Buffer),
    /// What the window shows.
    screen: Slot,
    /// The picture with what binds it.
    picture: Option<(wgpu::Texture, wgpu::BindGroup, Picture)>,
    /// What egui has handed in, for another device.
    textures: HashMap<TextureId, (Arc<ColorImage>, TextureOptions)>,
    /// What egui has drawn, at how many pixels a point.
    shapes: (Vec<ClippedShape>, f32),
    /// What egui knows the picture by.
    known: Option<TextureId>,
    /// The surface follows the window's size.
    configured: bool,
    /// The surface must be made anew.
    lost: bool,
    /// The screen has changed since it was presented.
    owed: bool,
}

impl Canvas {
    /// # Errors
    /// A surface that the adapter cannot draw on.
    pub fn new(gpu: &Gpu, surface: wgpu::Surface<'static>, size: [u32; 2]) -> Result<Canvas> {
        let able = surface.get_capabilities(&gpu.adapter);
        let config = surface.get_default_config(&gpu.adapter, size[0].max(1), size[1].max(1));
        let mut config = config.context("the graphics adapter cannot draw in this window")?;
        // The picture and egui's colours are sRGB-encoded already.
        if let Some(plain) = able.formats.iter().find(|f| !f.is_srgb()) {
            config.format = *plain;
        }
        config.present_mode = wgpu::PresentMode::AutoVsync;
        config.usage |= wgpu::TextureUsages::COPY_DST;
        ensure!(able.usages.contains(config.usage), "the graphics adapter cannot copy pictures into this window");
        let module = &gpu.shader("blit.wgsl", &[])?.on_device;
        let blit = gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("blit"),
            layout: None,
            vertex: wgpu::VertexState {
                module,
                entry_point: Some("corner"),
                compilation_options: Default::default(),
                buffers: &[],
            },
            primitive: Default::default(),
            depth_stencil: None,
            multisample: Default::default(),
            fragment: Some(wgpu::FragmentState {
                module,
                entry_point: Some("fill"),
                compilation_options: Default::default(),
                targets: &[Some(config.format.into())],
            }),
            multiview_mask: None,
            cache: None,
        });
        let sampler = gpu.device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("blit"),
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            ..Default::default()
        });
        let placed = Placed::default();
        let buffer = gpu.buffer("placed", bytemuck::bytes_of(&placed), wgpu::BufferUsages::UNIFORM);
        let mut canvas = Canvas {
            egui: egui_wgpu::Renderer::new(&gpu.device, config.format, Default::default()),
            surface,
            config,
            blit,
            sampler,
            placed: (placed, buffer),
            screen: Slot::default(),
            picture: None,
            textures: HashMap::new(),
            shapes: (Vec::new(), 0.0),
            known: None,
            configured: false,
            lost: false,
            owed: false,
        };
        // Nothing of it is shown: the viewport is empty still.
        canvas.take(gpu, Picture { size: [1; 2], full: [1; 2], rgba: vec![0; 4] });
        Ok(canvas)
    }

    /// Shows what another one showed, whose device is lost.
    pub fn take_over(&mut self, gpu: &Gpu, before: Canvas) {
        for (id, (image, options)) in &before.textures {
            self.egui.update_texture(&gpu.device, &gpu.queue, *id, &ImageDelta::full(image.clone(), *options));
        }
        self.textures = before.textures;
        if let Some((_, _, picture)) = before.picture {
            self.take(gpu, picture);
        }
    }

    /// Whether the window system has dropped the surface, so that another must be given.
    pub fn wants_surface(&self) -> bool {
        self.lost
    }

    /// Goes on with another surface of the same window.
    pub fn give(&mut self, surface: wgpu::Surface<'static>) {
        (self.surface, self.lost, self.configured) = (surface, false, false);
    }

    /// Follows the window's size, pixels.
    pub fn resize(&mut self, size: [u32; 2]) {
        if [self.config.width, self.config.height] != size {
            [self.config.width, self.config.height] = size;
            self.configured = false;
        }
    }

    /// The window system has lost what the window showed.
    pub fn expose(&mut self) {
        self.owed = true;
    }

    /// Takes the picture to show from here on: what egui knows its pixels by, and how many they are.
    pub fn take(&mut self, gpu: &Gpu, picture: Picture) -> (TextureId, [u32; 2]) {
        let size = wgpu::Extent3d { width: picture.size[0], height: picture.size[1], depth_or_array_layers: 1 };
        let (texture, group) = match self.picture.take() {
            Some((texture, group, _)) if texture.size() == size => (texture, group),
            _ => {
                let (texture, group) = self.bind(gpu, size);
                let view = texture.create_view(&Default::default());
                match self.known {
                    Some(id) => {
                        self.egui.update_egui_texture_from_wgpu_texture(
                            &gpu.device,
                            &view,
                            wgpu::FilterMode::Nearest,
                            id,
                        );
                    }
                    None => {
                        let id = self.egui.register_native_texture(&gpu.device, &view, wgpu::FilterMode::Nearest);
                        self.known = Some(id);
                    }
                }
                (texture, group)
            }
        };
        gpu.queue.write_texture(
            texture.as_image_copy(),
            &picture.rgba,
            wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(4 * size.width), rows_per_image: None },
            size,
        );
        self.picture = Some((texture, group, picture));
        // It is drawn with the next frame.
        self.placed.0 = Placed::default();
        (self.known.unwrap_or_default(), [size.width, size.height])
    }

    fn bind(&self, gpu: &Gpu, size: wgpu::Extent3d) -> (wgpu::Texture, wgpu::BindGroup) {
        let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("picture"),
            size,
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rgba8Unorm,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let view = texture.create_view(&Default::default());
        let resources = [
            wgpu::BindingResource::TextureView(&view),
            wgpu::BindingResource::Sampler(&self.sampler),
            self.placed.1.as_entire_binding(),
        ];
        let entries = (0..).zip(resources).map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource });
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("blit"),
            layout: &self.blit.get_bind_group_layout(0),
            entries: &entries.collect::<Vec<_>>(),
        });
        (texture, group)
    }

    /// Draws what has changed of egui's shapes and of the picture in its viewport (pixels from the window's upper left
    /// corner), and presents it. False: the window could not take it, try again.
    pub fn show(
        &mut self,
        gpu: &Gpu,
        ctx: &egui::Context,
        shapes: Vec<ClippedShape>,
        mut delta: TexturesDelta,
        viewport: Rect,
        scale: f32,
    ) -> bool {
        // The font's texture only grows: what is written anew is a shape that changes.
        let mut redrawn: Vec<egui::TextureId> = Vec::new();
        for (id, changes) in delta.set.drain() {
            if id != egui::TextureId::default() {
                redrawn.push(id);
            }
            for change in changes {
                self.keep(id, &change);
                self.egui.update_texture(&gpu.device, &gpu.queue, id, &change);
            }
        }
        let shown = self.draw(gpu, ctx, shapes, &redrawn, viewport, scale);
        for id in delta.free.drain() {
            self.egui.free_texture(&id);
            self.textures.remove(&id);
        }
        shown
    }

    /// Keeps what egui hands in: a whole texture, or a part of one.
    fn keep(&mut self, id: TextureId, change: &ImageDelta) {
        let ImageData::Color(image) = &change.image;
        match (change.pos, self.textures.get_mut(&id)) {
            (None, _) => _ = self.textures.insert(id, (image.clone(), change.options)),
            (Some([x, y]), Some((held, _))) => {
                let held = Arc::make_mut(held);
                let [width, height] = image.size;
                for row in 0..height.min(held.size[1].saturating_sub(y)) {
                    let width = width.min(held.size[0].saturating_sub(x));
                    let to = (y + row) * held.size[0] + x;
                    let from = row * image.size[0];
                    held.pixels[to..to + width].copy_from_slice(&image.pixels[from..from + width]);
                }
            }
            (Some(_), None) => {}
        }
    }

    fn draw(
        &mut self,
        gpu: &Gpu,
        ctx: &egui::Context,
        shapes: Vec<ClippedShape>,
        redrawn: &[egui::TextureId],
        viewport: Rect,
        scale: f32,
    ) -> bool {
        let size = [self.config.width, self.config.height];
        let whole = Rect::from_min_size(egui::Pos2::ZERO, egui::vec2(size[0] as f32, size[1] as f32));
        let mut damage = Damage::default();
        let kept = self.screen.texture().is_some_and(|t| [t.width(), t.height()] == size) && self.shapes.1 == scale;
        let usage = wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC;
        self.screen.get(gpu, "window", size, self.config.format, usage);
        let Some((_, _, Picture { full, .. })) = &self.picture else { return true };
        // A picture made for another viewport keeps its scale and its place until the next one is there.
        let picture = Rect::from_min_size(viewport.min, egui::vec2(full[0] as f32, full[1] as f32));
        let corners = |r: Rect| [r.left(), r.top(), r.right(), r.bottom()];
        let placed = Placed { picture: corners(picture), viewport: corners(viewport) };
        if placed != self.placed.0 {
            gpu.queue.write_buffer(&self.placed.1, 0, bytemuck::bytes_of(&placed));
            let [left, top, right, bottom] = std::mem::replace(&mut self.placed.0, placed).viewport;
            damage.add(viewport);
            // What it had covered shows something else now.
            let before = Rect::from_min_max(egui::pos2(left, top), egui::pos2(right, bottom)).intersect(whole);
            damage.add(before);
        }
        if kept {
            let mut changed = |rect: Rect| {
                // With what antialiasing adds.
                let rect = rect.expand(1.5) * scale;
                damage.add(Rect::from_min_max(rect.min.floor(), rect.max.ceil()).intersect(whole));
            };
            changes(&self.shapes.0, &shapes, &mut changed);
            shapes.iter().filter(|s| redrawn.contains(&s.shape.texture_id())).map(bounds).for_each(changed);
        } else {
            damage.rects = vec![whole];
        }
        self.shapes = (shapes, scale);
        let mut parts = vec![damage.rects];
        // Where the window is drawn by the CPU, what lies at the pointer is shown before the rest of a large change.
        if let (true, Some(at)) = (gpu.software(), ctx.pointer_latest_pos()) {
            let row = (Rect::from_center_size(at, egui::vec2(700.0, 44.0)) * scale).round();
            let area: f32 = parts[0].iter().map(Rect::area).sum();
            if area > LARGE {
                let first = parts[0].iter().map(|r| r.intersect(row)).filter(Rect::is_positive).collect();
                let rest = parts[0].iter().flat_map(|r| beside(*r, row)).collect();
                parts = vec![first, rest];
            }
        }
        // Each is drawn, whether or not the one before could be presented.
        let mut shown = true;
        for rects in &parts {
            shown = self.paint(gpu, ctx, rects);
        }
        shown
    }

    /// Draws parts of the window again, none of which overlaps another, and presents it. False: the window could not take it.
    fn paint(&mut self, gpu: &Gpu, ctx: &egui::Context, rects: &[Rect]) -> bool {
        let (shapes, scale) = (&self.shapes.0, self.shapes.1);
        let (Some(texture), Some(screen), Some((_, group, _))) =
            (self.screen.texture(), self.screen.view(), &self.picture)
        else {
            return true;
        };
        let mut jobs = Vec::new();
        for rect in rects {
            let points = *rect / scale;
            let touched = shapes.iter().filter(|s| bounds(s).expand(1.5).intersects(points)).cloned().collect();
            jobs.extend(ctx.tessellate(touched, scale).into_iter().filter_map(|job: ClippedPrimitive| {
                let clip_rect = job.clip_rect.intersect(points);
                clip_rect.is_positive().then_some(ClippedPrimitive { clip_rect, ..job })
            }));
        }
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let mut commands = Vec::new();
        if !rects.is_empty() {
            self.owed = true;
            let descriptor =
                ScreenDescriptor { size_in_pixels: [texture.width(), texture.height()], pixels_per_point: scale };
            commands = self.egui.update_buffers(&gpu.device, &gpu.queue, &mut encoder, &jobs, &descriptor);
            let pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some("window"),
                color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                    view: screen,
                    depth_slice: None,
                    resolve_target: None,
                    ops: wgpu::Operations { load: wgpu::LoadOp::Load, store: wgpu::StoreOp::Store },
                })],
                ..Default::default()
            });
            let mut pass = pass.forget_lifetime();
            pass.set_pipeline(&self.blit);
            pass.set_bind_group(0, group, &[]);
            for rect in rects {
                let [x, y, w, h] = [rect.left(), rect.top(), rect.width(), rect.height()].map(|v| v as u32);
                pass.set_scissor_rect(x, y, w, h);
                pass.draw(0..3, 0..1);
            }
            self.egui.render(&mut pass, &jobs, &descriptor);
        }
        if !self.owed {
            return true;
        }
        if !self.configured {
            self.surface.configure(&gpu.device, &self.config);
            self.configured = true;
        }
        use wgpu::CurrentSurfaceTexture as Current;
        let target = match self.surface.get_current_texture() {
            Current::Success(t) => Some(t),
            Current::Suboptimal(t) => {
                self.configured = false;
                Some(t)
            }
            Current::Timeout | Current::Occluded => None,
            Current::Lost => {
                self.lost = true;
                None
            }
            Current::Outdated | Current::Validation => {
                self.configured = false;
                None
            }
        };
        if let Some(target) = &target {
            encoder.copy_texture_to_texture(texture.as_image_copy(), target.texture.as_image_copy(), texture.size());
        }
        gpu.queue.submit(commands.into_iter().chain([encoder.finish()]));
        let Some(target) = target else { return false };
        gpu.queue.present(target);
        self.owed = false;
        true
    }
}

/// Parts of the window that are to be drawn again: none overlaps another.
#[derive(Default)]
struct Damage {
    rects: Vec<Rect>,
}

impl Damage {
    fn add(&mut self, mut rect: Rect) {
        if !rect.is_positive() {
            return;
        }
        // What lies over one another is joined where that takes hardly more of the window; or where there are many.
        let many = self.rects.len() >= MOST_PARTS;
        let joins = |a: Rect, b: Rect| {
            let both = a.area() + b.area() - a.intersect(b).area();
            a.intersects(b) && (many || (a | b).area() < 1.25 * both)
        };
        while let Some(i) = self.rects.iter().position(|r| joins(*r, rect)) {
            rect |= self.rects.swap_remove(i);
        }
        let mut parts = vec![rect];
        for other in &self.rects {
            parts = parts.into_iter().flat_map(|part| beside(part, *other)).collect();
        }
        self.rects.extend(parts);
    }
}

/// Pixels from which on a change is shown in two steps on software: what takes it some 10 ms to draw.
const LARGE: f32 = 60_000.0;
/// Most parts that are drawn one by one, as far as it can be helped.
const MOST_PARTS: usize = 24;

/// What of a rectangle lies outside another.
fn beside(rect: Rect, other: Rect) -> Vec<Rect> {
    let inner = rect.intersect(other);
    if !inner.is_positive() {
        return vec![rect];
    }
    let row = rect.with_min_y(inner.top()).with_max_y(inner.bottom());
    let parts = [
        rect.with_max_y(inner.top()),
        rect.with_min_y(inner.bottom()),
        row.with_max_x(inner.left()),
        row.with_min_x(inner.right()),
    ];
    parts.into_iter().filter(Rect::is_positive).collect()
}

/// Where a shape can be seen, points.
fn bounds(shape: &ClippedShape) -> Rect {
    (shape.transform_after_tessellation * shape.shape.visual_bounding_rect()).intersect(shape.clip_rect)
}

/// How far a shape is looked for that others were put before.
const APART: usize = 48;

/// Tells `changed` where two lists of shapes draw different things, points.
fn changes(old: &[ClippedShape], new: &[ClippedShape], mut changed: impl FnMut(Rect)) {
    let (mut i, mut j) = (0, 0);
    let mut tell = |shapes: &[ClippedShape]| shapes.iter().map(bounds).filter(Rect::is_positive).for_each(&mut changed);
    while i < old.len() && j < new.len() {
        if same(&old[i], &new[j]) {
            (i, j) = (i + 1, j + 1);
            continue;
        }
        // What came or went lies between here and the next that is alike.
        let came = new[j..].iter().take(APART).position(|s| same(&old[i], s));
        let went = old[i..].iter().take(APART).position(|s| same(s, &new[j]));
        let (went, came) = match (went, came) {
            (Some(went), came) if came.is_none_or(|came| went <= came) => (went, 0),
            (_, Some(came)) => (0, came),
            _ => (1, 1),
        };
        tell(&old[i..i + went]);
        tell(&new[j..j + came]);
        (i, j) = (i + went, j + came);
    }
    tell(&old[i..]);
    tell(&new[j..]);
}

fn same(a: &ClippedShape, b: &ClippedShape) -> bool {
    let shapes = match (&a.shape, &b.shape) {
        // Laid out text is kept from pass to pass: as a rule it is the very same, and its letters need no comparing.
        (Shape::Text(a), Shape::Text(b)) if Arc::ptr_eq(&a.galley, &b.galley) => {
            let style = |t: &egui::epaint::TextShape| {
                (t.pos, t.underline, t.fallback_color, t.override_text_color, t.opacity_factor, t.angle)
            };
            style(a) == style(b)
        }
        (a, b) => a == b,
    };
    let place = |s: &ClippedShape| (s.clip_rect, s.transform_after_tessellation);
    shapes && place(a) == place(b)
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui::{Color32, pos2};

    fn square(x: f32, color: Color32) -> ClippedShape {
        let rect = Rect::from_min_max(pos2(x, 0.0), pos2(x + 8.0, 8.0));
        ClippedShape::new(Rect::EVERYTHING, Shape::rect_filled(rect, 0.0, color))
    }

    /// What the lists differ in is found, wherever shapes come, go or change, and nothing else.
    #[test]
    fn only_what_changed_is_drawn_again() {
        let row = |all: &[(f32, Color32)]| -> Vec<ClippedShape> { all.iter().map(|(x, c)| square(*x, *c)).collect() };
        let (red, blue) = (Color32::RED, Color32::BLUE);
        let old = row(&[(0.0, red), (10.0, red), (20.0, red), (30.0, red)]);
        for (new, places) in [
            (row(&[(0.0, red), (10.0, red), (20.0, red), (30.0, red)]), vec![]),
            (row(&[(0.0, red), (10.0, blue), (20.0, red), (30.0, red)]), vec![10.0]),
            (row(&[(0.0, red), (20.0, red), (30.0, red)]), vec![10.0]),
            (row(&[(0.0, red), (10.0, red), (50.0, red), (20.0, red), (30.0, red), (60.0, blue)]), vec![50.0, 60.0]),
            (row(&[(0.0, red), (20.0, red), (30.0, blue), (40.0, red)]), vec![10.0, 30.0, 40.0]),
            (row(&[]), vec![0.0, 10.0, 20.0, 30.0]),
        ] {
            let mut found: Vec<f32> = Vec::new();
            changes(&old, &new, |rect| found.push(rect.left()));
            found.sort_by(f32::total_cmp);
            found.dedup();
            assert_eq!(found, places);
        }
    }

    #[test]
    fn damage_never_overlaps() {
        let at = |x: f32, w: f32| Rect::from_min_size(pos2(x, 0.0), egui::vec2(w, 5.0));
        let mut damage = Damage::default();
        for rect in [at(0.0, 5.0), at(20.0, 5.0), at(40.0, 5.0), at(4.0, 18.0), Rect::NOTHING] {
            damage.add(rect);
        }
        damage.rects.sort_by(|a, b| a.left().total_cmp(&b.left()));
        assert_eq!(damage.rects, [at(0.0, 25.0), at(40.0, 5.0)]);

        // A tooltip that reaches into a panel takes no more of the window than the two.
        let at = |x: f32, y: f32, w: f32, h: f32| Rect::from_min_size(pos2(x, y), egui::vec2(w, h));
        let mut damage = Damage::default();
        damage.add(at(60.0, 0.0, 40.0, 100.0));
        damage.add(at(10.0, 30.0, 80.0, 20.0));
        assert_eq!(damage.rects.iter().map(Rect::area).sum::<f32>(), 4000.0 + 50.0 * 20.0);
        // However many there are, they cover each place once.
        let mut seed = 7u32;
        let mut random = |most: u32| {
            seed = seed.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
            ((seed >> 16) % most) as f32
        };
        let mut damage = Damage::default();
        let all: Vec<Rect> = (0..80).map(|_| at(random(90), random(90), random(30), random(30))).collect();
        all.iter().for_each(|rect| damage.add(*rect));
        for i in 0..120 * 120 {
            let place = pos2((i % 120) as f32 + 0.5, (i / 120) as f32 + 0.5);
            let covers = damage.rects.iter().filter(|r| r.contains(place)).count();
            assert!(covers <= 1 && (covers == 1 || !all.iter().any(|r| r.contains(place))), "{place:?}: {covers}");
        }
    }
}
