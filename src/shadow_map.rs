//! A depth map from a light's view, and the fits that techniques share.

use crate::fit::{Kept, Scope, msf};
use crate::frame::{ANALYSIS, Frame, Maps};
use crate::gpu::{Gpu, Pass, Raster, Slot};
use crate::light::LightView;
use crate::params::Params;
use crate::scene::geometry::Vertex;
use anyhow::{Context, Result};

crate::params! {
    /// What an unwarped map covers.
    pub struct FitParams {
        "Fit" {
            /// What the map covers. Receivers: only the surfaces that the camera sees and that face the light. Scene: the whole scene. Msf: the smallest frustum around the part of the scene's convex hull that the camera can see.
            fit: choice("receivers", ["receivers", "scene", "msf"]),
        }
    }
}

crate::params! {
    /// How a shadow map is made and compared.
    pub struct MapParams {
        "Map" {
            /// Side of the square shadow map. Double it, and the stairs at a shadow's edge are half as large.
            resolution: int(1024, 64..=8192, "texels"),
            /// Which faces are left out of the map, as seen from the light. Front: the bias then acts at the back faces.
            cull: choice("none", ["none", "front", "back"]),
            /// Precision of the stored depth, bits; f: a floating-point number.
            format: choice("32f", ["32f", "24", "16"]),
        }
        "Bias" {
            /// Depth added before the comparison, along the light's axis. Too little: acne. Too much: shadows detach (peter-panning).
            bias: float(0.002, 0.0..=100.0, "m", 0.1 of view),
            /// Depth added in proportion to the receiver's slope and the texel's size; 0.71 (half a texel's diagonal) is just enough for one nearest sample on a plane.
            slope_bias: float(0.75, 0.0..=8.0, "× texel"),
            /// Tilts the comparison along the receiver's plane, so that wide filters need no larger bias.
            receiver_plane: flag(false),
            /// The largest tangent of the slope that the slope-scaled bias follows.
            slope_limit: float(10.0, 1.0..=20.0, "") if slope_bias > 0.0 or receiver_plane = true,
            /// Moves the receiver along its normal before the look-up, farther where light grazes it. Shifts the edges of all shadows sideways.
            normal_offset: float(0.0, 0.0..=4.0, "texels"),
        }
    }
}

crate::params! {
    /// The rasteriser's bias, where it makes the depth.
    pub struct HardwareParams {
        "Rasteriser bias" {
            /// Bias added by the rasteriser, in the smallest steps of the depth format (for 32f: of the exponent).
            hardware_bias: int(0, 0..=1024, "steps"),
            /// Bias added by the rasteriser in proportion to the triangle's largest depth slope per texel.
            hardware_slope: float(0.0, 0.0..=8.0, "× slope"),
            /// The most that the rasteriser may add; 0: no limit.
            hardware_clamp: float(0.0, 0.0..=0.1, "× range") if hardware_bias > 0 or hardware_slope > 0.0,
        }
    }
}

/// What the casters' pipelines depend on: cull, format, hardware bias, and whether the view is warped.
type State = (String, wgpu::TextureFormat, HardwareParams, bool);

/// A light's view on the GPU: as it is given, or narrowed to the receivers that the camera sees.
pub struct Fit {
    whole: wgpu::Buffer,
    fitted: wgpu::Buffer,
    extent: wgpu::Buffer,
    receivers: Pass,
    narrow: Pass,
    last: Option<LightView>,
}

impl Fit {
    pub fn new(gpu: &Gpu) -> Result<Fit> {
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC;
        let view = wgpu::BufferUsages::UNIFORM | usage;
        let zero = |label, size, usage| gpu.buffer(label, &vec![0; size], usage);
        Ok(Fit {
            whole: zero("whole light view", size_of::<LightView>(), view),
            fitted: zero("fitted light view", size_of::<LightView>(), view),
            extent: zero("receivers' extent", 20, usage),
            receivers: Pass::compute(gpu, "fit: receivers", "lib/fit.wgsl", "receivers", &[])?,
            narrow: Pass::compute(gpu, "fit: narrow", "lib/fit.wgsl", "narrow", &[])?,
            last: None,
        })
    }

