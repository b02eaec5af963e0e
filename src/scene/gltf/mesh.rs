//! Mesh primitives to triangle lists.

use super::accessors::Accessors;
use super::material::{Materials, TexCoords};
use super::{MAX_TRIANGLES, broken, get, name_of, too_many};
use crate::scene::Mesh;
use ::gltf::json::accessor::Accessor;
use ::gltf::json::mesh::{Mode, MorphTarget, Primitive, Semantic};
use ::gltf::json::validation::Checked;
use ::gltf::json::{Index, Node, Root};
use anyhow::Result;
use glam::{Mat3, Mat4, Vec2, Vec3};
use std::collections::HashMap;

/// What was left out or changed on the way, for the notes.
#[derive(Default)]
pub struct Counts {
    pub points_and_lines: usize,
    pub without_positions: usize,
    pub degenerate: usize,
    pub incomplete: usize,
    pub mended_normals: usize,
    pub mended_uvs: usize,
    pub without_uvs: usize,
    pub vertex_colors: usize,
    pub skinned: usize,
    pub morphed: usize,
}

/// The meshes met so far.
pub struct Meshes<'a> {
    root: &'a Root,
    accessors: &'a Accessors<'a>,
    pub materials: Materials<'a>,
    pub list: Vec<Mesh>,
    pub counts: Counts,
    /// Vertices in `list`.
    stored: u64,
    /// The scene's meshes of a mesh of the file.
    shared: HashMap<usize, Vec<u32>>,
}

impl<'a> Meshes<'a> {
    pub fn new(root: &'a Root, accessors: &'a Accessors<'a>) -> Self {
        Self {
            root,
            accessors,
            materials: Materials::new(root),
            list: Vec::new(),
            counts: Counts::default(),
            stored: 0,
            shared: HashMap::new(),
        }
    }

    /// The scene's meshes for a node. With `joints`, the matrices of its skin, they are in the space
    /// that those lead to; else in the node's space.
    pub fn of_node(&mut self, node: &Node, joints: Option<&[Mat4]>, owner: &str) -> Result<Vec<u32>> {
        let Some(index) = node.mesh else { return Ok(Vec::new()) };
        let mesh = get(&self.root.meshes, index, "mesh", owner)?;
        let own = joints.is_some() || node.weights.is_some();
        if !own && let Some(known) = self.shared.get(&index.value()) {
            return Ok(known.clone());
        }
        let owner = format!("mesh {index}{}", name_of(mesh.name.as_deref()));
        let weights = node.weights.as_deref().or(mesh.weights.as_deref()).unwrap_or_default();
        let first = self.list.len() as u32;
        for primitive in &mesh.primitives {
            if let Some(mesh) = self.primitive(primitive, weights, joints, &owner)? {
                self.stored += mesh.positions.len() as u64;
                self.list.push(mesh);
            }
            if self.stored > 3 * MAX_TRIANGLES {
                return Err(too_many(self.stored / 3));
            }
        }
        let meshes: Vec<u32> = (first..self.list.len() as u32).collect();
        if !own {
            self.shared.insert(index.value(), meshes.clone());
        }
        Ok(meshes)
    }

    /// About how many triangles of memory one of `list` takes: one with more vertices than it uses takes as much as if it
    /// used them.
    pub fn weight(&self, mesh: u32) -> u64 {
        let mesh = &self.list[mesh as usize];
        mesh.indices.len().max(mesh.positions.len()) as u64 / 3
    }

