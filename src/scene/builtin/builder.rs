//! Puts generated scenes together out of boxes, lathes, tubes and the like.
//!
//! Shapes are given in local space, placed by a stack of transforms, and collected in world space,
//! one mesh a material. Texture coordinates are metres times [`Builder::uv_scale`] unless said otherwise.

use crate::light::Light;
use crate::scene::{
    Camera, Local, Material, Mesh, NamedCamera, NamedLight, Node, Scene, Texture, Wrap,
};
use glam::{Mat4, Quat, Vec2, Vec3, Vec4, vec2, vec3};
use std::f32::consts::{FRAC_PI_2, PI, TAU};

/// How a shape's normals come about.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shading {
    /// Each triangle has its own.
    Flat,
    /// Averaged over the triangles that meet at a point, except across edges sharper than this, degrees.
    Smooth(f32),
}

/// Smooth but for edges above 40 degrees: right for most turned and bent things.
pub const CREASED: Shading = Shading::Smooth(40.0);

/// Triangles in local space, before they are placed. Counter-clockwise seen from outside.
#[derive(Clone, Debug, Default)]
pub struct Patch {
    pub positions: Vec<Vec3>,
    pub uvs: Vec<Vec2>,
    pub indices: Vec<u32>,
}

impl Patch {
    /// Adds a vertex and returns its index.
    pub fn vertex(&mut self, position: Vec3, uv: Vec2) -> u32 {
        self.positions.push(position);
        self.uvs.push(uv);
        self.positions.len() as u32 - 1
    }

    /// Adds a convex polygon of existing vertices as a fan, leaving out triangles without area.
    pub fn face(&mut self, corners: &[u32]) {
        for i in 1..corners.len() - 1 {
            let [a, b, c] = [corners[0], corners[i], corners[i + 1]];
            let [p, q, r] = [a, b, c].map(|k| self.positions[k as usize]);
            if p != q && q != r && r != p {
                self.indices.extend([a, b, c]);
            }
        }
    }

    /// Adds a `columns` × `rows` lattice of points and the cells between them. Outside is where
    /// (step in column) × (step in row) points.
    pub fn lattice(
        &mut self,
        columns: usize,
        rows: usize,
        mut point: impl FnMut(usize, usize) -> (Vec3, Vec2),
    ) {
        let first = self.positions.len() as u32;
        for j in 0..rows {
            for i in 0..columns {
                let (position, uv) = point(i, j);
                self.vertex(position, uv);
            }
        }
        for j in 0..rows as u32 - 1 {
            for i in 0..columns as u32 - 1 {
                let a = first + j * columns as u32 + i;
                let d = a + columns as u32;
                self.face(&[a, a + 1, d + 1, d]);
            }
        }
    }
}

/// Collects a scene's triangles.
pub struct Builder {
    scene: Scene,
    transform: Mat4,
    /// Texture repeats a metre for the shapes that follow.
    pub uv_scale: f32,
    /// Added to all texture coordinates of the shapes that follow.
    pub uv_offset: Vec2,
}

impl Builder {
    pub fn new(name: &str) -> Self {
        let scene = Scene {
            name: name.into(),
            ..Scene::default()
        };
        Self {
            scene,
            transform: Mat4::IDENTITY,
            uv_scale: 1.0,
            uv_offset: Vec2::ZERO,
        }
    }

    /// Adds a plain material; `srgb` is 0xRRGGBB.
    pub fn material(&mut self, name: &str, srgb: u32) -> u32 {
        self.scene.materials.push(Material {
            name: name.into(),
            base_color: linear(srgb),
            texture: None,
            alpha_cutoff: None,
            double_sided: false,
        });
        self.scene.meshes.push(Mesh {
            material: self.scene.materials.len() as u32 - 1,
            ..Mesh::default()
        });
        self.scene.materials.len() as u32 - 1
    }

    /// Adds a material seen from both sides.
    pub fn double_sided(&mut self, name: &str, srgb: u32) -> u32 {
        let material = self.material(name, srgb);
        self.scene.materials[material as usize].double_sided = true;
        material
    }

    /// Adds a material whose colour is a texture times `srgb`.
    pub fn textured(&mut self, name: &str, srgb: u32, texture: u32) -> u32 {
        let material = self.material(name, srgb);
        self.scene.materials[material as usize].texture = Some(texture);
        material
    }

    /// Adds a double-sided textured material without surface where the texture's alpha is below a half.
    pub fn cutout(&mut self, name: &str, srgb: u32, texture: u32) -> u32 {
        let material = self.textured(name, srgb, texture);
        let added = &mut self.scene.materials[material as usize];
        added.alpha_cutoff = Some(0.5);
        added.double_sided = true;
        material
    }

