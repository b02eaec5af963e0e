//! Skins, morph targets, cameras and lights at moments of the clock, against closed forms.

use super::file::{F32, File, U8, U16};
use crate::common::{ask, gpu, select};
use glam::{DVec3, Mat4, Quat, Vec3};
use serde_json::{Value, json};
use shadowscope::frame::Renderer;
use shadowscope::light::Light;
use shadowscope::scene::geometry::{Geometry, shading_normal};
use shadowscope::scene::pose::placements;
use shadowscope::scene::{Clock, Local, Mesh, Node, Scene};
use shadowscope::setup::{Setup, parse_camera, parse_light};
use std::f32::consts::{FRAC_1_SQRT_2, FRAC_PI_2};
use std::sync::Arc;

/// The corners as they are drawn at a time, in the file's coordinates.
fn corners(scene: &Scene, time: f32) -> Vec<DVec3> {
    let geometry = Geometry::new(scene, 0, time).unwrap();
    geometry.vertices.iter().map(|v| v.position.as_dvec3() + scene.origin).collect()
}

fn near(found: &[DVec3], expected: &[Vec3], time: f32) {
    let off = found.iter().zip(expected).map(|(a, b)| a.distance(b.as_dvec3())).fold(0.0, f64::max);
    assert!(found.len() == expected.len() && off < 1e-6, "at {time}: {found:?}, not {expected:?}");
}

/// Adds an animation of one channel.
fn animate(file: &mut File, node: usize, path: &str, interpolation: &str, times: &[f32], output: usize) {
    let input = file.floats("SCALAR", times);
    file.push(
        "animations",
        json!({
            "samplers": [{ "input": input, "output": output, "interpolation": interpolation }],
            "channels": [{ "sampler": 0, "target": { "node": node, "path": path } }],
        }),
    );
}

/// A ribbon along x from 0 to 2 in the xy plane, of four triangles, in steps of a half: vertex 2k lies at (k/2, 0, 0), vertex
/// 2k + 1 above it.
fn ribbon(file: &mut File) -> Value {
    let positions: Vec<f32> = (0..5).flat_map(|k| [k as f32 / 2.0, 0.0, 0.0, k as f32 / 2.0, 1.0, 0.0]).collect();
    let indices: Vec<u16> = (0..4).flat_map(|k| [0, 2, 1, 1, 2, 3].map(|i| 2 * k + i)).collect();
    let (positions, indices) = (file.floats("VEC3", &positions), file.shorts("SCALAR", &indices));
    json!({ "attributes": { "POSITION": positions }, "indices": indices })
}

/// An arm of two joints that lie at x = 0 and x = 1; the second turns from straight to a right angle about z in a second. Its
/// share of the columns is 0, 0, 1/2, 1, 1.
fn arm(second_set: bool) -> File {
    let mut file = File::new();
    let mut primitive = ribbon(&mut file);
    // Normals keep vertices shared.
    let normals = file.floats("VEC3", &[0.0, 0.0, 1.0].repeat(10));
    primitive["attributes"]["NORMAL"] = normals.into();
    let halves = [0, 0, 1, 2, 2];
    if second_set {
        // The second joint in a set of its own, with weights of sixteen bits that add up to half of one.
        let [first, second] = [0u8, 1].map(|joint| file.accessor(&[joint; 40], U8, "VEC4", 10));
        let mut weights = |of: fn(u16) -> u16| {
            let all: Vec<u8> =
                halves.iter().flat_map(|h| [of(*h), 0, 0, 0].repeat(2)).flat_map(u16::to_le_bytes).collect();
            let accessor = file.accessor(&all, U16, "VEC4", 10);
            file.json["accessors"][accessor]["normalized"] = true.into();
            accessor
        };
        let (own, other) = (weights(|h| (2 - h) * 16000), weights(|h| h * 16000));
        primitive["attributes"]["JOINTS_0"] = first.into();
        primitive["attributes"]["WEIGHTS_0"] = own.into();
        primitive["attributes"]["JOINTS_1"] = second.into();
        primitive["attributes"]["WEIGHTS_1"] = other.into();
    } else {
        let joints = file.accessor(&[0u8, 1, 0, 0].repeat(10), U8, "VEC4", 10);
        let weights: Vec<f32> =
            halves.iter().flat_map(|h| [1.0 - *h as f32 / 2.0, *h as f32 / 2.0, 0., 0.].repeat(2)).collect();
        let weights = file.floats("VEC4", &weights);
        primitive["attributes"]["JOINTS_0"] = joints.into();
        primitive["attributes"]["WEIGHTS_0"] = weights.into();
    }
    let inverse = [Mat4::IDENTITY, Mat4::from_translation(Vec3::NEG_X)].map(|m| m.to_cols_array()).concat();
    let inverse = file.floats("MAT4", &inverse);
    file.push("meshes", json!({ "primitives": [primitive] }));
    file.push("skins", json!({ "joints": [1, 2], "inverseBindMatrices": inverse }));
    file.json["nodes"] = json!([
        // What the node itself does is ignored.
        { "mesh": 0, "skin": 0, "translation": [7, 8, 9], "scale": [2, 2, 2] },
        { "translation": [0, 0, 3], "children": [2] },
        { "translation": [1, 0, 0] },
    ]);
    // The joints are no part of the scene.
    file.json["scenes"] = json!([{ "nodes": [0] }]);
    file.json["scene"] = 0.into();
    let turns = file.floats("VEC4", &[0., 0., 0., 1., 0., 0., FRAC_1_SQRT_2, FRAC_1_SQRT_2]);
    animate(&mut file, 2, "rotation", "LINEAR", &[0.0, 1.0], turns);
    file
}

