//! The real window on a virtual display: it opens, shows the scene, follows a click, and closes.

use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;
use shadowscope::scene::geometry::Geometry;
use shadowscope::setup::Setup;
use shadowscope::ui::{self, Model};
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::Arc;
use std::time::{Duration, Instant};

const SIZE: [usize; 2] = [1280, 800];
/// For anything that a slow machine may take its time for.
const PATIENCE: Duration = Duration::from_secs(120);

/// A child that does not outlive the test.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn start(command: &mut Command) -> Running {
    let name = command.get_program().to_string_lossy().into_owned();
    Running(command.spawn().unwrap_or_else(|e| panic!("{name} cannot be started ({e}); ./setup.sh installs it")))
}

/// Calls `poll` until it gives something.
fn wait_for<T>(what: &str, mut poll: impl FnMut() -> Option<T>) -> T {
    let start = Instant::now();
    loop {
        if let Some(found) = poll() {
            return found;
        }
        assert!(start.elapsed() < PATIENCE, "waited in vain for {what}");
        std::thread::sleep(Duration::from_millis(150));
    }
}

/// The screen as Xvfb keeps it in an XWD file: a pixel a number, rows from the top.
fn screen(folder: &Path) -> Option<Vec<u32>> {
    let bytes = std::fs::read(folder.join("Xvfb_screen0")).ok()?;
    let header = |i: usize| Some(u32::from_be_bytes(bytes.get(i * 4..i * 4 + 4)?.try_into().ok()?) as usize);
    assert_eq!([header(4)?, header(5)?], SIZE);
    assert_eq!(header(11)?, 32, "bits a pixel");
    let little = header(7)? == 0;
    let (first, row) = (header(0)? + header(19)? * 12, header(12)?);
    let mut out = Vec::with_capacity(SIZE[0] * SIZE[1]);
    for y in 0..SIZE[1] {
        for pixel in bytes.get(first + y * row..first + y * row + SIZE[0] * 4)?.chunks_exact(4) {
            let pixel: [u8; 4] = pixel.try_into().ok()?;
            out.push(if little { u32::from_le_bytes(pixel) } else { u32::from_be_bytes(pixel) } & 0xff_ffff);
        }
    }
    Some(out)
}

/// The part of the screen inside a rectangle.
fn cut(screen: &[u32], rect: egui::Rect) -> Vec<u32> {
    let [left, top, right, bottom] = [rect.left(), rect.top(), rect.right(), rect.bottom()].map(|v| v as usize);
    (top..bottom).flat_map(|y| screen[y * SIZE[0] + left..y * SIZE[0] + right].to_vec()).collect()
}

/// Where the layout puts the picture, and the button of a technique, in a window of our size.
fn places(scene: &str, technique: &str) -> (egui::Rect, egui::Pos2) {
    let (setup, scene) = Setup::open(scene).unwrap();
    let geometry = Geometry::new(&scene, 0, 0.0).unwrap();
    let model = Model::new(setup, Arc::new(scene), geometry.bounds);
    // The harness keeps a margin of 8 points around what it shows.
    let size = [SIZE[0] as f32 + 16.0, SIZE[1] as f32 + 16.0];
    let builder = Harness::builder().with_size(size).with_accessibility_check(false);
    let mut harness = builder.build_ui_state(
        |ui, (model, rect): &mut (Model, egui::Rect)| {
            ui::apply_style(ui.ctx());
            *rect = ui::layout(ui, model, &mut Vec::new());
        },
        (model, egui::Rect::NOTHING),
    );
    harness.run_steps(4);
    let margin = egui::vec2(8.0, 8.0);
    (harness.state().1.translate(-margin), harness.get_by_label(technique).rect().center() - margin)
}

