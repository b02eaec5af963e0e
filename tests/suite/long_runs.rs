//! Long runs: a day's switching in fast forward, through the window's own model and panel and through the renderer that window and
//! command line share. Nothing grows beyond a bound, no device reports anything, nobody panics.

use crate::common::{Random, strict};
use crate::gltf::motion::turntable;
use crate::panel::{self, State};
use egui_kittest::Harness;
use glam::Vec3;
use shadowscope::capture;
use shadowscope::frame::{Ask, History, Renderer, Truth};
use shadowscope::gallery;
use shadowscope::gpu::{self, Gpu};
use shadowscope::lessons;
use shadowscope::light::Light;
use shadowscope::measure;
use shadowscope::params::{Kind, Value};
use shadowscope::scene::builtin::{self, cases};
use shadowscope::scene::geometry::Geometry;
use shadowscope::scene::{Camera, Clock, Scene};
use shadowscope::setup::{Arrange, Overlay, Setup, Side, load_scene, parse_light};
use shadowscope::techniques::{self, Info};
use shadowscope::truth::Samples;
use shadowscope::ui::{Action, Model, Tab, Words};
use shadowscope::view::VIEWS;
use std::alloc::{GlobalAlloc, Layout, System};
use std::process::Command;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

/// Eight hours with something switched every five seconds.
const DAY: usize = 8 * 3600 / 5;
/// Switches between two looks at the memory.
const LAP: usize = 96;
/// Frames of a flight at the end of each lap: cheap ones, for what a frame may leave behind.
const FLIGHT: usize = 240;

/// What is held, seen with the same small scene open and the same set-up drawn.
#[derive(Clone, Copy, Debug, Default)]
struct Held {
    /// Bytes that the process has in memory, that Rust has of them, and that the device has given out.
    resident: u64,
    heap: u64,
    device: u64,
    /// Objects of the graphics library: pipelines, each of which has a layout, and all others together.
    pipelines: usize,
    objects: usize,
}

/// The process's resident memory, bytes, without what the C library's allocator keeps for later. Linux tells; elsewhere it is not looked at.
fn resident() -> u64 {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    {
        unsafe extern "C" {
            fn malloc_trim(pad: usize) -> std::ffi::c_int;
        }
        // SAFETY: it may be called at any time.
        unsafe { malloc_trim(0) };
    }
    let text = std::fs::read_to_string("/proc/self/statm").unwrap_or_default();
    text.split(' ').nth(1).and_then(|pages| pages.parse::<u64>().ok()).unwrap_or(0) * 4096
}

/// The system's allocator, counting what Rust has of it: a driver and its compiler have their own.
struct Counting;

static HEAP: AtomicUsize = AtomicUsize::new(0);

