//! The program from outside: captures, measurements, lists and errors.

use crate::common::{ok, shadowscope};
use crate::gltf::motion::turntable;
use serde_json::Value;
use std::path::Path;
use std::process::Command;

fn read(folder: &Path, name: &str) -> Vec<u8> {
    std::fs::read(folder.join(name)).unwrap()
}

#[test]
fn captures_repeat_and_reopen_byte_for_byte() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    let args =
        ["capture", "cubes", "--size", "160x90", "--technique", "pcf", "--set", "kernel=5", "--against", "truth"];
    ok(folder, &[&args[..], &["-o", "a.png"]].concat());
    ok(folder, &[&args[..], &["-o", "b.png"]].concat());
    assert_eq!(read(folder, "a.png"), read(folder, "b.png"), "two captures of one set-up differ");
    ok(folder, &["capture", "a.png", "-o", "c.png"]);
    assert_eq!(read(folder, "a.png"), read(folder, "c.png"), "a capture reopens as another");
    ok(folder, &["capture", "a.png", "--against", "none", "-o", "d.png"]);
    assert_ne!(read(folder, "a.png"), read(folder, "d.png"));
    // A camera left behind is kept too, and drawn.
    let flown = ["capture", "cubes", "--size", "160x90", "--technique", "pssm", "--camera", "above"];
    ok(folder, &[&flown[..], &["--shadow-camera", "near", "-o", "f.png"]].concat());
    ok(folder, &["capture", "f.png", "-o", "g.png"]);
    assert_eq!(read(folder, "f.png"), read(folder, "g.png"), "a capture with a shadow camera reopens as another");
    for others in [&[][..], &["--outlines"], &["--shadow-camera", "default"], &["--shadow-camera", "0,2,5:0,0,0:40"]] {
        ok(folder, &[&flown[..], others, &["-o", "h.png"]].concat());
        assert_ne!(read(folder, "f.png"), read(folder, "h.png"), "{others:?}");
    }
    // So is a light's size, over which the truth averages.
    let lamp = "spot:position=-2,7,3;direction=2,-7,-3;outer_angle=40;range=30;color=60,60,60";
    let large = format!("{lamp};radius=0.8");
    let soft = ["capture", "cubes", "--size", "160x90", "--view", "truth", "--truth-samples", "16", "--light"];
    ok(folder, &[&soft[..], &[&large, "-o", "s.png"]].concat());
    ok(folder, &["capture", "s.png", "-o", "t.png"]);
    assert_eq!(read(folder, "s.png"), read(folder, "t.png"), "a capture under a light with a size reopens as another");
    ok(folder, &[&soft[..], &[lamp, "-o", "p.png"]].concat());
    // What the picture shows depends on the technique's parameters.
    ok(folder, &["capture", "a.png", "--set", "resolution=64", "-o", "e.png"]);
    let pixels = |name: &str| image::open(folder.join(name)).unwrap().to_rgba8();
    let differing = pixels("a.png").pixels().zip(pixels("e.png").pixels()).filter(|(a, b)| a != b).count();
    assert!(differing > 20 && differing < 160 * 90 / 2, "{differing} pixels differ");
    let softer = pixels("s.png").pixels().zip(pixels("p.png").pixels()).filter(|(a, b)| a != b).count();
    assert!(softer > 20, "{softer} pixels differ where the light has a size");
}

/// A figure of an animated scene, camera and light reopens as it was, and at another time as if it had been drawn there.
#[test]
fn figures_follow_the_files_animation() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    std::fs::write(folder.join("t.glb"), turntable().glb()).unwrap();
    let start = ["capture", "t.glb", "--size", "64x48", "--camera", "rider", "--light", "star", "--view", "visibility"];
    for time in ["0", "0.25", "0.75"] {
        ok(folder, &[&start[..], &["--time", time, "-o", &format!("{time}.png")]].concat());
    }
    assert_ne!(read(folder, "0.png"), read(folder, "0.25.png"));
    for (from, to) in [("0.25", "0.25"), ("0", "0.75"), ("0.75", "0.25")] {
        ok(folder, &["capture", &format!("{from}.png"), "--time", to, "-o", "again.png"]);
        assert_eq!(read(folder, "again.png"), read(folder, &format!("{to}.png")), "from {from} to {to}");
    }
    // The second animation stands: named, by its number, or in the figure.
    for (name, time) in [("rest", "0.25"), ("1", "0.75")] {
        ok(folder, &["capture", "0.25.png", "--animation", name, "--time", time, "-o", "rest.png"]);
        let pixels = |name: &str| image::open(folder.join(name)).unwrap().to_rgba8();
        assert_eq!(pixels("rest.png"), pixels("0.png"), "{name}");
    }
    let out = shadowscope(folder, &["capture", "t.glb", "--animation", "2", "-o", "x.png"]);
    let error = String::from_utf8_lossy(&out.stderr).into_owned();
    assert!(!out.status.success() && error.contains("no animation 2; there are turn, rest"), "{error}");
}

