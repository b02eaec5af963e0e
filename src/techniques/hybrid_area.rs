//! Maps from places all over a light with a size: what they agree on is decided, the penumbra asks rays (Beister, Ernst, Stamminger 2005).

use super::rt_soft::LIGHT_SAMPLES;
use super::{Info, MAPS, NEAREST, Technique};
use crate::frame::{ANALYSIS, Frame, MapSizes};
use crate::gpu::{Buffer, Gpu, Pass, Resource, hold};
use crate::light::Light;
use crate::listed_rays::ListedRays;
use crate::map::filter::{Reach, alone};
use crate::map::fit::Scope;
use crate::map::peel::StoredParams;
use crate::map::single::{FitParams, ShadowMap, scope};
use crate::map::{BiasParams, CasterParams, HardwareParams, MapParams, Maps, whole};
use crate::params::Params;
use crate::view::{self, Class, Drawn, Legend, map};
use anyhow::{Result, ensure};
use glam::{Vec2, Vec3};
use wgpu::BufferUsages as Use;

crate::params! {
    /// Places of the light that must agree, and the rays of what does not.
    pub struct AreaAgreementParams {
        "Agreement" {
            /// Side of the window of texels around the receiver that must agree in each map.
            window: int(2, 2..=7, "texels"),
            /// Traces rays from each pixel that the maps do not agree on. Off: such a pixel sees as much of the light as the texels do.
            rays: flag(true),
            /// Rays to the light from such a pixel.
            samples: int(64, 16..=256, "rays") if rays = true,
        }
    }
}

pub static INFO: Info = Info {
    id: "hybrid-area",
    title: "Area agreement hybrid",
    paper: "Beister, Ernst, Stamminger 2005",
    family: "Hybrid",
    mark: 45,
    doc: "Eight maps, from the middle of the light and from seven places at its rim. Where all of them see a pixel or none does, it is lit \
          or dark; elsewhere rays to all of the light decide. What lies between the eight places is missed.",
    lights: &["directional", "spot", "rect-area"],
    filter: Some(NEAREST),
    smooth: |_| false,
    params: &[
        FitParams::GROUP,
        MapParams::GROUP,
        AreaAgreementParams::GROUP,
        CasterParams::GROUP,
        BiasParams::GROUP,
        StoredParams::GROUP,
        HardwareParams::GROUP,
    ],
    main: &[("resolution", "256..2048*2"), ("samples", "16,64"), ("receiver_plane", "false,true")],
    maps: &[
        &[
            map(
                "agreement",
                "Agreement",
                "Where the eight maps agree, and where rays decide.",
                Drawn::Labels(Legend::Classes(&[
                    Class::label(1, "all see the light"),
                    Class::label(7, "none sees it"),
                    Class::label(2, "they disagree: rays"),
                ])),
            ),
            map(
                "map-share",
                "What the maps see",
                "The share of the light that the maps' texels see together, before any ray.",
                view::ramp("share of the light", "", [0.0, 1.0]),
            ),
            LIGHT_SAMPLES,
        ],
        MAPS,
    ],
    make: |gpu, _| Ok(Box::new(HybridArea::new(gpu)?)),
};

const FILE: &str = "techniques/hybrid_area.wgsl";
/// Places of the light, the middle first.
const PLACES: usize = 8;

/// From the light's middle to a place: none, or to one at its rim, of a rectangle on the ellipse that touches its sides. Of a
/// directional light that of the unit vector towards it.
fn step(light: &Light, k: usize) -> Vec3 {
    let at = match k {
        0 => Vec2::ZERO,
        _ => Vec2::from_angle(std::f32::consts::TAU * (k - 1) as f32 / (PLACES - 1) as f32),
    };
    if let Light::RectArea { half_u, half_v, .. } = *light {
        return half_u * at.x + half_v * at.y;
    }
    let u = light.axis().any_orthonormal_vector();
    light.radius() * (u * at.x + light.axis().cross(u) * at.y)
}

/// The light as it shines from there.
fn moved(light: &Light, step: Vec3) -> Light {
    let mut moved = *light;
    match &mut moved {
        Light::Directional { to_light, .. } => *to_light = light.position() + step,
        other => {
            if let Some(place) = other.place_mut() {
                *place += step;
            }
        }
    }
    moved
}

