//! The window's surface: the picture and, over it, egui.

use crate::gpu::{Gpu, Shaders};
use anyhow::{Context, Result};
use egui::{ClippedPrimitive, TexturesDelta};
use egui_wgpu::ScreenDescriptor;

/// Behind the picture while there is none.
const GROUND: wgpu::Color = wgpu::Color { r: 0.075, g: 0.082, b: 0.098, a: 1.0 };

pub struct Canvas {
    surface: wgpu::Surface<'static>,
    config: wgpu::SurfaceConfiguration,
    egui: egui_wgpu::Renderer,
    blit: wgpu::RenderPipeline,
    sampler: wgpu::Sampler,
    /// The picture that the bind group holds.
    bound: Option<(wgpu::Texture, wgpu::BindGroup)>,
    configured: bool,
}

/// A picture and where it goes: left, top, width and height in pixels of the window.
pub type Placed<'a> = (&'a wgpu::Texture, [f32; 4]);

impl Canvas {
    /// # Errors
    /// A surface that the adapter cannot draw on.
    pub fn new(gpu: &Gpu, surface: wgpu::Surface<'static>, size: [u32; 2]) -> Result<Canvas> {
        let able = surface.get_capabilities(&gpu.adapter);
        let mut config = surface.get_default_config(&gpu.adapter, size[0].max(1), size[1].max(1));
        let config = config.as_mut().context("the graphics adapter cannot draw in this window")?;
        // The picture and egui's colours are sRGB-encoded already.
        if let Some(plain) = able.formats.iter().find(|f| !f.is_srgb()) {
            config.format = *plain;
        }
        config.present_mode = wgpu::PresentMode::AutoVsync;
        let source = Shaders::load(&gpu.shaders, "blit.wgsl", &[])?.source;
        let module = gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("blit"),
            source: wgpu::ShaderSource::Wgsl(source.into()),
        });
        let blit = gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("blit"),
            layout: None,
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("corner"),
                compilation_options: Default::default(),
                buffers: &[],
            },
            primitive: Default::default(),
            depth_stencil: None,
            multisample: Default::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
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
        let egui = egui_wgpu::Renderer::new(&gpu.device, config.format, Default::default());
        Ok(Canvas { surface, config: config.clone(), egui, blit, sampler, bound: None, configured: false })
    }

    /// Follows the window's size, pixels.
    pub fn resize(&mut self, size: [u32; 2]) {
        if [self.config.width, self.config.height] != size {
            [self.config.width, self.config.height] = size;
            self.configured = false;
        }
    }

    /// Draws and presents a frame. False: the window could not take it, try again.
    pub fn present(
        &mut self,
        gpu: &Gpu,
        picture: Option<Placed>,
        jobs: &[ClippedPrimitive],
        mut delta: TexturesDelta,
        scale: f32,
    ) -> bool {
        for (id, changes) in delta.set.drain() {
            for change in changes {
                self.egui.update_texture(&gpu.device, &gpu.queue, id, &change);
            }
        }
        let shown = self.draw(gpu, picture, jobs, scale);
        for id in delta.free.drain() {
            self.egui.free_texture(&id);
        }
        shown
    }

    fn draw(&mut self, gpu: &Gpu, picture: Option<Placed>, jobs: &[ClippedPrimitive], scale: f32) -> bool {
        if !self.configured {
            self.surface.configure(&gpu.device, &self.config);
            self.configured = true;
        }
        use wgpu::CurrentSurfaceTexture as Current;
        let target = match self.surface.get_current_texture() {
            Current::Success(t) => t,
            Current::Suboptimal(t) => {
                self.configured = false;
                t
            }
            Current::Timeout | Current::Occluded => return false,
            _ => {
                self.configured = false;
                return false;
            }
        };
        let view = target.texture.create_view(&Default::default());
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let screen =
            ScreenDescriptor { size_in_pixels: [self.config.width, self.config.height], pixels_per_point: scale };
        let uploads = self.egui.update_buffers(&gpu.device, &gpu.queue, &mut encoder, jobs, &screen);
        if let Some((texture, _)) = picture
            && self.bound.as_ref().is_none_or(|(held, _)| held != texture)
        {
            let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("blit"),
                layout: &self.blit.get_bind_group_layout(0),
                entries: &[
                    wgpu::BindGroupEntry {
                        binding: 0,
                        resource: wgpu::BindingResource::TextureView(&texture.create_view(&Default::default())),
                    },
                    wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::Sampler(&self.sampler) },
                ],
            });
            self.bound = Some((texture.clone(), group));
        }
        {
            let pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some("window"),
                color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                    view: &view,
                    depth_slice: None,
                    resolve_target: None,
                    ops: wgpu::Operations { load: wgpu::LoadOp::Clear(GROUND), store: wgpu::StoreOp::Store },
                })],
                ..Default::default()
            });
            let mut pass = pass.forget_lifetime();
            if let (Some((_, [x, y, w, h])), Some((_, group))) = (picture, &self.bound) {
                pass.set_viewport(x, y, w, h, 0.0, 1.0);
                pass.set_pipeline(&self.blit);
                pass.set_bind_group(0, group, &[]);
                pass.draw(0..3, 0..1);
                pass.set_viewport(0.0, 0.0, self.config.width as f32, self.config.height as f32, 0.0, 1.0);
            }
            self.egui.render(&mut pass, jobs, &screen);
        }
        gpu.queue.submit(uploads.into_iter().chain([encoder.finish()]));
        gpu.queue.present(target);
        true
    }
}
