//! The shapes that a [`Builder`] draws.

use super::{Builder, CREASED, Patch, Rng, Shading};
use glam::{Mat4, Quat, Vec2, Vec3, vec2, vec3};
use std::f32::consts::{FRAC_PI_2, PI, TAU};

impl Builder {
    /// A flat convex polygon, counter-clockwise seen from its front.
    pub fn polygon(&mut self, material: u32, corners: &[Vec3]) {
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        let mut patch = Patch::default();
        let face: Vec<u32> = corners.iter().map(|&p| patch.vertex(p, facing_uv(p, normal) * self.uv_scale)).collect();
        patch.face(&face);
        self.add(material, &patch, Shading::Flat);
    }

    /// A flat quadrilateral whose corners have the whole texture's: upper left, lower left, lower
    /// right, upper right (counter-clockwise seen from its front).
    pub fn picture(&mut self, material: u32, corners: [Vec3; 4]) {
        let uvs = [Vec2::ZERO, Vec2::Y, Vec2::ONE, Vec2::X];
        let patch = Patch { positions: corners.to_vec(), uvs: uvs.to_vec(), indices: vec![0, 1, 2, 0, 2, 3] };
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
        self.lattice(material, cells[1] + 1, cells[0] + 1, Shading::Smooth(180.0), |i, j| {
            let x = min.x + (max.x - min.x) * (j as f32 / cells[0] as f32);
            let z = min.y + (max.y - min.y) * (i as f32 / cells[1] as f32);
            (vec3(x, height(x, z), z), vec2(x, z) * uv_scale)
        });
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
            let mut corners = [corner(false, false), corner(true, false), corner(true, true), corner(false, true)];
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
        for (sx, sy, sz) in signs.iter().flat_map(|&x| signs.iter().flat_map(move |&y| signs.map(|z| (x, y, z)))) {
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
            let ids: Vec<u32> = outline.iter().map(|&p| patch.vertex(p.extend(z), vec2(p.x, -p.y) * scale)).collect();
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
            let ids: Vec<u32> = outline.iter().map(|&p| patch.vertex(vec3(p.x, y, p.y), p * scale)).collect();
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
    pub fn cylinder(&mut self, material: u32, base: Vec3, radius: f32, height: f32, segments: usize) {
        self.frustum(material, base, base + Vec3::Y * height, radius, radius, segments, [true; 2]);
    }

    /// The profile (radius, y) turned once around the y axis. The outside is to the right of the
    /// profile's way: run it upwards, or counter-clockwise if it closes.
    pub fn lathe(&mut self, material: u32, profile: &[Vec2], segments: usize) {
        self.lathe_arc(material, profile, segments, 0.0, TAU);
    }

    /// [`Self::lathe`] over a part of the circle: angles in radians, from +x towards -z, rising.
    pub fn lathe_arc(&mut self, material: u32, profile: &[Vec2], segments: usize, from: f32, to: f32) {
        let whole = to - from >= TAU;
        let widest = profile.iter().fold(0.0, |r: f32, p| r.max(p.x));
        let mut along = vec![0.0];
        for pair in profile.windows(2) {
            along.push(along[along.len() - 1] + pair[0].distance(pair[1]));
        }
        let scale = self.uv_scale;
        self.lattice(material, segments + 1, profile.len(), CREASED, |i, j| {
            let turn = i as f32 / segments as f32;
            // The last column of a whole turn is exactly the first.
            let i = if whole { i % segments } else { i };
            let angle = from + (to - from) * (i as f32 / segments as f32);
            let p = profile[j];
            let position = vec3(p.x * angle.cos(), p.y, -p.x * angle.sin());
            let u = turn * (to - from) * widest;
            (position + 0.0, vec2(u, -along[j]) * scale)
        });
    }

    /// An ellipsoid with its poles along y. 2 `segments` (`rings` - 1) triangles.
    pub fn ellipsoid(&mut self, material: u32, center: Vec3, radii: Vec3, segments: usize, rings: usize) {
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
    pub fn blob(&mut self, material: u32, subdivisions: u32, crease: f32, mut shape: impl FnMut(Vec3) -> Vec3) {
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
        let shading = if crease > 0.0 { Shading::Smooth(crease) } else { Shading::Flat };
        self.add(material, &patch, shading);
    }

    /// A round tube along a path, `radii` a point each, with flat ends; a `closed` path is a ring.
    pub fn tube(&mut self, material: u32, path: &[Vec3], radii: &[f32], segments: usize, closed: bool) {
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
                let mut ring: Vec<u32> = (0..segments).map(|i| (row * (segments + 1) + i) as u32).collect();
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

/// Twice the area of a polygon, positive when counter-clockwise.
fn signed_area(outline: &[Vec2]) -> f32 {
    let n = outline.len();
    (0..n).map(|i| outline[i].perp_dot(outline[(i + 1) % n])).sum()
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
