//! Compressed geometry and textures.

use super::file::{F32, File, I8, I16, U8, U16, U32, error_of, load_in, one_sentence};
use glam::{Vec2, Vec3, Vec4};
use meshopt::{decode_filter_oct, encode_filter_color, encode_filter_exp, encode_filter_oct, encode_index_buffer};
use meshopt::{encode_index_sequence, encode_vertex_buffer};
use serde_json::{Value, json};
use shadowscope::scene::Scene;
use std::f32::consts::TAU;
use std::f64::consts::PI;
use std::path::Path;

/// Tori of 16 × 10 quads around the y axis, radii 2 and 0.5, as Google's encoder wrote them (draco3d 1.5.7): texture
/// coordinates and the first two colours say how far around a vertex lies.
const TORI: [&str; 3] = ["edgebreaker", "valence", "sequential"];

fn torus(name: &str) -> Vec<u8> {
    std::fs::read(format!("tests/data/gltf/torus-{name}.glb")).unwrap()
}

fn check_torus(scene: &Scene, name: &str) {
    let mesh = &scene.meshes[0];
    assert_eq!(mesh.indices.len(), 3 * 320, "{name}");
    let mut area = 0.0;
    for t in mesh.indices.chunks_exact(3) {
        let [a, b, c] = [t[0], t[1], t[2]].map(|i| mesh.positions[i as usize].as_dvec3());
        let normal = (b - a).cross(c - a);
        area += normal.length() / 2.0;
        let outwards = mesh.normals[t[0] as usize].as_dvec3();
        assert!(normal.dot(outwards) > 0.0, "{name}: a triangle is turned over");
    }
    // A little less than that of the torus, 4 π² R r.
    assert!((0.9..1.0).contains(&(area / (4.0 * PI * PI))), "{name}: {area}");
    for i in 0..mesh.positions.len() {
        let [u, v] = mesh.uvs[i].to_array();
        let ((sin, cos), (up, out)) = ((TAU * u).sin_cos(), (TAU * v).sin_cos());
        let expected = Vec3::new((2.0 + 0.5 * out) * cos, 0.5 * up, (2.0 + 0.5 * out) * sin);
        assert!(mesh.positions[i].distance(expected) < 8e-3, "{name}: {} for {expected}", mesh.positions[i]);
        assert!(mesh.normals[i].dot(Vec3::new(out * cos, up, out * sin)) > 0.999, "{name}: normal {i}");
        let color = Vec4::new(u, v, 0.0, 1.0);
        assert!(mesh.colors[i].abs_diff_eq(color, 3e-3), "{name}: {} for {color}", mesh.colors[i]);
    }
}

#[test]
fn draco_meshes_of_every_method() {
    let folder = tempfile::tempdir().unwrap();
    for name in TORI {
        let scene = load_in(folder.path(), "torus.glb", &torus(name)).unwrap();
        check_torus(&scene, name);
        assert!(scene.notes.is_empty(), "{:?}", scene.notes);
    }
}

/// Bytes of the compressed data changed: a sentence or another shape, never a panic.
#[test]
fn broken_draco_data_is_refused_in_a_sentence() {
    let folder = tempfile::tempdir().unwrap();
    let mut random = super::super::common::Random(7);
    let mut refused = 0;
    for name in TORI {
        let good = torus(name);
        let data = good.windows(5).position(|w| w == b"DRACO").unwrap();
        for _ in 0..400 {
            let mut bytes = good.clone();
            for _ in 0..3 {
                let at = data + (random.next() * (bytes.len() - data) as f32) as usize;
                bytes[at] = (random.next() * 256.0) as u8;
            }
            if let Err(error) = load_in(folder.path(), "torus.glb", &bytes) {
                one_sentence("torus.glb", Err(error));
                refused += 1;
            }
        }
        let mut bytes = good;
        bytes[data] = b'X';
        let message = error_of("torus.glb", &bytes);
        assert!(message.contains("cannot be unpacked: Draco"), "{message}");
    }
    assert!(refused > 300, "{refused}");
}

