//! Where a scene's nodes, morph targets and skins stand at a moment of its clock.

use super::{Channel, Clock, Interpolation, Local, Mesh, Property, Scene};
use glam::{DMat3, DMat4, DQuat, DVec3, DVec4, Vec3};
use rayon::prelude::*;
use std::collections::HashMap;
use std::sync::Arc;

/// The nodes' matrices to scene space at `time` seconds of animation `clip`; without one as the file has them.
pub fn world_matrices(scene: &Scene, clip: Option<usize>, time: f32) -> Vec<DMat4> {
    let mut locals: Vec<Local> = scene.nodes.iter().map(|n| n.local).collect();
    for channel in channels(scene, clip) {
        animate(&mut locals[channel.node as usize], channel, time);
    }
    let top = top(scene);
    let mut worlds: Vec<DMat4> = Vec::with_capacity(locals.len());
    for (node, local) in scene.nodes.iter().zip(locals) {
        let parent = node.parent.map_or(top, |p| worlds[p as usize]);
        worlds.push(parent * local.matrix());
    }
    worlds
}

/// The matrix of a single node, bit for bit as [`world_matrices`] has it.
pub fn world_matrix(scene: &Scene, node: u32, clock: Clock) -> DMat4 {
    let channels = channels(scene, Some(clock.animation as usize));
    let local = |i: u32| {
        let mut local = scene.nodes[i as usize].local;
        channels.iter().filter(|c| c.node == i).for_each(|c| animate(&mut local, c, clock.time));
        local.matrix()
    };
    let mut up: Vec<u32> = ancestry(scene, node).collect();
    up.reverse();
    up.into_iter().fold(top(scene), |world, i| world * local(i))
}

/// Which nodes one of the scene's animations moves.
pub fn moving(scene: &Scene) -> Vec<bool> {
    let mut moved = vec![false; scene.nodes.len()];
    let channels = scene.animations.iter().flat_map(|a| &a.channels);
    channels.filter(|c| !matches!(c.property, Property::Weight(_))).for_each(|c| moved[c.node as usize] = true);
    for (i, node) in scene.nodes.iter().enumerate() {
        moved[i] |= node.parent.is_some_and(|parent| moved[parent as usize]);
    }
    moved
}

/// A node, its parent and so on.
fn ancestry(scene: &Scene, node: u32) -> impl Iterator<Item = u32> {
    std::iter::successors(Some(node), |i| scene.nodes[*i as usize].parent)
}

/// The origin goes off at the roots, so that what hangs below them is the same bit for bit wherever they stand.
fn top(scene: &Scene) -> DMat4 {
    DMat4::from_translation(-scene.origin)
}

fn channels(scene: &Scene, clip: Option<usize>) -> &[Channel] {
    clip.and_then(|c| scene.animations.get(c)).map(|a| a.channels.as_slice()).unwrap_or_default()
}

fn animate(local: &mut Local, channel: &Channel, time: f32) {
    if let Local::Trs { translation, rotation, scale } = local {
        let v = || sample(channel, time);
        match channel.property {
            Property::Translation => *translation = v().truncate(),
            Property::Rotation => *rotation = DQuat::from_vec4(v()).normalize(),
            Property::Scale => *scale = v().truncate(),
            Property::Weight(_) => {}
        }
    }
}

/// A channel's value at `time`, as the glTF 2.0 specification (appendix C) interpolates it.
fn sample(channel: &Channel, time: f32) -> DVec4 {
    let times = &channel.times;
    let cubic = channel.interpolation == Interpolation::CubicSpline;
    let raw = |i: usize| channel.values[i].as_dvec4();
    let value = |i: usize| raw(if cubic { 3 * i + 1 } else { i });
    let next = times.partition_point(|t| *t <= time);
    if next == 0 || next == times.len() {
        return value(next.saturating_sub(1));
    }
    let (i, span) = (next - 1, (times[next] - times[next - 1]) as f64);
    let t = (time - times[i]) as f64 / span;
    match channel.interpolation {
        Interpolation::Step => value(i),
        Interpolation::Linear if channel.property == Property::Rotation => {
            DQuat::from_vec4(value(i)).normalize().slerp(DQuat::from_vec4(value(next)).normalize(), t).into()
        }
        Interpolation::Linear => value(i).lerp(value(next), t),
        Interpolation::CubicSpline => {
            let (out, into) = (raw(3 * i + 2) * span, raw(3 * next) * span);
            let (t2, t3) = (t * t, t * t * t);
            value(i) * (2.0 * t3 - 3.0 * t2 + 1.0)
                + out * (t3 - 2.0 * t2 + t)
                + value(next) * (3.0 * t2 - 2.0 * t3)
                + into * (t3 - t2)
        }
    }
}

/// A mesh as it is drawn at one place at a moment.
pub struct Placement<'a> {
    /// Index into [`Scene::meshes`].
    pub index: usize,
    pub mesh: &'a Mesh,
    /// The node's matrix to scene space, which a skin leaves out, and whether it mirrors.
    world: (DMat4, bool),
    /// The matrices of the skin's joints, from the bind pose to scene space, and whether they mirror.
    joints: Option<Arc<[(DMat4, bool)]>>,
    /// Positions and normals with the morph targets' offsets, where one has a weight.
    morphed: Option<Arc<Morphed>>,
}

type Morphed = (Vec<DVec3>, Vec<Vec3>);

