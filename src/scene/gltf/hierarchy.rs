//! The file's node hierarchy, checked to be trees.

use super::{Transform, broken, get, name_of};
use crate::scene::Local;
use ::gltf::json::Root;
use anyhow::Result;
use glam::{DMat4, DQuat, DVec3};

/// The file's nodes, by their index in the file.
pub struct Hierarchy {
    pub parents: Vec<Option<usize>>,
    pub locals: Vec<Local>,
    /// The nodes of the drawn scene, parents before their children.
    pub scene: Vec<usize>,
}

impl Hierarchy {
    /// `transforms` are those of the file's nodes.
    pub fn new(root: &Root, transforms: &[Transform]) -> Result<Self> {
        let count = root.nodes.len();
        let mut parents = vec![None; count];
        for (index, node) in root.nodes.iter().enumerate() {
            for child in node.children.iter().flatten() {
                get(&root.nodes, *child, "node", &label(root, index))?;
                if let Some(other) = parents[child.value()].replace(index) {
                    return Err(broken(format!(
                        "{} has two parents, nodes {other} and {index}",
                        label(root, child.value())
                    )));
                }
            }
        }
        let tops = (0..count).filter(|&index| parents[index].is_none());
        let order = descend(root, tops.clone().collect());
        if order.len() < count {
            // With one parent each, what no root leads to hangs in a ring.
            let mut reached = vec![false; count];
            order.iter().for_each(|&index| reached[index] = true);
            let lost = reached.iter().position(|reached| !reached).unwrap_or_default();
            return Err(broken(format!("{} is its own ancestor: the hierarchy has a cycle", label(root, lost))));
        }

        let mut locals = Vec::with_capacity(count);
        for (index, transform) in transforms.iter().enumerate() {
            locals.push(
                local(transform)
                    .ok_or_else(|| broken(format!("the transform of {} is not finite", label(root, index))))?,
            );
        }
        let mut world = vec![DMat4::IDENTITY; count];
        for index in order {
            let parent = parents[index].map_or(DMat4::IDENTITY, |parent| world[parent]);
            world[index] = parent * locals[index].matrix();
            if !world[index].as_mat4().is_finite() {
                return Err(broken(format!(
                    "the transforms down to {} leave the range of 32-bit floats",
                    label(root, index)
                )));
            }
        }

        let tops = match root.scene.map_or(0, |scene| scene.value()) {
            scene if scene < root.scenes.len() => {
                let owner = format!("scene {scene}");
                let nodes = &root.scenes[scene].nodes;
                for node in nodes {
                    get(&root.nodes, *node, "node", &owner)?;
                }
                nodes.iter().map(|node| node.value()).collect()
            }
            scene if root.scene.is_some() => {
                return Err(broken(format!(
                    "its default scene is scene {scene}, but the file has {}",
                    root.scenes.len()
                )));
            }
            _ => tops.collect::<Vec<_>>(),
        };
        // A node that is listed as a root and hangs below another would be drawn twice.
        let mut listed = vec![false; count];
        for &top in &tops {
            if std::mem::replace(&mut listed[top], true) || parents[top].is_some() {
                return Err(broken(format!(
                    "the scene lists {}, which is not a root or stands there twice",
                    label(root, top)
                )));
            }
        }
        Ok(Self { scene: descend(root, tops), parents, locals })
    }
}

/// `tops` and all below them, parents before children.
fn descend(root: &Root, mut tops: Vec<usize>) -> Vec<usize> {
    tops.reverse();
    let mut order = Vec::new();
    while let Some(index) = tops.pop() {
        order.push(index);
        let children = root.nodes[index].children.as_deref().unwrap_or_default();
        tops.extend(children.iter().rev().map(|child| child.value()));
    }
    order
}

/// What messages call a node.
pub fn label(root: &Root, index: usize) -> String {
    format!("node {index}{}", name_of(root.nodes[index].name.as_deref()))
}

/// `None` if a number is not finite as a 32-bit float.
fn local(transform: &Transform) -> Option<Local> {
    if let Some(matrix) = transform.matrix {
        let matrix = DMat4::from_cols_array(&matrix);
        return matrix.as_mat4().is_finite().then_some(Local::Matrix(matrix));
    }
    let translation = transform.translation.map_or(DVec3::ZERO, DVec3::from);
    let scale = transform.scale.map_or(DVec3::ONE, DVec3::from);
    let rotation = transform.rotation.map_or(DQuat::IDENTITY, DQuat::from_array);
    if !(translation.as_vec3().is_finite() && scale.as_vec3().is_finite() && rotation.as_quat().is_finite()) {
        return None;
    }
    let length = rotation.length();
    let rotation = if length > 0.0 && length.is_finite() { rotation * (1.0 / length) } else { DQuat::IDENTITY };
    Some(Local::Trs { translation, rotation, scale })
}
