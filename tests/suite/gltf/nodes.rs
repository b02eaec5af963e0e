//! The node hierarchy and instances.

use super::file::{File, I8, I16};
use glam::{DVec3, Mat4, Quat, Vec3};
use serde_json::json;
use shadowscope::scene::pose::world_matrices;
use shadowscope::scene::{Local, Scene};
use std::f32::consts::FRAC_1_SQRT_2;

/// In the file's coordinates.
pub fn world(scene: &Scene, node: usize, point: Vec3) -> Vec3 {
    (world_matrices(scene, None, 0.0)[node].transform_point3(point.as_dvec3()) + scene.origin).as_vec3()
}

#[test]
fn trs_matrices_and_negative_scales_multiply_down_the_tree() {
    let mut file = File::triangle();
    // Children before parents in the file.
    file.json["nodes"] = json!([
        { "mesh": 0, "scale": [-1, 2, 1] },
        { "children": [0], "matrix": [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,5,1] },
        { "children": [1], "translation": [10, 0, 0], "rotation": [0, FRAC_1_SQRT_2, 0, FRAC_1_SQRT_2] },
    ]);
    let scene = file.load();
    assert_eq!(scene.nodes.iter().map(|node| node.parent).collect::<Vec<_>>(), [None, Some(0), Some(1)]);
    assert!(matches!(scene.nodes[1].local, Local::Matrix(matrix) if matrix.w_axis.z == 5.0));
    assert!(matches!(scene.nodes[2].local, Local::Trs { scale, .. } if scale == DVec3::new(-1.0, 2.0, 1.0)));
    // (1, 1, 0) -> (-1, 2, 0) -> (-1, 2, 5) -> a quarter turn about y: (5, 2, 1) -> (15, 2, 1).
    assert!(world(&scene, 2, Vec3::new(1.0, 1.0, 0.0)).abs_diff_eq(Vec3::new(15.0, 2.0, 1.0), 1e-5));
    // The winding stays as it is: the determinant tells.
    assert_eq!(scene.meshes[0].indices, [0, 1, 2]);
    assert!(world_matrices(&scene, None, 0.0)[2].determinant() < 0.0);
}

#[test]
fn the_default_scene_else_the_first_else_all_roots() {
    let mut file = File::triangle();
    file.json["nodes"] = json!([{ "mesh": 0 }, { "mesh": 0, "name": "second" }, { "mesh": 0 }]);
    assert_eq!(file.load().nodes.len(), 3);
    file.json["scenes"] = json!([{ "nodes": [0] }, { "nodes": [1, 2] }, {}]);
    let scene = file.load();
    assert_eq!(scene.nodes.len(), 1);
    assert_eq!(scene.notes, ["2 other scenes of the file are not drawn."]);
    file.json["scene"] = json!(1);
    assert_eq!(file.load().nodes.len(), 2);
    // Nodes share the mesh.
    assert_eq!(file.load().meshes.len(), 1);
}

#[test]
fn trees_that_are_none_are_refused() {
    let cases = [
        (json!([{ "mesh": 0, "name": "a" }, { "children": [2] }, { "children": [1] }]), "node 1", "cycle"),
        (json!([{ "mesh": 0, "children": [0] }]), "node 0", "cycle"),
        (json!([{ "mesh": 0, "children": [7] }]), "node 0", "node 7"),
        (json!([{ "mesh": 3 }]), "node 0", "mesh 3"),
        (json!([{ "mesh": 0, "translation": [0, 1e39, 0] }]), "node 0", "not finite"),
        (json!([{ "mesh": 0, "matrix": [1e39,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1] }]), "node 0", "not finite"),
        (json!([{ "mesh": 0, "scale": [1e30, 1, 1] }, { "scale": [1e30, 1, 1], "children": [0] }]), "node 0", "range"),
    ];
    for (nodes, place, reason) in cases {
        let mut file = File::triangle();
        file.json["nodes"] = nodes;
        let message = file.error();
        assert!(message.contains(place) && message.contains(reason), "{message}");
    }
    let mut file = File::triangle();
    file.json["scenes"] = json!([{ "nodes": [4] }]);
    assert!(file.error().contains("node 4"));
    file.json["scenes"] = json!([{ "nodes": [0] }]);
    file.json["scene"] = json!(1);
    assert!(file.error().contains("default scene is scene 1, but the file has 1"));
}

