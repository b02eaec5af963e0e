//! A set-up as a command: what is pasted into a shell draws the same picture.

use crate::common::{Random, shadowscope};
use crate::gltf::motion::turntable;
use glam::Vec3;
use shadowscope::capture;
use shadowscope::cli;
use shadowscope::params::{Kind, Value};
use shadowscope::path::{Between, Key, OwnPath};
use shadowscope::scene::{Camera, Clock, Scene};
use shadowscope::setup::{Arrange, Base, Overlay, Setup, Side, parse_camera, parse_light};
use shadowscope::techniques::{self, Info};
use shadowscope::truth::Samples;
use std::sync::Arc;

/// What the picture depends on: not on parameters of techniques that it does not show.
fn shown(mut s: Setup) -> Setup {
    let technique = s.technique.clone();
    s.params.retain(|id, _| *id == technique);
    s.shadow_camera = s.frozen();
    s
}

/// Copies a set-up as a command, reads that, and compares.
fn check(s: &Setup, scene: &Scene) {
    s.check().unwrap();
    let command = s.command(scene, "picture.png").unwrap();
    assert!(!command.contains('\n'), "{command}");
    let (found, _) = cli::captured(&command).unwrap_or_else(|e| panic!("{command}: {e:#}"));
    assert_eq!(shown(found), shown(s.clone()), "{command}");
}

/// Some other value of each parameter, none the default.
fn turned(info: &'static Info, random: &mut Random, unit: f64) -> Vec<(&'static str, Value)> {
    let other = |spec: &'static shadowscope::params::Spec| {
        let default = spec.default_in(unit);
        let value = match spec.kind {
            Kind::Flag { default } => Value::Bool(!default),
            Kind::Int { min, max, step, .. } => {
                let steps = (max - min) / step;
                Value::Int(min + step * ((steps as f32 * random.next()) as i64).min(steps))
            }
            Kind::Float { min, max, .. } => {
                Value::Float((min + (max - min) * f64::from(random.next()) * 0.37).clamp(min, max))
            }
            Kind::Choice { options, .. } => Value::Text(options[options.len() - 1].into()),
        };
        (spec.name, if value == default { default } else { value })
    };
    info.specs().map(other).collect()
}

/// All techniques with parameters that are not the default ones, alone and beside another.
#[test]
fn every_parameter_survives_its_command() {
    let (start, scene) = Setup::open("cubes").unwrap();
    let mut random = Random(5);
    for info in techniques::ALL.iter() {
        for _ in 0..3 {
            let mut s = start.clone();
            s.select(info.id).unwrap();
            let values = turned(info, &mut random, s.unit);
            s.params.get_mut(info.id).unwrap().extend(values.into_iter().map(|(n, v)| (n.to_string(), v)));
            if s.check().is_err() {
                continue;
            }
            check(&s, &scene);
            let mut side = Side::new(info.id).unwrap();
            side.params = s.values().clone();
            let beside = Setup { against: vec![side, Side::new("truth").unwrap()], ..start.clone() };
            check(&beside, &scene);
        }
    }
}

type Change = Box<dyn Fn(&mut Setup)>;

