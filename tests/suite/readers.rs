//! What reads files that others may have made, a function for each kind of file: whatever the bytes are, they are taken or
//! refused in a sentence, and what is taken can be used. `fuzz/` calls these functions with bytes of its own making,
//! `corpus.rs` with those in `tests/corpus`.

use shadowscope::chart::{self, COSTS, ERRORS};
use shadowscope::figure::{self, Spec};
use shadowscope::flatland::Flatland;
use shadowscope::flatland::table::Report;
use shadowscope::scene::geometry::Geometry;
use shadowscope::scene::{Clock, Scene, builtin, formats};
use shadowscope::setup::{self, Setup};
use shadowscope::{capture, cli, lessons, measure, message, sequence};
use std::path::Path;
use std::sync::OnceLock;

/// What has a reader read bytes.
pub type Reader = fn(&[u8]);

/// All of them, by the names of their targets and of their folders in `tests/corpus`.
pub const ALL: [(&str, Reader); 12] = [
    ("gltf", gltf),
    ("obj", obj),
    ("ply", ply),
    ("stl", stl),
    ("setup", setup),
    ("command", command),
    ("presets", presets),
    ("picture", picture),
    ("results", results),
    ("figure", figure),
    ("lesson", lesson),
    ("world", world),
];

/// What is taken of a file; None: it is refused, in one line that can be read.
fn taken<T>(result: anyhow::Result<T>) -> Option<T> {
    match result {
        Ok(taken) => Some(taken),
        Err(error) => {
            let told = message::sentence(&error);
            assert!(!told.is_empty() && told.chars().count() < 2100 && !told.contains(char::is_control), "{told:?}");
            None
        }
    }
}

/// Calls `read` with the path of a file of that name and these bytes, which lies alone in a folder.
fn file<T>(name: &str, bytes: &[u8], read: impl FnOnce(&Path) -> T) -> T {
    let folder = tempfile::tempdir().expect("a folder for the file");
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).expect("the file is written");
    read(&path)
}

/// A scene that set-ups may be of.
fn cubes() -> &'static Scene {
    static CUBES: OnceLock<Scene> = OnceLock::new();
    CUBES.get_or_init(|| builtin::build("cubes").expect("a scene of ours"))
}

/// A scene that was read is one to look at, at its clock's start and later.
fn scene(name: &str, bytes: &[u8]) {
    file(name, bytes, |path| {
        let Some(scene) = taken(formats::load(path)) else { return };
        taken(Setup::new(name, &scene)).expect("every scene has a set-up").check().expect("its set-up can be drawn");
        let clock = Clock { animation: 0, time: 0.5 };
        scene.cameras.iter().for_each(|camera| _ = camera.at(&scene, clock));
        scene.lights.iter().for_each(|light| _ = light.at(&scene, clock));
        // What it takes is no more than its size would have.
        if scene.triangles() < 10_000 {
            for time in [0.0, 0.5] {
                if let Some(geometry) = taken(Geometry::new(&scene, 0, time)) {
                    assert!(geometry.vertices.iter().all(|v| v.position.is_finite()));
                }
            }
        }
        assert!(!scene.report().is_empty());
    });
}

pub fn gltf(bytes: &[u8]) {
    scene(if bytes.starts_with(b"glTF") { "input.glb" } else { "input.gltf" }, bytes);
}

pub fn obj(bytes: &[u8]) {
    scene("input.obj", bytes);
}

pub fn ply(bytes: &[u8]) {
    scene("input.ply", bytes);
}

pub fn stl(bytes: &[u8]) {
    scene("input.stl", bytes);
}

/// A set-up that was read is the same when it is written and read again, and its path leads somewhere.
fn usable(setup: &Setup) {
    setup.check().expect("what was read is in range");
    let text = setup.to_toml(Path::new("input.toml")).expect("what was read can be written");
    let table: toml::Table = toml::from_str(&text).expect("what was written is TOML");
    let (again, _) = Setup::in_scene(table, &setup.scene, cubes()).expect("what was written can be read");
    assert_eq!(&again, setup, "{text}");
    taken(setup.command(cubes(), "a.png"));
    for share in [0.0, 0.1, 0.5, 1.0] {
        if let Some(path) = &setup.path {
            let (mut camera, mut light) = (setup.camera, setup.light);
            path.place(&mut camera, &mut light, path.time(share));
            assert!((camera.target - camera.position).try_normalize().is_some(), "{camera:?} at {share} of {text}");
            assert!(light.position().is_finite() && light.axis().is_finite(), "{light:?} at {share} of {text}");
        }
    }
}

