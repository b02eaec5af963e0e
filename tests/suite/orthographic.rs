//! Orthographic and rolled cameras: the picture itself, and every technique's shadow in it.

use crate::common::*;
use crate::laws::in_turn;
use glam::{DVec3, Vec2, Vec3};
use shadowscope::frame::{Ask, Renderer, Truth};
use shadowscope::light::Light;
use shadowscope::measure;
use shadowscope::scene::Camera;
use shadowscope::setup::Setup;
use shadowscope::techniques;

/// Looks down on the yard from the side, and shows ten metres of it.
fn view() -> Camera {
    Camera { height: Some(10.0), ..camera(Vec3::new(6.0, 9.0, 12.0), Vec3::new(0.0, 0.5, 0.0)) }
}

fn over_the_yard(camera: Camera, light: Light, size: [u32; 2]) -> (Renderer, Setup) {
    start(scene(vec![mesh(&yard(), 0)], vec![material(Vec3::ONE)], camera, light), size)
}

fn lights() -> [Light; 5] {
    [
        sun(Vec3::new(-0.5, 0.8, 0.3)),
        spot(Vec3::new(-6.0, 6.0, 4.0), Vec3::ZERO, 50.0),
        lamp(Vec3::new(0.3, 3.5, 0.8)),
        plate(Vec3::new(-4.0, 5.0, 2.0), Vec3::ZERO, 0.6),
        // From the camera's side, so that the eye looks along the shadows.
        lamp(Vec3::new(2.0, 5.0, 5.0)),
    ]
}

#[test]
fn pixels_see_what_lies_along_the_camera_axis() {
    let size = [40, 30];
    for camera in [view(), Camera { up: Vec3::new(0.4, 0.9, 0.2), ..view() }] {
        let (mut r, s) = over_the_yard(camera, sun(Vec3::Y), size);
        r.render(&s, Ask { truth: Truth::Off, ..ask(&s) }).unwrap();
        let positions = r.read_position().unwrap();
        let [x, y, corner] = camera.rays(size);
        let forward = camera.forward().as_dvec3();
        let mut seen = 0;
        for (i, p) in positions.iter().enumerate() {
            let at = [i as f64 % 40.0 + 0.5, (i / 40) as f64 + 0.5];
            let start = camera.position.as_dvec3() + corner + x * at[0] + y * at[1];
            let found = DVec3::new(p[0] as f64, p[1] as f64, p[2] as f64);
            if p[3] > 0.0 {
                let off = (found - start).cross(forward).length();
                assert!(off < 1e-4, "pixel {i} is {off} m off its ray");
                assert!(((found - camera.position.as_dvec3()).dot(forward) - p[3] as f64).abs() < 1e-4);
                seen += 1;
            }
        }
        assert!(seen > 900, "{seen}");
    }
}

/// A camera that lies on its side sees the same picture, turned.
#[test]
fn a_quarter_of_roll_turns_the_picture() {
    let size = [48, 48];
    for height in [None, Some(10.0)] {
        let upright = Camera { height, ..view() };
        let picture = |roll: f32| {
            let mut camera = upright;
            camera.set_roll(roll);
            let (mut r, s) = over_the_yard(camera, lights()[0], size);
            r.render(&s, ask(&s)).unwrap();
            r.read_hard_truth().unwrap()
        };
        let (before, after) = (picture(0.0), picture(std::f32::consts::FRAC_PI_2));
        let mut shadow = 0;
        let mut differ = 0;
        for y in 0..48usize {
            for x in 0..48usize {
                // What was on the right is at the top.
                let turned = after[(47 - x) * 48 + y];
                differ += (before[y * 48 + x] != turned) as usize;
                shadow += (turned == 0.0) as usize;
            }
        }
        assert!(shadow > 25 && differ <= 4, "{differ} of 2304 differ, {shadow} in shadow");
    }
}

