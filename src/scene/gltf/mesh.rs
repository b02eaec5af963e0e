//! Mesh primitives to triangle lists.

use super::accessors::Accessors;
use super::material::{Materials, TexCoords};
use super::{MAX_TRIANGLES, broken, get, name_of, too_many};
use crate::scene::{Mesh, Offset, Skinning};
use ::gltf::json::accessor::Accessor;
use ::gltf::json::mesh::{Mode, MorphTarget, Primitive, Semantic};
use ::gltf::json::validation::Checked;
use ::gltf::json::{Index, Node, Root};
use anyhow::{Result, anyhow};
use glam::{DVec3, Vec2, Vec3, Vec4};
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
}

/// The meshes met so far.
pub struct Meshes<'a> {
    root: &'a Root,
    accessors: &'a Accessors<'a>,
    pub materials: Materials<'a>,
    pub list: Vec<Mesh>,
    pub counts: Counts,
    /// Vertices in `list`, and what morph targets and skins hold of them.
    stored: u64,
    deforming: u64,
    /// The scene's meshes of a mesh of the file, with or without a skin.
    shared: HashMap<(usize, bool), Vec<u32>>,
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
            deforming: 0,
            shared: HashMap::new(),
        }
    }

    /// The scene's meshes for a node, and the weights of their morph targets; `joints`: how many its skin has, if it has one.
    pub fn of_node(&mut self, node: &Node, joints: Option<usize>, owner: &str) -> Result<(Vec<u32>, Vec<f32>)> {
        let Some(index) = node.mesh else { return Ok(Default::default()) };
        let mesh = get(&self.root.meshes, index, "mesh", owner)?;
        let owner = format!("mesh {index}{}", name_of(mesh.name.as_deref()));
        let shared = (index.value(), joints.is_some());
        if !self.shared.contains_key(&shared) {
            let first = self.list.len() as u32;
            for primitive in &mesh.primitives {
                if let Some(mesh) = self.primitive(primitive, joints.is_some(), &owner)? {
                    self.stored += mesh.positions.len() as u64;
                    self.list.push(mesh);
                }
                if self.stored > 3 * MAX_TRIANGLES {
                    return Err(too_many(self.stored / 3));
                }
            }
            self.shared.insert(shared, (first..self.list.len() as u32).collect());
        }
        let list = self.shared[&shared].clone();
        let mut targets = 0;
        for mesh in list.iter().map(|mesh| &self.list[*mesh as usize]) {
            targets = targets.max(mesh.targets.len());
            let most =
                mesh.skinning.iter().flat_map(|skinning| &skinning.joints).map(|(joint, _)| *joint as usize).max();
            if let (Some(joint), Some(joints)) = (most, joints)
                && joint >= joints
            {
                return Err(broken(format!("{owner} uses joint {joint} of a skin with {joints} joints")));
            }
        }
        let mut weights = node.weights.as_ref().or(mesh.weights.as_ref()).cloned().unwrap_or_default();
        weights.resize(targets, 0.0);
        if weights.iter().any(|weight| !weight.is_finite()) {
            return Err(broken(format!("the weights of the morph targets of {owner} are not finite")));
        }
        Ok((list, weights))
    }

    /// About how many triangles of memory one of `list` takes: one with more vertices than it uses takes as much as if it
    /// used them.
    pub fn weight(&self, mesh: u32) -> u64 {
        let mesh = &self.list[mesh as usize];
        mesh.indices.len().max(mesh.positions.len()) as u64 / 3
    }

    fn primitive(&mut self, primitive: &Primitive, skinned: bool, owner: &str) -> Result<Option<Mesh>> {
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
        let normals = match attribute(Semantic::Normals) {
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
        let mut colors = match attribute(Semantic::Colors(0)) {
            Some(index) => {
                let role = format!("COLOR_0 of {owner}");
                same_length(self.accessors.colors(index, &role)?, count, &role)?
            }
            None => Vec::new(),
        };

        if let Some(at) = positions.iter().position(|position| !position.is_finite()) {
            return Err(broken(format!("the position of vertex {at} of {owner} is not finite")));
        }

        let mut targets = Vec::new();
        for target in primitive.targets.iter().flatten() {
            targets.push(self.target(target, count, owner)?);
        }
        let mut skinning = if skinned { Some(self.skinning(primitive, count, owner)?) } else { None };

        let all = indices.len();
        let deforms = skinned || targets.iter().any(|target| !target.is_empty());
        drop_degenerate(&positions, &mut indices, deforms);
        self.counts.degenerate += (all - indices.len()) / 3;
        if indices.is_empty() {
            return Ok(None);
        }
        let flat = normals.is_none();
        let normals = match normals {
            Some(mut normals) => {
                self.counts.mended_normals += usize::from(mend_normals(&positions, &indices, &mut normals));
                for (target, file) in targets.iter_mut().zip(primitive.targets.iter().flatten()) {
                    if file.normals.is_none() && !target.is_empty() {
                        turn_normals(target, &positions, &normals, &indices);
                    }
                }
                normals
            }
            None => {
                // Flat shading: each corner its own vertex.
                for target in &mut targets {
                    *target = of_corners(target, count, &indices);
                    self.deforms(target.len())?;
                }
                if let Some(shared) = &skinning {
                    let of = |&corner: &u32| shared.of(corner as usize);
                    self.deforms(indices.iter().map(|corner| of(corner).len()).sum())?;
                    let mut own = Skinning::default();
                    for corner in &indices {
                        own.joints.extend(of(corner));
                        own.ends.push(own.joints.len() as u32);
                    }
                    skinning = Some(own);
                }
                positions = indices.iter().map(|&i| positions[i as usize]).collect();
                uvs = indices.iter().map(|&i| uvs[i as usize]).collect();
                if !colors.is_empty() {
                    colors = indices.iter().map(|&i| colors[i as usize]).collect::<Vec<Vec4>>();
                }
                indices = (0..indices.len() as u32).collect();
                positions.chunks_exact(3).flat_map(|p| [flat_normal(p); 3]).collect()
            }
        };
        Ok(Some(Mesh { positions, normals, uvs, colors, indices, material, flat, targets, skinning }))
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

    /// What a morph target moves.
    fn target(&mut self, target: &MorphTarget, count: usize, owner: &str) -> Result<Vec<Offset>> {
        let role = format!("morph target of {owner}");
        let read = |index: Option<Index<Accessor>>| match index {
            Some(index) => same_length(self.vectors(index, &role)?, count, &role).map(Some),
            None => Ok(None),
        };
        let (positions, normals) = (read(target.positions)?, read(target.normals)?);
        let at = |list: &Option<Vec<Vec3>>, i: usize| list.as_ref().map_or(Vec3::ZERO, |list| list[i]);
        let all = (0..count).map(|i| (i, at(&positions, i), at(&normals, i)));
        if let Some((vertex, ..)) =
            all.clone().find(|(_, position, normal)| !(position.is_finite() && normal.is_finite()))
        {
            return Err(broken(format!("the {role} moves vertex {vertex} by what is not finite")));
        }
        let moved = all.filter(|(_, position, normal)| (*position, *normal) != (Vec3::ZERO, Vec3::ZERO));
        let offsets: Vec<Offset> =
            moved.map(|(i, position, normal)| Offset { vertex: i as u32, position, normal }).collect();
        self.deforms(offsets.len())?;
        Ok(offsets)
    }

    /// The joints of the vertices of a skinned primitive.
    fn skinning(&mut self, primitive: &Primitive, count: usize, owner: &str) -> Result<Skinning> {
        let mut sets = Vec::new();
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
            if weights.iter().flatten().any(|weight| !weight.is_finite()) {
                return Err(broken(format!("{role} has weights that are not finite")));
            }
            self.deforms(count)?;
            sets.push((indices, weights));
        }
        let mut skinning = Skinning::default();
        for vertex in 0..count {
            let start = skinning.joints.len();
            let of_sets = sets.iter().flat_map(|(joints, weights)| joints[vertex].into_iter().zip(weights[vertex]));
            skinning.joints.extend(of_sets.filter(|(_, weight)| *weight != 0.0));
            // A vertex without weights goes with the first joint.
            if skinning.joints[start..].iter().map(|(_, weight)| f64::from(*weight)).sum::<f64>() == 0.0 {
                skinning.joints.truncate(start);
                skinning.joints.push((0, 1.0));
            }
            skinning.ends.push(skinning.joints.len() as u32);
        }
        Ok(skinning)
    }

    /// Counts what morph targets and skins hold, and refuses too much of it.
    fn deforms(&mut self, more: usize) -> Result<()> {
        self.deforming += more as u64;
        if self.deforming <= MAX_TRIANGLES {
            return Ok(());
        }
        Err(anyhow!(
            "its morph targets and skins move {} vertices, more than the {MAX_TRIANGLES} that are kept; simplify it first",
            self.deforming
        ))
    }
}