    /// Adds a repeating texture; `texel` gives sRGB colour and alpha, 0 to 1, for a column and row.
    pub fn texture(
        &mut self,
        width: u32,
        height: u32,
        mut texel: impl FnMut(u32, u32) -> [f32; 4],
    ) -> u32 {
        let mut rgba = Vec::with_capacity((width * height * 4) as usize);
        for y in 0..height {
            for x in 0..width {
                rgba.extend(texel(x, y).map(|c| (c.clamp(0.0, 1.0) * 255.0).round() as u8));
            }
        }
        self.scene.textures.push(Texture {
            width,
            height,
            rgba,
            wrap: [Wrap::Repeat; 2],
        });
        self.scene.textures.len() as u32 - 1
    }

    /// Runs `draw` with `local` applied before the transforms already in force.
    /// Mirroring keeps outsides outside.
    pub fn with(&mut self, local: Mat4, draw: impl FnOnce(&mut Self)) {
        let outer = self.transform;
        self.transform = outer * local;
        draw(self);
        self.transform = outer;
    }

    /// [`Self::with`] a translation.
    pub fn at(&mut self, offset: Vec3, draw: impl FnOnce(&mut Self)) {
        self.with(Mat4::from_translation(offset), draw);
    }

    /// [`Self::with`] a translation after a turn about y, in radians (from +x towards -z).
    pub fn turned(&mut self, offset: Vec3, angle: f32, draw: impl FnOnce(&mut Self)) {
        self.with(
            Mat4::from_rotation_translation(Quat::from_rotation_y(angle), offset),
            draw,
        );
    }

    /// Triangles so far.
    pub fn triangles(&self) -> usize {
        self.scene.meshes.iter().map(|m| m.indices.len() / 3).sum()
    }

