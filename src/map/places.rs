//! Maps from several places of a light with a size, drawn into few layers and looked up as soon as these are full
//! (`shaders/map/places.wgsl`).

use super::casters::{Casters, Target, Triangles};
use super::filter::Reach;
use super::fit::{Kept, Scope, casting};
use super::peel::{Depths, Held};
use super::pyramid::Pyramid;
use super::single::{Fit, between};
use super::{MOST, Maps, light_views, margin, whole};
use crate::frame::{ANALYSIS, Frame, MapSizes};
use crate::gpu::{Buffer, Gpu, Pass, Resource, hold};
use crate::light::{Light, LightView};
use crate::listed_rays::ListedRays;
use crate::params::{Group, Params};
use crate::view::{Class, Drawn, Legend, View, map};
use anyhow::{Context, Result, ensure};
use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec3, vec2};
use wgpu::BufferUsages as Use;

crate::params! {
    /// What maps from many places cover.
    pub struct PlacesFitParams {
        "Fit" {
            /// What each map covers. Receivers: only the surfaces that the camera sees and that face the light. Scene: the whole scene.
            fit: choice("receivers", ["receivers", "scene"]),
        }
    }
}

/// Where all of the light is seen, where none of it, and the penumbra between.
pub const PENUMBRA: View = map(
    "penumbra",
    "Penumbra",
    "Where all maps that a pixel asks see the light, where none does, and where they differ.",
    Drawn::Labels(Legend::Classes(&[
        Class::label(1, "all of the light is seen"),
        Class::label(7, "none of it"),
        Class::label(2, "penumbra"),
    ])),
);

/// Places that surfaces at some depths look up.
pub struct PlaceSet {
    /// Those of the rectangle along its half sides, -1 to 1, or of the disc in units of its radius.
    pub places: Vec<Vec2>,
    /// Texels of a map's side.
    pub side: u32,
    /// Depths along the camera's axis from which on surfaces look these maps up beside the set before, look them up alone, and no
    /// longer do, metres.
    pub depths: [f32; 3],
}

impl PlaceSet {
    /// The depths of the only set.
    pub const ALL: [f32; 3] = [0.0, 0.0, f32::MAX];
}

/// Which pixels are spared most maps, as all of these would say the same.
#[derive(Clone, Copy, PartialEq)]
pub enum Spared {
    None,
    /// Those that the last four places of a set agree on.
    ByFour,
    /// Those where no caster, or no gap between any, can lie before the light, as the map of a set's last place bounds them.
    ByBounds,
}

/// A place for each of k × k of equal parts of the light, or (`corners`) evenly from edge to edge.
pub fn grid(light: &Light, k: u32, corners: bool) -> Vec<Vec2> {
    let along = |i: u32| match corners && k > 1 {
        true => 2.0 * i as f32 / (k - 1) as f32 - 1.0,
        false => (2 * i + 1) as f32 / k as f32 - 1.0,
    };
    (0..k * k).map(|i| on_light(light, vec2(along(i % k), along(i / k)))).collect()
}

/// A place of the light for one of the square, -1 to 1: of a disc the concentric one (Shirley, Chiu 1997).
pub fn on_light(light: &Light, p: Vec2) -> Vec2 {
    if matches!(light, Light::RectArea { .. }) {
        return p;
    }
    let wide = p.x.abs() > p.y.abs();
    let (radius, other) = if wide { (p.x, p.y) } else { (p.y, p.x) };
    let angle = std::f32::consts::FRAC_PI_4 * if radius == 0.0 { 0.0 } else { other / radius };
    let (sine, cosine) = angle.sin_cos();
    radius * if wide { vec2(cosine, sine) } else { vec2(sine, cosine) }
}

/// From the light's middle to a place of its rectangle or disc, -1 to 1 along its half sides or in units of its radius as in
/// `shaders/lib/light_place.wgsl`. Of a directional light that of the unit vector towards it; a spot's disc is turned as the spot.
pub fn step(light: &Light, place: Vec2) -> Vec3 {
    if let Light::RectArea { half_u, half_v, .. } = *light {
        return half_u * place.x + half_v * place.y;
    }
    let to_light = -light.axis();
    let other = if to_light.x.abs() > 0.5 { Vec3::Y } else { Vec3::X };
    let u = to_light.cross(other).normalize();
    light.radius() * (u * place.x + to_light.cross(u) * place.y)
}