fn same_length<T>(values: Vec<T>, count: usize, role: &str) -> Result<Vec<T>> {
    if values.len() == count {
        return Ok(values);
    }
    Err(broken(format!("{role} has {} values for {count} vertices", values.len())))
}

/// The front face's normal; its length is twice the area. In 64 bits, so that tiny triangles keep theirs.
fn scaled_normal(a: Vec3, b: Vec3, c: Vec3) -> DVec3 {
    let [a, b, c] = [a, b, c].map(Vec3::as_dvec3);
    (b - a).cross(c - a)
}

fn flat_normal(corners: &[Vec3]) -> Vec3 {
    scaled_normal(corners[0], corners[1], corners[2]).normalize_or(DVec3::Y).as_vec3()
}

/// Removes triangles without area; of a mesh that deforms those that have none in any pose, as a corner stands in them twice.
fn drop_degenerate(positions: &[Vec3], indices: &mut Vec<u32>, deforms: bool) {
    let mut kept = 0;
    for i in (0..indices.len()).step_by(3) {
        let corners = [indices[i], indices[i + 1], indices[i + 2]];
        let [a, b, c] = corners.map(|index| positions[index as usize]);
        let twice = corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0];
        if !twice && (deforms || scaled_normal(a, b, c) != DVec3::ZERO) {
            indices[kept..kept + 3].copy_from_slice(&corners);
            kept += 3;
        }
    }
    indices.truncate(kept);
}