#[test]
fn draco_extensions_that_do_not_fit() {
    let good = torus("edgebreaker");
    let replaced = |from: &str, to: &str| {
        assert_eq!(from.len(), to.len());
        let at = good.windows(from.len()).position(|w| w == from.as_bytes()).unwrap();
        [&good[..at], to.as_bytes(), &good[at + from.len()..]].concat()
    };
    for (from, to, reason) in [
        ("\"POSITION\":0", "\"POSITION\":9", "no attribute for POSITION"),
        ("n\":{\"bufferView\":", "n\":{\"bufferview\":", "its bufferView is no whole number"),
        ("\"indices\":0,", "\"padding\":0,", "without an accessor for its indices"),
        ("\"type\":\"VEC3\"", "\"type\":\"VEC2\"", "components"),
    ] {
        let bytes = replaced(from, to);
        let result = load_in(tempfile::tempdir().unwrap().path(), "torus.glb", &bytes);
        if let Err(error) = result {
            let message = one_sentence("torus.glb", Err(error));
            assert!(message.contains(reason), "{from}: {message}");
        } else {
            // The accessor's type is not asked: the data has its own.
            assert!(to.contains("VEC2"), "{from}");
        }
    }
}

/// A compressed buffer view in a buffer that stands for the uncompressed one too.
fn meshopt_view(file: &mut File, data: &[u8], count: usize, stride: usize, mode: &str, filter: &str) -> usize {
    let offset = file.bin.len().next_multiple_of(4);
    file.bin.resize(offset, 0);
    file.bin.extend_from_slice(data);
    let extension = json!({ "buffer": 0, "byteOffset": offset, "byteLength": data.len(), "byteStride": stride,
        "count": count, "mode": mode, "filter": filter });
    let mut view =
        json!({ "buffer": 1, "byteLength": count * stride, "extensions": { "EXT_meshopt_compression": extension } });
    if mode == "ATTRIBUTES" {
        view["byteStride"] = stride.into();
    }
    file.push("bufferViews", view)
}

fn accessor(file: &mut File, view: usize, component: u32, kind: &str, count: usize, normalized: bool) -> Value {
    let accessor = json!({ "bufferView": view, "componentType": component, "type": kind, "count": count, "normalized": normalized });
    file.push("accessors", accessor).into()
}

/// A grid of 9 × 9 vertices with everything that the extension knows.
fn grid(sequence: bool) -> File {
    let places: Vec<[f32; 2]> = (0..81).map(|i| [(i % 9) as f32 / 8.0, (i / 9) as f32 / 8.0]).collect();
    let corners = |i: u32| [i, i + 1, i + 9, i + 9, i + 1, i + 10];
    let indices: Vec<u32> = (0..72).filter(|i| i % 9 < 8).flat_map(corners).collect();
    let mut file = File::new();
    let positions: Vec<[f32; 3]> = places.iter().map(|[x, z]| [*x, 0.25, *z]).collect();
    let data =
        encode_vertex_buffer(&encode_filter_exp::<3>(&positions, 15, meshopt::EncodeExpMode::SharedVector)).unwrap();
    let view = meshopt_view(&mut file, &data, 81, 12, "ATTRIBUTES", "EXPONENTIAL");
    let positions = accessor(&mut file, view, F32, "VEC3", 81, false);
    let normals: Vec<[f32; 4]> =
        places.iter().map(|[x, z]| Vec4::new(x - 0.5, 1.0, z - 0.5, 0.0).normalize().to_array()).collect();
    let data = encode_vertex_buffer(&encode_filter_oct::<i8>(&normals, 8)).unwrap();
    let view = meshopt_view(&mut file, &data, 81, 4, "ATTRIBUTES", "OCTAHEDRAL");
    let normals = accessor(&mut file, view, I8, "VEC3", 81, true);
    let colors: Vec<[f32; 4]> = places.iter().map(|[x, z]| [*x, *z, 0.5, 1.0]).collect();
    let data = encode_vertex_buffer(&encode_filter_color::<u8>(&colors, 8)).unwrap();
    let view = meshopt_view(&mut file, &data, 81, 4, "ATTRIBUTES", "COLOR");
    let colors = accessor(&mut file, view, U8, "VEC4", 81, true);
    let uvs: Vec<[u16; 2]> = places.iter().map(|uv| uv.map(|x| (x * 65535.0) as u16)).collect();
    let data = encode_vertex_buffer(&uvs).unwrap();
    let view = meshopt_view(&mut file, &data, 81, 4, "ATTRIBUTES", "NONE");
    let uvs = accessor(&mut file, view, U16, "VEC2", 81, true);
    let (data, mode) = match sequence {
        true => (encode_index_sequence(&indices, 81).unwrap(), "INDICES"),
        false => (encode_index_buffer(&indices, 81).unwrap(), "TRIANGLES"),
    };
    let (size, component) = if sequence { (4, U32) } else { (2, U16) };
    let view = meshopt_view(&mut file, &data, indices.len(), size, mode, "NONE");
    let indices = accessor(&mut file, view, component, "SCALAR", indices.len(), false);
    let attributes = json!({ "POSITION": positions, "NORMAL": normals, "COLOR_0": colors, "TEXCOORD_0": uvs });
    file.push("meshes", json!({ "primitives": [{ "attributes": attributes, "indices": indices, "material": 0 }] }));
    file.push("nodes", json!({ "mesh": 0 }));
    let image = json!({ "uri": "data:image/png;base64,".to_owned()
        + &super::file::base64(&super::file::picture(image::ImageFormat::Png)) });
    file.texture(image, json!({}));
    file.json["extensionsRequired"] = json!(["EXT_meshopt_compression"]);
    file.json["buffers"] = json!([{ "byteLength": file.bin.len() },
        { "byteLength": 100_000, "extensions": { "EXT_meshopt_compression": { "fallback": true } } }]);
    file
}

