//! Work that is stopped or torn away: what was measured stays, and is gone on with.
#![cfg(target_os = "linux")]

use crate::common::{ok, shadowscope};
use rustix::process::{Pid, Signal, kill_process};
use shadowscope::measure;
use std::fs::File;
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

/// Starts the program in a folder, without a display.
fn start(folder: &Path, args: &[&str]) -> Child {
    let mut command = Command::new(env!("CARGO_BIN_EXE_shadowscope"));
    command.args(args).current_dir(folder).env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY");
    command.env("RUST_BACKTRACE", "0").env("SHADOWSCOPE_TIMING", "0");
    command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the program runs")
}

/// Waits until something holds of a program that runs.
fn wait_until(child: &mut Child, what: &str, holds: impl Fn() -> bool) {
    let start = Instant::now();
    while !holds() {
        assert!(child.try_wait().unwrap().is_none(), "it ended before {what}");
        assert!(start.elapsed() < Duration::from_secs(120), "waited in vain for {what}");
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// Whether a program has asked to be told of Ctrl-C and of what else ends programs.
fn listens(pid: u32) -> bool {
    let status = std::fs::read_to_string(format!("/proc/{pid}/status")).unwrap_or_default();
    let caught = status.lines().find_map(|line| line.strip_prefix("SigCgt:")).map(str::trim);
    let caught = caught.and_then(|mask| u64::from_str_radix(mask, 16).ok()).unwrap_or(0);
    [Signal::INT, Signal::TERM, Signal::HUP].iter().all(|signal| caught & 1 << (signal.as_raw() - 1) != 0)
}

fn signal(child: &Child, signal: Signal) {
    kill_process(Pid::from_child(child), signal).unwrap();
}

/// What is said of work that Ctrl-C has stopped: its last line.
fn stopped(child: Child, args: &[&str]) -> (String, Output) {
    let out = child.wait_with_output().unwrap();
    let error = String::from_utf8_lossy(&out.stderr).into_owned();
    assert_eq!(out.status.code(), Some(130), "{args:?}: {error}");
    let last = error.lines().last().unwrap_or_default().to_string();
    assert!(last.starts_with("stopped: "), "{args:?}: {error}");
    (last, out)
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> =
        std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

/// Ctrl-C leaves the rows that are measured, a row each; so does the end of all ends. The same command goes on from there.
#[test]
fn a_sweep_outlives_ctrl_c_and_kill() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    // Sixteen take turns, and their rows come together; the others take their time.
    let args = [
        &["sweep", "cubes", "--size", "32x18", "--techniques", "shadow-map,rt-soft", "--set", "resolution=64"][..],
        &["--set", "slope_bias=0..3+0.2", "--set", "rt-soft.samples=4,8,16,32", "--light", "sun:angular_radius=1"],
        &["-o", "a.csv"],
    ]
    .concat();
    let partial = folder.join("a.csv.partial");
    let rows =
        || std::fs::read(&partial).map_or(0, |text| text.iter().filter(|b| **b == b'\n').count().saturating_sub(1));
    let mut child = start(folder, &args);
    wait_until(&mut child, "its first rows", || rows() >= 16);
    signal(&child, Signal::INT);
    let (told, _) = stopped(child, &args);
    assert_eq!(names(folder), ["a.csv.partial"]);
    let text = std::fs::read(&partial).unwrap();
    let first = measure::read_csv(&text[..]).unwrap();
    assert!(first.len() >= 16 && first.len() < 20, "{} rows", first.len());
    let says = format!("{} of 20 configurations are measured and stand in a.csv.partial", first.len());
    assert!(told.contains(&says) && told.contains("the same command goes on"), "{told}");

    // What another one writes is not taken away under it.
    let held = File::open(&partial).unwrap();
    held.lock().unwrap();
    let out = shadowscope(folder, &args);
    let error = String::from_utf8_lossy(&out.stderr);
    assert!(!out.status.success() && error.contains("is being written by another sweep"), "{error}");
    drop(held);

    // Killed while it measures on.
    let mut child = start(folder, &args);
    let pid = child.id();
    wait_until(&mut child, "its device", || listens(pid));
    signal(&child, Signal::KILL);
    assert_eq!(child.wait().unwrap().signal(), Some(9));
    assert!(rows() >= first.len(), "rows are lost");

    let out = ok(folder, &args);
    let error = String::from_utf8_lossy(&out.stderr);
    assert!(error.contains("of 20 configurations are measured already"), "{error}");
    let whole = measure::read(&folder.join("a.csv")).unwrap();
    assert_eq!(whole[..first.len()], first[..], "rows that were there stay as they were, times too");
    assert_eq!(whole.iter().map(|r| r.index).collect::<Vec<_>>(), (0..20).collect::<Vec<_>>());
    assert_eq!(names(folder), ["a.csv"]);
}

/// All that takes long ends at Ctrl-C, or as a terminal is closed or a system shut down, with a sentence, and leaves nothing half done.
#[test]
fn what_takes_long_ends_at_ctrl_c() {
    let dir = tempfile::tempdir().unwrap();
    let small = ["--size", "64x36"];
    let folder = |name: &str| {
        let folder = dir.path().join(name);
        std::fs::create_dir(&folder).unwrap();
        folder
    };
    std::fs::write(folder("tables").join("page.md"), TABLE).unwrap();
    let advise = ["advise", "cubes", "--by", "rmse", "--max-error", "0", "-o", "a.csv"];
    let commands: [(&str, Signal, &[&str], &str); 5] = [
        ("measure", Signal::INT, &["measure", "cubes", "--csv", "a.csv"], "nothing is measured yet"),
        ("advise", Signal::TERM, &advise, "no advice yet"),
        ("stability", Signal::HUP, &["stability", "st-wire", "--json", "a.json"], "no path is complete yet"),
        ("animate", Signal::INT, &["animate", "cubes", "--turntable=5000", "-o", "a.webp"], "nothing is written"),
        ("tables", Signal::TERM, &["tables", "page.md"], "0 of 1 pages are written"),
    ];
    let running: Vec<_> = commands
        .map(|(name, sent, args, says)| {
            let sized = name != "tables";
            let args = [args, if sized { &small } else { &[] }].concat();
            let folder = dir.path().join(name);
            let _ = std::fs::create_dir(&folder);
            let mut child = start(&folder, &args);
            let pid = child.id();
            wait_until(&mut child, "its device", || listens(pid));
            signal(&child, sent);
            (folder, child, args, says)
        })
        .into_iter()
        .collect();
    for (folder, child, args, says) in running {
        let (told, _) = stopped(child, &args);
        assert!(told.contains(says), "{args:?}: {told}");
        let left: Vec<String> = names(&folder).into_iter().filter(|name| name != "page.md").collect();
        assert!(left.is_empty(), "{args:?} left {left:?}");
        if folder.ends_with("tables") {
            assert_eq!(std::fs::read_to_string(folder.join("page.md")).unwrap(), TABLE);
        }
    }
}

const TABLE: &str =
    "<!-- shadowscope table cubes --size 256x144 --rows shadow-map,pcf,pcss,vsm,esm --columns rmse,ratio -->\n";
