//! A single map: one light view, as it is given or narrowed to the receivers in the picture.

use super::casters::{Casters, Target, Triangles};
use super::filter::Reach;
use super::fit::{Kept, Scope, msf};
use super::peel::{Depths, Held};
use super::{MapParams, Maps, light_views, margin, whole};
use crate::frame::Frame;
use crate::gpu::{Buffer, Gpu, Pass};
use crate::light::{Light, LightView, WIDEST};
use crate::params::Params;
use anyhow::Result;
use wgpu::BufferUsages as Use;

crate::params! {
    /// What an unwarped map covers.
    pub struct FitParams {
        "Fit" {
            /// What the map covers. Receivers: only the surfaces that the camera sees and that face the light. Scene: the whole scene. Msf: the smallest frustum around the part of the scene's convex hull that the camera can see.
            fit: choice("receivers", ["receivers", "scene", "msf"]),
        }
    }
}

/// A light's view on the GPU: as it is given, or narrowed to the receivers that the camera sees.
pub struct Fit {
    /// Of each place of a light with a size that a map is drawn from: what is written is there before any of them is drawn.
    whole: Vec<(Option<LightView>, Buffer)>,
    fitted: Buffer,
    extent: Buffer,
    receivers: Pass,
    narrow: Pass,
    /// Receivers that the whole view does not see.
    beyond: Buffer,
}

impl Fit {
    pub fn new(gpu: &Gpu) -> Result<Fit> {
        Ok(Fit {
            whole: Vec::new(),
            fitted: light_views(gpu, "fitted light view"),
            extent: gpu.buffer("receivers' extent", &[0; 24], Use::STORAGE),
            receivers: Pass::compute(gpu, "fit: receivers", "map/narrow.wgsl", "receivers", &[])?,
            narrow: Pass::compute(gpu, "fit: narrow", "map/narrow.wgsl", "narrow", &[])?,
            beyond: gpu.room("receivers beyond the map", 4, Use::STORAGE | Use::COPY_DST | Use::COPY_SRC),
        })
    }

    /// The buffer that holds `view`; `narrow`: fitted once more, to the receivers that the camera sees.
    pub fn run(&mut self, f: &mut Frame, view: LightView, narrow: bool) -> Buffer {
        self.run_place(f, 0, view, narrow)
    }

    /// The same for one of several places of the light; the buffer of a narrowed view is the same for all.
    fn run_place(&mut self, f: &mut Frame, place: usize, view: LightView, narrow: bool) -> Buffer {
        while self.whole.len() <= place {
            self.whole.push((None, light_views(f.gpu, "whole light view")));
        }
        let (last, whole) = &mut self.whole[place];
        if *last != Some(view) {
            f.gpu.queue.write_buffer(whole, 0, bytemuck::bytes_of(&view));
            *last = Some(view);
        }
        if !narrow {
            return whole.clone();
        }
        let whole = &*whole;
        let [w, h] = f.size.map(|side| side.div_ceil(64));
        f.clear(&self.extent);
        if matches!(f.light, Light::RectArea { .. }) {
            f.clear(&self.beyond);
        }
        f.run(&self.receivers)
            .bind("light_view", whole)
            .bind("extent", &self.extent)
            .bind("beyond", &self.beyond)
            .dispatch(w, h, 1);
        // Of several places the first one's view tells.
        if place == 0 && matches!(f.light, Light::RectArea { .. }) {
            f.tell_counted(&self.beyond, |pixels| {
                format!("{pixels} pixels lie more than {WIDEST}° off the light's axis, where no single map reaches: they are lit.")
            });
        }
        f.run(&self.narrow)
            .bind("light_view", whole)
            .bind("extent", &self.extent)
            .bind("fitted", &self.fitted)
            .dispatch(1, 1, 1);
        self.fitted.clone()
    }
}

/// One map, fitted and drawn. Depth is reversed: 1 near, 0 far.
pub struct ShadowMap {
    fit: Fit,
    layers: Held,
    casters: Casters,
    least: Kept<Option<LightView>>,
}