/// Where the arm's corners are: linear blend skinning.
fn bent(time: f32) -> Vec<Vec3> {
    let turn = Quat::from_rotation_z(FRAC_PI_2 * time.clamp(0.0, 1.0));
    let at = |k: usize, y: f32| {
        let share = [0.0, 0.0, 0.5, 1.0, 1.0][k];
        let rest = Vec3::new(k as f32 / 2.0, y, 0.0);
        rest.lerp(Vec3::X + turn * (rest - Vec3::X), share) + 3.0 * Vec3::Z
    };
    (0..5).flat_map(|k| [at(k, 0.0), at(k, 1.0)]).collect()
}

#[test]
fn an_arm_bends_with_its_joint() {
    for second_set in [false, true] {
        let scene = arm(second_set).load();
        assert!(scene.notes.is_empty(), "{:?}", scene.notes);
        for time in [0.0, 0.25, 2.0 / 3.0, 1.0, 4.0] {
            near(&corners(&scene, time), &bent(time), time);
        }
    }
}

/// A third of a million metres away the arm bends as it does at zero.
#[test]
fn an_arm_far_from_zero_bends_the_same() {
    let mut file = arm(false);
    let far = DVec3::new(2e5, -3e4, 1e6);
    file.json["nodes"][1]["translation"] = json!((far + 3.0 * DVec3::Z).to_array());
    let scene = file.load();
    for time in [0.0, 0.5, 1.0] {
        let found: Vec<DVec3> = corners(&scene, time).iter().map(|p| *p - far).collect();
        near(&found, &bent(time), time);
    }
}

/// Normals turn with the joints, and follow the triangles where the file has none.
#[test]
fn normals_follow_the_pose() {
    let mut file = arm(false);
    // About x instead, so that the ribbon's far end turns its front up.
    let turns = file.floats("VEC4", &[0., 0., 0., 1., -FRAC_1_SQRT_2, 0., 0., FRAC_1_SQRT_2]);
    file.json["animations"][0]["samplers"][0]["output"] = turns.into();
    let normal = |scene: &Scene, time: f32, vertex: usize| {
        let packed = Geometry::new(scene, 0, time).unwrap().vertices[vertex].normal;
        // As a G-buffer's word, of twelve bits a part.
        let part =
            |shift: u32| (((packed >> shift) as u16 as i16 as f32 / 32767.0 * 2047.0).round() as i32 & 0xfff) as u32;
        shading_normal([0, part(0) | part(16) << 12, 0, 0])
    };
    for without in [false, true] {
        if without {
            file.json["meshes"][0]["primitives"][0]["attributes"].as_object_mut().unwrap().remove("NORMAL");
        }
        let scene = file.load();
        let last = Geometry::new(&scene, 0, 0.0).unwrap().vertices.len() - 1;
        for time in [0.0, 0.5, 1.0] {
            let expected = Quat::from_rotation_x(-FRAC_PI_2 * time) * Vec3::Z;
            for (vertex, expected) in [(0, Vec3::Z), (last, expected)] {
                let found = normal(&scene, time, vertex);
                assert!(found.distance(expected) < 2e-3, "{without} at {time}: {found}, not {expected}");
            }
        }
    }
}

