//! Primitives, accessors, quantisation, skins and morph targets.

use super::file::{F32, File, I8, I16, U8, U16, U32};
use glam::{Mat4, Vec2, Vec3};
use serde_json::json;
use shadowscope::scene::Scene;
use shadowscope::scene::geometry::Geometry;
use shadowscope::scene::pose::placements;
use std::f32::consts::FRAC_1_SQRT_2;

/// A file with these positions, no indices and this mode.
fn primitive(mode: u32, positions: &[f32]) -> File {
    let mut file = File::triangle();
    let positions = file.floats("VEC3", positions);
    file.json["meshes"][0]["primitives"] = json!([{ "attributes": { "POSITION": positions }, "mode": mode }]);
    file
}

const SQUARE: [f32; 12] = [0., 0., 0., 1., 0., 0., 0., 1., 0., 1., 1., 0.];

#[test]
fn strips_and_fans_keep_their_winding() {
    let mesh = &primitive(5, &SQUARE).load().meshes[0];
    assert_eq!(mesh.positions[..3], [Vec3::ZERO, Vec3::X, Vec3::Y]);
    assert_eq!(mesh.positions[3..], [Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y]);
    assert_eq!(mesh.normals, [Vec3::Z; 6]);

    let corners = [0., 0., 0., 1., 0., 0., 1., 1., 0., 0., 1., 0.];
    let mesh = &primitive(6, &corners).load().meshes[0];
    assert_eq!(mesh.positions[..3], [Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::ZERO]);
    assert_eq!(mesh.positions[3..], [Vec3::new(1.0, 1.0, 0.0), Vec3::Y, Vec3::ZERO]);
    assert_eq!(mesh.normals, [Vec3::Z; 6]);
}

#[test]
fn points_and_lines_are_left_out_and_noted() {
    let mut file = File::triangle();
    for mode in [0, 1, 2, 3] {
        let line = json!({ "attributes": { "POSITION": 0 }, "mode": mode });
        file.json["meshes"][0]["primitives"].as_array_mut().unwrap().push(line);
    }
    let scene = file.load();
    assert_eq!(scene.meshes.len(), 1);
    assert_eq!(scene.notes, ["4 primitives of points or lines are left out."]);
    file.json["meshes"][0]["primitives"].as_array_mut().unwrap().remove(0);
    assert!(file.error().contains("no triangles to draw"));
}

#[test]
fn indices_of_one_two_and_four_bytes() {
    for (component, size) in [(U8, 1), (U16, 2), (U32, 4)] {
        let mut file = primitive(4, &SQUARE);
        let bytes: Vec<u8> = [3u32, 2, 1].iter().flat_map(|index| index.to_le_bytes()[..size].to_vec()).collect();
        let indices = file.accessor(&bytes, component, "SCALAR", 3);
        file.primitive()["indices"] = indices.into();
        let mesh = &file.load().meshes[0];
        assert_eq!(mesh.positions, [Vec3::new(1.0, 1.0, 0.0), Vec3::Y, Vec3::X]);
        assert_eq!(mesh.normals, [Vec3::Z; 3]);
    }
}

#[test]
fn missing_normals_are_flat_and_unshared() {
    // Two faces of a valley that share an edge.
    let mut file = primitive(4, &[0., 0., 0., 0., 0., 1., 1., 1., 0., -1., 1., 0.]);
    let indices = file.shorts("SCALAR", &[0, 1, 2, 0, 3, 1]);
    file.primitive()["indices"] = indices.into();
    let mesh = &file.load().meshes[0];
    assert_eq!(mesh.positions.len(), 6);
    assert_eq!(mesh.uvs.len(), 6);
    assert_eq!(mesh.indices, [0, 1, 2, 3, 4, 5]);
    let [left, right] = [Vec3::new(-1.0, 1.0, 0.0).normalize(), Vec3::new(1.0, 1.0, 0.0).normalize()];
    for corner in 0..3 {
        assert!(mesh.normals[corner].abs_diff_eq(left, 1e-6), "{:?}", mesh.normals);
        assert!(mesh.normals[3 + corner].abs_diff_eq(right, 1e-6), "{:?}", mesh.normals);
    }
}

