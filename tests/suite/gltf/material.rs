//! Materials, textures and texture coordinates.

use super::file::{File, picture};
use glam::{Vec2, Vec4};
use image::ImageFormat;
use serde_json::{Value, json};
use shadowscope::scene::{Filter, Minified, Wrap};
use std::f32::consts::FRAC_PI_2;

/// The triangle with a texture from the binary chunk and two sets of coordinates.
fn textured(info: Value) -> File {
    let mut file = File::triangle();
    let first = file.floats("VEC2", &[0.0, 0.0, 1.0, 0.0, 0.0, 1.0]);
    let second = file.floats("VEC2", &[0.5, 0.5, 0.25, 0.5, 0.5, 0.25]);
    file.primitive()["attributes"]["TEXCOORD_0"] = first.into();
    file.primitive()["attributes"]["TEXCOORD_1"] = second.into();
    let image = file.view(&picture(ImageFormat::Png));
    file.texture(json!({ "bufferView": image, "mimeType": "image/png" }), info);
    file
}

#[test]
fn factor_cutoff_and_sides() {
    let mut file = File::triangle();
    file.json["materials"] = json!([
        { "name": "leaf", "pbrMetallicRoughness": { "baseColorFactor": [0.1, 0.2, 0.3, 0.4] }, "alphaMode": "MASK", "doubleSided": true },
        { "alphaMode": "MASK", "alphaCutoff": 0.25 },
        { "alphaMode": "BLEND" },
        { "alphaMode": "BLEND" },
        { "alphaMode": "BLEND", "name": "not used" },
    ]);
    let primitive = |material: u32| json!({ "attributes": { "POSITION": 0 }, "material": material });
    file.json["meshes"][0]["primitives"] =
        json!([primitive(3), primitive(0), primitive(1), primitive(2), primitive(0)]);
    let scene = file.load();
    let of = |mesh: usize| &scene.materials[scene.meshes[mesh].material as usize];
    assert_eq!(scene.materials.len(), 4);
    assert_eq!(of(1).name, "leaf");
    assert_eq!(of(1).base_color, Vec4::new(0.1, 0.2, 0.3, 0.4));
    assert_eq!((of(1).alpha_cutoff, of(1).double_sided), (Some(0.5), true));
    assert_eq!((of(2).alpha_cutoff, of(2).double_sided), (Some(0.25), false));
    assert_eq!(of(3).alpha_cutoff, None);
    assert_eq!(of(4).name, "leaf");
    assert_eq!(scene.notes, ["2 materials with alphaMode BLEND are drawn as opaque."]);
    file.json["meshes"][0]["primitives"] = json!([primitive(9)]);
    assert!(file.error().contains("material 9"));
}

#[test]
fn the_set_of_texture_coordinates_and_vertex_colours() {
    let mut file = textured(json!({}));
    let mesh = &file.load().meshes[0];
    assert_eq!(mesh.uvs, [Vec2::ZERO, Vec2::X, Vec2::Y]);
    file.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["texCoord"] = 1.into();
    let scene = file.load();
    assert_eq!(scene.meshes[0].uvs[1], Vec2::new(0.25, 0.5));
    assert!(scene.meshes[0].colors.is_empty());
    // Three or four floats, or integers that are shares, whether they say so or not.
    let floats = file.floats("VEC4", &[1.0, 0.5, 0.25, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 0.5]);
    let opaque = file.floats("VEC3", &[1.0, 0.5, 0.25, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0]);
    let bytes = file.accessor(&[255, 51, 0, 102, 0, 0, 0, 255, 255, 255, 255, 255], super::file::U8, "VEC4", 3);
    let words = file.shorts("VEC3", &[65535, 13107, 0, 0, 0, 0, 65535, 65535, 65535]);
    file.json["accessors"][bytes]["normalized"] = true.into();
    for (accessor, expected) in [
        (floats, [1.0, 0.5, 0.25, 0.0]),
        (opaque, [1.0, 0.5, 0.25, 1.0]),
        (bytes, [1.0, 0.2, 0.0, 0.4]),
        (words, [1.0, 0.2, 0.0, 1.0]),
    ] {
        file.primitive()["attributes"]["COLOR_0"] = accessor.into();
        let scene = file.load();
        assert!(scene.meshes[0].colors[0].abs_diff_eq(Vec4::from(expected), 1e-6), "{:?}", scene.meshes[0].colors);
        assert!(scene.notes.is_empty(), "{:?}", scene.notes);
    }
    let short = file.floats("VEC3", &[1.0; 6]);
    file.primitive()["attributes"]["COLOR_0"] = short.into();
    assert!(file.error().contains("COLOR_0 of mesh 0 has 2 values for 3 vertices"));
    file.primitive()["attributes"]["COLOR_0"] = floats.into();
    file.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["texCoord"] = 5.into();
    assert!(file.load().notes.iter().any(|note| note.contains("no texture coordinates")));
}

