//! A path of one's own: key frames of camera and light, and how a set-up moves from one to the next.

mod reduce;
mod route;

pub use reduce::{Sample, reduce};
pub use route::Route;

use crate::light::Light;
use crate::scene::Camera;
use crate::setup::{Setup, check_direction, check_place, check_shape};
use anyhow::{Context, Result, bail, ensure};
use glam::Vec3;
use serde::{Deserialize, Serialize};
use std::ops::{Add, Mul, Sub};
use std::sync::Arc;

/// Key frames, each at a time. Places are in scene space in memory, in files in the scene's own coordinates.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OwnPath {
    /// How it runs from key to key.
    #[serde(default)]
    pub between: Between,
    /// In the order of their times; the path lasts from the first to the last.
    pub keys: Vec<Key>,
}

/// How a path runs from key to key. It passes through all of them either way; fields of view always change evenly.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Between {
    /// Without corners: a cubic curve whose velocity at each key is that from the key before to the key after (Catmull and
    /// Rom 1974, for uneven times), and zero where one of these stands in the same place.
    #[default]
    Smooth,
    /// Straight, at an even speed.
    Linear,
}

impl Between {
    pub const ALL: [Between; 2] = [Between::Smooth, Between::Linear];

    /// As set-ups have it.
    pub fn id(self) -> &'static str {
        match self {
            Between::Smooth => "smooth",
            Between::Linear => "linear",
        }
    }
}

/// Where camera and light stand at a moment. What a key leaves out runs from the key before to the key after that have it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Key {
    /// Seconds.
    pub time: f32,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera: Option<CameraKey>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub light: Option<LightKey>,
}

/// A camera of a key frame; near and far plane are the set-up's.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraKey {
    pub position: Vec3,
    pub target: Vec3,
    /// What points upwards in the picture.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub up: Option<Vec3>,
    /// Vertical field of view, degrees.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fov: Option<f32>,
    /// Of an orthographic camera how high its picture is, metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub height: Option<f32>,
}

/// A light of a key frame, by the keys that its kind has in a set-up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LightKey {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub position: Option<Vec3>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub direction: Option<Vec3>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub to_light: Option<Vec3>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub center: Option<Vec3>,
}

/// What a path moves of each kind of light, in the order of [`crate::light::KINDS`].
const MOVED: [&[&str]; 5] =
    [&["to_light"], &["position", "direction"], &["position"], &["position", "direction"], &["center"]];

/// Most keys of a path.
pub const MOST_KEYS: usize = 10_000;
/// The latest time of a key, seconds.
pub const LONGEST: f32 = 1e6;

impl CameraKey {
    pub fn of(camera: &Camera) -> CameraKey {
        let up = Some(camera.up).filter(|up| *up != Vec3::Y);
        CameraKey { position: camera.position, target: camera.target, up, fov: Some(camera.fov), height: camera.height }
    }
}

impl LightKey {
    pub fn of(light: &Light) -> LightKey {
        let none = LightKey::default();
        match *light {
            Light::Directional { to_light, .. } => LightKey { to_light: Some(to_light), ..none },
            Light::Spot { position, direction, .. } | Light::Hemisphere { position, direction, .. } => {
                LightKey { position: Some(position), direction: Some(direction), ..none }
            }
            Light::Omni { position, .. } => LightKey { position: Some(position), ..none },
            Light::RectArea { center, .. } => LightKey { center: Some(center), ..none },
        }
    }

    fn named(&self) -> [(&'static str, Option<Vec3>); 4] {
        [
            ("position", self.position),
            ("direction", self.direction),
            ("to_light", self.to_light),
            ("center", self.center),
        ]
    }

    /// Whether all that it holds is of this kind of light.
    fn fits(&self, light: &Light) -> bool {
        self.named().iter().all(|(name, value)| value.is_none() || MOVED[light.index()].contains(name))
    }

    fn check(&self, light: &Light) -> Result<()> {
        let (kind, moved) = (light.kind(), MOVED[light.index()]);
        ensure!(
            self.named().iter().any(|n| n.1.is_some()),
            "light is empty; of a {kind} light it takes {}",
            moved.join(", ")
        );
        for (name, value) in self.named().into_iter().filter_map(|(name, v)| Some((name, v?))) {
            ensure!(
                moved.contains(&name),
                "light.{name} is not for a {kind} light, of which a path moves {}",
                moved.join(", ")
            );
            let key = format!("light.{name}");
            match name {
                "direction" | "to_light" => check_direction(&key, value)?,
                _ => check_place(&key, value)?,
            }
        }
        Ok(())
    }
}

impl Key {
    /// Where a set-up's camera, its light, or both stand now.
    pub fn of(setup: &Setup, time: f32, [camera, light]: [bool; 2]) -> Key {
        Key {
            time,
            camera: camera.then(|| CameraKey::of(&setup.camera)),
            light: light.then(|| LightKey::of(&setup.light)),
        }
    }