/// Weights of two targets: w0 along z, w1 along y, at each of three keys.
fn morphing(interpolation: &str, weights: &[f32], sparse: bool) -> File {
    let mut file = File::triangle();
    let up = match sparse {
        false => file.floats("VEC3", &[0., 0., 0., 0., 0., 0., 0., 0., 2.]),
        true => {
            let (places, values) = (file.view(&[2]), file.view(&[0.0f32, 0.0, 2.0].map(f32::to_le_bytes).concat()));
            file.push(
                "accessors",
                json!({ "componentType": F32, "type": "VEC3", "count": 3, "sparse": {
                    "count": 1,
                    "indices": { "bufferView": places, "componentType": U8 },
                    "values": { "bufferView": values },
                } }),
            )
        }
    };
    let along = file.floats("VEC3", &[0., 1., 0., 0., 1., 0., 0., 1., 0.]);
    file.primitive()["targets"] = json!([{ "POSITION": up }, { "POSITION": along }]);
    let output = file.floats("SCALAR", weights);
    animate(&mut file, 0, "weights", interpolation, &[0.0, 1.0, 3.0], output);
    file
}

#[test]
fn morph_weights_step_run_and_curve() {
    let triangle =
        |w: [f32; 2]| [Vec3::Y * w[1], Vec3::X + Vec3::Y * w[1], Vec3::Y * (1.0 + w[1]) + 2.0 * w[0] * Vec3::Z];
    let keys = [0.0, 0.5, 1.0, -0.5, 0.25, 1.5];
    for sparse in [false, true] {
        let (line, steps) = (morphing("LINEAR", &keys, sparse).load(), morphing("STEP", &keys, sparse).load());
        for (time, linear, step) in [
            (0.0, [0.0, 0.5], [0.0, 0.5]),
            (0.5, [0.5, 0.0], [0.0, 0.5]),
            (1.0, [1.0, -0.5], [1.0, -0.5]),
            (2.5, [0.4375, 1.0], [1.0, -0.5]),
            (9.0, [0.25, 1.5], [0.25, 1.5]),
        ] {
            near(&corners(&line, time), &triangle(linear), time);
            near(&corners(&steps, time), &triangle(step), time);
        }
    }
    // In-tangents, values and out-tangents of both targets, key by key: the first follows t³, the second stands.
    let cubic = |t: f32| [3.0 * t * t, 0.5, t * t * t, 0.5, 3.0 * t * t, 0.5];
    let keys: Vec<f32> = [0.0, 1.0, 3.0].iter().flat_map(|t| cubic(*t)).collect();
    let keys: Vec<f32> = keys.chunks(6).flat_map(|k| [k[0], 0.0, k[2], 0.5, k[4], 0.0]).collect();
    let curve = morphing("CUBICSPLINE", &keys, false).load();
    for time in [0.0f32, 0.5, 1.0, 1.7, 2.9] {
        let found = corners(&curve, time);
        let expected = triangle([time.powi(3), 0.5]);
        assert!(found[2].distance(expected[2].as_dvec3()) < 1e-5, "{time}: {found:?}, not {expected:?}");
    }
}

#[test]
fn malformed_weights_are_refused() {
    let mut file = morphing("LINEAR", &[0.0, 0.5, 1.0, -0.5, 0.25], false);
    assert!(file.error().contains("5 values for 3 times"), "{}", file.error());
    file = morphing("LINEAR", &[0.0; 6], false);
    file.primitive()["targets"][0]["POSITION"] = 1.into();
    assert!(file.error().contains("morph target"), "{}", file.error());
    file = morphing("LINEAR", &[0.0; 6], false);
    let wild = file.floats("VEC3", &[f32::NAN; 9]);
    file.primitive()["targets"][0]["POSITION"] = wild.into();
    assert!(file.error().contains("not finite"), "{}", file.error());
}