/// The light as it shines from there; a spot with a cone so much wider that it holds what lies in the light's own cone, from as far off
/// as the scene's bounds begin or the step is long.
pub fn moved(light: &Light, step: Vec3, bounds: [Vec3; 2]) -> Light {
    let mut moved = *light;
    match &mut moved {
        Light::Directional { to_light, .. } => *to_light = light.position() + step,
        Light::Spot { position, outer_angle, .. } => {
            let axis = light.axis();
            let corner = Vec3::select(axis.cmpge(Vec3::ZERO), bounds[0], bounds[1]);
            let nearest = axis.dot(corner - *position).max(step.length());
            let wider = outer_angle.to_radians().tan() + step.length() / nearest.max(f32::MIN_POSITIVE);
            *outer_angle = wider.atan().to_degrees().min(88.9);
            *position += step;
        }
        other => {
            if let Some(place) = other.place_mut() {
                *place += step;
            }
        }
    }
    moved
}

/// The note of so many pixels that only some of the places' maps reach, or none.
pub fn reached_in_part(pixels: u32) -> String {
    format!("{} they see what the other maps see, or all of the light where none reaches them.", aside(pixels))
}

/// The same where rays decide such pixels.
pub fn left_to_rays(pixels: u32) -> String {
    format!("{} rays decide there.", aside(pixels))
}

fn aside(pixels: u32) -> String {
    format!("{pixels} pixels lie so far aside that maps from some places of the light do not reach them:")
}

/// Maps that are looked up together, as `Batch` in `shaders/map/places.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Batch {
    /// From the light's middle to each place, and the place's number.
    pub steps: [[f32; 4]; MOST],
    /// From the light's middle to the middles of its sides.
    pub half_u: [f32; 4],
    pub half_v: [f32; 4],
    /// Those of the set.
    pub depths: [f32; 3],
    /// How many maps there are.
    pub count: u32,
    /// Maps of the set after which a pixel that they agree on is done; 0: none.
    pub agreeing: u32,
    /// Depth along the last map's axis before which nothing casts, metres.
    pub nearest: f32,
    pub padding: [u32; 2],
}

/// What spares pixels by bounds.
struct Bounds {
    listed: ListedRays,
    bound: Pass,
    add: Pass,
}

/// What is kept of a set.
#[derive(Default)]
struct HeldSet {
    layers: Held,
    /// The first place's map.
    first: Option<wgpu::TextureView>,
    pyramid: Option<((), Pyramid)>,
    /// The receivers that its maps are fitted to.
    between: Option<([f32; 2], Buffer)>,
}

/// The maps, and what those before them saw.
pub struct PlacedMaps {
    file: String,
    groups: &'static [Group],
    fit: Fit,
    casters: Casters,
    begin: Pass,
    add: Pass,
    /// Pixels that some place's map does not reach.
    count_beyond: Pass,
    beyond: Buffer,
    /// The note of their number.
    pub aside: fn(u32) -> String,
    bounds: Option<((), Bounds)>,
    nearest: Kept<f64>,
    inspect: Option<((), Pass)>,
    analyse: Option<((), Pass)>,
    sets: Vec<HeldSet>,
    /// What is looked up together, and these maps' narrowed light views.
    batches: Vec<(Batch, [Buffer; 2])>,
    /// The light view of each layer alone, for drawing.
    single: Vec<Buffer>,
    /// The first place's of each set.
    first_views: Buffer,
    /// Texels that see the light, of so many so far, a word a pixel or two; and those of the probed pixel, a word a place.
    seen: Option<(u64, Buffer)>,
    seen_places: Option<(u64, Buffer)>,
}

impl PlacedMaps {
    /// `file`, `groups`: the technique's shader, which includes `map/places.wgsl`, and its parameters.
    ///
    /// # Errors
    /// Passes that cannot be made.
    pub fn new(gpu: &Gpu, file: String, groups: &'static [Group]) -> Result<PlacedMaps> {
        Ok(PlacedMaps {
            fit: Fit::new(gpu)?,
            casters: Casters::named(["shadow map", "shadow map (masked)"]),
            begin: Pass::compute(gpu, "sum over maps", &file, "begin", groups)?,
            add: Pass::compute(gpu, "sum over maps", &file, "add", groups)?,
            count_beyond: Pass::compute(gpu, "receivers beyond maps", &file, "count_beyond", groups)?,
            beyond: gpu.room("receivers beyond maps", 4, Use::STORAGE | Use::COPY_DST | Use::COPY_SRC),
            aside: reached_in_part,
            file,
            groups,
            bounds: None,
            nearest: Kept::default(),
            inspect: None,
            analyse: None,
            sets: Vec::new(),
            batches: Vec::new(),
            single: (0..MOST).map(|_| light_views(gpu, "light view")).collect(),
            first_views: light_views(gpu, "light views of the first places"),
            seen: None,
            seen_places: None,
        })
    }

