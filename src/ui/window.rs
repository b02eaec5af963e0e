//! The event loop's side: window, input, one pass after the other, and what actions do.

use super::canvas::Canvas;
use super::journal::{self, Due, Journal, Left, Rest};
use super::lost::{self, Lost};
use super::model::{Action, Job, Model, Sweeping, Tab};
use super::picker::Picker;
use super::pictures::Picture;
use super::stage::{AGAIN, Order, Request, Stage};
use super::sweep::SWEEP;
use super::work::{Desk, Done, Figures, Opened};
use super::{Ended, lesson, recent, shell, style, timeline};
use crate::chart::{COSTS, ERRORS};
use crate::figure::Spec;
use crate::files;
use crate::flatland::Flatland;
use crate::gallery;
use crate::gpu::{self, Failure, Gpu};
use crate::message::{self, tell};
use crate::scene::builtin;
use crate::scene::geometry::Room;
use crate::setup::Setup;
use anyhow::{Context, Result};
use egui::{ColorImage, Event, Key, Modifiers, RawInput, Rect, TextureOptions, TexturesDelta};
use glam::Vec3;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};
use winit::application::ApplicationHandler;
use winit::dpi::LogicalSize;
use winit::event::{StartCause, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoopProxy};
use winit::window::{Window, WindowId};

/// The scene that opens when none is named.
const FIRST: &str = "bench";
/// Between two passes that nobody's input asks for.
const FRAME: Duration = Duration::from_millis(16);
/// How long the camera takes to turn to a point.
const GLIDE: f32 = 0.3;

/// The application as winit drives it.
pub struct App {
    what: String,
    /// Nothing was named: the start screen comes first.
    start: bool,
    adapter: Option<String>,
    wake: EventLoopProxy<()>,
    open: Option<Open>,
    error: Option<anyhow::Error>,
}

impl App {
    pub fn new(what: Option<&str>, adapter: Option<&str>, wake: EventLoopProxy<()>) -> App {
        let start = what.is_none();
        let what = what.unwrap_or(FIRST).to_string();
        App { what, start, adapter: adapter.map(String::from), wake, open: None, error: None }
    }

    /// How it went, after the event loop has ended.
    pub fn ended(mut self) -> Result<Ended> {
        if let Some(open) = &mut self.open {
            // What ends with an error is left as it was a moment before.
            if self.error.is_none() {
                open.close_journal();
            }
            open.stage.close();
            open.desk.close();
        }
        self.error.map_or(Ok(Ended::Closed), Err)
    }
}

impl ApplicationHandler for App {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        if self.open.is_none() {
            match Open::new(event_loop, self.adapter.as_deref(), self.wake.clone()) {
                Ok(mut open) => {
                    open.start = self.start;
                    open.load(self.what.clone());
                    self.open = Some(open);
                }
                Err(e) => {
                    self.error = Some(e);
                    event_loop.exit();
                }
            }
        }
    }

    fn new_events(&mut self, _: &ActiveEventLoop, cause: StartCause) {
        if let (StartCause::ResumeTimeReached { .. }, Some(open)) = (cause, &mut self.open) {
            open.request_pass();
        }
    }

    fn user_event(&mut self, event_loop: &ActiveEventLoop, _: ()) {
        if let Some(open) = &mut self.open {
            if let Err(e) = open.take_in() {
                self.error = Some(e);
                event_loop.exit();
            }
            open.request_pass();
        }
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let Some(open) = &mut self.open else { return };
        match &event {
            WindowEvent::CloseRequested if open.model.as_mut().is_none_or(Model::may_close) => event_loop.exit(),
            WindowEvent::CloseRequested => open.window.request_redraw(),
            WindowEvent::RedrawRequested => {
                match open.redraw(event_loop) {
                    Ok(false) => return,
                    Ok(true) => {}
                    Err(e) => self.error = Some(e),
                }
                event_loop.exit();
                return;
            }
            WindowEvent::DroppedFile(path) => open.load(files::name_of(path.as_os_str())),
            _ => {}
        }
        if open.input.on_window_event(&open.window, &event).repaint {
            open.request_pass();
        }
    }

    fn exiting(&mut self, _: &ActiveEventLoop) {
        if let Some(open) = &mut self.open {
            open.window.set_visible(false);
        }
    }
}

/// A turn of the camera towards a point.
struct Glide {
    from: Vec3,
    to: Vec3,
    start: Instant,
}

