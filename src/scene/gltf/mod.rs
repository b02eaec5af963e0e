//! Loads glTF 2.0 files, .gltf and .glb.
//!
//! The `gltf` crate gives the types of the JSON; the buffers are read by our own bounds-checked
//! code, as the crate's readers panic on malformed files.

mod accessors;
mod animation;
mod hierarchy;
mod material;
mod mesh;
mod packed;
mod punctual;
mod uri;

use super::{Node, Scene, Skin, origin, presets};
use crate::files;
use crate::message::{self, counted, list, quoted, shortened};
use ::gltf::json::{self, Index, Root};
use accessors::Accessors;
use anyhow::{Result, anyhow, bail};
use glam::{Mat4, Quat, Vec3};
use hierarchy::{Hierarchy, label};
use mesh::Meshes;
use serde::Deserialize;
use serde_json::{Map, Value};
use std::collections::BTreeSet;
use std::path::Path;

/// About what fits into a graphics card's buffers; sharing and instancing let a small file ask for
/// more than any memory holds.
pub(super) const MAX_TRIANGLES: u64 = 30_000_000;

/// Each takes a matrix, and any number of nodes can share what places them.
const MAX_INSTANCES: u64 = 1 << 22;

/// What we understand beyond plain glTF.
const SUPPORTED: [&str; 11] = [
    "KHR_draco_mesh_compression",
    "KHR_lights_punctual",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_mesh_quantization",
    "KHR_meshopt_compression",
    "KHR_node_visibility",
    "KHR_texture_basisu",
    "KHR_texture_transform",
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "EXT_texture_webp",
];

/// Without these a scene is drawn all the same, though a file may require them; and without what belongs to materials or
/// textures.
const NOT_DRAWN: [&str; 8] = [
    "EXT_instance_features",
    "EXT_mesh_features",
    "EXT_structural_metadata",
    "KHR_animation_pointer",
    "KHR_interactivity",
    "KHR_node_hoverability",
    "KHR_node_selectability",
    "KHR_xmp_json_ld",
];

/// Loads the default scene of a glTF file. Errors are one sentence that names the file.
pub fn load(path: &Path) -> Result<Scene> {
    read(path).map_err(|cause| anyhow!("cannot load {}: {}", path.display(), message::sentence(&cause)))
}

fn read(path: &Path) -> Result<Scene> {
    let data =
        files::read(path, files::MOST_DATA).map_err(|error| anyhow!("{}; check the path", files::reason(&error)))?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let (text, bin) = split(&data)?;
    let (root, transforms) = parse(text)?;
    let mut scene = Scene {
        name: shortened(&path.file_stem().unwrap_or_default().to_string_lossy()),
        notes: check_extensions(&root)?,
        ..Scene::default()
    };
    let hierarchy = Hierarchy::new(&root, &transforms)?;
    let accessors = Accessors::new(&root, bin, folder)?;
    let mut meshes = Meshes::new(&root, &accessors);

    let mut scene_nodes = vec![None; root.nodes.len()];
    let (mut drawn, mut instanced) = (0u64, 0u64);
    let mut skins = Skins { list: Vec::new(), of_file: vec![None; root.skins.len()] };
    for (place, &index) in hierarchy.scene.iter().enumerate() {
        scene_nodes[index] = Some(place as u32);
        let node = &root.nodes[index];
        let owner = label(&root, index);
        let parent = hierarchy.parents[index].and_then(|parent| scene_nodes[parent]);
        let local = hierarchy.locals[index];
        if !hierarchy.drawn[index] {
            scene.nodes.push(Node { parent, local, ..Node::default() });
            continue;
        }
        let skin = node.skin.filter(|_| node.mesh.is_some());
        let skin = skin.map(|index| skins.of_node(&root, &accessors, index, &owner)).transpose()?;
        let joints = skin.map(|skin| skins.list[skin as usize].joints.len());
        let (list, weights) = meshes.of_node(node, joints, &owner)?;
        let mut instances = match node.mesh {
            Some(_) => instances(&root, node, &accessors, &owner, &mut instanced)?.unwrap_or_default(),
            None => Vec::new(),
        };
        if skin.is_some() {
            // The joints alone place a skinned mesh.
            instances.clear();
        }
        // Counted as it grows: nodes share meshes, and a small file can ask for more than any memory holds.
        let once: u64 = list.iter().map(|mesh| meshes.weight(*mesh)).sum();
        drawn = drawn.saturating_add(once.saturating_mul(instances.len().max(1) as u64));
        if drawn > MAX_TRIANGLES {
            return Err(too_many(drawn));
        }
        scene.nodes.push(Node { parent, local, meshes: list, instances, weights, skin });
    }
    scene.skins = skins.list;
    for joint in scene.skins.iter_mut().flat_map(|skin| &mut skin.joints) {
        // Joints may stand outside the drawn scene.
        let mut missing = Vec::new();
        let mut next = Some(*joint as usize);
        while let Some(index) = next.filter(|&index| scene_nodes[index].is_none()) {
            missing.push(index);
            next = hierarchy.parents[index];
        }
        for index in missing.into_iter().rev() {
            scene_nodes[index] = Some(scene.nodes.len() as u32);
            let parent = hierarchy.parents[index].and_then(|parent| scene_nodes[parent]);
            scene.nodes.push(Node { parent, local: hierarchy.locals[index], ..Node::default() });
        }
        *joint = scene_nodes[*joint as usize].unwrap_or_default();
    }

    if drawn == 0 {
        bail!("it holds no triangles to draw; choose a file with a triangle mesh in its default scene");
    }

    let reduced;
    (scene.textures, reduced) = meshes.materials.textures(&accessors, folder);
    scene.notes.extend(hierarchy.notes.iter().cloned());
    let (animations, skipped) = animation::read(&root, &accessors, &scene_nodes, &scene.nodes)?;
    scene.animations = animations;
    scene.notes.extend(notes(&root, &meshes, reduced, &skipped));
    scene.materials = std::mem::take(&mut meshes.materials.list);
    scene.meshes = std::mem::take(&mut meshes.list);
    scene.materials.iter_mut().for_each(|material| material.name = shortened(&material.name));
    scene.animations.iter_mut().for_each(|animation| animation.name = shortened(&animation.name));
    let bounds = origin::take_off(&mut scene)?;
    punctual::add(&root, &hierarchy, bounds, &mut scene)?;
    presets::add(&mut scene, bounds);
    Ok(scene)
}