    /// Draws a map from each place, `layers` of them at a time, and adds up what they see, the last places first. Given back are
    /// the first set's layers, with the map of its first place in the first one, and the light view of each set's first place.
    /// `slots`: 2 where sets overlap; `reach`: how far the window around a receiver goes.
    ///
    /// # Errors
    /// A light without a single view, or a map or picture that the adapter cannot hold.
    pub fn draw(
        &mut self,
        f: &mut Frame,
        sets: &[PlaceSet],
        layers: u32,
        spared: Spared,
        slots: u64,
        reach: Reach,
    ) -> Result<Maps> {
        let gpu = f.gpu;
        let bytes = f.size.iter().map(|side| u64::from(*side)).product::<u64>() * 4 * slots;
        ensure!(
            bytes <= gpu.most_bound(),
            "the picture has too many pixels to add up what maps see; choose a smaller one"
        );
        let number = sets.iter().map(|set| set.places.len()).sum();
        let room = |bytes: &u64| Ok(gpu.room("texels that see the light", (*bytes).max(16), Use::STORAGE));
        hold(&mut self.seen, bytes, room)?;
        hold(&mut self.seen_places, 4 * number as u64, room)?;
        f.count_maps(number);
        f.run(&self.begin).bind_all(&self.seen()).of_picture().per_pixel();
        self.sets.resize_with(sets.len(), HeldSet::default);
        let narrow = PlacesFitParams::read(f.values).fit != "scene";
        let size = size_of::<LightView>() as u64;
        let [half_u, half_v] = [Vec2::X, Vec2::Y].map(|side| step(&f.light, side).extend(0.0).to_array());
        let mut at = number;
        let mut given = None;
        let mut batch_at = 0;
        for (c, set) in sets.iter().enumerate().rev() {
            at -= set.places.len();
            let together = (layers as usize).min(MOST).min(set.places.len()).max(1);
            let held = &mut self.sets[c];
            let depths = Depths::hold(&mut held.layers, f, &vec![set.side; together])?;
            let looked_up = depths.looked_up();
            let ends = [set.depths[0], set.depths[2]];
            let receivers = hold(&mut held.between, ends, |ends| Ok(between(gpu, *ends, false)))?.clone();
            for (b, places) in set.places.chunks(together).enumerate().rev() {
                let mut batch = Batch {
                    half_u,
                    half_v,
                    depths: set.depths,
                    count: places.len() as u32,
                    agreeing: if spared == Spared::ByFour && set.places.len() > 4 { 4 } else { 0 },
                    ..Batch::zeroed()
                };
                if self.batches.len() == batch_at {
                    let uniform = gpu.buffer("maps looked up together", bytemuck::bytes_of(&batch), Use::UNIFORM);
                    self.batches.push((batch, [uniform, light_views(gpu, "light views of places")]));
                }
                let first = b * together;
                let mut views = Vec::with_capacity(places.len());
                for (slot, place) in places.iter().enumerate() {
                    let step = step(&f.light, *place);
                    batch.steps[slot] = step.extend((at + first + slot) as f32).to_array();
                    let light = moved(&f.light, step, f.scene.bounds);
                    let scope = Scope { light, ..Scope::of(f, set.side, margin(f) + reach.texels) };
                    views.push(LightView { reach: reach.metres, ..whole(&scope)? });
                }
                // The set's last place comes first, and its map bounds what all see.
                let bounding =
                    spared == Spared::ByBounds && set.places.len() > 1 && (b + 1) * together >= set.places.len();
                if let (true, Some(view)) = (bounding, views.last()) {
                    let scope = Scope::of(f, set.side, 0.0);
                    let row = view.axis.as_dvec4();
                    // Rounding leaves a little less.
                    let spare = 1e-4 * f64::from(view.far - view.near);
                    let nearest = *self.nearest.get(f, scope, |s| casting::nearest(s, f.geometry, row));
                    batch.nearest = (nearest - spare).min(f64::from(view.far)) as f32;
                }
                let mut fitted = self.fit.write(f, batch_at, &views);
                if narrow {
                    let to = &self.batches[batch_at].1[1];
                    self.fit.run_all(f, &fitted, batch.count, &receivers, to);
                    fitted = to.clone();
                }
                for slot in 0..places.len() {
                    f.copy(&fitted, slot as u64 * size, &self.single[slot], size);
                    let to = Target::whole(set.side, &self.single[slot], false);
                    self.casters.draw_depths(f, (&depths, slot), to, &Triangles::All)?;
                }
                if first == 0 {
                    f.copy_to(&self.single[0], &self.first_views, c as u64 * size, size);
                }
                let (held_batch, [uniform, _]) = &mut self.batches[batch_at];
                if *held_batch != batch {
                    *held_batch = batch;
                    gpu.queue.write_buffer(uniform, 0, bytemuck::bytes_of(&batch));
                }
                let uniform = uniform.clone();
                batch_at += 1;
                let mut bound = self.seen();
                bound.extend([
                    ("batch", (&uniform).into()),
                    ("light_views", (&fitted).into()),
                    ("shadow_maps", (&looked_up.all).into()),
                ]);
                if spared == Spared::ByBounds && set.places.len() > 1 {
                    let made = |name, entry| Pass::compute(gpu, name, &self.file, entry, self.groups);
                    let bounds = hold(&mut self.bounds, (), |()| {
                        Ok(Bounds {
                            listed: ListedRays::new(gpu)?,
                            bound: made("bounds of the penumbra", "bound")?,
                            add: made("sum over maps", "add_listed")?,
                        })
                    })?;
                    if bounding {
                        let held = hold(&mut self.sets[c].pyramid, (), |()| Pyramid::new(gpu))?;
                        let pyramid = held.make(f, &looked_up.each[places.len() - 1], set.side)?;
                        let listed = bounds.listed.begin(f)?;
                        let run = f.run(&bounds.bound).bind_all(&bound).bind_all(&listed);
                        run.bind("pyramid", &pyramid).of_picture().per_pixel();
                    }
                    bounds.listed.trace_by(f, &bounds.add, &bound);
                } else {
                    f.run(&self.add).bind_all(&bound).of_picture().per_pixel();
                }
            }
            self.sets[c].first = looked_up.each.first().cloned();
            given = Some(looked_up);
        }
        if matches!(f.light, Light::Spot { .. } | Light::RectArea { .. }) {
            f.clear(&self.beyond);
            f.run(&self.count_beyond).bind_all(&self.seen()).bind("beyond", &self.beyond).of_picture().per_pixel();
            f.tell_counted(&self.beyond, self.aside);
        }
        if sets.len() == 1 {
            f.outline_view(&self.first_views);
        }
        let layers = given.context("no place of the light was asked for")?;
        let sides = sets.iter().map(|set| set.side).collect();
        Ok(Maps { layers, light_views: self.first_views.clone(), sides, bound: Vec::new() })
    }

