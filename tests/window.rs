//! The real window on a virtual display: it opens, shows the scene, follows clicks, sweeps, and closes.

use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;
use shadowscope::params::Value;
use shadowscope::scene::geometry::Geometry;
use shadowscope::setup::Setup;
use shadowscope::techniques;
use shadowscope::ui::{self, Job, Model, Tab};
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
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
    assert_eq!(header(11)?, 32, "bits per pixel");
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

/// The layout of a window of our size, without the window: to know where things are.
fn layout(what: &str, prepare: impl Fn(&mut Model)) -> Harness<'static, (Model, egui::Rect)> {
    let (setup, scene) = Setup::open(what).unwrap();
    let geometry = Geometry::new(&scene, 0, 0.0).unwrap();
    let mut model = Model::new(setup, Arc::new(scene), geometry.bounds);
    prepare(&mut model);
    // The harness keeps a margin of 8 points around what it shows.
    let size = [SIZE[0] as f32 + 2.0 * MARGIN, SIZE[1] as f32 + 2.0 * MARGIN];
    let builder = Harness::builder().with_size(size).with_accessibility_check(false);
    let mut harness = builder.build_ui_state(
        |ui, (model, rect): &mut (Model, egui::Rect)| {
            ui::apply_style(ui.ctx());
            *rect = ui::layout(ui, model, &mut Vec::new());
        },
        (model, egui::Rect::NOTHING),
    );
    harness.run_steps(4);
    harness
}

const MARGIN: f32 = 8.0;

/// A rectangle of the harness in the window.
fn placed(rect: egui::Rect) -> egui::Rect {
    rect.translate(egui::Vec2::splat(-MARGIN))
}

/// Where the button with this label is in the window.
fn button(harness: &Harness<'static, (Model, egui::Rect)>, label: &str) -> egui::Pos2 {
    placed(harness.get_all_by_label(label).next().unwrap().rect()).center()
}

/// Windows are timed: one at a time.
static ALONE: Mutex<()> = Mutex::new(());

/// A virtual display with the program's window on it.
struct Desktop {
    window: Running,
    display: String,
    folder: tempfile::TempDir,
    _xvfb: Running,
    _alone: MutexGuard<'static, ()>,
}

impl Desktop {
    /// Opens the window on `what`; `files` are written into its folder first.
    fn open(what: &str, files: &[(&str, &str)]) -> Desktop {
        let mut desktop = Desktop::start(what, files);
        wait_for("the window", || {
            let running = desktop.window.0.try_wait().unwrap().is_none();
            assert!(running, "the program ended before its window was there");
            desktop.xdotool(&["search", "--onlyvisible", "--name", "^Shadowscope$"]).then_some(())
        });
        desktop
    }

    /// As [`Desktop::open`], without waiting for the window.
    fn start(what: &str, files: &[(&str, &str)]) -> Desktop {
        let alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
        let folder = tempfile::tempdir().unwrap();
        for (name, text) in files {
            std::fs::write(folder.path().join(name), text).unwrap();
        }
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

        let mut window = Command::new(env!("CARGO_BIN_EXE_shadowscope"));
        if !what.is_empty() {
            window.arg(what);
        }
        // What is opened here is none of the user's recent files, and none of the windows that the user goes on with.
        window.env("XDG_CONFIG_HOME", folder.path().join("config")).env("XDG_STATE_HOME", folder.path().join("state"));
        window.current_dir(&folder).env("DISPLAY", &display).env("XDG_RUNTIME_DIR", folder.path());
        window.env_remove("WAYLAND_DISPLAY").env("WINIT_X11_SCALE_FACTOR", "1");
        let window = start(window.stderr(Stdio::piped()));
        Desktop { window, display, folder, _xvfb: xvfb, _alone: alone }
    }

