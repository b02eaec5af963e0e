//! A lixel for every pixel (Chong, Gortler 2004): a map that is exact on one plane.

use super::{FILTERING, Info, MAPS, Technique, chosen};
use crate::frame::Frame;
use crate::gpu::Buffer;
use crate::light::LightView;
use crate::map::cascades::ANALYSED;
use crate::map::casters::{Casters, Target, Triangles};
use crate::map::filter::{LookUp, Reach};
use crate::map::fit::lixel::{self, Grid, Lixel, Plane};
use crate::map::fit::{Kept, Scope};
use crate::map::peel::{Depths, Held, StoredParams};
use crate::map::single::{Fit, scope};
use crate::map::{BiasParams, CasterParams, HardwareParams, MapParams, Maps, light_views, margin, whole};
use crate::params::{Params, Value, Values};
use crate::scene::geometry::Geometry;
use crate::view::{Class, Drawn, Legend, map};
use anyhow::Result;
use glam::{DVec3, Vec4};
use wgpu::BufferUsages as Use;

crate::params! {
    /// The plane whose pixels have texels of their own.
    pub struct LixelParams {
        "Plane of interest" {
            /// Whose pixels have a map of their own. Largest: the plane that most pixels lie on which the light falls on, found by a coarse look at the scene. Given: the one of the values below.
            plane: choice("largest", ["largest", "given"]),
            /// Direction of the plane's normal around the vertical, from +z towards +x. To which side it points makes no difference.
            azimuth: float(0.0, -180.0..=180.0, "°") if plane = "given",
            /// Angle of the plane's normal above the horizontal. ±90: a floor, 0: a wall.
            elevation: float(90.0, -90.0..=90.0, "°") if plane = "given",
            /// How far along its normal the plane lies from the zero point of the scene's coordinates. Of a floor below zero the normal points down.
            distance: float(0.0, 0.0..=100000000.0, "m", 1.0 of view) if plane = "given",
            /// How far from the plane a pixel may lie to look up its map. All others look up the ordinary one.
            tolerance: float(0.01, 0.000001..=1000.0, "m", 0.005 of view),
            /// How large the plane's texels are. Pixels: a texel is a pixel, as far as the map's side suffices. Fill: what is seen of the plane is stretched over the whole map.
            scale: choice("pixels", ["pixels", "fill"]),
        }
    }
}

/// The section of the panel that the plane's parameters stand in.
pub const SECTION: &str = LixelParams::GROUP.specs[0].section;

pub static INFO: Info = Info {
    id: "lixel-per-pixel",
    title: "A lixel for every pixel",
    paper: "Chong, Gortler 2004",
    family: "Warping",
    mark: 47,
    doc: "One plane of the scene, as the floor, gets a shadow map whose texels are the picture's pixels where they lie on it: no \
          stairs at all there. All else looks up an ordinary map. Nothing is gained where the plane is not seen, or light or camera \
          lie in it.",
    lights: &["directional", "spot"],
    filter: None,
    smooth: |_| false,
    params: crate::groups!(
        &[LixelParams::GROUP, MapParams::GROUP, CasterParams::GROUP],
        FILTERING,
        &[BiasParams::GROUP, StoredParams::GROUP, HardwareParams::GROUP],
    ),
    main: &[("resolution", "256..8192*2"), ("scale", "pixels,fill")],
    maps: &[
        &[
            map(
                "shadow-maps",
                "Shadow maps",
                "The ordinary map and the plane's, framed in their colours: near the light bright, far dark.",
                Drawn::Labels(Legend::Classes(&[
                    Class::label(0, "the ordinary map"),
                    Class::label(1, "the plane's map"),
                ])),
            ),
            map(
                "plane",
                "Plane of interest",
                "Which of the two maps a pixel looks up.",
                Drawn::Labels(Legend::Classes(&[
                    Class::label(0, "the ordinary map"),
                    Class::label(1, "the plane's map"),
                    Class::label(2, "on the plane, outside its map"),
                ])),
            ),
        ],
        MAPS.split_at(1).1.split_at(2).0,
        ANALYSED,
    ],
    needs: |_| &[],
    make: |gpu, info| {
        Ok(Box::new(LixelPerPixel {
            fit: Fit::of(gpu, "techniques/lixel_per_pixel/fit.wgsl", info.params)?,
            layers: Held::default(),
            casters: [
                Casters::named(["shadow map", "shadow map (masked)"]),
                Casters::named(["plane's map", "plane's map (masked)"]),
            ],
            views: light_views(gpu, "light views"),
            plane: (NO_PLANE, gpu.buffer("plane of interest", bytemuck::bytes_of(&NO_PLANE), Use::UNIFORM)),
            kept: Kept::default(),
            look_up: LookUp::new(gpu, "techniques/lixel_per_pixel.wgsl", info.params),
        }))
    },
};

/// As `plane_of_interest` in WGSL: no point is near.
const NO_PLANE: Vec4 = Vec4::new(0.0, 0.0, 0.0, 1e30);

struct LixelPerPixel {
    fit: Fit,
    layers: Held,
    /// Of the ordinary map, and of the plane's.
    casters: [Casters; 2],
    /// Of the two maps.
    views: Buffer,
    /// What was written last as `plane_of_interest` in WGSL.
    plane: (Vec4, Buffer),
    kept: Kept<Result<(Plane, Lixel), &'static str>>,
    look_up: LookUp,
}

/// The plane that the parameters give, in scene space, whose zero lies at `origin`.
pub fn given(values: &Values, origin: DVec3) -> Plane {
    // As the set-up has them: 32 bits are too few far from zero.
    let number = |name: &str| match values.get(name) {
        Some(Value::Float(v)) => *v,
        _ => LixelParams::GROUP.specs.iter().find(|s| s.name == name).map_or(0.0, |s| match s.default() {
            Value::Float(v) => v,
            _ => 0.0,
        }),
    };
    let normal = towards(number("azimuth"), number("elevation"));
    Plane { normal, distance: number("distance") - normal.dot(origin) }
}