#[test]
fn exr_holds_raw_values() {
    let dir = tempfile::tempdir().unwrap();
    for (view, channels) in
        [("visibility", 1), ("truth", 1), ("depth", 1), ("position", 3), ("normals", 3), ("aliasing", 3)]
    {
        let name = format!("{view}.exr");
        ok(dir.path(), &["capture", "cubes", "--size", "64x48", "--view", view, "-o", &name]);
        let image = exr::prelude::read_all_flat_layers_from_file(dir.path().join(&name)).unwrap();
        let layer = &image.layer_data[0];
        assert_eq!((layer.size.x(), layer.size.y(), layer.channel_data.list.len()), (64, 48, channels), "{view}");
        let values: Vec<f32> = layer.channel_data.list[0].sample_data.values_as_f32().collect();
        let [low, high] =
            [values.iter().copied().fold(f32::MAX, f32::min), values.iter().copied().fold(f32::MIN, f32::max)];
        assert!(high > low && low.is_finite() && high.is_finite(), "{view}: {low} to {high}");
        match view {
            "visibility" | "truth" => assert!(values.iter().all(|v| *v == 0.0 || *v == 1.0), "{view}"),
            "depth" => assert!(low == 0.0 && high > 5.0, "{view}: {low} to {high}"),
            _ => {}
        }
    }
}

/// The counts as a file: the map's size, and as many view samples as pixels face the light.
#[test]
fn exr_holds_the_counts_of_the_map() {
    let dir = tempfile::tempdir().unwrap();
    let set = ["--size", "96x54", "--set", "resolution=128"];
    ok(dir.path(), &[&["capture", "cubes", "--view", "counts", "-o", "c.exr"], &set[..]].concat());
    let image = exr::prelude::read_all_flat_layers_from_file(dir.path().join("c.exr")).unwrap();
    let layer = &image.layer_data[0];
    assert_eq!((layer.size.x(), layer.size.y()), (128, 128));
    let samples: f32 = layer.channel_data.list[0].sample_data.values_as_f32().sum();
    let out = ok(dir.path(), &[&["measure", "cubes", "--techniques", "shadow-map", "--json"], &set[..]].concat());
    let rows: Value = serde_json::from_slice(&out.stdout).unwrap();
    assert_eq!(rows[0]["facing"].as_f64(), Some(samples as f64));
}

#[test]
fn measure_tells_all_it_should() {
    let dir = tempfile::tempdir().unwrap();
    let out = ok(
        dir.path(),
        &[
            "measure",
            "cubes",
            "--size",
            "160x90",
            "--techniques",
            "shadow-map,pcf,rt-hard",
            "--set",
            "pcf.kernel=5",
            "--json",
        ],
    );
    let rows: Value = serde_json::from_slice(&out.stdout).unwrap();
    let rows = rows.as_array().unwrap();
    assert_eq!(rows.len(), 3);
    for row in rows {
        let count = |key: &str| row[key].as_u64().unwrap_or_else(|| panic!("{key} in {row}"));
        assert_eq!(
            count("facing"),
            count("lit_correct") + count("lit_incorrect") + count("shadow_correct") + count("shadow_incorrect")
        );
        assert_eq!(count("facing") + count("away") + count("outside") + count("background"), 160 * 90);
        assert!(row["adapter"].as_str().is_some_and(|a| !a.is_empty()) && row["software"].is_boolean());
        assert_eq!(count("truth_samples"), 16);
        let number = |key: &str| row[key].as_f64().unwrap_or_else(|| panic!("{key} in {row}"));
        assert!(count("frames") >= 7);
        assert!(number("gpu_ms_q1") <= number("gpu_ms") && number("gpu_ms") <= number("gpu_ms_q3"));
        assert!(number("gpu_ms") > 0.0 && number("cpu_ms") >= 0.0 && number("cost") > 0.0);
        assert!(row["passes"].as_str().unwrap().contains("G-buffer="), "{row}");
    }
    assert!(rows[1]["params"].as_str().unwrap().split(';').any(|p| p == "kernel=5"));
    assert_eq!((&rows[2]["error_share"], &rows[2]["boundary_p95_px"]), (&Value::from(0.0), &Value::Null));
    assert!(rows[0]["rmse"].as_f64().unwrap() > 0.0 && rows[0]["boundary_p95_px"].as_f64().is_some());
    // A map of 1024² texels of 32 bits, and three small buffers.
    let bytes = rows[0]["gpu_bytes"].as_u64().unwrap();
    assert!((4 << 20..(4 << 20) + 4096).contains(&bytes), "{bytes}");
    // The same counts as CSV.
    ok(dir.path(), &["measure", "cubes", "--size", "160x90", "--techniques", "shadow-map", "--csv", "t.csv"]);
    let csv = String::from_utf8(read(dir.path(), "t.csv")).unwrap();
    let lines: Vec<&str> = csv.lines().collect();
    assert_eq!(lines.len(), 2);
    assert!(lines[1].contains(&format!(",{},{},", rows[0]["facing"], rows[0]["lit_correct"])), "{csv}");
}