/// The open window.
struct Open {
    // Dropped in this order: the surface before the device and the window.
    canvas: Canvas,
    gpu: Gpu,
    instance: wgpu::Instance,
    /// How often in a row the window's device was lost, and when last.
    losses: Option<(u32, Instant)>,
    /// The adapter that the scene is drawn on, and all that is measured beside the window.
    adapter: String,
    input: egui_winit::State,
    ctx: egui::Context,
    window: Arc<Window>,
    desk: Desk,
    stage: Stage,
    /// None until the first scene is there.
    model: Option<Model>,
    /// A world that the lab is to show once there is a model.
    world: Option<(PathBuf, Flatland)>,
    /// A sheet that the builder is to show once what it starts from is open.
    sheet: Option<(PathBuf, Box<Spec>)>,
    /// What is shown as being opened before there is a model.
    opening: String,
    /// The start screen comes first.
    start: bool,
    /// The folder that keeps which files were opened, and the one that is being opened.
    config: Option<PathBuf>,
    file: Option<String>,
    /// Keeps what is in memory alone.
    journal: Option<Journal>,
    /// What is being gone on with, by the request to load it.
    going_on: Option<(u64, Left, Box<Rest>)>,
    /// What windows that are gone have left, until there is a model.
    left: Vec<Left>,
    /// Number of the latest request to load, to measure.
    loading: u64,
    measuring: u64,
    /// The loading is of a step that was undone or redone.
    restoring: bool,
    /// What had to be saved first is saved.
    quit: bool,
    glide: Option<Glide>,
    clock: Instant,
    /// Pixels of the viewport in the last pass.
    full: [u32; 2],
    /// A pass is asked for; one that comes unasked is the window system's, which has lost what the window showed.
    asked: bool,
}

impl Open {
    fn new(event_loop: &ActiveEventLoop, adapter: Option<&str>, wake: EventLoopProxy<()>) -> Result<Open> {
        let attributes = Window::default_attributes()
            .with_title("Shadowscope")
            .with_inner_size(LogicalSize::new(1280.0, 800.0))
            .with_min_inner_size(LogicalSize::new(300.0, 200.0));
        let instance = gpu::instance();
        gpu::found(&instance)?;
        let window = Arc::new(event_loop.create_window(attributes).context("no window can be opened")?);
        let surface = instance.create_surface(window.clone()).context("the window cannot be drawn on")?;
        let gpu = Gpu::on(&instance, Some(&surface), adapter)?;
        let size = window.inner_size();
        let canvas = Canvas::new(&gpu, surface, [size.width, size.height])?;
        let ctx = egui::Context::default();
        style::apply(&ctx);
        let limit = gpu.device.limits().max_texture_dimension_2d as usize;
        let scale = window.scale_factor() as f32;
        let input =
            egui_winit::State::new(ctx.clone(), egui::ViewportId::ROOT, &window, Some(scale), None, Some(limit));
        let desk = Desk::new(move || {
            // Fails only when the window has closed.
            let _ = wake.send_event(());
        });
        let journals = journal::folder();
        if let Some(folder) = &journals {
            desk.find_left(folder.clone());
        }
        Ok(Open {
            canvas,
            stage: Stage::start(desk.post(), gpu.info.name.clone(), gpu.software()),
            adapter: gpu.info.name.clone(),
            gpu,
            instance,
            losses: None,
            input,
            ctx,
            window,
            desk,
            model: None,
            world: None,
            sheet: None,
            opening: String::new(),
            start: false,
            config: recent::folder(),
            file: None,
            journal: journals.map(Journal::new),
            going_on: None,
            left: Vec::new(),
            loading: 0,
            measuring: 0,
            restoring: false,
            quit: false,
            glide: None,
            clock: Instant::now(),
            full: [0; 2],
            asked: false,
        })
    }

    fn request_pass(&mut self) {
        self.asked = true;
        self.window.request_redraw();
    }