    fn check(&self, light: &Light) -> Result<()> {
        let time = self.time;
        ensure!((0.0..=LONGEST).contains(&time), "time = {time} is not allowed; it takes 0 to {LONGEST} s");
        ensure!(self.camera.is_some() || self.light.is_some(), "it moves nothing; give it a camera, a light, or both");
        if let Some(c) = &self.camera {
            for (name, place) in [("position", c.position), ("target", c.target)] {
                check_place(&format!("camera.{name}"), place)?;
            }
            ensure!(c.position != c.target, "camera.target must differ from camera.position");
            check_shape("camera", c.up.unwrap_or(Vec3::Y), c.fov.unwrap_or(60.0), c.height)?;
        }
        self.light.map_or(Ok(()), |l| l.check(light))
    }

    /// The places that it holds, in scene space; directions are none.
    fn places_mut(&mut self) -> impl Iterator<Item = &mut Vec3> {
        let camera = self.camera.iter_mut().flat_map(|c| [&mut c.position, &mut c.target]);
        camera.chain(self.light.iter_mut().flat_map(|l| [&mut l.position, &mut l.center]).flatten())
    }
}

impl OwnPath {
    /// Times of the first and the last key, seconds.
    pub fn times(&self) -> [f32; 2] {
        let time = |key: Option<&Key>| key.map_or(0.0, |k| k.time);
        [time(self.keys.first()), time(self.keys.last())]
    }

    /// How long it takes, seconds.
    pub fn seconds(&self) -> f32 {
        let [first, last] = self.times();
        last - first
    }

    /// The time at `t`, 0 to 1 along the path, seconds.
    pub fn time(&self, t: f32) -> f64 {
        let [first, last] = self.times().map(f64::from);
        first + t as f64 * (last - first)
    }

    /// Where on the path, 0 to 1, a time is.
    pub fn share(&self, time: f32) -> f32 {
        let seconds = self.seconds();
        if seconds > 0.0 { ((time - self.times()[0]) / seconds).clamp(0.0, 1.0) } else { 0.0 }
    }

    /// Moves camera and light to where they stand at a time, seconds; before the first key and after the last as there.
    pub fn place(&self, camera: &mut Camera, light: &mut Light, time: f64) {
        let (keys, between) = (&self.keys[..], self.between);
        let position = along(keys, |k| k.camera.map(|c| c.position), between, time);
        let target = along(keys, |k| k.camera.map(|c| c.target), between, time);
        if let (Some(position), Some(target)) = (position, target) {
            camera.position = position;
            // Two curves may meet where no key is.
            let last = || before(keys, |k| k.camera, time).map_or(Vec3::NEG_Z, |c| c.target - c.position);
            camera.target = if (target - position).try_normalize().is_some() { target } else { position + last() };
        }
        if let Some(up) = along(keys, |k| k.camera?.up, Between::Linear, time).and_then(Vec3::try_normalize) {
            camera.up = up;
        }
        if let Some(fov) = along(keys, |k| k.camera?.fov, Between::Linear, time) {
            camera.fov = fov;
        }
        if let Some(height) = along(keys, |k| k.camera?.height, Between::Linear, time) {
            camera.height = Some(height);
        }
        let at = |of: fn(&LightKey) -> Option<Vec3>| along(keys, |k| of(&k.light?), between, time);
        let aim = |of: fn(&LightKey) -> Option<Vec3>| {
            let unit = |k: &Key| of(&k.light?)?.try_normalize();
            match between {
                Between::Linear => turned(keys, unit, time),
                // Halfway between opposite directions there is none.
                _ => {
                    along(keys, unit, between, time).filter(|v| v.length() > 1e-6).or_else(|| before(keys, unit, time))
                }
            }
        };
        let set = |to: &mut Vec3, value: Option<Vec3>| *to = value.unwrap_or(*to);
        match light {
            Light::Directional { to_light, .. } => set(to_light, aim(|l| l.to_light)),
            Light::Spot { position, direction, .. } | Light::Hemisphere { position, direction, .. } => {
                set(position, at(|l| l.position));
                set(direction, aim(|l| l.direction));
            }
            Light::Omni { position, .. } => set(position, at(|l| l.position)),
            Light::RectArea { center, .. } => set(center, at(|l| l.center)),
        }
    }

