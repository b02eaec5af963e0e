//! The camera: a pinhole's perspective, or an orthographic view.

use super::settled;
use glam::{DVec3, Mat4, Vec3, Vec4};
use serde::{Deserialize, Serialize};

/// Farthest from zero that a camera or a light may stand along each axis, in metres: beyond, squared distances leave the range of
/// 32-bit floats.
pub(crate) const FARTHEST: f32 = 1e18;

/// A camera in scene space. Metres and degrees.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Camera {
    pub position: Vec3,
    /// The point that is looked at; also what the orbit camera turns around.
    pub target: Vec3,
    /// What points upwards in the picture, as far as it is at right angles to the view: the camera's roll.
    #[serde(default = "upright", skip_serializing_if = "is_upright")]
    pub up: Vec3,
    /// Vertical field of view, degrees. An orthographic camera has none, and keeps it for when it is one no more.
    #[serde(default = "usual_fov")]
    pub fov: f32,
    /// `Some`: an orthographic camera, whose picture is so many metres high at every depth.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub height: Option<f32>,
    pub near: f32,
    pub far: f32,
}

fn upright() -> Vec3 {
    Vec3::Y
}

fn usual_fov() -> f32 {
    60.0
}

fn is_upright(up: &Vec3) -> bool {
    *up == Vec3::Y
}

impl Camera {
    /// A perspective camera that stands upright.
    pub const fn new(position: Vec3, target: Vec3, fov: f32, near: f32, far: f32) -> Camera {
        Camera { position, target, up: Vec3::Y, fov, height: None, near, far }
    }

    /// The same camera at a node's place, looking along its -z, with its +y up; the target stays as far off. One that stands
    /// upright but for rounding does so.
    pub fn placed(self, node: Mat4) -> Camera {
        let position = node.w_axis.truncate();
        let forward = (-node.z_axis.truncate()).normalize_or(Vec3::NEG_Z);
        let up = node.y_axis.truncate().normalize_or(Vec3::Y);
        let upright =
            Camera { position, target: position + forward * self.target.distance(self.position), up: Vec3::Y, ..self };
        if upright.axes().1.distance(up) < 1e-4 { upright } else { Camera { up, ..upright } }
    }

    /// At places that the file of a set-up can hold, whose scene's origin is given.
    pub fn settled(self, origin: DVec3) -> Camera {
        Camera { position: settled(self.position, origin), target: settled(self.target, origin), ..self }
    }

    /// Unit vector along which the camera looks.
    pub fn forward(&self) -> Vec3 {
        (self.target - self.position).normalize_or(Vec3::NEG_Z)
    }

    /// What is up; where the camera looks along that, what points away from the viewer.
    fn upwards(&self) -> Vec3 {
        let up = self.up.normalize_or(Vec3::Y);
        match self.forward().dot(up).abs() > 0.9999 {
            true if up.y.abs() > 0.9 => Vec3::NEG_Z,
            true => Vec3::Y,
            false => up,
        }
    }

    /// Unit vectors to the right and upwards in the picture, and along the view.
    pub fn frame(&self) -> [DVec3; 3] {
        let forward = (self.target.as_dvec3() - self.position.as_dvec3()).normalize_or(DVec3::NEG_Z);
        let right = forward.cross(self.upwards().as_dvec3()).normalize();
        [right, right.cross(forward), forward]
    }

    /// Unit vectors to the right and upwards as the picture shows them.
    pub fn axes(&self) -> (Vec3, Vec3) {
        let [right, up, _] = self.frame();
        (right.as_vec3(), up.as_vec3())
    }

    /// Half the picture's height, metres: of a perspective camera at a depth of 1 m.
    pub fn half_height(&self) -> f64 {
        match self.height {
            Some(height) => height as f64 / 2.0,
            None => (self.fov as f64 / 2.0).to_radians().tan(),
        }
    }

    /// The near plane: positive behind it, as the camera looks.
    pub fn near_plane(&self) -> Vec4 {
        let forward = self.forward();
        forward.extend(-forward.dot(self.position) - self.near)
    }

    /// The depths along the camera's axis between which a box lies, metres.
    pub fn span(&self, bounds: [Vec3; 2]) -> [f32; 2] {
        let middle = (bounds[0].midpoint(bounds[1]) - self.position).dot(self.forward());
        let reach = (0.5 * (bounds[1] - bounds[0])).dot(self.forward().abs());
        [middle - reach, middle + reach]
    }

    /// Those of them between which the camera may see something of it.
    pub fn depths(&self, bounds: [Vec3; 2]) -> [f32; 2] {
        let [first, last] = self.span(bounds);
        [first.max(self.near), last.min(self.far)]
    }

    /// How high the picture is at a depth along the camera's axis, metres.
    pub fn height_at(&self, depth: f32) -> f32 {
        2.0 * self.half_height() as f32 * if self.height.is_some() { 1.0 } else { depth }
    }

    /// Scene to view space (x right, y up, looking along -z).
    pub fn view(&self) -> Mat4 {
        glam::camera::rh::view::look_to_mat4(self.position, self.forward(), self.upwards())
    }

