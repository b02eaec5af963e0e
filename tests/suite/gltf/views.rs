//! Cameras and lights, of the file and the presets.

use super::file::File;
use glam::Vec3;
use serde_json::json;
use shadowscope::light::Light;
use shadowscope::scene::{Camera, Scene};
use std::f32::consts::{FRAC_1_SQRT_2, FRAC_PI_2, FRAC_PI_4};

/// In the file's coordinates.
fn camera(scene: &Scene, name: &str) -> Camera {
    let mut camera = scene.cameras.iter().find(|camera| camera.name == name).unwrap().camera;
    camera.position += scene.origin.as_vec3();
    camera.target += scene.origin.as_vec3();
    camera
}

/// In the file's coordinates.
fn light(scene: &Scene, name: &str) -> Light {
    let mut light = scene.lights.iter().find(|light| light.name == name).unwrap().light;
    light.place_mut().into_iter().for_each(|place| *place += scene.origin.as_vec3());
    light
}

#[test]
fn presets_are_always_there_and_the_overview_shows_all() {
    let mut file = File::triangle();
    file.json["nodes"][0]["scale"] = json!([30, 4, 9]);
    file.json["nodes"][0]["translation"] = json!([-70, 12, 3]);
    let scene = file.load();
    let names: Vec<_> = scene.cameras.iter().map(|camera| camera.name.as_str()).collect();
    assert_eq!(names, ["overview", "low"]);
    let names: Vec<_> = scene.lights.iter().map(|light| light.name.as_str()).collect();
    assert_eq!(names, ["sun", "low-sun", "spot", "omni"]);

    let camera = camera(&scene, "overview");
    let view = glam::camera::rh::view::look_at_mat4(camera.position, camera.target, Vec3::Y);
    let clip =
        glam::camera::rh::proj::directx::perspective(camera.fov.to_radians(), 4.0 / 3.0, camera.near, camera.far)
            * view;
    for corner in [Vec3::new(-70.0, 12.0, 3.0), Vec3::new(-40.0, 12.0, 3.0), Vec3::new(-70.0, 16.0, 3.0)] {
        let shown = clip.project_point3(corner);
        assert!(shown.x.abs() <= 1.0 && shown.y.abs() <= 1.0 && (0.0..=1.0).contains(&shown.z), "{shown}");
    }
    for (name, elevation) in [("sun", 45.0f32), ("low-sun", 12.0)] {
        let Light::Directional { to_light, .. } = light(&scene, name) else { panic!("{name}") };
        assert!((to_light.normalize().y.asin().to_degrees() - elevation).abs() < 0.01);
    }
    let Light::Spot { position, direction, range, color, .. } = light(&scene, "spot") else { panic!() };
    let center = Vec3::new(-55.0, 14.0, 3.0);
    assert!(position.y > 16.0 && range > position.distance(center));
    assert!((center - position).normalize().dot(direction.normalize()) > 0.9999);
    assert!((color.x / position.distance_squared(center) - 1.0).abs() < 1e-3);
    let Light::Omni { position, .. } = light(&scene, "omni") else { panic!() };
    assert!(position.y > 16.0);
}

#[test]
fn a_wide_floor_gets_a_camera_for_the_detail() {
    let mut file = File::triangle();
    let mut positions = vec![-1e3, 0.0, -1e3, 1e3, 0.0, 1e3, 1e3, 0.0, -1e3];
    for i in 0..100 {
        let x = i as f32 * 0.01;
        positions.extend([x, 0.0, 0.0, x + 0.01, 0.0, 0.0, x, 1.0, 1.0]);
    }
    let positions = file.floats("VEC3", &positions);
    file.json["meshes"][0]["primitives"] = json!([{ "attributes": { "POSITION": positions } }]);
    let scene = file.load();
    let camera = camera(&scene, "detail");
    assert!(camera.position.length() < 5.0, "{camera:?}");
    assert!(camera.far > 2e3);
}