struct HybridArea {
    maps: Vec<ShadowMap>,
    rays: ListedRays,
    begin: Pass,
    add: Pass,
    decide: Pass,
    resolve: Pass,
    inspect: Option<((), Pass)>,
    analyse: Option<((), Pass)>,
    /// From the light's middle to its places.
    steps: Vec<Buffer>,
    /// Texels that see the light, of so many so far, a word a pixel.
    seen: Option<(u64, Buffer)>,
}

impl HybridArea {
    fn new(gpu: &Gpu) -> Result<HybridArea> {
        let file = alone(FILE);
        let pass = |name, entry| Pass::compute(gpu, name, &file, entry, INFO.params);
        Ok(HybridArea {
            maps: (0..PLACES).map(|_| ShadowMap::new(gpu)).collect::<Result<_>>()?,
            rays: ListedRays::new(gpu)?,
            begin: pass("agreement", "begin")?,
            add: pass("agreement", "add")?,
            decide: pass("agreement", "decide")?,
            resolve: pass("shadow rays", "resolve_listed")?,
            inspect: None,
            analyse: None,
            steps: (0..PLACES).map(|_| gpu.buffer("step to a place", &[0; 16], Use::UNIFORM)).collect(),
            seen: None,
        })
    }
}

impl Technique for HybridArea {
    fn render(&mut self, f: &mut Frame) -> Result<()> {
        let gpu = f.gpu;
        let p = AreaAgreementParams::read(f.values);
        let bytes = f.size.iter().map(|side| u64::from(*side)).product::<u64>() * 4;
        ensure!(
            bytes <= gpu.most_bound(),
            "the picture has too many pixels to count what maps see; choose a smaller one"
        );
        let room = |bytes: &u64| Ok(gpu.room("texels that see the light", *bytes, Use::STORAGE));
        let seen = hold(&mut self.seen, bytes, room)?.clone();
        let places = if f.light.has_size() { PLACES } else { 1 };
        if places == 1 {
            f.tell_note("The light has no size: one map and one ray a pixel, from and to its centre.".into());
        }
        f.run(&self.begin).bind("seen", &seen).of_picture().per_pixel();
        let reach = Reach { texels: 0.5 * p.window as f32, ..Reach::default() };
        // The centre's is what views show; the others' maps lie beside it.
        let mut centre: Option<Maps> = None;
        for k in (0..places).rev() {
            let step = step(&f.light, k);
            let maps = if k == 0 {
                self.maps[k].render(f, reach)?
            } else {
                let view = whole(&Scope { light: moved(&f.light, step), ..scope(f, reach) })?;
                let narrow = FitParams::read(f.values).fit != "scene";
                self.maps[k].render_view(f, Some(view), reach, narrow)?
            };
            let step_held = &self.steps[k];
            gpu.queue.write_buffer(step_held, 0, bytemuck::cast_slice(&step.extend(0.0).to_array()));
            f.run(&self.add)
                .bind("seen", &seen)
                .bind("step_to_place", step_held)
                .bind("shadow_maps", &maps.layers.all)
                .bind("light_views", &maps.light_views)
                .of_picture()
                .per_pixel();
            centre = Some(maps);
        }
        let Some(maps) = centre else { return Ok(()) };
        let mut bound: Vec<(&'static str, Resource)> = self.rays.begin(f)?.into();
        bound.extend([("seen", (&seen).into())]);
        bound.extend([("shadow_maps", (&maps.layers.all).into()), ("light_views", (&maps.light_views).into())]);
        f.keep_table("light_views", &maps.light_views);
        f.offer_maps(&maps.layers.each, &maps.light_views, &maps.sides);
        let file = alone(FILE);
        let pass = |name, entry| Pass::compute(gpu, name, &file, entry, INFO.params);
        if f.wants_analysis() {
            let analyse = hold(&mut self.analyse, (), |()| pass(ANALYSIS, "analyse"))?;
            f.analyse(analyse, MapSizes::of(&maps.sides), &bound);
        }
        f.run(&self.decide).bind_all(&bound).of_picture().per_pixel();
        if p.rays {
            self.rays.trace_by(f, &self.resolve);
        }
        if f.wants_any_map() {
            let inspect = hold(&mut self.inspect, (), |()| pass("inspect", "inspect"))?;
            f.run(inspect).bind_all(&bound).per_pixel();
        }
        Ok(())
    }
}
