//! Views of lights that shine in all directions: the faces of a cube, a tetrahedron or an octahedron, and the sides of a
//! paraboloid.
//!
//! A face's map goes beyond the face by a guard band, so that a filter's taps stay in one map. Directions belong to the face
//! whose axis lies nearest.

use super::hull::Polyhedron;
use crate::light::LightView;
use bytemuck::Zeroable;
use glam::{DMat3, DVec3, DVec4, Vec4};
use std::f64::consts::{FRAC_PI_2, PI};

/// A face, and where its map lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Face {
    pub view: LightView,
    /// Of all faces the one whose axis lies nearest to a direction holds it.
    pub axis: DVec3,
    /// The layer of the texture that its map is in.
    pub layer: u32,
    /// Half planes of the layer that it draws into, as `region` in `shaders/map/casters.wgsl`; zero: all of it.
    pub region: [Vec4; 2],
}

impl Face {
    /// The part of a body that this of all faces holds, and what lies no more metres than `apart` beside it. `eps`: metres that
    /// count as nothing.
    pub fn part_of(&self, body: &Polyhedron, faces: &[Face], around: &Around, (apart, eps): (f64, f64)) -> Polyhedron {
        let mut body = body.clone();
        for other in faces {
            let normal = self.axis - other.axis;
            if normal.length_squared() > 0.0 {
                body.clip(normal.extend(apart * normal.length() - normal.dot(around.light)), eps);
            }
        }
        body
    }

    /// The largest angle that the side of a texel is seen under, radians, or a little more.
    pub fn texel_angle(&self) -> f64 {
        let v = &self.view;
        let step = 2.0 / v.resolution as f64;
        if v.perspective == LightView::PARABOLOID {
            // Directions change with the place in the image by twice its unit, at most.
            return 2.0 * step / v.row_z.z as f64;
        }
        // On the plane at a depth of 1 m: the longest extent of the inverse of the rows there.
        let axis = v.axis.truncate().as_dvec3();
        let (t, u) = axis.any_orthonormal_pair();
        let [a, b] = [v.row_x, v.row_y].map(|row| row.truncate().as_dvec3()).map(|row| [row.dot(t), row.dot(u)]);
        let longest = ((a[0] + b[1]).hypot(a[1] - b[0]) + (a[0] - b[1]).hypot(a[1] + b[0])) / 2.0;
        step * longest / (a[0] * b[1] - a[1] * b[0]).abs()
    }
}

/// What all faces around a light share.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Around {
    /// Where the light stands.
    pub light: DVec3,
    /// Depths of all maps, metres.
    pub near: f64,
    pub far: f64,
    /// Side of each layer, texels.
    pub side: f64,
    /// Texels that a map goes beyond its face.
    pub guard: f64,
    /// Metres from a receiver that a filter's taps lie apart, on top.
    pub metres: f64,
}

impl Around {
    fn row(&self, v: DVec3) -> DVec4 {
        v.extend(-v.dot(self.light))
    }

    /// A view with a matrix, that looks along `axis`: a point `q` metres from the light lies at `x · q` and `y · q` over `axis · q`,
    /// texels from the layer's upper left corner. `texel`: the side of a square texel at a depth of 1 m; 0: they are not square.
    fn flat(&self, axis: DVec3, [x, y]: [DVec3; 2], texel: f64) -> LightView {
        let w = self.row(axis);
        let half = self.side / 2.0;
        let depth = (DVec4::W * self.far - w) * (self.near / (self.far - self.near));
        LightView {
            row_x: (self.row(x) / half - w).as_vec4(),
            row_y: (w - self.row(y) / half).as_vec4(),
            row_z: depth.as_vec4(),
            row_w: w.as_vec4(),
            axis: w.as_vec4(),
            near: self.near as f32,
            far: self.far as f32,
            perspective: 1,
            texel: texel as f32,
            resolution: self.side as f32,
            margin: self.guard as f32,
            ..LightView::zeroed()
        }
    }

    /// A cube's faces: +x, -x, +y, -y, +z, -z, a layer each.
    pub fn cube(&self) -> Vec<Face> {
        let inner = self.side - 2.0 * self.guard;
        let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
        let frames = [(x, z, y), (-x, -z, y), (y, -x, -z), (-y, -x, z), (z, -x, y), (-z, x, y)];
        let face = |(i, (axis, right, up)): (usize, (DVec3, DVec3, DVec3))| {
            let middle = axis * (self.side / 2.0);
            let places = [middle + right * (inner / 2.0), middle - up * (inner / 2.0)];
            Face { view: self.flat(axis, places, 2.0 / inner), axis, layer: i as u32, region: [Vec4::ZERO; 2] }
        };
        frames.into_iter().enumerate().map(face).collect()
    }

