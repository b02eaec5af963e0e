//! The scene's thread: when to render what. Few pixels while something moves, all of them at rest, then the exact shadow.
//!
//! It has a device of its own, so that neither a long frame nor a read-back keeps the window from answering. The window
//! leaves an order, of which only the newest counts, and requests, each of which is answered; pictures and figures come
//! back through the window's post.

use super::model::{Facts, Traced};
use super::work::{Done, Loaded, Post};
use crate::frame::{Ask, History, Renderer, Truth, panes, pixel_at};
use crate::gpu::{self, Failure, GivenUp, Gpu, TimerMode};
use crate::legend::Known;
use crate::measure::story::{self, Seen};
use crate::measure::{Record, metrics, params_text};
use crate::scene::Scene;
use crate::setup::{Arrange, Setup};
use crate::techniques;
use crate::truth::{Progress, Samples};
use crate::view::{self, View};
use anyhow::{Context, Result, anyhow};
use std::collections::VecDeque;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant, SystemTime};

/// Shares of the viewport's side that are rendered at.
const SCALES: [f64; 6] = [1.0, 0.75, 0.5, 0.375, 0.25, 1.0 / 6.0];
/// Milliseconds that a frame may take while the scene moves, and while only the technique or the view changes.
const MOVING_MS: f64 = 50.0;
const TUNING_MS: f64 = 100.0;
/// At rest the picture goes straight to full resolution, if that takes no longer.
const STEP_MS: f64 = 400.0;
/// Milliseconds of truth that are traced between two looks at what is ordered.
const TRUTH_MS: f64 = 60.0;
/// Share of the truth after which the picture is drawn with it.
const TRUTH_STEP: f32 = 0.1;
/// What counts as rest though a button is held.
const SETTLE: Duration = Duration::from_millis(180);
/// A frame that has taken longer is given up where another one is wanted.
const PATIENCE: Duration = Duration::from_millis(150);
/// Frames kept for the chart.
const RECENT: usize = 200;
/// A device that is lost twice within this time is not opened a third time unasked.
pub const AGAIN: Duration = Duration::from_secs(20);
/// How often changed shaders are looked for.
const RELOAD: Duration = Duration::from_millis(500);

/// What the window wants to see.
pub struct Order {
    /// Counts what the orders ask to see.
    pub number: u64,
    pub setup: Setup,
    pub scene: Arc<Scene>,
    /// Pixels of the viewport.
    pub full: [u32; 2],
    /// Something moves or is being dragged: the next order is about to come.
    pub moving: bool,
    /// The chart follows: errors are counted even while something moves.
    pub follow: bool,
    /// Something is being measured, which rendering would disturb.
    pub paused: bool,
    /// The map that is looked into, from 0.
    pub map: Option<u32>,
    /// The place of the pixel whose story is wanted, 0 to 1 from the upper left corner of a side's picture.
    pub story: Option<[f32; 2]>,
}

/// What changed between two orders.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Change {
    Nothing,
    /// The way to look at it; errors stay.
    View,
    /// The technique; the truth stays.
    Technique,
    /// What is seen.
    Scene,
}

impl Order {
    fn change(&self, before: &Order) -> Change {
        let (now, old) = (&self.setup, &before.setup);
        let lights = |s: &Setup| (s.light_number, s.lamps().iter().map(|lamp| lamp.light).collect::<Vec<_>>());
        let scene = |s: &Setup| (s.camera, lights(s), s.time, s.animation, s.seed);
        if self.full != before.full || !Arc::ptr_eq(&self.scene, &before.scene) || scene(now) != scene(old) {
            return Change::Scene;
        }
        let technique = |s: &Setup| {
            let maps = (s.shadow_camera, s.outlines, s.lit().iter().map(|(i, _)| *i).collect::<Vec<_>>());
            (s.technique.clone(), (s.truth_samples, s.probe), s.values().clone(), s.against.clone(), maps)
        };
        if technique(now) != technique(old) {
            return Change::Technique;
        }
        let look = |s: &Setup| {
            let errors = (s.error_dilation, s.error_base, s.error_window);
            (s.view.clone(), s.split, s.arrange, s.front, s.overlay.clone(), errors)
        };
        if look(now) != look(old) { Change::View } else { Change::Nothing }
    }

    /// Whether the picture of another order, of the same technique and scene, needs only to be drawn again for this one.
    fn same_frame(&self, drawn: &Order) -> bool {
        let (now, old) = (&self.setup, &drawn.setup);
        if now.overlay != old.overlay || now.overlay.is_some() {
            return false;
        }
        // The other lights, or one that is off, may not have been drawn.
        let lights = |s: &Setup| s.shows_all_lights() && (!s.light_on || !s.lit_beside().is_empty());
        if lights(now) != lights(old) {
            return false;
        }
        if now.sides() > 1 {
            // Parts that have the whole viewport's size, put together in another way.
            let whole = |s: &Setup| s.arrange != Arrange::SideBySide && s.sides() == 2;
            return now.view == old.view && (now.arrange == old.arrange || whole(now) && whole(old));
        }
        match view::index(&now.view) {
            // What the CPU makes of a frame is made with it.
            Some(i) => !view::VIEWS[i].is_judged(),
            None => now.view == old.view,
        }
    }

