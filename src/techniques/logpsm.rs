//! Logarithmic perspective shadow map (Lloyd, Govindaraju, Quammen, Molnar, Manocha 2008).

use super::{Info, MAPS, NEAREST, Technique};
use crate::frame::Frame;
use crate::gpu::{Buffer, Gpu, Need, Pass, Resource, hold};
use crate::light::{Light, LightView};
use crate::map::filter::{Reach, alone};
use crate::map::fit::diagram::{self, Diagram, Drawing};
use crate::map::fit::lispsm::Lispsm;
use crate::map::fit::sides::{self, Side};
use crate::map::fit::{Kept, Scope, logpsm, tell_even};
use crate::map::single::scope;
use crate::map::warp::{self, Base, RasterParams, Warped};
use crate::map::{BiasParams, CasterParams, MOST, MapParams, light_views};
use crate::params::Params;
use crate::view::{self, Class, Drawn, Legend};
use anyhow::Result;
use bytemuck::{Pod, Zeroable};
use glam::{DVec2, Vec4};
use wgpu::BufferUsages as Use;

crate::params! {
    /// How strongly the map is warped, and over what.
    pub struct LogpsmParams {
        "Warp" {
            /// How many maps there are. 1: a single one, warped along the gaze. Faces: one for each face of the view's frustum that its image in the light needs, warped along the face, with no more texels together than a single one.
            sides: choice("1", ["1", "faces"]),
            /// How strong the warp is. 0: a plain map. 0.5: the perspective of n_opt, followed by a logarithm. 1: the perspective of the view itself; with the logarithm, the aliasing error is then the same all along the view.
            strength: float(1.0, 0.0..=1.0, "") if sides = "1",
            /// The |cos γ| at which the warp begins to fade out, γ being the angle between the gaze and the light.
            fade: float(0.9, 0.8..=0.99, "") if strength > 0.0,
            /// Fit the map to what the camera sees: first to the part of the scene's box inside its frustum, then to the receivers themselves. Off: to the whole scene.
            focus: flag(true) if sides = "1",
        }
    }
}

/// The sides' colours.
const SIDES: &[Class] = &[
    Class::label(0, "first side"),
    Class::label(1, "second"),
    Class::label(2, "third"),
    Class::label(3, "fourth"),
    Class::label(4, "fifth"),
    Class::label(5, "sixth"),
];

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
                "sides",
                "Split sides",
                "Each side of the view in a colour of its own: which of the maps a pixel looks up.",
                Drawn::Labels(Legend::Classes(SIDES)),
            ),
            view::map(
                "shadow-maps",
                "Shadow maps",
                "The maps of all sides, framed in their colours: near the light bright, far dark.",
                Drawn::Labels(Legend::Classes(SIDES)),
            ),
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
                "Before the map is narrowed to the receivers. Of split sides the light's image with the parts of all (lines) and the map of the \
             largest. Left the light's image, right the map: what the camera sees (green), \
             the map's border (yellow) and every sixteenth of its texels. The cross is the perspective's centre, the line the \
             gaze. Figures: n_w in metres (under a spot light at 1 m from it) and γ in degrees; of split sides their number.",
            ),
        ],
    ],
    needs: |values| match RasterParams::read(values).raster.as_str() {
        "exact" => &[Need::StorageBuffers(6)],
        _ => &[],
    },
    make: |_, _| Ok(Box::new(Logarithmic::default())),
};

/// The maps of the last frame's number of sides.
#[derive(Default)]
struct Logarithmic {
    held: Option<(bool, Maps)>,
}

enum Maps {
    Single(Box<Single>),
    Split(Box<Split>),
}