    /// Places a patch.
    pub fn add(&mut self, material: u32, patch: &Patch, shading: Shading) {
        let positions: Vec<Vec3> = patch
            .positions
            .iter()
            .map(|&p| self.transform.transform_point3(p))
            .collect();
        let flip = self.transform.determinant() < 0.0;
        let triangles: Vec<[u32; 3]> = patch
            .indices
            .chunks_exact(3)
            .map(|t| {
                if flip {
                    [t[0], t[2], t[1]]
                } else {
                    [t[0], t[1], t[2]]
                }
            })
            .collect();
        let areas: Vec<Vec3> = triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|k| positions[k as usize]);
                (b - a).cross(c - a)
            })
            .collect();
        let normals = corner_normals(&positions, &triangles, &areas, shading);
        // A vertex is shared by the corners that agree on its normal.
        let mesh = &mut self.scene.meshes[material as usize];
        let mut shared: Vec<Vec<(Vec3, u32)>> = vec![Vec::new(); positions.len()];
        for (triangle, normals) in triangles.iter().zip(&normals) {
            for (&k, &normal) in triangle.iter().zip(normals) {
                let known = &mut shared[k as usize];
                let index = match known.iter().find(|(n, _)| *n == normal) {
                    Some(&(_, index)) => index,
                    None => {
                        mesh.positions.push(positions[k as usize]);
                        mesh.normals.push(normal);
                        mesh.uvs.push(patch.uvs[k as usize] + self.uv_offset);
                        let index = mesh.positions.len() as u32 - 1;
                        known.push((normal, index));
                        index
                    }
                };
                mesh.indices.push(index);
            }
        }
    }

    /// A flat convex polygon, counter-clockwise seen from its front.
    pub fn polygon(&mut self, material: u32, corners: &[Vec3]) {
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        let mut patch = Patch::default();
        let face: Vec<u32> = corners
            .iter()
            .map(|&p| patch.vertex(p, facing_uv(p, normal) * self.uv_scale))
            .collect();
        patch.face(&face);
        self.add(material, &patch, Shading::Flat);
    }

    /// A flat quadrilateral whose corners have the whole texture's: upper left, lower left, lower
    /// right, upper right (counter-clockwise seen from its front).
    pub fn picture(&mut self, material: u32, corners: [Vec3; 4]) {
        let uvs = [Vec2::ZERO, Vec2::Y, Vec2::ONE, Vec2::X];
        let patch = Patch {
            positions: corners.to_vec(),
            uvs: uvs.to_vec(),
            indices: vec![0, 1, 2, 0, 2, 3],
        };
        self.add(material, &patch, Shading::Flat);
    }

    /// A `columns` × `rows` lattice of points; outside is where (step in column) × (step in row) points.
    pub fn lattice(
        &mut self,
        material: u32,
        columns: usize,
        rows: usize,
        shading: Shading,
        point: impl FnMut(usize, usize) -> (Vec3, Vec2),
    ) {
        let mut patch = Patch::default();
        patch.lattice(columns, rows, point);
        self.add(material, &patch, shading);
    }

    /// A terrain over the rectangle from `min` to `max` in x and z, facing up.
    pub fn heightfield(
        &mut self,
        material: u32,
        min: Vec2,
        max: Vec2,
        cells: [usize; 2],
        mut height: impl FnMut(f32, f32) -> f32,
    ) {
        let uv_scale = self.uv_scale;
        self.lattice(
            material,
            cells[1] + 1,
            cells[0] + 1,
            Shading::Smooth(180.0),
            |i, j| {
                let x = min.x + (max.x - min.x) * (j as f32 / cells[0] as f32);
                let z = min.y + (max.y - min.y) * (i as f32 / cells[1] as f32);
                (vec3(x, height(x, z), z), vec2(x, z) * uv_scale)
            },
        );
    }

    /// A box from `min` to `max`.
    pub fn cuboid(&mut self, material: u32, min: Vec3, max: Vec3) {
        self.cuboid_sides(material, min, max, [true; 6]);
    }

    /// A box from `min` to `max` without the side that it stands on.
    pub fn block(&mut self, material: u32, min: Vec3, max: Vec3) {
        self.cuboid_sides(material, min, max, [true, true, false, true, true, true]);
    }

    /// Those sides of a box that are asked for: -x, +x, -y, +y, -z, +z.
    pub fn cuboid_sides(&mut self, material: u32, min: Vec3, max: Vec3, sides: [bool; 6]) {
        for (side, _) in sides.iter().enumerate().filter(|(_, wanted)| **wanted) {
            let axis = side / 2;
            let corner = |u: bool, v: bool| {
                let mut bits = [false; 3];
                bits[axis] = side % 2 == 1;
                bits[(axis + 1) % 3] = u;
                bits[(axis + 2) % 3] = v;
                let pick = |k: usize| if bits[k] { max[k] } else { min[k] };
                vec3(pick(0), pick(1), pick(2))
            };
            let mut corners = [
                corner(false, false),
                corner(true, false),
                corner(true, true),
                corner(false, true),
            ];
            if side % 2 == 0 {
                corners.reverse();
            }
            self.polygon(material, &corners);
        }
    }

    /// A box from `min` to `max` with edges rounded to `radius` in `steps` strips
    /// (one: a plain chamfer). 12 + 24 `steps` + 8 `steps`² triangles.
    pub fn rounded(&mut self, material: u32, min: Vec3, max: Vec3, radius: f32, steps: usize) {
        let middle = (min + max) * 0.5;
        let inner = (max - min) * 0.5 - radius;
        let mut patch = Patch::default();
        let uv_scale = self.uv_scale;
        // One octant's corner as a triangle of points; i + j + k = steps.
        let sine = |i: usize| (i as f32 / steps as f32 * FRAC_PI_2).sin();
        let arc = |i: usize, j: usize, k: usize| {
            // The three ends and the edges must come out alike for both neighbours.
            match (i, j, k) {
                (_, 0, 0) => Vec3::X,
                (0, _, 0) => Vec3::Y,
                (0, 0, _) => Vec3::Z,
                _ => vec3(sine(i), sine(j), sine(k)).normalize(),
            }
        };
        let signs = [1.0, -1.0];
        let put = |sign: Vec3, dir: Vec3, normal: Vec3, patch: &mut Patch| {
            let p = middle + sign * (inner + dir * radius);
            patch.vertex(p, facing_uv(p, normal) * uv_scale)
        };
        // Faces and edges: each between octants that differ along one or two axes.
        for axis in 0..3 {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            for s in signs {
                let mut base = Vec3::ONE;
                base[axis] = s;
                let dir = [Vec3::X, Vec3::Y, Vec3::Z][axis];
                let mut ring: Vec<u32> = [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)]
                    .iter()
                    .map(|&(su, sv)| {
                        let mut sign = base;
                        sign[u] = su;
                        sign[v] = sv;
                        put(sign, dir, dir, &mut patch)
                    })
                    .collect();
                if s < 0.0 {
                    ring.reverse();
                }
                patch.face(&ring);
                // The edge along `axis` where u and v have the signs s and t.
                for t in signs {
                    let rows: Vec<[u32; 2]> = (0..=steps)
                        .map(|i| {
                            let mut at = [0; 3];
                            at[u] = steps - i;
                            at[v] = i;
                            let dir = arc(at[0], at[1], at[2]);
                            let mut sign = Vec3::ONE;
                            sign[u] = s;
                            sign[v] = t;
                            let normal = sign * dir;
                            [-1.0, 1.0].map(|end| {
                                sign[axis] = end;
                                put(sign, dir, normal, &mut patch)
                            })
                        })
                        .collect();
                    for pair in rows.windows(2) {
                        let mut cell = [pair[0][0], pair[1][0], pair[1][1], pair[0][1]];
                        if s * t < 0.0 {
                            cell.reverse();
                        }
                        patch.face(&cell);
                    }
                }
            }
        }
        for (sx, sy, sz) in signs
            .iter()
            .flat_map(|&x| signs.iter().flat_map(move |&y| signs.map(|z| (x, y, z))))
        {
            let sign = vec3(sx, sy, sz);
            let at = |i: usize, j: usize, patch: &mut Patch| {
                let dir = arc(i, j, steps - i - j);
                put(sign, dir, Vec3::Y, patch)
            };
            let mut triangle = |points: [(usize, usize); 3]| {
                let mut corners = points.map(|(i, j)| at(i, j, &mut patch));
                if sx * sy * sz < 0.0 {
                    corners.reverse();
                }
                patch.face(&corners);
            };
            for i in 0..steps {
                for j in 0..steps - i {
                    triangle([(i, j), (i + 1, j), (i, j + 1)]);
                    if i + j + 2 <= steps {
                        triangle([(i + 1, j), (i + 1, j + 1), (i, j + 1)]);
                    }
                }
            }
        }
        self.add(material, &patch, Shading::Smooth(60.0));
    }

    /// A solid whose cross-section is a simple polygon in x and y, from `z0` to `z1`.
    pub fn extrude(&mut self, material: u32, outline: &[Vec2], z0: f32, z1: f32, shading: Shading) {
        let mut outline = outline.to_vec();
        if signed_area(&outline) < 0.0 {
            outline.reverse();
        }
        let n = outline.len();
        let scale = self.uv_scale;
        let mut patch = Patch::default();
        let caps = ear_clip(&outline);
        for (z, front) in [(z1.max(z0), true), (z0.min(z1), false)] {
            let ids: Vec<u32> = outline
                .iter()
                .map(|&p| patch.vertex(p.extend(z), vec2(p.x, -p.y) * scale))
                .collect();
            for t in &caps {
                let [a, b, c] = t.map(|k| ids[k]);
                patch.face(&if front { [a, b, c] } else { [a, c, b] });
            }
        }
        let mut along = 0.0;
        for i in 0..n {
            let (p, q) = (outline[i], outline[(i + 1) % n]);
            let next = along + p.distance(q);
            let (lo, hi) = (z0.min(z1), z0.max(z1));
            let cell = [(p, lo, along), (q, lo, next), (q, hi, next), (p, hi, along)]
                .map(|(p, z, u)| patch.vertex(p.extend(z), vec2(u, z) * scale));
            patch.face(&cell);
            along = next;
        }
        self.add(material, &patch, shading);
    }

    /// A polygon in x and z raised from `y0` to `y1`; without its bottom if `open`.
    pub fn prism(&mut self, material: u32, outline: &[Vec2], y0: f32, y1: f32, open: bool) {
        let mut outline = outline.to_vec();
        // Seen from above, z runs down: counter-clockwise there is a negative area in (x, z).
        if signed_area(&outline) > 0.0 {
            outline.reverse();
        }
        let flat: Vec<Vec2> = outline.iter().map(|p| vec2(p.x, -p.y)).collect();
        let n = outline.len();
        let scale = self.uv_scale;
        let mut patch = Patch::default();
        for (y, top) in [(y1, true), (y0, false)] {
            if !top && open {
                continue;
            }
            let ids: Vec<u32> = outline
                .iter()
                .map(|&p| patch.vertex(vec3(p.x, y, p.y), p * scale))
                .collect();
            for t in ear_clip(&flat) {
                let [a, b, c] = t.map(|k| ids[k]);
                patch.face(&if top { [a, b, c] } else { [a, c, b] });
            }
        }
        let mut along = 0.0;
        for i in 0..n {
            let (p, q) = (outline[i], outline[(i + 1) % n]);
            let next = along + p.distance(q);
            let cell = [(p, y0, along), (q, y0, next), (q, y1, next), (p, y1, along)]
                .map(|(p, y, u)| patch.vertex(vec3(p.x, y, p.y), vec2(u, -y) * scale));
            patch.face(&cell);
            along = next;
        }
        self.add(material, &patch, Shading::Flat);
    }

    /// A cylinder, cone or frustum between two points, with its caps where `caps` says so.
    #[allow(clippy::too_many_arguments)]
    pub fn frustum(
        &mut self,
        material: u32,
        a: Vec3,
        b: Vec3,
        radius_a: f32,
        radius_b: f32,
        segments: usize,
        caps: [bool; 2],
    ) {
        let length = a.distance(b);
        let mut profile = vec![vec2(radius_a, 0.0), vec2(radius_b, length)];
        if caps[0] && radius_a > 0.0 {
            profile.insert(0, vec2(0.0, 0.0));
        }
        if caps[1] && radius_b > 0.0 {
            profile.push(vec2(0.0, length));
        }
        let turn = Quat::from_rotation_arc(Vec3::Y, (b - a) / length);
        self.with(Mat4::from_rotation_translation(turn, a), |builder| {
            builder.lathe(material, &profile, segments);
        });
    }

    /// An upright closed cylinder standing on `base`.
    pub fn cylinder(
        &mut self,
        material: u32,
        base: Vec3,
        radius: f32,
        height: f32,
        segments: usize,
    ) {
        self.frustum(
            material,
            base,
            base + Vec3::Y * height,
            radius,
            radius,
            segments,
            [true; 2],
        );
    }

    /// The profile (radius, y) turned once around the y axis. The outside is to the right of the
    /// profile's way: run it upwards, or counter-clockwise if it closes.
    pub fn lathe(&mut self, material: u32, profile: &[Vec2], segments: usize) {
        self.lathe_arc(material, profile, segments, 0.0, TAU);
    }

    /// [`Self::lathe`] over a part of the circle: angles in radians, from +x towards -z, rising.
    pub fn lathe_arc(
        &mut self,
        material: u32,
        profile: &[Vec2],
        segments: usize,
        from: f32,
        to: f32,
    ) {
        let whole = to - from >= TAU;
        let widest = profile.iter().fold(0.0, |r: f32, p| r.max(p.x));
        let mut along = vec![0.0];
        for pair in profile.windows(2) {
            along.push(along[along.len() - 1] + pair[0].distance(pair[1]));
        }
        let scale = self.uv_scale;
        self.lattice(
            material,
            segments + 1,
            profile.len(),
            CREASED,
            |i, j| {
                let turn = i as f32 / segments as f32;
                // The last column of a whole turn is exactly the first.
                let i = if whole { i % segments } else { i };
                let angle = from + (to - from) * (i as f32 / segments as f32);
                let p = profile[j];
                let position = vec3(p.x * angle.cos(), p.y, -p.x * angle.sin());
                let u = turn * (to - from) * widest;
                (position + 0.0, vec2(u, -along[j]) * scale)
            },
        );
    }

    /// An ellipsoid with its poles along y. 2 `segments` (`rings` - 1) triangles.
    pub fn ellipsoid(
        &mut self,
        material: u32,
        center: Vec3,
        radii: Vec3,
        segments: usize,
        rings: usize,
    ) {
        let profile: Vec<Vec2> = (0..=rings)
            .map(|j| {
                let angle = j as f32 / rings as f32 * PI;
                let radius = if j == 0 || j == rings { 0.0 } else { angle.sin() };
                vec2(radius, -angle.cos())
            })
            .collect();
        let placed = Mat4::from_scale_rotation_translation(radii, Quat::IDENTITY, center);
        let mut patch = Patch::default();
        let scale = self.uv_scale;
        patch.lattice(segments + 1, rings + 1, |i, j| {
            let angle = (i % segments) as f32 / segments as f32 * TAU;
            let p = profile[j];
            let uv = vec2(i as f32 / segments as f32 * TAU, -(j as f32) / rings as f32 * PI);
            let position = vec3(p.x * angle.cos(), p.y, -p.x * angle.sin());
            (position + 0.0, uv * radii.max_element() * scale)
        });
        self.with(placed, |builder| {
            builder.add(material, &patch, Shading::Smooth(180.0));
        });
    }

    /// A sphere of 20 · 4^`subdivisions` even triangles.
    pub fn icosphere(&mut self, material: u32, center: Vec3, radius: f32, subdivisions: u32) {
        self.blob(material, subdivisions, 180.0, |dir| center + dir * radius);
    }

    /// A sphere of 20 · 4^`subdivisions` triangles moved point by point: `shape` is given unit vectors.
    /// Edges sharper than `crease` degrees stay sharp (0: every triangle flat).
    pub fn blob(
        &mut self,
        material: u32,
        subdivisions: u32,
        crease: f32,
        mut shape: impl FnMut(Vec3) -> Vec3,
    ) {
        let g = 0.5 * (1.0 + 5.0f32.sqrt());
        let corners = [
            (-1.0, g, 0.0),
            (1.0, g, 0.0),
            (-1.0, -g, 0.0),
            (1.0, -g, 0.0),
            (0.0, -1.0, g),
            (0.0, 1.0, g),
            (0.0, -1.0, -g),
            (0.0, 1.0, -g),
            (g, 0.0, -1.0),
            (g, 0.0, 1.0),
            (-g, 0.0, -1.0),
            (-g, 0.0, 1.0),
        ]
        .map(|(x, y, z)| vec3(x, y, z).normalize());
        let faces = [
            [0, 11, 5],
            [0, 5, 1],
            [0, 1, 7],
            [0, 7, 10],
            [0, 10, 11],
            [1, 5, 9],
            [5, 11, 4],
            [11, 10, 2],
            [10, 7, 6],
            [7, 1, 8],
            [3, 9, 4],
            [3, 4, 2],
            [3, 2, 6],
            [3, 6, 8],
            [3, 8, 9],
            [4, 9, 5],
            [2, 4, 11],
            [6, 2, 10],
            [8, 6, 7],
            [9, 8, 1],
        ];
        let mut triangles: Vec<[Vec3; 3]> = faces.map(|f| f.map(|k: usize| corners[k])).to_vec();
        for _ in 0..subdivisions {
            triangles = triangles
                .iter()
                .flat_map(|&[a, b, c]| {
                    // Sums of two commute exactly, so that neighbours agree on the new point.
                    let [d, e, f] = [a + b, b + c, c + a].map(Vec3::normalize);
                    [[a, d, f], [d, b, e], [f, e, c], [d, e, f]]
                })
                .collect();
        }
        let mut patch = Patch::default();
        for triangle in triangles {
            let corners = triangle.map(|dir| {
                let p = shape(dir);
                let uv = facing_uv(p, dir) * self.uv_scale;
                patch.vertex(p, uv)
            });
            patch.face(&corners);
        }
        let shading = if crease > 0.0 {
            Shading::Smooth(crease)
        } else {
            Shading::Flat
        };
        self.add(material, &patch, shading);
    }

    /// A round tube along a path, `radii` a point each, with flat ends; a `closed` path is a ring.
    pub fn tube(
        &mut self,
        material: u32,
        path: &[Vec3],
        radii: &[f32],
        segments: usize,
        closed: bool,
    ) {
        let n = path.len();
        let tangent = |i: usize| {
            let (before, after) = if closed {
                (path[(i + n - 1) % n], path[(i + 1) % n])
            } else {
                (path[i.saturating_sub(1)], path[(i + 1).min(n - 1)])
            };
            (after - before).normalize()
        };
        // Frames carried along with the least twist.
        let mut side = tangent(0).any_orthonormal_vector();
        let mut sides = vec![side];
        for i in 1..n {
            side = Quat::from_rotation_arc(tangent(i - 1), tangent(i)) * side;
            side = side.reject_from_normalized(tangent(i)).normalize();
            sides.push(side);
        }
        // What twist a ring has left at its seam is spread over it.
        let twist = if closed {
            let last = Quat::from_rotation_arc(tangent(n - 1), tangent(0)) * sides[n - 1];
            let across = tangent(0).cross(sides[0]);
            -last.dot(across).atan2(last.dot(sides[0]))
        } else {
            0.0
        };
        let mut along = vec![0.0];
        for i in 0..n {
            along.push(along[i] + path[i].distance(path[(i + 1) % n]));
        }
        let rows = if closed { n + 1 } else { n };
        let scale = self.uv_scale;
        let widest = radii.iter().fold(0.0, |a: f32, &b| a.max(b));
        let mut patch = Patch::default();
        patch.lattice(segments + 1, rows, |i, j| {
            let k = j % n;
            let turn = (i % segments) as f32 / segments as f32 * TAU + twist * k as f32 / n as f32;
            let across = tangent(k).cross(sides[k]);
            let out = sides[k] * turn.cos() + across * turn.sin();
            let u = i as f32 / segments as f32 * TAU * widest;
            (path[k] + out * radii[k], vec2(u, along[j]) * scale)
        });
        if !closed {
            for (row, flip) in [(0, true), (n - 1, false)] {
                let mut ring: Vec<u32> = (0..segments)
                    .map(|i| (row * (segments + 1) + i) as u32)
                    .collect();
                if flip {
                    ring.reverse();
                }
                if radii[row] > 0.0 {
                    patch.face(&ring);
                }
            }
        }
        self.add(material, &patch, CREASED);
    }

    /// Folded leaves of two triangles and about `length`, for a double-sided material. `place` gives a
    /// leaf's foot and the way it tends to grow.
    pub fn leaves(
        &mut self,
        material: u32,
        rng: &mut Rng,
        count: usize,
        length: f32,
        mut place: impl FnMut(&mut Rng) -> (Vec3, Vec3),
    ) {
        let mut patch = Patch::default();
        for _ in 0..count {
            let (foot, growth) = place(rng);
            let along = (growth.normalize_or(Vec3::Y) + 0.8 * rng.direction()).normalize_or(Vec3::Y);
            let across = along.cross(rng.direction()).normalize_or(Vec3::X);
            let fold = across.cross(along) * 0.12;
            let l = length * rng.range(0.7, 1.2);
            let corners = [
                (foot, Vec2::ZERO),
                (foot + (along * 0.45 + across * 0.3 + fold) * l, Vec2::X),
                (foot + along * l, Vec2::ONE),
                (foot + (along * 0.45 - across * 0.3 + fold) * l, Vec2::Y),
            ];
            let leaf = corners.map(|(p, uv)| patch.vertex(p, uv));
            patch.face(&leaf);
        }
        self.add(material, &patch, Shading::Flat);
    }

    /// The scene: what was drawn, at one node, seen and lit as given.
    pub fn finish(self, cameras: Vec<NamedCamera>, lights: Vec<NamedLight>) -> Scene {
        let mut scene = self.scene;
        scene.meshes.retain(|mesh| !mesh.indices.is_empty());
        scene.nodes = vec![Node {
            parent: None,
            local: Local::Matrix(Mat4::IDENTITY),
            meshes: (0..scene.meshes.len() as u32).collect(),
            instances: Vec::new(),
        }];
        scene.cameras = cameras;
        scene.lights = lights;
        scene
    }
}