#[test]
fn texture_coordinates_that_are_not_finite() {
    let mut file = textured(json!({}));
    let uvs = file.floats("VEC2", &[f32::NAN, 0.0, 1.0, 0.0, 0.0, 1.0]);
    file.primitive()["attributes"]["TEXCOORD_0"] = uvs.into();
    let scene = file.load();
    assert_eq!(scene.meshes[0].uvs, [Vec2::ZERO, Vec2::X, Vec2::Y]);
    assert!(scene.notes[0].contains("texture coordinates"));
}

#[test]
fn sampler_wrap_modes() {
    let mut file = textured(json!({}));
    assert_eq!(file.load().textures[0].wrap, [Wrap::Repeat; 2]);
    file.json["samplers"] = json!([{ "wrapS": 33071, "wrapT": 33648 }, { "wrapT": 10497 }]);
    file.json["textures"] = json!([{ "source": 0, "sampler": 0 }]);
    assert_eq!(file.load().textures[0].wrap, [Wrap::Clamp, Wrap::Mirror]);
    // The same image under two samplers is two textures; under equal ones it is one.
    file.json["textures"] = json!([{ "source": 0, "sampler": 0 }, { "source": 0, "sampler": 1 }, { "source": 0 }]);
    let material = |texture: u32| json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": texture } } });
    file.json["materials"] = json!([material(0), material(1), material(2)]);
    let primitive = |material: u32| json!({ "attributes": { "POSITION": 0, "TEXCOORD_0": 2 }, "material": material });
    file.json["meshes"][0]["primitives"] = json!([primitive(0), primitive(1), primitive(2)]);
    let scene = file.load();
    assert_eq!(scene.textures.len(), 2);
    assert_eq!(scene.textures[0].rgba, scene.textures[1].rgba);
    assert_eq!(scene.materials.iter().map(|m| m.texture).collect::<Vec<_>>(), [Some(0), Some(1), Some(1)]);
    file.json["textures"][0]["sampler"] = 8.into();
    let scene = file.load();
    assert!(scene.notes[0].contains("sampler 8"), "{:?}", scene.notes);
    assert_eq!(scene.materials.iter().map(|m| m.texture).collect::<Vec<_>>(), [None, Some(0), Some(0)]);
}

#[test]
fn sampler_filters() {
    let mut file = textured(json!({}));
    file.json["textures"] = json!([{ "source": 0, "sampler": 0 }]);
    for (sampler, magnified_nearest, minified) in [
        (json!({}), false, Minified::Mean),
        (json!({ "magFilter": 9729, "minFilter": 9987 }), false, Minified::Mean),
        (json!({ "magFilter": 9728, "minFilter": 9728 }), true, Minified::Nearest),
        (json!({ "magFilter": 9728.0, "minFilter": 9984 }), true, Minified::NearestLevel),
        (json!({ "minFilter": 9986 }), false, Minified::MixedLevels),
        (json!({ "magFilter": 9728, "minFilter": 9985 }), true, Minified::Mean),
    ] {
        file.json["samplers"] = json!([sampler]);
        assert_eq!(file.load().textures[0].filter, Filter { magnified_nearest, minified }, "{sampler}");
    }
}

#[test]
fn texture_transforms_are_baked() {
    let transform = |transform: Value| textured(json!({ "extensions": { "KHR_texture_transform": transform } }));
    let uvs = |file: File| file.load().meshes[0].uvs.clone();
    // The extension's examples: the lower left quarter, turned; and the flipped v axis.
    let turned = uvs(transform(json!({ "offset": [0, 1], "rotation": FRAC_PI_2, "scale": [0.5, 0.5] })));
    for (uv, expected) in turned.iter().zip([Vec2::new(0.0, 1.0), Vec2::new(0.0, 0.5), Vec2::new(0.5, 1.0)]) {
        assert!(uv.abs_diff_eq(expected, 1e-6), "{turned:?}");
    }
    let flipped = uvs(transform(json!({ "offset": [0, 1], "scale": [1, -1] })));
    assert_eq!(flipped, [Vec2::Y, Vec2::ONE, Vec2::ZERO]);
    let second = uvs(transform(json!({ "texCoord": 1, "scale": [2, 4], "extras": { "any": 1 } })));
    assert_eq!(second[1], Vec2::new(0.5, 2.0));
}

#[test]
fn png_jpeg_and_webp_images() {
    for (format, exact) in [(ImageFormat::Png, true), (ImageFormat::WebP, true), (ImageFormat::Jpeg, false)] {
        let mut file = textured(json!({}));
        let image = file.view(&picture(format));
        file.json["images"][0] = json!({ "bufferView": image });
        let texture = &file.load().textures[0];
        assert_eq!((texture.width, texture.height, texture.rgba.len()), (2, 1, 8));
        if exact {
            assert_eq!(texture.rgba, [255, 0, 0, 255, 0, 0, 255, 128]);
        }
        if format == ImageFormat::WebP {
            // As the extension puts it, with no other source.
            file.json["textures"][0] = json!({ "extensions": { "EXT_texture_webp": { "source": 0 } } });
            file.json["extensionsRequired"] = json!(["EXT_texture_webp"]);
            assert_eq!(file.load().textures[0].rgba.len(), 8);
        }
    }
}

