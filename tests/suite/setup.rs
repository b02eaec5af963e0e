//! Set-ups: what they keep, and what they say when something is wrong with them.

use shadowscope::light::Light;
use shadowscope::params::{Kind, Value};
use shadowscope::scene::Clock;
use shadowscope::setup::{Setup, parse_camera, parse_light};
use shadowscope::techniques;
use shadowscope::truth::Samples;
use std::path::Path;

fn read(text: &str) -> anyhow::Result<Setup> {
    Setup::from_toml(text, Path::new("x.toml")).map(|(setup, _)| setup)
}

/// The message of a set-up that must be refused: one line.
fn refusal(text: &str) -> String {
    let message = format!("{:#}", read(text).expect_err(text));
    assert!(!message.contains('\n'), "{message:?} is more than a line");
    message
}

#[test]
fn a_set_up_survives_its_file() {
    let (mut setup, _) = Setup::open("cubes").unwrap();
    setup.select("pcf").unwrap();
    setup.set("kernel=7", &["pcf".into()]).unwrap();
    setup.set("pcf.mode=disk", &[]).unwrap();
    setup.time = 1.25;
    setup.truth_samples = Samples::Fixed(64);
    setup.view = "taps".into();
    setup.camera.position.x = 0.1 + 0.2;
    setup.shadow_camera = Some(shadowscope::scene::Camera { fov: 31.5, ..setup.camera });
    setup.outlines = true;
    setup.light = Light::Spot {
        position: glam::Vec3::new(1.0, 2.5, 3.0),
        direction: glam::Vec3::NEG_Y,
        outer_angle: 33.3,
        range: 70.0,
        radius: 0.35,
        color: glam::Vec3::new(1.0, 0.9, 0.8),
    };
    let text = setup.to_toml(Path::new("x.toml")).unwrap();
    assert_eq!(read(&text).unwrap(), setup, "{text}");
    // All of the technique's parameters are in it, defaults too.
    for name in ["kernel = 7", "mode = \"disk\"", "samples = 16", "resolution = 1024", "hardware_clamp"] {
        assert!(text.contains(name), "{name} is not in\n{text}");
    }
}

/// Files from before lights had a size still open, and a light without one is written as it was then.
#[test]
fn a_lights_size_is_kept_and_may_be_left_out() {
    let (mut setup, scene) = Setup::open("cubes").unwrap();
    for (text, radius) in [
        ("directional:to_light=0,1,0.5", 0.0),
        ("directional:to_light=0,1,0.5;angular_radius=0.27", 0.27f32.to_radians().tan()),
        ("spot:position=0,5,0;direction=0,-1,0.1;outer_angle=30;range=20", 0.0),
        ("spot:position=0,5,0;direction=0,-1,0.1;outer_angle=30;range=20;radius=0.1", 0.1),
        ("omni:position=0,5,0;range=20", 0.0),
        ("omni:position=0,5,0;range=20;radius=10", 10.0),
    ] {
        setup.light = parse_light(&scene, text, Clock::default()).unwrap();
        setup.check().unwrap();
        assert_eq!(setup.light.radius(), radius, "{text}");
        let file = setup.to_toml(Path::new("x.toml")).unwrap();
        assert_eq!(read(&file).unwrap(), setup, "{file}");
        let light = file.split("[light]").nth(1).and_then(|rest| rest.split("\n[").next()).unwrap();
        assert_eq!(light.contains("radius"), radius > 0.0, "{light}");
        // As rows of results hold it.
        let row = serde_json::to_string(&setup).unwrap();
        assert_eq!(serde_json::from_str::<Setup>(&row).unwrap(), setup, "{row}");
    }
}

#[test]
fn short_files_take_the_scenes_camera_and_light() {
    let (first, scene) = Setup::open("bench").unwrap();
    assert_eq!(read("scene = \"bench\"").unwrap(), first);
    let named = read("scene = \"bench\"\ncamera = \"trees-side\"\nlight = \"spot\"\n").unwrap();
    assert_eq!(named.camera, scene.cameras.iter().find(|c| c.name == "trees-side").unwrap().camera);
    assert_eq!(named.light.kind(), "spot");
    let whole_number = read("scene = \"bench\"\n[params.shadow-map]\nbias = 0\n").unwrap();
    assert_eq!(whole_number.params["shadow-map"]["bias"], Value::Float(0.0));
}