/// A camera with a name; metres and degrees.
pub fn camera(
    name: &str,
    position: Vec3,
    target: Vec3,
    fov: f32,
    near: f32,
    far: f32,
) -> NamedCamera {
    NamedCamera {
        name: name.into(),
        camera: Camera {
            position,
            target,
            fov,
            near,
            far,
        },
    }
}

/// A light with a name.
pub fn light(name: &str, light: Light) -> NamedLight {
    NamedLight {
        name: name.into(),
        light,
    }
}

/// A linear colour, alpha one, from 0xRRGGBB.
pub fn linear(srgb: u32) -> Vec4 {
    let channel = |shift: u32| {
        let c = ((srgb >> shift) & 255) as f32 / 255.0;
        if c <= 0.04045 {
            c / 12.92
        } else {
            ((c + 0.055) / 1.055).powf(2.4)
        }
    };
    Vec4::new(channel(16), channel(8), channel(0), 1.0)
}

/// Texture coordinates in metres for a point of a surface that faces `normal`: v runs down a wall.
fn facing_uv(p: Vec3, normal: Vec3) -> Vec2 {
    let n = normal.abs();
    if n.y >= n.x && n.y >= n.z {
        vec2(p.x, p.z)
    } else if n.x >= n.z {
        vec2(-p.z * normal.x.signum(), -p.y)
    } else {
        vec2(p.x * normal.z.signum(), -p.y)
    }
}

