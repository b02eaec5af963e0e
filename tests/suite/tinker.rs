//! Shaders that are changed, and techniques that come from outside.

use crate::common::{ok, shadowscope};
use shadowscope::gpu::{Fault, Shaders, shader_files};
use std::path::Path;
use std::process::Command;

fn pixels(folder: &Path, name: &str) -> image::RgbaImage {
    image::open(folder.join(name)).unwrap().to_rgba8()
}

/// What `--shaders` names takes the place of our own files, and only of those that it has.
#[test]
fn shaders_of_a_folder_take_the_place_of_ours() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    ok(folder, &["shaders", "-o", "mine"]);
    let file = folder.join("mine/map/filter/nearest.wgsl");
    let ours = std::fs::read_to_string(&file).unwrap();
    assert!(shader_files().iter().all(|f| folder.join("mine").join(f).is_file()));

    let changed = ours.replace("return compare(r, r.texel);", "return 1.0 - compare(r, r.texel);");
    assert_ne!(changed, ours);
    std::fs::write(&file, &changed).unwrap();
    let out = ok(folder, &["shaders", "-o", "mine"]);
    assert!(String::from_utf8_lossy(&out.stderr).contains("nearest.wgsl stays as it is"));
    assert_eq!(std::fs::read_to_string(&file).unwrap(), changed, "somebody's work is gone");

    std::fs::create_dir_all(folder.join("one/map/filter")).unwrap();
    std::fs::copy(&file, folder.join("one/map/filter/nearest.wgsl")).unwrap();
    let capture = ["capture", "cubes", "--size", "64x40", "--view", "visibility"];
    for (name, shaders) in [("ours.png", None), ("all.png", Some("mine")), ("one.png", Some("one"))] {
        let shaders = shaders.map_or(vec![], |s| vec!["--shaders", s]);
        ok(folder, &[&capture[..], &shaders, &["-o", name]].concat());
    }
    assert_eq!(pixels(folder, "all.png"), pixels(folder, "one.png"));
    // Where the light is seen of the one, it is not of the other.
    let (a, b) = (pixels(folder, "ours.png"), pixels(folder, "one.png"));
    let turned = a.pixels().zip(b.pixels()).filter(|(a, b)| a[0].abs_diff(b[0]) == 255).count();
    assert!(turned > 64 * 40 / 3, "{turned} pixels are turned round");

    std::fs::write(&file, ours.replace("return compare(r, r.texel);", "return compare(r, r.texl);")).unwrap();
    for (shaders, says) in [
        ("mine", "map/filter/nearest.wgsl:5: return compare(r, r.texl);: invalid field accessor `texl`"),
        ("none", "--shaders none: there is no such folder; `shadowscope shaders -o none` makes one"),
        (".", "--shaders .: no shader in it has the name of one of ours"),
    ] {
        let out = shadowscope(folder, &[&capture[..], &["--shaders", shaders, "-o", "x.png"]].concat());
        let error = String::from_utf8_lossy(&out.stderr).into_owned();
        assert!(!out.status.success() && error.contains(says), "{error}");
    }
}

/// What is wrong with a shader is shown with the lines around it, as their author wrote them.
#[test]
fn a_fault_has_its_lines_around_it() {
    let folder = tempfile::tempdir().unwrap();
    let text = "var<uniform> given: vec4f;\n\nfn f() -> f32 {\n    return given;\n}\n\n\n\n// far away\n";
    std::fs::write(folder.path().join("a.wgsl"), text).unwrap();
    let error = Shaders::from_folder(folder.path()).load("a.wgsl", &[]).err().expect("an error");
    let fault = error.downcast_ref::<Fault>().expect("a fault");
    assert_eq!(fault.file, "a.wgsl");
    let lines: Vec<&str> = text.lines().collect();
    let around: Vec<_> = fault.lines.iter().map(|(n, l)| (*n, l.as_str())).collect();
    let (first, last) = (fault.line.saturating_sub(3).max(1), (fault.line + 3).min(lines.len()));
    assert_eq!(around, (first..=last).map(|n| (n, lines[n - 1])).collect::<Vec<_>>());
}