#[test]
fn errors_name_the_key_the_value_and_the_range() {
    let with = |rest: &str| refusal(&format!("scene = \"cubes\"\n{rest}"));
    for (text, says) in [
        (with("[params.shadow-map]\nresolution = 9000\n"), vec!["params.shadow-map.resolution", "9000", "64 to 8192"]),
        (with("[params.shadow-map]\nbias = \"much\"\n"), vec!["params.shadow-map.bias", "much", "0 to 100 m"]),
        (with("[params.shadow-map]\nbias = nan\n"), vec!["params.shadow-map.bias", "NaN", "0 to 100 m"]),
        (with("[params.pcf]\nkernel = 4\n"), vec!["params.pcf.kernel", "4", "1 to 9", "steps of 2"]),
        (with("[params.pcf]\nmode = \"box\"\n"), vec!["params.pcf.mode", "box", "grid, hw2x2, tent, disk"]),
        (with("[params.pcf]\nkernal = 3\n"), vec!["params.pcf.kernal", "unknown", "kernel"]),
        (with("[params.esmm]\nc = 3\n"), vec!["esmm", "unknown", "shadow-map, pcf"]),
        (with("technique = \"magic\"\n"), vec!["technique", "magic", "shadow-map"]),
        (with("view = \"xray\"\n"), vec!["view", "xray", "shaded"]),
        (with("size = [0, 100]\n"), vec!["size", "[0, 100]", "1 to 16384"]),
        (with("size = \"big\"\n"), vec!["size", "big", "1 to 16384"]),
        (with("colour = 3\n"), vec!["colour", "camera"]),
        (with("camera = \"nowhere\"\n"), vec!["nowhere", "default"]),
        (with("light = \"nowhere\"\n"), vec!["nowhere", "sun"]),
        (with("truth_samples = 3\n"), vec!["truth_samples", "3", "1, 4, 16, 64, 256, 1024 or 4096"]),
        (with("truth_samples = \"all\"\n"), vec!["truth_samples", "all", "auto"]),
        (with("shadow_camera = \"nowhere\"\n"), vec!["nowhere", "default"]),
        (
            with("[shadow_camera]\nposition = [0,0,0]\ntarget = [0,0,0]\nfov = 50\nnear = 0.1\nfar = 10\n"),
            vec!["shadow_camera.target", "shadow_camera.position"],
        ),
        (with("outlines = 1\n"), vec!["outlines", "true or false"]),
        (with("split = 2.0\n"), vec!["split", "2", "0 to 1"]),
        (with("time = -1.0\n"), vec!["time", "-1", "0 to"]),
        (
            with("[camera]\nposition = [0,0,0]\ntarget = [0,0,1]\nfov = 500\nnear = 0.1\nfar = 10\n"),
            vec!["camera.fov", "500", "1 to 170"],
        ),
        (
            with("[camera]\nposition = [0,0,0]\ntarget = [0,0,1]\nfov = 50\nnear = 20\nfar = 10\n"),
            vec!["camera.far", "10", "camera.near", "20"],
        ),
        (
            with("[light]\nkind = \"directional\"\nto_light = [1e38,-1e38,1]\n"),
            vec!["light.to_light = [1e38, -1e38, 1]", "-1e18 to 1e18"],
        ),
        (
            with("[light]\nkind = \"directional\"\nto_light = [1e-30,0,0]\n"),
            vec!["light.to_light = [1e-30, 0, 0]", "zero"],
        ),
        (
            with("[light]\nkind = \"omni\"\nposition = [0,1e30,0]\nrange = 20\n"),
            vec!["light.position = [0, 1e30, 0]", "-1e18 to 1e18"],
        ),
        (
            with("[light]\nkind = \"omni\"\nposition = [0,1,0]\nrange = 1e38\n"),
            vec!["light.range = 1e38", "1e-6 to 1e9 m"],
        ),
        (with("[light]\nkind = \"directional\"\nto_light = [0,0,0]\n"), vec!["light", "zero"]),
        (with("[light]\nkind = \"laser\"\n"), vec!["laser", "directional"]),
        (with("[light]\nkind = \"omni\"\nposition = [0,1,0]\nrange = -4\n"), vec!["light.range", "-4"]),
        (with("[light]\nkind = \"spot\"\nposition = [0,1,0]\n"), vec!["spot", "direction", "outer_angle"]),
        (
            with("[light]\nkind = \"omni\"\nposition = [0,1,0]\nrange = \"wide\"\n"),
            vec!["light.range", "wide", "0.000001 to"],
        ),
        (
            with("[light]\nkind = \"omni\"\nposition = [0,1,0]\nrange = 3\nto_light = [0,1,0]\n"),
            vec!["light.to_light", "omni"],
        ),
        (
            with("[light]\nkind = \"omni\"\nposition = [0,1,0]\nrange = 3\nradius = 10.5\n"),
            vec!["light.radius", "10.5", "0 to 10 m"],
        ),
        (
            with("[light]\nkind = \"omni\"\nposition = [0,1,0]\nrange = 3\nradius = \"big\"\n"),
            vec!["light.radius", "big", "0 to 10 m"],
        ),
        (
            with(
                "[light]\nkind = \"spot\"\nposition = [0,1,0]\ndirection = [0,-1,0]\nouter_angle = 30\nrange = 3\nradius = -1\n",
            ),
            vec!["light.radius", "-1", "0 to 10 m"],
        ),
        (
            with("[light]\nkind = \"directional\"\nto_light = [0,1,0]\nangular_radius = nan\n"),
            vec!["light.angular_radius", "NaN", "0 to 10°"],
        ),
        (
            with("[light]\nkind = \"directional\"\nto_light = [0,1,0]\nradius = 1\n"),
            vec!["light.radius", "directional", "angular_radius"],
        ),
        (
            with("[light]\nkind = \"hemisphere\"\nposition = [0,1,0]\ndirection = [0,-1,0]\nrange = 3\nradius = 1\n"),
            vec!["light.radius", "hemisphere"],
        ),
        (with("animation = 7\n"), vec!["animation", "7", "0 to 0"]),
        (with("time = \"x\"\n"), vec!["time", "x", "0 to"]),
        (with("[params.pcf]\nkernel = [1]\n"), vec!["params.pcf.kernel", "[1]", "1 to 9"]),
        (with("[params.pcf]\nkernel = 3.0\n"), vec!["params.pcf.kernel", "3.0", "1 to 9"]),
        (refusal("scene = 3"), vec!["scene", "3", "built-in"]),
        (refusal("camera = \"x\""), vec!["scene", "missing"]),
        (refusal("scene = \"atlantis\""), vec!["atlantis", "bench"]),
        (refusal("scene = \"missing.glb\""), vec!["missing.glb"]),
        (refusal("scene = [\n"), vec!["line"]),
    ] {
        for part in says {
            assert!(text.contains(part), "{part:?} is not in: {text}");
        }
    }
}