/// The normal at each triangle's corners. `areas` are the triangles' cross products.
fn corner_normals(
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    areas: &[Vec3],
    shading: Shading,
) -> Vec<[Vec3; 3]> {
    let unit: Vec<Vec3> = areas.iter().map(|n| n.normalize_or(Vec3::Y)).collect();
    let Shading::Smooth(crease) = shading else {
        return unit.iter().map(|&n| [n; 3]).collect();
    };
    let limit = crease.to_radians().cos() - 1e-4;
    // Corners ordered by where they are: those at one point lie together.
    let mut corners: Vec<([u32; 3], u32, usize)> = Vec::with_capacity(triangles.len() * 3);
    for (t, triangle) in triangles.iter().enumerate() {
        for (c, &k) in triangle.iter().enumerate() {
            let key = (positions[k as usize] + 0.0).to_array().map(f32::to_bits);
            corners.push((key, t as u32, c));
        }
    }
    corners.sort_unstable();
    let mut normals = vec![[Vec3::Y; 3]; triangles.len()];
    for group in corners.chunk_by(|a, b| a.0 == b.0) {
        for &(_, t, c) in group {
            let own = unit[t as usize];
            let sum: Vec3 = group
                .iter()
                .filter(|(_, other, _)| own.dot(unit[*other as usize]) >= limit)
                .map(|(_, other, _)| areas[*other as usize])
                .sum();
            normals[t as usize][c] = sum.normalize_or(own);
        }
    }
    normals
}

