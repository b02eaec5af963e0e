//! Captures: several pixels drawn for one, alpha where no surface is, and parts of the picture.

use crate::common::{built_in, camera, material, mesh, ok, scene, shadowscope, start, sun};
use glam::Vec3;
use shadowscope::capture;
use shadowscope::frame::{History, Pixels, Renderer};
use shadowscope::setup::{Overlay, Setup, Side, parse_crop};
use std::path::Path;

/// The picture of a capture.
fn picture(r: &mut Renderer, s: &Setup) -> Pixels {
    s.check().unwrap();
    capture::picture(r, s, History::Whole).unwrap().0
}

fn at(p: &Pixels, x: u32, y: u32) -> [u8; 4] {
    let i = 4 * (y * p.size[0] + x) as usize;
    p.rgba[i..i + 4].try_into().unwrap()
}

/// The light that a number of sRGB stands for, and back: IEC 61966-2-1.
fn light(byte: u8) -> f64 {
    let c = f64::from(byte) / 255.0;
    if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
}
fn number(light: f64) -> f64 {
    255.0 * if light <= 0.0031308 { 12.92 * light } else { 1.055 * light.powf(1.0 / 2.4) - 0.055 }
}

/// Each pixel is the mean light of those of the picture that is as many times as large.
#[test]
fn a_supersampled_picture_is_the_box_mean_of_the_larger_one() {
    let (mut r, s) = built_in("cubes", [61, 37]);
    let truth = Side::new("truth").unwrap();
    let overlay = Some(Overlay { view: "facing".into(), opacity: 0.5, inset: false });
    for s in [
        s.clone(),
        Setup { view: "albedo".into(), ..s.clone() },
        Setup { overlay, ..s.clone() },
        // The line between the sides falls on a pixel of the file.
        Setup { against: vec![truth], split: 0.33, ..s.clone() },
    ] {
        for n in 1..=4 {
            let small = picture(&mut r, &Setup { supersample: n, ..s.clone() });
            assert_eq!(small.size, s.size);
            let split = (s.split * s.size[0] as f32).round() / s.size[0] as f32;
            let large = picture(&mut r, &Setup { size: s.size.map(|side| side * n), split, ..s.clone() });
            for (x, y) in (0..s.size[0]).flat_map(|x| (0..s.size[1]).map(move |y| (x, y))) {
                let all = (0..n * n).map(|i| at(&large, x * n + i % n, y * n + i / n));
                let mean = |c: usize| number(all.clone().map(|p| light(p[c])).sum::<f64>() / f64::from(n * n));
                let found = at(&small, x, y);
                for (c, found) in found.iter().enumerate().take(3) {
                    assert!((f64::from(*found) - mean(c)).abs() < 0.501, "{n} × {n} at {x}, {y}: {found}, {}", mean(c));
                }
                assert_eq!(found[3], 255);
            }
        }
    }
}

/// What would mean nothing when mixed stays as it is, and that is said.
#[test]
fn values_classes_and_charts_are_not_averaged() {
    let (mut r, s) = built_in("cubes", [64, 48]);
    let inset = |view: &str| Some(Overlay { view: view.into(), opacity: 1.0, inset: true });
    let mut others = ["visibility", "error", "causes", "triangles", "aliasing", "counts"]
        .map(|view| Setup { view: view.into(), ..s.clone() })
        .to_vec();
    others.push(Setup { overlay: inset("counts"), ..s.clone() });
    for s in others {
        let plain = capture::picture(&mut r, &s, History::Whole).unwrap();
        let (asked, notes) = capture::picture(&mut r, &Setup { supersample: 3, ..s.clone() }, History::Whole).unwrap();
        assert!(asked == plain.0, "{}", s.view);
        assert!(notes.iter().any(|n| n.starts_with("Not supersampled")), "{notes:?}");
        assert!(!plain.1.iter().any(|n| n.starts_with("Not supersampled")), "{:?}", plain.1);
    }
}