#[test]
fn lights_of_the_file_come_first_and_where_they_are() {
    let mut file = File::triangle();
    file.json["extensions"] = json!({ "KHR_lights_punctual": { "lights": [
        { "type": "directional", "name": "sun", "color": [0.5, 0.25, 0], "intensity": 3000 },
        { "type": "point", "range": 7 },
        { "type": "spot", "spot": { "outerConeAngle": 0.5 }, "intensity": 5 },
        { "type": "spot", "spot": { "outerConeAngle": FRAC_PI_2 } },
    ] } });
    let placed = |light: u32, rest: serde_json::Value| {
        let mut node = rest;
        node["extensions"] = json!({ "KHR_lights_punctual": { "light": light } });
        node
    };
    file.json["nodes"] = json!([
        { "mesh": 0 },
        // A quarter turn about x: -z becomes +y.
        placed(0, json!({ "rotation": [FRAC_1_SQRT_2, 0, 0, FRAC_1_SQRT_2] })),
        { "translation": [0, 10, 0], "children": [3] },
        placed(1, json!({ "translation": [0.5, 0.5, 0], "name": "lamp" })),
        placed(2, json!({ "translation": [0.5, 0.5, 4], "scale": [2, 2, 2] })),
        placed(3, json!({})),
    ]);
    let scene = file.load();
    let names: Vec<_> = scene.lights.iter().map(|light| light.name.as_str()).collect();
    assert_eq!(names, ["sun", "lamp", "light 2", "light 3", "sun 2", "low-sun", "spot", "omni"]);
    let Light::Directional { to_light, color, .. } = light(&scene, "sun") else { panic!() };
    assert!(to_light.abs_diff_eq(Vec3::NEG_Y, 1e-5), "{to_light}");
    assert_eq!(color, Vec3::new(1.0, 0.5, 0.0));
    let Light::Omni { position, range, color, .. } = light(&scene, "lamp") else { panic!() };
    assert_eq!((position, range), (Vec3::new(0.5, 10.5, 0.0), 7.0));
    // Ten away from the middle of the triangle's box.
    assert!(color.abs_diff_eq(Vec3::splat(100.0), 1e-3));
    let Light::Spot { position, direction, outer_angle, range, color, .. } = light(&scene, "light 2") else { panic!() };
    assert_eq!((position, direction), (Vec3::new(0.5, 0.5, 4.0), Vec3::NEG_Z));
    assert!((outer_angle - 0.5f32.to_degrees()).abs() < 1e-3);
    assert!(range > 4.0 && range.is_finite());
    assert!(color.abs_diff_eq(Vec3::splat(16.0), 1e-3));
    let Light::Spot { outer_angle, color, .. } = light(&scene, "light 3") else { panic!() };
    assert!(outer_angle < 89.0);
    assert_eq!(color, Vec3::ONE);
    assert!(scene.notes[0].starts_with("4 lights have a brightness"), "{:?}", scene.notes);

    file.json["extensions"]["KHR_lights_punctual"]["lights"][0]["type"] = "laser".into();
    assert!(file.error().contains("light 0 has an unknown type"));
    file.json["nodes"][1]["extensions"]["KHR_lights_punctual"]["light"] = 12.into();
    assert!(file.error().contains("light 12"));
}

