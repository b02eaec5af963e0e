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
    /// Weights of nodes without morph targets.
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
            let Checked::Valid(property) = channel.target.path else {
                skipped.others += 1;
                continue;
            };
            let Some(node) = scene_nodes[target.value()] else { continue };
            let targets = nodes[node as usize].weights.len();
            if property == file::Property::MorphTargetWeights {
                if targets == 0 {
                    skipped.weights += 1;
                    continue;
                }
            } else if matches!(nodes[node as usize].local, Local::Matrix(_)) {
                skipped.others += 1;
                continue;
            }
            let sampler = get(&animation.samplers, channel.sampler, "sampler", &owner)?;
            channels.extend(read_channel(accessors, sampler, node, (property, targets), &owner)?);
        }
        if !channels.is_empty() {
            let name = animation.name.clone().unwrap_or_else(|| format!("animation {index}"));
            animations.push(Animation { name, channels });
        }
    }
    Ok((animations, skipped))
}

/// A channel of the file: of weights one for each morph target, else a single one; none without keys.
fn read_channel(
    accessors: &Accessors,
    sampler: &file::Sampler,
    node: u32,
    (property, targets): (file::Property, usize),
    owner: &str,
) -> Result<Vec<Channel>> {
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
    // The weights of all targets stand behind each other, key by key.
    let width = match property {
        file::Property::MorphTargetWeights => values.len() / (times.len() * per_time).max(1),
        _ => 1,
    };
    if values.len() != times.len() * per_time * width || width == 0 && !times.is_empty() {
        return Err(broken(format!("{owner} has {} values for {} times", values.len(), times.len())));
    }
    if values.iter().any(|value| !value.is_finite()) {
        return Err(broken(format!("{owner} has values that are not finite")));
    }
    // Of keys at the same time the first stays, so that no interval is empty.
    let kept: Vec<usize> = (0..times.len()).filter(|&i| i == 0 || times[i] > times[i - 1]).collect();
    let times: Vec<f32> = kept.iter().map(|&i| times[i]).collect();
    if times.is_empty() {
        return Ok(Vec::new());
    }
    let channel = |property: Property, column: usize| {
        let rows = kept.iter().flat_map(|&i| i * per_time..(i + 1) * per_time);
        let mut values: Vec<Vec4> = rows.map(|row| values[row * width + column]).collect();
        if property == Property::Rotation && per_time == 1 {
            for value in &mut values {
                *value = value.try_normalize().unwrap_or(Quat::IDENTITY.into());
            }
        }
        Channel { node, property, interpolation, times: times.clone(), values }
    };
    Ok(match property {
        file::Property::Translation => vec![channel(Property::Translation, 0)],
        file::Property::Rotation => vec![channel(Property::Rotation, 0)],
        file::Property::Scale => vec![channel(Property::Scale, 0)],
        file::Property::MorphTargetWeights => {
            (0..width.min(targets)).map(|target| channel(Property::Weight(target as u32), target)).collect()
        }
    })
}

fn outputs(
    accessors: &Accessors,
    index: Index<::gltf::json::Accessor>,
    property: file::Property,
    role: &str,
) -> Result<Vec<Vec4>> {
    Ok(match property {
        file::Property::Rotation => accessors.floats::<4>(index, role)?.into_iter().map(Vec4::from_array).collect(),
        file::Property::MorphTargetWeights => {
            accessors.floats::<1>(index, role)?.into_iter().map(|[weight]| Vec4::X * weight).collect()
        }
        _ => accessors.floats::<3>(index, role)?.into_iter().map(|[x, y, z]| Vec4::new(x, y, z, 0.0)).collect(),
    })
}