/// A target without normals turns those of the mesh as its faces turn; one with normals as it says.
#[test]
fn morphed_normals() {
    let mut file = File::triangle();
    let normals = file.floats("VEC3", &[0., 0., 1.].repeat(3));
    // The corner at y = 1 rises by one: the front turns towards -y, by 45 degrees.
    let tilt = file.floats("VEC3", &[0., 0., 0., 0., 0., 0., 0., 0., 1.]);
    file.primitive()["attributes"]["NORMAL"] = normals.into();
    file.primitive()["targets"] = json!([{ "POSITION": tilt }]);
    file.json["meshes"][0]["weights"] = json!([1]);
    let normal = |file: &File| placements(&file.load(), 0, 0.0)[0].posed().1[1].normalize().as_vec3();
    assert!(normal(&file).abs_diff_eq(Vec3::new(0.0, -FRAC_1_SQRT_2, FRAC_1_SQRT_2), 1e-6), "{}", normal(&file));
    let given = file.floats("VEC3", &[1., 0., 0.].repeat(3));
    file.primitive()["targets"][0]["NORMAL"] = given.into();
    assert!(normal(&file).abs_diff_eq(Vec3::new(FRAC_1_SQRT_2, 0.0, FRAC_1_SQRT_2), 1e-6), "{}", normal(&file));
}

/// A floor of 8 m below what the file has, as its last mesh.
fn on_a_floor(file: &mut File, height: f32) {
    let p = |x: f32, z: f32| [x, height, z];
    let floor = [p(-4., -4.), p(-4., 4.), p(4., 4.), p(4., -4.)].concat();
    let (positions, indices) = (file.floats("VEC3", &floor), file.shorts("SCALAR", &[0, 1, 2, 0, 2, 3]));
    let primitive = json!({ "attributes": { "POSITION": positions }, "indices": indices });
    let mesh = file.push("meshes", json!({ "primitives": [primitive] }));
    let node = file.push("nodes", json!({ "mesh": mesh }));
    if let Some(scene) = file.json.pointer_mut("/scenes/0/nodes").and_then(Value::as_array_mut) {
        scene.push(node.into());
    }
    let plain = file.push("materials", json!({ "doubleSided": true }));
    for mesh in file.json["meshes"].as_array_mut().unwrap() {
        mesh["primitives"][0]["material"] = plain.into();
    }
}

/// The scene as it stands at a time, as meshes that never move.
fn baked(scene: &Scene, time: f32) -> Scene {
    let mut still = scene.clone();
    let placed = placements(scene, 0, time);
    still.meshes.clear();
    for one in &placed {
        let (positions, normals) = one.posed();
        let positions = positions.iter().map(|p| p.as_vec3()).collect();
        let normals = normals.iter().map(|n| n.normalize_or(DVec3::Y).as_vec3()).collect();
        still.meshes.push(Mesh {
            positions,
            normals,
            targets: Vec::new(),
            skinning: None,
            flat: false,
            ..one.mesh.clone()
        });
    }
    let local = Local::Trs { translation: scene.origin, rotation: glam::DQuat::IDENTITY, scale: DVec3::ONE };
    still.nodes = vec![Node { local, meshes: (0..still.meshes.len() as u32).collect(), ..Node::default() }];
    still.skins.clear();
    still.animations.clear();
    still
}

/// At each time the moving scene, drawn by one renderer after the other moment, has the picture of a scene that stands still
/// there: camera, plain and filtered maps, warps, volumes from edges, and rays.
fn same_as_baked(file: &File, times: &[f32]) {
    let scene = file.load();
    let mut setup = Setup::new("moving", &scene).unwrap();
    setup.size = [120, 90];
    setup.light = parse_light(&scene, "directional:to_light=0.3,0.7,0.9", Clock::default()).unwrap();
    let mut moving = Renderer::new(gpu(), Arc::new(scene.clone())).unwrap();
    let mut dark = Vec::new();
    for time in times {
        let mut still = Renderer::new(gpu(), Arc::new(baked(&scene, *time))).unwrap();
        for technique in ["shadow-map", "pcf", "notw", "shadow-volume", "rt-hard"] {
            select(&mut setup, technique, &[]);
            setup.time = *time;
            moving.render(&setup, ask(&setup)).unwrap();
            let now = setup.clone();
            setup.time = 0.0;
            still.render(&setup, ask(&setup)).unwrap();
            assert!(
                moving.read_position().unwrap() == still.read_position().unwrap(),
                "{technique} at {time}: the surfaces"
            );
            assert!(
                moving.read_mask().unwrap() == still.read_mask().unwrap(),
                "{technique} at {time}: what faces the light"
            );
            assert!(moving.read_truth().unwrap() == still.read_truth().unwrap(), "{technique} at {time}: the truth");
            let shadow = moving.read_visibility().unwrap();
            assert!(shadow == still.read_visibility().unwrap(), "{technique} at {time}: the shadow");
            assert_eq!(now.camera, setup.camera);
            dark.push(shadow.iter().filter(|v| **v == 0.0).count());
        }
    }
    // There is a shadow, and it moves.
    assert!(dark.iter().all(|n| *n > 20), "{dark:?}");
    assert_ne!(dark.first(), dark.last());
}

