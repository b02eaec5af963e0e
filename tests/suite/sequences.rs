//! Sequences: turntables and paths as numbered frames, APNG and WebP.

use crate::common::{built_in, ok, shadowscope};
use glam::Vec3;
use image::AnimationDecoder;
use image::codecs::png::PngDecoder;
use image::codecs::webp::WebPDecoder;
use shadowscope::capture;
use shadowscope::frame::{History, Pixels, Renderer};
use shadowscope::measure::STOPPED;
use shadowscope::path::{Key, OwnPath};
use shadowscope::scene::Camera;
use shadowscope::sequence::{self, Along, Sequence};
use shadowscope::setup::Setup;
use std::fs::File;
use std::io::BufReader;
use std::path::Path;
use std::sync::Arc;

const TURN: Along = Along::Turntable { start: 0.0 };

fn turntable(setup: &Setup, frames: u32) -> Sequence {
    Sequence::new(TURN, setup, Some(frames), None).unwrap()
}

fn write(r: &mut Renderer, s: &Setup, sequence: &Sequence, path: &Path) {
    sequence::write(r, s, sequence, path, &mut |_| true).unwrap();
}

/// All frames of an animation, and the seconds that they stay.
fn decoded(path: &Path) -> (Vec<image::RgbaImage>, f64) {
    let file = || BufReader::new(File::open(path).unwrap());
    let frames = match path.extension().unwrap().to_str() {
        Some("webp") => WebPDecoder::new(file()).unwrap().into_frames().collect_frames().unwrap(),
        _ => PngDecoder::new(file()).unwrap().apng().unwrap().into_frames().collect_frames().unwrap(),
    };
    let seconds =
        frames.iter().map(|f| f.delay().numer_denom_ms()).map(|(n, d)| f64::from(n) / f64::from(d) / 1e3).sum();
    (frames.into_iter().map(image::Frame::into_buffer).collect(), seconds)
}

/// The frames of a sequence, drawn one by one.
fn drawn(r: &mut Renderer, s: &Setup, sequence: &Sequence) -> Vec<Pixels> {
    let scene = r.scene().clone();
    let frame = |frame| {
        let at = sequence.place(s, &scene, frame).unwrap();
        let history = if frame == 0 { History::Whole } else { History::Goes };
        capture::picture(r, &at, history).unwrap().0
    };
    (0..sequence.frames).map(frame).collect()
}

/// The camera keeps its distance, its height and its roll, and the frame behind the last is the first, bit for bit.
#[test]
fn a_turntable_turns_once_around_the_target() {
    let (r, s) = built_in("cubes", [64, 36]);
    let c = s.camera;
    let above = Camera { position: c.target + 9.0 * Vec3::Y, ..c };
    let cameras = [
        c,
        Camera { up: Vec3::new(0.3, 1.0, -0.2), ..c },
        Camera { height: Some(6.0), ..c },
        Camera { height: Some(6.0), up: Vec3::new(0.3, 1.0, -0.2), ..c },
        above,
        Camera { height: Some(6.0), ..above },
    ];
    for camera in cameras {
        let s = Setup { camera, ..s.clone() };
        for start in [0.0, -30.0] {
            let sequence = Sequence { along: Along::Turntable { start }, ..turntable(&s, 12) };
            let at = |frame| sequence.place(&s, r.scene(), frame).unwrap().camera;
            let first = at(0);
            assert_eq!(at(12), first);
            if start == 0.0 {
                assert_eq!(first, camera, "it starts where the camera stands");
            }
            // In the turned camera's axes the world has turned the other way.
            for frame in 0..12 {
                let now = at(frame);
                let turn = glam::Quat::from_rotation_y((30.0 * frame as f32).to_radians());
                assert_eq!((now.target, now.fov, now.height), (camera.target, camera.fov, camera.height));
                let ((right, up), (right0, up0)) = (now.axes(), first.axes());
                for (a, b) in [(now.position - now.target, first.position - first.target), (right, right0), (up, up0)] {
                    assert!(a.distance(turn * b) < 1e-4, "{frame}: {a} is not {}", turn * b);
                }
            }
        }
    }
}

