//! Light kinds: what a set-up stores and what the frame needs of them.

use crate::scene::{Camera, settled};
use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Mat4, Vec3, Vec4};
use serde::{Deserialize, Serialize};

/// One light. Positions in metres (scene space), angles in degrees, colours linear RGB.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Light {
    /// Parallel rays, like the sun.
    Directional {
        /// Vector towards the light (any length but zero).
        to_light: Vec3,
        /// Half the angle that its disc takes in the sky, degrees; the sun's is 0.27.
        #[serde(default, skip_serializing_if = "is_zero")]
        angular_radius: f32,
        /// Irradiance on a surface that faces the light, relative to white.
        #[serde(default = "white")]
        color: Vec3,
    },
    /// A cone of light from a point.
    Spot {
        position: Vec3,
        /// Direction in which the light travels along the cone's axis.
        direction: Vec3,
        /// Angle between the axis and the cone's edge, degrees, below 89.
        outer_angle: f32,
        /// Distance in metres beyond which the light no longer reaches.
        range: f32,
        /// Of the disc that shines, metres. It faces every point that it lights.
        #[serde(default, skip_serializing_if = "is_zero")]
        radius: f32,
        /// Intensity per steradian: irradiance is `color / distance²`.
        #[serde(default = "white")]
        color: Vec3,
    },
    /// A point that shines in all directions.
    Omni {
        position: Vec3,
        range: f32,
        /// As a spot's.
        #[serde(default, skip_serializing_if = "is_zero")]
        radius: f32,
        #[serde(default = "white")]
        color: Vec3,
    },
    /// A point that shines into the half space around `direction`.
    Hemisphere {
        position: Vec3,
        direction: Vec3,
        range: f32,
        #[serde(default = "white")]
        color: Vec3,
    },
    /// A rectangle that shines from its front, the side of `half_u × half_v`.
    RectArea {
        center: Vec3,
        /// Half the rectangle's width as a vector, metres.
        half_u: Vec3,
        /// Half the rectangle's height as a vector, metres.
        half_v: Vec3,
        range: f32,
        #[serde(default = "white")]
        color: Vec3,
    },
}

fn white() -> Vec3 {
    Vec3::ONE
}

/// Lights without a size are written as they were before lights had one.
fn is_zero(size: &f32) -> bool {
    *size == 0.0
}

/// Largest `radius`, metres, and largest `angular_radius`, degrees.
pub const MAX_RADIUS: f32 = 10.0;

/// Angle from a rectangle's axis, degrees, beyond which no single view sees.
pub const WIDEST: f32 = 80.0;

/// The light kinds' names, in the shaders' order.
pub const KINDS: [&str; 5] = ["directional", "spot", "omni", "hemisphere", "rect-area"];

impl Light {
    /// Its place in [`KINDS`].
    pub fn index(&self) -> usize {
        match self {
            Light::Directional { .. } => 0,
            Light::Spot { .. } => 1,
            Light::Omni { .. } => 2,
            Light::Hemisphere { .. } => 3,
            Light::RectArea { .. } => 4,
        }
    }

