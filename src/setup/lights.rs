//! The lights of a set-up: the one at work, whose maps, visibility, truth and errors are shown, and the others beside it.

use super::Setup;
use crate::light::Light;
use crate::scene::Scene;
use crate::techniques::Info;
use anyhow::{Result, bail, ensure};
use serde::{Deserialize, Serialize};

/// Most lights that a set-up may have.
pub const MOST_LIGHTS: usize = 16;

/// A light that can be switched off.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Lamp {
    /// Off: it lights nothing, and costs nothing where all lights are shown.
    #[serde(default = "yes")]
    pub on: bool,
    #[serde(flatten)]
    pub light: Light,
}

pub(super) fn yes() -> bool {
    true
}
pub(super) fn is_yes(on: &bool) -> bool {
    *on
}
pub(super) fn first() -> u32 {
    1
}
pub(super) fn is_first(number: &u32) -> bool {
    *number == first()
}

impl Setup {
    /// How many lights there are.
    pub fn light_count(&self) -> usize {
        1 + self.more_lights.len()
    }

    /// The place of the light at work among all, from 0.
    pub fn at_work(&self) -> usize {
        (self.light_number as usize).clamp(1, self.light_count()) - 1
    }

    /// All lights in their order.
    pub fn lamps(&self) -> Vec<Lamp> {
        let mut all = self.more_lights.clone();
        all.insert(self.at_work(), Lamp { on: self.light_on, light: self.light });
        all
    }

    /// Takes these lights, of which the one at a place, from 0, is at work.
    pub fn set_lamps(&mut self, mut all: Vec<Lamp>, at_work: usize) {
        let own = all.remove(at_work);
        (self.light, self.light_on, self.light_number) = (own.light, own.on, at_work as u32 + 1);
        self.more_lights = all;
    }

    /// Puts another light to work; all keep their numbers. `at`: its place among all, from 0.
    ///
    /// # Errors
    /// There is no such light.
    pub fn choose_light(&mut self, at: usize) -> Result<()> {
        let all = self.lamps();
        ensure!(at < all.len(), "there is no light {}; there are {}", at + 1, all.len());
        self.set_lamps(all, at);
        Ok(())
    }

    /// Adds a light behind the others; the one at work stays.
    ///
    /// # Errors
    /// There are as many as there may be.
    pub fn add_light(&mut self, light: Light) -> Result<()> {
        let most = self.light_count() == MOST_LIGHTS;
        ensure!(!most, "there are {MOST_LIGHTS} lights already, which is the most; remove one first");
        self.more_lights.push(Lamp { on: true, light });
        Ok(())
    }

    /// Adds the scene's lights that are not there yet.
    ///
    /// # Errors
    /// There would be more than there may be; none is added then.
    pub fn add_all_lights(&mut self, scene: &Scene) -> Result<()> {
        let held = self.lamps();
        let all = scene.lights.iter().map(|l| l.at(scene, self.clock()));
        let new = all.filter(|light| held.iter().all(|lamp| lamp.light != *light));
        let new: Vec<Lamp> = new.map(|light| Lamp { on: true, light }).collect();
        let all = held.len() + new.len();
        ensure!(all <= MOST_LIGHTS, "that makes {all} lights, but a set-up takes up to {MOST_LIGHTS}");
        self.more_lights.extend(new);
        Ok(())
    }

    /// Removes a light, unless it is the only one; where it was at work, the one behind it is, or else the last.
    pub fn remove_light(&mut self, at: usize) {
        let mut all = self.lamps();
        if at < all.len() && all.len() > 1 {
            all.remove(at);
            let work = self.at_work();
            let left = all.len();
            self.set_lamps(all, if work > at { work - 1 } else { work.min(left - 1) });
        }
    }

    /// Switches a light on or off.
    pub fn switch_light(&mut self, at: usize, on: bool) {
        let mut all = self.lamps();
        if let Some(lamp) = all.get_mut(at) {
            lamp.on = on;
            self.set_lamps(all, self.at_work());
        }
    }

    /// The lights that are on, each with its place among all, from 0.
    pub fn lit(&self) -> Vec<(usize, Light)> {
        let all = self.lamps().into_iter().enumerate();
        all.filter(|(_, lamp)| lamp.on).map(|(i, lamp)| (i, lamp.light)).collect()
    }

    /// The lights that are on and not at work.
    pub fn lit_beside(&self) -> Vec<(usize, Light)> {
        if self.more_lights.is_empty() {
            return Vec::new();
        }
        let at_work = self.at_work();
        self.lit().into_iter().filter(|(i, _)| *i != at_work).collect()
    }

    /// Whether the picture is lit by all lights. All others are of the light at work alone.
    pub fn shows_all_lights(&self) -> bool {
        self.overlay.is_some() || ["shaded", "flip"].contains(&self.view.as_str())
    }

    /// Whether the light at work is off and the picture is one of all lights: its shadow is not drawn then.
    pub fn idles(&self) -> bool {
        !self.light_on && self.shows_all_lights()
    }

    /// A set-up for each light that is on, with that one at work: what figures of single lights are measured of. Where the
    /// light at work is the only one, it is the set-up itself; else its view is one of a single light.
    ///
    /// # Errors
    /// All lights are off.
    pub fn each_light(&self) -> Result<Vec<Setup>> {
        let lit = self.lit();
        match lit[..] {
            [] => bail!("all lights are off: there is nothing to measure; switch one on"),
            [(i, _)] if i == self.at_work() => return Ok(vec![self.clone()]),
            _ => {}
        }
        let one = |(i, _): (usize, Light)| {
            let mut own = Setup { view: "visibility".into(), ..self.clone() };
            own.choose_light(i).map(|()| own)
        };
        lit.into_iter().map(one).collect()
    }

    /// Why a technique cannot serve one of the lights that are on; None if it serves all. Where all are off it is the light at
    /// work that counts.
    pub fn refusal(&self, info: &Info) -> Option<String> {
        let lit = if self.more_lights.is_empty() { Vec::new() } else { self.lit() };
        if lit.is_empty() {
            return info.refuses(&self.light);
        }
        let one = |(i, light): (usize, Light)| info.refuses(&light).map(|why| format!("{why} (light {})", i + 1));
        lit.into_iter().find_map(one)
    }

    /// Why nothing can be measured of a technique: it does not serve the light at work, if that is on, or none that is. Others
    /// are left out with a note ([`Setup::unshadowed`]).
    pub fn unmeasurable(&self, info: &Info) -> Option<String> {
        let lit = self.lit();
        if self.light_on || lit.is_empty() {
            return info.refuses(&self.light);
        }
        let refused: Vec<String> = lit.iter().filter_map(|(_, light)| info.refuses(light)).collect();
        (refused.len() == lit.len()).then(|| refused[0].clone())
    }

    /// The lights beside the one at work that a technique draws without a shadow, a sentence each.
    pub fn unshadowed(&self, info: &Info) -> Vec<String> {
        let one = |(i, light): (usize, Light)| {
            info.refuses(&light).map(|reason| format!("Light {} has no shadow: {reason}.", i + 1))
        };
        self.lit_beside().into_iter().filter_map(one).collect()
    }
}