// SAFETY: each call goes to the system's allocator as it came.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        HEAP.fetch_add(layout.size(), Ordering::Relaxed);
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        HEAP.fetch_add(layout.size(), Ordering::Relaxed);
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        HEAP.fetch_sub(layout.size(), Ordering::Relaxed);
        unsafe { System.dealloc(at, layout) }
    }

    unsafe fn realloc(&self, at: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        HEAP.fetch_add(size, Ordering::Relaxed);
        HEAP.fetch_sub(layout.size(), Ordering::Relaxed);
        unsafe { System.realloc(at, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

struct Day {
    harness: Harness<'static, State>,
    instance: wgpu::Instance,
    gpu: Arc<Gpu>,
    renderer: Option<Renderer>,
    random: Random,
    techniques: Vec<&'static Info>,
    scenes: Vec<String>,
    /// Fewer pixels and no scenes but small ones.
    short: bool,
    /// No other scene is opened: one renderer sees it all.
    stays: bool,
    frames: usize,
    switches: usize,
    /// Rows measured and pictures captured.
    measured: [usize; 2],
    /// What was switched last.
    last: String,
}

impl Day {
    fn new(techniques: Vec<&'static Info>, scenes: Vec<String>, seed: u64, short: bool) -> Day {
        let instance = gpu::instance();
        let gpu = strict(Gpu::on(&instance, None, None).unwrap());
        let mut day = Day {
            harness: panel::harness("cubes", 800.0),
            instance,
            gpu: Arc::new(gpu),
            renderer: None,
            random: Random(seed),
            techniques,
            scenes,
            short,
            stays: false,
            frames: 0,
            switches: 0,
            measured: [0; 2],
            last: String::new(),
        };
        day.open("cubes");
        day
    }

    fn model(&mut self) -> &mut Model {
        &mut self.harness.state_mut().model
    }

    fn setup(&self) -> Setup {
        self.harness.state().model.setup.clone()
    }

    /// A whole number below `n`.
    fn below(&mut self, n: usize) -> usize {
        ((self.random.next() * n as f32) as usize).min(n - 1)
    }

    fn pick<T: Clone>(&mut self, of: &[T]) -> T {
        of[self.below(of.len())].clone()
    }

    /// Takes another scene onto the device, as the window's threads do: geometry first, then the renderer, then the model.
    fn load(&mut self, mut setup: Setup, scene: Scene, restored: bool) {
        setup.count_from(scene.origin);
        let geometry = Geometry::new(&scene, 0, 0.0).unwrap();
        let (scene, bounds) = (Arc::new(scene), geometry.bounds);
        let renderer = Renderer::with_geometry(self.gpu.clone(), scene.clone(), geometry).unwrap();
        self.renderer = Some(renderer);
        let m = self.model();
        m.loading = None;
        match !restored && m.awaits(&setup) {
            true => m.arrive(setup, scene, bounds),
            false => m.open(setup, scene, bounds, restored),
        }
    }

    fn open(&mut self, name: &str) {
        let (setup, scene) = Setup::open_for(name, &[&self.setup().technique]).unwrap();
        self.load(setup, scene, false);
    }

    /// Does what the panel asks the window for, as far as it concerns the scene.
    fn act(&mut self) {
        for action in std::mem::take(&mut self.harness.state_mut().actions) {
            match action {
                // As if it were cancelled.
                Action::Restore(_) if self.stays => {
                    let m = self.model();
                    m.loading = None;
                    m.keep_history();
                }
                Action::Restore(setup) => {
                    let scene = load_scene(&setup.scene).unwrap();
                    self.load(*setup, scene, true);
                }
                Action::Open(name) if builtin::is_builtin(&name) => self.open(&name),
                Action::Step => {
                    let plan = self.model().lesson.as_ref().map(|r| r.lesson.steps[r.step].scene.clone()).unwrap();
                    let (setup, scene) = plan.open().unwrap();
                    self.load(setup, scene, false);
                }
                _ => {}
            }
        }
    }

    fn take(&mut self, action: Option<Action>) {
        self.harness.state_mut().actions.extend(action);
        self.act();
    }

    /// A value of a parameter, cheap ones of those that count something.
    fn value(&mut self, kind: Kind) -> Value {
        match kind {
            Kind::Flag { .. } => Value::Bool(self.below(2) == 0),
            Kind::Int { min, max, step, .. } => {
                let steps = ((max - min) / step).min(8) as usize;
                Value::Int(min + step * self.below(steps + 1) as i64)
            }
            Kind::Float { min, max, .. } => Value::Float(min + (max - min) * f64::from(self.random.next()).powi(2)),
            Kind::Choice { options, .. } => Value::Text(self.pick(options).into()),
        }
    }

    /// Changes the set-up, if what comes out can be drawn.
    fn change(&mut self, change: impl FnOnce(&mut Setup)) {
        let mut setup = self.setup();
        change(&mut setup);
        setup.complete();
        let m = self.model();
        setup.count_from(m.scene.origin);
        if setup.check().is_ok() {
            m.setup = setup;
        }
    }

    fn light(&mut self) -> Light {
        let scene = self.model().scene.clone();
        let bounds = self.model().bounds;
        let (middle, half) = (bounds[0].midpoint(bounds[1]), 0.5 * (bounds[1] - bounds[0]).length());
        let at = middle + self.random.point().with_y(self.random.next() + 0.1) * half;
        let to = middle - at;
        let text = |p: Vec3| format!("{},{},{}", p.x, p.y, p.z);
        let kinds = [
            format!("sun:angular_radius={}", self.random.next()),
            format!("directional:to_light={}", text(-to.normalize_or(Vec3::Y))),
            format!("spot:position={};direction={};outer_angle=40;range={}", text(at), text(to), 4.0 * half),
            format!("omni:position={};range={};radius=0.1", text(at), 4.0 * half),
            format!("hemisphere:position={};direction=0,-1,0;range={}", text(at), 4.0 * half),
            format!("rect-area:center={};half_u=0.5,0,0;half_v=0,0,0.5;range={}", text(at), 4.0 * half),
        ];
        let clock = self.setup().clock();
        match self.below(8) {
            i if i < kinds.len() => parse_light(&scene, &kinds[i], clock).unwrap_or(scene.lights[0].light),
            _ => self.pick(&scene.lights).at(&scene, clock),
        }
    }

    /// One switch of anything.
    fn switch(&mut self) {
        self.switches += 1;
        let what = self.below(24);
        self.last = format!("switch {} of kind {what}", self.switches);
        match what {
            0..=3 => {
                let info = self.pick(&self.techniques.clone());
                self.model().select(info);
                self.cheapen();
            }
            4..=7 => {
                let Some(info) = self.model().edited() else { return };
                let specs: Vec<_> = info.specs().collect();
                let spec = self.pick(&specs);
                let value = self.value(spec.kind);
                let m = self.model();
                let before = m.edited_values().insert(spec.name.into(), value);
                if m.setup.check().is_err() {
                    let held = m.edited_values();
                    match before {
                        Some(old) => held.insert(spec.name.into(), old),
                        None => held.remove(spec.name),
                    };
                }
            }
            8 | 9 => {
                let setup = self.setup();
                let info = techniques::find(&setup.technique).unwrap();
                let own = info.views(setup.values()).map(|v| v.id);
                let all: Vec<&str> = VIEWS.iter().map(|v| v.id).chain(own).collect();
                let view = self.pick(&all);
                let overlay = (self.below(3) == 0).then(|| Overlay {
                    view: view.into(),
                    opacity: 0.5,
                    inset: self.switches.is_multiple_of(2),
                });
                self.change(|s| {
                    s.view = if overlay.is_some() { "shaded".into() } else { view.into() };
                    s.overlay = overlay;
                });
            }
            10 => {
                let light = self.light();
                self.change(|s| {
                    s.light = light;
                    s.fit_path();
                });
            }
            11 => {
                let (light, how) = (self.light(), self.below(4));
                self.change(|s| match (how, s.light_count()) {
                    (0 | 1, 1..4) => _ = s.add_light(light),
                    (2, n) => s.switch_light(n / 2, n % 2 == 0),
                    (_, 2..) => s.remove_light(0),
                    _ => {}
                });
            }
            12 | 13 => {
                let (scene, by) = (self.model().scene.clone(), 0.2 * self.random.point());
                let clock = self.setup().clock();
                let named = self.pick(&scene.cameras).at(&scene, clock);
                let how = self.below(3);
                self.change(|s| match how {
                    0 => s.camera = named,
                    1 => s.camera.position += by * s.camera.reach(),
                    _ => s.shadow_camera = if s.shadow_camera.is_none() { Some(s.camera) } else { None },
                });
            }
            14 => {
                let sizes: &[[u32; 2]] =
                    if self.short { &[[32, 18], [33, 20]] } else { &[[64, 36], [97, 55], [32, 48], [160, 90]] };
                let size = self.pick(sizes);
                let samples = self.pick(&[Samples::Auto, Samples::Fixed(1), Samples::Fixed(4)]);
                self.change(|s| (s.size, s.truth_samples) = (size, samples));
            }
            15 => {
                let time = self.model().duration() * self.random.next();
                let clock = Clock { time, ..self.setup().clock() };
                self.model().set_clock(clock);
            }
            16 if !self.stays => {
                let name = self.pick(&self.scenes.clone());
                self.open(&name);
                self.cheapen();
            }
            17 => {
                let (info, arrange) = (self.pick(&self.techniques.clone()), self.pick(&Arrange::ALL));
                let m = self.model();
                match m.setup.sides() {
                    1 | 2 => m.add_side(Side::new(info.id).unwrap()),
                    n => (1..n).rev().for_each(|side| m.remove_side(side)),
                }
                m.setup.arrange = arrange;
                m.setup.complete();
                self.cheapen();
            }
            18 => {
                let action = if self.below(3) == 0 { self.model().redo() } else { self.model().undo() };
                self.take(action);
            }
            19 => {
                let tab = self.pick(&[Tab::Chart, Tab::Stability, Tab::Advice, Tab::Pixel, Tab::Figure]);
                self.model().toggle(tab);
            }
            20 => {
                let how = self.below(7);
                let m = self.model();
                match how {
                    0 => m.show_help = !m.show_help,
                    1 => m.words = if m.words.is_none() { Some(Words::default()) } else { None },
                    2 => m.toggle_start(),
                    3 => m.toggle_lab(),
                    4 => m.maps.toggle(),
                    5 => m.toggle_panel(),
                    _ => m.find(),
                }
            }
            21 if !self.stays => {
                let lesson = self.pick(&lessons::all().iter().collect::<Vec<_>>());
                let exhibit = self.pick(&gallery::all().iter().collect::<Vec<_>>());
                match self.below(2) {
                    // Lessons and set-ups of the gallery open scenes that may be large.
                    _ if self.short => {}
                    0 => {
                        let action = self.model().begin(lesson, 0);
                        self.take(action);
                    }
                    _ => {
                        let (setup, scene) = exhibit.open().unwrap();
                        self.load(setup, scene, false);
                    }
                }
                self.cheapen();
            }
            22 => self.measure(),
            _ => self.look(),
        }
    }

    /// As few texels, samples and pixels as there may be: frames are to be many.
    fn cheapen(&mut self) {
        let size = if self.short { [32, 18] } else { [64, 36] };
        self.change(|s| {
            let size = if s.size[0] > 160 { size } else { s.size };
            (s.size, s.supersample, s.crop) = (size, 1, None);
            let sides = s.sides();
            for side in 0..sides {
                let Some(info) = s.info(side) else { continue };
                let small = [("resolution", 128), ("vpls", 32), ("points", 512), ("samples", 4)];
                for (name, most) in small {
                    let Some(spec) = info.specs().find(|spec| spec.name == name) else { continue };
                    let Kind::Int { min, .. } = spec.kind else { continue };
                    let value = Value::Int(most.max(min));
                    match side.checked_sub(1) {
                        None => _ = s.params.entry(info.id.into()).or_default().insert(name.into(), value),
                        Some(i) => _ = s.against[i].params.insert(name.into(), value),
                    }
                }
            }
        });
    }

    /// Measures a row and writes a picture, as the window's threads do beside it.
    fn measure(&mut self) {
        let setup = self.setup();
        let small = Setup { size: [32, 18], ..setup };
        let renderer = self.renderer.as_mut().unwrap();
        // A light that is not served, or none: the window says so.
        let row = measure::accuracy(renderer, &small.measured(), 0);
        self.measured[0] += row.is_ok() as usize;
        self.measured[1] += capture::picture(renderer, &small, History::Whole).is_ok() as usize;
        self.model().adopt(row);
        self.frames += 2;
    }

    /// Reads values, a map and a pass's texture, as the pointer asks for them.
    fn look(&mut self) {
        let (setup, place) = (self.setup(), [self.random.next(), self.random.next()]);
        let renderer = self.renderer.as_mut().unwrap();
        renderer.whole_maps = true;
        renderer.draw(&setup, Ask { analysis: true, timed: true, ..Ask::of(&setup) }).unwrap();
        renderer.whole_maps = false;
        let pixel = shadowscope::frame::pixel_at(place, setup.size);
        if setup.sides() == 1 {
            renderer.value_at(pixel).unwrap();
            renderer.position_at(pixel).unwrap();
        }
        let map = renderer.read_layer(0).unwrap();
        let passes = renderer.timer.by_name();
        if let Some((pass, _)) = passes.get(passes.len() / 2) {
            renderer.shot(&setup, 0, pass).unwrap();
        }
        let m = self.model();
        if let Some(map) = map.filter(|_| m.maps.wanted().is_some()) {
            m.maps.take(map);
        }
        self.frames += 2;
    }

    /// Draws the set-up, and says in the panel what the frame told.
    fn draw(&mut self, ask: Ask) {
        let setup = self.setup();
        let last = self.last.clone();
        let renderer = self.renderer.as_mut().unwrap();
        let told = renderer.draw(&setup, ask);
        let told = told.unwrap_or_else(|e| panic!("{last}: {e:#}\n{}", serde_json::to_string(&setup).unwrap()));
        renderer.read_picture().unwrap();
        renderer.collect_times(true).unwrap();
        let (passes, known) = (renderer.timer.by_name(), renderer.known().unwrap());
        let facts = &mut self.model().facts;
        (facts.size, facts.full, facts.passes, facts.known, facts.told) = (ask.size, ask.size, passes, known, told);
        if facts.recent.len() == 200 {
            facts.recent.pop_front();
        }
        facts.recent.push_back(facts.technique_ms(0));
        self.frames += 1;
    }

    /// What happens between two looks at the memory.
    fn lap(&mut self, switches: usize, flight: usize) -> Held {
        for _ in 0..switches {
            self.switch();
            // An undone step of another scene, or what a lesson opens, comes in on the way.
            self.harness.step();
            self.act();
            let setup = self.setup();
            let [moving, timed, fresh] = [(); 3].map(|()| self.below(3) == 0);
            let truth = [Truth::Off, Truth::Some(500), Truth::All][self.below(3)];
            let history = if moving { History::Goes } else { History::Starts };
            self.draw(Ask { truth, timed, fresh, history, ..Ask::of(&setup) });
            if moving {
                self.change(|s| s.camera.position += 0.01 * s.camera.reach());
                self.draw(Ask { truth, timed, history, ..Ask::of(&setup) });
            }
        }
        self.home();
        let start: Camera = self.setup().camera;
        for i in 0..flight {
            let by = Vec3::new((i as f32 * 0.1).sin(), 0.1, (i as f32 * 0.07).cos());
            self.change(|s| s.camera.position = start.position + by);
            let setup = self.setup();
            self.draw(Ask { truth: Truth::Some(64), timed: i % 2 == 0, history: History::Goes, ..Ask::of(&setup) });
            if i % 16 == 0 {
                self.harness.step();
            }
        }
        self.home();
        self.held()
    }

    /// The same place each time, so that what is held can be compared.
    fn home(&mut self) {
        if !self.stays || self.setup().scene != "cubes" {
            self.open("cubes");
        }
        let technique = self.techniques[0];
        self.change(|s| {
            *s = Setup { size: [32, 18], params: Default::default(), ..s.measured() };
            s.technique = technique.id.into();
        });
        self.cheapen();
        let m = self.model();
        (m.lesson, m.words, m.drawer, m.show_help) = (None, None, None, false);
        (m.lab.shown, m.start.shown) = (false, false);
        self.harness.step();
        let setup = self.setup();
        self.draw(Ask::of(&setup));
        self.gpu.wait().unwrap();
        self.gpu.check().unwrap();
    }

    fn held(&self) -> Held {
        let report = self.instance.generate_report().expect("the graphics library counts its objects");
        let hub = report.hub_report();
        let others = [
            &hub.pipeline_layouts,
            &hub.bind_groups,
            &hub.shader_modules,
            &hub.command_buffers,
            &hub.query_sets,
            &hub.buffers,
            &hub.textures,
            &hub.texture_views,
            &hub.samplers,
        ];
        Held {
            resident: resident(),
            heap: HEAP.load(Ordering::Relaxed) as u64,
            device: self.gpu.device.generate_allocator_report().map_or(0, |r| r.total_allocated_bytes),
            pipelines: hub.render_pipelines.num_kept_from_user + hub.compute_pipelines.num_kept_from_user,
            objects: others.iter().map(|r| r.num_kept_from_user).sum(),
        }
    }
}

/// What the process may have grown by after warming up, bytes. Of software adapters llvmpipe keeps up to 1024 variants of shaders, each
/// compiled for other kinds of textures, before it lets go of those that were used longest ago: 2 to 3 MiB each.
const RESIDENT: u64 = 3 << 30;
/// The same of Rust's own heap, which undo's steps and measured rows fill: 200 of the ones, and of the others as many as were measured.
const HEAP_MORE: u64 = 24 << 20;
/// The same of the device, and of its objects: with the same picture drawn they are the same, but for textures that round up.
const DEVICE: u64 = 4 << 20;
const OBJECTS: usize = 64;
/// Most pipelines: those that a device keeps, hardware and software, and those of the renderer's own.
const PIPELINES: [usize; 2] = [512 + 128, 128 + 128];

/// Runs laps after a tour of all techniques, and compares what is held behind each with what was behind the first `warm` of them.
fn watched(mut day: Day, laps: usize, (switches, flight): (usize, usize), warm: usize) {
    let start = Instant::now();
    let tell = |what: &str, day: &Day, h: Held| {
        println!(
            "{what:>9}: {:6.0} s, {:5} switches, {:6} frames; resident {:6.1} MiB, heap {:6.2} MiB, device {:5.1} MiB, {} pipelines, {} others",
            start.elapsed().as_secs_f64(),
            day.switches,
            day.frames,
            h.resident as f64 / 1048576.0,
            h.heap as f64 / 1048576.0,
            h.device as f64 / 1048576.0,
            h.pipelines,
            h.objects,
        );
    };
    day.home();
    tell("start", &day, day.held());
    for light in ["sun:angular_radius=0.5", "omni:position=0,6,2;range=60;radius=0.1"] {
        for info in day.techniques.clone() {
            let (scene, clock) = (day.model().scene.clone(), day.setup().clock());
            let light = parse_light(&scene, light, clock).unwrap();
            day.change(|s| s.light = light);
            day.last = format!("the tour's {}", info.id);
            day.model().select(info);
            day.cheapen();
            let ask = Ask::of(&day.setup());
            day.draw(ask);
        }
    }
    day.home();
    tell("tour", &day, day.held());
    let (mut behind, mut grown) = (Held::default(), Vec::new());
    // The first half in one scene, the second from scene to scene.
    let half = laps / 2;
    for lap in 1..=laps {
        day.stays = lap <= half;
        if lap == half + 1 {
            behind = Held::default();
        }
        let held = day.lap(switches, flight);
        tell(&format!("lap {lap}"), &day, held);
        if lap <= warm || (half + 1..=half + warm).contains(&lap) {
            behind = Held {
                resident: behind.resident.max(held.resident),
                heap: behind.heap.max(held.heap),
                device: behind.device.max(held.device),
                pipelines: behind.pipelines.max(held.pipelines),
                objects: behind.objects.max(held.objects),
            };
            continue;
        }
        let over = [
            ("objects of the graphics library", held.objects > behind.objects + OBJECTS),
            ("pipelines", held.pipelines > PIPELINES[day.gpu.software() as usize]),
            ("the device's memory", held.device > behind.device + DEVICE),
            ("the heap", held.heap > behind.heap + HEAP_MORE),
            ("the process's memory", held.resident > behind.resident + RESIDENT),
        ];
        let over = over.into_iter().filter(|(_, over)| *over);
        grown.extend(over.map(|(what, _)| format!("lap {lap}: {what}: {held:?} after {behind:?}")));
    }
    assert!(grown.is_empty(), "{grown:#?}");
    let least = switches * laps / 200;
    assert!(day.measured.iter().all(|n| *n >= least), "{:?} measured and captured", day.measured);
    assert!(day.switches >= laps * switches && day.frames >= laps * (switches + flight));
}

/// All techniques and scenes, one that is animated among them. `SHADOWSCOPE_SWITCHES` says of how many switches; a day has
/// [`DAY`] of them.
#[test]
#[ignore = "takes an hour and more; docs/testing.md has the command"]
fn a_day() {
    let said = std::env::var("SHADOWSCOPE_SWITCHES").ok();
    let switches = said.map_or(DAY, |said| said.parse().expect("SHADOWSCOPE_SWITCHES is a number"));
    let folder = tempfile::tempdir().unwrap();
    let animated = folder.path().join("turntable.glb");
    std::fs::write(&animated, turntable().glb()).unwrap();
    let own = ["cubes".to_string(), animated.to_str().unwrap().into()];
    let named = builtin::NAMES.iter().copied().chain(cases::CASES.iter().map(|case| case.id));
    let scenes = named.map(String::from).chain(own).collect();
    let day = Day::new(techniques::ALL.to_vec(), scenes, 18, false);
    let laps = switches.div_ceil(LAP).max(4);
    watched(day, laps, (LAP, FLIGHT), laps.div_ceil(8));
}

/// The same of a few techniques, in a process of its own, whose memory no other test changes.
#[test]
fn a_short_day_leaves_nothing_behind() {
    const CHILD: &str = "SHADOWSCOPE_SHORT_DAY";
    if std::env::var_os(CHILD).is_some() {
        let some = ["shadow-map", "pcf", "pssm", "cube", "rt-hard"].map(|id| techniques::find(id).unwrap());
        let scenes = ["cubes", "st-wire", "st-contact"].map(String::from);
        return watched(Day::new(some.to_vec(), scenes.to_vec(), 18, true), 4, (24, 24), 1);
    }
    let this = std::thread::current().name().unwrap().to_string();
    let mut child = Command::new(std::env::current_exe().unwrap());
    let out = child.args(["--exact", &this, "--nocapture"]).env(CHILD, "1").output().unwrap();
    let told = String::from_utf8_lossy(&out.stdout);
    assert!(out.status.success(), "{told}{}", String::from_utf8_lossy(&out.stderr));
    assert!(told.contains("lap 4"), "{told}");
}