/// A reader that goes away, a capture of another technique's map, and a file that cannot be made.
#[test]
fn measure_and_list_bear_with_their_surroundings() {
    let dir = tempfile::tempdir().unwrap();
    let pipe = format!("{} list techniques | true", env!("CARGO_BIN_EXE_shadowscope"));
    let out = Command::new("sh").args(["-c", &pipe]).output().unwrap();
    assert!(out.stderr.is_empty(), "{}", String::from_utf8_lossy(&out.stderr));
    ok(dir.path(), &["capture", "cubes", "--size", "64x48", "--technique", "pcf", "--view", "taps", "-o", "t.png"]);
    ok(dir.path(), &["measure", "t.png", "--techniques", "shadow-map", "--csv", "new/t.csv"]);
    assert!(read(dir.path(), "new/t.csv").len() > 100);
    // Results that are there stay, if no new ones take their place.
    let before = read(dir.path(), "new/t.csv");
    let refused = ["measure", "cubes", "--light", "omni", "--techniques", "pcf", "--csv", "new/t.csv"];
    assert!(!shadowscope(dir.path(), &refused).status.success());
    assert_eq!(read(dir.path(), "new/t.csv"), before);
    let out = shadowscope(dir.path(), &["measure", "cubes", "--csv", "t.png/x.csv"]);
    assert!(!out.status.success() && !String::from_utf8_lossy(&out.stderr).contains("panicked"));
}

#[test]
fn lists_name_what_there_is() {
    let dir = tempfile::tempdir().unwrap();
    for (what, key, has) in [("scenes", "name", "bench"), ("techniques", "id", "pcf"), ("views", "id", "error")] {
        let out = ok(dir.path(), &["list", what, "--json"]);
        let list: Value = serde_json::from_slice(&out.stdout).unwrap();
        assert!(list.as_array().unwrap().iter().any(|e| e[key] == has), "{what}: {list}");
        if what != "scenes" {
            let text = ok(dir.path(), &["list", what]).stdout;
            assert!(String::from_utf8_lossy(&text).contains(has));
        }
    }
    let adapters: Value = serde_json::from_slice(&ok(dir.path(), &["list", "adapters", "--json"]).stdout).unwrap();
    assert!(!adapters.as_array().unwrap().is_empty());
}

#[test]
fn errors_are_one_sentence_and_a_non_zero_exit() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("plain.png"), {
        let mut bytes = Vec::new();
        image::RgbaImage::new(2, 2).write_to(&mut std::io::Cursor::new(&mut bytes), image::ImageFormat::Png).unwrap();
        bytes
    })
    .unwrap();
    std::fs::write(dir.path().join("no.png"), b"not a picture").unwrap();
    std::fs::write(dir.path().join("no.glb"), b"not a model").unwrap();
    for (args, says) in [
        (vec!["capture", "atlantis", "-o", "x.png"], "atlantis"),
        (vec!["capture", "plain.png", "-o", "x.png"], "no set-up"),
        (vec!["capture", "no.png", "-o", "x.png"], "no.png"),
        (vec!["capture", "no.glb", "-o", "x.png"], "no.glb"),
        (vec!["capture", "missing.toml", "-o", "x.png"], "missing.toml"),
        (vec!["capture", "cubes", "-o", "x.jpg"], ".png or .exr"),
        (vec!["capture", "cubes", "-o", "no.png/x.png"], "no.png"),
        (vec!["capture", "cubes", "--view", "error", "--size", "32x32", "-o", "x.exr"], "raw values"),
        (vec!["capture", "cubes", "--size", "32", "-o", "x.png"], "WIDTHxHEIGHT"),
        (vec!["capture", "cubes", "--light", "omni", "--technique", "pcf", "-o", "x.png"], "not omni"),
        (vec!["capture", "cubes", "--light", "area", "--technique", "pssm", "-o", "x.png"], "not rect-area"),
        (vec!["capture", "cubes", "--set", "resolution=1", "-o", "x.png"], "64 to 8192"),
        (vec!["measure", "cubes", "--techniques", "esmm"], "esmm"),
        (vec!["--adapter", "abacus", "capture", "cubes", "-o", "x.png"], "abacus"),
        (vec!["cubes"], "no display"),
    ] {
        let out = shadowscope(dir.path(), &args);
        let error = String::from_utf8_lossy(&out.stderr);
        assert!(!out.status.success(), "{args:?} succeeded");
        let last = error.lines().last().unwrap_or_default();
        assert!(last.starts_with("shadowscope: ") && last.contains(says), "{args:?}: {error}");
        assert!(!error.contains("panicked"), "{args:?}: {error}");
    }
    assert!(!dir.path().join("x.png").exists());
}

