//! Files that are damaged: one clear sentence, never a panic.

use super::file::{File, error_of, load_bytes, load_in, one_sentence, picture};
use serde_json::{Value, json};
use shadowscope::scene::Clock;
use shadowscope::scene::geometry::Geometry;
use std::path::Path;

#[test]
fn missing_files_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let result = shadowscope::scene::gltf::load(&folder.path().join("nowhere.glb"));
    assert!(one_sentence("nowhere.glb", result).contains("no such file"));
    one_sentence("", shadowscope::scene::gltf::load(folder.path()));
    let mut file = File::triangle();
    file.json["buffers"] = json!([{ "uri": "gone.bin", "byteLength": 44 }]);
    let message = error_of("scene.gltf", file.json.to_string().as_bytes());
    assert!(message.contains("buffer 0") && message.contains("gone.bin"), "{message}");
}

#[test]
fn containers_that_are_none() {
    let glb = File::triangle().glb();
    for (bytes, reason) in [
        (b"".to_vec(), "not a glTF file"),
        (b"PK\x03\x04 something else".to_vec(), "not a glTF file"),
        (b"glTF".to_vec(), "ends early"),
        (b"glTF\x02\0\0\0\x05\0\0\0".to_vec(), "ends early"),
        (b"glTF\x01\0\0\0\x0c\0\0\0".to_vec(), "version 1"),
        (glb[..glb.len() / 2].to_vec(), "ends early"),
        (glb[..glb.len() - 1].to_vec(), "ends early"),
        ([&glb[..16], b"BIN\0", &glb[20..]].concat(), "not JSON"),
        ([&glb[..12], &[255; 4], &glb[16..]].concat(), "ends early"),
    ] {
        let message = error_of("scene.glb", &bytes);
        assert!(message.contains(reason), "{message}");
    }
}