    fn same(&self, other: &Order) -> bool {
        let flags = |o: &Order| (o.moving, o.follow, o.paused, o.map, o.story);
        self.change(other) == Change::Nothing && flags(self) == flags(other)
    }
}

/// What is answered, in the order in which it is asked.
pub enum Request {
    /// Take a scene onto the device, for the first order that names it. The number comes back with the answer.
    Load(u64, Box<Loaded>),
    /// Read what the view shows at a place of the viewport (0 to 1 from its upper left corner).
    Value([f32; 2]),
    /// Find the surface there.
    Point([f32; 2]),
    /// Find the plane of that.
    Plane([f32; 2]),
    /// Show what the pass of this name wrote for a side.
    Shot(usize, &'static str),
    /// Go on with the adapter of this name.
    Adapter(String),
    /// Lose the device, as drivers do.
    Lose,
}

/// A picture, sRGB-encoded, rows from the top.
pub struct Picture {
    pub size: [u32; 2],
    /// Pixels of the viewport that it was rendered for.
    pub full: [u32; 2],
    pub rgba: Vec<u8>,
}

/// What lies ready for the thread.
#[derive(Default)]
struct Mail {
    order: Option<Arc<Order>>,
    requests: VecDeque<Request>,
    closed: bool,
}

#[derive(Default)]
struct Inbox {
    mail: Mutex<Mail>,
    arrived: Condvar,
}

impl Inbox {
    fn lock(&self) -> MutexGuard<'_, Mail> {
        // Nobody panics while holding it, and what it holds would be whole all the same.
        self.mail.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn put(&self, put: impl FnOnce(&mut Mail)) {
        put(&mut self.lock());
        self.arrived.notify_one();
    }

    /// What has arrived, at the latest at `until`.
    fn wait(&self, until: Option<Instant>) -> Mail {
        let mut mail = self.lock();
        while mail.order.is_none() && mail.requests.is_empty() && !mail.closed {
            let left = until.map(|at| at.saturating_duration_since(Instant::now()));
            mail = match left {
                None => self.arrived.wait(mail).unwrap_or_else(PoisonError::into_inner),
                Some(Duration::ZERO) => break,
                Some(left) => self.arrived.wait_timeout(mail, left).unwrap_or_else(PoisonError::into_inner).0,
            };
        }
        let closed = mail.closed;
        Mail { closed, ..std::mem::take(&mut mail) }
    }
}

/// The window's end of the scene's thread.
pub struct Stage {
    inbox: Arc<Inbox>,
    thread: Option<JoinHandle<()>>,
    last: Option<Arc<Order>>,
}

impl Stage {
    /// Starts the thread, with a device of its own of the adapter of this name.
    pub fn start(post: Post, adapter: String, software: bool) -> Stage {
        let inbox = Arc::<Inbox>::default();
        let mail = inbox.clone();
        let work = move || {
            // Its device's threads inherit what it has at the time.
            if software {
                give_way();
            }
            let done = catch_unwind(AssertUnwindSafe(|| Painter::new(mail, &post, &adapter)?.run()));
            let failure = match done {
                Ok(Ok(())) => return,
                Ok(Err(e)) => e,
                Err(panic) => {
                    let text = panic.downcast_ref::<String>().cloned();
                    let text = text.or(panic.downcast_ref::<&str>().map(|s| s.to_string()));
                    anyhow!("{}", text.unwrap_or("the reason is not known".into()))
                }
            };
            post.send(Done::Broken(failure.context("rendering has stopped; open the scene again to go on")));
        };
        let thread = std::thread::Builder::new().name("scene".into()).spawn(work).ok();
        Stage { inbox, thread, last: None }
    }

    /// Whether the thread has ended.
    pub fn ended(&self) -> bool {
        self.thread.as_ref().is_none_or(|t| t.is_finished())
    }

    /// Leaves an order, unless it is the same as the last one. Its number, which counts what is to be seen.
    pub fn order(&mut self, mut order: Order) -> u64 {
        if let Some(last) = self.last.as_ref().filter(|last| last.same(&order)) {
            return last.number;
        }
        // What is answered with another picture.
        let new = self.last.as_ref().map_or(Change::Scene, |last| order.change(last)) > Change::Nothing;
        order.number = self.last.as_ref().map_or(0, |last| last.number) + new as u64;
        let order = Arc::new(order);
        self.last = Some(order.clone());
        self.inbox.put(|mail| mail.order = Some(order.clone()));
        order.number
    }

    pub fn ask(&self, request: Request) {
        self.inbox.put(|mail| {
            // Of places to be read only the last is still under the pointer.
            if let Request::Value(_) | Request::Shot(..) = request {
                mail.requests.retain(|r| std::mem::discriminant(r) != std::mem::discriminant(&request));
            }
            mail.requests.push_back(request);
        });
    }