    /// The kind's name as set-ups write it.
    pub fn kind(&self) -> &'static str {
        KINDS[self.index()]
    }

    /// Position in scene space, or the unit vector towards a directional light.
    pub fn position(&self) -> Vec3 {
        match *self {
            Light::Directional { to_light, .. } => to_light.normalize_or(Vec3::Y),
            Light::Spot { position, .. } | Light::Omni { position, .. } | Light::Hemisphere { position, .. } => {
                position
            }
            Light::RectArea { center, .. } => center,
        }
    }

    /// The same light at a node's place, shining along its -z, as lights of files do.
    pub fn placed(mut self, node: Mat4) -> Light {
        let (place, backward) = (node.w_axis.truncate(), node.z_axis.truncate().normalize_or(Vec3::Z));
        match &mut self {
            Light::Directional { to_light, .. } => *to_light = backward,
            Light::Spot { position, direction, .. } => (*position, *direction) = (place, -backward),
            Light::Omni { position, .. } => *position = place,
            // No file has one.
            Light::Hemisphere { .. } | Light::RectArea { .. } => {}
        }
        self
    }

    /// At a place that the file of a set-up can hold, whose scene's origin is given.
    pub fn settled(mut self, origin: DVec3) -> Light {
        if let Some(place) = self.place_mut() {
            *place = settled(*place, origin);
        }
        self
    }

    /// Where it stands, if it stands somewhere.
    pub fn place_mut(&mut self) -> Option<&mut Vec3> {
        match self {
            Light::Directional { .. } => None,
            Light::Spot { position, .. } | Light::Omni { position, .. } | Light::Hemisphere { position, .. } => {
                Some(position)
            }
            Light::RectArea { center, .. } => Some(center),
        }
    }

    /// Unit vector along which the light shines; an omni light's is downwards.
    pub fn axis(&self) -> Vec3 {
        match *self {
            Light::Directional { to_light, .. } => -to_light.normalize_or(Vec3::Y),
            Light::Spot { direction, .. } | Light::Hemisphere { direction, .. } => direction.normalize_or(Vec3::NEG_Y),
            Light::Omni { .. } => Vec3::NEG_Y,
            Light::RectArea { half_u, half_v, .. } => half_u.cross(half_v).normalize_or(Vec3::NEG_Y),
        }
    }

    /// Another camera's place taken to look along the light: a lamp's from where it stands, with its angle; the sun's from
    /// far outside the scene's bounds, with a narrow one.
    pub fn camera(&self, bounds: [Vec3; 2], camera: Camera) -> Camera {
        let center = (bounds[0] + bounds[1]) / 2.0;
        let radius = ((bounds[1] - bounds[0]).length() / 2.0).max(1e-3);
        let (position, axis) = (self.position(), self.axis());
        let (position, target, fov) = match *self {
            Light::Directional { .. } => (center - axis * (radius / 5f32.to_radians().sin()), center, 10.0),
            Light::Omni { .. } if center != position => (position, center, 90.0),
            _ => {
                let fov = if let Light::Spot { outer_angle, .. } = *self { 2.0 * outer_angle } else { 90.0 };
                (position, position + axis * axis.dot(center - position).max(0.1 * radius), fov.clamp(5.0, 120.0))
            }
        };
        let far = camera.far.max((center - position).length() + radius);
        Camera::new(position, target, fov, camera.near, far)
    }

    /// Its colour, to be changed.
    pub fn color_mut(&mut self) -> &mut Vec3 {
        match self {
            Light::Directional { color, .. }
            | Light::Spot { color, .. }
            | Light::Omni { color, .. }
            | Light::Hemisphere { color, .. }
            | Light::RectArea { color, .. } => color,
        }
    }

    pub fn color(&self) -> Vec3 {
        match *self {
            Light::Directional { color, .. }
            | Light::Spot { color, .. }
            | Light::Omni { color, .. }
            | Light::Hemisphere { color, .. }
            | Light::RectArea { color, .. } => color,
        }
    }

    /// Tangent of the angle from the axis up to which a single perspective view from its place sees: a spot's cone, and of the half
    /// space before a rectangle's centre what lies within [`WIDEST`]. None of lights without such a view.
    pub fn view_tangent(&self) -> Option<f32> {
        match *self {
            Light::Spot { outer_angle, .. } => Some(outer_angle.to_radians().tan()),
            Light::RectArea { .. } => Some(WIDEST.to_radians().tan()),
            _ => None,
        }
    }

    /// Unit vector to the right in its view: along the width of a rectangle, else level.
    pub fn view_right(&self) -> Vec3 {
        let axis = self.axis();
        let up = if axis.y.abs() > 0.9999 { Vec3::NEG_Z } else { Vec3::Y };
        match *self {
            Light::RectArea { half_u, .. } => half_u.normalize_or(Vec3::X),
            _ => axis.cross(up).normalize(),
        }
    }

    /// Whether it is more than a point, so that shadows have penumbras.
    pub fn has_size(&self) -> bool {
        self.radius() > 0.0 || matches!(self, Light::RectArea { .. })
    }

    /// Radius of the disc that shines, metres; a directional light's at a distance of 1. 0 for the other kinds.
    pub fn radius(&self) -> f32 {
        match *self {
            Light::Directional { angular_radius, .. } => angular_radius.to_radians().tan(),
            Light::Spot { radius, .. } | Light::Omni { radius, .. } => radius,
            Light::Hemisphere { .. } | Light::RectArea { .. } => 0.0,
        }
    }

    /// Distance beyond which it no longer reaches, metres; infinite for a directional light.
    pub fn range(&self) -> f32 {
        match *self {
            Light::Directional { .. } => f32::INFINITY,
            Light::Spot { range, .. }
            | Light::Omni { range, .. }
            | Light::Hemisphere { range, .. }
            | Light::RectArea { range, .. } => range,
        }
    }
}

