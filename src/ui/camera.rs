//! Moving the camera: orbit, look, pan, dolly, fly. Near and far stay as they are.

use crate::scene::Camera;
use glam::{Quat, Vec3};

/// Steepest look up or down, as the cosine's complement: just short of the pole.
const POLE: f32 = 0.9995;

impl Camera {
    /// Distance from the target, metres.
    pub fn reach(&self) -> f32 {
        self.position.distance(self.target)
    }

    /// Metres that a step of one point covers at a depth, where the picture is `height` points high.
    pub fn metres_per_point(&self, depth: f32, height: f32) -> f32 {
        self.height_at(depth) / height
    }

    /// How far the camera is turned clockwise from upright, radians.
    pub fn roll(&self) -> f32 {
        let (right, up) = Camera { up: Vec3::Y, ..*self }.axes();
        let own = self.axes().1;
        own.dot(right).atan2(own.dot(up))
    }

    /// Turns the camera clockwise from upright by an angle in radians.
    pub fn set_roll(&mut self, roll: f32) {
        self.up = Vec3::Y;
        if roll != 0.0 {
            let (right, up) = self.axes();
            self.up = up * roll.cos() + right * roll.sin();
        }
    }

    /// Turns around the target by angles in radians, to the right and upwards. The roll stays.
    pub fn orbit(&mut self, yaw: f32, pitch: f32) {
        let back = turned(-self.forward(), -yaw, pitch);
        self.keeping_roll(|c| c.position = c.target + back * c.reach());
    }

    /// Turns in place by angles in radians, to the right and upwards. The roll stays.
    pub fn look(&mut self, yaw: f32, pitch: f32) {
        let forward = turned(self.forward(), -yaw, pitch);
        self.keeping_roll(|c| c.target = c.position + forward * c.reach());
    }

    fn keeping_roll(&mut self, turn: impl FnOnce(&mut Camera)) {
        let roll = if self.up == Vec3::Y { 0.0 } else { self.roll() };
        turn(self);
        self.set_roll(roll);
    }

    /// Moves without turning, metres.
    pub fn shift(&mut self, by: Vec3) {
        self.position += by;
        self.target += by;
    }

    /// Multiplies the distance from the target, or an orthographic picture's height.
    pub fn dolly(&mut self, factor: f32) {
        if let Some(height) = &mut self.height {
            *height = (*height * factor).clamp(1e-5, 1e8);
            return;
        }
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
        Camera::new(Vec3::new(1.0, 2.0, 5.0), Vec3::new(0.0, 1.0, 0.0), 50.0, 0.1, 100.0)
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
    fn turns_keep_the_roll() {
        let mut c = camera();
        c.set_roll(0.5);
        assert!((c.roll() - 0.5).abs() < 1e-5 && c.axes().1.y > 0.0);
        c.orbit(0.7, 0.2);
        c.look(-0.3, 0.1);
        assert!((c.roll() - 0.5).abs() < 1e-4, "{}", c.roll());
        c.set_roll(0.0);
        assert_eq!(c.up, Vec3::Y);
    }

    #[test]
    fn an_orthographic_camera_zooms_where_it_stands() {
        let mut c = Camera { height: Some(4.0), ..camera() };
        c.dolly(0.5);
        assert_eq!((c.height, c.position), (Some(2.0), camera().position));
        assert_eq!(c.metres_per_point(1.0, 100.0), c.metres_per_point(50.0, 100.0));
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