/// Twice the area of a polygon, positive when counter-clockwise.
fn signed_area(outline: &[Vec2]) -> f32 {
    let n = outline.len();
    (0..n)
        .map(|i| outline[i].perp_dot(outline[(i + 1) % n]))
        .sum()
}

/// Triangles of a simple counter-clockwise polygon.
fn ear_clip(outline: &[Vec2]) -> Vec<[usize; 3]> {
    let mut left: Vec<usize> = (0..outline.len()).collect();
    let mut triangles = Vec::with_capacity(outline.len());
    while left.len() > 3 {
        let n = left.len();
        let ear = (0..n).find(|&i| {
            let corner = [left[(i + n - 1) % n], left[i], left[(i + 1) % n]];
            let [a, b, c] = corner.map(|k| outline[k]);
            (b - a).perp_dot(c - b) > 0.0
                && !left.iter().any(|&k| {
                    let p = outline[k];
                    !corner.contains(&k)
                        && (b - a).perp_dot(p - a) >= 0.0
                        && (c - b).perp_dot(p - b) >= 0.0
                        && (a - c).perp_dot(p - c) >= 0.0
                })
        });
        // Without an ear what is left has no area to speak of.
        let i = ear.unwrap_or(0);
        triangles.push([left[(i + n - 1) % n], left[i], left[(i + 1) % n]]);
        left.remove(i);
    }
    triangles.push([left[0], left[1], left[2]]);
    triangles
}