#[test]
fn given_normals_are_made_unit_and_bad_ones_computed() {
    let mut file = File::triangle();
    let normals = file.floats("VEC3", &[0.0, 3.0, 0.0, 0.0, 0.0, 0.0, f32::NAN, 0.0, 0.0]);
    file.primitive()["attributes"]["NORMAL"] = normals.into();
    let scene = file.load();
    assert_eq!(scene.meshes[0].normals, [Vec3::Y, Vec3::Z, Vec3::Z]);
    assert_eq!(scene.notes.len(), 1);
    assert!(scene.notes[0].contains("normals without direction"));
}

#[test]
fn triangles_without_area_are_dropped_and_counted() {
    let mut file = primitive(4, &SQUARE);
    // Twice the same index, three on a line, and one that is fine.
    let positions = file.floats("VEC3", &[0., 0., 0., 1., 0., 0., 2., 0., 0., 0., 1., 0.]);
    let indices = file.shorts("SCALAR", &[0, 0, 1, 0, 1, 2, 0, 1, 3]);
    file.primitive()["attributes"]["POSITION"] = positions.into();
    file.primitive()["indices"] = indices.into();
    let scene = file.load();
    assert_eq!(scene.meshes[0].positions, [Vec3::ZERO, Vec3::X, Vec3::Y]);
    assert_eq!(scene.notes, ["2 triangles without area are left out."]);
}

#[test]
fn tiny_triangles_are_not_taken_for_degenerate() {
    let positions = [0.0, 0.0, 0.0, 1e-25, 0.0, 0.0, 0.0, 1e-25, 0.0];
    let scene = primitive(4, &positions).load();
    assert_eq!(scene.meshes[0].normals, [Vec3::Z; 3]);
    assert!(scene.cameras.iter().all(|camera| camera.camera.position.is_finite()));
}

#[test]
fn an_incomplete_triangle_is_noted() {
    let mut file = primitive(4, &SQUARE);
    let indices = file.shorts("SCALAR", &[0, 1, 2, 3]);
    file.primitive()["indices"] = indices.into();
    let scene = file.load();
    assert_eq!(scene.meshes[0].indices.len(), 3);
    assert!(scene.notes[0].contains("incomplete triangle"));
}

#[test]
fn interleaved_strides() {
    let mut file = File::triangle();
    let mut bytes = Vec::new();
    for (position, uv) in
        [([0.0, 0.0, 1.0f32], [0.1, 0.2f32]), ([1.0, 0.0, 1.0], [0.3, 0.4]), ([0.0, 1.0, 1.0], [0.5, 0.6])]
    {
        bytes.extend(position.iter().chain(&uv).flat_map(|value| value.to_le_bytes()));
    }
    let view = file.view(&bytes);
    file.json["bufferViews"][view]["byteStride"] = 20.into();
    let accessor = |kind: &str, offset: u32| json!({ "bufferView": view, "byteOffset": offset, "componentType": F32, "type": kind, "count": 3 });
    let positions = file.push("accessors", accessor("VEC3", 0));
    let uvs = file.push("accessors", accessor("VEC2", 12));
    file.primitive()["attributes"] = json!({ "POSITION": positions, "TEXCOORD_0": uvs });
    let image = file.view(&super::file::picture(image::ImageFormat::Png));
    file.texture(json!({ "bufferView": image, "mimeType": "image/png" }), json!({}));
    let mesh = &file.load().meshes[0];
    assert_eq!(mesh.positions, [Vec3::Z, Vec3::new(1.0, 0.0, 1.0), Vec3::new(0.0, 1.0, 1.0)]);
    assert_eq!(mesh.uvs, [Vec2::new(0.1, 0.2), Vec2::new(0.3, 0.4), Vec2::new(0.5, 0.6)]);
}