/// A technique that fails, and one that does not serve the light, cost no other row; they are told last, and by the exit code.
#[test]
fn what_cannot_be_measured_ends_nothing() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    let small = ["--size", "64x48", "--truth-samples", "1"];
    let huge = ["--set", "imperfect-sm.vpls=1024", "--set", "imperfect-sm.tile=256"];
    let fails = crate::common::gpu().most_bound() < 256 << 20;
    let ids = |name: &str| -> Vec<String> {
        let rows = shadowscope::measure::read(&folder.join(name)).unwrap();
        rows.into_iter().map(|r| r.technique).collect()
    };
    let lines = |out: &std::process::Output| -> Vec<String> {
        String::from_utf8_lossy(&out.stderr).lines().map(String::from).collect()
    };
    let three = ["--techniques", "shadow-map,cube,rt-hard"];
    let out = shadowscope(folder, &[&["measure", "cubes", "--csv", "a.csv"], &small[..], &three].concat());
    assert_eq!((out.status.code(), ids("a.csv")), (Some(1), vec!["shadow-map".into(), "rt-hard".into()]));
    assert!(lines(&out).last().unwrap().starts_with("shadowscope: Cube shadow map: for omni"), "{out:?}");
    let out = shadowscope(folder, &[&["sweep", "cubes", "-o", "b.csv"], &small[..], &three].concat());
    assert_eq!((out.status.code(), ids("b.csv")), (Some(1), ids("a.csv")));
    assert!(lines(&out).last().unwrap().starts_with("shadowscope: Cube shadow map: for omni"), "{out:?}");
    let advised = ["advise", "cubes", "--by", "error", "--max-error", "100%", "--set", "resolution=64"];
    let out = shadowscope(folder, &[&advised[..], &small, &three].concat());
    assert_eq!(out.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&out.stdout).contains("take:      "), "{out:?}");
    if !fails {
        return;
    }
    let three = ["--techniques", "shadow-map,imperfect-sm,rt-hard"];
    let out = shadowscope(folder, &[&["measure", "cubes", "--csv", "c.csv"], &small[..], &three, &huge].concat());
    assert_eq!((out.status.code(), ids("c.csv")), (Some(1), ids("a.csv")));
    let last = lines(&out).pop().unwrap();
    assert!(last.starts_with("shadowscope: imperfect-sm") && last.contains("1024 maps of 256² texels"), "{last}");
    // With another that is refused: each a line.
    let four = ["--techniques", "shadow-map,cube,imperfect-sm,rt-hard"];
    let out = shadowscope(folder, &[&["measure", "cubes", "--csv", "d.csv"], &small[..], &four, &huge].concat());
    let said = lines(&out);
    assert!(
        said.iter().any(|l| l.starts_with("Cube shadow map")) && said.iter().any(|l| l.starts_with("imperfect-sm"))
    );
    assert_eq!(said.last().unwrap(), "shadowscope: 2 of 4 configurations could not be measured");
    // In a sweep only what fails is missing, and is tried again.
    let sweep =
        ["sweep", "cubes", "-o", "e.csv", "--set", "imperfect-sm.vpls=64,1024", "--set", "imperfect-sm.tile=256"];
    for _ in 0..2 {
        let out = shadowscope(folder, &[&sweep[..], &small, &["--techniques", "imperfect-sm,rt-hard"]].concat());
        assert_eq!((out.status.code(), ids("e.csv")), (Some(1), vec!["imperfect-sm".into(), "rt-hard".into()]));
        assert!(lines(&out).last().unwrap().contains("1024 maps of 256² texels"), "{out:?}");
        assert!(!folder.join("e.csv.partial").exists());
    }
    let out = shadowscope(folder, &[&advised[..], &small, &three, &huge].concat());
    assert_eq!(out.status.code(), Some(1));
    let told = String::from_utf8_lossy(&out.stdout);
    assert!(told.contains("take:      ") && told.contains("rt-hard"), "{out:?}");
    assert!(lines(&out).last().unwrap().contains("1024 maps of 256² texels"), "{out:?}");
    // Of all, what does not serve the light is left out, and nothing fails.
    let set = ["--set", "resolution=64", "--light", "omni"];
    let out = shadowscope(
        folder,
        &[&["measure", "cubes", "--json", "f.json"], &small[..], &["--techniques", "cube"], &set].concat(),
    );
    assert!(out.status.success(), "{out:?}");
}
