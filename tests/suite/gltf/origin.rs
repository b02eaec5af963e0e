//! Files that lie far from the zero point of their coordinates.

use super::file::{File, U8};
use glam::{DVec3, Vec3};
use serde_json::{Value, json};
use shadowscope::scene::geometry::Geometry;
use shadowscope::scene::{Camera, Scene};
use std::f32::consts::FRAC_1_SQRT_2;

const FAR: [[f64; 3]; 4] = [[1e5, 0.0, 1e5], [5e5, 0.0, 5e6], [1e7, -1e7, 1e7], [123456.7890625, -7654321.5, 0.25]];

/// The file with all that it holds hung below a root at this place.
fn moved(file: &File, to: [f64; 3]) -> File {
    let mut file = file.clone();
    let count = file.json["nodes"].as_array().unwrap().len();
    let children: Vec<&Value> =
        file.json["nodes"].as_array().unwrap().iter().flat_map(|n| n["children"].as_array()).flatten().collect();
    let tops: Vec<usize> = (0..count).filter(|i| !children.contains(&&json!(i))).collect();
    file.push("nodes", json!({ "translation": to, "children": tops }));
    file
}

/// What is drawn at a moment, bit for bit: corners and normals.
fn drawn(scene: &Scene, time: f32) -> Vec<([u32; 3], u32)> {
    let geometry = Geometry::new(scene, 0, time).unwrap();
    geometry.vertices.iter().map(|v| (v.position.to_array().map(f32::to_bits), v.normal)).collect()
}

/// The same scene wherever it stands: geometry, cameras and lights, bit for bit, and the origin as much farther away.
fn same_everywhere(file: &File, times: &[f32]) {
    let here = moved(file, [0.0; 3]).load();
    for far in FAR {
        let there = moved(file, far).load();
        assert_eq!(there.origin - here.origin, DVec3::from(far));
        for time in times {
            assert!(drawn(&there, *time) == drawn(&here, *time), "{far:?} at {time} s");
        }
        let cameras = |scene: &Scene| scene.cameras.iter().map(|c| c.camera).collect::<Vec<Camera>>();
        assert_eq!(cameras(&there), cameras(&here), "{far:?}");
        let lights = |scene: &Scene| format!("{:?}", scene.lights);
        assert_eq!(lights(&there), lights(&here), "{far:?}");
    }
}

#[test]
fn nodes_instances_cameras_and_lights() {
    let mut file = File::triangle();
    let translations = file.floats("VEC3", &[1.0, 2.0, 3.0, 4.0, 5.5, 6.0]);
    let instancing = json!({ "EXT_mesh_gpu_instancing": { "attributes": { "TRANSLATION": translations } } });
    file.json["cameras"] = json!([{ "type": "perspective", "perspective": { "yfov": 1, "znear": 0.1 } }]);
    file.json["extensions"] = json!({ "KHR_lights_punctual": { "lights": [{ "type": "spot" }, { "type": "point" }] } });
    let light = |i: u32| json!({ "KHR_lights_punctual": { "light": i } });
    file.json["nodes"] = json!([
        { "mesh": 0, "children": [1], "rotation": [0, FRAC_1_SQRT_2, 0, FRAC_1_SQRT_2], "translation": [1.5, 0.3, -2] },
        { "mesh": 0, "scale": [3, 0.7, 1], "rotation": [0.1, 0.2, 0.3, 0.9], "translation": [0.1, 7, 0.2] },
        { "mesh": 0, "extensions": instancing, "matrix": [0.5, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1, 0, -1, -1, 4.25, 1] },
        { "camera": 0, "translation": [3, 2, 9] },
        { "extensions": light(0), "translation": [0, 6, 1], "rotation": [-FRAC_1_SQRT_2, 0, 0, FRAC_1_SQRT_2] },
        { "extensions": light(1), "translation": [0.5, 6, 1] },
    ]);
    same_everywhere(&file, &[0.0]);
}

