//! A single map: one light view, as it is given or narrowed to the receivers in the picture.

use super::casters::{Casters, Target, Triangles};
use super::filter::Reach;
use super::fit::{Kept, Scope, msf};
use super::peel::{Depths, Held};
use super::{MOST, MapParams, Maps, light_views, margin, whole};
use crate::frame::Frame;
use crate::gpu::{Buffer, Gpu, Pass, Resource};
use crate::light::{Light, LightView, WIDEST};
use crate::params::{Group, Params};
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

/// Light views on the GPU: as they are given, or narrowed to the receivers that the camera sees.
pub struct Fit {
    /// What is written is there before any of them is used: views that follow each other in a frame have buffers of their own.
    whole: Vec<(Vec<LightView>, Buffer)>,
    fitted: Buffer,
    extent: Buffer,
    receivers: Pass,
    narrow: Pass,
    /// Receivers that the whole view does not see.
    beyond: Buffer,
    everywhere: Buffer,
}

impl Fit {
    pub fn new(gpu: &Gpu) -> Result<Fit> {
        Fit::of(gpu, "map/narrow.wgsl", &[])
    }

    /// To the receivers that a file takes, which includes `map/narrow_to.wgsl`; `groups`: the parameters that it reads.
    ///
    /// # Errors
    /// Passes that cannot be made.
    pub fn of(gpu: &Gpu, file: &str, groups: &[Group]) -> Result<Fit> {
        Ok(Fit {
            whole: Vec::new(),
            fitted: light_views(gpu, "fitted light view"),
            extent: gpu.buffer("receivers' extent", &[0; 24 * MOST], Use::STORAGE),
            receivers: Pass::compute(gpu, "fit: receivers", file, "receivers", groups)?,
            narrow: Pass::compute(gpu, "fit: narrow", file, "narrow", groups)?,
            beyond: gpu.room("receivers beyond the map", 4, Use::STORAGE | Use::COPY_DST | Use::COPY_SRC),
            everywhere: between(gpu, [0.0, f32::MAX], true),
        })
    }

    /// The buffer that holds `view`; `narrow`: fitted once more, to the receivers that the camera sees.
    pub fn run(&mut self, f: &mut Frame, view: LightView, narrow: bool) -> Buffer {
        if narrow {
            return self.narrow_first(f, &[view]);
        }
        let given = self.write(f, 0, &[view]);
        if one_sees_not_all(f) {
            let receivers = self.everywhere.clone();
            self.find(f, &given, 1, &[("between", (&receivers).into())]);
            self.tell_beyond(f);
        }
        given
    }

    /// The buffer that holds the first of some views, fitted once more, to the receivers that the camera sees.
    pub fn narrow_first(&mut self, f: &mut Frame, views: &[LightView]) -> Buffer {
        let whole = self.write(f, 0, views);
        let (receivers, fitted) = (self.everywhere.clone(), self.fitted.clone());
        self.run_all(f, &whole, 1, &receivers, &fitted);
        if one_sees_not_all(f) {
            self.tell_beyond(f);
        }
        fitted
    }

    /// Tells how many receivers were found outside the first view.
    fn tell_beyond(&self, f: &mut Frame) {
        f.tell_counted(&self.beyond, |pixels| {
            format!(
                "{pixels} pixels lie more than {WIDEST}° off the light's axis, where no single map reaches: what hides the light from them \
                 is missed."
            )
        });
    }

    /// The buffer that holds these views, up to [`MOST`]. `number`: which of the frame's.
    pub fn write(&mut self, f: &Frame, number: usize, views: &[LightView]) -> Buffer {
        while self.whole.len() <= number {
            self.whole.push((Vec::new(), light_views(f.gpu, "whole light view")));
        }
        let (last, whole) = &mut self.whole[number];
        if last != views {
            f.gpu.queue.write_buffer(whole, 0, bytemuck::cast_slice(views));
            *last = views.to_vec();
        }
        whole.clone()
    }

    /// Fits `count` views to the receivers that [`between`] tells.
    pub fn run_all(&mut self, f: &mut Frame, whole: &Buffer, count: u32, receivers: &Buffer, fitted: &Buffer) {
        self.run_taken(f, whole, count, fitted, &[("between", receivers.into())]);
    }

    /// Fits `count` views to the receivers that the file takes, by what it is `told`; their depths among it.
    fn run_taken(
        &mut self,
        f: &mut Frame,
        whole: &Buffer,
        count: u32,
        fitted: &Buffer,
        told: &[(&'static str, Resource)],
    ) {
        self.find(f, whole, count, told);
        f.run(&self.narrow)
            .bind("light_views", whole)
            .bind("extent", &self.extent)
            .bind("fitted", fitted)
            .dispatch(1, 1, 1);
    }

    /// Where the receivers lie in `count` views, and how many outside the first.
    fn find(&mut self, f: &mut Frame, whole: &Buffer, count: u32, told: &[(&'static str, Resource)]) {
        let [w, h] = f.size.map(|side| side.div_ceil(64));
        f.clear(&self.extent);
        if one_sees_not_all(f) {
            f.clear(&self.beyond);
        }
        f.run(&self.receivers)
            .bind("light_views", whole)
            .bind("extent", &self.extent)
            .bind("beyond", &self.beyond)
            .bind_all(told)
            .dispatch(w, h, count);
    }

    /// Fits `count` views, each to the receivers in its part of a film (`shaders/map/narrow_parts.wgsl`).
    pub fn run_parts(&mut self, f: &mut Frame, whole: &Buffer, count: u32, parts: &Buffer, fitted: &Buffer) {
        let told = [("between", (&self.everywhere).into()), ("film_parts", parts.into())];
        self.run_taken(f, whole, count, fitted, &told);
    }
}

/// Whether receivers may face the light that no single view of it sees.
fn one_sees_not_all(f: &Frame) -> bool {
    matches!(f.light, Light::RectArea { .. })
}

/// The receivers from one depth along the camera's axis to another, metres. `told`: those that the view does not reach are counted.
pub fn between(gpu: &Gpu, [first, last]: [f32; 2], told: bool) -> Buffer {
    let words = [first, last, told as u32 as f32, 0.0];
    gpu.buffer("receivers' depths", bytemuck::bytes_of(&words), Use::UNIFORM)
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
