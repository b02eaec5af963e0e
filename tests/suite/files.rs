//! Files of the user: what cannot be read or written is said at once, and nothing is lost or left behind.

use crate::common::{gpu, mesh, ok, shadowscope};
use glam::Vec3;
use shadowscope::flatland::Flatland;
use shadowscope::frame::Renderer;
use shadowscope::scene::{builtin, bvh, geometry::Geometry};
use shadowscope::{capture, figure, files, lessons, measure};
use std::path::Path;
use std::process::{Command, Output};
use std::sync::Arc;

/// The last line of what a command that fails says.
fn refused(folder: &Path, args: &[&str]) -> String {
    told(&shadowscope(folder, args), args)
}

fn told(out: &Output, args: &[&str]) -> String {
    let error = String::from_utf8_lossy(&out.stderr);
    assert!(!out.status.success() && !error.contains("panicked"), "{args:?}: {error}");
    let last = error.lines().last().unwrap_or_default();
    assert!(last.starts_with("shadowscope: ") && last.chars().count() < 3000, "{args:?}: {error}");
    last.into()
}

/// What a folder holds.
fn held(folder: &Path) -> Vec<String> {
    let name = |entry: std::io::Result<std::fs::DirEntry>| entry.unwrap().file_name().to_string_lossy().into_owned();
    let mut names: Vec<String> = std::fs::read_dir(folder).unwrap().map(name).collect();
    names.sort();
    names
}

/// What a killed process leaves half written goes with the next file in its folder; what is another's stays.
#[test]
fn what_killed_processes_leave_goes_with_the_next_file() {
    let dir = tempfile::tempdir().unwrap();
    let made = |name: &str, seconds: u64| {
        let file = std::fs::File::create(dir.path().join(name)).unwrap();
        file.set_modified(std::time::SystemTime::now() - std::time::Duration::from_secs(seconds)).unwrap();
        file
    };
    drop(made(".shadowscope-dead.part", 3600));
    let writing = made(".shadowscope-long.part", 3600);
    writing.lock().unwrap();
    drop(made(".shadowscope-young.part", 0));
    drop(made(".shadowscope-other", 3600));
    drop(made("own.part", 3600));
    std::fs::create_dir(dir.path().join(".shadowscope-folder.part")).unwrap();
    let path = dir.path().join("a.txt");
    files::replace(&path, |file| {
        std::io::Write::write_all(file, b"whole")?;
        let beside = std::fs::read_dir(dir.path())?.flatten().map(|entry| entry.path());
        // What is being written is known by its name and locked.
        let known = beside.filter(|p| {
            p.extension().is_some_and(|end| end == "part") && std::fs::read(p).is_ok_and(|b| b == b"whole")
        });
        let locked = known.filter(|p| std::fs::File::open(p).is_ok_and(|file| file.try_lock().is_err()));
        assert_eq!(locked.count(), 1);
        Ok(())
    })
    .unwrap();
    let stay = [
        ".shadowscope-folder.part",
        ".shadowscope-long.part",
        ".shadowscope-other",
        ".shadowscope-young.part",
        "a.txt",
        "own.part",
    ];
    assert_eq!(held(dir.path()), stay);
}

#[test]
fn what_fails_halfway_changes_nothing() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.txt");
    let fail = |file: &mut std::fs::File| {
        std::io::Write::write_all(file, b"half")?;
        Err(std::io::Error::from_raw_os_error(28))
    };
    let error = files::replace(&path, fail).unwrap_err();
    assert!(error.to_string().contains("the disk is full"), "{error:#}");
    assert!(held(dir.path()).is_empty());
    files::save(&path, b"whole").unwrap();
    assert!(files::replace(&path, fail).is_err());
    assert_eq!((std::fs::read(&path).unwrap(), held(dir.path())), (b"whole".to_vec(), vec!["a.txt".to_string()]));
    files::save(&path, b"another").unwrap();
    assert_eq!((std::fs::read(&path).unwrap(), held(dir.path()).len()), (b"another".to_vec(), 1));
}