    /// The buffer that holds `view`; `narrow`: fitted once more, to the receivers that the camera sees.
    pub fn run(&mut self, f: &mut Frame, view: LightView, narrow: bool) -> wgpu::Buffer {
        if self.last != Some(view) {
            f.gpu.queue.write_buffer(&self.whole, 0, bytemuck::bytes_of(&view));
            self.last = Some(view);
        }
        f.held(self.whole.size() + self.fitted.size() + self.extent.size());
        if !narrow {
            return self.whole.clone();
        }
        let [w, h] = f.size.map(|side| side.div_ceil(64));
        f.clear(&self.extent);
        f.run(&self.receivers).bind("light_view", &self.whole).bind("extent", &self.extent).dispatch(w, h, 1);
        f.run(&self.narrow)
            .bind("light_view", &self.whole)
            .bind("extent", &self.extent)
            .bind("fitted", &self.fitted)
            .dispatch(1, 1, 1);
        self.fitted.clone()
    }
}

/// The depth map of one light's view. Depth is reversed: 1 near, 0 far.
pub struct ShadowMap {
    fit: Fit,
    depth: Slot,
    analyse: Pass,
    casters: Option<(State, [Pass; 2])>,
    least: Kept<Option<LightView>>,
}

/// What a look-up needs.
pub struct Drawn {
    pub map: wgpu::TextureView,
    pub light_view: wgpu::Buffer,
}

/// How depth maps are used.
pub const USAGE: wgpu::TextureUsages =
    wgpu::TextureUsages::RENDER_ATTACHMENT.union(wgpu::TextureUsages::TEXTURE_BINDING);

impl ShadowMap {
    pub fn new(gpu: &Gpu) -> Result<ShadowMap> {
        Ok(ShadowMap {
            fit: Fit::new(gpu)?,
            depth: Slot::default(),
            analyse: Pass::compute(gpu, ANALYSIS, "analyse_light_view.wgsl", "analyse", &[])?,
            casters: None,
            least: Kept::default(),
        })
    }

    /// Fits the light's view and draws the casters' depth. `reach`: how far the filter's taps lie from the
    /// receiver, texels.
    ///
    /// # Errors
    /// A light without a single view, or a map that the adapter cannot hold.
    pub fn render(&mut self, f: &mut Frame, reach: f32) -> Result<Drawn> {
        let (fit, scope) = (FitParams::read(f.values).fit, scope(f, reach));
        let view = match fit.as_str() {
            // Where the camera sees nothing, any map will do.
            "msf" => {
                if f.wants_outlines() {
                    f.outline_body(scope.seen_of(f.geometry.hull().clone()));
                }
                *self.least.get(f, scope, |s| msf::view(s, f.geometry.hull()))
            }
            _ => None,
        };
        self.render_view(f, view, reach, fit == "receivers")
    }