#[test]
fn a_skins_shadow_is_that_of_its_pose() {
    let mut file = arm(false);
    on_a_floor(&mut file, -1.5);
    same_as_baked(&file, &[0.0, 0.35, 1.0]);
}

/// A sheet that folds up from its own duplicate: corners that share their places at first part later.
#[test]
fn a_morphs_shadow_is_that_of_its_pose() {
    let mut file = File::new();
    let mut primitive = ribbon(&mut file);
    let twice: Vec<u16> = (0..4).flat_map(|k| [0, 2, 1, 1, 2, 3].map(|i| 2 * k + i)).collect();
    let twice: Vec<u16> = twice.iter().copied().chain(twice.iter().map(|i| i + 10)).collect();
    let flat = |k: u32| [k as f32 / 2.0, 0.0, 0.0, k as f32 / 2.0, 0.0, -1.0];
    let positions: Vec<f32> = (0..5).chain(0..5).flat_map(flat).collect();
    let positions = file.floats("VEC3", &positions);
    let normals = file.floats("VEC3", &[0.0, 1.0, 0.0].repeat(20));
    let offsets: Vec<f32> = (0..20).flat_map(|i| if i < 10 { [0.0; 3] } else { [-0.7, 0.6, 1.8] }).collect();
    let offsets = file.floats("VEC3", &offsets);
    primitive["indices"] = file.shorts("SCALAR", &twice).into();
    primitive["attributes"] = json!({ "POSITION": positions, "NORMAL": normals });
    primitive["targets"] = json!([{ "POSITION": offsets }]);
    file.push("meshes", json!({ "primitives": [primitive] }));
    file.push("nodes", json!({ "mesh": 0 }));
    let weights = file.floats("SCALAR", &[0.0, 1.0]);
    animate(&mut file, 0, "weights", "LINEAR", &[0.0, 2.0], weights);
    on_a_floor(&mut file, -1.0);
    same_as_baked(&file, &[0.0, 0.5, 2.0]);
}

/// A camera and two lights on a turntable that turns a right angle about y in a second, and a camera that stands.
pub fn turntable() -> File {
    let mut file = File::triangle();
    file.json["cameras"] = json!([
        { "type": "perspective", "name": "rider", "perspective": { "yfov": 1, "znear": 0.1 } },
        { "type": "perspective", "name": "still", "perspective": { "yfov": 1, "znear": 0.1 } },
    ]);
    let lights = json!([{ "type": "spot", "name": "beam" }, { "type": "directional", "name": "star" }]);
    file.json["extensions"] = json!({ "KHR_lights_punctual": { "lights": lights } });
    let light = |i: u32| json!({ "KHR_lights_punctual": { "light": i } });
    file.json["nodes"] = json!([
        { "mesh": 0 },
        { "children": [2, 3, 4], "translation": [0, 1, 0] },
        { "camera": 0, "translation": [0, 0, 5] },
        { "extensions": light(0), "translation": [2, 3, 0], "rotation": [-FRAC_1_SQRT_2, 0, 0, FRAC_1_SQRT_2] },
        { "extensions": light(1) },
        { "camera": 1, "translation": [0, 0, 8] },
    ]);
    let turns = file.floats("VEC4", &[0., 0., 0., 1., 0., FRAC_1_SQRT_2, 0., FRAC_1_SQRT_2]);
    animate(&mut file, 1, "rotation", "LINEAR", &[0.0, 1.0], turns);
    // As the node stands anyway.
    let rest = file.floats("VEC3", &[0.0, 1.0, 0.0]);
    animate(&mut file, 1, "translation", "LINEAR", &[0.0], rest);
    file.json["animations"][0]["name"] = "turn".into();
    file.json["animations"][1]["name"] = "rest".into();
    file
}