    /// Takes a key in at its time. Where one stands already it takes over what the new one leaves out.
    pub fn set(&mut self, mut key: Key) {
        key.time = to_millis(key.time);
        let i = self.keys.partition_point(|k| k.time < key.time);
        match self.keys.get_mut(i).filter(|k| k.time == key.time) {
            Some(old) => *old = Key { camera: key.camera.or(old.camera), light: key.light.or(old.light), ..key },
            None => self.keys.insert(i, key),
        }
    }

    /// Refuses what cannot be played with a light, in a sentence.
    ///
    /// # Errors
    /// No keys, times that do not increase, numbers out of range, or what the light does not have.
    pub fn check(&self, light: &Light) -> Result<()> {
        ensure!(!self.keys.is_empty(), "path.keys is empty; give the path one key at least, or leave it out");
        let count = self.keys.len();
        ensure!(count <= MOST_KEYS, "path.keys has {count} keys; a path takes up to {MOST_KEYS}");
        for (i, key) in self.keys.iter().enumerate() {
            key.check(light).with_context(|| format!("key {} of the path", i + 1))?;
        }
        let cameras = || self.keys.iter().filter_map(|k| k.camera);
        ensure!(
            !(cameras().any(|c| c.height.is_some()) && cameras().any(|c| c.fov.is_some() && c.height.is_none())),
            "the path's keys have a height and a fov in different keys: all of it is seen in perspective (fov) or orthographic (height)"
        );
        for (i, pair) in self.keys.windows(2).enumerate() {
            let [a, b] = [pair[0].time, pair[1].time];
            if b <= a {
                bail!("key {} of the path is at {b} s, not after key {} at {a} s; sort the keys by time", i + 2, i + 1);
            }
        }
        Ok(())
    }