#[test]
fn a_texture_without_an_image_we_read_is_left_out() {
    let mut file = textured(json!({}));
    file.json["textures"][0] = json!({ "extensions": { "EXT_texture_avif": { "source": 0 } } });
    let scene = file.load();
    assert_eq!(scene.materials[0].texture, None);
    assert!(scene.notes[0].contains("EXT_texture_avif"), "{:?}", scene.notes);
    assert!(scene.notes[1].contains("no image that can be read"), "{:?}", scene.notes);
}

#[test]
fn old_specular_glossiness_gives_its_diffuse_colour() {
    let mut file = textured(json!({}));
    file.json["materials"] = json!([{ "extensions": { "KHR_materials_pbrSpecularGlossiness": {
        "diffuseFactor": [0.5, 0.25, 0.125, 1], "diffuseTexture": { "index": 0 } } } }]);
    let scene = file.load();
    assert_eq!(scene.materials[0].base_color, Vec4::new(0.5, 0.25, 0.125, 1.0));
    assert_eq!(scene.materials[0].texture, Some(0));
}

#[test]
fn materials_are_drawn_without_images_that_cannot_be_read() {
    let truncated = &picture(ImageFormat::Png)[..40];
    let huge = "iVBORw0KGgoAAAANSUhEUgAP//8AD///CAYAAAA="; // a header of a million texels per side
    // Headers of JPEG, WebP and BMP of as many texels as they can say, with nothing behind.
    let jpeg = "/9j/wAARCP////ADASIAAhEBAxEB/9oADAMBAAIRAxEAPwAAAAAA";
    let webp = "UklGRhoAAABXRUJQVlA4TA0AAAAv////DwAAAAAAAAAAAA==";
    let bmp = "Qk02AAAAAAAAADYAAAAoAAAAYOoAAGDqAAABABgAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA";
    for (image, reason) in [
        (json!({ "uri": format!("data:;base64,{jpeg}") }), "cannot be decoded"),
        (json!({ "uri": format!("data:;base64,{webp}") }), "cannot be decoded"),
        (json!({ "uri": format!("data:;base64,{bmp}") }), "cannot be decoded"),
        (json!({ "uri": "gone.png" }), "gone.png"),
        (json!({ "uri": "../up.png" }), "outside the file's folder"),
        (json!({ "uri": "data:image/png;base64,####" }), "base64"),
        (json!({ "uri": "data:image/png,abc" }), "base64"),
        (json!({ "uri": format!("data:;base64,{}", super::file::base64(truncated)) }), "cannot be decoded"),
        (json!({ "uri": "data:;base64,AAAAAAAA" }), "unknown format"),
        (json!({ "uri": format!("data:;base64,{huge}") }), "cannot be decoded"),
        (json!({ "bufferView": 77 }), "buffer view 77"),
        (json!({}), "no data"),
    ] {
        let mut file = textured(json!({}));
        file.json["images"][0] = image;
        file.json["images"][0]["name"] = "bark".into();
        without(&file, "image 0 \"bark\"", reason);
    }
    let mut file = textured(json!({}));
    file.json["textures"][0]["source"] = 4.into();
    without(&file, "image 4", "has 1");
    file.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["index"] = 6.into();
    without(&file, "texture 6", "has 1");
    // Many are told in a few notes, and those that are there stay where they belong.
    let mut file = textured(json!({}));
    for i in 0..9 {
        let image = file.push("images", json!({ "uri": format!("{i}.png") }));
        let texture = file.push("textures", json!({ "source": image }));
        file.push("materials", json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": texture } } }));
    }
    let primitive = |material: usize| json!({ "attributes": { "POSITION": 0, "TEXCOORD_0": 2 }, "material": material });
    file.json["meshes"][0]["primitives"] = (0..10).rev().map(primitive).collect();
    let scene = file.load();
    let textures: Vec<_> = scene.materials.iter().map(|m| m.texture).collect();
    assert_eq!((&textures[..9], textures[9], scene.textures.len()), (&[None; 9][..], Some(0), 1));
    assert_eq!(scene.notes.len(), 5, "{:?}", scene.notes);
    assert_eq!(scene.notes[4], "So it is with 5 more images.");
}

/// The file is drawn, and one note says what of the texture is missing.
fn without(file: &File, image: &str, reason: &str) {
    let scene = file.load();
    assert_eq!((scene.textures.len(), scene.materials[0].texture), (0, None));
    let note = &scene.notes[0];
    assert!(note.contains(image) && note.contains(reason) && !note.contains('\n'), "{note}");
}