/// A screenshot of the picture that two looks agree on.
fn settled(folder: &Path, rect: egui::Rect, accept: impl Fn(&[u32]) -> bool, what: &str) -> Vec<u32> {
    let mut last = Vec::new();
    let mut since = Instant::now();
    wait_for(what, || {
        let now = cut(&screen(folder)?, rect);
        if now != last || !accept(&now) {
            last = now;
            since = Instant::now();
            return None;
        }
        (since.elapsed() > Duration::from_millis(1500)).then_some(now)
    })
}

fn colours(picture: &[u32]) -> usize {
    let mut all = picture.to_vec();
    all.sort_unstable();
    all.dedup();
    all.len()
}

fn wait_for_exit(child: &mut Running) -> ExitStatus {
    wait_for("the window to close", || child.0.try_wait().unwrap())
}

#[test]
fn the_window_opens_follows_a_click_and_closes() {
    let folder = tempfile::tempdir().unwrap();
    let screen_size = format!("{}x{}x24", SIZE[0], SIZE[1]);
    let mut xvfb = Command::new("Xvfb");
    // Without -noreset the server starts over when a client leaves it alone, under the feet of one that is just coming.
    xvfb.args(["-displayfd", "1", "-noreset", "-nolisten", "tcp", "-screen", "0", &screen_size, "-fbdir"])
        .arg(folder.path());
    let mut xvfb = start(xvfb.stdout(Stdio::piped()).stderr(Stdio::null()));
    let mut number = String::new();
    BufReader::new(xvfb.0.stdout.take().unwrap()).read_line(&mut number).unwrap();
    let display = format!(":{}", number.trim());
    assert!(number.trim().parse::<u32>().is_ok(), "Xvfb did not start; ./setup.sh installs it");
    let xdotool = |args: &[&str]| {
        let status = Command::new("xdotool").args(args).env("DISPLAY", &display).stdout(Stdio::null()).status();
        status.unwrap_or_else(|e| panic!("xdotool cannot be started ({e}); ./setup.sh installs it")).success()
    };

    let mut window = Command::new(env!("CARGO_BIN_EXE_shadowscope"));
    window.arg("cubes").current_dir(&folder).env("DISPLAY", &display).env("XDG_RUNTIME_DIR", folder.path());
    window.env_remove("WAYLAND_DISPLAY").env("WINIT_X11_SCALE_FACTOR", "1");
    let mut window = start(&mut window);
    wait_for("the window", || {
        assert!(window.0.try_wait().unwrap().is_none(), "the program ended before its window was there");
        xdotool(&["search", "--onlyvisible", "--name", "^Shadowscope$"]).then_some(())
    });

    let (picture, button) = places("cubes", "Ray-traced hard shadow");
    // The sun's widget and other marks lie at the edges.
    let middle = picture.shrink2(egui::vec2(150.0, 150.0));
    let mapped = settled(folder.path(), middle, |p| colours(p) > 50, "the picture");

    xdotool(&["mousemove", &(button.x as i32).to_string(), &(button.y as i32).to_string()]);
    xdotool(&["click", "1"]);
    let differing = |p: &[u32]| p.iter().zip(&mapped).filter(|(a, b)| a != b).count();
    let traced = settled(folder.path(), middle, |p| differing(p) > 20, "another technique's picture");
    assert!(colours(&traced) > 50);
    // The same scene: only shadow edges differ.
    let share = differing(&traced) as f32 / traced.len() as f32;
    assert!(share < 0.2, "{} % of the picture changed", share * 100.0);

    // Without a window manager nobody else gives it the keyboard.
    assert!(xdotool(&["search", "--name", "^Shadowscope$", "windowfocus", "--sync"]));
    assert!(xdotool(&["key", "ctrl+q"]));
    let status = wait_for_exit(&mut window);
    assert!(status.success(), "the window closed with {status}");
}

#[test]
fn without_a_display_a_named_scene_is_an_error_that_says_what_to_do() {
    let mut command = Command::new(env!("CARGO_BIN_EXE_shadowscope"));
    let output = command.arg("cubes").env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY").output().unwrap();
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(!output.status.success());
    assert!(message.contains("no display") && message.contains("capture cubes"), "{message}");
}