/// Values that mean nothing, or more than a light here may have: drawn with others, and told.
#[test]
fn odd_values_of_lights_are_told() {
    let mut file = File::triangle();
    let cases = [
        (json!({ "type": "spot", "spot": { "outerConeAngle": FRAC_PI_2 } }), "outerConeAngle 1.5707964; 88.5°", 88.5),
        (json!({ "type": "spot", "spot": { "outerConeAngle": 0 } }), "outerConeAngle 0; 45°", 45.0),
        (json!({ "type": "spot", "spot": { "outerConeAngle": -1 } }), "outerConeAngle -1; 45°", 45.0),
        (json!({ "type": "spot", "spot": { "outerConeAngle": 3 } }), "outerConeAngle 3; 45°", 45.0),
        (json!({ "type": "spot", "spot": { "outerConeAngle": 0.5 }, "range": -2 }), "range -2; ", 0.5f32.to_degrees()),
        (json!({ "type": "spot", "spot": { "outerConeAngle": 0.5 }, "range": 0 }), "range 0; ", 0.5f32.to_degrees()),
        (
            json!({ "type": "spot", "spot": { "outerConeAngle": 0.5 }, "range": 1e39 }),
            "range inf; ",
            0.5f32.to_degrees(),
        ),
        (
            json!({ "type": "spot", "spot": { "outerConeAngle": 0.5 }, "range": 1e30 }),
            "1000000000 m",
            0.5f32.to_degrees(),
        ),
    ];
    file.json["nodes"] = json!([{ "mesh": 0 },
        { "translation": [0, 0, 3], "extensions": { "KHR_lights_punctual": { "light": 0 } } }]);
    for (lamp, note, expected) in cases {
        file.json["extensions"] = json!({ "KHR_lights_punctual": { "lights": [lamp] } });
        let scene = file.load();
        assert!(scene.notes.iter().any(|n| n.contains("\"light 0\"") && n.contains(note)), "{:?}", scene.notes);
        let Light::Spot { outer_angle, range, .. } = light(&scene, "light 0") else { panic!() };
        assert!((outer_angle - expected).abs() < 1e-4, "{outer_angle}");
        assert!((3.0..=1e9).contains(&range), "{range}");
        shadowscope::setup::Setup::new("test", &scene).unwrap().check().unwrap();
    }
    // No colour and no intensity is no light.
    for (color, intensity) in [([0, 0, 0], 7), ([1, 1, 1], 0), ([-1, 0, 0], 1)] {
        file.json["extensions"] = json!({ "KHR_lights_punctual": { "lights":
            [{ "type": "point", "color": color, "intensity": intensity }] } });
        let scene = file.load();
        assert_eq!(light(&scene, "light 0").color(), Vec3::ZERO);
        assert!(scene.notes.iter().any(|n| n.starts_with("1 light has the colour or the intensity zero")));
    }
}

/// One that looks past the scene does not come first, and keeps its place otherwise.
#[test]
fn a_file_opens_with_a_camera_that_sees_something() {
    let mut file = File::triangle();
    let perspective = json!({ "yfov": 0.5, "znear": 0.1, "zfar": 20 });
    let orthographic = json!({ "xmag": 1, "ymag": 1, "znear": 0.1, "zfar": 20 });
    file.json["cameras"] = json!([
        { "type": "perspective", "perspective": perspective },
        { "type": "orthographic", "orthographic": orthographic },
    ]);
    let named = |camera: u32, place: [f32; 3]| {
        json!([
            { "mesh": 0 },
            { "camera": camera, "translation": place, "name": "first" },
            { "camera": 0, "translation": [0.5, 0.5, 8], "name": "second" },
        ])
    };
    for camera in [0, 1] {
        // Behind it, beside it on each side, and too far from it.
        for place in
            [[0.5, 0.5, -8.0], [9.0, 0.5, 8.0], [-9.0, 0.5, 8.0], [0.5, 9.0, 8.0], [0.5, -9.0, 8.0], [0.5, 0.5, 21.0]]
        {
            file.json["nodes"] = named(camera, place);
            let scene = file.load();
            let names: Vec<_> = scene.cameras.iter().map(|camera| camera.name.as_str()).collect();
            assert_eq!(names, ["second", "first", "overview", "low"], "{place:?}");
            let note = "The camera \"first\" sees nothing of the scene, which opens with \"second\" instead.";
            assert!(scene.notes.iter().any(|told| told == note), "{:?}", scene.notes);
        }
        file.json["nodes"] = named(camera, [1.5, 0.5, 8.0]);
        let scene = file.load();
        assert_eq!((scene.cameras[0].name.as_str(), scene.notes.len()), ("first", 0), "it sees a part");
    }
    file.json["nodes"] = named(0, [0.5, 0.5, -8.0]);
    file.json["nodes"][2]["camera"] = serde_json::Value::Null;
    assert_eq!(file.load().cameras[0].name, "overview");
}