/// Nodes that hang below others, listed or not, and nodes that are listed twice: drawn once, where the hierarchy has them.
#[test]
fn scenes_that_list_nodes_oddly() {
    let mut file = File::triangle();
    file.json["nodes"] = json!([
        { "mesh": 0, "translation": [1, 0, 0] },
        { "mesh": 0, "translation": [0, 1, 0] },
        { "children": [0, 1], "translation": [0, 0, 1] },
        { "mesh": 0, "children": [2], "translation": [10, 0, 0] },
    ]);
    let drawn = |scene: &Scene| -> Vec<Vec3> {
        let places = (0..scene.nodes.len()).filter(|&node| !scene.nodes[node].meshes.is_empty());
        places.map(|node| world(scene, node, Vec3::ZERO)).collect()
    };
    let (first, second, top) = (Vec3::new(11.0, 0.0, 1.0), Vec3::new(10.0, 1.0, 1.0), Vec3::new(10.0, 0.0, 0.0));
    for (list, expected, odd) in [
        (json!([0]), vec![first], Some("1 node that")),
        (json!([0, 1]), vec![first, second], Some("2 nodes that")),
        (json!([1, 3]), vec![top, second, first], Some("1 node that")),
        (json!([3, 0, 3]), vec![top, first, second], Some("2 nodes that")),
        (json!([3]), vec![top, first, second], None),
    ] {
        file.json["scenes"] = json!([{ "nodes": list }]);
        let scene = file.load();
        assert_eq!(drawn(&scene), expected, "{list}");
        let note = scene.notes.iter().find(|note| note.contains("the scene lists"));
        assert_eq!(note.is_some(), odd.is_some(), "{:?}", scene.notes);
        assert!(odd.is_none_or(|odd| note.unwrap().starts_with(odd)), "{note:?}");
    }
}

/// A node below two others, or below one twice, is drawn once.
#[test]
fn nodes_with_two_parents_hang_below_the_first() {
    let mut file = File::triangle();
    file.json["nodes"] = json!([
        { "mesh": 0 },
        { "children": [0, 0], "translation": [1, 0, 0] },
        { "children": [0], "translation": [2, 0, 0] },
    ]);
    let scene = file.load();
    assert_eq!(scene.triangles(), 1);
    let drawn = scene.nodes.iter().position(|node| !node.meshes.is_empty()).unwrap();
    assert_eq!(world(&scene, drawn, Vec3::ZERO), Vec3::X);
    assert!(scene.notes[0].starts_with("2 nodes are children of two nodes"), "{:?}", scene.notes);
}

/// KHR_node_visibility: neither meshes nor cameras nor lights at or below an invisible node.
#[test]
fn invisible_nodes_are_not_drawn() {
    let hidden = |rest: serde_json::Value, visible: bool| {
        let mut node = rest;
        node["extensions"] = json!({ "KHR_node_visibility": { "visible": visible },
            "KHR_lights_punctual": { "light": 0 } });
        node
    };
    let mut file = File::triangle();
    file.json["extensionsRequired"] = json!(["KHR_node_visibility"]);
    file.json["extensions"] = json!({ "KHR_lights_punctual": { "lights": [{ "type": "point" }] } });
    file.push("cameras", json!({ "type": "perspective", "perspective": { "yfov": 1, "znear": 0.1 } }));
    file.json["nodes"] = json!([
        hidden(json!({ "mesh": 0, "name": "seen" }), true),
        hidden(json!({ "mesh": 0, "children": [2], "name": "gone" }), false),
        hidden(json!({ "mesh": 0, "camera": 0, "name": "below" }), true),
    ]);
    let scene = file.load();
    assert_eq!(scene.triangles(), 1);
    let lights: Vec<_> = scene.lights.iter().map(|light| light.name.as_str()).collect();
    assert_eq!(lights, ["seen", "sun", "low-sun", "spot", "omni"]);
    assert!(scene.cameras.iter().all(|camera| camera.name != "below"));
    assert!(scene.notes.iter().any(|note| note.starts_with("1 node is invisible")), "{:?}", scene.notes);
    file.json["nodes"][0] = hidden(json!({ "mesh": 0 }), false);
    assert!(file.error().contains("no triangles"));
}