pub(super) fn too_many(triangles: u64) -> anyhow::Error {
    anyhow!("it holds {triangles} triangles, more than the {MAX_TRIANGLES} that can be drawn; simplify it first")
}

/// The JSON of a glTF file and a .glb's binary chunk.
fn split(data: &[u8]) -> Result<(&[u8], Option<&[u8]>)> {
    let Some(rest) = data.strip_prefix(b"glTF") else {
        let text = data.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(data);
        if text.trim_ascii_start().first() != Some(&b'{') {
            bail!(
                "it is not a glTF file, as it starts neither with \"glTF\" nor with JSON; choose a .gltf or .glb file"
            );
        }
        return Ok((text, None));
    };
    let word = |at: usize| rest.get(at..at + 4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    let cut = || anyhow!("the .glb file ends early, after {} bytes; download or export it again", data.len());
    let version = word(0).ok_or_else(cut)?;
    if version != 2 {
        bail!("it is a .glb file of version {version}; convert it to version 2");
    }
    let length = word(4).ok_or_else(cut)? as usize;
    // From here on `rest` is what follows the header of twelve bytes.
    let mut rest = data.get(12..length).ok_or_else(cut)?;
    let mut text = None;
    while let Some((header, after)) = rest.split_first_chunk::<8>() {
        let [a, b, c, d, kind @ ..] = *header;
        let (chunk, after) = after.split_at_checked(u32::from_le_bytes([a, b, c, d]) as usize).ok_or_else(cut)?;
        match (&kind, text) {
            (b"JSON", None) => text = Some(chunk),
            (b"BIN\0", Some(text)) => return Ok((text, Some(chunk))),
            (_, None) => return Err(broken("the first chunk of the .glb file is not JSON".into())),
            _ => {}
        }
        rest = after;
    }
    Ok((text.ok_or_else(cut)?, None))
}

/// A node's transform with all its digits, of which the crate keeps those of 32-bit floats.
#[derive(Default, Deserialize)]
#[serde(default)]
struct Transform {
    matrix: Option<[f64; 16]>,
    translation: Option<[f64; 3]>,
    rotation: Option<[f64; 4]>,
    scale: Option<[f64; 3]>,
}

/// The file's JSON, and its nodes' transforms.
fn parse(text: &[u8]) -> Result<(Root, Vec<Transform>)> {
    let invalid = |error| broken(format!("its JSON is not valid glTF ({error})"));
    let mut value: Value = json::deserialize::from_slice(text).map_err(invalid)?;
    let mut found = BTreeSet::new();
    tidy(&mut value, &mut found);
    // Exporters forget to list what they use.
    if let Some(root) = value.as_object_mut() {
        let used = root.get("extensionsUsed").and_then(Value::as_array).into_iter().flatten();
        found.extend(used.filter_map(Value::as_str).map(str::to_owned));
        root.insert("extensionsUsed".into(), found.into_iter().collect());
    }
    let asset = &value["asset"];
    let version = asset["minVersion"].as_str().or(asset["version"].as_str()).unwrap_or_default();
    if version.is_empty() {
        bail!(
            "it names no version of glTF (\"asset\": {{\"version\": …}}), as files of glTF 1.0 may; convert it to glTF 2.0"
        );
    }
    if !version.starts_with("2.") {
        bail!("it is of glTF version {version:?}; convert it to glTF 2.0");
    }
    // The crate asks for two things that glTF lets a file leave out.
    let mut each = |list: &str, fix: fn(&mut Map<String, Value>)| {
        let objects = value.get_mut(list).and_then(Value::as_array_mut).into_iter().flatten();
        objects.filter_map(Value::as_object_mut).for_each(fix);
    };
    each("scenes", |scene| {
        scene.entry("nodes").or_insert_with(|| Value::Array(Vec::new()));
    });
    each("animations", |animation| {
        if let Some(channels) = animation.get_mut("channels").and_then(Value::as_array_mut) {
            channels.retain(|channel| !channel["target"]["node"].is_null());
        }
    });
    let transforms = Option::deserialize(&value["nodes"]).map_err(invalid)?.unwrap_or_default();
    Ok((json::deserialize::from_value(value).map_err(invalid)?, transforms))
}

/// Takes out `extras`, which may be any JSON, and makes whole numbers integers: exporters write them as 4.0 too. Adds the names of
/// the extensions that are found.
fn tidy(value: &mut Value, found: &mut BTreeSet<String>) {
    match value {
        Value::Object(members) => {
            members.remove("extras");
            if let Some(Value::Object(extensions)) = members.get("extensions") {
                found.extend(extensions.keys().cloned());
            }
            members.values_mut().for_each(|member| tidy(member, found));
        }
        Value::Array(items) => items.iter_mut().for_each(|item| tidy(item, found)),
        Value::Number(number) => {
            // Up to 2^53 every whole number is a float of its own; zero keeps its sign.
            let whole = |x: &f64| x.fract() == 0.0 && *x != 0.0 && x.abs() < 9e15 || x.to_bits() == 0;
            if let Some(whole) = number.as_f64().filter(|_| number.is_f64()).filter(whole) {
                *number = (whole as i64).into();
            }
        }
        _ => {}
    }
}

/// Refuses what cannot be drawn without an extension, and notes the extensions that are ignored.
fn check_extensions(root: &Root) -> Result<Vec<String>> {
    let known = |name: &&String| SUPPORTED.contains(&name.as_str());
    let material = |name: &&String| name.contains("_materials_");
    let spared = |name: &&String| material(name) || name.contains("_texture_") || NOT_DRAWN.contains(&name.as_str());
    let missing: Vec<_> = root.extensions_required.iter().filter(|name| !known(name) && !spared(name)).collect();
    if !missing.is_empty() {
        bail!(
            "it requires {}, which Shadowscope cannot read; export it without",
            list(missing.into_iter().map(String::as_str))
        );
    }
    let required = |name: &String| root.extensions_required.contains(name);
    let used = root.extensions_used.iter().filter(|name| !required(name));
    let ignored = root.extensions_required.iter().chain(used).filter(|name| !known(name));
    let (materials, others): (Vec<_>, Vec<_>) = ignored.partition(material);
    let told = |names: Vec<&String>, what: &str| {
        let (required, used): (Vec<_>, Vec<_>) = names.into_iter().partition(|name| required(name));
        let says = |names: Vec<&String>, verb: &str| {
            (!names.is_empty()).then(|| format!("{verb} {}", list(names.into_iter().map(String::as_str))))
        };
        let says = [says(required, "requires"), says(used, "uses")].into_iter().flatten().collect::<Vec<_>>();
        (!says.is_empty()).then(|| format!("The file {}, {what}.", says.join(" and ")))
    };
    let notes = [told(materials, "of which only the base colour is drawn"), told(others, "without which it is drawn")];
    Ok(notes.into_iter().flatten().collect())
}

/// EXT_mesh_gpu_instancing: one matrix an instance. `before`: how many the file's other nodes have; these are added.
fn instances(
    root: &Root,
    node: &json::Node,
    accessors: &Accessors,
    owner: &str,
    before: &mut u64,
) -> Result<Option<Vec<Mat4>>> {
    let extension = node.extensions.as_ref().and_then(|e| e.others.get("EXT_mesh_gpu_instancing"));
    let Some(attributes) = extension.and_then(|e| e.get("attributes")) else { return Ok(None) };
    let attribute = |name: &str| -> Result<Option<Index<json::Accessor>>> {
        let Some(value) = attributes.get(name) else { return Ok(None) };
        match value.as_u64().and_then(|index| u32::try_from(index).ok()) {
            Some(index) => Ok(Some(Index::new(index))),
            None => Err(broken(format!("the instances' {name} of {owner} is not an accessor's index"))),
        }
    };
    let indices = ["TRANSLATION", "ROTATION", "SCALE"].map(attribute);
    let count = |index: &Result<Option<Index<json::Accessor>>>| {
        index.as_ref().ok().copied().flatten().and_then(|i| root.accessors.get(i.value())).map_or(0, |a| a.count.0)
    };
    *before = before.saturating_add(indices.iter().map(count).max().unwrap_or(0));
    if *before > MAX_INSTANCES {
        bail!("it holds {before} instances, more than the {MAX_INSTANCES} that can be drawn; export it with fewer");
    }
    let role = |name: &str| format!("instances' {name} of {owner}");
    let translations = attribute("TRANSLATION")?.map(|i| accessors.floats::<3>(i, &role("TRANSLATION"))).transpose()?;
    let rotations = attribute("ROTATION")?.map(|i| accessors.floats::<4>(i, &role("ROTATION"))).transpose()?;
    let scales = attribute("SCALE")?.map(|i| accessors.floats::<3>(i, &role("SCALE"))).transpose()?;
    let counts = [translations.as_ref().map(Vec::len), rotations.as_ref().map(Vec::len), scales.as_ref().map(Vec::len)];
    let Some(count) = counts.into_iter().flatten().max() else { return Ok(None) };
    if counts.into_iter().flatten().any(|other| other != count) || count == 0 {
        return Err(broken(format!("the instances' attributes of {owner} differ in length or are empty")));
    }
    let matrix = |i: usize| {
        let translation = translations.as_ref().map_or(Vec3::ZERO, |values| Vec3::from(values[i]));
        let rotation = rotations.as_ref().map_or(Quat::IDENTITY, |values| Quat::from_array(values[i]));
        let scale = scales.as_ref().map_or(Vec3::ONE, |values| Vec3::from(values[i]));
        let length = rotation.length();
        let rotation = if length > 0.0 && length.is_finite() { rotation * (1.0 / length) } else { Quat::IDENTITY };
        Mat4::from_scale_rotation_translation(scale, rotation, translation)
    };
    let matrices: Vec<Mat4> = (0..count).map(matrix).collect();
    if let Some(at) = matrices.iter().position(|matrix| !matrix.is_finite()) {
        return Err(broken(format!("the transform of instance {at} of {owner} is not finite")));
    }
    Ok(Some(matrices))
}

/// The skins met so far. Their joints are nodes of the file, until all nodes of the scene are known.
struct Skins {
    list: Vec<Skin>,
    /// Of each skin of the file its place in `list`.
    of_file: Vec<Option<u32>>,
}

impl Skins {
    fn of_node(&mut self, root: &Root, accessors: &Accessors, index: Index<json::Skin>, owner: &str) -> Result<u32> {
        let skin = get(&root.skins, index, "skin", owner)?;
        if let Some(known) = self.of_file[index.value()] {
            return Ok(known);
        }
        let owner = format!("skin {index}{}", name_of(skin.name.as_deref()));
        let inverse_bind = match skin.inverse_bind_matrices {
            Some(accessor) => accessors.floats::<16>(accessor, &format!("inverse bind matrices of {owner}"))?,
            None => vec![Mat4::IDENTITY.to_cols_array(); skin.joints.len()],
        };
        if skin.joints.is_empty() || inverse_bind.len() < skin.joints.len() {
            return Err(broken(format!(
                "{owner} has {} joints and {} inverse bind matrices",
                skin.joints.len(),
                inverse_bind.len()
            )));
        }
        let mut joints = Vec::with_capacity(skin.joints.len());
        for joint in &skin.joints {
            get(&root.nodes, *joint, "node", &owner)?;
            joints.push(joint.value() as u32);
        }
        let inverse_bind: Vec<Mat4> = inverse_bind[..joints.len()].iter().map(Mat4::from_cols_array).collect();
        if let Some(at) = inverse_bind.iter().position(|matrix| !matrix.is_finite()) {
            return Err(broken(format!("the inverse bind matrix of joint {at} of {owner} is not finite")));
        }
        let place = self.list.len() as u32;
        self.list.push(Skin { joints, inverse_bind });
        self.of_file[index.value()] = Some(place);
        Ok(place)
    }
}

/// What the user should know about what is drawn differently.
fn notes(root: &Root, meshes: &Meshes, reduced: usize, skipped: &animation::Skipped) -> Vec<String> {
    let counts = &meshes.counts;
    let other_scenes = root.scenes.len().saturating_sub(1);
    [
        counted(other_scenes, "other scene of the file is not drawn.", "other scenes of the file are not drawn."),
        counted(
            counts.points_and_lines,
            "primitive of points or lines is left out.",
            "primitives of points or lines are left out.",
        ),
        counted(
            counts.without_positions,
            "primitive without positions is left out.",
            "primitives without positions are left out.",
        ),
        counted(counts.degenerate, "triangle without area is left out.", "triangles without area are left out."),
        counted(
            counts.incomplete,
            "primitive ends in an incomplete triangle, which is left out.",
            "primitives end in an incomplete triangle, which is left out.",
        ),
        counted(
            counts.mended_normals,
            "primitive has normals without direction, which are computed from its triangles.",
            "primitives have normals without direction, which are computed from their triangles.",
        ),
        counted(
            counts.mended_uvs,
            "primitive has texture coordinates that are not finite, which are set to zero.",
            "primitives have texture coordinates that are not finite, which are set to zero.",
        ),
        counted(
            counts.without_uvs,
            "textured primitive has no texture coordinates and shows one texel.",
            "textured primitives have no texture coordinates and show one texel.",
        ),
        counted(
            meshes.materials.blended,
            "material with alphaMode BLEND is drawn as opaque.",
            "materials with alphaMode BLEND are drawn as opaque.",
        ),
        counted(
            meshes.materials.without_image,
            "texture has no image that can be read, and its material is drawn without it.",
            "textures have no image that can be read, and their materials are drawn without them.",
        ),
        counted(
            reduced,
            "image is larger than 8192 texels and drawn at that size.",
            "images are larger than 8192 texels and drawn at that size.",
        ),
        counted(
            skipped.weights,
            "animation channel of weights is left out, as its node has no morph targets.",
            "animation channels of weights are left out, as their nodes have no morph targets.",
        ),
        counted(
            skipped.others,
            "animation channel does not move a node's translation, rotation and scale and is left out.",
            "animation channels do not move a node's translation, rotation and scale and are left out.",
        ),
    ]
    .into_iter()
    .flatten()
    .chain(few(meshes.materials.missing.clone(), "images"))
    .collect()
}

/// Notes of one kind, cut off where there are many; `rest` is what the others are called.
fn few(mut notes: Vec<String>, rest: &str) -> Vec<String> {
    const MOST: usize = 4;
    let more = notes.len().saturating_sub(MOST);
    if more > 0 {
        notes.truncate(MOST);
        notes.push(format!("So it is with {more} more {rest}."));
    }
    notes
}

/// An error about contents that no right file has.
fn broken(what: String) -> anyhow::Error {
    anyhow!("{what}; the file is damaged or badly exported, export it again")
}

/// Item `index` of a list of the file; `owner` is what refers to it.
fn get<'a, T>(items: &'a [T], index: Index<T>, kind: &str, owner: &str) -> Result<&'a T> {
    items
        .get(index.value())
        .ok_or_else(|| broken(format!("{owner} refers to {kind} {index}, but the file has {}", items.len())))
}

/// A name as messages give it, after a number.
fn name_of(name: Option<&str>) -> String {
    name.map_or_else(String::new, |name| format!(" {}", quoted(name)))
}