#[test]
fn json_that_is_none() {
    for (text, reason) in [
        ("{", "not valid glTF"),
        ("{}", "version"),
        (r#"{"asset":{"version":"1.0"}}"#, "version \"1.0\""),
        (r#"{"asset":{"version":"2.0"}}"#, "no triangles"),
        (r#"{"asset":{"version":"2.0"},"nodes":7}"#, "not valid glTF"),
        (r#"{"asset":{"version":"2.0"},"nodes":[{"mesh":-1}]}"#, "not valid glTF"),
        (r#"{"asset":{"version":"2.0"},"nodes":[[0]],"scenes":[3],"animations":{"a":1}}"#, "not valid glTF"),
        ("{\"asset\":{\"version\":\"2.0\"},\n\"scene\":\"a\nb\"}", "not valid glTF"),
    ] {
        let message = error_of("scene.gltf", text.as_bytes());
        assert!(message.contains(reason), "{message}");
    }
    // In a .glb it may be no object at all.
    for json in ["[1, 2]  ", "4.0     "] {
        let header = [&b"glTF\x02\0\0\0"[..], &28u32.to_le_bytes(), &8u32.to_le_bytes(), b"JSON"].concat();
        let message = error_of("scene.glb", &[&header, json.as_bytes()].concat());
        assert!(message.contains("version"), "{message}");
    }
    let deep = format!("{{\"asset\":{}", "[".repeat(100_000));
    error_of("scene.gltf", deep.as_bytes());
}

#[test]
fn accessors_out_of_range() {
    // The triangle's accessor 0 are its positions, 1 its indices.
    let cases: [(&str, Value, &str, &str); 17] = [
        ("/accessors/0/count", json!(4), "accessor 0", "needs 48 bytes"),
        ("/accessors/0/count", json!(4_000_000_000u64), "accessor 0", "needs 48000000000 bytes"),
        ("/accessors/0/count", json!(u64::MAX), "accessor 0", "bytes"),
        ("/accessors/0/byteOffset", json!(4), "accessor 0", "needs 40 bytes"),
        ("/accessors/0/byteOffset", json!(u64::MAX), "accessor 0", "bytes"),
        ("/accessors/0/type", json!("VEC2"), "POSITION", "2 components"),
        ("/accessors/0/type", json!("VEC7"), "accessor 0", "unknown type"),
        ("/accessors/0/componentType", json!(5130), "accessor 0", "unknown type"),
        ("/accessors/0/bufferView", json!(40), "accessor 0", "buffer view 40"),
        ("/accessors/1/componentType", json!(5126), "accessor 1", "F32"),
        ("/accessors/1/componentType", json!(5122), "accessor 1", "I16"),
        ("/bufferViews/0/byteLength", json!(4000), "buffer view 0", "byte 4000"),
        ("/bufferViews/0/byteOffset", json!(u64::MAX), "buffer view 0", "buffer 0"),
        ("/bufferViews/0/byteStride", json!(4), "accessor 0", "4 bytes apart"),
        ("/bufferViews/0/byteStride", json!(usize::MAX), "accessor 0", "bytes"),
        ("/bufferViews/0/buffer", json!(2), "accessor 0", "buffer 2"),
        ("/meshes/0/primitives/0/indices", json!(20), "mesh 0", "accessor 20"),
    ];
    for (place, value, what, reason) in cases {
        let mut file = File::triangle();
        file.json["accessors"][0]["byteOffset"] = 0.into();
        file.json["bufferViews"][0]["byteStride"] = 12.into();
        *file.json.pointer_mut(place).unwrap() = value;
        let message = file.error();
        assert!(message.contains(what) && message.contains(reason), "{place}: {message}");
    }
    let mut file = File::triangle();
    file.json["accessors"][0] = json!({ "componentType": 5126, "type": "VEC3", "count": 4_000_000_000u64 });
    assert!(file.error().contains("claims 4000000000 elements without data"));
    file.json["accessors"][0]["count"] = 3.into();
    assert!(file.error().contains("no triangles"), "all zeros");
}

#[test]
fn meshes_that_do_not_fit_together() {
    let mut file = File::triangle();
    file.json["meshes"][0]["name"] = "ship\nwreck".into();
    let far = file.shorts("SCALAR", &[0, 1, 3]);
    file.primitive()["indices"] = far.into();
    let message = file.error();
    assert!(message.contains("mesh 0 \"ship\\nwreck\" has the index 3 but only 3 vertices"), "{message}");

    let mut file = File::triangle();
    let short = file.floats("VEC3", &[0.0; 6]);
    file.primitive()["attributes"]["NORMAL"] = short.into();
    assert!(file.error().contains("NORMAL of mesh 0 has 2 values for 3 vertices"));

    for bad in [f32::NAN, f32::INFINITY] {
        let mut file = File::triangle();
        let positions = file.floats("VEC3", &[0., 0., 0., 1., 0., 0., 0., bad, 0.]);
        file.primitive()["attributes"]["POSITION"] = positions.into();
        assert!(file.error().contains("position of vertex 2 of mesh 0"));
    }
    let mut file = File::triangle();
    file.primitive()["mode"] = 9.into();
    assert!(file.error().contains("unknown mode"));
    file.primitive()["mode"] = 4.into();
    file.primitive()["attributes"] = json!({});
    assert!(file.error().contains("no triangles"));
    let mut file = File::triangle();
    let positions = file.floats("VEC3", &[0., 0., 0., 3e38, 0., 0., 0., 3e38, 0.]);
    file.primitive()["attributes"]["POSITION"] = positions.into();
    assert!(file.error().contains("32-bit floats"));
}

#[test]
fn buffers_that_are_too_short() {
    let mut file = File::triangle();
    file.json["buffers"] = json!([{ "byteLength": 4_000_000_000u64 }]);
    assert!(file.error().contains("buffer 0 should have 4000000000 bytes"));
    file.json["buffers"] = json!([{ "byteLength": file.bin.len() }, { "byteLength": 1 }]);
    assert!(file.error().contains("buffer 1 has no data"));
    let message = error_of("scene.gltf", file.json.to_string().as_bytes());
    assert!(message.contains("buffer 0 has no data"), "{message}");
    for (uri, reason) in [
        ("data:;base64,AAAA", "has 3"),
        ("data:;base64,AA*A", "not valid base64"),
        ("data:;base64,AAAAA", "not valid base64"),
        ("data:text/plain,hello", "not base64"),
        ("data:", "not base64"),
    ] {
        file.json["buffers"] = json!([{ "uri": uri, "byteLength": 44 }]);
        let message = error_of("scene.gltf", file.json.to_string().as_bytes());
        assert!(message.contains("buffer 0") && message.contains(reason), "{message}");
    }
}

/// A file that uses most of what there is.
pub fn rich() -> File {
    let mut file = File::triangle();
    let uvs = file.floats("VEC2", &[0.0, 0.0, 1.0, 0.0, 0.0, 1.0]);
    let joints = file.accessor(&[0; 12], super::file::U8, "VEC4", 3);
    let weights = file.floats("VEC4", &[1., 0., 0., 0., 1., 0., 0., 0., 1., 0., 0., 0.]);
    file.primitive()["attributes"]["TEXCOORD_0"] = uvs.into();
    let mut skinned = file.primitive().clone();
    skinned["attributes"]["JOINTS_0"] = joints.into();
    skinned["attributes"]["WEIGHTS_0"] = weights.into();
    file.push("meshes", json!({ "primitives": [skinned], "weights": [0.5] }));
    let offsets = file.floats("VEC3", &[0.5; 9]);
    file.json["meshes"][1]["primitives"][0]["targets"] = json!([{ "POSITION": offsets }]);
    let image = file.view(&picture(image::ImageFormat::Png));
    let transform = json!({ "extensions": { "KHR_texture_transform": { "rotation": 1, "texCoord": 0 } } });
    file.texture(json!({ "bufferView": image, "mimeType": "image/png" }), transform);
    let translations = file.floats("VEC3", &[0.0, 0.0, 0.0, 5.0, 0.0, 0.0]);
    file.json["nodes"][0]["extensions"] =
        json!({ "EXT_mesh_gpu_instancing": { "attributes": { "TRANSLATION": translations } } });
    file.push("nodes", json!({ "mesh": 1, "skin": 0, "rotation": [0, 0, 0, 1] }));
    file.push(
        "nodes",
        json!({ "children": [1], "camera": 0, "extensions": { "KHR_lights_punctual": { "light": 0 } } }),
    );
    file.push("skins", json!({ "joints": [2] }));
    file.push("cameras", json!({ "type": "perspective", "perspective": { "yfov": 1, "znear": 0.1 } }));
    file.json["extensions"] = json!({ "KHR_lights_punctual": { "lights": [{ "type": "point" }] } });
    file.push("scenes", json!({ "nodes": [0, 2] }));
    let times = file.floats("SCALAR", &[0.0, 1.0]);
    let values = file.floats("VEC4", &[0., 0., 0., 1., 1., 0., 0., 0.]);
    let weights = file.floats("SCALAR", &[0.0, 1.0]);
    file.push(
        "animations",
        json!({
            "samplers": [{ "input": times, "output": values }, { "input": times, "output": weights }],
            "channels": [
                { "sampler": 0, "target": { "node": 2, "path": "rotation" } },
                { "sampler": 1, "target": { "node": 1, "path": "weights" } },
            ],
        }),
    );
    file
}

/// Whether a file opens; if so it also stands at another moment, else it says why not.
fn opens(folder: &Path, bytes: &[u8]) -> bool {
    match load_in(folder, "scene.glb", bytes) {
        Ok(scene) => {
            let clock = Clock { animation: 0, time: 0.5 };
            if let Err(error) = Geometry::new(&scene, 0, clock.time) {
                assert!(error.to_string().contains("scene"), "{error}");
            }
            scene.cameras.iter().for_each(|camera| _ = camera.at(&scene, clock));
            scene.lights.iter().for_each(|light| _ = light.at(&scene, clock));
            true
        }
        Err(error) => {
            one_sentence("scene.glb", Err(error));
            false
        }
    }
}

#[test]
fn bytes_flipped_and_cut_never_panic() {
    let good = rich().glb();
    load_bytes("good.glb", &good).unwrap();
    let mut state = 0x9E37_79B9_7F4A_7C15u64;
    let mut random = |below: usize| {
        // xorshift
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state % below as u64) as usize
    };
    let digits: Vec<usize> = (0..good.len()).filter(|&at| good[at].is_ascii_digit()).collect();
    let folder = tempfile::tempdir().unwrap();
    let mut refused = 0;
    for round in 0..6000 {
        let mut bytes = good.clone();
        match round % 4 {
            // Any byte, to anything.
            0 => {
                for _ in 0..=random(4) {
                    let at = random(bytes.len());
                    bytes[at] = random(256) as u8;
                }
            }
            // A number of the JSON, so that it stays valid.
            1 => {
                let at = digits[random(digits.len())];
                bytes[at] = b'0' + random(10) as u8;
            }
            // The binary chunk, where floats, indices and the image lie.
            2 => {
                let at = bytes.len() - 1 - random(500);
                bytes[at] ^= 1 << random(8);
            }
            _ => bytes.truncate(random(good.len())),
        }
        refused += usize::from(!opens(folder.path(), &bytes));
    }
    assert!((1500..5900).contains(&refused), "{refused}");
}

#[test]
fn every_json_value_replaced_never_panics() {
    let good = rich();
    let mut places = Vec::new();
    collect("", &good.json, &mut places);
    let folder = tempfile::tempdir().unwrap();
    for place in places {
        for value in [
            json!(null),
            json!(-1),
            json!(0),
            json!(1),
            json!(7),
            json!(4_294_967_295u32),
            json!(u64::MAX),
            json!(1e39),
            json!("x"),
            json!([]),
            json!({}),
            json!([[0]]),
        ] {
            let mut file = good.clone();
            *file.json.pointer_mut(&place).unwrap() = value;
            opens(folder.path(), &file.glb());
        }
    }
}

/// The JSON pointers of all values below `value`.
pub fn collect(at: &str, value: &Value, places: &mut Vec<String>) {
    let mut below = |key: String, value: &Value| {
        let place = format!("{at}/{key}");
        collect(&place, value, places);
        places.push(place);
    };
    match value {
        Value::Array(items) => items.iter().enumerate().for_each(|(i, item)| below(i.to_string(), item)),
        Value::Object(items) => items.iter().for_each(|(key, item)| below(key.clone(), item)),
        _ => {}
    }
}

/// Small files that would take more than any memory: each is counted before it is made.
#[test]
fn products_are_counted_before_they_are_made() {
    let mut file = File::triangle();
    let primitive = file.json["meshes"][0]["primitives"][0].clone();
    file.json["meshes"][0]["primitives"] = vec![primitive; 3000].into();
    file.json["nodes"] = vec![json!({ "mesh": 0 }); 20_000].into();
    assert!(file.error().contains("more than the 30000000 that can be drawn"));
    // Zeros that no buffer holds, twice.
    let mut file = File::triangle();
    let many = file.push("accessors", json!({ "componentType": 5126, "type": "VEC3", "count": 4_000_000 }));
    let extension = json!({ "EXT_mesh_gpu_instancing": { "attributes": { "TRANSLATION": many } } });
    file.json["nodes"] = vec![json!({ "mesh": 0, "extensions": extension }); 2].into();
    assert!(file.error().contains("8000000 instances"));
}

#[test]
fn a_scene_without_extent_is_refused_as_such() {
    let mut file = File::triangle();
    file.json["nodes"] = json!([{ "mesh": 0, "scale": [0, 0, 0] }]);
    assert!(file.error().contains("has no extent"));
}

#[test]
fn names_keep_to_their_line() {
    let mut file = File::triangle();
    let odd = format!("odd\n\u{1b}[31m{}", "x".repeat(100_000));
    file.json["cameras"] = json!([{ "type": "perspective", "perspective": { "yfov": 1, "znear": 0.1 }, "name": odd }]);
    file.json["materials"] = json!([{ "name": odd }]);
    file.json["nodes"] = json!([{ "mesh": 0, "name": odd }, { "camera": 0, "translation": [3, 2, 9] }]);
    file.primitive()["material"] = 0.into();
    let scene = file.load();
    for name in [&scene.cameras[0].name, &scene.materials[0].name] {
        assert!(name.starts_with("odd\\n\\u{1b}[31m") && name.chars().count() < 100, "{name}");
    }
}

#[cfg(unix)]
#[test]
fn links_and_pipes_beside_the_file_are_not_followed() {
    let outer = tempfile::tempdir().unwrap();
    std::fs::write(outer.path().join("data.bin"), &File::triangle().bin).unwrap();
    let folder = outer.path().join("inner");
    std::fs::create_dir(&folder).unwrap();
    std::os::unix::fs::symlink("../data.bin", folder.join("out.bin")).unwrap();
    std::fs::write(folder.join("data.bin"), &File::triangle().bin).unwrap();
    std::os::unix::fs::symlink("data.bin", folder.join("in.bin")).unwrap();
    assert!(std::process::Command::new("mkfifo").arg(folder.join("pipe.bin")).status().unwrap().success());
    let load = |uri: &str| {
        let mut file = File::triangle();
        file.json["buffers"] = json!([{ "uri": uri, "byteLength": file.bin.len() }]);
        super::load_in(&folder, "scene.gltf", file.json.to_string().as_bytes())
    };
    assert!(load("in.bin").is_ok());
    assert!(one_sentence("scene.gltf", load("out.bin")).contains("leads out of the folder"));
    assert!(one_sentence("scene.gltf", load("pipe.bin")).contains("a pipe"));
}

/// What shares a few bytes is counted too.
#[test]
fn compressed_views_are_counted_together() {
    let mut file = File::triangle();
    file.bin.resize(1 << 20, 0);
    let claim = json!({ "buffer": 0, "byteLength": 1 << 20, "byteStride": 256, "count": 1 << 22, "mode": "NONE" });
    let view = json!({ "buffer": 0, "byteLength": 36, "extensions": { "EXT_meshopt_compression": claim } });
    for _ in 0..3 {
        file.push("bufferViews", view.clone());
    }
    let last = file.json["bufferViews"].as_array().unwrap().len() - 1;
    for (view, says) in [(last - 1, "its mode is \"NONE\""), (last, "claim 3072 MiB, of 2048 that are unpacked")] {
        file.json["accessors"][0]["bufferView"] = view.into();
        assert!(file.error().contains(says), "{}", file.error());
    }
}

#[test]
fn cameras_and_lights_beyond_a_thousand_are_left_out() {
    let mut file = File::triangle();
    file.json["cameras"] = json!([{ "type": "perspective", "perspective": { "yfov": 1, "znear": 0.1 } }]);
    file.json["extensions"] = json!({ "KHR_lights_punctual": { "lights": [{ "type": "point" }] } });
    let node = json!({ "camera": 0, "extensions": { "KHR_lights_punctual": { "light": 0 } } });
    file.json["nodes"].as_array_mut().unwrap().extend(vec![node; 1002]);
    let scene = file.load();
    let names = |word: &str| scene.cameras.iter().filter(|camera| camera.name.starts_with(word)).count();
    assert_eq!(names("camera 0"), 1000);
    assert!(scene.notes.iter().any(|note| note.starts_with("4 cameras and lights beyond the first 1000")));
}
