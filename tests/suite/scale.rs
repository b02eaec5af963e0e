//! Scenes of any size: what nobody chose is in proportion to the scene.

use crate::common::*;
use crate::laws::in_turn;
use crate::techniques::cuboid;
use glam::{Vec2, Vec3};
use shadowscope::frame::Renderer;
use shadowscope::light::Light;
use shadowscope::measure;
use shadowscope::measure::metrics::FACING;
use shadowscope::params::Value;
use shadowscope::scene::{Camera, Scene};
use shadowscope::setup::Setup;
use shadowscope::techniques;

/// The yard, 34 m across, so many times as large, with what looks at it.
fn yard_of(size: f32, light: Light) -> Scene {
    let triangles: Vec<_> = yard().iter().map(|t| t.map(|p| p * size)).collect();
    let view = camera(Vec3::new(6.0, 5.0, 9.0) * size, Vec3::new(0.0, 0.5, 0.0) * size);
    let view = Camera { near: view.near * size, far: view.far * size, ..view };
    let mut light = light;
    light.place_mut().into_iter().for_each(|place| *place *= size);
    match &mut light {
        Light::Spot { range, radius, .. } | Light::Omni { range, radius, .. } => {
            (*range, *radius) = (*range * size, *radius * size)
        }
        Light::RectArea { half_u, half_v, range, .. } => {
            (*half_u, *half_v, *range) = (*half_u * size, *half_v * size, *range * size)
        }
        _ => {}
    }
    let diagonal = 34.0 * size;
    Scene { diagonal, ..scene(vec![mesh(&triangles, 0)], vec![material(Vec3::ONE)], view, light) }
}