/// An animation decodes to the frames as they are drawn, plays as long as it says, and is the same file twice.
#[test]
fn animations_hold_the_frames_exactly() {
    let (mut r, s) = built_in("cubes", [50, 31]);
    let folder = tempfile::tempdir().unwrap();
    let opaque = s.clone();
    let clear = Setup { transparent: true, supersample: 2, legend: true, view: "shaded".into(), ..s };
    for (s, fps) in [(opaque, 30.0), (clear, 12.5)] {
        let sequence = Sequence { fps, ..turntable(&s, 5) };
        let frames = drawn(&mut r, &s, &sequence);
        for name in ["a.png", "a.apng", "a.webp"] {
            let path = folder.path().join(name);
            write(&mut r, &s, &sequence, &path);
            let (found, seconds) = decoded(&path);
            assert_eq!(found.len(), 5, "{name}");
            for (a, b) in frames.iter().zip(&found) {
                assert_eq!([b.width(), b.height()], a.size);
                // What is transparent has no colour.
                assert!(a.rgba == **b, "{name}");
            }
            assert!((seconds - 5.0 / f64::from(fps)).abs() < 0.001, "{name}: {seconds} s");
            let bytes = std::fs::read(&path).unwrap();
            write(&mut r, &s, &sequence, &path);
            assert!(bytes == std::fs::read(&path).unwrap(), "{name}: other bytes the second time");
            // It opens as a set-up, and says what it was made of.
            let (inside, _) = Setup::open(path.to_str().unwrap()).unwrap();
            assert_eq!(inside, s, "{name}");
            assert_eq!(sequence::read(&path).unwrap(), Some(sequence.clone()));
        }
        // Numbered frames are the same pictures, each with its own set-up.
        let pattern = folder.path().join("frame-.png");
        write(&mut r, &s, &sequence, &pattern);
        for (k, frame) in (0..5).zip(&frames) {
            let path = sequence::numbered(&pattern, k);
            assert_eq!(path.file_name().unwrap().to_str(), Some(format!("frame-{:04}.png", k + 1).as_str()));
            assert!(**image::open(&path).unwrap().as_rgba8().unwrap() == frame.rgba);
            let (inside, scene) = Setup::open(path.to_str().unwrap()).unwrap();
            assert_eq!(inside, sequence.place(&s, &scene, k).unwrap());
            assert_eq!(sequence::read(&path).unwrap(), None);
        }
    }
}

/// Each frame goes on from the last, as along a path: of a technique that averages over frames it is another than a capture of the frame's
/// set-up alone, and the same again each time.
#[test]
fn noise_over_frames_goes_on_from_frame_to_frame() {
    let (mut r, mut s) = built_in("cubes", [48, 27]);
    s.light = shadowscope::setup::parse_light(r.scene(), "sun:angular_radius=3", s.clock()).unwrap();
    s.select("rt-denoise").unwrap();
    let sequence = turntable(&s, 40);
    let short = Sequence { frames: 4, ..sequence.clone() };
    let place = |r: &Renderer, frame| sequence.place(&s, r.scene(), frame).unwrap();
    let own: Vec<Pixels> = (0..4)
        .map(|frame| {
            let at = place(&r, frame);
            capture::picture(&mut r, &at, History::Whole).unwrap().0
        })
        .collect();
    let first = drawn(&mut r, &s, &Sequence { frames: 4, ..sequence.clone() });
    assert!(first == drawn(&mut r, &s, &short), "the same frames twice");
    assert!(first[0] == own[0], "the first is a capture");
    let goes: Vec<Pixels> = (0..4)
        .map(|frame| {
            let at = place(&r, frame);
            capture::picture(&mut r, &at, if frame == 0 { History::Whole } else { History::Goes }).unwrap().0
        })
        .collect();
    assert!((1..4).any(|k| goes[k] != own[k]), "nothing goes on");
}

