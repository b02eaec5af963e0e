//! Scenes far from the zero point of their coordinates: the same pictures as at it, and set-ups in the file's coordinates.

use crate::common::*;
use glam::{DVec3, Vec3};
use shadowscope::capture;
use shadowscope::frame::Renderer;
use shadowscope::light::Light;
use shadowscope::measure::metrics::{self, Errors};
use shadowscope::scene::{Camera, Clock, gltf};
use shadowscope::setup::{Setup, parse_camera, parse_light};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A floor of 10 m with a box over it, in two nodes.
const FILE: &[u8] = include_bytes!("../data/origin.glb");

/// Writes the file with its nodes at another place.
fn moved(folder: &Path, to: DVec3) -> PathBuf {
    let length = u32::from_le_bytes(FILE[12..16].try_into().unwrap()) as usize;
    let (text, rest) = FILE[20..].split_at(length);
    let mut json: serde_json::Value = serde_json::from_slice(text).unwrap();
    for node in json["nodes"].as_array_mut().unwrap() {
        node["translation"] = serde_json::json!(to.to_array());
    }
    let mut text = json.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let whole = (20 + text.len() + rest.len()) as u32;
    let bytes = [&FILE[..8], &whole.to_le_bytes(), &(text.len() as u32).to_le_bytes(), &FILE[16..20], &text, rest];
    let path = folder.join("far.glb");
    std::fs::write(&path, bytes.concat()).unwrap();
    path
}

/// A place as the command line takes it.
fn word(place: DVec3) -> String {
    format!("{},{},{}", place.x, place.y, place.z)
}

/// Counts and visibility of a technique, as the command line would have them.
fn measured(path: &Path, at: DVec3) -> Vec<(String, Errors, Vec<f32>)> {
    let (mut setup, scene) = Setup::open(&path.to_string_lossy()).unwrap();
    setup.size = [96, 96];
    let eye = at + DVec3::new(2.0, 4.0, 4.0);
    setup.camera = parse_camera(&scene, &format!("{}:{}:50", word(eye), word(at)), Clock::default()).unwrap();
    let lamp = word(at + DVec3::new(2.5, 5.0, 1.5));
    let lights = [
        "directional:to_light=0.5,1,0.3".to_string(),
        format!("spot:position={lamp};direction=-0.5,-1,-0.3;outer_angle=45;range=20"),
    ];
    let lights: Vec<Light> = lights.iter().map(|l| parse_light(&scene, l, Clock::default()).unwrap()).collect();
    let mut renderer = Renderer::new(gpu(), Arc::new(scene)).unwrap();
    let mut out = Vec::new();
    for light in lights {
        setup.light = light;
        for technique in ["shadow-map", "pssm", "sdsm", "notw", "rt-hard"] {
            setup.select(technique).unwrap();
            setup.set("resolution=256", &["shadow-map".into(), "pssm".into(), "sdsm".into(), "notw".into()]).unwrap();
            renderer.render(&setup, ask(&setup)).unwrap();
            let (visibility, truth) = (renderer.read_visibility().unwrap(), renderer.read_truth().unwrap());
            let errors = metrics::errors(&visibility, &truth, &truth, &renderer.read_mask().unwrap(), 96);
            out.push((format!("{technique} under {}", light.kind()), errors, visibility));
        }
    }
    out
}

#[test]
fn a_scene_counts_the_same_wherever_it_stands() {
    let folder = tempfile::tempdir().unwrap();
    let here = measured(&moved(folder.path(), DVec3::ZERO), DVec3::ZERO);
    for (name, e, _) in &here {
        assert!(e.facing > 3000 && e.shadow_correct > 50 && e.share() < 0.02, "{name}: {e:?}");
    }
    for far in [[1e5, 0.0, 1e5], [5e5, 0.0, 5e6], [-1e7, 1e7, 7654321.5]] {
        let far = DVec3::from(far);
        for (there, here) in measured(&moved(folder.path(), far), far).iter().zip(&here) {
            assert_eq!(there.1, here.1, "{} at {far}", here.0);
            assert!(there.2 == here.2, "{} at {far}: another visibility", here.0);
        }
    }
}

/// Lights of all kinds, at places of many sizes around a scene's middle.
fn lights(random: &mut Random) -> Vec<Light> {
    let mut place = |size: f32| random.point() * size;
    let color = Vec3::new(1.0, 0.9, 0.8);
    vec![
        Light::Directional { to_light: place(1.0), angular_radius: 0.0, color },
        Light::Spot {
            position: place(30.0),
            direction: place(2.0),
            outer_angle: 33.3,
            range: 70.1,
            radius: 0.0,
            color,
        },
        Light::Omni { position: place(1e-3), range: 3.3, radius: 0.0, color },
        Light::Hemisphere { position: place(1e4), direction: Vec3::NEG_Y, range: 0.7, color },
        Light::RectArea { center: place(5.0), half_u: Vec3::X * 0.1, half_v: Vec3::Z * 0.3, range: 9.0, color },
    ]
}

