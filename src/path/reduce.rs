//! From the many places of a recording to the few keys of a path.

use super::{Between, Key, OwnPath};
use super::{CameraKey, LightKey};
use crate::light::Light;
use crate::scene::Camera;

/// Where camera and light stood at a moment of a recording.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Seconds since it began; they increase.
    pub time: f32,
    pub camera: Camera,
    pub light: Light,
}

/// How far the path may leave what was recorded: a camera's places as a share of its distance from the target, about two
/// pixels of a thousand; a light's as a share of the scene's diagonal.
const CAMERA: f32 = 2e-3;
const LIGHT: f32 = 1e-3;
/// A direction and a field of view, degrees.
const ANGLE: f32 = 0.1;
const FOV: f32 = 0.1;

/// The path through a recording with so few keys that it stays close to all of it, of what moved: camera, light or both.
/// Rests at both ends are left out. `diagonal`: the scene's, metres. None: nothing moved.
///
/// As Ramer 1972 and Douglas and Peucker 1973: begun with the two ends, each stretch that leaves the recording too far gets
/// the place where it does so most. Distances are those from the path as it will be played, at the same times.
pub fn reduce(samples: &[Sample], diagonal: f32, between: Between) -> Option<OwnPath> {
    let (first, last) = (samples.first()?, samples.last()?);
    let differs = |a: &Sample, b: &Sample| a.camera != b.camera || LightKey::of(&a.light) != LightKey::of(&b.light);
    let start = samples.iter().position(|s| differs(s, first))?.saturating_sub(1);
    let end = samples.iter().rposition(|s| differs(s, last))? + 1;
    let samples = &samples[start..=end];
    // A light that was exchanged for one of another kind has no way.
    let one_kind = samples.iter().all(|s| s.light.index() == samples[0].light.index());
    let light = one_kind && samples.iter().any(|s| LightKey::of(&s.light) != LightKey::of(&samples[0].light));
    let camera = samples.iter().any(|s| s.camera != samples[0].camera);
    if !camera && !light {
        return None;
    }
    let key = |s: &Sample| Key {
        // From where the way begins.
        time: super::to_millis(s.time - samples[0].time),
        camera: camera.then(|| CameraKey::of(&s.camera)),
        light: light.then(|| LightKey::of(&s.light)),
    };
    let mut chosen = vec![0, samples.len() - 1];
    loop {
        let path = OwnPath { between, keys: chosen.iter().map(|i| key(&samples[*i])).collect() };
        let apart = |i: usize| {
            let s = &samples[i];
            let (mut c, mut l) = (s.camera, s.light);
            path.place(&mut c, &mut l, f64::from(key(s).time));
            apart(s, &c, &l, diagonal)
        };
        let worst = |pair: &[usize]| {
            let all = (pair[0] + 1..pair[1]).map(|i| (i, apart(i)));
            all.filter(|a| a.1 > 1.0).max_by(|a, b| a.1.total_cmp(&b.1)).map(|a| a.0)
        };
        let more: Vec<usize> = chosen.windows(2).filter_map(worst).collect();
        if more.is_empty() {
            return Some(path);
        }
        chosen.extend(more);
        chosen.sort_unstable();
    }
}

/// How far camera and light are from a sample, as a multiple of what is allowed.
fn apart(s: &Sample, camera: &Camera, light: &Light, diagonal: f32) -> f32 {
    let reach = CAMERA * s.camera.position.distance(s.camera.target);
    let places = [(camera.position, s.camera.position), (camera.target, s.camera.target)];
    let fov = (camera.fov - s.camera.fov).abs() / FOV;
    let height = |c: &Camera| c.height.unwrap_or(0.0);
    let height = (height(camera) - height(&s.camera)).abs() / (CAMERA * height(&s.camera)).max(f32::MIN_POSITIVE);
    let fov = fov.max(height).max(camera.up.angle_between(s.camera.up).to_degrees() / ANGLE);
    let camera = places.map(|(a, b)| a.distance(b) / reach).into_iter().fold(0.0, f32::max);
    let turned = light.axis().angle_between(s.light.axis()).to_degrees() / ANGLE;
    let moved = match s.light {
        Light::Directional { .. } => 0.0,
        _ => light.position().distance(s.light.position()) / (LIGHT * diagonal),
    };
    camera.max(fov).max(turned).max(moved)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Quat, Vec3};

    fn sample(time: f32, position: Vec3, to_light: Vec3) -> Sample {
        let camera = Camera::new(position, position - 5.0 * Vec3::Z, 60.0, 0.1, 100.0);
        Sample { time, camera, light: Light::Directional { to_light, angular_radius: 0.0, color: Vec3::ONE } }
    }

    /// Sixty places a second.
    fn recorded(seconds: f32, place: impl Fn(f32) -> (Vec3, Vec3)) -> Vec<Sample> {
        let times = (0..=(seconds * 60.0) as usize).map(|i| super::super::to_millis(i as f32 / 60.0));
        times.map(|time| (time, place(time))).map(|(time, (p, l))| sample(time, p, l)).collect()
    }

    #[test]
    fn a_straight_way_has_two_keys() {
        // A second of rest at each end.
        let way = |time: f32| (Vec3::new(2.0, 0.0, -1.0) * (time - 1.0).clamp(0.0, 4.0), Vec3::Y);
        let path = reduce(&recorded(6.0, way), 10.0, Between::Smooth).unwrap();
        assert_eq!(path.keys.len(), 2, "{path:?}");
        assert!((path.seconds() - 4.0).abs() < 0.04 && path.keys[0].time == 0.0, "{path:?}");
        let camera = path.keys[1].camera.unwrap();
        assert!(camera.position.distance(Vec3::new(8.0, 0.0, -4.0)) < 1e-4 && path.keys[1].light.is_none());
        assert_eq!(reduce(&recorded(2.0, |_| (Vec3::ONE, Vec3::Y)), 10.0, Between::Smooth), None);
    }

    #[test]
    fn a_bent_way_keeps_close_with_few_keys() {
        let way = |time: f32| {
            let sun = Quat::from_rotation_x(0.1 * time) * Vec3::Y;
            let rest = if (3.0..5.0).contains(&time) {
                3.0
            } else if time >= 5.0 {
                time - 2.0
            } else {
                time
            };
            (Quat::from_rotation_y(0.7 * rest) * Vec3::new(0.0, 1.0, 6.0), sun)
        };
        let samples = recorded(9.0, way);
        for (between, most) in [(Between::Smooth, 60), (Between::Linear, 100)] {
            let path = reduce(&samples, 10.0, between).unwrap();
            assert!(path.keys.len() > 4 && path.keys.len() <= most, "{between:?}: {} keys", path.keys.len());
            path.check(&samples[0].light).unwrap();
            for s in &samples {
                let (mut camera, mut light) = (samples[0].camera, samples[0].light);
                path.place(&mut camera, &mut light, s.time.into());
                let off = camera.position.distance(s.camera.position);
                let turned = light.axis().angle_between(s.light.axis()).to_degrees();
                assert!(off <= 0.0101 && turned < 0.11, "{between:?} at {}: {off} m, {turned}°", s.time);
            }
        }
    }
}