#[test]
fn a_deep_chain_of_nodes_loads() {
    let mut file = File::triangle();
    let count = 20_000;
    let mut nodes: Vec<_> = (0..count).map(|i| json!({ "children": [i + 1], "translation": [0, 0, 1] })).collect();
    nodes.push(json!({ "mesh": 0 }));
    file.json["nodes"] = nodes.into();
    let scene = file.load();
    assert_eq!(world(&scene, count, Vec3::ZERO), Vec3::new(0.0, 0.0, count as f32));
}

fn instanced(attributes: serde_json::Value, file: &mut File) {
    file.json["nodes"][0]["extensions"] = json!({ "EXT_mesh_gpu_instancing": { "attributes": attributes } });
    file.json["extensionsRequired"] = json!(["EXT_mesh_gpu_instancing"]);
}

#[test]
fn instances_have_translation_rotation_and_scale() {
    let mut file = File::triangle();
    let translations = file.floats("VEC3", &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
    // A quarter turn about z, and none; components normalised.
    let half = (0.5f32.sqrt() * 32767.0).round() as i16;
    let bytes: Vec<u8> = [0, 0, half, half, 0, 0, 0, 32767].iter().flat_map(|value| value.to_le_bytes()).collect();
    let rotations = file.accessor(&bytes, I16, "VEC4", 2);
    file.json["accessors"][rotations]["normalized"] = true.into();
    let scales = file.floats("VEC3", &[2.0, 2.0, 2.0, 1.0, 1.0, -1.0]);
    instanced(json!({ "TRANSLATION": translations, "ROTATION": rotations, "SCALE": scales, "_ID": 9 }), &mut file);
    let scene = file.load();
    let instances = &scene.nodes[0].instances;
    assert_eq!(instances.len(), 2);
    assert!(instances[0].transform_point3(Vec3::X).abs_diff_eq(Vec3::new(1.0, 4.0, 3.0), 1e-4));
    let second =
        Mat4::from_scale_rotation_translation(Vec3::new(1.0, 1.0, -1.0), Quat::IDENTITY, Vec3::new(4.0, 5.0, 6.0));
    assert_eq!(instances[1], second);
    // The presets know of the instances.
    let target = scene.cameras[0].camera.target + scene.origin.as_vec3();
    assert!(target.abs_diff_eq(Vec3::new(2.0, 4.5, 4.5), 1.5));
}

#[test]
fn instances_with_some_attributes_and_bytes_as_rotation() {
    let mut file = File::triangle();
    let rotations = file.accessor(&[0, 127, 0, 0, 0, 0, 0, 127], I8, "VEC4", 2);
    file.json["accessors"][rotations]["normalized"] = true.into();
    instanced(json!({ "ROTATION": rotations }), &mut file);
    let instances = &file.load().nodes[0].instances;
    assert!(instances[0].transform_point3(Vec3::X).abs_diff_eq(Vec3::NEG_X, 1e-6));
    assert_eq!(instances[1], Mat4::IDENTITY);
}

#[test]
fn malformed_instances_are_refused() {
    let mut file = File::triangle();
    let one = file.floats("VEC3", &[0.0; 3]);
    let two = file.floats("VEC3", &[1.0; 6]);
    let infinite = file.floats("VEC3", &[f32::INFINITY; 3]);
    for (attributes, reason) in [
        (json!({ "TRANSLATION": one, "SCALE": two }), "differ in length"),
        (json!({ "TRANSLATION": infinite }), "not finite"),
        (json!({ "TRANSLATION": 99 }), "accessor 99"),
        (json!({ "TRANSLATION": "x" }), "TRANSLATION"),
        (json!({ "ROTATION": one }), "3 components"),
    ] {
        instanced(attributes, &mut file);
        let message = file.error();
        assert!(message.contains("node 0") && message.contains(reason), "{message}");
    }
}

#[test]
fn instances_cannot_ask_for_billions_of_triangles() {
    let mut file = File::triangle();
    let zeros = file.push("accessors", json!({ "componentType": 5126, "type": "VEC3", "count": 100_000 }));
    instanced(json!({ "TRANSLATION": zeros }), &mut file);
    let indices = file.shorts("SCALAR", &[0, 1, 2].repeat(1001));
    file.primitive()["indices"] = indices.into();
    assert!(file.error().contains("100100000 triangles"));
}