/// Gives the parameters a plane of scene space, whose zero lies at `origin`.
pub fn give(values: &mut Values, plane: &Plane, origin: DVec3) {
    let distance = plane.distance + plane.normal.dot(origin);
    let normal = plane.normal * if distance < 0.0 { -1.0 } else { 1.0 };
    let elevation = normal.y.clamp(-1.0, 1.0).asin().to_degrees();
    // Upright it has no azimuth.
    let azimuth = if normal.x.hypot(normal.z) < 1e-9 { 0.0 } else { normal.x.atan2(normal.z).to_degrees() };
    values.insert("plane".into(), Value::Text("given".into()));
    for (name, number) in [("azimuth", azimuth), ("elevation", elevation), ("distance", distance.abs())] {
        values.insert(name.into(), Value::Float(number));
    }
}

/// The unit vector of an azimuth and an elevation, degrees.
fn towards(azimuth: f64, elevation: f64) -> DVec3 {
    let ((sin_a, cos_a), (sin_e, cos_e)) = (azimuth.to_radians().sin_cos(), elevation.to_radians().sin_cos());
    DVec3::new(sin_a * cos_e, sin_e, cos_a * cos_e)
}

fn fitted(
    s: &Scope,
    geometry: &Geometry,
    given: Option<Plane>,
    tolerance: f64,
) -> Result<(Plane, Lixel), &'static str> {
    let nothing = "The camera sees nothing that the light falls on: there is no plane of interest.";
    let plane = given.or_else(|| lixel::largest(s, geometry, tolerance)).ok_or(nothing)?;
    lixel::fit(s, &s.image(), &plane).map(|lixel| (plane, lixel))
}

impl LixelPerPixel {
    /// The plane and its map's view; tells what is not as asked for.
    fn of_plane(&mut self, f: &mut Frame, reach: Reach) -> Option<(Plane, LightView)> {
        let p = LixelParams::read(f.values);
        let asked = (p.plane == "given").then(|| given(f.values, f.origin));
        let (geometry, within) = (f.geometry, f64::from(p.tolerance));
        let scope = scope(f, reach);
        let (plane, lixel) = match self.kept.get(f, scope, |s| fitted(s, geometry, asked, within)) {
            Ok(made) => made.clone(),
            Err(why) => {
                f.tell_note((*why).into());
                return None;
            }
        };
        let image = scope.image();
        // What lies behind the plane by the tolerance looks up its map too.
        let aslant = plane.normal.dot(image.depth.truncate()).abs().max(0.05);
        let deepest = lixel.deepest + within / aslant;
        if p.scale == "fill" {
            return Some((plane, scope.view(&image, &lixel.warp, &lixel.seen, deepest)?));
        }
        // Pixels' middles lie on texels': a plain look-up needs none beside the picture.
        let guard = f64::from(reach.texels.ceil() + (margin(f) - 1.0).ceil());
        let Grid { pixels, placed } = lixel::grid(f.size, scope.resolution, guard);
        if pixels > 1.0 {
            f.tell_note(format!(
                "The picture is larger than the map: on the plane of interest a texel is {pixels:.3} pixels wide. It would be 1 with a \
                 resolution of {} texels.",
                f.size[0].max(f.size[1]) + 2 * guard as u32
            ));
        }
        Some((plane, scope.view_through(&image, &(placed * lixel.warp), None, deepest)?))
    }

    /// Draws both maps, or the ordinary one alone.
    fn draw(&mut self, f: &mut Frame, reach: Reach) -> Result<Maps> {
        let own = self.of_plane(f, reach);
        let ordinary = LightView { reach: reach.metres, ..whole(&scope(f, reach))? };
        let (written, plane) = &mut self.plane;
        let words = own.map_or(NO_PLANE, |(plane, _)| plane.normal.extend(plane.distance).as_vec4());
        if *written != words {
            *written = words;
            f.gpu.queue.write_buffer(plane, 0, bytemuck::bytes_of(&words));
        }
        // The fit and the look-up tell by it who looks up which map.
        f.set("plane_of_interest", &*plane);
        let views: Vec<LightView> = [ordinary].into_iter().chain(own.map(|(_, view)| view)).collect();
        let ordinary = self.fit.narrow_first(f, &views);
        let side = MapParams::read(f.values).resolution;
        let sides = vec![side; 1 + usize::from(own.is_some())];
        let depths = Depths::hold(&mut self.layers, f, &sides)?;
        self.casters[0].draw_depths(f, (&depths, 0), Target::whole(side, &ordinary, false), &Triangles::All)?;
        let size = size_of::<LightView>() as u64;
        f.copy(&ordinary, 0, &self.views, size);
        if let Some((_, view)) = own {
            let warped = view.perspective == LightView::WARPED;
            let drawn = self.fit.write(f, 1, &[view]);
            f.copy_to(&drawn, &self.views, size, size);
            self.casters[1].draw_depths(f, (&depths, 1), Target::whole(side, &drawn, warped), &Triangles::All)?;
            f.outline_view(&drawn);
        } else {
            f.outline_view(&ordinary);
        }
        Ok(Maps { layers: depths.looked_up(), light_views: self.views.clone(), sides, bound: Vec::new() })
    }
}

impl Technique for LixelPerPixel {
    fn render(&mut self, f: &mut Frame) -> Result<()> {
        let filter = chosen(f.values);
        let maps = self.draw(f, (filter.reach)(f))?;
        self.look_up.run(f, &maps, filter, &[])
    }
}