#[test]
fn cameras_and_lights_ride_on_animated_nodes() {
    let file = turntable();
    for far in [[0.0, 1.0, 0.0], [1e5, 1.0, -3e6]] {
        let mut file = file.clone();
        file.json["nodes"][1]["translation"] = json!(far);
        file.json["animations"].as_array_mut().unwrap().truncate(1);
        for node in [0, 5] {
            file.json["nodes"][node]["translation"] = json!([far[0], far[1] - 1.0, far[2] + node as f64 * 1.6]);
        }
        let scene = file.load();
        let hub = (DVec3::from(far) - scene.origin).as_vec3();
        let mut setup = Setup::new("turntable", &scene).unwrap();
        for name in ["rider", "still"] {
            assert_eq!(scene.cameras.iter().find(|c| c.name == name).unwrap().node.is_some(), name == "rider");
        }
        for name in ["star", "sun"] {
            setup.add_light(parse_light(&scene, name, setup.clock()).unwrap()).unwrap();
        }
        let still = parse_camera(&scene, "still", Clock::default()).unwrap();
        let sun = setup.more_lights[1];
        // One after the other, also back and beyond the end.
        for time in [0.0f32, 0.25, 1.0, 7.0, 0.5, 0.0] {
            setup.set_clock(&scene, Clock { animation: 0, time });
            // What the window does every frame.
            setup.count_from(scene.origin);
            let turn = Quat::from_rotation_y(FRAC_PI_2 * time.min(1.0));
            let camera = setup.camera;
            assert!(camera.position.distance(hub + turn * (5.0 * Vec3::Z)) < 1e-5, "{far:?} at {time}: {camera:?}");
            assert!(camera.forward().distance(turn * Vec3::NEG_Z) < 1e-5, "{far:?} at {time}: {camera:?}");
            let Light::Spot { position, direction, .. } = setup.light else { panic!("{:?}", setup.light) };
            assert!(position.distance(hub + turn * Vec3::new(2.0, 3.0, 0.0)) < 1e-5, "{far:?} at {time}: {position}");
            assert!(direction.distance(Vec3::NEG_Y) < 1e-5, "{direction}");
            let Light::Directional { to_light, .. } = setup.more_lights[0].light else { panic!() };
            assert!(to_light.distance(turn * Vec3::Z) < 1e-5, "{to_light}");
            assert_eq!(setup.more_lights[1], sun);
            // By name it is the same there.
            let named = parse_camera(&scene, "rider", setup.clock()).unwrap();
            assert_eq!((named, parse_light(&scene, "beam", setup.clock()).unwrap()), (camera, setup.light));
            assert_eq!(parse_camera(&scene, "still", setup.clock()).unwrap(), still);
        }
        // Taken in hand, they stay.
        setup.camera.position += Vec3::Y;
        *setup.light.color_mut() *= 2.0;
        let own = (setup.camera, setup.light);
        setup.set_clock(&scene, Clock { animation: 0, time: 0.7 });
        assert_eq!((setup.camera, setup.light), own);
    }
}

/// Through files a set-up stays the same, and what follows goes on following; names mean the moment that the file has.
#[test]
fn figures_reopen_where_they_were_and_follow_on() {
    let folder = tempfile::tempdir().unwrap();
    let mut file = turntable();
    file.json["nodes"][0]["translation"] = json!([123456.7, 0, -1e6]);
    file.json["nodes"][1]["translation"] = json!([123456.7, 1, -1e6]);
    std::fs::write(folder.path().join("scene.glb"), file.glb()).unwrap();
    let write = |text: &str| {
        let path = folder.path().join("figure.toml");
        std::fs::write(&path, text).unwrap();
        Setup::open(&path.to_string_lossy()).unwrap()
    };
    let (named, scene) = write("scene = \"scene.glb\"\ntime = 0.3\ncamera = \"rider\"\nlight = \"star\"\n");
    assert_eq!(named.camera, parse_camera(&scene, "rider", named.clock()).unwrap());
    assert_eq!(named.light, parse_light(&scene, "star", named.clock()).unwrap());
    // What is left out is the scene's first.
    let (first, _) = write("scene = \"scene.glb\"\ntime = 0.3\n");
    assert_eq!((first.camera, first.light), (named.camera, parse_light(&scene, "beam", named.clock()).unwrap()));
    for time in [0.0f32, 0.1, 0.37, 0.999] {
        let mut there = first.clone();
        there.set_clock(&scene, Clock { animation: 0, time });
        let (mut back, scene) = write(&there.to_toml(&folder.path().join("figure.toml")).unwrap());
        assert_eq!(back, there);
        back.set_clock(&scene, Clock { animation: 0, time: 0.6 });
        assert_eq!(back.camera, parse_camera(&scene, "rider", back.clock()).unwrap(), "from {time}");
        assert_eq!(back.light, parse_light(&scene, "beam", back.clock()).unwrap(), "from {time}");
    }
}