/// Of every parameter both ends of its range are taken, and what lies beyond them is not, be it written as a whole number or not.
#[test]
fn ranges_are_kept_at_both_ends() {
    for info in techniques::ALL.iter() {
        for spec in info.specs() {
            let taken = |value: Value| {
                let found = spec.check("key", &value);
                if let Err(e) = &found {
                    assert!(format!("{e}").contains(&spec.range()), "{e}");
                }
                found.ok()
            };
            let at = || format!("{} {}", info.id, spec.name);
            match spec.kind {
                Kind::Float { min, max, .. } => {
                    for end in [min, max] {
                        assert_eq!(taken(Value::Float(end)), Some(Value::Float(end)), "{}", at());
                    }
                    for beyond in [min - 1e-3, max + 1e-3, f64::NAN] {
                        assert_eq!(taken(Value::Float(beyond)), None, "{} at {beyond}", at());
                    }
                    for whole in [min.ceil(), max.floor()] {
                        let within = (min..=max).contains(&whole).then_some(Value::Float(whole));
                        assert_eq!(taken(Value::Int(whole as i64)), within, "{} at {whole}", at());
                    }
                    for beyond in [min.floor() as i64 - 1, max.ceil() as i64 + 1] {
                        assert_eq!(taken(Value::Int(beyond)), None, "{} at {beyond}", at());
                    }
                }
                Kind::Int { min, max, step, .. } => {
                    for end in [min, min + (max - min) / step * step] {
                        assert_eq!(taken(Value::Int(end)), Some(Value::Int(end)), "{}", at());
                    }
                    for beyond in [min - step, max + step] {
                        assert_eq!(taken(Value::Int(beyond)), None, "{} at {beyond}", at());
                    }
                    if step > 1 {
                        assert_eq!(taken(Value::Int(min + 1)), None, "{} between two steps", at());
                    }
                    assert_eq!(taken(Value::Float(min as f64)), None, "{}", at());
                }
                Kind::Choice { options, .. } => {
                    for option in options {
                        assert!(taken(Value::Text((*option).into())).is_some(), "{} {option}", at());
                    }
                    assert_eq!(taken(Value::Text("none such".into())), None, "{}", at());
                }
                Kind::Flag { .. } => {
                    assert_eq!(taken(Value::Bool(true)), Some(Value::Bool(true)));
                    assert_eq!(taken(Value::Int(1)), None, "{}", at());
                }
            }
        }
    }
}