    /// An octahedron's faces: two to a layer, the upper one in the corner at the middle of the map that the four layers are
    /// together (Engelhardt, Dachsbacher 2008). In each octant that map is a projective one: edges stay straight.
    pub fn octahedron(&self) -> Vec<Face> {
        let (side, guard) = (self.side, self.guard);
        let leg = side - (2.0 + 2f64.sqrt()) * guard;
        let mut faces = Vec::new();
        for layer in 0..4 {
            let [a, b] = [layer & 1, layer >> 1].map(|bit| if bit == 1 { 1.0 } else { -1.0 });
            for upper in [true, false] {
                let up = if upper { 1.0 } else { -1.0 };
                let (x, y, z) = (DVec3::X * a, DVec3::NEG_Z * b, DVec3::Y * up);
                let w = x + y + z;
                // Of |x| and |y| over w, from the map's middle on.
                let place = |from: DVec3| match upper {
                    true => w * guard + from * leg,
                    false => w * (side - guard - leg) + (from + z) * leg,
                };
                let turned = |place: DVec3, sign: f64| if sign > 0.0 { place } else { w * side - place };
                // |x| + |y| of texels is at most the side, or at least.
                let beyond = |sign: f64| if sign > 0.0 { (sign, 0.0) } else { (sign, side) };
                let ((p, p0), (q, q0)) = (beyond(a), beyond(b));
                let border = Vec4::new(-p as f32, -q as f32, (side - p0 - q0) as f32, 0.0) * up as f32;
                let length = 3f64.sqrt();
                let places = [turned(place(x), a), turned(place(y), b)].map(|p| p / length);
                let axis = w / length;
                let view = self.flat(axis, places, 0.0);
                faces.push(Face { view, axis, layer: layer as u32, region: [border, Vec4::ZERO] });
            }
        }
        faces
    }

    /// A tetrahedron's faces: two to a layer, the second cut in halves at both sides of the first. The layers are square, so
    /// that texels are 2/√3 times as wide as high.
    pub fn tetrahedron(&self) -> Vec<Face> {
        let (side, guard) = (self.side, self.guard);
        // The triangle in the plane at a distance of 1.
        let (half_width, top, height) = (6f64.sqrt(), 8f64.sqrt(), 18f64.sqrt());
        let scale = 1.0 - (3.0 + 5f64.sqrt()) * guard / side;
        let (across, down) = (scale * side / (2.0 * half_width), scale * side / height);
        let corners = [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];
        let axes = corners.map(|c| DVec3::from_array(c).normalize());
        let left = Vec4::new(2.0, 1.0, -side as f32, 0.0);
        let right = Vec4::new(-2.0, 1.0, side as f32, 0.0);
        let mut faces = Vec::new();
        for (i, axis) in axes.into_iter().enumerate() {
            let apex = -axes[(i + 1) % 4];
            let up = (apex - axis * axis.dot(apex)).normalize();
            let x = axis.cross(up);
            let layer = i as u32 / 2;
            let mut face = |places: [DVec3; 2], axis: DVec3, toward: DVec3, region: [Vec4; 2]| {
                let view = self.flat(axis, places, 0.0);
                // A hair off its axis, so that two halves of a face part in its middle.
                faces.push(Face { view, axis: (axis + toward * 1e-4).normalize(), layer, region });
            };
            if i % 2 == 0 {
                // Of the unscaled triangle the point that stays: as far from all sides.
                let stays = side - side / (1.0 + 5f64.sqrt());
                let middle = stays + scale * (side * top / height - stays);
                let places = [axis * (side / 2.0) + x * across, axis * middle - up * down];
                face(places, axis, DVec3::ZERO, [left, right]);
            } else {
                // Head down: turned by half a turn.
                let y = axis * (guard + scale * side * 2f64.sqrt() / height) + up * down;
                face([axis * guard - x * across, y], axis, -x, [-left, Vec4::ZERO]);
                face([axis * (side - guard) - x * across, y], axis, x, [-right, Vec4::ZERO]);
            }
        }
        faces
    }

    /// A paraboloid's side around the axis of a frame (its z). `cut`: what turns directions before they are projected (Navratil,
    /// Zemcik, Juranek, Peciva 2012); the side's border is then a circle off the middle.
    pub fn paraboloid(&self, frame: DMat3, cut: DMat3, layer: u32) -> Face {
        let border = cut * DVec3::Z;
        let turned = frame * cut.transpose();
        let radius = 1.0 / border.z;
        let middle = border.truncate() * radius;
        let half = radius * self.side / (self.side - 2.0 * self.guard);
        let [x, y, z] = [turned.x_axis, turned.y_axis, turned.z_axis].map(|v| self.row(v).as_vec4());
        let view = LightView {
            row_x: x,
            row_y: y,
            row_z: Vec4::new(middle.x as f32, middle.y as f32, (1.0 / half) as f32, (1.0 / half) as f32),
            row_w: self.row(frame.z_axis).as_vec4(),
            axis: z,
            near: self.near as f32,
            far: self.far as f32,
            perspective: LightView::PARABOLOID,
            resolution: self.side as f32,
            margin: self.guard as f32,
            // Directions change with the place in the map by twice the image's unit, at most.
            ahead: (FRAC_PI_2 + 4.0 * self.guard * half / self.side + 0.02).min(PI).cos() as f32,
            ..LightView::zeroed()
        };
        Face { view, axis: frame.z_axis, layer, region: [Vec4::ZERO; 2] }
    }
}
