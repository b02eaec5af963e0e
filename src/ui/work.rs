//! Work beside the window: loading, measuring, capturing, file dialogs. Each on a thread of its own.

use super::journal::{self, Left, Rest};
use super::model::{Facts, Tab};
use super::pictures::{self, Subject};
use super::recent::{self, Recent};
use super::stage::Picture;
use super::{picker, timeline};
use crate::chart::{self, Axis};
use crate::figure::{self, Format, Sheet, Spec};
use crate::files;
use crate::flatland::{self, Flatland};
use crate::frame::{Ask, MapLayer, Renderer, Shot, Truth};
use crate::gallery;
use crate::gpu::Gpu;
use crate::lessons::{self, Answer, Lesson};
use crate::map::fit::lixel::Plane;
use crate::measure::advise::{self, Advice, Budget};
use crate::measure::diagnosis::{self, Errors};
use crate::measure::stability::{self, Run, Stability};
use crate::measure::story::Story;
use crate::measure::{self, Figure, More, Record, Step};
use crate::path::Route;
use crate::scene::Scene;
use crate::scene::builtin::cases;
use crate::scene::geometry::{Geometry, Room};
use crate::sequence::{self, Sequence};
use crate::setup::{self, Setup};
use crate::{capture, techniques};
use anyhow::{Context, Result, bail, ensure};
use egui::ColorImage;
use glam::Vec3;
use std::cell::Cell;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// A set-up with its scene, ready to be drawn.
pub struct Loaded {
    pub setup: Setup,
    pub scene: Arc<Scene>,
    pub geometry: Geometry,
    /// A scene was named, not a set-up: all that is no part of a scene may stay as it is.
    pub bare: bool,
}

/// A sheet, its picture for the window, and the files that it was written into.
pub type SheetDone = (Arc<Sheet>, ColorImage, Vec<PathBuf>);

/// A set-up, its scene, and that scene's lowest and highest corner.
pub type Opened = (Setup, Arc<Scene>, [Vec3; 2]);

/// What a thread has done. Numbers tell which request it answers.
pub enum Done {
    /// A scene is read and built, and ready for the device.
    Loaded(u64, Result<Box<Loaded>>),
    /// What was to be opened is a world of flatland.
    World(u64, PathBuf, Result<Flatland>),
    /// It can be drawn.
    Opened(u64, Result<Box<Opened>>),
    /// What the scene's thread knows now, with a new picture if there is one.
    Drawn(Box<Facts>, Option<Picture>),
    /// The value under a place of the viewport, in words.
    Value([f32; 2], Result<Option<String>>),
    /// The surface there.
    Point(Result<Option<Vec3>>),
    /// Its plane.
    Plane(Result<Option<Plane>>),
    /// What a pass wrote for a side; None: no texture.
    Shot(usize, &'static str, Result<Option<Shot>>),
    Reloaded(Result<()>),
    /// The map that the viewer shows; None: the technique has none.
    Map(Box<Option<MapLayer>>),
    /// The scene's device was lost, and why; it was opened anew.
    Reopened(anyhow::Error),
    /// It was lost again, or cannot be opened anew; the adapters that there are.
    Lost(anyhow::Error, Vec<String>),
    /// The scene's thread goes on; it has ended.
    Failed(anyhow::Error),
    Broken(anyhow::Error),
    /// Share done, and what it is at.
    Progress(u64, f32, String),
    Row(Box<Record>),
    Measured(u64, Result<()>),
    Stability(u64, Result<Stability>),
    Advised(u64, Result<Box<(Budget, Advice)>>),
    /// Of the pixel that is inspected.
    Story(Result<Box<Story>>),
    /// The errors before and after a change.
    Tried(u64, Result<[Errors; 2]>),
    /// A sheet, its picture and the files that it was written into.
    Sheet(u64, Result<Box<SheetDone>>),
    /// What is being opened is a sheet or a sheet's spec, of this file.
    Built(u64, PathBuf, Box<Spec>),
    /// The file, and what its picture shows wrong.
    Captured(Result<(PathBuf, Vec<String>)>),
    /// The file of an animation, or of its first frame, and what its pictures show wrong.
    Animated(u64, Result<(PathBuf, Vec<String>)>),
    Saved(Tab, Result<PathBuf>),
    Read(PathBuf, Result<Vec<Record>>),
    /// The answer to a lesson's question.
    Answered(u64, Result<Box<Answer>>),
    /// The files opened last.
    Recent(Result<Vec<Recent>>),
    /// What windows that are gone have left; and of one that is gone on with the rest, if its set-up can be opened.
    Left(Vec<Left>),
    WentOn(u64, Left, Option<Box<Rest>>),
    /// What is open stands in the journal now; how long that took.
    Journaled(Result<Duration>),
    /// A small picture.
    Pictured(Subject, Result<ColorImage>),
    /// The errors of the picture.
    Counted(Box<Record>),
    PickedFile(PathBuf),
    PickedCapture(PathBuf),
    /// The system has no file dialog; whether it was to save a picture.
    NoDialog(bool),
}

/// Where threads hand in what they have done.
#[derive(Clone)]
pub struct Post {
    sender: Sender<Done>,
    wake: Arc<dyn Fn() + Send + Sync>,
}

impl Post {
    /// A post, where what is handed in can be fetched, and what tells that something has been.
    pub fn new(wake: impl Fn() + Send + Sync + 'static) -> (Post, Receiver<Done>) {
        let (sender, receiver) = channel();
        (Post { sender, wake: Arc::new(wake) }, receiver)
    }

