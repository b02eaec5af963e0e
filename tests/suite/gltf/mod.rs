//! The glTF loader, on small files made here.

mod animation;
mod file;
mod geometry;
mod malformed;
mod material;
pub mod motion;
mod nodes;
mod origin;
mod packed;
mod surfaces;
mod views;

use file::{File, base64, load_bytes, load_in, one_sentence, picture};
use glam::Vec3;
use serde_json::json;

#[test]
fn a_glb_with_one_triangle() {
    let scene = File::triangle().load();
    assert_eq!(scene.name, "scene");
    assert_eq!(scene.nodes.len(), 1);
    assert_eq!(scene.nodes[0].meshes, [0]);
    assert_eq!(scene.meshes.len(), 1);
    let mesh = &scene.meshes[0];
    assert_eq!(mesh.positions, [Vec3::ZERO, Vec3::X, Vec3::Y]);
    assert_eq!(mesh.normals, [Vec3::Z; 3]);
    assert_eq!(mesh.uvs.len(), 3);
    assert_eq!(mesh.indices, [0, 1, 2]);
    assert_eq!(scene.materials[mesh.material as usize].base_color, glam::Vec4::ONE);
    assert!(scene.notes.is_empty(), "{:?}", scene.notes);
}

#[test]
fn external_files_with_percent_encoded_names_in_a_subfolder() {
    let mut file = File::triangle();
    let uvs = file.floats("VEC2", &[0.0; 6]);
    file.primitive()["attributes"]["TEXCOORD_0"] = uvs.into();
    file.texture(json!({ "uri": "my%20parts/red%20%C3%A9.png" }), json!({}));
    file.json["buffers"] = json!([{ "uri": "./my%20parts/data.bin", "byteLength": file.bin.len() }]);
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("my parts")).unwrap();
    std::fs::write(folder.path().join("my parts/data.bin"), &file.bin).unwrap();
    std::fs::write(folder.path().join("my parts/red é.png"), picture(image::ImageFormat::Png)).unwrap();
    let scene = load_in(folder.path(), "place.gltf", file.json.to_string().as_bytes()).unwrap();
    assert_eq!(scene.name, "place");
    assert_eq!(scene.meshes[0].positions[1], Vec3::X);
    assert_eq!(scene.textures[0].rgba[..4], [255, 0, 0, 255]);
}

#[test]
fn data_uris() {
    let mut file = File::triangle();
    let uri = format!("data:application/octet-stream;base64,{}", base64(&file.bin));
    file.json["buffers"] = json!([{ "uri": uri, "byteLength": file.bin.len() }]);
    let image = format!("data:image/png;base64,{}", base64(&picture(image::ImageFormat::Png)));
    file.texture(json!({ "uri": image }), json!({}));
    // With a byte order mark and white space, as some editors save.
    let text = format!("\u{feff} \n{}", file.json);
    let scene = load_bytes("scene.gltf", text.as_bytes()).unwrap();
    assert_eq!(scene.meshes[0].positions, [Vec3::ZERO, Vec3::X, Vec3::Y]);
    assert_eq!(scene.textures[0].rgba, [255, 0, 0, 255, 0, 0, 255, 128]);
}

#[test]
fn uris_that_lead_out_of_the_folder_are_refused() {
    let outer = tempfile::tempdir().unwrap();
    std::fs::write(outer.path().join("data.bin"), &File::triangle().bin).unwrap();
    let folder = outer.path().join("inner");
    std::fs::create_dir(&folder).unwrap();
    let absolute = outer.path().join("data.bin").to_string_lossy().into_owned();
    for uri in [
        "../data.bin",
        "%2e%2e/data.bin",
        "a/../../data.bin",
        "..\\data.bin",
        "file:///data.bin",
        "C:/data.bin",
        &absolute,
    ] {
        let mut file = File::triangle();
        file.json["buffers"] = json!([{ "uri": uri, "byteLength": file.bin.len() }]);
        let result = load_in(&folder, "scene.gltf", file.json.to_string().as_bytes());
        let message = one_sentence("scene.gltf", result);
        assert!(message.contains("buffer 0") && message.contains("outside the file's folder"), "{uri}: {message}");
    }
}

#[test]
fn nothing_is_fetched_from_the_network() {
    for uri in ["http://127.0.0.1:9/data.bin", "https://example.org/data.bin", "HTTPS://example.org"] {
        let mut file = File::triangle();
        file.json["buffers"] = json!([{ "uri": uri, "byteLength": file.bin.len() }]);
        let message = file::error_of("scene.gltf", file.json.to_string().as_bytes());
        assert!(
            message.contains("buffer 0 lies on the network") && message.contains("download it"),
            "{uri}: {message}"
        );
    }
}