    /// Ends the thread and waits for it: a driver must not be torn down under it.
    pub fn close(&mut self) {
        self.inbox.put(|mail| mail.closed = true);
        if let Some(thread) = self.thread.take() {
            // A panic has been said already.
            let _ = thread.join();
        }
    }
}

/// Lets the interface's threads run first, where the scene is drawn by the same cores.
fn give_way() {
    // What is not allowed is done without.
    #[cfg(target_os = "linux")]
    let _ = rustix::process::nice(5);
}

/// When to come again.
enum Next {
    Now,
    At(Instant),
    /// Not before something arrives.
    Rest,
}

/// What frames took last at each of the [`SCALES`], milliseconds.
struct Costs([Option<f64>; SCALES.len()]);

impl Costs {
    /// What a frame is likely to take. Few pixels may take as long as many, where triangles and passes count; but that is
    /// to be found out.
    fn of(&self, i: usize) -> f64 {
        let like = |k: usize| self.0[k].map(|ms| ms * (SCALES[i] / SCALES[k]).powi(2));
        self.0[i].or((0..SCALES.len()).filter_map(like).reduce(f64::min)).unwrap_or(0.0)
    }

    fn learn(&mut self, scale: f64, ms: f64) {
        // What was learnt once is doubted after a while, so that more pixels are tried again.
        self.0.iter_mut().flatten().for_each(|ms| *ms *= 0.97);
        if let Some(i) = SCALES.iter().position(|s| *s == scale) {
            self.0[i] = Some(ms);
        }
    }

    /// The largest share of the side that is likely to be drawn within so many milliseconds, of which `truth` is taken up
    /// for all pixels; if none is, the largest of those that take hardly longer than the fastest.
    fn within(&self, allowed: f64, now: f64, truth: f64) -> f64 {
        let all: Vec<f64> = (0..SCALES.len()).map(|i| self.of(i) + truth * SCALES[i] * SCALES[i]).collect();
        let least = all.iter().copied().fold(f64::INFINITY, f64::min);
        let allowed = allowed.max(1.3 * least);
        // A little room before more pixels are drawn, so that the size does not swing.
        let fits = |i: &usize| all[*i] <= allowed * if SCALES[*i] > now { 0.85 } else { 1.0 };
        (0..SCALES.len()).find(fits).map_or(SCALES[SCALES.len() - 1], |i| SCALES[i])
    }
}

/// What the thread does.
struct Painter<'a> {
    inbox: Arc<Inbox>,
    post: &'a Post,
    adapter: String,
    gpu: Arc<Gpu>,
    /// When the device was lost last.
    lost: Option<Instant>,
    /// It is not opened anew before an adapter is chosen.
    given_up: bool,
    renderer: Option<Renderer>,
    /// Of the scene that is about to be shown.
    loaded: Option<Renderer>,
    /// The order before, and that of the picture.
    before: Option<Arc<Order>>,
    drawn: Option<Arc<Order>>,
    size: [u32; 2],
    changed: Instant,
    /// The most that changed since the last rest.
    change: Change,
    /// The share of the side that the picture was rendered at.
    scale: f64,
    /// Of all passes but the truth.
    costs: Costs,
    /// Nanoseconds of a sample of a pixel.
    truth_cost: f64,
    /// How much of the truth there is of the present size, and how much of it the picture shows.
    traced: Progress,
    drawn_truth: Progress,
    /// The errors of the picture have been counted.
    counted: bool,
    /// The picture made do with one sample a pixel where more are wanted.
    coarse: bool,
    /// Things moved in the last frame.
    moved: bool,
    /// The last frame was analysed, and the map that was handed in of it.
    analysed: bool,
    mapped: Option<u32>,
    /// It was analysed at all, and the pixel whose story was told of it.
    explained: bool,
    told: Option<[f32; 2]>,
    failed: bool,
    /// The last frame was given up.
    gave_up: bool,
    facts: Facts,
    shaders: Option<SystemTime>,
    looked: Instant,
}