    fn primitive(
        &mut self,
        primitive: &Primitive,
        weights: &[f32],
        joints: Option<&[Mat4]>,
        owner: &str,
    ) -> Result<Option<Mesh>> {
        let Checked::Valid(mode) = primitive.mode else {
            return Err(broken(format!("{owner} has a primitive of unknown mode")));
        };
        if !matches!(mode, Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan) {
            self.counts.points_and_lines += 1;
            return Ok(None);
        }
        let attribute = |semantic| primitive.attributes.get(&Checked::Valid(semantic)).copied();
        let Some(positions) = attribute(Semantic::Positions) else {
            self.counts.without_positions += 1;
            return Ok(None);
        };

        let mut positions = self.vectors(positions, &format!("POSITION of {owner}"))?;
        let count = positions.len();
        let mut normals = match attribute(Semantic::Normals) {
            Some(index) => {
                let role = format!("NORMAL of {owner}");
                let normals = self.vectors(index, &role)?;
                Some(same_length(normals, count, &role)?)
            }
            None => None,
        };
        let indices = match primitive.indices {
            Some(index) => {
                self.accessors.integers::<1>(index, &format!("indices of {owner}"))?.into_iter().flatten().collect()
            }
            None => (0..u32::try_from(count).unwrap_or(u32::MAX)).collect::<Vec<u32>>(),
        };
        if let Some(beyond) = indices.iter().find(|&&index| index as usize >= count) {
            return Err(broken(format!("{owner} has the index {beyond} but only {count} vertices")));
        }
        let mut indices = self.triangle_list(mode, indices);

        let (material, tex_coords) = self.materials.index(primitive.material, owner)?;
        let mut uvs = match tex_coords {
            Some(TexCoords { set, transform }) => match attribute(Semantic::TexCoords(set)) {
                Some(index) => {
                    let role = format!("TEXCOORD_{set} of {owner}");
                    let uvs = same_length(self.accessors.floats(index, &role)?, count, &role)?;
                    uvs.into_iter().map(|uv| transform.transform_point2(Vec2::from_array(uv))).collect()
                }
                None => {
                    self.counts.without_uvs += 1;
                    vec![Vec2::ZERO; count]
                }
            },
            None => vec![Vec2::ZERO; count],
        };
        let mut mended = false;
        for uv in uvs.iter_mut().filter(|uv| !uv.is_finite()) {
            *uv = Vec2::ZERO;
            mended = true;
        }
        self.counts.mended_uvs += usize::from(mended);
        self.counts.vertex_colors += usize::from(attribute(Semantic::Colors(0)).is_some());

        if let Some(targets) = &primitive.targets {
            self.counts.morphed += 1;
            for (target, &weight) in targets.iter().zip(weights) {
                self.morph(target, weight, &mut positions, normals.as_deref_mut(), owner)?;
            }
        }
        if let Some(joints) = joints {
            let blend = self.blend(primitive, joints, count, owner)?;
            for (position, matrix) in positions.iter_mut().zip(&blend) {
                *position = matrix.transform_point3(*position);
            }
            for (normal, matrix) in normals.iter_mut().flatten().zip(&blend) {
                *normal = Mat3::from_mat4(*matrix).inverse().transpose() * *normal;
            }
            // No node is left whose determinant would tell that the triangles are mirrored.
            for triangle in indices.chunks_exact_mut(3) {
                if blend[triangle[0] as usize].determinant() < 0.0 {
                    triangle.swap(1, 2);
                }
            }
            self.counts.skinned += 1;
        }
        if let Some(at) = positions.iter().position(|position| !position.is_finite()) {
            return Err(broken(format!("the position of vertex {at} of {owner} is not finite")));
        }

        let all = indices.len();
        drop_degenerate(&positions, &mut indices);
        self.counts.degenerate += (all - indices.len()) / 3;
        if indices.is_empty() {
            return Ok(None);
        }
        let normals = match normals {
            Some(mut normals) => {
                self.counts.mended_normals += usize::from(mend_normals(&positions, &indices, &mut normals));
                normals
            }
            None => {
                // Flat shading: each corner its own vertex.
                positions = indices.iter().map(|&i| positions[i as usize]).collect();
                uvs = indices.iter().map(|&i| uvs[i as usize]).collect();
                indices = (0..indices.len() as u32).collect();
                positions.chunks_exact(3).flat_map(|p| [flat_normal(p); 3]).collect()
            }
        };
        Ok(Some(Mesh { positions, normals, uvs, indices, material }))
    }

    fn vectors(&self, index: Index<Accessor>, role: &str) -> Result<Vec<Vec3>> {
        Ok(self.accessors.floats(index, role)?.into_iter().map(Vec3::from_array).collect())
    }

    fn triangle_list(&mut self, mode: Mode, mut indices: Vec<u32>) -> Vec<u32> {
        match mode {
            Mode::TriangleStrip => {
                let triangles = indices.windows(3).enumerate();
                triangles.flat_map(|(i, v)| if i % 2 == 0 { [v[0], v[1], v[2]] } else { [v[0], v[2], v[1]] }).collect()
            }
            Mode::TriangleFan => {
                let edges = indices.get(1..).unwrap_or_default().windows(2);
                edges.flat_map(|edge| [edge[0], edge[1], indices[0]]).collect()
            }
            _ => {
                self.counts.incomplete += usize::from(!indices.len().is_multiple_of(3));
                indices.truncate(indices.len() / 3 * 3);
                indices
            }
        }
    }