#[test]
fn meshopt_views_of_every_mode_and_filter() {
    for sequence in [false, true] {
        let scene = grid(sequence).load();
        let mesh = &scene.meshes[0];
        assert_eq!((mesh.positions.len(), mesh.indices.len()), (81, 3 * 128));
        for i in 0..81 {
            let place = Vec2::new((i % 9) as f32, (i / 9) as f32) / 8.0;
            assert!(mesh.positions[i].distance(Vec3::new(place.x, 0.25, place.y)) < 1e-4, "{}", mesh.positions[i]);
            assert!(mesh.uvs[i].distance(place) < 1e-4);
            let normal = Vec3::new(place.x - 0.5, 1.0, place.y - 0.5).normalize();
            assert!(mesh.normals[i].distance(normal) < 0.02, "{} for {normal}", mesh.normals[i]);
            let color = Vec4::new(place.x, place.y, 0.5, 1.0);
            assert!(mesh.colors[i].distance(color) < 0.02, "{} for {color}", mesh.colors[i]);
        }
        let mut area = 0.0;
        for t in mesh.indices.chunks_exact(3) {
            let [a, b, c] = [t[0], t[1], t[2]].map(|i| mesh.positions[i as usize]);
            area += (b - a).cross(c - a).length() / 2.0;
        }
        assert!((area - 1.0).abs() < 1e-3, "{area}");
        assert!(scene.notes.is_empty(), "{:?}", scene.notes);
    }
    // Filters of 16 bits: what the loader's view unpacks to is what the library gives.
    let normals = [[0.6f32, 0.0, 0.8, 0.0], [0.0, -1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];
    let packed = encode_filter_oct::<i16>(&normals, 12);
    let mut plain = packed.clone();
    decode_filter_oct(&mut plain);
    let mut file = File::triangle();
    let data = encode_vertex_buffer(&packed).unwrap();
    let view = meshopt_view(&mut file, &data, 3, 8, "ATTRIBUTES", "OCTAHEDRAL");
    let view = accessor(&mut file, view, I16, "VEC3", 3, true);
    file.primitive()["attributes"]["NORMAL"] = view;
    let shares = plain.iter().map(|n| Vec3::new(n[0].into(), n[1].into(), n[2].into()).normalize());
    file.json["buffers"] = json!([{ "byteLength": file.bin.len() },
        { "byteLength": 24, "extensions": { "KHR_meshopt_compression": { "fallback": true } } }]);
    let loaded = file.load().meshes[0].normals.clone();
    assert!(shares.zip(&loaded).all(|(a, b)| a.distance(*b) < 1e-4), "{loaded:?}");
}

#[test]
fn broken_meshopt_data_is_refused_in_a_sentence() {
    for (key, value, reason) in [
        ("count", json!(4_000_000_000u64), "claims"),
        ("count", json!(u64::MAX), "claims"),
        ("byteStride", json!(6), "multiple of 4"),
        ("byteStride", json!(260), "multiple of 4"),
        ("mode", json!("POINTS"), "mode"),
        ("filter", json!("QUATERNION"), "filter"),
        ("byteLength", json!(9_999_999), "ends at byte"),
        ("byteLength", json!(20), "damaged"),
        ("buffer", json!(4), "not there"),
        ("byteOffset", json!("far"), "no whole number"),
    ] {
        let mut file = grid(false);
        file.json["bufferViews"][0]["extensions"]["EXT_meshopt_compression"][key] = value.clone();
        let message = file.error();
        assert!(message.contains("buffer view 0 cannot be unpacked") && message.contains(reason), "{key}: {message}");
    }
    let good = grid(false);
    let folder = tempfile::tempdir().unwrap();
    let mut random = super::super::common::Random(3);
    for _ in 0..1000 {
        let mut file = good.clone();
        for _ in 0..2 {
            let at = (random.next() * file.bin.len() as f32) as usize;
            file.bin[at] = (random.next() * 256.0) as u8;
        }
        if let Err(error) = load_in(folder.path(), "grid.glb", &file.glb()) {
            one_sentence("grid.glb", Err(error));
        }
    }
}

/// A picture of 20 × 12 texels: red, clear blue, green and half clear yellow in tiles of four.
const TILES: [(usize, [u8; 4]); 4] = [
    (20 + 2, [255, 0, 0, 255]),
    (20 + 14, [0, 0, 255, 0]),
    (20 * 9 + 3, [40, 200, 40, 255]),
    (20 * 9 + 17, [200, 200, 60, 128]),
];

fn tiled(bytes: &[u8]) -> File {
    let mut file = File::triangle();
    let uvs = file.floats("VEC2", &[0.0, 0.0, 1.0, 0.0, 0.0, 1.0]);
    file.primitive()["attributes"]["TEXCOORD_0"] = uvs.into();
    let image = file.view(bytes);
    file.texture(json!({ "bufferView": image, "mimeType": "image/ktx2" }), json!({}));
    file.json["textures"][0] = json!({ "extensions": { "KHR_texture_basisu": { "source": 0 } } });
    file.json["extensionsRequired"] = json!(["KHR_texture_basisu"]);
    file
}

#[test]
fn basis_textures_of_every_kind() {
    for name in ["uastc", "uastc-zstd", "etc1s-mips"] {
        let bytes = std::fs::read(Path::new("tests/data/gltf").join(format!("tiles-{name}.ktx2"))).unwrap();
        let scene = tiled(&bytes).load();
        let texture = &scene.textures[0];
        assert_eq!((texture.width, texture.height, texture.rgba.len()), (20, 12, 20 * 12 * 4), "{name}");
        for (texel, color) in TILES {
            let found = &texture.rgba[4 * texel..][..4];
            // Where nothing is seen, any colour will do.
            let near = found.iter().zip(color).skip(if color[3] == 0 { 3 } else { 0 });
            assert!(near.clone().all(|(a, b)| a.abs_diff(b) <= 12), "{name}: {found:?} for {color:?}");
        }
        assert!(scene.notes.is_empty(), "{:?}", scene.notes);
    }
}

/// Bytes changed and cut: drawn with what comes of it, or without a texture, and then a note says so.
#[test]
fn broken_basis_textures_are_left_out() {
    let mut random = super::super::common::Random(11);
    for name in ["uastc", "uastc-zstd", "etc1s-mips"] {
        let good = std::fs::read(Path::new("tests/data/gltf").join(format!("tiles-{name}.ktx2"))).unwrap();
        for round in 0..300 {
            let mut bytes = good.clone();
            for _ in 0..2 {
                let at = (random.next() * bytes.len() as f32) as usize;
                bytes[at] = (random.next() * 256.0) as u8;
            }
            if round % 5 == 0 {
                bytes.truncate((random.next() * bytes.len() as f32) as usize);
            }
            let scene = tiled(&bytes).load();
            assert_eq!(scene.textures.is_empty(), scene.notes.iter().any(|note| note.contains("without its texture")));
        }
        for (at, value) in [(20, u32::MAX), (24, u32::MAX), (36, 6), (40, 200), (80 + 8, u32::MAX), (80 + 20, 1 << 20)]
        {
            let mut bytes = good.clone();
            bytes[at..at + 4].copy_from_slice(&value.to_le_bytes());
            let scene = tiled(&bytes).load();
            assert!(
                scene.notes.iter().any(|note| note.contains("image 0 cannot be decoded")),
                "{name} {at}: {:?}",
                scene.notes
            );
        }
    }
}