    pub fn send(&self, done: Done) {
        // Fails only when the window has closed, and then nobody waits.
        let _ = self.sender.send(done);
        (self.wake)();
    }
}

/// Starts threads and takes in what they have done.
pub struct Desk {
    post: Post,
    receiver: Receiver<Done>,
    /// Threads with a device of their own, which must end before the program does.
    drawing: Vec<JoinHandle<()>>,
    /// The measurement that is still wanted.
    measuring: Arc<AtomicU64>,
    /// Nothing is wanted any more.
    closed: Arc<AtomicBool>,
    /// To the thread that draws small pictures, once there is one.
    pictures: Option<Sender<(Subject, OpenScene)>>,
    /// Held while something is measured or a small picture is drawn: neither is to disturb the other.
    alone: Arc<Mutex<()>>,
}

/// Where a sheet's files go, under which name, and in which formats.
pub type SheetTarget = ((PathBuf, String), Vec<Format>);

/// Widest and highest picture of a sheet in the window, pixels.
const PREVIEW: u32 = 2048;

/// A sheet as a picture that a device can hold.
fn preview(sheet: &Sheet) -> Result<ColorImage> {
    let pixels = figure::pixels(sheet)?;
    let [w, h] = pixels.size;
    let scale = (f64::from(PREVIEW) / f64::from(w.max(h))).min(1.0);
    let whole = image::RgbaImage::from_raw(w, h, pixels.rgba).context("the sheet's size does not match")?;
    let [w, h] = [w, h].map(|side| ((f64::from(side) * scale).round() as u32).max(1));
    let small = if scale < 1.0 { image::imageops::thumbnail(&whole, w, h) } else { whole };
    Ok(ColorImage::from_rgba_unmultiplied([w as usize, h as usize], &small))
}

/// The scene that is open, with its name in set-ups.
pub type OpenScene = (String, Arc<Scene>);

/// How long the thread that draws small pictures keeps its scene on the device.
const IDLE: Duration = Duration::from_secs(20);
/// Width of a row's small picture, pixels.
const SMALL: u32 = 320;
/// Width of a chart saved as a picture, pixels.
const CHART: u32 = 2400;

/// Where a measurement says how far it is, and asks whether it is still wanted.
struct Watch {
    post: Post,
    job: u64,
    wanted: Arc<AtomicU64>,
    /// When it last said how far it is.
    said: Cell<Option<Instant>>,
}

/// Nobody cancels a dialog faster than this after asking for it.
const GLANCE: Duration = Duration::from_millis(500);
/// Between two words on the progress: each draws the window anew, on the device that is being timed.
const PAUSE: Duration = Duration::from_millis(300);
/// A window that is torn away lets go of what it holds within this time.
const GOING: Duration = Duration::from_secs(3);

impl Watch {
    fn tell(&self, done: Done) -> bool {
        self.post.send(done);
        self.wanted()
    }

