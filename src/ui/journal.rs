//! The journal: what a window holds in memory alone stands on the disk too, as it was about a second ago, so that it outlives a crash.
//!
//! Each window has a folder of its own among the user's for state, and holds a lock in it that the system lets go of when the
//! program ends, however it ends. What nobody holds was left behind, and is offered to the next window.

use super::model::{Model, Sweeping, Tab};
use crate::figure::Spec;
use crate::files;
use crate::flatland::Flatland;
use crate::measure::{self, Record};
use crate::message;
use crate::scene::Scene;
use crate::setup::Setup;
use crate::techniques;
use anyhow::{Context, Result, anyhow};
use etcetera::BaseStrategy;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant, SystemTime};

/// Between two looks at what changed.
const PAUSE: Duration = Duration::from_secs(1);
/// Writing takes at most one part in so many of the time.
const SHARE: u32 = 20;
/// Folders of windows that ended unexpectedly, of which no more than these are kept: the newest.
const MOST: usize = 12;

const LOCK: &str = "lock";
const SETUP: &str = "setup.toml";
const WINDOW: &str = "window.json";
const ROWS: &str = "rows.csv";
const WORLD: &str = "world.toml";
const SHEET: &str = "figure.toml";

/// The folder of all windows' journals; None where there is no home.
pub fn folder() -> Option<PathBuf> {
    let folders = etcetera::choose_base_strategy().ok()?;
    Some(folders.state_dir().unwrap_or_else(|| folders.data_dir()).join("shadowscope").join("windows"))
}

/// A window without its set-up and figures.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Layout {
    /// It was closed, not torn away.
    closed: bool,
    /// Of the set-up, to be told before that is read.
    scene: String,
    technique: String,
    rows: usize,
    /// A sweep that has not come to its end.
    sweeping: Option<Sweeping>,
    drawer: Option<Tab>,
    panel: bool,
    legend: bool,
    editing: usize,
    left_out: BTreeSet<String>,
    pinned: BTreeSet<String>,
    picture_path: String,
    setup_path: String,
    chart_path: String,
}

/// What is kept of a window.
#[derive(Clone, PartialEq)]
struct Kept {
    setup: Setup,
    layout: Layout,
    world: Option<Flatland>,
    sheet: Option<Spec>,
    /// What tells measured rows from those that were there before: their number and the last one's time.
    rows: (usize, u64),
}

impl Kept {
    fn of(m: &Model) -> Kept {
        let names = |of: &BTreeSet<&'static str>| of.iter().map(|name| name.to_string()).collect();
        Kept {
            setup: m.setup.clone(),
            layout: Layout {
                closed: false,
                scene: m.setup.scene.clone(),
                technique: m.setup.technique.clone(),
                rows: m.rows.len(),
                sweeping: m.sweeping.clone(),
                drawer: m.drawer,
                panel: m.show_panel,
                legend: m.show_legend,
                editing: m.editing,
                left_out: names(&m.left_out),
                pinned: names(&m.pinned),
                picture_path: m.picture_path.clone(),
                setup_path: m.setup_path.clone(),
                chart_path: m.chart.path.clone(),
            },
            world: m.lab.can_undo().then(|| m.lab.now.world.clone()),
            sheet: (m.builder.spec != Spec::default()).then(|| m.builder.spec.clone()),
            rows: (m.rows.len(), m.rows.last().map_or(0, |row| row.gpu_ms.to_bits())),
        }
    }
}

/// The end that writes, one piece of work at a time.
struct Writer {
    base: PathBuf,
    /// The window's folder and its lock, once there is something to keep.
    own: Option<(PathBuf, File)>,
}

impl Writer {
    /// The window's folder.
    fn folder(&mut self) -> Result<PathBuf> {
        if let Some((folder, _)) = &self.own {
            return Ok(folder.clone());
        }
        let base = self.base.display();
        std::fs::create_dir_all(&self.base)
            .map_err(|e| anyhow!("the folder {base} cannot be made: {}", files::reason(&e)))?;
        let cannot = |e: std::io::Error| anyhow!("nothing can be made in {base}: {}", files::reason(&e));
        let folder = tempfile::Builder::new().prefix("").tempdir_in(&self.base).map_err(cannot)?.keep();
        let lock = File::create_new(folder.join(LOCK)).and_then(|lock| lock.lock().map(|()| lock)).map_err(cannot)?;
        self.own = Some((folder.clone(), lock));
        Ok(folder)
    }

    /// Writes what is kept, and rows where they are given.
    fn write(&mut self, kept: &Kept, rows: Option<&[Record]>) -> Result<()> {
        let folder = self.folder()?;
        let file = |name: &str| folder.join(name);
        // The rows first: what says how many there are stands behind them.
        match rows {
            Some([]) => remove(&file(ROWS)),
            Some(rows) => measure::write(rows, &file(ROWS), false)?,
            None => {}
        }
        files::save(&file(SETUP), kept.setup.to_toml(&file(SETUP))?.as_bytes())?;
        match &kept.world {
            Some(world) => files::save(&file(WORLD), world.to_toml()?.as_bytes())?,
            None => remove(&file(WORLD)),
        }
        match &kept.sheet {
            Some(spec) => files::save(&file(SHEET), spec.to_toml(&file(SHEET))?.as_bytes())?,
            None => remove(&file(SHEET)),
        }
        files::save(&file(WINDOW), serde_json::to_string_pretty(&kept.layout)?.as_bytes())
    }
}