/// A morph target of a mesh whose triangles' corners become vertices of their own.
fn of_corners(target: &[Offset], count: usize, indices: &[u32]) -> Vec<Offset> {
    let mut of_vertex = vec![None; count];
    target.iter().for_each(|offset| of_vertex[offset.vertex as usize] = Some(offset));
    let corners = indices.iter().zip(0..).filter_map(|(&i, corner)| Some((of_vertex[i as usize]?, corner)));
    corners.map(|(offset, vertex)| Offset { vertex, ..*offset }).collect()
}

/// Gives a morph target without normals the offsets by which the means of the faces around each vertex turn. Vertices that
/// only texture coordinates part have the same faces around them.
fn turn_normals(target: &mut Vec<Offset>, positions: &[Vec3], normals: &[Vec3], indices: &[u32]) {
    let mut offsets = vec![Vec3::ZERO; positions.len()];
    target.iter().for_each(|offset| offsets[offset.vertex as usize] = offset.position);
    let moved: Vec<Vec3> = positions.iter().zip(&offsets).map(|(position, offset)| *position + *offset).collect();
    let mut places = HashMap::new();
    let place =
        |vertex: usize| (positions[vertex].to_array().map(f32::to_bits), normals[vertex].to_array().map(f32::to_bits));
    let first: Vec<u32> = (0..positions.len()).map(|i| *places.entry(place(i)).or_insert(i as u32)).collect();
    // What the faces around a vertex span before and after.
    let mut sums = vec![[DVec3::ZERO; 2]; positions.len()];
    for triangle in indices.chunks_exact(3) {
        for (positions, side) in [(positions, 0), (&moved[..], 1)] {
            let [a, b, c] = [triangle[0], triangle[1], triangle[2]].map(|index| positions[index as usize]);
            let face = scaled_normal(a, b, c);
            triangle.iter().for_each(|index| sums[first[*index as usize] as usize][side] += face);
        }
    }
    let all = (0..).zip(offsets.into_iter().zip(&first)).filter_map(|(vertex, (position, first))| {
        let [before, after] = sums[*first as usize].map(DVec3::normalize_or_zero);
        let normal = (after - before).as_vec3();
        ((position, normal) != (Vec3::ZERO, Vec3::ZERO)).then_some(Offset { vertex, position, normal })
    });
    *target = all.collect();
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
                *means.entry(index).or_insert(DVec3::ZERO) += scaled_normal(a, b, c);
            }
        }
    }
    let used = !means.is_empty();
    for (index, normal) in normals.iter_mut().enumerate() {
        if *normal == Vec3::ZERO {
            let mean = means.get(&(index as u32)).copied().unwrap_or_default();
            *normal = mean.try_normalize().unwrap_or(DVec3::Y).as_vec3();
        }
    }
    used
}
