//! Logarithmic perspective shadow map (Lloyd, Govindaraju, Quammen, Molnar, Manocha 2008).

use super::{Info, MAPS, NEAREST, Technique};
use crate::frame::Frame;
use crate::gpu::{Buffer, Gpu, Pass};
use crate::light::{Light, LightView};
use crate::map::filter::{Reach, alone};
use crate::map::fit::diagram::{self, Diagram, Drawing};
use crate::map::fit::lispsm::Lispsm;
use crate::map::fit::{Kept, Scope, logpsm};
use crate::map::single::scope;
use crate::map::warp::{self, Base, RasterParams, Warped};
use crate::map::{BiasParams, CasterParams, MapParams, light_views};
use crate::params::Params;
use crate::view::{self, Class, Drawn, Legend};
use anyhow::Result;
use glam::DVec2;

crate::params! {
    /// How strongly the map is warped, and over what.
    pub struct LogpsmParams {
        "Warp" {
            /// How strong the warp is. 0: a plain map. 0.5: the perspective of n_opt, followed by a logarithm. 1: the perspective of the view itself; with the logarithm, the aliasing error is then the same all along the view.
            strength: float(1.0, 0.0..=1.0, ""),
            /// The |cos γ| at which the warp begins to fade out, γ being the angle between the gaze and the light.
            fade: float(0.9, 0.8..=0.99, "") if strength > 0.0,
            /// Fit the map to what the camera sees: first to the part of the scene's box inside its frustum, then to the receivers themselves. Off: to the whole scene.
            focus: flag(true),
        }
    }
}

pub static INFO: Info = Info {
    id: "logpsm",
    title: "Logarithmic perspective shadow map",
    paper: "Lloyd, Govindaraju, Quammen, Molnar, Manocha 2008",
    family: "Warping",
    mark: 7,
    doc: "A perspective along the view, then a logarithm along it: texels grow in proportion to the distance, as pixels do. \
          The best that one map warped along the view can do, but straight edges become curves: large triangles must be \
          split, or drawn exactly.",
    lights: &["directional", "spot"],
    filter: Some(NEAREST),
    smooth: |_| false,
    params: &[LogpsmParams::GROUP, RasterParams::GROUP, MapParams::GROUP, CasterParams::GROUP, BiasParams::GROUP],
    main: &[("resolution", "256..4096*2"), ("strength", "0.5,0.75,1")],
    maps: &[
        MAPS,
        &warp::MAPS,
        &[
            view::map(
                "gain",
                "Gain of the logarithm",
                "Compared with the perspective alone: where the logarithm makes texels shorter (green) and longer \
                      (red), in full colour at a quarter and at four times the length.",
                Drawn::Labels(Legend::Classes(&[
                    Class::label(2, "texels shorter than without the logarithm"),
                    Class::label(0, "longer"),
                ])),
            ),
            diagram::view(
                "Before the map is narrowed to the receivers. Left the light's image, right the map: what the camera sees (green), \
             the map's border (yellow) and every sixteenth of its texels. The cross is the perspective's centre, the line the \
             gaze. Figures: n_w in metres (under a spot light at 1 m from it) and γ in degrees.",
            ),
        ],
    ],
    make: |gpu, _| Ok(Box::new(Logarithmic::new(gpu)?)),
};

struct Logarithmic {
    warped: Warped,
    range: Pass,
    /// f_w/n_w and its logarithm, as `Shape` in the shader.
    shape: Buffer,
    light_view: Buffer,
    drawing: Drawing,
    fit: Kept<Option<Fitted>>,
}

/// A fit and what it was made of.
struct Fitted {
    lispsm: Lispsm,
    points: Vec<DVec2>,
    view: Option<LightView>,
}

/// None if the camera sees nothing.
fn fitted(scope: &Scope, p: &LogpsmParams) -> Option<Fitted> {
    let body = if p.focus { scope.seen() } else { scope.lit() };
    if body.is_empty() {
        return None;
    }
    let image = scope.image();
    let lispsm = logpsm::fit(scope, &image, &body, p.strength as f64, p.fade as f64);
    let points: Vec<DVec2> = body.iter().map(|p| image.at(*p)).collect();
    // Texels are left free after the logarithm, on the GPU.
    let tight = Scope { margin: 0.0, ..*scope };
    let mut view = tight.view(&image, &lispsm.warp, &points, scope.deepest(&image, &body));
    if let (Some(v), Light::Directional { .. }) = (&mut view, scope.light) {
        positive_near(v);
    }
    Some(Fitted { lispsm, points, view })
}

/// Moves the origin of the sun's depth so that `near` is positive, and w at the body's near face is as much: triangles are
/// cut where w is a thousandth of `near`, as behind a spot light.
fn positive_near(v: &mut LightView) {
    let near = 0.01 * (v.far - v.near);
    let by = near - v.near;
    v.near += by;
    v.far += by;
    v.axis.w += by;
    for row in [&mut v.row_x, &mut v.row_y, &mut v.row_w] {
        *row *= near;
    }
}

impl Logarithmic {
    fn new(gpu: &Gpu) -> Result<Logarithmic> {
        let file = "techniques/logpsm.wgsl";
        use wgpu::BufferUsages as Use;
        // Made by one pass and read by those that follow.
        let made = |label, size: usize| gpu.buffer(label, &vec![0; size], Use::UNIFORM | Use::STORAGE | Use::COPY_SRC);
        Ok(Logarithmic {
            warped: Warped::new(gpu, file, INFO.params)?,
            range: Pass::compute(gpu, "fit: logarithm", &alone(file), "shape_of_view", INFO.params)?,
            shape: made("the logarithm's shape", 16),
            light_view: light_views(gpu, "light view with margins"),
            drawing: Drawing::new(gpu)?,
            fit: Kept::default(),
        })
    }
}

impl Technique for Logarithmic {
    fn render(&mut self, f: &mut Frame) -> Result<()> {
        let p = LogpsmParams::read(f.values);
        let made = self.fit.get(f, scope(f, Reach::default()), |s| fitted(s, &p));
        let tight = self.warped.base(f, made.as_ref().and_then(|m| m.view), p.focus, false)?;
        if tight.changed {
            f.run(&self.range)
                .bind("light_view", &tight.light_view)
                .bind("made_view", &self.light_view)
                .bind("made_shape", &self.shape)
                .dispatch(1, 1, 1);
        }
        let view = self.light_view.clone();
        let base = Base { light_view: view.clone(), each: vec![view], ..tight };
        self.warped.draw(f, &base, &[("shape", (&self.shape).into())])?;
        self.drawing.show(f, "warp", || made.as_ref().map(|m| Diagram::of_perspective(&m.lispsm, &m.points, true)));
        Ok(())
    }
}