    fn xdotool(&self, args: &[&str]) -> bool {
        let status = Command::new("xdotool").args(args).env("DISPLAY", &self.display).stdout(Stdio::null()).status();
        status.unwrap_or_else(|e| panic!("xdotool cannot be started ({e}); ./setup.sh installs it")).success()
    }

    fn click(&self, at: egui::Pos2) {
        self.xdotool(&["mousemove", &(at.x as i32).to_string(), &(at.y as i32).to_string()]);
        // A mouse that jumps and clicks at once is hardly a mouse.
        std::thread::sleep(Duration::from_millis(200));
        self.xdotool(&["click", "1"]);
    }

    /// What the screen shows inside a rectangle.
    fn look(&self, rect: egui::Rect) -> Option<Vec<u32>> {
        Some(cut(&screen(self.folder.path())?, rect))
    }

    /// Presses a key. Without a window manager nobody else gives the window the keyboard.
    fn key(&self, key: &str) {
        assert!(self.xdotool(&["search", "--name", "^Shadowscope$", "windowfocus", "--sync"]));
        assert!(self.xdotool(&["key", key]));
    }
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
    let mut desktop = Desktop::open("cubes", &[]);
    let layout = layout("cubes", |_| ());
    // The sun's widget and other marks lie at the edges.
    let middle = placed(layout.state().1).shrink2(egui::vec2(150.0, 150.0));
    let folder = desktop.folder.path().to_path_buf();
    let mapped = settled(&folder, middle, |p| colours(p) > 50, "the picture");

    desktop.click(button(&layout, "Percentage-closer filtering"));
    let differing = |p: &[u32]| p.iter().zip(&mapped).filter(|(a, b)| a != b).count();
    // The same scene: once the draft has gone only shadow edges differ.
    let edges = |p: &[u32]| (21..p.len() / 5).contains(&differing(p));
    let filtered = settled(&folder, middle, edges, "another technique's picture");
    assert!(colours(&filtered) > 50);

    desktop.key("ctrl+q");
    let status = wait_for_exit(&mut desktop.window);
    assert!(status.success(), "the window closed with {status}");
}

/// Without a file the start screen comes first; a click on a lesson's picture shows its first step, Escape would have shown the scene.
#[test]
fn without_a_file_the_start_screen_leads_to_a_lesson() {
    let mut desktop = Desktop::open("", &[]);
    let start = layout("bench", |m| m.start.shown = true);
    let lesson = shadowscope::lessons::find("acne").unwrap();
    let tile = placed(start.get_all_by_label(&lesson.title).next().unwrap().rect());
    // Its picture is drawn beside the window.
    let picture = egui::Rect::from_min_size(tile.min, egui::vec2(tile.width(), 0.55 * tile.width())).shrink(12.0);
    wait_for("the tile's picture", || desktop.look(picture).filter(|p| colours(p) > 50));
    desktop.click(tile.center());
    let card = layout("cubes", |m| _ = m.begin(lesson, 0));
    let middle = placed(card.state().1).shrink2(egui::vec2(100.0, 150.0));
    let folder = desktop.folder.path().to_path_buf();
    settled(&folder, middle, |p| colours(p) > 50, "the lesson's picture");
    desktop.key("ctrl+s");
    let saved = desktop.folder.path().join("setup.toml");
    let text = wait_for("the saved set-up", || std::fs::read_to_string(&saved).ok().filter(|t| t.contains("[params")));
    assert!(text.contains("scene = \"cubes\"") && text.contains("bias_kind = \"none\""), "{text}");
    desktop.key("ctrl+q");
    assert!(wait_for_exit(&mut desktop.window).success());
}