/// A square of known size before nothing: what it covers of each pixel is that pixel's alpha, and its colour is not mixed with what is not
/// there.
#[test]
fn alpha_is_the_share_that_surfaces_cover() {
    // Half the picture's height is tan 25° at a distance of 1; the square's edges fall into pixels.
    let half = (25f32).to_radians().tan();
    let (wide, high) = (0.61 * half, 0.37 * half);
    let p = |x: f32, y: f32| Vec3::new(x * wide, y * high, 0.0);
    let [a, b, c, d] = [p(-1.0, -1.0), p(1.0, -1.0), p(1.0, 1.0), p(-1.0, 1.0)];
    let plane = mesh(&[[a, b, c], [a, c, d]], 0);
    let scene = scene(vec![plane], vec![material(Vec3::splat(0.5))], camera(Vec3::Z, Vec3::ZERO), sun(Vec3::Z));
    let (mut r, s) = start(scene, [40, 40]);
    let s = Setup { transparent: true, ..s };
    // How much of the interval from i to i + 1 the square covers, in n steps, whose middles count.
    let covered = |i: u32, half: f32, n: u32| {
        let middle = |k: u32| (i as f32 + (k as f32 + 0.5) / n as f32) / 20.0 - 1.0;
        (0..n).filter(|k| middle(*k).abs() < half).count() as f32 / n as f32
    };
    for n in 1..=4 {
        let s = Setup { supersample: n, ..s.clone() };
        let found = picture(&mut r, &s);
        let surface = at(&found, 20, 20);
        let mut partly = 0;
        for (x, y) in (0..40).flat_map(|x| (0..40).map(move |y| (x, y))) {
            let share = covered(x, 0.61, n) * covered(y, 0.37, n);
            let [.., alpha] = at(&found, x, y);
            assert!((f32::from(alpha) - 255.0 * share).abs() < 0.51, "{n}: {alpha} at {x}, {y}, not {}", 255.0 * share);
            if alpha == 0 {
                assert_eq!(at(&found, x, y), [0; 4]);
            } else {
                assert_eq!(at(&found, x, y)[..3], surface[..3], "{n}: at {x}, {y}");
            }
            partly += (1..255).contains(&alpha) as u32;
        }
        assert_eq!(partly > 0, n > 1);
        // Over any ground the picture is the opaque one over that ground, where the surface is.
        let opaque = picture(&mut r, &Setup { transparent: false, ..s });
        assert_eq!(at(&opaque, 20, 20), surface);
        assert!(opaque.rgba.chunks_exact(4).all(|p| p[3] == 255));
    }
}

/// In every view and with every overlay, what is nothing is transparent, and what is data or surface is as it was.
#[test]
fn only_what_shows_nothing_is_transparent() {
    let (mut r, s) = built_in("cubes", [64, 36]);
    let over = |view: &str, inset| Some(Overlay { view: view.into(), opacity: 0.5, inset });
    let mut all = ["shaded", "error", "depth", "flip", "texels", "aliasing", "visibility", "shadow-map", "counts"]
        .map(|view| Setup { view: view.into(), ..s.clone() })
        .to_vec();
    all.push(Setup { overlay: over("error", false), ..s.clone() });
    all.push(Setup { overlay: over("shadow-map", true), ..s.clone() });
    all.push(Setup { overlay: over("shadow-map", false), ..s.clone() });
    all.push(Setup { against: vec![Side::new("truth").unwrap()], ..s.clone() });
    for s in all.into_iter().filter(|s| s.check().is_ok()) {
        let plain = picture(&mut r, &s);
        let clear = picture(&mut r, &Setup { transparent: true, ..s.clone() });
        let depth: Vec<f32> = r.read_position().unwrap().iter().map(|p| p[3]).collect();
        let width = r.read_width().unwrap() as u32;
        let mut clears = 0;
        for (i, (a, b)) in plain.rgba.chunks_exact(4).zip(clear.rgba.chunks_exact(4)).enumerate() {
            match b[3] {
                255 => assert_eq!(a, b, "{}", s.view),
                _ => {
                    assert!(width != 64 || depth[i] == 0.0, "{}: a surface is transparent", s.view);
                    clears += 1;
                }
            }
        }
        let map = |view: &str| ["shadow-map", "counts"].contains(&view);
        assert_eq!(clears > 100, !map(&s.view), "{}: {clears}", s.view);
        if let Some(o) = s.overlay.filter(|o| !o.inset && map(&o.view)) {
            let half = clear.rgba.chunks_exact(4).filter(|p| p[3] == 128).count();
            assert!(half > 100, "half of {} lies over nothing: {half}", o.view);
        }
    }
}