    /// The path without what it moves of another kind of light; None: nothing is left.
    fn fitting(mut self, light: &Light) -> Option<OwnPath> {
        self.keys.iter_mut().for_each(|k| k.light = k.light.filter(|l| l.fits(light)));
        self.keys.retain(|k| k.camera.is_some() || k.light.is_some());
        (!self.keys.is_empty()).then_some(self)
    }
}

impl Setup {
    /// Lets go of what the path moves of another kind of light than the set-up's.
    pub fn fit_path(&mut self) {
        let fits = |p: &OwnPath| p.keys.iter().filter_map(|k| k.light).all(|l| l.fits(&self.light));
        if self.path.as_deref().is_some_and(|p| !fits(p)) {
            let path = self.path.take().and_then(|p| Arc::unwrap_or_clone(p).fitting(&self.light));
            self.path = path.map(Arc::new);
        }
    }
}

/// Changes the places of a path's keys, where one of them changes.
pub(crate) fn change_places(path: &mut Arc<OwnPath>, to: impl Fn(Vec3) -> Vec3) {
    let differs = |mut key: Key| key.places_mut().any(|p| to(*p) != *p);
    if path.keys.iter().copied().any(differs) {
        Arc::make_mut(path).keys.iter_mut().flat_map(Key::places_mut).for_each(|p| *p = to(*p));
    }
}

/// A time in whole milliseconds, as people write it; seconds.
pub fn to_millis(time: f32) -> f32 {
    ((f64::from(time) * 1e3).round() / 1e3) as f32
}

/// What the last key at or before a time holds that has it, or else the first.
fn before<T>(keys: &[Key], of: impl Fn(&Key) -> Option<T>, time: f64) -> Option<T> {
    let now = keys.partition_point(|k| f64::from(k.time) <= time);
    keys[..now].iter().rev().find_map(&of).or_else(|| keys.iter().find_map(&of))
}

/// A quantity at a time, from the keys that have it; at a key exactly what that has. None: no key has it.
fn along<T>(keys: &[Key], of: impl Fn(&Key) -> Option<T>, between: Between, time: f64) -> Option<T>
where
    T: Copy + PartialEq + Add<Output = T> + Sub<Output = T> + Mul<f32, Output = T>,
{
    let now = keys.partition_point(|k| f64::from(k.time) <= time);
    let timed = |k: &Key| Some((f64::from(k.time), of(k)?));
    let (mut earlier, mut later) = (keys[..now].iter().rev().filter_map(timed), keys[now..].iter().filter_map(timed));
    let (a, b) = match (earlier.next(), later.next()) {
        (Some(a), Some(b)) => (a, b),
        (one, other) => return one.or(other).map(|(_, value)| value),
    };
    let (seconds, way) = (b.0 - a.0, b.1 - a.1);
    let u = ((time - a.0) / seconds) as f32;
    if between == Between::Linear {
        return Some(a.1 + way * u);
    }
    let from = velocity(earlier.next(), a, Some(b)) * seconds as f32;
    let to = velocity(Some(a), b, later.next()) * seconds as f32;
    // Hermite's cubic.
    Some(a.1 + way * (u * u * (3.0 - 2.0 * u)) + from * (u * (1.0 - u) * (1.0 - u)) + to * (u * u * (u - 1.0)))
}

/// A direction at a time: it turns from key to key at an even speed. None: no key has it.
fn turned(keys: &[Key], of: impl Fn(&Key) -> Option<Vec3>, time: f64) -> Option<Vec3> {
    let now = keys.partition_point(|k| f64::from(k.time) <= time);
    let timed = |k: &Key| Some((f64::from(k.time), of(k)?));
    let (earlier, later) = (keys[..now].iter().rev().find_map(timed), keys[now..].iter().find_map(timed));
    match (earlier, later) {
        (Some(a), Some(b)) => Some(a.1.slerp(b.1, ((time - a.0) / (b.0 - a.0)) as f32)),
        (one, other) => one.or(other).map(|(_, direction)| direction),
    }
}

/// The velocity at a key between its neighbours.
fn velocity<T>(before: Option<(f64, T)>, at: (f64, T), after: Option<(f64, T)>) -> T
where
    T: Copy + PartialEq + Sub<Output = T> + Mul<f32, Output = T>,
{
    let still = |other: Option<(f64, T)>| other.is_some_and(|o| o.1 == at.1);
    let (from, to) = (before.unwrap_or(at), after.unwrap_or(at));
    if still(before) || still(after) || to.0 <= from.0 {
        return at.1 * 0.0;
    }
    (to.1 - from.1) * (1.0 / (to.0 - from.0)) as f32
}

/// How set-ups hold a path: shared between copies, in files like any other table.
pub(crate) mod shared {
    use super::OwnPath;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};
    use std::sync::Arc;

