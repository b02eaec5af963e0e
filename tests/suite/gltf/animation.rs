//! Key frames.

use super::file::{File, I16};
use glam::Vec4;
use serde_json::{Value, json};
use shadowscope::scene::{Interpolation, Property};

/// The triangle with one animation of one channel; `output` makes the output accessor.
fn animated(path: &str, interpolation: &str, times: &[f32], output: impl Fn(&mut File) -> usize) -> File {
    let mut file = File::triangle();
    // The animated node is not the first of the scene.
    file.json["nodes"] = json!([{ "mesh": 0 }, { "children": [0] }]);
    let input = file.floats("SCALAR", times);
    let output = output(&mut file);
    file.push(
        "animations",
        json!({
            "name": "swing",
            "samplers": [{ "input": input, "output": output, "interpolation": interpolation }],
            "channels": [{ "sampler": 0, "target": { "node": 0, "path": path } }],
        }),
    );
    file
}

#[test]
fn linear_translations_and_step_scales() {
    for (path, property) in [("translation", Property::Translation), ("scale", Property::Scale)] {
        for (name, interpolation) in [("LINEAR", Interpolation::Linear), ("STEP", Interpolation::Step)] {
            let file = animated(path, name, &[0.0, 1.5], |file| file.floats("VEC3", &[1., 2., 3., 4., 5., 6.]));
            let scene = file.load();
            assert_eq!(scene.animations[0].name, "swing");
            let channel = &scene.animations[0].channels[0];
            // The parent comes first in the scene.
            assert_eq!(channel.node, 1);
            assert_eq!((channel.property, channel.interpolation), (property, interpolation));
            assert_eq!(channel.times, [0.0, 1.5]);
            assert_eq!(channel.values, [Vec4::new(1., 2., 3., 0.), Vec4::new(4., 5., 6., 0.)]);
        }
    }
}

#[test]
fn rotations_from_normalised_shorts_are_unit() {
    let file = animated("rotation", "LINEAR", &[0.0, 1.0], |file| {
        let bytes: Vec<u8> =
            [0, 0, 0, 32767, 16384, 0, 0, 16384i16].iter().flat_map(|value| value.to_le_bytes()).collect();
        let accessor = file.accessor(&bytes, I16, "VEC4", 2);
        file.json["accessors"][accessor]["normalized"] = true.into();
        accessor
    });
    let scene = file.load();
    let values = &scene.animations[0].channels[0].values;
    assert_eq!(values[0], Vec4::W);
    assert!(values[1].abs_diff_eq(Vec4::new(0.5f32.sqrt(), 0.0, 0.0, 0.5f32.sqrt()), 1e-6));
}

#[test]
fn cubic_splines_keep_their_tangents() {
    let numbers: Vec<f32> = (0..18).map(|number| number as f32).collect();
    let file = animated("translation", "CUBICSPLINE", &[0.0, 1.0], |file| file.floats("VEC3", &numbers));
    let channel = &file.load().animations[0].channels[0];
    assert_eq!(channel.interpolation, Interpolation::CubicSpline);
    assert_eq!(channel.values.len(), 6);
    assert_eq!(channel.values[1], Vec4::new(3.0, 4.0, 5.0, 0.0));
}

#[test]
fn keys_at_the_same_time_are_one() {
    let file = animated("translation", "LINEAR", &[0.0, 1.0, 1.0], |file| file.floats("VEC3", &[1.0; 9]));
    let channel = &file.load().animations[0].channels[0];
    assert_eq!(channel.times, [0.0, 1.0]);
    assert_eq!(channel.values.len(), 2);
}

#[test]
fn what_cannot_move_is_left_out_and_noted() {
    let base = || animated("translation", "LINEAR", &[0.0], |file| file.floats("VEC3", &[0.0; 3]));
    let notes = |change: fn(&mut Value)| {
        let mut file = base();
        change(&mut file.json);
        let scene = file.load();
        assert!(scene.animations.is_empty());
        scene.notes
    };
    assert_eq!(
        notes(|json| json["animations"][0]["channels"][0]["target"]["path"] = "weights".into()),
        ["1 animation channel of weights is left out, as its node has no morph targets."]
    );
    assert!(
        notes(|json| json["animations"][0]["channels"][0]["target"]["path"] = "pointer".into())[0].contains("channel")
    );
    assert!(
        notes(|json| json["nodes"][0]["matrix"] = json!([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]))[0]
            .contains("channel")
    );
    // No target node, or one outside the scene.
    assert!(notes(|json| json["animations"][0]["channels"][0]["target"] = json!({ "path": "pointer" })).is_empty());
    let mut file = base();
    file.push("nodes", json!({}));
    file.push("scenes", json!({ "nodes": [1] }));
    file.json["animations"][0]["channels"][0]["target"]["node"] = 2.into();
    assert!(file.load().animations.is_empty());
}

#[test]
fn malformed_animations_are_refused() {
    let translation = |times: &[f32], values: &[f32]| {
        animated("translation", "LINEAR", times, |file| file.floats("VEC3", values)).error()
    };
    for (message, reason) in [
        (translation(&[0.0, 1.0], &[0.0; 3]), "1 values for 2 times"),
        (translation(&[1.0, 0.0], &[0.0; 6]), "do not ascend"),
        (translation(&[0.0, f32::NAN], &[0.0; 6]), "do not ascend"),
        (translation(&[0.0], &[0.0, f32::INFINITY, 0.0]), "not finite"),
        (animated("rotation", "LINEAR", &[0.0], |file| file.floats("VEC3", &[0.0; 3])).error(), "3 components"),
        (animated("scale", "BEZIER", &[0.0], |file| file.floats("VEC3", &[0.0; 3])).error(), "interpolation"),
        (animated("scale", "CUBICSPLINE", &[0.0], |file| file.floats("VEC3", &[0.0; 3])).error(), "1 values"),
    ] {
        assert!(message.contains("animation 0 \"swing\"") && message.contains(reason), "{message}");
    }
    let mut file = animated("scale", "STEP", &[0.0], |file| file.floats("VEC3", &[0.0; 3]));
    file.json["animations"][0]["channels"][0]["target"]["node"] = 50.into();
    assert!(file.error().contains("node 50"));
    file.json["animations"][0]["channels"][0]["target"]["node"] = 0.into();
    file.json["animations"][0]["channels"][0]["sampler"] = 3.into();
    assert!(file.error().contains("sampler 3"));
}