    /// Starts to open something; what is open stays until it is there.
    fn load(&mut self, what: String) {
        let path = files::path_of(&what);
        let rows = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("csv") || e.eq_ignore_ascii_case("json"));
        if rows && self.model.is_some() {
            self.desk.read_rows(path);
            return;
        }
        self.loading += 1;
        self.restoring = false;
        self.file = (!builtin::is_builtin(&what)).then(|| what.clone());
        let name = path.file_name().map_or(what.clone(), |n| message::shortened(&n.to_string_lossy()));
        let technique = self.model.as_ref().map(|m| m.setup.technique.clone());
        self.desk.open(self.loading, what, technique, Room::of(&self.gpu));
        self.say_loading(name);
    }

    /// What loads now takes the place of what did.
    fn begin_loading(&mut self) {
        self.loading += 1;
        self.restoring = false;
        self.file = None;
    }

    fn say_loading(&mut self, name: String) {
        match &mut self.model {
            Some(m) => m.loading = Some(name),
            None => self.opening = name,
        }
        self.request_pass();
    }

    /// Takes in what the threads have done.
    ///
    /// # Errors
    /// What was named at the start cannot be opened or drawn.
    fn take_in(&mut self) -> Result<()> {
        while let Some(done) = self.desk.take() {
            match done {
                Done::Loaded(job, Ok(loaded)) if job == self.loading => {
                    if self.stage.ended() {
                        let software = self.model.as_ref().map_or(self.gpu.software(), |m| m.facts.software);
                        self.stage = Stage::start(self.desk.post(), self.adapter.clone(), software);
                    }
                    let mut loaded = loaded;
                    match &self.model {
                        Some(m) if loaded.bare => m.carry(&mut loaded.setup),
                        None if loaded.bare => timeline::begin(&mut loaded.setup),
                        _ => {}
                    }
                    self.stage.ask(Request::Load(job, loaded));
                    continue;
                }
                Done::Loaded(job, Err(e)) if job == self.loading => {
                    self.opened(Err(e))?;
                    continue;
                }
                Done::World(job, path, world) if job == self.loading => {
                    let shown = self.model.is_some() && world.is_ok();
                    match (&mut self.model, world) {
                        (Some(m), Ok(world)) => {
                            m.loading = None;
                            m.notes.retain(|n| !n.opening);
                            m.show_world(&path, world);
                        }
                        (Some(m), Err(e)) => {
                            m.loading = None;
                            m.fail_to_open(&e);
                        }
                        // Behind the lab stands the scene that opens when none is named.
                        (None, world) => {
                            self.world = Some((path, world?));
                            self.load(FIRST.into());
                        }
                    }
                    if shown {
                        self.remember();
                    }
                    continue;
                }
                Done::Built(job, path, spec) if job == self.loading => {
                    self.sheet = Some((path, spec));
                    continue;
                }
                Done::Opened(job, opened) if job == self.loading => {
                    self.opened(opened)?;
                    continue;
                }
                Done::Broken(e) | Done::Lost(e, _) if self.model.is_none() => return Err(e),
                Done::Left(left) => {
                    self.found_left(left);
                    continue;
                }
                Done::WentOn(job, left, rest) => {
                    match (&mut self.model, rest) {
                        (_, Some(rest)) => self.going_on = Some((job, left, rest)),
                        (Some(m), None) => m.start.left.insert(0, left),
                        (None, None) => {}
                    }
                    continue;
                }
                Done::Journaled(done) => {
                    let failed = self.journal.as_mut().and_then(|journal| journal.written(done));
                    if let (Some(m), Some(e)) = (&mut self.model, failed) {
                        m.fail(&e);
                    }
                    continue;
                }
                _ => {}
            }
            let Some(m) = &mut self.model else { continue };
            match done {
                // Of something that is no longer wanted.
                Done::Loaded(..) | Done::World(..) | Done::Opened(..) | Done::Built(..) => {}
                Done::Left(..) | Done::WentOn(..) | Done::Journaled(..) => {}
                Done::Drawn(facts, picture) => {
                    m.facts = *facts;
                    if let Some(picture) = picture {
                        m.inspect.magnifier.picture = Some(self.canvas.take(&self.gpu, picture));
                        m.reading = None;
                        m.shot = None;
                    }
                }
                Done::Shot(side, pass, shot) => {
                    let Some(seen) = m.shot.as_mut().filter(|s| (s.side, s.pass) == (side, pass)) else { continue };
                    match shot {
                        Ok(Some(shot)) => {
                            let image = ColorImage::from_rgba_unmultiplied(shot.size.map(|s| s as usize), &shot.rgba);
                            let [w, h] = shot.whole;
                            let range =
                                shot.range.map_or(String::new(), |[low, high]| format!(", {low:.4} to {high:.4}"));
                            let layers =
                                if shot.layers > 1 { format!(", {} layers", shot.layers) } else { String::new() };
                            seen.told = format!("{w} × {h}{layers}{range}");
                            seen.picture = Picture::Drawn(self.ctx.load_texture("shot", image, TextureOptions::LINEAR));
                        }
                        Ok(None) => {
                            seen.picture =
                                Picture::Failed("Nothing to show: this pass writes lists or single numbers, or is not run again while the picture rests.".into());
                        }
                        Err(e) => seen.picture = Picture::Failed(message::sentence(&e)),
                    }
                }
                Done::Value(at, Ok(text)) => {
                    if let Some(reading) = m.reading.as_mut().filter(|r| r.at == at) {
                        reading.text = text;
                    }
                }
                Done::Point(Ok(Some(to))) if to.distance(m.setup.camera.position) > m.setup.camera.near => {
                    self.glide = Some(Glide { from: m.setup.camera.target, to, start: Instant::now() });
                }
                Done::Point(Ok(_)) => {}
                Done::Plane(Ok(Some(plane))) => m.give_plane(&plane),
                Done::Plane(Ok(None)) => m.say("There is no surface whose plane could be picked."),
                Done::Map(map) => match *map {
                    Some(map) if m.maps.wanted().is_some() => m.maps.take(map),
                    _ => m.maps.forget(),
                },
                Done::Reloaded(Ok(())) => {
                    m.notes.retain(|n| !n.error);
                    m.say("Shaders reloaded.");
                }
                Done::Value(_, Err(e)) | Done::Point(Err(e)) | Done::Plane(Err(e)) => m.fail(&e),
                Done::Reloaded(Err(e)) => {
                    m.notes.retain(|n| n.code.is_none());
                    m.stop(&e);
                }
                Done::Reopened(e) => m.reopened(&e),
                Done::Lost(e, adapters) => m.lose(Lost { why: lost::why(&e), adapters }),
                Done::Failed(e) => m.stop(&e),
                Done::Broken(e) => {
                    m.loading = None;
                    m.stop(&e);
                }
                Done::Progress(job, done, what) => {
                    if let Some(running) = m.measuring.as_mut().filter(|_| job == self.measuring) {
                        running.done = done;
                        running.what = what;
                    }
                }
                // What is measured stays, also of work that was cancelled.
                Done::Row(row) => {
                    if let Some(running) = &mut m.measuring {
                        running.rows += 1;
                    }
                    m.swept(&row);
                    m.adopt([*row]);
                }
                Done::Measured(job, result) if job == self.measuring => {
                    if let (Some(ended), Ok(())) = (m.measuring.take(), &result) {
                        m.chart.range.learn(&m.setup, &ended);
                        m.sweeping = m.sweeping.take().filter(|_| ended.title != SWEEP);
                    }
                    if let Err(e) = result {
                        m.fail(&e.context("measuring failed"));
                    }
                }
                Done::Stability(job, result) if job == self.measuring => {
                    m.measuring = None;
                    match result {
                        Ok(found) => {
                            m.timeline.found = Some(found);
                            m.unsaved(Tab::Stability);
                        }
                        Err(e) => m.fail(&e.context("the stability run failed")),
                    }
                }
                Done::Advised(job, result) if job == self.measuring => {
                    m.measuring = None;
                    match result {
                        Ok(found) => {
                            m.advice.found = Some(*found);
                            m.unsaved(Tab::Advice);
                        }
                        Err(e) => m.fail(&e.context("no advice can be given")),
                    }
                }
                Done::Animated(job, result) if job == self.measuring => {
                    m.measuring = None;
                    match result {
                        Ok((path, notes)) => {
                            m.say(saved(&path));
                            notes.into_iter().for_each(|note| m.say(note));
                        }
                        Err(e) => m.fail(&e),
                    }
                }
                Done::Story(told) => match told {
                    Ok(story) => (m.inspect.story, m.inspect.failed) = (Some(story), None),
                    Err(e) => (m.inspect.story, m.inspect.failed) = (None, Some(message::sentence(&e))),
                },
                Done::Tried(job, Ok(errors)) => m.end_try(job, Some(errors)),
                Done::Tried(job, Err(e)) => {
                    let wanted = m.inspect.trying.as_ref().is_some_and(|t| t.job == job) && job == self.measuring;
                    m.end_try(job, None);
                    if wanted {
                        m.fail(&e.context("the change could not be measured"));
                    }
                }
                Done::Sheet(job, result) if job == self.measuring => {
                    m.measuring = None;
                    match result {
                        Ok(done) => {
                            let (sheet, image, written) = *done;
                            let texture = self.ctx.load_texture("sheet", image, TextureOptions::LINEAR);
                            m.builder.preview = Some(Picture::Drawn(texture));
                            sheet.notes.iter().for_each(|note| m.say(note.clone()));
                            m.builder.drawn = Some(sheet);
                            written.first().into_iter().for_each(|path| m.say(wrote(path, written.len())));
                        }
                        Err(e) => {
                            let e = e.context("the figure cannot be drawn");
                            if matches!(m.builder.preview, Some(Picture::Waiting)) {
                                m.builder.preview = Some(Picture::Failed(message::sentence(&e)));
                            }
                            m.fail(&e);
                        }
                    }
                }
                Done::Measured(..) | Done::Stability(..) | Done::Advised(..) => {}
                Done::Animated(..) | Done::Sheet(..) => {}
                Done::Saved(tab, Ok(path)) => {
                    let numbers = path.extension().is_some_and(|e| e == "csv" || e == "json");
                    m.unsaved.retain(|t| *t != tab || !numbers);
                    self.quit |= m.closing && m.unsaved.is_empty();
                    m.say(saved(&path));
                }
                Done::Saved(_, Err(e)) => m.fail(&e),
                Done::Read(_, Err(e)) => m.fail_to_open(&e),
                Done::Read(path, Ok(rows)) => {
                    m.notes.retain(|n| !n.opening);
                    m.say(format!("{} rows of {} are in the chart.", rows.len(), path.display()));
                    let unsaved = m.unsaved.clone();
                    m.adopt(rows);
                    m.unsaved = unsaved;
                    m.start.shown = false;
                    m.drawer = Some(Tab::Chart);
                }
                Done::Pictured(subject, drawn) => {
                    let drawn = match drawn {
                        Ok(image) => Picture::Drawn(self.ctx.load_texture("small", image, TextureOptions::LINEAR)),
                        Err(e) => Picture::Failed(message::sentence(&e)),
                    };
                    m.pictures.take(subject, drawn);
                }
                Done::Answered(job, result) if job == self.measuring => {
                    m.measuring = None;
                    match (result, &mut m.lesson) {
                        // Another step has not asked.
                        (Ok(answer), Some(lesson)) if lesson.asked => lesson.answer = Some(*answer),
                        (Ok(_), _) => {}
                        (Err(e), _) => m.fail(&e.context("the answer could not be measured")),
                    }
                }
                Done::Answered(..) => {}
                Done::Recent(files) => m.start.recent = Some(files.map_err(|e| message::sentence(&e))),
                Done::Captured(result) => {
                    m.capturing = false;
                    match result {
                        Ok((path, notes)) => {
                            m.say(saved(&path));
                            notes.into_iter().for_each(|note| m.say(note));
                        }
                        Err(e) => m.fail(&e),
                    }
                }
                Done::Counted(row) => m.chart.live(*row),
                Done::NoDialog(save) => {
                    let at = if save { &m.picture_path } else { &m.setup.scene };
                    m.picker = Some(Picker::new(save, Path::new(at), m.folder.clone()));
                }
                Done::PickedFile(path) => self.load(files::name_of(path.as_os_str())),
                Done::PickedCapture(path) => {
                    m.picture_path = path.to_string_lossy().into_owned();
                    self.act(Action::Capture(path));
                }
            }
        }
        Ok(())
    }

    fn opened(&mut self, opened: Result<Box<Opened>>) -> Result<()> {
        let Some(m) = &mut self.model else {
            let (setup, scene, bounds) = *opened?;
            let model = self.model.insert(Model::new(setup, scene, bounds));
            let left = std::mem::take(&mut self.left);
            if let Some((path, world)) = self.world.take() {
                model.show_world(&path, world);
            }
            model.start.shown = std::mem::take(&mut self.start);
            offer(model, left);
            if let Some((path, spec)) = self.sheet.take() {
                model.build(&path, *spec);
            }
            self.remember();
            return Ok(());
        };
        m.loading = None;
        let restored = std::mem::take(&mut self.restoring);
        let going_on = self.going_on.take();
        let (going_on, stale) = match going_on {
            Some((job, left, rest)) if job == self.loading && opened.is_ok() => (Some((left, rest)), None),
            other => (None, other.map(|(_, left, _)| left)),
        };
        m.start.left.extend(stale);
        match opened.map(|o| *o) {
            Ok((setup, scene, bounds)) => {
                match m.awaits(&setup) {
                    // Who has gone back to the start screen meanwhile stays there.
                    true => m.arrive(setup, scene, bounds),
                    false => {
                        m.open(setup, scene, bounds, restored);
                        m.start.shown = false;
                    }
                }
                m.lab.shown = false;
                if let Some((left, rest)) = going_on {
                    rest.give(m);
                    if let Some(journal) = &mut self.journal {
                        journal.take(left);
                    }
                }
                if let Some((path, spec)) = self.sheet.take() {
                    m.build(&path, *spec);
                }
                self.glide = None;
                self.remember();
            }
            Err(e) => {
                self.sheet = None;
                if restored {
                    m.keep_history();
                }
                m.fail_to_open(&e);
            }
        }
        Ok(())
    }

    /// Keeps the file that was opened among the recent ones.
    fn remember(&mut self) {
        if let (Some(folder), Some(name)) = (&self.config, self.file.take()) {
            self.desk.remember(folder.clone(), Some(name));
        }
    }

    /// Runs one pass. True: the window is to close.
    ///
    /// # Errors
    /// No device to draw the window with any more.
    fn redraw(&mut self, event_loop: &ActiveEventLoop) -> Result<bool> {
        let size = self.window.inner_size();
        if size.width == 0 || size.height == 0 {
            event_loop.set_control_flow(ControlFlow::Wait);
            return Ok(false);
        }
        let start = Instant::now();
        self.canvas.resize([size.width, size.height]);
        if !std::mem::take(&mut self.asked) {
            self.canvas.expose();
        }
        let raw = self.input.take_egui_input(&self.window);
        if raw.events.iter().any(loses_devices) {
            self.gpu.device.destroy();
            self.stage.ask(Request::Lose);
        }
        let mut actions = Vec::new();
        let mut rect = Rect::NOTHING;
        let (ctx, mut delta, mut output) = (self.ctx.clone(), TexturesDelta::default(), egui::FullOutput::default());
        for part in parts(raw) {
            output = ctx.run_ui(part, |ui| match &mut self.model {
                Some(m) => rect = shell::layout(ui, m, &mut actions),
                None => shell::opening(ui, &self.opening),
            });
            self.input.handle_platform_output(&self.window, std::mem::take(&mut output.platform_output));
            delta.append(std::mem::take(&mut output.textures_delta));
        }
        let quit = self.quit || actions.contains(&Action::Quit);
        for action in actions {
            self.act(action);
        }
        self.tick();

        let scale = output.pixels_per_point;
        let viewport = if rect.is_positive() { (rect * scale).round() } else { Rect::ZERO };
        // Behind a map that takes its place the picture goes on, at the size it had.
        let full = [viewport.width() as u32, viewport.height() as u32];
        // The answer first: on software the scene's thread takes the same cores.
        let presented = self.canvas.show(&self.gpu, &ctx, output.shapes, delta, viewport, scale);
        self.order(if full.contains(&0) { self.full } else { full });
        match self.gpu.check() {
            Err(why) if Failure::is_loss(&why) => self.reopen(why)?,
            Err(e) => self.model.iter_mut().for_each(|m| m.fail(&e)),
            Ok(()) if self.canvas.wants_surface() => {
                let surface = self.instance.create_surface(self.window.clone());
                self.canvas.give(surface.context("the window can no longer be drawn on")?);
            }
            Ok(()) => {}
        }

        let root = output.viewport_output.get(&egui::ViewportId::ROOT);
        let mut wait = root.map_or(Duration::MAX, |v| v.repaint_delay);
        if let Some(later) = self.keep() {
            wait = wait.min(later);
        }
        if self.glide.is_some() || self.model.as_ref().is_some_and(|m| m.moving() && m.measuring.is_none()) {
            wait = Duration::ZERO;
        }
        if !presented {
            wait = wait.min(Duration::from_millis(200));
        }
        // What was changed after the layout shows in the next.
        if wait < FRAME {
            wait = FRAME.saturating_sub(start.elapsed());
        }
        if wait.is_zero() {
            self.request_pass();
        }
        event_loop.set_control_flow(match Instant::now().checked_add(wait) {
            Some(at) if !wait.is_zero() && wait < Duration::from_secs(3600) => ControlFlow::WaitUntil(at),
            _ => ControlFlow::Wait,
        });
        Ok(quit)
    }

    /// Opens the window's device anew, which the driver has dropped; where it does so again and again, that of another adapter.
    ///
    /// # Errors
    /// That has been tried.
    fn reopen(&mut self, why: anyhow::Error) -> Result<()> {
        let recent = self.losses.filter(|(_, at)| at.elapsed() < AGAIN).map_or(0, |(times, _)| times);
        self.losses = Some((recent + 1, Instant::now()));
        let instance = gpu::instance();
        let surface = instance.create_surface(self.window.clone()).context("the window can no longer be drawn on")?;
        let own = &self.gpu.info.name;
        // The last one is software, if there is any.
        let able = |a: &&wgpu::Adapter| a.is_surface_supported(&surface) && a.get_info().name != *own;
        let name = match recent {
            0 => own.clone(),
            1 => gpu::found(&instance)?.iter().rfind(able).map_or(own.clone(), |a| a.get_info().name),
            _ => return Err(why),
        };
        let gpu = Gpu::on(&instance, Some(&surface), Some(&name))?;
        let size = self.window.inner_size();
        let canvas = Canvas::new(&gpu, surface, [size.width, size.height])?;
        let before = std::mem::replace(&mut self.canvas, canvas);
        self.canvas.take_over(&gpu, before);
        (self.gpu, self.instance) = (gpu, instance);
        self.model.iter_mut().for_each(|m| m.reopened(&why));
        self.request_pass();
        Ok(())
    }

    /// Has the journal written where something has changed; when it is to be looked at again.
    fn keep(&mut self) -> Option<Duration> {
        match self.journal.as_mut()?.due(self.model.as_ref()?) {
            Due::Nothing => None,
            Due::Later(wait) => Some(wait),
            Due::Write(write) => {
                self.desk.start(move |post| post.send(Done::Journaled(write())));
                None
            }
        }
    }

    /// Takes in what windows that are gone have left.
    fn found_left(&mut self, left: Vec<Left>) {
        match &mut self.model {
            Some(m) => offer(m, left),
            None => self.left.extend(left),
        }
    }

    /// The window is being closed.
    fn close_journal(&mut self) {
        if let (Some(journal), Some(m)) = (&mut self.journal, &mut self.model) {
            let mut older = std::mem::take(&mut m.start.left);
            if let Err(e) = journal.close(m, &mut older) {
                tell!("shadowscope: what was open is not kept for the next time: {}", message::sentence(&e));
            }
        }
    }

    /// Orders the picture that the model describes, for a viewport of `full` pixels.
    fn order(&mut self, full: [u32; 2]) {
        // In the lab and on the start screen there is no picture.
        let Some(m) = self.model.as_mut().filter(|m| !m.lab.shown && !m.start.shown) else { return };
        let held = self
            .ctx
            .input(|i| i.pointer.any_down() || !i.keys_down.is_empty() || i.smooth_scroll_delta != egui::Vec2::ZERO);
        let resized = std::mem::replace(&mut self.full, full) != full;
        let number = self.stage.order(Order {
            number: 0,
            // Only files let through what lies behind them.
            setup: Setup { transparent: false, ..m.setup.clone() },
            scene: m.scene.clone(),
            full,
            moving: held || resized || self.glide.is_some() || m.moving(),
            follow: m.drawer == Some(Tab::Chart),
            paused: m.measuring.is_some(),
            map: m.maps.wanted(),
            story: m.inspected(),
        });
        if std::mem::replace(&mut m.order, number) != number {
            m.ordered = Instant::now();
        }
    }

    /// Lets the clock run, and the camera turn; camera and light keep to places that a file can hold.
    fn tick(&mut self) {
        let seconds = self.clock.elapsed().as_secs_f32().min(0.5);
        self.clock = Instant::now();
        let Some(m) = &mut self.model else { return };
        if m.measuring.is_none() {
            m.advance(seconds);
        }
        if let Some(g) = &self.glide {
            let t = (g.start.elapsed().as_secs_f32() / GLIDE).min(1.0);
            m.setup.camera.target = g.from.lerp(g.to, t * t * (3.0 - 2.0 * t));
            if t >= 1.0 {
                self.glide = None;
            }
        }
        m.setup.count_from(m.scene.origin);
    }

    /// Begins a measurement: its number, and the adapter to use.
    fn job(&mut self, title: &'static str) -> (u64, String) {
        self.measuring += 1;
        if let Some(m) = &mut self.model {
            m.measuring = Some(Job::new(title));
            m.playing = false;
            m.timeline.playing = false;
        }
        (self.measuring, self.adapter.clone())
    }

    /// Captures a set-up to a file, unless a capture is under way.
    fn capture(&mut self, setup: Setup, whole: Option<[u32; 2]>, path: PathBuf) {
        let Some(m) = self.model.as_mut().filter(|m| !m.capturing) else { return };
        m.capturing = true;
        self.desk.capture(self.adapter.clone(), m.scene.clone(), setup, whole, path);
    }

    fn act(&mut self, action: Action) {
        let Some(m) = &mut self.model else { return };
        let scene = m.scene.clone();
        match action {
            Action::Open(what) => self.load(what),
            Action::Restore(setup) => {
                self.loading += 1;
                self.restoring = true;
                let name = setup.scene.clone();
                self.desk.restore(self.loading, *setup, Room::of(&self.gpu));
                self.say_loading(name);
            }
            Action::CancelLoading => {
                self.loading += 1;
                m.loading = None;
                if std::mem::take(&mut self.restoring) {
                    m.keep_history();
                }
            }
            Action::Step => {
                let Some(plan) = m.lesson.as_ref().map(|r| r.lesson.steps[r.step].scene.clone()) else { return };
                let name = plan.scene();
                self.begin_loading();
                self.desk.prepare(self.loading, move || plan.open(), Room::of(&self.gpu));
                self.say_loading(name);
            }
            Action::Exhibit(id) => {
                let Some(exhibit) = gallery::find(id) else { return };
                self.begin_loading();
                self.desk.prepare(self.loading, move || exhibit.open(), Room::of(&self.gpu));
                self.say_loading(exhibit.title.clone());
            }
            Action::Answer => {
                let own = m.own_of_step();
                let Some((lesson, step)) = m.lesson.as_ref().map(|r| (r.lesson, r.step)) else { return };
                let (job, adapter) = self.job(lesson::ANSWER);
                self.desk.answer(job, adapter, scene, (lesson, step, own));
            }
            Action::LookUpRecent => {
                if let Some(folder) = &self.config {
                    self.desk.remember(folder.clone(), None);
                }
            }
            Action::GoOn(i) if i < m.start.left.len() => {
                let left = m.start.left.remove(i);
                self.begin_loading();
                let name = left.title.clone();
                self.desk.go_on(self.loading, left, Room::of(&self.gpu));
                self.say_loading(name);
            }
            Action::Forget(i) if i < m.start.left.len() => m.start.left.remove(i).forget(),
            Action::GoOn(_) | Action::Forget(_) => {}
            Action::PickFile => self.desk.pick_file(),
            Action::PickCapture => self.desk.pick_capture(),
            Action::Measure => {
                let setup = m.setup.side(m.side()).measured();
                let (job, adapter) = self.job("Measuring");
                self.desk.measure(job, adapter, scene, setup.clone(), vec![setup]);
            }
            Action::Sweep(setups) => {
                let base = m.setup.measured();
                m.sweeping = Some(Sweeping { base: base.clone(), of: setups.len(), left: setups.clone() });
                let (job, adapter) = self.job(SWEEP);
                self.desk.measure(job, adapter, scene, base, setups);
            }
            Action::GoOnSweeping => {
                let Some(Sweeping { base, left, .. }) = m.sweeping.clone() else { return };
                let (job, adapter) = self.job(SWEEP);
                self.desk.measure(job, adapter, scene, base, left);
            }
            Action::Stability(case, run) => {
                let setup = m.setup.measured();
                let (job, adapter) = self.job("Stability");
                self.desk.stability(job, adapter, scene, setup, (case, run));
            }
            Action::Advise(budget, techniques) => {
                let setup = m.setup.measured();
                let (job, adapter) = self.job("Advice");
                self.desk.advise(job, adapter, scene, setup, (budget, techniques));
            }
            Action::Sheet(spec, to) => {
                let held = m.builder.drawn.clone();
                if held.as_ref().is_none_or(|held| held.spec != *spec) {
                    m.builder.preview = m.builder.preview.take().or(Some(Picture::Waiting));
                }
                let (job, adapter) = self.job("Figure");
                self.desk.sheet(job, adapter, *spec, held, to);
            }
            Action::Export(tab, path) => {
                let axes = [&COSTS[m.chart.cost], &ERRORS[m.chart.error]];
                let figures = match tab {
                    Tab::Chart => Some(Figures::Rows(m.rows.clone(), axes)),
                    Tab::Advice => m.advice.exported().map(|(rows, axes)| Figures::Rows(rows, axes)),
                    Tab::Stability => m.timeline.found.clone().map(|f| Figures::Path(f, m.timeline.figure)),
                    Tab::Pixel => None,
                    // It has formats of its own.
                    Tab::Figure => None,
                };
                if let Some(figures) = figures {
                    self.desk.export(tab, figures, path);
                }
            }
            Action::Thumbnail(subject) => {
                let open = (m.setup.scene.clone(), scene);
                self.desk.picture(self.adapter.clone(), subject, open);
            }
            Action::Animate(sequence, path) => {
                let setup = m.setup.clone();
                let (job, adapter) = self.job("Animation");
                self.desk.animate(job, adapter, scene, setup, (sequence, path));
            }
            Action::CancelMeasuring => {
                if matches!(m.builder.preview, Some(Picture::Waiting)) {
                    m.builder.preview = None;
                }
                self.desk.cancel_measuring();
                self.measuring += 1;
                m.measuring = None;
            }
            Action::Try(remedy) => {
                self.measuring += 1;
                let (job, place) = (self.measuring, m.setup.probe);
                let setups = m.begin_try(job, remedy);
                self.desk.tried(job, self.adapter.clone(), scene, setups, (self.full, place));
            }
            Action::CancelTrying => {
                self.desk.cancel_measuring();
                self.measuring += 1;
                m.inspect.trying = None;
            }
            Action::Capture(path) => {
                let (setup, whole) = (m.setup.clone(), m.whole_file(&path));
                self.capture(setup, whole, path);
            }
            Action::Figure(path) => {
                let setup = m.setup.clone();
                self.capture(setup, Some(FIGURE), path);
            }
            Action::SaveSetup(path) => match save(m, &path) {
                Ok(()) => m.say(saved(&path)),
                Err(e) => m.fail(&e),
            },
            Action::SaveWorld(path) => match m.lab.save(&path) {
                Ok(()) => m.say(saved(&path)),
                Err(e) => m.fail(&e),
            },
            Action::Focus(at) => self.stage.ask(Request::Point(at)),
            Action::PickPlane(at) => self.stage.ask(Request::Plane(at)),
            Action::Read(at) => self.stage.ask(Request::Value(at)),
            Action::Shot(side, pass) => self.stage.ask(Request::Shot(side, pass)),
            Action::Adapter(name) => {
                m.lost = None;
                self.adapter = name.clone();
                self.stage.ask(Request::Adapter(name));
            }
            Action::Quit => {}
        }
    }
}