    pub fn serialize<S: Serializer>(path: &Option<Arc<OwnPath>>, serializer: S) -> Result<S::Ok, S::Error> {
        path.as_deref().serialize(serializer)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<Arc<OwnPath>>, D::Error> {
        Ok(Option::<OwnPath>::deserialize(deserializer)?.map(Arc::new))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> Camera {
        Camera::new(Vec3::ZERO, Vec3::NEG_Z, 60.0, 0.1, 100.0)
    }

    fn sun() -> Light {
        Light::Directional { to_light: Vec3::Y, angular_radius: 0.0, color: Vec3::ONE }
    }

    /// Positions with their times, looking ahead.
    fn path(between: Between, places: &[(f32, [f32; 3])]) -> OwnPath {
        let key = |(time, p): &(f32, [f32; 3])| {
            let position = Vec3::from(*p);
            let camera = CameraKey { position, target: position + Vec3::new(0.0, -0.25, -3.0), ..CameraKey::default() };
            Key { time: *time, camera: Some(camera), light: None }
        };
        OwnPath { between, keys: places.iter().map(key).collect() }
    }

    fn position(path: &OwnPath, time: f64) -> Vec3 {
        let (mut camera, mut light) = (camera(), sun());
        path.place(&mut camera, &mut light, time);
        camera.position
    }

    const BENT: [(f32, [f32; 3]); 5] = [
        (0.5, [0.1, 2.0, 5.3]),
        (1.7, [3.0, 2.5, 4.0]),
        (2.0, [3.5, 0.7, -2.0]),
        (5.0, [-8.0, 0.7, 1.0]),
        (9.0, [-8.0, 1.1, 1.0]),
    ];

    #[test]
    fn a_path_passes_through_its_keys_exactly_and_without_jumps() {
        for between in Between::ALL {
            let p = path(between, &BENT);
            for (time, place) in BENT {
                assert_eq!(position(&p, time.into()), Vec3::from(place), "{between:?} at {time}");
                let nearly = [-1e-5, 1e-5].map(|by| position(&p, f64::from(time) + by).distance(place.into()));
                assert!(nearly.iter().all(|d| *d < 1e-3), "{between:?} at {time}: {nearly:?}");
            }
            assert_eq!(position(&p, 0.0), Vec3::from(BENT[0].1), "before the first");
            assert_eq!(position(&p, 20.0), Vec3::from(BENT[4].1), "after the last");
            assert_eq!([p.time(0.0), p.time(1.0)], [0.5, 9.0]);
        }
        // Smooth: the velocity before a key is that after it. Linear: it is not.
        let bend = |between| {
            let p = path(between, &BENT);
            let v = |a: f64, b: f64| (position(&p, b) - position(&p, a)) / (b - a) as f32;
            (v(1.7 - 2e-3, 1.7) - v(1.7, 1.7 + 2e-3)).length()
        };
        assert!(bend(Between::Smooth) < 0.5 && bend(Between::Linear) > 10.0, "{}", bend(Between::Smooth));
    }

    /// Two keys, and keys along a line at an even speed, are a line either way; two equal ones a rest.
    #[test]
    fn straight_ways_are_straight_and_rests_are_rests() {
        let even = [(0.0, [0.0, 1.0, 0.0]), (1.0, [2.0, 1.0, -1.0]), (3.0, [6.0, 1.0, -3.0])];
        for keys in [&even[..], &[even[0], even[2]]] {
            let [a, b] = Between::ALL.map(|between| path(between, keys));
            for time in [0.3, 1.4, 2.9] {
                assert!(position(&a, time).distance(position(&b, time)) < 1e-5, "{time}");
                assert!(position(&a, time).distance(Vec3::new(2.0, 0.0, -1.0) * time as f32 + Vec3::Y) < 1e-5);
            }
        }
        let rest = path(Between::Smooth, &[(0.0, [0.0; 3]), (1.0, [4.0; 3]), (3.0, [4.0; 3]), (4.0, [0.0; 3])]);
        for time in [1.0, 1.5, 2.2, 3.0] {
            assert_eq!(position(&rest, time), Vec3::splat(4.0), "{time}");
        }
    }

    /// What a key leaves out runs on between those that have it.
    #[test]
    fn camera_and_light_have_keys_of_their_own() {
        let mut p = path(Between::Linear, &[(0.0, [0.0; 3]), (4.0, [8.0, 0.0, 0.0])]);
        let to_light = |v| Some(LightKey { to_light: Some(v), ..LightKey::default() });
        p.set(Key { time: 1.0, light: to_light(10.0 * Vec3::Y), ..Key::default() });
        p.set(Key { time: 3.0, light: to_light(Vec3::X), ..Key::default() });
        p.keys[0].camera.as_mut().unwrap().fov = Some(40.0);
        p.keys[3].camera.as_mut().unwrap().fov = Some(80.0);
        p.check(&sun()).unwrap();
        let (mut c, mut l) = (camera(), sun());
        p.place(&mut c, &mut l, 2.0);
        assert_eq!((c.position, c.fov), (Vec3::new(4.0, 0.0, 0.0), 60.0));
        assert!(l.position().distance(Vec3::new(1.0, 1.0, 0.0).normalize()) < 1e-6, "{:?}", l.position());
        p.place(&mut c, &mut l, 1.5);
        assert!((l.position().angle_between(Vec3::Y).to_degrees() - 22.5).abs() < 1e-3, "{:?}", l.position());
        // Opposite directions have no middle, and a camera always looks somewhere.
        p.set(Key { time: 3.0, light: to_light(Vec3::NEG_Y), ..Key::default() });
        p.keys[3].camera = Some(CameraKey { position: Vec3::new(0.0, -0.25, -3.0), ..CameraKey::default() });
        p.place(&mut c, &mut l, 2.0);
        assert!(l.position().is_finite() && c.position.distance(c.target) > 0.1, "{c:?} {l:?}");
        // Of another light only what the camera does is left.
        let spot = Light::Omni { position: Vec3::ONE, range: 9.0, radius: 0.0, color: Vec3::ONE };
        assert!(p.check(&spot).is_err());
        let left = p.fitting(&spot).unwrap();
        left.check(&spot).unwrap();
        assert_eq!(left.keys.len(), 2);
    }
}