/// Twenty clicks 0.3 s apart, by turns on techniques and views, of a scene whose frames take longer than that on software:
/// each is seen in its row before the next in the same list.
#[test]
fn no_click_is_lost_to_a_long_frame() {
    let mut desktop = Desktop::open("pavilion", &[]);
    let layout = layout("pavilion", |_| ());
    let middle = placed(layout.state().1).shrink2(egui::vec2(150.0, 150.0));
    wait_for("the picture", || desktop.look(middle).filter(|p| colours(p) > 50));
    let chosen = rgb(layout.ctx.style_of(egui::Theme::Dark).visuals.selection.bg_fill);
    let row = |label: &str| placed(layout.get_all_by_label(label).next().unwrap().rect());
    let ids = ["shadow-map", "pcf", "pcss", "vsm"];
    let titles = ids.map(|id| techniques::find(id).unwrap().title);
    let views = ["Visibility", "Error", "Facing", "Albedo", "Normals"];
    let clicks: Vec<egui::Rect> =
        (0..20).map(|i| if i % 2 == 0 { row(titles[i / 2 % 4]) } else { row(views[i / 2 % 5]) }).collect();
    let mut released: Vec<Instant> = Vec::new();
    let mut seen: Vec<Option<Duration>> = vec![None; clicks.len()];
    let start = Instant::now();
    for (i, rect) in clicks.iter().enumerate() {
        let at = rect.center();
        let (x, y) = ((at.x as i32).to_string(), (at.y as i32).to_string());
        desktop.xdotool(&["mousemove", &x, &y, "sleep", "0.03", "mousedown", "1"]);
        released.push(Instant::now());
        desktop.xdotool(&["mouseup", "1"]);
        while start.elapsed() < Duration::from_millis(300) * (i as u32 + 1) {
            for k in i.saturating_sub(1)..=i {
                let lit = || {
                    desktop.look(clicks[k]).is_some_and(|p| p.iter().filter(|p| **p == chosen).count() * 3 > p.len())
                };
                if seen[k].is_none() && lit() {
                    seen[k] = Some(released[k].elapsed());
                }
            }
            std::thread::sleep(Duration::from_millis(1));
        }
    }
    assert!(seen.iter().all(Option::is_some), "answers to the clicks: {seen:?}");
    let mut times: Vec<Duration> = seen.into_iter().flatten().collect();
    times.sort_unstable();
    println!("from a click to its visible answer: median {:?}, longest {:?}", times[10], times[19]);
    desktop.key("ctrl+s");
    let saved = desktop.folder.path().join("setup.toml");
    let text = wait_for("the saved set-up", || std::fs::read_to_string(&saved).ok().filter(|t| t.contains("[params")));
    let last = format!("technique = \"{}\"", ids[9 % 4]);
    assert!(text.contains(&last) && text.contains("view = \"normals\""), "{text}");
    desktop.key("ctrl+q");
    assert!(wait_for_exit(&mut desktop.window).success());
}

/// What cannot be opened ends the program, with the reason: before a window opens where it is not there, else with it.
#[test]
fn what_cannot_be_opened_is_an_error() {
    let mut command = Command::new(env!("CARGO_BIN_EXE_shadowscope"));
    let output = command.arg("missing.glb").output().unwrap();
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(!output.status.success() && message.contains("missing.glb: there is no such file"), "{message}");

    let mut desktop = Desktop::start("broken.glb", &[("broken.glb", "no glTF at all")]);
    assert!(!wait_for_exit(&mut desktop.window).success());
    let mut message = String::new();
    std::io::Read::read_to_string(&mut desktop.window.0.stderr.take().unwrap(), &mut message).unwrap();
    assert!(message.contains("broken.glb"), "{message}");
}