/// A floor of 8 m × 8 m, and above it a square of 2 m × 2 m and a step that the floor's shadow cannot know.
const WORLD: &str = "\
v -4 0 -4\nv 4 0 -4\nv 4 0 4\nv -4 0 4\nf 4 3 2 1
v -1 1.5 -1\nv 1 1.5 -1\nv 1 1.5 1\nv -1 1.5 1\nf 8 7 6 5
v 1.6 0.5 -1.5\nv 3.2 0.5 -1.5\nv 3.2 0.5 1.5\nv 1.6 0.5 1.5\nf 12 11 10 9
";

/// The worked example of docs/adding-a-technique.md: in the lists with all that comes with a technique, exact on its plane and blind
/// elsewhere, as Blinn 1988 has it.
#[test]
fn a_technique_from_outside_is_one_like_ours() {
    let program = Path::new(env!("CARGO_BIN_EXE_shadowscope")).with_file_name("examples").join("planar_shadow");
    assert!(program.is_file(), "{} is not there; `cargo build --release --examples` makes it", program.display());
    let dir = tempfile::tempdir().unwrap();
    let run = |args: &[&str]| {
        let mut command = Command::new(&program);
        let out = command.args(args).current_dir(dir.path()).env("SHADOWSCOPE_TIMING", "0").output().unwrap();
        assert!(out.status.success(), "{args:?}: {}", String::from_utf8_lossy(&out.stderr));
        String::from_utf8(out.stdout).unwrap()
    };
    assert!(run(&["list", "techniques"]).contains("planar-shadow"));

    std::fs::write(dir.path().join("w.obj"), WORLD).unwrap();
    // From below the square's height the lamp's shadow of it would fall upwards.
    let lights = [
        "directional:to_light=-1,1,0.2",
        "spot:position=-2,4,0;direction=2,-4,0;outer_angle=40;range=20;color=20,20,20",
        "omni:position=0.5,1.2,0;range=20;color=9,9,9",
    ];
    for light in lights {
        let place = ["w.obj", "--camera", "0,6,7:0,0,0:45", "--light", light, "--size", "160x120"];
        let measured = |more: &[&str]| -> serde_json::Value {
            let of = ["--techniques", "planar-shadow", "--json", "-"];
            let text = run(&[&["measure"], &place[..], &of, more].concat());
            serde_json::from_str::<serde_json::Value>(&text).unwrap()[0].clone()
        };
        let row = measured(&[]);
        let count = |row: &serde_json::Value, name: &str| row[name].as_u64().unwrap();
        assert!(count(&row, "shadow_correct") > 200, "{light}: {row}");
        assert_eq!(count(&row, "shadow_incorrect"), 0, "{light}");
        // On the step there is none, though the sun's and the spot's fall on it.
        let lost = count(&row, "lit_incorrect");
        assert_eq!(lost > 20, !light.starts_with("omni"), "{light}: {lost}");
        run(&[&["capture"], &place[..], &["--technique", "planar-shadow", "--view", "error", "-o", "e.png"]].concat());
        run(&[&["capture"], &place[..], &["--technique", "planar-shadow", "--view", "receivers", "-o", "r.png"]]
            .concat());
        let (error, on_plane) = (pixels(dir.path(), "e.png"), pixels(dir.path(), "r.png"));
        let wrong = |p: &image::Rgba<u8>| p[2] > 200 && p[0] < 80;
        let wrong: Vec<_> = error.enumerate_pixels().filter(|(_, _, p)| wrong(p)).collect();
        assert_eq!(wrong.len() as u64, lost, "{light}");
        // Green is the label of what lies on the plane.
        let on_plane = |x: u32, y: u32| on_plane.get_pixel(x, y)[1] > 40 + on_plane.get_pixel(x, y)[0];
        assert!(on_plane(80, 100));
        assert!(wrong.iter().all(|(x, y, _)| !on_plane(*x, *y)), "{light}: wrong on the plane");
        // Over a plane that is not there, nothing is in shadow.
        let none = measured(&["--set", "height=-3"]);
        assert_eq!(count(&none, "shadow_correct") + count(&none, "shadow_incorrect"), 0, "{light}");
    }
}
