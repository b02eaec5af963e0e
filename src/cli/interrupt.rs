//! Ctrl-C, or a closed terminal, while something is measured or drawn: it ends at its next step, what there is stays, and the program says what that is.

use crate::gpu::{GivenUp, Gpu};
use crate::measure::STOPPED;
use crate::message::tell;
use anyhow::{Context, Error, Result};
use std::fmt;
use std::process::ExitCode;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// What shells say of a program that Ctrl-C has ended.
const INTERRUPTED: u8 = 130;

/// Nobody presses again sooner, having waited in vain.
const TWICE: Duration = Duration::from_millis(300);

static ASKED: AtomicBool = AtomicBool::new(false);

/// Whether Ctrl-C was pressed.
pub fn asked() -> bool {
    ASKED.load(Ordering::Relaxed)
}

/// A device whose frames are given up once Ctrl-C is pressed. Pressed again it ends the program at once.
pub fn device(adapter: Option<&str>) -> Result<Gpu> {
    static LISTENS: OnceLock<Result<(), ctrlc::Error>> = OnceLock::new();
    let gpu = Gpu::new(adapter)?;
    let listens = LISTENS.get_or_init(|| {
        let mut first: Option<Instant> = None;
        ctrlc::set_handler(move || {
            ASKED.store(true, Ordering::Relaxed);
            // A shell and what runs the program for it may both pass one press on.
            if first.get_or_insert_with(Instant::now).elapsed() > TWICE {
                std::process::exit(INTERRUPTED.into());
            }
        })
    });
    listens.as_ref().context("the program cannot listen for Ctrl-C")?;
    gpu.give_up_when(asked);
    Ok(gpu)
}

/// What is kept of work that Ctrl-C has stopped: a sentence without its full stop.
#[derive(Debug)]
pub struct Stopped(pub String);

impl fmt::Display for Stopped {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "stopped: {}", self.0)
    }
}

impl std::error::Error for Stopped {}

/// Whether work has failed for no other reason than that it was to stop.
pub fn stopped(error: &Error) -> bool {
    asked() && (error.is::<Stopped>() || error.is::<GivenUp>() || error.root_cause().to_string() == STOPPED)
}

/// What work came to that may have been stopped; `kept` says what there is of it then.
pub fn kept<T>(done: Result<T>, kept: impl FnOnce() -> String) -> Result<T> {
    done.map_err(|error| if stopped(&error) { Stopped(kept()).into() } else { error })
}

/// Says what is kept, where an error says that work was stopped.
pub fn told(error: &Error) -> Option<ExitCode> {
    if !stopped(error) {
        return None;
    }
    match error.downcast_ref::<Stopped>() {
        Some(stopped) => tell!("{stopped}"),
        None => tell!("{}", Stopped("nothing is written".into())),
    }
    Some(ExitCode::from(INTERRUPTED))
}