    /// View space to clip space with reversed depth: 1 at `near`, 0 at `far`.
    pub fn projection(&self, aspect: f32) -> Mat4 {
        if self.height.is_some() {
            return self.orthographic(aspect, self.far - self.near);
        }
        glam::camera::rh::proj::directx::perspective(self.fov.to_radians(), aspect, self.far, self.near)
    }

    /// The same with room behind the far plane. A perspective has no end: depth is `near` over that along the camera's axis, and
    /// points at infinity (w = 0) have depth 0. An orthographic picture, whose depth is even, ends at `last`, metres along the
    /// axis. Positions in the picture are the same bit for bit.
    pub fn unbounded_projection(&self, aspect: f32, last: f32) -> Mat4 {
        if self.height.is_some() {
            return self.orthographic(aspect, (last - self.near).max(1e-3 * self.near));
        }
        let mut projection = self.projection(aspect);
        (projection.z_axis.z, projection.w_axis.z) = (0.0, self.near);
        projection
    }

    /// `depth`: metres from the near plane to where the depth is 0.
    fn orthographic(&self, aspect: f32, depth: f32) -> Mat4 {
        let half = self.half_height() as f32;
        let mut m = Mat4::from_diagonal(Vec3::new(1.0 / (half * aspect), 1.0 / half, 1.0 / depth).extend(1.0));
        m.w_axis.z = 1.0 + self.near / depth;
        m
    }

    /// The rays of a picture of `size` pixels, each 1 long along the camera's axis: how they change from a pixel to the next on the
    /// right and to the next below, and the ray through the upper left corner. An orthographic camera's all run along its axis:
    /// the same of where they start, relative to the camera's place.
    pub fn rays(&self, size: [u32; 2]) -> [DVec3; 3] {
        let [right, up, forward] = self.frame();
        let pixel = 2.0 * self.half_height() / size[1] as f64;
        let (x, y) = (right * pixel, -up * pixel);
        let middle = if self.height.is_some() { DVec3::ZERO } else { forward };
        [x, y, middle - x * (size[0] as f64 / 2.0) - y * (size[1] as f64 / 2.0)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rays_pass_through_the_pixels_that_the_projection_says() {
        let perspective = Camera::new(Vec3::new(1.0, 2.0, 5.0), Vec3::new(0.3, 1.0, 0.0), 50.0, 0.1, 100.0);
        let size = [64, 48];
        for (up, height) in [
            (Vec3::Y, None),
            (Vec3::new(0.5, 0.8, 0.1), None),
            (Vec3::Y, Some(3.0)),
            (Vec3::new(-0.5, 0.8, 0.1), Some(3.0)),
        ] {
            let camera = Camera { up, height, ..perspective };
            let [right, down, corner] = camera.rays(size);
            for (x, y) in [(0.0, 0.0), (64.0, 0.0), (10.5, 40.25)] {
                let ray = corner + right * x + down * y;
                for depth in [0.5, 20.0] {
                    let off = if height.is_some() { ray + camera.frame()[2] * depth } else { ray * depth };
                    let p = camera.position.as_dvec3() + off;
                    for projection in [camera.projection(4.0 / 3.0), camera.unbounded_projection(4.0 / 3.0, 300.0)] {
                        let clip: Vec4 = projection * camera.view() * p.as_vec3().extend(1.0);
                        let found = [(0.5 + 0.5 * clip.x / clip.w) * 64.0, (0.5 - 0.5 * clip.y / clip.w) * 48.0];
                        assert!(
                            (found[0] - x as f32).abs() < 1e-3 && (found[1] - y as f32).abs() < 1e-3,
                            "{found:?} for {x}, {y}"
                        );
                        assert!(clip.z > 0.0 && clip.z < clip.w);
                    }
                }
            }
        }
    }

    #[test]
    fn depth_runs_from_the_near_plane_to_the_far_one() {
        let camera = Camera { height: Some(2.0), ..Camera::new(Vec3::ZERO, Vec3::NEG_Z, 50.0, 0.5, 8.5) };
        let depth = |z: f32, projection: Mat4| (projection * Vec4::new(0.0, 0.0, -z, 1.0)).z;
        for (z, d) in [(0.5, 1.0), (8.5, 0.0), (4.5, 0.5)] {
            assert!((depth(z, camera.projection(1.0)) - d).abs() < 1e-6);
        }
        assert!(depth(16.5, camera.unbounded_projection(1.0, 16.5)).abs() < 1e-6);
    }

    #[test]
    fn up_is_up_and_one_that_is_seen_along_itself_is_replaced() {
        let camera = |up| Camera { up, ..Camera::new(Vec3::new(0.0, 0.0, 5.0), Vec3::ZERO, 50.0, 0.1, 10.0) };
        let tilted = camera(Vec3::new(1.0, 1.0, 0.0)).axes();
        assert!((tilted.1 - Vec3::new(1.0, 1.0, 0.0).normalize()).length() < 1e-6);
        for up in [Vec3::Z, Vec3::NEG_Z, Vec3::ZERO] {
            let (right, up) = camera(up).axes();
            assert!(right.is_normalized() && up.is_normalized() && right.dot(up).abs() < 1e-6);
        }
    }
}