/// The own path is sampled from its first key to its last, at its own speed or in so many frames; a case's path has as many as it is run in.
#[test]
fn paths_are_followed_from_end_to_end() {
    let (r, mut s) = built_in("cubes", [48, 27]);
    let mut path = OwnPath::default();
    path.set(Key::of(&s, 1.0, [true, true]));
    let moved = Setup { camera: Camera { position: s.camera.position + 4.0 * Vec3::X, ..s.camera }, ..s.clone() };
    path.set(Key::of(&moved, 3.0, [true, false]));
    s.path = Some(Arc::new(path));
    assert_eq!(Along::path_of(&s), Some(Along::Path));
    let sequence = Sequence::new(Along::Path, &s, None, Some(10.0)).unwrap();
    assert_eq!((sequence.frames, sequence.fps), (21, 10.0));
    assert_eq!(Sequence::new(Along::Path, &s, Some(5), None).unwrap().fps, 2.0);
    let at = |frame| sequence.place(&s, r.scene(), frame).unwrap();
    assert_eq!((at(0).camera, at(20).camera), (s.camera, moved.camera));
    assert!((at(10).camera.position.x - s.camera.position.x - 2.0).abs() < 1e-4);
    let (mut case, scene) = Setup::open("st-contact").unwrap();
    case.against = vec![shadowscope::setup::Side::new("pcf").unwrap()];
    case.complete();
    let along = Along::path_of(&case).unwrap();
    let sequence = Sequence::new(along, &case, None, None).unwrap();
    assert_eq!(sequence.frames, 32);
    // The parameter that it moves moves on all sides.
    let last = sequence.place(&case, &scene, 31).unwrap();
    let bias = |values: &shadowscope::params::Values| values["bias"].clone();
    assert_eq!(bias(last.values()), bias(&last.against[0].params));
    assert_ne!(bias(last.values()), bias(case.values()));
    for (along, says) in [
        (Along::Case { case: "st-wire".into() }, "leads through its own scene"),
        (Along::Case { case: "st-none".into() }, "there is no case st-none"),
        (Along::Path, "has no path of its own"),
    ] {
        let error = Sequence::new(along, &case, None, None).unwrap_err().to_string();
        assert!(error.contains(says), "{error}");
    }
}

/// The clock of an animated scene runs from end to end, and what follows it goes along.
#[test]
fn the_clock_runs_and_cameras_follow() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("turntable.glb");
    std::fs::write(&file, crate::gltf::motion::turntable().glb()).unwrap();
    let (s, scene) = Setup::open(file.to_str().unwrap()).unwrap();
    let along = sequence::whole_clock(&s, &scene).unwrap();
    let seconds = scene.duration(0);
    assert_eq!(along, Along::Clock { from: 0.0, to: seconds });
    let sequence = Sequence::new(along, &s, None, Some(8.0)).unwrap();
    assert_eq!(sequence.frames, (8.0 * seconds).round() as u32 + 1);
    for frame in [0, 3, sequence.frames - 1] {
        let at = sequence.place(&s, &scene, frame).unwrap();
        let time = seconds * frame as f32 / (sequence.frames - 1) as f32;
        assert!((at.time - time).abs() < 1e-6, "{} at {frame}", at.time);
        let mut own = s.clone();
        own.set_clock(&scene, at.clock());
        own.count_from(scene.origin);
        assert_eq!(at, own);
        assert!(frame == 0 || at.camera != s.camera);
    }
}

/// What is stopped leaves finished frames and no half file.
#[test]
fn what_is_stopped_leaves_finished_frames() {
    let (mut r, s) = built_in("cubes", [32, 18]);
    let folder = tempfile::tempdir().unwrap();
    for name in ["a.png", "a.webp", "frame-.png"] {
        let mut frames = 0;
        let mut watch = |_| {
            frames += 1;
            frames <= 3
        };
        let path = folder.path().join(name);
        let error = sequence::write(&mut r, &s, &turntable(&s, 8), &path, &mut watch).unwrap_err();
        assert!(error.to_string().contains(STOPPED), "{error:#}");
    }
    let mut names: Vec<_> = std::fs::read_dir(folder.path()).unwrap().map(|e| e.unwrap().file_name()).collect();
    names.sort();
    assert_eq!(names, ["frame-0001.png", "frame-0002.png", "frame-0003.png"]);
}