/// Every mesh as it stands at `time` seconds of animation `clip`, in an order that is the same at any time.
pub fn placements(scene: &Scene, clip: usize, time: f32) -> Vec<Placement<'_>> {
    let worlds = world_matrices(scene, Some(clip), time);
    let mut weights: HashMap<u32, Vec<f32>> = HashMap::new();
    for channel in channels(scene, Some(clip)) {
        if let Property::Weight(target) = channel.property {
            let own = || scene.nodes[channel.node as usize].weights.clone();
            if let Some(weight) = weights.entry(channel.node).or_insert_with(own).get_mut(target as usize) {
                *weight = sample(channel, time).x as f32;
            }
        }
    }
    let signed = |matrix: DMat4| (matrix, matrix.determinant() < 0.0);
    let skins: Vec<Arc<[(DMat4, bool)]>> = (scene.skins.iter())
        .map(|skin| {
            let joints = skin.joints.iter().zip(&skin.inverse_bind);
            joints.map(|(node, inverse_bind)| signed(worlds[*node as usize] * inverse_bind.as_dmat4())).collect()
        })
        .collect();
    let mut placed = Vec::new();
    for (i, (node, world)) in (0..).zip(scene.nodes.iter().zip(&worlds)) {
        let weights = weights.get(&i).unwrap_or(&node.weights);
        for index in &node.meshes {
            let mesh = &scene.meshes[*index as usize];
            let morphed = morphed(mesh, weights).map(Arc::new);
            let place = |world: DMat4| Placement {
                index: *index as usize,
                mesh,
                world: signed(world),
                joints: node.skin.map(|skin| skins[skin as usize].clone()),
                morphed: morphed.clone(),
            };
            if node.instances.is_empty() {
                placed.push(place(*world));
            }
            placed.extend(node.instances.iter().map(|i| place(*world * i.as_dmat4())));
        }
    }
    placed
}

/// `None` where no target has a weight.
fn morphed(mesh: &Mesh, weights: &[f32]) -> Option<Morphed> {
    let targets = || mesh.targets.iter().zip(weights).filter(|(_, weight)| **weight != 0.0);
    targets().next()?;
    let mut positions: Vec<DVec3> = mesh.positions.iter().map(|p| p.as_dvec3()).collect();
    let mut normals = mesh.normals.clone();
    for (target, weight) in targets() {
        for offset in target {
            positions[offset.vertex as usize] += f64::from(*weight) * offset.position.as_dvec3();
            normals[offset.vertex as usize] += *weight * offset.normal;
        }
    }
    Some((positions, normals))
}

impl Placement<'_> {
    /// From the mesh's space, or the bind pose, to scene space at a vertex.
    pub fn matrix(&self, vertex: usize) -> DMat4 {
        match (&self.joints, &self.mesh.skinning) {
            (Some(joints), Some(skinning)) => {
                let (mut sum, mut total) = (DMat4::ZERO, 0.0);
                for (joint, weight) in skinning.of(vertex) {
                    sum += joints[*joint as usize].0 * f64::from(*weight);
                    total += f64::from(*weight);
                }
                sum * (1.0 / total)
            }
            _ => self.world.0,
        }
    }

    /// A vertex before skin and node move it.
    fn rest(&self, vertex: usize) -> DVec3 {
        self.morphed.as_ref().map_or_else(|| self.mesh.positions[vertex].as_dvec3(), |m| m.0[vertex])
    }

    /// A vertex in scene space.
    pub fn position(&self, vertex: usize) -> DVec3 {
        self.matrix(vertex).transform_point3(self.rest(vertex))
    }

    /// The node's matrix alone, where that is all that places the vertices.
    pub fn rigid(&self) -> Option<DMat4> {
        (self.joints.is_none() && self.morphed.is_none()).then_some(self.world.0)
    }

    /// Whether the front of triangles at a vertex is what was their back: the node mirrors them, or the vertex's first joint.
    pub fn mirrors(&self, vertex: usize) -> bool {
        match (&self.joints, &self.mesh.skinning) {
            (Some(joints), Some(skinning)) => joints[skinning.of(vertex)[0].0 as usize].1,
            _ => self.world.1,
        }
    }

    /// All vertices' positions in scene space, and their normals, of any length.
    pub fn posed(&self) -> (Vec<DVec3>, Vec<DVec3>) {
        let vertices = (0..self.mesh.positions.len()).into_par_iter();
        if self.mesh.flat {
            let positions: Vec<DVec3> = vertices.map(|i| self.position(i)).collect();
            let triangles = positions.par_chunks_exact(3).enumerate();
            let normals = triangles.flat_map_iter(|(i, p)| {
                let front = (p[1] - p[0]).cross(p[2] - p[0]);
                [if self.mirrors(3 * i) { -front } else { front }; 3]
            });
            let normals = normals.collect();
            return (positions, normals);
        }
        let normals = self.morphed.as_ref().map_or(&self.mesh.normals, |m| &m.1);
        let posed = vertices.map(|i| {
            let matrix = self.matrix(i);
            // The cofactors: the inverse transpose up to a factor, and finite where a bone is flattened.
            let DMat3 { x_axis: x, y_axis: y, z_axis: z } = DMat3::from_mat4(matrix);
            let normal = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y)) * normals[i].as_dvec3();
            (matrix.transform_point3(self.rest(i)), if self.mirrors(i) { -normal } else { normal })
        });
        posed.unzip()
    }
}