#[cfg(unix)]
#[test]
fn what_is_replaced_stays_a_link_and_keeps_its_mode() {
    use std::os::unix::fs::PermissionsExt;
    let dir = tempfile::tempdir().unwrap();
    let (file, link) = (dir.path().join("a"), dir.path().join("b"));
    let mode = || std::fs::metadata(&file).unwrap().permissions().mode() & 0o777;
    files::save(&file, b"1").unwrap();
    std::fs::write(dir.path().join("usual"), b"").unwrap();
    let usual = std::fs::metadata(dir.path().join("usual")).unwrap().permissions().mode() & 0o777;
    assert_eq!(mode(), usual, "a new file has the mode of any new file");
    std::fs::set_permissions(&file, PermissionsExt::from_mode(0o600)).unwrap();
    std::os::unix::fs::symlink("a", &link).unwrap();
    files::save(&link, b"2").unwrap();
    assert!(link.is_symlink());
    assert_eq!((std::fs::read(&file).unwrap(), mode()), (b"2".to_vec(), 0o600));
}

/// A link to a file that is not there yet leads to it.
#[cfg(unix)]
#[test]
fn links_are_followed_to_new_files() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::create_dir(dir.path().join("sub")).unwrap();
    std::os::unix::fs::symlink("sub/b", dir.path().join("a")).unwrap();
    std::os::unix::fs::symlink("c", dir.path().join("sub/b")).unwrap();
    files::save(&dir.path().join("a"), b"1").unwrap();
    assert_eq!(std::fs::read(dir.path().join("sub/c")).unwrap(), b"1");
    assert!(dir.path().join("a").is_symlink() && dir.path().join("sub/b").is_symlink());
    std::os::unix::fs::symlink("ring", dir.path().join("ring")).unwrap();
    files::save(&dir.path().join("ring"), b"2").unwrap();
    assert_eq!(std::fs::read(dir.path().join("ring")).unwrap(), b"2");
}

/// What is none of ours where a sweep keeps its rows is neither waited for nor overwritten.
#[cfg(unix)]
#[test]
fn what_is_in_the_way_of_a_sweep_is_told() {
    let dir = tempfile::tempdir().unwrap();
    let there = dir.path().join("a.csv.partial");
    std::fs::write(dir.path().join("own"), b"mine").unwrap();
    let args = ["sweep", "cubes", "--size=32x18", "--techniques=shadow-map", "--set=resolution=64,128", "-o", "a.csv"];
    let refused = |says: &str| {
        let last = self::refused(dir.path(), &args);
        assert!(last.contains("a.csv.partial") && last.contains(says), "{last}");
    };
    assert!(Command::new("mkfifo").arg(&there).status().unwrap().success());
    refused("is a pipe");
    std::fs::remove_file(&there).unwrap();
    std::os::unix::fs::symlink("own", &there).unwrap();
    refused("is a link");
    std::fs::remove_file(&there).unwrap();
    std::fs::write(&there, b"mine").unwrap();
    refused("holds no rows of a sweep");
    assert_eq!(std::fs::read(&there).unwrap(), b"mine");
    assert_eq!(std::fs::read(dir.path().join("own")).unwrap(), b"mine");
}

/// Where what is said cannot be said, the work goes on.
#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_for_messages_stops_nothing() {
    let dir = tempfile::tempdir().unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_shadowscope"));
    command.args(["capture", "cubes", "--size", "32x18", "-o", "a.png"]).current_dir(dir.path());
    let full = std::fs::File::options().write(true).open("/dev/full").unwrap();
    let status = command.stderr(full).status().unwrap();
    assert!(status.success(), "{status}");
    assert!(dir.path().join("a.png").exists());
}

/// Files that may be no larger than a few KiB: for the program the same as a full disk.
#[cfg(unix)]
#[test]
fn a_full_disk_costs_no_file() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("rows.csv"), std::fs::read("tests/data/bench.csv").unwrap()).unwrap();
    let full = |command: &str, name: &str| {
        let line = format!("trap '' XFSZ; ulimit -f 1; exec \"$0\" {command}");
        let mut shell = Command::new("sh");
        shell.args(["-c", &line, env!("CARGO_BIN_EXE_shadowscope")]).current_dir(dir.path());
        let out = shell.env("MESA_SHADER_CACHE_DISABLE", "true").output().unwrap();
        let last = told(&out, &[command]);
        assert!(last.contains(name) && last.contains("cannot be written"), "{last}");
        assert!(last.matches("os error").count() <= 1, "{last}");
    };
    let size = "--size 96x64";
    for (command, name) in [
        (format!("capture cubes {size} -o a.png"), "a.png"),
        (format!("capture cubes {size} --view depth -o a.exr"), "a.exr"),
        (format!("measure cubes {size} --techniques shadow-map --csv a.csv"), "a.csv"),
        ("chart rows.csv -o a.svg".into(), "a.svg"),
    ] {
        full(&command, name);
        assert_eq!(held(dir.path()), ["rows.csv"], "{command}");
        std::fs::write(dir.path().join(name), b"before").unwrap();
        full(&command, name);
        assert_eq!(std::fs::read(dir.path().join(name)).unwrap(), b"before", "{command}");
        std::fs::remove_file(dir.path().join(name)).unwrap();
        assert_eq!(held(dir.path()), ["rows.csv"], "{command}");
    }
}