/// Removes a file that may not be there.
fn remove(path: &Path) {
    let _ = std::fs::remove_file(path);
}

/// What is to be done for the journal.
pub enum Due {
    /// Nothing until something happens.
    Nothing,
    /// It is to be looked at again by then.
    Later(Duration),
    /// This is to be written, away from the window's thread; then [`Journal::written`] wants to know how it went.
    Write(Box<dyn FnOnce() -> Result<Duration> + Send>),
}

/// A window's journal.
pub struct Journal {
    writer: Arc<Mutex<Writer>>,
    /// What stands in it, or in no need of it: as the window opened.
    held: Option<Kept>,
    /// When it was looked at last.
    looked: Option<Instant>,
    pause: Duration,
    busy: bool,
    failed: bool,
    /// What this window has taken over from another one, whose folder goes once it stands in its own.
    taken: Option<Left>,
}

impl Journal {
    /// Of a window that keeps it in a folder of its own in `base`.
    pub fn new(base: PathBuf) -> Journal {
        Journal {
            writer: Arc::new(Mutex::new(Writer { base, own: None })),
            held: None,
            looked: None,
            pause: PAUSE,
            busy: false,
            failed: false,
            taken: None,
        }
    }

    /// Looks whether something has changed that is to be kept, at most every second.
    pub fn due(&mut self, m: &Model) -> Due {
        if self.busy {
            return Due::Nothing;
        }
        let left = self.looked.map_or(Duration::ZERO, |looked| self.pause.saturating_sub(looked.elapsed()));
        if !left.is_zero() {
            return Due::Later(left);
        }
        self.looked = Some(Instant::now());
        let now = Kept::of(m);
        let Some(held) = &self.held else {
            self.held = Some(now);
            return Due::Nothing;
        };
        if now == *held && self.taken.is_none() {
            return Due::Nothing;
        }
        let rows = (now.rows != held.rows || self.taken.is_some()).then(|| m.rows.clone());
        self.held = Some(now.clone());
        self.busy = true;
        let writer = self.writer.clone();
        Due::Write(Box::new(move || {
            let start = Instant::now();
            // What it holds is whole, whoever panicked.
            let mut writer = writer.lock().unwrap_or_else(PoisonError::into_inner);
            writer.write(&now, rows.as_deref())?;
            Ok(start.elapsed())
        }))
    }

    /// Takes in how writing went. What is to be said of it: a failure once.
    pub fn written(&mut self, done: Result<Duration>) -> Option<anyhow::Error> {
        self.busy = false;
        match done {
            Ok(took) => {
                self.pause = PAUSE.max(SHARE * took);
                self.failed = false;
                self.taken.take().into_iter().for_each(Left::forget);
                None
            }
            Err(e) => {
                // All of it is to be written the next time.
                if let Some(held) = &mut self.held {
                    held.rows = (usize::MAX, 0);
                }
                let again = std::mem::replace(&mut self.failed, true);
                (!again).then(|| e.context("what is open here would not survive a crash"))
            }
        }
    }

    /// Takes over what another window has left.
    pub fn take(&mut self, left: Left) {
        self.taken = Some(left);
    }

    /// The window is being closed: the next one can go on with the set-up. What else is in no file was asked about.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn close(&mut self, m: &Model, older: &mut Vec<Left>) -> Result<()> {
        let mut writer = self.writer.lock().unwrap_or_else(PoisonError::into_inner);
        let mut now = Kept::of(m);
        if writer.own.is_none() && self.held.as_ref().is_none_or(|held| *held == now) {
            return Ok(());
        }
        (now.layout.closed, now.layout.rows, now.layout.sweeping) = (true, 0, None);
        writer.write(&now, Some(&[]))?;
        self.taken.take().into_iter().for_each(Left::forget);
        older.extract_if(.., |left| left.closed).for_each(Left::forget);
        Ok(())
    }
}

/// What a window has left behind.
#[derive(Debug)]
pub struct Left {
    folder: PathBuf,
    /// Nobody else is to take it.
    _lock: File,
    layout: Box<Layout>,
    /// The scene that was open, and the technique.
    pub title: String,
    /// When and how the window ended; what is wrong with it.
    pub told: Result<String, String>,
    /// It was closed, not torn away.
    pub closed: bool,
}

/// What of a window is in no set-up.
pub struct Rest {
    layout: Layout,
    rows: Vec<Record>,
    world: Option<Flatland>,
    sheet: Option<Spec>,
}