#[test]
fn the_command_lines_words_are_read() {
    let (mut setup, scene) = Setup::open("cubes").unwrap();
    let camera = parse_camera(&scene, "1,2,3:0,0.5,0:40", Clock::default()).unwrap();
    assert_eq!((camera.position.to_array(), camera.target.y, camera.fov), ([1.0, 2.0, 3.0], 0.5, 40.0));
    let light = parse_light(&scene, "spot:position=0,5,0;direction=0,-1,0.1;outer_angle=30;range=20", Clock::default())
        .unwrap();
    assert_eq!(light.kind(), "spot");
    for bad in ["1,2:0,0,0:40", "1,2,x:0,0,0:40", "nowhere"] {
        assert!(parse_camera(&scene, bad, Clock::default()).is_err(), "{bad}");
    }
    // One of the scene's, changed.
    let (own, wider) = (
        parse_light(&scene, "sun", Clock::default()).unwrap(),
        parse_light(&scene, "sun:angular_radius=0.5", Clock::default()).unwrap(),
    );
    assert!((wider.radius() - 0.5f32.to_radians().tan()).abs() < 1e-6 && wider.position() == own.position());
    assert!(parse_light(&scene, "sun:outer_angle=20", Clock::default()).is_err(), "a sun has no cone");
    for bad in ["spot:position=0,5,0;angular_radius=1", "spot:where=1", "lamp:position=0,0,0;range=3", "omni:position"]
    {
        assert!(parse_light(&scene, bad, Clock::default()).is_err(), "{bad}");
    }
    // A bare key goes to every technique that has it, and to no other.
    let both = ["shadow-map".to_string(), "pcf".to_string(), "rt-hard".to_string()];
    setup.set("resolution=2048", &both).unwrap();
    assert_eq!(setup.params["pcf"]["resolution"], Value::Int(2048));
    assert_eq!(setup.params["shadow-map"]["resolution"], Value::Int(2048));
    assert!(!setup.params.get("rt-hard").is_some_and(|v| v.contains_key("resolution")));
    for bad in ["resolution", "resolution=many", "resolution=10", "reslution=512", "magic.x=1", "rt-hard.bias=1"] {
        let message = format!("{:#}", setup.set(bad, &both).expect_err(bad));
        assert!(!message.contains('\n') && message.len() > 20, "{message}");
    }
}

/// A set-up's scene lies where the set-up's file says, wherever the program is started.
#[test]
fn the_scenes_path_counts_from_the_set_ups_file() {
    let dir = tempfile::tempdir().unwrap();
    let models = dir.path().join("models");
    let figures = dir.path().join("figures");
    std::fs::create_dir(&models).unwrap();
    std::fs::create_dir(&figures).unwrap();
    let triangle = r#"{"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}],
        "bufferViews":[{"buffer":0,"byteLength":36}],
        "buffers":[{"byteLength":36,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]}"#;
    let model = models.join("a.gltf");
    std::fs::write(&model, triangle).unwrap();
    let (setup, _) = Setup::open(&model.to_string_lossy()).unwrap();
    let file = figures.join("a.toml");
    let text = setup.to_toml(&file).unwrap();
    assert!(text.contains("scene = \"../models/a.gltf\""), "{text}");
    std::fs::write(&file, &text).unwrap();
    let (again, scene) = Setup::open(&file.to_string_lossy()).unwrap();
    assert_eq!((scene.triangles(), again.to_toml(&file).unwrap()), (1, text));
}

