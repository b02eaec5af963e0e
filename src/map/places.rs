//! Maps from several places of a light with a size, drawn into one texture and looked up one after the other
//! (`shaders/map/places.wgsl`).

use super::Maps;
use super::filter::Reach;
use super::single::ShadowMap;
use crate::frame::{ANALYSIS, Frame, MapSizes};
use crate::gpu::{Buffer, Gpu, Pass, Resource, hold};
use crate::light::Light;
use crate::params::Group;
use anyhow::{Result, ensure};
use glam::{Vec2, Vec3};
use wgpu::BufferUsages as Use;

/// The map, and what it and those before it saw.
pub struct PlacedMaps {
    file: String,
    groups: &'static [Group],
    map: ShadowMap,
    begin: Pass,
    add: Pass,
    inspect: Option<((), Pass)>,
    analyse: Option<((), Pass)>,
    /// From the light's middle to its places.
    steps: Vec<(Vec3, Buffer)>,
    /// Texels that see the light, of so many so far, a word a pixel; and those of the probed pixel, a word a place.
    seen: Option<(u64, Buffer)>,
    seen_places: Option<(u64, Buffer)>,
}

/// From the light's middle to a place of its rectangle or disc, -1 to 1 along its half sides or in units of its radius as in
/// `shaders/lib/light_place.wgsl`. Of a directional light that of the unit vector towards it; a spot's disc is turned as the spot.
pub(crate) fn step(light: &Light, place: Vec2) -> Vec3 {
    if let Light::RectArea { half_u, half_v, .. } = *light {
        return half_u * place.x + half_v * place.y;
    }
    let to_light = -light.axis();
    let other = if to_light.x.abs() > 0.5 { Vec3::Y } else { Vec3::X };
    let u = to_light.cross(other).normalize();
    light.radius() * (u * place.x + to_light.cross(u) * place.y)
}

/// The light as it shines from there.
pub(crate) fn moved(light: &Light, step: Vec3) -> Light {
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

impl PlacedMaps {
    /// `file`, `groups`: the technique's shader, which includes `map/places.wgsl`, and its parameters.
    ///
    /// # Errors
    /// Passes that cannot be made.
    pub fn new(gpu: &Gpu, file: String, groups: &'static [Group]) -> Result<PlacedMaps> {
        Ok(PlacedMaps {
            map: ShadowMap::new(gpu)?,
            begin: Pass::compute(gpu, "sum over maps", &file, "begin", groups)?,
            add: Pass::compute(gpu, "sum over maps", &file, "add", groups)?,
            file,
            groups,
            inspect: None,
            analyse: None,
            steps: Vec::new(),
            seen: None,
            seen_places: None,
        })
    }

    /// Draws a map from each place and adds up what it sees. The map of the first one is drawn last, and given back. `reach`: how far
    /// the window around a receiver goes.
    ///
    /// # Errors
    /// A light without a single view, or a map or picture that the adapter cannot hold.
    pub fn draw(&mut self, f: &mut Frame, places: &[Vec2], reach: Reach) -> Result<Option<Maps>> {
        let gpu = f.gpu;
        let bytes = f.size.iter().map(|side| u64::from(*side)).product::<u64>() * 4;
        ensure!(
            bytes <= gpu.most_bound(),
            "the picture has too many pixels to add up what maps see; choose a smaller one"
        );
        let room = |bytes: &u64| Ok(gpu.room("texels that see the light", (*bytes).max(16), Use::STORAGE));
        hold(&mut self.seen, bytes, room)?;
        hold(&mut self.seen_places, 4 * places.len() as u64, room)?;
        while self.steps.len() < places.len() {
            self.steps.push((Vec3::NAN, gpu.buffer("step to a place", &[0; 16], Use::UNIFORM)));
        }
        f.count_maps(places.len());
        f.run(&self.begin).bind_all(&self.bound()).of_picture().per_pixel();
        let mut first = None;
        for (k, place) in places.iter().enumerate().rev() {
            let step = step(&f.light, *place);
            let maps = self.map.render_place(f, k, moved(&f.light, step), reach)?;
            let (held, buffer) = &mut self.steps[k];
            if *held != step {
                *held = step;
                gpu.queue.write_buffer(buffer, 0, bytemuck::cast_slice(&step.extend(k as f32).to_array()));
            }
            f.run(&self.add)
                .bind_all(&self.bound())
                .bind("step_to_place", &self.steps[k].1)
                .bind("shadow_maps", &maps.layers.all)
                .bind("light_views", &maps.light_views)
                .of_picture()
                .per_pixel();
            first = Some(maps);
        }
        Ok(first)
    }

    /// Runs the technique's pass over all pixels that makes visibility of what the maps saw, and what is asked for beside it: views and
    /// the analysis know the first place's map. `bound`: what the technique's shader needs beside what maps and sums are bound as.
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
        bound.extend(self.bound());
        bound.extend([("shadow_maps", (&maps.layers.all).into()), ("light_views", (&maps.light_views).into())]);
        f.keep_table("light_views", &maps.light_views);
        f.offer_maps(&maps.layers.each, &maps.light_views, &maps.sides);
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
    fn bound(&self) -> Vec<(&'static str, Resource)> {
        let held = [("seen", &self.seen), ("seen_places", &self.seen_places)];
        held.into_iter().filter_map(|(name, held)| held.as_ref().map(|(_, buffer)| (name, buffer.into()))).collect()
    }
}