#[test]
fn odd_values_of_cameras_are_told() {
    let mut file = File::triangle();
    file.json["nodes"] = json!([{ "mesh": 0 }, { "translation": [0.5, 0.5, 14], "camera": 0 }]);
    for (perspective, note) in [
        (json!({ "yfov": 0, "znear": 0.1 }), "yfov 0; 45°"),
        (json!({ "yfov": -1, "znear": 0.1 }), "yfov -1; 45°"),
        (json!({ "yfov": 3.2, "znear": 0.1 }), "yfov 3.2; 45°"),
        (json!({ "yfov": 3.1, "znear": 0.1 }), "yfov 3.1; 170°"),
        (json!({ "yfov": 1, "znear": 0 }), "znear 0; "),
        (json!({ "yfov": 1, "znear": -5 }), "znear -5; "),
        (json!({ "yfov": 1, "znear": 10, "zfar": 1 }), "zfar 1; "),
        (json!({ "yfov": 1, "znear": 1, "zfar": 1 }), "zfar 1; "),
    ] {
        file.json["cameras"] = json!([{ "type": "perspective", "perspective": perspective }]);
        let scene = file.load();
        assert_eq!(scene.notes.len(), 1, "{:?}", scene.notes);
        assert!(scene.notes[0].contains("\"camera 0\"") && scene.notes[0].contains(note), "{:?}", scene.notes);
        let camera = camera(&scene, "camera 0");
        assert!((1.0..=170.0).contains(&camera.fov) && camera.near > 0.0 && camera.far > camera.near);
        shadowscope::setup::Setup::new("test", &scene).unwrap().check().unwrap();
    }
    // Without an extent there is nothing to see; a near plane in the camera is allowed.
    file.json["cameras"] = json!([{ "type": "orthographic",
        "orthographic": { "xmag": 0, "ymag": 0, "znear": 0, "zfar": 40 } }]);
    let scene = file.load();
    assert_eq!(scene.notes, ["The camera \"camera 0\" has ymag 0; a perspective of 45° is taken."]);
    assert_eq!(camera(&scene, "camera 0").height, None);
}

/// A file opens with its first light that shines and that the technique serves; which, a note says.
#[test]
fn the_light_suits_the_technique() {
    let mut file = File::triangle();
    file.json["extensions"] = json!({ "KHR_lights_punctual": { "lights": [
        { "type": "point", "name": "dark", "intensity": 0 },
        { "type": "point", "name": "bulb" },
        { "type": "directional", "name": "sky" },
    ] } });
    let lamp = |light: u32| json!({ "extensions": { "KHR_lights_punctual": { "light": light } } });
    file.json["nodes"] = json!([{ "mesh": 0 }, lamp(0), lamp(1), lamp(2)]);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("lamps.glb");
    std::fs::write(&path, file.glb()).unwrap();
    let path = path.to_string_lossy();
    let kind = |techniques: &[&str]| {
        let (setup, scene) = shadowscope::setup::Setup::open_for(&path, techniques).unwrap();
        let note = scene.notes.iter().find(|note| note.starts_with("Light comes from")).cloned();
        (setup.light.kind(), setup.light.color() != Vec3::ZERO, note.unwrap_or_default())
    };
    let (name, shines, note) = kind(&["shadow-map"]);
    assert_eq!((name, shines), ("directional", true));
    assert!(note.contains("\"sky\" instead of \"dark\""), "{note}");
    let (name, shines, note) = kind(&["cube"]);
    assert_eq!((name, shines), ("omni", true));
    assert!(note.contains("\"bulb\" instead of \"dark\" (it stays dark)"), "{note}");
    // None serves both: one is served.
    assert_eq!(kind(&["cube", "pssm"]).0, "omni");
    assert_eq!(kind(&["all"]).0, "omni");
    // Nothing asked for, as where a light is named.
    assert_eq!(kind(&[]), ("omni", false, String::new()));
    let toml = folder.path().join("own.toml");
    std::fs::write(&toml, "scene = \"lamps.glb\"\ntechnique = \"pssm\"\n").unwrap();
    let (setup, scene) = shadowscope::setup::Setup::open(&toml.to_string_lossy()).unwrap();
    assert_eq!(setup.light.kind(), "directional");
    assert!(scene.notes.iter().any(|note| note.contains("\"sky\"")), "{:?}", scene.notes);
    // The command line, and a light that is named.
    let capture = |rest: &[&str]| {
        let args = ["capture", &path, "--technique", "pssm", "--size", "32x24", "-o", "a.png"];
        crate::common::shadowscope(folder.path(), &[&args[..], rest].concat())
    };
    let out = capture(&[]);
    let said = String::from_utf8_lossy(&out.stderr).into_owned();
    assert!(out.status.success() && said.contains("Light comes from \"sky\""), "{said}");
    let out = capture(&["--light", "bulb"]);
    let said = String::from_utf8_lossy(&out.stderr).into_owned();
    assert!(!out.status.success() && said.contains("not omni"), "{said}");
}