/// A crop is a part of the whole picture, pixel for pixel; legend and supersampling follow it, and raw values are cut too.
#[test]
fn a_crop_has_the_pixels_of_the_whole() {
    let (mut r, s) = built_in("cubes", [97, 61]);
    for (view, n, legend) in [("shaded", 1, false), ("shaded", 2, true), ("error", 1, true)] {
        let whole = Setup { view: view.into(), supersample: n, ..s.clone() };
        let all = picture(&mut r, &whole);
        for part in [[0, 0, 97, 61], [13, 7, 40, 31], [96, 60, 1, 1], [0, 60, 97, 1]] {
            let mut cut = Setup { legend, ..whole.clone() };
            cut.crop_to(part);
            assert_eq!(cut.part(), part);
            let found = picture(&mut r, &cut);
            let [left, top, w, h] = part;
            assert!(found.size[0] == w && if legend { found.size[1] > h } else { found.size[1] == h });
            for (x, y) in (0..w).flat_map(|x| (0..h).map(move |y| (x, y))) {
                assert_eq!(at(&found, x, y), at(&all, left + x, top + y), "{view}, {part:?} at {x}, {y}");
            }
        }
    }
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("depth.exr");
    let mut s = Setup { view: "depth".into(), ..s };
    let read = || exr::prelude::read_first_flat_layer_from_file(&file).unwrap().layer_data;
    capture::capture(&mut r, &s, &file).unwrap();
    let values = |layer: &exr::prelude::Layer<exr::prelude::AnyChannels<exr::prelude::FlatSamples>>| -> Vec<f32> {
        layer.channel_data.list[0].sample_data.values_as_f32().collect()
    };
    let all = values(&read());
    s.crop_to([13, 7, 40, 31]);
    capture::capture(&mut r, &s, &file).unwrap();
    let (layer, cut) = (read(), values(&read()));
    assert_eq!((layer.size.0, layer.size.1), (40, 31));
    assert!((0..40 * 31).all(|i| cut[i] == all[(7 + i / 40) * 97 + 13 + i % 40]));
}

/// Shares and pixels say the same crop, and every part of every size survives the way through shares.
#[test]
fn crops_are_read_and_round_to_pixels() {
    let [shares, pixels] = ["0.25,0,0.5,1", "320px, 0px, 640px, 720px"].map(|t| parse_crop(t, [1280, 720]).unwrap());
    assert_eq!(shares, Some([0.25, 0.0, 0.5, 1.0]));
    assert_eq!(shares, pixels);
    assert_eq!(parse_crop("none", [1, 1]).unwrap(), None);
    for text in ["", "1,2,3", "a,b,c,d", "0,0,1px,-1px", "0,0,1,1,1"] {
        assert!(parse_crop(text, [10, 10]).unwrap_err().to_string().contains(&format!("--crop {text}: write it as")));
    }
    let (mut s, _) = Setup::open("cubes").unwrap();
    for side in [1, 2, 3, 7, 1080, 1279, 4095, 16383, 16384] {
        s.size = [side, side];
        for (start, length) in [(0, 1), (0, side), (side / 3, side / 2), (side - 1, 1), (side / 7, side - side / 7)] {
            let length = length.max(1);
            s.crop_to([start, start, length, length]);
            assert_eq!(s.part(), [start, start, length, length], "of {side}");
            s.check().unwrap();
            assert_eq!(s.size_around([s.part()[2], s.part()[3]]), s.size);
        }
    }
    for crop in [[0.5, 0.0, 0.6, 1.0], [0.0, 0.0, 0.0, 1.0], [-0.1, 0.0, 0.5, 0.5], [0.0, 0.0, f32::NAN, 1.0]] {
        s.crop = Some(crop);
        assert!(s.check().unwrap_err().to_string().contains("crop = ["), "{crop:?}");
    }
}