/// One map of all that is seen.
struct Single {
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

impl Single {
    fn new(gpu: &Gpu) -> Result<Single> {
        let file = "techniques/logpsm.wgsl";
        Ok(Single {
            warped: Warped::new(gpu, file, INFO.params)?,
            range: Pass::compute(gpu, "fit: logarithm", &alone(file), "shape_of_view", INFO.params)?,
            shape: made(gpu, "the logarithm's shape", 16),
            light_view: light_views(gpu, "light view with margins"),
            drawing: Drawing::new(gpu)?,
            fit: Kept::default(),
        })
    }

    fn render(&mut self, f: &mut Frame, p: &LogpsmParams) -> Result<()> {
        let made = self.fit.get(f, scope(f, Reach::default()), |s| fitted(s, p));
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
        self.warped.draw(f, &base, &[("shape_of_map", (&self.shape).into())])?;
        self.drawing.show(f, "warp", || made.as_ref().map(|m| Diagram::of_perspective(&m.lispsm, &m.points, true)));
        Ok(())
    }
}

/// A buffer made by one pass and read by those that follow.
fn made(gpu: &Gpu, label: &str, size: usize) -> Buffer {
    gpu.buffer(label, &vec![0; size], Use::UNIFORM | Use::STORAGE | Use::COPY_SRC)
}

/// A map for each side of the view's frustum.
struct Split {
    warped: Warped,
    look: Pass,
    range: Pass,
    /// As `Sides` in the shader.
    uniform: Buffer,
    whole: Buffer,
    fitted: Buffer,
    each: Vec<Buffer>,
    shapes: Buffer,
    samples: Buffer,
    extents: Buffer,
    drawing: Drawing,
    fit: Kept<Fits>,
}

/// The sides of a frame, and the light view of each before it is narrowed.
struct Fits {
    sides: Vec<Side>,
    views: Vec<LightView>,
    /// Texels of the side of each map.
    texels: u32,
}

/// As `Sides` in WGSL.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct SidesUniform {
    count: u32,
    padding: [u32; 3],
    rows: [Vec4; MOST],
    along: [Vec4; MOST],
}

/// None where the camera sees nothing: a map of the whole scene then serves.
fn split(scope: &Scope) -> Option<Fits> {
    let (body, image) = (scope.seen(), scope.image());
    let sides = if body.is_empty() { Vec::new() } else { sides::fit(scope, &image, &body) };
    // No more texels than one map of the whole side.
    let texels = (f64::from(scope.resolution) / (sides.len().max(1) as f64).sqrt()).floor() as u32;
    let tight = Scope { margin: 0.0, resolution: texels, ..*scope };
    let deepest = scope.deepest(&image, &body);
    let view = |side: &Side| {
        let mut view = tight.view(&image, &side.warp, &side.points, deepest)?;
        // Depth is linear, as the warp leaves no plane flat.
        view.perspective = LightView::WARPED;
        if let Light::Directional { .. } = scope.light {
            positive_near(&mut view);
        }
        Some(view)
    };
    let views = sides.iter().map(view).collect::<Option<Vec<_>>>().filter(|views| !views.is_empty())?;
    Some(Fits { sides, views, texels })
}

/// The sides of a frame; where there are none, one map of the whole scene.
fn splits(scope: &Scope) -> Fits {
    split(scope).unwrap_or_else(|| {
        let whole = LightView::whole(&scope.light, scope.bounds, scope.resolution, 0.0);
        let view = LightView { perspective: LightView::WARPED, ..whole.unwrap_or(LightView::zeroed()) };
        Fits { sides: Vec::new(), views: vec![view], texels: scope.resolution }
    })
}