/// Files and rows from before a parameter had its present name.
#[test]
fn parameters_with_their_old_names_still_open() {
    let text = "scene = \"cubes\"\ntechnique = \"rtw\"\n[params.rtw]\nk_e = 3.5\ntau = 0.02\ne = 0.1\n[params.psm]\npush = false\n";
    let (setup, _) = Setup::from_toml(text, Path::new("old.toml")).unwrap();
    let values = setup.values();
    assert_eq!(values["edge_weight"], Value::Float(3.5));
    assert_eq!((&values["edge_threshold"], &values["floor"]), (&Value::Float(0.02), &Value::Float(0.1)));
    assert_eq!(setup.params["psm"]["push_near"], Value::Bool(false));
    let row = serde_json::to_string(&setup).unwrap().replace("edge_weight", "k_e");
    let read: Setup = serde_json::from_str(&row).unwrap();
    assert_eq!(read, setup);
    // What another technique calls by that name is left alone.
    let text = "scene = \"cubes\"\n[params.pcf]\nk_e = 3.5\n";
    assert!(Setup::from_toml(text, Path::new("old.toml")).unwrap_err().to_string().contains("k_e"));
}

/// Cascades that had a blur of their own look up by pcf now, with an odd number of taps.
#[test]
fn cascades_of_former_files_keep_their_blur() {
    let values = |more: &str| {
        let text = format!("scene = \"cubes\"\ntechnique = \"pssm\"\n[params.pssm]\n{more}");
        read(&text).unwrap().values().clone()
    };
    let blurred = values("blur = 0.5\ntaps = 4\n");
    assert_eq!(blurred.get("filter"), Some(&Value::Text("pcf".into())));
    assert_eq!(blurred.get("kernel"), Some(&Value::Int(5)));
    let hard = values("blur = 0.0\ntaps = 3\n");
    assert_eq!(hard.get("filter"), Some(&Value::Text("nearest".into())));
    let chosen = values("filter = \"msm\"\nblur = 0.5\n");
    assert_eq!(chosen.get("filter"), Some(&Value::Text("msm".into())));
}

#[test]
fn a_path_has_a_bounded_number_of_keys() {
    let key = |i: u32| format!("[[path.keys]]\ntime = {i}\nlight.to_light = [0, 1, 0]\n");
    let keys: String = (0..=10_000).map(key).collect();
    let message = refusal(&format!("scene = \"cubes\"\n{keys}"));
    assert!(message.contains("10001 keys; a path takes up to 10000"), "{message}");
}

/// The places of all numbers below a value.
fn numbers(value: &mut toml::Value, at: &mut dyn FnMut(&mut toml::Value)) {
    match value {
        toml::Value::Float(_) | toml::Value::Integer(_) => at(value),
        toml::Value::Array(items) => items.iter_mut().for_each(|item| numbers(item, at)),
        toml::Value::Table(table) => table.iter_mut().for_each(|(_, value)| numbers(value, at)),
        _ => {}
    }
}

/// Whatever number of a set-up is none, or leaves the range of 32-bit floats, is refused.
#[test]
fn numbers_that_are_none_are_refused_everywhere() {
    let (_, scene) = Setup::open("cubes").unwrap();
    let mut checked = 0;
    for file in ["full", "omni"] {
        let text = std::fs::read_to_string(format!("tests/corpus/setup/{file}.toml")).unwrap();
        let table: toml::Table = text.parse().unwrap();
        Setup::in_scene(table.clone(), "cubes", &scene).unwrap();
        let mut count = 0;
        numbers(&mut table.clone().into(), &mut |_| count += 1);
        for place in 0..count {
            for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e39] {
                let (mut changed, mut i) = (toml::Value::Table(table.clone()), 0);
                numbers(&mut changed, &mut |value| {
                    if i == place {
                        *value = bad.into();
                    }
                    i += 1;
                });
                let toml::Value::Table(changed) = changed else { unreachable!() };
                let told = toml::to_string(&changed).unwrap();
                let message = format!("{:#}", Setup::in_scene(changed, "cubes", &scene).expect_err(&told));
                assert!(!message.contains('\n') && message.len() < 500, "{message}");
                checked += 1;
            }
        }
    }
    assert!(checked > 300, "{checked}");
}