/// The set-up inside draws the same file again, twice the same bytes, with a whole figure too; defaults stand in no file.
#[test]
fn the_set_up_inside_draws_the_same_file() {
    let (mut r, s) = built_in("cubes", [80, 45]);
    let plain = s.to_toml(Path::new("x.toml")).unwrap();
    assert!(["supersample", "transparent", "crop"].iter().all(|key| !plain.contains(key)), "{plain}");
    let mut s = Setup { supersample: 2, transparent: true, legend: true, view: "shaded".into(), ..s };
    s.overlay = Some(Overlay { view: "error".into(), opacity: 0.7, inset: false });
    s.crop_to([9, 5, 60, 33]);
    let folder = tempfile::tempdir().unwrap();
    let [first, again] = ["first.png", "again.png"].map(|name| folder.path().join(name));
    for whole in [None, Some([320, 200])] {
        match whole {
            None => capture::capture(&mut r, &s, &first).unwrap(),
            Some(size) => capture::figure(&mut r, &s, size, &first).unwrap(),
        };
        let (inside, _) = Setup::from_toml(&capture::read_setup(&first).unwrap(), &first).unwrap();
        assert_eq!((inside.supersample, inside.transparent, inside.crop), (2, true, s.crop));
        capture::capture(&mut r, &inside, &again).unwrap();
        let [a, b] = [&first, &again].map(|path| image::open(path).unwrap().into_rgba8());
        assert!(a == b, "{whole:?}");
        if let Some([w, h]) = whole {
            assert_eq!(a.dimensions(), (w, h));
        }
        let bytes = std::fs::read(&again).unwrap();
        capture::capture(&mut r, &inside, &again).unwrap();
        assert!(std::fs::read(&again).unwrap() == bytes);
    }
}

/// What cannot be drawn is said in a sentence; on the command line all three are options, which a capture's own can be taken back with.
#[test]
fn the_command_line_has_them_all() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    ok(
        folder,
        &[
            "capture",
            "cubes",
            "--size",
            "64x36",
            "--supersample",
            "2",
            "--transparent",
            "--crop",
            "16px,8px,32px,20px",
            "-o",
            "a.png",
        ],
    );
    let (inside, _) = Setup::open(folder.join("a.png").to_str().unwrap()).unwrap();
    assert_eq!((inside.supersample, inside.transparent, inside.part()), (2, true, [16, 8, 32, 20]));
    assert_eq!(image::open(folder.join("a.png")).unwrap().into_rgba8().dimensions(), (32, 20));
    let plain = ["--supersample", "1", "--transparent=false", "--crop", "none", "-o", "b.png"];
    ok(folder, &[&["capture", "a.png"], &plain[..]].concat());
    ok(folder, &["capture", "cubes", "--size", "64x36", "-o", "c.png"]);
    assert_eq!(std::fs::read(folder.join("b.png")).unwrap(), std::fs::read(folder.join("c.png")).unwrap());
    for (options, says) in [
        (["--supersample", "5"], "supersample = 5 is not allowed; it takes 1 to 4"),
        (["--supersample", "0"], "supersample = 0 is not allowed"),
        (["--crop", "0.5,0,0.6,1"], "crop = [0.5, 0, 0.6, 1] is not allowed"),
        (["--crop", "left"], "--crop left: write it as X,Y,WIDTH,HEIGHT"),
    ] {
        let out = shadowscope(folder, &[&["capture", "cubes", "-o", "no.png"], &options[..]].concat());
        let told = String::from_utf8_lossy(&out.stderr);
        assert!(!out.status.success() && told.contains(says), "{told}");
    }
    let large = ["capture", "cubes", "--size", "9000x9", "--supersample", "2", "-o", "no.png"];
    let out = shadowscope(folder, &large);
    let told = String::from_utf8_lossy(&out.stderr);
    assert!(!out.status.success() && told.contains("supersample = 2 draws 18000 × 18 pixels for 9000 × 9"), "{told}");
    assert!(!folder.join("no.png").exists());
}