    fn progress(&self, done: f32, what: &str) -> bool {
        if self.said.get().is_none_or(|said| said.elapsed() >= PAUSE) {
            self.said.set(Some(Instant::now()));
            self.post.send(Done::Progress(self.job, done, what.into()));
        }
        self.wanted()
    }

    fn wanted(&self) -> bool {
        self.wanted.load(Ordering::Relaxed) == self.job
    }

    /// For a device, which gives frames up by it.
    fn unwanted(&self) -> impl Fn() -> bool + Send + Sync + 'static {
        let (wanted, job) = (self.wanted.clone(), self.job);
        move || wanted.load(Ordering::Relaxed) != job
    }
}

impl Desk {
    /// `wake` is called whenever something is done.
    pub fn new(wake: impl Fn() + Send + Sync + 'static) -> Desk {
        let (post, receiver) = Post::new(wake);
        Desk {
            post,
            receiver,
            drawing: Vec::new(),
            measuring: Arc::default(),
            closed: Arc::default(),
            pictures: None,
            alone: Arc::default(),
        }
    }

    /// Where threads hand in what they have done.
    pub fn post(&self) -> Post {
        self.post.clone()
    }

    /// The next thing done.
    pub fn take(&self) -> Option<Done> {
        self.receiver.try_recv().ok()
    }

    /// Runs `work` on a thread.
    pub fn start(&self, work: impl FnOnce(&Post) + Send + 'static) -> JoinHandle<()> {
        let post = self.post.clone();
        std::thread::spawn(move || work(&post))
    }

    /// Opens a scene, set-up, capture or world; a scene with a light that the technique serves, or the default one.
    pub fn open(&self, job: u64, what: String, technique: Option<String>, room: Room) {
        self.start(move |post| {
            let path = files::path_of(&what);
            let ending = path.extension().map(|e| e.to_ascii_lowercase());
            let world = |text: &String| flatland::file::is_world(text);
            if ending.as_ref().is_some_and(|e| e == "toml")
                && let Some(text) = files::read_text(&path).ok().filter(world)
            {
                let world =
                    Flatland::from_toml(&text).with_context(|| format!("{what} is no usable world of flatland"));
                return post.send(Done::World(job, path, world));
            }
            let text = |e: &OsString| e == "toml" && files::read_text(&path).is_ok_and(|text| figure::is_figure(&text));
            let sheet = |e: &OsString| text(e) || (e == "png" || e == "svg") && figure::has_sheet(&path);
            if ending.as_ref().is_some_and(sheet) {
                // Behind the builder stands what the sheet starts from.
                let opened = Spec::open(&what).and_then(|spec| {
                    let (setup, scene) = spec.open_base()?;
                    Ok((spec, prepared(setup, scene, &room, false)?))
                });
                let loaded = opened.map(|(spec, loaded)| {
                    post.send(Done::Built(job, path, Box::new(spec)));
                    loaded
                });
                return post.send(Done::Loaded(job, loaded));
            }
            let holds = |e: &OsString| e == "toml" || capture::HOLD.iter().any(|held| e == *held);
            let bare = !ending.as_ref().is_some_and(holds);
            let technique = technique.as_deref().unwrap_or(setup::DEFAULT_TECHNIQUE);
            let opened =
                Setup::open_for(&what, &[technique]).and_then(|(setup, scene)| prepared(setup, scene, &room, bare));
            post.send(Done::Loaded(job, opened));
        });
    }

