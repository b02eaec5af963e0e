//! Fits that run on the CPU, in f64: where the receivers lie in the light's image, and how that image is warped.
//!
//! A projective warp of a shadow map is a homography of the light's image: points on one ray of the light stay together,
//! whatever the warp. So each fit here is a 3 × 3 matrix over that image, and depth stays linear along the light's axis.

pub mod casting;
pub mod crop;
pub mod diagram;
pub mod faces;
pub mod film;
pub mod hull;
pub mod lispsm;
pub mod lixel;
pub mod logpsm;
pub mod msf;
pub mod part;
pub mod psm;
pub mod quickhull;
pub mod sides;
pub mod tsm;

use crate::frame::Frame;
use crate::light::{Light, LightView, WIDEST};
use crate::params::Values;
use crate::scene::Camera;
use bytemuck::Zeroable;
use glam::{DMat3, DVec2, DVec3, DVec4, Vec3, Vec4};
use hull::Polyhedron;

/// The light's image: unwarped, in metres across the rays of the sun; a spot light's at a depth of 1 m.
#[derive(Clone, Copy, Debug)]
pub struct LightImage {
    /// Rows from (X, 1) in world space to the homogeneous image (a, b, w).
    pub rows: [DVec4; 3],
    /// Row from (X, 1) to the linear depth along the light's axis, metres.
    pub depth: DVec4,
}

impl LightImage {
    /// The image of a spot light at `from`, or of the sun (None), that looks along the unit vector `axis`.
    pub fn new(axis: DVec3, from: Option<DVec3>) -> LightImage {
        let up = if axis.y.abs() > 0.9999 { DVec3::NEG_Z } else { DVec3::Y };
        LightImage::turned(axis, axis.cross(up).normalize(), from)
    }

    /// The same with the unit vector `right`, at right angles to `axis`, to its right.
    fn turned(axis: DVec3, right: DVec3, from: Option<DVec3>) -> LightImage {
        let up = right.cross(axis);
        let row = |v: DVec3| v.extend(-v.dot(from.unwrap_or(DVec3::ZERO)));
        let w = if from.is_some() { row(axis) } else { DVec4::W };
        LightImage { rows: [row(right), row(up), w], depth: row(axis) }
    }

    /// Where a point in world space appears.
    pub fn at(&self, p: DVec3) -> DVec2 {
        let [a, b, w] = self.rows.map(|r| r.dot(p.extend(1.0)));
        DVec2::new(a, b) / w
    }

    /// What a step in that direction adds to the image at a constant depth along the axis: under the sun, or a spot light's at 1 m.
    pub fn along(&self, d: DVec3) -> DVec2 {
        DVec2::new(self.rows[0].truncate().dot(d), self.rows[1].truncate().dot(d))
    }
}

/// What a homography makes of a point of the plane; the second value is its w, positive where the warp can see it.
pub fn warped(h: &DMat3, p: DVec2) -> (DVec2, f64) {
    let q = *h * p.extend(1.0);
    (q.truncate() / q.z, q.z)
}

/// Says of a fit that follows the camera's perspective that an orthographic one has none.
pub fn tell_even(f: &mut Frame) {
    if f.camera.height.is_some() {
        f.tell_note(
            "An orthographic camera has no perspective for a map to follow: this one is a plain map of what is seen."
                .into(),
        );
    }
}

/// A frame as the fits see it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scope {
    pub camera: Camera,
    pub light: Light,
    /// The scene's bounds.
    pub bounds: [Vec3; 2],
    /// Width over height of the picture.
    pub aspect: f32,
    /// Side of the map, texels.
    pub resolution: u32,
    /// Texels left free at each border.
    pub margin: f32,
}

/// A camera's frame in f64.
#[derive(Clone, Copy, Debug)]
pub struct Eye {
    pub position: DVec3,
    pub forward: DVec3,
    pub right: DVec3,
    pub up: DVec3,
    /// Tangents of half the horizontal and half the vertical field of view; of an orthographic camera half its width and height,
    /// metres.
    pub tangent: DVec2,
    pub orthographic: bool,
    pub near: f64,
    /// The camera's far plane, or the scene's farthest corner if that is nearer.
    pub far: f64,
}