impl ShadowMap {
    pub fn new(gpu: &Gpu) -> Result<ShadowMap> {
        Ok(ShadowMap {
            fit: Fit::new(gpu)?,
            layers: Held::default(),
            casters: Casters::named(["shadow map", "shadow map (masked)"]),
            least: Kept::default(),
        })
    }

    /// Fits the light's view and draws the casters' depth. `reach`: how far the filter's taps lie from the receiver.
    ///
    /// # Errors
    /// A light without a single view, or a map that the adapter cannot hold.
    pub fn render(&mut self, f: &mut Frame, reach: Reach) -> Result<Maps> {
        let (view, narrow) = self.chosen(f, reach);
        self.render_view(f, view, reach, narrow)
    }

    /// The light's view that the parameters ask for, on the GPU, for casters that are drawn otherwise.
    ///
    /// # Errors
    /// A light without a single view.
    pub fn fit(&mut self, f: &mut Frame, reach: Reach) -> Result<Buffer> {
        let (view, narrow) = self.chosen(f, reach);
        self.fit_view(f, view, reach, narrow)
    }

    /// A view, if the fit gives one, and whether it is narrowed to the receivers that the camera sees.
    fn chosen(&mut self, f: &mut Frame, reach: Reach) -> (Option<LightView>, bool) {
        let (fit, scope) = (FitParams::read(f.values).fit, scope(f, reach));
        let view = match fit.as_str() {
            // Where the camera sees nothing, any map will do.
            "msf" => {
                if f.wants_outlines() {
                    f.outline_body(scope.seen_of(f.geometry.hull().clone()));
                }
                *self.least.get(f, scope, |s| msf::view(s, f.geometry.hull(), reach.metres))
            }
            _ => None,
        };
        (view, fit == "receivers")
    }

    fn fit_view(&mut self, f: &mut Frame, view: Option<LightView>, reach: Reach, narrow: bool) -> Result<Buffer> {
        let view = view.map_or_else(|| whole(&scope(f, reach)), Ok)?;
        let view = LightView { reach: reach.metres, ..view };
        let light_views = self.fit.run(f, view, narrow);
        f.outline_view(&light_views);
        Ok(light_views)
    }

    /// Draws the casters' depth from a view, or from one of the whole scene where there is none; `narrow`: fitted once more, to
    /// the receivers that the camera sees.
    ///
    /// # Errors
    /// As [`ShadowMap::render`].
    pub fn render_view(&mut self, f: &mut Frame, view: Option<LightView>, reach: Reach, narrow: bool) -> Result<Maps> {
        let warped = view.is_some_and(|view| view.perspective == LightView::WARPED);
        let light_views = self.fit_view(f, view, reach, narrow)?;
        self.draw(f, light_views, warped)
    }

    /// Draws the map of a place of a light with a size, into the same texture as all others: what looks it up must come before the
    /// next. The first place is the one that outlines and notes tell of.
    ///
    /// # Errors
    /// As [`ShadowMap::render`].
    pub fn render_place(&mut self, f: &mut Frame, place: usize, light: Light, reach: Reach) -> Result<Maps> {
        let narrow = FitParams::read(f.values).fit != "scene";
        let view = whole(&Scope { light, ..scope(f, reach) })?;
        let light_views = self.fit.run_place(f, place, LightView { reach: reach.metres, ..view }, narrow);
        if place == 0 {
            f.outline_view(&light_views);
        }
        self.draw(f, light_views, false)
    }

    fn draw(&mut self, f: &mut Frame, light_views: Buffer, warped: bool) -> Result<Maps> {
        let sides = vec![MapParams::read(f.values).resolution];
        let depths = Depths::hold(&mut self.layers, f, &sides)?;
        let to = Target::whole(sides[0], &light_views, warped);
        self.casters.draw_depths(f, (&depths, 0), to, &Triangles::All)?;
        Ok(Maps { layers: depths.looked_up(), light_views, sides, bound: Vec::new() })
    }
}

/// The frame as fits see it. `reach`: how far the filter's taps lie from the receiver.
pub fn scope(f: &Frame, reach: Reach) -> Scope {
    Scope::of(f, MapParams::read(f.values).resolution, margin(f) + reach.texels)
}