#[test]
fn cameras_of_the_file_come_first_and_where_they_are() {
    let mut file = File::triangle();
    file.json["cameras"] = json!([
        { "type": "perspective", "name": "overview", "perspective": { "yfov": FRAC_PI_4, "znear": 0.5, "zfar": 50 } },
        { "type": "perspective", "perspective": { "yfov": 1, "znear": 0.1 } },
        { "type": "orthographic", "orthographic": { "xmag": 2, "ymag": 1.5, "znear": 0, "zfar": 40 } },
    ]);
    file.json["nodes"] = json!([
        { "mesh": 0 },
        { "camera": 0, "translation": [0.5, 0.5, 8] },
        // Looks straight down, the top of the picture towards -z.
        { "camera": 1, "translation": [0.5, 6.5, 0], "rotation": [-FRAC_1_SQRT_2, 0, 0, FRAC_1_SQRT_2], "name": "plan" },
        { "camera": 2 },
    ]);
    let scene = file.load();
    let names: Vec<_> = scene.cameras.iter().map(|camera| camera.name.as_str()).collect();
    assert_eq!(names, ["overview", "plan", "camera 2", "overview 2", "low"]);
    let first = camera(&scene, "overview");
    assert_eq!((first.position, first.target), (Vec3::new(0.5, 0.5, 8.0), Vec3::new(0.5, 0.5, 0.0)));
    assert!((first.fov - 45.0).abs() < 1e-3);
    assert_eq!((first.near, first.far), (0.5, 50.0));
    let plan = camera(&scene, "plan");
    // No far plane: one behind all of the scene.
    assert!((plan.far - 3.0 * (6.0 + 2f32.sqrt())).abs() < 1e-3, "{}", plan.far);
    assert!(plan.view().transform_vector3(Vec3::NEG_Z).y > 0.9999);
    let even = camera(&scene, "camera 2");
    assert_eq!((even.height, even.far), (Some(3.0), 40.0));
    // From the file's zero to what is higher than 0.
    assert!((even.forward() - Vec3::NEG_Z).length() < 1e-6 && even.near > 0.0);
    // The triangle stands in that camera's own plane.
    assert_eq!(
        scene.notes,
        ["Camera camera 2 shows nothing: all of the scene lies behind it or before its near plane."]
    );

    // What a camera cannot show is told.
    let whole = file.json.clone();
    file.json["cameras"][0]["perspective"]["zfar"] = 3.into();
    file.json["nodes"][2]["rotation"] = json!([FRAC_1_SQRT_2, 0, 0, FRAC_1_SQRT_2]);
    let notes = file.load().notes.join(" ");
    assert!(
        notes.contains("Camera overview shows nothing: all of the scene lies behind its far plane, 3 m away"),
        "{notes}"
    );
    assert!(notes.contains("Camera plan shows nothing: all of the scene lies behind it"), "{notes}");
    file.json = whole;

    // A picture that is turned by 30° stays so.
    let (sin, cos) = (FRAC_PI_2 / 6.0).sin_cos();
    file.json["nodes"][1]["rotation"] = json!([0, 0, sin, cos]);
    let rolled = camera(&file.load(), "overview");
    assert!((rolled.axes().1 - Vec3::new(-0.5, 0.75f32.sqrt(), 0.0)).length() < 1e-5);

    file.json["nodes"][1]["camera"] = 9.into();
    assert!(file.error().contains("camera 9"));
}