impl Eye {
    /// Depth along the view's axis, metres.
    pub fn depth(&self, p: DVec3) -> f64 {
        self.forward.dot(p - self.position)
    }

    /// The frustum's corners: four of the near, then four of the far face, each in order around it.
    pub fn corners(&self) -> [DVec3; 8] {
        let corner = |i: usize| {
            let z = if i < 4 { self.near } else { self.far };
            let side = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)][i % 4];
            let (from, way) = self.ray(side.into());
            from + way * z
        };
        [0, 1, 2, 3, 4, 5, 6, 7].map(corner)
    }

    /// The frustum's planes, positive inside: near and far first.
    pub fn planes(&self) -> [DVec4; 6] {
        let plane = |n: DVec3, d: f64| n.extend(-n.dot(self.position) - d);
        let ends = [plane(self.forward, self.near), plane(-self.forward, -self.far)];
        let side = |along: DVec3, tangent: f64| match self.orthographic {
            true => plane(along, -tangent),
            false => plane(self.forward * tangent + along, 0.0),
        };
        let [x, y] = self.tangent.to_array();
        let sides = [side(self.right, x), side(-self.right, x), side(self.up, y), side(-self.up, y)];
        [ends[0], ends[1], sides[0], sides[1], sides[2], sides[3]]
    }

    /// The ray through a place of the picture, from -1 to 1 to the right and upwards: where it starts, and its direction, 1 long
    /// along the view.
    pub fn ray(&self, at: DVec2) -> (DVec3, DVec3) {
        let aside = self.right * (at.x * self.tangent.x) + self.up * (at.y * self.tangent.y);
        if self.orthographic { (self.position + aside, self.forward) } else { (self.position, self.forward + aside) }
    }

    /// How many times as large as at 1 m what the picture shows at a depth is.
    pub fn scale(&self, depth: f64) -> f64 {
        if self.orthographic { 1.0 } else { depth }
    }
}

impl Scope {
    /// What `f` renders, with a map of that resolution and margin.
    pub fn of(f: &Frame, resolution: u32, margin: f32) -> Scope {
        let [w, h] = f.size;
        let (camera, light, bounds) = (f.camera, f.light, f.scene.bounds);
        Scope { camera, light, bounds, aspect: w as f32 / h as f32, resolution, margin }
    }

    /// The scene's box.
    pub fn cuboid(&self) -> Polyhedron {
        Polyhedron::cuboid(self.bounds[0].as_dvec3(), self.bounds[1].as_dvec3())
    }

    /// Lengths below it count as zero, metres.
    pub fn eps(&self) -> f64 {
        1e-9 * (self.bounds[1] - self.bounds[0]).length().max(1e-3) as f64
    }

    pub fn eye(&self) -> Eye {
        let [right, up, forward] = self.camera.frame();
        let tangent = self.camera.half_height();
        let mut eye = Eye {
            position: self.camera.position.as_dvec3(),
            forward,
            right,
            up,
            orthographic: self.camera.height.is_some(),
            tangent: DVec2::new(tangent * self.aspect as f64, tangent),
            near: self.camera.near as f64,
            far: self.camera.far as f64,
        };
        let farthest = self.cuboid().corners().into_iter().map(|p| eye.depth(p)).fold(0.0, f64::max);
        eye.far = eye.far.min(farthest * 1.0001).max(eye.near * 1.0001);
        eye
    }

    /// The corners of what the camera can see of the scene: its frustum cut out of the scene's box, and of what a spot light
    /// can reach. Empty if it sees nothing.
    pub fn seen(&self) -> Vec<DVec3> {
        self.seen_of(self.cuboid()).corners()
    }

    /// The part of a body that the camera can see and the light can reach.
    pub fn seen_of(&self, mut body: Polyhedron) -> Polyhedron {
        let eye = self.eye();
        eye.planes().into_iter().chain(self.reach()).for_each(|plane| body.clip(plane, self.eps()));
        body
    }

