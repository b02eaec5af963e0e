//! Key frames for nodes.

use super::accessors::Accessors;
use super::{broken, get, name_of};
use crate::scene::{Animation, Channel, Interpolation, Local, Node, Property};
use ::gltf::json::animation as file;
use ::gltf::json::validation::Checked;
use ::gltf::json::{Index, Root};
use anyhow::Result;
use glam::{Quat, Vec4};

/// Channels that are left out, for the notes.
#[derive(Default)]
pub struct Skipped {
    /// Morph weights.
    pub weights: usize,
    /// Properties that are not a node's transform, and nodes with a matrix.
    pub others: usize,
}

/// Reads all animations of nodes that are in the scene; `scene_nodes` maps the file's nodes to it.
pub fn read(
    root: &Root,
    accessors: &Accessors,
    scene_nodes: &[Option<u32>],
    nodes: &[Node],
) -> Result<(Vec<Animation>, Skipped)> {
    let mut animations = Vec::new();
    let mut skipped = Skipped::default();
    for (index, animation) in root.animations.iter().enumerate() {
        let owner = format!("animation {index}{}", name_of(animation.name.as_deref()));
        let mut channels = Vec::new();
        for channel in &animation.channels {
            let target = channel.target.node;
            get(&root.nodes, target, "node", &owner)?;
            let property = match channel.target.path {
                Checked::Valid(file::Property::Translation) => Property::Translation,
                Checked::Valid(file::Property::Rotation) => Property::Rotation,
                Checked::Valid(file::Property::Scale) => Property::Scale,
                Checked::Valid(file::Property::MorphTargetWeights) => {
                    skipped.weights += 1;
                    continue;
                }
                Checked::Invalid => {
                    skipped.others += 1;
                    continue;
                }
            };
            let Some(node) = scene_nodes[target.value()] else { continue };
            if matches!(nodes[node as usize].local, Local::Matrix(_)) {
                skipped.others += 1;
                continue;
            }
            let sampler = get(&animation.samplers, channel.sampler, "sampler", &owner)?;
            channels.extend(read_channel(accessors, sampler, node, property, &owner)?);
        }
        if !channels.is_empty() {
            let name = animation.name.clone().unwrap_or_else(|| format!("animation {index}"));
            animations.push(Animation { name, channels });
        }
    }
    Ok((animations, skipped))
}

/// `None` if the channel has no keys.
fn read_channel(
    accessors: &Accessors,
    sampler: &file::Sampler,
    node: u32,
    property: Property,
    owner: &str,
) -> Result<Option<Channel>> {
    let interpolation = match sampler.interpolation {
        Checked::Valid(file::Interpolation::Step) => Interpolation::Step,
        Checked::Valid(file::Interpolation::Linear) => Interpolation::Linear,
        Checked::Valid(file::Interpolation::CubicSpline) => Interpolation::CubicSpline,
        Checked::Invalid => return Err(broken(format!("{owner} has an unknown interpolation"))),
    };
    let times = accessors.floats::<1>(sampler.input, &format!("times of {owner}"))?;
    let times: Vec<f32> = times.into_iter().flatten().collect();
    if times.iter().any(|time| !time.is_finite()) || !times.is_sorted() {
        return Err(broken(format!("the times of {owner} do not ascend")));
    }
    let values = outputs(accessors, sampler.output, property, &format!("values of {owner}"))?;
    let per_time = if interpolation == Interpolation::CubicSpline { 3 } else { 1 };
    if values.len() != times.len() * per_time {
        return Err(broken(format!("{owner} has {} values for {} times", values.len(), times.len())));
    }
    if values.iter().any(|value| !value.is_finite()) {
        return Err(broken(format!("{owner} has values that are not finite")));
    }
    // Of keys at the same time the first stays, so that no interval is empty.
    let kept: Vec<usize> = (0..times.len()).filter(|&i| i == 0 || times[i] > times[i - 1]).collect();
    let mut values: Vec<Vec4> = kept.iter().flat_map(|&i| &values[i * per_time..(i + 1) * per_time]).copied().collect();
    if property == Property::Rotation && per_time == 1 {
        for value in &mut values {
            *value = value.try_normalize().unwrap_or(Quat::IDENTITY.into());
        }
    }
    let times: Vec<f32> = kept.into_iter().map(|i| times[i]).collect();
    Ok((!times.is_empty()).then_some(Channel { node, property, interpolation, times, values }))
}

fn outputs(
    accessors: &Accessors,
    index: Index<::gltf::json::Accessor>,
    property: Property,
    role: &str,
) -> Result<Vec<Vec4>> {
    if property == Property::Rotation {
        return Ok(accessors.floats::<4>(index, role)?.into_iter().map(Vec4::from_array).collect());
    }
    Ok(accessors.floats::<3>(index, role)?.into_iter().map(|[x, y, z]| Vec4::new(x, y, z, 0.0)).collect())
}