impl Split {
    fn new(gpu: &Gpu) -> Result<Split> {
        let file = "techniques/logpsm/sides.wgsl";
        let pass = |name, entry| Pass::compute(gpu, name, &alone(file), entry, INFO.params);
        Ok(Split {
            warped: Warped::several(gpu, file, INFO.params)?,
            look: pass("fit: samples", "extents_of_layers")?,
            range: pass("fit: logarithm", "fit_sides")?,
            uniform: gpu.buffer("sides", &[0; size_of::<SidesUniform>()], Use::UNIFORM),
            whole: light_views(gpu, "whole light views"),
            fitted: light_views(gpu, "light views with margins"),
            each: (0..MOST).map(|_| gpu.buffer("light view", &[0; size_of::<LightView>()], Use::UNIFORM)).collect(),
            shapes: made(gpu, "the logarithms' shapes", 16 * MOST),
            samples: warp::storage(gpu, "sides' samples", 4 * MOST as u64),
            extents: warp::storage(gpu, "extents of samples", 20 * MOST as u64),
            drawing: Drawing::new(gpu)?,
            fit: Kept::default(),
        })
    }

    fn render(&mut self, f: &mut Frame) -> Result<()> {
        let made = self.fit.get(f, scope(f, Reach::default()), splits);
        let number = made.views.len();
        let bound: Vec<(&'static str, Resource)> = vec![("sides", (&self.uniform).into())];
        let base = self.warped.layers(f, made.texels, bound.clone(), |f| {
            let none = [Vec4::W * -1e30; MOST];
            let mut uniform = SidesUniform { count: number as u32, rows: none, ..SidesUniform::zeroed() };
            for (i, side) in made.sides.iter().enumerate() {
                uniform.rows[i] = side.row.as_vec4();
                uniform.along[i] = side.along.as_vec3().extend(0.0);
            }
            f.gpu.queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&uniform));
            f.gpu.queue.write_buffer(&self.whole, 0, bytemuck::cast_slice(&made.views));
            f.clear(&self.samples);
            f.clear(&self.extents);
            let own: [(&'static str, Resource); 6] = [
                ("light_views", (&self.whole).into()),
                ("light_view", (&self.whole).into()),
                ("samples", (&self.samples).into()),
                ("extents", (&self.extents).into()),
                ("fitted", (&self.fitted).into()),
                ("made_shapes", (&self.shapes).into()),
            ];
            let [w, h] = f.size.map(|side| side.div_ceil(64));
            f.run(&self.look).bind_all(&bound).bind_all(&own).dispatch(w, h, 1);
            f.run(&self.range).bind_all(&bound).bind_all(&own).dispatch(1, 1, 1);
            let size = size_of::<LightView>() as u64;
            for (i, one) in self.each.iter().enumerate().take(number) {
                f.copy(&self.fitted, i as u64 * size, one, size);
            }
            (self.fitted.clone(), self.each[..number].to_vec())
        });
        self.warped.draw(f, &base, &[("shapes", (&self.shapes).into())])?;
        self.drawing.show(f, "warp", || draw_parts(&made.sides));
        Ok(())
    }
}

/// The parts of the light's image, and that of the nearest face after its warp.
fn draw_parts(sides: &[Side]) -> Option<Diagram> {
    let all: Vec<DVec2> = sides.iter().flat_map(|s| s.points.iter().copied()).collect();
    let largest = sides.iter().max_by(|a, b| a.area().total_cmp(&b.area()))?;
    let mut d = Diagram::new(&largest.warp, &largest.points, &all);
    for side in sides {
        let next = |i: usize| side.points[(i + 1) % side.points.len()];
        side.points.iter().enumerate().for_each(|(i, p)| d.place(0, *p, next(i), diagram::MARK));
    }
    d.number(0, sides.len() as f64);
    Some(d)
}

impl Technique for Logarithmic {
    fn render(&mut self, f: &mut Frame) -> Result<()> {
        let p = LogpsmParams::read(f.values);
        tell_even(f);
        let split = p.sides == "faces" && f.camera.height.is_none();
        let maps = hold(&mut self.held, split, |split| {
            Ok(match split {
                true => Maps::Split(Box::new(Split::new(f.gpu)?)),
                false => Maps::Single(Box::new(Single::new(f.gpu)?)),
            })
        })?;
        match maps {
            Maps::Single(one) => one.render(f, &p),
            Maps::Split(several) => several.render(f),
        }
    }
}