    /// The corners of what the light can reach of the scene's box.
    pub fn lit(&self) -> Vec<DVec3> {
        let mut body = self.cuboid();
        self.reach().into_iter().for_each(|plane| body.clip(plane, self.eps()));
        body.corners()
    }

    /// The corners of the camera's frustum from depth `near` to `far`, metres, cut to what a spot light can reach.
    pub fn slice(&self, near: f64, far: f64) -> Vec<DVec3> {
        let mut body = Polyhedron::frustum(&Eye { near, far, ..self.eye() }.corners());
        self.reach().into_iter().for_each(|plane| body.clip(plane, self.eps()));
        body.corners()
    }

    /// Planes around what a spot light can reach, positive inside: the eight-sided pyramid around its cone, cut off beyond its
    /// range or the scene's farthest corner. Of a rectangle the four-sided one of its widest view. What is left lies before the light and so has a place in its image. The cone's
    /// tip, a thousandth of that reach, is cut off too: maps begin behind it, and as the tip comes into view all rays would
    /// do so at once. None for the sun.
    pub fn reach(&self) -> Vec<DVec4> {
        let (tangent, eighths) = match self.light {
            Light::Spot { outer_angle, .. } => ((outer_angle as f64).to_radians().tan(), 1),
            Light::RectArea { .. } => ((WIDEST as f64).to_radians().tan(), 2),
            _ => return Vec::new(),
        };
        let image = self.image();
        let side = |k: usize| {
            let (sin, cos) = (k as f64 * std::f64::consts::FRAC_PI_4).sin_cos();
            image.depth * tangent - image.rows[0] * cos - image.rows[1] * sin
        };
        let reach = self.deepest(&image, &self.cuboid().corners()).min(self.light.range() as f64).max(0.0);
        let ends = [image.depth - DVec4::W * (1e-3 * reach).max(1e3 * self.eps()), DVec4::W * reach - image.depth];
        (0..8).step_by(eighths).map(side).chain(ends).collect()
    }

    /// The light's image: the sun's, or that of a spot or area light along its axis.
    pub fn image(&self) -> LightImage {
        let axis = self.light.axis().as_dvec3().normalize();
        let from = self.light.view_tangent().map(|_| self.light.position().as_dvec3());
        match self.light {
            Light::RectArea { half_u, .. } => {
                // In f64 `axis` is at right angles to it only nearly.
                let along = half_u.as_dvec3();
                LightImage::turned(
                    axis,
                    (along - axis * axis.dot(along)).normalize_or(axis.any_orthonormal_vector()),
                    from,
                )
            }
            _ => LightImage::new(axis, from),
        }
    }

    /// The light's view through the homography `h` of its image, fitted to the box around `points` of that image, which
    /// all have a positive w under it. `deepest`: the last receiver's depth along the axis, metres.
    ///
    /// None for lights without a single view, and where the box has no finite size.
    pub fn view(&self, image: &LightImage, h: &DMat3, points: &[DVec2], deepest: f64) -> Option<LightView> {
        self.view_between(image, h, points, None, deepest)
    }

    /// As [`Scope::view`]; `nearest`: the first caster's depth along the image's axis, metres, where it is known better than
    /// by the scene's box.
    pub fn view_between(
        &self,
        image: &LightImage,
        h: &DMat3,
        points: &[DVec2],
        nearest: Option<f64>,
        deepest: f64,
    ) -> Option<LightView> {
        let [low, high] = hull::extent(points.iter().map(|p| warped(h, *p).0));
        let size = (high - low).max(DVec2::splat(1e-12 * (low.abs() + high.abs()).max_element()));
        if !(low.is_finite() && high.is_finite() && size.min_element() > 0.0) {
            return None;
        }
        let r = self.resolution as f64;
        // The box's share of the map, less the margin.
        let mut scale = 2.0 * (1.0 - 2.0 * self.margin as f64 / r).max(0.1) / size;
        // A warp that mirrors the image would turn front faces into back faces.
        scale.x *= h.determinant().signum();
        let middle = (low + high) / 2.0;
        let fitted = DMat3::from_cols(
            DVec3::new(scale.x, 0.0, 0.0),
            DVec3::new(0.0, scale.y, 0.0),
            DVec3::new(-scale.x * middle.x, -scale.y * middle.y, 1.0),
        ) * *h;
        self.view_through(image, &fitted, nearest, deepest)
    }