#[test]
fn quantised_positions_normals_and_uvs() {
    let mut file = File::triangle();
    file.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
    // Padded to strides of four bytes as the extension asks.
    let cases = [
        (
            U8,
            false,
            vec![0, 0, 0, 9, 200, 0, 0, 9, 0, 100, 7, 9],
            4,
            [Vec3::ZERO, Vec3::X * 200.0, Vec3::new(0.0, 100.0, 7.0)],
        ),
        (I8, true, vec![0, 0, 0, 9, 127, 0, 0, 9, 0, 127, 128, 9], 4, [Vec3::ZERO, Vec3::X, Vec3::new(0.0, 1.0, -1.0)]),
        (
            I16,
            true,
            shorts(&[0, 0, 0, 9, 32767, 0, 0, 9, 0, 32767, -32768, 9]),
            8,
            [Vec3::ZERO, Vec3::X, Vec3::new(0.0, 1.0, -1.0)],
        ),
        (U16, true, shorts(&[0, 0, 0, 9, -1, 0, 0, 9, 0, -1, 0, 9]), 8, [Vec3::ZERO, Vec3::X, Vec3::Y]),
    ];
    for (component, normalized, bytes, stride, expected) in cases {
        let positions = file.accessor(&bytes, component, "VEC3", 3);
        let view = file.json["accessors"][positions]["bufferView"].as_u64().unwrap() as usize;
        file.json["bufferViews"][view]["byteStride"] = stride.into();
        file.json["accessors"][positions]["normalized"] = normalized.into();
        file.primitive()["attributes"] = json!({ "POSITION": positions });
        assert_eq!(file.load().meshes[0].positions, expected);
    }
    let normals = file.accessor(&[0, 127, 0, 0, 0, 129, 0, 0, 0, 0, 127, 0], I8, "VEC3", 3);
    let view = file.json["accessors"][normals]["bufferView"].as_u64().unwrap() as usize;
    file.json["bufferViews"][view]["byteStride"] = 4.into();
    file.json["accessors"][normals]["normalized"] = true.into();
    let uvs = file.accessor(&[0, 255, 51, 0, 102, 0], U8, "VEC2", 3);
    file.json["accessors"][uvs]["normalized"] = true.into();
    file.primitive()["attributes"] = json!({ "POSITION": 0, "NORMAL": normals, "TEXCOORD_0": uvs });
    let image = file.view(&super::file::picture(image::ImageFormat::Png));
    file.texture(json!({ "bufferView": image }), json!({}));
    let mesh = &file.load().meshes[0];
    assert_eq!(mesh.normals, [Vec3::Y, Vec3::NEG_Y, Vec3::Z]);
    assert_eq!(mesh.uvs, [Vec2::new(0.0, 1.0), Vec2::new(0.2, 0.0), Vec2::new(0.4, 0.0)]);
}