/// The keys that lose the devices on purpose, as drivers do of themselves: Ctrl+Shift+Alt+F12.
fn loses_devices(event: &Event) -> bool {
    let all = Modifiers { alt: true, shift: true, ..Modifiers::CTRL };
    matches!(event, Event::Key { key: Key::F12, pressed: true, modifiers, .. } if modifiers.matches_exact(all))
}

/// Offers what windows that are gone have left. Who has named a file sees no start screen, and is told.
fn offer(m: &mut Model, left: Vec<Left>) {
    if !m.start.shown && left.iter().any(|left| !left.closed) {
        m.say("The program ended unexpectedly; what was open then is on the start screen (F8).");
    }
    m.start.left.extend(left);
}

/// Size of a figure's file, pixels.
const FIGURE: [u32; 2] = [1920, 1080];

/// Cuts what has come in behind each press and release: egui tests all that a pass is given at the last place of the
/// pointer. Behind a click or a key comes a part without events: what it has changed shows only in the next pass.
fn parts(raw: RawInput) -> Vec<RawInput> {
    let cut = |e: &Event| matches!(e, Event::PointerButton { .. });
    let done = |e: &Event| matches!(e, Event::PointerButton { pressed: false, .. } | Event::Key { pressed: true, .. });
    let mut events: Vec<Vec<Event>> = raw.events.split_inclusive(cut).map(<[Event]>::to_vec).collect();
    if events.last().is_none_or(|last| last.iter().any(done)) {
        events.push(Vec::new());
    }
    let mut first = Some(raw);
    let mut rest = None;
    let part = |events| {
        let raw = first.take().or_else(|| rest.clone()).unwrap_or_default();
        // Files are dropped once.
        rest.get_or_insert_with(|| RawInput { events: Vec::new(), dropped_files: Vec::new(), ..raw.clone() });
        RawInput { events, ..raw }
    };
    events.into_iter().map(part).collect()
}