    /// Makes a set-up with its scene ready.
    pub fn prepare(&self, job: u64, open: impl FnOnce() -> Result<(Setup, Scene)> + Send + 'static, room: Room) {
        self.start(move |post| {
            let loaded = open().and_then(|(setup, scene)| prepared(setup, scene, &room, false));
            post.send(Done::Loaded(job, loaded));
        });
    }

    /// Finds out what windows that are gone have left in a folder, and once more for one that is still going.
    pub fn find_left(&self, folder: PathBuf) {
        self.start(move |post| {
            post.send(Done::Left(journal::left(&folder)));
            std::thread::sleep(GOING);
            post.send(Done::Left(journal::left(&folder)));
        });
    }

    /// Opens what one of them has left.
    pub fn go_on(&self, job: u64, left: Left, room: Room) {
        self.start(move |post| {
            let opened = left.open();
            let (loaded, rest) = match opened {
                Ok((setup, scene, rest)) => (prepared(setup, scene, &room, false), Some(Box::new(rest))),
                Err(e) => (Err(e), None),
            };
            post.send(Done::WentOn(job, left, rest));
            post.send(Done::Loaded(job, loaded));
        });
    }

    /// Finds out which files were opened last; with a name, puts that first.
    pub fn remember(&self, folder: PathBuf, name: Option<String>) {
        self.start(move |post| {
            let files = match name {
                Some(name) => recent::add(&folder, &name),
                None => recent::read(&folder),
            };
            post.send(Done::Recent(files));
        });
    }

    /// Measures the answer to the question of a lesson's step, and the set-up that the reader has made of it, if that is another.
    pub fn answer(
        &mut self,
        job: u64,
        adapter: String,
        scene: Arc<Scene>,
        (lesson, step, own): (&'static Lesson, usize, Option<Setup>),
    ) {
        // The device is opened anew for another scene, and looks after itself.
        let work = move |renderer: Renderer, watch: &Watch| {
            let tick = &mut |done, what: &str| _ = watch.progress(done, what);
            Ok(Box::new(lessons::answer(renderer, lesson, step, own, tick)?))
        };
        self.beside(job, adapter, scene, work, Done::Answered);
    }

    /// Loads a set-up's scene again.
    pub fn restore(&self, job: u64, setup: Setup, room: Room) {
        self.start(move |post| {
            let loaded = setup::load_scene(&setup.scene).and_then(|scene| prepared(setup, scene, &room, false));
            post.send(Done::Loaded(job, loaded));
        });
    }

    /// Runs a measurement on a device of its own, so that the window's work does not mix with it.
    fn beside<T: 'static>(
        &mut self,
        job: u64,
        adapter: String,
        scene: Arc<Scene>,
        work: impl FnOnce(Renderer, &Watch) -> Result<T> + Send + 'static,
        done: fn(u64, Result<T>) -> Done,
    ) {
        let work = move |watch: &Watch| work(renderer(&adapter, scene, watch.unwanted())?, watch);
        self.alone(job, work, done);
    }