#[test]
fn required_extensions_that_are_not_known_are_refused_by_name() {
    let mut file = File::triangle();
    file.json["extensionsRequired"] = json!(["KHR_mesh_quantization", "KHR_gaussian_splatting", "MPEG_media"]);
    let message = file.error();
    assert!(message.contains("requires KHR_gaussian_splatting, MPEG_media"), "{message}");
    assert!(!message.contains("quantization"), "{message}");
}

#[test]
fn extensions_that_only_shade_are_noted() {
    let mut file = File::triangle();
    file.json["extensionsRequired"] = json!(["KHR_materials_unlit", "KHR_texture_transform"]);
    file.json["extensionsUsed"] = json!(["KHR_materials_unlit", "KHR_materials_sheen", "VENDOR_thing"]);
    let notes = file.load().notes;
    assert_eq!(
        notes,
        [
            "The file requires KHR_materials_unlit and uses KHR_materials_sheen, of which only the base colour is drawn.",
            "The file uses VENDOR_thing, without which it is drawn.",
        ]
    );
    // One that is used, though the file does not say so.
    file.json["nodes"][0]["extensions"] = json!({ "VENDOR_other": 1 });
    assert!(file.load().notes[1].contains("uses VENDOR_other, VENDOR_thing"), "{:?}", file.load().notes);
    file.json["nodes"][0].as_object_mut().unwrap().remove("extensions");
    // What changes nothing that is drawn, and textures, whose materials are drawn without them.
    file.json["extensionsRequired"] = json!(["KHR_animation_pointer", "EXT_texture_avif"]);
    file.json["extensionsUsed"] = json!(["EXT_texture_avif"]);
    let notes = file.load().notes;
    assert_eq!(notes, ["The file requires KHR_animation_pointer, EXT_texture_avif, without which it is drawn."]);
}

/// `extras` may be any JSON on any object.
#[test]
fn extras_of_any_kind_are_passed_over() {
    for extras in [json!([1, "two", {}]), json!("text"), json!(4.5), json!(null), json!(true), json!({ "a": [] })] {
        let mut file = File::triangle();
        let uvs = file.floats("VEC2", &[0.0; 6]);
        file.primitive()["attributes"]["TEXCOORD_0"] = uvs.into();
        file.texture(
            json!({ "uri": format!("data:;base64,{}", base64(&picture(image::ImageFormat::Png))) }),
            json!({}),
        );
        file.json["buffers"] = json!([{ "byteLength": file.bin.len() }]);
        file.json["scenes"] = json!([{ "nodes": [0] }]);
        let mut places = vec![String::new()];
        malformed::collect("", &file.json, &mut places);
        for place in places {
            if let Some(object) = file.json.pointer_mut(&place).and_then(|value| value.as_object_mut()) {
                object.insert("extras".into(), extras.clone());
            }
        }
        assert_eq!(file.load().meshes[0].positions, [Vec3::ZERO, Vec3::X, Vec3::Y], "{extras}");
    }
}

/// Some exporters write 4.0 where glTF asks for a whole number.
#[test]
fn whole_numbers_may_be_written_as_floats() {
    fn widened(value: &mut serde_json::Value) {
        match value {
            serde_json::Value::Number(number) => *value = number.as_f64().unwrap().into(),
            serde_json::Value::Array(items) => items.iter_mut().for_each(widened),
            serde_json::Value::Object(items) => items.values_mut().for_each(widened),
            _ => {}
        }
    }
    let mut file = malformed::rich();
    let plain = file.load();
    file.json["buffers"] = json!([{ "byteLength": file.bin.len() }]);
    widened(&mut file.json);
    assert!(file.json.to_string().contains("\"count\":3.0"));
    let scene = file.load();
    assert_eq!(scene.report(), plain.report());
    assert_eq!(scene.meshes[1].positions, plain.meshes[1].positions);
    file.json["accessors"][0]["count"] = json!(3.5);
    assert!(file.error().contains("not valid glTF"));
}

/// A matrix or scale of zero leaves nothing to look at.
#[test]
fn geometry_without_extent_is_told() {
    let mut file = File::triangle();
    file.json["nodes"][0]["matrix"] = json!(vec![0.0; 16]);
    assert!(file.error().contains("no extent"), "{}", file.error());
    file.json["nodes"] = json!([{ "mesh": 0, "scale": [0, 0, 0], "translation": [4, 5, 6] }]);
    assert!(file.error().contains("no extent"), "{}", file.error());
}

#[test]
fn a_scene_smaller_than_set_ups_can_hold_is_told() {
    let mut file = File::triangle();
    file.json["nodes"][0]["scale"] = json!([1e-5, 1e-5, 1e-5]);
    let scene = file.load();
    assert!(scene.notes.iter().any(|note| note.contains("only 1.4e-5 m across") && note.contains("scale it up")));
}