#[test]
fn animations() {
    let mut file = File::triangle();
    file.json["nodes"] = json!([{ "mesh": 0 }, { "mesh": 0, "translation": [1, 0, 0] }]);
    let input = file.floats("SCALAR", &[0.0, 1.5]);
    let output = file.floats("VEC3", &[1.0, 0.0, 0.0, 2.5, 3.5, -1.0]);
    let turns = file.floats("VEC4", &[0.0, 0.0, 0.0, 1.0, 0.0, FRAC_1_SQRT_2, 0.0, FRAC_1_SQRT_2]);
    file.push(
        "animations",
        json!({
            "samplers": [{ "input": input, "output": output }, { "input": input, "output": turns }],
            "channels": [
                { "sampler": 0, "target": { "node": 1, "path": "translation" } },
                { "sampler": 1, "target": { "node": 1, "path": "rotation" } },
            ],
        }),
    );
    same_everywhere(&file, &[0.0, 0.4, 1.1, 2.0]);
    // Key frames that hold the distance themselves, though the node does not.
    let far = file.floats("VEC3", &[1e5, 0.0, 5e6, 1e5 + 2.0, 0.0, 5e6]);
    file.json["animations"][0]["samplers"][0]["output"] = far.into();
    file.json["nodes"] = json!([{}, { "mesh": 0 }]);
    let scene = file.load();
    assert!((scene.origin - DVec3::new(1e5, 0.0, 5e6)).length() < 1.0, "{}", scene.origin);
    let at = |time: f32| Geometry::new(&scene, 0, time).unwrap().vertices[0].position;
    assert!((at(0.75) - at(0.0)).abs_diff_eq(Vec3::X, 1e-6), "{} {}", at(0.0), at(0.75));
}

/// The joints hold the distance, and a vertex lies between theirs.
#[test]
fn skins() {
    let mut file = File::triangle();
    let joints = file.accessor(&[0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0], U8, "VEC4", 3);
    let weights = file.floats("VEC4", &[1., 0., 0., 0., 1., 0., 0., 0., 0.5, 0.5, 0., 0.]);
    file.primitive()["attributes"]["JOINTS_0"] = joints.into();
    file.primitive()["attributes"]["WEIGHTS_0"] = weights.into();
    file.push("skins", json!({ "joints": [1, 2] }));
    file.json["nodes"] = json!([
        { "mesh": 0, "skin": 0 },
        { "translation": [0, 0.25, 1], "children": [2] },
        { "translation": [1.5, 0, 0], "rotation": [0, 0, FRAC_1_SQRT_2, FRAC_1_SQRT_2] },
    ]);
    let input = file.floats("SCALAR", &[0.0, 1.0]);
    let turns = file.floats("VEC4", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0]);
    let offsets = file.floats("VEC3", &[0., 0., 2., 0., 0., 2., 0., 1., 0.]);
    let weights = file.floats("SCALAR", &[0.0, 1.0]);
    file.primitive()["targets"] = json!([{ "POSITION": offsets }]);
    file.push(
        "animations",
        json!({
            "samplers": [{ "input": input, "output": turns }, { "input": input, "output": weights }],
            "channels": [
                { "sampler": 0, "target": { "node": 2, "path": "rotation" } },
                { "sampler": 1, "target": { "node": 0, "path": "weights" } },
            ],
        }),
    );
    same_everywhere(&file, &[0.0, 0.3, 0.8]);
}

/// A file's numbers have 64 bits, of which 32 would place the second part half a metre off.
#[test]
fn all_digits_of_a_translation_count() {
    let mut file = File::triangle();
    file.json["nodes"] = json!([
        { "mesh": 0, "translation": [5000000.3, 0, 0] },
        { "mesh": 0, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 5000001.55, 0, 0, 1] },
    ]);
    let corners = Geometry::new(&file.load(), 0, 0.0).unwrap();
    let apart = corners.vertices[3].position - corners.vertices[0].position;
    assert!(apart.abs_diff_eq(Vec3::X * 1.25, 1e-6), "{apart}");
}

#[test]
fn the_notes_say_what_distance_costs() {
    let far = moved(&File::triangle(), [1e5, 0.0, 1e5]).load();
    assert_eq!(far.notes.len(), 1, "{:?}", far.notes);
    assert!(far.notes[0].contains("141 km") && far.notes[0].contains("(100000.5, 0.5, 100000)"), "{:?}", far.notes);
    // The vertices themselves lie far away: a step of theirs is half a metre.
    let mut file = File::triangle();
    let positions = file.floats("VEC3", &[5e6, 0.0, 0.0, 5e6 + 1.0, 0.0, 0.0, 5e6, 1.0, 0.0]);
    file.primitive()["attributes"]["POSITION"] = positions.into();
    let notes = file.load().notes;
    assert!(notes.iter().any(|n| n.contains("5000 km") && n.contains("0.50 m apart")), "{notes:?}");
    assert!(File::triangle().load().notes.is_empty());
}