    /// Runs work that can be cancelled, one piece at a time.
    fn alone<T: 'static>(
        &mut self,
        job: u64,
        work: impl FnOnce(&Watch) -> Result<T> + Send + 'static,
        done: fn(u64, Result<T>) -> Done,
    ) {
        let wanted = self.measuring.clone();
        wanted.store(job, Ordering::Relaxed);
        let alone = self.alone.clone();
        let thread = self.start(move |post| {
            let _alone = hold(&alone);
            let watch = Watch { post: post.clone(), job, wanted, said: Cell::new(None) };
            post.send(done(job, work(&watch)));
        });
        self.keep(thread);
    }

    /// Keeps a thread that must end before the program does; those that have ended are let go.
    fn keep(&mut self, thread: JoinHandle<()>) {
        self.drawing.retain(|thread| !thread.is_finished());
        self.drawing.push(thread);
    }

    /// Measures set-ups, each a row, whose costs are multiples of the shadow map's of `base`.
    pub fn measure(&mut self, job: u64, adapter: String, scene: Arc<Scene>, base: Setup, setups: Vec<Setup>) {
        let work = move |mut renderer: Renderer, watch: &Watch| {
            let setups: Vec<(u64, Setup)> = (0..).zip(setups).collect();
            let mut failed = Vec::new();
            measure::run(
                &mut renderer,
                &base,
                &setups,
                setups.len() as u64,
                More::default(),
                &mut |step| match step {
                    Step::Working(done, what) => watch.progress(done, &what),
                    Step::Row(row) => watch.tell(Done::Row(row)),
                    Step::Failed(why) => {
                        failed.push(why.to_string());
                        true
                    }
                },
            )?;
            ensure!(failed.is_empty(), failed.join("; "));
            Ok(())
        };
        self.beside(job, adapter, scene, work, Done::Measured);
    }

    /// Runs techniques along a case's path, or along the set-up's own.
    pub fn stability(
        &mut self,
        job: u64,
        adapter: String,
        scene: Arc<Scene>,
        setup: Setup,
        (case, run): (Option<&'static str>, Run),
    ) {
        let work = move |mut renderer: Renderer, watch: &Watch| {
            let route = match case {
                Some(id) => cases::find(id).map(Route::Case).context("there is no such case")?,
                None => setup.path.clone().map(Route::Own).context("the set-up has no path of its own")?,
            };
            stability::run(&mut renderer, &route, &setup, &run, &mut |done| watch.progress(done, route.id()))
        };
        self.beside(job, adapter, scene, work, Done::Stability);
    }

    /// Looks for the cheapest configuration that meets a budget.
    pub fn advise(
        &mut self,
        job: u64,
        adapter: String,
        scene: Arc<Scene>,
        setup: Setup,
        (budget, techniques): (Budget, Vec<String>),
    ) {
        let work = move |mut renderer: Renderer, watch: &Watch| {
            let advice = advise::advise(&mut renderer, &setup, &techniques, &[], budget, &mut |step| match step {
                Step::Working(done, what) => watch.progress(done, &what),
                _ => watch.wanted(),
            })?;
            Ok(Box::new((budget, advice)))
        };
        self.beside(job, adapter, scene, work, Done::Advised);
    }

    /// Measures the errors of two set-ups at a size, and of the pixel at a place of the picture.
    pub fn tried(
        &mut self,
        job: u64,
        adapter: String,
        scene: Arc<Scene>,
        setups: [Setup; 2],
        (size, place): ([u32; 2], [f32; 2]),
    ) {
        let work = move |mut renderer: Renderer, _: &Watch| {
            let [before, after] = &setups;
            let before = diagnosis::measure(&mut renderer, before, size, place)?;
            Ok([before, diagnosis::measure(&mut renderer, after, size, place)?])
        };
        self.beside(job, adapter, scene, work, Done::Tried);
    }

    /// Draws a sheet unless it is `held` already, and writes it where it is to go.
    pub fn sheet(&mut self, job: u64, adapter: String, spec: Spec, held: Option<Arc<Sheet>>, to: Option<SheetTarget>) {
        let work = move |watch: &Watch| {
            let sheet = match held.filter(|held| held.spec == spec) {
                Some(held) => held,
                None => {
                    let gpu = Arc::new(device(&adapter, watch.unwanted())?);
                    Arc::new(figure::draw(&spec, &gpu, &mut |done, what| watch.progress(done, what))?)
                }
            };
            let written = match &to {
                Some(((folder, name), formats)) => {
                    ensure!(watch.wanted(), measure::STOPPED);
                    figure::write(&sheet, folder, name, formats)?
                }
                None => Vec::new(),
            };
            let preview = preview(&sheet)?;
            Ok(Box::new((sheet, preview, written)))
        };
        self.alone(job, work, Done::Sheet);
    }

    /// Lets a measurement that runs end early.
    pub fn cancel_measuring(&self) {
        self.measuring.store(0, Ordering::Relaxed);
    }

    /// Captures a set-up into a file, likewise; `whole`: as a figure of this size, legend and all.
    pub fn capture(
        &mut self,
        adapter: String,
        scene: Arc<Scene>,
        setup: Setup,
        whole: Option<[u32; 2]>,
        path: PathBuf,
    ) {
        let closed = self.closed();
        let thread = self.start(move |post| {
            let folder = path.parent().filter(|f| !f.as_os_str().is_empty() && !f.exists()).map(Path::to_path_buf);
            let captured = renderer(&adapter, scene, closed).and_then(|mut r| match whole {
                Some(size) => capture::figure(&mut r, &setup, size, &path),
                None => capture::capture(&mut r, &setup, &path),
            });
            let made = folder.map(|f| format!("The folder {} did not exist; it was made.", f.display()));
            post.send(Done::Captured(captured.map(|notes| (path, made.into_iter().chain(notes).collect()))));
        });
        self.keep(thread);
    }

    /// Draws a sequence of a set-up into a file, likewise.
    pub fn animate(
        &mut self,
        job: u64,
        adapter: String,
        scene: Arc<Scene>,
        setup: Setup,
        (sequence, path): (Sequence, PathBuf),
    ) {
        let work = move |mut renderer: Renderer, watch: &Watch| {
            let frames = sequence.frames;
            let tell = |done: f32| format!("Frame {} of {frames}", (done * frames as f32).round() as u32 + 1);
            let notes = sequence::write(&mut renderer, &setup, &sequence, &path, &mut |done| {
                watch.progress(done, &tell(done))
            })?;
            Ok((if sequence::is_numbered(&path) { sequence::numbered(&path, 0) } else { path }, notes))
        };
        self.beside(job, adapter, scene, work, Done::Animated);
    }

    /// Draws a small picture.
    pub fn picture(&mut self, adapter: String, subject: Subject, open: OpenScene) {
        if self.pictures.is_none() {
            let (sender, requests) = channel();
            let (closed, alone) = (self.closed(), self.alone.clone());
            let thread = self.start(move |post| draw_small(&adapter, &requests, &alone, closed, post));
            self.keep(thread);
            self.pictures = Some(sender);
        }
        if let Some(sender) = &self.pictures {
            // Fails only when the thread has ended, and then nothing is drawn.
            let _ = sender.send((subject, open));
        }
    }

    /// Writes measured rows into a file.
    pub fn export(&self, tab: Tab, figures: Figures, path: PathBuf) {
        self.start(move |post| post.send(Done::Saved(tab, export(&figures, &path).map(|()| path))));
    }

    /// Reads measured rows.
    pub fn read_rows(&self, path: PathBuf) {
        self.start(move |post| {
            let rows = measure::read(&path);
            post.send(Done::Read(path, rows));
        });
    }

    /// Asks for a file to open.
    pub fn pick_file(&self) {
        self.start(|post| {
            let dialog = rfd::FileDialog::new().set_title("Open a scene, a set-up or a capture");
            let dialog = dialog.add_filter("Scenes, set-ups, captures, results", &picker::OPENED);
            picked(post, || dialog.pick_file(), Done::PickedFile, false);
        });
    }

    /// Asks where to write a picture.
    pub fn pick_capture(&self) {
        self.start(|post| {
            let dialog = rfd::FileDialog::new().set_title("Save the picture").set_file_name("picture.png");
            let dialog = dialog.add_filter("Pictures", &picker::SAVED);
            picked(post, || dialog.save_file(), Done::PickedCapture, true);
        });
    }

    /// Tells whether the window has closed.
    fn closed(&self) -> impl Fn() -> bool + Clone + Send + Sync + 'static {
        let closed = self.closed.clone();
        move || closed.load(Ordering::Relaxed)
    }

    /// Waits for the threads that draw: a driver must not be torn down under them.
    pub fn close(&mut self) {
        self.cancel_measuring();
        self.closed.store(true, Ordering::Relaxed);
        self.pictures = None;
        for thread in self.drawing.drain(..) {
            // A thread that panicked has said so already.
            let _ = thread.join();
        }
    }
}

