//! Small glTF files, made by hand.

use serde_json::{Value, json};
use shadowscope::scene::{Scene, gltf::load};
use std::path::Path;

pub const I8: u32 = 5120;
pub const U8: u32 = 5121;
pub const I16: u32 = 5122;
pub const U16: u32 = 5123;
pub const U32: u32 = 5125;
pub const F32: u32 = 5126;

/// A file's JSON and binary chunk.
#[derive(Clone)]
pub struct File {
    pub json: Value,
    pub bin: Vec<u8>,
}

impl File {
    pub fn new() -> Self {
        Self { json: json!({ "asset": { "version": "2.0" } }), bin: Vec::new() }
    }

    /// One node with one indexed triangle in the xy plane, facing +z.
    pub fn triangle() -> Self {
        let mut file = Self::new();
        let positions = file.floats("VEC3", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
        let indices = file.shorts("SCALAR", &[0, 1, 2]);
        file.push("meshes", json!({ "primitives": [{ "attributes": { "POSITION": positions }, "indices": indices }] }));
        file.push("nodes", json!({ "mesh": 0 }));
        file
    }

    /// Appends to a list of the file and gives the index.
    pub fn push(&mut self, list: &str, value: Value) -> usize {
        let root = self.json.as_object_mut().unwrap();
        let list = root.entry(list).or_insert_with(|| json!([])).as_array_mut().unwrap();
        list.push(value);
        list.len() - 1
    }

    pub fn view(&mut self, bytes: &[u8]) -> usize {
        let offset = self.bin.len().next_multiple_of(4);
        self.bin.resize(offset, 0);
        self.bin.extend_from_slice(bytes);
        self.push("bufferViews", json!({ "buffer": 0, "byteOffset": offset, "byteLength": bytes.len() }))
    }

    pub fn accessor(&mut self, bytes: &[u8], component: u32, kind: &str, count: usize) -> usize {
        let view = self.view(bytes);
        self.push("accessors", json!({ "bufferView": view, "componentType": component, "type": kind, "count": count }))
    }

    pub fn floats(&mut self, kind: &str, values: &[f32]) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        self.accessor(&bytes, F32, kind, values.len() / width(kind))
    }

    pub fn shorts(&mut self, kind: &str, values: &[u16]) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        self.accessor(&bytes, U16, kind, values.len() / width(kind))
    }

    /// The first primitive of the first mesh.
    pub fn primitive(&mut self) -> &mut Value {
        &mut self.json["meshes"][0]["primitives"][0]
    }

    /// Gives the triangle's material a texture with this image; the texture info is `info`.
    pub fn texture(&mut self, image: Value, mut info: Value) {
        let image = self.push("images", image);
        info["index"] = self.push("textures", json!({ "source": image })).into();
        let material = self.push("materials", json!({ "pbrMetallicRoughness": { "baseColorTexture": info } }));
        self.primitive()["material"] = material.into();
    }

    pub fn glb(&self) -> Vec<u8> {
        let mut json = self.json.clone();
        if !self.bin.is_empty() && json["buffers"].is_null() {
            json["buffers"] = json!([{ "byteLength": self.bin.len() }]);
        }
        let mut text = json.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let mut bin = self.bin.clone();
        bin.resize(bin.len().next_multiple_of(4), 0);
        let mut data = b"glTF".to_vec();
        data.extend(2u32.to_le_bytes());
        data.extend((12 + 8 + text.len() as u32 + 8 + bin.len() as u32).to_le_bytes());
        data.extend((text.len() as u32).to_le_bytes());
        data.extend(b"JSON");
        data.extend(text);
        data.extend((bin.len() as u32).to_le_bytes());
        data.extend(b"BIN\0");
        data.extend(bin);
        data
    }

    pub fn load(&self) -> Scene {
        load_bytes("scene.glb", &self.glb()).unwrap()
    }

    pub fn error(&self) -> String {
        error_of("scene.glb", &self.glb())
    }
}

fn width(kind: &str) -> usize {
    match kind {
        "SCALAR" => 1,
        "VEC2" => 2,
        "VEC3" => 3,
        "VEC4" => 4,
        "MAT4" => 16,
        _ => panic!("{kind}"),
    }
}

pub fn load_bytes(name: &str, bytes: &[u8]) -> anyhow::Result<Scene> {
    let folder = tempfile::tempdir().unwrap();
    load_in(folder.path(), name, bytes)
}

pub fn load_in(folder: &Path, name: &str, bytes: &[u8]) -> anyhow::Result<Scene> {
    let path = folder.join(name);
    std::fs::write(&path, bytes).unwrap();
    load(&path)
}

/// The message of a file that must be refused: one line that names the file.
pub fn error_of(name: &str, bytes: &[u8]) -> String {
    one_sentence(name, load_bytes(name, bytes))
}

pub fn one_sentence(name: &str, result: anyhow::Result<Scene>) -> String {
    let message = format!("{:#}", result.expect_err("must be refused"));
    assert!(message.contains(name), "{message}");
    assert!(!message.contains('\n'), "{message}");
    assert!(message.len() < 400, "{message}");
    message
}

pub fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::new();
    for group in bytes.chunks(3) {
        let bits = u32::from_be_bytes([0, group[0], *group.get(1).unwrap_or(&0), *group.get(2).unwrap_or(&0)]);
        for i in 0..4 {
            let letter = LETTERS[(bits >> (18 - 6 * i) & 63) as usize];
            text.push(if i <= group.len() { letter.into() } else { '=' });
        }
    }
    text
}

/// An image of two texels: red at the left, blue half see-through at the right.
pub fn picture(format: image::ImageFormat) -> Vec<u8> {
    let image = image::RgbaImage::from_raw(2, 1, vec![255, 0, 0, 255, 0, 0, 255, 128]).unwrap();
    let mut bytes = std::io::Cursor::new(Vec::new());
    match format {
        image::ImageFormat::Jpeg => image::DynamicImage::from(image).into_rgb8().write_to(&mut bytes, format),
        _ => image.write_to(&mut bytes, format),
    }
    .unwrap();
    bytes.into_inner()
}