/// What windows that are gone have left, the newest first. What is too old goes.
pub fn left(base: &Path) -> Vec<Left> {
    let entries = std::fs::read_dir(base).into_iter().flatten().flatten();
    let mut found: Vec<(SystemTime, Left)> = entries.filter_map(|entry| Left::find(entry.path())).collect();
    found.sort_by_key(|(at, _)| std::cmp::Reverse(*at));
    let (mut torn, mut closed) = (0, 0);
    let mut kept = Vec::new();
    for (_, left) in found {
        let count = if left.closed { &mut closed } else { &mut torn };
        *count += 1;
        match *count > if left.closed { 1 } else { MOST } {
            true => left.forget(),
            false => kept.push(left),
        }
    }
    kept
}

impl Left {
    /// What is in a window's folder, if that window is gone.
    fn find(folder: PathBuf) -> Option<(SystemTime, Left)> {
        // Opening a pipe would wait for someone.
        folder.join(LOCK).symlink_metadata().ok().filter(|about| about.is_file())?;
        let lock = File::options().write(true).open(folder.join(LOCK)).ok()?;
        if let Err(TryLockError::WouldBlock) = lock.try_lock() {
            return None;
        }
        let about = std::fs::metadata(folder.join(WINDOW)).ok();
        let at = about.and_then(|about| about.modified().ok()).unwrap_or(SystemTime::UNIX_EPOCH);
        let read = files::read_text(&folder.join(WINDOW)).and_then(|text| {
            serde_json::from_str::<Layout>(&text)
                .with_context(|| format!("{} is damaged", folder.join(WINDOW).display()))
        });
        let when = ago(SystemTime::now().duration_since(at).unwrap_or_default());
        let (layout, told) = match read {
            Ok(layout) => {
                let how = if layout.closed { "closed" } else { "ended unexpectedly, last changed" };
                let rows = match layout.rows {
                    0 => String::new(),
                    1 => ", with one measured row".into(),
                    n => format!(", with {n} measured rows"),
                };
                (layout, Ok(format!("{how} {when}{rows}")))
            }
            Err(e) => (Layout::default(), Err(message::sentence(&e))),
        };
        let title = match layout.scene.as_str() {
            "" => "What was open".into(),
            scene => {
                let path = files::path_of(scene);
                let name = path.file_name().map_or(scene.into(), |name| name.to_string_lossy().into_owned());
                format!("{}, {}", message::shortened(&name), message::shortened(&layout.technique))
            }
        };
        let closed = layout.closed;
        Some((at, Left { folder, _lock: lock, layout: Box::new(layout), title, told, closed }))
    }

    /// Opens it: the set-up with its scene, and the rest.
    ///
    /// # Errors
    /// A file that is damaged, or a scene that is no longer there; one sentence.
    pub fn open(&self) -> Result<(Setup, Scene, Rest)> {
        let file = |name: &str| self.folder.join(name);
        let path = file(SETUP).to_string_lossy().into_owned();
        let (setup, scene) = Setup::open(&path)?;
        let there = |name: &str| file(name).exists();
        let rows = if there(ROWS) { measure::read(&file(ROWS))? } else { Vec::new() };
        let world = there(WORLD).then(|| Flatland::from_toml(&files::read_text(&file(WORLD))?)).transpose()?;
        let sheet =
            there(SHEET).then(|| Spec::from_toml(&files::read_text(&file(SHEET))?, &file(SHEET))).transpose()?;
        Ok((setup, scene, Rest { layout: (*self.layout).clone(), rows, world, sheet }))
    }

    /// Lets go of it.
    pub fn forget(self) {
        // What cannot be removed is offered once more.
        let _ = std::fs::remove_dir_all(&self.folder);
    }
}

impl Rest {
    /// Gives the window that has opened the set-up all the rest.
    pub fn give(self, m: &mut Model) {
        let Rest { layout, rows, world, sheet } = self;
        m.adopt(rows);
        m.sweeping = layout.sweeping.or(m.sweeping.take());
        m.drawer = layout.drawer;
        (m.show_panel, m.show_legend) = (layout.panel, layout.legend);
        m.editing = layout.editing.min(m.setup.against.len());
        m.left_out = techniques::ALL.iter().map(|info| info.id).filter(|id| layout.left_out.contains(*id)).collect();
        let specs = techniques::ALL.iter().flat_map(|info| info.specs());
        m.pinned = specs.map(|spec| spec.name).filter(|name| layout.pinned.contains(*name)).collect();
        (m.picture_path, m.setup_path, m.chart.path) = (layout.picture_path, layout.setup_path, layout.chart_path);
        if let Some(world) = world {
            let path = m.lab.path.clone();
            m.lab.open(Path::new(&path), world);
        }
        if let Some(spec) = sheet {
            m.builder.spec = spec;
        }
    }
}

/// A time in words.
fn ago(time: Duration) -> String {
    let told = |n: u64, what: &str| if n == 1 { format!("one {what} ago") } else { format!("{n} {what}s ago") };
    match time.as_secs() {
        s if s < 60 => "just now".into(),
        s if s < 3600 => told(s / 60, "minute"),
        s if s < 86400 => told(s / 3600, "hour"),
        s => told(s / 86400, "day"),
    }
}