/// Pseudo-random numbers (PCG32, O'Neill 2014), the same for a seed at every run.
pub struct Rng(u64);

impl Rng {
    pub fn new(seed: u64) -> Self {
        let mut rng = Self(seed.wrapping_add(0x853c_49e6_748f_ea9b));
        rng.bits();
        rng
    }

    /// 32 even bits.
    pub fn bits(&mut self) -> u32 {
        let old = self.0;
        self.0 = old
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        let mixed = (((old >> 18) ^ old) >> 27) as u32;
        mixed.rotate_right((old >> 59) as u32)
    }

    /// From 0 to below 1.
    pub fn unit(&mut self) -> f32 {
        (self.bits() >> 8) as f32 / 16_777_216.0
    }

    /// From `low` to below `high`.
    pub fn range(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.unit()
    }

    /// From 0 to below `count`.
    pub fn index(&mut self, count: usize) -> usize {
        ((u64::from(self.bits()) * count as u64) >> 32) as usize
    }

    /// Even over the unit sphere.
    pub fn direction(&mut self) -> Vec3 {
        let y = self.range(-1.0, 1.0);
        let angle = self.range(0.0, TAU);
        let r = (1.0 - y * y).max(0.0).sqrt();
        vec3(r * angle.cos(), y, r * angle.sin())
    }
}