#[test]
fn where_results_cannot_go_is_said_before_any_work() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("file"), b"").unwrap();
    std::fs::write(dir.path().join("rows.csv"), std::fs::read("tests/data/bench.csv").unwrap()).unwrap();
    // No scene of that name would be the first error of any work.
    for args in [
        &["capture", "atlantis", "-o", "file/x.png"][..],
        &["measure", "atlantis", "--csv", "file/x.csv"],
        &["measure", "atlantis", "--json", "file/x.json"],
        &["sweep", "atlantis", "-o", "file/x.csv"],
        &["sweep", "atlantis", "-o", "x.csv", "--report", "file"],
        &["advise", "atlantis", "--max-error", "1%", "-o", "file/x.csv"],
        &["stability", "atlantis.toml", "--json", "file/x.json"],
        &["stability", "atlantis.toml", "-o", "file"],
        &["chart", "atlantis.csv", "-o", "file/x.svg"],
        &["merge", "atlantis.csv", "-o", "file/x.csv"],
        &["reproduce", "-o", "file"],
        &["tour", "-o", "file"],
    ] {
        let last = refused(dir.path(), args);
        assert!(last.contains("file") && last.contains("folder") && !last.contains("atlantis"), "{last}");
    }
    // A folder that can be made is announced, and is not made for nothing.
    let out = shadowscope(dir.path(), &["capture", "atlantis", "-o", "new/x.png"]);
    let said = String::from_utf8_lossy(&out.stderr).into_owned();
    assert!(said.starts_with("The folder new is not there and will be made."), "{said}");
    assert_eq!(held(dir.path()), ["file", "rows.csv"]);
    let scene = format!("{}/tests/data/origin.glb", env!("CARGO_MANIFEST_DIR"));
    ok(dir.path(), &["capture", &scene, "--size", "32x32", "-o", "new/deep/x.png"]);
    ok(dir.path(), &["capture", "new/deep/x.png", "-o", "y.png"]);
    let read = |name: &str| image::open(dir.path().join(name)).unwrap().into_rgba8();
    assert_eq!(read("new/deep/x.png"), read("y.png"));
}

#[cfg(unix)]
#[test]
fn pipes_and_devices_are_not_waited_for() {
    let dir = tempfile::tempdir().unwrap();
    for ending in ["toml", "png", "glb", "gltf", "obj", "ply", "stl", "csv", "json", "md"] {
        assert!(Command::new("mkfifo").arg(dir.path().join(format!("p.{ending}"))).status().unwrap().success());
    }
    std::os::unix::fs::symlink("/dev/zero", dir.path().join("z.toml")).unwrap();
    for (args, kind) in [
        (&["capture", "p.toml", "-o", "x.png"][..], "a pipe"),
        (&["capture", "p.png", "-o", "x.png"], "a pipe"),
        (&["capture", "p.glb", "-o", "x.png"], "a pipe"),
        (&["capture", "p.gltf", "-o", "x.png"], "a pipe"),
        (&["capture", "p.obj", "-o", "x.png"], "a pipe"),
        (&["capture", "p.ply", "-o", "x.png"], "a pipe"),
        (&["capture", "p.stl", "-o", "x.png"], "a pipe"),
        (&["capture", "z.toml", "-o", "x.png"], "a device"),
        (&["flatland", "p.toml"], "a pipe"),
        (&["stability", "p.toml"], "a pipe"),
        (&["chart", "p.csv", "-o", "x.svg"], "a pipe"),
        (&["merge", "p.json", "-o", "x.csv"], "a pipe"),
        (&["tables", "p.md"], "a pipe"),
    ] {
        let last = refused(dir.path(), args);
        assert!(last.contains(kind), "{args:?}: {last}");
    }
}