pub fn setup(bytes: &[u8]) {
    let Ok(text) = str::from_utf8(bytes) else { return };
    let nowhere = Path::new("/nowhere/input.toml");
    match text.parse::<toml::Table>() {
        // Without building its scene each time.
        Ok(table) if table.get("scene").and_then(|name| name.as_str()).is_some_and(builtin::is_builtin) => {
            taken(Setup::scene_named(&table, Path::new("/nowhere")));
            let Some((setup, _)) = taken(Setup::in_scene(table, "cubes", cubes())) else { return };
            usable(&setup);
        }
        _ => _ = taken(Setup::from_toml(text, nowhere)),
    }
}

/// What is written behind `shadowscope capture cubes`.
pub fn command(bytes: &[u8]) {
    let Ok(text) = str::from_utf8(bytes) else { return };
    match cli::captured(&format!("shadowscope capture cubes -o a.png {text}")) {
        Ok((setup, _)) if setup.scene == "cubes" => usable(&setup),
        // What the command line's parser says has several lines.
        Err(error) if error.is::<clap::Error>() => {}
        result => _ = taken(result),
    }
}

/// Cameras and lights beside a scene.
pub fn presets(bytes: &[u8]) {
    let triangle = "solid\nfacet\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendfacet\nendsolid\n";
    file("input.presets.toml", bytes, |path| {
        let scene = path.with_file_name("input.stl");
        std::fs::write(&scene, triangle).expect("the file is written");
        let name = scene.to_string_lossy();
        if let Some(scene) = taken(setup::load_scene(&name)) {
            let mut setup = Setup::new(&name, &scene).expect("every scene has a set-up");
            for camera in &scene.cameras {
                setup.camera = camera.camera;
                setup.check().expect("its camera can be drawn");
            }
            for light in &scene.lights {
                setup.light = light.light;
                setup.check().expect("its light can be drawn");
            }
        }
    });
}

/// Captures, animations and sheets, which hold what they were made of.
pub fn picture(bytes: &[u8]) {
    let name = match bytes {
        [b'R', b'I', b'F', b'F', ..] => "input.webp",
        [b'<', ..] => "input.svg",
        _ => "input.png",
    };
    file(name, bytes, |path| {
        figure::has_sheet(path);
        if name != "input.webp" {
            taken(Spec::open(&path.to_string_lossy()));
        }
        if name != "input.svg" {
            taken(sequence::read(path));
            if let Some(text) = taken(capture::read_setup(path)) {
                setup(text.as_bytes());
            }
        }
    });
}

/// Rows of a sweep, as CSV or JSON, and their charts.
pub fn results(bytes: &[u8]) {
    let name = if bytes.starts_with(b"[") { "input.json" } else { "input.csv" };
    let Some(rows) = file(name, bytes, |path| taken(measure::read(path))) else { return };
    let rows = &rows[..rows.len().min(60)];
    rows.iter().for_each(|row| _ = taken(row.setup()));
    for (x, y) in COSTS.iter().zip(ERRORS) {
        taken(chart::svg(rows, x, y, ""));
        taken(chart::fronts_svg(rows, x, y, ""));
    }
}

pub fn figure(bytes: &[u8]) {
    let Ok(text) = str::from_utf8(bytes) else { return };
    let path = Path::new("/nowhere/input.toml");
    let Some(spec) = taken(Spec::from_toml(text, path)) else { return };
    let text = spec.to_toml(path).expect("what was read can be written");
    let again = Spec::from_toml(&text, path).expect("what was written can be read");
    // What is no number, and differs from itself, is refused with the cells.
    assert_eq!(again.to_toml(path).expect("what was read can be written"), text);
    let Some(rows) = taken(spec.changes(&spec.rows, cubes())) else { return };
    let Some(columns) = taken(spec.changes(&spec.columns, cubes())) else { return };
    for (row, column) in rows.iter().take(4).flat_map(|row| columns.iter().take(4).map(move |column| (row, column))) {
        taken(Setup::in_scene(spec.cell(row, column), "cubes", cubes()));
    }
}

pub fn lesson(bytes: &[u8]) {
    let Ok(text) = str::from_utf8(bytes) else { return };
    let Some(lesson) = taken(lessons::read("input", text, Path::new("/nowhere"))) else { return };
    for step in &lesson.steps {
        let tried = step.trial.as_ref().and_then(|trial| trial.scene.as_ref());
        for plan in [Some(&step.scene), tried].into_iter().flatten() {
            if let Some(setup) = taken(plan.in_scene(cubes())) {
                setup.check().expect("a lesson's set-up is in range");
            }
        }
    }
    assert!(!lessons::page(&lesson, &[]).is_empty());
}

/// A world of flatland and its table.
pub fn world(bytes: &[u8]) {
    let Ok(text) = str::from_utf8(bytes) else { return };
    let Some(world) = taken(Flatland::from_toml(text)) else { return };
    let again = Flatland::from_toml(&world.to_toml().expect("what was read can be written"));
    assert_eq!(again.expect("what was written can be read").segments, world.segments);
    if world.pixels * world.segments.len() < 5000
        && let Some(report) = taken(Report::of("input", &world))
    {
        report.text();
    }
}