/// Smooth value noise, 0 to 1, one hill per unit. `period` > 0: repeats after as many units.
pub fn noise(p: Vec2, seed: u32, period: i32) -> f32 {
    let cell = p.floor();
    let f = p - cell;
    let s = f * f * (3.0 - 2.0 * f);
    let value = |dx: i32, dy: i32| {
        let wrap = |v: i32| if period > 0 { v.rem_euclid(period) } else { v };
        let x = wrap(cell.x as i32 + dx) as u32;
        let y = wrap(cell.y as i32 + dy) as u32;
        let mut h = x.wrapping_mul(0x8da6_b343) ^ y.wrapping_mul(0xd816_3841) ^ seed.wrapping_mul(0xcb1a_b31f);
        h = (h ^ (h >> 15)).wrapping_mul(0x2c1b_3c6d);
        h = (h ^ (h >> 12)).wrapping_mul(0x297a_2d39);
        ((h ^ (h >> 15)) >> 8) as f32 / 16_777_216.0
    };
    let low = value(0, 0) + (value(1, 0) - value(0, 0)) * s.x;
    let high = value(0, 1) + (value(1, 1) - value(0, 1)) * s.x;
    low + (high - low) * s.y
}

/// Noise of `octaves` sizes, each half the one before, about 0 to 1.
pub fn fbm(p: Vec2, seed: u32, period: i32, octaves: u32) -> f32 {
    let mut sum = 0.0;
    let mut weight = 0.5;
    for octave in 0..octaves {
        let scale = (1 << octave) as f32;
        sum += weight * noise(p * scale, seed + octave, period << octave);
        weight *= 0.5;
    }
    sum / (1.0 - 2.0 * weight)
}