impl Painter<'_> {
    fn new<'a>(inbox: Arc<Inbox>, post: &'a Post, adapter: &str) -> Result<Painter<'a>> {
        let gpu = Gpu::new(Some(adapter)).context("no second device could be opened")?;
        // Before anything is timed: half a GPU's worth of caution for software.
        let truth_cost = if gpu.software() { 500.0 } else { 4.0 };
        let mut facts = Facts::default();
        facts.know(&gpu);
        Ok(Painter {
            inbox,
            post,
            adapter: adapter.into(),
            shaders: gpu.shaders.changed(),
            gpu: Arc::new(gpu),
            lost: None,
            given_up: false,
            renderer: None,
            loaded: None,
            before: None,
            drawn: None,
            size: [0; 2],
            changed: Instant::now(),
            change: Change::Scene,
            scale: 1.0,
            costs: Costs(Default::default()),
            truth_cost,
            traced: Progress::default(),
            drawn_truth: Progress::default(),
            counted: false,
            coarse: false,
            moved: false,
            analysed: false,
            mapped: None,
            explained: false,
            told: None,
            failed: false,
            gave_up: false,
            facts,
            looked: Instant::now(),
        })
    }

    fn run(&mut self) -> Result<()> {
        let mut order: Option<Arc<Order>> = None;
        let mut until = None;
        loop {
            let watched = self.shaders.map(|_| self.looked + RELOAD);
            let mail = self.inbox.wait(until.into_iter().chain(watched).min());
            if mail.closed {
                return Ok(());
            }
            self.look_after_the_device();
            mail.requests.into_iter().for_each(|r| self.answer(r));
            order = mail.order.or(order);
            let Some(order) = &order else { continue };
            self.reload(order);
            until = match self.step(order) {
                Ok(Next::Now) => Some(Instant::now()),
                Ok(Next::At(at)) => Some(at),
                Ok(Next::Rest) => None,
                Err(e) if Failure::is_loss(&e) => {
                    self.look_after_the_device();
                    Some(Instant::now())
                }
                Err(e) => {
                    self.failed = true;
                    self.drawn = None;
                    // Nothing more is to be waited for.
                    (self.facts.size, self.facts.full) = (order.full, order.full);
                    self.send(order, None);
                    self.post.send(Done::Failed(e));
                    None
                }
            };
        }
    }

    /// Opens the device anew if it is lost, once; after that the user is asked.
    fn look_after_the_device(&mut self) {
        if self.given_up {
            return;
        }
        // What else there may be to tell is told with the frame.
        let Err(why) = self.gpu.look() else { return };
        let again = self.lost.replace(Instant::now()).is_some_and(|at| at.elapsed() < AGAIN);
        let opened = if again { Err(why) } else { self.reopen().map(|()| why) };
        match opened {
            Ok(why) => self.post.send(Done::Reopened(why)),
            Err(why) => self.give_up(why),
        }
    }

    fn give_up(&mut self, why: anyhow::Error) {
        self.given_up = true;
        let all = gpu::adapters(&gpu::instance());
        self.post.send(Done::Lost(why, all.iter().map(|a| a.get_info().name).collect()));
    }

    /// Opens the device anew. What was on it is made again when it is needed.
    fn reopen(&mut self) -> Result<()> {
        // What the lost one held first.
        (self.renderer, self.loaded, self.drawn) = (None, None, None);
        let gpu = Gpu::new(Some(&self.adapter))?;
        self.facts.know(&gpu);
        self.gpu = Arc::new(gpu);
        (self.failed, self.given_up) = (false, false);
        Ok(())
    }

    fn answer(&mut self, request: Request) {
        let pixel = |at: [f32; 2]| pixel_at(at, self.size);
        // After a frame that was given up there is nothing to read.
        let held = self.renderer.as_ref().filter(|_| self.drawn.is_some());
        match request {
            Request::Load(job, loaded) => {
                let Loaded { setup, scene, geometry, .. } = *loaded;
                let bounds = geometry.bounds;
                self.loaded = None;
                let opened = Renderer::with_geometry(self.gpu.clone(), scene.clone(), geometry).map(|r| {
                    self.loaded = Some(r);
                    (setup, scene, bounds)
                });
                self.post.send(Done::Opened(job, opened.map(Box::new)));
            }
            Request::Value(at) => {
                let value = held.map_or(Ok(None), |r| r.value_at(pixel(at)));
                self.post.send(Done::Value(at, value));
            }
            Request::Point(at) => {
                let point = held.map_or(Ok(None), |r| r.position_at(pixel(at)));
                self.post.send(Done::Point(point));
            }
            Request::Plane(at) => {
                let plane = held.map_or(Ok(None), |r| r.plane_at(pixel(at)));
                self.post.send(Done::Plane(plane));
            }
            Request::Shot(side, pass) => {
                // It is rendered once more without an analysis.
                (self.analysed, self.explained) = (false, false);
                let shot = match (&self.drawn, &mut self.renderer) {
                    (Some(order), Some(renderer)) => renderer.shot(&order.setup, side, pass),
                    _ => Ok(None),
                };
                self.post.send(Done::Shot(side, pass, shot));
            }
            Request::Adapter(name) => {
                self.adapter = name;
                if let Err(why) = self.reopen() {
                    self.give_up(why);
                }
            }
            Request::Lose => self.gpu.device.destroy(),
        }
    }

    /// Makes all passes anew from changed shaders; on an error those in use stay.
    fn reload(&mut self, order: &Order) {
        if self.shaders.is_none() || self.looked.elapsed() < RELOAD {
            return;
        }
        self.looked = Instant::now();
        let newest = self.gpu.shaders.changed();
        let Some(renderer) = self.renderer.as_mut().filter(|_| newest.is_some() && newest != self.shaders) else {
            return;
        };
        self.shaders = newest;
        let ask = Ask { size: [16; 2], ..Ask::of(&order.setup) };
        let made = Renderer::new(self.gpu.clone(), renderer.scene().clone())
            .and_then(|mut made| made.render(&order.setup, ask).map(|_| made));
        let done = made.map(|made| {
            *renderer = made;
            self.drawn = None;
            self.failed = false;
        });
        self.post.send(Done::Reloaded(done));
    }

    /// Does what is due next.
    fn step(&mut self, order: &Arc<Order>) -> Result<Next> {
        if self.loaded.as_ref().is_some_and(|r| Arc::ptr_eq(r.scene(), &order.scene)) {
            // The old one first: it may be large.
            self.renderer = None;
            self.renderer = self.loaded.take();
            self.drawn = None;
            self.costs = Costs(Default::default());
            self.facts.recent.clear();
            self.facts.seconds.clear();
        }
        let change = self.before.replace(order.clone()).map_or(Change::Scene, |before| order.change(&before));
        if change > Change::Nothing {
            let settled = self.changed.elapsed() > SETTLE;
            self.change = if settled { change } else { self.change.max(change) };
            self.changed = Instant::now();
            self.failed = false;
        }
        let here = self.renderer.as_ref().is_some_and(|r| Arc::ptr_eq(r.scene(), &order.scene));
        if order.paused || order.full.contains(&0) || self.failed || self.given_up || !here && self.lost.is_none() {
            return Ok(Next::Rest);
        }
        if !here {
            // The device that held it is gone.
            self.renderer = None;
            self.renderer = Some(Renderer::new(self.gpu.clone(), order.scene.clone())?);
            self.drawn = None;
            self.costs = Costs(Default::default());
        }
        let rest = !order.moving || self.changed.elapsed() >= SETTLE;
        let served = techniques::TRUTH.refuses(&order.setup.light).is_none();
        let shown = served && order.setup.needs_truth();
        let due = self.drawn.as_ref().map_or(Change::Scene, |d| order.change(d));
        let scale = self.next_scale(order, due, rest, shown);
        let size = order.full.map(|side| ((side as f64 * scale).round() as u32).max(1));
        let [averaged, wanted] = self.facts.told.frames;
        let averages = rest && wanted > 1 && (averaged < wanted || self.moved);
        if due > Change::Nothing || size != self.size || rest && self.coarse || averages {
            if due == Change::View && size == self.size && self.redrawable(order) {
                self.redraw(order)?;
            } else {
                self.draw(order, (due, rest), scale, size, [served, shown])?;
            }
            return Ok(Next::Now);
        }
        if !rest {
            return Ok(Next::At(self.changed + SETTLE));
        }
        if let Some(layer) = order.map.filter(|layer| self.mapped != Some(*layer) && size == order.full) {
            self.map(order, layer, [served, shown])?;
            return Ok(Next::Now);
        }
        if served && !self.whole() {
            self.trace(order, shown)?;
            return Ok(Next::Now);
        }
        if served && !self.counted && !order.setup.idles() {
            self.count(order)?;
        }
        if let Some(place) = order.story.filter(|place| self.told != Some(*place) && size == order.full) {
            self.tell(order, place, [served, shown])?;
        }
        Ok(Next::Rest)
    }

    /// All of the truth is traced that is asked for.
    fn whole(&self) -> bool {
        self.traced.done >= 1.0
    }

    /// Another view than that of the picture can be drawn without a new frame.
    fn redrawable(&self, order: &Order) -> bool {
        self.drawn.as_ref().is_some_and(|d| order.same_frame(d))
    }

    /// The share of the side to render at next.
    fn next_scale(&self, order: &Order, due: Change, rest: bool, truth: bool) -> f64 {
        if rest && (due == Change::Nothing || self.costs.of(0) <= STEP_MS) {
            return 1.0;
        }
        // What is drawn already stays, and what is only drawn again keeps its size.
        if due == Change::Nothing || due == Change::View && self.redrawable(order) {
            return self.scale;
        }
        // Only what moves needs its truth anew in every frame.
        let moving = self.change == Change::Scene;
        let pixels = order.full[0] as f64 * order.full[1] as f64;
        let truth = if moving && truth { self.truth_cost * pixels * 1e-6 } else { 0.0 };
        self.costs.within(if moving { MOVING_MS } else { TUNING_MS }, self.scale, truth)
    }

    /// Renders a frame.
    fn draw(
        &mut self,
        order: &Arc<Order>,
        (due, rest): (Change, bool),
        scale: f64,
        size: [u32; 2],
        [served, shown]: [bool; 2],
    ) -> Result<()> {
        let Some(renderer) = &mut self.renderer else { return Ok(()) };
        let draft = size != order.full;
        let mut setup = order.setup.clone();
        let info = techniques::find_or_say(&setup.technique)?;
        // While the scene moves every frame needs all of its truth: what an earlier frame left would be a lie. One sample
        // a pixel must do.
        let at_once = draft || !rest && self.change == Change::Scene;
        let coarse = at_once && setup.shown_samples() > 1;
        if coarse {
            setup.truth_samples = Samples::Fixed(1);
        }
        let counts = |id: &str| order.setup.find_view(id).is_some_and(View::counts_pixels);
        let over = setup.overlay.as_ref().is_some_and(|o| counts(&o.view));
        let waits = draft && (counts(&setup.view) || over);
        if waits {
            setup.view = view::VIEWS[0].id.into();
            setup.overlay = None;
        }
        let truth = match () {
            _ if !shown => Truth::Off,
            _ if at_once => Truth::All,
            _ => Truth::Some((TRUTH_MS * 1e6 / self.truth_cost) as u32),
        };
        let start = Instant::now();
        // While something moves each frame is drawn to its end, or there would be none; and never are two given up in a row.
        let (inbox, this, whole) = (self.inbox.clone(), order.clone(), !rest || self.gave_up);
        self.gpu.give_up_when(move || {
            let mail = inbox.lock();
            let new = mail.order.as_ref();
            let other = || new.is_some_and(|o| o.change(&this) > Change::View);
            mail.closed || new.is_some_and(|o| o.paused) || !whole && start.elapsed() > PATIENCE && other()
        });
        let whole_maps = !draft && rest && order.map.is_some();
        let analysis = whole_maps || !draft && rest && order.story.is_some();
        // What a technique keeps from frame to frame must not flatter it beside others.
        let fresh = rest && !draft && setup.sides() > 1;
        // What stood still from the first frame on comes to the same as a capture.
        let goes = !rest || due == Change::Nothing && size == self.size && !self.coarse && !self.moved;
        let history = if goes { History::Goes } else { History::Starts };
        let ask = Ask { size, truth, analysis, timed: true, picture: true, fresh, history };
        renderer.whole_maps = whole_maps;
        let drawn = renderer.draw(&setup, ask);
        self.gpu.give_up_when(|| false);
        let mut told = match drawn {
            Err(e) if e.is::<GivenUp>() => {
                self.gave_up = true;
                self.drawn = None;
                return Ok(());
            }
            drawn => drawn?,
        };
        let rgba = renderer.read_picture()?;
        let ms = start.elapsed().as_secs_f64() * 1e3;
        renderer.collect_times(true)?;
        renderer.time_lights(&mut told.lights);
        let traced = told.traced;
        self.moved = !rest;
        (self.traced, self.drawn_truth, self.coarse) = (told.truth, told.truth, coarse);
        let stays = due == Change::View && size == self.size;
        (self.gave_up, self.scale, self.size) = (false, scale, size);
        self.drawn = Some(order.clone());
        (self.analysed, self.mapped) = (whole_maps, None);
        (self.explained, self.told) = (analysis, None);
        let f = &mut self.facts;
        f.wall_clock = renderer.timer.mode() == TimerMode::Wall;
        f.passes = renderer.timer.by_name();
        let truth_ms = f.passes.iter().find(|p| p.0 == "truth").map_or(0.0, |p| p.1);
        self.costs.learn(scale, ms - truth_ms);
        if !draft {
            if f.recent.len() == RECENT {
                f.recent.pop_front();
            }
            f.recent.push_back(f.technique_ms(0));
            f.seconds.insert(info.id, (ms - truth_ms) * 1e-3);
        }
        (f.size, f.full, f.waits, f.told) = (size, order.full, waits, told);
        if !stays {
            f.error = None;
            f.notes.clear();
            self.counted = false;
            f.known.errors.clear();
        }
        let errors = std::mem::take(&mut f.known.errors);
        f.known = Known { errors, ..renderer.known()? };
        if let (Some(Some(first)), Some(causes)) = (f.known.errors.first_mut(), renderer.causes()) {
            first.causes = Some(causes.counts);
        }
        self.learn_truth(truth_ms, traced);
        self.facts.traced = match served {
            false => Traced::NotServed,
            true if coarse => Traced::Partly(Progress::default()),
            true => self.so_far(),
        };
        self.send(order, Some(rgba));
        if order.follow && !draft && !coarse && self.whole() && served && !order.setup.idles() {
            self.count(order)?;
        }
        Ok(())
    }

    fn so_far(&self) -> Traced {
        if self.whole() { Traced::Fully } else { Traced::Partly(self.traced) }
    }

    fn learn_truth(&mut self, ms: f64, samples: u64) {
        if ms > 0.0 && samples > 0 {
            let cost = (ms * 1e6 / samples as f64).max(0.01);
            self.truth_cost = cost.clamp(self.truth_cost / 4.0, self.truth_cost * 4.0);
        }
    }

    /// Draws the same frame in another view, or with more of the truth.
    fn redraw(&mut self, order: &Arc<Order>) -> Result<()> {
        let Some(renderer) = &mut self.renderer else { return Ok(()) };
        renderer.redraw(&order.setup)?;
        let rgba = renderer.read_picture()?;
        self.drawn_truth = self.traced;
        self.drawn = Some(order.clone());
        self.send(order, Some(rgba));
        Ok(())
    }

    /// Goes on with the truth.
    fn trace(&mut self, order: &Arc<Order>, shown: bool) -> Result<()> {
        let Some(renderer) = &mut self.renderer else { return Ok(()) };
        let (start, before) = (Instant::now(), self.traced.samples);
        self.traced = renderer.trace((TRUTH_MS * 1e6 / self.truth_cost) as u32)?;
        self.gpu.wait()?;
        renderer.collect_times(true)?;
        self.learn_truth(start.elapsed().as_secs_f64() * 1e3, self.traced.samples.saturating_sub(before));
        self.facts.traced = self.so_far();
        let (now, drawn) = (self.traced, self.drawn_truth);
        // Whole rows first, then a better mean of all.
        let step = now.covered - drawn.covered >= TRUTH_STEP || now.done - drawn.done >= 2.0 * TRUTH_STEP;
        // What is rendered anew for it is so only once it is whole.
        let again = order.same_frame(order) && order.setup.against.is_empty();
        let step = step && again;
        if shown && (step || now.covered >= 1.0 && drawn.covered < 1.0 || self.whole()) {
            return if again {
                self.redraw(order)
            } else {
                self.draw(order, (Change::View, true), self.scale, self.size, [true, shown])
            };
        }
        self.send(order, None);
        Ok(())
    }

    /// Hands one of the technique's maps in; of a frame that was not analysed after another that is.
    fn map(&mut self, order: &Arc<Order>, layer: u32, truth: [bool; 2]) -> Result<()> {
        if !self.analysed {
            self.draw(order, (Change::View, true), self.scale, self.size, truth)?;
        }
        let Some(renderer) = self.renderer.as_mut().filter(|_| self.analysed) else { return Ok(()) };
        let map = renderer.read_layer(layer)?;
        self.mapped = Some(layer);
        self.post.send(Done::Map(Box::new(map)));
        Ok(())
    }

    /// Tells the story of a pixel of the first side.
    fn tell(&mut self, order: &Arc<Order>, place: [f32; 2], truth: [bool; 2]) -> Result<()> {
        self.told = Some(place);
        if !truth[0] {
            let why = techniques::TRUTH.refuses(&order.setup.light).unwrap_or_default();
            self.post.send(Done::Story(Err(anyhow!(why))));
            return Ok(());
        }
        if !self.explained {
            self.draw(order, (Change::View, true), self.scale, self.size, truth)?;
            self.told = Some(place);
        }
        let frames = self.facts.told.frames;
        let Some(renderer) = self.renderer.as_mut().filter(|_| self.explained) else { return Ok(()) };
        let told = Seen::read(renderer).and_then(|seen| {
            let pixel = pixel_at(place, seen.size);
            story::tell(renderer, &order.setup, &seen, &[pixel], frames, true)
        });
        self.post.send(Done::Story(told.and_then(|mut told| told.pop().map(Box::new).context("no story"))));
        Ok(())
    }

    /// Counts the errors of the picture.
    fn count(&mut self, order: &Arc<Order>) -> Result<()> {
        let Some(renderer) = &mut self.renderer else { return Ok(()) };
        self.counted = true;
        let setup = &order.setup;
        self.facts.notes = renderer.notes()?;
        self.facts.scene_note = renderer.scene_note().map(str::to_owned);
        let visibility = renderer.read_visibility()?;
        let (hard, mean) = (renderer.read_labels()?, renderer.read_truth()?);
        let (mask, width) = (renderer.read_mask()?, renderer.read_width()?);
        let e = metrics::errors(&visibility, &hard, &mean, &mask, width);
        let size = panes(setup, self.size)[0].size;
        let mut errors = vec![Some(e)];
        for side in 1..setup.sides() {
            let seen = if setup.is_truth(side) { None } else { Some(renderer.read_side(side)?) };
            errors.push(seen.map(|visibility| metrics::errors(&visibility, &hard, &mean, &mask, width)));
        }
        if let Some(Some(first)) = errors.first_mut() {
            first.causes = renderer.causes().map(|c| c.counts);
        }
        self.facts.known.errors = errors;
        self.facts.error = Some([e.share(), e.rmse]);
        // Of several lights the errors are those of the light at work, and so are time and memory beside them.
        let light = self.facts.lights_of(0).iter().find(|l| l.light == setup.at_work());
        let light = light.filter(|_| setup.light_count() > 1);
        self.post.send(Done::Counted(Box::new(Record {
            technique: setup.technique.clone(),
            params: params_text(setup),
            width: size[0],
            height: size[1],
            gpu_bytes: light.map_or(self.facts.told.gpu_bytes, |l| l.gpu_bytes),
            gpu_ms: light.map_or(self.facts.technique_ms(0), |l| l.ms),
            truth_samples: setup.shown_samples(),
            error_share: e.share(),
            rmse: e.rmse,
            mae: e.mae,
            beyond_tolerance: e.beyond_tolerance,
            boundary_p95_px: e.boundary.map(|b| b.p95 as f64),
            ..Record::default()
        })));
        self.send(order, None);
        Ok(())
    }

    /// Hands in what is known, with a picture of the present size.
    fn send(&mut self, order: &Order, rgba: Option<Vec<u8>>) {
        self.facts.of = order.number;
        let picture = rgba.map(|rgba| Picture { size: self.size, full: order.full, rgba });
        self.post.send(Done::Drawn(Box::new(self.facts.clone()), picture));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::geometry::Geometry;

    /// Before anything is known all pixels are drawn. Then fewer, as long as that helps, and more again after a while.
    #[test]
    fn the_size_follows_what_frames_take() {
        // Of which half a second is spent on triangles.
        let takes = |scale: f64, fixed: f64| fixed + 300.0 * scale * scale;
        for (fixed, most) in [(0.0, 0.4), (20.0, 0.4), (500.0, 1.0)] {
            let mut costs = Costs(Default::default());
            let mut scale = costs.within(MOVING_MS, 1.0, 0.0);
            assert_eq!(scale, 1.0);
            let mut seen = Vec::new();
            for _ in 0..40 {
                costs.learn(scale, takes(scale, fixed));
                scale = costs.within(MOVING_MS, scale, 0.0);
                seen.push(scale);
            }
            let last = &seen[10..];
            let mean = last.iter().sum::<f64>() / last.len() as f64;
            if fixed < MOVING_MS {
                assert!(last.iter().all(|s| *s <= 0.5) && mean <= most, "{fixed}: {seen:?}");
            } else {
                // Fewer pixels are no help, and are tried now and then only.
                assert!(mean > 0.4, "{fixed}: {seen:?}");
            }
        }
    }

    fn order(change: impl FnOnce(&mut Order)) -> Order {
        let (setup, scene) = Setup::open("cubes").unwrap();
        let scene = Arc::new(scene);
        let (full, number) = ([64, 48], 0);
        let mut order =
            Order { number, setup, scene, full, moving: false, follow: false, paused: false, map: None, story: None };
        change(&mut order);
        order
    }

    /// What must be done anew for an order, and what of the last one stays.
    #[test]
    fn orders_tell_what_changed() {
        let base = order(|_| ());
        let like = |change: &dyn Fn(&mut Order)| {
            let scene = base.scene.clone();
            order(|o| {
                o.scene = scene;
                change(o);
            })
            .change(&base)
        };
        assert!(like(&|o| o.moving = true) == Change::Nothing);
        assert!(like(&|o| o.setup.size = [7, 7]) == Change::Nothing, "captures' size is none of the window's");
        assert!(like(&|o| o.setup.view = "error".into()) == Change::View);
        assert!(like(&|o| o.setup.split = 0.1) == Change::View);
        assert!(like(&|o| o.setup.technique = "pcf".into()) == Change::Technique);
        assert!(like(&|o| o.setup.set("bias=0.01", &["shadow-map".into()]).unwrap()) == Change::Technique);
        assert!(like(&|o| o.setup.set("pcf.bias=0.01", &[]).unwrap()) == Change::Nothing, "not the one selected");
        assert!(like(&|o| o.setup.camera.fov = 20.0) == Change::Scene);
        assert!(like(&|o| o.full = [64, 47]) == Change::Scene);
        assert!(order(|_| ()).change(&base) == Change::Scene, "loaded again");
    }

    /// A device that the driver drops is opened anew, and the picture comes back as it was. If it is dropped again at once, the window is
    /// told which adapters there are, and the one that it names goes on.
    #[test]
    fn a_lost_device_comes_back() {
        let (post, done) = Post::new(|| ());
        let adapter = Gpu::new(None).unwrap().info.name.clone();
        let mut stage = Stage::start(post, adapter.clone(), false);
        let (setup, scene) = Setup::open("cubes").unwrap();
        let (scene, geometry) = (Arc::new(scene.clone()), Geometry::new(&scene, 0, 0.0).unwrap());
        stage.ask(Request::Load(
            1,
            Box::new(Loaded { setup: setup.clone(), scene: scene.clone(), geometry, bare: true }),
        ));
        let next = || done.recv_timeout(Duration::from_secs(60)).expect("the scene's thread answers");
        assert!(matches!(next(), Done::Opened(1, Ok(_))));
        let show = |stage: &mut Stage, view: &str| {
            let setup = Setup { view: view.into(), ..setup.clone() };
            stage.order(order(|o| (o.setup, o.scene) = (setup, scene.clone())))
        };
        // What comes before the picture of an order, but for figures.
        let picture = |number: u64| {
            let mut before = Vec::new();
            loop {
                match next() {
                    Done::Drawn(facts, Some(picture)) if facts.of == number => return (picture.rgba, before),
                    Done::Drawn(..) | Done::Counted(_) => {}
                    other => before.push(other),
                }
            }
        };
        let number = show(&mut stage, "shaded");
        let (right, before) = picture(number);
        assert!(before.is_empty() && right.chunks(4).any(|p| p != &right[..4]));
        stage.ask(Request::Lose);
        let number = show(&mut stage, "albedo");
        let (_, before) = picture(number);
        assert!(matches!(&before[..], [Done::Reopened(e)] if Failure::is_loss(e)));
        let number = show(&mut stage, "shaded");
        assert!(picture(number).0 == right);

        stage.ask(Request::Lose);
        let number = show(&mut stage, "albedo");
        let adapters = loop {
            match next() {
                Done::Lost(e, adapters) if Failure::is_loss(&e) => break adapters,
                Done::Drawn(_, None) => {}
                Done::Drawn(facts, _) => assert!(facts.of < number),
                // Figures of the frame before, where there was time for them.
                Done::Counted(_) => {}
                Done::Lost(e, _) | Done::Reopened(e) | Done::Failed(e) | Done::Broken(e) => {
                    panic!("told otherwise: {e:#}")
                }
                _ => panic!("only that the device is lost is to be told"),
            }
        };
        assert!(adapters.contains(&adapter), "{adapters:?}");
        stage.ask(Request::Adapter(adapter));
        assert!(picture(number).1.is_empty());
        let number = show(&mut stage, "shaded");
        assert!(picture(number).0 == right);
        stage.close();
    }
}