/// From the command line: an animation opens, is captured, and is made again from itself, with other frames if asked.
#[test]
fn the_command_line_animates() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let size = ["--size", "40x24", "--technique", "pcf", "--set", "kernel=5"];
    ok(folder, &[&["animate", "cubes", "--turntable", "6", "--start", "15", "-o", "turn.webp"], &size[..]].concat());
    ok(folder, &["animate", "turn.webp", "-o", "again.webp"]);
    let bytes = |name: &str| std::fs::read(folder.join(name)).unwrap();
    assert!(bytes("turn.webp") == bytes("again.webp"));
    ok(folder, &["animate", "turn.webp", "--frames", "3", "--fps", "5", "-o", "few.png"]);
    let (frames, seconds) = decoded(&folder.join("few.png"));
    assert!(frames.len() == 3 && (seconds - 0.6).abs() < 1e-6, "{} in {seconds} s", frames.len());
    ok(folder, &["capture", "turn.webp", "-o", "still.png"]);
    ok(folder, &[&["capture", "cubes", "-o", "own.png"], &size[..]].concat());
    assert!(bytes("still.png") == bytes("own.png"));
    for (args, says) in [
        (&["cubes", "-o", "x.png"][..], "nothing moves; say what does"),
        (&["cubes", "--turntable", "-o", "x.gif"], "ends in .png, .apng or .webp"),
        (&["cubes", "--turntable", "-o", "frame-.webp"], "numbered frames are .png files"),
        (&["cubes", "--turntable", "1", "-o", "x.png"], "a sequence takes 2 to 10000"),
        (&["cubes", "--turntable", "--fps", "0", "-o", "x.png"], "frames a second are not allowed"),
        (&["cubes", "--clock", "-o", "x.png"], "has no animation whose clock could run"),
        (&["cubes", "--path", "-o", "x.png"], "has no path of its own"),
    ] {
        let out = shadowscope(folder, &[&["animate"], args].concat());
        let told = String::from_utf8_lossy(&out.stderr);
        assert!(!out.status.success() && told.contains(says), "{args:?}: {told}");
    }
    assert!(!folder.join("x.png").exists());
}

/// A file that is cut short or claims more than it has is refused in a sentence, whatever is missing.
#[test]
fn broken_animations_are_refused() {
    let (mut r, s) = built_in("cubes", [16, 9]);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.webp");
    write(&mut r, &s, &turntable(&s, 2), &path);
    let whole = std::fs::read(&path).unwrap();
    for end in (0..whole.len()).step_by(7) {
        std::fs::write(&path, &whole[..end]).unwrap();
        assert!(Setup::open(path.to_str().unwrap()).is_err(), "{end} of {} bytes", whole.len());
    }
    let at = whole.windows(4).position(|w| w == b"XMP ").unwrap() + 4;
    let mut claims = whole.clone();
    claims[at..at + 4].copy_from_slice(&u32::MAX.to_le_bytes());
    std::fs::write(&path, &claims).unwrap();
    let error = format!("{:#}", Setup::open(path.to_str().unwrap()).unwrap_err());
    assert!(error.contains("more than 64 MiB"), "{error}");
}

/// Ctrl-C ends the program between frames, with those that are finished.
#[cfg(unix)]
#[test]
fn ctrl_c_leaves_finished_frames() {
    use std::process::{Command, Stdio};
    use std::time::{Duration, Instant};
    let folder = tempfile::tempdir().unwrap();
    let frames = || std::fs::read_dir(folder.path()).unwrap().filter_map(|e| e.ok()?.file_name().into_string().ok());
    let mut child = Command::new(env!("CARGO_BIN_EXE_shadowscope"))
        .args(["animate", "cubes", "--turntable", "5000", "--size", "64x36", "-o", "frame-.png"])
        .current_dir(folder.path())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let since = Instant::now();
    while frames().filter(|name| name.starts_with("frame-")).count() < 2 {
        assert!(since.elapsed() < Duration::from_secs(120), "no frame comes");
        std::thread::sleep(Duration::from_millis(20));
    }
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    let status = child.wait().unwrap();
    assert_eq!(status.code(), Some(130));
    let left: Vec<String> = frames().collect();
    assert!(left.len() >= 2 && left.len() < 5000);
    for name in left {
        assert!(name.starts_with("frame-") && image::open(folder.path().join(&name)).is_ok(), "{name} is not whole");
    }
}