#[test]
fn set_ups_keep_their_places_through_every_kind_of_file() {
    let folder = tempfile::tempdir().unwrap();
    let mut random = Random(7);
    for far in [[0.0; 3], [1e7, -1e7, 1e7], [5e5, 0.0, 5e6], [123456.7890625, -7654321.5, 0.25]] {
        let path = moved(folder.path(), DVec3::from(far));
        let (start, scene) = Setup::open(&path.to_string_lossy()).unwrap();
        assert_eq!((start.origin, start.camera), (scene.origin, scene.cameras[0].camera));
        for light in lights(&mut random).into_iter().chain(lights(&mut random)) {
            let mut setup = Setup { light, ..start.clone() };
            setup.camera.position = random.point() * 10f32.powf(random.point().x * 4.0);
            setup.camera.target = random.point();
            setup.shadow_camera = Some(Camera { position: random.point() * 20.0, ..setup.camera });
            setup.count_from(scene.origin);

            let json = serde_json::to_string(&setup).unwrap();
            assert_eq!(serde_json::from_str::<Setup>(&json).unwrap(), setup, "{json}");
            let file = folder.path().join("a.toml");
            let text = setup.to_toml(&file).unwrap();
            assert!(!text.contains("origin = "), "{text}");
            std::fs::write(&file, &text).unwrap();
            assert_eq!(Setup::open(&file.to_string_lossy()).unwrap().0, setup, "{text}");
            let picture = folder.path().join("a.png");
            capture::write_png(&picture, [1, 1], &[0; 4], Some(&text)).unwrap();
            assert_eq!(Setup::open(&picture.to_string_lossy()).unwrap().0, setup, "{text}");
        }
    }
}

/// What stands in files is where things are in the scene's file, with no more digits than that takes.
#[test]
fn files_hold_the_scenes_own_coordinates() {
    let folder = tempfile::tempdir().unwrap();
    let far = DVec3::new(1e7, 0.0, -1e7);
    let (mut setup, scene) = Setup::open(&moved(folder.path(), far).to_string_lossy()).unwrap();
    setup.camera = parse_camera(&scene, "10000002.1,4,-9999995.7:1e7,0.3,-1e7:50", Clock::default()).unwrap();
    setup.light = parse_light(&scene, "omni:position=10000000.5,3.7,-1e7;range=20", Clock::default()).unwrap();
    let text = setup.to_toml(&folder.path().join("a.toml")).unwrap();
    for line in [
        "position = [10000002.1, 4.0, -9999995.7]",
        "target = [10000000.0, 0.3, -10000000.0]",
        "position = [10000000.5, 3.7, -10000000.0]",
    ] {
        assert!(text.contains(line), "{line} is not in\n{text}");
    }
    let json: serde_json::Value = serde_json::to_value(&setup).unwrap();
    assert_eq!(json["camera"]["position"], serde_json::json!([10000002.1, 4.0, -9999995.7]));
    assert_eq!(json["light"]["position"], serde_json::json!([10000000.5, 3.7, -1e7]));
    // The keys keep the order in which the documentation has them.
    let place = |key: &str| text.find(key).unwrap_or_else(|| panic!("{key} is not in\n{text}"));
    let keys =
        ["scene = ", "technique = ", "size = ", "[camera]", "target = ", "fov = ", "[light]", "kind = ", "[params"];
    assert!(keys.map(place).is_sorted(), "{text}");
    // Named ones too, and those that a file leaves out.
    for rest in ["camera = \"overview\"\nlight = \"spot\"\n", ""] {
        let (named, _) =
            Setup::from_toml(&format!("scene = \"far.glb\"\n{rest}"), &folder.path().join("b.toml")).unwrap();
        assert_eq!(named.camera, scene.cameras[0].camera);
    }
}

/// A row or an undo step from before the file changed keeps looking at the same place.
#[test]
fn a_set_up_follows_another_origin() {
    let folder = tempfile::tempdir().unwrap();
    let scene = gltf::load(&moved(folder.path(), DVec3::new(1e5, 0.0, 1e5))).unwrap();
    let setup = Setup { size: [64, 64], ..Setup::new("far.glb", &scene).unwrap() };
    let mut other = setup.clone();
    other.count_from(scene.origin + DVec3::new(3.0, -1.5, 0.25));
    assert_eq!(setup.camera.position - other.camera.position, Vec3::new(3.0, -1.5, 0.25));
    let mut renderer = Renderer::new(gpu(), Arc::new(scene)).unwrap();
    renderer.render(&setup, ask(&setup)).unwrap();
    let picture = renderer.read_picture().unwrap();
    renderer.render(&other, ask(&other)).unwrap();
    let again = renderer.read_picture().unwrap();
    let differing = picture.chunks_exact(4).zip(again.chunks_exact(4)).filter(|(a, b)| a != b).count();
    assert!(differing < 40, "{differing} pixels differ");
}
