//! Places as people and files know them, in the scene's own coordinates and 64 bits, and as all else knows them: relative
//! to the scene's origin ([`crate::scene::Scene::origin`]), in 32 bits.

use super::Setup;
use crate::path::change_places;
use glam::{DVec3, Vec3};
use serde::de::Error as _;
use serde::ser::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use toml::{Table, Value};

/// The keys of a camera's and of a light's table that hold a place.
const CAMERA: [&str; 2] = ["position", "target"];
const LIGHT: [&str; 2] = ["position", "center"];

/// The coordinate in scene space of one in the scene's own coordinates.
pub fn local(original: f64, origin: f64) -> f32 {
    (original - origin) as f32
}

/// The scene's own coordinate of one in scene space: the one with the fewest digits of all that [`local`] brings back.
pub fn original(local: f32, origin: f64) -> f64 {
    let exact = origin + f64::from(local);
    let mut digits = (0..17).filter_map(|n| format!("{exact:.n$e}").parse().ok());
    digits.find(|x| self::local(*x, origin) == local).unwrap_or(exact)
}

/// Brings the places of a set-up's tables of cameras and lights to scene space, and notes the origin.
pub fn take_off(setup: &mut Table, origin: DVec3) {
    each_place(setup, |table, places| change(table, places, origin, |x, origin| f64::from(local(x, origin))));
    setup.insert("origin".into(), Value::Array(origin.to_array().map(Value::Float).into()));
}

/// The same for a light's table.
pub fn take_off_light(light: &mut Table, origin: DVec3) {
    change(light, &LIGHT, origin, |x, origin| f64::from(local(x, origin)));
}

/// The other way round.
fn put_back(setup: &mut Table, origin: DVec3) {
    each_place(setup, |table, places| change(table, places, origin, |x, origin| original(x as f32, origin)));
}

/// The tables of a set-up that hold places, with the keys of these.
fn each_place(setup: &mut Table, mut to: impl FnMut(&mut Table, &[&str])) {
    let mut within = |table: &mut Table| {
        for (key, places) in [("camera", CAMERA), ("shadow_camera", CAMERA), ("light", LIGHT)] {
            if let Some(Value::Table(table)) = table.get_mut(key) {
                to(table, &places);
            }
        }
    };
    within(setup);
    let keys = setup.get_mut("path").and_then(|path| path.get_mut("keys")).and_then(Value::as_array_mut);
    keys.into_iter().flatten().filter_map(Value::as_table_mut).for_each(within);
    more_lights(setup).for_each(|light| to(light, &LIGHT));
}

/// The tables of the lights beside the one at work.
fn more_lights(setup: &mut Table) -> impl Iterator<Item = &mut Table> {
    let lights = setup.get_mut("more_lights").and_then(Value::as_array_mut);
    lights.into_iter().flatten().filter_map(Value::as_table_mut)
}

fn change(table: &mut Table, keys: &[&str], origin: DVec3, to: impl Fn(f64, f64) -> f64) {
    for key in keys {
        let Some(Value::Array(place)) = table.get_mut(*key) else { continue };
        for (x, origin) in place.iter_mut().zip(origin.to_array()) {
            if let Some(number) = x.as_float().or(x.as_integer().map(|i| i as f64)) {
                *x = Value::Float(to(number, origin));
            }
        }
    }
}

impl Setup {
    /// As TOML, with the keys in the order in which the fields are declared, which a [`Table`] does not keep.
    pub(super) fn text(&self) -> Result<String, toml::ser::Error> {
        let text = toml::to_string(&InSceneSpace(self))?;
        let mut places = &[][..];
        let lines = text.lines().filter(|line| !line.starts_with("origin = ")).map(|line| {
            match line {
                "[camera]" | "[shadow_camera]" | "[path.keys.camera]" => places = &CAMERA[..],
                "[light]" | "[[more_lights]]" | "[path.keys.light]" => places = &LIGHT[..],
                _ if line.starts_with('[') => places = &[],
                _ => {}
            }
            match toml::from_str::<Table>(line) {
                Ok(mut entry) if entry.keys().any(|key| places.contains(&key.as_str())) => {
                    change(&mut entry, places, self.origin, |x, origin| original(x as f32, origin));
                    toml::to_string(&entry)
                }
                _ => Ok(format!("{line}\n")),
            }
        });
        lines.collect()
    }

    /// Counts the places from another origin, through coordinates of 64 bits. From the same origin: makes them ones that a
    /// file can hold.
    pub fn count_from(&mut self, origin: DVec3) {
        let before = std::mem::replace(&mut self.origin, origin);
        let cameras = [&mut self.camera].into_iter().chain(&mut self.shadow_camera);
        let places = cameras.flat_map(|c| [&mut c.position, &mut c.target]).chain(self.light.place_mut());
        let to = |place: Vec3| (before + place.as_dvec3() - origin).as_vec3();
        let places = places.chain(self.more_lights.iter_mut().filter_map(|lamp| lamp.light.place_mut()));
        places.for_each(|place: &mut Vec3| *place = to(*place));
        if let Some(path) = &mut self.path {
            change_places(path, to);
        }
    }
}

/// What `derive` writes and reads is in scene space; `Setup::serialize` and `Setup::deserialize` name that.
struct InSceneSpace<'a>(&'a Setup);

impl Serialize for InSceneSpace<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        Setup::serialize(self.0, serializer)
    }
}

/// In the scene's own coordinates, and with the origin where that is not zero.
impl Serialize for Setup {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        // By way of text, in which 32-bit numbers have no more digits than they need.
        let text = toml::to_string(&InSceneSpace(self)).map_err(S::Error::custom)?;
        let mut table: Table = toml::from_str(&text).map_err(S::Error::custom)?;
        put_back(&mut table, self.origin);
        table.serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for Setup {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Setup, D::Error> {
        let mut table = Table::deserialize(deserializer)?;
        super::shape::rename(&mut table);
        let origin = table.get("origin").map_or(Ok(DVec3::ZERO), |o| o.clone().try_into());
        take_off(&mut table, origin.map_err(D::Error::custom)?);
        Setup::deserialize(Value::Table(table)).map_err(D::Error::custom)
    }
}