    /// Adds a morph target's offsets.
    fn morph(
        &self,
        target: &MorphTarget,
        weight: f32,
        positions: &mut [Vec3],
        normals: Option<&mut [Vec3]>,
        owner: &str,
    ) -> Result<()> {
        if weight == 0.0 {
            return Ok(());
        }
        let parts = [(target.positions, Some(positions)), (target.normals, normals)];
        for part in parts {
            let (Some(index), Some(values)) = part else { continue };
            let role = format!("morph target of {owner}");
            let offsets = same_length(self.vectors(index, &role)?, values.len(), &role)?;
            for (value, offset) in values.iter_mut().zip(offsets) {
                *value += weight * offset;
            }
        }
        Ok(())
    }

    /// The matrix of each vertex of a skinned primitive.
    fn blend(&self, primitive: &Primitive, joints: &[Mat4], count: usize, owner: &str) -> Result<Vec<Mat4>> {
        let mut sum = vec![Mat4::ZERO; count];
        let mut total = vec![0.0; count];
        for set in 0.. {
            let attribute = |semantic| primitive.attributes.get(&Checked::Valid(semantic)).copied();
            let (Some(indices), Some(weights)) = (attribute(Semantic::Joints(set)), attribute(Semantic::Weights(set)))
            else {
                break;
            };
            let role = format!("JOINTS_{set} of {owner}");
            let indices = same_length(self.accessors.integers::<4>(indices, &role)?, count, &role)?;
            let role = format!("WEIGHTS_{set} of {owner}");
            let weights = same_length(self.accessors.floats::<4>(weights, &role)?, count, &role)?;
            for (vertex, (indices, weights)) in indices.into_iter().zip(weights).enumerate() {
                for (joint, weight) in indices.into_iter().zip(weights) {
                    if weight == 0.0 {
                        continue;
                    }
                    let Some(matrix) = joints.get(joint as usize) else {
                        return Err(broken(format!(
                            "{owner} uses joint {joint} of a skin with {} joints",
                            joints.len()
                        )));
                    };
                    sum[vertex] += *matrix * weight;
                    total[vertex] += weight;
                }
            }
        }
        for (matrix, total) in sum.iter_mut().zip(total) {
            // A vertex without weights goes with the first joint.
            *matrix = if total == 0.0 { joints[0] } else { *matrix * (1.0 / total) };
        }
        Ok(sum)
    }
}

fn same_length<T>(values: Vec<T>, count: usize, role: &str) -> Result<Vec<T>> {
    if values.len() == count {
        return Ok(values);
    }
    Err(broken(format!("{role} has {} values for {count} vertices", values.len())))
}

/// The front face's normal; its length is twice the area. In 64 bits, so that tiny triangles keep theirs.
fn scaled_normal(a: Vec3, b: Vec3, c: Vec3) -> glam::DVec3 {
    let [a, b, c] = [a, b, c].map(Vec3::as_dvec3);
    (b - a).cross(c - a)
}

fn flat_normal(corners: &[Vec3]) -> Vec3 {
    scaled_normal(corners[0], corners[1], corners[2]).normalize_or(glam::DVec3::Y).as_vec3()
}

/// Removes triangles without area.
fn drop_degenerate(positions: &[Vec3], indices: &mut Vec<u32>) {
    let mut kept = 0;
    for i in (0..indices.len()).step_by(3) {
        let corners = [indices[i], indices[i + 1], indices[i + 2]];
        let [a, b, c] = corners.map(|index| positions[index as usize]);
        if scaled_normal(a, b, c) != glam::DVec3::ZERO {
            indices[kept..kept + 3].copy_from_slice(&corners);
            kept += 3;
        }
    }
    indices.truncate(kept);
}

/// Makes all normals unit length, with the mean of the faces around where one has no direction.
/// `true` if there was one.
fn mend_normals(positions: &[Vec3], indices: &[u32], normals: &mut [Vec3]) -> bool {
    let mut bad = false;
    for normal in normals.iter_mut() {
        *normal = normal.try_normalize().unwrap_or(Vec3::ZERO);
        bad |= *normal == Vec3::ZERO;
    }
    if !bad {
        return false;
    }
    let mut means = HashMap::new();
    for triangle in indices.chunks_exact(3) {
        let [a, b, c] = [triangle[0], triangle[1], triangle[2]].map(|index| positions[index as usize]);
        for &index in triangle {
            if normals[index as usize] == Vec3::ZERO {
                *means.entry(index).or_insert(glam::DVec3::ZERO) += scaled_normal(a, b, c);
            }
        }
    }
    let used = !means.is_empty();
    for (index, normal) in normals.iter_mut().enumerate() {
        if *normal == Vec3::ZERO {
            let mean = means.get(&(index as u32)).copied().unwrap_or_default();
            *normal = mean.try_normalize().unwrap_or(glam::DVec3::Y).as_vec3();
        }
    }
    used
}