#[test]
fn every_technique_is_as_right_in_a_scene_of_any_size() {
    let lights = [
        sun(Vec3::new(-0.5, 0.8, 0.3)),
        lamp(Vec3::new(0.3, 4.0, 2.0)),
        plate(Vec3::new(-4.0, 5.0, 2.0), Vec3::ZERO, 0.6),
    ];
    let mut wrong = Vec::new();
    for light in lights {
        // A third of a millimetre, as small as the least near plane allows, and a thousand kilometres.
        let mut at = [1.0, 1e-5, 3e4].map(|size| start(yard_of(size, light), [96, 72]));
        for info in techniques::ALL.iter().filter(|i| in_turn(i, &lights) == Some(light)) {
            let mut share = |i: usize| {
                let (r, s) = &mut at[i];
                choose(s, info, 512, &[]);
                let e = measure::errors(r, s).unwrap();
                assert!(e.shadow_correct + e.lit_incorrect > 50, "{}: {e:?}", info.id);
                (e.lit_incorrect + e.shadow_incorrect) as f64 / e.facing as f64
            };
            // Half of them in a small scene, half in a large one.
            let (there, here) = (share(0), share(1 + info.mark / 2 % 2));
            if here > 1.3 * there + 0.004 {
                wrong.push(format!("{}: {here:.4}, {there:.4} at its own size", info.id));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn lengths_that_nobody_chose_follow_the_scene() {
    let bias = |s: &Setup| {
        let mut s = s.clone();
        s.select("shadow-map").unwrap();
        s.params["shadow-map"]["bias"].clone()
    };
    let of = |size: f32| Setup::new("test", &yard_of(size, sun(Vec3::Y))).unwrap();
    assert_eq!(bias(&of(1.0)), Value::Float(0.002));
    assert_eq!(bias(&of(1e-3)), Value::Float(3.4e-5));
    // A chosen one stays where the scene changes; the others follow.
    let mut s = of(1.0);
    s.select("pssm").unwrap();
    s.set("pssm.bias=0.5", &[]).unwrap();
    s.take_unit(of(1e-3).unit);
    assert_eq!((bias(&s), s.params["pssm"]["bias"].clone()), (Value::Float(3.4e-5), Value::Float(0.5)));
    s.take_unit(1.0);
    assert_eq!(bias(&s), Value::Float(0.002));
}

/// A light in a closed box 1.5 m over a floor of ±6 m.
fn boxed(lights: &[Light]) -> (Renderer, Setup) {
    let mut triangles = floor(Vec2::splat(-6.0), Vec2::splat(6.0), 0.0);
    triangles.extend(cuboid(BOXED - 0.4, BOXED + 0.4));
    let view = camera(Vec3::new(2.0, 3.0, 3.5), Vec3::ZERO);
    start(scene(vec![mesh(&triangles, 0)], vec![material(Vec3::ONE)], view, lights[0]), [64, 48])
}

/// The box's middle.
const BOXED: Vec3 = Vec3::new(0.3, 1.5, 0.2);

/// A light in a closed box lights nothing outside, whatever draws the box's shadow.
#[test]
fn a_light_in_a_box_lights_nothing_outside() {
    let lights = [lamp(BOXED), spot(BOXED, Vec3::new(0.2, 0.0, 0.1), 50.0), plate(BOXED, Vec3::ZERO, 0.1)];
    let (mut r, mut s) = boxed(&lights);
    let mut wrong = Vec::new();
    for info in techniques::ALL.iter() {
        let Some(light) = in_turn(info, &lights) else { continue };
        s.light = light;
        choose(&mut s, info, 512, &[]);
        let e = measure::errors(&mut r, &s).unwrap();
        if e.lit_correct > 0
            || e.facing < 100
            || e.shadow_incorrect > 0
            || e.lit_incorrect as f64 > 0.02 * e.facing as f64
        {
            wrong.push(format!("{} under a {}: {e:?}", info.id, light.kind()));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// One map sees no half space: what a rectangle lights farther aside is lit through the box, and a note counts it, whatever the map
/// is fitted to. Where the camera sees nothing of it there is no note.
#[test]
fn what_lies_too_far_aside_for_a_map_is_counted() {
    let light = plate(BOXED, Vec3::ZERO, 0.1);
    let Light::RectArea { half_u, half_v, .. } = light else { unreachable!() };
    let (mut r, near) = boxed(&[light]);
    let far = Setup { camera: camera(Vec3::new(6.0, 5.0, 9.0), Vec3::new(0.0, 0.5, 0.0)), ..near.clone() };
    let lit = "is missed";
    let cases = [
        ("shadow-map", "fit=receivers", lit),
        ("shadow-map", "fit=scene", lit),
        ("pcf", "fit=msf", lit),
        ("backprojection", "mode=area", lit),
        ("area-uniform", "side=3", "all of the light"),
        ("hybrid-area", "rays=false", "all of the light"),
        ("hybrid-area", "rays=true", "rays decide"),
    ];
    for (id, set, told) in cases {
        for (s, aside) in [(&near, false), (&far, true)] {
            let mut s = s.clone();
            choose(&mut s, techniques::find(id).unwrap(), 256, &[set.into()]);
            let record = measure::accuracy(&mut r, &s, 0).unwrap();
            let case = format!("{id} {set}: {} wrong of {}; {}", record.lit_incorrect, record.facing, record.notes);
            let spare = record.facing as f64 / 50.0;
            if !aside {
                assert_eq!((record.notes.as_str(), record.lit_incorrect as f64 <= spare), ("", true), "{case}");
                continue;
            }
            let (mask, at) = (r.read_mask().unwrap(), r.read_position().unwrap());
            let seen = mask.iter().zip(&at).filter(|(m, _)| **m == FACING);
            let beyond = seen.filter(|(_, p)| {
                let q = Vec3::new(p[0], p[1], p[2]) - BOXED;
                let across = [half_u, half_v].map(|side| side.normalize().dot(q).abs());
                across[0].max(across[1]) > light.axis().dot(q) * 80f32.to_radians().tan()
            });
            let beyond = beyond.count() as f64;
            let counted: f64 = record.notes.split(' ').next().and_then(|n| n.parse().ok()).expect(&case);
            assert!(
                beyond > 0.2 * record.facing as f64 && (counted - beyond).abs() < 0.05 * beyond,
                "{case}, {beyond}"
            );
            assert!(record.notes.contains(told), "{case}");
            let excused = if told == "rays decide" { 0.0 } else { counted };
            assert!(record.lit_incorrect as f64 <= excused + spare, "{case}");
        }
    }
}
