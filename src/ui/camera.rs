//! Moving the camera: orbit, look, pan, dolly, fly. Near and far stay as they are.

use crate::scene::Camera;
use glam::{Quat, Vec3};

/// Steepest look up or down, as the cosine's complement: just short of the pole.
const POLE: f32 = 0.9995;

impl Camera {
    /// Unit vectors to the right and upwards as the picture shows them.
    pub fn axes(&self) -> (Vec3, Vec3) {
        let forward = self.forward();
        let up = if forward.y.abs() > 0.9999 { Vec3::NEG_Z } else { Vec3::Y };
        let right = forward.cross(up).normalize();
        (right, right.cross(forward))
    }

    /// Distance from the target, metres.
    pub fn reach(&self) -> f32 {
        self.position.distance(self.target)
    }

    /// Metres that a step of one point covers at a depth, where the picture is `height` points high.
    pub fn metres_per_point(&self, depth: f32, height: f32) -> f32 {
        2.0 * depth * (self.fov.to_radians() / 2.0).tan() / height
    }

    /// Turns around the target by angles in radians, to the right and upwards.
    pub fn orbit(&mut self, yaw: f32, pitch: f32) {
        let back = turned(-self.forward(), -yaw, pitch);
        self.position = self.target + back * self.reach();
    }

    /// Turns in place by angles in radians, to the right and upwards.
    pub fn look(&mut self, yaw: f32, pitch: f32) {
        let forward = turned(self.forward(), -yaw, pitch);
        self.target = self.position + forward * self.reach();
    }

    /// Moves without turning, metres.
    pub fn shift(&mut self, by: Vec3) {
        self.position += by;
        self.target += by;
    }

    /// Multiplies the distance from the target.
    pub fn dolly(&mut self, factor: f32) {
        let reach = (self.reach() * factor).clamp(self.near * 2.0, self.far * 4.0);
        self.position = self.target - self.forward() * reach;
    }
}

/// A direction turned about the vertical and then up, short of the poles.
fn turned(direction: Vec3, yaw: f32, pitch: f32) -> Vec3 {
    let flat = Quat::from_rotation_y(yaw) * direction;
    let side = flat.cross(Vec3::Y).normalize_or(Vec3::X);
    let tilted = Quat::from_axis_angle(side, pitch) * flat;
    let over = tilted.cross(Vec3::Y).dot(side) <= 0.0;
    if tilted.y.abs() > POLE || over { flat } else { tilted.normalize() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> Camera {
        Camera {
            position: Vec3::new(1.0, 2.0, 5.0),
            target: Vec3::new(0.0, 1.0, 0.0),
            fov: 50.0,
            near: 0.1,
            far: 100.0,
        }
    }

    #[test]
    fn orbit_keeps_target_and_distance() {
        let mut c = camera();
        for _ in 0..200 {
            c.orbit(0.1, 0.05);
        }
        assert_eq!(c.target, camera().target);
        assert!((c.reach() - camera().reach()).abs() < 1e-3);
        assert!(c.forward().y.abs() <= POLE && c.position.is_finite());
    }

    #[test]
    fn look_keeps_place_and_dolly_stays_outside_the_target() {
        let mut c = camera();
        c.look(0.3, -0.2);
        assert_eq!(c.position, camera().position);
        for _ in 0..500 {
            c.dolly(0.5);
        }
        assert!(c.reach() >= c.near && c.position != c.target);
    }
}