/// A light's view, as `LightView` in `shaders/map/light_view.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct LightView {
    pub row_x: Vec4,
    pub row_y: Vec4,
    pub row_z: Vec4,
    pub row_w: Vec4,
    pub axis: Vec4,
    pub near: f32,
    pub far: f32,
    pub perspective: u32,
    pub texel: f32,
    pub resolution: f32,
    pub margin: f32,
    /// Metres that a fit leaves free at each border, on top of `margin`.
    pub reach: f32,
    /// Of a paraboloid's: cosine of the farthest angle from the axis in `row_w` that the map holds.
    pub ahead: f32,
    /// Its number among the layers that have a warp each.
    pub layer: u32,
    /// 1: no pixel looks it up, and nothing of it is made.
    pub idle: u32,
    pub padding: [u32; 2],
}

impl LightView {
    /// `perspective` of a view whose image is warped: its depth is linear and drawn by fragments.
    pub const WARPED: u32 = 2;
    /// Of a paraboloid's: its depth is the distance from the light.
    pub const PARABOLOID: u32 = 3;

    /// Linear depth in metres along the axis of a stored depth, as `linear_depth` in WGSL.
    pub fn linear_depth(&self, d: f32) -> f32 {
        if self.perspective == 1 {
            self.near * self.far / (self.near + d * (self.far - self.near))
        } else {
            self.far - d * (self.far - self.near)
        }
    }

    /// The view of a directional, spot or area light that sees the whole scene: the box around the scene's
    /// bounds, the cone, or the square pyramid before a rectangle's centre, whose sides run along the rectangle's.
    /// `margin` texels stay free when a fit narrows it.
    ///
    /// Other kinds have no single view: None.
    pub fn whole(light: &Light, bounds: [Vec3; 2], resolution: u32, margin: f32) -> Option<LightView> {
        let (axis, right) = (light.axis(), light.view_right());
        let up = right.cross(axis);
        let r = resolution as f32;
        let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for i in 0..8 {
            let corner = Vec3::from_array([0, 1, 2].map(|a| bounds[i >> a & 1][a]));
            let p = Vec3::new(right.dot(corner), up.dot(corner), axis.dot(corner));
            low = low.min(p);
            high = high.max(p);
        }
        let mut view = LightView { resolution: r, margin, ..LightView::zeroed() };
        match *light {
            Light::Directional { .. } => {
                let size = (high - low).max(Vec3::splat(1e-4));
                let mid = (low + high) / 2.0;
                view.row_x = (right * 2.0 / size.x).extend(-2.0 * mid.x / size.x);
                view.row_y = (up * 2.0 / size.y).extend(-2.0 * mid.y / size.y);
                view.row_w = Vec4::W;
                // A thousandth to spare, so that nothing lies on the near plane.
                view.near = 0.0;
                view.far = size.z * 1.002;
                view.axis = axis.extend(size.z * 0.001 - low.z);
                view.row_z = (Vec4::W * view.far - view.axis) / view.far;
                view.texel = size.x.max(size.y) / r;
            }
            Light::Spot { range, .. } | Light::RectArea { range, .. } => {
                let (position, tangent) = (light.position(), light.view_tangent()?);
                let row = |v: Vec3, scale: f32| (v / scale).extend(-v.dot(position) / scale);
                view.row_x = row(right, tangent);
                view.row_y = row(up, tangent);
                view.axis = row(axis, 1.0);
                view.row_w = view.axis;
                // No receiver is farther than the scene's farthest corner. Casters nearer than `near` are clamped to it.
                let farthest = high.z - axis.dot(position);
                view.far = range.min(farthest.max(1e-3 * (high - low).length())).max(1e-6);
                view.near = ((low.z - axis.dot(position)) * 0.999).clamp(view.far * 1e-3, view.far * 0.9);
                view.row_z = (Vec4::W * view.far - view.axis) * (view.near / (view.far - view.near));
                view.perspective = 1;
                view.texel = 2.0 * tangent / r;
            }
            _ => return None,
        }
        Some(view)
    }
}