    /// Runs the technique's pass over all pixels that makes visibility of what the maps saw, and what is asked for beside it: views and
    /// the analysis know the first place's map of each set. `bound`: what the technique's shader needs beside what maps and sums are bound as.
    ///
    /// # Errors
    /// Passes that cannot be made.
    pub fn resolve(
        &mut self,
        f: &mut Frame,
        pass: &Pass,
        maps: &Maps,
        mut bound: Vec<(&'static str, Resource)>,
    ) -> Result<()> {
        bound.extend(self.seen());
        bound.extend([("shadow_maps", (&maps.layers.all).into()), ("light_views", (&maps.light_views).into())]);
        f.keep_table("light_views", &maps.light_views);
        let firsts: Vec<_> = self.sets.iter().filter_map(|set| set.first.clone()).collect();
        f.offer_maps(&firsts, &maps.light_views, &maps.sides);
        f.run(pass).bind_all(&bound).of_picture().per_pixel();
        let gpu = f.gpu;
        let made = |name, entry| Pass::compute(gpu, name, &self.file, entry, self.groups);
        if f.wants_analysis() {
            let analyse = hold(&mut self.analyse, (), |()| made(ANALYSIS, "analyse"))?;
            f.analyse(analyse, MapSizes::of(&maps.sides), &bound);
        }
        if f.wants_any_map() {
            let inspect = hold(&mut self.inspect, (), |()| made("inspect", "inspect"))?;
            f.run(inspect).bind_all(&bound).per_pixel();
        }
        Ok(())
    }

    /// What the maps saw, by name.
    fn seen(&self) -> Vec<(&'static str, Resource)> {
        let held = [("seen", &self.seen), ("seen_places", &self.seen_places)];
        held.into_iter().filter_map(|(name, held)| held.as_ref().map(|(_, buffer)| (name, buffer.into()))).collect()
    }
}
