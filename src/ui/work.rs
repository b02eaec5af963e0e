//! Work beside the window: loading, measuring, capturing, file dialogs. Each on a thread of its own.

use crate::capture;
use crate::frame::Renderer;
use crate::gpu::Gpu;
use crate::measure::{self, Record, Step};
use crate::scene::Scene;
use crate::scene::geometry::Geometry;
use crate::setup::{self, Setup};
use anyhow::{Context, Result, anyhow};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::JoinHandle;
use winit::event_loop::EventLoopProxy;

/// A set-up with its scene, ready to be drawn.
pub struct Loaded {
    pub setup: Setup,
    pub scene: Arc<Scene>,
    pub geometry: Geometry,
}

/// What a thread has done. Numbers tell which request it answers.
pub enum Done {
    Loaded(u64, Result<Box<Loaded>>),
    Progress(u64, f32),
    Measured(u64, Result<Box<Record>>),
    Captured(Result<PathBuf>),
    /// Share of wrong pixels in the picture.
    Counted(u64, f64),
    PickedFile(PathBuf),
    PickedCapture(PathBuf),
}

/// Where threads hand in what they have done.
#[derive(Clone)]
pub struct Post {
    sender: Sender<Done>,
    wake: EventLoopProxy<()>,
}

impl Post {
    pub fn send(&self, done: Done) {
        // Both fail only when the window has closed, and then nobody waits.
        let _ = self.sender.send(done);
        let _ = self.wake.send_event(());
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
}

impl Desk {
    pub fn new(wake: EventLoopProxy<()>) -> Desk {
        let (sender, receiver) = channel();
        Desk { post: Post { sender, wake }, receiver, drawing: Vec::new(), measuring: Arc::default() }
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

    /// Opens a scene, set-up or capture.
    pub fn open(&self, job: u64, what: String) {
        self.start(move |post| {
            let opened = Setup::open(&what).and_then(|(setup, scene)| prepared(setup, scene));
            post.send(Done::Loaded(job, opened));
        });
    }

    /// Loads a set-up's scene again.
    pub fn restore(&self, job: u64, setup: Setup) {
        self.start(move |post| {
            let loaded = setup::load_scene(&setup.scene).and_then(|scene| prepared(setup, scene));
            post.send(Done::Loaded(job, loaded));
        });
    }

    /// Measures a set-up on a device of its own, so that the window's work does not mix with it.
    pub fn measure(&mut self, job: u64, adapter: String, scene: Arc<Scene>, setup: Setup) {
        let wanted = self.measuring.clone();
        wanted.store(job, Ordering::Relaxed);
        let thread = self.start(move |post| {
            let measured = renderer(&adapter, scene).and_then(|mut renderer| {
                let mut row = None;
                measure::run(&mut renderer, &setup.clone(), &[(0, setup)], 1, false, &mut |step| {
                    match step {
                        Step::Working(done, _) => post.send(Done::Progress(job, done)),
                        Step::Row(measured) => row = Some(measured),
                    }
                    wanted.load(Ordering::Relaxed) == job
                })?;
                row.context("nothing was measured")
            });
            post.send(Done::Measured(job, measured));
        });
        self.drawing.push(thread);
    }

    /// Lets a measurement that runs end early.
    pub fn cancel_measuring(&self) {
        self.measuring.store(0, Ordering::Relaxed);
    }

    /// Captures a set-up into a file, likewise.
    pub fn capture(&mut self, adapter: String, scene: Arc<Scene>, setup: Setup, path: PathBuf) {
        let thread = self.start(move |post| {
            let captured = renderer(&adapter, scene).and_then(|mut r| capture::capture(&mut r, &setup, &path));
            post.send(Done::Captured(captured.map(|()| path)));
        });
        self.drawing.push(thread);
    }

    /// Asks for a file to open.
    pub fn pick_file(&self) {
        self.start(|post| {
            let dialog = rfd::FileDialog::new().set_title("Open a scene, a set-up or a capture");
            let dialog = dialog.add_filter("Scenes, set-ups, captures", &["glb", "gltf", "toml", "png"]);
            if let Some(path) = dialog.pick_file() {
                post.send(Done::PickedFile(path));
            }
        });
    }

    /// Asks where to write a picture.
    pub fn pick_capture(&self) {
        self.start(|post| {
            let dialog = rfd::FileDialog::new().set_title("Save the picture").set_file_name("picture.png");
            if let Some(path) = dialog.add_filter("Pictures", &["png", "exr"]).save_file() {
                post.send(Done::PickedCapture(path));
            }
        });
    }

    /// Waits for the threads that draw: a driver must not be torn down under them.
    pub fn close(&mut self) {
        self.cancel_measuring();
        for thread in self.drawing.drain(..) {
            // A thread that panicked has said so already.
            let _ = thread.join();
        }
    }
}

fn prepared(setup: Setup, scene: Scene) -> Result<Box<Loaded>> {
    let geometry = Geometry::new(&scene, 0, 0.0)?;
    Ok(Box::new(Loaded { setup, scene: Arc::new(scene), geometry }))
}

fn renderer(adapter: &str, scene: Arc<Scene>) -> Result<Renderer> {
    let gpu = Gpu::new(Some(adapter)).with_context(|| anyhow!("no second device could be opened"))?;
    Renderer::new(Arc::new(gpu), scene)
}