    /// The light's view through a homography from its image to the very map, x and y from -1 to 1. `nearest` and `deepest` as in
    /// [`Scope::view_between`].
    pub fn view_through(
        &self,
        image: &LightImage,
        fitted: &DMat3,
        nearest: Option<f64>,
        deepest: f64,
    ) -> Option<LightView> {
        let whole = LightView::whole(&self.light, self.bounds, self.resolution, self.margin)?;
        let r = self.resolution as f64;
        let row = |i: usize| -> Vec4 {
            let r = fitted.row(i);
            (image.rows[0] * r.x + image.rows[1] * r.y + image.rows[2] * r.z).as_vec4()
        };
        let affine = fitted.row(2).x == 0.0 && fitted.row(2).y == 0.0;
        let (lamp, mut near) = (self.light.view_tangent().is_some(), whole.near);
        let mut axis = image.depth.as_vec4();
        if lamp {
            let corners = self.cuboid().corners();
            let nearest = nearest.unwrap_or_else(|| self.nearest(image, &corners));
            near = ((nearest * 0.999) as f32).clamp(deepest as f32 * 1e-3, deepest as f32 * 0.9);
        } else {
            // The whole view's depth starts at the scene's first corner.
            axis.w = whole.axis.w;
            if let Some(nearest) = nearest {
                // A thousandth to spare, as there.
                near = ((nearest - 1e-3 * (deepest - nearest)) as f32 + axis.w).max(near);
            }
        }
        let last = deepest as f32 + axis.w - image.depth.w as f32;
        let far = (last + (last - near).abs() * 1e-4 + 1e-5).max(near * 1.0001 + 1e-6);
        let perspective = if !affine { LightView::WARPED } else { lamp as u32 };
        let gain = if lamp { near } else { 1.0 };
        Some(LightView {
            row_x: row(0),
            row_y: row(1),
            row_z: (Vec4::W * far - axis) * (gain / (far - near)),
            row_w: row(2),
            axis,
            near,
            far,
            perspective,
            texel: (2.0 / (r * fitted.row(0).truncate().length().min(fitted.row(1).truncate().length()))) as f32,
            resolution: self.resolution as f32,
            margin: self.margin,
            ..LightView::zeroed()
        })
    }

    /// Depth of the nearest of some points along the image's axis, metres.
    pub fn nearest(&self, image: &LightImage, points: &[DVec3]) -> f64 {
        points.iter().map(|p| image.depth.dot(p.extend(1.0))).fold(f64::INFINITY, f64::min)
    }

    /// Depth of the deepest of some points along the image's axis, metres.
    pub fn deepest(&self, image: &LightImage, points: &[DVec3]) -> f64 {
        points.iter().map(|p| image.depth.dot(p.extend(1.0))).fold(f64::NEG_INFINITY, f64::max)
    }
}

/// A fit, kept until something that it depends on changes.
pub struct Kept<T>(Option<(Scope, Values, u64, T)>);

impl<T> Default for Kept<T> {
    fn default() -> Self {
        Kept(None)
    }
}

impl<T> Kept<T> {
    /// `scope`: as fits see the frame.
    pub fn get(&mut self, f: &Frame, scope: Scope, make: impl FnOnce(&Scope) -> T) -> &T {
        let same = |(s, v, r, _): &(Scope, Values, u64, T)| *s == scope && v == f.values && *r == f.revision;
        let held = self.0.take().filter(same).map(|h| h.3);
        let made = held.unwrap_or_else(|| make(&scope));
        &self.0.insert((scope, f.values.clone(), f.revision, made)).3
    }
}