/// Sends what the system's dialog returns. One that nobody can have seen was none: neither a portal nor zenity is there.
fn picked(post: &Post, ask: impl FnOnce() -> Option<PathBuf>, done: fn(PathBuf) -> Done, save: bool) {
    let asked = Instant::now();
    match ask() {
        Some(path) => post.send(done(path)),
        None if asked.elapsed() < GLANCE => post.send(Done::NoDialog(save)),
        None => {}
    }
}

fn prepared(mut setup: Setup, scene: Scene, room: &Room, bare: bool) -> Result<Box<Loaded>> {
    // A step that is restored may have been made before the file changed.
    setup.count_from(scene.origin);
    room.check(&scene)?;
    let geometry = Geometry::new(&scene, 0, 0.0)?;
    Ok(Box::new(Loaded { setup, scene: Arc::new(scene), geometry, bare }))
}

/// Draws small pictures for as long as they are asked for.
fn draw_small(
    adapter: &str,
    requests: &Receiver<(Subject, OpenScene)>,
    alone: &Mutex<()>,
    closed: impl Fn() -> bool + Clone + Send + Sync + 'static,
    post: &Post,
) {
    // The scene's name, and the device that holds it.
    let mut held: Option<(String, Renderer)> = None;
    loop {
        match requests.recv_timeout(IDLE) {
            Ok((subject, open)) => {
                let _alone = hold(alone);
                if closed() {
                    return;
                }
                let drawn = small(adapter, &mut held, &subject, open, closed.clone());
                // On a device that is lost nothing is drawn any more.
                if drawn.is_err() {
                    held = None;
                }
                post.send(Done::Pictured(subject, drawn));
            }
            Err(RecvTimeoutError::Timeout) => held = None,
            Err(RecvTimeoutError::Disconnected) => return,
        }
    }
}