#[test]
fn every_technique_is_as_right_as_in_perspective() {
    let size = [120, 90];
    let tilted = Camera { up: Vec3::new(0.3, 1.0, 0.0), ..view() };
    let close = Camera { height: None, ..tilted };
    let (mut r, mut s) = over_the_yard(tilted, lights()[0], size);
    let mut wrong = Vec::new();
    for info in techniques::ALL.iter() {
        let Some(light) = in_turn(info, &lights()) else { continue };
        let share = |r: &mut Renderer, s: &mut Setup, camera: Camera| {
            (s.camera, s.light) = (camera, light);
            choose(s, info, 512, &[]);
            let e = measure::errors(r, s).unwrap();
            assert!(e.facing > 3000, "{}: {}", info.id, e.facing);
            (e.lit_incorrect + e.shadow_incorrect) as f64 / e.facing as f64
        };
        let [even, perspective] = [tilted, close].map(|camera| share(&mut r, &mut s, camera));
        if even > 1.5 * perspective + 0.006 {
            wrong.push(format!("{}: {even:.4} for {perspective:.4} in perspective", info.id));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// An orthographic picture has no point at infinity: volumes end behind the scene.
#[test]
fn volumes_are_exact_in_every_method() {
    for light in [lights()[0], lights()[1], lights()[2], lights()[4]] {
        let (mut r, mut s) = over_the_yard(view(), light, [80, 60]);
        for technique in ["shadow-volume", "shadow-volume-tri"] {
            for method in ["zfail", "auto"] {
                for counting in ["additive", "stencil8"] {
                    let sets = [format!("method={method}"), format!("counting={counting}")];
                    let e = errors(&mut r, &mut s, technique, &[&sets[0], &sets[1]]);
                    assert!(e.shadow_correct > 60, "{e:?}");
                    assert_eq!(e.lit_incorrect + e.shadow_incorrect, 0, "{technique} {sets:?} {light:?}");
                }
            }
        }
    }
}

#[test]
fn what_has_no_meaning_there_says_so() {
    let (mut r, mut s) = over_the_yard(view(), lights()[0], [40, 30]);
    let mut notes = |technique: &str, sets: &[&str]| {
        select(&mut s, technique, sets);
        r.render(&s, Ask { truth: Truth::Off, ..ask(&s) }).unwrap();
        r.notes().unwrap().join(" ")
    };
    for technique in ["psm", "tsm", "lispsm", "logpsm"] {
        assert!(notes(technique, &[]).contains("no perspective"), "{technique}");
    }
    assert!(notes("pssm", &[]).contains("uniform"));
    assert!(notes("shadow-map", &["contact=sweep"]).contains("march"));
    assert!(!notes("shadow-map", &["contact=march"]).contains("orthographic"));
}

/// The march repairs what a large bias takes away, as in perspective.
#[test]
fn contact_shadows_march_through_an_even_picture() {
    // A plate so near the floor that a bias takes all of its shadow away.
    let mut triangles = floor(Vec2::splat(-12.0), Vec2::splat(12.0), 0.0);
    triangles.extend(floor(Vec2::splat(-2.0), Vec2::splat(2.0), 0.3));
    let (mut r, mut s) = start(
        scene(vec![mesh(&triangles, 0)], vec![material(Vec3::ONE)], view(), sun(Vec3::new(-0.9, 0.5, 0.4))),
        [120, 90],
    );
    let without = errors(&mut r, &mut s, "shadow-map", &["bias=1"]);
    let with = errors(&mut r, &mut s, "shadow-map", &["bias=1", "contact=march", "contact_length=1"]);
    assert!(without.lit_incorrect > 20, "{without:?}");
    assert!(2 * with.lit_incorrect < without.lit_incorrect, "{} of {}", with.lit_incorrect, without.lit_incorrect);
    assert!(with.shadow_incorrect < without.lit_incorrect / 4 + without.shadow_incorrect + 8, "{with:?}");
}

/// How far before the scene such a camera stands changes nothing, and rays may begin within what its near plane cuts.
#[test]
fn the_cameras_distance_means_nothing() {
    let back = |by: f32| {
        let v = view();
        Camera { position: v.position - v.forward() * by, far: v.far + by, near: v.near + by, ..v }
    };
    for (technique, sets) in [("pssm", &[][..]), ("sdsm", &[]), ("cssm", &[]), ("pcf", &["stored=nearest"])] {
        let at = |by: f32| {
            let light = if technique == "cssm" { lights()[3] } else { lights()[0] };
            let (mut r, mut s) = over_the_yard(back(by), light, [96, 72]);
            let e = errors(&mut r, &mut s, technique, sets);
            (e.lit_incorrect + e.shadow_incorrect) as f64 / e.facing as f64
        };
        let [near, far] = [0.0, 2000.0].map(at);
        assert!((near - far).abs() < 0.004, "{technique}: {near:.4} near by, {far:.4} far off");
    }
    // The near plane cuts the first box of the yard, beside the axis.
    let cut = Camera { height: Some(6.0), ..camera(Vec3::new(0.6, 0.6, -0.2), Vec3::new(0.6, 0.6, -9.0)) };
    let (mut r, mut s) = over_the_yard(cut, sun(Vec3::new(0.3, 0.8, 0.5)), [96, 72]);
    for technique in ["csm-conservative", "izb", "psv", "shadow-volume"] {
        let e = errors(&mut r, &mut s, technique, &[]);
        assert_eq!(e.lit_incorrect + e.shadow_incorrect, 0, "{technique}: {e:?}");
    }
}