/// Every other key, one by one and all at once.
#[test]
fn every_key_survives_its_command() {
    for name in ["cubes", "st-wire"] {
        let (start, scene) = Setup::open(name).unwrap();
        check(&start, &scene);
        assert_eq!(start.command(&scene, "a b.png").unwrap(), format!("shadowscope capture {name} -o 'a b.png'"));
        let moved = |camera: Camera| Camera { position: camera.position + Vec3::new(0.1, 1.0 / 3.0, -1e-4), ..camera };
        let sides = vec![Side::parse("pssm:lambda=0.8;cascades=3").unwrap(), Side::new("truth").unwrap()];
        let mut path = OwnPath { between: Between::Linear, ..OwnPath::default() };
        path.set(Key::of(&start, 0.25, [true, true]));
        path.set(Key::of(&Setup { camera: moved(start.camera), ..start.clone() }, 2.125, [true, false]));
        let change: Vec<(&str, Change)> = vec![
            ("size", Box::new(|s| s.size = [321, 7])),
            ("technique", Box::new(|s| s.select("pcf").unwrap())),
            ("view", Box::new(|s| s.view = "error".into())),
            ("against", Box::new(move |s| (s.against = sides.clone(), s.complete()).1)),
            ("arrange", Box::new(|s| s.arrange = Arrange::SideBySide)),
            ("split", Box::new(|s| s.split = 1.0 / 3.0)),
            ("legend", Box::new(|s| s.legend = true)),
            ("supersample", Box::new(|s| s.supersample = 3)),
            ("transparent", Box::new(|s| s.transparent = true)),
            ("crop", Box::new(|s| s.crop_to([3, 1, 100, 5]))),
            ("seed", Box::new(|s| s.seed = u32::MAX)),
            ("truth samples", Box::new(|s| s.truth_samples = Samples::Fixed(64))),
            ("dilation", Box::new(|s| s.error_dilation = 2)),
            ("base", Box::new(|s| s.error_base = Base::Light)),
            ("window", Box::new(|s| s.error_window = 31)),
            ("probe", Box::new(|s| s.probe = [0.1, 0.7])),
            ("outlines", Box::new(|s| s.outlines = true)),
            ("time", Box::new(|s| s.time = 0.1)),
            ("light off", Box::new(|s| s.light_on = false)),
            ("camera", Box::new(move |s| s.camera = moved(s.camera))),
            ("rolled", Box::new(|s| s.camera.up = Vec3::new(0.3, 1.0, -0.2))),
            ("orthographic", Box::new(|s| (s.camera.height, s.camera.fov) = (Some(7.3), 31.0))),
            ("planes", Box::new(|s| (s.camera.near, s.camera.far) = (0.3, 77.7))),
            ("frozen", Box::new(move |s| s.shadow_camera = Some(Camera { far: 55.5, ..moved(moved(s.camera)) }))),
            ("path", Box::new(move |s| s.path = Some(Arc::new(path.clone())))),
            ("overlay", Box::new(|s| s.overlay = Some(Overlay { view: "error".into(), opacity: 0.3, inset: false }))),
            ("inset", Box::new(|s| s.overlay = Some(Overlay { view: "error".into(), opacity: 0.7, inset: true }))),
        ];
        let mut all = start.clone();
        for (_, change) in &change {
            let mut one = start.clone();
            change(&mut one);
            one.count_from(scene.origin);
            check(&one, &scene);
            change(&mut all);
        }
        all.count_from(scene.origin);
        (all.arrange, all.front) = (Arrange::Flicker, 2);
        check(&all, &scene);
        // Each of the scene's cameras and lights goes by its name.
        for camera in &scene.cameras {
            let s = Setup { camera: camera.at(&scene, start.clock()), ..start.clone() };
            check(&s, &scene);
            let text = s.command(&scene, "p.png").unwrap();
            assert!(s.camera == start.camera || text.contains(&format!("--camera {}", camera.name)), "{text}");
        }
    }
}

/// One light of each kind, and several: named and not, on and off, any of them at work.
#[test]
fn lights_survive_their_command() {
    let (start, scene) = Setup::open("bench").unwrap();
    let lights = [
        "sun",
        "sun:angular_radius=0.27",
        "directional:to_light=0.1,1,0.3;color=3,2.9,2.7",
        "spot:position=0,5,0;direction=0.1,-1,0;outer_angle=33.3;range=20;radius=0.1",
        "omni:position=0,5,0.3333;range=20;color=100,90,80",
        "hemisphere:position=0,5,0;direction=0,-1,0;range=20",
        "rect-area:center=0,5,0;half_u=1,0,0;half_v=0,0,0.5;range=20",
    ];
    let lights: Vec<_> = lights.iter().map(|text| parse_light(&scene, text, start.clock()).unwrap()).collect();
    for light in &lights {
        check(&Setup { light: *light, ..start.clone() }, &scene);
    }
    for at_work in 0..lights.len() {
        let mut s = Setup { light: lights[0], ..start.clone() };
        lights[1..].iter().for_each(|light| s.add_light(*light).unwrap());
        s.add_all_lights(&scene).unwrap();
        s.switch_light(1, false);
        s.switch_light((at_work + 3) % 7, false);
        s.choose_light(at_work).unwrap();
        check(&s, &scene);
    }
}