    /// Draws the casters' depth from a view, or from one of the whole scene where there is none; `narrow`: fitted once more, to
    /// the receivers that the camera sees.
    ///
    /// # Errors
    /// As [`ShadowMap::render`].
    pub fn render_view(&mut self, f: &mut Frame, view: Option<LightView>, reach: f32, narrow: bool) -> Result<Drawn> {
        let p = MapParams::read(f.values);
        let view = view.map_or_else(|| whole(&scope(f, reach)), Ok)?;
        let light_view = self.fit.run(f, view, narrow);
        f.outline_view(&light_view);
        f.keep_table("light_view", &light_view);
        let hardware = HardwareParams::read(f.values);
        self.prepare_casters(f.gpu, (p.cull.clone(), format(&p), hardware, view.perspective == LightView::WARPED))?;
        let map = self.depth.get(f.gpu, "shadow map", [p.resolution; 2], format(&p), USAGE);
        if let Some(texture) = self.depth.texture() {
            f.held(crate::gpu::bytes(texture));
        }
        let scene = f.scene;
        if let Some((_, [opaque, masked])) = &self.casters {
            let depth = Some((&map, 0.0));
            f.run(opaque).bind("light_view", &light_view).draw(&[], depth, true, |p| scene.draw_opaque(p));
            if scene.opaque_count < scene.triangle_count {
                f.run(masked).bind("light_view", &light_view).draw(&[], depth, false, |p| scene.draw_masked(p));
            }
        }
        f.offer_maps(std::slice::from_ref(&map), &light_view, &[p.resolution]);
        let maps = Maps::of(&[p.resolution]);
        f.analyse(&self.analyse, maps, &[("light_view", (&light_view).into())]);
        Ok(Drawn { map, light_view })
    }

    /// Makes the caster passes anew if their pipelines' state changed.
    fn prepare_casters(&mut self, gpu: &Gpu, state: State) -> Result<()> {
        if self.casters.as_ref().is_some_and(|(made, _)| *made == state) {
            return Ok(());
        }
        let (cull, format, hardware, warped) = &state;
        let unclipped_depth = !warped && gpu.features.contains(wgpu::Features::DEPTH_CLIP_CONTROL);
        let pass = |name, fragment: Option<&str>| {
            let raster = Raster {
                vertex: if *warped { "warped_caster" } else { caster(unclipped_depth, fragment.is_some()) },
                unclipped_depth,
                fragment,
                depth: Raster::nearest(*format).map(|state| wgpu::DepthStencilState {
                    // Reversed depth: away from the light is down.
                    bias: wgpu::DepthBiasState {
                        constant: -(hardware.hardware_bias as i32),
                        slope_scale: -hardware.hardware_slope,
                        clamp: -hardware.hardware_clamp,
                    },
                    ..state
                }),
                cull: Raster::culled(cull),
                vertices: Some(Vertex::LAYOUT),
                ..Raster::default()
            };
            Pass::render(gpu, name, "lib/depth.wgsl", raster, &[])
        };
        let fragments = if *warped { [Some("warped"), Some("warped_masked")] } else { [None, Some("masked")] };
        let passes = [pass("shadow map", fragments[0])?, pass("shadow map (masked)", fragments[1])?];
        self.casters = Some((state, passes));
        Ok(())
    }
}

/// The vertex shader (`shaders/lib/depth.wgsl`) of a map that no warp bends. Casters nearer than the near plane must stay:
/// clamped by the rasteriser (`unclipped`), or else by their corners.
pub fn caster(unclipped: bool, masked: bool) -> &'static str {
    match (unclipped, masked) {
        (true, false) => "caster",
        (true, true) => "masked_caster",
        (false, false) => "clamped_caster",
        (false, true) => "clamped_masked_caster",
    }
}

/// The frame as fits see it. `reach`: how far the filter's taps lie from the receiver, texels.
pub fn scope(f: &Frame, reach: f32) -> Scope {
    let p = MapParams::read(f.values);
    // The normal offset moves the look-up too.
    Scope::of(f, p.resolution, 1.0 + reach + p.normal_offset)
}

/// The light's view of the whole scene.
///
/// # Errors
/// A light without a single view.
pub fn whole(scope: &Scope) -> Result<LightView> {
    LightView::whole(&scope.light, scope.bounds, scope.resolution, scope.margin)
        .with_context(|| format!("a {} light has no single shadow map", scope.light.kind()))
}

/// The texture format of these parameters.
pub fn format(p: &MapParams) -> wgpu::TextureFormat {
    match p.format.as_str() {
        "16" => wgpu::TextureFormat::Depth16Unorm,
        "24" => wgpu::TextureFormat::Depth24Plus,
        _ => wgpu::TextureFormat::Depth32Float,
    }
}