/// Draws a small picture; `held`: the scene drawn last, by its name, and the device that holds it.
fn small(
    adapter: &str,
    held: &mut Option<(String, Renderer)>,
    subject: &Subject,
    open: OpenScene,
    closed: impl Fn() -> bool + Send + Sync + 'static,
) -> Result<ColorImage> {
    let exhibit = |id: &str| gallery::find(id).context("there is no such set-up in the gallery");
    let (name, row) = match subject {
        Subject::Row(text) => {
            let row: Setup = serde_json::from_str(text).context("this row's set-up cannot be read")?;
            (row.scene.clone(), Some(row))
        }
        Subject::Scene(name) => (name.to_string(), None),
        Subject::Lesson(id) => (lessons::find(id)?.steps[0].scene.scene(), None),
        Subject::Exhibit(id) => (exhibit(id)?.scene()?, None),
    };
    if held.as_ref().is_some_and(|h| h.0 != name) {
        *held = None;
    }
    let (_, renderer) = match held {
        Some(held) => held,
        None => {
            let scene = if open.0 == name { open.1 } else { Arc::new(setup::load_scene(&name)?) };
            held.insert((name, renderer(adapter, scene, closed)?))
        }
    };
    let (setup, size) = match (row, subject) {
        (None, Subject::Lesson(id)) => (lessons::find(id)?.steps[0].scene.in_scene(renderer.scene())?, pictures::TILE),
        (None, Subject::Exhibit(id)) => (exhibit(id)?.in_scene(renderer.scene())?, pictures::TILE),
        (Some(mut setup), _) => {
            let [width, height] = setup.size.map(u64::from);
            let size = [SMALL, ((SMALL as u64 * height / width.max(1)) as u32).clamp(1, 2 * SMALL)];
            // Where there is no truth, what can be seen.
            setup.view = if techniques::TRUTH.refuses(&setup.light).is_none() { "error" } else { "shaded" }.into();
            (setup, size)
        }
        (None, _) => (timeline::pictured(renderer.scene())?, pictures::SIZE),
    };
    if matches!(subject, Subject::Lesson(_) | Subject::Exhibit(_)) {
        // These may be figures of several sides.
        let truth = if setup.needs_truth() { Truth::All } else { Truth::Off };
        renderer.draw(&setup, Ask { size, truth, ..Ask::of(&setup) })?;
        return Ok(ColorImage::from_rgba_unmultiplied(size.map(|s| s as usize), &renderer.read_picture()?));
    }
    let truth = if setup.needs_truth() { Truth::All } else { Truth::Off };
    renderer.render(&setup, Ask { size, truth, ..Ask::of(&setup) })?;
    Ok(ColorImage::from_rgba_unmultiplied(size.map(|s| s as usize), &renderer.read_picture()?))
}