/// Files: with spaces and quotes in their names, far from zero, with several lights and an animation of their own.
#[test]
fn files_survive_their_command() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("it's a $HOME of \"cubes\".ply");
    // A triangle far from zero, whose places need 64 bits.
    let ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty double x\nproperty double y\nproperty double z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n500000.25 3 4000000\n500004 3 4000000.5\n500001 7 4000003\n3 0 1 2\n";
    std::fs::write(&file, ply).unwrap();
    let (start, scene) = Setup::open(file.to_str().unwrap()).unwrap();
    check(&start, &scene);
    let mut s = Setup {
        camera: parse_camera(&scene, "500010.5,12,4000009:500001.125,5,4000001:41", start.clock()).unwrap(),
        light: parse_light(&scene, "omni:position=500003,20,4000002;range=90", start.clock()).unwrap(),
        ..start
    };
    s.count_from(scene.origin);
    check(&s, &scene);
    let text = s.command(&scene, "p.png").unwrap();
    assert!(text.contains("500010.5,12,4000009:500001.125,5,4000001:41"), "{text}");
    assert!(text.contains("position=500003,20,4000002"), "{text}");
}

/// What an animation moves is named as it stands at the set-up's time, or given by numbers.
#[test]
fn animated_scenes_survive_their_command() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("turntable.glb");
    std::fs::write(&file, turntable().glb()).unwrap();
    let (start, scene) = Setup::open(file.to_str().unwrap()).unwrap();
    for time in [0.0, 0.37, 1.0] {
        let mut s = start.clone();
        s.set_clock(&scene, Clock { time, ..s.clock() });
        assert!(time == 0.0 || s.camera != start.camera, "the camera rides along");
        check(&s, &scene);
        s.add_all_lights(&scene).unwrap();
        s.choose_light(1).unwrap();
        check(&s, &scene);
        s.camera = start.camera;
        check(&s, &scene);
    }
}

/// The command, run, writes the file that the window's capture writes, byte for byte.
#[test]
fn the_command_draws_the_same_file() {
    let folder = tempfile::tempdir().unwrap();
    let (mut s, scene) = Setup::open("cubes").unwrap();
    s.select("pcf").unwrap();
    s.set("kernel=7", &["pcf".into()]).unwrap();
    s.camera = parse_camera(&scene, "4,3,9:0,0.5,0:45:0.1,1,0:near=0.2", s.clock()).unwrap();
    s.light = parse_light(&scene, "sun:angular_radius=0.5", s.clock()).unwrap();
    s.against = vec![Side::new("truth").unwrap()];
    (s.size, s.legend, s.supersample) = ([64, 36], true, 2);
    s.crop_to([10, 4, 50, 30]);
    let own = folder.path().join("own.png");
    let command = s.command(&scene, "it's.png").unwrap();
    let mut r = shadowscope::frame::Renderer::new(crate::common::gpu(), Arc::new(scene)).unwrap();
    capture::capture(&mut r, &s, &own).unwrap();
    let words = shlex::split(&command).unwrap();
    let out = shadowscope(folder.path(), &words[1..].iter().map(String::as_str).collect::<Vec<_>>());
    assert!(out.status.success(), "{command}: {}", String::from_utf8_lossy(&out.stderr));
    assert!(std::fs::read(&own).unwrap() == std::fs::read(folder.path().join("it's.png")).unwrap(), "{command}");
}