/// Says where a sheet's files have been written.
fn wrote(first: &Path, files: usize) -> String {
    match files {
        1 => saved(first),
        n => format!("{} The other {} are beside it.", saved(first), n - 1),
    }
}

/// Says where a file has been written.
fn saved(path: &Path) -> String {
    let whole = std::path::absolute(path).unwrap_or(path.to_path_buf());
    match (whole.file_name(), whole.parent()) {
        (Some(name), Some(folder)) => format!("Saved {} in {}.", name.display(), folder.display()),
        _ => format!("Saved {}.", whole.display()),
    }
}

/// Writes the set-up as TOML.
fn save(m: &Model, path: &Path) -> Result<()> {
    files::save(path, m.setup.to_toml(path)?.as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui::{PointerButton, pos2};

    /// A press, a way and a release that come in together are seen one after the other.
    #[test]
    fn input_is_cut_behind_each_press_and_release() {
        let at = |x: f32| Event::PointerMoved(pos2(x, 0.0));
        let button = |pressed| Event::PointerButton {
            pos: pos2(1.0, 0.0),
            button: PointerButton::Primary,
            pressed,
            modifiers: Modifiers::NONE,
        };
        let events = vec![at(1.0), button(true), at(2.0), button(false), at(3.0), Event::Copy];
        let raw = RawInput { events, time: Some(7.0), ..Default::default() };
        let cut = parts(raw);
        let events: Vec<&[Event]> = cut.iter().map(|r| &r.events[..]).collect();
        let whole = [&[at(1.0), button(true)][..], &[at(2.0), button(false)], &[at(3.0), Event::Copy]];
        assert_eq!(events, whole);
        assert!(cut.iter().all(|r| r.time == Some(7.0)));
        assert_eq!(parts(RawInput::default()).len(), 1, "a pass without input is a pass");
        let click = parts(RawInput { events: vec![button(true), button(false)], ..Default::default() });
        assert_eq!(click.len(), 3, "what a click changes is seen in a pass behind it");
        assert!(click[2].events.is_empty());
    }
}