/// Waits until nothing else is measured or drawn small. What panicked meanwhile has said so, and left nothing half done.
fn hold(alone: &Mutex<()>) -> MutexGuard<'_, ()> {
    alone.lock().unwrap_or_else(PoisonError::into_inner)
}

/// What can be written as a chart or as figures.
pub enum Figures {
    /// Measured rows, with the axes of cost and error.
    Rows(Vec<Record>, [&'static Axis; 2]),
    /// What was found along a path, and which figure of it is charted.
    Path(Stability, Figure),
}

fn export(figures: &Figures, path: &Path) -> Result<()> {
    let ending = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    let svg = || match figures {
        Figures::Rows(rows, [cost, error]) => {
            let scenes: std::collections::BTreeSet<&str> = rows.iter().map(|r| r.scene.as_str()).collect();
            chart::svg(rows, cost, error, &scenes.into_iter().collect::<Vec<_>>().join(", "))
        }
        Figures::Path(found, figure) => chart::lines_svg(&stability::lines(found, *figure)),
    };
    match (ending.as_str(), figures) {
        ("svg", _) => files::save(path, svg()?.as_bytes()),
        ("png", _) => files::save(path, &chart::png(&svg()?, CHART)?),
        ("csv" | "json", Figures::Rows(rows, _)) => measure::write(rows, path, ending == "json"),
        ("csv", Figures::Path(found, _)) => {
            let mut table = stability::Table::new()?;
            table.add(found)?;
            files::save(path, &table.finish()?)
        }
        ("json", Figures::Path(found, _)) => {
            files::save(path, (serde_json::to_string_pretty(&[found])? + "\n").as_bytes())
        }
        _ => bail!("{}: a chart's file name ends in .svg, .png, .csv or .json", path.display()),
    }
}

/// A device of its own, which gives a frame up where it is `unwanted`.
fn device(adapter: &str, unwanted: impl Fn() -> bool + Send + Sync + 'static) -> Result<Gpu> {
    let gpu = Gpu::new(Some(adapter)).context("no second device could be opened")?;
    gpu.give_up_when(unwanted);
    Ok(gpu)
}

/// A renderer on one.
fn renderer(adapter: &str, scene: Arc<Scene>, unwanted: impl Fn() -> bool + Send + Sync + 'static) -> Result<Renderer> {
    Renderer::new(Arc::new(device(adapter, unwanted)?), scene)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each case's small picture shows something.
    #[test]
    fn every_case_has_a_picture() {
        let adapter = Gpu::new(None).unwrap().info.name.clone();
        let open = setup::load_scene("cubes").map(Arc::new).unwrap();
        let mut held = None;
        for case in cases::CASES {
            let open = ("cubes".into(), open.clone());
            let picture = small(&adapter, &mut held, &Subject::Scene(case.id), open, || false).unwrap();
            assert_eq!(picture.size, pictures::SIZE.map(|s| s as usize));
            let lightness = picture.pixels.iter().map(|p| p.r() as u32 + p.g() as u32 + p.b() as u32);
            let (least, most) = (lightness.clone().min(), lightness.max());
            assert!(most > least.map(|l| l + 60), "{}: {least:?} to {most:?} of 765", case.id);
        }
    }
}