/// Ten billion triangles are refused by their number: to make them would take more than any memory.
#[test]
fn scenes_are_counted_before_their_triangles_are_made() {
    let triangle = [Vec3::ZERO, Vec3::X, Vec3::Y];
    let mut scene = builtin::build("cubes").unwrap();
    scene.meshes.push(mesh(&vec![triangle; 100_000], 0));
    let mut node = scene.nodes[0].clone();
    node.meshes = vec![scene.meshes.len() as u32 - 1];
    node.instances = vec![glam::Mat4::IDENTITY; 100_000];
    scene.nodes.push(node);
    let error = Renderer::new(gpu(), Arc::new(scene)).err().unwrap().to_string();
    assert!(error.contains("10000000") && error.contains("open a scene with fewer"), "{error}");
}

/// A text that a small file inflates to more than any set-up has.
#[test]
fn a_text_in_a_picture_is_inflated_within_bounds() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("bomb.png");
    capture::write_png(&path, [1, 1], &[0; 4], Some("scene = \"cubes\"")).unwrap();
    assert_eq!(capture::read_setup(&path).unwrap(), "scene = \"cubes\"");
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 1, 1);
    encoder.set_color(png::ColorType::Rgba);
    let mut writer = encoder.write_header().unwrap();
    let mut text = png::text_metadata::ITXtChunk::new("shadowscope-setup", " ".repeat(65 << 20));
    text.compressed = true;
    writer.write_text_chunk(&text).unwrap();
    writer.write_image_data(&[0; 4]).unwrap();
    writer.finish().unwrap();
    assert!(bytes.len() < 1 << 20);
    std::fs::write(&path, bytes).unwrap();
    let error = format!("{:#}", capture::read_setup(&path).unwrap_err());
    assert!(error.contains("64 MiB"), "{error}");
}

#[test]
fn keys_of_any_length_make_short_messages() {
    let dir = tempfile::tempdir().unwrap();
    let long = "x".repeat(1 << 20);
    for text in [
        format!("scene = \"cubes\"\n{long} = 1"),
        format!("scene = \"cubes\"\ntime = \"{long}\\u001b[31m\""),
        format!("scene = \"cubes\"\ncamera = \"{long}\""),
        format!("scene = \"{long}\""),
        format!("scene = \"cubes\"\n[params.pcf]\n{long} = 1"),
        format!("scene = \"cubes\"\n[light]\nkind = \"spot\"\n{long} = 1"),
        format!("scene = {long}"),
    ] {
        std::fs::write(dir.path().join("a.toml"), text).unwrap();
        let last = refused(dir.path(), &["capture", "a.toml", "-o", "x.png"]);
        assert!(last.contains("a.toml") && !last.contains('\u{1b}'), "{last}");
    }
}

/// What cards, lists and charts show is of a length that they have room for.
#[test]
fn texts_of_any_length_are_refused_or_shortened() {
    let step = |text: &str| {
        format!("title = \"a\"\nsee = \"b\"\n[[steps]]\ntitle = \"c\"\ntext = \"{text}\"\nsetup.scene = \"cubes\"\n")
    };
    let lesson = |text: &str| lessons::read("a", &step(text), Path::new(""));
    assert_eq!(lesson(&"ä".repeat(5000)).unwrap().steps.len(), 1);
    let error = format!("{:#}", lesson(&"ä".repeat(5001)).unwrap_err());
    assert!(error.contains("step 1: text has 5001 characters; it takes up to 5000"), "{error}");
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.csv");
    std::fs::write(&path, format!("index,technique\n7,{}\n", "x".repeat(5000))).unwrap();
    let error = measure::read(&path).unwrap_err().to_string();
    assert!(error.contains("a.csv: row 7 has") && error.contains("more than 4096"), "{error}");
}

#[test]
fn what_differs_is_named() {
    let dir = tempfile::tempdir().unwrap();
    let small = ["sweep", "cubes", "--size", "32x32", "--truth-samples", "1", "--techniques", "shadow-map"];
    ok(dir.path(), &[&small[..], &["-o", "a.csv"]].concat());
    let last = refused(dir.path(), &[&small[..], &["-o", "a.csv", "--set", "resolution=64"]].concat());
    assert!(last.contains("params.shadow-map.resolution is 1024 there and 64 here"), "{last}");
    let last = refused(dir.path(), &[&small[..], &["-o", "b.csv", "--shard", "1/0"]].concat());
    assert!(last.contains("there are no 0 parts"), "{last}");
}

