//! The journal: what a window has open outlives it, one window at a time, and damage to it costs no more than what is damaged.

use crate::panel::{click, harness};
use shadowscope::measure::Record;
use shadowscope::params::Value;
use shadowscope::ui::journal::{Due, Journal, left};
use shadowscope::ui::{Action, Model, Sweeping, Tab};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Has the journal written, as the window does.
fn write(journal: &mut Journal, m: &Model) -> bool {
    loop {
        match journal.due(m) {
            Due::Nothing => return false,
            Due::Later(wait) => std::thread::sleep(wait.min(Duration::from_secs(2))),
            Due::Write(write) => {
                assert!(matches!(journal.due(m), Due::Nothing), "two writings at once");
                let failed = journal.written(write());
                assert!(failed.is_none(), "{failed:?}");
                return true;
            }
        }
    }
}

/// The folders of windows.
fn folders(base: &Path) -> Vec<PathBuf> {
    std::fs::read_dir(base).into_iter().flatten().map(|entry| entry.unwrap().path()).collect()
}

/// Another technique, a parameter, rows, a sweep halfway.
fn change(m: &mut Model) {
    m.select(shadowscope::techniques::find("pcf").unwrap());
    m.edited_values().insert("kernel".into(), Value::Int(7));
    m.drawer = Some(Tab::Chart);
    m.left_out.insert("rt-hard");
    m.pinned.insert("kernel");
    m.picture_path = "elsewhere.png".into();
    let setup = serde_json::to_string(&m.setup.measured()).unwrap();
    m.adopt([Record { technique: "pcf".into(), gpu_ms: 1.5, setup, ..Record::default() }]);
    let base = m.setup.measured();
    m.sweeping = Some(Sweeping { base: base.clone(), left: vec![base], of: 3 });
}

#[test]
fn what_a_window_had_open_outlives_it() {
    let dir = tempfile::tempdir().unwrap();
    let base = dir.path().join("windows");
    let mut window = harness("cubes", 800.0);
    let mut journal = Journal::new(base.clone());
    assert!(!write(&mut journal, &window.state().model), "nothing has changed");
    assert!(folders(&base).is_empty());
    change(&mut window.state_mut().model);
    assert!(write(&mut journal, &window.state().model));
    assert!(!write(&mut journal, &window.state().model), "it stands there");
    assert_eq!(folders(&base).len(), 1);
    assert!(left(&base).is_empty(), "its window is still there");

    // The end of a process lets go of its lock, whatever ends it.
    let before = (window.state().model.setup.clone(), window.state().model.rows.clone());
    drop((journal, window));
    let found = left(&base);
    assert_eq!(found.len(), 1);
    assert!(left(&base).is_empty(), "one window offers it");
    assert_eq!((found[0].title.as_str(), found[0].closed), ("cubes, pcf", false));
    assert_eq!(found[0].told, Ok("ended unexpectedly, last changed just now, with one measured row".into()));

    // The start screen offers it.
    let mut next = harness("bench", 800.0);
    next.state_mut().model.start.shown = true;
    next.state_mut().model.start.left = found;
    next.run_steps(3);
    click(&mut next, "cubes, pcf");
    assert!(next.state().actions.contains(&Action::GoOn(0)), "{:?}", next.state().actions);

    let taken = next.state_mut().model.start.left.remove(0);
    let (setup, _, rest) = taken.open().unwrap();
    assert_eq!(setup, before.0);
    let m = &mut next.state_mut().model;
    m.setup = setup;
    rest.give(m);
    assert_eq!((m.drawer, m.picture_path.as_str(), m.rows.clone()), (Some(Tab::Chart), "elsewhere.png", before.1));
    assert!(m.left_out.contains("rt-hard") && m.pinned.contains("kernel") && m.unsaved.contains(&Tab::Chart));
    assert_eq!(m.sweeping.as_ref().map(|s| (s.left.len(), s.of)), Some((1, 3)));

    // The sweep is gone on with, until its last row is there.
    m.start.shown = false;
    next.run_steps(8);
    next.state_mut().actions.clear();
    click(&mut next, "Go on: 1 of 3 left");
    assert!(next.state().actions.contains(&Action::GoOnSweeping), "{:?}", next.state().actions);
    let m = &mut next.state_mut().model;
    m.swept(&Record { setup: "{}".into(), ..m.rows[0].clone() });
    assert_eq!(m.sweeping.as_ref().map(|s| s.left.len()), Some(1), "another row");
    m.swept(&m.rows[0].clone());
    assert_eq!(m.sweeping.as_ref().map(|s| s.left.len()), Some(0));

    // It goes once it stands in the journal of the window that has taken it over.
    let mut journal = Journal::new(base.clone());
    assert!(!write(&mut journal, m));
    journal.take(taken);
    assert_eq!(folders(&base).len(), 1);
    assert!(write(&mut journal, m));
    assert_eq!(folders(&base).len(), 1, "the old one is gone");

    // Closing keeps the set-up, and no rows: who closes has been asked about these.
    journal.close(m, &mut Vec::new()).unwrap();
    drop(journal);
    let found = left(&base);
    assert_eq!((found.len(), found[0].closed), (1, true));
    assert_eq!(found[0].told, Ok("closed just now".into()));
    let (setup, _, rest) = found[0].open().unwrap();
    assert_eq!(setup, m.setup);
    let rows = m.rows.len();
    m.sweeping = None;
    rest.give(m);
    assert_eq!((m.rows.len(), m.sweeping.is_none()), (rows, true));
}

/// A damaged journal is said, and is no hindrance; nor is one that cannot be written.
#[test]
fn damage_to_the_journal_is_one_sentence() {
    let dir = tempfile::tempdir().unwrap();
    let base = dir.path().join("windows");
    let mut window = harness("cubes", 800.0);
    let m = &mut window.state_mut().model;
    let mut damaged = |file: &str| {
        let mut journal = Journal::new(base.clone());
        assert!(!write(&mut journal, m));
        m.setup.seed += 1;
        assert!(write(&mut journal, m));
        drop(journal);
        let folder = folders(&base).pop().unwrap();
        std::fs::write(folder.join(file), "{ damaged").unwrap();
        left(&base).pop().unwrap()
    };
    let whole = damaged("setup.toml");
    assert!(whole.told.is_ok());
    let error = whole.open().map(|_| ()).unwrap_err();
    assert!(format!("{error:#}").contains("setup.toml is not a usable set-up"), "{error:#}");
    whole.forget();
    assert!(folders(&base).is_empty());
    let whole = damaged("window.json");
    let told = whole.told.clone().unwrap_err();
    assert!(told.contains("window.json is damaged") && !told.contains('\n'), "{told}");

    // Where nothing can be made it is said once.
    std::fs::write(dir.path().join("file"), "").unwrap();
    let mut journal = Journal::new(dir.path().join("file"));
    assert!(!write(&mut journal, m));
    m.setup.seed += 1;
    let mut failures = Vec::new();
    for _ in 0..2 {
        std::thread::sleep(Duration::from_millis(1050));
        let Due::Write(write) = journal.due(m) else { panic!("nothing is tried") };
        failures.extend(journal.written(write()));
    }
    assert_eq!(failures.len(), 1);
    let said = format!("{:#}", failures[0]);
    assert!(said.contains("would not survive a crash") && said.contains("cannot be made"), "{said}");
}