fn shorts(values: &[i16]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

#[test]
fn sparse_accessors_with_and_without_base() {
    for with_base in [true, false] {
        let mut file = File::triangle();
        let places = file.view(&[1, 2]);
        let values: Vec<u8> = [5.0f32, 0., 0., 0., 6., 0.].iter().flat_map(|value| value.to_le_bytes()).collect();
        let values = file.view(&values);
        let mut accessor = json!({ "componentType": F32, "type": "VEC3", "count": 3, "sparse": {
            "count": 2,
            "indices": { "bufferView": places, "componentType": U8 },
            "values": { "bufferView": values },
        } });
        if with_base {
            let base = file.floats("VEC3", &[0., 0., 7., 1., 1., 1., 1., 1., 1.]);
            accessor["bufferView"] = file.json["accessors"][base]["bufferView"].clone();
        }
        let positions = file.push("accessors", accessor);
        file.primitive()["attributes"]["POSITION"] = positions.into();
        let first = Vec3::Z * if with_base { 7.0 } else { 0.0 };
        assert_eq!(file.load().meshes[0].positions, [first, Vec3::X * 5.0, Vec3::Y * 6.0]);

        let places = file.view(&[1, 3]);
        file.json["accessors"][positions]["sparse"]["indices"]["bufferView"] = places.into();
        assert!(file.error().contains("replaces element 3 of its 3"));
    }
}

/// The corners as they are drawn at the clock's start, in the file's coordinates.
fn drawn(scene: &Scene) -> Vec<Vec3> {
    let geometry = Geometry::new(scene, 0, 0.0).unwrap();
    geometry.vertices.iter().map(|v| (v.position.as_dvec3() + scene.origin).as_vec3()).collect()
}

#[test]
fn morph_targets_stand_at_the_default_weights() {
    let mut file = File::triangle();
    let offsets = file.floats("VEC3", &[0., 0., 2., 0., 0., 2., 0., 0., 2.]);
    file.primitive()["targets"] = json!([{ "POSITION": offsets }, { "POSITION": offsets }]);
    let scene = file.load();
    assert_eq!(drawn(&scene)[0], Vec3::ZERO);
    assert!(scene.notes.is_empty(), "{:?}", scene.notes);
    file.json["meshes"][0]["weights"] = json!([0.5, 0]);
    assert_eq!(drawn(&file.load()), [Vec3::Z, Vec3::X + Vec3::Z, Vec3::Y + Vec3::Z]);
    // A node's own weights come first, and do not touch the mesh elsewhere.
    file.json["nodes"] = json!([{ "mesh": 0 }, { "mesh": 0, "weights": [1, 1] }]);
    let scene = file.load();
    assert_eq!(scene.meshes.len(), 1);
    let corners = drawn(&scene);
    assert_eq!((corners[0], corners[3]), (Vec3::Z, Vec3::Z * 4.0));
    file.json["nodes"][1]["weights"] = json!([1e40, 1]);
    assert!(file.error().contains("not finite"));
}

/// The triangle with two joints: the first lifts by one, the second is turned a quarter about z.
fn skinned() -> File {
    let mut file = File::triangle();
    let joints = file.accessor(&[0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0], U8, "VEC4", 3);
    let weights = file.floats("VEC4", &[1., 0., 0., 0., 1., 0., 0., 0., 0.5, 0.5, 0., 0.]);
    file.primitive()["attributes"]["JOINTS_0"] = joints.into();
    file.primitive()["attributes"]["WEIGHTS_0"] = weights.into();
    let inverse = Mat4::from_translation(Vec3::NEG_X).to_cols_array();
    let matrices: Vec<f32> = Mat4::IDENTITY.to_cols_array().into_iter().chain(inverse).collect();
    let matrices = file.floats("MAT4", &matrices);
    file.push("skins", json!({ "joints": [2, 3], "inverseBindMatrices": matrices }));
    file.json["nodes"] = json!([
        { "mesh": 0, "skin": 0, "translation": [100, 0, 0] },
        { "children": [2, 3] },
        { "translation": [0, 0, 1] },
        { "translation": [1, 0, 0], "rotation": [0, 0, FRAC_1_SQRT_2, FRAC_1_SQRT_2] },
    ]);
    file
}

#[test]
fn skinned_meshes_stand_at_the_files_pose() {
    let scene = skinned().load();
    // The node's own transform does not count.
    let positions = drawn(&scene);
    assert!(positions[0].abs_diff_eq(Vec3::Z, 1e-6));
    assert!(positions[1].abs_diff_eq(Vec3::X, 1e-6));
    // Half of (0, 1, 1) and half of the turned (-1, 1, 0), which is (0, -1, 0).
    assert!(positions[2].abs_diff_eq(Vec3::new(0.0, 0.0, 0.5), 1e-6), "{positions:?}");
    assert!(scene.notes.is_empty(), "{:?}", scene.notes);
}

#[test]
fn a_mirrored_skin_keeps_its_front() {
    let mut file = skinned();
    file.json["nodes"][1]["scale"] = json!([1, 1, -1]);
    file.json["nodes"][3] = json!({ "translation": [1, 0, 0] });
    let normals = file.floats("VEC3", &[0., 0., 1., 0., 0., 1., 0., 0., 1.]);
    file.primitive()["attributes"]["NORMAL"] = normals.into();
    let front = |file: &File| {
        let scene = file.load();
        let [a, b, c] = Geometry::new(&scene, 0, 0.0).unwrap().corners(0);
        ((b - a).cross(c - a), placements(&scene, 0, 0.0)[0].posed().1[0].as_vec3())
    };
    let (winding, normal) = front(&file);
    assert!(winding.dot(normal) > 0.0);
    assert!(normal.abs_diff_eq(Vec3::NEG_Z, 1e-6), "{normal}");
    // Normals that no file gives.
    file.primitive()["attributes"].as_object_mut().unwrap().remove("NORMAL");
    let (winding, normal) = front(&file);
    assert!(winding.normalize().abs_diff_eq(normal.normalize(), 1e-6), "{normal}");
}

#[test]
fn malformed_skins_are_refused() {
    let cases: [(&str, serde_json::Value, &str); 4] = [
        ("/skins/0/joints", json!([2]), "joint 1 of a skin with 1"),
        ("/skins/0/joints", json!([]), "0 joints"),
        ("/skins/0/joints", json!([2, 44]), "node 44"),
        ("/nodes/0/skin", json!(5), "skin 5"),
    ];
    for (place, value, reason) in cases {
        let mut file = skinned();
        *file.json.pointer_mut(place).unwrap() = value;
        let message = file.error();
        assert!(message.contains(reason), "{message}");
    }
    let mut file = skinned();
    let short = file.floats("MAT4", &[0.0; 16]);
    file.json["skins"][0]["inverseBindMatrices"] = short.into();
    assert!(file.error().contains("2 joints and 1 inverse"));
}