/// Without a driver the window says what to install; who has started it without a terminal gets a dialog.
#[test]
fn without_a_driver_a_dialog_says_so() {
    let desktop = Desktop::start("cubes", &[("zenity", "#!/bin/sh\necho \"$@\" > told\n")]);
    let dialog = desktop.folder.path().join("zenity");
    let mut allowed = std::fs::metadata(&dialog).unwrap().permissions();
    std::os::unix::fs::PermissionsExt::set_mode(&mut allowed, 0o755);
    std::fs::set_permissions(&dialog, allowed).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_shadowscope"));
    let path = format!("{}:{}", desktop.folder.path().display(), std::env::var("PATH").unwrap());
    command.arg("cubes").env("DISPLAY", &desktop.display).env("PATH", path).env("VK_DRIVER_FILES", "/nonexistent");
    command.env_remove("WAYLAND_DISPLAY").current_dir(&desktop.folder);
    let out = command.stdin(Stdio::null()).output().unwrap();
    let told = std::fs::read_to_string(desktop.folder.path().join("told")).unwrap_or_default();
    for text in [&*String::from_utf8_lossy(&out.stderr), &told] {
        assert!(!out.status.success() && text.contains("no graphics adapter was found; install a driver"), "{text}");
    }
    assert!(told.contains("--error"), "{told}");
}

/// The driver drops the devices of the window and of the scene; the window is made small, and hidden. What it showed comes back, the
/// set-up stays, and clicks are followed.
#[test]
fn a_lost_device_and_a_lost_surface_lose_nothing() {
    let mut desktop = Desktop::open("cubes", &[]);
    let layout = layout("cubes", |_| ());
    let middle = placed(layout.state().1).shrink2(egui::vec2(150.0, 150.0));
    let folder = desktop.folder.path().to_path_buf();
    // What comes first may be of another size yet.
    let plain = settled(&folder, middle, |p| colours(p) > 50, "the picture");
    desktop.key("ctrl+shift+alt+F12");
    desktop.click(button(&layout, "Percentage-closer filtering"));
    // No tooltip is to lie over the picture.
    desktop.xdotool(&["mousemove", "640", "790"]);
    let differing = |p: &[u32]| p.iter().zip(&plain).filter(|(a, b)| a != b).count();
    let edges = |p: &[u32]| (21..p.len() / 5).contains(&differing(p));
    let filtered = settled(&folder, middle, edges, "the picture, on another device");
    let window = ["search", "--name", "^Shadowscope$"];
    for change in [&["windowsize", "301", "201"][..], &["windowunmap"], &["windowmap"], &["windowsize", "1280", "800"]]
    {
        assert!(desktop.xdotool(&[&window, change].concat()));
        std::thread::sleep(Duration::from_millis(300));
    }
    settled(&folder, middle, |p| p == filtered, "the same picture");
    desktop.key("ctrl+s");
    let saved = desktop.folder.path().join("setup.toml");
    let text = wait_for("the saved set-up", || std::fs::read_to_string(&saved).ok().filter(|t| t.contains("[params")));
    assert!(text.contains("technique = \"pcf\""), "{text}");
    desktop.key("ctrl+q");
    assert!(wait_for_exit(&mut desktop.window).success());
}

/// The colour of a full pixel.
fn rgb(color: egui::Color32) -> u32 {
    u32::from_be_bytes([0, color.r(), color.g(), color.b()])
}

/// Places inside a rectangle of the screen that are this colour all around: the middles of markers, not of letters.
fn spots(picture: &[u32], rect: egui::Rect, color: u32) -> Vec<egui::Pos2> {
    let (width, height) = (rect.width() as usize, picture.len() / rect.width() as usize);
    let mut out: Vec<egui::Pos2> = Vec::new();
    for y in 2..height - 2 {
        for x in 2..width - 2 {
            let all = (y - 2..=y + 2).all(|y| (x - 2..=x + 2).all(|x| picture[y * width + x] == color));
            let at = rect.min + egui::vec2(x as f32, y as f32);
            if all && out.iter().all(|o| o.distance(at) > 8.0) {
                out.push(at);
            }
        }
    }
    out
}

