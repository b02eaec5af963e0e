//! The file's node hierarchy, checked to be trees.

use super::{Transform, broken, counted, get, name_of};
use crate::scene::Local;
use ::gltf::json::{Node, Root};
use anyhow::Result;
use glam::{DMat4, DQuat, DVec3};

/// The file's nodes, by their index in the file.
pub struct Hierarchy {
    pub parents: Vec<Option<usize>>,
    pub locals: Vec<Local>,
    /// The nodes of the scene, and those that these hang below, parents before their children.
    pub scene: Vec<usize>,
    /// Whether what hangs on a node is there: the scene holds it, and neither it nor a node above is invisible
    /// (KHR_node_visibility).
    pub drawn: Vec<bool>,
    /// What the scene lists other than as glTF has it, and what is invisible.
    pub notes: Vec<String>,
}

impl Hierarchy {
    /// `transforms` are those of the file's nodes.
    pub fn new(root: &Root, transforms: &[Transform]) -> Result<Self> {
        let count = root.nodes.len();
        let mut parents = vec![None; count];
        let mut children = vec![Vec::new(); count];
        let mut shared = 0;
        for (index, node) in root.nodes.iter().enumerate() {
            for child in node.children.iter().flatten() {
                get(&root.nodes, *child, "node", &label(root, index))?;
                match &mut parents[child.value()] {
                    Some(_) => shared += 1,
                    parent => {
                        *parent = Some(index);
                        children[index].push(child.value());
                    }
                }
            }
        }
        let tops = (0..count).filter(|&index| parents[index].is_none());
        let order = descend(&children, tops.clone().collect());
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
        for &index in &order {
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
        // Files list nodes that hang below others, and nodes twice: each is drawn once, where the hierarchy has it.
        let mut scene = Vec::with_capacity(order.len());
        let (mut placed, mut listed, mut drawn) = (vec![false; count], vec![false; count], vec![false; count]);
        let mut odd = 0;
        for top in tops {
            odd += usize::from(std::mem::replace(&mut listed[top], true) || parents[top].is_some());
            let mut above = Vec::new();
            let mut parent = parents[top];
            while let Some(index) = parent.filter(|&index| !placed[index]) {
                above.push(index);
                parent = parents[index];
            }
            let mut place = |index: usize| {
                if !std::mem::replace(&mut placed[index], true) {
                    scene.push(index);
                }
            };
            above.into_iter().rev().for_each(&mut place);
            let mut open = vec![top];
            while let Some(index) = open.pop() {
                if !std::mem::replace(&mut drawn[index], true) {
                    place(index);
                    open.extend(children[index].iter().rev());
                }
            }
        }
        let mut hidden = vec![false; count];
        let mut invisible = 0;
        for index in order {
            let own = drawn[index] && !visible(&root.nodes[index]);
            invisible += usize::from(own);
            hidden[index] = own || parents[index].is_some_and(|parent| hidden[parent]);
            drawn[index] &= !hidden[index];
        }
        let notes = [
            counted(
                shared,
                "node is the child of two nodes or of one twice; it hangs below the first alone.",
                "nodes are children of two nodes or of one twice; each hangs below the first alone.",
            ),
            counted(
                odd,
                "node that the scene lists hangs below another or stands there twice; it is drawn once.",
                "nodes that the scene lists hang below others or stand there twice; each is drawn once.",
            ),
            counted(
                invisible,
                "node is invisible and not drawn, with all that hangs below it.",
                "nodes are invisible and not drawn, with all that hangs below them.",
            ),
        ];
        Ok(Self { scene, parents, locals, drawn, notes: notes.into_iter().flatten().collect() })
    }
}

/// What KHR_node_visibility says of a node itself.
fn visible(node: &Node) -> bool {
    let extension = node.extensions.as_ref().and_then(|e| e.others.get("KHR_node_visibility"));
    extension.and_then(|e| e.get("visible")?.as_bool()).unwrap_or(true)
}

/// `tops` and all below them, parents before children.
fn descend(children: &[Vec<usize>], mut tops: Vec<usize>) -> Vec<usize> {
    tops.reverse();
    let mut order = Vec::new();
    while let Some(index) = tops.pop() {
        order.push(index);
        tops.extend(children[index].iter().rev());
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