/// A path of any bytes is opened, and found again by what a capture of it embeds.
#[cfg(target_os = "linux")]
#[test]
fn paths_need_not_be_text() {
    use std::os::unix::ffi::OsStrExt;
    let dir = tempfile::tempdir().unwrap();
    for bytes in [&b"plain"[..], b"\xff\x80.glb", "ä\u{ef80}\u{efff}ö".as_bytes(), b"a\xef\xbe\x80\xed"] {
        let path = std::ffi::OsStr::from_bytes(bytes);
        assert_eq!(files::path_of(&files::name_of(path)).as_os_str(), path);
    }
    // Longer than what messages show of a name, too.
    let (folder, name) = (
        std::ffi::OsStr::from_bytes(
            b"a folder whose name is longer than what messages show of names, by some ten characters or so \xff",
        ),
        std::ffi::OsStr::from_bytes(b"scene\xe9.glb"),
    );
    std::fs::create_dir(dir.path().join(folder)).unwrap();
    std::fs::copy("tests/data/origin.glb", dir.path().join(folder).join(name)).unwrap();
    let run = |args: &[&std::ffi::OsStr]| {
        let mut program = Command::new(env!("CARGO_BIN_EXE_shadowscope"));
        let out = program.args(args).current_dir(dir.path()).env_remove("XDG_RUNTIME_DIR").output().unwrap();
        let said = String::from_utf8_lossy(&out.stderr).into_owned();
        assert!(out.status.success(), "{said}");
        assert!(!said.contains("XDG_RUNTIME_DIR"), "{said}");
    };
    let text = |args: &[&str]| args.iter().map(|a| std::ffi::OsString::from(*a)).collect::<Vec<_>>();
    let (scene, rest) = (Path::new(folder).join(name), text(&["capture", "--size", "32x32", "-o", "a.png"]));
    let args: Vec<&std::ffi::OsStr> = rest.iter().map(|a| a.as_os_str()).chain([scene.as_os_str()]).collect();
    run(&args);
    std::fs::create_dir(dir.path().join("other")).unwrap();
    let again = text(&["capture", "a.png", "-o", "other/b.png"]);
    run(&again.iter().map(|a| a.as_os_str()).collect::<Vec<_>>());
    let last = text(&["capture", "other/b.png", "-o", "c.png"]);
    run(&last.iter().map(|a| a.as_os_str()).collect::<Vec<_>>());
    let read = |name: &str| std::fs::read(dir.path().join(name)).unwrap();
    assert_eq!(read("a.png"), read("c.png"));
}

/// Eighty thousand triangles, each around the last: the tree is made without as many rounds, and is no deeper than halves are.
#[test]
fn heaps_of_triangles_are_halved() {
    let corner = |i: u32| Vec3::new(1.0, 1.0, 1e-7 * i as f32);
    let triangle = |c: Vec3| obvhs::triangle::Triangle { v0: Vec3::ZERO.into(), v1: Vec3::X.into(), v2: c.into() };
    let boxes = |triangles: &[obvhs::triangle::Triangle]| -> Vec<[Vec3; 2]> {
        triangles.iter().map(|t| [t.v0.min(t.v1).min(t.v2).into(), t.v0.max(t.v1).max(t.v2).into()]).collect()
    };
    let mut nested: Vec<_> = (0..80_000).map(|i| triangle(corner(i))).collect();
    // One far away, so that the heap is small in the whole.
    nested.push(triangle(Vec3::splat(1e4)));
    assert!(bvh::heaped(&boxes(&nested)));
    let tree = bvh::Bvh::new(&nested);
    let mut found = vec![false; nested.len()];
    tree.order.iter().for_each(|i| found[*i as usize] = true);
    assert!(found.iter().all(|found| *found));
    let mut todo = vec![(0, 1)];
    let mut deepest = 0;
    while let Some((at, depth)) = todo.pop() {
        deepest = deepest.max(depth);
        for (_, child) in tree.nodes[at].children() {
            if let bvh::Child::Node(node) = child {
                todo.push((node, depth + 1));
            }
        }
    }
    assert!(deepest <= 16, "{deepest}");
    for name in ["bench", "terrain", "arches"] {
        let geometry = Geometry::new(&builtin::build(name).unwrap(), 0, 0.0).unwrap();
        let boxes: Vec<[Vec3; 2]> = (0..geometry.triangles.len())
            .map(|i| geometry.corners(i))
            .map(|[a, b, c]| [a.min(b).min(c), a.max(b).max(c)])
            .collect();
        assert!(!bvh::heaped(&boxes), "{name}");
    }
}