#[test]
fn a_sweep_started_by_a_click_makes_points_and_a_click_on_one_applies_it() {
    let small = "scene = \"cubes\"\nsize = [160, 90]\n";
    let mut desktop = Desktop::open("small.toml", &[("small.toml", small)]);
    let what = desktop.folder.path().join("small.toml").to_string_lossy().into_owned();
    let closed = layout(&what, |_| ());
    let whole = placed(closed.state().1);
    wait_for("the picture", || desktop.look(whole.shrink(150.0)).filter(|p| colours(p) > 50));

    // The tab, then one technique only.
    desktop.click(button(&closed, "Chart"));
    let open = layout(&what, |m| m.drawer = Some(Tab::Chart));
    let drawer = egui::Rect::from_min_max(placed(open.state().1).left_bottom(), whole.right_bottom());
    let style = open.ctx.style_of(egui::Theme::Dark).visuals.clone();
    wait_for("the chart's ground", || {
        let ground = desktop.look(drawer)?;
        (ground.iter().filter(|p| **p == rgb(style.extreme_bg_color)).count() * 3 > ground.len()).then_some(())
    });
    // Those that serve the scene's sun are offered.
    let served = techniques::ALL.iter().filter(|i| i.lights.contains(&"directional"));
    let others: Vec<&str> = served.map(|i| i.id).filter(|id| *id != "shadow-map").collect();
    // The list scrolls: none of them, then the one.
    for label in ["none", "shadow-map"] {
        desktop.click(button(&open, label));
    }
    let one = layout(&what, |m| {
        m.drawer = Some(Tab::Chart);
        m.left_out = others.iter().copied().collect();
    });
    desktop.click(button(&one, "Sweep 6 configurations"));

    // The bar grows.
    let busy = layout(&what, |m| {
        m.drawer = Some(Tab::Chart);
        m.left_out = others.iter().copied().collect();
        m.measuring = Some(Job::new("Sweep"));
    });
    // The spinner over the picture is one too.
    let mut bars = busy.get_all_by_role(egui::accesskit::Role::ProgressIndicator).map(|n| placed(n.rect()));
    let bar = bars.find(|bar| drawer.contains_rect(*bar)).unwrap();
    let filled = || {
        let chosen = rgb(style.selection.bg_fill);
        desktop.look(bar).map_or(0, |p| p.iter().filter(|p| **p == chosen).count())
    };
    let first = wait_for("progress", || Some(filled()).filter(|n| *n > 100));
    wait_for("more progress", || Some(filled()).filter(|n| *n > first + 100));

    // One marker a configuration.
    let blue = rgb(egui::Color32::from_rgb(0, 114, 178).lerp_to_gamma(egui::Color32::WHITE, 0.22));
    let plot = drawer.with_max_x(drawer.right() - 300.0);
    let points = wait_for("the points", || {
        let points = spots(&desktop.look(plot)?, plot, blue);
        (filled() == 0 && points.len() >= 4).then_some(points)
    });

    // The first points that are clicked may be the picture's own, or of the resolution that is set already.
    let saved = desktop.folder.path().join("setup.toml");
    let changed = points.iter().any(|at| {
        desktop.click(*at);
        std::thread::sleep(Duration::from_millis(500));
        let _ = std::fs::remove_file(&saved);
        desktop.key("ctrl+s");
        let text =
            wait_for("the saved set-up", || std::fs::read_to_string(&saved).ok().filter(|t| t.contains("[params")));
        let (setup, _) = Setup::from_toml(&text, &saved).unwrap();
        assert_eq!((setup.technique.as_str(), setup.size), ("shadow-map", [160, 90]));
        setup.values()["resolution"] != Value::Int(1024)
    });
    assert!(changed, "none of the points at {points:?} changed the set-up");

    // The rows are in no file: the first time the window asks.
    desktop.key("ctrl+q");
    std::thread::sleep(Duration::from_secs(3));
    assert!(desktop.window.0.try_wait().unwrap().is_none(), "the rows are lost");
    desktop.key("ctrl+q");
    let status = wait_for_exit(&mut desktop.window);
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
