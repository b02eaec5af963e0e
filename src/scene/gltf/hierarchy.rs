//! The file's node hierarchy, checked to be trees.

use super::{broken, get, name_of};
use crate::scene::Local;
use ::gltf::json::{Node, Root};
use anyhow::Result;
use glam::{Mat4, Quat, Vec3};

/// The file's nodes, by their index in the file.
pub struct Hierarchy {
    pub parents: Vec<Option<usize>>,
    pub locals: Vec<Local>,
    /// World matrices at the file's pose.
    pub world: Vec<Mat4>,
    /// The nodes of the drawn scene, parents before their children.
    pub scene: Vec<usize>,
}

impl Hierarchy {
    pub fn new(root: &Root) -> Result<Self> {
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
        for (index, node) in root.nodes.iter().enumerate() {
            locals.push(
                local(node).ok_or_else(|| broken(format!("the transform of {} is not finite", label(root, index))))?,
            );
        }
        let mut world = vec![Mat4::IDENTITY; count];
        for index in order {
            let parent = parents[index].map_or(Mat4::IDENTITY, |parent| world[parent]);
            world[index] = parent * locals[index].matrix();
            if !world[index].is_finite() {
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
        Ok(Self { scene: descend(root, tops), parents, locals, world })
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

/// `None` if a number is not finite.
fn local(node: &Node) -> Option<Local> {
    if let Some(matrix) = node.matrix {
        let matrix = Mat4::from_cols_array(&matrix);
        return matrix.is_finite().then_some(Local::Matrix(matrix));
    }
    let translation = node.translation.map_or(Vec3::ZERO, Vec3::from);
    let scale = node.scale.map_or(Vec3::ONE, Vec3::from);
    let rotation = node.rotation.map_or(Quat::IDENTITY, |rotation| Quat::from_array(rotation.0));
    if !(translation.is_finite() && scale.is_finite() && rotation.is_finite()) {
        return None;
    }
    let rotation = unit(rotation);
    Some(Local::Trs { translation, rotation, scale })
}

/// The rotation of unit length; none if it has no direction.
pub fn unit(rotation: Quat) -> Quat {
    let length = rotation.length();
    if length > 0.0 && length.is_finite() { rotation * (1.0 / length) } else { Quat::IDENTITY }
}