/// A file that says it is empty and is not, as one that another program writes meanwhile.
#[cfg(target_os = "linux")]
#[test]
fn a_file_that_grows_is_read_within_bounds() {
    let path = Path::new("/proc/cpuinfo");
    assert_eq!(std::fs::metadata(path).unwrap().len(), 0);
    let error = files::read(path, 16).unwrap_err().to_string();
    assert!(error.contains("more than 1 MiB, and still grows"), "{error}");
    let whole = files::read(path, files::MOST_TEXT).unwrap();
    assert!(whole.len() > 16);
}

/// What a few words ask for is counted before it is made.
#[test]
fn counts_beyond_what_is_allowed_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let sweep =
        |set: &str| refused(dir.path(), &["sweep", "cubes", "--techniques", "pssm", "-o", "a.csv", "--set", set]);
    let last = sweep("lambda=0..1+0.000001");
    assert!(last.contains("more than 100000 steps"), "{last}");
    let error = figure::Spec::check_count(65, 64).unwrap_err().to_string();
    assert!(error.contains("65 rows of 64 columns are too many; a sheet has up to 4096"), "{error}");
    let world = |pixels: u32, segments: usize| {
        let segments = vec!["[2, 0, 20, 0]"; segments].join(", ");
        let text =
            format!("eye = [0, 1]\ngaze = 0\nfov = 60\nlight = [5, 5]\npixels = {pixels}\nsegments = [{segments}]\n");
        Flatland::from_toml(&text).map(drop).map_err(|error| error.to_string())
    };
    assert_eq!(world(10_000, 1000), Ok(()));
    assert!(world(10_001, 1000).unwrap_err().contains("pixels = 10001: it goes from 1 to 10000"));
    assert!(world(10_000, 1001).unwrap_err().contains("there are 1001 segments, and there can be 1000"));
}

/// Folders in the place of files, files without anything in them, links in a ring, files that are not there any more.
#[test]
fn what_is_no_file_is_said() {
    let dir = tempfile::tempdir().unwrap();
    for ending in ["toml", "png", "webp", "svg", "glb", "gltf", "obj", "ply", "stl", "csv", "json"] {
        std::fs::create_dir(dir.path().join(format!("folder.{ending}"))).unwrap();
        std::fs::write(dir.path().join(format!("empty.{ending}")), b"").unwrap();
        let name = |what: &str| format!("{what}.{ending}");
        for (what, says) in [("folder", "a folder"), ("gone", "no such file"), ("empty", "")] {
            let args = match ending {
                "csv" | "json" => vec!["chart".to_string(), name(what), "-o".into(), "x.svg".into()],
                "svg" => vec!["figure".into(), name(what), "-o".into(), "out".into()],
                _ => vec!["capture".into(), name(what), "-o".into(), "x.png".into()],
            };
            let last = refused(dir.path(), &args.iter().map(String::as_str).collect::<Vec<_>>());
            assert!(last.contains(&name(what)) && last.contains(says), "{last}");
        }
    }
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("ring.glb", dir.path().join("ring.glb")).unwrap();
        let last = refused(dir.path(), &["capture", "ring.glb", "-o", "x.png"]);
        assert!(last.contains("ring.glb"), "{last}");
    }
    // Too large, though nothing is in them.
    for (name, size, says) in
        [("large.toml", 65 << 20, "it has 65 MiB, and up to 64 are read"), ("large.stl", 5 << 30, "it has 5120 MiB")]
    {
        std::fs::File::create(dir.path().join(name)).unwrap().set_len(size).unwrap();
        let last = refused(dir.path(), &["capture", name, "-o", "x.png"]);
        assert!(last.contains(name) && last.contains(says), "{last}");
    }
    let denied = std::io::Error::from(std::io::ErrorKind::PermissionDenied);
    assert_eq!(files::reason(&denied), "there is no permission");
}
